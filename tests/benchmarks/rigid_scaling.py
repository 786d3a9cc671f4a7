#!/usr/bin/env python3
"""Processor time of rigid mechanisms, whole processes: small decks with all text files, then chains of growing length with
the time of one Newton iteration and of the start against the number of bodies and the fitted exponents.

usage: rigid_scaling.py BINARY [--sizes 10,100,1000,10000] [--repeat 3] [--limit 1.05]

The iterations of a step depend on the size only through the norm of the residual, which is not divided by the number of
equations; hence the time of an iteration. The time is that of the processor (user and system), the best of the repeated
runs; exponents are fitted on the sizes of 100 bodies and more. Fails when that of the iteration exceeds the limit.
"""
import argparse
import math
import os
import pathlib
import resource
import subprocess
import sys
import tempfile

import rigid_models


def processor_seconds(binary, deck, prefix):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([binary, "run", deck, "-o", prefix, "-q"], stderr=subprocess.PIPE, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        sys.exit(f"{deck}: exit {done.returncode}\n{done.stderr[-500:]}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def best(binary, text, folder, repeat):
    deck, prefix = os.path.join(folder, "deck.mbd"), os.path.join(folder, "result")
    pathlib.Path(deck).write_text(text)
    seconds = min(processor_seconds(binary, deck, prefix) for _ in range(repeat))
    steps = [line.split() for line in open(prefix + ".out") if line.startswith("Step")]
    return seconds, len(steps) - 1, sum(int(fields[4]) for fields in steps[1:])


def exponent(points):
    points = [(math.log(n), math.log(t)) for n, t in points if n >= 100]
    if len(points) < 2:
        return math.nan
    mean_x, mean_y = (sum(p[i] for p in points) / len(points) for i in (0, 1))
    return sum((x - mean_x) * (y - mean_y) for x, y in points) / sum((x - mean_x) ** 2 for x, _ in points)


def scaling(binary, kind, sizes, folder, repeat):
    starts, iterations = [], []
    for bodies in sizes:
        steps = max(10, min(2000, 20000 // bodies))
        start, _, first = best(binary, rigid_models.chain(bodies, kind, 1), folder, repeat)
        total, _, count = best(binary, rigid_models.chain(bodies, kind, 1 + steps), folder, repeat)
        starts.append((bodies, start))
        iterations.append((bodies, (total - start) / (count - first)))
        print(f"{kind:>10} {bodies:7d} {1e3 * start:11.1f} {1e6 * iterations[-1][1]:15.1f} "
              f"{1e6 * iterations[-1][1] / bodies:15.3f} {(count - first) / steps:14.2f}", flush=True)
    fitted = exponent(iterations)
    print(f"{kind:>10} exponents: start {exponent(starts):.3f}, iteration {fitted:.3f}")
    return fitted


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary")
    parser.add_argument("--sizes", default="10,100,1000,10000")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--limit", type=float, default=1.05)
    options = parser.parse_args()
    sizes = [int(size) for size in options.sizes.split(",")]
    with tempfile.TemporaryDirectory() as folder:
        print(f"{'model':>14} {'process (ms)':>12} {'steps':>6} {'us a step':>10}")
        for name, text in rigid_models.MODELS.items():
            seconds, steps, _ = best(options.binary, text(), folder, options.repeat)
            print(f"{name:>14} {1e3 * seconds:12.1f} {steps:6d} {1e6 * seconds / steps:10.1f}")
        print(f"\n{'chain':>10} {'bodies':>7} {'start (ms)':>11} {'iteration (us)':>15} {'a body (us)':>15} {'iterations/step':>14}")
        worst = max(scaling(options.binary, kind, sizes, folder, options.repeat)
                    for kind in ("spherical", "revolute", "total"))
    return 1 if worst > options.limit else 0


if __name__ == "__main__":
    sys.exit(main())
