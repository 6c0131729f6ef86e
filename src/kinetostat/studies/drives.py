"""Drives along a motion: speed, force, power and energy of each and of its motor, loads of joints, deflection of tool.

Parts are rigid (theory section 20). The tool deflects as springs do under the same forces, at rest at one pose after
the other. Formulas are in `motion`, motions in `motions`. Nothing is drawn here.

Source: theory (99).
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kinetostat.arrays import Array, Codes, Mask
from kinetostat.engine.batch import evaluate
from kinetostat.engine.moving import PathForces, RigidForm, forces_on_path
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import REGULAR, Status
from kinetostat.kinetostatics.drive_limits import driven_springs
from kinetostat.machine.actuators import name_of, numbers_of_drive, rotor_turns
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import Machine
from kinetostat.motion.forces import PARTS
from kinetostat.motion.machine_at_pose import joints_of
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names
from kinetostat.studies.dynamics import coordinates_of_drives, rigid_form_of, senses_of_drives
from kinetostat.studies.motion_deflection import ModesAlong, deflections, modes_along
from kinetostat.studies.motions import Motion, read_motion, required_motion
from kinetostat.studies.worst_directions import every_direction
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY
from kinetostat.units import KINDS, UnitError

MOST_NAMED = 3
"""Drives that a sentence names."""
PASSABLE = (*REGULAR, Status.UNDECIDED)
"""Statuses of poses at which drives have forces: limits of the file are compared with, but stop no motion."""


class MotorPower(NamedTuple):
    """Greatest power of a motor, W, and the least: negative where it brakes, else 0."""

    greatest: float
    least: float


class MotorEnergy(NamedTuple):
    """Energy that a motor gives in a motion, less what it takes back, and what it takes back while it brakes, J."""

    net: float
    braking: float


class WorstPoint(NamedTuple):
    """Number of a point of a motion, and name of the drive that is loaded most there."""

    point: int
    drive: str


@dataclass(frozen=True)
class DriveLoad:
    """A drive along a motion; quantities of a linear drive are N, m/s, m, those of a rotary one N·m, rad/s, rad.

    Attributes:
        name: name of the drive.
        slides: whether it is linear.
        turns: rotation of its rotor, rad per m or rad of its coordinate; 1 where the file gives neither lead nor ratio:
            its motor is then the drive itself.
        rotary: whether its motor turns.
        coordinate: least and greatest coordinate.
        speed, acceleration, force: greatest sizes at the drive.
        rms_force: root of the mean square of the force over time.
        parts: greatest size of each part of the force, by name, see `motion.forces.PARTS`.
        motor_speed, motor_torque, rms_torque: values at the motor, rad/s and N·m; of a linear motor m/s and N.
        power: its motor's greatest and least power.
        energy: its motor's energy in the whole motion; NaN where no time passes.
        reflected: greatest inertia that the motor accelerates beside its rotor, while the other drives stand still:
            kg·m², or kg of a linear motor; None where drives cannot move one by one.
        inertia_ratio: ratio of that inertia to the rotor's; None without a rotor.
    """

    name: str
    slides: bool
    turns: float
    rotary: bool
    coordinate: tuple[float, float]
    speed: float
    acceleration: float
    force: float
    rms_force: float
    parts: Mapping[str, float]
    motor_speed: float
    motor_torque: float
    rms_torque: float
    power: MotorPower
    energy: MotorEnergy
    reflected: float | None
    inertia_ratio: float | None

    @property
    def unit(self) -> str:
        """Unit of its force or moment."""
        return "N" if self.slides else "N·m"

    @property
    def motor_unit(self) -> str:
        """Unit of its motor's torque or force."""
        return "N·m" if self.rotary else "N"


@dataclass(frozen=True)
class JointLoad:
    """The greatest force, N, and moment about its point, N·m, that a joint passes on; a slide's moment is None."""

    name: str
    force: float
    moment: float | None


@former_names(energy="net_energy")
@dataclass(frozen=True)
class DriveCurves:
    """Drives at all points of a motion [drives x n], SI.

    Attributes:
        coordinate, speed, acceleration, force: values at the drive.
        parts: parts of the force [drives x parts x n].
        motor_speed, motor_torque, power, net_energy: values at the motor; the energy counts from the beginning, J.
    """

    coordinate: Array
    speed: Array
    acceleration: Array
    force: Array
    parts: Array
    motor_speed: Array
    motor_torque: Array
    power: Array
    net_energy: Array


@dataclass(frozen=True, eq=False)
class DriveLoads(ImmutableAnswer):
    """The demands of a motion on the drives of a machine.

    Attributes:
        machine: the machine with its masses.
        status: status of the first pose that has no answer, else OK.
        message: the answer in a sentence.
        motion: the motion.
        drives: each drive; none without an answer.
        joints: the load of each joint.
        curves: the drives over time; None without an answer.
        deflection: quasi-static deflection of the tool point [n x 6], rad and m; NaN where K does not hold it.
        worst: the point at which the drive with the greatest torque of all motors has its greatest force.
        along_modes: the modes of the machine at its pose along the motion; None where they are not known.
        requirements: verdicts on the motors that the machine's file requires, where they were asked for.
    """

    machine: Machine
    status: Status
    message: str
    motion: Motion
    drives: tuple[DriveLoad, ...] = ()
    joints: tuple[JointLoad, ...] = ()
    curves: DriveCurves | None = None
    deflection: Array | None = None
    worst: WorstPoint | None = None
    along_modes: ModesAlong | None = None
    requirements: tuple[Any, ...] = ()

    def __repr__(self) -> str:
        return f"<Drives of {self.machine.name!r}: {self.message}>"

    @property
    def greatest_deflection(self) -> tuple[float, int] | None:
        """The greatest displacement of the tool point at rest under the same forces, m, and the number of its point.

        None where it is not known.
        """
        if self.deflection is None or np.isnan(self.deflection).all():
            return None
        sizes = np.linalg.norm(self.deflection[:, 3:], axis=1)
        return float(np.nanmax(sizes)), int(np.nanargmax(sizes))

    @property
    def greatest_with_modes(self) -> tuple[float, float] | None:
        """The greatest displacement of the tool point with the excited modes, m, and its time, s; None if not known."""
        if self.along_modes is None or self.deflection is None or np.isnan(self.deflection).any():
            return None
        at_rest = [np.interp(self.along_modes.times, self.motion.times, row) for row in self.deflection[:, 3:].T]
        sizes = np.linalg.norm(np.transpose(at_rest) + self.along_modes.surplus[:, 3:], axis=1)
        return float(sizes.max()), float(self.along_modes.times[sizes.argmax()])


@checked
def drives(
    machine: Machine | MachineState,
    motion: Path | Motion | None = None,
    points: int = 400,
    speed: float | str | None = None,
    acceleration: float | str | None = None,
) -> DriveLoads:
    """Compute what a motion asks of the drives of a machine of rigid parts.

    Args:
        machine: the machine with masses, friction, and lead or ratio of its drives.
        motion: a motion, or the path of its CSV file: poses with times, poses with a feed rate, or sines; forces on
            the platform may be columns, such as force.x [N]. None for a speed and an acceleration of the platform
            point at the pose of the machine, in the worst directions; without these, for the motion of the file's
            requirements.
        points: number of points of the motion that are looked at, about.
        speed, acceleration: those of the platform point, without a motion: m/s and m/s², or texts with a unit.

    Raises:
        InputError: the file is not a motion, or the drives do not hold the machine.
    """
    state = state_of(machine)
    if points < 2:
        raise InputError(f"points is {points}; a motion is looked at two points or more.")
    if motion is None and speed is None and acceleration is None:
        motion = required_motion(state.machine, points)
    form = rigid_form_of(state)
    if motion is None:
        motion = every_direction(form, _amount("speed", speed), _amount("acceleration", acceleration))
    elif speed is not None or acceleration is not None:
        raise InputError("a motion says its speed and acceleration itself; give either a motion or these.")
    elif isinstance(motion, Path):
        motion = read_motion(state.machine, motion, points)
    return drive_loads(state, form, motion)


def drive_loads(state: MachineState, form: RigidForm, motion: Motion) -> DriveLoads:
    """Compute what a motion asks of the drives of a machine: see `drives`.

    Args:
        state: state of the machine.
        form: form of its equations.
        motion: the motion.

    Raises:
        InputError: nothing of the machine has a mass, friction or a load.
    """
    if not (any(np.any(rows) for rows in motion.path.loads.values()) or _has_forces(state, form)):
        raise InputError(
            f"nothing of {state.machine.name} has a mass, friction or a load, so that no motion asks anything of its "
            'drives; give it one, e.g. --set tool.mass="5 kg".'
        )
    codes = evaluate(state.machine, PointTable(motion.path.columns), ["singularity_margin"]).status
    impassable = np.flatnonzero(~np.isin(codes, PASSABLE))
    if impassable.size:
        status = Status(int(codes[impassable[0]]))
        where = f"at {motion.times[impassable[0]]:.4g} s the pose is {status.phrase}"
        message = f"The motion cannot be followed: {where}. {status.sentence} {motion.unit_doubt}".rstrip()
        return DriveLoads(state.machine, status, message, motion)
    forces = forces_on_path(form, motion.path, joints=True)
    motors = _motors_of(state)
    curves = _curves(state, motors, motion, forces)
    summaries = [_summary(k, motors, motion, forces, curves) for k in range(len(motors.springs))]
    joints = [
        JointLoad(joint.name, float(load[0].max()), _moment(load, joint.turns, float(state.configuration.length)))
        for joint, load in zip(joints_of(state.configuration), forces.joints, strict=True)
    ]
    largest = max(range(len(summaries)), key=lambda k: abs(summaries[k].motor_torque))
    message = _message(state.machine, motion, summaries) + _wrong_signs(state, curves) + _limits_passed(motion, codes)
    return DriveLoads(
        machine=state.machine,
        status=Status.OK,
        message=message,
        motion=motion,
        drives=tuple(summaries),
        joints=tuple(joints),
        curves=curves,
        deflection=deflections(state.machine, motion, forces),
        worst=WorstPoint(int(np.argmax(np.abs(curves.force[largest]))), summaries[largest].name),
        along_modes=modes_along(state, form, motion, forces.wrench),
    )


def _amount(kind: str, amount: float | str | None) -> float:
    """A speed or an acceleration, SI; the platform may stand still, but without an acceleration nothing is asked."""
    quantity = Quantity(kind, "", positive=kind == "acceleration")
    if amount is None:
        raise InputError(
            f"{kind} is not given: without a motion, drives needs the speed and the acceleration of the platform "
            f'point, e.g. {kind} = "{KINDS[kind].example}".'
        )
    try:
        return quantity.number(amount)
    except UnitError as error:
        raise InputError(f"{kind} is {shorten(amount)}: {error}.") from None


def _moment(load: Array, turns: bool, length: float) -> float | None:
    """The greatest moment that a joint passes on, N·m; 0 where it is round-off of its force."""
    if not turns:
        return None
    moment = float(load[1].max())
    return moment if moment > ROUND_OFF_OF_ENTRY * float(load[0].max()) * length else 0.0


def _has_forces(state: MachineState, form: RigidForm) -> bool:
    """Whether anything of the machine itself asks forces of its drives: loads, masses or friction."""
    rigid = form.at(state).rigid
    has_loads = any(abs(float(component)) > 0.0 for component in rigid.process.components())
    has_masses = bool(rigid.platform) or any(leg.masses for leg in rigid.legs)
    drives_resist = any(
        drive.inertia or drive.viscous or drive.coulomb or drive.guide_friction for drive in rigid.drives
    )
    joints_resist = any(joint.coulomb or joint.viscous for leg in rigid.legs for joint in leg.friction)
    return has_loads or has_masses or drives_resist or joints_resist


@dataclass(frozen=True)
class _Motors:
    """The motors of all drives, and how they turn with them.

    Attributes:
        springs: the spring of each drive's actuator.
        numbers: the table [drives] as each drive has it.
        turns: rad of the rotor per unit of the drive's coordinate; 1 where the motor is the drive itself [drives].
        rotary: whether the motor turns; that of a linear drive does where the file gives its lead [drives].
    """

    springs: tuple[Spring, ...]
    numbers: tuple[Any, ...]
    turns: Array
    rotary: Mask

    def column(self, name: str) -> Array:
        """A field of the tables [drives], a row for each drive [drives x 1]."""
        return np.array([getattr(numbers, name) for numbers in self.numbers])[:, None]


def _motors_of(state: MachineState) -> _Motors:
    springs = driven_springs(state.configuration)
    numbers = [numbers_of_drive(state.machine, "drives", spring) for spring in springs]
    turns = np.array([float(rotor_turns(spring, table)) for spring, table in zip(springs, numbers, strict=True)])
    slides = np.array([spring.joint.point is None for spring in springs])
    return _Motors(tuple(springs), tuple(numbers), np.where(turns > 0.0, turns, 1.0), ~slides | (turns > 0.0))


def _curves(state: MachineState, motors: _Motors, motion: Motion, forces: PathForces) -> DriveCurves:
    """Drives and, theory (99), their motors at all points."""
    senses = senses_of_drives(state)[:, None]
    speed, acceleration = forces.drives[:, 0] * senses, forces.drives[:, 1] * senses
    parts = forces.drives[:, 2:] * senses[:, :, None]
    force = parts.sum(axis=1)
    turns, efficiency = motors.turns[:, None], motors.column("efficiency")
    inertia, damping, friction = map(motors.column, ("rotor_inertia", "rotor_damping", "rotor_friction"))
    rotor = inertia * acceleration * turns + damping * speed * turns + friction * np.sign(speed)
    rotor = np.where(motors.rotary[:, None], rotor, 0.0)
    transmitted = force / turns - rotor  # by gear or screw, to the machine
    loss = np.where(transmitted * speed > 0.0, 1.0 / efficiency, efficiency)
    torque = rotor + transmitted * loss
    power = torque * speed * turns
    steps = 0.5 * (power[:, 1:] + power[:, :-1]) * np.diff(motion.times)
    energy = np.concatenate([np.zeros((len(power), 1)), np.cumsum(steps, axis=1)], axis=1)
    return DriveCurves(
        coordinate=coordinates_of_drives(state, motion.path.columns, motion.path.size),
        speed=speed,
        acceleration=acceleration,
        force=force,
        parts=parts,
        motor_speed=speed * turns,
        motor_torque=torque,
        power=power,
        net_energy=energy,
    )


def root_mean_square(times: Array, rows: Array) -> Array:
    """Roots of the mean squares of curves over time [rows]; NaN where no time passes."""
    if times[-1] == times[0]:
        return np.full(rows.shape[:-1], np.nan)
    return np.asarray(np.sqrt(np.trapezoid(rows * rows, times, axis=-1) / (times[-1] - times[0])))


def _summary(k: int, motors: _Motors, motion: Motion, forces: PathForces, curves: DriveCurves) -> DriveLoad:
    """The drive of number k along the whole motion."""
    spring, turns, power = motors.springs[k], float(motors.turns[k]), curves.power[k]
    rotor = float(motors.numbers[k].rotor_inertia) if motors.rotary[k] else 0.0
    reflected = float(forces.inertia[k].max() / turns**2) - rotor if len(forces.inertia) else None
    braking = np.minimum(0.5 * (power[1:] + power[:-1]), 0.0) * np.diff(motion.times)
    energy = (np.nan, np.nan) if motion.timeless else (float(curves.net_energy[k, -1]), float(-braking.sum()))
    return DriveLoad(
        name=name_of(spring),
        slides=spring.joint.point is None,
        turns=turns,
        rotary=bool(motors.rotary[k]),
        coordinate=(float(curves.coordinate[k].min()), float(curves.coordinate[k].max())),
        speed=_size(curves.speed[k]),
        acceleration=_size(curves.acceleration[k]),
        force=_size(curves.force[k]),
        rms_force=float(root_mean_square(motion.times, curves.force[k])),
        parts={part: _size(curves.parts[k, i]) for i, part in enumerate(PARTS)},
        motor_speed=_size(curves.motor_speed[k]),
        motor_torque=_size(curves.motor_torque[k]),
        rms_torque=float(root_mean_square(motion.times, curves.motor_torque[k])),
        power=MotorPower(greatest=float(power.max()), least=float(min(power.min(), 0.0))),
        energy=MotorEnergy(*energy),
        reflected=reflected,
        inertia_ratio=reflected / rotor if reflected is not None and rotor else None,
    )


def _size(row: Array) -> float:
    return float(np.abs(row).max())


def _wrong_signs(state: MachineState, curves: DriveCurves) -> str:
    """A sentence on drives that only pull or only push and would have to do the other thing; empty without any."""
    signs = {"pulls": 1.0, "pushes": -1.0}
    rows = zip(driven_springs(state.configuration), curves.force * senses_of_drives(state)[:, None], strict=True)
    wrong = [name_of(spring) for spring, row in rows if spring.acts and (row * signs[spring.acts]).max() > 0.0]
    if not wrong:
        return ""
    shown = ", ".join(wrong[:MOST_NAMED]) + (", ..." if len(wrong) > MOST_NAMED else "")
    return f" {shown} cannot do what would be asked of them: they carry loads of one sign only."


def _limits_passed(motion: Motion, codes: Codes) -> str:
    """A sentence on the first pose that passes a limit of the file; empty without one."""
    passed = np.flatnonzero(codes == Status.JOINT_LIMIT)
    if not passed.size:
        return ""
    where = "the pose passes" if motion.timeless else f"from {motion.times[passed[0]]:.4g} s on some poses pass"
    return f" But {where} a limit of the file, see `kinetostat analyze` there. {motion.unit_doubt}".rstrip()


def _message(machine: Machine, motion: Motion, summaries: list[DriveLoad]) -> str:
    show = machine.display.show
    strongest = max(summaries, key=lambda drive: drive.motor_torque)
    fastest = max(summaries, key=lambda drive: drive.motor_speed)
    rate = f"{fastest.motor_speed * 30.0 / np.pi:.4g} 1/min"
    speed = rate if fastest.rotary else show(fastest.motor_speed, "m") + "/s"
    hottest = max(summaries, key=lambda drive: drive.rms_torque)
    mean = "" if motion.timeless else f"{show(hottest.rms_torque, hottest.motor_unit)} RMS at most ({hottest.name}), "
    return (
        f"{'In' if motion.timeless else 'Along'} {motion.kind}, the motors give up to "
        f"{show(strongest.motor_torque, strongest.motor_unit)} ({strongest.name}), {mean}at up to {speed}, and up to "
        f"{max(drive.power.greatest for drive in summaries):.4g} W each."
    )
