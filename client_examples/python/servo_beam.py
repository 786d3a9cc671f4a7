#!/usr/bin/env python3
"""Closes the loop around the hydraulically actuated beam: a controller here opens the servo valve of the model on the server so that
the free end of the flexible beam follows a command.

Two loops: the inner one is proportional to the error of the cylinder's stroke; the outer one takes the stroke that a rigid beam would
need and corrects it by the integral of the end's error. Between two samples the valve stays as it is.

usage: servo_beam.py [--address ADDRESS] [--plot FILE.png]
"""
from __future__ import annotations

import math

import numpy as np

import example
import mbcosim

PISTON, TIP, LOWER, UPPER = "node.structural.201.X", "node.structural.108.X", "node.hydraulic.1200.x", "node.hydraulic.1100.x"
VALVE = "node.parameter.1.x"
BEAM, LEVER = 2.0, 0.5              # length of the beam, distance of the piston from its pin [m]
BASE = np.array([0.0, 0.0, -LEVER])  # pin of the cylinder
INNER, OUTER = 50.0, 0.2            # valve per stroke error [1/m], stroke per error of the end and second [1/s]
HEIGHT, RAMP, END = 0.4, 2.0, 4.0   # wanted height of the end [m], duration of the rise, of the run [s]
EVERY = 5                           # steps of the model per sample of the controller


def command(time: float) -> float:
    """Wanted height of the beam's end [m]: half a cosine up to HEIGHT."""
    return HEIGHT / 2 * (1 - math.cos(math.pi * min(time / RAMP, 1.0)))


def stroke_for(height: float) -> float:
    """Length of the cylinder that holds the end of a rigid beam at this height [m]."""
    return LEVER * math.sqrt(2 + 2 * height / BEAM)


def control(simulation: mbcosim.Simulation) -> example.Array:
    """Rows: time, command, height of the end, valve, pressures."""
    rows: list[tuple[float, ...]] = []
    valve, correction, before = 0.0, 0.0, 0.0
    with simulation.stepper(outputs=[PISTON, TIP, LOWER, UPPER], inputs=[VALVE]) as stepper:
        while not rows or rows[-1][0] < END:
            result = stepper.step([valve], count=EVERY)
            wanted, tip = command(result.time), result.values[TIP][2]
            correction += OUTER * (wanted - tip) * (result.time - before)
            before = result.time
            stroke = np.linalg.norm(result.values[PISTON] - BASE)
            valve = float(np.clip(INNER * (stroke_for(wanted) + correction - stroke), -1, 1))
            rows.append((result.time, wanted, tip, valve, result.values[LOWER], result.values[UPPER]))
    return np.array(rows).T


def main() -> None:
    options = example.options(__doc__, "servo.png")
    with mbcosim.connect_or_start(options.address) as server, server.load(example.model("actuated_beam_servo.mbd")) as simulation:
        times, wanted, tip, valve, lower, upper = control(simulation)

    picture, axes = example.figure(4, figsize=(8, 10), sharex=True)
    axes[0, 0].plot(times, 1e3 * wanted, "k--", label="commanded")
    axes[0, 0].plot(times, 1e3 * tip, label="reached")
    axes[0, 0].set(ylabel="height [mm]", title="End of a flexible beam on a hydraulic servo")
    axes[1, 0].plot(times, 1e3 * (wanted - tip), label="error of the end")
    axes[1, 0].set(ylabel="[mm]")
    axes[2, 0].plot(times, 1e-5 * lower, label="lower chamber")
    axes[2, 0].plot(times, 1e-5 * upper, label="upper chamber")
    axes[2, 0].set(ylabel="pressure [bar]")
    axes[3, 0].plot(times, valve, label="valve")
    axes[3, 0].set(xlabel="time [s]", ylabel="opening [-]")
    for axis in axes[:, 0]:
        axis.legend()
    example.save(picture, options.plot)
    print(f"height at the end: {1e3 * tip[-1]:.2f} mm of {1e3 * HEIGHT:.1f} mm wanted; "
          f"largest error: {1e3 * np.abs(wanted - tip).max():.2f} mm")


if __name__ == "__main__":
    main()
