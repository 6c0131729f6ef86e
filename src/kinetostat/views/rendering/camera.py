"""The perspective camera: its place, the pixels to which it projects points, and the solids that it sees in each pixel.

Nothing here knows light or colours. The same rasteriser serves the camera and the shadow maps of the lamps.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from kinetostat.arrays import Array, Float32s, Integers
from kinetostat.frozen import dataclass
from kinetostat.views.scene.mesh import placed_mesh
from kinetostat.views.scene.solids import LOOKS, Solid

VIEWPOINTS = {
    "iso": (1.0, -1.35, 0.75),
    "front": (0.0, -1.0, 0.02),
    "side": (1.0, 0.0, 0.02),
    "top": (0.0, -0.02, 1.0),
}
"""Direction from the machine to the camera, base axes."""
FIELD_OF_VIEW = math.radians(32.0)
"""Angle of view across the picture's shorter side: that of a moderate telephoto lens, which bends no parallels."""
EMPTY_MARGIN = 0.07
"""Share of the picture that stays empty on each side, so that nothing touches its edge."""
FITTING_STEPS = 12
"""Number of times the camera is moved until the machine fills the picture."""


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
        seen = (points - self.eye) @ self.axes.T
        nearness = 1.0 / seen[:, 2]
        centre = (0.5 * self.width, 0.5 * self.height)
        return seen[:, :2] * (self.focal * nearness)[:, None] + centre, nearness

    def rays(self, x: Array, y: Array) -> Array:
        """Return vectors [... x 3] from the eye through points of the picture (pixels), scaled to a depth of 1 m."""
        right, down = (x - 0.5 * self.width) / self.focal, (y - 0.5 * self.height) / self.focal
        return np.stack([right, down, np.ones_like(right)], axis=-1) @ self.axes

    def with_finer_pixels(self, factor: int) -> "Camera":
        """Return the same view with more pixels."""
        return Camera(self.eye, self.axes, self.focal * factor, self.width * factor, self.height * factor)


def axes_towards(forward: Sequence[float] | Array) -> Array:
    """Return the axes to the right, down and forward of a viewer who looks that way with z up, [3 x 3] by rows."""
    ahead = np.array(forward) / np.linalg.norm(forward)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 0.0 else np.array((1.0, 0.0, 0.0))
    return np.stack([right, np.cross(ahead, right), ahead])


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
        seen = (points - target) @ axes.T + (0.0, 0.0, distance)
        slopes = seen[:, :2] / seen[:, 2:]
        low, high = slopes.min(axis=0), slopes.max(axis=0)
        target = target + 0.5 * distance * (low + high) @ axes[:2]
        distance *= float(np.max(0.5 * (high - low) / half)) / (1.0 - 2.0 * EMPTY_MARGIN)
    return Camera(target - distance * axes[2], axes, 0.5 * height / half[1], width, height)


LIKE_NORMALS = 0.97
"""Cosine between normals above which samples of one pixel on one solid share their shading."""
CHUNK_PIXELS = 1_000_000
"""Pixels that are worked on together: some hundred megabytes at a time, however large the picture is."""
NEXT, LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
"""The two corners of a triangle that lie opposite each corner."""


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


def hits_of(body: Triangles, camera: Camera, finer: int) -> Hits:
    """Find the points of a body that a camera sees, in `finer` times as many pixels across and down.

    The finer pixels smooth the edges. Light is costly, so those that lie within one pixel of the picture, on the same
    solid and with like normals, share one sample.
    """
    fine = camera.with_finer_pixels(finer)
    near, triangle = nearest_triangles(*fine.project(body.points), body.triangles, fine.width, fine.height)
    pixel = np.flatnonzero(triangle >= 0)
    met = triangle[pixel]
    normals = np.empty((len(pixel), 3), np.float32)
    for start in range(0, len(pixel), CHUNK_PIXELS):
        part = slice(start, start + CHUNK_PIXELS)
        normals[part] = normals_at(body, met[part], _points(fine, near, pixel[part])[0])
    owner = _owners(pixel, body.solid[met], normals, fine.width, finer)
    chosen, sample = np.unique(owner, return_inverse=True)
    points, rays = _points(fine, near, pixel[chosen])
    to_eye = -rays / np.linalg.norm(rays, axis=1, keepdims=True)
    return Hits(
        near, pixel, sample, points.astype(np.float32), normals[chosen], to_eye.astype(np.float32),
        body.look[met[chosen]],
    )  # fmt: skip


def _points(camera: Camera, nearness: Float32s, pixel: Integers) -> tuple[Array, Array]:
    """End points of the rays through pixels, base frame (m), and the rays."""
    x, y = np.asarray(pixel % camera.width + 0.5), np.asarray(pixel // camera.width + 0.5)
    rays = camera.rays(x, y)
    return camera.eye + rays / nearness[pixel, None], rays


def normals_at(body: Triangles, triangle: Integers, points: Array) -> Array:
    """Interpolate the unit normals of the corners at points [n x 3] (base frame, m) of triangles [n].

    The weight of a corner is the area of the triangle between the point and the other two corners. In space that holds
    as it is; on the picture it would have to be corrected for perspective.
    """
    corners = body.points[body.triangles]
    opposite = corners[:, LAST] - corners[:, NEXT]
    inward = np.cross(np.cross(opposite[:, 0], opposite[:, 1])[:, None], opposite)
    weights = np.einsum("nij,nij->ni", inward[triangle], points[:, None] - corners[:, NEXT][triangle])
    mixed = np.einsum("ni,nij->nj", weights, body.normals[body.triangles[triangle]])
    size: Array = np.linalg.norm(mixed, axis=1, keepdims=True)
    return mixed / np.where(size > 0.0, size, 1.0)


def _owners(pixel: Integers, solid: Integers, normals: Float32s, width: int, finer: int) -> Integers:
    """For each covered pixel, the one whose sample it shows: the first of its block if that is alike, else itself."""
    corner = pixel - pixel // width % finer * width - pixel % width % finer
    first = np.minimum(np.searchsorted(pixel, corner), len(pixel) - 1)
    alike = (pixel[first] == corner) & (solid[first] == solid)
    alike &= np.einsum("ij,ij->i", normals[first], normals) > LIKE_NORMALS
    return np.where(alike, first, np.arange(len(pixel)))


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
    kept = np.flatnonzero((last >= first) & (area > 0.0))
    x, y, area, first, rows = x[:, kept], y[:, kept], area[kept], first[kept], (last - first + 1)[kept]
    # The line opposite each corner: a x + b y + c is positive inside, and the share of the corner there times the area.
    lines = np.stack([y[LAST] - y[NEXT], x[NEXT] - x[LAST], x[LAST] * y[NEXT] - x[NEXT] * y[LAST]])
    plane = np.einsum("kim,im->km", lines, nearness[triangles[kept].T] / area)
    sizes = np.cumsum(rows + 0.5 * area)
    for chosen in np.split(np.arange(len(kept)), np.flatnonzero(np.diff(sizes // CHUNK_PIXELS)) + 1):
        triangle, row = _runs(chosen, first[chosen], rows[chosen])
        left, right = _spans(lines[:, :, triangle], row, width)
        at, column = _runs(np.arange(len(triangle)), left, np.maximum(right - left + 1, 0))
        triangle, row = triangle[at], row[at]
        across, down, rest = plane[:, triangle]
        yield row * width + column, across * (column + 0.5) + down * (row + 0.5) + rest, kept[triangle]


def _runs(owners: Integers, starts: Integers, counts: Integers) -> tuple[Integers, Integers]:
    """Repeat each owner as often as it counts, with start, start + 1, ... beside it."""
    total = np.cumsum(counts)
    offsets = np.arange(total[-1] if len(total) else 0) - np.repeat(total - counts, counts)
    return np.repeat(owners, counts), np.repeat(starts, counts) + offsets


def _spans(lines: Array, row: Integers, width: int) -> tuple[Integers, Integers]:
    """First and last pixel of triangles in rows; there is none where the last is before the first."""
    slope, rest = lines[0], lines[1] * (row + 0.5) + lines[2]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = -rest / slope
    low = np.where(slope > 0.0, crossing, -np.inf).max(axis=0)
    high = np.where(slope < 0.0, crossing, np.inf).min(axis=0)
    high = np.where(np.any((slope == 0.0) & (rest < 0.0), axis=0), -np.inf, high)
    left = np.ceil(np.clip(low - 0.5, 0.0, width)).astype(np.int64)
    right = np.floor(np.clip(high - 0.5, -1.0, width - 1.0)).astype(np.int64)
    return left, right
