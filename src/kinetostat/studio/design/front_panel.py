"""A Pareto front on the page: two objectives as a plot, a third one as colour, and all designs as a table.

A design is named by its place in the front, sorted by the first objective; clicks on plot and table pass it on.
"""

from collections.abc import Callable, Sequence

from nicegui import ui
from nicegui.events import GenericEventArguments

from kinetostat.display import Scale
from kinetostat.kinetostatics.quantities import spoken
from kinetostat.studio.design.progress import Progress
from kinetostat.studio.elements import DesignTable, FrontView, choice

NONE = -1
"""The choice of no objective for the colour."""
NO_FRONT = "A study with two to four objectives ends in a Pareto front; its designs will be listed here."
AXES = {"across": "horizontal axis", "up": "vertical axis", "colour": "colour"}


class FrontPanel:
    """The plot of a front over any two of its objectives, and its table."""

    def __init__(self, pick: Callable[[int], None]) -> None:
        """Build the plot and the choice of its axes; `table` builds the table elsewhere on the page.

        Args:
            pick: called with the place of the design that was clicked.
        """
        self._pick = pick
        self._progress: Progress | None = None
        self._chosen: int | None = None
        self._asking = False
        with ui.element("div").classes("front-plot") as self.plot:
            with ui.row().classes("panel-tools") as self.tools:
                self.across, self.up, self.coloured = (
                    choice({}, label, self._chosen_axis, f"front-{mark}") for mark, label in AXES.items()
                )
            self.view = FrontView("designs of the Pareto front; a click, or arrow keys and Enter, load one")
            self.view.mark("run-front").on("pick", self._picked)

    def table(self) -> None:
        """Put the table of all designs on the page."""
        self.without = ui.label(NO_FRONT).classes("note")
        self.rows = DesignTable("designs of the Pareto front").mark("front-table")
        self.rows.on("pick", self._picked)

    def reveal(self, several: bool) -> None:
        """Show plot and table where the study has several objectives, else hide them."""
        self.plot.set_visibility(several)
        self.rows.set_visibility(several)
        self.without.set_visibility(not several)

    def show(self, progress: Progress, chosen: int | None) -> None:
        """Show the front of a search with several objectives; `chosen` is the place of the design that was loaded."""
        self._progress, self._chosen = progress, chosen
        names = {k: objective.term.label for k, objective in enumerate(progress.problem.objectives)}
        if self.across.options != names:
            self._offer(names)
        self._draw()
        self.rows.put(*_table(progress), progress.knee, chosen)

    def _offer(self, names: dict[int, str]) -> None:
        """Offer the objectives as axes and colour; with only two, the choice is hidden."""
        self._asking = False
        self.tools.set_visibility(len(names) > 2)
        self.across.set_options(names, value=0)
        self.up.set_options(names, value=1)
        self.coloured.set_options({NONE: "none", **names}, value=2 if len(names) > 2 else NONE)
        self._asking = True

    def _chosen_axis(self) -> None:
        if self._asking:
            self._draw()

    def _draw(self) -> None:
        progress = self._progress
        if progress is None:
            return
        initial = progress.result and list(progress.result["initial"]["objectives"].values())
        scales = [progress.scale(objective) for objective in progress.problem.objectives]
        self.view.run_method(
            "show",
            {
                "points": [_in_units(point, scales) for point in progress.objectives],
                "axes": [self.across.value, self.up.value],
                "coloured": None if self.coloured.value == NONE else self.coloured.value,
                "labels": [progress.label(objective) for objective in progress.problem.objectives],
                "knee": progress.knee,
                "initial": _in_units(initial, scales) if initial and None not in initial else None,
                "chosen": self._chosen,
            },
        )

    def _picked(self, event: GenericEventArguments) -> None:
        self._pick(int(event.args))


def _in_units(values: Sequence[float], scales: Sequence[Scale]) -> list[float]:
    return [value * scale.factor for value, scale in zip(values, scales, strict=True)]


def _table(progress: Progress) -> tuple[list[str], list[list[float]], list[list[str]]]:
    """Return names of columns, numbers to sort by, and texts: the objectives first, then the variables."""
    space, display, aims = progress.problem.space, progress.problem.machine.display, progress.problem.objectives
    designs = [] if progress.genes is None else space.values(progress.genes).tolist()
    values, texts = [], []
    for objectives, design in zip(progress.objectives, designs, strict=True):
        values.append([*objectives, *design])
        goals = [display.number(value, aim.term.unit) for value, aim in zip(objectives, aims, strict=True)]
        sizes = [v.in_words(size, display) for v, size in zip(space.searched, design, strict=True)]
        texts.append([*goals, *sizes])
    names = [spoken(variable.name.removeprefix("geometry.")) for variable in space.searched]
    return [*(f"{aim.goal} {progress.label(aim)}" for aim in aims), *names], values, texts
