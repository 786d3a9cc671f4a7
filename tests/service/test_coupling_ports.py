"""Motion and modal ports, attached to decks that know nothing of them; ports of the deck's cards."""
import os

import numpy as np
import pytest

import decks
import mbcosim
from conftest import MODELS, wait_for
from mbcosim import exchange

# ---------------------------------------------------------------- motion

H = 1e-2
BEAM = """
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 10.; time step: 1.e-2; method: ms, 0.6; tolerance: 1.e-10;
  derivatives tolerance: 1.e-3; max iterations: 30; end: initial value;
begin: control data; structural nodes: {count}; rigid bodies: {bodies}; joints: {joints}; beams: {beams}; end: control data;
begin: nodes; {nodes} end: nodes;
begin: elements; {elements} end: elements;
"""
LAW = "linear elastic generic, diag, 1.e4, 1.e4, 1.e4, 50., 80., 80."  # no force at the start, where a peer gives none


def node(k, kind="dynamic"):
    return f"structural: {k}, {kind}, {k}., 0., 0., eye, null, null;"


def body(k, mass=1.0):
    return f"body: {k}, {k}, {mass}, null, diag, 0.1, 0.1, 0.1;"


def beam(k):
    return f"beam2: {k}, {k}, null, {k + 1}, null, eye, {LAW};"


def push(k, scale=1.0):
    """The motion starts with velocities: node k moves along z."""
    return f"structural: {k}, dynamic, {k}., 0., 0., eye, 0., 0., {scale}, null;"


def whole_beam():
    """Clamp at 1, beams 1-2 and 2-3, masses at 2 and 3."""
    elements = "joint: 1, clamp, 1, node, node;" + body(2) + body(3, 2.0) + beam(1) + beam(2)
    return BEAM.format(count=3, bodies=2, joints=1, beams=2, nodes=node(1, "static") + push(2, 0.5) + push(3, 1.0), elements=elements)


def root_half():
    elements = "joint: 1, clamp, 1, node, node;" + body(2) + beam(1)
    return BEAM.format(count=2, bodies=1, joints=1, beams=1, nodes=node(1, "static") + push(2, 0.5), elements=elements)


def tip_half():
    """Beam 2-3 with the mass at 3; node 2 has no mass here, its motion is imposed."""
    first = "structural: 2, static, 2., 0., 0., eye, 0., 0., 0.5, null;"
    return BEAM.format(count=2, bodies=1, joints=0, beams=1, nodes=first + push(3, 1.0), elements=body(3, 2.0) + beam(2))


def test_a_beam_cut_at_a_node_equals_the_uncut_beam(server):
    """Root and tip are two simulations of one daemon: the root sends its end's motion, the tip answers with its reactions."""
    steps = 40
    with server.load_text(whole_beam()) as uncut:
        uncut.step(steps)
        expected = [uncut[f"node.structural.{k}.{v}"] for k in (2, 3) for v in ("X", "Phi", "XP")]
    structural, motion = mbcosim.structural_port("cut", nodes=[2]), mbcosim.motion_port("cut", nodes=[2])
    with server.load_text(root_half(), ports=[structural]) as root, server.load_text(tip_half(), ports=[motion]) as tip:
        wanted = {}
        follower = tip.couple("cut", lambda m: (wanted["x"], wanted["R"]))
        start = tip.snapshot()

        def tip_reactions(m):
            nonlocal start
            if m.iteration == 1:
                start.delete()
                start = tip.snapshot()
            else:
                start.restore()
            wanted.update(x=m.x, R=m.rotations)
            load = tip.step(outputs=["port.cut.reactions"]).values["port.cut.reactions"]
            return [load[:3]], [load[3:]]

        with root.couple("cut", tip_reactions, mode="window", acceleration="iqn_ils", tolerance=1e-10, relaxation=0.1, maximum_passes=100) as peer:
            root.step(steps)
            assert peer.error is None
        follower.close()
        found = [s[f"node.structural.{k}.{v}"] for k, s in ((2, root), (3, tip)) for v in ("X", "Phi", "XP")]
        for a, b in zip(found, expected):
            assert a == pytest.approx(b, abs=1e-10)


def test_imposed_motion_and_its_reactions(server):
    """A body of 1 kg shaken along y: the peer's side gets minus its inertia force."""
    amplitude, omega = 0.1, 5.0
    times = []

    def shake(m):
        times.append((m.time, m.target_time))
        return [[0, amplitude * np.sin(omega * m.target_time) , 0]], np.eye(3)

    port = mbcosim.motion_port("shaker", nodes=[1])
    with server.load_text(decks.body(step="1.e-3", spin="null").replace("0., 1., 0.", f"0., {amplitude * omega}, 0."),
                          ports=[port]) as simulation:
        layout = simulation.describe().ports[0]
        assert list(layout.node_labels) == [1] and not layout.from_deck
        with simulation.couple("shaker", shake) as peer:
            result = simulation.step(500)
            assert peer.error is None
        t = result.time
        assert simulation["node.structural.1.X"] == pytest.approx([0, amplitude * np.sin(omega * t), 0], abs=1e-12)
        reaction = simulation["port.shaker.reactions"]
        assert reaction[1] == pytest.approx(amplitude * omega**2 * np.sin(omega * t), abs=5e-3)
        assert times[0] == (0.0, 1e-3)


def test_imposed_rotation_in_every_form(server):
    def rotation(angle, form):
        c, s = np.cos(angle), np.sin(angle)
        return {"matrix": [[c, -s, 0], [s, c, 0], [0, 0, 1]], "vector": [0, 0, angle], "euler_123": [0, 0, angle],
                "quaternion": [np.cos(angle / 2), 0, 0, np.sin(angle / 2)]}[form]

    found = []
    for form in ("matrix", "vector", "quaternion", "euler_123"):
        with server.load_text(decks.body(step="1.e-2", spin="null").replace("0., 1., 0.", "null"),
                              ports=[mbcosim.motion_port("turn", nodes=[1])]) as simulation:
            with simulation.couple("turn", lambda m: ([[0, 0, 0]], rotation(2 * m.target_time**2, form)), rotation=form) as peer:
                simulation.step(50)
                assert peer.error is None
            assert simulation["node.structural.1.Phi"] == pytest.approx([0, 0, 0.5], abs=1e-9)
            found.append(simulation["port.turn.reactions"])
    # inertia 3 kg m^2 about z, angular acceleration 4 rad/s^2: the body pulls back on the peer
    assert found[0][5] == pytest.approx(-12.0, rel=0.05)
    for other in found[1:]:
        assert other == pytest.approx(found[0], rel=1e-6, abs=1e-6)


def test_positions_only_leave_the_rotation_free(server):
    port = mbcosim.motion_port("hold", nodes=[1], positions_only=True)
    with server.load_text(decks.body(spin="0., 0., 1."), ports=[port]) as simulation:
        with simulation.couple("hold", lambda m: [[0, m.target_time, 0]]) as peer:
            simulation.step(100)
            assert peer.error is None
        assert simulation["node.structural.1.Phi"] == pytest.approx([0, 0, 0.1], abs=1e-7)


@pytest.mark.parametrize("port, match", [
    (mbcosim.motion_port("m", nodes=[7]), "no structural node 7"), (mbcosim.motion_port("m", nodes=[]), "no nodes"),
    (mbcosim.motion_port("m", nodes=[1, 1]), "listed twice"), (mbcosim.motion_port("", nodes=[1]), "must have a name"),
    (mbcosim.modal_port("m", 3), "no modal joint 3")])
def test_ports_that_do_not_fit_are_refused(server, port, match):
    with pytest.raises(mbcosim.Error, match=match) as caught:
        server.load_text(decks.body(), ports=[port])
    assert caught.value.reason == "BAD_ARGUMENT"


@pytest.mark.parametrize("answer, match", [
    (lambda m: [[0, 0]], "3 numbers"), (lambda m: ([[0, 0, 0]], 2 * np.eye(3)), "no rotation"),
    (lambda m: [[0, 0, 0]], "`rotations` must have 9"), (lambda m: mbcosim.Loads(positions=[0, 0, 0], rotations=np.eye(3), forces=[1, 2, 3]), "only")])
def test_wrong_motion_is_refused(server, answer, match, monkeypatch):
    monkeypatch.setattr(exchange.AnswerForm, "fault", lambda *_: None)
    with server.load_text(decks.body(), ports=[mbcosim.motion_port("m", nodes=[1])]) as simulation:
        with simulation.couple("m", answer, peer_timeout=5) as peer:
            with pytest.raises(mbcosim.StepFailed):
                simulation.step()
            wait_for(lambda: peer.error)
            assert peer.error.reason == "BAD_ARGUMENT" and match in str(peer.error)


@pytest.mark.parametrize("answer, text", [
    (lambda m: [[0, 0]], r"`positions` has the shape \(1, 2\); port .m. takes 1 x 3"), (lambda m: [[0, 0, 0]], "`rotations` is missing; port .m. takes 1 x 9"),
    (lambda m: ([[0, 0, 0]], np.eye(3), 0), "an answer of 3 parts; this port takes positions, rotations, or"),
    (lambda m: mbcosim.Loads(positions=[0, 0, 0], rotations=np.eye(3), forces=[1, 2, 3]), "`forces` .* port .m. takes none")])
def test_wrong_motion_is_told_to_the_peer(server, answer, text):
    with server.load_text(decks.body(), ports=[mbcosim.motion_port("m", nodes=[1])]) as simulation, simulation.couple("m", answer):
        with pytest.raises(mbcosim.StepFailed, match="the peer failed: ValueError: " + text):
            simulation.step()


def test_motion_has_no_zero(server):
    with server.load_text(decks.body(), ports=[mbcosim.motion_port("m", nodes=[1])]) as simulation:
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            simulation.couple("m", lambda m: None, policy="zero", frame="node")
        assert set(caught.value.metadata) == {"policy", "frame"}


def test_attached_motion_is_part_of_the_digest(server):
    with server.load_text(decks.body()) as plain, server.load_text(decks.body(), ports=[mbcosim.motion_port("m", nodes=[1])]) as other:
        assert plain.info.model_digest != other.info.model_digest
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            other.import_state(plain.export_state())
        assert caught.value.reason == "OTHER_MODEL"


def test_a_fork_has_the_ports_of_its_model(server):
    with server.load_text(decks.body(), ports=[mbcosim.motion_port("m", nodes=[1])]) as simulation:
        with simulation.couple("m", lambda m: ([[0, 0, 0]], np.eye(3))):
            simulation.step(2)
        with simulation.fork() as branch, branch.couple("m", lambda m: ([[0, 0, 0]], np.eye(3))):
            assert branch.step(2).step == 4


# ---------------------------------------------------------------- modal

def modal_deck(force=""):
    with open(os.path.join(MODELS, "modal_body.mbd")) as file:
        text = file.read()
    files = {name: open(os.path.join(MODELS, name), "rb").read() for name in ("modal_body_static.fem", "modal_body_dynamic.fem")}
    if force:
        text = text.replace("forces: 2;", "forces: 3;").replace("end: elements;", force + "\nend: elements;")
    files["deck"] = text.encode()
    return files


def test_modal_port_equals_a_modal_force(server):
    with server.load_bundle("deck", modal_deck("force: 99, modal, DYNAMIC, linear, 0., 0.02, linear, 0., -0.01;")) as reference:
        reference.step(100)
        expected = reference["node.structural.22.X"]
    port = mbcosim.modal_port("modes", 20)
    with server.load_bundle("deck", modal_deck(), ports=[port]) as simulation:
        layout = simulation.describe().ports[0]
        n = len(layout.mode_numbers)
        assert layout.output_size == 2 * n and layout.input_size == n and list(layout.node_labels) == [21]
        assert list(layout.output_names) == [f"q.{k}" for k in layout.mode_numbers] + [f"qP.{k}" for k in layout.mode_numbers]
        seen = []

        def answer(m):
            seen.append(m.signals)
            loads = np.zeros(n)
            loads[:2] = 0.02 * m.target_time, -0.01 * m.target_time
            return mbcosim.Loads(forces=[0, 0, 0], signals=loads)

        with simulation.couple("modes", answer) as peer:
            simulation.step(100)
            assert peer.error is None
        assert simulation["node.structural.22.X"] == pytest.approx(expected, abs=1e-10)
        assert np.any(seen[-1] != 0) and len(seen[-1]) == 2 * n


# ---------------------------------------------------------------- cards

CARDS = """
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 10.; time step: 1.e-2; tolerance: 1.e-8; max iterations: 20; end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 2; {counts} end: control data;
begin: nodes; structural: 1, dynamic, 1., 2., 3., eye, 0.5, 0., 0., null; structural: 2, dynamic, null, eye, null, 0., 0., 1.; end: nodes;
begin: elements; body: 1, 1, 1., null, eye; body: 2, 2, 1., null, eye; {cards} end: elements;
"""


def cards(text, counts):
    return CARDS.format(cards=text, counts=counts)


def watch(simulation, port, steps):
    seen = []
    with simulation.couple(port, lambda m: seen.append(m) or [], every=1) as peer:
        simulation.step(steps)
        assert peer.error is None
    return seen


def test_stream_output_sends_its_values(server):
    card = ('stream output: 1, stream name, "out", create, yes, local, "/tmp/nobody", no signal, non blocking, output every, 2, '
            "values, 3, 1, structural, 1, algebraic, drive, time, nodedof, 1, structural, 1, differential;")
    with server.load_text(cards(card, "output elements: 1;")) as simulation:
        layout = simulation.describe().ports[0]
        assert layout.from_deck and layout.optional and layout.default_every == 2 and layout.output_size == 3
        with simulation.couple("out", lambda m: []) as peer:
            simulation.step(10)
            assert peer.error is None and peer.exchanges == 5
        seen = watch(simulation, "out", 4)
        assert len(seen) == 4
        assert seen[0].signals == pytest.approx([1 + 0.5 * 0.1, 0.1, 0.5])


def test_a_stream_without_a_reader_delays_nobody(server):
    card = 'output element: 1, stream, stream name, "out", create, yes, path, "/x", motion, output flags, position, velocity, 1, 2;'
    with server.load_text(cards(card, "output elements: 1;")) as simulation:
        assert simulation.step(5).step == 5
        seen = watch(simulation, "out", 1)
        assert len(seen[0].signals) == 12 and seen[0].signals[:3] == pytest.approx([1 + 0.5 * 0.05, 2, 3])


def test_stream_motion_output(server):
    card = ('stream motion output: 1, stream name, "out", create, yes, path, "/x", output flags, position, orientation matrix, '
            "orientation matrix transpose, angular velocity, 2;")
    with server.load_text(cards(card, "output elements: 1;")) as simulation:
        signals = watch(simulation, "out", 20)[-1].signals
        R, Rt = signals[3:12].reshape(3, 3), signals[12:21].reshape(3, 3)
        assert R == pytest.approx(Rt.T) and R[1, 0] == pytest.approx(np.sin(0.19), abs=1e-4)
        assert signals[21:] == pytest.approx([0, 0, 1])


def test_mapping_keeps_the_power(server):
    """Three points see the mean and the difference of two; their forces come back by the transpose."""
    rows = ["0.5 0 0 0.5 0 0", "0 0.5 0 0 0.5 0", "0 0 0.5 0 0 0.5", "1 0 0 -1 0 0", "0 1 0 0 -1 0", "0 0 1 0 0 -1"]
    sparse = [f"{i + 1} {j + 1} {v}" for i, row in enumerate(rows) for j, v in enumerate(row.split()) if float(v)]
    found = []
    for kind, text in (("full", "\n".join(rows)), ("sparse", "# row column value\n" + "\n".join(sparse))):
        card = ('force: 5, external structural mapping, grpc, port, "map", coupling, loose, points number, 2, 1, offset, 0., 1., 0., '
                f'2, offset, null, mapped points number, from file, {kind} mapping file, "H.dat", mapped labels file, "labels.dat";')
        files = {"deck": cards(card, "forces: 1;").encode(), "H.dat": text.encode() + b"\n", "labels.dat": b"10\n20\n"}
        with server.load_bundle("deck", files) as simulation:
            layout = simulation.describe().ports[0]
            assert list(layout.point_labels) == [10, 20] and list(layout.node_labels) == [1, 2]
            seen = []
            with simulation.couple("map", lambda m: seen.append(m) or [[2.0, 0, 0], [0, 0, 3.0]]) as peer:
                simulation.step(3)
                assert peer.error is None
            x1, x2 = np.array([1., 3., 3.]), np.zeros(3)
            assert seen[0].x == pytest.approx(np.array([(x1 + x2) / 2, x1 - x2]))
            loads = simulation["port.map.loads"].reshape(2, 6)
            assert loads == pytest.approx(np.array([[1, 0, 3, 0, 0, 0], [1, 0, -3, 0, 0, 0]]))
            assert simulation["node.structural.1.XP"][0] == pytest.approx(0.5 + 0.03, abs=1e-2)
            found.append(simulation.export_state())


def test_a_mapping_takes_the_load_of_its_reference_node(server):
    card = 'force: 5, external structural mapping, grpc, port, "map", reference node, 2, points number, 1, 1, offset, null;'
    with server.load_text(cards(card, "forces: 1;")) as simulation:
        layout = simulation.describe().ports[0]
        assert layout.reference_loads and layout.reference_node_label == 2
        before = simulation["node.structural.2.XP"]
        loads = mbcosim.Loads(forces=[[0.0, 0, 0]], reference_force=[0, 0, 4.0], reference_moment=[0.0, 0, 0])
        with simulation.couple("map", lambda m: loads) as peer:
            simulation.step(3)
            assert peer.error is None
        assert simulation["port.map.loads"] == pytest.approx([0] * 6 + [0, 0, 4.0, 0, 0, 0])
        assert simulation["node.structural.2.XP"][2] > before[2]


@pytest.mark.parametrize("frame", ["global", "reference", "node"])
@pytest.mark.parametrize("rotation, size", [("matrix", (3, 3)), ("vector", (3,)), ("quaternion", (4,)), ("euler_123", (3,))])
def test_the_motion_of_a_reference_node_is_told(server, rotation, size, frame):
    """In the global frame, whatever that of the points is."""
    ports = [mbcosim.structural_port("p", nodes=[2], reference=1)]
    with server.load_text(cards("", ""), ports=ports) as simulation:
        names = [f"node.structural.1.{what}" for what in ("X", "R", "XP", "Omega", "XPP", "OmegaP")]
        expected, seen = [simulation[name] for name in names], []
        with simulation.couple("p", lambda m: seen.append(m.reference) or np.zeros((1, 3)), rotation=rotation, frame=frame, accelerations=True) as peer:
            simulation.step()
            assert peer.error is None
    told = seen[0]
    for found, value in zip((told.x, told.v, told.w, told.a, told.wp), expected[:1] + expected[2:]):
        assert np.array_equal(found, np.ravel(value))
    assert told.rotation.shape == size
    if rotation == "matrix":
        assert np.array_equal(told.rotation, np.reshape(expected[1], (3, 3)))


def test_ports_without_a_reference_node_tell_none(server):
    with server.load_text(cards("", ""), ports=[mbcosim.structural_port("p", nodes=[2])]) as simulation:
        seen = []
        with simulation.couple("p", lambda m: seen.append(m) or np.zeros((1, 3))):
            simulation.step()
        assert seen[0].reference is None


def test_external_modal_mapping_of_the_deck(server):
    """One mode, twice the path of node 1 along axis 1."""
    card = 'force: 5, external modal mapping, grpc, port, "modes", nodes number, 1, 1, modes number, 1, sparse mapping file, "H.dat";'
    files = {"deck": cards(card, "forces: 1;").encode(), "H.dat": b"1 1 2.\n"}
    with server.load_bundle("deck", files) as simulation:
        layout = simulation.describe().ports[0]
        assert (layout.input_size, layout.output_size) == (1, 2) and not layout.point_labels
        x, v = simulation["node.structural.1.X"], simulation["node.structural.1.XP"]
        seen = []
        with simulation.couple("modes", lambda m: seen.append(m.signals) or [3.0]) as peer:
            simulation.step(3)
            assert peer.error is None
        assert seen[0] == pytest.approx([0, 2 * v[0]])
        moved = simulation["node.structural.1.X"] - x
        assert simulation["port.modes.modes"] == pytest.approx([2 * moved[0], 2 * simulation["node.structural.1.XP"][0]])
        assert simulation["port.modes.loads"] == pytest.approx(3.0)


def test_external_modal_of_the_deck(server):
    card = 'force: 99, external modal, grpc, port, "modes", DYNAMIC, type, modal;'
    with server.load_bundle("deck", modal_deck(card)) as simulation, server.load_bundle(
            "deck", modal_deck(), ports=[mbcosim.modal_port("modes", 20)]) as attached:
        layout = simulation.describe().ports[0]
        assert layout.from_deck and len(layout.node_labels) == 0
        n = layout.input_size
        with simulation.couple("modes", lambda m: -5.0 * m.signals[:n]), attached.couple(
                "modes", lambda m: mbcosim.Loads(forces=[0, 0, 0], signals=-5.0 * m.signals[:n])):
            simulation.step(50), attached.step(50)
        assert simulation["node.structural.22.X"] == pytest.approx(attached["node.structural.22.X"], abs=1e-10)


def test_tangent_of_a_modal_port(server):
    card = 'force: 99, external modal, grpc, port, "modes", DYNAMIC, type, modal;'
    totals = []
    for tangent in ("dense", "none"):
        with server.load_bundle("deck", modal_deck(card)) as simulation:
            n = simulation.describe().ports[0].input_size

            def answer(m):
                loads = -50.0 * m.signals[:n] - 0.5 * m.signals[n:]
                if tangent == "none":
                    return loads
                return mbcosim.Loads(signals=loads, stiffness=-50.0 * np.eye(n), damping=-0.5 * np.eye(n))

            with simulation.couple("modes", answer, mode="tight", tangent=tangent, tolerance=1e-10) as peer:
                total = simulation.step(30).total_iterations
                assert peer.error is None
            totals.append((total, simulation["node.structural.22.X"]))
    assert totals[0][0] < totals[1][0] and totals[0][1] == pytest.approx(totals[1][1], abs=1e-7)


@pytest.mark.parametrize("card, counts, match", [
    ('stream output: 1, create, yes;', "output elements: 1;", "`stream name` expected"),
    ('stream output: 1, stream name, "", 1, drive, time;', "output elements: 1;", "name of the stream is empty"),
    ('stream output: 1, stream name, "a", output every, 0, 1, drive, time;', "output elements: 1;", "at least 1"),
    ('stream output: 1, stream name, "a", 0;', "output elements: 1;", "number of channels"),
    ('force: 1, external modal, grpc, port, "a", 3;', "forces: 1;", "joint 3"),
    ('force: 1, external modal, grpc, port, "a", reference node, 1, type, all;', "forces: 1;", "needs a modal joint"),
    ('force: 1, external structural mapping, grpc, port, "a", points number, 0;', "forces: 1;", "number of points"),
    ('force: 1, external structural mapping, grpc, port, "a", points number, 1, 1, null;', "forces: 1;", "`offset` expected"),
    ('force: 1, external structural mapping, grpc, port, "a", points number, 1, 1, offset, null, membrane, 1, 2, 1, 2, .1, -.1;', "forces: 1;",
     "`membrane` is not supported"),
    ('force: 1, external structural, grpc, port, "a", 1, 1; force: 2, external modal, grpc, port, "a", reference node, 1;', "forces: 2;",
     "port named \"a\" already")])
def test_bad_cards_are_refused(server, card, counts, match):
    with pytest.raises(mbcosim.DeckError) as caught:
        server.load_text(cards(card, counts))
    assert match in str(caught.value) or any(match in d.message + d.hint for d in caught.value.diagnostics)


def test_optional_ports_hold_their_inputs_until_a_peer_has_come(server):
    card = 'force: 99, external modal, grpc, port, "modes", DYNAMIC, type, modal;'
    push = np.linspace(-1.0, 1.0, len(server_inputs(server, card)))
    with server.load_bundle("deck", modal_deck(card), optional_ports=True) as alone, server.load_bundle("deck", modal_deck(card)) as coupled:
        assert [port.optional for port in alone.describe().ports] == [True]
        alone["port.modes.loads"] = push
        with coupled.couple("modes", lambda m: push):
            coupled.step(20), alone.step(20)
        assert alone["node.structural.22.X"] == pytest.approx(coupled["node.structural.22.X"], abs=1e-12) and alone["node.structural.22.X"][2] != 0
        with alone.fork(optional_ports=True) as fork:
            fork.step(1)
        with alone.couple("modes", lambda m: push):
            alone.step(1)
        with pytest.raises(mbcosim.TimedOut):  # from now on it is like any other
            alone.step(1, timeout=0.5)


def server_inputs(server, card):
    with server.load_bundle("deck", modal_deck(card)) as simulation:
        return simulation["port.modes.loads"]


def test_a_rigid_external_modal_port(server):
    card = 'force: 1, external modal, grpc, port, "a", reference node, 1;'
    with server.load_text(cards(card, "forces: 1;")) as simulation:
        with simulation.couple("a", lambda m: mbcosim.Loads(forces=[0, 2.0, 0], moments=[0, 0, 1.0])) as peer:
            simulation.step(10)
            assert peer.error is None
        assert simulation["node.structural.1.XP"] == pytest.approx([0.5, 0.2, 0], abs=2e-2)  # a load that jumps at the start


def test_outputs_may_be_expressions(server):
    from mbcosim.v1 import coupling_types_pb2 as types
    port = mbcosim.signal_port("s", ["time"], [])
    port.output_expressions.append(types.OutputExpression(name="reach", expression="sqrt(x^2 + y^2) + 1.", unit="m", variables={
        "x": "node.structural.1.X[0]", "y": "node.structural.1.X[1]"}))
    with server.load_text(cards("", ""), ports=[port]) as simulation:
        layout = simulation.describe().ports[0]
        assert list(layout.output_names) == ["time", "reach"] and layout.output_size == 2
        seen = watch(simulation, "s", 2)
        assert seen[0].signals == pytest.approx([0, np.hypot(1, 2) + 1])


@pytest.mark.parametrize("expression, variables, match", [
    ("x +", {"x": "time"}, "expression"), ("x + y", {"x": "time"}, "y"), ("x", {"x": "nothing"}, "nothing"),
    ("x", {"x": "node.structural.1.X[3]"}, "X[3]"), ("x", {"x": "node.structural.1.X"}, "number")])
def test_bad_expressions_are_refused(server, expression, variables, match):
    from mbcosim.v1 import coupling_types_pb2 as types
    port = mbcosim.signal_port("s", [], [])
    port.output_expressions.append(types.OutputExpression(name="e", expression=expression, variables=variables))
    with pytest.raises(mbcosim.Error) as caught:
        server.load_text(cards("", ""), ports=[port])
    assert match in str(caught.value) and caught.value.code.name in ("INVALID_ARGUMENT", "NOT_FOUND")
