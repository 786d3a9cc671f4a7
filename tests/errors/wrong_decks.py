#!/usr/bin/env python3
"""Twice twenty-two wrong decks, scored. usage: wrong_decks.py BIN

Each deck of decks/, and each of changed_decks.py, has one fault. `mbcosim run` must tell place and cause (one point) and a remedy
(one point): what it prints is searched for the patterns below. Prints the score and what lacks; the exit code is 0 when nothing does.
"""
import os
import re
import subprocess
import sys
import tempfile

import changed_decks

DECKS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "decks")
CARD = r"{deck}\.mbd:%s: %s: .*"

# deck: exit code, place and cause, remedy
FAULTS = {
    "empty": (2, r"{deck}\.mbd: error: there is nothing to run", r"consists of the blocks data, initial value"),
    "triangle": (0, CARD % ("25:39", "warning") + "body 2: no body has this inertia", r"hint: inertia is given about the centre of mass"),
    "zero_inertia": (3, r"nothing determines: structural node 1, ", r"give them mass and moments of inertia"),
    "negative_step": (0, CARD % ("7:14", "warning") + "time step is negative", r"hint: write a positive length"),
    "final_before_initial": (0, CARD % ("6:15", "warning") + "final time is before the initial time", r"hint: give a final time after"),
    "wrong_count": (2, CARD % ("15:3", "error") + "1 joint missing", r"hint: correct the counts"),
    "missing_node": (2, CARD % ("27:48", "error") + "structural node 3 is not defined", r"hint: correct the label, or define"),
    "misspelled_joint": (2, CARD % ("27:13", "error") + "unknown joint type", r"did you mean \"revolute hinge\""),
    "missing_semicolon": (2, CARD % ("9:3", "error") + "card begun at line 8", r"hint: end that card with \";\""),
    "label_twice": (2, CARD % ("27:10", "error") + r"joint 1 already defined at .*{deck}\.mbd:26", r"hint: give one of the two another label"),
    "undefined_variable": (2, CARD % ("28:64", "error") + "unknown variable \"thrust\"", r"hint: declare it before it is used: `set: real thrust"),
    "missing_end": (2, CARD % ("23:1", "error") + "end of file in block \"elements\"", r"hint: close the block: `end: elements;`"),
    "divide_by_zero": (2, CARD % ("2:17", "error") + "division by zero", r"hint: check the values that enter here"),
    "negative_mass": (2, CARD % ("25:15", "error") + "mass must not be negative, got -1", r"hint: write `allow negative mass`"),
    "missing_include": (2, CARD % ("19:10", "error") + "cannot open .*materials.inc", r"hint: check the name"),
    "bad_orientation": (2, CARD % ("21:39", "error") + "orientation matrix is not orthogonal", r"hint: give at least seven correct digits"),
    "redundant": (3, r"redundant or empty equations: .*joint 3 \(revolute hinge\)", r"hint: remove redundant constraints"),
    "apart": (3, r"joint 2 \(revolute hinge\), position constraint 1: off by 0\.333, in the input by 1\n", r"hint: correct the positions"),
    "step_too_long": (3, r"step at t = 0\.5 \(step 1\): no convergence(.|\n)*structural node 2",
                      r"hint: the time step is too long: structural node 2 turns by 20 rad .* shorten it to about 0\.0025 s"),
    "load_jump": (3, r"step at t = 0\.05 \(step 50\): no convergence(.|\n)*structural node 2",
                  r"hint: a load or drive jumps within this step, by .* in structural node 2, moment balance .*: let it grow"),
    "contact": (3, r"no convergence in 12 iterations(.|\n)*structural node 2, force balance x",
                r"hint: the iteration goes to and fro at structural node .: a contact, a stop"),
    "units": (3, r"step at t = 0\.001 \(step 1\)", r"hint: body 2 has a radius of gyration of 0\.000274.* check the units"),
}


def run(program, deck, folder):
    command = [os.path.join(program, "mbcosim"), "run", deck, "-o", os.path.join(folder, "out")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    return done.returncode, done.stdout + done.stderr


def score(code, printed, fault):
    wanted, place_and_cause, remedy = fault
    found = [bool(re.search(pattern, printed)) for pattern in (place_and_cause, remedy)]
    return [code == wanted and found[0], found[1]]


def decks(folder):
    """Name, path and fault of each deck."""
    for name, (code, place_and_cause, remedy) in FAULTS.items():
        yield name, os.path.join(DECKS, name + ".mbd"), (code, place_and_cause.replace("{deck}", name), remedy)
    for name, text in changed_decks.PARTS.items():
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(text)
    for name, (text, *fault) in changed_decks.FAULTS.items():
        path = os.path.join(folder, "deck.mbd")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        yield name, path, fault


def main():
    assert {name[:-len(".mbd")] for name in os.listdir(DECKS)} == set(FAULTS)
    points = most = 0
    with tempfile.TemporaryDirectory() as folder:
        for name, path, fault in decks(folder):
            code, printed = run(sys.argv[1], path, folder)
            got = score(code, printed, fault)
            points += sum(got)
            most += 2
            if sum(got) < 2:
                print(f"{name}: place and cause {'+' if got[0] else '-'}, remedy {'+' if got[1] else '-'}; exit code {code}\n{printed}")
    print(f"{points} of {most}")
    sys.exit(0 if points == most else 1)


if __name__ == "__main__":
    main()
