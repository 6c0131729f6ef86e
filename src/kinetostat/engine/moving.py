"""Motions of many points: drives and joints of a machine of rigid parts, traced and compiled, or by columns for a few.

No formula lives here.
"""

import math
from collections.abc import Mapping
from dataclasses import field

import numpy as np

from kinetostat.algebra.scalar import Scalar, where
from kinetostat.algebra.symmetric import SIZE
from kinetostat.arrays import Array, Codes, Integers
from kinetostat.engine.form import (
    Form,
    Specimen,
    TracedFormula,
    form_of,
    formula_of,
    new_inputs,
    result_of,
    traced_joints,
    traced_machine,
)
from kinetostat.engine.kernel import closes_inside, program_columns, program_of, recipe_of
from kinetostat.equilibrium.state import MachineState, states_at
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints, within_reach
from kinetostat.kinematics.status import Status
from kinetostat.machine.column import column, stacked_columns
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.machine.parameters import POSE
from kinetostat.motion.machine_at_pose import (
    NUMBERS_OF_DRIVE,
    MachineAtPose,
    at_pose,
    drive_numbers,
    joint_numbers,
    joints_of,
    reflected_inertia,
    tool_wrench,
)
from kinetostat.motion.rates import PoseRates
from kinetostat.motion.rigid import MotionPlan, masses_of_links, plan_of

COMPILED_FROM = 2000
"""Points from which machine code pays. Columns take 0.1 s for so many and compiling takes 0.2 s or more, but only once
for a form of machines: the code is kept on disk, and few motions of so many points are asked for only once."""


@dataclass(frozen=True)
class PosePath:
    """Points of a motion.

    Attributes:
        pose: coordinates of the pose by name, m or rad [n].
        rates: rates of these coordinates, per second [n].
        accelerations: their second rates, per second squared [n].
        loads: forces and moments on the platform along the motion, by leaf path, N or N·m [n]; those that are not
            listed are the machine's.
    """

    pose: Mapping[str, Array]
    rates: Mapping[str, Array]
    accelerations: Mapping[str, Array]
    loads: Mapping[str, Array] = field(default_factory=dict)

    @property
    def columns(self) -> dict[str, Array]:
        """All parameters of the machine that vary along it, by leaf path, SI."""
        return {POSE + name: np.asarray(rows, dtype=float) for name, rows in self.pose.items()} | {
            path: np.asarray(rows, dtype=float) for path, rows in self.loads.items()
        }

    @property
    def size(self) -> int:
        """Number of points."""
        return len(next(iter(self.pose.values())))

    def at(self, rows: Integers) -> "PosePath":
        """Return some of its points, by number."""
        pose, rates, accelerations, loads = (
            {name: np.asarray(values)[rows] for name, values in part.items()}
            for part in (self.pose, self.rates, self.accelerations, self.loads)
        )
        return PosePath(pose, rates, accelerations, loads)


@dataclass(frozen=True)
class PathForces:
    """Drives and joints along a motion; NaN where the machine has no place.

    Attributes:
        drives: numbers of each drive, see `machine_at_pose.NUMBERS_OF_DRIVE` [drives x numbers x n], SI.
        joints: force (N) and moment (N·m) of each joint [joints x 2 x n]; none if they are not asked for.
        wrench: wrench of the tool, see `machine_at_pose.tool_wrench` [6 x n], N·m and N; none without joints.
        inertia: reflected inertia of each drive [drives x n], kg or kg·m²; none without joints, or if there are more
            drives than coordinates.
        status: `Status` codes [n].
    """

    drives: Array
    joints: Array
    wrench: Array
    inertia: Array
    status: Codes

    @classmethod
    def of_rows(cls, rows: Array, status: Codes, drive_count: int, joint_count: int) -> "PathForces":
        """Take apart what `numbers_along` gives, a row for each number [numbers x n].

        Args:
            rows: the numbers.
            status: `Status` codes [n].
            drive_count: number of drives.
            joint_count: number of joints with a load; 0 where the numbers are those of drives alone.
        """
        ends = np.cumsum([drive_count * len(NUMBERS_OF_DRIVE), 2 * joint_count, SIZE])
        drives, joints, wrench, inertia = np.split(rows, ends)
        return cls(
            drives=drives.reshape(drive_count, len(NUMBERS_OF_DRIVE), len(status)),
            joints=joints.reshape(joint_count, 2, len(status)),
            wrench=wrench,
            inertia=inertia,
            status=status,
        )


def numbers_along(placed: MachineAtPose, direction: PoseRates, joints_too: bool) -> list[Scalar]:
    """Return the numbers of a machine along a motion, in the order that `PathForces.of_rows` takes apart.

    Args:
        placed: the machine at its pose.
        direction: the motion.
        joints_too: whether loads of joints, the wrench of the tool and reflected inertia follow those of the drives.
    """
    numbers = drive_numbers(placed, direction)
    if joints_too:
        numbers += joint_numbers(placed, direction, joints_of(placed.configuration))
        numbers += [*tool_wrench(placed, direction), *reflected_inertia(placed)]
    return numbers


def _status_of(configuration: Configuration, joints: Joints | None) -> Scalar:
    """Return the `Status` code of a pose at which a machine only has to be placed: its joints close, its legs reach."""
    status: Scalar = int(Status.OK) if joints is None else joints.status
    return where(within_reach(configuration), status, int(Status.OUT_OF_REACH))


def motion_of(
    kind: Specimen, form: Form, plan: MotionPlan, links: int, joints_too: bool, closed: bool = False
) -> TracedFormula:
    """Trace what the drives of a machine of rigid parts do along a motion, and if wanted what its joints pass on.

    Columns after those of the pose and of joints are the rates of the pose's coordinates, their accelerations, and the
    masses of so many links.

    Args:
        kind: kind of the machine.
        form: how its parameters enter; its pose varies, and loads may.
        plan: which motions there are.
        links: how many links have a mass that does not follow the pose; 0 for masses as they are at each pose.
        joints_too: see `numbers_along`.
        closed: whether joints are closed inside the program.
    """
    traced = traced_machine(kind, form)
    joints, columns = traced_joints(traced, closed)
    configuration = traced.machine.configure(joints.coordinates if joints else ())
    names = [path.removeprefix(POSE) for path in form.varying if path.startswith(POSE)]
    size = len(names)
    rates, accelerations, masses = (new_inputs(traced.graph, count) for count in (size, size, links))
    direction = PoseRates(dict(zip(names, rates, strict=True)), dict(zip(names, accelerations, strict=True)))
    placed = at_pose(traced.machine, configuration, joints, plan, masses or None)
    numbers, status = numbers_along(placed, direction, joints_too), _status_of(configuration, joints)
    accepted = status < Status.OK + 0.5  # codes are traced as floats
    results = [result_of(where(accepted, number, math.nan)) for number in numbers]
    return formula_of(traced, columns, results, result_of(status), coordinates=(*rates, *accelerations, *masses))


@dataclass(frozen=True)
class RigidForm:
    """The form of a machine's equations, found once: the motions that it has, and the masses of its links.

    Attributes:
        machine: the machine at the pose at which its telescopic legs have their mass.
        plan: which motions there are.
        masses: masses of its links at this pose, kg, which they keep; empty if no link has one, or if the machine is
            written leg by leg: its masses are then those of its file at every pose.
    """

    machine: Machine
    plan: MotionPlan
    masses: tuple[float, ...]

    def at(self, state: MachineState) -> MachineAtPose:
        """Take the rigid parts of the machine in a state, at its pose or at n poses."""
        return at_pose(state.machine, state.configuration, state.joints, self.plan, self.masses or None)


def rigid_form(state: MachineState) -> RigidForm:
    """Decide what the equations of a machine look like, at its pose."""
    plan = plan_of(state.machine, state.configuration, state.joints)
    in_closed_form = state.machine.family.chains is None
    masses = tuple(map(float, masses_of_links(state.machine, state.configuration))) if in_closed_form else ()
    return RigidForm(state.machine, plan, masses if any(masses) else ())


def forces_on_path(form: RigidForm, path: PosePath, joints: bool = False, compiled: bool | None = None) -> PathForces:
    """Compute what drives do along a motion, and if wanted what joints pass on.

    Args:
        form: form of the machine's equations.
        path: the points of the motion.
        joints: whether loads of joints and reflected inertia are wanted.
        compiled: whether by machine code; if None, where there are many points.
    """
    state = MachineState(form.machine)
    by_program = path.size >= COMPILED_FROM if compiled is None else compiled
    rows, status = (_rows_by_program if by_program else _rows_by_columns)(form, path, joints)
    joint_count = len(joints_of(state.configuration)) if joints else 0
    return PathForces.of_rows(rows, status, len(form.at(state).rigid.drives), joint_count)


def _rows_by_columns(form: RigidForm, path: PosePath, joints_too: bool) -> tuple[Array, Codes]:
    """Compute the numbers of a motion [numbers x n] and its status codes by NumPy, all points at once."""
    with np.errstate(all="ignore"):
        state = states_at(form.machine, path.columns, path.size)
        rates, accelerations = (
            {name: column(np.asarray(values, dtype=float)) for name, values in part.items()}
            for part in (path.rates, path.accelerations)
        )
        numbers = numbers_along(form.at(state), PoseRates(rates, accelerations), joints_too)
        status = np.asarray(_status_of(state.configuration, state.joints))
        rows = stacked_columns(numbers, path.size).T.copy()
    codes = np.broadcast_to(status, (path.size,)).astype(np.int8)
    rows[:, codes != Status.OK] = np.nan
    return rows, codes


def _rows_by_program(form: RigidForm, path: PosePath, joints_too: bool) -> tuple[Array, Codes]:
    """Compute the same by machine code; points at which it finds no joints in closed form are closed before it."""
    closed = closes_inside(form.machine)
    rows, status = _run_program(form, path, joints_too, closed)
    unsolved = np.flatnonzero(status == Status.NOT_CONVERGED)
    if closed and unsolved.size:
        rows[:, unsolved], status[unsolved] = _run_program(form, path.at(unsolved), joints_too, closed=False)
    return rows, status


def _run_program(form: RigidForm, path: PosePath, joints_too: bool, closed: bool) -> tuple[Array, Codes]:
    """Run the program of `motion_of`, whose columns of rates, accelerations and masses follow those of the pose."""
    machine, varying = form.machine, path.columns
    shape, fixed = form_of(machine, list(varying))
    links, kind = len(form.masses), Specimen(machine)
    recipe = recipe_of(motion_of, kind, shape, plan=form.plan, links=links, joints_too=joints_too, closed=closed)
    program = program_of(recipe)
    program_inputs = program_columns(machine, shape, varying, path.size, closed)
    # In the order of the pose, with which `path.columns` begin.
    program_inputs += [
        np.ascontiguousarray(part[name], dtype=float) for part in (path.rates, path.accelerations) for name in path.pose
    ]
    program_inputs += [np.full(path.size, mass) for mass in form.masses]
    rows, status = np.empty((program.rows, path.size)), np.empty(path.size, dtype=np.int8)
    program.run(fixed, program_inputs, rows, status)
    return rows, status
