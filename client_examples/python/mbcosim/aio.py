"""The client for asyncio: the same calls as coroutines.

    import asyncio, mbcosim.aio

    async def main():
        ports = [mbcosim.structural_port("tip", nodes=[2])]
        async with mbcosim.aio.connect() as server, await server.load("beam.mbd", ports=ports) as beam:
            async with await beam.couple("tip", lambda motion: -100.0 * motion.x, mode="tight"):
                await beam.run_until(1.0)

    asyncio.run(main())
"""
from __future__ import annotations

import asyncio
import contextlib
import functools
import inspect
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping
from typing import Any, Optional, TypeVar, Union

import grpc
import numpy.typing as npt

from mbcosim.v1 import common_pb2, coupling_pb2, events_pb2, simulations_pb2 as pb, telemetry_pb2

from . import access, events, exchange
from .access import Attempts
from .calls import Condition, ServerCalls, SimulationCalls, SnapshotCalls, StepResult, Values, real_numbers
from .coupling import Answer, open_stream
from .errors import Busy, Error, PreconditionFailed, StepFailed, TimedOut, Unavailable, cancelled_here, from_rpc_error, translated
from .histories import History
from .rpc import (PARTING, USUAL, Address, Awaiting, Bound, Call, Calls, InUse, Open, Retries, cancelling, channel_options, checked_timeout, metadata,
                  parting, runs_calls)
from .simulation import subscribe_request
from .stepping import AwaitedSharedStream, AwaitedStepLine, status_of
from .words import each_name

T = TypeVar("T")
Self = TypeVar("Self")


@contextlib.asynccontextmanager
async def connect(address: Optional[str] = None, *, token: Optional[str] = None, tls: Optional[bool] = None, ca: Optional[access.Path] = None,
                  certificate: Optional[access.Path] = None, key: Optional[access.Path] = None, credentials: Any = None,
                  timeout: Optional[float] = None, reconnect: float = 0.0) -> AsyncIterator[Server]:
    """A connection; for the arguments see mbcosim.connect."""
    secured = credentials or access.credentials(tls, ca, certificate, key)
    server = Server(access.reached(address), access.checked_token(token), secured, reconnect)
    try:
        attempts = Attempts(server.address, timeout)
        while True:
            try:
                with translated():
                    await server._connection.stubs.simulations.GetServerInfo(
                        pb.GetServerInfoRequest(), metadata=server.metadata, timeout=attempts.left())
                break
            except Unavailable as error:
                attempts.again(error)
                await asyncio.sleep(Attempts.PAUSE)
        yield server
    finally:
        await server.close()


@functools.cache
def _keep_grpc() -> InUse:
    """Keeps gRPC's runtime for asyncio alive until the process ends.

    Without it the last channel that goes waits, within the garbage collector and without a bound, for calls whose
    messages are still being written; to a server that has stopped reading they are written for ever
    (gRPC issues 22365 and 40989).
    """
    grpc.aio.init_grpc_aio()
    return InUse()


class Connection(Open, Address):
    """A channel whose calls are awaited."""

    def __init__(self, channel: Any, token: Optional[str], reconnect: float) -> None:
        super().__init__(channel)
        self.metadata, self.reconnect = metadata(token), reconnect

    async def run(self, calls: Calls[T]) -> T:
        """Makes the calls of a generator one after the other; its result."""
        bound = Bound()
        try:
            call = next(calls)
            while True:
                try:
                    reply = await self.perform(bound.within(call))
                except Error as error:
                    call = calls.throw(error)
                else:
                    call = calls.send(reply)
        except StopIteration as end:
            result: T = end.value
            return result

    async def perform(self, call: Call) -> Any:
        retries = Retries(call, self.reconnect)
        while True:
            self.check()
            try:
                with translated():
                    return await self._once(call)
            except asyncio.CancelledError as error:
                if not _ends_a_task(error):
                    self.check()  # gRPC cancels what waits for a reply when the channel is closed
                raise
            except (Unavailable, Busy) as error:
                pause, left = retries.again(error)
                await asyncio.sleep(pause)
                if not left:
                    continue
                with contextlib.suppress(asyncio.TimeoutError):
                    await asyncio.wait_for(self.channel.channel_ready(), left)
                    continue
                raise

    async def _once(self, call: Call) -> Any:
        if call.through is not None and call.timeout is None and (reply := await call.through(call.request)) is not None:
            return reply
        answer = self.stubs.method(call.method)(call.sent(), metadata=self.metadata_of(call), timeout=call.timeout)
        if call.each is None:
            return await answer
        with cancelling(answer):
            async for message in answer:
                taken = call.each(message)
                if inspect.isawaitable(taken):
                    await taken
        return None


def awaited(function: Callable[..., Calls[T]]) -> Callable[..., Awaitable[T]]:
    """The generator `function` as a coroutine function."""
    async def method(self: Any, *arguments: Any, **options: Any) -> T:
        result: T = await self._connection.run(function(self, *arguments, **options))
        return result
    return method


class _Watcher:
    """What comes on a stream until the server ends it, or `close` does. Who cancels a task that waits for it ends the stream, too."""
    _stream: Any
    _closed = False

    async def __aenter__(self: Self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        self.close()

    async def _messages(self) -> AsyncIterator[Any]:
        try:
            while not self._stream.cancelled():
                with translated():
                    message = await self._stream.read()
                if message is grpc.aio.EOF:
                    return
                yield message
        except asyncio.CancelledError:
            if not self._closed:
                raise

    def close(self) -> None:
        """Ends it."""
        self._closed = True
        self._stream.cancel()


async def _bounded(seconds: Optional[float], awaitable: Awaitable[T], cancel: Callable[[], object], what: str) -> T:
    """What `awaitable` gives; after `seconds` (None: never) `cancel` is called and TimedOut raised."""
    try:
        checked_timeout(seconds)
    except Error:
        asyncio.ensure_future(awaitable).cancel()
        cancel()
        raise
    try:
        return await asyncio.wait_for(awaitable, seconds)
    except asyncio.TimeoutError:
        cancel()
        raise TimedOut(f"{what} took longer than {seconds} s", grpc.StatusCode.DEADLINE_EXCEEDED) from None


@runs_calls(awaited)
class Snapshot(Awaiting, SnapshotCalls):
    """A saved state of a simulation. With `async with`: at the end of the block the simulation goes back to it, and it is forgotten."""

    async def __aenter__(self: Self) -> Self:
        return self

    async def __aexit__(self, kind: object = None, raised: Optional[BaseException] = None, trace: object = None) -> None:
        await self._connection.run(self._end(raised))


@runs_calls(awaited)
class Simulation(Awaiting, SimulationCalls[Snapshot]):
    """A simulation; `async with` deletes it at the end (unless it was attached)."""
    _snapshot_class = Snapshot

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._line = AwaitedStepLine(self._connection.stubs.simulations, self._connection.about(self.name))
        self._through = self._line.step

    async def step(self, count: int = 1, *, step_size: Optional[float] = None,  # type: ignore[override]  # of a method made by runs_calls
                   until: Optional[Condition] = None, inputs: Optional[Values] = None, outputs: Iterable[str] = (),
                   timeout: Optional[float] = None) -> StepResult:
        """As mbcosim.Simulation.step."""
        names = each_name(outputs, "outputs")
        if step_size is None and until is None and timeout is None and not inputs and (request := self._quick_step(count, names)) is not None:
            return self.result(await self._connection.perform(Call("Simulations/Step", request, repeatable=True, through=self._through)), names)
        result: StepResult = await self._connection.run(self._steps(count, step_size, until, inputs, names, timeout))
        return result

    def _leave(self) -> None:
        self._line.close()

    async def __aenter__(self: Self) -> Self:
        return self

    async def __aexit__(self, kind: object = None, raised: Optional[BaseException] = None, trace: object = None) -> None:
        await self._connection.run(self._end(raised))

    @property
    def variables(self) -> dict[str, common_pb2.Variable]:
        """`mbcosim.v1.Variable` by name, once `describe` was called."""
        if self._description is None:
            raise PreconditionFailed("the variables are not known yet: await Simulation.describe() first")
        return self._known

    async def stepper(self, outputs: Iterable[str] = (), inputs: Iterable[str] = (), *, beside: Optional[Stepper] = None,
                      timeout: Optional[float] = USUAL) -> Stepper:
        """An open stream for stepping with the least delay, or, `beside` another stepper, a place on that one's; see Stepper."""
        outputs = each_name(outputs, "outputs")
        handles = await self.handles([*outputs, *each_name(inputs, "inputs")], timeout=timeout)
        return Stepper(self, outputs, handles[:len(outputs)], handles[len(outputs):], beside)

    async def couple(self, port: str, answer: Optional[Answer] = None, **options: Any) -> Peer:
        """Attaches a peer to a port. `answer` may be a coroutine function; for the options see coupling.Peer."""
        timeout = options.pop("timeout", USUAL)
        peer = Peer(self, answer, options.get("rotation", "matrix"), options.get("heartbeat_timeout"),
                    options.pop("server_timeout", None))
        await peer._attach(exchange.hello(self, port, heartbeat_interval=peer._heartbeat_interval, **options), timeout)
        return peer

    async def simulate(self, outputs: Union[str, Iterable[str]], *, until: Optional[float] = None, steps: Optional[int] = None, every: int = 1,
                       inputs: Optional[Mapping[str, Any]] = None, timeout: Optional[float] = None) -> History:
        """Advances and returns a History of `outputs` in one call; see mbcosim.Simulation.simulate. Inputs are numbers."""
        if (until is None) == (steps is None):
            raise ValueError("say how long with `until` or with `steps`")
        request = pb.StepRequest(steps=steps) if until is None else pb.StepRequest(until_time=until)
        names = [outputs] if isinstance(outputs, str) else list(outputs)
        try:
            rows, _ = await self._connection.run(self._tabulate(names, request, every, inputs, None, timeout))
        except StepFailed as error:
            error.history = History.of_rows(error.rows, self)
            raise
        return History.of_rows(rows, self)

    async def subscribe(self, names: Iterable[str], *, every: int = 1, policy: str = "drop_oldest", buffer: int = 1024,
                        minimum_interval: Optional[float] = None, timeout: Optional[float] = USUAL) -> Subscription:
        """Samples of variables every so many steps, whoever advances, at least `minimum_interval` seconds of wall time apart; see Subscription."""
        names = each_name(names)
        request = subscribe_request(self, await self.handles(names, timeout=timeout), every, policy, buffer, minimum_interval)
        subscription = Subscription(self, names, request)
        with translated():
            await _bounded(timeout, subscription._stream.read(), subscription.close, "the subscription")
        return subscription


@runs_calls(awaited)
class Server(Awaiting, ServerCalls[Simulation]):
    """A connection; made by `connect`."""
    _simulation_class = Simulation

    def __init__(self, address: str, token: Optional[str], credentials: Any, reconnect: float) -> None:
        options = channel_options(address)
        target = access.target(address)
        InUse.check()
        _keep_grpc()
        channel = grpc.aio.secure_channel(target, credentials, options) if credentials else grpc.aio.insecure_channel(target, options)
        self.address = address
        self._connection = Connection(channel, token, reconnect)
        self.metadata = self._connection.metadata

    async def events(self, simulation: str = "", *, after: Optional[int] = None, journal: str = "",
                     timeout: Optional[float] = USUAL) -> Events:
        """Events as they happen; see mbcosim.Server.events."""
        watcher = Events(self._connection, simulation, after, journal)
        with translated():
            watcher._begin(await _bounded(timeout, watcher._stream.read(), watcher.close, "the beginning of the events"), after)
        return watcher

    async def close(self) -> None:
        """Closes the connection. Simulations on the server live on for their lease."""
        closing = self._connection.close()
        if closing is not None:
            await closing


class Events(events.Course, _Watcher):
    """`async for` over `mbcosim.v1.Event`. Close it, or use it with `async with`."""

    def __init__(self, connection: Connection, simulation: str, after: Optional[int], journal: str) -> None:
        self._stream: Any = connection.stubs.events.WatchEvents(events.watch_request(simulation, after, journal), metadata=connection.about(simulation))

    async def __aiter__(self) -> AsyncIterator[events_pb2.Event]:
        async for event in self._messages():
            yield self._take(event)


class Stepper:
    """Steps on an open stream: one message each way per step.

        async with await simulation.stepper(outputs=["node.structural.1.X"]) as stepper:
            x = (await stepper.step()).values["node.structural.1.X"]

    Many simulations of one connection are stepped on one stream by steppers `beside` the first; see mbcosim.simulation.Stepper.
    """

    def __init__(self, simulation: Simulation, outputs: list[str], output_handles: Iterable[int], input_handles: Iterable[int],
                 beside: Optional[Stepper] = None) -> None:
        connection = simulation._connection
        if beside is not None and (beside._stream is None or beside._stream.connection is not connection):
            raise ValueError("beside: must be a stepper of the same connection that is not over")
        self._simulation, self._outputs = simulation, outputs
        self._request = pb.StepRequest(simulation=simulation.name, outputs=output_handles)
        self._request.inputs.handles.extend(input_handles)
        stream = AwaitedSharedStream(connection) if beside is None else beside._stream
        assert stream is not None
        stream.join(simulation.name)
        self._stream: Optional[AwaitedSharedStream] = stream

    async def __aenter__(self: Self) -> Self:
        return self

    async def __aexit__(self, kind: object = None, raised: Optional[BaseException] = None, trace: object = None) -> None:
        with parting(raised):
            await self.close()

    async def step(self, values: Optional[npt.ArrayLike] = None, count: int = 1, *, step_size: Optional[float] = None,
                   timeout: Optional[float] = None) -> StepResult:
        """Takes `count` steps, of `step_size` [s] each (default: the deck's); `values`: numbers of the stepper's inputs, one variable after the
        other. After a timeout the stepper is over."""
        request = pb.StepRequest()
        request.CopyFrom(self._request)
        request.steps = count
        if step_size is not None:
            request.step_size = step_size
        if request.inputs.handles:
            request.inputs.values.extend(real_numbers(() if values is None else values).ravel())
        if self._stream is None:
            raise Unavailable("the stepper is over", grpc.StatusCode.UNAVAILABLE)
        checked_timeout(timeout)
        try:
            with translated():
                reply = await _bounded(timeout, self._stream.step(request), lambda: None, "the step")
        except BaseException:
            await self.close()
            raise
        return self._simulation.result(reply, self._outputs)

    async def close(self, *, timeout: Optional[float] = PARTING) -> None:
        """Leaves the stream; the last stepper ends it."""
        shared, self._stream = self._stream, None
        stream = shared.leave() if shared is not None else None
        if stream is None or stream.done():
            return
        with parting():
            await stream.done_writing()
            await _bounded(timeout, stream.code(), stream.cancel, "the end of the stream")


class Subscription(_Watcher):
    """Samples as they come: `async for` over (step, time, values by name). Close it, or use it with `async with`.

    `dropped` counts the samples that the server dropped because they were not read in time.
    """

    def __init__(self, simulation: Simulation, names: list[str], request: telemetry_pb2.SubscribeRequest) -> None:
        self._simulation, self._names, self.dropped = simulation, names, 0
        connection = simulation._connection
        self._stream = connection.stubs.telemetry.Subscribe(request, metadata=connection.about(simulation.name))

    async def __aiter__(self) -> AsyncIterator[tuple[int, float, dict[str, Any]]]:
        async for batch in self._messages():
            self.dropped = batch.total_dropped
            for sample in batch.samples:
                yield sample.step, sample.time, self._simulation.split(self._names, sample.values)


class Peer(exchange.Course):
    """An attached peer: `async with` keeps it. A task of its own calls `answer(Motion)`; without `answer` iterate:

        async for motion in peer:
            await peer.answer(-100.0 * motion.x)
    """

    def __init__(self, simulation: Simulation, answer: Optional[Answer], rotation: str, heartbeat_timeout: Optional[float],
                 server_timeout: Optional[float]) -> None:
        super().__init__(rotation)
        self._connection, self._function = simulation._connection, answer
        self._task: Optional[asyncio.Task[None]] = None
        self._heart: Optional[asyncio.Task[None]] = None
        self._beats, self._silence = heartbeat_timeout, server_timeout
        self._heartbeat_interval = None if server_timeout is None else server_timeout / 3
        self._waiting_since: Optional[float] = None
        self._writing = asyncio.Lock()
        self._ended = False  # by this side

    async def _attach(self, hello: coupling_pb2.PeerMessage, timeout: Optional[float]) -> None:
        self._stream = open_stream(self._connection.channel)(metadata=self._connection.about(hello.hello.simulation))
        self._begin(await _bounded(timeout, self._shake_hands(hello), self._stream.cancel, "attaching the peer"), hello.hello)
        loop = asyncio.get_running_loop()
        if self._beats is not None or self._silence is not None:
            self._heart = loop.create_task(self._beat())
        if self._function is not None:
            self._task = loop.create_task(self._serve())

    async def _shake_hands(self, hello: coupling_pb2.PeerMessage) -> coupling_pb2.Welcome:
        try:
            await self._stream.write(hello)
            data = await self._stream.read()
            if data is not grpc.aio.EOF:
                welcome: coupling_pb2.Welcome = exchange.receive(data)[1]
                return welcome
        except (grpc.RpcError, asyncio.InvalidStateError):
            pass
        raise from_rpc_error(await status_of(self._stream)) from None

    async def __aenter__(self: Self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def _leave(self) -> None:
        """Until the server has ended the stream: the port is free then."""
        await self._stream.done_writing()
        await self._stream.code()

    async def close(self) -> None:
        """Leaves the port."""
        self._ended = True
        if self._heart is not None:
            self._heart.cancel()
        try:
            if not self._stream.done():
                with contextlib.suppress(asyncio.TimeoutError, asyncio.InvalidStateError):
                    await asyncio.wait_for(self._leave(), PARTING / 2)
        finally:
            self._stream.cancel()
        if self._task is not None and self._task is not asyncio.current_task():
            await self._end_task(self._task)

    async def _end_task(self, task: asyncio.Task[None]) -> None:
        """Waits for a moment for the function that answers, then cancels it."""
        if not (await asyncio.wait([task], timeout=PARTING / 2))[0]:
            task.cancel()
            await asyncio.wait([task], timeout=PARTING / 2)

    def __aiter__(self) -> AsyncIterator[exchange.Motion]:
        """Every Motion until the stream ends."""
        exchange.check_synchronous(self._function)
        return self._motions()

    async def _motions(self) -> AsyncIterator[exchange.Motion]:
        while True:
            self._waiting_since = time.monotonic()
            try:
                data = await self._stream.read()
            except grpc.RpcError:
                data = grpc.aio.EOF
            except asyncio.CancelledError:
                if not self._ended:
                    raise
                data = grpc.aio.EOF
            self._waiting_since = None
            if data is grpc.aio.EOF:
                break
            motion = self._take(data)
            if motion is not None:
                yield motion
        status = await status_of(self._stream)
        if status.code() != grpc.StatusCode.OK and not cancelled_here(status):
            self.error = self.error or from_rpc_error(status)

    async def answer(self, value: Any) -> None:
        """Answers the last motion."""
        await self._write(self._answer(value))

    async def fail(self, error: BaseException) -> None:
        """The peer cannot answer the last motion; the step fails with this text."""
        await self._write(self._failure(error))

    async def _write(self, message: coupling_pb2.PeerMessage) -> None:
        async with self._writing:  # the heart writes, too
            with contextlib.suppress(grpc.RpcError, asyncio.InvalidStateError):  # the stream has ended: who reads is told how
                await self._stream.write(message)

    async def _beat(self) -> None:
        """Sends signs of life, and looks for those of the server."""
        count = 0
        while not self._stream.done():
            await asyncio.sleep(min(t for t in (self._beats, self._silence) if t is not None) / 3)
            since = self._waiting_since
            if self._silence is not None and since is not None and time.monotonic() - since > self._silence:
                self.error = Unavailable(f"the server was silent for {self._silence} s", grpc.StatusCode.UNAVAILABLE)
                self._ended = True
                self._stream.cancel()
                return
            if self._beats is None:
                continue
            count += 1
            await self._write(coupling_pb2.PeerMessage(heartbeat=coupling_pb2.Heartbeat(count=count)))

    async def _serve(self) -> None:
        assert self._function is not None
        async for motion in self._motions():
            try:
                value = self._function(motion)
                message = self._answer(await value if inspect.isawaitable(value) else value)
            except GeneratorExit:  # nobody runs this task any more
                raise
            except BaseException as error:  # whatever the user's code raises becomes a failed step with this text
                await self._write(self._failure(error))
                if _ends_a_task(error):
                    await self._depart()
                    raise
            else:
                await self._write(message)

    async def _depart(self) -> None:
        """Tells the server that no more answers come."""
        self._ended = True
        with contextlib.suppress(grpc.RpcError, asyncio.InvalidStateError):
            await self._stream.done_writing()


def _ends_a_task(error: BaseException) -> bool:
    """Is it for the task that runs, not for one that it has waited for? Before Python 3.11 nobody can tell."""
    if isinstance(error, asyncio.CancelledError):
        return bool(getattr(asyncio.current_task(), "cancelling", lambda: 1)())
    return isinstance(error, (KeyboardInterrupt, SystemExit))
