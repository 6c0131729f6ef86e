"""Actuators of a loaded machine at many poses: where they must stand, and how the tool follows when they are driven.

Poses are evaluated in slabs, each as one array. The equations are in `equilibrium.commanding`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.engine.batch import Progress, silent
from kinetostat.engine.loaded import Way
from kinetostat.equilibrium.commanding import commanded
from kinetostat.equilibrium.stability import stabilities
from kinetostat.equilibrium.state import SOUGHT_NO_REST, MachineState, states_at
from kinetostat.kinematics.closure import Joints
from kinetostat.kinematics.forward import leg_names
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.actuators import Actuator, actuators_of, joint_actuators, senses_of
from kinetostat.machine.column import stacked
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values
from kinetostat.spec.errors import InputError
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY

SLAB = Way.ANY_MACHINE.slab
"""Poses that are solved together."""


@dataclass(frozen=True)
class Driven:
    """Where the actuators of a loaded machine must stand at n poses; NaN where there is no state of rest.

    Attributes:
        actuators: that can be driven.
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
        """Where the machine comes to rest [n]."""
        return np.asarray(np.isfinite(self.coordinates).all(axis=1))

    @property
    def corrections(self) -> Array:
        """By how much the coordinates differ from those without loads [n x actuators]."""
        return self.coordinates - self.unloaded

    def parted(self, count: int) -> tuple["Driven", "Driven"]:
        """The first so many poses, and the others."""
        return self._made(lambda values: values[:count]), self._made(lambda values: values[count:])

    def where(self, settled: Mask) -> "Driven":
        """The answer with NaN at all other poses [n]."""
        return self._made(lambda values: np.where(settled.reshape(-1, *[1] * (values.ndim - 1)), values, np.nan))

    def _made(self, change: Callable[[Array], Array]) -> "Driven":
        return Driven(self.actuators, *(change(getattr(self, name)) for name in NUMBERS))


NUMBERS = [field.name for field in fields(Driven)][1:]
"""Its arrays, with the poses first."""


def driven(machine: Machine, columns: Mapping[str, Array], count: int, progress: Progress = silent) -> Driven:
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
    for start in range(0, count, SLAB):
        rows = slice(start, min(start + SLAB, count))
        with np.errstate(all="ignore"):  # poses without a place
            slabs.append(_slab(machine, {path: column[rows] for path, column in columns.items()}, rows.stop - start))
        progress(rows.stop, count)
    names = next((slab.actuators for slab in slabs if slab is not None and slab.actuators), None)
    if names is None:
        raise InputError(
            f"{machine.name} reaches none of these poses, or it is undecided there which rigid parts share a load, or "
            "no actuator could be commanded; change the pose."
        )
    sizes = [min(SLAB, count - start) for start in range(0, count, SLAB)]
    return _joined([slab or _nowhere(names, size) for slab, size in zip(slabs, sizes, strict=True)])


def _joined(slabs: list[Driven]) -> Driven:
    return Driven(slabs[0].actuators, *(np.concatenate([getattr(slab, name) for slab in slabs]) for name in NUMBERS))


def _nowhere(actuators: tuple[Actuator, ...], count: int) -> Driven:
    size = len(actuators)
    shapes = ((count, size), (count, size), (count,), (count,), (count,), (count, 3, size))
    return Driven(actuators, *(np.full(shape, np.nan) for shape in shapes))


def _slab(machine: Machine, columns: Mapping[str, Array], count: int) -> Driven | None:
    """Some poses at once; None where the machine has no state of rest to look for at any of them."""
    state = states_at(machine, columns, count)
    status = np.broadcast_to(state.free.status, (count,))
    rows = np.flatnonzero(~np.isin(status, SOUGHT_NO_REST))
    if not len(rows):
        return None
    placed = {path: column[rows] for path, column in columns.items()}
    here = _at(state.at(rows), machine, placed)
    if len(rows) == count:
        return here
    whole = _nowhere(here.actuators, count)
    for name in NUMBERS:
        getattr(whole, name)[rows] = getattr(here, name)
    return whole


def _at(state: MachineState, machine: Machine, columns: Mapping[str, Array]) -> Driven:
    """The states of a machine at poses all of which it reaches."""
    mechanism, count = state.mechanism, state.count
    actuators, stands, senses = _actuators(machine, columns, state.free, state.joints, count)
    known = [actuator.name for actuator in actuators]
    chosen = [known.index(name) for name in mechanism.actuators]
    actuators, stands, senses = [actuators[i] for i in chosen], stands[:, chosen], senses[:, chosen]
    if not actuators:
        return _nowhere((), count)
    length = mechanism.length
    units = senses * np.where([actuator.slides for actuator in actuators], length[:, None], 1.0)
    answer = commanded(mechanism)
    equations = answer.solution.balance
    stable = answer.solution.settled & stabilities(equations).stable
    before, left = (np.linalg.norm(twists[:, 3:], axis=1) * length for twists in (answer.before, answer.off))
    left = np.where(left > ROUND_OFF_OF_ENTRY * length, left, 0.0)
    turned = np.linalg.norm(answer.off[:, :3], axis=1)
    rates = answer.rates[:, 3:] * (length[:, None] / units)[:, None]
    whole = Driven(tuple(actuators), stands + equations.state.amounts * units, stands, before, left, turned, rates)
    return whole.where(stable)


def _actuators(
    machine: Machine, columns: Mapping[str, Array], response: Response, joints: Joints | None, count: int
) -> tuple[list[Actuator], Array, Array]:
    """All actuators, where they stand, and whether their coordinates grow as they move forward [n x actuators]."""
    if joints is None:
        actuators = actuators_of(response.configuration)
        senses = stacked(senses_of(response.configuration), count)
        return actuators, stacked([actuator.coordinate for actuator in actuators], count), senses
    # What counts from the home pose depends on the geometry there, which seldom varies.
    built = {path: column for path, column in columns.items() if path.split(".")[0] in machine.family.tables}
    built = {path: column for path, column in built.items() if not path.startswith("pose.")}
    homes = [{path: float(column[i]) for path, column in built.items()} for i in range(count if built else 1)]
    of_rows = [joint_actuators(with_values(machine, home).chains(), leg_names(machine)) for home in homes]
    placed = [actuator.at(joints.coordinates) for actuator in of_rows[0]]
    senses = np.broadcast_to(np.array([[each.sign for each in row] for row in of_rows]), (count, len(placed)))
    offsets = np.array([[each.offset - of_rows[0][k].offset for k, each in enumerate(row)] for row in of_rows])
    return placed, stacked([actuator.coordinate for actuator in placed], count) + offsets, senses
