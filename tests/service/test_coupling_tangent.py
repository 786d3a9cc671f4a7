"""Tight coupling with derivatives from the peer: Newton's iteration of the model that is not cut."""
import numpy as np
import pytest

import mbcosim
from conftest import redone_alike, wait_for
from mbcosim import exchange

DECK = """
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 10.; time step: 1.e-2; method: ms, 0.6; tolerance: 1.e-9;
  derivatives tolerance: 1.e-3; max iterations: 20; end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 2; joints: {joints}; skip initial joint assembly; end: control data;
begin: nodes;
  structural: 1, dynamic, 0., 0., 0., eye, 0., 3., 0., 0.2, 0.1, 4.;
  structural: 2, dynamic, 1.2, 0., 0., eye, 0., -2., 1., 1., 0., -3.;
end: nodes;
begin: elements;
  body: 1, 1, 1., null, diag, 0.1, 0.2, 0.3;
  body: 2, 2, 2., null, diag, 0.3, 0.2, 0.1;
  {rod}
end: elements;
"""
K, C = 5000.0, 3.0
ARMS = np.array([[0.1, 0.2, 0.0], [-0.1, 0.1, 0.05]])


def unstressed_length():
    """Rod without force at the start: a peer's loads begin with the first step, those of the deck's rod before it."""
    d = np.array([1.2, 0, 0]) + ARMS[1] - ARMS[0]
    v = np.array([0, -2, 1]) + np.cross([1, 0, -3], ARMS[1]) - np.array([0, 3, 0]) - np.cross([0.2, 0.1, 4], ARMS[0])
    length = np.linalg.norm(d)
    return float(length + C / K * (v @ d) / length)


LENGTH = unstressed_length()
ROD = ("joint: 1, rod, 1, position, {}, 2, position, {}, {}, linear viscoelastic, {}, {};".format(
    *(", ".join(map(str, a)) for a in ARMS), LENGTH, K * LENGTH, C * LENGTH))
PORTS = [mbcosim.structural_port("rod", nodes=[1, 2], offsets=ARMS)]


def rod(motion):
    """A viscoelastic rod between the two points, with its derivatives."""
    d, v = motion.x[1] - motion.x[0], motion.v[1] - motion.v[0]
    l = np.linalg.norm(d)
    e, rate = d / l, v @ d / l
    pull = K * (l - LENGTH) + C * rate
    P = (np.eye(3) - np.outer(e, e)) / l
    # d(pull e)/dd and d(pull e)/dv
    dd = K * np.outer(e, e) + C * np.outer(e, P @ v) + pull * P
    dv = C * np.outer(e, e)
    stiffness, damping = np.zeros((12, 12)), np.zeros((12, 12))
    for i, si in ((0, 1), (6, -1)):
        for j, sj in ((0, -1), (6, 1)):
            stiffness[i:i + 3, j:j + 3] = si * sj * dd
            damping[i:i + 3, j:j + 3] = si * sj * dv
    return mbcosim.Loads(forces=[pull * e, -pull * e], stiffness=stiffness, damping=damping)


def whole():
    return DECK.format(joints=1, rod=ROD)


def cut():
    return DECK.format(joints=0, rod="")


def test_cut_equals_uncut_with_the_same_iterations(server):
    with server.load_text(whole()) as uncut, server.load_text(cut(), ports=PORTS) as simulation:
        with simulation.couple("rod", rod, mode="tight", tangent="dense") as peer:
            for _ in range(100):
                expected, found = uncut.step(), simulation.step()
                assert found.iterations == expected.iterations
            assert peer.error is None
        for name in ("node.structural.1.X", "node.structural.2.X", "node.structural.1.Phi", "node.structural.2.Omega"):
            assert simulation[name] == pytest.approx(uncut[name], abs=1e-10)


def test_without_the_tangent_it_takes_more(server):
    def plain(motion):
        return rod(motion).forces

    with server.load_text(cut(), ports=PORTS) as simulation:
        with simulation.couple("rod", rod, mode="tight", tangent="dense"):
            quick = simulation.step(20).total_iterations
    with server.load_text(cut(), ports=PORTS) as simulation:
        with simulation.couple("rod", plain, mode="tight", tolerance=1e-8):
            assert simulation.step(20).total_iterations > 1.5 * quick


def test_blocks_of_the_nodes(server):
    """Springs to the ground: nothing couples the nodes, blocks say it all."""
    k = 2000.0

    def ground(motion):
        blocks = np.zeros((2, 6, 6))
        blocks[:, :3, :3] = -k * np.eye(3)
        return mbcosim.Loads(forces=-k * motion.x, stiffness=blocks)

    results = []
    for tangent in ("block_diagonal", "none"):
        with server.load_text(cut(), ports=PORTS) as simulation:
            answer = ground if tangent != "none" else lambda m: ground(m).forces
            with simulation.couple("rod", answer, mode="tight", tangent=tangent, tolerance=1e-12) as peer:
                result = simulation.step(20)
                results.append((simulation["node.structural.2.X"], result.total_iterations, peer.exchanges))
                assert peer.error is None
    assert results[0][0] == pytest.approx(results[1][0], abs=1e-8)
    assert results[0][1] < results[1][1]


def test_restored_steps_are_the_same_bits(server):
    with server.load_text(cut(), ports=PORTS) as simulation, simulation.couple("rod", rod, mode="tight", tangent="dense"):
        assert redone_alike(simulation, 10, 10, simulation.export_state)


def test_an_unfinished_peer_keeps_the_step_open(server):
    with server.load_text(cut(), ports=PORTS) as simulation:
        iterations = []

        def answer(motion):
            iterations.append(motion.iteration)
            loads = rod(motion)
            loads.unfinished = motion.iteration < 9
            return loads

        with simulation.couple("rod", answer, mode="tight", tangent="dense"):
            simulation.step()
        assert iterations == list(range(1, 10))


def test_who_leaves_takes_the_tangent_along(server):
    with server.load_text(cut(), ports=PORTS) as simulation:
        with simulation.couple("rod", rod, mode="tight", tangent="dense", policy="zero"):
            simulation.step(5)
        with simulation.couple("rod", lambda m: np.zeros((2, 3)), mode="loose"):
            simulation.step(5)
        with server.load_text(cut()) as free:
            before = simulation["node.structural.1.XP"]
            with simulation.couple("rod", lambda m: np.zeros((2, 3)), mode="loose"):
                assert simulation.step(5).iterations <= free.step(5).iterations + 1
            assert simulation["node.structural.1.XP"] == pytest.approx(before, abs=1e-3)  # the method damps the jump


@pytest.mark.parametrize("options, what", [
    (dict(mode="loose", tangent="dense"), {"tangent"}),
    (dict(mode="tight", tangent="dense", frame="node"), {"tangent"}),
    (dict(mode="tight", tangent="dense", acceleration="aitken"), {"acceleration"}),
    (dict(mode="tight", tangent="dense", heartbeat_timeout=0.001, every=-1), {"heartbeat_timeout", "every"})])
def test_choices_that_do_not_fit_are_refused_at_once(server, options, what):
    with server.load_text(cut(), ports=PORTS) as simulation:
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            simulation.couple("rod", rod, **options)
        assert caught.value.reason == "PORT_MISMATCH" and set(caught.value.metadata) == what


@pytest.mark.parametrize("tangent, given, match", [
    ("none", np.zeros((12, 12)), "not announced"), ("dense", np.zeros((6, 6)), "144 numbers"),
    ("block_diagonal", np.zeros((12, 12)), "72 numbers"), ("dense", np.full((12, 12), np.nan), "not finite")])
def test_a_wrong_tangent_ends_the_stream(server, tangent, given, match, monkeypatch):
    monkeypatch.setattr(exchange.AnswerForm, "fault", lambda *_: None)
    with server.load_text(cut(), ports=PORTS) as simulation:
        answer = lambda m: mbcosim.Loads(forces=np.zeros((2, 3)), stiffness=given)
        with simulation.couple("rod", answer, mode="tight", tangent=tangent, peer_timeout=2) as peer:
            with pytest.raises(mbcosim.StepFailed):
                simulation.step()
            wait_for(lambda: peer.error)
            assert peer.error.reason == "BAD_ARGUMENT" and match in str(peer.error)
        assert simulation.refresh().step == 0


@pytest.mark.parametrize("tangent, given, text", [
    ("none", np.zeros((12, 12)), "takes none without `tangent` of the peer"), ("dense", np.zeros((2, 6, 6)), "takes 12 x 12"),
    ("block_diagonal", np.zeros((12, 12)), "takes 2 x 6 x 6")])
def test_a_wrong_tangent_is_told_by_its_shape(server, tangent, given, text):
    with server.load_text(cut(), ports=PORTS) as simulation:
        with simulation.couple("rod", lambda m: mbcosim.Loads(np.zeros((2, 3)), damping=given), mode="tight", tangent=tangent):
            with pytest.raises(mbcosim.StepFailed, match="the peer failed: ValueError: `damping` has the shape .*" + text):
                simulation.step()


def test_every_mismatch_of_layout_and_version(server):
    from mbcosim.coupling import open_stream
    with server.load_text(cut(), ports=PORTS) as simulation:
        message = exchange.hello(simulation, "rod")
        hello = message.hello
        expected = hello.expected
        expected.kind, expected.input_size, expected.output_size, expected.step_size = 4, 3, 2, 1.0
        expected.output_names.append("q")
        expected.node_labels.extend([2, 1])
        expected.model_digest = "0" * 16
        hello.protocol.lowest = hello.protocol.highest = 7
        import grpc
        from mbcosim.errors import from_rpc_error
        with pytest.raises(grpc.RpcError) as caught:
            next(open_stream(server._channel)(iter([message]), metadata=server.metadata))
        error = from_rpc_error(caught.value)
        assert error.reason == "VERSION_MISMATCH"
        assert set(error.metadata) - {"lowest", "highest"} == {
            "protocol", "model_digest", "kind", "input_size", "output_size", "output_names",
            "node_labels", "step_size"}
