"""Favourites on the page: keep the machine at hand, load, delete, compare two to four side by side."""

from collections.abc import Callable
from functools import partial

from nicegui import ui

from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import analyze
from kinetostat.studies.comparison.designs import Comparison, Design, compare
from kinetostat.studio.design.comparison_text import comparison_text
from kinetostat.studio.design.state_folder import LONGEST_NAME, LONGEST_NOTE, Favourite, Favourites
from kinetostat.studio.lanes import Lane
from kinetostat.studio.session import Session

LEAST, MOST = 2, 4
"""Designs that are compared at a time."""
AT_HAND = 0
"""The number under which the machine at hand is compared."""

Asked = list[tuple[str, Machine]]


class FavouritesPanel:
    """What is kept, a form to keep more, and the comparison in a window of its own."""

    def __init__(
        self,
        session: Session,
        favourites: Favourites,
        load: Callable[[Machine], None],
        refuse: Callable[[str], None],
        confirm: Callable[[str, Callable[[], None]], None],
    ) -> None:
        """A panel.

        Args:
            session: whose machine may be kept.
            favourites: of the server.
            load: takes a machine into the session.
            refuse: told what could not be done.
            confirm: asks before something is deleted.
        """
        self._session, self._favourites = session, favourites
        self._load, self._refuse, self._confirm = load, refuse, confirm
        self._lane = Lane(_compared, self._show)
        self._chosen: set[int] = set()
        with ui.element("div").classes("keep-row"):
            self.name = ui.input("name").props(f"dense outlined maxlength={LONGEST_NAME}").mark("favourite-name")
            self.note = ui.input("note").props(f"dense outlined maxlength={LONGEST_NOTE}").mark("favourite-note")
            for box in (self.name, self.note):
                box.classes("field grow")
            button = ui.button("Keep", icon="star", on_click=self._keep).props(
                "unelevated no-caps text-color=accent-ink dense"
            )
            button.tooltip("keep the machine as it is now").mark("favourite-keep")
        self._list = ui.element("div").classes("favourites")
        with ui.element("div").classes("design-foot"):
            ui.label("Tick two to four to compare them.").classes("note grow")
            self.compare = ui.button("Compare", icon="compare_arrows", on_click=self._ask)
            self.compare.props("unelevated no-caps text-color=accent-ink dense").mark("favourite-compare")
        with ui.dialog() as self.window, ui.element("div").classes("comparison-window"):
            with ui.element("div").classes("comparison-head"):
                ui.label("Designs side by side").classes("comparison-title")
                close = ui.button(icon="close", on_click=self.window.close).props('flat round dense aria-label="Close"')
                close.mark("comparison-close")
            self.comparison = ui.html("", sanitize=False).classes("comparison").mark("comparison")
        self.fill()

    def fill(self) -> None:
        """Show what is kept now."""
        kept = self._favourites.every()
        self._chosen &= {AT_HAND, *(one.number for one in kept)}
        self._list.clear()
        with self._list:
            self._line(AT_HAND, "the machine at hand", "")
            for one in kept:
                with self._line(one.number, one.name, one.note):
                    self._button("input", f"Load {one.name}", partial(self._take, one), f"favourite {one.number} load")
                    delete = partial(self._delete, one)
                    self._button("delete", f"Delete {one.name}", delete, f"favourite {one.number} delete")
        self._count()

    def close(self) -> None:
        """Deliver nothing any more."""
        self._lane.close()

    def _line(self, number: int, name: str, note: str) -> ui.element:
        with ui.element("div").classes("favourite") as line:
            box = ui.checkbox(value=number in self._chosen, on_change=lambda event: self._tick(number, event.value))
            box.props(f'dense aria-label="compare {_attribute(name)}"').mark(f"favourite {number} tick")
            with ui.element("div").classes("grow"):
                ui.label(name).classes("favourite-name")
                if note:
                    ui.label(note).classes("favourite-note")
        return line

    @staticmethod
    def _button(icon: str, text: str, action: Callable[[], None], mark: str) -> None:
        button = ui.button(icon=icon, on_click=action).props(
            f'flat round dense size="sm" aria-label="{_attribute(text)}"'
        )
        button.tooltip(text).mark(mark)

    def _tick(self, number: int, on: bool) -> None:
        self._chosen = self._chosen | {number} if on else self._chosen - {number}
        self._count()

    def _count(self) -> None:
        self.compare.set_enabled(LEAST <= len(self._chosen) <= MOST)

    def _keep(self) -> None:
        try:
            self._favourites.keep(self._session.machine, self.name.value or self._session.machine.name, self.note.value)
        except InputError as error:
            self._refuse(str(error))
            return
        self.name.value = self.note.value = ""
        self.fill()

    def _take(self, one: Favourite) -> None:
        try:
            self._load(one.machine())
        except InputError as error:
            self._refuse(str(error))

    def _delete(self, one: Favourite) -> None:
        def delete() -> None:
            self._favourites.delete(one.number)
            self.fill()

        self._confirm(f"Delete the favourite {one.name}?", delete)

    def _ask(self) -> None:
        asked: Asked = []
        try:
            for one in reversed(self._favourites.every()):
                if one.number in self._chosen:
                    asked.append((one.name, one.machine()))
        except InputError as error:
            self._refuse(str(error))
            return
        if AT_HAND in self._chosen:
            asked.insert(0, ("the machine at hand", self._session.machine))
        if len(asked) >= LEAST:
            self._lane.ask(asked)

    def _show(self, _asked: Asked, found: Comparison) -> None:
        self.comparison.set_content(comparison_text(found))
        self.window.open()


def _compared(asked: Asked) -> Comparison:
    return compare([Design(label, machine, analyze(machine)) for label, machine in asked])


def _attribute(text: str) -> str:
    """Text inside the quotes of a property."""
    return text.replace('"', "'").replace("\\", "/")
