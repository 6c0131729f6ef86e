"""A machine of rigid parts at a pose: motions of its legs as screws, the masses that they carry, and what closes them.

It is made of the mechanism of `equilibrium.mechanism` over scalars, which gives masses, friction and loads. Springs
stand still here, while joints and drives may move. Units are those of the mechanism: turns in rad, lengths in units of
the machine's length, forces in N, so that generalised forces of slides are in N, and moments in N times that length.
The origin is the tool point at the pose, and axes are those of the base. How fast parts move is computed in `rates`,
and the forces that this takes in `forces`.

Source: theory section 20, (85).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero, total
from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.algebra.solve import Row, right_inverse
from kinetostat.algebra.vector import Vector
from kinetostat.equilibrium.chains import ElasticLeg
from kinetostat.equilibrium.drives import rotor_turns
from kinetostat.equilibrium.masses import Masses
from kinetostat.equilibrium.mechanism import Mechanism, mechanism_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.machine.drives import numbers_of_drive
from kinetostat.machine.leg import Spring
from kinetostat.machine.loads import located_members
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.tolerances import DEPENDENT


@dataclass(frozen=True)
class MassPoint:
    """A mass of a leg or of the platform.

    Attributes:
        name: name of the part that it belongs to.
        carried: number of the motions of the leg that carry it.
        point: its place.
        mass: the mass, kg.
        alone: the part of the mass whose momentum is its own; the rest is coupled to the other half of a bar.
        tensor: rows of the inertia about the point; empty if there is none.
    """

    name: str
    carried: int
    point: Vector
    mass: Scalar
    alone: Scalar
    tensor: tuple[Vector, ...] = ()

    def spin(self, turning: Vector) -> Vector:
        """The inertia times an angular velocity or acceleration."""
        return Vector(*(row.dot(turning) for row in self.tensor))


@dataclass(frozen=True)
class RigidDrive:
    """A drive of a rigid machine.

    Attributes:
        spring: the spring of its actuator.
        turns: radians of the rotor per unit of its coordinate, rad per rad or per unit of length; 0 if it is not known.
        inertia, viscous, coulomb: inertia and friction of the rotor as the coordinate of the drive feels them.
        guide: Coulomb friction of the joint itself, behind screw or gear.
    """

    spring: Spring
    turns: Scalar
    inertia: Scalar
    viscous: Scalar
    coulomb: Scalar
    guide: Scalar = 0.0

    @property
    def slides(self) -> bool:
        """Whether it is linear."""
        return self.spring.joint.point is None


@dataclass(frozen=True)
class Friction:
    """Friction of a passive coordinate: per speed, and at any speed."""

    viscous: Scalar
    coulomb: Scalar


@dataclass(frozen=True)
class LegFreedoms:
    """The coordinates of a leg that move, and whether they follow the platform in one way.

    Attributes:
        kept: numbers of the passive coordinates of the mechanism's leg that move.
        spare: whether there are more coordinates than motions of the platform: their rates are then those of least
            norm.
        balls: places among those that are kept of the three turns of each ball joint.
    """

    kept: tuple[int, ...]
    spare: bool
    balls: tuple[tuple[int, int, int], ...] = ()


@dataclass(frozen=True)
class MotionPlan:
    """The form of the equations: the independent motions of a machine, found once at a pose with numbers.

    Attributes:
        legs: the freedoms of each leg.
        independent: numbers of those constraints of all legs that do not follow from the constraints before them.
        shared: whether there are more drives than motions.
    """

    legs: tuple[LegFreedoms, ...]
    independent: tuple[int, ...]
    shared: bool


@dataclass(frozen=True)
class RigidLeg:
    """A leg of rigid parts.

    Attributes:
        name: name of the leg.
        screws: screws of its motions in order from the base.
        follows: number of the coordinate that each motion follows; -1 for motions that stand still.
        drives: numbers of the machine's drives that move its last coordinates; passive coordinates come first.
        friction: friction of its passive coordinates.
        balls: places of the three passive coordinates of each ball joint.
        springs: load of the flexure hinge at each passive coordinate; 0 for other joints.
        solved: rates of its coordinates by the platform's twist, J+ [coordinates][6].
        against: wrenches by which it keeps the platform from moving whatever its drives do, N.
        masses: masses that it carries.
        pairs: pairs of masses that are the halves of a bar.
        ends: number of the motions that its first k elements make, for each k from 0 to all of them.
    """

    name: str
    screws: tuple[Twist, ...]
    follows: tuple[int, ...]
    drives: tuple[int, ...]
    friction: tuple[Friction, ...]
    balls: tuple[tuple[int, int, int], ...]
    springs: tuple[Scalar, ...]
    solved: tuple[Row, ...]
    against: tuple[Row, ...]
    masses: tuple[MassPoint, ...]
    pairs: tuple[tuple[int, int], ...]
    ends: tuple[int, ...]

    @property
    def passive(self) -> int:
        """Number of its passive coordinates."""
        return len(self.friction)


@dataclass(frozen=True)
class RigidMachine:
    """A machine of rigid parts at a pose.

    Attributes:
        legs: its legs.
        drives: its drives.
        platform: masses of platform, tool and payload.
        process: the wrench of all loads but weight on the platform, at the origin.
        gravity: acceleration of free fall, m/s².
        length: unit of length, m.
        origin: the tool point, base frame, m.
        ways: a basis of the twists that the legs allow, orthonormal; none where they allow all.
        following: the twist that the constraints of the legs demand, per unit of each of them [6][constraints].
        plan: the form by which it was made.
    """

    legs: tuple[RigidLeg, ...]
    drives: tuple[RigidDrive, ...]
    platform: tuple[MassPoint, ...]
    process: Wrench
    gravity: Vector
    length: Scalar
    origin: Vector
    ways: tuple[Row, ...]
    following: tuple[Row, ...]
    plan: MotionPlan


def mechanism_over_scalars(
    machine: Machine, configuration: Configuration, joints: Joints | None, masses: Sequence[Scalar] | None = None
) -> Mechanism:
    """Return the mechanism of a machine over scalars, which need not be floats, with forces in N.

    Args:
        machine: the machine at its pose.
        configuration: the machine placed at its pose.
        joints: coordinates that close its legs, if it is written leg by leg.
        masses: of its links, kg; those that they have at this pose if None.
    """
    members = located_members(machine, configuration, None if joints is None else joints.coordinates)
    if masses is not None:
        members = [replace(link, mass=mass) for link, mass in zip(members, masses, strict=True)]
    return mechanism_of(machine, configuration, joints, None, 1.0, members)


def masses_of_links(machine: Machine, configuration: Configuration) -> list[Scalar]:
    """The mass of each link at a pose, kg: a telescopic leg with a mass per length keeps what it has there."""
    return [link.mass for link in located_members(machine, configuration, None)]


def rigid_machine(machine: Machine, mechanism: Mechanism, plan: MotionPlan, origin: Vector) -> RigidMachine:
    """Make the rigid machine of a mechanism.

    Args:
        machine: with its tables.
        mechanism: over scalars, see `mechanism_over_scalars`.
        plan: which of its coordinates move.
        origin: the tool point, base frame, m.
    """
    drives = tuple(_drive(spring, machine, mechanism.length[0]) for spring in mechanism.driven)
    legs = tuple(
        _rigid_leg(leg, leg_plan, machine, mechanism) for leg, leg_plan in zip(mechanism.legs, plan.legs, strict=True)
    )
    against = [row for leg in legs for row in leg.against]
    chosen = [against[number] for number in plan.independent]
    ways: list[Row] = []
    following: list[Row] = []
    if chosen:
        following, ways, _ = right_inverse(chosen)
    process = Wrench(*_vectors(mechanism.wrench[0]))
    for point, force in zip(mechanism.pushed[0], mechanism.forces[0], strict=True):
        at, push = Vector(*point), Vector(*force)
        process = process + Wrench(at.cross(push), push)
    return RigidMachine(
        legs,
        drives,
        _mass_points(mechanism.platform, mechanism.length[0]),
        process,
        Vector(*mechanism.gravity[0]),
        mechanism.length[0],
        origin,
        tuple(ways),
        tuple(following),
        plan,
    )


def _vectors(components: Sequence[Scalar]) -> tuple[Vector, Vector]:
    return Vector(*components[:3]), Vector(*components[3:])


def _drive(spring: Spring, machine: Machine, length: Scalar) -> RigidDrive:
    numbers, slides = numbers_of_drive(machine, "drives", spring), spring.joint.point is None
    turns = rotor_turns(spring, numbers)
    here = turns * length if slides else turns  # per unit of the coordinate
    shrink = 1.0 / length
    square = here * here * shrink
    return RigidDrive(
        spring,
        here,
        square * numbers.rotor_inertia,
        square * numbers.rotor_damping,
        here * numbers.rotor_friction * shrink,
        numbers.guide_friction if slides else numbers.bearing_friction * shrink,
    )


def _mass_points(masses: Masses, length: Scalar) -> tuple[MassPoint, ...]:
    rows = []
    for number, name in enumerate(masses.names):
        xx, yy, zz, xy, xz, yz = (entry * length for entry in masses.inertia[0, number].tolist())
        still = all(is_zero(entry) for entry in (xx, yy, zz, xy, xz, yz))
        tensor = () if still else (Vector(xx, xy, xz), Vector(xy, yy, yz), Vector(xz, yz, zz))
        point = Vector(*masses.point[0, number].tolist())
        rows.append(
            MassPoint(name, masses.carried[number], point, masses.mass[0, number], masses.uncoupled[0, number], tensor)
        )
    return tuple(rows)


def _passive_coordinates(leg: ElasticLeg) -> list[int]:
    """Numbers of the coordinates that move without a drive: passive joints and flexure hinges."""
    passive = []
    for number, spring in enumerate(leg.springs):
        before = leg.springs[number - 1] if number else None
        again = before is not None and spring is not None and before.hinge and before.joint is spring.joint
        if spring is None or (spring.hinge and not again):
            passive.append(number)
    return passive


def _rigid_leg(leg: ElasticLeg, plan: LegFreedoms, machine: Machine, mechanism: Mechanism) -> RigidLeg:
    screws = tuple(Twist(*_vectors(row)) for row in leg.chain.twists[0].tolist())
    places, drives = _places(leg, plan.kept, len(mechanism.driven))
    size = len(plan.kept) + len(drives)
    columns = _columns(screws, places, size)
    solved, against = _following(columns, plan.spare)
    length, damping = mechanism.length[0], machine.tables["damping"]
    friction = []
    for number in plan.kept:
        turning = [i for i, place in enumerate(leg.chain.coordinate) if place == number]
        slides = all(screws[i].slides for i in turning)
        coulomb = damping.slide_friction if slides else damping.hinge_friction * (1.0 / length)
        if len(turning) > 1 and not slides:  # the bars of a parallelogram turn about both of their ends
            coulomb = coulomb * total([screws[i].rotational.norm() for i in turning])
        friction.append(Friction(leg.dampers[0, number] * length, coulomb))
    return RigidLeg(
        leg.name,
        screws,
        places,
        tuple(drives),
        tuple(friction),
        plan.balls,
        tuple(0.0 if leg.springs[n] is None else leg.preload[0, n] for n in plan.kept),
        tuple(solved),
        tuple(against),
        _mass_points(leg.masses, length),
        leg.masses.pairs,
        leg.ends,
    )


def _places(leg: ElasticLeg, kept: Sequence[int], drives: int) -> tuple[tuple[int, ...], list[int]]:
    """The coordinate that each motion of a leg follows, or -1, and the drives that its last coordinates are."""
    here = [given for given in leg.chain.given if 0 <= given < drives]
    order = {number: place for place, number in enumerate(kept)}
    driven = {given: len(kept) + place for place, given in enumerate(here)}
    places = [
        driven.get(given, -1) if coordinate < 0 else order.get(coordinate, -1)
        for coordinate, given in zip(leg.chain.coordinate, leg.chain.given, strict=True)
    ]
    return tuple(places), here


def _columns(screws: Sequence[Twist], places: Sequence[int], size: int) -> list[Row]:
    """The platform's twist per unit of each coordinate [size][6]."""
    rows = [[s.components() for s, p in zip(screws, places, strict=True) if p == k] for k in range(size)]
    return [[total(list(parts)) for parts in zip(*row, strict=True)] for row in rows]


def _following(columns: Sequence[Row], spare: bool) -> tuple[list[Row], list[Row]]:
    """J+ and N of a leg: rates of its coordinates by the platform's twist, and the wrenches that hold the platform."""
    if spare:
        solution, _, _ = right_inverse([list(row) for row in zip(*columns, strict=True)])
        return solution, []
    if not columns:
        return [], [[1.0 if i == j else 0.0 for i in range(6)] for j in range(6)]
    solution, against, _ = right_inverse(columns)
    return [list(row) for row in zip(*solution, strict=True)], against


def plan_of(machine: Machine, configuration: Configuration, joints: Joints | None) -> MotionPlan:
    """Decide, at a pose with numbers, which motions there are; arguments as of `mechanism_over_scalars`."""
    with np.errstate(all="ignore"):
        return _plan_of(mechanism_over_scalars(machine, configuration, joints))


def _plan_of(mechanism: Mechanism) -> MotionPlan:
    legs, against = [], []
    for leg in mechanism.legs:
        passive = _passive_coordinates(leg)
        screws = [Twist(*_vectors(row)) for row in leg.chain.twists[0].tolist()]
        while True:
            places, drives = _places(leg, passive, len(mechanism.driven))
            columns = _columns(screws, places, len(passive) + len(drives))
            matrix = np.array(columns, dtype=float).reshape(-1, 6)
            _, sizes, rows = np.linalg.svd(matrix.T)
            rank = int((sizes > DEPENDENT * max(sizes.max(initial=0.0), 1.0)).sum())
            if rank == len(columns) or rank == 6:
                break
            # Of motions that depend on each other, the passive one that the rest replaces best stands still.
            idle = np.abs(rows[rank:, : len(passive)]).max(axis=0)
            passive.pop(len(passive) - 1 - int(np.argmax(idle[::-1] > idle.max() - DEPENDENT)))
        spare = len(columns) > rank
        legs.append(LegFreedoms(tuple(passive), spare, _balls(screws, places, len(passive))))
        against += _following(columns, spare)[1]
    independent: list[int] = []
    basis = np.zeros((0, 6))
    for number, row in enumerate(against):
        left = np.array(row, dtype=float)
        left = left - basis.T @ (basis @ left)
        left = left - basis.T @ (basis @ left)
        size = float(np.linalg.norm(left))
        if size > DEPENDENT:
            independent.append(number)
            basis = np.vstack([basis, left / size])
    shared = len(mechanism.driven) > 6 - len(independent)
    return MotionPlan(tuple(legs), tuple(independent), shared)


def _balls(screws: Sequence[Twist], places: Sequence[int], passive: int) -> tuple[tuple[int, int, int], ...]:
    """Find the ball joints: three passive coordinates in a row whose axes meet in one point and span the space."""
    motions = [[i for i, place in enumerate(places) if place == k] for k in range(passive)]
    turns = [row[0] if len(row) == 1 and not screws[row[0]].slides else None for row in motions]
    result, first = [], 0
    while first + 3 <= passive:
        row = turns[first : first + 3]
        together = None not in row and [row[0] + k for k in range(3)] == row  # type: ignore[operator]
        if together and _about_one_point([screws[i] for i in row if i is not None]):
            result.append((first, first + 1, first + 2))
            first += 2
        first += 1
    return tuple(result)


def _about_one_point(screws: Sequence[Twist]) -> bool:
    axes = np.array([screw.rotational.components() for screw in screws], dtype=float)
    moments = np.array([screw.translational.components() for screw in screws], dtype=float)
    if abs(np.linalg.det(axes)) < DEPENDENT:
        return False
    # v = point x axis for all three: six equations for three numbers.
    crossed = np.concatenate([-np.cross(axis, np.eye(3)).T for axis in axes])
    point, *_ = np.linalg.lstsq(crossed, moments.ravel(), rcond=None)
    return bool(np.abs(crossed @ point - moments.ravel()).max() < DEPENDENT)
