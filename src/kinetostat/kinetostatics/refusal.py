"""The sentence that says why a pose has no answer, and what to change.

Source of what it puts into words: theory sections 2 and 9, and (24)-(27) for what moves.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from kinetostat.kinematics.closing import why_out_of_reach
from kinetostat.kinematics.limits import why_beyond
from kinetostat.kinematics.mobility import Mobility, SortOfPose, describe, mobility, why_singular
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import Response
from kinetostat.late import LateModule
from kinetostat.machine.leg import Spring
from kinetostat.machine.limits import About
from kinetostat.machine.machine import Configuration, Machine, springs
from kinetostat.tolerances import SINGULAR

if TYPE_CHECKING:
    from kinetostat.kinematics import nearest
else:
    nearest = LateModule("kinetostat.kinematics.nearest")


def why_not(machine: Machine, response: Response, nearby: Sequence[Configuration]) -> str:
    """Explain why the status of a pose is not OK.

    Args:
        machine: the machine with its pose.
        response: its response, with that status.
        nearby: the machine at poses around it, to tell what holds in general; may be empty.
    """
    status = Status(int(response.status))
    configuration = response.configuration
    if machine.family.chains is not None:
        placed = Status(int(response.joint_status))
        if placed is Status.OUT_OF_REACH:
            return _off_constraint(machine)
        if placed is not Status.OK:
            return _undetermined_pose(machine) if placed is Status.SINGULAR else placed.sentence
    if status is Status.OUT_OF_REACH:
        return why_out_of_reach(configuration, machine.display)
    if status is Status.JOINT_LIMIT:
        return why_beyond(response.checks, machine.display)
    passed = [check for check in response.checks if check.limit.about is not About.LOAD]  # loads have no numbers here
    return " ".join(filter(None, [_without_numbers(response, nearby), why_beyond(passed, machine.display)]))


def _without_numbers(response: Response, nearby: Sequence[Configuration]) -> str:
    """Explain why K and C do not exist at a pose, which is singular or undecided, or that there is no rest."""
    configuration = response.configuration
    if int(response.status) in (Status.UNDECIDED, Status.NO_REST):
        return Status(int(response.status)).sentence
    motion = known_mobility(response, nearby)
    if motion and not nearby and _locked_joints(configuration) < motion.full_cycle:
        return _lacks_actuators(configuration, motion)
    names = [leg.name for leg in configuration.legs]
    reason = why_singular(names, response.legs, configuration.length, SINGULAR, response.guide)
    kind = f" ({motion.kind})" if motion and motion.kind is not SortOfPose.REGULAR else ""
    return f"The pose is singular{kind}. {reason}"


def known_mobility(response: Response, nearby: Sequence[Configuration]) -> Mobility | None:
    """Free motions and the kind of the singularity; None if the joints cannot be placed."""
    screws = [screw for leg in response.legs for screw in (*leg.passive, *leg.elastic, *leg.wrenches)]
    if not all(math.isfinite(c) for screw in screws for c in screw.components()):
        return None
    return mobility(response.configuration, nearby, response.reference)


def _locked_joints(configuration: Configuration) -> int:
    """The number of joints that are held, by actuators or by a stiffness in the joint itself."""
    return sum(_holds(spring) for spring in springs(configuration))


def _holds(spring: Spring) -> bool:
    return (spring.actuated or spring.hinge) and float(spring.stiffness) > 0.0


def _lacks_actuators(configuration: Configuration, motion: Mobility) -> str:
    """The sentence for a machine with fewer actuators than freedoms, which moves at every pose."""
    idle = [leg.name for leg in configuration.legs if not any(_holds(spring) for spring in leg.springs)]
    where = f"; none is in {', '.join(idle)}" if 0 < len(idle) < len(configuration.legs) else ""
    motions = " or ".join(describe(twist, ("rad", "m")) for twist in motion.twists)
    return (
        f"Actuators are missing: {motion.actuators} for {motion.full_cycle} freedoms{where}. With all of them "
        f"locked the platform can still move, by the twist {motions}; give another joint an actuator."
    )


def _off_constraint(machine: Machine) -> str:
    near = nearest.nearest_pose(machine)
    shown = ", ".join(f"{name} {value:.5g} {'m' if name in 'xyz' else 'rad'}" for name, value in near.items())
    return (
        "The legs cannot close at this pose on the branch of the home pose; the nearest admissible pose is "
        f"{shown}. Change [pose] to it, or leave out coordinates that follow from the others."
    )


def _undetermined_pose(machine: Machine) -> str:
    coordinates = ", ".join(name.removeprefix("pose.") for name in vars(machine.tables["pose"]))
    return (
        f"The pose is not determined: the legs close at the given {coordinates}, but the platform can still move "
        "there. Give further coordinates in [pose], or move away from a singular pose."
    )
