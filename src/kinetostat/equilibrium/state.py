"""A machine in a state: free, with relaxed springs, or at rest under its loads. Every question about a pose reads it.

What follows from a pose is computed when it is first asked for, and kept: places and screws of the legs, K and C,
mobility, the equations at rest, and their stability. A state is made once and handed on, so that no two answers solve
for the same joints. Sentences of answers, and numbers that do not belong to a pose, are not in this file.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from random import Random
from typing import TYPE_CHECKING, Any

import numpy as np

from kinetostat.algebra.scalar import total
from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.kinematics.limits import load_checks, within
from kinetostat.kinematics.mobility import Mobility
from kinetostat.kinematics.status import PLACELESS, REGULAR, Status
from kinetostat.kinetostatics.quantities import rest_numbers
from kinetostat.kinetostatics.refusal import known_mobility, why_not
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.late import LateModule
from kinetostat.machine.column import Column, stacked_columns
from kinetostat.machine.leg import Spring
from kinetostat.machine.links import growth_of
from kinetostat.machine.loads import loads_left_out, located_members
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.machine.parameters import POSE, parameters, values, with_values
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import Immutable, ImmutableAnswer

if TYPE_CHECKING:
    from kinetostat.equilibrium import actuation, balance, solving
    from kinetostat.equilibrium import limit as load_limits
    from kinetostat.equilibrium import mechanism as mechanisms
    from kinetostat.equilibrium.balance import Balance
    from kinetostat.equilibrium.limit import LoadLimit, Strut
    from kinetostat.equilibrium.mechanism import Mechanism
    from kinetostat.equilibrium.solving import Stability
    from kinetostat.kinematics import closure
    from kinetostat.numerics import distribution
else:
    actuation = LateModule("kinetostat.equilibrium.actuation")
    balance = LateModule("kinetostat.equilibrium.balance")
    load_limits = LateModule("kinetostat.equilibrium.limit")
    mechanisms = LateModule("kinetostat.equilibrium.mechanism")
    solving = LateModule("kinetostat.equilibrium.solving")
    closure = LateModule("kinetostat.kinematics.closure")
    distribution = LateModule("kinetostat.numerics.distribution")

WITHOUT_SEARCH_FOR_REST = (*PLACELESS, Status.UNDECIDED)
"""Statuses without loads at which no state of rest can be sought: legs cannot be placed, or loads are undecided."""
NEARBY_DISTANCE = 0.03
"""Distance of poses nearby, which show general mobility, as a share of the characteristic length; of angles, rad."""


@dataclass(frozen=True, eq=False)
class MachineState(Immutable):
    """A machine at its pose, or at n poses, with all that follows from it.

    `machine.loaded` says which state is meant: free, or at rest under all loads of the file. The free state, limits and
    mobility are known of both; the state of rest is solved for when it is asked for.

    Attributes:
        machine: the machine with its pose and its loads, or with columns of n poses.
        count: number of poses, n.
    """

    machine: Machine
    count: int = 1

    def __repr__(self) -> str:
        return f"<{self.machine.name!r}, {'at rest under its loads' if self.machine.loaded else 'free'}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return MachineState, (self.machine, self.count)

    def at(self, rows: Integers) -> "MachineState":
        """The states at some of the poses [rows]; this object if these are all of them."""
        if len(rows) == self.count:
            return self
        columns = {p: value.values[rows] for p, value in values(self.machine).items() if isinstance(value, Column)}
        return MachineState(with_values(self.machine, columns), len(rows))

    @cached_property
    def joints(self) -> Joints | None:
        """Joint coordinates that close the legs; None for a family that places its legs in closed form."""
        return closure.solve_joints(self.machine) if self.machine.family.chains else None

    @cached_property
    def configuration(self) -> Configuration:
        """The machine placed at its pose, with relaxed springs."""
        return self.machine.configure(() if self.joints is None else self.joints.coordinates)

    @cached_property
    def free(self) -> Response:
        """The response of the free machine: screws of its legs, K and C, and limits of the pose without loads."""
        return respond(self.machine, self.joints, self.configuration)

    @cached_property
    def response(self) -> Response:
        """The response of the free machine, with the limits of actuators' loads compared in the state that is meant.

        Where the machine comes to no rest, nothing says what actuators carry, and the status is NO_REST. The response
        is `free` itself if nothing limits these loads, or if masses or bounds are missing in the file: the answer
        under load then says so.
        """
        if "actuators" not in rest_numbers(self.machine, ()) or int(self.free.place_status) != Status.OK:
            return self.free
        try:
            stands = self.stands
        except InputError:
            return self.free
        if not stands:
            return replace(self.free, status=Status.NO_REST) if int(self.free.status) == Status.OK else self.free
        checks = load_checks(self.machine, self.configuration, self.actuator_loads)
        beyond = int(self.free.status) == Status.OK and not within(checks)
        status = Status.JOINT_LIMIT if beyond else self.free.status
        return replace(self.free, status=status, checks=(*self.free.checks, *checks))

    @cached_property
    def status(self) -> Status:
        """Status of the pose."""
        return Status(int(self.response.status))

    @cached_property
    def nearby(self) -> list[Configuration]:
        """The machine at up to three poses near its pose, which show whether the mobility is special to the pose."""
        return _nearby(self.machine, float(self.configuration.length))

    @cached_property
    def mobility(self) -> Mobility | None:
        """Free motions and the kind of the pose; None if the joints cannot be placed."""
        return known_mobility(self.free, self.nearby)

    @cached_property
    def refusal(self) -> str:
        """The reason why the pose has no answer, and what to change, in a sentence or two; empty if it has one."""
        if self.status is Status.OK:
            return ""
        return why_not(self.machine, self.response, self.nearby if self.status is Status.SINGULAR else [])

    @cached_property
    def left_out(self) -> str:
        """A sentence on the loads of the file that do not count in the state that is meant; empty if all do."""
        return "" if self.machine.loaded else loads_left_out(self.machine, self.configuration)

    @cached_property
    def free_equations(self) -> "Balance":
        """The equations of the free state, without loads and preloads."""
        mechanism = solving.with_share(
            mechanisms.mechanism_of(self.machine, self.configuration, self.joints, self.count), 0.0
        )
        return balance.balance(mechanism, balance.free_state(mechanism))

    @cached_property
    def _loads(self) -> "tuple[Mechanism, Mask]":
        return _loaded_mechanism(self.machine, self.configuration, self.joints, self.count)

    @property
    def mechanism(self) -> "Mechanism":
        """The machine with all its loads and the tensions that its file leaves open, as rows of screw motions.

        Raises:
            InputError: there is gravity but no mass in the file, or bounds of tensions contradict each other.
        """
        return self._loads[0]

    @property
    def balanced(self) -> Mask:
        """Whether tensions within their bounds hold the loads; true if none are to be chosen [n]."""
        return self._loads[1]

    @cached_property
    def at_rest(self) -> "Balance | None":
        """The equations of the state of rest under the loads at a single pose, stable or not.

        None if the legs cannot be placed, if rigid parts leave undecided what carries a load, or if the machine comes
        to no rest.

        Raises:
            InputError: as for `mechanism`.
        """
        if int(self.free.status) in PLACELESS or self.free.undecided or not self.balanced[0]:
            return None
        solution = solving.at_rest(self.mechanism)
        return solution.balance if solution.settled[0] else None

    @cached_property
    def stability(self) -> "Stability | None":
        """Stability of the state of rest, and the factor by which the loads may grow; None without a state of rest."""
        return None if self.at_rest is None else solving.stability(self.at_rest)

    @property
    def stands(self) -> bool:
        """Whether the machine comes to a stable state of rest under its loads."""
        return self.stability is not None and self.stability.stable

    @property
    def equations(self) -> "Balance | None":
        """The equations in the state that is meant, at a single pose; None if the machine comes to no stable rest."""
        if not self.machine.loaded:
            return self.free_equations
        return self.at_rest if self.stands else None

    @cached_property
    def limit(self) -> "LoadLimit | None":
        """The last stable state of rest while the loads grow, up to all of them; None if there is none."""
        return load_limits.load_limit(self.mechanism)

    @cached_property
    def struts(self) -> "tuple[Strut, ...]":
        """The struts whose E I is known, with their compression at rest; none without a state of rest."""
        if self.at_rest is None:
            return ()
        configuration, joints = self.configuration, None if self.joints is None else self.joints.coordinates
        members = located_members(self.machine, configuration, joints)
        return tuple(load_limits.struts(configuration.legs, members, self.free.reference, self.at_rest))

    @cached_property
    def actuator_loads(self) -> list[tuple[Spring, float]]:
        """Every actuator with the size of its force or moment at rest, N or N·m; none without a state of rest."""
        loads = [] if self.at_rest is None else actuator_loads_at_rest(self.at_rest)
        return [(spring, float(abs(load[0]))) for spring, load in loads]


@checked
def state_of(machine: Machine | MachineState) -> MachineState:
    """The state of a machine at its pose; a state is returned as it is."""
    return machine if isinstance(machine, MachineState) else MachineState(machine)


def states_at(machine: Machine, columns: Mapping[str, Array], count: int) -> MachineState:
    """The states of a machine at n poses.

    Args:
        machine: gives all parameters that do not vary.
        columns: values of the parameters that vary, by leaf path, SI [n].
        count: number of poses, n.
    """
    return MachineState(with_values(machine, columns), count)


def _nearby(machine: Machine, length: float) -> list[Configuration]:
    """Return the machine at those of three poses near its pose that it can reach; `length` is characteristic, m.

    Mobility is a rank, and a rank can drop at a special pose, so that other poses must show what holds in general. They
    are random, so that none lies on a symmetry of the machine, but the seed is fixed, so that they never change.
    """
    kinds = {p.path: p.quantity.kind for p in parameters(machine.family) if p.path.startswith(POSE)}
    reach = {path: NEARBY_DISTANCE * (length if kind == "length" else 1.0) for path, kind in kinds.items()}
    pose, rng = values(machine), Random(0)
    poses = [{path: pose[path] + r * rng.uniform(-1.0, 1.0) for path, r in reach.items()} for _ in range(3)]
    answers = [respond(with_values(machine, other)) for other in poses]
    return [answer.configuration for answer in answers if int(answer.status) in REGULAR]


def actuator_loads_at_rest(equations: "Balance") -> list[tuple[Spring, Array]]:
    """Return every actuator with its force or moment in a state, N or N·m, positive if it is pulled open [n]."""
    mechanism = equations.mechanism
    holding = total([terms.holding for terms in equations.legs])
    units = [mechanism.force * (1.0 if spring.joint.point is None else mechanism.length) for spring in mechanism.driven]
    return [(spring, load * unit) for spring, load, unit in zip(mechanism.driven, holding.T, units, strict=False)]


def _loaded_mechanism(
    machine: Machine, configuration: Configuration, joints: Joints | None, count: int = 1
) -> "tuple[Mechanism, Mask]":
    """The mechanism of a machine with its loads, see `mechanism_of`, with the tensions that its file leaves open.

    Returns:
        The mechanism, and whether tensions within their bounds hold its loads [n]; true if none are to be chosen.

    Raises:
        InputError: there is gravity but no mass in the file, or bounds of tensions contradict each other.
    """
    mechanism = mechanisms.mechanism_of(machine, configuration, joints, count)
    check_loads(machine, count, mechanism.weighs)
    load = machine.tables["load"]
    least, most = stacked_columns([load.min_tension, load.max_tension], count).T
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
    table = machine.tables["cables"]
    level, exponent = stacked_columns([table.level, table.exponent], count).T
    rule = distribution.Rule(level / mechanism.force, exponent)
    return actuation.with_tensions(mechanism, least / mechanism.force, most / mechanism.force, rule)


def check_loads(machine: Machine, count: int, weighs: bool = True) -> None:
    """Refuse loads at n poses if the file lacks a number that they need.

    Args:
        machine: the machine with its loads.
        count: number of poses, n.
        weighs: whether any of its masses is known.

    Raises:
        InputError: there is gravity but no mass, or it is turned about an axis that is zero; or links are warmer, but
            their expansion is not given.
    """
    load = machine.tables["load"]
    if not weighs and np.any(stacked_columns(load.gravity, count)):
        raise InputError(
            f"{machine.name}: load.gravity pulls at masses, but none is known; give the platform's as [tool] mass, or "
            "links a cross-section with a density."
        )
    for kind in machine.family.links:
        tables = (getattr(machine.tables[table], kind.name) for table in ("expansion", "temperature_rise"))
        expansions, rises = (entries if isinstance(entries, tuple) else (entries,) for entries in tables)
        for expansion, rise in zip(expansions, rises, strict=True):
            growth_of(expansion, float(np.abs(stacked_columns([rise], count)).max(initial=0.0)), kind.name)
    is_turned = np.any(stacked_columns([load.gravity_angle], count))
    if is_turned and not stacked_columns(load.gravity_axis, count).any(axis=1).all():
        raise InputError(
            f"{machine.name}: load.gravity_axis is [0, 0, 0], so that gravity cannot be turned by load.gravity_angle; "
            "give the axis of the base about which the machine is tilted, e.g. [1, 0, 0]."
        )


class AnswerInState(ImmutableAnswer):
    """A base of answers to a question that is asked of a machine in a state, which they keep as `state`.

    Tables, pictures and reports ask this state for what they need besides, and solve for nothing again.
    """

    state: MachineState

    @property
    def machine(self) -> Machine:
        """The machine at its pose, with its limits, loads and masses."""
        return self.state.machine
