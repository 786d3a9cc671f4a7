"""The client for asyncio: the same calls as coroutines.

    import asyncio, mbcosim.aio

    async def main():
        ports = [mbcosim.structural_port("tip", nodes=[2])]
        async with mbcosim.aio.connect() as server, await server.load("beam.mbd", ports=ports) as beam:
            async with await beam.couple("tip", lambda motion: -100.0 * motion.x, mode="tight"):
                await beam.run_until(1.0)

    asyncio.run(main())
"""
import asyncio
import contextlib
import inspect
import uuid

import grpc

from mbcosim.v1 import simulations_pb2 as pb, simulations_pb2_grpc

from . import bundle, exchange, simulation as blocking
from .client import default_address
from .coupling import open_stream
from .errors import from_rpc_error, translated


@contextlib.asynccontextmanager
async def connect(address=None, *, token=None, credentials=None, timeout=10.0):
    """A connection; waits until the server answers, at most `timeout` seconds."""
    options = [("grpc.max_receive_message_length", -1)]
    address = address or default_address()
    channel = (grpc.aio.secure_channel(address, credentials, options) if credentials
               else grpc.aio.insecure_channel(address, options))
    async with channel:
        server = Server(channel, token)
        with translated():
            await server.simulations.GetServerInfo(pb.GetServerInfoRequest(), metadata=server.metadata, timeout=timeout,
                                                   wait_for_ready=True)
        yield server


class Server:
    """A connection; made by `connect`."""

    def __init__(self, channel, token):
        self._channel = channel
        self.metadata = [("authorization", f"Bearer {token}")] if token else []
        self.simulations = simulations_pb2_grpc.SimulationsStub(channel)

    async def load(self, deck, **options):
        """Creates a simulation from a deck on this machine and the files that it names."""
        return await self._create(*bundle.collect(deck), **options)

    async def load_text(self, text, **options):
        """Creates a simulation from a deck given as text."""
        return await self._create("deck", {"deck": text.encode()}, **options)

    async def _create(self, main, files, *, name="", lease=None, ports=()):
        header = pb.UploadHeader(bundle_main_file=main)
        header.options.request_id = uuid.uuid4().hex
        header.options.display_name = name
        header.options.ports.extend(ports)
        if lease is not None:
            header.options.lease.FromMilliseconds(int(lease * 1000))
        with translated():
            reply = await self.simulations.CreateSimulation(bundle.requests(header, files), metadata=self.metadata)
            description = await self.simulations.DescribeSimulation(
                pb.DescribeSimulationRequest(name=reply.simulation.name), metadata=self.metadata)
        return Simulation(self, reply, description)


class Simulation:
    """A simulation; `async with` deletes it at the end."""

    def __init__(self, server, reply, description):
        self._server, self._stub = server, server.simulations
        # Packs, splits and checks replies; makes no calls once it knows the variables.
        self._local = blocking.Simulation(server, reply.simulation, list(reply.diagnostics), reply.printed)
        self._local._variables = {v.name: v for v in description.variables}
        self.name, self.info, self.description = reply.simulation.name, reply.simulation, description

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_):
        await self.delete()

    async def _call(self, method, request):
        with translated():
            return await method(request, metadata=self._server.metadata)

    @property
    def step_number(self):
        """Number of the last accepted step."""
        return self._local.step_number

    @property
    def time(self):
        """Time of the last accepted step [s]."""
        return self._local.time

    async def step(self, count=1, *, inputs=None, outputs=()):
        """Takes `count` steps. Raises StepFailed when one does not converge."""
        return await self._advance(pb.StepRequest(steps=count), inputs, outputs)

    async def run_until(self, time, *, inputs=None, outputs=()):
        """Steps until `time` [s] or the deck's end."""
        return await self._advance(pb.StepRequest(until_time_s=time), inputs, outputs)

    async def _advance(self, request, inputs, outputs):
        self._local._fill(request, inputs, outputs)
        request.request_id = uuid.uuid4().hex
        return self._local.result(await self._call(self._stub.Step, request), outputs)

    async def read(self, names):
        """Values at the last accepted step, by name."""
        request = pb.ReadVariablesRequest(simulation=self.name, handles=self._local.handles(names))
        return self._local.split(names, (await self._call(self._stub.ReadVariables, request)).values)

    async def write(self, values):
        """Sets inputs, by name."""
        await self._call(self._stub.WriteVariables,
                         pb.WriteVariablesRequest(simulation=self.name, values=self._local.pack(values)))

    async def delete(self):
        """Ends the simulation."""
        await self._call(self._stub.DeleteSimulation, pb.DeleteSimulationRequest(name=self.name))

    async def couple(self, port, answer=None, **options):
        """Attaches a peer to a port. `answer` may be a coroutine function; for the options see coupling.Peer."""
        peer = Peer(self, answer, options.get("rotation", "matrix"))
        await peer._attach(exchange.hello(self, port, **options))
        return peer


class Peer(exchange.Course):
    """An attached peer: `async with` keeps it. A task of its own calls `answer(Motion)`; without `answer` iterate:

        async for motion in peer:
            await peer.answer(-100.0 * motion.x)
    """

    def __init__(self, simulation, answer, rotation):
        super().__init__(rotation)
        self._server, self._function, self._task = simulation._server, answer, None

    async def _attach(self, hello):
        self._stream = open_stream(self._server._channel)(metadata=self._server.metadata)
        try:
            await self._stream.write(hello)
            data = await self._stream.read()
            if data is grpc.aio.EOF:
                await self._raise_status()
            self.welcome = exchange.receive(data)[1]
        except (grpc.RpcError, asyncio.InvalidStateError):
            await self._raise_status()
        if self._function is not None:
            self._task = asyncio.get_running_loop().create_task(self._serve())

    async def _raise_status(self):
        raise from_rpc_error(await self._status()) from None

    async def _status(self):
        code, details = await self._stream.code(), await self._stream.details()
        return grpc.aio.AioRpcError(code, await self._stream.initial_metadata(), await self._stream.trailing_metadata(), details)

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_):
        await self.close()

    async def close(self):
        """Leaves the port."""
        if not self._stream.done():
            await self._stream.done_writing()
            self._stream.cancel()
        if self._task is not None:
            await asyncio.wait([self._task], timeout=5)

    async def __aiter__(self):
        """Every Motion until the stream ends."""
        while True:
            try:
                data = await self._stream.read()
            except (grpc.RpcError, asyncio.CancelledError):
                data = grpc.aio.EOF
            if data is grpc.aio.EOF:
                break
            motion = self._take(data)
            if motion is not None:
                yield motion
        status = await self._status()
        if status.code() not in (grpc.StatusCode.OK, grpc.StatusCode.CANCELLED):
            self.error = from_rpc_error(status)

    async def answer(self, value):
        """Answers the last motion."""
        await self._stream.write(self._answer(value))

    async def fail(self, error):
        """The peer cannot answer the last motion; the step fails with this text."""
        await self._stream.write(self._failure(error))

    async def _serve(self):
        async for motion in self:
            try:
                value = self._function(motion)
                message = self._answer(await value if inspect.isawaitable(value) else value)
            except Exception as error:  # whatever the user's code raises becomes a failed step with this text
                message = self._failure(error)
            await self._stream.write(message)
