"""How calls travel: what may be asked again, how long each may take, how a silent server is noticed."""
from __future__ import annotations

import contextlib
import dataclasses
import functools
import inspect
import math
import os
import queue
import re
import threading
import time
import weakref
from collections.abc import Callable, Coroutine, Generator, Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Optional, TypeVar, Union, cast, overload

import grpc

from mbcosim.v1 import (common_pb2, coupling_pb2_grpc, events_pb2_grpc, geometry_pb2_grpc, reduction_pb2_grpc, results_pb2_grpc, simulations_pb2_grpc,
                        telemetry_pb2_grpc)

from .errors import Busy, Error, NotFound, TimedOut, Unavailable, bad_argument, cancelled_here, translated

if TYPE_CHECKING:
    from typing_extensions import Concatenate, ParamSpec
    P = ParamSpec("P")
T = TypeVar("T")
_Class = TypeVar("_Class", bound=type)

PROTOCOL_VERSION = 2
FEATURES = ("grants", "geometry", "symbols", "step_sizes", "request_ids", "pages", "reset", "results", "tables", "events", "checkpoints",
            "pace", "sample_intervals", "journal", "deck_sockets", "units", "following_loads")  # that this library knows
USUAL = 30.0    # seconds that a call which advances nothing may take
LONGEST = 1e9   # seconds of a duration or timeout
PARTING = 2.0   # seconds that leaving a `with` block may take
_AGAIN = 2.0    # seconds in which a repeatable call is asked again after the connection broke
_PAUSE = 0.05   # first pause between two attempts [s]

# A server that is stopped or behind a black hole is noticed within 20 s: ping after 10 s of silence, dead after 10 more.
CHANNEL_OPTIONS = [
    ("grpc.max_receive_message_length", -1),
    ("grpc.keepalive_time_ms", 10_000),
    ("grpc.keepalive_timeout_ms", 10_000),
    ("grpc.keepalive_permit_without_calls", 1),
    ("grpc.http2.max_pings_without_data", 0),
    ("grpc.initial_reconnect_backoff_ms", 200),
    ("grpc.max_reconnect_backoff_ms", 2_000),
]
_THIS_MACHINE = re.compile(r"(localhost|127\.[\d.]+|\[::1\]):\d+")


def channel_options(address: str) -> list[tuple[str, int]]:
    """Of a channel to `address`: no proxy of the environment ($http_proxy) can stand between this machine and itself."""
    return CHANNEL_OPTIONS + [("grpc.enable_http_proxy", 0)] if _THIS_MACHINE.fullmatch(address) else CHANNEL_OPTIONS


@dataclasses.dataclass
class Call:
    """One call of a server's method.

    method      "Simulations/Step"
    request     a message, or a function that gives the messages of an upload
    timeout     seconds; None: as long as the server lives
    repeatable  a second call does no harm when the reply to the first was lost
    each        of a method that streams: called with every message
    through     of a call without timeout: another way to the reply; it gives None when the call is to be made all the same
    simulation  name of the simulation that it is about, where `request` does not tell
    patient     asked again within `timeout` while another call advances the simulation
    """
    method: str
    request: Any
    timeout: Optional[float] = None
    repeatable: bool = False
    each: Optional[Callable[[Any], Any]] = None
    through: Optional[Callable[[Any], Any]] = None
    simulation: str = ""
    patient: bool = False

    def sent(self) -> Any:
        """What gRPC takes, anew for each attempt."""
        return self.request() if callable(self.request) else self.request


Calls = Generator[Call, Any, T]  # is sent the replies, one after the other


class Blocking:
    """What runs calls at once."""


class Awaiting:
    """What runs calls as coroutines."""


if TYPE_CHECKING:
    class Method(Generic[P, T]):
        """A method marked with `call`, as the two clients see it."""
        @overload
        def __get__(self, of: Blocking, owner: Any = ...) -> Callable[P, T]: ...
        @overload
        def __get__(self, of: Awaiting, owner: Any = ...) -> Callable[P, Coroutine[Any, Any, T]]: ...
        def __get__(self, of: Any, owner: Any = None) -> Any: ...


def call(function: Callable[Concatenate[Any, P], Calls[T]]) -> Method[P, T]:
    """Marks a generator that yields Calls, is sent their replies and returns a result. Blocking and asyncio clients run the same ones."""
    setattr(function, "is_call", True)
    return cast("Method[P, T]", function)


def runs_calls(drive: Callable[[Any], Any]) -> Callable[[_Class], _Class]:
    """Class decorator: `drive(generator function)` makes methods of those that are marked with `call`."""
    def decorate(cls: _Class) -> _Class:
        for base in reversed(cls.__mro__[1:]):
            for name, function in vars(base).items():
                if getattr(function, "is_call", False) and name not in vars(cls):
                    method = functools.wraps(function)(drive(function))
                    method.__signature__ = _signature(function)
                    setattr(cls, name, method)
        return cls
    return decorate


def _signature(function: Callable[..., Calls[Any]]) -> inspect.Signature:
    """For `help`: with the result in place of the Calls."""
    own = inspect.signature(function)
    return own.replace(return_annotation=own.return_annotation.removeprefix("Calls[").removesuffix("]"))


def fill_duration(out: Any, seconds: float, field: str) -> None:
    """`seconds` of a request to the nanosecond; `field` is named when they are no duration."""
    if not abs(seconds) <= LONGEST:
        raise bad_argument(field, f"`{field}` is no duration of at most {LONGEST:g} s: {seconds} s")
    out.FromNanoseconds(round(seconds * 1e9))


def checked_timeout(seconds: Optional[float]) -> Optional[float]:
    """`seconds` that somebody is willing to wait."""
    if seconds is not None and not 0 < seconds <= LONGEST:
        raise bad_argument("timeout", f"`timeout` must be a positive number of seconds, at most {LONGEST:g}, or None for no bound, got {seconds}")
    return seconds


def protocol() -> common_pb2.VersionRange:
    """The version and the features that this library speaks."""
    return common_pb2.VersionRange(lowest=PROTOCOL_VERSION, highest=PROTOCOL_VERSION, features=FEATURES)


def metadata(token: Optional[str]) -> list[tuple[str, str]]:
    """What says who calls."""
    return [("authorization", f"Bearer {token}")] if token else []


def simulation_of(request: Any) -> str:
    """Name of the simulation that a request is about; empty: none, or the request is an upload."""
    name = getattr(request, "simulation", None)
    if name is None:
        name = getattr(getattr(request, "step", None), "simulation", "")
    return name if isinstance(name, str) else ""


class Address:
    """What goes with every call: who calls, and the simulation, by which a proxy finds the daemon that has it."""
    metadata: list[tuple[str, str]]

    def about(self, simulation: str) -> list[tuple[str, str]]:
        if not (simulation.isascii() and simulation.isprintable()):
            raise NotFound(f"no simulation is named {simulation!r}", grpc.StatusCode.NOT_FOUND, "NO_SUCH_SIMULATION")
        return [*self.metadata, ("mbcosim-session", simulation)] if simulation else self.metadata

    def metadata_of(self, call: Call) -> list[tuple[str, str]]:
        return self.about(call.simulation or simulation_of(call.request))


class Stubs:
    """The methods of a channel by name."""

    def __init__(self, channel: Any) -> None:
        self.simulations: Any = simulations_pb2_grpc.SimulationsStub(channel)  # type: ignore[no-untyped-call]
        self.reduction: Any = reduction_pb2_grpc.ReductionStub(channel)  # type: ignore[no-untyped-call]
        self.coupling: Any = coupling_pb2_grpc.CouplingStub(channel)  # type: ignore[no-untyped-call]
        self.telemetry: Any = telemetry_pb2_grpc.TelemetryStub(channel)  # type: ignore[no-untyped-call]
        self.results: Any = results_pb2_grpc.ResultsStub(channel)  # type: ignore[no-untyped-call]
        self.events: Any = events_pb2_grpc.EventsStub(channel)  # type: ignore[no-untyped-call]
        self.geometry: Any = geometry_pb2_grpc.GeometryStub(channel)  # type: ignore[no-untyped-call]

    def method(self, name: str) -> Any:
        service, method = name.split("/")
        return getattr(getattr(self, service.lower()), method)


class Bound:
    """The calls that one call of the user's makes: their timeouts count from its beginning."""

    def __init__(self) -> None:
        self._begin = time.monotonic()

    def within(self, call: Call) -> Call:
        timeout = checked_timeout(call.timeout)
        if timeout is not None:
            call.timeout = max(timeout - (time.monotonic() - self._begin), 1e-3)
        return call


class Retries:
    """Whether a call that was lost on the way is asked again: until `reconnect` seconds are over, and at least a few times. The call's timeout, longer
    by `reconnect`, is the bound of all attempts together. A patient call is asked again while the simulation is busy, until its timeout is over."""

    def __init__(self, call: Call, reconnect: float) -> None:
        self._call, self._allowed, self._reconnect = call, call.repeatable, reconnect
        self._patience = time.monotonic() + (call.timeout or 0.0) if call.patient else -math.inf
        self._latest = math.inf if call.timeout is None else time.monotonic() + call.timeout + reconnect
        self._end: Optional[float] = None
        self._attempts = 0

    def again(self, error: Union[Unavailable, Busy]) -> tuple[float, float]:
        """Seconds to pause, and seconds to wait for a connection after that, 0: it is there; raises `error` when there is no use in it."""
        if isinstance(error, Busy):
            return self._when_free(error), 0.0
        if self._end is None:
            self._end = min(time.monotonic() + max(self._reconnect, _AGAIN), self._latest)
        self._attempts += 1
        left = self._end - time.monotonic()
        if not self._allowed or isinstance(error, TimedOut) or left <= 0 or (not self._reconnect and self._attempts > 4):
            raise error
        if self._call.timeout is not None:
            self._call.timeout = max(self._latest - time.monotonic(), 1e-3)
        return min(_PAUSE * 2.0 ** min(self._attempts - 1, 5), left), left

    def _when_free(self, error: Busy) -> float:
        left = self._patience - time.monotonic()
        if left <= 0:
            raise error
        self._call.timeout = max(left, 1e-3)
        return min(_PAUSE, left)


class InUse:
    """Says, while it is referred to, that this process uses gRPC, which does not survive a fork: each process would get what is for the other."""
    _all: ClassVar[set[weakref.ref[InUse]]] = set()

    def __init__(self) -> None:
        self._process = os.getpid()
        self._all.add(weakref.ref(self, self._all.discard))

    def here(self) -> bool:
        """Was this process not forked since?"""
        return self._process == os.getpid()

    @classmethod
    def check(cls) -> None:
        """Raises Unavailable where this process was forked from one that used gRPC then."""
        uses = [found() for found in tuple(cls._all)]
        if not all(use is None or use.here() for use in uses):
            raise Unavailable("connections do not survive a fork: this process was forked from one that had one. Close them before, those of asyncio "
                              "cannot be, or start processes by multiprocessing's \"spawn\"", grpc.StatusCode.UNAVAILABLE)


class Open:
    """A channel until it is closed; then Unavailable is raised in its place, as in a process that is forked while it is open."""

    def __init__(self, channel: Any) -> None:
        self._channel, self._stubs, self._closed = channel, Stubs(channel), False
        self._use: Optional[InUse] = InUse()

    @property
    def channel(self) -> Any:
        self.check()
        return self._channel

    @property
    def stubs(self) -> Stubs:
        self.check()
        return self._stubs

    def check(self) -> None:
        """Raises Unavailable when this side has closed it, or it is another process's."""
        if self._closed:
            raise Unavailable("the connection is closed", grpc.StatusCode.UNAVAILABLE)
        if self._use is not None and not self._use.here():
            InUse.check()

    def close(self) -> Any:
        """What the channel's `close` gives: a coroutine of asyncio's. None in a forked process: it is the other one's."""
        if self._use is not None and not self._use.here():
            return None
        self._closed, self._use = True, None
        return self._channel.close()


class Connection(Open, Address):
    """A channel whose calls block."""

    def __init__(self, channel: Any, token: Optional[str], reconnect: float) -> None:
        super().__init__(channel)
        self.metadata, self.reconnect = metadata(token), reconnect

    def run(self, calls: Calls[T]) -> T:
        """Makes the calls of a generator one after the other; its result."""
        bound = Bound()
        try:
            call = next(calls)
            while True:
                try:
                    reply = self.perform(bound.within(call))
                except Error as error:
                    call = calls.throw(error)
                else:
                    call = calls.send(reply)
        except StopIteration as end:
            return cast(T, end.value)

    def perform(self, call: Call) -> Any:
        retries = Retries(call, self.reconnect)
        while True:
            self.check()
            try:
                with translated():
                    return self._once(call)
            except (Unavailable, Busy) as error:
                pause, left = retries.again(error)
                time.sleep(pause)
                if left:
                    self._await_connection(left, error)

    def _once(self, call: Call) -> Any:
        if call.through is not None and call.timeout is None and (reply := call.through(call.request)) is not None:
            return reply
        method = self.stubs.method(call.method)
        if call.each is not None:
            return self._stream(method, call)
        if not callable(call.request):  # one message: this thread does it all, and gRPC ends it at its deadline
            return method(call.request, metadata=self.metadata_of(call), timeout=call.timeout)
        return self._bounded(method, call)

    def _bounded(self, method: Any, call: Call) -> Any:
        """As a future: what gRPC does not end at its deadline (an upload that nobody reads) ends soon after it."""
        future = method.future(call.sent(), metadata=self.metadata_of(call), timeout=call.timeout)
        try:
            with cancelling(future):
                return future.result(None if call.timeout is None else call.timeout + _AGAIN)
        except grpc.FutureTimeoutError:
            raise TimedOut(f"{call.method} took longer than {call.timeout} s", grpc.StatusCode.DEADLINE_EXCEEDED) from None

    def _stream(self, method: Any, call: Call) -> None:
        messages = method(call.sent(), metadata=self.metadata_of(call), timeout=call.timeout)
        latest = None if call.timeout is None else call.timeout + _AGAIN
        with bounded(latest, messages.cancel, call.method), cancelling(messages):
            for message in messages:
                assert call.each is not None
                call.each(message)

    def _await_connection(self, seconds: float, error: Error) -> None:
        try:
            grpc.channel_ready_future(self.channel).result(seconds)
        except grpc.FutureTimeoutError:
            raise error from None


def blocking(function: Callable[..., Calls[T]]) -> Callable[..., T]:
    """The generator `function` as a method that blocks."""
    def method(self: Any, *arguments: Any, **options: Any) -> T:
        return cast(T, self._connection.run(function(self, *arguments, **options)))
    return method


_UNBOUNDED: contextlib.AbstractContextManager[None] = contextlib.nullcontext()


def bounded(seconds: Optional[float], cancel: Callable[[], object], what: str) -> contextlib.AbstractContextManager[None]:
    """Calls `cancel` when the block takes longer than `seconds` (None: never); then TimedOut is raised."""
    if seconds is None:
        return _UNBOUNDED
    try:
        checked_timeout(seconds)
    except Error:
        cancel()
        raise
    return _bounded(seconds, cancel, what)


@contextlib.contextmanager
def _bounded(seconds: float, cancel: Callable[[], object], what: str) -> Iterator[None]:
    over = threading.Event()

    def stop() -> None:
        over.set()
        cancel()

    timer = threading.Timer(seconds, stop)
    timer.daemon = True
    timer.start()
    try:
        yield
    except Exception:
        if over.is_set():
            raise TimedOut(f"{what} took longer than {seconds} s", grpc.StatusCode.DEADLINE_EXCEEDED) from None
        raise
    finally:
        timer.cancel()


@contextlib.contextmanager
def cancelling(stream: Any) -> Iterator[None]:
    """Cancels a call that the block does not see to its end, by Ctrl-C say: the server would go on with it."""
    try:
        yield
    except BaseException:
        stream.cancel()
        raise


def end_with(stream: Any, requests: queue.SimpleQueue[Any]) -> None:
    """The requests of a stream end when it does, also when nobody closes it here: gRPC's thread that waits for the next one would stay for ever."""
    if not stream.add_callback(lambda: requests.put(None)):
        requests.put(None)


def until_cancelled(messages: Any) -> Iterator[Any]:
    """Every message until the server ends the stream, or somebody here cancels it."""
    try:
        yield from messages
    except grpc.RpcError as error:
        if not cancelled_here(error):
            with translated():
                raise


@contextlib.contextmanager
def parting(raised: Optional[BaseException] = None, told: Union[type[Error], tuple[()]] = ()) -> Iterator[None]:
    """Ends what is on the server as far as it can be reached: what cannot ends with its lease, and only `told` kinds of Unavailable are raised. No
    failure here hides what was `raised` before."""
    try:
        yield
    except Error as error:
        if raised is None and (isinstance(error, told) or not isinstance(error, Unavailable)):
            raise
