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
from kinetostat.spec.errors import InputError, cut
from kinetostat.spec.fields import Quantity
from kinetostat.studies.bundled import bundled_studies
from kinetostat.studies.optimisation.terms import known_terms, usual_goal
from kinetostat.studio.controls import Control, controls
from kinetostat.studio.design.draft import (
    MOST_OBJECTIVES,
    SEARCH_KEYS,
    Draft,
    StudyTable,
    bound_text,
    bundled_draft,
    needs_direction,
    sent_draft,
    usual_bounds,
)
from kinetostat.studio.elements import MAIN_BUTTON, choice, icon_button, in_quotes, upload_field
from kinetostat.studio.processes import check_upload
from kinetostat.studio.session import Session
from kinetostat.studio.wording import full_label, heading

Change: TypeAlias = events.ValueChangeEventArguments[Any]

NEW, SENT = "new", "sent"
"""Choices of a study besides the names of bundled ones: a new study, and one from a file."""
GOALS = {"minimize": "minimise", "maximize": "maximise"}
"""Goals of an objective: the word of a study file, and the one that the form shows."""
SIDES = {"at_least": "at least", "at_most": "at most"}
"""Keys of the bound of a constraint, of which its table has one, and the words that the form shows."""
METHODS_OF_ONE, METHODS_OF_SEVERAL = ["genetic", "gradient", "hybrid"], ["nsga2"]
"""Methods of search for one objective and for several, the usual one first."""
FIRST_OBJECTIVES = ("compliance_z", "compliance_sum")
"""Objectives that are added first: designers ask most often for stiffness along z and in all directions."""
FIRST_CONSTRAINT = {"quantity": "singularity_margin", "at_least": 0.1}
"""The constraint that is added: a search for stiffness alone often ends beside a singular pose, whose margin is 0."""
EXAMPLE_RANGES = "x=-2 cm:2 cm:5, y=-2 cm:2 cm:5"
RANGES_HINT = "from, to and number of each coordinate; empty for the pose of the machine alone; the worst pose counts"
WITHIN_HINT = "of the ranges, only poses that lie in the workspace of the machine as its file says"


class StudyForm:
    """Variables, objectives, constraints, poses and the search; other tables of a study are carried along and named."""

    def __init__(self, session: Session, start: Callable[[Draft], None]) -> None:
        """Build the form, with a new study for the machine of the session.

        Args:
            session: the session whose machine a new study is about.
            start: starts a study; raises InputError where it cannot.
        """
        self._session, self._start = session, start
        self.draft = self._new_draft()
        self._is_users_choice = False  # whether a change in the list of studies is the designer's
        with ui.element("div").classes("design-head"):
            self.source = choice({}, "study", self._choose, "study-source").classes("grow")
            icon_button("upload_file", "Open a study file", lambda: self.upload.run_method("pickFiles"), "study-open")
            icon_button("download", "Save the study as a file", self._save, "study-save")
            self.upload = upload_field(self._take_file, self._show_problem, "study-upload")
        self._body = ui.element("div").classes("design-form")
        with ui.element("div").classes("design-foot"):
            self.problem = ui.label("").classes("form-problem").props('role="alert"').mark("study-problem")
            start_button = ui.button("Start", icon="play_arrow", on_click=self._begin).mark("study-start")
            start_button.props(MAIN_BUTTON).props(remove="dense")  # it stands alone at the foot of the form
        self._offer_studies(NEW)
        self._fill()

    @property
    def _machine(self) -> Machine:
        return self.draft.machine or self._session.machine

    def _new_draft(self) -> Draft:
        return Draft(f"{cut(self._session.machine.name)}, stiffer")

    def renew(self) -> None:
        """Begin again after another machine has been loaded, unless the study is about a machine that it names."""
        if self.draft.machine is None:
            self._show(self._new_draft(), NEW)

    def _show(self, draft: Draft, source: str) -> None:
        """Show another draft; `source` is its choice in the list of studies."""
        self.draft = draft
        self._offer_studies(source)
        self._fill()

    def _offer_studies(self, source: str) -> None:
        """List the studies to choose from; `source` is the one in the form."""
        self._is_users_choice = False
        studies = {NEW: "new study of this machine", **{name: name for name in bundled_studies()}}
        self.source.set_options(studies | ({SENT: self.draft.name} if source == SENT else {}), value=source)
        self._is_users_choice = True

    def _choose(self) -> None:
        if self._is_users_choice and self.source.value != SENT:
            name = str(self.source.value)
            self._show(self._new_draft() if name == NEW else bundled_draft(name), name)

    async def _take_file(self, event: events.UploadEventArguments) -> None:
        """Show the study of a file that the browser has sent, once a process has found that it can be read."""
        data = await event.file.read()
        try:
            await check_upload("study", data, event.file.name, self.upload.client.id)
            draft = sent_draft(data, event.file.name, self._session.machine)
        except InputError as error:
            self._show_problem(str(error))
        else:
            self._show(draft, SENT)
        self.upload.reset()

    def _save(self) -> None:
        self._clear_problem()
        try:
            name, content = self.draft.as_file(self._session.machine)
        except InputError as error:
            self._show_problem(str(error))
        else:
            ui.download(content, name, "application/toml")

    def _begin(self) -> None:
        self._clear_problem()
        try:
            self._start(self.draft)
        except InputError as error:
            self._show_problem(str(error))

    def _show_problem(self, message: str) -> None:
        self.problem.set_text(message)

    def _clear_problem(self) -> None:
        self.problem.set_text("")

    def _fill(self) -> None:
        """Build the rows of the form again, as the tables of the draft are now."""
        self._clear_problem()
        self._body.clear()
        with self._body:
            ui.label(f"Machine: {self._machine.name}").classes("form-about").mark("study-about")
            self._variables()
            self._objectives()
            self._constraints()
            self._poses()
            self._search()
            if hidden := self.draft.hidden_parts():
                ui.label(f"Taken over from the study file: {', '.join(hidden)}.").classes("note").mark("study-unseen")

    def _variables(self) -> None:
        _heading("Variables")
        machine_controls = self._controls()
        for place, table in enumerate(self.draft.variables):
            self._variable(place, table, machine_controls)
        self._more_variables(machine_controls)

    def _objectives(self) -> None:
        _heading("Objectives")
        for place, table in enumerate(self.draft.objectives):
            self._objective(place, table)
        if len(self.draft.objectives) < MOST_OBJECTIVES:
            self._add_button("add an objective", "study-add-objective", self._add_objective)

    def _constraints(self) -> None:
        _heading("Constraints")
        for place, table in enumerate(self.draft.constraints):
            self._constraint(place, table)
        self._add_button("add a constraint", "study-add-constraint", self._add_constraint)

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

    def _variable(self, place: int, table: StudyTable, known: dict[str, Control]) -> None:
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
            self._remove_button(drop, f"Remove {title}", f"variable {place} remove")

    @staticmethod
    def _bound(table: StudyTable, key: str, quantity: Quantity, label: str, mark: str) -> None:
        """A field for the bound "from" or "to" of a variable; a bare number has the unit that the field shows first."""
        first = str(table.get(key, ""))

        def write(event: Change) -> None:
            table[key] = bound_text(quantity, str(event.value), first.partition(" ")[2])

        _text_field(first, label, write, mark)

    @staticmethod
    def _remove_button(action: Callable[[], None], text: str, mark: str) -> None:
        icon_button("close", text, action, mark).props('size="sm"').classes("form-remove")

    def _drop(self, tables: list[StudyTable], place: int) -> None:
        del tables[place]
        self._drop_unfit_method()
        self._fill()

    def _more_variables(self, known: dict[str, Control]) -> None:
        """Offer the other numbers of the machine; loads and limits are not part of a design."""
        written = [path for table in self.draft.variables for path in _paths_of(table)]
        used_paths = {find(self._machine.family, path).path for path in written}
        offered = {
            path: full_label(control.parameter)
            for path, control in known.items()
            if control.slides and not control.joined and control.panel != "Load" and path not in used_paths
        }
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

    def _objective(self, place: int, table: StudyTable) -> None:
        usual = usual_goal(str(table["quantity"]))
        if usual is None:  # a study must then say which: the form shows and writes the first
            table.setdefault("goal", "minimize")
        with ui.element("div").classes("form-aim"):
            write_goal = partial(self._write_goal, table)
            _list_field(GOALS, str(table.get("goal") or usual), "goal", write_goal, f"objective {place} goal")
            self._quantity(table, "objective", place)
            if len(self.draft.objectives) > 1:
                drop = partial(self._drop, self.draft.objectives, place)
                self._remove_button(drop, "Remove", f"objective {place} remove")
        self._direction(table, "objective", place)

    def _quantity(self, table: StudyTable, role: str, place: int) -> None:
        """A list of the quantities of an objective or a constraint, which is its `role`."""
        names, write = known_terms(self._machine), partial(self._write_quantity, table)
        _list_field(names, str(table["quantity"]), role, write, f"{role} {place} quantity", searchable=True).classes(
            "grow"
        )

    def _direction(self, table: StudyTable, role: str, place: int) -> None:
        """A field for the direction along or about which the quantity is taken, if it needs one."""
        if needs_direction(str(table["quantity"])):
            with ui.element("div").classes("form-row"):
                ui.label("direction x, y, z").classes("form-name")
                direction = ", ".join(f"{entry:g}" for entry in table.get("direction") or ())
                write = partial(self._write_direction, table)
                _text_field(direction, "direction", write, f"{role} {place} direction").classes("wide")

    def _constraint(self, place: int, table: StudyTable) -> None:
        """A quantity and its bound, which is typed with its unit, as in a file."""
        with ui.element("div").classes("form-aim"):
            self._quantity(table, "constraint", place)
            drop = partial(self._drop, self.draft.constraints, place)
            self._remove_button(drop, "Remove", f"constraint {place} remove")
        self._direction(table, "constraint", place)
        with ui.element("div").classes("form-aim"):
            side = _side_of(table)
            _list_field(SIDES, side, "side", partial(self._change_side, table), f"constraint {place} side")
            write = partial(self._write_bound, table)
            _text_field(str(table[side]), "bound", write, f"constraint {place} bound").classes("wide")

    @staticmethod
    def _change_side(table: StudyTable, event: Change) -> None:
        """Make an upper bound of a lower one, or the other way."""
        table[str(event.value)] = table.pop(_side_of(table))

    @staticmethod
    def _write_bound(table: StudyTable, event: Change) -> None:
        table[_side_of(table)] = _number(str(event.value))

    def _add_constraint(self) -> None:
        self.draft.constraints.append(dict(FIRST_CONSTRAINT))
        self._fill()

    def _poses(self) -> None:
        """The grid of poses at which designs are judged; empty for the pose of the machine alone."""
        _heading("Poses")
        ranges = ui.input("ranges", value=", ".join(self.draft.poses.get("over", [])), placeholder=EXAMPLE_RANGES)
        ranges.props("dense outlined stack-label").classes("field").mark("study-poses").tooltip(RANGES_HINT)
        ranges.on_value_change(self._write_ranges)
        within = ui.checkbox("only those in the workspace", value="within" in self.draft.poses)
        within.props("dense").mark("study-within").tooltip(WITHIN_HINT).on_value_change(self._write_within)
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

    @staticmethod
    def _write_goal(table: StudyTable, event: Change) -> None:
        if event.value:
            table["goal"] = event.value

    def _write_quantity(self, table: StudyTable, event: Change) -> None:
        """Write the quantity of an objective or a constraint; an emptied field is none and changes nothing."""
        if not event.value:
            return
        table["quantity"] = event.value
        for key in ("goal", "weights", "direction"):  # they belonged to the former quantity
            table.pop(key, None)
        if needs_direction(str(event.value)):
            table["direction"] = [0.0, 0.0, 1.0]
        self._fill()

    @staticmethod
    def _write_direction(table: StudyTable, event: Change) -> None:
        table["direction"] = [_number(part) for part in str(event.value).replace(",", " ").split()]

    def _add_objective(self) -> None:
        used_quantities = {table["quantity"] for table in self.draft.objectives}
        unused = (name for name in (*FIRST_OBJECTIVES, *known_terms(self._machine)) if name not in used_quantities)
        self.draft.objectives.append({"quantity": next(unused)})
        self._drop_unfit_method()
        self._fill()

    def _methods(self) -> list[str]:
        return METHODS_OF_SEVERAL if len(self.draft.objectives) > 1 else METHODS_OF_ONE

    def _drop_unfit_method(self) -> None:
        """Forget the method of the search if it is not one for as many objectives as there are now."""
        if self.draft.optimizer.get("method") not in self._methods():
            self.draft.optimizer.pop("method", None)

    def _search(self) -> None:
        _heading("Search")
        search, methods = self.draft.optimizer, self._methods()
        with ui.element("div").classes("form-search"):
            method = search.get("method") or methods[0]
            choice(methods, "method", lambda event: search.update(method=event.value), "study-method", method)
            for key in SEARCH_KEYS:
                number = ui.input(key, value=str(search[key]), on_change=partial(self._write_number, key))
                number.props("dense outlined").classes("field").mark(f"study-{key}")

    def _write_number(self, key: str, event: Change) -> None:
        self.draft.optimizer[key] = _number(str(event.value))


def _heading(text: str) -> None:
    ui.html(heading(text), sanitize=False)


def _list_field(
    options: dict[str, str] | list[str], value: str, label: str, write: Callable[[Change], None], mark: str,
    searchable: bool = False,
) -> ui.select:  # fmt: skip
    """Return a list to choose from, whose label is for screen readers alone."""
    field = ui.select(options, value=value, on_change=write, with_input=searchable)
    return field.props(f'dense options-dense outlined aria-label="{label}"').classes("field").mark(mark)


def _text_field(text: str, label: str, write: Callable[[Change], None], mark: str) -> ui.input:
    """Return a field for a text, whose label is for screen readers alone."""
    field = ui.input(value=text, on_change=write).props(f'dense borderless aria-label="{in_quotes(label)}"')
    return field.classes("form-text").mark(mark)


def _side_of(constraint: StudyTable) -> str:
    """Return the key of the bound of a constraint."""
    return next(key for key in SIDES if key in constraint)


def _number(text: str) -> int | float | str:
    """Return a number, or the text itself if it is none: reading the study then refuses it with the proper message."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _paths_of(variable: StudyTable) -> list[str]:
    """Return the fields that a variable changes, as its table names them: one, or several that are tied together."""
    return [str(path) for path in variable.get("paths") or [variable["path"]]]
