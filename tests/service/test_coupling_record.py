"""Records of ports, and their replay against a model and against a client."""
import os
import socket
import subprocess

import numpy as np
import pytest

import decks
import mbcosim
from conftest import BIN, wait_for
from test_coupling import PORT, spring

DECK = decks.body(final_time="100.", step="1.e-2", spin="null")


def replay(*arguments):
    return subprocess.run([os.path.join(BIN, "mbcosim"), "replay", *map(str, arguments)], capture_output=True, text=True, timeout=60)


def record(server, folder, steps=20, answer=spring, deck=DECK, ports=PORT, port="spring", before=None, after=None, **options):
    """A record and its deck as files."""
    with server.load_text(deck, ports=ports, record=True) as simulation:
        if before:
            before(simulation)
        with simulation.couple(port, answer, **options):
            try:
                simulation.step(steps)
            except mbcosim.StepFailed:
                pass
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        if after:
            after(simulation)
        data = simulation.record()
    (folder / "run.rec").write_bytes(data)
    (folder / "deck").write_text(deck)
    return folder / "run.rec", folder / "deck"


@pytest.mark.parametrize("options", [
    dict(mode="loose"), dict(mode="staggered"), dict(mode="loose", every=3, hold="linear"), dict(mode="tight", tolerance=1e-9),
    dict(mode="window", acceleration="iqn_ils")], ids=str)
def test_a_record_replays_bit_for_bit(server, tmp_path, options):
    rec, deck = record(server, tmp_path, **options)
    result = replay(rec, deck)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "same: 20 steps" in result.stdout and " 0 exchanges" not in result.stdout


def test_the_first_difference_is_named(server, tmp_path):
    rec, deck = record(server, tmp_path)
    other = tmp_path / "other"
    other.write_text(deck.read_text().replace("body: 1, 1, 1.", "body: 1, 1, 1.0"))
    result = replay(rec, other)
    assert result.returncode == 2 and "digest" in result.stderr  # not that model

    from mbcosim.v1 import record_pb2
    data, out, at, changed = rec.read_bytes(), b"", 0, False
    from google.protobuf.internal import decoder, encoder
    while at < len(data):
        size, at = decoder._DecodeVarint(data, at)
        entry = record_pb2.RecordEntry.FromString(data[at:at + size])
        at += size
        if entry.from_peer.HasField("exchange") and entry.from_peer.exchange.index == 7:
            entry.from_peer.exchange.answer.forces[1] += 1e-6
            changed = True
        text = entry.SerializeToString()
        out += encoder._VarintBytes(len(text)) + text
    assert changed
    (tmp_path / "changed.rec").write_bytes(out)
    result = replay(tmp_path / "changed.rec", deck)
    assert result.returncode == 1
    assert 'first difference: step 8, port "spring": positions[1]' in result.stdout or 'step 7, port' in result.stdout
    assert replay(tmp_path / "changed.rec", deck, "--tolerance", "1e-3").returncode == 0


def test_lost_peers_and_inputs_are_replayed(server, tmp_path):
    calls = []

    def answer(motion):
        calls.append(motion)
        if len(calls) == 5:
            raise ValueError("not now")
        return spring(motion)

    def write(simulation):
        simulation["node.structural.1.load"] = np.zeros(6)

    ports = [mbcosim.signal_port("s", ["node.structural.1.X"], [])] + PORT
    rec, deck = record(server, tmp_path, answer=answer, policy="hold_last")
    result = replay(rec, deck)
    assert result.returncode == 0, result.stdout + result.stderr
    rec, deck = record(server, tmp_path, answer=answer, policy="fail_step", steps=3)
    assert replay(rec, deck).returncode == 0


def test_a_recorded_server_checks_a_client(server, tmp_path):
    rec, _ = record(server, tmp_path, mode="tight")
    for factor, code in ((1.0, 0), (1.01, 1)):
        address = f"unix:{tmp_path}/replay{factor}.sock"
        process = subprocess.Popen([os.path.join(BIN, "mbcosim"), "replay", str(rec), "--serve", address], stdout=subprocess.PIPE, text=True)
        assert "waiting" in process.stdout.readline()
        with mbcosim.connect(address) as recorded:
            simulation = recorded.attach("simulations/any")
            peer = simulation.couple("spring", lambda m: factor * spring(m), mode="tight")
            assert process.wait(20) == code
            peer.close()
        text = process.stdout.read()
        assert ("same: " in text) if code == 0 else ('port "spring": forces[1]' in text)


def test_an_address_that_cannot_be_had(daemon, server, tmp_path):
    """The daemon that listens there is not disturbed; another port of the number modulo 65536 is not taken instead."""
    rec, _ = record(server, tmp_path)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        there = f"127.0.0.1:{taken.getsockname()[1]}"
        for address, told in ((daemon.address, "another server listens on"), (there, f"cannot listen on {there}: Address already in use"),
                              ("127.0.0.1:999999", "with a port from 0 to 65535")):
            result = replay(rec, "--serve", address)
            assert result.returncode == 4 and told in result.stderr and result.stdout == "", (result.stdout, result.stderr)
    with daemon.connect() as again:
        assert again.info().version
    (tmp_path / "a file").write_text("of somebody")
    result = replay(rec, "--serve", f"unix:{tmp_path}/a file")
    assert result.returncode == 4 and "a file exists and is not a socket" in result.stderr
    assert (tmp_path / "a file").read_text() == "of somebody"


def test_a_record_in_which_nobody_took_part_is_not_served(server, tmp_path):
    with server.load_text(DECK, ports=PORT, record=True) as simulation:
        (tmp_path / "rec").write_bytes(simulation.record())
    result = replay(tmp_path / "rec", "--serve", f"unix:{tmp_path}/s")
    assert result.returncode == 2 and "nobody took part while it was recorded" in result.stderr and result.stdout == ""


def test_a_simulation_without_a_record_says_so(server):
    with server.load_text(DECK, ports=PORT) as simulation:
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            simulation.record()
        assert caught.value.reason == "NOT_RECORDING"


def test_a_record_ends_at_its_limit(start_daemon, tmp_path):
    daemon = start_daemon("--limit-record-bytes", "20000")
    with daemon.connect() as server:
        rec, deck = record(server, tmp_path, steps=200)
        assert rec.stat().st_size < 21000
    result = replay(rec, deck)
    assert result.returncode == 0 and "met its limit" in result.stdout


@pytest.mark.parametrize("content, match", [(b"", "no record"), (b"\\xff\\xff\\xff\\xff", "damaged|no record"), (b"text of no use", "damaged|no record")])
def test_what_is_no_record_is_refused(tmp_path, content, match):
    import re
    (tmp_path / "x").write_bytes(content)
    (tmp_path / "deck").write_text(DECK)
    result = replay(tmp_path / "x", tmp_path / "deck")
    assert result.returncode == 2 and re.search(match, result.stderr)
    assert replay(tmp_path / "nothing", tmp_path / "deck").returncode == 2
    assert replay(tmp_path / "x").returncode == 4
    assert replay(tmp_path / "x", "--serve", "0.0.0.0:1").returncode == 4
