"""A machine beside an independent engine, or beside what was measured: descriptions of both answers of `validate`.

Nothing is computed here.
"""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.display import DASH, Display, Scale, number, number_and_uncertainty
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.late import LateModule
from kinetostat.machine.machine import setting_of
from kinetostat.machine.parameters import values
from kinetostat.tolerances import AGREED
from kinetostat.validation.comparison import Validation, frequency_difference
from kinetostat.views.analysis_tables import matrix_table
from kinetostat.views.question import NAME, Axis, Description, Drawing, Field, Lines, Records
from kinetostat.views.tables import FittedTable, numeric_table, text_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from kinetostat.studies import measured_stiffness
    from kinetostat.studies.measured_stiffness import MeasuredComparison, MeasuredRow
    from kinetostat.views import figures
else:  # of which an answer of an engine needs nothing
    measured_stiffness = LateModule("kinetostat.studies.measured_stiffness")
    figures = LateModule("kinetostat.views.figures")

COMPARED_DIGITS = 9
"""Digits in which a machine is compared with an independent engine: differences of 1e-9 show."""
COMPLIANCE_UNITS = "compliance, rad/(N·m), rad/N and m/N"
ROW_AND_COLUMN = ("moved", "loaded")
"""Axes of C: the component that moves and the one that is loaded."""
REBUILT = (
    "The machine was rebuilt in the engine from its geometry, cross-sections and springs alone; no Jacobian of "
    "kinetostat is used there."
)
SOURCE_WORDS = {"numerics": "the computation", "inputs": "the numbers of the machine", "measurement": "the measurement"}
"""Words for the sources of uncertainty, in the order of `u_num`, `u_input` and `u_data`."""
EXACT_SHARE = 1e-9
"""Share of a number below which its uncertainty is round-off, and is not written beside it."""
LEAST_SHOWN_SHARE = 5e-4
"""Share of the variance up to which a source is not named: it would read 0.0 %."""
MOST_BARS_OF_ENTRIES = 60
"""Greatest number of measured entries that have bars; of more, those with the largest differences."""
FIGURE_WIDTH, ROW_HEIGHT, ROOM_FOR_TITLE = 6.4, 0.2, 1.9
"""Width of the figure of differences, height of a row, and of title, legend, scale and notes, inches."""
BAR_SHARE = 0.6
"""Height of a bar as a share of its row: names of entries are told apart."""
EXPLAINED_COLOUR = "#e8e8e8"
"""Pale grey of the band of differences that uncertainties explain."""
LEAST_REACH, ROOM_BEYOND_BARS = 1.5, 1.1
"""Half the width of the panel of differences at least, in half widths of that band; and over the greatest bar: the band
is seen to end, and no bar does."""


def verdict(validation: Validation) -> str:
    """Say in a sentence whether the engine agrees: no block of C and no frequency differs by more than `AGREED`."""
    agree = "agrees" if validation.difference <= AGREED else "DIFFERS"
    worst = f"compliances differ by {max(validation.differences.values()):.1e} (relative, worst block)"
    if validation.frequencies:
        worst += f", natural frequencies by {validation.frequency_difference:.1e}"
    engine = f"{validation.engine.capitalize()} {validation.version}"
    return f"{engine}, an independent engine, {agree}: {worst}; {AGREED:g} is allowed."


def _engine_tables(validation: Validation, full: bool) -> Iterator[FittedTable]:
    """Give the diagonals of C side by side and how far they differ; with `full` both matrices, last."""
    yield _diagonal_table(validation)
    differences = [*validation.differences, "uncertainty of the engine"]
    table = numeric_table("Relative difference by block, and how exact the engine itself is", "", differences)
    table.add_row("", *(f"{value:.1e}" for value in (*validation.differences.values(), validation.uncertainty)))
    yield table
    if validation.frequencies:
        yield _frequency_table(validation)
    if len(validation.trials) > 1:
        table = numeric_table("Convergence of the engine to its result", validation.varied, ["difference"])
        for scale, difference in validation.trials:
            table.add_row(f"{scale:.3g}", f"{difference:.1e}")
        yield table
    if full:
        family, display = validation.machine.family, validation.machine.display
        components = list(family.components)
        for title, matrix in {"kinetostat": validation.ours, validation.engine: validation.theirs}.items():
            rows = matrix[components][:, components].tolist()
            yield matrix_table(f"Compliance C, {title}", "compliance", family.component_names, rows, display)


def _diagonal_table(validation: Validation) -> FittedTable:
    columns = ["kinetostat", validation.engine, "difference", "unit"]
    table = numeric_table("Diagonal of the compliance, side by side", "direction", columns)
    family = validation.machine.family
    diagonals = np.diag(validation.ours), np.diag(validation.theirs), validation.diagonal_differences
    for i, name in zip(family.components, family.component_names, strict=True):
        ours, theirs, difference = (float(values[i]) for values in diagonals)
        scale = validation.machine.display.scale(QUANTITIES[f"compliance_{name}"].unit)
        cells = (number(value * scale.factor, digits=COMPARED_DIGITS) for value in (ours, theirs))
        table.add_row(name, *cells, DASH if math.isnan(difference) else f"{difference:.1e}", scale.unit)
    return table


def _frequency_table(validation: Validation) -> FittedTable:
    columns = ["kinetostat", validation.engine, "difference", "unit"]
    table = numeric_table("Natural frequencies without loads, side by side", "mode", columns)
    for order, pair in enumerate(validation.frequencies, 1):
        cells = (number(value, digits=COMPARED_DIGITS) for value in pair)
        table.add_row(str(order), *cells, f"{frequency_difference(*pair):.1e}", "Hz")
    return table


def _pose(validation: Validation) -> dict[str, float]:
    numbers = values(validation.machine)
    return {path.removeprefix("pose."): value for path, value in numbers.items() if path.startswith("pose.")}


VALIDATION = Description(
    title="Validation",
    fields=(
        NAME,
        Field("pose", _pose),
        Field("components", lambda _validation: list(COMPONENTS)),
        Field("engine"),
        Field("version"),
        Field("ours", long_name=f"{COMPLIANCE_UNITS}, by kinetostat", axes=ROW_AND_COLUMN),
        Field("theirs", long_name=f"{COMPLIANCE_UNITS}, by the engine", axes=ROW_AND_COLUMN),
        Field("differences"),
        Field("difference"),
        Field("allowed", lambda _: AGREED),
        Field("uncertainty"),
        Field("varied"),
        Records(
            "trials",
            "trial",
            (Field("scale", lambda trial: trial[0]), Field("difference", lambda trial: trial[1])),
            forms=("json",),
        ),
        Records(
            "frequencies",
            "mode",
            (
                Field("ours", lambda pair: pair[0]),
                Field("theirs", lambda pair: pair[1]),
                Field("difference", lambda pair: frequency_difference(*pair)),
            ),
            forms=("json",),
        ),
    ),
    lines=lambda validation: [("Verdict", verdict(validation)), ("Engine", REBUILT)],
    tables=_engine_tables,
    axes=tuple(Axis(name, lambda _validation: list(COMPONENTS)) for name in ROW_AND_COLUMN),
    state=lambda validation: f"compared with an independent engine, {validation.engine} {validation.version}",
)


def measured_table(answer: "MeasuredComparison") -> FittedTable:
    """Return a row for each number: measured, computed, and their difference, with standard uncertainties."""
    table = text_table(
        "Measured and computed at the tool point, base axes (± one standard uncertainty)",
        "line", "entry", "measured", "computed", "difference", "unit", "model",
        numeric=("measured", "computed", "difference"),
    )  # fmt: skip
    display = answer.machine.display
    for row in answer.rows:
        table.add_row(
            str(row.entry.line),
            row.entry.name,
            _with_uncertainty(row, display, row.entry.value, row.u_data),
            _with_uncertainty(row, display, row.predicted, (row.u_input**2 + row.u_num**2) ** 0.5),
            _with_uncertainty(row, display, row.error, row.u_val),
            _scale(row, display).unit,
            verdict_of(row, display),
        )
    return table


def _with_uncertainty(row: "MeasuredRow", display: Display, value: float, uncertainty: float) -> str:
    """Return a value with its standard uncertainty in the unit of its row, "95.1 ± 2.1"."""
    factor = _scale(row, display).factor
    if uncertainty <= EXACT_SHARE * abs(value):
        return number(value * factor)
    return " ± ".join(number_and_uncertainty(value * factor, uncertainty * factor))


def _scale(row: "MeasuredRow", display: Display) -> Scale:
    """Return the unit in which a row is shown: a small one for deflections."""
    unit = row.entry.unit
    return display.deflection(unit) if unit in ("m", "rad") else display.scale(unit)


def verdict_of(row: "MeasuredRow", display: Display) -> str:
    """Return the verdict of a row on the model, theory (70): "explained" by the uncertainties, or how far it is off.

    A measured value that cannot be told from zero has its error in its unit, because a percentage of it means nothing.
    """
    if row.explained:
        return "explained"
    low, high = row.bounds
    size = abs(row.entry.value)  # as measured
    if size <= measured_stiffness.COVERAGE_FACTOR * row.u_data:
        scale = _scale(row, display)
        ends = f"{number(low * scale.factor, digits=2)} to {number(high * scale.factor, digits=2)} {scale.unit}"
        return f"off by {ends}"
    is_stiffness = row.entry.place.kind in ("stiffness", "free_stiffness")
    model_is_stiffer = (abs(row.predicted) > size) == is_stiffness
    ends = f"{number(100.0 * low / size, digits=2)} to {number(100.0 * high / size, digits=2)}\N{NO-BREAK SPACE}%"
    return f"too {'stiff' if model_is_stiffer else 'compliant'} by {ends}"


def _measured_lines(answer: "MeasuredComparison") -> Lines:
    yield "Verdict", answer.message
    shares = sorted(answer.shares.items(), key=lambda source: -source[1])
    text = ", ".join(
        f"{number(100.0 * share, digits=2)} % {SOURCE_WORDS[name]}"
        for name, share in shares
        if share > LEAST_SHOWN_SHARE
    )
    yield "Variance", f"The variance of the differences is made of: {text}."
    if answer.source:
        yield "Numbers", f"The uncertainty of the machine's numbers is from {answer.source}."
    else:
        yield (
            "Numbers",
            "The machine's numbers count as exact, because nothing says how sure they are: give --tolerance "
            '"compliances=sigma 10 %", lines under [tolerances], or --fit fit.json.',
        )
    if answer.left_out:
        yield (
            "Left out",
            f"{len(answer.left_out)} errors of geometry do not count: they do where the legs of a machine as built "
            "close without being bent, and its springs are the same at all poses.",
        )


def measured_figure(answer: "MeasuredComparison", title: str = "{}: measured and computed stiffness") -> "Figure":
    """Draw differences in standard uncertainties, and the shares of computation, numbers and measurement in these."""
    differences = np.array([row.error / row.u_val for row in answer.rows])
    order = np.sort(np.argsort(-np.abs(differences), kind="stable")[:MOST_BARS_OF_ENTRIES])
    rows = [answer.rows[n] for n in order]
    with figures.new_figure(
        (FIGURE_WIDTH, ROOM_FOR_TITLE + ROW_HEIGHT * len(rows)),
        title.format(answer.machine.name),
        setting_of(answer.machine),
        "grey: explained by uncertainties",
    ) as figure:
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
        _draw_differences(left, rows, differences[order], float(np.abs(differences).max()))
        _draw_variances(right, rows)
        for panel in (left, right):
            panel.grid(visible=False, axis="y")
            panel.tick_params(axis="y", length=0)
        right.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=figures.NOTE_SIZE, borderaxespad=0.2)
    return figure


def _draw_differences(panel: "Axes", rows: Sequence["MeasuredRow"], differences: Array, greatest: float) -> None:
    """Draw a bar for each row with its difference in standard uncertainties, over the band that these explain.

    Args:
        panel: the panel to fill.
        rows: the rows that are shown.
        differences: their differences [rows].
        greatest: the greatest size of the differences of all rows, also of those that are not shown.
    """
    explained = measured_stiffness.COVERAGE_FACTOR
    panel.axvspan(-explained, explained, color=EXPLAINED_COLOUR, zorder=0)
    panel.axvline(0.0, color="black", linewidth=0.6)
    colours = [figures.COLOURS[0] if row.explained else figures.COLOURS[1] for row in rows]
    panel.barh(np.arange(len(rows)), differences, BAR_SHARE, color=colours)
    panel.set(xlabel="computed less measured (standard uncertainties)")
    reach = ROOM_BEYOND_BARS * max(greatest, LEAST_REACH * explained)
    panel.set_xlim(-reach, reach)
    panel.set_yticks(np.arange(len(rows)), [f"{row.entry.name} (line {row.entry.line})" for row in rows])
    panel.set_ylim(len(rows) - 0.4, -0.6)


def _draw_variances(panel: "Axes", rows: Sequence["MeasuredRow"]) -> None:
    """Draw the shares of computation, numbers and measurement in the variance of each row, one behind the other."""
    start = np.zeros(len(rows))
    parts = np.array([[row.u_num, row.u_input, row.u_data] for row in rows]) ** 2
    shares = 100.0 * parts / parts.sum(axis=1, keepdims=True)
    for share, colour, words in zip(shares.T, figures.COLOURS[2:], SOURCE_WORDS.values(), strict=False):
        panel.barh(np.arange(len(rows)), share, BAR_SHARE, start, color=colour, label=words)
        start = start + share
    panel.set(xlabel="share of the variance (%)", xlim=(0, 100))


def measured_figures(answer: "MeasuredComparison") -> dict[str, Drawing]:
    """Return the comparison with a measured stiffness as the one figure that it has."""
    caption = "Differences of computed and measured numbers over their uncertainty, and what the variance is made of."
    return {"measured": Drawing(caption, partial(measured_figure, answer))}


ENTRY = (
    Field("name", "entry.name"),
    Field("line", "entry.line"),
    Field("unit", "entry.unit"),
    Field("measured", "entry.value"),
    Field("predicted"),
    Field("error"),
    Field("u_num"),
    Field("u_input"),
    Field("u_data"),
    Field("u_val"),
    Field("explained"),
    Field("model_error_between", "bounds"),
)

MEASURED_STIFFNESS = Description(
    title="Measured stiffness",
    fields=(
        Field("machine", "machine.name"),
        Field("data", "path"),
        Field("verdict", "message"),
        Field("agrees"),
        Field("chi_square"),
        Field("probability"),
        Field("coverage_factor", lambda _answer: measured_stiffness.COVERAGE_FACTOR),
        Field("uncertainty_from", "source"),
        Field("left_out"),
        Field("shares"),
        Records("entries", "entry", ENTRY, "rows", forms=("json",)),
    ),
    lines=_measured_lines,
    tables=lambda answer, _full: [measured_table(answer)],
    figures=measured_figures,
    state=lambda answer: f"beside {answer.path}",
    files={"measured.json": "json"},
)
