"""Listeners, health, reflection, credentials, configuration."""
import asyncio
import contextlib
import os
import re
import socket
import stat
import subprocess
import time
import urllib.request

import grpc
import pytest

import decks
import mbcosim
import mbcosim.aio
from conftest import BIN, TIME_FACTOR, Daemon, wait_for

DAEMON = os.path.join(BIN, "mbcosimd")
SESSIONS = os.path.join(BIN, "mbcosim-sessions")


def health(channel, service=""):
    """Status of grpc.health.v1.Health/Check, decoded by hand: 1 is SERVING."""
    call = channel.unary_unary("/grpc.health.v1.Health/Check", request_serializer=bytes, response_deserializer=bytes)
    reply = call(b"\x0a" + bytes([len(service)]) + service.encode() if service else b"", timeout=10)
    return reply[1] if reply else 0


@pytest.mark.parametrize("options", [[], ["--http", "127.0.0.1:0"]])
def test_the_daemon_keeps_no_share_of_grpc_to_the_end(start_daemon, options):
    """gRPC's threads may take ten seconds to end: they are left alone when its last share goes too late."""
    daemon = start_daemon("--log-level", "debug", *options)
    with daemon.connect() as server, server.load_text(decks.body()) as simulation:
        assert simulation.step(3).step == 3
    daemon.stop()
    assert "stopped" in daemon.log() and "gRPC is still in use" not in daemon.log()


def test_health_and_socket_mode(daemon, server):
    path = daemon.address[len("unix:"):]
    assert stat.S_IMODE(os.stat(path).st_mode) == 0o600
    with grpc.insecure_channel(daemon.address) as channel:
        assert health(channel) == 1
        watch = channel.unary_stream("/grpc.health.v1.Health/Watch", request_serializer=bytes, response_deserializer=bytes)
        stream = watch(b"")
        assert next(stream) == b"\x08\x01"
        stream.cancel()
        info = channel.stream_stream("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                                     request_serializer=bytes, response_deserializer=bytes)
        assert b"mbcosim.v1.Simulations" in next(info(iter([b"\x3a\x01*"])))
    assert subprocess.run([DAEMON, "--check", daemon.address]).returncode == 0
    nobody = subprocess.run([DAEMON, "--check", "unix:/nonexistent/socket", "--check-timeout", "1"], stderr=subprocess.PIPE, text=True)
    assert nobody.returncode == 1 and "no answer within 1 s: " in nobody.stderr and "No such file or directory" in nobody.stderr, nobody.stderr


def test_health_is_told_by_the_name_of_the_service(daemon):
    with grpc.insecure_channel(daemon.address) as channel:
        for service in ("Simulations", "Coupling", "Telemetry", "Geometry", "Results", "Events", "Reduction"):
            assert health(channel, f"mbcosim.v1.{service}") == 1
        with pytest.raises(grpc.RpcError) as caught:
            health(channel, "mbcosim.v1.Nothing")
        assert caught.value.code() == grpc.StatusCode.NOT_FOUND


def test_server_info(server):
    info = server.info()
    assert info.protocol.lowest == info.protocol.highest == 2
    assert (info.identity, info.role) == ("local", "admin")
    assert {limit.name for limit in info.limits} >= {"sessions", "deck_bytes", "unknowns"}


def test_a_second_daemon_does_not_steal_the_socket(daemon):
    second = subprocess.run([DAEMON, "--listen", daemon.address], stderr=subprocess.PIPE, text=True, timeout=30)
    assert second.returncode == 4 and "another server listens" in second.stderr
    with daemon.connect() as server:
        server.info()


def test_an_address_that_is_given_twice_is_refused(tmp_path):
    address = f"unix:{tmp_path}/s"
    done = subprocess.run([DAEMON, "--listen", address, "--listen", address], stderr=subprocess.PIPE, text=True, timeout=30 * TIME_FACTOR)
    assert done.returncode == 4 and f"another server listens on {tmp_path}/s" in done.stderr and not (tmp_path / "s").exists()


@pytest.mark.parametrize("mode", [0o777, 0o700])
@pytest.mark.parametrize("program, arguments", [(DAEMON, []), (SESSIONS, ["sessions"])], ids=["daemon", "client"])
def test_the_default_socket_is_in_a_folder_that_nobody_else_may_write(program, arguments, mode):
    """Whoever may could put another socket in its place, and would be told what is meant for the daemon."""
    if os.getuid() != 0:
        pytest.skip("only root may be another user")
    user = 60000 + os.getpid() % 5000
    folder = f"/tmp/mbcosim-{user}"
    os.mkdir(folder)
    try:
        os.chmod(folder, mode)
        os.chown(folder, user if mode == 0o777 else user + 1, -1)
        with open(program, "rb") as file:  # its folder need not be open to that user
            environment = {name: value for name, value in os.environ.items() if name != "XDG_RUNTIME_DIR"}
            run = subprocess.run([f"/proc/self/fd/{file.fileno()}", *arguments], stderr=subprocess.PIPE, text=True, timeout=30, env=environment,
                                 pass_fds=[file.fileno()], user=user, group=user)
        assert run.returncode == 4 and "the default socket" in run.stderr and folder in run.stderr, run.stderr
        assert os.listdir(folder) == []
    finally:
        os.rmdir(folder)


def test_a_stale_socket_is_replaced(tmp_path):
    first = Daemon(str(tmp_path))
    first.connect().close()
    first.process.kill()
    first.process.wait()
    second = Daemon(str(tmp_path))
    second.connect().close()
    second.stop()


def test_a_check_ends_in_its_time(tmp_path):
    """Of a socket at which nobody answers."""
    path = str(tmp_path / "silent.sock")
    with socket.socket(socket.AF_UNIX) as silent:
        silent.bind(path)
        silent.listen()
        asked = [DAEMON, "--check", f"unix:{path}", "--check-timeout", "1"]
        run = subprocess.run(asked, stderr=subprocess.PIPE, text=True, timeout=30 * TIME_FACTOR, check=False)
        assert run.returncode == 1 and run.stderr == f"mbcosimd: unix:{path}: no answer within 1 s\n", run.stderr
    for wrong in ("0", "-1", "0.5", "nan", "1000000", "soon"):
        run = subprocess.run([*asked[:-1], wrong], stderr=subprocess.PIPE, text=True, timeout=30 * TIME_FACTOR, check=False)
        assert run.returncode == 4 and "--check-timeout" in run.stderr, wrong


def test_a_check_waits_for_a_daemon_that_comes_within_its_time(tmp_path):
    address = f"unix:{tmp_path}/mbcosim.sock"
    with subprocess.Popen([DAEMON, "--check", address, "--check-timeout", "60"]) as check:
        time.sleep(0.5)  # the check finds nobody first
        assert check.poll() is None
        daemon = Daemon(str(tmp_path))
        try:
            assert check.wait(timeout=60 * TIME_FACTOR) == 0
        finally:
            daemon.stop()


def test_a_public_address_needs_protection():
    for address in ("0.0.0.0:0", "127.example.com:1", "[::]:0"):
        run = subprocess.run([DAEMON, "--listen", address], stderr=subprocess.PIPE, text=True, timeout=30)
        assert run.returncode == 4 and "--insecure" in run.stderr


def refused(*options, **environment):
    """What a daemon that does not start has to say."""
    run = subprocess.run([DAEMON, "--listen", "unix:/tmp/mbcosim-never.sock", *options], stderr=subprocess.PIPE, text=True, timeout=30,
                         env=dict(os.environ, **environment))
    assert run.returncode == 4, run.stderr
    return run.stderr


def test_loopback_without_credentials_needs_insecure():
    assert "--insecure" in refused("--listen", "127.0.0.1:0")


def test_what_is_wrong_is_an_error_at_the_start(tmp_path):
    config = tmp_path / "config"
    config.write_text("workerz=3\n")
    assert f'in the file of options "{config}": "workerz" is no option; did you mean "workers"?' in refused("--config", str(config))
    assert "--drain: expected a number from 0 to 86400, got \"-1\"" in refused("--drain", "-1")
    assert "--limit-sessions: expected a number above 0, got \"x\"" in refused("--limit-sessions", "x")
    assert "--workers" in refused("--workers", "-3")
    ca = tmp_path / "ca.pem"
    ca.write_text("none")
    assert "--tls-client-ca needs --tls-certificate" in refused("--tls-client-ca", str(ca))
    assert "belong together" in refused("--tls-certificate", str(ca))
    assert "refused to serve metrics on 0.0.0.0:0" in refused("--metrics", "0.0.0.0:0")
    tokens = tmp_path / "tokens"
    for line, error in (("t control ann next-year", "line 1: \"next-year\" is no date"),
                        ("t control ann 2026-02-31", "is no date"), ("t control ann 1 more", "nothing is expected after"),
                        ("t boss ann", "none of observe, control, admin"), ("sha256:12 control ann", "64 hexadecimal digits"),
                        ("t control", "expected TOKEN ROLE NAME"), ("geh\u00e9im control ann", "a token has printable ASCII characters only"),
                        ("t control ann\nt admin root", "line 2: the token stands in an earlier line")):
        tokens.write_text(line + "\n")
        assert error in refused("--tokens", str(tokens))
    tokens.write_text("t control ann\n")
    tokens.chmod(0o620)
    assert "chmod go-w" in refused("--tokens", str(tokens))


def test_a_tokens_file_that_others_could_replace_is_refused(start_daemon, tmp_path):
    folder, link = tmp_path / "open", tmp_path / "link"
    folder.mkdir()
    tokens = folder / "tokens"
    tokens.write_text("t control ann\n")
    link.symlink_to(tokens)
    folder.chmod(0o777)
    for path in (tokens, link):
        assert f"they may write the folder {folder}: chmod go-w {folder}" in refused("--tokens", str(path))
    folder.chmod(0o1777)  # as /tmp, where others cannot rename what is not theirs
    start_daemon("--tokens", str(link)).connect(token="t").close()
    folder.chmod(0o755)
    (folder / "deep").mkdir()
    tokens = tokens.rename(folder / "deep" / "tokens")
    folder.chmod(0o775)
    assert f"they may write the folder {folder}:" in refused("--tokens", str(tokens))


@pytest.mark.skipif(os.geteuid() != 0, reason="only root gives files away")
def test_a_tokens_file_of_another_user_is_refused(tmp_path):
    folder = tmp_path / "theirs"
    folder.mkdir()
    tokens = folder / "tokens"
    tokens.write_text("t control ann\n")
    os.chown(tokens, 12345, -1)
    assert "belongs to user 12345, neither root nor the daemon's own (0)" in refused("--tokens", str(tokens))
    os.chown(tokens, 0, -1)
    os.chown(folder, 12345, -1)
    assert f"the folder {folder} belongs to user 12345" in refused("--tokens", str(tokens))


def test_tokens_may_stand_hashed_in_their_file(start_daemon, tmp_path):
    run = subprocess.run([DAEMON, "--hash-token"], input="s3cret\n", stdout=subprocess.PIPE, text=True, check=True)
    assert run.stdout.startswith("sha256:") and "s3cret" not in run.stdout
    tokens = tmp_path / "tokens"
    tokens.write_text(run.stdout.strip() + " control ann 2099-12-31\n")
    daemon = start_daemon("--tokens", str(tokens))
    with daemon.connect(token="s3cret") as ann:
        assert ann.info().identity == "token:ann"
    with pytest.raises(mbcosim.NotAllowed):
        daemon.connect(token=run.stdout.strip())


def test_loopback_tcp_on_request(start_daemon):
    daemon = start_daemon("--listen", "127.0.0.1:0", "--insecure")
    with mbcosim.connect(daemon.tcp_address()) as server, server.load_text(decks.body()) as simulation:
        assert simulation.step().step == 1


def test_no_proxy_of_the_environment_is_asked_for_this_machine(behind_a_proxy):
    address = behind_a_proxy.tcp_address()

    async def awaited():
        async with mbcosim.aio.connect(address.replace("127.0.0.1", "localhost")) as server:
            return await server.info()

    with mbcosim.connect(address) as server:
        assert server.info().version == asyncio.run(awaited()).version


def test_tokens_roles_and_owners(start_daemon, tmp_path):
    tokens = tmp_path / "tokens"
    tokens.write_text("# token role identity expiry\na-token control ann\nb-token control bob\n"
                      "o-token observe ann\nadmin-token admin root\nold-token control ann 1000000\n")
    daemon = start_daemon("--tokens", str(tokens))
    for token in (None, "wrong", "old-token"):
        with pytest.raises(mbcosim.NotAllowed) as caught:
            daemon.connect(token=token)
        assert caught.value.reason == "UNAUTHENTICATED"
    with daemon.connect(token="a-token") as ann, daemon.connect(token="b-token") as bob, \
            daemon.connect(token="o-token") as observer, daemon.connect(token="admin-token") as admin:
        with ann.load_text(decks.body()) as simulation:
            with pytest.raises(mbcosim.NotFound):
                bob.attach(simulation.name)
            assert bob.list() == []
            watched = observer.attach(simulation.name)
            assert watched["time"] == 0
            with pytest.raises(mbcosim.NotAllowed) as caught:
                watched.step()
            assert caught.value.reason == "ROLE_TOO_LOW"
            assert admin.attach(simulation.name).step().step == 1
    assert "a-token" not in daemon.log()


def test_print_config_and_environment(tmp_path):
    def printed(*options, **environment):
        run = subprocess.run([DAEMON, "--print-config", *options], stdout=subprocess.PIPE, text=True, env=dict(os.environ, **environment))
        assert run.returncode == 0
        return run.stdout

    assert "limit-sessions=7" in printed(MBCOSIMD_LIMIT_SESSIONS="7")
    files = tmp_path / "one", tmp_path / "two"
    for file, sessions in zip(files, (8, 9)):
        file.write_text(f"limit-sessions={sessions}\n")
    assert "limit-sessions=8" in printed(MBCOSIMD_CONFIG=str(files[0]))
    assert "limit-sessions=9" in printed("--config", str(files[1]), MBCOSIMD_CONFIG=str(files[0]))
    assert "limit-sessions=64" in printed(MBCOSIMD_CONFIG="")
    assert "/none" in refused(MBCOSIMD_CONFIG="/none")
    # What is printed is a file of options that says the same again.
    files[0].write_text(printed("--no-reflection", "--limit-sessions", "7"))
    assert "\nreflection=false\n" in files[0].read_text() and "\nshared-memory=true\n" in files[0].read_text()
    again = printed("--config", str(files[0]))
    assert [line for line in again.splitlines() if "=" in line and not line.startswith(("#", "config"))] == \
           [line for line in files[0].read_text().splitlines() if "=" in line and not line.startswith(("#", "config"))]


def test_every_limit_of_the_operator_is_told(server):
    options = subprocess.run([DAEMON, "--help"], stdout=subprocess.PIPE, text=True, check=True).stdout
    names = {name.replace("-", "_") for name in re.findall(r"--limit-([a-z-]+)", options)}
    told = {limit.name for limit in server.info().limits}
    assert {"memory_bytes" if name == "memory" else "identity_memory_bytes" if name == "identity_memory" else name for name in names} <= told


@pytest.mark.parametrize("option", ["--limit-expression-depth", "--limit-nesting-depth"])
def test_depths_stay_within_the_stack(option):
    def check(depth):
        return subprocess.run([DAEMON, "--print-config", option, str(depth)], capture_output=True, text=True)

    assert check(10000).returncode == 0
    done = check(10001)
    assert done.returncode == 4 and f"{option}: expected a number from 1 to 10000" in done.stderr
    assert subprocess.run([DAEMON, "--no-such-option"], stderr=subprocess.DEVNULL).returncode == 4


def test_a_variable_that_is_no_option_is_an_error_at_the_start():
    assert ("MBCOSIMD_LIMIT_SESSION is no option; did you mean MBCOSIMD_LIMIT_SESSIONS (--limit-sessions)?"
            in refused(MBCOSIMD_LIMIT_SESSION="7"))
    assert "MBCOSIMD_NO_TOKENS is no option" in refused(MBCOSIMD_NO_TOKENS="")
    given = {"MBCOSIMD_SERVICE_HOST": "10.0.0.7", "MBCOSIMD_SERVICE_PORT_GRPC": "1", "MBCOSIMD_PORT": "tcp://10.0.0.7:1",
             "MBCOSIMD_0_PORT_50051_TCP_ADDR": "10.0.0.7"}
    for name in given:
        assert f"{name} is no option" in refused(**given)
    pod = dict(os.environ, **given, KUBERNETES_SERVICE_HOST="10.0.0.1")
    assert subprocess.run([DAEMON, "--print-config"], stdout=subprocess.DEVNULL, env=pod).returncode == 0
    assert "MBCOSIMD_WORKER is no option" in refused(**given, KUBERNETES_SERVICE_HOST="10.0.0.1", MBCOSIMD_WORKER="1")


def test_who_asks_metrics_for_nothing_holds_up_nobody(start_daemon):
    with contextlib.closing(socket.socket()) as free:
        free.bind(("127.0.0.1", 0))
        address = free.getsockname()
    daemon = start_daemon("--metrics", f"{address[0]}:{address[1]}")
    wait_for(lambda: "listening on unix" in daemon.log())
    with contextlib.ExitStack() as stack:
        for _ in range(8):
            stack.enter_context(socket.create_connection(address, 20 * TIME_FACTOR))
        with urllib.request.urlopen(f"http://{address[0]}:{address[1]}/metrics", timeout=15) as answer:
            assert b"mbcosim_steps_total" in answer.read()


def certificate(folder, name, subject, signer=None, extra=()):
    """Files NAME.key and NAME.pem; self-signed without a signer."""
    key, pem = folder / f"{name}.key", folder / f"{name}.pem"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2",
                    "-keyout", key, "-out", pem, "-subj", subject, *extra,
                    *(["-CA", folder / f"{signer}.pem", "-CAkey", folder / f"{signer}.key"] if signer else [])],
                   check=True, stderr=subprocess.DEVNULL)
    return pem.read_bytes(), key.read_bytes()


def test_certificates_give_identities_of_one_form(start_daemon, tmp_path):
    ca, _ = certificate(tmp_path, "ca", "/CN=authority")
    certificate(tmp_path, "server", "/CN=localhost", "ca", ["-addext", "subjectAltName=DNS:localhost"])
    clients = {"cert:spiffe://plant/robot": certificate(tmp_path, "a", "/CN=robot", "ca", ["-addext", "subjectAltName=URI:spiffe://plant/robot"]),
               "cert:CN=arm,O=Plant": certificate(tmp_path, "b", "/O=Plant/CN=arm", "ca")}

    def connected(*options):
        """Function that connects with credentials to a daemon of its own."""
        daemon = start_daemon("--listen", "localhost:0", "--tls-certificate", str(tmp_path / "server.pem"), "--tls-key",
                              str(tmp_path / "server.key"), "--tls-client-ca", str(tmp_path / "ca.pem"), *options)
        address = daemon.tcp_address()
        return lambda *secrets: mbcosim.connect(address, credentials=grpc.ssl_channel_credentials(ca, *secrets), timeout=10)

    def told(connect):
        for pem, key in clients.values():
            with connect(key, pem) as server:
                yield server.info().identity, server.info().role

    plain = connected()
    assert list(told(plain)) == [(identity, "control") for identity in clients]
    with pytest.raises(mbcosim.Error):
        plain()
    roles = connected("--certificate-role", "spiffe://plant/robot=admin", "--certificate-role", "CN=arm,O=Plant=observe")
    assert list(told(roles)) == list(zip(clients, ("admin", "observe")))
    pem, key = clients["cert:CN=arm,O=Plant"]
    with roles(key, pem) as server, pytest.raises(mbcosim.NotAllowed) as caught:
        server.load_text(decks.body())
    assert caught.value.reason == "ROLE_TOO_LOW"


def test_wrong_roles_of_certificates_are_refused_at_the_start(tmp_path):
    certificate(tmp_path, "ca", "/CN=authority")
    tls = ["--tls-certificate", str(tmp_path / "ca.pem"), "--tls-key", str(tmp_path / "ca.key")]
    assert "needs --tls-client-ca" in refused("--certificate-role", "arm=observe", *tls)
    tls += ["--tls-client-ca", str(tmp_path / "ca.pem")]
    for wrong in ("arm", "arm=", "=observe", "arm=boss", ""):
        assert f'"{wrong}": expected NAME=ROLE' in refused("--certificate-role", wrong, *tls)
    assert "more than one role" in refused("--certificate-role", "arm=observe", "--certificate-role", "arm=admin", *tls)
