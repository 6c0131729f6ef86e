"""Sensitivities as a figure for print: parameters by rank against indices, coloured by sign and size."""

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import SymLogNorm
from matplotlib.figure import Figure

from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.parameters import with_leg
from kinetostat.studies.sensitivity import PER, Sensitivity
from kinetostat.studies.setting import setting_of
from kinetostat.views.figures import STYLE, fix_layout, note_setting

MOST_ROWS = 30
"""Parameters that are shown."""
LINEAR = 0.01
"""Percent per percent up to which colours grow in proportion, and from where on with the logarithm."""
LEAST = 0.0005
"""Percent per percent below which a 0 is printed."""
DARK = 0.6
"""Share of the colour scale beyond which text on it is white."""


def sensitivity_figure(answer: Sensitivity) -> Figure:
    """A table of coloured cells: red where the index grows with the parameter, blue where it falls."""
    rows = {with_leg(answer.machine, one.path): one.percents for one in answer.influences}
    heads = [QUANTITIES[name].symbol for name in answer.quantities]
    return coloured_table((answer.machine.name, setting_of(answer.machine)), rows, heads, "RdBu_r", PER)


def coloured_table(
    titles: tuple[str, str], rows: Mapping[str, Sequence[float | None]], heads: Sequence[str], colours: str, label: str
) -> Figure:
    """Numbers in cells coloured by sign and size; the first rows, as many as a page takes.

    Args:
        titles: over the figure, and below it where its numbers hold.
        rows: percent per percent in each column, by parameter; None is grey.
        heads: of the columns.
        colours: name of a diverging colour map.
        label: of its bar.
    """
    shown = list(rows)[:MOST_ROWS]
    cells = np.array([[np.nan if p is None else p for p in rows[path]] for path in shown], dtype=float)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(2.6 + 0.7 * len(heads), 1.1 + 0.2 * len(shown)), layout="constrained")
        panel = figure.subplots()
        _draw_cells(panel, cells, colours, label)
        panel.set_yticks(range(len(shown)), shown)
        panel.set_xticks(range(len(heads)), heads)
        figure.suptitle(titles[0], fontsize=10)
        note_setting(figure, titles[1])
        fix_layout(figure)
    return figure


def _draw_cells(panel: Axes, cells: npt.NDArray[np.float64], colours: str, label: str) -> None:
    most = max(float(np.nanmax(np.abs(cells), initial=0.0)), 10.0 * LINEAR)
    scale = SymLogNorm(LINEAR, vmin=-most, vmax=most)
    image = panel.imshow(np.ma.masked_invalid(cells), cmap=colours, norm=scale, aspect="auto")
    panel.set_facecolor("#eeeeee")
    panel.grid(visible=False)
    panel.tick_params(length=0, top=False)
    for (row, column), value in np.ndenumerate(cells):
        if np.isfinite(value):
            dark = abs(float(scale(value)) - 0.5) > 0.5 * DARK
            text = f"{value:.2g}" if abs(value) >= LEAST else "0"
            panel.text(column, row, text, ha="center", va="center", fontsize=6, color="white" if dark else "black")
    bar = panel.figure.colorbar(image, ax=panel, pad=0.02, label=label)
    bar.outline.set_linewidth(0.4)
    bar.ax.tick_params(labelsize=6.5, width=0.4)
