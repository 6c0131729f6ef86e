"""Drives along a motion: the question, the description of its answer, and its figures.

Only energies are added up here; the answer is computed in `studies.drives`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.display import DASH, number
from kinetostat.kinematics.closing import POINT
from kinetostat.late import LateModule
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import find_field
from kinetostat.motion.forces import PARTS
from kinetostat.studies.drives import DriveCurves, DriveLoad, DriveLoads, drives
from kinetostat.studies.motion_deflection import ModesAlong
from kinetostat.studies.requirements import motor_requirements
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY
from kinetostat.units import load_unit, motion_unit
from kinetostat.views.data_forms import column_head, columns_csv
from kinetostat.views.motors import PER_MINUTE, curves_of, name_drives, note_motion, speed_torque_figure
from kinetostat.views.question import (
    FIRST_FIELDS,
    REQUIREMENTS,
    Axis,
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

MOST_MODES = 6
"""Excited modes that are named: the lowest ones move the tool most."""
PANEL_HEIGHT, ROOM_FOR_TITLE = 1.7, 0.9
"""Height of a panel over time, and of title and notes, inches."""
HEIGHT_OF_PARTS = 3.2
"""Height of the figure of the parts of one force, whose curves cross each other, inches."""
ZERO_COLOUR = "#b0b0b0"
"""Grey of the line at zero, paler than the curves that cross it."""
CURVE_WIDTH, WHOLE_WIDTH = 1.1, 1.4
"""Widths of the curve of a drive or of a part of its force, and of that of the whole force, points."""


def _lines(answer: DriveLoads) -> Lines:
    yield "Drives", answer.message
    if answer.worst is None:
        return
    point, name = answer.worst
    if answer.motion.timeless:
        path = answer.motion.path
        speed, acceleration = (_components_at(point, rows) for rows in (path.rates, path.accelerations))
        yield "Worst way", f"{name} does most at the speed {speed} m/s with the acceleration {acceleration} m/s²."
        return
    if names := ", ".join(answer.motion.loads):
        yield "Loads", f"The motion says {names}, in the place of what the file has there."
    yield "Worst pose", f"{name} does most at {answer.motion.times[point]:.4g} s: {_pose_text(answer, point)}."
    yield "Energy", _energy_sentence(answer)
    if answer.greatest_deflection is not None:
        size, place = answer.greatest_deflection
        shown, moment = answer.machine.display.show_deflection(size, "m"), f"{answer.motion.times[place]:.4g} s"
        text = f"The tool deflects by up to {shown}, at {moment}, as it would at rest under the same forces."
        yield "Deflection", text
    if answer.along_modes is not None:
        yield "Vibration", _modes_text(answer, answer.along_modes)
    if any(drive.slides and not drive.rotary for drive in answer.drives):  # the motor of a drive with a lead turns
        lead = f'lead = "{answer.machine.display.show(0.01, "m")}"'
        yield "Motors", f"The file gives no lead, so that motors are taken for linear ones; write {lead} in [drives]."


def _energy_sentence(answer: DriveLoads) -> str:
    """Say what all motors give and take back in the whole motion; a net energy that is round-off is 0."""
    net = sum(drive.energy.net for drive in answer.drives)
    braking = sum(drive.energy.braking for drive in answer.drives)
    gross = max(net + braking, 0.0)
    net = net if abs(net) > ROUND_OFF_OF_ENTRY * gross else 0.0
    text = f"All motors together give {number(gross)} J, and take back {number(braking)} J while they brake"
    return f"{text}: {number(net)} J net."


def _modes_text(answer: DriveLoads, along: ModesAlong) -> str:
    """Say whether springs follow the motion as at rest, or which modes it excites and how far the tool deflects."""
    if not along.modes or answer.greatest_with_modes is None:
        return (
            f"The motion excites no mode, of which the lowest has {number(along.frequency)} Hz with motors that "
            "stand still: springs follow it as at rest."
        )
    show = answer.machine.display.show_deflection
    frequencies = list(dict.fromkeys(number(frequency) for frequency in along.modes))
    listed = ", ".join(frequencies[:MOST_MODES]) + (", ..." if len(frequencies) > MOST_MODES else "")
    size, moment = answer.greatest_with_modes
    text = f"The motion excites modes at {listed} Hz: with them the tool deflects by up to {show(size, 'm')}, at "
    text += f"{moment:.4g} s"
    return f"{text}, and after the end it swings by up to {show(along.after, 'm')}." if along.after else f"{text}."


def _components_at(point: int, rows: Mapping[str, Array]) -> str:
    """Return the components of a speed or an acceleration of the platform point, SI, at a point of the motion."""
    return ", ".join(f"{name} {number(float(row[point]))}" for name, row in rows.items() if name in POINT)


def _pose_text(answer: DriveLoads, point: int) -> str:
    show = answer.machine.display.show
    units = {name: find_field(answer.machine.family, f"pose.{name}").unit for name in answer.motion.path.pose}
    return ", ".join(
        f"{name} {show(float(rows[point]), units[name])}" for name, rows in answer.motion.path.pose.items()
    )


def _tables(answer: DriveLoads, full: bool) -> Iterator[FittedTable]:
    if answer.drives:
        yield _drive_table(answer)
        yield _motor_table(answer)
        yield _parts_table(answer)
        if full:
            yield _joint_table(answer)


def _drive_table(answer: DriveLoads) -> FittedTable:
    """Return the range of each drive, and its greatest speed, acceleration and force."""
    display = answer.machine.display
    heads = ["from", "to", "speed", "acceleration", "force", "RMS"]
    table = numeric_table("Drives: greatest values", "drive", heads)
    for drive in answer.drives:
        unit = motion_unit(not drive.slides)
        scale = display.scale(unit)
        ends = [display.show(end, unit) for end in drive.coordinate]
        speed, acceleration = (number(size * scale.factor) for size in (drive.speed, drive.acceleration))
        rates = [f"{speed} {scale.unit}/s", f"{acceleration} {scale.unit}/s²"]
        forces = [display.show(force, drive.unit) for force in (drive.force, drive.rms_force)]
        table.add_row(drive.name, *ends, *rates, *forces)
    return table


def _motor_table(answer: DriveLoads) -> FittedTable:
    """Return what each motor must give, and the inertia that it feels."""
    table = numeric_table("Motors", "motor", ["speed", "torque", "RMS", "power", "net energy", "load inertia", "ratio"])
    for drive in answer.drives:
        inertia = DASH if drive.reflected is None else f"{number(drive.reflected)} {'kg·m²' if drive.rotary else 'kg'}"
        ratio = DASH if drive.inertia_ratio is None else number(drive.inertia_ratio)
        torques = (_show(answer, torque, drive.motor_unit) for torque in (drive.motor_torque, drive.rms_torque))
        net = DASH if np.isnan(drive.energy.net) else f"{number(drive.energy.net)} J"
        work = (f"{number(drive.power.greatest)} W", net)
        table.add_row(drive.name, _motor_speed(drive), *torques, *work, inertia, ratio)
    return table


def _parts_table(answer: DriveLoads) -> FittedTable:
    """Return the greatest size of each part of the force of each drive, of parts that there are."""
    shown = [part for part in PARTS if any(drive.parts[part] > 0.0 for drive in answer.drives)]
    table = numeric_table("Force of the drives: greatest size of each part", "drive", shown)
    for drive in answer.drives:
        table.add_row(drive.name, *(answer.machine.display.show(drive.parts[part], drive.unit) for part in shown))
    return table


def _joint_table(answer: DriveLoads) -> FittedTable:
    """Return the greatest loads of each joint."""
    table, display = numeric_table("Joints: greatest loads", "joint", ["force", "moment"]), answer.machine.display
    for joint in answer.joints:
        moment = DASH if joint.moment is None else display.show(joint.moment, "N·m")
        table.add_row(joint.name, display.show(joint.force, "N"), moment)
    return table


def _show(answer: DriveLoads, value: float, unit: str) -> str:
    return DASH if np.isnan(value) else answer.machine.display.show(value, unit)


def _motor_speed(drive: DriveLoad) -> str:
    return f"{number(drive.motor_speed * PER_MINUTE)} 1/min" if drive.rotary else f"{number(drive.motor_speed)} m/s"


def over_time_figure(answer: DriveLoads, title: str = "{}: drives along the motion") -> "Figure":
    """Draw speed, force and power of all drives over time."""
    contents = list(_contents_over_time(answer, curves_of(answer)))
    with figures.new_figure(
        (figures.PAGE_WIDTH, ROOM_FOR_TITLE + PANEL_HEIGHT * len(contents)), title.format(answer.machine.name)
    ) as figure:
        panels = list(figure.subplots(len(contents), 1, sharex=True, squeeze=False).flat)
        for panel, content in zip(panels, contents, strict=True):
            _draw_over_time(panel, answer, content)
        panels[-1].set_xlabel("time (s)")
        name_drives(figure, answer)
        note_motion(figure, answer)
    return figure


class ContentOverTime(NamedTuple):
    """A panel over time: its label, the places of the drives that it shows, and their values [places x n]."""

    label: str
    places: Sequence[int]
    values: Array


def _contents_over_time(answer: DriveLoads, curves: DriveCurves) -> Iterator[ContentOverTime]:
    """Give the panels of a figure over time: speed and force of linear and of rotary drives, and the power of all."""
    display = answer.machine.display
    for turning, kind in ((False, "force"), (True, "torque")):
        if chosen := [k for k, drive in enumerate(answer.drives) if drive.slides is not turning]:
            motion, load = display.scale(motion_unit(turning)), display.scale(load_unit(turning))
            yield ContentOverTime(f"speed ({motion.unit}/s)", chosen, curves.speed[chosen] * motion.factor)
            yield ContentOverTime(load.label(kind), chosen, curves.force[chosen] * load.factor)
    yield ContentOverTime("power of motors (W)", range(len(answer.drives)), curves.power)


def _draw_over_time(panel: "Axes", answer: DriveLoads, content: ContentOverTime) -> None:
    """Draw the values of some drives over time; colours that come again are dashed."""
    panel.axhline(0.0, color=ZERO_COLOUR, linewidth=0.8)
    for k, values in zip(content.places, content.values, strict=True):
        dash = "--" if k >= len(figures.COLOURS) else "-"
        look: dict[str, Any] = {"color": figures.colour_of(k), "linewidth": CURVE_WIDTH, "label": answer.drives[k].name}
        panel.plot(answer.motion.times, values, dash, **look)
    panel.set_ylabel(content.label)


def parts_figure(answer: DriveLoads, name: str, title: str = "{}: parts of the force of {}") -> "Figure":
    """Draw the parts of the force of the drive of that name, and the whole force, over time."""
    curves, times = curves_of(answer), answer.motion.times
    k = [drive.name for drive in answer.drives].index(name)
    scale = answer.machine.display.scale(answer.drives[k].unit)
    with figures.new_figure((figures.PAGE_WIDTH, HEIGHT_OF_PARTS), title.format(answer.machine.name, name)) as figure:
        panel = figure.add_subplot()
        for colour, part, force in zip(figures.COLOURS, PARTS, curves.parts[k], strict=False):
            if np.any(force):
                panel.plot(times, force * scale.factor, color=colour, linewidth=CURVE_WIDTH, label=part)
        panel.plot(times, curves.force[k] * scale.factor, color="black", linewidth=WHOLE_WIDTH, label="whole")
        panel.set_xlabel("time (s)")
        panel.set_ylabel(scale.label("force" if answer.drives[k].slides else "torque"))
        panel.legend(frameon=False, fontsize="small", ncols=3)
        note_motion(figure, answer)
    return figure


def _figures(answer: DriveLoads) -> dict[str, Drawing]:
    if answer.worst is None:
        return {}
    if answer.motion.timeless:
        return {"speed_torque": Drawing("Torque and speed in all directions.", partial(speed_torque_figure, answer))}
    name = answer.worst.drive
    return {
        "drives": Drawing("Speed, force and power of the drives along the motion.", partial(over_time_figure, answer)),
        "speed_torque": Drawing("Torque and speed that the motors must give.", partial(speed_torque_figure, answer)),
        "parts": Drawing(f"Parts of the force of {name}, which does most.", partial(parts_figure, answer, name)),
    }


def curves_csv(answer: DriveLoads) -> str | None:
    """Write all drives over time as CSV, SI: a row for each point of the motion."""
    if answer.curves is None or answer.motion.timeless:
        return None
    curves, columns = answer.curves, {"time [s]": answer.motion.times}
    columns |= answer.motion.path.pose
    columns |= {column_head(name, load["units"]): load["values"] for name, load in answer.motion.loads.items()}
    for k, drive in enumerate(answer.drives):
        unit = motion_unit(not drive.slides)
        values_of_all = (
            ("coordinate", unit, curves.coordinate),
            ("speed", f"{unit}/s", curves.speed),
            ("acceleration", f"{unit}/s**2", curves.acceleration),
            ("force", drive.unit, curves.force),
            ("motor torque", drive.motor_unit, curves.motor_torque),
            ("power", "W", curves.power),
            ("net energy", "J", curves.net_energy),
        )
        columns |= {column_head(f"{drive.name} {name}", si): values[k] for name, si, values in values_of_all}
    return columns_csv(columns)


def _of_modes(number_of: Callable[[ModesAlong], Any]) -> Callable[[DriveLoads], Any]:
    """Return a function that gives a number of the modes along the motion; None where they are not known."""
    return lambda answer: None if answer.along_modes is None else number_of(answer.along_modes)


def _loads_over_time(answer: DriveLoads) -> Array:
    """Return forces and moments that the motion says [components x n]; n is 0 where there is no answer."""
    loads = answer.motion.path.loads
    count = 0 if answer.curves is None else len(answer.motion.times)
    return np.array([rows[:count] for rows in loads.values()]).reshape(len(loads), count)


def _over_time(name: str, unit: str, meaning: str) -> Field:
    """Return the field of a curve of all drives, an attribute of `DriveCurves`; it is empty without an answer."""
    values_of = attrgetter(f"curves.{name}")

    def take(answer: DriveLoads) -> Array:
        return np.zeros((0, 0)) if answer.curves is None else np.asarray(values_of(answer))

    return Field(f"{name}_over_time", take, unit, meaning, ("drive", "time"))


def drives_with_verdicts(machine: Machine, **options: Any) -> DriveLoads:
    """Answer as `drives` does, and judge the motors that the machine's file requires."""
    return replace(drives(machine, **options), requirements=motor_requirements(machine))


DRIVES = Description(
    title="Drives along the motion",
    fields=(
        *FIRST_FIELDS,
        Field("motion", "motion.kind"),
        Field("duration", "motion.duration", "s"),
        Field("loads", lambda a: a.motion.loads or None, forms=("json",), optional=True),
        Field(
            "loads_over_time",
            _loads_over_time,
            "",
            "forces and moments that the motion says, N or N·m",
            ("load_component", "time"),
            ("nc",),
        ),
        Field("worst_time", lambda a: None if a.worst is None else float(a.motion.times[a.worst.point]), "s"),
        Field("worst_drive", lambda a: None if a.worst is None else a.worst.drive),
        Field(
            "frequency",
            _of_modes(lambda modes: modes.frequency),
            "Hz",
            "lowest natural frequency with motors that stand still",
        ),
        Field(
            "excited_modes", _of_modes(lambda modes: modes.modes), "Hz", "natural frequencies that the motion excites"
        ),
        Field("deflection_with_modes", lambda a: a.greatest_with_modes and a.greatest_with_modes[0], "m"),
        Field(
            "deflection_after",
            _of_modes(lambda modes: modes.after),
            "m",
            "greatest swing of the tool point after the end",
        ),
        REQUIREMENTS,
        Field("greatest_deflection", lambda a: a.greatest_deflection and a.greatest_deflection[0], "m"),
        Records(
            "drives",
            "drive",
            (
                Field("name", column="drive_name"),
                Field("linear", "slides"),
                Field("coordinate_from", lambda d: d.coordinate[0], "", "least coordinate, m or rad"),
                Field("coordinate_to", lambda d: d.coordinate[1], "", "greatest coordinate, m or rad"),
                Field("speed", long_name="greatest speed, m/s or rad/s"),
                Field("acceleration", long_name="greatest acceleration, m/s² or rad/s²"),
                Field("force", long_name="greatest force or torque, N or N·m"),
                Field("rms_force", long_name="root of the mean square of the force or torque, N or N·m"),
                Field("parts", axes=("part",), column="greatest", long_name="greatest size of each part, N or N·m"),
                Field("turns", long_name="radians of the rotor per m or rad of the coordinate"),
                Field("motor_speed", long_name="greatest speed of the motor, rad/s or m/s"),
                Field("motor_torque", long_name="greatest torque of the motor, N·m, or force, N"),
                Field("rms_torque", long_name="root of the mean square of the torque or force of the motor, N·m or N"),
                Field("power", lambda d: d.power.greatest, "W", "greatest power of the motor"),
                Field("braking_power", lambda d: d.power.least, "W", "least power of the motor, where it brakes"),
                Field("net_energy", lambda d: d.energy.net, "J", "what the motor gives, less what it takes back"),
                Field(
                    "braking_energy",
                    lambda d: d.energy.braking,
                    "J",
                    "energy that the motor takes back while it brakes",
                ),
                Field("reflected_inertia", "reflected", "", "inertia of the load at the motor, kg·m², or kg"),
                Field("inertia_ratio", unit="1", long_name="inertia of the load over that of the rotor"),
            ),
        ),
        Records(
            "joints",
            "joint",
            (
                Field("name", column="joint_name"),
                Field("force", "force", "N", "greatest force that the joint passes on", column="joint_force"),
                Field("moment", "moment", "N·m", "greatest moment about the point of the joint", column="joint_moment"),
            ),
            forms=("json", "nc"),
        ),
        _over_time("coordinate", "", "m or rad"),
        _over_time("speed", "", "m/s or rad/s"),
        _over_time("acceleration", "", "m/s² or rad/s²"),
        _over_time("force", "", "N or N·m"),
        _over_time("motor_torque", "", "N·m, or N of a linear motor"),
        _over_time("power", "W", "power of the motor"),
        _over_time("net_energy", "J", "what the motor has given, less what it has taken back"),
        Field(
            "deflection",
            lambda a: np.zeros((0, 6)) if a.deflection is None else a.deflection,
            "",
            "deflection of the tool point at rest under the forces of the motion: rotation, rad, and displacement, m",
            ("time", "component"),
        ),
    ),
    lines=_lines,
    tables=_tables,
    figures=_figures,
    axes=(
        Axis("time", lambda a: np.zeros(0) if a.curves is None else a.motion.times, "s"),
        Axis("load_component", lambda a: np.array(list(a.motion.loads), dtype=str)),
        Axis("component", lambda _a: np.array(COMPONENTS)),
    ),
    answered=lambda answer: bool(answer.drives),
    kept=requirements_met,
    files={"drives.json": "json", "drives.csv": "csv", "drives.nc": "nc", "curves.csv": curves_csv},
)


DRIVES_QUESTION = Question(
    example='kinetostat drives hexapod motion.csv --set drives.lead="10 mm" --set tool.mass="12 kg" -o drives',
    answer=drives_with_verdicts,
    options=(
        Option(
            "motion", "file",
            "a CSV file of a motion: poses with times, poses with a feed rate, or sines (docs/drives.md); forces "
            "may be columns, such as force.x [N]; default: the motion of the file's requirements",
            "MOTION", first=True,
        ),
        Option(
            "speed", "quantity", 'without a motion: speed of the platform point in the worst direction, e.g. "0.5 m/s"',
            "SPEED",
        ),
        Option(
            "acceleration", "quantity", 'without a motion: acceleration in the worst direction, e.g. "5 m/s**2"',
            "ACCELERATION",
        ),
        Option("points", "count", "approximate number of points of the motion (default: 400)", default=400),
    ),
    output="drives.json, drives.csv, drives.nc, curves.csv and the figures",
    full="show the loads of all joints as well",
)  # fmt: skip
