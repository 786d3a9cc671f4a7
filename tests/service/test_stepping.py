"""Steps: one by one, in chunks, on a stream, with retries; the same bits each time."""
import contextlib
import os
import signal
import threading
import time
from concurrent import futures

import grpc
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


def test_steps_that_are_sent_ahead_are_answered_one_by_one(server):
    """Whoever sends the next request before the reply is read gets every reply, each of its own step."""
    count = 1000

    def ahead(found):
        with server.load_text(decks.endless()) as simulation:
            request = pb.StepRequest(simulation=simulation.name, outputs=100 * simulation.handles(NAMES))
            requests = (request for _ in range(count))
            for reply in server.simulations.StepStream(requests, metadata=server.metadata):
                found.append(reply.step.step)

    all_found = [[] for _ in range(6)]
    threads = [threading.Thread(target=ahead, args=(found,)) for found in all_found]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(found == list(range(1, count + 1)) for found in all_found)


def test_one_stream_steps_many_simulations(server, tumbling, reference):
    """Each message may name another one; without a name it is the one before."""
    with contextlib.ExitStack() as stack:
        simulations = [stack.enter_context(server.load(tumbling)) for _ in range(4)]
        handles = simulations[0].handles(NAMES)

        def requests():
            for _ in range(100):
                for simulation in simulations:
                    yield pb.StepRequest(simulation=simulation.name)
                    yield pb.StepRequest(outputs=handles)

        steps = [reply.step.step for reply in server.simulations.StepStream(requests(), metadata=server.metadata)]
        assert steps == [step for k in range(100) for _ in simulations for step in (2 * k + 1, 2 * k + 2)]
        assert [bits(simulation) for simulation in simulations] == 4 * [reference]


def test_a_stream_ends_with_the_name_of_an_unknown_simulation(server):
    with server.load_text(decks.body()) as simulation:
        stream = server.simulations.StepStream(iter([pb.StepRequest(simulation=simulation.name), pb.StepRequest(simulation="simulations/none")]),
                                               metadata=server.metadata)
        assert next(stream).step.step == 1
        with pytest.raises(grpc.RpcError) as caught:
            next(stream)
        assert caught.value.code() == grpc.StatusCode.NOT_FOUND and "simulations/none" in caught.value.details()
        with pytest.raises(grpc.RpcError) as caught:
            next(server.simulations.StepStream(iter([pb.StepRequest()]), metadata=server.metadata))
        assert caught.value.code() == grpc.StatusCode.NOT_FOUND
        assert simulation.step().step == 2


def test_a_stream_holds_the_simulation_that_it_stepped_last(server):
    """The lease of the one before runs out."""
    first, second = (server.load_text(decks.body(), lease=1.0 * TIME_FACTOR) for _ in range(2))
    with first.stepper() as stepper, second.stepper(beside=stepper) as other:
        stepper.step()
        other.step()
        wait_for(lambda: first.name not in {info.name for info in server.list()}, 20)
        time.sleep(1.0 * TIME_FACTOR)
        assert other.step().step == 2
        with pytest.raises(mbcosim.NotFound):
            stepper.step()
        assert other.step().step == 3  # on another stream
    second.delete()


def test_steppers_share_a_stream(server, tumbling, reference):
    with contextlib.ExitStack() as stack:
        simulations = [stack.enter_context(server.load(tumbling)) for _ in range(5)]
        steppers = [simulations[0].stepper(NAMES)]
        steppers += [simulation.stepper(NAMES, beside=steppers[0]) for simulation in simulations[1:]]
        steppers[1].close()
        with pytest.raises(ValueError, match="beside"):
            simulations[1].stepper(beside=steppers[1])
        with mbcosim.connect(server.address) as another, pytest.raises(ValueError, match="beside"):
            another.attach(simulations[1].name).stepper(beside=steppers[0])
        steppers[1] = simulations[1].stepper(NAMES, beside=steppers[2])
        steppers[0].close()
        with pytest.raises(mbcosim.Unavailable):
            steppers[0].step()
        steppers[0] = simulations[0].stepper(NAMES, beside=steppers[2])
        for _ in range(200):
            results = [stepper.step() for stepper in steppers]
        for result in results:
            assert b"".join(v.tobytes() for v in result.values.values()) == reference
        for stepper in steppers:
            stepper.close()


def test_threads_take_turns_on_a_shared_stream(server):
    with contextlib.ExitStack() as stack:
        simulations = [stack.enter_context(server.load_text(decks.endless())) for _ in range(4)]
        steppers = [simulations[0].stepper(["time"])]
        steppers += [simulation.stepper(["time"], beside=steppers[0]) for simulation in simulations[1:]]
        found = [[] for _ in steppers]
        threads = [threading.Thread(target=lambda k=k: found[k].extend(steppers[k].step().step for _ in range(100))) for k in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert found == 4 * [list(range(1, 101))]
        long = threading.Thread(target=lambda: steppers[0].step(count=10**9))
        long.start()
        wait_for(lambda: simulations[0].refresh().step > 100)
        with pytest.raises(mbcosim.TimedOut):
            steppers[1].step(timeout=0.1)
        assert simulations[1].refresh().step == 100
        simulations[0].interrupt()
        long.join()
        assert steppers[2].step().step == 101
        for stepper in steppers:
            stepper.close()


def test_a_step_whose_stepper_is_closed_while_it_waits_opens_no_stream(server):
    with server.load_text(decks.body()) as simulation, futures.ThreadPoolExecutor() as pool:
        stepper = simulation.stepper()
        shared = stepper._stream
        with shared._turn:
            waiting = pool.submit(stepper.step)
            time.sleep(0.1 * TIME_FACTOR)
            stepper.close()
        with pytest.raises(mbcosim.Unavailable, match="over"):
            waiting.result()
        assert shared._replies is None and simulation.step().step == 1


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


def wait_until_it_stands(simulation):
    wait_for(lambda: simulation.refresh().state == pb.SIMULATION_STATE_READY)
    before = simulation.info.step
    assert simulation.step().step == before + 1


def test_a_run_whose_progress_raises_ends_on_the_server(server):
    def refuses(progress):
        raise GeneratorExit

    with server.load_text(decks.endless()) as simulation:
        with pytest.raises(GeneratorExit) as caught:
            simulation.run_until(1e8, progress=refuses)
        wait_until_it_stands(simulation)
    assert caught.value  # whose trace keeps the call


@pytest.mark.parametrize("advance", [
    lambda s: s.run_until(1e8), lambda s: s.run_until(1e8, progress=lambda _: None), lambda s: s.simulate(["time"], until=1e8, every=10**6),
    lambda s: s.simulate(["time"], until=1e8, every=10**9, inputs={"node.structural.1.load": lambda t: [0] * 6}), lambda s: s.stepper().step(None, 10**9)])
def test_what_is_interrupted_here_ends_on_the_server(server, advance):
    with server.load_text(decks.endless()) as simulation:
        interrupt = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
        interrupt.start()
        with pytest.raises(KeyboardInterrupt) as caught:
            advance(simulation)
        wait_until_it_stands(simulation)
    assert caught.value


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


# ---------------------------------------------------------------- steps in a loop

def in_a_loop(simulation, count=5, **options):
    return [simulation.step(outputs=["node.structural.1.X"], **options) for _ in range(count)]


def opens_a_stream(simulation):
    return simulation._line._replies is not None


def test_steps_in_a_loop_share_a_stream_that_ends_when_they_do(server, tumbling):
    with server.load(tumbling) as simulation, server.load(tumbling) as other:
        simulation.step()
        assert not opens_a_stream(simulation)  # one step is a call
        alike = [[result.values["node.structural.1.X"].tolist() for result in in_a_loop(simulation)]]
        assert opens_a_stream(simulation)
        other.step()
        alike.append([result.values["node.structural.1.X"].tolist() for result in in_a_loop(other, timeout=60.0)])
        assert not opens_a_stream(other)  # with a timeout each is a call
        assert alike[0] == alike[1] and simulation.export_state() == other.export_state()
        wait_for(lambda: not opens_a_stream(simulation), 10 * TIME_FACTOR)
        assert simulation.step().step == 7


def test_an_error_in_a_loop_is_that_of_a_call_and_the_loop_goes_on(server, tumbling):
    with server.load(tumbling) as simulation:
        in_a_loop(simulation)
        for _ in range(3):
            with pytest.raises(mbcosim.Error) as caught:
                simulation.step(step_size=-1.0)
            assert (caught.value.reason, caught.value.field) == ("BAD_ARGUMENT", "step_size")
        assert in_a_loop(simulation)[-1].step == 10 and opens_a_stream(simulation)


def test_two_threads_step_one_simulation_in_a_loop(server):
    with server.load_text(decks.body()) as simulation:
        errors = []

        def loop():
            try:
                for _ in range(100):
                    while True:
                        try:
                            simulation.step()
                            break
                        except mbcosim.Busy:
                            pass
            except Exception as error:  # pylint: disable=broad-except
                errors.append(error)

        threads = [threading.Thread(target=loop) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60 * TIME_FACTOR)
        assert errors == [] and simulation.refresh().step == 200


def subscribed(simulation):
    """A subscription in the only place for streams. The upload of the deck has it until the server knows that its reply has arrived."""
    found = []

    def try_it():
        with contextlib.suppress(mbcosim.LimitExceeded):
            found.append(simulation.subscribe(["time"]))
        return found

    wait_for(try_it)
    return found[0]


def test_where_no_stream_is_to_be_had_a_loop_makes_calls(start_daemon):
    daemon = start_daemon("--limit-identity-streams", "1")
    with daemon.connect() as server, server.load_text(decks.body()) as simulation, subscribed(simulation):
        assert in_a_loop(simulation, 20)[-1].step == 20
        assert not opens_a_stream(simulation)


def test_a_daemon_that_dies_in_a_loop_is_noticed(start_daemon):
    daemon = start_daemon()
    with daemon.connect() as server:
        simulation = server.load_text(decks.body())
        in_a_loop(simulation)
        daemon.kill()
        with pytest.raises(mbcosim.Unavailable):
            in_a_loop(simulation)
