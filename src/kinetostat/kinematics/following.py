"""Joint coordinates followed from the home pose to a pose, each problem with steps of its own.

A problem is a leg at a pose, or a whole machine where the pose leaves coordinates open (`leg_gaps`). What comes out for
it does not depend on the other problems of the batch. The ways that are tried are in `ways`. The assembly mode of a leg
is a sign: that of the determinant of its joints' twists, which vanishes where two modes meet. A solution whose sign
differs from that of the home pose is not taken.

Source: theory (22) and section 6; P. Deuflhard, Newton Methods for Nonlinear Problems (2011), section 5.1, for steps
that are accepted by the contraction of Newton's method.
"""

from typing import NamedTuple

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.kinematics.closing import stays_in_plane
from kinetostat.kinematics.leg_gaps import Coordinates, Problems, coordinates_at
from kinetostat.kinematics.status import Status
from kinetostat.kinematics.ways import Plan, Way, rows_of, ways
from kinetostat.machine.leg import rows_about_one_point
from kinetostat.numerics.iteration import largest, least_norm, newton
from kinetostat.tolerances import (
    CLOSED,
    LEAST_DIVISOR,
    LEAST_GAP_SETTLED,
    NEWTON_SETTLED,
    NO_CONTRACTION,
    NO_CURVATURE,
    SINGULAR_LEG,
)

MOST_TRIALS = 80
"""Number of steps that are tried on one way, accepted or not."""
SHORTEST_STRIDE = 1e-4
"""Share of the way below which a step is too short to go on: the way is blocked."""
LONGEST_STRIDE = 1.5
"""Change of an unknown in one step, rad or in units of the machine's length, up to which it is tried."""
CAREFUL_STRIDE = 0.1
"""Such a change where a way has led to another assembly mode."""
GROWTH = (0.5, 4.0)
"""Least and greatest factor from a step that was accepted to the next one."""
SHRINKAGE = (0.1, 0.5)
"""Least and greatest factor from a step that was not accepted to the next one."""
CAUTION_AFTER_SUCCESS, CAUTION_AFTER_FAILURE = 0.9, 0.7
"""Shares of the length that the last step's errors allow: a little less, because the next one's will differ, and less
again where the estimate has just been wrong."""
LEAST_STEADY_FACTOR = 0.25
"""Least factor of a step that the contraction of its correction may ask for: beyond it, its error is a poor measure."""
MOST_TANGENT_ERROR = 0.1
"""Error of the tangent, in the same units, up to which a step is accepted: less than branches usually lie apart."""
STEP_CONTRACTION = 0.55
"""Share of a correction that the next one may have. Newton's method has a half at the point where two branches meet,
so that no step beyond it is accepted."""
MOST_STEPS_AT_GOAL = 60
"""Number of Newton's steps at the goal, where each halves the gap at worst."""
MOST_DESCENTS = 60
"""Steps towards the least gap, where no way leads to the goal."""
STIFFENING = 1e-2
"""Curvature that is added at first, for unknowns that change nothing there: a hundredth of that of a joint that turns
the end of its leg."""
LONGEST_DESCENT = 0.3
"""Change of an unknown in such a step, in the same units, so that it stays in the valley where it starts."""
START_SHIFT = 1e-2
"""Displacement of the unknowns from which these steps start, in the same units: enough to leave a greatest gap."""
SHORTER_DESCENT = 0.25
"""Factor by which such a step becomes shorter that has not lessened the gap."""

BALL_AXES = 3
"""Revolutes of a ball joint."""


def follow(problems: Problems, goal: Coordinates) -> tuple[Array, Integers]:
    """Solve problems by following their solutions from the home pose, by one way after the other.

    Args:
        problems: the problems to solve.
        goal: coordinates of the platform in each of them.

    Returns:
        The unknowns [problems x unknowns], and `Status` codes: OK; OUT_OF_REACH where all ways are blocked and the gap
        has a least value that is not zero; NOT_CONVERGED where all ways are blocked and nothing more is known.
    """
    count = len(problems.poses)
    unknowns, status = np.zeros((count, problems.size)), np.full(count, int(Status.NOT_CONVERGED))
    unsolved = np.arange(count)
    for number, (plan, differs) in enumerate(ways(problems, goal)):
        if not unsolved.size:
            return unknowns, status
        tried = unsolved[differs[unsolved]]
        if not tried.size:
            continue
        reached, solved = _by_way(problems.subset(tried), plan, coordinates_at(goal, tried))
        kept = solved if number else np.ones(len(tried), dtype=bool)  # where the straight way ends serves if all fail
        unknowns[tried[kept]], status[tried[solved]] = reached[kept], int(Status.OK)
        unsolved = unsolved[status[unsolved] != Status.OK]
    unknowns[unsolved], is_least = _least_gap(
        problems.subset(unsolved), unknowns[unsolved], coordinates_at(goal, unsolved)
    )
    status[unsolved[is_least]] = int(Status.OUT_OF_REACH)
    return unknowns, status


def _by_way(problems: Problems, plan: Plan, goal: Coordinates) -> tuple[Array, Mask]:
    """Follow solutions along a way; return where they end, and whether that is at the goal in the same mode.

    A solution at the goal in another mode has crossed to it by too long a step, and is followed again in shorter ones.
    """
    ends = _ends_of_way(problems, plan(problems, goal), goal, LONGEST_STRIDE)
    crossing = np.flatnonzero(ends.crossed)
    if crossing.size:
        part, target = problems.subset(crossing), coordinates_at(goal, crossing)
        careful = _ends_of_way(part, plan(part, target), target, CAREFUL_STRIDE)
        ends.unknowns[crossing], ends.solved[crossing] = careful.unknowns, careful.solved
    return ends.unknowns, ends.solved


class _EndsOfWay(NamedTuple):
    """Solutions at the end of a way, as far as it is open.

    Attributes:
        unknowns: the unknowns there [problems x unknowns].
        solved: whether that is at the goal, in the assembly mode of the home pose [problems].
        crossed: whether that is at the goal, in another mode [problems].
    """

    unknowns: Array
    solved: Mask
    crossed: Mask


def _ends_of_way(problems: Problems, way: Way, goal: Coordinates, longest: float) -> _EndsOfWay:
    """Follow solutions along a way, in steps that change no unknown by more than `longest`."""
    unknowns, arrived = _along(problems, way, longest)
    solved, crossed = np.zeros((2, len(unknowns)), dtype=bool)
    ended = np.flatnonzero(arrived)
    if ended.size:
        part, target = problems.subset(ended), coordinates_at(goal, ended)
        equations, steps = part.closing_equations(target), MOST_STEPS_AT_GOAL
        # A gap that no longer becomes less has reached round-off, or cannot be closed.
        end = newton(
            equations, unknowns[ended], len(ended), most_steps=steps, residual_goal=NEWTON_SETTLED, contraction=1.0
        )
        unknowns[ended] = end.value
        is_closed, is_same_mode = end.residual <= CLOSED, same_mode(part, end.value, target)
        solved[ended], crossed[ended] = is_closed & is_same_mode, is_closed & ~is_same_mode
    return _EndsOfWay(unknowns, solved, crossed)


def _along(problems: Problems, way: Way, longest: float) -> tuple[Array, Mask]:
    """Go along a way as far as it is open, in steps that change no unknown by more than `longest`.

    Returns:
        The unknowns at the end [problems x unknowns], and whether that is the goal [problems].
    """
    count = len(problems.poses)
    unknowns, done, stride = np.zeros((count, problems.size)), np.zeros(count), np.ones(count)
    for _ in range(MOST_TRIALS):
        items = np.flatnonzero((done < 1.0) & (stride >= SHORTEST_STRIDE))
        if not items.size:
            break
        next_share = np.minimum(done[items] + stride[items], 1.0)
        next_share = np.where(next_share > 1.0 - SHORTEST_STRIDE, 1.0, next_share)
        shares = np.ones(count)
        shares[items] = next_share
        part, target = problems.subset(items), coordinates_at(way(shares), items)
        end, allowed_factor, accepted = _step(part, unknowns[items], target, longest)
        unknowns[items[accepted]], done[items[accepted]] = end[accepted], next_share[accepted]
        longer = np.clip(CAUTION_AFTER_SUCCESS * allowed_factor, *GROWTH)
        shorter = np.clip(CAUTION_AFTER_FAILURE * allowed_factor, *SHRINKAGE)
        stride[items] *= np.where(accepted, longer, shorter)
    return unknowns, done == 1.0


def _step(problems: Problems, unknowns: Array, target: Coordinates, longest: float) -> tuple[Array, Array, Mask]:
    """Step to a target: along the tangent, and once more by Newton's method.

    Returns:
        The unknowns after the step, the factor by which it could be longer, and whether it is accepted.
    """
    gaps, rates, _ = problems.gaps(unknowns, target)
    tangent = least_norm(rates, gaps)
    tangent_size = largest(tangent)
    end, factor = unknowns.copy(), longest / np.maximum(tangent_size, LEAST_DIVISOR)
    accepted = factor >= 1.0
    tried = np.flatnonzero(accepted)
    if tried.size:
        part, start = problems.subset(tried), unknowns[tried] + tangent[tried]
        gaps, rates, _ = part.gaps(start, coordinates_at(target, tried))
        correction = least_norm(rates, gaps)
        error = largest(correction)
        contracts = (error <= STEP_CONTRACTION * tangent_size[tried]) | (error <= NO_CONTRACTION)
        accepted[tried] = contracts & (error <= MOST_TANGENT_ERROR)
        end[tried] = start + correction
        # The error of the tangent grows as the square of the step, the contraction as the step itself.
        by_error = np.sqrt(MOST_TANGENT_ERROR / np.maximum(error, LEAST_DIVISOR))
        by_contraction = STEP_CONTRACTION * tangent_size[tried] / np.maximum(error, NO_CONTRACTION)
        by_contraction = np.maximum(by_contraction, LEAST_STEADY_FACTOR)
        factor[tried] = np.minimum(np.minimum(by_error, factor[tried]), by_contraction)
    return end, np.where(np.isfinite(factor), factor, 0.0), accepted


def _least_gap(problems: Problems, unknowns: Array, goal: Coordinates) -> tuple[Array, Mask]:
    """Bring the legs' ends as near to the goal as they come from some unknowns, by a quasi-Newton method (BFGS).

    It begins with the curvature of Gauss and Newton, which would do if the distance came to zero.

    Returns:
        The unknowns there, and whether that is shown to be a least distance which is not zero.
    """
    # The slope vanishes where the gap is greatest too, as at the end of a crank's stroke: the descent starts beside.
    best, is_least = unknowns + START_SHIFT * np.cos(np.arange(problems.size)), np.zeros(len(unknowns), dtype=bool)
    items, share = np.arange(len(unknowns)), np.ones(len(unknowns))
    gaps, rates, distance = problems.gaps(best, goal)  # distances are squared, and items those that still descend
    slope = np.einsum("nrc,nr->nc", rates, gaps)
    inverse = np.linalg.inv(np.einsum("nrc,nrd->ncd", rates, rates) + STIFFENING * np.eye(problems.size))
    for _ in range(MOST_DESCENTS):
        is_flat = np.linalg.norm(slope, axis=1) <= LEAST_GAP_SETTLED * np.sqrt(distance)
        is_open = (distance > CLOSED * CLOSED) & np.isfinite(distance)
        is_least[items[is_flat & is_open]] = True
        remaining = ~is_flat & is_open
        items, share, inverse = items[remaining], share[remaining], inverse[remaining]
        slope, distance = slope[remaining], distance[remaining]
        if not items.size:
            break
        step = np.einsum("ncd,nd->nc", inverse, slope)
        step *= (share * np.minimum(1.0, LONGEST_DESCENT / np.maximum(largest(step), LEAST_DIVISOR)))[:, None]
        end = best[items] + step
        gaps, rates, end_distance = problems.subset(items).gaps(end, coordinates_at(goal, items))
        end_slope = np.einsum("nrc,nr->nc", rates, gaps)
        better = end_distance < distance
        inverse[better] = _updated_inverse(inverse[better], step[better], slope[better] - end_slope[better])
        best[items[better]] = end[better]
        slope[better], distance[better] = end_slope[better], end_distance[better]
        share = np.where(better, 1.0, SHORTER_DESCENT * share)
    return best, is_least


def _updated_inverse(inverse: Array, step: Array, change: Array) -> Array:
    """Correct inverse curvatures so that steps have the changes of slope that were met (BFGS).

    Where a step shows no positive curvature, the inverse stays as it is.

    Args:
        inverse: [n x unknowns x unknowns].
        step: [n x unknowns].
        change: how much less steep it is at the end of the step [n x unknowns].
    """
    work = np.einsum("nc,nc->n", step, change)
    is_convex = work > NO_CURVATURE * np.linalg.norm(step, axis=1) * np.linalg.norm(change, axis=1)
    weight = np.where(is_convex, 1.0 / np.where(is_convex, work, 1.0), 0.0)[:, None, None]
    across = np.eye(step.shape[1]) - weight * step[:, :, None] * change[:, None, :]
    return np.asarray(across @ inverse @ np.swapaxes(across, 1, 2) + weight * step[:, :, None] * step[:, None, :])


def same_mode(problems: Problems, unknowns: Array, goal: Coordinates) -> Mask:
    """Tell which solutions may be in the assembly mode of the home pose: those whose sign does not differ.

    Where the pose leaves coordinates open, there is no sign, and all of them may be.

    Args:
        problems: the problems that have been solved.
        unknowns: their solutions [problems x unknowns].
        goal: coordinates of the platform in each of them.
    """
    if problems.free:
        return np.ones(len(unknowns), dtype=bool)
    at_goal, at_home = signs(problems, unknowns, goal), signs(problems, np.zeros_like(unknowns), problems.at_home())
    return np.asarray(at_goal * at_home >= 0.0)


def signs(problems: Problems, unknowns: Array, goal: Coordinates) -> Array:
    """Return the sign of each leg: 1 or -1, or 0 where it has none or is singular.

    A leg has one if there are as many coordinates as motions of its end, six or, in a plane, three. Nothing
    happens to a leg where the three axes of a ball joint come to lie in a plane: their own sign is left out.

    Args:
        problems: each of one leg.
        unknowns: its coordinates [problems x coordinates].
        goal: coordinates of the platform, which only say how many problems there are.
    """
    rates = problems.gaps(unknowns, goal).rates
    rows = [2, 3, 4] if stays_in_plane(problems.chains) else [0, 1, 2, 3, 4, 5]
    if len(rows) != rates.shape[2]:
        return np.zeros(len(rates))
    result = np.linalg.det(rates[:, rows])
    result = np.where(np.abs(result) > SINGULAR_LEG, result, 0.0)
    for ball in _balls(problems):
        result = result * np.linalg.det(rates[:, :3, ball])
    return np.asarray(np.sign(result))


def _balls(problems: Problems) -> list[list[int]]:
    """The numbers of three coordinates each that are the revolutes of a ball joint."""
    (part,) = problems.parts
    first = np.zeros(1, dtype=int)
    joints = [step.element.mover for step in part.build.steps(first, first)]
    centres = [None if joint.point is None else rows_of(joint.point, 1)[0] for joint in joints]
    return [list(row) for row in rows_about_one_point(centres) if len(row) == BALL_AXES]
