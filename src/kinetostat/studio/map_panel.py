"""The map: one quantity over two coordinates of the machine; a click goes there."""

import time
from collections.abc import Callable

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments

from kinetostat.engine.points import Array
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.spec.errors import InputError
from kinetostat.studio.answers import SIDE, Ends, MapWish, compliance_map, finite, map_quantities
from kinetostat.studio.controls import Control
from kinetostat.studio.elements import MapView
from kinetostat.studio.lanes import Lane
from kinetostat.studio.session import Session
from kinetostat.studio.wording import full_label
from kinetostat.units import KINDS
from kinetostat.views.display import Scale, coordinate_scale

THROTTLE = 0.03
"""Seconds between two places that a browser sends while the map is dragged over."""


class MapPanel:
    """Choices of two coordinates and a quantity, the map, and how long it took."""

    def __init__(self, session: Session, on_change: Callable[[], None], on_problem: Callable[[str], None]) -> None:
        """A map for a session.

        Args:
            session: whose machine it shows and moves.
            on_change: called after the map has moved the machine.
            on_problem: told why it could not.
        """
        self._session, self._on_change, self._on_problem = session, on_change, on_problem
        self._lane = Lane(compliance_map, self._deliver)
        with ui.row().classes("panel-tools"):
            self.quantity = ui.select({}, label="map of", on_change=self._chosen).mark("map-quantity")
            self.across = ui.select({}, label="across", on_change=self._chosen).mark("map-across")
            self.up = ui.select({}, label="up", on_change=self._chosen).mark("map-up")
            for choice in (self.quantity, self.across, self.up):
                choice.props("dense options-dense outlined").classes("field")
        self.view = MapView("map of the chosen quantity; click, drag or arrow keys move the machine").mark("map")
        self.view.on("pick", self._pick, throttle=THROTTLE)
        self.view.on("settle", self._settle)
        self.time = ui.label("").classes("server-time").mark("map-time")
        self._asking = False
        self.fill()

    def fill(self) -> None:
        """Offer what the machine has that has just been loaded; nothing is computed yet."""
        self._asking = False
        machine = self._session.machine
        fields = {control.path: full_label(control.parameter) for control in self._mappable()}
        first, second, *_ = fields
        quantities = map_quantities(machine)
        kept = self.quantity.value if self.quantity.value in quantities else "compliance_x"
        self.quantity.set_options(quantities, value=kept)
        self.across.set_options(fields, value=first)
        self.up.set_options(fields, value=second)
        self._asking = True

    def _mappable(self) -> list[Control]:
        """Controls over whose range a map can be drawn, the pose first."""
        found = [c for c in self._session.controls.values() if c.slides and not c.logarithmic and c.panel != "Load"]
        return sorted(found, key=lambda control: control.panel != "Pose")

    def refresh(self, since: float | None = None) -> None:
        """Compute the map for the present machine; `since` is when the designer asked, s (now, if not given)."""
        across, up = self._ends()
        if across.path == up.path:
            self.time.set_text("choose two different coordinates")
            return
        asked = time.perf_counter() if since is None else since
        self._lane.ask(MapWish(self._session.machine, across, up, asked))

    def close(self) -> None:
        """Deliver nothing any more."""
        self._lane.close()

    def _ends(self) -> tuple[Ends, Ends]:
        found = [self._session.controls[str(choice.value)] for choice in (self.across, self.up)]
        return Ends(found[0].path, found[0].low, found[0].high), Ends(found[1].path, found[1].low, found[1].high)

    def _scale(self, path: str) -> tuple[Control, Scale]:
        control = self._session.controls[path]
        kind = KINDS[control.parameter.quantity.kind]
        return control, coordinate_scale(kind.name, kind.unit, np.array([control.low, control.high]))

    def _deliver(self, wish: MapWish, found: dict[str, Array]) -> None:
        quantity = str(self.quantity.value)
        if (wish.across, wish.up) != self._ends() or quantity not in found:
            return
        (across, x), (up, y) = self._scale(wish.across.path), self._scale(wish.up.path)
        self.view.run_method(
            "show",
            {
                "nx": SIDE,
                "ny": SIDE,
                "values": finite(found[quantity]),
                "unit": QUANTITIES[quantity].unit,
                "x": {"low": across.low * x.factor, "high": across.high * x.factor, "label": x.label(across.label)},
                "y": {"low": up.low * y.factor, "high": up.high * y.factor, "label": y.label(up.label)},
                "here": [self._session.value(across.path) * x.factor, self._session.value(up.path) * y.factor],
            },
        )
        took = 1e3 * (time.perf_counter() - wish.since)
        self.time.set_text(f"{SIDE} × {SIDE} poses in {took:.0f} ms, {QUANTITIES[quantity].unit}")

    def _chosen(self) -> None:
        if self._asking:
            self.refresh()

    def _pick(self, event: GenericEventArguments) -> None:
        (across, x), (up, y) = self._scale(str(self.across.value)), self._scale(str(self.up.value))
        try:
            where = {across.path: float(event.args["x"]) / x.factor, up.path: float(event.args["y"]) / y.factor}
            self._session.move(where)
        except InputError as error:
            self._on_problem(str(error))
            return
        self._on_change()

    def _settle(self, _event: GenericEventArguments) -> None:
        try:
            self._session.settle()
        except InputError as error:
            self._on_problem(str(error))
        self._on_change()
