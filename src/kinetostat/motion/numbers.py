"""The numbers of a rigid machine at a point of a motion: of its drives, of its joints, and the wrench at its tool.

Each function returns a flat list of scalars, the same for compiled programs and for columns of NumPy; `engine.moving`
takes it apart again.

Source: theory (91)-(95). SI.
"""

from collections.abc import Iterator, Mapping, Sequence

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.screw import Wrench
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Joint, Spring
from kinetostat.machine.machine import Configuration
from kinetostat.motion.forces import NOTHING, PARTS, ForceDemand, drive_forces, leg_wrenches, sense
from kinetostat.motion.operators import MachineAtPose, forces_along, mass_at_drives
from kinetostat.motion.rates import PoseRates

NUMBERS_OF_DRIVE = ("speed", "acceleration", *PARTS)
"""Numbers of each drive: speed and acceleration of its coordinate, and the parts of its force or torque, which are
positive along its motion."""


@dataclass(frozen=True)
class LoadedJoint:
    """A joint whose load is computed.

    Attributes:
        name: name of the joint.
        leg: number of its leg, from 0.
        element: number of its first element in the leg's chain, from 0.
        turns: whether it has a point, about which its moment is taken; a slide has none.
    """

    name: str
    leg: int
    element: int
    turns: bool


def drive_numbers(here: MachineAtPose, direction: PoseRates) -> list[Scalar]:
    """The numbers `NUMBERS_OF_DRIVE` of all drives along a motion, one drive after the other, SI."""
    motion, demand_by_part = forces_along(here, direction)
    drives, length = here.rigid.drives, here.rigid.length
    # Lengths are counted in units of the machine's length, so that sliding speeds and turning moments are scaled by it.
    rate_units = [length if drive.slides else 1.0 for drive in drives]
    force_units = [1.0 if drive.slides else length for drive in drives]
    rows = [_products(here.drive_rates(motion, change=change), rate_units) for change in (False, True)]
    forces_by_part = [drive_forces(here.rigid, here.statics, demand_by_part[part]) for part in PARTS]
    rows += [_products(forces, force_units) for forces in forces_by_part]
    return [row[number] for number in range(len(drives)) for row in rows]


def _products(values: Sequence[Scalar], units: Sequence[Scalar]) -> list[Scalar]:
    return [value * unit for value, unit in zip(values, units, strict=True)]


def joints_of(configuration: Configuration) -> list[LoadedJoint]:
    """The joints of all legs whose loads are computed: passive joints and drives, each once."""
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
    length, results = here.rigid.length, []
    for joint in joints:
        element = here.configuration.legs[joint.leg].chain[joint.element]
        motion = here.rigid.legs[joint.leg].ends[joint.element]
        passed = whole.carried[joint.leg][motion] - wrenches[joint.leg]
        results.append(passed.translational.norm())
        point = element.mover.point if joint.turns else None  # type: ignore[attr-defined]
        arm = None if point is None else (point - here.rigid.origin) * (1.0 / length)
        results.append(0.0 if arm is None else _moment_size(passed, arm, length))
    return results


def _sum_of(demand_by_part: Mapping[str, ForceDemand]) -> ForceDemand:
    first, *others = demand_by_part.values()
    for demand in others:
        first = first + demand
    return first


def _moment_size(wrench: Wrench, arm: Vector, length: Scalar) -> Scalar:
    """Size of a wrench's moment (N·m) about a point at `arm` (in units of the machine's length, m) from the origin."""
    return (wrench.rotational - arm.cross(wrench.translational)).norm() * length


def reflected_inertia(here: MachineAtPose) -> list[Scalar]:
    """Inertia that each drive accelerates while the others stand still, its rotor included: kg, or kg·m² if it turns.

    The list is empty for a machine with more drives than coordinates, whose drives cannot move one by one.
    """
    if len(here.rigid.drives) != len(here.names):
        return []
    return [row[number] for number, row in enumerate(mass_at_drives(here))]


def tool_wrench(here: MachineAtPose, direction: PoseRates) -> list[Scalar]:
    """The wrench at the tool point that would deflect springs as the motion does: moment (N·m), force (N) [6].

    It is opposite to the forces that masses, process and joints ask for, taken to the platform by virtual work. Rotors
    and their friction act behind the springs of their drives, and are left out.
    """
    motion, demand_by_part = forces_along(here, direction)
    demand = _sum_of(demand_by_part)
    whole = list((NOTHING - demand.platform).components())
    for leg, moving, forces in zip(here.rigid.legs, motion.legs, demand.legs, strict=True):
        row = list(forces)
        for place, number in enumerate(leg.drives, leg.passive):
            drive, rate = here.rigid.drives[number], moving.rates[place]
            row[place] = (
                row[place] - drive.inertia * moving.change[place] - drive.viscous * rate - drive.coulomb * sense(rate)
            )
        for solved, force in zip(leg.rates_by_twist, row, strict=True):
            whole = [a - b * force for a, b in zip(whole, solved, strict=True)]
    length = here.rigid.length
    return [*(part * length for part in whole[:3]), *whole[3:]]


def motion_details(here: MachineAtPose, direction: PoseRates) -> list[Scalar]:
    """The loads of all joints, two numbers each, the wrench at the tool, and the reflected inertia of all drives."""
    loads = joint_numbers(here, direction, joints_of(here.configuration))
    return [*loads, *tool_wrench(here, direction), *reflected_inertia(here)]
