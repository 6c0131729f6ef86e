"""Coordinates of the actuators that bring the tool of a loaded machine to its pose, at one pose or at many.

`actuator_targets` solves many poses in slabs, each as one array; `command` asks it, and adds names, units and a
sentence for people. The equations are in `equilibrium.actuation`.
"""

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.engine.batch import Progress, first_limit_passed, silent
from kinetostat.engine.loaded import Way
from kinetostat.equilibrium.actuation import commanded_state
from kinetostat.equilibrium.solving import stabilities
from kinetostat.equilibrium.state import WITHOUT_SEARCH_FOR_REST, MachineState, state_of, states_at
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints, pose_coordinates
from kinetostat.kinematics.forward import leg_names
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.actuators import Actuator, actuators_of, joint_actuators, senses_of
from kinetostat.machine.column import stacked_columns
from kinetostat.machine.limits import limits_set
from kinetostat.machine.loading import changed
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, values, with_values
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names
from kinetostat.studies.analysis import analyze
from kinetostat.studies.identification.record import FitRecord, read_fit
from kinetostat.studies.poses import PoseColumns, given_poses
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY

POSES_IN_SLAB = Way.ANY_MACHINE.slab
"""Number of poses that are solved together: as many as of any other states of rest."""


@dataclass(frozen=True, eq=False)
class CommandedPoses:
    """Coordinates at which actuators of a loaded machine must stand at n poses; NaN where there is no state of rest.

    Attributes:
        coordinates: coordinates that bring the tool to its pose, or as near as they can, m or rad [n x actuators].
        unloaded: coordinates of the actuators at the pose without loads, m or rad [n x actuators].
        distance_uncorrected: distance of the tool point from its pose without a correction, m [n].
        distance_corrected: distance of the tool point from its pose with the correction, m [n]; no actuator can lessen
            it.
        rotation_corrected: angle of the platform from its pose with the correction, rad [n].
        status: `Status` codes [n]: OK with coordinates, otherwise why there are none.
    """

    coordinates: Array
    unloaded: Array
    distance_uncorrected: Array
    distance_corrected: Array
    rotation_corrected: Array
    status: Integers

    @property
    def settled(self) -> Mask:
        """Whether the machine comes to rest at each pose [n]."""
        return self.status == Status.OK

    @property
    def corrections(self) -> Array:
        """Differences of the coordinates from those without loads, m or rad [n x actuators]."""
        return self.coordinates - self.unloaded


ARRAYS_OF_POSES = [field.name for field in fields(CommandedPoses)]
"""Names of the arrays of `CommandedPoses`, whose first axis are the poses."""


@dataclass(frozen=True, eq=False)
class ActuatorTargets(CommandedPoses):
    """The commanded poses with the motion of the tool by each actuator.

    Attributes:
        actuators: the actuators that can be commanded.
        rates: motion of the tool point per unit of each coordinate [n x 3 x actuators].
    """

    actuators: tuple[Actuator, ...]
    rates: Array

    def split(self, count: int) -> tuple["ActuatorTargets", "ActuatorTargets"]:
        """The answer at the first `count` poses, and that at the others."""
        parts = slice(count), slice(count, None)
        first, others = (replace(self, **{n: getattr(self, n)[part] for n in TARGET_ARRAYS}) for part in parts)
        return first, others


TARGET_ARRAYS = [*ARRAYS_OF_POSES, "rates"]
"""Names of the arrays of `ActuatorTargets`, whose first axis are the poses."""


def actuator_targets(
    machine: Machine, columns: Mapping[str, Array], count: int, progress: Progress = silent
) -> ActuatorTargets:
    """Find the coordinates of the actuators with which the loaded tool is where it should be.

    Args:
        machine: gives all parameters that do not vary.
        columns: values of the parameters that vary, by leaf path, SI [n].
        count: number of poses, n.
        progress: receives the number of poses that are solved, and that of all.

    Raises:
        InputError: as for `MachineState.mechanism`; or the machine has no place at any pose, or no actuator.
    """
    slabs = []
    for start in range(0, count, POSES_IN_SLAB):
        rows = slice(start, min(start + POSES_IN_SLAB, count))
        with np.errstate(all="ignore"):  # poses without a place
            slabs.append(
                _targets_of_slab(machine, {path: column[rows] for path, column in columns.items()}, rows.stop - start)
            )
        progress(rows.stop, count)
    actuators = next((slab.actuators for slab in slabs if slab.actuators), None)
    if actuators is None:
        status = np.concatenate([slab.status for slab in slabs])
        if np.isin(status, WITHOUT_SEARCH_FOR_REST).all():
            raise InputError(f"{machine.name}: {without_command(machine, columns, status)}")
        raise InputError(f"{machine.name} has no actuator that can be commanded; mark one with actuated = true.")
    return _concatenation([slab if slab.actuators else _empty_targets(actuators, slab.status) for slab in slabs])


def _concatenation(slabs: list[ActuatorTargets]) -> ActuatorTargets:
    arrays = {name: np.concatenate([getattr(slab, name) for slab in slabs]) for name in TARGET_ARRAYS}
    return ActuatorTargets(actuators=slabs[0].actuators, **arrays)


def _empty_targets(actuators: tuple[Actuator, ...], status: Integers) -> ActuatorTargets:
    """The answer where no pose has a command."""
    count, size = len(status), len(actuators)
    return ActuatorTargets(
        actuators=actuators,
        coordinates=np.full((count, size), np.nan),
        unloaded=np.full((count, size), np.nan),
        distance_uncorrected=np.full(count, np.nan),
        distance_corrected=np.full(count, np.nan),
        rotation_corrected=np.full(count, np.nan),
        rates=np.full((count, 3, size), np.nan),
        status=status,
    )


def _targets_of_slab(machine: Machine, columns: Mapping[str, Array], count: int) -> ActuatorTargets:
    """Solve one slab of poses; without actuators where the machine can have no state of rest at any of them."""
    state = states_at(machine, columns, count)
    status = np.broadcast_to(state.free.status, (count,)).astype(np.int64)
    searched = np.flatnonzero(~np.isin(status, WITHOUT_SEARCH_FOR_REST))
    if not len(searched):
        return _empty_targets((), status)
    targets = _targets_at(state.at(searched), machine, {path: column[searched] for path, column in columns.items()})
    if len(searched) == count:
        return targets
    all_targets = _empty_targets(targets.actuators, status)
    for name in TARGET_ARRAYS:
        getattr(all_targets, name)[searched] = getattr(targets, name)
    return all_targets


def _targets_at(state: MachineState, machine: Machine, columns: Mapping[str, Array]) -> ActuatorTargets:
    """Solve poses at all of which the machine has a place; NaN where the state of rest is not stable."""
    mechanism, count = state.mechanism, state.count
    all_actuators = _all_actuators(machine, columns, state.free, state.joints, count)
    # Those that can be driven, in the order of the mechanism.
    names = [actuator.name for actuator in all_actuators.actuators]
    places = [names.index(name) for name in mechanism.actuators]
    actuators = [all_actuators.actuators[place] for place in places]
    unloaded, senses = all_actuators.coordinates[:, places], all_actuators.senses[:, places]
    status_without_rest = np.where(state.free.status == Status.SINGULAR, Status.SINGULAR, Status.NO_REST)
    if not actuators:
        return _empty_targets((), np.broadcast_to(status_without_rest, (count,)).astype(np.int64))
    length = mechanism.length
    # The mechanism has amounts of forward motion, in lengths of its own where an actuator slides.
    units = senses * np.where([actuator.slides for actuator in actuators], length[:, None], 1.0)
    commanded = commanded_state(mechanism)
    equations = commanded.solution.balance
    stable = commanded.solution.settled & stabilities(equations).stable
    distance = np.linalg.norm(commanded.error[:, 3:], axis=1) * length

    def where_stable(array: Array) -> Array:
        return np.where(stable.reshape(-1, *[1] * (array.ndim - 1)), array, np.nan)

    return ActuatorTargets(
        actuators=tuple(actuators),
        coordinates=where_stable(unloaded + equations.state.amounts * units),
        unloaded=where_stable(unloaded),
        distance_uncorrected=where_stable(np.linalg.norm(commanded.first_error[:, 3:], axis=1) * length),
        distance_corrected=where_stable(np.where(distance > ROUND_OFF_OF_ENTRY * length, distance, 0.0)),
        rotation_corrected=where_stable(np.linalg.norm(commanded.error[:, :3], axis=1)),
        rates=where_stable(commanded.rates[:, 3:] * (length[:, None] / units)[:, None]),
        status=np.where(stable, Status.OK, status_without_rest).astype(np.int64),
    )


class _AllActuators(NamedTuple):
    """All actuators of a machine at n poses.

    Attributes:
        actuators: the actuators.
        coordinates: their coordinates, m or rad [n x actuators].
        senses: 1 where a coordinate grows as its joint moves forward, else -1 [n x actuators].
    """

    actuators: list[Actuator]
    coordinates: Array
    senses: Array


def _all_actuators(
    machine: Machine, columns: Mapping[str, Array], response: Response, joints: Joints | None, count: int
) -> _AllActuators:
    """The actuators of a family in closed form, or of legs whose joints have been found."""
    if joints is None:
        actuators = actuators_of(response.configuration)
        coordinates = stacked_columns([actuator.coordinate for actuator in actuators], count)
        return _AllActuators(actuators, coordinates, stacked_columns(senses_of(response.configuration), count))
    at_homes = [joint_actuators(home.chains(), leg_names(machine)) for home in _homes(machine, columns, count)]
    # Actuators are placed as those of the first home pose; others differ from them by where they count from.
    actuators = [actuator.at(joints.coordinates) for actuator in at_homes[0]]
    offsets = np.array([[actuator.offset for actuator in row] for row in at_homes])
    coordinates = stacked_columns([actuator.coordinate for actuator in actuators], count) + (offsets - offsets[0])
    signs = np.array([[actuator.sign for actuator in row] for row in at_homes])
    return _AllActuators(actuators, coordinates, np.broadcast_to(signs, (count, len(actuators))))


def _homes(machine: Machine, columns: Mapping[str, Array], count: int) -> list[Machine]:
    """The machines from whose home poses coordinates count: one for all poses unless the geometry varies with them."""
    varied = {path: column for path, column in columns.items() if path.split(".")[0] in machine.family.tables}
    geometry = {path: column for path, column in varied.items() if not path.startswith(POSE)}
    rows = range(count if geometry else 1)
    return [with_values(machine, {path: float(column[row]) for path, column in geometry.items()}) for row in rows]


@former_names(before="distance_uncorrected", left="distance_corrected", turned="rotation_corrected")
@dataclass(frozen=True, eq=False)
class Command(CommandedPoses, ImmutableAnswer):
    """Coordinates of the actuators that put the loaded tool where an unloaded machine would have it.

    Attributes:
        machine: the machine with its loads.
        poses: the poses that are wanted; None for the pose of the machine alone.
        actuators: names of the actuators.
        units: unit of each coordinate, "m" or "rad".
        message: the answer in a sentence.
    """

    machine: Machine
    poses: PoseColumns | None
    actuators: tuple[str, ...]
    units: tuple[str, ...]
    message: str

    def __repr__(self) -> str:
        return f"<Command of {self.machine.name!r}: {len(self.coordinates)} poses>"


@checked
def command(machine: Machine, poses: Any = None, fit: str | Path | None = None) -> Command:
    """Find where the actuators of a loaded machine must stand so that its tool is where it should be.

    A machine deflects under its loads, so that its tool misses the pose if the actuators stand where they would without
    loads. These coordinates bring it back. A machine with fewer than six freedoms is brought as near as its actuators
    can.

    Args:
        machine: the machine with its loads; its own pose is wanted if no poses are given.
        poses: the poses that are wanted: a DataFrame, a dictionary of columns, an array, a dataset or the path of a CSV
            file, as for `evaluate`.
        fit: folder or fit.json of `identify`, if the machine is the one as built that `identify` has written. Its file
            does not hold zeros and gains of actuators; with the fit, coordinates are those that the controller counts.

    Raises:
        InputError: there is gravity but no mass; the machine has no actuator, or its tensions are to be chosen; the
            poses cannot be read; or the fit is that of another machine.
    """
    refuse_tensions(machine)
    record = None if fit is None else read_fit(fit)
    if record is not None:
        record.check(machine)
        _refuse_drawn(machine, record)
    columns = None if poses is None else given_poses(machine, poses)
    leaves, count = ({}, 1) if columns is None else (columns.leaves, columns.count)
    try:
        targets = actuator_targets(machine, leaves, count)
    except InputError as error:
        raise InputError(f"{error} {columns.unit_doubt if columns else ''}".rstrip()) from None
    answer = command_of(machine, columns, targets)
    if record is None:
        return answer
    home = home_coordinates(machine)
    return replace(
        answer,
        coordinates=record.controller_counts(answer.actuators, answer.coordinates, home),
        unloaded=record.controller_counts(answer.actuators, answer.unloaded, home),
        message=f"{answer.message} Zeros and gains of the fit are counted in.",
    )


def home_coordinates(machine: Machine) -> dict[str, float]:
    """Coordinates of the actuators of a machine at its home pose, by name, m or rad.

    A family in closed form has no home pose: its own pose counts.
    """
    pose: dict[str, float] = {}
    if machine.family.chains:
        chains = machine.chains()
        home = pose_coordinates(chains.home)
        pose = {f"{POSE}{name}": float(home[name]) for name in chains.pose}
    return {actuator.name: actuator.coordinate for actuator in analyze(changed(machine, pose)).actuators}


def _refuse_drawn(machine: Machine, record: FitRecord) -> None:
    """Refuse a machine as drawn, whose numbers are not those that the fit has found."""
    if record.numbers is None:
        # The fit of a family in closed form writes the machine as built leg by leg: the family itself is the drawing.
        is_drawn = record.family == machine.family.name and machine.family.chains is None
    else:
        numbers = values(machine)
        is_drawn = any(not math.isclose(numbers.get(path, math.nan), built) for path, built in record.numbers.items())
    if is_drawn:
        raise InputError(
            f'{machine.name} is the machine as drawn, and the fit "{record.path}" is about the one as built; give the '
            "machine.toml that lies beside it."
        )


def refuse_tensions(machine: Machine) -> None:
    """Refuse a machine whose file asks for chosen tensions: forces command its actuators, not coordinates.

    Raises:
        InputError: the file asks for chosen tensions.
    """
    if not all(math.isinf(bound) for bound in (machine.tables["load"].min_tension, machine.tables["load"].max_tension)):
        raise InputError(
            f"{machine.name}: commands are coordinates of actuators, but load.min_tension and load.max_tension choose "
            "forces, by which its winches are then commanded; leave the bounds out, or read the tensions from "
            "`analyze --loaded`."
        )


def command_of(machine: Machine, poses: PoseColumns | None, answer: ActuatorTargets) -> Command:
    """Return the coordinates found at some poses, with names, units and a sentence.

    Args:
        machine: the machine with its loads.
        poses: the poses; None for the pose of the machine alone.
        answer: the coordinates found at these poses.
    """
    leaves = {} if poses is None else poses.leaves
    limits = _limits_passed(machine, leaves, answer.settled)
    doubt = poses.unit_doubt if poses and (limits or not answer.settled.all()) else ""
    return Command(
        machine=machine,
        poses=poses,
        actuators=tuple(actuator.name for actuator in answer.actuators),
        units=tuple(actuator.unit for actuator in answer.actuators),
        **{name: getattr(answer, name) for name in ARRAYS_OF_POSES},
        message=f"{_message(machine, leaves, answer)}{limits} {doubt}".rstrip(),
    )


def _message(machine: Machine, columns: Mapping[str, Array], answer: ActuatorTargets) -> str:
    settled, show = answer.settled, machine.display.show_deflection
    without = "" if settled.all() else without_command(machine, columns, answer.status)
    if not settled.any():
        return without
    corrected, uncorrected = (
        show(float(np.nanmax(distances)), "m") for distances in (answer.distance_corrected, answer.distance_uncorrected)
    )
    return (
        f"Commanded so, the tool point is off by at most {corrected}; without a correction by {uncorrected}. {without}"
    ).rstrip()


def without_command(machine: Machine, columns: Mapping[str, Array], status: Integers) -> str:
    """Say how many poses have no command for which reasons, and the reason of the first one in full.

    Args:
        machine: gives all parameters that do not vary.
        columns: values of the parameters that vary, by leaf path, SI [n].
        status: `Status` codes [n], not all of them OK.
    """
    lost = np.flatnonzero(status != Status.OK)
    machine_there = with_values(machine, {path: float(column[lost[0]]) for path, column in columns.items()})
    first_status = Status(int(status[lost[0]]))
    reason = first_status.sentence if first_status is Status.NO_REST else state_of(machine_there).refusal
    if len(status) == 1:
        return reason
    has = "has" if len(lost) == 1 else "have"
    return f"{len(lost)} of {len(status)} poses {has} no command ({tally(status)}). Pose {lost[0] + 1}: {reason}"


def tally(status: Integers) -> str:
    """Count the statuses that are not OK, such as "2 out of reach, 1 no rest"."""
    counts = Counter(Status(code).phrase for code in status[status != Status.OK].tolist())
    return ", ".join(f"{count} {word}" for word, count in counts.items())


def _limits_passed(machine: Machine, columns: Mapping[str, Array], settled: Mask) -> str:
    """A sentence on the commanded poses that pass a limit of the file; empty without one."""
    names, rows = [limit.name for limit in limits_set(machine.tables["limits"])], np.flatnonzero(settled)
    if not (names and rows.size):
        return ""
    # The table of poses needs a column also where nothing varies: one coordinate of the pose, as it is.
    coordinate, number = next((path, value) for path, value in values(machine).items() if path.startswith(POSE))
    placed = {coordinate: np.full(len(settled), number), **columns}
    limits_first_passed = first_limit_passed(machine, {path: column[rows] for path, column in placed.items()}, names)
    places = np.flatnonzero(limits_first_passed >= 0)
    if not places.size:
        return ""
    limit = f"limits.{names[limits_first_passed[places[0]]]}"
    if len(settled) == 1:
        return f" But the pose passes {limit}, see `kinetostat analyze` there."
    where = f"{len(places)} of {len(settled)} poses, first at pose {rows[places[0]] + 1}: {limit}"
    return f" But a limit of the file is passed at {where}."
