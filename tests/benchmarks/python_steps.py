#!/usr/bin/env python3
"""What a single step costs in Python, beside an empty message of grpcio: medians of both clients, by calls and on streams [us]; what `simulate` brings.

usage: python_steps.py MBCOSIMD [--steps N]      with PYTHONPATH of the built package

The echo is `GetServerInfo` for calls; on streams it is a step of no steps, which the daemon answers without solving anything, with grpcio alone.
"""
import argparse
import asyncio
import os
import queue
import statistics
import subprocess
import tempfile
import time

import grpc

import mbcosim
import mbcosim.aio
from mbcosim.v1 import simulations_pb2 as pb, simulations_pb2_grpc

DECK = """begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.e9; time step: 1.e-3; method: ms, 0.6; tolerance: 1.e-6; max iterations: 20; end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, 0., 1., 0., null; end: nodes;
begin: elements; body: 1, 1, 1., null, diag, 1., 2., 3.; end: elements;
"""


def median(seconds):
    return 1e6 * statistics.median(seconds[len(seconds) // 10:])


def timed(count, function):
    """Median of `function()` [us]."""
    seconds = []
    for _ in range(count):
        begin = time.perf_counter()
        function()
        seconds.append(time.perf_counter() - begin)
    return median(seconds)


async def timed_await(count, function):
    seconds = []
    for _ in range(count):
        begin = time.perf_counter()
        await function()
        seconds.append(time.perf_counter() - begin)
    return median(seconds)


def blocking(address, count):
    found = {}
    with grpc.insecure_channel(address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        found["grpcio, call"] = timed(count, lambda: stub.GetServerInfo(pb.GetServerInfoRequest()))
        with mbcosim.connect(address) as server, server.load_text(DECK) as simulation:
            requests = queue.SimpleQueue()
            replies = stub.StepStream(iter(requests.get, None))

            def echo():
                requests.put(pb.StepRequest(simulation=simulation.name, steps=0))
                next(replies)

            found["grpcio, stream"] = timed(count, echo)
            requests.put(None)
            found["step() in a loop"] = timed(count, simulation.step)
            found["step() with a timeout"] = timed(count, lambda: simulation.step(timeout=30))
            with simulation.stepper() as stepper:
                found["Stepper"] = timed(count, stepper.step)
            found["solver"] = median([simulation.step().solver_seconds for _ in range(count)])
    return found


async def awaited(address, count):
    found = {}
    async with grpc.aio.insecure_channel(address) as channel:
        stub = simulations_pb2_grpc.SimulationsStub(channel)
        found["grpcio, call"] = await timed_await(count, lambda: stub.GetServerInfo(pb.GetServerInfoRequest()))
        async with mbcosim.aio.connect(address) as server, await server.load_text(DECK) as simulation:
            stream = stub.StepStream()

            async def echo():
                await stream.write(pb.StepRequest(simulation=simulation.name, steps=0))
                await stream.read()

            found["grpcio, stream"] = await timed_await(count, echo)
            await stream.done_writing()
            found["step() in a loop"] = await timed_await(count, simulation.step)
            found["step() with a timeout"] = await timed_await(count, lambda: simulation.step(timeout=30))
            async with await simulation.stepper() as stepper:
                found["Stepper"] = await timed_await(count, stepper.step)
            found["solver"] = median([(await simulation.step()).solver_seconds for _ in range(count)])
    return found


def table(address, steps):
    """Best of three rates at which `simulate` brings all variables of a node into numpy arrays [values/s]."""
    rates = []
    with mbcosim.connect(address) as server, server.load_text(DECK) as simulation:
        names = [name for name in simulation.variables if name.startswith("node.structural.1.")]
        for _ in range(3):
            begin = time.perf_counter()
            history = simulation.simulate(names, steps=steps)
            rates.append(sum(history[name].size for name in names) / (time.perf_counter() - begin))
    return max(rates)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("daemon")
    parser.add_argument("--steps", type=int, default=3000)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        address = f"unix:{folder}/s"
        daemon = subprocess.Popen([options.daemon, "--listen", address, "--log-level", "warn"])
        try:
            while not os.path.exists(f"{folder}/s"):
                time.sleep(0.02)
            columns = {"blocking": blocking(address, options.steps), "asyncio": asyncio.run(awaited(address, options.steps))}
            rate = table(address, 10 * options.steps)
        finally:
            daemon.terminate()
            daemon.wait()
    print(f"{'[us]':24}" + "".join(f"{name:>12}" for name in columns))
    for row in columns["blocking"]:
        print(f"{row:24}" + "".join(f"{column[row]:12.0f}" for column in columns.values()))
    print(f"simulate: {rate / 1e6:.1f} million values/s")


if __name__ == "__main__":
    main()
