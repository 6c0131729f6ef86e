"""A picture of a machine as a PNG: solids with light, shadow and ground. Needs no graphics processor and no browser."""

import io
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.views.rendering.body import Body, Hits, hits_of
from kinetostat.views.rendering.camera import VIEWS, Camera, camera_on
from kinetostat.views.rendering.ground import SIDE, Ground, Veil, veil_over
from kinetostat.views.rendering.labels import draw_labels
from kinetostat.views.rendering.light import Casters, Light, casters_of, light_on
from kinetostat.views.rendering.surface import encoded, finish_of, shaded
from kinetostat.views.scene.looks import LOOKS
from kinetostat.views.scene.machine_scene import scene_of
from kinetostat.views.scene.solids import LAYERS, Scene

Floats = NDArray[np.float32]
Theme: TypeAlias = Literal["light", "dark"]

FINER = 2
"""Samples of a pixel across and down."""
SMALLEST, LARGEST = 16, 4096
"""Pixels of a side."""
PLAIN = ("frames", "labels")
"""Layers that a picture leaves out unless they are asked for."""
UNSHADOWED = frozenset(("springs", "frames", "directions", "ellipsoids", "deflection"))
"""Layers of signs, which cast no shadow."""


class Picture(bytes):
    """The bytes of a PNG, which a notebook displays."""

    def _repr_png_(self) -> bytes:
        return bytes(self)


@dataclass(frozen=True)
class Paper:
    """What a picture stands on: colours as sRGB shares, strength of shadows and grid, brightness of the machine."""

    color: tuple[float, float, float]
    ink: tuple[float, float, float]
    shadow: float
    grid: float
    brightness: float


PAPERS: dict[str, Paper] = {
    "light": Paper((1.0, 1.0, 1.0), (0.55, 0.6, 0.66), 0.5, 0.55, 1.0),
    "dark": Paper((0.094, 0.118, 0.153), (0.47, 0.54, 0.62), 0.62, 0.45, 0.86),
}


def machine_picture(
    machine: Machine,
    size: tuple[int, int] = (1600, 1200),
    view: str | Sequence[float] = "iso",
    *,
    theme: Theme = "light",
    transparent: bool = False,
    hidden: Collection[str] = PLAIN,
) -> Picture:
    """A picture of a machine at its pose as a PNG.

    Args:
        machine: with its pose.
        size: width and height, pixels.
        view: "iso", "front" and so on, or the direction from the machine to the camera, base axes.
        theme: for "light" or for "dark" pages.
        transparent: whether shadow and grid are all there is of a background.
        hidden: layers of the scene to leave out.

    Raises:
        InputError: there is no such view, theme or layer, the size cannot be had, or the pose cannot be drawn.
    """
    return picture(scene_of(machine), size, view, theme=theme, transparent=transparent, hidden=hidden)


def picture(
    scene: Scene,
    size: tuple[int, int] = (1600, 1200),
    view: str | Sequence[float] = "iso",
    *,
    theme: Theme = "light",
    transparent: bool = False,
    hidden: Collection[str] = PLAIN,
) -> Picture:
    """A picture of a scene as a PNG.

    Args:
        scene: what there is to see.
        size: width and height, pixels.
        view: one of `camera.VIEWS`, or the direction from the scene to the camera, base axes.
        theme: for white or for dark pages.
        transparent: whether shadow and grid are all there is of a background.
        hidden: layers of the scene to leave out.

    Raises:
        InputError: there is no such view, theme or layer, or the size cannot be had.
    """
    _check_size(size)
    paper = PAPERS[choice(theme, PAPERS, "theme")]
    for layer in hidden:
        choice(layer, LAYERS, "hidden")
    solids = [solid for solid in scene.solids if solid.layer not in hidden]
    if not solids:
        raise InputError(f"hidden leaves nothing to draw; leave out fewer of {', '.join(LAYERS)}.")
    opaque = Body([solid for solid in solids if LOOKS[solid.material].opacity == 1.0])
    clear = [Body([s for s in solids if s.material == m]) for m, look in LOOKS.items() if look.opacity < 1.0]
    bodies = [opaque, *(body for body in clear if body.solids)]
    points = np.concatenate([body.points for body in bodies])
    camera = camera_on(points, _direction(view), *size)
    layers = [hits_of(body, camera, FINER) for body in bodies]
    foot = np.array([*scene.centre.components()[:2], scene.floor], dtype=float)
    ground = Ground(foot, scene.size, min(SIDE, max(size) // 2))
    casting = Body([solid for solid in opaque.solids if solid.layer not in UNSHADOWED])
    lights = _lights(layers, ground, casters_of(casting.points, casting.triangles), max(size))
    machine = _machine(layers, lights[:-1], camera, paper.brightness)
    image = Image.fromarray(_composed(machine, veil_over(ground, lights[-1], camera), paper, transparent))
    draw_labels(image, [label for label in scene.labels if label.layer not in hidden], camera)
    return _png(image if transparent else image.convert("RGB"))


def _check_size(size: tuple[int, int]) -> None:
    if not all(SMALLEST <= side <= LARGEST for side in size):
        raise InputError(f"size is {shorten(size)}; give width and height, each {SMALLEST} to {LARGEST} pixels.")


def _direction(view: str | Sequence[float]) -> Sequence[float]:
    if isinstance(view, str):
        return VIEWS[choice(view, VIEWS, "view")]
    if len(view) != 3 or not all(map(math.isfinite, view)) or not any(view):
        raise InputError(f"view is {shorten(view)}; give {', '.join(VIEWS)}, or a direction: three numbers, not all 0.")
    return view


def _lights(layers: Sequence[Hits], ground: Ground, casters: Casters, detail: int) -> list[Light]:
    """The light on the samples of each layer, and on the ground, all asked for at once."""
    ends = np.cumsum([len(layer.points) for layer in layers])
    points = np.concatenate([*(layer.points for layer in layers), ground.points])
    up = np.broadcast_to((0.0, 0.0, 1.0), (len(points) - ends[-1], 3))
    found = light_on(points, np.concatenate([*(layer.normals for layer in layers), up]), casters, detail)
    parts = [np.split(values, ends) for values in (found.sun, found.sky, found.openness)]
    return [Light(*part) for part in zip(*parts, strict=True)]


def _machine(layers: Sequence[Hits], lights: Sequence[Light], camera: Camera, brightness: float) -> Floats:
    """What is seen of the solids [height x width x 4]: sRGB shares times opacity, and opacity."""
    looks = list(LOOKS.values())
    opaque = layers[0]
    canvas = np.zeros((camera.height * camera.width * FINER**2, 4), dtype=np.float32)
    nearness = opaque.nearness
    for layer, light in sorted(zip(layers, lights, strict=True), key=lambda pair: pair[0] is not opaque):
        finish = finish_of(looks, layer.look)
        color = encoded(brightness * shaded(finish, layer.normals, layer.to_eye, light))
        opacity = np.array([[look.opacity] for look in looks], dtype=np.float32)[layer.look]
        ahead = layer.nearness[layer.pixel] >= nearness[layer.pixel]
        at, sample = layer.pixel[ahead], layer.sample[ahead]
        canvas[at] *= 1.0 - opacity[sample]
        canvas[at] += np.concatenate([color, np.ones_like(opacity)], axis=1)[sample] * opacity[sample]
    finer = canvas.reshape(camera.height, FINER, camera.width, FINER, 4)
    summed = np.add.reduce([finer[:, y, :, x] for y in range(FINER) for x in range(FINER)])
    return summed / np.float32(FINER**2)


def _composed(machine: Floats, veil: Veil, paper: Paper, transparent: bool) -> NDArray[np.uint8]:
    """Machine over grid over shadow over paper [height x width x 4]."""
    shadow, ink = paper.shadow * veil.shadow[..., None], paper.grid * veil.ink[..., None]
    under = np.zeros(3, np.float32) if transparent else np.array(paper.color, np.float32)
    color = under * (1.0 - shadow) * (1.0 - ink) + np.array(paper.ink, np.float32) * ink
    alpha = shadow * (1.0 - ink) + ink if transparent else np.ones_like(shadow)
    rest = 1.0 - machine[..., 3:]
    color, alpha = machine[..., :3] + rest * color, machine[..., 3:] + rest * alpha
    color = color / np.maximum(alpha, 1.0 / 255.0)
    shares = np.clip(np.concatenate([color, alpha], axis=2), 0.0, 1.0)
    return np.round(255.0 * shares).astype(np.uint8)


def _png(image: Image.Image) -> Picture:
    stream = io.BytesIO()
    image.save(stream, "PNG")
    return Picture(stream.getvalue())
