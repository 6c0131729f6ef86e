"""A machine beside an independent engine: the description of the answer of `validate`. Nothing is computed here."""

import math
from collections.abc import Iterator

import numpy as np
from rich.table import Table

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.display import DASH, number
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.parameters import values
from kinetostat.tolerances import AGREED
from kinetostat.validation.comparison import Validation, frequency_difference
from kinetostat.views.analysis_tables import matrix_table
from kinetostat.views.question import NAME, Axis, Description, Field, Lines, Records
from kinetostat.views.tables import numeric_table

COMPARED_DIGITS = 9
"""Digits in which a machine is compared with an independent engine: differences of 1e-9 show."""
COMPLIANCE_UNITS = "compliance, rad/(N·m), rad/N and m/N"
ROW_AND_COLUMN = ("moved", "loaded")
"""Axes of C: the component that moves and the one that is loaded."""
REBUILT = (
    "The machine was rebuilt in the engine from its geometry, cross-sections and springs alone; no Jacobian of "
    "kinetostat is used there."
)


def verdict(validation: Validation) -> str:
    """Say in a sentence whether the engine agrees: no block of C and no frequency differs by more than `AGREED`."""
    agree = "agrees" if validation.difference <= AGREED else "DIFFERS"
    worst = f"compliances differ by {max(validation.differences.values()):.1e} (relative, worst block)"
    if validation.frequencies:
        worst += f", natural frequencies by {validation.frequency_difference:.1e}"
    engine = f"{validation.engine.capitalize()} {validation.version}"
    return f"{engine}, an independent engine, {agree}: {worst}; {AGREED:g} is allowed."


def _lines(validation: Validation) -> Lines:
    return [("Verdict", verdict(validation)), ("Engine", REBUILT)]


def _tables(validation: Validation, full: bool) -> Iterator[Table]:
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
        kept = list(family.components)
        for title, matrix in {"kinetostat": validation.ours, validation.engine: validation.theirs}.items():
            rows = matrix[kept][:, kept].tolist()
            yield matrix_table(f"Compliance C, {title}", "compliance", family.component_names, rows, display)


def _diagonal_table(validation: Validation) -> Table:
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


def _frequency_table(validation: Validation) -> Table:
    columns = ["kinetostat", validation.engine, "difference", "unit"]
    table = numeric_table("Natural frequencies without loads, side by side", "mode", columns)
    for order, pair in enumerate(validation.frequencies, 1):
        cells = (number(value, digits=COMPARED_DIGITS) for value in pair)
        table.add_row(str(order), *cells, f"{frequency_difference(*pair):.1e}", "Hz")
    return table


def _pose(validation: Validation) -> dict[str, float]:
    numbers = values(validation.machine)
    return {path.removeprefix("pose."): value for path, value in numbers.items() if path.startswith("pose.")}


def _components(_validation: Validation) -> list[str]:
    return list(COMPONENTS)


VALIDATION = Description(
    title="Validation",
    fields=(
        NAME,
        Field("pose", _pose),
        Field("components", _components),
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
    lines=_lines,
    tables=_tables,
    axes=tuple(Axis(name, _components) for name in ROW_AND_COLUMN),
    state=lambda validation: f"compared with an independent engine, {validation.engine} {validation.version}",
)
