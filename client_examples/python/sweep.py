#!/usr/bin/env python3
"""A study of two parameters with Dask: drop tests of a landing gear at several sink speeds, with holes for the oil from small to large.

usage: sweep.py [--address ADDRESS] [--plot FILE.png] [--points N] [--scheduler HOST:PORT]

Each of the N x N points is a task, and each task a simulation of its own. A proxy at ADDRESS (docker/haproxy.cfg) spreads them over its
daemons; a task whose daemon goes away is done again. With --scheduler the tasks run on the workers of that cluster, which must
reach ADDRESS and have the package; without, in this process.
"""
from __future__ import annotations

import collections
import dataclasses
import itertools
import re
from typing import Any, Iterable, Optional

import distributed
import numpy as np
from dask import config as dask_config

import example
import mbcosim

dask: Any = distributed  # a part of it has types, the rest would be refused
AIRFRAME, WHEEL = "node.structural.1.X", "node.structural.2.X"
TYRE, LENGTH = 4e5, 1.0  # as in the deck: stiffness [N/m], length of the strut [m]
IMPACT = 0.3             # in which load and stroke are largest [s]
AT_ONCE = 8              # simulations, where this process has the tasks
# Dask's profiler looks at all threads a hundred times a second, at which Python 3.11 up to 3.11.8 (Debian 12) may stop for ever:
# github.com/python/cpython/issues/106883. Workers of a cluster: DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED=False.
PROFILE = "distributed.worker.profile.enabled"


@dataclasses.dataclass(frozen=True, order=True)
class Drop:
    sink: float    # [m/s]
    hole: float    # [m^2]
    load: float    # on the ground, at most [N]
    stroke: float  # of the strut, at most [m]
    daemon: str    # that had the simulation


def drop(address: str, deck: str, sink: float, hole: float) -> Drop:
    """One point. Runs on any worker: all it needs comes with it."""
    with mbcosim.connect(address, reconnect=5) as server, \
            server.load_text(deck, symbols={"sink": sink, "hole": hole}, durability="none") as gear:
        history = gear.simulate([AIRFRAME, WHEEL], until=IMPACT)
        daemon = re.sub(r"simulations/(?:(.*)-)?.*", r"\1", gear.name)
    airframe, wheel = history[AIRFRAME][:, 2], history[WHEEL][:, 2]
    return Drop(sink, hole, float(TYRE * (LENGTH - wheel.min())), float(LENGTH - (airframe - wheel).min()), daemon)


def sweep(client: Any, address: str, sinks: Iterable[float], holes: Iterable[float]) -> list[Any]:
    """A future of a Drop for each pair, in order."""
    with open(example.model("landing_gear.mbd"), encoding="utf-8") as file:
        deck = file.read()
    pairs = list(itertools.product(sinks, holes))
    return [client.submit(drop, address, deck, *pair, pure=False, retries=5) for pair in pairs]


def dask_client(scheduler: Optional[str] = None) -> Any:
    """Of a cluster that runs, or of threads in this process: the work is done by the daemons."""
    if scheduler:
        return dask.Client(scheduler)
    dask_config.set({PROFILE: False})
    return dask.Client(n_workers=1, threads_per_worker=AT_ONCE, processes=False, dashboard_address=None)


def draw(path: str, drops: list[Drop], count: int) -> None:
    picture, axes = example.figure(2, figsize=(8, 8), sharex=True)
    for axis, name, label, unit in ((axes[0, 0], "load", "load on the ground [kN]", 1e3), (axes[1, 0], "stroke", "stroke of the strut [mm]", 1e-3)):
        for row in range(count):
            line = drops[row * count:(row + 1) * count]
            axis.plot([1e6 * d.hole for d in line], [getattr(d, name) / unit for d in line], color=str(0.8 - 0.8 * row / count),
                      label=f"{line[0].sink:.2f} m/s")
        axis.set(ylabel=label)
    axes[0, 0].legend(fontsize="small", ncols=2)
    axes[0, 0].set(title="Drop tests of a landing gear")
    axes[1, 0].set(xlabel="hole for the oil [mm²]")
    example.save(picture, path)


def main() -> None:
    options = example.options(__doc__, "sweep.png", points=8, scheduler="of a Dask cluster; default: threads of this process")
    count = options.points
    sinks, holes = np.linspace(1.0, 3.5, count), np.geomspace(1e-4, 4e-4, count)
    with mbcosim.connect_or_start(options.address) as server, dask_client(options.scheduler) as client:
        drops = client.gather(sweep(client, server.address, sinks.tolist(), holes.tolist()))
    draw(options.plot, drops, count)
    best = min((d.load, d) for d in drops[-count:])[1]
    print(f"at {best.sink:.1f} m/s the load is least, {best.load / 1000:.1f} kN, with a hole of {1e6 * best.hole:.1f} mm²")
    counts = collections.Counter(d.daemon for d in drops)
    print(f"{len(drops)} simulations" + "".join(f", {counts[name]} on daemon {name}" for name in sorted(counts) if name))


if __name__ == "__main__":
    main()
