"""Visibility: the nearest triangle in each pixel of a camera or a shadow map, and the points that a camera sees.

Nothing here knows light or colours.
"""

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np

from kinetostat.arrays import Array, Float32s, Integers
from kinetostat.frozen import dataclass
from kinetostat.views.rendering.camera import Camera
from kinetostat.views.scene.mesh import joined_meshes, placed_mesh
from kinetostat.views.scene.solids import LOOKS, Solid

CHUNK_PIXELS = 1_000_000
"""Pixels that are worked on together: some hundred megabytes at a time, however large the picture is."""
NEXT, LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
"""The two corners of a triangle that lie opposite each corner."""
LIKE_NORMALS = 0.97
"""Cosine between normals above which samples of one pixel on one solid share their shading: over 14 degrees a single
pixel shows no difference."""


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
        # Numbers count from 1 there, so that 0 is a pixel without a triangle.
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
    twice_area = (y[1] - y[0]) * (x[2] - x[0]) - (x[1] - x[0]) * (y[2] - y[0])  # positive where it faces the viewer
    first_row = np.clip(np.ceil(y.min(axis=0) - 0.5), 0, height).astype(np.int64)
    last_row = np.clip(np.floor(y.max(axis=0) - 0.5), -1, height - 1).astype(np.int64)
    visible = np.flatnonzero((last_row >= first_row) & (twice_area > 0.0))
    x, y, twice_area, first_row = x[:, visible], y[:, visible], twice_area[visible], first_row[visible]
    row_count = last_row[visible] - first_row + 1
    # The line opposite each corner: a x + b y + c is positive inside, and is the share of the corner there times twice
    # the area. So nearness is linear on the picture as well, with three coefficients for each triangle.
    lines = np.stack([y[LAST] - y[NEXT], x[NEXT] - x[LAST], x[LAST] * y[NEXT] - x[NEXT] * y[LAST]])
    nearness_lines = np.einsum("kim,im->km", lines, nearness[triangles[visible].T] / twice_area)
    work = np.cumsum(row_count + 0.5 * twice_area)  # about one unit for each row, and one for each pixel
    for chosen in np.split(np.arange(len(visible)), np.flatnonzero(np.diff(work // CHUNK_PIXELS)) + 1):
        triangle, row = _runs(chosen, first_row[chosen], row_count[chosen])
        left, right = _ends_in_rows(lines[:, :, triangle], row, width)
        span, column = _runs(np.arange(len(triangle)), left, np.maximum(right - left + 1, 0))
        triangle, row = triangle[span], row[span]
        a, b, c = nearness_lines[:, triangle]
        yield row * width + column, a * (column + 0.5) + b * (row + 0.5) + c, visible[triangle]


def _runs(owners: Integers, starts: Integers, counts: Integers) -> tuple[Integers, Integers]:
    """Repeat each owner as often as its count says, with start, start + 1, ... beside it."""
    total = np.cumsum(counts)
    offsets = np.arange(total[-1] if len(total) else 0) - np.repeat(total - counts, counts)
    return np.repeat(owners, counts), np.repeat(starts, counts) + offsets


def _ends_in_rows(lines: Array, row: Integers, width: int) -> tuple[Integers, Integers]:
    """Return first and last pixel of triangles, each in a row; there is none where the last is before the first."""
    slope, rest = lines[0], lines[1] * (row + 0.5) + lines[2]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = -rest / slope
    low = np.where(slope > 0.0, crossing, -np.inf).max(axis=0)
    high = np.where(slope < 0.0, crossing, np.inf).min(axis=0)
    high = np.where(np.any((slope == 0.0) & (rest < 0.0), axis=0), -np.inf, high)
    left = np.ceil(np.clip(low - 0.5, 0.0, width)).astype(np.int64)
    right = np.floor(np.clip(high - 0.5, -1.0, width - 1.0)).astype(np.int64)
    return left, right


class Triangles:
    """The triangles of several solids as one body.

    Attributes:
        points, normals: [n x 3], base frame, m.
        triangles: [m x 3], counter-clockwise as seen from outside.
        solid, look: the number of each triangle's solid, and of its look among `LOOKS` [m].
    """

    def __init__(self, solids: Sequence[Solid]) -> None:
        """Put solids together."""
        meshes = [placed_mesh(solid) for solid in solids]
        whole = joined_meshes(meshes)
        counts, names = [len(mesh.triangles) for mesh in meshes], list(LOOKS)
        self.points, self.normals, self.triangles = whole.points, whole.normals, whole.triangles
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
    nearness, nearest = nearest_triangles(*fine.project(body.points), body.triangles, fine.width, fine.height)
    pixel = np.flatnonzero(nearest >= 0)
    triangle = nearest[pixel]
    normals = np.empty((len(pixel), 3), np.float32)
    for start in range(0, len(pixel), CHUNK_PIXELS):
        part = slice(start, start + CHUNK_PIXELS)
        normals[part] = normals_at(body, triangle[part], _points_and_rays(fine, nearness, pixel[part])[0])
    owner = _owners(pixel, body.solid[triangle], normals, fine.width, samples_per_side)
    chosen, sample = np.unique(owner, return_inverse=True)
    points, rays = _points_and_rays(fine, nearness, pixel[chosen])
    to_eye = -rays / np.linalg.norm(rays, axis=1, keepdims=True)
    return Hits(
        nearness=nearness,
        pixel=pixel,
        sample=sample,
        points=points.astype(np.float32),
        normals=normals[chosen],
        to_eye=to_eye.astype(np.float32),
        look=body.look[triangle[chosen]],
    )


def _points_and_rays(camera: Camera, nearness: Float32s, pixel: Integers) -> tuple[Array, Array]:
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
    row, column = np.divmod(pixel, width)
    corner = pixel - row % block_side * width - column % block_side
    first = np.minimum(np.searchsorted(pixel, corner), len(pixel) - 1)
    alike = (pixel[first] == corner) & (solid[first] == solid)
    alike &= np.einsum("ij,ij->i", normals[first], normals) > LIKE_NORMALS
    return np.where(alike, first, np.arange(len(pixel)))
