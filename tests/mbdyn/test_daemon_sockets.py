"""`mbcosimd --deck-sockets`: decks that name sockets run in a daemon with the codes they were written for, as in `mbcosim run`."""
import contextlib
import os
import socket
import struct
import sys
import threading
import time

import numpy as np
import pytest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "service"))
from conftest import TIME_FACTOR, start_daemon, wait_for  # noqa: E402,F401
from test_sockets import LOADS, deck, force, receive, run, shake  # noqa: E402,F401

import mbcosim  # noqa: E402
from mbcosim.v1 import simulations_pb2 as pb  # noqa: E402

PULL = force(points="1, 2")
STREAMS = dict(counts="forces: 2; output elements: 1; file drivers: 1;",
               drivers='begin: drivers; file: 1, stream, stream drive name, "push", create, yes, path, "in", 1; end: drivers;')
STREAM_CARDS = """force: 1, absolute, 1, position, null, 1.,0.,0., file, 1, 1;
force: 5, external structural, socket, create, yes, path, "s", 1, 2;
stream output: 9, stream name, "out", create, yes, path, "out", values, 2, drive, time, drive, file, 1, 1;"""


def spring(peer, size, tight=False):
    """Pulls two points to the origin; returns all messages when the other side ends."""
    messages, last = [], None
    while True:
        command = receive(peer, 1)
        if command == b"\5":
            return messages
        state = receive(peer, size)
        messages.append((command, state))
        x = np.frombuffer(state)[:6]
        done = not tight or (last is not None and np.abs(x - last).max() < 1e-7)
        last = None if done else x
        peer.sendall((b"\6" if done else b"\2") + (-3.0 * x).tobytes() + np.zeros(6).tobytes())


class Code(threading.Thread):
    """A code in a thread: connects to a Unix socket, then `work(socket)`."""

    def __init__(self, path, work):
        super().__init__(daemon=True)
        self.path, self.work, self.result, self.error = path, work, None, None
        self.start()

    def run(self):
        end = time.monotonic() + 30 * TIME_FACTOR
        try:
            while True:
                peer = socket.socket(socket.AF_UNIX)
                try:
                    peer.connect(self.path)
                    break
                except OSError:
                    peer.close()
                    if time.monotonic() > end:
                        raise
                    time.sleep(0.02)
            peer.settimeout(30 * TIME_FACTOR)
            with peer:
                self.result = self.work(peer)
        except (OSError, EOFError) as error:
            self.error = error

    def end(self):
        self.join(60 * TIME_FACTOR)
        assert not self.is_alive() and self.error is None, self.error
        return self.result


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "codes"
    path.mkdir()
    return path


@pytest.fixture
def server(start_daemon, folder):  # noqa: F811
    daemon = start_daemon("--deck-sockets", str(folder), "--limit-deck-sockets", "5")
    with daemon.connect() as connection:
        yield connection


def coupled(size=288, flags=0x202, count=2, tight=False):
    def work(peer):
        shake(peer, flags, count)
        return spring(peer, size, tight)

    return work


@pytest.mark.parametrize("mode", ["loose", "staggered", "tight", "loose, send after predict, no"])
def test_codes_are_told_bit_for_bit_what_mbcosim_run_tells(run, server, folder, mode):  # noqa: F811
    text = deck(f'force: 5, external structural, socket, create, yes, path, "s", coupling, {mode}, 2, 1, 2;', end=0.1)
    done = run(text)
    expected = Code(os.path.join(done.folder, "s"), coupled(tight=mode == "tight"))
    assert done.finish() == 0
    code = Code(str(folder / "s"), coupled(tight=mode == "tight"))
    with server.load_text(text, deck_sockets=30 * TIME_FACTOR, summed_time=True) as simulation:
        assert simulation.run_until(1.0).outcome == "FINISHED"
    found = code.end()
    assert len(found) >= 10 and found == expected.end()
    assert not (folder / "s").exists()


def coupled_one(peer):
    shake(peer, 0x202, 1)
    messages = []
    while True:
        command = receive(peer, 1)
        if command == b"\5":
            return messages
        messages.append((command, receive(peer, 144)))
        peer.sendall(b"\6" + np.array([1.0, 0, 0, 0, 0, 0.5]).tobytes())


def streams(folder, send):
    """A code for each socket of the deck with streams: pulls, drives, listens."""
    def drive(peer):
        for k in range(send):
            peer.sendall(struct.pack("<d", 0.5 * k))
        with contextlib.suppress(ConnectionResetError):  # what was sent beyond the end is not read
            receive_all(peer)

    def receive_all(peer):
        data = b""
        while more := peer.recv(4096):
            data += more
        return data

    return [Code(os.path.join(folder, "s"), coupled_one), Code(os.path.join(folder, "in"), drive),
            Code(os.path.join(folder, "out"), receive_all)]


def test_streams_and_a_force_together_carry_the_bytes_of_mbcosim_run(run, server, folder):  # noqa: F811
    text = deck(STREAM_CARDS, end=0.1, **STREAMS)
    done = run(text)
    expected = streams(done.folder, 12)
    assert done.finish() == 0, done.errors
    found = streams(str(folder), 12)
    with server.load_text(text, deck_sockets=True, summed_time=True) as simulation:
        assert simulation.run_until(1.0).outcome == "FINISHED"
    force_seen, _, out = [code.end() for code in found]
    assert len(force_seen) > 10 and len(out) == 16 * len(force_seen)
    assert (force_seen, out) == (expected[0].end(), expected[2].end())


def text_driver(address):
    return deck("force: 1, absolute, 1, position, null, 1.,0.,0., file, 1, 1;", end=1.0, counts="forces: 1; file drivers: 1;",
                drivers=f"begin: drivers; file: 1, socket, 1, initial values, 3., {address}; end: drivers;")


def test_lines_of_text_set_the_values_of_the_next_step(server, folder):
    with server.load_text(text_driver('local, "t"'), deck_sockets=0.5) as simulation:
        simulation.step()
        assert simulation["stream.socket1"] == 3
        for text, expected in [(b"label: 1\nvalue: 4\n.\n", 4), (b"label: 2\nvalue: 5\n.\n", 4), (b"label: 1\nval", 4)]:
            with socket.socket(socket.AF_UNIX) as code:
                code.connect(str(folder / "t"))
                code.sendall(text)
                start = time.monotonic()
                assert simulation.step().outcome == "ACCEPTED"  # nobody is lost, who stays silent is closed
                assert time.monotonic() - start < 5 * TIME_FACTOR
            assert simulation["stream.socket1"] == expected
    assert not list(folder.iterdir())


def test_with_the_simulation_its_sockets_go_although_a_stream_of_steps_is_open(server, folder):
    """Who holds the stream does not hold the path: the next simulation of the deck listens there."""
    for _ in range(3):
        simulation = server.load_text(text_driver('local, "t"'), deck_sockets=0.5)
        more = threading.Event()

        def requests():
            yield pb.StepRequest(simulation=simulation.name, steps=1)
            more.wait(30 * TIME_FACTOR)

        replies = server.simulations.StepStream(requests(), metadata=server.metadata)
        assert next(replies).step.steps_done == 1
        assert [path.name for path in folder.iterdir()] == ["t"]
        server.simulations.DeleteSimulation(pb.DeleteSimulationRequest(simulation=simulation.name), metadata=server.metadata)
        assert not list(folder.iterdir())
        more.set()
        replies.cancel()


def test_text_drivers_listen_inside_the_folder_only_and_are_ports_otherwise(server, folder):
    with pytest.raises(mbcosim.Error, match='socket drive "socket1": the server opens Unix sockets only, not 127.0.0.1:5555'):
        server.load_text(text_driver("port, 5555"), deck_sockets=True)
    with pytest.raises(mbcosim.Error, match="is not inside"):
        server.load_text(text_driver('local, "../t"'), deck_sockets=True)
    with server.load_text(text_driver('local, "t"')) as simulation:
        with simulation.couple("socket1", lambda motion: [2.5]):
            simulation.step()
        assert simulation["stream.socket1"] == 2.5
    assert not list(folder.iterdir())


def test_without_being_asked_the_sockets_are_ports_and_nothing_is_opened(server, folder):
    with server.load_text(PULL) as simulation:
        name = simulation.describe().ports[0].name
        with simulation.couple(name, lambda motion: np.zeros((2, 3))):
            simulation.step()
    assert not list(folder.iterdir())


def test_a_daemon_without_the_option_refuses_by_its_name(start_daemon, folder):  # noqa: F811
    with start_daemon().connect() as server:  # noqa: F811
        with pytest.raises(mbcosim.Error, match="started without --deck-sockets") as caught:
            server.load_text(PULL, deck_sockets=True)
    assert caught.value.reason == "DECK_SOCKETS"
    assert not list(folder.iterdir())


@pytest.mark.parametrize("address, told", [
    ('socket, create, yes, port, 9011, host, "127.0.0.1"', "force 5: the server opens Unix sockets only, not 127.0.0.1:9011"),
    ('socket, create, no, port, 9011, host, "10.0.0.1"', "force 5: the server opens Unix sockets only, not 10.0.0.1:9011"),
    ('socket, create, yes, path, "/tmp/outside"', 'force 5: "/tmp/outside" is not inside'),
    ('socket, create, yes, path, "../s"', 'force 5: "../s" is not inside'),
    ('socket, create, yes, path, "sub/../../s"', "is not inside"),
    ('socket, create, yes, path, "missing/s"', 'force 5: "missing/s" is not inside'),
    ('socket, create, yes, path, "way/s"', 'force 5: "way/s" is not inside'),
    ('socket, create, no, path, "link"', 'force 5: "link" is a symbolic link'),
    ('"in", "out"', "force 5: the server exchanges no files with codes"),
])
def test_only_unix_sockets_inside_the_folder_are_opened(server, folder, tmp_path, address, told):
    (folder / "sub").mkdir()
    (folder / "way").symlink_to(tmp_path)
    (folder / "link").symlink_to(tmp_path / "elsewhere")
    before = sorted(os.listdir(folder)), sorted(os.listdir(tmp_path))
    with pytest.raises(mbcosim.Error, match=told.replace("(", r"\(")) as caught:
        server.load_text(force(address=address, points="1, 2"), deck_sockets=True)
    assert caught.value.reason == "DECK_SOCKETS"
    assert (sorted(os.listdir(folder)), sorted(os.listdir(tmp_path))) == before


def test_absolute_paths_and_folders_inside_are_served(server, folder):
    (folder / "sub").mkdir()
    for path in [str(folder / "sub" / "t"), "sub/t"]:
        code = Code(str(folder / "sub" / "t"), coupled())
        text = force(address=f'socket, create, yes, path, "{path}"', points="1, 2")
        with server.load_text(text, deck_sockets=True) as simulation:
            simulation.step(2)
        assert len(code.end()) == 3


def test_the_deck_connects_where_the_code_listens(server, folder):
    listener, found = socket.socket(socket.AF_UNIX), []
    listener.bind(str(folder / "code"))
    listener.listen(1)
    listener.settimeout(30 * TIME_FACTOR)

    def work():
        peer, _ = listener.accept()
        peer.settimeout(30 * TIME_FACTOR)
        with peer:
            found.append(receive(peer, 10)[0])
            found.append(spring(peer, 288))

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    with server.load_text(force(address='socket, create, no, path, "code"', points="1, 2"), deck_sockets=True) as simulation:
        simulation.step(2)
    thread.join(30 * TIME_FACTOR)
    listener.close()
    assert found[0] == 7 and len(found[1]) == 3


def test_a_code_that_does_not_come_is_named_in_time_and_leaves_nothing(server, folder):
    start = time.monotonic()
    with pytest.raises(mbcosim.Error, match=r"force 5 \(s\): nobody connected in time") as caught:
        server.load_text(PULL, deck_sockets=0.5)
    assert time.monotonic() - start < 5 * TIME_FACTOR and caught.value.reason == "PEER_LOST"
    assert not list(folder.iterdir()) and not server.list()


def test_a_code_that_does_not_fit_is_told(server, folder):
    def work(peer):
        peer.sendall(b"\7" + struct.pack("<II", 0x202, 3))
        return receive(peer, 1)

    code = Code(str(folder / "s"), work)
    with pytest.raises(mbcosim.Error, match="the peer does not fit.*3"):
        server.load_text(PULL, deck_sockets=True)
    assert code.end() == b"\5"


@pytest.mark.parametrize("padded", [True, False])
def test_codes_that_pad_labels_are_served_when_the_client_says_that_they_do(server, folder, padded):
    text = force("labels, yes, orientation, orientation vector,", points="1", count=1)
    head = struct.pack("<II", 1, 0)

    def work(peer):
        peer.sendall(b"\7" + struct.pack("<II", 0x112, 1))
        messages = []
        if receive(peer, 1) == b"\10":
            while receive(peer, 1) != b"\5":
                messages.append(receive(peer, len(head) + 96))
                peer.sendall(b"\6" + head + LOADS[:24] + bytes(24))
        return messages

    code = Code(str(folder / "s"), work)
    if padded:
        with server.load_text(text, deck_sockets=True, padded_labels=True) as simulation:
            simulation.step(2)
        messages = code.end()
        assert len(messages) == 3 and all(message.startswith(head) for message in messages)
    else:
        with pytest.raises(mbcosim.Error, match="or `padded_labels` in a daemon"):
            server.load_text(text, deck_sockets=True)
        assert code.end() == []


def answers(replies):
    """A code that gives these answers, then stays silent."""
    def work(peer):
        shake(peer, 0x202, 2)
        for reply in replies:
            receive(peer, 1 + 288)
            peer.sendall(reply)
        while peer.recv(4096):
            pass

    return work


@pytest.mark.parametrize("last, told", [
    (b"", "silent for"), (b"\6" + LOADS[:50], "silent for"), (b"\6" + np.full(12, np.nan).tobytes(), "finite"), (b"\11", "unknown command 9")])
def test_bad_codes_fail_the_step_and_nothing_else(server, folder, last, told):
    code = Code(str(folder / "s"), answers([b"\6" + LOADS, b"\6" + LOADS, last]))
    with server.load_text(PULL, deck_sockets=0.5) as simulation:
        simulation.step()
        start = time.monotonic()
        with pytest.raises(mbcosim.StepFailed, match=told):
            simulation.step()
        with pytest.raises(mbcosim.StepFailed, match=told):
            simulation.step()
        assert time.monotonic() - start < 5 * TIME_FACTOR
        simulation.refresh()
        assert simulation.info.step == 1
    code.join(30 * TIME_FACTOR)


def test_an_answer_that_is_too_long_fails_the_next_step(server, folder):
    code = Code(str(folder / "s"), answers([b"\6" + LOADS, b"\6" + LOADS + bytes(100), b""]))
    with server.load_text(PULL, deck_sockets=True) as simulation:
        assert simulation.step().outcome == "ACCEPTED"
        with pytest.raises(mbcosim.StepFailed, match=r"force 5 \(s\): unknown command 0 from the peer"):
            simulation.step()
        simulation.refresh()
        assert simulation.info.step == 1
    code.join(30 * TIME_FACTOR)


def test_a_code_that_dies_is_named(server, folder):
    def work(peer):
        shake(peer, 0x202, 2)
        receive(peer, 1 + 288)
        peer.sendall(b"\6" + LOADS)
        receive(peer, 1 + 288)

    code = Code(str(folder / "s"), work)
    with server.load_text(PULL, deck_sockets=True) as simulation:
        with pytest.raises(mbcosim.StepFailed, match=r"force 5 \(s\): closed by the peer"):
            simulation.step()
    code.end()


def test_a_code_may_end_the_run(server, folder):
    def work(peer):
        shake(peer, 0x202, 2)
        for reply in [b"\6" + LOADS, b"\5"]:
            receive(peer, 1 + 288)
            peer.sendall(reply)
        return peer.recv(1)

    code = Code(str(folder / "s"), work)
    with server.load_text(PULL, deck_sockets=True) as simulation:
        with pytest.raises(mbcosim.StepFailed, match="force 5: the code has ended the run"):
            simulation.step(2)
        simulation.refresh()
        assert simulation.info.step == 1
    assert code.end() == b"\5"


def test_a_call_that_is_cancelled_ends_at_once(server, folder):
    code = Code(str(folder / "s"), answers([b"\6" + LOADS]))
    with server.load_text(PULL, deck_sockets=600) as simulation:
        threading.Timer(0.5, simulation.interrupt).start()
        start = time.monotonic()
        assert simulation.step().outcome == "INTERRUPTED"
        assert time.monotonic() - start < 10 * TIME_FACTOR
        with pytest.raises(mbcosim.StepFailed, match="cannot be asked again"):
            simulation.step()
    code.join(30 * TIME_FACTOR)


def test_what_codes_cannot_follow_is_refused(server, folder):
    with server.load_text(PULL) as simulation:
        port = simulation.describe().ports[0].name
    code = Code(str(folder / "s"), coupled())
    with server.load_text(PULL, deck_sockets=True) as simulation:
        saved = simulation.snapshot()
        simulation.step()
        located = mbcosim.Condition("time", ">", 0.015, locate_within=1e-6)
        for call in [saved.restore, simulation.reset, lambda: simulation.step(1, until=located)]:
            with pytest.raises(mbcosim.Error, match="cannot go back") as caught:
                call()
            assert caught.value.reason == "DECK_SOCKETS"
        with pytest.raises(mbcosim.Error, match="the code at the socket"):
            simulation.couple(port, lambda motion: np.zeros((2, 3)))
        fork = simulation.fork()  # has the ports, and no codes
        fork.delete()
        simulation.step()
    assert len(code.end()) == 3
    with pytest.raises(mbcosim.Error, match="record_ports"):
        server.load_text(PULL, deck_sockets=True, record=True)
    with pytest.raises(mbcosim.Error, match="names no socket"):
        server.load_text(deck("", counts=""), deck_sockets=True)
    for seconds in [0, -1, 4000]:
        with pytest.raises(mbcosim.Error, match="peer_timeout"):
            server.load_text(PULL, deck_sockets=seconds)


def test_others_go_on_while_a_code_is_waited_for(server, folder):
    waiting = [threading.Thread(target=refused, args=(server, force(address=f'socket, create, yes, path, "w{k}"', points="1, 2")))
               for k in range(3)]
    for thread in waiting:
        thread.start()
    wait_for(lambda: len(list(folder.iterdir())) == 2)
    start = time.monotonic()
    with server.load_text(deck("", counts="")) as simulation:
        simulation.step()
    assert time.monotonic() - start < 3 * TIME_FACTOR
    for thread in waiting:
        thread.join(60 * TIME_FACTOR)
    assert not list(folder.iterdir())


def refused(server, text):
    with pytest.raises(mbcosim.Error, match="nobody connected|wait for the codes"):
        server.load_text(text, deck_sockets=4 * TIME_FACTOR)


def test_the_number_of_sockets_is_bounded(server, folder):
    text = deck(STREAM_CARDS, end=0.1, **STREAMS)
    codes = streams(str(folder), 3)
    with server.load_text(text, deck_sockets=True):
        with pytest.raises(mbcosim.Error, match="too many sockets") as caught:
            server.load_text(text, deck_sockets=True)
        assert caught.value.reason == "LIMIT_EXCEEDED"
    for code in codes:
        code.end()


def test_the_folder_is_not_that_of_the_daemons_own_socket(tmp_path):
    import subprocess
    from conftest import BIN
    started = subprocess.run([os.path.join(BIN, "mbcosimd"), "--listen", f"unix:{tmp_path}/d.sock", "--deck-sockets", str(tmp_path)],
                             capture_output=True, text=True, timeout=60)
    assert started.returncode != 0 and "needs a folder of its own" in started.stderr


def test_they_do_not_outlive_the_daemon(start_daemon, folder, tmp_path):  # noqa: F811
    (tmp_path / "state").mkdir()
    daemon = start_daemon("--deck-sockets", str(folder), "--state-dir", str(tmp_path / "state"))
    with daemon.connect() as server:  # noqa: F811
        with pytest.raises(mbcosim.Error, match="do not outlive") as caught:
            server.load_text(PULL, deck_sockets=True, durability="checkpoint")
        assert caught.value.reason == "NOT_DURABLE"
        code = Code(str(folder / "s"), coupled())
        simulation = server.load_text(PULL, deck_sockets=True)
        simulation.step()
        daemon.stop()
    assert len(code.end()) == 2
