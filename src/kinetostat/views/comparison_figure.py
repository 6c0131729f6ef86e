"""Figure of a comparison of designs: grouped bars, a panel for each unit. Nothing is computed here but scales."""

import math
import string
from collections.abc import Sequence
from functools import partial

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from kinetostat.display import Display
from kinetostat.studies.comparison import Comparison, DesignRow
from kinetostat.studies.setting import frame_of
from kinetostat.views.figures import COLOURS, STYLE, fix_layout, set_title
from kinetostat.views.question import Drawing

WIDE = 30.0
"""An axis is logarithmic if the largest bar exceeds the least by more than this factor."""
LONGEST_DESIGN_NAME = 100
"""Greatest number of characters of a design's name in the legend."""


def comparison_figure(comparison: Comparison, title: str = "Designs compared, {}") -> Figure:
    """Draw the compliance, singularity margin and mass of each design; over a grid, bars are means and dots the worst.

    Bars start at 0. If the numbers of a panel differ too much for that, its axis is logarithmic, and marks take the
    place of bars, because the length of a bar has no meaning there.
    """
    grid = bool(comparison.ranges)
    rows = comparison.over if grid else comparison.rows
    panels = [panel for panel in (*_compliance(rows, grid), *_scalars(comparison, rows, grid)) if panel[1]]
    widths = [0.9 + 0.55 * len(bars) for _, bars in panels]
    with mpl.rc_context(STYLE):
        height = 2.9 + 0.17 * len(comparison.designs)
        figure = Figure(figsize=(sum(widths) + 0.6 * len(panels) + 0.6, height), layout="constrained")
        axes = figure.subplots(1, len(panels), squeeze=False, width_ratios=widths).flat
        for panel, (title, bars) in zip(axes, panels, strict=True):
            _bars(panel, title, bars, len(comparison.designs), comparison.machine.display)
        styles = zip(string.ascii_uppercase, comparison.designs, strict=False)
        handles = [
            Patch(color=_colour(i), label=f"{letter}  {_short(design.label)}")
            for i, (letter, design) in enumerate(styles)
        ]
        frames = dict.fromkeys(frame_of(design.machine) for design in comparison.designs)
        legend = f"compliance in {' or '.join(frames)}"
        figure.legend(handles=handles, loc="outside lower left", title=legend, title_fontsize=6.5, alignment="left")
        over = (
            f"mean (bars) and worst (dots) over {', '.join(comparison.ranges)}"
            if grid
            else "at the pose of each design"
        )
        set_title(figure, title.format(over))
        fix_layout(figure)
    return figure


Bars = list[tuple[str, DesignRow, DesignRow | None]]
"""For each group of bars: its label, the row of the bars, and the row of the dots if there are any."""


def _compliance(rows: Sequence[DesignRow], grid: bool) -> list[tuple[str, Bars]]:
    diagonal = [row for row in rows if (row.group.startswith("C_") if grid else row.group == "compliance")]
    panels: dict[str, Bars] = {"compliance about axes": [], "compliance along axes": []}
    for label, bar, dot in _pairs(diagonal, grid):
        panels[f"compliance {'about' if label.startswith('r') else 'along'} axes"].append((label, bar, dot))
    return list(panels.items())


def _scalars(comparison: Comparison, rows: Sequence[DesignRow], grid: bool) -> list[tuple[str, Bars]]:
    regular = [row for row in rows if (row.group if grid else row.name) == "singularity margin"]
    mass = [row for row in comparison.rows if row.name == "moving mass"]
    return [("singularity margin", _pairs(regular, grid)), ("moving mass", [("", row, None) for row in mass])]


def _pairs(rows: Sequence[DesignRow], grid: bool) -> Bars:
    if not grid:
        return [(row.name.removeprefix("C_").replace("singularity margin", ""), row, None) for row in rows]
    groups: dict[str, dict[str, DesignRow]] = {}
    for row in rows:
        groups.setdefault(row.group.removeprefix("C_").replace("singularity margin", ""), {})[row.name] = row
    return [(label, group["mean"], group["worst"]) for label, group in groups.items()]


def _bars(panel: Axes, title: str, bars: Bars, count: int, display: Display) -> None:
    unit = bars[0][1].unit
    heights = np.array([_numbers(bar) for _, bar, _ in bars])
    dots = np.array([_numbers(dot) if dot else [math.nan] * count for _, _, dot in bars])
    scale = display.scale(unit)
    heights, dots = heights * scale.factor, dots * scale.factor
    width = 0.8 / count
    positive = heights[np.isfinite(heights) & (heights > 0.0)]
    logarithmic = bool(positive.size) and positive.max() > WIDE * positive.min()
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
    panel.set_xticks(range(len(bars)), [label for label, _, _ in bars])
    panel.grid(visible=False, axis="x")
    panel.set_axisbelow(True)
    panel.tick_params(axis="x", length=0)
    panel.set_ylabel(scale.label(title) if unit != "1" else f"{title} (0 to 1)")


def _say_missing(panel: Axes, place: float, row: DesignRow, i: int) -> None:
    """Write why a design has no bar: its mass is not known, it lacks the direction, or it is free there."""
    value = row.values[i]
    if value is None or not math.isfinite(value):
        absent = "not known" if row.unit == "kg" else "none"
        text = absent if value is None or math.isnan(value) else "infinite"
        where = panel.get_xaxis_transform()
        panel.text(place, 0.02, text, transform=where, rotation=90, ha="center", fontsize=6.5, color="#666666")


def _numbers(row: DesignRow) -> list[float]:
    return [math.nan if value is None or not math.isfinite(value) else value for value in row.values]


def _colour(i: int) -> str:
    return ("#999999", *COLOURS)[i % (len(COLOURS) + 1)]


def _short(label: str) -> str:
    return label if len(label) <= LONGEST_DESIGN_NAME else f"{label[: LONGEST_DESIGN_NAME - 1]}…"


def comparison_figures(comparison: Comparison) -> dict[str, Drawing]:
    """Return designs side by side as the one figure that they have."""
    caption = "Compliance, singularity margin and mass of each design."
    return {"comparison": Drawing(caption, partial(comparison_figure, comparison), file="compare")}
