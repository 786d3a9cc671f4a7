"""Pictures with matplotlib: histories, moving models, modes, Bode diagrams, root loci."""
from __future__ import annotations

import operator
import os
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

from .access import Path
from .histories import Array, History
from .words import after_number, frequency_unit, needed, pick, positive, seconds_in

if TYPE_CHECKING:
    from .analysis import Modes, StateSpace

_VIEWS = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
_XYZ = ("x", "y", "z")
_NUMBER = re.compile(r"(%\d*d)")  # of a picture, in the name of its file


def pyplot(save: Optional[Path]) -> Any:
    """matplotlib.pyplot; without a display where the picture goes to a file."""
    matplotlib = needed("matplotlib", "a picture")
    if save is not None and not os.environ.get("MPLBACKEND") and not os.environ.get("DISPLAY") and not os.environ.get("WAYLAND_DISPLAY"):
        matplotlib.use("Agg", force=False)
    return needed("matplotlib.pyplot", "a picture", "matplotlib")


def _finish(figure: Any, save: Optional[Path]) -> Any:
    if save is not None:
        figure.savefig(save, dpi=120)
    return figure


def component_names(name: str, values: Array) -> list[str]:
    """Labels of the numbers of a variable: x, y, z for a vector of three."""
    count = int(np.prod(values.shape[1:]))
    if values.ndim == 1:
        return [name]
    return [f"{name} {_XYZ[k] if count == 3 else k + 1}" for k in range(count)]


def plot_history(history: History, names: Union[None, str, Iterable[str]] = None, *, axes: Any = None, save: Optional[Path] = None) -> Any:
    """Draws variables over time: one row of axes for each unit, all numbers of a vector.

    names  of variables; default: all. `"node.structural.2.X[3]"` is one number of a vector, counted as in decks.
    axes   matplotlib axes to draw all into; default: a new figure
    save   file to write: .png, .svg, .pdf
    Returns the figure.
    """
    plt = pyplot(save)
    columns = history.columns()
    wanted = list(history) if names is None else [names] if isinstance(names, str) else list(names)
    if not wanted:
        raise ValueError("there is nothing to plot: " + ("the history has no variables" if names is None else "`names` is empty"))
    groups: dict[str, list[tuple[str, Array]]] = {}
    for name in wanted:
        if name in columns:
            groups.setdefault(history.units[name if name in history.units else name.rpartition("[")[0]], []).append((name, columns[name]))
            continue
        values = history[name]
        flat = values.reshape(len(values), -1)
        for k, label in enumerate(component_names(name, values)):
            groups.setdefault(history.units[name], []).append((label, flat[:, k]))
    if axes is None:
        figure, rows = plt.subplots(len(groups), 1, figsize=(8, 1.5 + 2.5 * len(groups)), sharex=True, squeeze=False, layout="constrained")
        places = list(rows[:, 0])
    else:
        figure, places = axes.figure, [axes] * len(groups)
    for place, (unit, curves) in zip(places, groups.items()):
        for label, curve in curves:
            place.plot(history.time, curve, label=label, linewidth=1.2)
        place.set_ylabel(f"[{unit}]" if unit else "")
        place.grid(alpha=0.3)
        place.legend(fontsize="small", frameon=False)
    places[-1].set_xlabel(f"time [{history.time_unit}]")
    if history.title:
        places[0].set_title(history.title)
    return _finish(figure, save)


# ---------------------------------------------------------------- what moves

def points(history: History) -> tuple[list[int], Array, str]:
    """Labels of the nodes whose positions a history has, the positions (instants x nodes x 3), their unit."""
    found = {int(name.split(".")[2]): name for name in history if name.startswith("node.structural.") and name.endswith(".X")}
    if not found:
        raise ValueError("the history has no positions of nodes; simulate with outputs like 'node.structural.1.X', or without any: all nodes")
    labels = sorted(found)
    return labels, np.stack([history[found[label]] for label in labels], axis=1), history.units[found[labels[0]]]


class _Scene:
    """Points and lines on axes, in the plane of the motion or in space."""

    def __init__(self, plt: Any, positions: Array, unit: str, labels: Sequence[int], lines: Iterable[Sequence[int]], view: str,
                 trails: bool) -> None:
        self._positions, self._unit = positions, unit
        self._plane = _plane(positions, view)
        places = {label: k for k, label in enumerate(labels)}
        self._lines = [[pick(places, label, "lines") for label in line] for line in _lines(lines)]
        space = self._plane is None
        self.figure = plt.figure(figsize=(6.4, 5.2))
        self.axes = self.figure.add_subplot(projection="3d" if space else None)
        self._frame()
        if trails:
            for k in range(positions.shape[1]):
                self.axes.plot(*self._shown(positions[:, k]), color="0.85", linewidth=1, zorder=0)
        self._bars = [self.axes.plot(*self._shown(positions[0, line]), color="C0", linewidth=2)[0] for line in self._lines]
        self._dots = self.axes.plot(*self._shown(positions[0]), "o", color="C3", markersize=5)[0]

    def _shown(self, rows: Array) -> tuple[Array, ...]:
        return tuple(rows[:, axis] for axis in (self._plane or (0, 1, 2)))

    def _frame(self) -> None:
        low, high = self._positions.min((0, 1)), self._positions.max((0, 1))
        reach = 0.55 * max(float((high - low).max()), 1e-6)
        middle, axes = (low + high) / 2, self._plane or (0, 1, 2)
        for axis, letter in zip(axes, _XYZ):
            getattr(self.axes, f"set_{letter}lim")(middle[axis] - reach, middle[axis] + reach)
            getattr(self.axes, f"set_{letter}label")(f"{_XYZ[axis]} [{self._unit}]")
            self.axes.locator_params(axis=letter, nbins=5)
        self.axes.set_aspect("equal") if self._plane else self.axes.set_box_aspect((1, 1, 1))

    def show(self, instant: int, title: str) -> None:
        """Moves all to an instant."""
        everything = list(range(self._positions.shape[1]))
        for artist, line in [*zip(self._bars, self._lines), (self._dots, everything)]:
            shown = self._shown(self._positions[instant, line])
            artist.set_data(*shown[:2])
            if self._plane is None:
                artist.set_3d_properties(shown[2])
        self.axes.set_title(title)


def _lines(lines: Iterable[Sequence[int]]) -> list[Sequence[int]]:
    found = list(lines)
    if any(isinstance(line, (int, str)) for line in found):
        raise ValueError(f"lines: each must be a list of labels, got {found[0]!r} in its place: say [(1, 2, 3)] for one line")
    return found


def _plane(positions: Array, view: str) -> Optional[tuple[int, int]]:
    """Axes of the plane to draw; None: space. "auto" draws a plane where all stays in one that is parallel to two axes."""
    if view in _VIEWS:
        return _VIEWS[view]
    if view == "3d":
        return None
    if view != "auto":
        raise ValueError(f"view: no choice is called {view!r}; there are 'auto', '3d', {', '.join(map(repr, _VIEWS))}")
    extent = np.ptp(positions.reshape(-1, 3), axis=0)
    flat = int(np.argmin(extent))
    if extent[flat] > 1e-6 * max(float(extent.max()), 1e-9):
        return None
    first, second = (axis for axis in range(3) if axis != flat)
    return first, second


def _play(plt: Any, scene: _Scene, titles: Sequence[str], frames_per_second: float, save: Optional[Path]) -> Any:
    animation = needed("matplotlib.animation", "an animation", "matplotlib")
    file = None if save is None else os.fspath(save)
    parts = [] if file is None else _NUMBER.split(file)
    if len(parts) > 1:  # a picture for each frame
        for k, title in enumerate(titles):
            scene.show(k, title)
            scene.figure.savefig("".join(part % k if _NUMBER.fullmatch(part) else part for part in parts), dpi=100)
        plt.close(scene.figure)
        return None
    film = animation.FuncAnimation(scene.figure, lambda k: scene.show(k, titles[k]), frames=len(titles), interval=1000 / frames_per_second)
    if file is not None:
        needed("PIL", "a GIF", "pillow")
        if not file.endswith(".gif") and not animation.writers.is_available("ffmpeg"):
            plt.close(scene.figure)
            raise ValueError(f"without ffmpeg films are GIFs, or pictures for each frame: expected a name like 'film.gif' or 'frame%03d.png', got {file!r}")
        film.save(file, writer=animation.PillowWriter(fps=frames_per_second) if file.endswith(".gif") else None)
        plt.close(scene.figure)
    return film


def animate_history(history: History, *, lines: Optional[Iterable[Sequence[int]]] = None, view: str = "auto",
                    seconds: Optional[float] = None, frames_per_second: float = 25, save: Optional[Path] = None) -> Any:
    """Moves the nodes whose positions the history has, with the paths that they take.

    lines    labels of nodes that are joined by a line: [(1, 2, 3), (3, 4)]; default: all, in the order of their labels
    view     "xy", "xz", "yz", "3d", or "auto": a plane where the motion is plane
    seconds  that the film lasts; default: as long as the motion
    save     film to write: "film.gif", or, with ffmpeg, "film.mp4"; "frame%03d.png" writes a picture for each frame
    Returns a matplotlib animation, for notebooks: `HTML(animation.to_jshtml())`; None when pictures were written.
    """
    plt = pyplot(save)
    rate = positive("frames_per_second", frames_per_second)
    if seconds is not None:
        positive("seconds", seconds)
    labels, positions, unit = points(history)
    lasts = float(seconds if seconds is not None else (history.time[-1] - history.time[0]) * (seconds_in(history.time_unit) or 1.0))
    count = max(2, min(len(history.time), int(round(min(lasts * rate, len(history.time)))) + 1))
    chosen = np.searchsorted(history.time, np.linspace(history.time[0], history.time[-1], count)).clip(0, len(history.time) - 1)
    scene = _Scene(plt, positions[chosen], unit, labels, [labels] if lines is None else lines, view, True)
    titles = [f"{history.title + ', ' if history.title else ''}t = {history.time[k]:.3f} {after_number(history.time_unit)}" for k in chosen]
    return _play(plt, scene, titles, frames_per_second, save)


def animate_mode(modes: Modes, number: int, *, lines: Optional[Iterable[Sequence[int]]] = None, view: str = "auto", scale: float = 0.15,
                 frames: int = 32, frames_per_second: float = 16, save: Optional[Path] = None) -> Any:
    """Swings the model in one of its modes (counted from 1), enlarged: the largest displacement is `scale` of the model's size. For `lines`,
    `view`, `save` see animate_history."""
    plt = pyplot(save)
    positive("frames_per_second", frames_per_second)
    positive("scale", scale)
    if operator.index(frames) < 2:
        raise ValueError(f"`frames` must be at least 2, got {frames}")
    shape, base = modes.shape(number), modes.positions
    size = max(float(np.ptp(base, axis=0).max()), 1e-9)
    phases = np.exp(2j * np.pi * np.arange(frames) / frames)[:, None, None]
    moved = base + scale * size * np.real(phases * shape / np.abs(shape).max())
    scene = _Scene(plt, moved, modes.length_unit, modes.labels, [modes.labels] if lines is None else lines, view, False)
    percent = 100 * modes.damping[number - 1]
    frequency = f"{modes.frequencies_hz[number - 1]:.4g} {frequency_unit(modes.time_unit)}"
    title = f"mode {number}: {frequency}, damping {percent if abs(percent) > 1e-6 else 0:.2g} %"
    return _play(plt, scene, [title] * frames, frames_per_second, save)


# ---------------------------------------------------------------- linear systems

_FEW = 4              # curves whose legend has room within the axes
_NOISE = 1e-12        # of the largest response of the same output or input: round-off of one that is none
_DASHES = ("-", "--", "-.", ":")


def _curves(system: StateSpace, response: npt.NDArray[np.complex128]) -> list[tuple[int, int]]:
    """Pairs (output, input) that answer each other."""
    sizes = np.abs(response).max(axis=0)
    if not sizes.size or not sizes.max():
        raise ValueError(f"there is nothing to plot: no output ({', '.join(system.outputs) or 'there is none'}) answers an input "
                         f"({', '.join(system.inputs) or 'there is none'})")
    least = _NOISE * np.minimum(sizes.max(axis=1, keepdims=True), sizes.max(axis=0, keepdims=True))
    return [(i, j) for i, j in np.argwhere(sizes > least).tolist()]


def plot_bode(system: StateSpace, frequencies_hz: Optional[npt.ArrayLike] = None, *, save: Optional[Path] = None) -> Any:
    """Magnitude and phase of every output over every input that it answers, in the color of the input and the dashes of the output; default: two
    decades about the poles. Returns the figure."""
    plt = pyplot(save)
    frequencies = system.frequencies() if frequencies_hz is None else np.asarray(frequencies_hz, float)
    response = system.response(frequencies)
    curves = _curves(system, response)
    beside = len(curves) > _FEW
    figure = plt.figure(figsize=(12, max(6, 0.22 * len(curves))) if beside else (8, 6), layout="constrained")
    grid = figure.add_gridspec(2, 2 if beside else 1, width_ratios=[2, 1] if beside else None)
    upper = figure.add_subplot(grid[0, 0])
    lower = figure.add_subplot(grid[1, 0], sharex=upper)
    upper.tick_params(labelbottom=False)
    for i, j in curves:
        style: dict[str, Any] = {"color": f"C{j}", "linestyle": _DASHES[i % len(_DASHES)], "linewidth": 1.2}
        upper.loglog(frequencies, np.abs(response[:, i, j]), label=f"{system.outputs[i]} / {system.inputs[j]}", **style)
        lower.semilogx(frequencies, np.degrees(np.unwrap(np.angle(response[:, i, j]))), **style)
    upper.set_ylabel("magnitude")
    lower.set(xlabel=f"frequency [{frequency_unit(system.time_unit)}]", ylabel="phase [degrees]")
    for axes in (upper, lower):
        axes.grid(alpha=0.3, which="both")
    names = figure.add_subplot(grid[:, 1], frameon=False, xticks=[], yticks=[]) if beside else upper
    names.legend(*upper.get_legend_handles_labels(), fontsize="small", frameon=False, loc="center left" if beside else "best")
    return _finish(figure, save)


def plot_root_locus(system: StateSpace, gains: npt.ArrayLike, *, save: Optional[Path] = None) -> Any:
    """Poles of the loop u = -k y of one input and one output, for all gains k. Returns the figure."""
    plt = pyplot(save)
    poles = system.root_locus(gains)
    figure, axes = plt.subplots(figsize=(6.4, 5.6), layout="constrained")
    axes.plot(poles.real, poles.imag, "-", color="C0", linewidth=1)
    axes.plot(poles[0].real, poles[0].imag, "x", color="C3", label=f"k = {np.ravel(gains)[0]:g}")
    axes.plot(poles[-1].real, poles[-1].imag, "s", color="C2", markersize=4, label=f"k = {np.ravel(gains)[-1]:g}")
    axes.axvline(0, color="0.6", linewidth=0.8)
    unit = after_number(system.time_unit)
    axes.set(xlabel=f"real part [1/{unit}]", ylabel=f"imaginary part [rad/{unit}]")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return _finish(figure, save)
