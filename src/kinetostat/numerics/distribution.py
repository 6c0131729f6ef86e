"""Forces that balance a load and keep within bounds, at least cost, of many problems at once.

Where there are more forces than conditions of balance, internal forces are left to choose: they balance each other. The
forces that are chosen have the least norm, or are nearest to a wanted level, by the squares of their differences from
it or by a higher power. Cables and machines are not known here.

Source: theory (76) and (77). Least norm and least distance to a level: T. Bruckmann, A. Pott and M. Hiller,
"Calculating force distributions for redundantly actuated tendon-based Stewart platforms", Advances in Robot Kinematics
(2006); powers: R. Verhoeven, Analysis of the Workspace of Tendon-based Stewart Platforms (2004), and C. Gosselin and
M. Grenier, "On the determination of the force distribution in overconstrained cable-driven parallel mechanisms",
Meccanica 46 (2011).
"""

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.tolerances import BALANCED, INDEPENDENT_CONDITION, SAME_FORCE, SURELY_REGULAR, UNRESISTED

MOST_CHANGES = 200
"""Greatest number of changes of the set of forces at their bounds: many times the number of cables of a machine."""
MOST_POWER_STEPS = 100
"""Greatest number of steps of Newton's method for powers, many times those that a high power takes."""
MOST_HALVINGS = 30
"""Greatest number of halvings of one of these steps: after as many it is round-off."""
LEAST_CURVATURE = 1e-12
"""Least curvature of the cost by a force, beside 1 for the force that is farthest from the wanted level: a higher power
is flat at the level itself."""
NO_CONDITION = -1
"""Number that stands for none among those of conditions."""


@dataclass(frozen=True)
class Balancing:
    """All forces that balance the loads of n problems: smallest + internal z, for any z.

    Attributes:
        smallest: forces of least norm that balance [n x m].
        internal: orthonormal internal forces, as columns [n x m x r].
        sure: whether `smallest` surely balances the load, and there are surely no other internal forces [n].
    """

    smallest: Array
    internal: Array
    sure: Mask


def balancing(matrix: Array, load: Array) -> Balancing:
    """Find all forces f with matrix f = load, by reflections of all problems together.

    Args:
        matrix: wrenches of unit forces, as columns [n x d x m].
        load: the wrench to which the forces must add up [n x d].

    Returns:
        All forces, `sure` where the matrix is surely of rank d.
    """
    count, conditions, size = matrix.shape
    rows, reflections = np.ascontiguousarray(matrix.transpose(2, 1, 0)), []
    if size < conditions:
        return Balancing(np.full((count, size), np.nan), np.zeros((count, size, 0)), np.zeros(count, dtype=bool))
    for k in range(conditions):
        mirror = rows[k:, k].copy()
        mirror[0] += np.copysign(np.sqrt((mirror * mirror).sum(axis=0)), mirror[0])
        square = (mirror * mirror).sum(axis=0)
        twice = 2.0 / np.where(square > 0.0, square, 1.0)
        reflections.append((mirror, twice))
        _reflect(rows[k:, k:], mirror, twice)
    pivots = np.abs(rows[range(conditions), range(conditions)])
    columns = np.zeros((size, 1 + size - conditions, count))
    for k in range(conditions):  # R^T z = load, from the first row
        columns[k, 0] = (load[:, k] - (rows[:k, k] * columns[:k, 0]).sum(axis=0)) / rows[k, k]
    columns[range(conditions, size), range(1, 1 + size - conditions)] = 1.0
    for k in reversed(range(conditions)):
        _reflect(columns[k:], *reflections[k])
    columns = columns.transpose(2, 0, 1)
    return Balancing(columns[:, :, 0], columns[:, :, 1:], pivots.min(axis=0) > SURELY_REGULAR * pivots.max(axis=0))


def _reflect(rows: Array, mirror: Array, twice: Array) -> None:
    """Reflect columns at the plane across a vector, in place: rows [k x columns x n], mirror [k x n]."""
    rows -= mirror[:, None] * (twice * (mirror[:, None] * rows).sum(axis=0))


def balancing_of_any_rank(matrix: Array, load: Array, scale: float) -> Balancing:
    """Find all forces that balance a single load [d], whatever the rank of the matrix [d x m]; see `balancing`.

    Args:
        matrix, load: see `balancing`.
        scale: a size of loads of which what is left over must be a negligible share.
    """
    across, sizes, along = np.linalg.svd(matrix)
    rank = int((sizes > UNRESISTED * sizes.max(initial=0.0)).sum())
    smallest = along[:rank].T @ ((across[:, :rank].T @ load) / sizes[:rank])
    residual = np.abs(matrix @ smallest - load).max(initial=0.0)
    balances = residual <= BALANCED * max(np.abs(load).max(initial=0.0), scale)
    return Balancing(smallest[None], along[rank:].T[None], np.array([balances]))


@dataclass(frozen=True)
class Rule:
    """A choice among the forces that balance a load within bounds: those nearest to a level.

    Attributes:
        level: the wanted size of every force; 0 for the least ones [n].
        exponent: power p of the differences whose sum is least, at least 2 [n].
    """

    level: Array
    exponent: Array

    def at(self, rows: Integers) -> "Rule":
        """The rule of some of the problems."""
        return Rule(self.level[rows], self.exponent[rows])


def distribution(matrix: Array, load: Array, least: Array, most: Array, rule: Rule) -> tuple[Array, Mask]:
    """Choose forces f with matrix f = load within bounds.

    Args:
        matrix: wrenches of unit forces, as columns [n x d x m].
        load: the wrench to which the forces must add up [n x d].
        least, most: bounds of every force [n]; `most` may be infinite.
        rule: the choice among all forces within the bounds.

    Returns:
        The forces [n x m], and whether there are any within the bounds [n]; else the forces are NaN.
    """
    with np.errstate(all="ignore"):
        balances = balancing(matrix, load)
    usable = np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(load).all(axis=1)
    forces, exist = np.full(balances.smallest.shape, np.nan), np.zeros(len(load), dtype=bool)
    rows = np.flatnonzero(usable & balances.sure)
    regular = Balancing(balances.smallest[rows], balances.internal[rows], balances.sure[rows])
    forces[rows], exist[rows] = within_bounds(regular, least[rows], most[rows], rule.at(rows))
    for row in np.flatnonzero(usable & ~balances.sure):
        special = balancing_of_any_rank(matrix[row], load[row], float(least[row]))
        if special.sure[0]:
            forces[[row]], exist[[row]] = within_bounds(special, least[[row]], most[[row]], rule.at(np.array([row])))
    return forces, exist


def within_bounds(balances: Balancing, least: Array, most: Array, rule: Rule) -> tuple[Array, Mask]:
    """Choose among all forces that balance a load; arguments and results as for `distribution`."""
    internal = balances.internal
    start = balances.smallest + np.einsum("nmr,nr->nm", internal, rule.level[:, None] * internal.sum(axis=1))
    inner, exist = _shortest_into_bounds(internal, start, least, most)
    forces = start + np.einsum("nmr,nr->nm", internal, inner)
    forces[~exist] = np.nan
    rows = np.flatnonzero(exist & (rule.exponent > 2.0))
    if len(rows) and internal.shape[2]:
        forces[rows] = _by_power(internal[rows], forces[rows], least[rows], most[rows], rule.at(rows))
    return forces, exist


def _by_power(internal: Array, forces: Array, least: Array, most: Array, rule: Rule) -> Array:
    """Forces with the least sum of powers, by Newton's method from forces within the bounds.

    Each step is the least one of squares with the curvatures as weights, within the bounds; it is halved until it leads
    to a lesser sum, as some step along it does because the sum is convex.
    """
    forces, rows = forces.copy(), np.arange(len(forces))
    scale = np.maximum(np.abs(forces - rule.level[:, None]).max(axis=1), np.maximum(least, np.abs(rule.level)))
    for _ in range(MOST_POWER_STEPS):
        before = forces[rows]
        step = _step_of_powers(internal[rows], before, least[rows], most[rows], rule.at(rows))
        forces[rows] = before + step
        rows = rows[np.abs(step).max(axis=1) > SAME_FORCE * scale[rows]]
        if not len(rows):
            break
    return forces


def _step_of_powers(internal: Array, forces: Array, least: Array, most: Array, rule: Rule) -> Array:
    """A step of Newton's method for powers within the bounds, halved until the sum is less [n x m]."""
    level, p = rule.level[:, None], rule.exponent[:, None]
    size = np.abs(forces - level).max(axis=1, keepdims=True)
    size_or_one = np.where(size > 0.0, size, 1.0)
    distance = (forces - level) / size_or_one
    curvature = (p - 1.0) * np.abs(distance) ** (p - 2.0) + LEAST_CURVATURE
    slope = np.einsum("nmr,nm->nr", internal, np.abs(distance) ** (p - 2.0) * distance)
    # With the factor of the curvatures, the least step by these weights is the shortest one.
    factor = np.linalg.cholesky(np.einsum("nmr,nm,nms->nrs", internal, curvature, internal))
    scaled = np.linalg.solve(factor, internal.transpose(0, 2, 1)).transpose(0, 2, 1)
    descent = -size * np.linalg.solve(factor, slope[:, :, None])[:, :, 0]
    unbounded: Array = forces + np.einsum("nmr,nr->nm", scaled, descent)
    into_bounds, _ = _shortest_into_bounds(np.asarray(scaled), np.asarray(unbounded), least, most)
    step: Array = unbounded + np.einsum("nmr,nr->nm", scaled, into_bounds) - forces
    cost = (np.abs(distance) ** p).sum(axis=1)
    for _ in range(MOST_HALVINGS):
        worse = (np.abs((forces + step - level) / size_or_one) ** p).sum(axis=1) > cost
        if not worse.any():
            break
        step[worse] *= 0.5
    return step


def _shortest_into_bounds(internal: Array, start: Array, least: Array, most: Array) -> tuple[Array, Mask]:
    """The shortest z [n x r] for which start + internal z is within the bounds, and whether there is any [n]."""
    scale = np.maximum(np.abs(start).max(axis=1, initial=0.0), least)
    scale = np.where(scale > 0.0, scale, 1.0)[:, None]
    ends = np.concatenate([least[:, None] - start, start - most[:, None]], axis=1)
    beyond = np.flatnonzero((ends > UNRESISTED * scale).any(axis=1))
    inner, exist = np.zeros((len(start), internal.shape[2])), np.ones(len(start), dtype=bool)
    if len(beyond):
        sides = np.concatenate([internal[beyond], -internal[beyond]], axis=1)
        shortest, exist[beyond] = nearest_to_origin(sides, ends[beyond] / scale[beyond])
        inner[beyond] = shortest * scale[beyond]
    return inner, exist


def nearest_to_origin(sides: Array, ends: Array) -> tuple[Array, Mask]:
    """Find the point y of each polyhedron sides y >= ends that is nearest to the origin.

    The dual method begins at the origin and takes in one violated condition after the other, while others that pull the
    wrong way are let go. It needs no point within the polyhedron, and says where there is none.

    Args:
        sides: normals of the half spaces [n x k x r].
        ends: the least values of sides y [n x k]; minus infinity for a half space without end.

    Returns:
        The points [n x r], and whether the polyhedron has any [n].

    Source: D. Goldfarb and A. Idnani, "A numerically stable dual method for solving strictly convex quadratic
    programs", Mathematical Programming 27 (1983).
    """
    search = _DualSearch(sides, ends)
    rows = np.arange(len(sides))
    for _ in range(MOST_CHANGES):
        rows, lacking = search.with_violations(rows)
        if not len(rows):
            break
        search.change(rows, lacking)
        rows = rows[search.exist[rows]]
    search.exist[rows] = False
    return search.points, search.exist


class _DualSearch:
    """The points of `nearest_to_origin` while conditions are taken in, one for each polyhedron in a change.

    Attributes:
        points: nearest to the origin under the active conditions [n x r].
        exist: False once a polyhedron has been shown to be empty [n].
    """

    def __init__(self, sides: Array, ends: Array) -> None:
        """Begin at the origin; arguments as of `nearest_to_origin`."""
        count, _, size = sides.shape
        self._sides, self._ends = sides, ends.copy()  # `change` takes out conditions that hold but for round-off
        self._lengths = np.maximum(np.sqrt((sides * sides).sum(axis=2)), UNRESISTED)
        self.points, self.exist = np.zeros((count, size)), np.ones(count, dtype=bool)
        # Conditions that hold exactly, and the one that is being taken in, with their multipliers.
        self._active, self._pull = np.full((count, size), NO_CONDITION), np.zeros((count, size))
        self._entering, self._entering_pull = np.full(count, NO_CONDITION), np.zeros(count)

    def with_violations(self, rows: Integers) -> tuple[Integers, Array]:
        """The polyhedra that still have a condition to take in: the one that is violated most, if none is begun.

        Returns:
            Their numbers, and what is lacking of that condition [rows].
        """
        lacking = self._ends[rows] - np.einsum("nkr,nr->nk", self._sides[rows], self.points[rows])
        has_none_begun = self._entering[rows] == NO_CONDITION
        worst = (lacking / self._lengths[rows]).argmax(axis=1)
        all_hold = lacking.max(axis=1) <= UNRESISTED
        self._entering[rows] = np.where(has_none_begun, worst, self._entering[rows])
        self._entering_pull[rows] = np.where(has_none_begun, 0.0, self._entering_pull[rows])
        is_open = ~(has_none_begun & all_hold)
        rows = rows[is_open]
        return rows, lacking[is_open, self._entering[rows]]

    def change(self, rows: Integers, lacking: Array) -> None:
        """Move points towards the entering conditions, until these hold or an active one would pull the wrong way."""
        size, entering, is_active = self.points.shape[1], self._entering[rows], self._active[rows] != NO_CONDITION
        step, share = self._steps(rows, is_active)
        gain = (step * step).sum(axis=1)
        moves = gain > INDEPENDENT_CONDITION * self._lengths[rows, entering] ** 2
        with np.errstate(all="ignore"):
            until_released = np.where(is_active & (share > UNRESISTED), self._pull[rows] / share, np.inf)
            until_met = np.where(moves, lacking / gain, np.inf)
        # Without any unknown there is no slot for an active condition, and none is released.
        leaving = until_released.argmin(axis=1) if size else np.zeros(len(rows), dtype=int)
        first_released = until_released[np.arange(len(rows)), leaving] if size else np.full(len(rows), np.inf)
        amount = np.minimum(first_released, until_met)
        is_stuck = np.isinf(amount)
        self.exist[rows[is_stuck & (lacking > BALANCED)]] = False
        self._ends[rows[is_stuck], entering[is_stuck]] = -np.inf  # it holds but for round-off, and is not asked again
        amount = np.where(is_stuck, 0.0, amount)
        self.points[rows] += np.where(moves & ~is_stuck, amount, 0.0)[:, None] * step
        self._pull[rows] = np.where(is_active, self._pull[rows] - amount[:, None] * share, 0.0)
        self._entering_pull[rows] += amount
        is_met = ~is_stuck & (until_met <= first_released)
        self._take_in(rows[is_met], is_active[is_met])
        self._entering[rows[is_stuck | is_met]] = NO_CONDITION
        releases = ~is_stuck & ~is_met
        released = rows[releases], leaving[releases]
        self._active[released], self._pull[released] = NO_CONDITION, 0.0

    def _steps(self, rows: Integers, is_active: Mask) -> tuple[Array, Array]:
        """The normals of entering conditions without their shares along those of active ones, and these shares.

        Along such a step the active conditions stay as they are.
        """
        normal = self._sides[rows, self._entering[rows]]
        others = np.where(is_active[:, :, None], self._sides[rows[:, None], self._active[rows]], 0.0)
        square = np.einsum("nar,nbr->nab", others, others) + np.eye(self.points.shape[1]) * ~is_active[:, None, :]
        share = np.linalg.solve(square, np.einsum("nar,nr->na", others, normal)[:, :, None])[:, :, 0]
        return normal - np.einsum("nar,na->nr", others, share), share

    def _take_in(self, rows: Integers, is_active: Mask) -> None:
        """Put entering conditions that now hold, with their multipliers, into the first slot without a condition."""
        if not len(rows):
            return
        slots = rows, np.argmin(is_active, axis=1)
        self._active[slots], self._pull[slots] = self._entering[rows], self._entering_pull[rows]
