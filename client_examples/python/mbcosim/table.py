"""Values of many steps as they come from the server in one call."""
from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from mbcosim.v1 import common_pb2, simulations_pb2 as pb


class Rows:
    """Rows in blocks of `mbcosim.v1.TableBlock`; `variables`: `mbcosim.v1.Variable` of the columns."""

    def __init__(self, variables: Sequence[common_pb2.Variable]) -> None:
        self._variables = variables
        self._steps, self._times = [np.empty(0, np.int64)], [np.empty(0)]
        self._width = sum(variable.size for variable in variables)
        self._values = [np.empty((0, self._width))]

    def add(self, block: pb.TableBlock) -> None:
        """Takes the next block."""
        count = len(block.steps)
        self._steps.append(np.fromiter(block.steps, np.int64, count))
        self._times.append(np.fromiter(block.times, float, count))
        self._values.append(np.fromiter(block.values, float, len(block.values)).reshape(count, self._width))

    @property
    def steps(self) -> npt.NDArray[np.int64]:
        """Numbers of the steps."""
        return np.concatenate(self._steps)

    @property
    def times(self) -> npt.NDArray[np.float64]:
        """Times [s]."""
        return np.concatenate(self._times)

    def values(self) -> dict[str, npt.NDArray[np.float64]]:
        """Arrays by name, the first axis is the row."""
        numbers, at = np.concatenate(self._values), 0
        found: dict[str, npt.NDArray[Any]] = {}
        for variable in self._variables:
            found[variable.name] = numbers[:, at:at + variable.size].reshape(len(numbers), *variable.shape)
            at += variable.size
        return found

    def units(self) -> dict[str, str]:
        """By name."""
        return {variable.name: variable.unit for variable in self._variables}
