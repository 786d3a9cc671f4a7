#!/usr/bin/env python3
"""Holds a page's table of refused decks against the list that the corpus test checks.

usage: refused_decks.py REFUSED.tsv PAGE [--write]
"""
import sys

BEGIN, END = "<!-- refused decks -->", "<!-- end of the refused decks -->"


def table(path):
    """A row for each set of missing words, with its decks."""
    decks = {}
    with open(path, encoding="utf-8") as file:
        for line in file:
            if not line.startswith("#"):
                name, words = line.rstrip("\n").split("\t")
                decks.setdefault(words, []).append(name)
    rows = [f"| {', '.join(f'`{w}`' for w in words.split(', '))} | {', '.join(names)} |" for words, names in sorted(decks.items())]
    return "\n".join(["| Missing | Decks |", "|---|---|", *rows])


def main():
    refused, page = sys.argv[1:3]
    with open(page, encoding="utf-8") as file:
        text = file.read()
    before, begin, rest = text.partition(BEGIN)
    inside, end, after = rest.partition(END)
    if not begin or not end:
        sys.exit(f"{page}: the markers of the table are missing")
    if "--write" in sys.argv:
        with open(page, "w", encoding="utf-8") as file:
            file.write(f"{before}{begin}\n\n{table(refused)}\n\n{end}{after}")
    elif inside.strip() != table(refused):
        sys.exit(f"the table of refused decks is stale: tests/docs/refused_decks.py tests/corpus/refused.tsv {page} --write")


if __name__ == "__main__":
    main()
