#!/usr/bin/env python3
"""Runs the deck corpus and holds each deck to its expected result.

usage: check.py MBCOSIM CORPUS EXPECTED [--part K/N | --others [--write]]

EXPECTED has a line for each deck that does not pass: name, result, reason. A deck that is not listed has to pass, a
listed one must end as written: a surprise in either direction fails, so that the list stays true.

With --others, EXPECTED has a line for each deck that is refused: name, what it misses. Every deck of the corpus is read;
it has to be accepted, or refused with one "not supported yet" for each of the listed words and no other error. --write
makes the list anew.
"""
import argparse
import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile

SKIPPED = 77


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary", type=pathlib.Path)
    parser.add_argument("corpus", type=pathlib.Path)
    parser.add_argument("expected", type=pathlib.Path)
    parser.add_argument("--part", default="0/1", help="K/N: every N-th deck from the K-th on")
    parser.add_argument("--others", action="store_true")
    parser.add_argument("--write", action="store_true")
    return parser.parse_args()


def read_expected(path):
    lines = [line for line in path.read_text().splitlines() if line and not line.startswith("#")]
    return {name: result for name, result, _ in (line.split("\t") for line in lines)}


def run(args, names):
    with tempfile.TemporaryDirectory() as folder:
        listed, out = pathlib.Path(folder, "list.txt"), pathlib.Path(folder, "out.json")
        listed.write_text("\n".join(names) + "\n")
        subprocess.run([sys.executable, str(args.corpus / "run.py"), str(args.binary.resolve()), "--list", str(listed),
                        "--json", str(out), "-j", "1", "--limit", "300", "-q"], check=False)
        return json.loads(out.read_text())


def core_surprises(args, names):
    expected = read_expected(args.expected)
    for case in run(args, names):
        wanted = expected.get(case["name"], "PASS")
        if case["result"] != wanted:
            yield f"{case['name']}: {case['result']}, expected {wanted}: {case['detail']}"


def decks(args):
    """Name and path of every deck of the corpus."""
    with open(args.corpus / "cases.tsv", encoding="utf-8") as file:
        for case in csv.DictReader(file, delimiter="\t"):
            yield case["case"], args.corpus / "given" / case["case"] / case["deck"]


def errors_of(args, deck):
    """The errors that `validate` finds in a deck."""
    command = [str(args.binary), "validate", "--json", str(deck)]
    done = subprocess.run(command, stdout=subprocess.PIPE, timeout=60, check=False)
    if done.returncode not in (0, 2):
        return [{"code": "exit", "message": f"exit code {done.returncode}"}]
    return [d for d in json.loads(done.stdout)["diagnostics"] if d["severity"] == "error"]


def missing_words(errors):
    """"rotor", "c81 data": the words that are refused; other errors are returned as they are."""
    refused = [re.search(r'"([^"]+)" \(', e["message"]).group(1) for e in errors if e["code"] == "not-supported"]
    return sorted(refused), [e["message"] for e in errors if e["code"] != "not-supported"]


def other_surprises(args):
    expected = {}
    for line in args.expected.read_text().splitlines() if args.expected.exists() else []:
        if line and not line.startswith("#"):
            name, words = line.split("\t")
            expected[name] = words
    found = {}
    for name, deck in decks(args):
        words, others = missing_words(errors_of(args, deck))
        found[name] = ", ".join(words)
        if len(words) != len(set(words)):
            yield f"{name}: one word is refused more than once: {found[name]}"
        for message in others:
            yield f"{name}: {message}"
        if not args.write and found[name] != expected.get(name, ""):
            yield f"{name}: misses {found[name] or 'nothing'}, expected {expected.get(name, 'nothing')}"
    if args.write:
        lines = [f"{name}\t{words}" for name, words in sorted(found.items()) if words]
        head = "# Decks of the corpus that are refused, with the words that are not supported yet. All others are read to the end."
        args.expected.write_text("\n".join([head, *lines]) + "\n")


def main():
    args = arguments()
    if not (args.corpus / "run.py").exists():
        print(f"SKIPPED: no deck corpus at {args.corpus} (set the CMake variable MBCOSIM_CORPUS)")
        return SKIPPED
    core = [name for name in (args.corpus / "words.txt").read_text().split("\n") if name and not name.startswith("#")]
    if args.others:
        surprises = list(other_surprises(args))
    else:
        part, parts = map(int, args.part.split("/"))
        surprises = list(core_surprises(args, core[part::parts]))
    for text in surprises:
        print("SURPRISE", text)
    return 1 if surprises else 0


if __name__ == "__main__":
    sys.exit(main())
