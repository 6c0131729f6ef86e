"""The ground below a machine: its shadow and a faint grid, as a veil over any background. Knows no machine."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinetostat.views.rendering.camera import Camera
from kinetostat.views.rendering.light import Light

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

REACH = 1.7
"""Radius of the ground that is drawn, in diagonals of the machine."""
SHADED = 1.0
"""Half the side of the square on which it is not simply bright, likewise."""
SIDE = 448
"""Points of a side of the ground's own map of light, at most."""
SUN_SHARE = 0.6
"""Of the light on open ground."""
FAINT = 0.015
"""Share of missing light below which the ground is simply bright."""
EDGE = 0.12
"""Share of the picture's sides over which the ground fades towards them, so that pictures stand on a page unframed."""
LINE = 1.1
"""Width of the grid's lines, pixels."""


@dataclass(frozen=True)
class Ground:
    """A level disc.

    Attributes:
        centre: base frame, m, at its height.
        size: diagonal of the machine that stands on it, m.
        side: points of a side of its map of light.
    """

    centre: Array
    size: float
    side: int

    @property
    def points(self) -> Array:
        """Where the light on the ground is asked for [side^2 x 3], base frame, m."""
        steps = (np.arange(self.side) / (self.side - 1) * 2.0 - 1.0) * SHADED * self.size
        x, y = np.meshgrid(steps, steps)
        return self.centre + np.stack([x.ravel(), y.ravel(), np.zeros(self.side**2)], axis=1)

    @property
    def step(self) -> float:
        """Distance of the grid's lines, m: a power of ten."""
        return float(10.0 ** round(math.log10(self.size / 8.0)))


@dataclass(frozen=True)
class Veil:
    """What the ground does to a background [height x width]: shares of shadow and of the grid's ink."""

    shadow: Floats
    ink: Floats


def veil_over(ground: Ground, light: Light, camera: Camera) -> Veil:
    """The ground as a camera sees it.

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
    radius = np.linalg.norm(at, axis=-1) / (REACH * ground.size)
    here = (distance > 0.0) & (radius < 1.0)
    at, fade = np.where(here[..., None], at, 0.0), np.where(here, 1.0 - np.minimum(radius, 1.0), 0.0)
    edge = _towards(camera.width)[None, :] * _towards(camera.height)[:, None]
    missing = 1.0 - (SUN_SHARE * light.sun / light.sun.max() + (1.0 - SUN_SHARE) * light.sky / light.sky.max())
    missing = _smooth(missing.reshape(ground.side, ground.side))
    missing = np.maximum(missing - FAINT, 0.0) / (1.0 - FAINT)
    shadow = _between(missing, at / (SHADED * ground.size)) * np.minimum(3.0 * fade, 1.0) * edge
    return Veil(shadow.astype(np.float32), (_grid(at, ground.step) * fade**1.5 * edge).astype(np.float32))


def _towards(side: int) -> Array:
    """From 0 at either end of a side of the picture to 1 well inside [side]."""
    share = np.minimum((np.arange(side) + 0.5) / side, (side - np.arange(side) - 0.5) / side)
    inside = np.minimum(share / EDGE, 1.0)
    return inside * inside * (3.0 - 2.0 * inside)


def _smooth(values: Floats) -> Floats:
    """Without the grain of single points: each row and column with its neighbours, twice."""
    for axis in (0, 1, 0, 1):
        values = 0.5 * values + 0.25 * (np.roll(values, 1, axis) + np.roll(values, -1, axis))
    return values


def _between(values: Floats, at: Array) -> Array:
    """Values of a map over the square from -1 to 1 at points of it, linear in between."""
    place = (at + 1.0) * 0.5 * (len(values) - 1)
    low = np.clip(place.astype(np.int64), 0, len(values) - 2)
    share = np.clip(place - low, 0.0, 1.0)
    x, y, sx, sy = low[..., 0], low[..., 1], share[..., 0], share[..., 1]
    upper = values[y, x] * (1.0 - sx) + values[y, x + 1] * sx
    lower = values[y + 1, x] * (1.0 - sx) + values[y + 1, x + 1] * sx
    return upper * (1.0 - sy) + lower * sy


def _grid(at: Array, step: float) -> Array:
    """Share of each pixel that lines through the centre and every `step` from it cover."""
    found = np.zeros(at.shape[:2])
    for axis in range(2):
        lines = at[..., axis] / step
        down, across = np.gradient(lines)
        pixel = np.maximum(np.hypot(down, across), 1e-9)
        away = np.abs(lines - np.round(lines)) / pixel
        found = np.maximum(found, np.clip(0.5 * LINE + 0.5 - away, 0.0, 1.0) * np.clip(0.35 / pixel, 0.0, 1.0))
    return found
