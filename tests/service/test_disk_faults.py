"""A disk that fails in the middle of it: typed refusals, a simulation that has failed where that must be, and nothing lost."""
import errno
import os
import shutil
import subprocess
import threading

import grpc
import pytest

import mbcosim
from conftest import TIME_FACTOR, Daemon, wait_for
from mbcosim.v1 import simulations_pb2 as pb
from test_durable import bits, deck, folder, kill, on_disk, point_on_disk, start  # noqa: F401 (fixtures)
from test_journal import check_results_at, load_with_results, with_results
from test_operation import metrics


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    path, source = tmp_path_factory.mktemp("faults") / "disk_faults.so", os.path.join(os.path.dirname(__file__), "disk_faults.c")
    subprocess.run([shutil.which("cc") or shutil.which("gcc"), "-shared", "-fPIC", "-O1", source, "-o", path], check=True)
    return path


class Disk:
    """What fails is (call, errno, pattern of paths); in place of an error -N: it takes N seconds."""

    def __init__(self, path):
        self._path = path

    def fails(self, *faults):
        new = self._path.with_suffix(".new")
        new.write_text("".join(f"{call} {code} {pattern}\n" for call, code, pattern in faults))
        os.replace(new, self._path)

    def heals(self):
        self._path.unlink()


@pytest.fixture
def disk(library, tmp_path, monkeypatch):
    """That of the daemons that are started from now on."""
    monkeypatch.setenv("LD_PRELOAD", str(library))
    monkeypatch.setenv("MBCOSIM_DISK_FAULTS", str(tmp_path / "faults"))
    monkeypatch.setenv("ASAN_OPTIONS", os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0")
    return Disk(tmp_path / "faults")


def seen(simulation):
    return bits(simulation), simulation.refresh(), [(s.name, s.display_name, s.step) for s in simulation.snapshots()]


def refused(act, what):
    with pytest.raises(mbcosim.LimitExceeded) as caught:
        act()
    assert caught.value.reason == "STORAGE_FULL" and what in str(caught.value)
    return str(caught.value)


def check_bytes(daemon, folder):
    """Those that are counted are those that are there, when no checkpoint is under way."""
    def there():
        try:
            return sum(path.stat().st_size for path in (folder / "simulations").rglob("*") if path.is_file())
        except FileNotFoundError:  # between the name and the size
            return -1

    wait_for(lambda: metrics(daemon)["mbcosim_state_bytes"] == there())


def stored(folder, simulation):
    point = point_on_disk(folder, simulation.name)
    return point.info.display_name, point.info.step, len(point.snapshots)


def test_what_has_no_safe_entry_in_its_folder_is_refused_and_set_right(start, folder, disk):
    """The files are written and have their names; that these are on the disk cannot be told."""
    options = ("--checkpoint-interval", "3600", "--http", "127.0.0.1:0")
    daemon = start(*options)
    with daemon.connect() as server:
        simulation = server.load_text(deck(), durability="journal", name="first")
        simulation.step(5)
        saved = simulation.snapshot("five")
        simulation.step(2)
        before = seen(simulation)
        disk.fails(("fsync", errno.EIO, folder / simulation.name))
        for act in (saved.restore, simulation.step, simulation.reset, lambda: simulation.snapshot("more"), lambda: simulation.update(name="second"),
                    lambda: simulation.write({"node.structural.1.load": [1, 0, 0, 0, 0, 0]}), saved.delete):
            refused(act, "does not get to the disk: Input/output error")
            assert seen(simulation) == before
        disk.heals()
        wait_for(lambda: stored(folder, simulation) == ("first", 7, 1))  # what was refused may have stood there
        check_bytes(daemon, folder)
        simulation.step()
        before = seen(simulation)
    kill(daemon)
    daemon = start(*options)
    with daemon.connect() as server:
        again = server.attach(simulation.name)
        assert seen(again) == before
        again.snapshots()[0].restore()
        again.update(name="second")
        check_bytes(daemon, folder)
    kill(daemon)
    with start(*options).connect() as server:
        again = server.attach(simulation.name)
        assert int(again.read(["step"])["step"]) == 5 and again.refresh().display_name == "second"


def test_a_call_that_outlasts_the_grace_is_done_once_and_its_client_comes_back(folder, tmp_path, disk):
    def begin():
        return Daemon(str(tmp_path), "--state-dir", str(folder), "--checkpoint-interval", "3600")

    daemon, steps = begin(), []
    try:
        with daemon.connect(reconnect=60 * TIME_FACTOR) as server:
            simulation = server.load_text(deck(), durability="journal")
            simulation.step()
            disk.fails(("fdatasync", -20, "*/journal-*"))
            stepping = threading.Thread(target=lambda: steps.append(simulation.step(3).step))
            stepping.start()
            wait_for(lambda: simulation.refresh().state == pb.SIMULATION_STATE_STEPPING)
            daemon.stop()
            disk.heals()
            daemon = begin()
            stepping.join(60 * TIME_FACTOR)
            assert steps == [4] and simulation.read(["step"])["step"] == 4
    finally:
        daemon.stop()


def test_a_checkpoint_that_is_not_safe_is_an_event_and_made_again(start, folder, disk):
    daemon = start("--checkpoint-interval", "0.05", "--http", "127.0.0.1:0")
    with daemon.connect() as server:
        simulation = server.load_text(deck())
        for fault in (("fsync", errno.EIO, folder / simulation.name), ("fsync", errno.EIO, "*/point.new"), ("rename", errno.EIO, "*/point.new"),
                      ("open", errno.EMFILE, "*/point.new")):
            with server.events(simulation.name) as events:
                disk.fails(fault)
                simulation.step(3)
                failed = next(event for event in events if event.WhichOneof("content") == "checkpoint_failed")
                assert os.strerror(fault[1]) in failed.checkpoint_failed.message
            disk.heals()
            wait_for(lambda: on_disk(folder, simulation.name) == simulation.refresh().step)
        check_bytes(daemon, folder)


@pytest.mark.parametrize("fault", [("fsync", errno.EIO, "*/simulations"), ("fsync", errno.EIO, "*/simulations/*"), ("fsync", errno.EIO, "*/unfinished.new"),
                                   ("rename", errno.EIO, "*.gone"), ("unlink", errno.EIO, "*/unfinished"), ("mkdir", errno.ENOSPC, "*")],
                         ids=lambda fault: " ".join(map(str, fault)))
def test_a_creation_that_is_not_safe_is_refused_and_leaves_nothing(start, folder, disk, fault):
    with start().connect() as server:
        disk.fails(fault)
        refused(lambda: server.load_text(deck()), os.strerror(fault[1]))
        assert server.list() == [] and os.listdir(folder / "simulations") == []
        disk.heals()
        assert server.load_text(deck()).step().step == 1


def test_a_disk_that_turns_read_only_refuses_by_name_and_loses_nothing(start, folder, disk):
    options = ("--checkpoint-interval", "0.05")
    daemon = start(*options)
    with daemon.connect() as server:
        journal, checkpoints, deleted = (server.load_text(deck(), durability=how) for how in ("journal", "checkpoint", "checkpoint"))
        for simulation in (journal, checkpoints):
            simulation.step(10)
        wait_for(lambda: on_disk(folder, checkpoints.name) == 10)
        before = seen(journal)
        with server.events(checkpoints.name) as events:
            disk.fails(*((call, errno.EROFS, f"{folder}*") for call in ("open", "write", "mkdir", "unlink", "rename", "ftruncate")))
            for act in (journal.step, journal.snapshot, lambda: server.load_text(deck())):
                refused(act, "Read-only file system")
            assert seen(journal) == before
            assert checkpoints.step(10).step == 20
            failed = next(event for event in events if event.WhichOneof("content") == "checkpoint_failed")
            assert "Read-only file system" in failed.checkpoint_failed.message
        deleted.delete()
        assert f"{deleted.name} is deleted, but its files cannot be removed" in daemon.log()
    kill(daemon)
    disk.heals()
    with start(*options).connect() as server:
        assert seen(server.attach(journal.name)) == before
        assert server.attach(checkpoints.name).read(["step"])["step"] == 10
        assert deleted.name in [info.name for info in server.list()]


def fail_by_a_restore(server, simulation, disk, tmp_path):
    """Its result files cannot be cut once the restored state is stored. Returns the snapshot."""
    simulation.step(5)
    saved = simulation.snapshot("five")
    simulation.step(7)
    with server.events(simulation.name) as events:
        disk.fails(("ftruncate", errno.EIO, "*/results.*"))
        assert str(tmp_path) not in refused(saved.restore, "Input/output error")
        event = next(event for event in events if event.WhichOneof("content") == "state_changed")
        assert event.state_changed.state == pb.SIMULATION_STATE_FAILED
    info = simulation.refresh()
    assert info.state == pb.SIMULATION_STATE_FAILED and "Input/output error" in info.last_failure and str(tmp_path) not in info.last_failure
    for act in (simulation.step, simulation.snapshot, lambda: simulation.read(["step"])):
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            act()
        assert caught.value.reason == "SIMULATION_FAILED"
    return saved


@pytest.mark.parametrize("durability", ["checkpoint", "journal"])
def test_a_simulation_that_has_failed_is_stored_with_what_callers_change(start, tmp_path, disk, durability):
    options = (*with_results(tmp_path), "--checkpoint-interval", "3600")
    daemon = start(*options)
    with daemon.connect() as server:
        simulation = load_with_results(server, durability)
        name, data = simulation.name, simulation.export_state()
        saved = fail_by_a_restore(server, simulation, disk, tmp_path)
        requests = {"ImportSnapshotInline": pb.ImportSnapshotInlineRequest(simulation=name, data=data, display_name="carried", request_id="a"),
                    "DeleteSnapshot": pb.DeleteSnapshotRequest(simulation=name, snapshot=saved.name, request_id="b"),
                    "UpdateSimulation": pb.UpdateSimulationRequest(simulation=name, display_name="renamed", request_id="c")}
        replies = {method: getattr(server.simulations, method)(request) for method, request in requests.items()}
    if durability == "journal":
        kill(daemon)
    else:
        daemon.stop()
    disk.heals()
    with start(*options).connect() as server:
        again = server.attach(name)
        assert (again.info.step, again.info.display_name) == (5, "renamed")
        assert {method: getattr(server.simulations, method)(request) for method, request in requests.items()} == replies
        assert [(s.display_name, s.step) for s in again.snapshots()] == [("carried", 0)]
        check_results_at(100, server, again)


@pytest.mark.parametrize("durability", ["checkpoint", "journal"])
def test_a_simulation_that_has_failed_is_restored_when_its_files_can_be_cut(start, tmp_path, disk, durability):
    with start(*with_results(tmp_path), "--checkpoint-interval", "3600").connect() as server:
        simulation = load_with_results(server, durability)
        saved = fail_by_a_restore(server, simulation, disk, tmp_path)
        disk.heals()
        saved.restore()
        assert simulation.refresh().state == pb.SIMULATION_STATE_READY
        check_results_at(100, server, simulation)


def test_steps_that_can_neither_be_stored_nor_taken_back_fail_the_simulation(start, tmp_path, disk):
    options = (*with_results(tmp_path), "--checkpoint-interval", "3600")
    daemon = start(*options)
    with daemon.connect() as server:
        simulation = load_with_results(server, "journal")
        simulation.step(5)
        with server.events(simulation.name) as events:
            disk.fails(("fdatasync", errno.EIO, "*/journal-*"), ("ftruncate", errno.EIO, "*/results.*"))
            with pytest.raises(grpc.RpcError, match="the journal does not get to the disk: Input/output error"):
                server.simulations.Step(pb.StepRequest(simulation=simulation.name, steps=7))  # once: it has failed then
            event = next(event for event in events if event.WhichOneof("content") == "state_changed")
            assert (event.state_changed.state, event.state_changed.step) == (pb.SIMULATION_STATE_FAILED, 5)
        info = simulation.refresh()
        assert (info.state, info.step) == (pb.SIMULATION_STATE_FAILED, 5), "what is not stored is not told"
        assert info.last_failure.startswith("steps that are not stored cannot be taken back: ") and str(tmp_path) not in info.last_failure
    kill(daemon)
    disk.heals()
    with start(*options).connect() as server:
        again = server.attach(simulation.name)
        assert again.read(["step"])["step"] == 5
        check_results_at(100, server, again)
