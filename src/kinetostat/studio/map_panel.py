"""The map of one quantity over two numbers of the machine; a click moves the machine there.

The values are computed by `answers.quantity_map`; this panel chooses, shows, and passes clicks to the session.
"""

import math
import time
from collections.abc import Callable

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments

from kinetostat.arrays import Array
from kinetostat.display import Scale
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.spec.errors import InputError, shorten
from kinetostat.studio.answers import Ends, MapRequest, finite, map_quantities, quantity_map
from kinetostat.studio.controls import Control
from kinetostat.studio.elements import THROTTLE, MapView, choice, icon_button, refuse
from kinetostat.studio.lanes import Lane
from kinetostat.studio.session import Session, read_typed
from kinetostat.studio.wording import full_label
from kinetostat.units import KINDS
from kinetostat.views.map_scales import usual_range

UNITS_OF_LENGTH = ("m", "mm")
"""A map whose two axes have the same one of these units is drawn to scale."""
LOADED_PREFIX = "loaded_"
"""Beginning of the names of quantities of the machine under its loads."""
FIRST_QUANTITY = "compliance_x"
"""Quantity of a first map: every machine has it."""
MARGIN_POINTS = 2
"""Points of the map that are kept about the part of a range that can be reached, so that its edge is seen."""
MOSTLY_REACHED = 0.8
"""Share of a range from which on it is left as it is: there is nothing to gain by cutting it."""
NO_MAP = np.full(4, np.nan)
"""Values in the place of a map that is refused: two by two points, all without a value."""
RANGE_HINT = 'range of the {} axis, such as "-5 to 8 cm"; empty for where the machine can be'


class MapPanel:
    """Choices of two coordinates and a quantity, the map, and how long it took."""

    def __init__(self, session: Session, on_change: Callable[[], None]) -> None:
        """Build the panel.

        Args:
            session: the session whose machine it shows and moves.
            on_change: called after the map has moved the machine.
        """
        self._session, self._on_change = session, on_change
        self._lane = Lane(quantity_map, self._deliver)
        with ui.row().classes("panel-tools"):
            self.quantity = choice({}, "map of", self._choose, "map-quantity")
            self.across = choice({}, "horizontal", self._choose_axis, "map-across")
            self.up = choice({}, "vertical", self._choose_axis, "map-up")
            with icon_button("straighten", "Ranges of the axes", self._show_ranges, "map-ranges"):
                self._menu = ui.menu().props("no-parent-event").classes("map-ranges")
        with self._menu:
            self.ranges = [self._range_field(side) for side in ("horizontal", "vertical")]
        self.view = MapView("map of the chosen quantity; click, drag or arrow keys move the machine").mark("map")
        self.view.on("pick", self._pick, throttle=THROTTLE)
        self.view.on("settle", self._settle)
        self.time = ui.label("").classes("server-time").mark("map-time")
        self._is_users_choice = False  # whether a change of a list is the designer's; those of `fill` ask for no map
        self._chosen_ranges: dict[str, tuple[float, float]] = {}  # as they were typed; they count before all others
        self._reached: dict[str, tuple[float, float]] = {}  # ends of a range within which the first map had values
        self._is_first_map = True  # of these axes: its ranges may still be narrowed
        self.fill()

    def fill(self) -> None:
        """Offer the numbers and quantities of a machine that has just been loaded; nothing is computed yet."""
        self._is_users_choice = False
        self._chosen_ranges.clear()
        self._forget_reached()
        fields = {control.path: full_label(control.parameter) for control in self._mappable()}
        first, second, *_ = fields
        self._offer_quantities()
        self.across.set_options(fields, value=first)
        self.up.set_options(fields, value=second)
        self._is_users_choice = True

    def _offer_quantities(self) -> None:
        """Offer the quantities that the machine has now: it may have got a mass, or be shown under its loads."""
        quantities, is_users_choice = map_quantities(self._session.machine), self._is_users_choice
        if self.quantity.options == quantities:
            return
        present = str(self.quantity.value)
        other = present.removeprefix(LOADED_PREFIX) if present.startswith(LOADED_PREFIX) else LOADED_PREFIX + present
        kept = next((name for name in (present, other) if name in quantities), FIRST_QUANTITY)
        self._is_users_choice = False
        self.quantity.set_options(quantities, value=kept)
        self._is_users_choice = is_users_choice

    def _mappable(self) -> list[Control]:
        """List the controls over whose range a map can be drawn, the pose first."""
        every = self._session.controls.values()
        sliding = [control for control in every if control.slides and not control.logarithmic]
        mappable = [control for control in sliding if control.panel not in ("Load", "Mass")]
        return sorted(mappable, key=lambda control: control.panel != "Pose")

    def refresh(self, since: float | None = None) -> None:
        """Request the map of the present machine; `since` is the time of the change behind it, s (default: now)."""
        self._offer_quantities()
        across, up = self._ends()
        if across.path == up.path:
            self.time.set_text("Choose two different axes.")
            return
        start = time.perf_counter() if since is None else since
        self._lane.ask(MapRequest(self._session.machine, str(self.quantity.value), across, up, start))

    def close(self) -> None:
        """Stop computing maps, because the page is gone."""
        self._lane.close()

    def _ends(self) -> tuple[Ends, Ends]:
        across, up = (self._ends_of(str(axis.value)) for axis in (self.across, self.up))
        return across, up

    def _ends_of(self, path: str) -> Ends:
        control = self._session.controls[path]
        present = self._session.value(path)
        low, high = self._reached.get(path, (control.low, control.high))
        if not low <= present <= high:  # the machine has left what could be reached when the map was opened
            low, high = control.low, control.high
        return Ends(path, *self._chosen_ranges.get(path, (low, high)))

    def _forget_reached(self) -> None:
        """Let the next map open on what can be reached: its ranges are narrowed if it is mostly empty."""
        self._reached.clear()
        self._is_first_map = True

    def _narrow(self, request: MapRequest, values: Array) -> bool:
        """Narrow the ranges of axes to where a first map has values, with a margin; return whether any has changed."""
        points = math.isqrt(values.size)
        reached = np.isfinite(values).reshape(points, points)
        if not reached.any():
            return False
        # The second axis runs fastest, so that rows belong to the first.
        for ends, has_values in ((request.across, reached.any(axis=1)), (request.up, reached.any(axis=0))):
            places = np.flatnonzero(has_values)
            first, last = max(places[0] - MARGIN_POINTS, 0), min(places[-1] + MARGIN_POINTS, points - 1)
            if last - first <= MOSTLY_REACHED * (points - 1) and ends.path not in self._chosen_ranges:
                step = (ends.high - ends.low) / (points - 1)
                self._reached[ends.path] = (ends.low + first * step, ends.low + last * step)
        return bool(self._reached)

    def _scale(self, path: str) -> tuple[Control, Scale]:
        control = self._session.controls[path]
        kind = KINDS[control.parameter.quantity.kind]
        return control, self._session.machine.display.scale(kind.unit)

    def _deliver(self, request: MapRequest, maps: dict[str, Array] | str) -> None:
        """Show the map that was computed, or the reason why there is none, and how long it took."""
        quantity = str(self.quantity.value)
        is_refused = isinstance(maps, str) and request.quantity == quantity
        if (request.across, request.up) != self._ends() or not (is_refused or quantity in maps):
            return  # other axes or another quantity have been chosen meanwhile, and their map is being computed
        values = NO_MAP if isinstance(maps, str) else maps[quantity]
        if self._is_first_map and not isinstance(maps, str):
            self._is_first_map = False
            if self._narrow(request, values):
                self.refresh(request.since)
                return
        self._show_map(request, values, quantity)
        seconds = time.perf_counter() - request.since
        words = f"{1e3 * seconds:.0f} ms" if seconds < 1.0 else f"{seconds:.1f} s"
        points = math.isqrt(values.size)
        self.time.set_text(maps if isinstance(maps, str) else f"{points} × {points} poses in {words}")

    def _show_map(self, request: MapRequest, values: Array, quantity: str) -> None:
        """Show values of a quantity over the axes of a request, in the units of the machine's file."""
        (across, x), (up, y) = self._scale(request.across.path), self._scale(request.up.path)
        points, finite_values = math.isqrt(values.size), values[np.isfinite(values)]
        ends = np.array(usual_range(finite_values) if finite_values.size else (0.0, 0.0))
        scale = self._session.machine.display.fitting(QUANTITIES[quantity].unit, finite_values)
        self.view.run_method(
            "show",
            {
                "nx": points,
                "ny": points,
                "values": finite(values * scale.factor),
                "ends": (ends * scale.factor).tolist(),
                "unit": scale.unit,
                "alike": x == y and x.unit in UNITS_OF_LENGTH,
                "x": {**_axis(request.across, x), "label": x.label(full_label(across.parameter))},
                "y": {**_axis(request.up, y), "label": y.label(full_label(up.parameter))},
                "here": [self._session.value(across.path) * x.factor, self._session.value(up.path) * y.factor],
            },
        )

    def _range_field(self, side: str) -> ui.input:
        field = ui.input(f"{side} axis").props("dense outlined").classes("field").tooltip(RANGE_HINT.format(side))
        field.on("keydown.enter", self._take_ranges).on("blur", self._take_ranges)
        return field.mark(f"map-range-{side}")

    def _show_ranges(self) -> None:
        for field, ends in zip(self.ranges, self._ends(), strict=True):
            field.set_value(self._range_text(ends))
        self._menu.open()

    def _range_text(self, ends: Ends) -> str:
        _, scale = self._scale(ends.path)
        return f"{ends.low * scale.factor:.4g} to {ends.high * scale.factor:.4g} {scale.unit}"

    def _take_ranges(self) -> None:
        """Take what was typed as the ranges of both axes; what cannot be read is refused with the reason."""
        for field, ends in zip(self.ranges, self._ends(), strict=True):
            text = str(field.value or "").strip()
            if text == self._range_text(ends):
                continue
            try:
                chosen = self._read_range(ends.path, text)
            except InputError as error:
                refuse(str(error))
                return
            self._chosen_ranges.pop(ends.path, None)
            if chosen is not None:
                self._chosen_ranges[ends.path] = chosen
        self.refresh()

    def _read_range(self, path: str, text: str) -> tuple[float, float] | None:
        """Return the ends of a range from text such as "-5 to 8 cm"; None if it is empty."""
        if not text:
            return None
        control, scale = self._scale(path)
        subject = f"the range of {full_label(control.parameter)}"
        first, to, last = text.partition(" to ")
        if not to:
            raise InputError(f'{subject} is {shorten(text)}; write two numbers, e.g. "-5 to 8 cm".')
        high = read_typed(control.parameter, last, scale.unit)
        # The first end has the unit of the last one: "-5 to 8 cm".
        unit = last.strip().lstrip("+-.0123456789eE \u2212").strip() or scale.unit
        low = read_typed(control.parameter, first, unit)
        if not low < high:
            raise InputError(f"{subject} is {shorten(text)}; its first end must be the lower one.")
        return low, high

    def _choose(self) -> None:
        if self._is_users_choice:
            self.refresh()

    def _choose_axis(self) -> None:
        if self._is_users_choice:
            self._forget_reached()
            self.refresh()

    def _pick(self, event: GenericEventArguments) -> None:
        (across, x), (up, y) = self._scale(str(self.across.value)), self._scale(str(self.up.value))
        try:
            self._session.move(
                {across.path: float(event.args["x"]) / x.factor, up.path: float(event.args["y"]) / y.factor}
            )
        except InputError as error:
            refuse(str(error))
            return
        self._on_change()

    def _settle(self, _event: GenericEventArguments) -> None:
        try:
            self._session.settle()
        except InputError as error:
            refuse(str(error))
        self._on_change()


def _axis(ends: Ends, scale: Scale) -> dict[str, float]:
    """Return the ends of an axis in the unit that it shows."""
    return {"low": ends.low * scale.factor, "high": ends.high * scale.factor}
