"""What viewers get: geometry in terms of nodes, in messages of bounded size."""
import os

import numpy as np
import pytest

import decks
import mbcosim
from conftest import MODELS
from mbcosim.v1 import geometry_pb2, geometry_pb2_grpc

CHAIN = """
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 1.e-3; end: initial value;
begin: control data; structural nodes: {n}; rigid bodies: {n}; joints: {n}; end: control data;
begin: nodes;
  for: integer k = 1, {n}; structural: k, dynamic, real(k), 0., 0., eye, null, null; end for;
end: nodes;
begin: elements;
  for: integer k = 1, {n}; body: k, k, 1., 0., 0.5, 0., diag, 1., 2., 3.; end for;
  for: integer k = 1, {n} - 1;
    joint: k, rod, k, position, 0., 0.25, 0., k + 1, 1., linear elastic, 1.;
  end for;
  joint: {n}, clamp, 1, node, node;
end: elements;
"""


def points(geometry):
    """Positions of all points, as told and as a viewer computes them from the nodes."""
    nodes = {n.label: (np.array(n.position), np.array(n.orientation).reshape(3, 3)) for n in geometry.nodes}
    for element in geometry.elements:
        for point in element.points:
            if point.HasField("node_label"):
                x, R = nodes[point.node_label]
                yield np.array(point.position), x + R @ np.array(point.offset)
            else:
                yield np.array(point.position), np.array(point.offset)


def test_points_follow_their_nodes(server, pendulum):
    with server.load(pendulum) as simulation:
        simulation.step(100)
        geometry = simulation.geometry()
        assert geometry.header.step == 100 and geometry.header.time == simulation.time
        assert geometry.header.model_digest == simulation.info.model_digest
        for told, computed in points(geometry):
            assert np.allclose(told, computed, atol=1e-12)
        node = geometry.nodes[-1]
        x = simulation.read([v.name for v in simulation.describe().variables if v.handle == node.position_handle])
        assert np.array_equal(list(x.values())[0], node.position)


def test_ten_thousand_bodies_pass_default_limits(daemon, server):
    n = 10_000
    with server.load_text(CHAIN.format(n=n)) as simulation:
        import grpc
        with grpc.insecure_channel(daemon.address) as channel:  # with a client's default limit of 4 MiB
            stub = geometry_pb2_grpc.GeometryStub(channel)
            replies = list(stub.DescribeGeometry(geometry_pb2.DescribeGeometryRequest(simulation=simulation.name)))
        assert max(r.ByteSize() for r in replies) < 1 << 20
        assert sum(len(r.nodes.nodes) for r in replies) == n
        elements = [e for r in replies for e in r.elements.elements]
        assert len(elements) == 2 * n
        body = next(e for e in elements if e.family == "body")
        assert body.masses[0].mass == 1.0 and list(body.masses[0].principal_moments) == [1.0, 2.0, 3.0]
        assert sum(len(e.lines) for e in elements) == n - 1


def test_a_flexible_body_has_its_points_and_shapes(server):
    with server.load(os.path.join(MODELS, "modal_body_dynamic.mbd" if os.path.exists(
            os.path.join(MODELS, "modal_body_dynamic.mbd")) else "modal_body.mbd")) as simulation:
        geometry = simulation.geometry()
        assert geometry.modal_points and not simulation.geometry(modal_points=False).modal_points
        for part in geometry.modal_points:
            modes = len(part.amplitude_handles)
            assert len(part.positions) == 3 * len(part.labels) and len(part.shapes) == 3 * modes * len(part.labels)
        first = geometry.modal_points[0]
        assert first.count == sum(len(p.labels) for p in geometry.modal_points if p.joint_label == first.joint_label)


def test_wrong_requests_are_refused(server, pendulum):
    with server.load(pendulum) as simulation:
        for samples in (1, 0, -5, 1001):
            with pytest.raises(mbcosim.Error, match="line_samples") as caught:
                simulation.geometry(line_samples=samples)
            assert caught.value.reason == "BAD_ARGUMENT"
        gone = simulation.name
    with pytest.raises(mbcosim.NotFound):
        server.attach(gone)


def cards_of(daemon, simulation):
    """The deck's cards by (of a node?, family, label)."""
    import grpc
    with grpc.insecure_channel(daemon.address) as channel:
        request = geometry_pb2.DescribeGeometryRequest(simulation=simulation.name, without_modal_points=True, cards=True)
        replies = list(geometry_pb2_grpc.GeometryStub(channel).DescribeGeometry(request))
    assert max(r.ByteSize() for r in replies) < 1 << 20
    return {(card.of_node, card.family, card.label): card for r in replies for card in r.cards.cards}


def test_cards_stand_there_as_they_are_written(daemon, server):
    deck = os.path.join(MODELS, "cantilever_dead_load.mbd")
    with server.load(deck) as simulation, simulation.fork() as branch:
        cards = cards_of(daemon, simulation)
        model = simulation.describe()
        assert set(cards) == ({(True, node.family, node.label) for node in model.nodes}
                              | {(False, element.family, element.label) for element in model.elements})
        for card in cards.values():
            with open(os.path.join(MODELS, card.file), encoding="utf-8") as file:
                text = file.read()
            begin = sum(len(line) for line in text.splitlines(keepends=True)[:card.line - 1]) + card.column - 1
            assert not card.cut and card.text.endswith(";") and text[begin:].startswith(card.text)
        assert {card.file for card in cards.values()} == {"cantilever.inc"}  # the main file only includes it
        assert cards_of(daemon, branch) == cards


def test_cards_of_ten_thousand_bodies_come_in_messages_of_bounded_size(daemon, server):
    with server.load_text(CHAIN.format(n=10_000)) as simulation:
        cards = cards_of(daemon, simulation)
        assert len(cards) == 30_000
        assert cards[False, "body", 77].text == "body: k, k, 1., 0., 0.5, 0., diag, 1., 2., 3.;"


def test_a_card_that_is_very_long_is_told_by_its_beginning(daemon, server):
    lines = "\n".join(f"    # {k}" for k in range(1000))
    text = CHAIN.format(n=2).replace("  joint: 2, clamp,", f"  joint: 2,\n{lines}\n clamp,")
    with server.load_text(text) as simulation:
        card = cards_of(daemon, simulation)[False, "joint", 2]
        assert card.cut and card.text.startswith("joint: 2,\n    # 0\n") and 3900 < len(card.text) <= 4000


def test_what_a_client_attaches_has_no_card(daemon, server):
    with server.load_text(decks.body(), ports=[mbcosim.motion_port("hand", nodes=[1])]) as simulation:
        elements = {(False, element.family, element.label) for element in simulation.describe().elements}
        assert elements - set(cards_of(daemon, simulation))


def attachments_of(daemon, simulation):
    """What is attached to a simulation's deck, by path."""
    import grpc
    with grpc.insecure_channel(daemon.address) as channel:
        request = geometry_pb2.DescribeGeometryRequest(simulation=simulation.name, attachments=True)
        replies = list(geometry_pb2_grpc.GeometryStub(channel).DescribeGeometry(request))
    assert max(r.ByteSize() for r in replies) < 1 << 20
    files = {}
    for reply in replies:
        if reply.WhichOneof("content") == "attachment":
            files[reply.attachment.path] = files.get(reply.attachment.path, b"") + reply.attachment.data
    return files


ATTACHED = {
    "arm.view.json": b'{"meshes": [{"node": 1, "file": "parts/arm.stl"}, {"file": "floor.gltf"}, {"file": "lost.obj"}]}',
    "parts/arm.stl": bytes(range(256)) * 6000,  # comes in pieces
    "floor.gltf": b'{"buffers": [{"uri": "floor.bin"}]}',
    "floor.bin": b"floor",
}


def write_attached(folder):
    """A deck with a sidecar, what that names, and what it does not."""
    (folder / "parts").mkdir(parents=True)
    (folder / "arm.mbd").write_text(CHAIN.format(n=2))
    for name, data in {**ATTACHED, "other.stl": b"other", "other.view.json": b"{}"}.items():
        (folder / name).write_bytes(data)
    return str(folder / "arm.mbd")


def test_a_sidecar_comes_with_what_it_names_also_to_forks(daemon, server, tmp_path):
    with server.load(write_attached(tmp_path)) as simulation, simulation.fork() as branch:
        assert attachments_of(daemon, simulation) == attachments_of(daemon, branch) == ATTACHED
    with server.load_text(CHAIN.format(n=2)) as simulation:
        assert attachments_of(daemon, simulation) == {}


def test_a_sidecar_of_the_model_root_names_nothing_outside_the_decks_folder(start_daemon, tmp_path):
    write_attached(tmp_path / "root" / "arm")
    (tmp_path / "root" / "secret").write_text("secret")
    (tmp_path / "root" / "arm" / "link").symlink_to(tmp_path / "root" / "secret")
    (tmp_path / "root" / "arm" / "arm.view.json").write_text('{"meshes": [{"file": "../secret"}, {"file": "%s"}, {"file": "link"}, {"file": "floor.bin"}]}'
                                                          % (tmp_path / "root" / "secret"))
    daemon = start_daemon("--model-root", str(tmp_path / "root"))
    with daemon.connect() as server, server.load_from_root("arm/arm.mbd") as simulation:
        assert set(attachments_of(daemon, simulation)) == {"arm.view.json", "floor.bin"}


def test_a_sidecar_is_stored_with_its_simulation(start_daemon, tmp_path):
    (tmp_path / "state").mkdir()
    daemon = start_daemon("--state-dir", str(tmp_path / "state"))
    with daemon.connect() as server:
        simulation = server.load(write_attached(tmp_path / "deck"))
        daemon.kill()
    again = start_daemon("--state-dir", str(tmp_path / "state"))
    with again.connect() as server:
        assert attachments_of(again, server.attach(simulation.name)) == ATTACHED


def test_attached_files_that_are_larger_than_a_deck_may_be_are_refused(start_daemon, tmp_path):
    write_attached(tmp_path / "deck")
    daemon = start_daemon("--model-root", str(tmp_path / "deck"), "--limit-deck-bytes", "1000000")
    with daemon.connect() as server:
        with pytest.raises(mbcosim.Error, match="attached to the deck are larger") as caught:
            server.load_from_root("arm.mbd")
        assert caught.value.metadata["limit"] == "deck_bytes"


@pytest.mark.parametrize("text", [b"{", b"[" * 100000, b'"' + b"x" * 100000, b"\xff\xfe", b'{"meshes": [{"file": "\\u0000"}, {"file": ""}]}'])
def test_a_sidecar_that_is_no_json_is_told_as_it_is(daemon, server, text):
    with server.load_bundle("arm.mbd", {"arm.mbd": CHAIN.format(n=2).encode(), "arm.view.json": text}) as simulation:
        assert attachments_of(daemon, simulation) == {"arm.view.json": text}
