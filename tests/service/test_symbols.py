"""Values for the deck's symbols at load, descriptions in pages, decks in one message, errors that name their field."""
import grpc
import pytest

import decks
import mbcosim
from mbcosim.v1 import common_pb2, simulations_pb2 as pb
from test_geometry import CHAIN

DECK = "set: const real h = 1.e-3; set: integer n = 2; set: string tag = \"a\"; set: bool on = FALSE; set: n = n + 1;\n" + decks.body(step="h")


def test_a_given_value_takes_the_place_of_the_declared_one(server):
    with server.load_text(DECK) as plain, server.load_text(DECK, symbols={"h": 2e-3, "tag": "b", "on": True, "n": 7}) as given:
        assert (plain.info.next_step_size, given.info.next_step_size) == (1e-3, 2e-3)
        assert plain.info.model_digest != given.info.model_digest
        symbols = {s.name: s for s in given.describe().symbols}
        assert symbols["h"].constant and symbols["h"].given and symbols["h"].declared.number == 2e-3
        assert (symbols["n"].declared.number, symbols["n"].value.number, symbols["n"].type) == (7, 8, "integer")
        assert symbols["tag"].value.text == "b" and symbols["on"].value.flag
        assert not any(s.given for s in plain.describe().symbols)
        with given.fork() as branch:
            assert [s.name for s in branch.describe().symbols] == ["h", "n", "on", "tag"]


@pytest.mark.parametrize("symbols, text", [
    ({"H": 1.0}, "did you mean"), ({"n": 1.5}, "declares an integer"), ({"h": "x"}, "declares a real"), ({"on": 1}, "declares a bool")])
def test_wrong_values_are_findings_about_the_deck(server, symbols, text):
    with pytest.raises(mbcosim.DeckError, match=text) as caught:
        server.load_text(DECK, symbols=symbols)
    assert [d.code for d in caught.value.diagnostics] == ["symbol"]


def test_a_symbol_without_a_value_is_refused_by_field(server):
    header = pb.UploadHeader(bundle_main_file="deck")
    header.options.symbols["h"].SetInParent()
    request = pb.InlineUpload(header=header, files=[common_pb2.FileChunk(path="deck", data=DECK.encode())])
    with pytest.raises(grpc.RpcError) as caught:
        server.simulations.CreateSimulationInline(request, metadata=server.metadata)
    error = mbcosim.errors.from_rpc_error(caught.value)
    assert (error.code, error.reason, error.field) == (grpc.StatusCode.INVALID_ARGUMENT, "BAD_ARGUMENT", "symbols")


def test_a_deck_in_one_message_is_the_deck_in_many(server):
    files = [common_pb2.FileChunk(path="a.mbd", data=b"include: \"b.inc\";\n"),
             common_pb2.FileChunk(path="b.inc", data=DECK[:50].encode()), common_pb2.FileChunk(path="b.inc", data=DECK[50:].encode())]
    request = pb.InlineUpload(header=pb.UploadHeader(bundle_main_file="a.mbd"), files=files)
    checked = server.simulations.ValidateModelInline(request, metadata=server.metadata)
    assert checked.ok and [s.name for s in checked.description.symbols] == ["h", "n", "on", "tag"]
    reply = server.simulations.CreateSimulationInline(request, metadata=server.metadata)
    with server.attach(reply.simulation.name) as inline:
        with server.load_bundle("a.mbd", {"a.mbd": files[0].data, "b.inc": DECK.encode()}) as streamed:
            assert inline.info.model_digest == streamed.info.model_digest
            names = ["node.structural.1.X", "node.structural.1.Phi"]
            inline.step(10), streamed.step(10)
            assert all((inline.read(names)[n] == streamed.read(names)[n]).all() for n in names)
        inline.delete()


def test_a_wrong_message_leaves_nothing(server):
    before = len(server.list())
    for request, code in [(pb.InlineUpload(), "INVALID_ARGUMENT"),
                          (pb.InlineUpload(header=pb.UploadHeader(bundle_main_file="x")), "INVALID_ARGUMENT")]:
        with pytest.raises(grpc.RpcError) as caught:
            server.simulations.CreateSimulationInline(request, metadata=server.metadata)
        assert caught.value.code().name == code
    assert len(server.list()) == before


def test_descriptions_come_in_pages_that_pass_default_limits(daemon, server):
    with server.load_text(CHAIN.format(n=10_000)) as simulation, grpc.insecure_channel(daemon.address) as channel:
        from mbcosim.v1 import simulations_pb2_grpc
        stub = simulations_pb2_grpc.SimulationsStub(channel)  # with a client's default limit of 4 MiB
        request, pages = pb.DescribeSimulationRequest(simulation=simulation.name), []
        while not pages or request.page_token:
            pages.append(stub.DescribeSimulation(request))
            request.page_token = pages[-1].next_page_token
        assert max(p.ByteSize() for p in pages) < 4 << 20 and len(pages) > 2
        assert sum(len(p.model.nodes) for p in pages) == 10_000
        assert list(next(e for p in pages for e in p.model.elements if e.family == "joint").nodes) == [1, 2]
        whole = simulation.describe()
        assert [v.handle for v in whole.variables] == list(range(len(whole.variables)))
        assert len(whole.elements) == 20_000


def test_a_few_names_cost_no_description(server, pendulum):
    with server.load(pendulum) as simulation:
        found = simulation.handles(["node.structural.1.X"])
        assert simulation._description is None
        assert found == [simulation.variables["node.structural.1.X"].handle]
    with server.load(pendulum) as simulation, pytest.raises(KeyError, match="node.structural.1.Q"):
        simulation.read(["node.structural.1.Q"])


def test_wrong_pages_are_refused_by_field(server, pendulum):
    with server.load(pendulum) as simulation:
        for request, field in [(pb.DescribeSimulationRequest(simulation=simulation.name, page_size=-1), "page_size"),
                               (pb.DescribeSimulationRequest(simulation=simulation.name, page_token="x"), "page_token"),
                               (pb.DescribeSimulationRequest(simulation=simulation.name, page_token="-5"), "page_token")]:
            with pytest.raises(mbcosim.Error) as caught:
                simulation._call(simulation._stub.DescribeSimulation, request)
            assert caught.value.field == field
