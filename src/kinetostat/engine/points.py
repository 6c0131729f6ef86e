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
