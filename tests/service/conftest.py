"""A real daemon for each test module, and the decks that tests run."""
import os
import re
import signal
import subprocess
import time

import pytest

import mbcosim
from relay import BlackHole

BIN = os.environ.get("MBCOSIM_BIN", os.path.join(os.path.dirname(__file__), "..", "..", "build", "bin"))
MODELS = os.path.join(os.path.dirname(__file__), "..", "..", "client_examples", "models")

# Bounds on time are multiplied by this: tests/run.sh sets it for sanitized programs, which are many times slower.
TIME_FACTOR = float(os.environ.get("MBCOSIM_TIME_FACTOR", "1"))


def is_sanitized():
    """A sanitizer has an allocator of its own."""
    listed = subprocess.run(["ldd", os.path.join(BIN, "mbcosimd")], stdout=subprocess.PIPE, text=True, check=True).stdout
    return "libasan" in listed or "libtsan" in listed


# Of a test of what the daemon's own allocator does: it counts memory, and ends the reading of decks.
counts_memory = pytest.mark.skipif(is_sanitized(), reason="a sanitizer's allocator takes the place of the daemon's")


def is_listening(path):
    """Does somebody accept connections at this Unix socket? Its file is there a moment before, and after a SIGKILL."""
    accepts = "00010000"  # __SO_ACCEPTCON of the kernel
    with open("/proc/net/unix") as sockets:
        return any(words[3] == accepts and words[-1] == path for words in map(str.split, sockets))


class Daemon:
    """A daemon on a socket of its own. Ends with SIGTERM and must then exit with 0. `process`: of Popen."""

    def __init__(self, folder, *options, program=os.path.join(BIN, "mbcosimd"), **process):
        self.address, self.killed = f"unix:{folder}/mbcosim.sock", False
        self.log_path = os.path.join(folder, "log")
        self._log = open(self.log_path, "ab")
        self._output_path = os.path.join(folder, "output")
        grace = [] if "--shutdown-grace" in options else ["--shutdown-grace", "1"]
        command = [program, "--listen", self.address, *grace, *options]
        with open(self._output_path, "wb") as output:
            self.process = subprocess.Popen(command, stdout=output, stderr=self._log, stdin=subprocess.DEVNULL, **process)
        wait_for(lambda: is_listening(self.address[len("unix:"):]) or not self.alive(), 30)

    def connect(self, **options):
        return mbcosim.connect(self.address, timeout=30, **options)

    def tcp_address(self):
        """HOST:PORT of the first address of that kind on which it listens."""
        def found():
            return re.search(r'listening on ((?!unix:)\S+:\d+)', self.log())

        wait_for(lambda: found() or not self.alive())
        return found().group(1)

    def alive(self):
        return self.process.poll() is None

    def page(self):
        """Address of the page, with its token, as the daemon prints it."""
        def line():
            with open(self._output_path) as file:
                return re.search(r"^page: (.*)\n", file.read())

        wait_for(lambda: line() or not self.alive())
        return line().group(1)

    def log(self):
        with open(self.log_path, errors="replace") as file:
            return file.read()

    def kill(self):
        """SIGKILL."""
        self.process.kill()
        self.process.wait(30 * TIME_FACTOR)
        self.killed = True

    def stop(self):
        if self.alive():
            self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(30 * TIME_FACTOR)
        self._log.close()
        assert code == 0 or self.killed, f"the daemon ended with {code}:\n{self.log()[-4000:]}"


@pytest.fixture
def start_daemon(tmp_path_factory):
    """Function that starts a daemon with options; all are stopped at the end of the test."""
    daemons = []

    def start(*options):
        daemons.append(Daemon(str(tmp_path_factory.mktemp("d")), *options))
        return daemons[-1]

    yield start
    for daemon in daemons:
        daemon.stop()


@pytest.fixture
def behind_a_proxy(start_daemon, monkeypatch):
    """A daemon at a TCP address of this machine, which the environment says a proxy leads to that is not there."""
    monkeypatch.setenv("http_proxy", "http://127.0.0.1:9")
    for name in ("no_proxy", "no_grpc_proxy"):
        monkeypatch.delenv(name, raising=False)
    return start_daemon("--listen", "127.0.0.1:0", "--insecure")


@pytest.fixture(scope="module")
def daemon(tmp_path_factory):
    """One daemon for the tests of a module."""
    running = Daemon(str(tmp_path_factory.mktemp("d")), "--model-root", MODELS)
    yield running
    running.stop()


@pytest.fixture
def server(daemon):
    """A connection to the module's daemon."""
    with daemon.connect() as connection:
        yield connection


@pytest.fixture
def tumbling():
    """Path of a deck: a free body that tumbles, 1000 steps."""
    return os.path.join(MODELS, "tumbling.mbd")


@pytest.fixture
def pendulum():
    """Path of a deck with joints and gravity, 1000 steps."""
    return os.path.join(MODELS, "pendulum.mbd")


def wait_for(condition, seconds=10):
    """Waits until `condition()` is true."""
    end = time.monotonic() + seconds * TIME_FACTOR
    while not condition():
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.01)


def stop(pid):
    """SIGSTOP, and every thread has obeyed."""
    def state(task):
        with open(f"/proc/{pid}/task/{task}/stat") as file:
            return file.read().rsplit(")", 1)[1].split()[0]

    os.kill(pid, signal.SIGSTOP)
    wait_for(lambda: all(state(task) == "T" for task in os.listdir(f"/proc/{pid}/task")))


@pytest.fixture(params=["stopped", "black hole", "killed"])
def falls_silent(request, tmp_path, start_daemon):
    """(address, function after which the server says nothing any more)"""
    daemon = start_daemon()
    if request.param == "stopped":
        yield daemon.address, lambda: stop(daemon.process.pid)
        os.kill(daemon.process.pid, signal.SIGCONT)
        return
    if request.param == "killed":
        yield daemon.address, daemon.kill
        return
    hole = BlackHole(str(tmp_path), daemon.address)
    yield hole.address, hole.fall_silent
    hole.close()


def redone_alike(simulation, before, steps, look):
    """Are `steps` steps after a restore those that followed the snapshot? `look()` tells what to compare."""
    simulation.step(before)
    saved = simulation.snapshot()
    simulation.step(steps)
    first = look()
    saved.restore()
    simulation.step(steps)
    return look() == first


def leaves_no_thread(daemon, cycle, first):
    """After four more cycles the daemon has no more threads than after the first ones."""
    def threads():
        return len(os.listdir(f"/proc/{daemon.process.pid}/task"))

    for _ in range(first):
        cycle()
    before = threads()
    for _ in range(4):
        cycle()
    wait_for(lambda: threads() <= before + 2)
