#!/usr/bin/env python3
"""What subscribers that do not read cost a run. usage: idle_subscribers.py BIN [--subscribers N] [--seconds S] [--rounds R] [--distinct] [--most-loss L]

Starts a daemon, and measures the steps per second of one free body, by turns without subscribers and with N idle ones, whose
flow-control windows are full by then. Prints each round and the medians. --distinct: no two subscriptions are equal. --most-loss 0.10: the exit code is 1 when the
medians differ by more than a tenth.
"""
import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time

import grpc

from mbcosim.v1 import simulations_pb2 as pb, simulations_pb2_grpc, telemetry_pb2, telemetry_pb2_grpc

DECK = """
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.e9; time step: 1.e-3; method: ms, 0.6; tolerance: 1.e-9;
  max iterations: 20; end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, 0., 1., 0., 0.1, 5., 0.1; end: nodes;
begin: elements; body: 1, 1, 1., null, diag, 1., 2., 3.; end: elements;
"""


def steps_per_second(stub, name, seconds):
    start, done = time.monotonic(), 0
    while time.monotonic() - start < seconds:
        done += stub.Step(pb.StepRequest(simulation=name, steps=2000)).steps_done
    return done / (time.monotonic() - start)


def subscribe(address, name, count, distinct):
    """In a process of its own: opens the subscriptions, says so, and reads no more."""
    channel = grpc.insecure_channel(address, options=[("grpc.http2.bdp_probe", 0)])  # windows of 64 KiB
    telemetry = telemetry_pb2_grpc.TelemetryStub(channel)
    calls = []
    for i in range(count):
        handles = [0, 1, 2] + ([3 + i % 20] * (1 + i // 20) if distinct else [])
        calls.append(telemetry.Subscribe(telemetry_pb2.SubscribeRequest(simulation=name, handles=handles)))
    for call in calls:
        next(call)
    print("ready", flush=True)
    sys.stdin.read()
    os._exit(0)


def idle_subscribers(address, name, options):
    command = [sys.executable, __file__, "--subscribe", address, name, str(options.subscribers), str(int(options.distinct))]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    return process


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("bin")
    parser.add_argument("--subscribers", type=int, default=450)
    parser.add_argument("--seconds", type=float, default=3)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--distinct", action="store_true")
    parser.add_argument("--most-loss", type=float, default=1, help="largest part of the steps per second that may be lost")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        address = f"unix:{folder}/s"
        daemon = subprocess.Popen([os.path.join(options.bin, "mbcosimd"), "--listen", address], stderr=subprocess.DEVNULL)
        try:
            channel = grpc.insecure_channel(address)
            grpc.channel_ready_future(channel).result(30)
            stub = simulations_pb2_grpc.SimulationsStub(channel)
            name = stub.CreateSimulation(iter([
                pb.UploadRequest(header=pb.UploadHeader(bundle_main_file="deck")),
                pb.UploadRequest(chunk={"path": "deck", "data": DECK.encode()})])).simulation.name
            alone, watched = [], []
            for _ in range(options.rounds):
                alone.append(steps_per_second(stub, name, options.seconds))
                watchers = idle_subscribers(address, name, options)
                steps_per_second(stub, name, 3)  # fills the windows
                watched.append(steps_per_second(stub, name, options.seconds))
                print(f"{alone[-1]:.0f} steps/s without, {watched[-1]:.0f} with {options.subscribers} idle subscribers", flush=True)
                watchers.stdin.close()
                watchers.wait(30)
            loss = 1 - statistics.median(watched) / statistics.median(alone)
            print(f"median {statistics.median(alone):.0f} -> {statistics.median(watched):.0f}: {100 * loss:.1f} % less")
            return 0 if loss <= options.most_loss else 1
        finally:
            daemon.terminate()
            daemon.wait(30)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--subscribe"]:
        subscribe(sys.argv[2], sys.argv[3], int(sys.argv[4]), sys.argv[5] == "1")
    sys.exit(main())
