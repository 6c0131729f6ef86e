"""Points at random in the cells of a grid: stratified samples, served slab by slab. Nothing is evaluated here."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from kinetostat.engine.points import Array, Axis

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
