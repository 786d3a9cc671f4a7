"""How calls travel: what may be asked again, how long each may take, how a silent server is noticed."""
import contextlib
import dataclasses
import functools
import threading
import time

import grpc

from mbcosim.v1 import coupling_pb2_grpc, reduction_pb2_grpc, simulations_pb2_grpc, telemetry_pb2_grpc

from .errors import TimedOut, Unavailable, translated

USUAL = 30.0    # seconds that a call which advances nothing may take
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


@dataclasses.dataclass
class Call:
    """One call of a server's method.

    method      "Simulations/Step"
    request     a message, or an iterable of messages
    timeout     seconds; None: as long as the server lives
    repeatable  a second call does no harm when the reply to the first was lost
    each        of a method that streams: called with every message
    """
    method: str
    request: object
    timeout: float = None
    repeatable: bool = False
    each: object = None


def call(function):
    """Marks a generator that yields Calls, is sent their replies and returns a result. Blocking and asyncio clients run the same ones."""
    function.is_call = True
    return function


def runs_calls(drive):
    """Class decorator: `drive(generator function)` makes methods of those that are marked with `call`."""
    def decorate(cls):
        for base in reversed(cls.__mro__[1:]):
            for name, function in vars(base).items():
                if getattr(function, "is_call", False):
                    setattr(cls, name, functools.wraps(function)(drive(function)))
        return cls
    return decorate


def metadata(token):
    """What says who calls."""
    return [("authorization", f"Bearer {token}")] if token else []


class Stubs:
    """The methods of a channel by name."""

    def __init__(self, channel):
        self.simulations = simulations_pb2_grpc.SimulationsStub(channel)
        self.reduction = reduction_pb2_grpc.ReductionStub(channel)
        self.coupling = coupling_pb2_grpc.CouplingStub(channel)
        self.telemetry = telemetry_pb2_grpc.TelemetryStub(channel)

    def method(self, name):
        service, method = name.split("/")
        return getattr(getattr(self, service.lower()), method)


class Retries:
    """Whether a call that was lost on the way is asked again: until `reconnect` seconds are over, and at least a few times."""

    def __init__(self, call, reconnect):
        self._allowed, self._reconnect = call.repeatable, reconnect
        self._end, self._attempts = None, 0

    def again(self, error):
        """Seconds to pause, and seconds to wait for a connection after that; raises `error` when there is no use in it."""
        if self._end is None:
            self._end = time.monotonic() + max(self._reconnect, _AGAIN)
        self._attempts += 1
        left = self._end - time.monotonic()
        if not self._allowed or isinstance(error, TimedOut) or left <= 0 or (not self._reconnect and self._attempts > 4):
            raise error
        return min(_PAUSE * 2 ** min(self._attempts - 1, 5), left), left


class Connection:
    """A channel whose calls block."""

    def __init__(self, channel, token, reconnect):
        self.channel, self.metadata, self.reconnect = channel, metadata(token), reconnect
        self.stubs = Stubs(channel)

    def run(self, calls):
        """Makes the calls of a generator one after the other; its result."""
        reply = None
        try:
            while True:
                reply = self.perform(calls.send(reply))
        except StopIteration as end:
            return end.value

    def perform(self, call):
        retries = Retries(call, self.reconnect)
        while True:
            try:
                with translated():
                    return self._once(call)
            except Unavailable as error:
                pause, left = retries.again(error)
                time.sleep(pause)
                self._await_connection(left, error)

    def _once(self, call):
        method = self.stubs.method(call.method)
        if call.each is not None:
            return self._stream(method, call)
        if call.timeout is None and hasattr(call.request, "SerializeToString"):
            return method(call.request, metadata=self.metadata)
        return self._bounded(method, call)

    def _bounded(self, method, call):
        """As a future: what gRPC does not end at its deadline (an upload that nobody reads) ends soon after it."""
        future = method.future(call.request, metadata=self.metadata, timeout=call.timeout)
        try:
            return future.result(None if call.timeout is None else call.timeout + _AGAIN)
        except grpc.FutureTimeoutError:
            future.cancel()
            raise TimedOut(f"{call.method} took longer than {call.timeout} s", grpc.StatusCode.DEADLINE_EXCEEDED) from None

    def _stream(self, method, call):
        messages = method(call.request, metadata=self.metadata, timeout=call.timeout)
        latest = None if call.timeout is None else call.timeout + _AGAIN
        with bounded(latest, messages.cancel, call.method):
            for message in messages:
                call.each(message)

    def _await_connection(self, seconds, error):
        try:
            grpc.channel_ready_future(self.channel).result(seconds)
        except grpc.FutureTimeoutError:
            raise error from None


def blocking(function):
    """The generator `function` as a method that blocks."""
    return lambda self, *arguments, **options: self._connection.run(function(self, *arguments, **options))


@contextlib.contextmanager
def bounded(seconds, cancel, what):
    """Calls `cancel` when the block takes longer than `seconds` (None: never); then TimedOut is raised."""
    if seconds is None:
        yield
        return
    over = threading.Event()

    def stop():
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
def parting():
    """Ends what is on the server as far as it can be reached: what cannot ends with its lease."""
    try:
        yield
    except Unavailable:
        pass
