#!/usr/bin/env python3
"""Runs the deck corpus and holds each deck to its expected result.

usage: check.py MBCOSIM CORPUS EXPECTED [--part K/N | --others]

EXPECTED has a line for each deck that does not pass: name, result, reason. A deck that is not listed has to pass, a
listed one must end as written: a surprise in either direction fails, so that the list stays true. --others runs the
decks outside core.txt: whatever is not supported there has to be refused by name; nothing may crash or hang.
"""
import argparse
import json
import pathlib
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


def other_surprises(args, names):
    for case in run(args, names):
        if case["result"] in ("CRASH", "SLOW") or "unknown" in case["detail"] and "unknown variable" not in case["detail"]:
            yield f"{case['name']}: {case['result']}: {case['detail']}"


def main():
    args = arguments()
    if not (args.corpus / "run.py").exists():
        print(f"SKIPPED: no deck corpus at {args.corpus} (set the CMake variable MBCOSIM_CORPUS)")
        return SKIPPED
    core = [name for name in (args.corpus / "core.txt").read_text().split("\n") if name and not name.startswith("#")]
    if args.others:
        given = sorted(path.name for path in (args.corpus / "given").iterdir())
        surprises = list(other_surprises(args, [name for name in given if name not in core]))
    else:
        part, parts = map(int, args.part.split("/"))
        surprises = list(core_surprises(args, core[part::parts]))
    for text in surprises:
        print("SURPRISE", text)
    return 1 if surprises else 0


if __name__ == "__main__":
    sys.exit(main())
