#!/usr/bin/env python3
"""Our factorization, ordering and eigensolution beside MUMPS, METIS and ARPACK on solids of brick elements, on one thread.

usage: factor_libraries.py FACTOR_LIBRARIES SHAPE... [--keep FOLDER] [--blas FOLDER] [--methods NAME ...]

FACTOR_LIBRARIES is the program of that name, whose source tells the packages that it needs and what it measures; SHAPE as for
reduce_scaling.py. Each method runs in a process of its own. `--blas` is the folder of the libblas.so.3 that MUMPS uses, such
as /usr/lib/x86_64-linux-gnu/openblas-serial. Prints one line of a Markdown table for each shape and method.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

from reduce_scaling import write_model

METHODS = ["ours:plain", "ours:x86-64-v3", "ours", "mumps", "mumps:ours", "order:ours", "order:metis", "order:amd",
           "modes:ours", "modes:arpack"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("shapes", nargs="+")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the models, used again when they are there")
    parser.add_argument("--blas", default="")
    parser.add_argument("--methods", nargs="+", default=METHODS)
    options = parser.parse_args()
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    if options.blas:
        environment["LD_LIBRARY_PATH"] = options.blas
    for shape in options.shapes:
        with tempfile.TemporaryDirectory() as temporary:
            folder = options.keep / shape if options.keep else pathlib.Path(temporary)
            os.makedirs(folder, exist_ok=True)
            if not (folder / "dofs.csv").exists():
                write_model(folder, tuple(map(int, shape.split("x"))))
            for method in options.methods:
                done = subprocess.run([options.program, str(folder), method], stdout=subprocess.PIPE, env=environment)
                found = json.loads(done.stdout) if done.returncode == 0 else {"failed": done.returncode}
                print("|", shape, "|", method, "|", ", ".join(f"{name} {value:.4g}" for name, value in found.items()), "|", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
