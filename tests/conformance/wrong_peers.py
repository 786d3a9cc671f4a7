#!/usr/bin/env python3
"""A peer of raw messages; or, on purpose, with one error.

usage: wrong_peers.py [FAULT] ADDRESS SIMULATION PORT
"""
import math
import sys
import time

from mbcosim.v1 import coupling_pb2 as pb, coupling_types_pb2 as types
from wires import END, StreamWire

# What a peer can do wrong, one each.
FAULTS = [
    "another index", "answers twice", "does not answer", "answers late", "too few forces", "moments of another length",
    "signals on nodes", "not a number", "answers notices", "speaks before hello", "second hello", "another port", "versions turned round",
    "unknown mode", "answers in advance", "does not go back", "stays after the end", "negative tolerance", "reference loads unasked",
    "tangent of another size",
]


def hello(simulation, port, fault):
    message = pb.Hello(simulation=simulation, port="wing" if fault == "another port" else port)
    message.protocol.lowest, message.protocol.highest = (3, 2) if fault == "versions turned round" else (2, 2)
    message.schedule.mode = types.COUPLING_MODE_TIGHT
    message.presence.peer_timeout.FromMilliseconds(1000)
    if fault == "unknown mode":
        message.schedule.mode = 77
    if fault == "negative tolerance":
        message.iteration.tolerance = -1.0
    if fault == "tangent of another size":
        message.iteration.tangent = pb.TANGENT_FORM_DENSE
    return pb.PeerMessage(hello=message)


def answer(exchange, calls, fault):
    """A spring on each point."""
    whole = pb.PeerExchange(index=exchange.index, answer=pb.PeerAnswer(forces=[-100.0 * x for x in exchange.positions]))
    out = whole.answer
    out.moments.extend([0.0] * len(exchange.positions))
    if fault == "another index":
        whole.index += 1
    if fault == "too few forces":
        del out.forces[-1]
    if fault == "moments of another length":
        del out.moments[-1]
    if fault == "signals on nodes":
        out.signals.append(1.0)
    if fault == "not a number":
        out.forces[0] = math.nan
    if fault == "does not go back":
        out.forces[0] += calls
    if fault == "reference loads unasked":
        out.reference_force.extend([0.0] * 3)
    if fault == "tangent of another size":
        out.tangent.stiffness.extend([0.0] * 7)
    return pb.PeerMessage(exchange=whole)


def run(address, simulation, port, fault=None):
    wire = StreamWire(address)
    if fault == "speaks before hello":
        wire.send(pb.PeerMessage(heartbeat=pb.Heartbeat(count=1)))
    wire.send(hello(simulation, port, fault))
    if fault == "second hello":
        wire.send(hello(simulation, port, fault))
    calls = 0
    while True:
        message = wire.receive(30)
        if message is END or message is None:
            break
        kind = message.WhichOneof("content")
        if kind == "welcome" and fault == "answers in advance":
            wire.send(pb.PeerMessage(exchange=pb.PeerExchange(index=1, answer=pb.PeerAnswer(forces=[0.0] * 6))))
        if kind in ("accepted", "rejected") and fault == "answers notices":
            wire.send(pb.PeerMessage(exchange=pb.PeerExchange(index=calls, answer=pb.PeerAnswer(forces=[0.0] * 6))))
        if kind != "exchange" or fault == "does not answer" and calls > 1:
            continue
        calls += 1
        if fault == "answers late":
            time.sleep(1.5)
        for _ in range(2 if fault == "answers twice" else 1):
            wire.send(answer(message.exchange, calls, fault))
    if fault == "stays after the end":
        time.sleep(4)
    wire.close()


def peer(fault):
    """A peer with this error, to be started with (address, simulation, port)."""
    return lambda address, simulation, port: run(address, simulation, port, fault)


if __name__ == "__main__":
    run(*sys.argv[-3:], sys.argv[1] if len(sys.argv) > 4 else None)
