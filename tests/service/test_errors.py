"""Bad input: each kind gets its code, reason and a clear message, and the daemon lives on."""
import os

import grpc
import pytest

import decks
import mbcosim
from mbcosim import bundle
from mbcosim.v1 import common_pb2, simulations_pb2 as pb


@pytest.fixture(autouse=True)
def daemon_survives(daemon, tumbling):
    yield
    with daemon.connect() as server, server.load(tumbling) as simulation:
        assert simulation.step().step == 1


BAD_DECKS = {
    "empty main file name": None,
    "binary junk": bytes(range(256)) * 40,
    "parentheses": b"set: real a = " + b"(" * 200000,
    "unknown card": decks.body().replace("body: 1, 1", "boddy: 1, 1").encode(),
    "missing semicolon": decks.body().replace("final time: 1.;", "final time: 1.").encode(),
    "label used twice": decks.body().replace("structural nodes: 1", "structural nodes: 2").replace(
        "end: nodes", "structural: 1, dynamic, null, eye, null, null; end: nodes").encode(),
    "step of size zero": decks.body(step="0.").encode(),
    "NaN": decks.body(step="0./0.").encode(),
    "include loop": b'include: "deck";',
    "include outside": b'include: "../../../../etc/passwd";',
    "absolute include": b'include: "/etc/passwd";',
    "missing include": b'include: "nothing.inc";',
}


@pytest.mark.parametrize("kind", [k for k in BAD_DECKS if BAD_DECKS[k]])
def test_bad_deck(server, kind):
    with pytest.raises((mbcosim.DeckError, mbcosim.LimitExceeded)) as caught:
        server.load_bundle("deck", {"deck": BAD_DECKS[kind]})
    error = caught.value
    assert error.code in (grpc.StatusCode.INVALID_ARGUMENT, grpc.StatusCode.RESOURCE_EXHAUSTED)
    assert any(d.severity == common_pb2.SEVERITY_ERROR and d.message for d in error.diagnostics)
    assert "root:" not in str(error)
    assert os.getcwd() not in str(error)


def test_a_loaded_node_without_inertia_is_singular(server):
    # Without a load every residual is zero from the start, and no matrix is ever needed.
    deck = decks.body().replace("rigid bodies: 1;", "forces: 1;").replace(
        "body: 1, 1, 1., null, diag, 1., 2., 3.;", "force: 1, absolute, 1, position, null, 0., 0., 1., const, 1.;")
    with pytest.raises(mbcosim.Error, match="the matrix is singular") as caught:
        server.load_text(deck)
    assert (caught.value.code, caught.value.reason) == (grpc.StatusCode.FAILED_PRECONDITION, "SINGULAR")
    assert caught.value.failure.worst_equations[0].owner == "structural node 1"


@pytest.mark.parametrize("name", ["", "/etc/passwd", "../x", "a/../../x", "folder/"])
def test_bad_file_names(server, name):
    with pytest.raises(mbcosim.Error) as caught:
        server.load_bundle(name, {name: decks.body().encode()})
    assert caught.value.code == grpc.StatusCode.INVALID_ARGUMENT


@pytest.mark.parametrize("data, kind", [("begin: data;", "str: say text.encode\\(\\)"), (3, "int"), (None, "NoneType")])
def test_files_of_a_bundle_are_bytes(server, data, kind):
    with pytest.raises(TypeError, match=f"the file 'deck' of a bundle must be bytes, got a {kind}"):
        server.load_bundle("deck", {"deck": data})
    with server.load_bundle("deck", {"deck": bytearray(decks.body().encode())}) as simulation:
        assert simulation.step().step == 1


def test_what_a_deck_names_below_its_folder_is_collected(tmp_path):
    folder, (deck, dots) = tmp_path / "models", (tmp_path / "models" / "deck", tmp_path / "models" / "..dots")
    dots.mkdir(parents=True)
    deck.write_text('include: "..dots/a.inc"; include: "../secret"; include: "../models2/b"; include: "."; include: "%s/deck";' % folder)
    (dots / "a.inc").write_text('include: "../c";')
    (folder / "c").write_text("")
    (tmp_path / "secret").write_text("")
    (tmp_path / "models2").mkdir()
    (tmp_path / "models2" / "b").write_text("")
    assert sorted(bundle.collect(deck)[1]) == ["..dots/a.inc", "c", "deck"]
    assert bundle._names_of("etc/passwd", "", "/") == ["etc/passwd"]  # of a deck in the root


@pytest.mark.parametrize("name", ["nothing.mbd", ".", "sub", ""])
def test_no_such_deck_in_the_root(server, name):
    with pytest.raises(mbcosim.Error) as caught:
        server.load_from_root(name)
    assert caught.value.code in (grpc.StatusCode.NOT_FOUND, grpc.StatusCode.INVALID_ARGUMENT)


def test_a_deck_of_the_root(server):
    with server.load_from_root("tumbling.mbd") as simulation:
        assert simulation.step().step == 1


def test_validate_collects_findings(server, tmp_path):
    deck = tmp_path / "deck"
    deck.write_text(decks.body().replace("diag, 1., 2., 3.", "diag, 1., 2., undefined_variable"))
    reply = server.validate(str(deck))
    assert not reply.ok
    finding = reply.diagnostics[0]
    assert (finding.file, finding.line) == ("deck", 9)
    assert "undefined_variable" in finding.source_line
    deck.write_text(decks.body())
    reply = server.validate(str(deck))
    assert reply.ok and reply.description.unknowns == 12


def call_error(call, request):
    with pytest.raises(mbcosim.Error) as caught:
        with mbcosim.errors.translated():
            call(request)
    return caught.value.code.name, caught.value.reason


def test_bad_arguments(server, tumbling):
    stub = server.simulations
    with server.load(tumbling) as s:
        load = s.variables["node.structural.1.load"].handle
        position = s.variables["node.structural.1.X"].handle
        values = common_pb2.Values
        table = [
            (stub.Step, pb.StepRequest(simulation="simulations/no"), "NOT_FOUND", "NO_SUCH_SIMULATION"),
            (stub.Step, pb.StepRequest(simulation=s.name, steps=-1), "INVALID_ARGUMENT", "BAD_ARGUMENT"),
            (stub.Step, pb.StepRequest(simulation=s.name, until_time=float("nan")), "INVALID_ARGUMENT", "BAD_ARGUMENT"),
            (stub.Step, pb.StepRequest(simulation=s.name, outputs=[-1]), "NOT_FOUND", "NO_SUCH_VARIABLE"),
            (stub.Step, pb.StepRequest(simulation=s.name, until=pb.Condition(handle=0)), "INVALID_ARGUMENT", "BAD_ARGUMENT"),
            (stub.Step, pb.StepRequest(simulation=s.name, until=pb.Condition(handle=0, element=1, comparison=1)),
             "INVALID_ARGUMENT", "BAD_ARGUMENT"),
            (stub.Step, pb.StepRequest(simulation=s.name, step_size=0.0), "INVALID_ARGUMENT", "BAD_ARGUMENT"),
            (stub.Step, pb.StepRequest(simulation=s.name, exact=True), "INVALID_ARGUMENT", "BAD_ARGUMENT"),
            (stub.Step, pb.StepRequest(simulation=s.name, inputs=values(handles=[load], values=[1.0])),
             "INVALID_ARGUMENT", "BAD_ARGUMENT"),
            (stub.Step, pb.StepRequest(simulation=s.name, inputs=values(handles=[load], values=[float("inf")] * 6)),
             "INVALID_ARGUMENT", "BAD_ARGUMENT"),
            (stub.Step, pb.StepRequest(simulation=s.name, inputs=values(handles=[position], values=[1.0] * 3)),
             "FAILED_PRECONDITION", "NOT_WRITABLE"),
            (stub.ReadVariables, pb.ReadVariablesRequest(simulation=s.name, handles=[10**6]), "NOT_FOUND", "NO_SUCH_VARIABLE"),
            (stub.GetSimulation, pb.GetSimulationRequest(simulation=""), "NOT_FOUND", "NO_SUCH_SIMULATION"),
            (stub.RestoreSnapshot, pb.RestoreSnapshotRequest(simulation=s.name, snapshot=s.name), "NOT_FOUND", "NO_SUCH_SNAPSHOT"),
            (stub.RestoreSnapshot, pb.RestoreSnapshotRequest(simulation=s.name, snapshot=s.name + "/snapshots/1x"), "NOT_FOUND", "NO_SUCH_SNAPSHOT"),
            (stub.ListSimulations, pb.ListSimulationsRequest(page_token="?"), "INVALID_ARGUMENT", "BAD_ARGUMENT"),
        ]
        for call, request, code, reason in table:
            assert call_error(call, request) == (code, reason), str(request)
        assert s.refresh().step == 0
        simple = pb.CreateOptions(protocol=common_pb2.VersionRange(lowest=7, highest=9))
        assert call_error(stub.ForkSimulation, pb.ForkSimulationRequest(simulation=s.name, options=simple)) == (
            "FAILED_PRECONDITION", "VERSION_MISMATCH")


def test_streams_out_of_turn(server):
    chunk = pb.UploadRequest(chunk=common_pb2.FileChunk(path="a", data=b"x"))
    assert call_error(server.simulations.CreateSimulation, iter([chunk])) == ("FAILED_PRECONDITION", "OUT_OF_TURN")
    assert call_error(server.simulations.CreateSimulation, iter([])) == ("FAILED_PRECONDITION", "OUT_OF_TURN")
    assert call_error(server.simulations.ImportSnapshot, iter([])) == ("FAILED_PRECONDITION", "OUT_OF_TURN")
