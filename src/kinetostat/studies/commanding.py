"""Commands: coordinates of the actuators that bring the tool of a loaded machine to its pose, at one pose or at many.

Poses are solved in slabs, each as one array. The equations are in `equilibrium.actuation`; the command is `command`.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.engine.batch import Progress, silent
from kinetostat.engine.loaded import Way
from kinetostat.equilibrium.actuation import commanded_state
from kinetostat.equilibrium.state import SOUGHT_NO_REST, MachineState, states_at
from kinetostat.equilibrium.tangent import stabilities
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints, pose_of
from kinetostat.kinematics.forward import leg_names
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.actuators import Actuator, actuators_of, joint_actuators, senses_of
from kinetostat.machine.column import stacked_columns
from kinetostat.machine.loading import changed
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, with_values
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import Immutable
from kinetostat.studies.analysis import analyze
from kinetostat.studies.identification.record import FitRecord, read_fit
from kinetostat.studies.poses import PoseColumns, given_poses
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY

COMMANDED_AT_ONCE = Way.ANY_MACHINE.slab
"""Poses that are solved together."""


@dataclass(frozen=True)
class ActuatorTargets:
    """Coordinates at which actuators of a loaded machine must stand at n poses; NaN where there is no state of rest.

    Attributes:
        actuators: that can be actuator_targets.
        coordinates: that bring the tool to its pose, or as near as they can, m or rad [n x actuators].
        unloaded: where they stand without loads [n x actuators].
        before: how far the tool point is off without a correction, m [n].
        left: how far it is off with it, m [n].
        turned: how far the platform stays turned, rad [n].
        rates: motion of the tool point per unit of each coordinate [n x 3 x actuators].
    """

    actuators: tuple[Actuator, ...]
    coordinates: Array
    unloaded: Array
    before: Array
    left: Array
    turned: Array
    rates: Array

    @property
    def settled(self) -> Mask:
        """Whether the machine comes to rest [n]."""
        return np.asarray(np.isfinite(self.coordinates).all(axis=1))

    @property
    def corrections(self) -> Array:
        """By how much the coordinates differ from those without loads [n x actuators]."""
        return self.coordinates - self.unloaded

    def split(self, count: int) -> tuple["ActuatorTargets", "ActuatorTargets"]:
        """The first so many poses, and the others."""
        return self._with_each(lambda values: values[:count]), self._with_each(lambda values: values[count:])

    def where(self, settled: Mask) -> "ActuatorTargets":
        """The answer with NaN at all other poses [n]."""
        return self._with_each(lambda values: np.where(settled.reshape(-1, *[1] * (values.ndim - 1)), values, np.nan))

    def _with_each(self, change: Callable[[Array], Array]) -> "ActuatorTargets":
        return ActuatorTargets(self.actuators, *(change(getattr(self, name)) for name in TARGET_ARRAYS))


TARGET_ARRAYS = [field.name for field in fields(ActuatorTargets)][1:]
"""Its arrays, with the poses first."""


def actuator_targets(
    machine: Machine, columns: Mapping[str, Array], count: int, progress: Progress = silent
) -> ActuatorTargets:
    """Find the coordinates of the actuators with which the loaded tool is where it should be.

    Args:
        machine: gives all parameters that do not vary.
        columns: values of those that vary by leaf path, SI [n].
        count: n.
        progress: receives how far the work is.

    Raises:
        InputError: as for `MachineState.mechanism`; or no pose is reached, or the machine has no actuator.
    """
    slabs = []
    for start in range(0, count, COMMANDED_AT_ONCE):
        rows = slice(start, min(start + COMMANDED_AT_ONCE, count))
        with np.errstate(all="ignore"):  # poses without a place
            slabs.append(
                _targets_of_slab(machine, {path: column[rows] for path, column in columns.items()}, rows.stop - start)
            )
        progress(rows.stop, count)
    names = next((slab.actuators for slab in slabs if slab is not None and slab.actuators), None)
    if names is None:
        raise InputError(
            f"{machine.name} reaches none of these poses, or it is undecided there which rigid parts share a load, or "
            "no actuator could be commanded; change the pose."
        )
    sizes = [min(COMMANDED_AT_ONCE, count - start) for start in range(0, count, COMMANDED_AT_ONCE)]
    return _concatenation([slab or _empty_targets(names, size) for slab, size in zip(slabs, sizes, strict=True)])


def _concatenation(slabs: list[ActuatorTargets]) -> ActuatorTargets:
    return ActuatorTargets(
        slabs[0].actuators, *(np.concatenate([getattr(slab, name) for slab in slabs]) for name in TARGET_ARRAYS)
    )


def _empty_targets(actuators: tuple[Actuator, ...], count: int) -> ActuatorTargets:
    size = len(actuators)
    shapes = ((count, size), (count, size), (count,), (count,), (count,), (count, 3, size))
    return ActuatorTargets(actuators, *(np.full(shape, np.nan) for shape in shapes))


def _targets_of_slab(machine: Machine, columns: Mapping[str, Array], count: int) -> ActuatorTargets | None:
    """Some poses at once; None where the machine has no state of rest to look for at any of them."""
    state = states_at(machine, columns, count)
    status = np.broadcast_to(state.free.status, (count,))
    rows = np.flatnonzero(~np.isin(status, SOUGHT_NO_REST))
    if not len(rows):
        return None
    placed = {path: column[rows] for path, column in columns.items()}
    here = _targets_at(state.at(rows), machine, placed)
    if len(rows) == count:
        return here
    whole = _empty_targets(here.actuators, count)
    for name in TARGET_ARRAYS:
        getattr(whole, name)[rows] = getattr(here, name)
    return whole


def _targets_at(state: MachineState, machine: Machine, columns: Mapping[str, Array]) -> ActuatorTargets:
    """The states of a machine at poses all of which it reaches."""
    mechanism, count = state.mechanism, state.count
    actuators, stands, senses = _actuators(machine, columns, state.free, state.joints, count)
    known = [actuator.name for actuator in actuators]
    chosen = [known.index(name) for name in mechanism.actuators]
    actuators, stands, senses = [actuators[i] for i in chosen], stands[:, chosen], senses[:, chosen]
    if not actuators:
        return _empty_targets((), count)
    length = mechanism.length
    units = senses * np.where([actuator.slides for actuator in actuators], length[:, None], 1.0)
    answer = commanded_state(mechanism)
    equations = answer.solution.balance
    stable = answer.solution.settled & stabilities(equations).stable
    before, left = (np.linalg.norm(twists[:, 3:], axis=1) * length for twists in (answer.before, answer.off))
    left = np.where(left > ROUND_OFF_OF_ENTRY * length, left, 0.0)
    turned = np.linalg.norm(answer.off[:, :3], axis=1)
    rates = answer.rates[:, 3:] * (length[:, None] / units)[:, None]
    whole = ActuatorTargets(
        tuple(actuators), stands + equations.state.amounts * units, stands, before, left, turned, rates
    )
    return whole.where(stable)


def _actuators(
    machine: Machine, columns: Mapping[str, Array], response: Response, joints: Joints | None, count: int
) -> tuple[list[Actuator], Array, Array]:
    """All actuators, where they stand, and whether their coordinates grow as they move forward [n x actuators]."""
    if joints is None:
        actuators = actuators_of(response.configuration)
        senses = stacked_columns(senses_of(response.configuration), count)
        return actuators, stacked_columns([actuator.coordinate for actuator in actuators], count), senses
    # What counts from the home pose depends on the geometry there, which seldom varies.
    built = {path: column for path, column in columns.items() if path.split(".")[0] in machine.family.tables}
    built = {path: column for path, column in built.items() if not path.startswith("pose.")}
    homes = [{path: float(column[i]) for path, column in built.items()} for i in range(count if built else 1)]
    of_rows = [joint_actuators(with_values(machine, home).chains(), leg_names(machine)) for home in homes]
    placed = [actuator.at(joints.coordinates) for actuator in of_rows[0]]
    senses = np.broadcast_to(np.array([[each.sign for each in row] for row in of_rows]), (count, len(placed)))
    offsets = np.array([[each.offset - of_rows[0][k].offset for k, each in enumerate(row)] for row in of_rows])
    return placed, stacked_columns([actuator.coordinate for actuator in placed], count) + offsets, senses


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
    settled: Mask
    message: str

    @property
    def corrections(self) -> Array:
        """By how much the coordinates differ from those without loads, m or rad [poses x actuators]."""
        return self.coordinates - self.unloaded

    def __repr__(self) -> str:
        return f"<Command of {self.machine.name!r}: {len(self.coordinates)} poses>"


@checked
def command(machine: Machine, poses: Any = None, fit: str | Path | None = None) -> Command:
    """Find where the actuators of a loaded machine must stand so that its tool is where it should be.

    A machine bends under its loads, so that actuators that stand where an ideal machine would have them leave the tool
    beside its pose. These coordinates bring it back. A machine with fewer than six freedoms is brought as near as its
    actuators can.

    Args:
        machine: with its loads; its pose is the one that is wanted, if no poses are given.
        poses: that are wanted: a DataFrame, a dictionary of columns, an array, a dataset or the path of a CSV file, as
            for `evaluate`.
        fit: folder or fit.json of `identify`, where the machine is the one as built that the fit has written: zeros
            and gains of its actuators are not in its file, and coordinates are then those that its controller counts.

    Raises:
        InputError: there is gravity but no mass, no actuator, tensions are to be chosen, the poses cannot be read, or
            the fit is that of another machine.
    """
    refuse_tensions(machine)
    record = None if fit is None else read_fit(fit)
    if record is not None:
        record.check(machine, drawn=False)
        _refuse_drawn(machine, record)
    columns = None if poses is None else given_poses(machine, poses)
    leaves, count = ({}, 1) if columns is None else (columns.leaves, columns.count)
    answer = command_of(machine, columns, actuator_targets(machine, leaves, count))
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
    """Coordinates of the actuators of a machine leg by leg at its home pose, by name, m or rad."""
    home = pose_of(machine.chains().home) if machine.family.chains else {}
    there = changed(machine, {f"{POSE}{name}": float(home[name]) for name in machine.chains().pose} if home else {})
    return {actuator.name: actuator.coordinate for actuator in analyze(there).actuators}


def _refuse_drawn(machine: Machine, record: FitRecord) -> None:
    """Refuse a machine as drawn, whose geometry is not the one that was found."""
    if record.family == machine.family.name and machine.family.chains is None:
        raise InputError(
            f'{machine.name} is the machine as drawn, and the fit "{record.path}" is about the one as built; give the '
            "machine.toml that lies beside it."
        )


def refuse_tensions(machine: Machine) -> None:
    """Refuse a machine whose tensions are to be chosen: its actuators are actuator_targets by forces.

    Raises:
        InputError: it is such a machine.
    """
    if not all(math.isinf(bound) for bound in (machine.tables["load"].min_tension, machine.tables["load"].max_tension)):
        raise InputError(
            f"{machine.name}: commands are coordinates of actuators, but load.min_tension and load.max_tension choose "
            "forces, which winches are actuator_targets by instead; leave the bounds out, or read the tensions from "
            "`analyze --loaded`."
        )


def command_of(machine: Machine, poses: PoseColumns | None, answer: ActuatorTargets) -> Command:
    """Make the answer for people of what is solved at some poses.

    Args:
        machine: with its loads.
        poses: that it is solved at; None for the pose of the machine alone.
        answer: of them.
    """
    return Command(
        machine,
        poses,
        tuple(actuator.name for actuator in answer.actuators),
        tuple(actuator.unit for actuator in answer.actuators),
        answer.coordinates,
        answer.unloaded,
        answer.before,
        answer.left,
        answer.turned,
        answer.settled,
        _message(machine, answer.settled, answer.before, answer.left),
    )


def _message(machine: Machine, settled: Mask, before: Array, left: Array) -> str:
    known, show = int(settled.sum()), machine.display.show_deflection
    if not known:
        return "The machine comes to rest at none of these poses; reduce the load, or preload what only pulls."
    without = "" if settled.all() else f" {len(settled) - known} of {len(settled)} poses have no state of rest."
    return (
        f"Commanded so, the tool point is off by at most {show(float(np.nanmax(left)), 'm')}; without a correction by "
        f"{show(float(np.nanmax(before)), 'm')}.{without}"
    )
