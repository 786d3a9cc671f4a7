#!/usr/bin/env python3
"""A daemon that is used for long: its memory, threads and descriptors stay what they were.

usage: soak.py [--steps N | --minutes M] [--seed N] [--sanitized]

Eight simulations, four of them with a peer, of all durabilities, each used by a process of its own that steps, couples, subscribes,
saves, restores, forks, writes, exports, comes and goes, in turns of random kind and length. Now and then such a process is killed with
all its streams open. The run has ten phases or more; between two of them nothing is under way, and the daemon is measured. From the
third phase on its threads and descriptors may not grow, nor its memory by more than 5 % and 4 MB. What a client finds wrong (a
step too many, bits that differ after a restore, a refusal) is a fault, too. The programs are in MBCOSIM_BIN
(build/bin). The seed is printed. With --sanitized memory may grow by 512 MB: a sanitizer keeps what was freed, 256 MB of it and more.
"""
import argparse
import faulthandler
import os
import random
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "service"))
import decks  # noqa: E402
import mbcosim  # noqa: E402
from conftest import TIME_FACTOR, Daemon  # noqa: E402

PHASES, SETTLED = 10, 3  # phases of a run; those after which it has all that it keeps
POOLS = ("quick", "work", "advance", "heavy")  # server/rpc/lanes.h
SESSIONS = [(durability, coupled) for coupled in (False, True) for durability in ("none", "checkpoint", "checkpoint", "journal")]
X, V, LOAD = "node.structural.1.X", "node.structural.1.XP", "node.structural.1.load"


def patiently(call):
    """Again while a client that has gone without a word is still taken for there."""
    end = time.monotonic() + 30 * TIME_FACTOR
    while True:
        try:
            return call()
        except mbcosim.PreconditionFailed as error:
            if error.reason not in ("PORT_TAKEN", "SIMULATION_BUSY") or time.monotonic() > end:
                raise
        time.sleep(0.05)


def pull(motion):
    """A damped spring whose other end moves: what is pulled neither flies away nor comes to rest."""
    return [np.sin(0.03 * motion.step) - 10.0 * motion.x[0] - motion.v[0]]


def twig_of(name):
    return f"twig of {name}"


class User:
    """What one client does with one simulation."""

    def __init__(self, address, name, coupled, seed):
        self.address, self.name, self.coupled, self.rolls = address, name, coupled, random.Random(seed)
        self.left = 0
        self.connect()

    def connect(self):
        self.server = mbcosim.connect(self.address, timeout=60)
        self.simulation = self.server.attach(self.name)

    def work(self, steps):
        """At least so many steps, in turns of all kinds; nothing of them is open at the end."""
        self.left = steps
        turns = [self.couple, self.couple_and_subscribe, self.leave_in_the_middle] if self.coupled else \
            [self.plainly, self.rows, self.subscribe, self.again, self.fork, self.push, self.leave_in_the_middle]
        while self.left > 0:
            self.rolls.choice(turns)()
            self.look()
        return steps - self.left

    def look(self):
        """What is not a step."""
        kind = self.rolls.randrange(8)
        if kind == 0:
            self.server.close()
            self.connect()
        elif kind == 1:
            with self.simulation.snapshot("kept for a moment") as saved:
                assert saved.step == self.simulation.refresh().step
        elif kind == 2 and self.simulation.info.durability != mbcosim.v1.simulations_pb2.DURABILITY_NONE:
            assert len(self.simulation.export_checkpoint()) > 500
        elif kind == 3:
            self.simulation.describe()
            assert any(info.name == self.name for info in self.server.list())

    def some(self, most=400):
        return self.rolls.randint(1, 60 if self.coupled else most)

    def step(self, count):
        before = self.simulation.refresh().step
        result = patiently(lambda: self.simulation.step(count))
        assert result.step == before + count, f"{count} steps after {before}: {result}"
        self.left -= count

    def plainly(self):
        for _ in range(10):
            self.step(self.some())

    def rows(self):
        count = self.some()
        assert len(self.simulation.simulate([X, V], steps=count)[X]) == count + 1
        self.left -= count

    def subscribe(self):
        with self.simulation.subscribe([X, "time"], every=self.rolls.choice([1, 7])) as samples:
            self.step(self.some() + 7)
            assert len(next(iter(samples))[2][X]) == 3

    def again(self):
        """Steps again from a snapshot, in other pieces, come to the same bits."""
        count, first = self.some() + 1, None
        with self.simulation.snapshot() as saved:
            for pieces in ([count], [1, count - 1]):
                saved.restore()
                for piece in pieces:
                    self.step(piece)
                found = self.simulation.read([X, V])
                bits = found[X].tobytes(), found[V].tobytes()
                assert first in (None, bits), "other bits after a restore"
                first = bits

    def fork(self):
        with self.simulation.fork(name=twig_of(self.name)) as twig:
            twig.step(self.some())

    def push(self):
        self.simulation.write({LOAD: [self.rolls.uniform(-1, 1), 0, 0, 0, 0, 0]})
        self.step(self.some())
        self.simulation.write({LOAD: np.zeros(6)})

    def peer(self):
        """One on the port, as soon as the server knows that the last one has left."""
        mode = self.rolls.choice(["loose", "staggered", "tight", "window"])
        return patiently(lambda: self.simulation.couple("spring", pull, mode=mode))

    def couple(self):
        with self.peer():
            for _ in range(3):
                self.step(self.some())

    def couple_and_subscribe(self):
        with self.peer(), self.simulation.subscribe([X]) as samples:
            self.step(self.some())
            next(iter(samples))

    def leave_in_the_middle(self):
        """Streams are open, one of them with samples that nobody reads, when the connection ends."""
        self.simulation.subscribe([X])
        if self.coupled:
            self.peer()
        self.step(self.some())
        self.server.close()
        self.connect()


def serve(address, name, coupled, seed):
    """In a process of its own: works as it is told to on its input."""
    faulthandler.register(signal.SIGUSR1)
    user = User(address, name, coupled == "True", int(seed))
    for line in sys.stdin:
        print(user.work(int(line)), flush=True)


class Worker:
    def __init__(self, address, name, coupled, seed):
        self.name, self.arguments = name, [address, name, str(coupled)]
        self.start(seed)

    def start(self, seed):
        self.process = subprocess.Popen([sys.executable, os.path.abspath(__file__), "--serve", *self.arguments, str(seed)],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def tell(self, steps):
        self.process.stdin.write(f"{steps}\n")
        self.process.stdin.flush()

    def done(self):
        """Steps that it has done."""
        line = self.process.stdout.readline()
        if not line:
            raise AssertionError(f"the client of {self.name} failed")
        return int(line)

    def end(self):
        """Lets it go. What is wrong with that, or None."""
        self.process.stdin.close()
        self.process.stdout.close()
        try:
            code = self.process.wait(30 * TIME_FACTOR)
        except subprocess.TimeoutExpired:
            return self.stuck()
        return f"the client of {self.name} ended with {code}" if code not in (0, -signal.SIGKILL) else None

    def stuck(self):
        """It does not end: where its threads stand goes to the standard error, by Python and by the kernel."""
        pid = self.process.pid
        print(f"threads of the client of {self.name}:", *where(pid), sep="\n", file=sys.stderr, flush=True)
        self.process.send_signal(signal.SIGUSR1)
        time.sleep(1)
        self.process.kill()
        self.process.wait()
        return f"the client of {self.name} had done its work and did not end"

    def die(self, seed):
        self.process.kill()
        self.end()
        self.start(seed)


def where(pid):
    """Name, system call and place in the kernel of each thread."""
    for task in os.listdir(f"/proc/{pid}/task"):
        told = []
        for file in ("comm", "syscall", "wchan"):
            try:
                with open(f"/proc/{pid}/task/{task}/{file}") as opened:
                    told.append(opened.read().strip())
            except OSError as error:  # it has ended, or this is not told here
                told.append(str(error))
        yield "  ".join([task, *told])


def names_of_threads(pid):
    names = []
    for task in os.listdir(f"/proc/{pid}/task"):
        try:
            with open(f"/proc/{pid}/task/{task}/comm") as file:
                names.append(file.read().strip())
        except OSError:  # it has ended
            pass
    return names


def measure(pid):
    """Anonymous memory [bytes], threads, descriptors: the least of some looks, for what ends meanwhile. Threads of the work pools,
    which are bounded and outlive their work by a while, are not counted."""
    def look():
        with open(f"/proc/{pid}/status") as file:
            memory = int(next(line for line in file if line.startswith("RssAnon")).split()[1]) << 10
        return memory, sum(name not in POOLS for name in names_of_threads(pid)), len(os.listdir(f"/proc/{pid}/fd"))

    looks = []
    for _ in range(6):
        time.sleep(0.5)
        looks.append(look())
    return tuple(min(values) for values in zip(*looks))


def create(server):
    plain = decks.body(final_time="1.e6")
    open_ended = decks.OSCILLATOR.replace("final time: 10.", "final time: 1.e6").replace("joints: 2", "joints: 1")
    free = open_ended[:open_ended.index("  joint: 2,")] + open_ended[open_ended.index("end: elements;"):]
    for durability, coupled in SESSIONS:
        ports = [mbcosim.structural_port("spring", nodes=[1])] if coupled else ()
        yield server.load_text(free if coupled else plain, durability=durability, ports=ports).name, coupled


def phase(workers, steps, rolls):
    """All work at once; one of them dies in the middle and another takes its place."""
    for worker in workers:
        worker.tell(steps)
    time.sleep(rolls.uniform(0.2, 1.0))
    victim = rolls.choice(workers)
    victim.die(rolls.randrange(1 << 30))
    victim.tell(steps)
    return sum(worker.done() for worker in workers), victim.name


def left_over(server, names, victims):
    """Simulations that are lost or that nobody should have left. A client that is killed within `fork` cannot delete its twig."""
    twigs = [twig_of(name) for name in victims]
    listed = server.list()
    for name in set(names) - {info.name for info in listed}:
        yield f"{name} is lost"
    for info in listed:
        if info.display_name in twigs:
            twigs.remove(info.display_name)
        elif info.name not in names:
            yield f"{info.name} ({info.display_name or 'without a name'}) is left over"


def faults_of(measures, sanitized):
    settled, last = measures[SETTLED - 1:], measures[-1]
    memory = settled[0][0]
    if last[0] > 1.05 * memory + ((512 if sanitized else 4) << 20):
        yield f"memory grew from {memory >> 10} kB to {last[0] >> 10} kB"
    for what, at in (("threads", 1), ("descriptors", 2)):
        if last[at] > max(values[at] for values in measures[:SETTLED]) + 2:
            yield f"{last[at]} {what}, {measures[SETTLED - 1][at]} before"


def soak(daemon, options):
    rolls, total, measures, victims, start = random.Random(options.seed), 0, [], [], time.monotonic()
    with daemon.connect() as server:
        workers = [Worker(daemon.address, name, coupled, rolls.randrange(1 << 30)) for name, coupled in create(server)]
        steps = -(-options.steps // PHASES // len(workers))
        while len(measures) < PHASES or time.monotonic() - start - 60 * options.minutes < 0:
            done, victim = phase(workers, steps, rolls)
            total += done
            victims.append(victim)
            measures.append(measure(daemon.process.pid))
            memory, threads, descriptors = measures[-1]
            print(f"{time.monotonic() - start:7.0f} s {total:9} steps {memory >> 10:8} kB {threads:4} threads {descriptors:4} descriptors",
                  flush=True)
        faults = [fault for fault in [worker.end() for worker in workers] if fault]
        faults += left_over(server, [worker.name for worker in workers], victims)
    return faults + list(faults_of(measures, options.sanitized))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--minutes", type=float, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sanitized", action="store_true")
    options = parser.parse_args()
    print(f"seed {options.seed}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        state = os.path.join(folder, "state")
        os.mkdir(state)
        daemon = Daemon(folder, "--state-dir", state, "--checkpoint-interval", "0.2")
        try:
            faults = soak(daemon, options)
        finally:
            daemon.stop()
        faults += [line for line in daemon.log().splitlines() if "uncaught" in line or "internal error" in line]
    for fault in faults:
        print("FAULT", fault)
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(*sys.argv[2:])
    else:
        main()
