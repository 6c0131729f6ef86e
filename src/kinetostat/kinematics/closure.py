"""Joint coordinates that close the legs of a machine at its pose: for one pose, for many at once, or traced.

The ways to find them meet here and nowhere else: closed forms of the legs where every leg has one, and Newton's method
along the way from the home pose for the rest. They serve families whose `configure` does not place the joints itself.
Nothing here knows stiffness.

Source: theory (22) for Newton's method, (23) for closed forms.
"""

import numpy as np

from kinetostat.algebra.scalar import Scalar, where
from kinetostat.arrays import Array, Codes, Mask
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import (
    Joints,
    clearance,
    free_coordinates,
    leg_end,
    platform_placement,
    squared_distance,
)
from kinetostat.kinematics.following import follow
from kinetostat.kinematics.leg_gaps import Coordinates, Problems, coordinates_at, goal_of, problems_of
from kinetostat.kinematics.nearest import nearest_home
from kinetostat.kinematics.status import Status
from kinetostat.kinematics.ways import too_far_or_near
from kinetostat.machine.column import column, stacked_columns
from kinetostat.machine.leg import Turn
from kinetostat.machine.machine import Chains, Machine
from kinetostat.numerics.iteration import with_damping
from kinetostat.tolerances import CLOSED, LEAST_NORM_DAMPING, UNDETERMINED


@dataclass(frozen=True)
class Task:
    """The legs of a machine, and the poses that they are to reach.

    Attributes:
        chains: the legs at the home pose, with floats or arrays.
        goal: coordinates of the poses, in the order of the chains' pose [n x given], rad or m.
        single: whether there is one pose and all numbers are floats.
    """

    chains: Chains
    goal: Array
    single: bool

    def joints(self, coordinates: Array, status: Codes) -> Joints:
        """Joints from coordinates [n x coordinates] and status codes [n]: floats for a single pose."""
        if self.single:
            return Joints(tuple(float(q) for q in coordinates[0]), int(status[0]))
        return Joints(tuple(map(column, coordinates.T)), status)


def solve_joints(machine: Machine) -> Joints:
    """Solve for the joint coordinates of a machine at its pose, reached from the home pose without leaving its branch.

    In closed form where every leg has one, otherwise by Newton's method along the way from the home pose.
    """
    task = task_of(machine)
    return solver_of(task)(task)


def task_of(machine: Machine) -> Task:
    """Collect legs and poses of a machine written leg by leg, whose numbers are floats or arrays."""
    chains = machine.chains()
    pose = np.stack(np.broadcast_arrays(*map(np.asarray, chains.pose.values())), axis=-1).astype(float)
    goal = np.atleast_2d(pose)
    count = max(len(goal), _batch(machine, chains))
    return Task(chains, np.broadcast_to(goal, (count, goal.shape[1])), pose.ndim == 1 and count == 1)


def _batch(machine: Machine, chains: Chains) -> int:
    """Number of machines that the tables describe at once."""
    numbers = [number for table in machine.family_tables.values() for number in _numbers(table)]
    return max((np.size(number) for number in (*numbers, chains.length)), default=1)


def _numbers(table: object) -> list[Scalar]:
    values = list(vars(table).values())
    return [entry for value in values for entry in (value if isinstance(value, tuple) else (value,))]


def solver_of(task: Task, traced: bool = False) -> "ClosedForms | Newton":
    """Choose how joint coordinates are solved for: the one place where that is decided.

    Args:
        task: the legs, and the pose of the machine.
        traced: whether the solver is to be part of a program. A program neither iterates nor tests pose by pose whether
            the given coordinates determine the platform, so that this is tested once, at the machine's own pose.
    """
    chains = task.chains
    if len([inverse for inverse in chains.inverses if inverse is not None]) < len(chains.legs):
        return NEWTON
    if traced:
        leaves_open = CLOSED_FORMS.over_scalars(chains).status == Status.NOT_CONVERGED
        if leaves_open or CLOSED_FORMS(task).status == Status.SINGULAR:
            return NEWTON
    return CLOSED_FORMS


class Newton:
    """Newton's method, along the way from the home pose."""

    traceable = False

    def __call__(self, task: Task) -> Joints:
        """The joints, all by iteration."""
        with np.errstate(all="ignore"):
            return task.joints(*joints_followed(task.chains, task.goal))


class ClosedForms:
    """The closed form of every leg; Newton's method for poses at which these do not close the legs."""

    traceable = True
    """Whether programs may contain it: `over_scalars` is arithmetic without iteration."""

    def __call__(self, task: Task) -> Joints:
        """The joints, in closed form where that closes the legs."""
        count = len(task.goal)
        with np.errstate(all="ignore"):
            closed = self.over_scalars(task.chains)
            coordinates = stacked_columns([_angle(amount) for amount in closed.coordinates], count)
            status = np.broadcast_to(np.asarray(closed.status), (count,))
            unsolved = status == Status.NOT_CONVERGED
            if unsolved.all():
                return NEWTON(task)
            # Out of reach a coordinate is NaN, which would spoil the linear algebra of the other poses.
            status = self._status_where_determined(task, np.where(np.isnan(coordinates), 0.0, coordinates), status)
            if unsolved.any():
                followed, codes = joints_followed(task.chains, task.goal, unsolved)
                coordinates = np.where(unsolved[:, None], followed, coordinates)
                status = np.where(unsolved, codes, status)
        return task.joints(coordinates, status)

    @staticmethod
    def _status_where_determined(task: Task, coordinates: Array, status: Codes) -> Codes:
        """The status with poses that do not determine where the platform is."""
        free = free_coordinates(task.chains)
        if not free:
            return status
        (problems,) = problems_of(task.chains, len(status), free)
        return _with_undetermined(problems, problems.unknowns_of(coordinates), goal_of(problems, task.goal), status)

    @staticmethod
    def over_scalars(chains: Chains) -> Joints:
        """The joints over any scalar, angles as turns, by closed forms alone.

        NOT_CONVERGED says that the legs close only if coordinates which the pose does not give differ from those of
        the home pose, which Newton's method finds.

        Raises:
            ValueError: a leg has no closed form; `solver_of` does not choose this solver then.
        """
        placement = platform_placement(chains)
        motion = placement @ chains.home.inverse()
        amounts: list[Scalar | Turn] = []
        reached: Scalar = True
        squared_gap: Scalar = 0.0
        for inverse, steps in zip(chains.inverses, chains.legs, strict=True):
            if inverse is None:
                raise ValueError("a leg without a closed form")
            leg = inverse.close(steps, motion)
            amounts += leg.amounts
            reached = (clearance(leg.closure) >= 0.0) & reached
            leg_gap = leg.gap
            if leg_gap is None:
                end = leg_end(steps, chains.home, iter(leg.amounts)).platform
                leg_gap = squared_distance(end, placement, chains.length)
            squared_gap = squared_gap + leg_gap
        status = where(squared_gap < CLOSED * CLOSED, int(Status.OK), int(Status.NOT_CONVERGED))
        return Joints(tuple(amounts), where(reached, status, int(Status.OUT_OF_REACH)))


NEWTON, CLOSED_FORMS = Newton(), ClosedForms()


def _angle(amount: Scalar | Turn) -> Scalar:
    return np.arctan2(amount.sine, amount.cosine) if isinstance(amount, Turn) else amount


def joints_followed(chains: Chains, goal: Array, chosen: Mask | None = None) -> tuple[Array, Codes]:
    """Follow the joint coordinates of a machine from the home pose to its poses.

    Args:
        chains: the machine.
        goal: coordinates of the poses, in the order of the chains' pose [n x given], rad or m.
        chosen: which of the poses are followed [n]; all if None. Nothing is said of the others.

    Returns:
        Joint coordinates, rad or m [n x coordinates], and `Status` codes [n].
    """
    count, free = len(goal), free_coordinates(chains)
    coordinates, status = np.zeros((count, chains.size)), np.full(count, int(Status.OK))
    groups = problems_of(chains, count, free)
    if chosen is not None:
        groups = [group.subset(np.flatnonzero(chosen[group.poses])) for group in groups]
    groups_with_goals = [(group, goal_of(group, goal)) for group in groups]
    for group, group_goal in groups_with_goals:
        status[group.poses[too_far_or_near(group, group_goal)]] = int(Status.OUT_OF_REACH)
    for group, group_goal in groups_with_goals:
        tried = np.flatnonzero(status[group.poses] == Status.OK)
        problems, tried_goal = group.subset(tried), coordinates_at(group_goal, tried)
        unknowns, codes = follow(problems, tried_goal)
        reached = np.flatnonzero(codes == Status.OK)
        unknowns[reached] = nearest_home(
            problems.subset(reached), unknowns[reached], coordinates_at(tried_goal, reached)
        )
        verdicts = _with_undetermined(problems, unknowns, tried_goal, codes) if free else codes
        problems.write_joints(coordinates, unknowns)
        # The worst status of a pose's legs wins, so the worst is written last.
        for code in (Status.SINGULAR, Status.NOT_CONVERGED, Status.OUT_OF_REACH):
            status[problems.poses[verdicts == code]] = int(code)
    return coordinates, status


def _with_undetermined(problems: Problems, unknowns: Array, goal: Coordinates, codes: Codes) -> Codes:
    """The codes, SINGULAR instead of OK where the platform can move without opening a leg or changing the pose given.

    The damped inverse of what determines the platform is then as large as the damping is small.

    Args:
        problems, codes: the problems, and the `Status` code of each.
        unknowns: their solutions [problems x unknowns].
        goal: coordinates of the platform in each of them.
    """
    solved = np.flatnonzero(codes == Status.OK)
    if not solved.size:
        return codes
    problems = problems.subset(solved)
    rates = problems.gaps(unknowns[solved], coordinates_at(goal, solved)).rates
    square = np.swapaxes(rates, 1, 2) @ rates
    damping = LEAST_NORM_DAMPING * np.trace(square, axis1=1, axis2=2)
    moving = np.eye(problems.size)[:, problems.size - len(problems.free) :]
    freedom = np.linalg.solve(with_damping(square), np.broadcast_to(moving, (len(rates), *moving.shape)))
    is_undetermined = (freedom * moving).sum(axis=(1, 2)) * damping > UNDETERMINED
    codes = codes.copy()
    codes[solved[is_undetermined]] = int(Status.SINGULAR)
    return codes
