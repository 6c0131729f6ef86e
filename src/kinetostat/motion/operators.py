"""The equations of motion of a rigid machine at a pose: what moves it, and M, C, g over the pose and over the drives.

Everything that follows from a pose and a motion over scalars starts here: `pose_of` places a machine, `along` moves it.

Source: theory (94) and (95).
"""

from collections.abc import Mapping, Sequence
from functools import cached_property

from kinetostat.algebra.scalar import Scalar, total
from kinetostat.algebra.screw import Twist
from kinetostat.algebra.solve import Row, dual_basis
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.machine.parameters import POSE, values
from kinetostat.motion.forces import DriveStatics, ForceDemand, demands, drive_forces, drive_statics, inertia, weight
from kinetostat.motion.rates import (
    STILL,
    Coordinates,
    LegMotion,
    MachineMotion,
    Moving,
    PoseRates,
    angles_of,
    coordinates_of,
    machine_motion,
    motion_along,
    placed_platform,
    platform_motion,
)
from kinetostat.motion.rigid import MotionPlan, RigidMachine, mechanism_over_scalars, rigid_machine


@dataclass(frozen=True)
class MachineAtPose:
    """A machine of rigid parts at a pose, ready to be moved.

    Attributes:
        machine: with its numbers, of any kind.
        configuration: where everything is.
        rigid: its rigid parts.
        names: of the coordinates of its pose.
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

    def along(
        self, direction: PoseRates, moving: PoseRates | None = None, there: MachineMotion | None = None
    ) -> MachineMotion:
        """Move it along a direction.

        Args:
            direction: the direction, and how it changes.
            moving: how the machine moves, if that is not this direction.
            there: its motion then.
        """
        if self.coordinates is None:
            placement = placed_platform(self.machine, direction, moving or direction)
            return machine_motion(self.rigid, platform_motion(self.rigid, placement), there)
        return motion_along(self.rigid, self.coordinates, direction, there)

    def drive_rates(self, motion: MachineMotion, change: bool = False) -> Row:
        """Rates of the drives in a motion, or how these change: rad or units of the machine's length."""
        result: Row = [0.0] * len(self.rigid.drives)
        for leg, moving in zip(self.rigid.legs, motion.legs, strict=True):
            for place, number in enumerate(leg.drives, leg.passive):
                result[number] = (moving.change if change else moving.rates)[place]
        return result


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
        configuration: where everything is.
        joints: coordinates that close its legs, if it is written leg by leg.
        plan: which motions there are, see `rigid.plan_of`.
        masses: of its links, kg; those that they have at this pose if None.
    """
    mechanism = mechanism_over_scalars(machine, configuration, joints, masses)
    rigid = rigid_machine(machine, mechanism, plan, machine.reference_point(configuration))
    names = tuple(path.removeprefix(POSE) for path in values(machine) if path.startswith(POSE))
    return MachineAtPose(machine, configuration, rigid, names)


def forces_along(here: MachineAtPose, direction: PoseRates) -> tuple[MachineMotion, dict[str, ForceDemand]]:
    """The motion of a machine with its accelerations, and what it asks for, by part."""
    motion = here.along(direction)
    return motion, demands(here.rigid, motion)


@dataclass(frozen=True)
class Operators:
    """M, C and g of the equations of motion M x'' + C x' + g = J^T f over the coordinates of the pose, theory (94).

    Attributes:
        mass: M; kg of lengths, kg·m² of angles, kg·m between them.
        coriolis: C, with dM/dt - 2 C skew-symmetric.
        gravity: g: what holds the weight.
        drive_rates: J: rates of the drives by the coordinates.
        drive_changes: dJ/dt.
    """

    mass: list[Row]
    coriolis: list[Row]
    gravity: Row
    drive_rates: list[Row]
    drive_changes: list[Row]

    def at_drives(self) -> tuple[list[Row], list[Row], Row]:
        """M, C and g over the coordinates of the drives, as many as of the pose, theory (95)."""
        size = range(len(self.gravity))
        back, _ = dual_basis(self.drive_rates)  # rows of J; its dual vectors are the columns of J^-1
        # Rows of J^-T are the dual vectors.
        lag = [[total([self.mass[i][k] * back[a][k] for k in size]) for a in size] for i in size]  # M J^-1
        coriolis = [
            [
                total([self.coriolis[i][k] * back[a][k] for k in size])
                - total([lag[i][b] * total([self.drive_changes[b][k] * back[a][k] for k in size]) for b in size])
                for a in size
            ]
            for i in size
        ]
        mass = [[total([back[a][i] * lag[i][b] for i in size]) for b in size] for a in size]
        turned = [[total([back[a][i] * coriolis[i][b] for i in size]) for b in size] for a in size]
        gravity = [total([back[a][i] * self.gravity[i] for i in size]) for a in size]
        return mass, turned, gravity


def operators(here: MachineAtPose, rates: Mapping[str, Scalar]) -> Operators:
    """M, C and g over the coordinates of the pose, SI.

    Args:
        here: the machine at its pose.
        rates: of the coordinates, by name.
    """
    nothing = dict.fromkeys(here.names, 0.0)
    moving = PoseRates(rates, nothing)
    there = here.along(moving)
    columns = [here.along(PoseRates(nothing | {name: 1.0}, nothing), moving, there) for name in here.names]
    length = here.rigid.length
    mass, coriolis = [], []
    for column in columns:
        turned, speeded = inertia(here.rigid, column, there), inertia(here.rigid, _from_rest(column))
        coriolis.append([_work(turned, other) * length for other in columns])
        mass.append([_work(speeded, other) * length for other in columns])
    lifting = weight(here.rigid)
    gravity = [_work(lifting, other) * length for other in columns]
    units = [length if drive.slides else 1.0 for drive in here.rigid.drives]
    by_name = [here.drive_rates(column) for column in columns]
    changing = [here.drive_rates(column, change=True) for column in columns]
    return Operators(
        [list(row) for row in zip(*mass, strict=True)],
        [list(row) for row in zip(*coriolis, strict=True)],
        gravity,
        [[row[a] * unit for row in by_name] for a, unit in enumerate(units)],
        [[row[a] * unit for row in changing] for a, unit in enumerate(units)],
    )


def mass_at_drives(here: MachineAtPose) -> list[Row]:
    """M over the coordinates of the drives, as many as of the pose, SI, theory (95)."""
    nothing, length = dict.fromkeys(here.names, 0.0), here.rigid.length
    columns = [here.along(PoseRates(nothing | {name: 1.0}, nothing)) for name in here.names]
    gains = [inertia(here.rigid, _from_rest(column)) for column in columns]
    mass = [[_work(demand, other) * length for demand in gains] for other in columns]
    units = [length if drive.slides else 1.0 for drive in here.rigid.drives]
    by_name = [here.drive_rates(column) for column in columns]
    rates = [[row[a] * unit for row in by_name] for a, unit in enumerate(units)]
    nothings = [0.0] * len(rates)
    return Operators(mass, [nothings] * len(rates), nothings, rates, [nothings] * len(rates)).at_drives()[0]


def loads_by_acceleration(here: MachineAtPose) -> list[Twist]:
    """Load of each drive, positive where its joint is pulled open, per unit of acceleration of the platform from rest.

    A drive that accelerates a machine by a, at the tool point, carries a . row of it beside what it carries at rest:
    N, or N·m of rotary drives, per m/s² and rad/s². Accelerations that structure does not allow do not count in a row.

    Source: theory (90) and (92).
    """
    rigid, shrink = here.rigid, 1.0 / here.rigid.length
    rows: list[list[Scalar]] = [[0.0] * 6 for _ in rigid.drives]
    for way in here.statics.ways:
        moved = machine_motion(rigid, Moving(Twist(Vector(*way[:3]), Vector(*way[3:])), STILL))
        forces = drive_forces(rigid, here.statics, inertia(rigid, _from_rest(moved)))
        rows = [[a - b * f for a, b in zip(row, way, strict=True)] for row, f in zip(rows, forces, strict=True)]
    levers = [1.0 if drive.slides else rigid.length for drive in rigid.drives]
    return [
        Twist(Vector(*row[:3]) * lever, Vector(*row[3:]) * (lever * shrink))
        for row, lever in zip(rows, levers, strict=True)
    ]


def _from_rest(motion: MachineMotion) -> MachineMotion:
    """The motion whose accelerations are the rates of another one, from rest."""
    legs = tuple(
        LegMotion([0.0] * len(leg.rates), leg.rates, tuple(Moving(STILL, body.twist) for body in leg.bodies), STILL)
        for leg in motion.legs
    )
    return MachineMotion(Moving(STILL, motion.platform.twist), legs)


def _work(demand: ForceDemand, motion: MachineMotion) -> Scalar:
    """The power of what is asked for along a motion, in units of the machine's length."""
    works = [demand.platform.work(motion.platform.twist)]
    for row, leg in zip(demand.legs, motion.legs, strict=True):
        works += [force * rate for force, rate in zip(row, leg.rates, strict=True)]
    return total(works)
