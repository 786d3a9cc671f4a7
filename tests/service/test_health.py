"""Listeners, health, reflection, credentials, configuration."""
import os
import stat
import subprocess

import grpc
import pytest

import decks
import mbcosim
from conftest import BIN, Daemon, wait_for

DAEMON = os.path.join(BIN, "mbcosimd")


def health(channel, service=""):
    """Status of grpc.health.v1.Health/Check, decoded by hand: 1 is SERVING."""
    call = channel.unary_unary("/grpc.health.v1.Health/Check", request_serializer=bytes, response_deserializer=bytes)
    reply = call(b"\x0a" + bytes([len(service)]) + service.encode() if service else b"", timeout=10)
    return reply[1] if reply else 0


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
    assert subprocess.run([DAEMON, "--check", "unix:/nonexistent/socket"]).returncode == 1


def test_server_info(server):
    info = server.info()
    assert info.protocol.lowest == info.protocol.highest == 1
    assert (info.identity, info.role) == ("local", "admin")
    assert {limit.name for limit in info.limits} >= {"sessions", "deck_bytes", "unknowns"}


def test_a_second_daemon_does_not_steal_the_socket(daemon):
    second = subprocess.run([DAEMON, "--listen", daemon.address], stderr=subprocess.PIPE, text=True, timeout=30)
    assert second.returncode == 4 and "another server listens" in second.stderr
    with daemon.connect() as server:
        server.info()


def test_a_stale_socket_is_replaced(tmp_path):
    first = Daemon(str(tmp_path))
    first.connect().close()
    first.process.kill()
    first.process.wait()
    second = Daemon(str(tmp_path))
    second.connect().close()
    second.stop()


def test_a_public_address_needs_protection():
    for address in ("0.0.0.0:0", "127.example.com:1", "[::]:0"):
        run = subprocess.run([DAEMON, "--listen", address], stderr=subprocess.PIPE, text=True, timeout=30)
        assert run.returncode == 4 and "--insecure" in run.stderr


def test_loopback_tcp_on_request(start_daemon):
    daemon = start_daemon("--listen", "127.0.0.1:0")
    wait_for(lambda: "127.0.0.1:" in daemon.log())
    port = daemon.log().split("listening on 127.0.0.1:")[1].split()[0]
    with mbcosim.connect(f"127.0.0.1:{port}") as server, server.load_text(decks.body()) as simulation:
        assert simulation.step().step == 1


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


def test_print_config_and_environment():
    environment = dict(os.environ, MBCOSIMD_LIMIT_SESSIONS="7")
    run = subprocess.run([DAEMON, "--print-config"], stdout=subprocess.PIPE, text=True, env=environment)
    assert run.returncode == 0 and "limit-sessions=7" in run.stdout
    assert subprocess.run([DAEMON, "--no-such-option"], stderr=subprocess.DEVNULL).returncode == 4
