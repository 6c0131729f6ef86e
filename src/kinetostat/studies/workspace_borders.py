"""Borders of a workspace between the nodes of its grid, so that pictures show the true outline; and its surface.

A border may come from reach, a limit, a singularity or a condition. In every case the judge can say on which side a
pose lies, so that halving the step between two nodes again and again finds the border without a formula for it.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from kinetostat.arrays import AnyArray, Array, Codes, Float32s, Integers, Mask
from kinetostat.engine.batch import evaluate
from kinetostat.engine.loaded import NATIVE_FROM
from kinetostat.engine.points import Axis, PointTable
from kinetostat.studies.grid import GridQuestion
from kinetostat.studies.workspace_verdicts import Judge, Poses

HALVINGS = 7
"""Number of halvings. Seven give the border to a 128th of a step, finer than a printed line."""
DRAWN_COORDINATES = 3
"""Number of coordinates over which a workspace is drawn; the others keep the values of the pose in the file."""
LEAST_DEPTH = 1e-3
"""Least distance of a node from a border, in steps. At a distance of 0 a node would lie neither inside nor outside."""


def borders(judge: Judge, question: GridQuestion, verdict: Codes, home: Sequence[int]) -> list[Float32s]:
    """Find the borders along the lines of the grid.

    Args:
        judge: gives the verdict on a pose.
        question: the grid.
        verdict: the verdict on each node of the grid.
        home: the node nearest to the pose in the file. Only the nodes that differ from it in the first three
            coordinates alone are searched, because only these are drawn.

    Returns:
        An array over the nodes for each of the first three axes. Where the next node along the axis has another
        verdict, the entry is the share of the step to it at which the verdict changes; elsewhere it is NaN.
    """
    axes, ends = question.grid.axes, []
    drawn = tuple(slice(None) if k < DRAWN_COORDINATES else slice(home[k], home[k] + 1) for k in range(verdict.ndim))
    for k in range(min(DRAWN_COORDINATES, verdict.ndim)):
        changes = np.zeros(verdict.shape, dtype=bool)
        lower, upper = _neighbours(verdict, k)
        changes[_all_but(k, slice(None, -1))] = lower != upper
        searched = np.zeros_like(changes)
        searched[drawn] = True
        ends.append(np.argwhere(changes & searched))
    nodes = np.concatenate(ends)
    axis = np.repeat(np.arange(len(ends)), [len(places) for places in ends])
    shares = _border_shares(judge, axes, nodes, axis, verdict) if len(nodes) else np.zeros(0)
    results = []
    for k in range(len(ends)):
        result = np.full(verdict.shape, np.nan, dtype=np.float32)
        result[tuple(ends[k].T)] = shares[axis == k]
        results.append(result)
    return results


def _border_shares(judge: Judge, axes: Sequence[Axis], nodes: Integers, axis: Integers, verdict: Codes) -> Array:
    """Halve the step from each node along its axis, and return the share of the step at which the verdict changes."""
    start = {path: a.values[nodes[:, k]] for k, a in enumerate(axes) for path in a.paths}
    step = {
        path: np.where(axis == k, a.values[np.minimum(nodes[:, k] + 1, len(a.values) - 1)] - a.values[nodes[:, k]], 0.0)
        for k, a in enumerate(axes)
        for path in a.paths
    }
    before = verdict[tuple(nodes.T)]
    low, high = np.zeros(len(nodes)), np.ones(len(nodes))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        poses = {path: start[path] + middle * step[path] for path in start}
        answer = evaluate(
            judge.machine, PointTable(poses), judge.quantities, repeated=HALVINGS * len(nodes) >= NATIVE_FROM
        )
        same = judge.verdicts(answer.status, answer.values, partial(_poses_at, poses)) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return 0.5 * (low + high)


def _poses_at(poses: Poses, numbers: Integers) -> Poses:
    return {path: column[numbers] for path, column in poses.items()}


def depth(region: Mask, shares: Sequence[Float32s]) -> Array:
    """Return how far inside a region each node lies, in steps: positive inside, negative outside, at most 1.

    Interpolated linearly between the nodes, the depth is zero on the borders. Where a straight border cuts two lines
    of the grid at the distances a and b from a node, its own distance d follows from 1/d^2 = 1/a^2 + 1/b^2.

    Args:
        region: which nodes belong to the region, over the axes of the shares.
        shares: what `borders` returns, one array for each axis.
    """
    inverse_square = np.zeros(region.shape)
    for k, share in enumerate(shares):
        nearest = np.full(region.shape, np.inf)
        lower, upper = _neighbours(region, k)
        first, second = _all_but(k, slice(None, -1)), _all_but(k, slice(1, None))
        parted = lower != upper
        along = np.where(parted, share[first], np.inf)
        nearest[first] = along
        back = np.where(parted, 1.0 - share[first], np.inf)
        nearest[second] = np.minimum(nearest[second], back)
        # A border that was not searched has the share NaN; it is taken to lie half-way.
        inverse_square += np.maximum(np.nan_to_num(nearest, nan=0.5, posinf=np.inf), LEAST_DEPTH) ** -2.0
    distance = np.minimum(np.where(inverse_square > 0.0, inverse_square, 1.0) ** -0.5, 1.0)
    return np.where(region, distance, -distance)


def _neighbours(nodes: AnyArray, k: int) -> tuple[AnyArray, AnyArray]:
    """Return all nodes but the last along an axis, and all but the first: each node beside its next neighbour."""
    return nodes[_all_but(k, slice(None, -1))], nodes[_all_but(k, slice(1, None))]


def _all_but(k: int, chosen: slice) -> tuple[slice, ...]:
    return (*[slice(None)] * k, chosen)


CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
TETRAHEDRA = np.array([[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]])
"""Corners of the six tetrahedra about the diagonal of a cell."""
LAYERS_OUTSIDE = 2
"""Layers of nodes outside the region that are added at the ends of the axes, so that its surface closes there."""


def surface(depth: Array, axes: Sequence[Array]) -> Array:
    """Triangulate the surface of a region by marching tetrahedra; corners run counter-clockwise seen from outside.

    Args:
        depth: positive at nodes inside, negative outside, 0 on the surface between [nx x ny x nz].
        axes: evenly spaced coordinates of the nodes; the triangles are in the same units and stay between their ends.
    """
    field = np.pad(depth, LAYERS_OUTSIDE, constant_values=-1.0)
    cells = _mixed_cells(field)
    parts = []
    for corners in TETRAHEDRA:
        nodes = cells[:, None, :] + CORNERS[corners]
        parts += _cut(nodes.astype(float), field[nodes[..., 0], nodes[..., 1], nodes[..., 2]])
    triangles = np.concatenate(parts) if parts else np.zeros((0, 3, 3))
    start = np.array([axis[0] for axis in axes])
    step = np.array([axis[1] - axis[0] for axis in axes])
    return np.clip(start + (triangles - LAYERS_OUTSIDE) * step, start, [axis[-1] for axis in axes])


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
