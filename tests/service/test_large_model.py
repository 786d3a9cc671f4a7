"""A model of ten thousand bodies is of use to clients with the limits that their libraries have by default."""
import asyncio

import numpy as np
import pytest

import mbcosim
import mbcosim.aio
from test_geometry import CHAIN

BODIES = 10_000
DECK = CHAIN.format(n=BODIES)
X = f"node.structural.{BODIES}.X"


@pytest.fixture
def default_limits(monkeypatch):
    """The Python library without limits of its own on what it receives: 4 MiB for a message."""
    kept = [option for option in mbcosim.rpc.CHANNEL_OPTIONS if option[0] != "grpc.max_receive_message_length"]
    monkeypatch.setattr(mbcosim.rpc, "CHANNEL_OPTIONS", kept)
    monkeypatch.setattr(mbcosim.client, "CHANNEL_OPTIONS", kept)
    monkeypatch.setattr(mbcosim.aio, "CHANNEL_OPTIONS", kept)


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
