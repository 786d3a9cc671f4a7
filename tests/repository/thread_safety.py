#!/usr/bin/env python3
"""clang's thread-safety analysis of the server. usage: thread_safety.py ROOT BUILD CLANG

Looks at the sources that reach the annotated locks (threads/mutex.h), with the compile commands of BUILD.
"""
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys

GROUP = re.compile(r'^#include "(/[^"]+)"', re.MULTILINE)  # of a file of CMake's that includes several sources
INCLUDE = re.compile(r'^\s*#\s*include\s+"([a-z_0-9]+/[a-z_0-9./]+)"', re.MULTILINE)
LOCKS = "threads/mutex.h"


def reaches_locks(server, name, known):
    """Does the file of that name below server/ include the locks, directly or not?"""
    if name not in known:
        path = server / name
        known[name] = False  # breaks cycles
        if path.exists():
            includes = INCLUDE.findall(path.read_text(encoding="utf-8"))
            known[name] = LOCKS in includes or any(reaches_locks(server, i, known) for i in includes)
    return known[name]


def sources_of(path):
    """The file itself, or those that it groups."""
    return GROUP.findall(path.read_text(encoding="utf-8")) if path.name.startswith("unity_") else [str(path)]


def analyse(clang, command):
    words = shlex.split(command["command"])
    options = []
    for word, following in zip(words, words[1:] + [""]):
        if word in ("-I", "-isystem"):
            options += [word, following]
        elif word.startswith(("-I", "-isystem", "-D", "-std=")):
            options.append(word)
    done = subprocess.run([clang, *options, "-fsyntax-only", "-Wthread-safety", "-Werror=thread-safety", command["file"]],
                          capture_output=True, text=True, cwd=command["directory"])
    return done.returncode, done.stderr


def main():
    root, build, clang = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(), sys.argv[3]
    server = root / "server"
    known = {}
    commands = {}
    for command in json.loads((build / "compile_commands.json").read_text()):
        sources = sources_of(pathlib.Path(os.path.normpath(os.path.join(command["directory"], command["file"]))))
        ours = [os.path.relpath(source, server) for source in sources if source.startswith(f"{server}{os.sep}")]
        reaching = [source for source in ours if reaches_locks(server, source, known)]
        if reaching:
            commands[", ".join(reaching)] = command
    if not commands:
        sys.exit("no source reaches the locks: is the server part of the build?")
    failed = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for names, (code, text) in zip(commands, pool.map(lambda c: analyse(clang, c), commands.values())):
            if code:
                failed += 1
                print(text)
            print(f"{'FAIL' if code else 'ok':4} {names}", flush=True)
    print(f"thread safety: {len(commands)} sources or groups, {failed} with findings")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
