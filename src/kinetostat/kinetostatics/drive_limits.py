"""Limits of drives, as a machine file gives them: least and greatest loads, greatest speeds, lost motion.

What drives can do within them is in `feasible`. Over scalars.
"""

import math

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal, smaller
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Spring
from kinetostat.machine.limits import is_set
from kinetostat.machine.machine import Configuration, Machine


@dataclass(frozen=True)
class DriveLimits:
    """Greatest loads and speed of a drive.

    Attributes:
        spring: of its actuator.
        lower, upper: least and greatest load, N or N·m: positive in the sense in which the actuator's joint is pulled
            open; infinite if not limited.
        speed: greatest speed of the actuator, either way, m/s or rad/s; infinite if not limited.
        lost_motion: what its joint misses between both senses of motion, m or rad, theory (105).
    """

    spring: Spring
    lower: Scalar
    upper: Scalar
    speed: Scalar
    lost_motion: Scalar = 0.0


def drive_limits(machine: Machine, configuration: Configuration) -> tuple[DriveLimits, ...]:
    """Return what a machine file lets its drives do, in the order of the actuators that hold something.

    Loads are those of [limits]; where an actuator only pulls or only pushes, the tensions of [load] bound it as well.
    """
    limits, load = machine.tables["limits"], machine.tables["load"]
    result = []
    for spring in driven_springs(configuration):
        slides = spring.joint.point is None
        most = limits.actuator_force if slides else limits.actuator_moment
        lower, upper = -most if is_set(most) else -math.inf, most
        if spring.acts:
            least = load.min_tension if is_set(load.min_tension) else 0.0
            greatest = load.max_tension if is_set(load.max_tension) else most
            if is_set(most) and is_set(load.max_tension):
                greatest = smaller(most, load.max_tension)
            lower, upper = (least, greatest) if spring.acts == "pulls" else (-greatest, -least)
        speed = limits.actuator_speed if slides else limits.actuator_turning_speed
        result.append(DriveLimits(spring, lower, upper, speed, lost_motion(machine, slides)))
    return tuple(result)


def lost_motion(machine: Machine, slides: bool) -> Scalar:
    """Lost motion of the joint of a drive between both senses: its play, and friction that no integral part removes.

    Args:
        machine: with its tables [drives] and [servo].
        slides: whether the drive is linear.

    Returns:
        m, or rad of a rotary drive.

    Source: theory (105).
    """
    drives, servo = machine.tables["drives"], machine.tables["servo"]
    play = (1.0 - servo.position_at_load) * (drives.backlash if slides else drives.angular_backlash)
    absent = is_zero(drives.rotor_friction) or not is_zero(servo.integral_time)
    if absent or is_zero(servo.velocity_gain) or is_zero(servo.position_gain):
        return play
    turns = drives.lead * (0.5 / math.pi) if slides else reciprocal(drives.ratio)
    return play + 2.0 * drives.rotor_friction * turns * reciprocal(servo.velocity_gain * servo.position_gain)


def driven_springs(configuration: Configuration) -> list[Spring]:
    """The springs of all actuators that hold something; one that is free by form does not."""
    return [
        spring
        for leg in configuration.legs
        for spring in leg.springs
        if spring.actuated and not is_zero(spring.stiffness)
    ]
