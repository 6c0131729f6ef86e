"""The posture of legs with idle freedoms: motions of joints that move the leg alone, such as the spin of a strut.

The platform's pose leaves such freedoms open. Of all postures that close the legs, the one is taken whose joints stand
nearest to their home positions, so that it depends neither on the way to the pose nor on axes or units of the file.

Source: theory section 6.
"""

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.kinematics.leg_gaps import Coordinates, Problems, coordinates_at
from kinetostat.numerics.iteration import largest, newton, with_damping
from kinetostat.tolerances import CLOSED, IDLE_FREEDOM, LEAST_DIVISOR, NEAREST_POSTURE, NEWTON_SETTLED

MOST_STEPS, MOST_CORRECTIONS = 40, 8
"""Towards the nearest posture; and of Newton's method, which closes the legs again after each of them."""
LONGEST_STEP = 0.3
"""Change of an unknown in one step, rad or in units of the machine's length, so that it stays in the valley where it
starts."""
SURE_STEP = 1e-5
"""Size of a step, in the same units, from which the next one is its square."""
SHORTENING = 0.25
"""Factor by which a step becomes shorter that has not led nearer."""
SHORTEST_STEP = 1e-6
"""Share of a step below which no shorter one is tried."""
BESIDE = 1e-6
"""Displacement of the unknowns, in the same units, whose rates show how idle motions are curved."""


def nearest_home(problems: Problems, unknowns: Array, goal: Coordinates) -> Array:
    """Move idle freedoms to where the sum of squares of all unknowns is least, with the legs closed.

    Each step is Newton's along the idle motions. Curvatures count without their sign, so that every step leads nearer.

    Args:
        problems: problems that have been solved.
        unknowns: their solutions [problems x unknowns], rad or in units of the machine's length.
        goal: coordinates of the platform in each of them.

    Returns:
        Solutions [problems x unknowns]; those without idle freedoms as they were.
    """
    best = unknowns.copy()
    if not len(best):
        return best
    rates = problems.gaps(best, goal)[1]
    rows = np.flatnonzero(~_surely_held(rates))
    rows = rows[_idle_freedoms(rates[rows]) > 0]
    share, slope_before = np.ones(len(rows)), np.full(len(rows), np.inf)
    for _ in range(MOST_STEPS):
        if not rows.size:
            break
        moving, their_goal = problems.subset(rows), coordinates_at(goal, rows)
        step, slope = _steps(moving, best[rows], their_goal)
        end, closed = _closing_step(moving, best[rows] + share[:, None] * step, their_goal)
        # Sums of squares tell steps apart down to half of the digits; shorter ones are Newton's last and taken whole.
        short = largest(step) <= SURE_STEP
        nearer = closed & (short | ((end**2).sum(axis=1) < (best[rows] ** 2).sum(axis=1)))
        best[rows[nearer]] = end[nearer]
        share = np.where(nearer, 1.0, SHORTENING * share)
        settled = short & ((slope <= NEAREST_POSTURE) | (slope > 0.5 * slope_before))
        going = ~settled & (share >= SHORTEST_STEP)
        rows, share, slope_before = rows[going], share[going], slope[going]
    return best


def _surely_held(rates: Array) -> Mask:
    """Tell where every motion changes a gap, much faster than singular values do; False where this shows nothing.

    The sum of squares of the inverse of all squared rates is larger than the inverse of the least of them.
    """
    square = np.swapaxes(rates, 1, 2) @ rates
    inverse = np.linalg.inv(with_damping(square))
    spread = np.linalg.norm(inverse, axis=(1, 2)) * np.trace(square, axis1=1, axis2=2)
    return np.asarray(spread < 1.0 / IDLE_FREEDOM)


def _idle_freedoms(rates: Array) -> Array:
    """Number of independent motions that change no gap, problem by problem [n]; rates are [n x rows x unknowns]."""
    sizes = np.linalg.svd(rates, compute_uv=False)
    return np.asarray(rates.shape[2] - (sizes > IDLE_FREEDOM * sizes[:, :1]).sum(axis=1))


def _steps(problems: Problems, unknowns: Array, goal: Coordinates) -> tuple[Array, Array]:
    """Newton's steps along the idle motions [n x unknowns], and the slopes along these that are left [n]."""
    rates = problems.gaps(unknowns, goal)[1]
    left, sizes, right = np.linalg.svd(rates)
    idle = _idle_freedoms(rates)
    steps, largest_slopes = np.zeros_like(unknowns), np.zeros(len(unknowns))
    for count in np.unique(idle[idle > 0]):
        rows = np.flatnonzero(idle == count)
        kept = rates.shape[2] - count
        motions = right[rows, kept:]
        slopes = np.einsum("nic,nc->ni", motions, unknowns[rows])
        # Lagrange's multipliers: how strongly each gap keeps the joints from their home positions.
        pulls = np.einsum("nkc,nc->nk", right[rows, :kept], unknowns[rows]) / sizes[rows, :kept]
        loads = np.einsum("nrk,nk->nr", left[rows, :, :kept], pulls)
        curvature = _curvature(problems.subset(rows), unknowns[rows], coordinates_at(goal, rows), motions, loads)
        bends, axes = np.linalg.eigh(0.5 * (curvature + np.swapaxes(curvature, 1, 2)))
        amounts = np.einsum("nij,ni->nj", axes, slopes) / np.maximum(np.abs(bends), IDLE_FREEDOM)
        step = -np.einsum("nij,nj,nic->nc", axes, amounts, motions)
        steps[rows] = step * np.minimum(1.0, LONGEST_STEP / np.maximum(largest(step), LEAST_DIVISOR))[:, None]
        largest_slopes[rows] = largest(slopes)
    return steps, largest_slopes


def _curvature(problems: Problems, unknowns: Array, goal: Coordinates, motions: Array, loads: Array) -> Array:
    """Curvature of half the sum of squares along idle motions, with that of the closed legs [n x motions x motions].

    Args:
        problems, goal: n problems with as many idle motions, and the coordinates of the platform in each.
        unknowns: their solutions [n x unknowns].
        motions: the idle motions [n x motions x unknowns].
        loads: Lagrange's multipliers of the gaps [n x rows].
    """
    count, size, _ = motions.shape
    curvature = np.broadcast_to(np.eye(size), (count, size, size)).copy()
    for k in range(size):
        aside = BESIDE * motions[:, k]
        change = problems.gaps(unknowns + aside, goal)[1] - problems.gaps(unknowns - aside, goal)[1]
        curvature[:, k] -= np.einsum("nr,nrc,nic->ni", loads, change, motions) / (2.0 * BESIDE)
    return curvature


def _closing_step(problems: Problems, start: Array, goal: Coordinates) -> tuple[Array, Mask]:
    """Close the legs again after a step, by least motions; return unknowns and whether that closes them."""
    equations, steps = problems.closing_equations(goal, _least_motion), MOST_CORRECTIONS
    end = newton(equations, start, len(start), most_steps=steps, residual_goal=NEWTON_SETTLED, contraction=1.0)
    return end.value, end.residual <= CLOSED


def _least_motion(rates: Array, left: Array) -> Array:
    """Least motions that close gaps, without any part along idle motions [n x unknowns]."""
    return np.asarray(np.einsum("ncr,nr->nc", np.linalg.pinv(rates, rcond=IDLE_FREEDOM), left))
