"""The numbers of an error budget in other forms than text: contributions and poses as CSV, a labelled dataset, figures.

Files are in SI; figures show the contributions as bars, and the error over a path, a sweep or a map.
"""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from kinetostat.late import LateModule
from kinetostat.machine.machine import setting_of
from kinetostat.machine.parameters import data_name
from kinetostat.studies.budget import STATISTICS, Budget
from kinetostat.studies.datasets import ABOUT_POSES, ABOUT_STATUS, origin_of
from kinetostat.units import KINDS
from kinetostat.views.data_forms import NumberColumn, column_head, columns_csv, status_words, with_heads
from kinetostat.views.question import Drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from kinetostat.views import figures, grid_figures, layout
else:
    figures = LateModule("kinetostat.views.figures")
    grid_figures = LateModule("kinetostat.views.grid_figures")
    layout = LateModule("kinetostat.views.layout")

MOST_BARS = 15
"""Single tolerances that have bars, at most: as many as a page has lines beside the other panels."""
LEAST_LABEL_WIDTH = 4.0
"""Least room for the labels of bars, inches: most names of tolerances fit."""
BARS_WIDTH, ROW_HEIGHT, ROOM_FOR_TITLE = 2.4, 0.24, 1.4
"""Width of the panels of bars beside their labels, height of a row, and of title, scale and notes, inches."""
BAR_HEIGHT = 0.8
"""Height of all bars of a row together, as a share of the distance between rows."""


def ranked_by(answer: Budget) -> list[str]:
    """Return the measures whose shares are listed, the leading one first."""
    rotation = "rotation" if "rotation" in answer.measures else "rz"  # of a planar machine
    return [name for name in ("along", "position", rotation) if name in answer.measures]


def varied_fields(answer: Budget) -> dict[str, NumberColumn]:
    """Return the coordinates that vary over the poses, by path, with their values at each pose."""
    if answer.question is not None:
        columns, labels = answer.question.grid.columns(0, answer.question.grid.size), answer.question.labels
        paths = zip(answer.question.fields, answer.question.grid.axes, labels.coords, strict=True)
        return {path: NumberColumn(labels[name].attrs["units"], columns[axis.paths[0]]) for path, axis, name in paths}
    if answer.poses is None:
        return {}
    pairs = zip(answer.poses.fields, answer.poses.values, strict=True)
    return {field.path: NumberColumn(field.unit, values) for field, values in pairs}


def contributions_csv(answer: Budget) -> str:
    """Write the share of each tolerance in the variance of each measure as CSV, the most important first."""
    order = answer.ranking
    parts = [answer.parts[place] for place in order]
    columns: dict[str, Any] = {"path": [part.path for part in parts], "meaning": [part.words for part in parts]}
    columns |= {name: [getattr(part, name) for part in parts] for name in ("leg", "group", "line")}
    columns |= {"tolerance": [part.limit for part in parts], "unit": [KINDS[part.kind].unit for part in parts]}
    rows = zip(answer.measures, answer.shares[:, order].tolist(), strict=True)
    return columns_csv(columns | {f"share {name}": shares for name, shares in rows})


def poses_csv(answer: Budget) -> str | None:
    """Write the error at each pose as CSV: its number from 1, its fields, its status, each measure.

    Returns:
        The text; None if there is a single pose.
    """
    if len(answer.status) == 1:
        return None
    columns: dict[str, Any] = {"pose": range(1, len(answer.status) + 1)}
    columns |= with_heads({data_name(path): column for path, column in varied_fields(answer).items()})
    columns["status"] = status_words(answer.status)
    for statistic in STATISTICS:
        for measure, unit in zip(answer.measures, answer.units, strict=True):
            columns[column_head(f"{statistic} {measure}", unit)] = answer.size(statistic, measure)
    return columns_csv(columns)


def budget_dataset(answer: Budget) -> xr.Dataset:
    """Label the errors at all poses: over the grid, or over the dimension `pose` of a list.

    Variables are named by statistic and measure, "usual_position"; units are in `attrs`, and NaN stands where the
    status is not ok (0).
    """
    labels = _labels(answer) if answer.question is None else answer.question.labels
    dims = tuple(map(str, labels.dims))
    shape = tuple(labels.sizes[dim] for dim in dims)
    variables: dict[str, Any] = {"status": (dims, answer.status.reshape(shape), ABOUT_STATUS)}
    for statistic, title in STATISTICS.items():
        for measure, unit in zip(answer.measures, answer.units, strict=True):
            attributes = {"units": unit, "symbol": f"{measure}, {title}", "long_name": f"{measure} error"}
            sizes = answer.size(statistic, measure).reshape(shape)
            variables[f"{statistic}_{measure.replace(' ', '_')}"] = (dims, sizes, attributes)
    return labels.assign(variables)


def _labels(answer: Budget) -> xr.Dataset:
    """Return the coordinates and attributes of a list of poses."""
    coordinates: dict[str, Any] = {"pose": ("pose", np.arange(1, len(answer.status) + 1), ABOUT_POSES)}
    varied = [] if answer.poses is None else list(answer.poses.leaves)
    pairs = [] if answer.poses is None else zip(answer.poses.fields, answer.poses.values, strict=True)
    for field, values in pairs:
        coordinates[field.dimension] = ("pose", values, {"units": field.unit, "field": field.path})
    return xr.Dataset({}, coordinates, origin_of(answer.machine, varied, answer.loads_left_out))


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


def _over_poses(budget: Budget, title: str = "{}: error of the tool") -> "Figure":
    dataset, measures, title = budget_dataset(budget), ranked_by(budget), title.format(budget.machine.name)
    # Percentiles of drawn machines have noise, of which a map would draw contours.
    statistics = ("rms",) if dataset["status"].ndim == 2 else ("rms", "usual", "worst")
    return grid_figures.grid_figure(dataset, [f"{s}_{name}" for name in measures for s in statistics], title)


def contributions_figure(budget: Budget, title: str = "{}: what the error of the tool is made of") -> "Figure":
    """Draw what the variance of the error is made of: by line of [tolerances], by leg, by single tolerance."""
    names = ranked_by(budget)
    rows = budget.shares[[budget.measures.index(name) for name in names]]
    order = budget.ranking[:MOST_BARS]
    panels = {
        "lines of [tolerances]": _sums(budget, "line", names),
        "legs": _sums(budget, "leg", names),
        "largest single tolerances": {budget.parts[i].words: rows[:, i].tolist() for i in order},
    }
    heights = [len(bars) + 0.6 for bars in panels.values()]
    label_width = max(LEAST_LABEL_WIDTH, layout.width_of(label for bars in panels.values() for label in bars))
    many = f"{len(budget.status):,} poses together" if len(budget.status) > 1 else setting_of(budget.machine)
    with figures.new_figure(
        (label_width + BARS_WIDTH, ROOM_FOR_TITLE + ROW_HEIGHT * sum(heights)), title.format(budget.machine.name), many
    ) as figure:
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


def _bars(panel: "Axes", title: str, bars: dict[str, list[float]], names: list[str]) -> None:
    places, height = np.arange(len(bars)), BAR_HEIGHT / len(names)
    for number, (name, colour) in enumerate(zip(names, figures.COLOURS, strict=False)):
        widths = [100.0 * shares[number] for shares in bars.values()]
        panel.barh(
            places + (number - 0.5 * (len(names) - 1)) * height,
            widths,
            figures.BAR_SHARE * height,
            color=colour,
            label=name,
        )
    panel.set_yticks(places, list(bars))
    panel.set_ylim(len(bars) - 0.4, -0.6)
    panel.set_title(title, loc="left")
    panel.set_axisbelow(True)
    panel.grid(visible=False, axis="y")
    panel.tick_params(axis="y", length=0)
    panel.margins(x=0.02)
