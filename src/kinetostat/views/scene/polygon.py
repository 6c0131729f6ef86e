"""Outlines in the plane: narrower by a margin, and cut into triangles. No solid is known here."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SHARPEST = 0.1
"""Least share of an edge's normal in a corner's bisector: a needle's tip is not drawn back without end."""


def edge_normals(outline: Array) -> Array:
    """Unit normals [n x 2], pointing out, of the edges from each corner of a counter-clockwise outline to the next."""
    edges = np.roll(outline, -1, axis=0) - outline
    normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def narrowed(outline: Array, margin: float) -> Array:
    """The corners [n x 2] of an outline whose edges have all moved inwards by `margin` (the outline's unit)."""
    after = edge_normals(outline)
    both = after + np.roll(after, 1, axis=0)
    shares = np.einsum("ij,ij->i", both, after)
    return outline - margin * both / np.maximum(shares, SHARPEST)[:, None]


def cut_in_triangles(outline: Array) -> list[tuple[int, int, int]]:
    """A simple counter-clockwise outline as n - 2 triangles of its corners' numbers (by clipping ears).

    Source: G. H. Meisters, Polygons have ears, American Mathematical Monthly 82 (1975).
    """
    points = [(float(x), float(y)) for x, y in outline]
    left = list(range(len(points)))
    found = []
    while len(left) > 3:
        at = next((i for i in range(len(left)) if _is_ear(points, left, i)), _widest(points, left))
        found.append((left[at - 1], left[at], left[(at + 1) % len(left)]))
        del left[at]
    return [*found, (left[0], left[1], left[2])]


def _is_ear(points: Sequence[tuple[float, float]], left: Sequence[int], at: int) -> bool:
    """Whether the triangle at a corner lies inside and holds no other corner."""
    corners = left[at - 1], left[at], left[(at + 1) % len(left)]
    a, b, c = (points[i] for i in corners)
    if _turn(a, b, c) <= 0.0:
        return False
    others = (points[i] for i in left if i not in corners)
    return not any(min(_turn(a, b, p), _turn(b, c, p), _turn(c, a, p)) >= 0.0 for p in others)


def _widest(points: Sequence[tuple[float, float]], left: Sequence[int]) -> int:
    """The corner that turns most to the left: the next best where rounding has hidden every ear."""
    turns = [_turn(points[left[i - 1]], points[left[i]], points[left[(i + 1) % len(left)]]) for i in range(len(left))]
    return max(range(len(left)), key=turns.__getitem__)


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Twice the area of a triangle, positive if it is counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
