"""Figure of a comparison of designs: grouped bars, a panel for each unit. Nothing is computed here but scales."""

import math
import string
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.display import Display
from kinetostat.machine.machine import frame_of
from kinetostat.studies.comparison import Comparison
from kinetostat.studies.design_numbers import DesignRow
from kinetostat.views.figures import COLOURS, new_figure
from kinetostat.views.question import Drawing

WIDE = 30.0
"""Ratio of the largest bar to the least beyond which an axis is logarithmic: the least one could not be seen
otherwise."""
LONGEST_DESIGN_NAME = 100
"""Greatest number of characters of a design's name in the legend, which is as wide as the figure."""


PANELS_IN_A_ROW = 4
"""Panels beside each other at most: more would not fit across a page."""
GROUP_WIDTH = 0.8
"""Width of the bars of all designs together, in distances of groups: groups stay apart."""


def comparison_figure(comparison: Comparison, title: str = "Designs compared, {}") -> Figure:
    """Draw the numbers of each design in panels, one for each unit; over poses, bars are means and dots the worst.

    Without named quantities these are the compliance, singularity margin, vibrations, displacement and error, and mass.
    Bars start at 0. If the numbers of a panel differ too much for that, its axis is logarithmic, and marks take the
    place of bars, because the length of a bar has no meaning there.
    """
    panels = [panel for panel in _panels(comparison) if panel[1]]
    lines = [panels[i : i + PANELS_IN_A_ROW] for i in range(0, len(panels), PANELS_IN_A_ROW)]
    sizes = [[0.9 + 0.55 * len(bars) for _, bars in line] for line in lines]
    width = max(sum(line) + 0.6 * len(line) + 0.6 for line in sizes)
    height = 2.3 * len(lines) + 0.6 + 0.17 * len(comparison.designs)
    over = f"mean (bars) and worst (dots) {comparison.where}" if comparison.where else "at the pose of each design"
    with new_figure((width, height), title.format(over)) as figure:
        rows = figure.add_gridspec(len(lines), 1)
        for row, (line, widths) in enumerate(zip(lines, sizes, strict=True)):
            cells = rows[row].subgridspec(1, len(line), width_ratios=widths)
            for column, (name, bars) in enumerate(line):
                panel = figure.add_subplot(cells[column])
                _draw_bars(panel, name, bars, len(comparison.designs), comparison.machine.display)
        styles = zip(string.ascii_uppercase, comparison.designs, strict=False)
        handles = [
            Patch(color=_colour(i), label=f"{letter}  {_short(design.label)}")
            for i, (letter, design) in enumerate(styles)
        ]
        frames = dict.fromkeys(frame_of(design.machine) for design in comparison.designs)
        legend = f"in {' or '.join(frames)}"
        figure.legend(handles=handles, loc="outside lower left", title=legend, title_fontsize=6.5, alignment="left")
    return figure


Bars = list[tuple[str, DesignRow, DesignRow | None]]
"""For each group of bars: its label, the row of the bars, and the row of the dots if there are any."""


def _panels(comparison: Comparison) -> list[tuple[str, Bars]]:
    """Panels by title: those of the quantities that were named, or else the usual ones; the mass closes them."""
    mass: list[tuple[str, Bars]] = [
        ("moving mass", [("", row, None) for row in comparison.rows if row.name == "moving mass"])
    ]
    if comparison.where:
        groups: dict[str, dict[str, DesignRow]] = {}
        for row in comparison.over:
            groups.setdefault(row.group, {})[row.name] = row
        pairs: Bars = [
            (name, group["mean"], group.get("worst") or group["greatest in size"]) for name, group in groups.items()
        ]
        return [*_by_title(pairs), *mass]
    named: Bars = [(row.name, row, None) for row in comparison.rows if row.group == "quantities"]
    usual: Bars = [
        (row.name, row, None)
        for row in comparison.rows
        if row.group in ("compliance", "loads and vibration") or row.name == "singularity margin"
    ]
    return [*_by_title(named or usual), *mass]


def _by_title(pairs: Bars) -> list[tuple[str, Bars]]:
    """Bars under the title of their panel: entries of a matrix about and along axes, members of a group together.

    A number that stands alone, such as the first frequency, has its whole name in the title.
    """
    panels: dict[str, Bars] = {}
    for name, bar, dot in pairs:
        stem, _, member = name.rpartition("_") if "_" in name else name.rpartition(" ")
        is_member = stem and (member.isdigit() or member in COMPONENTS)
        title, label = (stem.replace("_", " "), member) if is_member else (name.replace("_", " "), "")
        title = "compliance" if title == "C" else title
        if is_member and member in COMPONENTS:
            title = f"{title} {'about' if member.startswith('r') else 'along'} axes"
        panels.setdefault(title, []).append((label, bar, dot))
    lone = {title: bars[0][0] for title, bars in panels.items() if len(bars) == 1 and bars[0][0].isdigit()}
    return [
        (f"{title} {lone[title]}", [("", *bars[0][1:])]) if title in lone else (title, bars)
        for title, bars in panels.items()
    ]


def _draw_bars(panel: Axes, title: str, bars: Bars, count: int, display: Display) -> None:
    """Draw a group of bars for each row, a bar for each of so many designs, in the unit that fits all of them."""
    unit = bars[0][1].unit
    heights = np.array([_numbers(bar) for _, bar, _ in bars])
    dots = np.array([_numbers(dot) if dot else [math.nan] * count for _, _, dot in bars])
    scale = display.fitting(unit, [*heights.flat, *dots.flat])
    heights, dots = heights * scale.factor, dots * scale.factor
    logarithmic = _spans_decades(heights)
    width = GROUP_WIDTH / count
    for i in range(count):
        places = np.arange(len(bars)) + (i - (count - 1) / 2) * width
        if logarithmic:
            panel.plot(places, heights[:, i], "D", color=_colour(i), markersize=5.0)
        else:
            panel.bar(places, heights[:, i], width * 0.92, color=_colour(i))
        panel.plot(places, dots[:, i], "o", color="#333333", markersize=2.5)
        for place, (_, row, _) in zip(places, bars, strict=True):
            _say_missing(panel, float(place), row, i)
    panel.set_xlim(-0.5, len(bars) - 0.5)
    if logarithmic:
        panel.set_yscale("log")
        panel.margins(y=0.15)
    if len(bars) == 1 and not bars[0][0]:  # there is room for the letter of each design below its bar
        panel.set_xticks((np.arange(count) - (count - 1) / 2) * width, [*string.ascii_uppercase[:count]])
    else:
        panel.set_xticks(range(len(bars)), [label for label, _, _ in bars])
    panel.grid(visible=False, axis="x")
    panel.set_axisbelow(True)
    panel.tick_params(axis="x", length=0)
    panel.set_ylabel(scale.label(title) if unit != "1" else f"{title} (0 to 1)" if "margin" in title else title)


def _spans_decades(heights: Array) -> bool:
    """Return whether heights differ so much that the least could not be seen beside the greatest."""
    positive = heights[np.isfinite(heights) & (heights > 0.0)]
    return bool(positive.size) and bool(positive.max() > WIDE * positive.min())


def _say_missing(panel: Axes, place: float, row: DesignRow, i: int) -> None:
    """Write why a design has no bar: its mass is not known, it lacks the direction, or it is free there."""
    value = row.values[i]
    if value is None or not math.isfinite(value):
        absent = "not known" if row.unit == "kg" else "none"
        text = absent if value is None or math.isnan(value) else "infinite"
        transform = panel.get_xaxis_transform()
        panel.text(place, 0.02, text, transform=transform, rotation=90, ha="center", fontsize=6.5, color="#666666")


def _numbers(row: DesignRow) -> list[float]:
    return [math.nan if value is None or not math.isfinite(value) else value for value in row.values]


def _colour(i: int) -> str:
    return ("#999999", *COLOURS)[i % (len(COLOURS) + 1)]


def _short(label: str) -> str:
    return label if len(label) <= LONGEST_DESIGN_NAME else f"{label[: LONGEST_DESIGN_NAME - 1]}…"


def comparison_figures(comparison: Comparison) -> dict[str, Drawing]:
    """Return designs side by side as the one figure that they have."""
    caption = "Numbers of each design beside those of the others."
    return {"comparison": Drawing(caption, partial(comparison_figure, comparison), file="compare")}
