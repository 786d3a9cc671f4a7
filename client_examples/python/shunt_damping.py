#!/usr/bin/env python3
"""Runs the cantilever with piezoelectric patches short-circuited and shunted, side by side, and compares the vibration of the free end.

usage: shunt_damping.py [--address ADDRESS] [--plot FILE.png]
"""
from __future__ import annotations

import numpy as np

import example
import mbcosim

VELOCITY, VOLTAGE = "node.structural.3.XP", "node.abstract.11.x"
SHOWN = 0.06  # [s]


def vibrate(server: mbcosim.Server, deck: str) -> example.Array:
    """Times (n), transverse velocities of the free end (n), voltages (n)."""
    rows: list[tuple[float, float, float]] = []
    with server.load(example.model(deck)) as simulation, simulation.stepper(outputs=[VELOCITY, VOLTAGE]) as stepper:
        while not rows or rows[-1][0] < SHOWN:
            result = stepper.step()
            rows.append((result.time, result.values[VELOCITY][2], result.values[VOLTAGE]))
    return np.array(rows).T


def main() -> None:
    options = example.options(__doc__, "shunt.png")
    with mbcosim.connect_or_start(options.address) as server:
        runs = {"short-circuited": vibrate(server, "cantilever_piezo_shorted.mbd"), "shunted": vibrate(server, "cantilever_piezo_shunt.mbd")}

    picture, axes = example.figure(2, figsize=(8, 6), sharex=True)
    for name, (times, velocity, voltage) in runs.items():
        axes[0, 0].plot(times, velocity, label=name)
        axes[1, 0].plot(times, voltage, label=name)
    axes[0, 0].legend()
    axes[0, 0].set(ylabel="velocity of the free end [m/s]", title="Cantilever with piezoelectric patches")
    axes[1, 0].set(xlabel="time [s]", ylabel="voltage [V]")
    example.save(picture, options.plot)
    for name, (times, velocity, _) in runs.items():
        late = np.diff(velocity[(times > 0.01) & (times < 0.03)])
        print(f"{name:16} largest change of velocity in a step between 0.01 s and 0.03 s: {np.abs(late).max():.3e} m/s")


if __name__ == "__main__":
    main()
