#!/usr/bin/env python3
"""Hangs the pendulum's body on a spring that this script computes, explicitly and implicitly.

usage: coupled_spring.py [--address ADDRESS] [--plot FILE.png]
"""
from __future__ import annotations

from typing import Any

import numpy as np

import example
import mbcosim

POSITION = "node.structural.2.X"
STIFFNESS, ANCHOR = 300.0, np.array([1.0, 0.0, 0.0])  # [N/m], where the body starts [m]
STEPS = 400


def spring(motion: mbcosim.Motion) -> example.Array:
    """Force on the body, 1 x 3."""
    return STIFFNESS * (ANCHOR - motion.x)


def swing(server: mbcosim.Server, **options: Any) -> tuple[example.Array, example.Array, float]:
    """Times (n), heights (n) and exchanges a step."""
    ports = [mbcosim.structural_port("spring", nodes=[2])]
    with server.load(example.model("pendulum.mbd"), ports=ports) as simulation:
        with simulation.couple("spring", spring, **options) as peer, simulation.stepper(outputs=[POSITION]) as stepper:
            results = [stepper.step() for _ in range(STEPS)]
            exchanges = peer.exchanges / STEPS
    return np.array([r.time for r in results]), np.array([r.values[POSITION][2] for r in results]), exchanges


def main() -> None:
    options = example.options(__doc__, "coupled_spring.png")
    with mbcosim.connect_or_start(options.address) as server:
        runs = {"loose": swing(server), "window, IQN-ILS": swing(server, mode="window", acceleration="iqn_ils")}

    picture, axes = example.figure(figsize=(8, 4))
    for name, (times, heights, _) in runs.items():
        axes[0, 0].plot(times, 1000 * heights, label=name)
    axes[0, 0].set(xlabel="time [s]", ylabel="height [mm]", title="Pendulum on a spring computed by a peer")
    axes[0, 0].legend()
    example.save(picture, options.plot)
    for name, (_, heights, exchanges) in runs.items():
        print(f"{name}: swings over {1000 * np.ptp(heights[-100:]):.3f} mm at the end, {exchanges:.2f} exchanges a step")


if __name__ == "__main__":
    main()
