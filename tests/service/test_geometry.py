"""What viewers get: geometry in terms of nodes, in messages of bounded size."""
import os

import numpy as np
import pytest

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
