"""Designs side by side on a terminal. Nothing is computed here but rounding."""

import string
from collections.abc import Iterator, Sequence

from rich.console import Console
from rich.text import Text

from kinetostat.display import Display
from kinetostat.studies.comparison import Better, Comparison, DesignRow, SoftDirection
from kinetostat.views.tables import numeric_table, readable, text_table

NAMED, CELL = 27, 20
"""Widths, in characters, of the first column and of one design: what fits is printed side by side."""
MOST_SHARES = 3
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
