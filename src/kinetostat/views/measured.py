"""A measured stiffness beside the computed one: the description of this answer. Nothing is computed here."""

from collections.abc import Iterator

from kinetostat.display import Display, Scale, number, number_and_uncertainty
from kinetostat.studies.measured_stiffness import COVERAGE_FACTOR, MeasuredComparison, MeasuredRow
from kinetostat.views.question import Description, Field, Lines, Records
from kinetostat.views.tables import FittedTable, text_table

SOURCE_WORDS = {"numerics": "the computation", "inputs": "the numbers of the machine", "measurement": "the measurement"}
EXACT_SHARE = 1e-9
"""Share of a number below which its uncertainty is round-off, and is not written beside it."""
LEAST_SHOWN_SHARE = 5e-4
"""Share of the variance up to which a source is not named: it would read 0.0 %."""


def measured_table(answer: MeasuredComparison) -> FittedTable:
    """A row for each measured number: it, the computed one, and their difference, with standard uncertainties."""
    table = text_table(
        "Measured and computed at the tool point, base axes (± one standard uncertainty)",
        "line", "entry", "measured", "computed", "difference", "unit", "model",
    )  # fmt: skip
    for column in table.columns[2:5]:
        column.justify = "right"
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


def _with_uncertainty(row: MeasuredRow, display: Display, value: float, uncertainty: float) -> str:
    """Return a value with its standard uncertainty in the unit of its row, "95.1 ± 2.1"."""
    factor = _scale(row, display).factor
    if uncertainty <= EXACT_SHARE * abs(value):
        return number(value * factor)
    return " ± ".join(number_and_uncertainty(value * factor, uncertainty * factor))


def _scale(row: MeasuredRow, display: Display) -> Scale:
    """Return the unit in which a row is shown: a small one for deflections."""
    unit = row.entry.unit
    return display.deflection(unit) if unit in ("m", "rad") else display.scale(unit)


def verdict_of(row: MeasuredRow, display: Display) -> str:
    """Return the verdict of a row on the model, theory (70): "explained" by the uncertainties, or how far it is off.

    A measured value that cannot be told from zero has its error in its unit, because a percentage of it means nothing.
    """
    if row.explained:
        return "explained"
    low, high = row.bounds
    size = abs(row.entry.value)
    if size <= COVERAGE_FACTOR * row.u_data:
        scale = _scale(row, display)
        ends = f"{number(low * scale.factor, digits=2)} to {number(high * scale.factor, digits=2)} {scale.unit}"
        return f"off by {ends}"
    is_stiffness = row.entry.parts[0] in ("stiffness", "free_stiffness")
    model_is_stiffer = (abs(row.predicted) > size) == is_stiffness
    ends = f"{number(100.0 * low / size, digits=2)} to {number(100.0 * high / size, digits=2)}\N{NO-BREAK SPACE}%"
    return f"too {'stiff' if model_is_stiffer else 'compliant'} by {ends}"


def _lines(answer: MeasuredComparison) -> Lines:
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


def _tables(answer: MeasuredComparison, _full: bool) -> Iterator[FittedTable]:
    yield measured_table(answer)


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
        Field("coverage_factor", lambda _answer: COVERAGE_FACTOR),
        Field("uncertainty_from", "source"),
        Field("left_out"),
        Field("shares"),
        Records("entries", "entry", ENTRY, "rows", forms=("json",)),
    ),
    lines=_lines,
    tables=_tables,
    figures="views.measurement_figures.measured_figures",
    state=lambda answer: f"beside {answer.path}",
    files={"measured.json": "json"},
)
