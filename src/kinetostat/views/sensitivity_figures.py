"""Figures of sensitivities, for print: parameters against indices as a table of coloured cells.

Numbers come from `studies`; only scales and colours are chosen here.
"""

import textwrap
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from kinetostat.arrays import Array
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import setting_of
from kinetostat.machine.parameters import with_leg
from kinetostat.studies.sensitivity import UNIT_OF_PERCENTS, Sensitivity
from kinetostat.views.figures import new_figure, slim_bar
from kinetostat.views.lettering import width_of
from kinetostat.views.map_scales import exceeded_ends, usual_range
from kinetostat.views.question import Drawing
from kinetostat.views.sensitivity import NEGLIGIBLE

MOST_ROWS = 30
"""Parameters that a table of coloured cells shows: those that fit on a page."""
LEAST_NAME_WIDTH = 2.1
"""Least room for the names of parameters, inches: most paths fit."""
LEAST_SCALE = 0.1
"""Percent per percent at the end of the colour scale, at least: influences that are all small stay pale."""
LETTERS_PER_INCH = 12
"""Characters of the label of a colour bar per inch of its height, at the size of labels in all figures."""
CELL_SIZE = (0.7, 0.2)
"""Width and height of a cell, inches: a number of two digits with its sign fits."""
ROOM_BESIDE_CELLS = (0.5, 1.1)
"""Further width, of the colour bar, and height, of title, notes and heads of columns, inches."""
BAR_SHARE = 0.75
"""Height of a colour bar as a share of the figure's, about: titles and notes take the rest."""
DARK_SHARE = 0.6
"""Share of the colour scale beyond which text on it is white: black could no longer be read."""


def sensitivity_figure(sensitivity: Sensitivity, title: str = "{}") -> Figure:
    """Draw a table of coloured cells: red where the index grows with the parameter, blue where it falls."""
    rows = {with_leg(sensitivity.machine, influence.path): influence.percents for influence in sensitivity.parameters}
    heads = [QUANTITIES[name].symbol for name in sensitivity.quantities]
    return coloured_table(
        (title.format(sensitivity.machine.name), setting_of(sensitivity.machine)),
        rows,
        heads,
        "RdBu_r",
        UNIT_OF_PERCENTS,
    )


def coloured_table(
    titles: tuple[str, str], rows: Mapping[str, Array], heads: Sequence[str], colours: str, label: str
) -> Figure:
    """Draw numbers in cells coloured by sign and size; the first rows, as many as a page takes.

    Args:
        titles: title over the figure, and below it the settings for which its numbers hold.
        rows: percent per percent in each column, by parameter; NaN is grey.
        heads: heads of the columns.
        colours: name of a diverging colour map.
        label: label of the colour bar.
    """
    shown = list(rows)[:MOST_ROWS]
    cells = np.array([rows[path] for path in shown], dtype=float)
    (width, height), (beside, above) = CELL_SIZE, ROOM_BESIDE_CELLS
    names = max(LEAST_NAME_WIDTH, width_of(shown))
    with new_figure((names + beside + width * len(heads), above + height * len(shown)), *titles) as figure:
        panel = figure.subplots()
        room = int(LETTERS_PER_INCH * BAR_SHARE * figure.get_figheight())
        _draw_cells(panel, cells, colours, "\n".join(textwrap.wrap(label, room)))
        panel.set_yticks(range(len(shown)), shown)
        panel.set_xticks(range(len(heads)), heads)
    return figure


def _draw_cells(panel: Axes, cells: Array, colours: str, label: str) -> None:
    sizes = np.abs(cells[np.isfinite(cells)])
    most = max(usual_range(sizes)[1] if sizes.size else 0.0, LEAST_SCALE)
    scale = Normalize(-most, most)
    image = panel.imshow(np.ma.masked_invalid(cells), cmap=colours, norm=scale, aspect="auto")
    panel.set_facecolor("#eeeeee")
    panel.grid(visible=False)
    panel.tick_params(length=0, top=False)
    for (row, column), value in np.ndenumerate(cells):
        if np.isfinite(value):
            dark = abs(float(scale(value)) - 0.5) > 0.5 * DARK_SHARE
            text = f"{value:.2g}" if abs(value) >= NEGLIGIBLE else "0"
            colour = "white" if dark else "black"
            cell = panel.text(column, row, text, ha="center", va="center", fontsize=6, color=colour)
            cell.set_in_layout(False)  # it lies inside of the panel, so that the layout need not measure it
    bar = panel.figure.colorbar(image, ax=panel, pad=0.02, extend=exceeded_ends(cells, -most, most))
    slim_bar(bar)
    bar.set_label(label)


def sensitivity_figures(sensitivity: Sensitivity) -> dict[str, Drawing]:
    """Return the table of influences as a figure; none where no parameter has an influence."""
    caption = "Percent by which each index changes per percent of a parameter."
    draw = partial(sensitivity_figure, sensitivity)
    return {"influences": Drawing(caption, draw, minor=True, file="sensitivity")} if sensitivity.parameters else {}
