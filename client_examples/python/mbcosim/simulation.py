"""Simulations on the server: step, read, write, save, restore, watch. Every call takes `timeout=` [s]."""
from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Optional, TypeVar

import grpc
import numpy.typing as npt

from mbcosim.v1 import common_pb2, simulations_pb2 as pb, telemetry_pb2

from .analysis import Analysis
from .calls import Condition, SimulationCalls, SnapshotCalls, StepResult, Values, real_numbers
from .coupling import Answer, Peer
from .errors import Unavailable, translated
from .histories import Histories
from .objects import ModelObjects, reading
from .rpc import PARTING, USUAL, Blocking, Call, blocking, bounded, checked_timeout, fill_duration, parting, runs_calls, until_cancelled
from .stepping import SharedStream, StepLine
from .words import each_name, pick

Self = TypeVar("Self")
_POLICIES = {"block": telemetry_pb2.OVERFLOW_POLICY_BLOCK, "drop_oldest": telemetry_pb2.OVERFLOW_POLICY_DROP_OLDEST,
             "decimate": telemetry_pb2.OVERFLOW_POLICY_DECIMATE}


def subscribe_request(simulation: SimulationCalls[Any], handles: Iterable[int], every: int, policy: str,
                      buffer: int, minimum_interval: Optional[float]) -> telemetry_pb2.SubscribeRequest:
    """`mbcosim.v1.SubscribeRequest`."""
    request = telemetry_pb2.SubscribeRequest(simulation=simulation.name, handles=handles, every=every, policy=pick(_POLICIES, policy, "policy"),
                                             buffer_samples=buffer)
    if minimum_interval is not None:
        fill_duration(request.minimum_interval, minimum_interval, "minimum_interval")
    return request


@runs_calls(blocking)
class Snapshot(Blocking, SnapshotCalls):
    """A saved state of a simulation. As a context manager: at the end of the block the simulation goes back to it, and it is forgotten."""

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(self, kind: object = None, raised: Optional[BaseException] = None, trace: object = None) -> None:
        self._connection.run(self._end(raised))


@runs_calls(blocking)
class Simulation(Blocking, ModelObjects, Histories, Analysis, SimulationCalls[Snapshot]):
    """A simulation. As a context manager it is deleted from the server at the end (unless it was attached)."""
    _snapshot_class = Snapshot

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._line = StepLine(self._stub, self._connection.about(self.name))
        self._through = self._line.step

    def step(self, count: int = 1, *, step_size: Optional[float] = None,  # type: ignore[override]  # of a method made by runs_calls
             until: Optional[Condition] = None, inputs: Optional[Values] = None, outputs: Iterable[str] = (),
             timeout: Optional[float] = None) -> StepResult:
        """Takes `count` steps, of `step_size` [s] each (default: the deck's), or fewer when `until`, a Condition, holds before. Raises
        StepFailed when one does not converge, or a peer rejects it."""
        names = each_name(outputs, "outputs")
        if step_size is None and until is None and timeout is None and not inputs and (request := self._quick_step(count, names)) is not None:
            return self.result(self._connection.perform(Call("Simulations/Step", request, repeatable=True, through=self._through)), names)
        result: StepResult = self._connection.run(self._steps(count, step_size, until, inputs, names, timeout))
        return result

    def _leave(self) -> None:
        self._line.close()

    @property
    def _stub(self) -> Any:
        return self._connection.stubs.simulations

    def _call(self, method: Any, request: Any) -> Any:
        with translated():
            return method(request, metadata=self._connection.about(self.name))

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(self, kind: object = None, raised: Optional[BaseException] = None, trace: object = None) -> None:
        self._connection.run(self._end(raised))

    @property
    def variables(self) -> dict[str, common_pb2.Variable]:
        """`mbcosim.v1.Variable` by name."""
        if self._description is None:
            self.describe()
        return self._known

    def __getitem__(self, name: str) -> Any:
        return reading(self.read([name])[name])

    def __contains__(self, name: object) -> bool:
        return name in self.variables

    def __iter__(self) -> Iterator[str]:
        return iter(self.variables)

    def __setitem__(self, name: str, value: npt.ArrayLike) -> None:
        self.write({name: value})

    def stepper(self, outputs: Iterable[str] = (), inputs: Iterable[str] = (), *, beside: Optional[Stepper] = None,
                timeout: Optional[float] = USUAL) -> Stepper:
        """An open stream for stepping with the least delay, or, `beside` another stepper, a place on that one's; see Stepper."""
        return Stepper(self, outputs, inputs, beside, timeout)

    def couple(self, port: str, answer: Optional[Answer] = None, **options: Any) -> Peer:
        """Attaches a peer to a port; see coupling.Peer."""
        return Peer(self, port, answer, **options)

    def subscribe(self, names: Iterable[str], *, every: int = 1, policy: str = "drop_oldest", buffer: int = 1024,
                  minimum_interval: Optional[float] = None, timeout: Optional[float] = USUAL) -> Subscription:
        """Samples of variables every so many steps, whoever advances, at least `minimum_interval` seconds of wall time apart; see Subscription."""
        return Subscription(self, each_name(names), every, policy, buffer, minimum_interval, timeout)


class Stepper:
    """Steps on an open stream: one message each way per step.

        with simulation.stepper(outputs=["node.structural.1.X"]) as stepper:
            for _ in range(1000):
                x = stepper.step().values["node.structural.1.X"]

    Many simulations of one connection (behind a proxy: of one daemon) are stepped on one stream by steppers `beside` the first:

        steppers = [simulations[0].stepper()]
        steppers += [simulation.stepper(beside=steppers[0]) for simulation in simulations[1:]]

    Steps on a stream follow each other. After an exception a stepper is over; the others go on.
    """

    def __init__(self, simulation: Simulation, outputs: Iterable[str], inputs: Iterable[str], beside: Optional[Stepper] = None,
                 timeout: Optional[float] = USUAL) -> None:
        connection = simulation._connection
        if beside is not None and (beside._stream is None or beside._stream.connection is not connection):
            raise ValueError("beside: must be a stepper of the same connection that is not over")
        self._simulation, self._outputs = simulation, each_name(outputs, "outputs")
        self._request = pb.StepRequest(simulation=simulation.name, outputs=simulation.handles(self._outputs, timeout=timeout))
        self._inputs = each_name(inputs, "inputs")
        self._request.inputs.handles.extend(simulation.handles(self._inputs, timeout=timeout))
        stream = SharedStream(connection) if beside is None else beside._stream
        assert stream is not None
        stream.join(simulation.name)
        self._stream: Optional[SharedStream] = stream

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(self, kind: object = None, raised: Optional[BaseException] = None, trace: object = None) -> None:
        with parting(raised):
            self.close()

    def step(self, values: Optional[npt.ArrayLike] = None, count: int = 1, *, step_size: Optional[float] = None,
             timeout: Optional[float] = None) -> StepResult:
        """Takes `count` steps, of `step_size` [s] each (default: the deck's); `values`: numbers of the stepper's inputs, one variable after the
        other. After a timeout the stepper is over."""
        request = pb.StepRequest()
        request.CopyFrom(self._request)
        request.steps = count
        if step_size is not None:
            request.step_size = step_size
        if self._inputs:
            request.inputs.values.extend(real_numbers(() if values is None else values).ravel())
        if self._stream is None:
            raise Unavailable("the stepper is over", grpc.StatusCode.UNAVAILABLE)
        checked_timeout(timeout)
        try:
            reply = self._stream.step(request, timeout)
        except BaseException:
            self.close()
            raise
        return self._simulation.result(reply, self._outputs)

    def close(self, *, timeout: Optional[float] = PARTING) -> None:
        """Leaves the stream; the last stepper ends it."""
        stream, self._stream = self._stream, None
        if stream is not None:
            stream.leave(timeout)


class Subscription:
    """Samples as they come: iterate over (step, time, values by name). Close it, or use it as a context manager.

    `dropped` counts the samples that the server dropped because they were not read in time.
    """

    def __init__(self, simulation: Simulation, names: list[str], every: int, policy: str, buffer: int,
                 minimum_interval: Optional[float] = None, timeout: Optional[float] = USUAL) -> None:
        self._simulation, self._names = simulation, names
        request = subscribe_request(simulation, simulation.handles(names, timeout=timeout), every, policy, buffer, minimum_interval)
        connection = simulation._connection
        self._stream = connection.stubs.telemetry.Subscribe(request, metadata=connection.about(simulation.name))
        self.dropped = 0
        with bounded(timeout, self._stream.cancel, "the subscription"), translated():
            next(self._stream)  # the server's word that no step is missed from now on

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[tuple[int, float, dict[str, Any]]]:
        for batch in until_cancelled(self._stream):
            self.dropped = batch.total_dropped
            for sample in batch.samples:
                yield sample.step, sample.time, self._simulation.split(self._names, sample.values)

    def close(self) -> None:
        """Ends the subscription."""
        self._stream.cancel()
