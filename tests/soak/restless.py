"""Simulations that come and go while the daemon is killed: made, forked, stepped, saved, suspended by their leases, woken and deleted."""
import time

from google.protobuf.duration_pb2 import Duration

from mbcosim.v1 import simulations_pb2 as pb
from test_durable import bits, deck
from test_journal import LOST

MOST = 6  # of one owner at once
DECK = deck(1_000_000_000)


class Kept:
    """What the owner was told of a simulation."""

    def __init__(self, told=0):
        self.told = self.due = told
        self.saved = {}  # steps of snapshots by name


class Restless:
    """An owner of such simulations, and what is wrong with them after a kill. `Twin` has their bits."""

    def __init__(self, durability):
        self.kind, self.durability, self.faults = f"coming and going, with {durability}", durability, []
        self.known, self.leaving, self.gone, self.turns = {}, set(), set(), 0

    def run(self, server, killed, rolls):
        """Turns of all kinds until the daemon is killed; `killed` is set just before. By bare calls, which nobody repeats."""
        with server:
            try:
                while True:
                    rolls.choice([self._create, self._fork, self._step, self._step, self._save, self._forget, self._delete, self._wait])(
                        server.simulations, rolls)
                    self.turns += 1
            except LOST as error:
                if not killed.is_set():
                    self.faults.append(f"{self.kind}: {error!r}")

    def _options(self, rolls):
        lease = Duration(nanos=150_000_000) if rolls.random() < 0.5 else Duration(seconds=3600)
        return pb.CreateOptions(display_name=self.kind, lease=lease,
                                durability=pb.DURABILITY_JOURNAL if self.durability == "journal" else pb.DURABILITY_CHECKPOINT)

    def _one(self, rolls):
        return rolls.choice(sorted(self.known)) if self.known else None

    def _create(self, stub, rolls):
        if len(self.known) >= MOST:
            return
        header = pb.UploadHeader(bundle_main_file="deck", options=self._options(rolls))
        messages = [pb.UploadRequest(header=header), pb.UploadRequest(chunk={"path": "deck", "data": DECK.encode()})]
        self.known[stub.CreateSimulation(iter(messages)).simulation.name] = Kept()

    def _fork(self, stub, rolls):
        name = self._one(rolls)
        if not name or len(self.known) >= MOST:
            return
        saved = self.known[name].saved
        snapshot = rolls.choice(sorted(saved)) if saved and rolls.random() < 0.5 else ""
        made = stub.ForkSimulation(pb.ForkSimulationRequest(simulation=name, snapshot=snapshot or None, options=self._options(rolls))).simulation
        expected = saved[snapshot] if snapshot else self.known[name].told
        if made.step != expected:
            self.faults.append(f"{self.kind}: a fork stands at step {made.step} instead of {expected}")
        self.known[made.name] = Kept(made.step)

    def _step(self, stub, rolls):
        name = self._one(rolls)
        if not name:
            return
        kept = self.known[name]
        steps = rolls.choice([1, 3, 40])
        kept.due = kept.told + steps
        kept.told = stub.Step(pb.StepRequest(simulation=name, steps=steps)).step
        if kept.told != kept.due:
            self.faults.append(f"{self.kind}: step {kept.told} instead of {kept.due}")

    def _save(self, stub, rolls):
        name = self._one(rolls)
        if name:
            saved = stub.CreateSnapshot(pb.CreateSnapshotRequest(simulation=name)).snapshot
            self.known[name].saved[saved.name] = saved.step

    def _forget(self, stub, rolls):
        name = self._one(rolls)
        if name and (saved := self.known[name].saved):
            snapshot = rolls.choice(sorted(saved))
            del saved[snapshot]
            stub.DeleteSnapshot(pb.DeleteSnapshotRequest(simulation=name, snapshot=snapshot))

    def _delete(self, stub, rolls):
        name = self._one(rolls)
        if not name or len(self.known) < 3:
            return
        del self.known[name]
        self.leaving.add(name)
        stub.DeleteSimulation(pb.DeleteSimulationRequest(simulation=name))
        self.leaving.remove(name)
        self.gone.add(name)

    def _wait(self, stub, rolls):
        """Until leases are over, or about to be."""
        time.sleep(rolls.choice([0.01, 0.15, 0.25]))

    def check(self, server, twin):
        """After a restart: what was made is there as it was told, what was deleted is not. What nobody was told of may be either."""
        there = {info.name for info in server.list() if info.display_name == self.kind}
        self.faults += [f"{self.kind}: {name} is no longer there" for name in sorted(self.known.keys() - there)]
        self.faults += [f"{self.kind}: {name} is there again" for name in sorted(self.gone & there)]
        self.leaving.clear()
        for name in there:
            kept = self.known.setdefault(name, None)
            self.known[name] = self._look(server.attach(name), kept, twin)

    def _look(self, simulation, kept, twin):
        """The state of one, against what was told of it (`None`: nothing was); what is known of it now."""
        step = int(simulation.read(["step"])["step"])
        saved = {snapshot.name: snapshot.step for snapshot in simulation.snapshots()}
        if kept:
            least = kept.told if self.durability == "journal" else 0
            if not least <= step <= kept.due:
                self.faults.append(f"{self.kind}: {simulation.name} stands at step {step}, must be in {least} to {kept.due}")
            if self.durability == "journal" and not kept.saved.items() <= saved.items():
                self.faults.append(f"{self.kind}: {simulation.name} has the snapshots {saved}, must have {kept.saved}")
        if bits(simulation) != twin.bits_at(step):
            self.faults.append(f"{self.kind}: {simulation.name} has other bits at step {step}")
        now = Kept(step)
        now.saved = saved
        return now


class Twin:
    """The same simulation on a daemon that nobody kills."""

    def __init__(self, server):
        self._simulation = server.load_text(DECK, durability="none")
        self._start = self._simulation.snapshot()

    def bits_at(self, step):
        self._start.restore()
        if step:
            self._simulation.step(step)
        return bits(self._simulation)
