"""The machine as pictures of a report, as it stands and as it gives under load, and drawings in one scale."""

from dataclasses import dataclass, replace
from typing import Any

from matplotlib.figure import Figure as Drawing

from kinetostat.kinetostatics.response import respond
from kinetostat.studies.analysis import Analysis
from kinetostat.views.figures import as_svg
from kinetostat.views.picture import picture
from kinetostat.views.report.content import Figure
from kinetostat.views.scene.machine_scene import machine_scene, proportions_of
from kinetostat.views.scene.overlaid import overlays_of
from kinetostat.views.scene.solids import Scene, Solid, as_data, solid_data

SIZE = (1000, 700)
"""Pixels of a picture of the machine: 190 to an inch on A4."""
SHARE = 0.8
"""Of the width of the text that it takes."""
FULL = 7.4
"""Inches of a drawing that takes the whole width of the text: its letters have then the size of captions."""
LOADED = ("load", "deflection")
"""Layers of a loaded machine."""


@dataclass(frozen=True)
class Shown:
    """A machine at its pose as solids.

    Attributes:
        scene: the machine.
        overlays: compliance, load and deflected shape.
        factor: by which deflections are exaggerated; None without a load.
    """

    scene: Scene
    overlays: tuple[Solid, ...]
    factor: float | None

    @property
    def data(self) -> dict[str, Any]:
        """All of it for the renderer of a page."""
        return {
            "scene": {**as_data(self.scene), "fit": True},
            "overlays": [solid_data(solid) for solid in self.overlays],
        }

    def portrait(self) -> bytes:
        """A PNG of the machine."""
        return picture(self.scene, SIZE)

    def deflected(self) -> bytes:
        """A PNG of the loaded machine with its deflected shape."""
        loaded = (solid for solid in self.overlays if solid.layer in LOADED)
        return picture(replace(self.scene, solids=(*self.scene.solids, *loaded)), SIZE)


def shown(found: Analysis) -> Shown:
    """The machine of an analysis, with all that can be shown of it."""
    configuration = respond(found.machine).configuration
    sizes = proportions_of(found.machine, configuration)
    overlays, factor = overlays_of(found, sizes)
    return Shown(machine_scene(found.machine, configuration, sizes), tuple(overlays), factor)


def drawn(drawing: Drawing, caption: str) -> Figure:
    """A drawing as a figure, in the same scale as all others."""
    return Figure(caption, as_svg(drawing), min(1.0, drawing.get_figwidth() / FULL))
