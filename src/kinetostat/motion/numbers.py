"""Numbers of a rigid machine along a motion, in one list for programs and columns: of drives, and of joints.

Source: theory (91)-(95). SI.
"""

from collections.abc import Iterator, Mapping

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.screw import Wrench
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Joint, Spring
from kinetostat.machine.machine import Configuration
from kinetostat.motion.forces import NOTHING, PARTS, ForceDemand, drive_forces, leg_wrenches, sign
from kinetostat.motion.operators import MachineAtPose, forces_along, mass_at_drives
from kinetostat.motion.rates import PoseRates

OF_DRIVE = ("speed", "acceleration", *PARTS)
"""Numbers of each drive: how its coordinate moves, and the parts of its force or torque, positive along its motion."""


@dataclass(frozen=True)
class LoadedJoint:
    """A joint whose load is looked at.

    Attributes:
        name: of the joint.
        leg: number of its leg.
        element: number of its first element in the leg's chain, from 0.
        turns: whether it has a point, about which its moment is counted.
    """

    name: str
    leg: int
    element: int
    turns: bool


def drive_numbers(here: MachineAtPose, direction: PoseRates) -> list[Scalar]:
    """Numbers of all drives along a motion, see `OF_DRIVE`, one drive after the other, SI."""
    motion, demand_by_part = forces_along(here, direction)
    length = here.rigid.length
    units = [length if drive.slides else 1.0 for drive in here.rigid.drives]
    rows = [here.drive_rates(motion), here.drive_rates(motion, change=True)]
    results = [[value * unit for value, unit in zip(row, units, strict=True)] for row in rows]
    levers = [1.0 if drive.slides else length for drive in here.rigid.drives]
    for part in PARTS:
        forces = drive_forces(here.rigid, here.statics, demand_by_part[part])
        results.append([force * lever for force, lever in zip(forces, levers, strict=True)])
    return [row[number] for number in range(len(units)) for row in results]


def joints_of(configuration: Configuration) -> list[LoadedJoint]:
    """The joints of all legs whose loads are looked at: passive ones and drives, each once."""
    return [joint for number, leg in enumerate(configuration.legs) for joint in _joints_of_leg(number, leg.chain)]


def _joints_of_leg(number: int, chain: tuple[object, ...]) -> Iterator[LoadedJoint]:
    last = ""
    for place, element in enumerate(chain):
        mover = element if isinstance(element, Joint) else element.joint if isinstance(element, Spring) else None
        name = element.of if isinstance(element, Spring) else mover.name if mover else ""
        driven = isinstance(element, Spring) and element.actuated
        if mover is not None and name and name != last and (driven or isinstance(element, Joint)):
            yield LoadedJoint(name, number, place, mover.point is not None)
        last = name


def joint_numbers(here: MachineAtPose, direction: PoseRates, joints: list[LoadedJoint]) -> list[Scalar]:
    """The size of the force (N), and of the moment about its point (N·m), that each joint passes on, theory (93).

    The moment of a slide, which has no point, is 0.0.
    """
    whole = _sum_of(forces_along(here, direction)[1])
    wrenches = leg_wrenches(here.rigid, whole, drive_forces(here.rigid, here.statics, whole))
    shrink, results = 1.0 / here.rigid.length, []
    for joint in joints:
        element = here.configuration.legs[joint.leg].chain[joint.element]
        motion = here.rigid.legs[joint.leg].ends[joint.element]
        passed = whole.carried[joint.leg][motion] - wrenches[joint.leg]
        results.append(passed.translational.norm())
        point = element.mover.point if joint.turns else None  # type: ignore[attr-defined]
        results.append(
            0.0 if point is None else _moment(passed, (point - here.rigid.origin) * shrink, here.rigid.length)
        )
    return results


def _sum_of(demand_by_part: Mapping[str, ForceDemand]) -> ForceDemand:
    first, *others = demand_by_part.values()
    for demand in others:
        first = first + demand
    return first


def _moment(wrench: Wrench, at: Vector, length: Scalar) -> Scalar:
    return (wrench.rotational - at.cross(wrench.translational)).norm() * length


def reflected_inertia(here: MachineAtPose) -> list[Scalar]:
    """Inertia that each drive accelerates while the others stand still, with its rotor: kg, or kg·m² of turns.

    Nothing of a machine with more drives than coordinates, whose drives cannot move one by one.
    """
    if len(here.rigid.drives) != len(here.names):
        return []
    return [row[number] for number, row in enumerate(mass_at_drives(here))]


def tool_wrench(here: MachineAtPose, direction: PoseRates) -> list[Scalar]:
    """The wrench at the tool point that would deflect springs as the motion does: moment (N·m), force (N) [6].

    It is less what masses, process and joints ask for, taken to the platform by virtual work; rotors and their friction
    act behind the springs of their drives, and are left out.
    """
    motion, demand_by_part = forces_along(here, direction)
    demand = _sum_of(demand_by_part)
    whole = list((NOTHING - demand.platform).components())
    for leg, moving, forces in zip(here.rigid.legs, motion.legs, demand.legs, strict=True):
        row = list(forces)
        for place, number in enumerate(leg.drives, leg.passive):
            drive, rate = here.rigid.drives[number], moving.rates[place]
            row[place] = (
                row[place] - drive.inertia * moving.change[place] - drive.viscous * rate - drive.coulomb * sign(rate)
            )
        for solved, force in zip(leg.solved, row, strict=True):
            whole = [a - b * force for a, b in zip(whole, solved, strict=True)]
    length = here.rigid.length
    return [*(part * length for part in whole[:3]), *whole[3:]]


def motion_details(here: MachineAtPose, direction: PoseRates) -> list[Scalar]:
    """The loads of all joints, two numbers each, the wrench at the tool, and the reflected inertia of all drives."""
    loads = joint_numbers(here, direction, joints_of(here.configuration))
    return [*loads, *tool_wrench(here, direction), *reflected_inertia(here)]
