"""A region of pose space: its volume from random points, and the surface around the nodes inside it."""

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
        standard_error: of the value, in the same unit.
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


Array = npt.NDArray[np.float64]

CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
TETRAHEDRA = np.array([[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]])
"""Corners of the six tetrahedra about the diagonal of a cell."""
EVERYWHERE = 2
"""Nodes outside that are added around the region, so that its surface closes at the ends of the axes."""


def surface(depth: Array, axes: Sequence[Array]) -> Array:
    """Triangles around a region, their corners turning to the left as seen from outside [n x 3 x 3].

    Args:
        depth: positive at nodes inside, negative outside, 0 on the surface between [nx x ny x nz].
        axes: evenly spaced coordinates of the nodes; the triangles are in the same units and stay between their ends.
    """
    field = np.pad(depth, EVERYWHERE, constant_values=-1.0)
    cells = _mixed_cells(field)
    parts = []
    for corners in TETRAHEDRA:
        nodes = cells[:, None, :] + CORNERS[corners]
        parts += _cut(nodes.astype(float), field[nodes[..., 0], nodes[..., 1], nodes[..., 2]])
    triangles = np.concatenate(parts) if parts else np.zeros((0, 3, 3))
    start = np.array([axis[0] for axis in axes])
    step = np.array([axis[1] - axis[0] for axis in axes])
    return np.clip(start + (triangles - EVERYWHERE) * step, start, [axis[-1] for axis in axes])


def _mixed_cells(field: Array) -> npt.NDArray[np.int64]:
    """Lowest corners of the cells through which the surface passes [n x 3]."""
    high = field > 0.0
    size = [n - 1 for n in field.shape]
    counts = np.zeros(size, dtype=int)
    for i, j, k in CORNERS:
        counts += high[i : i + size[0], j : j + size[1], k : k + size[2]]
    return np.argwhere((counts > 0) & (counts < len(CORNERS)))


def _cut(nodes: Array, values: Array) -> list[Array]:
    """Triangles in tetrahedra with given corners [n x 4 x 3] and values there [n x 4]."""
    order = np.argsort(values <= 0.0, axis=1, kind="stable")  # corners inside first
    nodes, values = np.take_along_axis(nodes, order[..., None], 1), np.take_along_axis(values, order, 1)
    count = (values > 0.0).sum(axis=1)
    sides = {1: [((0, 1), (0, 2), (0, 3))], 3: [((0, 3), (1, 3), (2, 3))]}
    sides[2] = [((0, 2), (0, 3), (1, 3)), ((0, 2), (1, 3), (1, 2))]
    triangles_of = []
    for inner, triangles in sides.items():
        chosen = count == inner
        corners, at = nodes[chosen], values[chosen]
        outward = corners[:, inner:].mean(axis=1) - corners[:, :inner].mean(axis=1)
        for edges in triangles:
            points = np.stack([_crossing(corners, at, *edge) for edge in edges], axis=1)
            normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
            inverted = (normal * outward).sum(axis=1) < 0.0
            points[inverted] = points[inverted][:, ::-1]
            triangles_of.append(points)
    return triangles_of


def _crossing(corners: Array, values: Array, first: int, other: int) -> Array:
    share = -values[:, first] / (values[:, other] - values[:, first])
    return corners[:, first] + share[:, None] * (corners[:, other] - corners[:, first])
