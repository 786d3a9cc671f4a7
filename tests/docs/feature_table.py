#!/usr/bin/env python3
"""Holds the feature tables of a page against what the program serves.

usage: feature_table.py MBCOSIM PAGE [--write]

MBCOSIM is the executable; its `keywords --json` is the truth. --write brings the tables up to date.
"""
import argparse
import json
import re
import subprocess
import sys

BEGIN, END = "<!-- feature tables -->", "<!-- end of the feature tables -->"
# Expressions have their own short lists in the text; their words are not features one by one. Notation is what cards are made of.
PLAIN = {"expression function", "constant", "notation"}


def vocabulary(executable):
    """Groups that have a table."""
    text = subprocess.run([executable, "keywords", "--json"], check=True, stdout=subprocess.PIPE).stdout
    return [group for group in json.loads(text) if group["name"] not in PLAIN]


def parse(text):
    """(status, note) by word, by title of the table."""
    tables, rows = {}, None
    for line in text.splitlines():
        if line.startswith("## "):
            rows = tables.setdefault(line[3:], {})
        elif line.startswith("|") and rows is not None and not re.match(r"\|\s*(-+|Word)\s*\|", line):
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            rows[cells[0].strip("`")] = (cells[1], cells[2] if len(cells) > 2 else "")
    return tables


def row(word):
    """Status and note as the program has them."""
    note = word.get("note", "")
    if not note and "sizes" in word and word["sizes"] != [1, 3, 6]:
        note = "for " + " and ".join(f"{n} component{'s' * (n > 1)}" for n in word["sizes"])
    return word["support"], note


def complaints(groups, tables):
    """What is wrong with the tables, a sentence each."""
    found = []
    for group in groups:
        rows = tables.get(group["title"], {})
        words = {word["word"]: word for word in group["words"]}
        found += [f"{group['title']}: no row for `{word}`" for word in words if word not in rows]
        found += [f"{group['title']}: `{word}` is no word of the language" for word in rows if word not in words]
        found += [f"{group['title']}: `{word}` has {written}; the program says {row(words[word])}"
                  for word, written in rows.items() if word in words and written != row(words[word])]
    titles = {group["title"] for group in groups}
    return found + [f"a table of unknown title: {title}" for title in tables if title not in titles]


def written(groups):
    """The tables as they should be."""
    lines = []
    for group in groups:
        lines += [f"## {group['title']}", "", "| Word | Served | Notes |", "|---|---|---|"]
        for word in group["words"]:
            status, note = row(word)
            lines.append(f"| `{word['word']}` | {status} | {note} |")
        lines.append("")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("executable")
    parser.add_argument("page")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()

    with open(options.page, encoding="utf-8") as file:
        text = file.read()
    before, begin, rest = text.partition(BEGIN)
    inside, end, after = rest.partition(END)
    if not begin or not end:
        sys.exit(f"{options.page}: the markers of the tables are missing")
    groups, tables = vocabulary(options.executable), parse(inside)
    if options.write:
        with open(options.page, "w", encoding="utf-8") as file:
            file.write(f"{before}{begin}\n\n{written(groups)}\n{end}{after}")
        return
    found = complaints(groups, tables)
    for sentence in found:
        print(sentence)
    if found:
        sys.exit(f"update the tables: tests/docs/feature_table.py build/bin/mbcosim {options.page} --write")
    print(f"{sum(len(rows) for rows in tables.values())} words, all in the tables")


if __name__ == "__main__":
    main()
