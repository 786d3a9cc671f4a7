"""Decks of rigid mechanisms as text, for the benchmarks. As a program, writes them into a folder:

usage: rigid_models.py FOLDER
"""
import pathlib
import sys

ABOUT_Y = "hinge, 1, 1.,0.,0., 3, 0.,1.,0."
TOTAL_ABOUT_Y = "position orientation, 1, 1.,0.,0., 3, 0.,1.,0., rotation orientation, 1, 1.,0.,0., 3, 0.,1.,0."
TOTAL_ROWS = ("position constraint, active, active, active, null, "
              "orientation constraint, active, active, inactive, null")


def deck(nodes, elements, joints, bodies, step, steps, output, method="ms, .6"):
    return f"""begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: {(steps - .5) * step!r}; time step: {step!r}; method: {method};
  max iterations: 30; tolerance: 1e-6; derivatives tolerance: 1e-2; derivatives coefficient: 1e-5; end: initial value;
begin: control data; structural nodes: {len(nodes)}; rigid bodies: {bodies}; joints: {joints}; gravity;
  {"" if output else "default output: none;"} end: control data;
begin: nodes;
""" + "\n".join(nodes) + "\nend: nodes;\nbegin: elements;\ngravity: uniform, 0.,0.,-1., const, 9.81;\n" + \
        "\n".join(elements) + "\nend: elements;\n"


def chain(links, kind="revolute", steps=20, output=False):
    """Links of 1 m and 1 kg, released horizontally. kind: spherical, revolute, total."""
    nodes, elements = [], []
    for k in range(1, links + 1):
        nodes.append(f"structural: {k}, dynamic, {k - .5},0.,0., eye, null, null;")
        elements.append(f"body: {k}, {k}, 1., null, diag, .01,.08,.08;")
        if kind == "spherical":
            elements.append("joint: 1, spherical pin, 1, -.5,0.,0., null;" if k == 1 else
                            f"joint: {k}, spherical hinge, {k - 1}, .5,0.,0., {k}, -.5,0.,0.;")
        elif kind == "revolute":
            elements.append(f"joint: 1, revolute pin, 1, -.5,0.,0., {ABOUT_Y}, null, {ABOUT_Y};" if k == 1 else
                            f"joint: {k}, revolute hinge, {k - 1}, .5,0.,0., {ABOUT_Y}, {k}, -.5,0.,0., {ABOUT_Y};")
        else:
            elements.append(f"joint: 1, total pin joint, 1, position, -.5,0.,0., {TOTAL_ABOUT_Y}, position, null, "
                            f"{TOTAL_ABOUT_Y}, {TOTAL_ROWS};" if k == 1 else
                            f"joint: {k}, total joint, {k - 1}, position, .5,0.,0., {TOTAL_ABOUT_Y}, {k}, position, "
                            f"-.5,0.,0., {TOTAL_ABOUT_Y}, {TOTAL_ROWS};")
    return deck(nodes, elements, links, links, 1e-3, steps, output)


def pendulum(steps=5000):
    return chain(1, "revolute", steps, True)


def slider_crank(steps=5000):
    nodes = ["structural: 1, static, null, eye, null, null;", "structural: 2, dynamic, null, eye, null, 0.,0.,12.;",
             "structural: 3, dynamic, .45,0.,0., eye, 0.,1.2,0., 0.,0.,-4.8;",
             "structural: 4, dynamic, .7,0.,0., eye, null, null;"]
    elements = ["joint: 1, clamp, 1, node, node;", "body: 2, 2, 1., null, eye;",
                "body: 3, 3, .5, null, diag, 1e-3,1e-2,1e-2;", "body: 4, 4, 4., null, eye;",
                "joint: 2, axial rotation, 1, null, 2, null, const, 12.;",
                "joint: 3, revolute hinge, 2, .2,0.,0., 3, -.25,0.,0.;",
                "joint: 4, in line, 4, null, eye, 3, offset, .25,0.,0.;",
                "joint: 5, total joint, 1, position, null, 4, position, null, position constraint, inactive, active, "
                "active, null, orientation constraint, active, active, active, null;"]
    return deck(nodes, elements, 5, 3, 1e-3, steps, True)


MODELS = {"pendulum": pendulum, "slider_crank": slider_crank, "chain_10": lambda: chain(10, "revolute", 2000, True)}


def write(folder):
    paths = []
    for name, text in MODELS.items():
        paths.append(pathlib.Path(folder) / f"{name}.mbd")
        paths[-1].write_text(text())
    return paths


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    pathlib.Path(sys.argv[1]).mkdir(parents=True, exist_ok=True)
    print("\n".join(map(str, write(sys.argv[1]))))
