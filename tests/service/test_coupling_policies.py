"""Policies for steps that do not converge: fail, cut, accept."""
import queue
import re
import threading

import pytest

import decks
import mbcosim
from conftest import redone_alike, wait_for
from mbcosim import exchange
from mbcosim.coupling import open_stream
from mbcosim.v1 import coupling_pb2, coupling_types_pb2
from test_coupling import PORT, position, spring

STEP = 0.05


def fast_spin(server, **options):
    """A body that spins so fast that a whole step does not converge in its iterations, and an eighth of it does."""
    return server.load_text(decks.body(final_time="100.", step=str(STEP), iterations="4", tolerance="1.e-8", spin="5., 60., 5."),
                            **options)


def test_fail_is_the_default(server):
    with fast_spin(server) as simulation:
        with pytest.raises(mbcosim.StepFailed):
            simulation.step()
        assert simulation.refresh().step == 0 and simulation.info.time == 0


def test_cut_steps_end_on_the_grid(server):
    with fast_spin(server, policy="cut_step") as simulation:
        pieces = []
        for k in range(1, 21):
            reply = simulation.step().reply
            pieces.append(reply.pieces)
            assert reply.step == k and reply.time == k * STEP
            assert not reply.flagged and reply.cut_steps == (reply.pieces > 1)
        assert max(pieces) >= 2
        assert simulation.info.next_step_size == STEP


def test_cut_stops_at_the_minimum(server):
    with fast_spin(server, policy="cut_step", minimum_step=0.04) as simulation:
        with pytest.raises(mbcosim.StepFailed, match="cut down to pieces of 0.05 s"):
            simulation.step()
        assert simulation.refresh().step == 0
        assert simulation.info.minimum_step_size == 0.04
        simulation.update(minimum_step=1e-4)
        assert simulation.step().reply.pieces > 1


def test_cut_fails_whole(server):
    with server.load_text(decks.impossible(), policy="cut_step") as simulation:
        before = simulation.export_state()
        with pytest.raises(mbcosim.StepFailed, match="did not|no convergence") as caught:
            simulation.step()
        assert caught.value.reason == "NOT_CONVERGED"
        assert simulation.export_state() == before


def test_cut_steps_continue_bit_for_bit_after_a_restore(server):
    with fast_spin(server, policy="cut_step") as simulation:
        assert redone_alike(simulation, 3, 5, simulation.export_state)


def test_accept_flags_what_did_not_converge(server):
    with server.load_text(decks.impossible(), policy="accept_flagged") as simulation:
        reply = simulation.step(3).reply
        assert reply.flagged and reply.flagged_steps == 3 and reply.step == 3
        assert reply.residual_error > 1e-14 and not reply.HasField("failure")


def test_accept_flags_nothing_that_converges(server, tumbling):
    with server.load(tumbling, policy="accept_flagged") as accepting, server.load(tumbling) as plain:
        assert accepting.step(20).reply.flagged_steps == 0
        plain.step(20)
        assert accepting.export_state() == plain.export_state()


def test_policy_can_change(server):
    with server.load_text(decks.impossible()) as simulation:
        with pytest.raises(mbcosim.StepFailed):
            simulation.step()
        info = simulation.update(policy="accept_flagged", name="late")
        assert info.display_name == "late" and info.non_convergence_policy == 3
        assert simulation.step().reply.flagged
        simulation.update(policy="fail")
        with pytest.raises(mbcosim.StepFailed):
            simulation.step()
        assert simulation.refresh().step == 1


@pytest.mark.parametrize("minimum", [-1.0, float("nan"), float("inf")])
def test_a_bad_minimum_is_refused(server, minimum):
    with pytest.raises(mbcosim.Error) as caught:
        fast_spin(server, policy="cut_step", minimum_step=minimum)
    assert caught.value.reason == "BAD_ARGUMENT"


def test_tight_peers_see_the_pieces_of_a_cut_step(server):
    events = []

    def answer(motion):
        events.append((motion.step, motion.time))
        return spring(motion)

    with fast_spin(server, policy="cut_step", ports=PORT) as simulation:
        with simulation.couple("spring", answer, mode="tight") as peer:
            pieces = simulation.step().reply.pieces
            wait_for(lambda: len(peer.accepted) == pieces)
        assert pieces > 1 and peer.rejected[0] == (0, 0.0)
        assert {step for step, _ in peer.accepted} == {1}
        times = [time for _, time in peer.accepted]
        assert times == sorted(times) and times[-1] == STEP
        assert {step for step, _ in events} == {1}


def trace(server, simulation, forces, steps, **options):
    """The order of messages of a peer: w welcome, x exchange, a accepted, r rejected."""
    out, names = queue.SimpleQueue(), []
    out.put(exchange.hello(simulation, "spring", **options))
    stream = open_stream(server._channel)(iter(out.get, None), metadata=server.metadata)
    form = exchange.AnswerForm(coupling_types_pb2.PortLayout(kind=coupling_types_pb2.PORT_KIND_STRUCTURAL, node_labels=[1]), coupling_pb2.Hello())

    def listen():
        for data in stream:
            name, content = exchange.receive(data)
            names.append("x" if name == "exchange" else name[0])
            if name == "exchange":
                out.put(exchange.answer(exchange.index(content), [[next(forces), 0, 0]], form))

    thread = threading.Thread(target=listen)
    thread.start()
    try:
        for _ in range(steps):
            simulation.step()
    except mbcosim.StepFailed:
        pass
    wait_for(lambda: names and names[-1] in "ar")
    out.put(None)
    thread.join(10)
    return "".join(names)


def test_golden_traces_of_failed_and_cut_steps(server):
    def numbers():
        value = 1.0
        while True:
            yield value
            value += 1.0

    def constant():
        while True:
            yield 1.0

    with server.load_text(decks.body(spin="null"), ports=PORT) as simulation:
        assert trace(server, simulation, numbers(), 1, mode="window", maximum_passes=3) == "wxxxr"
        assert trace(server, simulation, constant(), 2, mode="window") in ("wxxaxa", "wxxaxxa")
    with fast_spin(server, ports=PORT) as simulation:
        assert re.fullmatch("wx+r", trace(server, simulation, constant(), 1, mode="tight"))
    with fast_spin(server, ports=PORT, policy="cut_step") as simulation:
        order = trace(server, simulation, constant(), 1, mode="tight")
        assert re.fullmatch("wx+r(x+[ra])*x+a", order) and order.count("a") > 1


def test_windows_see_whole_steps_and_accept_the_last_pass(server):
    numbers = iter(range(1, 1000))
    with server.load_text(decks.body(spin="null"), ports=PORT, policy="accept_flagged") as simulation:
        with simulation.couple("spring", lambda m: [[float(next(numbers)), 0, 0]], mode="window", maximum_passes=3) as peer:
            reply = simulation.step(2).reply
            assert reply.flagged_steps == 2 and peer.exchanges == 6
            wait_for(lambda: len(peer.accepted) == 2)


def test_time_does_not_drift(server):
    h = 1 / 3000
    deck = decks.body(final_time="1.", step=repr(h), spin="null")
    with server.load_text(deck) as exact, server.load_text(deck, summed_time=True) as summed:
        assert exact.run_until(2.0).outcome == "FINISHED"
        assert exact.step_number == 3000 and exact.time == 3000 * h
        summed.run_until(2.0)
        total = 0.0
        for _ in range(summed.step_number):
            total += h
        assert summed.time == total != summed.step_number * h
