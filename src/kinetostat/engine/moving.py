"""Motions of many points: drives and joints of a machine of rigid parts, traced and compiled, or by columns for a few.

No formula lives here.
"""

import math
from collections.abc import Mapping
from dataclasses import field

import numpy as np

from kinetostat.algebra.scalar import Scalar, where
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
from kinetostat.kinematics.closing import within_reach
from kinetostat.kinematics.status import Status
from kinetostat.machine.column import column, stacked_columns
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE
from kinetostat.motion.machine_at_pose import (
    NUMBERS_OF_DRIVE,
    MachineAtPose,
    at_pose,
    drive_numbers,
    joints_of,
    motion_details,
)
from kinetostat.motion.rates import PoseRates
from kinetostat.motion.rigid import MotionPlan, masses_of_links, plan_of

COMPILED_FROM = 2000
"""Points from which machine code pays, which takes a second or two to compile and is then kept on disk."""


@dataclass(frozen=True)
class PosePath:
    """Points of a motion.

    Attributes:
        pose: coordinates of the pose by name, m or rad [n].
        rates: rates of these coordinates, per second [n].
        accelerations: their second rates, per second squared [n].
        loads: forces and moments on the platform that the motion says, by leaf path, N or N·m [n]; others are those of
            the machine.
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
        parts = (self.pose, self.rates, self.accelerations, self.loads)
        return PosePath(*({name: np.asarray(column)[rows] for name, column in part.items()} for part in parts))


@dataclass(frozen=True)
class PathForces:
    """Drives and joints along a motion; NaN where the machine has no place.

    Attributes:
        drives: numbers of each drive, see `machine_at_pose.NUMBERS_OF_DRIVE` [drives x numbers x n], SI.
        wrench: wrench of the tool, see `machine_at_pose.tool_wrench` [6 x n], N·m and N; none if nobody asked.
        joints: force (N) and moment (N·m) of each joint [joints x 2 x n]; none if nobody asked.
        inertia: reflected, of each drive [drives x n]; none if nobody asked, or of more drives than coordinates.
        status: `Status` codes [n].
    """

    drives: Array
    joints: Array
    wrench: Array
    inertia: Array
    status: Codes


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
        joints_too: whether loads of joints and reflected inertia come after the numbers of the drives.
        closed: whether joints are closed inside the program.
    """
    traced = traced_machine(kind, form)
    joints, columns = traced_joints(traced, closed)
    configuration = traced.machine.configure(joints.coordinates if joints else ())
    names = [path.removeprefix(POSE) for path in form.varying if path.startswith(POSE)]
    size = len(names)
    moving = new_inputs(traced.graph, 2 * size + links)
    direction = PoseRates(
        dict(zip(names, moving[:size], strict=True)), dict(zip(names, moving[size : 2 * size], strict=True))
    )
    parts = at_pose(traced.machine, configuration, joints, plan, moving[2 * size :] or None)
    results = drive_numbers(parts, direction)
    if joints_too:
        results += motion_details(parts, direction)
    status: Scalar = joints.status if joints else int(Status.OK)
    status = where(within_reach(configuration), status, int(Status.OUT_OF_REACH))
    accepted = status < Status.OK + 0.5
    accepted_results = [result_of(where(accepted, value, math.nan)) for value in results]
    return formula_of(traced, columns, accepted_results, result_of(status), coordinates=moving)


@dataclass(frozen=True)
class RigidForm:
    """The form of a machine's equations, found once: the motions that it has, and the masses of its links.

    Attributes:
        machine: the machine at the pose at which its telescopic legs have their mass.
        plan: which motions there are.
        masses: masses of its links, kg; none of a machine written leg by leg, whose file says them.
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
    closed = state.machine.family.chains is None
    masses = tuple(map(float, masses_of_links(state.machine, state.configuration))) if closed else ()
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
    size, loaded = len(form.at(state).rigid.drives), joints_of(state.configuration) if joints else []
    if compiled if compiled is not None else path.size >= COMPILED_FROM:
        results, status = _by_program(form, path, joints)
    else:
        results, status = _by_columns(form, path, joints)
    end = size * len(NUMBERS_OF_DRIVE)
    pairs = end + 2 * len(loaded)
    return PathForces(
        results[:end].reshape(size, len(NUMBERS_OF_DRIVE), path.size),
        results[end:pairs].reshape(len(loaded), 2, path.size),
        results[pairs : pairs + 6],
        results[pairs + 6 :],
        status,
    )


def _by_columns(form: RigidForm, path: PosePath, joints: bool) -> tuple[Array, Codes]:
    with np.errstate(all="ignore"):
        state = states_at(form.machine, path.columns, path.size)
        parts = form.at(state)
        rates, accelerations = (
            {name: column(np.asarray(values, dtype=float)) for name, values in part.items()}
            for part in (path.rates, path.accelerations)
        )
        direction = PoseRates(rates, accelerations)
        numbers = drive_numbers(parts, direction)
        if joints:
            numbers += motion_details(parts, direction)
        placed: Scalar = int(Status.OK) if state.joints is None else state.joints.status
        status = np.where(np.asarray(within_reach(state.configuration)), placed, int(Status.OUT_OF_REACH))
        results = stacked_columns(numbers, path.size).T.copy()
    codes = np.broadcast_to(status, (path.size,)).astype(np.int8)
    results[:, codes != Status.OK] = np.nan
    return results, codes


def _by_program(form: RigidForm, path: PosePath, joints: bool) -> tuple[Array, Codes]:
    """By machine code, which closes the legs itself where they have closed forms; the rest is closed before it."""
    closed = closes_inside(form.machine)
    results, status = _run(form, path, joints, closed)
    unsolved = np.flatnonzero(status == Status.NOT_CONVERGED)
    if closed and unsolved.size:
        results[:, unsolved], status[unsolved] = _run(form, path.at(unsolved), joints, closed=False)
    return results, status


def _run(form: RigidForm, path: PosePath, joints: bool, closed: bool) -> tuple[Array, Codes]:
    machine, varying = form.machine, path.columns
    shape, fixed = form_of(machine, list(varying))
    options = {"plan": form.plan, "links": len(form.masses), "joints_too": joints, "closed": closed}
    program = program_of(recipe_of(motion_of, Specimen(machine), shape, **options))
    program_inputs = program_columns(machine, shape, varying, path.size, closed)
    program_inputs += [
        np.ascontiguousarray(part[name], dtype=float) for part in (path.rates, path.accelerations) for name in path.pose
    ]
    program_inputs += [np.full(path.size, mass) for mass in form.masses]
    results, status = np.empty((program.rows, path.size)), np.empty(path.size, dtype=np.int8)
    program.run(fixed, program_inputs, results, status)
    return results, status
