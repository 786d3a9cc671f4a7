"""Simulations that outlive the daemon: bit for bit from their last checkpoint, whatever happens in between."""
import contextlib
import os
import random
import shutil
import signal
import socket
import struct
import subprocess
import threading
import time

import grpc
import pytest

import decks
import http2
import mbcosim
from conftest import BIN, TIME_FACTOR, Daemon, wait_for
from mbcosim.v1 import events_pb2, events_pb2_grpc, simulations_pb2 as pb, simulations_pb2_grpc, telemetry_pb2, telemetry_pb2_grpc
from test_operation import metrics

KILLS = int(os.environ.get("MBCOSIM_KILLS", "6"))  # 1000 for the long form
X, R = "node.structural.1.X", "node.structural.1.R"
LOAD = "node.structural.1.load"


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "state"
    path.mkdir()
    return path


@pytest.fixture
def start(start_daemon, folder):
    """Function that starts a daemon on the folder."""
    return lambda *options: start_daemon("--state-dir", str(folder), *options)


def kill(daemon):
    """Ends it as a power failure would."""
    daemon.process.send_signal(signal.SIGKILL)
    daemon.process.wait(30)
    daemon.stop = lambda: None  # it cannot end well any more


def deck(steps=4000):
    return decks.body(final_time=str(steps * 1e-3))


def bits(simulation):
    values = simulation.read([X, R, "time"])
    return values[X].tobytes(), values[R].tobytes(), values["time"]


def at_the_end(server, text):
    """Bits of the uninterrupted run."""
    with server.load_text(text, durability="none") as simulation:
        simulation.run_until(1e9)
        return bits(simulation)


def state_of(server, name):
    return next(info.state for info in server.list() if info.name == name)


def test_goes_on_after_an_orderly_end(start):
    daemon = start()
    with daemon.connect() as server:
        expected = at_the_end(server, deck())
        simulation = server.load_text(deck(), name="body", policy="cut_step", minimum_step=1e-5)
        simulation.step(100)
        saved = simulation.snapshot("here")
        simulation.step(900)
        last = simulation.info.name
    daemon.stop()
    resumed = start()
    with resumed.connect() as server:
        assert state_of(server, last) == pb.SIMULATION_STATE_SUSPENDED
        again = server.attach(last)
        assert (again.info.display_name, again.info.step, again.info.minimum_step_size) == ("body", 1000, 1e-5)
        assert state_of(server, last) == pb.SIMULATION_STATE_SUSPENDED  # asking does not wake it
        assert again.read(["step"])["step"] == 1000
        assert state_of(server, last) == pb.SIMULATION_STATE_READY
        assert "began with" not in resumed.log()  # the same build
        assert [(s.name, s.display_name, s.step) for s in again.snapshots()] == [(saved.name, "here", 100)]
        again.run_until(1e9)
        assert bits(again) == expected
        again.snapshots()[0].restore()
        assert again.snapshot().name.endswith("/snapshots/2")
        again.run_until(1e9)
        assert bits(again) == expected


def test_kills_at_random_moments_lose_nothing_of_a_checkpoint(start, folder, tmp_path):
    """The short form; MBCOSIM_KILLS=1000 for the long one."""
    rolls, text, root = random.Random(19), deck(200_000), tmp_path / "results"
    root.mkdir()
    options = ("--results-root", str(root), "--checkpoint-interval", "0.02")
    daemon = start(*options)
    with daemon.connect() as server:
        name = server.load_text(text, results="text", summed_time=True).name
    reached = 0
    for _ in range(KILLS):
        with daemon.connect() as server:
            simulation = server.attach(name)
            step = int(simulation.read(["step"])["step"])
            assert step >= reached, "a checkpoint is lost"
            stream = server.simulations.Run(pb.RunRequest(step=pb.StepRequest(simulation=name, until_time=1e9)))
            time.sleep(rolls.uniform(0, 0.3))
            reached = on_disk(folder, name)
            kill(daemon)
            stream.cancel()
        daemon = start(*options)
    with daemon.connect() as server:
        simulation = server.attach(name)
        stopped = int(simulation.read(["step"])["step"])
        assert stopped >= reached > 0
        simulation.step(50)
        found = bits(simulation), {n: simulation.result_file(n) for n in simulation.result_files()}
        with server.load_text(text, results="text", summed_time=True, durability="none") as straight:
            straight.step(stopped + 50)
            assert bits(straight) == found[0]
            files = {n: straight.result_file(n) for n in straight.result_files()}
        assert files.keys() == found[1].keys() and [n for n in files if files[n] != found[1][n]] == []


def on_disk(folder, name):
    """Number of the step of the last checkpoint, read without the daemon."""
    return point_on_disk(folder, name).info.step


def point_on_disk(folder, name):
    from mbcosim.v1 import checkpoints_pb2
    data = (folder / name / "point").read_bytes()
    at = 0
    while at < len(data):
        kind, length = int.from_bytes(data[at:at + 4], "little"), int.from_bytes(data[at + 4:at + 12], "little")
        if kind == 5:
            return checkpoints_pb2.CheckpointPoint.FromString(data[at + 16:at + 16 + length])
        at += 16 + length
    raise AssertionError("the file has no point")


@pytest.mark.parametrize("durability", ["checkpoint", "journal"])
def test_an_orderly_restart_is_a_pause_to_who_reconnects(folder, tmp_path, durability):
    """The call that it interrupts goes on where it was."""
    def begin():
        return Daemon(str(tmp_path), "--state-dir", str(folder), "--checkpoint-interval", "3600")

    steps, results = 200_000, []
    daemon = begin()
    try:
        with daemon.connect(reconnect=60 * TIME_FACTOR) as server:
            simulation = server.load_text(decks.endless(), durability=durability)
            stepping = threading.Thread(target=lambda: results.append(simulation.step(steps)))
            stepping.start()
            for _ in range(2):
                before = simulation.refresh().step
                wait_for(lambda: simulation.refresh().step > before or results, 30)
                daemon.stop()
                daemon = begin()
                simulation.read(["step"])  # others come back, too
            stepping.join(120 * TIME_FACTOR)
            (result,) = results
            assert (result.outcome, result.steps_done, result.step) == ("ACCEPTED", steps, steps)
            with server.load_text(decks.endless(), durability="none") as straight:
                straight.step(steps)
                assert bits(straight) == bits(simulation)
    finally:
        daemon.stop()


def test_who_is_connected_when_the_daemon_ends_is_told_to_come_again(start):
    silent, reasons = threading.Event(), {}
    daemon = start()
    with daemon.connect() as server, grpc.insecure_channel(daemon.address) as channel:
        simulation = server.load_text(deck(), ports=[mbcosim.structural_port("spring", nodes=[1])])
        peer = simulation.couple("spring", lambda motion: silent.wait(30 * TIME_FACTOR), mode="tight", peer_timeout=60 * TIME_FACTOR)
        simulations = simulations_pb2_grpc.SimulationsStub(channel)
        calls = {"step": simulations.Step.future(pb.StepRequest(simulation=simulation.name, request_id="step")),
                 "events": events_pb2_grpc.EventsStub(channel).WatchEvents(events_pb2.WatchEventsRequest()),
                 "samples": telemetry_pb2_grpc.TelemetryStub(channel).Subscribe(telemetry_pb2.SubscribeRequest(simulation=simulation.name, handles=[0]))}
        wait_for(lambda: "port spring since" in simulation.refresh().waiting_for)
        daemon.stop()
        silent.set()
        for name, call in calls.items():
            with contextlib.suppress(grpc.RpcError):  # what has come before
                call.exception() if name == "step" else list(call)
            details = dict(call.trailing_metadata()).get("grpc-status-details-bin", b"")
            reasons[name] = call.code(), b"google.rpc.RetryInfo" in details, mbcosim.errors.from_rpc_error(call).reason
        assert reasons == {name: (grpc.StatusCode.UNAVAILABLE, True, "SHUTTING_DOWN") for name in calls}
        wait_for(lambda: peer.error is not None)
        assert peer.error.reason == "SHUTTING_DOWN"


def test_the_last_replies_are_kept_for_who_asks_again(start):
    daemon = start()
    with daemon.connect() as server:
        name = server.load_text(deck()).name
        requests = {"Step": pb.StepRequest(simulation=name, steps=7, request_id="a", outputs=[0]),
                    "CreateSnapshot": pb.CreateSnapshotRequest(simulation=name, request_id="b"),
                    "UpdateSimulation": pb.UpdateSimulationRequest(simulation=name, request_id="c", display_name="renamed")}
        first = {method: getattr(server.simulations, method)(request) for method, request in requests.items()}
    daemon.stop()
    with start().connect() as server:
        for method, request in requests.items():
            assert getattr(server.simulations, method)(request) == first[method]
        with pytest.raises(grpc.RpcError, match="another request"):
            server.simulations.Step(pb.StepRequest(simulation=name, steps=8, request_id="a"))
        simulation = server.attach(name)
        assert simulation.info.step == 7 and len(simulation.snapshots()) == 1


def test_one_on_the_disk_is_deleted_once(start):
    daemon = start()
    with daemon.connect() as server:
        name = server.load_text(deck()).name
    daemon.stop()
    with start().connect() as server:
        for _ in range(2):
            server.simulations.DeleteSimulation(pb.DeleteSimulationRequest(simulation=name, request_id="end"))
        assert server.list() == []
        with pytest.raises(mbcosim.NotFound):
            server.attach(name).delete()


def end(name):
    return pb.DeleteSimulationRequest(simulation=name, request_id="end")


@pytest.mark.parametrize("how", ["alive", "suspended"])
@pytest.mark.parametrize("durability", ["checkpoint", "journal"])
def test_a_deletion_is_done_once_across_restarts(start, folder, how, durability):
    daemon = start()
    with daemon.connect() as server:
        name, other = (server.load_text(deck(), durability=durability).name for _ in range(2))
        fleeting = server.load_text(deck(), durability="none").name
        if how == "alive":
            server.simulations.DeleteSimulation(end(name))
        server.simulations.DeleteSimulation(pb.DeleteSimulationRequest(simulation=fleeting, request_id="fleeting"))
    kill(daemon)
    if how == "suspended":
        daemon = start()
        with daemon.connect() as server:
            server.simulations.DeleteSimulation(end(name))
        kill(daemon)
    for _ in range(2):  # what was known at the start is kept for the next
        daemon = start()
        with daemon.connect() as server:
            assert server.simulations.DeleteSimulation(end(name)) == pb.DeleteSimulationReply()
            with pytest.raises(grpc.RpcError, match="another request"):
                server.simulations.DeleteSimulation(end(other))
            with pytest.raises(grpc.RpcError, match="no simulation is named"):
                server.simulations.DeleteSimulation(pb.DeleteSimulationRequest(simulation=fleeting, request_id="fleeting"))
            assert [info.name for info in server.list()] == [other]
        kill(daemon)


def test_the_list_is_in_the_order_of_creation_wherever_they_are(start):
    daemon = start()
    with daemon.connect() as server:
        names = [server.load_text(decks.body()).name for _ in range(6)]
    daemon.stop()
    with start().connect() as server:
        for name in (names[4], names[1]):  # these are brought back, the others stay on the disk
            server.attach(name).step(1)
        names.append(server.load_text(decks.body()).name)
        found = server.list()
        assert [info.name for info in found] == names
        times = [info.create_time.ToNanoseconds() for info in found]
        assert times == sorted(set(times)) and abs(times[-1] * 1e-9 - time.time()) < 100
        copy = server.import_checkpoint(server.attach(names[0]).export_checkpoint())
        assert [info.name for info in server.list()] == [*names, copy.name], "a copy is younger than its original"
        request, seen = pb.ListSimulationsRequest(page_size=2), []
        while not seen or request.page_token:
            page = server.simulations.ListSimulations(request)
            seen += [info.name for info in page.simulations]
            request.page_token = page.next_page_token
            if len(seen) == 2:  # the first of the next page goes, and one of this
                for name in names[1:3]:
                    server.simulations.DeleteSimulation(pb.DeleteSimulationRequest(simulation=name))
        assert seen == [*names[:2], *names[3:], copy.name]


def test_a_deletion_that_a_kill_stopped_is_done_by_its_repeat(start, folder, tmp_path):
    daemon = start()
    with daemon.connect() as server:
        name = server.load_text(deck()).name
        shutil.copytree(folder / name, tmp_path / "copy")
        server.simulations.DeleteSimulation(end(name))
    kill(daemon)
    shutil.copytree(tmp_path / "copy", folder / name)  # as it is when the deletion is noted and nothing is removed
    with start().connect() as server:
        assert state_of(server, name) == pb.SIMULATION_STATE_SUSPENDED
        for _ in range(2):
            server.simulations.DeleteSimulation(end(name))
        assert server.list() == [] and not (folder / name).exists()


def test_damaged_notes_of_deletions_are_named_and_put_aside(start, folder):
    daemon = start()
    with daemon.connect() as server:
        name = server.load_text(deck()).name
        server.simulations.DeleteSimulation(end(name))
        good = server.load_text(deck()).name
    kill(daemon)
    damage(folder / "removals")
    daemon = start()
    with daemon.connect() as server:
        assert [info.name for info in server.list()] == [good]
        server.simulations.DeleteSimulation(end(good))
    line, = [line for line in daemon.log().splitlines() if "put aside" in line]
    assert "state folder: removals: record 2 at byte " in line and (folder / "removals.damaged").exists()


def test_a_creation_is_done_once_across_restarts(start):
    def create(server):
        header = pb.UploadHeader(bundle_main_file="deck", options=pb.CreateOptions(request_id="same"))
        from mbcosim import bundle
        return server.simulations.CreateSimulation(bundle.requests(header, {"deck": deck().encode()})).simulation.name

    daemon = start()
    with daemon.connect() as server:
        name = create(server)
    kill(daemon)
    with start().connect() as server:
        assert create(server) == name and len(server.list()) == 1


def test_what_a_repeat_was_given_stays_when_the_first_reply_is_lost(start):
    """The first client opens no window, so that its replies stay with the server until its connection ends."""
    requests = [pb.InlineUpload(header=pb.UploadHeader(bundle_main_file="deck", options=pb.CreateOptions(request_id=request_id)),
                                files=[{"path": "deck", "data": deck().encode()}]) for request_id in ("alone", "repeated")]
    daemon = start()
    with daemon.connect() as server, socket.socket(socket.AF_UNIX) as first:
        first.connect(daemon.address[len("unix:"):])
        first.sendall(http2.PREFACE + http2.frame(http2.SETTINGS, 0, 0, struct.pack(">HI", 4, 0)))  # the first window of a stream
        for stream, request in zip((1, 3), requests):
            data = request.SerializeToString()
            first.sendall(http2.frame(http2.HEADERS, 4, stream, http2.headers_of("/mbcosim.v1.Simulations/CreateSimulationInline"))
                          + http2.frame(http2.DATA, 1, stream, b"\0" + struct.pack(">I", len(data)) + data))
        wait_for(lambda: len(server.list()) == 2)
        name = server.simulations.CreateSimulationInline(requests[1]).simulation.name
        assert name in [info.name for info in server.list()] and len(server.list()) == 2
        first.close()
        wait_for(lambda: [info.name for info in server.list()] == [name])  # nobody would delete the other
        time.sleep(0.5)
        assert server.attach(name).step(3).step == 3


def test_the_end_of_a_lease_suspends(start):
    with start().connect() as server, server.events() as watcher:
        simulation = server.load_text(deck(), lease=0.5)
        simulation.step(10)
        wait_for(lambda: state_of(server, simulation.name) == pb.SIMULATION_STATE_SUSPENDED, 20)
        assert simulation.step(5).step == 15
        changes = []
        for event in watcher:
            if event.WhichOneof("content") == "state_changed":
                changes.append(event.state_changed.state)
            if len(changes) == 2:
                break
        assert changes == [pb.SIMULATION_STATE_SUSPENDED, pb.SIMULATION_STATE_READY]


def test_a_stream_of_many_brings_back_the_one_it_names(start):
    with start().connect() as server:
        resting, lively = server.load_text(deck(), lease=0.5), server.load_text(deck())
        with lively.stepper() as stepper, resting.stepper(beside=stepper) as other:
            for step in range(1, 11):
                assert (stepper.step().step, other.step().step) == (step, step)
            stepper.step()
            wait_for(lambda: state_of(server, resting.name) == pb.SIMULATION_STATE_SUSPENDED, 20)
            assert (other.step().step, stepper.step().step) == (11, 12)


def test_many_callers_wake_one_simulation_once(start):
    daemon = start()
    with daemon.connect() as server:
        name = server.load_text(deck()).name
    daemon.stop()
    with start().connect() as server:
        steps = []

        def look():
            steps.append(server.attach(name).read(["step"])["step"])

        threads = [threading.Thread(target=look) for _ in range(16)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
        assert steps == [0.0] * 16 and len(server.list()) == 1


def said(daemon, text):
    """Waits for a line of the log that holds the text."""
    wait_for(lambda: text in daemon.log(), 30)


def damage(file):
    data = bytearray(file.read_bytes())
    data[-40] ^= 1
    file.write_bytes(data)


def test_all_come_back_at_the_start_when_the_operator_wants(start, folder):
    daemon = start()
    with daemon.connect() as server:
        expected = at_the_end(server, deck(400))
        names = []
        for step in (0, 10, 200, 399):
            simulation = server.load_text(deck(400))
            simulation.step(step) if step else simulation.snapshot()
            names.append(simulation.name)
    daemon.stop()
    damage(folder / names[0] / "snapshot-1")
    daemon = start("--resume", "eager")
    said(daemon, "state folder: 3 simulations are back, 1 stay suspended")
    assert f"{names[0]} stays suspended: DAMAGED_STATE: " in daemon.log()
    with daemon.connect() as server:
        assert [state_of(server, name) for name in names] == [pb.SIMULATION_STATE_SUSPENDED] + 3 * [pb.SIMULATION_STATE_READY]
        for name in names[1:]:
            simulation = server.attach(name)
            simulation.run_until(1e9)
            assert bits(simulation) == expected


def test_those_used_last_come_back_when_there_is_no_room_for_all(start, folder):
    daemon = start()
    with daemon.connect() as server:
        names = [server.load_text(deck()).name for _ in range(4)]
    daemon.stop()
    for age, name in zip((300, 0, 200, 100), names):
        os.utime(folder / name / "point", (time.time() - age,) * 2)
    daemon = start("--resume", "eager", "--limit-sessions", "2")
    said(daemon, "state folder: 2 simulations are back, 2 stay suspended")
    assert f"{names[2]} stays suspended: LIMIT_EXCEEDED: " in daemon.log()
    with daemon.connect() as server:
        assert [name for name in names if state_of(server, name) == pb.SIMULATION_STATE_READY] == [names[1], names[3]]
        with pytest.raises(mbcosim.LimitExceeded):
            server.attach(names[0]).step()
        server.attach(names[1]).delete()
        assert server.attach(names[0]).step().step == 1  # with the first call, where there is room


def test_nothing_comes_back_without_a_folder(tmp_path):
    done = subprocess.run([os.path.join(BIN, "mbcosimd"), "--listen", f"unix:{tmp_path}/socket", "--resume", "eager"],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60 * TIME_FACTOR)
    assert done.returncode == 4 and done.stdout.splitlines()[-1] == "mbcosimd: error: --resume eager needs --state-dir"


def slow_deck():
    """Takes a while to read: a million statements."""
    sums = "".join(f"set: x = x*.5 + sin({k}*i); " for k in range(5))
    return deck().replace("begin: nodes;", f"set: real x = 0.;\nfor: integer i = 1, 200000; {sums} end for;\nbegin: nodes;", 1)


def test_a_call_that_is_cancelled_brings_nothing_back(start):
    daemon = start()
    with daemon.connect() as server:
        begin = time.monotonic()
        name = server.load_text(slow_deck()).name
        took = time.monotonic() - begin
    daemon.stop()
    daemon = start()
    with daemon.connect() as server:
        while "ReadVariables refused to local: CANCELLED: the call was cancelled" not in daemon.log():
            with pytest.raises(grpc.RpcError) as caught:  # others' work is not waited for either
                server.simulations.ReadVariables(pb.ReadVariablesRequest(simulation=name), timeout=took / 10)
            assert caught.value.code() == grpc.StatusCode.DEADLINE_EXCEEDED
        assert state_of(server, name) == pb.SIMULATION_STATE_SUSPENDED
        assert server.simulations.ReadVariables(pb.ReadVariablesRequest(simulation=name)).step == 0
    daemon.stop()
    assert daemon.log().count(f"{name} is READY") == 1


def test_the_end_of_the_daemon_does_not_wait_for_all_to_come_back(start):
    daemon = start()
    with daemon.connect() as server:
        names = [server.load_text(slow_deck()).name for _ in range(3)]
    daemon.stop()
    daemon = start("--resume", "eager")
    daemon.stop()
    assert daemon.log().count("is READY") < 3 and "stays suspended" not in daemon.log()
    with start().connect() as server:
        assert [state_of(server, name) for name in names] == 3 * [pb.SIMULATION_STATE_SUSPENDED]


def test_deleted_ones_are_gone(start, folder):
    daemon = start()
    with daemon.connect() as server:
        with server.load_text(deck()) as first:
            assert (folder / first.name / "point").exists()
        assert not (folder / first.name).exists()
        name = server.load_text(deck()).name
    daemon.stop()
    with start().connect() as server:
        server.attach(name).delete()
        assert server.list() == [] and not (folder / name).exists()
        with pytest.raises(mbcosim.NotFound):
            server.attach(name)


def seconds_of_work(daemon):
    """Processor time of the daemon so far."""
    with open(f"/proc/{daemon.process.pid}/stat") as file:
        ticks = file.read().rsplit(")", 1)[1].split()[11:13]
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def test_deletions_that_wait_for_one_that_comes_back_stop_no_quick_call(start, folder):
    """There are fewer threads for quick calls than such deletions here."""
    daemon = start()
    with daemon.connect() as server:
        name = server.load_text(slow_deck()).name
    daemon.stop()
    daemon = start()
    with daemon.connect() as server:
        before = seconds_of_work(daemon)
        waking = server.simulations.ReadVariables.future(pb.ReadVariablesRequest(simulation=name))
        wait_for(lambda: seconds_of_work(daemon) > before + 0.05)
        deletions = [server.simulations.DeleteSimulation.future(pb.DeleteSimulationRequest(simulation=name)) for _ in range(8)]
        server.info()
        assert not waking.done() and not any(deletion.done() for deletion in deletions), "it has waited for them"
        done = [deletion.exception() is None for deletion in deletions]
        assert done.count(True) == 1
        assert all(d.code() in (grpc.StatusCode.OK, grpc.StatusCode.NOT_FOUND) for d in deletions)
        waking.exception()
        assert server.list() == [] and not (folder / name).exists()


def test_who_may_not_delete_brings_nothing_back(start, tmp_path):
    tokens = tmp_path / "tokens"
    tokens.write_text("ann control ann\nbob control bob\ncarl control carl\n")
    tokens.chmod(0o600)
    daemon = start("--tokens", str(tokens))
    with daemon.connect(token="ann") as ann:
        name = ann.load_text(deck(), grants=[mbcosim.grant("token:bob", "observe")]).name
    daemon.stop()
    daemon = start("--tokens", str(tokens))
    for token, reason in (("bob", "NOT_GRANTED"), ("carl", "NO_SUCH_SIMULATION")):
        with daemon.connect(token=token) as other, pytest.raises(grpc.RpcError) as caught:
            other.simulations.DeleteSimulation(pb.DeleteSimulationRequest(simulation=name), metadata=other.metadata)
        assert mbcosim.errors.from_rpc_error(caught.value).reason == reason
    with daemon.connect(token="ann") as ann:
        assert state_of(ann, name) == pb.SIMULATION_STATE_SUSPENDED
    daemon.stop()
    assert "is READY" not in daemon.log()


def test_a_deletion_frees_the_calls_that_wait_for_a_step(start):
    """Even when they take all threads that may wait."""
    silent = threading.Event()

    def wait(motion):
        silent.wait(60 * TIME_FACTOR)
        return -motion.x

    daemon = start()
    with daemon.connect() as server:
        simulation = server.load_text(deck(), ports=[mbcosim.structural_port("spring", nodes=[1])])
        with simulation.couple("spring", wait, mode="tight", peer_timeout=100 * TIME_FACTOR):
            step = server.simulations.Step.future(pb.StepRequest(simulation=simulation.name))
            wait_for(lambda: "port spring since" in simulation.refresh().waiting_for)
            readers = [server.simulations.ReadVariables.future(pb.ReadVariablesRequest(simulation=simulation.name)) for _ in range(100)]
            simulation.delete()
            assert [call.exception() is not None or call.code() == grpc.StatusCode.OK for call in [step, *readers]] == 101 * [True]
            silent.set()


def test_forks_outlive_too(start):
    daemon = start()
    with daemon.connect() as server:
        original = server.load_text(deck())
        original.step(20)
        fork = original.fork(name="twig")
        fork.step(5)
        ported = server.load_text(decks.body(), ports=[mbcosim.motion_port("hand", nodes=[1])])
        ported_fork = ported.fork()  # of a model with equations of the port, without the port
        names = original.name, fork.name, ported.name, ported_fork.name
        fleeting = server.load_text(deck(), durability="none")
        assert fleeting.fork().info.durability == pb.DURABILITY_NONE
    daemon.stop()
    with start().connect() as server:
        assert {info.name for info in server.list()} == set(names)
        assert [server.attach(n).read(["step"])["step"] for n in names] == [20, 25, 0, 0]


@pytest.mark.parametrize("damage", ["flip", "cut", "tail"])
@pytest.mark.parametrize("file", ["model", "point"])
def test_what_is_damaged_is_named_and_stops_nobody_else(start, folder, file, damage):
    daemon = start()
    with daemon.connect() as server:
        bad, good = server.load_text(deck()).name, server.load_text(deck()).name
    kill(daemon)
    path = folder / bad / file
    data = bytearray(path.read_bytes())
    if damage == "flip":
        data[len(data) // 2] ^= 4
    path.write_bytes(data[:-7] if damage == "cut" else data + b"torn" if damage == "tail" else data)
    daemon = start()
    with daemon.connect() as server:
        assert [info.name for info in server.list()] == [good]
        assert server.attach(good).step(3).step == 3
        with pytest.raises(mbcosim.NotFound):
            server.attach(bad)
    line, = [line for line in daemon.log().splitlines() if "put aside" in line]
    assert f"{bad.split('/')[1]}/{file}: record " in line
    assert (folder / (bad + ".damaged") / file).exists()


@pytest.mark.parametrize("file", ["model", "point", "unfinished"])
def test_what_the_system_does_not_let_be_read_stays_and_is_found_again(start, folder, file):
    daemon = start()
    with daemon.connect() as server:
        bad, good = server.load_text(deck()).name, server.load_text(deck()).name
        server.attach(bad).step(7)
    daemon.stop()
    path, away = folder / bad / file, folder / "away"
    if path.exists():
        path.rename(away)
    path.symlink_to(path)  # ELOOP: it holds for root, too
    daemon = start()
    with daemon.connect() as server:
        assert [info.name for info in server.list()] == [good]
        assert server.attach(good).step(3).step == 3
        for call in (lambda: server.attach(bad), lambda: server.simulations.Step(pb.StepRequest(simulation=bad)),
                     lambda: server.simulations.DeleteSimulation(pb.DeleteSimulationRequest(simulation=bad))):
            with pytest.raises((mbcosim.Error, grpc.RpcError), match="could not be read when the server began: .*symbolic links"):
                call()
    line, = [line for line in daemon.log().splitlines() if "stays as it is until the daemon is started anew" in line]
    assert f"{bad.split('/')[1]}/{file}: " in line and "Too many levels of symbolic links" in line
    assert "put aside" not in daemon.log() and (folder / bad).exists()
    daemon.stop()
    path.unlink()
    if away.exists():
        away.rename(path)
    with start().connect() as server:
        assert server.attach(bad).read(["step"])["step"] == 7


def test_what_is_damaged_and_cannot_be_put_aside_is_told(start, folder):
    daemon = start()
    with daemon.connect() as server:
        bad = server.load_text(deck()).name
    kill(daemon)
    damage(folder / bad / "model")
    (folder / (bad + ".damaged") / "there").mkdir(parents=True)
    daemon = start()
    with daemon.connect() as server, pytest.raises(mbcosim.Error, match="it cannot be put aside: Directory not empty"):
        server.attach(bad)
    assert "model: record " in daemon.log() and "it cannot be put aside: Directory not empty" in daemon.log()
    assert (folder / bad / "model").exists()


def test_what_was_being_made_or_removed_when_the_daemon_was_killed_is_removed(start, folder):
    daemon = start()
    with daemon.connect() as server:
        half, other = server.load_text(deck()), server.load_text(deck())
        names = half.name, other.name
        half.step(3), other.step(3)
    daemon.stop()
    stored = folder / names[0]
    (stored / "model").unlink()  # as it is before its last file is there
    (stored / "unfinished").touch()
    gone = stored.with_name("0123456789abcdef.gone")
    gone.mkdir()
    (gone / "point").write_bytes(b"half of it")
    begun = stored.with_name("123456789abcdef0.gone")
    begun.mkdir()
    (begun / "unfinished.new").touch()
    daemon = start()
    with daemon.connect() as server:
        assert [found.name for found in server.list()] == [names[1]]
        assert server.attach(names[1]).step().step == 4
    assert "was not yet made when the daemon ended" in daemon.log() and "put aside" not in daemon.log()
    assert os.listdir(stored.parent) == [os.path.basename(names[1])]


def test_what_was_being_written_when_the_daemon_was_killed_is_removed_and_not_counted(start, folder):
    daemon = start()
    with daemon.connect() as server:
        simulation = server.load_text(deck())
    daemon.stop()
    stored, damaged = folder / simulation.name, folder / "simulations" / "0123456789abcdef.damaged"
    damaged.mkdir()
    for path in (stored / "point.new", stored / "snapshot-1.new", damaged / "point.new"):
        path.write_bytes(1000 * b"x")
    daemon = start("--http", "127.0.0.1:0")
    assert sorted(os.listdir(stored)) == ["model", "point"] and os.listdir(damaged) == ["point.new"]
    assert metrics(daemon)["mbcosim_state_bytes"] == 1000 + sum((stored / name).stat().st_size for name in ("model", "point"))


def test_a_damaged_snapshot_is_named_when_it_is_needed(start, folder):
    daemon = start()
    with daemon.connect() as server:
        simulation = server.load_text(deck())
        simulation.snapshot()
        name = simulation.name
    daemon.stop()
    path = folder / name / "snapshot-1"
    data = bytearray(path.read_bytes())
    data[-40] ^= 1
    path.write_bytes(data)
    with start().connect() as server:
        with pytest.raises(mbcosim.Error) as caught:
            server.attach(name).step()
        assert caught.value.reason == "DAMAGED_STATE" and "snapshot-1: record 2 at byte" in str(caught.value)
        assert state_of(server, name) == pb.SIMULATION_STATE_SUSPENDED  # nothing is lost


@pytest.mark.parametrize("option, limit", [("--limit-deck-bytes", "deck_bytes"), ("--limit-statements", "statements"), ("--limit-unknowns", "unknowns")])
def test_a_deck_that_is_too_large_by_now_is_told(start, option, limit):
    daemon = start()
    with daemon.connect() as server:
        name = server.load_text(deck()).name
    daemon.stop()
    daemon = start(option, "3")
    with daemon.connect() as server:
        with pytest.raises(mbcosim.LimitExceeded) as caught:
            server.attach(name).step()
        assert caught.value.metadata["limit"] == limit
    daemon.stop()
    with start().connect() as server:
        assert server.attach(name).step().step == 1


def test_results_of_netcdf_that_were_cut_are_told(start, tmp_path):
    root = tmp_path / "results"
    root.mkdir()
    daemon = start("--results-root", str(root))
    with daemon.connect() as server:
        simulation = server.load_text(deck(), results="netcdf", name="n", durability="checkpoint")
        simulation.step(20)
        name = simulation.name
    daemon.stop()
    file = next(root.glob("*/results.nc"))
    os.truncate(file, file.stat().st_size - 1000)
    with start("--results-root", str(root)).connect() as server:
        with pytest.raises(mbcosim.Error) as caught:
            server.attach(name).step()
        assert caught.value.reason == "DAMAGED_STATE" and "the file ends before that step" in str(caught.value)
        file.unlink()
        with pytest.raises(mbcosim.Error) as caught:
            server.attach(name).step()
        assert caught.value.reason == "DAMAGED_STATE" and "it cannot be opened" in str(caught.value)


def test_one_folder_has_one_daemon(start, folder, tmp_path):
    start().connect().close()
    second = subprocess.run([os.path.join(BIN, "mbcosimd"), "--listen", f"unix:{tmp_path}/second", "--state-dir", str(folder)],
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60 * TIME_FACTOR)
    assert second.returncode == 4
    assert second.stdout.splitlines()[-1] == f"mbcosimd: error: another daemon uses the state folder {folder}"


def test_checkpoints_are_told(start):
    with start("--checkpoint-interval", "3600").connect() as server, server.events() as watcher:
        simulation = server.load_text(deck())
        for _ in range(2):
            simulation.step(7)
            simulation.export_checkpoint()
        told = [event for _, event in zip(range(3), watcher)]
        assert [event.WhichOneof("content") for event in told] == ["created", "checkpoint", "checkpoint"]
        assert [event.simulation for event in told] == 3 * [simulation.name]
        assert [event.checkpoint.step for event in told[1:]] == [7, 14]
        assert all(event.checkpoint.bytes > 500 for event in told[1:])


def test_a_full_folder_refuses_and_loses_nothing(start, folder):
    with start("--limit-state-bytes", "60000", "--checkpoint-interval", "0.05").connect() as server, server.events() as watcher:
        simulation = server.load_text(deck())
        kept = 1
        with pytest.raises(mbcosim.LimitExceeded) as caught:
            for _ in range(100):
                server.load_text(deck())
                kept += 1
        assert caught.value.reason == "STORAGE_FULL" and "may take 60000 bytes (limit state_bytes)" in str(caught.value)
        assert len(server.list()) == kept == len(os.listdir(folder / "simulations"))
        for _ in range(20):
            simulation.snapshot()  # in memory there is room
        assert simulation.step(10).step == 10
        failed = next(event for event in watcher if event.WhichOneof("content") == "checkpoint_failed")
        assert "limit state_bytes" in failed.checkpoint_failed.message and failed.simulation
        assert simulation.step(10).step == 20


def test_refusals(start, start_daemon):
    with start().connect() as server:
        for options, message in [({"checkpoint_steps": 0}, "`checkpoint_steps` must be positive, got 0"),
                                 ({"checkpoint_interval": 0.0}, "`checkpoint_interval` must be at least 1 ms")]:
            with pytest.raises(mbcosim.Error) as caught:
                server.load_text(deck(), **options)
            assert message in str(caught.value)
        assert server.list() == []
        fleeting = server.load_text(deck(), durability="none")
        with pytest.raises(grpc.RpcError) as refused:
            server.simulations.ForkSimulation(pb.ForkSimulationRequest(
                simulation=fleeting.name, options=pb.CreateOptions(durability=pb.DURABILITY_CHECKPOINT)))
        assert "the original of the fork has durability NONE" in refused.value.details()
    with start_daemon().connect() as server:
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            server.load_text(deck(), durability="checkpoint")
        assert caught.value.reason == "NOT_DURABLE" and "--state-dir" in str(caught.value)
        assert server.load_text(deck()).info.durability == pb.DURABILITY_NONE


def test_steps_between_checkpoints(start, folder):
    with start("--checkpoint-interval", "3600").connect() as server:
        simulation = server.load_text(deck(), checkpoint_steps=100)
        simulation.step(99)
        time.sleep(0.2)
        assert on_disk(folder, simulation.name) == 0
        simulation.step(1)
        wait_for(lambda: on_disk(folder, simulation.name) == 100)


def test_a_peer_that_does_not_answer_holds_up_no_other_checkpoint(start, folder):
    """A step with a tight peer keeps its simulation locked."""
    answer = threading.Event()

    def silent(motion):
        answer.wait(30 * TIME_FACTOR)
        return -motion.x

    with start("--checkpoint-interval", "0.05").connect() as server:
        waiting = server.load_text(deck(), ports=[mbcosim.structural_port("spring", nodes=[1])])
        with waiting.couple("spring", silent, mode="tight", peer_timeout=60 * TIME_FACTOR):
            step = threading.Thread(target=waiting.step)
            step.start()
            wait_for(lambda: "port spring since" in waiting.refresh().waiting_for)
            other = server.load_text(deck())
            time.sleep(0.3)  # now the checkpoint of the other, too, is due
            other.step(7)
            wait_for(lambda: on_disk(folder, other.name) == 7)
            answer.set()
            step.join()
            assert waiting.refresh().step == 1


def pull(motion):
    return -30.0 * motion.x


@pytest.mark.parametrize("mode", ["loose", "staggered", "tight", "window"])
def test_a_peer_ahead_of_what_came_back_is_refused_and_one_that_goes_back_goes_on(start, folder, mode):
    daemon, ports = start("--checkpoint-interval", "3600"), [mbcosim.structural_port("spring", nodes=[1])]
    with daemon.connect() as server:
        simulation = server.load_text(deck(), ports=ports, checkpoint_steps=10)
        name = simulation.name
        with simulation.couple("spring", pull, mode=mode) as peer:
            simulation.step(10)
            wait_for(lambda: on_disk(folder, name) == 10)
            simulation.step(6)
            wait_for(lambda: peer.step == (15 if mode == "loose" else 16))
            kill(daemon)
    with start().connect() as server:
        again = server.attach(name)
        with pytest.raises(mbcosim.PreconditionFailed, match=f"the peer stands at step {peer.step}, the simulation at step 10") as caught:
            again.couple("spring", pull, mode=mode, step=peer.step)
        assert caught.value.reason == "PEER_AHEAD" and again.refresh().step == 10
        with again.couple("spring", pull, mode=mode, step=peer.step, can_go_back=True) as back:
            assert back.step == back.welcome.step == 10
            again.step(20)
        with server.load_text(deck(), ports=ports, durability="none") as straight, straight.couple("spring", pull, mode=mode):
            straight.step(30)
            assert bits(straight) == bits(again)


@pytest.mark.parametrize("mode", ["loose", "staggered", "tight", "window"])
def test_a_peer_of_a_journaled_simulation_is_never_ahead(start, folder, mode):
    daemon, ports = start("--checkpoint-interval", "3600"), [mbcosim.structural_port("spring", nodes=[1])]
    with daemon.connect() as server:
        simulation = server.load_text(deck(), ports=ports, durability="journal")
        name = simulation.name
        with simulation.couple("spring", pull, mode=mode) as peer:
            simulation.step(6)
            wait_for(lambda: peer.step == (5 if mode == "loose" else 6))
            kill(daemon)
    with start().connect() as server:
        again = server.attach(name)
        with again.couple("spring", pull, mode=mode, step=peer.step) as back:
            assert (back.step, back.welcome.step) == (peer.step, 6)
            assert again.step().step == 7
        wait_for(lambda: not again.describe().ports[0].has_peer)
        with again.couple("spring", pull, mode=mode, step=2):  # one that has missed some
            assert again.step().step == 8


def test_long_suspended_ones_are_removed(start, folder):
    daemon = start()
    with daemon.connect() as server:
        name = server.load_text(deck()).name
    daemon.stop()
    os.utime(folder / name / "point", (time.time() - 100,) * 2)
    with start("--suspended-expiry", "50").connect() as server:
        wait_for(lambda: server.list() == [] and not (folder / name).exists())


def test_what_is_used_and_does_not_change_is_kept_from_its_last_use_on(start, folder):
    daemon = start("--lease", "1", "--suspended-expiry", "60")
    with daemon.connect() as server:
        simulation = server.load_text(deck())
        point = folder / simulation.name / "point"
        os.utime(point, (time.time() - 1000,) * 2)  # so long it was read only
        wait_for(lambda: state_of(server, simulation.name) == pb.SIMULATION_STATE_SUSPENDED)
        time.sleep(0.2)
        assert state_of(server, simulation.name) == pb.SIMULATION_STATE_SUSPENDED and time.time() - point.stat().st_mtime < 60
        assert simulation.read(["time"])["time"] == 0
        os.utime(point, (time.time() - 1000,) * 2)
    daemon.stop()
    assert time.time() - point.stat().st_mtime < 60


def test_a_missing_folder_is_named_and_not_made(tmp_path):
    missing = tmp_path / "missing"
    done = subprocess.run([os.path.join(BIN, "mbcosimd"), "--listen", f"unix:{tmp_path}/socket", "--state-dir", str(missing)],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60 * TIME_FACTOR)
    assert done.returncode == 4 and f"Directory does not exist: {missing}" in done.stdout, done.stdout
    assert not missing.exists()


@pytest.fixture
def small_disk(tmp_path):
    """A disk of half a mebibyte; skipped where mounting is not allowed."""
    place = tmp_path / "disk"
    place.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=512k", "none", str(place)], capture_output=True).returncode != 0:
        pytest.skip("this user may not mount a disk")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def remount(place, how):
    subprocess.run(["mount", "-o", f"remount,{how}", str(place)], check=True)


def fill(place):
    """Writes until nothing more goes on the disk."""
    with open(place / "filler", "wb", buffering=0) as file, pytest.raises(OSError, match="No space"):
        while True:
            file.write(b"x" * 4096)


def test_a_full_disk_is_told_and_loses_nothing(start_daemon, small_disk):
    daemon = start_daemon("--state-dir", str(small_disk), "--checkpoint-interval", "0.05")
    with daemon.connect() as server, server.events() as watcher:
        journal, checkpoints = (server.load_text(deck(), durability=how) for how in ("journal", "checkpoint"))
        for simulation in (journal, checkpoints):
            simulation.step(10)
        fill(small_disk)
        with pytest.raises(mbcosim.LimitExceeded) as caught:
            for _ in range(1000):  # the last page of a file may have room
                journal.step()
        assert caught.value.reason == "STORAGE_FULL" and "No space left on device" in str(caught.value)
        stands = bits(journal)
        with pytest.raises(mbcosim.LimitExceeded) as caught:
            server.load_text(deck())
        assert caught.value.reason == "STORAGE_FULL"
        assert checkpoints.step(10).step == 20
        failed = next(event for event in watcher if event.WhichOneof("content") == "checkpoint_failed")
        assert "No space left on device" in failed.checkpoint_failed.message
        assert len(server.list()) == 2
        name = journal.name
        server.simulations.DeleteSimulation(end(checkpoints.name))  # which makes room
        assert [info.name for info in server.list()] == [name]
    kill(daemon)
    (small_disk / "filler").unlink()
    with start_daemon("--state-dir", str(small_disk)).connect() as server:
        assert [info.name for info in server.list()] == [name]
        assert bits(server.attach(name)) == stands


def test_a_read_only_disk_is_refused_by_name_and_loses_nothing(start_daemon, small_disk):
    daemon = start_daemon("--state-dir", str(small_disk), "--checkpoint-interval", "3600")
    with daemon.connect() as server:
        simulation = server.load_text(deck(), durability="journal")
        simulation.step(10)
        name, stands = simulation.name, bits(simulation)
    kill(daemon)
    remount(small_disk, "ro")
    refused = subprocess.run([os.path.join(BIN, "mbcosimd"), "--listen", f"unix:{small_disk}/../socket", "--state-dir", str(small_disk)],
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60 * TIME_FACTOR)
    assert refused.returncode == 4
    assert refused.stdout.splitlines()[-1] == f"mbcosimd: error: the state folder {small_disk} cannot be used: Read-only file system"
    remount(small_disk, "rw")
    with start_daemon("--state-dir", str(small_disk)).connect() as server:
        assert bits(server.attach(name)) == stands
