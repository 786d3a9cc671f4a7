#!/usr/bin/env python3
"""Time and memory of `mbcosim reduce` on solids of brick elements.

usage: reduce_scaling.py MBCOSIM SHAPE... [--basis NAME] [--modes N] [--keep FOLDER] [--timeout SECONDS] [--json]

SHAPE is AxBxC, elements along x, y and z: 40x40x40 is a cube of 206 763 unknowns, 128x128x3 a plate of 199 692. Elements are
cubes of 8 nodes with 3 unknowns each and a consistent mass matrix, integrated with 2 x 2 x 2 points. The body is free; its
interface nodes are the four corners of the bottom. Prints unknowns, entries of the stiffness matrix and of the factor, wall
and processor time, and the largest resident memory of the process; writing the model is not counted.
"""
import argparse
import itertools
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np

SIZE, YOUNG, POISSON, DENSITY = 0.1, 70e9, 0.3, 2700.0
CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))


def element():
    """Stiffness and mass of a cube of 8 nodes, rows node by node."""
    bulk, shear = POISSON * YOUNG / ((1 + POISSON) * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))
    law = np.zeros((6, 6))
    law[:3, :3] = bulk
    law += np.diag([2 * shear] * 3 + [shear] * 3)
    k, m, signs, weight = np.zeros((24, 24)), np.zeros((24, 24)), 2 * CORNERS - 1, SIZE**3 / 8
    for point in itertools.product((-1 / np.sqrt(3), 1 / np.sqrt(3)), repeat=3):
        factors = (1 + signs * point) / 2
        slopes = np.stack([np.prod(np.delete(factors, a, 1), 1) * signs[:, a] / SIZE for a in range(3)], 1)
        strain = np.zeros((6, 24))
        for n, (x, y, z) in enumerate(slopes):
            strain[:, 3 * n:3 * n + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]]
        shape = np.kron(np.prod(factors, 1), np.eye(3))
        k += weight * strain.T @ law @ strain
        m += weight * DENSITY * shape.T @ shape
    return (k + k.T) / 2, (m + m.T) / 2


def assembled(shape, block):
    """Row, column and value of the lower half."""
    ny, nz = shape[1] + 1, shape[2] + 1
    origin = np.array(list(itertools.product(*map(range, shape))))
    nodes = ((origin[:, None] + CORNERS) @ [ny * nz, nz, 1])
    rows = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), 24)
    order = int(np.prod(np.array(shape) + 1)) * 3
    i, j = np.repeat(rows, 24, 1), np.tile(rows, 24)
    lower = i >= j
    key, place = np.unique(i[lower].astype(np.int64) * order + j[lower], return_inverse=True)
    value = np.bincount(place, np.broadcast_to(block.ravel(), i.shape)[lower])
    return order, key // order, key % order, value


def write_matrix(path, shape, block):
    order, i, j, value = assembled(shape, block)
    with open(path, "w") as file:
        file.write(f"%%MatrixMarket matrix coordinate real symmetric\n{order} {order} {len(value)}\n")
        np.savetxt(file, np.stack([i + 1, j + 1, value], 1), fmt="%d %d %.17g")
    return order, len(value)


def write_model(folder, shape):
    stiffness, mass = element()
    found = write_matrix(folder / "K.mtx", shape, stiffness)
    write_matrix(folder / "M.mtx", shape, mass)
    places = SIZE * np.array(list(itertools.product(*(range(n + 1) for n in shape))))
    (folder / "nodes.csv").write_text("label,x,y,z\n" + "".join(
        f"{n + 1},{x:.9g},{y:.9g},{z:.9g}\n" for n, (x, y, z) in enumerate(places)))
    (folder / "dofs.csv").write_text("label,dof\n" + "".join(f"{n + 1},{c}\n" for n in range(len(places)) for c in (1, 2, 3)))
    return found


def corner_labels(shape):
    ny, nz = shape[1] + 1, shape[2] + 1
    return [1 + x * ny * nz + y * nz for x in (0, shape[0]) for y in (0, shape[1])]


def measure(options, shape, folder):
    unknowns, entries = write_model(folder, shape) if not (folder / "dofs.csv").exists() else (0, 0)
    line = [options.mbcosim, "reduce", "-q", "-o", str(folder / "body.fem"), "--basis", options.basis, "--modes", str(options.modes),
            "--inertia", "rigid", "--expose", "interface", "--interface", ",".join(map(str, corner_labels(shape)))]
    for name, file in (("mass", "M.mtx"), ("stiffness", "K.mtx"), ("nodes", "nodes.csv"), ("dofs", "dofs.csv")):
        line += [f"--{name}", str(folder / file)]
    begin, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(line, check=True, timeout=options.timeout)
    wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    report = json.loads((folder / "body.fem.json").read_text())
    return {"shape": "x".join(map(str, shape)), "unknowns": report["unknowns"], "stiffness_entries": entries,
            "factor_entries": report["factor_nonzeros"], "wall_s": round(wall, 1),
            "processor_s": round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 1),
            "memory_mb": after.ru_maxrss // 1024, "first_hz": report["frequencies_hz"][0], "last_hz": report["frequencies_hz"][-1]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mbcosim")
    parser.add_argument("shapes", nargs="+")
    parser.add_argument("--basis", default="craig-bampton")
    parser.add_argument("--modes", type=int, default=20)
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the models, used again when they are there")
    parser.add_argument("--timeout", type=float, default=3600)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    for text in options.shapes:
        shape = tuple(map(int, text.split("x")))
        with tempfile.TemporaryDirectory() as temporary:
            folder = options.keep / text if options.keep else pathlib.Path(temporary)
            os.makedirs(folder, exist_ok=True)
            found = measure(options, shape, folder)
        print(json.dumps(found) if options.json else "  ".join(f"{name} {value}" for name, value in found.items()), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
