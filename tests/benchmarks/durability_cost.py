#!/usr/bin/env python3
"""What durability CHECKPOINT costs beside NONE. usage: durability_cost.py BIN [--turns N] [--seconds S] [--simulations N] [--steps N] [--folder DIR]

Four daemons with as many simulations each and clients that ask for steps without pause: NONE, NONE once more, CHECKPOINT every 10 s and CHECKPOINT
every 0.1 s. They run by turns, the others being stopped (SIGSTOP), once a round and in an order that changes: what else the machine does counts
alike on them, and all stand still as long. A turn gives steps per second of the wall clock and of the daemon's processor time; its cost is
what is missing to the turn of NONE in the same round. Told are the median of the costs with the interval that holds it with 95 %, the same of NONE beside NONE,
which is what the figures can tell apart, and the checkpoints that there were and that there should have been.

A stopped daemon's clock runs on: the interval of 10 s is counted in seconds in which it runs, which are one in four.
Simulations are created spread over the interval, so that each turn has its share of checkpoints. --folder: where they are stored; the disk
matters. Of the time in the kernel only what the daemon's own calls take is counted.
"""
import argparse
import math
import os
import random
import signal
import socket
import statistics
import sys
import tempfile
import time
import urllib.request

from many_simulations import Clients, Daemon, pendulum
from mbcosim.v1 import simulations_pb2 as pb

KINDS = {"NONE": None, "NONE once more": None, "CHECKPOINT every 10 s": 10.0, "CHECKPOINT every 0.1 s": 0.1}


def free_port():
    with socket.socket() as some:
        some.bind(("127.0.0.1", 0))
        return some.getsockname()[1]


class Side:
    """A daemon with its simulations and clients; it runs in its turns only."""

    def __init__(self, options, folder, name, interval):
        self.name, self.interval, self.count = name, interval, options.simulations
        self.ran = self.stored = 0.0  # seconds, checkpoints
        place = os.path.join(folder, name.replace(" ", "-"))
        os.makedirs(os.path.join(place, "state"))
        self.metrics = f"127.0.0.1:{free_port()}"
        self.daemon = Daemon(options.bin, place, "--state-dir", os.path.join(place, "state"), "--metrics", self.metrics)
        self.clock = ~self.daemon.process.pid << 3 | 2  # of a process: clock_getcpuclockid(3)
        self.clients = Clients(self.daemon.address, list(self.simulations(options)), options.simulations, options.steps)

    def simulations(self, options):
        how, pause = {"durability": pb.DURABILITY_NONE}, 0.0
        if self.interval:
            longer = self.interval > options.seconds  # than a turn
            told = self.interval * len(KINDS) if longer else self.interval
            pause = told / self.count if longer else 0.0
            how = {"durability": pb.DURABILITY_CHECKPOINT, "checkpoint_interval": {"seconds": int(told), "nanos": int(told % 1 * 1e9)}}
        for _ in range(self.count):
            yield self.daemon.create(pendulum(), **how)
            time.sleep(pause)

    def checkpoints(self):
        """That were taken so far."""
        text = urllib.request.urlopen(f"http://{self.metrics}/metrics", timeout=60).read().decode()
        return float(next(line for line in text.splitlines() if line.startswith("mbcosim_checkpoint_seconds_count")).split()[1])

    def stop(self):
        self.daemon.process.send_signal(signal.SIGSTOP)

    def turn(self, seconds):
        """Steps per second of the wall clock, and of the daemon's processor time."""
        self.daemon.process.send_signal(signal.SIGCONT)
        before, start, work = self.checkpoints(), time.monotonic(), time.clock_gettime(self.clock)
        rate, _ = self.clients.run(seconds)
        took, work = time.monotonic() - start, time.clock_gettime(self.clock) - work
        self.stored += self.checkpoints() - before
        self.ran += took
        self.stop()
        return rate, rate * took / work

    def end(self):
        self.daemon.process.send_signal(signal.SIGCONT)
        self.clients.end()
        self.daemon.end()


def median_within(values):
    """Median, and the values between which it lies with 95 %, by the order of the sample."""
    values, n = sorted(values), len(values)
    below = 0
    while below < n // 2 and sum(math.comb(n, k) for k in range(below + 1)) <= 0.025 * 2 ** n:
        below += 1
    return statistics.median(values), values[max(below - 1, 0)], values[min(n - below, n - 1)]


def measure(options, sides):
    """Rates (wall, processor) of each side, round by round."""
    rolls, rates, order = random.Random(1), {side.name: [] for side in sides}, list(sides)
    for side in sides:
        side.turn(options.seconds)  # to be warm
    for _ in range(options.turns):
        rolls.shuffle(order)
        for side in order:
            rates[side.name].append(side.turn(options.seconds))
    return rates


def tell(sides, rates):
    for side in sides[1:]:
        found = []
        for what in (0, 1):
            lacks = [1 - rate[what] / none[what] for rate, none in zip(rates[side.name], rates["NONE"])]
            found.append("{:+.2%} ({:+.2%} to {:+.2%})".format(*median_within(lacks)))
        due = side.count * side.ran / side.interval if side.interval else 0
        print(f"{side.name}: wall {found[0]}, processor {found[1]}; {side.stored:.0f} checkpoints, at most {due:.0f} due in {side.ran:.0f} s", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("bin")
    parser.add_argument("--turns", type=int, default=90, help="of each kind")
    parser.add_argument("--seconds", type=float, default=0.5, help="of a turn")
    parser.add_argument("--simulations", type=int, default=64, help="of each kind")
    parser.add_argument("--steps", type=int, default=300, help="of a call")
    parser.add_argument("--folder")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        sides = []
        try:
            for name, interval in KINDS.items():
                sides.append(Side(options, folder, name, interval))
                sides[-1].stop()
            tell(sides, measure(options, sides))
        finally:
            for side in sides:
                side.end()


if __name__ == "__main__":
    main()
