"""Why a pose has no answer, in a sentence that says what to change."""

import math
from collections.abc import Sequence

from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinematics.limits import why_beyond
from kinetostat.kinematics.mobility import Kind, mobility
from kinetostat.kinematics.nearest import nearest_pose
from kinetostat.kinematics.reach import why_out_of_reach
from kinetostat.kinematics.singularity import why_singular
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import SINGULAR, Response
from kinetostat.machine.machine import Configuration, Machine


def why_not(machine: Machine, response: Response, nearby: Sequence[Configuration]) -> str:
    """The sentence for a pose whose status is not OK."""
    status = Status(int(response.status))
    configuration = response.configuration
    if machine.family.chains is not None:
        placed = Status(int(solve_joints(machine).status))
        if placed is Status.OUT_OF_REACH:
            return _off_constraint(machine)
        if placed is not Status.OK:
            return _undetermined(machine) if placed is Status.SINGULAR else placed.sentence
    if status is Status.OUT_OF_REACH:
        return why_out_of_reach(configuration)
    if status is Status.JOINT_LIMIT:
        return why_beyond(response.checks)
    names = [leg.name for leg in configuration.legs]
    reason = why_singular(names, response.legs, configuration.length, SINGULAR)
    return f"The pose is singular{_kind(response, nearby)}. {reason}"


def _kind(response: Response, nearby: Sequence[Configuration]) -> str:
    """What sort of singularity it is, in brackets; nothing where the joints have no place."""
    screws = [screw for leg in response.legs for screw in (*leg.passive, *leg.elastic, *leg.wrenches)]
    if not all(math.isfinite(c) for screw in screws for c in screw.components()):
        return ""
    found = mobility(response.configuration, nearby, response.reference)
    return "" if found.kind is Kind.REGULAR else f" ({found.kind})"


def _off_constraint(machine: Machine) -> str:
    near = nearest_pose(machine)
    shown = ", ".join(f"{name} {value:.5g} {'m' if name in 'xyz' else 'rad'}" for name, value in near.items())
    return (
        "The legs cannot close at this pose on the branch of the home pose; the nearest admissible pose is "
        f"{shown}. Change [pose] to it, or leave out coordinates that follow from the others."
    )


def _undetermined(machine: Machine) -> str:
    given = ", ".join(name.removeprefix("pose.") for name in vars(machine.sections["pose"]))
    return (
        f"The pose is not determined: the legs close at the given {given}, but the platform can still move there. "
        "Give further coordinates in [pose], or move away from a singular pose."
    )
