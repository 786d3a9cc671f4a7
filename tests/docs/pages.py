#!/usr/bin/env python3
"""Holds the Markdown pages against the tree and the programs.

usage: pages.py links ROOT            every link, anchor and cited file of every page and source comment exists
       pages.py blocks ROOT BUILD     every code block of every page runs as it stands

A block of the language `console` is a session: lines that start with `$ ` are commands, the lines that follow are what they print.
Numbers may differ in the last digits, `...` stands for any lines. A command with a final `&` is a daemon: the next command comes when
it tells that it is ready, as in sd_notify(3). A comment line above a block says what else to do with it: `<!-- file: NAME -->` writes it
to a file for the commands of the page that follow, `<!-- not run: REASON -->` leaves it alone. Blocks of a page share a folder, in which
`build`, `client_examples`, `tests` and `docker` are those of the tree. Blocks of the language `mermaid` are sequence diagrams, whose form
is looked at. Blocks without a language are for reading only.
"""
import contextlib
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time

FENCE = re.compile(r"(?:<!-- (?P<what>file|not run): (?P<detail>.*?) -->\n)?^```(?P<language>\w*)\n(?P<text>.*?)^```$", re.M | re.S)
LINK = re.compile(r"\[[^\]\n]*\]\(([^)\s]+)\)")
CITED = re.compile(r"\b((?:src|server|proto|tests|client_examples|docker)/[\w./-]+\.(?:md|h|cpp|py|sh|proto|mbd|inc|yaml|txt|tsv|mjs|ts))\b")
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
LINKED = ("client_examples", "tests", "docker", "src", "server", "proto")
WAIT = 120 * float(os.environ.get("MBCOSIM_TIME_FACTOR", 1))


def tracked(root):
    """Paths below `root` that are part of the project."""
    listed = subprocess.run(["git", "-C", root, "ls-files", "--cached", "--others", "--exclude-standard"], capture_output=True, text=True)
    if listed.returncode == 0:
        names = [pathlib.Path(name) for name in listed.stdout.splitlines()]
    else:  # an unpacked archive
        names = [p.relative_to(root) for p in root.rglob("*") if not str(p.relative_to(root)).startswith("build")]
    return sorted(name for name in names if (root / name).is_file())


def pages(root):
    return [name for name in tracked(root) if name.suffix == ".md"]


def anchor(title):
    """As GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", title.replace("`", "").lower()).replace(" ", "-")


def anchors(text):
    return {anchor(title) for title in re.findall(r"^#+ (.*)$", text, re.M)}


def broken_links(root, name):
    text = (root / name).read_text(encoding="utf-8")
    for target in LINK.findall(re.sub(r"`[^`]*`", "", text)):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, place = target.partition("#")
        file = (root / name).parent / path if path else root / name
        if not file.exists():
            yield f"{name}: the link {target} leads nowhere"
        elif place and place not in anchors(file.read_text(encoding="utf-8")):
            yield f"{name}: {path or name} has no heading for #{place}"


def broken_citations(root, name):
    text = (root / name).read_text(encoding="utf-8", errors="replace")
    for cited in sorted(set(CITED.findall(text))):
        if not (root / cited).exists() and not (root / name).parent.joinpath(cited).exists():
            yield f"{name}: {cited} is cited and does not exist"


def links(root):
    sources = (".md", ".h", ".cpp", ".proto", ".sh", ".yaml", ".txt", ".cmake")
    found = [finding for name in pages(root) for finding in broken_links(root, name)]
    return found + [finding for name in tracked(root) if name.suffix in sources for finding in broken_citations(root, name)]


def wrong_in_diagram(text):
    """What GitHub could not draw of a sequence diagram, a sentence each."""
    known, open_blocks = set(), 0
    first, *lines = [line.strip() for line in text.strip().split("\n")]
    if first != "sequenceDiagram":
        yield f"`{first}` begins no sequence diagram"
    for line in lines:
        used = re.fullmatch(r"(\w+)-{1,2}>>(\w+): \S.*|Note over (\w+)(?:,(\w+))?: \S.*", line)
        if declared := re.fullmatch(r"participant (\w+) as \S.*", line):
            known.add(declared[1])
        elif used:
            yield from (f"`{line}` names {name}, which is no participant" for name in used.groups() if name and name not in known)
        elif line == "end":
            open_blocks -= 1
        elif re.match(r"(loop|alt|opt) \S", line):
            open_blocks += 1
        elif not re.match(r"else \S", line):
            yield f"`{line}` is no line of a sequence diagram"
        if ";" in line or open_blocks < 0:
            yield f"`{line}` ends what is not open"
    if open_blocks > 0:
        yield "a block of a diagram is not ended"


def same(expected, printed):
    """Do two lines agree but for the last digits of their numbers?"""
    if NUMBER.sub("#", expected).split() != NUMBER.sub("#", printed).split():
        return False
    pairs = zip(map(float, NUMBER.findall(expected)), map(float, NUMBER.findall(printed)))
    return all(abs(a - b) <= 2e-6 * max(abs(a), abs(b)) for a, b in pairs)


def agree(expected, printed):
    """The same for lists of lines, in which `...` stands for any number of lines."""
    if not expected:
        return not printed
    if expected[0].strip() == "...":
        return any(agree(expected[1:], printed[k:]) for k in range(len(printed) + 1))
    return bool(printed) and same(expected[0], printed[0]) and agree(expected[1:], printed[1:])


def commands(text):
    """(command, lines that it prints) of a session."""
    for part in re.split(r"^\$ ", text, flags=re.M)[1:]:
        command, *printed = part.rstrip("\n").split("\n")
        while command.endswith("\\"):
            command += "\n" + printed.pop(0)
        yield command, printed


class Page:
    """The blocks of a page, run in a folder of its own."""

    def __init__(self, root, build, name, folder):
        self.root, self.name, self.folder = root, name, folder
        for entry in LINKED:
            (folder / entry).symlink_to(root / entry)
        (folder / "build").symlink_to(build)
        runtime = folder / "runtime"
        runtime.mkdir(mode=0o700)
        inherited = {key: value for key, value in os.environ.items() if not key.startswith("MBCOSIM")}
        self.environment = {**inherited, "XDG_RUNTIME_DIR": str(runtime), "MPLBACKEND": "Agg"}
        self.background = []

    def run(self):
        try:
            for block in FENCE.finditer((self.root / self.name).read_text(encoding="utf-8")):
                yield from self.run_block(**block.groupdict())
        finally:
            for process in self.background:
                with contextlib.suppress(ProcessLookupError):  # it has ended, which was told
                    os.killpg(process.pid, signal.SIGTERM)
                process.wait(WAIT)

    def run_block(self, what, detail, language, text):
        if what == "file":
            (self.folder / detail).parent.mkdir(parents=True, exist_ok=True)
            (self.folder / detail).write_text(text, encoding="utf-8")
        elif what is None and language == "console":
            for command, expected in commands(text):
                yield from self.run_command(command, expected)
        elif what is None and language == "mermaid":
            yield from (f"{self.name}: {finding}" for finding in wrong_in_diagram(text))
        elif what is None and language:
            yield f"{self.name}: a block of `{language}` is neither written to a file nor marked as not run:\n{text}"

    def run_command(self, command, expected):
        start = {"cwd": self.folder, "env": self.environment, "executable": "/bin/bash", "shell": True, "text": True,
                 "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        if command.endswith("&"):
            yield from self.start_daemon(command, {**start, "stdout": subprocess.DEVNULL})
            return
        try:
            printed = subprocess.run(command, timeout=WAIT, **start).stdout
        except subprocess.TimeoutExpired:
            yield f"{self.name}: `{command}` did not end within {WAIT:g} s"
            return
        if not agree(expected, printed.rstrip("\n").split("\n") if printed else []):
            yield f"{self.name}: `{command}` prints\n{printed}instead of\n" + "\n".join(expected)

    def start_daemon(self, command, start):
        """Goes on when it is ready: a person would not type the next command before."""
        address = self.folder / f"ready{len(self.background)}"
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
            manager.bind(str(address))
            manager.settimeout(0.1)
            start["env"] = {**self.environment, "NOTIFY_SOCKET": str(address)}
            process = subprocess.Popen("exec " + command[:-1], start_new_session=True, **start)
            self.background.append(process)
            end, told = time.monotonic() + WAIT, b""
            while b"READY=1" not in told and process.poll() is None and time.monotonic() < end:
                with contextlib.suppress(TimeoutError):
                    told = manager.recv(4096)
        if b"READY=1" not in told:
            yield f"{self.name}: `{command}` did not get ready" + (f", it ended with {process.poll()}" if process.poll() is not None else "")


def blocks(root, build):
    for name in pages(root):
        with tempfile.TemporaryDirectory(prefix="page") as folder:
            yield from Page(root, build, name, pathlib.Path(folder)).run()


def main():
    what, *folders = sys.argv[1:]
    findings = list({"links": links, "blocks": blocks}[what](*(pathlib.Path(folder).resolve() for folder in folders)))
    print("\n".join(findings))
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
