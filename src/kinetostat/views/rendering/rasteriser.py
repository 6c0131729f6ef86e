"""The triangle that is nearest in each pixel. Cameras and shadow maps use it; nothing here knows solids or light."""

from collections.abc import Iterator

import numpy as np

from kinetostat.arrays import Array, Float32s, Integers

CHUNK_PIXELS = 1_000_000
"""Pixels that are worked on together: some hundred megabytes at a time, however large the picture is."""
NEXT, LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
"""The two corners of a triangle that lie opposite each corner."""


def nearest_triangles(
    pixels: Array, nearness: Array, triangles: Integers, width: int, height: int
) -> tuple[Float32s, Integers]:
    """Find the nearest triangle in each pixel [height * width]: its nearness and number, 0 and -1 where there is none.

    Args:
        pixels: the places of all points [n x 2], from the upper left corner.
        nearness: the nearness of all points [n], positive, greater is nearer: linear on the picture of every plane.
        triangles: [m x 3] numbers of points, counter-clockwise as seen by the viewer; others are not seen.
        width, height: the size of the picture.
    """
    best = np.zeros(width * height, dtype=np.uint64)
    for pixel, near, triangle in _fragments(pixels, nearness, triangles, width, height):
        # Positive floats sort like integers: nearness in the upper half and number in the lower make one maximum.
        order = near.astype(np.float32).view(np.uint32).astype(np.uint64)
        np.maximum.at(best, pixel, order << np.uint64(32) | (triangle + 1).astype(np.uint64))
    number = (best & np.uint64(0xFFFFFFFF)).astype(np.int64) - 1
    return (best >> np.uint64(32)).astype(np.uint32).view(np.float32), number


def _fragments(
    pixels: Array, nearness: Array, triangles: Integers, width: int, height: int
) -> Iterator[tuple[Integers, Array, Integers]]:
    """Generate pixels, their nearness and their triangle, a pixel as often as triangles cover it, some at a time.

    Every triangle is cut into rows, and every row into pixels: long thin triangles have few pixels in a large box.
    """
    x, y = pixels[triangles.T].transpose(2, 0, 1)
    area = (y[1] - y[0]) * (x[2] - x[0]) - (x[1] - x[0]) * (y[2] - y[0])
    first = np.clip(np.ceil(y.min(axis=0) - 0.5), 0, height).astype(np.int64)
    last = np.clip(np.floor(y.max(axis=0) - 0.5), -1, height - 1).astype(np.int64)
    visible = np.flatnonzero((last >= first) & (area > 0.0))
    x, y, area, first, rows = x[:, visible], y[:, visible], area[visible], first[visible], (last - first + 1)[visible]
    # The line opposite each corner: a x + b y + c is positive inside, and the share of the corner there times the area.
    lines = np.stack([y[LAST] - y[NEXT], x[NEXT] - x[LAST], x[LAST] * y[NEXT] - x[NEXT] * y[LAST]])
    plane = np.einsum("kim,im->km", lines, nearness[triangles[visible].T] / area)
    sizes = np.cumsum(rows + 0.5 * area)
    for chosen in np.split(np.arange(len(visible)), np.flatnonzero(np.diff(sizes // CHUNK_PIXELS)) + 1):
        triangle, row = _runs(chosen, first[chosen], rows[chosen])
        left, right = _spans(lines[:, :, triangle], row, width)
        span, column = _runs(np.arange(len(triangle)), left, np.maximum(right - left + 1, 0))
        triangle, row = triangle[span], row[span]
        across, down, rest = plane[:, triangle]
        yield row * width + column, across * (column + 0.5) + down * (row + 0.5) + rest, visible[triangle]


def _runs(owners: Integers, starts: Integers, counts: Integers) -> tuple[Integers, Integers]:
    """Repeat each owner as often as it counts, with start, start + 1, ... beside it."""
    total = np.cumsum(counts)
    offsets = np.arange(total[-1] if len(total) else 0) - np.repeat(total - counts, counts)
    return np.repeat(owners, counts), np.repeat(starts, counts) + offsets


def _spans(lines: Array, row: Integers, width: int) -> tuple[Integers, Integers]:
    """Return first and last pixel of triangles in rows; there is none where the last is before the first."""
    slope, rest = lines[0], lines[1] * (row + 0.5) + lines[2]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = -rest / slope
    low = np.where(slope > 0.0, crossing, -np.inf).max(axis=0)
    high = np.where(slope < 0.0, crossing, np.inf).min(axis=0)
    high = np.where(np.any((slope == 0.0) & (rest < 0.0), axis=0), -np.inf, high)
    left = np.ceil(np.clip(low - 0.5, 0.0, width)).astype(np.int64)
    right = np.floor(np.clip(high - 0.5, -1.0, width - 1.0)).astype(np.int64)
    return left, right
