"""Steps of the client's length: alone, and with peers in all modes."""
import asyncio
import math
import os
import subprocess

import grpc
import numpy as np
import pytest

import decks
import mbcosim
import mbcosim.aio
from conftest import BIN, wait_for
from mbcosim.v1 import simulations_pb2 as pb

PORT = [mbcosim.structural_port("spring", nodes=[1])]
STIFFNESS = 400.0


@pytest.fixture
def swinging(server):
    with server.load_text(decks.OSCILLATOR, ports=PORT) as simulation:
        yield simulation


@pytest.fixture
def free(server):
    with server.load_text(decks.OSCILLATOR) as simulation:
        yield simulation


def x_of(simulation):
    return float(simulation["node.structural.1.X"][0])


# ---------------------------------------------------------------- without peers

def test_the_decks_length_gives_the_decks_bits(server):
    with server.load_text(decks.OSCILLATOR) as a, server.load_text(decks.OSCILLATOR) as b:
        h = a.step(0).next_step_size
        a.step(50)
        b.step(50, step_size=h)
        assert a.export_state() == b.export_state()


def test_lengths_and_what_is_left_are_told(free):
    result = free.step(step_size=0.003)
    assert result.step_size == 0.003 and result.time == 0.003
    assert result.next_step_size == decks.OSCILLATOR_STEP
    assert result.largest_step_size == decks.OSCILLATOR_END - 0.003
    assert free.step().step_size == decks.OSCILLATOR_STEP


def test_an_exact_end_is_met_to_the_bit(free):
    for end in (0.1 / 3, 0.2, 0.3000001):
        assert free.run_until(end, exact=True).time == end
    result = free.run_until(0.35, exact=True, step_size=0.004)
    assert result.time == 0.35 and result.steps_done == 13
    assert free.run_until(0.35, exact=True).steps_done == 0


def test_a_step_that_grows_tenfold_says_so(free):
    free.step(3)
    assert free.step(step_size=1e-4).reply.restarted_steps == 0
    assert free.step(2).reply.restarted_steps == 1


@pytest.mark.parametrize("length", [0.0, -0.01, math.nan, math.inf, 1e-16, 1e6])
def test_what_is_no_length_is_refused_and_nothing_applied(free, length):
    before = free.export_state()
    with pytest.raises(mbcosim.Error, match="step_size") as caught:
        free.step(step_size=length, inputs={"node.structural.1.load": [1, 0, 0, 0, 0, 0]})
    assert caught.value.reason == "BAD_ARGUMENT" and caught.value.code == grpc.StatusCode.INVALID_ARGUMENT
    assert free.export_state() == before


def test_a_strategy_that_chooses_itself_refuses(server):
    deck = decks.OSCILLATOR.replace("final time:", "strategy: factor, .5, 2, 1.5, 2, 1, 10; min time step: 1e-6; final time:")
    with server.load_text(deck) as simulation:
        with pytest.raises(mbcosim.Error, match="strategy: factor"):
            simulation.step(step_size=0.001)
        assert simulation.run_until(0.0333, exact=True).time == 0.0333


def test_exact_needs_an_end(server, free):
    with pytest.raises(grpc.RpcError) as caught:
        server.simulations.Step(pb.StepRequest(simulation=free.name, exact=True), metadata=server.metadata)
    assert "`exact` belongs to `until_time`" in caught.value.details()


def test_a_later_step_beyond_the_final_time_ends_there(free):
    free.run_until(decks.OSCILLATOR_END - 0.025, exact=True)
    result = free.step(10, step_size=0.008)
    assert result.outcome == "FINISHED" and result.steps_done == 4 and result.time == decks.OSCILLATOR_END


def test_the_stream_and_asyncio_take_lengths(server, daemon, free):
    with free.stepper() as stepper:
        assert stepper.step(step_size=0.002).time == 0.002

    async def run():
        async with mbcosim.aio.connect(daemon.address) as other, await other.load_text(decks.OSCILLATOR) as simulation:
            first = await simulation.step(step_size=0.002)
            return first.time, (await simulation.run_until(0.0777, exact=True)).time

    assert asyncio.run(run()) == (0.002, 0.0777)


# ---------------------------------------------------------------- conditions inside a step

def test_a_condition_is_located_inside_the_step(free):
    within = 1e-8
    until = mbcosim.Condition("node.structural.1.X", "<", 0.0, element=0, locate_within=within)
    result = free.step(1000, until=until)
    speed = abs(float(free["node.structural.1.XP"][0]))
    assert result.condition_met and result.step_size < decks.OSCILLATOR_STEP
    assert -1.01 * within * speed < x_of(free) < 0
    assert free.step().step_size == decks.OSCILLATOR_STEP


@pytest.mark.parametrize("within", [0.0, -1.0, math.nan, 1e-17])
def test_a_tolerance_of_no_use_is_refused(free, within):
    until = mbcosim.Condition("node.structural.1.X", "<", 0.0, locate_within=within)
    with pytest.raises(mbcosim.Error, match="until.locate_within"):
        free.step(until=until)
    assert free.refresh().step == 0


# ---------------------------------------------------------------- with peers

class Spring:
    """A peer that notes what it was asked."""

    def __init__(self, refuse_longer_than=math.inf, prefers=None):
        self.asked, self.refuse_longer_than, self.prefers = [], refuse_longer_than, prefers

    def __call__(self, motion):
        start = motion.time if motion.iteration == 0 else self.start
        too_long = motion.target_time - start > self.refuse_longer_than
        self.asked.append((motion.step, motion.time, motion.target_time, motion.target_estimated))
        if too_long:
            raise mbcosim.Reject(self.prefers, "too long for me")
        return -STIFFNESS * motion.x

    start = 0.0


LENGTHS = [0.01, 0.004, 0.007, 0.0021, 0.01, 0.0055]


@pytest.mark.parametrize("mode", ["tight", "window", "loose", "staggered"])
def test_peers_of_every_mode_follow_the_lengths(server, swinging, mode):
    spring = Spring()
    with swinging.couple("spring", spring, mode=mode, tolerance=1e-11, acceleration="iqn_ils" if mode in ("tight", "window") else "none"):
        times = [swinging.step(step_size=h).time for h in LENGTHS]
    assert np.allclose(times, np.cumsum(LENGTHS), atol=1e-15)
    with server.load_text(decks.OSCILLATOR_WITH_SPRING.format(stiffness=STIFFNESS)) as whole:
        for h in LENGTHS:
            whole.step(step_size=h)
        bound = 1e-9 if mode in ("tight", "window") else 0.15
        assert abs(x_of(whole) - x_of(swinging)) < bound * abs(x_of(whole))
    if mode == "loose":
        assert np.allclose([asked[2] for asked in spring.asked], times, atol=1e-15)
        assert not any(asked[3] for asked in spring.asked)
    if mode == "staggered":
        assert all(asked[3] for asked in spring.asked)
        deck = decks.OSCILLATOR_STEP
        assert np.allclose([asked[2] - asked[1] for asked in spring.asked[1:]], deck, atol=1e-15)


@pytest.mark.parametrize("mode", ["tight", "window", "loose"])
def test_a_peer_rejects_a_step_and_gets_the_shorter_one(swinging, mode):
    spring = Spring(refuse_longer_than=0.005, prefers=0.004)
    with swinging.couple("spring", spring, mode=mode, acceleration="iqn_ils" if mode != "loose" else "none") as peer:
        before = swinging.export_state()
        with pytest.raises(mbcosim.StepFailed, match="too long for me") as caught:
            swinging.step()
        result = caught.value.result
        assert result.outcome == "REJECTED_BY_PEER" and caught.value.reason == "REJECTED_BY_PEER"
        assert result.preferred_step_size == 0.004 and result.step == 0 and result.steps_done == 0
        assert swinging.export_state() == before
        done = swinging.step(step_size=result.preferred_step_size)
        assert done.outcome == "ACCEPTED" and done.time == 0.004
        if mode != "loose":
            wait_for(lambda: peer.accepted)
            assert peer.rejected == [(0, 0.0)] and peer.accepted == [(1, 0.004)]


def test_a_staggered_peer_rejects_the_step_after(swinging):
    spring = Spring()
    with swinging.couple("spring", spring, mode="staggered"):
        swinging.step()
        wait_for(lambda: len(spring.asked) == 2)
        spring.refuse_longer_than = 0.005
        swinging.step()  # its exchange was answered before
        wait_for(lambda: len(spring.asked) == 3)
        with pytest.raises(mbcosim.StepFailed, match="too long") as caught:
            swinging.step()
        assert caught.value.result.preferred_step_size is None and caught.value.result.step == 2
        spring.refuse_longer_than = math.inf
        assert swinging.step(step_size=0.004).step == 3


@pytest.mark.parametrize("mode", ["loose", "staggered"])
def test_peers_that_cannot_go_back_are_asked_once_for_a_repeated_step(server, mode):
    """Two ports: one peer answers, the other one rejects; the step is repeated with half the length."""
    ports = [mbcosim.structural_port("first", nodes=[1]), mbcosim.structural_port("second", nodes=[2])]
    with server.load_text(decks.OSCILLATOR, ports=ports) as simulation:
        patient, asked_again = Spring(), []

        def strict(motion):
            asked_again.append(motion.step)
            if motion.target_time - motion.time > 0.005 + 1e-12:
                raise mbcosim.Reject(0.005)
            return -STIFFNESS * motion.x

        with simulation.couple("first", patient, mode=mode), simulation.couple("second", strict, mode="loose"):
            with pytest.raises(mbcosim.StepFailed) as caught:
                simulation.step()
            assert caught.value.result.outcome == "REJECTED_BY_PEER"
            assert simulation.step(step_size=caught.value.result.preferred_step_size).time == 0.005
            assert asked_again == [0, 0]
            steps = [0] if mode == "loose" else [0, 1]  # STAGGERED: the next one is asked for after the reply
            wait_for(lambda: len(patient.asked) == len(steps))
            assert [asked[0] for asked in patient.asked] == steps


@pytest.mark.parametrize("mode", ["loose", "staggered"])
def test_a_located_step_asks_explicit_peers_once(swinging, mode):
    spring = Spring()
    until = mbcosim.Condition("node.structural.1.X", "<", 0.0, locate_within=1e-9)
    with swinging.couple("spring", spring, mode=mode):
        result = swinging.step(1000, until=until)
        assert result.condition_met and result.step_size < decks.OSCILLATOR_STEP
        exchanges = result.step + (1 if mode == "staggered" else 0)
        wait_for(lambda: len(spring.asked) >= exchanges)
        assert len(spring.asked) == exchanges
        assert spring.asked[-1][3] is True


@pytest.mark.parametrize("mode", ["tight", "window"])
def test_implicit_peers_take_part_in_locating(server, swinging, mode):
    until = mbcosim.Condition("node.structural.1.X", "<", 0.0, locate_within=1e-9)
    with swinging.couple("spring", Spring(), mode=mode, tolerance=1e-12, acceleration="iqn_ils") as peer:
        result = swinging.step(1000, until=until)
        assert result.condition_met
        wait_for(lambda: len(peer.accepted) == result.step)
        assert peer.accepted[-1] == (result.step, result.time)
        assert peer.rejected and {step for step, _ in peer.rejected} == {result.step - 1}, "the trials"
    with server.load_text(decks.OSCILLATOR_WITH_SPRING.format(stiffness=STIFFNESS)) as whole:
        assert abs(whole.step(1000, until=until).time - result.time) < 2e-9


def test_a_rejection_with_no_number_is_refused(swinging):
    rejection = mbcosim.Reject(1.0)
    rejection.preferred_step_size = -1.0
    with swinging.couple("spring", lambda motion: rejection) as peer:
        with pytest.raises(mbcosim.StepFailed) as caught:
            swinging.step()
        assert caught.value.reason == "PEER_LOST"
        wait_for(lambda: peer.error)
    assert "preferred_step_size" in str(peer.error)


def test_a_record_with_lengths_replays_to_the_bit(server, tmp_path):
    deck = tmp_path / "deck.mbd"
    deck.write_text(decks.OSCILLATOR)
    with server.load(str(deck), ports=PORT, record=True) as simulation:
        spring = Spring()
        with simulation.couple("spring", spring, mode="loose"):
            for h in LENGTHS:
                simulation.step(step_size=h)
            simulation.run_until(0.0777, exact=True)
            simulation.step(50, until=mbcosim.Condition("node.structural.1.X", "<", 0.0, locate_within=1e-9))
            spring.refuse_longer_than = 1e-3
            with pytest.raises(mbcosim.StepFailed):
                simulation.step()
        record = tmp_path / "record"
        record.write_bytes(simulation.record())
    done = subprocess.run([os.path.join(BIN, "mbcosim"), "replay", str(record), str(deck)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
