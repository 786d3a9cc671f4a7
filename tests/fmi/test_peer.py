"""`mbcosim peer`: FMUs and codes that speak MBDyn's protocol as peers of a daemon's simulation."""
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import zipfile
import zlib

import numpy as np
import pytest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "service"))
from conftest import BIN, MODELS, TIME_FACTOR, start_daemon  # noqa: E402,F401

import mbcosim  # noqa: E402

CART = os.path.join(MODELS, "pendulum_cart.mbd")
SENT = "node.structural.1.XP"
DESCRIPTION = {
    2: """<fmiModelDescription fmiVersion="2.0" modelName="c" guid="{{1}}"><CoSimulation modelIdentifier="c" canGetAndSetFMUstate="{state}"/>
<ModelVariables><ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
<ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>{extra}</ModelVariables><ModelStructure/></fmiModelDescription>""",
    3: """<fmiModelDescription fmiVersion="3.0" modelName="c" instantiationToken="{{1}}"><CoSimulation modelIdentifier="c" canGetAndSetFMUState="{state}"/>
<ModelVariables><Float64 name="u" valueReference="0" causality="input" start="0"/><Float64 name="y" valueReference="1" causality="output"/>
{extra}</ModelVariables><ModelStructure/></fmiModelDescription>"""}


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    """fmus(version, state, extra): path of the small FMU, with more variables."""
    folder, compiler = tmp_path_factory.mktemp("fmus"), shutil.which("cc") or shutil.which("gcc")

    def make(version, state="true", extra=""):
        path = folder / f"c{version}{state}{zlib.crc32(extra.encode())}.fmu"
        if not path.exists():
            library = str(folder / f"c{version}.so")
            subprocess.run([compiler, "-shared", "-fPIC", "-O1", f"-DFMI={version}", os.path.join(HERE, "controller.c"), "-o", library],
                           check=True)
            with zipfile.ZipFile(path, "w") as archive:
                archive.writestr("modelDescription.xml", DESCRIPTION[version].format(state=state, extra=extra))
                archive.write(library, "binaries/" + ("linux64" if version == 2 else "x86_64-linux") + "/c.so")
        return str(path)

    return make


class PeerProgram:
    def __init__(self, *arguments, **options):
        self.process = subprocess.Popen([os.path.join(BIN, "mbcosim"), "peer", *arguments], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True, **options)

    def first_line(self):
        return self.process.stdout.readline()

    def finish(self):
        _, self.errors = self.process.communicate(timeout=60 * TIME_FACTOR)
        return self.process.returncode


@pytest.fixture
def program():
    programs = []

    def start(*arguments, **options):
        programs.append(PeerProgram(*arguments, **options))
        return programs[-1]

    yield start
    for each in programs:
        if each.process.poll() is None:
            each.process.kill()
            each.process.communicate()


def signal_port():
    return mbcosim.signal_port("control", outputs=[SENT], inputs=["stream.force"])


def run_fmu(daemon, program, path, mode, steps=20, notes=None, pairs=(f"u={SENT}[1]", "y=stream.force")):
    """Time, speed and force after each step; what the peer notes is added to `notes`."""
    with daemon.connect() as server, server.load(CART, ports=[signal_port()]) as cart:
        peer = program("fmu", path, "--address", daemon.address, "--simulation", cart.name, "--port", "control", "--mode", mode,
                       *[word for pair in pairs for word in ("--map", pair)])
        assert "attached to port" in peer.first_line(), peer.finish() or peer.errors
        values = []
        for _ in range(steps):
            result = cart.step(1, outputs=[SENT, "stream.force"])
            assert result.outcome == "ACCEPTED", result
            values.append((result.time, result.values[SENT][0], float(np.atleast_1d(result.values["stream.force"])[0])))
    assert peer.finish() == 0, peer.errors
    if notes is not None:
        notes += peer.errors.splitlines()
    return values


@pytest.mark.parametrize("version", [2, 3])
def test_a_loose_fmu_integrates_what_it_was_sent(start_daemon, program, fmus, version):  # noqa: F811
    values = run_fmu(start_daemon(), program, fmus(version), "loose")
    for (t0, v0, f0), (t1, _, f1) in zip(values, values[1:]):
        assert f1 - f0 == pytest.approx((t1 - t0) * v0, rel=1e-6, abs=1e-15)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("mode", ["tight", "window"])
def test_implicit_fmus_go_back_within_a_step(start_daemon, program, fmus, version, mode):  # noqa: F811
    """The force at the end of each step belongs to the speed at its end: backward Euler, whatever the number of passes."""
    values = run_fmu(start_daemon(), program, fmus(version), mode)
    for (t0, _, f0), (t1, v1, f1) in zip(values, values[1:]):
        assert f1 - f0 == pytest.approx((t1 - t0) * v1, rel=1e-4, abs=1e-12)


def refused(daemon, program, *arguments):
    with daemon.connect() as server, server.load(CART, ports=[signal_port()]) as cart:
        peer = program(*arguments, "--address", daemon.address, "--simulation", cart.name, "--port", "control")
        assert peer.finish() == 4
        return peer.errors


def test_what_does_not_fit_is_refused(start_daemon, program, fmus, tmp_path):  # noqa: F811
    daemon = start_daemon()
    assert "explicit modes only" in refused(daemon, program, "fmu", fmus(3, "false"), "--mode", "tight", "--map", "y=stream.force")
    assert 'gives nothing for the signal "stream.force"' in refused(daemon, program, "fmu", fmus(3))
    assert 'has no real input or output "z"' in refused(daemon, program, "fmu", fmus(3), "--map", "z=stream.force")
    assert "no such file" in refused(daemon, program, "fmu", "nothing.fmu")
    (tmp_path / "x.fmu").write_text("no archive")
    assert "no zip archive" in refused(daemon, program, "fmu", str(tmp_path / "x.fmu"))
    with zipfile.ZipFile(tmp_path / "y.fmu", "w") as archive:
        archive.writestr("../outside", "")
    assert "leads out of it" in refused(daemon, program, "fmu", str(tmp_path / "y.fmu"))
    assert not (tmp_path / "outside").exists()
    for version, wanted in (2, "binaries/linux64/c.so"), (3, "binaries/x86_64-linux/c.so"):
        for there, others in ([], ""), (["win64/c.dll"], "; it has folders for win64"):
            with zipfile.ZipFile(tmp_path / "z.fmu", "w") as archive:
                archive.writestr("modelDescription.xml", DESCRIPTION[version].format(state="true", extra=""))
                for name in there:
                    archive.writestr("binaries/" + name, "")
            told = refused(daemon, program, "fmu", str(tmp_path / "z.fmu"))
            assert told == f'mbcosim peer: "{tmp_path / "z.fmu"}": it has no binary for this machine, {wanted}{others}\n'


# An input that sets the factor of y, an input of another type, and what needs no start value.
MORE = {2: """<ScalarVariable name="gain" valueReference="2" causality="input"><Real{start}/></ScalarVariable>
<ScalarVariable name="n" valueReference="7" causality="input"><Integer start="5"/></ScalarVariable>""",
        3: """<Float64 name="gain" valueReference="2" causality="input"{start}/><Int32 name="n" valueReference="7" causality="input" start="5"/>
<Clock name="tick" valueReference="8" causality="input" intervalVariability="triggered"/>"""}


@pytest.mark.parametrize("version", [2, 3])
def test_inputs_of_an_fmu_that_nothing_sets_keep_their_start_values_and_are_named(start_daemon, program, fmus, version):  # noqa: F811
    daemon, notes = start_daemon(), []
    more = run_fmu(daemon, program, fmus(version, extra=MORE[version].format(start=' start="1"')), "tight", notes=notes)
    assert notes == ['note: nothing sets the FMU\'s input "gain"; it keeps its start value 1',
                     'note: nothing sets the FMU\'s input "n"; it keeps its start value 5']
    assert more == run_fmu(daemon, program, fmus(version), "tight", notes=notes)
    assert len(notes) == 2


@pytest.mark.parametrize("version", [2, 3])
def test_an_input_with_neither_a_signal_nor_a_start_value_is_refused(start_daemon, program, fmus, version):  # noqa: F811
    daemon, path = start_daemon(), fmus(version, extra=MORE[version].format(start=""))
    told = refused(daemon, program, "fmu", path, "--map", f"u={SENT}[1]", "--map", "y=stream.force")
    assert 'the FMU\'s input "gain" has neither a signal nor a start value' in told and "--map gain=SIGNAL" in told
    told = refused(daemon, program, "fmu", path, "--map", f"n={SENT}[1]", "--map", "y=stream.force")
    assert 'the FMU has no real input or output "n"' in told


ARRAYS = """<Float64 name="us" valueReference="10" causality="input" start="{start}"><Dimension start="3"/></Float64>
<Float64 name="ys" valueReference="11" causality="output"><Dimension start="1"/><Dimension start="2"/></Float64>
<UInt64 name="n" valueReference="13" causality="structuralParameter" start="3"/>
<Float64 name="free" valueReference="10" causality="input" start="0 0 0"><Dimension valueReference="13"/></Float64>"""


@pytest.mark.parametrize("pairs, rate", [((f"us={SENT}", "ys[1]=stream.force"), lambda v: v),
                                         ((f"us[2]={SENT}[1]", "ys[2]=stream.force"), lambda v: 2 * (0.5 + 10 * v)),
                                         ((f"us[3]={SENT}[1]", f"u={SENT}[1]", "ys[1]=stream.force"), lambda v: 0.5 + 101 * v)])
def test_numbers_of_arrays_are_tied_one_by_one_or_together(start_daemon, program, fmus, pairs, rate):  # noqa: F811
    """Those that nothing sets keep their start values, here 0.5, 0, 0."""
    notes = []
    values = run_fmu(start_daemon(), program, fmus(3, extra=ARRAYS.format(start="0.5 0 0")), "loose", notes=notes, pairs=pairs)
    for (t0, v0, f0), (t1, _, f1) in zip(values, values[1:]):
        assert f1 - f0 == pytest.approx((t1 - t0) * rate(v0), rel=1e-6, abs=1e-14)
    assert values[-1][2] != 0
    told = 'note: nothing sets the FMU\'s input "{}"; it keeps its start value {}'
    expected = {} if pairs[0].startswith("us=") else {"us[1]": "0.5", "us[2]": "0", "us[3]": "0"}
    expected.pop(pairs[0].split("=")[0], None)
    unset = {"free": "0 0 0", **expected, **({} if pairs[1].startswith("u=") else {"u": "0"})}
    assert notes == [told.format(name, unset[name]) for name in sorted(unset)]


def test_arrays_that_do_not_fit_are_refused(start_daemon, program, fmus):  # noqa: F811
    daemon, good = start_daemon(), ARRAYS.format(start="0 0 0")

    def told(extra, *pairs):
        return refused(daemon, program, "fmu", fmus(3, extra=extra), *[word for pair in pairs for word in ("--map", pair)])

    assert 'the size of "free" follows from a structural parameter; arrays of fixed sizes are served' in told(good, f"free={SENT}")
    assert 'the FMU has no real input or output "us[4]"' in told(good, f"us[4]={SENT}[1]")
    assert 'the FMU has no real input or output "u[1]"' in told(good, f"u[1]={SENT}[1]")
    assert 'the port has no signal "stream.force[1]"' in told(good, "ys=stream.force")
    assert 'input "us" has 3 numbers, but its start values are "0 x 0"' in told(ARRAYS.format(start="0 x 0"), f"us[1]={SENT}[1]")
    assert 'input "us" has 3 numbers, but its start values are "0 0"' in told(ARRAYS.format(start="0 0"), f"us[1]={SENT}[1]")
    for size in ("0", "-1", "1000001", "3x", ""):
        wrong = good.replace('Dimension start="3"', f'Dimension start="{size}"')
        assert 'the dimensions of its variable "us" are not from 1 to a million' in told(wrong, f"us={SENT}")


def test_an_fmu_takes_part_in_signal_ports_only(start_daemon, program, fmus):  # noqa: F811
    daemon = start_daemon()
    with daemon.connect() as server, server.load(CART, ports=[mbcosim.structural_port("tip", nodes=[1])]) as cart:
        peer = program("fmu", fmus(3), "--address", daemon.address, "--simulation", cart.name, "--port", "tip")
        assert peer.finish() == 4 and 'port "tip" is no signal port: an FMU takes part in those only' in peer.errors


def test_the_daemon_of_a_peer_is_named_as_for_other_commands(start_daemon, program, fmus, tmp_path):  # noqa: F811
    """By options, or by the environment; a port of the wrong kind tells that the peer was let in."""
    tokens, secret, empty = (tmp_path / name for name in ("tokens", "secret", "empty"))
    tokens.write_text("a-good-token control one\n")
    tokens.chmod(0o600)
    secret.write_text("a-good-token\n")
    empty.write_text("\n")
    daemon = start_daemon("--tokens", str(tokens))
    with daemon.connect(token="a-good-token") as server, server.load(CART, ports=[mbcosim.structural_port("tip", nodes=[1])]) as cart:
        def told(*options, **environment):
            peer = program("fmu", fmus(3), "--simulation", cart.name, "--port", "tip", *options, env={**os.environ, **environment})
            assert peer.finish() == 4
            return peer.errors

        by_environment = {"MBCOSIM_ADDRESS": daemon.address, "MBCOSIM_TOKEN": "a-good-token"}
        assert "is no signal port" in told(**by_environment)
        assert "is no signal port" in told("--address", daemon.address, "--token", "a-good-token")
        assert "is no signal port" in told("--token-file", str(secret), **{**by_environment, "MBCOSIM_TOKEN": "another"})
        assert "unknown bearer token" in told("--token", "another", **by_environment)
        by_file = {"MBCOSIM_ADDRESS": daemon.address, "MBCOSIM_TOKEN_FILE": str(secret)}
        assert "is no signal port" in told(**by_file)
        assert "is no signal port" in told(**{**by_environment, "MBCOSIM_TOKEN_FILE": str(empty)})
        assert "is no signal port" in told("--token", "a-good-token", **{**by_file, "MBCOSIM_TOKEN_FILE": str(empty)})
        assert "unknown bearer token" in told("--token", "another", **by_file)
        assert f'there is no token in "{empty}"' in told("--token-file", str(empty), **by_environment)


LOADED = mbcosim.signal_port("control", outputs=["node.structural.1.load"], inputs=["stream.force"])


def fail_once(daemon, program, path, after):
    """`after(cart)` once the FMU has discarded a step; returns the program."""
    with daemon.connect() as server, server.load(CART, ports=[LOADED]) as cart:
        peer = program("fmu", path, "--address", daemon.address, "--simulation", cart.name, "--port", "control", "--mode", "loose",
                       "--map", "u=node.structural.1.load[3]", "--map", "y=stream.force")
        assert "attached" in peer.first_line()
        assert cart.step(1).outcome == "ACCEPTED"
        cart["node.structural.1.load"] = [0, 0, 2e6, 0, 0, 0]
        with pytest.raises(mbcosim.errors.StepFailed, match="the FMU discards the step"):
            cart.step(1)
        after(cart, peer)
    return peer


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_that_discards_a_step_fails_it_and_goes_on_from_its_state(start_daemon, program, fmus, version):  # noqa: F811
    def step_again(cart, _):
        before = np.ravel(cart["time"])[0]
        cart["node.structural.1.load"] = [0, 0, 3.0, 0, 0, 0]
        result = cart.step(1, outputs=["stream.force"])
        assert result.outcome == "ACCEPTED"
        assert np.ravel(result.values["stream.force"])[0] == pytest.approx(3.0 * (result.time - before), rel=1e-6)

    peer = fail_once(start_daemon(), program, fmus(version), step_again)
    assert peer.finish() == 0, peer.errors


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_that_discards_a_step_and_keeps_no_states_ends(start_daemon, program, fmus, version):  # noqa: F811
    def look(_, peer):
        assert peer.finish() == 5
        assert "the FMU discards the step; it keeps no states and cannot go on" in peer.errors

    fail_once(start_daemon(), program, fmus(version, "false"), look)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("mode, state", [("loose", "true"), ("loose", "false"), ("staggered", "true"), ("tight", "true"), ("window", "true")])
@pytest.mark.parametrize("reset", [False, True])
def test_an_fmu_that_cannot_follow_a_simulation_back_ends(start_daemon, program, fmus, version, mode, state, reset):  # noqa: F811
    daemon = start_daemon()
    with daemon.connect() as server, server.load(CART, ports=[signal_port()]) as cart:
        peer = program("fmu", fmus(version, state), "--address", daemon.address, "--simulation", cart.name, "--port", "control", "--mode", mode,
                       "--map", f"u={SENT}[1]", "--map", "y=stream.force")
        assert "attached" in peer.first_line()
        assert cart.step(2).outcome == "ACCEPTED"
        snapshot = cart.snapshot()
        assert cart.step(4).outcome == "ACCEPTED"
        cart.reset() if reset else cart.restore(snapshot)
        with pytest.raises(mbcosim.errors.StepFailed, match="the simulation went back to t = .*keeps no state of it; attach it anew"):
            cart.step(1)
        assert peer.finish() == 5
        assert "the simulation went back to t = " in peer.errors and ", the FMU stands at t = " in peer.errors


@pytest.mark.parametrize("mode", ["loose", "tight"])
def test_an_fmu_follows_a_simulation_back_by_the_one_step_that_it_keeps(start_daemon, program, fmus, mode):  # noqa: F811
    daemon = start_daemon()
    with daemon.connect() as server, server.load(CART, ports=[signal_port()]) as cart:
        peer = program("fmu", fmus(3), "--address", daemon.address, "--simulation", cart.name, "--port", "control", "--mode", mode,
                       "--map", f"u={SENT}[1]", "--map", "y=stream.force")
        assert "attached" in peer.first_line()
        cart.step(4)
        snapshot = cart.snapshot()
        first, = np.ravel(cart.step(1, outputs=["stream.force"]).values["stream.force"])
        cart.restore(snapshot)
        second, = np.ravel(cart.step(1, outputs=["stream.force"]).values["stream.force"])
        assert first != 0 and second == pytest.approx(first, rel=1e-6)
    assert peer.finish() == 0, peer.errors


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_removes_the_folder_of_an_fmu(start_daemon, program, fmus, tmp_path, sent):  # noqa: F811
    daemon = start_daemon()
    with daemon.connect() as server, server.load(CART, ports=[signal_port()]) as cart:
        peer = program("fmu", fmus(3), "--address", daemon.address, "--simulation", cart.name, "--port", "control", "--map", f"u={SENT}[1]",
                       "--map", "y=stream.force", env={**os.environ, "TMPDIR": str(tmp_path)})
        assert "attached" in peer.first_line()
        assert list(tmp_path.glob("mbcosim-fmu-*"))
        peer.process.send_signal(sent)
        assert peer.finish() == 130
        assert not list(tmp_path.glob("mbcosim-fmu-*"))


@pytest.mark.parametrize("standard", [2, 3])
def test_the_folder_of_an_fmu_may_have_any_name(start_daemon, program, fmus, tmp_path, standard):  # noqa: F811
    """FMI 2 names it by a URI."""
    folder = tmp_path / "50%25 of a b#ü?"
    folder.mkdir()
    daemon = start_daemon()
    with daemon.connect() as server, server.load(CART, ports=[signal_port()]) as cart:
        peer = program("fmu", fmus(standard), "--address", daemon.address, "--simulation", cart.name, "--port", "control",
                       "--map", f"u={SENT}[1]", "--map", "y=stream.force", env={**os.environ, "TMPDIR": str(folder)})
        assert "attached" in peer.first_line(), peer.errors
        assert cart.step(2).outcome == "ACCEPTED"
    assert peer.finish() == 0, peer.errors


def test_a_lost_daemon_is_told(start_daemon, program, fmus):  # noqa: F811
    daemon = start_daemon()
    cart = daemon.connect().load(CART, ports=[signal_port()])
    peer = program("fmu", fmus(3), "--address", daemon.address, "--simulation", cart.name, "--port", "control", "--map", f"u={SENT}[1]",
                   "--map", "y=stream.force")
    assert "attached" in peer.first_line()
    assert cart.step(1).outcome == "ACCEPTED"
    daemon.kill()
    assert peer.finish() == 5, peer.errors
    assert "the connection to the simulation is lost: " in peer.errors


# ------------------------------------------------------------------ MBDyn's protocol

def receive(peer, size):
    data = b""
    while len(data) < size:
        more = peer.recv(size - len(data))
        assert more, "closed"
        data += more
    return data


def send_what_is_taken(peer, data):
    """The other side may close before all of it is sent."""
    try:
        peer.sendall(data)
    except (BrokenPipeError, ConnectionResetError):
        pass


def connect(path):
    end = time.monotonic() + 20 * TIME_FACTOR
    while True:
        peer = socket.socket(socket.AF_UNIX)
        try:
            peer.connect(path)
            peer.settimeout(20 * TIME_FACTOR)
            return peer
        except OSError:
            peer.close()
            assert time.monotonic() < end
            time.sleep(0.02)


@pytest.mark.parametrize("mode", ["loose", "tight"])
def test_a_code_of_mbdyn_couples_with_a_daemon(start_daemon, program, tmp_path, mode):  # noqa: F811
    """A constant load through the gateway acts as the same load written by the client."""
    daemon, path = start_daemon(), str(tmp_path / "s")
    load = np.array([0, 3.0, 0]).tobytes() + bytes(24)
    ports = [mbcosim.structural_port("tip", nodes=[2])]
    deck = os.path.join(MODELS, "pendulum.mbd")
    with daemon.connect() as server, server.load(deck, ports=ports) as pendulum, server.load(deck) as alone:
        gateway = program("socket", "--protocol", "mbdyn", "--listen", f"unix:{path}", "--mode", mode, "--address", daemon.address,
                          "--simulation", pendulum.name, "--port", "tip")
        code = connect(path)
        code.sendall(b"\7" + struct.pack("<II", 0x202, 1))
        assert receive(code, 1) == b"\10"
        alone["node.structural.2.load"] = [0, 3.0, 0, 0, 0, 0]
        results = []
        stepping = threading.Thread(target=lambda: results.append(pendulum.step(5, outputs=["node.structural.2.X"])))
        stepping.start()
        steps = 0
        while steps < 5:
            command = receive(code, 1)
            assert command == (b"\6" if mode == "loose" else b"\2")
            receive(code, 144)
            code.sendall(b"\6" + load)
            steps += 1
        stepping.join()
        expected = alone.step(5, outputs=["node.structural.2.X"]).values["node.structural.2.X"]
        assert results[0].values["node.structural.2.X"] == pytest.approx(expected, abs=1e-12)
    assert receive(code, 1) == b"\5"
    assert gateway.finish() == 0


def test_a_silent_code_fails_the_step_and_is_named(start_daemon, program, tmp_path):  # noqa: F811
    daemon, path = start_daemon(), str(tmp_path / "s")
    with daemon.connect() as server, server.load(os.path.join(MODELS, "pendulum.mbd"),
                                                 ports=[mbcosim.structural_port("tip", nodes=[2])]) as pendulum:
        gateway = program("socket", "--protocol", "mbdyn", "--listen", f"unix:{path}", "--peer-timeout", "1", "--address", daemon.address,
                          "--simulation", pendulum.name, "--port", "tip")
        code = connect(path)
        code.sendall(b"\7" + struct.pack("<II", 0x202, 1))
        assert receive(code, 1) == b"\10"
        with pytest.raises(mbcosim.errors.StepFailed, match="silent for 1 s"):
            pendulum.step(1)
        assert gateway.finish() == 5
        assert "silent for 1 s" in gateway.errors


@pytest.mark.parametrize("surplus", [1, 1 << 20])
def test_answers_that_are_too_long_fail_the_next_step_and_are_named(start_daemon, program, tmp_path, surplus):  # noqa: F811
    daemon, path = start_daemon(), str(tmp_path / "s")
    with daemon.connect() as server, server.load(os.path.join(MODELS, "pendulum.mbd"),
                                                 ports=[mbcosim.structural_port("tip", nodes=[2])]) as pendulum:
        gateway = program("socket", "--protocol", "mbdyn", "--listen", f"unix:{path}", "--mode", "loose", "--address", daemon.address,
                          "--simulation", pendulum.name, "--port", "tip")
        code = connect(path)
        code.sendall(b"\7" + struct.pack("<II", 0x202, 1))
        assert receive(code, 1) == b"\10"
        sending = threading.Thread(target=send_what_is_taken, args=(code, b"\6" + bytes(48 + surplus)))
        sending.start()
        assert pendulum.step(1).outcome == "ACCEPTED"
        with pytest.raises(mbcosim.errors.StepFailed, match="unknown command 0 from the peer"):
            pendulum.step(1)
        assert gateway.finish() == 5
        assert "unknown command 0 from the peer" in gateway.errors
        sending.join(60 * TIME_FACTOR)
        assert not sending.is_alive()
