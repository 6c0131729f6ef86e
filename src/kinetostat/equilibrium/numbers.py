"""Loaded states at many poses: the numbers of `quantities` that are about them. No formula lives here.

Source: theory section 12.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kinetostat.algebra.scalar import Scalar, smaller, total, where
from kinetostat.arrays import Array, Integers, Mask
from kinetostat.equilibrium.balance import Balance
from kinetostat.equilibrium.mechanism import Mechanism, mechanism_of
from kinetostat.equilibrium.solving import at_rest
from kinetostat.equilibrium.stability import Stabilities, stabilities
from kinetostat.equilibrium.tangent import compliance, inverse
from kinetostat.equilibrium.tensions import tensioned
from kinetostat.kinematics.closure import Joints, solve_joints
from kinetostat.kinematics.limits import load_checks, within
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import LOADS_OF_ACTUATORS, rest_numbers
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.column import stacked
from kinetostat.machine.leg import Spring
from kinetostat.machine.links import growth_of
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values
from kinetostat.spec.errors import InputError

FREE = (Status.OK, Status.SINGULAR)
"""Statuses without loads that a loaded machine can have: tension and weight hold where springs do not."""


def loaded_mechanism(
    machine: Machine, response: Response, joints: Joints | None, count: int = 1
) -> tuple[Mechanism, Mask]:
    """The mechanism of a machine with its loads, see `mechanism_of`, with the tensions that its file leaves open.

    Returns:
        The mechanism, and where tensions within their bounds hold its loads; everywhere if none are to be chosen [n].

    Raises:
        InputError: there is gravity but nothing says a mass, or bounds of tensions contradict each other.
    """
    mechanism = mechanism_of(machine, response, joints, count)
    check_loads(machine, count, mechanism.weighs)
    load = machine.tables["load"]
    least, most = (stacked([getattr(load, f"{end}_tension")], count)[:, 0] for end in ("min", "max"))
    if np.isinf(least).all() and np.isinf(most).all():
        return mechanism, np.ones(count, dtype=bool)
    least = np.where(np.isinf(least), 0.0, least)
    if (least > most).any():
        show = machine.display.show
        raise InputError(
            f"{machine.name}: load.min_tension is {show(float(least.max()), 'N')}, more than load.max_tension, "
            f"{show(float(most.min()), 'N')}; lower the one or raise the other."
        )
    if not any(leg.sign.any() for leg in mechanism.legs):
        raise InputError(
            f"{machine.name}: load.min_tension and load.max_tension bound what only pulls or only pushes, which no "
            'spring does; write acts = "pulls" at an actuator, or a leg of type = "cable".'
        )
    return tensioned(mechanism, least / mechanism.force, most / mechanism.force)


def check_loads(machine: Machine, count: int, weighs: bool = True) -> None:
    """Refuse loads at n poses that say too little.

    Args:
        machine: with its loads.
        count: of poses, n.
        weighs: whether any of its masses is known.

    Raises:
        InputError: there is gravity but nothing says a mass, or it turns about no axis; links are warmer, but nothing
            says how they grow.
    """
    load = machine.tables["load"]
    if not weighs and np.any(stacked(load.gravity, count)):
        raise InputError(
            f"{machine.name}: load.gravity pulls at masses, but none is known; give the platform's as [tool] mass, or "
            "links a cross-section with a density."
        )
    for kind in machine.family.links:
        tables = (getattr(machine.tables[table], kind.name) for table in ("expansion", "temperature_rise"))
        expansions, rises = (entries if isinstance(entries, tuple) else (entries,) for entries in tables)
        for expansion, rise in zip(expansions, rises, strict=True):
            growth_of(expansion, float(np.abs(stacked([rise], count)).max(initial=0.0)), kind.name)
    turned = np.any(stacked([load.gravity_angle], count))
    if turned and not stacked(load.gravity_axis, count).any(axis=1).all():
        raise InputError(
            f"{machine.name}: load.gravity_axis is [0, 0, 0], so that gravity cannot be turned by load.gravity_angle; "
            "give the axis of the base about which the machine is tilted, e.g. [1, 0, 0]."
        )


Further = Callable[[Balance], Array]
"""Another number of states of rest, or several of each [n] or [n x m]."""


@dataclass(frozen=True)
class States:
    """The states of rest at n points.

    Attributes:
        status: `Status` codes [n].
        rows: of the points at which the machine is at rest and stable.
        equations: at all states of rest, stable or not; None if no point has a place.
        judged: their stability; `rows` are those that are stable, in their order.
        loads: size of what each actuator carries, N or N·m [n]; NaN where the machine is not at rest.
    """

    status: Integers
    rows: Integers
    equations: Balance | None = None
    judged: Stabilities | None = None
    loads: tuple[tuple[Spring, Array], ...] = ()


def states_of_rest(machine: Machine, columns: Mapping[str, Array], count: int) -> States:
    """Find the states of rest at n points; arguments and errors as for `loaded_numbers`."""
    everywhere = with_values(machine, columns)
    response = respond(everywhere)
    status = np.broadcast_to(response.status, (count,)).astype(np.int64)
    rows = np.flatnonzero(np.isin(status, FREE))
    if not len(rows):
        return States(status, rows)
    posed = with_values(machine, {path: np.asarray(values)[rows] for path, values in columns.items()})
    joints = solve_joints(posed) if posed.family.chains else None
    mechanism, balanced = loaded_mechanism(posed, respond(posed, joints), joints, len(rows))
    solution = at_rest(mechanism)
    settled = np.flatnonzero(solution.settled & balanced)
    equations = solution.at(settled)
    judged = stabilities(equations)
    status[rows], rested = Status.NO_REST, rows[settled[judged.stable]]
    status[rested] = Status.OK
    loads = [(spring, np.full(count, np.nan)) for spring in mechanism.driven]
    for (_, whole), (_, sizes) in zip(loads, actuator_loads_at_rest(equations), strict=True):
        whole[rested] = sizes[judged.stable]
    status[rested] = borne(everywhere, response, loads, status)[rested]
    return States(status, rested, equations, judged, tuple(loads))


def borne(machine: Machine, response: Response, loads: Sequence[tuple[Spring, Scalar]], status: Scalar) -> Scalar:
    """Return the status of a machine at rest; where it is meant so, limits bound what its actuators carry there.

    Args:
        machine: with its limits.
        response: of it, without loads.
        loads: size of what each actuator carries at rest, N or N·m.
        status: `Status` code of the state without these limits.
    """
    if not machine.loaded:
        return status
    kept = within(load_checks(machine, response.configuration, loads))
    return where(kept, status, where(abs(status - float(Status.OK)) < 0.5, int(Status.JOINT_LIMIT), status))


def judged_at_rest(machine: Machine, response: Response) -> Response:
    """Return the response of a machine at its pose with what its actuators carry at rest compared with their limits.

    Nothing changes where the machine is not meant under its loads, where it comes to no rest there, and where its loads
    say too little: the answer about its rest says so.

    Args:
        machine: with its pose, limits and loads.
        response: of it.
    """
    if "actuators" not in rest_numbers(machine, ()):
        return response
    try:
        states = states_of_rest(machine, {}, 1)
    except InputError:
        return response
    if not len(states.rows):
        return response
    checks = load_checks(machine, response.configuration, [(spring, size[0]) for spring, size in states.loads])
    passed = int(response.status) == Status.OK and not within(checks)
    status = Status.JOINT_LIMIT if passed else response.status
    return replace(response, status=status, checks=(*response.checks, *checks))


def actuator_loads_at_rest(equations: Balance) -> list[tuple[Spring, Array]]:
    """Return every actuator with the size of what it carries in a state, N or N·m [n]."""
    mechanism = equations.mechanism
    holding = total([terms.holding for terms in equations.legs])
    units = [mechanism.force * (1.0 if spring.joint.point is None else mechanism.length) for spring in mechanism.driven]
    return [(spring, abs(load) * unit) for spring, load, unit in zip(mechanism.driven, holding.T, units, strict=False)]


def greatest_loads(loads: Sequence[tuple[Spring, Scalar]]) -> dict[str, Scalar]:
    """Return the greatest force of an actuated slide and moment of an actuated revolute, by quantity, over any scalars.

    Args:
        loads: size of what each actuator carries, N or N·m.

    Returns:
        By quantity; one is left out where the machine has no such actuator.
    """
    result: dict[str, Scalar] = {}
    for spring, size in loads:
        name = LOADS_OF_ACTUATORS[0 if spring.joint.point is None else 1]
        result[name] = -smaller(-size, -result[name]) if name in result else size
    return result


def loaded_numbers(
    machine: Machine, columns: Mapping[str, Array], count: int, further: Mapping[str, Further] | None = None
) -> tuple[dict[str, Array], Integers]:
    """Find the loaded states at n poses.

    Args:
        machine: with its loads; gives all parameters that do not vary.
        columns: values of those that vary by leaf path, SI [n].
        count: n.
        further: what else to compute of the states of rest, by name.

    Returns:
        For each name its values [n] or [n x 6], SI, at the loaded tool point in base axes: "displacement" (rotation
        vector and displacement of the tool), "compliance" (diagonal), "stiffness" (diagonal), "slack" (how many
        springs), "factor", "actuator_force" and "actuator_moment" (the greatest); NaN where there is no state of rest
        that is stable. Those of `further`, and the last two, are left out if no pose has a place. And `Status` codes
        [n].

    Raises:
        InputError: as for `loaded_mechanism`.
    """
    result: dict[str, Array] = {
        **{name: np.full((count, 6), np.nan) for name in ("displacement", "compliance", "stiffness")},
        **{name: np.full(count, np.nan) for name in ("slack", "factor")},
    }
    states = states_of_rest(machine, columns, count)
    equations, judged = states.equations, states.judged
    if equations is None or judged is None:
        return result, states.status
    moved = equations.state.platform.amounts() * equations.mechanism.twist_units
    soft = compliance(equations) * equations.mechanism.compliance_units
    parts = np.array(machine.family.components)
    stiffness = np.full((len(equations.left), 6), np.nan)
    stiffness[:, parts] = np.diagonal(inverse(soft[:, parts[:, None], parts]), axis1=1, axis2=2)
    pairs = zip(equations.mechanism.legs, equations.legs, strict=True)
    slack = np.sum([((leg.sign != 0.0) & (terms.carrying == 0.0)).sum(axis=1) for leg, terms in pairs], axis=0)
    numbers = {
        "displacement": moved,
        "compliance": np.diagonal(soft, axis1=1, axis2=2),
        "stiffness": stiffness,
        "slack": slack,
        "factor": judged.factor,
    }
    numbers |= {name: compute(equations) for name, compute in (further or {}).items()}
    for name, values in numbers.items():
        whole = result.setdefault(name, np.full((count, *values.shape[1:]), np.nan))
        whole[states.rows] = values[judged.stable]
    return result | greatest_loads(states.loads), states.status
