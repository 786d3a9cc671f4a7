"""The fault matrix: who fails, how, and when. Each fault is noticed within its bound and leaves a session that goes on."""
import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent import futures

import grpc
import pytest
from google.protobuf.duration_pb2 import Duration

import decks
import mbcosim
from conftest import TIME_FACTOR, Daemon, leaves_no_thread, stop, wait_for
from mbcosim.v1 import coupling_pb2, coupling_pb2_grpc
from relay import BlackHole, Unreliable
from test_coupling import PORT, oscillator, spring

BOUND = 6.0  # [s] for faults that a timeout of 0.5 s notices, with room for a busy machine
MODES = {"idle": "loose", "in step": "loose", "in iteration": "tight"}
BLOWS = ("kill", "stop", "close", "black hole")

PEER = """
import os, sys, time
import mbcosim
address, name, mode, stall = sys.argv[1:5]
server = mbcosim.connect(address)
simulation = server.attach(name)
count = 0
def answer(motion):
    global count
    count += 1
    if stall == "yes" and motion.time > 0.0021:
        print("stalled", flush=True)
        if mode == "leave":
            os._exit(0)
        time.sleep(60)
    return [[1.0, 0.0, 0.0]]
peer = simulation.couple("spring", answer, peer_timeout=0.5, mode=sys.argv[5], server_timeout=30)
print("attached", flush=True)
for line in sys.stdin:
    if line.strip() == "close":
        os._exit(0)
"""

CLIENT = """
import os, sys, mbcosim
simulation = mbcosim.connect(sys.argv[1]).attach(sys.argv[2])
print("ready", flush=True)
if sys.argv[3] == "step":
    simulation.step(10**6)
for line in sys.stdin:
    os._exit(0)
"""


@pytest.fixture
def processes():
    started = []

    def start(code, *arguments):
        process = subprocess.Popen([sys.executable, "-c", code, *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        started.append(process)
        process.stdout.readline()
        return process

    yield start
    for process in started:
        process.kill()
        process.wait()


@pytest.fixture
def hole(daemon, tmp_path):
    relay = BlackHole(str(tmp_path), daemon.address)
    yield relay
    relay.close()


def strike(blow, process, relay, busy=False):
    """Deals the blow to a process, or to the line between it and the daemon."""
    if blow == "black hole":
        relay.fall_silent()
    elif blow == "close" and busy:
        process.send_signal(signal.SIGINT)  # Python cancels its call and closes the connection
    elif blow == "close":
        process.stdin.write("close\n")
        process.stdin.flush()
    else:
        process.send_signal(signal.SIGKILL if blow == "kill" else signal.SIGSTOP)


@pytest.mark.parametrize("when", MODES)
@pytest.mark.parametrize("blow", BLOWS)
def test_peer(server, daemon, processes, hole, blow, when):
    with oscillator(server) as simulation:
        stall = "no" if when == "idle" else "yes"
        peer = processes(PEER, hole.address, simulation.name, "stay", stall, MODES[when])
        simulation.step(2)
        before = simulation.export_state()
        if when == "idle":
            strike(blow, peer, hole)
        else:
            def stalled():
                peer.stdout.readline()
                strike(blow, peer, hole)
            threading.Thread(target=stalled, daemon=True).start()
        start = time.monotonic()
        with pytest.raises(mbcosim.StepFailed) as caught:
            simulation.step(3)
        assert time.monotonic() - start < BOUND * TIME_FACTOR
        assert caught.value.reason == "PEER_LOST"
        assert simulation.refresh().step >= 2
        if simulation.info.step == 2:  # else the blow came after another answer
            assert simulation.export_state() == before
        peer.kill()
        hole.close()
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        step = simulation.info.step
        with simulation.couple("spring", spring, mode=MODES[when]):
            assert simulation.step(5).step == step + 5


@pytest.mark.parametrize("when", MODES)
@pytest.mark.parametrize("blow", BLOWS)
def test_client(server, daemon, processes, hole, blow, when):
    with oscillator(server) as simulation:
        with simulation.couple("spring", lambda m: time.sleep(0.005) or spring(m), mode=MODES[when], peer_timeout=10):
            client = processes(CLIENT, hole.address, simulation.name, "wait" if when == "idle" else "step")
            if when != "idle":
                wait_for(lambda: simulation.refresh().step > 2, 30)
            strike(blow, client, hole, busy=when != "idle")
            if when != "idle":
                if blow in ("stop", "black hole"):  # nobody can know: the call goes on until somebody ends it
                    simulation.interrupt()
                wait_for(lambda: not simulation.refresh().state == 2, BOUND)
            step = simulation.refresh().step
            assert simulation.step(3).step == step + 3


@pytest.mark.parametrize("when", MODES)
@pytest.mark.parametrize("blow", ("kill", "stop", "close", "black hole"))
def test_daemon(tmp_path_factory, tmp_path, blow, when):
    daemon = Daemon(str(tmp_path_factory.mktemp("d")))
    hole = BlackHole(str(tmp_path), daemon.address)
    release, outcome = threading.Event(), {}

    def answer(motion):
        if when != "idle" and motion.time > 0.0021:
            release.wait(30)
        return spring(motion)

    def step():
        try:
            outcome["result"] = simulation._stub.Step(request, metadata=(), timeout=2.0)
        except Exception as error:
            outcome["error"] = error

    from mbcosim.v1 import simulations_pb2 as pb
    server = mbcosim.connect(hole.address, timeout=30)
    simulation = oscillator(server)
    simulation._owned = False
    request = pb.StepRequest(simulation=simulation.name, steps=2 if when == "idle" else 10)
    peer = simulation.couple("spring", answer, mode=MODES[when], peer_timeout=20)
    client = threading.Thread(target=step)
    client.start()
    if when == "idle":
        client.join(10)
    else:
        time.sleep(0.3)
    start = time.monotonic()
    if blow == "black hole":
        hole.fall_silent()
    elif blow == "stop":
        stop(daemon.process.pid)
    else:
        daemon.process.send_signal({"kill": signal.SIGKILL, "close": signal.SIGTERM}[blow])
    if blow == "close":
        assert daemon.process.wait(10) == 0
    client.join(5)
    assert not client.is_alive() and time.monotonic() - start < 8 * TIME_FACTOR  # a deadline bounds what nobody answers
    if when == "idle" and blow in ("stop", "black hole"):
        with pytest.raises(Exception):
            simulation._stub.GetSimulation(pb.GetSimulationRequest(simulation=simulation.name), timeout=0.5)
    if blow == "stop":
        daemon.process.send_signal(signal.SIGCONT)
        with daemon.connect() as again:
            assert again.attach(simulation.name).info.step >= 2
    release.set()
    peer.close()
    server.close()
    hole.close()
    daemon.process.kill()
    daemon.process.wait()
    daemon._log.close()


def test_nothing_is_left_behind(server, daemon, processes):
    """Threads and memory of the daemon after many faults are what they were after a few."""
    with oscillator(server) as simulation:
        def cycle():
            peer = processes(PEER, daemon.address, simulation.name, "stay", "no", "tight")
            simulation.step(2)
            peer.kill()
            wait_for(lambda: not simulation.describe().ports[0].has_peer)

        leaves_no_thread(daemon, cycle, 2)


# ---------------------------------------------------------------- heartbeats

def test_heartbeats_come_whatever_a_step_does(server):
    from mbcosim import exchange
    from mbcosim.coupling import open_stream
    with oscillator(server) as simulation:
        hello = exchange.hello(simulation, "spring", heartbeat_interval=0.02, peer_timeout=5)
        done = threading.Event()

        def messages():
            yield hello
            done.wait(10)

        stream = open_stream(server._channel)(messages(), metadata=server.metadata)
        names, start = [], time.monotonic()
        stepper = threading.Thread(target=lambda: pytest.raises(mbcosim.Error, simulation.step))
        for data in stream:
            names.append(exchange.receive(data)[0])
            if len(names) == 5:
                stepper.start()
            if names.count("heartbeat") == 30:
                break
        assert 0.3 < time.monotonic() - start < 5 * TIME_FACTOR
        assert names[0] == "welcome" and "exchange" in names  # and heartbeats before and after it
        assert names.index("exchange") < len(names) - 5
        done.set()
        stream.cancel()
        stepper.join(10)


def test_a_silent_peer_is_gone_though_no_step_asks_it(server, processes, daemon):
    from mbcosim import exchange
    from mbcosim.coupling import open_stream
    silence = 0.5 * TIME_FACTOR  # s that end a peer; a machine may stand still for a while
    with oscillator(server) as simulation:
        beat, stop = threading.Event(), threading.Event()
        beat.set()

        def messages():
            from mbcosim.v1 import coupling_pb2 as pb
            yield exchange.hello(simulation, "spring", heartbeat_timeout=silence)
            while not stop.wait(0.05):
                if beat.is_set():
                    yield pb.PeerMessage(heartbeat=pb.Heartbeat(count=1))

        stream = open_stream(server._channel)(messages(), metadata=server.metadata)
        next(stream)
        time.sleep(2 * silence)
        assert simulation.describe().ports[0].has_peer
        beat.clear()
        start = time.monotonic()
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        assert silence / 2 < time.monotonic() - start < silence + 2 * TIME_FACTOR
        stop.set()


def test_a_simulation_may_be_deleted_while_its_peer_talks_on(server, daemon):
    from mbcosim import exchange
    from mbcosim.coupling import open_stream
    from mbcosim.v1 import coupling_pb2 as pb
    for k in range(100):
        with oscillator(server) as simulation:
            stop = threading.Event()

            def messages():
                yield exchange.hello(simulation, "spring")
                while not stop.is_set():
                    yield pb.PeerMessage(heartbeat=pb.Heartbeat(count=1))

            stream = open_stream(server._channel)(messages(), metadata=server.metadata)
            next(stream)
            time.sleep(0.002 * (k % 5))
        with pytest.raises(grpc.RpcError) as ended:
            next(stream)
        stop.set()
        assert "deleted" in ended.value.details(), ended.value
    assert server.list() == [] and daemon.alive()


# ---------------------------------------------------------------- lost and repeated messages

def test_an_unreliable_line_gives_the_same_bits(server, daemon, tmp_path):
    """A relay loses 1 % of the requests and 1 % of the replies, and repeats 1 % of the requests."""
    steps = 10_000 if os.environ.get("MBCOSIM_NIGHTLY") else 1_500
    relay, found = Unreliable(str(tmp_path), daemon.address, part=0.02, seed=4), []
    for address in (daemon.address, relay.address):
        with oscillator(server) as simulation, mbcosim.connect(address, reconnect=30) as line:
            with simulation.couple("spring", spring):
                far = line.attach(simulation.name)
                for k in range(steps):
                    assert far.step().step == k + 1
            found.append(simulation.export_state())
    relay.close()
    assert relay.lost > 10 and relay.repeated > 5
    assert found[0] == found[1]


def test_a_deleted_simulation_ends_the_stream_of_an_idle_peer(server):
    simulation = oscillator(server)
    with simulation.couple("spring", spring) as peer:
        simulation.step(3)
        simulation.delete()
        wait_for(lambda: peer.error is not None)
        assert isinstance(peer.error, mbcosim.NotFound)


@pytest.mark.parametrize("end", ["interrupt", "delete"])
def test_a_peer_that_does_not_read_holds_up_no_step_that_is_cancelled(start_daemon, end):
    """It may be waited for until 10^9 s, and takes five bytes of what is sent to it."""
    daemon = start_daemon("--no-shared-memory")
    options = [("grpc.http2.lookahead_bytes", 5), ("grpc.http2.bdp_probe", 0)]
    with daemon.connect() as server, grpc.insecure_channel(daemon.address, options) as channel:
        simulation = server.load_text(decks.body(), ports=[mbcosim.signal_port("slow", ["time"], [])])
        over = threading.Event()

        def talk():
            presence = coupling_pb2.PeerPresence(peer_timeout=Duration(seconds=10**9))
            yield coupling_pb2.PeerMessage(hello=coupling_pb2.Hello(simulation=simulation.name, port="slow", presence=presence))
            over.wait()

        stream = coupling_pb2_grpc.CouplingStub(channel).Attach(talk())
        with futures.ThreadPoolExecutor() as pool:
            step = pool.submit(simulation.step)
            time.sleep(0.5 * TIME_FACTOR)
            assert not step.done()
            begun = time.monotonic()
            simulation.interrupt() if end == "interrupt" else simulation.delete()
            with contextlib.suppress(mbcosim.Error):  # of the simulation that is gone
                step.result(BOUND * TIME_FACTOR)
            assert time.monotonic() - begun < BOUND * TIME_FACTOR
        over.set()
        stream.cancel()
