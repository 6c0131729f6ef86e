"""Points of parameter space that a batch visits: a grid, a table, designs at poses or random samples, slab by slab.

Nothing is evaluated here. Points are computed from their numbers, so that a large grid is never in memory at once.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from math import prod
from typing import Protocol

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass


class Points(Protocol):
    """Points of parameter space, numbered from 0; `Axis` apart, all classes of this file are such."""

    @property
    def size(self) -> int:
        """Number of points."""

    @property
    def paths(self) -> tuple[str, ...]:
        """Leaf paths of the parameters that vary."""

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        """Return the values of each varying parameter at points `start` to `stop` - 1, SI."""


@dataclass(frozen=True)
class Axis:
    """One axis of a grid: its values, and the leaf paths of the parameters that all take the same value."""

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
        return prod(self.shape)

    @property
    def paths(self) -> tuple[str, ...]:
        return tuple(path for axis in self.axes for path in axis.paths)

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        result: dict[str, Array] = {}
        # The value of an axis stays the same while all later axes run through theirs.
        run = self.size
        for axis in self.axes:
            run //= len(axis.values)
            result.update(dict.fromkeys(axis.paths, _in_runs(axis.values, run, start, stop)))
        return result


def _in_runs(values: Array, run: int, start: int, stop: int) -> Array:
    """Return entries `start` to `stop` - 1 of the values in turn, each `run` times in a row, over and over again.

    This is eight times as fast as indices from `numpy.unravel_index`, which take longer than the machine code that
    evaluates the points.
    """
    first, last = start // run, -(-stop // run)
    entries = _in_turn(values, first % len(values), last - first)
    if run <= stop - start:
        return np.repeat(entries, run)[start - first * run : stop - first * run]
    # Runs longer than the slab: whole runs would be far larger than what is needed, so that both ends are cut first.
    lengths = np.full(last - first, run)
    lengths[0] -= start - first * run
    lengths[-1] -= last * run - stop
    return np.repeat(entries, lengths)


def _in_turn(values: Array, first: int, count: int) -> Array:
    """Return `count` entries of the values in turn, over and over again, beginning with entry `first`."""
    if count < len(values):
        return values.take(np.arange(first, first + count), mode="wrap")
    return np.tile(np.roll(values, -first), -(-count // len(values)))[:count]


@dataclass(frozen=True)
class PointTable:
    """Points in any order, given by one column of values for each varying parameter."""

    values: Mapping[str, Array]

    @property
    def size(self) -> int:
        return len(next(iter(self.values.values())))

    @property
    def paths(self) -> tuple[str, ...]:
        return tuple(self.values)

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        return {path: column[start:stop] for path, column in self.values.items()}


@dataclass(frozen=True)
class ConsecutivePoints:
    """Consecutive points, `start` to `stop` - 1, of a larger set."""

    whole: Points
    start: int
    stop: int

    @property
    def size(self) -> int:
        return self.stop - self.start

    @property
    def paths(self) -> tuple[str, ...]:
        return self.whole.paths

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        return self.whole.columns(self.start + start, self.start + stop)


@dataclass(frozen=True)
class Population:
    """Every design at every pose; poses run fastest.

    Attributes:
        designs: values by leaf path, SI [designs]; at least one.
        poses: values by other leaf paths, SI [poses]; none for the machine's own pose.
    """

    designs: Mapping[str, Array]
    poses: Mapping[str, Array]

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Designs and poses."""
        return len(next(iter(self.designs.values()))), len(next(iter(self.poses.values()), (0.0,)))

    @property
    def size(self) -> int:
        return self.shape[0] * self.shape[1]

    @property
    def paths(self) -> tuple[str, ...]:
        return *self.designs, *self.poses

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        design, pose = np.divmod(np.arange(start, stop), self.shape[1])
        return {path: column[design] for path, column in self.designs.items()} | {
            path: column[pose] for path, column in self.poses.items()
        }


PER_CELL = 2
"""Points in each cell: two are the fewest whose difference tells how uncertain their mean is."""
PHILOX_WORDS = 4
"""Random numbers that Philox makes for each step of its counter."""
KEYS_PER_SEED = 64
"""Keys of Philox that a seed has for itself, one for each axis: more than any grid has axes."""


@dataclass(frozen=True)
class Cells:
    """The cells between the nodes of a grid, each with two random points in a row; the last axis runs fastest.

    A point depends only on the seed, the axis and its number, so that any slab of points can be computed by itself.

    Attributes:
        axes: axes of the grid, each with two nodes or more.
        seed: seed of the random numbers.
    """

    axes: Sequence[Axis]
    seed: int = 0

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of cells along each axis."""
        return tuple(len(axis.values) - 1 for axis in self.axes)

    @property
    def size(self) -> int:
        return PER_CELL * prod(self.shape)

    @property
    def paths(self) -> tuple[str, ...]:
        return tuple(path for axis in self.axes for path in axis.paths)

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        indices = np.unravel_index(np.arange(start, stop) // PER_CELL, self.shape)
        result: dict[str, Array] = {}
        for number, (axis, index) in enumerate(zip(self.axes, indices, strict=True)):
            lower, upper = axis.values[index], axis.values[index + 1]
            values = lower + (upper - lower) * self._shares(number, start, stop)
            result.update(dict.fromkeys(axis.paths, values))
        return result

    def _shares(self, axis: int, start: int, stop: int) -> Array:
        """Return random numbers, uniform from 0 to 1: where in its cell each point lies along an axis."""
        # Philox can start anywhere in its sequence; each axis has a key, and so a sequence, of its own.
        block = start // PHILOX_WORDS
        source = np.random.Philox(key=self.seed * KEYS_PER_SEED + axis, counter=block)
        return np.random.Generator(source).random(stop - block * PHILOX_WORDS)[start - block * PHILOX_WORDS :]
