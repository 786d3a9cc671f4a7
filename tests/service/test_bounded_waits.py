"""No public call waits without a bound, and both Python clients have the same calls."""
import asyncio
import inspect
import os
import threading
import time
import types

import grpc
import pytest

import decks
import mbcosim
import mbcosim.aio
from conftest import MODELS, TIME_FACTOR, wait_for
from mbcosim.calls import ServerCalls, SimulationCalls, SnapshotCalls
from mbcosim.v1 import simulations_pb2 as pb
from relay import BlackHole
from test_coupling import PORT, spring

X, PENDULUM = "node.structural.1.X", os.path.join(MODELS, "pendulum.mbd")
SILENT = 25.0  # seconds after which a silent server must have been noticed

PAIRS = [(getattr(mbcosim, name), getattr(mbcosim.aio, name))
         for name in ("Server", "Simulation", "Snapshot", "Stepper", "Subscription", "Peer")]


def public(cls):
    return {name for name in dir(cls) if not name.startswith("_")}


# What the blocking client adds for work at a prompt.
PARTS = {"nodes", "elements", "joints", "inputs", "outputs"}
AT_A_PROMPT = {"Simulation": PARTS | {"what_if", "state_space", "modes"}}


@pytest.mark.parametrize("blocking, awaited", PAIRS, ids=lambda c: c.__module__)
def test_both_clients_have_the_same_public_names(blocking, awaited):
    assert public(blocking) - AT_A_PROMPT.get(blocking.__name__, set()) == public(awaited)


@pytest.mark.parametrize("module", [mbcosim, mbcosim.aio], ids=lambda m: m.__name__)
def test_every_call_takes_a_timeout(module):
    plain = {"Server": {"close"}, "Simulation": {"split", "pack", "result", "variables", "length_unit", "time_unit", *PARTS}, "Snapshot": set()}
    for name, exempt in plain.items():
        cls = getattr(module, name)
        for method in public(cls) - exempt:
            parameters = inspect.signature(getattr(cls, method)).parameters
            assert "timeout" in parameters or "options" in parameters, f"{name}.{method}"


CALLS = {
    "read": lambda s: s.read([X], timeout=0.3),
    "write": lambda s: s.write({"node.structural.1.load": [0, 0, 1, 0, 0, 0]}, timeout=0.3),
    "step": lambda s: s.step(timeout=0.3),
    "run_until": lambda s: s.run_until(1.0, timeout=0.3),
    "run with progress": lambda s: s.run_until(1.0, progress=print, timeout=0.3),
    "interrupt": lambda s: s.interrupt(timeout=0.3),
    "describe": lambda s: s.describe(timeout=0.3),
    "snapshot": lambda s: s.snapshot(timeout=0.3),
    "snapshots": lambda s: s.snapshots(timeout=0.3),
    "export_state": lambda s: s.export_state(timeout=0.3),
    "export_checkpoint": lambda s: s.export_checkpoint(timeout=0.3),
    "import_state": lambda s: s.import_state(b"x" * (3 << 20), timeout=0.3),
    "fork": lambda s: s.fork(timeout=0.3),
    "eigenvalues": lambda s: s.eigenvalues(timeout=0.3),
    "linearize": lambda s: s.linearize(timeout=0.3),
    "linearize_descriptor": lambda s: s.linearize_descriptor(timeout=0.3),
    "geometry": lambda s: s.geometry(timeout=0.3),
    "refresh": lambda s: s.refresh(timeout=0.3),
    "update": lambda s: s.update(name="x", timeout=0.3),
    "record": lambda s: s.record(timeout=0.3),
    "reset": lambda s: s.reset(timeout=0.3),
    "delete": lambda s: s.delete(timeout=0.3),
    "couple": lambda s: s.couple("spring", spring, timeout=0.3),
    "subscribe": lambda s: s.subscribe([X], timeout=0.3),
    "stepper": lambda s: s.stepper(["node.structural.1.V"], timeout=0.3),
    "handles": lambda s: s.handles(["node.structural.1.Omega"], timeout=0.3),
    "simulate": lambda s: s.simulate([X], until=1.0, timeout=0.3),
    "restore": lambda s: s.restore(types.SimpleNamespace(name=f"{s.name}/snapshots/1"), timeout=0.3),
    "result_files": lambda s: s.result_files(timeout=0.3),
    "result_file": lambda s: s.result_file("results.mov", timeout=0.3),
}
SERVER_CALLS = {
    "info": lambda s: s.info(timeout=0.3),
    "load": lambda s: s.load(PENDULUM, timeout=0.3),
    "load_text": lambda s: s.load_text(decks.body(), timeout=0.3),
    "load_bundle": lambda s: s.load_bundle("deck", {"deck": b"x"}, timeout=0.3),
    "load_from_root": lambda s: s.load_from_root("deck", timeout=0.3),
    "validate": lambda s: s.validate(PENDULUM, timeout=0.3),
    "reduce": lambda s: s.reduce(PENDULUM, timeout=0.3),
    "events": lambda s: s.events(timeout=0.3),
    "list": lambda s: s.list(timeout=0.3),
    "attach": lambda s: s.attach("simulations/x", timeout=0.3),
    "import_checkpoint": lambda s: s.import_checkpoint(b"x" * (3 << 20), timeout=0.3),
}


SNAPSHOT_CALLS = {
    "restore": lambda s: s.restore(timeout=0.3),
    "export": lambda s: s.export(timeout=0.3),
    "delete": lambda s: s.delete(timeout=0.3),
}


def test_the_tables_have_every_call():
    def calls(kind):
        return {name for name, function in inspect.getmembers(kind) if getattr(function, "is_call", False)}

    assert calls(SimulationCalls) | {"stepper", "subscribe", "couple", "simulate"} == set(CALLS) - {"run with progress"}
    assert calls(ServerCalls) | {"events"} == set(SERVER_CALLS)
    assert calls(SnapshotCalls) == set(SNAPSHOT_CALLS)


def waits(server, simulation):
    """Calls of each way to wait: for one message, for a stream to its end, for one to be opened; `call(timeout)` by name."""
    return {
        "read": lambda seconds: simulation.read([X], timeout=seconds),
        "load_text": lambda seconds: server.load_text(decks.body(), timeout=seconds),
        "export_state": lambda seconds: simulation.export_state(timeout=seconds),
        "subscribe": lambda seconds: simulation.subscribe([X], timeout=seconds),
        "couple": lambda seconds: simulation.couple("spring", spring, timeout=seconds),
        "events": lambda seconds: server.events(timeout=seconds),
    }


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan"), float("inf"), 1e10])
@pytest.mark.parametrize("client", [mbcosim, mbcosim.aio], ids=lambda m: m.__name__)
def test_what_is_no_timeout_is_refused_by_its_name(daemon, client, seconds):
    async def result(of):
        return await of if inspect.isawaitable(of) else of

    async def main(server):
        simulation = await result(server.load_text(decks.body(), ports=PORT))
        stepper = await result(simulation.stepper())
        calls = {**waits(server, simulation), "stepper": lambda seconds: stepper.step(timeout=seconds)}
        for name, call in calls.items():
            with pytest.raises(mbcosim.Error, match="`timeout` must be a positive number of seconds") as caught:
                await result(call(seconds))
            assert (caught.value.reason, caught.value.field) == ("BAD_ARGUMENT", "timeout"), name
        await result(stepper.close())
        assert (await result(simulation.refresh())).step == 0
        await result(simulation.delete())

    async def awaited():
        async with mbcosim.aio.connect(daemon.address) as server:
            await main(server)

    if client is mbcosim.aio:
        asyncio.run(asyncio.wait_for(awaited(), 60 * TIME_FACTOR))
    else:
        with mbcosim.connect(daemon.address) as server:
            asyncio.run(main(server))


def threads():
    return {thread for thread in threading.enumerate() if thread.is_alive()}


def test_streams_that_are_left_open_leave_no_thread(daemon):
    """Neither in a connection that is closed nor when the server ends them."""
    before = threads()
    for ends in ("connection", "simulation"):
        server = daemon.connect()
        simulation = server.load_text(decks.body(), ports=PORT)
        peer, samples = simulation.couple("spring", spring), simulation.subscribe(["time"])
        for _ in range(5):
            simulation.step()
        stepper = simulation.stepper(["time"])
        assert stepper.step().step == 6 and peer.exchanges == 6 and next(iter(samples))[0] == 1
        if ends == "simulation":
            with daemon.connect() as other:
                other.attach(simulation.name).delete()
            wait_for(lambda: not peer._thread.is_alive())
        server.close()
    wait_for(lambda: threads() <= before)


def took(begin, bound, what="it"):
    seconds = time.monotonic() - begin
    assert seconds < bound, f"{what} took {seconds:.1f} s"


def test_a_timeout_ends_every_blocking_call(falls_silent):
    address, silence = falls_silent
    with mbcosim.connect(address) as server:
        simulation = server.load_text(decks.body(), ports=PORT)
        stepper = server.load_text(decks.body()).stepper()
        stepper.step()
        saved = simulation.snapshot()
        silence()
        calls = [(CALLS, simulation), (SERVER_CALLS, server), (SNAPSHOT_CALLS, saved), ({"stepper": lambda s: s.step(timeout=0.3)}, stepper)]
        for table, subject in calls:
            for name, call in table.items():
                begin = time.monotonic()
                with pytest.raises(mbcosim.Unavailable):
                    call(subject)
                took(begin, 1 + 2 * TIME_FACTOR, name)
        begin = time.monotonic()
        stepper.close()
        simulation.__exit__()
        took(begin, 4 + TIME_FACTOR)


def test_a_timeout_ends_every_awaited_call(falls_silent):
    address, silence = falls_silent

    async def main():
        async with mbcosim.aio.connect(address) as server:
            simulation = await server.load_text(decks.body(), ports=PORT)
            saved = await simulation.snapshot()
            stepper = await (await server.load_text(decks.body())).stepper()
            await stepper.step()
            silence()
            calls = [(CALLS, simulation), (SERVER_CALLS, server), (SNAPSHOT_CALLS, saved), ({"stepper": lambda s: s.step(timeout=0.3)}, stepper)]
            for table, subject in calls:
                for name, call in table.items():
                    begin = time.monotonic()
                    with pytest.raises(mbcosim.Unavailable):
                        await call(subject)
                    took(begin, 1 + 2 * TIME_FACTOR, name)
            begin = time.monotonic()
            await stepper.close()
            await simulation.__aexit__()
            took(begin, 4 + TIME_FACTOR)

    asyncio.run(main())


def test_a_silent_server_is_noticed_in_the_middle_of_a_step_without_a_timeout(falls_silent):
    address, silence = falls_silent
    with mbcosim.connect(address) as server:
        simulation = server.load_text(decks.endless())
        threading.Timer(1.0, silence).start()
        begin = time.monotonic()
        with pytest.raises(mbcosim.Unavailable):
            simulation.run_until(1e9)
        took(begin, 1 + SILENT + 2 * TIME_FACTOR)
        begin = time.monotonic()
        simulation.__exit__()
        took(begin, 2 + TIME_FACTOR)


def test_asyncio_notices_a_silent_server_in_a_step_without_a_timeout_and_in_a_loop_of_steps(falls_silent):
    address, silence = falls_silent

    async def main():
        async with mbcosim.aio.connect(address) as server:
            simulation, looping = await server.load_text(decks.endless()), await server.load_text(decks.endless())

            async def loop():
                while True:
                    await looping.step()

            asyncio.get_running_loop().call_later(1.0, silence)
            begin = time.monotonic()
            ended = await asyncio.gather(simulation.run_until(1e9), loop(), return_exceptions=True)
            assert all(isinstance(error, mbcosim.Unavailable) for error in ended), ended
            took(begin, 1 + SILENT + 2 * TIME_FACTOR)
            begin = time.monotonic()
            await simulation.__aexit__()
            took(begin, 2 + TIME_FACTOR)

    asyncio.run(main())


def test_an_awaited_peer_shows_signs_of_life_while_it_computes(daemon):
    silence = 0.6 * TIME_FACTOR

    async def main():
        async with mbcosim.aio.connect(daemon.address) as server:
            async with await server.load_text(decks.body(final_time="100.", spin="null"), ports=PORT) as simulation:
                async def slow(motion):
                    await asyncio.sleep(2.5 * silence)
                    return spring(motion)

                async with await simulation.couple("spring", slow, heartbeat_timeout=silence, server_timeout=2.5 * silence) as peer:
                    await simulation.step(1)
                    assert peer.error is None

    asyncio.run(asyncio.wait_for(main(), 60 * TIME_FACTOR))


def test_an_unknown_outcome_is_never_a_success(server):
    with server.load_text(decks.body()) as simulation:
        for outcome in (0, 17):
            reply = pb.StepReply(step=3, time=0.5)
            reply.outcome = outcome
            with pytest.raises(mbcosim.StepFailed) as caught:
                simulation.result(reply)
            assert caught.value.reason == {0: "UNSPECIFIED", 17: "UNKNOWN_17"}[outcome]


def test_a_lost_connection_is_made_again_within_reconnect(tmp_path, start_daemon):
    daemon = start_daemon()
    hole = BlackHole(str(tmp_path), daemon.address)
    with mbcosim.connect(hole.address) as server:
        assert server.info().identity
        hole.close()
        begin = time.monotonic()
        with pytest.raises(mbcosim.Unavailable) as caught:
            server.info()
        assert caught.value.code == grpc.StatusCode.UNAVAILABLE
        took(begin, 4 + TIME_FACTOR)
