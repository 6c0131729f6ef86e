"""The middle of the page: the machine, what is drawn over it, whether the pose has an answer, and its six figures."""

from collections.abc import Callable

from nicegui import ui
from nicegui.events import GenericEventArguments

from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.spec.errors import InputError
from kinetostat.studio.answers import Picture, Report
from kinetostat.studio.controls import FACTOR_STEPS, factor_at, factor_position, factor_text, read_factor
from kinetostat.studio.elements import MachineView, QuantityRow
from kinetostat.studio.wording import engineering

LAYERS = {
    "ellipsoids": "compliance ellipsoids",
    "directions": "softest directions",
    "deflection": "deflected shape",
    "springs": "virtual springs",
    "frames": "frames",
    "labels": "leg numbers",
}
"""What may be hidden, by its name in scenes."""
SCALE = "how many times larger than it is the deflected shape is drawn; a number, or auto"
VIEWS = {"iso": "view from the corner", "front": "front view", "side": "side view", "top": "view from above"}
THROTTLE = 0.03
"""Seconds between two positions of a slider that a browser sends."""


class ScenePanel:
    """The picture keeps the last pose that could be drawn; a pose without answer is explained below it."""

    def __init__(self, exaggerate: Callable[[float | None], None]) -> None:
        """The view with its tools, the line about the pose, and the figures.

        Args:
            exaggerate: draws the deflected shape with another factor; None to choose one.
        """
        self._exaggerate = exaggerate
        self._hidden: set[str] = set()
        with ui.element("div").classes("stage"):
            self._stage()
        self.figures = ui.html("", sanitize=False).classes("headline").mark("headline")

    def _stage(self) -> None:
        self.view = MachineView("the machine in three dimensions; drag, or arrow keys, to turn it").mark("machine")
        with ui.element("div").classes("scene-tools"):
            self.layers = {layer: self._layer(layer, text) for layer, text in LAYERS.items()}
        with ui.element("div").classes("scene-views"):
            for view, text in VIEWS.items():
                button = ui.button(view, on_click=lambda view=view: self.view.run_method("look", view))
                button.props("flat dense no-caps").tooltip(text).mark(f"view-{view}")
        with ui.element("div").classes("scene-key"):
            self.key = ui.html("", sanitize=False).mark("scene-key")
            self.scale = QuantityRow("deflection ×", SCALE, FACTOR_STEPS, slides=True).mark("exaggeration")
            self.scale.classes("scene-scale").set_visibility(False)
        self.scale.on("slide", lambda event: self._exaggerate(factor_at(int(event.args))), throttle=THROTTLE)
        self.scale.on("write", self._written)
        with ui.element("div").classes("pose-line").props('role="status" aria-live="polite"') as self.line:
            self.status = ui.label("").classes("pose-status").mark("status")
            self.message = ui.label("").classes("pose-message").mark("message")

    def _layer(self, layer: str, text: str) -> ui.checkbox:
        box = ui.checkbox(text, value=True, on_change=lambda event: self._toggle(layer, bool(event.value)))
        return box.props("dense").mark(f"layer-{layer}")

    def _toggle(self, layer: str, on: bool) -> None:
        self._hidden = self._hidden - {layer} if on else self._hidden | {layer}
        self.view.hide(sorted(self._hidden))

    def _written(self, event: GenericEventArguments) -> None:
        try:
            factor = read_factor(str(event.args))
        except InputError as error:
            self.scale.complain(str(error))
        else:
            self._exaggerate(factor)

    def draw(self, picture: Picture) -> None:
        """Show a pose, if there is something to draw."""
        if picture.scene is not None:
            self.view.run_method("show", picture.scene)

    def explain(self, report: Report, own: bool) -> None:
        """Show the overlays and figures of a pose, or say why there are none and keep the last ones.

        Args:
            report: of the pose.
            own: whether the factor of the deflected shape was chosen here.
        """
        found = report.analysis
        answered = found.status is Status.OK
        self.line.classes(replace="pose-line" if answered else "pose-line refused")
        self.status.set_text(found.status.word.replace("_", " "))
        kept = "" if answered else " The picture and the figures are those of the last good pose."
        self.message.set_text(found.message + kept)
        if not answered:
            return
        self.view.run_method("overlay", report.solids, [])
        self.key.set_content(scene_key(report))
        self.scale.set_visibility(report.exaggeration is not None)
        if report.exaggeration is not None:
            self.scale.put(factor_text(report.exaggeration, own), factor_position(report.exaggeration))
        self.figures.set_content(headline(report))


def scene_key(report: Report) -> str:
    """What the overlays are, with their scales."""
    found, parts = report.analysis, []
    units = {"translation": "m/N", "rotation": "rad/(N·m)"}
    principal = found.indices.principal_compliances if found.indices else None
    for block, one in (principal or {}).items():
        parts.append(f'<li class="key-{block}">{block}: softest {engineering(one.compliances[-1], units[block])}</li>')
    return f"<ul>{''.join(parts)}</ul>"


def headline(report: Report) -> str:
    """The diagonal of C: what a unit load along or about each axis moves along or about it."""
    tiles = []
    for name, soft in zip(report.analysis.components, report.analysis.compliance_diagonal, strict=True):
        value, _, unit = engineering(soft, QUANTITIES[f"compliance_{name}"].unit).partition(" ")
        tiles.append(f"<div><dt>C {name}</dt><dd>{value} <small>{unit or '&nbsp;'}</small></dd></div>")
    return f"<dl>{''.join(tiles)}</dl>"
