#!/usr/bin/env python3
"""Writes the seed corpus of the fuzz target: the example decks with the files they read, other folders of decks, expressions.

usage: seeds.py OUTPUT_FOLDER [FOLDER_WITH_DECKS ...]
"""
import glob
import os
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
LONGEST = 1 << 16  # libFuzzer's inputs
NAMED = re.compile(r'"([^"\n]+\.[A-Za-z0-9]+)"')


def read(path):
    with open(path, "rb") as file:
        return file.read()


def bundle(path):
    """A deck, and behind lines `%%file NAME` the files that it names, and those that they name."""
    folder, parts, names = os.path.dirname(path), [read(path)], [b"deck.mbd"]
    for text in parts:
        for name in NAMED.findall(text.decode("utf-8", "replace")):
            file = os.path.join(folder, name)
            if name.encode() not in names and os.path.isfile(file):
                names.append(name.encode())
                parts.append(read(file))
    return parts[0] + b"".join(b"\n%%file " + name + b"\n" + part for name, part in zip(names[1:], parts[1:]))


def decks(folder):
    patterns = ("*.mbd", "*.mbdyn", "*.inp")
    return sorted(path for p in patterns for path in glob.glob(os.path.join(folder, "**", p), recursive=True))


def expressions():
    """Each row of the table of expressions as a deck of its own."""
    for line in read(os.path.join(ROOT, "tests", "unit", "input", "expressions.tsv")).decode().splitlines():
        cells = line.split("\t")
        if len(cells) >= 2 and not line.startswith("#"):
            yield f"{cells[0]}\nremark: {cells[1]};\n".encode() if len(cells) > 2 else f"remark: {cells[0]};\n".encode()


def inline():
    """Decks and pieces of decks in the unit tests: R"(...)" and R"deck(...)deck"."""
    for path in sorted(glob.glob(os.path.join(ROOT, "tests", "unit", "**", "*.cpp"), recursive=True)):
        for _, text in re.findall(r'R"(\w*)\((.*?)\)\1"', read(path).decode(), flags=re.S):
            yield text.encode()


def main():
    target, folders = sys.argv[1], [os.path.join(ROOT, "client_examples", "models"), *sys.argv[2:]]
    os.makedirs(target, exist_ok=True)
    seeds = [bundle(path) for folder in folders for path in decks(folder)] + [*expressions(), *inline()]
    kept = sorted({seed for seed in seeds if len(seed) <= LONGEST})
    for i, seed in enumerate(kept):
        with open(os.path.join(target, f"seed{i:04}"), "wb") as file:
            file.write(seed)
    print(f"{len(kept)} seeds in {target}")


if __name__ == "__main__":
    main()
