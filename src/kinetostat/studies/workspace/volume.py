"""How much of a box a region fills, from two random points in each cell of it: a mean and how uncertain it is."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import prod, sqrt

import numpy as np
import numpy.typing as npt

from kinetostat.engine.points import PER_CELL

POWERS = {1: "", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶"}


@dataclass(frozen=True)
class Volume:
    """Volume (area) of a region of pose space.

    Attributes:
        value: product of the coordinates' units, SI.
        standard_error: of it, likewise.
        unit: of both, e.g. "m³" or "m²·rad".
        box: volume of all cells together.
        cells, divided: how many there are, and in how many of them one point is inside and the other outside.
    """

    value: float
    standard_error: float
    unit: str
    box: float
    cells: int
    divided: int

    @property
    def share(self) -> float:
        """Of the box."""
        return self.value / self.box


METHOD = "stratified sampling, two random points in each cell of the grid; error from their differences"


def estimate_volume(inside: npt.NDArray[np.bool_], sizes: Sequence[float], units: Sequence[str]) -> Volume:
    """The volume of a region from whether two independent, uniform points of each cell lie in it.

    The mean over both points is without bias, whatever the region. Cells are independent, and the mean of two points
    has the variance that a quarter of their squared difference has on average: so the standard error is the volume of a
    cell times half the square root of the number of divided cells. It falls as the power -(d + 1)/(2 d) of the number
    of cells in d dimensions.

    Args:
        inside: cell by cell, its points one after the other [2 x cells].
        sizes: of the box along each axis, SI.
        units: of the axes.

    Source: W. G. Cochran, Sampling Techniques (1977), section 5.3, for the variance of a stratified mean.
    """
    pairs = inside.reshape(-1, PER_CELL)
    box = prod(sizes)
    cell = box / len(pairs)
    divided = int((pairs[:, 0] != pairs[:, 1]).sum())
    value, error = cell * float(inside.sum()) / PER_CELL, 0.5 * cell * sqrt(divided)
    return Volume(value, error, unit_product(units), box, len(pairs), divided)


def unit_product(units: Sequence[str]) -> str:
    """The product of some units as people read it, e.g. "m²·rad"."""
    return "·".join(f"{unit}{POWERS[count]}" for unit, count in Counter(units).items())
