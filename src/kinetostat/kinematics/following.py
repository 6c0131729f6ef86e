"""Joint coordinates followed from the home pose to a pose, each problem with steps of its own.

A problem is a leg at a pose, or a whole machine where the pose leaves coordinates open (`leg_gaps`). What comes out for
it does not depend on the other problems of the batch. The ways that are tried are in `ways`.

Source: theory (22) and section 6; P. Deuflhard, Newton Methods for Nonlinear Problems (2011), section 5.1, for steps
that are accepted by the contraction of Newton's method.
"""

import numpy as np

from kinetostat.kinematics.closing import Array
from kinetostat.kinematics.leg_gaps import Coordinates, Mask, Numbers, Problems, least_norm
from kinetostat.kinematics.signature import same_mode
from kinetostat.kinematics.status import Status
from kinetostat.kinematics.ways import Way, some, ways
from kinetostat.tolerances import CLOSED, LEAST_GAP_SETTLED, NEWTON_SETTLED

MOST_TRIALS = 80
"""Steps that are tried on one way, accepted or not."""
SHORTEST = 1e-4
"""Share of the way below which a step is too short to go on: the way is blocked."""
FURTHEST = 1.5
"""Change of an unknown in one step, rad or in units of the machine's length, up to which it is tried."""
NEARBY = 0.1
"""Error of the tangent, in the same units, up to which a step is accepted: less than branches usually lie apart."""
CONTRACTION = 0.55
"""Share of a correction that the next one may have. Newton's method has a half at the point where two branches meet,
so that no step beyond it is accepted."""
ROUND_OFF = 1e-7
"""Size of a correction below which its contraction says nothing."""
MOST_ITERATIONS = 60
"""Of Newton's method at the goal, where each halves the gap at worst."""
MOST_DESCENTS = 60
"""Steps towards the least gap, where no way leads to the goal."""
ASIDE = 1e-2
"""Displacement of the unknowns from which these steps start, rad or in units of the machine's length."""


def follow(problems: Problems, goal: Coordinates) -> tuple[Array, Numbers]:
    """Solve problems by following their solutions from the home pose, by one way after the other.

    Args:
        problems: to solve.
        goal: coordinates of the platform in each of them.

    Returns:
        The unknowns [problems x unknowns], and `Status` codes: OK; OUT_OF_REACH where all ways are blocked and the gap
        has a least value that is not zero; NOT_CONVERGED where all ways are blocked and nothing more is known.
    """
    count = len(problems.poses)
    unknowns, status = np.zeros((count, problems.size)), np.full(count, int(Status.NOT_CONVERGED))
    left = np.arange(count)
    for number, (way, differs) in enumerate(ways(problems, goal)):
        if not left.size:
            return unknowns, status
        tried = left[differs[left]]
        if not tried.size:
            continue
        part, there = problems.take(tried), some(goal, tried)
        reached, solved = _by_way(part, way(part, there), there)
        taken = solved if number else np.ones(len(tried), dtype=bool)  # where the straight way ends serves if all fail
        unknowns[tried[taken]], status[tried[solved]] = reached[taken], int(Status.OK)
        left = left[status[left] != Status.OK]
    part, there = problems.take(left), some(goal, left)
    unknowns[left], shown = _least_gap(part, unknowns[left], there)
    status[left[shown]] = int(Status.OUT_OF_REACH)
    return unknowns, status


def _by_way(problems: Problems, way: Way, goal: Coordinates) -> tuple[Array, Mask]:
    """Follow solutions along a way; return where that ends, and whether it ends at the goal in the same mode."""
    unknowns, arrived = _along(problems, way)
    solved = np.zeros(len(unknowns), dtype=bool)
    here = np.flatnonzero(arrived)
    if here.size:
        part, there = problems.take(here), some(goal, here)
        settled, gap = _settled(part, unknowns[here], there)
        unknowns[here] = settled
        solved[here] = (gap <= CLOSED) & same_mode(part, settled, there)
    return unknowns, solved


def _along(problems: Problems, way: Way) -> tuple[Array, Mask]:
    """Go along a way as far as it is open: with how far one comes at the goal, or short of it."""
    count = len(problems.poses)
    unknowns, done, stride = np.zeros((count, problems.size)), np.zeros(count), np.ones(count)
    for _ in range(MOST_TRIALS):
        items = np.flatnonzero((done < 1.0) & (stride >= SHORTEST))
        if not items.size:
            break
        next_share = np.minimum(done[items] + stride[items], 1.0)
        next_share = np.where(next_share > 1.0 - SHORTEST, 1.0, next_share)
        shares = np.ones(count)
        shares[items] = next_share
        part, target = problems.take(items), some(way(shares), items)
        moved, error, accepted = _step(part, unknowns[items], target)
        unknowns[items[accepted]], done[items[accepted]] = moved[accepted], next_share[accepted]
        stride[items] *= np.where(accepted, np.clip(0.9 * error, 0.5, 4.0), np.clip(0.7 * error, 0.1, 0.5))
    return unknowns, done == 1.0


def _step(problems: Problems, unknowns: Array, target: Coordinates) -> tuple[Array, Array, Mask]:
    """Step to a target: along the tangent, and once more by Newton's method.

    Returns:
        Where that leads, by which factor the step could be longer, and whether it is accepted.
    """
    left, rates = problems.gaps(unknowns, target)
    tangent = least_norm(rates, left)
    first = _size(tangent)
    moved, longer = unknowns.copy(), FURTHEST / np.maximum(first, 1e-30)
    accepted = longer >= 1.0
    tried = np.flatnonzero(accepted)
    if tried.size:
        part, start = problems.take(tried), unknowns[tried] + tangent[tried]
        correction = least_norm(*part.gaps(start, some(target, tried))[::-1])
        size = _size(correction)
        close = (size <= CONTRACTION * first[tried]) | (size <= ROUND_OFF)
        accepted[tried] = close & (size <= NEARBY)
        moved[tried] = start + correction
        # The error of the tangent grows as the square of the step, the contraction as the step itself.
        allowed = np.sqrt(NEARBY / np.maximum(size, 1e-30))
        steady = np.maximum(CONTRACTION * first[tried] / np.maximum(size, ROUND_OFF), 0.25)
        longer[tried] = np.minimum(np.minimum(allowed, longer[tried]), steady)
    return moved, np.where(np.isfinite(longer), longer, 0.0), accepted


def _size(steps: Array) -> Array:
    """The largest change of an unknown in each problem; infinite where it is not a number."""
    largest = np.max(np.abs(steps), axis=1, initial=0.0)
    return np.where(np.isfinite(largest), largest, np.inf)


def _settled(problems: Problems, unknowns: Array, goal: Coordinates) -> tuple[Array, Array]:
    """Go on by Newton's method until nothing but round-off is left; return the best unknowns and their gaps."""
    best, least = unknowns.copy(), np.full(len(unknowns), np.inf)
    current, items = unknowns, np.arange(len(unknowns))
    for _ in range(MOST_ITERATIONS):
        part = problems.take(items)
        left, rates = part.gaps(current, some(goal, items))
        gap = _size(left)
        better = gap < least[items]
        best[items[better]], least[items[better]] = current[better], gap[better]
        # A problem that no longer improves has reached round-off, or cannot be solved.
        go = better & (gap > NEWTON_SETTLED)
        if not go.any():
            break
        current, items = current[go] + least_norm(rates[go], left[go]), items[go]
    return best, least


def _least_gap(problems: Problems, unknowns: Array, goal: Coordinates) -> tuple[Array, Mask]:
    """Make the gaps as small as they become near some unknowns, by Levenberg's and Marquardt's method.

    Returns:
        The unknowns there, and whether that is shown to be a least gap which is not zero.
    """
    # The slope vanishes where the gap is greatest too, as at the end of a crank's stroke: the descent starts beside.
    best, shown = unknowns + ASIDE * np.cos(np.arange(problems.size)), np.zeros(len(unknowns), dtype=bool)
    damping, items = np.full(len(unknowns), 1e-2), np.arange(len(unknowns))
    left, rates = problems.gaps(best, goal)
    for _ in range(MOST_DESCENTS):
        slope = np.einsum("nrc,nr->nc", rates, left)
        gap = np.linalg.norm(left, axis=1)
        still = np.linalg.norm(slope, axis=1) <= LEAST_GAP_SETTLED * gap
        shown[items[still & (gap > CLOSED)]] = True
        go = ~still & (gap > CLOSED) & np.isfinite(gap)
        items, left, rates, slope, gap = items[go], left[go], rates[go], slope[go], gap[go]
        if not items.size:
            break
        square = np.einsum("nrc,nrd->ncd", rates, rates) + damping[items][:, None, None] * np.eye(problems.size)
        moved = best[items] + np.linalg.solve(square, slope[:, :, None])[:, :, 0]
        left_there, rates_there = problems.take(items).gaps(moved, some(goal, items))
        better = np.linalg.norm(left_there, axis=1) < gap
        best[items[better]], left[better], rates[better] = moved[better], left_there[better], rates_there[better]
        damping[items] *= np.where(better, 0.2, 5.0)
    return best, shown
