#!/usr/bin/env python3
"""clang-tidy on the C++ sources that changed. usage: tidy.py ROOT BUILD [REVISION | --all]

Looks at the sources that differ from REVISION (default: the commit before the last), the working tree included; --all at
every source of the build. BUILD is a built folder: its compile commands and generated headers are used.
"""
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys


def changed(root, revision):
    names = subprocess.run(["git", "-C", root, "diff", "--name-only", "--diff-filter=d", revision],
                           check=True, capture_output=True, text=True).stdout.split()
    return {str(root / name) for name in names}


def tidy(build, path):
    done = subprocess.run(["clang-tidy", "--quiet", "-p", build, "--extra-arg=-Wno-unknown-warning-option", path],
                          capture_output=True, text=True)
    return done.returncode, done.stdout


def main():
    root, build = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    revision = sys.argv[3] if len(sys.argv) > 3 else "HEAD~1"
    compiled = {os.path.join(c["directory"], c["file"]) for c in json.loads((build / "compile_commands.json").read_text())}
    ours = {path for path in map(os.path.normpath, compiled) if not path.startswith(str(build))}
    paths = sorted(ours if revision == "--all" else ours & changed(root, revision))
    failed = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for path, (code, text) in zip(paths, pool.map(lambda p: tidy(build, p), paths)):
            if code:
                failed += 1
                print(text)
            print(f"{'FAIL' if code else 'ok':4} {os.path.relpath(path, root)}", flush=True)
    print(f"clang-tidy: {len(paths)} sources, {failed} with findings")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
