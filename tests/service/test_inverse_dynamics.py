"""Inverse dynamics over the wire: a simulation like any other that advances, is read and goes back."""
import numpy as np
import pytest

import mbcosim

# A rod turns about the y axis by θ = t²/2 in the plane of gravity; its centre is .5 m away from the pivot.
MASS, ARM, INERTIA, GRAVITY = 2.0, 0.5, 0.25, 9.81
DECK = f"""
begin: data; problem: inverse dynamics; end: data;
begin: inverse dynamics; final time: 1.; time step: .1; tolerance: 1e-12; max iterations: 20; end: inverse dynamics;
begin: control data; default output: accelerations; end: control data;
begin: nodes; structural: 1, static, null, eye, null, null; end: nodes;
begin: elements;
  gravity: uniform, 0.,0.,-1., const, {GRAVITY};
  body: 1, 1, {MASS}, {ARM},0.,0., diag, .1,{INERTIA},.1;
  joint: 1, total pin joint, 1, position, null, position, null, position constraint, 1,1,1, null, null, null,
    orientation constraint, 1,1,1, 0.,1.,0., parabolic, 0.,0.,.5, 0.,1.,0., linear, 0.,1., 0.,1.,0., const, 1.;
end: elements;
"""
STATE = ["node.structural.1.R", "node.structural.1.Omega", "joint.1.Fx", "joint.1.Fz", "joint.1.My"]


def torque(t):
    """Of the pivot on the rod about y; θ turns the centre to (cos θ, 0, -sin θ)."""
    angle = t * t / 2
    return (INERTIA + MASS * ARM**2) - MASS * GRAVITY * ARM * np.cos(angle)


def bits(simulation):
    return {name: np.asarray(value).tobytes() for name, value in simulation.read(STATE).items()}


def test_records_have_the_motion_and_the_loads_of_their_instants(server):
    with server.load_text(DECK) as simulation:
        for k in range(1, 4):
            simulation.step()
            found, t = simulation.read(STATE), simulation.time
            assert t == pytest.approx(k * 0.1, rel=1e-12)
            assert found["node.structural.1.Omega"] == pytest.approx([0, t, 0], abs=1e-12)
            assert found["joint.1.My"] == pytest.approx(-torque(t), rel=1e-10)  # of the rod on the pivot


def test_a_call_ends_at_the_last_record(server):
    with server.load_text(DECK) as simulation:
        done = simulation.step(100)
        assert done.outcome == "FINISHED"
        assert done.step == 10 and done.time == pytest.approx(1, rel=1e-12)


def test_snapshots_continue_bit_for_bit(server):
    with server.load_text(DECK) as simulation, server.load_text(DECK) as other:
        simulation.step(4)
        snapshot, data = simulation.snapshot(), simulation.export_state()
        simulation.step(5)
        expected = bits(simulation)
        snapshot.restore()
        assert simulation.step_number == 4 and bits(simulation) != expected
        simulation.step(5)
        assert bits(simulation) == expected
        other.import_state(data)
        other.step(5)
        assert bits(other) == expected


def test_there_is_nothing_to_linearize(server):
    with server.load_text(DECK) as simulation:
        with pytest.raises(mbcosim.Error, match="prescribes the motion"):
            simulation.eigenvalues()
