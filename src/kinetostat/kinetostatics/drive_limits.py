"""Limits of drives as a machine file gives them, with the lost motion and the compliance of their joints.

What drives can do within them is in `feasible`. Over scalars.
"""

import math

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal, smaller, where
from kinetostat.frozen import dataclass
from kinetostat.machine.actuators import numbers_of_drive
from kinetostat.machine.common_tables import Drives, ServoGains
from kinetostat.machine.leg import Spring
from kinetostat.machine.limits import is_set
from kinetostat.machine.machine import Configuration, Machine


@dataclass(frozen=True)
class DriveLimits:
    """Loads and speed that a drive may have, and how exactly its joint follows it.

    Attributes:
        spring: the spring of its actuator.
        lower, upper: least and greatest load, N or N·m: positive in the sense in which the actuator's joint is pulled
            open; infinite if not limited.
        speed: greatest speed of the actuator, either way, m/s or rad/s; infinite if not limited.
        lost_motion: what its joint misses between both senses of motion, m or rad, theory (105).
        compliance: compliance of its joint at rest, with its servo loop if it has one, m/N or rad/(N·m).
    """

    spring: Spring
    lower: Scalar
    upper: Scalar
    speed: Scalar
    lost_motion: Scalar = 0.0
    compliance: Scalar = 0.0


def drive_limits(machine: Machine, configuration: Configuration) -> tuple[DriveLimits, ...]:
    """Return what a machine file lets its drives do, in the order of the actuators that hold something.

    Loads are those of [limits]; where an actuator only pulls or only pushes, the tensions of [load] bound it as well.
    """
    limits, drives = machine.tables["limits"], []
    for spring in driven_springs(configuration):
        lower, upper = _load_bounds(machine, spring)
        drive = DriveLimits(
            spring=spring,
            lower=lower,
            upper=upper,
            speed=limits.actuator_speed if spring.joint.point is None else limits.actuator_turning_speed,
            lost_motion=lost_motion(machine, spring),
            compliance=joint_compliance(machine, spring),
        )
        drives.append(drive)
    return tuple(drives)


def _load_bounds(machine: Machine, spring: Spring) -> tuple[Scalar, Scalar]:
    """Least and greatest load of a drive, N or N·m: `lower` and `upper` of `DriveLimits`."""
    limits, load = machine.tables["limits"], machine.tables["load"]
    most = limits.actuator_force if spring.joint.point is None else limits.actuator_moment
    if not spring.acts:
        return -most if is_set(most) else -math.inf, most
    least = load.min_tension if is_set(load.min_tension) else 0.0
    if is_set(load.max_tension):
        most = smaller(most, load.max_tension) if is_set(most) else load.max_tension
    return (least, most) if spring.acts == "pulls" else (-most, -least)


def lost_motion(machine: Machine, spring: Spring) -> Scalar:
    """Return how far the joint of a drive stays behind where the sense of its motion changes.

    Backlash counts as far as the encoder does not see it. The friction of a guide or a bearing is a load on the joint:
    it counts twice, once for each sense, times the compliance of the joint. The friction of the rotor counts twice as
    well, but only where the servo loop has no integral part, which would remove it.

    Args:
        machine: the machine with its tables [drives] and [servo].
        spring: the spring of the actuator.

    Returns:
        m, or rad of a rotary drive.

    Source: theory (105).
    """
    drive, servo = _tables_of(machine, spring)
    slides, distance = spring.joint.point is None, unseen_backlash(machine, spring)
    friction = drive.guide_friction if slides else drive.bearing_friction
    if not is_zero(friction):
        distance = distance + joint_compliance(machine, spring) * (2.0 * friction)
    if is_zero(drive.rotor_friction) or not _is_closed(servo):
        return distance
    rotor_angle = 2.0 * drive.rotor_friction * _loop_compliance(servo)
    return distance + rotor_angle * _travel_per_radian(drive, slides)


def unseen_backlash(machine: Machine, spring: Spring) -> Scalar:
    """The backlash of a drive as far as its encoder does not see it, m or rad."""
    drive, servo = _tables_of(machine, spring)
    backlash = drive.backlash if spring.joint.point is None else drive.angular_backlash
    return (1.0 - servo.position_at_load) * backlash


def joint_compliance(machine: Machine, spring: Spring) -> Scalar:
    """Compliance of the joint of a drive at rest, m/N or rad/(N·m): with its servo loop if it has one.

    Args:
        machine: the machine with its tables [drives] and [servo].
        spring: the spring of the actuator; its stiffness is that of the transmission if there is a loop.

    Source: theory (102).
    """
    drive, servo = _tables_of(machine, spring)
    transmission = reciprocal(spring.stiffness)
    if not _is_closed(servo):
        return transmission
    compliance = transmission * (1.0 - servo.position_at_load)
    travel = _travel_per_radian(drive, spring.joint.point is None)
    if not is_zero(travel):
        compliance = compliance + travel * travel * _loop_compliance(servo)
    return where(_loop_stiffness(servo) > 0.0, compliance, transmission)


def _tables_of(machine: Machine, spring: Spring) -> tuple[Drives, ServoGains]:
    """The tables [drives] and [servo] as this drive has them."""
    return numbers_of_drive(machine, "drives", spring), numbers_of_drive(machine, "servo", spring)


def _loop_stiffness(servo: ServoGains) -> Scalar:
    """Torque of the rotor per angle by which it is off its set point at rest, N·m/rad, without an integral part."""
    return servo.velocity_gain * servo.position_gain


def _loop_compliance(servo: ServoGains) -> Scalar:
    """Angle by which the rotor is off its set point at rest per torque, rad/(N·m); 0 where there is an integral part.

    Pose by pose, because an integral time that varies may be 0 at some poses.
    """
    return where(servo.integral_time > 0.0, 0.0, _inverse(_loop_stiffness(servo)))


def _travel_per_radian(drive: Drives, slides: bool) -> Scalar:
    """Travel of the joint per radian of its rotor, m/rad or 1.

    It is 0 without a lead or a ratio, where `machine.actuators.rotor_turns`, the reciprocal, refuses a rotor: here such
    a drive is as one without a rotor.
    """
    return drive.lead * (0.5 / math.pi) if slides else _inverse(drive.ratio)


def _inverse(a: Scalar) -> Scalar:
    """1 / a, and 0 where a is 0: of a gain that closes no loop, or of a ratio that a file does not give."""
    return where(a > 0.0, reciprocal(where(a > 0.0, a, 1.0)), 0.0)


def _is_closed(servo: ServoGains) -> bool:
    """Whether a drive has a servo loop, by the form of its table: a gain that varies counts, also where it is 0."""
    return not (is_zero(servo.velocity_gain) or is_zero(servo.position_gain))


def driven_springs(configuration: Configuration) -> list[Spring]:
    """The springs of all actuators that hold something; one that is free by form does not."""
    return [
        spring
        for leg in configuration.legs
        for spring in leg.springs
        if spring.actuated and not is_zero(spring.stiffness)
    ]
