"""Forces, speeds and accelerations that the drives allow at a pose: the question, its answer in words, and its figures.

A figure shows cuts of their sets, with the largest circle in each. Source: theory (81)-(84).
"""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from kinetostat.display import DASH
from kinetostat.late import LateModule
from kinetostat.machine.machine import pose_of, setting_of
from kinetostat.numerics.polytopes import outline
from kinetostat.studies.capability import Capability, CapabilitySet, capability
from kinetostat.tolerances import DEPENDENT
from kinetostat.views.analysis_tables import direction_words
from kinetostat.views.data_forms import finite_or_none
from kinetostat.views.question import (
    FIRST_FIELDS,
    LOADS_LEFT_OUT,
    Description,
    Drawing,
    Field,
    Lines,
    Option,
    Question,
    Records,
)
from kinetostat.views.tables import FittedTable, numeric_table

if TYPE_CHECKING:
    from matplotlib import patches
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from kinetostat.views import figures
else:
    patches = LateModule("matplotlib.patches")
    figures = LateModule("kinetostat.views.figures")

TITLES = {
    "force": "force at no moment",
    "moment": "moment at no force",
    "speed": "speed without turning",
    "rate": "turning about the tool point",
    "acceleration": "acceleration without turning",
    "angular acceleration": "acceleration of turning alone",
}
"""Heads of the rows of the table and of the panels of the figure, by set."""
NO_END = "no limit"
"""Words for a load that no drive feels, and for a speed or an acceleration that nothing limits."""
MOST_NAMED_DRIVES = 3
"""Drives that a sentence names one by one: more names would hide what it says of them."""
OPEN_SET_REACH = 3.0
"""Half the width of a panel in units of the least amount, where a set has no end: one sees that it goes on."""
PANEL_WIDTH_RATIO = 1.12
"""Width of a panel over that of what it shows: a line at its edge would be taken for the frame."""
OUTLINE_REACH = 2.0
"""Reach of the outline of a set in reaches of its panel: an open side is cut off where it is not seen."""
PANEL_SIZE, ROOM_BESIDE_PANELS = (2.3, 2.25), (0.5, 0.9)
"""Width and height of a panel with its labels; further width, and height of title and notes; inches."""
MOVING, TURNING = ("force", "speed", "acceleration"), ("moment", "rate", "angular acceleration")
"""Sets that share a figure: those of motions along a direction, and those about one."""
FIGURES = {"capability": MOVING, "capability_turning": TURNING}
"""Sets of each figure, by its name."""
CAPTION = "Cuts of what the drives allow through zero, each with the largest circle in whichever direction."


def _amount_text(answer: Capability, value: float, unit: str) -> str:
    if math.isnan(value):
        return DASH
    return NO_END if math.isinf(value) else answer.machine.display.show(value, unit)


def _weakest(answer: Capability) -> str:
    """Say in which direction the least force and the least speed are, and which drives are at their limits there."""
    sentences = []
    for name in MOVING:
        region = answer.set_of(name)
        if region and region.weakest.size and region.least > 0.0:
            reach = "reaches its limit" if len(region.limited_by) == 1 else "reach their limits"
            where = f"{direction_words(region.weakest)}, where {_list_of(region.limited_by)} {reach}"
            sentences.append(f"The {name} is least along {where}.")
    return " ".join(sentences)


def _list_of(names: tuple[str, ...]) -> str:
    """List names of drives in a phrase; of many, the first one and the number of the others."""
    if len(names) > MOST_NAMED_DRIVES:
        return f"{names[0]} and {len(names) - 1} others"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _along(answer: Capability) -> str:
    """Return the greatest amounts both ways of the direction that was asked for; one where both are the same.

    Sets that do not hold zero are left out: the drives do not carry what counts already.
    """
    phrases = []
    for region in (region for region in answer.sets if region.least >= 0.0):
        amounts = [region.along([sign * c for c in answer.direction]) for sign in (1.0, -1.0)]
        shown = list(dict.fromkeys(_amount_text(answer, amount, region.unit) for amount in amounts))
        phrases.append(f"{region.name} {' and, the other way, '.join(shown)}")
    return f"Along or about {direction_words(answer.direction)}: {'; '.join(phrases)}." if phrases else ""


def _lines(answer: Capability) -> Lines:
    if not answer.drives:
        return [("Pose", f"{pose_of(answer.machine)}. {answer.message}")]
    lines = [("Pose", f"{pose_of(answer.machine)}."), ("Drives", answer.message), ("Least", _weakest(answer))]
    return [*lines, ("Along", _along(answer) if answer.direction else "")]


def _tables(answer: Capability, _full: bool) -> Iterator[FittedTable]:
    if not answer.drives:
        return
    columns = ["in every direction", "least along", "in the best"]
    table = numeric_table("The drives allow at the tool point, beside the loads that count", "", columns)
    for region in answer.sets:
        weakest = direction_words(region.weakest) if region.weakest.size else ""
        greatest = _amount_text(answer, region.greatest, region.unit)
        table.add_row(TITLES[region.name], _amount_text(answer, region.least, region.unit), weakest, greatest)
    yield table
    drives = numeric_table("Drives", "", ["carries", "least", "greatest", "speed"])
    for drive in answer.drives:
        load, speed = ("N", "m/s") if drive.slides else ("N·m", "rad/s")
        carried = answer.machine.display.show(drive.carried, load)
        limits = [_amount_text(answer, drive.lower, load), _amount_text(answer, drive.upper, load)]
        drives.add_row(drive.name, carried, *limits, _amount_text(answer, drive.speed, speed))
    yield drives


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
    for region in answer.sets:
        if region.name not in names:
            continue
        planes = [pair for pair in combinations(range(3), 2) if _spans(region, pair)]
        if region.least > 0.0 and np.isfinite(region.least) and planes:
            rows.append((region, planes))
    return rows


def _spans(region: CapabilitySet, plane: tuple[int, int]) -> bool:
    """Return whether both axes of a plane are among the directions that a set has."""
    projection = region.directions @ region.directions.T
    return all(abs(projection[axis, axis] - 1.0) < DEPENDENT for axis in plane)


def capability_figure(
    answer: Capability, title: str = "{}: what the drives allow", sets: Sequence[str] = MOVING
) -> "Figure":
    """Draw the cuts of each set in the planes of the base axes.

    Args:
        answer: an answer with one of these sets at least, that is more than a line.
        title: over the figure, with braces for the name of the machine.
        sets: the names of the sets that are drawn.
    """
    rows = _sets_with_planes(answer, sets)
    columns = max(len(planes) for _, planes in rows)
    (width, height), (room_beside, room_above) = PANEL_SIZE, ROOM_BESIDE_PANELS
    with figures.new_figure(
        (room_beside + width * columns, room_above + height * len(rows)),
        title.format(answer.machine.name),
        setting_of(answer.machine),
        "dashed: what the drives allow in every direction of space; forces and moments beside the loads that count",
    ) as figure:
        panels = figure.subplots(len(rows), columns, squeeze=False)
        for place, (row, (region, planes)) in enumerate(zip(panels, rows, strict=True)):
            for panel in row[len(planes) :]:
                panel.set_visible(False)
            _draw_row(answer, region, row, planes, figures.COLOURS[place])
    return figure


def _draw_row(
    answer: Capability, region: CapabilitySet, row: Sequence["Axes"], planes: Sequence[tuple[int, int]], colour: str
) -> None:
    """Draw the cuts of a set through zero, a panel for each plane (by the numbers of its axes), with its circle."""
    scale = answer.machine.display.scale(region.unit)
    greatest = np.abs(region.vertices).max() if len(region.vertices) else OPEN_SET_REACH * region.least
    reach = PANEL_WIDTH_RATIO * greatest
    for panel, plane in zip(row, planes, strict=False):
        normals = region.normals[:, list(plane)]
        # Faces that are parallel to the plane bound nothing in it.
        crossing = np.linalg.norm(normals, axis=1) > DEPENDENT * np.linalg.norm(region.normals, axis=1)
        corners = scale.factor * outline(normals[crossing], region.bounds[crossing], OUTLINE_REACH * reach)
        panel.add_patch(patches.Polygon(corners, facecolor=colour, alpha=0.25, edgecolor="none"))
        panel.add_patch(patches.Polygon(corners, facecolor="none", edgecolor=colour, linewidth=1.4))
        guide = figures.GUIDE_COLOUR
        panel.add_patch(
            patches.Circle((0.0, 0.0), region.least * scale.factor, facecolor="none", edgecolor=guide, linestyle="--")
        )
        panel.plot(0.0, 0.0, "+", color=guide, markersize=5)
        limit = reach * scale.factor
        panel.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")
        panel.locator_params(axis="x", nbins=4)  # five-digit forces run into each other in three panels side by side
        panel.set_xlabel(scale.label(f"{region.name} {'xyz'[plane[0]]}"))
        panel.set_ylabel(scale.label(f"{region.name} {'xyz'[plane[1]]}"))
    row[0].set_title(TITLES[region.name], loc="left")


SETS = (
    Field("set", "name", long_name=f"{', '.join([*TITLES][:-1])} or {[*TITLES][-1]}", column="quantity"),
    Field("unit"),
    Field(
        "least",
        lambda region: finite_or_none(region.least),
        long_name="amount that is allowed in whichever direction, SI",
    ),
    Field(
        "greatest",
        lambda region: finite_or_none(region.greatest),
        long_name="amount that is allowed in the best direction, SI; none if endless or not held",
    ),
    Field("weakest", lambda region: region.weakest, long_name="direction of the least, base axes", forms=("json",)),
    Field(
        "limited_by",
        lambda region: list(region.limited_by),
        long_name="drives at their limits in the direction of the least",
        forms=("json",),
    ),
    Field(
        "vertices",
        lambda region: region.vertices.tolist(),
        long_name="corners of the set, SI, base axes",
        forms=("json",),
    ),
)
"""Values of each set of loads or speeds."""
DRIVES = (
    Field("drive", "name"),
    Field("carried", long_name="load of the drive by what counts already, N or N·m"),
    Field(
        "lower", lambda drive: finite_or_none(drive.lower), long_name="least load that the drive can carry, N or N·m"
    ),
    Field(
        "upper", lambda drive: finite_or_none(drive.upper), long_name="greatest load that the drive can carry, N or N·m"
    ),
    Field("speed", lambda drive: finite_or_none(drive.speed), long_name="greatest speed of the drive, m/s or rad/s"),
)
"""Values of each drive."""

CAPABILITY = Description(
    title="What the drives can do",
    fields=(
        *FIRST_FIELDS,
        LOADS_LEFT_OUT,
        Field("direction", lambda answer: list(answer.direction), forms=("json",)),
        Records("sets", "set", SETS),
        Records("drives", "drive", DRIVES, "drives", forms=("json",)),
    ),
    lines=_lines,
    tables=_tables,
    figures=capability_figures,
    answered=lambda answer: bool(answer.drives),
    files={"capability.json": "json", "capability.csv": "csv"},
)
CAPABILITY_QUESTION = Question(
    example='kinetostat capability hexapod --set limits.actuator_speed="300 mm/s" -o capability',
    answer=capability,
    options=(Option("along", "direction", "direction in which force and speed are looked at, base axes", default=()),),
    loaded="the drives with what they carry at rest under all loads, weights of links and tensions among them",
    output="capability.json, capability.csv and the figure",
)
