#!/usr/bin/env python3
"""Writes the reference of the deck language, card by card, from what the program tells of its words.

usage: deck_reference.py MBCOSIM FOLDER [--write]

MBCOSIM is the executable; its `keywords --json` is the truth. Without --write nothing is written: tells what would change, and ends with 1.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import textwrap

NOTE = "<!-- Written by tests/docs/deck_reference.py from `mbcosim keywords --json`; change src/input/grammar. -->\n"
WIDTH = 110
PLAIN = ("expression function", "constant")  # words without a grammar: a table is enough
SAMPLES = "Grammars are samples of how a word is usually written, not all that the reader takes."
HEADS = {  # what a page says before its words
    "notation": "What the other pages write in angle brackets. A notation may be written anew by others of this page.",
    "block": "A deck is made of these blocks, in this order: `data`, one block for the problem, `control data`, `nodes`, `drivers` when there are "
             "file drivers, `elements`.",
}


def vocabulary(executable):
    return json.loads(subprocess.run([executable, "keywords", "--json"], check=True, stdout=subprocess.PIPE).stdout)


def file_of(group):
    return re.sub(r"\W+", "_", group["name"]) + ".md"


def anchor(title):
    """As GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def anchors_of(words):
    """The anchor of each word's heading; GitHub numbers those that come again."""
    seen, found = {}, {}
    for word in words:
        name = anchor(word["word"])
        found[word["word"]] = name if name not in seen else f"{name}-{seen[name]}"
        seen[name] = seen.get(name, 0) + 1
    return found


def statement(group, word):
    """The form of the word, or of its group, with the word and its grammar."""
    form = word.get("form") or group.get("form", "<word>")
    if "grammar" not in word:
        form = re.sub(r"\[ (: |, )?<grammar> \]|[:,] <grammar>", "", form)
    text = form.replace("<word>", word["word"]).replace("<grammar>", word.get("grammar", ""))
    whole = re.sub(r"<[^>]*>|\S+ ,|[\[{(] ", lambda found: found[0].replace(" ", "\0"), re.sub(r" +", " ", text))  # what stays together
    whole = re.sub(r"(\S) ([,;\]})])", "\\1\0\\2", whole)
    lines = textwrap.wrap(whole, WIDTH, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines).replace("\0", " ")


def notations(word, known):
    """Names in angle brackets that the page of notations explains, in their order."""
    names = []
    for name in re.findall(r"<([^>\[]+?)(?: \d+)?>", word.get("grammar", "")):
        if name in known and name not in names:
            names.append(name)
    return names


def entry(group, word, known, folder_of_notation):
    lines = [f"### {word['word']}", ""]
    if not word["served"]:
        return lines + [f"Not served: {word.get('reason') or word['support']}.", ""]
    lines += ["```", statement(group, word), "```", ""]
    facts = []
    if word["support"] != "yes" or "note" in word:
        facts.append(f"Served: {word['support']}" + (f"; {word['note']}" if "note" in word else ""))
    if "sizes" in word and word["sizes"] != [1, 3, 6]:
        facts.append("For " + " and ".join(f"{n} component{'s' * (n > 1)}" for n in word["sizes"]))
    if "units" in word:
        facts.append("Units: " + ", ".join(f"{name} [{unit}]" for name, unit in word["units"].items()))
    if "output" in word:
        facts.append(f"Writes {word['output']}")
    made_of = [name for name in notations(word, known) if not (group["name"] == "notation" and name == word["word"])]
    if made_of:
        facts.append("Made of: " + ", ".join(f"[{name}]({folder_of_notation}#{known[name]})" for name in made_of))
    return lines + [f"- {fact}" for fact in facts] + [""] * bool(facts)


def table(group):
    rows = [f"| `{word['word']}` | {word['support']} | {word.get('note', '')} |" for word in group["words"]]
    return ["| Word | Served | Notes |", "|---|---|---|", *rows, ""]


def page(group, known):
    lines = [NOTE, f"# {group['title']}", ""]
    if group["name"] in HEADS:
        lines += [HEADS[group["name"]], ""]
    if group["name"] in PLAIN:
        return "\n".join(lines + table(group))
    lines += [f"{SAMPLES} The general form:", "", "```", group["form"], "```", ""]
    place = "" if group["name"] == "notation" else "notation.md"
    for word in group["words"]:
        lines += entry(group, word, known, place)
    return "\n".join(lines)


def index(groups):
    served = sum(word["served"] for group in groups for word in group["words"])
    rows = [f"| [{group['title']}]({file_of(group)}) | {len(group['words'])} | {', '.join(samples(group))} |" for group in groups]
    return "\n".join([NOTE, "# The deck language, card by card", "", textwrap.fill(
        f"Every word that the reader knows, {served} of them served: how it is written, the units of its numbers, what it writes, how far it is "
        f"served. {SAMPLES} A test writes sentences by these grammars and has them read. What is written differently from MBDyn, and what is not served, "
        "in short tables: [LANGUAGE.md](../../../src/input/LANGUAGE.md); results that differ: [DIFFERENCES.md](../../../src/DIFFERENCES.md). "
        "The same texts are what `mbcosim lsp` shows in an editor and what `mbcosim keywords --json` prints.", 140), "",
        "How to read a grammar:", "",
        "| Written | Meaning |", "|---|---|",
        "| `word` | the word itself; case and blanks inside do not matter |",
        "| `<mass [kg]>` | a number, or an expression in parentheses or by name; its unit |",
        "| `<n steps>` | a whole number |",
        "| `\"<file>\"` | a text in quotes |",
        "| `<node>`, `<beam3>` | the label of such a node or element |",
        "| `<offset>`, `<drive>` | what [notation](notation.md) says of that name |",
        "| `<node 1>`, `<node 2>` | two of a kind |",
        "| `[ … ]` | may be left out |",
        "| `{ a \\| b }` | one of them |",
        "| `( … ) * n points` | repeated, with commas, as often as the number of that name says |", "",
        "Units are those of SI; a deck in another consistent system has its own.", "",
        "| Page | Words | |", "|---|---|---|", *rows, ""])


def samples(group):
    return [f"`{word['word']}`" for word in group["words"][:4]] + ["…"] * (len(group["words"]) > 4)


def pages(groups):
    """Text by name of the file."""
    notation = next(group for group in groups if group["name"] == "notation")
    known = anchors_of(notation["words"])
    return {"README.md": index(groups), **{file_of(group): page(group, known) for group in groups}}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("executable")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    wanted = pages(vocabulary(options.executable))
    present = {file.name: file.read_text(encoding="utf-8") for file in options.folder.glob("*.md")}
    if options.write:
        for name in present.keys() - wanted.keys():
            (options.folder / name).unlink()
        for name, text in wanted.items():
            (options.folder / name).write_text(text, encoding="utf-8")
        return
    stale = sorted(name for name in wanted.keys() | present.keys() if wanted.get(name) != present.get(name))
    if stale:
        sys.exit(f"{', '.join(stale)}: not what the program says; tests/docs/deck_reference.py build/bin/mbcosim {options.folder} --write")
    print(f"{len(wanted)} pages, as the program says")


if __name__ == "__main__":
    main()
