"""What servers, simulations and snapshots can be asked: the calls of the blocking and of the asyncio client.

Each method marked with `call` is a generator that yields `rpc.Call`s; see rpc.runs_calls.
"""
import dataclasses
import uuid

import numpy as np

from mbcosim.v1 import common_pb2, reduction_pb2, simulations_pb2 as pb

from . import bundle
from .errors import StepFailed, enum_name
from .rpc import USUAL, Call, call
from .words import choice, pick, remedy


def _matrix(message):
    """`mbcosim.v1.Matrix` as a numpy array."""
    if not message.sparse:
        return np.array(message.values).reshape(message.rows, message.columns)
    full = np.zeros((message.rows, message.columns))
    full[list(message.row_indices), list(message.column_indices)] = message.values
    return full


def _policy(name):
    return choice(pb.NonConvergencePolicy, "NON_CONVERGENCE_POLICY_", name, "policy")


_COMPARISONS = {"<": pb.COMPARISON_LESS, "<=": pb.COMPARISON_LESS_OR_EQUAL, ">": pb.COMPARISON_GREATER,
                ">=": pb.COMPARISON_GREATER_OR_EQUAL}


@dataclasses.dataclass
class Condition:
    """A comparison of one number of a variable: `Condition("node.structural.1.X", "<", 0.5, element=2)`. With `locate_within` [s] the step in
    which it turns true is shortened until it ends at most so long after that."""
    variable: str
    comparison: str         # "<", "<=", ">" or ">="
    threshold: float        # in the variable's unit
    element: int = 0        # which of its numbers, row-major
    locate_within: float = None


@dataclasses.dataclass
class StepResult:
    """What an advance did."""
    outcome: str            # "ACCEPTED", "FINISHED", "INTERRUPTED", ...; one that this client does not know: "UNKNOWN_17"
    steps_done: int
    step: int               # number of the last accepted step
    time: float             # its time [s]
    step_size: float        # length of the last step [s]
    next_step_size: float   # that the deck would take [s]
    largest_step_size: float  # left until the deck's final time [s]
    preferred_step_size: float  # of the peer that rejected the step [s]; None: it did not say
    condition_met: bool     # `until` holds
    iterations: int         # linear solutions in the last step
    total_iterations: int
    residual_error: float
    solver_seconds: float
    values: dict            # outputs by name, numpy arrays or floats
    reply: pb.StepReply     # all the server said


class ServerCalls:
    """Calls that name no simulation, or make one."""

    def _make(self, info, diagnostics=(), printed="", owned=True):
        return self._simulation_class(self._connection, info, list(diagnostics), printed, owned)

    @call
    def info(self, *, timeout=USUAL):
        """`mbcosim.v1.ServerInfo`: version, limits, identity, role."""
        return (yield Call("Simulations/GetServerInfo", pb.GetServerInfoRequest(), timeout, repeatable=True))

    @call
    def load(self, deck, **options):
        """Creates a simulation from a deck on this machine and the files that it names. For options see load_bundle."""
        main, files = bundle.collect(deck)
        return (yield from self._create(pb.UploadHeader(bundle_main_file=main), files, **options))

    @call
    def load_text(self, text, **options):
        """Creates a simulation from a deck given as text. For options see load_bundle."""
        return (yield from self._create(pb.UploadHeader(bundle_main_file="deck"), {"deck": text.encode()}, **options))

    @call
    def load_bundle(self, main, files, **options):
        """Creates a simulation from files (bytes by name) whose main one is `main`.

        name          for people
        lease         seconds that the simulation lives without calls; None: the server's default
        ports         places where peers can couple: structural_port, signal_port, motion_port, modal_port
        policy        what to do when a step does not converge: "fail", "cut_step" or "accept_flagged"
        minimum_step  shortest piece of "cut_step" [s]; 0: 1/1024 of the step
        record        keeps what crosses the ports; see Simulation.record
        summed_time   time is summed from step to step as MBDyn does, instead of t0 + n h
        timeout       seconds that the call may take; None: as long as the server lives
        """
        return (yield from self._create(pb.UploadHeader(bundle_main_file=main), files, **options))

    @call
    def load_from_root(self, deck, **options):
        """Creates a simulation from a deck under the server's model root. For options see load_bundle."""
        return (yield from self._create(pb.UploadHeader(model_root_file=deck), {}, **options))

    def _create(self, header, files, *, name="", lease=None, ports=(), policy="fail", minimum_step=0.0, record=False,
                summed_time=False, timeout=None):
        header.options.request_id = uuid.uuid4().hex
        header.options.display_name = name
        header.options.ports.extend(ports)
        header.options.non_convergence_policy = _policy(policy)
        header.options.minimum_step_s = minimum_step
        header.options.record_ports = record
        header.options.summed_time = summed_time
        if lease is not None:
            header.options.lease.FromMilliseconds(int(lease * 1000))
        reply = yield Call("Simulations/CreateSimulation", bundle.requests(header, files), timeout)
        return self._make(reply.simulation, reply.diagnostics, reply.printed)

    @call
    def validate(self, deck, *, timeout=None):
        """`mbcosim.v1.ValidateModelReply` about a deck on this machine."""
        main, files = bundle.collect(deck)
        header = pb.UploadHeader(bundle_main_file=main)
        return (yield Call("Simulations/ValidateModel", bundle.requests(header, files), timeout))

    @call
    def reduce(self, job, *, progress=None, timeout=None, **options):
        """Reduces a finite element model: `job` is a job file on this machine, beside the files that it names.

        Options of the job can be given here: basis="complement", max_frequency=100. `progress(phase, fraction)` is called on the
        way. Returns (`mbcosim.v1.ReduceReport`, bytes of the FEM data file).
        """
        main, files = bundle.collect_job(job)
        header = reduction_pb2.ReduceHeader(main_file=main)
        header.options.update({name.replace("_", "-"): str(value) for name, value in options.items()})
        reports, data = [], bytearray()

        def take(reply):
            if reply.HasField("chunk"):
                data.extend(reply.chunk.data)
            elif reply.HasField("report"):
                reports.append(reply.report)
            elif progress is not None:
                progress(reply.progress.phase, reply.progress.fraction)

        yield Call("Reduction/Reduce", bundle.reduce_requests(header, files), timeout, each=take)
        return reports[-1], bytes(data)

    @call
    def list(self, *, timeout=USUAL):
        """`mbcosim.v1.SimulationInfo` of every simulation of this identity."""
        request, found = pb.ListSimulationsRequest(), []
        while True:
            reply = yield Call("Simulations/ListSimulations", request, timeout, repeatable=True)
            found += reply.simulations
            if not reply.next_page_token:
                return found
            request.page_token = reply.next_page_token

    @call
    def attach(self, name, *, timeout=USUAL):
        """A simulation that exists on the server, by its name."""
        info = yield Call("Simulations/GetSimulation", pb.GetSimulationRequest(name=name), timeout, repeatable=True)
        return self._make(info, owned=False)


class SimulationCalls:
    """Calls on one simulation, and what turns names and arrays into messages and back."""

    def __init__(self, connection, info, diagnostics, printed, owned):
        self._connection, self._owned = connection, owned
        self._known, self._description = {}, None
        self.name = info.name
        self.info = info
        self.diagnostics = diagnostics
        self.printed = printed
        self.step_number, self.time = info.step, info.time_s

    def __repr__(self):
        title = f" \"{self.info.display_name}\"" if self.info.display_name else ""
        return f"<{type(self).__name__} {self.name}{title}, step {self.step_number}, t = {self.time:g} s of {self.info.final_time_s:g} s>"

    # ---------------------------------------------------------------- variables

    @call
    def describe(self, *, timeout=USUAL):
        """`mbcosim.v1.ModelDescription`: nodes, elements, variables."""
        return (yield from self._describe(timeout))

    def _describe(self, timeout):
        self._description = yield Call("Simulations/DescribeSimulation", pb.DescribeSimulationRequest(name=self.name), timeout,
                                       repeatable=True)
        self._known.update((v.name, v) for v in self._description.variables)
        return self._description

    @call
    def handles(self, names, *, timeout=USUAL):
        """Integer handles of variables, for calls on the hot path."""
        return (yield from self._handles(names, timeout))

    def _handles(self, names, timeout=USUAL):
        if any(name not in self._known for name in names) and self._description is None:
            yield from self._describe(timeout)
        return [self._variable(name).handle for name in names]

    def _variable(self, name):
        try:
            return self._known[name]
        except KeyError:
            raise KeyError(f"no variable is named {name!r}; {remedy(name, self._known)}") from None

    @call
    def read(self, names, *, timeout=USUAL):
        """Values at the last accepted step, by name."""
        return (yield from self._read(names, timeout))

    def _read(self, names, timeout):
        request = pb.ReadVariablesRequest(simulation=self.name, handles=(yield from self._handles(names, timeout)))
        return self.split(names, (yield Call("Simulations/ReadVariables", request, timeout, repeatable=True)).values)

    @call
    def write(self, values, *, timeout=USUAL):
        """Sets inputs, by name."""
        yield from self._write(values, timeout)

    def _write(self, values, timeout):
        yield from self._handles(values, timeout)
        request = pb.WriteVariablesRequest(simulation=self.name, values=self.pack(values))
        yield Call("Simulations/WriteVariables", request, timeout, repeatable=True)

    def split(self, names, values):
        """Numbers of several variables, one after the other, as arrays by name."""
        numbers, found, at = np.fromiter(values, float, len(values)), {}, 0
        for name in names:
            variable = self._variable(name)
            part = numbers[at:at + variable.size]
            found[name] = part.reshape(tuple(variable.shape)) if variable.shape else float(part[0])
            at += variable.size
        return found

    def pack(self, values):
        """`mbcosim.v1.Values` of inputs by name."""
        packed = common_pb2.Values()
        for name, value in values.items():
            packed.handles.append(self._variable(name).handle)
            packed.values.extend(np.ravel(np.asarray(value, float)))
        return packed

    # ---------------------------------------------------------------- advancing

    @call
    def step(self, count=1, *, step_size=None, until=None, inputs=None, outputs=(), timeout=None):
        """Takes `count` steps, of `step_size` [s] each (default: the deck's), or fewer when `until`, a Condition, holds before. Raises
        StepFailed when one does not converge, or a peer rejects it."""
        request = pb.StepRequest(steps=count, step_size_s=step_size)
        return (yield from self._advance(request, until, inputs, outputs, timeout))

    @call
    def run_until(self, time, *, exact=False, step_size=None, until=None, inputs=None, outputs=(), progress=None, timeout=None):
        """Steps until `time` [s] or the deck's end; with `exact` the last step is shortened so that it ends there. `step_size` and `until` as in
        `step`. `progress(RunProgress)` is called about twice a second."""
        request = pb.StepRequest(until_time_s=time, exact=exact, step_size_s=step_size)
        if progress is None:
            return (yield from self._advance(request, until, inputs, outputs, timeout))
        yield from self._fill(request, until, inputs, outputs)
        done = []

        def take(message):
            if message.HasField("progress"):
                progress(message.progress)
            else:
                done.append(message.done)

        yield Call("Simulations/Run", pb.RunRequest(step=request), timeout, each=take)
        return self.result(done[-1], outputs)

    @call
    def interrupt(self, *, timeout=USUAL):
        """Stops whatever advances this simulation, from any thread or client."""
        return (yield Call("Simulations/Interrupt", pb.InterruptRequest(name=self.name), timeout, repeatable=True)).was_stepping

    def _fill(self, request, until, inputs, outputs):
        request.simulation = self.name
        if until is not None:
            request.until.handle, = yield from self._handles([until.variable])
            request.until.element, request.until.threshold = until.element, until.threshold
            request.until.comparison = pick(_COMPARISONS, until.comparison, "comparison")
            if until.locate_within is not None:
                request.until.locate_within_s = until.locate_within
        if inputs:
            yield from self._handles(inputs)
            request.inputs.CopyFrom(self.pack(inputs))
        request.outputs.extend((yield from self._handles(outputs)))

    def _advance(self, request, until, inputs, outputs, timeout):
        yield from self._fill(request, until, inputs, outputs)
        request.request_id = uuid.uuid4().hex
        return self.result((yield Call("Simulations/Step", request, timeout, repeatable=True)), outputs)

    def result(self, reply, outputs=()):
        """A reply as a StepResult; raises StepFailed when the reply tells a failure."""
        self.step_number, self.time = reply.step, reply.time_s
        outcome = enum_name(pb.StepOutcome, reply.outcome, "STEP_OUTCOME_")
        preferred = reply.preferred_step_size_s if reply.HasField("preferred_step_size_s") else None
        result = StepResult(outcome, reply.steps_done, reply.step, reply.time_s, reply.step_size_s, reply.next_step_size_s,
                            reply.largest_step_size_s, preferred, reply.condition_met, reply.iterations, reply.total_iterations,
                            reply.residual_error, reply.solver_seconds, self.split(outputs, reply.outputs), reply)
        if reply.HasField("failure"):
            reason = enum_name(common_pb2.Reason, reply.failure.reason, "REASON_")
            error = StepFailed(reply.failure.message, None, reason)
            error.failure, error.result = reply.failure, result
            raise error
        if outcome.startswith("UN"):  # UNKNOWN, UNSPECIFIED: no success that this client could vouch for
            error = StepFailed(f"the server tells an outcome that this client does not know: {reply.outcome}", None, outcome)
            error.result = result
            raise error
        return result

    # ---------------------------------------------------------------- states

    @call
    def snapshot(self, name="", *, timeout=USUAL):
        """Saves the state."""
        request = pb.CreateSnapshotRequest(simulation=self.name, display_name=name)
        return self._snapshot_class(self, (yield Call("Simulations/CreateSnapshot", request, timeout)))

    @call
    def snapshots(self, *, timeout=USUAL):
        """All saved states."""
        request = pb.ListSnapshotsRequest(simulation=self.name)
        reply = yield Call("Simulations/ListSnapshots", request, timeout, repeatable=True)
        return [self._snapshot_class(self, info) for info in reply.snapshots]

    @call
    def restore(self, snapshot, *, timeout=USUAL):
        """Goes to a saved state."""
        yield from self._restore(snapshot, timeout)

    def _restore(self, snapshot, timeout):
        self._stand((yield Call("Simulations/RestoreSnapshot", pb.RestoreSnapshotRequest(name=snapshot.name), timeout)))

    def _stand(self, info):
        self.info = info
        self.step_number, self.time = info.step, info.time_s
        return info

    @call
    def export_state(self, *, timeout=USUAL):
        """The current state as bytes."""
        return (yield from self._collect("Simulations/ExportSnapshot", pb.ExportSnapshotRequest(simulation=self.name), timeout))

    def _collect(self, method, request, timeout):
        """The bytes that a method streams."""
        parts = []
        yield Call(method, request, timeout, each=lambda message: parts.append(message.data))
        return b"".join(parts)

    @call
    def import_state(self, data, *, restore=True, name="", timeout=None):
        """Adds a saved state from bytes and, with `restore`, goes to it."""
        def messages():
            yield pb.ImportSnapshotRequest(
                header=pb.ImportSnapshotHeader(simulation=self.name, display_name=name, restore=restore))
            for start in range(0, len(data), 1 << 20):
                yield pb.ImportSnapshotRequest(data=data[start:start + (1 << 20)])

        snapshot = self._snapshot_class(self, (yield Call("Simulations/ImportSnapshot", messages(), timeout)))
        if restore:
            self.step_number, self.time = snapshot.step, snapshot.time
        return snapshot

    @call
    def fork(self, snapshot=None, *, name="", ports=(), timeout=None):
        """A new simulation at a saved state or the current one, sharing the model."""
        request = pb.ForkSimulationRequest(options=pb.CreateOptions(display_name=name, ports=ports,
                                                                    request_id=uuid.uuid4().hex))
        if snapshot is None:
            request.simulation = self.name
        else:
            request.snapshot = snapshot.name
        reply = yield Call("Simulations/ForkSimulation", request, timeout, repeatable=True)
        return type(self)(self._connection, reply.simulation, [], "", True)

    # ---------------------------------------------------------------- analysis

    @call
    def eigenvalues(self, count=0, *, shift_hz=0.0, vectors=False, timeout=None):
        """Eigenvalues [1/s] about the current state, nearest to `shift_hz` first; 0: all finite ones. With `vectors` also
        the eigenvectors, one a column."""
        request = pb.ComputeEigenvaluesRequest(simulation=self.name, count=count, shift_hz=shift_hz, eigenvectors=vectors)
        reply = yield Call("Simulations/ComputeEigenvalues", request, timeout, repeatable=True)
        values = np.array(reply.real) + 1j * np.array(reply.imaginary)
        return (values, _matrix(reply.vectors_real) + 1j * _matrix(reply.vectors_imaginary)) if vectors else values

    @call
    def linearize(self, inputs=(), outputs=(), *, timeout=None):
        """State space matrices A, B, C, D about the current state, for variables by name."""
        reply = yield from self._linearize(inputs, outputs, False, timeout)
        return tuple(_matrix(m) for m in (reply.a, reply.b, reply.c, reply.d))

    @call
    def linearize_descriptor(self, inputs=(), outputs=(), *, timeout=None):
        """Matrices E, A, B, C, D of E dx/dt = A x + B u, y = C x + D u with all unknowns of the model."""
        reply = yield from self._linearize(inputs, outputs, True, timeout)
        return tuple(_matrix(m) for m in (reply.e, reply.a, reply.b, reply.c, reply.d))

    def _linearize(self, inputs, outputs, descriptor, timeout):
        request = pb.LinearizeRequest(simulation=self.name, inputs=(yield from self._handles(inputs)),
                                      outputs=(yield from self._handles(outputs)), descriptor_form=descriptor)
        return (yield Call("Simulations/Linearize", request, timeout, repeatable=True))

    # ---------------------------------------------------------------- the simulation itself

    @call
    def refresh(self, *, timeout=USUAL):
        """Asks the server where the simulation stands."""
        return self._stand((yield Call("Simulations/GetSimulation", pb.GetSimulationRequest(name=self.name), timeout,
                                       repeatable=True)))

    @call
    def update(self, *, name=None, policy=None, minimum_step=None, timeout=USUAL):
        """Changes choices made at creation; see Server.load_bundle."""
        request = pb.UpdateSimulationRequest(name=self.name)
        if name is not None:
            request.display_name = name
        if policy is not None:
            request.non_convergence_policy = _policy(policy)
        if minimum_step is not None:
            request.minimum_step_s = minimum_step
        self.info = yield Call("Simulations/UpdateSimulation", request, timeout, repeatable=True)
        return self.info

    @call
    def record(self, *, timeout=None):
        """All that crossed the ports so far, as bytes for `mbcosim replay`. The simulation must have been created with `record`."""
        return (yield from self._collect("Simulations/GetRecord", pb.GetRecordRequest(name=self.name), timeout))

    @call
    def delete(self, *, timeout=USUAL):
        """Ends the simulation."""
        yield Call("Simulations/DeleteSimulation", pb.DeleteSimulationRequest(name=self.name), timeout)


class SnapshotCalls:
    """A saved state of a simulation."""

    def __init__(self, simulation, info):
        self._simulation, self._connection = simulation, simulation._connection
        self.name, self.step, self.time, self.display_name = info.name, info.step, info.time_s, info.display_name
        self.size_bytes = info.size_bytes

    def __repr__(self):
        return f"<{type(self).__name__} {self.display_name or self.name}, step {self.step}, t = {self.time:g} s, {self.size_bytes} bytes>"

    @call
    def restore(self, *, timeout=USUAL):
        """Goes to this state."""
        yield from self._simulation._restore(self, timeout)

    @call
    def export(self, *, timeout=USUAL):
        """The state as bytes."""
        return (yield from self._simulation._collect("Simulations/ExportSnapshot", pb.ExportSnapshotRequest(snapshot=self.name), timeout))

    @call
    def delete(self, *, timeout=USUAL):
        """Forgets the state."""
        yield Call("Simulations/DeleteSnapshot", pb.DeleteSnapshotRequest(name=self.name), timeout)
