"""The example decks, run by the command line: closed forms, and numbers of MBDyn for the tutorials' models."""
import math
import os
import subprocess

import numpy as np
import pytest

MBCOSIM = os.path.join(os.environ["MBCOSIM_BIN"], "mbcosim")
MODELS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "client_examples", "models")
G = 9.81


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """results(deck, extension, label): rows without the label; each deck is run once."""
    folder, done = tmp_path_factory.mktemp("out"), set()

    def read(deck, extension, label):
        prefix = str(folder / deck)
        if deck not in done:
            run = subprocess.run([MBCOSIM, "run", os.path.join(MODELS, deck + ".mbd"), "-o", prefix],
                                 stderr=subprocess.PIPE, text=True, timeout=120)
            assert run.returncode == 0, run.stderr
            done.add(deck)
        with open(f"{prefix}.{extension}") as file:
            rows = [line.split() for line in file]
        return np.array([[float(x) for x in row[1:]] for row in rows if row[0] == str(label)])

    return read


def test_rigid_body_falls(results):
    rows = results("rigid_body", "mov", 1)
    time = np.arange(len(rows)) * 1e-3
    assert len(rows) == 1001
    assert rows[:, 1] == pytest.approx(time, abs=1e-6)
    assert rows[:, 2] == pytest.approx(-G * time**2 / 2, abs=2e-6)


def pendulum(length, omega, end, steps=10000):
    """Angle of a pendulum that starts at the bottom, by Runge and Kutta."""
    h, y = end / steps, np.array([0.0, omega])

    def rate(y):
        return np.array([y[1], -G / length * math.sin(y[0])])

    for _ in range(steps):
        a = rate(y)
        b = rate(y + h / 2 * a)
        c = rate(y + h / 2 * b)
        y = y + h / 6 * (a + 2 * b + 2 * c + rate(y + h * c))
    return y[0]


def test_three_pendulums_agree(results):
    at_mass, on_string = results("three_pendulums", "mov", 2002), results("three_pendulums", "mov", 3002)
    at_hinge = results("three_pendulums", "mov", 1001)
    assert on_string[:, :3] == pytest.approx(at_mass[:, :3], abs=1e-7)
    assert at_hinge[:, 4] == pytest.approx(at_mass[:, 4], abs=1e-5)
    angle = pendulum(0.5, 0.2, 1.0)
    assert at_mass[-1, 0] == pytest.approx(-0.5 * math.sin(angle), abs=2e-6)
    assert at_mass[-1, [0, 2]] == pytest.approx([0.0216698902958, -0.499530195138], rel=1e-6)  # MBDyn


def test_chain_rests_then_falls_without_losing_energy(results):
    links = [results("chain", "mov", k) for k in (1, 2, 3, 4)]
    reaction = results("chain", "jnt", 1)[:, 6:9]
    assert links[0][999, :3] == pytest.approx(links[0][0, :3], abs=1e-6)
    assert reaction[900] == pytest.approx([math.sqrt(3) / 2 * G, 0, -2 * G], rel=1e-5)
    energy = sum(0.5 * (m[:, 6:9]**2).sum(1) + 0.5 / 12 * m[:, 10]**2 + G * m[:, 2] for m in links)
    assert energy[-1] == pytest.approx(energy[0], rel=1e-5)
    assert links[3][-1, 0] < -1  # the free end has swung to the other side


@pytest.mark.parametrize("load", ["dead", "follower"])
def test_cantilever_vibrates_about_the_static_deflection(results, load):
    z = results(f"cantilever_{load}_load", "mov", 3)[:, 2]
    static = 100 * 0.5**3 / (3 * 1e4) + 100 * 0.5 / 1e9
    assert z.mean() == pytest.approx(static, rel=1e-3)
    assert 1.5 * static < z.max() < 2 * static


# Height of the free end at 0.1, 0.5 and 1 s, of MBDyn.
@pytest.mark.parametrize("deck, height", [
    ("cantilever_varying_load", [0.000130417034989, 0.000498258768738, 0.000341934576775]),
    ("cantilever_piezo_shorted", [0.000130417034989, 0.000498258768738, 0.000341934576775]),
    ("cantilever_piezo_shunt", [0.000129155897186, 0.000497888639325, 0.000342603325339])])
def test_cantilever_as_in_the_tutorials(results, deck, height):
    assert results(deck, "mov", 3)[[100, 500, 1000], 2] == pytest.approx(height, rel=1e-5)


def test_patches_at_no_voltage_do_nothing(results):
    """A short circuit; the law has no charge, with which an open one would stiffen the beam."""
    np.testing.assert_array_equal(results("cantilever_piezo_shorted", "mov", 3), results("cantilever_varying_load", "mov", 3))


def test_shunt_damps_the_vibration(results):
    def vibration(deck):
        return np.diff(results(deck, "mov", 3)[10:30, 8]).std()

    assert vibration("cantilever_piezo_shunt") < 0.05 * vibration("cantilever_piezo_shorted")


def test_five_elements_follow_a_slow_load(results):
    assert results("cantilever_five", "mov", 11)[-1, 2] == pytest.approx(10 * 0.5**3 / (3 * 1e4), rel=1e-3)


# y, z and rotation about x [degrees] at 1 s, of MBDyn.
@pytest.mark.parametrize("label, motion, tolerance", [
    (11, [-2.818476539e-6, 1.973731952e-2, 0.6168355254], 1e-8), (12, [1.999881280, 4.126852531e-2, 0.6168355254], 1e-6),
    (21, [1.648519042e-4, 4.166179450e-3, 0.6168521562], 1e-8), (22, [1.999797474, 4.905467615e-2, 0.6168521562], 1e-6)])
def test_modal_body_as_in_the_tutorials(results, label, motion, tolerance):
    assert results("modal_body", "mov", label)[100, 1:4] == pytest.approx(motion, rel=1e-6, abs=tolerance)


def test_modal_joints_alone_leave_an_empty_file_of_joints(results):
    assert len(results("modal_body", "mod", "10.1")) == len(results("modal_body", "mov", 11))
    assert len(results("modal_body", "jnt", 10)) == 0
