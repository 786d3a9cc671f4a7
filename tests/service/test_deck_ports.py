"""Ports that the deck declares: `external structural` forces and stream drivers."""
import numpy as np
import pytest

import decks
import mbcosim
from conftest import TIME_FACTOR, wait_for
from mbcosim import exchange
from test_coupling import STIFFNESS, exact, spring

STEP = 1e-3  # [s]; a load that starts with a step acts during a part of it only
DECK = """
begin: data; problem: initial value; end: data;
begin: initial value;
  initial time: 0.; final time: 10.; time step: {step};
  method: ms, 0.6; tolerance: 1.e-9; max iterations: 20;
end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 2; forces: 1; {counts} end: control data;
begin: nodes;
  structural: 1, dynamic, null, eye, 0., 1., 0., null;
  structural: 2, dynamic, 1., 0., 0., {turned}, null, null;
end: nodes;
{drivers}
begin: elements; body: 1, 1, 1., null, diag, 1., 1., 1.; body: 2, 2, 1., null, diag, 1., 1., 1.; {force} end: elements;
"""


def deck(force, step="1.e-3", turned="eye", counts="", drivers=""):
    return DECK.format(force=force, step=step, turned=turned, counts=counts, drivers=drivers)


def external(options, **more):
    return deck(f"force: 5, external structural, {options};", **more)


def test_names_of_ports_may_have_any_bytes(server):
    """Texts of the service are UTF-8: other bytes are told as "?"."""
    text = external('grpc, port, "fl\u00fcgel", coupling, loose, 1, 1').encode("latin-1")
    with server.load_bundle("deck", {"deck": text}) as simulation:
        assert [port.name for port in simulation.describe().ports] == ["fl?gel"]
        with simulation.couple("fl?gel", spring) as peer:
            simulation.step(3)
            assert peer.exchanges == 3


def test_a_peer_couples_to_the_decks_port(server):
    with server.load_text(external('grpc, port, "spring", coupling, loose, 1, 1')) as simulation:
        layout = simulation.describe().ports[0]
        assert (layout.name, list(layout.node_labels), layout.from_deck) == ("spring", [1], True)
        with simulation.couple("spring", spring) as peer:
            simulation.step(200)
            assert peer.exchanges == 200 and peer.error is None
        assert simulation["node.structural.1.X"][1] == pytest.approx(exact(0.2), abs=3e-3)
        assert simulation["node.structural.1.load"] == pytest.approx(np.zeros(6))


def test_it_gives_what_a_port_of_the_client_gives(server):
    found = []
    for text, ports in [(external('grpc, port, "p", 1, 1'), ()),
                        (external('grpc, port, "unused", 1, 2'), [mbcosim.structural_port("p", nodes=[1])])]:
        with server.load_text(text, ports=ports) as simulation, simulation.couple("p", spring):
            if ports:
                simulation.couple("unused", lambda motion: np.zeros((1, 3)))
            simulation.step(100)
            found.append(simulation["node.structural.1.X"])
    assert found[0] == pytest.approx(found[1], abs=1e-12)


def test_the_coupling_word_is_the_default_mode(server):
    for word, iterations in [("loose", {0}), ("staggered", {0}), ("tight", {1, 2, 3})]:
        seen = set()

        def answer(motion):
            seen.add(motion.iteration)
            return spring(motion)

        with server.load_text(external(f'grpc, port, "p", coupling, {word}, 1, 1')) as simulation:
            with simulation.couple("p", answer, acceleration="iqn_ils"):
                simulation.step(3)
        assert seen & iterations and (word == "tight" or seen == {0})


def test_points_with_offsets_on_one_node(server):
    text = external('grpc, port, "p", 2, 1, offset, 0., 1., 0., 1, offset, 0., -1., 0.')
    with server.load_text(text) as simulation, simulation.couple("p", lambda m: [[1.0, 0, 0], [3.0, 0, 0]]):
        simulation.step(100)
        assert simulation["node.structural.1.XP"][0] == pytest.approx(4 * 0.1, abs=4 * STEP)
        assert simulation["node.structural.1.Omega"][2] == pytest.approx(2 * 0.1, abs=2 * STEP)


def test_a_reference_node_takes_the_total_load(server):
    turned = "euler, 0., 0., pi/2."
    text = external('grpc, port, "p", reference node, 2, 1, 1', turned=turned)
    with server.load_text(text) as simulation:
        assert simulation.describe().ports[0].reference_loads

        def answer(motion):  # in the frame of node 2, whose x axis is the global y axis
            assert motion.x[0] == pytest.approx([0, 1, 0], abs=1e-2)
            return [[1.0, 0, 0]], [[0, 0, 0]], [2.0, 0, 0], [0, 0, 0]

        with simulation.couple("p", answer) as peer:
            simulation.step()
            assert peer.error is None
        loads = simulation["port.p.loads"].reshape(-1, 6)
        assert loads[0, :3] == pytest.approx([0, 1, 0], abs=1e-9)
        assert loads[1, :3] == pytest.approx([0, 2, 0], abs=1e-9)
        simulation.refresh()


def test_missing_reference_loads_are_told(server, monkeypatch):
    with server.load_text(external('grpc, port, "p", reference node, 2, 1, 1')) as simulation:
        with simulation.couple("p", lambda motion: [[1.0, 0, 0]], peer_timeout=5) as peer:
            with pytest.raises(mbcosim.StepFailed, match='`reference_force` is missing; port "p" takes 3 numbers on its reference node'):
                simulation.step()
            monkeypatch.setattr(exchange.AnswerForm, "fault", lambda *_: None)  # the server looks, too
            with pytest.raises(mbcosim.StepFailed):
                simulation.step()
            wait_for(lambda: peer.error)
            assert "reference_force" in str(peer.error)


def test_without_a_peer_the_step_fails(server):
    text = external('grpc, port, "p", 1, 1')
    with server.load_text(text) as simulation:
        with simulation.couple("p", spring, peer_timeout=0.5 * TIME_FACTOR):
            simulation.step()
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        with pytest.raises(mbcosim.StepFailed, match='port "p": the peer is gone'):
            simulation.step()


STREAM = 'begin: drivers; file: 1, stream, name, "push", create, yes, 2, initial values, 0.5, 0.; end: drivers;'
PUSHED = "force: 1, absolute, 1, position, null, 1., 0., 0., file, 1, 1;"


def test_a_stream_is_a_port_that_may_stay_empty(server):
    with server.load_text(deck(PUSHED, counts="file drivers: 1;", drivers=STREAM)) as simulation:
        port = simulation.describe().ports[0]
        assert (port.name, port.optional, list(port.input_names)) == ("push", True, ["stream.push"])
        simulation.step(100)
        assert simulation["node.structural.1.XP"][0] == pytest.approx(0.05, rel=1e-6)
        with simulation.couple("push", lambda motion: [2.0, 0.0]) as peer:
            simulation.step(100)
            assert peer.exchanges == 100
        assert simulation["node.structural.1.XP"][0] == pytest.approx(0.25, abs=2 * STEP)


def test_a_clients_port_may_take_the_stream_over(server):
    ports = [mbcosim.signal_port("controller", outputs=["node.structural.1.X"], inputs=["stream.push"])]
    with server.load_text(deck(PUSHED, counts="file drivers: 1;", drivers=STREAM), ports=ports) as simulation:
        assert [port.name for port in simulation.describe().ports] == ["controller"]
        with simulation.couple("controller", lambda motion: [1.0, 0.0]):
            simulation.step(100)
        assert simulation["node.structural.1.XP"][0] == pytest.approx(0.1, abs=STEP)


def test_two_ports_of_one_name_are_refused(server):
    with pytest.raises(mbcosim.Error, match='two ports are named "p"'):
        server.load_text(external('grpc, port, "p", 1, 1'), ports=[mbcosim.structural_port("p", nodes=[2])])
    with pytest.raises(mbcosim.DeckError, match='there is a port named "p" already'):
        server.load_text(external('grpc, port, "p", 1, 1; force: 6, external structural, grpc, port, "p", 1, 2').replace(
            "forces: 1", "forces: 2"))
