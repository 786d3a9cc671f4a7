"""Result files of the daemon: those of `mbcosim run`, whatever the simulation goes through; within a folder and a quota."""
import asyncio
import os
import resource
import subprocess
import threading
import time

import grpc
import pytest

import decks
import mbcosim
import mbcosim.aio
from conftest import BIN, MODELS, TIME_FACTOR, wait_for
from mbcosim.v1 import results_pb2, simulations_pb2 as pb

DECKS = ["pendulum.mbd", "tumbling.mbd"]


@pytest.fixture
def root(tmp_path):
    folder = tmp_path / "results"
    folder.mkdir()
    return folder


@pytest.fixture
def writer(start_daemon, root):
    """A daemon that writes results, and a connection to it."""
    with start_daemon("--results-root", str(root)).connect() as server:
        yield server


def command_line(deck, folder):
    """Bytes by name of the files of `mbcosim run`."""
    folder.mkdir()
    subprocess.run([os.path.join(BIN, "mbcosim"), "run", "-q", deck, "-o", folder / "results"], check=True, timeout=300)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def fetched(simulation):
    return {name: simulation.result_file(name) for name in simulation.result_files()}


def with_netcdf(tmp_path, final_time="0.3"):
    """A deck that asks for NetCDF as well, with an eigenanalysis in mid-run."""
    text = decks.body(final_time=final_time, step="1.e-2")
    text = text.replace("end: initial value;", "eigenanalysis: list, 2, 0., .15, parameter, .1, output eigenvectors; end: initial value;", 1)
    text = text.replace("end: control data;", "output results: netcdf; end: control data;", 1)
    path = tmp_path / "body.mbd"
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize("deck", DECKS)
def test_the_files_are_those_of_the_command_line(writer, tmp_path, deck):
    path = os.path.join(MODELS, deck)
    expected = command_line(path, tmp_path / "cli")
    with writer.load(path, results=True, summed_time=True) as simulation:
        simulation.run_until(1e9)
        found = fetched(simulation)
    assert found.keys() == expected.keys() and len(found) >= 3
    assert [name for name in found if found[name] != expected[name]] == []


def test_restores_and_failed_steps_leave_no_trace(writer, tmp_path):
    path = with_netcdf(tmp_path)
    expected = command_line(path, tmp_path / "cli")
    assert {"results.nc", "results_0.m", "results_1.m", "results.mov"} <= expected.keys()
    with writer.load(path, results=True, summed_time=True) as simulation:
        start = simulation.snapshot()
        simulation.step(10)
        tenth = simulation.snapshot()
        data = tenth.export()
        simulation.step(8)  # past the eigenanalysis
        tenth.restore()
        assert "results_1.m" not in simulation.result_files()
        simulation["node.structural.1.load"] = [float("1e300"), 0, 0, 0, 0, 0]
        with pytest.raises(mbcosim.StepFailed):
            simulation.step(5)
        tenth.restore()
        simulation.step(2)
        start.restore()
        simulation.step(3)
        simulation.import_state(data)  # a later step: the files do not lead to it
        start.restore()
        simulation.run_until(1e9)
        found = fetched(simulation)
    assert found.keys() == expected.keys()
    assert [name for name in found if found[name] != expected[name]] == []


def test_a_fork_writes_the_rest(writer, tmp_path, pendulum):
    expected = command_line(pendulum, tmp_path / "cli")
    with writer.load(pendulum, results=True, summed_time=True) as simulation:
        simulation.step(400)
        with simulation.fork(results=True) as branch, simulation.fork() as silent:
            branch.run_until(1e9)
            rest = fetched(branch)
            with pytest.raises(mbcosim.PreconditionFailed) as caught:
                silent.result_files()
            assert caught.value.reason == "NO_RESULTS"
        assert fetched(simulation)["results.mov"] == expected["results.mov"][:len(fetched(simulation)["results.mov"])]
    assert 0 < len(rest["results.mov"]) < len(expected["results.mov"])
    assert expected["results.mov"].endswith(rest["results.mov"])
    assert b"# Begins at step 400, time " in rest["results.out"]


def test_a_jump_ahead_is_told(writer, pendulum):
    with writer.load(pendulum, results=True) as simulation:
        simulation.step(5)
        fifth = simulation.snapshot()
        simulation.step(15)
        twentieth = simulation.snapshot()
        fifth.restore()
        simulation.step(30)  # another history of steps 6 to 35
        twentieth.restore()
        simulation.step(1)
        steps = [line.split()[1] for line in simulation.result_file("results.out").decode().splitlines() if line.startswith("Step ")]
        assert steps == ["0", "1", "2", "3", "4", "5", "21"]
        assert b"# Goes on after step 20: the steps between are not in these files\nStep 21 " in simulation.result_file("results.out")


def test_ranges(writer, pendulum):
    with writer.load(pendulum, results="text") as simulation:
        simulation.step(100)
        whole = simulation.result_file("results.mov")
        assert simulation.result_file("results.mov", offset=10, length=20) == whole[10:30]
        assert simulation.result_file("results.mov", offset=len(whole) - 5, length=2 ** 62) == whole[-5:]
        assert simulation.result_file("results.mov", offset=2 ** 62) == b""
        assert simulation.result_file("results.mov", length=0) == b""
        with pytest.raises(mbcosim.Error) as caught:
            simulation.result_file("results.mov", offset=-1)
        assert "`offset_bytes` must not be negative" in str(caught.value)


@pytest.mark.parametrize("name", ["", "results.xyz", "../results.mov", "steps.index", "/etc/passwd", "./results.mov", "results.mov\0"])
def test_nothing_but_its_result_files_can_be_read(writer, root, name):
    (root / "results.mov").write_text("of the operator")
    with writer.load_text(decks.body(), results=True) as simulation:
        with pytest.raises(mbcosim.NotFound) as caught:
            simulation.result_file(name)
        assert caught.value.reason == "NO_SUCH_FILE" and str(root) not in str(caught.value)


def test_a_quota_is_a_typed_failure_and_the_simulation_stands(writer, pendulum):
    with writer.load(pendulum, results="text", results_quota=60_000) as simulation:
        start = simulation.snapshot()
        with pytest.raises(mbcosim.StepFailed) as caught:
            simulation.step(100_000)
        assert caught.value.reason == "LIMIT_EXCEEDED" and caught.value.result.outcome == "LIMIT"
        assert "60000 bytes" in str(caught.value)
        steps = simulation.step_number
        assert steps > 50 and simulation.read(["step"])["step"] == steps
        reply = writer._connection.stubs.results.ListResults(results_pb2.ListResultsRequest(simulation=simulation.name))
        assert reply.step == steps and 50_000 < reply.used_bytes <= reply.quota_bytes == 60_000
        assert simulation.result_file("results.out").decode().splitlines()[-1].startswith(f"Step {steps} ")
        with pytest.raises(mbcosim.StepFailed):
            simulation.step()
        assert simulation.step_number == steps
        start.restore()
        assert simulation.step(10).outcome == "ACCEPTED"


def test_refusals_of_a_creation(writer, start_daemon, root, pendulum):
    for quota, message in [(0, "`results.quota_bytes` must be positive, got 0"), (2 ** 62, "larger than allowed")]:
        with pytest.raises(mbcosim.Error) as caught:
            writer.load(pendulum, results=True, results_quota=quota)
        assert message in str(caught.value)
    assert list(root.iterdir()) == []
    with writer.load(pendulum, results=True, results_quota=100) as simulation:  # not even the first record fits
        with pytest.raises(mbcosim.StepFailed) as caught:
            simulation.step()
        assert (caught.value.result.outcome, simulation.step_number) == ("LIMIT", 0)
    with start_daemon().connect() as other:
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            other.load(pendulum, results=True)
        assert caught.value.reason == "NO_RESULTS" and "--results-root" in str(caught.value)
    with start_daemon("--results-root", str(root), "--limit-results-bytes", "1000000", "--limit-results-root-bytes", "1500000").connect() as small:
        with small.load(pendulum, results=True):
            with pytest.raises(mbcosim.LimitExceeded) as caught:
                small.load(pendulum, results=True)
            assert caught.value.metadata["limit"] == "results_root_bytes"
        with small.load(pendulum, results=True):
            pass


def test_what_an_operator_removes_makes_room(start_daemon, root, pendulum):
    (root / "left").mkdir(parents=True, exist_ok=True)
    (root / "left" / "over").write_bytes(bytes(1_000_000))
    with start_daemon("--results-root", str(root), "--limit-results-bytes", "1000000", "--limit-results-root-bytes", "1500000").connect() as server:
        with pytest.raises(mbcosim.LimitExceeded) as caught:
            server.load(pendulum, results=True)
        assert caught.value.metadata["limit"] == "results_root_bytes"
        (root / "left" / "over").unlink()
        time.sleep(1.1)  # it is looked anew once in a second
        with server.load(pendulum, results=True):
            pass


def test_a_full_disk_is_a_typed_failure_and_the_simulation_stands(writer, root, pendulum):
    with writer.load(pendulum, results="text") as simulation:
        start = simulation.snapshot()
        simulation.step(10)
        (root / simulation.name.split("/")[1] / "results.mov").symlink_to("/dev/full")  # opened when there is something to write
        with pytest.raises(mbcosim.LimitExceeded) as listing:
            simulation.result_files()
        assert listing.value.reason == "STORAGE_FULL"
        with pytest.raises(mbcosim.StepFailed) as stepping:
            simulation.step(5)
        assert (stepping.value.reason, stepping.value.result.outcome, stepping.value.result.steps_done) == ("STORAGE_FULL", "NOT_WRITTEN", 0)
        for caught in (listing, stepping):
            assert 'cannot write "results.mov": No space left on device' in str(caught.value)
        assert simulation.read(["step"])["step"] == simulation.refresh().step == 10
        start.restore()  # what is left to write fits again
        assert simulation.step(5).step == 5


@pytest.mark.parametrize("formats", ["text", "netcdf"])
def test_what_a_full_disk_did_not_take_is_written_when_there_is_room(start_daemon, root, pendulum, formats):
    daemon = start_daemon("--results-root", str(root))
    with daemon.connect() as server, server.load(pendulum, results=formats, summed_time=True) as simulation, \
            server.load(pendulum, results=formats, summed_time=True) as other:
        simulation.step(20)
        size = max(simulation.result_files().values())
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (size + 3000, resource.RLIM_INFINITY))  # no file of the daemon grows beyond
        with pytest.raises(mbcosim.StepFailed) as caught:
            while True:
                simulation.step(7)
        assert caught.value.reason == "STORAGE_FULL"
        for _ in range(2):
            with pytest.raises(mbcosim.LimitExceeded):
                simulation.result_files()
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        steps = simulation.refresh().step
        assert set(simulation.result_files()) == set(other.result_files())
        simulation.step(20)
        other.step(steps + 20)
        for name in other.result_files():
            if not name.endswith((".log", ".out")):  # times of day
                assert simulation.result_file(name) == other.result_file(name), name


@pytest.mark.parametrize("formats", ["text", "netcdf"])
def test_of_results_that_exceed_the_quota_what_fits_can_be_read(writer, pendulum, formats):
    """An eigenanalysis at t = 0.5 s, the 100th step, writes many times what a step does."""
    with open(pendulum) as file:
        text = file.read().replace("end: initial value;", "eigenanalysis: 0.5, output matrices, output eigenvectors, use lapack; end: initial value;")
    with writer.load_text(text, results=formats, results_quota=110_000 if formats == "text" else 80_000) as simulation:
        begin = simulation.snapshot()
        with pytest.raises(mbcosim.StepFailed) as caught:
            simulation.step(1000)
        assert caught.value.reason == "LIMIT_EXCEEDED"
        files = simulation.result_files()
        assert all(len(simulation.result_file(name)) == size for name, size in files.items())
        reply = writer._connection.stubs.results.ListResults(results_pb2.ListResultsRequest(simulation=simulation.name))
        assert reply.step <= simulation.refresh().step and reply.used_bytes <= reply.quota_bytes
        begin.restore()
        assert simulation.step(10).step == 10


def test_delete_removes_and_the_end_of_a_lease_keeps(writer, root, pendulum):
    with writer.load(pendulum, results=True) as simulation:
        simulation.step(3)
        assert (root / simulation.name.split("/")[1] / "results.out").exists()
    assert list(root.iterdir()) == []
    kept = writer.load(pendulum, results=True, lease=0.5)
    kept.step(3)
    folder = root / kept.name.split("/")[1]
    wait_for(lambda: not [s for s in writer.list() if s.name == kept.name], 20)
    wait_for(lambda: "\nStep 3 " in (folder / "results.out").read_text())  # what lay in buffers follows when the last holder has gone


def test_many_simulations_write_netcdf_at_once(writer, tmp_path):
    path = with_netcdf(tmp_path)
    expected = command_line(path, tmp_path / "cli")
    found = {}

    def work(k):
        with writer.load(path, results=["text", "netcdf"], summed_time=True) as simulation:
            for _ in range(30):
                simulation.step()
                if k % 2:
                    simulation.result_files()
            found[k] = fetched(simulation)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120)
    assert [k for k in range(6) if found[k] != expected] == []


# ------------------------------------------------------------------ simulate

X, XP = "node.structural.2.X", "node.structural.1.XP"


def test_simulate_returns_what_steps_give(server, pendulum):
    with server.load(pendulum) as simulation, server.load(pendulum) as other:
        table = simulation.simulate([X, "time"], until=0.05).to_numpy()
        assert table.dtype.names == ("step", "time", X) and table[X].shape == (len(table), 3)
        assert table.dtype.metadata["units"] == {"step": "", "time": "deck unit of time", X: "deck unit of length"}
        assert list(table["step"]) == list(range(simulation.step_number + 1)) and len(table) > 5
        for row in table[1:]:
            values = other.step(outputs=[X]).values
            assert row[X].tobytes() == values[X].tobytes() and row["time"] == other.time
        assert other.step_number == simulation.step_number


def test_simulate_thins_out_and_goes_on(server, pendulum):
    with server.load(pendulum) as simulation:
        assert list(simulation.simulate([X], steps=25, every=10).steps) == [0, 10, 20, 25]
        assert list(simulation.simulate([], steps=20, every=7).steps) == [25, 32, 39, 45]
        assert list(simulation.simulate([X], steps=0).steps) == [45]


def test_simulate_takes_functions_as_inputs_step_by_step(server):
    load = "node.structural.1.load"
    with server.load_text(decks.body()) as simulation, server.load_text(decks.body()) as other:
        numbers = simulation.simulate([XP], steps=20, inputs={load: [1.0, 0, 0, 0, 0, 0]})
        functions = other.simulate([XP], steps=20, inputs={load: lambda t: [1.0, 0, 0, 0, 0, 0]})
        assert numbers[XP].tobytes() == functions[XP].tobytes() and numbers[XP][-1, 0] > 0
        assert list(functions.steps) == list(numbers.steps)


def test_simulate_gives_the_rows_before_a_failure(server):
    with server.load_text(decks.body(final_time="100.")) as simulation:
        simulation.step(2)
        with pytest.raises(mbcosim.StepFailed) as caught:
            simulation.simulate([XP], until=1.0, inputs={"node.structural.1.load": [float("1e300"), 0, 0, 0, 0, 0]})
        assert list(caught.value.history.steps) == [2]


def test_the_asyncio_client_simulates_alike(daemon, server, pendulum):
    async def main():
        async with mbcosim.aio.connect(daemon.address) as connection, await connection.load(pendulum) as simulation:
            return await simulation.simulate([X], until=0.05)

    history = asyncio.run(asyncio.wait_for(main(), 60))
    with server.load(pendulum) as simulation:
        assert simulation.simulate([X], until=0.05)[X].tobytes() == history[X].tobytes()


def test_a_table_is_refused_by_field(server, pendulum):
    with server.load(pendulum) as simulation:
        for table, reason in [(pb.TableRequest(every=0), "`table.every` must be at least 1, got 0"),
                              (pb.TableRequest(every=-1), "`table.every` must be at least 1, got -1"),
                              (pb.TableRequest(handles=[10 ** 6]), "1000000")]:
            with pytest.raises(grpc.RpcError) as caught:
                list(server.simulations.Run(pb.RunRequest(step=pb.StepRequest(simulation=simulation.name, steps=5), table=table)))
            assert reason in caught.value.details()
        assert simulation.refresh().step == 0


def test_a_reader_that_stops_does_not_hold_others(server, tumbling):
    with server.load_text(decks.body(final_time="1000.")) as simulation, server.load(tumbling) as other:
        handles = simulation.handles(["node.structural.1.X"]) * 200
        stream = server.simulations.Run(pb.RunRequest(step=pb.StepRequest(simulation=simulation.name, steps=500_000),
                                                      table=pb.TableRequest(handles=handles)))
        next(stream)
        assert other.step(100).steps_done == 100
        assert simulation.read(["step"])["step"] >= 0  # between the steps, while rows wait
        stream.cancel()
        wait_for(lambda: simulation.refresh().state == pb.SIMULATION_STATE_READY)
        assert 0 < simulation.step_number < 500_000


def test_a_table_comes_at_a_million_values_a_second(server):
    with server.load_text(decks.body(final_time="1000.")) as simulation:
        names = [name for name in simulation.variables if name.startswith("node.structural.1.")]
        begin = time.perf_counter()
        history = simulation.simulate(names, steps=20_000)
        seconds = time.perf_counter() - begin
        values = sum(history[name].size for name in names)
        assert values > 700_000 and values / seconds > 1e6 / TIME_FACTOR
