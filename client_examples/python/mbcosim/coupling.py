"""Peers: external codes that answer a running simulation's motion with loads, or its signals with signals.

    def spring(motion):
        return -100.0 * motion.x                     # forces on the nodes, n x 3 [N]

    ports = [mbcosim.structural_port("tip", nodes=[2])]
    with server.load("beam.mbd", ports=ports) as simulation, simulation.couple("tip", spring):
        simulation.run_until(1.0)
"""
import dataclasses
import queue
import threading

import grpc
import numpy as np

from mbcosim.v1 import coupling_pb2 as pb, coupling_types_pb2 as types

from .errors import from_rpc_error

_ROTATION_SIZE = {"matrix": 9, "vector": 3, "quaternion": 4, "euler_123": 3}


@dataclasses.dataclass
class Motion:
    """What the simulation sends. Arrays are n x 3 for n nodes, SI units, in the frame agreed."""
    step: int
    time: float            # of the values [s]
    target_time: float     # for which loads are wanted [s]
    iteration: int         # of a tight step, or pass of a window, from 1; 0: explicit
    x: np.ndarray
    rotations: np.ndarray  # n x 3 x 3 for "matrix", n x 4 for "quaternion", else n x 3
    v: np.ndarray
    w: np.ndarray
    a: np.ndarray          # empty unless agreed
    wp: np.ndarray
    signals: np.ndarray    # of a signal port


def structural_port(name, nodes, *, offsets=None, reference=None):
    """A port on structural nodes: motion out, forces and moments in. `offsets`: n x 3 in the nodes' frames [m]."""
    port = types.PortDefinition(name=name, kind=types.PORT_KIND_STRUCTURAL, node_labels=list(nodes))
    if offsets is not None:
        port.offsets_m.extend(np.ravel(np.asarray(offsets, float)))
    if reference is not None:
        port.reference_node_label = reference
    return port


def signal_port(name, outputs, inputs):
    """A port of scalars: variables out, inputs in, by name."""
    return types.PortDefinition(name=name, kind=types.PORT_KIND_SIGNAL, output_variables=list(outputs),
                                input_variables=list(inputs))


def _enum(kind, prefix, name):
    """Value of a choice; None leaves it to the server."""
    return 0 if name is None else kind.Value(prefix + name.upper())


class Peer:
    """An attached peer. A thread of its own calls `answer(Motion)` for each exchange.

    answer returns forces (n x 3), or (forces, moments), or the signals; an exception in it fails the step. On a port of the deck
    with reference loads it returns (forces, moments, force on the reference node, moment on it).
    every      steps between exchanges; "tight": iterations
    mode       "loose", "staggered", "tight" or "window"; None: the port's own, "loose" unless its deck says otherwise
    frame      "global", "node" or "reference"; None: the port's own, "reference" if its deck gives it a reference node
    After the end `error` has what ended the stream, None when it ended in good order.
    """

    def __init__(self, simulation, port, answer, *, mode=None, rotation="matrix", frame=None, accelerations=False,
                 every=1, hold="zero_order", timeout=10.0, policy="fail_step", acceleration="none", relaxation=0.5,
                 tolerance=1e-6, maximum_passes=50, check_model=True):
        hello = pb.Hello(
            simulation=simulation.name, port=port, rotation_form=_enum(types.RotationForm, "ROTATION_FORM_", rotation),
            frame=_enum(types.PortFrame, "PORT_FRAME_", frame), accelerations=accelerations,
            mode=_enum(types.CouplingMode, "COUPLING_MODE_", mode), every=every,
            input_hold=_enum(types.InputHold, "INPUT_HOLD_", hold), policy=_enum(types.PeerPolicy, "PEER_POLICY_", policy),
            acceleration=_enum(types.Acceleration, "ACCELERATION_", acceleration), relaxation=relaxation,
            interface_tolerance=tolerance, maximum_passes=maximum_passes, length_unit="m",
            model_digest=simulation.info.model_digest if check_model else "")
        hello.protocol.lowest = hello.protocol.highest = 1
        hello.peer_timeout.FromMilliseconds(int(timeout * 1000))
        self._answer, self._rotation = answer, rotation
        self._out = queue.SimpleQueue()
        self._out.put(pb.PeerMessage(hello=hello))
        self._stream = simulation._server.coupling.Attach(iter(self._out.get, None), metadata=simulation._server.metadata)
        try:
            self.welcome = next(self._stream).welcome
        except grpc.RpcError as error:
            raise from_rpc_error(error) from None
        self.error = None
        self.exchanges = 0
        self.accepted = []  # (step, time) of the implicit steps that ended
        self.rejected = []  # (step, time) to go back to, of those that failed
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Leaves the port."""
        self._out.put(None)
        self._thread.join(5)
        self._stream.cancel()

    def _serve(self):
        try:
            for message in self._stream:
                if message.HasField("exchange"):
                    self._out.put(pb.PeerMessage(exchange=self._compute(message.exchange)))
                    self.exchanges += 1
                elif message.HasField("accepted"):
                    self.accepted.append((message.accepted.step, message.accepted.time_s))
                elif message.HasField("rejected"):
                    self.rejected.append((message.rejected.step, message.rejected.time_s))
        except grpc.RpcError as error:
            self.error = from_rpc_error(error)

    def _compute(self, exchange):
        reply = pb.PeerExchange(index=exchange.index)
        try:
            answer = self._answer(self._motion(exchange))
            if exchange.positions_m:
                answers = answer if isinstance(answer, tuple) else (answer,)
                fields = (reply.forces_n, reply.moments_nm, reply.reference_force_n, reply.reference_moment_nm)
                for field, values in zip(fields, answers):
                    if values is not None:
                        field.extend(np.ravel(np.asarray(values, float)))
            else:
                reply.signals.extend(np.ravel(np.asarray(answer, float)))
        except Exception as error:  # whatever the user's code raises becomes a failed step with this text
            reply = pb.PeerExchange(index=exchange.index)
            reply.failure = f"{type(error).__name__}: {error}"
        return reply

    def _motion(self, exchange):
        def rows(values, width=3):
            return np.fromiter(values, float, len(values)).reshape(-1, width)

        rotations = rows(exchange.rotations, _ROTATION_SIZE[self._rotation])
        if self._rotation == "matrix":
            rotations = rotations.reshape(-1, 3, 3)
        return Motion(exchange.step, exchange.time_s, exchange.target_time_s, exchange.iteration, rows(exchange.positions_m),
                      rotations, rows(exchange.velocities_m_s), rows(exchange.angular_velocities_rad_s),
                      rows(exchange.accelerations_m_s2), rows(exchange.angular_accelerations_rad_s2),
                      np.fromiter(exchange.signals, float, len(exchange.signals)))
