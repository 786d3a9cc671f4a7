"""Three daemons behind HAProxy with docker/haproxy.cfg: simulations spread evenly, calls find theirs, a killed daemon's come back."""
import os
import re
import shutil
import signal
import socket
import subprocess
import threading

import pytest

import mbcosim
from conftest import BIN, TIME_FACTOR, Daemon, wait_for
from mbcosim.v1 import simulations_pb2 as pb
from test_durable import bits, deck

ROOT = os.path.join(os.path.dirname(__file__), "..", "..")
IDS = ("a", "b", "c")
COUNT = 100


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def listens(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


class Cluster:
    """The proxy, and daemons that can be killed and started again on their folders."""

    def __init__(self, folder):
        self.folder, self.daemons = folder, {}
        self.ports = {id: (free_port(), free_port()) for id in IDS}
        for id in IDS:
            (folder / f"state-{id}").mkdir()
            self.start(id)
        self.port = free_port()
        with open(os.path.join(ROOT, "docker", "haproxy.cfg")) as file:
            text = file.read().replace("bind :50050", f"bind 127.0.0.1:{self.port}")
        for id, (grpc_port, http_port) in self.ports.items():
            text = text.replace(f"mbcosimd-{id}:50051 no-check", f"127.0.0.1:{grpc_port} no-check")
            text = text.replace(f"mbcosimd-{id}:50051", f"127.0.0.1:{grpc_port} check port {http_port}")
        (folder / "haproxy.cfg").write_text(text)
        self.proxy = subprocess.Popen(["haproxy", "-f", str(folder / "haproxy.cfg")], stdout=subprocess.DEVNULL, stderr=open(folder / "haproxy.log", "wb"))
        wait_for(lambda: listens(self.port))

    def start(self, id):
        own = self.folder / f"run-{id}-{len(os.listdir(self.folder))}"
        own.mkdir()
        grpc_port, http_port = self.ports[id]
        self.daemons[id] = Daemon(str(own), "--listen", f"127.0.0.1:{grpc_port}", "--http", f"127.0.0.1:{http_port}", "--insecure", "--daemon-id", id,
                                  "--state-dir", str(self.folder / f"state-{id}"), "--drain", "60", "--limit-sessions", "200", "--limit-identity-sessions", "200")

    def connect(self, **options):
        return mbcosim.connect(f"127.0.0.1:{self.port}", timeout=30 * TIME_FACTOR, **options)

    def stop(self):
        self.proxy.terminate()
        self.proxy.wait(30)
        for daemon in self.daemons.values():
            wait_for(lambda: self._ends(daemon), 30)
            daemon.stop()

    @staticmethod
    def _ends(daemon):
        """The first SIGTERM begins to drain, the next one ends that; two that are pending at once count as one."""
        if daemon.process.poll() is None:
            daemon.process.send_signal(signal.SIGTERM)
        return daemon.process.poll() is not None


@pytest.fixture
def cluster(tmp_path):
    if not shutil.which("haproxy"):
        pytest.fail("haproxy is missing: docker/install-dependencies.sh test")
    running = Cluster(tmp_path)
    yield running
    running.stop()


def daemon_of(simulation):
    return re.fullmatch(r"simulations/([a-z0-9]+)-[0-9a-f]+", simulation.name).group(1)


def test_simulations_spread_and_those_of_a_killed_daemon_come_back(cluster):
    with cluster.connect(reconnect=60 * TIME_FACTOR) as server:
        with server.load_text(deck(), durability="none") as straight:
            straight.step(30)
            expected = bits(straight)
        simulations = [server.load_text(deck(), durability="journal") for _ in range(COUNT)]
        counts = [sum(daemon_of(s) == id for s in simulations) for id in IDS]
        assert max(counts) - min(counts) <= 4, counts
        for simulation in simulations:
            assert simulation.step(10).step == 10
        cluster.daemons["b"].kill()
        for simulation in simulations:
            if daemon_of(simulation) != "b":
                assert simulation.step(10).step == 20  # nothing has happened to them
        lost = [s for s in simulations if daemon_of(s) == "b"]
        with pytest.raises(mbcosim.Unavailable):  # nobody else answers for them
            with cluster.connect() as hasty:
                hasty.attach(lost[0].name).read(["step"])
        back = threading.Timer(1.0, cluster.start, ["b"])
        back.start()
        for simulation in lost:
            assert simulation.read(["step"])["step"] == 10  # waits for its daemon
            simulation.step(10)
        back.join()
        for simulation in simulations:
            simulation.step(10)
            assert bits(simulation) == expected


def test_new_simulations_keep_away_from_a_daemon_that_drains(cluster):
    with cluster.connect() as server:
        placed = [server.load_text(deck(), durability="none") for _ in range(9)]
        staying = next(s for s in placed if daemon_of(s) == "a")
        cluster.daemons["a"].process.send_signal(signal.SIGTERM)
        wait_for(lambda: all(daemon_of(server.load_text(deck(), durability="none")) != "a" for _ in range(6)), 10)
        assert staying.step(10).step == 10
        assert cluster.daemons["a"].alive()


def test_quick_steps_of_the_cpp_client_find_their_daemons(cluster, tmp_path):
    run = subprocess.run([os.path.join(BIN, "client_tests"), "--gtest_brief=1", "--gtest_filter=ABalancer.*"], timeout=100 * TIME_FACTOR, text=True, cwd=tmp_path,
                         env={**os.environ, "MBCOSIM_ADDRESS": f"127.0.0.1:{cluster.port}", "MBCOSIM_BALANCED": "1"}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert run.returncode == 0 and "1 test from" in run.stdout and "SKIPPED" not in run.stdout, run.stdout
