"""Which legs carry over a grid, as a table of the sets of legs and as a map of their regions. Nothing is computed."""

from collections.abc import Iterator
from functools import partial

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from rich.console import Console

from kinetostat.machine.parameters import shown
from kinetostat.studies.carrying import Carrying
from kinetostat.studies.grid import field_of
from kinetostat.views.figures import (
    STYLE,
    Drawings,
    axis_values,
    fill_regions,
    fix_layout,
    region_colours,
    set_axis_scales,
    set_title,
    setting_lines,
)
from kinetostat.views.grid_tables import print_failures
from kinetostat.views.tables import numeric_table

MOST_NAMED = 11
"""Sets of legs that have a colour and a line each; rarer ones share the last colour."""

ROW = 0.17
"""Inches of a line below the map."""


def print_carrying(console: Console, carrying: Carrying) -> None:
    """Print how often each set of legs carries."""
    dataset = carrying.dataset
    size = " × ".join(f"{shown(field_of(dataset[dim]))} ({n})" for dim, n in dataset.sizes.items())
    table = numeric_table(f"{dataset.attrs['machine']}: {size}", "legs that carry", ["points", "share"])
    for name, count in _shares(carrying):
        table.add_row(name, f"{count:,}", f"{100.0 * count / dataset['status'].size:.3g} %")
    console.print(table)
    print_failures(console, dataset)


def _shares(carrying: Carrying) -> Iterator[tuple[str, int]]:
    """Name each frequent set, and how many points it has; all others together."""
    for legs, count in list(zip(carrying.sets, carrying.points, strict=True))[:MOST_NAMED]:
        yield "all" if legs == carrying.legs else ", ".join(legs) or "none", count
    if rare := carrying.points[MOST_NAMED:]:
        yield f"{len(rare):,} other sets", sum(rare)


def carrying_map(carrying: Carrying) -> Figure:
    """Draw the regions in which each set of legs carries, over the two dimensions of the grid."""
    dataset = carrying.dataset
    across, up = (str(dim) for dim in dataset["status"].dims)
    named = [f"{name}: {100.0 * n / dataset['status'].size:.0f} %" for name, n in _shares(carrying)]
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
        set_title(figure, f"{dataset.attrs['machine']}: legs that carry")
        fix_layout(figure)
    return figure


def carrying_figures(carrying: Carrying) -> Drawings:
    """Return the map of which legs carry; a grid over one field has none."""
    return {"map": partial(carrying_map, carrying)} if carrying.is_map else {}
