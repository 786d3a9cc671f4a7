"""`mbcosim reduce` and `fem-info`: a beam's matrices become a modal body that behaves like the beam in a deck."""
import json
import math
import os
import subprocess

import numpy as np
import pytest

MBCOSIM = os.path.join(os.environ["MBCOSIM_BIN"], "mbcosim")
BIN_DAEMON = MBCOSIM + "d"
NODES, LENGTH, EA, GJ, EIY, EIZ, MASS = 9, 2.0, 1e5, 80.0, 100.0, 150.0, 1.5


def beam():
    """Stiffness and lumped mass of a beam along x from -1 to 1 m."""
    h = LENGTH / (NODES - 1)
    k, m = np.zeros((6 * NODES, 6 * NODES)), np.zeros(6 * NODES)
    bend = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                     [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3
    flip = np.diag([1, -1, 1, -1])
    for e in range(NODES - 1):
        a, b = 6 * e, 6 * e + 6
        for rows, block in (([a, b], EA / h * np.array([[1, -1], [-1, 1]])), ([a + 3, b + 3], GJ / h * np.array([[1, -1], [-1, 1]])),
                            ([a + 1, a + 5, b + 1, b + 5], EIZ * bend), ([a + 2, a + 4, b + 2, b + 4], EIY * flip @ bend @ flip)):
            k[np.ix_(rows, rows)] += block
        for end in (a, b):
            m[end:end + 3] += MASS * h / 2
            m[end + 3] += 0.02 * h / 2
            m[end + 4:end + 6] += MASS * h**3 / 78
    return k, np.diag(m)


def matrix_market(matrix):
    rows, columns = np.nonzero(np.tril(matrix))
    lines = [f"{i + 1} {j + 1} {float(matrix[i, j])!r}" for i, j in zip(rows, columns)]
    return "\n".join(["%%MatrixMarket matrix coordinate real symmetric", f"{len(matrix)} {len(matrix)} {len(lines)}", *lines, ""])


@pytest.fixture
def folder(tmp_path):
    k, m = beam()
    (tmp_path / "K.mtx").write_text(matrix_market(k))
    (tmp_path / "M.mtx").write_text(matrix_market(m))
    (tmp_path / "nodes.csv").write_text("label,x,y,z\n" + "".join(
        f"{n + 1},{-1 + n * LENGTH / (NODES - 1)},0,0\n" for n in range(NODES)))
    (tmp_path / "beam.job").write_text("mass = M.mtx\nstiffness = K.mtx\nnodes = nodes.csv   # three files\n")
    return tmp_path


def mbcosim(*arguments):
    return subprocess.run([MBCOSIM, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=120)


def reduced(folder, *options):
    run = mbcosim("reduce", folder / "beam.job", "-o", folder / "beam.fem", *options)
    assert run.returncode == 0, run.stderr
    return json.loads((folder / "beam.fem.json").read_text()), run.stdout


def test_threads_do_not_change_the_file(folder):
    files = []
    for threads in 1, 3:
        reduced(folder, "--basis", "craig-bampton", "--interface", "1,9", "--modes", "4", "--threads", threads, "--processor", "plain")
        files.append((folder / "beam.fem").read_bytes())
    assert files[0] == files[1]


def clamped_deck(modes, force):
    return f"""begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 6.; time step: 1.e-2; max iterations: 20; tolerance: 1.e-9; end: initial value;
begin: control data; structural nodes: 1; joints: 1; forces: 1; end: control data;
begin: nodes; structural: 9, static, 2., 0., 0., eye, null, null; end: nodes;
begin: elements;
    joint: 1, modal, clamped, {modes}, from file, single factor damping, .7, "beam.fem", 1, 9, 9, null;
    force: 1, absolute, 9, position, null, 0., 1., 2., const, {force};
end: elements;
"""


def test_complement_shapes_carry_the_static_deflection(folder):
    report, text = reduced(folder, "--basis", "complement", "--interface", "9", "--components", "9:23", "--frame", "node:1",
                           "--modes", "4")
    assert report["static_error"] < 1e-9 and "largest static error" in text
    assert [2 * math.pi * f for f in report["frequencies_hz"]] == pytest.approx(
        [7.119396478, 8.719444324, 43.62055183, 49.59318611, 56.64654879, 130.2785504], rel=1e-8)
    (folder / "deck").write_text(clamped_deck(6, 1e-3))
    run = mbcosim("run", folder / "deck")
    assert run.returncode == 0, run.stderr
    tip = np.loadtxt(folder / "deck.mov")[-1]
    assert tip[2:4] / 1e-3 == pytest.approx([LENGTH**3 / (3 * EIZ), 2 * LENGTH**3 / (3 * EIY)], rel=1e-5)


def free_deck(modes):
    return f"""begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: .3; time step: 2.e-4; method: crank nicolson; max iterations: 20;
    tolerance: 1.e-9; derivatives tolerance: 1.e-3; derivatives max iterations: 10; end: initial value;
begin: control data; structural nodes: 2; joints: 1; forces: 1; output precision: 16; end: control data;
begin: nodes; structural: 1, modal, null, eye, null, null; structural: 9, static, 1., 0., 0., eye, null, null; end: nodes;
begin: elements;
    joint: 1, modal, 1, {modes}, from file, no damping, "beam.fem", 1, 9, 9, null;
    force: 1, absolute, 9, position, null, 0., 0., 1., sine, 0., 20., 1.e-3, forever, 0.;
end: elements;
"""


def full_response():
    """z of the loaded end of the full linear model, by its modes."""
    k, m = beam()
    squares, shapes = np.linalg.eigh(k / np.sqrt(np.outer(np.diag(m), np.diag(m))))
    shapes = shapes / np.sqrt(np.diag(m))[:, None]
    h, steps, z = 1e-5, 30000, np.zeros(30001)
    q, p = np.zeros(54), np.zeros(54)
    load = shapes[6 * 8 + 2]
    for n in range(steps):  # leapfrog
        p += h * (load * 1e-3 * math.sin(20 * n * h) - squares.clip(0) * q)
        q += h * p
        z[n + 1] = load @ q
    return z[20::20]


def test_free_flying_reduced_beam_moves_like_the_full_one(folder):
    report, _ = reduced(folder, "--basis", "inertia-decoupling", "--interface", "9", "--components", "9:23", "--modes", "4")
    assert report["rigid_motions"] == 6 and report["mass_kg"] == pytest.approx(3)
    (folder / "deck").write_text(free_deck(6))
    run = mbcosim("run", folder / "deck")
    assert run.returncode == 0, run.stderr
    z = np.array([float(line.split()[3]) for line in open(folder / "deck.mov") if line.split()[0] == "9"])[1:]
    full = full_response()
    assert np.abs(full).max() > 3e-6
    assert np.abs(z[:len(full)] - full).max() < 1e-8  # four modes alone: above 2e-8


def test_fem_info(folder):
    reduced(folder, "--basis", "free", "--modes", "3", "--inertia", "both")
    run = mbcosim("fem-info", folder / "beam.fem", "--json")
    info = json.loads(run.stdout)
    assert run.returncode == 0
    assert (info["modes"], len(info["nodes"]), info["groups"]) == (3, 9, [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12])
    assert [2 * math.pi * f for f in info["frequencies_hz"]] == pytest.approx([43.19176580, 52.89889365, 98.70876272], rel=1e-8)
    assert info["mass_kg"] == pytest.approx(3) and info["warnings"] == []
    assert "3 modes" in mbcosim("fem-info", folder / "beam.fem").stdout
    (folder / "bad.fem").write_text((folder / "beam.fem").read_text().replace("** RECORD GROUP 9,", "** RECORD GROUP 8,"))
    bad = mbcosim("fem-info", folder / "bad.fem")
    assert bad.returncode == 2 and "record group 8" in bad.stderr


def test_packed_form_runs_like_the_text(folder):
    """A name that ends with .bin asks for the packed form; decks and fem-info take both."""
    shape = ["--basis", "complement", "--interface", "9", "--frame", "node:1", "--modes", "2"]
    reduced(folder, *shape)
    run = mbcosim("reduce", folder / "beam.job", "-o", folder / "beam.bin", *shape)
    assert run.returncode == 0, run.stderr
    assert (folder / "beam.bin").read_bytes()[:4] == b"bmod"
    text, packed = (json.loads(mbcosim("fem-info", folder / name, "--json").stdout) for name in ("beam.fem", "beam.bin"))
    assert packed["binary"] and not text["binary"]
    assert {**packed, "binary": 0, "revision": 0} == {**text, "binary": 0, "revision": 0}
    for source, copy in (("beam.fem", "copy.bin"), ("beam.bin", "copy.fem")):  # either form from the other
        assert mbcosim("fem-info", folder / source, "--convert", folder / copy).returncode == 0
    assert (folder / "copy.bin").read_bytes() == (folder / "beam.bin").read_bytes()
    numbers = [[line for line in (folder / name).read_text().splitlines() if not line.startswith("**")] for name in ("beam.fem", "copy.fem")]
    assert numbers[0] == numbers[1]
    nowhere = mbcosim("fem-info", folder / "beam.fem", "--convert", folder / "none" / "copy.fem")
    assert nowhere.returncode == 2 and "cannot write" in nowhere.stderr
    for name in ("beam.fem", "beam.bin"):
        (folder / f"{name}.deck").write_text(clamped_deck(8, 1e-3).replace("final time: 6.", "final time: .5").replace("beam.fem", name))
        run = mbcosim("run", folder / f"{name}.deck", "-o", folder / f"out_{name}")
        assert run.returncode == 0, run.stderr
    assert (folder / "out_beam.fem.mov").read_text() == (folder / "out_beam.bin.mov").read_text()


def test_options_of_the_eigensolution(folder):
    """They are taken from the command line; models as small as this one are solved with full matrices all the same."""
    reports = [reduced(folder, "--basis", "free", "--modes", "4", *more)[0]["frequencies_hz"]
               for more in ([], ["--shift", "-100", "--tolerance", "1e-8"])]
    assert reports[1] == pytest.approx(reports[0], rel=1e-8)


@pytest.mark.parametrize("options, message", [
    (["--shift", "3"], "below zero"), (["--tolerance", "0"], "between 0 and 1"), (["--lumping", "row"], "unknown lumping"),
    (["--normal", "most"], "unknown choice"),
    (["--basis", "fancy"], "unknown basis `fancy`"), (["--interface", "77"], "the model has no node 77"),
    (["--mass", "missing.mtx"], "cannot open"), (["--mass", ""], "--mass: a file's name expected"), (["--basis", "constrained"], "6 rigid motions"),
    (["--basis", "free", "--max-frequency", "1e-3"], "no normal mode below the highest frequency"),
    (["--modes", "3", "--max-frequency", "10"], "both `modes` and `max-frequency` say"),
    (["--modes", "many"], "modes: a number expected"), (["--frame", "somewhere"], "unknown frame")])
def test_refusals(folder, options, message):
    run = mbcosim("reduce", folder / "beam.job", "-o", folder / "beam.fem", *options)
    assert run.returncode == 2 and message in run.stderr
    assert not (folder / "beam.fem").exists()


@pytest.mark.parametrize("output", ["nodes.csv", "beam.job", "../{0}/M.mtx", "K"])
def test_results_never_take_the_place_of_inputs(folder, output):
    """`K`: its report would be K.json, which is the stiffness matrix here."""
    (folder / "K.json").write_text((folder / "K.mtx").read_text())
    (folder / "beam.job").write_text((folder / "beam.job").read_text().replace("K.mtx", "K.json"))
    before = {path.name: path.read_text() for path in folder.iterdir()}
    run = mbcosim("reduce", folder / "beam.job", "-o", folder / output.format(folder.name), "--basis", "free", "--modes", "4")
    assert run.returncode == 2 and "is one of the inputs" in run.stderr and "choose another name with -o" in run.stderr
    assert {path.name: path.read_text() for path in folder.iterdir()} == before
