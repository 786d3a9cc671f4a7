"""Steps one by one in a loop of the asyncio client: they travel on an open stream, as those of the blocking one do (test_stepping.py)."""
import asyncio
import types

import grpc
import pytest

import decks
import mbcosim
import mbcosim.aio
from conftest import TIME_FACTOR
from mbcosim.stepping import AwaitedStepLine
from mbcosim.v1 import simulations_pb2 as pb

POSITION = "node.structural.1.X"


async def in_a_loop(simulation, count=5, **options):
    return [await simulation.step(outputs=[POSITION], **options) for _ in range(count)]


def has_a_stream(simulation):
    return simulation._line._stream is not None


def run(daemon, body):
    async def main():
        async with mbcosim.aio.connect(daemon.address) as server:
            await body(server)

    asyncio.run(asyncio.wait_for(main(), 60 * TIME_FACTOR))


def test_steps_in_a_loop_share_a_stream_that_ends_when_they_do(daemon):
    async def body(server):
        async with await server.load_text(decks.body()) as simulation, await server.load_text(decks.body()) as other:
            await simulation.step()
            assert not has_a_stream(simulation)  # one step is a call
            alike = [[r.values[POSITION].tolist() for r in await in_a_loop(simulation)]]
            assert has_a_stream(simulation)
            await other.step()
            alike.append([r.values[POSITION].tolist() for r in await in_a_loop(other, timeout=60.0)])
            assert not has_a_stream(other)  # with a timeout each is a call
            assert alike[0] == alike[1] and await simulation.export_state() == await other.export_state()
            while has_a_stream(simulation):
                await asyncio.sleep(0.05)
            assert (await simulation.step()).step == 7
            await in_a_loop(simulation)
        assert not has_a_stream(simulation)

    run(daemon, body)


def test_an_error_in_a_loop_is_that_of_a_call_and_the_loop_goes_on(daemon):
    async def body(server):
        async with await server.load_text(decks.body()) as simulation:
            await in_a_loop(simulation)
            for _ in range(3):
                with pytest.raises(mbcosim.Error) as caught:
                    await simulation.step(step_size=-1.0)
                assert (caught.value.reason, caught.value.field) == ("BAD_ARGUMENT", "step_size")
            assert (await in_a_loop(simulation))[-1].step == 10 and has_a_stream(simulation)

    run(daemon, body)


def test_two_tasks_step_one_simulation_in_a_loop(daemon):
    async def body(server):
        async with await server.load_text(decks.body()) as simulation:
            async def loop():
                for _ in range(50):
                    while True:
                        try:
                            await simulation.step()
                            break
                        except mbcosim.Busy:
                            pass

            await asyncio.gather(loop(), loop())
            assert (await simulation.refresh()).step == 100

    run(daemon, body)


def test_a_step_that_nobody_awaits_any_more_leaves_no_reply_for_the_next(daemon):
    async def body(server):
        async with await server.load_text(decks.endless()) as simulation:
            await in_a_loop(simulation)
            for _ in range(3):
                with pytest.raises(asyncio.TimeoutError):
                    await asyncio.wait_for(simulation.step(10**9), 0.2)
                while (await simulation.refresh()).state != pb.SIMULATION_STATE_READY:
                    await asyncio.sleep(0.01)
                before = simulation.info.step
                assert [r.step for r in await in_a_loop(simulation)] == list(range(before + 1, before + 6))

    run(daemon, body)


def test_a_run_whose_progress_raises_ends_on_the_server(daemon):
    async def refuses(progress):
        raise ValueError("enough")

    async def body(server):
        async with await server.load_text(decks.endless()) as simulation:
            with pytest.raises(ValueError, match="enough") as caught:
                await simulation.run_until(1e8, progress=refuses)
            while (await simulation.refresh()).state != pb.SIMULATION_STATE_READY:
                await asyncio.sleep(0.01)
            assert caught.value  # whose trace keeps the call

    run(daemon, body)


async def subscribed(simulation):
    """A subscription in the only place for streams. The upload of the deck has it until the server knows that its reply has arrived."""
    while True:
        try:
            return await simulation.subscribe(["time"])
        except mbcosim.LimitExceeded:
            await asyncio.sleep(0.01)


def test_where_no_stream_is_to_be_had_a_loop_makes_calls(start_daemon):
    async def body(server):
        async with await server.load_text(decks.body()) as simulation, await subscribed(simulation):
            assert (await in_a_loop(simulation, 20))[-1].step == 20 and not has_a_stream(simulation)

    run(start_daemon("--limit-identity-streams", "1"), body)


def test_a_write_that_meets_the_end_of_its_stream_leaves_the_step_to_a_call():
    class Ended:
        async def write(self, _):
            raise grpc.aio.AioRpcError(grpc.StatusCode.INTERNAL, grpc.aio.Metadata(), grpc.aio.Metadata(), "Internal error from Core")

        def cancel(self):
            pass

    async def body():
        line = AwaitedStepLine(types.SimpleNamespace(StepStream=lambda metadata: Ended()), [])
        assert [await line.step(pb.StepRequest()) for _ in range(3)] == [None] * 3
        assert line._stream is None

    asyncio.run(body())


def test_a_daemon_that_dies_in_a_loop_is_noticed(start_daemon):
    daemon = start_daemon()

    async def body(server):
        simulation = await server.load_text(decks.body())
        await in_a_loop(simulation)
        daemon.kill()
        with pytest.raises(mbcosim.Unavailable):
            await in_a_loop(simulation)

    run(daemon, body)


def test_steppers_share_a_stream(daemon):
    async def body(server):
        simulations = [await server.load_text(decks.body()) for _ in range(4)]
        steppers = [await simulations[0].stepper([POSITION])]
        steppers += [await simulation.stepper([POSITION], beside=steppers[0]) for simulation in simulations[1:]]
        assert len({stepper._stream for stepper in steppers}) == 1
        await steppers[0].close()
        with pytest.raises(mbcosim.Unavailable):
            await steppers[0].step()
        with pytest.raises(ValueError, match="beside"):
            await simulations[0].stepper(beside=steppers[0])
        async with mbcosim.aio.connect(daemon.address) as another:
            with pytest.raises(ValueError, match="beside"):
                await (await another.attach(simulations[0].name)).stepper(beside=steppers[1])
        steppers[0] = await simulations[0].stepper([POSITION], beside=steppers[1])
        for _ in range(50):  # at once, and in turn
            await asyncio.gather(*(stepper.step() for stepper in steppers))
            results = [await stepper.step() for stepper in steppers]
        assert {result.step for result in results} == {100}
        assert len({result.values[POSITION].tobytes() for result in results}) == 1
        for stepper in steppers:
            await stepper.close()
        for simulation in simulations:
            await simulation.delete()

    run(daemon, body)


def test_what_ends_one_stepper_leaves_the_others(daemon):
    async def body(server):
        quick = await server.load_text(decks.body())
        slow, slower = [await server.load_text(decks.endless()) for _ in range(2)]
        steppers = [await quick.stepper()]
        steppers += [await simulation.stepper(beside=steppers[0]) for simulation in (slow, quick)]
        with pytest.raises(mbcosim.TimedOut):
            await steppers[1].step(count=10**6, timeout=0.2 * TIME_FACTOR)
        with pytest.raises(mbcosim.Unavailable):
            await steppers[1].step()
        assert (await steppers[0].step()).step == 1
        with pytest.raises(mbcosim.Error):
            await steppers[2].step(step_size=-1.0)
        task = asyncio.ensure_future((await slower.stepper(beside=steppers[0])).step(count=10**6))
        await asyncio.sleep(0.2)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert (await steppers[0].step()).step == 2
        await steppers[0].close()
        for simulation in (quick, slow, slower):
            await simulation.delete()

    run(daemon, body)


def test_a_step_whose_stepper_is_closed_while_it_waits_opens_no_stream(daemon):
    async def body(server):
        async with await server.load_text(decks.body()) as simulation:
            stepper = await simulation.stepper()
            shared = stepper._stream
            async with shared._turn:
                waiting = asyncio.ensure_future(stepper.step())
                await asyncio.sleep(0.05)
                await stepper.close()
            with pytest.raises(mbcosim.Unavailable, match="over"):
                await waiting
            assert shared._stream is None and (await simulation.step()).step == 1

    run(daemon, body)
