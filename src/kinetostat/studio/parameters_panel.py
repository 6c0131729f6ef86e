"""The left of the page: every number of the machine as a slider and as text, in panels.

Ranges and positions come from `controls`, changes go to the session; this panel only shows rows and passes events on.
"""

from collections.abc import Callable
from functools import partial
from itertools import groupby
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

from kinetostat.spec.errors import InputError
from kinetostat.studio.controls import PANELS, STEPS, Control
from kinetostat.studio.elements import THROTTLE, QuantityRow
from kinetostat.studio.session import Session
from kinetostat.studio.wording import shown_value

OPEN = 12
"""Controls of a group up to which it is open from the start: longer ones would push all others off the screen."""
AT_ONCE = ("load", "tool")
"""Groups that come first and are open however many controls there are: what moves a loaded machine."""


class ParametersPanel:
    """Tabs of controls; the rows of a group are made when it is first opened, because large machines have hundreds."""

    def __init__(self, session: Session, on_change: Callable[[], None], is_busy: Callable[[], bool]) -> None:
        """Build the panel.

        Args:
            session: the session whose numbers it shows and changes.
            on_change: called after every change of the machine.
            is_busy: whether the last change is still being drawn; a slider's next position then waits for `go_on`.
        """
        self._session, self._on_change, self._is_busy = session, on_change, is_busy
        self._waiting: tuple[str, int] | None = None
        self._rows: dict[str, QuantityRow] = {}
        with ui.tabs().classes("panel-tabs").props("dense no-caps") as tabs:
            for panel in PANELS:
                ui.tab(panel).mark(f"tab-{panel}")
        with ui.tab_panels(tabs, value=PANELS[0], animated=False).classes("panel-body").props("keep-alive"):
            self._places = {panel: self._place(panel) for panel in PANELS}
        self.fill()

    @staticmethod
    def _place(panel: str) -> ui.element:
        with ui.tab_panel(panel):
            return ui.element("div").classes("controls")

    def fill(self) -> None:
        """Make the controls of a machine that has just been loaded."""
        self._waiting = None
        self._rows.clear()
        for panel, place in self._places.items():
            place.clear()
            chosen = [control for control in self._session.controls.values() if control.panel == panel]
            chosen.sort(key=lambda control: AT_ONCE.index(control.group) if control.group in AT_ONCE else len(AT_ONCE))
            with place:
                for group, members in groupby(chosen, key=lambda control: control.group):
                    self._group(group, list(members), len(chosen))

    def _group(self, group: str, members: list[Control], total: int) -> None:
        if len(members) == total:  # one group needs no heading
            self._make(members)
            return
        with (
            ui.expansion(group.replace("_", " "), value=total <= 2 * OPEN or group in AT_ONCE)
            .classes("group")
            .props("dense") as expansion
        ):
            place = ui.element("div")
        if expansion.value:
            with place:
                self._make(members)
        else:
            expansion.on_value_change(lambda: self._make_within(place, members))

    def _make_within(self, place: ui.element, members: list[Control]) -> None:
        if members[0].path not in self._rows:
            with place:
                self._make(members)

    def _make(self, members: list[Control]) -> None:
        present = self._session.values()
        for control in members:
            row = QuantityRow(control.label, control.parameter.quantity.meaning, STEPS, control.slides)
            row.mark(f"control {control.path}")
            row.on("slide", partial(self._slide, control.path), throttle=THROTTLE)
            row.on("settle", partial(self._settle, control.path))
            row.on("write", partial(self._write, control.path))
            self._rows[control.path] = row
            self._put(control, present[control.path])

    def refresh(self) -> None:
        """Show the machine's present numbers."""
        present = self._session.values()
        for path in self._rows:
            self._put(self._session.controls[path], present[path])

    def _put(self, control: Control, value: float) -> None:
        display = self._session.machine.display
        self._rows[control.path].show_value(
            shown_value(control.parameter.quantity, value, display), control.position_of(value)
        )

    def go_on(self) -> None:
        """Take the latest position of a slider that had to wait; positions before it are skipped."""
        if self._waiting is not None:
            (path, position), self._waiting = self._waiting, None
            self._try(path, lambda: self._session.slide(path, position))

    def _slide(self, path: str, event: GenericEventArguments) -> None:
        self._waiting = path, int(event.args)
        if not self._is_busy():
            self.go_on()

    def _settle(self, path: str, _event: GenericEventArguments) -> None:
        self.go_on()
        self._try(path, self._session.settle)

    def _write(self, path: str, event: GenericEventArguments) -> None:
        def write() -> None:
            self._session.write(path, str(event.args))
            self._rows[path].take()

        self._try(path, write)

    def _try(self, path: str, change: Callable[[], Any]) -> None:
        try:
            change()
        except InputError as error:
            self._on_change()
            self._rows[path].complain(str(error))
        else:
            self._on_change()
