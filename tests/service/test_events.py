"""Events: everything that happens to a simulation is told in order, to those who may see it, and stands in the log with its fields."""
import asyncio
import contextlib
import json
import socket
import threading
import time

import grpc
import pytest

import decks
import mbcosim
import mbcosim.aio
from conftest import TIME_FACTOR, wait_for
from mbcosim.v1 import events_pb2, simulations_pb2 as pb
from test_health import certificate

PORT = [mbcosim.signal_port("port", outputs=["time"], inputs=["node.structural.1.load"])]


def kinds(watcher, count):
    """The next so many events."""
    stream = iter(watcher)
    return [next(stream) for _ in range(count)]


def kind(event):
    return event.WhichOneof("content")


def failing(simulation):
    simulation["node.structural.1.load"] = [float("1e300"), 0, 0, 0, 0, 0]
    with pytest.raises(mbcosim.StepFailed):
        simulation.step(5)


def test_a_life_is_told_in_order(server):
    with server.events() as watcher:
        with server.load_text(decks.body(), name="body") as simulation:
            saved = simulation.snapshot()
            failing(simulation)
            saved.restore()
            saved.delete()
            simulation.run_until(1e9)
            with simulation.fork(name="twig") as branch:
                twig = branch.name
        events = kinds(watcher, 9)
    mine = [e for e in events if e.simulation == simulation.name]
    assert [kind(e) for e in mine][:6] == ["created", "snapshot", "step_failed", "snapshot", "snapshot", "state_changed"]
    assert mine[0].created.display_name == "body" and mine[0].method == "Simulations/CreateSimulation" and mine[0].identity == "local"
    assert [e.snapshot.change for e in mine if kind(e) == "snapshot"] == [
        events_pb2.SNAPSHOT_CHANGE_SAVED, events_pb2.SNAPSHOT_CHANGE_RESTORED, events_pb2.SNAPSHOT_CHANGE_DELETED]
    assert mine[1].snapshot.name == saved.name
    assert mine[2].step_failed.failure.step == 1 and mine[2].step_failed.failure.message
    assert mine[5].state_changed.state == pb.SIMULATION_STATE_FINISHED
    assert [e.created.forked_from for e in events if e.simulation == twig and kind(e) == "created"] == [simulation.name]
    numbers = [e.sequence for e in events]
    assert numbers == sorted(set(numbers))


def test_one_simulation_is_watched_until_it_is_gone(server):
    with server.load_text(decks.body()) as simulation, server.load_text(decks.body()) as other:
        watcher = server.events(simulation.name)
        other.snapshot()
        simulation.snapshot()
        simulation.delete()
        simulation._owned = False
        assert [kind(e) for e in watcher] == ["snapshot", "deleted"]
        with pytest.raises(mbcosim.NotFound):
            server.events("simulations/none")


def test_who_comes_back_gets_what_was_missed(server):
    with server.load_text(decks.body()) as simulation:
        with server.events() as watcher:
            simulation.snapshot()
            kinds(watcher, 1)
        for _ in range(3):
            simulation.snapshot()
        with server.events(after=watcher.last, journal=watcher.journal) as again:
            assert [(kind(e), e.sequence) for e in kinds(again, 3)] == [("snapshot", watcher.last + k) for k in (1, 2, 3)]
        with server.events(after=watcher.last, journal="of another daemon") as other:
            assert kind(kinds(other, 1)[0]) == "missed"
        with pytest.raises(mbcosim.Error) as caught:
            server.events(after=10 ** 9)
        assert "`after_sequence` is larger than the last number" in str(caught.value)


def test_a_gap_is_told(server):
    with server.load_text(decks.body()) as simulation:
        with server.events() as watcher:
            simulation.snapshot()
            kinds(watcher, 1)
        first = simulation.snapshots()[0]
        for _ in range(9000):
            first.restore()
        with server.events(after=watcher.last) as again:
            missed, following = kinds(again, 2)
        assert kind(missed) == "missed" and missed.missed.count == following.sequence - watcher.last - 1 > 500


def test_peers_are_told(server):
    with server.load_text(decks.body(), ports=PORT) as simulation, server.events(simulation.name) as watcher:
        calm = threading.Event()
        with simulation.couple("port", lambda motion: calm.wait(5) or [0.0] * 6, peer_timeout=0.2):
            with pytest.raises(mbcosim.StepFailed):
                simulation.step()
            calm.set()
        events = kinds(watcher, 4)
        peers = [e.peer for e in events if kind(e) == "peer"]
        assert [p.change for p in peers] == [events_pb2.PEER_CHANGE_ATTACHED, events_pb2.PEER_CHANGE_LATE, events_pb2.PEER_CHANGE_LEFT]
        assert all(p.port == "port" for p in peers) and peers[0].peer == "local"
        failed, = [e.step_failed for e in events if kind(e) == "step_failed"]
        assert failed.outcome == pb.STEP_OUTCOME_PEER_LOST


def test_the_end_of_a_lease_is_announced(server):
    simulation = server.load_text(decks.body(), lease=1.0)
    with server.events(simulation.name) as watcher:
        ending, gone = kinds(watcher, 2)
    assert kind(ending) == "lease_ending" and 0 <= ending.lease_ending.seconds_left <= 0.3
    assert gone.deleted.cause == events_pb2.DELETION_CAUSE_LEASE_OVER and gone.identity == ""


def test_others_simulations_are_not_told(start_daemon, tmp_path):
    tokens = tmp_path / "tokens"
    tokens.write_text("one control first\ntwo control second\nall admin boss\n")
    tokens.chmod(0o600)
    daemon = start_daemon("--tokens", str(tokens))
    with daemon.connect(token="one") as first, daemon.connect(token="two") as second, daemon.connect(token="all") as boss:
        with second.events() as others, boss.events() as everything, first.load_text(decks.body()) as simulation:
            with second.load_text(decks.body()) as own:
                seen = kinds(others, 1)[0]
                assert (seen.simulation, seen.identity) == (own.name, "token:second")
            assert kinds(everything, 1)[0].simulation == simulation.name
            with pytest.raises(mbcosim.NotFound):
                second.events(simulation.name)


def test_the_asyncio_client_watches_too(daemon):
    async def main():
        async with mbcosim.aio.connect(daemon.address) as server:
            async with await server.events() as watcher, await server.load_text(decks.body()) as simulation:
                async for event in watcher:
                    return event.simulation == simulation.name, kind(event), watcher.last == event.sequence

    assert asyncio.run(asyncio.wait_for(main(), 60)) == (True, "created", True)


def test_lines_of_the_log_have_the_same_fields(start_daemon):
    daemon = start_daemon("--log-format", "json")
    trace = "4bf92f3577b34da6a3ce929d0e0e4736"
    with daemon.connect() as server, server.load_text(decks.body()) as simulation:
        simulation["node.structural.1.load"] = [float("1e300"), 0, 0, 0, 0, 0]
        server.simulations.Step(pb.StepRequest(simulation=simulation.name, steps=1, request_id='my "request"'),
                                metadata=[("traceparent", f"00-{trace}-00f067aa0ba902b7-01")])
        with pytest.raises(Exception):
            server.simulations.Step(pb.StepRequest(simulation="simulations/none"), metadata=[("traceparent", "nonsense")])
        with server.events(simulation.name, after=0) as watcher:
            event = [e for e in kinds(watcher, 2) if kind(e) == "step_failed"][0]
        assert (event.trace_id, event.method, event.identity) == (trace, "Simulations/Step", "local")
    wait_for(lambda: "deleted" in daemon.log())
    lines = [json.loads(line) for line in daemon.log().splitlines()]
    failed, = [line for line in lines if "failed:" in line["message"]]
    assert {k: failed[k] for k in ("session", "method", "identity", "request_id", "trace_id")} == {
        "session": simulation.name, "method": "Simulations/Step", "identity": "local", "request_id": 'my "request"', "trace_id": trace}
    refused, = [line for line in lines if "refused to" in line["message"]]
    assert refused["reason"] == "NO_SUCH_SIMULATION" and refused["method"] == "Simulations/Step" and "trace_id" not in refused


def test_what_libraries_say_goes_through_the_log(start_daemon):
    daemon = start_daemon("--log-format", "json")
    with grpc.insecure_channel(daemon.address) as channel:
        step = channel.unary_unary("/mbcosim.v1.Simulations/Step", request_serializer=bytes, response_deserializer=bytes)
        with pytest.raises(grpc.RpcError) as caught:
            step(b"\x0a\x02\xff\xfe", timeout=30 * TIME_FACTOR)  # a name that is no UTF-8, of which protobuf complains
        assert caught.value.code() == grpc.StatusCode.INVALID_ARGUMENT
    wait_for(lambda: "protobuf: " in daemon.log())
    lines = [json.loads(line) for line in daemon.log().splitlines()]
    assert [line["level"] for line in lines if line["message"].startswith("protobuf: ")] == ["warning"]


def test_what_grpc_says_goes_through_the_log_and_is_no_flood(start_daemon, tmp_path):
    """Of clients that speak no TLS where it is spoken."""
    certificate(tmp_path, "server", "/CN=localhost")
    pem, key = (str(tmp_path / f"server.{ending}") for ending in ("pem", "key"))
    daemon = start_daemon("--log-format", "json", "--listen", "localhost:0", "--tls-certificate", pem, "--tls-key", key,
                          "--tls-client-ca", pem)
    wait_for(lambda: "listening on localhost:" in daemon.log())
    port = int(daemon.log().split("listening on localhost:")[1].split('"')[0])
    begin, strangers = time.monotonic(), 200
    for _ in range(strangers):
        with socket.create_connection(("localhost", port), 30 * TIME_FACTOR) as stranger:
            with contextlib.suppress(ConnectionError):
                stranger.sendall(b"GET /\n\x1b[31m HTTP/1.0\r\n\r\n")
                stranger.recv(100)
    wait_for(lambda: '"gRPC: ' in daemon.log())
    lines = [json.loads(line) for line in daemon.log().splitlines()]
    told = [line for line in lines if line["message"].startswith("gRPC: ")]
    assert {line["level"] for line in told} == {"warning"}
    assert len(told) <= 20 * (time.monotonic() - begin + 1)


def test_lines_about_peers_name_port_and_identity(start_daemon):
    daemon = start_daemon("--log-format", "json")
    with daemon.connect() as server, server.load_text(decks.body(), ports=PORT) as simulation:
        with simulation.couple("port", lambda motion: [0.0] * 6):
            simulation.step()
        wait_for(lambda: "left" in daemon.log())
    lines = [json.loads(line) for line in daemon.log().splitlines()]
    told = [line for line in lines if "port" in line]
    assert len(told) >= 2 and all((line["session"], line["port"], line["peer"]) == (simulation.name, "port", "local") for line in told)
