"""Actuator coordinates and assembly modes as tables on a terminal. Nothing is computed here."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from kinetostat.display import Display
from kinetostat.machine.actuators import Actuator
from kinetostat.machine.parameters import find
from kinetostat.studies.assembly import Forward
from kinetostat.views.tables import numeric_table

DIGITS = 7
"""Digits of coordinates: a micrometre of a metre, as a machine's controller takes them."""


def print_forward(console: Console, answer: Forward) -> None:
    """Print the assembly modes, a row each, and the coordinates of the actuators."""
    display, machine = answer.machine.display, answer.machine
    console.print(answer.message, highlight=False)
    if answer.poses:
        units = {name: find(machine.family, f"pose.{name}").unit for name in answer.poses[0].pose}
        heads = [display.scale(unit).label(name) for name, unit in units.items()]
        table = numeric_table("Assembly modes", "mode", [*heads, "status", "residual"])
        for i, pose in enumerate(answer.poses, 1):
            values = [precise(pose.pose[name], unit, display) for name, unit in units.items()]
            mark = f"{i} (present)" if pose.present else f"{i}{'' if pose.by_pose else ' *'}"
            table.add_row(mark, *values, pose.status.word.replace("_", " "), f"{pose.residual:.0e}")
        console.print(table)
    if not all(pose.by_pose for pose in answer.poses):
        text = "* [pose] with these coordinates gives another assembly mode of the legs, that of the home pose."
        console.print(text, highlight=False)
    console.print(actuator_coordinates(answer.actuators, display))


def actuator_coordinates(actuators: Sequence[Actuator], display: Display) -> Table:
    """Tabulate where actuators stand."""
    table = numeric_table("Actuators", "actuator", ["coordinate", "counts"])
    for actuator in actuators:
        value = precise(float(actuator.coordinate), actuator.unit, display)
        table.add_row(actuator.name, f"{value} {display.scale(actuator.unit).unit}", actuator.meaning)
    return table


def precise(value: float, unit: str, display: Display) -> str:
    """Return a coordinate in the unit that people read, in as many digits as a machine's controller takes."""
    scale = display.scale(unit)
    return f"{round(value * scale.factor, 9) + 0.0:.{DIGITS}g}"
