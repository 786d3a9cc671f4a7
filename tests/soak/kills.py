#!/usr/bin/env python3
"""A daemon that is killed again and again: simulations of all durabilities go on bit for bit, and nothing is lost that was promised.

usage: kills.py [--kills N | --minutes M] [--seed N] [--damage-every N] [--again-every N]

On one state folder live simulations with journals (plain, with loose, staggered, tight and window peers), with checkpoints only (plain and
with a peer), and with durability NONE. All are stepped at once, by requests of random length that are repeated until they are answered;
somebody polls, reads, watches events and subscribes; checkpoints are written every 50 ms. Beside them others come and go (restless.py). At a
random moment comes SIGKILL, and the next daemon starts; every few rounds it is killed as well, within its first 100 ms or while all are being
woken. Then

* one with a journal stands where anybody was told, or later, and no request is done twice,
* one with checkpoints stands at the last one that is on the disk, or later,
* those of durability NONE are gone, and so is what was deleted, while what was made or saved is there,
* no folder was put aside as damaged,
* and each has the bits of its twin, which was stepped straight to there on a daemon that nobody kills.

Every few kills files are damaged as well: a journal's last entry torn anywhere, or a random bit flipped in any file. A torn entry takes its
simulation back to the entry before; a flip is named in the log with file and record, its simulation is put aside, and the others are
served. Then the files are put back. The programs are in MBCOSIM_BIN (build/bin). The seed is printed; the same one gives the same
requests, though not the same moments.
"""
import argparse
import os
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "service"))
from conftest import BIN, Daemon  # noqa: E402
from mbcosim.v1 import checkpoints_pb2, simulations_pb2 as pb  # noqa: E402
from test_durable import bits, deck, on_disk  # noqa: E402
from restless import Restless, Twin  # noqa: E402
from soak import pull  # noqa: E402
from test_journal import LOST, Spring, Watcher, coupled  # noqa: E402

HEADER = 16  # bytes of a record before its content


class Pull(Spring):
    """As that of the tests of journals, and stable for as long as one likes."""

    def answer(self, motion):
        super().answer(motion)
        return pull(motion)


class Candidate:
    """A simulation that is killed, and its twin that is not."""

    def __init__(self, kind, durability, coupling=None):
        self.kind, self.durability, self.coupling = kind, durability, coupling
        self.name, self.twin, self.number, self.faults = "", None, 0, []

    def create(self, server, calm):
        self.name = self._load(server, self.durability).name
        self.due, self.told, self.unanswered = 0, 0, None
        self.peer = Pull(**self.coupling) if self.coupling else None
        if self.durability != "none" and not self.twin:
            self.twin = self._load(calm, "none")
            if self.coupling:
                Pull(**self.coupling).couple(self.twin)

    def _load(self, server, durability):
        return coupled(server, durability) if self.coupling else server.load_text(deck(1_000_000_000), durability=durability)

    def run(self, server, killed, rolls):
        """Steps until the daemon is killed; `killed` is set just before."""
        with server:
            attached = None
            try:
                if self.peer:
                    attached = self.peer.couple(server.attach(self.name))
                while True:
                    self._ask(server, rolls)
            except LOST as error:
                if not killed.is_set():
                    self.faults.append(f"{self.kind}: {error!r}")
            try:
                if attached:
                    attached.close()
            except LOST:
                pass

    def _ask(self, server, rolls):
        if not self.unanswered:
            self.number += 1
            steps = rolls.choice([1, 2, 7] if self.coupling else [1, 1, 3, 40, 400])
            self.unanswered = pb.StepRequest(simulation=self.name, steps=steps, request_id=f"request {self.number}")
            self.due += steps
        reply = server.simulations.Step(self.unanswered)
        if reply.step != self.due:
            self.faults.append(f"{self.kind}: step {reply.step} instead of {self.due}: a request was done twice, or not whole")
        self.told, self.unanswered = self.due, None

    def check(self, server, stored, seen):
        """After a restart: does it stand where it must, with the bits of its twin?"""
        again = server.attach(self.name)
        step = int(again.read(["step"])["step"])
        if self.durability == "journal":
            least = max(self.told, seen, self.peer.seen if self.peer else 0)
        else:
            least = stored
        if not least <= step <= self.due:
            self.faults.append(f"{self.kind}: it stands at step {step}, must be in {least} to {self.due}")
        if self.durability == "checkpoint":  # what came later is lost, and nobody asks for it again
            self.due, self.unanswered = step, None
            if self.peer:
                self.peer.seen = step  # it goes back, too, or it is refused
        self.twin.step(step - self.twin.refresh().step)
        if bits(again) != bits(self.twin):
            self.faults.append(f"{self.kind}: other bits at step {step}")


def candidates():
    yield Candidate("journal", "journal")
    yield Candidate("another journal", "journal")
    for mode in ("loose", "staggered", "tight", "window"):
        yield Candidate(f"journal with a {mode} peer", "journal", {"mode": mode})
    yield Candidate("checkpoints", "checkpoint")
    yield Candidate("checkpoints with a peer", "checkpoint", {"mode": "loose", "every": 3, "hold": "quadratic"})
    yield Candidate("nothing", "none")


class Ordeal:
    def __init__(self, folder, options):
        self.folder, self.state, self.rolls, self.faults = Path(folder), Path(folder, "state"), random.Random(options.seed), []
        self.state.mkdir()
        self.started = 0
        self.calm = self._daemon()
        self.calm_server = self.calm.connect()
        self.all = list(candidates())
        self.restless, self.restless_twin = [Restless("journal"), Restless("checkpoint")], Twin(self.calm_server)
        self.damages = {"torn": 0, "flipped": 0}
        self.again = 0
        self.daemon = self.start()
        self.create(self.all)

    def create(self, candidates):
        with self.daemon.connect() as server:
            for candidate in candidates:
                candidate.create(server, self.calm_server)

    def _daemon(self, *options):
        self.started += 1
        own = self.folder / f"d{self.started}"
        own.mkdir()
        return Daemon(str(own), *options)

    def start(self):
        return self._daemon(*self._options())

    def _options(self):
        return "--state-dir", str(self.state), "--checkpoint-interval", "0.05"

    def restart(self):
        self._end()
        self.daemon = self.start()

    def _end(self):
        self.daemon.kill()
        self.daemon.stop()
        shutil.rmtree(os.path.dirname(self.daemon.log_path))

    def kill_again(self):
        """The next daemon comes no further than its beginning, or to where all are being woken."""
        if self.rolls.random() < 0.5:
            self._end()
            address = f"unix:{self.folder}/again.sock"
            process = subprocess.Popen([os.path.join(BIN, "mbcosimd"), "--listen", address, *self._options()], stderr=subprocess.DEVNULL)
            time.sleep(self.rolls.uniform(0, 0.1))
            process.kill()
            process.wait()
            self.daemon = self.start()
        else:
            self.restart()
            with self.daemon.connect() as server:
                waking = [server.simulations.ReadVariables.future(pb.ReadVariablesRequest(simulation=info.name)) for info in server.list()]
                time.sleep(self.rolls.uniform(0, 0.1))
                self.daemon.kill()
                for call in waking:
                    call.exception()
            self.restart()
        self.again += 1

    def stored(self, candidate):
        return on_disk(self.state, candidate.name) if candidate.durability == "checkpoint" else 0

    def round(self, again):
        """All step until the kill, or two kills (`again`); then all are looked at."""
        self.create(candidate for candidate in self.all if candidate.durability == "none")
        killed = threading.Event()
        threads = [threading.Thread(target=candidate.run, args=(self.daemon.connect(), killed, random.Random(self.rolls.random())))
                   for candidate in self.all + self.restless]
        watched = self.rolls.choice([candidate for candidate in self.all if candidate.durability == "journal"])
        watcher = Watcher(self.daemon, watched.name, subscribes=self.rolls.random() < 0.3)
        for thread in threads:
            thread.start()
        time.sleep(self.rolls.uniform(0.02, 0.5))
        stored = {candidate: self.stored(candidate) for candidate in self.all}
        killed.set()
        self.daemon.kill()
        for thread in threads:
            thread.join(60)
        seen = watcher.end()
        if again:
            self.kill_again()
        else:
            self.restart()
        said = [line for line in self.daemon.log().splitlines() if "put aside" in line]
        self.faults += [f"{path.name} was put aside: {said}" for path in self.state.glob("simulations/*.damaged")]
        with self.daemon.connect() as server:
            there = {info.name for info in server.list()}
            for candidate in self.all:
                if (candidate.name in there) == (candidate.durability == "none"):
                    self.faults.append(f"{candidate.kind}: it is {'still' if candidate.name in there else 'no longer'} there")
                elif candidate.durability != "none":
                    candidate.check(server, stored[candidate], seen if candidate is watched else 0)
            for owner in self.restless:
                owner.check(server, self.restless_twin)

    def damage(self):
        """Files are damaged, a daemon is asked what it says to that, and the files are put back."""
        self.daemon.kill()
        copy = self.folder / "copy"
        shutil.copytree(self.state, copy)
        self.rolls.choice([self.tear, self.flip])()
        self.daemon.kill()
        shutil.rmtree(self.state)
        copy.rename(self.state)
        self.restart()

    def journal_of(self, candidate):
        return sorted((self.state / candidate.name).glob("journal-*"), key=lambda path: int(path.name.split("-")[1]))

    def tear(self):
        """The last entry of a journal ends somewhere."""
        with_entries = [c for c in self.all if c.durability == "journal" and any(len(records(path)) > 1 for path in self.journal_of(c))]
        if not with_entries:
            return
        candidate = self.rolls.choice(with_entries)
        path = [path for path in self.journal_of(candidate) if len(records(path)) > 1][-1]
        at, _ = records(path)[-1]
        os.truncate(path, self.rolls.randrange(at, path.stat().st_size))
        expected = max([on_disk(self.state, candidate.name)] + [step for path in self.journal_of(candidate) for step in entry_steps(path)])
        self.restart()
        with self.daemon.connect() as server:
            step = int(server.attach(candidate.name).read(["step"])["step"])
            if step != expected:
                self.faults.append(f"{candidate.kind}: with its last entry torn it stands at step {step}, not {expected}")
        self.damages["torn"] += 1

    def flip(self):
        """One bit of any file."""
        candidate = self.rolls.choice([c for c in self.all if c.durability != "none"])
        path = self.rolls.choice([path for path in (self.state / candidate.name).iterdir() if path.stat().st_size > 0])
        promised = path.suffix != ".new"  # a file that the kill met before it got its name
        data = bytearray(path.read_bytes())
        at = self.rolls.randrange(len(data))
        data[at] ^= 1 << self.rolls.randrange(8)
        path.write_bytes(data)
        self.restart()
        with self.daemon.connect() as server:
            there = {info.name for info in server.list()}
            if promised and candidate.name in there:
                self.faults.append(f"{candidate.kind}: a flipped bit at byte {at} of {path.name} was not found")
            if not promised and candidate.name not in there:
                self.faults.append(f"{candidate.kind}: damage to {path.name}, which nothing was promised of, stops it")
            for other in self.all:
                if other.durability != "none" and other is not candidate and other.name not in there:
                    self.faults.append(f"{other.kind}: damage to another simulation stops it")
        named = f"{candidate.name.split('/')[1]}/{path.name}: record "
        if promised and named not in self.daemon.log():
            self.faults.append(f"{candidate.kind}: the log does not name {path.name}")
        self.damages["flipped"] += 1

    def collect(self):
        for candidate in self.all + self.restless:
            self.faults += candidate.faults
            candidate.faults = []
        return self.faults

    def end(self):
        self.daemon.stop()
        self.calm_server.close()
        self.calm.kill()
        self.calm.stop()


def records(path):
    """(place, whole length) of each record of a file."""
    data, at, found = path.read_bytes(), 0, []
    while at + HEADER <= len(data):
        whole = HEADER + int.from_bytes(data[at + 4:at + 12], "little")
        found.append((at, whole))
        at += whole
    return [(at, whole) for at, whole in found if at + whole <= len(data)]


def entry_steps(path):
    """The steps that the whole entries of a journal tell of."""
    data = path.read_bytes()
    for at, whole in records(path)[1:]:
        content = data[at + HEADER:at + whole]
        size = int.from_bytes(content[8:16], "little")
        yield checkpoints_pb2.JournalEntry.FromString(content[16:16 + size]).info.step


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--kills", type=int, default=1000)
    parser.add_argument("--minutes", type=float, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--damage-every", type=int, default=5)
    parser.add_argument("--again-every", type=int, default=5)
    options = parser.parse_args()
    print(f"seed {options.seed}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        ordeal, start, kills = Ordeal(folder, options), time.monotonic(), 0
        try:
            while (time.monotonic() - start - 60 * options.minutes < 0 if options.minutes else kills < options.kills) and not ordeal.faults:
                kills += 1
                ordeal.round(again=kills % options.again_every == 0)
                if kills % options.damage_every == 0:
                    ordeal.damage()
                ordeal.collect()
                if kills % 50 == 0:
                    report(ordeal, kills, start)
        finally:
            ordeal.end()
        report(ordeal, kills, start)
    for fault in ordeal.faults:
        print("FAULT", fault)
    sys.exit(1 if ordeal.faults else 0)


def report(ordeal, kills, start):
    steps = sum(candidate.due for candidate in ordeal.all)
    turns = sum(owner.turns for owner in ordeal.restless)
    print(f"{time.monotonic() - start:6.0f} s {kills:5} kills while they stepped, {ordeal.again} soon after, {ordeal.damages['torn']} torn entries, "
          f"{ordeal.damages['flipped']} flipped bits, {steps} steps, {turns} turns of what comes and goes", flush=True)


if __name__ == "__main__":
    main()
