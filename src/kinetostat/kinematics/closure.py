"""Joint coordinates that close the legs of a machine at a pose, for one pose or for many at once.

In closed form where every leg has one, otherwise by Newton's method. For families whose `configure` does not place the
joints itself. Nothing here knows stiffness.

Source: theory (22).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import Displacement
from kinetostat.kinematics.closed_form import CLOSED, closed_joints
from kinetostat.kinematics.status import Status
from kinetostat.machine.leg import Turn
from kinetostat.machine.machine import Chains, Machine, Step

Array = npt.NDArray[np.float64]
Codes = npt.NDArray[np.int64]

SETTLED = 1e-14
"""Gap at which nothing is left but rounding."""
MOST_STEPS, MOST_ITERATIONS, ON_THE_WAY = 200, 40, 2
FURTHEST_SLIDE, FURTHEST_TURN = 0.15, 0.2
"""Between poses on the way from the home pose: in units of the machine's length, and in rad. Short enough to stay on
the branch of the home pose."""
DAMPING = 1e-15
"""Of the trace of the squared rates: far below what a regular direction weighs, enough for an idle one."""
NEGLIGIBLE = 1e-9
"""Relative size of a singular value below which angles have no rates (at pitch = +-90 deg)."""
DETERMINED = 1e-4
"""Share of undamped motion above which the platform's place is determined by nothing but damping."""


@dataclass(frozen=True)
class Joints:
    """Where the joints are.

    Attributes:
        coordinates: one scalar per joint coordinate, leg by leg, rad or m from the home pose.
        status: `Status` code: OK, OUT_OF_REACH, SINGULAR or NOT_CONVERGED.
    """

    coordinates: tuple[Scalar, ...]
    status: Scalar


@dataclass(frozen=True)
class Gaps:
    """How far a machine is from closed and from its pose, in rad and in units of the machine's length [n x rows].

    Attributes:
        closure, pose: what is left to do.
        closure_rates, pose_rates: how joint coordinates, slides in those units, change them [n x rows x coordinates].
        platform: its rotation [n x 3 x 3] and P [n x 3], where the first leg takes it.
        platform_rates: twist of the platform per unit of each joint coordinate, likewise [n x 6 x coordinates].
    """

    closure: Array
    pose: Array
    closure_rates: Array
    pose_rates: Array
    platform: tuple[Array, Array]
    platform_rates: Array


def solve_joints(machine: Machine) -> Joints:
    """The joint coordinates of a machine at its pose, reached from the home pose without leaving its branch.

    In closed form where every leg has one, otherwise by Newton's method along the way from the home pose.
    """
    chains = machine.chains()
    goal, single = _goal(machine, chains)
    with np.errstate(all="ignore"):
        found, status = _in_closed_form(chains, goal) or _by_newton(chains, goal)
    if single:
        return Joints(tuple(float(q) for q in found[0]), int(status[0]))
    return Joints(tuple(found.T), status)


def _goal(machine: Machine, chains: Chains) -> tuple[Array, bool]:
    """Pose coordinates [n x given], and whether the machine is at one pose only."""
    given = np.stack(np.broadcast_arrays(*map(np.asarray, chains.pose.values())), axis=-1).astype(float)
    goal = np.atleast_2d(given)
    count = max(len(goal), _batch(machine, chains))
    return np.broadcast_to(goal, (count, goal.shape[1])), given.ndim == 1 and count == 1


def _in_closed_form(chains: Chains, goal: Array) -> tuple[Array, Codes] | None:
    """Coordinates [n x coordinates] and status; None without a closed form. Newton closes the rest."""
    closed = closed_joints(chains)
    if closed is None:
        return None
    amounts, codes = closed
    angles = [np.arctan2(a.sine, a.cosine) if isinstance(a, Turn) else a for a in amounts]
    status = np.broadcast_to(np.asarray(codes), (len(goal),)).copy()
    found = _stack(angles, len(goal))
    left = status == Status.NOT_CONVERGED
    if left.all():
        return None
    reached = np.where(np.isnan(found), 0.0, found)
    status = np.where(status == Status.OK, _status(chains, reached, goal), status)
    if not left.any():
        return found, status
    other, other_status = _by_newton(chains, goal)
    return np.where(left[:, None], other, found), np.where(left, other_status, status)


def _by_newton(chains: Chains, goal: Array) -> tuple[Array, Codes]:
    """Coordinates [n x coordinates] and status, by Newton's method."""
    found = joints_on_the_way(chains, goal)
    return found, _status(chains, found, goal)


def joints_on_the_way(chains: Chains, goal: Array) -> Array:
    """Coordinates [n x coordinates] that come nearest to closing the legs at poses [n x given], from the home pose.

    In steps short enough to stay on its branch.
    """
    start = np.stack(np.broadcast_arrays(*_home_pose(chains), np.zeros(len(goal)))[:-1], axis=-1)
    found = np.zeros((len(goal), chains.size))
    steps = _steps(goal - start, chains)
    for step in range(1, steps):
        found = _newton(chains, found, start + (goal - start) * (step / steps), ON_THE_WAY)
    return _newton(chains, found, goal, MOST_ITERATIONS)


def _batch(machine: Machine, chains: Chains) -> int:
    """Return how many machines the tables describe at once."""
    numbers = [number for table in machine.family_tables.values() for number in _numbers(table)]
    return max((np.size(number) for number in (*numbers, chains.length)), default=1)


def _numbers(table: object) -> list[Scalar]:
    held = list(vars(table).values())
    return [entry for value in held for entry in (value if isinstance(value, tuple) else (value,))]


def _home_pose(chains: Chains) -> list[Scalar]:
    point = chains.home.translation
    known = {"x": point.x, "y": point.y, "z": point.z}
    return [np.asarray(known.get(name, 0.0), dtype=float) for name in chains.pose]


def _steps(way: Array, chains: Chains) -> int:
    turning = np.array([name not in "xyz" for name in chains.pose])
    units = np.where(turning, FURTHEST_TURN, FURTHEST_SLIDE * float(np.min(chains.length)))
    far = np.abs(way) / units
    longest = np.max(far, where=np.isfinite(far), initial=0.0)
    return int(np.clip(np.ceil(longest), 1, MOST_STEPS))


def _newton(chains: Chains, found: Array, goal: Array, most: int) -> Array:
    """Gauss-Newton steps of least norm; the best coordinates seen."""
    best, least = found, np.full(len(found), np.inf)
    for _ in range(most):
        gaps = gaps_at(chains, found, goal)
        left = np.hstack([gaps.closure, gaps.pose])
        size = np.max(np.abs(left), axis=1, initial=0.0)
        better = size < least
        best, least = np.where(better[:, None], found, best), np.where(better, size, least)
        if np.all((size <= SETTLED) | ~better):
            break
        rates = np.concatenate([gaps.closure_rates, gaps.pose_rates], axis=1)
        found = found + _least_norm(rates, left) * units_of(chains, np.broadcast_to(chains.length, (len(found),)))
    return best


def _least_norm(rates: Array, left: Array) -> Array:
    """Least-squares solutions of rates x = left, all but least in norm, pose by pose; zero where nothing is finite."""
    sound = np.isfinite(rates).all(axis=(1, 2)) & np.isfinite(left).all(axis=1)
    steps = np.zeros((len(rates), rates.shape[2]))
    if sound.any():
        kept = rates[sound]
        work = np.swapaxes(kept, 1, 2) @ left[sound][:, :, None]
        steps[sound] = np.linalg.solve(_damped_square(kept), work)[:, :, 0]
    return steps


def _damped_square(rates: Array) -> Array:
    """rates^T rates, made regular by a trace of damping that only directions without effect feel."""
    square = np.swapaxes(rates, 1, 2) @ rates
    trace = np.trace(square, axis1=1, axis2=2)[:, None, None]
    return np.asarray(square + DAMPING * (trace + 1e-300) * np.eye(rates.shape[2]))


def _status(chains: Chains, found: Array, goal: Array) -> Codes:
    gaps = gaps_at(chains, found, goal)
    left = np.max(np.abs(np.hstack([gaps.closure, gaps.pose])), axis=1, initial=0.0)
    closed = left <= CLOSED
    status = np.where(np.isfinite(left), int(Status.OUT_OF_REACH), int(Status.NOT_CONVERGED))
    rates = np.concatenate([gaps.closure_rates, gaps.pose_rates], axis=1)[closed]
    free = _undetermined(rates, gaps.platform_rates[closed])
    status[closed] = np.where(free, int(Status.SINGULAR), int(Status.OK))
    return status


def _undetermined(rates: Array, platform_rates: Array) -> npt.NDArray[np.bool_]:
    """Whether the platform can move without opening a leg or changing a pose coordinate.

    The damped inverse of what determines it is then as large as the damping is small.
    """
    square = _damped_square(rates)
    damping = DAMPING * np.trace(square, axis1=1, axis2=2)
    freedom = platform_rates @ np.linalg.solve(square, np.swapaxes(platform_rates, 1, 2))
    return np.asarray(np.trace(freedom, axis1=1, axis2=2) * damping > DETERMINED)


def gaps_at(chains: Chains, found: Array, goal: Array) -> Gaps:
    """Gaps and their rates for joint coordinates [n x coordinates] and pose coordinates [n x given]."""
    count, length = len(found), np.broadcast_to(np.asarray(chains.length, dtype=float), (len(found),))
    columns = iter(found.T)
    ends, rates = [], []
    for steps in chains.legs:
        end, twists = _leg_at(steps, [next(columns) for step in steps if step.moves], chains.home, count)
        ends.append(end)
        rates.append(twists)
    weights = np.concatenate([np.ones((count, 3)), np.repeat(1.0 / length[:, None], 3, axis=1)], axis=1)
    closure, closure_rates = [np.zeros((count, 0))], [np.zeros((count, 0, chains.size))]
    blocks = [_widened(twists, rates, i) for i, twists in enumerate(rates)]
    for end, block in zip(ends[1:], blocks[1:], strict=True):
        closure.append(weights * _difference(end, ends[0]))
        closure_rates.append(weights[:, :, None] * (block - blocks[0]))
    pose, pose_rates = _pose_gap(ends[0], blocks[0], chains.pose, goal, length)
    units = units_of(chains, length)[:, None, :]
    return Gaps(
        np.hstack(closure), pose, np.concatenate(closure_rates, axis=1) * units, pose_rates * units,
        ends[0], weights[:, :, None] * blocks[0] * units,
    )  # fmt: skip


def units_of(chains: Chains, length: Array) -> Array:
    """What one unit of each joint coordinate is: 1 rad, or the machine's length of a slide, m [n x coordinates]."""
    slides = np.array([step.element.mover.point is None for steps in chains.legs for step in steps if step.moves])
    return np.where(slides, length[:, None], 1.0)


def _widened(twists: Array, rates: Sequence[Array], own: int) -> Array:
    """Twists of one leg among zeros for the coordinates of the others."""
    zeros = [np.zeros_like(other) for other in rates]
    zeros[own] = twists
    return np.concatenate(zeros, axis=2)


def _leg_at(
    steps: Sequence[Step], amounts: Sequence[Array], home: Displacement, count: int
) -> tuple[tuple[Array, Array], Array]:
    """Where a leg takes the platform, as rotation [n x 3 x 3] and P [n x 3], and unit twists of its joints there."""
    remaining, motion, movers = iter(amounts), None, []
    for step in steps:
        if not step.moves:
            continue
        placed = step.element if motion is None else step.element.displaced(motion)
        placed, moved = placed.moved(next(remaining))
        movers.append(placed.mover)
        motion = moved if motion is None else moved @ motion
    end = home if motion is None else motion @ home
    reference = end.translation
    twists = [_stack(mover.twist(reference).components(), count) for mover in movers]
    axes = [_stack(axis.components(), count) for axis in (end.rotation.x, end.rotation.y, end.rotation.z)]
    jacobian = np.stack(twists, axis=2) if twists else np.zeros((count, 6, 0))
    return (np.stack(axes, axis=2), _stack(reference.components(), count)), jacobian


def _stack(scalars: Sequence[Scalar], count: int) -> Array:
    return np.stack([np.broadcast_to(np.asarray(s, dtype=float), (count,)) for s in scalars], axis=1)


def _difference(one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Small displacement from one placement to another: rotation vector to first order, and shift of P [n x 6]."""
    turn = 0.5 * np.sum(np.cross(one[0], other[0], axisa=1, axisb=1, axisc=1), axis=2)
    return np.concatenate([turn, other[1] - one[1]], axis=1)


def _pose_gap(
    end: tuple[Array, Array], rates: Array, given: Mapping[str, Scalar], goal: Array, length: Array
) -> tuple[Array, Array]:
    reached = pose_of(end)
    turning = any(name not in ("x", "y", "z") for name in given)
    changes = _angle_rates(end[0]) @ rates[:, :3] if turning else rates[:, :3]
    gaps, rows = [], []
    for i, name in enumerate(given):
        left = goal[:, i] - reached[name]
        if name in ("x", "y", "z"):
            gaps.append(left / length)
            rows.append(rates[:, 3 + "xyz".index(name)] / length[:, None])
        else:
            gaps.append(np.arctan2(np.sin(left), np.cos(left)))
            rows.append(changes[:, ("roll", "pitch", "yaw").index(name)])
    return np.stack(gaps, axis=1), np.stack(rows, axis=1)


def pose_of(end: tuple[Array, Array]) -> dict[str, Array]:
    """Pose coordinates of placements, each [points]: P (m), and the angles of Q = Rz(yaw) Ry(pitch) Rx(roll), rad."""
    turn, point = end
    flat = np.hypot(turn[:, 0, 0], turn[:, 1, 0])
    angles = {
        "roll": np.arctan2(turn[:, 2, 1], turn[:, 2, 2]),
        "pitch": np.arctan2(-turn[:, 2, 0], flat),
        "yaw": np.arctan2(turn[:, 1, 0], turn[:, 0, 0]),
    }
    return {"x": point[:, 0], "y": point[:, 1], "z": point[:, 2], **angles}


def _angle_rates(turn: Array) -> Array:
    """Rates of roll, pitch and yaw per unit angular velocity [n x 3 x 3]; least norm at pitch = +-90 deg."""
    yaw = np.arctan2(turn[:, 1, 0], turn[:, 0, 0])
    zero, one = np.zeros(len(turn)), np.ones(len(turn))
    columns = [turn[:, :, 0], np.stack([-np.sin(yaw), np.cos(yaw), zero], axis=1), np.stack([zero, zero, one], axis=1)]
    return np.linalg.pinv(np.stack(columns, axis=2), rcond=NEGLIGIBLE)
