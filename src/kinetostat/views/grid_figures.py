"""Figures of answers over a grid: curves, contours, regions in which the same legs carry. Nothing is computed."""

from collections.abc import Callable
from functools import partial

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from kinetostat.studies.carrying import Carrying
from kinetostat.studies.result_file import thinned_dataset
from kinetostat.studies.stored_grid import StoredGrid
from kinetostat.views.figures import (
    STYLE,
    axis_values,
    contour_maps,
    curves,
    fill_regions,
    fix_layout,
    region_colours,
    set_axis_scales,
    set_title,
    setting_lines,
)
from kinetostat.views.grid import frequent_sets, quantities_of
from kinetostat.views.question import Drawing

ROW = 0.17
"""Inches of a line below the map."""


def grid_figures(dataset: xr.Dataset, title: str = "") -> dict[str, Drawing]:
    """Return curves over one field, or contours over two; a grid of more fields has no picture.

    Args:
        dataset: over the grid.
        title: of the figure; the name of the machine if empty.
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


def carrying_figures(carrying: Carrying) -> dict[str, Drawing]:
    """Return the map of which legs carry; a grid over one field has none."""
    caption, title = "Regions in which the same legs carry.", f"{carrying.machine.name}: legs that carry"
    draw = partial(carrying_map, carrying, title=title)
    return {"map": Drawing(caption, draw, file="carrying")} if carrying.is_map else {}


def carrying_map(carrying: Carrying, title: str) -> Figure:
    """Draw the regions in which each set of legs carries, over the two dimensions of the grid."""
    dataset = carrying.dataset
    across, up = (str(dim) for dim in dataset["status"].dims)
    named = [f"{name}: {100.0 * n / dataset['status'].size:.0f} %" for name, n in frequent_sets(carrying)]
    colours = region_colours(max(len(named), 1))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(4.6, 4.4 + ROW * len(named)), layout="constrained")
        panel = figure.subplots()
        (x, x_label), (y, y_label) = axis_values(dataset, across), axis_values(dataset, up)
        codes = dataset["carrying"].transpose(up, across).values
        fill_regions(panel, x, y, np.minimum(codes, len(named) - 1), codes >= 0, colours)
        panel.set(xlabel=x_label, ylabel=y_label)
        set_axis_scales(panel, dataset, across, up)
        if panel.get_aspect() == 1.0:
            figure.set_figheight(1.5 + ROW * len(named) + 3.6 * float(np.ptp(y) / np.ptp(x)))
        patches = [Patch(color=colour, label=name) for colour, name in zip(colours, named, strict=False)]
        patches += [Patch(color="#eeeeee", label="no result")] if (codes < 0).any() else []
        about = "\n".join(line for line in setting_lines(dataset) if line)
        figure.legend(handles=patches, loc="outside lower center", ncols=1, title=about, title_fontsize=6.5)
        set_title(figure, title)
        fix_layout(figure)
    return figure
