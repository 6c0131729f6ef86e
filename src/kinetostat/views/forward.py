"""Poses from actuator coordinates: the question, and the description of its answer. Nothing is computed here."""

from collections.abc import Iterator, Mapping, Sequence

from kinetostat.display import Display
from kinetostat.machine.actuators import Actuator
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import find
from kinetostat.spec.errors import InputError, shorten
from kinetostat.studies.assembly_modes import Forward, ForwardPose, forward
from kinetostat.views.question import MESSAGE, NAME, Description, Field, Lines, Option, Question, Records
from kinetostat.views.tables import FittedTable, numeric_table

COORDINATE_DIGITS = 7
"""Significant digits of a coordinate: enough for a micrometre of a metre, as controllers take them."""
OTHER_LEG_MODE = "* [pose] with these coordinates gives another assembly mode of the legs, that of the home pose."
"""Sentence below a table in which a mode is marked with an asterisk."""


def actuator_coordinates(actuators: Sequence[Actuator], display: Display) -> FittedTable:
    """Tabulate the coordinates of actuators, and what they count from."""
    table = numeric_table("Actuators", "actuator", ["coordinate", "counts"])
    for actuator in actuators:
        value = coordinate_text(float(actuator.coordinate), actuator.unit, display)
        table.add_row(actuator.name, f"{value} {display.scale(actuator.unit).unit}", actuator.meaning)
    return table


def coordinate_text(value: float, unit: str, display: Display) -> str:
    """Return a coordinate in the unit that people read, in as many digits as a machine's controller takes."""
    scale = display.scale(unit)
    return f"{round(value * scale.factor, 9) + 0.0:.{COORDINATE_DIGITS}g}"


def mode_table(machine: Machine, poses: Sequence[ForwardPose]) -> FittedTable:
    """Return the assembly modes, a row each, with the coordinates of the pose."""
    display = machine.display
    units = {name: find(machine.family, f"pose.{name}").unit for name in poses[0].pose}
    heads = [display.scale(unit).label(name) for name, unit in units.items()]
    table = numeric_table("Assembly modes", "mode", [*heads, "status", "residual"])
    for number, pose in enumerate(poses, 1):
        values = [coordinate_text(pose.pose[name], unit, display) for name, unit in units.items()]
        mark = f"{number} (present)" if pose.present else f"{number}{'' if pose.by_pose else ' *'}"
        table.add_row(mark, *values, pose.status.phrase, f"{pose.residual:.0e}")
    return table


def _lines(answer: Forward) -> Lines:
    yield "Modes", answer.message
    if not all(pose.by_pose for pose in answer.poses):
        yield "Legs", OTHER_LEG_MODE


def _tables(answer: Forward, _full: bool) -> Iterator[FittedTable]:
    if answer.poses:
        yield mode_table(answer.machine, answer.poses)
    yield actuator_coordinates(answer.actuators, answer.machine.display)


def coordinates_by_name(texts: Sequence[str]) -> Mapping[str, str]:
    """Read coordinates of actuators such as "leg 1=31 cm, leg 2=17 cm", by the name of the actuator or of its leg.

    Raises:
        InputError: an entry is not of that form, or a name is given twice.
    """
    coordinates: dict[str, str] = {}
    for entry in (entry for text in texts for entry in text.split(",")):
        name, equals, value = (part.strip() for part in entry.partition("="))
        if not equals or not name:
            raise InputError(f'--actuators {shorten(entry)} must be name=value, e.g. --actuators "leg 1=31 cm".')
        if name in coordinates:
            raise InputError(f'--actuators gives "{name}" twice; leave one of its coordinates out.')
        coordinates[name] = value
    return coordinates


def poses_by_texts(machine: Machine, starts: int, spread: float, actuators: Sequence[str] = ()) -> Forward:
    """Compute the poses of actuator coordinates that are given as texts; see `coordinates_by_name`."""
    return forward(machine, coordinates_by_name(actuators), starts, spread)


FORWARD = Description(
    title="Poses of the actuator coordinates",
    fields=(
        NAME,
        Field("family", "machine.family.name"),
        MESSAGE,
        Field("actuators", forms=("json",)),
        Records(
            "poses",
            "mode",
            (
                Field("pose", axes=("coordinate",), column="*", long_name="coordinates of the pose, m and rad"),
                Field("status", "status.word", long_name="status of the machine at the pose"),
                Field("residual", long_name="largest difference that is left, rad or in units of the machine's length"),
                Field("present", long_name="whether the machine comes to the pose as its actuators move evenly"),
                Field(
                    "by_pose",
                    long_name="whether the machine at the pose has its actuators at the coordinates that were given",
                ),
                Field("position", forms=("json",)),
                Field("rotation", forms=("json",)),
            ),
        ),
    ),
    lines=_lines,
    tables=_tables,
    state=lambda answer: "assembly modes" if answer.poses else "no assembly mode",
    answered=lambda answer: bool(answer.poses),
)
FORWARD_QUESTION = Question(
    example='kinetostat forward hexapod --actuators "leg 1=96 mm, leg 2=95 mm"',
    answer=poses_by_texts,
    options=(
        Option(
            "actuators",
            "text",
            "coordinates by actuator or leg; those not given stay as at the pose; repeatable",
            metavar="NAME=VALUE,...",
            many=True,
        ),
        Option("starts", "count", "starts of the search (default: 100)", default=100),
        Option(
            "spread",
            "number",
            "how far from the pose they lie, rad and in units of the machine's length (default: 1)",
            default=1.0,
        ),
    ),
    slow="searching",
)
