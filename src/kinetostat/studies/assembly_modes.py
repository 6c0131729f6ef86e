"""Poses from actuator coordinates: the assembly modes that a machine has near its pose, and the status of each.

The equations are solved in `kinematics.forward`; the command is `forward`.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinematics.forward import AssemblyMode, System, assembly_modes, system_of, undriven
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.actuators import Actuator
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, with_values
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.spec.fields import Quantity
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.units import UnitError

MOST_STARTS = 10_000
"""Starts of a search: more take minutes, and the modes near a pose are known long before."""


@dataclass(frozen=True, eq=False)
class ForwardPose(ImmutableAnswer):
    """One assembly mode: a pose at which the actuators stand at the given coordinates.

    Attributes:
        pose: coordinates of the machine's [pose] by name, m and rad: `machine.with_values(pose.pose)` takes them.
        status: status of the machine there: OK, JOINT_LIMIT or SINGULAR.
        residual: the largest difference of an actuator from its coordinate, or gap of a leg, rad or in units of the
            machine's length.
        present: whether the machine comes to it from its own pose if its actuators move evenly, without passing a
            singularity.
        by_pose: whether the machine at this `pose` has its actuators there; if not, the pose belongs to another
            assembly mode of the legs than that of the home pose.
        position: position of P, base frame, m.
        rotation: rows of the rotation matrix of the platform, base frame.
    """

    pose: dict[str, float]
    status: Status
    residual: float
    present: bool
    by_pose: bool
    position: Array
    rotation: Array


@dataclass(frozen=True, eq=False)
class Forward(ImmutableAnswer):
    """The poses of a machine whose actuators stand at given coordinates.

    Attributes:
        machine: the machine at the pose at which the search began.
        actuators: its actuators with their coordinates.
        poses: a pose for each assembly mode, the present one first, then by distance from the pose of the machine.
        message: the number of poses, or the reason why there is none; one paragraph.
    """

    machine: Machine
    actuators: tuple[Actuator, ...]
    poses: tuple[ForwardPose, ...]
    message: str

    def __repr__(self) -> str:
        return f"<Forward kinematics of {self.machine.name!r}: {_count_of_modes(len(self.poses))}>"

    @property
    def present(self) -> ForwardPose | None:
        """The pose in the assembly mode that the machine is in; None where a singularity lies on the way."""
        return next((pose for pose in self.poses if pose.present), None)


@checked
def forward(
    machine: Machine, actuators: Mapping[str, float | str] | None = None, starts: int = 100, spread: float = 1.0
) -> Forward:
    """Compute the poses of a machine from the coordinates of its actuators: its assembly modes near its pose.

    The coordinate of an actuated slide between two passive joints is the length of its leg. Others count from the home
    pose where a machine is written leg by leg; in families a slide has a position along its axis from the base origin,
    or from the foot of a tower, and a crank an angle above the x-y plane. `analyze(machine).actuators` shows them at
    the pose.

    Args:
        machine: the machine at the pose at which the search begins.
        actuators: coordinates by name of the actuator, or of its leg: SI, or text with a unit. Those that are not given
            stay as they are at the pose.
        starts: number of starts of the search beside the pose itself; more of them find more modes.
        spread: their greatest distance from the pose, rad and in units of the machine's length.

    Raises:
        InputError: an unknown actuator, a value of another kind, a machine that its actuators do not determine, or an
            argument out of bounds.
    """
    _check_search(starts, spread)
    system = system_of(machine)
    driven = _placed_actuators(system, actuators or {}, machine)
    if undriven(system):
        raise InputError(
            f"{machine.name}: the actuators do not determine the pose: the platform can move while they stand still. "
            "The machine has fewer actuators than freedoms, or its pose is singular: begin at another pose."
        )
    goal = np.array([actuator.coordinate for actuator in driven], dtype=float)
    modes = assembly_modes(system, goal, starts, spread)
    poses = tuple(_judged_pose(machine, mode) for mode in modes)
    return Forward(machine, driven, poses, _message(modes, machine, len(goal)))


def _check_search(starts: int, spread: float) -> None:
    if not 0 <= starts <= MOST_STARTS:
        raise InputError(f"starts is {shorten(starts)}; give a whole number from 0 to {MOST_STARTS}.")
    if not 0.0 < spread <= math.pi:
        raise InputError(f"spread is {shorten(spread)}; give a number greater than 0 and at most pi.")


def _placed_actuators(system: System, coordinates: Mapping[str, float | str], machine: Machine) -> tuple[Actuator, ...]:
    """The actuators at the coordinates that are given, or where they stand."""
    if not system.actuators:
        raise InputError(f"{machine.name} has no actuator; forward kinematics needs one for each freedom.")
    numbers = actuator_numbers(system)
    commanded: dict[str, Actuator] = {}
    for name, value in coordinates.items():
        actuator = system.actuators[numbers[choice(name, numbers, "the name of an actuator")]]
        if actuator.name in commanded:
            raise InputError(f'the actuator "{actuator.name}" is given twice; leave one of its coordinates out.')
        try:
            coordinate = Quantity(actuator.kind, actuator.meaning).number(value)
        except UnitError as error:
            raise InputError(f'actuator "{name}" is {shorten(value)}: {error}.') from None
        commanded[actuator.name] = replace(actuator, coordinate=coordinate)
    driven = tuple(commanded.get(actuator.name, actuator) for actuator in system.actuators)
    unplaced = [actuator.name for actuator in driven if not math.isfinite(float(actuator.coordinate))]
    if unplaced:
        raise InputError(
            f"{machine.name} cannot be placed at its pose, so that {', '.join(unplaced)} has no coordinate there; give "
            "it, or change the pose."
        )
    return driven


def actuator_numbers(system: System) -> dict[str, int]:
    """Numbers of the actuators by all their names: those of legs that have one actuator, then the actuators' own."""
    legs = [actuator.leg for actuator in system.actuators]
    alone = {leg: number for number, leg in enumerate(legs) if legs.count(leg) == 1}
    return {**alone, **{actuator.name: number for number, actuator in enumerate(system.actuators)}}


def _judged_pose(machine: Machine, mode: AssemblyMode) -> ForwardPose:
    """An assembly mode with the status that the machine has there."""
    machine_there = with_values(machine, {f"{POSE}{name}": value for name, value in mode.pose.items()})
    status = Status(int(respond(machine_there, mode.joints).status))
    turn = mode.placement.rotation
    return ForwardPose(
        pose=mode.pose,
        status=status,
        residual=mode.residual,
        present=mode.present,
        by_pose=mode.by_pose,
        position=np.array(mode.placement.translation.components(), dtype=float),
        rotation=np.array([axis.components() for axis in (turn.x, turn.y, turn.z)], dtype=float).T,
    )


def _count_of_modes(count: int) -> str:
    return f"{count} assembly mode{'' if count == 1 else 's'}"


def _message(modes: list[AssemblyMode], machine: Machine, actuators: int) -> str:
    if not modes:
        redundant = actuators > len(vars(machine.tables["pose"]))
        more = " It has more actuators than coordinates, and these must agree." if redundant else ""
        return (
            f"No pose near that of {machine.name} has these actuator coordinates; give others, begin nearer, or search "
            f"further away (spread).{more}"
        )
    verb = "is" if len(modes) == 1 else "are"
    first_sentence = f"Near the pose there {verb} {_count_of_modes(len(modes))} with these actuator coordinates."
    if not any(mode.present for mode in modes):
        return (
            f"{first_sentence} Moved evenly, the actuators do not lead to any of them: the present mode ends on the "
            "way, at a singularity or where a leg no longer reaches."
        )
    return first_sentence if len(modes) == 1 else f"{first_sentence} The first is the one that the machine is in."
