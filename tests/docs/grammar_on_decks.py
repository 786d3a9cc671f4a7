#!/usr/bin/env python3
"""The editor grammar colours the statements of the example decks: every statement's first word is known to it, and words between commas at the
beginning of a line as well as within it.

usage: grammar_on_decks.py CLIENT_EXAMPLES
"""
import glob
import json
import os
import re
import sys

HEAD = re.compile(r"\s*([A-Za-z][A-Za-z0-9 ]*?)\s*(?=[:;])")


def statements(text):
    """Text of each statement, comments gone."""
    text = re.sub(r"/\*.*?\*/", " ", text, flags=re.S)
    return (re.sub(r"#.*", "", text)).split(";")


def main():
    folder = sys.argv[1]
    with open(os.path.join(folder, "editor", "syntaxes", "mbcosim.tmLanguage.json"), encoding="utf-8") as file:
        grammar = json.load(file)
    heads = [re.compile(p["match"].replace("(?:^|(?<=;))", "")) for p in grammar["patterns"] if "captures" in p]
    arguments = [re.compile(p["match"]) for p in grammar["patterns"] if p.get("match", "").endswith("(?=[,;])")]
    count, unknown = 0, []
    for path in sorted(glob.glob(os.path.join(folder, "models", "*.mbd"))):
        with open(path, encoding="utf-8") as file:
            text = file.read()
            for line in text.splitlines():
                if any(argument.match("," + line, 1) and not argument.match(line) for argument in arguments):
                    unknown.append(f"{os.path.basename(path)}: {line.strip()[:60]}")
            for statement in statements(text):
                line = " ".join(statement.split()) + ";"
                if line == ";":
                    continue
                count += 1
                if HEAD.match(line) and not any(head.match(line) for head in heads):
                    unknown.append(f"{os.path.basename(path)}: {line[:60]}")
    print("\n".join(unknown))
    if unknown or not count:
        sys.exit(f"{len(unknown)} of {count} statements are not coloured")


if __name__ == "__main__":
    main()
