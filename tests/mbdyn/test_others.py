"""Codes on MBDyn's own client library, which is not on every machine: it is named and skipped where it is absent.

MBCOSIM_MBC   a folder with `mbc.h` and `libmbc.a` or `libmbc.so`, built from MBDyn's libraries/libmbc
"""
import os
import shutil
import struct
import subprocess

import numpy as np
import pytest
from test_sockets import FREE, ROTATIONS, TIME_FACTOR, TURNED, deck, modal_joint, receive, run, shake  # noqa: F401

HERE = os.path.dirname(os.path.abspath(__file__))
END = 0.05
ITERATIONS = {"loose": 1, "staggered": 0, "tight": 3}
POINTS = "2, 1, offset, .1,0.,0., 2"
LABELS = [1, 2]


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    home, compiler = os.environ.get("MBCOSIM_MBC"), shutil.which("cc") or shutil.which("gcc")
    if not home:
        pytest.skip("MBCOSIM_MBC names nothing")
    path = str(tmp_path_factory.mktemp("library") / "peer")
    subprocess.run([compiler, "-O1", os.path.join(HERE, "library_peer.c"), "-I", home, "-L", home, "-lmbc", f"-Wl,-rpath,{home}", "-o", path], check=True)
    return path


def of_the_library(program, done, kind, count, labels=0, rotation=0, accelerations=0, reference=0, iterations=1):
    """Results of the run with the library's code."""
    words = [os.path.join(done.folder, "s"), kind, count, int(labels), rotation, int(accelerations), reference, iterations]
    code = subprocess.run([program, *map(str, words)], timeout=60 * TIME_FACTOR)
    assert code.returncode == 0
    assert done.finish() == 0, done.errors
    return numbers(done)


def numbers(done):
    return np.array([[float(x) for x in row] for row in done.rows()])


# ------------------------------------------------------------------ the same code in Python

def load(x, rotation, v, w, a, wp):
    """Of library_peer.c."""
    force, moment = [], []
    for i in range(3):
        force.append(-3.0 * x[i] - 0.5 * v[i] - (0.01 * a[i] if len(a) else 0.0))
        if len(rotation):
            moment.append(0.01 * rotation[i] - 0.02 * w[i] - (0.001 * wp[i] if len(wp) else 0.0))
    return force, moment


def fields(data, n, size, accelerations):
    """x, rotation, v, w, a, w' of n points, one array after the other."""
    sizes = [3, size, 3, 3 if size else 0] + ([3, 3 if size else 0] if accelerations else [0, 0])
    parts = np.split(np.frombuffer(data), np.cumsum([n * k for k in sizes])[:-1])
    return [[part[k * m:(k + 1) * m] for part, m in zip(parts, sizes)] for k in range(n)]


def block(data, n, size, accelerations):
    loads = [load(*point) for point in fields(data, n, size, accelerations)]
    return np.array([f for f, _ in loads]).tobytes() + np.array([m for _, m in loads]).tobytes()


def width(size, accelerations):
    return 8 * ((9 + size) + (6 if accelerations else 0) if size else 6 + (3 if accelerations else 0))


def of_our_code(done, flags, size, labels, accelerations, reference, iterations):
    """Results of the run with a code of our own; `reference`: numbers of the reference node's rotation, none without the node."""
    peer = done.connect()
    shake(peer, flags, 2)
    heads = struct.pack("<II", 3, 0) if labels and reference is not None else b"", struct.pack("<II", *LABELS) if labels else b""
    k = 0
    while receive(peer, 1) != b"\5":
        k += 1
        last, answer = iterations > 0 and k % iterations == 0, b""
        for head, n, form in [(heads[0], 1, reference), (heads[1], 2, size)]:
            if form is not None:
                assert receive(peer, len(head)) == head
                answer += head + block(receive(peer, n * width(form, accelerations)), n, form, accelerations)
        peer.sendall((b"\6" if last else b"\2") + answer)
    assert done.finish() == 0, done.errors
    return numbers(done)


def coupled_deck(mode, options):
    text = deck(f'force: 5, external structural, socket, create, yes, path, "s", coupling, {mode}, {options} {POINTS};', end=END, node2=TURNED)
    third = f"structural: 3, dynamic, {FREE.replace('2.,-1.,1.5', '0.,1.,-.5')}; end: nodes;"
    text = text.replace("end: nodes;", third).replace("end: elements;", "body: 3, 3, 1., null, eye; end: elements;")
    return text.replace("structural nodes: 2; rigid bodies: 2;", "structural nodes: 3; rigid bodies: 3;")


def options_of(rotation, labels, accelerations, reference):
    return (("reference node, 3," if reference else "") + ("labels, yes," if labels else "") + rotation + ("accelerations, yes," if accelerations else ""))


@pytest.mark.parametrize("reference", [False, True])
@pytest.mark.parametrize("accelerations", [False, True])
@pytest.mark.parametrize("labels", [False, True])
@pytest.mark.parametrize("rotation", ROTATIONS)
@pytest.mark.parametrize("mode", ITERATIONS)
def test_the_library_gets_and_gives_what_our_code_does(run, program, mode, rotation, labels, accelerations, reference):  # noqa: F811
    """With rotations of the points none, the library has those of a reference node as matrices, which its flags say."""
    flag, size = ROTATIONS[rotation]
    form = (size or 9) if reference else None
    flags = 0x2 | flag | (8 if accelerations else 0) | (0x10 if labels else 0) | (0x4 | (flag or 0x200) << 4 if reference else 0)
    text = coupled_deck(mode, options_of(rotation, labels, accelerations, reference))
    expected = of_our_code(run(text), flags, size, labels, accelerations, form, ITERATIONS[mode])
    rotations = flag or (0x2000 if reference else 0)
    found = of_the_library(program, run(text), "nodal", 2, labels, rotations, accelerations, int(reference), ITERATIONS[mode])
    assert len(expected) == 3 * 6 and np.abs(expected[-3:, 13:16] - expected[:3, 13:16]).max() > 0.01
    assert found == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("reference", [False, True])
def test_the_library_hears_that_it_would_misread_an_odd_number_of_labels(run, program, reference):  # noqa: F811
    node = "reference node, 2," if reference else ""
    done = run(deck(f'force: 5, external structural, socket, create, yes, path, "s", {node} labels, yes, 1, 1;', end=END))
    code = subprocess.run([program, os.path.join(done.folder, "s"), "nodal", "1", "1", str(0x200), "0", str(int(reference)), "1"],
                          timeout=60 * TIME_FACTOR)
    assert code.returncode in (3, 4) and done.finish() == 5 and "labels of an odd number of points" in done.errors


@pytest.mark.parametrize("mode", ITERATIONS)
@pytest.mark.parametrize("options,rigid", [("", True), ("type, modal,", False)])
def test_the_library_moves_modes_as_our_code_does(run, program, tmp_path, mode, options, rigid):  # noqa: F811
    modes, iterations = 2, ITERATIONS[mode]
    coupling = f"coupling, {mode}," if mode != "loose" else ""

    def start():
        return modal_joint(run, tmp_path, options, modes, coupling, end="0.05", joint="DYNAMIC")

    done = start()
    peer = done.connect()
    shake(peer, 0x5 if rigid else 0x1, modes)
    k = 0
    while receive(peer, 1) != b"\5":
        k += 1
        state = np.frombuffer(receive(peer, (144 if rigid else 0) + 16 * modes))
        r, q, qp = state[:-2 * modes], state[-2 * modes:-modes], state[-modes:]
        answer = [*(-3.0 * r[:3] - 0.5 * r[12:15]), *(0.01 * r[3:6] - 0.02 * r[15:18])] if rigid else []
        answer += [-3.0 * q[i] - 0.5 * qp[i] + 0.1 * (i + 1) for i in range(modes)]
        peer.sendall((b"\6" if iterations and k % iterations == 0 else b"\2") + np.array(answer).tobytes())
    assert done.finish() == 0, done.errors
    expected = numbers(done)
    assert np.abs(expected[-1] - expected[3]).max() > 1e-9
    found = of_the_library(program, start(), "modal", modes, reference=int(rigid), iterations=iterations)
    assert found == pytest.approx(expected, abs=1e-12)
