"""The text of the machine's file, checked at every change; below it stands a mistake, or the meaning of a field.

Messages are those of `kinetostat`; the meaning of a field comes from the annotations that also make the schema.
"""

import re
from collections.abc import Callable
from html import escape

from nicegui import ui
from nicegui.events import GenericEventArguments

from kinetostat.frozen import dataclass
from kinetostat.machine.loading import build
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import doubts
from kinetostat.machine.saving import as_file
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import quantities
from kinetostat.studio.elements import TextEditor
from kinetostat.studio.lanes import Lane
from kinetostat.studio.session import Session
from kinetostat.units import KINDS

TEXT_NAME = "the text"
"""Name of the text in messages, where a file would have its path."""
SHOWN_TEXT = "The picture shows this text."
TEXT_WITH_MISTAKE = "The picture shows the machine before this mistake."
_TABLE_HEADER = re.compile(r"\s*\[+\s*([^\]#]+?)\s*\]+")  # [legs."leg 1"]
_KEY = re.compile(r"\s*([A-Za-z0-9_-]+)\s*=")  # base_radius = "30 cm"
_LINE_NUMBER = re.compile(r"\bline (\d+)")  # ... at line 12, column 3
_LEG_NAME = re.compile(r'leg "([^"]+)"')  # leg "front" has no joints
_PATH = re.compile(r"[\w-]+(?:\.[\w-]+)*")  # geometry.base_radius must be ...


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


def paths_by_line(text: str) -> list[str]:
    """Return for each line of a machine file the path of the field that it sets; a table's for its header, else ""."""
    table, paths = "", []
    for line in text.splitlines():
        if header := _TABLE_HEADER.match(line):
            table = header[1].replace('"', "").replace(" ", "")
            paths.append(table)
        elif key := _KEY.match(line):
            paths.append(f"{table}.{key[1]}" if table else key[1])
        else:
            paths.append("")
    return paths


def line_of(message: str, text: str) -> int:
    """Return the line that a message is about: the one it names, or that of the field or leg it begins with; else 0."""
    if named := _LINE_NUMBER.search(message):
        return int(named[1])
    if leg := _LEG_NAME.match(message):
        line_of_name = re.compile(rf'\s*name\s*=\s*"{re.escape(leg[1])}"')
        return next((i for i, line in enumerate(text.splitlines(), 1) if line_of_name.match(line)), 0)
    line_paths, paths = paths_by_line(text), [path.rstrip(".") for path in _PATH.findall(message)]
    wanted = next((path for path in paths if "." in path and path in line_paths), paths[0] if paths else "")
    while wanted:
        if wanted in line_paths:
            return line_paths.index(wanted) + 1
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
        self._machine_of_text: Machine | None = None  # None until its text is shown again
        self._cursor_line = 0
        self._readings = Lane(reading, self._take_reading)
        self._texts = Lane(as_file, self._show_text)
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
        if self._front and self._session.machine is not self._machine_of_text and not self.back.visible:
            self._texts.ask(self._session.machine)

    def renew(self) -> None:
        """Show the text of another machine that has been loaded, whatever was typed before."""
        if self._session.machine is not self._machine_of_text:
            self._discard()

    def close(self) -> None:
        """Stop reading and writing texts, because the page is gone."""
        for lane in (self._readings, self._texts):
            lane.close()

    def _show_text(self, machine: Machine, text: str) -> None:
        self._machine_of_text, self._text = machine, text
        self.editor.show_text(text)
        self._show_message(Reading(machine))

    def _discard(self) -> None:
        self.back.set_visibility(False)
        self._machine_of_text = None
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
            self._machine_of_text = result.machine
            self._load(result.machine)
        self._show_message(result)

    def _follow_cursor(self, event: GenericEventArguments) -> None:
        """Explain the field in which the cursor is."""
        self._cursor_line = int(event.args)
        if not self.back.visible:
            self._show_message(Reading(self._session.machine))

    def _show_message(self, result: Reading) -> None:
        """Show a mistake and mark its line, or explain the field in which the cursor is."""
        self.editor.mark_line(result.line)
        if result.machine is None:
            text = f'<p class="text-problem">{escape(result.mistake)} {TEXT_WITH_MISTAKE}</p>'
        else:
            line_paths = paths_by_line(self._text)
            path = line_paths[self._cursor_line - 1] if 0 < self._cursor_line <= len(line_paths) else ""
            lines = [explanation_of(result.machine, path) or SHOWN_TEXT, *map(escape, doubts(result.machine))]
            text = f'<p class="text-good">{"<br>".join(lines)}</p>'
        self.message.set_content(text)
