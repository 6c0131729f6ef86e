"""Figures of design guidelines: the effect of each parameter, and the stiffness from which each element is rigid."""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from kinetostat.arrays import Array
from kinetostat.kinetostatics.elements import Element
from kinetostat.machine.machine import setting_of
from kinetostat.machine.parameters import with_leg
from kinetostat.studies.guidelines import EXCESS_OF_RIGID, Guidelines, stiffening
from kinetostat.views.figures import COLOURS, DASHES, GUIDE_COLOUR, NOTE_SIZE, grid_shape, new_figure, panel_grid
from kinetostat.views.guidelines import unit_of_limits
from kinetostat.views.question import Drawing
from kinetostat.views.sensitivity import coloured_table

MOST_PANELS = 6
"""Number of elements whose curves are shown, a panel each: two rows of three fit on a page."""
CURVE_POINTS = 161
"""Number of points along each curve: it looks smooth over several powers of ten."""
DECADES_BELOW, DECADES_ABOVE = 2.0, 1.0
"""Powers of ten by which curves go beyond the limits of rigidity and the present stiffness: below the least of them one
sees the stiffness of a direction fall, above the greatest one sees it level out."""
PANEL_SIZE = (2.9, 2.5)
"""Width and height of the panel of an element with its labels, inches."""
ROOM_BESIDE_PANELS = (0.9, 0.7)
"""Further width, of the legend, and height, of title and notes, inches."""
NOW_COLOURS = ("#888888", "#666666")
"""Greys of the line at the present stiffness, and of the word beside it."""
TOP_OF_PANEL, HEIGHT_OF_NOW = 104.0, 3.0
"""Upper end of a panel, above 100 % so that a curve that levels out is seen; and height of the word at the present
stiffness; in percent."""


def guideline_figures(answer: Guidelines) -> dict[str, Drawing]:
    """Return the figures by name: "design", and "rigid" where elements have a limit of rigidity."""
    if answer.roles is None:
        return {}
    draw = partial(design_figure, answer)
    effect = Drawing("Effect of each parameter on each direction.", draw, minor=True, file="guidelines-design")
    drawings = {"design": effect} if answer.parameters else {}
    limited = _elements_with_limits(answer.elements, answer.roles.rigid)
    caption = "Stiffness in each direction over the stiffness of each element, relative to that with the element rigid."
    if limited:
        drawings["rigid"] = Drawing(caption, partial(rigid_figure, answer, limited), file="guidelines-rigid")
    return drawings


def _elements_with_limits(elements: Sequence[Element], limits: Array) -> list[tuple[Element, Array]]:
    """Return the last elements that have a limit of rigidity, with their limits in multiples of their stiffness.

    The last ones, because all links together stand at the end, see `with_links_together`, and are most of interest.
    """
    rows = [(element, row[:, 0]) for element, row in zip(elements, limits, strict=True) if not element.actuated]
    limited = [(element, row) for element, row in rows if (np.isfinite(row) & (row > 0.0)).any()]
    return limited[-MOST_PANELS:]


def design_figure(answer: Guidelines, title: str = "{}: effect of each parameter") -> Figure:
    """Draw parameters against directions: blue where 1 % more makes a direction stiffer, red where softer."""
    rows = {with_leg(answer.machine, effect.path): effect.percents for effect in answer.parameters}
    titles = title.format(answer.machine.name), setting_of(answer.machine)
    label = "percent stiffer per 1 % more (angle: per 0.01 rad)"
    return coloured_table(titles, rows, answer.components, "RdBu", label)


def rigid_figure(
    answer: Guidelines,
    limited: Sequence[tuple[Element, Array]],
    title: str = "{}: stiffness from which an element counts as rigid",
) -> Figure:
    """Draw the stiffness of each direction against that of each element, with dots where it becomes rigid."""
    rows, columns = grid_shape(len(limited))
    (width, height), (legend_width, title_height) = PANEL_SIZE, ROOM_BESIDE_PANELS
    with new_figure(
        (width * columns + legend_width, height * rows + title_height),
        title.format(answer.machine.name),
        setting_of(answer.machine),
        answer.loads_left_out,
    ) as figure:
        for panel, (element, limits) in zip(panel_grid(figure, len(limited)), limited, strict=True):
            _draw_curves(panel, answer, element, limits)
        styles = zip(answer.components, COLOURS, DASHES, strict=False)
        curves = [Line2D([], [], color=colour, linestyle=dash, label=name) for name, colour, dash in styles]
        near = f"within {100.0 * EXCESS_OF_RIGID:g} %"
        dot = Line2D([], [], color=GUIDE_COLOUR, marker="o", markersize=4, linestyle="", label=near)
        figure.legend(handles=[*curves, dot], loc="outside right center", title="direction")
    return figure


def _draw_curves(panel: Axes, answer: Guidelines, element: Element, limits: Array) -> None:
    """Draw the stiffness of each direction over the stiffness of an element, with a dot at each limit of rigidity."""
    finite = limits[np.isfinite(limits) & (limits > 0.0)]
    rigid_now = element.stiffness == math.inf
    ends = np.log10([*finite, *([] if rigid_now else [1.0])])
    factors = np.logspace(ends.min() - DECADES_BELOW, ends.max() + DECADES_ABOVE, CURVE_POINTS)
    scale = answer.machine.display.scale(element.unit)
    present = unit_of_limits(element, scale)
    stiff = stiffening(answer.state, element, factors)
    for colour, dash, curve, limit in zip(COLOURS, DASHES, stiff, limits, strict=False):
        if limit == math.inf:
            continue
        panel.plot(present * factors, 100.0 * curve, linestyle=dash, color=colour, linewidth=1.3)
        if 0.0 < limit < math.inf:
            panel.plot(present * limit, 100.0 / (1.0 + EXCESS_OF_RIGID), "o", color=colour, markersize=4, zorder=3)
    if not rigid_now:
        panel.axvline(present, color=NOW_COLOURS[0], linewidth=0.8, linestyle=":")
        panel.text(present, HEIGHT_OF_NOW, " now", fontsize=NOTE_SIZE, color=NOW_COLOURS[1], ha="left")
    unit = scale.label("stiffness") if element.stiffness is not None else "multiple of the present stiffness"
    panel.set(xscale="log", ylim=(0.0, TOP_OF_PANEL), xlabel=unit, ylabel="stiffness, % of that with\na rigid element")
    panel.set_title(element.name, parse_math=False)
    panel.margins(x=0.0)
