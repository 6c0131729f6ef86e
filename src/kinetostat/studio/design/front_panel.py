"""A Pareto front on the page: two objectives as a plot, a third one as colour, and all of its designs as a table."""

from collections.abc import Callable

from nicegui import ui
from nicegui.events import GenericEventArguments

from kinetostat.studio.design.progress import Progress
from kinetostat.studio.elements import DesignTable, FrontView
from kinetostat.studio.wording import shown
from kinetostat.views.display import spoken

NONE = -1
"""The choice of no objective for the colour."""
DIGITS = 5
NO_FRONT = "A search for two to four objectives ends in a front; its designs are listed here."


class FrontPanel:
    """The designs of a front that can be looked at from any two of its objectives; a click takes one."""

    def __init__(self, pick: Callable[[int], None]) -> None:
        """The plot and the choice of its axes; the table has a place of its own.

        Args:
            pick: told the number of a design, by the first objective, that is wanted.
        """
        self._pick = pick
        self._progress: Progress | None = None
        self._chosen: int | None = None
        self._asking = False
        with ui.element("div").classes("front-plot") as self.plot:
            with ui.row().classes("panel-tools") as self.tools:
                self.across, self.up, self.coloured = (self._choice(what) for what in ("across", "up", "colour"))
            self.view = FrontView("designs that no other beats; arrow keys and Enter, or a click, load one")
            self.view.mark("run-front").on("pick", self._picked)

    def _choice(self, what: str) -> ui.select:
        choice = ui.select({}, label=what, on_change=self._chosen_axis).mark(f"front-{what}")
        return choice.props("dense options-dense outlined").classes("field")

    def table(self) -> None:
        """Put the table of all designs on the page."""
        self.without = ui.label(NO_FRONT).classes("note")
        self.rows = DesignTable("designs that no other beats").mark("front-table")
        self.rows.on("pick", self._picked)

    def reveal(self, several: bool) -> None:
        """Make room for a front, or take it away where there is but one objective."""
        self.plot.set_visibility(several)
        self.rows.set_visibility(several)
        self.without.set_visibility(not several)

    def show(self, progress: Progress, chosen: int | None) -> None:
        """Show the front of a search with several objectives; `chosen` is the design that was loaded."""
        self._progress, self._chosen = progress, chosen
        names = {k: one.term.label for k, one in enumerate(progress.problem.objectives)}
        if self.across.options != names:
            self._offer(names)
        self._draw()
        self.rows.put(*_table(progress), progress.knee, chosen)

    def _offer(self, names: dict[int, str]) -> None:
        """Axes and colour among other objectives; the choice is worth its place from three on."""
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
        self.view.run_method(
            "show",
            {
                "points": progress.objectives,
                "axes": [self.across.value, self.up.value],
                "coloured": None if self.coloured.value == NONE else self.coloured.value,
                "labels": [axis_label(one.term.label, one.term.unit) for one in progress.problem.objectives],
                "knee": progress.knee,
                "initial": initial if initial and None not in initial else None,
                "chosen": self._chosen,
            },
        )

    def _picked(self, event: GenericEventArguments) -> None:
        self._pick(int(event.args))


def axis_label(label: str, unit: str) -> str:
    """What an axis says."""
    return label if unit == "1" else f"{label} ({unit})"


def _table(progress: Progress) -> tuple[list[str], list[list[float]], list[list[str]]]:
    """Names of the columns, numbers to sort by, and texts: objectives first, then what makes the design."""
    space = progress.problem.space
    goals = [f"{one.goal} {axis_label(spoken(one.term.label), one.term.unit)}" for one in progress.problem.objectives]
    designs = [] if progress.genes is None else space.values(progress.genes).tolist()
    values, texts = [], []
    for worth, design in zip(progress.objectives, designs, strict=True):
        values.append([*worth, *design])
        held = zip(space.searched, design, strict=True)
        sizes = [one.shown(size) if one.choices is not None else shown(one.quantity, size) for one, size in held]
        texts.append([*(f"{value:.{DIGITS}g}" for value in worth), *sizes])
    names = [spoken(variable.name.removeprefix("geometry.")) for variable in space.searched]
    return [*goals, *names], values, texts
