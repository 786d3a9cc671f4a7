"""Decks of beam structures as text, for the benchmarks: a cantilever, and grids in the plane and in space."""
import itertools

LAW = "linear elastic generic, diag, 1e6, 1e6, 1e6, 100., 100., 200."
AXES = ("eye", "1, 0.,1.,0., 3, 0.,0.,1.", "1, 0.,0.,1., 2, 0.,1.,0.")  # of sections, for beams along x, y and z


def deck(nodes, elements, counts, steps, step=1e-3, tolerance=1e-4):
    return f"""begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: {(steps - .5) * step!r}; time step: {step!r}; method: ms, .6;
  max iterations: 30; tolerance: {tolerance!r}; derivatives tolerance: 1e3; derivatives max iterations: 50; linear solver: klu;
end: initial value;
begin: control data; structural nodes: {len(nodes)}; {counts} gravity; default output: none; end: control data;
begin: nodes;
""" + "\n".join(nodes) + "\nend: nodes;\nbegin: elements;\ngravity: uniform, 0.,0.,-1., const, 9.81;\n" + \
        "\n".join(elements) + "\nend: elements;\n"


def cantilever(beams, steps):
    """Three-node beams of 1 m under gravity, clamped at one end, with a follower force at the other that grows from nothing. Positions
    of a kilometre are rounded to 1e-13 m, with a stiffness of 1e6 N to 1e-7 N: what a residual can come down to grows with the length."""
    nodes, elements = [], ["joint: 1, clamp, 1, node, node;"]
    last = 2 * beams + 1
    for k in range(1, last + 1):
        nodes.append(f"structural: {k}, {'static' if k == 1 else 'dynamic'}, {.5 * (k - 1)!r},0.,0., eye, null, null;")
        if k > 1:
            elements.append(f"body: {k}, {k}, .5, null, diag, 5e-5, .0104, .0104;")
    for k in range(beams):
        ends = ", ".join(f"{2 * k + n}, null" for n in (1, 2, 3))
        elements.append(f"beam3: {k + 1}, {ends}, eye, {LAW}, same, same;")
    elements.append(f"force: 1, follower, {last}, position, null, 0.,1.,0., ramp, .1, 0., forever, 0.;")
    return deck(nodes, elements, f"rigid bodies: {last - 1}; beams: {beams}; joints: 1; forces: 1;", steps, tolerance=1e-4 * max(1, beams / 1000))


def grid(shape, steps):
    """Two-node beams of 1 m between neighbouring points of a grid of `shape` beams along each axis, clamped where x = 0, under gravity."""
    points = list(itertools.product(*(range(count + 1) for count in shape)))
    label = {point: k for k, point in enumerate(points, 1)}
    nodes, elements, clamps, beams = [], [], 0, 0
    for point, k in label.items():
        x, y, z = (*point, 0, 0)[:3]
        held = x == 0
        nodes.append(f"structural: {k}, {'static' if held else 'dynamic'}, {x}.,{y}.,{z}., eye, null, null;")
        if held:
            clamps += 1
            elements.append(f"joint: {k}, clamp, {k}, node, node;")
        else:
            elements.append(f"body: {k}, {k}, 1., null, diag, .01, .08, .08;")
        for axis in range(len(shape)):
            other = tuple(p + (a == axis) for a, p in enumerate(point))
            if other not in label or (held and axis > 0):
                continue
            beams += 1
            elements.append(f"beam2: {beams}, {k}, null, {label[other]}, null, {AXES[axis]}, {LAW};")
    return deck(nodes, elements, f"rigid bodies: {len(points) - clamps}; beams: {beams}; joints: {clamps};", steps)
