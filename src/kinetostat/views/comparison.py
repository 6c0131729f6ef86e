"""Designs side by side: the description of the answer of `compare`, and its figure.

Nothing is computed here but rounding.
"""

import math
import string
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from rich.text import Text

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.display import DASH, Display, Scale, number
from kinetostat.late import LateModule
from kinetostat.machine.machine import frame_of
from kinetostat.studies.comparison import Comparison, SoftDirection
from kinetostat.studies.design_numbers import Better, DesignRow
from kinetostat.studies.requirements import Verdict
from kinetostat.views.question import Description, Drawing, Field, Lines
from kinetostat.views.tables import FittedTable, numeric_table, readable, text_table

if TYPE_CHECKING:
    from matplotlib import patches
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from kinetostat.views import figures
else:
    patches = LateModule("matplotlib.patches")
    figures = LateModule("kinetostat.views.figures")

MOST_SHARES = 3
"""Parts that are named for a direction: a cell of a table has room for them."""
LEAST_SHARE = 0.005
"""Share below which a part is not named: it would read 0 %."""
CHANGE_WIDTH = 8
"""Characters of a change beside a value, such as "+123.4 %": changes of a column stand below each other."""
LEAST_FACTOR = 1000.0
"""Change, in percent, from which it is written as a factor: people do not read "+1200.0 %" as thirteen times."""
SAME_PERCENT = 0.05
"""Percent of difference up to which two values are shown as equal: with one decimal the change reads 0.0 %."""
WIDEST_LINEAR_RATIO = 30.0
"""Ratio of the largest bar to the least beyond which an axis is logarithmic: the least one could not be seen
otherwise."""
LONGEST_DESIGN_NAME = 100
"""Greatest number of characters of a design's name in the legend, which is as wide as the figure."""
LEAST_PANEL_WIDTH, BAR_GROUP_WIDTH, ROOM_FOR_NUMBERS = 0.9, 0.55, 0.6
"""Width of a panel without bars, what each group of bars adds to it, and the room of the numbers beside it, inches."""
PANEL_HEIGHT, ROOM_FOR_TITLE, LEGEND_ROW = 2.3, 0.6, 0.17
"""Height of a line of panels, of the title, and of a design in the legend, inches."""
PANELS_IN_A_ROW = 4
"""Panels beside each other at most: more would not fit across a page."""
GROUP_WIDTH = 0.8
"""Width of the bars of all designs together, in distances of groups: groups stay apart."""
FIRST_COLOUR, DOT_COLOUR, REMARK_COLOUR = "#999999", "#333333", "#666666"
"""Greys of the first design, with which the others are compared, of dots over bars, and of words instead of bars."""


class BarGroup(NamedTuple):
    """Bars of all designs that stand together: their label, their values, and those of the dots over them, if any."""

    label: str
    row: DesignRow
    dots: DesignRow | None = None


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
    if len({design.machine.family.name for design in comparison.designs}) > 1:
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


def differing_fields(comparison: Comparison) -> dict[str, list[str]]:
    """Return the values of the designs for each field in which they differ, by its path; a dash where one lacks it."""
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
    """Return the value of the i-th design and its change against the first one; green where it is better."""
    endless = "rigid" if row.better is Better.MORE else "free"
    value, percent = row.values[i], row.percents[i]
    shown = Text(number(value and value * scale.factor, endless, digits), "bold" if i in row.best else "")
    if i == 0:
        return shown
    if percent is None:
        return Text.assemble(shown, " " * (CHANGE_WIDTH + 1))
    colour = {"better": "green", "worse": "red", "": "default"}[change_kind(row, percent)]
    return Text.assemble(shown, (f" {change_text(percent):>{CHANGE_WIDTH}}", colour))


def change_kind(row: DesignRow, percent: float) -> str:
    """Return whether a change of a row's value is "better" or "worse"; empty if it is neither."""
    if row.better is None or abs(percent) < SAME_PERCENT:
        return ""
    return "better" if (percent < 0.0) == (row.better is Better.LESS) else "worse"


def change_text(percent: float) -> str:
    """Return a change in percent, such as "+3.2 %"; a large one as a factor, and "=" if there is none to speak of."""
    if abs(percent) < SAME_PERCENT:
        return "="
    return f"{percent:+.1f} %" if abs(percent) < LEAST_FACTOR else f"× {1.0 + percent / 100.0:.3g}"


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


def comparison_figure(comparison: Comparison, title: str = "Designs compared, {}") -> "Figure":
    """Draw the numbers of each design in panels, one for each unit; over poses, bars are means and dots the worst.

    Without named quantities these are the compliance, singularity margin, vibrations, displacement and error, and mass.
    Bars start at 0. If the numbers of a panel differ too much for that, its axis is logarithmic, and marks take the
    place of bars, because the length of a bar has no meaning there.
    """
    panels = list(_panels(comparison).items())
    lines = [panels[i : i + PANELS_IN_A_ROW] for i in range(0, len(panels), PANELS_IN_A_ROW)]
    sizes = [[LEAST_PANEL_WIDTH + BAR_GROUP_WIDTH * len(groups) for _, groups in line] for line in lines]
    width = max(sum(line) + ROOM_FOR_NUMBERS * (len(line) + 1) for line in sizes)
    height = PANEL_HEIGHT * len(lines) + ROOM_FOR_TITLE + LEGEND_ROW * len(comparison.designs)
    over = f"mean (bars) and worst (dots) {comparison.where}" if comparison.where else "at the pose of each design"
    with figures.new_figure((width, height), title.format(over)) as figure:
        rows = figure.add_gridspec(len(lines), 1)
        for row, (line, widths) in enumerate(zip(lines, sizes, strict=True)):
            cells = rows[row].subgridspec(1, len(line), width_ratios=widths)
            for column, (name, groups) in enumerate(line):
                panel = figure.add_subplot(cells[column])
                _draw_bars(panel, name, groups, len(comparison.designs), comparison.machine.display)
        labels = (_short(design.label) for design in comparison.designs)
        handles = [
            patches.Patch(color=_colour(i), label=f"{letter}  {label}")
            for i, (letter, label) in enumerate(zip(letters_of(comparison), labels, strict=True))
        ]
        frames = " or ".join(dict.fromkeys(frame_of(design.machine) for design in comparison.designs))
        look: dict[str, Any] = {"title_fontsize": figures.NOTE_SIZE, "alignment": "left"}
        figure.legend(handles=handles, loc="outside lower left", title=f"in {frames}", **look)
    return figure


def _panels(comparison: Comparison) -> dict[str, list[BarGroup]]:
    """Return the bars of each panel by its title; the mass is the last."""
    panels = _by_title(_bars_over_poses(comparison) or _bars_at_pose(comparison))
    mass = [BarGroup("", row) for row in comparison.rows if row.name == "moving mass"]
    return panels | {"moving mass": mass} if mass else panels


def _bars_over_poses(comparison: Comparison) -> list[BarGroup]:
    """Return the mean of each quantity over the poses with its worst value; nothing if there are no poses."""
    rows: dict[str, dict[str, DesignRow]] = {}
    for row in comparison.over if comparison.where else ():
        rows.setdefault(row.group, {})[row.name] = row
    return [BarGroup(name, of["mean"], of.get("worst") or of["greatest in size"]) for name, of in rows.items()]


def _bars_at_pose(comparison: Comparison) -> list[BarGroup]:
    """Return the numbers at the pose: the quantities that were named, or else the usual ones."""
    named = [BarGroup(row.name, row) for row in comparison.rows if row.group == "quantities"]
    usual = [
        BarGroup(row.name, row)
        for row in comparison.rows
        if row.group in ("compliance", "loads and vibration") or row.name == "singularity margin"
    ]
    return named or usual


def _by_title(groups: Sequence[BarGroup]) -> dict[str, list[BarGroup]]:
    """Put bars under the title of their panel: entries of a matrix about and along axes, members of a group together.

    A number that stands alone, such as the first frequency, has its whole name in the title.

    Args:
        groups: the bars, each with the whole name of its quantity as its label.
    """
    panels: dict[str, list[BarGroup]] = {}
    for name, row, dots in groups:
        stem, _, member = name.rpartition("_") if "_" in name else name.rpartition(" ")
        is_member = stem and (member.isdigit() or member in COMPONENTS)
        title, label = (stem.replace("_", " "), member) if is_member else (name.replace("_", " "), "")
        title = "compliance" if title == "C" else title
        if is_member and member in COMPONENTS:
            title = f"{title} {'about' if member.startswith('r') else 'along'} axes"
        panels.setdefault(title, []).append(BarGroup(label, row, dots))
    titled: dict[str, list[BarGroup]] = {}
    for title, members in panels.items():
        lone = members[0].label if len(members) == 1 and members[0].label.isdigit() else ""
        titled[f"{title} {lone}".rstrip()] = [members[0]._replace(label="")] if lone else members
    return titled


def _draw_bars(panel: "Axes", title: str, groups: Sequence[BarGroup], count: int, display: Display) -> None:
    """Draw the groups of bars of a panel, a bar for each of so many designs, in the unit that fits all of them."""
    unit = groups[0].row.unit
    heights = np.array([_finite_values(group.row) for group in groups])
    dots = np.array([_finite_values(group.dots) if group.dots else [math.nan] * count for group in groups])
    scale = display.fitting(unit, [*heights.flat, *dots.flat])
    heights, dots = heights * scale.factor, dots * scale.factor
    logarithmic = _spans_decades(heights)
    width = GROUP_WIDTH / count
    offsets = (np.arange(count) - (count - 1) / 2) * width  # of the bars of a group from its middle
    for i, offset in enumerate(offsets):
        places = np.arange(len(groups)) + offset
        if logarithmic:
            panel.plot(places, heights[:, i], "D", color=_colour(i), markersize=5.0)
        else:
            panel.bar(places, heights[:, i], width * figures.BAR_SHARE, color=_colour(i))
        panel.plot(places, dots[:, i], "o", color=DOT_COLOUR, markersize=2.5)
        for place, group in zip(places, groups, strict=True):
            _write_missing(panel, float(place), group.row, i)
    panel.set_xlim(-0.5, len(groups) - 0.5)
    if logarithmic:
        panel.set_yscale("log")
        panel.margins(y=0.15)
    if len(groups) == 1 and not groups[0].label:  # there is room for the letter of each design below its bar
        panel.set_xticks(offsets, [*string.ascii_uppercase[:count]])
    else:
        panel.set_xticks(range(len(groups)), [group.label for group in groups])
    panel.grid(visible=False, axis="x")
    panel.set_axisbelow(True)
    panel.tick_params(axis="x", length=0)
    panel.set_ylabel(scale.label(title) if unit != "1" else f"{title} (0 to 1)" if "margin" in title else title)


def _spans_decades(heights: Array) -> bool:
    """Return whether heights differ so much that the least could not be seen beside the greatest."""
    positive = heights[np.isfinite(heights) & (heights > 0.0)]
    return bool(positive.size) and bool(positive.max() > WIDEST_LINEAR_RATIO * positive.min())


def _write_missing(panel: "Axes", place: float, row: DesignRow, i: int) -> None:
    """Write why a design has no bar: its mass is not known, it lacks the direction, or it is free there."""
    value = row.values[i]
    if value is None or not math.isfinite(value):
        absent = "not known" if row.unit == "kg" else "none"
        text = absent if value is None or math.isnan(value) else "infinite"
        look: dict[str, Any] = {"rotation": 90, "ha": "center", "fontsize": figures.NOTE_SIZE, "color": REMARK_COLOUR}
        panel.text(place, 0.02, text, transform=panel.get_xaxis_transform(), **look)


def _finite_values(row: DesignRow) -> list[float]:
    return [math.nan if value is None or not math.isfinite(value) else value for value in row.values]


def _colour(i: int) -> str:
    return (FIRST_COLOUR, *figures.COLOURS)[i % (len(figures.COLOURS) + 1)]


def _short(label: str) -> str:
    return label if len(label) <= LONGEST_DESIGN_NAME else f"{label[: LONGEST_DESIGN_NAME - 1]}…"


def comparison_figures(comparison: Comparison) -> dict[str, Drawing]:
    """Return designs side by side as the one figure that they have."""
    caption = "Numbers of each design beside those of the others."
    return {"comparison": Drawing(caption, partial(comparison_figure, comparison), file="compare")}


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
            "group": row.group, "name": row.name, "units": row.unit, "better": row.better,
            "values": row.values, "percent": row.percents, "best": row.best,
        }
        for row in rows
    ]  # fmt: skip


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
    designs = [{"answered": answered, "poses": poses} for answered, poses in comparison.poses]
    over = {"over": comparison.ranges, "poses": comparison.where}
    return {**over, "designs": designs, "rows": _numbers(comparison.over)} if comparison.where else None


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
    figures=comparison_figures,
    state=lambda _comparison: "and what it is compared with",
    answered=lambda comparison: all(design.answered for design in comparison.designs),
    files={"compare.json": "json"},
)
