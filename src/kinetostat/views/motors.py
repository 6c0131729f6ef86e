"""Motors of a catalogue along a motion: the question, the description of its answer, and the speed-torque diagram."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kinetostat.display import DASH, number
from kinetostat.machine.machine import Machine
from kinetostat.studies.motors import MotorChoice, MotorFit, motors
from kinetostat.studies.requirements import motor_requirements
from kinetostat.views.drive_figures import (
    PEAK_MARK,
    PER_MINUTE,
    RMS_MARK,
    draw_torque_over_speed,
    name_drives,
    note_motion,
)
from kinetostat.views.figures import new_figure
from kinetostat.views.question import FIRST_FIELDS, Description, Drawing, Field, Lines, Option, Question, Records
from kinetostat.views.tables import FittedTable, numeric_table

MOST_DRAWN = 4
"""Number of motors that are drawn, the best of them: as many diagrams as fit on a page."""


def _percent_text(share: float) -> str:
    return f"{100.0 * share:.0f} %" if math.isfinite(share) else "too fast"


def _lines(answer: MotorChoice) -> Lines:
    lines = [("Motors", answer.message)]
    sources = [f"{fit.name}: {fit.source}" for fit in answer.fits[:1] if fit.source]
    return [*lines, *(("Source", f"{text}.") for text in sources)]


def _tables(answer: MotorChoice, _full: bool) -> Iterator[FittedTable]:
    if not answer.fits:
        return
    columns = ["fits", "peak torque", "RMS", "speed", "inertia ratio", "most at"]
    table = numeric_table("Share of its limits that the motion uses", "motor", columns)
    for fit in answer.fits:
        ratio = DASH if fit.inertia_ratio is None else number(fit.inertia_ratio, digits=3)
        shares = [_percent_text(share) for share in (fit.peak, fit.continuous, fit.speed)]
        table.add_row(fit.name, "yes" if fit.fits else "no", *shares, ratio, fit.drive)
    yield table


def _figures(answer: MotorChoice) -> dict[str, Drawing]:
    if not answer.fits:
        return {}
    caption = "Torque and speed of all drives in the diagrams of the motors; circles: RMS."
    return {"motors": Drawing(caption, partial(motors_figure, answer))}


def motors_figure(answer: MotorChoice, title: str = "{}: motors along the motion") -> Figure:
    """Draw the speed-torque diagram of the best motors, with the motion and its mean squares in it.

    Args:
        answer: an answer with motors.
        title: over the figure, with braces for the name of the machine.
    """
    shown = answer.fits[:MOST_DRAWN]
    columns = min(2, len(shown))
    rows = -(-len(shown) // columns)
    note = "shaded: torque that the motor may give; dark: for ever, light: for a short while"
    with new_figure((1.4 + 3.3 * columns, 0.9 + 2.7 * rows), title.format(answer.machine.name)) as figure:
        panels = figure.subplots(rows, columns, squeeze=False).flat
        for panel, fit in zip(panels, shown, strict=False):
            _diagram(panel, answer, fit)
        for panel in figure.axes[len(shown) :]:
            panel.set_visible(False)
        name_drives(figure, shown[0].loads, f"{PEAK_MARK}\n{RMS_MARK}")
        note_motion(figure, shown[0].loads, note)
    return figure


def _diagram(panel: Axes, answer: MotorChoice, fit: MotorFit) -> None:
    scale = answer.machine.display.scale("N·m")
    speeds = np.linspace(0.0, fit.motor.greatest_speed, 200)
    for peak, opacity in ((True, 0.15), (False, 0.3)):
        limit = fit.motor.limit(peak, speeds) * scale.factor
        panel.fill_between(speeds * PER_MINUTE, limit, color="#0072b2", alpha=opacity, linewidth=0.0)
    if fit.loads.curves is not None:
        draw_torque_over_speed(panel, fit.loads, rotary=True)
    panel.set_title(f"{fit.name}: {'fits' if fit.fits else 'does not fit'}", loc="left", parse_math=False)


def _finite(share: float) -> float | None:
    return share if math.isfinite(share) else None


def motors_with_verdicts(machine: Machine, **options: Any) -> MotorChoice:
    """Answer as `motors` does, and judge the motors that the machine's file requires."""
    return replace(motors(machine, **options), requirements=motor_requirements(machine))


MOTORS = Description(
    title="Motors along the motion",
    fields=(
        *FIRST_FIELDS,
        Field("requirements", lambda choice: choice.requirements or None, optional=True),
        Records(
            "motors",
            "motor",
            (
                Field("name", column="motor_name"),
                Field("fits"),
                Field("peak", lambda fit: _finite(fit.peak), "", "share of the peak torque limit that is used"),
                Field("continuous", long_name="share of the continuous torque limit that is used"),
                Field("speed", long_name="share of the greatest speed that is used"),
                Field("inertia_ratio", long_name="of the load to the rotor"),
                Field("drive", long_name="drive with the least reserve", column="worst_drive"),
                Field("source"),
            ),
            "fits",
        ),
    ),
    lines=_lines,
    tables=_tables,
    figures=_figures,
    answered=lambda answer: bool(answer.fits),
    kept=lambda answer: all(verdict.met for verdict in answer.requirements),
    files={"motors.json": "json", "motors.csv": "csv"},
)
MOTORS_QUESTION = Question(
    example='kinetostat motors hexapod motion.csv --set drives.lead="10 mm" --set tool.mass="12 kg" -o motors',
    answer=motors_with_verdicts,
    options=(
        Option(
            "motion",
            "file",
            "a CSV file of a motion, as for drives (docs/drives.md); default: that of the file's requirements",
            metavar="MOTION",
            first=True,
        ),
        Option("catalogue", "file", "TOML file of motors, gears and screws (default: that of kinetostat)"),
        Option("gear", "text", "name of a gear of the catalogue, for rotary drives", metavar="NAME", default=""),
        Option("screw", "text", "name of a screw of the catalogue, for linear drives", metavar="NAME", default=""),
        Option("points", "count", "number of points of the motion, about (default: 400)", default=400),
    ),
    output="motors.json, motors.csv and the figure",
)
