"""Peers on ports: the modes, their order, their failures."""
import pickle
import re
import sys
import time

import numpy as np
import pytest

import decks
import mbcosim
from conftest import TIME_FACTOR, redone_alike, wait_for
from mbcosim import exchange

STIFFNESS, SPEED = 400.0, 1.0  # of a spring that a peer computes; the unit mass starts with this speed along y
PORT = [mbcosim.structural_port("spring", nodes=[1])]


def oscillator(server, step="1.e-3"):
    return server.load_text(decks.body(final_time="100.", step=step, spin="null"), ports=PORT)


def spring(motion):
    return -STIFFNESS * motion.x


def exact(time):
    omega = np.sqrt(STIFFNESS)
    return SPEED / omega * np.sin(omega * time)


def position(simulation):
    return simulation["node.structural.1.X"][1]


def error_at_end(server, step, **options):
    with oscillator(server, f"{step}") as simulation, simulation.couple("spring", spring, **options) as peer:
        result = simulation.run_until(0.2)
        assert peer.error is None
        return abs(position(simulation) - exact(result.time))


def test_loose_exchanges_once_a_step_and_is_first_order(server):
    with oscillator(server) as simulation, simulation.couple("spring", spring) as peer:
        result = simulation.step(200)
        assert peer.exchanges == 200
        assert result.reply.peer_wait_seconds > 0
        assert position(simulation) == pytest.approx(exact(0.2), abs=3e-3)
    errors = [error_at_end(server, h) for h in (2e-3, 1e-3)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1, abs=0.15)


def test_staggered_gives_what_loose_gives(server):
    found = []
    for mode in ("loose", "staggered"):
        with oscillator(server) as simulation, simulation.couple("spring", spring, mode=mode):
            for _ in range(50):
                simulation.step()
            found.append(simulation["node.structural.1.X"].tobytes())
    assert found[0] == found[1]


@pytest.mark.parametrize("acceleration", ["none", "constant", "aitken", "iqn_ils"])
def test_window_converges_to_the_implicit_solution(server, acceleration):
    with oscillator(server, "1.e-2") as simulation, simulation.couple(
            "spring", spring, mode="window", acceleration=acceleration, tolerance=1e-10) as peer:
        result = simulation.run_until(0.2)
        assert result.step == 20
        wait_for(lambda: len(peer.accepted) == 20)  # the last notice may come after the reply
        assert [step for step, _ in peer.accepted] == list(range(1, 21))
        assert position(simulation) == pytest.approx(exact(0.2), abs=2e-3)
        load = simulation["node.structural.1.load"][1]
        assert load == pytest.approx(-STIFFNESS * position(simulation), rel=1e-8)


def test_quasi_newton_converges_where_the_plain_iteration_diverges(server):
    def stiff(motion):
        return -1e7 * motion.x

    with oscillator(server, "1.e-2") as simulation, simulation.couple("spring", stiff, mode="window") as peer:
        with pytest.raises(mbcosim.StepFailed, match="interface did not converge|not finite") as caught:
            simulation.step()
        assert caught.value.result.step == 0 and peer.accepted == []
    with oscillator(server, "1.e-2") as simulation, simulation.couple("spring", stiff, mode="window", acceleration="iqn_ils",
                                                                      tolerance=1e-8) as peer:
        assert simulation.step(20).step == 20
        assert peer.exchanges < 20 * 12


@pytest.mark.parametrize("hold, order", [("zero_order", 1), ("linear", 2), ("quadratic", 3)])
def test_multirate_inputs_show_their_order(server, hold, order):
    omega = 20.0

    def force(motion):  # depends on time alone
        return [[0, np.cos(omega * motion.target_time), 0]]

    def error(every):
        with oscillator(server) as simulation, simulation.couple("spring", force, every=every, hold=hold) as peer:
            result = simulation.step(240)
            assert peer.exchanges == 240 // every
            y = result.time + (1 - np.cos(omega * result.time)) / omega**2
            return abs(position(simulation) - y)

    assert np.log2(error(40) / error(20)) > order - 0.4


def test_moments_offsets_and_frames(server):
    offset = [[0.5, 0.0, 0.0]]
    port = [mbcosim.structural_port("arm", nodes=[1], offsets=offset)]
    found = {}
    for frame in ("global", "node"):
        with server.load_text(decks.body(spin="0., 0., 1."), ports=port) as simulation:
            def push(motion):
                return ([[0, 0, 2.0]], [[0, 0, 0.5]])

            with simulation.couple("arm", push, frame=frame, rotation="quaternion") as peer:
                simulation.step(10)
                found[frame] = simulation["node.structural.1.load"]
                assert peer.error is None
    assert found["global"][:3] == pytest.approx([0, 0, 2])
    assert found["global"][3:] == pytest.approx([0, -1.0, 0.5], abs=2e-2)
    assert found["node"] == pytest.approx(found["global"], abs=1e-3)


@pytest.mark.parametrize("frame", ["node", "reference"])
def test_loads_that_follow_a_node_turn_with_it_between_answers(server, frame):
    """A force that is constant on a body which spins about its axis z: v = F/(m w) (sin wt, 1 - cos wt), of one answer and to second order.
    Without `following_loads` it keeps the direction that it had at the exchange: v = F t/m. What the force gives from `start` on is looked at: it
    begins with the first step, not in the initial state."""
    force, spin, start, end = 3.0, 5.0, 0.1, 0.3
    port = [mbcosim.structural_port("jet", nodes=[1], offsets=[[0, 0, 0.2]], **({"reference": 1} if frame == "reference" else {}))]

    def velocity(step, follow):
        with server.load_text(decks.body(spin=f"0., 0., {spin}", step=f"{step}"), ports=port) as simulation:
            loads = [[force, 0, 0]], [[0, -0.2 * force, 0]]  # about the point; no moment is left about the centre of mass
            with simulation.couple("jet", lambda _: loads, frame=frame, every=10000, following_loads=follow) as peer:
                simulation.run_until(start)
                before = simulation["node.structural.1.XP"][:2]
                simulation.run_until(end)
                assert (peer.exchanges, peer.error) == (1, None)
            return simulation["node.structural.1.XP"][:2] - before

    exact = force / spin * np.array([np.sin(spin * end) - np.sin(spin * start), np.cos(spin * start) - np.cos(spin * end)])
    errors = [np.abs(velocity(step, True) - exact).max() for step in (4e-3, 2e-3)]
    assert errors[1] < 1e-5 and np.log2(errors[0] / errors[1]) > 1.9
    assert velocity(2e-3, False) == pytest.approx([force * (end - start), 0], abs=1e-6)


def test_answers_of_another_form_are_not_kept(server):
    """A peer that comes with another form is asked at once, whatever its `every`: what the one before it left means something else."""
    port = [mbcosim.structural_port("jet", nodes=[1])]
    with server.load_text(decks.body(spin="0., 0., 5."), ports=port) as simulation:
        for options in ({"following_loads": True}, {}, {"following_loads": True}):
            with simulation.couple("jet", lambda _: [[1.0, 0, 0]], frame="node", every=1000, **options) as peer:
                simulation.step(3)
                assert peer.exchanges == 1
            wait_for(lambda: not simulation.describe().ports[0].has_peer)


@pytest.mark.parametrize("policy, left", [("hold_last", 3.0), ("zero", 0.0)])
def test_loads_that_follow_a_node_go_on_as_the_policy_says(server, policy, left):
    port = [mbcosim.structural_port("jet", nodes=[1])]
    with server.load_text(decks.body(spin="0., 0., 5."), ports=port) as simulation:
        with simulation.couple("jet", lambda _: [[3.0, 0, 0]], frame="node", following_loads=True, policy=policy):
            simulation.step(10)
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        simulation.step(10)
        angle = 5.0 * simulation.time
        assert simulation["node.structural.1.load"][:2] == pytest.approx(left * np.array([np.cos(angle), np.sin(angle)]), abs=1e-3)


def test_loads_follow_only_in_the_frame_of_a_node(server):
    with oscillator(server) as simulation, pytest.raises(mbcosim.Error) as caught:
        simulation.couple("spring", spring, following_loads=True, global_reference_loads=True)
    assert {"following_loads", "global_reference_loads"} <= set(caught.value.metadata)


def test_signals(server):
    port = [mbcosim.signal_port("control", outputs=["node.structural.1.X", "time"], inputs=["node.structural.1.load"])]
    with server.load_text(decks.body(spin="null", final_time="10."), ports=port) as simulation:
        def controller(motion):
            assert motion.signals.shape == (4,)
            return [0, -STIFFNESS * motion.signals[1], 0, 0, 0, 0]

        with simulation.couple("control", controller) as peer:
            simulation.step(200)
            assert peer.error is None
        assert position(simulation) == pytest.approx(exact(0.2), abs=3e-3)


# ---------------------------------------------------------------- failures

def test_a_port_without_a_peer_says_so(server):
    with server.load_text(decks.body(), ports=[mbcosim.structural_port("tip", nodes=[1])]) as simulation:
        with pytest.raises(mbcosim.StepFailed, match='port "tip": no peer has attached to it'):
            simulation.step()


def test_a_peer_that_raises_fails_the_step_and_the_session_goes_on(server):
    calls = []

    def answer(motion):
        calls.append(motion.step)
        if len(calls) == 3:
            raise ValueError("no aerodynamics today")
        return spring(motion)

    with oscillator(server) as simulation, simulation.couple("spring", answer):
        with pytest.raises(mbcosim.StepFailed, match="no aerodynamics today") as caught:
            simulation.step(10)
        assert caught.value.reason == "PEER_LOST" and caught.value.result.outcome == "PEER_LOST"
        assert caught.value.result.step == 2
        assert simulation.step(10).step == 12


@pytest.mark.parametrize("policy, expected", [("hold_last", 1.0), ("zero", 0.0)])
def test_policies_go_on_without_the_peer(server, policy, expected):
    with oscillator(server) as simulation:
        with simulation.couple("spring", lambda motion: [[1.0, 0, 0]], policy=policy):
            simulation.step()
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        assert simulation.step(5).step == 6
        assert simulation["node.structural.1.load"][0] == expected


def test_a_late_peer_is_given_up_within_its_bound(server):
    def slow(motion):
        time.sleep(3)
        return spring(motion)

    with oscillator(server) as simulation, simulation.couple("spring", slow, peer_timeout=0.3):
        start = time.monotonic()
        with pytest.raises(mbcosim.StepFailed, match="in time"):
            simulation.step()
        assert 0.25 < time.monotonic() - start < 2 * TIME_FACTOR
        assert simulation.refresh().step == 0


def test_a_peer_may_attach_again(server):
    with oscillator(server) as simulation:
        for attempt in range(3):
            with simulation.couple("spring", spring):
                assert simulation.step(5).step == 5 * (attempt + 1)
            wait_for(lambda: not simulation.describe().ports[0].has_peer)


def test_a_peer_that_leaves_within_its_function_leaves_the_port(server):
    def leave(motion):
        peer.close()
        return spring(motion)

    with oscillator(server) as simulation:
        peer = simulation.couple("spring", leave, peer_timeout=0.2)
        with pytest.raises(mbcosim.StepFailed, match="the peer is gone"):
            simulation.step()
        assert peer.raised is None
        with simulation.couple("spring", spring):
            assert simulation.step().step == 1


def test_the_motions_of_a_function_are_not_iterated_over(server):
    with oscillator(server) as simulation, simulation.couple("spring", spring) as peer:
        with pytest.raises(TypeError, match="attach the peer without one"):
            list(peer)
        assert simulation.step().step == 1


def test_a_rejection_travels_between_processes():
    """As one does that a function raises in a worker of a pool."""
    there = pickle.loads(pickle.dumps(mbcosim.Reject(0.25, "a shorter one")))
    assert (there.preferred_step_size, there.text, str(there)) == (0.25, "a shorter one", "a shorter one")


def test_a_second_peer_is_refused(server):
    with oscillator(server) as simulation, simulation.couple("spring", spring):
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            simulation.couple("spring", spring)
        assert caught.value.reason == "PORT_TAKEN"


@pytest.mark.parametrize("mode", ["loose", "staggered", "tight", "window"])
def test_a_peer_knows_the_step_that_it_stands_at(server, mode):
    with oscillator(server) as simulation:
        simulation.step(0)
        with simulation.couple("spring", spring, mode=mode) as peer:
            assert peer.step == 0
            simulation.step(5)
            wait_for(lambda: peer.step == (4 if mode == "loose" else 5))
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        with simulation.couple("spring", spring, mode=mode) as fresh:
            assert fresh.step == 5


def test_a_peer_that_rejects_a_step_stays_where_it_is(server):
    def reluctant(motion):
        if motion.step == 2:
            raise mbcosim.Reject(1e-4)
        return spring(motion)

    with oscillator(server) as simulation, simulation.couple("spring", reluctant) as peer:
        simulation.step(2)
        with pytest.raises(mbcosim.StepFailed):
            simulation.step()
        assert peer.step == 1


def _after(server, steps):
    """A simulation that has done so many steps, its port free."""
    simulation = oscillator(server)
    with simulation.couple("spring", spring):
        simulation.step(steps)
    wait_for(lambda: not simulation.describe().ports[0].has_peer)
    return simulation


@pytest.mark.parametrize("mode", ["loose", "staggered", "tight", "window"])
def test_a_peer_that_stands_later_than_the_simulation_is_refused(server, mode):
    with _after(server, 3) as simulation:
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            simulation.couple("spring", spring, mode=mode, step=7)
        assert caught.value.reason == "PEER_AHEAD" and caught.value.metadata == {"step": "3", "peer_step": "7"}
        assert str(caught.value) == ('port "spring": the peer stands at step 7, the simulation at step 3: take the peer back to step 3 and attach '
                                     'it with `can_go_back`, or attach one that begins there')
        with simulation.couple("spring", spring, mode=mode):  # the port is free
            assert simulation.step().step == 4


@pytest.mark.parametrize("told, stands", [({"step": 0}, 0), ({"step": 2}, 2), ({"step": 3}, 3), ({}, 3), ({"step": 9, "can_go_back": True}, 3),
                                          ({"step": 1, "can_go_back": True}, 1)], ids=str)
def test_a_peer_that_stands_there_or_before_or_can_go_back_goes_on(server, told, stands):
    with _after(server, 3) as simulation, simulation.couple("spring", spring, **told) as peer:
        assert (peer.step, peer.welcome.step) == (stands, 3)
        assert simulation.step().step == 4 and peer.step == 3


def test_a_step_among_other_mismatches_is_told_with_them(server):
    with _after(server, 1) as simulation:
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            simulation.couple("spring", spring, frame="reference", step=2)
        assert caught.value.reason == "PORT_MISMATCH" and set(caught.value.metadata) == {"frame", "step"}
        assert caught.value.metadata["step"] == "the peer stands at step 2, the simulation at step 1"


def test_every_mismatch_is_told_at_once(server):
    with oscillator(server) as simulation:
        simulation.info.model_digest = "0" * 16
        with pytest.raises(mbcosim.PreconditionFailed) as caught:
            simulation.couple("spring", spring, frame="reference", every=-1, relaxation=3)
        assert caught.value.reason == "PORT_MISMATCH"
        assert set(caught.value.metadata) == {"model_digest", "frame", "every", "relaxation"}
        with pytest.raises(mbcosim.NotFound) as caught:
            simulation.couple("wing", spring)
        assert caught.value.reason == "NO_SUCH_PORT"


@pytest.fixture
def careless(monkeypatch):
    """Peers send whatever their functions return."""
    monkeypatch.setattr(exchange.AnswerForm, "fault", lambda *_: None)


def test_an_answer_of_the_wrong_length_ends_the_stream(server, careless):
    with oscillator(server) as simulation, simulation.couple("spring", lambda motion: [[1.0, 2.0]], peer_timeout=5) as peer:
        with pytest.raises(mbcosim.StepFailed, match='port "spring": the peer was sent away: .*`forces` must have 3 numbers, got 2'):
            simulation.step()
        wait_for(lambda: peer.error)
        assert peer.error.reason == "BAD_ARGUMENT" and "3 numbers" in str(peer.error)
        assert simulation.refresh().step == 0


def raises(error):
    raise error


SHAPES = [
    (lambda m: [[1.0, 2.0]], r"ValueError: `forces` has the shape \(1, 2\); port \"spring\" takes 1 x 3, a row for each of its points"),
    (lambda m: None, "ValueError: `forces` is missing; port"), (lambda m: {"force": [0, 0, 0]}, "TypeError: `forces` of an answer must be real numbers, got .*, a dict"),
    (lambda m: [[np.nan, 0, 0]], r"ValueError: `forces` has numbers that are not finite: \[\[nan, 0.0, 0.0\]\]"),
    (lambda m: 5 * ([[0, 0, 0]],), "ValueError: an answer of 5 parts; this port takes forces, moments, reference_force, reference_moment, or mbcosim.Loads"),
    (lambda m: ([[0, 0, 0]], [1, 2]), "ValueError: `moments` has the shape"), (lambda m: mbcosim.Loads([[0, 0, 0]], signals=[1]), 'ValueError: `signals` .* takes none'),
    (lambda m: mbcosim.Loads([[0, 0, 0]], stiffness=np.eye(6)), "ValueError: `stiffness` .* takes none without `tangent` of the peer"),
    (lambda m: mbcosim.Reject(-1.0), "ValueError: `preferred_step_size` must be positive, got -1.0"), (lambda m: sys.exit(3), "SystemExit: 3"),
    (lambda m: 1j * m.x, "TypeError: `forces` of an answer must be real numbers, got .*, a ndarray"),
    (lambda m: raises(KeyboardInterrupt("no more")), "KeyboardInterrupt: no more"), (lambda m: raises(GeneratorExit()), "GeneratorExit: ")]


@pytest.mark.parametrize("answer, text", SHAPES)
def test_an_answer_that_is_none_is_told_to_its_peer_and_fails_the_step(server, answer, text):
    """Not "the peer is gone": the stream goes on, and so does the next step."""
    given = iter([answer])
    with oscillator(server) as simulation, simulation.couple("spring", lambda m: next(given, spring)(m)) as peer:
        with pytest.raises(mbcosim.StepFailed, match='port "spring": the peer failed: ' + text):
            simulation.step()
        assert re.match(text, f"{type(peer.raised).__name__}: {peer.raised}") and peer.error is None
        assert simulation.step(3).step == 3


class Unprintable(Exception):
    def __str__(self):
        raise ValueError("no text")


@pytest.mark.parametrize("error, told", [
    (FileNotFoundError("\udcff.dat"), r"FileNotFoundError: \?.dat"), (Unprintable(), "Unprintable, whose text cannot be had: ValueError"),
    (mbcosim.Reject(text="the file \udcff is missing"), r"the file \? is missing")])
def test_texts_that_cannot_travel_are_told_as_far_as_they_can(server, error, told):
    with oscillator(server) as simulation, simulation.couple("spring", lambda m: raises(error)) as peer:
        for _ in range(2):
            with pytest.raises(mbcosim.StepFailed, match=told):
                simulation.step(timeout=8)
        assert peer.raised is error


def test_columns_in_place_of_rows_are_no_answer(server):
    port = mbcosim.structural_port("two", nodes=[1, 2])
    with server.load_text(decks.OSCILLATOR, ports=[port]) as simulation, simulation.couple("two", lambda m: np.zeros((3, 2))):
        with pytest.raises(mbcosim.StepFailed, match=r"`forces` has the shape \(3, 2\); port .two. takes 2 x 3"):
            simulation.step()


def test_signals_that_are_missing_are_told_by_their_names(server):
    port = [mbcosim.signal_port("control", outputs=["time"], inputs=["node.structural.1.load"])]
    with server.load_text(decks.body(), ports=port) as simulation, simulation.couple("control", lambda m: [1.0]):
        with pytest.raises(mbcosim.StepFailed, match=r"`signals` has the shape \(1,\); port .control. takes 6 numbers, node.structural.1.load"):
            simulation.step()


def test_restore_is_clean_with_a_peer(server):
    with oscillator(server) as simulation, simulation.couple("spring", spring, mode="staggered"):
        assert redone_alike(simulation, 20, 30, lambda: simulation["node.structural.1.X"].tobytes())


def test_bad_ports_are_refused_at_creation(server):
    for port, reason in [(mbcosim.structural_port("p", nodes=[77]), "NO_SUCH_VARIABLE"),
                         (mbcosim.structural_port("p", nodes=[]), "BAD_ARGUMENT"),
                         (mbcosim.signal_port("p", ["nothing"], []), "NO_SUCH_VARIABLE"),
                         (mbcosim.signal_port("p", [], ["time"]), "NOT_WRITABLE")]:
        with pytest.raises(mbcosim.Error) as caught:
            server.load_text(decks.body(), ports=[port])
        assert caught.value.reason == reason


def test_a_peer_may_want_signs_of_life(start_daemon):
    """An idle server gives them; one that is stopped does not, and the peer ends."""
    import signal
    daemon = start_daemon()
    with daemon.connect() as server, oscillator(server) as simulation:
        silence = 0.5 * TIME_FACTOR
        with simulation.couple("spring", spring, server_timeout=silence) as peer:
            time.sleep(3 * silence)
            assert peer.error is None and simulation.step().step == 1
            daemon.process.send_signal(signal.SIGSTOP)
            wait_for(lambda: peer.error is not None, 5)
            daemon.process.send_signal(signal.SIGCONT)
            assert "silent" in str(peer.error)
