"""The asyncio client: steps, reads, writes, couples; the same numbers as the blocking one."""
import asyncio
import concurrent.futures
import gc
import multiprocessing

import pytest

import decks
import mbcosim
import mbcosim.aio
from conftest import TIME_FACTOR
from mbcosim import exchange
from test_coupling import PORT, oscillator, position, spring

X = "node.structural.1.X"


def run(daemon, body, **options):
    """Runs body(server, simulation) on a new oscillator."""
    async def main():
        async with mbcosim.aio.connect(daemon.address) as server:
            async with await server.load_text(decks.body(final_time="100.", step="1.e-3", spin="null"), ports=PORT) as simulation:
                return await body(server, simulation)

    return asyncio.run(asyncio.wait_for(main(), 60))


def test_steps_reads_and_writes(daemon):
    async def body(server, simulation):
        await simulation.write({"node.structural.1.load": [0, 0, 3, 0, 0, 0]})
        async with await simulation.couple("spring", spring):
            result = await simulation.step(10, outputs=[X])
            assert (result.step, simulation.step_number) == (10, 10)
            assert (await simulation.run_until(0.02)).step == 20
        return result.values[X], (await simulation.read([X]))[X]

    first, last = run(daemon, body)
    assert first.shape == (3,) and last[1] > first[1] > 0


@pytest.mark.parametrize("mode", ["loose", "tight"])
def test_gives_the_bits_of_the_blocking_client(daemon, server, mode):
    async def slow_spring(motion):
        await asyncio.sleep(0)
        return spring(motion)

    async def body(_, simulation):
        async with await simulation.couple("spring", slow_spring, mode=mode) as peer:
            await simulation.step(50)
            assert peer.error is None and peer.exchanges >= 50
        return (await simulation.read([X]))[X]

    found = run(daemon, body)
    with oscillator(server) as simulation, simulation.couple("spring", spring, mode=mode):
        simulation.step(50)
        assert simulation[X].tobytes() == found.tobytes()


def test_names_may_come_from_a_generator(daemon):
    async def body(server, _):
        def names():
            return (name for name in [X])

        simulation = await server.load_text(decks.body(final_time="1."))
        assert list(await simulation.read(names())) == list((await simulation.run_until(0.01, outputs=names())).values) == [X]
        async with await simulation.stepper(names()) as stepper:
            assert list((await stepper.step()).values) == [X]
        for ask in (simulation.read, simulation.subscribe, simulation.stepper, lambda name: simulation.step(outputs=name)):
            with pytest.raises(TypeError, match="must be a list of names, got one by itself"):
                await ask(X)

    run(daemon, body)


def test_a_peer_that_is_iterated_over(daemon):
    async def body(_, simulation):
        steps = []
        async with await simulation.couple("spring") as peer:
            stepping = asyncio.create_task(simulation.step(5))
            async for motion in peer:
                steps.append(motion.step)
                await peer.answer(spring(motion))
                if len(steps) == 5:
                    break
            await stepping
        return steps

    assert run(daemon, body) == [0, 1, 2, 3, 4]


def test_a_peer_tells_where_it_stands(daemon):
    async def body(_, simulation):
        async with await simulation.couple("spring", spring, step=0) as peer:
            await simulation.step(3)
            stands = peer.step
        refused = None
        try:
            await simulation.couple("spring", spring, step=7)
        except mbcosim.PreconditionFailed as error:
            refused = error
        async with await simulation.couple("spring", spring, step=7, can_go_back=True) as back:
            return stands, refused.reason, dict(refused.metadata), back.step

    assert run(daemon, body) == (2, "PEER_AHEAD", {"step": "3", "peer_step": "7"}, 3)


def test_two_simulations_side_by_side(daemon):
    async def body(server, simulation):
        async with await server.load_text(decks.body(final_time="100.", spin="null"), ports=PORT) as other:
            async with await simulation.couple("spring", spring), await other.couple("spring", spring):
                await asyncio.gather(simulation.step(20), other.step(20))
            return [(await s.read([X]))[X].tobytes() for s in (simulation, other)]

    first, second = run(daemon, body)
    assert first == second


def test_failures(daemon, monkeypatch):
    async def body(_, simulation):
        with pytest.raises(mbcosim.NotFound) as caught:
            await simulation.couple("wing", spring)
        assert caught.value.reason == "NO_SUCH_PORT"

        def gust(motion):
            raise ValueError("no aerodynamics today")

        async with await simulation.couple("spring", gust):
            with pytest.raises(mbcosim.StepFailed, match="no aerodynamics today"):
                await simulation.step()
        async with await simulation.couple("spring", lambda motion: [1.0, 2.0]) as peer:
            with pytest.raises(mbcosim.StepFailed, match=r"the peer failed: ValueError: `forces` has the shape \(2,\)"):
                await simulation.step()
            assert isinstance(peer.raised, ValueError) and peer.error is None
        monkeypatch.setattr(exchange.AnswerForm, "fault", lambda *_: None)  # the server looks, too
        wrong = await simulation.couple("spring", lambda motion: [1.0, 2.0], peer_timeout=5)
        with pytest.raises(mbcosim.StepFailed):
            await simulation.step()
        for _ in range(200):
            if wrong.error:
                break
            await asyncio.sleep(0.01)
        assert wrong.error.reason == "BAD_ARGUMENT"
        await wrong.close()

    run(daemon, body)


def test_a_peer_that_computes_while_the_server_dies_is_told(start_daemon):
    daemon, stray = start_daemon(), []

    async def body():
        asyncio.get_running_loop().set_exception_handler(lambda _, context: stray.append(context))
        async with mbcosim.aio.connect(daemon.address) as server:
            simulation = await server.load_text(decks.OSCILLATOR, ports=PORT)
            begun, dead = asyncio.Event(), asyncio.Event()

            async def slow(motion):
                begun.set()
                await dead.wait()
                return spring(motion)

            peer = await simulation.couple("spring", slow, peer_timeout=600, heartbeat_timeout=0.5 * TIME_FACTOR)
            step = asyncio.ensure_future(simulation.step())
            await begun.wait()
            daemon.kill()
            with pytest.raises(mbcosim.Unavailable):
                await step
            dead.set()
            await asyncio.wait([peer._task])
            await peer.close()
            assert isinstance(peer.error, mbcosim.Unavailable)

    asyncio.run(asyncio.wait_for(body(), 60 * TIME_FACTOR))
    gc.collect()
    assert stray == []


async def watched(server, simulation, what):
    """What `async for` takes: a subscription, events or a peer."""
    if what == "events":
        return await server.events()
    return await (simulation.subscribe([X]) if what == "subscription" else simulation.couple("spring"))


@pytest.mark.parametrize("what", ["subscription", "events", "peer"])
def test_who_cancels_a_task_ends_it_while_it_waits_for_what_comes(daemon, what):
    async def body(server, simulation):
        went_on = []

        async def reader():
            async with await watched(server, simulation, what) as watcher:
                async for _ in watcher:
                    pass
                went_on.append(what)

        task = asyncio.create_task(reader())
        await asyncio.sleep(0.2)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(reader(), 0.2)
        assert went_on == []

    run(daemon, body)


@pytest.mark.parametrize("what", ["subscription", "events", "peer"])
def test_what_is_closed_here_ends_in_good_order(daemon, what):
    async def body(server, simulation):
        watcher = await watched(server, simulation, what)

        async def reader():
            async for _ in watcher:
                pass
            return "the end"

        task = asyncio.create_task(reader())
        await asyncio.sleep(0.2)
        closing = watcher.close()
        if closing is not None:
            await closing
        assert await task == "the end" and await reader() == "the end"

    run(daemon, body)


def test_whatever_a_function_raises_fails_the_step(daemon):
    class Nothing(BaseException):
        pass

    async def cancelled():
        other = asyncio.ensure_future(asyncio.sleep(600))
        asyncio.get_running_loop().call_soon(other.cancel)
        await other

    async def raises(error):
        raise error

    async def body(_, simulation):
        for text, work in (("Nothing: at all", lambda: raises(Nothing("at all"))), ("CancelledError: ", cancelled)):
            async with await simulation.couple("spring", lambda motion, work=work: work()) as peer:
                for _ in range(2 if hasattr(asyncio.Task, "cancelling") else 1):
                    with pytest.raises(mbcosim.StepFailed, match="the peer failed: " + text):
                        await simulation.step()
                assert peer.raised is not None and peer.error is None
        assert (await simulation.couple("spring", spring)).error is None and (await simulation.step()).step == 1

    run(daemon, body)


def test_a_program_that_ends_in_a_function_tells_the_server(daemon, server):
    def leaves(motion):
        raise SystemExit(3)

    stepping = []
    with concurrent.futures.ThreadPoolExecutor() as blocking, oscillator(server) as simulation:
        async def main():
            asyncio.get_running_loop().set_exception_handler(lambda *_: None)
            async with mbcosim.aio.connect(daemon.address) as connection:
                same = await connection.attach(simulation.name)
                await same.couple("spring", leaves)
                stepping.append(blocking.submit(simulation.step))
                await asyncio.sleep(600)

        with pytest.raises(SystemExit):
            asyncio.run(main())
        with pytest.raises(mbcosim.StepFailed, match="the peer failed: SystemExit: 3"):
            stepping[0].result(60)


def test_a_closed_peer_cancels_the_function_that_hangs(daemon):
    async def body(_, simulation):
        ended = []

        async def hangs(motion):
            try:
                await asyncio.sleep(600)
            finally:
                ended.append(motion.step)

        peer = await simulation.couple("spring", hangs, peer_timeout=600)
        step = asyncio.ensure_future(simulation.step())
        while not peer._task or not peer._index:
            await asyncio.sleep(0.01)
        await peer.close()
        assert ended == [0] and peer._task.done()
        with pytest.raises(mbcosim.StepFailed, match="the peer is gone"):
            await step

    run(daemon, body)


def test_the_motions_of_a_function_are_not_iterated_over(daemon):
    async def body(_, simulation):
        async with await simulation.couple("spring", spring) as peer:
            with pytest.raises(TypeError, match="attach the peer without one"):
                async for _ in peer:
                    pass
            assert (await simulation.step()).step == 1

    run(daemon, body)


def test_a_forked_process_is_told_that_it_has_no_asyncio(daemon):
    """Its calls would wait for ever, those of the blocking client, too."""
    async def ask():
        async with mbcosim.aio.connect(daemon.address) as server:
            return await server.info()

    def child():
        for connect in (lambda: asyncio.run(ask()), lambda: mbcosim.connect(daemon.address)):
            with pytest.raises(mbcosim.Unavailable, match="connections do not survive a fork"):
                connect()

    assert asyncio.run(ask()).version
    process = multiprocessing.get_context("fork").Process(target=child)
    process.start()
    process.join(10 * TIME_FACTOR)
    code = process.exitcode
    process.kill()
    assert code == 0


def test_synchronous_peers_and_views(server):
    """The blocking client without a callback: the arrays are views of the received bytes."""
    import threading
    with oscillator(server) as simulation, simulation.couple("spring") as peer:
        stepping = threading.Thread(target=simulation.step, args=(20,))
        stepping.start()
        for count, motion in enumerate(peer, 1):
            assert motion.x.shape == (1, 3) and motion.rotations.shape == (1, 3, 3)
            assert not motion.x.flags.owndata and not motion.x.flags.writeable
            peer.answer(spring(motion))
            if count == 20:
                break
        stepping.join()
        found = simulation[X]
    with oscillator(server) as simulation, simulation.couple("spring", spring):
        simulation.step(20)
        assert simulation[X].tobytes() == found.tobytes() and position(simulation) != 0
