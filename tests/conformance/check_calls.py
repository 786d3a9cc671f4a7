#!/usr/bin/env python3
"""Checks what a server promises of its calls: repeats are done once, pages add up, a reset is the initial solution, wrong fields are refused by name.

usage: check_calls.py ADDRESS      exit code 0: all checks passed
"""
import argparse
import itertools
import math
import sys
import uuid

import grpc

from check_server import DECK, WAIT, Wrong, require
from mbcosim import errors
from mbcosim.v1 import common_pb2, coupling_types_pb2 as types, simulations_pb2 as pb, simulations_pb2_grpc

NAN = math.nan
LOAD = "node.structural.1.load"
MILLIMETRES = common_pb2.UnitSystem(length="mm", mass="t", time="s")


class Bench:
    """A simulation on the server under test, and the calls on it. `interceptors`: of gRPC, between the kit and the server."""

    def __init__(self, address, interceptors=()):
        self._channel = grpc.insecure_channel(address)
        self.stub = simulations_pb2_grpc.SimulationsStub(grpc.intercept_channel(self._channel, *interceptors))

    def __enter__(self):
        self.info = self.create(uuid.uuid4().hex).simulation
        self.name = self.info.name
        return self

    def __exit__(self, *_):
        try:
            self.stub.DeleteSimulation(pb.DeleteSimulationRequest(simulation=self.name), timeout=WAIT)
        except grpc.RpcError:
            pass  # a check may have done it
        self._channel.close()

    def call(self, method, request=None, **fields):
        request = request or getattr(pb, method + "Request")(simulation=self.name)
        request.MergeFrom(type(request)(**fields))
        return getattr(self.stub, method)(request, timeout=4 * WAIT)

    def inline(self, request_id="", **options):
        header = pb.UploadHeader(bundle_main_file="deck", options=pb.CreateOptions(request_id=request_id, **options))
        return pb.InlineUpload(header=header, files=[common_pb2.FileChunk(path="deck", data=DECK.encode())])

    def create(self, request_id, **options):
        return self.stub.CreateSimulationInline(self.inline(request_id, **options), timeout=6 * WAIT)

    def delete(self, name):
        self.stub.DeleteSimulation(pb.DeleteSimulationRequest(simulation=name), timeout=WAIT)

    def state(self):
        return b"".join(part.data for part in self.stub.ExportSnapshot(pb.ExportSnapshotRequest(simulation=self.name), timeout=WAIT))

    def standing(self):
        """All that a change would change: step, state, display name and snapshots."""
        info = self.call("GetSimulation").simulation
        return info.step, info.display_name, self.state(), [s.name for s in self.call("ListSnapshots").snapshots]

    def variables(self):
        return {v.name: v for v in self.call("DescribeSimulation", page_size=100000).model.variables}

    def refused(self, field, call):
        """INVALID_ARGUMENT [BAD_ARGUMENT] that names the field, and nothing is changed."""
        before = self.standing()
        try:
            call()
        except grpc.RpcError as status:
            error = errors.from_rpc_error(status)
            require(error.code == grpc.StatusCode.INVALID_ARGUMENT and error.reason == "BAD_ARGUMENT",
                    f"a wrong `{field}` is {error.code} [{error.reason}]: {error}")
            require(error.field == field, f"the refusal of a wrong `{field}` names `{error.field}`: {error}")
        else:
            raise Wrong(f"a wrong `{field}` is taken")
        require(self.standing() == before, f"the refused `{field}` has changed something")


# ---------------------------------------------------------------- repeats

def values_request(bench):
    return pb.WriteVariablesRequest(values=common_pb2.Values(handles=[bench.variables()[LOAD].handle], values=[1, 2, 3, 4, 5, 6]))


# a request that changes something, and another one that may not have its id
REPEATED = {
    "Step": lambda bench: (pb.StepRequest(steps=2), dict(steps=3)),
    "WriteVariables": lambda bench: (values_request(bench), dict(values=common_pb2.Values(values=[7]))),
    "UpdateSimulation": lambda bench: (pb.UpdateSimulationRequest(display_name="renamed"), dict(display_name="other")),
    "CreateSnapshot": lambda bench: (pb.CreateSnapshotRequest(display_name="a"), dict(display_name="b")),
    "RestoreSnapshot": lambda bench: (pb.RestoreSnapshotRequest(snapshot=saved(bench)), dict(snapshot="another")),
    "DeleteSnapshot": lambda bench: (pb.DeleteSnapshotRequest(snapshot=saved(bench)), dict(snapshot="another")),
    "ResetSimulation": lambda bench: (pb.ResetSimulationRequest(), None),
    "Interrupt": lambda bench: (pb.InterruptRequest(), None),
}


def saved(bench):
    return bench.call("CreateSnapshot").snapshot.name


def repeats(method):
    """The same request again gets the reply of the first and changes nothing, whatever has happened since."""
    def check(bench):
        bench.call("Step", steps=1)
        request, other = REPEATED[method](bench)
        request.simulation, request.request_id = bench.name, f"{method} once"
        first = bench.call(method, request)
        if method != "Step":
            bench.call("Step", steps=1)  # what the repeat must leave alone
        before = bench.standing()
        require(bench.call(method, request) == first, f"the repeated {method} has another reply")
        require(bench.standing() == before, f"the repeated {method} was done again")
        if other is not None:
            bench.refused("request_id", lambda: bench.call(method, request, **other))
        request.request_id = "x" * 129
        bench.refused("request_id", lambda: bench.call(method, request))
    return check


def repeated_step_is_done_once(bench):
    request = pb.StepRequest(simulation=bench.name, steps=2, request_id="two")
    replies = [bench.call("Step", request) for _ in range(3)]
    require([r.step for r in replies] == [2, 2, 2], f"three times the same request for two steps leads to {[r.step for r in replies]}")
    require(bench.call("Step", pb.StepRequest(simulation=bench.name, steps=2)).step == 4, "without an id a repeat is done again")


def repeated_stream(bench):
    request = pb.StepRequest(simulation=bench.name, steps=2, request_id="two")
    steps = [reply.step.step for reply in bench.stub.StepStream(iter([request, request]), timeout=WAIT)]
    require(steps == [2, 2] and bench.call("Step", request).step == 2, f"an id again on a stream, then in a call: {steps}")


def repeated_creation(bench):
    first = bench.create("creation").simulation.name
    try:
        require(bench.create("creation").simulation.name == first, "the repeated creation makes a second simulation")
        chunks = [pb.UploadRequest(header=bench.inline("creation").header), pb.UploadRequest(chunk=bench.inline().files[0])]
        try:
            again = bench.stub.CreateSimulation(iter(chunks), timeout=6 * WAIT).simulation.name
        except grpc.RpcError as error:
            raise Wrong(f"a creation that is repeated as a stream is {error.code()}") from None
        require(again == first, "the creation repeated as a stream makes a second simulation")
        bench.refused("request_id", lambda: bench.create("creation", display_name="another"))
    finally:
        bench.delete(first)


def repeated_fork(bench):
    request = pb.ForkSimulationRequest(simulation=bench.name, options=pb.CreateOptions(request_id="fork"))
    first = bench.call("ForkSimulation", request).simulation.name
    try:
        require(bench.call("ForkSimulation", request).simulation.name == first, "the repeated fork makes a second branch")
        bench.refused("request_id", lambda: bench.call("ForkSimulation", request, options=pb.CreateOptions(display_name="another")))
    finally:
        bench.delete(first)


def repeated_import(bench):
    data = bench.state()

    def send(**fields):
        header = pb.ImportSnapshotHeader(simulation=bench.name, request_id="import", **fields)
        return bench.stub.ImportSnapshot(iter([pb.ImportSnapshotRequest(header=header), pb.ImportSnapshotRequest(data=data)]), timeout=WAIT)

    first = send()
    require(send() == first and len(bench.call("ListSnapshots").snapshots) == 1, "the repeated import makes a second snapshot")
    bench.refused("request_id", lambda: send(restore=True))


def repeated_end(bench):
    for _ in range(2):
        bench.call("DeleteSimulation", request_id="end")
    try:
        bench.call("DeleteSimulation", request_id="another")
    except grpc.RpcError as error:
        require(error.code() == grpc.StatusCode.NOT_FOUND, f"the end of what is gone is {error.code()}")
    else:
        raise Wrong("what is gone can be deleted again under another id")


def refused_then_done(bench):
    """Only what went well is remembered."""
    request = pb.StepRequest(simulation=bench.name, steps=1, request_id="later", expected_step=1)
    try:
        bench.call("Step", request)
    except grpc.RpcError as status:
        error = errors.from_rpc_error(status)
        require(error.reason == "WRONG_STEP" and error.metadata.get("step") == "0", f"a wrong `expected_step` is [{error.reason}]")
    else:
        raise Wrong("a wrong `expected_step` is taken")
    bench.call("Step", steps=1)
    require(bench.call("Step", request).step == 2, "a refused request is not tried anew with its id")


# ---------------------------------------------------------------- pages

def all_pages(bench, method, most, **fields):
    """The pages of a reply, each fetched with the token of the one before."""
    pages, token = [], ""
    for _ in range(10000):
        page = bench.call(method, page_size=most, page_token=token, **fields)
        pages.append(page)
        token = page.next_page_token
        if not token:
            return pages
    raise Wrong(f"{method}: the pages do not end")


def described_pages(bench):
    whole = bench.call("DescribeSimulation", page_size=100000).model
    pages = all_pages(bench, "DescribeSimulation", 3)
    sizes = [len(p.model.nodes) + len(p.model.elements) + len(p.model.variables) for p in pages]
    require(len(pages) > 2 and max(sizes) <= 3, f"pages of at most 3 have {sizes}")
    for name in ("nodes", "elements", "variables"):
        parts = list(itertools.chain(*(getattr(p.model, name) for p in pages)))
        require(parts == list(getattr(whole, name)), f"the pages' {name} are not those of the whole")
    require(sum(len(p.model.ports) for p in pages) == len(whole.ports), "ports are told more than once")


def matrix(pages, name):
    """Entries of a matrix whose parts are on pages, by place."""
    entries, at = {}, 0
    for part in (getattr(page, name) for page in pages):
        for k, value in enumerate(part.values):
            if part.sparse:
                entries[part.row_indices[k], part.column_indices[k]] = value
            else:
                entries[divmod(at + k, part.columns)] = value
        at += len(part.values)
    return entries


def linearized_pages(bench):
    for descriptor in (False, True):
        outputs = [bench.variables()["node.structural.1.X"].handle]
        fields = dict(descriptor_form=descriptor, inputs=[bench.variables()[LOAD].handle], outputs=outputs)
        whole, pages = [bench.call("Linearize", page_size=1000000, **fields)], all_pages(bench, "Linearize", 50, **fields)
        require(len(pages) > 2, "50 numbers a page give no pages")
        for name in "abcde":
            require(matrix(pages, name) == matrix(whole, name), f"the pages' {name} is not that of the whole")
        names = list(itertools.chain(*(page.state_names for page in pages)))
        require(names == list(whole[0].state_names), "the pages' names are not those of the whole")


def eigenvalue_pages(bench):
    whole = bench.call("ComputeEigenvalues", page_size=1000000, eigenvectors=True)
    pages = all_pages(bench, "ComputeEigenvalues", 20, eigenvectors=True)
    require(len(pages) > 1 and list(itertools.chain(*(p.real for p in pages))) == list(whole.real), "the pages' eigenvalues are not those of the whole")
    for name in ("vectors_real", "vectors_imaginary"):
        require(matrix(pages, name) == matrix([whole], name), f"the pages' {name} are not those of the whole")


def listed_pages(bench):
    more = [bench.create(uuid.uuid4().hex).simulation.name for _ in range(3)]
    try:
        request = pb.ListSimulationsRequest(page_size=1)
        names = []
        while True:
            page = bench.stub.ListSimulations(request, timeout=WAIT)
            require(len(page.simulations) <= 1, f"a page of one has {len(page.simulations)}")
            names += [s.name for s in page.simulations]
            request.page_token = page.next_page_token
            if not request.page_token:
                break
        require(len(names) == len(set(names)) and {bench.name, *more} <= set(names), "the pages of the list have not each simulation once")
    finally:
        for name in more:
            bench.delete(name)


# ---------------------------------------------------------------- reset

def reset(bench):
    initial = bench.state()
    kept = saved(bench)
    bench.call("WriteVariables", values_request(bench), simulation=bench.name)
    bench.call("Step", steps=5)
    moved = bench.call("Step", steps=1, outputs=[bench.variables()["node.structural.1.X"].handle])
    info = bench.call("ResetSimulation").simulation
    require(info.step == 0 and info.time == 0 and info.state == pb.SIMULATION_STATE_READY, f"after a reset: {info}")
    require(bench.state() == initial, "the state after a reset is not the initial one, inputs included")
    require([s.name for s in bench.call("ListSnapshots").snapshots] == [kept], "a reset does not keep the snapshots")
    bench.call("WriteVariables", values_request(bench), simulation=bench.name)
    bench.call("Step", steps=5)
    again = bench.call("Step", steps=1, outputs=[bench.variables()["node.structural.1.X"].handle])
    require(again.outputs == moved.outputs and again.step == 6, "the run after a reset is another one")


# ---------------------------------------------------------------- wrong fields

def until(**wrong):
    return pb.Condition(**{"comparison": pb.COMPARISON_GREATER, "threshold": 1e9, **wrong})


WRONG = {
    "step_size": ("Step", [dict(step_size=x) for x in (0.0, -1.0, NAN, math.inf, 1e-30)]),
    "steps": ("Step", [dict(steps=-1)]), "until_time": ("Step", [dict(until_time=NAN), dict(until_time=math.inf, exact=True)]),
    "exact": ("Step", [dict(exact=True)]), "until.locate_within": ("Step", [dict(until=until(locate_within=x)) for x in (0.0, -1.0, NAN, 1e-30)]),
    "until.comparison": ("Step", [dict(until=until(comparison=x)) for x in (0, 77)]), "until.threshold": ("Step", [dict(until=until(threshold=NAN))]),
    "until.element": ("Step", [dict(until=until(element=x)) for x in (-1, 999)]),
    "page_size": ("DescribeSimulation", [dict(page_size=x) for x in (0, -1)]), "page_token": ("Linearize", [dict(page_token=x) for x in ("?", "9.9")]),
    "count": ("ComputeEigenvalues", [dict(count=x) for x in (0, -1)]), "shift": ("ComputeEigenvalues", [dict(shift=NAN)]),
    "minimum_step_size": ("UpdateSimulation", [dict(minimum_step_size=x) for x in (0.0, -1.0, NAN)]),
    "grants.identity": ("UpdateSimulation", [dict(grants=pb.Grants(grants=[pb.Grant(identity=x, right=1)])) for x in ("", "nobody", "token:", "cert:")]),
    "grants.right": ("UpdateSimulation", [dict(grants=pb.Grants(grants=[pb.Grant(identity="*", right=x)])) for x in (0, 77)]),
    "grants.ports": ("UpdateSimulation", [dict(grants=pb.Grants(grants=[pb.Grant(identity="*", right=pb.RIGHT_COUPLE, ports=["none"])]))]),
}
WRONG_OPTIONS = {
    "lease": [dict(lease={"seconds": x}) for x in (0, -1)], "pace.rate": [dict(pace=pb.Pace(rate=x)) for x in (0.0, -1.0, NAN, math.inf)],
    "durability": [dict(durability=77)], "symbols": [dict(symbols={"x": pb.SymbolValue()})],
    "units.length": [dict(units=common_pb2.UnitSystem(length=x, mass="kg", time="s")) for x in ("", "furlong", "kg")],
    "units.mass": [dict(units=common_pb2.UnitSystem(length="m", mass=x, time="s")) for x in ("", "m")],
    "units.force": [dict(units=common_pb2.UnitSystem(length="m", force="kg", time="s"))],
    "units.time": [dict(units=common_pb2.UnitSystem(length="m", mass="kg", time=x)) for x in ("", "m")],
    "ports.name": [dict(ports=[types.PortDefinition(kind=1, node_labels=[1])])],
    "offsets": [dict(ports=[types.PortDefinition(name="p", kind=1, node_labels=[1], offsets=x)]) for x in ([1.0], [0.0, NAN, 0.0])],
}


def wrong(field):
    def check(bench):
        method, cases = WRONG[field]
        for case in cases:
            bench.refused(field, lambda: bench.call(method, **case))
    return check


def wrong_option(field):
    def check(bench):
        for case in WRONG_OPTIONS[field]:
            count = len(bench.stub.ListSimulations(pb.ListSimulationsRequest(page_size=1000), timeout=WAIT).simulations)
            bench.refused(field, lambda: bench.create("", **case))
            now = len(bench.stub.ListSimulations(pb.ListSimulationsRequest(page_size=1000), timeout=WAIT).simulations)
            require(now == count, f"the refused `{field}` has left a simulation")
    return check


def units(bench):
    """A declaration changes names, not numbers."""
    told = bench.create("", units=MILLIMETRES).simulation
    try:
        model = bench.call("DescribeSimulation", pb.DescribeSimulationRequest(simulation=told.name, page_size=100000)).model
        names = {v.name: v.unit for v in model.variables}
        require(model.units == told.units == MILLIMETRES, "the units are not told")
        require((names["node.structural.1.X"], names[LOAD]) == ("mm", "N, N mm"), f"units are named {names['node.structural.1.X']}, {names[LOAD]}")
        require(told.model_digest == bench.info.model_digest, "the declaration of units changes the digest")
        undeclared = bench.variables()["node.structural.1.X"]
        require((undeclared.unit, undeclared.si_unit) == ("deck unit of length", "m"), f"undeclared units are {undeclared.unit}, {undeclared.si_unit}")
    finally:
        bench.delete(told.name)


CHECKS = {
    **{f"repeated {method}": repeats(method) for method in REPEATED},
    "repeated steps are done once": repeated_step_is_done_once, "repeats on a stream": repeated_stream, "repeated creation": repeated_creation,
    "repeated fork": repeated_fork, "repeated import": repeated_import, "repeated end": repeated_end, "refused, then done": refused_then_done,
    "pages of a description": described_pages, "pages of a linearization": linearized_pages, "pages of eigenvectors": eigenvalue_pages,
    "pages of the list": listed_pages, "reset": reset, "units": units,
    **{f"wrong {field}": wrong(field) for field in WRONG}, **{f"wrong option {field}": wrong_option(field) for field in WRONG_OPTIONS},
}


def check_calls(address, interceptors=(), only=None):
    """What is wrong by check; empty: nothing. `only`: names of checks."""
    found = {}
    for name in only or CHECKS:
        try:
            with Bench(address, interceptors) as bench:
                CHECKS[name](bench)
        except (Wrong, grpc.RpcError) as error:
            found[name] = str(error)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("address")
    found = check_calls(parser.parse_args().address)
    for name in CHECKS:
        print(f"{'FAILED' if name in found else 'ok':7} {name}{': ' + found[name] if name in found else ''}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
