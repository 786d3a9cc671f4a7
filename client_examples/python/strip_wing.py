#!/usr/bin/env python3
"""Aeroelasticity with a peer: quasi-steady strip theory gives the lift of a beam wing that a gust hits, at several airspeeds.

Coupling is tight: the lift is computed anew in each iteration of the step. With its derivatives (the tangent) the iteration converges
as fast as that of the structure alone.

usage: strip_wing.py [--address ADDRESS] [--plot FILE.png] [--steps N]
"""
from __future__ import annotations

from typing import Any

import numpy as np

import example
import mbcosim

NODES = list(range(2, 10))             # along the span; the root does not move
CHORD, SPAN, AXIS = 1.8288, 6.096, 0.33  # [m]; elastic axis as a fraction of the chord from the leading edge
STRIPS = SPAN / 8 * np.array([1, 1, 1, 1, 1, 1, 1, 0.5])[:, None]  # widths [m]
DENSITY = 1.225                        # [kg/m^3]
GUST, FROM, UNTIL = 5.0, 0.1, 0.3      # upwards, 1 - cosine [m/s], [s]
TIP = "node.structural.9.X"
SPEEDS = [40.0, 55.0, 60.0, 70.0]      # [m/s]; it flutters from 57 m/s on
EPSILON = 1e-6                         # of the differences that give the tangent


def strip_loads(air: example.Array, R: example.Array, v: example.Array, w: example.Array) -> tuple[example.Array, example.Array]:
    """Forces and moments about the nodes (n x 3) of strips with velocity v and angular velocity w in air that moves with `air`."""
    span, up = R[:, :, 0], R[:, :, 2]
    to_rear = -R[:, :, 1]
    three_quarters = (0.75 - AXIS) * CHORD * to_rear  # there the flow is tangent to the chord
    wind = air - v - np.cross(w, three_quarters)
    along, across = np.sum(wind * to_rear, 1, keepdims=True), np.sum(wind * up, 1, keepdims=True)
    lift = np.pi * DENSITY * CHORD * STRIPS * across  # 2 pi per radian, times the speed below
    force = lift * np.cross(along * to_rear + across * up, span)
    moment = np.cross((0.25 - AXIS) * CHORD * to_rear, force)
    # The air that a pitching strip drags along: lift at the axis, and the damping of the pitch.
    half, pitch = CHORD / 2, np.sum(w * span, 1, keepdims=True)
    dragged = np.pi * DENSITY * half**2 * along * pitch * STRIPS
    return force + dragged * up, moment - dragged * half * (1.5 - 2 * AXIS) * span


def turned(R: example.Array, axis: example.Array) -> example.Array:
    """R after a small rotation about a global axis."""
    x, y, z = EPSILON * axis
    return R + np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ R


def tangent(air: example.Array, R: example.Array, v: example.Array, w: example.Array) -> tuple[example.Array, example.Array]:
    """Blocks d(force, moment)/d(position, rotation) and d/d(velocity, angular velocity): n x 6 x 6, by differences."""
    stiffness, damping = np.zeros((2, len(v), 6, 6))
    base = np.hstack(strip_loads(air, R, v, w))
    for i, axis in enumerate(np.eye(3)):
        stiffness[:, :, 3 + i] = np.hstack(strip_loads(air, turned(R, axis), v, w)) - base
        damping[:, :, i] = np.hstack(strip_loads(air, R, v + EPSILON * axis, w)) - base
        damping[:, :, 3 + i] = np.hstack(strip_loads(air, R, v, w + EPSILON * axis)) - base
    return stiffness / EPSILON, damping / EPSILON


def wind(speed: float, time: float) -> example.Array:
    """Velocity of the air [m/s]."""
    phase = np.clip((time - FROM) / (UNTIL - FROM), 0, 1)
    return np.array([speed, 0.0, GUST / 2 * (1 - np.cos(2 * np.pi * phase))])


def fly(server: mbcosim.Server, speed: float, steps: int, with_tangent: bool) -> tuple[example.Array, example.Array, float]:
    """Times, heights of the wing's tip [m], exchanges a step."""
    def aerodynamics(motion: mbcosim.Motion) -> Any:
        air = wind(speed, motion.target_time)
        force, moment = strip_loads(air, motion.rotations, motion.v, motion.w)
        if not with_tangent:
            return force, moment
        stiffness, damping = tangent(air, motion.rotations, motion.v, motion.w)
        return mbcosim.Loads(force, moment, stiffness=stiffness, damping=damping)

    ports = [mbcosim.structural_port("air", nodes=NODES)]
    with server.load(example.model("wing.mbd"), ports=ports) as simulation:
        form = "block_diagonal" if with_tangent else "none"
        with simulation.couple("air", aerodynamics, mode="tight", tangent=form) as peer, simulation.stepper([TIP]) as stepper:
            results = [stepper.step() for _ in range(steps)]
            exchanges = peer.exchanges / steps
    return np.array([r.time for r in results]), np.array([r.values[TIP][2] for r in results]), exchanges


def fate(heights: example.Array) -> str:
    """Of the oscillation: its range in the last fifth of a run beside that in the fifth before [mm]."""
    before, last = (1000 * np.ptp(part) for part in np.array_split(heights, 5)[-2:])
    return f"{'grows' if last > before else 'dies out'}, from {before:.3f} mm in the last fifth but one to {last:.3f} mm in the last"


def main() -> None:
    options = example.options(__doc__, "wing.png", steps=1000, least=5)
    with mbcosim.connect_or_start(options.address) as server:
        runs = {speed: fly(server, speed, options.steps, True) for speed in SPEEDS}
        plain = fly(server, SPEEDS[0], options.steps // 4, False)

    picture, axes = example.figure(figsize=(8, 4))
    for speed, (times, heights, _) in runs.items():
        axes[0, 0].plot(times, 1000 * heights, label=f"{speed:g} m/s")
    axes[0, 0].set(xlabel="time [s]", ylabel="height of the tip [mm]", title="A wing after a gust")
    axes[0, 0].legend()
    example.save(picture, options.plot)
    for speed, (_, heights, exchanges) in runs.items():
        print(f"{speed:.1f} m/s: largest deflection {1000 * np.abs(heights).max():.2f} mm, {exchanges:.2f} exchanges a step; "
              f"the oscillation {fate(heights)}")
    apart = np.abs(plain[1] - runs[SPEEDS[0]][1][:len(plain[1])]).max()
    print(f"without the tangent: {plain[2]:.2f} exchanges a step; the deflections differ by {apart:.2e} m")


if __name__ == "__main__":
    main()
