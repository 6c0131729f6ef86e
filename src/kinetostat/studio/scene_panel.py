"""The middle of the page: the machine with its overlays, the status of the pose, and the handles that pull it.

`answers` computes the solids that are drawn, and `pulling` the numbers that follow a pull; here both are only placed on
the page and passed on.
"""

from collections.abc import Callable
from typing import Any

from nicegui import ui
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from kinetostat.algebra.vector import Displacement
from kinetostat.display import with_minus_signs
from kinetostat.equilibrium.solving import Rest
from kinetostat.equilibrium.state import state_of
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.spec.errors import InputError
from kinetostat.studio.answers import Picture, Report
from kinetostat.studio.controls import FACTOR_STEPS, factor_at, factor_position, factor_text, read_factor
from kinetostat.studio.elements import THROTTLE, MachineView, QuantityRow, icon_button, refuse
from kinetostat.studio.lanes import Lane, as_sentence
from kinetostat.studio.pulling import PLATFORM, Pull, goal_of, numbers_after_pull, point_goal
from kinetostat.studio.session import Session, file_stem
from kinetostat.units import motion_unit

LAYERS = {
    "ellipsoids": "compliance ellipsoids",
    "directions": "most compliant directions",
    "deflection": "deflected shape",
    "springs": "virtual springs",
    "frames": "frames",
    "labels": "leg numbers",
    "handles": "handles to pull",
}
"""Layers of the picture that can be hidden, and their names on the page."""
GHOST = "Keep the present machine as a ghost behind later changes; click again to remove it"
EXAGGERATION = "factor by which the deflected shape is drawn larger than it is: a number, or auto"
UNDER_LOAD = "the machine at rest under its weight, preloads and load; gravity is set in the panel Load"
"""Tooltips of the ghost, of the exaggeration and of the switch for loads."""
COMPUTING = "The next pose is being computed ..."
LOOKING = "The legs cannot close at this pose on the branch of the home pose; the nearest pose is being looked for ..."
KEPT = "The picture and the figures still show the last good pose."
PICTURED = "The picture shows this pose; the figures still show the last good one."
UNLOADED = "The picture shows the machine without its loads, and the figures still show the last state of rest."
"""Sentences about the picture and the figures while the pose has no answer."""
VIEWS = {"iso": "view from the corner", "front": "front view", "side": "side view", "top": "view from above"}
"""Views of the camera and their tooltips."""


class ScenePanel:
    """The picture and figures of the machine; at a pose without an answer, they stay and the reason is shown."""

    def __init__(
        self, set_loaded: Callable[[bool], None], exaggerate: Callable[[float | None], None], name: Callable[[], str]
    ) -> None:
        """Build the picture with its tools, the line about the pose, and the figures.

        Args:
            set_loaded: shows the machine at rest under its loads, or without them.
            exaggerate: draws the deflected shape with another factor; None to choose one.
            name: gives the name of the machine, for saved pictures.
        """
        self._set_loaded, self._exaggerate, self._name = set_loaded, exaggerate, name
        self._shown_scene: dict[str, Any] | None = None
        self._has_ghost = False
        self._pictured = False  # the picture shows the present pose, which may have no answer
        self._hidden: set[str] = set()
        with ui.element("div").classes("stage"):
            self._stage()
        self.figures = ui.html("", sanitize=False).classes("headline").mark("headline")

    def _stage(self) -> None:
        self.view = MachineView("the machine in three dimensions; drag, or arrow keys, to turn it").mark("machine")
        with ui.element("div").classes("scene-tools"):
            self.loaded = ui.switch("under load", on_change=lambda event: self._set_loaded(bool(event.value)))
            self.loaded.props("dense").tooltip(UNDER_LOAD).mark("loaded")
            with ui.element("div").classes("scene-layers") as layer_list:
                self.layers = {layer: self._layer_box(layer, text) for layer, text in LAYERS.items()}
        with ui.element("div").classes("scene-views") as self.tools:
            for view, text in VIEWS.items():
                button = ui.button(view, on_click=lambda view=view: self.view.run_method("look", view))
                button.props("flat dense no-caps").tooltip(text).mark(f"view-{view}")
            # On a narrow page the list would lie on the machine: there this button opens it.
            layers = icon_button("layers", "Layers of the picture", lambda: layer_list.classes(toggle="open"), "layers")
            layers.classes("layers-button")
            self.ghost = icon_button("filter_none", GHOST, self._keep_ghost, "ghost")
            icon_button("photo_camera", "Save the picture as PNG", self._save, "picture")
        with ui.element("div").classes("scene-key"):
            self.key = ui.html("", sanitize=False).mark("scene-key")
            self.scale = QuantityRow("deflection ×", EXAGGERATION, FACTOR_STEPS, slides=True).mark("exaggeration")
            self.scale.classes("scene-scale").set_visibility(False)
        self.scale.on("slide", lambda event: self._exaggerate(factor_at(int(event.args))), throttle=THROTTLE)
        self.scale.on("write", self._take_factor)
        with ui.element("div").classes("pose-line").props('role="status" aria-live="polite"') as self.line:
            self.status = ui.label("").classes("pose-status").mark("status")
            self.message = ui.label("").classes("pose-message").mark("message")

    def _layer_box(self, layer: str, text: str) -> ui.checkbox:
        box = ui.checkbox(text, value=True, on_change=lambda event: self._show_layer(layer, bool(event.value)))
        return box.props("dense").mark(f"layer-{layer}")

    def _show_layer(self, layer: str, is_shown: bool) -> None:
        self._hidden = self._hidden - {layer} if is_shown else self._hidden | {layer}
        self.view.hide(sorted(self._hidden))

    def _take_factor(self, event: GenericEventArguments) -> None:
        try:
            factor = read_factor(str(event.args))
        except InputError as error:
            self.scale.complain(str(error))
        else:
            self._exaggerate(factor)

    def _keep_ghost(self) -> None:
        """Keep the machine as it is as a translucent shape behind those to come, or remove that shape."""
        solids = [] if self._has_ghost or self._shown_scene is None else self._shown_scene["solids"]
        self._has_ghost = bool(solids)
        self.ghost.classes(toggle="pressed").props(f'aria-pressed="{str(self._has_ghost).lower()}"')
        self.view.run_method("ghost", [{**s, "material": "removed"} for s in solids if s["layer"] == "machine"])

    def _save(self) -> None:
        self.view.run_method("save", file_stem(self._name()))

    def draw(self, picture: Picture) -> None:
        """Show a pose, if there is something to draw."""
        self._pictured = picture.scene is not None
        if picture.scene is not None:
            self._shown_scene = picture.scene
            self.view.show(picture.scene)

    def explain(self, report: Report, automatic: bool) -> None:
        """Show the overlays and figures of a pose; without an answer, show the reason and keep the last figures.

        Args:
            report: the report of the pose.
            automatic: whether the page chose the factor of the deflected shape.
        """
        status, message = _verdict(report)
        is_sound = report.loaded is None or report.loaded.rest is Rest.OK
        is_placed = report.analysis.status is Status.OK
        self._show_verdict(report.answered, status, message, is_sound, self._kept_sentence(is_placed))
        if not report.answered:
            if is_placed or self._pictured:
                self.view.run_method("overlay", [], [])
            return
        self.view.run_method("overlay", report.solids, [])
        self.key.set_content(scene_key(report))
        self.scale.set_visibility(report.exaggeration is not None)
        if report.exaggeration is not None:
            self.scale.show_value(factor_text(report.exaggeration, automatic), factor_position(report.exaggeration))
        self.figures.set_content(headline(report))

    def _kept_sentence(self, is_placed: bool) -> str:
        """Return the sentence on what the page still shows of a pose without an answer."""
        if is_placed:
            return UNLOADED
        return PICTURED if self._pictured else KEPT

    def wait(self) -> None:
        """Say that a pose takes its time; its picture, or the reason why it has none, follows."""
        self.message.set_text(COMPUTING)

    def look_for_nearest(self) -> None:
        """Say at once that a pose is out of reach, while the nearest one is being looked for; `explain` names it."""
        self._show_verdict(False, Status.OUT_OF_REACH.phrase, LOOKING)

    def fail(self, error: Exception) -> None:
        """Say that the machine could not be drawn or analysed because of a mistake of the program."""
        self._show_verdict(False, "no answer", as_sentence(error))

    def _show_verdict(
        self, answered: bool, status: str, message: str, is_sound: bool = True, kept_sentence: str = KEPT
    ) -> None:
        """Show the status of the pose and a message in the line below the picture.

        Args:
            answered: whether the pose has an answer.
            status: a word or two.
            message: sentences.
            is_sound: whether the answer is free of faults; otherwise the line is drawn as a refusal.
            kept_sentence: what the page still shows if there is no answer.
        """
        self.line.classes(replace="pose-line" if answered and is_sound else "pose-line refused")
        self.status.set_text(status)
        self.message.set_text(message if answered else f"{message} {kept_sentence}")


def _verdict(report: Report) -> tuple[str, str]:
    """Return the status of a pose in a word or two, and the message about it."""
    if report.refused:
        return "no answer", report.refused
    if report.loaded is not None:
        return f"under load: {report.loaded.rest.word}", report.loaded.message
    return report.analysis.status.phrase, report.analysis.message


def scene_key(report: Report) -> str:
    """Return the key of the ellipsoids as HTML: the greatest compliance of each; none are drawn of a loaded machine."""
    if report.loaded is not None:
        return ""
    indices = report.analysis.indices
    units = {"translation": "m/N", "rotation": "rad/(N·m)"}
    display = report.analysis.machine.display
    lines = [
        f'<li class="key-{name}">{name}: at most {display.show(block.compliances[-1], units[name])}</li>'
        for name, block in ((indices and indices.principal_compliances) or {}).items()
    ]
    return f"<ul>{''.join(lines)}</ul>"


def headline(report: Report) -> str:
    """Return the diagonal of C as HTML: the motion along or about each axis under a unit load along or about it.

    Of a loaded machine, the displacement of its tool point.
    """
    tiles, display = [], report.analysis.machine.display
    if report.loaded is not None:
        for name, motion in zip(report.loaded.components, report.loaded.displacement, strict=True):
            value, _, unit = display.show_deflection(motion, motion_unit(name.startswith("r"))).partition(" ")
            tiles.append(_tile(f"u {name}", value, unit))
        return f"<dl>{''.join(tiles)}</dl>"
    for name, compliance in zip(report.analysis.components, report.analysis.compliance_diagonal.tolist(), strict=True):
        value, _, unit = display.show(compliance, QUANTITIES[f"compliance_{name}"].unit).partition(" ")
        tiles.append(_tile(f"C {name}", value, unit))
    return f"<dl>{''.join(tiles)}</dl>"


def _tile(name: str, value: str, unit: str) -> str:
    return f"<div><dt>{name}</dt><dd>{with_minus_signs(value)} <small>{unit or '&nbsp;'}</small></dd></div>"


class Handles:
    """Follows the handles of a view while they are pulled; of the positions of the pointer, only the latest counts."""

    def __init__(self, session: Session, view: Element, on_change: Callable[[], None]) -> None:
        """Listen.

        Args:
            session: the session whose machine is pulled.
            view: the view of the machine, which sends `pull` and `settle`.
            on_change: called after every change of the machine.
        """
        self._session, self._on_change = session, on_change
        self._lane = Lane(numbers_after_pull, self._follow)
        self._pull_number: object = None
        self._home: Displacement | None = None  # the place of the platform when this pull began
        self._has_ended = False  # the handle was let go, while a position may still be computed
        view.on("pull", self._ask, throttle=THROTTLE)
        view.on("settle", self._settle)

    def close(self) -> None:
        """Stop following pulls, because the page is gone."""
        self._lane.close()

    def _ask(self, event: GenericEventArguments) -> None:
        """Follow a position of the pointer, in m or rad from where the pull began, or as a point in m for a joint."""
        kind, leg, axis, goal, number = (event.args[key] for key in ("of", "leg", "axis", "goal", "start"))
        machine = self._session.machine
        if self._home is None or number != self._pull_number:
            self._pull_number, self._home = number, state_of(machine).configuration.platform
        self._has_ended = False
        target = goal_of(self._home, axis, float(goal)) if kind == PLATFORM else point_goal([float(c) for c in goal])
        self._lane.ask(Pull(machine, kind, leg, axis, target))

    def _follow(self, _pull: Pull, numbers: dict[str, float]) -> None:
        if numbers:
            try:
                self._session.move(numbers)
            except InputError:
                return  # a pull beyond what the file allows, such as a negative radius, leads no further
            self._on_change()
        if self._has_ended:
            self._end()

    def _settle(self, _event: GenericEventArguments) -> None:
        self._has_ended = True
        if not self._lane.busy:
            self._end()

    def _end(self) -> None:
        self._has_ended, self._home = False, None
        try:
            self._session.settle()
        except InputError as error:
            refuse(str(error))
        self._on_change()
