#!/usr/bin/env python3
"""What mbcosim costs, beside another solver where one is given, in one table.

usage: run.sh [--build FOLDER] [--peer "REF -s -f {deck} -o {prefix}"] [--decks DECK...] [--small] [--json FILE] [--compare OLD.json]

  tutorials   whole processes on MBDyn's tutorials with their text files, and without output (`none`); those of this project use `for:`,
              which other solvers do not read: --decks names others
  process     start and read of a process
  parts       of the tutorials' runs, by the engine alone: reading, initial phases, residuals, matrices, factorizations, solutions, the rest
              of the steps, text of the results [ms], allocations, memory [MB]
  beams       cantilevers of three-node beams and grids of two-node beams: one Newton iteration of a process, and its memory;
              of the cantilevers also the parts of an iteration, by the engine alone; of the grids the process without its iterations,
              where the order of elimination and pivots are chosen
  cores       wall time of a Newton iteration of a process on all cores of the machine, beside that on one
  remote      a step over a stream beside an empty echo, Unix socket and TCP, and 1000 simulations in turn (remote_step, when it is
              built)
  reduce      `mbcosim reduce` on a cube of bricks

Programs run from a copy and write new files, as after an installation. Times are those of the processor (user and system), the median
of the repeated runs, in which both solvers alternate; ratios are peer / ours: above 1, ours is faster. An iteration's time is the
difference between the least of runs with few steps and with many, over the difference in iterations. --compare prints old / new for each
row of an earlier --json. Fails when a run fails; times have no bounds.
"""
import argparse
import json
import math
import os
import pathlib
import re
import shlex
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import beam_models

HERE = pathlib.Path(__file__).resolve().parent
MODELS = HERE.parent.parent / "client_examples" / "models"
TUTORIALS = ["rigid_body", "pendulum", "three_pendulums", "cantilever_varying_load", "cantilever_piezo_shunt", "cantilever_five", "modal_body", "chain",
             "actuated_beam"]


class Table:
    """Rows of figures, printed as they come."""

    def __init__(self, old):
        self.rows, self.old = {}, old

    def add(self, name, unit, ours, peer=None, **more):
        row = {"unit": unit, "ours": ours, **({"peer": peer, "ratio": peer / ours} if peer else {}), **more}
        self.rows[name] = row
        text = f"{name:38} {ours:12.4g} {unit:8}"
        text += f" {peer:12.4g} {peer / ours:7.2f}" if peer else 21 * " "
        for key, value in more.items():
            text += f"  {key} {value:.4g}"
        if name in self.old:
            text += f"  old/new {self.old[name]['ours'] / ours:.2f}"
        print(text, flush=True)


def measured(command, folder):
    """Processor seconds, wall seconds and the largest resident memory [MB] of a process."""
    with tempfile.TemporaryFile() as errors:
        begin = time.perf_counter()
        process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=errors)
        _, status, used = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begin
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            errors.seek(0)
            sys.exit(f"{shlex.join(command)}: exit {process.returncode}\n{errors.read().decode(errors='replace')[-800:]}")
    return used.ru_utime + used.ru_stime, wall, used.ru_maxrss / 1024


class Solvers:
    """Ours on one thread, and the peer where there is one: each a command for a deck and a prefix."""

    def __init__(self, binary, peer=None, more=()):
        self.commands = [[str(binary), "run", "{deck}", "-o", "{prefix}", "-q", "--threads", str(threads)] for threads in (1, *more)]
        if peer:
            words = shlex.split(peer)
            self.commands.append(words if any("{deck}" in word for word in words) else sys.exit("--peer: a command with {deck} and {prefix}"))

    def run(self, deck, folder, repeat, of=statistics.median):
        """For each solver the medians over the runs, or what `of` says: processor, wall, memory; and the iterations of all steps."""
        found = [[] for _ in self.commands]
        iterations = []
        for attempt in range(repeat):
            for k, command in enumerate(self.commands):
                results = tempfile.mkdtemp(dir=folder)  # as in a first run: no file is there to be overwritten
                prefix = os.path.join(results, "result")
                words = [word.replace("{deck}", str(deck)).replace("{prefix}", prefix) for word in command]
                found[k].append(measured(words, os.path.dirname(deck)))
                if attempt == 0:
                    iterations.append(iterations_in(prefix + ".out"))
                shutil.rmtree(results)
        return [tuple(of(values) for values in zip(*runs)) for runs in found], iterations


def iterations_in(path):
    """Of all steps, by the lines `Step N TIME LENGTH ITERATIONS ...` of both solvers."""
    try:
        with open(path) as file:
            return sum(int(line.split()[4]) for line in file if line.startswith("Step "))
    except OSError:
        return 0


def geometric_mean(values):
    return math.exp(statistics.fmean(math.log(value) for value in values))


def tutorials(table, solvers, decks, folder, repeat):
    silent = pathlib.Path(folder) / "silent"
    for output in ("text", "none"):
        cpu, wall = [], []
        for deck in decks:
            name = deck.stem
            times, _ = solvers.run(deck if output == "text" else without_output(deck, silent / name), folder, repeat)
            peer = times[1][0] * 1e3 if len(times) > 1 else None
            table.add(f"{name}, {output}", "ms", times[0][0] * 1e3, peer, wall=times[0][1] * 1e3)
            if peer:
                cpu.append(times[1][0] / times[0][0])
                wall.append(times[1][1] / times[0][1])
        if cpu:
            print(f"{f'geometric mean, {output}':38} processor {geometric_mean(cpu):.2f}, wall {geometric_mean(wall):.2f}, lowest {min(cpu):.2f}")


def without_output(deck, folder):
    """A copy of the deck with `default output: none`, beside all that lies beside it."""
    shutil.copytree(deck.parent, folder)
    for file in folder.iterdir():
        if file.name == deck.name or file.suffix in (".mbd", ".inc"):
            file.write_text(re.sub(r"(begin *: *control data *;)", r"\1 default output: none;", file.read_text()))
    return folder / deck.name


def parts_of_a_process(table, binary, folder, repeat):
    deck = str(MODELS / "rigid_body.mbd")
    for name, words in (("start of a process", ["--version"]), ("start and read of rigid_body", ["validate", deck])):
        table.add(name, "ms", 1e3 * statistics.median(measured([str(binary), *words], folder)[0] for _ in range(4 * repeat)))


def parts_of_runs(table, build, decks):
    program = build / "bin" / "run_parts"
    if not program.exists():
        return
    for deck in decks:
        parts = json.loads(subprocess.run([program, deck], capture_output=True, text=True, check=True).stdout)
        whole = sum(parts[name] for name in ("read", "initial", "residual", "matrix", "factor", "solve", "rest", "output"))
        table.add(f"{deck.stem}, engine", "ms", whole, **parts)


def iteration_costs(solvers, model, folder, repeat, clock=0, more=20):
    """Of each solver a Newton iteration [ms] by `clock` (0: processor, 1: wall), from runs of 5 steps and of so many `more`; the rest of
    a process [ms], the longer runs, and the iterations between both. Of the repeated runs the least: what disturbs a run only adds to it,
    and may be as long as the difference that is looked for."""
    runs = []
    for steps in (5, 5 + more):
        deck = pathlib.Path(folder) / "beams.mbd"
        deck.write_text(model(steps))
        runs.append(solvers.run(deck, folder, repeat, of=min))
    (first, few), (second, many) = runs
    costs = [(b[clock] - a[clock]) / max(1, m - f) * 1e3 for a, b, f, m in zip(first, second, few, many)]
    return costs, [a[clock] * 1e3 - f * cost for a, f, cost in zip(first, few, costs)], second, many[0] - few[0]


def cantilever(n):
    return f"cantilever of {n}", lambda steps: beam_models.cantilever(n, steps)


def steps_of_a_second(n):
    """At least as many as a cantilever of n beams takes a second for on one thread."""
    return max(50, 300_000 // n)


def all_cores(table, binary, folder, repeat, small):
    cores = os.cpu_count() or 1
    for n in [10] if small else [250, 1000, 10000]:
        name, model = cantilever(n)
        more = 20 if small else steps_of_a_second(n)
        (one, all_of_them), *_ = iteration_costs(Solvers(binary, more=[cores]), model, folder, repeat, clock=1, more=more)
        table.add(f"{name}, on {cores} threads", "ms", all_of_them, on_one=one, speedup=one / all_of_them)


def beams(table, solvers, folder, repeat, small):
    models = [cantilever(n) for n in ([10, 100] if small else [100, 1000, 10000])]
    for shape in ([(5, 5)] if small else [(100, 100), (20, 20, 20)]):
        models.append((f"grid of {' x '.join(map(str, shape))}", lambda steps, shape=shape: beam_models.grid(shape, steps)))
    for name, model in models:
        costs, rest, runs, iterations = iteration_costs(solvers, model, folder, repeat)
        memory = {f"{who}_MB": run[2] for who, run in zip(("ours", "peer"), runs)}
        table.add(f"{name}, an iteration", "ms", costs[0], *costs[1:], iterations=iterations, **memory)
        if name.startswith("grid"):
            table.add(f"{name}, rest of a process", "ms", *rest)


def engine_parts(table, build, small):
    program = build / "bin" / "newton_cost"
    if not program.exists():
        return
    text = subprocess.run([program, *(["10", "100"] if small else ["100", "1000", "10000"])], capture_output=True, text=True, check=True).stdout
    for line in text.splitlines()[1:]:
        words = line.replace(" us", "").split()
        if words[0] == "exponent":
            table.add("exponent of an iteration", "", float(words[-1]))
            continue
        residual, matrix, factor, solve, whole = (float(word) / 1e3 for word in words[2:7])
        table.add(f"cantilever of {words[0]}, engine", "ms", whole, residual=residual, matrix=matrix, factor=factor, solve=solve)


def remote(table, build, folder, small):
    benchmark = build / "bin" / "remote_step"  # starts the daemon beside it
    if not benchmark.exists() or not (build / "bin" / "mbcosimd").exists():
        return
    figures = pathlib.Path(folder, "remote_step.json")
    options = ["--turns", "2", "--exchanges", "50", "--many", "10"] if small else []
    subprocess.run([benchmark, "--json", figures, *options], stdout=subprocess.DEVNULL, check=True)
    for name, row in json.loads(figures.read_text()).items():
        more = {"over_base": row["ratio"]} if "ratio" in row else {}
        table.add(f"remote: {name}", "us", row["median"], p99=row["p99"], **more)


def reduction(table, binary, small):
    shape = "6x6x6" if small else "40x40x40"
    text = subprocess.run([sys.executable, HERE / "reduce_scaling.py", binary, shape, "--json"], capture_output=True, text=True, check=True).stdout
    row = json.loads(text)
    table.add(f"reduce {shape}", "s", row["processor_s"], wall=row["wall_s"], MB=row["memory_mb"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=HERE.parent.parent / "build")
    parser.add_argument("--peer", default="")
    parser.add_argument("--decks", type=pathlib.Path, nargs="+", default=[MODELS / f"{name}.mbd" for name in TUTORIALS])
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--repeat", type=int, default=0)
    parser.add_argument("--only", default="", help="some of tutorials,process,parts,beams,cores,engine,remote,reduce")
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--compare", type=pathlib.Path)
    options = parser.parse_args()
    repeat = options.repeat or (1 if options.small else 5)
    build = options.build.resolve()
    table = Table(json.loads(options.compare.read_text()) if options.compare else {})
    with tempfile.TemporaryDirectory() as folder:
        # A copy, as an installation makes one: what a linker has written lies in small pieces in the page cache.
        binary = pathlib.Path(shutil.copy(build / "bin" / "mbcosim", folder))
        solvers = Solvers(binary, options.peer)
        sections = {"tutorials": lambda: tutorials(table, solvers, [deck.resolve() for deck in options.decks], folder, repeat),
                    "process": lambda: parts_of_a_process(table, binary, folder, repeat),
                    "parts": lambda: parts_of_runs(table, build, [deck.resolve() for deck in options.decks]),
                    "beams": lambda: beams(table, solvers, folder, options.repeat or (1 if options.small else 3), options.small),
                    "cores": lambda: all_cores(table, binary, folder, repeat, options.small),
                    "engine": lambda: engine_parts(table, build, options.small),
                    "remote": lambda: remote(table, build, folder, options.small),
                    "reduce": lambda: reduction(table, binary, options.small)}
        wanted = options.only.split(",") if options.only else list(sections)
        print(f"{'':38} {'ours':>12} {'':8} {'peer':>12} {'ratio':>7}")
        for name in wanted:
            sections[name]() if name in sections else parser.error(f"--only: {name} is none of {', '.join(sections)}")
    if options.json:
        options.json.write_text(json.dumps(table.rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
