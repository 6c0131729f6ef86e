"""Figures of the influence of parameters on the stiffness: sensitivities and design guidelines, for print.

Numbers and curves come from `studies`; only scales and colours are chosen here.
"""

import math
import textwrap
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from kinetostat.arrays import Array
from kinetostat.kinetostatics.elements import Element
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import setting_of
from kinetostat.machine.parameters import with_leg
from kinetostat.studies.guideline_sentences import limit_of
from kinetostat.studies.guidelines import EXCESS, Guidelines, stiffening
from kinetostat.studies.sensitivity import UNIT_OF_PERCENTS, Sensitivity
from kinetostat.views.figures import COLOURS, DASHES, new_figure, slim_bar
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
    beside = max(LEAST_NAME_WIDTH, width_of(shown))
    with new_figure((beside + 0.5 + 0.7 * len(heads), 1.1 + 0.2 * len(shown)), titles[0], titles[1]) as figure:
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


MOST_PANELS = 6
"""Number of elements whose curves are shown, a panel each: two rows of three fit on a page."""
CURVE_POINTS = 161
"""Number of points along each curve: it looks smooth over several powers of ten."""
DECADES = 1.0
"""Powers of ten by which curves go beyond the limits of rigidity and the present stiffness: one sees them level out."""


def guideline_figures(guidelines: Guidelines) -> dict[str, Drawing]:
    """Return the figures by name: "design", and "rigid" where elements have a limit of rigidity."""
    if guidelines.here is None:
        return {}
    draw = partial(design_figure, guidelines)
    effect = Drawing("Effect of each parameter on each direction.", draw, minor=True, file="guidelines-design")
    drawings = {"design": effect} if guidelines.parameters else {}
    limited = _elements_with_limits(guidelines)
    caption = "Stiffness in each direction over the stiffness of each element, relative to that with the element rigid."
    if limited:
        drawings["rigid"] = Drawing(caption, partial(rigid_figure, guidelines, limited), file="guidelines-rigid")
    return drawings


def _elements_with_limits(guidelines: Guidelines) -> list[tuple[Element, np.ndarray]]:
    """Return the last elements that have a limit of rigidity, with their limits in multiples of their stiffness."""
    if guidelines.here is None:
        return []
    limits = [
        (element, guidelines.here.rigid[k, :, 0])
        for k, element in enumerate(guidelines.elements)
        if not element.actuated
    ]
    shown = [(element, row) for element, row in limits if (np.isfinite(row) & (row > 0.0)).any()]
    return shown[-MOST_PANELS:]


def design_figure(guidelines: Guidelines, title: str = "{}: effect of each parameter") -> Figure:
    """Draw parameters against directions: blue where 1 % more makes a direction stiffer, red where softer."""
    rows = {with_leg(guidelines.machine, effect.path): effect.percents for effect in guidelines.parameters}
    titles = title.format(guidelines.machine.name), setting_of(guidelines.machine)
    label = "percent stiffer per 1 % more (angle: per 0.01 rad)"
    return coloured_table(titles, rows, guidelines.components, "RdBu", label)


def rigid_figure(
    guidelines: Guidelines,
    shown: list[tuple[Element, np.ndarray]],
    title: str = "{}: stiffness from which an element counts as rigid",
) -> Figure:
    """Draw the stiffness of each direction against that of each element, with dots where it becomes rigid."""
    columns = min(3, len(shown))
    rows = -(-len(shown) // columns)
    with new_figure(
        (2.9 * columns + 0.9, 2.5 * rows + 0.7),
        title.format(guidelines.machine.name),
        setting_of(guidelines.machine),
        guidelines.loads_left_out,
    ) as figure:
        panels = figure.subplots(rows, columns, squeeze=False).flat
        for panel, (element, limits) in zip(panels, shown, strict=False):
            _draw_curves(panel, guidelines, element, limits)
        for unused in list(figure.axes)[len(shown) :]:
            unused.remove()
        styles = zip(guidelines.components, COLOURS, DASHES, strict=False)
        lines = [Line2D([], [], color=colour, linestyle=dash, label=name) for name, colour, dash in styles]
        dot = Line2D([], [], color="#444444", marker="o", markersize=4, linestyle="", label="within 1 %")
        figure.legend(handles=[*lines, dot], loc="outside right center", title="direction")
    return figure


def _draw_curves(panel: Axes, guidelines: Guidelines, element: Element, limits: np.ndarray) -> None:
    """Draw the stiffness of each direction over the stiffness of an element, with a dot at each limit of rigidity."""
    finite = limits[np.isfinite(limits) & (limits > 0.0)]
    rigid_now = element.stiffness == math.inf
    ends = np.log10([*finite, *([] if rigid_now else [1.0])])
    factors = np.logspace(ends.min() - 2.0 * DECADES, ends.max() + DECADES, CURVE_POINTS)
    scale = guidelines.machine.display.scale(element.unit)
    present = 1.0 if element.stiffness is None else limit_of(element.stiffness, 1.0) * scale.factor
    stiff = stiffening(guidelines.state, element, factors)
    for colour, dash, curve, limit in zip(COLOURS, DASHES, stiff, limits, strict=False):
        if limit == math.inf:
            continue
        panel.plot(present * factors, 100.0 * curve, linestyle=dash, color=colour, linewidth=1.3)
        if 0.0 < limit < math.inf:
            panel.plot(present * limit, 100.0 / (1.0 + EXCESS), "o", color=colour, markersize=4, zorder=3)
    if not rigid_now:
        panel.axvline(present, color="#888888", linewidth=0.8, linestyle=":")
        panel.text(present, 3.0, " now", fontsize=6.5, color="#666666", ha="left")
    unit = scale.label("stiffness") if element.stiffness is not None else "multiple of the present stiffness"
    panel.set(xscale="log", ylim=(0.0, 104.0), xlabel=unit, ylabel="stiffness, % of that with\na rigid element")
    panel.set_title(element.name, parse_math=False)
    panel.margins(x=0.0)


def sensitivity_figures(sensitivity: Sensitivity) -> dict[str, Drawing]:
    """Return the table of influences as a figure; none where no parameter has an influence."""
    caption = "Percent by which each index changes per percent of a parameter."
    draw = partial(sensitivity_figure, sensitivity)
    return {"influences": Drawing(caption, draw, minor=True, file="sensitivity")} if sensitivity.parameters else {}
