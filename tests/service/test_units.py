"""Systems of units: what a deck declares, how descriptions name it, and how ports convert for peers that count in another."""
import asyncio
import os
import subprocess

import grpc
import numpy as np
import pytest

import decks
import mbcosim
import mbcosim.aio
from conftest import BIN, wait_for
from mbcosim import exchange
from mbcosim.v1 import common_pb2, coupling_types_pb2, simulations_pb2 as pb
from test_analysis import OSCILLATOR, S
from test_coupling_ports import modal_deck
from test_coupling_record import replay
from test_coupling_tangent import ARMS, K, rod

SI, TONNE, BY_FORCE = mbcosim.units("m", mass="kg", time="s"), mbcosim.units("mm", mass="t", time="s"), mbcosim.units("mm", force="N", time="s")
MILLI, INCHES = mbcosim.units("mm", mass="kg", time="ms"), mbcosim.units("in", force="lbf", time="s")
# how many of the system's units of length, mass and time are in one of SI
FACTORS = {"SI": (SI, 1, 1, 1), "mm t s": (TONNE, 1e3, 1e-3, 1), "mm N s": (BY_FORCE, 1e3, 1e-3, 1), "mm kg ms": (MILLI, 1e3, 1, 1e3),
           "in lbf s": (INCHES, 1 / 0.0254, 0.0254 / 4.4482216152605, 1)}
X, XP, LOAD, OMEGA = (f"node.structural.1.{name}" for name in ("X", "XP", "load", "Omega"))
CARD = 'units: length, "mm", mass, "t", time, "s";'


def triple(values):
    return ", ".join(f"{float(v)!r}" for v in values)


def bodies(L, M, T, card=""):
    """Two free bodies in a system that has L, M and T units in a metre, a kilogram and a second."""
    tolerance = min(M * L / T**2, M * L * L / T**2)  # of forces, or of moments
    nodes = [((0, 0, 0), (0, 3, 0), (0.2, 0.1, 4)), ((1.2, 0, 0), (0, -2, 1), (1, 0, -3))]
    lines = "".join(f"structural: {k}, dynamic, {triple(np.multiply(x, L))}, eye, {triple(np.multiply(v, L / T))}, {triple(np.divide(w, T))};"
                    for k, (x, v, w) in enumerate(nodes, 1))
    inertia = [triple(np.multiply(J, M * L * L)) for J in ((0.1, 0.2, 0.3), (0.3, 0.2, 0.1))]
    return f"""
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: {10.0 * T!r}; time step: {1e-2 * T!r}; method: ms, 0.6; tolerance: {1e-9 * tolerance!r};
  derivatives tolerance: {1e-3 * tolerance!r}; max iterations: 20; end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 2; {card} end: control data;
begin: nodes; {lines} end: nodes;
begin: elements; body: 1, 1, {1.0 * M!r}, null, diag, {inertia[0]}; body: 2, 2, {2.0 * M!r}, null, diag, {inertia[1]}; end: elements;
"""


def port_in(L):
    return [mbcosim.structural_port("rod", nodes=[1, 2], offsets=ARMS * L)]


def plain_rod(motion):
    return rod(motion).forces


def small(card="", step="1.e-3", **options):
    """A body of 1 t that moves with 1 mm/s along y."""
    return decks.body(final_time="100.", step=step, spin="null", **options).replace("rigid bodies: 1;", f"rigid bodies: 1; {card}")


# ---------------------------------------------------------------- the same motion

@pytest.fixture(scope="module")
def motion_in_si(daemon):
    """Function: positions and angular velocities of both bodies after 10 steps with the rod of a peer, whatever the deck is written in."""
    known = {}

    def run(name, mode, tangent="none", **options):
        if (name, mode, tangent) not in known:
            units, L, M, T = FACTORS[name]
            with daemon.connect() as server, server.load_text(bodies(L, M, T), ports=port_in(L), units=units) as simulation:
                with simulation.couple("rod", rod if tangent != "none" else plain_rod, mode=mode, tangent=tangent, units=SI, **options) as peer:
                    for _ in range(10):
                        simulation.step()
                    assert peer.error is None
                found = simulation.read([f"node.structural.{k}.{v}" for k in (1, 2) for v in ("X", "Omega")])
            known[name, mode, tangent] = [np.array(v) / (L if name.endswith("X") else 1 / T) for name, v in found.items()]
        return known[name, mode, tangent]

    return run


@pytest.mark.parametrize("mode, options, within", [
    ("loose", {}, 1e-9), ("staggered", {}, 1e-9), ("tight", dict(tangent="dense"), 1e-9), ("tight", dict(tolerance=1e-9), 1e-7),
    ("window", dict(acceleration="iqn_ils", tolerance=1e-10, maximum_passes=100), 1e-7)], ids=["loose", "staggered", "tangent", "tight", "window"])
@pytest.mark.parametrize("name", [name for name in FACTORS if name != "SI"])
def test_a_deck_in_other_units_moves_alike_with_the_same_peer(motion_in_si, name, mode, options, within):
    """Within the tolerance of the steps, 1e-9, or of the interface."""
    expected = motion_in_si("SI", mode, **options)
    assert np.abs(expected[0]).max() > 0.1  # it moves
    for a, b in zip(motion_in_si(name, mode, **options), expected):
        assert a == pytest.approx(b, abs=within)


def test_tangents_in_the_peers_units_keep_newton_as_quick(server):
    iterations = []
    for name in ("SI", "mm t s", "mm kg ms"):
        units, L, M, T = FACTORS[name]
        with server.load_text(bodies(L, M, T), ports=port_in(L), units=units) as simulation:
            with simulation.couple("rod", rod, mode="tight", tangent="dense", units=SI):
                iterations.append([simulation.step().iterations for _ in range(20)])
    assert all(abs(a - b) <= 1 for other in iterations[1:] for a, b in zip(iterations[0], other)), iterations


def test_blocks_of_tangents_are_converted(server):
    def ground(motion):
        blocks = np.zeros((2, 6, 6))
        blocks[:, :3, :3] = -K * np.eye(3)
        return mbcosim.Loads(forces=-K * motion.x, stiffness=blocks, damping=0 * blocks)

    taken = {}
    for name, tangent in (("SI", "block_diagonal"), ("mm t s", "block_diagonal"), ("mm t s", "none")):
        units, L, M, T = FACTORS[name]
        answer = ground if tangent != "none" else lambda motion: ground(motion).forces
        with server.load_text(bodies(L, M, T), ports=port_in(L), units=units) as simulation:
            with simulation.couple("rod", answer, mode="tight", tangent=tangent, tolerance=1e-11, units=SI) as peer:
                taken[name, tangent] = simulation.step(20).total_iterations, simulation[X] / L
                assert peer.error is None
    (_, in_si), (quick, converted), (slow, _) = taken.values()
    assert quick < slow and converted == pytest.approx(in_si, abs=1e-9)


def test_a_spring_of_the_peer_gives_the_closed_form(server):
    """1 t and 400 N/mm, in kg and N/m the peer's 400000 N/m: ω = sqrt(k/m) = 20 rad/s."""
    with server.load_text(small(), ports=[mbcosim.structural_port("spring", nodes=[1])], units=BY_FORCE) as simulation:
        with simulation.couple("spring", lambda m: -400e3 * m.x, mode="tight", tolerance=1e-10, units=SI) as peer:
            result = simulation.run_until(0.2)
            assert peer.error is None
        assert result.time == pytest.approx(0.2) and simulation[X][1] == pytest.approx(np.sin(20 * result.time) / 20, abs=3e-5)
        assert simulation[LOAD][1] == pytest.approx(-400.0 * simulation[X][1], rel=1e-8)


def test_a_peer_in_the_decks_own_units_changes_no_bit(server):
    found = []
    for options in ({}, dict(units=TONNE), dict(units=BY_FORCE)):
        with server.load_text(bodies(*FACTORS["mm t s"][1:]), ports=port_in(1e3), units=TONNE) as simulation:
            with simulation.couple("rod", lambda motion: -0.4 * motion.x, **options) as peer:
                simulation.step(20)
                assert peer.error is None
            found.append(simulation[X].tobytes())
    assert found[0] == found[1] == found[2]


# ---------------------------------------------------------------- what crosses

def test_all_of_a_motion_is_converted(server):
    units, L, M, T = FACTORS["mm kg ms"]
    seen = []

    def look(motion):
        seen.append(motion)
        return np.zeros((2, 3))

    with server.load_text(bodies(L, M, T), ports=port_in(L), units=units) as simulation:
        with simulation.couple("rod", look, mode="loose", accelerations=True, units=SI) as peer:
            assert peer.welcome.step_size == pytest.approx(1e-2) and peer.welcome.layout.units == SI == peer.welcome.agreed.units
            assert simulation.step().time == pytest.approx(10.0)
            x, v, w, wp, a = (simulation[name] for name in (X, XP, OMEGA, "node.structural.1.OmegaP", "node.structural.1.XPP"))
            simulation.step()
            assert peer.error is None
        last = seen[-1]
        assert last.time == pytest.approx(1e-2) and last.target_time == pytest.approx(2e-2)
        arm = last.rotations[0] @ ARMS[0]
        assert last.x[0] == pytest.approx(x / L + arm, abs=1e-9)
        assert last.w[0] == pytest.approx(w * T, abs=1e-9)
        assert last.v[0] == pytest.approx(v * T / L + np.cross(w * T, arm), abs=1e-9)
        wp, w = wp * T**2, w * T
        assert last.wp[0] == pytest.approx(wp, abs=1e-6)
        assert last.a[0] == pytest.approx(a * T**2 / L + np.cross(wp, arm) + np.cross(w, np.cross(w, arm)), abs=1e-6)
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        with simulation.couple("rod", look, mode="tight", units=SI) as peer:
            simulation.step()
            wait_for(lambda: peer.accepted)
            assert peer.accepted == [(3, pytest.approx(3e-2))]


def test_the_motion_of_a_reference_node_is_converted(server):
    units, L, M, T = FACTORS["mm kg ms"]
    seen = []
    with server.load_text(bodies(L, M, T), ports=[mbcosim.structural_port("rod", nodes=[2], reference=1)], units=units) as simulation:
        x, v, w, a, wp = (simulation[name] for name in (X, XP, OMEGA, "node.structural.1.XPP", "node.structural.1.OmegaP"))
        with simulation.couple("rod", lambda m: seen.append(m.reference) or np.zeros((1, 3)), accelerations=True, units=SI) as peer:
            simulation.step()
            assert peer.error is None
    for found, value in zip((seen[0].x, seen[0].v, seen[0].w, seen[0].a, seen[0].wp), (x / L, v * T / L, w * T, a * T**2 / L, wp * T**2)):
        assert found == pytest.approx(value, rel=1e-12, abs=1e-15)


def test_moments_are_converted_apart_from_forces(server):
    with server.load_text(bodies(*FACTORS["mm t s"][1:]), ports=[mbcosim.structural_port("rod", nodes=[1, 2])], units=TONNE) as simulation:
        with simulation.couple("rod", lambda m: ([[1, 2, 3], [0, 0, 0]], [[0.1, 0.2, 0.3], [0, 0, 0]]), units=SI) as peer:
            simulation.step()
            assert peer.error is None
        assert simulation[LOAD] == pytest.approx([1, 2, 3, 100, 200, 300])


def test_signals_are_converted_by_the_units_of_their_variables(server):
    port = mbcosim.signal_port("signals", outputs=[X, "time", "node.structural.1.R"], inputs=[LOAD])
    port.output_expressions.append(coupling_types_pb2.OutputExpression(name="speed", expression="v", unit="mm/s", variables={"v": XP + "[1]"}))
    port.output_expressions.append(coupling_types_pb2.OutputExpression(name="number", expression="7.", variables={}))
    seen = []

    def answer(motion):
        seen.append(motion.signals)
        return [1, 2, 3, 4, 5, 6]

    with server.load_text(small(), ports=[port], units=TONNE) as simulation:
        own = simulation.describe().ports[0]
        assert list(own.output_units) == ["mm", "s", "", "mm/s", ""] and list(own.input_units) == ["N, N mm"] and own.units == TONNE
        with simulation.couple("signals", answer, units=SI) as peer:
            simulation.step(3)
            layout = peer.welcome.layout
            assert list(layout.output_units) == ["m", "s", "", "m/s", ""] and list(layout.input_units) == ["N, N m"]
        assert simulation[LOAD] == pytest.approx([1, 2, 3, 4000, 5000, 6000])
        assert seen[0][1] == 0 and seen[0][3] == 0 and seen[0][4:13] == pytest.approx(np.eye(3).ravel())
        assert seen[0][13:] == pytest.approx([1e-3, 7])
        assert seen[2][1] == pytest.approx(2e-6, rel=1e-2) and seen[2][3] == pytest.approx(2e-3)


def test_imposed_motion_and_reactions_are_converted(server):
    """A body of 1 t shaken along y: the peer gets minus its inertia force, in N."""
    omega, reactions = 5.0, []

    def shake(motion):
        reactions.append((motion.time, motion.forces[0, 1]))
        return [[0, 1e-3 / omega * np.sin(omega * motion.target_time), 0]], np.eye(3)

    with server.load_text(small(), ports=[mbcosim.motion_port("shaker", nodes=[1])], units=TONNE) as simulation:
        with simulation.couple("shaker", shake, units=SI) as peer:
            result = simulation.step(400)
            assert peer.error is None
        assert simulation[X][1] == pytest.approx(np.sin(omega * result.time) / omega, abs=1e-12)
    time, force = reactions[-1]
    assert force == pytest.approx(1000 * 1e-3 * omega * np.sin(omega * time), abs=5e-2)  # 1000 kg; N


def test_amplitudes_are_numbers_and_modal_forces_moments(server):
    with server.load_bundle("deck", modal_deck(), ports=[mbcosim.modal_port("modes", 20)], units=MILLI) as simulation:
        layout = simulation.describe().ports[0]
        modes = len(layout.mode_numbers)
        assert list(layout.output_units) == [""] * modes + ["1/ms"] * modes and list(layout.input_units) == ["kN mm"] * modes

        def signals(steps, **options):
            seen = []

            def answer(motion):
                seen.append(motion.signals)
                return mbcosim.Loads(forces=[0, 0, 3.0], signals=[0.01] * modes)

            with simulation.couple("modes", answer, **options) as peer:
                simulation.step(steps)
                assert peer.error is None
            wait_for(lambda: not simulation.describe().ports[0].has_peer)
            return seen[-1]

        signals(10, units=SI)
        given, = [name for name, v in simulation.variables.items() if name.startswith("port.modes.") and v.causality == common_pb2.CAUSALITY_INPUT]
        assert simulation[given][2] == pytest.approx(0.003)  # kN
        assert simulation[given][-modes:] == pytest.approx([0.01] * modes)  # kN mm, which are N m
        with simulation.snapshot():
            converted = signals(1, units=SI)
        own = signals(1)
        assert np.abs(own[:modes]).max() > 0 and converted[:modes] == pytest.approx(own[:modes], rel=1e-14)
        assert converted[modes:] == pytest.approx(1e3 * own[modes:], rel=1e-14)


def test_rejections_and_expectations_are_in_the_peers_units(server):
    units, L, M, T = FACTORS["mm kg ms"]
    with server.load_text(bodies(L, M, T), ports=port_in(L), units=units) as simulation:
        with simulation.couple("rod", lambda m: mbcosim.Reject(2e-3, "too long"), units=SI):
            with pytest.raises(mbcosim.StepFailed) as caught:
                simulation.step()
            assert caught.value.result.preferred_step_size == pytest.approx(2.0)  # ms
        wait_for(lambda: not simulation.describe().ports[0].has_peer)

        def attached(step_size):
            message = exchange.hello(simulation, "rod", units=SI)
            message.hello.expected.step_size = step_size
            stream = server._connection.stubs.coupling.Attach(iter([message]), metadata=server.metadata)
            return next(stream).welcome

        assert attached(1e-2).step_size == pytest.approx(1e-2)
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        with pytest.raises(grpc.RpcError, match="step_size"):
            attached(10.0)


def test_a_record_in_other_units_replays_bit_for_bit(server, tmp_path):
    units, L, M, T = FACTORS["mm t s"]
    for name, options in (("tight", dict(mode="tight", tangent="dense", units=SI)), ("loose", dict(units=SI)), ("own", {})):
        with server.load_text(bodies(L, M, T), ports=port_in(L), units=units, record=True) as simulation:
            answer = {"tight": rod, "loose": plain_rod}.get(name, lambda motion: -0.4 * motion.x)
            with simulation.couple("rod", answer, **options):
                simulation.step(10)
            wait_for(lambda: not simulation.describe().ports[0].has_peer)
            (tmp_path / "run.rec").write_bytes(simulation.record())
        (tmp_path / "deck").write_text(bodies(L, M, T))
        done = replay(tmp_path / "run.rec", tmp_path / "deck")
        assert done.returncode == 0 and "same: 10 steps" in done.stdout, done.stdout + done.stderr


# ---------------------------------------------------------------- names

def test_without_a_declaration_descriptions_tell_the_decks_units(server):
    with server.load_text(small(), ports=[mbcosim.signal_port("s", outputs=[X], inputs=[LOAD])]) as simulation:
        model = simulation.describe()
        assert not model.HasField("units") and not simulation.info.HasField("units") and not model.ports[0].HasField("units")
        units = {v.name: (v.unit, v.si_unit) for v in model.variables}
        assert units[X] == ("deck unit of length", "m") and units[LOAD] == ("deck unit of force, deck unit of force length", "N, N m")
        assert units[OMEGA] == ("deck unit of rad/time", "rad/s") and units["node.structural.1.R"] == ("", "")
        assert units["body.1.E"] == ("deck unit of energy", "J")
        assert list(model.ports[0].output_units) == ["deck unit of length"]
    with server.load_text(small()) as simulation:
        history = simulation.simulate(X, steps=2)
        assert history.units == {X: "deck unit of length"} and history.time_unit == "deck unit of time"


@pytest.mark.parametrize("how", ["card", "option", "both"])
def test_a_declaration_gives_the_real_names(server, how):
    options = {} if how == "card" else dict(units=BY_FORCE)  # the same system, by its force
    with server.load_text(small("" if how == "option" else CARD), **options) as simulation:
        model = simulation.describe()
        assert model.units == simulation.info.units == (BY_FORCE if how == "option" else TONNE)
        names = {v.name: v.unit for v in model.variables}
        assert (names[X], names[XP], names[LOAD], names["body.1.E"]) == ("mm", "mm/s", "N, N mm", "mJ")
        assert names["node.structural.1.G"] in ("t mm^2/s",) and names["time"] == "s"
        assert simulation.simulate(X, steps=2).to_numpy().dtype.metadata["units"] == {"step": "", "time": "s", X: "mm"}
        with simulation.fork() as branch:
            assert branch.info.units == simulation.info.units


NAMES_IN_PICTURES = [(None, "deck unit of length", "deck unit of time", "1/(deck unit of time)", 1), (TONNE, "mm", "s", "Hz", 1),
                     (MILLI, "mm", "ms", "Hz", 1000)]  # units, length, time, frequency, how many of it are in 1/time


@pytest.mark.parametrize("units, length, time, hertz, factor", NAMES_IN_PICTURES, ids=["none", "mm t s", "mm kg ms"])
def test_linear_models_and_what_is_printed_count_in_the_declared_units(server, units, length, time, hertz, factor):
    with server.load_text(OSCILLATOR, units=units) as simulation:
        after = f"({time})" if units is None else time
        assert f"t = 0 of 10 {after}>" in repr(simulation) and f"t = 0 {after}>" in repr(simulation.nodes[1])
        modes, own = simulation.modes(), S.imag / (2 * np.pi)
        assert modes.frequencies_hz == pytest.approx([factor * own], rel=1e-6) and (modes.length_unit, modes.time_unit) == (length, time)
        assert f"{factor * own:.4g}"[:4] in repr(modes) and f" {hertz}  damping" in repr(modes)
        along = simulation.state_space("structural.1.load", "node.structural.1.X").only("node.structural.1.load[1]", "node.structural.1.X[1]")
    assert np.abs(along.response([factor * own])) == pytest.approx(np.abs(1 / (2 * (2j * np.pi * own)**2 + 8 * 2j * np.pi * own + 800)), rel=1e-6)
    assert along.frequencies().min() < factor * own < along.frequencies().max()


@pytest.mark.parametrize("units, length, time, hertz, factor", NAMES_IN_PICTURES, ids=["none", "mm t s", "mm kg ms"])
def test_films_and_diagrams_name_the_declared_units(server, units, length, time, hertz, factor):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")

    def shown(film):
        film._draw_was_started = True  # else it warns when it goes
        film._draw_frame(0)
        axes = film._fig.axes[0]
        return axes.get_xlabel(), axes.get_title()

    after = f"({time})" if units is None else time
    with server.load_text(OSCILLATOR, units=units) as simulation:
        film = simulation.simulate(steps=100).animate(lines=[], frames_per_second=50)
        assert shown(film) == (f"x [{length}]", f"t = 0.000 {after}") and len(list(film.new_frame_seq())) == (51 if factor == 1 else 2)  # 1 s, 1 ms
        label, title = shown(simulation.modes().animate(1, frames=2))
        assert label == f"x [{length}]" and f" {hertz}, damping" in title
        along = simulation.state_space("structural.1.load", "node.structural.1.X").only("node.structural.1.load[1]", "node.structural.1.X[1]")
    assert along.plot_bode().axes[1].get_xlabel() == f"frequency [{hertz}]"
    locus = along.plot_root_locus([0, 100]).axes[0]
    assert (locus.get_xlabel(), locus.get_ylabel()) == (f"real part [1/{after}]", f"imaginary part [rad/{after}]")
    pyplot.close("all")


def test_no_result_and_no_digest_depends_on_the_declaration(server):
    found = []
    for options in ({}, dict(units=TONNE), dict(units=INCHES)):
        with server.load_text(bodies(1, 1, 1), **options) as simulation:
            simulation.step(20)
            found.append((simulation[X].tobytes(), simulation.info.model_digest, simulation.export_state()))
    assert found[0] == found[1] == found[2]


def test_a_validated_model_tells_its_units(server, tmp_path):
    (tmp_path / "deck").write_text(small(CARD))
    assert server.validate(tmp_path / "deck").description.units == TONNE
    done = subprocess.run([os.path.join(BIN, "mbcosim"), "describe", tmp_path / "deck"], capture_output=True, text=True, timeout=60)
    assert "node.structural.1.X[3] [mm], global, state: position" in done.stdout


def test_netcdf_files_name_the_declared_units(server, tmp_path):
    (tmp_path / "deck").write_text(small(CARD).replace("final time: 100.", "final time: 2e-3").replace(CARD, CARD + "output results: netcdf;"))
    subprocess.run([os.path.join(BIN, "mbcosim"), "run", tmp_path / "deck", "-o", tmp_path / "out"], check=True, capture_output=True, timeout=60)
    netcdf = pytest.importorskip("scipy.io")
    with netcdf.netcdf_file(tmp_path / "out.nc", mmap=False) as file:
        assert file.variables["node.struct.1.X"].units == b"mm" and file.variables["node.struct.1.XP"].units == b"mm/s"


def test_resumed_simulations_keep_their_units(start_daemon, tmp_path):
    daemon = start_daemon("--state-dir", str(tmp_path))
    with daemon.connect() as server:
        simulation = server.load_text(small(), ports=[mbcosim.structural_port("spring", nodes=[1])], units=TONNE)
        with simulation.couple("spring", lambda m: [[0, 0, 1.0]], units=SI):
            simulation.step(5)
        name = simulation.name
    daemon.stop()
    with start_daemon("--state-dir", str(tmp_path)).connect() as server, server.attach(name) as simulation:
        assert simulation.describe().units == TONNE and simulation.refresh().units == TONNE
        with simulation.couple("spring", lambda m: [[0, 0, 1.0]], units=SI):
            assert simulation.step().step == 6
        simulation.delete()


# ---------------------------------------------------------------- asyncio

def test_asyncio_peers_have_units_too(daemon):
    async def main():
        async with mbcosim.aio.connect(daemon.address) as server:
            ports = [mbcosim.structural_port("rod", nodes=[1, 2])]
            async with await server.load_text(bodies(1e3, 1e-3, 1), ports=ports, units=TONNE) as simulation:
                async with await simulation.couple("rod", lambda m: ([[1, 0, 0], [0, 0, 0]], [[0, 1, 0], [0, 0, 0]]), units=SI):
                    await simulation.step()
                return (await simulation.read([LOAD]))[LOAD]

    assert asyncio.run(main()) == pytest.approx([1, 0, 0, 0, 1000, 0])


# ---------------------------------------------------------------- bad input

@pytest.mark.parametrize("wrong, field", [
    (common_pb2.UnitSystem(), "units.length"), (common_pb2.UnitSystem(length="furlong", mass="kg", time="s"), "units.length"),
    (common_pb2.UnitSystem(length="kg", mass="kg", time="s"), "units.length"), (common_pb2.UnitSystem(length="m", time="s"), "units.mass"),
    (common_pb2.UnitSystem(length="m", mass="N", time="s"), "units.mass"), (common_pb2.UnitSystem(length="m", force="kg", time="s"), "units.force"),
    (common_pb2.UnitSystem(length="m", mass="kg"), "units.time"), (common_pb2.UnitSystem(length="m", mass="kg", time="m"), "units.time"),
    (common_pb2.UnitSystem(length="m" * 10000, mass="kg", time="s"), "units.length"),
    (common_pb2.UnitSystem(length="m^2/m", mass="kg", time="s"), "units.length")], ids=str)
def test_wrong_units_are_refused_by_their_field(server, wrong, field):
    before = len(server.list())
    with pytest.raises(mbcosim.Error) as caught:
        server.load_text(small(), units=wrong)
    assert (caught.value.code, caught.value.field) == (grpc.StatusCode.INVALID_ARGUMENT, field) and len(str(caught.value)) < 400
    assert len(server.list()) == before
    with server.load_text(small(), ports=[mbcosim.structural_port("spring", nodes=[1])], units=SI) as simulation:
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            simulation.couple("spring", lambda m: m.x, units=wrong)
        assert caught.value.reason == "PORT_MISMATCH" and field in caught.value.metadata
        assert not simulation.describe().ports[0].has_peer


def test_units_that_differ_from_the_card_are_refused(server):
    with pytest.raises(mbcosim.Error, match="card `units` of the deck tells other units") as caught:
        server.load_text(small(CARD), units=SI)
    assert caught.value.field == "units"


def test_a_fork_has_no_units_of_its_own(server):
    with server.load_text(small()) as simulation:
        request = pb.ForkSimulationRequest(simulation=simulation.name, options=pb.CreateOptions(units=SI))
        with pytest.raises(grpc.RpcError) as caught:
            server.simulations.ForkSimulation(request, metadata=server.metadata)
        assert mbcosim.errors.from_rpc_error(caught.value).field == "units"


def test_a_peer_cannot_convert_what_nobody_declared(server):
    with server.load_text(small(), ports=[mbcosim.structural_port("spring", nodes=[1])]) as simulation:
        with pytest.raises(mbcosim.PreconditionFailed, match="not declared") as caught:
            simulation.couple("spring", lambda m: m.x, units=SI)
        assert "units" in caught.value.metadata


def test_an_expression_in_an_unknown_unit_cannot_be_converted(server):
    port = mbcosim.signal_port("s", outputs=[], inputs=[])
    port.output_expressions.append(coupling_types_pb2.OutputExpression(name="e", expression="1.", unit="furlong"))
    with server.load_text(small(), ports=[port], units=TONNE) as simulation:
        with pytest.raises(mbcosim.PreconditionFailed, match="furlong"):
            simulation.couple("s", lambda m: [], units=SI)
        with simulation.couple("s", lambda m: []):  # as it is, it may have any
            simulation.step()


@pytest.mark.parametrize("card, match", [
    ('units: length, "furlong", mass, "kg", time, "s";', "length must be a unit of length"), ('units: length, "m", mass, "kg";', "time"),
    ('units: length, "m", volume, "l", time, "s";', "volume"), ('units: length, m, mass, "kg", time, "s";', "m"),
    (CARD + CARD, "given twice"), ('units: length, "m", force, "kg", time, "s";', "force must be a unit of force")], ids=str)
def test_wrong_cards_are_told_with_their_place(server, card, match):
    with pytest.raises(mbcosim.DeckError, match=match) as caught:
        server.load_text(small(card))
    assert caught.value.diagnostics[0].line > 0 and caught.value.diagnostics[0].column > 0
