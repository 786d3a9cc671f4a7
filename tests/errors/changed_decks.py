"""Twenty-two more wrong decks: each is the arm below (or the beads) with one change.

They are chosen from what goes wrong in practice: structure, counts, labels, definitions, includes, units, loads and contact.
"""

PARTS = {
    "parts.inc": "set: const real radius = .05;\nset: const real area = pi*radius^2;\n",
    "volume.inc": "set: const real height = .05;\nset: const real volume = height*heigth;\n",
}

ARM = """# A swinging arm against a stop, SI units.
set: const real length = 1.;
set: const real mass = 2.;
include: "parts.inc";
begin: data;
  problem: initial value;
end: data;
begin: initial value;
  initial time: 0.;
  final time: .2;
  time step: 1.e-3;
  method: ms, .6;
  tolerance: 1.e-6;
  max iterations: 20;
end: initial value;
begin: control data;
  structural nodes: 3;
  rigid bodies: 2;
  joints: 4;
  forces: 2;
  gravity;
end: control data;
scalar function: "pull", multilinear, 0., 0., 1., 5.;
reference: 9, position, reference, global, length, 0., 0.,
  orientation, reference, global, eye,
  velocity, reference, global, null,
  angular velocity, reference, global, null;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, reference, 9, null, reference, 9, eye, reference, 9, null, reference, 9, null;
  structural: 3, dynamic, 2., 0., 0., eye, null, null;
end: nodes;
begin: elements;
  body: 2, 2, mass, null, diag, .1, .1, .1;
  body: 3, 3, mass, null, diag, .1, .1, .1;
  joint: 1, clamp, 1, node, node;
  joint: 2, revolute hinge,
    1, position, null, hinge, 1, 1., 0., 0., 3, 0., 1., 0.,
    2, position, -length, 0., 0., hinge, 1, 1., 0., 0., 3, 0., 1., 0.;
  joint: 3, spherical hinge, 2, position, .5, 0., 0., 3, position, -.5, 0., 0.;
  joint: 4, rod, 1, 3, 2., linear viscoelastic, 1000., 10.;
  force: 1, absolute, 3, position, null, 0., 0., 1., scalar function, "pull";
  couple: 2, follower, 2, position, null, 0., 1., 0., sine, .05, 20., .1, forever, 0.;
  gravity: uniform, 0., 0., -1., const, 9.81;
end: elements;
"""

BEADS = """# Two beads meet; the law of their contact saturates.
begin: data;
  problem: initial value;
end: data;
begin: initial value;
  initial time: 0.;
  final time: .1;
  time step: 2.e-3;
  method: ms, .6;
  tolerance: 1.e-6;
  max iterations: 15;
end: initial value;
scalar function: "push", multilinear, -1., -3., 0., -3., 1.e-8, 0., 1., 0.;
begin: control data;
  structural nodes: 2;
  rigid bodies: 2;
  joints: 1;
  skip initial joint assembly;
end: control data;
begin: nodes;
  structural: 1, dynamic displacement, null, .4, 0., 0.;
  structural: 2, dynamic displacement, 2.e-3, 0., 0., -.4, 0., 0.;
end: nodes;
begin: elements;
  body: 1, 1, 2.e-6;
  body: 2, 2, 2.e-6;
  joint: 1, rod, 1, 2, 1.e-3, scalar function elastic isotropic, "push";
end: elements;
"""

def edited(*changes):
    """The arm with these texts replaced."""
    text = ARM
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def card(place, cause, severity="error"):
    return rf"deck\.mbd:{place}: {severity}: .*{cause}"


CONTROL = ARM[ARM.index("begin: control data;"):ARM.index("scalar function")]
MILLIMETRES = [("length = 1.", "length = 1000."), ("dynamic, 2., 0., 0.", "dynamic, 2000., 0., 0."),
               (".5, 0., 0., 3, position, -.5", "500., 0., 0., 3, position, -500."), ("1, 3, 2.,", "1, 3, 2000.,"), ("9.81", "9810.")]

# deck: text, exit code, place and cause, remedy
FAULTS = {
    # structure
    "nodes_before_control_data": (
        edited((CONTROL, ""), ("end: nodes;\n", "end: nodes;\n" + CONTROL)), 2,
        card("21:8", "block \"control data\" expected"), r"hint: the blocks stand in this order"),
    "wrong_end": (edited(("end: nodes;", "end: node;")), 2, card("32:1", r"block \"nodes\" \(begun at line 28\) closed by"),
                  r"hint: write `end: nodes;`"),
    "no_elements": (ARM[:ARM.index("begin: elements")], 2, card("19:3", "4 joints, 2 rigid bodies, 2 forces, 1 gravity missing"),
                    r"hint: correct the counts .* or add what lacks"),
    "missing_comma": (edited(("2, 2, mass, null", "2, 2, mass null")), 2, card("34:20", "\",\" expected after \"mass\""),
                      r"hint: the form is `body : <label> , "),
    "open_quote": (edited(('"parts.inc"', '"parts.inc')), 2, card("4:10", "unterminated string"), r"hint: end it with a double quote"),
    # counts
    "too_few_declared": (edited(("structural nodes: 3", "structural nodes: 2")), 2,
                         card("31:15", r"structural node 3 exceeds the declared number \(2\)"),
                         r"hint: see the card \"structural nodes\" .*deck\.mbd:17"),
    "negative_count": (edited(("joints: 4;", "joints: -4;")), 2, card("19:11", "count must not be negative, got -4"),
                       r"hint: write how many follow"),
    # labels
    "node_twice": (edited(("structural: 3, dynamic", "structural: 2, dynamic")), 2,
                   card("31:15", r"structural node 2 already defined at .*deck\.mbd:30"), r"hint: give one of the two another label"),
    "force_on_nothing": (edited(("force: 1, absolute, 3", "force: 1, absolute, 33")), 2,
                         card("42:23", "structural node 33 is not defined"), r"hint: correct the label, or define"),
    "missing_drive": (edited(("sine, .05, 20., .1, forever, 0.", "reference, 7")), 2,
                      card("43:66", "drive caller 7 is not defined"), r"hint: correct the label, or define"),
    # definitions
    "missing_function": (edited(('scalar function, "pull"', 'scalar function, "thrust"')), 2,
                         card("42:71", "scalar function \"thrust\" is not defined"),
                         r"hint: define it before it is used: `scalar function: \"thrust\""),
    "text_for_a_number": (edited(("mass = 2.;", 'mass = "heavy";')), 2, card("3:24", "cannot convert string to real"),
                          r"hint: write a value of this type, without quotes"),
    # includes
    "include_of_itself": (edited(('"parts.inc"', '"deck.mbd"')), 2, card("4:10", "recursive include"),
                          r"hint: a file cannot include itself"),
    "error_in_an_include": (edited(('"parts.inc"', '"volume.inc"')), 2,
                            r"volume\.inc:2:33: error: unknown variable \"heigth\"(.|\n)*included from .*deck\.mbd:4",
                            r"did you mean \"height\"\?"),
    # elements
    "body_on_static_node": (edited(("body: 2, 2, mass", "body: 2, 1, mass")), 2,
                            card("34:12", "structural node 1 is static; a body needs a dynamic node"), r"hint: make the node `dynamic`"),
    "parallel_axes": (edited(("1, position, null, hinge, 1, 1., 0., 0., 3, 0., 1., 0.",
                              "1, position, null, hinge, 1, 1., 0., 0., 3, 1., 0., 0.")), 2,
                      card("38:57", "hinge orientation: vectors are parallel"), r"hint: give two axes with different directions"),
    "no_direction": (edited(("uniform, 0., 0., -1.", "uniform, 0., 0., 0.")), 0, card("44:21", "the direction is null", "warning"),
                     r"hint: give a direction"),
    # numerics
    "step_of_zero": (edited(("time step: 1.e-3", "time step: 0.")), 2, card("11:14", "time step must not be zero"),
                     r"hint: write a positive length"),
    "inertia_in_metres": (edited(*MILLIMETRES), 3,
                          r"derivatives phase at t = 0 (.|\n)*body 2 has a radius of gyration of 0\.274, in a model that measures 2e\+03",
                          r"hint: body 2 .*check the units of its mass and inertia"),
    "load_too_large": (edited(("sine, .05, 20., .1, forever, 0.", "const, 1.e9")), 3,
                       r"derivatives phase at t = 0 (.|\n)*structural node 2, ",
                       r"hint: look for loads and velocities too large at the start and for units"),
    "unheld": (edited(("  joint: 1, clamp, 1, node, node;\n", ""), ("joints: 4", "joints: 3")), 3,
               r"nothing determines: structural node 1, ", r"hint: no element holds these: give the node a body, a joint \(`clamp`"),
    "contact": (BEADS, 3, r"step at t = 0\.002 \(step 1\): no convergence(.|\n)*structural node 2, force balance x",
                r"hint: the iteration goes to and fro at structural node [12]: a contact.* shorten the time step"),
}
