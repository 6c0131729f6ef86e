"""Figures of an error budget: bars of the contributions, and the error over a path, a sweep or a map."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kinetostat.machine.machine import setting_of
from kinetostat.studies.budget import Budget
from kinetostat.views.budget import ranked_by
from kinetostat.views.budget_data import budget_dataset
from kinetostat.views.figures import COLOURS, new_figure
from kinetostat.views.grid_figures import contour_maps, grid_curves
from kinetostat.views.lettering import width_of
from kinetostat.views.question import Drawing

MOST_BARS = 15
"""Single tolerances that have bars, at most: as many as a page has lines beside the other panels."""
LEAST_LABEL_WIDTH = 4.0
"""Least room for the labels of bars, inches: most paths fit."""
BAR_HEIGHT = 0.8
"""Height of all bars of a row together, as a share of the distance between rows."""


def budget_figures(budget: Budget) -> dict[str, Drawing]:
    """Return the drawings of a budget by name: contributions, and the error over the poses if there are many."""
    drawings = {}
    if budget.shares.any():
        caption = "What the variance of the error is made of."
        drawings["contributions"] = Drawing(caption, partial(contributions_figure, budget))
    dims = 1 if budget.question is None else len(budget.question.dims)
    if len(budget.status) > 1 and dims <= 2:
        over = Drawing("The error of the tool over the poses.", partial(_over_poses, budget))
        drawings["map" if dims == 2 else "curves"] = over
    return drawings


def _over_poses(budget: Budget, title: str = "{}: error of the tool") -> Figure:
    dataset, measures, title = budget_dataset(budget), ranked_by(budget), title.format(budget.machine.name)
    if len(dataset["status"].dims) == 2:
        # Percentiles of drawn machines have noise, of which a map would draw contours.
        return contour_maps(dataset, [f"rms_{name}" for name in measures], title)
    names = [f"{statistic}_{name}" for name in measures for statistic in ("rms", "usual", "worst")]
    return grid_curves(dataset, names, title)


def contributions_figure(budget: Budget, title: str = "{}: what the error of the tool is made of") -> Figure:
    """Draw what the variance of the error is made of: by line of [tolerances], by leg, by single tolerance.

    Args:
        budget: budget of a machine with tolerances.
        title: title of the figure, with braces for the name of the machine.
    """
    names = ranked_by(budget)
    rows = budget.shares[[budget.measures.index(name) for name in names]]
    order = budget.ranking[:MOST_BARS]
    panels = {
        "lines of [tolerances]": _sums(budget, "line", names),
        "legs": _sums(budget, "leg", names),
        "largest single tolerances": {budget.parts[i].words: rows[:, i].tolist() for i in order},
    }
    heights = [len(bars) + 0.6 for bars in panels.values()]
    beside = max(LEAST_LABEL_WIDTH, width_of(label for bars in panels.values() for label in bars))
    many = f"{len(budget.status):,} poses together" if len(budget.status) > 1 else setting_of(budget.machine)
    with new_figure((beside + 2.4, 1.4 + 0.24 * sum(heights)), title.format(budget.machine.name), many) as figure:
        axes = figure.subplots(len(panels), 1, height_ratios=heights, squeeze=False)[:, 0]
        for panel, (name, bars) in zip(axes, panels.items(), strict=True):
            _bars(panel, name, bars, names)
        axes[-1].set_xlabel("share of the variance (%)")
        if len(names) > 1:
            axes[-1].legend(loc="lower right")
    return figure


def _sums(budget: Budget, key: str, names: list[str]) -> dict[str, list[float]]:
    """Return the shares of the variance of each measure in `names`, added up by "line" or "leg"."""
    sums = [budget.shares_by(key, name) for name in names]
    return {label: [each[label] for each in sums] for label in sums[0]}


def _bars(panel: Axes, title: str, bars: dict[str, list[float]], names: list[str]) -> None:
    places, height = np.arange(len(bars)), BAR_HEIGHT / len(names)
    for number, (name, colour) in enumerate(zip(names, COLOURS, strict=False)):
        widths = [100.0 * shares[number] for shares in bars.values()]
        panel.barh(places + (number - 0.5 * (len(names) - 1)) * height, widths, 0.92 * height, color=colour, label=name)
    panel.set_yticks(places, list(bars))
    panel.set_ylim(len(bars) - 0.4, -0.6)
    panel.set_title(title, loc="left")
    panel.set_axisbelow(True)
    panel.grid(visible=False, axis="y")
    panel.tick_params(axis="y", length=0)
    panel.margins(x=0.02)
