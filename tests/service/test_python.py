"""The Python client for daily use: a daemon of one's own, the model's parts as objects, histories, what-if, linear models, pictures."""
import asyncio
import collections
import contextlib
import functools
import os
import pathlib
import pydoc
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import types

import numpy as np
import pytest

import decks
import mbcosim
import mbcosim.aio
from conftest import MODELS, TIME_FACTOR, stop, wait_for
from mbcosim import access, objects
from mbcosim.v1 import simulations_pb2 as pb
from test_analysis import OSCILLATOR, S
from test_health import certificate


def model(name):
    return os.path.join(MODELS, name)


@pytest.fixture
def swing(server, pendulum):
    with server.load(pendulum) as simulation:
        yield simulation


# ---------------------------------------------------------------- a daemon of one's own

def running(process_id):
    """Is a process there and no zombie?"""
    try:
        with open(f"/proc/{process_id}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def daemon_of(server):
    """Process of the daemon that a private server keeps."""
    with open(f"/proc/{server.process_id}/task/{server.process_id}/children") as file:
        children = file.read().split()
    return next(int(child) for child in children if "mbcosimd" in os.readlink(f"/proc/{child}/exe"))


def test_a_private_daemon_lives_as_long_as_its_connection(pendulum):
    with mbcosim.local() as server:
        process, folder = daemon_of(server), os.path.dirname(server.address[len("unix:"):])
        assert server.load(pendulum).step().step == 1
        assert os.stat(folder).st_mode & 0o777 == 0o700
    assert not running(process) and not os.path.exists(folder)


BREAKS_OFF = "import mbcosim, os, sys; s = mbcosim.local(); print(s.process_id, s.address, flush=True); sys.stdin.read(); os._exit(1)"


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT, "exit"])
def test_a_private_daemon_ends_with_a_program_that_is_killed_and_leaves_nothing(how):
    with subprocess.Popen([sys.executable, "-c", BREAKS_OFF], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as child:
        number, _, path = child.stdout.readline().partition(" unix:")
        keeper, folder = int(number), os.path.dirname(path)
        assert running(keeper) and os.path.exists(folder)
        if how == "exit":
            child.stdin.close()
        else:
            child.send_signal(how)
    wait_for(lambda: not running(keeper) and not os.path.exists(folder))


FORKS = """
import mbcosim, os, sys, time
server = mbcosim.local()
folder = os.path.dirname(server.address[len("unix:"):])
if os.fork() == 0:
    sys.exit(0)
assert os.wait()[1] == 0 and os.path.exists(folder), "an end in good order of the child ended the daemon"
child = os.fork()
if child == 0:
    time.sleep(600)
with mbcosim.connect(server.address) as other:
    assert other.list() == []
begin = time.monotonic()
server.close()
print(os.path.exists(folder), time.monotonic() - begin)
os.kill(child, 9)
"""


def test_a_private_daemon_that_ended_by_itself_leaves_nothing():
    with subprocess.Popen([sys.executable, "-c", BREAKS_OFF], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as child:
        number, _, path = child.stdout.readline().partition(" unix:")
        keeper, folder = int(number), os.path.dirname(path)
        os.kill(daemon_of(types.SimpleNamespace(process_id=keeper)), signal.SIGKILL)
        wait_for(lambda: not running(keeper))
        assert os.path.exists(folder)  # its log
        child.kill()
    wait_for(lambda: not os.path.exists(folder))
    with mbcosim.local() as server:
        os.kill(daemon_of(server), signal.SIGKILL)
        wait_for(lambda: "private, ended" in repr(server))
        assert os.path.exists(os.path.dirname(server.address[len("unix:"):]))
    assert not os.path.exists(os.path.dirname(server.address[len("unix:"):]))


def test_a_private_daemon_is_that_of_the_process_that_started_it():
    done = subprocess.run([sys.executable, "-c", FORKS], stdout=subprocess.PIPE, text=True, timeout=60 * TIME_FACTOR, check=True)
    left, seconds = done.stdout.split()
    assert left == "False" and float(seconds) < 1.9 * TIME_FACTOR


FORKED_WITH_A_CONNECTION = """
import mbcosim, multiprocessing, sys
context = multiprocessing.get_context("fork")

def connect(address):
    try:
        with mbcosim.connect(address) as server:
            return server.info().version
    except mbcosim.Unavailable as error:
        return str(error)

with mbcosim.local() as server:
    other = mbcosim.connect(server.address)
    with other.load(sys.argv[1]) as simulation:
        def leave():
            with other, simulation:
                simulation.step()

        for _ in range(3):
            simulation.step(5)
            with context.Pool(2) as pool:
                assert all("do not survive a fork" in text for text in pool.map(connect, [server.address] * 8))
        left = context.Process(target=leave)
        left.start()
        left.join()
        assert left.exitcode == 1  # Unavailable; what it left is the other's
        assert simulation.step(5).step == 20
    other.close()
with mbcosim.local() as server:
    mbcosim.Server.close(server)  # the daemon goes on
    with context.Pool(2) as pool:
        print(*pool.map(connect, [server.address] * 8))
"""


def test_a_forked_process_makes_no_calls_where_a_connection_was_open(pendulum):
    """It got what was for the other one, which failed or hung."""
    done = subprocess.run([sys.executable, "-c", FORKED_WITH_A_CONNECTION, pendulum], stdout=subprocess.PIPE, text=True, timeout=60 * TIME_FACTOR, check=True)
    assert done.stdout.split() == 8 * [mbcosim.__version__]


def test_a_private_daemon_that_is_stopped_delays_nobody_for_long():
    with mbcosim.local() as server:
        os.kill(daemon_of(server), signal.SIGSTOP)
        begin = time.monotonic()
    assert time.monotonic() - begin < 3 + TIME_FACTOR


@pytest.mark.parametrize("name", ["with blanks", "a#b?c", "100%25", "one,two", "ä"])
def test_a_private_daemon_lives_in_any_folder(monkeypatch, name):
    async def awaited():
        async with mbcosim.aio.connect(server.address) as other:
            return await other.info()

    with tempfile.TemporaryDirectory(dir="/tmp") as top:
        os.mkdir(f"{top}/{name}")
        monkeypatch.setattr(tempfile, "tempdir", f"{top}/{name}")
        with mbcosim.local() as server:
            assert server.info().version == asyncio.run(awaited()).version
            assert ("," in name) != server.address.startswith(f"unix:{top}/{name}/")


def test_a_private_daemon_that_cannot_start_says_why():
    with pytest.raises(mbcosim.Unavailable, match="ended with .* before it served: (.|\n)*--no-such-option"):
        mbcosim.local("--no-such-option")
    with socket.create_server(("127.0.0.1", 0)) as taken:  # which is known after the daemon listens
        port = taken.getsockname()[1]
        with pytest.raises(mbcosim.Unavailable, match=f"ended with .* before it served: (.|\n)*127.0.0.1:{port}"):
            mbcosim.local("--http", f"127.0.0.1:{port}")


def test_options_of_another_daemon_are_not_those_of_a_private_one(monkeypatch, tmp_path):
    (tmp_path / "tokens").write_text("a-token control ann\n")
    monkeypatch.setenv("MBCOSIMD_TOKENS", str(tmp_path / "tokens"))
    monkeypatch.setenv("MBCOSIMD_NO_SUCH_OPTION", "1")
    with mbcosim.local() as server:
        assert server.list() == []


def test_a_missing_program_is_named_with_its_remedy(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("MBCOSIM_BIN", str(tmp_path))
    monkeypatch.setattr(access, "__file__", str(tmp_path / "a" / "b" / "access.py"))
    with pytest.raises(FileNotFoundError, match="neither on the PATH nor in .MBCOSIM_BIN"):
        mbcosim.local()


@pytest.mark.parametrize("address, why, options", [
    ("unix:/tmp/mbcosim-no-such-folder/s", "there is no such socket, nor its folder", ""), ("unix:/tmp/mbcosim-no-such-socket", "there is no such socket", ""),
    ("localhost:1", "nobody accepts connections there", " --tokens FILE")])  # over TCP a daemon wants to know who calls
def test_connect_without_a_daemon_says_so_at_once_and_how_to_start_one(address, why, options):
    start = time.monotonic()
    with pytest.raises(mbcosim.Unavailable) as caught:
        mbcosim.connect(address)
    assert time.monotonic() - start < 3 * TIME_FACTOR
    assert str(caught.value).startswith(f"no daemon listens at {address}: {why}. Start one in a terminal with `mbcosimd --listen {address}{options} &`")


@pytest.mark.parametrize("address, fault", [
    ("foo", "has no port, nor `unix:` before it: expected HOST:PORT or unix:PATH"), ("localhost:", "has the port '': expected a number from 1 to 65535"),
    ("localhost:99999", "has the port '99999': expected a number from 1 to 65535"), (":50051", "has no host before its port: say 'localhost:50051'"),
    ("::1", "has colons in its host: expected [HOST]:PORT"), ("/run/mbcosim.sock", "is a path without `unix:` before it: say 'unix:/run/mbcosim.sock'"),
    ("http://localhost:8765/?token=x", "is that of a page, or of calls over HTTP: expected the one that the daemon listens on (--listen)"),
    ("tcp://localhost:1", "has a scheme that is not known here: expected"), ("unix:", "names no socket: expected unix:PATH"),
    ("unix:/one,two/s", "has a comma in the path of a socket"), ("unix:/" + "x" * 107, "is too long: the path of a socket has at most 107 bytes, this one 108")])
def test_what_is_no_address_is_refused_with_what_is_wrong(address, fault, monkeypatch):
    async def awaited():
        async with mbcosim.aio.connect(address):
            pass

    monkeypatch.setenv("MBCOSIM_ADDRESS", address)
    for call in (lambda: mbcosim.connect(address), mbcosim.connect, lambda: asyncio.run(awaited())):
        with pytest.raises(ValueError) as caught:
            call()
        assert str(caught.value).startswith(f"the address {address!r} {fault}")


def test_who_cannot_be_reached_is_told_why(start_daemon, tmp_path):
    (tmp_path / "plain").write_text("")
    daemon = start_daemon("--http", "127.0.0.1:0")
    for address, text in ((f"unix:{tmp_path}/plain", "no server can be reached at .*: that is no socket"),
                          ("no.such.host.invalid:50051", "no server can be reached at .*: no host is known by that name"),
                          (daemon.page().split("/")[2], "is that the port of the page")):
        with pytest.raises(mbcosim.Unavailable, match=text):
            mbcosim.connect(address)


def test_a_default_socket_that_strangers_may_replace_is_not_opened(monkeypatch):
    """In /tmp, where anybody may have made the folder."""
    monkeypatch.delenv("MBCOSIM_ADDRESS", raising=False)
    with tempfile.TemporaryDirectory(dir="/tmp") as top:
        folder = os.path.join(top, "run")
        os.mkdir(folder)
        os.symlink(folder, os.path.join(top, "link"))
        for mode, place in ((0o777, folder), (0o1777, folder), (0o720, folder)):
            os.chmod(folder, mode)
            for name in ("run", "link"):
                monkeypatch.setenv("XDG_RUNTIME_DIR", os.path.join(top, name))
                with pytest.raises(mbcosim.NotAllowed, match=f"others may have put the default socket .* the folder {top}/{name} may be written by others"):
                    mbcosim.connect()
        os.chmod(folder, 0o700)
        os.chmod(top, 0o777)
        with pytest.raises(mbcosim.NotAllowed, match=f"the folder {top} may be written by others"):
            mbcosim.connect()
        os.chmod(top, 0o1777)  # as /tmp is
        with pytest.raises(mbcosim.Unavailable, match="there is no such socket"):
            mbcosim.connect()
        monkeypatch.setattr(os, "geteuid", lambda: os.stat(folder).st_uid + 1)
        if os.stat(folder).st_uid != 0:  # root may do all in any case
            with pytest.raises(mbcosim.NotAllowed, match=f"belongs to user {os.getuid()}, neither root nor this one"):
                mbcosim.connect()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root makes folders of others")
def test_a_default_socket_in_a_strangers_folder_is_not_opened(monkeypatch):
    monkeypatch.delenv("MBCOSIM_ADDRESS", raising=False)
    with tempfile.TemporaryDirectory(dir="/tmp") as folder:
        os.chown(folder, 1234, 1234)
        monkeypatch.setenv("XDG_RUNTIME_DIR", folder)
        with pytest.raises(mbcosim.NotAllowed, match="belongs to user 1234, neither root nor this one .0.. Remove it, or say where the daemon is"):
            mbcosim.connect()


def test_connect_or_start_takes_the_users_daemon_where_it_runs(daemon, monkeypatch, tmp_path):
    monkeypatch.delenv("MBCOSIM_ADDRESS", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with mbcosim.connect_or_start() as server:
        assert isinstance(server, mbcosim.LocalServer)
    os.symlink(daemon.address[len("unix:"):], tmp_path / "mbcosim.sock")
    with mbcosim.connect_or_start() as server:
        assert not isinstance(server, mbcosim.LocalServer)


def test_the_environment_gives_address_and_token(start_daemon, tmp_path, monkeypatch):
    tokens = tmp_path / "tokens"
    tokens.write_text("secret control anna\n")
    tokens.chmod(0o600)
    daemon = start_daemon("--tokens", str(tokens))
    monkeypatch.setenv("MBCOSIM_ADDRESS", daemon.address)
    with pytest.raises(mbcosim.NotAllowed):
        mbcosim.connect(timeout=30)
    monkeypatch.setenv("MBCOSIM_TOKEN", "secret")
    with mbcosim.connect() as server:
        assert server.info().identity == "token:anna"
    monkeypatch.delenv("MBCOSIM_TOKEN")
    monkeypatch.setenv("MBCOSIM_TOKEN_FILE", str(tmp_path / "token"))
    (tmp_path / "token").write_text("secret\n")
    with mbcosim.connect() as server:
        assert server.info().identity == "token:anna"


@pytest.mark.parametrize("token", ["hidden\r\n", "hidd\u00e9n", "hid den"])
@pytest.mark.parametrize("how", ["argument", "variable", "file"])
def test_a_token_that_cannot_travel_is_refused_and_not_shown(daemon, tmp_path, monkeypatch, token, how):
    (tmp_path / "token").write_bytes(token.encode("latin-1"))
    monkeypatch.setenv(*{"argument": ("MBCOSIM_TOKEN", ""), "variable": ("MBCOSIM_TOKEN", token),
                         "file": ("MBCOSIM_TOKEN_FILE", str(tmp_path / "token"))}[how])
    options = {"token": token} if how == "argument" else {}
    if how == "file" and token.isascii() and " " not in token:
        mbcosim.connect(daemon.address).close()  # the end of a line is none of the token
        return

    async def main():
        async with mbcosim.aio.connect(daemon.address, **options):
            pass

    for connect in (lambda: mbcosim.connect(daemon.address, **options), lambda: asyncio.run(main())):
        with pytest.raises(ValueError, match="the token has characters that none can have") as caught:
            connect()
        assert "hid" not in str(caught.value) and caught.value.__cause__ is None


@pytest.mark.parametrize("name", ["\u00e9", "simulations/1\r\n"])
def test_no_simulation_has_a_name_that_cannot_travel(server, name):
    for ask in (server.attach, server.events):
        with pytest.raises(mbcosim.NotFound, match="no simulation is named ") as caught:
            ask(name)
        assert caught.value.reason == "NO_SUCH_SIMULATION"


CLOSED = [
    lambda server, s: s.step(), lambda server, s: s.read(["time"]), lambda server, s: s.run_until(1.0, progress=print), lambda server, s: s.stepper(),
    lambda server, s: s.subscribe(["time"]), lambda server, s: s.couple("spring"), lambda server, s: s.export_state(),
    lambda server, s: server.list(), lambda server, s: server.events(), lambda server, s: server.load_text(decks.body())]


def test_a_closed_connection_is_told(daemon):
    server = daemon.connect(reconnect=60)
    with server, server.load_text(decks.endless()) as simulation:
        stepper = simulation.stepper()
        stepper.step()
        told = []

        def run():
            with pytest.raises(mbcosim.Unavailable, match="the connection is closed") as caught:
                server.attach(simulation.name).run_until(1e8)
            told.append(caught.value)

        running_on = begun(run, simulation)
        server.close()
        running_on.join()
        assert told
        for ask in [*CLOSED, lambda *_: stepper.step()]:
            with pytest.raises(mbcosim.Unavailable, match="the connection is closed"):
                ask(server, simulation)
    assert "mbcosim.Server at" in repr(server)


def test_a_closed_connection_of_asyncio_is_told(daemon):
    async def main():
        async with mbcosim.aio.connect(daemon.address) as server:
            simulation = await server.load_text(decks.endless())
            stepper = await simulation.stepper()
            await stepper.step()
            run = asyncio.create_task(simulation.run_until(1e8))
            await asyncio.sleep(0.2)
        for ask in [*CLOSED, lambda *_: stepper.step(), lambda *_: run]:
            with pytest.raises(mbcosim.Unavailable, match="the connection is closed"):
                await ask(server, simulation)

    asyncio.run(asyncio.wait_for(main(), 60))


def test_tls_takes_the_names_of_files_from_arguments_or_the_environment(start_daemon, tmp_path, monkeypatch):
    certificate(tmp_path, "ca", "/CN=authority")
    certificate(tmp_path, "server", "/CN=localhost", "ca", ["-addext", "subjectAltName=DNS:localhost"])
    certificate(tmp_path, "arm", "/CN=arm", "ca")
    daemon = start_daemon("--listen", "localhost:0", "--tls-certificate", str(tmp_path / "server.pem"), "--tls-key", str(tmp_path / "server.key"),
                          "--tls-client-ca", str(tmp_path / "ca.pem"))
    address = daemon.tcp_address()
    files = {"ca": tmp_path / "ca.pem", "certificate": tmp_path / "arm.pem", "key": tmp_path / "arm.key"}
    with mbcosim.connect(address, **files) as server:
        assert server.info().identity == "cert:CN=arm"
    with pytest.raises(mbcosim.Unavailable, match="does the server use TLS"):
        mbcosim.connect(address)
    for name, path in files.items():
        monkeypatch.setenv(f"MBCOSIM_TLS_{name.upper()}", str(path))
    with mbcosim.connect(address) as server:
        assert server.info().identity == "cert:CN=arm"


def test_wrong_files_of_tls_are_named():
    with pytest.raises(ValueError, match="go together"):
        mbcosim.connect("localhost:1", certificate="client.pem")
    with pytest.raises(ValueError, match="ca: cannot read 'no.pem': No such file or directory"):
        mbcosim.connect("localhost:1", ca="no.pem")


# ---------------------------------------------------------------- the model's parts

NAMED = decks.body().replace("structural: 1, dynamic", 'structural: 1, name, "top", dynamic').replace(
    "structural nodes: 1;", "structural nodes: 1; parameter nodes: 1; abstract nodes: 1; genels: 1;").replace(
    "end: nodes;", 'parameter: 1, name, "valve", 0.5; abstract: 1; end: nodes;').replace(
    "end: elements;", "genel: 1, spring support, 1, abstract, algebraic, linear elastic, 1.; end: elements;")


def test_a_deck_may_be_given_as_bytes(server):
    """As files have them, in whatever encoding."""
    text = NAMED.replace('"top"', '"t\u00fcr"')
    for deck, name in ((text, "t\u00fcr"), (text.encode(), "t\u00fcr"), (text.encode("latin-1"), "t?r")):
        with server.load_text(deck) as simulation:
            assert simulation.nodes[1].name == name


def test_parts_are_found_by_label_by_name_and_by_family(server):
    with server.load_text(NAMED) as simulation:
        top = simulation.nodes["top"]
        assert top.label == 1 and simulation.nodes[1].name == "top" and simulation.nodes["parameter", 1].name == "valve"
        assert len(simulation.nodes) == 3 and ("abstract", 1) in simulation.nodes
        assert simulation.elements["body", 1].mass == 1.0
        assert top.position.shape == (3,) and top.orientation.shape == (3, 3)
        assert list(top.position) == list(simulation["node.structural.1.X"])
        assert top["angular_velocity"] == pytest.approx(simulation["node.structural.1.Omega"])
        assert {"position", "XP", "load"} <= set(dir(top))
        assert ", step 0, t = 0 (deck unit of time), " in repr(simulation.snapshot())
        assert repr(top).startswith('<dynamic node 1 "top", t = 0 (deck unit of time)>\n  X[3] [deck unit of length], global: position')


def test_inputs_are_set_by_the_names_of_their_nodes(server):
    with server.load_text(NAMED) as simulation:
        simulation.inputs["valve"] = 0.2
        assert simulation["node.parameter.1.x"] == simulation.inputs["valve"] == 0.2
        simulation.nodes["top"].load = [0, 0, 6.0, 0, 0, 0]
        simulation.step(100)
        assert simulation.nodes["top"].velocity[2] == pytest.approx(0.6, rel=2e-2)  # of 1 kg after 0.1 s, and the method's first step
        assert "node.structural.1.load" in simulation.inputs and "time" in simulation.outputs


LOAD, OTHER = "node.structural.2.load", "node.structural.1.load"


@pytest.mark.parametrize("read", [lambda s: s.nodes[2].load, lambda s: s.nodes[2]["load"], lambda s: s.inputs[LOAD], lambda s: s[LOAD], lambda s: s.joints[2].reaction])
def test_to_write_into_what_was_read_is_refused(swing, read):
    """The model did not see it."""
    with pytest.raises(ValueError, match="what was read is a copy, to write into it would not change the model: assign a whole value"):
        read(swing)[1] = 5
    with pytest.raises(ValueError, match="what was read is a copy"):
        read(swing)[:3][1] = 5
    assert repr(read(swing)) == repr(np.array(read(swing)))
    mine = read(swing).copy()
    mine[1] = 5
    assert mine[1] == 5 and type(read(swing) + 1) is np.ndarray and type(read(swing).sum()) is np.float64


def test_an_input_is_changed_by_a_sum(swing):
    swing.nodes[2].load += [0, 1, 0, 0, 0, 0]
    swing.inputs["structural.2.load"] *= 6
    swing[LOAD] -= 1
    swing[LOAD] /= 2
    assert list(swing[LOAD]) == [-0.5, 2.5, -0.5, -0.5, -0.5, -0.5]


def test_what_is_among_the_variables_can_be_asked(swing):
    assert "time" in swing and "nope" not in swing and 0 not in swing
    assert list(swing) == list(swing.variables) == list(swing.outputs)
    assert "structural.2.load" in swing.inputs and "time" not in swing.inputs and 0 not in swing.inputs and "X" not in swing.outputs


def test_parts_and_inputs_of_a_large_model_are_found_at_once(server):
    """Each attribute looked through all variables, 10 ms where there are 39 000."""
    labels, looks = range(1, 301), collections.Counter()
    deck = decks.body().replace("structural nodes: 1; rigid bodies: 1;", f"structural nodes: {len(labels)}; rigid bodies: {len(labels)};")
    deck = deck.replace("structural: 1, dynamic, null,", " ".join(f"structural: {k}, dynamic, {k}., 0., 0., eye, null, null;" for k in labels[1:])
                        + " structural: 1, dynamic, 1., 0., 0.,")
    deck = deck.replace("body: 1, 1, 1., null", " ".join(f"body: {k}, {k}, 1., null, eye;" for k in labels[1:]) + " body: 1, 1, 1., null")
    with server.load_text(deck) as simulation:
        class Counted(dict):
            def items(self):
                looks["all"] += 1
                return super().items()

            def __iter__(self):
                looks["all"] += 1
                return super().__iter__()

        simulation.describe()
        simulation._known = Counted(simulation._known)
        for k in (1, 2, labels[-1]):
            assert simulation.nodes[k].position[0] == k and simulation.inputs[f"structural.{k}.load"][0] == 0
            assert simulation.elements["body", k].mass == 1.0 and "X" in simulation.nodes[k].variables
        assert looks["all"] <= 2
        simulation.describe()  # of which the parts are made anew
        assert simulation.nodes[2].position[0] == 2


@pytest.mark.parametrize("set_inputs, field", [
    (lambda s, values: s.write(values), "values.values"), (lambda s, values: s.step(inputs=values), "inputs.values"),
    (lambda s, values: s.run_until(0.1, inputs=values), "inputs.values"), (lambda s, values: s.simulate("time", steps=1, inputs=values), "inputs.values"),
    (lambda s, values: s.simulate("time", steps=1, inputs={k: lambda t, v=v: v for k, v in values.items()}), "inputs.values")])
def test_an_input_takes_as_many_real_numbers_as_it_has(swing, set_inputs, field):
    with pytest.raises(mbcosim.Error, match=f"`{field}`: '{LOAD}' takes 6 values, got 5") as caught:
        set_inputs(swing, {LOAD: range(5), OTHER: range(7)})  # as many as both together
    assert caught.value.reason == "BAD_ARGUMENT" and caught.value.field == field
    with pytest.raises(TypeError, match=f"'{LOAD}': complex numbers, where real ones are wanted"):
        set_inputs(swing, {LOAD: [1j] * 6})
    assert swing.step_number == 0 and not swing[LOAD].any() and not swing[OTHER].any()


def test_a_steppers_values_are_real_numbers(swing):
    with swing.stepper(inputs=[LOAD]) as stepper:
        with pytest.raises(TypeError, match="complex numbers"):
            stepper.step(np.ones(6) * 1j)
        assert stepper.step(np.ones(6)).step == 1


def names(*given):
    return (name for name in given)


POSITION = "node.structural.2.X"


@pytest.mark.parametrize("ask, argument", [
    (lambda s, outputs: s.read(outputs), "names"), (lambda s, outputs: s.step(outputs=outputs).values, "outputs"),
    (lambda s, outputs: s.step(timeout=9, outputs=outputs).values, "outputs"), (lambda s, outputs: s.run_until(0.1, outputs=outputs).values, "outputs"),
    (lambda s, outputs: s.run_until(0.1, outputs=outputs, progress=lambda _: None).values, "outputs"),
    (lambda s, outputs: s.stepper(outputs).step().values, "outputs"), (lambda s, outputs: dict.fromkeys(s.subscribe(outputs)._names), "names"),
    (lambda s, outputs: {POSITION: s.linearize([], outputs)[2]}, "outputs")])
def test_names_may_come_from_a_generator_but_not_one_by_itself(swing, ask, argument):
    assert list(ask(swing, names(POSITION))) == [POSITION]
    with pytest.raises(TypeError, match=rf"`{argument}` must be a list of names, got one by itself: say \['{POSITION}'\]"):
        ask(swing, POSITION)


def test_names_of_a_signal_port_are_a_list():
    with pytest.raises(TypeError, match=r"`inputs` must be a list of names, got one by itself: say \['time'\]"):
        mbcosim.signal_port("control", [], "time")


def test_the_reaction_of_a_hinge_is_what_moves_the_body(swing):
    swing.step(60)
    needed = swing.nodes[2].acceleration - np.array([0, 0, -9.81])  # of 1 kg
    assert np.linalg.norm(needed) > 5 and swing.joints[2].reaction == pytest.approx(needed, abs=1e-8)
    with pytest.raises(AttributeError, match="clamp 1 has no 'angle'; known: "):
        swing.joints[1].angle


def test_words_that_are_wrong_are_answered_with_those_that_are_right(swing):
    for call, text in (
            (lambda: swing.nodes[7], "no node is called 7; known: 1, 2"), (lambda: swing.nodes["tip"], "no node is called 'tip'; known: 1, 2"),
            (lambda: swing.elements["rod"], "no element is called 'rod'; known: 1, ('joint', 2), ('body', 2)"),
            (lambda: swing.state_space("structural.2.load", "time").only("load", "time"), "the system has no input 'load'; known: 'node.structural.2.load[1]'"),
            (lambda: swing.nodes[2].posision, "dynamic node 2 has no 'posision'; did you mean 'position'?"),
            (lambda: setattr(swing.nodes[2], "position", [0, 0, 0]), "'position' of dynamic node 2 cannot be set; known: 'load'"),
            (lambda: swing.inputs["valve"], "no input is called 'valve'; known: 'node.structural.1.load', 'node.structural.2.load'"),
            (lambda: swing["node.structural.2.XX"], "no variable is named 'node.structural.2.XX'; did you mean 'node.structural.2.X"),
            (lambda: swing.update(policy="fale"), "policy: no choice is called 'fale'; choose from 'fail', 'cut_step', 'accept_flagged'"),
            (lambda: swing.couple("p", mode="tigth"), "no choice is called 'tigth'; choose from 'loose', 'staggered', 'tight', 'window'"),
            (lambda: swing.subscribe([], policy="x"), "no choice is called 'x'; choose from 'block', 'drop_oldest', 'decimate'"),
            (lambda: swing.step(until=mbcosim.Condition("time", "=", 1)), "comparison: no choice is called '='; choose from '<', '<='")):
        with pytest.raises((KeyError, AttributeError, ValueError)) as caught:
            call()
        assert text in caught.value.args[0] and str(caught.value) == caught.value.args[0]


def test_nodes_of_ports_and_units_of_another_kind_are_told(server, swing, pendulum):
    for nodes in (["tip"], 9, [1.5]):
        for port in (mbcosim.structural_port, mbcosim.motion_port):
            with pytest.raises(TypeError, match="`nodes` of port 'wing' must be a list of labels, whole numbers, got"):
                port("wing", nodes=nodes)
    assert list(mbcosim.structural_port("wing", nodes=np.array([1, 2])).node_labels) == [1, 2]
    for call in (lambda: server.load(pendulum, units="mm"), lambda: swing.couple("wing", lambda m: m.x, units="mm")):
        with pytest.raises(TypeError, match="`units` must be a system made by mbcosim.units, .* say, got 'mm'"):
            call()


def test_lists_of_ports_and_grants_and_conditions_of_another_kind_are_told(server, swing, pendulum):
    tip, everybody = mbcosim.structural_port("tip", nodes=[2]), mbcosim.grant("*", "observe")
    for make in (lambda **options: server.load(pendulum, **options), swing.fork):
        for ports in (tip, "tip", ["tip"]):
            with pytest.raises(TypeError, match=r"`ports` must be a list of ports, \[.*\] say, got"):
                make(ports=ports)
    for call in (lambda grants: server.load(pendulum, grants=grants), lambda grants: swing.update(grants=grants)):
        for grants in (everybody, "*", ["*"]):
            with pytest.raises(TypeError, match=r"`grants` must be a list of grants, \[.*\] say, got"):
                call(grants)
    with pytest.raises(TypeError, match=r"`ports` must be a list of names, .* say \['tip'\]"):
        mbcosim.grant("token:ann", "couple", "tip")
    with pytest.raises(TypeError, match="`until` must be a mbcosim.Condition, .* got 1.0; run_until takes a time"):
        swing.step(until=1.0)


def test_states_and_decks_that_are_no_bytes_are_told(server, swing):
    for call, what in ((swing.import_state, "a saved state"), (server.import_checkpoint, "a saved state"), (server.load_text, "the file 'deck' of a bundle")):
        with pytest.raises(TypeError, match=f"{what} must be bytes, got a PosixPath"):
            call(pathlib.Path("state"))


@pytest.mark.parametrize("of", [mbcosim.Server, mbcosim.Simulation, mbcosim.Snapshot, mbcosim.aio.Server, mbcosim.aio.Simulation])
def test_help_tells_what_a_call_gives(of):
    text = pydoc.plain(pydoc.render_doc(of))
    assert "timeout: 'Optional[float]' = 30.0) -> '" in text and "-> 'Calls[" not in text


def test_one_of_many_parts_is_found_without_a_look_at_each():
    """All of 10 000 nodes, or an input by the end of its name, took seconds."""
    looks = []

    class Watched(objects.Part):
        def __getattribute__(self, name):
            looks.append(name)
            return super().__getattribute__(name)

    parts = objects.Parts("nodes", [Watched(None, f"node.structural.{k}.", k, "", "structural", "static") for k in range(1000)])
    looks.clear()
    assert [part.label for part in parts.values()] == list(range(1000)) and len(looks) <= 3000


# ---------------------------------------------------------------- histories, what if

def test_a_history_has_what_single_steps_give(server, pendulum):
    name = "node.structural.2.X"
    with server.load(pendulum) as one, server.load(pendulum) as other:
        history = one.simulate([name], until=0.5, every=10)
        rows = [other[name], *(other.step(10, outputs=[name]).values[name] for _ in range(10))]
    np.testing.assert_array_equal(history[name], rows)
    assert history.time == pytest.approx(np.linspace(0, 0.5, 11)) and history.units == {name: "deck unit of length"}
    assert list(history.columns()) == [f"{name}[{k}]" for k in (1, 2, 3)]
    with pytest.raises(KeyError, match="did you mean 'node.structural.2.X'"):
        history["node.structural.2.Y"]


def test_a_history_ends_with_the_deck_and_counts_what_is_left(swing):
    history = swing.simulate(steps=7, every=3)
    assert list(np.round(history.time / 0.005)) == [0, 3, 6, 7] and len(history) == 2  # positions of both nodes
    swing.simulate(every=300)
    assert swing.time == pytest.approx(5.0)
    for wrong in ({"until": 1.0, "steps": 3}, {"every": 0}):
        with pytest.raises(ValueError):
            swing.simulate(**wrong)


def test_a_history_survives_the_step_that_failed(server):
    with server.load_text(decks.impossible()) as simulation:
        with pytest.raises(mbcosim.StepFailed) as caught:
            simulation.simulate()
    assert list(caught.value.history.time) == [0.0]


def test_inputs_may_be_functions_of_time(server):
    name = "node.structural.1.load"
    with server.load_text(decks.body(spin="0., 0., 0.")) as simulation:
        history = simulation.simulate(["node.structural.1.XP"], until=0.5, inputs={name: lambda t: [2 * t, 0, 0, 0, 0, 0]})
    assert history["node.structural.1.XP"][-1, 0] == pytest.approx(0.25, rel=1e-2)  # the integral of 2 t, held from step to step


def test_an_output_that_is_named_twice_is_kept_once(swing):
    for inputs in ({}, {LOAD: lambda t: [0] * 6}):
        history = swing.simulate([POSITION, "time", POSITION], steps=4, inputs=inputs)
        assert {name: values.shape for name, values in history.items()} == {POSITION: (5, 3), "time": (5,)}


@pytest.mark.parametrize("inputs", [{}, {LOAD: lambda t: [0] * 6}])
def test_a_history_of_a_negative_number_of_steps_is_refused(swing, inputs):
    with pytest.raises(mbcosim.Error, match="`steps` must not be negative, got -1") as caught:
        swing.simulate(POSITION, steps=-1, inputs=inputs)
    assert caught.value.field == "steps"


@pytest.mark.parametrize("inputs", [{}, {LOAD: lambda t: [0] * 6}])
def test_how_far_a_history_goes_is_a_number(swing, inputs):
    with pytest.raises(mbcosim.Error, match="is not a number"):
        swing.simulate(until=float("nan"), inputs=inputs)
    with pytest.raises(TypeError):
        swing.simulate(steps=2.5, inputs=inputs)
    assert swing.time == 0


def test_a_history_is_a_table(swing, tmp_path):
    history = swing.simulate(["node.structural.2.X", "time"], steps=3)
    history.save(tmp_path / "h.csv")
    lines = (tmp_path / "h.csv").read_text().splitlines()
    length, time = "[deck unit of length]", "time [deck unit of time]"
    assert lines[0] == ",".join([time, *(f"node.structural.2.X[{k}] {length}" for k in (1, 2, 3)), time])
    assert len(lines) == 5
    for module, convert in (("pandas", history.to_pandas), ("xarray", history.to_xarray)):
        try:
            __import__(module)
        except ImportError:
            with pytest.raises(ImportError, match=f"needs {module}: pip install {module}, or apt-get install python3-{module}"):
                convert()
            continue
        table = convert()
        assert "node.structural.2.X[1]" in table if module == "pandas" else table["node.structural.2.X"].attrs["units"] == "deck unit of length"


def test_the_time_among_the_outputs_is_the_coordinate_of_a_data_set(swing, monkeypatch):
    """xarray, which few machines have here, refuses a name that is both."""
    monkeypatch.setitem(sys.modules, "xarray", types.SimpleNamespace(Dataset=lambda data, coords, attrs: (set(data), set(coords))))
    assert swing.simulate(["node.structural.2.X", "time"], steps=3).to_xarray() == ({"node.structural.2.X"}, {"time"})


def test_a_snapshot_as_a_block_leaves_the_state_as_it_was(swing):
    swing.step(10)
    before = swing["node.structural.2.X"]
    with swing.snapshot() as start:
        swing.step(50)
        assert start.step == 10
    assert swing.step_number == 10 and list(swing["node.structural.2.X"]) == list(before) and swing.snapshots() == []


class Mine(Exception):
    pass


def left_by_an_exception(block, before):
    """The text of what is raised out of a `with` block in which `before(it)` is followed by an exception."""
    with pytest.raises(Mine) as caught:
        with block as it:
            before(it)
            raise Mine("of the block")
    return str(caught.value)


def test_what_fails_at_the_end_of_a_block_hides_nothing(server, pendulum):
    simulation = server.load(pendulum)
    assert left_by_an_exception(simulation.snapshot(), lambda it: it.delete()) == "of the block"
    assert left_by_an_exception(simulation.snapshot(), lambda it: simulation.delete()) == "of the block"
    assert left_by_an_exception(server.load(pendulum), lambda it: it.delete()) == "of the block"


def test_what_was_deleted_within_a_block_is_left_in_good_order(server, pendulum):
    with server.load(pendulum) as simulation:
        with pytest.raises(mbcosim.NotFound):  # there is nothing to go back to
            with simulation.snapshot() as saved:
                saved.delete()
        simulation.delete()
    assert simulation.name not in [info.name for info in server.list()]


def begun(run, simulation):
    """A thread that runs a simulation, and it does run."""
    thread = threading.Thread(target=run)
    thread.start()
    wait_for(lambda: simulation.refresh().state == pb.SIMULATION_STATE_STEPPING)
    return thread


def test_the_end_of_a_block_waits_until_the_simulation_is_free(server):
    with server.load_text(decks.endless()) as simulation:
        with simulation.snapshot():
            busy = begun(lambda: simulation.run_until(1e8), simulation)
            threading.Timer(0.4, simulation.interrupt).start()
        assert (simulation.step_number, simulation.snapshots()) == (0, [])
        busy.join()


def run_for_long(simulation):
    with contextlib.suppress(mbcosim.Error):
        simulation.run_until(1e8)


def test_the_end_of_a_block_waits_for_a_busy_simulation_not_for_ever(server):
    with server.load_text(decks.endless()) as simulation:
        threads = []
        run = functools.partial(run_for_long, simulation)
        begin = time.monotonic()
        assert left_by_an_exception(simulation.snapshot(), lambda _: threads.append(begun(run, simulation))) == "of the block"
        with pytest.raises(mbcosim.Busy):
            with simulation.snapshot():
                pass
        assert time.monotonic() - begin < 6 * TIME_FACTOR
        simulation.interrupt()
        threads[0].join()


def test_a_block_that_may_not_have_gone_back_says_so(start_daemon):
    daemon = start_daemon()
    with daemon.connect() as server:
        simulation = server.load_text(decks.body())
        one, other = simulation.snapshot(), simulation.snapshot()
        stop(daemon.process.pid)
        try:
            with pytest.raises(mbcosim.TimedOut):
                with one:
                    pass
            assert left_by_an_exception(other, lambda _: None) == "of the block"
            with simulation:
                pass  # it ends with its lease
        finally:
            os.kill(daemon.process.pid, signal.SIGCONT)


def test_the_ends_of_asynchronous_blocks_hide_nothing(daemon):
    async def main():
        async with mbcosim.aio.connect(daemon.address) as server:
            for part in ("simulation", "snapshot"):
                simulation = await server.load_text(decks.body())
                with pytest.raises(Mine):
                    async with simulation if part == "simulation" else await simulation.snapshot() as it:
                        await it.delete()
                        raise Mine
            async with await server.load_text(decks.endless()) as simulation:
                with pytest.raises(asyncio.TimeoutError):
                    async with await simulation.snapshot():
                        await asyncio.wait_for(simulation.run_until(1e8), 0.3)  # the daemon needs a moment to end it
                assert simulation.step_number == 0

    asyncio.run(asyncio.wait_for(main(), 60))


def test_what_if_tries_inputs_and_stays_where_it_is(swing, server):
    before = len(server.list())
    found = swing.what_if({"free": {}, "pushed": {"structural.2.load": [0, 0, 3, 0, 0, 0]}}, names(POSITION), until=0.5)
    free, pushed = (found[name]["node.structural.2.X"][-1, 2] for name in ("free", "pushed"))
    assert free < pushed - 0.1 and swing.time == 0 and len(server.list()) == before


# ---------------------------------------------------------------- linear models

def test_the_state_space_of_an_oscillator_answers_as_its_closed_form(server):
    with server.load_text(OSCILLATOR) as simulation:
        system = simulation.state_space("structural.1.load", ["node.structural.1.X"])
    along = system.only("node.structural.1.load[1]", "node.structural.1.X[1]")
    s = 2j * np.pi * np.array([0.1, 3.0, 30.0])
    assert along.response([0.1, 3.0, 30.0])[:, 0, 0] == pytest.approx(1 / (2 * s * s + 8 * s + 800), rel=1e-6)
    assert sorted(along.poles, key=np.imag) == pytest.approx([np.conj(S), S], abs=1e-6)
    gains = np.linspace(0, 4000, 9)
    for gain, poles in zip(gains, along.root_locus(gains)):  # 2 s^2 + 8 s + 800 + k = 0
        assert sorted(poles, key=np.imag) == pytest.approx(sorted(np.roots([2, 8, 800 + gain]), key=np.imag), rel=1e-6)
    with pytest.raises(ValueError, match="6 inputs and 3 outputs"):
        system.root_locus(gains)


def test_a_wing_has_twice_as_many_states_as_its_nodes_can_move(server):
    """Beams, whose unknowns differ in size by twelve orders."""
    with server.load(model("wing.mbd")) as simulation:
        system, values = simulation.state_space("structural.9.load", ["node.structural.9.X"]), simulation.eigenvalues(12, shift=5)
    assert len(system.A) == 2 * 6 * 8
    for value in values[values.imag > 0]:
        assert np.abs(system.poles - value).min() < 1e-6 * abs(value)


def test_modes_of_a_wing_are_ordered_and_scaled(server):
    with server.load(model("wing.mbd")) as simulation:
        modes = simulation.modes(8, shift=5)
    assert list(modes.frequencies_hz) == sorted(modes.frequencies_hz) and modes.shapes.shape == (len(modes), 9, 3)
    assert np.abs(modes.shapes).reshape(len(modes), -1).max(1) == pytest.approx(1)
    assert np.abs(modes.shape(1)[-1]).max() == pytest.approx(1) and np.abs(modes.shape(1)[0]).max() < 1e-9  # tip and clamped root
    with pytest.raises(IndexError, match="there is no mode 99"):
        modes.shape(99)


# ---------------------------------------------------------------- pictures

def test_pictures_and_films_are_written(swing, server, tmp_path):
    pytest.importorskip("matplotlib").use("Agg")
    from PIL import Image
    history = swing.simulate(until=0.4, every=4)
    history.plot("node.structural.2.X[3]", save=tmp_path / "h.png")
    history.animate(frames_per_second=10, save=str(tmp_path / "h.gif"))
    history.animate(frames_per_second=5, save=str(tmp_path / "h%02d.png"))
    with Image.open(tmp_path / "h.gif") as film:
        assert film.n_frames == 5
    assert sorted(path.name for path in tmp_path.glob("h0*.png")) == ["h00.png", "h01.png", "h02.png"]
    with server.load_text(OSCILLATOR) as simulation:
        along = simulation.state_space("structural.1.load", "node.structural.1.X").only("node.structural.1.load[1]", "node.structural.1.X[1]")
        simulation.modes().animate(1, frames=2, save=str(tmp_path / "m%d.png"))
    along.plot_bode(save=tmp_path / "b.png")
    along.plot_root_locus([0, 100, 1000], save=tmp_path / "r.png")
    for name in ("h.png", "b.png", "r.png", "m1.png"):
        assert (tmp_path / name).stat().st_size > 5000
    with pytest.raises(ValueError, match="view: no choice is called 'top'"):
        history.animate(view="top", save=str(tmp_path / "x.gif"))


def test_an_empty_picture_is_refused(swing):
    pytest.importorskip("matplotlib")
    with pytest.raises(ValueError, match="there is nothing to plot: the history has no variables"):
        swing.simulate([], steps=2).plot()
    with pytest.raises(ValueError, match="there is nothing to plot: `names` is empty"):
        swing.simulate(steps=2).plot([])
    for inputs, outputs in (("structural.2.load", []), ([], "node.structural.2.X")):
        with pytest.raises(ValueError, match="there is nothing to plot: no output .* answers an input"):
            swing.state_space(inputs, outputs).plot_bode()


def test_a_film_takes_a_path_and_tells_what_it_cannot_be(swing, tmp_path, monkeypatch):
    animation = pytest.importorskip("matplotlib.animation")
    monkeypatch.setattr(animation.writers, "is_available", lambda _: False)
    history = swing.simulate(until=0.2)
    history.animate(save=tmp_path / "film.gif", frames_per_second=5)
    history.animate(save=tmp_path / "frame%d.png", seconds=0.1, frames_per_second=10)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["film.gif", "frame0.png", "frame1.png"]
    with pytest.raises(ValueError, match="without ffmpeg films are GIFs, .* got 'film.mp4'"):
        history.animate(save="film.mp4")
    with pytest.raises(ValueError, match="lines: no choice is called 9; choose from 1, 2"):
        history.animate(lines=[(1, 9)])


@pytest.mark.parametrize("options, fault", [
    *(({name: value}, f"`{name}` must be a positive number, got {value!r}")
      for name in ("frames_per_second", "seconds") for value in (0, -1, float("nan"), float("inf"), "2")),
    ({"lines": (1, 2)}, "lines: each must be a list of labels, got 1 in its place")])
def test_a_film_that_cannot_be_is_refused(swing, options, fault):
    pytest.importorskip("matplotlib").use("Agg")
    with pytest.raises(ValueError, match=fault):
        swing.simulate(steps=4).animate(**options)


@pytest.mark.parametrize("options, fault", [
    *(({name: value}, f"`{name}` must be a positive number, got {value!r}") for name in ("frames_per_second", "scale") for value in (0, -1, float("nan"))),
    *(({"frames": count}, f"`frames` must be at least 2, got {count}") for count in (0, 1, -3))])
def test_a_film_of_a_mode_that_cannot_be_is_refused(server, options, fault):
    pytest.importorskip("matplotlib").use("Agg")
    with server.load_text(OSCILLATOR) as simulation, pytest.raises(ValueError, match=fault):
        simulation.modes().animate(1, **options)


def test_a_percent_sign_in_a_folder_is_no_number_of_a_picture(swing, tmp_path):
    pytest.importorskip("matplotlib").use("Agg")
    folder = tmp_path / "50%"
    folder.mkdir()
    swing.simulate(until=0.2).animate(save=folder / "film.gif", frames_per_second=5)
    swing.simulate(until=0.4).animate(save=folder / "f%02d.png", frames_per_second=5)
    assert sorted(path.name for path in folder.iterdir()) == ["f00.png", "f01.png", "film.gif"]


def test_a_bode_diagram_of_many_has_its_names_beside_it_and_no_noise(server, tmp_path):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")
    with server.load(model("wing.mbd")) as simulation:
        figure = simulation.state_space("structural.9.load", "node.structural.9.X").plot_bode(save=tmp_path / "b.png")
    upper, lower, names = figure.axes
    curves = [line.get_label().replace("node.structural.9.", "") for line in upper.lines]
    in_plane = [f"X[{i}] / load[{j}]" for i in (1, 2) for j in (1, 2, 6)]
    assert curves == [*in_plane, *(f"X[3] / load[{j}]" for j in (3, 4, 5))] and len(lower.lines) == 9
    assert len({(line.get_color(), line.get_linestyle()) for line in upper.lines}) == 9
    box = names.get_legend().get_window_extent()
    assert box.x0 > upper.get_window_extent().x1 and box.x1 < figure.bbox.x1 and figure.bbox.y0 < box.y0 < box.y1 < figure.bbox.y1
    pyplot.close("all")


def test_the_clients_version_is_that_of_the_server(server):
    assert mbcosim.__version__ == server.info().version
