"""The C++ client library and its example against a real daemon."""
import functools
import math
import os
import subprocess

import pytest

from conftest import BIN, Daemon, MODELS, TIME_FACTOR, wait_for
from relay import Unreliable


def test_the_library(start_daemon, tmp_path):
    (tmp_path / "results").mkdir()
    daemon = start_daemon("--results-root", str(tmp_path / "results"))
    run = subprocess.run([os.path.join(BIN, "client_tests"), "--gtest_brief=1"], timeout=200 * TIME_FACTOR, text=True,
                         env={**os.environ, "MBCOSIM_ADDRESS": daemon.address}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert run.returncode == 0, run.stdout


def test_quick_steps_are_calls_where_no_stream_is_left(start_daemon):
    """Two: one that has just ended may still be counted while the next begins."""
    daemon = start_daemon("--limit-identity-streams", "2")
    run = subprocess.run([os.path.join(BIN, "client_tests"), "--gtest_brief=1", "--gtest_filter=Client.QuickStepsAre*:Client.ThreadsStep*"],
                         timeout=100 * TIME_FACTOR, text=True, env={**os.environ, "MBCOSIM_ADDRESS": daemon.address}, stdout=subprocess.PIPE,
                         stderr=subprocess.STDOUT)
    assert run.returncode == 0 and "2 tests from" in run.stdout, run.stdout


@pytest.mark.parametrize("test", ["EndsEveryCallAtItsTimeout", "IsNoticedInAStepWithoutATimeoutAndByPeersThatWait", "KeepsNoDestructorOfAPeer"])
def test_a_silent_server_ends_every_call(falls_silent, tmp_path, test):
    address, silence = falls_silent
    wanted = tmp_path / "silence"
    run = subprocess.Popen([os.path.join(BIN, "client_tests"), "--gtest_brief=1", f"--gtest_filter=ASilentServer.{test}"], text=True,
                           env={**os.environ, "MBCOSIM_ADDRESS": address, "MBCOSIM_SILENCE": str(wanted)},
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    try:
        wait_for(lambda: wanted.exists() or run.poll() is not None, 30 * TIME_FACTOR)
        silence()
        wanted.unlink(missing_ok=True)
        output, _ = run.communicate(timeout=200 * TIME_FACTOR)
    finally:
        run.kill()
    assert run.returncode == 0, output


@pytest.mark.parametrize("test, kills", [("DoesEachCallOnce", 3), ("IsNotWaitedForWithoutWish", 1)])
def test_calls_wait_for_a_daemon_that_comes_back(tmp_path, test, kills):
    (tmp_path / "state").mkdir()
    start = functools.partial(Daemon, str(tmp_path), "--state-dir", str(tmp_path / "state"))
    wanted, daemon = tmp_path / "kill", start()
    run = subprocess.Popen([os.path.join(BIN, "client_tests"), "--gtest_brief=1", f"--gtest_filter=AServerThatIsKilledAndComesBack.{test}"], text=True,
                           env={**os.environ, "MBCOSIM_ADDRESS": daemon.address, "MBCOSIM_KILL": str(wanted)},
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    try:
        for _ in range(kills):
            wait_for(lambda: wanted.exists() or run.poll() is not None, 60)
            daemon.kill()
            if kills == 1:
                break
            daemon = start()
            wanted.unlink(missing_ok=True)
        output, _ = run.communicate(timeout=200 * TIME_FACTOR)
    finally:
        run.kill()
        daemon.stop()
    assert run.returncode == 0, output


def test_a_line_that_loses_and_repeats_messages(daemon, tmp_path):
    relay = Unreliable(str(tmp_path), daemon.address, part=0.4, seed=4)
    run = subprocess.run([os.path.join(BIN, "client_tests"), "--gtest_brief=1", "--gtest_filter=AnUnreliableLine.*"], timeout=200 * TIME_FACTOR, text=True,
                         env={**os.environ, "MBCOSIM_ADDRESS": daemon.address, "MBCOSIM_LINE": relay.address}, stdout=subprocess.PIPE,
                         stderr=subprocess.STDOUT)
    relay.close()
    assert run.returncode == 0, run.stdout
    assert relay.lost > 20 and relay.repeated > 10


def test_tokens(start_daemon, tmp_path):
    """Over both transports: with the token all goes well, without it nothing does."""
    tokens = tmp_path / "tokens"
    tokens.write_text("s3cret control ann\n")
    daemon = start_daemon("--tokens", str(tokens))
    command = [os.path.join(BIN, "client_tests"), "--gtest_brief=1", "--gtest_filter=*SynchronousPeer*"]
    for token, code in [("s3cret", 0), ("guess", 1), ("", 1)]:
        run = subprocess.run(command, timeout=60, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                             env={**os.environ, "MBCOSIM_ADDRESS": daemon.address, "MBCOSIM_TOKEN": token})
        assert run.returncode == code, run.stdout
        assert code == 0 or "bearer token" in run.stdout


def test_the_example(daemon):
    """A body of 1 kg, thrown with 1 m/s, on a spring of 400 N/m: it swings through the start after half a period of π/10 s."""
    run = subprocess.run([os.path.join(BIN, "spring_peer"), daemon.address, os.path.join(MODELS, "rigid_body.mbd"), "1", "320"], timeout=60, text=True,
                         stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert run.returncode == 0, run.stdout
    *lines, last = run.stdout.splitlines()
    rows = [[float(word) for word in line.split() if word not in "sm"] for line in lines]
    assert last.endswith("exchanges") and [row[2] for row in rows] == pytest.approx([math.sin(20 * row[0]) / 20 for row in rows], abs=1e-3)
