"""The example scripts against a daemon: they end well, print what they should, and leave a picture."""
import os
import re
import subprocess
import sys
import time

import pytest

BIN = os.environ["MBCOSIM_BIN"]
SCRIPTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "client_examples", "python")


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    address = f"unix:{tmp_path_factory.mktemp('run')}/s"
    daemon = subprocess.Popen([os.path.join(BIN, "mbcosimd"), "--listen", address, "--log-level", "warn"])
    while not os.path.exists(address[len("unix:"):]):
        assert daemon.poll() is None
        time.sleep(0.01)
    yield address
    daemon.terminate()
    assert daemon.wait(20) == 0


WITH_A_POINT, ALL = r"(?<![\w.])-?\d+\.\d+(?:e[-+]?\d+)?", r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?"


def run(script, address, tmp_path, *options, numbers=WITH_A_POINT):
    """The numbers that a script prints, for each line."""
    plot = tmp_path / "plot.png"
    done = subprocess.run([sys.executable, os.path.join(SCRIPTS, script), "--address", address, "--plot", str(plot),
                           *options],
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=200)
    assert done.returncode == 0, done.stderr
    assert plot.read_bytes().startswith(b"\x89PNG") and plot.stat().st_size > 10000
    return [[float(x) for x in re.findall(numbers, line)]
            for line in done.stdout.splitlines() if not line.startswith("plot")]


def test_pendulum(address, tmp_path):
    (free, pushed), = run("pendulum_stepping.py", address, tmp_path)
    assert free == pytest.approx(0, abs=2e-3)  # where it started
    assert 0.05 < pushed < 0.1


def test_shunt_damping(address, tmp_path):
    shorted, shunted = run("shunt_damping.py", address, tmp_path)
    assert shunted[-1] < 0.05 * shorted[-1]


def test_servo_moves_the_end_of_the_beam_as_commanded(address, tmp_path):
    (height, wanted, error), = run("servo_beam.py", address, tmp_path)
    assert wanted == 400
    assert height == pytest.approx(wanted, abs=2) and error < 25


def test_coupled_spring(address, tmp_path):
    """The explicit exchange feeds energy into the swing, the implicit one does not."""
    (loose, once), (window, passes) = run("coupled_spring.py", address, tmp_path)
    assert once == 1 and passes > 1.5
    assert loose > 1.5 * window > 0


def test_controllers(address, tmp_path):
    """Both loops settle although the controllers see only every tenth step."""
    (start, end, cart), (stroke, _) = run("controllers.py", address, tmp_path)
    assert start == 0.2 and abs(end) < 0.005 and abs(cart) < 0.02
    assert stroke == pytest.approx(100, abs=1)


def test_wind_on_chain(address, tmp_path):
    """Ports on a deck that has none; the wind carries the chain's end away once it is free."""
    (apart, samples), = run("wind_on_chain.py", address, tmp_path, "--steps", "1500", numbers=ALL)
    assert 0.1 < apart < 2 and samples == 150


def test_stiff_peer(address, tmp_path):
    """The plain exchange diverges; quasi-Newton needs fewer passes than Aitken."""
    _, plain, aitken, quasi_newton = run("stiff_peer.py", address, tmp_path, "--steps", "60", numbers=ALL)
    assert plain == [0, 0] and aitken[0] == quasi_newton[0] == 60
    assert 2 < quasi_newton[1] < 5 < aitken[1]


def test_strip_wing(address, tmp_path):
    """It flutters between 55 and 60 m/s: the last two fifths of the runs tell; the tangent saves exchanges and changes nothing."""
    *flights, plain = run("strip_wing.py", address, tmp_path)
    assert [speed for speed, *_ in flights] == [40, 55, 60, 70] and all(deflection > 20 for _, deflection, *_ in flights)
    assert [last > before for *_, before, last in flights] == [False, False, True, True]
    assert flights[0][2] < 0.8 * plain[0] and plain[1] < 1e-6


def test_two_daemons(address, tmp_path):
    """The halves fall as the whole does."""
    (fall, difference, exchanges), = run("two_daemons.py", address, tmp_path, "--steps", "60")
    assert fall > 0.3 and difference < 1e-7 and exchanges < 20


@pytest.mark.parametrize("script, least", [("controllers.py", 1), ("stiff_peer.py", 1), ("strip_wing.py", 5), ("two_daemons.py", 1), ("wind_on_chain.py", 1)])
def test_the_fewest_steps_are_enough_and_fewer_are_refused(address, tmp_path, script, least):
    run(script, address, tmp_path, "--steps", str(least))
    for steps in (least - 1, -1, 1.5, 10**12):
        assert refusal(script, "--steps", str(steps)) == f"argument --steps: expected a whole number from {least} to 10000000, got '{steps}'"


def test_a_picture_that_cannot_be_written_is_told_before_the_run(tmp_path):
    assert refusal("wind_on_chain.py", "--plot", "a.xyz") == "argument --plot: 'a.xyz' names no kind of picture: expected an ending like .png, .pdf, .svg"
    folder = tmp_path / "none"
    assert refusal("wind_on_chain.py", "--plot", str(folder / "a.png")) == f"argument --plot: there is no folder '{folder}' to write a picture into"


def refusal(script, *options):
    done = subprocess.run([sys.executable, os.path.join(SCRIPTS, script), *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=60)
    assert done.returncode == 2 and done.stdout == ""
    return done.stderr.splitlines()[-1].partition(f"{script}: error: ")[2]
