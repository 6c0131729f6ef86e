"""The machine in a report: still pictures, the scene that turns under the mouse, and drawings as figures.

A page shows the scene with the renderer of `views.scene.browser`, which is packed into the page, so that it needs no
server; a PDF has the still pictures only.
"""

import gzip
import json
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure as Drawing

from kinetostat.frozen import dataclass
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.vibration import Vibration
from kinetostat.views.figures import as_svg
from kinetostat.views.picture import picture
from kinetostat.views.report.content import Figure
from kinetostat.views.scene import browser
from kinetostat.views.scene.anatomy import proportions_of
from kinetostat.views.scene.machine_scene import machine_scene
from kinetostat.views.scene.overlays import overlays_of, swing_data
from kinetostat.views.scene.solids import Scene, Solid, as_data, looks_data, solid_data

PICTURE_SIZE = (800, 560)
"""Pixels of a picture of the machine: 200 to an inch of an A4 page; they take a quarter of the time of a report."""
PICTURE_WIDTH = 0.6
"""Width of that picture as a share of the width of the text: its caption and the text around it stay on the page."""
FULL_WIDTH = 7.4
"""Width of a drawing that takes the whole width of the text, inches: its letters then have the size of captions."""
LOADED_LAYERS = ("load", "deflection")
"""Layers of a loaded machine."""
SCRIPT = Path(__file__).with_name("live.js")
SWINGING_MODES = 6
"""Modes whose shapes swing on a page: the lowest ones, since each adds its solids to the file."""
NO_RENDERER = " To get a machine that you can turn with the mouse, run this before you make the report: {}."
"""Sentence of a page that cannot show the scene, because the renderer's libraries are not installed."""


@dataclass(frozen=True)
class MachinePictures:
    """A machine at its pose as solids.

    Attributes:
        scene: the machine.
        overlays: compliance ellipsoids, load and deflected shape.
        factor: the factor by which deflections are exaggerated; None without a load.
        swings: name of each mode of vibration, and its solids at both ends of their swing as plain data.
    """

    scene: Scene
    overlays: tuple[Solid, ...]
    factor: float | None
    swings: tuple[tuple[str, list[dict[str, Any]]], ...] = ()

    @property
    def data(self) -> dict[str, Any]:
        """Scene and overlays as plain data for the renderer of a page."""
        return {
            "scene": {**as_data(self.scene), "fit": True},
            "overlays": [solid_data(solid) for solid in self.overlays],
            "swings": [{"name": name, "solids": solids} for name, solids in self.swings],
        }

    def portrait(self) -> bytes:
        """Return a PNG of the machine."""
        return picture(self.scene, PICTURE_SIZE)

    def deflected_picture(self) -> bytes:
        """Return a PNG of the loaded machine with its deflected shape."""
        loaded = (solid for solid in self.overlays if solid.layer in LOADED_LAYERS)
        return picture(replace(self.scene, solids=(*self.scene.solids, *loaded)), PICTURE_SIZE)


def machine_pictures(analysis: Analysis, vibration: Vibration | None = None) -> MachinePictures:
    """Build the solids of an analysed machine with its overlays, and the swings of its modes where these are known."""
    machine = analysis.machine
    configuration = analysis.state.configuration
    sizes = proportions_of(machine, configuration)
    overlays, factor = overlays_of(analysis, sizes)
    swings = [
        (f"mode {number}, {machine.display.show(mode.frequency, 'Hz')}", solids)
        for number, mode in enumerate(vibration.modes[:SWINGING_MODES] if vibration else (), 1)
        if mode.shape is not None and (solids := swing_data(machine, configuration, sizes, mode.shape))
    ]
    return MachinePictures(machine_scene(machine, configuration, sizes), tuple(overlays), factor, tuple(swings))


def figure_of(drawing: Drawing, caption: str) -> Figure:
    """Make a figure of a drawing, in the same scale as all others."""
    return Figure(caption, as_svg(drawing), min(1.0, drawing.get_figwidth() / FULL_WIDTH))


@cache
def renderer() -> dict[str, str] | None:
    """Return the source of the renderer's modules by name; None where their libraries are not installed."""
    return browser.modules()


def can_be_live() -> bool:
    """Return whether a page can show a scene: the renderer's libraries are installed."""
    return renderer() is not None


def live_html(scene: Mapping[str, Any]) -> str:
    """Elements that unpack the renderer and show a scene in the element with the id "live"; empty without libraries.

    Renderer and scene are compressed together, without a time stamp: the same scene gives the same bytes.
    """
    modules = renderer()
    if modules is None:
        return ""
    data = json.dumps(
        {"modules": modules, "looks": looks_data(), **scene}, ensure_ascii=False, separators=(",", ":")
    ).encode()
    packed = b64encode(gzip.compress(data, 9, mtime=0)).decode()
    script = SCRIPT.read_text("utf-8")
    return f'<script type="text/plain" id="live-data">{packed}</script>\n<script>\n{script}</script>'
