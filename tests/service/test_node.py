"""The client for Node: its own tests, against a real daemon, with the packages of its lock file."""
import functools
import os
import shutil
import subprocess

import pytest

from conftest import MODELS, TIME_FACTOR, Daemon, wait_for

ROOT = os.path.join(MODELS, "..", "..")


@pytest.fixture(scope="module")
def node_client(tmp_path_factory):
    """Folder of the client with its packages."""
    if shutil.which("npm") is None:
        pytest.skip("there is no npm")
    source, folder = os.path.join(ROOT, "client_examples", "node"), str(tmp_path_factory.mktemp("node") / "client")
    shutil.copytree(source, folder, ignore=shutil.ignore_patterns("node_modules"))
    subprocess.run(["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts"], cwd=folder, check=True, timeout=120 * TIME_FACTOR,
                   stdout=subprocess.DEVNULL)
    return folder


def run(command, folder, daemon):
    environment = {**os.environ, "MBCOSIM_ADDRESS": daemon.address, "MBCOSIM_PROTOS": os.path.realpath(os.path.join(ROOT, "proto"))}
    done = subprocess.run(command, cwd=folder, env=environment, timeout=60 * TIME_FACTOR, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT)
    assert done.returncode == 0, done.stdout
    return done.stdout


def test_its_own_tests(node_client, daemon):
    output = run(["node", "--test", "test/"], node_client, daemon)
    assert "fail 0" in output and "pass 12" in output


@pytest.mark.parametrize("reconnect", [60, 0])
def test_calls_wait_for_a_daemon_that_comes_back_where_that_is_wanted(node_client, tmp_path, reconnect):
    shutil.copy(os.path.join(os.path.dirname(__file__), "node_restart.mjs"), node_client)
    (tmp_path / "state").mkdir()
    start = functools.partial(Daemon, str(tmp_path), "--state-dir", str(tmp_path / "state"))
    wanted, daemon = tmp_path / "kill", start()
    environment = {**os.environ, "MBCOSIM_ADDRESS": daemon.address, "MBCOSIM_PROTOS": os.path.realpath(os.path.join(ROOT, "proto")),
                   "MBCOSIM_KILL": str(wanted), "MBCOSIM_RECONNECT": str(reconnect * TIME_FACTOR)}
    client = subprocess.Popen(["node", "node_restart.mjs"], cwd=node_client, env=environment, text=True, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT)
    try:
        wait_for(lambda: wanted.exists() or client.poll() is not None, 60)
        daemon.kill()
        if reconnect:
            daemon = start()
            wanted.unlink(missing_ok=True)
        output, _ = client.communicate(timeout=200 * TIME_FACTOR)
    finally:
        client.kill()
        daemon.stop()
    assert (client.returncode == 0) == (reconnect > 0), output
    assert reconnect or "UNAVAILABLE" in output


def test_the_example_follows_the_pendulum(node_client, daemon):
    shutil.copytree(MODELS, os.path.join(node_client, "..", "models"))
    lines = run(["node", "pendulum.mjs"], node_client, daemon).splitlines()
    assert len(lines) == 5 and lines[-1].startswith("2.500 s: ")


def test_no_proxy_of_the_environment_is_asked_for_this_machine(node_client, behind_a_proxy):
    ask = f"""import {{ call, connect }} from "./mbcosim.mjs";
              const server = connect("{behind_a_proxy.tcp_address()}");
              console.log((await call(server, server.simulations, "GetServerInfo", {{}}, 10)).version);
              server.close();"""
    assert run(["node", "--input-type=module", "--eval", ask], node_client, behind_a_proxy).strip()


def test_the_lock_file_names_no_host():
    with open(os.path.join(ROOT, "client_examples", "node", "package-lock.json"), encoding="utf-8") as file:
        assert "http" not in "".join(line for line in file if "resolved" in line or "registry" in line)
