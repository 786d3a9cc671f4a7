#!/usr/bin/env python3
"""Compares the wall time of two solvers on decks, whole processes with all result files.

usage: whole_process.py FIRST SECOND DECK... [--repeat N] [--json]

FIRST and SECOND are commands in which {deck} and {prefix} stand for the deck and the prefix of the results, for instance
"build/bin/mbcosim run {deck} -o {prefix} -q"; a command without them gets "run {deck} -o {prefix} -q" appended. The runs
of both alternate, each in the deck's folder; the best of N counts. The ratio is FIRST / SECOND: above 1, SECOND is faster.
"""
import argparse
import json
import math
import os
import pathlib
import shlex
import subprocess
import sys
import tempfile
import time


def command_line(command, deck, prefix):
    words = shlex.split(command)
    program = pathlib.Path(words[0])
    if program.exists():  # the runs have the deck's folder as theirs
        words[0] = str(program.resolve())
    if not any("{deck}" in word for word in words):
        words += ["run", "{deck}", "-o", "{prefix}", "-q"]
    return [word.replace("{deck}", deck.name).replace("{prefix}", prefix) for word in words]


def seconds(command, deck, folder):
    line = command_line(command, deck, os.path.join(folder, "result"))
    begin = time.perf_counter()
    done = subprocess.run(line, cwd=deck.parent, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    elapsed = time.perf_counter() - begin
    if done.returncode:
        raise RuntimeError(f"{shlex.join(line)}: exit {done.returncode}\n{done.stderr[-500:]}")
    return elapsed


def compare(first, second, deck, repeat):
    times = ([], [])
    for _ in range(repeat):
        for command, found in zip((first, second), times):
            with tempfile.TemporaryDirectory() as folder:
                found.append(seconds(command, deck, folder))
    return min(times[0]), min(times[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("first")
    parser.add_argument("second")
    parser.add_argument("decks", nargs="+", type=pathlib.Path)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    rows, failed = [], False
    for deck in options.decks:
        try:
            first, second = compare(options.first, options.second, deck.resolve(), options.repeat)
        except (RuntimeError, OSError) as error:
            print(f"{deck}: {error}", file=sys.stderr)
            failed = True
            continue
        rows.append({"deck": str(deck), "first_s": first, "second_s": second, "ratio": first / second})
    if options.json:
        print(json.dumps(rows, indent=1))
    else:
        print(f"{'first (s)':>10} {'second (s)':>10} {'ratio':>7}  deck")
        for row in rows:
            print(f"{row['first_s']:10.4f} {row['second_s']:10.4f} {row['ratio']:7.2f}  {row['deck']}")
        if rows:
            mean = math.exp(sum(math.log(row["ratio"]) for row in rows) / len(rows))
            print(f"{'geometric mean':>21} {mean:7.2f}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
