"""Saving, restoring, exporting and forking: every continuation has the same bits."""
import pytest

import mbcosim
from test_stepping import bits


@pytest.fixture
def reference(server, pendulum):
    with server.load(pendulum) as simulation:
        simulation.step(150)
        return simulation.read(["node.structural.2.X", "node.structural.2.R"])


def same(simulation, reference):
    now = simulation.read(list(reference))
    return all(now[name].tobytes() == reference[name].tobytes() for name in reference)


def test_restore_continues_bit_for_bit(server, pendulum, reference):
    with server.load(pendulum) as simulation:
        simulation.step(100)
        snapshot = simulation.snapshot("here")
        assert snapshot.step == 100 and snapshot.display_name == "here"
        simulation.step(50)
        assert same(simulation, reference)
        simulation.step(200)
        snapshot.restore()
        assert simulation.step_number == 100
        simulation.step(50)
        assert same(simulation, reference)


def test_export_and_import_in_another_simulation(server, pendulum, reference):
    with server.load(pendulum) as first, server.load(pendulum) as second:
        first.step(120)
        data = first.export_state()
        second.step(3)
        second.import_state(data)
        assert second.step_number == 120
        second.step(30)
        assert same(second, reference)
        kept = first.snapshot()
        first.step(10)
        assert kept.export() == data


def test_forks_share_nothing_that_changes(server, pendulum, reference):
    with server.load(pendulum) as simulation:
        simulation.step(90)
        with simulation.fork() as branch:
            simulation.step(500)
            branch.step(60)
            assert same(branch, reference)


def test_snapshots_are_listed_and_forgotten(server, pendulum):
    with server.load(pendulum) as simulation:
        saved = [simulation.snapshot(str(i)) for i in range(3)]
        assert [s.display_name for s in simulation.snapshots()] == ["0", "1", "2"]
        saved[1].delete()
        assert [s.name for s in simulation.snapshots()] == [saved[0].name, saved[2].name]
        with pytest.raises(mbcosim.NotFound) as caught:
            saved[1].restore()
        assert caught.value.reason == "NO_SUCH_SNAPSHOT"


def test_damaged_bytes_are_refused(server, pendulum):
    with server.load(pendulum) as simulation:
        data = bytearray(simulation.export_state())
        data[len(data) // 2] ^= 1
        with pytest.raises(mbcosim.Error) as caught:
            simulation.import_state(bytes(data))
        assert caught.value.reason == "DAMAGED_STATE"
        assert simulation.refresh().step == 0


def test_another_models_state_is_refused(server, pendulum, tumbling):
    with server.load(pendulum) as simulation, server.load(tumbling) as other:
        before = bits(simulation)
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            simulation.import_state(other.export_state())
        assert caught.value.reason == "OTHER_MODEL"
        assert bits(simulation) == before
