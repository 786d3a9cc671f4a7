"""Values over time with their units: what Simulation.simulate returns."""
from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

from mbcosim.v1 import simulations_pb2 as pb

from .access import Path
from .calls import SimulationCalls, StepResult, numbers_of
from .errors import StepFailed, bad_argument
from .rpc import USUAL
from .table import Rows
from .words import UnknownName, after_number, needed, remedy

if TYPE_CHECKING:
    from .simulation import Simulation

Array = npt.NDArray[np.float64]
Input = Union[float, Sequence[float], Array, Callable[[float], Any]]


class History(Mapping[str, Array]):
    """Times and, by name, values of variables at those times: the first axis is time.

    `history["node.structural.2.X"]` is an array (instants x 3); units are in `units`, that of `time` in `time_unit`. See also plot, animate,
    to_pandas, to_xarray.
    """

    def __init__(self, time: Array, values: dict[str, Array], units: dict[str, str], title: str = "",
                 steps: Optional[npt.NDArray[np.int64]] = None, time_unit: str = "s") -> None:
        self.time, self._values, self.units, self.title, self.time_unit = time, values, units, title, time_unit
        self.steps = steps  # numbers of the steps

    @classmethod
    def of_rows(cls, rows: Rows, simulation: SimulationCalls[Any]) -> History:
        """What one call brought."""
        return cls(rows.times, rows.values(), rows.units(), str(simulation.info.display_name), rows.steps, simulation.time_unit)

    def __getitem__(self, name: str) -> Array:
        try:
            return self._values[name]
        except KeyError:
            raise UnknownName(f"the history has no {name!r}; {remedy(name, self._values)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        span = f"{self.time[0]:g} to {self.time[-1]:g} {after_number(self.time_unit)}" if len(self.time) else "empty"
        lines = [f"  {name} {list(v.shape[1:]) or ''}{' [' + self.units[name] + ']' if self.units[name] else ''}" for name, v in self.items()]
        return "\n".join([f"<History, {len(self.time)} instants, {span}>", *lines])

    def columns(self) -> dict[str, Array]:
        """One column for each number: `name`, or `name[1]`, `name[2]`, … as in decks."""
        found = {}
        for name, values in self.items():
            flat = values.reshape(len(values), -1)
            for k in range(flat.shape[1]):
                found[name if values.ndim == 1 else f"{name}[{k + 1}]"] = flat[:, k]
        return found

    def to_numpy(self) -> Any:
        """A structured array: fields "step" and "time", and one for each variable, with its shape. Units in `dtype.metadata["units"]`."""
        own = {"step": self.steps, "time": self.time}
        fields = {name: values for name, values in {**own, **{k: v for k, v in self.items() if k not in own}}.items() if values is not None}
        columns: Any = [(name, values.dtype, values.shape[1:]) for name, values in fields.items()]
        dtype: Any = np.dtype
        kinds = dtype(columns, metadata={"units": {"step": "", "time": self.time_unit, **self.units}})
        table: Any = np.empty(len(self.time), kinds)
        for name, values in fields.items():
            table[name] = values
        return table

    def to_pandas(self) -> Any:
        """A pandas.DataFrame with one column for each number, indexed by time; units in `attrs["units"]`."""
        pandas = needed("pandas", "a data frame")
        frame = pandas.DataFrame(self.columns(), index=pandas.Index(self.time, name=f"time [{self.time_unit}]"))
        frame.attrs["units"] = dict(self.units)
        return frame

    def to_xarray(self) -> Any:
        """An xarray.Dataset with the dimension `time`; units as attributes."""
        xarray = needed("xarray", "a data set")
        data = {name: (["time", *(f"{name} {axis + 1}" for axis in range(values.ndim - 1))], values, {"units": self.units[name]})
                for name, values in self.items() if name != "time"}  # which is the coordinate
        return xarray.Dataset(data, coords={"time": ("time", self.time, {"units": self.time_unit})}, attrs={"title": self.title})

    def save(self, path: Path) -> None:
        """Writes a table with one column for each number, units in its heading."""
        columns = self.columns()
        heads = [f"time [{self.time_unit}]"]
        for name in columns:
            unit = self.units[name.split("[")[0]] if name not in self.units else self.units[name]
            heads.append(f"{name} [{unit}]" if unit else name)
        np.savetxt(path, np.column_stack([self.time, *columns.values()]), delimiter=",", header=",".join(heads), comments="")

    def plot(self, names: Union[None, str, Iterable[str]] = None, *, axes: Any = None, save: Optional[Path] = None) -> Any:
        """Draws variables over time, one row of axes for each unit; see plots.plot_history."""
        from . import plots
        return plots.plot_history(self, names, axes=axes, save=save)

    def animate(self, *, lines: Any = None, view: Any = "auto", seconds: Optional[float] = None, frames_per_second: float = 25,
                save: Optional[Path] = None) -> Any:
        """Moves the points whose positions the history has; see plots.animate_history."""
        from . import plots
        return plots.animate_history(self, lines=lines, view=view, seconds=seconds, frames_per_second=frames_per_second, save=save)


class _Collector:
    """Collects results of single steps on the way."""

    def __init__(self, simulation: Simulation, names: list[str]) -> None:
        self._simulation, self._names = simulation, list(dict.fromkeys(names))
        first = simulation.read(names) if names else {}
        self._times, self._steps = [simulation.time], [simulation.step_number]
        self._values = {name: [first[name]] for name in names}

    def add(self, result: StepResult) -> None:
        self._times.append(result.time)
        self._steps.append(result.step)
        for name in self._names:
            self._values[name].append(result.values[name])

    def history(self) -> History:
        known = self._simulation.variables
        values = {name: np.array(rows, dtype=float) for name, rows in self._values.items()}
        title, time_unit = str(self._simulation.info.display_name), self._simulation.time_unit
        units = {name: known[name].unit for name in self._names}
        return History(np.array(self._times, dtype=float), values, units, title, np.array(self._steps, dtype=np.int64), time_unit)


def bar(total: float, show: bool, unit: str) -> Any:
    """A progress bar, in terminals and notebooks; without `show` one that shows nothing."""
    if not show:
        return _NoBar()
    tqdm = needed("tqdm.auto", "a progress bar", "tqdm")
    return tqdm.tqdm(total=total, unit=unit, bar_format="{l_bar}{bar}| {n:.4g}/{total:.4g} {unit} [{elapsed}<{remaining}]")


class _NoBar:
    def __enter__(self) -> _NoBar:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def update(self, _: float) -> None:
        """Nothing to show."""


def _numbers(simulation: Simulation, inputs: Mapping[str, Input], time: float) -> list[float]:
    """Values of all inputs at a time, one after the other."""
    numbers: list[float] = []
    for name, value in inputs.items():
        numbers.extend(numbers_of(simulation.variables[name], value(time) if callable(value) else value, "inputs.values"))
    return numbers


def _run(simulation: Any, names: list[str], inputs: Mapping[str, Input], end: Optional[float], steps: Optional[int], every: int,
         progress: bool, timeout: Optional[float]) -> History:
    if steps is not None and operator.index(steps) < 0:
        raise bad_argument("steps", f"`steps` must not be negative, got {steps}")
    if end is not None and math.isnan(end):
        raise bad_argument("until", "`until` is not a number")
    rows, done, start = _Collector(simulation, names), 0, simulation.time
    total = float(steps) if end is None and steps is not None else float(end or 0.0) - start
    size = simulation.info.next_step_size
    with simulation.stepper(names, list(inputs)) as stepper, bar(total, progress, simulation.time_unit if end is not None else "step") as shown:
        while True:
            left = steps - done if end is None and steps is not None else round((float(end or 0.0) - simulation.time) / size) if size > 0 else 0
            if left <= 0:
                break
            before = simulation.time
            try:
                result = stepper.step(_numbers(simulation, inputs, before), count=min(every, left), timeout=timeout)
            except StepFailed as error:
                error.history = rows.history()
                raise
            rows.add(result)
            done += result.steps_done
            shown.update(result.time - before if end is not None else result.steps_done)
            size = result.next_step_size
            if result.outcome != "ACCEPTED":
                break
    return rows.history()


def _run_in_one_call(simulation: Any, names: list[str], request: pb.StepRequest, every: int, inputs: Mapping[str, Any], progress: bool,
                     timeout: Optional[float]) -> History:
    with bar(1.0, progress, "of the run") as shown:
        last = 0.0

        def report(told: pb.RunProgress) -> None:
            nonlocal last
            shown.update(max(told.fraction, last) - last)
            last = max(told.fraction, last)

        try:
            rows, _ = simulation._connection.run(simulation._tabulate(names, request, every, inputs, report, timeout))
        except StepFailed as error:
            error.history = History.of_rows(error.rows, simulation)
            raise
        shown.update(1.0 - last)
    return History.of_rows(rows, simulation)


class Histories:
    """What a simulation can do beyond single steps."""

    def simulate(self: Any, outputs: Union[None, str, Iterable[str]] = None, *, until: Optional[float] = None, steps: Optional[int] = None,
                 every: int = 1, inputs: Optional[Mapping[str, Input]] = None, progress: bool = False,
                 timeout: Optional[float] = None) -> History:
        """Advances and keeps what the outputs are on the way, the present state included. Without functions among the inputs all is one call.

        outputs   names of variables; default: the positions of all structural nodes
        until     time [s]; default: the deck's end
        steps     number of the deck's steps, instead of `until`
        every     steps from one kept instant to the next
        inputs    by name: numbers that hold, or functions of time [s] that are asked at every kept instant and hold until the next
        progress  shows a bar (needs tqdm)
        timeout   seconds that it may take; with functions among the inputs: one advance

        When a step fails, StepFailed.history has what there was until then.
        """
        if until is not None and steps is not None:
            raise ValueError("say how long with `until` or with `steps`, not with both")
        if every < 1:
            raise ValueError(f"`every` must be at least 1, got {every}")
        if self._description is None and (outputs is None or inputs):
            self.describe(timeout=USUAL if timeout is None else min(timeout, USUAL))
        names = self._positions() if outputs is None else [outputs] if isinstance(outputs, str) else list(outputs)
        end = until if until is not None or steps is not None else self.info.final_time
        named = {self.inputs.name(k): v for k, v in (inputs or {}).items()}
        if any(callable(v) for v in named.values()):
            return _run(self, names, named, end, steps, every, progress, timeout)
        request = pb.StepRequest(steps=steps) if end is None else pb.StepRequest(until_time=end)
        return _run_in_one_call(self, names, request, every, named, progress, timeout)

    def _positions(self: Any) -> list[str]:
        return [name for name in self.variables if name.startswith("node.structural.") and name.endswith(".X")]

    def what_if(self: Any, cases: Mapping[str, Mapping[str, Input]], outputs: Union[None, str, Iterable[str]] = None,
                **options: Any) -> dict[str, History]:
        """The histories that different inputs would lead to from the present state, by the names of the cases; this simulation stays where
        it is. Options as of `simulate`. Each case is a fork: without the loads of peers, and a port of the deck waits for one in vain.

            simulation.what_if({"open": {"valve": 1.0}, "closed": {"valve": 0.0}}, ["node.structural.8.X"], until=2.0)
        """
        found, wanted = {}, outputs if outputs is None or isinstance(outputs, str) else list(outputs)
        for name, inputs in cases.items():
            with self.fork(name=name) as branch:
                found[name] = branch.simulate(wanted, inputs=inputs, **options)
        return found
