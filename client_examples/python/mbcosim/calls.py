"""What servers, simulations and snapshots can be asked: the calls of the blocking and of the asyncio client.

Each method marked with `call` is a generator that yields `rpc.Call`s; see rpc.runs_calls.
"""
from __future__ import annotations

import contextlib
import dataclasses
import itertools
import os
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any, Generic, Optional, TypeVar, Union

import numpy as np
import numpy.typing as npt

from mbcosim.v1 import common_pb2, coupling_types_pb2, geometry_pb2, reduction_pb2, results_pb2, simulations_pb2 as pb

from . import bundle
from .errors import NotFound, StepFailed, TimedOut, bad_argument, enum_name
from .rpc import PARTING, USUAL, Call, Calls, call, fill_duration, parting, protocol
from .table import Rows
from .words import UnknownName, after_number, choice, each_name, needed, pick, remedy


Array = npt.NDArray[np.float64]
Values = Mapping[str, npt.ArrayLike]  # by name
Results = Union[bool, str, Iterable[str]]  # which result files
Symbol = Union[bool, float, str]
SimulationKind = TypeVar("SimulationKind", bound="SimulationCalls[Any]")
Reply = TypeVar("Reply")
SnapshotKind = TypeVar("SnapshotKind", bound="SnapshotCalls")
list_of = list  # ServerCalls has a method of that name


def real_numbers(values: npt.ArrayLike) -> Array:
    """`values` as an array of floats; TypeError for complex ones, ValueError or TypeError for what are no numbers."""
    given = np.asarray(values)
    if given.dtype.kind == "c":
        raise TypeError("complex numbers, where real ones are wanted: take their `.real`, or whatever is meant")
    return given.astype(float, copy=False)


def numbers_of(variable: common_pb2.Variable, value: npt.ArrayLike, field: str) -> Array:
    """The numbers of an input, one after the other; an error that names it and the request's `field` for what are not as many."""
    try:
        numbers = real_numbers(value).ravel()
    except TypeError as error:
        raise TypeError(f"{variable.name!r}: {error}") from None
    if numbers.size != variable.size:
        raise bad_argument(field, f"`{field}`: {variable.name!r} takes {variable.size} values, got {numbers.size}")
    return numbers


def _matrix(message: pb.Matrix) -> Array:
    """`mbcosim.v1.Matrix` as a numpy array."""
    if not message.sparse:
        return np.array(message.values).reshape(message.rows, message.columns)
    full = np.zeros((message.rows, message.columns))
    full[list(message.row_indices), list(message.column_indices)] = message.values
    return full


def _sparse(message: pb.Matrix) -> Any:
    """`mbcosim.v1.Matrix` as a matrix of SciPy."""
    matrices, shape = needed("scipy.sparse", "a sparse matrix", "scipy"), (message.rows, message.columns)
    if not message.sparse:
        return matrices.csc_matrix(_matrix(message))
    return matrices.csc_matrix((message.values, (message.row_indices, message.column_indices)), shape)


_HERE, _requests = uuid.uuid4().hex[:16], itertools.count()


def _new_id() -> str:
    """Of a request: sent again it is not done again. Processes that were forked have ids of their own."""
    return f"{_HERE}-{os.getpid():x}-{next(_requests):x}"


def grant(identity: str, right: str, ports: Iterable[str] = ()) -> pb.Grant:
    """Lets `identity` ("token:NAME", "cert:…" or "*") use a simulation: "observe", "couple" (to `ports`, or all) or "control"."""
    value: Any = choice(pb.Right, "RIGHT_", right, "right")
    return pb.Grant(identity=identity, right=value, ports=each_name(ports, "ports"))


def units(length: str, *, time: str, mass: Optional[str] = None, force: Optional[str] = None) -> common_pb2.UnitSystem:
    """A consistent system of units by names: `units("mm", mass="t", time="s")`, or the same with `force="N"` in place of the mass."""
    return common_pb2.UnitSystem(length=length, time=time, mass=mass, force=force)


def checked_units(system: Any) -> Optional[common_pb2.UnitSystem]:
    """`units` of a call; TypeError for what `units(...)` did not make."""
    if system is not None and not isinstance(system, common_pb2.UnitSystem):
        raise TypeError(f'`units` must be a system made by mbcosim.units, mbcosim.units("mm", mass="t", time="s") say, got {system!r}')
    return system


def _made(given: Iterable[Any], kind: type, expected: str) -> list_of[Any]:
    """`given` as a list of messages of a `kind`; TypeError, which says what is `expected`, for anything else."""
    try:
        found = list(given)
    except TypeError:  # one by itself
        found = [None]
    if not all(isinstance(each, kind) for each in found):
        raise TypeError(f"{expected}, got {given!r}")
    return found


def _ports(given: Iterable[coupling_types_pb2.PortDefinition]) -> list_of[coupling_types_pb2.PortDefinition]:
    return _made(given, coupling_types_pb2.PortDefinition, '`ports` must be a list of ports, [mbcosim.structural_port("tip", nodes=[2])] say')


def _grants(given: Iterable[pb.Grant]) -> list_of[pb.Grant]:
    return _made(given, pb.Grant, '`grants` must be a list of grants, [mbcosim.grant("*", "observe")] say')


def _job_option(value: object) -> str:
    """As job files of the reduction have it."""
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    return ", ".join(map(str, value)) if isinstance(value, (list_of, tuple)) else str(value)


def _symbol(value: Symbol) -> pb.SymbolValue:
    """`mbcosim.v1.SymbolValue`."""
    if isinstance(value, (bool, np.bool_)):
        return pb.SymbolValue(flag=bool(value))
    return pb.SymbolValue(text=value) if isinstance(value, str) else pb.SymbolValue(number=float(value))


def _policy(name: str) -> Any:
    return choice(pb.NonConvergencePolicy, "NON_CONVERGENCE_POLICY_", name, "policy")


def _result_options(formats: Results, quota: Optional[int]) -> results_pb2.ResultOptions:
    """`mbcosim.v1.ResultOptions`; `formats`: True (what the deck asks for), "text", "netcdf" or several of them."""
    names: list[str] = [] if isinstance(formats, bool) else [formats] if isinstance(formats, str) else list(formats)
    chosen: list[Any] = [choice(results_pb2.ResultFormat, "RESULT_FORMAT_", name, "results") for name in names]
    return results_pb2.ResultOptions(formats=chosen, quota_bytes=quota)


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
    locate_within: Optional[float] = None


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
    preferred_step_size: Optional[float]  # of the peer that rejected the step [s]; None: it did not say
    condition_met: bool     # `until` holds
    iterations: int         # linear solutions in the last step
    total_iterations: int
    residual_error: float
    solver_seconds: float
    values: dict[str, Any]  # outputs by name, numpy arrays or floats
    reply: pb.StepReply = dataclasses.field(repr=False)  # all the server said


@dataclasses.dataclass
class Geometry:
    """What a viewer needs: messages of `mbcosim.v1`, in the order of the deck."""
    header: Optional[geometry_pb2.GeometryHeader] = None
    nodes: list[geometry_pb2.NodeGeometry] = dataclasses.field(default_factory=list)
    elements: list[geometry_pb2.ElementGeometry] = dataclasses.field(default_factory=list)
    modal_points: list[geometry_pb2.ModalPoints] = dataclasses.field(default_factory=list)


class ServerCalls(Generic[SimulationKind]):
    """Calls that name no simulation, or make one."""

    _simulation_class: type[SimulationKind]
    _connection: Any

    def _make(self, info: pb.SimulationInfo, diagnostics: Iterable[common_pb2.Diagnostic] = (), printed: str = "",
              owned: bool = True) -> SimulationKind:
        return self._simulation_class(self._connection, info, list(diagnostics), printed, owned)

    @call
    def info(self, *, timeout: Optional[float] = USUAL) -> Calls[pb.GetServerInfoReply]:
        """`mbcosim.v1.GetServerInfoReply`: version, limits, identity, role."""
        reply: pb.GetServerInfoReply = yield Call("Simulations/GetServerInfo", pb.GetServerInfoRequest(), timeout, repeatable=True)
        return reply

    @call
    def load(self, /, deck: bundle.Path, **options: Any) -> Calls[SimulationKind]:
        """Creates a simulation from a deck on this machine and the files that it names. For options see load_bundle."""
        main, files = bundle.collect(deck)
        return (yield from self._create(pb.UploadHeader(bundle_main_file=main), files, **options))

    @call
    def load_text(self, /, text: Union[str, bytes], **options: Any) -> Calls[SimulationKind]:
        """Creates a simulation from a deck given as text, or as the bytes of its file. For options see load_bundle."""
        data = text.encode() if isinstance(text, str) else text
        return (yield from self._create(pb.UploadHeader(bundle_main_file="deck"), bundle.checked({"deck": data}), **options))

    @call
    def load_bundle(self, /, main: str, files: Mapping[str, bytes], **options: Any) -> Calls[SimulationKind]:
        """Creates a simulation from files (bytes by name) whose main one is `main`.

        name          for people
        lease         seconds that the simulation lives without calls; None: the server's default
        ports         places where peers can couple: structural_port, signal_port, motion_port, modal_port
        policy        what to do when a step does not converge: "fail", "cut_step" or "accept_flagged"
        minimum_step  shortest piece of "cut_step" [s]; None: 1/1024 of the step
        record        keeps what crosses the ports; see Simulation.record
        summed_time   time is summed from step to step as MBDyn does, instead of t0 + n h
        results       writes result files on the server: True (what the deck asks for), "text", "netcdf" or a list of them
        results_quota most bytes of them; None: the server's limit
        symbols       values by name in place of those that the deck declares: numbers, strings, bools
        grants        who else may use the simulation: a list of mbcosim.grant(...)
        durability    whether it outlives the server: "none", "checkpoint" or "journal"; None: "checkpoint" where the server has a state folder
        checkpoint_interval, checkpoint_steps
                      longest time [s], and steps, between two checkpoints; None: the server's, and any
        deck_sockets  serves the sockets that the deck names to the codes for which it was written, where the server allows it: True, or the longest
                      wait for a code [s]; the call ends when they have come
        padded_labels with deck_sockets: the codes pad labels of an odd number of points as MBDyn does
        units         that the deck is written in, mbcosim.units(...), where it does not tell by a card: descriptions name them, and ports
                      convert them for peers that count in others; no value changes
        optional_ports
                      steps wait for no peer of a port that has had none: its inputs are what `write` says, zero at first
        pace          seconds of the model in a second of the wall clock, 1: real time; None: as fast as it can. Late steps are counted in the replies
        timeout       seconds that the call may take; None: as long as the server lives
        """
        return (yield from self._create(pb.UploadHeader(bundle_main_file=main), bundle.checked(files), **options))

    @call
    def load_from_root(self, /, deck: str, **options: Any) -> Calls[SimulationKind]:
        """Creates a simulation from a deck under the server's model root. For options see load_bundle."""
        return (yield from self._create(pb.UploadHeader(model_root_file=deck), {}, **options))

    def _create(self, header: pb.UploadHeader, files: Mapping[str, bytes], *, name: str = "", lease: Optional[float] = None,
                ports: Iterable[coupling_types_pb2.PortDefinition] = (), policy: str = "fail", minimum_step: Optional[float] = None,
                record: bool = False, summed_time: bool = False, symbols: Optional[Mapping[str, Symbol]] = None,
                grants: Iterable[pb.Grant] = (), results: Results = False, results_quota: Optional[int] = None,
                durability: Optional[str] = None, checkpoint_interval: Optional[float] = None, checkpoint_steps: Optional[int] = None, pace: Optional[float] = None,
                deck_sockets: Union[bool, float] = False, padded_labels: bool = False, units: Optional[common_pb2.UnitSystem] = None, optional_ports: bool = False,
                timeout: Optional[float] = None) -> Calls[SimulationKind]:
        checked_units(units)
        header.options.request_id = _new_id()
        header.options.protocol.CopyFrom(protocol())
        header.options.display_name = name
        header.options.ports.extend(_ports(ports))
        header.options.non_convergence_policy = _policy(policy)
        if minimum_step is not None:
            header.options.minimum_step_size = minimum_step
        header.options.record_ports = record
        header.options.summed_time = summed_time
        header.options.optional_ports = optional_ports
        if results:
            header.options.results.CopyFrom(_result_options(results, results_quota))
        header.options.grants.extend(_grants(grants))
        for symbol, value in (symbols or {}).items():
            header.options.symbols[symbol].CopyFrom(_symbol(value))
        header.options.durability = choice(pb.Durability, "DURABILITY_", durability, "durability")
        if checkpoint_interval is not None:
            fill_duration(header.options.checkpoint_interval, checkpoint_interval, "checkpoint_interval")
        if checkpoint_steps is not None:
            header.options.checkpoint_steps = checkpoint_steps
        if units is not None:
            header.options.units.CopyFrom(units)
        if pace is not None:
            header.options.pace.rate = pace
        if deck_sockets is not False:
            header.options.deck_sockets.SetInParent()
            header.options.deck_sockets.padded_labels = padded_labels
        if deck_sockets is not False and deck_sockets is not True:
            fill_duration(header.options.deck_sockets.peer_timeout, deck_sockets, "deck_sockets.peer_timeout")
        if lease is not None:
            fill_duration(header.options.lease, lease, "lease")
        reply = yield Call("Simulations/CreateSimulation", partial(bundle.requests, header, files), timeout, repeatable=True)
        return self._make(reply.simulation, reply.diagnostics, reply.printed)

    @call
    def validate(self, deck: bundle.Path, *, timeout: Optional[float] = None) -> Calls[pb.ValidateModelReply]:
        """`mbcosim.v1.ValidateModelReply` about a deck on this machine."""
        main, files = bundle.collect(deck)
        header = pb.UploadHeader(bundle_main_file=main)
        reply: pb.ValidateModelReply = yield Call("Simulations/ValidateModel", partial(bundle.requests, header, files), timeout, repeatable=True)
        return reply

    @call
    def reduce(self, /, job: bundle.Path, *, progress: Optional[Callable[[str, float], object]] = None, timeout: Optional[float] = None,
               **options: object) -> Calls[tuple[reduction_pb2.ReduceReport, bytes]]:
        """Reduces a finite element model: `job` is a job file on this machine, beside the files that it names.

        Options of the job can be given here: basis="complement", interface=[1, 9], max_frequency=100. `progress(phase, fraction)` is called on the
        way. Returns (`mbcosim.v1.ReduceReport`, bytes of the FEM data file).
        """
        main, files = bundle.collect_job(job)
        header = reduction_pb2.ReduceHeader(main_file=main)
        header.options.update({name.replace("_", "-"): _job_option(value) for name, value in options.items()})
        reports: list[reduction_pb2.ReduceReport] = []
        data = bytearray()

        def take(reply: reduction_pb2.ReduceReply) -> None:
            if reply.HasField("chunk"):
                data.extend(reply.chunk.data)
            elif reply.HasField("report"):
                reports.append(reply.report)
            elif progress is not None:
                progress(reply.progress.phase, reply.progress.fraction)

        yield Call("Reduction/Reduce", partial(bundle.reduce_requests, header, files), timeout, each=take)
        return reports[-1], bytes(data)

    @call
    def list(self, *, timeout: Optional[float] = USUAL) -> Calls[list_of[pb.SimulationInfo]]:
        """`mbcosim.v1.SimulationInfo` of every simulation of this identity."""
        request = pb.ListSimulationsRequest()
        found: list_of[pb.SimulationInfo] = []
        while True:
            reply = yield Call("Simulations/ListSimulations", request, timeout, repeatable=True)
            found += reply.simulations
            if not reply.next_page_token:
                return found
            request.page_token = reply.next_page_token

    @call
    def attach(self, name: str, *, timeout: Optional[float] = USUAL) -> Calls[SimulationKind]:
        """A simulation that exists on the server, by its name."""
        reply = yield Call("Simulations/GetSimulation", pb.GetSimulationRequest(simulation=name), timeout, repeatable=True)
        return self._make(reply.simulation, owned=False)

    @call
    def import_checkpoint(self, data: bytes, *, name: Optional[str] = None, timeout: Optional[float] = None) -> Calls[SimulationKind]:
        """A new simulation from what `Simulation.export_checkpoint` gave, here or on another server. It lives on afterwards."""
        bundle.check_state(data)
        header = pb.ImportCheckpointHeader(request_id=_new_id(), display_name=name)

        def messages() -> Iterator[pb.ImportCheckpointRequest]:
            yield pb.ImportCheckpointRequest(header=header)
            for start in range(0, len(data), 1 << 20):
                yield pb.ImportCheckpointRequest(data=data[start:start + (1 << 20)])

        reply = yield Call("Simulations/ImportCheckpoint", messages, timeout, repeatable=True)
        return self._make(reply.simulation, owned=False)


class SimulationCalls(Generic[SnapshotKind]):
    """Calls on one simulation, and what turns names and arrays into messages and back."""

    _snapshot_class: type[SnapshotKind]
    _through: Optional[Callable[[Any], Any]] = None  # a way for steps that is quicker than calls

    def __init__(self, connection: Any, info: pb.SimulationInfo, diagnostics: list_of[common_pb2.Diagnostic], printed: str,
                 owned: bool) -> None:
        self._connection, self._owned = connection, owned
        self._known: dict[str, common_pb2.Variable] = {}
        self._description: Optional[pb.ModelDescription] = None
        self.name: str = info.name
        self.info = info
        self.diagnostics = diagnostics
        self.printed = printed
        self.step_number, self.time = info.step, info.time

    @property
    def time_unit(self) -> str:
        """As `mbcosim.v1.Variable.unit` of a time."""
        return self.info.units.time or "deck unit of time"

    @property
    def length_unit(self) -> str:
        """As `mbcosim.v1.Variable.unit` of a length."""
        return self.info.units.length or "deck unit of length"

    def _leave(self) -> None:
        """Ends what is open of it here."""

    def __repr__(self) -> str:
        title = f" \"{self.info.display_name}\"" if self.info.display_name else ""
        span = f"{self.time:g} of {self.info.final_time:g} {after_number(self.time_unit)}"
        return f"<{type(self).__name__} {self.name}{title}, step {self.step_number}, t = {span}>"

    # ---------------------------------------------------------------- variables

    @call
    def describe(self, *, timeout: Optional[float] = USUAL) -> Calls[pb.ModelDescription]:
        """`mbcosim.v1.ModelDescription`: nodes, elements, variables."""
        return (yield from self._describe(timeout))

    def _describe(self, timeout: Optional[float]) -> Calls[pb.ModelDescription]:
        request = pb.DescribeSimulationRequest(simulation=self.name)
        whole = (yield from self._pages("Simulations/DescribeSimulation", request, pb.DescribeSimulationReply(), timeout)).model
        self._known.update((v.name, v) for v in whole.variables)
        self._description = whole
        return whole

    @call
    def handles(self, names: Iterable[str], *, timeout: Optional[float] = USUAL) -> Calls[list_of[int]]:
        """Integer handles of variables, for calls on the hot path."""
        return (yield from self._handles(names, timeout))

    def _handles(self, names: Iterable[str], timeout: Optional[float]) -> Calls[list_of[int]]:
        timeout = USUAL if timeout is None else min(timeout, USUAL)  # of whatever needs them
        names = each_name(names)
        missing = [name for name in names if name not in self._known]
        if missing and self._description is None:
            request = pb.DescribeSimulationRequest(simulation=self.name, variable_names=missing)
            try:
                found: pb.DescribeSimulationReply = yield Call("Simulations/DescribeSimulation", request, timeout, repeatable=True)
            except NotFound as error:
                if error.reason != "NO_SUCH_VARIABLE":
                    raise
                yield from self._describe(timeout)  # its names help to find the one that was meant
            else:
                self._known.update((v.name, v) for v in found.model.variables)
        return [self._variable(name).handle for name in names]

    def _variable(self, name: str) -> common_pb2.Variable:
        try:
            return self._known[name]
        except KeyError:
            raise UnknownName(f"no variable is named {name!r}; {remedy(name, self._known)}") from None

    @call
    def read(self, names: Iterable[str], *, timeout: Optional[float] = USUAL) -> Calls[dict[str, Any]]:
        """Values at the last accepted step, by name."""
        return (yield from self._read(names, timeout))

    def _read(self, names: Iterable[str], timeout: Optional[float]) -> Calls[dict[str, Any]]:
        names = each_name(names)
        request = pb.ReadVariablesRequest(simulation=self.name, handles=(yield from self._handles(names, timeout)))
        return self.split(names, (yield Call("Simulations/ReadVariables", request, timeout, repeatable=True)).values)

    @call
    def write(self, values: Values, *, timeout: Optional[float] = USUAL) -> Calls[None]:
        """Sets inputs, by name."""
        yield from self._write(values, timeout)

    def _write(self, values: Values, timeout: Optional[float]) -> Calls[None]:
        yield from self._handles(values, timeout)
        request = pb.WriteVariablesRequest(simulation=self.name, values=self._pack(values, "values.values"), request_id=_new_id())
        yield Call("Simulations/WriteVariables", request, timeout, repeatable=True)

    def split(self, names: Iterable[str], values: Any) -> dict[str, Any]:
        """Numbers of several variables, one after the other, as arrays by name."""
        names, found = each_name(names), dict[str, Any]()
        if not names:
            return found
        numbers, at = np.fromiter(values, float, len(values)), 0
        for name in names:
            variable = self._variable(name)
            part = numbers[at:at + variable.size]
            found[name] = part.reshape(tuple(variable.shape)) if variable.shape else float(part[0])
            at += variable.size
        return found

    def pack(self, values: Values) -> common_pb2.Values:
        """`mbcosim.v1.Values` of inputs by name."""
        return self._pack(values, "values")

    def _pack(self, values: Values, field: str) -> common_pb2.Values:
        packed = common_pb2.Values()
        for name, value in values.items():
            variable = self._variable(name)
            packed.handles.append(variable.handle)
            packed.values.extend(numbers_of(variable, value, field))
        return packed

    # ---------------------------------------------------------------- advancing

    @call
    def step(self, count: int = 1, *, step_size: Optional[float] = None, until: Optional[Condition] = None, inputs: Optional[Values] = None,
             outputs: Iterable[str] = (), timeout: Optional[float] = None) -> Calls[StepResult]:
        """Takes `count` steps, of `step_size` [s] each (default: the deck's), or fewer when `until`, a Condition, holds before. Raises
        StepFailed when one does not converge, or a peer rejects it."""
        return (yield from self._steps(count, step_size, until, inputs, outputs, timeout))

    def _steps(self, count: int, step_size: Optional[float], until: Optional[Condition], inputs: Optional[Values], outputs: Iterable[str],
               timeout: Optional[float]) -> Calls[StepResult]:
        request = pb.StepRequest(steps=count, step_size=step_size)
        return (yield from self._advance(request, until, inputs, outputs, timeout))

    def _quick_step(self, count: int, outputs: Iterable[str]) -> Optional[pb.StepRequest]:
        """The request of a step that needs nothing to be asked before; None: it does."""
        try:
            handles = [self._known[name].handle for name in outputs]
        except KeyError:
            return None
        return pb.StepRequest(simulation=self.name, steps=count, outputs=handles, request_id=_new_id())

    @call
    def run_until(self, time: float, *, exact: bool = False, step_size: Optional[float] = None, until: Optional[Condition] = None,
                  inputs: Optional[Values] = None, outputs: Iterable[str] = (), progress: Optional[Callable[[pb.RunProgress], Any]] = None,
                  timeout: Optional[float] = None) -> Calls[StepResult]:
        """Steps until `time` [s] or the deck's end; with `exact` the last step is shortened so that it ends there. `step_size` and `until` as in
        `step`. `progress(RunProgress)` is called about twice a second."""
        outputs = each_name(outputs, "outputs")
        request = pb.StepRequest(until_time=time, exact=exact, step_size=step_size)
        if progress is None:
            return (yield from self._advance(request, until, inputs, outputs, timeout))
        yield from self._fill(request, until, inputs, outputs, timeout)
        done: list_of[pb.StepReply] = []
        wanted = progress

        def take(message: pb.RunReply) -> Any:
            if message.HasField("progress"):
                return wanted(message.progress)  # a coroutine of the asyncio client's
            done.append(message.done)
            return None

        yield Call("Simulations/Run", pb.RunRequest(step=request), timeout, each=take)
        return self.result(done[-1], outputs)

    def _tabulate(self, names: list[str], request: pb.StepRequest, every: int, inputs: Optional[Values],
                  report: Optional[Callable[[pb.RunProgress], object]], timeout: Optional[float]) -> Calls[tuple[Rows, StepResult]]:
        """Makes `request`'s steps in one call: (Rows of the present state, every `every`-th step and the last one; StepResult). When a step
        fails, StepFailed has the rows as `rows`. `report(RunProgress)` may be None."""
        yield from self._fill(request, None, inputs, (), timeout)
        table = pb.TableRequest(handles=(yield from self._handles(names, timeout)), every=every)
        rows, done = Rows([self._variable(name) for name in names]), list[pb.StepReply]()

        def take(message: pb.RunReply) -> None:
            if message.HasField("rows"):
                rows.add(message.rows)
            elif message.HasField("done"):
                done.append(message.done)
            elif report is not None:
                report(message.progress)

        yield Call("Simulations/Run", pb.RunRequest(step=request, table=table), timeout, each=take)
        try:
            return rows, self.result(done[-1])
        except StepFailed as failure:
            failure.rows = rows
            raise

    @call
    def interrupt(self, *, timeout: Optional[float] = USUAL) -> Calls[bool]:
        """Stops whatever advances this simulation, from any thread or client."""
        reply: pb.InterruptReply = yield Call("Simulations/Interrupt", pb.InterruptRequest(simulation=self.name, request_id=_new_id()), timeout, repeatable=True)
        return reply.was_stepping

    def _fill(self, request: pb.StepRequest, until: Optional[Condition], inputs: Optional[Values], outputs: Iterable[str],
              timeout: Optional[float]) -> Calls[None]:
        request.simulation = self.name
        if until is not None:
            if not isinstance(until, Condition):
                raise TypeError(f'`until` must be a mbcosim.Condition, Condition("time", ">", 1.0) say, got {until!r}; run_until takes a time')
            request.until.handle, = yield from self._handles([until.variable], timeout)
            request.until.element, request.until.threshold = until.element, until.threshold
            request.until.comparison = pick(_COMPARISONS, until.comparison, "comparison")
            if until.locate_within is not None:
                request.until.locate_within = until.locate_within
        if inputs:
            yield from self._handles(inputs, timeout)
            request.inputs.CopyFrom(self._pack(inputs, "inputs.values"))
        request.outputs.extend((yield from self._handles(outputs, timeout)))

    def _advance(self, request: pb.StepRequest, until: Optional[Condition], inputs: Optional[Values], outputs: Iterable[str],
                 timeout: Optional[float]) -> Calls[StepResult]:
        outputs = each_name(outputs, "outputs")
        yield from self._fill(request, until, inputs, outputs, timeout)
        request.request_id = _new_id()
        return self.result((yield Call("Simulations/Step", request, timeout, repeatable=True, through=self._through)), outputs)

    def result(self, reply: pb.StepReply, outputs: Iterable[str] = ()) -> StepResult:
        """A reply as a StepResult; raises StepFailed when the reply tells a failure."""
        self.step_number, self.time = reply.step, reply.time
        outcome = enum_name(pb.StepOutcome, reply.outcome, "STEP_OUTCOME_")
        preferred = reply.preferred_step_size if reply.HasField("preferred_step_size") else None
        result = StepResult(outcome, reply.steps_done, reply.step, reply.time, reply.step_size, reply.next_step_size,
                            reply.largest_step_size, preferred, reply.condition_met, reply.iterations, reply.total_iterations,
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
    def snapshot(self, name: str = "", *, timeout: Optional[float] = USUAL) -> Calls[SnapshotKind]:
        """Saves the state."""
        request = pb.CreateSnapshotRequest(simulation=self.name, display_name=name, request_id=_new_id())
        return self._snapshot_class(self, (yield Call("Simulations/CreateSnapshot", request, timeout, repeatable=True)).snapshot)

    @call
    def snapshots(self, *, timeout: Optional[float] = USUAL) -> Calls[list_of[SnapshotKind]]:
        """All saved states."""
        request = pb.ListSnapshotsRequest(simulation=self.name)
        reply = yield Call("Simulations/ListSnapshots", request, timeout, repeatable=True)
        return [self._snapshot_class(self, info) for info in reply.snapshots]

    @call
    def restore(self, snapshot: SnapshotCalls, *, timeout: Optional[float] = USUAL) -> Calls[None]:
        """Goes to a saved state."""
        yield from self._restore(snapshot, timeout)

    def _restore(self, snapshot: SnapshotCalls, timeout: Optional[float], patient: bool = False) -> Calls[None]:
        request = pb.RestoreSnapshotRequest(simulation=self.name, snapshot=snapshot.name, request_id=_new_id())
        self._stand((yield Call("Simulations/RestoreSnapshot", request, timeout, repeatable=True, patient=patient)).simulation)

    @call
    def reset(self, *, timeout: Optional[float] = None) -> Calls[None]:
        """Goes back to the initial solution."""
        request = pb.ResetSimulationRequest(simulation=self.name, request_id=_new_id())
        self._stand((yield Call("Simulations/ResetSimulation", request, timeout, repeatable=True)).simulation)

    def _stand(self, info: pb.SimulationInfo) -> pb.SimulationInfo:
        self.info = info
        self.step_number, self.time = info.step, info.time
        return info

    @call
    def export_state(self, *, timeout: Optional[float] = USUAL) -> Calls[bytes]:
        """The current state as bytes."""
        return (yield from self._collect("Simulations/ExportSnapshot", pb.ExportSnapshotRequest(simulation=self.name), timeout))

    @call
    def export_checkpoint(self, *, timeout: Optional[float] = None) -> Calls[bytes]:
        """All of a durable simulation, its deck included, as bytes for `Server.import_checkpoint`."""
        return (yield from self._collect("Simulations/ExportCheckpoint", pb.ExportCheckpointRequest(simulation=self.name), timeout))

    def _collect(self, method: str, request: Any, timeout: Optional[float]) -> Calls[bytes]:
        """The bytes that a method streams."""
        parts: list_of[bytes] = []
        yield Call(method, request, timeout, each=lambda message: parts.append(message.data))
        return b"".join(parts)

    @call
    def import_state(self, data: bytes, *, restore: bool = True, name: str = "", timeout: Optional[float] = None) -> Calls[SnapshotKind]:
        """Adds a saved state from bytes and, with `restore`, goes to it."""
        bundle.check_state(data)
        header = pb.ImportSnapshotHeader(simulation=self.name, display_name=name, restore=restore, request_id=_new_id())

        def messages() -> Iterator[pb.ImportSnapshotRequest]:
            yield pb.ImportSnapshotRequest(header=header)
            for start in range(0, len(data), 1 << 20):
                yield pb.ImportSnapshotRequest(data=data[start:start + (1 << 20)])

        reply = yield Call("Simulations/ImportSnapshot", messages, timeout, repeatable=True, simulation=self.name)
        snapshot = self._snapshot_class(self, reply.snapshot)
        if restore:
            self.step_number, self.time = snapshot.step, snapshot.time
        return snapshot

    @call
    def fork(self, snapshot: Optional[SnapshotCalls] = None, *, name: str = "",
             ports: Iterable[coupling_types_pb2.PortDefinition] = (), results: Results = False, results_quota: Optional[int] = None,
             optional_ports: bool = False, timeout: Optional[float] = None) -> Calls[Any]:
        """A new simulation at a saved state or the current one, sharing the model. `results`, `optional_ports` as in Server.load_bundle; files of
        its own. Its ports are the deck's and `ports`; those that this one was given, and all peers, stay here."""
        options = pb.CreateOptions(display_name=name, ports=_ports(ports), optional_ports=optional_ports, request_id=_new_id(), protocol=protocol())
        if results:
            options.results.CopyFrom(_result_options(results, results_quota))
        request = pb.ForkSimulationRequest(simulation=self.name, snapshot=snapshot.name if snapshot else None, options=options)
        reply = yield Call("Simulations/ForkSimulation", request, timeout, repeatable=True)
        return type(self)(self._connection, reply.simulation, [], "", True)

    # ---------------------------------------------------------------- result files

    @call
    def result_files(self, *, timeout: Optional[float] = USUAL) -> Calls[dict[str, int]]:
        """Sizes of the result files so far [bytes], by name. The simulation must have been created with `results`."""
        reply: results_pb2.ListResultsReply = yield Call("Results/ListResults", results_pb2.ListResultsRequest(simulation=self.name), timeout, repeatable=True)
        return {file.name: file.size_bytes for file in reply.files}

    @call
    def result_file(self, name: str, *, offset: int = 0, length: Optional[int] = None, timeout: Optional[float] = None) -> Calls[bytes]:
        """Bytes of a result file: all, or `length` from `offset` on."""
        request = results_pb2.GetResultsRequest(simulation=self.name, file=name, offset_bytes=offset, length_bytes=length)
        return (yield from self._collect("Results/GetResults", request, timeout))

    # ---------------------------------------------------------------- analysis

    @call
    def eigenvalues(self, count: Optional[int] = None, *, shift: float = 0.0, vectors: bool = False, timeout: Optional[float] = None) -> Calls[Any]:
        """Eigenvalues [1/s] about the current state, nearest to `shift` first; None: all finite ones. With `vectors` also
        the eigenvectors, one a column."""
        request = pb.ComputeEigenvaluesRequest(simulation=self.name, count=count, shift=shift, eigenvectors=vectors)
        reply = yield from self._pages("Simulations/ComputeEigenvalues", request, pb.ComputeEigenvaluesReply(), timeout)
        values = np.array(reply.real) + 1j * np.array(reply.imaginary)
        return (values, _matrix(reply.vectors_real) + 1j * _matrix(reply.vectors_imaginary)) if vectors else values

    @call
    def linearize(self, inputs: Iterable[str] = (), outputs: Iterable[str] = (), *, timeout: Optional[float] = None) -> Calls[tuple[Array, ...]]:
        """State space matrices A, B, C, D about the current state, for variables by name."""
        reply = yield from self._linearize(inputs, outputs, False, timeout)
        return tuple(_matrix(m) for m in (reply.a, reply.b, reply.c, reply.d))

    @call
    def linearize_descriptor(self, inputs: Iterable[str] = (), outputs: Iterable[str] = (), *, sparse: bool = False,
                             timeout: Optional[float] = None) -> Calls[tuple[Any, ...]]:
        """Matrices E, A, B, C, D of E dx/dt = A x + B u, y = C x + D u with all unknowns of the model: numpy arrays, or with `sparse` matrices of
        SciPy (csc_matrix), without which a large model does not fit into memory."""
        reply = yield from self._linearize(inputs, outputs, True, timeout)
        made = _sparse if sparse else _matrix
        return tuple(made(m) for m in (reply.e, reply.a, reply.b, reply.c, reply.d))

    def _linearize(self, inputs: Iterable[str], outputs: Iterable[str], descriptor: bool, timeout: Optional[float]) -> Calls[pb.LinearizeReply]:
        sources, results = each_name(inputs, "inputs"), each_name(outputs, "outputs")
        request = pb.LinearizeRequest(simulation=self.name, inputs=(yield from self._handles(sources, timeout)),
                                      outputs=(yield from self._handles(results, timeout)), descriptor_form=descriptor)
        return (yield from self._pages("Simulations/Linearize", request, pb.LinearizeReply(), timeout))

    def _pages(self, method: str, request: Any, whole: Reply, timeout: Optional[float]) -> Calls[Reply]:
        """All pages of a reply as one."""
        merged: Any = whole
        while True:
            page = yield Call(method, request, timeout, repeatable=True)
            merged.MergeFrom(page)
            request.page_token = page.next_page_token
            if not request.page_token:
                return whole

    @call
    def geometry(self, *, line_samples: Optional[int] = None, modal_points: bool = True,
                 timeout: Optional[float] = None) -> Calls[Geometry]:
        """What a viewer needs; see Geometry. `line_samples`: points along each curved line, 2 to 1000."""
        request = geometry_pb2.DescribeGeometryRequest(simulation=self.name, line_samples=line_samples,
                                                       without_modal_points=not modal_points)
        found = Geometry()

        def take(message: geometry_pb2.DescribeGeometryReply) -> None:
            kind = message.WhichOneof("content")
            if kind == "header":
                found.header = message.header
            elif kind == "nodes":
                found.nodes += message.nodes.nodes
            elif kind == "elements":
                found.elements += message.elements.elements
            elif kind == "modal_points":
                found.modal_points.append(message.modal_points)

        yield Call("Geometry/DescribeGeometry", request, timeout, each=take)
        return found

    # ---------------------------------------------------------------- the simulation itself

    @call
    def refresh(self, *, timeout: Optional[float] = USUAL) -> Calls[pb.SimulationInfo]:
        """Asks the server where the simulation stands."""
        return self._stand((yield Call("Simulations/GetSimulation", pb.GetSimulationRequest(simulation=self.name), timeout,
                                       repeatable=True)).simulation)

    @call
    def update(self, *, name: Optional[str] = None, policy: Optional[str] = None, minimum_step: Optional[float] = None,
               grants: Optional[Iterable[pb.Grant]] = None, timeout: Optional[float] = USUAL) -> Calls[pb.SimulationInfo]:
        """Changes choices made at creation; see Server.load_bundle."""
        request = pb.UpdateSimulationRequest(simulation=self.name, request_id=_new_id())
        if name is not None:
            request.display_name = name
        if policy is not None:
            request.non_convergence_policy = _policy(policy)
        if minimum_step is not None:
            request.minimum_step_size = minimum_step
        if grants is not None:
            request.grants.SetInParent()
            request.grants.grants.extend(_grants(grants))
        self.info = (yield Call("Simulations/UpdateSimulation", request, timeout, repeatable=True)).simulation
        return self.info

    @call
    def record(self, *, timeout: Optional[float] = None) -> Calls[bytes]:
        """All that crossed the ports so far, as bytes for `mbcosim replay`. The simulation must have been created with `record`."""
        return (yield from self._collect("Simulations/GetRecord", pb.GetRecordRequest(simulation=self.name), timeout))

    @call
    def delete(self, *, timeout: Optional[float] = USUAL) -> Calls[None]:
        """Ends the simulation."""
        yield from self._delete(timeout)

    def _delete(self, timeout: Optional[float], patient: bool = False) -> Calls[None]:
        self._connection.check()
        self._leave()
        request = pb.DeleteSimulationRequest(simulation=self.name, request_id=_new_id())
        yield Call("Simulations/DeleteSimulation", request, timeout, repeatable=True, patient=patient)

    def _end(self, raised: Optional[BaseException]) -> Calls[None]:
        """Leaves a `with` block, in which something was `raised` or not; that it was deleted before is no fault."""
        if self._owned:
            with parting(raised), contextlib.suppress(NotFound):
                yield from self._delete(PARTING, patient=True)


class SnapshotCalls:
    """A saved state of a simulation."""

    def __init__(self, simulation: SimulationCalls[Any], info: pb.Snapshot) -> None:
        self._simulation, self._connection = simulation, simulation._connection
        self.name, self.step, self.time, self.display_name = info.name, info.step, info.time, info.display_name
        self.size_bytes = info.size_bytes

    def __repr__(self) -> str:
        time = f"{self.time:g} {after_number(self._simulation.time_unit)}"
        return f"<{type(self).__name__} {self.display_name or self.name}, step {self.step}, t = {time}, {self.size_bytes} bytes>"

    @call
    def restore(self, *, timeout: Optional[float] = USUAL) -> Calls[None]:
        """Goes to this state."""
        yield from self._simulation._restore(self, timeout)

    @call
    def export(self, *, timeout: Optional[float] = USUAL) -> Calls[bytes]:
        """The state as bytes."""
        request = pb.ExportSnapshotRequest(simulation=self._simulation.name, snapshot=self.name)
        return (yield from self._simulation._collect("Simulations/ExportSnapshot", request, timeout))

    @call
    def delete(self, *, timeout: Optional[float] = USUAL) -> Calls[None]:
        """Forgets the state."""
        yield from self._delete(timeout)

    def _delete(self, timeout: Optional[float], patient: bool = False) -> Calls[None]:
        request = pb.DeleteSnapshotRequest(simulation=self._simulation.name, snapshot=self.name, request_id=_new_id())
        yield Call("Simulations/DeleteSnapshot", request, timeout, repeatable=True, patient=patient)

    def _end(self, raised: Optional[BaseException]) -> Calls[None]:
        """Leaves a `with` block, in which something was `raised` or not. Raises TimedOut when nobody knows whether the simulation went back."""
        with parting(raised, told=TimedOut):
            yield from self._simulation._restore(self, PARTING, patient=True)
        with parting(raised), contextlib.suppress(NotFound):
            yield from self._delete(PARTING, patient=True)
