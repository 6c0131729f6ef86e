"""The numbers of a response that need rigid parts in motion: by accelerations, and by friction of joints.

A response alone knows neither masses nor rates of joints. Formulas of motions are not here.

Source: theory (92) and (105). Over scalars; at the tool point, base axes.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from kinetostat.algebra.scalar import Scalar, is_zero, sqrt, total
from kinetostat.algebra.screw import Twist
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.kinematics.closing import Joints
from kinetostat.kinetostatics.quantities import needs_masses, needs_motion
from kinetostat.kinetostatics.response import Response
from kinetostat.late import LateModule
from kinetostat.machine.machine import Machine

if TYPE_CHECKING:
    from kinetostat.motion import operators
    from kinetostat.motion.rigid import MotionPlan, RigidLeg
else:
    operators = LateModule("kinetostat.motion.operators")

SIZE = 6


def response_in_motion(
    machine: Machine, response: Response, joints: Joints | None, plan: "MotionPlan | None", names: Collection[str]
) -> Response:
    """The response with what quantities need of the rigid parts of the machine in motion.

    Args:
        machine: at its pose, with numbers of any kind.
        response: of it.
        joints: coordinates that close its legs, if it is written leg by leg.
        plan: which motions there are; None if no joint has friction and no quantity needs masses.
        names: of the quantities.
    """
    if not needs_motion(names):
        return response
    if plan is None:
        return replace(response, lost_motion_of_joints=[0.0] * SIZE)
    here = operators.at_pose(machine, response.configuration, joints, plan)
    # Fewer drives than motions hold nothing.
    are_enough = len(here.rigid.drives) >= len(here.rigid.ways or range(SIZE))
    loads = operators.loads_by_acceleration(here) if needs_masses(names) and are_enough else None
    return replace(response, acceleration_loads=loads, lost_motion_of_joints=lost_motion_of_joints(here, response))


def lost_motion_of_joints(here: "operators.MachineAtPose", response: Response) -> list[Scalar]:
    """Motion of the tool, rx ry rz x y z, that friction of passive joints holds back where all of them reverse.

    A joint that moves by q under a unit load on the tool moves the tool by q, along this load, under a unit moment of
    its own (Maxwell). Its Coulomb friction c changes by 2 c where it reverses; at worst all joints add up. Springs of
    drives with servo loops deflect as their loops let them at rest.

    Args:
        here: the rigid parts of the machine.
        response: of it.

    Source: theory (105).
    """
    if all(is_zero(part.coulomb) for leg in here.rigid.legs for part in leg.friction):
        return [0.0] * SIZE
    compliances = _compliances(response)
    moved = _motions_under_unit_loads(response, compliances)
    first, parts = 0, [[0.0]] * SIZE
    for leg, placed, screws in zip(here.rigid.legs, response.configuration.legs, response.legs, strict=True):
        count = len(placed.springs)
        if any(not is_zero(part.coulomb) for part in leg.friction):
            for row in range(SIZE):
                left = moved[row]
                for number, spring in enumerate(placed.springs, first):
                    if not (spring.actuated or spring.hinge):
                        load = response.statics.flexibility[number].components()[row]
                        twist = screws.elastic[number - first]
                        left = left - twist * (compliances[number] * load)
                parts[row] = [*parts[row], _lost_motion_of_leg(leg, left, here.rigid.length)]
        first += count
    return [total(row) for row in parts]


def _compliances(response: Response) -> list[Scalar]:
    """Compliance of each spring; of a drive that of its loop at rest."""
    loops = {drive.spring.name: drive.softness for drive in response.drives}
    names = [spring.name for leg in response.configuration.legs for spring in leg.springs]
    return [loops.get(name, alone) for name, alone in zip(names, response.statics.compliance, strict=True)]


def _motions_under_unit_loads(response: Response, compliances: Sequence[Scalar]) -> list[Twist]:
    """The twist of the tool by a unit load along each component: columns of C with these compliances."""
    columns = []
    for row in range(SIZE):
        whole = Twist(*_halves([response.compliance.entry(i, row) for i in range(SIZE)]))
        for twist, new, old in zip(response.statics.flexibility, compliances, response.statics.compliance, strict=True):
            if new is not old:
                whole = whole + twist * ((new - old) * twist.components()[row])
        columns.append(whole)
    return columns


def _halves(components: Sequence[Scalar]) -> tuple[Vector, Vector]:
    return Vector(*components[:3]), Vector(*components[3:])


def _lost_motion_of_leg(leg: "RigidLeg", motion: Twist, length: Scalar) -> Scalar:
    """Motion, m or rad, that friction of the joints of a leg holds back, whose end moves so far per unit of a load."""
    scaled = [*motion.rotational.components(), *(motion.translational * (1.0 / length)).components()]
    rates = [total([a * b for a, b in zip(row, scaled, strict=True)]) for row in leg.rates_by_twist[: leg.passive]]
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
