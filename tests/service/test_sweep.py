"""The Dask sweep of the examples over three daemons behind HAProxy: spread evenly, the same numbers as alone, one daemon killed."""
import os
import re
import subprocess
import sys
import threading

import pytest

pytest.importorskip("distributed", reason="python3-distributed is missing: docker/install-dependencies.sh test")

from conftest import MODELS, TIME_FACTOR  # noqa: E402
from test_balanced import IDS, Cluster, cluster  # noqa: E402, F401 (fixture)

SCRIPTS = os.path.join(MODELS, "..", "python")
sys.path.insert(0, SCRIPTS)

import sweep  # noqa: E402

SINKS, HOLES = [1.0, 1.5, 2.0, 2.5, 3.0, 3.5], [1e-4, 2e-4, 2.2e-4, 3e-4, 4e-4]


@pytest.fixture
def dask():
    with sweep.dask_client() as client:
        yield client


def numbers(drop):
    return drop.sink, drop.hole, drop.load, drop.stroke


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """What one daemon says, point after point."""
    import mbcosim
    from conftest import BIN
    with open(os.path.join(MODELS, "landing_gear.mbd"), encoding="utf-8") as file, \
            mbcosim.local(program=os.path.join(BIN, "mbcosimd")) as server:
        deck = file.read()
        return [numbers(sweep.drop(server.address, deck, sink, hole)) for sink in SINKS for hole in HOLES]


def address_of(cluster):
    return f"127.0.0.1:{cluster.port}"


def test_points_spread_and_are_those_of_one_daemon(cluster, dask, alone):
    drops = dask.gather(sweep.sweep(dask, address_of(cluster), SINKS, HOLES))
    assert [numbers(drop) for drop in drops] == alone
    counts = [sum(drop.daemon == id for drop in drops) for id in IDS]
    assert sum(counts) == len(drops) and min(counts) >= len(drops) // 10, counts


def test_nothing_looks_at_all_threads(cluster, dask, monkeypatch):
    """Which may stop Debian 12's Python for ever: sweep.PROFILE."""
    looks, frames = [], sys._current_frames
    monkeypatch.setattr(sys, "_current_frames", lambda: looks.append(threading.current_thread().name) or frames())
    dask.gather(sweep.sweep(dask, address_of(cluster), SINKS[:3], HOLES))
    assert not looks


def test_points_of_a_daemon_that_is_killed_are_done_again(cluster, dask, alone):
    futures = sweep.sweep(dask, address_of(cluster), SINKS, HOLES)
    futures[0].result(60 * TIME_FACTOR)
    cluster.daemons["b"].kill()
    futures += sweep.sweep(dask, address_of(cluster), SINKS, HOLES)
    assert [numbers(drop) for drop in dask.gather(futures[:len(alone)])] == alone
    cluster.start("b")
    assert [numbers(drop) for drop in dask.gather(futures[len(alone):])] == alone


def test_the_script_finds_the_best_hole(cluster, tmp_path):
    plot = tmp_path / "sweep.png"
    done = subprocess.run([sys.executable, os.path.join(SCRIPTS, "sweep.py"), "--address", address_of(cluster), "--plot", str(plot), "--points", "5"],
                          capture_output=True, text=True, timeout=200 * TIME_FACTOR)
    assert done.returncode == 0, done.stderr
    _, best, counts = done.stdout.splitlines()
    load, hole = map(float, re.fullmatch(r"at 3.5 m/s the load is least, (.*) kN, with a hole of (.*) mm²", best).groups())
    assert hole == 200.0 and 20 < load < 40  # between those that are too small and too large
    assert counts.startswith("25 simulations, ") and counts.count(" on daemon ") == 3
    assert plot.read_bytes().startswith(b"\x89PNG") and plot.stat().st_size > 10000
