"""More calls than the daemon can answer, of a client that keeps no limit."""
import contextlib
import socket
import threading
import time

import pytest

import decks
from conftest import TIME_FACTOR, is_sanitized, wait_for
from http2 import flood
from test_operation import metrics
from test_resilience import guarded, resident  # noqa: F401, a fixture


def has_ipv6():
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET6) as probe:
        probe.bind(("::1", 0))
        return True
    return False


@pytest.mark.parametrize("resets, over", [(True, "unix"), (True, "tcp"), (False, "unix"), (False, "tcp6"), (False, "mapped")])
def test_calls_that_come_faster_than_they_can_be_answered(guarded, resets, over):
    """gRPC keeps some 20 KB of each until its turn comes, a GB in a second; its own limit holds for a client that acknowledges it and resets
    nothing. This one needs no credentials for it."""
    host = {"unix": None, "tcp": "127.0.0.1", "tcp6": "[::1]", "mapped": "[::]"}[over]
    if over in ("tcp6", "mapped") and not has_ipv6():
        pytest.skip("this machine has no loopback address of IPv6")
    daemon = guarded("--http", "127.0.0.1:0", *["--listen", f"{host}:0", "--insecure"] if host else [])
    address = daemon.address
    if host:
        wait_for(lambda: f"listening on {host}:" in daemon.log())
        port = daemon.log().split(f"listening on {host}:")[1].split()[0]
        address = ("127.0.0.1:" if over == "mapped" else f"{host}:") + port
    came, seconds = [], []
    with daemon.connect(token="ann-token-0123456789") as server, server.load_text(decks.body()) as simulation:
        before, most = resident(daemon), 0
        attack = threading.Thread(target=lambda: came.append(flood(address, "/mbcosim.v1.Simulations/Step", 5, resets)))
        attack.start()
        while attack.is_alive():
            start = time.monotonic()
            assert simulation.step().outcome == "ACCEPTED"
            seconds.append(time.monotonic() - start)
            most = max(most, resident(daemon))
            time.sleep(0.05)
        sent, broken_off = came[0]
        assert sent > 1000
        assert ("broken off: its calls come faster" in daemon.log()) == broken_off
        assert (metrics(daemon, "ann-token-0123456789")["mbcosim_connections_broken_off_total"] > 0) == broken_off
        assert max(seconds) < 5 * TIME_FACTOR
        if not is_sanitized():
            assert most - before < 1000 << 20
            if broken_off:
                wait_for(lambda: resident(daemon) - before < 50 << 20, 20)  # given back
