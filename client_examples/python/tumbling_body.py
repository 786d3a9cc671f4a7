#!/usr/bin/env python3
"""Steps the tumbling body on a server, shows a progress bar, and plots its spin.

usage: tumbling_body.py [--address ADDRESS] [--deck DECK] [--plot FILE.png]
"""
from __future__ import annotations

import os
import sys

import numpy as np
from tqdm import tqdm

import example
import mbcosim

SPIN, ROTATION = "node.structural.1.Omega", "node.structural.1.R"
INERTIA = np.diag([1.0, 2.0, 3.0])  # of the deck, node frame [kg m^2]


def simulate(simulation: mbcosim.Simulation) -> tuple[example.Array, example.Array, example.Array]:
    """Times (n), spins in the node frame (n x 3), kinetic energies (n)."""
    info = simulation.describe()
    steps = round((info.final_time - info.initial_time) / info.step_size)
    times, found = [], []
    with simulation.stepper(outputs=[SPIN, ROTATION]) as stepper:
        for _ in tqdm(range(steps), unit="step", disable=not sys.stderr.isatty()):
            result = stepper.step()
            times.append(result.time)
            found.append(result.values[ROTATION].T @ result.values[SPIN])
    spins = np.array(found)
    return np.array(times), spins, 0.5 * np.einsum("ni,ij,nj->n", spins, INERTIA, spins)


def plot(times: example.Array, spins: example.Array, path: str) -> None:
    picture, axes = example.figure(figsize=(8, 4))
    for axis, label in enumerate("xyz"):
        axes[0, 0].plot(times, spins[:, axis], label=f"about {label}")
    axes[0, 0].set(xlabel="time [s]", ylabel="spin in the body's frame [rad/s]", title="Tumbling body")
    axes[0, 0].legend()
    picture.savefig(path, dpi=120)


def main() -> None:
    options = example.options(__doc__, "tumbling.png", deck=example.model("tumbling.mbd"))
    with mbcosim.connect_or_start(options.address) as server, server.load(options.deck, name="tumbling body") as simulation:
        times, spins, energy = simulate(simulation)
    plot(times, spins, options.plot)

    print(f"{'time [s]':>10} {'wx':>10} {'wy':>10} {'wz':>10} {'energy [J]':>12}   (spin in rad/s, body frame)")
    for i in np.linspace(0, len(times) - 1, 6).astype(int):
        print(f"{times[i]:10.3f} {spins[i, 0]:10.4f} {spins[i, 1]:10.4f} {spins[i, 2]:10.4f} {energy[i]:12.6f}")
    print(f"plot: {os.path.abspath(options.plot)}")


if __name__ == "__main__":
    main()
