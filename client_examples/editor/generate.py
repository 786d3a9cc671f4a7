#!/usr/bin/env python3
"""Makes the TextMate grammar of the deck language from the words that the program knows.

usage: generate.py MBCOSIM [--check]

Writes syntaxes/mbcosim.tmLanguage.json next to this script; --check only compares, and fails when the file is stale.
"""
import argparse
import json
import os
import re
import subprocess
import sys

TARGET = os.path.join(os.path.dirname(os.path.abspath(__file__)), "syntaxes", "mbcosim.tmLanguage.json")
FLOW = {"begin", "end", "for", "end for", "if", "else if", "else", "end if", "include", "exit"}
FRAMES = ["global", "node", "other node", "other position", "other orientation", "reference", "eye", "null", "same"]
TYPES = ["bool", "integer", "real", "string", "const", "ifndef"]


def pattern(words):
    """One expression for all words; the language ignores case and blanks between the parts of a word."""
    ordered = sorted(set(words), key=lambda word: (-len(word), word))
    return "|".join(r"\s*".join(re.escape(part) for part in word.split()) for word in ordered)


def argument(words, scope):
    """Words that stand between commas, the first one behind the end of a line; editors match line by line."""
    return {"name": scope, "match": rf"(?i)(?:^|(?<=[:,]))\s*(?:{pattern(words)})\s*(?=[,;])"}


def head(words, scope):
    """Words that begin a statement."""
    return {"match": rf"(?i)(?:^|(?<=;))\s*({pattern(words)})\s*(?=[:;])", "captures": {"1": {"name": scope}}}


def grammar(groups):
    served = {g["name"]: [w["word"] for w in g["words"] if w["served"]] for g in groups}
    refused = {g["name"]: [w["word"] for w in g["words"] if not w["served"]] for g in groups}
    blocks = ("data card", "statement", "initial value card", "inverse dynamics card", "control card", "node", "element")
    families = ("joint", "jointregularization", "force", "couple", "genel", "electric", "thermal", "bulk", "hydraulic",
                "userdefined", "file driver")
    cards = sum((served[name] for name in blocks), ["file"])
    types = sum((served[name] for name in families), [])
    objects = sum((served[name] for name in ("drive", "law", "function", "fluid")), [])
    known = set(types) | set(objects) | set(cards)
    unknown = [word for words in refused.values() for word in words if word not in known]
    return {
        "$schema": "https://raw.githubusercontent.com/martinring/tmlanguage/master/tmlanguage.json",
        "name": "MBDyn deck",
        "scopeName": "source.mbcosim",
        "fileTypes": ["mbd", "mbdyn"],
        "patterns": [
            {"name": "comment.line.number-sign.mbcosim", "match": "#.*$"},
            {"name": "comment.block.mbcosim", "begin": r"/\*", "end": r"\*/"},
            {"name": "string.quoted.double.mbcosim", "begin": '"', "end": '"',
             "patterns": [{"name": "constant.character.escape.mbcosim", "match": r"\\."}]},
            {"match": rf"(?i)(?:^|(?<=;))\s*(begin|end)\s*:\s*({pattern(served['block'])})\s*(?=;)",
             "captures": {"1": {"name": "keyword.control.mbcosim"}, "2": {"name": "entity.name.section.mbcosim"}}},
            head(FLOW, "keyword.control.mbcosim"),
            head([word for word in cards if word not in FLOW], "keyword.other.card.mbcosim"),
            argument(types, "entity.name.type.mbcosim"),
            argument(objects, "entity.name.function.mbcosim"),
            argument(FRAMES, "variable.language.mbcosim"),
            argument(unknown, "invalid.deprecated.unsupported.mbcosim"),
            {"name": "storage.type.mbcosim", "match": rf"\b(?:{pattern(TYPES)})\b(?=\s+[A-Za-z_])"},
            {"name": "support.function.mbcosim", "match": rf"\b(?:model::\w+|(?:{pattern(served['expression function'])})(?=\s*\())"},
            {"name": "constant.language.mbcosim", "match": rf"\b(?:{pattern(served['constant'])}|Time|TimeStep|Step|Var)\b"},
            {"name": "constant.numeric.mbcosim", "match": r"(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?"},
        ],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("executable")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    words = subprocess.run([options.executable, "keywords", "--json"], check=True, stdout=subprocess.PIPE).stdout
    text = json.dumps(grammar(json.loads(words)), indent=1) + "\n"
    if options.check:
        with open(TARGET, encoding="utf-8") as file:
            if file.read() != text:
                sys.exit("the grammar is stale: run client_examples/editor/generate.py build/bin/mbcosim")
        return
    with open(TARGET, "w", encoding="utf-8") as file:
        file.write(text)


if __name__ == "__main__":
    main()
