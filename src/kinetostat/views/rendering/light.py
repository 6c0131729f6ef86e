"""Light: what sun and sky send to points, how much their surfaces send on to the eye, and the ground with its shadow.

Nothing here knows machines. Products are `einsum`, which stays in its thread; a matrix product would start threads of
its own in each of the threads here.
"""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from kinetostat.arrays import Array, Float32s, Integers, Mask
from kinetostat.engine.batch import available_cores
from kinetostat.frozen import dataclass
from kinetostat.views.rendering.camera import Camera, axes_towards
from kinetostat.views.rendering.visibility import Triangles, nearest_triangles
from kinetostat.views.scene.solids import LOOKS, linear_rgb

SUN = np.array((-0.55, -0.75, 1.5)) / math.sqrt(0.55**2 + 0.75**2 + 1.5**2)
"""Direction to the main light, base axes: over the left shoulder of a viewer in front."""
SUN_RADIUS = 0.055
"""Radius of the main light as seen from the machine, rad: it decides how soft the shadows are."""
SUNS, SKIES = 12, 56
"""Lamps that make up the main light, and the sky: so many that the edges of soft shadows show no steps."""
SUN_SIDE, SKY_SIDE = 1024, 320
"""Largest side of a lamp's shadow map, pixels: shadows of single lamps of the sky are faint, and may be coarse."""
MAP_BORDER = 2
"""Pixels of a shadow map that stay empty on each side, so that what lies beyond is lit."""
LIFTED_PIXELS = 1.6
"""Height of a point above its surface when its light is looked up, in pixels of the map: no surface shades itself."""
LOOKUP_BLUR = 3.0
"""Width over which points look up a map at random, in its pixels: steps of a shadow's edge become fine grain."""
BLOCK_POINTS = 65536
"""Points whose light is summed together: they stay in the processor's cache."""
SUN_POWER, SKY_POWER, BOUNCE_POWER = 1.55, 0.75, 0.3
"""Irradiance of the main light, of the sky, and of what the ground reflects upwards, over pi."""
DIELECTRIC = 0.04
"""Reflectance of paint at normal incidence: that of a refractive index of 1.5."""
EXPOSURE = 0.82
"""Factor on all light before it is compressed: white paint in the sun stays just below white."""
FILM_CURVE = ((2.51, 0.03), (2.43, 0.59, 0.14))
"""Numerator and denominator of the curve by which film compresses bright light (Narkowicz 2016)."""
LEAST_FACING = 0.02
"""Least cosine between a normal and the way to the eye: at edges, normals are turned away from it."""
BLUR_OF_POLISH, BLUR_OF_ROUGHNESS = 0.06, 0.55
"""Width over which a mirrored edge is blurred, as a cosine: on polished metal, and in addition on a rough surface."""
BOXES = (
    ((0.0, 0.0, 1.0), 0.8, 2.4),
    ((-0.74, -0.56, 0.37), 0.86, 2.6),
    ((0.85, -0.42, 0.32), 0.88, 1.7),
    ((0.0, 0.95, 0.32), 0.85, 1.2),
)
"""Soft boxes that metals mirror: direction, cosine of their half width, brightness."""
GLINT = (tuple(SUN.tolist()), 0.96, 6.0)
"""The main light as surfaces mirror it, in the same form."""
WALL_BRIGHTNESS, GROUND_BRIGHTNESS = 0.3, 0.42
"""Brightness of the room above and below the horizon."""
HIDDEN_BOUNCE, HIDDEN_ROOM = 0.35, 0.3
"""Share of the light from the ground, and of what is mirrored of the room, that reaches surfaces to which no sky is
open: light in corners is never all gone."""
BOX_DIMMING = 0.45
"""Share of the brightness of a mirrored soft box that the roughest surface takes away."""
NO_LIGHT = 1e-6
"""Light below which a point faces no part of the sky: far below what a pixel can show."""
GROUND_RADIUS = 1.7
"""Radius of the ground that is drawn, in diagonals of the machine."""
LARGEST_GROUND_MAP = 448
"""Largest side of the ground's own map of light, points."""
SUN_SHARE = 0.6
"""Share of the main light in the light on open ground."""
FAINTEST_SHADOW = 0.015
"""Share of missing light below which the ground is simply bright."""
EDGE_FADE = 0.12
"""Share of the picture over which the ground fades towards each edge, so that pictures stand on a page unframed."""
SHADOW_FADE = 1.0 / 3.0
"""Share of the way from the rim of the ground to its centre on which shadows fade in: they do not end in a line."""
GRID_FADE_POWER = 1.5
"""Power of that way by which the ink of the grid grows: lines at the rim are fainter than shadows."""
GRID_LINE_WIDTH = 1.1
"""Width of the grid's lines, pixels."""
MESHES_ACROSS = 8.0
"""Meshes of the grid across the machine, about: their width is a power of ten, m."""
LEAST_MESHES = 1e-9
"""Meshes across a pixel at least: there are none where the ground ends, and lines are drawn by dividing by them."""
LEAST_MESH_PIXELS = 1.0 / 0.35
"""Pixels of a mesh below which its lines are fainter, because they crowd towards the horizon."""


class Lamp(NamedTuple):
    """A distant lamp.

    Attributes:
        direction: unit vector to the lamp, base axes.
        reaches: tells whether its light reaches points [3 x n], given the pixels by which each is looked up beside its
            place in the map of the lamp [2 x n].
    """

    direction: Float32s
    reaches: Callable[[Float32s, Float32s], Mask]


@dataclass(frozen=True)
class Light:
    """Light on points [n], 1 on an open surface that faces the lamp.

    Attributes:
        sun, sky: the lights, with shadows.
        openness: share of the sky before the surface that nothing hides.
    """

    sun: Float32s
    sky: Float32s
    openness: Float32s


def light_on(points: Array, normals: Array, casters: Triangles, detail: int) -> Light:
    """Compute the light on points of surfaces from many distant lamps, each with a map of the solids in its way.

    Args:
        points: the points, base frame, m [n x 3].
        normals: the normals of the surfaces, unit vectors [n x 3].
        casters: solids that cast shadows.
        detail: pixels across a picture of everything: shadows need not be finer.
    """
    box = casters.points if len(casters.points) else np.zeros((1, 3))
    low, high = box.min(axis=0), box.max(axis=0)
    centre, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low)) or 1.0
    places, facing = (np.ascontiguousarray(array.T, dtype=np.float32) for array in (points, normals))
    map_offsets = LOOKUP_BLUR * (np.random.default_rng(0).random((2, len(points)), dtype=np.float32) - 0.5)
    blocks = [slice(start, start + BLOCK_POINTS) for start in range(0, len(points), BLOCK_POINTS)]
    with ThreadPoolExecutor(available_cores()) as threads:

        def light_of(directions: Array, largest_side: int) -> Float32s:
            """Return the mean light of lamps in some directions, with and without shadows [2 x n]."""
            side = min(largest_side, detail)
            lamps = list(threads.map(partial(_lamp, casters, centre, radius, side), directions))
            mean_light = partial(_mean_light, lamps, 2.0 * LIFTED_PIXELS * radius / side)
            pieces = zip(
                *((places[:, block], facing[:, block], map_offsets[:, block]) for block in blocks), strict=True
            )
            return np.concatenate(list(threads.map(mean_light, *pieces)), axis=1)

        sun, _ = light_of(_sun_directions(), SUN_SIDE)
        sky, unhidden = light_of(_sky_directions(), SKY_SIDE)
    return Light(sun, sky, np.where(unhidden > 0.0, sky / np.maximum(unhidden, NO_LIGHT), 1.0))


def _lamp(casters: Triangles, centre: Array, radius: float, side: int, direction: Array) -> Lamp:
    """Make a lamp with a map [side x side] of the ball around all casters: the depths that are nearest to the lamp."""
    # From base axes (m) to columns and rows of the map (pixels) and depth from the lamp (m): the ball fills the map but
    # for its border, and lies at depths from one to three radii.
    axes = axes_towards(-direction)
    axes[:2] *= 0.5 * (side - 2 * MAP_BORDER) / radius
    shift = np.array([0.5 * side, 0.5 * side, 2.0 * radius]) - axes @ centre
    placed = np.einsum("nj,ij->ni", casters.points, axes) + shift
    nearest, _ = nearest_triangles(placed[:, :2], 4.0 * radius - placed[:, 2], casters.triangles, side, side)
    nearest[nearest == 0.0] = -np.inf  # no caster: lit at every depth
    map_axes, map_shift = axes.astype(np.float32), shift.astype(np.float32)[:, None]

    def reaches(points: Float32s, map_offsets: Float32s) -> Mask:
        on_map = np.einsum("ij,jn->in", map_axes, points) + map_shift
        column, row = np.clip(on_map[:2] + map_offsets, 0, side - 1).astype(np.int32)
        lit: Mask = nearest[row * side + column] <= np.float32(4.0 * radius) - on_map[2]
        return lit

    return Lamp(direction.astype(np.float32), reaches)


def _mean_light(
    lamps: Sequence[Lamp], lift: float, points: Float32s, normals: Float32s, map_offsets: Float32s
) -> Float32s:
    """Return the mean light of lamps, with and without shadows [2 x n], on points [3 x n] lifted (m) off a surface."""
    lifted = points + normals * np.float32(lift)
    light = np.zeros((2, points.shape[1]), np.float32)
    for number, lamp in enumerate(lamps):
        cosines = np.maximum(np.einsum("i,in->n", lamp.direction, normals), 0.0)
        # Neighbours in the list of lamps look up in different places, so that their grain is not the same.
        light[0] += cosines * lamp.reaches(lifted, map_offsets if number % 2 else -map_offsets[::-1])
        light[1] += cosines
    return light / np.float32(len(lamps))


def _disc(count: int) -> Array:
    """Fill the unit disc evenly with points [count x 2]: Vogel's spiral, with the golden angle between neighbours."""
    numbers = np.arange(count) + 0.5
    radii, angles = np.sqrt(numbers / count), math.pi * (3.0 - math.sqrt(5.0)) * numbers
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)


def _sun_directions() -> Array:
    directions: Array = SUN + SUN_RADIUS * _disc(SUNS) @ axes_towards(-SUN)[:2]
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def _sky_directions() -> Array:
    """Return the lamps on the upper half of a sphere, as dense as the cosine from the zenith: an overcast sky."""
    level = _disc(SKIES)
    return np.column_stack([level, np.sqrt(1.0 - np.sum(level**2, axis=1))])


def shaded_colors(look: Integers, normals: Float32s, to_eye: Float32s, light: Light) -> Float32s:
    """Compute the colours [n x 3] (linear, 0 to 1) of points: paint and metal in a studio with soft boxes.

    Diffuse paint takes light from sun, sky and ground; shiny surfaces mirror the room and the main light. At the end
    bright light is compressed as film does.

    Source: C. Schlick, An inexpensive BRDF model for physically-based rendering (1994), for the reflectance;
    K. Narkowicz, ACES filmic tone mapping curve (2016).

    Args:
        look: numbers of the looks of the points [n].
        normals, to_eye: unit vectors along the normals and to the eye [n x 3], base axes.
        light: the light on the points.
    """
    looks = LOOKS.values()
    color = np.array([linear_rgb(entry.color) for entry in looks], dtype=np.float32)[look]
    metal = np.array([[entry.metalness] for entry in looks], dtype=np.float32)[look]
    roughness = np.array([[entry.roughness] for entry in looks], dtype=np.float32)[look]
    mirrored = DIELECTRIC * (1.0 - metal) + color * metal
    facing = np.maximum(np.sum(normals * to_eye, axis=1, keepdims=True), LEAST_FACING)
    open_to, sun = light.openness[:, None], light.sun[:, None]
    bounce = BOUNCE_POWER * (0.5 - 0.5 * normals[:, 2:]) * (HIDDEN_BOUNCE + (1.0 - HIDDEN_BOUNCE) * open_to)
    diffuse = color * (1.0 - metal) * (SUN_POWER * sun + SKY_POWER * light.sky[:, None] + bounce)
    grazing = np.maximum(1.0 - roughness, mirrored) - mirrored
    reflectance = mirrored + grazing * (1.0 - np.minimum(facing, 1.0)) ** 5
    mirror = 2.0 * facing * normals - to_eye
    room = (HIDDEN_ROOM + (1.0 - HIDDEN_ROOM) * open_to) * _room(mirror, roughness)
    exposed = EXPOSURE * (diffuse + reflectance * (room + sun * _box(mirror, roughness, *GLINT)))
    (a, b), (c, d, e) = FILM_CURVE
    return np.clip(exposed * (a * exposed + b) / (exposed * (c * exposed + d) + e), 0.0, 1.0)


def _room(direction: Float32s, roughness: Float32s) -> Float32s:
    """Return the brightness [n x 1] of the room in a direction: walls, ground and soft boxes."""
    blur = _blur(roughness)
    wall_share = smooth_step(direction[:, 2:], -blur, blur)
    brightness = GROUND_BRIGHTNESS + (WALL_BRIGHTNESS - GROUND_BRIGHTNESS) * wall_share
    return sum((_box(direction, roughness, *box) for box in BOXES), start=brightness)


def _box(direction: Float32s, roughness: Float32s, centre: Sequence[float], edge: float, power: float) -> Float32s:
    """Return the brightness [n x 1] of a soft box in a direction, more blurred and weaker on rougher surfaces."""
    along, blur = direction @ np.array(centre, dtype=np.float32)[:, None], _blur(roughness)
    return power * smooth_step(along, edge - blur, edge + blur) * (1.0 - BOX_DIMMING * roughness)


def _blur(roughness: Float32s) -> Float32s:
    return BLUR_OF_POLISH + BLUR_OF_ROUGHNESS * roughness


def smooth_step(value: Array | Float32s, low: Array | Float32s | float, high: Array | Float32s | float) -> Float32s:
    """Return the rise from 0 at `low` to 1 at `high`, level at both ends."""
    share = np.clip((value - low) / (high - low), 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


def srgb_of(light: Float32s) -> Float32s:
    """Encode linear light, 0 to 1, as sRGB (IEC 61966-2-1)."""
    bright = 1.055 * np.maximum(light, 0.0031308) ** np.float32(1.0 / 2.4) - 0.055
    return np.where(light <= 0.0031308, 12.92 * light, bright)


@dataclass(frozen=True)
class Ground:
    """A level disc with a square map of light around its centre.

    Attributes:
        centre: base frame, m, at its height.
        size: diagonal of the machine that stands on it and half the side of the map, m.
        side: points of a side of the map.
    """

    centre: Array
    size: float
    side: int

    @property
    def points(self) -> Array:
        """Points of the map [side^2 x 3], base frame, m."""
        steps = np.linspace(-self.size, self.size, self.side)
        x, y = np.meshgrid(steps, steps)
        return self.centre + np.stack([x.ravel(), y.ravel(), np.zeros(self.side**2)], axis=1)


def veil_over(ground: Ground, light: Light, camera: Camera) -> tuple[Float32s, Float32s]:
    """Compute how the ground covers a background [height x width]: shares of shadow and of the grid's ink.

    Args:
        ground: the ground below the machine.
        light: the light on the `points` of the ground.
        camera: the camera of the picture.
    """
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    offsets, nearness = _seen_on_ground(ground, camera, x, y)
    edge = _inside(x / camera.width) * _inside(y / camera.height)
    map_places = (offsets[..., ::-1] / ground.size + 1.0) * 0.5 * (ground.side - 1)
    missing = map_coordinates(_missing(ground, light), np.moveaxis(map_places, -1, 0), order=1, mode="nearest")
    shadow = missing * np.minimum(nearness / SHADOW_FADE, 1.0) * edge
    mesh_width = 10.0 ** round(math.log10(ground.size / MESHES_ACROSS))
    grid = _grid(offsets / mesh_width) * nearness**GRID_FADE_POWER * edge
    return shadow.astype(np.float32), grid.astype(np.float32)


def _seen_on_ground(ground: Ground, camera: Camera, x: Array, y: Array) -> tuple[Array, Array]:
    """Find the points of the ground that the places x, y of a picture (pixels) show.

    Returns:
        Their offsets from its centre, m [... x 2], and how near they are to it: 1 at the centre, 0 at the rim. Where
        no ground is seen, both are 0.
    """
    rays = camera.rays(x, y)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (ground.centre[2] - camera.eye[2]) / rays[..., 2]
        offsets = camera.eye[:2] + distance[..., None] * rays[..., :2] - ground.centre[:2]
    radius = np.linalg.norm(offsets, axis=-1) / (GROUND_RADIUS * ground.size)
    is_ground = (distance > 0.0) & (radius < 1.0)
    return np.where(is_ground[..., None], offsets, 0.0), np.where(is_ground, 1.0 - np.minimum(radius, 1.0), 0.0)


def _missing(ground: Ground, light: Light) -> Float32s:
    """Return the share of the light that shadows take away, on the map; smoothed, because single points are grainy."""
    present = SUN_SHARE * light.sun / light.sun.max() + (1.0 - SUN_SHARE) * light.sky / light.sky.max()
    missing = gaussian_filter(1.0 - present.reshape(ground.side, ground.side), 1.0)
    return np.maximum(missing - FAINTEST_SHADOW, 0.0) / (1.0 - FAINTEST_SHADOW)


def _inside(share: Array) -> Float32s:
    """Return the rise from 0 at either edge of the picture to 1 well inside.

    Args:
        share: places between the edges, from 0 at the one to 1 at the other.
    """
    return smooth_step(np.minimum(share, 1.0 - share), 0.0, EDGE_FADE)


def _grid(places: Array) -> Array:
    """Return the share of each pixel that lines at whole numbers cover, less where they crowd [height x width].

    Args:
        places: what each pixel shows, in meshes of the grid [height x width x 2].
    """
    ink = np.zeros(places.shape[:2])
    for axis in range(2):
        across = places[..., axis]
        meshes_per_pixel = np.maximum(np.hypot(*np.gradient(across)), LEAST_MESHES)
        pixels_away = np.abs(across - np.round(across)) / meshes_per_pixel
        covered = np.clip(0.5 * GRID_LINE_WIDTH + 0.5 - pixels_away, 0.0, 1.0)
        ink = np.maximum(ink, covered * np.clip(1.0 / (LEAST_MESH_PIXELS * meshes_per_pixel), 0.0, 1.0))
    return ink
