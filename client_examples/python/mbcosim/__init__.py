"""Client of the mbcosim co-simulation server.

    import mbcosim

    with mbcosim.local() as server, server.load("pendulum.mbd") as simulation:
        history = simulation.simulate(until=1.0)
        history.plot(save="pendulum.png")

`local` starts a private daemon; `connect` uses one that runs.
"""
from ._version import __version__
from .access import default_address
from .analysis import Modes, StateSpace
from .calls import Condition, Geometry, StepResult, grant, units
from .client import Server, connect
from .coupling import Peer, modal_port, motion_port, signal_port, structural_port
from .errors import (Busy, DeckError, Error, LimitExceeded, NotAllowed, NotFound, PreconditionFailed,
                     StepFailed, TimedOut, Unavailable)
from .events import Events
from .exchange import Loads, Motion, ReferenceMotion, Reject
from .histories import History
from .local import LocalServer, connect_or_start, local
from .simulation import Simulation, Snapshot, Stepper, Subscription

__all__ = [
    "__version__", "connect", "connect_or_start", "local", "default_address", "Server", "LocalServer", "Simulation", "Snapshot", "StepResult",
    "Stepper", "Subscription", "Events", "History", "StateSpace", "Modes", "Motion", "ReferenceMotion", "Loads", "Condition", "Reject",
    "Peer", "modal_port", "motion_port", "signal_port", "structural_port", "Error", "DeckError", "LimitExceeded", "NotAllowed", "NotFound",
    "PreconditionFailed", "StepFailed", "TimedOut", "Unavailable", "Geometry", "Busy", "grant", "units",
]
