"""The motion of a rigid machine: twists of platform and bodies, rates of joints and drives, and how they change.

A *motion* is a direction of the pose's coordinates, with its change while the machine moves: with the rates themselves
and their accelerations, what comes out are velocities and accelerations. With one coordinate's unit rate it is a column
of a Jacobian and how this changes along the machine's motion. Over scalars; nothing here has a mass.

Source: theory (85)-(89). Units are those of `rigid`.
"""

from collections.abc import Mapping, Sequence

from kinetostat.algebra.jet import Jet
from kinetostat.algebra.scalar import Scalar, sqrt, total
from kinetostat.algebra.screw import Twist
from kinetostat.algebra.solve import Row, dual_basis
from kinetostat.algebra.vector import Z_AXIS, ZERO, Displacement, Vector
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import ANGLES, POINT, placement_of
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, values, with_values
from kinetostat.motion.rigid import RigidLeg, RigidMachine

STILL = Twist(ZERO, ZERO)


@dataclass(frozen=True)
class PoseRates:
    """A direction of the coordinates of the pose, and how it changes.

    Attributes:
        rates: by name of the coordinate, 1/s times rad or m.
        change: the rates of these, 1/s² times rad or m.
    """

    rates: Mapping[str, Scalar]
    change: Mapping[str, Scalar]


@dataclass(frozen=True)
class Moving:
    """The motion of something along a direction.

    Attributes:
        twist: at the origin.
        change: the rate of that twist while the machine moves, at the same place in space.
    """

    twist: Twist
    change: Twist


@dataclass(frozen=True)
class LegMotion:
    """The motion of a leg along a direction.

    Attributes:
        rates: of its coordinates.
        change: of these.
        bodies: the motion of what each number of its motions carries.
        drift: how the twist of its end changes because its screws move.
    """

    rates: Row
    change: Row
    bodies: tuple[Moving, ...]
    drift: Twist


@dataclass(frozen=True)
class MachineMotion:
    """The motion of a machine along a direction.

    Attributes:
        platform: of the platform.
        legs: of each leg.
    """

    platform: Moving
    legs: tuple[LegMotion, ...]


def bracket(carrying: Twist, screw: Twist) -> Twist:
    """The rate of a screw that a twist carries along, theory (86)."""
    return Twist(
        carrying.rotational.cross(screw.rotational),
        carrying.rotational.cross(screw.translational) + carrying.translational.cross(screw.rotational),
    )


def placed_platform(machine: Machine, direction: PoseRates, moving: PoseRates) -> Displacement:
    """The placement of the platform with its rates: of a pose that says it wholly.

    Args:
        machine: at its pose.
        direction: the first rates, and how these change.
        moving: how the machine moves.
    """
    given = values(machine)
    jets = {path: Jet(number) for path, number in given.items() if type(number) is not float}
    pose = {
        name: Jet(given[POSE + name], direction.rates[name], moving.rates[name], direction.change[name])
        for name in direction.rates
    }
    if machine.family.chains is not None:
        return placement_of(pose)
    return with_values(machine, jets | {POSE + name: jet for name, jet in pose.items()}).configure().platform


def platform_motion(machine: RigidMachine, placement: Displacement) -> Moving:
    """The twist of the platform from its placement with rates, theory (85), and how it changes.

    With the columns c of the rotation, the angular velocity is half the sum of c x c'.
    """
    turning, change = ZERO, ZERO
    for column in (placement.rotation.x, placement.rotation.y, placement.rotation.z):
        value, first, second, mixed = _parts(column)
        turning = turning + value.cross(first)
        change = change + second.cross(first) + value.cross(mixed)
    turning, change = turning * 0.5, change * 0.5
    shrink = 1.0 / machine.length
    at, first, second, mixed = _parts(placement.translation)
    arm = (machine.origin - at) * shrink
    moving = first * shrink + turning.cross(arm)
    moved = mixed * shrink + change.cross(arm) - turning.cross(second * shrink)
    return Moving(Twist(turning, moving), Twist(change, moved))


def _parts(vector: Vector) -> list[Vector]:
    """Value, first, second and mixed rate of a vector of jets."""
    parts = [c.parts if isinstance(c, Jet) else (c, 0.0, 0.0, 0.0) for c in vector.components()]
    return [Vector(*row) for row in zip(*parts, strict=True)]


def leg_motion(leg: RigidLeg, platform: Moving, along: "LegMotion | None" = None) -> LegMotion:
    """The motion of a leg that ends at the platform, theory (87) and (88).

    Args:
        leg: the leg.
        platform: the motion of the platform.
        along: how the leg moves, if that is not this motion itself.
    """
    rates = [_product(row, platform.twist) for row in leg.rates_by_twist]
    carried, bent = [STILL], [STILL]
    for screw, place in zip(leg.screws, leg.coordinates, strict=True):
        carried.append(carried[-1] + screw * rates[place] if place >= 0 else carried[-1])
    moving = carried if along is None else [body.twist for body in along.bodies]
    for number, (screw, place) in enumerate(zip(leg.screws, leg.coordinates, strict=True)):
        bent.append(bent[-1] + bracket(moving[number], screw) * rates[place] if place >= 0 else bent[-1])
    left = platform.change - bent[-1]
    change = [_product(row, left) for row in leg.rates_by_twist]
    changes, grown = [STILL], STILL
    for number, (screw, place) in enumerate(zip(leg.screws, leg.coordinates, strict=True), 1):
        grown = grown + screw * change[place] if place >= 0 else grown
        changes.append(grown + bent[number])
    bodies = tuple(Moving(twist, changed) for twist, changed in zip(carried, changes, strict=True))
    return LegMotion(rates, change, bodies, bent[-1])


def _product(row: Sequence[Scalar], twist: Twist) -> Scalar:
    return total([a * b for a, b in zip(row, twist.components(), strict=True)])


def machine_motion(machine: RigidMachine, platform: Moving, along: MachineMotion | None = None) -> MachineMotion:
    """The motion of all legs with the platform; `along` as in `leg_motion`."""
    moving = [None] * len(machine.legs) if along is None else along.legs
    legs = [leg_motion(leg, platform, there) for leg, there in zip(machine.legs, moving, strict=True)]
    return MachineMotion(platform, tuple(legs))


@dataclass(frozen=True)
class Coordinates:
    """The coordinates of a pose that does not say where the platform is wholly; legs say the rest.

    Attributes:
        names: x, y, z and angles that are given.
        arm: from the tool point to P, in units of the machine's length.
        axes: about which roll, pitch and yaw turn, theory (89).
        rates_of_turns: rows that take an angular velocity to the rates of roll, pitch and yaw.
        unit_twists: the twist of the platform at a unit rate of each coordinate alone [coordinates][6].
    """

    names: tuple[str, ...]
    arm: Vector
    axes: tuple[Vector, Vector, Vector]
    rates_of_turns: tuple[Vector, Vector, Vector]
    unit_twists: tuple[Row, ...]


def coordinates_of(
    machine: RigidMachine, names: Sequence[str], placement: Displacement, angles: "Angles"
) -> Coordinates:
    """The coordinates of a pose of less than six, theory (89).

    Args:
        machine: whose legs leave it as many ways.
        names: of the coordinates.
        placement: of the platform.
        angles: its yaw and pitch.
    """
    (yaw_cos, yaw_sin), (pitch_cos, pitch_sin) = angles
    shrink = 1.0 / pitch_cos
    axes = (
        Vector(yaw_cos * pitch_cos, yaw_sin * pitch_cos, -pitch_sin),
        Vector(-yaw_sin, yaw_cos, 0.0),
        Z_AXIS,
    )
    rows = (
        Vector(yaw_cos * shrink, yaw_sin * shrink, 0.0),
        axes[1],
        Vector(yaw_cos * pitch_sin * shrink, yaw_sin * pitch_sin * shrink, 1.0),
    )
    arm = (placement.translation - machine.origin) * (1.0 / machine.length)
    # A row of the rates by the platform's twist, over the ways that the legs leave.
    felt = [
        [_coordinate_rate(name, arm, rows, Twist(Vector(*w[:3]), Vector(*w[3:]))) for w in machine.ways]
        for name in names
    ]
    dual, _ = dual_basis(felt)
    unit_twists = [
        [total([share * way[i] for share, way in zip(shares, machine.ways, strict=True)]) for i in range(6)]
        for shares in dual
    ]
    return Coordinates(tuple(names), arm, axes, rows, tuple(unit_twists))


Angles = tuple[tuple[Scalar, Scalar], tuple[Scalar, Scalar]]
"""Cosine and sine of yaw and of pitch."""


def angles_of(placement: Displacement) -> Angles:
    """Cosine and sine of yaw and pitch of Q = Rz(yaw) Ry(pitch) Rx(roll)."""
    turn = placement.rotation
    flat = sqrt(turn.x.x * turn.x.x + turn.x.y * turn.x.y)
    return (turn.x.x / flat, turn.x.y / flat), (flat, -turn.x.z)


def _coordinate_rate(name: str, arm: Vector, rows: Sequence[Vector], twist: Twist) -> Scalar:
    """The rate of a coordinate by a twist at the origin, lengths in units of the machine's."""
    if name in POINT:
        return getattr(twist.translational + twist.rotational.cross(arm), name)
    return rows[ANGLES.index(name)].dot(twist.rotational)


def motion_along(
    machine: RigidMachine, coordinates: Coordinates, direction: PoseRates, along: MachineMotion | None = None
) -> MachineMotion:
    """The motion of a machine of less than six coordinates along a direction; `along` as in `leg_motion`."""
    units = {name: (1.0 / machine.length if name in POINT else 1.0) for name in coordinates.names}
    twist = _sum(coordinates.unit_twists, [direction.rates[name] * units[name] for name in coordinates.names])
    # What the legs ask for does not depend on how the platform's twist changes.
    still = machine_motion(machine, Moving(twist, STILL), along)
    needed = [
        total([a * b for a, b in zip(row, motion.drift.components(), strict=True)])
        for leg, motion in zip(machine.legs, still.legs, strict=True)
        for row in leg.constraints
    ]
    chosen = [needed[number] for number in machine.plan.independent]
    forced = Twist(ZERO, ZERO)
    if chosen:
        forced = _sum([list(row) for row in zip(*machine.constraint_twists, strict=True)], chosen)
    moving = twist if along is None else along.platform.twist
    speed = moving.translational + moving.rotational.cross(coordinates.arm)
    lags = []
    for name in coordinates.names:
        wanted = direction.change[name] * units[name]
        if name in POINT:
            wanted = wanted - getattr(twist.rotational.cross(speed), name)
        else:
            turned = _turning_axes(coordinates, twist, moving)
            wanted = wanted + coordinates.rates_of_turns[ANGLES.index(name)].dot(turned)
        lags.append(wanted - _coordinate_rate(name, coordinates.arm, coordinates.rates_of_turns, forced))
    return machine_motion(machine, Moving(twist, forced + _sum(coordinates.unit_twists, lags)), along)


def _turning_axes(coordinates: Coordinates, twist: Twist, moving: Twist) -> Vector:
    """The part of an angular acceleration by which the axes of roll and pitch turn, theory (89)."""
    roll, pitch, _ = (row.dot(twist.rotational) for row in coordinates.rates_of_turns)
    _, pitching, yawing = (row.dot(moving.rotational) for row in coordinates.rates_of_turns)
    first, second, third = coordinates.axes
    turning = third * yawing + second * pitching
    return turning.cross(first) * roll + (third * yawing).cross(second) * pitch


def _sum(rows: Sequence[Sequence[Scalar]], factors: Sequence[Scalar]) -> Twist:
    """The sum of rows of six, each times its factor, as a twist."""
    parts = [total([row[i] * factor for row, factor in zip(rows, factors, strict=True)]) for i in range(6)]
    return Twist(Vector(*parts[:3]), Vector(*parts[3:]))
