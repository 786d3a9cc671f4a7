#!/usr/bin/env python3
"""Closes the loop around the hydraulically actuated beam: a controller here opens the servo valve of the model on the server.

The controller is proportional to the error of the cylinder's stroke, with a command that follows a smooth step.

usage: servo_beam.py [--address ADDRESS] [--plot FILE.png]
"""
import numpy as np

import example
import mbcosim

PISTON, TIP, LOWER, UPPER = "node.structural.201.X", "node.structural.108.X", "node.hydraulic.1200.x", "node.hydraulic.1100.x"
VALVE = "node.parameter.1.x"
BASE = np.array([0.0, 0.0, -0.5])   # pin of the cylinder [m]
GAIN = 30.0                         # valve opening per metre of error [1/m]
STROKE, RAMP, END = 0.1, 1.5, 3.0   # wanted change of the stroke [m], its duration, duration of the run [s]
EVERY = 5                           # steps of the model per sample of the controller


def command(time):
    """Wanted change of the stroke [m]: half a cosine up to STROKE."""
    return STROKE / 2 * (1 - np.cos(np.pi * min(time / RAMP, 1.0)))


def control(simulation):
    """Rows: time, command, stroke, valve, tip height, pressures."""
    outputs = [PISTON, TIP, LOWER, UPPER]
    start = np.linalg.norm(simulation[PISTON] - BASE)
    rows, valve = [], 0.0
    with simulation.stepper(outputs=outputs, inputs=[VALVE]) as stepper:
        while not rows or rows[-1][0] < END:
            result = stepper.step([valve], count=EVERY)
            stroke = np.linalg.norm(result.values[PISTON] - BASE) - start
            valve = float(np.clip(GAIN * (command(result.time) - stroke), -1, 1))
            rows.append((result.time, command(result.time), stroke, valve, result.values[TIP][2],
                         result.values[LOWER], result.values[UPPER]))
    return np.array(rows).T


def main():
    options = example.options(__doc__, "servo.png")
    with mbcosim.connect(options.address) as server, server.load(example.model("actuated_beam_servo.mbd")) as simulation:
        times, wanted, stroke, valve, tip, lower, upper = control(simulation)

    picture, axes = example.figure(3, figsize=(8, 8), sharex=True)
    axes[0, 0].plot(times, 1e3 * wanted, "k--", label="command")
    axes[0, 0].plot(times, 1e3 * stroke, label="stroke")
    axes[0, 0].plot(times, 1e2 * tip, label="height of the beam's end / 10")
    axes[0, 0].set(ylabel="[mm]", title="Hydraulic servo with a flexible beam")
    axes[1, 0].plot(times, 1e-5 * lower, label="lower chamber")
    axes[1, 0].plot(times, 1e-5 * upper, label="upper chamber")
    axes[1, 0].set(ylabel="pressure [bar]")
    axes[2, 0].plot(times, valve, label="valve")
    axes[2, 0].set(xlabel="time [s]", ylabel="opening [-]")
    for axis in axes[:, 0]:
        axis.legend()
    example.save(picture, options.plot)
    print(f"stroke at the end: {1e3 * stroke[-1]:.2f} mm of {1e3 * STROKE:g} mm wanted; "
          f"largest error: {1e3 * np.abs(wanted - stroke).max():.2f} mm")


if __name__ == "__main__":
    main()
