"""Sun and sky as many distant lamps, each with a map of what is in its way: light on points. Knows no colour.

Products are `einsum`, which stays in its thread; a matrix product would start threads of its own in each of ours.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from kinetostat.engine.threads import available_cores
from kinetostat.views.rendering.camera import axes_towards
from kinetostat.views.rendering.raster import depth_map

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
Indices = NDArray[np.int64]

SUN = np.array((-0.55, -0.75, 1.5)) / math.sqrt(0.55**2 + 0.75**2 + 1.5**2)
"""Towards the main light, base axes: over the left shoulder of who looks from the front."""
SUN_RADIUS = 0.055
"""Of the main light as seen from the machine, rad: how soft its shadows are."""
SUNS, SKIES = 12, 56
"""Lamps that make up the main light, and the sky."""
SUN_SIDE, SKY_SIDE = 1024, 320
"""Pixels of a side of a lamp's map, at most."""
AWAY = 1.6
"""How far off its surface a point is asked for, in pixels of the map: a surface does not shade itself."""
GOLDEN = math.pi * (3.0 - math.sqrt(5.0))
SOFT = 3.0
"""Width over which points look up a map at random, in its pixels: steps of a shadow's edge become fine grain."""
BLOCK = 65536
"""Points whose light is summed together: what stays in the cache."""


@dataclass(frozen=True)
class Casters:
    """What is in the light's way.

    Attributes:
        points: base frame, m [n x 3].
        triangles: of the points [m x 3].
        centre: of the box around them, m [3].
        radius: of the ball around that box, m.
    """

    points: Array
    triangles: Indices
    centre: Array
    radius: float


def casters_of(points: Array, triangles: Indices) -> Casters:
    """What is in the light's way, and how far it reaches; nothing at all is a ball of radius 1 around the origin."""
    if not len(points):
        return Casters(points, triangles, np.zeros(3), 1.0)
    low, high = points.min(axis=0), points.max(axis=0)
    return Casters(points, triangles, 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low)))


@dataclass(frozen=True)
class Light:
    """What falls on points [n]: of the sun and of the sky, 1 on an open surface that faces the one or the other.

    Attributes:
        sun, sky: with shadows.
        openness: share of the sky over the surface that is not hidden.
    """

    sun: Floats
    sky: Floats
    openness: Floats


@dataclass(frozen=True)
class Lamp:
    """A distant lamp and what it reaches first.

    Attributes:
        direction: towards it, base axes [3].
        axes, shift: from a point of the base frame to column and row of the map, and to the distance behind its origin.
        nearest: of the map's pixels [side^2], the negative of that distance.
        side: pixels of a side.
    """

    direction: Floats
    axes: Floats
    shift: Floats
    nearest: Floats
    side: int

    def reaches(self, points: Floats, aside: Floats) -> NDArray[np.bool_]:
        """Whether points [3 x n] (base frame, m) are lit, looked up `aside` by some pixels of the map [2 x n]."""
        placed = np.einsum("ij,jn->in", self.axes, points) + self.shift
        column, row = np.clip(placed[:2] + aside, 0, self.side - 1).astype(np.int32)
        lit: NDArray[np.bool_] = self.nearest[row * self.side + column] <= -placed[2]
        return lit


def light_on(points: Array, normals: Array, casters: Casters, detail: int) -> Light:
    """Light on points of surfaces.

    Args:
        points: base frame, m [n x 3].
        normals: of the surfaces, unit vectors [n x 3].
        casters: what is in the light's way.
        detail: pixels across a picture of all of it: shadows need not be finer.
    """
    places, facing = (np.ascontiguousarray(array.T, dtype=np.float32) for array in (points, normals))
    aside = SOFT * (np.random.default_rng(0).random((2, len(points)), dtype=np.float32) - 0.5)
    parts = [slice(start, start + BLOCK) for start in range(0, len(points), BLOCK)]
    with ThreadPoolExecutor(available_cores()) as threads:
        fallen = []
        for directions, side in ((_sun_directions(), SUN_SIDE), (_sky_directions(), min(SKY_SIDE, detail // 2))):
            lamps = list(threads.map(partial(lamp_on, casters, side=min(side, detail)), directions))
            pieces = ((places[:, part], facing[:, part], aside[:, part]) for part in parts)
            found = list(threads.map(partial(_fallen, lamps, casters.radius), *zip(*pieces, strict=True)))
            fallen.append(np.concatenate(found, axis=1))
    (sun, _), (sky, unhidden) = fallen
    return Light(sun, sky, np.where(unhidden > 0.0, sky / np.maximum(unhidden, 1e-6), 1.0))


def lamp_on(casters: Casters, direction: Array, side: int) -> Lamp:
    """A lamp in some direction (unit vector, base axes) over all that casts shadows."""
    scale = np.array([0.5 * (side - 4) / casters.radius, 0.5 * (side - 4) / casters.radius, 1.0])
    axes = axes_towards(-direction) * scale[:, None]
    shift = np.array([0.5 * side, 0.5 * side, 0.0]) - axes @ casters.centre
    placed = np.einsum("nj,ij->ni", casters.points, axes) + shift
    nearest = depth_map(placed[:, :2], -placed[:, 2], casters.triangles, side)
    return Lamp(direction.astype(np.float32), axes.astype(np.float32), shift.astype(np.float32)[:, None], nearest, side)


def _fallen(lamps: Sequence[Lamp], radius: float, points: Floats, normals: Floats, aside: Floats) -> Floats:
    """Mean light of lamps on points [3 x n], with and without what is in the way [2 x n]."""
    lifted = points + normals * np.float32(2.0 * AWAY * radius / lamps[0].side)
    fallen = np.zeros((2, points.shape[1]), np.float32)
    for number, lamp in enumerate(lamps):
        cosines = np.maximum(np.einsum("i,in->n", lamp.direction, normals), 0.0)
        fallen[0] += cosines * lamp.reaches(lifted, aside if number % 2 else -aside[::-1])
        fallen[1] += cosines
    return fallen / np.float32(len(lamps))


def _disc(count: int) -> Array:
    """Points [count x 2] that fill the unit disc evenly (Vogel's spiral)."""
    numbers = np.arange(count) + 0.5
    radii, angles = np.sqrt(numbers / count), GOLDEN * numbers
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)


def _sun_directions() -> Array:
    across = axes_towards(-SUN)[:2]
    ways = SUN + SUN_RADIUS * _disc(SUNS) @ across
    directions: Array = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    return directions


def _sky_directions() -> Array:
    """Lamps on the upper half of a sphere, in number as the cosine from the zenith, as an overcast sky is bright."""
    flat = _disc(SKIES)
    return np.column_stack([flat, np.sqrt(1.0 - np.sum(flat**2, axis=1))])
