"""Many sessions and clients at once, and clients that die."""
import concurrent.futures
import os
import signal
import subprocess
import sys
import textwrap

import grpc
import pytest

import decks
import mbcosim
from conftest import wait_for
from mbcosim.v1 import simulations_pb2 as pb, simulations_pb2_grpc

NAMES = ["node.structural.1.X", "node.structural.1.R", "node.structural.1.Omega"]


def run_alone(daemon, spin):
    with daemon.connect() as server, server.load_text(decks.body(spin=f"0.1, {spin}, 0.2")) as simulation:
        for _ in range(60):
            simulation.step(5)
        return b"".join(v.tobytes() for v in simulation.read(NAMES).values())


def test_eight_clients_get_what_each_gets_alone(daemon):
    spins = [3.0 + i for i in range(8)]
    alone = [run_alone(daemon, spin) for spin in spins]
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        together = list(pool.map(lambda spin: run_alone(daemon, spin), spins))
    assert together == alone
    assert len(set(alone)) == 8


def start_client(daemon, body):
    script = textwrap.dedent(body)
    return subprocess.Popen([sys.executable, "-c", script, daemon.address], stdout=subprocess.PIPE, text=True,
                            cwd=os.path.dirname(__file__))


def test_a_client_killed_in_mid_step_leaves_the_session_usable(daemon, server):
    client = start_client(daemon, """
        import sys, decks, mbcosim
        simulation = mbcosim.connect(sys.argv[1]).load_text(decks.endless())
        print(simulation.name, flush=True)
        simulation.step(10**9)
    """)
    name = client.stdout.readline().strip()
    simulation = server.attach(name)
    wait_for(lambda: simulation.refresh().state == pb.SIMULATION_STATE_STEPPING)
    client.send_signal(signal.SIGKILL)
    client.wait()
    wait_for(lambda: simulation.refresh().state == pb.SIMULATION_STATE_READY)
    step = simulation.step_number
    assert step > 0 and simulation.step().step == step + 1
    simulation.delete()
    assert daemon.alive()


def test_a_lease_ends_a_forgotten_session(server):
    simulation = server.load_text(decks.body(), lease=0.5)
    simulation.step()
    wait_for(lambda: simulation.name not in [info.name for info in server.list()])
    with pytest.raises(mbcosim.NotFound):
        simulation.step()


def test_limits_are_named(start_daemon):
    daemon = start_daemon("--limit-sessions", "1", "--limit-snapshots", "1", "--limit-deck-bytes", "5000")
    with daemon.connect() as server:
        with server.load_text(decks.body()) as simulation:
            with pytest.raises(mbcosim.LimitExceeded) as caught:
                server.load_text(decks.body())
            assert caught.value.metadata == {"limit": "sessions", "maximum": "1"}
            simulation.snapshot()
            with pytest.raises(mbcosim.LimitExceeded) as caught:
                simulation.snapshot()
            assert caught.value.metadata["limit"] == "snapshots"
        with pytest.raises(mbcosim.LimitExceeded) as caught:
            server.load_text(decks.body() + "#" * 6000)
        assert caught.value.metadata["limit"] == "deck_bytes"


def test_a_repeated_creation_gives_the_same_session(server):
    options = pb.CreateOptions(request_id="once")
    header = pb.UploadHeader(bundle_main_file="deck", options=options)
    names = [server.simulations.CreateSimulation(
        mbcosim.bundle.requests(header, {"deck": decks.body().encode()})).simulation.name for _ in range(2)]
    assert names[0] == names[1]
    server.attach(names[0]).delete()


def test_sigterm_during_a_run_ends_the_daemon_cleanly(start_daemon):
    daemon = start_daemon()
    client = start_client(daemon, """
        import sys, decks, mbcosim
        simulation = mbcosim.connect(sys.argv[1]).load_text(decks.endless())
        print("ready", flush=True)
        try:
            print(simulation.step(10**9).outcome)
        except mbcosim.Error as error:
            print("error", error.code)
    """)
    assert client.stdout.readline().strip() == "ready"
    with daemon.connect() as server:
        wait_for(lambda: server.list()[0].step > 0)
    daemon.stop()
    assert client.communicate(timeout=30)[0].strip() in ("INTERRUPTED", "error StatusCode.UNAVAILABLE",
                                                         "error StatusCode.CANCELLED")


def test_repeats_that_wait_leave_threads_to_others(start_daemon, tmp_path):
    """Two paced steps and a repeat of each are four calls of one identity, where four simulations may live, two of an identity."""
    tokens = tmp_path / "tokens"
    tokens.write_text("a control ann\nb control bob\n")
    tokens.chmod(0o600)
    daemon = start_daemon("--limit-sessions", "4", "--tokens", str(tokens))
    with daemon.connect(token="a") as ann, daemon.connect(token="b") as bob, grpc.insecure_channel(daemon.address) as channel:
        slow = [ann.load_text(decks.body(), pace=1e-9) for _ in range(2)]
        quick = bob.load_text(decks.body())
        step = simulations_pb2_grpc.SimulationsStub(channel).Step
        calls = [step.future(pb.StepRequest(simulation=simulation.name, steps=2, request_id="x"), metadata=[("authorization", "Bearer a")])
                 for simulation in slow for _ in range(2)]
        wait_for(lambda: all(simulation.refresh().state == pb.SIMULATION_STATE_STEPPING for simulation in slow))
        assert [quick.step(timeout=20).step for _ in range(3)] == [1, 2, 3]
        for simulation in slow:
            simulation.interrupt()
        assert {call.result().outcome for call in calls} == {pb.STEP_OUTCOME_INTERRUPTED}
