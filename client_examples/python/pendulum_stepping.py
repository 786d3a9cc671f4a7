#!/usr/bin/env python3
"""Steps a pendulum, then returns to a saved state and steps it again under a push.

usage: pendulum_stepping.py [--address ADDRESS] [--plot FILE.png]
"""
from __future__ import annotations

import numpy as np

import example
import mbcosim

POSITION, LOAD = "node.structural.2.X", "node.structural.2.load"
STEPS, SAVED, PUSH = 600, 200, 3.0  # steps of 5 ms; step of the saved state; push upwards [N]


def swing(simulation: mbcosim.Simulation, steps: int, push: float) -> tuple[example.Array, example.Array]:
    """Times (n) and positions (n x 3)."""
    times, positions = [], []
    with simulation.stepper(outputs=[POSITION], inputs=[LOAD]) as stepper:
        for _ in range(steps):
            result = stepper.step([0, 0, push, 0, 0, 0])
            times.append(result.time)
            positions.append(result.values[POSITION])
    return np.array(times), np.array(positions)


def main() -> None:
    options = example.options(__doc__, "pendulum.png")
    with mbcosim.connect_or_start(options.address) as server, server.load(example.model("pendulum.mbd")) as pendulum:
        before = swing(pendulum, SAVED, 0.0)
        saved = pendulum.snapshot()
        free = swing(pendulum, STEPS - SAVED, 0.0)
        saved.restore()
        pushed = swing(pendulum, STEPS - SAVED, PUSH)

    picture, axes = example.figure(figsize=(8, 4))
    for (times, positions), style in ((before, "k-"), (free, "C0-"), (pushed, "C1--")):
        angle = np.degrees(np.arctan2(positions[:, 0], -positions[:, 2]))
        axes[0, 0].plot(times, angle, style)
    axes[0, 0].axvline(before[0][-1], color="0.7", linewidth=1)
    axes[0, 0].legend(["until the snapshot", "free", f"again, pushed up by {PUSH:g} N"])
    axes[0, 0].set(xlabel="time [s]", ylabel="angle from the vertical [degrees]", title="Pendulum from a saved state")
    example.save(picture, options.plot)
    print(f"highest point after the snapshot, free: {free[1][:, 2].max():.4f} m, pushed: {pushed[1][:, 2].max():.4f} m")


if __name__ == "__main__":
    main()
