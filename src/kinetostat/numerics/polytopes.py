"""Convex polytopes: vertices and cuts of those given by half-spaces, and faces of sums of segments.

A polytope A x <= b with b > 0 is dual to its vertices: each belongs to a facet of the convex hull of the points a / b.

The wrenches that forces within bounds can hold are a sum of segments (a zonotope), or of rays if forces have no upper
bound. In d dimensions each of its faces contains d - 1 of the wrenches of unit forces, so that its normal is
perpendicular to these, and the faces are found without computing a vertex. Which forces act, and along which lines, is
not known here.

Source: G. M. Ziegler, Lectures on Polytopes (1995), section 2.3; theory (78); S. Bouchard, C. Gosselin and B. Moore,
"On the ability of a cable-driven robot to generate a prescribed set of wrenches", J. Mechanisms and Robotics 2 (2010);
capacity: F. Guay, P. Cardou, A. Cruz-Ruiz and S. Caro, "Measuring how well a structure supports varying external
wrenches", New Advances in Mechanisms, Transmissions and Applications (2014).
"""

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.late import LateModule
from kinetostat.tolerances import DEGENERATE_FACE, SAME_VERTEX, UNRESISTED

spatial = LateModule("scipy.spatial")

UNBOUNDED_FORCE = 1e300
"""Number that stands for a force without a bound: a face that such a force moves is beyond every wrench."""
FARTHEST_FACE = 1e200
"""Distance beyond which a face exists only because of `UNBOUNDED_FORCE`."""
MOST_NUMBERS = 120_000
"""Greatest number of entries of an array in a slab: 1 MB, so that it stays in the second level of the cache."""


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
    distinct = points[np.sort(first)]
    # Rounding may part two points that are one: what is left is compared directly.
    differs = np.abs(distinct[:, None] - distinct[None]).max(axis=2) > 2.0 * scale
    return np.asarray(distinct[[bool(differs[i, :i].all()) for i in range(len(distinct))]])


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


@dataclass(frozen=True)
class Faces:
    """Normals of the faces of n sets of wrenches.

    Attributes:
        normals: unit normals; NaN where the forces of a face are dependent [d x faces x n].
        pulls: components of the wrenches of unit forces along the normals, exactly 0 for those in the face
            [faces x m x n].
    """

    normals: Array
    pulls: Array

    def ends(self, least: Array, most: Array) -> tuple[Array, Array]:
        """The extent of the sets along the normals, and against them [faces x n].

        Args:
            least, most: bounds of every force [m x n]; `most` may be infinite.
        """
        forth, back = np.maximum(self.pulls, 0.0), np.maximum(-self.pulls, 0.0)
        high = np.where(np.isinf(most), UNBOUNDED_FORCE, most)  # 0 times infinity would be NaN
        above = (forth * high).sum(axis=1) - (back * least).sum(axis=1)
        below = (back * high).sum(axis=1) - (forth * least).sum(axis=1)
        return above, below


def faces(wrenches: Array) -> Faces:
    """Find the normals of all faces of the sets of wrenches in d >= 2 dimensions.

    The normal is the cross product of the d - 1 wrenches in the face, whose components are their minors. Minors of the
    first wrenches belong to many faces and are computed once.

    Args:
        wrenches: wrenches of unit forces, as columns [d x m x n].
    """
    size, count = wrenches.shape[:2]
    unit = wrenches / np.maximum(np.sqrt((wrenches * wrenches).sum(axis=0)), UNRESISTED)
    minors = unit
    for order in range(2, size):
        minors = _next_minors(minors, unit, order)
    normals = minors[::-1] * ((-1.0) ** np.arange(size))[:, None, None]
    lengths = np.sqrt(sum(row * row for row in normals))
    normals /= np.where(lengths > DEGENERATE_FACE, lengths, np.nan)
    pulls = np.zeros((normals.shape[1], *wrenches.shape[1:]))
    for row, part in zip(normals, wrenches, strict=True):
        pulls += row[:, None] * part
    for face, members in enumerate(combinations(range(count), size - 1)):
        pulls[face, members, :] = 0.0
    sizes = np.sqrt((wrenches * wrenches).sum(axis=0))
    pulls[np.abs(pulls) <= UNRESISTED * sizes] = 0.0
    return Faces(normals, pulls)


def _next_minors(minors: Array, unit: Array, order: int) -> Array:
    """Minors of `order` columns from those of one less [row sets x column sets x n], in lexical order."""
    size, count = unit.shape[:2]
    sets, rows = list(combinations(range(count), order)), list(combinations(range(size), order))
    before = {columns: place for place, columns in enumerate(combinations(range(count), order - 1))}
    rows_before = {chosen: place for place, chosen in enumerate(combinations(range(size), order - 1))}
    kept = minors[:, [before[columns[:-1]] for columns in sets]]
    last = unit[:, [columns[-1] for columns in sets]]
    result = np.zeros((len(rows), len(sets), unit.shape[2]))
    for place, chosen in enumerate(rows):
        for position, row in enumerate(chosen):
            sign = 1.0 if (order - 1 - position) % 2 == 0 else -1.0
            result[place] += sign * kept[rows_before[chosen[:position] + chosen[position + 1 :]]] * last[row]
    return result


def capacity(wrenches: Array, least: Array, most: Array, required: Array, box: Array | None = None) -> Array:
    """The distance of required wrenches from the faces of the set that forces within bounds can hold [n].

    It is the distance of the outermost required wrench from the nearest face, negative if that wrench is outside. It is
    infinite if the set has no face, and NaN if every face is degenerate: the wrenches of all forces then span at most
    d - 2 of d >= 2 dimensions.

    Args:
        wrenches: wrenches of unit forces, as columns [n x d x m].
        least, most: bounds of every force [n x m]; `most` may be infinite.
        required: wrenches that must all be held [n x k x d]; mixtures of them are then held as well.
        box: half the sizes of a box of wrenches about each of them [n x d]; no box if it is None.
    """
    count, size, forces = wrenches.shape
    result = np.empty(count)
    half_sizes = np.zeros((count, size)) if box is None else box
    for slab in _slabs(count, size, forces):
        slab_faces = faces(wrenches[slab].transpose(1, 2, 0))
        normals = slab_faces.normals
        above, below = slab_faces.ends(least[slab].T, most[slab].T)
        along = np.stack([_dot(normals, wrench.T) for wrench in required[slab].transpose(1, 0, 2)])
        to_faces = np.minimum(above - along.max(axis=0), below + along.min(axis=0))
        to_faces = to_faces - _dot(np.abs(normals), half_sizes[slab].T)
        is_face = ~np.isnan(normals[0])
        distance = np.where(is_face, to_faces, np.inf).min(axis=0)
        result[slab] = np.where(is_face.any(axis=0), np.where(distance > FARTHEST_FACE, np.inf, distance), np.nan)
    return result


def _dot(normals: Array, wrenches: Array) -> Array:
    """Products of normals [d x faces x n] with wrenches [d x n], added up over d in order [faces x n]."""
    return np.asarray(sum(normal * wrench for normal, wrench in zip(normals, wrenches, strict=True)))


def wrench_closure(wrenches: Array) -> Array:
    """The wrench that forces from 0 to 1 can hold in every direction [n]; if it is positive, forces hold any wrench.

    Args:
        wrenches: wrenches of unit forces, as columns [n x d x m].
    """
    count, size, forces = wrenches.shape
    unit = np.ones((count, forces))
    return capacity(wrenches, 0.0 * unit, unit, np.zeros((count, 1, size)))


def _slabs(count: int, size: int, forces: int) -> Iterator[slice]:
    """Part n sets into slabs whose largest array, of minors or of pulls, has at most `MOST_NUMBERS` entries."""
    minors = max(math.comb(forces, order) * math.comb(size, order) for order in range(1, size))
    pulls = math.comb(forces, size - 1) * forces
    step = max(1, MOST_NUMBERS // max(minors, pulls))
    return (slice(start, start + step) for start in range(0, count, step))
