"""Figures of answers over a grid: curves over one field, contours over two, and regions in which the same legs carry.

Nothing is computed here.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from kinetostat.arrays import Array
from kinetostat.display import Scale, number, with_unit
from kinetostat.kinetostatics.quantities import QUANTITIES, group_of, plain_name
from kinetostat.studies.datasets import LOADS_LEFT_OUT, failures
from kinetostat.studies.result_file import thinned_dataset
from kinetostat.studies.stored_grid import StoredGrid
from kinetostat.views.figures import (
    NO_RESULT_COLOUR,
    NOTE_SIZE,
    STYLE,
    fill_regions,
    grid_shape,
    look_of,
    missing_line,
    new_figure,
    panel_grid,
    region_colours,
    slim_bar,
)
from kinetostat.views.grid import axis_values, display_of, frequent_sets, quantities_of
from kinetostat.views.map_scales import levels_of, set_axis_scales, thin_numbers, trim_height
from kinetostat.views.question import Drawing

if TYPE_CHECKING:
    from kinetostat.studies.tensions import Carrying

MOST_TICK_INTERVALS = 5
"""Intervals between the numbers along an axis of a map: as many across as up, whatever shape the panel has."""
MOST_CURVES_WITH_LEGEND_INSIDE = 6
"""Number of curves up to which the legend stands in the panel; the legend of more would cover them."""
SAME_ON_MAP = 1e-9
"""Relative spread of values up to which a map is constant: its contours would only follow round-off."""
CONSTANT_COLOUR = "#b5dbe3"
"""Pale blue of a map that is constant: no band of a contour map has it."""
MOST_COLOURED_COUNTS = 12
"""Number of whole values up to which each has a colour; more colours cannot be told apart, and contours are drawn."""
LEGEND_ROW = 0.17
"""Height of a line of the legend below a map, inches."""
MAP_SIZE, ROOM_BESIDE_MAPS = (2.75, 2.45), (0.3, 0.4)
"""Width and height of a map among others with its numbers and its colour bar, and of the labels of all, inches."""
SQUARE_HEIGHT = 1.4
"""Height of a map among others without its numbers, if it is square, inches."""
CURVES_SIZE = (3.4, 3.0)
"""Width and height of a panel of curves, inches."""
CARRYING_SIZE = (4.6, 4.4)
"""Width and height of the figure of legs that carry without its legend, inches; a map to scale changes the height."""
CARRYING_WIDTH, ROOM_BESIDE_CARRYING = 3.6, 1.5
"""Width of the map of legs that carry without its numbers, and height of its title, labels and numbers, inches."""


def grid_figures(dataset: xr.Dataset, title: str = "") -> dict[str, Drawing]:
    """Return curves over one field, or contours over two; a grid of more fields has no picture.

    Args:
        dataset: over the grid.
        title: the title of the figure; the name of the machine if empty.
    """
    if dataset["status"].ndim > 2:
        return {}
    over_one = dataset["status"].ndim == 1
    caption = f"The quantities over the {'parameter that varies' if over_one else 'two parameters that vary'}."
    draw = partial(grid_figure, dataset, quantities_of(dataset), title=title or dataset.attrs["machine"])
    return {"map": Drawing(caption, draw, file="sweep" if over_one else "map")}


def grid_figure(dataset: xr.Dataset, names: Sequence[str], title: str) -> Figure:
    """Draw quantities over a grid: curves over one dimension, contours over two.

    Args:
        dataset: one- or two-dimensional, from `studies.datasets.evaluate_grid`.
        names: the quantities.
        title: title of the whole figure.
    """
    return (grid_curves if dataset["status"].ndim == 1 else contour_maps)(dataset, names, title)


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


def contour_maps(dataset: xr.Dataset, names: Sequence[str], title: str) -> Figure:
    """Draw a panel for each quantity over two dimensions, contours labelled with their values; see `grid_figure`."""
    rows, columns = grid_shape(len(names))
    (width, height), (room_beside, room_above) = MAP_SIZE, ROOM_BESIDE_MAPS
    size = width * columns + room_beside, height * rows + room_above
    with new_figure(size, title, *setting_lines(dataset)) as figure:
        mpl.rcParams["axes.grid"] = False  # until the style of the figure ends
        panels, lines = panel_grid(figure, len(names)), []
        for place, (panel, name) in enumerate(zip(panels, names, strict=True)):
            is_lowest, is_first = place + columns >= len(names), place % columns == 0
            lines += _draw_map(panel, dataset, name, is_lowest, is_first)
        trim_height(figure, panels[0], SQUARE_HEIGHT * rows)
    with mpl.rc_context(STYLE):  # the values of contours need the layout, which is fixed as the figure ends
        for contours in lines:
            _write_levels(contours)
    return figure


def _draw_map(
    panel: Axes, dataset: xr.Dataset, name: str, labels_across: bool, labels_up: bool
) -> list[QuadContourSet]:
    """Draw a quantity over two dimensions, and return the lines whose values are still to be written.

    Args:
        panel: the panel to fill.
        dataset: a dataset of two dimensions.
        name: the quantity.
        labels_across, labels_up: whether the axes are labelled here; else a panel below or to the left has the label.
    """
    across, up = map(str, dataset["status"].dims)
    (x, x_label), (y, y_label) = axis_values(dataset, across), axis_values(dataset, up)
    scale = display_of(dataset).fitting(dataset[name].attrs["units"], dataset[name].values.flat)
    fill = _count_panel if _is_count(dataset[name]) else _contour_panel
    lines = fill(panel, x, y, dataset[name].transpose(up, across), scale)
    panel.set(xlabel=x_label if labels_across else "", ylabel=y_label if labels_up else "")
    panel.tick_params(labelbottom=labels_across, labelleft=labels_up)
    set_axis_scales(panel, dataset, across, up)
    thin_numbers(panel)
    return lines


def grid_curves(dataset: xr.Dataset, names: Sequence[str], title: str) -> Figure:
    """Draw quantities over one dimension, a panel for each unit; logarithmic where the range is; see `grid_figure`."""
    (across,) = dataset["status"].dims
    units = list(dict.fromkeys(dataset[name].attrs["units"] for name in names))
    width, height = CURVES_SIZE
    with new_figure((width * len(units) + 0.2, height), title, *setting_lines(dataset)) as figure:
        for panel, unit in zip(figure.subplots(1, len(units), squeeze=False).flat, units, strict=True):
            shown = [name for name in names if dataset[name].attrs["units"] == unit]
            _curve_panel(panel, dataset, str(across), shown)
    return figure


def setting_lines(dataset: xr.Dataset) -> tuple[str, str, str]:
    """Say in which frame and pose a grid lies, which loads do not count, and how many of its poses have no result."""
    missing = missing_line(failures(dataset), dataset["status"].size)
    frame_and_pose = "; ".join(text for text in (dataset.attrs.get("frame"), dataset.attrs.get("pose")) if text)
    return frame_and_pose, dataset.attrs.get(LOADS_LEFT_OUT, ""), missing


def _contour_panel(panel: Axes, x: Array, y: Array, data: xr.DataArray, scale: Scale) -> list[QuadContourSet]:
    """Fill a panel with bands of colour; return its lines, whose values can be written when the layout is fixed."""
    values = np.ma.masked_invalid(data.values * scale.factor)
    panel.set_title(scale.label(data.attrs["symbol"]))
    panel.set_facecolor(NO_RESULT_COLOUR)
    panel.set(xlim=(x.min(), x.max()), ylim=(y.min(), y.max()))
    panel.locator_params(nbins=MOST_TICK_INTERVALS)
    if values.count() == 0:
        _write_in_middle(panel, "no result")
        return []
    if np.ptp(values.compressed()) <= SAME_ON_MAP * np.abs(values).max():
        panel.set_facecolor(CONSTANT_COLOUR)
        _write_in_middle(panel, f"constant: {with_unit(number(float(values.compressed()[0])), scale.unit)}")
        return []
    levels = levels_of(values.compressed())
    norm = LogNorm(levels.bounds[0], levels.bounds[-1]) if levels.logarithmic else None
    filled = panel.contourf(x, y, values, levels.bounds, cmap="viridis", norm=norm, extend=levels.extend)
    bar = panel.figure.colorbar(filled, ax=panel, shrink=0.85, pad=0.03)
    if levels.logarithmic:
        bar.set_ticks(levels.bounds.tolist(), labels=[f"{bound:g}" for bound in levels.bounds])
    slim_bar(bar)
    return [panel.contour(filled, levels=levels.bounds[::2], colors="white", linewidths=0.5)]


def _is_count(data: xr.DataArray) -> bool:
    """Return whether a quantity counts, and takes so few values that each can have a colour."""
    name = str(data.name)
    return name in QUANTITIES and QUANTITIES[name].whole and _counts(data).size <= MOST_COLOURED_COUNTS


def _counts(data: xr.DataArray) -> Array:
    """Return the values that a quantity has at poses with a result, each once."""
    return np.unique(data.values[np.isfinite(data.values)])


def _count_panel(panel: Axes, x: Array, y: Array, data: xr.DataArray, scale: Scale) -> list[QuadContourSet]:
    """Fill a panel with a colour for each whole number; between two poses there is no line to draw."""
    values = _counts(data)
    if values.size < 2:
        return _contour_panel(panel, x, y, data, scale)
    panel.set_title(scale.label(data.attrs["symbol"]))
    colours = region_colours(values.size)
    mesh = fill_regions(panel, x, y, np.searchsorted(values, data.values), np.isfinite(data.values), colours)
    bar = panel.figure.colorbar(mesh, ax=panel, shrink=0.85, pad=0.03, ticks=np.arange(values.size))
    bar.set_ticklabels([f"{value:g}" for value in values])
    slim_bar(bar)
    return []


def _write_levels(lines: QuadContourSet) -> None:
    """Write the values of lines where they fit into the panel; the layout of the figure must be fixed."""
    frame, uncut = lines.axes.get_window_extent(), [*lines.get_paths()]
    texts = lines.clabel(fontsize=6, fmt="%.6g")
    boxes = [text.get_window_extent() for text in texts]
    fitting = [frame.contains(box.x0, box.y0) and frame.contains(box.x1, box.y1) for box in boxes]
    if not all(fitting):
        for text in texts:
            text.remove()
        lines.set_paths(uncut)
        if any(fitting):
            places = [text.get_position() for text, fits in zip(texts, fitting, strict=True) if fits]
            lines.clabel(fontsize=6, fmt="%.6g", manual=places)


def _write_in_middle(panel: Axes, text: str) -> None:
    panel.text(0.5, 0.5, text, transform=panel.transAxes, ha="center", va="center", fontsize=7.5)


def _curve_panel(panel: Axes, dataset: xr.Dataset, across: str, names: Sequence[str]) -> None:
    x, x_label = axis_values(dataset, across)
    logarithmic = bool(dataset[across].attrs["log"])
    values = np.concatenate([dataset[name].values for name in names])
    unit = dataset[names[0]].attrs["units"]
    scale = display_of(dataset).fitting(unit, values)
    for place, name in enumerate(names):
        panel.plot(x, dataset[name].values * scale.factor, label=dataset[name].attrs["symbol"], **look_of(place))
    if logarithmic:
        panel.set(xscale="log", yscale="log" if np.nanmin(values) > 0 else "linear")
    meaning = dataset[names[0]].attrs.get("long_name") or ", ".join(
        plain_name(group) for group in dict.fromkeys(group_of([name]) or name for name in names)
    )
    panel.set(xlabel=x_label, ylabel=scale.label(meaning))
    panel.margins(x=0.0)
    if len(names) > MOST_CURVES_WITH_LEGEND_INSIDE:
        panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    else:
        panel.legend(loc="best")


def carrying_map(carrying: "Carrying", title: str) -> Figure:
    """Draw the regions in which each set of legs carries, over the two dimensions of the grid."""
    dataset = carrying.dataset
    across, up = (str(dim) for dim in dataset["status"].dims)
    named = [f"{name}: {100.0 * n / dataset['status'].size:.0f} %" for name, n in frequent_sets(carrying)]
    colours = region_colours(max(len(named), 1))
    width, height = CARRYING_SIZE
    with new_figure((width, height + LEGEND_ROW * len(named)), title) as figure:
        panel = figure.subplots()
        (x, x_label), (y, y_label) = axis_values(dataset, across), axis_values(dataset, up)
        codes = dataset["carrying"].transpose(up, across).values
        fill_regions(panel, x, y, np.minimum(codes, len(named) - 1), codes >= 0, colours)
        panel.set(xlabel=x_label, ylabel=y_label)
        set_axis_scales(panel, dataset, across, up)
        if panel.get_aspect() == 1.0:
            map_height = CARRYING_WIDTH * float(np.ptp(y) / np.ptp(x))
            figure.set_figheight(ROOM_BESIDE_CARRYING + LEGEND_ROW * len(named) + map_height)
        patches = [Patch(color=colour, label=name) for colour, name in zip(colours, named, strict=False)]
        patches += [Patch(color=NO_RESULT_COLOUR, label="no result")] if (codes < 0).any() else []
        setting = "\n".join(line for line in setting_lines(dataset) if line)
        figure.legend(handles=patches, loc="outside lower center", ncols=1, title=setting, title_fontsize=NOTE_SIZE)
    return figure
