"""Requirements judged: at every pose that they name, with margin and worst pose. Its table is in `views`.

A pose that has no result fails its requirement: a machine that cannot get there does not meet it.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinetostat.arrays import Array
from kinetostat.display import Display
from kinetostat.engine.batch import Evaluation, evaluate
from kinetostat.engine.points import Points, PointTable
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, needs_state
from kinetostat.late import LateModule
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, shown, values
from kinetostat.spec.arguments import checked
from kinetostat.spec.document import parse
from kinetostat.spec.errors import InputError, choice
from kinetostat.spec.immutable import Immutable
from kinetostat.spec.requirements import Requirement
from kinetostat.studies.csv_columns import GivenColumn
from kinetostat.studies.evaluation import point_of_file
from kinetostat.studies.poses import chosen_axes, grid_of, listed_fields, read_columns
from kinetostat.studies.quantities import PoseCondition, parse_condition, refuse_absent

if TYPE_CHECKING:
    from kinetostat.studies import motions, motors
    from kinetostat.studies.drives import DriveLoads
else:
    motions = LateModule("kinetostat.studies.motions")
    motors = LateModule("kinetostat.studies.motors")

MOST_POSES = 5_000_000
"""Poses at which a requirement is judged: their quantities fit in memory, half a gigabyte for a dozen."""
SMALL_MOTIONS = ("displacement_", "reversal_error_")
"""Beginnings of the names of quantities that are small motions, which have units of their own."""
MANIFOLD = 2.0
"""Margin from which a multiple of the bound is shown instead of a percentage: "3 times" reads better than "200 %"."""


@dataclass(frozen=True, eq=False)
class Verdict(Immutable):
    """Whether a machine meets one condition of a requirement.

    Attributes:
        name: name of the requirement.
        condition: the condition as written, with single spaces.
        quantity: name of its quantity.
        unit: unit of the worst value, SI.
        bound: the bound, SI.
        poses: number of poses at which the condition must hold.
        where: the poses in words.
        met: whether it holds at all of them.
        worst: the worst value, SI; None where the worst pose has no result.
        margin: share of the bound by which the worst value keeps it, negative where it does not; None where the worst
            pose has no result, or the bound is 0 or the value infinite.
        worst_pose: fields that give the worst pose, SI, by path; empty at the pose of the file.
        place: the worst pose in words; empty at the pose of the file.
        status: status of the worst pose, in a word.
        failed: number of poses at which it does not hold.
        words: the case in words, where the condition is not about a quantity; else empty.
    """

    name: str
    condition: str
    quantity: str
    unit: str
    bound: float
    poses: int
    where: str
    met: bool
    worst: float | None
    margin: float | None
    worst_pose: Mapping[str, float]
    place: str
    status: str
    failed: int
    words: str = ""

    def sentence(self, display: Display) -> str:
        """The condition, where it must hold, what is the case, and by how much.

        Args:
            display: units and digits.
        """
        if self.words:
            return f"{self.condition} {self.where}: {self.words}"
        there = f" at {self.place}" if self.place else ""
        where = self.where if self.poses == 1 else f"at {self.poses:,} poses {self.where}"
        if self.worst is None:
            return f"{self.condition} {where}: there is no result{there} ({self.status.replace('_', ' ')})."
        small = self.quantity.startswith(SMALL_MOTIONS)
        worst = (display.show_deflection if small else display.show)(self.worst, self.unit)
        if self.margin is None:
            return f"{self.condition} {where}: it is {worst}{there}."
        distance = f"{abs(100.0 * self.margin):.3g} % {'better' if self.met else 'worse'} than the bound"
        if self.margin > MANIFOLD:
            distance = f"{1.0 + self.margin:.3g} times the bound"
        return f"{self.condition} {where}: it is {worst}{there}, {distance}."


@checked
def requirements(machine: Machine | MachineState) -> tuple[Verdict, ...]:
    """Judge the requirements of a machine's file, condition by condition.

    Args:
        machine: the machine with its pose and requirements, or its state, as `state_of` returns it.

    Raises:
        InputError: names the requirement and what is wrong with it: an unknown quantity or field, a bad range or value.
    """
    state, judged = state_of(machine), list[Verdict]()
    for name, requirement in state.machine.requirements.items():
        try:
            judged += _verdicts_of(state, name, requirement)
        except InputError as error:
            raise InputError(f"requirements.{name}: {error}") from None
    return tuple(judged)


@checked
def motor_requirements(machine: Machine | MachineState) -> tuple[Verdict, ...]:
    """Judge only those requirements of a machine's file that are about motors; see `requirements`."""
    state = state_of(machine)
    about_motors = {name: each for name, each in state.machine.requirements.items() if each.fits}
    return requirements(state_of(replace(state.machine, requirements=about_motors))) if about_motors else ()


def required_motors(machine: Machine) -> "motors.MotorChoice":
    """Return the motors that the requirements of a machine's file name, each along its motion.

    The motors are in the order of the file, without its verdicts; none of a motion that the machine cannot make.
    """
    required = [_motor_along(machine, each) for each in machine.requirements.values() if each.fits]
    stuck = next((each.loads for each in required if each.candidate is None), None)
    if stuck is not None:
        return motors.MotorChoice(machine, stuck.status, stuck.message)
    candidates = tuple(each.candidate for each in required if each.candidate is not None)
    sentences = (
        f"Of {each.name}, which is required, the motion uses {motors.share_in_words(each)}." for each in candidates
    )
    return motors.MotorChoice(machine, Status.OK, " ".join(sentences), candidates)


class _RequiredMotor(NamedTuple):
    """A motor that a requirement names.

    Attributes:
        motion: the motion of the requirement.
        loads: what it asks of the drives with this motor.
        candidate: how the motor fits; None of a motion that the machine cannot make.
    """

    motion: "motions.Motion"
    loads: "DriveLoads"
    candidate: "motors.MotorCandidate | None"


def _motor_along(machine: Machine, requirement: Requirement) -> _RequiredMotor:
    """Return the motor of a requirement along its motion."""
    catalogue = motors.read_catalogue()
    if requirement.catalogue:
        motions.check_lines("catalogue", requirement.catalogue)
        catalogue = motors.catalogue_of(parse(requirement.catalogue, "catalogue"), "catalogue")
    motor = choice(requirement.fits, catalogue.motors, "fits")
    motion = motions.motion_of(requirement, machine)
    geared, inertia = motors.with_transmission(machine, catalogue, requirement.gear, requirement.screw)
    loads = motors.loads_with(geared, catalogue.motors[motor], inertia, motion)
    candidate = None if loads.curves is None else motors.candidate_of(catalogue, motor, loads)
    return _RequiredMotor(motion, loads, candidate)


def _motor_verdict(machine: Machine, name: str, requirement: Requirement) -> Verdict:
    """Judge whether a motor can do a motion: it uses at most its limits, a share of 1."""
    motion, loads, candidate = _motor_along(machine, requirement)
    worst, place, words, pose = None, "", loads.message, dict[str, float]()
    if loads.curves is not None and candidate is not None:
        worst, place = candidate.greatest_share, candidate.drive
        row = [drive.name for drive in loads.drives].index(candidate.drive)
        is_too_fast = candidate.hardest[0] == "speed"
        curves = loads.curves.motor_speed if is_too_fast else loads.curves.motor_torque
        point = int(np.abs(curves[row]).argmax())
        pose = {path: float(column[point]) for path, column in motion.path.columns.items()}
        words = f"the motion uses {motors.share_in_words(candidate)}, most at {candidate.drive}."
    return Verdict(
        name=name,
        condition=f"fits {requirement.fits}",
        quantity="share of the motor's limits",
        unit="1",
        bound=1.0,
        poses=motion.path.size,
        where=f"along {motion.kind}",
        met=worst is not None and worst <= 1.0,
        worst=worst,
        margin=None if worst is None or math.isinf(worst) else 1.0 - worst,
        worst_pose=pose,
        place=place,
        status=loads.status.word,
        failed=int(worst is None or worst > 1.0),
        words=words,
    )


def _verdicts_of(state: MachineState, name: str, requirement: Requirement) -> list[Verdict]:
    """Judge a requirement: a verdict for each of its conditions, at the worst of its poses, or that of its motor."""
    if requirement.fits:
        return [_motor_verdict(state.machine, name, requirement)]
    machine, show = state.machine, state.machine.display.show
    conditions = [parse_condition(text, machine.family.component_names) for text in requirement.demand]
    poses = _poses(machine, requirement)
    names = list(dict.fromkeys(condition.quantity for condition in conditions))
    refuse_absent(state, names, poses.varied)
    if poses.varied or needs_state(machine, names):
        answer = evaluate(machine, poses.points, names)
    else:
        answer = _at_the_pose(state, names)
    return [_verdict(name, condition, answer, poses, show) for condition in conditions]


class _Poses(NamedTuple):
    """The poses of a requirement, the fields that vary over them (none at the pose of the file), and them in words."""

    points: Points
    varied: Sequence[Parameter]
    words: str


def _verdict(
    name: str, condition: PoseCondition, answer: Evaluation, poses: _Poses, show: Callable[[float, str], str]
) -> Verdict:
    """Judge a condition at the worst of some poses.

    Args:
        name: name of the requirement.
        condition: the condition.
        answer: its quantity at the poses.
        poses: the poses.
        show: writes a value in the units of the machine.
    """
    amounts = answer.values[condition.quantity]
    row = _worst_row(condition, amounts)
    columns = poses.points.columns(row, row + 1) if poses.varied else {}
    pose = {path: float(column[0]) for path, column in columns.items()}
    worst = None if np.isnan(amounts[row]) else float(amounts[row])
    holds = condition.holds(amounts)
    return Verdict(
        name=name,
        condition=condition.text,
        quantity=condition.quantity,
        unit=QUANTITIES[condition.quantity].unit,
        bound=condition.value,
        poses=poses.points.size,
        where=poses.words,
        met=bool(holds.all()),
        worst=worst,
        margin=_margin(condition, worst),
        worst_pose=pose,
        place=", ".join(f"{field.shown} {show(pose[field.leaves[0]], field.unit)}" for field in poses.varied),
        status=Status(int(answer.status[row])).word,
        failed=int((~holds).sum()),
    )


def _at_the_pose(state: MachineState, names: Sequence[str]) -> Evaluation:
    """Quantities of the free machine at its pose [1], which the state knows."""
    status = state.free.status
    amounts = {name: float(QUANTITIES[name].value(state.free)) if status == Status.OK else math.nan for name in names}
    return Evaluation({name: np.array([amount]) for name, amount in amounts.items()}, np.array([int(status)]))


def _poses(machine: Machine, requirement: Requirement) -> _Poses:
    """Return the poses of a requirement: those of its ranges, of its list, or else the pose of the file."""
    if requirement.over and requirement.poses:
        raise InputError("it has both over and poses; give one of them, or make two requirements.")
    if requirement.over:
        return _poses_of_box(machine, requirement.over)
    if requirement.poses:
        return _poses_of_list(machine, requirement.poses)
    return _Poses(point_of_file(machine), [], "at the pose of the file")


def _poses_of_box(machine: Machine, over: Sequence[str]) -> _Poses:
    """The poses of all combinations of some ranges."""
    axes = chosen_axes(machine, over)
    grid, fields = grid_of(axes), [field for _, field in axes]
    if grid.size > MOST_POSES:
        raise InputError(f"the box has {grid.size:,} poses; at most {MOST_POSES:,} are judged: lower the counts.")
    return _Poses(grid, fields, f"over {', '.join(field.shown for field in fields)}")


def _poses_of_list(machine: Machine, poses: Sequence[Mapping[str, Any]]) -> _Poses:
    """The poses of a list; coordinates that one does not name are those of the file."""
    of_file, rows = values(machine), []
    for number, pose in enumerate(poses):
        fields = listed_fields(machine, pose, f"poses.{number}")
        rows.append({field.path: pose[name] for name, field in fields.items()})
    columns = [
        GivenColumn(path, np.array([row.get(path, float(of_file[path])) for row in rows], object))
        for path in dict.fromkeys(path for row in rows for path in row)
    ]
    read = read_columns(machine, columns, lambda path, i: f"poses.{i}.{shown(path)}")
    return _Poses(PointTable(read.leaves), list(read.fields), "of the list")


def _worst_row(condition: PoseCondition, amounts: Array) -> int:
    """Return the number of the worst pose: the first without a result, or the one farthest on the wrong side."""
    unanswered = np.flatnonzero(np.isnan(amounts))
    if unanswered.size:
        return int(unanswered[0])
    return int(np.argmin(amounts) if condition.wants_more else np.argmax(amounts))


def _margin(condition: PoseCondition, worst: float | None) -> float | None:
    """The share of the bound by which a value keeps it, see `Verdict.margin`."""
    if worst is None or condition.value == 0.0 or not math.isfinite(worst):
        return None
    spare = worst - condition.value if condition.wants_more else condition.value - worst
    return spare / abs(condition.value)
