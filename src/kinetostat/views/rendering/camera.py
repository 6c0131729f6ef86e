"""The perspective camera: its place, its view, and the pixels to which it projects points. It knows no solids."""

import math
from collections.abc import Sequence

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass

VIEWPOINTS = {
    "iso": (1.0, -1.35, 0.75),
    "front": (0.0, -1.0, 0.02),
    "side": (1.0, 0.0, 0.02),
    "top": (0.0, -0.02, 1.0),
}
"""Direction from the machine to the camera, base axes; those along an axis are a little tilted, so that flat parts show
a second side."""
FIELD_OF_VIEW = math.radians(32.0)
"""Angle of view across the picture's shorter side: that of a moderate telephoto lens, under which parallel legs still
look parallel."""
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
        points: points of everything that has to be visible, two different ones at least.
        direction: direction from the machine to the camera, base axes.
        width, height: size of the picture, pixels.
    """
    axes = axes_towards(-np.array(direction, dtype=float))
    # A slope is a displacement in the picture per depth, across and up; the picture reaches to the last slope.
    last_slope = math.tan(0.5 * FIELD_OF_VIEW) * np.array([width, height]) / min(width, height)
    target = 0.5 * (points.min(axis=0) + points.max(axis=0))
    distance = float(np.linalg.norm(np.ptp(points, axis=0))) / last_slope.min()
    for _ in range(FITTING_STEPS):
        from_eye = (points - target) @ axes.T + (0.0, 0.0, distance)
        slopes = from_eye[:, :2] / from_eye[:, 2:]
        low, high = slopes.min(axis=0), slopes.max(axis=0)
        target = target + 0.5 * distance * (low + high) @ axes[:2]
        distance *= float(np.max(0.5 * (high - low) / last_slope)) / (1.0 - 2.0 * EMPTY_MARGIN)
    return Camera(target - distance * axes[2], axes, 0.5 * height / last_slope[1], width, height)
