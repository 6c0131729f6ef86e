"""Which points of parameter space a batch visits: a grid or a table, served slab by slab. Nothing is evaluated here."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import prod
from typing import Protocol

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class Points(Protocol):
    """Points of parameter space, numbered from 0."""

    @property
    def size(self) -> int:
        """How many."""

    @property
    def paths(self) -> tuple[str, ...]:
        """Leaf paths of the parameters that vary."""

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        """Values of each varying parameter at points `start` to `stop` - 1, SI."""


@dataclass(frozen=True)
class Axis:
    """One axis of a grid: its values, and the leaf paths that all take them together."""

    paths: tuple[str, ...]
    values: Array


@dataclass(frozen=True)
class Grid:
    """All combinations of the values of some axes; the last axis runs fastest."""

    axes: Sequence[Axis]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values along each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def size(self) -> int:
        """How many."""
        return prod(self.shape)

    @property
    def paths(self) -> tuple[str, ...]:
        """Leaf paths of the parameters that vary."""
        return tuple(path for axis in self.axes for path in axis.paths)

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        """Values of each varying parameter at points `start` to `stop` - 1, SI."""
        indices = np.unravel_index(np.arange(start, stop), self.shape)
        served: dict[str, Array] = {}
        for axis, index in zip(self.axes, indices, strict=True):
            taken = axis.values[index]
            served.update(dict.fromkeys(axis.paths, taken))
        return served


@dataclass(frozen=True)
class Table:
    """Any points: one column of values for each varying parameter."""

    values: Mapping[str, Array]

    @property
    def size(self) -> int:
        """How many."""
        return len(next(iter(self.values.values())))

    @property
    def paths(self) -> tuple[str, ...]:
        """Leaf paths of the parameters that vary."""
        return tuple(self.values)

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        """Values of each varying parameter at points `start` to `stop` - 1, SI."""
        return {path: column[start:stop] for path, column in self.values.items()}
