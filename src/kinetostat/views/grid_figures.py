"""Figures of answers at many poses: curves, contours, regions where the same legs carry, quantities along a path.

Nothing is computed here.
"""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from kinetostat.arrays import Array, Integers
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, group_of, plain_name
from kinetostat.machine.machine import setting_of
from kinetostat.machine.parameters import named_entry
from kinetostat.studies.evaluation import PoseAnswers
from kinetostat.studies.result_file import thinned_dataset
from kinetostat.studies.stored_grid import StoredGrid
from kinetostat.views.figures import (
    contour_maps,
    curves,
    fill_regions,
    look_of,
    missing_line,
    new_figure,
    region_colours,
    setting_lines,
)
from kinetostat.views.grid import axis_values, frequent_sets, quantities_of
from kinetostat.views.map_scales import set_axis_scales
from kinetostat.views.question import Drawing

if TYPE_CHECKING:
    from kinetostat.studies.carrying import Carrying

LEGEND_ROW = 0.17
"""Height of a line of the legend below a map, inches."""
NO_RESULT_COLOUR = "#dddddd"
"""Colour behind poses that have no result."""
MOST_DOTS = 60
"""Number of poses up to which each is marked with a dot."""


def grid_figures(dataset: xr.Dataset, title: str = "") -> dict[str, Drawing]:
    """Return curves over one field, or contours over two; a grid of more fields has no picture.

    Args:
        dataset: over the grid.
        title: the title of the figure; the name of the machine if empty.
    """
    shown: dict[int, tuple[Callable[..., Figure], str, str]] = {
        1: (curves, "sweep", "The quantities over the parameter that varies."),
        2: (contour_maps, "map", "The quantities over the two parameters that vary."),
    }
    if dataset["status"].ndim not in shown:
        return {}
    draw, file, caption = shown[dataset["status"].ndim]
    named = partial(draw, dataset, quantities_of(dataset), title=title or dataset.attrs["machine"])
    return {"map": Drawing(caption, named, file=file)}


def stored_figures(stored: StoredGrid) -> dict[str, Drawing]:
    """Return the figure of a large grid of one or two fields, thinned to as many points as paper can show."""
    if len(stored.question.dims) > 2:
        return {}
    dataset = thinned_dataset(stored.path)
    return grid_figures(dataset, f"{dataset.attrs['machine']} (thinned)")


def carrying_figures(carrying: "Carrying") -> dict[str, Drawing]:
    """Return the map of which legs carry; a grid over one field has none."""
    caption, title = "Regions in which the same legs carry.", f"{carrying.machine.name}: legs that carry"
    draw = partial(carrying_map, carrying, title=title)
    return {"map": Drawing(caption, draw, file="carrying")} if carrying.is_map else {}


def carrying_map(carrying: "Carrying", title: str) -> Figure:
    """Draw the regions in which each set of legs carries, over the two dimensions of the grid."""
    dataset = carrying.dataset
    across, up = (str(dim) for dim in dataset["status"].dims)
    named = [f"{name}: {100.0 * n / dataset['status'].size:.0f} %" for name, n in frequent_sets(carrying)]
    colours = region_colours(max(len(named), 1))
    with new_figure((4.6, 4.4 + LEGEND_ROW * len(named)), title) as figure:
        panel = figure.subplots()
        (x, x_label), (y, y_label) = axis_values(dataset, across), axis_values(dataset, up)
        codes = dataset["carrying"].transpose(up, across).values
        fill_regions(panel, x, y, np.minimum(codes, len(named) - 1), codes >= 0, colours)
        panel.set(xlabel=x_label, ylabel=y_label)
        set_axis_scales(panel, dataset, across, up)
        if panel.get_aspect() == 1.0:
            figure.set_figheight(1.5 + LEGEND_ROW * len(named) + 3.6 * float(np.ptp(y) / np.ptp(x)))
        patches = [Patch(color=colour, label=name) for colour, name in zip(colours, named, strict=False)]
        patches += [Patch(color="#eeeeee", label="no result")] if (codes < 0).any() else []
        about = "\n".join(line for line in setting_lines(dataset) if line)
        figure.legend(handles=patches, loc="outside lower center", ncols=1, title=about, title_fontsize=6.5)
    return figure


def path_figures(answers: PoseAnswers) -> dict[str, Drawing]:
    """Return the one figure of quantities along a path."""
    return {"path": Drawing("Quantities along the poses.", partial(path_figure, answers))}


def path_figure(answers: PoseAnswers, title: str = "{}") -> Figure:
    """Draw quantities along a path, a panel for each unit; poses without a result are grey.

    Args:
        answers: the answers at the poses, which are taken as neighbours in the order in which they are given.
        title: over the figure, with braces for the name of the machine.
    """
    names = list(answers.values)
    groups = {unit: [n for n in names if QUANTITIES[n].unit == unit] for unit in (QUANTITIES[n].unit for n in names)}
    fields = [pair for pair in zip(answers.poses.fields, answers.poses.values, strict=True) if np.ptp(pair[1]) > 0.0]
    kinds = list(dict.fromkeys(field.quantity.kind for field, _ in fields))
    rows = len(groups) + len(kinds)
    with new_figure(
        (6.6, 0.7 + 1.9 * len(groups) + 1.25 * len(kinds)), title.format(answers.machine.name), *_notes(answers)
    ) as figure:
        ratios = [1.9] * len(groups) + [1.25] * len(kinds)
        panels = list(figure.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=ratios).flat)
        for panel, (unit, members) in zip(panels, groups.items(), strict=False):
            every = (v for name in members for v in answers.values[name])
            scale = answers.machine.display.fitting(unit, every)
            curves = {QUANTITIES[name].symbol: answers.values[name] * scale.factor for name in members}
            _draw_panel(panel, answers, curves, scale.label(plain_name(group_of(members) or members[0])))
        for panel, kind in zip(panels[len(groups) :], kinds, strict=True):
            shown = [(field, values) for field, values in fields if field.quantity.kind == kind]
            scale = answers.machine.display.scale(shown[0][0].unit)
            _draw_panel(
                panel, answers, {named_entry(f.shown): values * scale.factor for f, values in shown}, scale.label(kind)
            )
        panels[-1].set_xlabel("pose")
    return figure


def _draw_panel(panel: Axes, answers: PoseAnswers, curves: dict[str, Array], label: str) -> None:
    numbers = np.arange(1, answers.poses.count + 1)
    _shade(panel, np.flatnonzero(answers.status != Status.OK) + 1)
    marker = "." if len(numbers) <= MOST_DOTS else ""
    for place, (name, values) in enumerate(curves.items()):
        finite = np.where(np.isfinite(values), values, np.nan)
        panel.plot(numbers, finite, marker=marker, label=name, **look_of(place))
    panel.set_ylabel(label)
    panel.margins(x=0.0)
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _shade(panel: Axes, numbers: Integers) -> None:
    """Shade the poses of these numbers; neighbours share one strip."""
    for run in np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1):
        if len(run):
            panel.axvspan(run[0] - 0.5, run[-1] + 0.5, color=NO_RESULT_COLOUR, linewidth=0.0)


def _notes(answers: PoseAnswers) -> tuple[str, str, str]:
    """The lines below the title: numbers that differ from the file, loads left out, and poses without a result."""
    counts = {status: len(numbers) for status, numbers in answers.failures.items()}
    missing = missing_line(counts, answers.poses.count, " (grey)")
    return setting_of(answers.machine, list(answers.poses.leaves)), answers.loads_left_out, missing
