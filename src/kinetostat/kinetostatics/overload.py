"""The loads of actuators under the load of a machine, for limits and for maps. What they may bear is `machine.limits`'.

Source: theory (29).
"""

from kinetostat.algebra.scalar import Scalar, is_zero
from kinetostat.algebra.screw import Wrench
from kinetostat.kinematics.limits import Check, load_checks
from kinetostat.kinetostatics.assembly import Statics
from kinetostat.machine.leg import Spring
from kinetostat.machine.limits import is_set
from kinetostat.machine.machine import Configuration, Machine, springs


def actuator_loads(configuration: Configuration, statics: Statics, load: Wrench) -> list[tuple[Spring, Scalar]]:
    """Return every actuator with the size of its force (N) or moment (N·m): |xi_e . w|.

    Actuators that are free by form carry nothing and are left out.

    Args:
        configuration, statics: of a machine at its pose.
        load: at the tool point, base axes.
    """
    pairs = zip(springs(configuration), statics.flexibility, strict=True)
    driven = [(spring, twist) for spring, twist in pairs if spring.actuated and not is_zero(spring.stiffness)]
    return [(spring, abs(load.work(twist))) for spring, twist in driven]


def actuator_checks(machine: Machine, configuration: Configuration, statics: Statics) -> list[Check]:
    """Compare the loads of the actuators with their limits; nothing to compare without a load or a limit.

    Args:
        machine: with [limits] and [load].
        configuration, statics: of it at its pose.
    """
    limits = machine.tables["limits"]
    limited = is_set(limits.actuator_force) or is_set(limits.actuator_moment)
    if not limited or all(is_zero(component) for component in machine.load.components()):
        return []
    return load_checks(machine, configuration, actuator_loads(configuration, statics, machine.load))
