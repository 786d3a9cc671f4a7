#!/usr/bin/env python3
"""One model cut in two, each half on a daemon of its own: the root half of a falling beam sends the motion of its end, the tip half
follows it and answers with its reactions. Steps are redone until both agree (window coupling, IQN-ILS).

usage: two_daemons.py [--address ADDRESS] [--second ADDRESS] [--plot FILE.png] [--steps N]

Without --second a second daemon is started for the run.
"""
from __future__ import annotations

from typing import Any, Optional

import numpy as np

import example
import mbcosim

CUT, TIP = 4, "node.structural.7.X"
REACTIONS = "port.cut.reactions"


class Half:
    """The tip half on its daemon. A pass restores the state at the start of the step, imposes the motion, and steps."""

    def __init__(self, simulation: mbcosim.Simulation) -> None:
        self.simulation = simulation
        self.heights: list[float] = []
        self._wanted: Any = None
        self._start = simulation.snapshot()
        self._height = simulation[TIP][2]
        self._follower = simulation.couple("cut", lambda motion: self._wanted)

    def answer(self, motion: mbcosim.Motion) -> tuple[list[example.Array], list[example.Array]]:
        """Force and moment on the root half's end."""
        if motion.iteration == 1:  # the step before was accepted with the last pass
            self.heights.append(self._height)
            self._start.delete()
            self._start = self.simulation.snapshot()
        else:
            self._start.restore()
        self._wanted = motion.x, motion.rotations
        values = self.simulation.step(outputs=[REACTIONS, TIP]).values
        self._height = values[TIP][2]
        return [values[REACTIONS][:3]], [values[REACTIONS][3:]]

    def close(self) -> None:
        self.heights.append(self._height)
        self._follower.close()


def fall_in_two(first: mbcosim.Server, second: mbcosim.Server, steps: int) -> tuple[example.Array, float]:
    """Heights of the tip after each step, and exchanges a step."""
    root_port, tip_port = mbcosim.structural_port("cut", nodes=[CUT]), mbcosim.motion_port("cut", nodes=[CUT])
    with first.load(example.model("cut_beam_root.mbd"), ports=[root_port]) as root, \
            second.load(example.model("cut_beam_tip.mbd"), ports=[tip_port]) as tip:
        half = Half(tip)
        with root.couple("cut", half.answer, mode="window", acceleration="iqn_ils", tolerance=1e-10) as peer:
            root.step(steps)
            exchanges = peer.exchanges / steps
        half.close()
    return np.array(half.heights[1:]), exchanges


def fall_whole(server: mbcosim.Server, steps: int) -> tuple[example.Array, example.Array]:
    """Times and heights of the tip of the uncut beam."""
    with server.load(example.model("cut_beam_whole.mbd")) as whole, whole.stepper([TIP]) as stepper:
        results = [stepper.step() for _ in range(steps)]
    return np.array([r.time for r in results]), np.array([r.values[TIP][2] for r in results])


def second_server(address: Optional[str]) -> mbcosim.Server:
    """A connection to the second daemon, which is started when no address is given."""
    return mbcosim.connect(address) if address else mbcosim.local()


def main() -> None:
    options = example.options(__doc__, "halves.png", steps=200, second=True)
    with mbcosim.connect_or_start(options.address) as first, second_server(options.second) as second:
        heights, exchanges = fall_in_two(first, second, options.steps)
        times, expected = fall_whole(first, options.steps)

    picture, axes = example.figure(2, figsize=(8, 7), sharex=True)
    axes[0, 0].plot(times, expected, "k", linewidth=3, alpha=0.3, label="uncut")
    axes[0, 0].plot(times, heights, label="two halves on two daemons")
    axes[0, 0].set(ylabel="height of the tip [m]", title="A falling beam, cut in two")
    axes[0, 0].legend()
    axes[1, 0].semilogy(times, np.maximum(np.abs(heights - expected), 1e-16))
    axes[1, 0].set(xlabel="time [s]", ylabel="difference [m]")
    example.save(picture, options.plot)
    print(f"the tip falls {-heights.min():.3f} m; largest difference to the uncut beam {np.abs(heights - expected).max():.2e} m, "
          f"{exchanges:.2f} exchanges a step")


if __name__ == "__main__":
    main()
