"""Joint coordinates that close the legs of a machine at its pose: for one pose, for many at once, or traced.

The ways to find them meet here and nowhere else: closed forms of the legs where every leg has one, and Newton's method
along the way from the home pose for the rest. They serve families whose `configure` does not place the joints itself.
Nothing here knows stiffness.

Source: theory (22) for Newton's method, (23) for closed forms, section 6 for the nearest pose.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.scalar import Scalar, where
from kinetostat.kinematics.closing import (
    ANGLES,
    POINT,
    Array,
    clearance,
    gaps_at,
    leg_end,
    leg_ends,
    platform_placement,
    pose_of,
    squared_distance,
    stacked,
    units_of,
)
from kinetostat.kinematics.status import Status
from kinetostat.machine.column import column
from kinetostat.machine.leg import Turn
from kinetostat.machine.machine import Chains, Machine
from kinetostat.tolerances import (
    CLOSED,
    LEAST_NORM_DAMPING,
    NEWTON_SETTLED,
    NO_COORDINATE,
    UNDETERMINED,
)

Codes = npt.NDArray[np.int64]

MOST_STEPS, MOST_ITERATIONS, ON_THE_WAY = 200, 40, 2
FURTHEST_SLIDE, FURTHEST_TURN = 0.15, 0.2
"""Between poses on the way from the home pose: in units of the machine's length, and in rad. Short enough to stay on
the branch of the home pose."""
MOST_EVALUATIONS = 60
"""Of the gaps where the nearest pose is sought: it comes out in eight digits after some 40."""
CLOSING_WEIGHT = 1e4
"""How much more a gap in a leg counts than one in the pose when the nearest pose is sought, so that the legs close to a
ten-thousandth of the rest."""


@dataclass(frozen=True)
class Joints:
    """Where the joints are.

    Attributes:
        coordinates: one scalar per joint coordinate, leg by leg, rad or m from the home pose; closed forms over any
            scalar give turns instead of angles.
        status: `Status` code: OK, OUT_OF_REACH, SINGULAR or NOT_CONVERGED.
    """

    coordinates: tuple[Scalar | Turn, ...]
    status: Scalar


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
    given = np.stack(np.broadcast_arrays(*map(np.asarray, chains.pose.values())), axis=-1).astype(float)
    goal = np.atleast_2d(given)
    count = max(len(goal), _batch(machine, chains))
    return Task(chains, np.broadcast_to(goal, (count, goal.shape[1])), given.ndim == 1 and count == 1)


def _batch(machine: Machine, chains: Chains) -> int:
    """How many machines the tables describe at once."""
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
            coordinates = joints_on_the_way(task.chains, task.goal)
            return task.joints(coordinates, _status(task.chains, coordinates, task.goal))


class ClosedForms:
    """The closed form of every leg; Newton's method for poses at which these do not close the legs."""

    traceable = True
    """Whether programs may contain it: `over_scalars` is arithmetic without iteration."""

    def __call__(self, task: Task) -> Joints:
        """The joints, in closed form where that closes the legs."""
        count = len(task.goal)
        with np.errstate(all="ignore"):
            closed = self.over_scalars(task.chains)
            coordinates = stacked([_angle(amount) for amount in closed.coordinates], count)
            status = np.broadcast_to(np.asarray(closed.status), (count,))
            left = status == Status.NOT_CONVERGED
            if left.all():
                return NEWTON(task)
            # Out of reach a coordinate is NaN, which would spoil the linear algebra of the other poses.
            reached = np.where(np.isnan(coordinates), 0.0, coordinates)
            status = np.where(status == Status.OK, _status(task.chains, reached, task.goal), status)
            if left.any():
                rest = NEWTON(task)
                coordinates = np.where(left[:, None], stacked(rest.coordinates, count), coordinates)
                status = np.where(left, rest.status, status)
        return task.joints(coordinates, status)

    @staticmethod
    def over_scalars(chains: Chains) -> Joints:
        """The joints over any scalar, angles as turns, by closed forms alone.

        NOT_CONVERGED says that the legs close only if coordinates which the pose does not give differ from those of
        the home pose, which Newton's method finds.
        """
        placement = platform_placement(chains)
        motion = placement @ chains.home.inverse()
        amounts: list[Scalar | Turn] = []
        reached: Scalar = True
        gap: Scalar = 0.0
        for inverse, steps in zip(chains.inverses, chains.legs, strict=True):
            if inverse is None:
                raise ValueError("a leg without a closed form")
            leg_amounts, closure = inverse.amounts(steps, motion)
            amounts += leg_amounts
            reached = (clearance(closure) >= 0.0) & reached
            end = leg_end(steps, chains.home, iter(leg_amounts)).platform
            gap = gap + squared_distance(end, placement, chains.length)
        status = where(gap < CLOSED * CLOSED, int(Status.OK), int(Status.NOT_CONVERGED))
        return Joints(tuple(amounts), where(reached, status, int(Status.OUT_OF_REACH)))


NEWTON, CLOSED_FORMS = Newton(), ClosedForms()


def _angle(amount: Scalar | Turn) -> Scalar:
    return np.arctan2(amount.sine, amount.cosine) if isinstance(amount, Turn) else amount


def joints_on_the_way(chains: Chains, goal: Array) -> Array:
    """Return the coordinates [n x coordinates] that come nearest to closing the legs at poses [n x given].

    The pose moves from the home pose to its goal in steps short enough to stay on the branch of the home pose, with a
    few iterations at each, and is refined at the goal alone.
    """
    start = stacked(_home_pose(chains), len(goal))
    coordinates = np.zeros((len(goal), chains.size))
    steps = _steps(goal - start, chains)
    for step in range(1, steps):
        coordinates = _newton(chains, coordinates, start + (goal - start) * (step / steps), ON_THE_WAY)
    return _newton(chains, coordinates, goal, MOST_ITERATIONS)


def _home_pose(chains: Chains) -> list[Scalar]:
    return [getattr(chains.home.translation, name) if name in POINT else 0.0 for name in chains.pose]


def _steps(way: Array, chains: Chains) -> int:
    units = [FURTHEST_TURN if name in ANGLES else FURTHEST_SLIDE * float(np.min(chains.length)) for name in chains.pose]
    far = np.abs(way) / np.array(units)
    longest = np.max(far, where=np.isfinite(far), initial=0.0)
    return int(np.clip(np.ceil(longest), 1, MOST_STEPS))


def _newton(chains: Chains, coordinates: Array, goal: Array, most: int) -> Array:
    """Take Gauss-Newton steps of least norm, and return the best coordinates on the way."""
    units = units_of(chains, np.broadcast_to(chains.length, (len(coordinates),)))
    best, least = coordinates, np.full(len(coordinates), np.inf)
    for _ in range(most):
        gaps = gaps_at(chains, coordinates, goal)
        better = gaps.largest < least
        best, least = np.where(better[:, None], coordinates, best), np.where(better, gaps.largest, least)
        # A pose that no longer improves has reached round-off, or cannot be closed.
        if np.all((gaps.largest <= NEWTON_SETTLED) | ~better):
            break
        coordinates = coordinates + _least_norm(gaps.rates, gaps.left) * units
    return best


def _least_norm(rates: Array, left: Array) -> Array:
    """Least-squares solutions of rates x = left, all but least in norm, pose by pose; zero where nothing is finite."""
    sound = np.isfinite(rates).all(axis=(1, 2)) & np.isfinite(left).all(axis=1)
    steps = np.zeros((len(rates), rates.shape[2]))
    if sound.any():
        work = np.swapaxes(rates[sound], 1, 2) @ left[sound][:, :, None]
        steps[sound] = np.linalg.solve(_damped_square(rates[sound]), work)[:, :, 0]
    return steps


def _damped_square(rates: Array) -> Array:
    """rates^T rates, made regular by a trace of damping that only directions without effect feel."""
    square = np.swapaxes(rates, 1, 2) @ rates
    trace = np.trace(square, axis1=1, axis2=2)[:, None, None]
    return np.asarray(square + LEAST_NORM_DAMPING * (trace + 1e-300) * np.eye(rates.shape[2]))


def _status(chains: Chains, coordinates: Array, goal: Array) -> Codes:
    gaps = gaps_at(chains, coordinates, goal)
    closed = gaps.largest <= CLOSED
    status = np.where(np.isfinite(gaps.largest), int(Status.OUT_OF_REACH), int(Status.NOT_CONVERGED))
    free = _undetermined(gaps.rates[closed], gaps.platform_rates[closed])
    status[closed] = np.where(free, int(Status.SINGULAR), int(Status.OK))
    return status


def _undetermined(rates: Array, platform_rates: Array) -> npt.NDArray[np.bool_]:
    """Whether the platform can move without opening a leg or changing a pose coordinate.

    The damped inverse of what determines it is then as large as the damping is small.
    """
    square = _damped_square(rates)
    damping = LEAST_NORM_DAMPING * np.trace(square, axis1=1, axis2=2)
    freedom = platform_rates @ np.linalg.solve(square, np.swapaxes(platform_rates, 1, 2))
    return np.asarray(np.trace(freedom, axis1=1, axis2=2) * damping > UNDETERMINED)


def nearest_pose(machine: Machine) -> dict[str, float]:
    """Return all coordinates (m, rad) of an admissible pose near a pose that the legs cannot take.

    Distance is that of the pose coordinates given, angles times the machine's characteristic length. It is found by
    least squares in the joint coordinates, from where Newton's method came to, on the branch of the home pose.
    """
    from scipy.optimize import least_squares  # a third of a second to load, for a refusal alone

    chains = machine.chains()
    goal = np.array([list(chains.pose.values())], dtype=float)
    units = units_of(chains, np.array([float(chains.length)]))[0]
    weights = np.repeat([CLOSING_WEIGHT, 1.0], [6 * (len(chains.legs) - 1), len(chains.pose)])

    def left(joints: Array) -> Array:
        return np.asarray(weights * gaps_at(chains, joints[None] * units, goal).left[0])

    def slopes(joints: Array) -> Array:
        return np.asarray(-weights[:, None] * gaps_at(chains, joints[None] * units, goal).rates[0])

    start = joints_on_the_way(chains, goal)[0] / units
    # Gaps weigh so much more than the pose that without scales from the slopes hundreds of steps would be needed.
    scales = {"x_scale": "jac", "max_nfev": MOST_EVALUATIONS}
    best = least_squares(left, start, slopes, xtol=1e-15, ftol=1e-15, gtol=1e-15, **scales).x
    coordinates = pose_of(leg_ends(chains, list(best * units))[0].platform)
    return {name: 0.0 if abs(value) < NO_COORDINATE else float(value) for name, value in coordinates.items()}
