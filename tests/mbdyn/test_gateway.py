"""`mbcosim peer socket`: codes that speak MBDyn's protocols at the ports of a daemon's simulation."""
import os
import signal
import struct
import sys
import threading

import numpy as np
import pytest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "service"))
sys.path.insert(0, os.path.join(HERE, "..", "fmi"))
from conftest import MODELS, TIME_FACTOR, start_daemon, wait_for  # noqa: E402,F401
from test_peer import connect, program, receive  # noqa: E402,F401
from test_sockets import TURNED, deck, shake  # noqa: E402

import mbcosim  # noqa: E402

STEPS = 5
TWO = deck("", counts="", end=1.0, node2=TURNED)


@pytest.fixture
def server(start_daemon):  # noqa: F811
    daemon = start_daemon()
    with daemon.connect() as connection:
        connection.address = daemon.address
        yield connection


class Gateway:
    """The program at a port, and its socket."""

    def __init__(self, program, server, simulation, port, path, *options):  # noqa: F811
        self.path = path
        self.program = program("socket", "--protocol", "mbdyn", "--listen", f"unix:{path}", "--address", server.address, "--simulation", simulation.name,
                               "--port", port, *options)


def stepped(simulation, work, outputs=()):
    """Results of a few steps while `work` speaks for the code."""
    results = []
    thread = threading.Thread(target=lambda: results.append(simulation.step(STEPS, outputs=list(outputs))))
    thread.start()
    work()
    thread.join(60 * TIME_FACTOR)
    assert results and results[0].outcome == "ACCEPTED"
    return results[0].values


def speak(code, size, answer, tight=False):
    """Answers until the other side ends; `answer(numbers)`: loads. In tight mode of each step three times. Returns the messages."""
    messages, k = [], 0
    while True:
        command = code.recv(1)
        if command in (b"\5", b""):  # the end, or a gateway that has failed
            return messages
        data = receive(code, size)
        messages.append((command, data))
        k += 1
        code.sendall((b"\2" if tight and k % 3 else b"\6") + answer(data))


NODES = [f"node.structural.{k}.{what}" for k in (1, 2) for what in ("X", "XP", "Omega")]


def values_of(simulation):
    return np.concatenate([np.ravel(simulation[name]) for name in NODES])


def pull(x, v):
    return -3.0 * x - 0.5 * v


@pytest.mark.parametrize("labels", [False, True])
@pytest.mark.parametrize("form, flag, size", [("vector", 0x100, 3), ("matrix", 0x200, 9), ("euler123", 0x400, 3), ("none", 0, 0)])
@pytest.mark.parametrize("mode", ["loose", "staggered", "tight"])
def test_a_code_gives_the_numbers_of_a_python_peer(server, program, tmp_path, mode, form, flag, size, labels):  # noqa: F811
    """Forces linear in positions and velocities; moments half of the rotations' numbers in vector form, else zero."""
    ports, tight, head = [mbcosim.structural_port("p", nodes=[1, 2])], mode == "tight", struct.pack("<II", 1, 2) if labels else b""

    def answer(data):
        assert data[:len(head)] == head
        numbers = np.frombuffer(data[len(head):])
        x, v = numbers[:6], numbers[6 + 2 * size:12 + 2 * size]
        moments = 0.5 * numbers[6:12] if form == "vector" else np.zeros(6)
        return head + pull(x, v).tobytes() + (moments.tobytes() if size else b"")

    def in_python(motion):
        moments = 0.5 * motion.rotations if form == "vector" else np.zeros((2, 3))
        return pull(motion.x, motion.v), moments

    with server.load_text(TWO, ports=ports) as alone, alone.couple("p", in_python, mode=mode, rotation="vector" if form == "vector" else "matrix"):
        assert alone.step(STEPS).outcome == "ACCEPTED"
        expected = values_of(alone)
    with server.load_text(TWO, ports=ports) as simulation:
        gateway = Gateway(program, server, simulation, "p", str(tmp_path / "s"), "--mode", mode, "--orientation", form, *(["--labels"] if labels else []))
        code = connect(gateway.path)
        shake(code, 0x2 | flag | (0x10 if labels else 0), 2)
        messages = []
        talking = threading.Thread(target=lambda: messages.extend(
            speak(code, len(head) + 8 * 2 * (6 + size + (3 if size else 0)), answer, tight)))
        talking.start()
        assert simulation.step(STEPS).outcome == "ACCEPTED"
        assert values_of(simulation) == pytest.approx(expected, abs=1e-9 if tight else 1e-12)
    talking.join(60 * TIME_FACTOR)
    assert len(messages) >= STEPS and gateway.program.finish() == 0


def test_unsorted_labels_name_the_points(server, program, tmp_path):  # noqa: F811
    text = deck('force: 5, external structural, grpc, port, "p", 2, 1, label, 77, 2, label, 5;', end=1.0)
    loads = {77: [1.0, 0, 0], 5: [0, 2.0, 0]}

    def answer(data):
        assert data[:8] == struct.pack("<II", 1, 2)
        return struct.pack("<II", 5, 77) + np.array([loads[5], loads[77]]).tobytes()

    with server.load_text(text) as simulation, server.load_text(text) as alone:
        with alone.couple("p", lambda motion: np.array([loads[77], loads[5]])):
            alone.step(STEPS)
        gateway = Gateway(program, server, simulation, "p", str(tmp_path / "s"), "--orientation", "none", "--labels", "--unsorted")
        code = connect(gateway.path)
        shake(code, 0x12, 2)
        threading.Thread(target=speak, args=(code, 8 + 96, answer), daemon=True).start()
        assert simulation.step(STEPS).outcome == "ACCEPTED"
        assert values_of(simulation) == pytest.approx(values_of(alone), abs=1e-12)
    assert gateway.program.finish() == 0


def test_a_label_of_no_point_is_named(server, program, tmp_path):  # noqa: F811
    with server.load_text(TWO, ports=[mbcosim.structural_port("p", nodes=[1, 2])]) as simulation:
        gateway = Gateway(program, server, simulation, "p", str(tmp_path / "s"), "--orientation", "none", "--labels", "--unsorted")
        code = connect(gateway.path)
        shake(code, 0x12, 2)
        threading.Thread(target=speak, args=(code, 8 + 96, lambda _: struct.pack("<II", 1, 9) + bytes(48)), daemon=True).start()
        with pytest.raises(mbcosim.StepFailed, match="label 9 of point 2 belongs to no point"):
            simulation.step()
        assert gateway.program.finish() == 5 and "label 9" in gateway.program.errors


MODAL_PORT = 'force: 5, external modal, grpc, port, "m", DYNAMIC{};'


@pytest.mark.parametrize("mode", ["loose", "staggered", "tight"])
@pytest.mark.parametrize("options, rigid", [("", True), (", type, modal", False)])
def test_a_code_moves_modes_as_a_python_peer_does(server, program, tmp_path, options, rigid, mode):  # noqa: F811
    with open(os.path.join(MODELS, "modal_body.mbd")) as file:
        text = file.read().replace("forces: 2;", "forces: 3;").replace("end: elements;", MODAL_PORT.format(options) + "\nend: elements;")
    files = {name: open(os.path.join(MODELS, name), "rb").read() for name in ("modal_body_static.fem", "modal_body_dynamic.fem")}
    files["deck"] = text.encode()
    push, force, moment, tight = np.array([0.02, -0.01]), np.array([0.1, 0.2, 0.3]), np.array([0.03, 0.02, 0.01]), mode == "tight"
    loads = (np.concatenate([force, moment]) if rigid else np.zeros(0)).tobytes() + push.tobytes()

    def in_python(motion):
        return mbcosim.Loads(forces=force, moments=moment, signals=push) if rigid else push

    names = [f"node.structural.{k}.X" for k in (21, 22)]
    with server.load_bundle("deck", files) as alone, alone.couple("m", in_python, mode=mode):
        alone.step(STEPS)
        expected = np.concatenate([alone[name] for name in names])
    with server.load_bundle("deck", files) as simulation:
        gateway = Gateway(program, server, simulation, "m", str(tmp_path / "s"), "--mode", mode)
        code = connect(gateway.path)
        shake(code, 0x5 if rigid else 0x1, 2)
        threading.Thread(target=speak, args=(code, (144 if rigid else 0) + 32, lambda _: loads, tight), daemon=True).start()
        assert simulation.step(STEPS).outcome == "ACCEPTED"
        assert np.concatenate([simulation[name] for name in names]) == pytest.approx(expected, abs=1e-12)
    assert gateway.program.finish() == 0


# ------------------------------------------------------------------ the end

def ready(program, server, simulation, path, *options):  # noqa: F811
    """A gateway at port "p" of one node without rotations, and its code."""
    gateway = Gateway(program, server, simulation, "p", path, "--orientation", "none", *options)
    code = connect(path)
    shake(code, 0x2, 1)
    wait_for(lambda: simulation.describe().ports[0].has_peer)
    return gateway, code


ONE = [mbcosim.structural_port("p", nodes=[1])]


@pytest.mark.parametrize("mode", ["loose", "staggered", "tight"])
@pytest.mark.parametrize("reset", [False, True])
def test_a_simulation_that_goes_back_ends_the_code(server, program, tmp_path, mode, reset):  # noqa: F811
    with server.load_text(TWO, ports=ONE) as simulation:
        gateway, code = ready(program, server, simulation, str(tmp_path / "s"), "--mode", mode)
        messages = []
        talking = threading.Thread(target=lambda: messages.extend(speak(code, 48, lambda _: bytes(24), mode == "tight")))
        talking.start()
        assert simulation.step(1).outcome == "ACCEPTED"
        snapshot = simulation.snapshot()
        assert simulation.step(STEPS).outcome == "ACCEPTED"
        simulation.reset() if reset else simulation.restore(snapshot)
        with pytest.raises(mbcosim.StepFailed, match="the simulation went back to t = .*the code cannot be told"):
            simulation.step()
        talking.join(60 * TIME_FACTOR)
        assert not talking.is_alive() and len(messages) > STEPS
        assert gateway.program.finish() == 5 and "the simulation went back to t = " in gateway.program.errors


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("asked", [False, True])
def test_at_a_signal_the_code_gets_the_end(server, program, tmp_path, sent, asked):  # noqa: F811
    """Between steps, and while an answer is awaited."""
    with server.load_text(TWO, ports=ONE) as simulation:
        gateway, code = ready(program, server, simulation, str(tmp_path / "s"), "--mode", "loose")
        failures = []

        def step():
            try:
                simulation.step()
            except mbcosim.StepFailed as failure:
                failures.append(failure)

        stepping = threading.Thread(target=step)
        if asked:
            stepping.start()
            assert receive(code, 1) == b"\6" and len(receive(code, 48)) == 48
        gateway.program.process.send_signal(sent)
        assert receive(code, 1) == b"\5" and code.recv(1) == b""
        code.close()
        assert gateway.program.finish() == 130
        if asked:
            stepping.join(60 * TIME_FACTOR)
            assert failures


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_at_a_signal_a_listener_removes_its_path(server, program, tmp_path, sent):  # noqa: F811
    with server.load_text(TWO, ports=ONE) as simulation:
        gateway = Gateway(program, server, simulation, "p", str(tmp_path / "s"))
        assert "waiting for a code" in gateway.program.first_line() and os.path.exists(gateway.path)
        gateway.program.process.send_signal(sent)
        assert gateway.program.finish() == 130
        assert not os.path.exists(gateway.path)


def test_a_lost_daemon_is_told_and_ends_the_code(start_daemon, program, tmp_path):  # noqa: F811
    daemon = start_daemon()
    connection = daemon.connect()
    connection.address = daemon.address
    simulation = connection.load_text(TWO, ports=ONE)
    gateway, code = ready(program, connection, simulation, str(tmp_path / "s"))
    daemon.kill()
    assert receive(code, 1) == b"\5"
    code.close()
    assert gateway.program.finish() == 5
    assert "the connection to the simulation is lost: " in gateway.program.errors


# ------------------------------------------------------------------ streams

SIGNALS = mbcosim.signal_port("signals", outputs=["node.structural.1.XP"], inputs=["stream.force", "node.structural.2.load"])
CART = os.path.join(MODELS, "pendulum_cart.mbd")


def answer_of(speed):
    return np.array([-2.0 * speed[0] + 1.0, 0, 0.5, 0, 0, 0, 0])


@pytest.mark.parametrize("links", [1, 2])
def test_streams_carry_the_signals_of_a_port(server, program, tmp_path, links):  # noqa: F811
    """Speed out, forces in, over one link or two: the numbers of a Python peer."""
    watched = ["node.structural.1.XP", "node.structural.2.X"]
    with server.load(CART, ports=[SIGNALS]) as alone, alone.couple("signals", lambda motion: answer_of(motion.signals), mode="loose"):
        for _ in range(STEPS):
            expected = alone.step(1, outputs=watched).values
    with server.load(CART, ports=[SIGNALS]) as simulation:
        second = ["--inputs-listen", f"unix:{tmp_path / 'i'}"] if links == 2 else []
        gateway = Gateway(program, server, simulation, "signals", str(tmp_path / "o"), "--mode", "loose", *second)
        sink = connect(gateway.path)
        source = connect(str(tmp_path / "i")) if links == 2 else sink

        def code():
            for _ in range(STEPS):
                source.sendall(answer_of(np.frombuffer(receive(sink, 24))).tobytes())

        found = stepped(simulation, code, watched)
        for name in watched:
            assert found[name] == pytest.approx(expected[name], abs=1e-12)
    assert gateway.program.finish() == 0


def test_a_stream_input_of_the_deck_is_a_port_of_inputs_alone(server, program, tmp_path):  # noqa: F811
    text = deck("force: 1, absolute, 1, position, null, 1.,0.,0., file, 1, 1;", end=1.0, counts="forces: 1; file drivers: 1;",
                drivers='begin: drivers; file: 1, stream, stream drive name, "in", create, yes, path, "x", 1; end: drivers;')
    with server.load_text(text) as simulation:
        gateway = Gateway(program, server, simulation, "in", str(tmp_path / "s"))
        source = connect(gateway.path)
        wait_for(lambda: simulation.describe().ports[0].has_peer)  # without one the stream would hold its values
        source.sendall(np.full(STEPS, 3.0).tobytes())
        simulation.step(STEPS)
        assert simulation["stream.in"] == pytest.approx(3.0) and simulation["node.structural.1.XP"][0] == pytest.approx(0.1 + 0.03 * STEPS, rel=0.3)
    assert gateway.program.finish() == 0


@pytest.mark.parametrize("data, message", [(np.array([np.nan] * 7).tobytes(), "value 1 is not finite"), (b"\0" * 30, "closed by the peer after 30 of 56 bytes"),
                                           (None, "silent for 1 s")])
def test_streams_that_break_fail_the_step_and_are_named(server, program, tmp_path, data, message):  # noqa: F811
    with server.load(CART, ports=[SIGNALS]) as simulation:
        gateway = Gateway(program, server, simulation, "signals", str(tmp_path / "s"), "--mode", "loose", "--peer-timeout", "1")
        code = connect(gateway.path)
        if data is not None:
            code.sendall(data)
            if len(data) < 56:
                code.shutdown(1)
        with pytest.raises(mbcosim.StepFailed, match=message):
            simulation.step()
        assert gateway.program.finish() == 5 and message in gateway.program.errors


def test_streams_know_no_iterations(server, program, tmp_path):  # noqa: F811
    with server.load(CART, ports=[SIGNALS]) as simulation:
        gateway = Gateway(program, server, simulation, "signals", str(tmp_path / "s"), "--mode", "tight")
        connect(gateway.path)
        assert gateway.program.finish() == 4
        assert "streams know no iterations" in gateway.program.errors


def test_inputs_of_their_own_link_are_those_of_a_signal_port(server, program, tmp_path):  # noqa: F811
    with server.load_text(deck('force: 5, external structural, grpc, port, "p", 1, 1;', end=1.0)) as simulation:
        second = str(tmp_path / "i")
        gateway = Gateway(program, server, simulation, "p", str(tmp_path / "s"), "--inputs-listen", f"unix:{second}")
        with connect(gateway.path), connect(second):
            assert gateway.program.finish() == 4
        assert 'inputs of their own link are those of a signal port; "p" is none' in gateway.program.errors
