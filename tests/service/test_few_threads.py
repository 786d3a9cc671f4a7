"""A system that grants few threads: a limit of an account's or a container's processes."""
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import threading

import pytest

from conftest import BIN, Daemon
from test_shared_memory import ask, knock

# The limit does not hold for root: it runs the daemon as an account that nothing else runs as.
ACCOUNT = {"user": 64999, "group": 64999, "extra_groups": []} if os.geteuid() == 0 else {}


@pytest.fixture
def folder():
    """A folder that the account may write to, with a daemon's program that it may execute."""
    path = tempfile.mkdtemp(prefix="mbcosim-")
    shutil.copy(os.path.join(BIN, "mbcosimd"), path)
    os.chmod(path, 0o777)
    try:
        subprocess.run([os.path.join(path, "mbcosimd"), "--version"], stdout=subprocess.DEVNULL, check=True, **ACCOUNT)
    except OSError as error:  # of a user namespace with one account, of a temporary folder that is private
        shutil.rmtree(path)
        pytest.skip(f"no other account can run the daemon here: {error}")
    yield path
    shutil.rmtree(path)


def limit_processes(count, pid=0):
    resource.prlimit(pid, resource.RLIMIT_NPROC, (count, count))


@pytest.mark.parametrize("count", [1, 9, 15, 20])
def test_too_few_to_start_are_told(folder, count):
    command = [os.path.join(folder, "mbcosimd"), "--listen", f"unix:{folder}/s"]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=60, **ACCOUNT,
                          preexec_fn=lambda: limit_processes(count))
    assert done.returncode == 4
    assert "too few threads (ulimit -u, a container's limit of processes, systemd's TasksMax)" in done.stderr


@pytest.fixture
def starved(folder):
    """A daemon that has come up and may start no thread any more."""
    daemon = Daemon(folder, "--http", "127.0.0.1:0", program=os.path.join(folder, "mbcosimd"), **ACCOUNT)
    daemon.page()
    script = f"import resource; resource.prlimit({daemon.process.pid}, resource.RLIMIT_NPROC, (1, 1))"
    subprocess.run([sys.executable, "-c", script], check=True, **ACCOUNT)
    yield daemon
    daemon.stop()


def test_a_daemon_that_gets_no_more_threads_serves_and_ends_in_order(starved, pendulum):
    with starved.connect() as server:
        simulations = [server.load(pendulum) for _ in range(8)]
        users = [threading.Thread(target=lambda s=s: s.step(200)) for s in simulations]
        for user in users:
            user.start()
        for user in users:
            user.join()
        assert [s.refresh().step for s in simulations] == [200] * 8
        with simulations[0].stepper() as stepper:
            assert stepper.step().step == 201
        with knock(starved) as peer:
            memory, status = ask(peer, b"")
            assert not memory and status.metadata["limit"] == "threads"
        assert simulations[1].step(3).step == 203
    starved.stop()
    assert "stopped" in starved.log()
