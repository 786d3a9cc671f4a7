"""Steps: one by one, in chunks, on a stream, with retries; the same bits each time."""
import threading
import time

import pytest

import decks
import mbcosim
from conftest import TIME_FACTOR, wait_for
from mbcosim.v1 import common_pb2, simulations_pb2 as pb

NAMES = ["node.structural.1.X", "node.structural.1.R", "node.structural.1.Omega", "node.structural.1.XP"]


def bits(simulation):
    return b"".join(value.tobytes() for value in simulation.read(NAMES).values())


@pytest.fixture
def reference(server, tumbling):
    with server.load(tumbling) as simulation:
        simulation.step(200)
        return bits(simulation)


def test_one_by_one_equals_chunks(server, tumbling, reference):
    with server.load(tumbling) as simulation:
        for _ in range(200):
            simulation.step()
        assert simulation.step_number == 200
        assert bits(simulation) == reference
    with server.load(tumbling) as simulation:
        for count in (1, 7, 92, 100):
            simulation.step(count)
        assert bits(simulation) == reference


def test_stream_equals_calls(server, tumbling, reference):
    with server.load(tumbling) as simulation:
        with simulation.stepper(outputs=NAMES) as stepper:
            for _ in range(200):
                result = stepper.step()
        assert b"".join(v.tobytes() for v in result.values.values()) == reference


def test_until_time_equals_steps(server, tumbling, reference):
    with server.load(tumbling) as simulation:
        result = simulation.run_until(2.0)
        assert (result.step, result.steps_done) == (200, 200)
        assert result.time == pytest.approx(2.0, abs=1e-12)
        assert bits(simulation) == reference
        assert simulation.run_until(2.0).steps_done == 0


def test_run_reports_progress_and_finishes(server):
    seen = []
    with server.load_text(decks.body(final_time="20.")) as simulation:
        result = simulation.run_until(1e9, progress=seen.append)
        assert result.outcome == "FINISHED" and result.step == 20000
        assert all(0 <= p.fraction <= 1 for p in seen)
        again = simulation.step()
        assert (again.outcome, again.steps_done) == ("FINISHED", 0)
        assert simulation.refresh().state == pb.SIMULATION_STATE_FINISHED


def test_condition_ends_an_advance(server, tumbling):
    with server.load(tumbling) as simulation:
        handle = simulation.variables["time"].handle
        condition = pb.Condition(handle=handle, comparison=pb.COMPARISON_GREATER_OR_EQUAL, threshold=0.4999)
        reply = simulation._call(simulation._stub.Step, pb.StepRequest(simulation=simulation.name, until=condition))
        assert reply.condition_met and reply.step == 50


def test_a_retried_step_is_applied_once(server, tumbling):
    with server.load(tumbling) as simulation:
        request = pb.StepRequest(simulation=simulation.name, request_id="a", expected_step=0, steps=3)
        first = simulation._call(simulation._stub.Step, request)
        second = simulation._call(simulation._stub.Step, request)
        assert first == second and first.step == 3
        assert simulation.refresh().step == 3


def test_a_wrong_expected_step_tells_the_right_one(server, tumbling):
    with server.load(tumbling) as simulation:
        simulation.step(5)
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            simulation._call(simulation._stub.Step, pb.StepRequest(simulation=simulation.name, expected_step=4))
        assert caught.value.reason == "WRONG_STEP" and caught.value.metadata["step"] == "5"
        assert simulation.refresh().step == 5


def test_inputs_move_the_body(server):
    with server.load_text(decks.body(spin="null")) as simulation:
        assert simulation.variables["node.structural.1.load"].causality == common_pb2.CAUSALITY_INPUT
        force = [0, 0, -9.81, 0, 0, 0]
        result = simulation.step(1000, inputs={"node.structural.1.load": force}, outputs=["node.structural.1.X"])
        assert result.values["node.structural.1.X"] == pytest.approx([0, 1, -9.81 / 2], abs=1e-2)
        assert simulation["node.structural.1.load"] == pytest.approx(force)


def test_reads_are_answered_during_a_run(server):
    with server.load_text(decks.endless()) as simulation:
        runner = threading.Thread(target=lambda: simulation.step(10**9))
        runner.start()
        wait_for(lambda: simulation.read(["step"])["step"] > 10)
        start = time.monotonic()
        for _ in range(20):
            simulation.read(["step"])
        assert time.monotonic() - start < 5 * TIME_FACTOR
        with pytest.raises(mbcosim.PreconditionFailed, match="advances") as caught:
            simulation.write({"node.structural.1.load": [0] * 6})
        assert caught.value.reason == "SIMULATION_BUSY"
        assert simulation.interrupt()
        runner.join(10)
        assert not runner.is_alive()
        assert simulation.refresh().state == pb.SIMULATION_STATE_READY
        assert not simulation.interrupt()


def test_a_failed_step_leaves_the_last_accepted_state(server):
    with server.load_text(decks.impossible()) as simulation:
        before = bits(simulation)
        with pytest.raises(mbcosim.StepFailed) as caught:
            simulation.step(3)
        assert caught.value.result.outcome == "NOT_CONVERGED"
        assert len(caught.value.failure.residual_norms) >= 1
        assert caught.value.failure.worst_equations[0].owner
        assert simulation.refresh().step == caught.value.result.step
        if simulation.info.step == 0:
            assert bits(simulation) == before
        assert simulation.info.last_failure
