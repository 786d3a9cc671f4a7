"""Tight coupling: the peer takes part in the iteration of the step."""
import numpy as np
import pytest

import mbcosim
from conftest import wait_for
from test_coupling import PORT, oscillator, position, spring


def run(server, steps=20, answer=spring, **options):
    """Position and load after some steps, and exchanges a step."""
    with oscillator(server, "1.e-2") as simulation, simulation.couple("spring", answer, **options) as peer:
        simulation.step(steps)
        assert peer.error is None
        return simulation["node.structural.1.X"], simulation["node.structural.1.load"], peer.exchanges / steps


@pytest.mark.parametrize("acceleration", ["none", "aitken", "iqn_ils"])
def test_tight_gives_what_window_gives(server, acceleration):
    tight = run(server, mode="tight", acceleration=acceleration, tolerance=1e-11)
    window = run(server, mode="window", acceleration="iqn_ils", tolerance=1e-11)
    assert tight[0] == pytest.approx(window[0], abs=1e-10)
    assert tight[1] == pytest.approx(window[1], abs=1e-7)


def test_every_second_iteration(server):
    seen = set()

    def answer(motion):
        seen.add(motion.iteration)
        return spring(motion)

    found = run(server, answer=answer, mode="tight", every=2, tolerance=1e-11)
    assert found[0] == pytest.approx(run(server, mode="tight", tolerance=1e-11)[0], abs=1e-10)
    assert seen and all(iteration % 2 == 1 for iteration in seen)


def test_quasi_newton_converges_where_the_plain_iteration_diverges(server):
    def stiff(motion):
        return -1e7 * motion.x

    with oscillator(server, "1.e-2") as simulation:
        with simulation.couple("spring", stiff, mode="tight") as peer:
            with pytest.raises(mbcosim.StepFailed) as caught:
                simulation.step()
            assert caught.value.result.outcome == "NOT_CONVERGED" and simulation.refresh().step == 0
            wait_for(lambda: peer.rejected)
            assert peer.accepted == []
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        with simulation.couple("spring", stiff, mode="tight", acceleration="iqn_ils", tolerance=1e-8) as peer:
            assert simulation.step(20).step == 20
            assert peer.exchanges < 20 * 12


def test_a_failure_within_the_iteration_leaves_the_last_accepted_state(server):
    clean = run(server, mode="tight")
    failures = iter([True])

    def answer(motion):
        if motion.step == 8 and motion.iteration == 2 and next(failures, False):
            raise ValueError("a gust")
        return spring(motion)

    with oscillator(server, "1.e-2") as simulation, simulation.couple("spring", answer, mode="tight") as peer:
        with pytest.raises(mbcosim.StepFailed, match="a gust") as caught:
            simulation.step(20)
        assert caught.value.reason == "PEER_LOST" and caught.value.result.step == 7
        wait_for(lambda: peer.rejected)
        simulation.step(13)
        assert simulation["node.structural.1.X"].tobytes() == clean[0].tobytes()


def test_tight_and_loose_ports_side_by_side(server):
    ports = [*PORT, mbcosim.signal_port("watch", ["node.structural.1.X"], [])]
    import decks
    seen = []
    with server.load_text(decks.body(final_time="100.", step="1.e-2", spin="null"), ports=ports) as simulation:
        with simulation.couple("spring", spring, mode="tight"), simulation.couple(
                "watch", lambda motion: seen.append(motion.step) or []):
            simulation.step(20)
        assert seen == list(range(20))
        assert simulation["node.structural.1.X"] == pytest.approx(run(server, mode="tight")[0], abs=0)


def test_a_peer_may_be_another_simulation_of_a_daemon_with_one_worker(start_daemon):
    daemon = start_daemon("--workers", "1")
    with daemon.connect() as server, oscillator(server, "1.e-2") as simulation, oscillator(server, "1.e-2") as other:
        def answer(motion):
            if motion.iteration == 1:
                other.step()
            return spring(motion)

        with simulation.couple("spring", answer, mode="tight", peer_timeout=5):
            other_peer = other.couple("spring", lambda motion: np.zeros((1, 3)))
            assert simulation.step(10).step == 10 and other.step_number == 10
            other_peer.close()
        assert position(other) == pytest.approx(0.1, abs=1e-9)


def test_reply_separates_solver_and_peer(server):
    import time
    with oscillator(server, "1.e-2") as simulation:
        with simulation.couple("spring", lambda motion: time.sleep(0.02) or spring(motion), mode="tight"):
            reply = simulation.step(5).reply
        assert reply.peer_wait_seconds > 0.1 and reply.solver_seconds < 0.05
