"""Solids as one body of triangles, and where a camera's rays meet it. Knows no light."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinetostat.views.rendering.camera import Camera
from kinetostat.views.rendering.raster import Edges, edges_of, nearest_triangles
from kinetostat.views.scene.looks import LOOKS
from kinetostat.views.scene.mesh import placed
from kinetostat.views.scene.solids import Solid

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
Indices = NDArray[np.int64]

ALIKE = 0.97
"""Cosine between normals above which samples of one pixel on one solid share their shading."""
CHUNK = 500_000
"""Samples that are interpolated together: what stays in memory."""


class Body:
    """Triangles of several solids.

    Attributes:
        solids: of which it is made.
        points, normals: [n x 3], base frame, m.
        triangles: [m x 3].
        solid, look: of each triangle [m], the number of its solid and of its look among `LOOKS`.
    """

    def __init__(self, solids: Sequence[Solid]) -> None:
        """Put solids together."""
        meshes = [placed(solid) for solid in solids]
        starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
        counts = [len(mesh.triangles) for mesh in meshes]
        names = list(LOOKS)
        self.solids = list(solids)
        self.points = np.concatenate([np.empty((0, 3)), *(mesh.points for mesh in meshes)])
        self.normals = np.concatenate([np.empty((0, 3)), *(mesh.normals for mesh in meshes)])
        shifted = [mesh.triangles + start for mesh, start in zip(meshes, starts, strict=False)]
        self.triangles = np.concatenate([np.empty((0, 3), np.int64), *shifted])
        self.solid = np.repeat(np.arange(len(solids)), counts)
        self.look = np.repeat(np.array([names.index(s.material) for s in solids], dtype=np.int64), counts)


@dataclass(frozen=True)
class Hits:
    """Where rays meet a body.

    Attributes:
        nearness: of all pixels [height * width]: the inverse of the depth, 0 where nothing is met.
        pixel: numbers of those where something is [k].
        sample: which of the samples below each of them shows [k].
        points, normals, to_eye: of the samples [s x 3], base frame; unit vectors.
        look: of the samples [s], numbers.
    """

    nearness: Floats
    pixel: Indices
    sample: Indices
    points: Floats
    normals: Floats
    to_eye: Floats
    look: Indices


def hits_of(body: Body, camera: Camera, finer: int) -> Hits:
    """What a camera sees of a body in `finer` times as many pixels across and down.

    Of pixels that are one in the camera's own picture, those on the same solid whose normals are alike share a sample.
    """
    fine = camera.enlarged(finer)
    pixels, nearness = fine.project(body.points)
    near, triangle = nearest_triangles(pixels, nearness, body.triangles, fine.width, fine.height)
    pixel = np.flatnonzero(triangle >= 0)
    met = triangle[pixel].astype(np.int64)
    edges = edges_of(pixels, body.triangles)
    parts = [slice(start, start + CHUNK) for start in range(0, len(pixel), CHUNK)]
    normals = np.concatenate(
        [
            np.empty((0, 3), np.float32),
            *(_normals(body, edges, nearness, met[part], *_centres(pixel[part], fine.width)) for part in parts),
        ]
    )
    owner = _owners(pixel, body.solid[met], normals, fine.width, finer)
    chosen, sample = np.unique(owner, return_inverse=True)
    rays = fine.rays(*_centres(pixel[chosen], fine.width))
    points = (fine.eye + rays / near[pixel[chosen], None]).astype(np.float32)
    to_eye = (-rays / np.linalg.norm(rays, axis=1, keepdims=True)).astype(np.float32)
    return Hits(near, pixel, sample, points, normals[chosen], to_eye, body.look[met[chosen]])


def _centres(pixel: Indices, width: int) -> tuple[Array, Array]:
    return np.asarray(pixel % width + 0.5), np.asarray(pixel // width + 0.5)


def _normals(body: Body, edges: Edges, nearness: Array, triangle: Indices, x: Array, y: Array) -> Floats:
    """Unit normals at points of triangles in a picture, as they are in space between the corners'."""
    corners = body.triangles[triangle].T
    shares = edges.weights(triangle, x, y) * nearness[corners]
    mixed = np.einsum("in,inj->nj", shares, body.normals[corners])
    unit: Floats = (mixed / np.maximum(np.linalg.norm(mixed, axis=1, keepdims=True), 1e-12)).astype(np.float32)
    return unit


def _owners(pixel: Indices, solid: Indices, normals: Floats, width: int, finer: int) -> Indices:
    """For each covered pixel the one, among those covered, whose sample it shows: the first of its block if alike."""
    x, y = pixel % width, pixel // width
    own = np.arange(len(pixel))
    first = np.searchsorted(pixel, (y - y % finer) * width + x - x % finer)
    first = np.minimum(first, len(pixel) - 1)
    same = pixel[first] == (y - y % finer) * width + x - x % finer
    same &= solid[first] == solid
    same &= np.einsum("ij,ij->i", normals[first], normals) > ALIKE
    return np.where(same, first, own)
