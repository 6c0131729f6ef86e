"""The analysis as tables: matrices K and C, indices of the pose, loads in the springs, verdicts on requirements.

Tables are HTML made of an `Analysis`; nothing is computed but the rounding of its numbers. Requirements have a button
that goes to the worst pose.
"""

from collections.abc import Sequence
from functools import partial

from nicegui import ui

from kinetostat.arrays import Array
from kinetostat.display import DASH, Display
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.requirements import Verdict, requirements
from kinetostat.studies.under_load import LoadedState
from kinetostat.studio.answers import Report
from kinetostat.studio.elements import refuse, toggle
from kinetostat.studio.lanes import Lane
from kinetostat.studio.panels import Panel
from kinetostat.studio.session import Session
from kinetostat.studio.wording import bars, engineering, entry, heading, paragraph, table, titled_table
from kinetostat.units import component_units, load_unit, motion_unit
from kinetostat.views.analysis_tables import actuator_table, entry_unit, matrix_units
from kinetostat.views.loaded import (
    actuator_sentence,
    named_leg_springs,
    sag_sentence,
    springs_or_kinds_table,
    stability_of,
    tangent_table,
)
from kinetostat.views.report.content import as_table
from kinetostat.views.tables import headline, requirement_lines

MATRIX_NAMES = {"C": "compliance", "K": "stiffness"}
"""Matrices by the letter on their button."""
PRINCIPAL_UNITS = {"translation": "N/m", "rotation": "N·m/rad"}
"""Units of the principal stiffnesses of a block."""
NO_REQUIREMENTS = (
    'The file has no requirements; a table [requirements] with NAME = "free_stiffness_z > 50 N/um" adds one.'
)
COPIED_MILLISECONDS = 1500
"""Time for which the page says that a matrix is copied: long enough to be read, too short to be in the way."""


class MatricesPanel(Panel):
    """K or C in four digits; the button copies all digits."""

    name = "Matrices"

    def build(self) -> None:
        self._report: Report | None = None
        with ui.row().classes("panel-tools"):
            self.kind = toggle(list(MATRIX_NAMES), "C", self._draw, "matrix-kind")
            ui.space()
            copy = ui.button("Copy", icon="content_copy", on_click=self._copy).props("flat dense no-caps")
            copy.mark("matrix-copy").tooltip("copy the matrix with all digits, separated by tabs, for a spreadsheet")
        self.table = ui.html("", sanitize=False).mark("matrix-table")

    def show(self, report: Report, _session: Session) -> None:
        self._report = report
        self._draw()

    def _draw(self) -> None:
        if self._report is not None:
            self.table.set_content(matrix_table(self._report.analysis, str(self.kind.value)))

    def _copy(self) -> None:
        if self._report is not None:
            ui.clipboard.write(matrix_text(self._report.analysis, str(self.kind.value)))
            ui.notify(f"{self.kind.value} copied", position="bottom", timeout=COPIED_MILLISECONDS)


def _rows(analysis: Analysis, kind: str) -> Array | None:
    return analysis.compliance if kind == "C" else analysis.stiffness


def _diagonal(analysis: Analysis, kind: str) -> Sequence[float]:
    return (analysis.compliance_diagonal if kind == "C" else analysis.stiffness_diagonal).tolist()


def matrix_table(analysis: Analysis, kind: str) -> str:
    """Return C or K as a table; only its diagonal where the matrix is not finite.

    Args:
        analysis: the analysis of one pose.
        kind: "C" or "K".
    """
    names, rows, display = analysis.components, _rows(analysis, kind), analysis.machine.display
    title = f"{MATRIX_NAMES[kind]} matrix {kind}"
    if rows is not None:
        units = [[entry_unit(MATRIX_NAMES[kind], row, column) for column in names] for row in names]
        cells = [
            [entry(value, unit, display) for value, unit in zip(row, of_row, strict=True)]
            for row, of_row in zip(rows, units, strict=True)
        ]
        body = [[name, *row] for name, row in zip(names, cells, strict=True)]
        return table(title, ["", *names], body, "matrix") + paragraph(matrix_units(MATRIX_NAMES[kind], display))
    diagonal = zip(names, _diagonal(analysis, kind), strict=True)
    body = [[name, engineering(value, entry_unit(MATRIX_NAMES[kind], name, name), display)] for name, value in diagonal]
    reason = "A part is free" if kind == "C" else "A part is rigid"
    note = paragraph(f"{reason}, so {kind} is not finite; its diagonal is shown.")
    return note + table(title, ["", "diagonal"], body, "matrix")


def matrix_text(analysis: Analysis, kind: str) -> str:
    """Return C or K in all digits, cells separated by tabs; only its diagonal where the matrix is not finite."""
    matrix = _rows(analysis, kind)
    rows = [[entry] for entry in _diagonal(analysis, kind)] if matrix is None else matrix.tolist()
    return "\n".join("\t".join(repr(entry) for entry in row) for row in rows)


class IndicesPanel(Panel):
    """Principal stiffnesses, condition numbers, mobility and centres."""

    name = "Indices"

    def build(self) -> None:
        self.content = ui.html("", sanitize=False).mark("indices")

    def show(self, report: Report, _session: Session) -> None:
        self.content.set_content(indices_text(report.analysis))


def indices_text(analysis: Analysis) -> str:
    """Return all indices of a pose as tables under headings."""
    return "".join([_principal(analysis), _pose(analysis), _centres(analysis)])


def _principal(analysis: Analysis) -> str:
    blocks, display = analysis.indices.free if analysis.indices else None, analysis.machine.display
    rows = [
        [
            f"{name} {n}",
            display.show(stiffness, PRINCIPAL_UNITS[name]),
            ", ".join(f"{c:.3f}" for c in direction),
        ]
        for name, block in (blocks or {}).items()
        for n, (stiffness, direction) in enumerate(zip(block.stiffnesses, block.directions, strict=True), 1)
    ]
    title = "Principal stiffnesses"
    return titled_table(title, ["", "stiffness", "direction"], rows)


def _pose(analysis: Analysis) -> str:
    mobility, indices = analysis.mobility, analysis.indices
    rows = [
        ["singularity margin (0 to 1)", engineering(analysis.singularity_margin)],
        ["singularity margin of the legs", engineering(analysis.leg_singularity_margin)],
        ["singularity margin of the platform", engineering(analysis.platform_singularity_margin)],
        ["condition number of W", engineering(analysis.wrench_condition)],
        ["condition number of the actuators' Jacobian", engineering(analysis.jacobian_condition)],
        ["condition number of K", engineering(indices.stiffness_condition if indices else None)],
        ["rank", str(analysis.rank)],
        ["characteristic length", engineering(analysis.characteristic_length, "m", analysis.machine.display)],
    ]
    if mobility is not None:
        rows += [
            ["kind of pose", str(mobility.kind)],
            ["degrees of freedom", str(mobility.full_cycle)],
            ["actuators", str(mobility.actuators)],
            ["redundant constraints", str(mobility.here.redundant)],
            ["least singular value of the joints of a leg", engineering(mobility.leg_least_singular_value)],
            ["least singular value of what holds the platform", engineering(mobility.platform_least_singular_value)],
        ]
    return titled_table("Pose", ["", ""], rows)


def _centres(analysis: Analysis) -> str:
    centres = analysis.indices.centres if analysis.indices else {}
    rows = [
        [
            name,
            ", ".join(engineering(float(c), "m", analysis.machine.display) for c in point)
            if point is not None
            else DASH,
        ]
        for name, point in centres.items()
    ]
    title = f"Centres, measured from the {analysis.machine.reference}"
    return titled_table(title, ["", "x, y, z"], rows)


class LoadsPanel(Panel):
    """The deflection of the tool, and the load and deformation of each spring; under load, which legs carry."""

    name = "Loads"

    def build(self) -> None:
        self.content = ui.html("", sanitize=False).mark("under-load")

    def shows(self, report: Report) -> bool:
        return report.answered

    def show(self, report: Report, _session: Session) -> None:
        text = load_text(report.analysis) if report.loaded is None else loaded_text(report.loaded)
        self.content.set_content(text)


def load_text(analysis: Analysis) -> str:
    """Return deflection and loads of actuators as tables, as `analyze` prints them; without a load, how to set one."""
    load, display = analysis.load, analysis.machine.display
    if load is None:
        return paragraph("The tool carries no load. Set a force or a moment in the panel Load.")
    tool = [
        [name, *_load_cells(wrench, motion, name.startswith("r"), display)]
        for name, wrench, motion in zip(load.components, load.wrench, load.deflection, strict=True)
    ]
    actuators = as_table(actuator_table(load, display), "")
    return (
        heading("Tool point")
        + table("tool point", ["", "load", "deflection"], tool, "aligned")
        + heading("Actuators")
        + table("actuators", actuators.heads, actuators.rows, "aligned")
    )


def loaded_text(state: LoadedState) -> str:
    """Return the state of rest: its verdict, a bar for each leg, displacement, springs or their kinds, stiffness."""
    display, units = state.machine.display, component_units(state.components)
    first_order = [None] * len(units) if state.linear is None else state.linear.tolist()
    displacements = [
        [name, display.show_deflection(exact, unit), display.show_deflection(linear, unit)]
        for name, unit, exact, linear in zip(state.components, units, state.displacement, first_order, strict=True)
    ]
    springs = as_table(springs_or_kinds_table(state), "")
    return (
        paragraph(" ".join([state.message, sag_sentence(state), actuator_sentence(state)]).rstrip(), "lead")
        + heading("Which legs carry")
        + tension_bars(state)
        + paragraph(stability_of(state))
        + heading("Displacement of the tool point")
        + table("displacement", ["", "under load", "to first order"], displacements, "aligned")
        + _tangents(state)
        + heading("Springs")
        + table("springs", springs.heads, springs.rows)
    )


def tension_bars(state: LoadedState) -> str:
    """Return a bar for each leg as long as the load of its actuator: blue where it pulls, orange where it pushes."""
    named_springs = named_leg_springs(state)
    largest = {  # forces and moments each have a scale of their own
        turning: max((abs(spring.load) for _, spring in named_springs if spring.turning is turning), default=0.0)
        for turning in (False, True)
    }
    rows, legs = [], {}
    for name, spring in named_springs:
        load = "slack" if spring.slack else state.machine.display.show(spring.load, load_unit(spring.turning))
        rows.append((name, spring.load / (largest[spring.turning] or 1.0), load))
        legs[name] = spring.leg
    return bars("load of each leg, positive where it pulls", rows, legs)


def _tangents(state: LoadedState) -> str:
    """Return the stiffness that a tool feels now, and that of the springs alone with all other motions held."""
    stiffness = tangent_table(state)
    if stiffness is None:
        return ""
    rows = as_table(stiffness, "")
    return heading("Stiffness to further loads") + table("stiffness", rows.heads, rows.rows)


def _load_cells(load: float, motion: float, turning: bool, display: Display) -> list[str]:
    return [display.show(load, load_unit(turning)), display.show_deflection(motion, motion_unit(turning))]


class RequirementsPanel(Panel):
    """Each requirement with its verdict, margin and worst pose; those that are not met come first."""

    name = "Requirements"

    def build(self) -> None:
        self._session: Session | None = None
        self._lane = Lane(_verdicts_or_mistake, self._draw)
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
                ui.label(verdicts if isinstance(verdicts, str) else NO_REQUIREMENTS)
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
            try:
                self._session.move(verdict.worst_pose)
            except InputError as error:
                refuse(str(error))
            self.show_change()


def _verdicts_or_mistake(machine: Machine) -> tuple[Verdict, ...] | str:
    """Judge requirements in a thread, or say what is wrong with them."""
    try:
        return requirements(machine)
    except InputError as error:
        return str(error)
