"""Where the actuators of a loaded machine must stand so that its tool is where the pose says, at one pose or at many.

The equations are in `equilibrium.commanding`; the command is `command`.
"""

import csv
import io
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetostat.equilibrium.commanding import commanded
from kinetostat.equilibrium.motion import Array
from kinetostat.equilibrium.numbers import loaded_mechanism
from kinetostat.equilibrium.tangent import stability
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinematics.forward import leg_names
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.actuators import Actuator, actuators_of, joint_actuators, senses_of
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import Immutable
from kinetostat.studies.evaluation.columns import PoseColumns
from kinetostat.studies.evaluation.given_poses import given_poses
from kinetostat.studies.plain_data import as_answer
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY


@dataclass(frozen=True, eq=False)
class Command(Immutable):
    """Coordinates of the actuators that put the loaded tool where an unloaded machine would have it.

    Attributes:
        machine: with its loads.
        poses: at which they hold; None for the pose of the machine alone.
        actuators: their names.
        units: of each coordinate, "m" or "rad".
        coordinates: what to command [poses x actuators], SI; NaN where there is no state of rest.
        unloaded: where the actuators stand without loads [poses x actuators], SI.
        before: how far the tool point is off without a correction [poses], m.
        left: how far it is off with it, m: what no actuator of the machine can change [poses].
        turned: how far the platform stays turned, rad [poses].
        settled: whether the machine comes to rest [poses].
        message: what is the case, in a sentence.
    """

    machine: Machine
    poses: PoseColumns | None
    actuators: tuple[str, ...]
    units: tuple[str, ...]
    coordinates: Array
    unloaded: Array
    before: Array
    left: Array
    turned: Array
    settled: npt.NDArray[np.bool_]
    message: str

    def __repr__(self) -> str:
        return f"<Command of {self.machine.name!r}: {len(self.coordinates)} poses>"


@checked
def command(machine: Machine, poses: Any = None) -> Command:
    """Find where the actuators of a loaded machine must stand so that its tool is where it should be.

    A machine bends under its loads, so that actuators that stand where an ideal machine would have them leave the tool
    beside its pose. These coordinates bring it back. A machine with fewer than six freedoms is brought as near as its
    actuators can.

    Args:
        machine: with its loads; its pose is the one that is wanted, if no poses are given.
        poses: that are wanted: a DataFrame, a dictionary of columns, an array, a dataset or the path of a CSV file, as
            for `evaluate`.

    Raises:
        InputError: there is gravity but no mass, no actuator, tensions are to be chosen, or the poses cannot be read.
    """
    if not all(math.isinf(bound) for bound in (machine.tables["load"].min_tension, machine.tables["load"].max_tension)):
        raise InputError(
            f"{machine.name}: commands are coordinates of actuators, but load.min_tension and load.max_tension choose "
            "forces, which winches are driven by instead; leave the bounds out, or read the tensions from "
            "`analyze --loaded`."
        )
    columns = None if poses is None else given_poses(machine, poses)
    count = 1 if columns is None else columns.count
    rows = [_at(machine if columns is None else _posed(machine, columns, i)) for i in range(count)]
    driven = next((names for names, _ in rows if names), None)
    if driven is None:
        raise InputError(
            f"{machine.name} reaches none of these poses, or has no actuator that could be commanded; change the pose."
        )
    table = np.array([values if values is not None else [np.nan] * (2 * len(driven) + 3) for _, values in rows])
    size = len(driven)
    settled = np.isfinite(table).all(axis=1)
    before, left, turned = table[:, 2 * size :].T
    return Command(
        machine,
        columns,
        tuple(actuator.name for actuator in driven),
        tuple(actuator.unit for actuator in driven),
        table[:, :size],
        table[:, size : 2 * size],
        before,
        left,
        turned,
        settled,
        _message(machine, settled, before, left),
    )


def _posed(machine: Machine, poses: PoseColumns, number: int) -> Machine:
    return with_values(machine, {path: float(column[number]) for path, column in poses.leaves.items()})


def _at(machine: Machine) -> tuple[list[Actuator], list[float] | None]:
    """The actuators of a machine, and at its pose: commands, places without loads, errors before and after, tilt."""
    joints = solve_joints(machine) if machine.family.chains else None
    response = respond(machine, joints)
    if int(response.status) in (Status.OUT_OF_REACH, Status.NOT_CONVERGED):
        return [], None
    if joints is None:
        actuators = actuators_of(response.configuration)
        senses = senses_of(response.configuration)
    else:
        placed = joint_actuators(machine.chains(), leg_names(machine))
        actuators, senses = [each.at(joints.coordinates) for each in placed], [each.sign for each in placed]
    mechanism, _ = loaded_mechanism(machine, response, joints)
    by_name = {actuator.name: (actuator, sense) for actuator, sense in zip(actuators, senses, strict=True)}
    driven = [by_name[name] for name in mechanism.actuators]
    if not driven:
        return [], None
    answer = commanded(mechanism)
    actuators = [actuator for actuator, _ in driven]
    if not (answer.solution.settled[0] and stability(answer.solution.balance).stable):
        return actuators, None
    length, state = float(mechanism.length[0]), answer.solution.balance.state
    amounts = [
        sense * float(amount) * (length if actuator.slides else 1.0)
        for (actuator, sense), amount in zip(driven, state.amounts[0], strict=True)
    ]
    stands = [float(actuator.coordinate) for actuator, _ in driven]
    before, left = (float(np.linalg.norm(twist[0, 3:])) * length for twist in (answer.before, answer.off))
    errors = [before, left if left > ROUND_OFF_OF_ENTRY * length else 0.0]
    turned = float(np.linalg.norm(answer.off[0, :3]))
    commands = [stand + amount for stand, amount in zip(stands, amounts, strict=True)]
    return actuators, [*commands, *stands, *errors, turned]


def _message(machine: Machine, settled: npt.NDArray[np.bool_], before: Array, left: Array) -> str:
    known, show = int(settled.sum()), machine.display.show_deflection
    if not known:
        return "The machine comes to rest at none of these poses; reduce the load, or preload what only pulls."
    without = "" if settled.all() else f" {len(settled) - known} of {len(settled)} poses have no state of rest."
    return (
        f"Commanded so, the tool point is off by at most {show(float(np.nanmax(left)), 'm')}; without a correction by "
        f"{show(float(np.nanmax(before)), 'm')}.{without}"
    )


def as_csv(answer: Command) -> str:
    """Write the commands as CSV in SI: a row with the number of each pose (from 1), its fields, and its commands."""
    columns: dict[str, Any] = {"pose": range(1, len(answer.coordinates) + 1)}
    if answer.poses is not None:
        for field, values in zip(answer.poses.fields, answer.poses.values, strict=True):
            columns[f"{field.shown} [{field.unit}]"] = values.tolist()
    for k, (name, unit) in enumerate(zip(answer.actuators, answer.units, strict=True)):
        columns[f"{name} [{unit}]"] = [
            value if known else ""
            for value, known in zip(answer.coordinates[:, k].tolist(), answer.settled, strict=True)
        ]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()


def as_json(answer: Command) -> dict[str, Any]:
    """Return the commands as plain data, SI; null at poses without a state of rest."""
    return as_answer(
        {
            "name": answer.machine.name,
            "message": answer.message,
            "actuators": answer.actuators,
            "units": answer.units,
            "coordinates": answer.coordinates,
            "unloaded": answer.unloaded,
            "error_before": answer.before,
            "error_left": answer.left,
            "rotation_left": answer.turned,
        }
    )
