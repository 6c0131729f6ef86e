"""Figures of drives along a motion: over time, torque over speed, and parts of a force. Nothing is computed here.

`views.motors` draws a motion into the diagrams of motors by the same functions.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kinetostat.arrays import Array
from kinetostat.machine.machine import setting_of
from kinetostat.motion.forces import PARTS
from kinetostat.studies.drives import DriveCurves, DriveLoads, root_mean_square
from kinetostat.units import load_unit, motion_unit
from kinetostat.views.figures import COLOURS, new_figure, note_setting

PER_MINUTE = 30.0 / np.pi
"""Turns per minute of 1 rad/s."""
MOST_LEGEND = 8
"""Drives that a legend names: a longer one would be taller than the figure."""
PEAK_MARK, RMS_MARK = "\N{MULTIPLICATION SIGN} peak", "\N{BLACK CIRCLE} RMS"
"""Meaning of the marks in a speed-torque diagram."""


def _curves(answer: DriveLoads) -> DriveCurves:
    if answer.curves is None:
        raise ValueError("an answer without curves has none to show")
    return answer.curves


def over_time_figure(answer: DriveLoads, title: str = "{}: drives along the motion") -> Figure:
    """Draw speed, force and power of all drives over time."""
    curves, display = _curves(answer), answer.machine.display
    rows: list[tuple[Array, str, list[bool]]] = []
    for turning, kind in ((False, "force"), (True, "torque")):
        chosen = [drive.slides is not turning for drive in answer.drives]
        if any(chosen):
            scale, force = display.scale(motion_unit(turning)), display.scale(load_unit(turning))
            rows.append((curves.speed * scale.factor, f"speed ({scale.unit}/s)", chosen))
            rows.append((curves.force * force.factor, force.label(kind), chosen))
    rows.append((curves.power, "power of motors (W)", [True] * len(answer.drives)))
    with new_figure((6.6, 0.9 + 1.7 * len(rows)), title.format(answer.machine.name)) as figure:
        panels = list(figure.subplots(len(rows), 1, sharex=True, squeeze=False).flat)
        for panel, (values, label, chosen) in zip(panels, rows, strict=True):
            _lines_over_time(panel, answer, values, chosen)
            panel.set_ylabel(label)
        panels[-1].set_xlabel("time (s)")
        name_drives(figure, answer)
        note_motion(figure, answer)
    return figure


def note_motion(figure: Figure, answer: DriveLoads, *further: str) -> None:
    """Write below a figure where its machine is but for what moves, and along which motion it goes."""
    moving, names = setting_of(answer.machine, answer.motion.path.columns), ", ".join(answer.motion.loads)
    note_setting(figure, moving, answer.motion.kind + (f", with {names}" if names else ""), *further)


def _lines_over_time(panel: Axes, answer: DriveLoads, values: Array, chosen: list[bool]) -> None:
    panel.axhline(0.0, color="#b0b0b0", linewidth=0.8)
    for k, drive in enumerate(answer.drives):
        if chosen[k]:
            dashed = "--" if k >= len(COLOURS) else "-"
            panel.plot(
                answer.motion.times, values[k], dashed, color=COLOURS[k % len(COLOURS)], linewidth=1.1, label=drive.name
            )


def draw_torque_over_speed(panel: Axes, answer: DriveLoads, rotary: bool) -> None:
    """Draw the torque of each motor over its speed, its peak as a cross, and the roots of its mean squares as a point.

    In all directions at once there is no line through points; what they ask for most is drawn.

    Args:
        panel: the panel whose axes are labelled as well.
        answer: along a motion.
        rotary: whether motors that turn are drawn, in turns per minute, or those that are linear drives themselves.
    """
    curves, times = _curves(answer), answer.motion.times
    scale = answer.machine.display.scale(load_unit(rotary))
    factor = PER_MINUTE if rotary else 1.0
    width, opacity = (1.2, 1.0) if answer.motion.timeless else (0.7, 0.6)
    for k, drive in enumerate(answer.drives):
        if drive.rotary is not rotary:
            continue
        colour, torque = COLOURS[k % len(COLOURS)], np.abs(curves.motor_torque[k]) * scale.factor
        speed, peak = np.abs(curves.motor_speed[k]) * factor, int(np.argmax(torque))
        line = _most_at_speeds(speed, torque) if answer.motion.timeless else (speed, torque)
        panel.plot(*line, color=colour, linewidth=width, alpha=opacity)
        panel.plot(
            speed[peak], torque[peak], "x", color=colour, markersize=6, markeredgewidth=1.5, zorder=3, clip_on=False
        )
        if not answer.motion.timeless:
            rms_speed, rms_torque = float(root_mean_square(times, speed)), drive.rms_torque * scale.factor
            panel.plot(rms_speed, rms_torque, "o", color=colour, markersize=6, markeredgecolor="white", zorder=4)
        panel.plot([], [], color=colour, linewidth=3.0, label=drive.name)
    panel.set_xlabel("speed (1/min)" if rotary else "speed (m/s)")
    panel.set_ylabel(scale.label("torque" if rotary else "force"))
    panel.set_xlim(left=0.0)
    panel.set_ylim(bottom=0.0)


def _most_at_speeds(speed: Array, torque: Array) -> tuple[Array, Array]:
    """Return the greatest torque at each speed or above it, as a line from the axis of torques to that of speeds."""
    order = np.argsort(-speed)
    greatest = np.maximum.accumulate(torque[order])
    ahead = np.flatnonzero(np.diff(greatest, prepend=-1.0) > 0.0)
    speeds, torques = speed[order][ahead], greatest[ahead]
    return np.array([speeds[0], *speeds, 0.0]), np.array([0.0, *torques, torques[-1]])


def name_drives(figure: Figure, answer: DriveLoads, meaning: str = "") -> None:
    """Name the colours of the drives beside a figure, if they are few enough; its marks are explained in any case.

    Args:
        figure: whose panels have been drawn.
        answer: along a motion.
        meaning: of the marks, a line each; empty for a figure without marks.
    """
    pairs = [panel.get_legend_handles_labels() for panel in figure.axes]
    named = {name: handle for handles, names in pairs for handle, name in zip(handles, names, strict=True)}
    if len(answer.drives) > MOST_LEGEND:
        named = {}
    if named or meaning:
        figure.legend(
            named.values(), named.keys(), loc="outside right upper", frameon=False, fontsize="small",
            title=meaning, title_fontsize="small", alignment="left",
        )  # fmt: skip


def speed_torque_figure(answer: DriveLoads, title: str = "{}: what the motors must give") -> Figure:
    """Draw the torque of each motor over its speed, with its peak and its root mean square."""
    shown = [rotary for rotary in (True, False) if any(drive.rotary is rotary for drive in answer.drives)]
    with new_figure((6.6, 0.9 + 3.4 * len(shown)), title.format(answer.machine.name)) as figure:
        for panel, rotary in zip(figure.subplots(len(shown), 1, squeeze=False).flat, shown, strict=True):
            draw_torque_over_speed(panel, answer, rotary)
        name_drives(figure, answer, PEAK_MARK if answer.motion.timeless else f"{PEAK_MARK}\n{RMS_MARK}")
        note_motion(figure, answer)
    return figure


def parts_figure(answer: DriveLoads, name: str, title: str = "{}: parts of the force of {}") -> Figure:
    """Draw the parts of the force of the drive of that name, and the whole force, over time."""
    curves, display = _curves(answer), answer.machine.display
    k = [drive.name for drive in answer.drives].index(name)
    scale = display.scale(answer.drives[k].unit)
    with new_figure((6.6, 3.2), title.format(answer.machine.name, name)) as figure:
        panel = figure.add_subplot()
        times = answer.motion.times
        for i, part in enumerate(PARTS):
            if np.any(curves.parts[k, i]):
                panel.plot(times, curves.parts[k, i] * scale.factor, color=COLOURS[i], linewidth=1.1, label=part)
        panel.plot(times, curves.force[k] * scale.factor, color="black", linewidth=1.4, label="whole")
        panel.set_xlabel("time (s)")
        panel.set_ylabel(scale.label("force" if answer.drives[k].slides else "torque"))
        panel.legend(frameon=False, fontsize="small", ncols=3)
        note_motion(figure, answer)
    return figure
