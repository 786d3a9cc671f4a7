"""The gallery of client_examples/models: each deck against the source that its first lines name. Pictures go to the folder of MBCOSIM_PICTURES."""
import math
import os
import pathlib
import re
import shutil
import subprocess

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
MODELS = ROOT / "client_examples" / "models"
BINARY = os.path.join(os.environ["MBCOSIM_BIN"], "mbcosim")
SECONDS = 60 * float(os.environ.get("MBCOSIM_TIME_FACTOR", 1))


class Run:
    """A deck run to its end: time (records,), and for each node the columns of `.mov` (records, 12): position [m], Euler angles [degrees],
    velocity [m/s], angular velocity [rad/s]."""

    def __init__(self, folder, deck, **changes):
        text = (MODELS / f"{deck}.mbd").read_text()
        for old, new in changes.items():
            text, count = re.subn(rf"{old.replace('_', ' ')}: [^;]*;", f"{old.replace('_', ' ')}: {new};", text)
            assert count == 1
        source = folder / f"{deck}.mbd"
        source.write_text(text)
        self.prefix = folder / deck
        subprocess.run([BINARY, "run", source, "-o", self.prefix, "-q"], check=True, timeout=SECONDS)
        rows = np.loadtxt(f"{self.prefix}.mov", usecols=range(13))
        self.nodes = {int(label): rows[rows[:, 0] == label, 1:] for label in np.unique(rows[:, 0])}
        steps = re.findall(r"^Step \d+ (\S+)", pathlib.Path(f"{self.prefix}.out").read_text(), re.M)
        self.time = np.array(steps, float)


def draw(name, curves, x, y):
    """A picture of curves {label: (abscissa, ordinate)}."""
    folder = os.environ.get("MBCOSIM_PICTURES")
    if not folder:
        return
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(7, 4.2), layout="constrained")
    for label, (a, b) in curves.items():
        axes.plot(a, b, label=label, linewidth=1.4)
    axes.set(xlabel=x, ylabel=y, title=name.replace("_", " "))
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    os.makedirs(folder, exist_ok=True)
    figure.savefig(os.path.join(folder, f"{name}.png"), dpi=110)
    pyplot.close(figure)


def integrate(rate, state, seconds, steps):
    """Classical Runge-Kutta method of order four; rows of states, the first one included."""
    h, rows = seconds / steps, [np.array(state, float)]
    for k in range(steps):
        t, y = k * h, rows[-1]
        k1 = rate(t, y)
        k2 = rate(t + h / 2, y + h / 2 * k1)
        k3 = rate(t + h / 2, y + h / 2 * k2)
        rows.append(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(t + h, y + h * k3)))
    return np.array(rows)


def test_the_piston_of_the_slider_crank_follows_the_closed_form(tmp_path):
    run = Run(tmp_path, "slider_crank")
    angle = 2 * math.pi * run.time
    exact = 0.1 * np.cos(angle) + np.sqrt(0.3**2 - 0.1**2 * np.sin(angle)**2)
    piston = run.nodes[3][:, 0]
    draw("slider_crank", {"piston": (run.time, piston), "middle of the rod": (run.time, run.nodes[2][:, 1])}, "time [s]", "position [m]")
    assert np.ptp(piston) == pytest.approx(0.2, rel=1e-3)
    np.testing.assert_allclose(piston, exact, atol=1e-6)  # six decimals are written


# Test Set for IVP Solvers (Mazzia and Magherini), Andrews' squeezing mechanism, solution at 0.03 s: beta, Theta, gamma, Phi, delta,
# Omega, epsilon.
SQUEEZER = (15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304, 0.5347301163226948,
            1.048080741042263)


def squeezer_errors(folder, step):
    run = Run(folder, "squeezer", time_step=step)
    beta, theta, gamma, phi, delta, omega, epsilon = SQUEEZER
    exact = np.array([beta, beta + theta, gamma, phi + delta, delta, omega + epsilon, epsilon])
    angles = np.radians([run.nodes[k][-1, 5] for k in range(1, 8)])
    assert run.time[-1] == pytest.approx(0.03)
    return run, np.abs(np.angle(np.exp(1j * (angles - exact))))


def test_the_squeezer_approaches_the_angles_of_the_test_set_with_order_two(tmp_path):
    run, fine = squeezer_errors(tmp_path, "1.e-5")
    _, coarse = squeezer_errors(tmp_path, "2.e-5")
    time = run.time * 1e3
    draw("squeezer", {f"body {k}": (time, np.unwrap(np.radians(run.nodes[k][:, 5]))) for k in (3, 5, 7)}, "time [ms]", "angle [rad]")
    assert fine.max() < 1e-4  # rad, of a crank that has turned by 15.8
    assert math.log2(coarse[0] / fine[0]) == pytest.approx(2, abs=0.1)


def top_error(run):
    """Largest distance of a point of the axis, at 1 m, from steady precession; and its path."""
    roll, pitch = np.radians(run.nodes[1][:, 3]), np.radians(run.nodes[1][:, 4])
    axis = np.array([np.sin(pitch), -np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)])  # R e3 of Euler angles 1, 2, 3
    phase, tilt = 2 * run.time, math.pi / 6
    exact = np.array([math.sin(tilt) * np.cos(phase), math.sin(tilt) * np.sin(phase), np.full_like(phase, math.cos(tilt))])
    return np.linalg.norm(axis - exact, axis=0).max(), axis


def test_the_top_precesses_steadily(tmp_path):
    error, axis = top_error(Run(tmp_path, "heavy_top"))
    draw("heavy_top", {"axis, seen from above": (axis[0], axis[1])}, "x", "y")
    assert error < 1e-5  # over four seconds, with 71 rad/s of spin


def test_the_gyroscope_precesses_at_the_rate_of_the_fast_top(tmp_path):
    run = Run(tmp_path, "gyroscope")
    wheel = run.nodes[2]
    angle = np.unwrap(np.arctan2(wheel[:, 1], wheel[:, 0]))
    draw("gyroscope", {"path of the wheel": (angle, wheel[:, 2])}, "angle about the vertical [rad]", "height [m]")
    torque, spin, across = 9.81 * 0.1, 0.004 * 300, 0.012
    # The nutation (frequency C omega/A) averages out over whole periods.
    period = 2 * math.pi * across / spin
    whole = int(1 / period) * period
    rate = np.interp(whole, run.time, angle) / whole
    assert rate == pytest.approx(torque / spin, rel=2e-3)
    depth = 2 * torque * across / spin**2 * 0.1  # 2 m g l A/(C omega)^2, as an angle, times l
    assert wheel[:, 2].min() == pytest.approx(-depth, rel=0.02)


def test_the_rotor_blade_flaps_at_the_published_frequencies(tmp_path):
    run = Run(tmp_path, "rotor_blade")
    text = pathlib.Path(f"{run.prefix}_0.m").read_text()
    table = np.array([row.rstrip(";").split() for row in re.search(r"alpha = \[\s*(.*?)\];", text, re.S).group(1).splitlines() if row.strip()], float)
    coefficient = float(re.search(r"dCoef = (\S+);", text).group(1))
    ratio = (table[:, 0] + 1j * table[:, 1]) / table[:, 2]
    values = (ratio - 1) / (ratio + 1) / coefficient
    frequencies = np.sort(values.imag[values.imag > 0])
    draw("rotor_blade", {"tip, stretch": (run.time, run.nodes[25][:, 0] - 1)}, "time [s]", "displacement [m]")
    assert np.min(np.abs(frequencies - 5.5850)) < 5e-4 * 5.585
    assert np.min(np.abs(frequencies - 24.2733)) < 5e-4 * 24.2733


def test_the_robot_arm_moves_as_the_textbook_says(tmp_path):
    run = Run(tmp_path, "robot_arm")
    l1, l2, m1, m2, g, kp, kd = 0.5, 0.4, 2., 1., 9.81, 400., 40.

    def smooth(t):  # drive `step5`
        s = min(max(t, 0.), 1.)
        return s**3 * (10 + s * (6 * s - 15))

    def rate(t, y):  # Craig, eq. 6.58
        a, b, da, db = y
        tau1 = kp * (smooth(t) * (math.pi / 6 + math.pi / 2) - (a + math.pi / 2)) - kd * da
        tau2 = kp * (smooth(t) * math.pi / 3 - b) - kd * db
        c2, s2 = math.cos(b), math.sin(b)
        mass = np.array([[l2**2 * m2 + 2 * l1 * l2 * m2 * c2 + l1**2 * (m1 + m2), l2**2 * m2 + l1 * l2 * m2 * c2],
                         [l2**2 * m2 + l1 * l2 * m2 * c2, l2**2 * m2]])
        bias = np.array([-m2 * l1 * l2 * s2 * (db**2 + 2 * da * db) + m2 * l2 * g * math.cos(a + b) + (m1 + m2) * l1 * g * math.cos(a),
                         m2 * l1 * l2 * s2 * da**2 + m2 * l2 * g * math.cos(a + b)])
        return np.concatenate([y[2:], np.linalg.solve(mass, [tau1, tau2] - bias)])

    exact = integrate(rate, [-math.pi / 2, 0, 0, 0], run.time[-1], 4 * (len(run.time) - 1))[::4]
    upper, fore = np.radians(run.nodes[2][:, 5]), np.radians(run.nodes[3][:, 5])
    draw("robot_arm", {"link 1": (run.time, upper), "link 2": (run.time, fore)}, "time [s]", "angle [rad]")
    assert np.ptp(upper) > 2
    np.testing.assert_allclose(upper, exact[:, 0], atol=2e-5)
    np.testing.assert_allclose(fore, exact[:, 0] + exact[:, 1], atol=2e-5)


def test_the_landing_gear_drops_as_its_equations_say(tmp_path):
    run = Run(tmp_path, "landing_gear")
    airframe, wheel, g, length, stroke, pressure, area, hole = 1000., 50., 9.81, 1., 0.3, 6e5, 5e-3, 3e-4

    def rate(_, y):
        body, hub, v_body, v_hub = y
        compression, speed = hub + length - body, v_hub - v_body
        strut = pressure * area * (1 - compression / stroke)**-1.3
        strut += 0.5 * 870. * area * (area / (hole * 0.65))**2 * speed * abs(speed)
        if compression < 0:  # on its stop
            strut += 2e6 * compression + min(0., 2e4 * speed)
        tyre = max(0., 4e5 * (1 - hub))
        return np.array([v_body, v_hub, strut / airframe, (tyre - strut) / wheel - g])

    exact = integrate(rate, [2, 1, -3, -3], run.time[-1], 20 * (len(run.time) - 1))[::20]
    body, hub = run.nodes[1][:, 2], run.nodes[2][:, 2]
    draw("landing_gear", {"airframe": (run.time, body), "wheel": (run.time, hub)}, "time [s]", "height [m]")
    assert body.min() < 1.75  # the strut has given way by 0.2 m or more
    np.testing.assert_allclose(body, exact[:, 0], atol=1e-3)
    np.testing.assert_allclose(hub, exact[:, 1], atol=1e-3)


def test_the_quarter_car_takes_the_bump_as_its_equations_say(tmp_path):
    run = Run(tmp_path, "quarter_car")
    body_mass, wheel_mass, spring, tyre, piston, passage, loss, stroke, rest = 375., 75., 35e3, 193e3, 1e-3, 2e-5, 2., 0.15, 2e6
    bulk = 870. * 1300**2

    def density(p):
        return 870. * (1 + (p - 1e5) / bulk)

    def rate(t, y):  # heights of body and wheel, their velocities, pressures below and above the piston
        road = 0.025 * (1 - math.cos(2 * math.pi / 0.25 * (t - 0.1))) if 0.1 < t < 0.35 else 0.
        body, wheel, v_body, v_wheel, below, above = y
        drop, mean, speed = below - above, density((below + above) / 2), v_body - v_wheel
        flow = mean * passage * math.sqrt(2 / (loss * mean)) * math.copysign(math.sqrt(abs(drop)), drop)
        column = stroke + body - wheel
        strut = piston * drop - spring * (body - wheel)
        return np.array([v_body, v_wheel, strut / body_mass, (-strut - tyre * (wheel - road)) / wheel_mass,
                         (-flow - density(below) * piston * speed) / (piston * column) * bulk / 870.,
                         (flow + density(above) * piston * speed) / (piston * (2 * stroke - column)) * bulk / 870.])

    exact = integrate(rate, [0, 0, 0, 0, rest, rest], 1.5, 60000)
    instants = np.linspace(0, 1.5, len(exact))
    until = run.time <= 1.5
    body, wheel = run.nodes[1][until, 2] - 1, run.nodes[2][until, 2] - 0.5
    draw("quarter_car", {"body": (run.time[until], body), "wheel": (run.time[until], wheel)}, "time [s]", "height [m]")
    assert body.max() > 0.04
    np.testing.assert_allclose(body, np.interp(run.time[until], instants, exact[:, 0]), atol=1e-4)
    np.testing.assert_allclose(wheel, np.interp(run.time[until], instants, exact[:, 1]), atol=1e-4)


def test_the_pendulum_is_swung_up_and_held_as_its_equations_say(tmp_path):
    run = Run(tmp_path, "swing_up")
    cart, pole, length, inertia, g, push, gain = 1., 0.2, 0.5, 1e-3, 9.81, 3., 20.
    about = inertia + pole * length**2

    def rate(_, y):  # of cart and pendulum under the law of Astrom and Furuta, with the deck's catch
        x, angle, v, w = y
        energy = about * w * w / 2 + pole * g * length * (math.cos(angle) - 1)
        near = (1 + math.tanh(40 * (math.cos(angle) - 0.9))) / 2
        force = (1 - near) * ((cart + pole) * push * math.tanh(gain * energy * w * math.cos(angle) / push) - x - v)
        force += near * (3 * x + 5 * v + 40 * math.sin(angle) + 9 * w)
        mass = np.array([[cart + pole, pole * length * math.cos(angle)], [pole * length * math.cos(angle), about]])
        load = np.array([force + pole * length * w * w * math.sin(angle), pole * g * length * math.sin(angle)])
        return np.concatenate([y[2:], np.linalg.solve(mass, load)])

    exact = integrate(rate, [0, 2.8, 0, 0], run.time[-1], len(run.time) - 1)
    place = run.nodes[1][:, 0]
    angle = np.unwrap(np.arctan2(run.nodes[2][:, 0] - place, run.nodes[2][:, 2]))
    draw("swing_up", {"angle [rad]": (run.time, angle), "cart [m]": (run.time, place)}, "time [s]", "")
    assert angle[0] == pytest.approx(2.8) and np.abs(angle[run.time > 4]).max() < 0.05  # caught, at the first attempt
    np.testing.assert_allclose(place, exact[:, 0], atol=1e-3)
    np.testing.assert_allclose(angle, exact[:, 1], atol=1e-3)


def test_the_jib_of_the_crane_sags_and_swings_as_a_cantilever_with_a_mass_at_its_end(tmp_path):
    shutil.copy(MODELS / "modal_crane_jib.fem", tmp_path)
    run = Run(tmp_path, "modal_crane")
    length, line, stiffness, load, g, rope = 10., 100., 2e7, 500., 9.81, 6.
    tip, body = run.nodes[3], run.nodes[4]
    draw("modal_crane", {"end of the jib": (tip[:, 0], tip[:, 1]), "load": (body[:, 0], body[:, 1])}, "x [m]", "y [m]")

    def frequency_equation(x):  # Blevins, table 8-8
        return 1 + math.cos(x) * math.cosh(x) - load / (line * length) * x * (math.sin(x) * math.cosh(x) - math.cos(x) * math.sinh(x))

    low, high = 1.0, 1.87
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if frequency_equation(middle) > 0 else (low, middle)
    omega = low**2 * math.sqrt(stiffness / (line * length**4))
    sag = load * g * length**3 / (3 * stiffness) + line * g * length**4 / (8 * stiffness)
    still = run.time < 4  # before it turns: a fit of all frequencies and decays near the closed form
    t, z = run.time[still], tip[still, 2]

    def misfit(w, decay):
        basis = np.array([np.ones_like(t), np.exp(-decay * t) * np.cos(w * t), np.exp(-decay * t) * np.sin(w * t)]).T
        factors, residual, *_ = np.linalg.lstsq(basis, z, rcond=None)
        return residual[0], factors

    scan = [(misfit(w, decay)[0], w, decay) for w in np.linspace(0.95, 1.05, 101) * omega for decay in np.linspace(0, 0.4, 21)]
    _, found, decay = min(scan)
    assert found == pytest.approx(omega, rel=5e-3)  # the masses of the finite elements are lumped
    assert -misfit(found, decay)[1][0] == pytest.approx(sag, rel=1e-2)

    def rate(t, y):  # of a rope's direction and its rate, below the end of a rigid jib that turns as the deck says
        s = min(max(t - 4, 0.), 10.)
        turned = math.pi / 20 * (s - 10 / (2 * math.pi) * math.sin(math.pi / 5 * s))
        speed, gain = math.pi / 20 * (1 - math.cos(math.pi / 5 * s)), math.pi / 20 * math.pi / 5 * math.sin(math.pi / 5 * s)
        c, n = np.array([math.cos(turned), math.sin(turned), 0]), np.array([-math.sin(turned), math.cos(turned), 0])
        pull = length * (gain * n - speed**2 * c) + np.array([0, 0, g])
        return np.concatenate([y[3:], (-pull + (pull @ y[:3] - rope * y[3:] @ y[3:]) * y[:3]) / rope])

    exact = rope * integrate(rate, [0, 0, -1, 0, 0, 0], run.time[-1], len(run.time) - 1)[:, :3]
    swing = body[:, :3] - tip[:, :3]
    assert np.abs(exact[:, :2]).max() > 1  # it sways far, and more where the jib gives way
    np.testing.assert_allclose(np.linalg.norm(swing, axis=1), rope, atol=1e-5)
    np.testing.assert_allclose(swing[:, :2], exact[:, :2], atol=0.1)
    assert np.degrees(np.arctan2(tip[-1, 1], tip[-1, 0])) == pytest.approx(90, abs=1)
