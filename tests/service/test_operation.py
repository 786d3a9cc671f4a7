"""What an operator relies on: tokens and certificates that are read anew, draining, systemd's notices, health over TLS, metrics."""
import os
import re
import signal
import socket
import ssl
import subprocess
import time
import urllib.error
import urllib.request

import grpc
import numpy as np
import pytest

import decks
import mbcosim
from conftest import TIME_FACTOR, wait_for
from mbcosim.v1 import simulations_pb2 as pb
from test_health import DAEMON, certificate, health

ECHO = [mbcosim.structural_port("hand", nodes=[1])]


def tokens_file(path, *lines):
    path.write_text("".join(line + "\n" for line in lines))
    path.chmod(0o600)


def identity(daemon, token):
    try:
        with daemon.connect(token=token) as server:
            return server.info().identity
    except mbcosim.Error:
        return None


@pytest.mark.parametrize("spoil", ["a folder", "not UTF-8"])
def test_tokens_that_cannot_be_read_leave_those_before_in_force(start_daemon, tmp_path, spoil):
    file = tmp_path / "tokens"
    tokens_file(file, "first-token control one")
    daemon = start_daemon("--tokens", str(file))
    if spoil == "a folder":  # which an engine of containers makes where a file to mount is missing
        file.unlink()
        file.mkdir()
        told = "is a folder"
    else:
        file.write_bytes(b"first-token control one\nother-token control jos\xe9\n")
        told = "tokens file, line 2: the name is not UTF-8"
    wait_for(lambda: told in daemon.log())
    assert identity(daemon, "first-token") == "token:one" and identity(daemon, "other-token") is None


def test_tokens_are_read_when_their_rights_are_mended(start_daemon, tmp_path):
    file = tmp_path / "tokens"
    tokens_file(file, "first-token control one")
    daemon = start_daemon("--tokens", str(file))
    tokens_file(file, "second-token control two")
    file.chmod(0o666)
    wait_for(lambda: "others than its owner may write the tokens file" in daemon.log())
    file.chmod(0o600)
    wait_for(lambda: identity(daemon, "second-token") == "token:two")


@pytest.mark.parametrize("asked", [True, False], ids=["SIGHUP", "change"])
def test_tokens_are_read_anew(start_daemon, tmp_path, asked):
    file = tmp_path / "tokens"
    tokens_file(file, "first-token control one")
    daemon = start_daemon("--tokens", str(file))
    assert (identity(daemon, "first-token"), identity(daemon, "second-token")) == ("token:one", None)
    with daemon.connect(token="first-token") as server:
        simulation = server.load_text(decks.body())
        tokens_file(file, "second-token control two", "third-token control one")
        if asked:
            daemon.process.send_signal(signal.SIGHUP)
        wait_for(lambda: identity(daemon, "second-token") == "token:two")
        assert identity(daemon, "first-token") is None
        with daemon.connect(token="third-token") as again:
            assert again.attach(simulation.name).step().step == 1  # the same identity, another token
    tokens_file(file, "second-token nonsense two")
    daemon.process.send_signal(signal.SIGHUP)
    wait_for(lambda: 'role "nonsense" is none of observe, control, admin; what was there before stays in force' in daemon.log())
    assert identity(daemon, "second-token") == "token:two"


def shown(address, ca):
    """Serial number of the certificate that the daemon shows."""
    context = ssl.create_default_context(cafile=ca)
    context.set_alpn_protocols(["h2"])
    host, port = address.rsplit(":", 1)
    try:
        with context.wrap_socket(socket.create_connection((host, int(port)), 5), server_hostname=host) as secured:
            return secured.getpeercert()["serialNumber"]
    except OSError:
        return None


def daemon_with_tls(start_daemon, tmp_path, *options):
    """A daemon, and its address."""
    certificate(tmp_path, "ca", "/CN=authority")
    certificate(tmp_path, "server", "/CN=localhost", "ca", ["-addext", "subjectAltName=DNS:localhost"])
    daemon = start_daemon("--listen", "localhost:0", "--tls-certificate", str(tmp_path / "server.pem"), "--tls-key",
                          str(tmp_path / "server.key"), *options)
    return daemon, daemon.tcp_address()


@pytest.fixture
def secured(start_daemon, tmp_path):
    """A daemon that asks for certificates, and its address."""
    return daemon_with_tls(start_daemon, tmp_path, "--tls-client-ca", str(tmp_path / "ca.pem"))


def test_a_new_certificate_is_shown_without_a_restart(secured, tmp_path):
    daemon, address = secured
    pem, key = certificate(tmp_path, "client", "/CN=arm", "ca")
    credentials = grpc.ssl_channel_credentials((tmp_path / "ca.pem").read_bytes(), key, pem)
    first = shown(address, tmp_path / "ca.pem")
    with mbcosim.connect(address, credentials=credentials) as server, server.load_text(decks.body()) as simulation:
        certificate(tmp_path, "next", "/CN=localhost", "ca", ["-addext", "subjectAltName=DNS:localhost"])
        for ending in ("key", "pem"):
            os.replace(tmp_path / f"next.{ending}", tmp_path / f"server.{ending}")
        wait_for(lambda: shown(address, tmp_path / "ca.pem") not in (None, first), 20)
        assert simulation.step().step == 1  # connections that are open go on
    with mbcosim.connect(address, credentials=credentials) as server:
        assert server.info().identity == "cert:CN=arm"


def test_a_new_key_that_does_not_fit_is_named_and_the_old_pair_stays(secured, tmp_path):
    daemon, address = secured
    first = shown(address, tmp_path / "ca.pem")
    certificate(tmp_path, "next", "/CN=localhost", "ca", ["-addext", "subjectAltName=DNS:localhost"])
    os.replace(tmp_path / "next.key", tmp_path / "server.key")
    wait_for(lambda: f"the key in {tmp_path}/server.key is not that of the certificate in {tmp_path}/server.pem; what was there before stays"
             in daemon.log())
    for _ in range(5):
        assert shown(address, tmp_path / "ca.pem") == first
        time.sleep(0.5)
    os.replace(tmp_path / "next.pem", tmp_path / "server.pem")
    daemon.process.send_signal(signal.SIGHUP)
    wait_for(lambda: shown(address, tmp_path / "ca.pem") not in (None, first), 20)


def test_a_new_authority_of_the_clients_counts_from_then_on(secured, tmp_path):
    daemon, address = secured
    authority = (tmp_path / "ca.pem").read_bytes()
    certificate(tmp_path, "other", "/CN=another authority")
    pem, key = certificate(tmp_path, "client", "/CN=arm", "other")
    credentials = grpc.ssl_channel_credentials(authority, key, pem)

    def is_let_in():
        with grpc.secure_channel(address, credentials, options=[("grpc.use_local_subchannel_pool", 1)]) as channel:
            try:
                return health(channel) == 1
            except grpc.RpcError:
                return False

    assert not is_let_in()
    os.replace(tmp_path / "other.pem", tmp_path / "ca.pem")
    wait_for(is_let_in, 20)


def test_a_key_of_another_certificate_is_refused_at_the_start(tmp_path):
    for name in ("one", "two"):
        certificate(tmp_path, name, "/CN=localhost")
    run = subprocess.run([DAEMON, "--listen", f"unix:{tmp_path}/socket", "--listen", "localhost:0", "--tls-certificate",
                          str(tmp_path / "one.pem"), "--tls-key", str(tmp_path / "two.key"), "--tls-client-ca", str(tmp_path / "one.pem")],
                         stderr=subprocess.PIPE, text=True, timeout=30 * TIME_FACTOR)
    assert run.returncode == 4 and f"the key in {tmp_path}/two.key is not that of the certificate in {tmp_path}/one.pem" in run.stderr


def check(*arguments):
    return subprocess.run([DAEMON, "--check", *map(str, arguments)], timeout=30 * TIME_FACTOR).returncode


def test_the_commands_reach_a_daemon_over_tls(secured, tmp_path):
    daemon, address = secured
    certificate(tmp_path, "client", "/CN=arm", "ca")
    files = {"--ca": "ca.pem", "--certificate": "client.pem", "--key": "client.key"}

    def sessions(files, *options, **environment):
        arguments = [*options, *(word for option, file in files.items() for word in (option, str(tmp_path / file)))]
        return subprocess.run([os.path.join(os.path.dirname(DAEMON), "mbcosim"), "sessions", "--address", address, *arguments],
                              env={**os.environ, **environment}, capture_output=True, text=True, timeout=30 * TIME_FACTOR)

    variables = {"MBCOSIM_TLS_CA": "ca.pem", "MBCOSIM_TLS_CERTIFICATE": "client.pem", "MBCOSIM_TLS_KEY": "client.key"}
    variables = {name: str(tmp_path / file) for name, file in variables.items()}
    for done in (sessions(files), sessions({}, **variables), sessions({"--ca": "ca.pem"}, **{**variables, "MBCOSIM_TLS_CA": "none.pem"})):
        assert done.returncode == 0 and done.stdout.startswith("simulation"), done
    for missing in (sessions({**files, "--ca": "none.pem"}), sessions({}, **{**variables, "MBCOSIM_TLS_CA": "none.pem"})):
        assert missing.returncode == 4 and "none.pem" in missing.stderr and missing.stdout == ""
    without_key = sessions({"--ca": "ca.pem", "--certificate": "client.pem"})
    assert without_key.returncode == 4 and "belong together" in without_key.stderr, without_key
    # Without an authority it is TLS all the same, and those count that this machine trusts.
    own = {"--certificate": "client.pem", "--key": "client.key"}
    untrusted = sessions(own, "--timeout", "1")
    assert untrusted.returncode == 4 and "no server answers at " + address in untrusted.stderr and "certificate verify failed" in untrusted.stderr.rpartition("no server")[2].lower(), untrusted
    assert sessions(own, GRPC_DEFAULT_SSL_ROOTS_FILE_PATH=str(tmp_path / "ca.pem")).returncode == 0


def test_the_commands_trust_who_this_machine_trusts(start_daemon, tmp_path):
    _, address = daemon_with_tls(start_daemon, tmp_path, "--insecure")

    def sessions(*options, **environment):
        return subprocess.run([os.path.join(os.path.dirname(DAEMON), "mbcosim"), "sessions", "--address", address, "--timeout", "2", *options],
                              env={**os.environ, "GRPC_DEFAULT_SSL_ROOTS_FILE_PATH": str(tmp_path / "ca.pem"), **environment},
                              capture_output=True, text=True, timeout=30 * TIME_FACTOR)

    for done in (sessions("--tls"), sessions(MBCOSIM_TLS="1")):
        assert done.returncode == 0 and done.stdout.startswith("simulation"), done
    for plain in (sessions(), sessions(MBCOSIM_TLS="0"), sessions(MBCOSIM_TLS="")):
        assert plain.returncode == 4, plain


def test_health_is_asked_over_tls(secured, tmp_path):
    daemon, address = secured
    certificate(tmp_path, "client", "/CN=probe", "ca")
    own = ["--check-certificate", tmp_path / "client.pem", "--check-key", tmp_path / "client.key"]
    assert check(address, "--check-ca", tmp_path / "ca.pem", *own) == 0
    assert check(address.replace("localhost", "127.0.0.1"), "--check-ca", tmp_path / "ca.pem", "--check-name", "localhost", *own) == 0
    assert check(address.replace("localhost", "127.0.0.1"), "--check-ca", tmp_path / "ca.pem", *own) == 1  # another name
    assert check(address, "--check-ca", tmp_path / "client.pem", *own) == 1  # another authority
    assert check(address, "--check-ca", tmp_path / "ca.pem") == 1  # no certificate of its own
    assert check(address) == 1  # no TLS


def test_draining_serves_and_says_that_it_will_not(start_daemon):
    daemon = start_daemon("--drain", "60", "--http", "127.0.0.1:0")
    ready = re.search(r"http://[^/]+", daemon.page()).group(0) + "/readyz"
    with daemon.connect() as server, grpc.insecure_channel(daemon.address) as channel:
        simulation = server.load_text(decks.body())
        assert health(channel) == 1 and urllib.request.urlopen(ready).status == 200
        daemon.process.send_signal(signal.SIGTERM)
        wait_for(lambda: health(channel) == 2)
        with pytest.raises(urllib.error.HTTPError, match="503"):
            urllib.request.urlopen(ready)
        assert check(daemon.address) == 1 and check(daemon.address, "--check-alive") == 0
        assert simulation.step(10).step == 10
        assert daemon.alive()
    daemon.process.send_signal(signal.SIGTERM)  # no more patience
    assert daemon.process.wait(20 * TIME_FACTOR) == 0


def test_systemd_is_told(tmp_path, start_daemon, monkeypatch):
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notices:
        notices.bind(path)
        notices.settimeout(30 * TIME_FACTOR)
        monkeypatch.setenv("NOTIFY_SOCKET", path)
        daemon = start_daemon()
        assert notices.recv(1000) == b"READY=1"
        before = time.clock_gettime_ns(time.CLOCK_MONOTONIC) // 1000
        daemon.process.send_signal(signal.SIGHUP)
        reloading = re.fullmatch(rb"RELOADING=1\nMONOTONIC_USEC=(\d+)", notices.recv(1000))
        assert before <= int(reloading.group(1)) <= time.clock_gettime_ns(time.CLOCK_MONOTONIC) // 1000
        assert notices.recv(1000) == b"READY=1"
        daemon.process.send_signal(signal.SIGTERM)
        assert notices.recv(1000) == b"STOPPING=1"
        assert daemon.process.wait(20 * TIME_FACTOR) == 0


def metrics(daemon, token=None):
    """Value by name, labels included. `token`: other than the page's."""
    address, of_page = re.search(r"(http://[^/]+)/(?:\?token=(\S+))?", daemon.page()).groups()
    token = token or of_page
    request = urllib.request.Request(address + "/metrics", headers={"Authorization": f"Bearer {token}"} if token else {})
    lines = urllib.request.urlopen(request).read().decode().splitlines()
    return {line.rsplit(" ", 1)[0]: float(line.rsplit(" ", 1)[1]) for line in lines if line and line[0] != "#"}


def test_metrics_tell_of_peers_queues_and_the_disk(start_daemon, tmp_path):
    (tmp_path / "state").mkdir()
    daemon = start_daemon("--state-dir", str(tmp_path / "state"), "--http", "127.0.0.1:0")
    with daemon.connect() as server:
        simulation = server.load_text(decks.body(), ports=ECHO, durability="journal")

        def slow(motion):
            time.sleep(0.02)
            return np.zeros((1, 3))

        with simulation.couple("hand", slow):
            simulation.step(5)
            found = metrics(daemon)
    assert found['mbcosim_exchange_seconds_count'] == found['mbcosim_peer_wait_seconds_count'] == 5
    assert 0.1 <= found['mbcosim_exchange_seconds_sum'] <= found['mbcosim_peer_wait_seconds_sum']
    assert found['mbcosim_journal_seconds_count'] >= 5 and found['mbcosim_journal_bytes_total'] > 1000
    assert found['mbcosim_checkpoint_bytes_total'] > 500 and found['mbcosim_state_bytes'] > 1000
    assert found['mbcosim_slot_wait_seconds_count'] >= 5
    assert found['mbcosim_queue_wait_seconds_count{queue="advance"}'] >= 1
    assert found['mbcosim_open_calls'] >= 1 and 0 < found['mbcosim_memory_bytes'] < found['mbcosim_memory_limit_bytes']
    assert found['process_resident_memory_bytes'] > 1e6
    assert [name for name in found if name.startswith("mbcosim_build_info{") and 'version="' in name]
    assert 'mbcosim_step_seconds_bucket{le="300"}' in found


TURNING = decks.body(spin="3., 5., 4.", tolerance="1.e-12")  # more than one iteration a step
MODIFIED = TURNING.replace("tolerance:", "nonlinear solver: newton raphson, modified, 3; tolerance:", 1)
THIRD_ORDER = TURNING.replace("method: ms, 0.6;", "method: third order, 0.6;")


@pytest.mark.parametrize("text, every", [(TURNING, True), (MODIFIED, False), (THIRD_ORDER, True)], ids=["newton", "modified", "third order"])
def test_factorizations_are_counted(start_daemon, text, every):
    """Newton's method factors a matrix in each iteration, the modified one in some."""
    daemon = start_daemon("--http", "127.0.0.1:0")
    with daemon.connect() as server:
        simulation = server.load_text(text)
        assert metrics(daemon)["mbcosim_factorizations_total"] == 0
        iterations = simulation.step(20).reply.total_iterations + simulation.step(3).reply.total_iterations
        found = metrics(daemon)
        assert found["mbcosim_iterations_total"] == iterations > 23
        if every:
            assert found["mbcosim_factorizations_total"] == iterations
        else:
            assert 23 <= found["mbcosim_factorizations_total"] < iterations


def test_simulations_are_counted_by_state(start_daemon, tmp_path):
    """Those that come back are not created again."""
    def counts(daemon):
        found = metrics(daemon)
        return [found[f'mbcosim_simulations{{state="{state}"}}'] for state in ("ready", "stepping", "finished", "failed")]

    (tmp_path / "state").mkdir()
    options = ("--state-dir", str(tmp_path / "state"), "--http", "127.0.0.1:0")
    daemon = start_daemon(*options)
    with daemon.connect() as server:
        assert counts(daemon) == [0, 0, 0, 0]
        ready, finished, endless = server.load_text(decks.body()), server.load_text(decks.body()), server.load_text(decks.endless())
        finished.run_until(1e9)
        run = server.simulations.Run(pb.RunRequest(step=pb.StepRequest(simulation=endless.name, until_time=1e9)))
        wait_for(lambda: counts(daemon) == [1, 1, 1, 0])
        run.cancel()
        wait_for(lambda: counts(daemon) == [2, 0, 1, 0])
        assert metrics(daemon)["mbcosim_simulations_created_total"] == 3
    daemon.stop()
    daemon = start_daemon(*options)
    with daemon.connect() as server:
        assert metrics(daemon)["mbcosim_simulations_suspended"] == 3
        server.attach(ready.name).step()
        assert counts(daemon) == [1, 0, 0, 0]
        assert metrics(daemon)["mbcosim_simulations_created_total"] == 0


def test_suspended_simulations_are_counted_against_the_memory(start_daemon, tmp_path):
    (tmp_path / "state").mkdir()
    options = ("--state-dir", str(tmp_path / "state"), "--http", "127.0.0.1:0")
    daemon = start_daemon(*options)
    with daemon.connect() as server:
        names = [server.load_text(decks.body()).name for _ in range(5)]
    daemon.stop()
    daemon = start_daemon(*options)
    with daemon.connect() as server:
        before = metrics(daemon)["mbcosim_memory_bytes"]
        for name in names:
            server.attach(name).delete()
        assert before - metrics(daemon)["mbcosim_memory_bytes"] > 5 * 500


def test_dropped_samples_are_counted(start_daemon):
    daemon = start_daemon("--http", "127.0.0.1:0")
    with daemon.connect() as server:
        simulation = server.load_text(decks.body())
        with simulation.subscribe(["time"], buffer=4, policy="drop_oldest") as samples:
            simulation.step(900)
            last = [step for step, _, _ in _until(samples, 900)]
            assert samples.dropped > 0 and last[-1] == 900
            dropped = samples.dropped
        assert metrics(daemon)["mbcosim_samples_dropped_total"] == dropped


def _until(samples, step):
    for sample in samples:
        yield sample
        if sample[0] >= step:
            return
