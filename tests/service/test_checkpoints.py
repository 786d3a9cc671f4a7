"""Simulations as bytes: carried to another daemon they go on bit for bit; the commands that list, store and bring back."""
import asyncio
import concurrent.futures
import os
import re
import subprocess
import sys

import grpc
import pytest

import decks
import mbcosim
import mbcosim.aio
from conftest import BIN, wait_for
from mbcosim.v1 import checkpoints_pb2, simulations_pb2 as pb, simulations_pb2_grpc
sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(__file__)), "hostile"))
from forged_checkpoints import POINT, bytes_of, records_of
from relay import BlackHole
from test_durable import at_the_end, bits, deck, folder, kill, start, state_of  # noqa: F401 (fixtures)


@pytest.fixture
def other(start_daemon, tmp_path):
    """A second daemon with a folder of its own."""
    (tmp_path / "other").mkdir()
    return start_daemon("--state-dir", str(tmp_path / "other"))


def run(*arguments, **environment):
    done = subprocess.run([os.path.join(BIN, "mbcosim"), *arguments], capture_output=True, text=True, timeout=60, env={**os.environ, **environment})
    return done.returncode, done.stdout, done.stderr


def test_a_carried_simulation_goes_on_bit_for_bit(start, other):
    with start().connect() as here, other.connect() as there:
        expected = at_the_end(here, deck(400))
        simulation = here.load_text(deck(400), name="body")
        simulation.step(100)
        saved = simulation.snapshot("here")
        simulation.step(100)
        data = simulation.export_checkpoint()
        carried = there.import_checkpoint(data)
        assert state_of(there, carried.info.name) == pb.SIMULATION_STATE_SUSPENDED
        assert (carried.info.display_name, carried.info.step) == ("body", 200)
        carried.run_until(1e9)
        assert bits(carried) == expected
        assert [s.display_name for s in carried.snapshots()] == ["here"]
        simulation.run_until(1e9)  # the original is not touched
        assert bits(simulation) == expected
        simulation.restore(saved)
        carried.restore(carried.snapshots()[0])
        assert bits(carried) == bits(simulation)


@pytest.mark.parametrize("damage", [lambda b: b[:-1], lambda b: b[:100], lambda b: b"", lambda b: b"x" * 1000,
                                    lambda b: b[:len(b) // 2] + bytes([b[len(b) // 2] ^ 1]) + b[len(b) // 2 + 1:]],
                         ids=["cut", "short", "empty", "foreign", "flipped"])
def test_damaged_bytes_are_refused_and_leave_nothing(start, damage):
    with start().connect() as server:
        with server.load_text(deck(100), name="body") as simulation:
            data = simulation.export_checkpoint()
            with pytest.raises(mbcosim.Error) as refused:
                server.import_checkpoint(damage(data))
            assert refused.value.reason in ("DAMAGED_STATE", "BAD_ARGUMENT"), refused.value
            assert [info.name for info in server.list()] == [simulation.info.name]


def with_point(data, change):
    """The bytes of a checkpoint whose CheckpointPoint was changed."""
    records = records_of(data)
    for record in records:
        if record[0] == POINT:
            point = checkpoints_pb2.CheckpointPoint.FromString(record[1])
            change(point)
            record[1] = point.SerializeToString()
    return bytes_of(records)


@pytest.mark.parametrize("numbers, following", [([1, 1], 3), ([0, 2], 3), ([2**31 - 1, 1], 3), ([1, 2], -1), ([1, 2], 2**31 - 1)])
def test_snapshots_that_no_server_numbers_so_are_refused(start, numbers, following):
    with start().connect() as server:
        simulation = server.load_text(deck())
        for _ in numbers:
            simulation.snapshot()

        def forge(point):
            for snapshot, number in zip(point.snapshots, numbers):
                snapshot.number = number
            point.next_snapshot = following

        with pytest.raises(mbcosim.Error) as caught:
            server.import_checkpoint(with_point(simulation.export_checkpoint(), forge))
        assert caught.value.reason == "DAMAGED_STATE"


@pytest.mark.parametrize("following", [False, True])
@pytest.mark.parametrize("answers", [[(0, 0)], [(0, 1)], [(0, 7)], [(0.1, 6), (0.1, 6)], [(float("nan"), 6)], [(float("inf"), 6)]], ids=str)
def test_answers_that_do_not_fit_their_port_are_refused(start, answers, following):
    """Numbers that are not there would be read, and written, beyond the end."""
    ports = [mbcosim.structural_port("tip", nodes=[1])]
    with start().connect() as server:
        simulation = server.load_text(deck(), ports=ports, optional_ports=True)

        def forge(point):
            del point.ports[:]
            port = point.ports.add(port="tip", input_hold=1)
            if following:
                port.form.frame, port.form.following_loads = 2, True
            for time, count in answers:
                port.answers.add(time=time, values=count * [1.0])

        forged = server.import_checkpoint(with_point(simulation.export_checkpoint(), forge))
        for use in (forged.step, forged.step, lambda: forged.read(["time"])):
            with pytest.raises(mbcosim.Error) as caught:
                use()
            assert caught.value.reason == "DAMAGED_STATE" and '"tip"' in str(caught.value)
        assert simulation.step().step == 1


@pytest.mark.parametrize("seconds, reason", [(0, "DAMAGED_STATE"), (-5, "DAMAGED_STATE"), (-18446403032316225, "BAD_ARGUMENT"), (2**62, "BAD_ARGUMENT")])
def test_leases_that_no_server_gives_are_refused(start, seconds, reason):
    with start().connect() as server:
        simulation = server.load_text(deck())

        def forge(point):
            point.info.lease.seconds = seconds

        with pytest.raises(mbcosim.Error) as caught:
            server.import_checkpoint(with_point(simulation.export_checkpoint(), forge))
        assert caught.value.reason == reason
        assert [info.name for info in server.list()] == [simulation.name]


def test_exports_that_nobody_reads_leave_descriptors_to_others(start):
    daemon = start()
    with daemon.connect() as server, grpc.insecure_channel(daemon.address, [("grpc.http2.lookahead_bytes", 5), ("grpc.http2.bdp_probe", 0)]) as channel:
        simulation = server.load_text(deck() + "# " + 4_000_000 * "x")  # several messages each
        export = simulations_pb2_grpc.SimulationsStub(channel).ExportCheckpoint
        begun = [export(pb.ExportCheckpointRequest(simulation=simulation.name)) for _ in range(8)]
        for stream in begun:
            next(stream)
        with pytest.raises(grpc.RpcError) as caught:
            next(export(pb.ExportCheckpointRequest(simulation=simulation.name)))
        assert caught.value.code() == grpc.StatusCode.RESOURCE_EXHAUSTED and "exports" in caught.value.details()
        begun[0].cancel()
        wait_for(lambda: exported(simulation))


def exported(simulation):
    try:
        return simulation.export_checkpoint()
    except mbcosim.LimitExceeded:
        return None


def test_a_repeated_import_makes_one_simulation(start):
    """While the first is suspended, when it lives, and when both arrive at once; other bytes with its id are refused."""
    with start().connect() as server:
        with server.load_text(deck(100), name="body") as simulation:
            data, other = simulation.export_checkpoint(), (simulation.step(1), simulation.export_checkpoint())[1]

        def carry(request_id, data):
            messages = [pb.ImportCheckpointRequest(header=pb.ImportCheckpointHeader(request_id=request_id)),
                        pb.ImportCheckpointRequest(data=data)]
            return server.simulations.ImportCheckpoint(iter(messages), timeout=60, metadata=server.metadata).simulation.name

        first = carry("one", data)
        assert carry("one", data) == first
        for state in (pb.SIMULATION_STATE_SUSPENDED, pb.SIMULATION_STATE_READY):
            assert state_of(server, first) == state
            with pytest.raises(grpc.RpcError) as refused:
                carry("one", other)
            assert refused.value.details() == '`request_id` "one" was another request\'s'
            assert server.attach(first).step(1)
        assert carry("one", data) == first
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            assert len(set(pool.map(lambda _: carry("many", data), range(8)))) == 1
        assert len(server.list()) == 2


@pytest.mark.parametrize("upwards", [True, False], ids=["request", "reply"])
@pytest.mark.parametrize("what", ["load", "checkpoint", "state"])
@pytest.mark.parametrize("library", ["blocking", "asyncio"])
def test_an_upload_that_breaks_off_is_made_again_and_counts_once(start, tmp_path, library, what, upwards):  # noqa: F811
    daemon = start()
    relay = BlackHole(str(tmp_path), daemon.address)
    with daemon.connect() as direct:
        original = direct.load_text(deck(100))
        original.step(5)
        checkpoint, state = original.export_checkpoint(), original.export_state()

        async def upload(server, result):
            if what == "load":
                await result(server.load_text(deck(100)))
            elif what == "checkpoint":
                await result(server.import_checkpoint(checkpoint))
            else:
                await result((await result(server.attach(original.name))).import_state(state))

        async def itself(value):
            return value

        async def through_asyncio():
            async with mbcosim.aio.connect(relay.address, reconnect=30) as server:
                await server.info()
                relay.break_off(200 if upwards else 5, upwards)
                await upload(server, lambda result: result)
                assert relay.has_broken()
                check()

        def check():
            assert len(direct.list()) == (1 if what == "state" else 2)
            assert len(original.snapshots()) == (1 if what == "state" else 0)

        if library == "asyncio":
            asyncio.run(through_asyncio())
        else:
            with mbcosim.connect(relay.address, reconnect=30) as server:
                server.info()
                relay.break_off(200 if upwards else 5, upwards)
                asyncio.run(upload(server, itself))
                assert relay.has_broken()
                check()
    relay.close()


def test_what_is_not_durable_is_refused_by_name(start, start_daemon):
    with start().connect() as server, start_daemon().connect() as without:
        with server.load_text(deck(100), durability="none") as simulation:
            with pytest.raises(mbcosim.PreconditionFailed) as refused:
                simulation.export_checkpoint()
            assert refused.value.reason == "NOT_DURABLE"
        durable = server.load_text(deck(100))
        with pytest.raises(mbcosim.PreconditionFailed) as refused:
            without.import_checkpoint(durable.export_checkpoint())
        assert refused.value.reason == "NOT_DURABLE"


def test_the_commands_list_store_and_bring_back(start, other, tmp_path):
    file = str(tmp_path / "body.checkpoint")
    daemon = start()
    with daemon.connect() as here, other.connect() as there:
        simulation = here.load_text(deck(400), name="body")
        simulation.step(50)
        name = simulation.info.name
        code, listing, _ = run("sessions", "--address", daemon.address)
        assert code == 0 and any(line.split()[:3] == [name, "ready", "50"] for line in listing.splitlines()), listing
        assert run("sessions", MBCOSIM_ADDRESS=daemon.address)[:2] == (0, listing)
        assert run("sessions", "--address", daemon.address, MBCOSIM_ADDRESS="unix:/nowhere")[:2] == (0, listing)  # the option goes before
        assert run("checkpoint", name, "-o", file, "--address", daemon.address)[0] == 0
        code, printed, errors = run("resume", file, "--name", "again", "--address", other.address)
        assert code == 0, errors
        carried = there.attach(printed.strip())
        assert (carried.info.display_name, carried.info.step) == ("again", 50)
        assert bits(carried) == bits(simulation)
        assert run("resume", printed.strip(), "--address", other.address)[0] == 0


def flip(path, place=0.5):
    data = bytearray(path.read_bytes())
    data[int(len(data) * place)] ^= 4
    path.write_bytes(data)


@pytest.mark.parametrize("place", [0.3, 0.6, 0.9])
def test_what_is_whole_of_a_damaged_journal_goes_on(start, folder, place):  # noqa: F811
    daemon = start("--checkpoint-interval", "3600")
    with daemon.connect() as server:
        expected = at_the_end(server, deck(400))
        simulation = server.load_text(deck(400), name="body", durability="journal")
        for _ in range(40):
            simulation.step(1)
        name = simulation.info.name
    kill(daemon)
    flip(folder / name / "journal-1", place)
    daemon = start()
    with daemon.connect() as server:
        assert not server.list()
        aside = str(folder / (name + ".damaged"))
        assert f"put aside as {aside}: `mbcosim resume --from-checkpoint`" in daemon.log()
        code, _, errors = run("resume", aside, "--address", daemon.address)
        told = re.search(r"damaged:\n  " + re.escape(aside) + r"/journal-1: record (\d+) at byte \d+: .*\n"
                         r"`--from-checkpoint` leaves that out: it goes on at step (\d+), t = ", errors)
        assert code == 4 and told and not server.list()
        code, printed, errors = run("resume", aside, "--from-checkpoint", "--address", daemon.address)
        assert code == 0 and "left out:\n" in errors, errors
        carried = server.attach(printed.strip())
        assert carried.info.step == int(told[2]) == int(told[1]) - 2  # the record before is the last whole entry; the first is no entry
        assert 40 * place - 3 <= carried.info.step <= 40 * place + 1 and carried.info.display_name == "body"
        carried.run_until(1e9)
        assert bits(carried) == expected


def test_what_is_whole_beside_a_damaged_snapshot_goes_on(start, folder):  # noqa: F811
    daemon = start()
    with daemon.connect() as server:
        expected = at_the_end(server, deck(400))
        simulation = server.load_text(deck(400))
        for snapshot in ("one", "two", "three"):
            simulation.step(10)
            simulation.snapshot(snapshot)
        name = simulation.info.name
    daemon.stop()
    stored = folder / name
    flip(stored / "snapshot-2")
    (stored / "snapshot-3").unlink()
    daemon = start()
    with daemon.connect() as server:
        with pytest.raises(mbcosim.Error, match="snapshot-2: record 2 .*`mbcosim resume --from-checkpoint`"):
            server.attach(name).step()
        code, printed, errors = run("resume", str(stored), "--from-checkpoint", "--name", "rest", "--address", daemon.address)
        assert code == 0 and "snapshot-2: record 2 at byte" in errors and "snapshot-3: it cannot be opened" in errors, errors
        carried = server.attach(printed.strip())
        assert (carried.info.display_name, carried.info.step) == ("rest", 30)
        assert [(s.display_name, s.step) for s in carried.snapshots()] == [("one", 10)]
        assert carried.snapshot("four").name.endswith("/4")
        carried.snapshots()[0].restore()
        carried.run_until(1e9)
        assert bits(carried) == expected


@pytest.mark.parametrize("file", ["model", "point"])
def test_without_its_model_or_checkpoint_nothing_is_made(start, folder, file):  # noqa: F811
    daemon = start()
    with daemon.connect() as server:
        name = server.load_text(deck()).info.name
    daemon.stop()
    flip(folder / name / file)
    daemon = start()
    aside = str(folder / (name + ".damaged"))
    code, _, errors = run("resume", aside, "--from-checkpoint", "--address", daemon.address)
    assert code == 4 and f"{aside}: {file}: record " in errors
    code, _, errors = run("resume", "simulations/x", "--from-checkpoint", "--address", daemon.address)
    assert code == 4 and "--from-checkpoint is for a folder" in errors
    with daemon.connect() as server:
        assert not server.list()


def test_commands_say_what_is_wrong(start, tmp_path):
    daemon = start()
    missing = str(tmp_path / "missing")
    for arguments, text in [(("checkpoint", "simulations/nobody", "-o", missing), "nobody"), (("resume", missing), f"cannot read {missing}"),
                            (("checkpoint", "simulations/nobody"), "--output is required")]:
        code, _, errors = run(*arguments, "--address", daemon.address)
        assert code == 4 and text in errors, errors
        assert not os.path.exists(missing)
    for address, why in [(f"unix:{missing}", "there is no such socket"), ("localhost:1", "Connection refused")]:
        code, _, errors = run("sessions", "--address", address, "--timeout", "0.3")
        assert code == 4 and f"no server answers at {address}: " in errors and why in errors, errors


def test_a_checkpoint_that_cannot_have_its_name_leaves_nothing(start, tmp_path):
    daemon = start()
    folder = tmp_path / "folder"
    folder.mkdir()
    with mbcosim.connect(daemon.address) as server:
        code, _, errors = run("checkpoint", server.load_text(decks.body()).name, "-o", str(folder), "--address", daemon.address)
    assert code == 4 and f"cannot write {folder}: Is a directory" in errors
    assert not os.path.exists(f"{folder}.new")


def test_names_of_sockets_do_not_stand_in_the_way(start_daemon, tmp_path):
    folder = tmp_path / "run #1? 50%"
    folder.mkdir()
    start_daemon("--listen", f"unix:{folder}/socket")
    assert_reached(f"unix:{folder}/socket")


def test_no_proxy_of_the_environment_is_asked_for_this_machine(behind_a_proxy):
    address = behind_a_proxy.tcp_address()
    for same in (address, address.replace("127.0.0.1", "localhost")):
        assert_reached(same)


def assert_reached(address):
    """By commands and by the health check."""
    assert run("sessions", "--address", address, "--timeout", "5")[0] == 0
    assert subprocess.run([os.path.join(BIN, "mbcosimd"), "--check", address], timeout=60).returncode == 0


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: os.symlink("/dev/zero", path)], ids=["pipe", "folder", "device"])
def test_what_is_no_file_in_the_state_folder_makes_nobody_wait(start, folder, make):
    with start().connect() as server, server.load_text(deck(100)) as simulation:
        model = os.path.join(folder, simulation.info.name, "model")
        os.unlink(model)
        make(model)
        with pytest.raises(mbcosim.Error, match="it is no regular file"):
            simulation.export_checkpoint()
        assert simulation.step(10).step == 10  # it lives on
