"""Searches on the page: their list, and of one search its progress, plot, Pareto front, result, stop and resume.

`runs` starts and stops processes, `progress` reads their folders; the panel looks at them twice a second, in a thread.
A design is named by its place in the front, sorted by the first objective.
"""

from collections.abc import Callable, Sequence

from nicegui import ui
from nicegui.events import GenericEventArguments

from kinetostat.display import Scale
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.quantities import plain_name
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studio.design.progress import Follower, SearchState, failure
from kinetostat.studio.design.runs import UNREADABLE, Run, Runs, Stage
from kinetostat.studio.design.texts import result_text
from kinetostat.studio.elements import (
    MAIN_BUTTON,
    CurveView,
    DesignTable,
    FrontView,
    choice,
    confirm,
    icon_button,
    refuse,
)
from kinetostat.studio.lanes import Lane
from kinetostat.studio.wording import paragraph

NOTHING = "No search has been started yet. Choose variables and objectives of the study, then start it."
DAMAGED = 'Search {} cannot be shown, because its folder "{}" is damaged: {}. The other searches are not affected.'
NO_FRONT = "A study with two to four objectives ends in a Pareto front; its designs will be listed here."
LOOK_PERIOD = 0.5
"""Seconds between two looks at a search: it seems to move, and reading takes milliseconds."""
NO_COLOUR = -1
"""The choice of no objective for the colour of a front."""


@dataclass(frozen=True)
class ProgressRequest:
    """A request for the list of searches and for the progress of one of them.

    Attributes:
        number: the number of the search; 0 for the latest.
        follower: the reader of the search shown last, which has read a part of its records already.
    """

    number: int
    follower: Follower | None


@dataclass(frozen=True)
class Searches:
    """All searches, and the progress of one or the reason why it cannot be shown."""

    runs: list[Run]
    follower: Follower | None = None
    progress: SearchState | None = None
    problem: str = ""


class RunPanel:
    """The list of searches, and one of them in front with its progress, plot and result."""

    def __init__(self, runs: Runs, load: Callable[[Machine], None]) -> None:
        """Build the panel without the result, for which `place_result` makes a place.

        Args:
            runs: searches of the server.
            load: takes a machine into the session.
        """
        self._runs, self._load = runs, load
        self._lane = Lane(self._read_searches, self._deliver)
        self._follower: Follower | None = None
        self._progress: SearchState | None = None
        self._shown_state: object = None  # what the page shows of a search; nothing is drawn again while it is equal
        self._loaded_place: int | None = None  # place in the front of the design that was loaded last
        with ui.element("div").classes("design-head"):
            self.choice = choice({}, "search", self._choose, "run-choice").classes("grow")
            self.stop = icon_button("stop", "Stop after this step; all results are kept", self._stop, "run-stop")
            self.resume = icon_button("play_arrow", "Resume where it was stopped", self._resume, "run-play_arrow")
            self.delete = icon_button("delete", "Delete this search", self._delete, "run-delete")
        self.bar = ui.linear_progress(0.0, show_value=False, size="4px").props('aria-label="progress"').mark("run-bar")
        self.line = ui.label("").classes("run-line").props('role="status"').mark("run-line")
        self.curve = CurveView("objective of the best design and mean of all, over the steps").mark("run-curve")
        self.front = FrontPanel(self._load_design)
        self.timer = ui.timer(LOOK_PERIOD, self.refresh, active=False)

    def place_result(self) -> None:
        """Make the place of the result; the table of the front must have its place already."""
        with ui.element("div").classes("design-head"):
            self.best = ui.button("Load the best design", icon="input", on_click=self._load_best)
            self.best.props(MAIN_BUTTON).mark("run-load")
        self.text = ui.html(paragraph(NOTHING), sanitize=False).mark("run-result")
        self._offer(None)

    def refresh(self) -> None:
        """Request the progress of the search in front."""
        self._lane.ask(ProgressRequest(int(self.choice.value or 0), self._follower))

    def follow(self, run: Run) -> None:
        """Bring a search that has just been started to the front."""
        self._list([run, *(other for other in self._runs.entries() if other.number != run.number)], run.number)
        self.refresh()

    def close(self) -> None:
        """Stop looking; the searches go on."""
        self.timer.deactivate()
        self._lane.close()

    def _read_searches(self, request: ProgressRequest) -> Searches:
        """Read the list of searches and the progress of one of them, in a thread."""
        runs = self._runs.entries()
        number = request.number or (runs[0].number if runs else 0)
        run = next((listed for listed in runs if listed.number == number), None)
        if run is None:
            return Searches(runs)
        try:
            former = request.follower
            follower = former if former is not None and former.number == number else Follower(run)
            return Searches(runs, follower, follower.progress(run), failure(run))
        except InputError as error:
            return Searches(runs, problem=str(error))
        except UNREADABLE as error:
            if not run.folder.exists():
                return Searches(runs)  # deleted while it was read
            return Searches(runs, problem=DAMAGED.format(run.number, run.folder, error))

    def _deliver(self, request: ProgressRequest, searches: Searches) -> None:
        """Show what was read if it is new, unless another search has been chosen meanwhile."""
        if request.number != int(self.choice.value or 0):
            self.refresh()
            return
        progress = searches.progress
        self._list(searches.runs, progress.run.number if progress else request.number)
        self._follower, self._progress = searches.follower, progress
        state = progress and (progress.run, progress.steps, progress.result is None, searches.problem)
        if state is not None and state == self._shown_state:
            return
        self._shown_state = state
        self._offer(progress)
        if progress is None:
            self.line.set_text(searches.problem)
            self.bar.set_value(0.0)
            self.text.set_content(paragraph(searches.problem or NOTHING))
            return
        self.bar.set_value(progress.steps / progress.total)
        self.line.set_text(_status_line(progress))
        self._draw(progress)
        self.text.set_content(paragraph(searches.problem, "lead") if searches.problem else result_text(progress))

    def _list(self, runs: list[Run], number: int) -> None:
        """List the searches to choose from, this one or else the latest in front."""
        options = {run.number: f"{run.number} · {run.name} · {run.stage}" for run in runs}
        chosen = number if number in options else next(iter(options), None)
        if options != self.choice.options or chosen != self.choice.value:
            self.choice.set_options(options, value=chosen)

    def _offer(self, progress: SearchState | None) -> None:
        """Enable what can be done with a search in this stage."""
        stage = progress.run.stage if progress else None
        several = progress is not None and len(progress.problem.objectives) > 1
        self.stop.set_enabled(stage is Stage.RUNNING)
        self.resume.set_enabled(stage in (Stage.STOPPED, Stage.FAILED))
        self.delete.set_enabled(stage is not None and not stage.active)
        self.best.set_enabled(progress is not None and bool(progress.objectives))
        self.best.set_text("Load the knee" if several else "Load the best design")
        self.curve.set_visibility(progress is not None and not several)
        self.front.reveal(several)

    def _draw(self, progress: SearchState) -> None:
        if len(progress.problem.objectives) > 1:
            self.front.show(progress, self._loaded_place)
        elif progress.steps:
            self.curve.run_method("show", convergence(progress))

    def _choose(self) -> None:
        self._loaded_place = None
        self.refresh()

    def _load_best(self) -> None:
        if self._progress is not None:
            self._load_design(self._progress.knee)

    def _load_design(self, place: int) -> None:
        if self._progress is not None and 0 <= place < len(self._progress.objectives):
            self._loaded_place = place
            self._load(self._progress.design(place))
            if len(self._progress.problem.objectives) > 1:
                self._draw(self._progress)

    def _stop(self) -> None:
        self._attempt(self._runs.stop)

    def _resume(self) -> None:
        self._attempt(lambda number: self._runs.resume(number, self.choice.client.id))

    def _delete(self) -> None:
        confirm(f"Delete search {self.choice.value} and all its designs?", lambda: self._attempt(self._forget))

    def _forget(self, number: int) -> None:
        self._runs.delete(number)
        self._follower = None
        self.choice.set_value(None)

    def _attempt(self, action: Callable[[int], None]) -> None:
        """Do something with the search in front; a refusal is shown as a message."""
        try:
            action(int(self.choice.value or 0))
        except InputError as error:
            refuse(str(error))
        self.refresh()


def convergence(progress: SearchState) -> dict[str, object]:
    """Return the only objective over the steps, best and mean, as `CurveView` draws it: in the units of the machine."""
    objective = progress.problem.objectives[0]
    factor = progress.scale(objective).factor
    lines = {"best": progress.best, "mean": progress.mean}
    return {
        "x": list(range(1, progress.steps + 1)),
        "lines": [
            {"name": name, "values": [None if value is None else value * factor for value in values]}
            for name, values in lines.items()
        ],
        "label": {"x": "step", "y": progress.label(objective)},
        "unit": "",
        "here": None,
        "log": False,
        "signed": True,
    }


def _status_line(progress: SearchState) -> str:
    """Say in a line how far a search is, and how good its best design."""
    work = str(progress.run.stage)
    if progress.run.stage is Stage.RUNNING and not progress.steps:
        work = f"{work}, preparing its program"
    elif progress.run.stage is Stage.RUNNING and progress.steps == progress.total:
        work = f"{work}, explaining the best design"
    line = f"{work}: {progress.steps} of {progress.total} steps, {progress.designs:,} designs"
    best = progress.best[-1] if progress.best else None
    return line if best is None else f"{line}, best {progress.exact(progress.problem.objectives[0], best)}"


class FrontPanel:
    """The plot of a front over any two of its objectives, and its table."""

    def __init__(self, pick: Callable[[int], None]) -> None:
        """Build the plot and the choice of its axes; `table` builds the table elsewhere on the page.

        Args:
            pick: called with the place of the design that was clicked.
        """
        self._pick = pick
        self._progress: SearchState | None = None
        self._chosen: int | None = None
        self._is_users_choice = False  # whether a change of an axis is the designer's; those of `_offer` are not
        with ui.element("div").classes("front-plot") as self.plot:
            with ui.row().classes("panel-tools") as self.tools:
                self.across = choice({}, "horizontal axis", self._change_axis, "front-across")
                self.up = choice({}, "vertical axis", self._change_axis, "front-up")
                self.coloured = choice({}, "colour", self._change_axis, "front-colour")
            self.view = FrontView("designs of the Pareto front; a click, or arrow keys and Enter, load one")
            self.view.mark("run-front").on("pick", self._pick_row)

    def table(self) -> None:
        """Put the table of all designs on the page."""
        self.no_front = ui.label(NO_FRONT).classes("note")
        self.rows = DesignTable("designs of the Pareto front").mark("front-table")
        self.rows.on("pick", self._pick_row)

    def reveal(self, several: bool) -> None:
        """Show plot and table where the study has several objectives, else hide them."""
        self.plot.set_visibility(several)
        self.rows.set_visibility(several)
        self.no_front.set_visibility(not several)

    def show(self, progress: SearchState, chosen: int | None) -> None:
        """Show the front of a search with several objectives; `chosen` is the place of the design that was loaded."""
        self._progress, self._chosen = progress, chosen
        names = {k: objective.term.label for k, objective in enumerate(progress.problem.objectives)}
        if self.across.options != names:
            self._offer(names)
        self._draw()
        self.rows.show_rows(*_columns(progress), progress.knee, chosen)

    def _offer(self, names: dict[int, str]) -> None:
        """Offer the objectives as axes and colour; with only two, the choice is hidden."""
        self._is_users_choice = False
        self.tools.set_visibility(len(names) > 2)
        self.across.set_options(names, value=0)
        self.up.set_options(names, value=1)
        self.coloured.set_options({NO_COLOUR: "none", **names}, value=2 if len(names) > 2 else NO_COLOUR)
        self._is_users_choice = True

    def _change_axis(self) -> None:
        if self._is_users_choice:
            self._draw()

    def _draw(self) -> None:
        progress = self._progress
        if progress is None:
            return
        initial = list(progress.result["initial"]["objectives"].values()) if progress.result else []
        scales = [progress.scale(objective) for objective in progress.problem.objectives]
        self.view.run_method(
            "show",
            {
                "points": [_in_units(point, scales) for point in progress.objectives],
                "axes": [self.across.value, self.up.value],
                "coloured": None if self.coloured.value == NO_COLOUR else self.coloured.value,
                "labels": [progress.label(objective) for objective in progress.problem.objectives],
                "knee": progress.knee,
                "initial": _in_units(initial, scales) if initial and None not in initial else None,
                "chosen": self._chosen,
            },
        )

    def _pick_row(self, event: GenericEventArguments) -> None:
        self._pick(int(event.args))


def _in_units(values: Sequence[float], scales: Sequence[Scale]) -> list[float]:
    return [value * scale.factor for value, scale in zip(values, scales, strict=True)]


def _columns(progress: SearchState) -> tuple[list[str], list[list[float]], list[list[str]]]:
    """Return the names of the columns, and of each design numbers to sort by and texts: objectives, then variables."""
    space, display, aims = progress.problem.space, progress.problem.machine.display, progress.problem.objectives
    designs = [] if progress.genes is None else space.values(progress.genes).tolist()
    values, texts = [], []
    for objectives, design in zip(progress.objectives, designs, strict=True):
        values.append([*objectives, *design])
        goal_texts = [display.number(value, aim.term.unit) for value, aim in zip(objectives, aims, strict=True)]
        pairs = zip(space.searched_variables, design, strict=True)
        texts.append([*goal_texts, *(variable.in_words(size, display) for variable, size in pairs)])
    names = [plain_name(variable.name.removeprefix("geometry.")) for variable in space.searched_variables]
    return [*(f"{aim.goal} {progress.label(aim)}" for aim in aims), *names], values, texts
