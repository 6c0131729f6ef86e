"""The numbers of a response that need rigid parts in motion: by accelerations, and by friction of joints.

A response alone knows neither masses nor rates of joints. Formulas of motions are not here.

Source: theory (92) and (105). Over scalars; at the tool point, base axes.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from kinetostat.algebra.scalar import Scalar, inner_product, is_zero, sqrt, total
from kinetostat.algebra.screw import Twist
from kinetostat.algebra.symmetric import SIZE
from kinetostat.algebra.vector import ZERO
from kinetostat.kinematics.closing import Joints
from kinetostat.kinetostatics.quantities import needs_masses, needs_motion
from kinetostat.kinetostatics.response import Response
from kinetostat.late import LateModule
from kinetostat.machine.machine import Machine

if TYPE_CHECKING:
    from kinetostat.motion import machine_at_pose
    from kinetostat.motion.rigid import MotionPlan, RigidLeg, RigidMachine
else:  # most responses are asked for nothing that moves
    machine_at_pose = LateModule("kinetostat.motion.machine_at_pose")


def response_in_motion(
    machine: Machine, response: Response, joints: Joints | None, plan: "MotionPlan | None", names: Collection[str]
) -> Response:
    """Return the response with what quantities need of the rigid parts of the machine in motion.

    Args:
        machine: the machine at its pose, with numbers of any kind.
        response: the response of the machine.
        joints: coordinates that close its legs, if it is written leg by leg.
        plan: the motions that there are; None if no joint has friction and no quantity needs masses.
        names: names of the quantities.
    """
    if not needs_motion(names):
        return response
    if plan is None:
        return replace(response, lost_motion_of_joints=[0.0] * SIZE)
    placed = machine_at_pose.at_pose(machine, response.configuration, joints, plan)
    # With fewer drives than motions, no forces of drives balance an acceleration.
    drives_suffice = len(placed.rigid.drives) >= len(placed.rigid.ways or range(SIZE))
    loads = machine_at_pose.loads_by_acceleration(placed) if needs_masses(names) and drives_suffice else None
    lost_motion = lost_motion_of_joints(placed.rigid, response)
    return replace(response, acceleration_loads=loads, lost_motion_of_joints=lost_motion)


def lost_motion_of_joints(machine: "RigidMachine", response: Response) -> list[Scalar]:
    """Return the motion of the tool, rx ry rz x y z, that friction of passive joints holds back where all reverse.

    A joint that moves by q under a unit load on the tool moves the tool by q, along this load, under a unit moment of
    its own (Maxwell). Its Coulomb friction c changes by 2 c where it reverses; at worst all joints add up. Springs of
    drives with servo loops deflect as their loops let them at rest.

    Args:
        machine: the rigid parts of the machine.
        response: the response of the machine.

    Source: theory (105).
    """
    if all(is_zero(part.coulomb) for leg in machine.legs for part in leg.friction):
        return [0.0] * SIZE
    compliances = _compliances(response)
    tool_motions = _motions_under_unit_loads(response, compliances)
    lost: list[list[Scalar]] = [[0.0] for _ in range(SIZE)]
    first = 0
    for rigid_leg, leg, screws in zip(machine.legs, response.configuration.legs, response.legs, strict=True):
        springs = slice(first, first + len(leg.springs))
        first = springs.stop
        if all(is_zero(part.coulomb) for part in rigid_leg.friction):
            continue
        # Springs between the joints and the tool move the tool, not the joints.
        shares = zip(
            leg.springs, screws.elastic, compliances[springs], response.statics.flexibility[springs], strict=True
        )
        beyond_joints = [
            (twist, compliance, load.components())
            for spring, twist, compliance, load in shares
            if not (spring.actuated or spring.hinge)
        ]
        for component, tool_motion in enumerate(tool_motions):
            joint_motion = tool_motion
            for twist, compliance, load in beyond_joints:
                joint_motion = joint_motion - twist * (compliance * load[component])
            lost[component].append(_lost_motion_of_leg(rigid_leg, joint_motion, machine.length))
    return [total(row) for row in lost]


def _compliances(response: Response) -> list[Scalar]:
    """Return the compliance of each spring; of a drive that of its loop at rest."""
    of_loops = {drive.spring.name: drive.compliance for drive in response.drives}
    names = [spring.name for leg in response.configuration.legs for spring in leg.springs]
    return [of_loops.get(name, of_spring) for name, of_spring in zip(names, response.statics.compliance, strict=True)]


def _motions_under_unit_loads(response: Response, compliances: Sequence[Scalar]) -> list[Twist]:
    """Return the twist of the tool by a unit load along each component: columns of C with these compliances."""
    columns = []
    for row in range(SIZE):
        entries = [response.compliance.entry(i, row) for i in range(SIZE)]
        column = Twist.of(entries)
        for twist, new, old in zip(response.statics.flexibility, compliances, response.statics.compliance, strict=True):
            if new is not old:  # a loop replaces the spring; the same object needs no correction
                column = column + twist * ((new - old) * twist.components()[row])
        columns.append(column)
    return columns


def _lost_motion_of_leg(leg: "RigidLeg", motion: Twist, length: Scalar) -> Scalar:
    """Return the motion of the tool that friction of the joints of a leg holds back: along a force m, of a moment rad.

    Frictions are forces, N, of joints that turn over the machine's length, and rates are rad or machine lengths per
    unit of the load. So the length makes their products work per unit of the load. A friction c goes from c to -c.

    Args:
        leg: the leg.
        motion: motion of its end per unit of a load on the tool.
        length: length of the machine, m.
    """
    components = [*motion.rotational.components(), *(motion.translational * (1.0 / length)).components()]
    rates = [inner_product(row, components) for row in leg.rates_by_twist[: leg.passive]]
    in_balls = {place for ball in leg.balls for place in ball}
    parts = [
        abs(rate) * part.coulomb
        for place, (rate, part) in enumerate(zip(rates, leg.friction, strict=True))
        if place not in in_balls and not is_zero(part.coulomb)
    ]
    for ball in leg.balls:
        turning = ZERO
        for place in ball:
            turning = turning + leg.screws[leg.coordinates.index(place)].rotational * rates[place]
        parts.append(sqrt(turning.dot(turning)) * leg.friction[ball[0]].coulomb)
    return total(parts) * (2.0 * length)
