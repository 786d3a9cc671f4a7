"""What crosses a port, as numpy arrays. Received arrays are views of the message's bytes: read-only, nothing is copied."""
import dataclasses
import struct

import numpy as np

from mbcosim.v1 import coupling_pb2 as pb, coupling_types_pb2 as types

from .words import choice

_ROTATION_SIZE = {"matrix": 9, "vector": 3, "quaternion": 4, "euler_123": 3}
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_EMPTY = np.zeros(0)


@dataclasses.dataclass
class Motion:
    """What the simulation sends. Arrays are n x 3 for n nodes, SI units, in the frame agreed; read-only."""
    step: int
    time: float            # of the values [s]
    target_time: float     # for which an answer is wanted [s]
    iteration: int         # of a tight step, or pass of a window, from 1; 0: explicit
    x: np.ndarray
    rotations: np.ndarray  # n x 3 x 3 for "matrix", n x 4 for "quaternion", else n x 3
    v: np.ndarray
    w: np.ndarray
    a: np.ndarray          # empty unless agreed
    wp: np.ndarray
    signals: np.ndarray    # of a signal port; of a modal one: the amplitudes, then their rates
    forces: np.ndarray     # of a motion port: reactions [N], and moments [N m]
    moments: np.ndarray
    target_estimated: bool  # the step may turn out to have another length


class Reject(Exception):
    """Raised by a peer's function, or returned as an answer: the step must not be done. It ends with outcome REJECTED_BY_PEER.

    `preferred_step_size` is what the peer would take [s]; None: unknown.
    """

    def __init__(self, preferred_step_size=None, text=""):
        super().__init__(text)
        self.preferred_step_size, self.text = preferred_step_size, text


@dataclasses.dataclass
class Loads:
    """What a peer answers with, when forces alone do not say it. Arrays of n rows for n nodes."""
    forces: object = None            # n x 3 [N]
    moments: object = None           # n x 3 about the points [N m]; None: zero
    reference_force: object = None   # 3 [N], on the reference node of a deck's port that wants it
    reference_moment: object = None  # 3 [N m]
    signals: object = None           # of signal and modal ports
    positions: object = None         # of motion ports: n x 3 imposed at `target_time` [m]
    rotations: object = None         # of motion ports, in the form agreed
    stiffness: object = None         # d(force, moment)/d(position, rotation): 6n x 6n, or n x 6 x 6 blocks
    damping: object = None           # the same with respect to (velocity, angular velocity)
    unfinished: bool = False         # the step must not end with this answer


def hello(simulation, port, *, mode=None, rotation="matrix", frame=None, accelerations=False, every=1, hold="zero_order",
          peer_timeout=10.0, policy="fail_step", acceleration="none", relaxation=0.5, tolerance=1e-6, maximum_passes=50,
          check_model=True, tangent="none", heartbeat_interval=None, heartbeat_timeout=None):
    """First message of a peer."""
    message = pb.Hello(
        simulation=simulation.name, port=port, rotation_form=_enum(types.RotationForm, "ROTATION_FORM_", rotation),
        frame=_enum(types.PortFrame, "PORT_FRAME_", frame), accelerations=accelerations,
        mode=_enum(types.CouplingMode, "COUPLING_MODE_", mode), every=every,
        input_hold=_enum(types.InputHold, "INPUT_HOLD_", hold), policy=_enum(types.PeerPolicy, "PEER_POLICY_", policy),
        acceleration=_enum(types.Acceleration, "ACCELERATION_", acceleration), relaxation=relaxation,
        interface_tolerance=tolerance, maximum_passes=maximum_passes, length_unit="m", force_unit="N", angle_unit="rad",
        model_digest=simulation.info.model_digest if check_model else "",
        tangent=_enum(pb.TangentForm, "TANGENT_FORM_", tangent))
    message.protocol.lowest = message.protocol.highest = 1
    message.peer_timeout.FromMilliseconds(int(peer_timeout * 1000))
    for field, seconds in ((message.heartbeat_interval, heartbeat_interval), (message.heartbeat_timeout, heartbeat_timeout)):
        if seconds is not None:
            field.FromMilliseconds(int(seconds * 1000))
    return pb.PeerMessage(hello=message)


def _enum(kind, prefix, name):
    """Value of a choice; None leaves it to the server."""
    return choice(kind, prefix, name, prefix.lower().strip("_").replace("_", " "))


# ---------------------------------------------------------------- received

def _varint(data, at):
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, at
        shift += 7


def _fields(data, at):
    """Number and value of every field: int, float or memoryview."""
    while at < len(data):
        key, at = _varint(data, at)
        number, kind = key >> 3, key & 7
        if kind == _VARINT:
            value, at = _varint(data, at)
        elif kind == _FIXED64:
            value, = struct.unpack_from("<d", data, at)
            at += 8
        elif kind == _BYTES:
            size, at = _varint(data, at)
            value = memoryview(data)[at:at + size]
            at += size
        elif kind == _FIXED32:
            value, at = None, at + 4
        else:
            raise ValueError("not a message of the server")
        yield number, value


def receive(data):
    """A message of the server: (name, content); the content of an "exchange" is a dict of its fields by number."""
    number, content = next(_fields(data, 0))
    if number == pb.ServerMessage.EXCHANGE_FIELD_NUMBER:
        return "exchange", dict(_fields(content, 0))
    message = pb.ServerMessage.FromString(data)
    name = message.WhichOneof("content")
    return name, getattr(message, name)


_E = pb.ServerExchange


def motion(fields, rotation):
    """The fields of an exchange as a Motion."""
    def rows(number, width=3):
        data = fields.get(number)
        return (np.frombuffer(data, "<f8") if data is not None else _EMPTY).reshape(-1, width)

    rotations = rows(_E.ROTATIONS_FIELD_NUMBER, _ROTATION_SIZE[rotation])
    if rotation == "matrix":
        rotations = rotations.reshape(-1, 3, 3)
    return Motion(
        fields.get(_E.STEP_FIELD_NUMBER, 0), fields.get(_E.TIME_S_FIELD_NUMBER, 0.0),
        fields.get(_E.TARGET_TIME_S_FIELD_NUMBER, 0.0), fields.get(_E.ITERATION_FIELD_NUMBER, 0),
        rows(_E.POSITIONS_M_FIELD_NUMBER), rotations, rows(_E.VELOCITIES_M_S_FIELD_NUMBER),
        rows(_E.ANGULAR_VELOCITIES_RAD_S_FIELD_NUMBER), rows(_E.ACCELERATIONS_M_S2_FIELD_NUMBER),
        rows(_E.ANGULAR_ACCELERATIONS_RAD_S2_FIELD_NUMBER), rows(_E.SIGNALS_FIELD_NUMBER, 1).ravel(),
        rows(_E.FORCES_N_FIELD_NUMBER), rows(_E.MOMENTS_NM_FIELD_NUMBER), bool(fields.get(_E.TARGET_ESTIMATED_FIELD_NUMBER, 0)))


def index(fields):
    """Number of an exchange."""
    return fields[_E.INDEX_FIELD_NUMBER]


# ---------------------------------------------------------------- answers

def _put(field, values):
    if values is not None:
        field.extend(np.ravel(np.asarray(values, float)))


def answer(number, value, kind):
    """What a peer's function returned as the answer to exchange `number` on a port of this kind (of `mbcosim.v1.PortKind`)."""
    out = pb.PeerExchange(index=number)
    if isinstance(value, Reject):
        out.reject.text = value.text
        if value.preferred_step_size is not None:
            out.reject.preferred_step_size_s = value.preferred_step_size
        return pb.PeerMessage(exchange=out)
    loads = _loads(value, kind)
    _put(out.forces_n, loads.forces)
    _put(out.moments_nm, loads.moments)
    _put(out.reference_force_n, loads.reference_force)
    _put(out.reference_moment_nm, loads.reference_moment)
    _put(out.signals, loads.signals)
    _put(out.positions_m, loads.positions)
    _put(out.rotations, loads.rotations)
    out.unfinished = loads.unfinished
    for field, block in (("stiffness", loads.stiffness), ("damping", loads.damping)):
        if block is not None:
            block = np.asarray(block, float)
            _put(getattr(out.tangent, field), block)
            out.tangent.block_diagonal = block.ndim == 3
    return pb.PeerMessage(exchange=out)


def _loads(value, kind):
    if isinstance(value, Loads):
        return value
    if kind in (types.PORT_KIND_SIGNAL, types.PORT_KIND_MODAL):
        return Loads(signals=value)
    values = value if isinstance(value, tuple) else (value,)
    if kind == types.PORT_KIND_MOTION:
        return Loads(**dict(zip(("positions", "rotations"), values)))
    return Loads(*values)


def failure(number, error):
    """The answer of a peer that cannot compute, or rejects the step."""
    if isinstance(error, Reject):
        return answer(number, error, None)
    return pb.PeerMessage(exchange=pb.PeerExchange(index=number, failure=f"{type(error).__name__}: {error}"))


class Course:
    """What a peer has seen and answered; what blocking and asynchronous peers share.

    error      what ended the stream; None when it ended in good order
    exchanges  answers given
    accepted   (step, time) of the implicit steps that ended
    rejected   (step, time) to go back to, of those that failed
    """

    def __init__(self, rotation):
        self.error, self.exchanges, self.accepted, self.rejected = None, 0, [], []
        self._rotation, self._index = rotation, 0

    def _take(self, data):
        """The Motion of a message; None when it tells something else, which is noted."""
        name, content = receive(data)
        if name == "exchange":
            self._index = index(content)
            return motion(content, self._rotation)
        if name in ("accepted", "rejected"):
            getattr(self, name).append((content.step, content.time_s))
        return None

    def _answer(self, value):
        """The message that answers the last motion."""
        message = answer(self._index, value, self.welcome.layout.kind)
        self.exchanges += 1
        return message

    def _failure(self, error):
        """The message that says that there is no answer to the last motion."""
        self.exchanges += 1
        return failure(self._index, error)
