"""Points of parameter space that a batch visits: a grid, a table or random samples, served slab by slab.

Nothing is evaluated here.
"""

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
        served: dict[str, Array] = {}
        run = self.size
        for axis in self.axes:
            run //= len(axis.values)
            served.update(dict.fromkeys(axis.paths, _in_runs(axis.values, run, start, stop)))
        return served


def _in_runs(values: Array, run: int, start: int, stop: int) -> Array:
    """Entries `start` to `stop` - 1 of the endless repetition of values, each of which stands `run` times in a row.

    Eight times as fast as indices from `numpy.unravel_index`, which take longer than machine code does.
    """
    first, last = start // run, -(-stop // run)
    met = _repeated(values, first % len(values), last - first)
    if run <= stop - start:
        return np.repeat(met, run)[start - first * run : stop - first * run]
    lengths = np.full(last - first, run)
    lengths[0] -= start - first * run
    lengths[-1] -= last * run - stop
    return np.repeat(met, lengths)


def _repeated(values: Array, first: int, count: int) -> Array:
    """Entries of the endless repetition of values."""
    if count < len(values):
        return values.take(np.arange(first, first + count), mode="wrap")
    return np.tile(np.roll(values, -first), -(-count // len(values)))[:count]


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


@dataclass(frozen=True)
class Part:
    """A run of consecutive points of others."""

    whole: Points
    start: int
    stop: int

    @property
    def size(self) -> int:
        """How many."""
        return self.stop - self.start

    @property
    def paths(self) -> tuple[str, ...]:
        """Leaf paths of the parameters that vary."""
        return self.whole.paths

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        """Values of each varying parameter at points `start` to `stop` - 1 of this part, SI."""
        return self.whole.columns(self.start + start, self.start + stop)


PER_CELL = 2
"""Points of a cell: the fewest whose difference tells how uncertain their mean is."""
WORDS = 4
"""Numbers that the generator makes at a time."""


@dataclass(frozen=True)
class Cells:
    """The cells between the nodes of a grid, each with two random points in a row; the last axis runs fastest.

    The points depend on the seed, the axis and their number alone, so that any run of them can be served apart.

    Attributes:
        axes: of the grid, each with two nodes or more.
        seed: of the random numbers.
    """

    axes: Sequence[Axis]
    seed: int = 0

    @property
    def shape(self) -> tuple[int, ...]:
        """Cells along each axis."""
        return tuple(len(axis.values) - 1 for axis in self.axes)

    @property
    def size(self) -> int:
        """Number of points."""
        return PER_CELL * prod(self.shape)

    @property
    def paths(self) -> tuple[str, ...]:
        """Leaf paths of the parameters that vary."""
        return tuple(path for axis in self.axes for path in axis.paths)

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        """Values of each varying parameter at points `start` to `stop` - 1, SI."""
        indices = np.unravel_index(np.arange(start, stop) // PER_CELL, self.shape)
        served: dict[str, Array] = {}
        for number, (axis, index) in enumerate(zip(self.axes, indices, strict=True)):
            lower, upper = axis.values[index], axis.values[index + 1]
            taken = lower + (upper - lower) * self._shares(number, start, stop)
            served.update(dict.fromkeys(axis.paths, taken))
        return served

    def _shares(self, axis: int, start: int, stop: int) -> Array:
        """Uniform between 0 and 1, by the points' numbers."""
        block = start // WORDS
        source = np.random.Philox(key=self.seed * 64 + axis, counter=block)
        return np.random.Generator(source).random(stop - block * WORDS)[start - block * WORDS :]
