"""Stability lobes: the question, the description of its answer, and its picture. Nothing is computed here."""

import math
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from kinetostat.display import number
from kinetostat.late import LateModule
from kinetostat.machine.machine import pose_of, setting_of
from kinetostat.machine.parameters import with_values
from kinetostat.studies.lobes import Lobes, lobes
from kinetostat.vibration.receptance import ASSUMED_RATIO
from kinetostat.views.data_forms import finite_or_none
from kinetostat.views.question import FIRST_FIELDS, Axis, Description, Drawing, Field, Lines, Option, Question
from kinetostat.views.tables import FittedTable, numeric_table
from kinetostat.views.vibration import TOOL_RECEPTANCE, VIBRATING_LOADED, tool_sentence

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from kinetostat.views import figures
else:
    figures = LateModule("kinetostat.views.figures")

LISTED_SPEEDS = 12
"""Speeds with a row of the table, about, at equal distances: enough to see the pockets; all are in the files."""
SECONDS_PER_MINUTE = 60.0
"""Seconds of a minute: speeds of spindles are read in turns per minute."""
HEADROOM = 8.0
"""Height of the picture in multiples of the least width: pockets between lobes have no end."""


def _speed_text(turns: float) -> str:
    return f"{number(SECONDS_PER_MINUTE * turns)} 1/min"


def _lines(answer: Lobes) -> Lines:
    show = answer.machine.display.show
    if not answer.poses:
        return [("Pose", f"{pose_of(answer.machine)}. {answer.message}")]
    cutter = f"{answer.teeth} teeth" if answer.teeth > 1 else "one edge"
    lines = [
        ("Pose", f"{pose_of(answer.machine)}." if answer.poses == 1 else f"{answer.poses} poses; the least counts.")
    ]
    if math.isinf(answer.least):
        lines.append(("Cut", f"With {cutter} every width of cut is stable at every speed."))
        return lines
    text = f"With {cutter} every speed is stable up to a width of {show(answer.least, 'm')}; "
    lines.append(("Cut", f"{text}a wider cut chatters at {show(answer.frequency, 'Hz')} at some speeds."))
    if answer.best:
        speed, width = answer.best
        reach = "any width" if math.isinf(width) else show(width, "m")
        lines.append(("Speed", f"Of the speeds shown, {_speed_text(speed)} stays stable up to {reach}."))
    if answer.worst:
        lines.append(
            ("Worst", f"The least width is that at {pose_of(with_values(answer.machine, dict(answer.worst)))}.")
        )
    if answer.tool is not None:
        lines.append(("Tool", tool_sentence(answer.tool, answer.machine.display)))
    if answer.assumed:
        ratio = number(100.0 * ASSUMED_RATIO)
        lines.append(("Damping", f"Damping is assumed: {ratio} % of critical in every mode; give a table [damping]."))
    return lines


def _tables(answer: Lobes, full: bool) -> Iterator[FittedTable]:
    if not answer.poses:
        return
    table = numeric_table("Width of cut that stays stable", "speed", ["width"])
    step = 1 if full else max(1, (len(answer.speeds) - 1) // (LISTED_SPEEDS - 1))
    for speed, width in zip(answer.speeds[::step], answer.widths[::step], strict=True):
        shown = "any width" if math.isinf(width) else answer.machine.display.show(float(width), "m")
        table.add_row(_speed_text(float(speed)), shown)
    yield table


def lobes_figures(answer: Lobes) -> dict[str, Drawing]:
    """Return the drawing of the lobes; none without an answer, or where every cut is stable."""
    if not answer.poses or math.isinf(answer.least):
        return {}
    caption = "Width of cut that stays stable over the speed of the spindle; above the curve the cut chatters."
    return {"lobes": Drawing(caption, partial(lobes_figure, answer))}


def lobes_figure(answer: Lobes, title: str = "{}: stability lobes") -> "Figure":
    """Draw the width of cut that stays stable over the speed of the spindle."""
    scale = answer.machine.display.scale("m")
    least = answer.least * scale.factor
    top, out_of_view = HEADROOM * least, 2.0 * HEADROOM * least
    widths = np.minimum(np.where(np.isfinite(answer.widths), answer.widths, np.inf) * scale.factor, out_of_view)
    least_colour, lobe_colour = figures.COLOURS[:2]
    poses = f"least of {answer.poses} poses" if answer.poses > 1 else f"chatter at {answer.frequency:.4g} Hz"
    with figures.new_figure((5.6, 3.6), title.format(answer.machine.name), setting_of(answer.machine), poses) as figure:
        panel = figure.add_subplot()
        speeds = SECONDS_PER_MINUTE * answer.speeds
        panel.fill_between(speeds, widths, out_of_view, color=lobe_colour, alpha=0.18, linewidth=0.0)
        panel.plot(speeds, widths, color=lobe_colour)
        panel.axhline(least, color=least_colour, linewidth=0.8, linestyle="--")
        panel.annotate(
            "stable at every speed below", (0.99, least), (0, -3), color=least_colour, fontsize="small",
            ha="right", va="top", xycoords=panel.get_yaxis_transform(), textcoords="offset points",
        )  # fmt: skip
        panel.text(0.02, 0.95, "chatters", color=lobe_colour, transform=panel.transAxes, va="top")
        panel.set_xlim(float(speeds[0]), float(speeds[-1]))
        panel.set_ylim(0.0, top)
        panel.set_xlabel("speed of the spindle (1/min)")
        panel.set_ylabel(scale.label("width of cut"))
    return figure


LOBES = Description(
    title="Stability lobes",
    fields=(
        *FIRST_FIELDS,
        Field("teeth"),
        Field("pressure", unit="Pa"),
        Field("least_width", lambda answer: finite_or_none(answer.least), "m"),
        Field("chatter_frequency", lambda answer: finite_or_none(answer.frequency), "Hz"),
        Field("poses"),
        Field("worst_pose", lambda answer: dict(answer.worst), forms=("json",)),
        Field("damping_assumed", "assumed"),
        Field("speed", lambda answer: answer.speeds.tolist(), "1/s", forms=("json",)),
        Field(
            "width",
            lambda answer: [*map(finite_or_none, answer.widths.tolist())],
            "m",
            "width of cut that stays stable; none where every width is",
            forms=("json",),
        ),
        Field("width", "widths", "m", "width of cut that stays stable", ("speed",), ("nc",)),
    ),
    lines=_lines,
    tables=_tables,
    figures=lobes_figures,
    axes=(Axis("speed", "speeds", "1/s"),),
    answered=lambda answer: bool(answer.poses),
    files={"lobes.json": "json", "lobes.nc": "nc"},
)
LOBES_QUESTION = Question(
    example='kinetostat lobes hexapod --set tool.mass="12 kg" --cutting-pressure "2000 N/mm**2" --teeth 4 -o lobes',
    answer=lobes,
    options=(
        Option("teeth", "count", "number of edges of a milling cutter (default: one edge that stays in the cut)"),
        Option("entry", "quantity", "angle at which an edge enters the cut, from the normal to the feed", "ANGLE"),
        Option("leaving", "quantity", "angle at which it leaves the cut (default: 180 deg)", "ANGLE"),
        Option("feed", "direction", "direction of the feed (default: x)", default=()),
        Option("spindle", "direction", "axis of the spindle, towards the machine (default: z)", default=()),
        Option("radial", "number", "radial force as a share of the tangential one (default: 0.3)", default=0.3),
        Option(
            "cutting_pressure",
            "quantity",
            'tangential force per area of the chip, e.g. "2000 N/mm**2" (default: that of [cutting])',
            "PRESSURE",
        ),
        Option("lowest", "quantity", 'slowest speed, e.g. "2000 1/min"', "SPEED"),
        Option("highest", "quantity", 'fastest speed, e.g. "20000 1/min"', "SPEED"),
        Option(
            "over", "text", 'a range of poses, all of which must be stable: "x=-10 cm:10 cm:5"', "RANGE", (), many=True
        ),
        TOOL_RECEPTANCE,
    ),
    loaded=VIBRATING_LOADED,
    output="lobes.json, lobes.nc and the figure",
    slow="cutting",
    reports_progress=True,
)
