"""The design tab: a study on the left, searches, their results and favourites on the right, the machine between them.

`Workshop` holds what outlives the page. Favourites are machines with a note, of which two or more are compared.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from nicegui import ui

from kinetostat.frozen import dataclass
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import analyze
from kinetostat.studies.comparison import MOST_DESIGNS, Design, compare
from kinetostat.studio.design.draft import Draft
from kinetostat.studio.design.run_panel import RunPanel
from kinetostat.studio.design.runs import Runs
from kinetostat.studio.design.state_folder import LONGEST_FAVOURITE_NAME, LONGEST_FAVOURITE_NOTE, Favourite, Favourites
from kinetostat.studio.design.study_form import StudyForm
from kinetostat.studio.design.texts import comparison_text
from kinetostat.studio.elements import MAIN_BUTTON, confirm, icon_button, in_quotes, refuse
from kinetostat.studio.lanes import Lane
from kinetostat.studio.session import Session

RESULT, FRONT, FAVOURITES = "Result", "Front", "Favourites"
"""Names of the tabs on the right."""
LEAST_COMPARED = 2
"""Designs that are compared at a time, at least; `MOST_DESIGNS` at most, as in the command."""
PRESENT_NUMBER = 0
"""The number of the present machine in the list; favourites begin at 1."""
PRESENT_NAME = "present machine"


class Workshop:
    """The searches and favourites of one state folder, shared by all pages of a server; they outlive the pages.

    Attributes:
        runs: searches.
        favourites: machines that are kept.
    """

    def __init__(self, state: Path) -> None:
        self.runs, self.favourites = Runs(state), Favourites(state)

    def close(self) -> None:
        """Let all searches end after their present step."""
        self.runs.close()


class DesignTab:
    """The panels of the tab on one page."""

    def __init__(self, session: Session, workshop: Workshop, load: Callable[[Machine], None]) -> None:
        """Build the panels to the left and to the right of the machine.

        Args:
            session: the session whose machine is designed.
            workshop: searches and favourites of the server.
            load: takes a machine into the session.
        """
        self._session, self._workshop = session, workshop
        with ui.element("section").classes("design of-designing left").props('aria-label="study"'):
            self.form = StudyForm(session, self._start)
        with ui.element("section").classes("design of-designing right").props('aria-label="search and result"'):
            with ui.element("div").classes("card run-card"):
                self.run_panel = RunPanel(workshop.runs, load)
            with ui.element("div").classes("card answer-card"):
                with ui.tabs().classes("panel-tabs").props("dense no-caps") as self.tabs:
                    for name in (RESULT, FRONT, FAVOURITES):
                        ui.tab(name).mark(f"tab-{name}")
                panels = ui.tab_panels(self.tabs, value=RESULT, animated=False)
                with panels.classes("panel-body").props("keep-alive"):
                    with ui.tab_panel(FRONT):
                        self.run_panel.front.table()
                    with ui.tab_panel(RESULT):
                        self.run_panel.place_result()
                    with ui.tab_panel(FAVOURITES):
                        self.favourites = FavouritesPanel(session, workshop.favourites, load)

    def set_front(self, is_in_front: bool) -> None:
        """Note whether the tab is in front: only then the page follows its searches."""
        self.run_panel.timer.active = is_in_front
        if is_in_front:
            self._workshop.runs.prepare()
            self.favourites.fill()
            self.run_panel.refresh()

    def renew(self) -> None:
        """Adapt the form to another machine that has been loaded."""
        self.form.renew()

    def close(self) -> None:
        """Stop following the searches, because the page is gone; they go on."""
        self.run_panel.close()
        self.favourites.close()

    def _start(self, draft: Draft) -> None:
        run = self._workshop.runs.start(draft.problem(self._session.machine), self.tabs.client.id)
        self.tabs.set_value(RESULT)
        self.run_panel.follow(run)


@dataclass(frozen=True)
class ComparisonRequest:
    """Machines to compare, each with its name, the quantities to compare, and ranges of poses."""

    machines: list[tuple[str, Machine]]
    quantities: list[str]
    ranges: list[str]


class FavouritesPanel:
    """The list of favourites, a form to keep another one, and a window for the comparison."""

    def __init__(self, session: Session, favourites: Favourites, load: Callable[[Machine], None]) -> None:
        """Build the panel.

        Args:
            session: the session of this tab; its machine can be kept.
            favourites: the favourites that the server keeps for all tabs.
            load: puts a machine into the session.
        """
        self._session, self._favourites, self._load = session, favourites, load
        self._lane = Lane(_comparison_of, self._show)
        self._chosen: set[int] = set()
        with ui.element("div").classes("keep-row"):
            self.name = ui.input("name").props(f"maxlength={LONGEST_FAVOURITE_NAME}").mark("favourite-name")
            self.note = ui.input("note").props(f"maxlength={LONGEST_FAVOURITE_NOTE}").mark("favourite-note")
            for box in (self.name, self.note):
                box.props("dense outlined").classes("field grow")
            button = ui.button("Keep", icon="star", on_click=self._keep).props(MAIN_BUTTON)
            button.tooltip("keep the present machine as a favourite").mark("favourite-keep")
        self._list = ui.element("div").classes("favourites")
        with ui.element("div").classes("keep-row"):
            self.quantities = ui.input("numbers", placeholder="frequency_1, mass").mark("favourite-quantities")
            self.ranges = ui.input("over", placeholder="x=-2 cm:2 cm:5").mark("favourite-over")
            for box in (self.quantities, self.ranges):
                box.props(f"dense outlined stack-label maxlength={LONGEST_FAVOURITE_NOTE}").classes("field grow")
        with ui.element("div").classes("design-foot"):
            ui.label(f"Tick two to {MOST_DESIGNS} machines to compare them.").classes("note grow")
            self.compare = ui.button("Compare", icon="compare_arrows", on_click=self._ask)
            self.compare.props(MAIN_BUTTON).mark("favourite-compare")
        with ui.dialog() as self.window, ui.element("div").classes("comparison-window"):
            with ui.element("div").classes("comparison-head"):
                ui.label("Designs side by side").classes("comparison-title")
                icon_button("close", "Close", self.window.close, "comparison-close")
            self.comparison = ui.html("", sanitize=False).classes("comparison").mark("comparison")
        self.fill()

    def fill(self) -> None:
        """List the favourites that there are now."""
        favourites = self._favourites.entries()
        self._chosen &= {PRESENT_NUMBER, *(favourite.number for favourite in favourites)}
        self._list.clear()
        with self._list:
            self._row(PRESENT_NUMBER, PRESENT_NAME, "")
            for kept in favourites:
                with self._row(kept.number, kept.name, kept.note):
                    self._button("input", f"Load {kept.name}", partial(self._take, kept), f"{kept.number} load")
                    self._button("delete", f"Delete {kept.name}", partial(self._delete, kept), f"{kept.number} delete")
        self._enable_comparison()

    def close(self) -> None:
        self._lane.close()

    def _row(self, number: int, name: str, note: str) -> ui.element:
        with ui.element("div").classes("favourite") as row:
            box = ui.checkbox(value=number in self._chosen, on_change=lambda event: self._tick(number, event.value))
            box.props(f'dense aria-label="compare {in_quotes(name)}"').mark(f"favourite {number} tick")
            with ui.element("div").classes("grow"):
                ui.label(name).classes("favourite-name")
                if note:
                    ui.label(note).classes("favourite-note")
        return row

    @staticmethod
    def _button(icon: str, text: str, action: Callable[[], None], mark: str) -> None:
        icon_button(icon, text, action, f"favourite {mark}").props('size="sm"')

    def _tick(self, number: int, is_ticked: bool) -> None:
        self._chosen = self._chosen | {number} if is_ticked else self._chosen - {number}
        self._enable_comparison()

    def _enable_comparison(self) -> None:
        self.compare.set_enabled(LEAST_COMPARED <= len(self._chosen) <= MOST_DESIGNS)

    def _keep(self) -> None:
        try:
            self._favourites.keep(self._session.machine, self.name.value or self._session.machine.name, self.note.value)
        except InputError as error:
            refuse(str(error))
            return
        self.name.value = self.note.value = ""
        self.fill()

    def _take(self, favourite: Favourite) -> None:
        try:
            self._load(favourite.machine())
        except InputError as error:
            refuse(str(error))

    def _delete(self, favourite: Favourite) -> None:
        def delete() -> None:
            self._favourites.delete(favourite.number)
            self.fill()

        confirm(f"Delete the favourite {favourite.name}?", delete)

    def _ask(self) -> None:
        try:
            chosen = [kept for kept in reversed(self._favourites.entries()) if kept.number in self._chosen]
            machines = [(kept.name, kept.machine()) for kept in chosen]
        except InputError as error:
            refuse(str(error))
            return
        if PRESENT_NUMBER in self._chosen:
            machines.insert(0, (PRESENT_NAME, self._session.machine))
        if len(machines) >= LEAST_COMPARED:
            self._lane.ask(
                ComparisonRequest(machines, _entries_of(self.quantities.value), _entries_of(self.ranges.value))
            )

    def _show(self, _request: ComparisonRequest, answer: str | InputError) -> None:
        if isinstance(answer, InputError):
            refuse(str(answer))
            return
        self.comparison.set_content(answer)
        self.window.open()


def _entries_of(text: str) -> list[str]:
    """Return the entries of a list that is written with commas."""
    return [part.strip() for part in text.split(",") if part.strip()]


def _comparison_of(request: ComparisonRequest) -> str | InputError:
    """Compare machines in a thread; a refusal is returned, because the page shows it."""
    designs = [Design(label, machine, analyze(machine)) for label, machine in request.machines]
    try:
        return comparison_text(compare(designs, request.ranges, quantities=request.quantities))
    except InputError as refusal:
        return refusal
