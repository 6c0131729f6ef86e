"""Motors along a motion: the question, the description of its answer, and diagrams of torque over speed.

Such a diagram shows what a motion asks of the motors; here it lies in that of each motor of a catalogue, and
`views.drives` draws it by itself.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.display import DASH, number
from kinetostat.late import LateModule
from kinetostat.machine.machine import Machine, setting_of
from kinetostat.studies.drives import DriveCurves, DriveLoads, root_mean_square
from kinetostat.studies.motors import MotorCandidate, MotorChoice, motors
from kinetostat.studies.requirements import motor_requirements
from kinetostat.units import load_unit
from kinetostat.views.question import (
    FIRST_FIELDS,
    REQUIREMENTS,
    Description,
    Drawing,
    Field,
    Lines,
    Option,
    Question,
    Records,
    requirements_met,
)
from kinetostat.views.tables import FittedTable, numeric_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from kinetostat.views import figures
else:
    figures = LateModule("kinetostat.views.figures")

MOST_DRAWN = 4
"""Number of motors that are drawn, the best of them: as many diagrams as fit on a page."""
PEAK_OPACITY, CONTINUOUS_OPACITY = 0.15, 0.3
"""Opacity of the torque that a motor may give for a short while and for ever: where both lie, it is dark."""
DIAGRAM_SIZE, ROOM_BESIDE_DIAGRAMS = (3.3, 2.7), (1.4, 0.9)
"""Width and height of the diagram of a motor; further width, of the legend, and height, of title and notes; inches."""
HEIGHT_ALONE = 3.4
"""Height of a diagram that has a figure to itself, inches."""
CLOUD_LOOK: dict[str, Any] = {"linewidth": 0.7, "alpha": 0.6}
"""Look of the line through all points of a motion, which crosses itself often: thinner and paler than an outline."""
OUTLINE_LOOK: dict[str, Any] = {"linewidth": 1.2}
"""Look of the outline of what a speed in all directions asks for."""
LIMIT_POINTS = 200
"""Points of the line of a limit over the speed: its corners stand where they are to a pixel or two."""
PER_MINUTE = 30.0 / np.pi
"""Turns per minute of 1 rad/s."""
MOST_NAMED_DRIVES = 8
"""Drives that a legend names at most: a longer one would be taller than the figure."""
PEAK_MARK, RMS_MARK = "\N{MULTIPLICATION SIGN} peak", "\N{BLACK CIRCLE} RMS"
"""Meaning of the marks in a speed-torque diagram."""


def _percent_text(share: float) -> str:
    """Return a share in percent; an infinite one comes of speeds at which the motor has no torque."""
    return f"{100.0 * share:.0f} %" if math.isfinite(share) else "too fast"


def _lines(answer: MotorChoice) -> Lines:
    yield "Motors", answer.message
    # All sources are in files; a reader wants to check the motor that the answer names.
    for best in answer.candidates[:1]:
        if best.source:
            yield "Source", f"{best.name}: {best.source}."


def _tables(answer: MotorChoice, _full: bool) -> Iterator[FittedTable]:
    if not answer.candidates:
        return
    columns = ["fits", "peak torque", "RMS", "speed", "inertia ratio", "hardest drive"]
    table = numeric_table("Share of its limits that the motion uses", "motor", columns)
    for candidate in answer.candidates:
        ratio = DASH if candidate.inertia_ratio is None else number(candidate.inertia_ratio, digits=3)
        shares = [_percent_text(share) for share in (candidate.peak, candidate.continuous, candidate.speed)]
        table.add_row(candidate.name, "yes" if candidate.suffices else "no", *shares, ratio, candidate.drive)
    yield table


def _figures(answer: MotorChoice) -> dict[str, Drawing]:
    if not answer.candidates:
        return {}
    caption = "Torque and speed of all drives in the diagrams of the motors; circles: RMS."
    return {"motors": Drawing(caption, partial(motors_figure, answer))}


def motors_figure(answer: MotorChoice, title: str = "{}: motors along the motion") -> "Figure":
    """Draw the speed-torque diagram of the best motors, with the motion and its mean squares in it."""
    shown = answer.candidates[:MOST_DRAWN]
    rows, columns = figures.grid_shape(len(shown), most_columns=2)
    note = "shaded: torque that the motor may give; dark: for ever, light: for a short while"
    (width, height), (legend_width, title_height) = DIAGRAM_SIZE, ROOM_BESIDE_DIAGRAMS
    size = legend_width + width * columns, title_height + height * rows
    with figures.new_figure(size, title.format(answer.machine.name)) as figure:
        for panel, candidate in zip(figures.panel_grid(figure, len(shown), most_columns=2), shown, strict=True):
            _draw_diagram(panel, answer, candidate)
        name_drives(figure, shown[0].loads, f"{PEAK_MARK}\n{RMS_MARK}")
        note_motion(figure, shown[0].loads, note)
    return figure


def _draw_diagram(panel: "Axes", answer: MotorChoice, candidate: MotorCandidate) -> None:
    scale = answer.machine.display.scale("N·m")
    speeds = np.linspace(0.0, candidate.motor.greatest_speed, LIMIT_POINTS)
    for peak, opacity in ((True, PEAK_OPACITY), (False, CONTINUOUS_OPACITY)):
        limit = candidate.motor.limit(peak, speeds) * scale.factor
        panel.fill_between(speeds * PER_MINUTE, limit, color=figures.COLOURS[0], alpha=opacity, linewidth=0.0)
    if candidate.loads.curves is not None:
        draw_torque_over_speed(panel, candidate.loads, rotary=True)
    verdict = "fits" if candidate.suffices else "does not fit"
    panel.set_title(f"{candidate.name}: {verdict}", loc="left", parse_math=False)


def curves_of(answer: DriveLoads) -> DriveCurves:
    """Return the curves of an answer along a motion.

    Raises:
        ValueError: the answer has none.
    """
    if answer.curves is None:
        raise ValueError("an answer without curves has none to show")
    return answer.curves


def draw_torque_over_speed(panel: "Axes", answer: DriveLoads, rotary: bool) -> None:
    """Draw the torque of each motor over its speed, its peak as a cross, and the roots of its mean squares as a point.

    In all directions at once there is no line through points; what they ask for most is drawn.

    Args:
        panel: the panel whose axes are labelled as well.
        answer: an answer along a motion.
        rotary: whether motors that turn are drawn, in turns per minute, or those that are linear drives themselves.
    """
    curves, times = curves_of(answer), answer.motion.times
    scale = answer.machine.display.scale(load_unit(rotary))
    factor = PER_MINUTE if rotary else 1.0
    look = OUTLINE_LOOK if answer.motion.timeless else CLOUD_LOOK
    for k, drive in enumerate(answer.drives):
        if drive.rotary is not rotary:
            continue
        colour, torque = figures.colour_of(k), np.abs(curves.motor_torque[k]) * scale.factor
        speed, peak = np.abs(curves.motor_speed[k]) * factor, int(np.argmax(torque))
        line = _most_at_speeds(speed, torque) if answer.motion.timeless else (speed, torque)
        panel.plot(*line, color=colour, **look)
        panel.plot(
            speed[peak], torque[peak], "x", color=colour, markersize=6, markeredgewidth=1.5, zorder=3, clip_on=False
        )
        if not answer.motion.timeless:
            rms_speed, rms_torque = float(root_mean_square(times, speed)), drive.rms_torque * scale.factor
            panel.plot(rms_speed, rms_torque, "o", color=colour, markersize=6, markeredgecolor="white", zorder=4)
        panel.plot([], [], color=colour, linewidth=3.0, label=drive.name)  # for the legend: a thin line shows no colour
    panel.set_xlabel("speed (1/min)" if rotary else "speed (m/s)")
    panel.set_ylabel(scale.label("torque" if rotary else "force"))
    panel.set_xlim(left=0.0)
    panel.set_ylim(bottom=0.0)


def _most_at_speeds(speed: Array, torque: Array) -> tuple[Array, Array]:
    """Return the greatest torque at each speed or above it, as a line from the axis of torques to that of speeds."""
    order = np.argsort(-speed)
    greatest = np.maximum.accumulate(torque[order])
    corners = np.flatnonzero(np.diff(greatest, prepend=-1.0) > 0.0)
    speeds, torques = speed[order][corners], greatest[corners]
    return np.array([speeds[0], *speeds, 0.0]), np.array([0.0, *torques, torques[-1]])


def name_drives(figure: "Figure", answer: DriveLoads, meaning: str = "") -> None:
    """Name the colours of the drives beside a figure, if they are few enough; its marks are explained in any case.

    Args:
        figure: a figure whose panels have been drawn.
        answer: an answer along a motion.
        meaning: the meaning of the marks, a line each; empty for a figure without marks.
    """
    pairs = [panel.get_legend_handles_labels() for panel in figure.axes]
    named = {name: handle for handles, names in pairs for handle, name in zip(handles, names, strict=True)}
    if len(answer.drives) > MOST_NAMED_DRIVES:
        named = {}
    if named or meaning:
        figure.legend(
            named.values(), named.keys(), loc="outside right upper", frameon=False, fontsize="small",
            title=meaning, title_fontsize="small", alignment="left",
        )  # fmt: skip


def speed_torque_figure(answer: DriveLoads, title: str = "{}: what the motors must give") -> "Figure":
    """Draw the torque of each motor over its speed, with its peak and its root mean square."""
    shown = [rotary for rotary in (True, False) if any(drive.rotary is rotary for drive in answer.drives)]
    size = figures.PAGE_WIDTH, ROOM_BESIDE_DIAGRAMS[1] + HEIGHT_ALONE * len(shown)
    with figures.new_figure(size, title.format(answer.machine.name)) as figure:
        for panel, rotary in zip(figure.subplots(len(shown), 1, squeeze=False).flat, shown, strict=True):
            draw_torque_over_speed(panel, answer, rotary)
        name_drives(figure, answer, PEAK_MARK if answer.motion.timeless else f"{PEAK_MARK}\n{RMS_MARK}")
        note_motion(figure, answer)
    return figure


def note_motion(figure: "Figure", answer: DriveLoads, *further: str) -> None:
    """Write below a figure where its machine is but for what moves, and along which motion it goes."""
    moving, names = setting_of(answer.machine, answer.motion.path.columns), ", ".join(answer.motion.loads)
    figures.note_setting(figure, moving, answer.motion.kind + (f", with {names}" if names else ""), *further)


def motors_with_verdicts(machine: Machine, **options: Any) -> MotorChoice:
    """Answer as `motors` does, and judge the motors that the machine's file requires."""
    return replace(motors(machine, **options), requirements=motor_requirements(machine))


MOTORS = Description(
    title="Motors along the motion",
    fields=(
        *FIRST_FIELDS,
        REQUIREMENTS,
        Records(
            "motors",
            "motor",
            (
                Field("name", column="motor_name"),
                Field("fits", "suffices"),
                Field("peak", long_name="share of the peak torque limit that is used"),
                Field("continuous", long_name="share of the continuous torque limit that is used"),
                Field("speed", long_name="share of the greatest speed that is used"),
                Field("inertia_ratio", unit="1", long_name="inertia of the load over that of the rotor"),
                Field("drive", long_name="drive with the least reserve", column="worst_drive"),
                Field("source"),
            ),
            "candidates",
        ),
    ),
    lines=_lines,
    tables=_tables,
    figures=_figures,
    answered=lambda answer: bool(answer.candidates),
    kept=requirements_met,
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
        Option("points", "count", "approximate number of points of the motion (default: 400)", default=400),
    ),
    output="motors.json, motors.csv and the figure",
)
