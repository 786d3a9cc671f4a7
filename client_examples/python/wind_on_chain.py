#!/usr/bin/env python3
"""An unmodified deck gets ports from its client: the chain of the tutorials, which swings when its right support lets go, in a wind
whose drag is computed here. A second port only watches.

usage: wind_on_chain.py [--address ADDRESS] [--plot FILE.png] [--steps N]
"""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

import example
import mbcosim

LINKS = [1, 2, 3, 4]
ENDS = [[0.5, 0.0, 0.0]] * 4                # points at the links' right ends, in their frames [m]
WIND = np.array([-6.0, 0.0, 0.0])           # [m/s]
DRAG = 0.5 * 1.225 * 1.2 * 0.2              # density / 2, coefficient, area of a link [kg/m]
MIDDLE = "node.structural.2.X"


def drag(motion: mbcosim.Motion) -> example.Array:
    """Forces at the points, 4 x 3 [N]."""
    wind = WIND - motion.v
    force: example.Array = DRAG * np.linalg.norm(wind, axis=1, keepdims=True) * wind
    return force


def swing(server: mbcosim.Server, force: Callable[[mbcosim.Motion], example.Array], steps: int) -> tuple[example.Array, example.Array]:
    """Positions of the chain's end (n x 3), and of the second link's middle as the other port saw it."""
    ends: list[example.Array] = []
    seen: list[example.Array] = []

    def push(motion: mbcosim.Motion) -> example.Array:
        ends.append(motion.x[-1])
        return force(motion)

    def look(motion: mbcosim.Motion) -> list[float]:
        seen.append(motion.signals)
        return []

    ports = [mbcosim.structural_port("wind", nodes=LINKS, offsets=ENDS), mbcosim.signal_port("watch", [MIDDLE], [])]
    with server.load(example.model("chain.mbd"), ports=ports) as simulation:
        with simulation.couple("wind", push), simulation.couple("watch", look, every=10):
            simulation.step(steps)
    return np.array(ends), np.array(seen)


def main() -> None:
    options = example.options(__doc__, "chain.png", steps=3000)
    with mbcosim.connect_or_start(options.address) as server:
        still, _ = swing(server, lambda motion: 0 * motion.x, options.steps)
        windy, middle = swing(server, drag, options.steps)

    picture, axes = example.figure(figsize=(8, 6))
    axes[0, 0].plot(still[:, 0], still[:, 2], label="end of the chain, no wind")
    axes[0, 0].plot(windy[:, 0], windy[:, 2], label=f"end of the chain, {-WIND[0]:g} m/s of wind from the right")
    axes[0, 0].plot(middle[:, 0], middle[:, 2], ".", markersize=2, label="second link in the wind")
    axes[0, 0].plot(0, 0, "k^")
    axes[0, 0].set(xlabel="x [m]", ylabel="z [m]", title="The tutorials' chain in a wind", aspect="equal",
                   ylim=(-4.2, 1.2))
    axes[0, 0].legend(loc="upper left")
    example.save(picture, options.plot)
    apart = np.linalg.norm(windy - still, axis=1)
    print(f"the end is {apart[-1]:.3f} m from where it would be without wind; {len(middle)} samples of the second port")


if __name__ == "__main__":
    main()
