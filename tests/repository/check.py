#!/usr/bin/env python3
"""Rules about the sources that no compiler checks. usage: check.py ROOT {arrows|headers|layout|scripts|format} [arguments]

arrows   folders include only what stands below them; families of elements do not include each other
headers  every header compiles alone: the build shows it for those that their source includes first, the compiler for the
         others; arguments: compiler and its options
layout   the top level has the agreed entries and no others; the quick start does not switch off what tests/run.sh builds;
         no two sources of the engine have the same name but those that mean the same in every folder, and register.cpp only
         lists what its folder has; bounds on time in tests follow MBCOSIM_TIME_FACTOR;
         tests/REFERENCES.md names every test with reference numbers
scripts  those of the shell work from any folder and through links, and fail where they cannot do what they are for
format   clang-format would change nothing
"""
import concurrent.futures
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

# What the sources of a folder may include besides their own folder.
ARROWS = {
    "src/math": set(),
    "src/model": {"math"},
    "src/elements": {"math", "model"},
    "src/solver": {"math", "model", "elements"},
    "src/input": {"math", "model"},
    "src/output": {"math", "model"},
    "src/reduction": {"math", "model", "input", "elements", "solver"},  # elements: the FEM data file
    "src/simulation": {"math", "model", "elements", "solver", "input", "output", "reduction"},
    "server/fmi": {"options", "math", "model", "solver", "input", "simulation"},
    "server/mbdyn": {"host", "math", "model", "elements", "simulation"},
    "server/peer": {"options", "reach", "math", "model", "solver", "simulation", "client", "mbdyn", "fmi", "files", "threads"},
    "server/cli": {"options", "threads", "host", "mbdyn", "math", "model", "elements", "solver", "input", "output", "reduction", "simulation"},
    "server/wire": {"math", "model", "solver", "simulation", "mbcosim", "host"},
    "server/host": set(),
    "server/threads": {"solver", "host"},
    "server/rpc": {"files", "solver", "wire", "threads", "mbcosim", "grpc", "host"},
    "server/coupling": {"math", "model", "simulation", "threads", "wire", "mbcosim", "host"},
    "server/files": set(),
    "server/options": set(),
    "server/durable": {"files", "threads", "mbcosim"},
    "server/results": {"files", "output", "threads", "wire", "mbcosim"},
    "server/service": {"host", "math", "model", "simulation", "input", "reduction", "coupling", "durable", "results", "rpc", "threads", "wire", "mbcosim",
                       "shared_memory", "mbdyn"},
    "server/client": {"mbcosim", "shared_memory", "threads", "wire", "host"},
    "server/shared_memory": {"threads", "host"},
    "server/http": {"host", "service", "rpc", "threads", "wire", "mbcosim"},
    "server/view": {"client", "options"},
    "server/reach": {"options", "client", "files"},
    "server/sessions": {"reach", "client", "durable"},
    "server/daemon": {"options", "files", "input", "host", "service", "rpc", "http", "shared_memory", "threads", "wire", "mbcosim", "grpc"},
}
TOP_LEVEL = {"CMakeLists.txt", "CMakePresets.json", "LICENSE", "README.md", "client_examples", "docker", "proto", "server", "src",
             "tests"}
FORMATTED = ["src", "server", "client_examples", "tests"]
# Families of elements know what all elements share and themselves, and of each other no more than this.
FAMILY_ARROWS = {"ports": {"modal"}, "user": {"joints"}}
# The names of files that every folder may have: they mean the same everywhere.
COMMON_NAMES = {"register.cpp", "readers.h"}
INCLUDE = re.compile(r'^\s*#\s*include\s+"([a-z_0-9]+)/', re.MULTILINE)


def sources(folder, *endings):
    return sorted(p for p in folder.rglob("*") if p.suffix in endings)


def arrows(root):
    for folder, allowed in ARROWS.items():
        for path in sources(root / folder, ".h", ".cpp"):
            for included in INCLUDE.findall(path.read_text(encoding="utf-8")):
                if included not in allowed | {os.path.basename(folder)}:
                    yield f"{path.relative_to(root)} includes \"{included}/…\"; {folder} may include: {', '.join(sorted(allowed))}"
    for path in sources(root / "src" / "elements", ".h", ".cpp"):
        family = path.parent.name
        for other in re.findall(r'^#include "elements/([a-z_]+)/', path.read_text(encoding="utf-8"), re.MULTILINE):
            if family != "elements" and other not in FAMILY_ARROWS.get(family, set()) | {family}:
                yield f"{path.relative_to(root)} includes \"elements/{other}/…\": a family of elements knows no other"


def locks(root):
    """Of locks below server/ that clang's analysis (repository.thread_safety) does not see."""
    plain = re.compile(r"std::(\w*mutex|condition_variable\w*|unique_lock|lock_guard|scoped_lock)\b")
    for path in sources(root / "server", ".h", ".cpp"):
        found = plain.search(path.read_text(encoding="utf-8"))
        if found and path != root / "server" / "threads" / "mutex.h":
            yield f"{path.relative_to(root)} uses {found.group()}: take the annotated locks of threads/mutex.h"


def leads_its_source(header):
    source = header.with_suffix(".cpp")
    if not source.exists():
        return False
    first = re.search(r'^\s*#\s*include\s+(\S+)', source.read_text(encoding="utf-8"), re.MULTILINE)
    return first and first.group(1).endswith(f"/{header.name}\"")


def headers(root, *compiler):
    def compile_alone(path):
        command = [*compiler, "-fsyntax-only", "-include", str(path), "-x", "c++", os.devnull]
        done = subprocess.run(command, capture_output=True, text=True)
        return f"{path.relative_to(root)} does not compile alone:\n{done.stderr}" if done.returncode else None

    paths = [p for p in sources(root / "src", ".h") + sources(root / "server", ".h") if not leads_its_source(p)]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        yield from filter(None, pool.map(compile_alone, paths))


def names(root):
    """Of what is found by its name: files with one name in two folders, and readers in register.cpp."""
    folders = {}
    for path in sources(root / "src", ".h", ".cpp"):
        folders.setdefault(path.name, []).append(str(path.parent.relative_to(root)))
        if path.name == "register.cpp" and "Card& card" in path.read_text(encoding="utf-8"):
            yield f"{path.relative_to(root)} reads cards: readers stand in read_….cpp or beside their element"
    for name, places in folders.items():
        if len(places) > 1 and name not in COMMON_NAMES:
            yield f"{name} stands in {' and '.join(places)}: a name means one thing"


def types(root):
    """Of classes of one name in one namespace, which no linker tells apart."""
    opened = re.compile(r"(?:inline )?namespace ([\w:]*) ?\{")
    defined = re.compile(r"(?:template <[^;]*> ?)?(?:class|struct|union|enum class|enum) (?:[A-Z_]+(?:\(.*?\))? )?(\w+)(?: final)?(?: ?:(?!:)[^;{]*)? ?\{")
    places = {}
    for path in sources(root / "src", ".h", ".cpp") + sources(root / "server", ".h", ".cpp"):
        around = []
        for line in path.read_text(encoding="utf-8").splitlines():
            if match := opened.match(line):
                around.append(match[1] or str(path))  # without a name: its own in each file
            elif line.startswith("}  // namespace"):
                around.pop()
            elif match := defined.match(line):
                places.setdefault("::".join([*around, match[1]]), set()).add(str(path.relative_to(root)))
    for name, files in places.items():
        if len(files) > 1:
            yield f"{name} is defined in {' and '.join(sorted(files))}: a name means one thing"


def bounds_on_time(root):
    """Of tests that compare what they took with a bound that a loaded machine would exceed."""
    elapsed = re.compile(r"monotonic\(\) - \w+ <|monotonic\(\) \+|steady_clock::now\(\) - \w+")
    for path in sources(root / "tests", ".py", ".cpp"):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if elapsed.search(line) and not re.search("TIME_FACTOR|WAIT|timeout|stretched|benchmark", line + path.parent.name):
                yield f"{path.relative_to(root)}:{number}: a bound on time without MBCOSIM_TIME_FACTOR"


def references(root):
    """Of tests with reference constants that tests/REFERENCES.md does not name."""
    page = (root / "tests" / "REFERENCES.md").read_text(encoding="utf-8")
    for path in sources(root / "tests" / "unit", ".h", ".cpp"):
        name = str(path.relative_to(root / "tests"))
        if len(re.findall(r"\d*\.\d{7,}", path.read_text(encoding="utf-8"))) > 1 and f"`{name}`" not in page:
            yield f"tests/{name} has reference numbers: tests/REFERENCES.md must say where they come from"


def layout(root):
    yield from names(root)
    yield from types(root)
    yield from references(root)
    yield from bounds_on_time(root)
    yield from locks(root)
    if "-DMBCOSIM_" in (root / "client_examples" / "quickstart.sh").read_text():
        yield "quickstart.sh sets options of the build folder that tests/run.sh uses, too"
    if not shutil.which("git"):
        return
    listed = subprocess.run(["git", "-C", str(root), "ls-files"], capture_output=True, text=True)
    if listed.returncode:  # not a clone: an unpacked archive, say
        return
    found = {name.split("/")[0] for name in listed.stdout.splitlines()}
    for name in sorted(found - TOP_LEVEL):
        if not name.startswith("."):
            yield f"{name} does not belong to the top level"
    for name in sorted(TOP_LEVEL - found):
        yield f"{name} is missing at the top level"


def ran(folder, *command, **variables):
    """A script of the shell, as it ended in `folder`, with programs of `folder`/bin in the place of the machine's."""
    environment = {**os.environ, "PATH": f"{folder}/bin:{os.environ['PATH']}", **variables}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=60)


def program(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)


def scripts(root):
    with tempfile.TemporaryDirectory(dir="/tmp") as name:
        folder = pathlib.Path(name)
        yield from helps(root, folder)
        yield from installs(root, folder)
        yield from starts(root, folder)


def helps(root, folder):
    """Of tests/run.sh that does not say how it is used, from another folder or through a link."""
    (folder / "link").symlink_to(root / "tests" / "run.sh")
    for script in (os.path.relpath(root / "tests" / "run.sh", folder), "./link"):
        done = ran(folder, "bash", script, "--help")
        if done.returncode or "usage: tests/run.sh" not in done.stdout:
            yield f"{script} --help: {done.stderr or done.stdout}"


def installs(root, folder):
    """Of docker/install-dependencies.sh without its list, and through a link, where every package is said to be there."""
    program(folder / "bin" / "dpkg-query", f"#!/bin/sh\necho asked >> {folder}/asked\necho installed\n")
    script = root / "docker" / "install-dependencies.sh"
    shutil.copy(script, folder / "copy.sh")
    for content in (None, "# no package\n"):
        if content is not None:
            (folder / "dependencies.txt").write_text(content)
        if not ran(folder, "bash", "./copy.sh", "start").returncode:
            yield f"install-dependencies.sh is content with {'no list' if content is None else 'an empty list'}"
    (folder / "install").symlink_to(script)
    if ran(folder, "bash", "./install", "start").returncode or not (folder / "asked").exists():
        yield "install-dependencies.sh does not find its list through a link"


def starts(root, folder):
    """Of client_examples/quickstart.sh whose socket has a path that is too long."""
    for path, text in (("docker/install-dependencies.sh", ""), ("bin/cmake", ""), ("build/bin/mbcosimd", f'echo "$2" > {folder}/address\nexec sleep 60')):
        program(folder / path, f"#!/bin/sh\n{text}\n")
    wait = f"import os, time\nwhile not os.path.exists('{folder}/address'): time.sleep(0.01)\n"
    program(folder / "client_examples" / "python" / "tumbling_body.py", wait)
    shutil.copy(root / "client_examples" / "quickstart.sh", folder / "client_examples")
    deep = folder / ("d" * 60) / ("e" * 60)
    deep.mkdir(parents=True)
    done = ran(folder, "bash", "client_examples/quickstart.sh", TMPDIR=str(deep))
    if done.returncode or len((folder / "address").read_text().strip()) > len("unix:") + 107:
        yield f"quickstart.sh with a long TMPDIR: {done.stderr}"
    if os.listdir(deep):
        yield "quickstart.sh leaves folders behind"


def format(root, tool="clang-format"):
    paths = [str(p) for folder in FORMATTED for p in sources(root / folder, ".h", ".cpp")]
    done = subprocess.run([tool, "--dry-run", "--Werror", *paths], capture_output=True, text=True)
    if done.returncode:
        yield done.stderr


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    checks = {"arrows": arrows, "headers": headers, "layout": layout, "scripts": scripts, "format": format}
    findings = list(checks[sys.argv[2]](root, *sys.argv[3:]))
    print("\n".join(findings))
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
