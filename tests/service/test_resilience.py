"""Malice that once took the daemon down or locked others out: it goes on, and so do they."""
import contextlib
import os
import re
import resource
import signal
import socket
import subprocess
import sys
import threading
import time

import grpc
import pytest

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "benchmarks"))
import beam_models
import decks
import mbcosim
import reduce_scaling
from conftest import BIN, TIME_FACTOR, counts_memory, wait_for
from http2 import HalfMessages, flood
from mbcosim import bundle
from mbcosim.v1 import (coupling_pb2_grpc, reduction_pb2, reduction_pb2_grpc, simulations_pb2 as pb, simulations_pb2_grpc, telemetry_pb2,
                        telemetry_pb2_grpc)
from test_health import certificate
from test_operation import metrics

TOKENS = ("ann-token-0123456789 control ann\nbob-token-0123456789 control bob\n"
          "eve-token-0123456789 observe eve\nroot-token-0123456789 admin root\n")


def bearer(name):
    return [("authorization", f"Bearer {name}-token-0123456789")]


@pytest.fixture
def guarded(start_daemon, tmp_path):
    """A daemon with the tokens of ann, bob, eve (observe) and root (admin)."""
    tokens = tmp_path / "tokens"
    tokens.write_text(TOKENS)
    tokens.chmod(0o600)
    return lambda *options: ready(start_daemon("--tokens", str(tokens), *options))


def ready(daemon):
    wait_for(lambda: "listening on unix" in daemon.log())
    return daemon


def upload(deck, **options):
    return [pb.UploadRequest(header=pb.UploadHeader(bundle_main_file="deck", options=pb.CreateOptions(**options))),
            pb.UploadRequest(chunk={"path": "deck", "data": deck.encode()})]


def is_healthy(channel, timeout=2):
    call = channel.unary_unary("/grpc.health.v1.Health/Check", request_serializer=bytes, response_deserializer=bytes)
    return call(b"", timeout=timeout * TIME_FACTOR) == b"\x08\x01"


# ---------------------------------------------------------------- death

def test_leases_that_end_while_simulations_are_deleted(start_daemon):
    """60 forks with a lease of 150 ms, deleted from 4 threads in descending order of names, again and again."""
    from google.protobuf.duration_pb2 import Duration
    daemon = ready(start_daemon("--limit-sessions", "80"))
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        root = stub.CreateSimulation(iter(upload(decks.body()))).simulation.name
        lease = Duration(nanos=150_000_000)
        for _ in range(8):
            names = sorted((stub.ForkSimulation(pb.ForkSimulationRequest(
                simulation=root, options=pb.CreateOptions(lease=lease))).simulation.name for _ in range(60)), reverse=True)
            time.sleep(0.14)
            errors = []

            def delete(mine):
                for name in mine:
                    try:
                        stub.DeleteSimulation(pb.DeleteSimulationRequest(simulation=name))
                    except grpc.RpcError as error:
                        errors.append(error.code())

            threads = [threading.Thread(target=delete, args=(names[i::4],)) for i in range(4)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            assert daemon.alive(), daemon.log()[-2000:]
            assert set(errors) <= {grpc.StatusCode.NOT_FOUND}
        wait_for(lambda: len(stub.ListSimulations(pb.ListSimulationsRequest()).simulations) == 1)
    assert "uncaught" not in daemon.log()


def test_a_reader_of_the_log_that_leaves_ends_nobody(tmp_path):
    address = f"unix:{tmp_path}/socket"
    with subprocess.Popen([os.path.join(BIN, "mbcosimd"), "--listen", address], stderr=subprocess.PIPE) as daemon:
        try:
            assert b"listening" in daemon.stderr.readline()
            daemon.stderr.close()
            with mbcosim.connect(address, timeout=30 * TIME_FACTOR) as server:
                for _ in range(3):  # each is a line of the log
                    with pytest.raises(mbcosim.NotFound):
                        server.attach("simulations/none")
                with server.load_text(decks.body()) as simulation:
                    assert simulation.step(10).step == 10
            daemon.terminate()
            assert daemon.wait(30 * TIME_FACTOR) == 0
        finally:
            daemon.kill()


# ---------------------------------------------------------------- uploads

def test_half_an_upload_makes_nothing(server, daemon):
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        before = {s.name for s in server.list()}
        for i in range(40):
            sent = threading.Event()

            def pieces():
                yield from upload(decks.body())
                sent.set()
                time.sleep(30)

            call = stub.CreateSimulation.future(pieces())
            assert sent.wait(10)
            time.sleep(0.005 * (i % 4))
            call.cancel()
        time.sleep(0.5 * TIME_FACTOR)
        assert {s.name for s in server.list()} == before


def test_an_upload_of_a_client_that_dies_makes_nothing(server, daemon):
    before = {s.name for s in server.list()}
    for i in range(10):
        channel = grpc.insecure_channel(daemon.address, options=[("grpc.use_local_subchannel_pool", 1)])
        sent = threading.Event()

        def pieces():
            yield from upload(decks.body())
            sent.set()
            time.sleep(30)

        call = simulations_pb2_grpc.SimulationsStub(channel).CreateSimulation.future(pieces())
        assert sent.wait(10)
        time.sleep(0.005 * (i % 4))
        channel.close()
        assert call.done()
    time.sleep(0.5 * TIME_FACTOR)
    assert {s.name for s in server.list()} == before


def test_one_request_id_makes_one_simulation_though_four_ask_at_once(server, daemon):
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        for turn in range(5):
            calls = [stub.CreateSimulation.future(iter(upload(decks.body(), request_id=f"id-{turn}"))) for _ in range(4)]
            names = {call.result(30 * TIME_FACTOR).simulation.name for call in calls}
            assert len(names) == 1
            stub.DeleteSimulation(pb.DeleteSimulationRequest(simulation=names.pop()))


def test_an_upload_without_messages_ends(daemon):
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        held = threading.Event()

        def nothing():
            held.wait()
            return
            yield

        with pytest.raises(grpc.RpcError) as caught:
            stub.CreateSimulation(nothing(), timeout=30 * TIME_FACTOR)
        held.set()
        assert caught.value.code() == grpc.StatusCode.FAILED_PRECONDITION
        assert "no message came within 10 s" in caught.value.details()


# ---------------------------------------------------------------- lock-out

def threads_of(daemon):
    return len(os.listdir(f"/proc/{daemon.process.pid}/task"))


def test_silent_streams_cost_no_thread_and_lock_nobody_out(guarded):
    daemon = guarded()
    with grpc.insecure_channel(daemon.address) as mine, grpc.insecure_channel(daemon.address) as channel:
        assert is_healthy(channel)
        stop = threading.Event()

        def silence():
            stop.wait()
            return
            yield

        before = threads_of(daemon)
        attach = coupling_pb2_grpc.CouplingStub(mine).Attach
        calls = [attach(silence(), metadata=bearer("ann")) for _ in range(600)]
        wait_for(lambda: sum(call.code() is not None if call.done() else 0 for call in calls) >= 80)
        refused = [call for call in calls if call.done()]
        assert {call.code() for call in refused} == {grpc.StatusCode.RESOURCE_EXHAUSTED}
        assert "identity_streams" in dict(refused[0].trailing_metadata())["grpc-status-details-bin"].decode(errors="replace")
        assert threads_of(daemon) <= before + 20
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        start = time.monotonic()
        name = stub.CreateSimulation(iter(upload(decks.body())), metadata=bearer("bob")).simulation.name
        assert stub.Step(pb.StepRequest(simulation=name), metadata=bearer("bob")).step == 1
        assert is_healthy(channel)
        assert time.monotonic() - start < 5 * TIME_FACTOR
        stop.set()
        for call in calls:
            call.cancel()


def test_idle_step_streams_and_subscriptions_cost_no_thread(daemon, server):
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        name = stub.CreateSimulation(iter(upload(decks.body()))).simulation.name
        before = threads_of(daemon)
        stop = threading.Event()

        def one_step():
            yield pb.StepRequest(simulation=name)
            stop.wait()

        streams = [stub.StepStream(one_step()) for _ in range(40)]
        for stream in streams:
            try:
                next(stream)
            except grpc.RpcError as error:  # two at once: one of them finds the simulation busy
                assert error.code() == grpc.StatusCode.ABORTED
        subscribe = telemetry_pb2_grpc.TelemetryStub(channel).Subscribe
        subscriptions = [subscribe(telemetry_pb2.SubscribeRequest(simulation=name, handles=[0])) for _ in range(100)]
        for subscription in subscriptions:
            next(subscription)
        wait_for(lambda: threads_of(daemon) <= before + 8, 20)
        stop.set()
        for call in [*streams, *subscriptions]:
            call.cancel()
        stub.DeleteSimulation(pb.DeleteSimulationRequest(simulation=name))


def test_reflection_asks_for_credentials_when_the_service_does(guarded):
    daemon = guarded()
    with grpc.insecure_channel(daemon.address) as channel:
        for version in ("v1", "v1alpha"):
            info = channel.stream_stream(f"/grpc.reflection.{version}.ServerReflection/ServerReflectionInfo",
                                         request_serializer=bytes, response_deserializer=bytes)
            with pytest.raises(grpc.RpcError) as caught:
                next(info(iter([b"\x3a\x01*"])))
            assert caught.value.code() == grpc.StatusCode.UNAUTHENTICATED
            assert b"mbcosim.v1.Simulations" in next(info(iter([b"\x3a\x01*"]), metadata=bearer("eve")))
            symbol = b"mbcosim.v1.StepRequest"
            answer = next(info(iter([b"\x22" + bytes([len(symbol)]) + symbol]), metadata=bearer("eve")))
            assert b"mbcosim/v1/simulations.proto" in answer and b"mbcosim/v1/common.proto" in answer


@pytest.mark.parametrize("asks", [False, True])
def test_health_asks_for_credentials_on_request_only(guarded, asks):
    daemon = guarded(*(["--health-credentials"] if asks else []))
    with grpc.insecure_channel(daemon.address) as channel:
        if not asks:
            assert is_healthy(channel)
            return
        with pytest.raises(grpc.RpcError) as caught:
            is_healthy(channel)
        assert caught.value.code() == grpc.StatusCode.UNAUTHENTICATED
        check = channel.unary_unary("/grpc.health.v1.Health/Check", request_serializer=bytes, response_deserializer=bytes)
        assert check(b"", metadata=bearer("eve"), timeout=10) == b"\x08\x01"


def test_who_watches_health_from_one_machine_leaves_places_to_others(guarded):
    """Nobody asks who they are."""
    daemon = guarded("--listen", "127.0.0.1:0")
    address = daemon.tcp_address()

    def watch(channel):
        call = channel.unary_stream("/grpc.health.v1.Health/Watch", request_serializer=bytes, response_deserializer=bytes)
        stream = call(b"", timeout=60 * TIME_FACTOR)
        assert next(stream) == b"\x08\x01"
        return stream

    with contextlib.ExitStack() as stack:
        channels = [stack.enter_context(grpc.insecure_channel(address, [("grpc.use_local_subchannel_pool", 1)])) for _ in range(8)]
        streams = [watch(channels[k % 8]) for k in range(256)]
        with pytest.raises(grpc.RpcError) as caught:
            watch(channels[0])
        assert caught.value.code() == grpc.StatusCode.RESOURCE_EXHAUSTED
        watch(stack.enter_context(grpc.insecure_channel(daemon.address))).cancel()
        streams.pop().cancel()
        wait_for(lambda: is_watched(watch, channels[1]))


def is_watched(watch, channel):
    try:
        return watch(channel)
    except grpc.RpcError:
        return False


def test_one_identity_gets_half_of_the_simulations(guarded):
    daemon = guarded("--limit-sessions", "6")
    with daemon.connect(token="ann-token-0123456789") as ann, daemon.connect(token="bob-token-0123456789") as bob:
        held = [ann.load_text(decks.body()) for _ in range(3)]
        with pytest.raises(mbcosim.LimitExceeded) as caught:
            ann.load_text(decks.body())
        assert caught.value.metadata["limit"] == "identity_sessions"
        with bob.load_text(decks.body()) as simulation:
            assert simulation.step().step == 1
        for simulation in held:
            simulation.delete()


def test_calls_over_one_connection_are_limited(start_daemon):
    daemon = start_daemon("--listen", "127.0.0.1:0", "--insecure", "--limit-connection-calls", "5")
    address = daemon.tcp_address()
    own = [("grpc.use_local_subchannel_pool", 1)]
    with grpc.insecure_channel(address, options=own) as first, grpc.insecure_channel(address, options=own) as second:
        stop = threading.Event()

        def silence():
            stop.wait()
            return
            yield

        calls = [coupling_pb2_grpc.CouplingStub(first).Attach(silence()) for _ in range(6)]
        wait_for(lambda: sum(call.done() for call in calls) == 1)
        with pytest.raises(grpc.RpcError) as caught:
            simulations_pb2_grpc.SimulationsStub(first).GetServerInfo(pb.GetServerInfoRequest())
        assert caught.value.code() == grpc.StatusCode.RESOURCE_EXHAUSTED
        assert simulations_pb2_grpc.SimulationsStub(second).GetServerInfo(pb.GetServerInfoRequest()).version
        stop.set()
        for call in calls:
            call.cancel()


CROWD = """
import socket, sys, time
held = []
for _ in range(int(sys.argv[2])):
    held.append(socket.socket(socket.AF_UNIX))
    held[-1].connect(sys.argv[1])
print("there", flush=True)
time.sleep(600)
"""


@pytest.fixture
def start_crowd():
    """Function that starts a process which opens many connections and says nothing."""
    crowds = []

    def start(daemon, connections):
        crowds.append(subprocess.Popen([sys.executable, "-c", CROWD, daemon.address[len("unix:"):], str(connections)],
                                       stdout=subprocess.PIPE, text=True))
        assert crowds[-1].stdout.readline() == "there\n"
        return crowds[-1]

    yield start
    for crowd in crowds:
        crowd.kill()
        crowd.wait()
        crowd.stdout.close()


READER = """
import sys, time
import mbcosim
with mbcosim.connect(sys.argv[1]) as server:
    samples = server.attach(sys.argv[2]).subscribe(["node.structural.1.X"] * 5000, policy="drop_oldest", buffer=4)
    print("there", flush=True)
    time.sleep(600)
"""


def test_a_client_that_stands_still_with_its_socket_full_does_not_hold_up_the_end(start_daemon):
    """gRPC closes no connection in the middle of a write; a stopped process, or a paused container, may stay one for ever."""
    daemon = ready(start_daemon("--http", "127.0.0.1:0"))
    with daemon.connect() as server:
        simulation = server.load_text(decks.endless())
        reader = subprocess.Popen([sys.executable, "-c", READER, daemon.address, simulation.name], stdout=subprocess.PIPE, text=True)
        try:
            assert reader.stdout.readline() == "there\n"
            reader.send_signal(signal.SIGSTOP)
            wait_for(lambda: simulation.step(200) and metrics(daemon)["mbcosim_samples_dropped_total"] > 0)
            daemon.process.send_signal(signal.SIGTERM)
            assert daemon.process.wait(20 * TIME_FACTOR) == 0
            assert "that did not end are cut" in daemon.log()
        finally:
            reader.kill()
            reader.wait()
            reader.stdout.close()


def test_clients_at_rest_do_not_hold_up_the_end(start_daemon):
    """gRPC waits until they close their connections, which takes those of idle programs seconds."""
    daemon = start_daemon("--shutdown-grace", "600")
    with daemon.connect() as server, contextlib.closing(socket.socket(socket.AF_UNIX)) as silent:
        server.load_text(decks.endless()).step()
        silent.connect(daemon.address[len("unix:"):])
        daemon.process.send_signal(signal.SIGTERM)
        assert daemon.process.wait(20 * TIME_FACTOR) == 0


def is_found_healthy(daemon):
    return subprocess.run([os.path.join(BIN, "mbcosimd"), "--check", daemon.address], timeout=30 * TIME_FACTOR).returncode == 0


@pytest.mark.parametrize("crowds", [1, 4])
def test_a_few_processes_cannot_take_all_file_descriptors(start_daemon, start_crowd, crowds):
    daemon = ready(start_daemon())
    resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE, (150, 150))
    with daemon.connect() as server, server.load_text(decks.body()) as simulation:
        for _ in range(crowds):
            start_crowd(daemon, 300)
        wait_for(lambda: "connections are dropped" in daemon.log())
        assert simulation.step().step == 1
        for _ in range(3):
            assert is_found_healthy(daemon)
            with daemon.connect() as other:
                assert len(other.list()) == 1


def test_handshakes_of_one_source_take_a_part_of_the_memory(start_daemon, tmp_path):
    """Each takes some 64 KB before it has shown who it is."""
    certificate(tmp_path, "server", "/CN=localhost")
    pem, key = (str(tmp_path / f"server.{ending}") for ending in ("pem", "key"))
    daemon = start_daemon("--http", "127.0.0.1:0", "--listen", "127.0.0.1:0", "--tls-certificate", pem, "--tls-key", key, "--tls-client-ca", pem,
                          "--limit-memory", str(100 << 20))
    wait_for(lambda: "listening on 127.0.0.1:" in daemon.log())
    host, port = re.search(r"listening on (127\.0\.0\.1):(\d+)", daemon.log()).groups()
    with contextlib.ExitStack() as stack:
        for _ in range(250):
            stack.enter_context(contextlib.closing(socket.create_connection((host, int(port)), 30 * TIME_FACTOR)))
        wait_for(lambda: metrics(daemon)["mbcosim_connections_dropped_total"] == 250 - (100 << 20) // 8 // (80 << 10))
        assert is_found_healthy(daemon)


def test_a_daemon_without_file_descriptors_goes_on_serving_who_is_connected(start_daemon, start_crowd):
    daemon = ready(start_daemon("--http", "127.0.0.1:0"))
    resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE, (150, 150))
    with daemon.connect() as server, server.load_text(decks.body()) as simulation:
        crowds = [start_crowd(daemon, 60) for _ in range(4)]
        wait_for(lambda: "connections are dropped" in daemon.log())
        assert simulation.step(10).step == 10
        assert server.load_text(decks.body()).step().step == 1
        for crowd in crowds:
            crowd.kill()
        wait_for(lambda: is_found_healthy(daemon))
        with daemon.connect() as other:
            assert len(other.list()) == 2
        assert metrics(daemon)["mbcosim_connections_dropped_total"] > 0


# ---------------------------------------------------------------- memory

def resident(daemon):
    """Bytes."""
    with open(f"/proc/{daemon.process.pid}/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")


@counts_memory
def test_the_memory_of_a_deleted_model_goes_back_to_the_system(daemon, server):
    before = resident(daemon)
    with server.load_text(beam_models.cantilever(2000, 2)) as simulation:
        simulation.step()
        assert resident(daemon) - before > 100 << 20
    wait_for(lambda: resident(daemon) - before < 20 << 20)


def test_messages_that_never_come_whole_take_bounded_memory(start_daemon):
    """Health is open to anybody; 100 messages of 16 MB are begun there, of which nearly all comes."""
    daemon = ready(start_daemon("--limit-memory", "128M"))
    before = resident(daemon)
    half = HalfMessages(daemon.address[len("unix:"):], "/grpc.health.v1.Health/Check", 100, claimed=(16 << 20) - 100, sent=15 << 20)
    try:
        left = half.push(20)
        assert left <= 10 and half.sent > 60 << 20
        most = (700 << 20) * max(1, TIME_FACTOR / 5)  # 80 MB, and what sanitizers keep of freed memory or beside it
        assert resident(daemon) - before < most
    finally:
        half.close()
    with daemon.connect() as server, server.load_text(decks.body()) as simulation:
        assert simulation.step(10).step == 10


def test_values_that_are_asked_for_a_million_times_are_counted_first(start_daemon):
    """A few megabytes of handles are gigabytes of values."""
    daemon = ready(start_daemon("--limit-memory", "256M"))
    with daemon.connect() as server, server.load_text(decks.body()) as simulation, grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        handles = simulation.handles(["node.structural.1.R"]) * 3_000_000
        step = pb.StepRequest(simulation=simulation.name, outputs=handles)
        before = resident(daemon)
        for ask in (lambda: stub.ReadVariables(pb.ReadVariablesRequest(simulation=simulation.name, handles=handles)), lambda: stub.Step(step),
                    lambda: next(stub.StepStream(iter([step]))), lambda: list(stub.Run(pb.RunRequest(step=step)))):
            with pytest.raises(grpc.RpcError) as caught:
                ask()
            error = mbcosim.errors.from_rpc_error(caught.value)
            assert error.reason == "LIMIT_EXCEEDED" and error.metadata["limit"].endswith("memory_bytes")
        assert resident(daemon) - before < 400 << 20
        assert simulation.step(10).step == 10


def is_served(simulation):
    """False while as many calls of the same identity are under way as it may have."""
    try:
        return simulation.step().outcome == "ACCEPTED"
    except mbcosim.LimitExceeded:
        return False


def test_calls_that_are_reset_at_once_end(start_daemon):
    daemon = ready(start_daemon())
    with daemon.connect() as server:
        simulation = server.load_text(decks.body())
        assert flood(daemon.address, "/mbcosim.v1.Simulations/Step", 60, resets=True, count=1500) == (1500, False)
        wait_for(lambda: is_served(simulation), 30)
        assert "broken off" not in daemon.log()
        assert flood(daemon.address, "/mbcosim.v1.Simulations/Step", 60, resets=True, count=30_000)[0] > 1500
        wait_for(lambda: is_served(simulation), 30)


# ---------------------------------------------------------------- everything ends in time

def chain(bodies):
    """A plane chain of rigid links that hang on spherical hinges; 17 unknowns a link."""
    nodes = "".join(f"structural: {i}, dynamic, {0.1 * i}, 0., 0., eye, null, null;" for i in range(1, bodies + 1))
    masses = "".join(f"body: {i}, {i}, 1., null, diag, .01, .02, .03;" for i in range(1, bodies + 1))
    hinges = "".join(f"joint: {i}, spherical hinge, {i}, position, -.05, 0., 0., {i + 1}, position, .05, 0., 0.;"
                     for i in range(1, bodies))
    return f"""
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 10.; time step: 1e-3; method: ms, .6; tolerance: 1e-6; max iterations: 30;
derivatives tolerance: 1e-3; end: initial value;
begin: control data; structural nodes: {bodies}; rigid bodies: {bodies}; joints: {bodies}; gravity; end: control data;
begin: nodes; {nodes} end: nodes;
begin: elements; {masses} {hinges} joint: {bodies}, clamp, 1, node, node; gravity: uniform, 0., 0., -1., const, 9.81; end: elements;
"""


@pytest.fixture(scope="module")
def long_chain(daemon):
    """A simulation of 2200 unknowns, the service, and the identity that no other call has."""
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        name = stub.CreateSimulation(iter(upload(chain(145)))).simulation.name
        yield stub, name
        stub.DeleteSimulation(pb.DeleteSimulationRequest(simulation=name))


def cpu_of(daemon):
    """Seconds of processor time that the daemon has used."""
    with open(f"/proc/{daemon.process.pid}/stat") as file:
        return sum(map(int, file.read().rsplit(")", 1)[1].split()[11:13])) / os.sysconf("SC_CLK_TCK")


def is_at_rest(daemon):
    before = cpu_of(daemon)
    time.sleep(0.3)
    return cpu_of(daemon) - before < 0.03


ANALYSES = {
    "all eigenvalues": lambda stub, name: stub.ComputeEigenvalues.future(
        pb.ComputeEigenvaluesRequest(simulation=name, eigenvectors=True)),
    "many eigenvalues": lambda stub, name: stub.ComputeEigenvalues.future(
        pb.ComputeEigenvaluesRequest(simulation=name, count=700, shift=3.0)),
    "state space": lambda stub, name: stub.Linearize.future(
        pb.LinearizeRequest(simulation=name, inputs=[], outputs=list(range(4, 16)))),
    "many outputs": lambda stub, name: stub.Linearize.future(
        pb.LinearizeRequest(simulation=name, descriptor_form=True, outputs=list(range(4, 400)))),
}


def rests_within_a_second(daemon):
    ended = time.monotonic()
    wait_for(lambda: is_at_rest(daemon), 30)
    return time.monotonic() - ended < (1 + 0.35) * TIME_FACTOR  # the look takes 0.3 s by itself


@pytest.mark.parametrize("what", ANALYSES)
@pytest.mark.parametrize("after", [0.02, 0.5, 2.0])
def test_the_work_of_a_cancelled_analysis_ends_within_a_second(daemon, long_chain, what, after):
    wait_for(lambda: is_at_rest(daemon), 30)
    call = ANALYSES[what](*long_chain)
    time.sleep(after)
    call.cancel()
    assert rests_within_a_second(daemon)


LOOPS = "set: real x = 0.; " + "".join(f"for: integer i{n} = 1, 900000; set: x = sin(i{n}) * cos(i{n}); endfor; " for n in range(10))


@counts_memory
def test_a_deck_is_read_no_longer_than_a_second_after_its_deadline(daemon, server):
    for seconds in (0.2, 0.6, 1.2):
        wait_for(lambda: is_at_rest(daemon), 30)
        with pytest.raises(mbcosim.TimedOut):
            server.load_text(LOOPS + decks.body(), timeout=seconds)
        assert rests_within_a_second(daemon)


@counts_memory
@pytest.mark.parametrize("ask", ["CreateSimulation", "ValidateModel"])
def test_a_deck_is_read_no_longer_than_a_second_after_its_call_is_cancelled(daemon, ask):
    with grpc.insecure_channel(daemon.address) as channel:
        for after in (0.05, 0.6, 1.2):
            wait_for(lambda: is_at_rest(daemon), 30)
            before = cpu_of(daemon)
            call = getattr(simulations_pb2_grpc.SimulationsStub(channel), ask).future(iter(upload(LOOPS + decks.body())))
            wait_for(lambda: cpu_of(daemon) - before >= after, 30)
            assert call.cancel()
            assert rests_within_a_second(daemon)


def test_a_variable_is_not_described_over_and_over(daemon, server):
    with server.load_text(decks.body()) as simulation, grpc.insecure_channel(daemon.address) as channel:
        describe = simulations_pb2_grpc.SimulationsStub(channel).DescribeSimulation
        with pytest.raises(grpc.RpcError) as caught:
            describe(pb.DescribeSimulationRequest(simulation=simulation.name, variable_names=20000 * ["time"]))
        assert caught.value.code() == grpc.StatusCode.INVALID_ARGUMENT and "20000 names" in caught.value.details()
        assert len(describe(pb.DescribeSimulationRequest(simulation=simulation.name, variable_names=5000 * ["time"])).model.variables) == 5000


SHAPE = (16, 16, 16)
LONG = {"basis": "craig-bampton", "interface": ",".join(map(str, reduce_scaling.corner_labels(SHAPE))), "modes": 300,
        "inertia": "rigid", "expose": "interface"}


@pytest.fixture(scope="module")
def cube(tmp_path_factory):
    """Job of a reduction of 14 739 unknowns, which takes seconds in its matrices, its factorization and its shapes."""
    folder = tmp_path_factory.mktemp("cube")
    reduce_scaling.write_model(folder, SHAPE)
    job = folder / "cube.job"
    job.write_text("mass = M.mtx\nstiffness = K.mtx\nnodes = nodes.csv\ndofs = dofs.csv\n")
    return job


def reduce(channel, job):
    """The call."""
    main, files = bundle.collect_job(job)
    header = reduction_pb2.ReduceHeader(main_file=main)
    header.options.update({name: str(value) for name, value in LONG.items()})
    return reduction_pb2_grpc.ReductionStub(channel).Reduce(bundle.reduce_requests(header, files))


def test_a_reduction_goes_on_no_longer_than_a_second_after_its_deadline(daemon, server, cube):
    for seconds in (0.5, 1, 2):
        wait_for(lambda: is_at_rest(daemon), 30)
        with pytest.raises(mbcosim.TimedOut):
            server.reduce(cube, timeout=seconds, **LONG)
        assert rests_within_a_second(daemon)


def test_a_reduction_goes_on_no_longer_than_a_second_after_it_is_cancelled(daemon, cube):
    with grpc.insecure_channel(daemon.address) as channel:
        for after in (0.2, 1, 2, 4):
            wait_for(lambda: is_at_rest(daemon), 30)
            before = cpu_of(daemon)
            call = reduce(channel, cube)
            wait_for(lambda: cpu_of(daemon) - before >= after, 60)
            call.cancel()
            assert call.cancelled()
            assert rests_within_a_second(daemon)


EXPORTS = {
    "snapshot": lambda stub, name: stub.ExportSnapshot(pb.ExportSnapshotRequest(simulation=name)),
    "checkpoint": lambda stub, name: stub.ExportCheckpoint(pb.ExportCheckpointRequest(simulation=name)),
}


def weighty(stub):
    """Name of a stored simulation of 2200 unknowns with a deck of 48 MB."""
    remarks = [pb.UploadRequest(chunk={"path": "deck", "data": b"# " + os.urandom(4 << 20).hex().encode() + b"\n"}) for _ in range(6)]
    return stub.CreateSimulation(iter(upload(chain(145), durability=pb.DURABILITY_CHECKPOINT) + remarks)).simulation.name


@pytest.mark.parametrize("what", EXPORTS)
def test_the_work_of_a_cancelled_export_ends_within_a_second_and_holds_up_no_end(start_daemon, tmp_path, what):
    daemon = ready(start_daemon("--state-dir", str(tmp_path)))
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        name = weighty(stub)
        for pieces in (0, 1, 3):
            wait_for(lambda: is_at_rest(daemon), 30)
            call = EXPORTS[what](stub, name)
            for _ in range(pieces):
                next(call, None)
            call.cancel()
            assert rests_within_a_second(daemon)
    start = time.monotonic()
    daemon.stop()
    assert time.monotonic() - start < (1 + 2) * TIME_FACTOR


def test_the_daemon_ends_within_its_grace_whatever_runs(start_daemon, cube):
    daemon = ready(start_daemon())
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        name = stub.CreateSimulation(iter(upload(chain(145)))).simulation.name
        calls = [start(stub, name) for start in ANALYSES.values()]
        calls += [stub.CreateSimulation.future(iter(upload(deck))) for deck in (chain(2000), chain(2000), LOOPS + decks.body())]
        calls += [stub.ValidateModel.future(iter(upload(LOOPS + decks.body()))), reduce(channel, cube)]
        time.sleep(0.5)
        start = time.monotonic()
        daemon.stop()
        assert time.monotonic() - start < (1 + 2) * TIME_FACTOR  # the grace, and a second for what computes
        assert all(call.exception(10) is not None for call in calls)


def test_a_daemon_ends_within_its_grace_while_nobody_reads_its_exports(start_daemon, tmp_path):
    daemon = ready(start_daemon("--state-dir", str(tmp_path)))
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        name = weighty(stub)
        assert sum(len(reply.data) for reply in EXPORTS["checkpoint"](stub, name)) > 48 << 20
        calls = [EXPORTS[what](stub, name) for what in EXPORTS for _ in range(8)]
        assert all(next(call).data for call in calls)
        start = time.monotonic()
        daemon.stop()
        assert time.monotonic() - start < (1 + 2) * TIME_FACTOR
        for call in calls:  # what has come, and the end
            with contextlib.suppress(grpc.RpcError):
                list(call)


@pytest.mark.parametrize("side, held", [(18, False), (14, True)], ids=["large", "by the library, which can be stopped only where it allocates"])
def test_a_daemon_that_chooses_pivots_ends_within_its_grace_and_stores_the_others(start_daemon, tmp_path, side, held):
    """A first factorization of many seconds; a durable simulation beside it."""
    daemon = ready(start_daemon("--state-dir", str(tmp_path)))
    with daemon.connect() as server, grpc.insecure_channel(daemon.address) as channel:
        name = server.load_text(decks.body()).name
        server.attach(name).step(100)
        before = cpu_of(daemon)
        call = simulations_pb2_grpc.SimulationsStub(channel).CreateSimulation.future(iter(upload(decks.cube(side, held), durability=1)))
        wait_for(lambda: cpu_of(daemon) - before > 2, 60)
        start = time.monotonic()
        daemon.stop()
        assert time.monotonic() - start < (1 + 2) * TIME_FACTOR  # the grace, and a second for what computes
        assert call.exception(10) is not None
    with ready(start_daemon("--state-dir", str(tmp_path))).connect() as server:
        assert [(s.name, s.step) for s in server.list()] == [(name, 100)]


def test_analyses_of_one_client_starve_no_small_simulation(guarded):
    daemon = guarded()
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        large = stub.CreateSimulation(iter(upload(chain(145))), metadata=bearer("ann")).simulation.name
        small = stub.CreateSimulation(iter(upload(decks.body())), metadata=bearer("bob")).simulation.name
        request = pb.ComputeEigenvaluesRequest(simulation=large, eigenvectors=True)
        calls = [stub.ComputeEigenvalues.future(request, metadata=bearer("ann")) for _ in range(6)]
        time.sleep(0.3)
        slowest = 0
        for _ in range(20):
            start = time.monotonic()
            stub.Step(pb.StepRequest(simulation=small, steps=10), metadata=bearer("bob"))
            slowest = max(slowest, time.monotonic() - start)
        for call in calls:
            call.cancel()
        assert slowest < 1 * TIME_FACTOR


def test_an_observer_may_check_small_decks_only(guarded):
    daemon = guarded()
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        assert stub.ValidateModel(iter(upload(decks.body())), metadata=bearer("eve")).ok
        large = decks.body() + "# " + 300_000 * "x" + "\n"
        with pytest.raises(grpc.RpcError) as caught:
            stub.ValidateModel(iter(upload(large)), metadata=bearer("eve"))
        assert caught.value.code() == grpc.StatusCode.RESOURCE_EXHAUSTED
        assert stub.ValidateModel(iter(upload(large)), metadata=bearer("ann")).ok
        many = "set: real x = 0.; for: integer i = 1, 200000; set: x = i; endfor;" + decks.body()
        reply = stub.ValidateModel(iter(upload(many)), metadata=bearer("eve"))
        assert not reply.ok and "limit-statements" in {d.code for d in reply.diagnostics}


# ---------------------------------------------------------------- one client does not slow another

def test_only_the_owner_may_block_and_is_named(guarded):
    daemon = guarded()
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        subscribe = telemetry_pb2_grpc.TelemetryStub(channel).Subscribe
        name = stub.CreateSimulation(iter(upload(decks.body(final_time="100."))), metadata=bearer("ann")).simulation.name
        wanted = telemetry_pb2.SubscribeRequest(simulation=name, handles=[0] * 2000, buffer_samples=1,
                                                policy=telemetry_pb2.OVERFLOW_POLICY_BLOCK)
        with pytest.raises(grpc.RpcError) as caught:
            next(subscribe(wanted, metadata=bearer("root")))
        assert caught.value.code() == grpc.StatusCode.PERMISSION_DENIED
        stream = subscribe(wanted, metadata=bearer("ann"))
        next(stream)
        running = stub.Step.future(pb.StepRequest(simulation=name, steps=50000), metadata=bearer("ann"))
        wait_for(lambda: "subscriber" in stub.GetSimulation(pb.GetSimulationRequest(simulation=name),
                                                            metadata=bearer("ann")).simulation.waiting_for)
        stream.cancel()
        assert running.result(60 * TIME_FACTOR).step == 50000


def test_450_idle_subscribers_do_not_stop_a_run(daemon):
    """What they do not read is dropped and counted, not waited for. How little that costs is a matter of benchmarks
    (idle_subscribers.py)."""
    with grpc.insecure_channel(daemon.address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        name = stub.CreateSimulation(iter(upload(decks.body(final_time="1.e9")))).simulation.name
        request = telemetry_pb2.SubscribeRequest(simulation=name, handles=list(range(6)))
        watchers = [telemetry_pb2_grpc.TelemetryStub(channel).Subscribe(request) for _ in range(450)]
        for watcher in watchers:
            next(watcher)
        assert stub.Step(pb.StepRequest(simulation=name, steps=60000), timeout=60 * TIME_FACTOR).steps_done == 60000
        for watcher in watchers[::50]:
            received, step = 0, 0
            while step < 60000:
                reply = next(watcher)
                received += len(reply.samples)
                step = reply.samples[-1].step if reply.samples else step
            assert received + reply.total_dropped == 60000 and reply.total_dropped > 30000
        for watcher in watchers:
            watcher.cancel()
        stub.DeleteSimulation(pb.DeleteSimulationRequest(simulation=name))
