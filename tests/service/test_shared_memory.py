"""Peers over shared memory: who may come, and what happens when one side is killed, stopped or leaves."""
import contextlib
import os
import signal
import socket
import stat
import subprocess
import sys
import threading
import time

import grpc
import pytest

import decks
import mbcosim
from conftest import BIN, TIME_FACTOR, Daemon, wait_for
from test_coupling import PORT, oscillator, spring

KIT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance")
sys.path.insert(0, KIT)
import wires  # noqa: E402

BOUND = 0.5  # time-out of the peers below [s]
PEER = """
import sys, time
from mbcosim.v1 import coupling_pb2 as pb, coupling_types_pb2 as types
import wires
address, simulation, mode, hang_at = sys.argv[1:]
hello = pb.Hello(simulation=simulation, port="spring")
hello.schedule.mode = types.CouplingMode.Value("COUPLING_MODE_" + mode)
hello.presence.peer_timeout.FromMilliseconds(500)
wire = wires.SharedMemoryWire(address)
wire.send(pb.PeerMessage(hello=hello))
while (message := wire.receive(60)) is not wires.END:
    kind = message.WhichOneof("content")
    if kind == "exchange" and message.exchange.index == int(hang_at):
        kind = "hangs"
    if kind == "exchange":
        wire.send(pb.PeerMessage(exchange=pb.PeerExchange(index=message.exchange.index, answer=pb.PeerAnswer(forces=[0.0] * 3))))
    print(kind, flush=True)
"""


@pytest.fixture
def start_peer(daemon):
    """Function that starts a peer in a process of its own: answers until exchange `hang_at`, and prints what it got."""
    started = []

    def start(simulation, mode="LOOSE", hang_at=0):
        command = [sys.executable, "-c", PEER, daemon.address, simulation.name, mode, str(hang_at)]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([KIT, os.environ["PYTHONPATH"]])}
        started.append(subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True))
        assert started[-1].stdout.readline() == "welcome\n"
        return started[-1]

    yield start
    for peer in started:
        peer.kill()
        peer.wait()
        peer.stdout.close()


def harm(peer, how):
    """kill: dead; stop: does not run any more; close: leaves as a program that ends does."""
    peer.send_signal({"kill": signal.SIGKILL, "stop": signal.SIGSTOP, "close": signal.SIGTERM}[how])


@pytest.mark.parametrize("when", ["idle", "in step", "in iteration"])
@pytest.mark.parametrize("how", ["kill", "stop", "close"])
def test_a_lost_peer_costs_one_step_and_little_time(server, start_peer, how, when):
    with oscillator(server) as simulation:
        mode, hang_at = {"idle": ("LOOSE", 0), "in step": ("LOOSE", 3), "in iteration": ("TIGHT", 4)}[when]
        peer = start_peer(simulation, mode, hang_at)
        simulation.step(2)
        if when == "idle":
            harm(peer, how)
        else:
            threading.Thread(target=lambda: (wait_until_it_hangs(peer), harm(peer, how)), daemon=True).start()
        start = time.monotonic()
        with pytest.raises(mbcosim.StepFailed) as caught:
            simulation.step(3)
        assert caught.value.reason == "PEER_LOST" and time.monotonic() - start < (BOUND + 2) * TIME_FACTOR
        at = caught.value.result.step
        assert 2 <= at < 5
        peer.kill()
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        with simulation.couple("spring", spring):
            assert simulation.step().step == at + 1


def wait_until_it_hangs(peer):
    for line in peer.stdout:
        if line == "hangs\n":
            return


def test_nothing_is_left_of_killed_peers(daemon, server, start_peer):
    def resources():
        base = f"/proc/{daemon.process.pid}"
        return len(os.listdir(f"{base}/fd")), len(os.listdir(f"{base}/task"))

    shared = sorted(os.listdir("/dev/shm"))
    with oscillator(server) as simulation:
        def cycle():
            peer = start_peer(simulation)
            simulation.step()
            peer.kill()
            wait_for(lambda: not simulation.describe().ports[0].has_peer)

        cycle()
        time.sleep(0.3)
        before = resources()
        for _ in range(5):
            cycle()
        wait_for(lambda: all(now <= then + 1 for now, then in zip(resources(), before)))
    assert not [name for name in os.listdir("/dev/shm") if name not in shared and "mbcosim" in name]


def test_a_peer_notices_the_death_of_the_daemon(start_daemon):
    daemon = start_daemon()
    with daemon.connect() as server:
        simulation = server.load_text(decks.body(final_time="100.", spin="null"), ports=PORT)
        peer = subprocess.Popen([os.path.join(BIN, "spring_peer"), daemon.address, "--join", simulation.name, "spring",
                                 "--shared-memory"], stdout=subprocess.PIPE, text=True)
        simulation.step(3)
        daemon.process.kill()
        output, _ = peer.communicate(timeout=10)
        assert peer.returncode == 0 and output.endswith("exchanges\n")
    daemon.process.wait()
    daemon.process = subprocess.Popen(["true"])  # for the fixture, which expects a good end
    daemon.process.wait()


def test_the_socket_is_for_its_user_and_goes_with_the_daemon(start_daemon):
    daemon = start_daemon()
    daemon.connect().close()
    path = daemon.address[len("unix:"):] + ".shm"
    assert stat.S_IMODE(os.stat(path).st_mode) == 0o600 and stat.S_ISSOCK(os.stat(path).st_mode)
    daemon.stop()
    assert not os.path.exists(path)


def test_a_stale_socket_is_replaced_and_nothing_else(tmp_path):
    path = tmp_path / "mbcosim.sock.shm"
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as old:
        old.bind(str(path))
    daemon = Daemon(str(tmp_path))
    daemon.connect().close()
    daemon.stop()
    path.write_text("precious")
    refused = subprocess.run([os.path.join(BIN, "mbcosimd"), "--listen", f"unix:{tmp_path}/mbcosim.sock"], timeout=20, text=True,
                             stderr=subprocess.PIPE)
    assert refused.returncode == 4 and "is not a socket" in refused.stderr and path.read_text() == "precious"


def test_a_long_path_leaves_no_room_for_it(tmp_path):
    """The longest path that a socket may have is served without."""
    folder = str(tmp_path)
    address = f"unix:{folder}/{'x' * (106 - len(folder))}"
    daemon = subprocess.Popen([os.path.join(BIN, "mbcosimd"), "--listen", address], stderr=subprocess.PIPE, text=True)
    with mbcosim.connect(address, timeout=30) as server:
        assert server.info().version
    daemon.terminate()
    _, log = daemon.communicate(timeout=20)
    assert daemon.returncode == 0 and "no shared memory" in log


def test_it_can_be_off(start_daemon):
    daemon = start_daemon("--no-shared-memory")
    with daemon.connect() as server, oscillator(server) as simulation:
        assert not os.path.exists(daemon.address[len("unix:"):] + ".shm")
        with simulation.couple("spring", spring):
            assert simulation.step().step == 1


def ask(connection, word):
    """The answer to a request: the memory, or nothing and the status of the refusal."""
    connection.send(b"mbcosim1" + word)
    answer, fds, _, _ = socket.recv_fds(connection, 1 << 16, 1)
    for fd in fds:
        os.close(fd)
    return (True, None) if fds else (False, wires.Status(answer[8], answer[9:]))


def knock(daemon):
    """A connection that has not asked yet."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    connection.connect(daemon.address[len("unix:"):] + ".shm")
    connection.settimeout(10 * TIME_FACTOR)
    return connection


@pytest.fixture
def guarded(start_daemon, tmp_path):
    """Function that starts a daemon with the tokens of ann and bob."""
    tokens = tmp_path / "tokens"
    tokens.write_text("s3cret control ann\nother control bob\n")

    def start(*options):
        daemon = start_daemon("--tokens", str(tokens), *options)
        daemon.connect(token="s3cret").close()
        return daemon

    return start


def test_tokens_are_asked_for(guarded):
    daemon = guarded()
    for word, refused in [(b"", True), (b"Bearer wrong", True), (b"Bearer s3cret", False)]:
        with knock(daemon) as peer:
            memory, status = ask(peer, word)
            assert memory != refused
            if refused:
                assert (status.code, status.reason) == (grpc.StatusCode.UNAUTHENTICATED.value[0], "UNAUTHENTICATED")


def test_one_identity_leaves_places_to_others(guarded):
    """Of peers that have their memory and say nothing more, for ten seconds."""
    daemon = guarded("--limit-shared-memory-peers", "4")
    with contextlib.ExitStack() as stack:
        def limit(word):
            memory, status = ask(stack.enter_context(knock(daemon)), word)
            return None if memory else status.metadata["limit"]

        own = "identity_shared_memory_peers"
        assert [limit(b"Bearer s3cret") for _ in range(3)] == [None, None, own]
        assert [limit(b"Bearer other") for _ in range(2)] == [None, own]
    wait_for(lambda: ask_again(daemon))


def ask_again(daemon):
    with knock(daemon) as peer:
        return ask(peer, b"Bearer s3cret")[0]


def is_open(connection):
    connection.setblocking(False)
    try:
        return connection.recv(1) != b""
    except BlockingIOError:
        return True


def test_silent_clients_take_no_places_and_no_threads(daemon, server):
    threads = len(os.listdir(f"/proc/{daemon.process.pid}/task"))
    with contextlib.ExitStack() as stack:
        silent = [stack.enter_context(knock(daemon)) for _ in range(300)]
        assert ask(stack.enter_context(knock(daemon)), b"")[0]
        assert len(os.listdir(f"/proc/{daemon.process.pid}/task")) <= threads + 10
        wait_for(lambda: sum(map(is_open, silent)) <= 64)
        wait_for(lambda: not any(map(is_open, silent)), 20)  # the last ones after five seconds


SILENT = """
import socket, sys, time
connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
connection.connect(sys.argv[1])
start = time.monotonic()
print("silent", flush=True)
sys.stdin.readline()
connection.send(b"mbcosim1")
print(len(connection.recv(100)) > 0, time.monotonic() - start)
"""


def test_a_process_with_many_silent_clients_loses_its_own(daemon, server):
    seconds = 5.0
    while seconds > 4:  # later the client would have been silent for too long itself
        with contextlib.ExitStack() as stack:
            modest = stack.enter_context(subprocess.Popen([sys.executable, "-c", SILENT, daemon.address[len("unix:"):] + ".shm"],
                                                          stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
            assert modest.stdout.readline() == "silent\n"
            for _ in range(200):
                stack.enter_context(knock(daemon))
            output, _ = modest.communicate("\n", timeout=30 * TIME_FACTOR)
            served, seconds = output.split()[0] == "True", float(output.split()[1])
    assert served


@pytest.mark.parametrize("packet", [b"", b"x", b"mbcosim2", b"GET / HTTP/1.1\r\n"])
def test_strangers_are_shown_the_door(daemon, server, packet):
    path = daemon.address[len("unix:"):] + ".shm"
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as stranger:
        stranger.connect(path)
        stranger.settimeout(10)
        stranger.send(packet)
        if packet:
            assert stranger.recv(100) == b""
    assert server.info().version


def test_a_deleted_simulation_ends_the_link_of_an_idle_peer(server, start_peer):
    simulation = oscillator(server)
    peer = start_peer(simulation)
    simulation.step(2)
    simulation.delete()
    peer.wait(5 * TIME_FACTOR)
