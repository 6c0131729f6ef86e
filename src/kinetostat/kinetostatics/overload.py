"""Whether the actuators bear the load of a machine: limits of force and moment. Limits of geometry are elsewhere.

Source: theory (29).
"""

from kinetostat.algebra.scalar import is_zero, times
from kinetostat.kinematics.limits import SLACK, Check
from kinetostat.kinetostatics.assembly import Statics
from kinetostat.machine.limits import is_set
from kinetostat.machine.machine import Configuration, Machine, springs


def actuator_checks(machine: Machine, configuration: Configuration, statics: Statics) -> list[Check]:
    """The force (N) or moment (N·m) of every actuator under the machine's load, where that is limited.

    Load in a spring: xi_e times w. Actuators that are free by form carry nothing.

    Args:
        machine: with [limits] and [load]; the load acts at the tool point, base axes.
        configuration, statics: of it at its pose.
    """
    limits, wrench = machine.tables["limits"], machine.load
    bounds = {True: ("actuator_force", limits.actuator_force), False: ("actuator_moment", limits.actuator_moment)}
    if all(is_zero(c) for c in wrench.components()) or not any(is_set(bound) for _, bound in bounds.values()):
        return []
    found = []
    for spring, twist in zip(springs(configuration), statics.flexibility, strict=True):
        name, bound = bounds[spring.joint.point is None]
        if spring.actuated and is_set(bound) and not is_zero(spring.stiffness):
            size = abs(wrench.work(twist))
            found.append(Check(name, spring.name, size, bound, True, times(SLACK, bound)))
    return found
