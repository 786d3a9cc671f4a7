#!/usr/bin/env python3
"""What can be said about the container without a container engine. usage: docker.py ROOT MBCOSIMD

* The files that the Dockerfile copies, less what .dockerignore holds back, suffice to configure the build.
* Every library that the daemon needs is in a package of the list for the final stage, or one that such a package pulls in.
* Every daemon in a container has a limit of memory: it budgets a part of that, and of the whole host's where there is none.
* The daemon knows the options and variables that the Dockerfile, the compose files, the Kubernetes manifests and the systemd unit give it.
"""
import fnmatch
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

import yaml

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


def invocations(root):
    """(where, arguments, variables) of each start of the daemon in the files of docker/."""
    docker = root / "docker"
    image = (docker / "Dockerfile").read_text()
    defaults = dict(re.findall(r"\b(MBCOSIMD_\w+)=(\S+)", image))
    yield "Dockerfile", [], defaults
    yield "Dockerfile, HEALTHCHECK", re.findall(r'"([^"]*)"', re.search(r"^HEALTHCHECK .*CMD (\[.*\])$", image, re.MULTILINE).group(1))[1:], {}
    for file in sorted(docker.glob("compose*.yaml")):
        for name, service in yaml.safe_load(file.read_text())["services"].items():
            if service["image"] == "mbcosim":
                yield f"{file.name}, {name}", service.get("command", []), {**defaults, **service.get("environment", {})}
    for part in yaml.safe_load_all((docker / "kubernetes.yaml").read_text()):
        for container in part["spec"].get("template", {}).get("spec", {}).get("containers", []):
            yield "kubernetes.yaml", container["args"], defaults
            yield "kubernetes.yaml, command", ["--daemon-id=mbcosimd0"] * ("--daemon-id" in container["command"][-2]), {}
            for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
                yield f"kubernetes.yaml, {probe}", container[probe]["exec"]["command"][1:], {}
    unit = (docker / "mbcosimd.service").read_text()
    environment_of_unit = dict(re.findall(r"\b(MBCOSIMD_\w+)=(\S+)", " ".join(re.findall(r"^Environment=(.*)$", unit, re.MULTILINE))))
    for line in re.findall(r"^#? *ExecStart=(mbcosimd.*)$", unit, re.MULTILINE):
        yield "mbcosimd.service", shlex.split(line.replace("...", "/secrets/any"))[1:], environment_of_unit


def unlimited(root):
    """Names of the daemons in containers that have no limit of memory."""
    docker = root / "docker"
    for file in sorted(docker.glob("compose*.yaml")):
        for name, service in yaml.safe_load(file.read_text())["services"].items():
            limits = service.get("deploy", {}).get("resources", {}).get("limits", {})
            if service["image"] == "mbcosim" and "memory" not in limits and "MBCOSIMD_LIMIT_MEMORY" not in service.get("environment", {}):
                yield f"{file.name}, {name}"
    for part in yaml.safe_load_all((docker / "kubernetes.yaml").read_text()):
        for container in part["spec"].get("template", {}).get("spec", {}).get("containers", []):
            if "memory" not in container.get("resources", {}).get("limits", {}):
                yield f"kubernetes.yaml, {container['name']}"


def memory(root):
    if found := list(unlimited(root)):
        sys.exit(f"without a limit of memory: {'; '.join(found)}")


def there(value, folder):
    """A path of the container, as one that exists in `folder`; a name without an ending is a folder's."""
    if not value.startswith("/"):
        return value
    path = pathlib.Path(folder + value)
    if path.suffix or "secrets" in value:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    else:
        path.mkdir(parents=True, exist_ok=True)
    return str(path)


def options(root, daemon):
    known = set(re.findall(r"\(Env:(\w+)\)", output(daemon, "--help")))
    with tempfile.TemporaryDirectory() as folder:
        for where, arguments, variables in invocations(root):
            if strange := set(variables) - known:
                sys.exit(f"{where}: the daemon has no variable {', '.join(sorted(strange))}")
            arguments = ["=".join(there(part, folder) for part in argument.split("=", 1)) for argument in arguments]
            environment = {name: there(str(value), folder) for name, value in variables.items()}
            done = subprocess.run([daemon, "--print-config", *arguments], env={**os.environ, **environment}, capture_output=True, text=True)
            if done.returncode:
                sys.exit(f"{where}: mbcosimd {' '.join(arguments)} is refused: {done.stderr}")


if __name__ == "__main__":
    memory(pathlib.Path(sys.argv[1]))
    options(pathlib.Path(sys.argv[1]), sys.argv[2])
    libraries(pathlib.Path(sys.argv[1]), sys.argv[2])
    configure(pathlib.Path(sys.argv[1]))
