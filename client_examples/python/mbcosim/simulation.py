"""Simulations on the server: step, read, write, save, restore, watch."""
import dataclasses
import queue
import uuid

import grpc
import numpy as np

from mbcosim.v1 import common_pb2, simulations_pb2 as pb, telemetry_pb2

from .coupling import Peer
from .errors import StepFailed, Unavailable, translated

_ATTEMPTS = 3  # of a step whose reply was lost on the way; the server applies it once
_POLICIES = {"block": telemetry_pb2.OVERFLOW_POLICY_BLOCK, "drop_oldest": telemetry_pb2.OVERFLOW_POLICY_DROP_OLDEST,
             "decimate": telemetry_pb2.OVERFLOW_POLICY_DECIMATE}


def _matrix(message):
    """`mbcosim.v1.Matrix` as a numpy array."""
    if not message.sparse:
        return np.array(message.values).reshape(message.rows, message.columns)
    full = np.zeros((message.rows, message.columns))
    full[list(message.row_indices), list(message.column_indices)] = message.values
    return full


@dataclasses.dataclass
class StepResult:
    """What an advance did."""
    outcome: str            # "ACCEPTED", "FINISHED", "INTERRUPTED", ...
    steps_done: int
    step: int               # number of the last accepted step
    time: float             # its time [s]
    iterations: int         # linear solutions in the last step
    total_iterations: int
    residual_error: float
    solver_seconds: float
    values: dict            # outputs by name, numpy arrays or floats
    reply: pb.StepReply     # all the server said


class Simulation:
    """A simulation. As a context manager it is deleted from the server at the end (unless it was attached)."""

    def __init__(self, server, info, diagnostics, printed, owned=True):
        self._server = server
        self._stub = server.simulations
        self._owned = owned
        self._variables = None
        self.name = info.name
        self.info = info
        self.diagnostics = diagnostics
        self.printed = printed
        self.step_number, self.time = info.step, info.time_s

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self._owned:
            self.delete()

    def _call(self, method, request, **options):
        with translated():
            return method(request, metadata=self._server.metadata, **options)

    # ---------------------------------------------------------------- variables

    @property
    def variables(self):
        """`mbcosim.v1.Variable` by name."""
        if self._variables is None:
            self._variables = {v.name: v for v in self.describe().variables}
        return self._variables

    def describe(self):
        """`mbcosim.v1.ModelDescription`: nodes, elements, variables."""
        return self._call(self._stub.DescribeSimulation, pb.DescribeSimulationRequest(name=self.name))

    def handles(self, names):
        """Integer handles of variables, for calls on the hot path."""
        return [self._variable(name).handle for name in names]

    def _variable(self, name):
        try:
            return self.variables[name]
        except KeyError:
            raise KeyError(f"no variable is named {name!r}; see Simulation.variables") from None

    def read(self, names):
        """Values at the last accepted step, by name."""
        request = pb.ReadVariablesRequest(simulation=self.name, handles=self.handles(names))
        return self.split(names, self._call(self._stub.ReadVariables, request).values)

    def write(self, values):
        """Sets inputs, by name."""
        self._call(self._stub.WriteVariables, pb.WriteVariablesRequest(simulation=self.name, values=self.pack(values)))

    def __getitem__(self, name):
        return self.read([name])[name]

    def __setitem__(self, name, value):
        self.write({name: value})

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

    def step(self, count=1, *, inputs=None, outputs=()):
        """Takes `count` steps. Raises StepFailed when one does not converge."""
        return self._advance(pb.StepRequest(steps=count), inputs, outputs)

    def run_until(self, time, *, inputs=None, outputs=(), progress=None):
        """Steps until `time` [s] or the deck's end. `progress(RunProgress)` is called about twice a second."""
        request = pb.StepRequest(until_time_s=time)
        if progress is None:
            return self._advance(request, inputs, outputs)
        run = pb.RunRequest(step=self._fill(request, inputs, outputs))
        done = None
        with translated():
            for message in self._stub.Run(run, metadata=self._server.metadata):
                if message.HasField("progress"):
                    progress(message.progress)
                else:
                    done = message.done
        return self.result(done, outputs)

    def interrupt(self):
        """Stops whatever advances this simulation, from any thread or client."""
        return self._call(self._stub.Interrupt, pb.InterruptRequest(name=self.name)).was_stepping

    def _fill(self, request, inputs, outputs):
        request.simulation = self.name
        if inputs:
            request.inputs.CopyFrom(self.pack(inputs))
        request.outputs.extend(self.handles(outputs))
        return request

    def _advance(self, request, inputs, outputs):
        self._fill(request, inputs, outputs)
        request.request_id = uuid.uuid4().hex
        for attempt in range(_ATTEMPTS):
            try:
                return self.result(self._call(self._stub.Step, request), outputs)
            except Unavailable:
                if attempt + 1 == _ATTEMPTS:
                    raise
        raise AssertionError("not reached")

    def result(self, reply, outputs=()):
        """A reply as a StepResult; raises StepFailed when the reply tells a failure."""
        self.step_number, self.time = reply.step, reply.time_s
        outcome = pb.StepOutcome.Name(reply.outcome)[len("STEP_OUTCOME_"):]
        result = StepResult(outcome, reply.steps_done, reply.step, reply.time_s, reply.iterations, reply.total_iterations,
                            reply.residual_error, reply.solver_seconds, self.split(outputs, reply.outputs), reply)
        if reply.HasField("failure"):
            reason = common_pb2.Reason.Name(reply.failure.reason)[len("REASON_"):]
            error = StepFailed(reply.failure.message, None, reason)
            error.failure, error.result = reply.failure, result
            raise error
        return result

    def stepper(self, outputs=(), inputs=()):
        """An open stream for stepping with the least delay; see Stepper."""
        return Stepper(self, outputs, inputs)

    # ---------------------------------------------------------------- states

    def snapshot(self, name=""):
        """Saves the state."""
        request = pb.CreateSnapshotRequest(simulation=self.name, display_name=name)
        return Snapshot(self, self._call(self._stub.CreateSnapshot, request))

    def snapshots(self):
        """All saved states."""
        reply = self._call(self._stub.ListSnapshots, pb.ListSnapshotsRequest(simulation=self.name))
        return [Snapshot(self, info) for info in reply.snapshots]

    def restore(self, snapshot):
        """Goes to a saved state."""
        self.info = self._call(self._stub.RestoreSnapshot, pb.RestoreSnapshotRequest(name=snapshot.name))
        self.step_number, self.time = self.info.step, self.info.time_s

    # ---------------------------------------------------------------- analysis

    def eigenvalues(self, count=0, *, shift_hz=0.0, vectors=False):
        """Eigenvalues [1/s] about the current state, nearest to `shift_hz` first; 0: all finite ones. With `vectors` also
        the eigenvectors, one a column."""
        reply = self._call(self._stub.ComputeEigenvalues, pb.ComputeEigenvaluesRequest(
            simulation=self.name, count=count, shift_hz=shift_hz, eigenvectors=vectors))
        values = np.array(reply.real) + 1j * np.array(reply.imaginary)
        return (values, _matrix(reply.vectors_real) + 1j * _matrix(reply.vectors_imaginary)) if vectors else values

    def linearize(self, inputs=(), outputs=()):
        """State space matrices A, B, C, D about the current state, for variables by name."""
        reply = self._call(self._stub.Linearize, pb.LinearizeRequest(
            simulation=self.name, inputs=self.handles(inputs), outputs=self.handles(outputs)))
        return tuple(_matrix(m) for m in (reply.a, reply.b, reply.c, reply.d))

    def linearize_descriptor(self, inputs=(), outputs=()):
        """Matrices E, A, B, C, D of E dx/dt = A x + B u, y = C x + D u with all unknowns of the model."""
        reply = self._call(self._stub.Linearize, pb.LinearizeRequest(
            simulation=self.name, inputs=self.handles(inputs), outputs=self.handles(outputs), descriptor_form=True))
        return tuple(_matrix(m) for m in (reply.e, reply.a, reply.b, reply.c, reply.d))

    def export_state(self):
        """The current state as bytes."""
        return self._export(pb.ExportSnapshotRequest(simulation=self.name))

    def _export(self, request):
        with translated():
            return b"".join(part.data for part in self._stub.ExportSnapshot(request, metadata=self._server.metadata))

    def import_state(self, data, *, restore=True, name=""):
        """Adds a saved state from bytes and, with `restore`, goes to it."""
        def messages():
            yield pb.ImportSnapshotRequest(
                header=pb.ImportSnapshotHeader(simulation=self.name, display_name=name, restore=restore))
            for start in range(0, len(data), 1 << 20):
                yield pb.ImportSnapshotRequest(data=data[start:start + (1 << 20)])

        snapshot = Snapshot(self, self._call(self._stub.ImportSnapshot, messages()))
        if restore:
            self.step_number, self.time = snapshot.step, snapshot.time
        return snapshot

    def fork(self, snapshot=None, *, name="", ports=()):
        """A new simulation at a saved state or the current one, sharing the model."""
        request = pb.ForkSimulationRequest(options=pb.CreateOptions(display_name=name, ports=ports,
                                                                   request_id=uuid.uuid4().hex))
        if snapshot is None:
            request.simulation = self.name
        else:
            request.snapshot = snapshot.name
        reply = self._call(self._stub.ForkSimulation, request)
        return Simulation(self._server, reply.simulation, [], "")

    def refresh(self):
        """Asks the server where the simulation stands."""
        self.info = self._call(self._stub.GetSimulation, pb.GetSimulationRequest(name=self.name))
        self.step_number, self.time = self.info.step, self.info.time_s
        return self.info

    def update(self, *, name=None, policy=None, minimum_step=None):
        """Changes choices made at creation; see Server.load_bundle."""
        request = pb.UpdateSimulationRequest(name=self.name)
        if name is not None:
            request.display_name = name
        if policy is not None:
            request.non_convergence_policy = pb.NonConvergencePolicy.Value("NON_CONVERGENCE_POLICY_" + policy.upper())
        if minimum_step is not None:
            request.minimum_step_s = minimum_step
        self.info = self._call(self._stub.UpdateSimulation, request)
        return self.info

    def record(self):
        """All that crossed the ports so far, as bytes for `mbcosim replay`. The simulation must have been created with `record`."""
        with translated():
            return b"".join(part.data for part in self._stub.GetRecord(pb.GetRecordRequest(name=self.name),
                                                                       metadata=self._server.metadata))

    def delete(self):
        """Ends the simulation."""
        self._call(self._stub.DeleteSimulation, pb.DeleteSimulationRequest(name=self.name))

    def couple(self, port, answer=None, **options):
        """Attaches a peer to a port; see coupling.Peer."""
        return Peer(self, port, answer, **options)

    def subscribe(self, names, *, every=1, policy="drop_oldest", buffer=1024):
        """Samples of variables every so many steps, whoever advances; see Subscription."""
        return Subscription(self, list(names), every, policy, buffer)


class Snapshot:
    """A saved state of a simulation."""

    def __init__(self, simulation, info):
        self._simulation = simulation
        self.name, self.step, self.time, self.display_name = info.name, info.step, info.time_s, info.display_name
        self.size_bytes = info.size_bytes

    def restore(self):
        """Goes to this state."""
        self._simulation.restore(self)

    def export(self):
        """The state as bytes."""
        return self._simulation._export(pb.ExportSnapshotRequest(snapshot=self.name))

    def delete(self):
        """Forgets the state."""
        self._simulation._call(self._simulation._stub.DeleteSnapshot, pb.DeleteSnapshotRequest(name=self.name))


class Stepper:
    """Steps on one open stream: one message each way per step.

        with simulation.stepper(outputs=["node.structural.1.X"]) as stepper:
            for _ in range(1000):
                x = stepper.step().values["node.structural.1.X"]
    """

    def __init__(self, simulation, outputs, inputs):
        self._simulation, self._outputs = simulation, list(outputs)
        self._requests = queue.SimpleQueue()
        self._request = pb.StepRequest(simulation=simulation.name, outputs=simulation.handles(outputs))
        self._inputs = list(inputs)
        self._request.inputs.handles.extend(simulation.handles(self._inputs))
        self._replies = simulation._stub.StepStream(iter(self._requests.get, None), metadata=simulation._server.metadata)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def step(self, values=None, count=1):
        """Takes `count` steps; `values`: numbers of the stepper's inputs, one variable after the other."""
        request = pb.StepRequest()
        request.CopyFrom(self._request)
        request.steps = count
        if self._inputs:
            request.inputs.values.extend(np.ravel(np.asarray(values, float)))
        self._requests.put(request)
        with translated():
            reply = next(self._replies)
        return self._simulation.result(reply, self._outputs)

    def close(self):
        """Ends the stream."""
        self._requests.put(None)
        for _ in self._replies:
            pass


class Subscription:
    """Samples as they come: iterate over (step, time, values by name). Close it, or use it as a context manager.

    `dropped` counts the samples that the server dropped because they were not read in time.
    """

    def __init__(self, simulation, names, every, policy, buffer):
        self._simulation, self._names = simulation, names
        request = telemetry_pb2.SubscribeRequest(simulation=simulation.name, handles=simulation.handles(names), every=every,
                                                 policy=_POLICIES[policy], buffer_samples=buffer)
        self._stream = simulation._server.telemetry.Subscribe(request, metadata=simulation._server.metadata)
        self.dropped = 0
        with translated():
            next(self._stream)  # the server's word that no step is missed from now on

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __iter__(self):
        try:
            for batch in self._stream:
                self.dropped = batch.total_dropped
                for sample in batch.samples:
                    yield sample.step, sample.time_s, self._simulation.split(self._names, sample.values)
        except grpc.RpcError as error:
            if error.code() != grpc.StatusCode.CANCELLED:
                with translated():
                    raise

    def close(self):
        """Ends the subscription."""
        self._stream.cancel()
