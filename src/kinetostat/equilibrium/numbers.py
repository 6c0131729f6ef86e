"""States of rest at many poses, and the numbers of `quantities` that belong to them. No formula lives here.

Source: theory section 12.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from kinetostat.algebra.scalar import Scalar, larger, where
from kinetostat.arrays import Array, Integers
from kinetostat.equilibrium.balance import Balance
from kinetostat.equilibrium.solving import Stabilities, at_rest, stabilities
from kinetostat.equilibrium.state import MachineState, actuator_loads_at_rest
from kinetostat.equilibrium.tangent import platform_compliance, stiffness_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.limits import load_checks, within
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import LOADS_OF_ACTUATORS, OF_THE_PLACE, QUANTITIES
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import Machine

RestNumber = Callable[[Balance], Array]
"""Computes another number of n states of rest [n], or several of each [n x m]."""


@dataclass(frozen=True)
class States:
    """The states of rest at n points.

    Attributes:
        status: `Status` codes [n].
        rows: numbers of the points at which the machine is at rest and stable.
        equations: the equations at all states of rest, stable or not; None if the legs can be placed at no point.
        stability: stability of these states; `rows` lists the stable ones, in the same order.
        loads: force or moment of each actuator, N or N·m [n]; NaN where the machine is not at rest.
    """

    status: Integers
    rows: Integers
    equations: Balance | None = None
    stability: Stabilities | None = None
    loads: tuple[tuple[Spring, Array], ...] = ()


def states_of_rest(state: MachineState) -> States:
    """Find the states of rest at n poses. It raises what `loaded_numbers` raises."""
    count, free = state.count, state.free
    status = np.broadcast_to(free.place_status, (count,)).astype(np.int64)
    status[np.broadcast_to(free.status, (count,)) == Status.UNDECIDED] = Status.UNDECIDED
    rows = np.flatnonzero(status == Status.OK)
    if not len(rows):
        return States(status, rows)
    placed = state.at(rows)
    solution = at_rest(placed.mechanism)
    settled = np.flatnonzero(solution.settled & placed.balanced)
    equations = solution.at(settled)
    stability = stabilities(equations)
    status[rows], stable = Status.NO_REST, rows[settled[stability.stable]]
    status[stable] = Status.OK
    loads = [(spring, np.full(count, np.nan)) for spring in placed.mechanism.driven]
    for (_, at_all_points), (_, at_rest_points) in zip(loads, actuator_loads_at_rest(equations), strict=True):
        at_all_points[stable] = at_rest_points[stability.stable]
    status[stable] = status_with_load_limits(state.machine, free, loads, status)[stable]
    return States(status, stable, equations, stability, tuple(loads))


def status_with_load_limits(
    machine: Machine, response: Response, loads: Sequence[tuple[Spring, Scalar]], status: Scalar
) -> Scalar:
    """Return the status of a machine at rest, JOINT_LIMIT where an actuator carries more than its limit allows.

    A machine that its file does not mean under its loads keeps its status: its limits are compared in the free state.

    Args:
        machine: the machine with its limits.
        response: its response without loads.
        loads: force or moment of each actuator at rest, N or N·m.
        status: `Status` code of the state before these limits are compared.
    """
    if not machine.loaded:
        return status
    sizes = [(spring, abs(load)) for spring, load in loads]
    in_limits = within(load_checks(machine, response.configuration, sizes))
    return where(in_limits, status, where(abs(status - float(Status.OK)) < 0.5, int(Status.JOINT_LIMIT), status))


def status_with_rest(machine: Machine, names: Iterable[str], free: Scalar, at_rest: Scalar) -> Scalar:
    """Return the status of a pose for quantities of which some are about the machine at rest.

    What follows from the wrenches of the free machine, such as K, C and the singularity margin, has a number only where
    these wrenches hold the platform. A machine may come to rest where they do not; a question about both has no answer
    there (theory section 12).

    Args:
        machine: the machine; the state in which it is meant says where the loads of its actuators are found.
        names: names of the quantities.
        free: `Status` code of the pose without loads.
        at_rest: `Status` code of the state of rest.
    """
    elsewhere = {*OF_THE_PLACE, *(LOADS_OF_ACTUATORS if machine.loaded else ())}
    if all(QUANTITIES[name].loaded or name in elsewhere for name in names):
        return at_rest
    return where(abs(free - float(Status.SINGULAR)) < 0.5, int(Status.SINGULAR), at_rest)


def greatest_loads(loads: Sequence[tuple[Spring, Scalar]]) -> dict[str, Scalar]:
    """Return the greatest force of all actuated slides, and the greatest moment of all actuated revolutes.

    Args:
        loads: force or moment of each actuator, N or N·m, over any scalars.

    Returns:
        The sizes by quantity; one is left out where the machine has no such actuator.
    """
    result: dict[str, Scalar] = {}
    for spring, load in loads:
        size, name = abs(load), LOADS_OF_ACTUATORS[0 if spring.joint.point is None else 1]
        result[name] = larger(size, result[name]) if name in result else size
    return result


def loaded_numbers(
    state: MachineState, further: Mapping[str, RestNumber] | None = None
) -> tuple[dict[str, Array], Integers]:
    """Find the numbers of the loaded states at n poses.

    Args:
        state: the state of a machine with its loads.
        further: functions of the states of rest whose numbers are wanted as well, by name.

    Returns:
        For each name its values [n] or [n x 6], SI, at the loaded tool point in base axes: "displacement" (rotation
        vector and displacement of the tool), "compliance" and "stiffness" (their diagonals), "slack" (number of slack
        springs), "factor" (by which the loads may grow), "actuator_force" and "actuator_moment" (the greatest), and
        "drive_loads" (force or moment of each actuator) [n x actuators]. They are NaN where no state of rest is
        stable. The numbers of `further` and the last three are left out if the legs can be placed at no pose. And
        `Status` codes [n].

    Raises:
        InputError: as for `MachineState.mechanism`.
    """
    count = state.count
    result: dict[str, Array] = {
        **{name: np.full((count, 6), np.nan) for name in ("displacement", "compliance", "stiffness")},
        **{name: np.full(count, np.nan) for name in ("slack", "factor")},
    }
    states = states_of_rest(state)
    equations, stability = states.equations, states.stability
    if equations is None or stability is None:
        return result, states.status
    numbers = _numbers_at_rest(equations, np.array(state.machine.family.components)) | {"factor": stability.factor}
    numbers |= {name: compute(equations) for name, compute in (further or {}).items()}
    for name, values in numbers.items():
        at_all_points = result.setdefault(name, np.full((count, *values.shape[1:]), np.nan))
        at_all_points[states.rows] = values[stability.stable]
    drive_loads = np.array([load for _, load in states.loads]).reshape(-1, count).T
    return result | greatest_loads(states.loads) | {"drive_loads": drive_loads}, states.status


def _numbers_at_rest(equations: Balance, components: Integers) -> dict[str, Array]:
    """Return the numbers of `loaded_numbers` that follow from the equations at rest.

    Args:
        equations: the equations at n states of rest.
        components: numbers of the components of twists that the machine has; along the others stiffness is NaN.
    """
    mechanism = equations.mechanism
    compliances = platform_compliance(equations) * mechanism.compliance_units
    stiffness = np.full((len(equations.residual), 6), np.nan)
    of_components = stiffness_of(compliances[:, components[:, None], components])
    stiffness[:, components] = np.diagonal(of_components, axis1=1, axis2=2)
    pairs = zip(mechanism.legs, equations.legs, strict=True)
    return {
        "displacement": equations.state.platform.amounts() * mechanism.twist_units,
        "compliance": np.diagonal(compliances, axis1=1, axis2=2),
        "stiffness": stiffness,
        "slack": np.sum([((leg.sign != 0.0) & (terms.carrying == 0.0)).sum(axis=1) for leg, terms in pairs], axis=0),
    }
