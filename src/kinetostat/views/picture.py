"""A picture of a machine as a PNG: solids with light, shadow and ground.

The parts of the renderer (camera, visibility, light, ground) join here; it needs no graphics processor and no browser.
"""

import io
import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypeAlias

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from kinetostat.arrays import Float32s
from kinetostat.frozen import dataclass
from kinetostat.machine.machine import Machine
from kinetostat.spec.arguments import as_list, checked
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.views.rendering.camera import VIEWPOINTS, Camera, camera_on
from kinetostat.views.rendering.light import (
    LARGEST_GROUND_MAP,
    Ground,
    Light,
    light_on,
    shaded_colors,
    srgb_of,
    veil_over,
)
from kinetostat.views.rendering.visibility import Hits, Triangles, hits_of
from kinetostat.views.scene.machine_scene import scene_of
from kinetostat.views.scene.solids import LAYERS, LOOKS, Label, Scene, Solid

Theme: TypeAlias = Literal["light", "dark"]

SAMPLES_PER_SIDE = 2
"""Samples of a pixel across and down: their mean has smooth edges, and more of them take longer than they show."""
SMALLEST, LARGEST = 16, 4096
"""Smallest and largest side of a picture, pixels."""
HIDDEN_BY_DEFAULT = ("frames", "labels")
"""Layers that a picture leaves out by default."""
UNSHADOWED = frozenset(("springs", "frames", "directions", "ellipsoids", "deflection"))
"""Layers of symbols, which cast no shadow."""
FONT = Path(mpl.get_data_path()) / "fonts" / "ttf" / "DejaVuSans-Bold.ttf"
LETTERS, SMALLEST_LETTERS = 0.017, 9
"""Height of letters as a share of the picture's shorter side, and at least, pixels."""
DISC_RADIUS, DISC_MARGIN = 0.95, 0.45
"""Radius of the disc below the number of a leg, and room beside a long number, as shares of the height of letters: two
digits fit into a round disc."""
LETTERS_PER_RIM, LETTERS_PER_HALO = 14, 8
"""Widths of a disc's rim, and of the halo of a letter of a frame, that make up the height of letters."""
INK, DISC, RIM = (20, 28, 38, 255), (255, 255, 255, 235), (120, 132, 146, 255)
"""Colours of letters, of the disc below the number of a leg, and of its rim."""


class Picture(bytes):
    """Bytes of a PNG that a notebook displays."""

    def _repr_png_(self) -> bytes:
        return bytes(self)


@dataclass(frozen=True)
class Paper:
    """Background of a picture.

    Attributes:
        color, ink: the colours of the page and of the grid, sRGB from 0 to 1.
        shadow, grid: how strongly shadows and grid cover it, 0 to 1.
        brightness: the brightness of the machine.
    """

    color: tuple[float, float, float]
    ink: tuple[float, float, float]
    shadow: float
    grid: float
    brightness: float


PAPERS: dict[str, Paper] = {
    "light": Paper(color=(1.0, 1.0, 1.0), ink=(0.55, 0.6, 0.66), shadow=0.5, grid=0.55, brightness=1.0),
    "dark": Paper(color=(0.094, 0.118, 0.153), ink=(0.47, 0.54, 0.62), shadow=0.62, grid=0.45, brightness=0.86),
}


@checked
def machine_picture(
    machine: Machine,
    size: tuple[int, int] = (1600, 1200),
    view: str | Sequence[float] = "iso",
    *,
    theme: Theme = "light",
    transparent: bool = False,
    hidden: Collection[str] = HIDDEN_BY_DEFAULT,
) -> Picture:
    """Draw a machine at its pose as a PNG.

    Args:
        machine: the machine at the pose to draw.
        size: width and height, pixels.
        view: "iso", "front", "side" or "top", or the direction from the machine to the camera, base axes.
        theme: the theme of the page, "light" or "dark".
        transparent: whether the background consists of shadow and grid alone.
        hidden: layers of the scene to leave out.

    Raises:
        InputError: an unknown view, theme or layer, a size out of range, or a pose that cannot be drawn.
    """
    return picture(scene_of(machine), size, view, theme=theme, transparent=transparent, hidden=hidden)


def picture(
    scene: Scene,
    size: tuple[int, int] = (1600, 1200),
    view: str | Sequence[float] = "iso",
    *,
    theme: Theme = "light",
    transparent: bool = False,
    hidden: Collection[str] = HIDDEN_BY_DEFAULT,
) -> Picture:
    """Draw a scene as a PNG, with the arguments of `machine_picture`.

    Raises:
        InputError: as there, or nothing is left to draw.
    """
    _check_size(size)
    paper = PAPERS[choice(theme, PAPERS, "theme")]
    scene = _without_layers(scene, as_list(hidden))
    opaque_solids = [solid for solid in scene.solids if LOOKS[solid.material].opacity == 1.0]
    bodies = _bodies_of(scene.solids, opaque_solids)
    camera = camera_on(np.concatenate([body.points for body in bodies]), _direction(view), *size)
    hits = [hits_of(body, camera, SAMPLES_PER_SIDE) for body in bodies]
    foot = np.array([*scene.centre.components()[:2], scene.floor], dtype=float)
    ground = Ground(foot, scene.size, min(LARGEST_GROUND_MAP, max(size) // 2))
    casters = Triangles([solid for solid in opaque_solids if solid.layer not in UNSHADOWED])
    *lights, on_ground = _lights(hits, ground, casters, max(size))
    machine = _solids_seen(hits, lights, camera, paper.brightness)
    image = Image.fromarray(_pixels(machine, *veil_over(ground, on_ground, camera), paper, transparent))
    _draw_labels(image, scene.labels, camera)
    stream = io.BytesIO()
    (image if transparent else image.convert("RGB")).save(stream, "PNG")
    return Picture(stream.getvalue())


def _without_layers(scene: Scene, hidden: Collection[str]) -> Scene:
    """Return a scene without some layers.

    Raises:
        InputError: one of them is unknown, or nothing is left to draw.
    """
    for layer in hidden:
        choice(layer, LAYERS, "hidden")
    solids = tuple(solid for solid in scene.solids if solid.layer not in hidden)
    if not solids:
        raise InputError(f"hidden leaves nothing to draw; hide fewer of {', '.join(LAYERS)}.")
    return replace(scene, solids=solids, labels=tuple(label for label in scene.labels if label.layer not in hidden))


def _bodies_of(solids: Sequence[Solid], opaque: Sequence[Solid]) -> list[Triangles]:
    """Return the opaque solids as one body, which hides others, then those of each translucent material as one."""
    translucent = [[s for s in solids if s.material == m] for m, look in LOOKS.items() if look.opacity < 1.0]
    return [Triangles(opaque), *(Triangles(group) for group in translucent if group)]


def _check_size(size: tuple[int, int]) -> None:
    if not all(SMALLEST <= side <= LARGEST for side in size):
        raise InputError(f"size is {shorten(size)}; give width and height, each {SMALLEST} to {LARGEST} pixels.")


def _direction(view: str | Sequence[float]) -> Sequence[float]:
    if isinstance(view, str):
        return VIEWPOINTS[choice(view, VIEWPOINTS, "view")]
    if len(view) != 3 or not all(map(math.isfinite, view)) or not any(view):
        raise InputError(
            f"view is {shorten(view)}; give {', '.join(VIEWPOINTS)}, or a direction: three numbers, not all 0."
        )
    return view


def _lights(hits: Sequence[Hits], ground: Ground, casters: Triangles, detail: int) -> list[Light]:
    """Return the light on the samples of each body and on the ground: together, so that lamps are set up once."""
    ends = np.cumsum([len(body.points) for body in hits])
    points = np.concatenate([*(body.points for body in hits), ground.points])
    up = np.broadcast_to((0.0, 0.0, 1.0), (len(points) - ends[-1], 3))
    light = light_on(points, np.concatenate([*(body.normals for body in hits), up]), casters, detail)
    parts = [np.split(values, ends) for values in (light.sun, light.sky, light.openness)]
    return [Light(*part) for part in zip(*parts, strict=True)]


def _solids_seen(hits: Sequence[Hits], lights: Sequence[Light], camera: Camera, brightness: float) -> Float32s:
    """Return the solids as the camera sees them [height x width x 4]: sRGB from 0 to 1 times opacity, and opacity.

    The opaque body comes first; translucent ones are laid over it where nothing opaque hides them.
    """
    opacities = np.array([[look.opacity] for look in LOOKS.values()], dtype=np.float32)
    canvas = np.zeros((camera.height * camera.width * SAMPLES_PER_SIDE**2, 4), dtype=np.float32)
    for body, light in zip(hits, lights, strict=True):
        color = srgb_of(np.minimum(brightness * shaded_colors(body.look, body.normals, body.to_eye, light), 1.0))
        opacity = opacities[body.look]
        in_front = body.nearness[body.pixel] >= hits[0].nearness[body.pixel]
        pixel, sample = body.pixel[in_front], body.sample[in_front]
        canvas[pixel] *= 1.0 - opacity[sample]
        canvas[pixel] += np.concatenate([color, np.ones_like(opacity)], axis=1)[sample] * opacity[sample]
    finer = canvas.reshape(camera.height, SAMPLES_PER_SIDE, camera.width, SAMPLES_PER_SIDE, 4)
    summed = np.add.reduce([finer[:, y, :, x] for y in range(SAMPLES_PER_SIDE) for x in range(SAMPLES_PER_SIDE)])
    return summed / np.float32(SAMPLES_PER_SIDE**2)


def _pixels(machine: Float32s, shadow: Float32s, ink: Float32s, paper: Paper, transparent: bool) -> NDArray[np.uint8]:
    """Return the machine over the grid, over the shadow, over the page [height x width x 4]."""
    shadow, ink = paper.shadow * shadow[..., None], paper.grid * ink[..., None]
    under = np.zeros(3, np.float32) if transparent else np.array(paper.color, np.float32)
    color = under * (1.0 - shadow) * (1.0 - ink) + np.array(paper.ink, np.float32) * ink
    alpha = shadow * (1.0 - ink) + ink if transparent else np.ones_like(shadow)
    background_share = 1.0 - machine[..., 3:]
    color, alpha = machine[..., :3] + background_share * color, machine[..., 3:] + background_share * alpha
    color = color / np.maximum(alpha, 1.0 / 255.0)
    shares = np.clip(np.concatenate([color, alpha], axis=2), 0.0, 1.0)
    return np.round(255.0 * shares).astype(np.uint8)


def _draw_labels(image: Image.Image, labels: Sequence[Label], camera: Camera) -> None:
    """Write numbers of legs in white discs, and letters of frames on a halo."""
    if not labels:
        return
    size = max(SMALLEST_LETTERS, round(LETTERS * min(image.size)))
    pen, font = ImageDraw.Draw(image, "RGBA"), ImageFont.truetype(str(FONT), size)
    places, _ = camera.project(np.array([label.point.components() for label in labels], dtype=float))
    for label, (x, y) in zip(labels, places.tolist(), strict=True):
        if label.layer == "labels":
            radius = DISC_RADIUS * size
            half = max(0.5 * pen.textlength(label.text, font) + DISC_MARGIN * size, radius)
            box, rim = (x - half, y - radius, x + half, y + radius), max(1, size // LETTERS_PER_RIM)
            pen.rounded_rectangle(box, radius, fill=DISC, outline=RIM, width=rim)
            pen.text((x, y), label.text, INK, font, anchor="mm")
        else:
            halo = max(1, size // LETTERS_PER_HALO)
            pen.text((x, y), label.text, INK, font, anchor="mm", stroke_width=halo, stroke_fill=DISC)
