"""A model's parts as objects: `simulation.nodes[3].position`, `simulation.joints["hinge"].reaction`, `simulation.inputs["valve"] = 0.2`.

Every access asks the server; to follow values over time use Simulation.simulate.
"""
from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, MutableMapping
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

from mbcosim.v1 import common_pb2, simulations_pb2 as pb

from .words import UnknownName, after_number, remedy

if TYPE_CHECKING:
    from .simulation import Simulation

Key = Union[int, str, tuple[str, int]]
Value = Any  # float, or an array of the variable's shape
_WRITABLE = (common_pb2.CAUSALITY_INPUT, common_pb2.CAUSALITY_PARAMETER)

# Names for people: of one variable of a part, or of several numbers that make a vector.
_ALIASES = {
    "position": "X", "velocity": "XP", "orientation": "R", "rotation_vector": "Phi", "angular_velocity": "Omega", "acceleration": "XPP",
    "angular_acceleration": "OmegaP", "momentum": "B", "momenta_moment": "G", "value": "x", "rate": "xP",
    "energy": "E", "potential_energy": "V", "mass": "m", "length": "L"}
_VECTORS = {"force": ("Fx", "Fy", "Fz"), "moment": ("Mx", "My", "Mz"), "reaction": ("Fx", "Fy", "Fz", "Mx", "My", "Mz"),
            "displacement": ("dx", "dy", "dz"), "relative_position": ("px", "py", "pz"), "relative_rotation": ("rx", "ry", "rz")}


def short_text(variable: common_pb2.Variable) -> str:
    """`X[3] [m], global: position`."""
    size = f"[{variable.size}]" if variable.size > 1 else ""
    unit = f" [{variable.unit}]" if variable.unit else ""
    frame = f", {variable.frame}" if variable.frame else ""
    return f"{size}{unit}{frame}: {variable.description}"


class Reading(npt.NDArray[np.float64]):
    """What a variable was when it was asked for; inputs are set by assigning a whole value."""

    def __setitem__(self, key: Any, value: Any) -> None:
        if not self.flags.writeable:
            raise ValueError("what was read is a copy, to write into it would not change the model: assign a whole value, load = node.load.copy(); "
                             "load[1] = 5; node.load = load")
        usual: Any = super()
        usual.__setitem__(key, value)

    def __array_wrap__(self, array: Any, *_: Any) -> Any:
        return np.asarray(array)[()]  # what is computed from it is a usual array or number

    def __repr__(self) -> str:
        return repr(np.asarray(self))

    def _as_a_sum(self, _: object) -> Any:
        return NotImplemented  # so that `nodes[2].load += x` assigns the sum

    __iadd__: Any = _as_a_sum
    __isub__: Any = _as_a_sum
    __imul__: Any = _as_a_sum
    __itruediv__: Any = _as_a_sum


def reading(value: Value) -> Value:
    """`value`, where it is an array as one that cannot be written into."""
    if not isinstance(value, np.ndarray):
        return value
    kept = value.view(Reading)
    kept.flags.writeable = False
    return kept


class Part:
    """A node or an element: its variables are attributes, by their names in the model (`X`, `Fz`) or by words (`position`, `force`).

    Words for vectors give those components that the part has: `reaction` of a joint is its force, then its moment, in the frame that its
    variables have (see MBDyn's manual for the joint). Attributes that are inputs can be set.
    """

    _simulation: Simulation
    label: int
    name: str       # that the deck gives, may be empty
    family: str     # "structural", "joint", …
    kind: str       # "dynamic", "revolute hinge", …
    prefix: str     # of its variables

    def __init__(self, simulation: Simulation, prefix: str, label: int, name: str, family: str, kind: str) -> None:
        self.__dict__.update(_simulation=simulation, prefix=prefix, label=label, name=name, family=family, kind=kind)

    @property
    def variables(self) -> dict[str, common_pb2.Variable]:
        """`mbcosim.v1.Variable` by its name within the part."""
        return dict(self._simulation._index().own(self.prefix))

    def _words(self, own: Mapping[str, Any]) -> dict[str, list[str]]:
        """What may be read, and which variables it stands for."""
        words = {name: [name] for name in own}
        for word, name in _ALIASES.items():
            if name in own:
                words.setdefault(word, [name])
        for word, names in _VECTORS.items():
            present = [name for name in names if name in own]
            if present:
                words.setdefault(word, present)
        return words

    def _resolve(self, word: str) -> list[str]:
        words = self._words(self.variables)
        if word not in words:
            raise AttributeError(f"{self.title} has no {word!r}; {remedy(word, sorted(words), 40)}")
        return [self.prefix + name for name in words[word]]

    def __getattr__(self, word: str) -> Value:
        if word.startswith("_"):
            raise AttributeError(word)
        names = self._resolve(word)
        read: dict[str, Value] = self._simulation.read(names)
        return reading(read[names[0]] if len(names) == 1 and word not in _VECTORS else np.array([read[name] for name in names]))

    def __setattr__(self, word: str, value: Value) -> None:
        names = self._resolve(word)
        if len(names) > 1 or self._simulation.variables[names[0]].causality not in _WRITABLE:
            inputs = [name for name, variable in self.variables.items() if variable.causality in _WRITABLE]
            raise AttributeError(f"{word!r} of {self.title} cannot be set; {remedy(word, inputs)}")
        self._simulation.write({names[0]: value})

    def __getitem__(self, word: str) -> Value:
        try:
            return getattr(self, word)
        except AttributeError as error:
            raise UnknownName(str(error)) from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(word for word in self._words(self.variables) if word.isidentifier())]

    @property
    def title(self) -> str:
        """`revolute hinge 2 "hinge"`."""
        word: str = f"{self.kind} node" if self.prefix.startswith("node.structural") else self.kind or self.family
        return f"{word} {self.label}" + (f' "{self.name}"' if self.name else "")

    def __repr__(self) -> str:
        lines = [f"  {name}{short_text(variable)}" for name, variable in self.variables.items()]
        return "\n".join([f"<{self.title}, t = {self._simulation.time:g} {after_number(self._simulation.time_unit)}>", *lines])


class Parts(Mapping[Key, Part]):
    """Parts by label, by the name that the deck gives, or by (family, label) where several families use a label."""

    def __init__(self, what: str, parts: list[Part]) -> None:
        self._what, self._parts = what, parts
        self._called: dict[Key, list[Part]] = {}
        for part in parts:
            keys: tuple[Key, ...] = (part.label, part.name, (part.family, part.label))
            for key in keys:
                self._called.setdefault(key, []).append(part)

    def __getitem__(self, key: Key) -> Part:
        found = self._called.get(key, [])
        if len(found) == 1:
            return found[0]
        if found and found[0].family == "structural" and not isinstance(key, str):  # the usual one
            return found[0]
        if found:
            pairs = " or ".join(repr((part.family, part.label)) for part in found)
            raise UnknownName(f"{len(found)} {self._what} are called {key!r}; say {pairs}")
        known = [part.name if isinstance(key, str) and part.name else own for part, own in zip(self._parts, self)]
        raise UnknownName(f"no {self._what.rstrip('s')} is called {key!r}; {remedy(key, known)}")

    def __iter__(self) -> Iterator[Key]:
        for part in self._parts:
            yield part.label if len(self._called[part.label]) == 1 else (part.family, part.label)

    def __len__(self) -> int:
        return len(self._parts)

    def _ipython_key_completions_(self) -> list[Key]:
        return [*self, *(part.name for part in self._parts if part.name)]

    def __repr__(self) -> str:
        return "\n".join([f"<{len(self)} {self._what}>", *(f"  {part.title}" for part in self._parts)])


class Variables(Mapping[str, Value]):
    """Variables of the model by name; the last part of a name, or the name of a node, will do where it is unique."""

    def __init__(self, simulation: Simulation, causalities: Optional[tuple[int, ...]], what: str) -> None:
        self._simulation, self._what = simulation, what
        self._names = {name: variable for name, variable in simulation.variables.items() if causalities is None or variable.causality in causalities}
        self._ends: dict[str, list[str]] = {}
        for name in self._names:
            self._ends.setdefault(name.split(".", 1)[-1], []).append(name)

    def _called(self, key: str) -> list[str]:
        if key in self._names:
            return [key]
        index = self._simulation._index()
        found = [name for prefix in index.named.get(key, ()) for word in index.own(prefix) if (name := prefix + word) in self._names]
        return found or self._ends.get(key, [])

    def name(self, key: str) -> str:
        """The variable's full name."""
        found = self._called(key)
        if len(found) == 1:
            return found[0]
        if found:
            raise UnknownName(f"{key!r} may be {' or '.join(map(repr, found))}")
        raise UnknownName(f"no {self._what} is called {key!r}; {remedy(key, self._names)}")

    def __getitem__(self, key: str) -> Value:
        name = self.name(key)
        return reading(self._simulation.read([name])[name])

    def __contains__(self, key: object) -> bool:
        return isinstance(key, str) and len(self._called(key)) == 1

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def _ipython_key_completions_(self) -> list[str]:
        return [*self._names, *self._simulation._index().named]

    def __repr__(self) -> str:
        return "\n".join([f"<{len(self)} {self._what}s>", *(f"  {name}{short_text(variable)}" for name, variable in self._names.items())])


class Inputs(Variables, MutableMapping[str, Value]):
    """Variables that can be set, at once: what is set holds until it is set again."""

    def __init__(self, simulation: Simulation) -> None:
        super().__init__(simulation, _WRITABLE, "input")

    def __setitem__(self, key: str, value: Value) -> None:
        self._simulation.write({self.name(key): value})

    def __delitem__(self, key: str) -> None:
        raise TypeError("inputs belong to the model; set them to zero instead")


class _Index:
    """The parts and variables of a model's description, found once."""

    def __init__(self, simulation: Simulation, description: pb.ModelDescription) -> None:
        self.description = description
        nodes = [Part(simulation, f"node.{node.family}.{node.label}.", node.label, node.name, node.family, node.kind) for node in description.nodes]
        elements = [Part(simulation, f"{e.family.replace(' ', '_')}.{e.label}.", e.label, e.name, e.family, e.type) for e in description.elements]
        self.nodes, self.elements = Parts("nodes", nodes), Parts("elements", elements)
        self.inputs, self.outputs = Inputs(simulation), Variables(simulation, None, "variable")
        self.joints = Parts("joints", [part for part in elements if part.family == "joint"])
        self.named: dict[str, list[str]] = {}  # prefixes of the parts that have a name
        self._own: dict[str, dict[str, common_pb2.Variable]] = {part.prefix: {} for part in nodes + elements}
        for part in nodes + elements:
            if part.name:
                self.named.setdefault(part.name, []).append(part.prefix)
        for variable in description.variables:
            for dot in re.finditer(r"\.", variable.name):
                if (own := self._own.get(variable.name[:dot.end()])) is not None:
                    own[variable.name[dot.end():]] = variable

    def own(self, prefix: str) -> Mapping[str, common_pb2.Variable]:
        """Variables of a part, by their names within it."""
        return self._own.get(prefix, {})


class ModelObjects:
    """The parts of a simulation's model."""

    _indexed: Optional[_Index] = None

    def _index(self: Any) -> _Index:
        description = self._description or self.describe()
        if self._indexed is None or self._indexed.description is not description:
            self._indexed = _Index(self, description)
        found: _Index = self._indexed
        return found

    @property
    def nodes(self) -> Parts:
        """All nodes: `nodes[3]` is the structural one where several families use the label; `nodes["hydraulic", 3]` another."""
        return self._index().nodes

    @property
    def elements(self) -> Parts:
        """All elements; `elements["beam", 3]` where several families use the label."""
        return self._index().elements

    @property
    def joints(self) -> Parts:
        """The joints: `joints["hinge"].reaction`."""
        return self._index().joints

    @property
    def inputs(self) -> Inputs:
        """What can be set: `inputs["valve"] = 0.2`."""
        return self._index().inputs

    @property
    def outputs(self) -> Variables:
        """What can be read, by name."""
        return self._index().outputs
