"""The requirements of the machine's file: what is met, what is not, and a button that goes to the worst pose."""

from functools import partial

from nicegui import ui

from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.requirements import Verdict, requirements
from kinetostat.studio.answers import Report
from kinetostat.studio.lanes import Lane
from kinetostat.studio.panels import Panel
from kinetostat.studio.session import Session
from kinetostat.views.requirement_lines import headline, requirement_lines

NONE = 'The file has no requirements; a table [requirements] with NAME = "free_stiffness_z > 50 N/um" adds one.'


class RequirementsPanel(Panel):
    """Each requirement with its verdict, margin and worst pose; those that are not met come first."""

    name = "Requirements"

    def build(self) -> None:
        self._session: Session | None = None
        self._lane = Lane(_judged, self._draw)
        self.lines = ui.column().mark("requirements")

    def show(self, _report: Report, session: Session) -> None:
        self._session = session
        self._lane.ask(session.machine)

    def close(self) -> None:
        self._lane.close()

    def _draw(self, machine: Machine, verdicts: tuple[Verdict, ...] | str) -> None:
        self.lines.clear()
        with self.lines:
            if isinstance(verdicts, str) or not verdicts:
                ui.label(verdicts if isinstance(verdicts, str) else NONE)
                return
            ui.label(headline(verdicts)).mark("requirements-headline")
            for verdict, word, sentence in requirement_lines(verdicts, machine.display):
                with ui.row().classes("items-center no-wrap"):
                    ui.icon("check_circle" if verdict.met else "error", color="positive" if verdict.met else "negative")
                    ui.label(f"{word}: {sentence}")
                    if verdict.worst_pose:
                        to_worst = ui.button("Worst pose", on_click=partial(self._go, verdict))
                        to_worst.props("flat dense no-caps").mark(f"worst-{verdict.name}")

    def _go(self, verdict: Verdict) -> None:
        if self._session is not None:
            self._session.move(verdict.worst_pose)
            self.changed()


def _judged(machine: Machine) -> tuple[Verdict, ...] | str:
    """Judge requirements in a thread, or say what is wrong with them."""
    try:
        return requirements(machine)
    except InputError as error:
        return str(error)
