"""Sensitivities: the question, the description of its answer, and its figure. Nothing is computed here but rounding.

The figure is a table of coloured cells, which guidelines draw as well.
"""

import math
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.display import DASH
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, group_of, plain_name
from kinetostat.late import LateModule
from kinetostat.machine.machine import setting_of
from kinetostat.machine.parameters import with_leg
from kinetostat.studies.sensitivity import UNIT_OF_PERCENTS, Sensitivity, notes, sensitivity
from kinetostat.units import KINDS, RIGID
from kinetostat.views.question import (
    FIRST_FIELDS,
    LOADS_LEFT_OUT,
    Description,
    Drawing,
    Field,
    Lines,
    Question,
    Records,
    quantities_option,
)
from kinetostat.views.tables import FittedTable, numeric_table, words_on_omitted

if TYPE_CHECKING:
    from matplotlib import colors
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from kinetostat.views import figures, layout, map_scales
else:
    colors = LateModule("matplotlib.colors")
    figures = LateModule("kinetostat.views.figures")
    layout = LateModule("kinetostat.views.layout")
    map_scales = LateModule("kinetostat.views.map_scales")

MOST_INFLUENCES = 40
"""Parameters that have a line unless all are wanted: the strongest, which fill a screen."""
DIGITS_OF_PARAMETERS = 6
"""Digits of the value of a parameter: it can be found again in the file."""
NEGLIGIBLE = 0.0005
"""Percent per percent below which a 0 is shown: with three decimals it would read 0.000."""
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


def influence_table(answer: Sensitivity, count: int) -> FittedTable:
    """Return the first parameters by rank, with their values and their effect on each index."""
    group, machine = group_of(answer.quantities), answer.machine
    heads = [plain_name(name.removeprefix(f"{group}_")) for name in answer.quantities]
    title = f"{plain_name(group)}, {UNIT_OF_PERCENTS}" if group else UNIT_OF_PERCENTS
    table = numeric_table(f"{machine.name}: {title}", "parameter", ["value", *heads])
    for influence in answer.parameters[:count]:
        value = machine.display.show(influence.value, KINDS[influence.kind].unit, RIGID, DIGITS_OF_PARAMETERS)
        table.add_row(
            with_leg(machine, influence.path), value, *(_percent_text(percent) for percent in influence.percents)
        )
    return table


def _percent_text(value: float) -> str:
    """Return a number with three decimals, or a dash where there is none."""
    if math.isnan(value):
        return DASH
    return "0" if abs(value) < NEGLIGIBLE else f"{value:.3f}"


def _tables(answer: Sensitivity, full: bool) -> Iterator[FittedTable]:
    if answer.parameters:
        yield influence_table(answer, len(answer.parameters) if full else MOST_INFLUENCES)


def _lines(answer: Sensitivity) -> Lines:
    hidden = len(answer.parameters) - MOST_INFLUENCES
    if hidden > 0:
        yield "Parameters", f"{words_on_omitted(hidden)} (--full shows them)."
    if not answer.parameters:
        yield "Parameters", "No parameter has an influence here."
    meaning, *others = notes(answer)
    yield "Percent", meaning
    for sentence in others:
        yield "Others", sentence


def sensitivity_figure(sensitivity: Sensitivity, title: str = "{}") -> "Figure":
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
) -> "Figure":
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
    (width, height), (bar_width, room_above) = CELL_SIZE, ROOM_BESIDE_CELLS
    name_width = max(LEAST_NAME_WIDTH, layout.width_of(shown))
    with figures.new_figure(
        (name_width + bar_width + width * len(heads), room_above + height * len(shown)), *titles
    ) as figure:
        panel = figure.subplots()
        room = int(LETTERS_PER_INCH * BAR_SHARE * figure.get_figheight())
        _draw_cells(panel, cells, colours, "\n".join(textwrap.wrap(label, room)))
        panel.set_yticks(range(len(shown)), shown)
        panel.set_xticks(range(len(heads)), heads)
    return figure


def _draw_cells(panel: "Axes", cells: Array, colours: str, label: str) -> None:
    sizes = np.abs(cells[np.isfinite(cells)])
    end = max(map_scales.usual_range(sizes)[1] if sizes.size else 0.0, LEAST_SCALE)
    scale = colors.Normalize(-end, end)
    image = panel.imshow(np.ma.masked_invalid(cells), cmap=colours, norm=scale, aspect="auto")
    panel.set_facecolor(figures.NO_RESULT_COLOUR)
    panel.grid(visible=False)
    panel.tick_params(length=0, top=False)
    for (row, column), value in np.ndenumerate(cells):
        if np.isfinite(value):
            dark = abs(float(scale(value)) - 0.5) > 0.5 * DARK_SHARE
            text = f"{value:.2g}" if abs(value) >= NEGLIGIBLE else "0"
            colour = "white" if dark else "black"
            cell = panel.text(column, row, text, ha="center", va="center", fontsize=6, color=colour)
            cell.set_in_layout(False)  # it lies inside of the panel, so that the layout need not measure it
    bar = panel.figure.colorbar(image, ax=panel, pad=0.02, extend=map_scales.exceeded_ends(cells, -end, end))
    figures.slim_bar(bar)
    bar.set_label(label)


def sensitivity_figures(sensitivity: Sensitivity) -> dict[str, Drawing]:
    """Return the table of influences as a figure; none where no parameter has an influence."""
    caption = "Percent by which each index changes per percent of a parameter."
    draw = partial(sensitivity_figure, sensitivity)
    return {"influences": Drawing(caption, draw, minor=True, file="sensitivity")} if sensitivity.parameters else {}


def _parameters(answer: Sensitivity) -> list[dict[str, Any]]:
    """Return the parameters with the names of the indices."""
    names = answer.quantities
    return [
        {
            "path": parameter.path,
            "value": parameter.value,
            "units": KINDS[parameter.kind].unit,
            "one_percent_of": {"measure": parameter.measure, "value": parameter.percent_of},
            "derivatives": dict(zip(names, parameter.derivatives, strict=True)),
            "percent_per_percent": dict(zip(names, parameter.percents, strict=True)),
        }
        for parameter in answer.parameters
    ]


def _indices(answer: Sensitivity) -> dict[str, dict[str, Any]]:
    pairs = zip(answer.quantities, answer.indices, strict=True)
    return {name: {"value": value, "units": QUANTITIES[name].unit} for name, value in pairs}


PARAMETER = (
    Field("path", long_name="parameter"),
    Field("value", long_name="value of the parameter, SI"),
    Field("units", long_name="unit of the parameter"),
    Field("one_percent_of", forms=("json", "csv")),
    Field("derivatives", long_name="derivative of each index, SI", axes=("quantity",)),
    Field("percent_per_percent", unit="1", long_name=UNIT_OF_PERCENTS, axes=("quantity",)),
)
SENSITIVITY = Description(
    title="Sensitivity",
    fields=(
        *FIRST_FIELDS,
        LOADS_LEFT_OUT,
        Field("characteristic_length", lambda answer: answer.characteristic_length if answer.parameters else None),
        Field("indices", _indices),
        Records("parameters", "parameter", PARAMETER, _parameters),
        Field("without_influence"),
        Field("without_derivative", lambda answer: dict(answer.without_derivative)),
    ),
    lines=_lines,
    tables=_tables,
    figures=sensitivity_figures,
    answered=lambda answer: answer.status is Status.OK,
    files={"sensitivity.json": "json"},
)
SENSITIVITY_QUESTION = Question(
    example="kinetostat sensitivity zhang-gosselin-4dof --quantity compliance_z -o sensitivity",
    answer=sensitivity,
    options=(quantities_option("compliance"),),
    output="the figure and JSON",
    full="show every parameter that has an influence",
)
