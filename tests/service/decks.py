"""Decks as text, for tests that change something in them."""

BODY = """
begin: data; problem: initial value; end: data;
begin: initial value;
  initial time: 0.; final time: {final_time}; time step: {step};
  method: ms, 0.6; tolerance: {tolerance}; max iterations: {iterations};
end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, 0., 1., 0., {spin}; end: nodes;
begin: elements; body: 1, 1, 1., null, diag, {inertia}; end: elements;
"""


def body(final_time="1.", step="1.e-3", tolerance="1.e-9", iterations="20", spin="0.1, 5., 0.1", inertia="1., 2., 3."):
    """A free rigid body at node 1."""
    return BODY.format(final_time=final_time, step=step, tolerance=tolerance, iterations=iterations, spin=spin, inertia=inertia)


def endless():
    """A run that lasts until it is stopped."""
    return body(final_time="1.e9")


def impossible():
    """A body whose steps cannot converge: one iteration, a tolerance out of reach, a fast spin in long steps."""
    return body(final_time="10.", step="0.05", tolerance="1.e-14", iterations="1", spin="1., 20., 1.")


OSCILLATOR_STEP, OSCILLATOR_END = 0.01, 10.0

_OSCILLATOR = """
begin: data; problem: initial value; end: data;
begin: initial value;
  initial time: 0.; time step: 0.01;
  method: ms, 0.6; tolerance: 1.e-9; max iterations: 20; derivatives tolerance: 1.e-2; derivatives coefficient: 1.e-5;
  final time: 10.;
end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 1; joints: %d; end: control data;
begin: nodes;
  structural: 1, dynamic, null, eye, 3., 0.2, 0., null;
  structural: 2, static, null, eye, null, null;
end: nodes;
begin: elements;
  body: 1, 1, 1., null, eye;
  joint: 1, clamp, 2, node, node;
  joint: 2, deformable displacement joint, 2, null, 1, null, linear elastic isotropic, 100.;
%s
end: elements;
"""

# A mass at node 1, thrown from the rest position of a spring of 100 N/m to the ground, and with another one of `stiffness` beside it.
OSCILLATOR = _OSCILLATOR % (2, "")
OSCILLATOR_WITH_SPRING = _OSCILLATOR % (
    3, "  joint: 3, deformable displacement joint, 2, null, 1, null, linear elastic isotropic, {stiffness};")


def cube(side, held=False):
    """side³ masses between rods to their neighbours: the factors of its matrix are large, and take long. `held`: distances in the place of rods along x."""
    label = lambda i, j, k: 1 + i + side * (j + side * k)
    places = [(i, j, k) for k in range(side) for j in range(side) for i in range(side)]
    near = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1), (1, 1, 1)]
    pairs = [(place, other) for place in places for d in near
             for other in [tuple(a + b for a, b in zip(place, d))] if max(other) < side]
    nodes = "".join(f"structural: {label(*p)}, dynamic displacement, {p[0]}., {p[1]}., {p[2]}., null;" for p in places)
    masses = "".join(f"body: {label(*p)}, {label(*p)}, 1.;" for p in places)
    kind = lambda a, b: "distance" if held and a[1:] == b[1:] else "rod"
    law = {"rod": ", linear viscoelastic, 1e3, 1.", "distance": ""}
    joints = "".join(f"joint: {n}, {kind(a, b)}, {label(*a)}, {label(*b)}, from nodes{law[kind(a, b)]};"
                     for n, (a, b) in enumerate(pairs, 1))
    return f"""
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 10.; time step: 1e-3; method: ms, .6; tolerance: 1e-6; max iterations: 30;
derivatives tolerance: 1.; end: initial value;
begin: control data; structural nodes: {len(places)}; rigid bodies: {len(places)}; joints: {len(pairs)}; end: control data;
begin: nodes; {nodes} end: nodes;
begin: elements; {masses} {joints} end: elements;
"""
