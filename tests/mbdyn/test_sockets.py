"""`mbcosim run` with decks that name sockets and files: bytes and numbers as MBDyn has them, and peers that misbehave.

Expected bytes and numbers were recorded from runs of MBDyn with peers of the same behaviour; decks stand below.
"""
import os
import shutil
import signal
import socket
import struct
import subprocess
import threading
import time

import numpy as np
import pytest

BIN = os.environ["MBCOSIM_BIN"]
TIME_FACTOR = float(os.environ.get("MBCOSIM_TIME_FACTOR", "1"))
RUN = """begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: {end}; time step: 1e-2; tolerance: 1e-10; max iterations: 20;
derivatives tolerance: 1e-4; derivatives max iterations: 10; end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 2; {counts} output precision: 16; default orientation: orientation matrix; end: control data;
begin: nodes; structural: 1, dynamic, 1.,2.,3., euler123, .1,.2,.3, .1,.2,.3, 0.,0.,1.;
structural: 2, dynamic, {node2}; end: nodes;
{drivers}
begin: elements; body: 1, 1, 1., null, eye; body: 2, 2, 1., null, eye;
{cards} end: elements;
"""
FREE = "2.,-1.,1.5, eye, null, 1.,0.,0."
TURNED = "2.,-1.,1.5, euler123, .2,.3,-.1, .5,.6,.7, 1.,2.,3."
LOADS = np.array([[1.0, 0, 0], [0, 2.0, 0]]).tobytes() + np.array([[0, 0, 0.1], [0, 0, 0]]).tobytes()


def deck(cards, end=0.02, counts="forces: 1;", drivers="", node2=FREE):
    return RUN.format(cards=cards, end=end, counts=counts, drivers=drivers, node2=node2)


def force(options="", points="1, offset, .1,0.,0., 2", count=2, address='socket, create, yes, path, "s"'):
    return deck(f"force: 5, external structural, {address}, {options} {count}, {points};")


class Run:
    """`mbcosim run` of a deck in a folder of its own; `peer` connects to, or accepts from, its sockets."""

    def __init__(self, folder, text, *options):
        self.folder = str(folder)
        with open(os.path.join(self.folder, "deck"), "w") as file:
            file.write(text)
        self.process = subprocess.Popen([os.path.join(BIN, "mbcosim"), "run", "deck", "-o", "out", *options], cwd=self.folder,
                                        stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def connect(self, name="s"):
        """Peer of a Unix socket (name) or a TCP port on which the run listens."""
        end = time.monotonic() + 20 * TIME_FACTOR
        while True:
            if isinstance(name, str):
                peer, address = socket.socket(socket.AF_UNIX), os.path.join(self.folder, name)
            else:
                peer, address = socket.socket(), ("127.0.0.1", name)
            try:
                peer.connect(address)
                peer.settimeout(20 * TIME_FACTOR)
                return peer
            except OSError:
                peer.close()
                if time.monotonic() > end:
                    raise
                time.sleep(0.02)

    def finish(self):
        _, self.errors = self.process.communicate(timeout=60 * TIME_FACTOR)
        return self.process.returncode

    def rows(self, extension="mov"):
        with open(os.path.join(self.folder, "out." + extension)) as file:
            return [line.split() for line in file]

    def last(self, node):
        """x, R, v, w of the last record."""
        row = [float(x) for x in [r for r in self.rows() if r[0] == str(node)][-1][1:]]
        return row[:3], row[3:12], row[12:15], row[15:18]


@pytest.fixture
def run(tmp_path):
    runs = []

    def start(text, *options):
        runs.append(Run(tmp_path, text, *options))
        return runs[-1]

    yield start
    for each in runs:
        if each.process.poll() is None:
            each.process.kill()
        each.process.communicate()


def receive(peer, size):
    data = b""
    while len(data) < size:
        more = peer.recv(size - len(data))
        if not more:
            raise EOFError(f"closed after {len(data)} of {size} bytes")
        data += more
    return data


def shake(peer, flags, count):
    peer.sendall(b"\7" + struct.pack("<II", flags, count))
    assert receive(peer, 1) == b"\10"


def talk(peer, size, answers):
    """Answers messages of `size` bytes after the command until the run ends; returns [(command, data)]."""
    messages = []
    while True:
        command = receive(peer, 1)[0]
        if command == 5:
            assert peer.recv(1) == b""
            return messages
        messages.append((command, receive(peer, size)))
        answer = answers(len(messages))
        if answer:
            peer.sendall(answer)


def send_what_is_taken(peer, data):
    """The other side may close before all of it is sent."""
    try:
        peer.sendall(data)
    except (BrokenPipeError, ConnectionResetError):
        pass


def flood(peer, data):
    """Sends `data` again and again until the other side closes."""
    def send():
        try:
            while True:
                peer.sendall(data)
        except OSError:
            pass

    thread = threading.Thread(target=send)
    thread.start()
    return thread


# ------------------------------------------------------------------ sequences

def test_loose_sequence(run):
    done = run(force())
    peer = done.connect()
    shake(peer, 0x202, 2)
    messages = talk(peer, 288, lambda _: b"\6" + LOADS)
    assert [command for command, _ in messages] == [6, 6, 6]
    assert messages[0][1][:8].hex() == "87b09979817ff13f"
    assert done.finish() == 0, done.errors


def test_a_coupled_run_in_real_time_lasts_as_long_as_the_model(run):
    text = deck('force: 5, external structural, socket, create, yes, path, "s", 1, 1, offset, .1,0.,0.;', end=0.4)
    done = run(text, "--real-time")
    peer = done.connect()
    shake(peer, 0x202, 1)
    begun = time.monotonic()
    assert len(talk(peer, 144, lambda _: b"\6" + bytes(48))) > 40
    assert time.monotonic() - begun > 0.38
    assert done.finish() == 0, done.errors


def test_a_socket_that_a_killed_run_has_left_is_replaced_and_one_in_use_is_not(run, tmp_path):
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(tmp_path / "s"))
        other.listen()
        other.settimeout(0.5)
        refused = run(force())
        assert refused.finish() == 5 and "another server listens on s" in refused.errors
        with pytest.raises(TimeoutError):
            other.accept()  # whoever listens is not disturbed
    done = run(force())
    peer = done.connect()
    shake(peer, 0x202, 2)
    talk(peer, 288, lambda _: b"\6" + LOADS)
    assert done.finish() == 0, done.errors
    (tmp_path / "s").write_text("mine")
    refused = run(force())
    assert refused.finish() == 5 and "s exists and is not a socket" in refused.errors and (tmp_path / "s").read_text() == "mine"


@pytest.mark.parametrize("ignored", [False, True], ids=["terminal", "nohup"])
def test_a_terminal_that_closes_ends_a_run_in_good_order(run, tmp_path, ignored):
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN if ignored else signal.SIG_DFL)
    try:
        done = run(force(), "--peer-timeout", "3")
    finally:
        signal.signal(signal.SIGHUP, before)
    with done.connect():
        done.process.send_signal(signal.SIGHUP)
        assert done.finish() == (5 if ignored else 130), done.errors  # 5: nobody answered
    assert not (tmp_path / "s").exists()


def test_loose_numbers(run):
    done = run(deck('force: 5, external structural, socket, create, yes, path, "s", 2, 1, offset, .1,0.,0., 2;', end=0.03))
    peer = done.connect()
    shake(peer, 0x202, 2)
    talk(peer, 288, lambda _: b"\6" + LOADS)
    assert done.finish() == 0
    x, _, v, w = done.last(1)
    assert (x[0], v[0], w[2]) == pytest.approx((1.00345000023, 0.130000010, 1.00201902417), abs=2e-10)
    x, _, v, _ = done.last(2)
    assert (x[1], v[1]) == pytest.approx((-0.9990999995, 0.06000002), abs=2e-10)


def test_tight_sequence_and_numbers(run):
    done = run(deck('force: 5, external structural, socket, create, yes, path, "s", coupling, tight, 2, 1, offset, .1,0.,0., 2;', end=0.03))
    peer = done.connect()
    shake(peer, 0x202, 2)
    messages = talk(peer, 288, lambda k: (b"\6" if k % 3 == 0 else b"\2") + LOADS)
    assert [command for command, _ in messages] == [2] * 9
    first = np.frombuffer(messages[0][1])
    assert first[:6] == pytest.approx([1.09431, 2.03423, 2.98707, 2, -1, 1.5], abs=6e-6)
    assert first[15:24] == pytest.approx([1, 0, 0, 0, 0.99995, 0.00999975, 0, -0.00999975, 0.99995], abs=6e-7)
    assert done.finish() == 0
    x, _, v, w = done.last(1)
    assert (x[0], v[0], w[2]) == pytest.approx((1.00330648148, 0.122777778, 1.00152286258), abs=6e-10)
    x, _, v, _ = done.last(2)
    assert (x[1], v[1]) == pytest.approx((-0.999387037, 0.0455555556), abs=6e-10)


class Counted:
    """A socket that counts its bytes."""

    def __init__(self, peer):
        self.peer, self.sent, self.received = peer, 0, 0

    def sendall(self, data):
        self.peer.sendall(data)
        self.sent += len(data)

    def recv(self, size):
        data = self.peer.recv(size)
        self.received += len(data)
        return data


@pytest.mark.parametrize("options,answers,received,sent", [("", lambda _: b"\6" + LOADS, 869, 300),
                                                           ("coupling, tight,", lambda k: (b"\6" if k % 3 == 0 else b"\2") + LOADS, 1736, 591)])
def test_bytes_of_a_whole_run(run, options, answers, received, sent):
    done = run(force(options))
    peer = Counted(done.connect())
    shake(peer, 0x202, 2)
    talk(peer, 288, answers)
    assert done.finish() == 0, done.errors
    assert (peer.received, peer.sent) == (received, sent)


def test_tight_code_that_ends_a_step_without_data(run):
    done = run(force("coupling, tight,"))
    peer = done.connect()
    shake(peer, 0x202, 2)
    messages = talk(peer, 288, lambda k: b"\4" if k % 3 == 0 else b"\2" + LOADS)
    assert [command for command, _ in messages] == [2] * 6
    assert done.finish() == 0


@pytest.mark.parametrize("options", ["coupling, staggered,", "coupling, loose, send after predict, no,"])
def test_staggered_sequence(run, options):
    done = run(force(options))
    peer = done.connect()
    shake(peer, 0x202, 2)
    messages = talk(peer, 288, lambda _: b"\2" + LOADS)
    assert [command for command, _ in messages] == [6] * 4
    assert messages[0][1] == messages[1][1]  # the derivatives phase moves nothing
    assert done.finish() == 0


def test_every_second_iteration(run):
    done = run(force("coupling, 2,"))
    peer = done.connect()
    shake(peer, 0x202, 2)
    messages = talk(peer, 288, lambda k: (b"\6" if k % 2 == 0 else b"\2") + LOADS)
    assert [command for command, _ in messages] == [2] * 4
    assert done.finish() == 0


def test_coupling_none_only_sends(run):
    done = run(force("coupling, none,"))
    peer = done.connect()
    shake(peer, 0x202, 2)
    assert len(talk(peer, 288, lambda _: b"")) == 4
    assert done.finish() == 0


def test_loose_code_may_keep_its_loads(run):
    done = run(force())
    peer = done.connect()
    shake(peer, 0x202, 2)
    assert len(talk(peer, 288, lambda k: b"\6" + LOADS if k == 1 else b"\4")) == 3
    assert done.finish() == 0
    assert done.last(1)[2][0] == pytest.approx(0.12, abs=1e-7)  # 0.1 + 1 N · 0.02 s / 1 kg


def test_a_code_that_asks_for_the_end(run):
    done = run(force())
    peer = done.connect()
    shake(peer, 0x202, 2)
    messages = talk(peer, 288, lambda k: b"\6" + LOADS if k < 2 else b"\5")
    assert len(messages) == 2
    assert done.finish() == 5
    assert "force 5: the peer ended the run at t = 0.01 s" in done.errors
    assert len(done.rows()) == 4  # two nodes: start and the step that was under way


# ------------------------------------------------------------------ forms of messages

ROTATIONS = {"orientation, none,": (0x000, 0), "orientation, orientation vector,": (0x100, 3), "": (0x200, 9),
             "orientation, euler 123,": (0x400, 3)}


@pytest.mark.parametrize("accelerations", [False, True])
@pytest.mark.parametrize("labels", [False, True])
@pytest.mark.parametrize("rotation", ROTATIONS)
def test_all_forms_without_reference_node(run, rotation, labels, accelerations):
    flag, size = ROTATIONS[rotation]
    vectors = 2 + (1 if size else 0) + (0 if not accelerations else 2 if size else 1)
    done = run(force(("labels, yes," if labels else "") + rotation + ("accelerations, yes," if accelerations else "")))
    peer = done.connect()
    shake(peer, 0x2 | flag | (0x10 if labels else 0) | (8 if accelerations else 0), 2)
    head = struct.pack("<II", 1, 2) if labels else b""
    loads = head + (LOADS if size else LOADS[:48])
    messages = talk(peer, len(head) + 2 * 8 * (3 * vectors + size), lambda _: b"\6" + loads)
    assert done.finish() == 0, done.errors
    data = messages[0][1]
    assert data[:len(head)] == head
    numbers = np.frombuffer(data[len(head):])
    assert numbers[:6] == pytest.approx([1.09362933616, 2.0312992, 2.9840655, 2, -1, 1.5], abs=1e-6)
    R = np.array([[0.936293, 0.312992, -0.159345], [-0.289629, 0.944702, 0.153792], [0.198669, -0.0978434, 0.97517]]).T
    if flag == 0x200:
        assert numbers[6:15].reshape(3, 3).T == pytest.approx(R, abs=1e-6)
    if flag == 0x400:
        assert numbers[6:12] == pytest.approx(np.degrees([0.1, 0.2, 0.3, 0, 0, 0]), abs=1e-12)
    if flag == 0x100:
        angle = np.linalg.norm(numbers[6:9])
        assert 1 + 2 * np.cos(angle) == pytest.approx(np.trace(R), abs=3e-6)
        assert R @ numbers[6:9] == pytest.approx(numbers[6:9], abs=1e-6)
    v = numbers[6 + 2 * size:12 + 2 * size]
    assert v == pytest.approx([0.0687008, 0.293629, 0.3, 0, 0, 0], abs=1e-6)
    assert done.last(1)[2][0] == pytest.approx(0.12, abs=1e-6)


def test_reference_node(run):
    done = run(deck('force: 5, external structural, socket, create, yes, path, "s", reference node, 2, accelerations, yes, '
                    "use reference node forces, no, 1, 1, offset, .1,0.,0.;", end=0.01, node2=TURNED))
    peer = done.connect()
    shake(peer, 0x220E, 1)
    one = np.array([1.0, 2, 3]).tobytes() + bytes(24)
    messages = talk(peer, 384, lambda _: b"\6" + bytes(48) + one)
    assert done.finish() == 0, done.errors
    reference, point = np.frombuffer(messages[0][1][:192]), np.frombuffer(messages[0][1][192:])
    assert reference[:3] == pytest.approx([2, -1, 1.5]) and reference[12:18] == pytest.approx([0.5, 0.6, 0.7, 1, 2, 3])
    assert point[:3] == pytest.approx([-1.43819, 3.13781, 0.546341], abs=6e-6)
    assert point[12:15] == pytest.approx([6.87457, 3.48100, -3.96673], abs=6e-6)
    assert point[15:18] == pytest.approx([-0.255679, -2.39496, -1.78851], abs=6e-6)
    assert point[18:21] == pytest.approx([19.5898, -17.7922, 17.0593], abs=1e-4)
    assert point[21:24] == pytest.approx([-1.94055, 0.790283, -0.780836], abs=6e-6)  # in the reference's frame, unlike MBDyn's


def rotation_of(numbers, flag):
    """Matrix of the rotation in one of the forms of the messages."""
    if flag == 0x200:
        return numbers.reshape(3, 3).T
    if flag == 0x400:
        a, b, c = np.radians(numbers)
        Rx = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
        Ry = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
        Rz = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
        return Rx @ Ry @ Rz
    angle = np.linalg.norm(numbers)
    k = np.array([[0, -numbers[2], numbers[1]], [numbers[2], 0, -numbers[0]], [-numbers[1], numbers[0], 0]])
    return np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle ** 2 * k @ k


def reference_deck(options, end=0.02):
    return deck(f'force: 5, external structural, socket, create, yes, path, "s", reference node, 2, {options} 1, 1, offset, .1,0.,0.;', end=end,
                node2=TURNED)


@pytest.mark.parametrize("labels", [False, True])
@pytest.mark.parametrize("rotation", ROTATIONS)
def test_forms_with_a_reference_node(run, rotation, labels):
    """Place, rotation and velocities of the reference node, then of the point in its frame; a force in that frame turns with it."""
    flag, size = ROTATIONS[rotation]
    done = run(reference_deck(("labels, yes," if labels else "") + rotation))
    peer = done.connect()
    shake(peer, 0x6 | flag | (0x10 if labels else 0), 1)
    half = 8 * ((9 + size) if size else 6)
    heads = [struct.pack("<II", 2, 0), struct.pack("<II", 1, 0)] if labels else [b"", b""]
    moment = bytes(24) if size else b""
    f = np.array([1.0, 2, 3])
    answer = heads[0] + f.tobytes() + moment + heads[1] + f.tobytes() + moment
    messages = talk(peer, 2 * half + len(heads[0] + heads[1]), lambda _: b"\6" + answer)
    assert done.finish() == 0, done.errors
    data, n = messages[0][1], len(heads[0])
    assert (data[:n], data[n + half:n + half + n]) == tuple(heads)
    reference, point = np.frombuffer(data[n:n + half]), np.frombuffer(data[n + half + n:])
    R2 = rotation_of(np.array([0.2, 0.3, -0.1]) * 180 / np.pi, 0x400)
    R1 = rotation_of(np.array([0.1, 0.2, 0.3]) * 180 / np.pi, 0x400)
    assert reference[:3] == pytest.approx([2, -1, 1.5]) and reference[3 + size:6 + size] == pytest.approx([0.5, 0.6, 0.7])
    assert point[:3] == pytest.approx([-1.43819, 3.13781, 0.546341], abs=6e-6)
    assert point[3 + size:6 + size] == pytest.approx([6.87457, 3.48100, -3.96673], abs=6e-6)
    if size:
        assert rotation_of(reference[3:3 + size], flag) == pytest.approx(R2, abs=1e-9)
        assert rotation_of(point[3:3 + size], flag) == pytest.approx(R2.T @ R1, abs=1e-9)
        assert reference[6 + size:] == pytest.approx([1, 2, 3])
        assert point[6 + size:] == pytest.approx([-0.255679, -2.39496, -1.78851], abs=6e-6)
    assert np.array(done.last(1)[2]) == pytest.approx(np.array([0.1, 0.2, 0.3]) + 0.02 * R2 @ f, abs=3e-3)


def test_loads_on_the_reference_node_are_totals(run):
    """F1 = sum of the points' forces: nothing remains for the reference node itself."""
    done = run(deck('force: 5, external structural, socket, create, yes, path, "s", reference node, 2, 1, 1;', node2=FREE.replace("1.,0.,0.", "null")))
    peer = done.connect()
    shake(peer, 0x206, 1)
    f = np.array([3.0, 0, 0]).tobytes()
    talk(peer, 288, lambda _: b"\6" + f + bytes(24) + f + bytes(24))
    assert done.finish() == 0, done.errors
    assert done.last(1)[2][0] == pytest.approx(0.1 + 3 * 0.02, abs=1e-6)
    assert done.last(2)[2][0] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("flags", [0x112, 0x1112])
def test_odd_numbers_of_labels_are_padded_for_codes_that_do_not_use_the_library(run, flags):
    done = run(force("labels, yes, orientation, orientation vector,", points="1", count=1), "--padded-labels")
    peer = done.connect()
    shake(peer, flags, 1)
    head = struct.pack("<II", 1, 0)
    messages = talk(peer, len(head) + 96, lambda _: b"\6" + head + LOADS[:24] + bytes(24))
    assert done.finish() == 0, done.errors
    assert messages[0][1][:len(head)] == head and done.last(1)[2][0] == pytest.approx(0.12, abs=1e-6)


@pytest.mark.parametrize("node,flags", [("", 0x112), ("", 0x1112), ("reference node, 2,", 0x1116)])
def test_odd_numbers_of_labels_are_refused_to_codes_that_may_use_the_library(run, node, flags):
    """The library reads four bytes less than MBDyn sends, from the wrong place: with a reference node its flags tell that it is there."""
    done = run(force(node + "labels, yes, orientation, orientation vector,", points="1", count=1))
    peer = done.connect()
    peer.sendall(b"\7" + struct.pack("<II", flags, 1))
    assert receive(peer, 1) == b"\5" and peer.recv(1) == b""
    assert done.finish() == 5
    assert "force 5 (s): the peer does not fit: labels of an odd number of points: MBDyn's client library misreads them" in done.errors
    assert "say so with --padded-labels, or `padded_labels` in a daemon; else give the deck an even number of points or no labels" in done.errors


@pytest.mark.parametrize("accelerations", [False, True])
@pytest.mark.parametrize("flag, size", [(0x100, 3), (0x200, 9), (0x400, 3)])
def test_the_client_library_gets_the_rotation_of_a_reference_node_whose_points_have_none(run, flag, size, accelerations):
    done = run(reference_deck("orientation, none," + ("accelerations, yes," if accelerations else "")))
    peer = done.connect()
    shake(peer, 0x6 | flag << 4 | (8 if accelerations else 0), 1)
    sent = 8 * (9 + size) + 48 + (48 + 24 if accelerations else 0)
    f = np.array([0.0, 0, 0.6])
    messages = talk(peer, sent, lambda _: b"\6" + bytes(24) + f.tobytes() + bytes(24))
    assert done.finish() == 0, done.errors
    numbers = np.frombuffer(messages[0][1])
    R2 = rotation_of(np.array([0.2, 0.3, -0.1]) * 180 / np.pi, 0x400)
    assert numbers[:3] == pytest.approx([2, -1, 1.5])
    assert rotation_of(numbers[3:3 + size], flag) == pytest.approx(R2, abs=1e-9)
    assert numbers[3 + size:9 + size] == pytest.approx([0.5, 0.6, 0.7, 1, 2, 3])
    points = numbers[9 + size + (6 if accelerations else 0):]
    assert points[:6] == pytest.approx([-1.43819, 3.13781, 0.546341, 6.87457, 3.48100, -3.96673], abs=6e-6)
    spin = np.array(done.last(2)[3]) - [1, 2, 3]
    assert np.linalg.norm(spin) == pytest.approx(0.6 * 0.02, rel=1e-3)  # the moment acts on the reference node


def test_unsorted_labels_name_the_points(run):
    done = run(force("labels, yes, sorted, no, orientation, none,", points="1, label, 77, 2, label, 5"))
    peer = done.connect()
    shake(peer, 0x12, 2)
    swapped = struct.pack("<II", 5, 77) + LOADS[24:48] + LOADS[:24]
    talk(peer, 8 + 96, lambda _: b"\6" + swapped)
    assert done.finish() == 0, done.errors
    assert done.last(1)[2][0] == pytest.approx(0.12, abs=1e-6) and done.last(2)[2][1] == pytest.approx(0.04, abs=1e-6)


def test_the_run_connects_when_the_deck_says_so(run, tmp_path):
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(str(tmp_path / "p"))
    listener.listen(1)
    done = run(force(address='socket, path, "p"'))
    peer = listener.accept()[0]
    assert receive(peer, 10).hex() == "07" "02020000" "02000000" "08"
    assert len(talk(peer, 288, lambda _: b"\6" + LOADS)) == 3
    assert done.finish() == 0


def test_the_run_connects_over_tcp_when_the_deck_says_so(run):
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen(1)
        listener.settimeout(20 * TIME_FACTOR)
        done = run(force(address=f'socket, create, no, port, {listener.getsockname()[1]}, host, "localhost"'))
        peer = listener.accept()[0]
    peer.settimeout(20 * TIME_FACTOR)
    assert receive(peer, 10).hex() == "07" "02020000" "02000000" "08"
    assert len(talk(peer, 288, lambda _: b"\6" + LOADS)) == 3
    assert done.finish() == 0, done.errors


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def test_tcp_with_a_peer_that_splits_its_messages(run):
    port = free_port()
    done = run(force(address=f'socket, create, yes, port, {port}, host, "127.0.0.1"'))
    peer = done.connect(port)
    shake(peer, 0x202, 2)

    def answer(_):
        for byte in b"\6" + LOADS:
            peer.sendall(bytes([byte]))
        return b""

    assert len(talk(peer, 288, answer)) == 3
    assert done.finish() == 0


@pytest.mark.parametrize("options, text", [("", "1. 0. .5 0. .1 0. 99. 98."), ("labels, yes,", "2 1. 0. .5 0. .1 0."),
                                           ("send after predict, no,", "1. 0. .5 0. .1 0.")])
def test_a_file_that_stays_is_a_constant_load(run, tmp_path, options, text):
    """Numbers beyond those expected are ignored; labels stand in it with `labels, yes` only."""
    (tmp_path / "in.dat").write_text(text + "\n")
    done = run(deck(f'force: 5, external structural, "in.dat", "out.dat", sleep time, .01, {options} 1, 2, offset, .2,0.,0.;'))
    assert done.finish() == 0, done.errors
    assert done.last(2)[2] == pytest.approx([0.02, 0, 0.01], abs=1e-6)
    with open(tmp_path / "out.frc") as file:
        lines = [[float(word) for word in line.replace("@", " ").split()] for line in file]
    assert len(lines) == 3 and all(line == pytest.approx([5, 2, 1, 0, 0.5, 0, 0.1, 0]) for line in lines)


def test_a_file_in_tight_coupling_has_no_effect_at_the_start(run, tmp_path):
    (tmp_path / "in.dat").write_text("1. 0. .5 0. .1 0.\n")
    done = run(deck('force: 5, external structural, "in.dat", "out.dat", sleep time, .01, coupling, tight, 1, 2, offset, .2,0.,0.;'))
    assert done.finish() == 0, done.errors
    forces = [[float(number) for number in row[1:4]] for row in done.rows("frc")]
    assert forces == [[0, 0, 0], [1, 0, 0.5], [1, 0, 0.5]]


def test_a_file_without_its_labels_ends_the_run_with_what_is_expected(run, tmp_path):
    (tmp_path / "in.dat").write_text("1. 0. .5 0. .1 0.\n")
    done = run(deck('force: 5, external structural, "in.dat", "out.dat", sleep time, .01, labels, yes, 1, 2;'))
    assert done.finish() == 5
    assert '"in.dat" has 6 numbers, not 7: a label, a force and a moment for each point' in done.errors


@pytest.mark.parametrize("before,after,message", [("", "7. " * 100, ""), ("# a comment\n" * 50000, "", ""),
                                                  ("", "7. " * 400000, "6 numbers are expected, and no more than"),
                                                  ("#" * (1 << 21), "", "6 numbers are expected, and no more than")],
                         ids=["more numbers", "comments", "far too many numbers", "an endless line"])
def test_long_files(run, tmp_path, before, after, message):
    """What stands behind the numbers is not read, and comments have their place, up to a size that is no answer any more."""
    (tmp_path / "in.dat").write_text(before + "1. 0. .5 0. .1 0. " + after)
    done = run(deck('force: 5, external structural, "in.dat", "out.dat", sleep time, .01, 1, 2;'))
    assert done.finish() == (5 if message else 0), done.errors
    assert message in done.errors and ('force 5: "in.dat" is too long' in done.errors) == bool(message)


# ------------------------------------------------------------------ mapping

def test_mapping(run, tmp_path):
    """Two mapped points from two points: the mean, and the first one alone."""
    H = np.zeros((6, 6))
    H[:3, :3] = H[:3, 3:] = 0.5 * np.eye(3)
    H[3:, :3] = np.eye(3)
    np.savetxt(tmp_path / "H.dat", H)
    done = run(deck('force: 5, external structural mapping, socket, create, yes, path, "s", points number, 2, 1, offset, null, 2, offset, null, '
                    'mapped points number, from file, full mapping file, "H.dat";'))
    peer = done.connect()
    shake(peer, 0x2002, 2)
    messages = talk(peer, 96, lambda _: b"\6" + np.array([[2.0, 0, 0], [0, 0, 4.0]]).tobytes())
    assert done.finish() == 0, done.errors
    assert np.frombuffer(messages[0][1])[:6] == pytest.approx([1.5, 0.5, 2.25, 1, 2, 3])
    assert done.last(1)[2] == pytest.approx([0.12, 0.2, 0.38], abs=1e-6)
    assert done.last(2)[2] == pytest.approx([0.02, 0, 0], abs=1e-6)


def test_mapping_with_loads_on_the_reference_node(run):
    done = run(deck('force: 5, external structural mapping, socket, create, yes, path, "s", reference node, 2, points number, 1, 1, offset, null;'))
    peer = done.connect()
    shake(peer, 0x2006, 1)
    messages = talk(peer, 144 + 48, lambda _: b"\6" + np.array([0, 0, 4.0, 0, 0, 0, 0, 0, 0]).tobytes())
    assert done.finish() == 0, done.errors
    numbers = np.frombuffer(messages[0][1])
    R, v = numbers[3:12].reshape(3, 3).T, numbers[12:15]
    assert done.last(2)[2] == pytest.approx(v + 0.02 * R @ [0, 0, 4.0], abs=2e-3)


# ------------------------------------------------------------------ modal

def test_modal_mapping(run, tmp_path):
    """One mode, twice the path of node 1 along axis 1."""
    (tmp_path / "H.dat").write_text("1 1 2.\n")
    done = run(deck('force: 5, external modal mapping, socket, create, yes, path, "s", nodes number, 1, 1, modes number, 1, '
                    'sparse mapping file, "H.dat";'))
    peer = done.connect()
    shake(peer, 0x1, 1)
    messages = talk(peer, 16, lambda _: b"\6" + np.array([3.0]).tobytes())
    assert done.finish() == 0, done.errors
    assert np.frombuffer(messages[0][1]) == pytest.approx([0, 0.2])
    assert done.last(1)[2][0] == pytest.approx(0.1 + 0.02 * 6, abs=1e-6)


def test_rigid_motion_of_a_modal_element(run):
    done = run(deck('force: 5, external modal, socket, create, yes, path, "s", reference node, 1;'))
    peer = done.connect()
    shake(peer, 0x5, 0)
    messages = talk(peer, 144, lambda _: b"\6" + np.array([0, 0, 4.0, 0, 0, 0]).tobytes())
    assert [command for command, _ in messages] == [6, 6, 6]
    numbers = np.frombuffer(messages[0][1])
    assert numbers[:3] == pytest.approx([1, 2, 3]) and numbers[3:6] == pytest.approx([0.936293, 0.312992, -0.159345], abs=1e-6)
    assert numbers[12:] == pytest.approx([0.1, 0.2, 0.3, 0, 0, 1])
    assert done.finish() == 0, done.errors
    assert done.last(1)[2][2] == pytest.approx(0.38, abs=1e-6)


def modal_joint(run, folder, options, modes, coupling="", end="10.", joint="STATIC"):
    """A run of the tutorial's modal body with so many of its modes, and a code for it."""
    models = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "client_examples", "models")
    for name in ("modal_body_static.fem", "modal_body_dynamic.fem"):
        shutil.copy(os.path.join(models, name), folder)
    with open(os.path.join(models, "modal_body.mbd")) as file:
        text = file.read().replace("forces: 2;", "forces: 3;").replace("final time: 10.;", f"final time: {end};")
    card = f'    force: 5, external modal, socket, create, yes, path, "s", {coupling} {joint}, {options}'.rstrip(", ")
    assert text.count("end: elements;") == 1 and "forces: 3;" in text and "2, 3, " in text
    if modes == 1:
        text = text.replace("2, 3, ", "1, list, 1, 3, ", 1)
    return run(text.replace("end: elements;", card + ";\nend: elements;"))


MODAL = [("", 0x5, 144, 48, 1), ("type, modal,", 0x1, 0, 0, 1), ("type, rigid,", 0x5, 144, 48, 0)]


@pytest.mark.parametrize("modes", [1, 2])
@pytest.mark.parametrize("options,flags,sent,taken,travel", MODAL)
def test_modes_of_a_modal_joint(run, tmp_path, options, flags, sent, taken, travel, modes):
    """Of one mode: 160 bytes out and 56 in, 16 and 8, 144 and 48."""
    done = modal_joint(run, tmp_path, options, modes)
    peer = done.connect()
    shake(peer, flags, modes)
    messages = talk(peer, sent + 16 * modes * travel, lambda k: b"\6" + bytes(taken + 8 * modes * travel) if k < 5 else b"\5")
    assert len(messages) == 5 and all(command == 6 for command, _ in messages)
    assert done.finish() == 5 and "force 5: the peer ended the run" in done.errors


@pytest.mark.parametrize("options,flags", [row[:2] for row in MODAL])
def test_a_modal_peer_without_modes_is_refused(run, tmp_path, options, flags):
    done = modal_joint(run, tmp_path, options, 1)
    peer = done.connect()
    peer.sendall(b"\7" + struct.pack("<II", flags, 0))
    assert receive(peer, 1) == b"\5"
    assert done.finish() == 5 and "number of modes: the deck has 1, the peer 0" in done.errors


# ------------------------------------------------------------------ streams

def stream_out(options, values="values, 2, drive, time, drive, const, 7.", address='create, yes, path, "o"', end=0.05):
    return deck(f'stream output: 9, stream name, "out", {address}, {options} {values};', end=end, counts="output elements: 1;")


def drain(peer):
    data = b""
    while more := peer.recv(65536):
        data += more
    return data


@pytest.mark.parametrize("options,times", [("", [0, 1, 2, 3, 4, 5]), ("no send first, output every, 2,", [2, 4])])
def test_stream_output(run, options, times):
    done = run(stream_out(options))
    peer = done.connect("o")
    numbers = np.frombuffer(drain(peer)).reshape(-1, 2)
    assert done.finish() == 0, done.errors
    assert numbers[:, 0] == pytest.approx([0.01 * t for t in times], abs=1e-12) and np.all(numbers[:, 1] == 7)


def test_stream_output_in_datagrams(run):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sink:
        sink.bind(("127.0.0.1", 0))
        sink.settimeout(20 * TIME_FACTOR)
        done = run(stream_out("", address=f'create, no, port, {sink.getsockname()[1]}, host, "127.0.0.1", socket type, udp'))
        datagrams = [sink.recv(1000) for _ in range(6)]
    assert done.finish() == 0, done.errors
    assert np.array([np.frombuffer(each) for each in datagrams]) == pytest.approx(np.array([[0.01 * k, 7] for k in range(6)]), abs=1e-12)


@pytest.mark.parametrize("kind", ["unix", "tcp"])
def test_stream_output_to_a_sink_that_listens(run, tmp_path, kind):
    with socket.socket(socket.AF_UNIX if kind == "unix" else socket.AF_INET) as listener:
        listener.bind(str(tmp_path / "p") if kind == "unix" else ("127.0.0.1", 0))
        listener.listen(1)
        listener.settimeout(20 * TIME_FACTOR)
        where = 'path, "p"' if kind == "unix" else f'port, {listener.getsockname()[1]}, host, "localhost"'
        done = run(stream_out("", address=f"create, no, {where}"))
        sink = listener.accept()[0]
    assert np.frombuffer(drain(sink)).reshape(-1, 2)[:, 0] == pytest.approx([0.01 * k for k in range(6)], abs=1e-12)
    assert done.finish() == 0, done.errors


def test_stream_output_that_does_not_block_drops_whole_messages_of_a_sink_that_sleeps(run):
    done = run(stream_out("non blocking,", "values, 500, " + ", ".join(["drive, time"] * 500), end=10.0))
    sink = done.connect("o")
    assert done.finish() == 0, done.errors
    data = drain(sink)
    assert len(data) % 4000 == 0
    times = np.frombuffer(data).reshape(-1, 500)
    assert 1 < len(times) < 1001 and np.all(np.diff(times[:, 0]) > 0) and np.all(times == times[:, :1])
    assert "warning" not in done.errors


def test_stream_output_casts(run):
    done = run(stream_out("", "values, 4, drive, const, 0., drive, const, -3.7, drive, const, 300., drive, const, 2.5, "
                              "modifier, copy cast, swap, yes, double, int16_t, uint8_t, skip, 1, float, size, 20"))
    data = drain(done.connect("o"))
    assert done.finish() == 0, done.errors
    assert len(data) == 6 * 20
    assert data[:20].hex() == "0000000000000000" "fffd" "ff" "00" "40200000" "00000000"


def test_stream_output_of_floats(run):
    done = run(stream_out("", "values, 2, drive, const, 0., drive, const, -3.7, modifier, copy cast, swap, no, all, float"))
    assert drain(done.connect("o"))[:8].hex() == "00000000cdcc6cc0"
    assert done.finish() == 0


def test_stream_output_echo(run):
    done = run(stream_out('echo, "e.txt",'))
    drain(done.connect("o"))
    assert done.finish() == 0, done.errors
    with open(os.path.join(done.folder, "e.txt")) as file:
        lines = file.read().splitlines()
    assert lines[:2] == ["# generated by SocketStreamElem(9)", "# Channels #1-2"]
    assert lines[3] == "1.000000e-02 7.000000e+00" and len(lines) == 8


def test_motion_output(run):
    done = run(deck('stream motion output: 9, stream name, "out", create, yes, path, "o", '
                    "output flags, position, orientation matrix, velocity, angular velocity, 1, 2;", counts="output elements: 1;"))
    data = np.frombuffer(drain(done.connect("o"))).reshape(3, 2, 18)
    assert done.finish() == 0, done.errors
    assert data[0, 0, :3] == pytest.approx([1, 2, 3]) and data[0, 0, 3:6] == pytest.approx([0.936293, -0.289629, 0.198669], abs=1e-6)
    assert data[2, 1, 15:] == pytest.approx([1, 0, 0])


@pytest.mark.parametrize("flags,size,first", [
    ("", 3, [1, 2, 3]), ("output flags, orientation matrix,", 9, [0.936293, -0.289629, 0.198669]),
    ("output flags, orientation matrix transpose,", 9, [0.936293, 0.312992, -0.159345]),
    ("output flags, orientation matrix, orientation matrix transpose, velocity,", 21, [0.936293, -0.289629, 0.198669])])
@pytest.mark.parametrize("nodes", ["all", "1, 2"])
def test_motion_output_of_all_nodes_and_of_transposed_matrices(run, nodes, flags, size, first):
    done = run(deck(f'stream motion output: 9, stream name, "out", create, yes, path, "o", {flags} {nodes};', counts="output elements: 1;"))
    data = np.frombuffer(drain(done.connect("o"))).reshape(3, 2, size)
    assert done.finish() == 0, done.errors
    assert data[0, 0, :3] == pytest.approx(first, abs=1e-6)
    if size == 21:
        assert np.all(data[:, :, :9].reshape(3, 2, 3, 3) == data[:, :, 9:18].reshape(3, 2, 3, 3).transpose(0, 1, 3, 2))
        assert data[0, 0, 18:] == pytest.approx([0.1, 0.2, 0.3])


def test_a_broken_output_lets_the_run_go_on_or_ends_it(run, tmp_path):
    for options, code, goes_on in [("", 0, True), ("abort if broken,", 5, False)]:
        text = deck(f'stream output: 9, stream name, "out", create, yes, path, "o", {options} values, 1, drive, time;', end=10.0,
                    counts="output elements: 1;")
        done = run(text)
        done.connect("o").close()
        assert done.finish() == code, done.errors
        assert "closed by the peer" in done.errors
        assert (len(done.rows()) >= 2002) == goes_on


def stream_in(options, every="", address='create, yes, path, "i"', modifier=""):
    drivers = f'begin: drivers; file: 1, stream, stream drive name, "in", {address}, {every} {options} 1, initial values, 100.{modifier}; end: drivers;'
    return deck('force: 5, absolute, 1, position, null, 1.,0.,0., file, 1, 1;\nstream output: 9, stream name, "out", create, yes, path, "o", '
                "values, 1, drive, file, 1, 1;", end=0.05, counts="forces: 1; file drivers: 1; output elements: 1;", drivers=drivers)


@pytest.mark.parametrize("every,options,expected", [("", "", [1, 2, 3, 4, 5, 6]), ("", "receive first, no,", [100, 1, 2, 3, 4, 5]),
                                                    ("input every, 2,", "", [1, 1, 2, 2, 3, 3]),
                                                    ("input every, 2,", "receive first, no,", [100, 100, 1, 1, 2, 2])])
def test_which_record_sees_which_message(run, every, options, expected):
    done = run(stream_in(options, every))
    source, sink = done.connect("i"), done.connect("o")
    source.sendall(np.arange(1.0, 7).tobytes())
    assert list(np.frombuffer(drain(sink))) == expected
    assert done.finish() == 0, done.errors


@pytest.mark.parametrize("modifier,layout", [("all, float", "<f"), ("swap, yes, int16_t", ">h"), ("skip, 2, uint8_t, size, 5", "<xxBxx"),
                                             ("swap, detect, skip, 1, double", ">xd"), ("swap, no, int32_t, skip, 3", "<ixxx")])
def test_messages_of_a_stream_driver_in_other_layouts(run, modifier, layout):
    done = run(stream_in("", modifier=f", modifier, copy cast, {modifier}"))
    source, sink = done.connect("i"), done.connect("o")
    source.sendall(b"".join(struct.pack(layout, k) for k in range(1, 7)))
    assert list(np.frombuffer(drain(sink))) == [1, 2, 3, 4, 5, 6]
    assert done.finish() == 0, done.errors


def test_a_stream_driver_keeps_in_a_file_what_differs_from_the_message_before(run, tmp_path):
    done = run(stream_in('echo, "e.txt", precision, 3, shift, 1.,'))
    source, sink = done.connect("i"), done.connect("o")
    source.sendall(np.array([1.0, 1, 2, 2, 2, 3]).tobytes())
    drain(sink)
    assert done.finish() == 0, done.errors
    with open(tmp_path / "e.txt") as file:
        text = file.read().splitlines()
    assert text[:3] == ["# generated by SocketStreamDrive(1)", "# Time, Channel #1", "1.000e+00 1.000e+00"]
    assert [float(line.split()[1]) for line in text[2:]] == [1, 2, 3]


def test_the_time_out_of_a_stream_driver_is_its_own(run):
    done = run(stream_in("timeout, .5,"))
    source, sink = done.connect("i"), done.connect("o")
    source.sendall(np.array([1.0, 2.0]).tobytes())
    start = time.monotonic()
    assert list(np.frombuffer(drain(sink))) == [1, 2]
    assert done.finish() == 5
    assert time.monotonic() - start < 10 * TIME_FACTOR and 'error: stream drive "in" (i): silent for 0.5 s' in done.errors
    source.close()


ENDS = ["create", "connect"]


def source_and_run(run, end):
    """A source at either end of the file driver's socket, and the run."""
    if end == "create":
        done = run(stream_in(""))
        return done.connect("i"), done
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    listener.listen(1)
    listener.settimeout(20 * TIME_FACTOR)
    done = run(stream_in("", address=f'create, no, port, {listener.getsockname()[1]}, host, "localhost"'))
    connected = []
    accepting = threading.Thread(target=lambda: connected.append(listener.accept()[0]))
    accepting.start()
    return (accepting, connected), done


def both(run, end):
    """Source, sink and run. The run connects before it accepts."""
    source, done = source_and_run(run, end)
    sink = done.connect("o")
    if end == "connect":
        accepting, connected = source
        accepting.join(60 * TIME_FACTOR)
        source = connected[0]
    return source, sink, done


@pytest.mark.parametrize("end", ENDS)
def test_of_a_message_that_is_too_long_the_rest_is_the_next(run, end):
    """A stream has no lengths: 8 bytes are a message, however they come."""
    source, sink, done = both(run, end)
    source.sendall(np.arange(1.0, 1000.0).tobytes() + b"abc")
    assert list(np.frombuffer(drain(sink))) == [1, 2, 3, 4, 5, 6]
    assert done.finish() == 0, done.errors


@pytest.mark.parametrize("end", ENDS)
def test_a_flood_of_values_ends_with_the_run(run, end):
    source, sink, done = both(run, end)
    thread = flood(source, np.full(10000, 3.0).tobytes())
    assert list(np.frombuffer(drain(sink))) == [3] * 6
    assert done.finish() == 0, done.errors
    thread.join(60 * TIME_FACTOR)
    assert not thread.is_alive()


@pytest.mark.parametrize("end", ENDS)
def test_messages_out_of_step_are_named_when_they_are_no_numbers(run, end):
    source, sink, done = both(run, end)
    source.sendall(np.array([1.0]).tobytes() + b"\xff" * 4096)
    drain(sink)
    assert done.finish() == 5
    assert 'error: stream drive "in" (' in done.errors and "value 1 is not finite" in done.errors


def test_what_a_sink_sends_is_not_read(run):
    done = run(stream_out(""))
    thread = flood(done.connect("o"), bytes(100000))
    assert done.finish() == 0, done.errors
    thread.join(60 * TIME_FACTOR)
    assert not thread.is_alive()


def test_last_values_stay_when_the_source_closes(run):
    done = run(stream_in(""))
    source, sink = done.connect("i"), done.connect("o")
    source.sendall(np.array([1.0, 2.0]).tobytes())
    source.close()
    assert list(np.frombuffer(drain(sink))) == [1, 2, 2, 2, 2, 2]
    assert done.finish() == 0
    assert "the last values stay" in done.errors


def test_inputs_that_do_not_block(run):
    done = run(stream_in("", every="non blocking,"))
    source, sink = done.connect("i"), done.connect("o")
    assert list(np.frombuffer(drain(sink))) == [100] * 6
    source.close()
    assert done.finish() == 0


@pytest.mark.parametrize("cut", [1, 7])
def test_of_a_message_in_part_an_input_that_does_not_block_waits_for_the_rest(run, cut):
    """A code is asked once in each step, after the input was read, so that it is known what has come before the next."""
    text = stream_in("", every="non blocking,").replace("forces: 1;", "forces: 2;")
    done = run(text.replace("stream output: 9", 'force: 6, external structural, socket, create, yes, path, "s", 1, 2;\n'
                            "stream output: 9"), "--peer-timeout", str(30 * TIME_FACTOR))
    source, code, sink = done.connect("i"), done.connect("s"), done.connect("o")
    source.sendall(struct.pack("<d", 3.5)[:cut])
    shake(code, 0x202, 1)

    def answer(k):  # 1: the start; k: step k - 1
        if k == 4:
            source.sendall(struct.pack("<d", 3.5)[cut:] + struct.pack("<d", 4.5)[:cut])
        return b"\6" + bytes(48)

    start = time.monotonic()
    talk(code, 144, answer)
    assert list(np.frombuffer(drain(sink))) == [100, 100, 100, 100, 3.5, 3.5]
    assert time.monotonic() - start < 20 * TIME_FACTOR
    source.close()
    assert done.finish() == 0, done.errors


def test_a_source_that_closes_in_mid_message_leaves_the_last_values(run):
    done = run(stream_in("", every="non blocking,"))
    source = done.connect("i")
    source.sendall(struct.pack("<d", 3.5)[:3])
    source.close()
    assert list(np.frombuffer(drain(done.connect("o")))) == [100] * 6
    assert done.finish() == 0
    assert "closed by the peer after 3 of 8 bytes of a message; the last values stay" in done.errors


def test_the_log_has_a_line_for_each_stream(run):
    done = run(stream_in("", every="input every, 2,"))
    source, sink = done.connect("i"), done.connect("o")
    source.sendall(np.arange(1.0, 7).tobytes())
    drain(sink)
    assert done.finish() == 0, done.errors
    lines = [" ".join(row) for row in done.rows("log")]
    assert "filedriver: 1 stream UNIX in i tcp 1 1 0 2 1 0 1 100" in lines
    assert "outputelement: 9 stream UNIX out o tcp 1 1 1 1 0 1 values 1" in lines


def test_streams_over_tcp_of_both_ends(run, tmp_path):
    port = free_port()
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.bind(("127.0.0.1", port))
    listener.listen(1)
    done = run(stream_in("", address=f'create, no, port, {port}, host, "localhost"'))
    sink_thread = []
    thread = threading.Thread(target=lambda: sink_thread.append(drain(done.connect("o"))))
    thread.start()
    source = listener.accept()[0]
    source.sendall(np.arange(1.0, 7).tobytes())
    thread.join(60 * TIME_FACTOR)
    assert list(np.frombuffer(sink_thread[0])) == [1, 2, 3, 4, 5, 6]
    assert done.finish() == 0, done.errors


# ------------------------------------------------------------------ files

def test_files(run, tmp_path):
    done = run(force(address='"in.txt", unlink, "out.txt", no clobber', options="sleep time, .01, precision, 12,"))
    states = []
    for _ in range(3):
        end = time.monotonic() + 20 * TIME_FACTOR
        while not (tmp_path / "out.txt").exists():
            assert time.monotonic() < end and done.process.poll() is None, done.finish()
            time.sleep(0.005)
        states.append((tmp_path / "out.txt").read_text())
        (tmp_path / "in.tmp").write_text("1. 0. 0. 0. 0. .1\n0. 2. 0. 0. 0. 0.\n")
        (tmp_path / "in.tmp").rename(tmp_path / "in.txt")
        (tmp_path / "out.txt").unlink()
    assert done.finish() == 0, done.errors
    lines = states[0].splitlines()
    assert lines[0] == "# regular nodes" and len(lines) == 3
    first = [float(x) for x in lines[1].split()]
    assert len(first) == 18 and first[:3] == pytest.approx([1.09362933616, 2.0312992, 2.9840655], abs=1e-6)
    assert first[3:6] == pytest.approx([0.936293, -0.289629, 0.198669], abs=1e-6)
    assert done.last(1)[2][0] == pytest.approx(0.12, abs=1e-6)


# ------------------------------------------------------------------ peers that misbehave

@pytest.mark.parametrize("request_bytes,message", [
    (b"\7" + struct.pack("<II", 0x101, 3), "kind (1 modal, 2 nodal): the deck has 0x2, the peer 0x1; rotations (0x100 vector, 0x200 matrix, "
     "0x400 Euler angles): the deck has 0x200, the peer 0x100; number of points: the deck has 2, the peer 3"),
    (b"\2", "the peer must begin with 7 (negotiation), it sent 2")])
def test_peers_that_do_not_fit_are_refused(run, request_bytes, message):
    done = run(force())
    peer = done.connect()
    peer.sendall(request_bytes)
    assert receive(peer, 1) == b"\5"
    assert done.finish() == 5
    assert "error: force 5 (s): " in done.errors and message in done.errors


NAN = np.full(12, np.nan).tobytes()


@pytest.mark.parametrize("answer,message", [(b"\3", "unknown command 3 from the peer"), (b"\6" + NAN, "a load is not finite"),
                                            (b"\6" + LOADS[:40], "closed by the peer after 40 of 96 bytes of a message"),
                                            (b"", "closed by the peer")])
def test_peers_that_break_the_dialogue_are_named(run, answer, message):
    done = run(force())
    peer = done.connect()
    shake(peer, 0x202, 2)
    for k in range(3):
        assert receive(peer, 1) == b"\6"
        receive(peer, 288)
        peer.sendall(b"\6" + LOADS if k < 2 else answer)
    peer.close()
    assert done.finish() == 5
    assert f"error: force 5 (s): {message}" in done.errors
    assert len(done.rows()) == 4  # results up to the step before


@pytest.mark.parametrize("surplus", [1, 100, 1 << 20])
def test_answers_longer_than_the_deck_has_points_are_named_at_the_next_exchange(run, surplus):
    """The protocol has no lengths: what is too much stands where the next command should."""
    done = run(force())
    peer = done.connect()
    shake(peer, 0x202, 2)
    receive(peer, 1 + 288)
    send_what_is_taken(peer, b"\6" + LOADS + bytes(surplus))
    assert done.finish() == 5
    assert "error: force 5 (s): unknown command 0 from the peer" in done.errors
    assert len(done.rows()) == 2  # the exchange of the derivatives was in order


@pytest.mark.parametrize("size", [8, 1 << 20])
def test_oversized_requests_are_refused_also_when_the_peer_has_gone(run, size):
    done = run(force())
    with done.connect() as peer:
        send_what_is_taken(peer, b"\7" + b"\xff" * size)
    assert done.finish() == 5
    assert "error: force 5 (s): the peer does not fit: " in done.errors and "the deck has 2, the peer 4294967295" in done.errors


@pytest.mark.parametrize("what,code,message", [("answers", 0, ""), ("zeros", 5, "unknown command 0 from the peer")])
def test_a_flood_of_answers_ends_with_the_run(run, what, code, message):
    done = run(force())
    peer = done.connect()
    shake(peer, 0x202, 2)
    thread = flood(peer, (b"\6" + LOADS) * 1000 if what == "answers" else bytes(100000))
    assert done.finish() == code and message in done.errors
    thread.join(60 * TIME_FACTOR)
    assert not thread.is_alive()
    assert code != 0 or len(done.rows()) == 6


def test_a_wrong_label_is_named(run):
    done = run(force("labels, yes, orientation, none,"))
    peer = done.connect()
    shake(peer, 0x12, 2)
    receive(peer, 1 + 8 + 96)
    peer.sendall(b"\6" + struct.pack("<II", 1, 9) + LOADS[:48])
    assert done.finish() == 5
    assert "force 5 (s): label 9 of point 2 is not 2" in done.errors


@pytest.mark.parametrize("when", ["never connects", "never shakes hands", "stops in mid-message"])
def test_silent_peers_cost_no_more_than_the_time_out(run, when):
    done = run(force(), "--peer-timeout", "0.5")
    if when != "never connects":
        peer = done.connect()
        if when == "stops in mid-message":
            shake(peer, 0x202, 2)
            peer.sendall(b"\6" + LOADS[:17])
    start = time.monotonic()
    assert done.finish() == 5
    assert time.monotonic() - start < 5 * TIME_FACTOR
    assert ("nobody connected in time" if when == "never connects" else "silent for 0.5 s") in done.errors


def test_a_missing_server_costs_no_more_than_the_time_out(run):
    done = run(force(address='socket, path, "nobody"'), "--peer-timeout", "0.5")
    assert done.finish() == 5
    assert "force 5 (nobody): cannot connect: No such file or directory" in done.errors


def test_a_taken_path_is_refused(run, tmp_path):
    (tmp_path / "s").write_text("")
    done = run(force())
    assert done.finish() == 5
    assert "cannot listen: s exists and is not a socket" in done.errors


def test_interrupts_end_a_wait(run):
    done = run(force())
    with done.connect():  # who has left is lost, and may be missed before the signal comes
        done.process.send_signal(2)
        start = time.monotonic()
        assert done.finish() == 130
    assert time.monotonic() - start < 5 * TIME_FACTOR


def test_no_deck_sockets_opens_nothing(run, tmp_path):
    done = run(force(), "--no-deck-sockets")
    assert done.finish() == 0
    assert not (tmp_path / "s").exists()
    assert done.last(1)[2] == pytest.approx([0.1, 0.2, 0.3])


def test_validate_and_describe_open_nothing(tmp_path):
    (tmp_path / "deck").write_text(force())
    for command in ("validate", "describe"):
        subprocess.run([os.path.join(BIN, "mbcosim"), command, "deck"], cwd=tmp_path, check=True, capture_output=True, timeout=20 * TIME_FACTOR)
    assert os.listdir(tmp_path) == ["deck"]
