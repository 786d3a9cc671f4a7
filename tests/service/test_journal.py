"""Simulations with a journal: whatever anybody was told outlives a kill, requests are done once, and runs go on bit for bit."""
import itertools
import os
import random
import resource
import threading
import time

import grpc
import numpy as np
import pytest

import decks
import mbcosim
from conftest import wait_for
from mbcosim.v1 import events_pb2, simulations_pb2 as pb
from test_durable import X, bits, deck, folder, start, state_of  # noqa: F401 (fixtures)

KILLS = int(os.environ.get("MBCOSIM_KILLS", "6"))  # 1000 for the long form
LOST = (grpc.RpcError, mbcosim.Error)


def step_of(server, name):
    return int(server.attach(name).read(["step"])["step"])


class Watcher:
    """Everybody who may learn of a step: one who asks, one who reads, one who watches events, one who subscribes."""

    def __init__(self, daemon, name, *, subscribes=False):
        self.seen, self._over = 0, False
        jobs = [self._ask, self._read, self._watch] + ([self._subscribe] if subscribes else [])
        self._threads = [threading.Thread(target=self._run, args=(job, daemon.connect(), name)) for job in jobs]
        for thread in self._threads:
            thread.start()

    def _run(self, job, server, name):
        with server:
            try:
                job(server, name)
            except LOST:
                pass  # the daemon was killed

    # By bare calls: the client's own are tried again for two seconds when the daemon is gone.
    def _ask(self, server, name):
        while not self._over:
            listed = server.simulations.ListSimulations(pb.ListSimulationsRequest()).simulations
            self._note(next(info.step for info in listed if info.name == name))
            time.sleep(0.003)

    def _read(self, server, name):
        while not self._over:
            self._note(server.simulations.ReadVariables(pb.ReadVariablesRequest(simulation=name)).step)
            time.sleep(0.01)

    def _watch(self, server, name):
        with server.events(name) as events:
            for event in events:
                self._note(event.state_changed.step)  # 0 in other events
                if event.snapshot.change == events_pb2.SNAPSHOT_CHANGE_SAVED:
                    self._note(event.snapshot.step)

    def _subscribe(self, server, name):
        with server.attach(name).subscribe(["time"]) as samples:
            for step, _, _ in samples:
                self._note(step)

    def _note(self, step):
        self.seen = max(self.seen, step)

    def end(self):
        self._over = True
        for thread in self._threads:
            thread.join(60)
        return self.seen


def requests_of(rolls, name, number):
    return pb.StepRequest(simulation=name, steps=rolls.choice([1, 1, 3, 40, 400]), request_id=f"request {number}")


@pytest.mark.parametrize("watched", ["by polling", "by subscription"])
def test_kills_at_random_moments_lose_nothing_that_was_told(start, watched):
    """The short form; MBCOSIM_KILLS=1000 for the long one. Each request is done once, however often it is repeated."""
    rolls, text = random.Random(20), deck(10_000_000)
    options = ("--checkpoint-interval", "0.1")
    daemon = start(*options)
    with daemon.connect() as server:
        name = server.load_text(text, durability="journal").name
    number, due, told, unanswered = 0, 0, 0, None
    for _ in range(KILLS):
        watcher = Watcher(daemon, name, subscribes=watched == "by subscription")
        killer = threading.Timer(rolls.uniform(0.02, 0.4), daemon.kill)
        with daemon.connect() as server:
            killer.start()
            try:
                while True:
                    if not unanswered:
                        number += 1
                        unanswered = requests_of(rolls, name, number)
                        due += unanswered.steps
                    reply = server.simulations.Step(unanswered)
                    assert reply.step == due, "a request was done twice, or not whole"
                    told, unanswered = reply.step, None
            except LOST:
                killer.join()
        seen = watcher.end()
        daemon = start(*options)
        with daemon.connect() as server:
            resumed = step_of(server, name)
            assert max(told, seen) <= resumed <= due
    with daemon.connect() as server:
        if unanswered:
            assert server.simulations.Step(unanswered).step == due
        again = server.attach(name)
        with server.load_text(text, durability="none") as straight:
            straight.step(due)
            assert bits(straight) == bits(again)


class Spring:
    """A peer that comes back to whatever daemon there is. Its answers follow from the exchange alone."""

    def __init__(self, **options):
        self.seen, self.options = 0, options

    def answer(self, motion):
        self.seen = max(self.seen, motion.step - (self.options["mode"] in ("tight", "window")))
        force = -100.0 * np.asarray(motion.x[0]) * (1 + 1e-3 * motion.step)
        return [motion.rotations[0].T @ force - 20.0 * motion.v[0] if self.options.get("frame") == "node" else force]

    def couple(self, simulation):
        return simulation.couple("spring", self.answer, step=self.seen, **self.options)  # or it is refused


COUPLINGS = [{"mode": "loose"}, {"mode": "loose", "every": 3, "hold": "quadratic"}, {"mode": "staggered"},
             {"mode": "staggered", "every": 2, "hold": "linear"}, {"mode": "tight"}, {"mode": "window"},
             {"mode": "loose", "every": 2, "hold": "linear", "frame": "node", "following_loads": True}]


def coupled(server, durability):
    text = decks._OSCILLATOR.replace("final time: 10.", "final time: 1.e6") % (1, "")
    text = text[:text.index("  joint: 2,")] + text[text.index("end: elements;"):]
    text = text.replace("3., 0.2, 0., null;", "3., 0.2, 0., 0., 0., 2.;")  # it turns
    return server.load_text(text, ports=[mbcosim.structural_port("spring", nodes=[1])], durability=durability)


@pytest.mark.parametrize("options", COUPLINGS, ids=lambda o: " ".join(str(value) for value in o.values()))
def test_kills_with_a_peer_lose_nothing_that_it_was_told(start, options):
    rolls, spring = random.Random(21), Spring(**options)
    daemon = start()
    with daemon.connect() as server:
        name = coupled(server, "journal").name
    number, due, unanswered = 0, 0, None
    for _ in range(max(3, KILLS // 2)):
        with daemon.connect() as server:
            simulation = server.attach(name)
            assert spring.seen <= step_of(server, name) <= due
            killer = threading.Timer(rolls.uniform(0.05, 0.4), daemon.kill)
            peer = spring.couple(simulation)
            killer.start()
            try:
                while True:
                    if not unanswered:
                        number += 1
                        unanswered = pb.StepRequest(simulation=name, steps=rolls.choice([1, 2, 7]), request_id=f"{number}")
                        due += unanswered.steps
                    assert server.simulations.Step(unanswered).step == due
                    unanswered = None
            except LOST:
                killer.join()
            try:
                peer.close()
            except LOST:
                pass
        daemon = start()
    with daemon.connect() as server:
        again = server.attach(name)
        with spring.couple(again):
            again.step(due + 5 - step_of(server, name))
        straight = coupled(server, "none")
        with Spring(**options).couple(straight):
            straight.step(due + 5)
        assert due > 5 and bits(straight) == bits(again)


@pytest.mark.parametrize("go_back", [lambda simulation, saved: saved.restore(), lambda simulation, saved: simulation.reset()], ids=["restore", "reset"])
def test_a_peer_is_asked_anew_after_a_restore_and_a_kill(start, go_back):
    daemon = start("--checkpoint-interval", "3600")
    with daemon.connect() as server:
        simulation = coupled(server, "journal")
        saved = simulation.snapshot()
        with Spring(mode="loose").couple(simulation):
            simulation.step()
        go_back(simulation, saved)
    daemon.kill()
    asked = []

    def pushing(motion):
        asked.append(motion.step)
        return [np.array([0.0, 3.0, 0.0])]
    with start().connect() as server:
        again = server.attach(simulation.name)
        with again.couple("spring", pushing, mode="loose"):
            again.step()
        assert asked == [0]
        straight = coupled(server, "none")
        with straight.couple("spring", pushing, mode="loose"):
            straight.step()
        assert bits(straight) == bits(again)


def is_finished(event):
    return event.state_changed.state == pb.SIMULATION_STATE_FINISHED


def is_saved(event):
    return event.snapshot.change == events_pb2.SNAPSHOT_CHANGE_SAVED


@pytest.mark.parametrize("told, act", [(is_finished, lambda simulation: simulation.run_until(1e9)),
                                       (is_saved, lambda simulation: simulation.snapshot("kept"))], ids=["finished", "saved"])
def test_kills_at_an_event_lose_nothing_that_it_tells(start, told, act):
    """At the very event, while the call that made it may still be open."""
    rolls = random.Random(22)
    daemon = start("--checkpoint-interval", "3600")
    for _ in range(max(3, KILLS // 2)):
        steps = rolls.randrange(2, 200)
        with daemon.connect() as server:
            simulation = server.load_text(deck(steps), durability="journal")
            simulation.step(rolls.randrange(1, steps))
            acting = threading.Thread(target=swallowing, args=(act, simulation))
            with server.events(simulation.name) as events:
                acting.start()
                event = next(event for event in events if told(event))
                daemon.kill()
            acting.join(60)
        daemon = start("--checkpoint-interval", "3600")
        with daemon.connect() as server:
            again = server.attach(simulation.name)
            if told is is_finished:
                again.read(["step"])
                info = again.refresh()
                assert (info.state, info.step) == (pb.SIMULATION_STATE_FINISHED, event.state_changed.step)
            else:
                assert [(saved.name, saved.step) for saved in again.snapshots()] == [(event.snapshot.name, event.snapshot.step)]


def swallowing(act, simulation):
    try:
        act(simulation)
    except LOST:
        pass  # the daemon was killed


def test_changes_of_every_kind_outlive_a_kill(start):
    daemon = start("--checkpoint-interval", "3600")
    with daemon.connect() as server:
        simulation = server.load_text(deck(), durability="journal")
        name = simulation.name
        assert simulation.info.durability == pb.DURABILITY_JOURNAL
        simulation.step(7)
        simulation.snapshot("seven")
        simulation.step(5)
        simulation.update(name="renamed", policy="cut_step", grants=[mbcosim.grant("token:x", "observe")])
        simulation.snapshots()[0].restore()
        simulation.step(2)
    daemon.kill()
    with start().connect() as server:
        again = server.attach(name)
        assert (again.info.display_name, again.info.step) == ("renamed", 9)
        assert again.info.non_convergence_policy == pb.NON_CONVERGENCE_POLICY_CUT_STEP and again.info.grants[0].identity == "token:x"
        assert [(s.display_name, s.step) for s in again.snapshots()] == [("seven", 7)]


def with_results(tmp_path):
    root = tmp_path / "results"
    root.mkdir()
    return "--results-root", str(root)


def load_with_results(server, durability):
    return server.load_text(deck(), durability=durability, results="text", summed_time=True)


def files_of(simulation):
    return {file: simulation.result_file(file) for file in simulation.result_files()}


def check_results_at(step, server, simulation):
    """They are those of one run to there."""
    simulation.step(step - step_of(server, simulation.name))
    with load_with_results(server, "none") as straight:
        straight.step(step)
        assert files_of(straight) == files_of(simulation)


def test_results_go_on_from_what_the_journal_tells(start, tmp_path):
    options = (*with_results(tmp_path), "--checkpoint-interval", "3600")
    daemon = start(*options)
    with daemon.connect() as server:
        simulation = load_with_results(server, "journal")
        for _ in range(20):
            simulation.step(3)
    daemon.kill()
    with start(*options).connect() as server:
        check_results_at(100, server, server.attach(simulation.name))


@pytest.mark.parametrize("durability", ["checkpoint", "journal"])
def test_kills_in_restores_lose_no_results(start, tmp_path, durability):
    rolls, options = random.Random(23), (*with_results(tmp_path), "--checkpoint-interval", "0.02")
    daemon = start(*options)
    with daemon.connect() as server:
        name = load_with_results(server, durability).name
        server.attach(name).snapshot()
    for _ in range(KILLS):
        with daemon.connect() as server:
            simulation = server.attach(name)
            saved, = simulation.snapshots() or [simulation.snapshot()]  # CHECKPOINT may not have it yet
            killer = threading.Timer(rolls.uniform(0.05, 0.2), daemon.kill)
            killer.start()
            try:
                while True:
                    server.simulations.Step(pb.StepRequest(simulation=name, steps=7))
                    server.simulations.RestoreSnapshot(pb.RestoreSnapshotRequest(simulation=name, snapshot=saved.name))
            except LOST:
                killer.join()
        daemon = start(*options)
        with daemon.connect() as server:
            again = server.attach(name)
            again.read(["step"])
            assert b"# Goes on after" not in again.result_file("results.out")
    with daemon.connect() as server:
        check_results_at(100, server, server.attach(name))


@pytest.mark.parametrize("durability", ["checkpoint", "journal"])
def test_a_restore_that_cannot_be_stored_changes_nothing(start, tmp_path, durability):
    options = (*with_results(tmp_path), "--checkpoint-interval", "3600")
    daemon = start(*options)
    limits = resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE)
    with daemon.connect() as server:
        simulation = load_with_results(server, durability)
        simulation.step(5)
        saved = simulation.snapshot()
        simulation.step(7)
        before, files = (bits(simulation), simulation.refresh()), files_of(simulation)
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (100, limits[1]))
        for act in (saved.restore, simulation.reset):
            with pytest.raises(mbcosim.LimitExceeded) as caught:
                act()
            assert caught.value.reason == "STORAGE_FULL"
        assert (bits(simulation), simulation.refresh()) == before
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, limits)
        assert files_of(simulation) == files
        simulation.step(8)
        saved.restore()
    daemon.kill()
    with start(*options).connect() as server:
        again = server.attach(simulation.name)
        assert step_of(server, simulation.name) == 5
        check_results_at(100, server, again)


def test_an_end_that_cannot_be_stored_is_not_told(start, folder, tmp_path):
    """The steps before it, of the same call, are not on the disk either."""
    quota = 60_000
    daemon = start(*with_results(tmp_path), "--checkpoint-interval", "3600")
    limits = resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE)
    with daemon.connect() as server:
        simulation = server.load_text(deck(), durability="journal", results="text", results_quota=quota)
        simulation.step(5)
        journal, = entries(folder, simulation.name)
        while journal.stat().st_size <= quota:
            simulation.update(name=f"{journal.stat().st_size} bytes")
        before = simulation.refresh()
        with server.events(simulation.name) as events:
            resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (journal.stat().st_size, limits[1]))
            with pytest.raises(mbcosim.LimitExceeded) as caught:
                simulation.step(4000)  # until the quota is used up
            assert caught.value.reason == "STORAGE_FULL"
            assert simulation.refresh() == before
            resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, limits)
            simulation.snapshot()
            assert is_saved(next(event for event in events if event.WhichOneof("content") in ("snapshot", "step_failed")))


def test_the_last_64_replies_are_kept(start):
    daemon = start("--checkpoint-interval", "3600")
    with daemon.connect() as server:
        name = server.load_text(deck(), durability="journal").name
        requests = [pb.StepRequest(simulation=name, steps=1, request_id=str(k), outputs=[0]) for k in range(70)]
        replies = [server.simulations.Step(request) for request in requests]
    daemon.kill()
    with start().connect() as server:
        for request, reply in list(zip(requests, replies))[-64:]:
            assert server.simulations.Step(request) == reply
        assert step_of(server, name) == 70
        assert server.simulations.Step(requests[0]).step == 71  # forgotten: done anew


def test_replies_that_no_entry_has_yet_are_few(start, folder):
    """Requests that change nothing are stored with the next that does: no more of them than are kept at all, 8 MB."""
    daemon = start("--checkpoint-interval", "3600")
    with daemon.connect() as server:
        simulation = server.load_text(deck(), durability="journal")
        requests = [pb.StepRequest(simulation=simulation.name, steps=0, request_id=str(k), outputs=[0] * 200_000) for k in range(12)]
        replies = [server.simulations.Step(request) for request in requests]
        assert sum(reply.ByteSize() for reply in replies) > 16 << 20
        simulation.step()
        path, = entries(folder, simulation.name)
        assert replies[-1].ByteSize() < path.stat().st_size < 9 << 20
    daemon.kill()
    with start().connect() as server:
        assert server.simulations.Step(requests[-1]) == replies[-1]
        assert step_of(server, simulation.name) == 1


def entries(folder, name):
    return sorted(path for path in (folder / name).iterdir() if path.name.startswith("journal-"))


def test_a_damaged_journal_is_named_and_stops_nobody_else(start, folder):
    daemon = start("--checkpoint-interval", "3600")
    with daemon.connect() as server:
        bad, good = (server.load_text(deck(), durability="journal") for _ in range(2))
        for simulation in (bad, good):
            for _ in range(5):
                simulation.step()
        bad, good = bad.name, good.name
    daemon.kill()
    path, = entries(folder, bad)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 16
    path.write_bytes(data)
    path, = entries(folder, good)
    path.write_bytes(path.read_bytes()[:-3])  # as if the last entry had been on its way
    daemon = start()
    with daemon.connect() as server:
        assert [info.name for info in server.list()] == [good]
        assert step_of(server, good) == 4
    line, = [line for line in daemon.log().splitlines() if "put aside" in line]
    assert f"{bad.split('/')[1]}/{path.name}: record " in line and " at byte " in line


def test_a_full_disk_takes_steps_back_and_loses_nothing(start):
    daemon = start("--checkpoint-interval", "3600")
    limits = resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE)
    with daemon.connect() as server:
        simulation = server.load_text(deck(), durability="journal")
        simulation.step(10)
        before = bits(simulation)
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (1000, limits[1]))
        with pytest.raises(mbcosim.LimitExceeded) as caught:
            simulation.step(5)
        assert caught.value.reason == "STORAGE_FULL" and "cannot be written: File too large" in str(caught.value)
        assert bits(simulation) == before and server.attach(simulation.name).info.step == 10
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, limits)
        simulation.step(5)
        after = bits(simulation)
        name = simulation.name
    daemon.kill()
    with start().connect() as server:
        assert bits(server.attach(name)) == after


# The last value of its force is for a time shortly after 0.2 s: the run ends there, before its final time.
ENDING = """begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: .04; tolerance: 1e-9; max iterations: 20; end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; forces: 1; file drivers: 1; end: control data;
begin: nodes; structural: 1, dynamic, 0.,0.,0., eye, null, 0.,0.,1.; end: nodes;
begin: drivers; file: 1, fixed step, count, 1, initial time, -1e-6, time step, .100001, bailout, upper, "ending.drv"; end: drivers;
begin: elements; body: 1, 1, 2., null, diag, 1.,2.,3.; force: 1, absolute, 1, position, null, 1.,0.,0., file, 1, 1; end: elements;
"""


def test_a_run_that_its_deck_has_ended_stays_so_when_an_input_cannot_be_stored(start):
    daemon = start("--checkpoint-interval", "3600")
    limits = resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE)
    with daemon.connect() as server:
        simulation = server.load_bundle("deck", {"deck": ENDING.encode(), "ending.drv": b"0.\n1.\n3.\n"}, durability="journal")
        simulation.run_until(1.0)
        before = simulation.refresh()
        assert (before.state, before.step) == (pb.SIMULATION_STATE_FINISHED, 5)
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (100, limits[1]))
        with pytest.raises(mbcosim.LimitExceeded):
            simulation.step(inputs={"node.structural.1.load": [1, 0, 0, 0, 0, 0]})
        assert simulation.refresh() == before


@pytest.mark.parametrize("durability", ["journal", "checkpoint"])
def test_a_run_that_its_deck_has_ended_stays_so_when_the_daemon_starts_again(start, durability):
    daemon = start("--checkpoint-interval", "3600")
    with daemon.connect() as server:
        simulation = server.load_bundle("deck", {"deck": ENDING.encode(), "ending.drv": b"0.\n1.\n3.\n"}, durability=durability)
        early = simulation.snapshot()
        simulation.run_until(1.0)
        before = simulation.refresh()
    daemon.kill() if durability == "journal" else daemon.stop()
    with start().connect() as server:
        again = server.attach(simulation.name)
        again.read(["step"])
        assert again.refresh() == before and before.state == pb.SIMULATION_STATE_FINISHED
        assert again.step().outcome == "FINISHED" and again.refresh().step == 5
        again.snapshots()[0].restore()
        assert again.refresh().state == pb.SIMULATION_STATE_READY
        assert again.step(3).step == early.step + 3


def test_an_update_that_cannot_be_stored_changes_nothing(start):
    daemon = start("--checkpoint-interval", "3600")
    limits = resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE)
    with daemon.connect() as server:
        simulation = server.load_text(deck(), durability="journal", name="first")
        simulation.step(10)
        before = simulation.refresh()
        change = dict(name="second", policy="cut_step", minimum_step=1e-5, grants=[mbcosim.grant("token:x", "observe")])
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (100, limits[1]))
        with pytest.raises(mbcosim.LimitExceeded) as caught:
            simulation.update(**change)
        assert caught.value.reason == "STORAGE_FULL"
        assert simulation.refresh() == before
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, limits)
        simulation.update(**change)
        after = simulation.refresh()
        assert after.display_name == "second" and len(after.grants) == 1
    daemon.kill()
    with start().connect() as server:
        again = server.attach(simulation.name)
        again.read(["step"])
        assert again.refresh() == after


def test_a_refused_snapshot_leaves_no_file(start, folder):
    """There is room for the snapshot's file, and none for the checkpoint that names it."""
    daemon = start("--checkpoint-interval", "3600")
    limits = resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE)
    with daemon.connect() as server:
        simulation = server.load_text(deck(), durability="journal")
        simulation.step(5)
        simulation.snapshot()

        def files():
            return sorted(path.name for path in (folder / simulation.name).iterdir())
        before, size = files(), (folder / simulation.name / "snapshot-1").stat().st_size
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (size, limits[1]))
        for _ in range(3):
            with pytest.raises(mbcosim.LimitExceeded):
                simulation.snapshot()
        assert [name for name in files() if name.startswith("snapshot")] == ["snapshot-1"]
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, limits)
        simulation.snapshot()
        assert len(files()) == len(before) + 1 and len(simulation.snapshots()) == 2


def test_steps_before_one_that_is_refused_are_stored(start):
    """The call takes ten steps to the final time and is refused the eleventh, beyond it."""
    daemon = start("--checkpoint-interval", "3600")
    text = decks.body(final_time="1.", step="0.01")
    with daemon.connect() as server:
        simulation = server.load_text(text, durability="journal", summed_time=True)
        request = pb.StepRequest(simulation=simulation.name, steps=20, request_id="beyond")
        request.step_size = 0.1
        with pytest.raises(grpc.RpcError) as caught:
            server.simulations.Step(request)
        assert "goes beyond the final time" in caught.value.details()
        assert simulation.refresh().step == simulation.read(["step"])["step"] == 10
        before = bits(simulation)
    daemon.kill()
    with start().connect() as server:
        again = server.attach(simulation.name)
        assert again.info.step == 10 and bits(again) == before


def test_changes_that_cannot_be_stored_are_none(start):
    """The state, its snapshots and what is told of it stay; a repeat of the request does it once the disk has room."""
    daemon = start("--checkpoint-interval", "3600")
    limits = resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE)
    with daemon.connect() as server:
        simulation = server.load_text(deck(), durability="journal")
        name = simulation.name
        simulation.step(5)
        first = simulation.snapshot("first")
        data = first.export()
        simulation.run_until(1e9)
        snapshot = dict(simulation=name, snapshot=first.name)
        state = dict(simulation=name, data=data)
        changes = [("CreateSnapshot", pb.CreateSnapshotRequest(simulation=name)), ("RestoreSnapshot", pb.RestoreSnapshotRequest(**snapshot)),
                   ("ResetSimulation", pb.ResetSimulationRequest(simulation=name)), ("ImportSnapshotInline", pb.ImportSnapshotInlineRequest(**state)),
                   ("ImportSnapshotInline", pb.ImportSnapshotInlineRequest(**state, restore=True)),
                   ("DeleteSnapshot", pb.DeleteSnapshotRequest(**snapshot))]
        for number, (_, request) in enumerate(changes):
            request.request_id = f"change {number}"

        def repeat(method, request):
            return getattr(server.simulations, method)(request)

        def seen():
            return bits(simulation), simulation.refresh(), [(s.name, s.step) for s in simulation.snapshots()]
        before = seen()
        with server.events(name) as events:
            resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (100, limits[1]))
            for method, request in changes:
                with pytest.raises(grpc.RpcError) as caught:
                    repeat(method, request)
                assert caught.value.code() is grpc.StatusCode.RESOURCE_EXHAUSTED and "what was asked cannot be stored" in caught.value.details()
                assert seen() == before, method
            resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, limits)
            replies = [repeat(*change) for change in changes]
            told = list(itertools.islice((event for event in events if not event.HasField("checkpoint")), 7))
        assert told[1].state_changed.state == pb.SIMULATION_STATE_READY
        assert [events_pb2.SnapshotChange.Name(event.snapshot.change).rsplit("_", 1)[-1] for event in told if event.HasField("snapshot")] == [
            "SAVED", "RESTORED", "SAVED", "SAVED", "RESTORED", "DELETED"]
        assert replies[1].simulation.step == 5 and replies[2].simulation.step == 0
        after = seen()
        assert (after[1].step, [step for _, step in after[2]]) == (5, [4000, 5, 5])
    daemon.kill()
    with start().connect() as server:
        assert [repeat(*change) for change in changes] == replies
        simulation = server.attach(name)
        assert seen()[::2] == after[::2]


def test_checkpoints_take_the_journals_place(start, folder):
    with start("--checkpoint-interval", "0.2").connect() as server:
        simulation = server.load_text(deck(), durability="journal")
        for _ in range(20):
            simulation.step(10)
        wait_for(lambda: entries(folder, simulation.name) == [])
        assert simulation.step().step == 201


def test_a_lease_that_ends_suspends_and_leaves_no_journal(start, folder):
    with start().connect() as server:
        simulation = server.load_text(deck(), durability="journal", lease=0.5)
        simulation.step(10)
        wait_for(lambda: state_of(server, simulation.name) == pb.SIMULATION_STATE_SUSPENDED, 20)
        assert entries(folder, simulation.name) == []
        assert simulation.step(5).step == 15
