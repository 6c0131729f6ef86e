"""The ground below a machine: its shadow and a faint grid, laid as a veil over any background."""

import math

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from kinetostat.arrays import Array, Float32s
from kinetostat.frozen import dataclass
from kinetostat.views.rendering.camera import Camera
from kinetostat.views.rendering.light import Light, smooth_step

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
GRID_LINE_WIDTH = 1.1
"""Width of the grid's lines, pixels."""


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
        ground: where it is.
        light: on its `points`.
        camera: of the picture.
    """
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    rays = camera.rays(x, y)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (ground.centre[2] - camera.eye[2]) / rays[..., 2]
        at = camera.eye[:2] + distance[..., None] * rays[..., :2] - ground.centre[:2]
    radius = np.linalg.norm(at, axis=-1) / (GROUND_RADIUS * ground.size)
    here = (distance > 0.0) & (radius < 1.0)
    at, fade = np.where(here[..., None], at, 0.0), np.where(here, 1.0 - np.minimum(radius, 1.0), 0.0)
    edge = _inside(x / camera.width) * _inside(y / camera.height)
    place = (at[..., ::-1] / ground.size + 1.0) * 0.5 * (ground.side - 1)
    missing = map_coordinates(_missing(ground, light), np.moveaxis(place, -1, 0), order=1, mode="nearest")
    shadow = missing * np.minimum(3.0 * fade, 1.0) * edge
    step = 10.0 ** round(math.log10(ground.size / 8.0))
    return shadow.astype(np.float32), (_grid(at / step) * fade**1.5 * edge).astype(np.float32)


def _missing(ground: Ground, light: Light) -> Float32s:
    """Share of the light that shadows take away, on the map; smoothed, because single points are grainy."""
    present = SUN_SHARE * light.sun / light.sun.max() + (1.0 - SUN_SHARE) * light.sky / light.sky.max()
    missing = gaussian_filter(1.0 - present.reshape(ground.side, ground.side), 1.0)
    return np.maximum(missing - FAINTEST_SHADOW, 0.0) / (1.0 - FAINTEST_SHADOW)


def _inside(share: Array) -> Float32s:
    """Rise from 0 at either edge of the picture to 1 well inside."""
    return smooth_step(np.minimum(share, 1.0 - share), 0.0, EDGE_FADE)


def _grid(at: Array) -> Array:
    """Share of each pixel [height x width] that the lines at whole numbers cover, fainter where they crowd."""
    ink = np.zeros(at.shape[:2])
    for axis in range(2):
        lines = at[..., axis]
        pixel = np.maximum(np.hypot(*np.gradient(lines)), 1e-9)
        away = np.abs(lines - np.round(lines)) / pixel
        ink = np.maximum(ink, np.clip(0.5 * GRID_LINE_WIDTH + 0.5 - away, 0.0, 1.0) * np.clip(0.35 / pixel, 0.0, 1.0))
    return ink
