"""The left of the page: the numbers of the machine as sliders and fields, or the text of its file.

Either changes the machine of the session. Ranges and positions of sliders come from `controls`. A text is checked at
every change; messages are those of `kinetostat`, and the meaning of a field comes from the annotations that also make
the schema.
"""

import re
from collections.abc import Callable
from functools import partial
from html import escape
from itertools import groupby
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

from kinetostat.frozen import dataclass
from kinetostat.machine.loading import build
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import doubts
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import quantities
from kinetostat.studio.controls import CONTROL_PANELS, SLIDER_STEPS, Control
from kinetostat.studio.elements import THROTTLE, QuantityRow, TextEditor
from kinetostat.studio.lanes import Lane
from kinetostat.studio.session import Session
from kinetostat.studio.wording import shown_value
from kinetostat.units import KINDS

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
            is_busy: whether the last change is still being drawn; a slider's next position then waits for `go_on`.
        """
        self._session, self._on_change, self._is_busy = session, on_change, is_busy
        self._waiting: tuple[str, int] | None = None
        self._rows: dict[str, QuantityRow] = {}
        with ui.tabs().classes("panel-tabs").props("dense no-caps") as tabs:
            for panel in CONTROL_PANELS:
                ui.tab(panel).mark(f"tab-{panel}")
        with ui.tab_panels(tabs, value=CONTROL_PANELS[0], animated=False).classes("panel-body").props("keep-alive"):
            self._places = {panel: self._place(panel) for panel in CONTROL_PANELS}
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
            chosen.sort(key=lambda control: (*FIRST_GROUPS, control.group).index(control.group))
            with place:
                for group, members in groupby(chosen, key=lambda control: control.group):
                    self._group(group, list(members), len(chosen))

    def _group(self, group: str, members: list[Control], total: int) -> None:
        if len(members) == total:  # one group needs no heading
            self._make(members)
            return
        with (
            ui.expansion(group.replace("_", " "), value=total <= MOST_OPEN_CONTROLS or group in FIRST_GROUPS)
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
            row = QuantityRow(control.label, control.parameter.quantity.meaning, SLIDER_STEPS, control.slides)
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


TEXT_NAME = "the text"
"""Name of the text in messages, where a file would have its path."""
SHOWN_TEXT = "The picture shows this text."
TEXT_WITH_MISTAKE = "The picture shows the machine before this mistake."
_HEADER = re.compile(r"\s*\[+\s*([^\]#]+?)\s*\]+")
_KEY = re.compile(r"\s*([A-Za-z0-9_-]+)\s*=")
_LINE = re.compile(r"\bline (\d+)")
_LEG = re.compile(r'leg "([^"]+)"')
_PATH = re.compile(r"[\w-]+(?:\.[\w-]+)*")


@dataclass(frozen=True)
class Reading:
    """A text that was read: its machine, or the mistake and the line where it is (0 if unknown)."""

    machine: Machine | None
    mistake: str = ""
    line: int = 0


def reading(text: str) -> Reading:
    """Read a machine file."""
    try:
        return Reading(build(text, TEXT_NAME))
    except InputError as error:
        message = str(error).removeprefix(f'"{TEXT_NAME}": ').removeprefix(f'"{TEXT_NAME}" ')
        return Reading(None, message, line_of(message, text))


def places(text: str) -> list[str]:
    """Return for each line of a machine file the path of the field that it sets; a table's for its header, else ""."""
    table, paths = "", []
    for line in text.splitlines():
        if header := _HEADER.match(line):
            table = header[1].replace('"', "").replace(" ", "")
            paths.append(table)
        elif key := _KEY.match(line):
            paths.append(f"{table}.{key[1]}" if table else key[1])
        else:
            paths.append("")
    return paths


def line_of(message: str, text: str) -> int:
    """Return the line that a message is about: the one it names, or that of the field or leg it begins with; else 0."""
    if named := _LINE.search(message):
        return int(named[1])
    if leg := _LEG.match(message):
        line_of_name = re.compile(rf'\s*name\s*=\s*"{re.escape(leg[1])}"')
        return next((i for i, line in enumerate(text.splitlines(), 1) if line_of_name.match(line)), 0)
    value_places, paths = places(text), [path.rstrip(".") for path in _PATH.findall(message)]
    wanted = next((path for path in paths if "." in path and path in value_places), paths[0] if paths else "")
    while wanted:
        if wanted in value_places:
            return value_places.index(wanted) + 1
        wanted = wanted.rpartition(".")[0]
    return 0


def explanation_of(machine: Machine, path: str) -> str:
    """Return as HTML what the field of a machine file means, and what it may be; empty if it is not a field."""
    table, _, field = path.rpartition(".")
    fields = machine.family.every_table.get(table)
    quantity = quantities(fields).get(field) if fields else None
    if quantity is None:
        return ""
    kind = KINDS[quantity.kind]
    entries = f"; one for all, or a list of {quantity.count}" if quantity.count else ""
    example = f', e.g. "{kind.example}"' if kind.unit else ""
    return f"<b>{escape(field)}</b>: {escape(quantity.meaning)}; {escape(kind.name)}{escape(example)}{entries}."


class TextPane:
    """The text, its line numbers, and below it a mistake, or the meaning of the field in which the cursor is."""

    def __init__(self, session: Session, load: Callable[[Machine], None]) -> None:
        """Build the pane, empty until it comes to the front.

        Args:
            session: the session whose machine it shows.
            load: takes a machine that was typed into the session, as one step with those typed before it.
        """
        self._session, self._load = session, load
        self._front = False
        self._text = ""
        self._typed: Machine | None = None
        self._place = 0
        self._readings = Lane(reading, self._take_reading)
        self._texts = Lane(self._text_of, self._put)
        self.editor = TextEditor("machine file").mark("text")
        self.editor.on("edit", self._edit).on("place", self._follow_cursor)
        with ui.element("div").classes("text-foot").props('role="status" aria-live="polite"'):
            self.message = ui.html("", sanitize=False).classes("grow").mark("text-message")
            self.back = ui.button("Undo the mistake", on_click=self._discard).props("flat dense no-caps")
            self.back.tooltip("show the text of the machine in the picture").mark("text-back").set_visibility(False)

    def set_front(self, is_in_front: bool) -> None:
        """Note whether the pane is in front: only then it follows the machine."""
        self._front = is_in_front
        self.refresh()

    def refresh(self) -> None:
        """Show the text of the present machine, unless it was typed here or a mistake is still to be mended."""
        if self._front and self._session.machine is not self._typed and not self.back.visible:
            self._texts.ask(self._session.machine)

    def renew(self) -> None:
        """Show the text of another machine that has been loaded, whatever was typed before."""
        if self._session.machine is not self._typed:
            self._discard()

    def close(self) -> None:
        for lane in (self._readings, self._texts):
            lane.close()

    def _text_of(self, _machine: Machine) -> str:
        return self._session.as_file()[1].decode()

    def _put(self, machine: Machine, text: str) -> None:
        self._typed, self._text = machine, text
        self.editor.show_text(text)
        self._say(Reading(machine))

    def _discard(self) -> None:
        self.back.set_visibility(False)
        self._typed = None
        self.refresh()

    def _edit(self, event: GenericEventArguments) -> None:
        self._text = str(event.args)
        self._readings.ask(self._text)

    def _take_reading(self, text: str, result: Reading) -> None:
        """Show a machine that was typed, or the mistake in its text, unless the text has changed meanwhile."""
        if text != self._text:
            return
        self.back.set_visibility(result.machine is None)
        if result.machine is not None:
            self._typed = result.machine
            self._load(result.machine)
        self._say(result)

    def _follow_cursor(self, event: GenericEventArguments) -> None:
        """Explain the field in which the cursor is."""
        self._place = int(event.args)
        if not self.back.visible:
            self._say(Reading(self._session.machine))

    def _say(self, result: Reading) -> None:
        """Show a mistake and mark its line, or explain the field in which the cursor is."""
        self.editor.mark_line(result.line)
        if result.machine is None:
            text = f'<p class="text-problem">{escape(result.mistake)} {TEXT_WITH_MISTAKE}</p>'
        else:
            value_places = places(self._text)
            path = value_places[self._place - 1] if 0 < self._place <= len(value_places) else ""
            lines = [explanation_of(result.machine, path) or SHOWN_TEXT, *map(escape, doubts(result.machine))]
            text = f'<p class="text-good">{"<br>".join(lines)}</p>'
        self.message.set_content(text)
