"""Words that people choose from, and names that they mistype."""
from __future__ import annotations

import difflib
import math
from typing import Any, Iterable, Optional

import numpy as np


class UnknownName(KeyError):
    """A KeyError whose text is for people: shown without the quotes that a KeyError puts about it."""

    def __str__(self) -> str:
        return str(self.args[0])


def listed(names: Iterable[object], most: int = 12) -> str:
    """`'a', 'b', 'c'`; of many the first ones."""
    every = [repr(name) for name in names]
    return ", ".join(every[:most]) + (f", … ({len(every)} in all)" if len(every) > most else "")


def each_name(names: Iterable[str], argument: str = "names") -> list[str]:
    """`names` as a list, also those of a generator; TypeError for one name by itself, which would be taken for its letters."""
    if isinstance(names, str):
        raise TypeError(f"`{argument}` must be a list of names, got one by itself: say [{names!r}]")
    return list(names)


def positive(name: str, value: object) -> float:
    """A number that must be above zero and finite; `name`: of the argument."""
    if not isinstance(value, (int, float, np.integer, np.floating)) or not 0 < value < math.inf:
        raise ValueError(f"`{name}` must be a positive number, got {value!r}")
    return float(value)


def remedy(name: object, known: Iterable[object], most: int = 12) -> str:
    """What to say about a name that is not among the known ones: near ones, else all."""
    known = list(known)
    near = difflib.get_close_matches(str(name), [k for k in known if isinstance(k, str)], 3)
    if near:
        return f"did you mean {' or '.join(map(repr, near))}?"
    return f"known: {listed(known, most)}" if known else "there are none"


def after_number(unit: str) -> str:
    """A unit as it follows a number: `ms`, `(deck unit of time)`."""
    return f"({unit})" if " " in unit else unit


def seconds_in(time_unit: str) -> Optional[float]:
    """Seconds in a unit of time that a deck declares; None: it declares none."""
    prefix = {"k": 1e3, "M": 1e6, "G": 1e9, "m": 1e-3, "u": 1e-6, "n": 1e-9}
    return {"s": 1.0, "min": 60.0, "h": 3600.0, **{letter + "s": factor for letter, factor in prefix.items()}}.get(time_unit)


def frequency_unit(time_unit: str) -> str:
    """Of oscillations of a deck that counts time so: `Hz`, or `1/(deck unit of time)` where nobody declared one."""
    return "Hz" if seconds_in(time_unit) is not None else f"1/({time_unit})"


def choice(kind: Any, prefix: str, word: Optional[str], what: str) -> Any:
    """Value of a protobuf enum by its name without prefix, in any case; None leaves the choice to the server (0)."""
    if word is None:
        return 0
    if isinstance(word, str) and prefix + word.upper() in kind.keys() and kind.Value(prefix + word.upper()) != 0:
        return int(kind.Value(prefix + word.upper()))
    words = [key[len(prefix):].lower() for key, value in kind.items() if value != 0]
    raise ValueError(f"{what}: no choice is called {word!r}; choose from {listed(words)}")


def pick(choices: dict[Any, Any], word: object, what: str) -> Any:
    """Value of a word of a table."""
    try:
        return choices[word]
    except (KeyError, TypeError):
        raise ValueError(f"{what}: no choice is called {word!r}; choose from {listed(choices)}") from None


def needed(module: str, purpose: str, package: str = "") -> Any:
    """A module that only some functions need; where it is missing the error says how to get it."""
    import importlib
    try:
        return importlib.import_module(module)
    except ImportError:
        name = package or module.split(".")[0]
        raise ImportError(f"{purpose} needs {name}: pip install {name}, or apt-get install python3-{name}") from None
