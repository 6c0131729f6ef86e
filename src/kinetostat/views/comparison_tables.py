"""Tables of comparisons on a terminal: designs side by side, and a machine against an independent engine.

Nothing is computed here but rounding.
"""

import string
from collections.abc import Iterator, Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.display import Display, number
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.studies.comparison import Better, Comparison, DesignRow, SoftDirection
from kinetostat.tolerances import AGREED
from kinetostat.validation.comparison import Validation, frequency_difference
from kinetostat.views.analysis_tables import matrix_table
from kinetostat.views.tables import numeric_table, readable, text_table

NAMED, CELL = 27, 20
"""Widths, in characters, of the first column and of one design: what fits is printed side by side."""
MOST_SHARES = 3
DIGITS = 9
"""Digits in which a machine is compared with an independent engine."""
MISSING = "–"
"""Shown for a design that has no such field."""


def print_comparison(console: Console, comparison: Comparison) -> None:
    """Print legend, differences, numbers, largest contributions and the grid.

    As many designs stand side by side as the terminal is wide; each block repeats the first design.
    """
    letters = string.ascii_uppercase[: len(comparison.designs)]
    for letter, design in zip(letters, comparison.designs, strict=True):
        title = f"  {design.label}  {design.machine.name}"
        why = "" if design.answered else f": {design.analysis.message}"
        console.print(Text.assemble((letter, "bold"), title, why))
    console.print("Percentages are changes against A; the best value of each row is bold.", style="dim")
    _print_differences(console, comparison, letters)
    display = comparison.display
    _print_rows(console, "At the pose of each design", letters, comparison.rows, display)
    _print_softest(console, comparison, letters)
    if comparison.ranges:
        counts = ", ".join(f"{letter} {n:,} of {m:,}" for letter, (n, m) in zip(letters, comparison.poses, strict=True))
        _print_rows(console, f"Over {', '.join(comparison.ranges)}", letters, comparison.over, display, by_group=True)
        console.print(f"Poses with a result: {counts}.", highlight=False)


def _print_differences(console: Console, comparison: Comparison, letters: str) -> None:
    families = [design.machine.family.name for design in comparison.designs]
    rows = {"family": families} if len(set(families)) > 1 else {}
    for difference in comparison.differences:
        pairs = zip(difference.parameters, difference.values, strict=True)
        rows[difference.path] = [
            readable(row, parameter.quantity, comparison.display) if parameter else MISSING for parameter, row in pairs
        ]
    for abreast in _abreast(console, letters):
        table = text_table("Where the files differ", "field", *(letters[i] for i in abreast))
        for path, cells in rows.items():
            if len({cells[i] for i in abreast}) > 1:
                table.add_row(path, *(cells[i] for i in abreast))
        if table.row_count:
            console.print(table)
    if not rows:
        console.print("The files have equal values.")
    if len(set(families)) > 1:
        console.print("Fields that only one design has are omitted.", style="dim")


def _abreast(console: Console, letters: str) -> Iterator[list[int]]:
    """Choose the designs that fit side by side: always the first, and as many others as the terminal takes."""
    others = max((console.width - NAMED) // CELL, 2) - 1
    for start in range(1, len(letters), others):
        yield [0, *range(start, min(start + others, len(letters)))]


def _print_rows(
    console: Console, title: str, letters: str, rows: Sequence[DesignRow], display: Display, by_group: bool = False
) -> None:
    for shown in _abreast(console, letters):
        table = numeric_table(title, "", [letters[i] for i in shown])
        group = rows[0].group if rows else ""
        for row in rows:
            if row.group != group:
                table.add_section()
                group = row.group
            unit = "" if row.unit == "1" else f" {display.scale(row.unit).unit}"
            name = f"{row.group} {row.name}" if by_group else row.name
            table.add_row(f"{name}{unit}", *(_cell(row, i, display) for i in shown))
        console.print(table)


def _cell(row: DesignRow, i: int, display: Display) -> Text:
    """Return a value and its change against the first design; green where it is better."""
    endless = "rigid" if row.better is Better.MORE else "free"
    value, percent = display.number(row.values[i], row.unit, endless), row.percents[i]
    shown = Text(value, "bold" if i in row.best else "")
    if i == 0 or percent is None:
        return Text.assemble(shown, "" if i == 0 else " " * 9)
    better = (percent < 0.0) == (row.better is Better.LESS)
    colour = "default" if abs(percent) < 0.05 else "green" if better else "red"
    return Text.assemble(shown, (f" {_percent(percent):>8}", colour))


def _percent(percent: float) -> str:
    if abs(percent) < 0.05:
        return "="
    return f"{percent:+.1f} %" if abs(percent) < 1000.0 else f"× {1.0 + percent / 100.0:.3g}"


def _print_softest(console: Console, comparison: Comparison, letters: str) -> None:
    if not any(comparison.softest):
        return
    table = text_table("Largest contributions in the softest directions", "", "rotation", "translation")
    for letter, softest in zip(letters, comparison.softest, strict=True):
        turning = next((contribution for contribution in softest if contribution.direction.startswith("r")), None)
        sliding = next((contribution for contribution in softest if not contribution.direction.startswith("r")), None)
        table.add_row(letter, _contributions(turning), _contributions(sliding))
    console.print(table)


def _contributions(attribution: SoftDirection | None) -> str:
    if attribution is None:
        return "–"
    parts = [f"{name} {100 * share:.0f} %" for name, share in attribution.shares[:MOST_SHARES] if share >= 0.005]
    return f"{attribution.direction}: {', '.join(parts)}"


def print_validation(console: Console, validation: Validation) -> None:
    """Ours, theirs, the difference by block, and a verdict: it agrees where no block differs by more than `AGREED`."""
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
        rows = matrix[kept][:, kept].tolist()
        shown = f"Compliance C, {title}"
        console.print(matrix_table(shown, "compliance", family.component_names, rows, validation.machine.display))
    console.print(difference_table(validation))
    console.print(trial_table(validation))
    if validation.frequencies:
        console.print(frequency_table(validation))
    verdict = "agree" if validation.difference <= AGREED else "DIFFER"
    largest = f"the largest relative difference is {validation.difference:.1e}, allowed is {AGREED:g}"
    console.print(f"The two {verdict}: {largest}.", highlight=False)


def frequency_table(validation: Validation) -> Table:
    """The lowest natural frequencies, ours and theirs, and the relative difference of each pair."""
    columns = ["kinetostat", validation.engine, "difference", "unit"]
    table = numeric_table("Natural frequencies, unloaded", "mode", columns)
    for order, pair in enumerate(validation.frequencies, 1):
        cells = (number(value, digits=DIGITS) for value in pair)
        table.add_row(str(order), *cells, f"{frequency_difference(*pair):.1e}", "Hz")
    return table


def diagonal_table(validation: Validation) -> Table:
    """The diagonal of C, ours and theirs, and the relative difference of each entry."""
    table = numeric_table("Diagonal of C", "direction", ["kinetostat", validation.engine, "difference", "unit"])
    family = validation.machine.family
    for i, name in zip(family.components, family.component_names, strict=True):
        ours, theirs = float(validation.ours[i, i]), float(validation.theirs[i, i])
        apart = f"{abs(theirs / ours - 1.0):.1e}" if ours else "–"
        scale = validation.machine.display.scale(QUANTITIES[f"compliance_{name}"].unit)
        cells = (number(value * scale.factor, digits=DIGITS) for value in (ours, theirs))
        table.add_row(name, *cells, apart, scale.unit)
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
