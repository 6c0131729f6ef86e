"""Triangles on a picture: which pixels they cover and which of them is nearest there. Knows no light."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CHUNK = 1_500_000
"""Pixels and rows that are looked at together: what stays in memory."""


@dataclass(frozen=True)
class Fragments:
    """Pixels of triangles, a pixel as often as triangles cover it.

    Attributes:
        pixel: number of each, row by row.
        nearness: of the triangle there: greater is nearer.
        triangle: its number.
    """

    pixel: Indices
    nearness: Array
    triangle: Indices


@dataclass(frozen=True)
class Edges:
    """The lines opposite the corners of m triangles: a x + b y + c is positive inside, in sum twice the area anywhere.

    Attributes:
        a, b, c: [3 x m].
        area: twice the area of each [m], pixels^2; negative of those that face away.
    """

    a: Array
    b: Array
    c: Array
    area: Array

    def weights(self, triangle: Indices, x: Array, y: Array) -> Array:
        """Shares [3 x n] of the corners at points of triangles."""
        at = self.a[:, triangle] * x + self.b[:, triangle] * y + self.c[:, triangle]
        shares: Array = at / self.area[triangle]
        return shares


def edges_of(pixels: Array, triangles: Indices) -> Edges:
    """The edges of triangles [m x 3] of points [n x 2] in pixels, clockwise on a picture whose y points down."""
    x, y = pixels[triangles.T].transpose(2, 0, 1)
    from_x, from_y, to_x, to_y = x[_NEXT], y[_NEXT], x[_LAST], y[_LAST]
    return Edges(to_y - from_y, from_x - to_x, to_x * from_y - from_x * to_y, _doubled(x, y))


_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def _doubled(x: Array, y: Array) -> Array:
    """Twice the area of triangles with corners [3 x m], positive of those that face the viewer."""
    return np.asarray((y[1] - y[0]) * (x[2] - x[0]) - (x[1] - x[0]) * (y[2] - y[0]))


def fragments(pixels: Array, nearness: Array, triangles: Indices, width: int, height: int) -> Iterator[Fragments]:
    """What triangles that face the viewer cover of a picture, some at a time.

    Args:
        pixels: of all points [n x 2], from the upper left corner.
        nearness: of all points [n]: a linear function on the picture of every plane.
        triangles: [m x 3] numbers of points, counter-clockwise as seen by the viewer.
        width, height: of the picture.
    """
    lefts, tops = (pixels[:, i][triangles.T] for i in range(2))
    first = np.clip(np.ceil(tops.min(axis=0) - 0.5), 0, height).astype(np.int64)
    last = np.clip(np.floor(tops.max(axis=0) - 0.5), -1, height - 1).astype(np.int64)
    kept = np.flatnonzero((last >= first) & (_doubled(lefts, tops) > 0.0))
    edges = edges_of(pixels, triangles[kept])
    shares = nearness[triangles[kept].T] / edges.area
    across, up, rest = ((one * shares).sum(axis=0) for one in (edges.a, edges.b, edges.c))
    rows = last[kept] - first[kept] + 1
    sizes = np.cumsum(rows + 0.5 * edges.area)
    for chosen in np.split(np.arange(len(kept)), np.flatnonzero(np.diff(sizes // CHUNK)) + 1):
        triangle, y = _expanded(chosen, first[kept[chosen]], rows[chosen])
        left, right = _spans(edges, triangle, y, width)
        at, x = _expanded(np.arange(len(triangle)), left, np.maximum(right - left + 1, 0))
        triangle, y = triangle[at], y[at]
        near = across[triangle] * (x + 0.5) + up[triangle] * (y + 0.5) + rest[triangle]
        yield Fragments(y * width + x, near, kept[triangle])


def _expanded(owners: Indices, starts: Indices, counts: Indices) -> tuple[Indices, Indices]:
    """Each owner as often as it counts, with start, start + 1, ... beside it."""
    total = np.cumsum(counts)
    offsets = np.arange(total[-1] if len(total) else 0) - np.repeat(total - counts, counts)
    return np.repeat(owners, counts), np.repeat(starts, counts) + offsets


def _spans(edges: Edges, triangle: Indices, y: Indices, width: int) -> tuple[Indices, Indices]:
    """First and last pixel of triangles in rows; none where the last is before the first."""
    a, rest = edges.a[:, triangle], edges.b[:, triangle] * (y + 0.5) + edges.c[:, triangle]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = -rest / a
    low = np.where(a > 0.0, crossing, -np.inf).max(axis=0)
    high = np.where(a < 0.0, crossing, np.inf).min(axis=0)
    high = np.where(np.any((a == 0.0) & (rest < 0.0), axis=0), -np.inf, high)
    left = np.ceil(np.clip(low - 0.5, 0.0, width)).astype(np.int64)
    right = np.floor(np.clip(high - 0.5, -1.0, width - 1.0)).astype(np.int64)
    return left, right


def depth_map(pixels: Array, nearness: Array, triangles: Indices, side: int) -> NDArray[np.float32]:
    """The nearness of the nearest triangle in each pixel of a square picture [side * side]; -inf where is none."""
    nearest = np.full(side * side, -np.inf, dtype=np.float32)
    for some in fragments(pixels, nearness, triangles, side, side):
        np.maximum.at(nearest, some.pixel, some.nearness.astype(np.float32))
    return nearest


def nearest_triangles(
    pixels: Array, nearness: Array, triangles: Indices, width: int, height: int
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """In each pixel [height * width] the nearness and the number of the nearest triangle; 0 and -1 where there is none.

    Args:
        pixels, nearness, triangles: as for `fragments`; nearness is positive.
        width, height: of the picture.
    """
    best = np.zeros(width * height, dtype=np.uint64)
    for some in fragments(pixels, nearness, triangles, width, height):
        order = some.nearness.astype(np.float32).view(np.uint32).astype(np.uint64)  # floats above 0 sort like integers
        np.maximum.at(best, some.pixel, order << np.uint64(32) | (some.triangle + 1).astype(np.uint64))
    number = (best & np.uint64(0xFFFFFFFF)).astype(np.int64) - 1
    return (best >> np.uint64(32)).astype(np.uint32).view(np.float32), number.astype(np.int32)
