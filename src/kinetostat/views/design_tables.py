"""Designs side by side on a terminal. Nothing is computed but rounding."""

import string
from collections.abc import Iterator, Sequence

from rich.console import Console
from rich.text import Text

from kinetostat.studies.comparison.design_rows import Better, Row
from kinetostat.studies.comparison.designs import Blame, Comparison
from kinetostat.views.tables import number, numeric_table, readable, text_table

NAMED, CELL = 27, 20
"""Widths, in characters, of the first column and of one design: what fits is printed side by side."""
MOST_SHARES = 3
MISSING = "–"
"""Of a design that has no such field."""


def print_comparison(console: Console, found: Comparison) -> None:
    """Legend, differences, numbers, what is to blame, and the grid; as many designs abreast as the terminal takes."""
    letters = string.ascii_uppercase[: len(found.designs)]
    for letter, design in zip(letters, found.designs, strict=True):
        said = f"  {design.label}  {design.machine.name}"
        why = "" if design.answered else f": {design.analysis.message}"
        console.print(Text.assemble((letter, "bold"), said, why))
    console.print("Percentages are changes against A; the best value of each row is bold.", style="dim")
    _print_differences(console, found, letters)
    _print_rows(console, "At the pose of each design", letters, found.rows)
    _print_softest(console, found, letters)
    if found.ranges:
        counts = ", ".join(f"{letter} {n:,} of {m:,}" for letter, (n, m) in zip(letters, found.poses, strict=True))
        _print_rows(console, f"Over {', '.join(found.ranges)}", letters, found.over, by_group=True)
        console.print(f"Poses with a result: {counts}.", highlight=False)


def _print_differences(console: Console, found: Comparison, letters: str) -> None:
    families = [design.machine.family.name for design in found.designs]
    rows = {"family": families} if len(set(families)) > 1 else {}
    for one in found.differences:
        pairs = zip(one.parameters, one.values, strict=True)
        rows[one.path] = [readable(row, parameter.quantity) if parameter else MISSING for parameter, row in pairs]
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
    """Places of the designs that are shown side by side: the first, and as many others as the terminal takes."""
    others = max((console.width - NAMED) // CELL, 2) - 1
    for start in range(1, len(letters), others):
        yield [0, *range(start, min(start + others, len(letters)))]


def _print_rows(console: Console, title: str, letters: str, rows: Sequence[Row], by_group: bool = False) -> None:
    for shown in _abreast(console, letters):
        table = numeric_table(title, "", [letters[i] for i in shown])
        group = rows[0].group if rows else ""
        for row in rows:
            if row.group != group:
                table.add_section()
                group = row.group
            unit = "" if row.unit == "1" else f" {row.unit}"
            name = f"{row.group} {row.name}" if by_group else row.name
            table.add_row(f"{name}{unit}", *(_cell(row, i) for i in shown))
        console.print(table)


def _cell(row: Row, i: int) -> Text:
    """A value and its change against the first, green where it is better."""
    endless = "rigid" if row.better is Better.MORE else "free"
    value, percent = number(row.values[i], endless), row.percents[i]
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


def _print_softest(console: Console, found: Comparison, letters: str) -> None:
    if not any(found.softest):
        return
    table = text_table("Largest contributions in the softest directions", "", "rotation", "translation")
    for letter, own in zip(letters, found.softest, strict=True):
        turning = next((one for one in own if one.component.startswith("r")), None)
        sliding = next((one for one in own if not one.component.startswith("r")), None)
        table.add_row(letter, _blame(turning), _blame(sliding))
    console.print(table)


def _blame(one: Blame | None) -> str:
    if one is None:
        return "–"
    parts = [f"{name} {100 * share:.0f} %" for name, share in one.shares[:MOST_SHARES] if share >= 0.005]
    return f"{one.component}: {', '.join(parts)}"
