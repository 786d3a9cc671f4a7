"""Simulations held back to the wall clock: instants, late steps, interruption, refusals."""
import threading
import time

import pytest

import decks
import mbcosim
from conftest import TIME_FACTOR, wait_for


def test_a_second_of_the_model_lasts_a_second(server):
    with server.load_text(decks.body(step="0.01"), pace=1.0) as simulation:
        start = time.monotonic()
        simulation.step(50)
        assert time.monotonic() - start >= 0.5
        assert simulation.info.pace.rate == 1.0


def test_the_rate_is_the_models_time_by_the_clocks(server):
    with server.load_text(decks.body(step="0.01"), pace=4.0) as simulation:
        start = time.monotonic()
        for _ in range(10):
            simulation.step(4)
        assert time.monotonic() - start >= 10 * 4 * 0.01 / 4


def test_results_are_those_of_a_run_that_is_not_held_back(server):
    names = ["node.structural.1.X", "node.structural.1.R", "node.structural.1.Omega"]
    found = []
    for pace in (None, 20.0):
        with server.load_text(decks.body(step="0.01"), pace=pace) as simulation:
            simulation.step(50)
            found.append(b"".join(value.tobytes() for value in simulation.read(names).values()))
    assert found[0] == found[1]


def test_steps_that_cannot_keep_up_are_late_and_counted(server):
    with server.load_text(decks.body(step="1.e-3", final_time="10."), pace=1e9) as simulation:
        reply = simulation.step(100).reply
        assert reply.late_steps == 100
        assert 0 < reply.worst_delay_seconds < 60 * TIME_FACTOR
        simulation.step(20)
        info = simulation.refresh()
        assert info.late_steps == 120
        assert info.worst_delay_seconds >= reply.worst_delay_seconds
    with server.load_text(decks.body(step="1.e-3")) as free:
        free.step(100)
        info = free.refresh()
        assert info.late_steps == 0 and not info.HasField("pace")


def test_a_simulation_that_waits_is_read_and_interrupted(server):
    with server.load_text(decks.body(step="100.", final_time="1.e6", spin="0., 0., 0."), pace=1.0) as simulation:
        done = []
        worker = threading.Thread(target=lambda: done.append(simulation.step()))
        worker.start()
        wait_for(lambda: simulation.refresh().step == 1)
        start = time.monotonic()
        simulation.read(["node.structural.1.X"])
        assert time.monotonic() - start < 10 * TIME_FACTOR
        simulation.interrupt()
        worker.join(20 * TIME_FACTOR)
        assert not worker.is_alive() and done[0].step == 1


@pytest.mark.parametrize("rate", [0.0, -1.0, float("inf"), float("nan")])
def test_a_rate_that_is_none_is_refused(server, rate):
    with pytest.raises(mbcosim.Error, match="pace.rate") as caught:
        server.load_text(decks.body(), pace=rate)
    assert caught.value.reason == "BAD_ARGUMENT"
