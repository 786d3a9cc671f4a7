"""A state folder that version 0.1.0 left behind, killed: what it holds goes on with this version.

In tests/contract/state_folder are a simulation with checkpoints (step 100, snapshot "here", to step 1000, seven steps by request "asked
before", exported) and one with a journal and a peer (three steps with a load of 0.5 by the peer, the input 0.25 besides, two steps).
"""
import os
import shutil

import pytest

import mbcosim
from mbcosim.v1 import simulations_pb2 as pb
from test_durable import X, deck

STORED = os.path.join(os.path.dirname(__file__), "..", "contract", "state_folder")
CHECKPOINTS, JOURNAL = "simulations/old-2afca1773e4f039d", "simulations/old-d923dff1b245022e"


@pytest.fixture
def on_copy(start_daemon, tmp_path):
    """A daemon on a copy of the folder."""
    shutil.copytree(STORED, tmp_path / "state", copy_function=shutil.copyfile)
    return start_daemon("--state-dir", str(tmp_path / "state"))


@pytest.fixture
def server(on_copy):
    with on_copy.connect() as connection:
        yield connection


def positions(simulation):
    return simulation.read([X])[X]


def test_both_are_known(server):
    assert {info.name: (info.display_name, info.step, info.state) for info in server.list()} == {
        CHECKPOINTS: ("with checkpoints", 1007, pb.SIMULATION_STATE_SUSPENDED), JOURNAL: ("with a journal", 5, pb.SIMULATION_STATE_SUSPENDED)}


def test_the_log_warns_that_they_began_with_another_build(on_copy, server):
    for name in (CHECKPOINTS, JOURNAL):
        assert f"{name} began with mbcosim" not in on_copy.log()
        server.attach(name).read([X])
        line, = [line for line in on_copy.log().splitlines() if f"{name} began with mbcosim 0.1.0 (unknown build), this is " in line]
        assert "warning" in line and "need not have the bits" in line


def test_the_one_with_checkpoints_goes_on_with_its_snapshot_grants_and_replies(server):
    stored, straight = server.attach(CHECKPOINTS), server.load_text(deck(4000), durability="none")
    request = pb.StepRequest(simulation=CHECKPOINTS, steps=7, request_id="asked before", outputs=[0])
    assert server.simulations.Step(request).step == 1007  # of then, nothing is done
    stored.run_until(1e9)
    straight.run_until(1e9)
    assert positions(stored) == pytest.approx(positions(straight), rel=1e-9, abs=1e-12)
    saved, = stored.snapshots()
    assert (saved.display_name, saved.step) == ("here", 100)
    saved.restore()
    assert stored.step(900).step == 1000
    stored.refresh()
    assert stored.info.minimum_step_size == 1e-5 and [grant.identity for grant in stored.info.grants] == ["*"]


def test_the_one_with_a_journal_goes_on_with_its_input_and_peer(server):
    def steps(simulation, counts):
        with simulation.couple("hand", lambda motion: [[0, 0, 0.5]]):
            for count in counts:
                simulation.step(count)

    stored = server.attach(JOURNAL)
    straight = server.load_text(deck(4000), durability="none", ports=[mbcosim.structural_port("hand", nodes=[1])])
    steps(straight, [3])
    straight["node.structural.1.load"] = [0, 0, 0.25, 0, 0, 0]
    steps(straight, [2, 100])
    steps(stored, [100])
    assert stored.refresh().step == 105
    assert positions(stored) == pytest.approx(positions(straight), rel=1e-9, abs=1e-12)
