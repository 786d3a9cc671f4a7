#!/usr/bin/env python3
"""A slow, stiff peer in window coupling: the pendulum's body carries a container with a heavy mass on a stiff spring, which the peer
integrates with many small steps of its own. It is called once per pass, and steps are redone until both sides agree.

The plain exchange of such a peer diverges; quasi-Newton (IQN-ILS) needs a few passes.

usage: stiff_peer.py [--address ADDRESS] [--plot FILE.png] [--steps N]
"""
from __future__ import annotations

import time

import numpy as np

import example
import mbcosim

MASS, STIFFNESS, DAMPING = 3.0, 3.0e5, 60.0  # [kg], [N/m], [N s/m]; the pendulum's body has 1 kg
SUBSTEPS, DELAY = 20, 1e-3                 # of the peer within a step; what a pass costs in a real solver [s]
GRAVITY = np.array([0.0, 0.0, -9.81])
BODY = "node.structural.2.X"
METHODS = {"none": "plain", "aitken": "Aitken", "iqn_ils": "IQN-ILS"}
LINES = {"plain": ("C3", ":", 1.5), "Aitken": ("C1", "-", 4.0), "IQN-ILS": ("C0", "--", 1.5)}  # the last two lie on each other


class Container:
    """The mass on its spring. Keeps the state at the start of the step until the step is accepted."""

    def __init__(self) -> None:
        start = np.array([1.0, 0, 0])
        self.kept = self.last = (0.0, start, np.zeros(3), start)
        self.step, self.time = 0, 0.0
        self.passes: list[int] = []

    def answer(self, motion: mbcosim.Motion) -> list[example.Array]:
        """Force of the spring on the body at the end of the step, 1 x 3."""
        time.sleep(DELAY)
        if motion.step > self.step:  # the step before was accepted with the last pass
            self.kept, self.step = self.last, motion.step
            self.passes.append(0)
        self.passes[-1] += 1
        start, y, v, x = self.kept
        h = (motion.time - start) / SUBSTEPS
        moved = (motion.x[0] - x) / SUBSTEPS  # the body moves on a line within the step
        velocity = moved / h
        for _ in range(SUBSTEPS):  # implicit Euler
            x = x + moved
            v = (v + h * (GRAVITY + (STIFFNESS * (x - y) + DAMPING * velocity) / MASS)) / (
                1 + h * (DAMPING + h * STIFFNESS) / MASS)
            y = y + h * v
        self.last = (motion.time, y, v, x)
        return [STIFFNESS * (y - x) + DAMPING * (v - velocity)]


def swing(server: mbcosim.Server, steps: int, acceleration: str) -> tuple[example.Array, list[int]]:
    """Times, heights [m] and passes of the steps that went well."""
    container, rows = Container(), []
    ports = [mbcosim.structural_port("container", nodes=[2])]
    with server.load(example.model("pendulum.mbd"), ports=ports) as simulation:
        with simulation.couple("container", container.answer, mode="window", acceleration=acceleration, relaxation=0.05,
                               tolerance=1e-6, maximum_passes=100), simulation.stepper([BODY]) as stepper:
            try:
                for _ in range(steps):
                    result = stepper.step()
                    rows.append((result.time, result.values[BODY][2]))
            except mbcosim.StepFailed as error:
                print(f"{METHODS[acceleration]}: {error}")
    return np.array(rows).reshape(-1, 2).T, container.passes[:len(rows)]


def main() -> None:
    options = example.options(__doc__, "stiff.png", steps=200)
    with mbcosim.connect_or_start(options.address) as server:
        runs = {name: swing(server, options.steps, method) for method, name in METHODS.items()}

    picture, axes = example.figure(2, figsize=(8, 7), sharex=True)
    for name, ((times, heights), passes) in runs.items():
        color, line, width = LINES[name]
        if passes:
            axes[0, 0].plot(times, heights, line, color=color, linewidth=width, label=name)
        axes[1, 0].plot(times, passes, ".", color=color, label=name if passes else f"{name}: diverges in the first step")
    axes[0, 0].set(ylabel="height [m]", title="A pendulum that carries a heavy mass on a stiff spring")
    axes[1, 0].set(xlabel="time [s]", ylabel="passes of a step", ylim=(0, None))
    for axis in axes[:, 0]:
        axis.legend()
    example.save(picture, options.plot)
    for name, (_, passes) in runs.items():
        print(f"{name}: {len(passes)} steps, {np.mean(passes) if passes else 0.0:.2f} passes a step")


if __name__ == "__main__":
    main()
