"""Linearization and eigenvalues of a running simulation."""
import numpy as np
import pytest

import mbcosim

OSCILLATOR = """
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 10.; time step: 1e-2; tolerance: 1e-9; max iterations: 20; end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 1; joints: 3; end: control data;
begin: nodes;
  structural: 1, dynamic, 1.,0.,0., eye, null, null;
  structural: 2, static, null, eye, null, null;
end: nodes;
begin: elements;
  body: 1, 1, 2., null, eye;
  joint: 1, clamp, 2, node, node;
  joint: 2, prismatic, 2, 1;
  joint: 3, in line, 2, position, null, orientation, 2, 0.,1.,0., 3, 1.,0.,0., 1;
  joint: 4, deformable displacement joint, 2, position, 1.,0.,0., 1, position, null, linear viscoelastic generic,
    diag, 800.,800.,800., diag, 8.,8.,8.;
end: elements;
""".replace("joints: 3", "joints: 4")
S = -2 + 1j * np.sqrt(396)  # 2 kg, 8 N s/m, 800 N/m


@pytest.fixture
def oscillator(server):
    with server.load_text(OSCILLATOR) as simulation:
        yield simulation


def test_eigenvalues_of_an_oscillator(oscillator):
    values, vectors = oscillator.eigenvalues(vectors=True)
    assert sorted(values, key=np.imag) == pytest.approx([np.conj(S), S], abs=1e-6)
    E, A, *_ = oscillator.linearize_descriptor()
    for value, vector in zip(values, vectors.T):
        assert np.linalg.norm(A @ vector - value * (E @ vector)) < 1e-6 * abs(value)
    assert oscillator.step_number == 0


def test_state_space_of_an_oscillator(oscillator):
    A, B, C, D = oscillator.linearize(["node.structural.1.load"], ["node.structural.1.X", "node.structural.1.XP"])
    assert A.shape == (2, 2) and B.shape == (2, 6) and C.shape == (6, 2) and D.shape == (6, 6)
    s = 3j
    response = C @ np.linalg.solve(s * np.eye(2) - A, B) + D
    expected = 1 / (2 * s * s + 8 * s + 800)
    assert response[0, 0] == pytest.approx(expected, rel=1e-6)
    assert response[3, 0] == pytest.approx(s * expected, rel=1e-6)
    assert np.abs(response[1:3]).max() < 1e-9


def test_few_eigenvalues_near_a_frequency(oscillator):
    values = oscillator.eigenvalues(1, shift=3.2)
    assert values == pytest.approx([S], abs=1e-6)


def test_analysis_refuses_nonsense(oscillator):
    with pytest.raises(mbcosim.Error):
        oscillator.eigenvalues(-1)
    with pytest.raises(mbcosim.Error):
        oscillator.eigenvalues(1, shift=float("nan"))
    with pytest.raises(mbcosim.Error):
        oscillator.linearize(["node.structural.1.X"], [])
