#!/usr/bin/env python3
"""Our factorization and solution of a Newton iteration's matrix beside KLU, SuperLU and MUMPS, on one thread.

usage: newton_libraries.py NEWTON_LIBRARIES MODEL... [--blas FOLDER] [--methods NAME ...] [--repeat N]

NEWTON_LIBRARIES is the program of that name, whose source tells the packages that it needs and what it measures. MODEL is a number of
three-node beams in a cantilever, or the shape of a grid of two-node beams: 100x100, 8x8x8. Each method runs in a process of its own, by
turns; times are medians. `--blas` is the folder of the libblas.so.3 that SuperLU and MUMPS use, such as
/usr/lib/x86_64-linux-gnu/openblas-serial. Prints a Markdown table for each model, and the whole iteration over the library whose
factorization and solution are the fastest.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

import beam_models

METHODS = ["ours", "klu:amd", "klu:colamd", "superlu:mmd", "superlu:colamd", "mumps"]
COLUMNS = {"first": ("first [ms]", 1e3), "factor": ("factor [ms]", 1e3), "solve": ("solve [ms]", 1e3), "both": ("factor and solve [ms]", 1e3),
           "memory": ("memory [MB]", 1), "error": ("error", 1)}


def model_of(text, folder):
    """The program's argument: a deck."""
    path = folder / f"{text}.mbd"
    path.write_text(beam_models.grid(tuple(map(int, text.split("x"))), 3) if "x" in text else beam_models.cantilever(int(text), 3))
    return str(path)


def measured(program, model, method, environment):
    done = subprocess.run([program, model, method], stdout=subprocess.PIPE, env=environment, check=False)
    if done.returncode != 0:
        return None
    found = json.loads(done.stdout)
    return {**found, "both": found["factor"] + found["solve"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("models", nargs="+")
    parser.add_argument("--blas", default="")
    parser.add_argument("--methods", nargs="+", default=METHODS)
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    if options.blas:
        environment["LD_LIBRARY_PATH"] = options.blas
    for text in options.models:
        with tempfile.TemporaryDirectory() as temporary:
            model = model_of(text, pathlib.Path(temporary))
            runs = {method: [] for method in options.methods}
            for _ in range(options.repeat):
                for method, found in runs.items():
                    found.append(measured(options.program, model, method, environment))
        medians = {method: {name: statistics.median(run[name] for run in found) for name in found[0]} for method, found in runs.items()
                   if all(found)}
        if not medians:
            sys.exit(f"{text}: no method gave a figure")
        any_one = next(iter(medians.values()))
        print(f"\n{text}: {any_one['unknowns']:.6g} unknowns, {any_one['entries']:.6g} entries\n")
        print("| | " + " | ".join(title for title, _ in COLUMNS.values()) + " |\n|---" + len(COLUMNS) * "|---" + "|")
        for method in options.methods:
            values = [f"{medians[method][name] * factor:.3g}" for name, (_, factor) in COLUMNS.items()] if method in medians else ["failed"]
            print("|", method, "|", " | ".join(values), "|", flush=True)
        others = {method: found["both"] for method, found in medians.items() if method != "ours"}
        if "ours" in medians and others:
            best = min(others, key=others.get)
            print(f"\nwhole iteration {1e3 * medians['ours']['iteration']:.3g} ms, {medians['ours']['iteration'] / others[best]:.2f} times {best}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
