#!/usr/bin/env python3
"""What many simulations cost one daemon. usage: many_simulations.py BIN KIND [--rounds R] [--seconds S] [--steps A,B,...] [--side N] [--folder DIR]

    crowd    1000 pendulums stepped by 16 clients beside one pendulum and one client: steps per second in all, memory of each
    journal  64 pendulums with durability NONE, CHECKPOINT (every 10 s and every 0.1 s) and JOURNAL, by 64 clients: steps per second;
             a checkpoint every 10 s comes once in each turn of up to 10 s
    sizes    memory and steps per second of a pendulum and of solids of 27 to 1000 masses, and bytes of a checkpoint
    beside   time of a small simulation's call: alone, while four solids of N x N x N masses of another caller are stepped, and while
             those are of the same caller

Clients are threads of four processes. What is compared is measured by turns, R times for S seconds each, so that what else
the machine does counts on all sides; medians are printed. --steps: of a call. --folder: where `journal` stores; the disk matters.
"""
import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time

import grpc

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "service"))
import decks  # noqa: E402
from mbcosim.v1 import simulations_pb2 as pb, simulations_pb2_grpc  # noqa: E402

PENDULUM = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "client_examples", "models", "pendulum.mbd")
PROCESSES = 4


def metadata(token):
    return [("authorization", f"Bearer {token}")]


class Daemon:
    def __init__(self, program, folder, *options):
        self.address = f"unix:{folder}/s"
        tokens = os.path.join(folder, "tokens")
        with open(tokens, "w") as file:
            file.write("ann admin ann\nbob admin bob\n")
        os.chmod(tokens, 0o600)
        self.process = subprocess.Popen([os.path.join(program, "mbcosimd"), "--listen", self.address, "--tokens", tokens, "--limit-sessions", "2000",
                                         "--limit-identity-sessions", "2000", *options], stderr=subprocess.DEVNULL)
        self.channel = grpc.insecure_channel(self.address)
        self.stub = simulations_pb2_grpc.SimulationsStub(self.channel)
        self.stub.GetServerInfo(pb.GetServerInfoRequest(), metadata=metadata("ann"), wait_for_ready=True, timeout=120)

    def create(self, text, token="ann", **options):
        header = pb.UploadHeader(bundle_main_file="deck", options=pb.CreateOptions(**options))
        return self.stub.CreateSimulation(iter([pb.UploadRequest(header=header), pb.UploadRequest(chunk={"path": "deck", "data": text.encode()})]),
                                          metadata=metadata(token)).simulation.name

    def memory(self):
        with open(f"/proc/{self.process.pid}/status") as file:
            return int(next(line for line in file if line.startswith("RssAnon")).split()[1]) << 10

    def end(self):
        self.process.terminate()
        self.process.wait(120)


class Clients:
    """Callers that step the simulations among themselves, `steps` a call, whenever they are told to."""

    def __init__(self, address, names, count, steps, token="ann"):
        share = [names[i::count] for i in range(count)]
        self.processes = []
        for i in range(min(PROCESSES, count)):
            command = [sys.executable, os.path.abspath(__file__), "--serve", address, token, str(steps)]
            process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
            process.stdin.write(repr(share[i::PROCESSES]) + "\n")
            self.processes.append(process)

    def start(self, seconds):
        for process in self.processes:
            process.stdin.write(f"{seconds}\n")
            process.stdin.flush()

    def wait(self):
        """Steps per second in all, and how long the calls took [s]."""
        rate, times = 0.0, []
        for process in self.processes:
            steps, seconds, some = eval(process.stdout.readline())
            rate += steps / seconds
            times += some
        return rate, sorted(times)

    def run(self, seconds):
        self.start(seconds)
        return self.wait()

    def end(self):
        for process in self.processes:
            process.stdin.close()
            process.wait(60)


def serve(address, token, steps):
    """In a process of its own: one thread and connection for each list of names."""
    shares, steps = eval(sys.stdin.readline()), int(steps)
    stubs = [simulations_pb2_grpc.SimulationsStub(grpc.insecure_channel(address, options=[("grpc.use_local_subchannel_pool", 1)])) for _ in shares]
    places = [0] * len(shares)

    def work(i, end, done, times):
        while time.monotonic() < end:
            name = shares[i][places[i] % len(shares[i])]
            places[i] += 1
            start = time.monotonic()
            done[i] += stubs[i].Step(pb.StepRequest(simulation=name, steps=steps), metadata=metadata(token)).steps_done
            times.append(time.monotonic() - start)

    for line in sys.stdin:
        start, done, times = time.monotonic(), [0] * len(shares), []
        threads = [threading.Thread(target=work, args=(i, start + float(line), done, times)) for i in range(len(shares))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        print(repr((sum(done), time.monotonic() - start, times)), flush=True)


def pendulum():
    with open(PENDULUM) as file:
        return file.read().replace("final time: 5.;", "final time: 1.e9;")


def by_turns(options, turns):
    """{name: median} of functions that return a number, called one after the other in each round."""
    found = {name: [] for name in turns}
    for _ in range(options.rounds):
        for name, turn in turns.items():
            found[name].append(turn())
    return {name: statistics.median(values) for name, values in found.items()}


def tell_rates(title, rates):
    first = next(iter(rates.values()))
    print(title + ": " + ", ".join(f"{name} {rate:.0f} steps/s ({rate / first:.2f})" for name, rate in rates.items()), flush=True)


def crowd(options, folder):
    daemon = Daemon(options.bin, folder)
    try:
        before = daemon.memory()
        names = [daemon.create(pendulum()) for _ in range(1000)]
        created = daemon.memory()
        for steps in options.steps:
            alone, all_of_them = Clients(daemon.address, names[:1], 1, steps), Clients(daemon.address, names, 16, steps)
            tell_rates(f"{steps} steps a call", by_turns(options, {
                "one": lambda: alone.run(options.seconds)[0], "1000": lambda: all_of_them.run(options.seconds)[0]}))
            alone.end()
            all_of_them.end()
        print(f"memory of each: {(created - before) / 1000 / 1024:.1f} kB created, {(daemon.memory() - before) / 1000 / 1024:.1f} kB stepped")
    finally:
        daemon.end()


def journal(options, folder):
    daemon = Daemon(options.bin, folder, "--state-dir", folder)
    kinds = {"NONE": {"durability": pb.DURABILITY_NONE}, "CHECKPOINT": {"durability": pb.DURABILITY_CHECKPOINT},
             "CHECKPOINT every 0.1 s": {"durability": pb.DURABILITY_CHECKPOINT, "checkpoint_interval": {"nanos": 100_000_000}},
             "JOURNAL": {"durability": pb.DURABILITY_JOURNAL}}
    try:
        names = {kind: [daemon.create(pendulum(), **how) for _ in range(64)] for kind, how in kinds.items()}
        for steps in options.steps:
            clients = {kind: Clients(daemon.address, names[kind], 64, steps) for kind in kinds}
            tell_rates(f"64 simulations, {steps} steps a call",
                       by_turns(options, {kind: lambda c=c: c.run(options.seconds)[0] for kind, c in clients.items()}))
            for client in clients.values():
                client.end()
    finally:
        daemon.end()


def stored_bytes(folder, name):
    return os.path.getsize(os.path.join(folder, name, "point"))


def sizes(options, folder):
    daemon, count = Daemon(options.bin, folder, "--state-dir", folder), 8
    models = {"pendulum": pendulum(), **{f"{side ** 3} masses": decks.cube(side).replace("final time: 10.", "final time: 1e9") for side in (3, 6, 10)}}
    try:
        for title, text in models.items():
            before = daemon.memory()
            names = [daemon.create(text) for _ in range(count)]
            clients = Clients(daemon.address, names, count, 10)
            rate, _ = clients.run(options.seconds)
            clients.end()
            memory = (daemon.memory() - before) / count
            print(f"{title}: {memory / 1024:.0f} kB each, {rate:.0f} steps/s in all, {stored_bytes(folder, names[0]) / 1024:.0f} kB a checkpoint", flush=True)
    finally:
        daemon.end()


def beside(options, folder):
    daemon = Daemon(options.bin, folder)
    try:
        large = [daemon.create(decks.cube(options.side).replace("final time: 10.", "final time: 1e9"), "bob") for _ in range(4)]
        small = {token: Clients(daemon.address, [daemon.create(pendulum(), token)], 1, 10, token) for token in ("ann", "bob")}
        heavy = Clients(daemon.address, large, 4, 1, "bob")

        def times(client, crowded):
            if crowded:
                heavy.start(options.seconds + 0.5)
                time.sleep(0.5)
            found = client.run(options.seconds)[1]
            return found, heavy.wait()[1] if crowded else []

        found = {}
        for _ in range(options.rounds):
            for who, client, crowded in (("alone", small["ann"], False), ("beside another caller's", small["ann"], True),
                                         ("beside one's own", small["bob"], True)):
                mine, theirs = times(client, crowded)
                found.setdefault(who, []).extend(mine)
                found.setdefault("a large step " + who, []).extend(theirs)
        for who, values in found.items():
            values.sort()
            if values:
                print(f"{who}: median {1e3 * values[len(values) // 2]:.2f} ms, p99 {1e3 * values[int(0.99 * (len(values) - 1))]:.2f} ms, {len(values)} calls")
        for client in [heavy, *small.values()]:
            client.end()
    finally:
        daemon.end()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("bin")
    parser.add_argument("kind", choices=["crowd", "journal", "sizes", "beside"])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=2)
    parser.add_argument("--steps", type=lambda text: [int(part) for part in text.split(",")], default=[1000, 100, 1], help="of a call")
    parser.add_argument("--side", type=int, default=10)
    parser.add_argument("--folder")
    options = parser.parse_args()
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(most, 65536), most))
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        {"crowd": crowd, "journal": journal, "sizes": sizes, "beside": beside}[options.kind](options, folder)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(*sys.argv[2:])
    else:
        main()
