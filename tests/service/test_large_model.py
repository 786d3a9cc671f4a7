"""A model of ten thousand bodies is of use to clients with the limits that their libraries have by default."""
import asyncio
import os
import resource
import subprocess

import numpy as np
import pytest

import mbcosim
import mbcosim.aio
from conftest import BIN, Daemon, counts_memory
from test_geometry import CHAIN

BODIES = 10_000
DECK = CHAIN.format(n=BODIES)
X = f"node.structural.{BODIES}.X"


@pytest.fixture
def default_limits(monkeypatch):
    """The Python library without limits of its own on what it receives: 4 MiB for a message."""
    kept = [option for option in mbcosim.rpc.CHANNEL_OPTIONS if option[0] != "grpc.max_receive_message_length"]
    monkeypatch.setattr(mbcosim.rpc, "CHANNEL_OPTIONS", kept)


def look_at(described, geometry, linear, x):
    E, A, _, _, _ = linear
    assert len(described.nodes) == BODIES and len(described.elements) == 2 * BODIES
    assert len(geometry.nodes) == BODIES and sum(len(e.masses) for e in geometry.elements) == BODIES
    assert E.shape == A.shape and A.shape[0] >= 12 * BODIES and A.nnz < 100 * A.shape[0]
    assert np.allclose(x, [BODIES, 0, 0], atol=0.1)


def test_from_python(default_limits, daemon):
    with mbcosim.connect(daemon.address) as server, server.load_text(DECK) as simulation:
        linear = simulation.linearize_descriptor(sparse=True)
        result = simulation.step(outputs=[X])
        assert result.step == 1
        look_at(simulation.describe(), simulation.geometry(), linear, result.values[X])


def test_from_asyncio(default_limits, daemon):
    async def main():
        async with mbcosim.aio.connect(daemon.address) as server, await server.load_text(DECK) as simulation:
            linear = await simulation.linearize_descriptor(sparse=True)
            result = await simulation.step(outputs=[X])
            look_at(await simulation.describe(), await simulation.geometry(), linear, result.values[X])

    asyncio.run(main())


MOVING = CHAIN.format(n=1000).replace("real(k), 0., 0.", "1.01*real(k), 0., 0.").replace("final time: 1.", "final time: 3.e-3")


def test_threads_of_a_daemon_change_no_bit(tmp_path):
    names = [f"node.structural.{k}.{what}" for k in (2, 500, 1000) for what in ("X", "XP", "R")]

    def moved(threads):
        folder = tmp_path / str(threads)
        folder.mkdir()
        running = Daemon(str(folder), "--threads", str(threads))
        try:
            with running.connect() as server, server.load_text(MOVING) as simulation:
                values = simulation.step(3, outputs=names).values
                assert abs(values["node.structural.2.XP"][0]) > 0
                return b"".join(values[name].tobytes() for name in names)
        finally:
            running.stop()

    assert moved(1) == moved(2) == moved(3)


def test_threads_of_a_run_change_no_byte(tmp_path):
    (tmp_path / "deck.mbd").write_text(MOVING)

    def run(*options):
        return subprocess.run([os.path.join(BIN, "mbcosim"), "run", "deck.mbd", *options], cwd=tmp_path, capture_output=True, text=True, timeout=300,
                              check=False)

    for prefix, options in (("one", ["--threads", "1"]), ("two", ["--threads", "2"]), ("all", [])):
        done = run("-o", prefix, *options)
        assert done.returncode == 0, done.stderr
    for ending in ("mov", "jnt", "ine"):
        assert (tmp_path / f"one.{ending}").read_bytes() == (tmp_path / f"two.{ending}").read_bytes() == (tmp_path / f"all.{ending}").read_bytes()
    refused = run("-o", "none", "--threads", "0")
    assert refused.returncode != 0 and "--threads" in refused.stderr
    assert not (tmp_path / "none.mov").exists()


@counts_memory
@pytest.mark.parametrize("limit", [resource.RLIM_INFINITY, 4 << 30])
def test_a_run_keeps_the_memory_that_it_frees(tmp_path, limit):
    """Each page is asked for once: what the system gives comes near the largest memory, in huge pages, which a limit on addresses
    forbids, even less often."""
    (tmp_path / "deck.mbd").write_text(MOVING)
    process = subprocess.Popen([os.path.join(BIN, "mbcosim"), "run", "deck.mbd", "--threads", "1"], cwd=tmp_path, stdout=subprocess.DEVNULL,
                               preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0
    assert used.ru_minflt * os.sysconf("SC_PAGESIZE") < 1.3 * used.ru_maxrss * 1024
