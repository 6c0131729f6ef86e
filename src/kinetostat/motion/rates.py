"""The motion of a rigid machine: twists of platform and bodies, rates of joints and drives, and how they change.

A *motion* is a direction of the pose's coordinates, with its change while the machine really moves. If the direction is
the rates themselves, and its change their accelerations, twists are velocities and their changes are accelerations. If
it is the unit rate of one coordinate, a motion is a column of a Jacobian, with the change of this column along the real
motion. Over scalars; nothing here has a mass.

Source: theory (85)-(89). Units are those of `rigid`.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from kinetostat.algebra.jet import Jet
from kinetostat.algebra.scalar import Scalar, inner_product, sqrt, total
from kinetostat.algebra.screw import NO_MOTION, Twist
from kinetostat.algebra.solve import Row, dual_basis
from kinetostat.algebra.vector import Z_AXIS, ZERO, Displacement, Vector
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import ANGLES, POINT, placement_of
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, values, with_values
from kinetostat.motion.rigid import RigidLeg, RigidMachine


@dataclass(frozen=True)
class PoseRates:
    """A direction of the coordinates of the pose, and how it changes.

    Attributes:
        rates: rates of the coordinates by their names, 1/s times rad or m.
        change: rates of these rates, 1/s² times rad or m.
    """

    rates: Mapping[str, Scalar]
    change: Mapping[str, Scalar]


@dataclass(frozen=True)
class BodyMotion:
    """The motion of a body along a direction.

    Attributes:
        twist: its twist at the origin.
        change: the rate of that twist while the machine moves, at the same place in space.
    """

    twist: Twist
    change: Twist


@dataclass(frozen=True)
class LegMotion:
    """The motion of a leg along a direction.

    Attributes:
        rates: rates of its coordinates.
        change: change of these rates.
        bodies: for each k, the motion of the body that its first k motions carry.
        drift: the change of the twist of its end that comes from its screws, which move.
    """

    rates: Row
    change: Row
    bodies: tuple[BodyMotion, ...]
    drift: Twist


@dataclass(frozen=True)
class MachineMotion:
    """The motion of a machine along a direction.

    Attributes:
        platform: motion of the platform.
        legs: motion of each leg.
    """

    platform: BodyMotion
    legs: tuple[LegMotion, ...]


def bracket(carrying: Twist, screw: Twist) -> Twist:
    """Return the rate of a screw that a twist carries along, theory (86)."""
    return Twist(
        carrying.rotational.cross(screw.rotational),
        carrying.rotational.cross(screw.translational) + carrying.translational.cross(screw.rotational),
    )


def placed_platform(machine: Machine, direction: PoseRates, real_rates: PoseRates) -> Displacement:
    """Return the placement of the platform with its rates, where the pose says it wholly.

    Args:
        machine: the machine at its pose.
        direction: the first rates, and their change.
        real_rates: the second rates, with which the machine really moves.
    """
    numbers = values(machine)
    # Arrays and traced numbers do not take jets for operands, but jets without rates do.
    jets = {path: Jet(number) for path, number in numbers.items() if type(number) is not float}
    pose = {
        name: Jet(numbers[POSE + name], direction.rates[name], real_rates.rates[name], direction.change[name])
        for name in direction.rates
    }
    if machine.family.chains is not None:
        return placement_of(pose)
    return with_values(machine, jets | {POSE + name: jet for name, jet in pose.items()}).configure().platform


def platform_motion(machine: RigidMachine, placement: Displacement) -> BodyMotion:
    """Return the twist of the platform from its placement with rates, theory (85), and its change.

    With the columns c of the rotation, the angular velocity is half the sum of c x c'.
    """
    angular_velocity, angular_change = ZERO, ZERO
    for column in (placement.rotation.x, placement.rotation.y, placement.rotation.z):
        value, first, second, mixed = _parts(column)
        angular_velocity = angular_velocity + value.cross(first)
        angular_change = angular_change + second.cross(first) + value.cross(mixed)
    angular_velocity, angular_change = angular_velocity * 0.5, angular_change * 0.5
    shrink = 1.0 / machine.length
    point, first, second, mixed = _parts(placement.translation)
    arm = (machine.origin - point) * shrink
    velocity = first * shrink + angular_velocity.cross(arm)
    change = mixed * shrink + angular_change.cross(arm) - angular_velocity.cross(second * shrink)
    return BodyMotion(Twist(angular_velocity, velocity), Twist(angular_change, change))


def _parts(vector: Vector) -> list[Vector]:
    """Return value, first, second and mixed rate of a vector of jets."""
    parts = [c.parts if isinstance(c, Jet) else (c, 0.0, 0.0, 0.0) for c in vector.components()]
    return [Vector(*row) for row in zip(*parts, strict=True)]


def leg_motion(leg: RigidLeg, platform: BodyMotion, real_motion: LegMotion | None = None) -> LegMotion:
    """Return the motion of a leg that ends at the platform, theory (87) and (88).

    Args:
        leg: the leg.
        platform: the motion of the platform.
        real_motion: how the leg really moves, if that is not this motion itself.
    """
    rates = [_rate_by(row, platform.twist) for row in leg.rates_by_twist]
    twists = _sums_along(leg, leg.screws, rates)
    real_twists = twists if real_motion is None else [body.twist for body in real_motion.bodies]
    carried_screws = zip(real_twists, leg.screws, leg.coordinates, strict=False)  # one twist more, that of the end
    screw_rates = [bracket(twist, screw) if place >= 0 else NO_MOTION for twist, screw, place in carried_screws]
    drifts = _sums_along(leg, screw_rates, rates)
    to_follow = platform.change - drifts[-1]
    change = [_rate_by(row, to_follow) for row in leg.rates_by_twist]
    changes = [part + drift for part, drift in zip(_sums_along(leg, leg.screws, change), drifts, strict=True)]
    bodies = tuple(BodyMotion(*both) for both in zip(twists, changes, strict=True))
    return LegMotion(rates, change, bodies, drifts[-1])


def _sums_along(leg: RigidLeg, screws: Sequence[Twist], rates: Row) -> list[Twist]:
    """Return for each k the sum of the first k screws, each times the rate of its coordinate, if it has one."""
    sums = [NO_MOTION]
    for screw, place in zip(screws, leg.coordinates, strict=True):
        sums.append(sums[-1] + screw * rates[place] if place >= 0 else sums[-1])
    return sums


def _rate_by(row: Sequence[Scalar], twist: Twist) -> Scalar:
    """Return the rate of a coordinate by a twist, from the row that says so."""
    return inner_product(row, twist.components())


def machine_motion(
    machine: RigidMachine, platform: BodyMotion, real_motion: MachineMotion | None = None
) -> MachineMotion:
    """Return the motion of all legs with the platform; arguments as of `leg_motion`."""
    real_motions = [None] * len(machine.legs) if real_motion is None else real_motion.legs
    legs = [leg_motion(leg, platform, real) for leg, real in zip(machine.legs, real_motions, strict=True)]
    return MachineMotion(platform, tuple(legs))


def motion_from_rest(machine: RigidMachine, acceleration: Twist) -> MachineMotion:
    """Return the motion of a machine at rest that begins with an acceleration of the platform: no screw moves yet.

    Args:
        machine: the machine.
        acceleration: change of the platform's twist.
    """
    changes = [[_rate_by(row, acceleration) for row in leg.rates_by_twist] for leg in machine.legs]
    pairs = zip(machine.legs, changes, strict=True)
    legs = tuple(leg_from_rest(change, _sums_along(leg, leg.screws, change)) for leg, change in pairs)
    return MachineMotion(BodyMotion(NO_MOTION, acceleration), legs)


def leg_from_rest(change: Row, body_changes: Sequence[Twist]) -> LegMotion:
    """Return the motion of a leg at rest of whose coordinates and bodies only the accelerations are not zero."""
    bodies = tuple(BodyMotion(NO_MOTION, body_change) for body_change in body_changes)
    return LegMotion([0.0] * len(change), change, bodies, NO_MOTION)


@dataclass(frozen=True)
class Coordinates:
    """The coordinates of a pose that does not say where the platform is wholly; legs say the rest.

    Attributes:
        names: those of x, y, z and the angles that the pose has.
        arm: vector from the tool point to P, in units of the machine's length.
        axes: axes about which roll, pitch and yaw turn, theory (89).
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
    """Return the coordinates of a pose that has less than six, theory (89).

    Args:
        machine: the machine, to which its legs leave as many ways.
        names: names of the coordinates.
        placement: placement of the platform.
        angles: yaw and pitch of the platform.
    """
    yaw_cos, yaw_sin, pitch_cos, pitch_sin = angles
    shrink = 1.0 / pitch_cos
    axes = (Vector(yaw_cos * pitch_cos, yaw_sin * pitch_cos, -pitch_sin), Vector(-yaw_sin, yaw_cos, 0.0), Z_AXIS)
    rows = (
        Vector(yaw_cos * shrink, yaw_sin * shrink, 0.0),
        axes[1],
        Vector(yaw_cos * pitch_sin * shrink, yaw_sin * pitch_sin * shrink, 1.0),
    )
    arm = (placement.translation - machine.origin) * (1.0 / machine.length)
    rates_by_ways = [[_coordinate_rate(name, arm, rows, Twist.of(way)) for way in machine.ways] for name in names]
    dual, _ = dual_basis(rates_by_ways)
    unit_twists = [
        [total([share * way[i] for share, way in zip(shares, machine.ways, strict=True)]) for i in range(6)]
        for shares in dual
    ]
    return Coordinates(tuple(names), arm, axes, rows, tuple(unit_twists))


class Angles(NamedTuple):
    """Cosines and sines of yaw and pitch of Q = Rz(yaw) Ry(pitch) Rx(roll)."""

    yaw_cos: Scalar
    yaw_sin: Scalar
    pitch_cos: Scalar
    pitch_sin: Scalar


def angles_of(placement: Displacement) -> Angles:
    """Return yaw and pitch of a placement, whose pitch must not be a right angle."""
    x_axis = placement.rotation.x
    pitch_cos = sqrt(x_axis.x * x_axis.x + x_axis.y * x_axis.y)
    return Angles(x_axis.x / pitch_cos, x_axis.y / pitch_cos, pitch_cos, -x_axis.z)


def _coordinate_rate(name: str, arm: Vector, rows: Sequence[Vector], twist: Twist) -> Scalar:
    """Return the rate of a coordinate by a twist at the origin, lengths in units of the machine's."""
    if name in POINT:
        return getattr(twist.translational + twist.rotational.cross(arm), name)
    return rows[ANGLES.index(name)].dot(twist.rotational)


def motion_along(
    machine: RigidMachine, coordinates: Coordinates, direction: PoseRates, real_motion: MachineMotion | None = None
) -> MachineMotion:
    """Return the motion of a machine of less than six coordinates along a direction; arguments as of `leg_motion`.

    The platform's twist changes by what the legs force on it, and along the ways that they leave it by what remains of
    the change of the coordinates.
    """
    units = {name: (1.0 / machine.length if name in POINT else 1.0) for name in coordinates.names}
    twist = _combined_twist(
        coordinates.unit_twists, [direction.rates[name] * units[name] for name in coordinates.names]
    )
    forced = _forced_change(machine, machine_motion(machine, BodyMotion(twist, NO_MOTION), real_motion))
    real_twist = twist if real_motion is None else real_motion.platform.twist
    speed = real_twist.translational + real_twist.rotational.cross(coordinates.arm)
    axis_turning = _axis_turning(coordinates, twist, real_twist)
    remaining = []
    for name in coordinates.names:
        change = direction.change[name] * units[name]
        if name in POINT:
            change = change - getattr(twist.rotational.cross(speed), name)
        else:
            change = change + coordinates.rates_of_turns[ANGLES.index(name)].dot(axis_turning)
        remaining.append(change - _coordinate_rate(name, coordinates.arm, coordinates.rates_of_turns, forced))
    return machine_motion(
        machine, BodyMotion(twist, forced + _combined_twist(coordinates.unit_twists, remaining)), real_motion
    )


def _forced_change(machine: RigidMachine, motion: MachineMotion) -> Twist:
    """Return the change of the platform's twist that the drift of the legs' screws forces on it.

    It does not depend on how the platform's twist changes in this motion.
    """
    drifts = [
        inner_product(row, leg_motion.drift.components())
        for leg, leg_motion in zip(machine.legs, motion.legs, strict=True)
        for row in leg.constraints
    ]
    independent = [drifts[number] for number in machine.plan.independent]
    if not independent:
        return NO_MOTION
    return _combined_twist([list(row) for row in zip(*machine.constraint_twists, strict=True)], independent)


def _axis_turning(coordinates: Coordinates, twist: Twist, real_twist: Twist) -> Vector:
    """Return the part of an angular acceleration by which the axes of roll and pitch turn, theory (89)."""
    roll, pitch, _ = (row.dot(twist.rotational) for row in coordinates.rates_of_turns)
    _, real_pitch, real_yaw = (row.dot(real_twist.rotational) for row in coordinates.rates_of_turns)
    roll_axis, pitch_axis, yaw_axis = coordinates.axes
    turning = yaw_axis * real_yaw + pitch_axis * real_pitch
    return turning.cross(roll_axis) * roll + (yaw_axis * real_yaw).cross(pitch_axis) * pitch


def _combined_twist(rows: Sequence[Sequence[Scalar]], factors: Sequence[Scalar]) -> Twist:
    """Return the sum of rows of six, each times its factor, as a twist."""
    parts = [total([row[i] * factor for row, factor in zip(rows, factors, strict=True)]) for i in range(6)]
    return Twist.of(parts)
