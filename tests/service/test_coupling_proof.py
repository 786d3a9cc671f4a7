"""What coupling promises: the order of events, implicit solutions that equal the uncut model, bounds when a peer dies."""
import itertools
import signal
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

import decks
import mbcosim
from conftest import TIME_FACTOR, Daemon, leaves_no_thread, redone_alike, stop, wait_for
from mbcosim.v1 import simulations_pb2 as pb
from test_coupling import PORT, oscillator, position, spring

# ---------------------------------------------------------------- order of events

GOLDEN = {
    # (event, step of the values, target time in steps, pass), two steps each
    "loose": [("exchange", 0, 1, 0), ("exchange", 1, 2, 0)],
    "staggered": [("exchange", 0, 1, 0), ("exchange", 1, 2, 0), ("exchange", 2, 3, 0)],
    "window": [("exchange", 1, 1, 1), ("exchange", 1, 1, 2), ("accepted", 1), ("exchange", 2, 2, 1), ("exchange", 2, 2, 2),
               ("accepted", 2)],
    "tight": [("exchange", 1, 1, 1), ("exchange", 1, 1, 2), ("accepted", 1), ("exchange", 2, 2, 1), ("exchange", 2, 2, 2),
              ("accepted", 2)],
}
IMPLICIT = ("window", "tight")


@pytest.mark.parametrize("mode", GOLDEN)
def test_event_order(server, mode):
    trace, h = [], 1e-3

    def constant(motion):
        trace.append(("exchange", motion.step, round(motion.target_time / h), motion.iteration))
        return [[1.0, 0.0, 0.0]] if motion.step < 2 or mode not in IMPLICIT else [[2.0, 0.0, 0.0]]

    with oscillator(server, str(h)) as simulation, simulation.couple("spring", constant, mode=mode) as peer:
        for step in (1, 2):
            simulation.step()
            if mode in IMPLICIT:
                wait_for(lambda: len(peer.accepted) == step)
                trace.append(("accepted", peer.accepted[-1][0]))
        if mode == "staggered":
            wait_for(lambda: len(trace) == 3)
        assert trace == GOLDEN[mode]


def test_a_window_that_fails_tells_its_peer_to_go_back(server):
    with oscillator(server) as simulation:
        numbers = itertools.count(1)
        with simulation.couple("spring", lambda m: [[float(next(numbers)), 0, 0]], mode="window", maximum_passes=3) as peer:
            with pytest.raises(mbcosim.StepFailed, match="did not converge in 3 passes"):
                simulation.step()
            wait_for(lambda: peer.rejected)
            assert peer.exchanges == 3 and peer.accepted == [] and peer.rejected[0][0] == 0
        assert simulation.refresh().step == 0


# ---------------------------------------------------------------- a model cut in two

UNCUT = """
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 10.; time step: 5.e-3; method: ms, 0.6; tolerance: 1.e-11;
  max iterations: 30; end: initial value;
begin: control data; structural nodes: {nodes}; rigid bodies: {nodes}; joints: {joints}; end: control data;
begin: nodes; {node_cards} end: nodes;
begin: elements; {bodies} {joint_cards} end: elements;
"""
LENGTH, STIFFNESS = 1.0, 300.0


def halves():
    """The whole model (two masses and a rod), and its left mass with a port where the rod was."""
    def text(labels, rod):
        cards = "".join(f"structural: {k}, dynamic, {k - 1}.2, 0., 0., eye, 0., {k}., 0., null;" for k in labels)
        bodies = "".join(f"body: {k}, {k}, {k}., null, diag, 1., 1., 1.;" for k in labels)
        joint = (f"joint: 1, rod, 1, position, reference, node, null, 2, position, reference, node, null, {LENGTH}, "
                 f"linear elastic, {STIFFNESS};")
        return UNCUT.format(nodes=len(labels), joints=int(rod), node_cards=cards, bodies=bodies, joint_cards=joint if rod else "")
    return text([1, 2], True), text([1], False), text([2], False)


def test_a_cut_model_equals_the_uncut_one(server):
    """Left mass in one simulation, right mass in another, the rod in between: both coupled implicitly through one peer each."""
    whole, left, right = halves()
    with server.load_text(whole) as uncut:
        uncut.step(100)
        expected = [uncut[f"node.structural.{k}.X"] for k in (1, 2)]

    here, there = mbcosim.structural_port("cut", nodes=[1]), mbcosim.structural_port("cut", nodes=[2])
    with server.load_text(left, ports=[here]) as a, server.load_text(right, ports=[there]) as b:
        start = b.snapshot()

        def rest_of_the_model(motion):
            """Right half: redone from the start of the step for every position of the left mass."""
            nonlocal start
            if motion.iteration == 1:
                start.delete()
                start = b.snapshot()
            else:
                start.restore()
            last = {}

            def rod(m):
                line = m.x[0] - motion.x[0]
                distance = np.linalg.norm(line)
                last["force"] = STIFFNESS * (distance / LENGTH - 1) * line / distance
                return [-last["force"]]

            with b.couple("cut", rod, mode="window", acceleration="iqn_ils", tolerance=1e-13):
                b.step()
            wait_for(lambda: not b.describe().ports[0].has_peer)
            return [last["force"]]

        with a.couple("cut", rest_of_the_model, mode="window", acceleration="iqn_ils", tolerance=1e-12):
            a.step(100)
        assert a["node.structural.1.X"] == pytest.approx(expected[0], abs=1e-10)
        assert b["node.structural.2.X"] == pytest.approx(expected[1], abs=1e-10)


# ---------------------------------------------------------------- added mass

class AddedMass:
    """A peer that is a mass: its force is minus its mass times the acceleration that the velocities of a step imply."""

    def __init__(self, ratio, h):
        self.ratio, self.h, self.start = ratio, h, np.array([0.0, 1.0, 0.0])
        self.last = self.start

    def __call__(self, motion):
        self.last = motion.v[0]
        return [-self.ratio * (motion.v[0] - self.start) / self.h + [0.0, 0.0, 1.0]]

    def accept(self):
        self.start = self.last


@pytest.mark.parametrize("ratio, acceleration, converges", [
    (0.3, "none", True), (3.0, "none", False), (3.0, "aitken", True), (3.0, "iqn_ils", True), (30.0, "none", False),
    (30.0, "aitken", True), (30.0, "iqn_ils", True), (300.0, "none", False), (300.0, "iqn_ils", True)])
def test_added_mass(server, ratio, acceleration, converges):
    h = 1e-2
    peer_mass = AddedMass(ratio, h)
    with oscillator(server, str(h)) as simulation:
        with simulation.couple("spring", peer_mass, mode="window", acceleration=acceleration, tolerance=1e-7) as peer:
            if not converges:
                with pytest.raises(mbcosim.StepFailed, match="interface did not converge|not finite"):
                    simulation.step()
                return
            for _ in range(20):
                simulation.step()
                load = peer_mass(SimpleNamespace(v=[simulation["node.structural.1.XP"]]))[0]
                assert simulation["node.structural.1.load"][:3] == pytest.approx(load, rel=1e-6, abs=1e-6)
                peer_mass.accept()
            assert peer.error is None
            if acceleration == "iqn_ils":
                assert peer.exchanges <= 20 * 6
        # unit mass and added mass share the unit force, up to how the peer differentiates
        assert simulation["node.structural.1.XP"][2] == pytest.approx(20 * h / (1 + ratio), rel=0.1)


def test_restore_redoes_a_window_bit_for_bit(server):
    with oscillator(server) as simulation, simulation.couple("spring", spring, mode="window", acceleration="iqn_ils"):
        assert redone_alike(simulation, 10, 20, lambda: simulation["node.structural.1.X"].tobytes())


# ---------------------------------------------------------------- explicit coupling: its limit

@pytest.mark.parametrize("mode", ["loose", "staggered"])
def test_explicit_coupling_is_stable_up_to_its_limit(server, mode):
    """The force at the end of a step h is that of its start: a spring K with a damper C loses K h of its damping, and is stable for h < C/K."""
    K, C = 400.0, 1.0
    limit = C / K

    def growth(h):
        with oscillator(server, repr(h)) as simulation:
            with simulation.couple("spring", lambda m: -K * m.x - C * m.v, mode=mode):
                simulation.run_until(1.0)
                energy = []
                for end in (1.0, 6.0):
                    simulation.run_until(end)
                    x, v = simulation["node.structural.1.X"], simulation["node.structural.1.XP"]
                    energy.append(K * x @ x + v @ v)
        return np.log(energy[1] / energy[0]) / 5.0

    assert growth(0.7 * limit) < -0.1 and growth(1.4 * limit) > 0.1


# ---------------------------------------------------------------- policies and deaths

def test_wait_goes_on_with_a_peer_that_comes_back(server):
    with oscillator(server) as simulation:
        with simulation.couple("spring", spring, policy="wait"):
            simulation.step(5)
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        stepper = server.attach(simulation.name)
        result = {}
        thread = threading.Thread(target=lambda: result.update(done=stepper.step(5)))
        thread.start()
        wait_for(lambda: "port spring since" in simulation.refresh().waiting_for)
        assert not result
        (wait,) = simulation.refresh().waits
        assert wait.port == "spring" and wait.seconds >= 0 and not wait.has_peer
        with simulation.couple("spring", spring):
            thread.join(10)
            assert result["done"].step == 10


def test_wait_ends_with_the_lease(server):
    with server.load_text(decks.body(spin="null"), ports=PORT, lease=1.0) as simulation:
        with simulation.couple("spring", spring, policy="wait"):
            simulation.step()
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        start = time.monotonic()
        with pytest.raises(mbcosim.StepFailed, match="the peer is gone"):
            simulation.step()
        assert 0.9 < time.monotonic() - start < 6 * TIME_FACTOR
        simulation.refresh()


PEER = """
import sys, time
import mbcosim
server = mbcosim.connect(sys.argv[1])
simulation = server.attach(sys.argv[2])
count = 0
def answer(motion):
    global count
    count += 1
    print(count, flush=True)
    if count == int(sys.argv[3]):
        time.sleep(60)
    return [[1.0, 0.0, 0.0]]
with simulation.couple("spring", answer, peer_timeout=0.5):
    print("attached", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def start_peer(daemon):
    processes = []

    def start(simulation, stall_at=-1):
        process = subprocess.Popen([sys.executable, "-c", PEER, daemon.address, simulation.name, str(stall_at)],
                                   stdout=subprocess.PIPE, text=True)
        processes.append(process)
        assert process.stdout.readline().strip() == "attached"
        return process

    yield start
    for process in processes:
        process.kill()
        process.wait()


@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGSTOP])
@pytest.mark.parametrize("when", ["idle", "in a step"])
def test_a_peer_that_dies_costs_one_step_within_its_bound(server, start_peer, blow, when):
    with oscillator(server) as simulation:
        peer = start_peer(simulation, stall_at=-1 if when == "idle" else 4)
        assert simulation.step(3).step == 3
        if when == "idle" and blow == signal.SIGSTOP:
            stop(peer.pid)
        elif when == "idle":
            peer.send_signal(blow)
        else:
            threading.Timer(0.1, lambda: peer.send_signal(blow)).start()
        start = time.monotonic()
        with pytest.raises(mbcosim.StepFailed) as caught:
            simulation.step()
        assert time.monotonic() - start < 2 * TIME_FACTOR
        assert caught.value.reason == "PEER_LOST" and simulation.refresh().step == 3
        peer.kill()
        wait_for(lambda: not simulation.describe().ports[0].has_peer)
        with simulation.couple("spring", spring):
            assert simulation.step(5).step == 8


def test_peers_leave_no_thread_behind(server, daemon, start_peer):
    with oscillator(server) as simulation:
        def cycle():
            peer = start_peer(simulation)
            simulation.step(2)
            peer.kill()
            wait_for(lambda: not simulation.describe().ports[0].has_peer)

        leaves_no_thread(daemon, cycle, 1)


def test_several_ports_with_modes_of_their_own(server):
    ports = [mbcosim.structural_port("pull", nodes=[1]), mbcosim.signal_port("watch", ["node.structural.1.X"], [])]
    seen = []
    with server.load_text(decks.body(spin="null"), ports=ports) as simulation:
        with simulation.couple("pull", spring, mode="window"), simulation.couple(
                "watch", lambda m: seen.append(m.step) or [], mode="loose", every=2):
            simulation.step(6)
            assert seen == [0, 2, 4]


# ---------------------------------------------------------------- death of the daemon

@pytest.mark.parametrize("blow", [signal.SIGTERM, signal.SIGKILL])
@pytest.mark.parametrize("when", ["idle", "in a step"])
def test_when_the_daemon_ends_peer_and_client_are_told(tmp_path_factory, blow, when):
    daemon = Daemon(str(tmp_path_factory.mktemp("d")))
    release, outcome = threading.Event(), {}

    def answer(motion):
        if when == "in a step" and motion.step == 2:
            release.wait(30)
        return spring(motion)

    def step():
        try:
            outcome["result"] = simulation.step(10 if when == "in a step" else 2).outcome
        except mbcosim.Error as error:
            outcome["error"] = error

    with daemon.connect() as server:
        simulation = oscillator(server)
        simulation._owned = False  # nobody is left to delete it
        peer = simulation.couple("spring", answer, peer_timeout=20)
        client = threading.Thread(target=step)
        client.start()
        if when == "idle":
            client.join(10)
        else:
            wait_for(lambda: "port spring since" in simulation.refresh().waiting_for)
        daemon.process.send_signal(blow)
        start = time.monotonic()
        assert daemon.process.wait(10) == (0 if blow == signal.SIGTERM else -signal.SIGKILL)
        client.join(5)
        release.set()
        assert not client.is_alive() and time.monotonic() - start < 8 * TIME_FACTOR
        if when == "in a step":
            assert outcome.get("result") == "INTERRUPTED" or outcome["error"].code.name in ("UNAVAILABLE", "CANCELLED")
        wait_for(lambda: peer.error)
        with pytest.raises(mbcosim.Unavailable):
            simulation.refresh()
        peer.close()
    daemon._log.close()


def test_a_client_that_dies_in_a_coupled_step_leaves_the_session_to_others(server, daemon):
    code = """
import sys, mbcosim
simulation = mbcosim.connect(sys.argv[1]).attach(sys.argv[2])
simulation.step(10**6)
"""
    with oscillator(server) as simulation:
        with simulation.couple("spring", lambda m: time.sleep(0.02) or spring(m)):
            client = subprocess.Popen([sys.executable, "-c", code, daemon.address, simulation.name])
            wait_for(lambda: simulation.refresh().step > 2)
            client.kill()
            client.wait()
            wait_for(lambda: simulation.refresh().state == pb.SIMULATION_STATE_READY)
            step = simulation.info.step
            assert simulation.step(3).step == step + 3
