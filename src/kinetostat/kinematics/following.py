"""Joint coordinates followed from the home pose to a pose, each problem with steps of its own.

A problem is a leg at a pose, or a whole machine where the pose leaves coordinates open (`leg_gaps`). What comes out for
it does not depend on the other problems of the batch. The ways that are tried are in `ways`. The assembly mode of a leg
is a sign: that of the determinant of its joints' twists, which vanishes where two modes meet. A solution whose sign
differs from that of the home pose is not taken.

Source: theory (22) and section 6; P. Deuflhard, Newton Methods for Nonlinear Problems (2011), section 5.1, for steps
that are accepted by the contraction of Newton's method.
"""

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
    DEPENDENT,
    LEAST_DIVISOR,
    LEAST_GAP_SETTLED,
    NEWTON_SETTLED,
    NO_CONTRACTION,
    NO_CURVATURE,
)

MOST_TRIALS = 80
"""Number of steps that are tried on one way, accepted or not."""
SHORTEST_STRIDE = 1e-4
"""Share of the way below which a step is too short to go on: the way is blocked."""
LONGEST_STRIDE = 1.5
"""Change of an unknown in one step, rad or in units of the machine's length, up to which it is tried."""
CAREFUL_STRIDE = 0.1
"""Such a change where a way has led to another assembly mode."""
GROWTH, SHRINKAGE = (0.5, 4.0), (0.1, 0.5)
"""Factors between which the next step may lie, after a step that was accepted and after one that was not. It is a
little shorter than the last one's errors allow, 0.9 and 0.7 of that, because the next one's will differ."""
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
"""Added to the curvature at first, for unknowns that change nothing there."""
LONGEST_DESCENT = 0.3
"""Change of an unknown in such a step, in the same units, so that it stays in the valley where it starts."""
ASIDE = 1e-2
"""Displacement of the unknowns from which these steps start, rad or in units of the machine's length."""

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
    left = np.arange(count)
    for number, (plan, differs) in enumerate(ways(problems, goal)):
        if not left.size:
            return unknowns, status
        tried = left[differs[left]]
        if not tried.size:
            continue
        reached, solved = _by_way(problems.subset(tried), plan, coordinates_at(goal, tried))
        taken = solved if number else np.ones(len(tried), dtype=bool)  # where the straight way ends serves if all fail
        unknowns[tried[taken]], status[tried[solved]] = reached[taken], int(Status.OK)
        left = left[status[left] != Status.OK]
    unknowns[left], shown = _least_gap(problems.subset(left), unknowns[left], coordinates_at(goal, left))
    status[left[shown]] = int(Status.OUT_OF_REACH)
    return unknowns, status


def _by_way(problems: Problems, plan: Plan, goal: Coordinates) -> tuple[Array, Mask]:
    """Follow solutions along a way; return where they end, and whether that is at the goal in the same mode.

    A solution at the goal in another mode has crossed to it by too long a step, and is followed again in shorter ones.
    """
    unknowns, solved, crossed = _strides(problems, plan(problems, goal), goal, LONGEST_STRIDE)
    again = np.flatnonzero(crossed)
    if again.size:
        part, target = problems.subset(again), coordinates_at(goal, again)
        unknowns[again], solved[again], _ = _strides(part, plan(part, target), target, CAREFUL_STRIDE)
    return unknowns, solved


def _strides(problems: Problems, way: Way, goal: Coordinates, furthest: float) -> tuple[Array, Mask, Mask]:
    """Follow solutions along a way; return where they end, whether at the goal in the same mode, or in another one."""
    unknowns, arrived = _along(problems, way, furthest)
    solved, crossed = np.zeros((2, len(unknowns)), dtype=bool)
    ended = np.flatnonzero(arrived)
    if ended.size:
        part, target = problems.subset(ended), coordinates_at(goal, ended)
        equations, steps = part.closing_equations(target), MOST_STEPS_AT_GOAL
        # A gap that no longer becomes less has reached round-off, or cannot be closed.
        end = newton(
            equations, unknowns[ended], len(ended), most_steps=steps, residual_goal=NEWTON_SETTLED, contraction=1.0
        )
        unknowns[ended], closed, same = end.value, end.residual <= CLOSED, same_mode(part, end.value, target)
        solved[ended], crossed[ended] = closed & same, closed & ~same
    return unknowns, solved, crossed


def _along(problems: Problems, way: Way, furthest: float) -> tuple[Array, Mask]:
    """Go along a way as far as it is open: with how far one comes at the goal, or short of it."""
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
        moved, could_grow, accepted = _step(part, unknowns[items], target, furthest)
        unknowns[items[accepted]], done[items[accepted]] = moved[accepted], next_share[accepted]
        stride[items] *= np.where(accepted, np.clip(0.9 * could_grow, *GROWTH), np.clip(0.7 * could_grow, *SHRINKAGE))
    return unknowns, done == 1.0


def _step(problems: Problems, unknowns: Array, target: Coordinates, furthest: float) -> tuple[Array, Array, Mask]:
    """Step to a target: along the tangent, and once more by Newton's method.

    Returns:
        Where that leads, by which factor the step could be longer, and whether it is accepted.
    """
    left, rates = problems.gaps(unknowns, target)
    tangent = least_norm(rates, left)
    first = largest(tangent)
    moved, longer = unknowns.copy(), furthest / np.maximum(first, LEAST_DIVISOR)
    accepted = longer >= 1.0
    tried = np.flatnonzero(accepted)
    if tried.size:
        part, start = problems.subset(tried), unknowns[tried] + tangent[tried]
        correction = least_norm(*part.gaps(start, coordinates_at(target, tried))[::-1])
        size = largest(correction)
        close = (size <= STEP_CONTRACTION * first[tried]) | (size <= NO_CONTRACTION)
        accepted[tried] = close & (size <= MOST_TANGENT_ERROR)
        moved[tried] = start + correction
        # The error of the tangent grows as the square of the step, the contraction as the step itself.
        allowed = np.sqrt(MOST_TANGENT_ERROR / np.maximum(size, LEAST_DIVISOR))
        steady = np.maximum(STEP_CONTRACTION * first[tried] / np.maximum(size, NO_CONTRACTION), 0.25)
        longer[tried] = np.minimum(np.minimum(allowed, longer[tried]), steady)
    return moved, np.where(np.isfinite(longer), longer, 0.0), accepted


def _least_gap(problems: Problems, unknowns: Array, goal: Coordinates) -> tuple[Array, Mask]:
    """Bring the legs' ends as near to the goal as they come from some unknowns, by a quasi-Newton method (BFGS).

    It begins with the curvature of Gauss and Newton, which would do if the distance came to zero.

    Returns:
        The unknowns there, and whether that is shown to be a least distance which is not zero.
    """
    # The slope vanishes where the gap is greatest too, as at the end of a crank's stroke: the descent starts beside.
    best, shown = unknowns + ASIDE * np.cos(np.arange(problems.size)), np.zeros(len(unknowns), dtype=bool)
    items, share = np.arange(len(unknowns)), np.ones(len(unknowns))
    left, rates, distance = problems.gaps_and_distance(best, goal)
    slope = np.einsum("nrc,nr->nc", rates, left)
    inverse = np.linalg.inv(np.einsum("nrc,nrd->ncd", rates, rates) + STIFFENING * np.eye(problems.size))
    for _ in range(MOST_DESCENTS):
        still = np.linalg.norm(slope, axis=1) <= LEAST_GAP_SETTLED * np.sqrt(distance)
        apart = (distance > CLOSED * CLOSED) & np.isfinite(distance)
        shown[items[still & apart]] = True
        go = ~still & apart
        items, share, slope, distance, inverse = items[go], share[go], slope[go], distance[go], inverse[go]
        if not items.size:
            break
        step = np.einsum("ncd,nd->nc", inverse, slope)
        step *= (share * np.minimum(1.0, LONGEST_DESCENT / np.maximum(largest(step), LEAST_DIVISOR)))[:, None]
        moved = best[items] + step
        left, rates, distance_there = problems.subset(items).gaps_and_distance(moved, coordinates_at(goal, items))
        slope_there = np.einsum("nrc,nr->nc", rates, left)
        better = distance_there < distance
        inverse[better] = _updated_inverse(inverse[better], step[better], slope[better] - slope_there[better])
        best[items[better]], slope[better], distance[better] = (
            moved[better],
            slope_there[better],
            distance_there[better],
        )
        share = np.where(better, 1.0, 0.25 * share)
    return best, shown


def _updated_inverse(inverse: Array, step: Array, change: Array) -> Array:
    """Correct inverse curvatures so that steps have the changes of slope that were met (BFGS).

    Args:
        inverse: [n x unknowns x unknowns].
        step: [n x unknowns].
        change: how much less steep it is at the end of the step [n x unknowns].
    """
    work = np.einsum("nc,nc->n", step, change)
    sound = work > NO_CURVATURE * np.linalg.norm(step, axis=1) * np.linalg.norm(change, axis=1)
    weight = np.where(sound, 1.0 / np.where(sound, work, 1.0), 0.0)[:, None, None]
    across = np.eye(step.shape[1]) - weight * step[:, :, None] * change[:, None, :]
    return np.asarray(across @ inverse @ np.swapaxes(across, 1, 2) + weight * step[:, :, None] * step[:, None, :])


def same_mode(problems: Problems, unknowns: Array, goal: Coordinates) -> Mask:
    """Tell which solutions may be in the assembly mode of the home pose: all those whose sign does not differ.

    Args:
        problems: the problems that have been solved.
        unknowns: their solutions [problems x unknowns].
        goal: coordinates of the platform in each of them.
    """
    if problems.free:
        return np.ones(len(unknowns), dtype=bool)
    at_goal, at_home = signs(problems, unknowns, goal), signs(problems, 0.0 * unknowns, problems.at_home())
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
    rates = problems.gaps(unknowns, goal)[1]
    rows = [2, 3, 4] if stays_in_plane(problems.chains) else [0, 1, 2, 3, 4, 5]
    if len(rows) != rates.shape[2]:
        return np.zeros(len(rates))
    result = np.linalg.det(rates[:, rows])
    result = np.where(np.abs(result) > DEPENDENT, result, 0.0)
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
