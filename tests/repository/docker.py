#!/usr/bin/env python3
"""What can be said about the container without a container engine. usage: docker.py ROOT MBCOSIMD

* The files that the Dockerfile copies, less what .dockerignore holds back, suffice to configure the build.
* Every library that the daemon needs is in a package of the list for the final stage, or one that such a package pulls in.
"""
import fnmatch
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

BASE = {"libc6", "libstdc++6", "libgcc-s1"}  # of debian:bookworm-slim or of everything written in C++


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def admitted(root):
    """Top-level entries that the build context has: .dockerignore shuts out all and lets some in again."""
    rules = (root / ".dockerignore").read_text().split()
    assert rules[0] == "*", "the first rule of .dockerignore shuts out everything"
    return [rule[1:] for rule in rules[1:] if rule.startswith("!")]


def copied(root):
    """(sources, target) of every COPY of the first stage from the context."""
    stage = (root / "docker" / "Dockerfile").read_text().split("\nFROM ")[1]
    for line in re.findall(r"^COPY (.*)$", stage, re.MULTILINE):
        *sources, target = line.split()
        yield sources, target


def configure(root):
    with tempfile.TemporaryDirectory() as folder:
        for sources, target in copied(root):
            for source in sources:
                top = source.split("/")[0]
                if not any(fnmatch.fnmatch(top, rule) for rule in admitted(root)):
                    sys.exit(f"COPY {source}: .dockerignore holds it back")
                place = pathlib.Path(folder + target)
                if (root / source).is_dir():
                    shutil.copytree(root / source, place)
                else:
                    place = place / os.path.basename(source) if target.endswith("/") else place
                    place.parent.mkdir(parents=True, exist_ok=True)
                    shutil.copy(root / source, place)
        arguments = re.search(r"RUN cmake (--preset.*?)\s*\\$", (root / "docker" / "Dockerfile").read_text(), re.MULTILINE)
        done = subprocess.run(["cmake", *arguments.group(1).split()], cwd=folder + "/source", capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"cmake {arguments.group(1)} fails with the files of the image:\n{done.stdout}{done.stderr}")


def package_names(depends):
    return {re.split(r"[ (:|]", part.strip())[0] for part in depends.split(",") if part.strip()}


def libraries(root, daemon):
    lines = re.sub(r"#.*", "", (root / "docker" / "dependencies.txt").read_text()).splitlines()
    present = BASE | {line.split()[0] for line in lines if line.split()[1:] == ["run"]}
    present |= package_names(",".join(output("dpkg-query", "-W", "-f", "${Depends},", *sorted(present)).splitlines()))
    found = dict(re.findall(r"^\s*(\S+) => (/\S+)", output("ldd", daemon), re.MULTILINE))
    for name in re.findall(r"NEEDED\s+(\S+)", output("objdump", "-p", daemon)):
        if name not in found or name.startswith(("ld-linux", "libasan", "libtsan", "libubsan")):
            continue
        owners = {line.split(":")[0] for line in output("dpkg", "-S", "*/" + os.path.basename(os.path.realpath(found[name]))).splitlines()}
        if not owners & present:
            sys.exit(f"{name} is in {', '.join(sorted(owners))}, which docker/dependencies.txt does not list for `run`")


if __name__ == "__main__":
    libraries(pathlib.Path(sys.argv[1]), sys.argv[2])
    configure(pathlib.Path(sys.argv[1]))
