"""A reduced beam in motion against the same beam of finite volume elements: pinned, spinning, thrown. The deflection of the middle
against the chord of the ends is compared; it is free of rigid motion."""
import os
import subprocess

import numpy as np
import pytest

MBCOSIM = os.path.join(os.environ["MBCOSIM_BIN"], "mbcosim")
ELEMENTS, LENGTH, MASS = 16, 2.0, 1.5                      # [m], [kg/m]
H = LENGTH / ELEMENTS
EA, GA, GJ, EIY, EIZ = 1e6, 1e7, 2e3, 2e3, 3e3
NODES, MIDDLE = ELEMENTS + 1, ELEMENTS // 2                # along x from -1 to 1 m, labels from 0
ENDS = (0, MIDDLE, ELEMENTS)

GRAVITY = "gravity: uniform, 0., 0., -1., const, 9.81;"
PUSH = f"force: 1, follower, {ELEMENTS}, position, null, 0., .3, 1., sine, 0., pi/.05, 40., one, 0.;"
CASES = {  # velocity of the middle, angular velocity, joint, loads
    "pinned": ((0, 0, 0), (0, 0, 0), "joint: 50, spherical pin, 0, null, -1., 0., 0.;", GRAVITY),
    "spinning": ((0, 0, 0), (0, 0, 4), f"joint: 50, revolute pin, {MIDDLE}, null, hinge, eye, null, hinge, eye;", PUSH),
    "thrown": ((1, 2, 3), (.5, 1, 2), "", GRAVITY + "\n" + PUSH)}


def place(node):
    return -LENGTH / 2 + node * H


def matrices():
    """Stiffness of the Euler-Bernoulli beam, and its lumped masses as a list."""
    k, m = np.zeros((6 * NODES, 6 * NODES)), np.zeros(6 * NODES)
    bend = np.array([[12, 6 * H, -12, 6 * H], [6 * H, 4 * H * H, -6 * H, 2 * H * H],
                     [-12, -6 * H, 12, -6 * H], [6 * H, 2 * H * H, -6 * H, 4 * H * H]]) / H**3
    flip, bar = np.diag([1, -1, 1, -1]), np.array([[1, -1], [-1, 1]]) / H
    for a in range(0, 6 * ELEMENTS, 6):
        b = a + 6
        for rows, block in (([a, b], EA * bar), ([a + 3, b + 3], GJ * bar), ([a + 1, a + 5, b + 1, b + 5], EIZ * bend),
                            ([a + 2, a + 4, b + 2, b + 4], EIY * flip @ bend @ flip)):
            k[np.ix_(rows, rows)] += block
        for end in (a, b):
            m[end:end + 6] += np.array([MASS * H / 2] * 3 + [.02 * H / 2] + [MASS * H**3 / 78] * 2)
    return k, m


def matrix_market(matrix):
    rows, columns = np.nonzero(np.tril(matrix))
    lines = [f"{i + 1} {j + 1} {float(matrix[i, j])!r}" for i, j in zip(rows, columns)]
    return "\n".join(["%%MatrixMarket matrix coordinate real symmetric", f"{len(matrix)} {len(matrix)} {len(lines)}", *lines, ""])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Holds beam.fem: six free modes and the shapes of loads at the ends and the middle, orthogonal to rigid motion."""
    folder = tmp_path_factory.mktemp("beam")
    k, m = matrices()
    (folder / "K.mtx").write_text(matrix_market(k))
    (folder / "M.mtx").write_text(matrix_market(np.diag(m)))
    (folder / "nodes.csv").write_text("label,x,y,z\n" + "".join(f"{n},{place(n)},0,0\n" for n in range(NODES)))
    (folder / "beam.job").write_text("mass = M.mtx\nstiffness = K.mtx\nnodes = nodes.csv\nbasis = inertia-decoupling\n"
                                     f"interface = {', '.join(map(str, ENDS))}\nmodes = 6\n")
    run = subprocess.run([MBCOSIM, "reduce", folder / "beam.job", "-o", folder / "beam.fem"], stderr=subprocess.PIPE, text=True,
                         stdout=subprocess.DEVNULL, timeout=60)
    assert run.returncode == 0, run.stderr
    return folder


def node(kind, label, x, case):
    v, w = np.array(CASES[case][0]), np.array(CASES[case][1])
    return (f"structural: {label}, {kind}, {x}, 0., 0., eye, {', '.join(map(str, v + np.cross(w, [x, 0, 0])))}, "
            f"{', '.join(map(str, w))};")


def deck(case, counts, nodes, elements):
    _, _, joint, loads = CASES[case]
    joints = counts.pop("joints", 0) + bool(joint)
    counts = "".join(f"{kind}: {count}; " for kind, count in counts.items())
    return f"""begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: .3; time step: 5.e-4; method: ms, .6; max iterations: 30;
    tolerance: 1.e-6; derivatives tolerance: 1.e-2; derivatives max iterations: 20; end: initial value;
begin: control data; skip initial joint assembly; {counts} joints: {joints}; forces: {loads.count('force:')};
    {'gravity;' if GRAVITY in loads else ''} output precision: 12; output frequency: 5; end: control data;
begin: nodes;
{nodes}
end: nodes;
begin: elements;
{elements}
{joint}
{loads}
end: elements;
"""


def full_deck(case):
    nodes = "\n".join(node("dynamic", n, place(n), case) for n in range(NODES))
    elements = []
    for n in range(NODES):
        share = .5 if n in (0, ELEMENTS) else 1.
        inertia = ", ".join(str(share * j) for j in (.02 * H, MASS * H**3 / 39, MASS * H**3 / 39))
        elements.append(f"body: {n}, {n}, {share * MASS * H}, null, diag, {inertia};")
    for e in range(ELEMENTS // 2):
        elements.append(f"beam3: {e}, {2 * e}, null, {2 * e + 1}, null, {2 * e + 2}, null, eye, linear elastic generic, diag, "
                        f"{EA}, {GA}, {GA}, {GJ}, {EIY}, {EIZ}, same, same;")
    return deck(case, {"structural nodes": NODES, "rigid bodies": NODES, "beams": ELEMENTS // 2}, nodes, "\n".join(elements))


def modal_deck(case):
    nodes = [node("modal", 100, 0., case)] + [node("static", n, place(n), case) for n in ENDS]
    interface = ", ".join(f'"{n}", {n}, null' for n in ENDS)
    joint = f'joint: 1, modal, 100, 24, from file, no damping, "beam.fem", {len(ENDS)}, {interface};'
    return deck(case, {"structural nodes": 1 + len(ENDS), "joints": 1}, "\n".join(nodes), joint)


def motion(folder, name, text):
    """Positions of the three nodes over time."""
    (folder / name).write_text(text)
    run = subprocess.run([MBCOSIM, "run", folder / name, "-q"], stderr=subprocess.PIPE, text=True, timeout=120)
    assert run.returncode == 0, run.stderr
    rows = [line.split() for line in open(folder / f"{name}.mov")]
    return [np.array([[float(x) for x in row[1:4]] for row in rows if int(row[0]) == n]) for n in ENDS]


@pytest.mark.parametrize("case", CASES)
def test_reduced_beam_moves_like_the_full_one(folder, case):
    left, middle, right = motion(folder, f"{case}_full", full_deck(case))
    left_r, middle_r, right_r = motion(folder, f"{case}_reduced", modal_deck(case))
    deflection, reduced = middle - (left + right) / 2, middle_r - (left_r + right_r) / 2
    assert np.abs(deflection).max() > 7e-4
    assert np.abs(reduced - deflection).max() < 0.03 * np.abs(deflection).max()
    assert np.linalg.norm(right - right[0], axis=1).max() > 0.6
    assert np.linalg.norm(right_r - right, axis=1).max() < 1e-4
