"""Telemetry: nothing is missed, gaps are counted, a slow reader delays only whom it asked to."""
import threading
import time

import grpc
import pytest

import decks
import mbcosim
from mbcosim.v1 import telemetry_pb2


def test_every_sample_arrives_in_order(server, tumbling):
    with server.load(tumbling) as simulation, simulation.subscribe(["time", "node.structural.1.X"], every=5) as samples:
        simulation.step(100)
        got = [next(iter_) for iter_ in [iter(samples)] for _ in range(20)]
        assert [step for step, _, _ in got] == list(range(5, 101, 5))
        assert all(values["time"] == time for _, time, values in got)
        assert samples.dropped == 0


def test_block_delivers_all_to_a_slow_reader(server):
    with server.load_text(decks.body(final_time="2.")) as simulation:
        with simulation.subscribe(["step"], policy="block", buffer=4) as samples:
            runner = threading.Thread(target=lambda: simulation.step(2000))
            runner.start()
            stream = iter(samples)
            steps = [next(stream)[0] for _ in range(2000)]
            runner.join(20)
        assert steps == list(range(1, 2001))


def test_drop_oldest_counts_its_gaps(server):
    with server.load_text(decks.body(final_time="20.")) as simulation:
        stub = server.telemetry
        request = telemetry_pb2.SubscribeRequest(simulation=simulation.name, handles=[0] * 200, buffer_samples=2,
                                                 policy=telemetry_pb2.OVERFLOW_POLICY_DROP_OLDEST)
        stream = stub.Subscribe(request)
        next(stream)
        assert simulation.step(20000).steps_done == 20000
        simulation.delete()
        batches = list(stream)
        received = sum(len(batch.samples) for batch in batches)
        assert received + batches[-1].total_dropped == 20000
        assert batches[-1].samples[-1].step == 20000
        assert batches[-1].samples[-1].sequence == 20000
        simulation._owned = False


def test_a_sample_is_no_longer_than_a_message(server):
    with server.load_text(decks.body()) as simulation:
        stream = server.telemetry.Subscribe(telemetry_pb2.SubscribeRequest(simulation=simulation.name, handles=[0] * 3_000_000, buffer_samples=1))
        with pytest.raises(grpc.RpcError) as caught:
            next(stream)
        error = mbcosim.errors.from_rpc_error(caught.value)
        assert (error.reason, error.metadata["limit"]) == ("LIMIT_EXCEEDED", "message_bytes")


def test_decimate_widens_the_interval(server):
    with server.load_text(decks.body(final_time="20.")) as simulation:
        request = telemetry_pb2.SubscribeRequest(simulation=simulation.name, handles=[0] * 500, buffer_samples=8,
                                                 policy=telemetry_pb2.OVERFLOW_POLICY_DECIMATE)
        stream = server.telemetry.Subscribe(request)
        next(stream)
        simulation.step(20000)
        simulation.delete()
        simulation._owned = False
        steps = [sample.step for batch in stream for sample in batch.samples]
        assert steps == sorted(steps)


def test_a_minimum_interval_leaves_out_steps_on_the_way(server):
    with server.load_text(decks.body(final_time="20.")) as simulation:
        with simulation.subscribe(["time"], minimum_interval=0.05) as few, simulation.subscribe(["time"], minimum_interval=3600.0) as one:
            begin = time.monotonic()
            simulation.step(20000)
            took = time.monotonic() - begin
            simulation.delete()
            got = list(few)
            assert [step for step, _, _ in one] == [1]
        simulation._owned = False
        assert 1 <= len(got) <= 2 + took / 0.05 and few.dropped == 0
        assert all(values["time"] == time_ for _, time_, values in got)


@pytest.mark.parametrize("seconds, nanos", [(0, 0), (-1, 0), (0, -1), (3600, 1), (10**12, 0), (0, -2**31)])
def test_a_wrong_minimum_interval_is_refused(server, seconds, nanos):
    with server.load_text(decks.body()) as simulation:
        request = telemetry_pb2.SubscribeRequest(simulation=simulation.name, handles=[0])
        request.minimum_interval.seconds, request.minimum_interval.nanos = seconds, nanos
        with pytest.raises(grpc.RpcError) as caught:
            next(server.telemetry.Subscribe(request, metadata=server.metadata))
        error = mbcosim.errors.from_rpc_error(caught.value)
        assert (error.code, error.field) == (grpc.StatusCode.INVALID_ARGUMENT, "minimum_interval")


def test_a_stalled_reader_that_blocks_is_dropped(server):
    with server.load_text(decks.body(final_time="20.")) as simulation:
        request = telemetry_pb2.SubscribeRequest(simulation=simulation.name, handles=[0] * 5000, buffer_samples=2,
                                                 policy=telemetry_pb2.OVERFLOW_POLICY_BLOCK)
        request.block_timeout.FromMilliseconds(200)
        stream = server.telemetry.Subscribe(request)
        next(stream)
        assert simulation.step(2000).steps_done == 2000  # nobody reads, and yet the step ends
        stream.cancel()


def test_unknown_variables_are_refused(server, tumbling):
    with server.load(tumbling) as simulation:
        stream = server.telemetry.Subscribe(telemetry_pb2.SubscribeRequest(simulation=simulation.name, handles=[99999]))
        with pytest.raises(mbcosim.NotFound):
            with mbcosim.errors.translated():
                next(stream)
