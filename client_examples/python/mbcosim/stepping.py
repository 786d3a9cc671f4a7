"""A loop of steps that are asked for one by one: they travel on an open stream, which takes less time than calls."""
from __future__ import annotations

import asyncio
import queue
import threading
import time
from typing import Any, Optional

import grpc

from mbcosim.v1 import simulations_pb2 as pb

from .errors import TimedOut, Unavailable, translated
from .rpc import bounded, end_with, parting

_SOON = 0.05  # seconds within which a step follows the one before in a loop
_IDLE = 1.0   # seconds after which the stream is closed: an open one would keep the simulation alive


def _open_stream(stub: Any, metadata: Any) -> tuple[queue.SimpleQueue[Optional[pb.StepRequest]], Any]:
    """The requests, of which None ends the stream, and the replies."""
    requests: queue.SimpleQueue[Optional[pb.StepRequest]] = queue.SimpleQueue()
    replies = stub.StepStream(iter(requests.get, None), metadata=metadata)
    end_with(replies, requests)
    return requests, replies


class StepLine:
    """The stream is opened when steps follow each other quickly, and closed when they do not. What cannot go on it is a call of its own."""

    def __init__(self, stub: Any, metadata: Any) -> None:
        self._stub, self._metadata = stub, metadata
        self._one = threading.Lock()  # who has it steps
        self._state = threading.Lock()  # protects all below
        self._requests: queue.SimpleQueue[Optional[pb.StepRequest]] = queue.SimpleQueue()
        self._replies: Any = None
        self._last, self._allowed = float("-inf"), True

    def step(self, request: pb.StepRequest) -> Optional[pb.StepReply]:
        """The reply; None: make a call of it. Raises grpc.RpcError as a call does: an id that is asked for again is not done again."""
        if not self._one.acquire(blocking=False):
            return None
        try:
            replies = self._open()
            if replies is None:
                return None
            self._requests.put(request)
            try:
                reply: pb.StepReply = next(replies).step
                return reply
            except StopIteration:
                self.close()
                return None
            except grpc.RpcError as error:
                self.close()
                if error.code() == grpc.StatusCode.RESOURCE_EXHAUSTED:  # as many streams as one may have
                    self._allowed = False
                    return None
                raise
            except BaseException:  # the reply of an interrupted step would be taken for the next one's
                self.close()
                raise
        finally:
            self._last = time.monotonic()
            self._one.release()

    def _open(self) -> Any:
        with self._state:
            if self._replies is None and self._allowed and time.monotonic() - self._last < _SOON:
                self._requests, self._replies = _open_stream(self._stub, self._metadata)
                threading.Thread(target=self._close_when_idle, args=(self._replies,), daemon=True).start()
            return self._replies

    def _close_when_idle(self, replies: Any) -> None:
        while self._replies is replies:
            time.sleep(_IDLE / 2)
            if time.monotonic() - self._last > _IDLE and self._one.acquire(blocking=False):
                try:
                    if self._replies is replies:
                        self.close()
                finally:
                    self._one.release()

    def close(self) -> None:
        """Ends the stream; a later loop opens another one."""
        with self._state:
            replies, self._replies = self._replies, None
            self._requests.put(None)
        if replies is not None:
            replies.cancel()


class SharedStream:
    """An open stream that steppers of one connection may share: one step after the other. After an exception the next step opens another one."""

    def __init__(self, connection: Any) -> None:
        self.connection = connection
        self._turn = threading.Lock()  # who has it steps
        self._state = threading.Lock()  # protects all below
        self._users = 0
        self._requests: queue.SimpleQueue[Optional[pb.StepRequest]] = queue.SimpleQueue()
        self._replies: Any = None

    def join(self, simulation: str) -> None:
        """One more stepper; `simulation`: by which a proxy finds the daemon."""
        with self._state:
            self._users += 1
        self._open(simulation)

    def step(self, request: pb.StepRequest, timeout: Optional[float]) -> pb.StepReply:
        """The reply, within `timeout` [s]. Raises mbcosim.Error."""
        end = None if timeout is None else time.monotonic() + timeout
        if not self._turn.acquire(timeout=-1 if timeout is None else min(timeout, threading.TIMEOUT_MAX)):
            raise TimedOut(f"the step took longer than {timeout} s", grpc.StatusCode.DEADLINE_EXCEEDED)
        try:
            replies = self._open(request.simulation)
            self._requests.put(request)
            left = None if end is None else max(end - time.monotonic(), 1e-3)
            with bounded(left, replies.cancel, "the step"), translated():
                reply = next(replies, None)
            if reply is None:
                raise Unavailable("the stream has ended", grpc.StatusCode.UNAVAILABLE)
            answer: pb.StepReply = reply.step
            return answer
        except BaseException:  # the reply of an interrupted step would be taken for the next one's
            self._end(cancel=True)
            raise
        finally:
            self._turn.release()

    def leave(self, timeout: Optional[float]) -> None:
        """The last one ends the stream, within `timeout` [s]."""
        with self._state:
            self._users -= 1
            if self._users > 0:
                return
        replies = self._end()
        if replies is None or not replies.is_active():
            return
        with parting(), bounded(timeout, replies.cancel, "the end of the stream"), translated():
            for _ in replies:
                pass

    def _open(self, simulation: str) -> Any:
        with self._state:
            if self._users == 0:
                raise Unavailable("the stepper is over", grpc.StatusCode.UNAVAILABLE)
            self.connection.check()
            if self._replies is None:
                self._requests, self._replies = _open_stream(self.connection.stubs.simulations, self.connection.about(simulation))
            return self._replies

    def _end(self, cancel: bool = False) -> Any:
        with self._state:
            replies, self._replies = self._replies, None
            self._requests.put(None)
        if cancel and replies is not None:
            replies.cancel()
        return replies


async def status_of(stream: Any) -> Any:
    """How a stream of asyncio has ended, as an exception of grpc."""
    code, details = await stream.code(), await stream.details()
    return grpc.aio.AioRpcError(code, await stream.initial_metadata(), await stream.trailing_metadata(), details)


async def exchange_step(stream: Any, request: pb.StepRequest) -> pb.StepStreamReply:
    """One request and its reply; raises what the stream has ended with."""
    try:
        await stream.write(request)
        reply = await stream.read()
    except asyncio.InvalidStateError:  # the stream has ended
        reply = grpc.aio.EOF
    if reply is grpc.aio.EOF:
        raise await status_of(stream)
    answer: pb.StepStreamReply = reply
    return answer


class AwaitedSharedStream:
    """SharedStream for asyncio, within one event loop."""

    def __init__(self, connection: Any) -> None:
        self.connection = connection
        self._turn = asyncio.Lock()  # who has it steps
        self._users = 0
        self._stream: Any = None

    def join(self, simulation: str) -> None:
        """See SharedStream.join."""
        self._users += 1
        self._open(simulation)

    async def step(self, request: pb.StepRequest) -> pb.StepReply:
        """See SharedStream.step. Raises grpc.RpcError, mbcosim.Unavailable."""
        async with self._turn:
            try:
                return (await exchange_step(self._open(request.simulation), request)).step
            except BaseException:  # the reply of a step that nobody awaits any more would be taken for the next one's
                self._end(cancel=True)
                raise

    def leave(self) -> Any:
        """The stream that is to be ended, by the last one."""
        self._users -= 1
        return self._end() if self._users == 0 else None

    def _open(self, simulation: str) -> Any:
        if self._users == 0:
            raise Unavailable("the stepper is over", grpc.StatusCode.UNAVAILABLE)
        self.connection.check()
        if self._stream is None:
            self._stream = self.connection.stubs.simulations.StepStream(metadata=self.connection.about(simulation))
        return self._stream

    def _end(self, cancel: bool = False) -> Any:
        stream, self._stream = self._stream, None
        if cancel and stream is not None:
            stream.cancel()
        return stream


class AwaitedStepLine:
    """StepLine for asyncio, within one event loop."""

    def __init__(self, stub: Any, metadata: Any) -> None:
        self._stub, self._metadata = stub, metadata
        self._stream: Any = None
        self._idle: Optional[asyncio.TimerHandle] = None
        self._last, self._allowed, self._taken = float("-inf"), True, False

    async def step(self, request: pb.StepRequest) -> Optional[pb.StepReply]:
        """See StepLine.step."""
        if self._taken:
            return None
        self._taken = True
        try:
            stream = self._open()
            return None if stream is None else (await exchange_step(stream, request)).step
        except grpc.RpcError as error:
            self.close()
            code = error.code()
            self._allowed = code != grpc.StatusCode.RESOURCE_EXHAUSTED  # as many streams as one may have
            # Newer gRPC takes any end of a stream that meets a write for INTERNAL (its issue 36066): a call tells what it was.
            if code in (grpc.StatusCode.OK, grpc.StatusCode.INTERNAL) or not self._allowed:
                return None
            raise
        except BaseException:  # the reply of a step that nobody awaits any more would be taken for the next one's
            self.close()
            raise
        finally:
            self._last, self._taken = time.monotonic(), False

    def _open(self) -> Any:
        if self._stream is None and self._allowed and time.monotonic() - self._last < _SOON:
            self._stream = self._stub.StepStream(metadata=self._metadata)
            self._watch()
        return self._stream

    def _watch(self) -> None:
        self._idle = asyncio.get_running_loop().call_later(_IDLE / 2, self._close_when_idle)

    def _close_when_idle(self) -> None:
        if not self._taken and time.monotonic() - self._last > _IDLE:
            self.close()
        else:
            self._watch()

    def close(self) -> None:
        """Ends the stream; a later loop opens another one."""
        stream, self._stream = self._stream, None
        if self._idle is not None:
            self._idle.cancel()
        if stream is not None:
            stream.cancel()
