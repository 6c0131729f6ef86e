"""Outlines in the plane: convex hulls, outlines made wider or narrower, and triangles. No solid is known here."""

import math
from collections.abc import Sequence

import numpy as np

from kinetostat.arrays import Array
from kinetostat.views.scene.shapes import CORNER_POINTS, HALF_CIRCLE_POINTS
from kinetostat.views.scene.solids import Point2

LEAST_BISECTOR_SHARE = 0.1
"""Least component of a corner's bisector along an edge's normal: a sharp tip would otherwise move far back."""


def edge_normals(outline: Array) -> Array:
    """Return the unit normals [n x 2], outwards, of the edges from each corner of a counter-clockwise outline on."""
    edges = np.roll(outline, -1, axis=0) - outline
    normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def inset_outline(outline: Array, margin: float) -> Array:
    """Move all edges of an outline inwards by `margin` (the outline's unit), and return the corners [n x 2]."""
    normals = edge_normals(outline)
    bisectors = normals + np.roll(normals, 1, axis=0)
    shares = np.einsum("ij,ij->i", bisectors, normals)
    return outline - margin * bisectors / np.maximum(shares, LEAST_BISECTOR_SHARE)[:, None]


def cut_in_triangles(outline: Array) -> list[tuple[int, int, int]]:
    """Cut a simple counter-clockwise outline into n - 2 triangles of its corners' numbers, by clipping ears.

    Source: G. H. Meisters, Polygons have ears, American Mathematical Monthly 82 (1975).
    """
    points = [(float(x), float(y)) for x, y in outline]
    left = list(range(len(points)))
    triangles = []
    while len(left) > 3:
        tip = next((i for i in range(len(left)) if _is_ear(points, left, i)), _most_turning(points, left))
        triangles.append((left[tip - 1], left[tip], left[(tip + 1) % len(left)]))
        del left[tip]
    return [*triangles, (left[0], left[1], left[2])]


def _is_ear(points: Sequence[tuple[float, float]], left: Sequence[int], tip: int) -> bool:
    """Whether the triangle at a corner lies inside and holds no other corner."""
    corners = left[tip - 1], left[tip], left[(tip + 1) % len(left)]
    a, b, c = (points[i] for i in corners)
    if _turn(a, b, c) <= 0.0:
        return False
    others = (points[i] for i in left if i not in corners)
    return not any(min(_turn(a, b, p), _turn(b, c, p), _turn(c, a, p)) >= 0.0 for p in others)


def _most_turning(points: Sequence[tuple[float, float]], left: Sequence[int]) -> int:
    """The corner that turns most to the left: the best choice where round-off has hidden every ear."""
    turns = [_turn(points[left[i - 1]], points[left[i]], points[left[(i + 1) % len(left)]]) for i in range(len(left))]
    return max(range(len(left)), key=turns.__getitem__)


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Twice the area of a triangle, positive if it is counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def rounded_hull(points: Sequence[Point2], margin: float) -> tuple[Point2, ...]:
    """Return the convex hull of points, widened by `margin` with round corners, counter-clockwise."""
    hull = convex_hull(points)
    if len(hull) == 1:
        angles = [math.tau * i / (4 * HALF_CIRCLE_POINTS) for i in range(4 * HALF_CIRCLE_POINTS)]
        return tuple((hull[0][0] + margin * math.cos(a), hull[0][1] + margin * math.sin(a)) for a in angles)
    corners: list[Point2] = []
    for i, (x, y) in enumerate(hull):
        (px, py), (nx, ny) = hull[i - 1], hull[(i + 1) % len(hull)]
        first = math.atan2(y - py, x - px) - 0.5 * math.pi
        turn = (math.atan2(ny - y, nx - x) - 0.5 * math.pi - first) % math.tau
        count = max(2, math.ceil(2 * CORNER_POINTS * turn / math.pi))
        angles = [first + turn * k / count for k in range(count + 1)]
        corners += [(x + margin * math.cos(a), y + margin * math.sin(a)) for a in angles]
    return tuple(corners)


def convex_hull(points: Sequence[Point2]) -> list[Point2]:
    """Return the corners of the convex hull, counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted(set(points))
    if len(ordered) < 3:
        return ordered

    def half(along: Sequence[Point2]) -> list[Point2]:
        kept: list[Point2] = []
        for x, y in along:
            while len(kept) > 1 and _turn(kept[-2], kept[-1], (x, y)) <= 0.0:
                kept.pop()
            kept.append((x, y))
        return kept[:-1]

    return half(ordered) + half(ordered[::-1])
