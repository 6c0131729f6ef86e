"""How much of the light a surface sends to the eye: paint and metal in a studio with soft boxes. Linear light."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinetostat.views.rendering.light import SUN, Light
from kinetostat.views.scene.looks import Look, linear

Floats = NDArray[np.float32]

SUN_POWER, SKY_POWER, BOUNCE_POWER = 1.55, 0.75, 0.3
"""Irradiance of the main light, of the sky, and of what the ground sends back up, over pi."""
DIELECTRIC = 0.04
"""Reflectance of paint that one looks at straight."""
EXPOSURE = 0.82
BOXES = (
    ((0.0, 0.0, 1.0), 0.8, 2.4),
    ((-0.74, -0.56, 0.37), 0.86, 2.6),
    ((0.85, -0.42, 0.32), 0.88, 1.7),
    ((0.0, 0.95, 0.32), 0.85, 1.2),
)
"""Soft boxes that metals mirror: direction, cosine of their half width, brightness."""
WALL, GROUND = 0.3, 0.42
"""Brightness of the room above and below the horizon."""


@dataclass(frozen=True)
class Finish:
    """What surfaces are like at points: diffuse colour and mirrored colour [n x 3] (linear), roughness [n x 1]."""

    diffuse: Floats
    mirrored: Floats
    roughness: Floats


def finish_of(looks: list[Look], numbers: NDArray[np.int64]) -> Finish:
    """The finish of points [n] that have looks of these numbers."""
    colors = np.array([linear(look.color) for look in looks], dtype=np.float32)
    metal = np.array([[look.metalness] for look in looks], dtype=np.float32)
    roughness = np.array([[look.roughness] for look in looks], dtype=np.float32)
    diffuse, mirrored = colors * (1.0 - metal), DIELECTRIC * (1.0 - metal) + colors * metal
    return Finish(diffuse[numbers], mirrored[numbers], roughness[numbers])


def encoded(light: Floats) -> Floats:
    """Shares of light as sRGB, 0 to 1 (IEC 61966-2-1)."""
    clipped = np.clip(light, 0.0, 1.0)
    bright = 1.055 * np.maximum(clipped, 0.0031308) ** np.float32(1.0 / 2.4) - 0.055
    return np.where(clipped <= 0.0031308, 12.92 * clipped, bright)


def shaded(finish: Finish, normals: Floats, to_eye: Floats, light: Light) -> Floats:
    """Colours [n x 3] (linear, toned) of points.

    Args:
        finish: of their surfaces.
        normals, to_eye: unit vectors [n x 3], base axes.
        light: that falls on them.
    """
    facing = np.maximum(np.sum(normals * to_eye, axis=1, keepdims=True), 0.02)
    mirrored_way = 2.0 * facing * normals - to_eye
    up = normals[:, 2:3]
    open_to = light.openness[:, None]
    bounce = BOUNCE_POWER * (0.5 - 0.5 * up) * (0.35 + 0.65 * open_to)
    fallen = SUN_POWER * light.sun[:, None] + SKY_POWER * light.sky[:, None] + bounce
    reflectance = _reflectance(finish, facing)
    veil = 0.3 + 0.7 * open_to
    sent = finish.diffuse * fallen + reflectance * _room(mirrored_way, finish.roughness) * veil
    return _toned(sent + _glint(finish, normals, to_eye, facing) * light.sun[:, None])


def _reflectance(finish: Finish, facing: Floats) -> Floats:
    """Of a rough surface for light from everywhere.

    Source: B. Karis, Physically based shading on mobile (2014), fit of the split-sum integral.
    """
    r = finish.roughness
    ax, ay, az, aw = 1.0 - r, 0.0425 - 0.0275 * r, 1.04 - 0.572 * r, 0.022 * r - 0.04
    grazing = np.minimum(ax * ax, 2.0 ** (-9.28 * facing)) * ax + ay
    return finish.mirrored * (-1.04 * grazing + az) + (1.04 * grazing + aw)


def _room(way: Floats, roughness: Floats) -> Floats:
    """Brightness [n x 1] that is seen in a direction, blurred as the roughness asks."""
    blur = 0.06 + 0.55 * roughness
    found = GROUND + (WALL - GROUND) * _step(way[:, 2:3], -blur, blur)
    for direction, edge, power in BOXES:
        along = way @ np.array(direction, dtype=np.float32)[:, None]
        found += power * _step(along, edge - blur, edge + blur) * (1.0 - 0.45 * roughness)
    return found


def _step(value: Floats, low: Floats, high: Floats) -> Floats:
    share = np.clip((value - low) / (high - low), 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


def _glint(finish: Finish, normals: Floats, to_eye: Floats, facing: Floats) -> Floats:
    """The main light's own mirror image.

    Source: B. Walter et al., Microfacet models for refraction through rough surfaces (2007): GGX.
    """
    half = to_eye + SUN.astype(np.float32)
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    squared = finish.roughness**4
    along = np.maximum(np.sum(normals * half, axis=1, keepdims=True), 0.0)
    spread = squared / (along * along * (squared - 1.0) + 1.0) ** 2
    k = 0.5 * finish.roughness**2
    return finish.mirrored * spread / (4.0 * (facing * (1.0 - k) + k)) * SUN_POWER


def _toned(light: Floats) -> Floats:
    """Bright light compressed as film does.

    Source: K. Narkowicz, ACES filmic tone mapping curve (2016).
    """
    x = EXPOSURE * light
    return np.clip(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0)
