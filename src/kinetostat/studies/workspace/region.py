"""A region of pose space: its volume from random points, and the surface around the nodes inside it."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import nan, prod, sqrt

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.engine.points import PER_CELL

POWERS = {1: "", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶"}


FEWEST_CELLS = 30
"""Fewest cells from which a standard error is estimated. With fewer, both points of every cell often agree by chance,
and the error would come out as 0."""


@dataclass(frozen=True)
class Volume:
    """The volume of a region of pose space; over two coordinates, its area.

    Attributes:
        value: the volume, in the product of the SI units of the coordinates.
        standard_error: standard error of the value, in the same unit; NaN where there are too few cells for one.
        unit: the unit of both, e.g. "m³" or "m²·rad".
        box: volume of all cells together.
        cells: number of cells.
        divided: number of cells in which one point is inside and the other outside.
        unknown_cells: number of cells with a point of which nobody knows whether it is inside; such a point counts as
            outside.
    """

    value: float
    standard_error: float
    unit: str
    box: float
    cells: int
    divided: int
    unknown_cells: int

    @property
    def unknown(self) -> float:
        """By how much the region may be larger: the volume of the unknown cells, in the same unit."""
        return self.box * self.unknown_cells / self.cells

    @property
    def share(self) -> float:
        return self.value / self.box


METHOD = "stratified sampling, two random points in each cell of the grid; error from their differences"


def estimate_volume(inside: Mask, unknown: Mask, sizes: Sequence[float], units: Sequence[str]) -> Volume:
    """Estimate the volume of a region from two independent, uniform random points in each cell of a grid.

    The mean over both points is unbiased for any region. Cells are independent, and the variance of the mean of two
    points is the expectation of a quarter of their squared difference. So the standard error is the volume of a cell
    times half the square root of the number of divided cells. It falls with the number of cells to the power
    -(d + 1)/(2 d) in d dimensions.

    Args:
        inside: whether each point lies in the region; the two points of a cell follow one another [2 x cells].
        unknown: whether nobody knows that; such points are not inside [2 x cells].
        sizes: size of the box along each axis, SI.
        units: units of the axes.

    Source: W. G. Cochran, Sampling Techniques (1977), section 5.3, for the variance of a stratified mean.
    """
    pairs = inside.reshape(-1, PER_CELL)
    box = prod(sizes)
    cell = box / len(pairs)
    divided = int((pairs[:, 0] != pairs[:, 1]).sum())
    value = cell * float(inside.sum()) / PER_CELL
    error = 0.5 * cell * sqrt(divided) if len(pairs) >= FEWEST_CELLS else nan
    unknown_cells = int(unknown.reshape(-1, PER_CELL).any(axis=1).sum())
    return Volume(value, error, unit_product(units), box, len(pairs), divided, unknown_cells)


def unit_product(units: Sequence[str]) -> str:
    """Write the product of some units, e.g. "m²·rad"."""
    return "·".join(f"{unit}{POWERS[count]}" for unit, count in Counter(units).items())


CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
TETRAHEDRA = np.array([[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]])
"""Corners of the six tetrahedra about the diagonal of a cell."""
EVERYWHERE = 2
"""Layers of nodes outside the region that are added at the ends of the axes, so that its surface closes there."""


def surface(depth: Array, axes: Sequence[Array]) -> Array:
    """Triangulate the surface of a region by marching tetrahedra; corners run counter-clockwise seen from outside.

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


def _mixed_cells(field: Array) -> Integers:
    """Return the lowest corner of each cell through which the surface passes [n x 3]."""
    high = field > 0.0
    size = [n - 1 for n in field.shape]
    counts = np.zeros(size, dtype=int)
    for i, j, k in CORNERS:
        counts += high[i : i + size[0], j : j + size[1], k : k + size[2]]
    return np.argwhere((counts > 0) & (counts < len(CORNERS)))


def _cut(nodes: Array, values: Array) -> list[Array]:
    """Return the triangles in tetrahedra with given corners [n x 4 x 3] and values there [n x 4]."""
    order = np.argsort(values <= 0.0, axis=1, kind="stable")  # corners inside first
    nodes, values = np.take_along_axis(nodes, order[..., None], 1), np.take_along_axis(values, order, 1)
    count = (values > 0.0).sum(axis=1)
    # By the number of corners inside: the edges on which the corners of each triangle lie.
    cut_edges = {1: [((0, 1), (0, 2), (0, 3))], 3: [((0, 3), (1, 3), (2, 3))]}
    cut_edges[2] = [((0, 2), (0, 3), (1, 3)), ((0, 2), (1, 3), (1, 2))]
    triangles_of = []
    for inner, triangles in cut_edges.items():
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
