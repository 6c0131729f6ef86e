"""Tensions of cables: the question, and the description of its answer. Nothing is computed here."""

import math
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

from kinetostat.display import DASH, number
from kinetostat.late import LateModule
from kinetostat.machine.machine import setting_of
from kinetostat.studies.tensions import Tensions, tensions
from kinetostat.views.question import FIRST_FIELDS, Description, Drawing, Field, Lines, Option, Question, Records
from kinetostat.views.tables import FittedTable, numeric_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from kinetostat.views import figures
else:
    figures = LateModule("kinetostat.views.figures")

BAR_HEIGHT = 0.28
"""Height of the figure for each cable, inches: its name fits beside its bar."""
FIGURE_WIDTH, ROOM_FOR_TITLE = 6.0, 1.3
"""Width of the figure, and height of its title, scale and notes, inches."""
FARTHEST_BOUND = 3.0
"""Bound, in multiples of the greatest tension, from which it is not drawn, so that bars are not too short."""


def _lines(answer: Tensions) -> Lines:
    show = answer.machine.display.show
    yield "Tensions", answer.message
    loads = "the load" if answer.required == 1 else f"the {answer.required} required loads"
    if math.isinf(answer.capacity):
        sentence = "No bound limits what the cables can hold."
    elif answer.capacity >= 0.0:
        sentence = f"{show(answer.capacity, 'N')} in any direction may come to {loads} before a bound is passed."
    else:
        sentence = f"What the cables can hold ends {show(-answer.capacity, 'N')} before {loads}."
    yield "Capacity", sentence
    yield (
        "Closure",
        "Cables without an upper bound hold any wrench here."
        if answer.wrench_closure > 0.0
        else "Cables alone cannot hold every wrench here, however hard they pull: they need the load.",
    )
    yield "Sag", answer.sag_message


def _tables(answer: Tensions, _full: bool) -> Iterator[FittedTable]:
    show, sags = answer.machine.display.show, any(cable.sag for cable in answer.cables)
    heads = ["tension", "reserve", "length", *(["at the base", "sag", "stiffness kept"] if sags else [])]
    table = numeric_table("Cables", "cable", heads)
    for cable in answer.cables:
        forces = [(DASH if value is None else show(value, "N")) for value in (cable.tension, cable.reserve)]
        row = [*forces, show(cable.length, "m")]
        if sags:
            base = DASH if cable.base_tension is None else show(cable.base_tension, "N")
            row += [base, show(cable.sag, "m"), f"{number(100.0 * cable.stiffness_share)} %"]
        table.add_row(cable.name, *row)
    yield table


def _figure(answer: Tensions, title: str = "{}: tensions of the cables") -> "Figure":
    """Draw the tension of each cable as a bar, and the bounds that are near."""
    scale = answer.machine.display.scale("N")
    sizes = [(cable.tension or 0.0) * scale.factor for cable in answer.cables]
    lowest, greatest = (bound * scale.factor for bound in answer.bounds)
    with figures.new_figure(
        (FIGURE_WIDTH, ROOM_FOR_TITLE + BAR_HEIGHT * len(sizes)),
        title.format(answer.machine.name),
        setting_of(answer.machine),
    ) as figure:
        panel = figure.add_subplot()
        names = [cable.name for cable in answer.cables]
        bars = panel.barh(names, sizes, height=0.7, color=figures.COLOURS[0])
        panel.bar_label(bars, [number(size) for size in sizes], padding=3, fontsize="small")
        panel.invert_yaxis()
        panel.margins(x=0.12)
        panel.set_xlabel(scale.label("tension"))
        panel.grid(visible=False, axis="y")
        panel.set_axisbelow(True)
        near = [bound for bound in (lowest, greatest) if 0.0 < bound < FARTHEST_BOUND * max(sizes)]
        for bound in near:
            panel.axvline(bound, color=figures.COLOURS[1], linewidth=1.2, label="bound" if bound == near[0] else None)
        if near:
            panel.legend(loc="upper right", frameon=False, fontsize="small", bbox_to_anchor=(1.0, 1.12))
    return figure


def _has_tensions(answer: Tensions) -> bool:
    """Return whether the cables hold the load: all of them have a tension then, and none otherwise."""
    return answer.cables[0].tension is not None


def _figures(answer: Tensions) -> dict[str, Drawing]:
    if not _has_tensions(answer):
        return {}
    return {"tensions": Drawing("Tension of each cable, and the bounds that are near.", partial(_figure, answer))}


TENSIONS = Description(
    title="Tensions of the cables",
    fields=(
        *FIRST_FIELDS,
        Field("capacity", unit="N", long_name="distance of the load from the end of what the cables can hold"),
        Field("wrench_closure", long_name="positive where cables without an upper bound hold any wrench"),
        Field("required", long_name="number of loads that the capacity is about"),
        Field("min_tension", lambda answer: answer.bounds[0], "N", "least tension that is allowed"),
        Field("max_tension", lambda answer: answer.bounds[1], "N", "greatest tension that is allowed"),
        Records(
            "cables",
            "cable",
            (
                Field("name"),
                Field("tension", unit="N", long_name="tension at the platform"),
                Field("base_tension", unit="N", long_name="tension where the cable leaves the base"),
                Field("reserve", unit="N", long_name="distance of the tension from the nearer bound"),
                Field("length", unit="m", long_name="unstretched length to the drum side of its pulley"),
                Field("sag", unit="m", long_name="greatest distance from the line of its ends"),
                Field(
                    "stiffness_share",
                    long_name="stiffness along the line of its ends as a share of that of a straight cable",
                ),
            ),
        ),
    ),
    lines=_lines,
    tables=_tables,
    figures=_figures,
    answered=_has_tensions,
    files={"tensions.json": "json", "tensions.csv": "csv", "tensions.nc": "nc"},
)
TENSIONS_QUESTION = Question(
    example="kinetostat tensions cogiro --set cables.linear_density='0.064 kg/m' -o tensions",
    answer=tensions,
    options=(
        Option(
            "wrenches",
            "file",
            "CSV file of loads that must be held at this pose, for the capacity; heads such as load.force.2 [N]",
            metavar="FILE",
        ),
    ),
    output="tensions.json, tensions.csv, tensions.nc and the figure",
)
