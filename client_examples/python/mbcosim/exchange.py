"""What crosses a port, as numpy arrays. Received arrays are views of the message's bytes: read-only, nothing is copied."""
from __future__ import annotations

import dataclasses
import struct
from collections.abc import Callable, Iterator
from typing import Any, Optional, Union

import grpc
import numpy as np
import numpy.typing as npt

from mbcosim.v1 import common_pb2, coupling_pb2 as pb, coupling_types_pb2 as types

from .calls import checked_units, real_numbers
from .errors import Error
from .rpc import fill_duration, protocol
from .words import choice

_ROTATION_SIZE = {"matrix": 9, "vector": 3, "quaternion": 4, "euler_123": 3}
Array = npt.NDArray[np.float64]
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_EMPTY = np.zeros(0)


@dataclasses.dataclass
class ReferenceMotion:
    """Motion of a port's reference node, always in the global frame."""
    x: Array         # 3
    rotation: Array  # 3 x 3 for "matrix", 4 for "quaternion", else 3
    v: Array
    w: Array
    a: Array         # empty unless agreed
    wp: Array


@dataclasses.dataclass
class Motion:
    """What the simulation sends. Arrays are n x 3 for n nodes, in the frame agreed; read-only. Units are the deck's, written here as SI, unless the
    peer has given its own."""
    step: int
    time: float            # of the values [s]
    target_time: float     # for which an answer is wanted [s]
    iteration: int         # of a tight step, or pass of a window, from 1; 0: explicit
    x: Array
    rotations: Array  # n x 3 x 3 for "matrix", n x 4 for "quaternion", else n x 3
    v: Array
    w: Array
    a: Array          # empty unless agreed
    wp: Array
    signals: Array    # of a signal port; of a modal one: the amplitudes, then their rates
    forces: Array     # of a motion port: reactions [N], and moments [N m]
    moments: Array
    target_estimated: bool  # the step may turn out to have another length
    reference: Optional[ReferenceMotion] = None  # of a port with a reference node


class Reject(Exception):
    """Raised by a peer's function, or returned as an answer: the step must not be done. It ends with outcome REJECTED_BY_PEER.

    `preferred_step_size` is what the peer would take [s], positive; None: unknown.
    """

    def __init__(self, preferred_step_size: Optional[float] = None, text: str = "") -> None:
        super().__init__(text)
        if preferred_step_size is not None and not 0 < preferred_step_size < np.inf:
            raise ValueError(f"`preferred_step_size` must be positive, got {preferred_step_size}")
        self.preferred_step_size, self.text = preferred_step_size, text

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.preferred_step_size, self.text)


@dataclasses.dataclass
class Loads:
    """What a peer answers with, when forces alone do not say it. Arrays of n rows for n nodes."""
    forces: Optional[npt.ArrayLike] = None            # n x 3 [N]
    moments: Optional[npt.ArrayLike] = None           # n x 3 about the points [N m]; None: zero
    reference_force: Optional[npt.ArrayLike] = None   # 3 [N], on the reference node of a deck's port that wants it
    reference_moment: Optional[npt.ArrayLike] = None  # 3 [N m]
    signals: Optional[npt.ArrayLike] = None           # of signal and modal ports
    positions: Optional[npt.ArrayLike] = None         # of motion ports: n x 3 imposed at `target_time` [m]
    rotations: Optional[npt.ArrayLike] = None         # of motion ports, in the form agreed
    stiffness: Optional[npt.ArrayLike] = None         # d(force, moment)/d(position, rotation): 6n x 6n, or n x 6 x 6 blocks
    damping: Optional[npt.ArrayLike] = None           # the same with respect to (velocity, angular velocity)
    unfinished: bool = False         # the step must not end with this answer


def hello(simulation: Any, port: str, *, mode: Optional[str] = None, rotation: str = "matrix", frame: Optional[str] = None,
          accelerations: bool = False, following_loads: bool = False, global_reference_loads: bool = False, every: Optional[int] = None,
          hold: str = "zero_order", peer_timeout: float = 10.0, policy: str = "fail_step", acceleration: str = "none",
          relaxation: Optional[float] = None, tolerance: Optional[float] = None, maximum_passes: Optional[int] = None,
          check_model: bool = True, tangent: str = "none", heartbeat_interval: Optional[float] = None, heartbeat_timeout: Optional[float] = None,
          units: Optional[common_pb2.UnitSystem] = None, step: Optional[int] = None, can_go_back: bool = False) -> pb.PeerMessage:
    """First message of a peer."""
    checked_units(units)
    message = pb.Hello(
        protocol=protocol(), simulation=simulation.name, port=port, units=units,
        expected=pb.PeerExpectation(model_digest=simulation.info.model_digest if check_model else "", step=step, can_go_back=can_go_back),
        form=pb.ExchangeForm(rotation_form=_enum(types.RotationForm, "ROTATION_FORM_", rotation),
                             frame=_enum(types.PortFrame, "PORT_FRAME_", frame), accelerations=accelerations,
                             following_loads=following_loads, global_reference_loads=global_reference_loads),
        schedule=pb.ExchangeSchedule(mode=_enum(types.CouplingMode, "COUPLING_MODE_", mode), every=every,
                                     input_hold=_enum(types.InputHold, "INPUT_HOLD_", hold)),
        iteration=pb.InterfaceIteration(acceleration=_enum(types.Acceleration, "ACCELERATION_", acceleration), relaxation=relaxation,
                                        tolerance=tolerance, maximum_passes=maximum_passes,
                                        tangent=_enum(pb.TangentForm, "TANGENT_FORM_", tangent)),
        presence=pb.PeerPresence(policy=_enum(types.PeerPolicy, "PEER_POLICY_", policy)))
    presence = message.presence
    for field, seconds in (("peer_timeout", peer_timeout), ("heartbeat_interval", heartbeat_interval), ("heartbeat_timeout", heartbeat_timeout)):
        if seconds is not None:
            fill_duration(getattr(presence, field), seconds, field)
    return pb.PeerMessage(hello=message)


def _enum(kind: Any, prefix: str, name: Optional[str]) -> Any:
    """Value of a choice; None leaves it to the server."""
    return choice(kind, prefix, name, prefix.lower().strip("_").replace("_", " "))


# ---------------------------------------------------------------- received

def _varint(data: Any, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, at
        shift += 7


def _fields(data: Any, at: int) -> Iterator[tuple[int, Any]]:
    """Number and value of every field: int, float or memoryview."""
    while at < len(data):
        key, at = _varint(data, at)
        number, kind = key >> 3, key & 7
        value: Any
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


def receive(data: bytes) -> tuple[Optional[str], Any]:
    """A message of the server: (name, content); the content of an "exchange" is a dict of its fields by number."""
    number, content = next(_fields(data, 0))
    if number == pb.ServerMessage.EXCHANGE_FIELD_NUMBER:
        return "exchange", dict(_fields(content, 0))
    message = pb.ServerMessage.FromString(data)
    name = message.WhichOneof("content")
    return name, getattr(message, name)


_E = pb.ServerExchange


def motion(fields: dict[int, Any], rotation: str) -> Motion:
    """The fields of an exchange as a Motion."""
    def numbers(number: int) -> Array:
        data = fields.get(number)
        return np.frombuffer(data, "<f8") if data is not None else _EMPTY

    def rows(number: int, width: int = 3) -> Array:
        return numbers(number).reshape(-1, width)

    rotations = rows(_E.ROTATIONS_FIELD_NUMBER, _ROTATION_SIZE[rotation])
    if rotation == "matrix":
        rotations = rotations.reshape(-1, 3, 3)
    reference = None
    if _E.REFERENCE_POSITION_FIELD_NUMBER in fields:
        turned = numbers(_E.REFERENCE_ROTATION_FIELD_NUMBER)
        reference = ReferenceMotion(
            numbers(_E.REFERENCE_POSITION_FIELD_NUMBER), turned.reshape(3, 3) if rotation == "matrix" else turned,
            numbers(_E.REFERENCE_VELOCITY_FIELD_NUMBER), numbers(_E.REFERENCE_ANGULAR_VELOCITY_FIELD_NUMBER),
            numbers(_E.REFERENCE_ACCELERATION_FIELD_NUMBER), numbers(_E.REFERENCE_ANGULAR_ACCELERATION_FIELD_NUMBER))
    return Motion(
        fields.get(_E.STEP_FIELD_NUMBER, 0), fields.get(_E.TIME_FIELD_NUMBER, 0.0),
        fields.get(_E.TARGET_TIME_FIELD_NUMBER, 0.0), fields.get(_E.ITERATION_FIELD_NUMBER, 0),
        rows(_E.POSITIONS_FIELD_NUMBER), rotations, rows(_E.VELOCITIES_FIELD_NUMBER),
        rows(_E.ANGULAR_VELOCITIES_FIELD_NUMBER), rows(_E.ACCELERATIONS_FIELD_NUMBER),
        rows(_E.ANGULAR_ACCELERATIONS_FIELD_NUMBER), numbers(_E.SIGNALS_FIELD_NUMBER),
        rows(_E.FORCES_FIELD_NUMBER), rows(_E.MOMENTS_FIELD_NUMBER), bool(fields.get(_E.TARGET_ESTIMATED_FIELD_NUMBER, 0)),
        reference)


def index(fields: dict[int, Any]) -> int:
    """Number of an exchange."""
    return int(fields[_E.INDEX_FIELD_NUMBER])


# ---------------------------------------------------------------- answers

_ARRAYS = ("forces", "moments", "reference_force", "reference_moment", "signals", "positions", "rotations", "stiffness", "damping")


class AnswerForm:
    """What the answers on a port must be like, by the server's welcome and what the peer said in its `hello`."""

    def __init__(self, layout: types.PortLayout, hello: pb.Hello) -> None:
        self.kind, self._port, self._layout = layout.kind, layout.name, layout
        nodes, mapped = len(layout.node_labels), layout.HasField("mapped_points")
        self._rows = layout.mapped_points if mapped else nodes
        motion, modal = layout.kind == types.PORT_KIND_MOTION, layout.kind == types.PORT_KIND_MODAL
        self.blocks = hello.iteration.tangent == pb.TANGENT_FORM_BLOCK_DIAGONAL
        width = {types.ROTATION_FORM_MATRIX: 9, types.ROTATION_FORM_QUATERNION: 4}.get(hello.form.rotation_form, 3)
        size = layout.input_size if modal else 6 * nodes
        self._block = (nodes, 6, 6) if self.blocks and not modal else (size, size)
        block = int(np.prod(self._block)) if self.blocks or hello.iteration.tangent == pb.TANGENT_FORM_DENSE else 0
        reference = 3 if layout.reference_loads else 0
        self._sizes = {  # how many numbers
            "forces": 0 if motion else 3 * self._rows, "moments": 0 if motion or mapped else 3 * nodes, "reference_force": reference,
            "reference_moment": reference, "signals": 0 if motion else layout.input_size, "positions": 3 * nodes if motion else 0,
            "rotations": width * nodes if motion and not layout.positions_only else 0, "stiffness": block, "damping": block}
        self.needed = {name for name, size in self._sizes.items() if size} - {"moments", "stiffness", "damping"}

    def fault(self, name: str, values: Optional[Array]) -> Optional[str]:
        """What is wrong with an array of an answer; None: nothing."""
        size = 0 if values is None else values.size
        if size == 0 and name not in self.needed:
            return None
        if size != self._sizes[name] or (name in ("forces", "moments", "positions") and values is not None and self._is_turned(values)):
            given = "is missing" if values is None else f"has the shape {values.shape}"
            return f"`{name}` {given}; {self._expected(name)}"
        return None if values is None or np.isfinite(values).all() else f"`{name}` has numbers that are not finite: {values.tolist()}"

    def _is_turned(self, values: Array) -> bool:
        """Columns of vectors instead of rows."""
        return values.ndim == 2 and values.shape[1] != 3 and values.shape[0] == 3 != self._rows > 1

    def _expected(self, name: str) -> str:
        if not self._sizes[name]:
            return f'port "{self._port}" takes none' + (" without `tangent` of the peer" if name in ("stiffness", "damping") else "")
        if name in ("stiffness", "damping"):
            return f"the peer's `tangent` takes {' x '.join(map(str, self._block))}"
        if name == "signals":
            return f'port "{self._port}" takes {self._sizes[name]} numbers' + "".join(f", {n}" for n in self._layout.input_names[:3])
        if name.startswith("reference"):
            return f'port "{self._port}" takes 3 numbers on its reference node'
        rows = len(self._layout.node_labels) if name == "rotations" else self._rows
        return f'port "{self._port}" takes {rows} x {self._sizes[name] // rows}, a row for each of its points'


def _numbers(name: str, values: Any) -> Optional[Array]:
    """`values` of an answer as an array."""
    if values is None:
        return None
    try:
        return real_numbers(values)
    except (TypeError, ValueError):
        raise TypeError(f"`{name}` of an answer must be real numbers, got {str(values)[:100]!r}, a {type(values).__name__}") from None


def answer(number: int, value: Any, form: AnswerForm) -> pb.PeerMessage:
    """What a peer's function returned as the answer to exchange `number`. TypeError or ValueError for what is none on that port."""
    out = pb.PeerExchange(index=number)
    if isinstance(value, Reject):
        return _rejection(number, value)
    loads, values = _loads(value, form.kind), out.answer
    values.SetInParent()
    for name in _ARRAYS:
        given = getattr(loads, name)
        if given is None and name not in form.needed:
            continue
        numbers = _numbers(name, given)
        fault = form.fault(name, numbers)
        if fault:
            raise ValueError(fault)
        if numbers is None or not numbers.size:
            continue
        if name in ("stiffness", "damping"):
            values.tangent.block_diagonal = form.blocks
        getattr(values.tangent if name in ("stiffness", "damping") else values, name).extend(numbers.ravel())
    values.unfinished = loads.unfinished
    return pb.PeerMessage(exchange=out)


def _rejection(number: int, value: Reject) -> pb.PeerMessage:
    out = pb.PeerExchange(index=number)
    out.reject.text = _sendable(str(value.text))
    if value.preferred_step_size is not None:
        out.reject.preferred_step_size = value.preferred_step_size
    return pb.PeerMessage(exchange=out)


def _loads(value: Any, kind: int) -> Loads:
    if isinstance(value, Loads):
        return value
    if kind in (types.PORT_KIND_SIGNAL, types.PORT_KIND_MODAL):
        return Loads(signals=value)
    values = value if isinstance(value, tuple) else (value,)
    names = ("positions", "rotations") if kind == types.PORT_KIND_MOTION else _ARRAYS[:4]
    if len(values) > len(names):
        raise ValueError(f"an answer of {len(values)} parts; this port takes {', '.join(names)}, or mbcosim.Loads")
    return Loads(**dict(zip(names, values)))


def _sendable(text: str) -> str:
    """Without the halves of characters that names of files may have."""
    return text.encode(errors="replace").decode()


def _told(error: BaseException) -> str:
    """What the server is told of an exception, also of one that cannot be printed."""
    try:
        return _sendable(f"{type(error).__name__}: {error}")
    except Exception as fault:
        return f"{type(error).__name__}, whose text cannot be had: {type(fault).__name__}"


def failure(number: int, error: BaseException) -> pb.PeerMessage:
    """The answer of a peer that cannot compute, or rejects the step."""
    if isinstance(error, Reject):
        return _rejection(number, error)
    return pb.PeerMessage(exchange=pb.PeerExchange(index=number, failure=_told(error)))


def check_synchronous(function: Optional[Callable[[Motion], Any]]) -> None:
    """TypeError for a peer whose `function` takes the motions that somebody would iterate over."""
    if function is not None:
        raise TypeError("the peer's function takes every motion; to iterate over them attach the peer without one")


class Course:
    """What a peer has seen and answered; what blocking and asynchronous peers share.

    error      what ended the stream; None when it ended in good order
    raised     what the peer's function raised last, with its traceback, or what was wrong with its answer: the server was told its text
    step       the step at whose end the peer stands: of the last exchange that it answered, in implicit modes of the last step that was
               accepted; before that where it attached. To be told when it attaches again
    exchanges  answers given
    accepted   (step, time) of the implicit steps that ended
    rejected   (step, time) to go back to, of those that failed
    """

    welcome: pb.Welcome

    def __init__(self, rotation: str) -> None:
        self.error: Optional[Error] = None
        self.raised: Optional[BaseException] = None
        self.step = 0
        self.exchanges = 0
        self.accepted: list[tuple[int, float]] = []
        self.rejected: list[tuple[int, float]] = []
        self._rotation, self._index = rotation, 0
        self._asked: Optional[int] = None  # step of the last exchange, in explicit modes

    def _begin(self, welcome: pb.Welcome, hello: pb.Hello) -> None:
        """The peer is attached with this `hello`. An error when the server would take its answers otherwise."""
        form, expected = hello.form, hello.expected
        if (form.following_loads or form.global_reference_loads) and "following_loads" not in welcome.protocol.features:
            raise Error("the server is too old: it knows neither following_loads nor global_reference_loads", grpc.StatusCode.UNIMPLEMENTED)
        self.welcome, self._form = welcome, AnswerForm(welcome.layout, hello)
        self.step = min(expected.step, welcome.step) if expected.HasField("step") else welcome.step

    def _take(self, data: bytes) -> Optional[Motion]:
        """The Motion of a message; None when it tells something else, which is noted."""
        name, content = receive(data)
        if name == "exchange":
            self._index = index(content)
            seen = motion(content, self._rotation)
            self._asked = seen.step if seen.iteration == 0 else None
            return seen
        if name in ("accepted", "rejected"):
            getattr(self, name).append((content.step, content.time))
            # Pieces of a step may have been accepted before it is rejected.
            self.step = content.step if name == "accepted" else min(self.step, content.step)
        return None

    def _answer(self, value: Any) -> pb.PeerMessage:
        """The message that answers the last motion."""
        message = answer(self._index, value, self._form)
        self.exchanges += 1
        if self._asked is not None and not isinstance(value, Reject):
            self.step = self._asked
        return message

    def _failure(self, error: BaseException) -> pb.PeerMessage:
        """The message that says that there is no answer to the last motion."""
        self.raised = error
        self.exchanges += 1
        return failure(self._index, error)
