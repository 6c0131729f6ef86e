"""The left of the design tab: a form in which a study is written, new or from a bundled or uploaded one.

The form edits the tables of a `Draft` in place and is built again whenever a row is added or removed.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, TypeAlias

from nicegui import events, ui

from kinetostat.equilibrium.state import state_of
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import find, values
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import Quantity
from kinetostat.studies.bundled import bundled_studies
from kinetostat.studies.optimisation.terms import known_terms, usual_goal
from kinetostat.studio.controls import Control, controls
from kinetostat.studio.design.draft import (
    MOST_OBJECTIVES,
    Draft,
    bound_text,
    bundled_draft,
    needs_direction,
    sent_draft,
    usual_bounds,
)
from kinetostat.studio.elements import choice, icon_button, upload_field
from kinetostat.studio.processes import check_upload
from kinetostat.studio.session import Session
from kinetostat.studio.wording import full_label

Change: TypeAlias = events.ValueChangeEventArguments[Any]

NEW, SENT = "new", "sent"
"""Choices of a study besides the names of bundled ones: a new study, and one from a file."""
METHODS = {1: ["genetic", "gradient", "hybrid"], 2: ["nsga2"]}
"""Methods of search by the number of objectives, the usual one first."""
BOUNDS = {"at_least": "at least", "at_most": "at most"}
POSES = "x=-2 cm:2 cm:5, y=-2 cm:2 cm:5"
ABOUT_POSES = "from, to and number of each coordinate; empty for the pose of the machine alone; the worst pose counts"
ABOUT_WITHIN = "of the ranges, only poses that lie in the workspace of the machine as its file says"
GOALS = {"minimize": "minimise", "maximize": "maximise"}


class StudyForm:
    """Variables, objectives, constraints, poses and the search; other tables of a study are carried along and named."""

    def __init__(self, session: Session, start: Callable[[Draft], None]) -> None:
        """Build the form, with a new study for the machine of the session.

        Args:
            session: the session whose machine a new study is about.
            start: starts a study; raises InputError where it cannot.
        """
        self._session, self._start = session, start
        self.draft = self._blank()
        self._filling = False
        with ui.element("div").classes("design-head"):
            self.source = choice({}, "study", self._choose, "study-source").classes("grow")
            icon_button("upload_file", "Open a study file", lambda: self.upload.run_method("pickFiles"), "study-open")
            icon_button("download", "Save the study as a file", self._save, "study-save")
            self.upload = upload_field(self._take_file, self._refuse, "study-upload")
        self._body = ui.element("div").classes("design-form")
        with ui.element("div").classes("design-foot"):
            self.problem = ui.label("").classes("form-problem").props('role="alert"').mark("study-problem")
            ui.button("Start", icon="play_arrow", on_click=self._begin).props(
                "unelevated no-caps text-color=accent-ink"
            ).mark("study-start")
        self._offer_studies(NEW)
        self._fill()

    @property
    def _machine(self) -> Machine:
        return self.draft.machine or self._session.machine

    def _blank(self) -> Draft:
        return Draft(f"{self._session.machine.name}"[:60] + ", stiffer")

    def renew(self) -> None:
        """Begin again after another machine has been loaded, unless the study is about a machine that it names."""
        if self.draft.machine is None:
            self.draft = self._blank()
            self._offer_studies(NEW)
            self._fill()

    def _offer_studies(self, chosen: str) -> None:
        """List the studies to choose from; `chosen` is the one in the form."""
        self._filling = True
        studies = {NEW: "new study of this machine", **{name: name for name in bundled_studies()}}
        self.source.set_options(studies | ({SENT: self.draft.name} if chosen == SENT else {}), value=chosen)
        self._filling = False

    def _choose(self) -> None:
        if not self._filling and self.source.value != SENT:
            name = str(self.source.value)
            self.draft = self._blank() if name == NEW else bundled_draft(name)
            self._offer_studies(name)
            self._fill()

    async def _take_file(self, event: events.UploadEventArguments) -> None:
        """Show the study of a file that the browser has sent, once a process has found that it can be read."""
        data = await event.file.read()
        try:
            await check_upload("study", data, event.file.name, self.upload.client.id)
            self.draft = sent_draft(data, event.file.name, self._session.machine)
        except InputError as error:
            self._refuse(str(error))
        else:
            self._offer_studies(SENT)
            self._fill()
        self.upload.reset()

    def _save(self) -> None:
        try:
            name, content = self.draft.as_file(self._session.machine)
        except InputError as error:
            self._refuse(str(error))
            return
        self._refuse("")
        ui.download(content, name, "application/toml")

    def _begin(self) -> None:
        try:
            self._start(self.draft)
        except InputError as error:
            self._refuse(str(error))
        else:
            self._refuse("")

    def _refuse(self, message: str) -> None:
        self.problem.set_text(message)

    def _fill(self) -> None:
        self._refuse("")
        self._body.clear()
        with self._body:
            ui.label(f"Machine: {self._machine.name}").classes("form-about").mark("study-about")
            ui.html("<h3>Variables</h3>", sanitize=False)
            machine_controls = self._controls()
            for place, table in enumerate(self.draft.variables):
                self._variable(place, table, machine_controls)
            self._more_variables(machine_controls)
            ui.html("<h3>Objectives</h3>", sanitize=False)
            for place, table in enumerate(self.draft.objectives):
                self._objective(place, table)
            if len(self.draft.objectives) < MOST_OBJECTIVES:
                self._add_button("add an objective", "study-add-objective", self._add_objective)
            ui.html("<h3>Constraints</h3>", sanitize=False)
            for place, table in enumerate(self.draft.constraints):
                self._constraint(place, table)
            self._add_button("add a constraint", "study-add-constraint", self._add_constraint)
            ui.html("<h3>Poses</h3>", sanitize=False)
            self._poses()
            ui.html("<h3>Search</h3>", sanitize=False)
            self._search()
            if hidden := self.draft.hidden_parts():
                ui.label(f"Taken over from the study file: {', '.join(hidden)}.").classes("note").mark("study-unseen")

    @staticmethod
    def _add_button(text: str, mark: str, action: Callable[[], None]) -> None:
        ui.button(text, icon="add", on_click=action).props("flat dense no-caps").classes("form-add").mark(mark)

    def _controls(self) -> dict[str, Control]:
        """Return the controls of the machine that the study is about."""
        machine = self.draft.machine
        if machine is None:
            return self._session.controls
        length = float(state_of(machine).configuration.length)
        return {control.path: control for control in controls(machine, length)}

    def _variable(self, place: int, table: dict[str, Any], known: dict[str, Control]) -> None:
        paths = _paths_of(table)
        parameter = find(self._machine.family, paths[0])
        control = known.get(parameter.path)
        title = (full_label(control.parameter) if control else paths[0]) + (" and others" if paths[1:] else "")
        with ui.element("div").classes("form-row"):
            ui.label(title).classes("form-name").tooltip(", ".join(paths))
            if "choices" in table:
                ui.label(", ".join(table.get("labels", [f"{len(table['choices'])} choices"]))).classes("form-fixed")
            elif table.get("fixed"):
                ui.label("fixed, with a tolerance").classes("form-fixed")
            else:
                for key in ("from", "to"):
                    self._bound(table, key, parameter.quantity, f"{title}, {key}", f"variable {place} {key}")
            drop = partial(self._drop, self.draft.variables, place)
            self._remove(drop, f"Remove {title}", f"variable {place} remove")

    def _bound(self, table: dict[str, Any], key: str, quantity: Quantity, label: str, mark: str) -> None:
        first = str(table.get(key, ""))

        def write(event: Change) -> None:
            table[key] = bound_text(quantity, str(event.value), first.partition(" ")[2])

        box = ui.input(value=first, on_change=write).props(f'dense borderless aria-label="{label}"')
        box.classes("form-text").mark(mark)

    def _remove(self, action: Callable[[], None], text: str, mark: str) -> None:
        icon_button("close", text, action, mark).props('size="sm"').classes("form-remove")

    def _drop(self, tables: list[dict[str, Any]], place: int) -> None:
        del tables[place]
        self._drop_other_method()
        self._fill()

    def _more_variables(self, known: dict[str, Control]) -> None:
        """Offer the other numbers of the machine; loads and limits are not part of a design."""
        written = [path for table in self.draft.variables for path in _paths_of(table)]
        used_paths = {find(self._machine.family, path).path for path in written}
        free = [c for path, c in known.items() if c.slides and path not in used_paths and c.panel != "Load"]
        offered = {control.path: full_label(control.parameter) for control in free if not control.joined}
        if offered:
            add = choice(offered, "add a variable", self._add_variable, "study-add-variable", searchable=True)
            add.classes("form-more")

    def _add_variable(self, event: Change) -> None:
        control = self._controls().get(str(event.value))
        if control is not None:
            value = float(values(self._machine)[control.parameter.leaves[0]])
            low, high = usual_bounds(control, value)
            self.draft.variables.append({"path": control.path, "from": low, "to": high})
            self._fill()

    def _objective(self, place: int, table: dict[str, Any]) -> None:
        name = str(table["quantity"])
        terms = known_terms(self._machine)
        with ui.element("div").classes("form-aim"):
            usual = usual_goal(name)
            if usual is None:  # a study must then say which: the form shows and writes the first
                table.setdefault("goal", "minimize")
            goal = ui.select(GOALS, value=table.get("goal") or usual, on_change=partial(self._write_aim, table, "goal"))
            goal.props('dense options-dense outlined aria-label="goal"').classes("field").mark(
                f"objective {place} goal"
            )
            self._quantity(table, terms, "objective", place)
            if len(self.draft.objectives) > 1:
                self._remove(partial(self._drop, self.draft.objectives, place), "Remove", f"objective {place} remove")
        self._direction(table, "objective", place)

    def _quantity(self, table: dict[str, Any], terms: list[str], what: str, place: int) -> None:
        box = ui.select(
            terms, value=str(table["quantity"]), with_input=True, on_change=partial(self._write_aim, table, "quantity")
        )
        box.props(f'dense options-dense outlined aria-label="{what}"').classes("field grow")
        box.mark(f"{what} {place} quantity")

    def _direction(self, table: dict[str, Any], what: str, place: int) -> None:
        if needs_direction(str(table["quantity"])):
            with ui.element("div").classes("form-row"):
                ui.label("direction x, y, z").classes("form-name")
                direction = ", ".join(f"{entry:g}" for entry in table.get("direction") or ())
                box = ui.input(value=direction, on_change=partial(self._write_direction, table)).classes(
                    "form-text wide"
                )
                box.props('dense borderless aria-label="direction"').mark(f"{what} {place} direction")

    def _constraint(self, place: int, table: dict[str, Any]) -> None:
        """A quantity and its bound, which is typed with its unit, as in a file."""
        with ui.element("div").classes("form-aim"):
            self._quantity(table, known_terms(self._machine), "constraint", place)
            drop = partial(self._drop, self.draft.constraints, place)
            self._remove(drop, "Remove", f"constraint {place} remove")
        self._direction(table, "constraint", place)
        with ui.element("div").classes("form-aim"):
            key = next(key for key in BOUNDS if key in table)
            side = ui.select(BOUNDS, value=key, on_change=partial(self._change_side, table))
            side.props('dense options-dense outlined aria-label="side"').classes("field")
            side.mark(f"constraint {place} side")
            box = ui.input(value=str(table[key]), on_change=partial(self._write_bound, table))
            box.props('dense borderless aria-label="bound"').classes("form-text wide").mark(f"constraint {place} bound")

    @staticmethod
    def _change_side(table: dict[str, Any], event: Change) -> None:
        """Make an upper bound of a lower one, or the other way."""
        former = next(key for key in BOUNDS if key in table)
        table[str(event.value)] = table.pop(former)

    @staticmethod
    def _write_bound(table: dict[str, Any], event: Change) -> None:
        table[next(key for key in BOUNDS if key in table)] = _number(str(event.value))

    def _add_constraint(self) -> None:
        self.draft.constraints.append({"quantity": "singularity_margin", "at_least": 0.1})
        self._fill()

    def _poses(self) -> None:
        """The grid of poses at which designs are judged; empty for the pose of the machine alone."""
        box = ui.input("ranges", value=", ".join(self.draft.poses.get("over", [])), placeholder=POSES)
        box.props("dense outlined stack-label").classes("field").mark("study-poses").tooltip(ABOUT_POSES)
        box.on_value_change(self._write_ranges)
        within = ui.checkbox("only those in the workspace", value="within" in self.draft.poses)
        within.props("dense").mark("study-within").tooltip(ABOUT_WITHIN).on_value_change(self._write_within)
        if listed := self.draft.poses.get("list"):
            text = f"The study lists {len(listed)} poses one by one, which are edited in its file."
            ui.label(f"{text} Ranges take their place.").classes("note").mark("study-listed")

    def _write_within(self, event: Change) -> None:
        if event.value:
            self.draft.poses["within"] = "workspace"
        else:
            self.draft.poses.pop("within", None)

    def _write_ranges(self, event: Change) -> None:
        ranges = [part.strip() for part in str(event.value).split(",") if part.strip()]
        self.draft.poses.pop("over", None)
        if ranges:
            self.draft.poses.pop("list", None)
            self.draft.poses["over"] = ranges

    def _write_aim(self, table: dict[str, Any], key: str, event: Change) -> None:
        """Write the goal or the quantity of an objective or a constraint."""
        if not event.value:
            return
        table[key] = event.value
        if key == "quantity":
            for former in ("goal", "weights", "direction"):  # they belonged to the former quantity
                table.pop(former, None)
            if needs_direction(str(event.value)):
                table["direction"] = [0.0, 0.0, 1.0]
            self._fill()

    @staticmethod
    def _write_direction(table: dict[str, Any], event: Change) -> None:
        parts = [part for part in str(event.value).replace(",", " ").split() if part]
        table["direction"] = [_number(part) for part in parts]

    def _add_objective(self) -> None:
        used_quantities = {table["quantity"] for table in self.draft.objectives}
        usual = (
            name
            for name in ("compliance_z", "compliance_sum", *known_terms(self._machine))
            if name not in used_quantities
        )
        self.draft.objectives.append({"quantity": next(usual)})
        self._drop_other_method()
        self._fill()

    def _methods(self) -> list[str]:
        return METHODS[min(len(self.draft.objectives), 2)]

    def _drop_other_method(self) -> None:
        """Forget the method of the search if it is not one for so many objectives."""
        if self.draft.optimizer.get("method") not in self._methods():
            self.draft.optimizer.pop("method", None)

    def _search(self) -> None:
        search, methods = self.draft.optimizer, self._methods()
        with ui.element("div").classes("form-search"):
            method = search.get("method") or methods[0]
            choice(methods, "method", lambda event: search.update(method=event.value), "study-method", method)
            for key in ("population", "generations", "seed"):
                box = ui.input(key, value=str(search[key]), on_change=partial(self._write_number, key))
                box.props("dense outlined").classes("field").mark(f"study-{key}")

    def _write_number(self, key: str, event: Change) -> None:
        self.draft.optimizer[key] = _number(str(event.value))


def _number(text: str) -> int | float | str:
    """Return a number, or the text itself if it is none: reading the study then refuses it with the proper message."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _paths_of(variable: dict[str, Any]) -> list[str]:
    """Return the fields that a variable changes, as its table names them: one, or several that are tied together."""
    return [str(path) for path in variable.get("paths") or [variable["path"]]]
