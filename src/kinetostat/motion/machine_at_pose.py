"""A machine of rigid parts at a pose: how it moves, its equations of motion, and the numbers of its drives and joints.

Everything that follows from a pose and a motion over scalars starts here: `at_pose` places a machine, `along` moves it.
Numbers of drives, joints and the tool are flat lists of scalars, of which `engine.moving` makes programs.

Source: theory (90)-(95). SI, unless said otherwise.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

from kinetostat.algebra.scalar import Scalar, inner_product, total
from kinetostat.algebra.screw import NO_MOTION, NO_WRENCH, Twist, Wrench
from kinetostat.algebra.solve import Row, dual_basis
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.machine.leg import Joint, Spring
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.machine.parameters import POSE, values
from kinetostat.motion.forces import (
    PARTS,
    DriveStatics,
    ForceDemand,
    demands,
    direction_of_motion,
    drive_forces,
    drive_statics,
    inertia,
    leg_wrenches,
    weight,
)
from kinetostat.motion.rates import (
    BodyMotion,
    Coordinates,
    MachineMotion,
    PoseRates,
    angles_of,
    coordinates_of,
    leg_from_rest,
    machine_motion,
    motion_along,
    motion_from_rest,
    placed_platform,
    platform_motion,
)
from kinetostat.motion.rigid import MotionPlan, RigidMachine, mechanism_over_scalars, rigid_machine

NUMBERS_OF_DRIVE = ("speed", "acceleration", *PARTS)
"""Numbers of each drive: speed and acceleration of its coordinate, and the parts of its force or torque, which are
positive along its motion."""


@dataclass(frozen=True)
class MachineAtPose:
    """A machine of rigid parts at a pose, ready to be moved.

    Attributes:
        machine: the machine with its numbers, of any kind.
        configuration: the places of all parts.
        rigid: the machine as rigid parts.
        names: names of the coordinates of its pose.
    """

    machine: Machine
    configuration: Configuration
    rigid: RigidMachine
    names: tuple[str, ...]

    @cached_property
    def coordinates(self) -> Coordinates | None:
        """Its coordinates, where the pose says less than where the platform is; None where it says all."""
        if self.machine.family.chains is None or len(self.names) == 6:
            return None
        platform = self.configuration.platform
        return coordinates_of(self.rigid, self.names, platform, angles_of(platform))

    @cached_property
    def statics(self) -> DriveStatics:
        """The statics of its drives."""
        return drive_statics(self.rigid)

    @property
    def rate_units(self) -> list[Scalar]:
        """Units of the rates of the drives: those of slides are counted in lengths of the machine."""
        return [self.rigid.length if drive.slides else 1.0 for drive in self.rigid.drives]

    def along(
        self, direction: PoseRates, real_rates: PoseRates | None = None, real_motion: MachineMotion | None = None
    ) -> MachineMotion:
        """Move the machine along a direction of its coordinates.

        Args:
            direction: the direction, and its change.
            real_rates: the rates with which the machine really moves, if they are not this direction.
            real_motion: its motion with them.
        """
        if self.coordinates is None:
            placement = placed_platform(self.machine, direction, real_rates or direction)
            return machine_motion(self.rigid, platform_motion(self.rigid, placement), real_motion)
        return motion_along(self.rigid, self.coordinates, direction, real_motion)

    def drive_rates(self, motion: MachineMotion) -> Row:
        """Return the rates of the drives in a motion, SI."""
        return self._numbers_of_drives([leg.rates for leg in motion.legs])

    def drive_changes(self, motion: MachineMotion) -> Row:
        """Return the change of the rates of the drives in a motion, SI."""
        return self._numbers_of_drives([leg.change for leg in motion.legs])

    def _numbers_of_drives(self, rows: Sequence[Row]) -> Row:
        """Return those of the drives among numbers of all coordinates of each leg, in SI."""
        result: Row = [0.0] * len(self.rigid.drives)
        for leg, row in zip(self.rigid.legs, rows, strict=True):
            for place, number in enumerate(leg.drives, leg.passive):
                result[number] = row[place]
        return [rate * unit for rate, unit in zip(result, self.rate_units, strict=True)]

    def unit_motions(
        self, real_rates: PoseRates | None = None, real_motion: MachineMotion | None = None
    ) -> list[MachineMotion]:
        """Return the motion along each coordinate alone, at unit rate; arguments as of `along`."""
        zeros = dict.fromkeys(self.names, 0.0)
        return [self.along(PoseRates(zeros | {name: 1.0}, zeros), real_rates, real_motion) for name in self.names]


def at_pose(
    machine: Machine,
    configuration: Configuration,
    joints: Joints | None,
    plan: MotionPlan,
    masses: Sequence[Scalar] | None = None,
) -> MachineAtPose:
    """Take the rigid parts of a machine at its pose.

    Args:
        machine: the machine at its pose.
        configuration: the places of all parts.
        joints: coordinates that close its legs, if it is written leg by leg.
        plan: the motions that there are, see `rigid.plan_of`.
        masses: masses of its links, kg; those that they have at this pose if None.
    """
    mechanism = mechanism_over_scalars(machine, configuration, joints, masses)
    rigid = rigid_machine(machine, mechanism, plan, machine.reference_point(configuration))
    names = tuple(path.removeprefix(POSE) for path in values(machine) if path.startswith(POSE))
    return MachineAtPose(machine, configuration, rigid, names)


def forces_along(placed: MachineAtPose, direction: PoseRates) -> tuple[MachineMotion, dict[str, ForceDemand]]:
    """Return the motion of a machine with its accelerations, and the forces that it asks for, by part."""
    motion = placed.along(direction)
    return motion, demands(placed.rigid, motion)


@dataclass(frozen=True)
class Operators:
    """M, C and g of the equations of motion M x'' + C x' + g = J^T f over the coordinates of the pose, theory (94).

    Attributes:
        mass: M; kg of lengths, kg·m² of angles, kg·m between them.
        coriolis: C, with dM/dt - 2 C skew-symmetric.
        gravity: g, the forces that hold the weight.
        drive_rates: J, rates of the drives by the coordinates.
        drive_changes: dJ/dt.
    """

    mass: list[Row]
    coriolis: list[Row]
    gravity: Row
    drive_rates: list[Row]
    drive_changes: list[Row]

    def at_drives(self) -> tuple[list[Row], list[Row], Row]:
        """Return M, C and g over the coordinates of the drives, as many as of the pose, theory (95)."""
        inverse, _ = dual_basis(self.drive_rates)  # the dual vectors of the rows of J are the columns of J^-1
        momenta = _product_with_transpose(self.mass, inverse)  # M J^-1
        changes = _product_with_transpose(self.drive_changes, inverse)  # dJ/dt J^-1
        of_changes = _product_with_transpose(momenta, _transpose(changes))
        coriolis = [
            [a - b for a, b in zip(*rows, strict=True)]
            for rows in zip(_product_with_transpose(self.coriolis, inverse), of_changes, strict=True)
        ]
        mass, coriolis = (_product_with_transpose(inverse, _transpose(rows)) for rows in (momenta, coriolis))
        gravity = [inner_product(row, self.gravity) for row in inverse]
        return mass, coriolis, gravity


def _product_with_transpose(left: Sequence[Row], right: Sequence[Row]) -> list[Row]:
    """Return A B^T of two matrices, by their rows."""
    return [[inner_product(row, other) for other in right] for row in left]


def _transpose(rows: Sequence[Row]) -> list[Row]:
    return [list(row) for row in zip(*rows, strict=True)]


def operators(placed: MachineAtPose, rates: Mapping[str, Scalar]) -> Operators:
    """Return M, C and g over the coordinates of the pose, SI.

    Args:
        placed: the machine at its pose.
        rates: rates of the coordinates, by name.
    """
    real_rates = PoseRates(rates, dict.fromkeys(placed.names, 0.0))
    real_motion, length = placed.along(real_rates), placed.rigid.length
    columns = placed.unit_motions(real_rates, real_motion)
    of_speed = [inertia(placed.rigid, column, real_motion) for column in columns]
    of_weight = weight(placed.rigid)
    return Operators(
        mass=_mass(placed, columns),
        coriolis=[[_work(demand, other) * length for demand in of_speed] for other in columns],
        gravity=[_work(of_weight, other) * length for other in columns],
        drive_rates=_transpose([placed.drive_rates(column) for column in columns]),
        drive_changes=_transpose([placed.drive_changes(column) for column in columns]),
    )


def _mass(placed: MachineAtPose, columns: Sequence[MachineMotion]) -> list[Row]:
    """Return M from the motions along each coordinate: the work on one of them of what accelerates along another."""
    of_acceleration = [inertia(placed.rigid, _from_rest(column)) for column in columns]
    return [[_work(demand, other) * placed.rigid.length for demand in of_acceleration] for other in columns]


def mass_at_drives(placed: MachineAtPose) -> list[Row]:
    """Return M over the coordinates of the drives, as many as of the pose, SI, theory (95)."""
    columns = placed.unit_motions()
    inverse, _ = dual_basis(_transpose([placed.drive_rates(column) for column in columns]))  # as in `at_drives`
    momenta = _product_with_transpose(_mass(placed, columns), inverse)
    return _product_with_transpose(inverse, _transpose(momenta))


def loads_by_acceleration(placed: MachineAtPose) -> list[Twist]:
    """Return the load of each drive, positive where its joint is pulled open, by accelerations of the platform.

    A drive that accelerates a machine from rest by a, at the tool point, carries a . row of it beside what it carries
    at rest: N, or N·m of rotary drives, per m/s² and rad/s². Accelerations that structure does not allow do not count.

    Source: theory (90) and (92).
    """
    rigid, shrink = placed.rigid, 1.0 / placed.rigid.length
    rows: list[list[Scalar]] = [[0.0] * 6 for _ in rigid.drives]
    for way in placed.statics.ways:
        from_rest = motion_from_rest(rigid, Twist.of(way))
        forces = drive_forces(rigid, placed.statics, inertia(rigid, from_rest))
        rows = [[a - b * f for a, b in zip(row, way, strict=True)] for row, f in zip(rows, forces, strict=True)]
    levers = [1.0 if drive.slides else rigid.length for drive in rigid.drives]
    return [
        Twist(Vector(*row[:3]) * lever, Vector(*row[3:]) * (lever * shrink))
        for row, lever in zip(rows, levers, strict=True)
    ]


def _from_rest(motion: MachineMotion) -> MachineMotion:
    """Return the motion from rest whose accelerations are the rates of another one."""
    legs = tuple(leg_from_rest(leg.rates, [body.twist for body in leg.bodies]) for leg in motion.legs)
    return MachineMotion(BodyMotion(NO_MOTION, motion.platform.twist), legs)


def _work(demand: ForceDemand, motion: MachineMotion) -> Scalar:
    """Return the power of a demand along a motion, in units of the machine's length."""
    works = [demand.platform.work(motion.platform.twist)]
    for row, leg in zip(demand.legs, motion.legs, strict=True):
        works += [force * rate for force, rate in zip(row, leg.rates, strict=True)]
    return total(works)


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


def drive_numbers(placed: MachineAtPose, direction: PoseRates) -> list[Scalar]:
    """Return the numbers `NUMBERS_OF_DRIVE` of all drives along a motion, one drive after the other, SI."""
    motion, demand_by_part = forces_along(placed, direction)
    drives, length = placed.rigid.drives, placed.rigid.length
    rows = [placed.drive_rates(motion), placed.drive_changes(motion)]
    for part in PARTS:
        forces = drive_forces(placed.rigid, placed.statics, demand_by_part[part])
        rows.append([force * (1.0 if drive.slides else length) for force, drive in zip(forces, drives, strict=True)])
    return [row[number] for number in range(len(drives)) for row in rows]


def joints_of(configuration: Configuration) -> list[LoadedJoint]:
    """Return the joints of all legs whose loads are computed: passive joints and drives, each once."""
    return [joint for number, leg in enumerate(configuration.legs) for joint in _joints_of_leg(number, leg.chain)]


def _joints_of_leg(number: int, chain: tuple[object, ...]) -> Iterator[LoadedJoint]:
    """Give the joints of a leg; elements of one name in a row, as the springs of a hinge, are one joint."""
    last = ""
    for place, element in enumerate(chain):
        mover = element if isinstance(element, Joint) else element.joint if isinstance(element, Spring) else None
        name = element.part_name if isinstance(element, Spring) else mover.name if mover else ""
        is_drive = isinstance(element, Spring) and element.actuated
        if mover is not None and name and name != last and (is_drive or isinstance(element, Joint)):
            yield LoadedJoint(name, number, place, mover.point is not None)
        last = name


def joint_numbers(placed: MachineAtPose, direction: PoseRates, joints: list[LoadedJoint]) -> list[Scalar]:
    """Return of each joint the size of its force (N), then that of its moment about its point (N·m), theory (93).

    The moment of a slide, which has no point, is 0.0.
    """
    demand = _sum_of(forces_along(placed, direction)[1])
    wrenches = leg_wrenches(placed.rigid, demand, drive_forces(placed.rigid, placed.statics, demand))
    length, results = placed.rigid.length, []
    for joint in joints:
        element = placed.configuration.legs[joint.leg].chain[joint.element]
        motion = placed.rigid.legs[joint.leg].ends[joint.element]
        load = demand.carried[joint.leg][motion] - wrenches[joint.leg]
        results.append(load.translational.norm())
        point = element.mover.point if joint.turns else None  # type: ignore[attr-defined]
        arm = None if point is None else (point - placed.rigid.origin) * (1.0 / length)
        results.append(0.0 if arm is None else _moment_size(load, arm, length))
    return results


def _sum_of(demand_by_part: Mapping[str, ForceDemand]) -> ForceDemand:
    whole, *others = demand_by_part.values()
    for demand in others:
        whole = whole + demand
    return whole


def _moment_size(wrench: Wrench, arm: Vector, length: Scalar) -> Scalar:
    """Return the size of a wrench's moment (N·m) about a point at `arm`, in units of the length, m."""
    return (wrench.rotational - arm.cross(wrench.translational)).norm() * length


def reflected_inertia(placed: MachineAtPose) -> list[Scalar]:
    """Return the inertia that each drive accelerates while the others stand still: kg, or kg·m² if it turns.

    The rotor is included. The list is empty for a machine with more drives than coordinates, whose drives cannot move
    one by one.
    """
    if len(placed.rigid.drives) != len(placed.names):
        return []
    return [row[number] for number, row in enumerate(mass_at_drives(placed))]


def tool_wrench(placed: MachineAtPose, direction: PoseRates) -> list[Scalar]:
    """Return the wrench at the tool point that would deflect springs as the motion does: moment (N·m), force (N) [6].

    It is opposite to the forces that masses, process and joints ask for, taken to the platform by virtual work. Rotors
    and their friction act behind the springs of their drives, and are left out.
    """
    motion, demand_by_part = forces_along(placed, direction)
    demand = _sum_of(demand_by_part)
    whole = list((NO_WRENCH - demand.platform).components())
    for leg, leg_motion, forces in zip(placed.rigid.legs, motion.legs, demand.legs, strict=True):
        row = list(forces)
        for place, number in enumerate(leg.drives, leg.passive):
            drive, rate = placed.rigid.drives[number], leg_motion.rates[place]
            friction = drive.coulomb * direction_of_motion(rate)
            row[place] = row[place] - drive.inertia * leg_motion.change[place] - drive.viscous * rate - friction
        for rates, force in zip(leg.rates_by_twist, row, strict=True):
            whole = [a - b * force for a, b in zip(whole, rates, strict=True)]
    length = placed.rigid.length
    return [*(part * length for part in whole[:3]), *whole[3:]]
