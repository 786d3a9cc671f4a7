"""`mbcosim peer socket` at ports with a reference node and at mapped ports: a code has the numbers there that it has with `mbcosim run`."""
import struct
import threading

import numpy as np
import pytest

from test_gateway import STEPS, TIME_FACTOR, Gateway, program, server, start_daemon  # noqa: F401
from test_peer import connect
from test_sockets import ROTATIONS, TURNED, deck, receive, run, shake  # noqa: F401

import mbcosim

PORT = "external5"  # of the card when a daemon has the deck


class Code:
    """Answers with loads that are linear in all that it is told; the points' labels, if any, follow those of the reference node."""

    def __init__(self, size, labels=False, accelerations=False, tight=False, ignored=0):
        """`ignored`: messages at the beginning that are answered with zeros. In a tight step four messages are asked for."""
        self.size, self.accelerations, self.tight, self.ignored = size, accelerations, tight, ignored
        self.heads = [struct.pack("<II", 2, 0), struct.pack("<II", 1, 1)] if labels else [b"", b""]
        self.messages = []

    def bytes_of(self, points):
        vectors = (3 if self.size else 2) + (0 if not self.accelerations else 2 if self.size else 1)
        return 8 * points * (3 * vectors + self.size)

    def loads(self, data, points):
        """Forces, then moments where there are rotations."""
        numbers, fields, at = np.frombuffer(data), [], 0
        for width in [3] + ([self.size] if self.size else []) + [3] * (self.bytes_of(1) // 24 - 1 - self.size // 3):
            fields.append(numbers[at:at + width * points].reshape(points, width))
            at += width * points
        x, v = fields[0], fields[2 if self.size else 1]
        f = -0.3 * x - 0.5 * v
        if self.accelerations:
            f = f - 0.01 * fields[4 if self.size else 2]
        if not self.size:
            return f.tobytes()
        m = 0.01 * fields[1][:, :3] - 0.02 * fields[3]
        if self.accelerations:
            m = m - 0.001 * fields[5]
        return f.tobytes() + m.tobytes()

    def answer(self, data):
        n, half = len(self.heads[0]), self.bytes_of(1)
        assert (data[:n], data[n + half:2 * n + half]) == tuple(self.heads)
        answers = [self.loads(data[n:n + half], 1), self.loads(data[2 * n + half:], 2)]
        if len(self.messages) <= self.ignored:
            answers = [bytes(len(answer)) for answer in answers]
        return self.heads[0] + answers[0] + self.heads[1] + answers[1]

    def talk(self, peer):
        size = self.bytes_of(1) + self.bytes_of(2) + len(self.heads[0] + self.heads[1])
        while True:
            if peer.recv(1) in (b"\5", b""):
                return
            self.messages.append(receive(peer, size))
            last = not self.tight or len(self.messages) % 4 == 0
            peer.sendall((b"\6" if last and self.tight else b"\2") + self.answer(self.messages[-1]))


FORMS = {0: "none", 0x100: "vector", 0x200: "matrix", 0x400: "euler123"}
LOCKED = ("2.,-1.,1.5, eye, .5,.6,.7, null", "joint: 1, total pin joint, 2, orientation constraint, active, active, active, null;", "joints: 1; forces: 1;")
FREE = (TURNED, "", "forces: 1;")
NAMES = [f"node.structural.{k}.{what}" for k in (1, 2) for what in ("X", "R", "XP", "Omega")]


def reference_deck(options, node, joint, counts):
    return deck(joint + f'force: 5, external structural, socket, create, yes, path, "s", {options} 2, 1, offset, .1,0.,0., 1;', end=0.01 * STEPS, node2=node,
                counts=counts)


def with_run(run, text, flags, code, count=2):  # noqa: F811
    """The last state of both nodes."""
    done = run(text)
    peer = done.connect()
    shake(peer, flags, count)
    code.talk(peer)
    assert done.finish() == 0, done.errors
    return np.concatenate([np.concatenate(done.last(node)) for node in (1, 2)])


def with_gateway(server, program, path, text, flags, code, *options, count=2):  # noqa: F811
    with server.load_text(text) as simulation:
        gateway = Gateway(program, server, simulation, PORT, path, *options)
        peer = connect(gateway.path)
        shake(peer, flags, count)
        talking = threading.Thread(target=code.talk, args=(peer,))
        talking.start()
        assert simulation.step(STEPS).steps_done == STEPS
        state = np.concatenate([np.ravel(simulation[name]) for name in NAMES])
    talking.join(60 * TIME_FACTOR)
    assert gateway.program.finish() == 0
    return state


@pytest.mark.parametrize("more", [False, True], ids=["plain", "labels and accelerations"])
@pytest.mark.parametrize("rotation", ROTATIONS)
@pytest.mark.parametrize("mode", ["loose", "staggered"])
@pytest.mark.parametrize("node", [LOCKED, FREE], ids=["locked", "turning"])
def test_explicit_codes_have_the_numbers_of_a_run(run, server, program, tmp_path, node, mode, rotation, more):  # noqa: F811
    """Bit for bit. The first message of a run belongs to its derivatives phase, in which a daemon asks nobody."""
    flag, size = ROTATIONS[rotation]
    text = reference_deck("coupling, staggered, reference node, 2," + ("labels, yes," if more else "") + rotation + ("accelerations, yes," if more else ""), *node)
    flags = 0x6 | flag | (0x18 if more else 0)
    alone, code = Code(size, more, more, ignored=1), Code(size, more, more)
    expected = with_run(run, text, flags, alone)
    found = with_gateway(server, program, str(tmp_path / "g"), text, flags, code, "--mode", mode, "--orientation", FORMS[flag],
                         *(["--labels", "--accelerations"] if more else []))
    assert len(code.messages) >= STEPS and alone.messages[1:STEPS + 1] == code.messages[:STEPS]
    assert np.array_equal(found, expected)


@pytest.mark.parametrize("more", [False, True], ids=["plain", "labels and accelerations"])
@pytest.mark.parametrize("rotation", ROTATIONS)
def test_tight_codes_have_the_numbers_of_a_run(run, server, program, tmp_path, rotation, more):  # noqa: F811
    """To the tolerance of a daemon's interface, 1e-6 of the loads: what changes less is not applied. The first step's messages are the same bits."""
    flag, size = ROTATIONS[rotation]
    text = reference_deck("coupling, tight, reference node, 2," + ("labels, yes," if more else "") + rotation + ("accelerations, yes," if more else ""), *FREE)
    flags = 0x6 | flag | (0x18 if more else 0)
    alone, code = Code(size, more, more, tight=True), Code(size, more, more, tight=True)
    expected = with_run(run, text, flags, alone)
    found = with_gateway(server, program, str(tmp_path / "g"), text, flags, code, "--mode", "tight", "--orientation", FORMS[flag],
                         *(["--labels", "--accelerations"] if more else []))
    assert len(alone.messages) == len(code.messages) == 4 * STEPS and alone.messages[:4] == code.messages[:4]
    assert found == pytest.approx(expected, abs=1e-6)


def test_loads_on_the_reference_node_in_the_global_frame(run, server, program, tmp_path):  # noqa: F811
    text = reference_deck("coupling, tight, reference node, 2, use reference node forces, yes, rotate reference node forces, no,", *FREE)
    expected = with_run(run, text, 0x206, Code(9, tight=True))
    options = ["--mode", "tight"]
    found = with_gateway(server, program, str(tmp_path / "g"), text, 0x206, Code(9, tight=True), *options, "--global-reference-loads")
    assert found == pytest.approx(expected, abs=1e-6)
    turned = with_gateway(server, program, str(tmp_path / "h"), text, 0x206, Code(9, tight=True), *options)
    assert np.abs(turned - expected).max() > 1e-3


@pytest.mark.parametrize("label", [2, 0])
def test_an_attached_port_with_a_reference_node(server, program, tmp_path, label):  # noqa: F811
    """Its points are told relative to the node, which takes no loads."""
    code = Code(9)
    code.loads = lambda data, points: np.tile([0.0, 0, 3.0], points).tobytes() + bytes(24 * points)
    text = deck("", counts="", end=1.0, node2=TURNED).replace("structural: 2,", f"structural: {label},").replace("body: 2, 2,", f"body: 2, {label},")
    ports = [mbcosim.structural_port("p", nodes=[1, 1], offsets=[[.1, 0, 0], [0, 0, 0]], reference=label)]
    with server.load_text(text, ports=ports) as simulation:
        before = simulation[f"node.structural.{label}.XP"]
        gateway = Gateway(program, server, simulation, "p", str(tmp_path / "s"))
        peer = connect(gateway.path)
        shake(peer, 0x2206, 2)
        threading.Thread(target=code.talk, args=(peer,), daemon=True).start()
        simulation.step(STEPS)
        assert simulation[f"node.structural.{label}.XP"] == pytest.approx(before, abs=1e-12)
        assert np.linalg.norm(simulation["node.structural.1.XP"]) > 0.25
    reference, points = np.frombuffer(code.messages[0][:144]), np.frombuffer(code.messages[0][144:])
    assert reference[:3] == pytest.approx([2, -1, 1.5]) and reference[12:] == pytest.approx([0.5, 0.6, 0.7, 1, 2, 3])
    assert points[:3] == pytest.approx([-1.43819, 3.13781, 0.546341], abs=6e-6)
    assert gateway.program.finish() == 0


@pytest.mark.parametrize("flags, message", [(0x202, "reference node: the deck has 0x4, the peer 0x0"), (0x106, "rotations"), (0x20E, "accelerations"),
                                            (0x216, "labels")])
def test_a_code_of_another_form_is_told_what_does_not_fit(server, program, tmp_path, flags, message):  # noqa: F811
    with server.load_text(reference_deck("reference node, 2,", *FREE)) as simulation:
        gateway = Gateway(program, server, simulation, PORT, str(tmp_path / "s"))
        peer = connect(gateway.path)
        peer.sendall(b"\7" + struct.pack("<II", flags, 2))
        assert receive(peer, 1) == b"\5"
        assert gateway.program.finish() == 5 and "the peer does not fit: " + message in gateway.program.errors


# ------------------------------------------------------------------ mapped ports

class MappedCode(Code):
    """Two mapped points, without rotations; the reference node always has one."""

    def answer(self, data):
        r, points = np.frombuffer(data[:144]), np.frombuffer(data[144:])
        answer = np.concatenate([-0.3 * r[:3] - 0.5 * r[12:15], -0.02 * r[15:18], -0.3 * points[:6] - 0.5 * points[6:12]])
        return bytes(answer.nbytes) if len(self.messages) <= self.ignored else answer.tobytes()

    def talk(self, peer):
        while peer.recv(1) not in (b"\5", b""):
            self.messages.append(receive(peer, 144 + 96))
            peer.sendall(b"\2" + self.answer(self.messages[-1]))


def mapped_deck(options="reference node, 2,"):
    node, joint, counts = LOCKED
    return deck(joint + f'force: 5, external structural mapping, socket, create, yes, path, "s", coupling, staggered, {options} points number, 2, '
                '1, offset, .1,0.,0., 1, offset, null;', end=0.01 * STEPS, node2=node, counts=counts)


def test_mapped_points_have_the_numbers_of_a_run(run, server, program, tmp_path):  # noqa: F811
    alone, code = MappedCode(9, ignored=1), MappedCode(9)
    expected = with_run(run, mapped_deck(), 0x2006, alone)
    found = with_gateway(server, program, str(tmp_path / "g"), mapped_deck(), 0x2006, code)
    assert alone.messages[1:STEPS + 1] == code.messages[:STEPS] and np.array_equal(found, expected)


def test_the_matrix_of_a_mapping_tells_the_number_of_points(server, program, tmp_path):  # noqa: F811
    """Three points see the mean of two; their forces come back by the transpose."""
    rows = ["0.5 0 0 0.5 0 0", "0 0.5 0 0 0.5 0", "0 0 0.5 0 0 0.5"]
    card = ('force: 5, external structural mapping, grpc, port, "p", points number, 2, 1, offset, null, 2, offset, null, '
            'mapped points number, from file, full mapping file, "H.dat";')
    files = {"deck": deck(card, end=1.0).encode(), "H.dat": "\n".join(rows).encode() + b"\n"}
    with server.load_bundle("deck", files) as simulation:
        middle = (simulation["node.structural.1.X"] + simulation["node.structural.2.X"]) / 2
        gateway = Gateway(program, server, simulation, "p", str(tmp_path / "s"))
        peer = connect(gateway.path)
        shake(peer, 0x2, 1)
        seen = []

        def answer():
            assert receive(peer, 1) == b"\6"
            seen.append(np.frombuffer(receive(peer, 48)))
            peer.sendall(b"\6" + np.array([2.0, 0, 4.0]).tobytes())

        talking = threading.Thread(target=answer)
        talking.start()
        simulation.step()
        talking.join(60 * TIME_FACTOR)
        assert seen[0][:3] == pytest.approx(middle)
        assert simulation["port.p.loads"] == pytest.approx([1, 0, 2, 0, 0, 0] * 2)
    assert gateway.program.finish() == 0


MAPPED = 'force: 5, external structural mapping, grpc, port, "p", {} points number, 1, 1, offset, null;'


@pytest.mark.parametrize("card, options, message", [
    (MAPPED.format(""), ["--labels"], 'port "p": mapped points have no labels'),
    (MAPPED.format("reference node, 2,"), ["--orientation", "none"], 'port "p": the reference node of mapped points has an orientation')])
def test_options_that_mapped_points_do_not_have(server, program, tmp_path, card, options, message):  # noqa: F811
    with server.load_text(deck(card, end=1.0)) as simulation:
        gateway = Gateway(program, server, simulation, "p", str(tmp_path / "s"), *options)
        with connect(gateway.path):
            assert gateway.program.finish() == 4 and message in gateway.program.errors


def test_no_code_of_mbdyn_imposes_motion(server, program, tmp_path):  # noqa: F811
    with server.load_text(deck("", counts="", end=1.0), ports=[mbcosim.motion_port("p", nodes=[1])]) as simulation:
        gateway = Gateway(program, server, simulation, "p", str(tmp_path / "s"))
        with connect(gateway.path):
            assert gateway.program.finish() == 4 and 'port "p" takes imposed motion' in gateway.program.errors
