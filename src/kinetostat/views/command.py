"""Commands of the actuators of a loaded machine: the question, and the descriptions of both of its answers.

At poses the answer is a command, over a grid a table of corrections with its law. Nothing is computed here.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kinetostat.display import DASH, number
from kinetostat.engine.batch import Progress, silent
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, data_name
from kinetostat.spec.errors import InputError
from kinetostat.studies.commanding import Command, command
from kinetostat.studies.corrections import CorrectionTable, Term, correction_table
from kinetostat.views.data_forms import column_head, columns_csv, status_words
from kinetostat.views.forward import coordinate_text
from kinetostat.views.question import LAW_TOLERANCE, MESSAGE, NAME, Description, Field, Lines, Option, Question
from kinetostat.views.tables import FittedTable, numeric_table

MOST_LISTED_TERMS = 40
"""Terms of a law that are printed, which fill a screen; a longer one is in JSON."""
COEFFICIENT_DIGITS = 7
"""Significant digits of coefficients, which are typed into a controller: a metre to 0.1 µm."""
UNNAMED_TABLES = ("pose.", "load.")
"""Tables of a file whose fields are understood without the name of the table."""
RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
"""Digits as exponents."""


def _single_pose_table(answer: Command) -> FittedTable:
    """Return a row for each actuator: its coordinates with and without the loads, and their difference."""
    display, heads = answer.machine.display, ["commanded", "without loads", "difference"]
    table = numeric_table("Where each actuator must stand", "actuator", heads)
    rows = zip(answer.actuators, answer.units, answer.coordinates[0], answer.unloaded[0], strict=True)
    for name, unit, commanded, unloaded in rows:
        ends = (coordinate_text(float(value), unit, display) for value in (commanded, unloaded))
        difference = display.show_deflection(float(commanded - unloaded), unit)
        table.add_row(name, *(f"{end} {display.scale(unit).unit}" for end in ends), difference)
    return table


def _poses_table(answer: Command) -> FittedTable:
    """Return a row for each pose: commands, errors without and with them, and the status where it is not always ok."""
    display, all_settled = answer.machine.display, bool(answer.settled.all())
    pairs = zip(answer.actuators, answer.units, strict=True)
    heads = [*(display.scale(unit).label(name) for name, unit in pairs), "error before", "error left"]
    table = numeric_table(
        "Commands: where each actuator must stand", "pose", heads + ([] if all_settled else ["status"])
    )
    for i, row in enumerate(answer.coordinates):
        cells = [DASH] * len(heads)
        if answer.settled[i]:
            pairs = zip(row, answer.units, strict=True)
            cells = [coordinate_text(float(value), unit, display) for value, unit in pairs]
            cells += [
                display.show_deflection(float(errors[i]), "m")
                for errors in (answer.distance_uncorrected, answer.distance_corrected)
            ]
        status = [] if all_settled else [Status(int(answer.status[i])).phrase]
        table.add_row(str(i + 1), *cells, *status)
    return table


def command_csv(answer: Command, corrections: bool = False) -> str:
    """Write the commands as CSV in SI: a row with the number of each pose (from 1), its fields, and its commands.

    Args:
        answer: the commands.
        corrections: whether to add by how much they differ from the coordinates without loads.
    """
    columns: dict[str, Any] = {"pose": range(1, len(answer.coordinates) + 1)}
    if answer.poses is not None:
        for field, values in zip(answer.poses.fields, answer.poses.values, strict=True):
            columns[column_head(data_name(field.path), field.unit)] = values
    tables = {"": answer.coordinates} | ({" correction": answer.corrections} if corrections else {})
    for suffix, table in tables.items():
        for name, unit, values in zip(answer.actuators, answer.units, table.T, strict=True):
            columns[column_head(f"{name}{suffix}", unit)] = np.where(answer.settled, values, np.nan)
    return columns_csv(columns)


COMMAND = Description(
    title="Commands",
    fields=(
        NAME,
        MESSAGE,
        Field("actuators"),
        Field("units"),
        Field("coordinates"),
        Field("unloaded"),
        Field("error_before", "distance_uncorrected"),
        Field("error_left", "distance_corrected"),
        Field("rotation_left", "rotation_corrected"),
        Field("status", lambda answer: status_words(answer.status)),
    ),
    lines=lambda answer: [("Commands", answer.message)],
    tables=lambda answer, _full: [(_single_pose_table if len(answer.coordinates) == 1 else _poses_table)(answer)],
    state=lambda _answer: "commanded under load",
    answered=lambda answer: bool(answer.settled.any()),
    makers={"csv": command_csv},
)


def correction_lines(answer: CorrectionTable) -> Lines:
    """Say what corrections take away, and how short their law is."""
    yield "Corrections", answer.message
    if not answer.error_uncorrected:
        return
    law, display = answer.law, answer.machine.display
    error, wanted = (display.show_deflection(value, "m") for value in (answer.law_error, answer.tolerance))
    if answer.law_error > answer.tolerance:
        yield (
            "Law",
            f"No law reaches the tolerance of {wanted}; the best one has {len(law.terms)} terms and leaves {error}. "
            "Give more points, or use the table.",
        )
        return
    leaves = f"; at the tool it leaves at most {error} (tolerance: {wanted})."
    terms = "one term" if len(law.terms) == 1 else f"{len(law.terms)} terms"
    yield "Law", f"Each correction is a sum of {terms}" + (", exact to round-off." if answer.exact else leaves)
    for axis in sorted({i for term in law.terms for i, (kind, k) in enumerate(term) if kind == "power" and k}):
        field, unit = answer.fields[axis], answer.fields[axis].unit
        middle, half = (display.show(value, unit) for value in (law.middles[axis], law.halves[axis]))
        yield "", f"[{_name(field)}] is ({_name(field)} - {middle}) / {half}."
    if len(law.terms) > MOST_LISTED_TERMS:
        yield "", "Its coefficients are printed with --json."


def correction_tables(answer: CorrectionTable, _full: bool) -> Iterator[FittedTable]:
    """Give the least and largest correction of each actuator, and the coefficients of the law."""
    if not answer.error_uncorrected:
        return
    commands, display = answer.command, answer.machine.display
    ranges = numeric_table("Corrections: what is added to each actuator", "actuator", ["least", "largest"])
    for name, unit, values in zip(commands.actuators, commands.units, commands.corrections.T, strict=True):
        ends = (float(np.nanmin(values)), float(np.nanmax(values)))
        ranges.add_row(name, *(display.show_deflection(end, unit) for end in ends))
    yield ranges
    if answer.law_error <= answer.tolerance and len(answer.law.terms) <= MOST_LISTED_TERMS:
        scales = [display.deflection(unit) for unit in commands.units]
        heads = [f"{name}\n{scale.unit}" for scale, name in zip(scales, commands.actuators, strict=True)]
        rows = numeric_table("Law: coefficients of its terms", "term", heads)
        for term, coefficients in zip(answer.law.terms, answer.law.coefficients, strict=True):
            pairs = zip(coefficients.tolist(), scales, strict=True)
            cells = (number(c * scale.factor, digits=COEFFICIENT_DIGITS) for c, scale in pairs)
            rows.add_row(_term_text(term, answer.fields), *cells)
        yield rows


def _name(field: Parameter) -> str:
    """Return the field by its path, without a table that says nothing."""
    return field.path.split(".", 1)[1] if field.path.startswith(UNNAMED_TABLES) else field.shown


def _term_text(term: Term, fields: Sequence[Parameter]) -> str:
    """Write a term as people do: 1, [x]², [y] cos(2 gravity_angle); [x] goes from -1 to 1 over the range of x."""
    parts = []
    for (kind, k), field in zip(term, fields, strict=True):
        if kind != "power":
            parts.append(f"{kind}({f'{k} ' if k > 1 else ''}{_name(field)})")
        elif k:
            parts.append(f"[{_name(field)}]" + (str(k).translate(RAISED) if k > 1 else ""))
    return " ".join(parts) or "1"


def law_fields(answer: CorrectionTable) -> dict[str, Any]:
    """Return the law as plain data."""
    law = answer.law
    return {
        "terms": [
            {path: list(part) for path, part in zip(law.paths, term, strict=True) if part != ("power", 0)}
            for term in law.terms
        ],
        "middles": dict(zip(law.paths, law.middles, strict=True)),
        "halves": dict(zip(law.paths, law.halves, strict=True)),
        "coefficients": law.coefficients,
        "error": answer.law_error,
        "tolerance": answer.tolerance,
        "exact": answer.exact,
    }


def corrections_csv(answer: CorrectionTable) -> str:
    """Write the commands of a table and its corrections as CSV in SI, a row for each point."""
    return command_csv(answer.command, corrections=True)


def _grid_text(answer: CorrectionTable) -> str:
    sizes = (f"{_name(field)} ({len(axis)})" for field, axis in zip(answer.fields, answer.axes, strict=True))
    return f"corrections over {' × '.join(sizes)}"


CORRECTIONS = Description(
    title="Corrections",
    fields=(
        NAME,
        MESSAGE,
        Field("axes", lambda answer: {f.path: values for f, values in zip(answer.fields, answer.axes, strict=True)}),
        Field("actuators", "command.actuators"),
        Field("units", "command.units"),
        Field("corrections"),
        Field("coordinates", lambda answer: answer.command.coordinates.reshape(answer.corrections.shape)),
        Field("error_before", "error_uncorrected"),
        Field("error_left", "error_of_exact"),
        Field("error_of_table", "error"),
        Field("cells_unknown", "unknown"),
        Field("law", law_fields),
    ),
    lines=correction_lines,
    tables=correction_tables,
    state=_grid_text,
    makers={"csv": corrections_csv},
)


def command_or_corrections(
    machine: Machine,
    poses: Path | None = None,
    ranges: Sequence[str] = (),
    tolerance: str | None = None,
    fit: Path | None = None,
    progress: Progress = silent,
) -> Command | CorrectionTable:
    """Compute the commands at poses, or with ranges a table of corrections.

    Raises:
        InputError: an option that the answer has no use for, or what `command` or `correction_table` refuses.
    """
    if not ranges:
        if tolerance is not None:
            raise InputError("--tolerance is about the law of a table of corrections; give its axes with --over.")
        return command(machine, poses, fit)
    if fit is not None:
        raise InputError("--fit is about commands at poses; leave out --over, and give a file of poses.")
    if poses is not None:
        raise InputError("the poses come from a file or from --over, not from both; leave one of them out.")
    return correction_table(machine, ranges, tolerance, progress)


COMMAND_QUESTION = Question(
    example='kinetostat command hexapod --set \'load.gravity=[0, 0, "-9.81 m/s**2"]\' --set tool.mass="20 kg" '
    '--over "gravity_angle=0 deg:90 deg:7" -o corrections.csv',
    answer=command_or_corrections,
    options=(
        Option(
            "poses",
            "file",
            "a CSV file of wanted poses, as `path` takes it (default: the pose of the machine)",
            metavar="POSES",
            first=True,
        ),
        Option(
            "ranges",
            "text",
            "an axis of a table of corrections: a coordinate of the pose, gravity_angle, or any other field, as `map` "
            "takes it; repeatable",
            metavar="FIELD=from:to:count",
            many=True,
            word="--over",
        ),
        LAW_TOLERANCE,
        Option(
            "fit",
            "file",
            "fit.json of `identify -o`, or its folder, where MACHINE is the machine as built that lies beside it: "
            "coordinates are then those that the controller counts, with the zeros and gains that were found",
        ),
    ),
    output="write the commands, and the corrections of a table, as CSV",
    suffixes=(".csv",),
    reports_progress=True,
)
