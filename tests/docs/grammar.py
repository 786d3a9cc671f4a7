#!/usr/bin/env python3
"""Writes sentences by the grammar that the program tells of its language, and has the program read them.

usage: grammar.py MBCOSIM [--show] [--only GROUP[/WORD]]

For every served word of `keywords --json`: its shortest sentence, one with all that may be left out, and one for each thing that
may be left out and each alternative. A sentence that is refused, or that is read with a warning of an unknown word, is a failure.
--show prints the sentences.
"""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile

TOKEN = re.compile(r'<[^>]*>|"[^"]*"|[][{}()|,*]|[^\s,]+')
# Words without sentences of their own: the structure of a deck, words with blocks around them, and what expands to other groups.
PLAIN = {"block", "expression function", "constant"}
STRUCTURE = {"begin", "end", "for", "end for", "if", "else if", "else", "end if", "exit", "include"}
FAMILIES = {"bulk", "couple", "electric", "force", "genel", "hydraulic", "joint", "joint regularization", "thermal", "user defined"}
NOT_WRITTEN = {("element", word) for word in FAMILIES} | {("statement", word) for word in STRUCTURE} | {
    ("law", "symbolic"), ("notation", "command line"), ("notation", "law 3"), ("notation", "law 6"), ("notation", "scalar function"),
    ("notation", "fluid"), ("initial value card", "real time"), ("initial value card", "pod"), ("inverse dynamics card", "real time"),
    ("control card", "inertia"), ("statement", "c81 data")}


def parse(text):
    """Nested lists: a sequence of str (literals), ("optional", seq), ("choice", [seq]), ("repeat", seq, count)."""
    tokens = TOKEN.findall(text)
    at = 0

    def sequence(closing):
        nonlocal at
        alternatives, current = [], []
        while at < len(tokens):
            token = tokens[at]
            at += 1
            if token in closing:
                alternatives.append(current)
                return alternatives
            if token == "[":
                inner = sequence({"]"})
                current.append(("optional", inner[0] if len(inner) == 1 else [("choice", inner)]))
            elif token == "{":
                current.append(("choice", sequence({"}"})))
            elif token == "(":
                inner = sequence({")"})
                assert tokens[at] == "*", text
                count = [tokens[at + 1]]
                at += 2
                while at < len(tokens) and re.fullmatch(r"[A-Za-z]+", tokens[at]) and count[0] == "n":
                    count.append(tokens[at])
                    at += 1
                current.append(("repeat", inner[0], " ".join(count)))
            elif token == "|":
                alternatives.append(current)
                current = []
            else:
                current.append(token)
        assert not closing, f"unbalanced: {text}"
        return alternatives + [current]

    alternatives = sequence(set())
    return alternatives[0] if len(alternatives) == 1 else [("choice", alternatives)]


class Writer:
    """Sentences; `value` writes the arguments."""

    def __init__(self, value):
        self.value = value

    def shortest(self, seq):
        return " ".join(filter(None, (self.piece(p)[0] for p in seq)))

    def piece(self, p):
        """All variants of one part: the shortest first."""
        if isinstance(p, str):
            return [self.value(p) if p[0] in '<"' else p]
        if p[0] == "optional":
            return [""] + self.variants(p[1])
        if p[0] == "choice":
            return [v for alternative in p[1] for v in self.variants(alternative)]
        count = 2 if p[2].startswith("n ") else int(p[2])
        items = [self.variants(p[1]) for _ in range(count)]
        return [" , ".join([v] + [others[0] for others in items[1:]]) for v in items[0]]

    def variants(self, seq):
        pieces = [self.piece(p) for p in seq]
        shortest = [v[0] for v in pieces]
        found = [shortest] + [shortest[:k] + [v] + shortest[k + 1:] for k in range(len(pieces)) for v in pieces[k][1:]]
        return [" ".join(filter(None, f)) for f in found]

    def longest(self, seq):
        parts = []
        for p in seq:
            if isinstance(p, str):
                parts.append(self.value(p) if p[0] in '<"' else p)
            elif p[0] == "optional":
                parts.append(self.longest(p[1]))
            elif p[0] == "choice":
                parts.append(self.longest(p[1][0]))
            else:
                count = 2 if p[2].startswith("n ") else int(p[2])
                parts.append(" , ".join(self.longest(p[1]) for _ in range(count)))
        return " ".join(filter(None, parts))

    def all(self, text):
        seq = parse(text)
        sentences = self.variants(seq) + [self.longest(seq)]
        return list(dict.fromkeys(re.sub(r"\s*,\s*(?=,|$)", "", s.replace(" ,", ",")) for s in sentences))


# Arguments by name, without unit. Others: 1. and, of `n …`, 2.
VALUES = {
    "node": ["1", "2", "3", "4"], "displacement node": ["5"], "modal node": ["6"], "dummy node": ["7"], "static node": ["8"],
    "abstract node": ["11", "12", "13", "14", "15", "16"], "electric node": ["21", "22"], "thermal node": ["25", "26"],
    "hydraulic node": ["31", "32", "33", "34", "35", "36"], "parameter node": ["41"], "element parameter node": ["42"],
    "abstract dof": ["11, abstract, algebraic", "12, abstract, algebraic", "13, abstract, algebraic"],
    "equation": ["11, abstract", "12, abstract"], "dof": ["11, abstract, algebraic"], "scalar value": ["node dof, 12, abstract, algebraic"],
    "position": ["reference, global, .1,.2,.3"], "offset": ["reference, node, .1,.2,.3"], "velocity": ["null"], "angular velocity": ["null"],
    "direction": ["0.,0.,1."], "word of the drive group": ["time"], "word of the law group": ["linear elastic, 1."],
    "word of the fluid group": ["incompressible, density, 1000., viscosity, 1e-3"], "vec3": [".1,.2,.3"], "vec6": ["1.,2.,3.,4.,5.,6."], "mat3": ["diag, 1.,2.,3."],
    "absolute orientation": ["eye"], "orientation": ["euler, .1,.2,.3"], "rotation": ["eye"], "inertia": ["diag, 1.,2.,2."],
    "orientation description": ["orientation vector"], "yes or no": ["yes"], "drive": ["const, 1."], "distance drive": ["const, 1."],
    "vec3 drive": ["1.,0.,0., const, 1."], "vec6 drive": ["1.,0.,0.,0.,0.,0., const, 1."], "mat3 drive": ["eye, const, 1."],
    "mat6 drive": ["eye, const, 1."], "mat6": ["eye"], "law 1": ["linear elastic, 1."], "elastic law 1": ["linear elastic, 1."],
    "law 3": ["linear elastic isotropic, 1."], "law 6": ["linear elastic generic, eye"], "elastic law 6": ["linear elastic generic, eye"],
    "viscous law 6": ["linear viscous, 1."], "6 rows": ["0.,0.,0.,0.,1.,0.,0.,0.,0.,0.,1.,0."], "element fluid": ["fluid, reference, 1"],
    "beam output": ["forces"], "label": ["900"], "frame": ["9"], "joint": ["70"], "beam3": ["80"], "modal joint": ["71"],
    "mode": ["1"], "total equation": ["72"], "drive caller": ["1"], "template drive caller": ["1"], "constitutive law": ["1"],
    "hydraulic fluid": ["1"], "file driver": ["1"], "private datum": ["rz"], "node datum": ["X[1]"], "function name": ["new$"],
    "friction function": ["f"], "hinge friction": ['friction, .1, discrete coulomb, "f", simple'],
    "guide friction": ['friction, discrete coulomb, "f", simple'], "friction law": ['discrete coulomb, "f"'],
    "inverse dynamics clause": ["torque, yes"], "communicator": ['socket, path, "/tmp/mbcosim$"'], "stream": ['name, "p$", grpc, values, 1, drive, 1.'],
    "port name": ["p$"], "address": ['path, "/tmp/mbcosim$"'], "method": ["crank nicolson"], "linear solver": ["klu"], "bistop": ["time, time"],
    "scalar function": ["const, 1."], "increment": ["const, .1"], "fluid": ["incompressible, density, 1000., viscosity, 1e-3"],
    "label of the joint": ["70"], "head": ["joint"], "first label": ["1"], "last label": ["9"], "hint": ["drive{const, 1.}"],
    "FEM data": ["body.fem"], "FEM node": ["1"], "samples": ["samples.txt"], "mapping": ["mapping.txt"], "modes": ["modes.txt"],
    "file": ["file$.txt"], "table": ["table$"], "input": ["in$"], "output": ["out$"], "path": ["/tmp/mbcosim$"], "host": ["127.0.0.1"],
    "folder": ["folder"], "title": ["a title"], "name": ["name$"], "module": ["libmodule-wheel2"], "NAME=value": ["NAME=value"],
    "format": ["%02d"], "expression of Time": ["Time"], "expression": ["1+1"], "expression 2": ["2"], "namespace": ["default"],
    "n port": ["$"], "n datum": ["1"], "n nodes": ["1"], "n modes": ["2"], "n column": ["1"], "n order": ["1"], "n order of B": ["1"], "n steps before reduction": ["1"], "n steps before raise": ["1"], "n bytes": ["64"], "n eigenvalues": ["2"],
    "n vectors": ["9"], "n seed": ["3"], "n digits": ["9"], "n min iterations": ["1"], "n max iterations": ["9"], "n threads": ["1"],
    "t0": ["0."], "t1": ["1."], "t2": ["2."], "t3": ["3."], "reduction": [".5"], "raise": ["2."], "fraction": [".3"], "ratio": [".1"],
    "factor": ["2."], "lower": ["-1."], "upper": ["1."], "lower limit": ["0."], "limit": ["10."], "h": [".1"], "critical Reynolds number": ["10."],
    "diameter": [".01"], "small area": ["1e-5"], "area": ["1e-3"], "area 1": ["1e-3"], "area 2": ["1e-3"], "tyre radius": [".1"],
    "upper strain": [".1"], "lower strain": ["-.1"], "n1": ["5"], "n2": ["3"], "rho": [".5"], "fact": [".5"], "kref": [".9"], "klim": [".9"],
    "kappa": [".5"], "saturation pressure": ["1."], "highest pressure": ["1e6"], "pressure": ["1e5"], "position of the spool": [".1"],
    "level": [".1"], "coefficient": [".5"], "declaration or expression": ["real new$ = 1."], "exponent": ["2."], "stress": ["1."],
    "strain drive": ["const, 1."], "a1": ["1."], "e": ["1."], "gain": ["2."], "base": ["2."], "loss 1 to 2": ["1."], "loss 2 to 1": ["1."],
    "q": [".1"], "velocity threshold": [".1"], "length": ["2."], "start position": [".1"], "angle": [".1"], "pipe area": ["1e-3"],
    "spool area": ["1e-3"], "scale": ["2."], "module arguments": ["1"], "unit of length": ["mm"], "unit of mass": ["t"],
    "unit of force": ["N"], "unit of time": ["s"], "mean": ["0."], "threshold": ["1e-9"], "time": [".1"],
}
# Numbers with units that 1. does not do for.
NUMBERS = {"t0": ["0."], "t1": ["1."], "t2": ["2."], "t3": ["3."], "limit": ["10."], "lower limit": ["0."], "h": [".1"], "diameter": [".01"],
           "small area": ["1e-5"], "area": ["1e-3"], "area 1": ["1e-3"], "area 2": ["1e-3"], "tyre radius": [".1"], "highest pressure": ["1e6"],
           "pressure": ["1e5"], "level": [".1"], "angle": [".1"], "pipe area": ["1e-3"], "spool area": ["1e-3"], "position": [".1"], "length": ["2."],
           "theta": [".1"], "increasing": ["1."]}

NODES = """structural: 1, dynamic, null, eye, null, null; structural: 2, dynamic, 1.,0.,0., eye, null, null;
structural: 3, dynamic, 2.,0.,0., eye, null, null; structural: 4, dynamic, .5,.1,.2, eye, null, null;
structural: 5, dynamic displacement, 0.,1.,0., null; structural: 6, modal, null, eye, null, null;
abstract: 11; abstract: 12; abstract: 13; abstract: 14; abstract: 15; abstract: 16; electric: 21; electric: 22; thermal: 25; thermal: 26;
hydraulic: 31, 1e5; hydraulic: 32, 1e5; hydraulic: 33, 1e5; hydraulic: 34, 1e5; hydraulic: 35, 1e5; hydraulic: 36, 1e5;
parameter: 41, 1.;"""
ELEMENTS = """reference: 9, 1.,2.,3., eye, null, null; scalar function: "f", linear, 0., .1, 1., .1;
drive caller: 1, const, 1.; template drive caller: 1, 3, 1.,0.,0., const, 1.; constitutive law: 1, 1, linear elastic, 1.;
constitutive law: 1, 3, linear elastic isotropic, 1.; constitutive law: 1, 6, linear elastic isotropic, 1.;
hydraulic fluid: 1, incompressible, density, 1000., viscosity, 1e-3;
joint: 70, revolute hinge, 1, null, 2, null; joint: 71, modal, 6, 2, from file, "body.fem", 0;
joint: 72, total equation, 1, 2, position constraint, active, inactive, inactive, null;
beam3: 80, 1, null, 2, null, 3, null, eye, linear elastic generic, eye, same, same;
hydraulic: 90, pipe, 31, 32, .01, 1., fluid, reference, 1; hydraulic: 91, pipe, 33, 34, .01, 1., fluid, reference, 1;
hydraulic: 92, pipe, 35, 36, .01, 1., fluid, reference, 1;"""
FEM = """** RECORD GROUP 1
REVISION NODE NORMAL ATTACHMENT CONSTRAINT REJECTED MODES
REV0 2 2 0 0 0
** RECORD GROUP 2
1 2
** RECORD GROUP 3
0. 0.
** RECORD GROUP 4
0. 0.
** RECORD GROUP 5
0. 1.
** RECORD GROUP 6
0. 0.
** RECORD GROUP 7
0. 0.
** RECORD GROUP 8
** MODE 1
1. 0. 0. 0. 0. 0.
0. 1. 0. 0. 0. 0.
** MODE 2
0. 0. 1. 0. 0. 0.
0. 1. 1. 0. 0. 0.
** RECORD GROUP 9
1. 0.
0. 1.
** RECORD GROUP 10
4. 0.
0. 9.
** RECORD GROUP 11
1. 1. 1. 1. 1. 1.
1. 1. 1. 1. 1. 1.
"""
FILES = {"body.fem": FEM, "samples.txt": "# initial time: 0.\n# time step: .1\n0. 1.\n1. 2.\n2. 3.\n", "mapping.txt": "1 1 1.\n2 2 1.\n3 3 1.\n",
         "modes.txt": "".join(f"1 {k} 1.\n" for k in range(1, 13))}
# Cards around an object, a notation: `$X` is its sentence, `$L` a label of its own.
HOSTS = {
    "drive": "drive caller: $L, $X;", "law": "constitutive law: $L, $N, $X;", "function": 'scalar function: "g$L", $X;',
    "fluid": "hydraulic fluid: $L, $X;",
    "vec3": "reference: $L, $X, eye;", "vec6": "constitutive law: $L, 6, linear elastic, 1., prestress, $X;", "mat3": "template drive caller: $L, 3x3, single, $X, 1.;",
    "mat6": "constitutive law: $L, 6, linear elastic generic, $X;", "rotation": "reference: $L, null, $X;", "position": "reference: $L, $X, eye;",
    "velocity": "reference: $L, null, eye, $X;", "angular velocity": "reference: $L, null, eye, null, $X;",
    "offset": "joint: $L, rod, 1, position, $X, 2, 1., 1.;", "direction": "joint: $L, linear velocity, 1, $X, 1.;",
    "absolute orientation": "reference: $L, null, $X;", "orientation": "joint: $L, prismatic, 1, hinge, $X, 2;",
    "inertia": "body: $L, 1, 1., null, $X;", "orientation description": "joint: $L, spherical hinge, 1, null, 2, null, orientation description, $X;",
    "yes or no": "beam2: $L, 1, null, 2, null, eye, linear elastic generic, eye, output, $X;", "dof": "drive caller: $L, dof, $X, direct;",
    "equation": "force: $L, abstract, $X, 1.;", "scalar value": "genel: $L, state space SISO, 11, abstract, algebraic, $X, 1, matrix A, 1., matrix B, 1., matrix C, 1.;",
    "vec3 drive": "couple: $L, absolute, 1, $X;", "vec6 drive": "template drive caller: $L, 6, $X;",
    "mat3 drive": "template drive caller: $L, 3x3, $X;", "mat6 drive": "template drive caller: $L, 6x6, $X;",
    "law 1": "genel: $L, spring support, 11, abstract, algebraic, $X;", "element fluid": "hydraulic: $L, pipe, 31, 32, .01, 1., $X;",
    "bistop": "genel: $L, spring support, 11, abstract, algebraic, linear elastic bistop, 1., $X;",
    "beam output": "beam2: $L, 1, null, 2, null, eye, linear viscoelastic generic, eye, eye, custom output, $X;",
    "friction law": "joint: $L, revolute hinge, 1, null, 2, null, friction, .1, $X, simple;",
    "hinge friction": "joint: $L, revolute hinge, 1, null, 2, null, $X;", "guide friction": "joint: $L, in line, 1, null, eye, 2, $X;",
    "communicator": "force: $L, external structural, $X, 1, 1;", "address": 'file: $L, stream, name, "p$L", $X, 1;',
    "stream": "stream output: $L, $X;", "inverse dynamics clause": "joint: $L, $J, inverse dynamics, $X;",
}


class Decks:
    """Sentences as decks, and what the program says of them."""

    def __init__(self, executable, folder):
        self.executable, self.folder, self.label = executable, folder, 1000
        for name, text in FILES.items():
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(text)

    def value(self):
        """Writes arguments; `$` in a value is the label of the sentence's card."""
        self.label += 1

        def of(token):
            quoted = token[0] == '"'
            name = re.sub(r" \[.*\]$", "", token.strip('"')[1:-1])
            number_with_unit = token.endswith("]>")
            number = 1
            if name not in VALUES and (m := re.fullmatch(r"(.*) (\d)", name)) and m[1] in VALUES:
                name, number = m[1], int(m[2])
            given = NUMBERS.get(name, ["1."]) if number_with_unit else VALUES.get(name, ["2" if name.startswith("n ") else "1."])
            text = given[number - 1].replace("$", str(self.label))
            if name == "increasing":
                self.increasing += 1
                text = str(self.increasing)
            elif name == "mode":
                self.mode = 3 - self.mode
                text = str(self.mode)
            return f'"{"f" if name == "scalar function" else text}"' if quoted else text
        self.increasing, self.mode = 0, 2
        return of

    def read(self, deck):
        path = os.path.join(self.folder, "deck.mbd")
        with open(path, "w", encoding="utf-8") as file:
            file.write(deck)
        run = subprocess.run([self.executable, "validate", path], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120)
        return [line for line in run.stdout.splitlines() if re.search(r"\berror:|\bwarning: unknown", line)]

    def deck(self, **cards):
        inverse = cards.get("inverse")
        problem = "inverse dynamics" if inverse is not None else "initial value"
        block = inverse if inverse is not None else "final time: 1.; max iterations: 10; " + cards.get("initial", "")
        nodes = cards.get("all_nodes", NODES + cards.get("nodes", ""))
        return (f"begin: data; problem: {problem}; end: data;\nbegin: {problem}; {block} end: {problem};\n"
                f"begin: control data; {cards.get('control', '')} end: control data;\nbegin: nodes; {nodes} end: nodes;\n"
                f"begin: drivers; {cards.get('drivers', '')} end: drivers;\n"
                f"begin: elements;\n{cards.get('all_elements', ELEMENTS)}\n{cards.get('elements', '')}\nend: elements;\n")

    def inverse_deck(self, cards):
        return self.deck(inverse=f"problem type: underdetermined fully actuated; {cards}", all_nodes="structural: 1, static, null, eye, null, null;",
                         all_elements="joint: 1, clamp, 1, node, node;")

    def sentence(self, group, word, text, size=None):
        """The deck of one sentence."""
        body = f"{word}, {text}" if text else word
        label = str(self.label)
        if group == "data card":
            return self.inverse_deck("") if text == "inverse dynamics" else self.deck()
        if group == "initial value card":
            return self.deck(initial=f"{word}: {text};" if text else f"{word};")
        if group == "inverse dynamics card":
            return self.inverse_deck(f"{word}{': ' + text if text else ''};")
        if group == "control card" and word == "rigid body kinematics":
            return self.deck(control=f"{word}: {text};", all_nodes="structural: 1, dynamic, null, eye, null, null;", all_elements="")
        if group == "control card" and word in ("gravity", "air properties"):
            return ""
        if group == "control card":
            if re.search(r" (nodes|elements|drivers)$|^(rigid bodies|joints|joint regularizations|beams|plates|forces|genels|aeromodals)$", word):
                return ""  # counts are those of the deck
            return self.deck(control=f"{word}: {text};" if text else f"{word};")
        if group == "statement":
            return self.deck(elements=f"{word}: {text};" if text else f"{word};")
        if group == "node":
            return self.deck(nodes=f"{word}: {label}{', ' + text if text else ''};", elements=self.used_node(word, label, text))
        if group == "element":
            return self.element(word, label, text)
        if group == "file driver":
            return self.deck(drivers=f"file: {label}, {body};")
        if group == "jointregularization":
            body_text = text.replace("list, .5, .5, .5, .5, .5, .5", "list, .5, .5, .5, .5, .5")
            return self.deck(elements=f"joint regularization: 70, {word}{', ' + body_text if body_text else ''};")
        if group in HOSTS or group == "notation":
            return self.hosted(group, word, text if group == "notation" else body, label, size)
        head = {"userdefined": "user defined"}.get(group, group)
        return self.deck(elements=f"{head}: {label}, {body};")

    @staticmethod
    def used_node(word, label, text):
        if word == "hydraulic":
            return f"hydraulic: {label}, pipe, {label}, 31, .01, 1., fluid, reference, 1;"
        if word == "structural" and text.startswith("modal"):
            return f'joint: {label}, modal, {label}, 2, from file, "body.fem", 0;'
        if word == "parameter" and text.startswith("element"):
            return f'bind: 70, joint, {label}, string, "rz";'
        if word == "parameter" and text.startswith("beam strain gage"):
            return f"bind: 80, beam, {label}, index, 1;"
        return ""

    def element(self, word, label, text):
        if word in ("gravity", "automatic structural"):
            return self.deck(elements=f"{word}: {text};")
        if word == "bind":
            return self.deck(nodes="parameter: 42, element;", elements=f"bind: {text};")
        if word == "output":
            return self.deck(elements=f"output: {text.replace('900', '70')};")
        if word == "driven":
            return ""
        return self.deck(elements=f"{word}: {label}, {text};")

    def hosted(self, group, word, text, label, size):
        if word in ("method", "linear solver"):
            return self.deck(initial=f"{word}: {text};")
        host = HOSTS[word if group == "notation" else group]
        joint = "total joint, 1, 2, position constraint, 1, 1, 1, null" if "torque" in text or "motion" in text else "rod, 1, 2, from nodes, 1."
        card = host.replace("$J", joint).replace("$L", label).replace("$X", text).replace("$N", str(size))
        if word == "file":
            return self.deck(drivers='file: 1, variable step, 1, "samples.txt";', elements=card)
        return self.deck(drivers=card) if card.startswith("file:") else self.deck(elements=card)


def law_values(size, value):
    """Arguments of a law of `size` components."""
    vector = ", ".join(["1."] * size)
    by_name = {"matrix": "1." if size == 1 else "eye", "strain": vector, "law": "linear elastic, 1." if size == 1 else "linear elastic isotropic, 1.",
               "stress": vector, "strain drive": "const, 1." if size == 1 else f"{vector}, const, 1.", "functions": ", ".join(['"f"'] * size),
               "strain symbols": ", ".join(f'"e{k}"' for k in range(size)), "rate symbols": ", ".join(f'"d{k}"' for k in range(size)),
               "strain expressions": ", ".join(f'"e{k}^2"' for k in range(size)), "rate expressions": ", ".join(f'"d{k}"' for k in range(size))}

    def of(token):
        name = re.sub(r" \[.*\]$", "", token[1:-1])
        if name == "direction 3":
            return "0.,0.,1."
        return by_name[name] if name in by_name else value(token)
    return of


def sentences(decks, group, word):
    """(sentence, deck) of all sentences of a word."""
    for size in word.get("sizes", [None]):
        value = decks.value()
        writer = Writer(law_values(size, value) if size else value)
        for text in writer.all(word.get("grammar", "")):
            deck = decks.sentence(group["name"], word["word"], text, size)
            if deck:
                yield text, deck


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("executable")
    parser.add_argument("--show", action="store_true")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    groups = json.loads(subprocess.run([options.executable, "keywords", "--json"], check=True, stdout=subprocess.PIPE).stdout)
    failures, count = [], 0
    with tempfile.TemporaryDirectory() as folder:
        decks = Decks(os.path.abspath(options.executable), folder)
        for group in groups:
            if group["name"] in PLAIN:
                continue
            for word in group["words"]:
                place = f"{group['name']}/{word['word']}"
                if not word["served"] or not place.startswith(options.only) or (group["name"], word["word"]) in NOT_WRITTEN:
                    continue
                for text, deck in sentences(decks, group, word):
                    count += 1
                    if options.show:
                        print(f"{place}: {text}")
                    failures += [f"{place}: {text}\n    {line}" for line in decks.read(deck)]
    for failure in failures:
        print(failure)
    print(f"{count} sentences, {len(failures)} complaints")
    sys.exit(1 if failures or not count else 0)


if __name__ == "__main__":
    main()
