"""FMUs of decks in importers that others wrote, and FMUs that others wrote as peers. What is not on this machine is named and skipped:

MBCOSIM_FMUSIM           `fmusim`, the importer of the FMI project (modelica/Reference-FMUs before its removal)
MBCOSIM_FMI_LIBRARY      an installation of FMI Library (modelon-community/fmi-library)
MBCOSIM_REFERENCE_FMUS   the FMI project's reference FMUs, in folders 2.0 and 3.0
"""
import csv
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "service"))
sys.path.insert(0, HERE)
from conftest import TIME_FACTOR, start_daemon  # noqa: E402,F401
from importer import OK, Archive, instance_of  # noqa: E402
from test_fmu import STANDARDS, TUTORIALS, exported, run_of  # noqa: E402,F401
from test_peer import CART, program  # noqa: E402,F401

import mbcosim  # noqa: E402


def given(variable):
    path = os.environ.get(variable)
    if not path:
        pytest.skip(f"{variable} names nothing")
    return path


def variables_of(fmu, rows, standard):
    """Labels of the nodes, and names of their positions and velocities as the standard has them."""
    indices = ["[1]", "[2]", "[3]"] if standard == "2" else [""]
    labels = [label for label in rows if f"node.structural.{label}.X{indices[0]}" in fmu.variables]
    assert labels
    return labels, [f"node.structural.{label}.{what}{i}" for label in labels for what in ("X", "XP") for i in indices]


def expected(rows, labels, record):
    return [number for label in labels for number in rows[label][record][:3] + rows[label][record][-6:-3]]


# ------------------------------------------------------------------ our FMUs elsewhere

@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("deck", TUTORIALS)
def test_fmusim_gets_the_numbers_of_the_command_line(exported, run_of, tmp_path, deck, standard):  # noqa: F811
    fmusim = given("MBCOSIM_FMUSIM")
    rows, fmu = run_of(deck), exported(deck, standard)
    start, stop, step = fmu.experiment()
    labels, names = variables_of(fmu, rows, standard)
    records = len(rows[labels[0]])
    arguments = [word for name in names for word in ("--output-variable", name)]
    out = str(tmp_path / "out.csv")
    done = subprocess.run([fmusim, "--interface-type", "cs", "--start-time", repr(start), "--stop-time", repr(start + (records - 1) * step),
                           "--output-interval", repr(step), *arguments, "--output-file", out, fmu.path],
                          capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    with open(out) as file:
        found = [row[1:] for row in csv.reader(file)][1:]
    assert len(found) == records
    for k in range(records):
        assert numbers_of(found[k]) == [f"{x:.16g}" for x in expected(rows, labels, k)]


def numbers_of(cells):
    """Arrays stand in one cell."""
    return [word for cell in cells for word in cell.split()]


@pytest.fixture(scope="module")
def library_importer(tmp_path_factory):
    home, compiler = given("MBCOSIM_FMI_LIBRARY"), shutil.which("cc") or shutil.which("gcc")
    path = str(tmp_path_factory.mktemp("importer") / "run")
    subprocess.run([compiler, "-O1", os.path.join(HERE, "fmi_library_run.c"), "-I", os.path.join(home, "include"), "-o", path, "-L",
                    os.path.join(home, "lib"), "-lfmilib", "-ldl", "-lm", "-lpthread"], check=True)
    return path


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("deck", TUTORIALS)
def test_fmi_library_gets_the_bits_of_the_command_line(exported, run_of, library_importer, tmp_path, deck, standard):  # noqa: F811
    rows, fmu = run_of(deck), exported(deck, standard)
    labels, names = variables_of(fmu, rows, standard)
    records = len(rows[labels[0]])
    (tmp_path / "unpacked").mkdir()
    done = subprocess.run([library_importer, fmu.path, str(tmp_path / "unpacked"), str(records - 1), *names], capture_output=True, text=True,
                          timeout=300)
    assert done.returncode == 0 and "FMIXML" not in done.stderr and "FMILIB" not in done.stderr, done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == records
    for k, line in enumerate(lines):
        assert [float.fromhex(word) for word in line.split()] == expected(rows, labels, k)


# ------------------------------------------------------------------ FMUs of others with us

STEP = 1e-3  # of the cart's deck [s]
STEPS = 250  # the reference FMUs take steps of their own of 0.1 or 0.01 s


def reference_fmu(standard, name):
    path = os.path.join(given("MBCOSIM_REFERENCE_FMUS"), standard + ".0", name + ".fmu")
    if not os.path.exists(path):
        pytest.skip(f"there is no {path}")
    return path


def drive_cart(daemon, program, path, mode, pairs, sent="node.structural.1.XP"):  # noqa: F811
    """Force and speed after each step with the FMU as the controller."""
    port = mbcosim.signal_port("control", outputs=[sent], inputs=["stream.force"])
    with daemon.connect() as server, server.load(CART, ports=[port], summed_time=True) as cart:
        peer = program("fmu", path, "--address", daemon.address, "--simulation", cart.name, "--port", "control", "--mode", mode,
                       *[word for pair in pairs for word in ("--map", pair)])
        assert "attached to port" in peer.first_line(), peer.finish() or peer.errors
        rows = []
        for _ in range(STEPS):
            values = cart.step(1, outputs=["stream.force", sent]).values
            rows.append((float(np.atleast_1d(values["stream.force"])[0]), values[sent][0]))
    assert peer.finish() == 0, peer.errors
    return np.array(rows)


def alone(path, output):
    """What the FMU gives to the importer of these tests in the same steps."""
    time, values = 0.0, []
    with instance_of(Archive(path)) as instance:
        instance.initialize()
        for k in range(STEPS):
            assert instance.do_step(time, STEP) == OK
            time += STEP
            values.append(instance[[output]][0])
    return values


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("name, output", [("BouncingBall", "h"), ("BouncingBall", "v"), ("VanDerPol", "x0"), ("VanDerPol", "x1"), ("Dahlquist", "x")])
def test_reference_fmus_drive_a_port(start_daemon, program, name, output, standard):  # noqa: F811
    path = reference_fmu(standard, name)
    force = drive_cart(start_daemon(), program, path, "loose", [f"{output}=stream.force"])[:, 0]
    assert len(set(force)) > 2  # it moves
    assert list(force) == alone(path, output)


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("mode", ["loose", "tight", "window"])
def test_feedthrough_gives_back_what_the_cart_does(start_daemon, program, standard, mode):  # noqa: F811
    path = reference_fmu(standard, "Feedthrough")
    rows = drive_cart(start_daemon(), program, path, mode, ["Float64_continuous_input=node.structural.1.XP[1]",
                                                            "Float64_continuous_output=stream.force"])
    assert abs(rows[-1, 1]) > 1e-3
    if mode == "loose":  # the force belongs to the speed at the beginning of the step
        assert list(rows[1:, 0]) == list(rows[:-1, 1])
    else:
        assert rows[:, 0] == pytest.approx(rows[:, 1], rel=1e-5, abs=1e-9)
