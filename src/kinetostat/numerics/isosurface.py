"""The surface on which a field over a grid of nodes is zero, by marching tetrahedra."""

from collections.abc import Sequence

import numpy as np

from kinetostat.arrays import Array, Integers

CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
"""Corners of a cell, in steps from its lowest one."""
TETRAHEDRA = np.array([[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]])
"""Corners of the six tetrahedra about the diagonal of a cell."""
LAYERS_OUTSIDE = 2
"""Layers of nodes outside the region that are added at the ends of the axes, so that its surface closes there."""


def surface(field: Array, axes: Sequence[Array]) -> Array:
    """Triangulate the surface of a region by marching tetrahedra; corners run counter-clockwise seen from outside.

    Args:
        field: positive at nodes inside, negative outside, 0 on the surface between [nx x ny x nz].
        axes: evenly spaced coordinates of the nodes; the triangles are in the same units and stay between their ends.
    """
    padded = np.pad(field, LAYERS_OUTSIDE, constant_values=-1.0)
    cells = _mixed_cells(padded)
    parts = []
    for corners in TETRAHEDRA:
        nodes = cells[:, None, :] + CORNERS[corners]
        parts += _cut(nodes.astype(float), padded[nodes[..., 0], nodes[..., 1], nodes[..., 2]])
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
        corners, corner_values = nodes[chosen], values[chosen]
        outward = corners[:, inner:].mean(axis=1) - corners[:, :inner].mean(axis=1)
        for edges in triangles:
            points = np.stack([_crossing(corners, corner_values, *edge) for edge in edges], axis=1)
            normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
            inverted = (normal * outward).sum(axis=1) < 0.0
            points[inverted] = points[inverted][:, ::-1]
            triangles_of.append(points)
    return triangles_of


def _crossing(corners: Array, values: Array, first: int, other: int) -> Array:
    """Return the points at which the field is zero on an edge, which is linear along it [n x 3]."""
    share = -values[:, first] / (values[:, other] - values[:, first])
    return corners[:, first] + share[:, None] * (corners[:, other] - corners[:, first])
