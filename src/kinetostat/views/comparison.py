"""Designs side by side: the description of the answer of `compare`. Nothing is computed here but rounding."""

import string
from collections.abc import Iterator, Sequence
from typing import Any

from rich.text import Text

from kinetostat.display import DASH, Display, Scale, number
from kinetostat.studies.comparison import Comparison, SoftDirection
from kinetostat.studies.design_numbers import Better, DesignRow
from kinetostat.studies.requirements import Verdict
from kinetostat.views.question import Description, Field, Lines
from kinetostat.views.tables import FittedTable, numeric_table, readable, text_table

MOST_SHARES = 3
"""Parts that are named for a direction: a cell of a table has room for them."""
LEAST_SHARE = 0.005
"""Share below which a part is not named: it would read 0 %."""
SAME_PERCENT = 0.05
"""Percent of difference up to which two values are shown as equal: with one decimal the change reads 0.0 %."""


def letters_of(comparison: Comparison) -> str:
    """Return the letters by which designs are called: A for the first."""
    return string.ascii_uppercase[: len(comparison.designs)]


def _lines(comparison: Comparison) -> Lines:
    letters = letters_of(comparison)
    for letter, design in zip(letters, comparison.designs, strict=True):
        why = "" if design.answered else f": {design.analysis.message}"
        yield letter, f"{design.label}  {design.machine.name}{why}"
    uncounted = [design.analysis.state.left_out for design in comparison.designs]
    for text in dict.fromkeys(filter(None, uncounted)):
        concerned = ", ".join(letter for letter, sentence in zip(letters, uncounted, strict=True) if sentence == text)
        yield "Loads", f"{concerned}: {text}"
    yield "Percent", "Percentages are changes against A; the best value of each row is bold."
    if not differing_fields(comparison):
        yield "Files", "The files have equal values."
    if len(_families(comparison)) > 1:
        yield "Files", "Fields that only one design has are omitted."
    if comparison.verdicts:
        yield from (
            ("Required", f"{letter} {sentence}")
            for letter, sentence in zip(letters, _verdict_sentences(comparison), strict=True)
        )
    if comparison.where:
        counts = ", ".join(f"{letter} {n:,} of {m:,}" for letter, (n, m) in zip(letters, comparison.poses, strict=True))
        yield "Poses", f"Poses with a result: {counts}."


def _verdict_sentences(comparison: Comparison) -> Iterator[str]:
    """Give a sentence on each design: the requirements that it misses, and those on quantities that it lacks."""
    names = [condition_of(row)[0] for row in comparison.verdicts]
    for column in zip(*comparison.verdicts, strict=True):
        missed = dict.fromkeys(name for name, each in zip(names, column, strict=True) if each and not each.met)
        absent = dict.fromkeys(name for name, each in zip(names, column, strict=True) if each is None)
        met = "misses " + ", ".join(missed) if missed else "meets every requirement"
        yield met + (f"; it lacks what {', '.join(absent)} is about." if absent else ".")


def condition_of(row: Sequence[Verdict | None]) -> tuple[str, str]:
    """Return the name of a requirement and its condition: that of the first design for which it could be judged."""
    verdict = next(verdict for verdict in row if verdict)
    return verdict.name, verdict.condition


def verdict_text(verdict: Verdict | None, display: Display) -> str:
    """Return whether a requirement is met, by which worst value, and by how much."""
    if verdict is None:
        return DASH
    word = "met" if verdict.met else "missed"
    if verdict.worst is None:
        return f"{word}: no result"
    margin = "" if verdict.margin is None else f" ({change_text(100.0 * verdict.margin)})"
    return f"{word}: {display.show(verdict.worst, verdict.unit)}{margin}"


def _verdict_table(comparison: Comparison, letters: str) -> FittedTable:
    table = text_table("Requirements, with the worst value and its distance from the bound", "", *letters)
    for row in comparison.verdicts:
        cells = [verdict_text(verdict, comparison.machine.display) for verdict in row]
        styled = [Text(cell, "red" if cell.startswith("missed") else "green" if cell != DASH else "") for cell in cells]
        table.add_row(": ".join(condition_of(row)), *styled)
    return table


def _families(comparison: Comparison) -> set[str]:
    return {design.machine.family.name for design in comparison.designs}


def differing_fields(comparison: Comparison) -> dict[str, list[str]]:
    """The values of the designs for each field in which they differ, by its path; a dash where a design lacks it."""
    families = [design.machine.family.name for design in comparison.designs]
    rows = {"family": families} if len(set(families)) > 1 else {}
    for difference in comparison.differences:
        pairs = zip(difference.parameters, difference.values, strict=True)
        rows[difference.path] = [
            readable(row, parameter.quantity, comparison.machine.display) if parameter else DASH
            for parameter, row in pairs
        ]
    return rows


def _tables(comparison: Comparison, _full: bool) -> Iterator[FittedTable]:
    letters, display = letters_of(comparison), comparison.machine.display
    if rows := differing_fields(comparison):
        table = text_table("Where the files differ", "field", *letters)
        for path, cells in rows.items():
            table.add_row(path, *cells)
        yield table
    yield _row_table("At the pose of each design", letters, comparison.rows, display)
    if comparison.verdicts:
        yield _verdict_table(comparison, letters)
    if any(comparison.softest):
        yield _softest_table(comparison)
    if comparison.where:
        title = f"{comparison.where[0].upper()}{comparison.where[1:]}"
        yield _row_table(title, letters, comparison.over, display, by_group=True)


def _row_table(
    title: str, letters: str, rows: Sequence[DesignRow], display: Display, by_group: bool = False
) -> FittedTable:
    table = numeric_table(title, "", list(letters))
    group = rows[0].group if rows else ""
    for row in rows:
        if row.group != group:
            table.add_section()
            group = row.group
        scale = display.fitting(row.unit, [value for value in row.values if value is not None])
        name = f"{row.group} {row.name}" if by_group else row.name
        cells = (_cell(row, i, scale, display.digits) for i in range(len(letters)))
        table.add_row(f"{name} {scale.head}".rstrip(), *cells)
    return table


def _cell(row: DesignRow, i: int, scale: Scale, digits: int) -> Text:
    """Return a value and its change against the first design; green where it is better."""
    endless = "rigid" if row.better is Better.MORE else "free"
    value, percent = row.values[i], row.percents[i]
    shown = Text(number(value and value * scale.factor, endless, digits), "bold" if i in row.best else "")
    if i == 0 or percent is None:
        return Text.assemble(shown, "" if i == 0 else " " * 9)
    colour = {"better": "green", "worse": "red", "": "default"}[change_kind(row, percent)]
    return Text.assemble(shown, (f" {change_text(percent):>8}", colour))


def change_kind(row: DesignRow, percent: float) -> str:
    """Return whether a change of a row's value is "better" or "worse"; empty if it is neither."""
    if row.better is None or abs(percent) < SAME_PERCENT:
        return ""
    return "better" if (percent < 0.0) == (row.better is Better.LESS) else "worse"


def change_text(percent: float) -> str:
    """Return a change in percent, such as "+3.2 %"; a large one as a factor, and "=" if there is none to speak of."""
    if abs(percent) < SAME_PERCENT:
        return "="
    return f"{percent:+.1f} %" if abs(percent) < 1000.0 else f"× {1.0 + percent / 100.0:.3g}"


def _softest_table(comparison: Comparison) -> FittedTable:
    table = text_table("Largest contributions in the softest directions", "", "rotation", "translation")
    for letter, softest in zip(letters_of(comparison), comparison.softest, strict=True):
        table.add_row(letter, *softest_texts(softest))
    return table


def softest_texts(softest: Sequence[SoftDirection]) -> list[str]:
    """Name the softest rotation and the softest translation of a design, each with the parts that contribute most."""
    rotation = next((direction for direction in softest if direction.direction.startswith("r")), None)
    translation = next((direction for direction in softest if not direction.direction.startswith("r")), None)
    return [_contributions(rotation), _contributions(translation)]


def _contributions(softest: SoftDirection | None) -> str:
    if softest is None:
        return DASH
    parts = [f"{name} {100 * share:.0f} %" for name, share in softest.shares[:MOST_SHARES] if share >= LEAST_SHARE]
    return f"{softest.direction}: {', '.join(parts)}"


def _designs(comparison: Comparison) -> list[dict[str, Any]]:
    return [
        {
            "design": design.label,
            "name": design.machine.name,
            "family": design.machine.family.name,
            "components": design.analysis.components,
            "status": design.analysis.status.word,
            "message": design.analysis.message,
            "loads_left_out": design.analysis.state.left_out,
            "softest": [{"direction": part.direction, "shares": dict(part.shares)} for part in softest],
        }
        for design, softest in zip(comparison.designs, comparison.softest, strict=True)
    ]


def _differences(comparison: Comparison) -> dict[str, list[Any]]:
    return {
        field.path: [row if parameter else None for parameter, row in zip(field.parameters, field.values, strict=True)]
        for field in comparison.differences
    }


def _numbers(rows: Sequence[DesignRow]) -> list[dict[str, Any]]:
    return [
        {
            "group": row.group,
            "name": row.name,
            "units": row.unit,
            "better": row.better,
            "values": row.values,
            "percent": row.percents,
            "best": row.best,
        }
        for row in rows
    ]


def _verdicts(comparison: Comparison) -> list[dict[str, Any]]:
    return [
        {
            "name": condition_of(row)[0],
            "condition": condition_of(row)[1],
            "designs": [
                verdict
                and {"met": verdict.met, "worst": verdict.worst, "margin": verdict.margin, "place": verdict.place}
                for verdict in row
            ],
        }
        for row in comparison.verdicts
    ]


def _grid(comparison: Comparison) -> dict[str, Any] | None:
    if not comparison.where:
        return None
    return {
        "over": comparison.ranges,
        "poses": comparison.where,
        "designs": [{"answered": answered, "poses": poses} for answered, poses in comparison.poses],
        "rows": _numbers(comparison.over),
    }


COMPARISON = Description(
    title="Designs side by side",
    fields=(
        Field("designs", _designs),
        Field("differences", _differences),
        Field("rows", lambda comparison: _numbers(comparison.rows)),
        Field("requirements", _verdicts),
        Field("grid", _grid),
    ),
    lines=_lines,
    tables=_tables,
    figures="views.comparison_figure.comparison_figures",
    state=lambda _comparison: "and what it is compared with",
    answered=lambda comparison: all(design.answered for design in comparison.designs),
    files={"compare.json": "json"},
)
