#!/usr/bin/env python3
"""What a step costs through each door, as a table: usage: doors.py BUILD_FOLDER [STEPS]

A free body that takes two iterations a step, on one host. Every line is the median and the 99 % quantile over STEPS steps, 2000 by default, after
some that do not count, as the program on the other side of the door sees them. Doors that cannot be tried here are left out and named.
With MBCOSIM_MBDYN=/path/to/mbdyn that program runs the decks with sockets as well, with the same code on the other side, by turns with `mbcosim run`:
medians of TURNS turns.
"""
import asyncio
import http.client
import json
import os
import re
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile
import time
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
BUILD = os.path.abspath(sys.argv[1])
STEPS = int(sys.argv[2]) if len(sys.argv) > 2 else 2000
WARM_UP = STEPS // 10
TURNS = 5
BIN = os.path.join(BUILD, "bin")
sys.path[:0] = [os.path.join(BUILD, "python"), os.path.join(ROOT, "tests", "fmi")]

import mbcosim  # noqa: E402
import mbcosim.aio  # noqa: E402
from mbcosim.v1 import simulations_pb2 as pb  # noqa: E402

HEAD = """begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: {end}; time step: 1.e-3; method: ms, .6; tolerance: 1.e-9; max iterations: 20; end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; forces: {forces}; default output: none; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, null, .01, 2., .01; end: nodes;
begin: elements; body: 1, 1, 1., null, diag, 1., 2., 3.; {force} end: elements;
"""
BODY = HEAD.format(end="forever", forces=0, force="")


def coupled(address, end="forever", coupling="tight"):
    return HEAD.format(end=end, forces=1, force=f"force: 5, external structural, {address}, coupling, {coupling}, 2, 1, offset, .1,0.,0., 1;")


def quantiles(step):
    """Of the durations of `step()` [µs]."""
    samples = []
    for _ in range(WARM_UP + STEPS):
        start = time.perf_counter()
        step()
        samples.append(1e6 * (time.perf_counter() - start))
    return of_samples(samples)


def of_samples(samples):
    samples = sorted(samples[WARM_UP:])
    return samples[len(samples) // 2], samples[len(samples) * 99 // 100]


def printed(command, **options):
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, **options)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip() or f"{command[0]} ended with {done.returncode}")
    return tuple(float(word) for word in done.stdout.split()[-2:])


class Daemon:
    def __init__(self, folder):
        self.address, self.codes = f"unix:{folder}/d.sock", os.path.join(folder, "codes")
        os.mkdir(self.codes)
        self.output = open(os.path.join(folder, "out"), "w+")
        self.process = subprocess.Popen([os.path.join(BIN, "mbcosimd"), "--listen", self.address, "--http", "127.0.0.1:0", "--deck-sockets", self.codes,
                                         "--log-level", "warn"], stdout=self.output)
        while not (page := re.search(r"^page: http://([^/]*)/\?token=(\S+)", open(self.output.name).read(), re.M)):
            assert self.process.poll() is None
            time.sleep(0.02)
        self.http, self.token = page.groups()

    def stop(self):
        self.process.terminate()
        self.process.wait(30)


# ------------------------------------------------------------------ who asks for steps

def python_call(daemon, folder):
    with mbcosim.connect(daemon.address) as server, server.load_text(BODY) as body:
        return quantiles(body.step)


def python_stream(daemon, folder):
    with mbcosim.connect(daemon.address) as server, server.load_text(BODY) as body, body.stepper() as stepper:
        return quantiles(stepper.step)


def python_asyncio(daemon, folder):
    async def run():
        samples = []
        async with mbcosim.aio.connect(daemon.address) as server, await server.load_text(BODY) as body:
            for _ in range(WARM_UP + STEPS):
                start = time.perf_counter()
                await body.step()
                samples.append(1e6 * (time.perf_counter() - start))
        return of_samples(samples)

    return asyncio.run(run())


def cpp(door, deck=BODY):
    def measure(daemon, folder):
        program, path = os.path.join(BIN, "door_steps"), os.path.join(folder, "deck.mbd")
        with open(path, "w") as file:
            file.write(deck)
        return printed([program, daemon.address, path, door, str(STEPS)])

    return measure


NODE = """import { connect, loadText } from "./mbcosim.mjs";
const [address, deck, steps, warmUp] = [process.argv[2], process.argv[3], +process.argv[4], +process.argv[5]];
const server = connect(address), body = await loadText(server, deck), samples = [];
for (let k = 0; k < warmUp + steps; ++k) {
  const start = process.hrtime.bigint();
  await body.step(1);
  if (k >= warmUp) samples.push(Number(process.hrtime.bigint() - start) / 1000);
}
samples.sort((a, b) => a - b);
console.log(samples[Math.floor(steps / 2)], samples[Math.floor(steps * 0.99)]);
await body.delete();
server.close();
"""


def node(daemon, folder):
    if not shutil.which("npm"):
        raise RuntimeError("there is no npm")
    client = os.path.join(folder, "node")
    shutil.copytree(os.path.join(ROOT, "client_examples", "node"), client, ignore=shutil.ignore_patterns("node_modules"))
    subprocess.run(["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts"], cwd=client, check=True, stdout=subprocess.DEVNULL)
    with open(os.path.join(client, "steps.mjs"), "w") as file:
        file.write(NODE)
    return printed(["node", "steps.mjs", daemon.address, BODY, str(STEPS), str(WARM_UP)], cwd=client,
                   env={**os.environ, "MBCOSIM_PROTOS": os.path.join(ROOT, "proto")})


def over_http(content_type, encode):
    """Steps by POST over one connection; `encode(simulation)`: the body."""
    def measure(daemon, folder):
        with mbcosim.connect(daemon.address) as server, server.load_text(BODY) as body:
            connection = http.client.HTTPConnection(daemon.http)
            headers = {"Content-Type": content_type, "Authorization": f"Bearer {daemon.token}"}

            def step():
                connection.request("POST", "/mbcosim.v1.Simulations/Step", encode(body.name), headers)
                answer = connection.getresponse()
                text = answer.read()
                assert answer.status == 200, text

            step()
            return quantiles(step)

    return measure


def json_body(simulation):
    return json.dumps({"simulation": simulation, "steps": 1})


def grpc_web_body(simulation):
    message = pb.StepRequest(simulation=simulation, steps=1).SerializeToString()
    return struct.pack(">BI", 0, len(message)) + message


def fmu(standard, remote=False):
    """With `remote` the daemon takes the steps."""
    def measure(daemon, folder):
        from importer import OK, Archive, instance_of
        deck, path = os.path.join(folder, "body.mbd"), os.path.join(folder, f"body{standard}.fmu")
        with open(deck, "w") as file:
            file.write(BODY.replace("forever", "1e6"))
        options = ["--remote", f"http://{daemon.http}"] if remote else []
        os.environ["MBCOSIM_TOKEN"] = daemon.token  # of the door; the FMU looks there
        subprocess.run([os.path.join(BIN, "mbcosim"), "fmu", deck, "-o", path, "--fmi", standard, *options], check=True, stdout=subprocess.DEVNULL)
        clock = [0.0]
        with instance_of(Archive(path)) as instance:
            instance.initialize()

            def step():
                assert instance.do_step(clock[0], 1e-3) == OK
                clock[0] += 1e-3

            return quantiles(step)

    return measure


# ------------------------------------------------------------------ codes in the loop

def build_code(folder):
    path = os.path.join(folder, "code")
    if not os.path.exists(path):
        subprocess.run(["cc", "-O2", os.path.join(HERE, "door_code.c"), "-o", path], check=True)
    return path


def run_with_code(command, coupling, per_step, folder):
    """`command(deck, output)` runs a deck; what the code on the other side of its socket sees."""
    code, deck, path = build_code(folder), os.path.join(folder, "socket.mbd"), os.path.join(folder, "s")
    with open(deck, "w") as file:
        file.write(coupled(f'socket, create, yes, path, "{path}"', 1e-3 * (WARM_UP + STEPS), coupling))
    run = subprocess.Popen(command(deck, os.path.join(folder, "out")), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        return printed([code, path, "2", str(per_step)])
    finally:
        run.wait(60)
        if os.path.exists(path):
            os.unlink(path)


def ours(deck, output):
    return [os.path.join(BIN, "mbcosim"), "run", deck, "-o", output, "-q"]


def mbdyns(deck, output):
    return [os.environ["MBCOSIM_MBDYN"], "-s", "-f", deck, "-o", output]


def mbdyn_run(coupling, per_step):
    return lambda daemon, folder: run_with_code(ours, coupling, per_step, folder)


def by_turns(coupling, per_step, folder):
    """(median, 99 %) of `mbcosim run` and of MBDyn."""
    samples = {ours: [], mbdyns: []}
    for _ in range(TURNS):
        for command, found in samples.items():
            found.append(run_with_code(command, coupling, per_step, folder))
    return [tuple(map(statistics.median, zip(*found))) for found in samples.values()]


def mbdyn_daemon(daemon, folder):
    code = subprocess.Popen([build_code(folder), os.path.join(daemon.codes, "s"), "2", "2"], stdout=subprocess.PIPE, text=True)
    with mbcosim.connect(daemon.address) as server:
        with server.load_text(coupled('socket, create, yes, path, "s"'), deck_sockets=30) as body:
            body.step(WARM_UP + STEPS)
    return tuple(float(word) for word in code.communicate(timeout=60)[0].split())


def ends(program):
    """A program that ends with its simulation."""
    if program.wait(60) != 0:
        raise RuntimeError(program.stderr.read().strip())


def peer_program(*arguments):
    return subprocess.Popen([os.path.join(BIN, "mbcosim"), "peer", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def mbdyn_gateway(daemon, folder):
    path = os.path.join(folder, "s")
    with mbcosim.connect(daemon.address) as server:
        with server.load_text(POINTS) as body:
            gateway = peer_program("socket", "--protocol", "mbdyn", "--listen", f"unix:{path}", "--mode", "tight", "--address", daemon.address,
                                   "--simulation", body.name, "--port", "points")
            code = subprocess.Popen([build_code(folder), path, "2", "2"], stdout=subprocess.PIPE, text=True)
            await_peer(body)
            body.step(WARM_UP + STEPS)
    ends(gateway)
    return tuple(float(word) for word in code.communicate(timeout=60)[0].split())


def await_peer(simulation):
    """Until a peer sits at its port."""
    while not simulation.describe().ports[0].has_peer:
        time.sleep(0.01)


def fmu_peer(daemon, folder):
    """A pendulum on a cart and the controller of the tests: what a step costs who asks for it on a stream."""
    sys.path.insert(0, os.path.join(ROOT, "tests", "fmi"))
    from test_peer import DESCRIPTION
    library, path, speed = os.path.join(folder, "c.so"), os.path.join(folder, "c.fmu"), "node.structural.1.XP"
    subprocess.run(["cc", "-shared", "-fPIC", "-O2", "-DFMI=3", os.path.join(ROOT, "tests", "fmi", "controller.c"), "-o", library], check=True)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION[3].format(state="true", extra=""))
        archive.write(library, "binaries/x86_64-linux/c.so")
    with open(os.path.join(ROOT, "client_examples", "models", "pendulum_cart.mbd")) as file:
        deck = re.sub(r"final time: *[^;]*;", "final time: forever;", file.read())
    ports = [mbcosim.signal_port("control", outputs=[speed], inputs=["stream.force"])]
    with mbcosim.connect(daemon.address) as server:
        with server.load_text(deck, ports=ports) as cart:
            peer = peer_program("fmu", path, "--address", daemon.address, "--simulation", cart.name, "--port", "control", "--mode", "loose",
                                "--map", f"u={speed}[1]", "--map", "y=stream.force")
            if "attached" not in peer.stdout.readline():
                raise RuntimeError(peer.stderr.read().strip())
            with cart.stepper() as stepper:
                found = quantiles(stepper.step)
    ends(peer)
    return found


def python_peer(daemon, folder):
    push = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    with mbcosim.connect(daemon.address) as server, server.load_text(POINTS) as body:
        answer = lambda motion: mbcosim.Loads(forces=push, unfinished=motion.iteration == 1)  # noqa: E731
        with body.couple("points", answer, mode="tight"), body.stepper() as stepper:
            return quantiles(stepper.step)


POINTS = coupled('grpc, port, "points"')
DOORS = [
    ("asks for steps", [
        ("FMU, FMI 3, `fmi3DoStep` (from Python)", fmu("3")),
        ("FMU, FMI 2, `fmi2DoStep` (from Python)", fmu("2")),
        ("FMU with `--remote`, `fmi3DoStep` (from Python)", fmu("3", remote=True)),
        ("C++, `stepper`", cpp("stream")),
        ("C++, `step`", cpp("call")),
        ("Python, `stepper`", python_stream),
        ("Python, `step`", python_call),
        ("asyncio, `step`", python_asyncio),
        ("Node, `step`", node),
        ("Connect, JSON over HTTP", over_http("application/json", json_body)),
        ("gRPC-Web over HTTP", over_http("application/grpc-web+proto", grpc_web_body)),
    ]),
    ("takes part in steps, two exchanges in each", [
        ("MBDyn's protocol, tight, `mbcosim run`", mbdyn_run("tight", 2)),
        ("MBDyn's protocol, tight, `mbcosimd --deck-sockets`", mbdyn_daemon),
        ("MBDyn's protocol, tight, `mbcosim peer socket`", mbdyn_gateway),
        ("C++ over shared memory, tight", cpp("shared_memory", POINTS)),
        ("C++ over gRPC, tight", cpp("peer", POINTS)),
        ("Python over gRPC, tight", python_peer),
    ]),
    ("takes part in steps, one exchange in each", [
        ("MBDyn's protocol, loose, `mbcosim run`", mbdyn_run("loose", 1)),
        ("FMU, loose, `mbcosim peer fmu` (a pendulum on a cart)", fmu_peer),
    ]),
]


def main():
    for title, doors in DOORS:
        print(f"| Who {title} | median [µs] | 99 % [µs] |\n|---|---:|---:|")
        for name, measure in doors:
            with tempfile.TemporaryDirectory() as folder:
                daemon = Daemon(folder)
                try:
                    print("| {} | {:.0f} | {:.0f} |".format(name, *measure(daemon, folder)), flush=True)
                except (RuntimeError, OSError, ImportError) as error:
                    print(f"| {name} | not tried: {error} | |", flush=True)
                finally:
                    daemon.stop()
        print()
    if "MBCOSIM_MBDYN" in os.environ:
        beside_mbdyn()


def beside_mbdyn():
    print(f"| The same deck and code, {TURNS} turns each | median [µs] | 99 % [µs] |\n|---|---:|---:|")
    for coupling, per_step in (("tight", 2), ("loose", 1)):
        with tempfile.TemporaryDirectory() as folder:
            for name, found in zip(("`mbcosim run`", "MBDyn"), by_turns(coupling, per_step, folder)):
                print("| {}, {} | {:.0f} | {:.0f} |".format(name, coupling, *found), flush=True)


if __name__ == "__main__":
    main()
