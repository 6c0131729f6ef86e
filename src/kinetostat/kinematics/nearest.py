"""Nearest places at which legs close: the posture of idle joints nearest to home, and the pose nearest to a wanted one.

Some joints can move without the platform, as those of a strut that spins: the pose leaves such *idle* freedoms open. Of
all postures that close the legs, the one is taken whose joints stand nearest to their home positions, so that it
depends neither on the way to the pose nor on axes or units of the file.

For a pose that the legs cannot take, a message names the nearest one that they can. Nothing is judged here.

Source: theory section 6.
"""

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import ANGLES, POINT, free_coordinates
from kinetostat.kinematics.leg_gaps import Coordinates, Problems, coordinates_at, problems_of
from kinetostat.machine.machine import Machine
from kinetostat.numerics.iteration import Steps, largest, least_norm, newton, with_damping
from kinetostat.tolerances import (
    CLOSED,
    DEPENDENT,
    IDLE_FREEDOM,
    LEAST_DIVISOR,
    NEAREST_GAIN,
    NEAREST_POSTURE,
    NEWTON_SETTLED,
    NO_COORDINATE,
)

MOST_CORRECTIONS = 8
"""Most of Newton's corrections that close the legs again after a step: from a step that is not too long, two do."""
CURVATURE_STEP = 1e-6
"""Displacement of the unknowns, rad or in units of the machine's length, for differences of the rates: these have six
digits then, which is more than a step needs."""
MOST_POSTURE_STEPS = 40
"""Most steps towards the nearest posture: three do unless steps are shortened far from it."""
LONGEST_POSTURE_STEP = 0.3
"""Change of an unknown in one step, rad or in units of the machine's length, so that it stays in the valley where it
starts."""
SURE_STEP = 1e-5
"""Size of a step, in the same units, from which the next one is its square."""
SHORTENING = 0.25
"""Factor by which a step becomes shorter that has not led nearer."""
SHORTEST_SHARE = 1e-6
"""Share of a step below which no shorter one is tried."""
MOST_POSE_STEPS = 30
"""Most steps towards the nearest pose."""
DAMPINGS: Array = 5.0 ** np.arange(-3.0, 6.0)
"""Dampings of a step that are tried in one batch, in units of the one that led nearest in the step before."""
FIRST_DAMPING = 1e-3
"""Damping of the first step, in units of the curvature of the squared distance itself: hardly any."""
CLOSING_CONTRACTION = 0.25
"""Share of a gap that a correction may leave; a step from which it leaves more was too long."""
NEARLY_CLOSED = 1e-3
"""Gap of the legs that may be left after a step, as a share of the step's square: the distance that a step gains falls
with the same square, so that closing the legs better would be wasted."""
LONG_STEP = 0.1
"""Size of a step, rad or in units of the machine's length, beyond which this gap does not grow."""


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
    rates = problems.gaps(best, goal).rates
    rows = np.flatnonzero(~_surely_held(rates))
    rows = rows[_idle_freedoms(rates[rows]) > 0]  # problems that still move towards their nearest posture
    share, slope_before = np.ones(len(rows)), np.full(len(rows), np.inf)
    for _ in range(MOST_POSTURE_STEPS):
        if not rows.size:
            break
        idle, goal_of_idle = problems.subset(rows), coordinates_at(goal, rows)
        step, slope = _posture_steps(idle, best[rows], goal_of_idle)
        end, is_closed = _closing_step(idle, best[rows] + share[:, None] * step, goal_of_idle)
        # Sums of squares tell steps apart down to half of the digits; shorter ones are Newton's last and taken whole.
        is_short = largest(step) <= SURE_STEP
        nearer = is_closed & (is_short | ((end**2).sum(axis=1) < (best[rows] ** 2).sum(axis=1)))
        best[rows[nearer]] = end[nearer]
        share = np.where(nearer, 1.0, SHORTENING * share)
        # Near the nearest posture the slope falls with its square; one that is not even halved is round-off.
        is_nearest = is_short & ((slope <= NEAREST_POSTURE) | (slope > 0.5 * slope_before))
        is_open = ~is_nearest & (share >= SHORTEST_SHARE)
        rows, share, slope_before = rows[is_open], share[is_open], slope[is_open]
    return best


def _surely_held(rates: Array) -> Mask:
    """Tell where every motion changes a gap, in less time than singular values take; False where this shows nothing.

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


def _posture_steps(problems: Problems, unknowns: Array, goal: Coordinates) -> tuple[Array, Array]:
    """Newton's steps along the idle motions [n x unknowns], and the slopes along these that are left [n]."""
    rates = problems.gaps(unknowns, goal).rates
    left, sizes, right = np.linalg.svd(rates)
    idle = _idle_freedoms(rates)
    steps, largest_slopes = np.zeros_like(unknowns), np.zeros(len(unknowns))
    for count in np.unique(idle[idle > 0]):
        rows = np.flatnonzero(idle == count)
        rank = rates.shape[2] - count
        motions = right[rows, rank:]
        slopes = np.einsum("nic,nc->ni", motions, unknowns[rows])
        # Lagrange's multipliers: how strongly each gap keeps the joints from their home positions.
        pulls = np.einsum("nkc,nc->nk", right[rows, :rank], unknowns[rows]) / sizes[rows, :rank]
        loads = np.einsum("nrk,nk->nr", left[rows, :, :rank], pulls)
        curvature = _curvature_along(problems.subset(rows), unknowns[rows], coordinates_at(goal, rows), motions, loads)
        curvatures, axes = np.linalg.eigh(0.5 * (curvature + np.swapaxes(curvature, 1, 2)))
        amounts = np.einsum("nij,ni->nj", axes, slopes) / np.maximum(np.abs(curvatures), IDLE_FREEDOM)
        step = -np.einsum("nij,nj,nic->nc", axes, amounts, motions)
        steps[rows] = step * np.minimum(1.0, LONGEST_POSTURE_STEP / np.maximum(largest(step), LEAST_DIVISOR))[:, None]
        largest_slopes[rows] = largest(slopes)
    return steps, largest_slopes


def _curvature_along(problems: Problems, unknowns: Array, goal: Coordinates, motions: Array, loads: Array) -> Array:
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
        shift = CURVATURE_STEP * motions[:, k]
        change = problems.gaps(unknowns + shift, goal).rates - problems.gaps(unknowns - shift, goal).rates
        curvature[:, k] -= np.einsum("nr,nrc,nic->ni", loads, change, motions) / (2.0 * CURVATURE_STEP)
    return curvature


def _closing_step(problems: Problems, start: Array, goal: Coordinates) -> tuple[Array, Mask]:
    """Close the legs again after a step, by least motions; return unknowns and whether that closes them."""
    equations, steps = problems.closing_equations(goal, _least_motion), MOST_CORRECTIONS
    end = newton(equations, start, len(start), most_steps=steps, residual_goal=NEWTON_SETTLED, contraction=1.0)
    return end.value, end.residual <= CLOSED


def _least_motion(rates: Array, gaps: Array) -> Array:
    """Least motions that close gaps, without any part along idle motions [n x unknowns]."""
    return np.asarray(np.einsum("ncr,nr->nc", np.linalg.pinv(rates, rcond=IDLE_FREEDOM), gaps))


def nearest_pose(machine: Machine) -> dict[str, float]:
    """Return all coordinates (m, rad) of an admissible pose near a pose that the legs cannot take.

    The distance is measured in the coordinates that the pose gives, angles times the machine's characteristic length.
    The search starts at the home pose and lowers the distance step by step with closed legs, so that it stays in the
    assembly mode of the home pose.
    """
    chains = machine.chains()
    names = tuple(name for name in (*POINT, *ANGLES) if name in {*chains.pose, *free_coordinates(chains)})
    (problems,) = problems_of(chains, 1, names)
    home = {name: float(value) for name, value in problems.at_home().items()}
    units = np.array([1.0 if name in ANGLES else problems.lengths[0] for name in names])
    wish = np.array([float(chains.pose.get(name, home[name])) - home[name] for name in names]) / units
    are_angles = np.array([name in ANGLES for name in names])
    wish = np.where(are_angles, np.arctan2(np.sin(wish), np.cos(wish)), wish)
    given_places = np.flatnonzero([name in chains.pose for name in names])
    first = problems.size - len(names)
    best = _Search(problems, home, first + given_places, wish[given_places]).nearest()
    nearest = home | {name: home[name] + change for name, change in zip(names, best[first:] * units, strict=True)}
    return {name: 0.0 if abs(value) < NO_COORDINATE else float(value) for name, value in nearest.items()}


@dataclass(frozen=True)
class _Place:
    """Unknowns that nearly close the legs [unknowns], the gaps that are left [rows] and their rates [rows x unknowns].

    Of several places, each of these has one more axis in front.
    """

    unknowns: Array
    gaps: Array
    rates: Array


@dataclass(frozen=True)
class _Search:
    """Unknowns that close the legs and bring some of them as near to a goal as possible.

    Attributes:
        problems: the equations of all legs, with every coordinate of the pose free.
        home: coordinates of the platform at the home pose.
        goal_unknowns: numbers of the unknowns that have a goal.
        goal: the values that these unknowns should have.
    """

    problems: Problems
    home: dict[str, float]
    goal_unknowns: Integers
    goal: Array

    def nearest(self) -> Array:
        """Return the unknowns at the nearest pose, found from the home pose by damped Newton steps.

        Each step minimises the squared distance along the motions that the closed legs allow. It is tried with several
        dampings, of which the one that leads nearest is kept. The search ends when the next step would gain less than
        people see in the numbers.
        """
        start, damping = np.zeros(self.problems.size), FIRST_DAMPING
        at_home = self.problems.gaps(start[None], self.home)
        best = _Place(start, at_home.gaps[0], at_home.rates[0])
        for _ in range(MOST_POSE_STEPS):
            dampings = damping * DAMPINGS
            steps, loads, settled = self._steps(best, dampings)
            ends = self._closed_ends(best.unknowns, steps[:1] if settled else steps)
            squares = self._half_squares(ends, loads)
            nearest = int(np.argmin(np.where(np.isfinite(squares), squares, np.inf)))
            if squares[nearest] < self._half_squares(best, loads):
                best = _Place(ends.unknowns[nearest], ends.gaps[nearest], ends.rates[nearest])
                damping = float(dampings[nearest])
            else:
                damping = float(dampings[-1])
            if settled:
                break
        return self._closed_ends(best.unknowns, 0.0 * best.unknowns[None]).unknowns[0]

    def _steps(self, place: _Place, dampings: Array) -> tuple[Array, Array, bool]:
        """Newton's steps towards the goal along the motions that closed legs allow, one for each damping.

        Dampings are added to the absolute values of the curvatures, so that a step damped enough leads nearer.

        Returns:
            The steps [dampings x unknowns]; Lagrange's multipliers, which say how strongly each gap keeps the unknowns
            from the goal [rows]; and whether an undamped step would gain nothing that people see.
        """
        to_goal = np.zeros(len(place.unknowns))
        to_goal[self.goal_unknowns] = self.goal - place.unknowns[self.goal_unknowns]
        distance, allowed = np.linalg.norm(to_goal), _allowed_motions(place.rates)
        loads: Array = np.asarray(np.linalg.lstsq(place.rates.T, to_goal, rcond=DEPENDENT)[0], dtype=float)
        curvatures, axes = np.linalg.eigh(self._curvature(place, allowed, loads))
        principal, stiff = allowed @ axes, np.maximum(np.abs(curvatures), DEPENDENT)
        slope = principal.T @ to_goal
        steps = slope / (stiff + dampings[:, None]) @ principal.T
        return steps, loads, bool(slope @ (slope / stiff) <= NEAREST_GAIN * distance * distance)

    def _curvature(self, place: _Place, allowed: Array, loads: Array) -> Array:
        """The curvature of half the squared distance, with that of the closed legs [motions x motions].

        Args:
            place: where the legs nearly close.
            allowed: motions by which the legs stay closed to first order [unknowns x motions].
            loads: Lagrange's multipliers, see `_steps` [rows].
        """
        problems = self.problems.subset(np.zeros(allowed.shape[1], dtype=int))
        rates_beside = problems.gaps(place.unknowns + CURVATURE_STEP * allowed.T, self.home).rates
        of_legs = np.einsum("r,nrc->nc", loads, rates_beside - place.rates) @ allowed / CURVATURE_STEP
        return np.asarray(allowed[self.goal_unknowns].T @ allowed[self.goal_unknowns] + 0.5 * (of_legs + of_legs.T))

    def _half_squares(self, places: _Place, loads: Array) -> Array:
        """Half the squared distances from the goal as they will be once the gaps that are left are closed [places]."""
        squares = (self.goal - places.unknowns[..., self.goal_unknowns]) ** 2
        return np.asarray(0.5 * squares.sum(axis=-1) - places.gaps @ loads)

    def _closed_ends(self, start: Array, steps: Array) -> _Place:
        """Close the legs again after steps, wherever that takes the platform.

        Args:
            start: unknowns that nearly close the legs [unknowns].
            steps: the steps from there [n x unknowns].

        Returns:
            Where the legs nearly close [n x ...]; unknowns are NaN where that fails.
        """
        count = len(steps)
        problems = self.problems.subset(np.zeros(count, dtype=int))
        enough = np.maximum(CLOSED, NEARLY_CLOSED * np.minimum(np.abs(steps).max(axis=1), LONG_STEP) ** 2)
        gaps, rates = np.zeros((count, problems.rows)), np.zeros((count, problems.rows, problems.size))

        def equations(unknowns: Array, rows: Integers) -> tuple[Array, Steps]:
            gaps[rows], rates[rows], _ = problems.subset(rows).gaps(unknowns, self.home)
            return largest(gaps[rows]), lambda unsolved: least_norm(rates[rows[unsolved]], gaps[rows[unsolved]])

        end = newton(
            equations,
            start + steps,
            count,
            most_steps=MOST_CORRECTIONS,
            residual_goal=enough,
            contraction=CLOSING_CONTRACTION,
        )
        return _Place(np.where(end.converged[:, None], end.value, np.nan), gaps, rates)


def _allowed_motions(rates: Array) -> Array:
    """Motions by which the legs stay closed, to first order [unknowns x motions].

    Args:
        rates: the rates of the gaps [rows x unknowns].
    """
    _, sizes, motions = np.linalg.svd(rates)
    rank = int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum())
    return np.asarray(motions[rank:].T)
