"""Client of the mbcosim co-simulation server.

    import mbcosim

    with mbcosim.connect() as server, server.load("pendulum.mbd") as simulation:
        simulation.run_until(1.0)
        print(simulation.time, simulation["node.structural.1.X"])
"""
from .calls import Condition, StepResult
from .client import Server, connect, default_address
from .coupling import Peer, modal_port, motion_port, signal_port, structural_port
from .errors import (DeckError, Error, LimitExceeded, NotAllowed, NotFound, PreconditionFailed,
                     StepFailed, TimedOut, Unavailable)
from .exchange import Loads, Motion, Reject
from .simulation import Simulation, Snapshot, Stepper, Subscription

__all__ = [
    "connect", "default_address", "Server", "Simulation", "Snapshot", "StepResult", "Stepper", "Subscription", "Motion", "Loads",
    "Condition", "Reject",
    "Peer", "modal_port", "motion_port",
    "signal_port", "structural_port", "Error", "DeckError", "LimitExceeded", "NotAllowed", "NotFound", "PreconditionFailed", "StepFailed", "TimedOut", "Unavailable",
]
