"""Convex polytopes from their half-spaces A x <= b with b > 0: vertices, and outlines of cuts through the origin.

Half-spaces and vertices are dual: each vertex belongs to a facet of the convex hull of the points a / b. No machine is
known here.

Source: G. M. Ziegler, Lectures on Polytopes (1995), section 2.3.
"""

import math

import numpy as np

from kinetostat.arrays import Array
from kinetostat.late import LateModule
from kinetostat.tolerances import SAME_VERTEX

spatial = LateModule("scipy.spatial")


def vertices(normals: Array, bounds: Array) -> Array | None:
    """The vertices of a polytope that holds the origin inside.

    Args:
        normals: A [m x n]; rows of comparable size.
        bounds: b > 0 [m]; infinite ones bound nothing.

    Returns:
        The vertices [k x n]; None where the polytope has no end in some direction.
    """
    bounding = np.isfinite(bounds)
    dual = normals[bounding] / bounds[bounding, None]
    count = normals.shape[1]
    if len(dual) <= count or np.linalg.matrix_rank(dual) < count:
        return None
    if count == 1:
        ends = 1.0 / dual.max(), 1.0 / dual.min()
        return np.array(ends).reshape(-1, 1) if dual.min() < 0.0 < dual.max() else None
    size = np.abs(dual).max()
    facets = spatial.ConvexHull(dual / size).equations
    if (facets[:, -1] > -SAME_VERTEX).any():  # the origin is not inside the dual: some direction has no bound
        return None
    points = -facets[:, :-1] / facets[:, -1:] / size
    return _without_repetitions(points)


def _without_repetitions(points: Array) -> Array:
    """The points without those that equal an earlier one to round-off."""
    scale = SAME_VERTEX * np.abs(points).max()
    _, first = np.unique(np.round(points / scale), axis=0, return_index=True)
    kept = points[np.sort(first)]
    # Rounding may part two points that are one: what is left is compared directly.
    apart = np.abs(kept[:, None] - kept[None]).max(axis=2) > 2.0 * scale
    return np.asarray(kept[[bool(apart[i, :i].all()) for i in range(len(kept))]])


def outline(normals: Array, bounds: Array, reach: float) -> Array:
    """The corners of a polygon that holds the origin inside, counter-clockwise [k x 2].

    Args:
        normals: A [m x 2].
        bounds: b > 0 [m].
        reach: half the side of a square at which the polygon ends where it has no end of its own.
    """
    square = np.vstack([np.eye(2), -np.eye(2)])
    corners = vertices(np.vstack([normals, square]), np.concatenate([bounds, np.full(4, reach)]))
    if corners is None:
        return np.zeros((0, 2))
    return np.asarray(corners[np.argsort(np.arctan2(corners[:, 1], corners[:, 0]))])


def reach_along(normals: Array, bounds: Array, direction: Array) -> float:
    """The reach of a polytope from the origin in a direction [n], in units of the direction; it may be infinite."""
    rates = normals @ direction
    ahead = rates > SAME_VERTEX * np.abs(rates).max(initial=0.0)
    return float(np.min(bounds[ahead] / rates[ahead], initial=math.inf))
