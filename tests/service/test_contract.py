"""The contract as it was settled: only additions since, and a client of that day still works; repeats, versions, presence, pages."""
import os
import subprocess
import sys
import threading

import grpc
import pytest

import decks
import mbcosim
from conftest import TIME_FACTOR, wait_for
from google.protobuf import duration_pb2
from mbcosim.v1 import common_pb2, coupling_pb2, coupling_types_pb2, simulations_pb2 as pb, telemetry_pb2
from test_coupling import PORT, spring

HERE = os.path.dirname(os.path.abspath(__file__))
CONTRACT, PROTO = os.path.join(HERE, "..", "contract"), os.path.join(HERE, "..", "..", "proto")
SETTLED = os.path.join(CONTRACT, "version2.binpb")
ADDED = os.path.join(CONTRACT, "additions.binpb")  # since then, settled as well
sys.path.insert(0, CONTRACT)
import additions  # noqa: E402
import frozen  # noqa: E402

X = "node.structural.1.X"


def descriptors(tmp_path, folder=PROTO):
    made = tmp_path / "now.binpb"
    files = sorted(f"mbcosim/v1/{name}" for name in os.listdir(os.path.join(folder, "mbcosim", "v1")))
    subprocess.run(["protoc", f"-I{folder}", "--include_imports", f"--descriptor_set_out={made}", *files], check=True, timeout=60 * TIME_FACTOR)
    return made


# ---------------------------------------------------------------- only additions

@pytest.mark.parametrize("settled", [SETTLED, ADDED], ids=os.path.basename)
def test_the_contract_has_only_grown(tmp_path, settled):
    assert additions.losses(additions.read(settled), additions.read(descriptors(tmp_path))) == []


@pytest.mark.parametrize("old, new", [
    ("int64 steps_done = 3;", "int64 steps_done = 99;"), ("int64 steps_done = 3;", "int64 done_steps = 3;"),
    ("int64 steps_done = 3;", "int32 steps_done = 3;"), ("int64 steps_done = 3;", ""), ("optional int64 expected_step = 3;", "int64 expected_step = 3;"),
    ("STEP_OUTCOME_LIMIT = 6;", "STEP_OUTCOME_LIMIT = 66;"), ("returns (stream RunReply)", "returns (RunReply)"),
    ("rpc Interrupt(InterruptRequest) returns (InterruptReply);", "")])
def test_what_is_no_addition_is_found(tmp_path, old, new):
    folder = tmp_path / "proto" / "mbcosim" / "v1"
    folder.mkdir(parents=True)
    for name in os.listdir(os.path.join(PROTO, "mbcosim", "v1")):
        with open(os.path.join(PROTO, "mbcosim", "v1", name), encoding="utf-8") as file:
            text = file.read()
        (folder / name).write_text(text.replace(old, new, 1) if name == "simulations.proto" else text)
    found = additions.losses(additions.read(SETTLED), additions.read(descriptors(tmp_path, str(tmp_path / "proto"))))
    assert len(found) == 1, found


# ---------------------------------------------------------------- a client of that day

def test_a_client_of_that_day_steps_couples_and_saves(daemon):
    v = frozen.Frozen(SETTLED)
    with grpc.insecure_channel(daemon.address) as channel:
        stub, coupling = v.stub(channel, "Simulations"), v.stub(channel, "Coupling")
        header = v.UploadHeader(bundle_main_file="deck")
        header.options.protocol.lowest = header.options.protocol.highest = 2
        header.options.ports.add(name="spring", kind=1, node_labels=[1])
        upload = [v.UploadRequest(header=header), v.UploadRequest(chunk=v.FileChunk(path="deck", data=decks.body().encode()))]
        name = stub.CreateSimulation(iter(upload)).simulation.name
        described = stub.DescribeSimulation(v.DescribeSimulationRequest(simulation=name, variable_names=[X]))
        handle = described.model.variables[0].handle

        def messages(answers):
            hello = v.Hello(simulation=name, port="spring")
            hello.protocol.lowest = hello.protocol.highest = 2
            yield v.PeerMessage(hello=hello)
            yield from iter(answers.get, None)

        import queue
        answers = queue.SimpleQueue()
        stream = coupling.Attach(messages(answers))
        assert next(stream).welcome.layout.name == "spring"
        step = stub.Step.future(v.StepRequest(simulation=name, steps=1, outputs=[handle], request_id="one"))
        exchange = next(stream).exchange
        assert len(exchange.positions) == 3
        answers.put(v.PeerMessage(exchange=v.PeerExchange(index=exchange.index, answer=v.PeerAnswer(forces=[0.0, 0.0, 1.0]))))
        assert step.result().outcome == 1 and len(step.result().outputs) == 3
        saved = stub.CreateSnapshot(v.CreateSnapshotRequest(simulation=name)).snapshot
        assert stub.RestoreSnapshot(v.RestoreSnapshotRequest(simulation=name, snapshot=saved.name)).simulation.step == 1
        answers.put(None)
        stub.DeleteSimulation(v.DeleteSimulationRequest(simulation=name))


# ---------------------------------------------------------------- versions

def test_version_1_is_refused_by_name(server):
    options = pb.CreateOptions(protocol=common_pb2.VersionRange(lowest=1, highest=1))
    request = pb.InlineUpload(header=pb.UploadHeader(bundle_main_file="deck", options=options),
                              files=[common_pb2.FileChunk(path="deck", data=decks.body().encode())])
    with pytest.raises(grpc.RpcError, match="protocol version 2, the client 1 to 1: take a newer client") as caught:
        server.simulations.CreateSimulationInline(request, metadata=server.metadata)
    assert mbcosim.errors.from_rpc_error(caught.value).reason == "VERSION_MISMATCH"


def test_both_sides_name_their_features(server):
    told = server.info().protocol
    assert (told.lowest, told.highest) == (2, 2) and set(mbcosim.rpc.FEATURES) <= set(told.features)
    options = pb.CreateOptions(protocol=common_pb2.VersionRange(lowest=2, highest=9, features=["telepathy"]))
    request = pb.InlineUpload(header=pb.UploadHeader(bundle_main_file="deck", options=options),
                              files=[common_pb2.FileChunk(path="deck", data=decks.body().encode())])
    reply = server.simulations.CreateSimulationInline(request, metadata=server.metadata)
    assert list(reply.protocol.features) == list(told.features)
    server.attach(reply.simulation.name).delete()


# ---------------------------------------------------------------- repeats

def changes(simulation):
    """State-changing requests of every kind, and what counts how often they were done."""
    name = simulation.name
    first = simulation.snapshot()
    values = common_pb2.Values(handles=simulation.handles(["node.structural.1.load"]), values=[1.0] * 6)
    return {
        "Step": pb.StepRequest(simulation=name, steps=2), "WriteVariables": pb.WriteVariablesRequest(simulation=name, values=values),
        "UpdateSimulation": pb.UpdateSimulationRequest(simulation=name, display_name="renamed"),
        "CreateSnapshot": pb.CreateSnapshotRequest(simulation=name),
        "RestoreSnapshot": pb.RestoreSnapshotRequest(simulation=name, snapshot=first.name),
        "DeleteSnapshot": pb.DeleteSnapshotRequest(simulation=name, snapshot=first.name),
        "ResetSimulation": pb.ResetSimulationRequest(simulation=name), "Interrupt": pb.InterruptRequest(simulation=name)}


def test_every_change_is_done_once_for_each_id(server):
    with server.load_text(decks.body()) as simulation:
        for method, request in changes(simulation).items():
            request.request_id = f"once {method}"
            call = getattr(server.simulations, method)
            first, second = call(request, metadata=server.metadata), call(request, metadata=server.metadata)
            assert first == second, method
            if method == "Step":
                assert simulation.refresh().step == 2
            if method == "CreateSnapshot":
                assert len(simulation.snapshots()) == 2
        gone = pb.DeleteSimulationRequest(simulation=simulation.name, request_id="end")
        for _ in range(2):
            server.simulations.DeleteSimulation(gone, metadata=server.metadata)
        with pytest.raises(grpc.RpcError) as caught:
            server.simulations.DeleteSimulation(pb.DeleteSimulationRequest(simulation=simulation.name), metadata=server.metadata)
        assert caught.value.code() == grpc.StatusCode.NOT_FOUND
        simulation._owned = False


def test_an_import_and_a_creation_are_done_once(server):
    with server.load_text(decks.body()) as simulation:
        data = simulation.export_state()

        def upload(data):
            yield pb.ImportSnapshotRequest(header=pb.ImportSnapshotHeader(simulation=simulation.name, request_id="import"))
            yield pb.ImportSnapshotRequest(data=data)

        first, second = (server.simulations.ImportSnapshot(upload(data), metadata=server.metadata) for _ in range(2))
        assert first == second and len(simulation.snapshots()) == 1
        with pytest.raises(grpc.RpcError, match="another request") as caught:
            server.simulations.ImportSnapshot(upload(data[:-1]), metadata=server.metadata)
        assert caught.value.code() == grpc.StatusCode.INVALID_ARGUMENT

    def create(text):
        header = pb.UploadHeader(bundle_main_file="deck", options=pb.CreateOptions(request_id="creation"))
        request = pb.InlineUpload(header=header, files=[common_pb2.FileChunk(path="deck", data=text.encode())])
        return server.simulations.CreateSimulationInline(request, metadata=server.metadata).simulation.name

    name = create(decks.body())
    assert create(decks.body()) == name
    with pytest.raises(grpc.RpcError, match="another request") as caught:
        create(decks.body(step="1.e-4"))
    assert caught.value.code() == grpc.StatusCode.INVALID_ARGUMENT
    server.attach(name).delete()


def test_an_id_with_another_request_or_too_long_is_refused_and_nothing_is_done(server):
    with server.load_text(decks.body()) as simulation:
        step = server.simulations.Step
        step(pb.StepRequest(simulation=simulation.name, steps=1, request_id="a"), metadata=server.metadata)
        for request in (pb.StepRequest(simulation=simulation.name, steps=2, request_id="a"),
                        pb.StepRequest(simulation=simulation.name, steps=1, request_id="x" * 129)):
            with pytest.raises(grpc.RpcError) as caught:
                step(request, metadata=server.metadata)
            error = mbcosim.errors.from_rpc_error(caught.value)
            assert (error.code, error.reason, error.field) == (grpc.StatusCode.INVALID_ARGUMENT, "BAD_ARGUMENT", "request_id")
        assert simulation.refresh().step == 1


def test_the_last_64_replies_are_kept(server):
    with server.load_text(decks.body()) as simulation:
        def step(k):
            return server.simulations.Step(pb.StepRequest(simulation=simulation.name, request_id=f"s{k}"), metadata=server.metadata)

        replies = [step(k) for k in range(65)]
        assert all(step(k) == replies[k] for k in range(1, 65)), "all of the last 64"
        assert simulation.refresh().step == 65
        assert step(0).step == 66, "the oldest is forgotten"


def test_a_repeat_during_the_first_waits_for_its_reply(server):
    with server.load_text(decks.body(), ports=PORT) as simulation:
        let_go = threading.Event()

        def answer(motion):
            let_go.wait(20 * TIME_FACTOR)
            return spring(motion)

        with simulation.couple("spring", answer, peer_timeout=60 * TIME_FACTOR):
            request = pb.StepRequest(simulation=simulation.name, request_id="slow")
            first = server.simulations.Step.future(request, metadata=server.metadata)
            wait_for(lambda: simulation.refresh().state == pb.SIMULATION_STATE_STEPPING)
            second = server.simulations.Step.future(request, metadata=server.metadata)
            with pytest.raises(grpc.FutureTimeoutError):
                second.result(0.5)
            let_go.set()
            assert first.result(20 * TIME_FACTOR) == second.result(20 * TIME_FACTOR)
        assert simulation.refresh().step == 1


def test_a_refused_request_may_be_tried_again_with_its_id(server):
    with server.load_text(decks.body()) as simulation:
        request = pb.StepRequest(simulation=simulation.name, request_id="again", expected_step=1)
        with pytest.raises(grpc.RpcError):
            server.simulations.Step(request, metadata=server.metadata)
        simulation.step()
        assert server.simulations.Step(request, metadata=server.metadata).step == 2


def test_a_stream_and_a_call_share_their_ids(server):
    with server.load_text(decks.body()) as simulation:
        request = pb.StepRequest(simulation=simulation.name, request_id="both")
        reply = server.simulations.Step(request, metadata=server.metadata)
        nameless = pb.StepRequest(request_id="both")
        stream = server.simulations.StepStream(iter([pb.StepRequest(simulation=simulation.name, steps=0), nameless]), metadata=server.metadata)
        next(stream)
        assert next(stream).step == reply
        assert simulation.refresh().step == 1


# ---------------------------------------------------------------- presence

LONG = 1001 * "x"  # longer than a name for people may be


@pytest.mark.parametrize("method, request_, field", [
    ("ListSimulations", pb.ListSimulationsRequest(page_size=0), "page_size"), ("ListSimulations", pb.ListSimulationsRequest(page_size=-1), "page_size"),
    ("DescribeSimulation", pb.DescribeSimulationRequest(page_size=0), "page_size"), ("Linearize", pb.LinearizeRequest(page_size=0), "page_size"),
    ("Linearize", pb.LinearizeRequest(page_token="1.7"), "page_token"), ("Linearize", pb.LinearizeRequest(page_token="?"), "page_token"),
    ("ComputeEigenvalues", pb.ComputeEigenvaluesRequest(count=0), "count"), ("ComputeEigenvalues", pb.ComputeEigenvaluesRequest(page_size=-3), "page_size"),
    ("ComputeEigenvalues", pb.ComputeEigenvaluesRequest(shift=float("nan")), "shift"),
    ("UpdateSimulation", pb.UpdateSimulationRequest(minimum_step_size=0.0), "minimum_step_size"),
    ("UpdateSimulation", pb.UpdateSimulationRequest(minimum_step_size=float("nan")), "minimum_step_size"),
    ("UpdateSimulation", pb.UpdateSimulationRequest(display_name=LONG), "display_name"),
    ("CreateSnapshot", pb.CreateSnapshotRequest(display_name=LONG), "display_name"),
    ("ForkSimulation", pb.ForkSimulationRequest(options=pb.CreateOptions(display_name=LONG)), "display_name"),
    ("Step", pb.StepRequest(step_size=0.0), "step_size"), ("Step", pb.StepRequest(step_size=-1.0), "step_size"),
    ("Step", pb.StepRequest(step_size=float("nan")), "step_size"), ("Step", pb.StepRequest(step_size=1e-20), "step_size"),
    ("Step", pb.StepRequest(steps=-1), "steps"), ("Step", pb.StepRequest(until_time=float("nan")), "until_time"),
])
def test_a_wrong_number_is_refused_by_its_field_and_nothing_is_applied(server, method, request_, field):
    with server.load_text(decks.body()) as simulation:
        if "simulation" in request_.DESCRIPTOR.fields_by_name:
            request_.simulation = simulation.name
        before = simulation.export_state()
        with pytest.raises(grpc.RpcError) as caught:
            getattr(server.simulations, method)(request_, metadata=server.metadata)
        error = mbcosim.errors.from_rpc_error(caught.value)
        assert (error.code, error.field) == (grpc.StatusCode.INVALID_ARGUMENT, field), str(error)
        assert simulation.export_state() == before


NAN, INFINITE = float("nan"), float("inf")
DURATION = duration_pb2.Duration


def until(**wrong):
    return pb.StepRequest(until=pb.Condition(**{"comparison": pb.COMPARISON_GREATER, "threshold": 1e9, **wrong}))


@pytest.mark.parametrize("request_, field", [
    (until(locate_within=0.0), "until.locate_within"), (until(locate_within=NAN), "until.locate_within"),
    (until(locate_within=INFINITE), "until.locate_within"), (until(locate_within=1e-30), "until.locate_within"),
    (until(threshold=NAN), "until.threshold"), (until(comparison=0), "until.comparison"), (until(comparison=77), "until.comparison"),
    (until(element=-1), "until.element"), (until(element=9), "until.element"),
    (pb.StepRequest(exact=True), "exact"), (pb.StepRequest(until_time=INFINITE, exact=True), "until_time"),
    (pb.StepRequest(inputs=common_pb2.Values(handles=[11], values=[1.0])), "inputs.values"),
    (pb.StepRequest(inputs=common_pb2.Values(handles=[11], values=[NAN] * 6)), "inputs.values")], ids=str)
def test_a_step_that_makes_no_sense_is_refused_by_its_field(server, request_, field):
    with server.load_text(decks.body()) as simulation:
        assert simulation.handles(["node.structural.1.load"]) == [11]
        request_.simulation = simulation.name
        refused(field, lambda: server.simulations.Step(request_, metadata=server.metadata))
        for rows in (pb.TableRequest(), pb.TableRequest(every=0)):
            wrong = pb.RunRequest(step=request_, table=rows)
            with pytest.raises(grpc.RpcError):
                list(server.simulations.Run(wrong, metadata=server.metadata))
        assert simulation.refresh().step == 0


@pytest.mark.parametrize("seconds", [0, -1, 10**12])
def test_a_wrong_span_is_refused_by_its_field(server, seconds):
    with server.load_text(decks.body()) as simulation:
        run = pb.RunRequest(step=pb.StepRequest(simulation=simulation.name), progress_interval=DURATION(seconds=seconds))
        refused("progress_interval", lambda: list(server.simulations.Run(run, metadata=server.metadata)))
        block = telemetry_pb2.SubscribeRequest(simulation=simulation.name, handles=[0], policy=telemetry_pb2.OVERFLOW_POLICY_BLOCK,
                                               block_timeout=DURATION(seconds=seconds))
        refused("block_timeout", lambda: next(server.telemetry.Subscribe(block, metadata=server.metadata)))
        assert simulation.refresh().step == 0


@pytest.mark.parametrize("seconds", [NAN, INFINITE, -INFINITE, 1e300])
def test_what_is_no_duration_is_refused_by_its_field_before_it_is_sent(server, seconds):
    with server.load_text(decks.body(), ports=PORT) as simulation:
        calls = {"lease": lambda: server.load_text(decks.body(), lease=seconds),
                 "checkpoint_interval": lambda: server.load_text(decks.body(), checkpoint_interval=seconds),
                 "deck_sockets.peer_timeout": lambda: server.load_text(decks.body(), deck_sockets=seconds),
                 "minimum_interval": lambda: simulation.subscribe([X], minimum_interval=seconds),
                 "peer_timeout": lambda: simulation.couple("spring", spring, peer_timeout=seconds),
                 "heartbeat_timeout": lambda: simulation.couple("spring", spring, heartbeat_timeout=seconds),
                 "heartbeat_interval": lambda: simulation.couple("spring", spring, server_timeout=seconds)}
        for field, call in calls.items():
            with pytest.raises(mbcosim.Error, match="is no duration of at most 1e.09 s") as caught:
                call()
            assert (caught.value.code, caught.value.field) == (grpc.StatusCode.INVALID_ARGUMENT, field)
        with simulation.couple("spring", spring, peer_timeout=9.0005):
            assert simulation.step().step == 1


def refused(field, call):
    with pytest.raises(grpc.RpcError) as caught:
        call()
    error = mbcosim.errors.from_rpc_error(caught.value)
    assert (error.code, error.field) == (grpc.StatusCode.INVALID_ARGUMENT, field), str(error)


def port(**wrong):
    return pb.CreateOptions(ports=[coupling_types_pb2.PortDefinition(**{"name": "p", "kind": 1, "node_labels": [1], **wrong})])


@pytest.mark.parametrize("options, field", [
    (pb.CreateOptions(display_name=LONG), "display_name"), (pb.CreateOptions(lease=DURATION()), "lease"), (pb.CreateOptions(minimum_step_size=NAN), "minimum_step_size"),
    (pb.CreateOptions(pace=pb.Pace(rate=NAN)), "pace.rate"), (pb.CreateOptions(pace=pb.Pace()), "pace.rate"),
    (pb.CreateOptions(durability=77), "durability"), (pb.CreateOptions(non_convergence_policy=77), "non_convergence_policy"),
    (pb.CreateOptions(request_id="x" * 129), "request_id"), (pb.CreateOptions(symbols={"x": pb.SymbolValue()}), "symbols"),
    (pb.CreateOptions(grants=[pb.Grant(identity="nobody", right=pb.RIGHT_OBSERVE)]), "grants.identity"),
    (pb.CreateOptions(grants=[pb.Grant(identity="token:", right=pb.RIGHT_OBSERVE)]), "grants.identity"),
    (pb.CreateOptions(grants=[pb.Grant(identity="*", right=pb.RIGHT_COUPLE, ports=["none"])]), "grants.ports"),
    (pb.CreateOptions(protocol=common_pb2.VersionRange(lowest=3, highest=2)), "protocol"),
    (pb.CreateOptions(protocol=common_pb2.VersionRange(lowest=-1, highest=2)), "protocol"),
    (port(name=""), "ports.name"), (port(kind=77), "ports.kind"), (port(offsets=[1.0]), "offsets"), (port(offsets=[0.0, NAN, 0.0]), "offsets"),
], ids=str)
def test_a_wrong_choice_at_creation_is_refused_by_its_field(server, options, field):
    upload = pb.InlineUpload(header=pb.UploadHeader(bundle_main_file="deck", options=options),
                             files=[common_pb2.FileChunk(path="deck", data=decks.body().encode())])
    before = len(server.list())
    refused(field, lambda: server.simulations.CreateSimulationInline(upload, metadata=server.metadata))
    assert len(server.list()) == before


@pytest.mark.parametrize("group, field, value", [
    ("schedule", "every", 0), ("schedule", "every", -2), ("iteration", "relaxation", 0.0), ("iteration", "relaxation", 2.0),
    ("iteration", "relaxation", float("nan")), ("iteration", "tolerance", 0.0), ("iteration", "tolerance", float("nan")),
    ("iteration", "maximum_passes", 0), ("expected", "step_size", 7.0), ("expected", "step", -1)])
def test_a_wrong_choice_of_a_peer_is_refused_by_name(server, group, field, value):
    from mbcosim import exchange
    with server.load_text(decks.body(), ports=PORT) as simulation:
        message = exchange.hello(simulation, "spring")
        setattr(getattr(message.hello, group), field, value)
        with pytest.raises(grpc.RpcError) as caught:
            next(server.coupling.Attach(iter([message]), metadata=server.metadata))
        error = mbcosim.errors.from_rpc_error(caught.value)
        assert error.reason == "PORT_MISMATCH" and set(error.metadata) == {field}
        assert simulation.step(0).step == 0


@pytest.mark.parametrize("lowest, highest", [(-1, 2), (3, 2), (0, 2)])
def test_versions_of_a_peer_that_are_no_range_are_refused_by_their_field(server, lowest, highest):
    from mbcosim import exchange
    with server.load_text(decks.body(), ports=PORT) as simulation:
        message = exchange.hello(simulation, "spring")
        message.hello.protocol.lowest, message.hello.protocol.highest = lowest, highest
        refused("protocol", lambda: next(server.coupling.Attach(iter([message]), metadata=server.metadata)))


def test_an_exchange_without_content_ends_the_peer(server):
    with server.load_text(decks.body(), ports=PORT) as simulation:
        from mbcosim import exchange
        stream = server.coupling.Attach(iter([exchange.hello(simulation, "spring"),
                                              coupling_pb2.PeerMessage(exchange=coupling_pb2.PeerExchange(index=1))]), metadata=server.metadata)
        next(stream)
        with pytest.raises(grpc.RpcError) as caught:
            list(stream)
        assert mbcosim.errors.from_rpc_error(caught.value).reason in ("OUT_OF_TURN", "BAD_ARGUMENT")


# ---------------------------------------------------------------- reset and pages

def test_reset_goes_back_to_the_initial_solution_bit_for_bit(server, tumbling):
    with server.load(tumbling) as simulation:
        start = simulation.export_state()
        simulation.step(20)
        later = simulation.export_state()
        saved = simulation.snapshot()
        simulation.reset()
        assert (simulation.step_number, simulation.time) == (0, 0.0) and simulation.export_state() == start
        simulation.step(20)
        assert simulation.export_state() == later
        with simulation.fork(saved) as branch:
            branch.reset()
            assert branch.export_state() == start


def test_pages_together_are_the_whole(server, tumbling):
    with server.load(tumbling) as simulation:
        name, stub = simulation.name, server.simulations
        for method, request, reply in (("Linearize", pb.LinearizeRequest(simulation=name, descriptor_form=True), pb.LinearizeReply),
                                       ("ComputeEigenvalues", pb.ComputeEigenvaluesRequest(simulation=name, eigenvectors=True),
                                        pb.ComputeEigenvaluesReply)):
            whole = getattr(stub, method)(request, metadata=server.metadata)
            assert not whole.next_page_token
            request.page_size = 10
            joined, pages = reply(), 0
            while pages == 0 or request.page_token:
                page = getattr(stub, method)(request, metadata=server.metadata)
                request.page_token, page.next_page_token = page.next_page_token, ""
                joined.MergeFrom(page)
                pages += 1
            assert pages > 3 and joined == whole, method
