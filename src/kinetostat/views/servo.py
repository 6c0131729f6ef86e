"""Stiffness and damping of the tool with servo loops closed: the question, the description of its answer, a picture."""

import math
from collections.abc import Iterator
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Complex
from kinetostat.display import DASH, number
from kinetostat.late import LateModule
from kinetostat.machine.machine import pose_of, setting_of
from kinetostat.studies.control import Servo, servo
from kinetostat.vibration.receptance import ASSUMED_RATIO, along, receptance
from kinetostat.vibration.servo import ServoLoop
from kinetostat.views.data_forms import finite_or_none
from kinetostat.views.question import FIRST_FIELDS, Axis, Description, Drawing, Field, Lines, Option, Question, Records
from kinetostat.views.tables import FittedTable, numeric_table
from kinetostat.views.vibration import RESPONSE, drawn_directions, stiffness_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from kinetostat.views import figures
else:
    figures = LateModule("kinetostat.views.figures")

RIGID = "rigid"
"""Word for a stiffness without end."""
SAME_SHARE = 1e-9
"""Relative difference up to which two stiffnesses are the same: beyond round-off, and below any digit shown."""


class DriveWithLoop(NamedTuple):
    """A drive by its name, the unit of its stiffnesses, and its servo loop."""

    name: str
    unit: str
    loop: ServoLoop

    @property
    def share_at_rest(self) -> float:
        """Stiffness of the drive at 0 Hz over that of its transmission."""
        return self.loop.static_stiffness / self.loop.transmission


def _lines(answer: Servo) -> Lines:
    if answer.loops is None:
        yield "Pose", f"{pose_of(answer.machine)}. {answer.message}"
        return
    yield "Pose", f"{pose_of(answer.machine)}."
    yield "Servo", answer.message
    softest = min(_drives(answer), key=attrgetter("share_at_rest"))
    stiffnesses = softest.loop.static_stiffness, softest.loop.transmission
    static, transmission = (_stiffness(answer, stiffness, softest.unit) for stiffness in stiffnesses)
    verb = "is" if static == RIGID else "holds"
    if len(set(answer.loops.loops)) == 1:
        yield "Drive", f"Each drive {verb} {static} at 0 Hz; its transmission has {transmission}."
    elif softest.share_at_rest > 1.0 - SAME_SHARE:
        yield "Drives", "At 0 Hz each drive holds what its transmission does, or more."
    else:
        loss = f"{softest.name} loses most by its loop: it {verb} {static} at 0 Hz"
        yield "Drives", f"{loss}; its transmission has {transmission}."
    if answer.assumed:
        ratio = number(100.0 * ASSUMED_RATIO)
        yield "Damping", f"The machine's own damping is assumed: {ratio} % in every mode; give a table [damping]."


def _tables(answer: Servo, _full: bool) -> Iterator[FittedTable]:
    if answer.loops is None:
        return
    columns = ["motors still", "loops closed, 0 Hz", "least over frequency", "at Hz"]
    table = numeric_table("Free stiffness of the tool", "", columns)
    rows = zip(answer.components, answer.motors_still, answer.static, answer.least, strict=True)
    for name, motors_still, static, (least, frequency) in rows:
        unit = stiffness_unit(name in COMPONENTS[:3])
        stiffnesses = (_stiffness(answer, value, unit) for value in (motors_still, static, least))
        table.add_row(name, *stiffnesses, DASH if math.isinf(least) else number(frequency, digits=3))
    yield table
    yield _table_of_drives(answer)


def _stiffness(answer: Servo, value: float, unit: str) -> str:
    """Return a stiffness with its unit, or "rigid"."""
    return RIGID if math.isinf(value) else answer.machine.display.show(value, unit)


def _table_of_drives(answer: Servo) -> FittedTable:
    table = numeric_table("Drives", "", ["transmission", "Kv", "Tn", "at the load", "loop closed, 0 Hz"])
    for name, unit, loop in _drives(answer):
        transmission, static = (_stiffness(answer, k, unit) for k in (loop.transmission, loop.static_stiffness))
        integral = f"{number(1e3 * loop.integral_time)} ms" if loop.integral_time else DASH
        gain, share = f"{number(loop.position_gain)} 1/s", f"{number(100.0 * loop.at_load)} %"
        table.add_row(name, transmission, gain, integral, share, static)
    return table


def _drives(answer: Servo) -> list[DriveWithLoop]:
    """Return the drives with their loops; none without an answer."""
    if answer.loops is None:
        return []
    return [
        DriveWithLoop(str(drive.name), stiffness_unit(drive.turning), loop)
        for drive, loop in zip(answer.loops.modes.drives, answer.loops.loops, strict=True)
    ]


def _records_of_drives(answer: Servo) -> list[dict[str, Any]]:
    """Return the numbers of each drive for files, by the names of its loop's attributes."""
    return [
        {"name": name, "unit": unit}
        | {key: finite_or_none(value) for key, value in vars(loop).items()}
        | {"static": finite_or_none(loop.static_stiffness)}
        for name, unit, loop in _drives(answer)
    ]


def _stiffnesses(answer: Servo) -> list[dict[str, Any]]:
    # Without loops there are names but no numbers.
    rows = zip(answer.components, answer.motors_still, answer.static, answer.least, strict=answer.loops is not None)
    return [
        {
            "component": name,
            "motors_still": finite_or_none(motors_still),
            "static": finite_or_none(static),
            "least": finite_or_none(least),
            "least_at": None if math.isinf(least) else frequency,
        }
        for name, motors_still, static, (least, frequency) in rows
    ]


def _response(answer: Servo) -> Complex:
    parts = [COMPONENTS.index(name) for name in answer.components]
    return answer.receptance(answer.frequencies.tolist())[:, parts][:, :, parts]


def servo_figures(answer: Servo) -> dict[str, Drawing]:
    """Return the drawing of the response; none without an answer, or where a motion grows."""
    if answer.loops is None or not answer.stable:
        return {}
    caption = "Dynamic stiffness of the tool point with servo loops closed, and with motors that stand still."
    return {"servo": Drawing(caption, partial(servo_figure, answer))}


def servo_figure(answer: Servo, title: str = "{}: stiffness with servo loops closed") -> "Figure":
    """Draw the dynamic stiffness along directions over frequency, with loops closed and with motors that stand still.

    Raises:
        ValueError: the answer has no loops.
    """
    if answer.loops is None:
        raise ValueError("there is nothing to draw")
    scale = answer.machine.display.scale("N/m")
    stiffnesses = zip(answer.components, answer.motors_still, strict=True)
    compliant = [name for name, stiffness in stiffnesses if not math.isinf(stiffness)]
    directions = drawn_directions(answer.direction, compliant)
    closed = answer.receptance(answer.frequencies.tolist())
    motors_still = receptance(answer.loops.modes, answer.loops.damping, answer.frequencies)
    with figures.new_figure(
        (5.6, 3.8), title.format(answer.machine.name), setting_of(answer.machine), "thin: motors that stand still"
    ) as figure:
        panel = figure.add_subplot()
        for colour, dashes, (name, axis) in zip(figures.COLOURS, figures.DASHES, directions.items(), strict=False):
            thick, thin = (1.0 / np.abs(along(part, np.array(axis))) * scale.factor for part in (closed, motors_still))
            panel.loglog(answer.frequencies, thick, color=colour, linestyle=dashes, label=f"along {name}")
            panel.loglog(answer.frequencies, thin, color=colour, linewidth=0.7, alpha=0.6)
        panel.margins(x=0.0)
        panel.set_xlabel("frequency (Hz)")
        panel.set_ylabel(scale.label("dynamic stiffness"))
        panel.legend(loc="best")
    return figure


STIFFNESS = tuple(
    Field(key, unit=unit, long_name=meaning)
    for key, unit, meaning in (
        ("component", "", "component of the motion of the tool: rx ry rz x y z"),
        ("motors_still", "", "free stiffness with motors that stand still, N/m or N·m/rad"),
        ("static", "", "free stiffness at 0 Hz with loops closed, N/m or N·m/rad; none where rigid"),
        ("least", "", "least dynamic stiffness, N/m or N·m/rad; none where rigid"),
        ("least_at", "Hz", "frequency of the least dynamic stiffness"),
    )
)
DRIVE = tuple(
    Field(key, unit=unit, long_name=meaning, column=f"drive_{key}")
    for key, unit, meaning in (
        ("name", "", "name of the drive"),
        ("unit", "", "unit of the stiffnesses of the drive"),
        ("transmission", "", "stiffness between motor and joint, N/m or N·m/rad"),
        ("static", "", "stiffness at 0 Hz with the loop closed, N/m or N·m/rad; none where rigid"),
        ("inertia", "", "inertia of the rotor at the joint, kg or kg·m²"),
        ("friction", "", "viscous friction of the rotor at the joint, N·s/m or N·m·s/rad"),
        ("velocity_gain", "", "gain of the velocity loop at the joint, N·s/m or N·m·s/rad"),
        ("position_gain", "1/s", "gain of the position loop"),
        ("integral_time", "s", "integral time of the velocity loop; 0 without an integral part"),
        ("at_load", "1", "share of the position that is measured behind the transmission"),
    )
)
SERVO = Description(
    title="Servo loops",
    fields=(
        *FIRST_FIELDS,
        Field("stable"),
        Field("slowest_frequency", lambda answer: answer.least_damped and answer.least_damped[0], "Hz"),
        Field("slowest_ratio", lambda answer: answer.least_damped and answer.least_damped[1]),
        Field("damping_assumed", "assumed"),
        Records("stiffness", "row", STIFFNESS, _stiffnesses),
        Records("drives", "drive", DRIVE, _records_of_drives, forms=("json", "nc")),
        Field("poles_real", lambda answer: [pole.real for pole in answer.poles], "rad/s", forms=("json",)),
        Field("poles_imaginary", lambda answer: [pole.imag for pole in answer.poles], "rad/s", forms=("json",)),
        Field("receptance_real", lambda answer: _response(answer).real, axes=RESPONSE, forms=("nc",)),
        Field("receptance_imaginary", lambda answer: _response(answer).imag, axes=RESPONSE, forms=("nc",)),
    ),
    lines=_lines,
    tables=_tables,
    figures=servo_figures,
    axes=(Axis("frequency", "frequencies", "Hz"), Axis("moved", "components"), Axis("loaded", "components")),
    answered=lambda answer: answer.loops is not None,
    files={"servo.json": "json", "servo.csv": "csv", "servo.nc": "nc"},
)
SERVO_QUESTION = Question(
    example='kinetostat servo hexapod --set tool.mass="12 kg" --set servo.position_gain="50 1/s" -o servo',
    answer=servo,
    options=(Option("along", "direction", "direction in which the tool is pushed for the response", default=()),),
    loaded="the loops about the state of rest under the loads, with tensions and weights",
    output="servo.json, servo.csv, servo.nc and the figure",
)
