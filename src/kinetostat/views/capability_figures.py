"""Pictures of what drives can do at a pose: cuts of the sets of forces and speeds, with their largest circles."""

from collections.abc import Sequence
from functools import partial
from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from kinetostat.machine.machine import setting_of
from kinetostat.numerics.polytopes import outline
from kinetostat.studies.capability import Capability, CapabilitySet
from kinetostat.tolerances import DEPENDENT
from kinetostat.views.capability import TITLES
from kinetostat.views.figures import COLOURS, new_figure
from kinetostat.views.question import Drawing

BEYOND = 3.0
"""Half the width of a panel in units of the greatest or least amount, where a set has no end: one sees that it goes
on."""
ROOM = 1.12
"""Width of a panel over that of what it shows: a line at its edge would be taken for the frame."""
MOVING, TURNING = ("force", "speed", "acceleration"), ("moment", "rate", "angular acceleration")
"""Sets of a figure each."""
FIGURES = {"capability": MOVING, "capability_turning": TURNING}
CAPTION = "Cuts of what the drives allow through zero, each with the largest circle in whichever direction."


def capability_figures(answer: Capability) -> dict[str, Drawing]:
    """Return the drawing of the sets; none where the loads are not held or every set is a line."""
    drawings = {}
    for name, sets in FIGURES.items():
        if _sets_with_planes(answer, sets):
            drawings[name] = Drawing(CAPTION, partial(capability_figure, answer, sets=sets), minor=name != "capability")
    return drawings


def _sets_with_planes(answer: Capability, names: Sequence[str]) -> list[tuple[CapabilitySet, list[tuple[int, int]]]]:
    """Return the sets that can be drawn, each with the planes in which it is more than a line."""
    rows = []
    for part in answer.sets:
        if part.name not in names:
            continue
        planes = [pair for pair in combinations(range(3), 2) if _lies_in(part, pair)]
        if part.least > 0.0 and np.isfinite(part.least) and planes:
            rows.append((part, planes))
    return rows


def _lies_in(part: CapabilitySet, plane: tuple[int, int]) -> bool:
    """Return whether both axes of a plane are among the directions that a set has."""
    kept = part.directions @ part.directions.T
    return all(abs(kept[axis, axis] - 1.0) < DEPENDENT for axis in plane)


def capability_figure(
    answer: Capability, title: str = "{}: what the drives allow", sets: Sequence[str] = MOVING
) -> Figure:
    """Draw the cuts of each set in the planes of the base axes.

    Args:
        answer: an answer with sets.
        title: over the figure, with braces for the name of the machine.
        sets: the names of the sets that are drawn.
    """
    rows = _sets_with_planes(answer, sets)
    columns = max(len(planes) for _, planes in rows)
    with new_figure(
        (0.5 + 2.3 * columns, 0.9 + 2.25 * len(rows)),
        title.format(answer.machine.name),
        setting_of(answer.machine),
        "dashed: what the drives allow in every direction of space; forces and moments beside the loads that count",
    ) as figure:
        panels = figure.subplots(len(rows), columns, squeeze=False)
        for place, (row, (part, planes)) in enumerate(zip(panels, rows, strict=True)):
            for panel in row[len(planes) :]:
                panel.set_visible(False)
            _draw_row(answer, part, row, planes, COLOURS[place])
    return figure


def _draw_row(
    answer: Capability, part: CapabilitySet, row: Sequence[Axes], planes: Sequence[tuple[int, int]], colour: str
) -> None:
    scale = answer.machine.display.scale(part.unit)
    ended = np.abs(part.vertices).max(initial=0.0)
    reach = ROOM * (ended if len(part.vertices) else BEYOND * part.least)
    for panel, plane in zip(row, planes, strict=False):
        normals = part.normals[:, list(plane)]
        felt = np.linalg.norm(normals, axis=1) > DEPENDENT * np.linalg.norm(part.normals, axis=1)
        corners = outline(normals[felt], part.bounds[felt], 2.0 * reach) * scale.factor
        panel.add_patch(Polygon(corners, facecolor=colour, alpha=0.25, edgecolor="none"))
        panel.add_patch(Polygon(corners, facecolor="none", edgecolor=colour, linewidth=1.4))
        panel.add_patch(
            Circle((0.0, 0.0), part.least * scale.factor, facecolor="none", edgecolor="#444444", linestyle="--")
        )
        panel.plot(0.0, 0.0, "+", color="#444444", markersize=5)
        limit = reach * scale.factor
        panel.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")
        panel.locator_params(axis="x", nbins=4)  # five-digit forces run into each other in three panels side by side
        panel.set_xlabel(scale.label(f"{part.name} {'xyz'[plane[0]]}"))
        panel.set_ylabel(scale.label(f"{part.name} {'xyz'[plane[1]]}"))
    row[0].set_title(TITLES[part.name], loc="left")
