"""Sharing a simulation: method x right x role, and what a second identity may do with a grant."""
import os
import re

import grpc
import pytest

import decks
import mbcosim
from mbcosim.v1 import (coupling_pb2, coupling_types_pb2 as types, events_pb2, geometry_pb2, geometry_pb2_grpc, results_pb2, simulations_pb2 as pb,
                        telemetry_pb2)
from test_coupling import PORT, spring
from test_geometry import CHAIN

TOKENS = "ann-t control ann\nbob-t control bob\neve-t observe eve\nroot-t admin root\n"
X = "node.structural.1.X"
PROTO = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "proto", "mbcosim", "v1", "simulations.proto")

# What each right allows: see (get, list), observe, couple, control, own (delete, change grants).
ALLOWED = {None: "", "observe": "see observe", "couple": "see couple", "control": "see observe couple control"}


@pytest.fixture
def shared(start_daemon, tmp_path):
    """A daemon with tokens; function: a connection for a token."""
    tokens = tmp_path / "tokens"
    tokens.write_text(TOKENS)
    tokens.chmod(0o600)
    daemon = start_daemon("--tokens", str(tokens))
    connections = []

    def connect(name):
        connections.append(daemon.connect(token=f"{name}-t"))
        return connections[-1]

    yield connect
    for connection in connections:
        connection.close()


def calls(server, name, port="spring"):
    """Calls on a simulation by name, and which access each needs; those that change nothing come first."""
    stub, metadata = server.simulations, server.metadata
    geometry = geometry_pb2_grpc.GeometryStub(server._channel)
    results, events = server._connection.stubs.results, server._connection.stubs.events

    def unary(method, request):
        return lambda: method(request, metadata=metadata, timeout=30)

    def stream(method, request):
        return lambda: next(method(request, metadata=metadata, timeout=30))

    def attach():
        with server.attach(name).couple(port, spring):
            pass

    return [
        ("GetSimulation", "see", unary(stub.GetSimulation, pb.GetSimulationRequest(simulation=name))),
        ("DescribeSimulation", "observe", unary(stub.DescribeSimulation, pb.DescribeSimulationRequest(simulation=name))),
        ("ReadVariables", "observe", unary(stub.ReadVariables, pb.ReadVariablesRequest(simulation=name))),
        ("ListSnapshots", "observe", unary(stub.ListSnapshots, pb.ListSnapshotsRequest(simulation=name))),
        ("ExportSnapshot", "observe", stream(stub.ExportSnapshot, pb.ExportSnapshotRequest(simulation=name))),
        ("GetRecord", "observe", stream(stub.GetRecord, pb.GetRecordRequest(simulation=name))),
        ("Subscribe", "observe", stream(server.telemetry.Subscribe, telemetry_pb2.SubscribeRequest(simulation=name))),
        ("ListResults", "observe", unary(results.ListResults, results_pb2.ListResultsRequest(simulation=name))),
        ("GetResults", "observe", stream(results.GetResults, results_pb2.GetResultsRequest(simulation=name, file="results.mov"))),
        ("WatchEvents", "observe", stream(events.WatchEvents, events_pb2.WatchEventsRequest(simulation=name))),
        ("DescribeGeometry", "observe", stream(geometry.DescribeGeometry, geometry_pb2.DescribeGeometryRequest(simulation=name))),
        ("Attach", "couple", attach),
        ("WriteVariables", "control", unary(stub.WriteVariables, pb.WriteVariablesRequest(simulation=name))),
        ("Step", "control", unary(stub.Step, pb.StepRequest(simulation=name, steps=0))),
        ("StepStream", "control", stream(stub.StepStream, iter([pb.StepRequest(simulation=name, steps=0)]))),
        ("Run", "control", stream(stub.Run, pb.RunRequest(step=pb.StepRequest(simulation=name, steps=0)))),
        ("Interrupt", "control", unary(stub.Interrupt, pb.InterruptRequest(simulation=name))),
        ("CreateSnapshot", "control", unary(stub.CreateSnapshot, pb.CreateSnapshotRequest(simulation=name))),
        ("RestoreSnapshot", "control", unary(stub.RestoreSnapshot, pb.RestoreSnapshotRequest(simulation=name, snapshot=name + "/snapshots/1"))),
        ("DeleteSnapshot", "control", unary(stub.DeleteSnapshot, pb.DeleteSnapshotRequest(simulation=name, snapshot=name + "/snapshots/9"))),
        ("ImportSnapshot", "control", unary(stub.ImportSnapshot, iter([pb.ImportSnapshotRequest(header=pb.ImportSnapshotHeader(simulation=name))]))),
        ("ImportSnapshotInline", "control", unary(stub.ImportSnapshotInline, pb.ImportSnapshotInlineRequest(simulation=name))),
        ("ExportCheckpoint", "control", stream(stub.ExportCheckpoint, pb.ExportCheckpointRequest(simulation=name))),
        ("ResetSimulation", "control", unary(stub.ResetSimulation, pb.ResetSimulationRequest(simulation=name))),
        ("Linearize", "control", unary(stub.Linearize, pb.LinearizeRequest(simulation=name))),
        ("ComputeEigenvalues", "control", unary(stub.ComputeEigenvalues, pb.ComputeEigenvaluesRequest(simulation=name))),
        ("ForkSimulation", "control", unary(stub.ForkSimulation, pb.ForkSimulationRequest(simulation=name))),
        ("UpdateSimulation", "control", unary(stub.UpdateSimulation, pb.UpdateSimulationRequest(simulation=name, display_name="x"))),
        ("UpdateSimulation grants", "own", unary(stub.UpdateSimulation, pb.UpdateSimulationRequest(simulation=name, grants=pb.Grants()))),
        ("DeleteSimulation", "own", unary(stub.DeleteSimulation, pb.DeleteSimulationRequest(simulation=name))),
    ]


def test_the_table_has_every_method_on_a_simulation(shared):
    def names_one(message, depth=2):
        return "simulation" in message.fields_by_name or depth > 0 and any(
            names_one(f.message_type, depth - 1) for f in message.fields if f.message_type is not None)

    files = (pb, coupling_pb2, geometry_pb2, telemetry_pb2, results_pb2, events_pb2)
    methods = {m.name for file in files for service in file.DESCRIPTOR.services_by_name.values() for m in service.methods if names_one(m.input_type)}
    with shared("ann").load_text(decks.body(), ports=PORT) as simulation:
        tabled = {method.split()[0] for method, _, _ in calls(shared("ann"), simulation.name)}
    assert methods - {"ListSimulations"} == tabled - {"ListSimulations"}


def promised():
    """Method -> whether OBSERVE, COUPLE and CONTROL allow it, of the table above `Grant` in the protocol's file."""
    with open(PROTO, encoding="utf-8") as file:
        rows = re.findall(r"^// \| ([^|]*?) +\| (yes|no) +\| (yes|no|named ports) +\| (yes|no) +\|$", file.read(), re.M)
    return {name.replace(" with `grants`", " grants"): tuple(word != "no" for word in allowed) for names, *allowed in rows for name in names.split(", ")}


def test_the_table_in_the_protocol_is_that_of_this_test(shared):
    with shared("ann").load_text(decks.body(), ports=PORT) as simulation:
        table = {method: tuple(access in ALLOWED[right].split() for right in ("observe", "couple", "control"))
                 for method, access, _ in calls(shared("ann"), simulation.name)}
    assert promised() == {**table, "ListSimulations": (True, True, True)}


def outcome(call):
    """Code and reason of a call; "OK" when it passes or fails for reasons that have nothing to do with rights."""
    try:
        call()
    except (grpc.RpcError, mbcosim.Error) as error:
        error = mbcosim.errors.from_rpc_error(error) if isinstance(error, grpc.RpcError) else error
        if error.code in (grpc.StatusCode.PERMISSION_DENIED, grpc.StatusCode.NOT_FOUND) and error.reason != "NO_SUCH_SNAPSHOT":
            return error.code.name, error.reason
    except StopIteration:
        pass
    return "OK", ""


def expected(access, right, role):
    needs_control = access in ("couple", "control", "own")
    if role == "observe" and needs_control:
        return "PERMISSION_DENIED", "ROLE_TOO_LOW"
    if right is None:
        return "NOT_FOUND", "NO_SUCH_SIMULATION"
    return ("OK", "") if access in ALLOWED[right].split() else ("PERMISSION_DENIED", "NOT_GRANTED")


@pytest.mark.parametrize("right", list(ALLOWED))
@pytest.mark.parametrize("guest, role", [("bob", "control"), ("eve", "observe")])
def test_every_method_asks_for_its_right(shared, guest, role, right):
    grants = [] if right is None else [mbcosim.grant(f"token:{guest}", right)]
    with shared("ann").load_text(decks.body(), ports=PORT, record=True, grants=grants) as simulation:
        simulation.snapshot()
        server = shared(guest)
        for method, access, call in calls(server, simulation.name):
            wanted = expected(access, right, role)
            if method == "Attach" and wanted[0] == "PERMISSION_DENIED" and role == "observe" and right is None:
                wanted = ("NOT_FOUND", "NO_SUCH_SIMULATION")  # the client asks for the simulation first
            assert outcome(call) == wanted, method
        seen = [s.name for s in server.list()]
        assert (simulation.name in seen) == (right is not None)


@pytest.mark.parametrize("right", list(ALLOWED))
def test_every_name_on_a_stream_asks_for_its_right(shared, right):
    grants = [] if right is None else [mbcosim.grant("token:bob", right)]
    server = shared("bob")
    with shared("ann").load_text(decks.body(), grants=grants) as simulation, server.load_text(decks.body()) as own:
        for names in ([own.name, simulation.name], [own.name, own.name, simulation.name, own.name]):
            requests = [pb.StepRequest(simulation=name) for name in names]
            assert outcome(lambda r=requests: list(server.simulations.StepStream(iter(r), metadata=server.metadata))) == expected("control", right, "control")
        steps = 2 if right == "control" else 0
        assert simulation.refresh().step == steps and own.refresh().step == 3 + (1 if right == "control" else 0)


def test_owners_and_admins_may_do_all(shared):
    for name in ("ann", "root"):
        simulation = shared("ann").load_text(decks.body(), ports=PORT, record=True)
        for method, _, call in calls(shared(name), simulation.name):
            assert outcome(call) == ("OK", ""), (name, method)


def test_a_second_token_couples_to_a_granted_port_and_reads_nothing_else(shared):
    ports = [mbcosim.structural_port("wing", nodes=[1]), mbcosim.structural_port("tail", nodes=[2])]
    grants = [mbcosim.grant("token:bob", "couple", ["wing"])]
    with shared("ann").load_text(CHAIN.format(n=2).replace("end: initial value", "max iterations: 20; end: initial value"), ports=ports, grants=grants) as simulation:
        guest = shared("bob").attach(simulation.name)
        with pytest.raises(mbcosim.NotAllowed) as caught:
            guest.couple("tail", spring)
        assert (caught.value.reason, caught.value.metadata["wanted"]) == ("NOT_GRANTED", "couple")
        with pytest.raises(mbcosim.NotAllowed):
            guest.read([X])
        assert not guest.info.grants, "grants are told to the owner only"
        with guest.couple("wing", spring), simulation.couple("tail", spring):
            assert simulation.step(5).step == 5


def test_grants_change_while_the_simulation_lives(shared):
    with shared("ann").load_text(decks.body()) as simulation:
        guest = shared("bob")
        with pytest.raises(mbcosim.NotFound):
            guest.attach(simulation.name)
        info = simulation.update(grants=[mbcosim.grant("*", "observe")])
        assert [g.identity for g in info.grants] == ["*"]
        assert guest.attach(simulation.name).read([X])[X].shape == (3,)
        simulation.update(name="renamed")
        assert guest.attach(simulation.name).info.display_name == "renamed", "what is absent stays"
        simulation.update(grants=[])
        with pytest.raises(mbcosim.NotFound):
            guest.attach(simulation.name)


def test_a_grant_that_is_taken_back_ends_the_steps_of_an_open_stream(shared):
    with shared("ann").load_text(decks.body(), grants=[mbcosim.grant("token:bob", "control")]) as simulation:
        stepper = shared("bob").attach(simulation.name).stepper()
        assert [stepper.step().step for _ in range(3)] == [1, 2, 3]
        simulation.update(grants=[])
        with pytest.raises(mbcosim.NotFound):
            stepper.step()
        assert simulation.refresh().step == 3


def test_a_grant_that_is_taken_back_ends_what_is_read_by_it(shared):
    with shared("ann").load_text(decks.body(), grants=[mbcosim.grant("token:bob", "observe")]) as simulation:
        bob = shared("bob")
        samples, events = iter(bob.attach(simulation.name).subscribe([X])), iter(bob.events(simulation.name))
        simulation.step(2)
        simulation.snapshot("kept")
        assert [next(samples)[0] for _ in range(2)] == [1, 2] and next(events).HasField("snapshot")
        simulation.update(grants=[mbcosim.grant("token:bob", "couple")])
        simulation.step(2)
        simulation.snapshot("not for bob")
        for stream in (samples, events):
            with pytest.raises(mbcosim.NotAllowed) as caught:
                next(stream)
            assert (caught.value.reason, caught.value.metadata["wanted"]) == ("NOT_GRANTED", "observe")


def test_events_of_all_are_those_that_the_caller_might_observe_when_they_happened(shared):
    ann, bob = shared("ann"), shared("bob")
    events = iter(bob.events())
    with ann.load_text(decks.body()) as simulation, bob.load_text(decks.body()) as own:
        for label, grants in (("hidden", []), ("seen", [mbcosim.grant("*", "observe")]), ("port", [mbcosim.grant("*", "couple")])):
            simulation.update(grants=grants)
            simulation.snapshot(label)
        own.snapshot("own")
        names = [event.snapshot.name for event in (next(events) for _ in range(3)) if event.HasField("snapshot")]
        assert names == [f"{simulation.name}/snapshots/2", f"{own.name}/snapshots/1"]


def test_a_grant_that_is_taken_back_ends_the_coupling(shared):
    with shared("ann").load_text(decks.body(), ports=PORT, grants=[mbcosim.grant("token:bob", "couple")]) as simulation:
        with shared("bob").attach(simulation.name).couple("spring", spring) as peer:
            assert simulation.step(3).step == 3
            simulation.update(grants=[])
            with pytest.raises(mbcosim.Error):
                simulation.step(1)
        assert isinstance(peer.error, mbcosim.NotFound) and simulation.refresh().step == 3


@pytest.mark.parametrize("wrong, field", [
    (pb.Grant(identity="", right=pb.RIGHT_OBSERVE), "grants.identity"),
    (pb.Grant(identity="token:nobody", right=pb.RIGHT_OBSERVE), "grants.identity"),
    (pb.Grant(identity="token:bob ", right=pb.RIGHT_OBSERVE), "grants.identity"),
    (pb.Grant(identity="token:bob"), "grants.right"),
    (pb.Grant(identity="token:bob", right=17), "grants.right"),
    (pb.Grant(identity="token:bob", right=pb.RIGHT_COUPLE, ports=1001 * ["wing"]), "grants.ports"),
    (pb.Grant(identity="token:bob", right=pb.RIGHT_OBSERVE, ports=["wing"]), "grants.ports")])
def test_wrong_grants_are_refused_by_field_and_change_nothing(shared, wrong, field):
    server = shared("ann")
    with pytest.raises(mbcosim.Error) as caught:
        server.load_text(decks.body(), grants=[wrong])
    assert caught.value.reason == "BAD_ARGUMENT" and caught.value.field == field
    assert server.list() == []
    with server.load_text(decks.body(), grants=[mbcosim.grant("token:bob", "observe")]) as simulation:
        with pytest.raises(mbcosim.Error):
            simulation.update(grants=[wrong])
        assert [g.identity for g in simulation.refresh().grants] == ["token:bob"]
