"""A machine of rigid parts at a pose: motions of its legs as screws, the masses that they carry, and what closes them.

It is made from the mechanism of `equilibrium.mechanism` over scalars, which has masses, friction and loads. Springs do
not deflect here; joints and drives may move. Units are those of the mechanism: rotations in rad, lengths in units of
the machine's length, forces in N, so that generalised forces of slides are in N, and moments in N times that length.
The origin is the tool point at the pose, and axes are those of the base. Velocities of the parts are computed in
`rates`, and the forces that a motion takes in `forces`.

Source: theory section 20, (85).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero, total
from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.algebra.solve import Row, identity, right_inverse
from kinetostat.algebra.symmetric import SIZE
from kinetostat.algebra.vector import Vector
from kinetostat.equilibrium.elastic_legs import ElasticLeg, Masses
from kinetostat.equilibrium.mechanism import Mechanism, mechanism_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.machine.actuators import numbers_of_drive, rotor_turns
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
        uncoupled: the part of the mass that has a momentum of its own; the rest is coupled to the other half of a bar.
        tensor: rows of the inertia about the point; empty if there is none.
    """

    name: str
    carried: int
    point: Vector
    mass: Scalar
    uncoupled: Scalar
    tensor: tuple[Vector, ...] = ()

    def spin(self, turning: Vector) -> Vector:
        """The inertia times an angular velocity or acceleration."""
        return Vector(*(row.dot(turning) for row in self.tensor))


@dataclass(frozen=True)
class RigidDrive:
    """A drive of a rigid machine.

    Attributes:
        spring: the spring of its actuator.
        turns: rotation of the rotor per unit of the drive's coordinate, rad per rad or per unit of length; 0 if it is
            not known.
        inertia, viscous, coulomb: inertia, viscous and Coulomb friction of the rotor, taken to the drive's coordinate.
        guide_friction: Coulomb friction of the joint itself, behind screw or gear.
    """

    spring: Spring
    turns: Scalar
    inertia: Scalar
    viscous: Scalar
    coulomb: Scalar
    guide_friction: Scalar = 0.0

    @property
    def slides(self) -> bool:
        """Whether it is linear."""
        return self.spring.joint.point is None


@dataclass(frozen=True)
class Friction:
    """Friction of a passive coordinate: viscous, in proportion to its speed, and Coulomb friction, at any speed."""

    viscous: Scalar
    coulomb: Scalar


@dataclass(frozen=True)
class LegFreedoms:
    """The coordinates of a leg that move, and whether the platform's motion determines their rates.

    Attributes:
        moving: numbers of those passive coordinates of the mechanism's leg that move; the others stand still.
        redundant: whether the leg has more moving coordinates than the platform has motions by them, so that the rates
            are those of least norm.
        balls: places among the moving coordinates of the three rotations of each ball joint.
    """

    moving: tuple[int, ...]
    redundant: bool
    balls: tuple[tuple[int, int, int], ...] = ()


@dataclass(frozen=True)
class MotionPlan:
    """The form of the equations: the independent motions of a machine, found once at a pose with numbers.

    Attributes:
        legs: the freedoms of each leg.
        independent: numbers of those constraints of all legs that do not follow from the constraints before them.
        overactuated: whether there are more drives than motions.
    """

    legs: tuple[LegFreedoms, ...]
    independent: tuple[int, ...]
    overactuated: bool


@dataclass(frozen=True)
class RigidLeg:
    """A leg of rigid parts.

    Attributes:
        name: name of the leg.
        screws: screws of its motions in order from the base.
        coordinates: number of the coordinate by which each motion moves; -1 for motions that stand still.
        drives: numbers of the machine's drives that move its last coordinates; passive coordinates come first.
        friction: friction of its passive coordinates.
        balls: places of the three passive coordinates of each ball joint.
        springs: load of the flexure hinge at each passive coordinate; 0 for other joints.
        rates_by_twist: rates of its coordinates per component of the platform's twist, J+ [coordinates][6].
        constraints: wrenches by which it keeps the platform from moving whatever its drives do, N [constraints][6].
        masses: masses that it carries.
        pairs: pairs of masses that are the halves of a bar.
        ends: number of motions of its first k elements, for each k from 0 to all of them.
    """

    name: str
    screws: tuple[Twist, ...]
    coordinates: tuple[int, ...]
    drives: tuple[int, ...]
    friction: tuple[Friction, ...]
    balls: tuple[tuple[int, int, int], ...]
    springs: tuple[Scalar, ...]
    rates_by_twist: tuple[Row, ...]
    constraints: tuple[Row, ...]
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
        ways: an orthonormal basis of the twists that the legs allow; empty where they allow all.
        constraint_twists: the twist of the platform per unit of what each independent constraint demands
            [6][constraints].
        plan: its independent motions, with which it was made.
    """

    legs: tuple[RigidLeg, ...]
    drives: tuple[RigidDrive, ...]
    platform: tuple[MassPoint, ...]
    process: Wrench
    gravity: Vector
    length: Scalar
    origin: Vector
    ways: tuple[Row, ...]
    constraint_twists: tuple[Row, ...]
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
    """Return the mass of each link at a pose, kg: a telescopic leg with a mass per length keeps it in motion."""
    return [link.mass for link in located_members(machine, configuration, None)]


def rigid_machine(machine: Machine, mechanism: Mechanism, plan: MotionPlan, origin: Vector) -> RigidMachine:
    """Make the rigid machine of a mechanism.

    Args:
        machine: the machine with its tables.
        mechanism: the mechanism over scalars, see `mechanism_over_scalars`.
        plan: the motions that there are.
        origin: the tool point, base frame, m.
    """
    drives = tuple(_drive(spring, machine, mechanism.length[0]) for spring in mechanism.driven)
    legs = tuple(
        _rigid_leg(leg, leg_plan, machine, mechanism) for leg, leg_plan in zip(mechanism.legs, plan.legs, strict=True)
    )
    constraints = [row for leg in legs for row in leg.constraints]
    independent = [constraints[number] for number in plan.independent]
    ways: list[Row] = []
    constraint_twists: list[Row] = []
    if independent:
        constraint_twists, ways, _ = right_inverse(independent)
    process = Wrench.of(mechanism.wrench[0])
    for point, force in zip(mechanism.pushed[0], mechanism.forces[0], strict=True):
        vector = Vector(*force)
        process = process + Wrench(Vector(*point).cross(vector), vector)
    return RigidMachine(
        legs=legs,
        drives=drives,
        platform=_mass_points(mechanism.platform, mechanism.length[0]),
        process=process,
        gravity=Vector(*mechanism.gravity[0]),
        length=mechanism.length[0],
        origin=origin,
        ways=tuple(ways),
        constraint_twists=tuple(constraint_twists),
        plan=plan,
    )


def _drive(spring: Spring, machine: Machine, length: Scalar) -> RigidDrive:
    """Read the drive of an actuator; forces of slides are in N, and moments in N times the length."""
    numbers, slides = numbers_of_drive(machine, "drives", spring), spring.joint.point is None
    turns = rotor_turns(spring, numbers)
    turns = turns * length if slides else turns  # coordinates of slides are in units of the length
    shrink = 1.0 / length
    square = turns * turns * shrink
    return RigidDrive(
        spring=spring,
        turns=turns,
        inertia=square * numbers.rotor_inertia,
        viscous=square * numbers.rotor_damping,
        coulomb=turns * numbers.rotor_friction * shrink,
        guide_friction=numbers.guide_friction if slides else numbers.bearing_friction * shrink,
    )


def _mass_points(masses: Masses, length: Scalar) -> tuple[MassPoint, ...]:
    """Take masses apart, point by point, with their inertia in kg times the length, m."""
    points = []
    for number, name in enumerate(masses.names):
        xx, yy, zz, xy, xz, yz = (entry * length for entry in masses.inertia[0, number].tolist())
        without_inertia = all(is_zero(entry) for entry in (xx, yy, zz, xy, xz, yz))
        points.append(
            MassPoint(
                name=name,
                carried=masses.carried[number],
                point=Vector(*masses.point[0, number].tolist()),
                mass=masses.mass[0, number],
                uncoupled=masses.uncoupled[0, number],
                tensor=() if without_inertia else (Vector(xx, xy, xz), Vector(xy, yy, yz), Vector(xz, yz, zz)),
            )
        )
    return tuple(points)


def _passive_coordinates(leg: ElasticLeg) -> list[int]:
    """Return numbers of the coordinates that move without a drive: passive joints and flexure hinges."""
    passive = []
    for number, spring in enumerate(leg.springs):
        before = leg.springs[number - 1] if number else None
        # A hinge with several springs about the same joint is one coordinate, that of the first spring.
        same_hinge = before is not None and spring is not None and before.hinge and before.joint is spring.joint
        if spring is None or (spring.hinge and not same_hinge):
            passive.append(number)
    return passive


def _rigid_leg(leg: ElasticLeg, plan: LegFreedoms, machine: Machine, mechanism: Mechanism) -> RigidLeg:
    """Make the rigid leg of a leg of the mechanism, with the freedoms that the plan gives it."""
    screws = tuple(Twist.of(row) for row in leg.chain.twists[0].tolist())
    coordinates, drives = _coordinates_of_motions(leg, plan.moving, len(mechanism.driven))
    columns = _jacobian_columns(screws, coordinates, len(plan.moving) + len(drives))
    rates_by_twist, constraints = _rates_and_constraints(columns, plan.redundant)
    length = mechanism.length[0]
    return RigidLeg(
        name=leg.name,
        screws=screws,
        coordinates=coordinates,
        drives=tuple(drives),
        friction=tuple(_friction(leg, number, screws, machine, length) for number in plan.moving),
        balls=plan.balls,
        springs=tuple(0.0 if leg.springs[n] is None else leg.preload[0, n] for n in plan.moving),
        rates_by_twist=tuple(rates_by_twist),
        constraints=tuple(constraints),
        masses=_mass_points(leg.masses, length),
        pairs=leg.masses.pairs,
        ends=leg.motion_counts,
    )


def _friction(leg: ElasticLeg, number: int, screws: Sequence[Twist], machine: Machine, length: Scalar) -> Friction:
    """Return the friction of the coordinate with this number of a leg with these screws."""
    damping = machine.tables["damping"]
    motions = [i for i, coordinate in enumerate(leg.chain.coordinate) if coordinate == number]
    slides = all(screws[i].is_translation for i in motions)
    coulomb = damping.slide_friction if slides else damping.hinge_friction * (1.0 / length)
    if len(motions) > 1 and not slides:  # the bars of a parallelogram turn about both of their ends
        coulomb = coulomb * total([screws[i].rotational.norm() for i in motions])
    return Friction(leg.dampers[0, number] * length, coulomb)


def _coordinates_of_motions(leg: ElasticLeg, moving: Sequence[int], drives: int) -> tuple[tuple[int, ...], list[int]]:
    """Return the coordinate by which each motion of a leg moves, or -1, and the drives that its last coordinates are.

    Args:
        leg: the leg.
        moving: numbers of its passive coordinates that move.
        drives: number of drives of the machine; amounts beyond them are growth by warmth, which does not move.
    """
    drives_of_leg = [amount for amount in leg.chain.given if 0 <= amount < drives]
    place_of_passive = {number: place for place, number in enumerate(moving)}
    place_of_drive = {drive: len(moving) + place for place, drive in enumerate(drives_of_leg)}
    coordinates = [
        place_of_drive.get(amount, -1) if coordinate < 0 else place_of_passive.get(coordinate, -1)
        for coordinate, amount in zip(leg.chain.coordinate, leg.chain.given, strict=True)
    ]
    return tuple(coordinates), drives_of_leg


def _jacobian_columns(screws: Sequence[Twist], coordinates: Sequence[int], size: int) -> list[Row]:
    """Return the platform's twist per unit of each coordinate, the columns of J [size][6]."""
    rows = [[s.components() for s, c in zip(screws, coordinates, strict=True) if c == k] for k in range(size)]
    return [[total(list(parts)) for parts in zip(*row, strict=True)] for row in rows]


def _rates_and_constraints(columns: Sequence[Row], redundant: bool) -> tuple[list[Row], list[Row]]:
    """Return J+ and N: rates of a leg's coordinates by the platform's twist, and wrenches that hold the platform."""
    if redundant:
        solution, _, _ = right_inverse([list(row) for row in zip(*columns, strict=True)])
        return solution, []
    if not columns:
        return [], identity(SIZE)
    solution, constraints, _ = right_inverse(columns)
    return [list(row) for row in zip(*solution, strict=True)], constraints


def plan_of(machine: Machine, configuration: Configuration, joints: Joints | None) -> MotionPlan:
    """Find the motions that there are, at a pose with numbers; arguments as of `mechanism_over_scalars`."""
    with np.errstate(all="ignore"):
        mechanism = mechanism_over_scalars(machine, configuration, joints)
        legs, constraints = [], []
        for leg in mechanism.legs:
            freedoms, rows = _freedoms_of(leg, len(mechanism.driven))
            legs.append(freedoms)
            constraints += rows
        independent = _independent_numbers(constraints)
    return MotionPlan(tuple(legs), independent, overactuated=len(mechanism.driven) > 6 - len(independent))


def _freedoms_of(leg: ElasticLeg, drives: int) -> tuple[LegFreedoms, list[Row]]:
    """Return the freedoms of a leg of a machine with so many drives, and the wrenches that hold the platform."""
    passive = _passive_coordinates(leg)
    screws = [Twist.of(row) for row in leg.chain.twists[0].tolist()]
    while True:
        coordinates, drives_of_leg = _coordinates_of_motions(leg, passive, drives)
        columns = _jacobian_columns(screws, coordinates, len(passive) + len(drives_of_leg))
        matrix = np.array(columns, dtype=float).reshape(-1, 6)
        _, sizes, dependences = np.linalg.svd(matrix.T)
        rank = int((sizes > DEPENDENT * max(sizes.max(initial=0.0), 1.0)).sum())
        if rank == len(columns) or rank == 6:
            break
        # Of motions that depend on each other, the passive one that the others replace best stands still; of equal
        # ones the last.
        shares = np.abs(dependences[rank:, : len(passive)]).max(axis=0)
        passive.pop(int(np.flatnonzero(shares > shares.max() - DEPENDENT)[-1]))
    redundant = len(columns) > rank
    freedoms = LegFreedoms(tuple(passive), redundant, _balls(screws, coordinates, len(passive)))
    return freedoms, _rates_and_constraints(columns, redundant)[1]


def _independent_numbers(constraints: Sequence[Row]) -> tuple[int, ...]:
    """Return numbers of the wrenches that do not depend on those before them."""
    independent: list[int] = []
    basis = np.zeros((0, 6))
    for number, row in enumerate(constraints):
        remainder = np.array(row, dtype=float)
        for _ in range(2):  # the second time takes away what round-off has left of the first
            remainder = remainder - basis.T @ (basis @ remainder)
        size = float(np.linalg.norm(remainder))
        if size > DEPENDENT:
            independent.append(number)
            basis = np.vstack([basis, remainder / size])
    return tuple(independent)


def _balls(screws: Sequence[Twist], coordinates: Sequence[int], passive: int) -> tuple[tuple[int, int, int], ...]:
    """Find the ball joints: three passive coordinates in a row whose axes meet in one point and span the space."""
    motions = [[i for i, coordinate in enumerate(coordinates) if coordinate == k] for k in range(passive)]
    result, first = [], 0
    while first + 3 <= passive:
        numbers = [number for row in motions[first : first + 3] for number in row]
        is_row_of_turns = numbers == [numbers[0] + k for k in range(3)] and not any(
            screws[i].is_translation for i in numbers
        )
        if is_row_of_turns and _meet_in_a_point([screws[i] for i in numbers]):
            result.append((first, first + 1, first + 2))
            first += 2
        first += 1
    return tuple(result)


def _meet_in_a_point(screws: Sequence[Twist]) -> bool:
    """Tell whether the axes of three turns span the space and meet in a point."""
    axes = np.array([screw.rotational.components() for screw in screws], dtype=float)
    moments = np.array([screw.translational.components() for screw in screws], dtype=float)
    if abs(np.linalg.det(axes)) < DEPENDENT:
        return False
    # v = point x axis for all three: six equations for three numbers.
    crossed = np.concatenate([-np.cross(axis, np.eye(3)).T for axis in axes])
    point, *_ = np.linalg.lstsq(crossed, moments.ravel(), rcond=None)
    return bool(np.abs(crossed @ point - moments.ravel()).max() < DEPENDENT)
