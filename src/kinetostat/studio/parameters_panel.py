"""The numbers of the machine as sliders and fields, in tabs and groups; ranges and positions come from `controls`."""

from collections.abc import Callable
from functools import partial
from itertools import groupby
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

from kinetostat.spec.errors import InputError
from kinetostat.studio.controls import CONTROL_PANELS, SLIDER_STEPS, Control
from kinetostat.studio.elements import THROTTLE, QuantityRow
from kinetostat.studio.session import Session
from kinetostat.studio.wording import shown_value

MOST_OPEN_CONTROLS = 24
"""Controls of a tab up to which all its groups are open from the start: more would not fit on a screen."""
FIRST_GROUPS = ("load", "tool")
"""Groups that come first and are open however many controls there are: what moves a loaded machine."""


class ParametersPanel:
    """Tabs of controls; the rows of a group are made when it is first opened, because large machines have hundreds."""

    def __init__(self, session: Session, on_change: Callable[[], None], is_busy: Callable[[], bool]) -> None:
        """Build the panel.

        Args:
            session: the session whose numbers it shows and changes.
            on_change: called after every change of the machine.
            is_busy: whether the last change is still being drawn; a slider's next position then waits for
                `take_waiting_position`.
        """
        self._session, self._on_change, self._is_busy = session, on_change, is_busy
        self._waiting: tuple[str, int] | None = None
        self._rows: dict[str, QuantityRow] = {}
        with ui.tabs().classes("panel-tabs").props("dense no-caps") as tabs:
            for panel in CONTROL_PANELS:
                ui.tab(panel).mark(f"tab-{panel}")
        with ui.tab_panels(tabs, value=CONTROL_PANELS[0], animated=False).classes("panel-body").props("keep-alive"):
            self._containers = {panel: self._container(panel) for panel in CONTROL_PANELS}
        self.fill()

    @staticmethod
    def _container(panel: str) -> ui.element:
        with ui.tab_panel(panel):
            return ui.element("div").classes("controls")

    def fill(self) -> None:
        """Make the controls of a machine that has just been loaded."""
        self._waiting = None
        self._rows.clear()
        for panel, container in self._containers.items():
            container.clear()
            chosen = [control for control in self._session.controls.values() if control.panel == panel]
            # Load, tool, then all others as they come: the sort is stable and keeps groups whole, as `groupby` needs.
            chosen.sort(key=lambda control: (*FIRST_GROUPS, control.group).index(control.group))
            with container:
                for group, members in groupby(chosen, key=lambda control: control.group):
                    self._add_group(group, list(members), len(chosen))

    def _add_group(self, group: str, members: list[Control], total: int) -> None:
        if len(members) == total:  # one group needs no heading
            self._add_rows(members)
            return
        with (
            ui.expansion(group.replace("_", " "), value=total <= MOST_OPEN_CONTROLS or group in FIRST_GROUPS)
            .classes("group")
            .props("dense") as expansion
        ):
            container = ui.element("div")

        def add_once() -> None:
            if members[0].path not in self._rows:
                with container:
                    self._add_rows(members)

        if expansion.value:
            add_once()
        else:
            expansion.on_value_change(add_once)

    def _add_rows(self, members: list[Control]) -> None:
        present = self._session.values()
        for control in members:
            row = QuantityRow(control.label, control.parameter.quantity.meaning, SLIDER_STEPS, control.slides)
            row.mark(f"control {control.path}")
            row.on("slide", partial(self._slide, control.path), throttle=THROTTLE)
            row.on("settle", partial(self._settle, control.path))
            row.on("write", partial(self._write, control.path))
            self._rows[control.path] = row
            self._show_number(control, present[control.path])

    def refresh(self) -> None:
        """Show the machine's present numbers."""
        present = self._session.values()
        for path in self._rows:
            self._show_number(self._session.controls[path], present[path])

    def _show_number(self, control: Control, value: float) -> None:
        display = self._session.machine.display
        self._rows[control.path].show_value(
            shown_value(control.parameter.quantity, value, display), control.position_of(value)
        )

    def take_waiting_position(self) -> None:
        """Take the latest position of a slider that had to wait; positions before it are skipped."""
        if self._waiting is not None:
            (path, position), self._waiting = self._waiting, None
            self._apply(path, lambda: self._session.slide(path, position))

    def _slide(self, path: str, event: GenericEventArguments) -> None:
        self._waiting = path, int(event.args)
        if not self._is_busy():
            self.take_waiting_position()

    def _settle(self, path: str, _event: GenericEventArguments) -> None:
        self.take_waiting_position()
        self._apply(path, self._session.settle)

    def _write(self, path: str, event: GenericEventArguments) -> None:
        def write() -> None:
            self._session.write(path, str(event.args))
            self._rows[path].replace_typed_text()

        self._apply(path, write)

    def _apply(self, path: str, change: Callable[[], Any]) -> None:
        """Change the machine; where that is refused, say why at the row of the number."""
        try:
            change()
        except InputError as error:
            self._on_change()
            self._rows[path].complain(str(error))
        else:
            self._on_change()
