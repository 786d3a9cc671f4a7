#!/usr/bin/env python3
"""Controllers as peers that see signals and answer signals, slower than the model: state feedback holds an inverted pendulum up, a
PID controller positions the hydraulic servo.

usage: controllers.py [--address ADDRESS] [--plot FILE.png] [--steps N]
"""
from __future__ import annotations

import math

import numpy as np

import example
import mbcosim

SAMPLE = 10  # steps of 1 ms between two exchanges

# Cart and pendulum: masses [kg], distance of the hinge from the centre of mass [m], inertia about it [kg m^2].
CART, POLE, LENGTH, INERTIA, G = 1.0, 0.2, 0.5, 1e-3, 9.81
WEIGHTS, EFFORT = np.diag([10.0, 1.0, 10.0, 1.0]), 0.1

PISTON, VALVE = "node.structural.201.X", "node.parameter.1.x"
PIN = np.array([0.0, 0.0, -0.5])  # of the cylinder [m]
STROKE, RAMP = 0.1, 1.0           # wanted change of the stroke [m], and its duration [s]
P, I, D = 40.0, 60.0, 0.8         # gains: valve opening per m, m s, m/s


def state_feedback() -> example.Array:
    """Gains (4) that minimize the integral of x' WEIGHTS x + EFFORT u^2 of the upright pendulum; x = (s, s', angle, angle')."""
    full, pole = CART + POLE, POLE * LENGTH
    mass = np.array([[full, pole], [pole, INERTIA + pole * LENGTH]])
    A, B = np.zeros((4, 4)), np.zeros((4, 1))
    A[0, 1] = A[2, 3] = 1
    A[[1, 3], 2] = np.linalg.solve(mass, [0, pole * G])
    B[[1, 3], 0] = np.linalg.solve(mass, [1, 0])
    hamiltonian = np.block([[A, -B @ B.T / EFFORT], [-WEIGHTS, -A.T]])
    values, vectors = np.linalg.eig(hamiltonian)
    stable = vectors[:, values.real < 0]
    riccati = np.real(stable[4:] @ np.linalg.inv(stable[:4]))
    gains: example.Array = (B.T @ riccati / EFFORT)[0]
    return gains


def balance(server: mbcosim.Server, steps: int) -> example.Array:
    """Rows: time, position of the cart, angle, force."""
    gains, rows = state_feedback(), []
    outputs = [f"node.structural.{node}.{name}" for node, name in ((1, "X"), (1, "XP"), (2, "R"), (2, "Omega"))]

    def control(motion: mbcosim.Motion) -> list[float]:
        x, v, R, w = np.split(motion.signals, [3, 6, 15])
        state = np.array([x[0], v[0], np.arctan2(R[2], R[8]), w[1]])
        force = -gains @ state
        rows.append((motion.time, state[0], state[2], force))
        return [force]

    ports = [mbcosim.signal_port("control", outputs, ["stream.force"])]
    with server.load(example.model("pendulum_cart.mbd"), ports=ports) as simulation:
        with simulation.couple("control", control, every=SAMPLE, hold="zero_order"):
            simulation.step(steps)
    return np.array(rows).T


def wanted(time: float) -> float:
    """Command of the stroke [m]: half a cosine."""
    return STROKE / 2 * (1 - math.cos(math.pi * min(time / RAMP, 1.0)))


def position(server: mbcosim.Server, steps: int) -> example.Array:
    """Rows: time, command, stroke, valve."""
    rows: list[tuple[float, ...]] = []
    state: dict[str, float] = {}
    period = SAMPLE * 1e-3

    def pid(motion: mbcosim.Motion) -> list[float]:
        length = float(np.linalg.norm(motion.signals - PIN))
        stroke = length - state.setdefault("start", length)
        error = wanted(motion.target_time) - stroke
        change = (error - state.get("error", error)) / period
        valve = P * error + I * state.get("integral", 0.0) + D * change
        if abs(valve) < 1:  # an integrator that winds up while the valve is full open would overshoot
            state["integral"] = state.get("integral", 0.0) + period * error
        state["error"] = error
        rows.append((motion.time, wanted(motion.time), stroke, np.clip(valve, -1, 1)))
        return [rows[-1][-1]]

    ports = [mbcosim.signal_port("servo", [PISTON], [VALVE])]
    with server.load(example.model("actuated_beam_servo.mbd"), ports=ports) as simulation:
        with simulation.couple("servo", pid, every=SAMPLE, hold="linear"):
            simulation.step(steps)
    return np.array(rows).T


def main() -> None:
    options = example.options(__doc__, "controllers.png", steps=3000)
    with mbcosim.connect_or_start(options.address) as server:
        times, cart, angle, force = balance(server, options.steps)
        servo_times, command, stroke, valve = position(server, options.steps)

    picture, axes = example.figure(4, figsize=(8, 9))
    axes[0, 0].plot(times, cart, label="cart [m]")
    axes[0, 0].plot(times, angle, label="pendulum [rad]")
    axes[0, 0].set(title="State feedback: an inverted pendulum on a cart")
    axes[1, 0].step(times, force, where="post", label="force [N]")
    axes[2, 0].plot(servo_times, 1000 * command, "k--", label="command [mm]")
    axes[2, 0].plot(servo_times, 1000 * stroke, label="stroke [mm]")
    axes[2, 0].set(title="PID: a hydraulic servo that bends a beam")
    axes[3, 0].plot(servo_times, valve, label="valve [-]")
    axes[3, 0].set(xlabel="time [s]")
    for axis in axes[:, 0]:
        axis.legend()
    example.save(picture, options.plot)
    print(f"pendulum: {angle[0]:.3f} rad at the start, {angle[-1]:.5f} rad at the end; cart at {cart[-1]:.4f} m")
    print(f"servo: {1000 * stroke[-1]:.2f} mm of {1000 * STROKE:.1f} mm wanted")


if __name__ == "__main__":
    main()
