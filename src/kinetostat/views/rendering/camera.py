"""The perspective camera: its place, the pixels to which it projects points, and the solids that it sees in each pixel.

Nothing here knows light or colours.
"""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from kinetostat.arrays import Array, Float32s, Integers
from kinetostat.frozen import dataclass
from kinetostat.views.rendering.rasteriser import CHUNK_PIXELS, LAST, NEXT, nearest_triangles
from kinetostat.views.scene.mesh import placed_mesh
from kinetostat.views.scene.solids import LOOKS, Solid

VIEWPOINTS = {
    "iso": (1.0, -1.35, 0.75),
    "front": (0.0, -1.0, 0.02),
    "side": (1.0, 0.0, 0.02),
    "top": (0.0, -0.02, 1.0),
}
"""Direction from the machine to the camera, base axes; those along an axis are a little tilted, so that flat parts show
a second side."""
FIELD_OF_VIEW = math.radians(32.0)
"""Angle of view across the picture's shorter side: that of a moderate telephoto lens, which bends no parallels."""
EMPTY_MARGIN = 0.07
"""Share of the picture that stays empty on each side, so that nothing touches its edge."""
FITTING_STEPS = 12
"""Number of times the camera is moved until the machine fills the picture. Each leaves a fifth of the error: six leave
a hundredth of a pixel for usual machines, and the others are for very long or flat ones."""


@dataclass(frozen=True)
class Camera:
    """A camera without distortion.

    Attributes:
        eye: place of the camera, base frame, m.
        axes: unit vectors to the right, down and forward in the picture, base axes [3 x 3, by rows].
        focal: focal length in pixels: displacement in the picture per tangent of the angle to the optical axis.
        width, height: size of the picture, pixels.
    """

    eye: Array
    axes: Array
    focal: float
    width: int
    height: int

    def project(self, points: Array) -> tuple[Array, Array]:
        """Project points [n x 3] (m) to pixels [n x 2] from the upper left corner; also 1 / depth [n], 1/m."""
        from_eye = (points - self.eye) @ self.axes.T
        nearness = 1.0 / from_eye[:, 2]
        centre = (0.5 * self.width, 0.5 * self.height)
        return from_eye[:, :2] * (self.focal * nearness)[:, None] + centre, nearness

    def rays(self, x: Array, y: Array) -> Array:
        """Return vectors [... x 3] from the eye through points of the picture (pixels), scaled to a depth of 1 m."""
        right, down = (x - 0.5 * self.width) / self.focal, (y - 0.5 * self.height) / self.focal
        return np.stack([right, down, np.ones_like(right)], axis=-1) @ self.axes

    def with_finer_pixels(self, factor: int) -> "Camera":
        """Return the same view with more pixels."""
        return Camera(self.eye, self.axes, self.focal * factor, self.width * factor, self.height * factor)


def axes_towards(forward: Sequence[float] | Array) -> Array:
    """Return the axes to the right, down and forward of a viewer who looks that way with z up, [3 x 3] by rows."""
    unit_forward = np.array(forward) / np.linalg.norm(forward)
    right = np.cross(unit_forward, (0.0, 0.0, 1.0))
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 0.0 else np.array((1.0, 0.0, 0.0))
    return np.stack([right, np.cross(unit_forward, right), unit_forward])


def camera_on(points: Array, direction: Sequence[float], width: int, height: int) -> Camera:
    """Place a camera so that the points [n x 3] (base frame, m) fill its picture.

    A perspective picture allows no closed form: the camera is centred on the projected points and brought nearer
    or farther until it fits, which converges in a few steps.

    Args:
        points: points of everything that has to be visible.
        direction: direction from the machine to the camera, base axes.
        width, height: size of the picture, pixels.
    """
    axes = axes_towards(-np.array(direction, dtype=float))
    half = math.tan(0.5 * FIELD_OF_VIEW) * np.array([width, height]) / min(width, height)
    target = 0.5 * (points.min(axis=0) + points.max(axis=0))
    distance = float(np.linalg.norm(np.ptp(points, axis=0))) / half.min()
    for _ in range(FITTING_STEPS):
        from_eye = (points - target) @ axes.T + (0.0, 0.0, distance)
        slopes = from_eye[:, :2] / from_eye[:, 2:]
        low, high = slopes.min(axis=0), slopes.max(axis=0)
        target = target + 0.5 * distance * (low + high) @ axes[:2]
        distance *= float(np.max(0.5 * (high - low) / half)) / (1.0 - 2.0 * EMPTY_MARGIN)
    return Camera(target - distance * axes[2], axes, 0.5 * height / half[1], width, height)


LIKE_NORMALS = 0.97
"""Cosine between normals above which samples of one pixel on one solid share their shading."""


class Triangles:
    """Triangles of several solids.

    Attributes:
        points, normals: [n x 3], base frame, m.
        triangles: [m x 3], counter-clockwise as seen from outside.
        solid, look: the number of each triangle's solid, and of its look among `LOOKS` [m].
    """

    def __init__(self, solids: Sequence[Solid]) -> None:
        """Put solids together."""
        meshes = [placed_mesh(solid) for solid in solids]
        starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
        shifted = [mesh.triangles + start for mesh, start in zip(meshes, starts, strict=False)]
        counts, names = [len(mesh.triangles) for mesh in meshes], list(LOOKS)
        self.points = np.concatenate([np.empty((0, 3)), *(mesh.points for mesh in meshes)])
        self.normals = np.concatenate([np.empty((0, 3)), *(mesh.normals for mesh in meshes)])
        self.triangles = np.concatenate([np.empty((0, 3), np.int64), *shifted])
        self.solid = np.repeat(np.arange(len(solids)), counts)
        self.look = np.repeat(np.array([names.index(s.material) for s in solids], dtype=np.int64), counts)

    @cached_property
    def edges(self) -> tuple[Array, Array]:
        """Start of the edge opposite each corner, m, and the vector on that edge that points inwards [m x 3 x 3]."""
        corners = self.points[self.triangles]
        opposite = corners[:, LAST] - corners[:, NEXT]
        return corners[:, NEXT], np.cross(np.cross(opposite[:, 0], opposite[:, 1])[:, None], opposite)


@dataclass(frozen=True)
class Hits:
    """Points at which the rays of a camera meet solids.

    Attributes:
        nearness: the inverse of the depth of all pixels [height * width], 0 where nothing is met.
        pixel: numbers of the pixels that are covered [k].
        sample: number of the sample that each of them shows [k].
        points, normals, to_eye: the samples, and unit vectors along their normals and to the eye [s x 3], base frame.
        look: the numbers of the samples' looks [s].
    """

    nearness: Float32s
    pixel: Integers
    sample: Integers
    points: Float32s
    normals: Float32s
    to_eye: Float32s
    look: Integers


def hits_of(body: Triangles, camera: Camera, samples_per_side: int) -> Hits:
    """Find the points of a body that a camera sees, with so many samples of a pixel across and down.

    The pixels of this finer picture smooth the edges. Light is costly, so those that lie within one pixel of the
    picture, on the same solid and with like normals, share one sample.
    """
    fine = camera.with_finer_pixels(samples_per_side)
    near, triangle = nearest_triangles(*fine.project(body.points), body.triangles, fine.width, fine.height)
    pixel = np.flatnonzero(triangle >= 0)
    met = triangle[pixel]
    normals = np.empty((len(pixel), 3), np.float32)
    for start in range(0, len(pixel), CHUNK_PIXELS):
        part = slice(start, start + CHUNK_PIXELS)
        normals[part] = normals_at(body, met[part], _points(fine, near, pixel[part])[0])
    owner = _owners(pixel, body.solid[met], normals, fine.width, samples_per_side)
    chosen, sample = np.unique(owner, return_inverse=True)
    points, rays = _points(fine, near, pixel[chosen])
    to_eye = -rays / np.linalg.norm(rays, axis=1, keepdims=True)
    return Hits(
        near, pixel, sample, points.astype(np.float32), normals[chosen], to_eye.astype(np.float32),
        body.look[met[chosen]],
    )  # fmt: skip


def _points(camera: Camera, nearness: Float32s, pixel: Integers) -> tuple[Array, Array]:
    """Return the ends of the rays through pixels, base frame (m), and the rays."""
    x, y = np.asarray(pixel % camera.width + 0.5), np.asarray(pixel // camera.width + 0.5)
    rays = camera.rays(x, y)
    return camera.eye + rays / nearness[pixel, None], rays


def normals_at(body: Triangles, triangle: Integers, points: Array) -> Array:
    """Interpolate the unit normals of the corners at points [n x 3] (base frame, m) of triangles [n].

    The weight of a corner is the area of the triangle between the point and the other two corners. In space that holds
    as it is; on the picture it would have to be corrected for perspective.
    """
    ends, inward = body.edges
    weights = np.einsum("nij,nij->ni", inward[triangle], points[:, None] - ends[triangle])
    mixed = np.einsum("ni,nij->nj", weights, body.normals[body.triangles[triangle]])
    size: Array = np.linalg.norm(mixed, axis=1, keepdims=True)
    return mixed / np.where(size > 0.0, size, 1.0)


def _owners(pixel: Integers, solid: Integers, normals: Float32s, width: int, block_side: int) -> Integers:
    """Return for each covered pixel the one whose sample it shows: the first of its block if alike, else itself."""
    corner = pixel - pixel // width % block_side * width - pixel % width % block_side
    first = np.minimum(np.searchsorted(pixel, corner), len(pixel) - 1)
    alike = (pixel[first] == corner) & (solid[first] == solid)
    alike &= np.einsum("ij,ij->i", normals[first], normals) > LIKE_NORMALS
    return np.where(alike, first, np.arange(len(pixel)))
