"""A validation as tables on a terminal: both compliances, their difference, and how the engine's answer converges."""

from collections.abc import Sequence

from rich.console import Console

from kinetostat.validation.comparison import Array, Validation
from kinetostat.views.analysis_tables import UNITS_OF_C
from kinetostat.views.tables import number, numeric_table


def print_validation(console: Console, validation: Validation, agreed: float) -> None:
    """Ours, theirs, the difference by block, and a verdict: it agrees where no block differs by more than `agreed`."""
    family = validation.machine.family
    console.print(
        f"[bold]{validation.machine.name}[/bold] beside {validation.engine} {validation.version}", highlight=False
    )
    kept = list(family.components)
    titles = {"kinetostat": validation.ours, validation.engine: validation.theirs}
    for title, matrix in titles.items():
        _print_matrix(console, f"Compliance C, {title} ({UNITS_OF_C})", family.component_names, matrix[kept][:, kept])
    table = numeric_table("Relative difference by block", "", [*validation.differences, "uncertainty of the engine"])
    table.add_row("", *(f"{value:.1e}" for value in validation.differences.values()), f"{validation.uncertainty:.1e}")
    console.print(table)
    table = numeric_table("How the engine comes to it", validation.varied, ["difference"])
    for scale, apart in validation.trials:
        table.add_row(f"{scale:.3g}", f"{apart:.1e}")
    console.print(table)
    verdict = "agree" if validation.difference <= agreed else "DIFFER"
    console.print(f"The two {verdict}: {validation.difference:.1e}, allowed {agreed:g}.", highlight=False)


def _print_matrix(console: Console, title: str, names: Sequence[str], matrix: Array) -> None:
    table = numeric_table(title, "", names)
    for name, row in zip(names, matrix, strict=True):
        table.add_row(name, *(number(float(entry)) for entry in row))
    console.print(table)
