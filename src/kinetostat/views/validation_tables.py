"""A validation as tables on a terminal: both compliances, their difference, and how the engine's answer converges."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.validation.comparison import Array, Validation
from kinetostat.views.analysis_tables import UNITS_OF_C
from kinetostat.views.tables import number, numeric_table


def print_validation(console: Console, validation: Validation, agreed: float) -> None:
    """Ours, theirs, the difference by block, and a verdict: it agrees where no block differs by more than `agreed`."""
    family = validation.machine.family
    console.print(
        Text.assemble(
            (validation.machine.name, "bold"),
            f" compared with an independent engine, {validation.engine} {validation.version}",
        )
    )
    kept = list(family.components)
    titles = {"kinetostat": validation.ours, validation.engine: validation.theirs}
    for title, matrix in titles.items():
        shown = f"Compliance C, {title} ({UNITS_OF_C})"
        console.print(matrix_table(shown, family.component_names, matrix[kept][:, kept]))
    console.print(difference_table(validation))
    console.print(trial_table(validation))
    verdict = "agree" if validation.difference <= agreed else "DIFFER"
    largest = f"the largest relative difference is {validation.difference:.1e}, allowed is {agreed:g}"
    console.print(f"The two {verdict}: {largest}.", highlight=False)


def matrix_table(title: str, names: Sequence[str], matrix: Array) -> Table:
    """A compliance."""
    table = numeric_table(title, "", names)
    for name, row in zip(names, matrix, strict=True):
        table.add_row(name, *(number(float(entry)) for entry in row))
    return table


def diagonal_table(validation: Validation) -> Table:
    """The diagonal of C, ours and theirs, and the relative difference of each entry."""
    table = numeric_table("Diagonal of C", "direction", ["kinetostat", validation.engine, "difference", "unit"])
    family = validation.machine.family
    for i, name in zip(family.components, family.component_names, strict=True):
        ours, theirs = float(validation.ours[i, i]), float(validation.theirs[i, i])
        apart = f"{abs(theirs / ours - 1.0):.1e}" if ours else "–"
        table.add_row(name, f"{ours:.9g}", f"{theirs:.9g}", apart, QUANTITIES[f"compliance_{name}"].unit)
    return table


def difference_table(validation: Validation) -> Table:
    """The relative difference of each block, and how far the engine may be trusted."""
    table = numeric_table("Relative difference by block", "", [*validation.differences, "uncertainty of the engine"])
    table.add_row("", *(f"{value:.1e}" for value in validation.differences.values()), f"{validation.uncertainty:.1e}")
    return table


def trial_table(validation: Validation) -> Table:
    """How the engine's answer converges."""
    table = numeric_table("Convergence of the engine", validation.varied, ["difference"])
    for scale, apart in validation.trials:
        table.add_row(f"{scale:.3g}", f"{apart:.1e}")
    return table
