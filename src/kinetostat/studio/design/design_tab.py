"""The design tab: a study on the left, searches and their results on the right, the machine between them.

It only arranges the panels of this package and connects them; `Workshop` holds what outlives the page.
"""

from collections.abc import Callable
from pathlib import Path

from nicegui import ui

from kinetostat.machine.machine import Machine
from kinetostat.studio.design.draft import Draft
from kinetostat.studio.design.favourites_panel import FavouritesPanel
from kinetostat.studio.design.run_panel import RunPanel
from kinetostat.studio.design.runs import Runs
from kinetostat.studio.design.state_folder import Favourites
from kinetostat.studio.design.study_form import StudyForm
from kinetostat.studio.session import Session

RESULT, FRONT, FAVOURITES = "Result", "Front", "Favourites"


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
            session: whose machine is designed.
            workshop: searches and favourites of the server.
            load: takes a machine into the session.
        """
        self._session, self._workshop = session, workshop
        with ui.element("section").classes("design of-designing left").props('aria-label="study"'):
            self.form = StudyForm(session, self._start)
        with ui.element("section").classes("design of-designing right").props('aria-label="search and result"'):
            with ui.element("div").classes("card run-card"):
                self.runs = RunPanel(workshop.runs, load)
            with ui.element("div").classes("card answer-card"):
                with ui.tabs().classes("panel-tabs").props("dense no-caps") as self.tabs:
                    for name in (RESULT, FRONT, FAVOURITES):
                        ui.tab(name).mark(f"tab-{name}")
                panels = ui.tab_panels(self.tabs, value=RESULT, animated=False)
                with panels.classes("panel-body").props("keep-alive"):
                    with ui.tab_panel(FRONT):
                        self.runs.front.table()
                    with ui.tab_panel(RESULT):
                        self.runs.answer()
                    with ui.tab_panel(FAVOURITES):
                        self.favourites = FavouritesPanel(session, workshop.favourites, load)

    def front(self, on: bool) -> None:
        """Note whether the tab is in front: only then the page follows its searches."""
        self.runs.timer.active = on
        if on:
            self.favourites.fill()
            self.runs.refresh()

    def renew(self) -> None:
        """Adapt the form to another machine that has been loaded."""
        self.form.renew()

    def close(self) -> None:
        """Stop following the searches, because the page is gone; they go on."""
        self.runs.close()
        self.favourites.close()

    def _start(self, draft: Draft) -> None:
        run = self._workshop.runs.start(draft.problem(self._session.machine), self.tabs.client.id)
        self.tabs.set_value(RESULT)
        self.runs.follow(run)
