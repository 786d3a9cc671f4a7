"""FMUs of which a daemon takes the steps: the bits of the FMU with the engine inside, and daemons that are gone, silent, or somebody else."""
import os
import random
import re
import signal
import socket
import subprocess
import sys
import threading

import pytest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "service"))
sys.path.insert(0, HERE)
from conftest import TIME_FACTOR, Daemon, start_daemon, stop  # noqa: E402,F401
from importer import DISCARD, ERROR, OK, Failed, instance_of  # noqa: E402
from test_fmu import BIN, MODELS, PORTS, STANDARDS, ending, exported, fails, positions, run_past_the_end, symbols  # noqa: E402,F401

INPUTS = ("--inputs", "stream.push,node.structural.1.load,node.parameter.*")


def door_of(running, monkeypatch):
    """Leads to the HTTP door of a daemon: its address, and the token in the environment."""
    running.http, token = re.match(r"(http://[^/]*)/\?token=(\S+)", running.page()).groups()
    monkeypatch.setenv("MBCOSIM_TOKEN", token)
    return running


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    running = Daemon(str(tmp_path_factory.mktemp("d")), "--http", "127.0.0.1:0")
    yield running
    running.stop()


@pytest.fixture
def daemon(shared, monkeypatch):
    """One for all tests that leave it alive; no simulation is left in it."""
    yield door_of(shared, monkeypatch)
    assert not simulations(shared)


@pytest.fixture
def mortal(start_daemon, monkeypatch):  # noqa: F811
    """A daemon of the test's own."""
    return door_of(start_daemon("--http", "127.0.0.1:0"), monkeypatch)


@pytest.fixture(scope="module")
def pushed(exported, tmp_path_factory):  # noqa: F811
    path = tmp_path_factory.mktemp("deck") / "pushed.mbd"
    path.write_text(PORTS)
    return lambda standard, *options: exported(str(path), standard, *INPUTS, *options)


def both(make, daemon, deck, standard, *options):
    """The FMU with the engine inside, and the one with the daemon."""
    return make(deck, standard, *options), make(deck, standard, "--remote", daemon.http, "--remote-timeout", str(20 * TIME_FACTOR), *options)


def simulations(daemon):
    with daemon.connect() as server:
        return server.list()


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("deck", ["pendulum", "three_pendulums", "cantilever_five", "actuated_beam"])
def test_tutorials_have_the_bits_of_the_engine_inside(exported, daemon, deck, standard):  # noqa: F811
    inside, remote = both(exported, daemon, deck, standard)
    start, _, step = inside.experiment()
    names = inside.names("output")
    with instance_of(inside) as here, instance_of(remote) as there:
        for instance in (here, there):
            instance.initialize()
        (found,) = simulations(daemon)
        assert found.display_name == "instance"
        assert here[names] == there[names]
        for k in range(20):
            for instance in (here, there):
                assert instance.do_step(start + k * step, step) == OK
            if k % 3 == 0:
                assert here[names] == there[names]
        assert here[names] == there[names]
        (found,) = simulations(daemon)
        assert found.step == 20
    assert not simulations(daemon)


def set_values(instance, values):
    """Values of inputs by the names that FMI 3 has."""
    for name, numbers in values.items():
        if instance.archive.version.startswith("3"):
            instance[name] = numbers
        else:
            for k, number in enumerate(numbers, 1):
                instance[f"{name}[{k}]"] = [number]


def inputs_of(rng):
    return {"stream.push": [rng.uniform(-1, 1) for _ in range(2)], "node.structural.1.load.force": [rng.uniform(-1, 1) for _ in range(3)],
            "node.structural.1.load.moment": [rng.uniform(-1, 1) for _ in range(3)]}


@pytest.mark.parametrize("standard", STANDARDS)
def test_random_lengths_inputs_and_states_have_the_bits_of_the_engine_inside(pushed, daemon, standard):
    rng, results = random.Random(5), []
    lengths = [rng.choice([0.01, 0.02, rng.uniform(0.001, 0.03)]) for _ in range(25)]
    values = [inputs_of(rng) for _ in lengths]
    for fmu in both(lambda _, *options: pushed(*options), daemon, "", standard):
        outputs = fmu.names("output")
        with instance_of(fmu) as instance:
            set_values(instance, {"stream.push": [0.3, 0.7]})
            instance.initialize()
            seen, now = [instance[outputs]], 0.0
            for k, length in enumerate(lengths):
                if k % 2:
                    set_values(instance, values[k])
                assert instance.do_step(now, length) == OK, instance.log
                now += length
                if k == 10:
                    state, time_then = instance.get_state(), now
                if k == 15:
                    seen.append(instance[outputs])
                    instance.set_state(state)
                    now = time_then
                if k == 20:
                    copy = instance.deserialize(instance.serialize(state))
                    instance.set_state(copy)
                    now = time_then
                    instance.free_state(copy)
                if k % 3 == 0:
                    seen.append(instance[outputs])
            instance.free_state(state)
            seen.append(instance[outputs])
        results.append(seen)
    assert results[0] == results[1] and results[0][0] != results[0][-1]


@pytest.mark.parametrize("standard", STANDARDS)
def test_states_go_as_bytes_from_instance_to_instance(pushed, daemon, standard):
    remote = both(lambda _, *options: pushed(*options), daemon, "", standard)[1]
    outputs = remote.names("output")
    with instance_of(remote) as one, instance_of(remote) as other:
        for instance in (one, other):
            instance.initialize()
        set_values(one, inputs_of(random.Random(7)))
        assert one.do_step(0.0, 0.033) == OK
        state = one.get_state()
        taken = other.deserialize(one.serialize(state))
        other.set_state(taken)
        assert other[outputs] == one[outputs]
        for instance in (one, other):
            assert instance.do_step(0.033, 0.02) == OK
        assert other[outputs] == one[outputs]
        other.free_state(taken)
        one.free_state(state)


@pytest.mark.parametrize("standard", STANDARDS)
def test_derivatives_after_steps_of_the_daemon_are_those_of_the_engine_inside(pushed, daemon, standard):
    results = []
    for fmu in both(lambda _, *options: pushed(*options), daemon, "", standard):
        names = ("node.structural.1.XPP", "node.structural.1.load.force")
        if standard == "2":
            names = tuple(name + "[1]" for name in names)
        with instance_of(fmu) as instance:
            instance.initialize()
            assert instance.do_step(0.0, 0.025) == OK
            results.append(instance.derivative([names[0]], [names[1]], [4.0] if standard == "2" else [4.0, 2.0, 1.0]))
            assert instance.do_step(0.025, 0.01) == OK
            results.append(instance[fmu.names("output")])
    assert results[:2] == results[2:]
    assert results[0][0] == pytest.approx(2.0, rel=1e-6)  # a mass of 2 kg


@pytest.mark.parametrize("standard", STANDARDS)
def test_parameters_and_symbols_that_are_set_reach_the_daemon(symbols, pushed, daemon, standard):  # noqa: F811
    seen = []
    for fmu in both(lambda _, *options: symbols(*options), daemon, "", standard):
        with instance_of(fmu) as instance:
            for name, value in {"L": 0.5, "HEAVY": False, "NOTE": b"other"}.items():
                assert instance.set_parameter("symbol." + name, value) == OK
            instance.initialize()
            assert instance.parameter("symbol.M") == 1.0  # the deck computes it from L
            seen.append(positions(instance))
            assert instance.call("Reset") == OK
            instance.initialize()
            seen.append(positions(instance))
    assert seen[:2] == seen[2:] and seen[0] != seen[1]
    with instance_of(both(lambda _, *options: pushed(*options), daemon, "", standard)[1]) as instance:
        instance.initialize()
        assert instance.do_step(0.0, 0.01) == OK
        (parameter,) = [name for name in instance.archive.names("input") if "parameter" in name]
        instance[parameter] = [5.5]
        assert instance.do_step(0.01, 0.01) == OK
        with daemon.connect() as server, server.attach(simulations(daemon)[0].name) as simulation:
            assert simulation["node.parameter.7.x"] == 5.5


@pytest.mark.parametrize("standard", STANDARDS)
def test_a_step_that_fails_is_discarded_and_can_be_repeated(pushed, daemon, standard):
    """The deck has a force that cannot be evaluated below x = -0.4."""
    seen = []
    for fmu in both(lambda _, *options: pushed(*options), daemon, "", standard):
        x = [name for name in fmu.names("output") if re.fullmatch(r"node\.structural\.1\.X(\[\d\])?", name)]
        with instance_of(fmu) as instance:
            instance.initialize()
            assert instance.do_step(0.0, 0.01) == OK
            state, before = instance.get_state(), instance[x]
            set_values(instance, {"stream.push": [0.0, -1e5]})
            assert instance.do_step(0.01, 0.02) == DISCARD
            if standard == "2":
                instance.set_state(state)
            assert instance[x] == before
            set_values(instance, {"stream.push": [0.0, 1.0]})
            assert instance.do_step(0.01, 0.02) == OK
            seen.append(instance[x])
            instance.free_state(state)
    assert seen[0] == seen[1]


@pytest.mark.parametrize("standard", STANDARDS)
def test_steps_and_stop_times_after_the_final_time_are_refused(pushed, daemon, standard):
    """The deck ends at 1 s."""
    remote = both(lambda _, *options: pushed(*options), daemon, "", standard)[1]
    with instance_of(remote) as instance:
        with pytest.raises(Failed):
            instance.initialize(stop=1.5)
        assert "the stop time 1.5 s lies after the deck's final time 1 s" in instance.log[-1][2]
        assert instance.call("Reset") == OK
        instance.initialize(stop=1.0)
        assert instance.do_step(0.0, 0.993) == OK
        assert instance.do_step(0.993, 0.007) == OK
        assert instance["time"] == [1.0]
        instance.must("Terminate")
    with instance_of(remote) as instance:
        instance.initialize()
        before = instance[remote.names("output")]
        assert instance.do_step(0.0, 1.01) == DISCARD
        assert "the daemon's simulation ends at the deck's final time" in instance.log[-1][2]
        if standard == "3":
            assert instance[remote.names("output")] == before
            assert instance.do_step(0.0, 0.01) == OK


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("length", [0.04, 0.12])
def test_a_deck_that_ends_the_run_has_the_bits_of_the_engine_inside(ending, daemon, standard, length):  # noqa: F811
    inside, remote = both(lambda _, *options: ending(*options), daemon, "", standard)
    assert run_past_the_end(remote, length) == run_past_the_end(inside, length)


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("how", ["killed", "stopped", "deleted", "stepped"])
def test_a_daemon_that_is_gone_is_an_error_in_time_and_a_message(exported, mortal, standard, how):  # noqa: F811
    remote = exported("pendulum", standard, "--remote", mortal.http, "--remote-timeout", str(5 * TIME_FACTOR))
    with instance_of(remote) as instance:
        instance.initialize()
        assert instance.do_step(0.0, 0.005) == OK
        instance[remote.names("output")]
        try:
            if how == "stopped":
                stop(mortal.process.pid)
            elif how == "killed":
                mortal.kill()
            else:
                with mortal.connect() as server, server.attach(simulations(mortal)[0].name) as simulation:
                    simulation.delete() if how == "deleted" else simulation.step()
            assert instance.do_step(0.005, 0.005) == ERROR
            assert "daemon" in instance.log[-1][2], instance.log
        finally:
            if how == "stopped":
                os.kill(mortal.process.pid, signal.SIGCONT)
        if how != "killed":
            assert instance.call("Reset") == OK
            instance.initialize()
            assert instance.do_step(0.0, 0.005) == OK


@pytest.mark.parametrize("standard", STANDARDS)
def test_values_after_the_last_step_are_an_error_when_the_daemon_has_gone(exported, mortal, standard):  # noqa: F811
    remote = exported("pendulum", standard, "--remote", mortal.http)
    with instance_of(remote) as instance:
        instance.initialize()
        assert instance.do_step(0.0, 0.005) == OK
        mortal.kill()
        assert "cannot be reached" in fails(instance, lambda: instance[remote.names("output")])


@pytest.mark.parametrize("standard", STANDARDS)
def test_a_daemon_that_is_not_there_is_an_error_and_a_message(exported, standard):  # noqa: F811
    with socket.socket() as nobody:  # bound, and does not listen
        nobody.bind(("127.0.0.1", 0))
        remote = exported("pendulum", standard, "--remote", f"http://127.0.0.1:{nobody.getsockname()[1]}")
        with instance_of(remote) as instance:
            with pytest.raises(Failed) as failed:
                instance.initialize()
            assert failed.value.status == ERROR
            assert instance.log[-1][0] == ERROR and "cannot be reached: Connection refused" in instance.log[-1][2]


@pytest.mark.parametrize("standard", STANDARDS)
def test_reset_connects_anew(exported, daemon, standard):  # noqa: F811
    remote = exported("pendulum", standard, "--remote", daemon.http)
    with instance_of(remote) as instance:
        results = []
        for _ in range(2):
            instance.initialize()
            assert instance.do_step(0.0, 0.05) == OK
            results.append(instance[remote.names("output")])
            instance.must("Reset")
            assert not simulations(daemon)
        assert results[0] == results[1]


def read_request(peer):
    """Until its end: what is not read would cut the answer."""
    received = b""
    while b"\r\n\r\n" not in received:
        piece = peer.recv(1 << 16)
        if not piece:
            return
        received += piece
    head, body = received.split(b"\r\n\r\n", 1)
    left = int(re.search(rb"content-length: *(\d+)", head.lower()).group(1)) - len(body)
    while left > 0:
        piece = peer.recv(min(left, 1 << 16))
        if not piece:
            return
        left -= len(piece)


@pytest.fixture
def answers():
    """answers(text): address of a server that gives this answer to whoever asks, and none when it is None."""
    listeners, over = [], threading.Event()

    def serve(listener, text):
        while True:
            try:
                peer = listener.accept()[0]
            except OSError:
                return
            with peer:
                try:
                    read_request(peer)
                    if text is None:
                        over.wait()
                    else:
                        peer.sendall(text)
                except OSError:
                    pass

    def start(text):
        listeners.append(socket.create_server(("127.0.0.1", 0)))
        threading.Thread(target=serve, args=(listeners[-1], text), daemon=True).start()
        return f"http://127.0.0.1:{listeners[-1].getsockname()[1]}"

    yield start
    over.set()
    for listener in listeners:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()


def http(body, status="200 OK"):
    return f"HTTP/1.1 {status}\r\nContent-Length: {len(body)}\r\n\r\n{body}".encode()


@pytest.mark.parametrize("text, message", [
    (None, "no answer within"), (b"", "it closes the connection"), (b"SSH-2.0-x\r\n", "its answer is no HTTP"),
    (b"\x15\x03\x01\x00\x02\x02\x46\r\n", "its answer is no HTTP"),  # TLS: an alert
    (b"HTTP/1.1 200 OK\r\nContent-Length: 99\r\n\r\n{}", "it closes the connection"),
    (b"HTTP/1.1 200 OK\r\nContent-Length: -9\r\n\r\n{}", "the length of its answer makes no sense"),
    (b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nxyz\r\n", "the length of its answer makes no sense"),
    (b"HTTP/1.1 200 OK\r\n" + b"A: b\r\n" * 300 + b"\r\n", "its answer is no HTTP"),
    (http("hello"), "is no daemon (HTTP status 200)"), (http("null"), "is no daemon (HTTP status 200)"),
    (http("[]", "500 No"), "is no daemon (HTTP status 500)"), (http("{}"), "is no daemon"), (http('{"simulation": 7}'), "is no daemon"),
    (http('{"code": 7, "message": {}}', "404 No"), "is no daemon"),
    (http('{"simulation": {"name": "simulations/1", "modelDigest": "0"}}'), "the daemon reads another model from the deck")])
def test_what_is_no_daemon_is_told(exported, answers, text, message):  # noqa: F811
    timeout = "1" if text is None else str(20 * TIME_FACTOR)
    remote = exported("pendulum", "3", "--remote", answers(text), "--remote-timeout", timeout)
    with instance_of(remote) as instance:
        with pytest.raises(Failed):
            instance.initialize()
        assert message in instance.log[-1][2], instance.log


def test_a_wrong_token_is_told(exported, daemon, monkeypatch):  # noqa: F811
    monkeypatch.setenv("MBCOSIM_TOKEN", "wrong")
    remote = exported("pendulum", "3", "--remote", daemon.http)
    with instance_of(remote) as instance:
        with pytest.raises(Failed):
            instance.initialize()
        assert "token" in instance.log[-1][2], instance.log


def test_a_token_can_come_from_a_file(exported, daemon, monkeypatch, tmp_path):  # noqa: F811
    remote = exported("pendulum", "3", "--remote", daemon.http)
    path = tmp_path / "token"
    path.write_text(f" {os.environ['MBCOSIM_TOKEN']} \r\n")
    monkeypatch.delenv("MBCOSIM_TOKEN")
    monkeypatch.setenv("MBCOSIM_TOKEN_FILE", str(path))
    with instance_of(remote) as instance:
        instance.initialize()
        assert instance.do_step(0.0, 0.005) == OK
    for wrong, message in [("two words\n", "is no token"), ("x\x01y\n", "is no token"), (None, "cannot read a token")]:
        path.unlink() if wrong is None else path.write_text(wrong)
        with instance_of(remote) as instance:
            with pytest.raises(Failed):
                instance.initialize()
            assert message in instance.log[-1][2], instance.log
    monkeypatch.delenv("MBCOSIM_TOKEN_FILE")


def test_a_deck_that_is_too_long_for_the_daemon_is_told(exported, start_daemon, monkeypatch):  # noqa: F811
    daemon = door_of(start_daemon("--http", "127.0.0.1:0", "--limit-message-bytes", "1000"), monkeypatch)
    with instance_of(exported("pendulum", "3", "--remote", daemon.http)) as instance:
        with pytest.raises(Failed):
            instance.initialize()
        assert "the body is longer than a message may be" in instance.log[-1][2], instance.log


def test_more_instances_in_threads_than_the_daemon_serves_streams(exported, daemon):  # noqa: F811
    """Values come as streams, of which the daemon serves 16 at once."""
    remote = exported("pendulum", "3", "--remote", daemon.http)
    results, together = [None] * 24, threading.Barrier(24)

    def work(k):
        with instance_of(remote) as instance:
            instance.initialize()
            together.wait(60 * TIME_FACTOR)
            for step in range(5):
                assert instance.do_step(step * 0.005, 0.005) == OK, instance.log
            results[k] = instance[remote.names("output")]

    threads = [threading.Thread(target=work, args=(k,)) for k in range(len(results))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60 * TIME_FACTOR)
    assert results[0] and all(result == results[0] for result in results)


@pytest.fixture(scope="module")
def with_port(exported, tmp_path_factory):  # noqa: F811
    """The modal body with one port more."""
    with open(os.path.join(MODELS, "modal_body.mbd")) as file:
        text = file.read().replace("forces: 2;", "forces: 3;")
    assert "forces: 3;" in text
    folder = tmp_path_factory.mktemp("ports")
    for file in ("modal_body_static.fem", "modal_body_dynamic.fem"):
        os.symlink(os.path.join(MODELS, file), folder / file)

    def make(card, standard, *options):
        deck = folder / f"{re.sub('[^a-z]+', '_', card)}.mbd"
        deck.write_text(text.replace("end: elements;", f"force: 99, {card};\nend: elements;"))
        return exported(str(deck), standard, *options)

    return make


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("card", ['external structural, grpc, port, "p", coupling, loose, 1, 12',
                                  'external structural, grpc, port, "p", coupling, tight, reference node, 12, 1, 11',
                                  'external structural mapping, grpc, port, "p", points number, 2, 12, offset, null, offset, 0., .1, 0.',
                                  'external modal, grpc, port, "p", 10'])
def test_inputs_of_ports_have_the_bits_of_the_engine_inside(with_port, daemon, standard, card):
    """The daemon waits for no peer of theirs."""
    rng = random.Random(3)
    fmus = both(with_port, daemon, card, standard)
    inputs, outputs = fmus[0].names("input"), fmus[0].names("output")
    assert inputs and all(name.startswith("port.p.") for name in inputs)
    start, _, step = fmus[0].experiment()
    values = [[[rng.uniform(-1, 1) for _ in range(fmus[0].sizes[name])] for name in inputs] for _ in range(12)]
    with instance_of(fmus[0]) as inside, instance_of(fmus[1]) as remote, instance_of(fmus[0]) as unloaded:
        for instance in (inside, remote, unloaded):
            instance.initialize()
        for k, now in enumerate(values):
            for instance in (inside, remote):
                for name, numbers in zip(inputs, now):
                    instance[name] = numbers
            for instance in (inside, remote, unloaded):
                assert instance.do_step(start + k * step, step) == OK, instance.log
        assert remote[outputs] == inside[outputs] != unloaded[outputs]


def refused(tmp_path, deck, *options):
    """What `mbcosim fmu` says."""
    path = tmp_path / "x.fmu"
    done = subprocess.run([os.path.join(BIN, "mbcosim"), "fmu", deck, "-o", str(path), *options], capture_output=True, text=True,
                          timeout=60 * TIME_FACTOR)
    assert done.returncode == 4 and not path.exists()
    return done.stderr


@pytest.mark.parametrize("address", ["daemon", "http://host", "http://host:0", "http://host:70000", "http://:1", "http://host:1/x", "http://host: 1",
                                     "http://me@host:1", "http://[host]:1", "http://::1:1", "http://host:1\r\nX: y", "HTTP://host:1", ""])
def test_wrong_addresses_are_refused_at_the_export(tmp_path, address):
    assert "the daemon's HTTP door is named http://HOST:PORT, got" in refused(tmp_path, os.path.join(MODELS, "pendulum.mbd"), "--remote", address)


def test_tls_is_refused_at_the_export(tmp_path):
    assert "it speaks no TLS" in refused(tmp_path, os.path.join(MODELS, "pendulum.mbd"), "--remote", "https://host:1")
