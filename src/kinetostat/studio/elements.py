"""The page's building blocks: the machine in three dimensions, maps, curves, sliders, and buttons in one style.

Each JavaScript component has its class here; what is shown in it is decided by the panels.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import nicegui.elements.echart
import nicegui.elements.scene  # noqa: F401  (both register what NiceGUI brings with it: ECharts and three.js)
from nicegui import ui
from nicegui.element import Element
from nicegui.events import GenericEventArguments, UploadEventArguments

from kinetostat.spec.document import LARGEST_FILE, text_of
from kinetostat.spec.errors import InputError
from kinetostat.views.scene import RENDERER
from kinetostat.views.scene.solids import looks_data

COMPONENTS = Path(__file__).parent / "components"
MODULES = {"kinetostat-studio": str(COMPONENTS), "kinetostat-scene": str(RENDERER)}
MAIN_BUTTON = "unelevated no-caps text-color=accent-ink dense"
"""Style of the button that does what its part of the page is for."""
THROTTLE = 0.03
"""Seconds between two positions that a browser sends during a drag, about two pictures; the last one is always sent."""


class Labelled(Element):
    """An element with a label for screen readers."""

    def __init__(self, label: str) -> None:
        super().__init__()
        self._props["label"] = label


class MachineView(Labelled, component=RENDERER / "machine_view.js", esm=MODULES):
    """Scenes of solids, with light, shadows and a camera.

    Methods: `show` (a scene), `overlay` (solids over it), `ghost` (a translucent shape behind it), `look` (a view),
    `swing` (a shape that swings), `sway` (let it move or rest), `save` (the picture).
    Events: `pull` (the part that is dragged), `settle` (it is let go), `swinging` (whether a shape moves), `drawn` (the
    number of the last scene drawn).
    """

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self._props.update(hidden=[], looks=looks_data())
        self._sent = 0
        self._drawn: int | None = None
        self.on("drawn", self._note_drawn)

    def show(self, scene: dict[str, Any]) -> None:
        """Show a scene."""
        self._sent += 1
        self.run_method("show", {**scene, "number": self._sent})

    @property
    def is_behind(self) -> bool:
        """Whether the browser has still to draw the last scene; playing waits for it, so that a pause acts at once."""
        return self._drawn is not None and self._drawn < self._sent

    def _note_drawn(self, event: GenericEventArguments) -> None:
        self._drawn = int(event.args)

    def hide(self, layers: list[str]) -> None:
        """Show all layers but these."""
        self._props["hidden"] = layers
        self.update()


class BrowserLink(Element, component=COMPONENTS / "browser_link.js"):
    """The address of the page and its dark or light theme, which the browser shares.

    Methods: `otherTheme` (change from dark to light, or back).
    Events: `undo`, `redo` (by the keyboard), `theme` (whether it is dark now; None where it follows the system).
    """

    def show_query(self, address: str) -> None:
        """Show this query in the address."""
        if self._props.get("address") != address:
            self._props["address"] = address
            self.update()


class MapView(Labelled, component=COMPONENTS / "map_view.js"):
    """A map with a mark.

    Methods: `show` (a map), `mark` (a point). Events: `pick` (x and y of a point), `settle` (the choice has ended).
    """


class CurveView(Labelled, component=COMPONENTS / "curve_view.js"):
    """Curves over one number.

    Methods: `show` (curves), `mark` (a value of that number). Events: `pick` (the number of the mark next to a click).
    """


class FrontView(Labelled, component=COMPONENTS / "front_view.js"):
    """Designs as points over two objectives. Methods: `show` (points). Events: `pick` (the number of a point)."""


class DesignTable(Labelled, component=COMPONENTS / "design_table.js"):
    """Designs or other things as rows that sort by any column. Events: `pick` (the number of a row)."""

    def __init__(self, label: str, action: str = "load design") -> None:
        """Build an empty table; `action` is what a screen reader says of the button of a row, before its number."""
        super().__init__(label)
        self._props["action"] = action
        self.show_rows([], [], [], None, None)

    def show_rows(
        self, names: list[str], values: list[list[float]], texts: list[list[str]], knee: int | None, chosen: int | None
    ) -> None:
        """Show other rows: what each column is, numbers to sort by, and how they are written."""
        self._props.update(names=names, values=values, texts=texts, knee=knee, chosen=chosen)
        self.update()


class QuantityRow(Labelled, component=COMPONENTS / "quantity_row.js"):
    """A number with its name and unit, and a slider.

    Events: `slide` (a position of the slider), `settle` (the slider is let go), `write` (the text that was typed).
    """

    def __init__(self, label: str, meaning: str, steps: int, slides: bool) -> None:
        """Build a row without a value yet; `steps` is the last position of its slider, if it has one."""
        super().__init__(label)
        self._props.update(meaning=meaning, steps=steps, slides=slides, text="", position=0, problem="", taken=0)

    def replace_typed_text(self) -> None:
        """Show the present value in the place of what was typed, also where both mean the same and no value changes."""
        self._set(taken=self._props["taken"] + 1)

    def show_value(self, text: str, position: int) -> None:
        """Show a value and the position of its slider, and clear an earlier complaint."""
        self._set(text=text, position=position, problem="")

    def complain(self, problem: str) -> None:
        """Show why the value that was typed is refused."""
        self._set(problem=problem)

    def _set(self, **props: object) -> None:
        # Rows are written after every move of any slider; only those that change are sent to the browser.
        if any(self._props[name] != value for name, value in props.items()):
            self._props.update(props)
            self.update()


class TextEditor(Labelled, component=COMPONENTS / "text_editor.js"):
    """A text with line numbers. Events: `edit` (the whole text), `place` (the line of the cursor)."""

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self._props.update(text="", version=0, line=0)

    def show_text(self, text: str) -> None:
        """Show a text in the place of what was typed."""
        self._props.update(text=text, version=self._props["version"] + 1)
        self.update()

    def mark_line(self, line: int) -> None:
        """Mark the line of a mistake; 0 for none."""
        if self._props["line"] != line:
            self._props["line"] = line
            self.update()


def choice(
    options: dict[Any, str] | list[str], label: str, on_change: Callable[..., None], mark: str,
    value: Any = None, searchable: bool = False,
) -> ui.select:  # fmt: skip
    """Return a list to choose from, if `searchable` by typing; `mark` is the name by which tests know it."""
    select = ui.select(options, label=label, value=value, on_change=on_change, with_input=searchable).mark(mark)
    return select.props("dense options-dense outlined").classes("field")


def toggle(options: Sequence[str], value: str, on_change: Callable[[], None], mark: str) -> ui.toggle:
    """Return a row of buttons of which one is pressed."""
    buttons = ui.toggle(list(options), value=value, on_change=on_change).mark(mark)
    return buttons.props("dense no-caps unelevated toggle-text-color=accent-ink").classes("choice")


def icon_button(icon: str, text: str, action: Callable[[], object], mark: str) -> ui.button:
    """Return a button that shows an icon; `text` is its tooltip and what a screen reader says."""
    button = ui.button(icon=icon, on_click=action).props(f'flat round dense aria-label="{in_quotes(text)}"')
    return button.tooltip(text).mark(mark)


def in_quotes(text: str) -> str:
    """Return text that can stand in the quotes of a property; a name with a quotation mark would end it early."""
    return text.replace('"', "'").replace("\\", "/")


def upload_field(
    on_upload: Callable[[Any], Any], on_refusal: Callable[[str], None], mark: str, suffix: str = ".toml"
) -> ui.upload:
    """Return a hidden field that takes one file from the browser, by default TOML.

    Its method `pickFiles` opens the dialogue in which the file is chosen.

    FastAPI keeps the function of every field that it has served, and with it the page, unless the page takes
    `on_upload` and `on_refusal` out of `called` when it goes.
    """
    too_large = f"The file is larger than {LARGEST_FILE >> 20} MiB, the limit for a file."
    called = {"upload": on_upload, "refuse": on_refusal}
    ui.context.client.on_delete(lambda: called.clear())
    field = ui.upload(
        on_upload=lambda event: called["upload"](event), on_rejected=lambda: called["refuse"](too_large),
        auto_upload=True, max_file_size=LARGEST_FILE, max_files=1,
    )  # fmt: skip
    return field.props(f'accept="{suffix}" aria-hidden="true"').classes("unseen").mark(mark)


def csv_button(text: str, take: Callable[[str], None], mark: str) -> None:
    """Make a button that opens a CSV file; what `take` refuses of its text is shown.

    Args:
        text: the tooltip of the button.
        take: takes the text; it may raise InputError.
        mark: beginning of the names by which tests know button and field: "path" makes "path-open" and "path-upload".
    """

    async def read(event: UploadEventArguments) -> None:
        data = await event.file.read()
        upload.reset()
        try:
            take(text_of(data, event.file.name, "CSV"))
        except InputError as error:
            refuse(str(error))

    upload = upload_field(read, refuse, f"{mark}-upload", ".csv")
    icon_button("folder_open", text, lambda: upload.run_method("pickFiles"), f"{mark}-open")


def refuse(message: str) -> None:
    """Show why something could not be done, until the message is closed."""
    ui.notify(message, type="negative", multi_line=True, close_button="close", timeout=0, position="top")


def confirm(question: str, action: Callable[[], None]) -> None:
    """Ask before something is deleted, and do it if the designer agrees."""

    def agree() -> None:
        action()
        window.close()

    with ui.dialog(value=True) as window, ui.element("div").classes("confirm-window"):
        ui.label(question)
        with ui.element("div").classes("confirm-buttons"):
            ui.button("Cancel", on_click=window.close).props("flat no-caps").mark("confirm-no")
            ui.button("Delete", on_click=agree).props("unelevated no-caps color=negative").mark("confirm-yes")
    window.on_value_change(lambda change: None if change.value else window.delete())
