#!/usr/bin/env python3
"""Checks what a server promises of steps of the client's length, symbols, tables, samples, events, geometry, results, checkpoints and grants.

usage: check_services.py ADDRESS [--token TOKEN --other-token TOKEN]      exit code 0: all checks passed

Results are checked where the server writes them, checkpoints where it has a state folder, grants with the tokens of two identities, of the
role control.
"""
import argparse
import itertools
import sys
import uuid

import grpc

import check_calls
from check_server import DECK, STEP, WAIT, Wrong, require
from mbcosim import errors
from mbcosim.v1 import (common_pb2, events_pb2, events_pb2_grpc, geometry_pb2, geometry_pb2_grpc, results_pb2, results_pb2_grpc, simulations_pb2 as pb,
                        telemetry_pb2, telemetry_pb2_grpc)

X, V, LOAD = "node.structural.1.X", "node.structural.1.XP", "node.structural.1.load"
MESSAGE = 4 << 20  # [bytes] that a client takes by default
THROWN = "set: const real THROW = 1.;\n" + DECK.replace("0., 1., 0., 0.1", "0., THROW, 0., 0.1")


class Absent(Exception):
    """What the server does not offer."""


class Bearer(grpc.UnaryUnaryClientInterceptor, grpc.UnaryStreamClientInterceptor, grpc.StreamUnaryClientInterceptor):
    """Says who calls."""

    def __init__(self, token):
        self._metadata = [("authorization", f"Bearer {token}")]

    def _go_on(self, continuation, details, request):
        return continuation(details._replace(metadata=[*(details.metadata or ()), *self._metadata]), request)

    intercept_unary_unary = intercept_unary_stream = intercept_stream_unary = _go_on


class Bench(check_calls.Bench):
    """A simulation, and the calls of all services on it. `tokens`: of its owner and of somebody else."""

    def __init__(self, address, interceptors=(), tokens=()):
        self.address, self.tokens = address, tokens
        bearer = [Bearer(tokens[0])] if tokens else []
        super().__init__(address, [*interceptors, *bearer])
        channel = grpc.intercept_channel(self._channel, *interceptors, *bearer)
        self.geometry = geometry_pb2_grpc.GeometryStub(channel)
        self.telemetry = telemetry_pb2_grpc.TelemetryStub(channel)
        self.events = events_pb2_grpc.EventsStub(channel)
        self.results = results_pb2_grpc.ResultsStub(channel)

    def another(self, deck=DECK, **options):
        """A simulation of its own for a check."""
        upload = self.inline(uuid.uuid4().hex, **options)
        upload.files[0].data = deck.encode()
        return Other(self, self.stub.CreateSimulationInline(upload, timeout=6 * WAIT).simulation)

    def read(self, *names):
        known = self.variables()
        return list(self.call("ReadVariables", handles=[known[name].handle for name in names]).values)


class Other(Bench):
    """A further simulation on the bench of the first."""

    def __init__(self, bench, info):  # pylint: disable=super-init-not-called
        self.__dict__.update(vars(bench))
        self.info, self.name = info, info.name

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self.delete(self.name)
        except grpc.RpcError:
            pass  # a check may have done it


def error_of(call):
    """The error of a call that must fail."""
    try:
        call()
    except grpc.RpcError as status:
        return errors.from_rpc_error(status)
    raise Wrong("what must be refused is taken")


# ---------------------------------------------------------------- steps

def lengths(bench):
    """A step has the length asked for, two halves end where the whole one does, and the deck's length gives the deck's bits."""
    start = bench.call("CreateSnapshot").snapshot.name
    whole = bench.call("Step", steps=1, outputs=[bench.variables()[X].handle])
    require(whole.next_step_size == STEP and abs(whole.largest_step_size - (100 - STEP)) < 1e-9, f"the lengths told are {whole}")
    bench.call("RestoreSnapshot", snapshot=start)
    again = bench.call("Step", steps=1, step_size=STEP, outputs=[bench.variables()[X].handle])
    require((again.outputs, again.time) == (whole.outputs, whole.time), "a step of the deck's length, asked for, is another one")
    bench.call("RestoreSnapshot", snapshot=start)
    half = bench.call("Step", steps=2, step_size=STEP / 2, outputs=[bench.variables()[X].handle])
    require((half.step, half.step_size) == (2, STEP / 2) and abs(half.time - STEP) < 1e-12, f"two steps of half the length are {half}")
    require(all(abs(a - b) < 1e-6 for a, b in zip(half.outputs, whole.outputs)), "two steps of half the length lead elsewhere")
    bench.call("ResetSimulation")


def exact_end(bench):
    end = 2.6 * STEP
    require(bench.call("Step", until_time=end, exact=True).time == end, "an exact end is not met")
    near = bench.call("Step", until_time=5.6 * STEP)
    require(abs(near.time - end - 3 * STEP) < 1e-9, f"without `exact` the run ends at {near.time}")
    bench.call("ResetSimulation")


def located(bench):
    """The body moves with 1 m/s: where it is tells when."""
    found = bench.call("Step", steps=100, until=pb.Condition(
        handle=bench.variables()[X].handle, element=1, comparison=pb.COMPARISON_GREATER, threshold=3.4 * STEP, locate_within=STEP / 1000))
    require(found.condition_met and 0 <= found.time - 3.4 * STEP <= STEP / 1000 + 1e-9, f"the condition is located at {found.time}")
    bench.call("ResetSimulation")


def inputs_of_a_step(bench):
    load = common_pb2.Values(handles=[bench.variables()[LOAD].handle], values=[0, 0, 5, 0, 0, 0])
    bench.call("Step", steps=3, inputs=load)
    with_step = bench.state()
    bench.call("ResetSimulation")
    bench.call("WriteVariables", values=load)
    bench.call("Step", steps=3)
    require(bench.state() == with_step, "inputs of a step are not those of a write before it")
    bench.call("ResetSimulation")


def busy(bench):
    """One advances: another is ABORTED and told when to try again; who interrupts ends it between two steps."""
    with bench.another(DECK.replace("final time: 100.", "final time: 1e9")) as long:
        advancing = bench.stub.Run(pb.RunRequest(step=pb.StepRequest(simulation=long.name, until_time=1e9)), timeout=6 * WAIT)
        next(advancing)  # it is on its way
        try:
            bench.call("Step", simulation=long.name, steps=1)
        except grpc.RpcError as status:
            details = dict(status.trailing_metadata()).get("grpc-status-details-bin", b"")
            error = errors.from_rpc_error(status)
            require((error.code, error.reason) == (grpc.StatusCode.ABORTED, "SIMULATION_BUSY"), f"a busy simulation is {error.code} [{error.reason}]")
            require(b"google.rpc.RetryInfo" in details, "who finds a simulation busy is not told when to try again")
        else:
            raise Wrong("two advance one simulation at a time")
        require(bench.call("Interrupt", simulation=long.name).was_stepping, "the interrupted run is not told")
        ends = [reply.done for reply in advancing if reply.WhichOneof("content") == "done"]
        require([end.outcome for end in ends] == [pb.STEP_OUTCOME_INTERRUPTED], "an interrupted run has another outcome")
    require(not bench.call("Interrupt").was_stepping, "an interrupt finds steps where there are none")


def tables(bench):
    """A run's table has the rows that single steps give, to the bit."""
    handles = [bench.variables()[name].handle for name in (X, V)]
    singly = [bench.call("Step", steps=1, outputs=handles) for _ in range(20)]
    bench.call("ResetSimulation")
    start = list(bench.call("ReadVariables", handles=handles).values)
    steps, times, values = [], [], []
    for reply in bench.stub.Run(pb.RunRequest(step=pb.StepRequest(simulation=bench.name, steps=20), table=pb.TableRequest(handles=handles, every=3)),
                                timeout=4 * WAIT):
        require(reply.ByteSize() < MESSAGE, "a message of rows is larger than clients take")
        steps += reply.rows.steps
        times += reply.rows.times
        values += reply.rows.values
    require(steps == [0, 3, 6, 9, 12, 15, 18, 20], f"every third of 20 steps: rows of {steps}")
    require(times[1:] == [singly[k - 1].time for k in steps[1:]], "a row has another time than its step")
    require(values == start + list(itertools.chain(*(singly[k - 1].outputs for k in steps[1:]))), "rows are not what single steps give")
    bench.call("ResetSimulation")


# ---------------------------------------------------------------- what is told

def symbols(bench):
    with bench.another(THROWN) as plain, bench.another(THROWN, symbols={"THROW": pb.SymbolValue(number=2.0)}) as given:
        require((plain.read(V)[1], given.read(V)[1]) == (1.0, 2.0), "a given symbol does not take the place of the declared one")
        told = {s.name: s for s in given.call("DescribeSimulation", page_size=100000).model.symbols}["THROW"]
        require(told.given and told.constant and told.value.number == 2.0, f"the description tells of the symbol: {told}")
        require(plain.info.model_digest != given.info.model_digest, "symbols are no part of the model's digest")
    for wrong in ({"THROWN": pb.SymbolValue(number=2.0)}, {"THROW": pb.SymbolValue(text="two")}):
        error = error_of(lambda: bench.another(THROWN, symbols=wrong))
        require(error.reason == "DECK_ERROR" and error.diagnostics, f"the wrong symbol {wrong} is [{error.reason}]")


def geometry(bench):
    replies = list(bench.geometry.DescribeGeometry(geometry_pb2.DescribeGeometryRequest(simulation=bench.name), timeout=WAIT))
    require(replies[0].WhichOneof("content") == "header" and all(r.ByteSize() < MESSAGE for r in replies), "the messages of a geometry are wrong")
    nodes = {n.label: n for reply in replies for n in reply.nodes.nodes}
    elements = [e for reply in replies for e in reply.elements.elements]
    require((replies[0].header.nodes, replies[0].header.elements) == (len(nodes), len(elements)) == (2, 2), "the header counts others than there are")
    position = list(bench.call("ReadVariables", handles=[nodes[1].position_handle]).values)
    require(list(nodes[1].position) == position == bench.read(X), "a node's handle does not lead to its position")
    require(sorted(m.principal_moments[2] for e in elements for m in e.masses) == [1.0, 3.0], "the bodies' masses are not told")
    bench.refused("line_samples", lambda: list(bench.geometry.DescribeGeometry(
        geometry_pb2.DescribeGeometryRequest(simulation=bench.name, line_samples=0), timeout=WAIT)))


def samples(bench):
    """Every second step, whoever advances; the stream ends with the simulation."""
    with bench.another() as watched:
        stream = bench.telemetry.Subscribe(telemetry_pb2.SubscribeRequest(simulation=watched.name, handles=[watched.variables()[X].handle], every=2),
                                           timeout=4 * WAIT)
        next(stream)  # from now on nothing is missed
        singly = [watched.call("Step", steps=1, outputs=[watched.variables()[X].handle]) for _ in range(6)]
        watched.delete(watched.name)
        batches = list(stream)
        found = [s for batch in batches for s in batch.samples]
        require(stream.code() == grpc.StatusCode.OK, f"the end of the simulation ends the stream with {stream.code()}")
        require([s.step for s in found] == [2, 4, 6], f"every second of six steps: {[s.step for s in found]}")
        require([list(s.values) for s in found] == [list(singly[s.step - 1].outputs) for s in found], "samples are not what the steps give")
        require(len({s.sequence for s in found}) == 3 and all(b.total_dropped == 0 for b in batches), "samples are counted wrongly")


def watch(bench, name, **place):
    return bench.events.WatchEvents(events_pb2.WatchEventsRequest(simulation=name, **place), timeout=4 * WAIT)


def events(bench):
    """In order, each once, also for who comes back; until the simulation is gone."""
    with bench.another() as watched:
        stream = watch(bench, watched.name)
        first = next(stream)
        require(first.WhichOneof("content") == "started", f"the first event is `{first.WhichOneof('content')}`")
        saved = watched.call("CreateSnapshot").snapshot.name
        watched.call("RestoreSnapshot", snapshot=saved)
        early = [next(stream), next(stream)]
        stream.cancel()
        watched.call("Step", steps=5, inputs=common_pb2.Values(handles=[watched.variables()[LOAD].handle], values=[1e300, 0, 0, 0, 0, 0]))
        again = watch(bench, watched.name, after_sequence=early[-1].sequence, journal=first.started.journal)
        opened = next(again).WhichOneof("content")  # before that, the call may come after the simulation is gone
        require(opened == "started", f"the first event of who comes back is `{opened}`")
        watched.delete(watched.name)
        late = list(again)
        kinds = [event.WhichOneof("content") for event in early + late]
        require(kinds in (["snapshot", "snapshot", "step_failed", "deleted"], ["snapshot", "snapshot", "step_failed", "state_changed", "deleted"]),
                f"a life is told as {kinds}")
        numbers = [event.sequence for event in early + late]
        require(numbers == sorted(set(numbers)), f"events are numbered {numbers}")
        require(again.code() == grpc.StatusCode.OK, f"the end of the simulation ends the stream with {again.code()}")


# ---------------------------------------------------------------- files and folders

def offered(bench, **options):
    """A simulation with results or checkpoints; Absent where the server has no folder for them."""
    try:
        return bench.another(**options)
    except grpc.RpcError as status:
        if errors.from_rpc_error(status).reason in ("NO_RESULTS", "NOT_DURABLE"):
            raise Absent from None
        raise


def results(bench):
    """Files of the accepted history, in ranges too; a restore cuts them back."""
    with offered(bench, results=results_pb2.ResultOptions(formats=[results_pb2.RESULT_FORMAT_TEXT]), summed_time=True) as writing:
        def fetch(**part):
            stream = bench.results.GetResults(results_pb2.GetResultsRequest(simulation=writing.name, **{"file": "results.mov", **part}), timeout=WAIT)
            return b"".join(reply.data for reply in stream)

        writing.call("Step", steps=5)
        saved, early = writing.call("CreateSnapshot").snapshot.name, fetch()
        writing.call("Step", steps=5)
        whole = fetch()
        listed = bench.results.ListResults(results_pb2.ListResultsRequest(simulation=writing.name), timeout=WAIT)
        require({f.name: f.size_bytes for f in listed.files}.get("results.mov") == len(whole) and listed.step == 10, f"the list of files is {listed}")
        require(listed.used_bytes <= listed.quota_bytes, "more than the quota is used")
        require(fetch(offset_bytes=7, length_bytes=20) == whole[7:27] and fetch(offset_bytes=len(whole) - 3) == whole[-3:], "a range is another one")
        writing.call("RestoreSnapshot", snapshot=saved)
        require(fetch() == early and whole.startswith(early), "a restore does not cut the files back")
        writing.call("Step", steps=5)
        require(fetch() == whole, "steps that are done again leave other files")
        writing.refused("offset_bytes", lambda: fetch(offset_bytes=-1))
        for name in ("", "../results.mov", "/etc/passwd", "results.none"):
            require(error_of(lambda: fetch(file=name)).reason == "NO_SUCH_FILE", f'the file "{name}" is not refused')


def send_checkpoint(bench, data, request_id):
    parts = [pb.ImportCheckpointRequest(header=pb.ImportCheckpointHeader(request_id=request_id))]
    parts += [pb.ImportCheckpointRequest(data=data[k:k + (1 << 16)]) for k in range(0, len(data), 1 << 16)]
    return bench.stub.ImportCheckpoint(iter(parts), timeout=6 * WAIT).simulation


def exported(bench, durable):
    return b"".join(reply.data for reply in bench.stub.ExportCheckpoint(pb.ExportCheckpointRequest(simulation=durable.name), timeout=4 * WAIT))


def checkpoints(bench):
    """Bytes that go on where they were taken; an import that is repeated is done once, before and after the simulation is woken."""
    with offered(bench, durability=pb.DURABILITY_CHECKPOINT) as durable:
        durable.call("Step", steps=7)
        data = exported(bench, durable)
        request_id = uuid.uuid4().hex
        with Other(bench, send_checkpoint(bench, data, request_id)) as carried:
            require(carried.name != durable.name and carried.info.step == 7, f"the import is {carried.info}")
            require(send_checkpoint(bench, data, request_id).name == carried.name, "the repeated import makes a second simulation")
            durable.call("CreateSnapshot")
            other = exported(bench, durable)
            bench.refused("request_id", lambda: send_checkpoint(bench, other, request_id))
            require(carried.state() == durable.state(), "the imported state is another one")
            for one in (carried, durable):
                one.call("Step", steps=3)
            require(carried.state() == durable.state(), "the import goes on otherwise")
            bench.refused("request_id", lambda: send_checkpoint(bench, other, request_id))
            again = send_checkpoint(bench, data, request_id)
            require((again.name, again.step) == (carried.name, 10), "an import that is repeated late makes a second simulation")
        for wrong in (data[:-1], data[:len(data) // 2] + bytes([data[len(data) // 2] ^ 1]) + data[len(data) // 2 + 1:], b"nothing of the kind"):
            error = error_of(lambda: send_checkpoint(bench, wrong, uuid.uuid4().hex))
            require(error.code == grpc.StatusCode.DATA_LOSS and error.reason == "DAMAGED_STATE", f"a damaged checkpoint is {error.code} [{error.reason}]")


# ---------------------------------------------------------------- who may what

def grants(bench):
    """Nobody knows of a simulation; a grant opens what it names, and no more."""
    if len(bench.tokens) < 2:
        raise Absent
    with Bench(bench.address, tokens=bench.tokens[1:]) as guest:
        identity = guest.stub.GetServerInfo(pb.GetServerInfoRequest(), timeout=WAIT).identity
        reads, steps = pb.ReadVariablesRequest(simulation=bench.name), pb.StepRequest(simulation=bench.name, steps=0)

        def access():
            found = []
            for call, request in ((guest.stub.ReadVariables, reads), (guest.stub.Step, steps)):
                try:
                    call(request, timeout=WAIT)
                    found.append("OK")
                except grpc.RpcError as status:
                    found.append(errors.from_rpc_error(status).reason)
            return found

        def grant(*rights):
            bench.call("UpdateSimulation", grants=pb.Grants(grants=[pb.Grant(identity=identity, right=right) for right in rights]))

        require(access() == ["NO_SUCH_SIMULATION"] * 2, f"without a grant: {access()}")
        for right, wanted in ((pb.RIGHT_COUPLE, ["NOT_GRANTED"] * 2), (pb.RIGHT_OBSERVE, ["OK", "NOT_GRANTED"]), (pb.RIGHT_CONTROL, ["OK", "OK"])):
            grant(right)
            require(access() == wanted, f"with {pb.Right.Name(right)}: {access()}")
        error = error_of(lambda: guest.stub.DeleteSimulation(pb.DeleteSimulationRequest(simulation=bench.name), timeout=WAIT))
        require(error.reason == "NOT_GRANTED", f"who may control, deletes: [{error.reason}]")
        grant()
        require(access() == ["NO_SUCH_SIMULATION"] * 2, f"after the grant: {access()}")


def unknown_names(bench):
    """Of a simulation that does not exist, whatever is asked."""
    for method in ("GetSimulation", "DescribeSimulation", "Step", "ReadVariables", "CreateSnapshot", "ResetSimulation", "Linearize", "ForkSimulation",
                   "UpdateSimulation", "Interrupt", "DeleteSimulation"):
        error = error_of(lambda: bench.call(method, simulation="simulations/none"))
        require((error.code, error.reason) == (grpc.StatusCode.NOT_FOUND, "NO_SUCH_SIMULATION"), f"{method} of nothing is {error.code} [{error.reason}]")


def versions(bench):
    told = bench.stub.GetServerInfo(pb.GetServerInfoRequest(), timeout=WAIT).protocol
    require(told.lowest <= 2 <= told.highest and "request_ids" in told.features, f"the server speaks {told}")
    error = error_of(lambda: bench.another(protocol=common_pb2.VersionRange(lowest=1, highest=1)))
    require(error.reason == "VERSION_MISMATCH", f"a client of version 1 is [{error.reason}]")
    bench.another(protocol=common_pb2.VersionRange(lowest=2, highest=99, features=["of tomorrow"])).__exit__()


def forks(bench):
    """A branch has the state, and a life of its own."""
    bench.call("Step", steps=3)
    state = bench.state()
    with Other(bench, bench.call("ForkSimulation").simulation) as branch:
        require(branch.state() == state, "a fork has another state")
        branch.call("Step", steps=2)
        require(bench.state() == state and branch.call("GetSimulation").simulation.step == 5, "a fork and its origin are not apart")
    bench.call("ResetSimulation")


CHECKS = {check.__name__.replace("_", " "): check for check in (
    lengths, exact_end, located, inputs_of_a_step, busy, tables, symbols, geometry, samples, events, results, checkpoints, grants, unknown_names,
    versions, forks)}


def check_services(address, interceptors=(), tokens=(), only=None):
    """What is wrong by check, and the checks of what the server does not offer."""
    found, absent = {}, []
    for name in only or CHECKS:
        try:
            with Bench(address, interceptors, tokens) as bench:
                CHECKS[name](bench)
        except Absent:
            absent.append(name)
        except (Wrong, grpc.RpcError, StopIteration) as error:
            found[name] = str(error) or "a stream ends too early"
    return found, absent


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("address")
    parser.add_argument("--token", action="append", default=[], help="of the simulations' owner")
    parser.add_argument("--other-token", action="append", default=[], help="of somebody else")
    chosen = parser.parse_args()
    found, absent = check_services(chosen.address, tokens=chosen.token + chosen.other_token)
    for name in CHECKS:
        verdict = "FAILED" if name in found else "absent" if name in absent else "ok"
        print(f"{verdict:7} {name}{': ' + found[name] if name in found else ''}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
