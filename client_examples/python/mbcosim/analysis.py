"""Linear models about the present state: state space and modes."""
from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from .access import Path
from .histories import Array
from .words import UnknownName, frequency_unit, needed, remedy, seconds_in

ComplexArray = npt.NDArray[np.complex128]


@dataclasses.dataclass
class StateSpace:
    """dx/dt = A x + B u, y = C x + D u about a state; inputs and outputs are numbers, named as in History.columns. Matrices are in the deck's units;
    frequencies in Hz, or, where nobody declared the deck's unit of time, in oscillations in one of those."""
    A: Array
    B: Array
    C: Array
    D: Array
    inputs: list[str]
    outputs: list[str]
    time_unit: str = "s"  # of the deck

    def __repr__(self) -> str:
        return f"<StateSpace, {len(self.A)} states, inputs {', '.join(self.inputs)}, outputs {', '.join(self.outputs)}>"

    def to_scipy(self) -> Any:
        """A scipy.signal.StateSpace."""
        return needed("scipy.signal", "a system of SciPy", "scipy").StateSpace(self.A, self.B, self.C, self.D)

    @property
    def poles(self) -> ComplexArray:
        """Eigenvalues of A [1/`time_unit`]."""
        return np.asarray(np.linalg.eigvals(self.A), dtype=complex)

    def frequencies(self, count: int = 400) -> Array:
        """Frequencies [Hz] from a decade below the slowest pole to a decade above the fastest."""
        sizes = np.abs(self.poles) / (2 * np.pi * (seconds_in(self.time_unit) or 1.0))
        sizes = sizes[sizes > 1e-6]
        low, high = (sizes.min(), sizes.max()) if len(sizes) else (1.0, 1.0)
        return np.geomspace(low / 10, high * 10, count)

    def response(self, frequencies_hz: npt.ArrayLike) -> ComplexArray:
        """Outputs over inputs at frequencies: (frequencies x outputs x inputs)."""
        s = 2j * np.pi * (seconds_in(self.time_unit) or 1.0) * np.atleast_1d(np.asarray(frequencies_hz, float))
        eye = np.eye(len(self.A))
        return np.array([self.C @ np.linalg.solve(z * eye - self.A, self.B.astype(complex)) + self.D for z in s])

    def root_locus(self, gains: npt.ArrayLike) -> ComplexArray:
        """Poles (gains x states) [1/`time_unit`] of the loop u = -k y of one input and one output; those of a column belong together."""
        if self.B.shape[1] != 1 or self.C.shape[0] != 1:
            raise ValueError(f"a root locus needs one input and one output; choose with `only`: this system has {self.B.shape[1]} inputs "
                             f"and {self.C.shape[0]} outputs")
        rows: list[ComplexArray] = []
        for k in np.ravel(np.asarray(gains, float)):
            closed = self.A - self.B @ self.C * (k / (1 + k * float(self.D[0, 0])))
            rows.append(_follow(rows[-1] if rows else None, np.linalg.eigvals(closed).astype(complex)))
        return np.array(rows)

    def only(self, inputs: Union[str, Iterable[str]], outputs: Union[str, Iterable[str]]) -> StateSpace:
        """The part between some inputs and outputs."""
        chosen_in = [inputs] if isinstance(inputs, str) else list(inputs)
        chosen_out = [outputs] if isinstance(outputs, str) else list(outputs)
        columns, rows = _places("input", chosen_in, self.inputs), _places("output", chosen_out, self.outputs)
        return StateSpace(self.A, self.B[:, columns], self.C[rows], self.D[np.ix_(rows, columns)], chosen_in, chosen_out, self.time_unit)

    def plot_bode(self, frequencies_hz: Optional[npt.ArrayLike] = None, *, save: Optional[Path] = None) -> Any:
        """Bode diagram; see plots.plot_bode."""
        from . import plots
        return plots.plot_bode(self, frequencies_hz, save=save)

    def plot_root_locus(self, gains: npt.ArrayLike, *, save: Optional[Path] = None) -> Any:
        """Root locus; see plots.plot_root_locus."""
        from . import plots
        return plots.plot_root_locus(self, gains, save=save)


def _follow(before: Optional[ComplexArray], values: ComplexArray) -> ComplexArray:
    """`values` in the order that brings each next to its predecessor."""
    if before is None:
        return values[np.argsort(values.imag)]
    left, ordered = list(values), []
    for value in before:
        nearest = int(np.argmin(np.abs(np.array(left) - value)))
        ordered.append(left.pop(nearest))
    return np.array(ordered)


@dataclasses.dataclass
class Modes:
    """Modes that oscillate, about a state, by frequency. Shapes are displacements of the structural nodes."""
    values: ComplexArray   # eigenvalues with positive imaginary part [1/`time_unit`], (modes)
    shapes: ComplexArray   # (modes x nodes x 3), the largest component of each is 1
    rotations: ComplexArray  # of the nodes, global axes, on the same scale: (modes x nodes x 3) [rad/`length_unit`]
    labels: list[int]      # of the nodes
    positions: Array       # of the nodes (nodes x 3) [`length_unit`]
    length_unit: str = "m"  # of the deck
    time_unit: str = "s"

    @property
    def frequencies_hz(self) -> Array:
        """Frequencies of the oscillation [Hz]; where nobody declared the deck's unit of time: oscillations in one of those."""
        return np.asarray(self.values.imag / (2 * np.pi * (seconds_in(self.time_unit) or 1.0)), dtype=float)

    @property
    def damping(self) -> Array:
        """Parts of critical damping; negative: the mode grows."""
        return np.asarray(-self.values.real / np.abs(self.values), dtype=float)

    def shape(self, number: int) -> ComplexArray:
        """Displacements (nodes x 3) in a mode, counted from 1."""
        if not 1 <= number <= len(self.values):
            raise IndexError(f"there is no mode {number}; there are 1 to {len(self.values)}")
        return np.asarray(self.shapes[number - 1])

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        unit = frequency_unit(self.time_unit)
        rows = [f"  {k + 1:3}  {f:12.6g} {unit}  damping {d:9.3g}" for k, (f, d) in enumerate(zip(self.frequencies_hz, self.damping))]
        return "\n".join([f"<{len(self)} modes>", *rows])

    def animate(self, number: int, **options: Any) -> Any:
        """Swings the model in a mode; see plots.animate_mode."""
        from . import plots
        return plots.animate_mode(self, number, **options)


def _places(what: str, names: list[str], known: list[str]) -> list[int]:
    for name in names:
        if name not in known:
            raise UnknownName(f"the system has no {what} {name!r}; {remedy(name, known)}")
    return [known.index(name) for name in names]


def _columns(simulation: Any, names: list[str]) -> list[str]:
    found = []
    for name in names:
        variable = simulation.variables[name]
        found += [name] if not variable.shape else [f"{name}[{k + 1}]" for k in range(variable.size)]
    return found


class Analysis:
    """Linear models of a simulation."""

    def state_space(self: Any, inputs: Union[str, Iterable[str]] = (), outputs: Union[str, Iterable[str]] = (), *,
                    timeout: Optional[float] = None) -> StateSpace:
        """The linear model about the present state, for inputs and outputs by name."""
        names = [[group] if isinstance(group, str) else list(group) for group in (inputs, outputs)]
        sources, results = [self.inputs.name(name) for name in names[0]], [self.outputs.name(name) for name in names[1]]
        A, B, C, D = self.linearize(sources, results, timeout=timeout)
        return StateSpace(A, B, C, D, _columns(self, sources), _columns(self, results), self.time_unit)

    def modes(self: Any, count: Optional[int] = None, *, shift: float = 0.0, timeout: Optional[float] = None) -> Modes:
        """The modes that oscillate about the present state, by frequency: those of `count` eigenvalues nearest to `shift`, or of all."""
        values, vectors = self.eigenvalues(count, shift=shift, vectors=True, timeout=timeout)
        labels = [node.label for node in self.nodes.values() if node.family == "structural"]
        names = [f"node.structural.{label}.X" for label in labels]
        turns = [f"node.structural.{label}.Phi" for label in labels if f"node.structural.{label}.Phi" in self.variables]
        *_, C, _ = self.linearize_descriptor([], names + turns, timeout=timeout)
        chosen = np.flatnonzero(values.imag > 1e-9 * np.abs(values).max(initial=1.0))
        chosen = chosen[np.argsort(values[chosen].imag)]
        moved = (C @ vectors[:, chosen]).T.reshape(len(chosen), len(names) + len(turns), 3)
        scale = _largest(moved[:, :len(names)])
        moved = moved / scale
        rotations = np.zeros((len(chosen), len(names), 3), complex)
        rotations[:, [k for k, label in enumerate(labels) if f"node.structural.{label}.Phi" in turns]] = moved[:, len(names):]
        positions = np.array([self.read(names)[name] for name in names]).reshape(-1, 3)
        return Modes(values[chosen], moved[:, :len(names)], rotations, labels, positions, self.length_unit, self.time_unit)


def _largest(shapes: ComplexArray) -> ComplexArray:
    """Of each mode the component of largest size, (modes x 1 x 1); 1 where no node moves."""
    flat = shapes.reshape(len(shapes), shapes.shape[1] * shapes.shape[2])
    if flat.size == 0:
        return np.ones((len(shapes), 1, 1), complex)
    largest = flat[np.arange(len(flat)), np.abs(flat).argmax(axis=1)]
    largest[np.abs(largest) < 1e-300] = 1.0
    return np.asarray(largest[:, None, None])
