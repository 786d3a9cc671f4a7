#!/usr/bin/env python3
"""A scripted peer that checks a server: are the messages, their order, their numbers and its refusals those of the protocol?

usage: check_server.py ADDRESS [--transport stream|shared_memory]      exit code 0: all checks passed
"""
import argparse
import math
import os
import sys
import threading
import time
import uuid

import grpc
import numpy as np

from mbcosim.v1 import common_pb2, coupling_pb2 as pb, coupling_types_pb2 as types, simulations_pb2, simulations_pb2_grpc
from wires import END, open_wire

STEP = 1e-3  # [s]
VERSION = 2
PROTOCOL = common_pb2.VersionRange(lowest=VERSION, highest=VERSION)
FORCE = 2.0  # [N] on a unit mass
DECK = f"""begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 100.; time step: {STEP}; method: ms, 0.6; tolerance: 1.e-9;
  max iterations: 20; end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 2; end: control data;
begin: nodes; structural: 1, dynamic, null, euler, 0.3, -0.4, 0.2, 0., 1., 0., 0.1, 0.2, 5.;
  structural: 2, dynamic, 1., 2., 3., euler, 2.9, 0.1, 1.2, null, null; end: nodes;
begin: elements; body: 1, 1, 1., null, diag, 1., 2., 3.; body: 2, 2, 1., null, diag, 1., 1., 1.; end: elements;
"""
NODES = 2
TIME_FACTOR = float(os.environ.get("MBCOSIM_TIME_FACTOR", "1"))  # of a loaded machine
WAIT = 5.0 * TIME_FACTOR  # [s] for any message


class Wrong(Exception):
    """What a server did that it must not do."""


def require(holds, what):
    if not holds:
        raise Wrong(what)


class Bench:
    """One simulation on the server under test, and scripted peers on its port."""

    def __init__(self, address, transport):
        self.address, self.transport = address, transport
        self._channel = grpc.insecure_channel(address)
        self.stub = simulations_pb2_grpc.SimulationsStub(self._channel)
        self._wires, self.left = [], False

    def __enter__(self):
        header = simulations_pb2.UploadHeader(bundle_main_file="deck")
        header.options.request_id = uuid.uuid4().hex
        header.options.ports.add(name="p", kind=types.PORT_KIND_STRUCTURAL, node_labels=[1, 2])
        chunk = common_pb2.FileChunk(path="deck", data=DECK.encode())
        self.info = self.stub.CreateSimulation(iter([
            simulations_pb2.UploadRequest(header=header), simulations_pb2.UploadRequest(chunk=chunk)]), timeout=6 * WAIT,
                                                wait_for_ready=True).simulation
        return self

    def __exit__(self, *_):
        for wire in self._wires:
            wire.close()
        try:
            self.stub.DeleteSimulation(simulations_pb2.DeleteSimulationRequest(simulation=self.info.name), timeout=WAIT)
        except grpc.RpcError:
            pass  # a wrong server may not delete
        self._channel.close()

    def wire(self):
        self._wires.append(open_wire(self.address, self.transport))
        return self._wires[-1]

    def hello(self, **fields):
        message = pb.Hello(protocol=PROTOCOL, simulation=self.info.name, port="p")
        for name, value in fields.items():
            if name == "timeout":
                message.presence.peer_timeout.FromMilliseconds(int(1000 * value))
            elif name == "node_labels":
                message.expected.node_labels.extend(value)
            elif name == "versions":
                message.protocol.lowest, message.protocol.highest = value
            elif name in ("simulation", "port"):
                setattr(message, name, value)
            else:
                group = next(g for g in (message.expected, message.form, message.schedule, message.iteration, message.presence)
                             if name in g.DESCRIPTOR.fields_by_name)
                setattr(group, name, value)
        return pb.PeerMessage(hello=message)

    def attach(self, **fields):
        """A wire after its handshake, and the welcome."""
        wire, message = self.greet(**fields)
        require(message not in (None, END), f"a good `hello` is answered by {wire.status or 'nothing'}")
        require(message.WhichOneof("content") == "welcome", f"the first message is `{message.WhichOneof('content')}`")
        return wire, message.welcome

    def greet(self, **fields):
        """A wire and what answers its `hello`; again while a peer that has just gone is still taken for there."""
        end = time.monotonic() + WAIT
        while True:
            wire = self.wire()
            wire.send(self.hello(**fields))
            message = wire.receive(WAIT)
            if not self.left or message is not END or wire.status.reason != "PORT_TAKEN" or time.monotonic() > end:
                return wire, message
            time.sleep(0.02)

    def leave(self, wire):
        """The peer goes, and the next one may come before the server knows."""
        wire.close()
        self.left = True

    def refused(self, first, reasons, code):
        wire = self.wire()
        wire.send(first)
        ended(wire, reasons, code)
        return wire.status

    def step(self, count=1, **fields):
        """Steps in a thread of its own; join() gives the reply."""
        return Stepping(self.stub, self.info.name, count, fields)


class Stepping(threading.Thread):
    def __init__(self, stub, name, count, fields):
        super().__init__(daemon=True)
        self._stub, self._request, self.reply = stub, simulations_pb2.StepRequest(simulation=name, steps=count, **fields), None
        self.start()

    def run(self):
        try:
            self.reply = self._stub.Step(self._request, timeout=4 * WAIT)
        except grpc.RpcError as error:
            self.reply = error

    def result(self, outcome=None):
        self.join(4 * WAIT)
        require(isinstance(self.reply, simulations_pb2.StepReply), f"Step ended with {self.reply}")
        if outcome:
            name = simulations_pb2.StepOutcome.Name(self.reply.outcome)
            require(name == "STEP_OUTCOME_" + outcome, f"the step's outcome is {name}, expected {outcome}")
        return self.reply


def ended(wire, reasons, code):
    """The stream ends with this status, whatever came before."""
    end = time.monotonic() + WAIT
    while wire.receive(0.1) is not END:
        require(time.monotonic() < end, f"the stream goes on, expected its end with {' or '.join(reasons)}")
    require(wire.status.reason in reasons, f"it ended with {wire.status}, expected the reason {' or '.join(reasons)}")
    require(wire.status.code == code.value[0], f"it ended with {wire.status}, expected {code.name}")


def exchange(wire, what="exchange"):
    message = wire.receive(WAIT)
    require(message is not None, f"no {what} came within {WAIT} s")
    require(message is not END, f"the stream ended with {wire.status} instead of {what}")
    name = message.WhichOneof("content")
    require(name == what, f"`{name}` came instead of `{what}`")
    return getattr(message, name)


def answer(wire, index, forces=None, **fields):
    forces = [0.0] * 3 * NODES if forces is None else forces
    wire.send(pb.PeerMessage(exchange=pb.PeerExchange(index=index, answer=pb.PeerAnswer(forces=forces, **fields))))


def silent(wire, seconds=0.1):
    message = wire.receive(seconds)
    require(message is None, f"an unexpected message: {message}")


def check_arrays(values, rotation_size=9):
    sizes = [len(values.positions), len(values.rotations), len(values.velocities), len(values.angular_velocities),
             len(values.accelerations), len(values.signals)]
    require(sizes == [3 * NODES, rotation_size * NODES, 3 * NODES, 3 * NODES, 0, 0], f"lengths of the arrays: {sizes}")
    told = [field.name for field, _ in values.ListFields() if field.name.startswith("reference_")]
    require(not told, f"motion of a reference node that the port does not have: {told}")
    require(all(math.isfinite(x) for field in (values.positions, values.rotations, values.velocities) for x in field),
            "numbers that are not finite")


# ---------------------------------------------------------------- the checks

def handshake(bench):
    _, welcome = bench.attach(node_labels=[1, 2])
    chosen = welcome.protocol
    require(chosen.lowest == chosen.highest == VERSION, f"versions {chosen.lowest} to {chosen.highest} are no choice of those offered")
    require(list(welcome.layout.node_labels) == [1, 2], f"labels {list(welcome.layout.node_labels)}, the port has [1, 2]")
    require(welcome.layout.kind == types.PORT_KIND_STRUCTURAL, "the layout has another kind")
    require(len(welcome.model_digest) == 16, f"digest {welcome.model_digest!r}")
    require(math.isclose(welcome.step_size, STEP) and welcome.step == 0 and welcome.time == 0,
            f"step {welcome.step}, time {welcome.time}, step size {welcome.step_size}")


def loose(bench):
    wire, _ = bench.attach(mode=types.COUPLING_MODE_LOOSE)
    stepping, velocity = bench.step(5), None
    for k in range(5):
        values = exchange(wire)
        require(values.index == k + 1, f"index {values.index} of exchange {k + 1}")
        require(values.step == k and values.iteration == 0, f"step {values.step}, iteration {values.iteration} before step {k + 1}")
        require(math.isclose(values.time, k * STEP, abs_tol=1e-12), f"time {values.time} at step {k}")
        require(math.isclose(values.target_time, (k + 1) * STEP, rel_tol=1e-9), f"target time {values.target_time} at step {k}")
        check_arrays(values)
        for R in np.reshape(values.rotations, (NODES, 3, 3)):
            require(np.allclose(R @ R.T, np.eye(3), atol=1e-9) and np.linalg.det(R) > 0, "a rotation matrix is none")
        if k > 1:  # the load starts within its first step, and the integrator remembers it for some
            gained = values.velocities[3] - velocity
            require(math.isclose(gained, FORCE * STEP, rel_tol=0.05), f"the force changed the velocity by {gained}")
        velocity = values.velocities[3]
        answer(wire, values.index, [0, 0, 0, FORCE, 0, 0])
    require(stepping.result("ACCEPTED").step == 5, "five steps were asked for")
    silent(wire)


def orientation(bench):
    """At the start the matrix and the quaternion tell the same, and the angular velocity turns the matrix."""
    wire, _ = bench.attach(mode=types.COUPLING_MODE_LOOSE)
    stepping = bench.step(2)
    first = exchange(wire)
    answer(wire, first.index)
    second = exchange(wire)
    answer(wire, second.index)
    stepping.result("ACCEPTED")
    R, later = (np.reshape(values.rotations, (NODES, 3, 3)) for values in (first, second))
    w = np.reshape(first.angular_velocities, (NODES, 3))
    for i in range(NODES):
        spin = (later[i] @ R[i].T - np.eye(3)) / STEP
        require(np.allclose([spin[2, 1], spin[0, 2], spin[1, 0]], w[i], atol=0.1), "the angular velocity does not turn the matrix")
    wire.close()
    deadline = time.monotonic() + WAIT
    while time.monotonic() < deadline:
        try:
            wire, _ = bench.attach(mode=types.COUPLING_MODE_LOOSE, rotation_form=types.ROTATION_FORM_QUATERNION)
            break
        except Wrong:
            time.sleep(0.05)  # the first peer has not left yet
    stepping = bench.step()
    values = exchange(wire)
    check_arrays(values, 4)
    for w, x, y, z in np.reshape(values.rotations, (NODES, 4)):
        require(w >= 0 and math.isclose(w * w + x * x + y * y + z * z, 1, rel_tol=1e-9), f"quaternion {(w, x, y, z)}")
    answer(wire, values.index)
    stepping.result("ACCEPTED")


def staggered(bench):
    wire, _ = bench.attach(mode=types.COUPLING_MODE_STAGGERED)
    stepping = bench.step(3)
    for k in range(4):
        values = exchange(wire)
        require((values.index, values.step) == (k + 1, k), f"exchange {values.index} of step {values.step} as number {k + 1}")
        require(values.target_estimated, f"`target_estimated` is missing in exchange {k + 1}")
        if k < 3:
            answer(wire, values.index)
    require(stepping.result("ACCEPTED").step == 3, "three steps were asked for")


def implicit(mode):
    def check(bench):
        wire, _ = bench.attach(mode=mode)
        stepping, index = bench.step(3), 0
        for k in range(1, 4):
            iteration = 0
            while True:
                message = wire.receive(WAIT)
                require(message not in (None, END), f"step {k}: neither `exchange` nor `accepted`; {wire.status}")
                if message.WhichOneof("content") == "accepted":
                    break
                require(message.WhichOneof("content") == "exchange", f"`{message.WhichOneof('content')}` within a step")
                values, index, iteration = message.exchange, index + 1, iteration + 1
                require(values.index == index, f"index {values.index} of exchange {index}")
                require(values.iteration == iteration, f"step {k}: iteration {values.iteration}, expected {iteration}")
                require(values.step == k, f"exchange of step {values.step} within step {k}")
                check_arrays(values)
                answer(wire, values.index, [0, 0, 0, FORCE, 0, 0])
                require(iteration < 50, "a constant load does not converge")
            require(iteration > 0, f"step {k} was accepted without an exchange")
            notice = message.accepted
            require(notice.step == k and math.isclose(notice.time, k * STEP, rel_tol=1e-9), f"`accepted` of step {k}: {notice}")
        stepping.result("ACCEPTED")
        silent(wire)
    return check


def rejected(bench):
    wire, _ = bench.attach(mode=types.COUPLING_MODE_TIGHT)
    stepping = bench.step()
    wire.send(pb.PeerMessage(exchange=pb.PeerExchange(index=exchange(wire).index, failure="no wind")))
    notice = exchange(wire, "rejected")
    require(notice.step == 0 and notice.time == 0, f"`rejected` names step {notice.step} to go back to")
    reply = stepping.result("PEER_LOST")
    require("no wind" in reply.failure.message and reply.step == 0, f"the failure: {reply.failure.message}, step {reply.step}")


def refused_length(mode):
    """The peer rejects the step; the client repeats it with the length preferred."""
    def check(bench):
        wire, _ = bench.attach(mode=mode)
        explicit = mode == types.COUPLING_MODE_LOOSE
        stepping = bench.step()
        wire.send(pb.PeerMessage(exchange=pb.PeerExchange(
            index=exchange(wire).index, reject=pb.Rejection(preferred_step_size=STEP / 4, text="too long"))))
        reply = stepping.result("REJECTED_BY_PEER")
        require(reply.preferred_step_size == STEP / 4 and reply.step == 0, f"preferred {reply.preferred_step_size}, step {reply.step}")
        require("too long" in reply.failure.message, f"the failure: {reply.failure.message}")
        if not explicit:
            require(exchange(wire, "rejected").step == 0, "`rejected` names another step")
        stepping = bench.step(step_size=STEP / 4)
        values = exchange(wire)
        require(math.isclose(values.target_time, STEP / 4, rel_tol=1e-9), f"target time {values.target_time} of the shorter step")
        answer(wire, values.index)
        while not explicit:  # until it is accepted
            message = wire.receive(WAIT)
            require(message not in (None, END), f"neither `exchange` nor `accepted`; {wire.status}")
            if message.WhichOneof("content") == "accepted":
                break
            answer(wire, message.exchange.index)
        require(math.isclose(stepping.result("ACCEPTED").time, STEP / 4, rel_tol=1e-9), "the step has another length")
    return check


def heartbeats(bench):
    wire, _ = bench.attach(mode=types.COUPLING_MODE_LOOSE)
    stepping = bench.step(3)
    for k in range(3):
        wire.send(pb.PeerMessage(heartbeat=pb.Heartbeat(count=k)))
        values = exchange(wire)
        wire.send(pb.PeerMessage(heartbeat=pb.Heartbeat(count=k)))
        answer(wire, values.index)
    stepping.result("ACCEPTED")


def wrong_answer(reasons, code, forces=None, offset=0, repeat=1, **fields):
    def check(bench):
        wire, _ = bench.attach(mode=types.COUPLING_MODE_LOOSE, timeout=2)
        stepping = bench.step()
        values = exchange(wire)
        for _ in range(repeat):
            answer(wire, values.index + offset, forces, **fields)
        if repeat == 1:
            require(stepping.result("PEER_LOST").step == 0, "the step was accepted with a wrong answer")
        ended(wire, reasons, code)
    return check


def not_hello_first(bench):
    bench.refused(pb.PeerMessage(heartbeat=pb.Heartbeat(count=1)), ["OUT_OF_TURN"], grpc.StatusCode.FAILED_PRECONDITION)


def hello_twice(bench):
    wire, _ = bench.attach()
    wire.send(bench.hello())
    ended(wire, ["OUT_OF_TURN"], grpc.StatusCode.FAILED_PRECONDITION)


def versions(bench):
    bench.refused(bench.hello(versions=(7, 9)), ["VERSION_MISMATCH"], grpc.StatusCode.FAILED_PRECONDITION)
    bench.refused(bench.hello(versions=(1, 1)), ["VERSION_MISMATCH"], grpc.StatusCode.FAILED_PRECONDITION)
    bench.attach(versions=(1, 9))


def mismatches(bench):
    status = bench.refused(bench.hello(model_digest="0" * 16, input_size=7, node_labels=[2, 1], frame=types.PORT_FRAME_REFERENCE),
                           ["PORT_MISMATCH"], grpc.StatusCode.FAILED_PRECONDITION)
    missing = {"model_digest", "input_size", "node_labels", "frame"} - set(status.metadata)
    require(not missing, f"not told in the refusal: {sorted(missing)}")


def names(bench):
    bench.refused(bench.hello(port="q"), ["NO_SUCH_PORT"], grpc.StatusCode.NOT_FOUND)
    bench.refused(bench.hello(simulation="simulations/none"), ["NO_SUCH_SIMULATION"], grpc.StatusCode.NOT_FOUND)


def port_taken(bench):
    wire, _ = bench.attach()
    bench.refused(bench.hello(), ["PORT_TAKEN"], grpc.StatusCode.FAILED_PRECONDITION)
    stepping = bench.step()
    answer(wire, exchange(wire).index)
    stepping.result("ACCEPTED")


def where_it_stands(bench):
    wire, _ = bench.attach(step=0)
    stepping = bench.step(2)
    for _ in range(2):
        answer(wire, exchange(wire).index)
    stepping.result("ACCEPTED")
    bench.leave(wire)
    ahead, message = bench.greet(step=7)
    require(message is END and ahead.status.reason == "PEER_AHEAD" and ahead.status.code == grpc.StatusCode.FAILED_PRECONDITION.value[0],
            f"a peer at step 7 of a simulation at step 2 is answered by {ahead.status or message}, expected PEER_AHEAD")
    require(ahead.status.metadata.get("step") == "2", f"the refusal's `step` is {ahead.status.metadata.get('step')}, the simulation stands at 2")
    for told in ({"step": 7, "can_go_back": True}, {"step": 2}, {"step": 1}):
        wire, welcome = bench.attach(**told)
        require(welcome.step == 2, f"`Welcome.step` is {welcome.step} at step 2")
        bench.leave(wire)


def late_peer(bench):
    wire, _ = bench.attach(timeout=0.3)
    start, stepping = time.monotonic(), bench.step()
    first = exchange(wire)
    require(stepping.result("PEER_LOST").step == 0, "a step without an answer was accepted")
    require(time.monotonic() - start < 3 * TIME_FACTOR, "the bound of 0.3 s was not met")
    answer(wire, first.index)  # too late: dropped
    stepping = bench.step()
    values = exchange(wire)
    require(values.index == first.index + 1, f"index {values.index} after {first.index}")
    answer(wire, values.index)
    stepping.result("ACCEPTED")


BAD, TURN = (["BAD_ARGUMENT"], grpc.StatusCode.INVALID_ARGUMENT), (["OUT_OF_TURN"], grpc.StatusCode.FAILED_PRECONDITION)
CHECKS = {
    "handshake": handshake, "loose": loose, "orientations": orientation, "staggered": staggered,
    "tight": implicit(types.COUPLING_MODE_TIGHT), "window": implicit(types.COUPLING_MODE_WINDOW), "rejected": rejected,
    "loose peer rejects": refused_length(types.COUPLING_MODE_LOOSE), "tight peer rejects": refused_length(types.COUPLING_MODE_TIGHT),
    "window peer rejects": refused_length(types.COUPLING_MODE_WINDOW),
    "heartbeats": heartbeats, "too few forces": wrong_answer(*BAD, forces=[1.0, 2.0]),
    "not a number": wrong_answer(*BAD, forces=[math.nan] * 3 * NODES),
    "moments of another length": wrong_answer(*BAD, moments=[1.0]), "signals on nodes": wrong_answer(*BAD, signals=[1.0]),
    "answer in advance": wrong_answer(*TURN, offset=1), "answer without a number": wrong_answer(*TURN, offset=-1),
    "answer twice": wrong_answer(*TURN, repeat=2), "first message": not_hello_first, "hello twice": hello_twice,
    "versions": versions, "mismatches": mismatches, "unknown names": names, "port taken": port_taken, "late peer": late_peer,
    "where a peer stands": where_it_stands,
}


def check_server(address, transport="stream", first_only=False):
    """What is wrong by check; empty: nothing. `first_only`: stops at the first finding."""
    found = {}
    for name, check in CHECKS.items():
        try:
            with Bench(address, transport) as bench:
                check(bench)
        except (Wrong, grpc.RpcError, OSError) as error:
            found[name] = str(error)
            if first_only:
                break
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("address")
    parser.add_argument("--transport", choices=["stream", "shared_memory"], default="stream")
    options = parser.parse_args()
    found = check_server(options.address, options.transport)
    for name in CHECKS:
        print(f"{'FAILED' if name in found else 'ok':7} {name}{': ' + found[name] if name in found else ''}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
