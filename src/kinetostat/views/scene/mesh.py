"""Meshes: the three kinds of shape as triangles, to be drawn or written to files. No material and no format is known.

Points are in the shape's own axes, m. A point on a sharp edge is listed once for each adjacent face, each with its own
normal; points that coincide have equal coordinates, bit by bit.
"""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array, Integers
from kinetostat.frozen import dataclass
from kinetostat.tolerances import NO_CIRCLE
from kinetostat.views.scene.solids import Extruded, Shape, Solid, Swept, Turned

REVOLVED_SIDES = 40
"""Sides of a solid of revolution: it looks round on a screen."""
WIRE_SIDES = 12
"""Sides of a wire, which is thinner: they are not seen."""
CHAMFER_STEPS = 3
"""Steps of a chamfer, which make it look round."""
SMOOTH_EDGE = 0.8
"""Cosine between the normals of neighbouring faces above which the edge between them is shaded round."""
MESHES_KEPT = 1024
"""Number of meshes that are kept: a machine has about a hundred, few of which change while it moves."""

LEAST_BISECTOR_SHARE = 0.1
"""Least component of a corner's bisector along an edge's normal: a sharp tip would otherwise move far back."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with normals.

    Attributes:
        points: [n x 3], m.
        normals: [n x 3], unit vectors that point out of the body.
        triangles: [m x 3], numbers of points, counter-clockwise as seen from outside.
    """

    points: Array
    normals: Array
    triangles: Integers

    @property
    def volume(self) -> float:
        """Enclosed volume, m^3, by the divergence theorem."""
        a, b, c = (self.points[self.triangles[:, i]] for i in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


@lru_cache(MESHES_KEPT)
def mesh_of(shape: Shape) -> Mesh:
    """Cut the surface of a shape into triangles, in its own axes; equal shapes share one mesh, which is read-only."""
    match shape:
        case Turned():
            mesh = _revolved_mesh(shape)
        case Extruded():
            mesh = _extruded_mesh(shape)
        case Swept():
            mesh = _swept_mesh(shape)
    for array in (mesh.points, mesh.normals, mesh.triangles):
        array.setflags(write=False)
    return mesh


def placed_mesh(solid: Solid) -> Mesh:
    """Return the triangles of a solid in the base frame."""
    mesh, scale = mesh_of(solid.shape), np.array(solid.scale)
    axes = solid.place.rotation
    turn = np.array([_numbers(axis) for axis in (axes.x, axes.y, axes.z)])
    normals = (mesh.normals / scale) @ turn
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh((mesh.points * scale) @ turn + _numbers(solid.place.translation), normals, mesh.triangles)


def _numbers(vector: Vector) -> tuple[float, float, float]:
    x, y, z = vector.components()
    return float(x), float(y), float(z)


def _revolved_mesh(shape: Turned) -> Mesh:
    profile = np.array(shape.profile)
    profile = profile[[True, *(np.linalg.norm(np.diff(profile, axis=0), axis=1) > 0.0)]]
    profile[profile[:, 0] < NO_CIRCLE * profile[:, 0].max(), 0] = 0.0
    edges = np.diff(profile, axis=0)
    outward = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / np.linalg.norm(edges, axis=1, keepdims=True)
    closed = bool(np.all(profile[0] == profile[-1]))
    starts, ends = _ends_of_faces(outward, closed)
    angles = [math.tau * k / REVOLVED_SIDES for k in range(REVOLVED_SIDES)]
    cosines, sines = np.cos(angles), np.sin(angles)

    def around(pairs: Array) -> Array:
        radius, height = pairs[..., 0, None], pairs[..., 1, None]
        return np.stack([radius * cosines, radius * sines, height + 0.0 * cosines], axis=-1)

    points = around(np.stack([profile[:-1], profile[1:]], axis=1))
    normals = around(np.stack([starts, ends], axis=1))
    return _bands(points, normals, closed=True)


def _ends_of_faces(normals: Array, closed: bool) -> tuple[Array, Array]:
    """Return normals at both lines of each face of a strip: shared with its neighbour where the edge is round."""
    before, after = np.roll(normals, 1, axis=0), np.roll(normals, -1, axis=0)
    if not closed:
        before[0], after[-1] = normals[0], normals[-1]
    return _shared_normals(normals, before), _shared_normals(normals, after)


def _shared_normals(normals: Array, others: Array) -> Array:
    smooth = np.einsum("ij,ij->i", normals, others) >= SMOOTH_EDGE
    sums = np.where(smooth[:, None], normals + others, normals)
    return sums / np.linalg.norm(sums, axis=1, keepdims=True)


def _bands(points: Array, normals: Array, closed: bool) -> Mesh:
    """Return the bands of quadrilaterals, each between its two lines.

    Args:
        points, normals: [bands x 2 x count x 3], along each band's first and second line; to the left of the way along
            a line is its band's second line, as seen from outside.
        closed: whether the end of a line is its beginning.
    """
    bands, _, count, _ = points.shape
    step = np.arange(count if closed else count - 1)
    following = (step + 1) % count
    quads = np.stack([step, following, following + count, step + count], axis=1)
    quads = (quads + 2 * count * np.arange(bands)[:, None, None]).reshape(-1, 4)
    halves = np.concatenate([quads[:, [0, 1, 3]], quads[:, [1, 2, 3]]])
    return _without_slivers(points.reshape(-1, 3), normals.reshape(-1, 3), halves)


def _without_slivers(points: Array, normals: Array, triangles: Integers) -> Mesh:
    """Return a mesh without triangles of which two corners coincide, and without points that are in no triangle."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    real = np.any(a != b, axis=1) & np.any(b != c, axis=1) & np.any(c != a, axis=1)
    used, numbers = np.unique(triangles[real], return_inverse=True)
    return Mesh(points[used], normals[used], numbers.reshape(-1, 3))


def joined_meshes(meshes: Sequence[Mesh]) -> Mesh:
    """Return all triangles of some meshes as one mesh, in their order; without meshes it is empty."""
    ends = np.cumsum([len(mesh.points) for mesh in meshes])
    shifted = [mesh.triangles + end - len(mesh.points) for mesh, end in zip(meshes, ends, strict=True)]
    return Mesh(
        np.concatenate([np.empty((0, 3)), *(mesh.points for mesh in meshes)]),
        np.concatenate([np.empty((0, 3)), *(mesh.normals for mesh in meshes)]),
        np.concatenate([np.empty((0, 3), np.int64), *shifted]),
    )


def _extruded_mesh(shape: Extruded) -> Mesh:
    outline = np.array(shape.outline)
    outline = outline[np.any(outline != np.roll(outline, 1, axis=0), axis=1)]
    chamfer = min(shape.chamfer, 0.5 * shape.height)
    steps = [0.5 * math.pi * k / CHAMFER_STEPS for k in range(CHAMFER_STEPS + 1)] if chamfer > 0.0 else [0.5 * math.pi]
    # Rings of corners from below upwards: how far each lies inside the outline, its height, and the surface's tilt.
    lower = [(chamfer * (1.0 - math.sin(a)), chamfer * (1.0 - math.cos(a)), a) for a in steps]
    rows = [*lower, *((inset, shape.height - height, math.pi - a) for inset, height, a in reversed(lower))]
    flat = [(inset_outline(outline, inset) if inset else outline, height) for inset, height, _ in rows]
    rings = np.stack([np.column_stack([corners, np.full(len(corners), height)]) for corners, height in flat])
    tilts = np.array([tilt for *_, tilt in rows])
    caps = [_cap(rings[-1], 1.0), _cap(rings[0], -1.0)]
    return joined_meshes([_wall(rings, tilts, _edge_normals(outline)), *caps])


def _edge_normals(outline: Array) -> Array:
    """Return the unit normals [n x 2], outwards, of the edges from each corner of a counter-clockwise outline on."""
    edges = np.roll(outline, -1, axis=0) - outline
    normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def inset_outline(outline: Array, margin: float) -> Array:
    """Move all edges of an outline inwards by `margin` (the outline's unit), and return the corners [n x 2]."""
    normals = _edge_normals(outline)
    bisectors = normals + np.roll(normals, 1, axis=0)
    shares = np.einsum("ij,ij->i", bisectors, normals)
    return outline - margin * bisectors / np.maximum(shares, LEAST_BISECTOR_SHARE)[:, None]


def cut_in_triangles(outline: Array) -> list[tuple[int, int, int]]:
    """Cut a simple counter-clockwise outline into n - 2 triangles of its corners' numbers, by clipping ears.

    Source: G. H. Meisters, Polygons have ears, American Mathematical Monthly 82 (1975).
    """
    points = [(float(x), float(y)) for x, y in outline]
    remaining = list(range(len(points)))
    triangles = []
    while len(remaining) > 3:
        tip = next(
            (i for i in range(len(remaining)) if _is_ear(points, remaining, i)), _most_turning(points, remaining)
        )
        triangles.append((remaining[tip - 1], remaining[tip], remaining[(tip + 1) % len(remaining)]))
        del remaining[tip]
    return [*triangles, (remaining[0], remaining[1], remaining[2])]


def _is_ear(points: Sequence[tuple[float, float]], remaining: Sequence[int], tip: int) -> bool:
    """Return whether the triangle at a corner lies inside and holds no other corner."""
    corners = remaining[tip - 1], remaining[tip], remaining[(tip + 1) % len(remaining)]
    a, b, c = (points[i] for i in corners)
    if turn_of(a, b, c) <= 0.0:
        return False
    others = (points[i] for i in remaining if i not in corners)
    return not any(min(turn_of(a, b, p), turn_of(b, c, p), turn_of(c, a, p)) >= 0.0 for p in others)


def _most_turning(points: Sequence[tuple[float, float]], remaining: Sequence[int]) -> int:
    """Return the corner that turns most to the left: the best choice where round-off has hidden every ear."""
    turns = [
        turn_of(points[remaining[i - 1]], points[remaining[i]], points[remaining[(i + 1) % len(remaining)]])
        for i in range(len(remaining))
    ]
    return max(range(len(remaining)), key=turns.__getitem__)


def turn_of(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Return twice the area of a triangle, positive if it is counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _wall(rings: Array, tilts: Array, outward: Array) -> Mesh:
    """Return the side of a plate, edge by edge.

    Args:
        rings: corners by height [rows x corners x 3].
        tilts: the tilt of the surface at each row: 0 down, pi/2 outwards, pi up.
        outward: normals of the outline's edges [corners x 2].
    """
    flats = _ends_of_faces(outward, closed=True)
    points = np.stack([rings, np.roll(rings, -1, axis=1)], axis=2)
    side = np.sin(tilts)[:, None, None]
    up = np.broadcast_to(-np.cos(tilts)[:, None, None], (*rings.shape[:2], 1))
    normals = np.stack([np.concatenate([side * flat, up], axis=2) for flat in flats], axis=2)
    # From [rows, edges, ends] to one band an edge, whose lines run down at its two corners.
    return _bands(points[::-1].transpose(1, 2, 0, 3), normals[::-1].transpose(1, 2, 0, 3), closed=False)


def _cap(ring: Array, up: float) -> Mesh:
    triangles = np.array(cut_in_triangles(ring[:, :2]), dtype=np.int64)
    normals = np.broadcast_to((0.0, 0.0, up), ring.shape).copy()
    return Mesh(ring, normals, triangles if up > 0.0 else triangles[:, ::-1].copy())


def _swept_mesh(shape: Swept) -> Mesh:
    path = np.array(shape.path)
    tangents = _tangents(path, shape.closed)
    first, second = _frames(tangents, shape.closed)
    angles = math.tau * np.arange(WIRE_SIDES) / WIRE_SIDES
    spokes = first[:, None] * np.cos(angles)[:, None] + second[:, None] * np.sin(angles)[:, None]
    rings = path[:, None] + shape.radius * spokes
    following = (np.arange(len(path) if shape.closed else len(path) - 1) + 1) % len(path)
    before = np.arange(len(following))
    points = np.stack([rings[before], rings[following]], axis=1)
    tube = _bands(points, np.stack([spokes[before], spokes[following]], axis=1), closed=True)
    if shape.closed:
        return tube
    return joined_meshes([tube, _disc(rings[0], -tangents[0]), _disc(rings[-1], tangents[-1])])


def _tangents(path: Array, closed: bool) -> Array:
    edges = np.diff(path, axis=0, append=path[:1])
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    if not closed:
        edges[-1] = edges[-2]
    arriving_edges = np.roll(edges, 1, axis=0)
    if not closed:
        arriving_edges[0] = edges[0]
    sums = edges + arriving_edges
    return sums / np.linalg.norm(sums, axis=1, keepdims=True)


def _frames(tangents: Array, closed: bool) -> tuple[Array, Array]:
    """Carry two normals [n x 3] along a curve without twist; along a closed one they come back to themselves."""
    first = np.empty_like(tangents)
    start = np.cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    first[0] = start / np.linalg.norm(start)
    for i in range(1, len(tangents)):
        first[i] = _carried_normal(first[i - 1], tangents[i])
    if closed:
        carried_back, side = _carried_normal(first[-1], tangents[0]), np.cross(tangents[0], first[0])
        twist = math.atan2(carried_back @ side, carried_back @ first[0])
        angles = -twist * np.arange(len(tangents))[:, None] / len(tangents)
        first = first * np.cos(angles) + np.cross(tangents, first) * np.sin(angles)
    return first, np.cross(tangents, first)


def _carried_normal(normal: Array, tangent: Array) -> Array:
    flat = normal - tangent * (normal @ tangent)
    carried: Array = flat / np.linalg.norm(flat)
    return carried


def _disc(ring: Array, normal: Array) -> Mesh:
    """Return a flat end whose rim is convex."""
    fan = np.array([(0, k, k + 1) for k in range(1, len(ring) - 1)])
    turned = np.cross(ring[1] - ring[0], ring[2] - ring[0]) @ normal < 0.0
    return Mesh(ring, np.broadcast_to(normal, ring.shape).copy(), fan[:, ::-1].copy() if turned else fan)
