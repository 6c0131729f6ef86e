"""Ridges: paths through the design space along which the best objective stays the same, so that other reasons decide.

At a best design the derivatives by all variables that are free to move vanish; along a ridge the second ones vanish as
well. From there the ridge is followed, back to its ground after each step, until it meets a bound or rises.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinetostat.engine.points import Array
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.slopes import Surveyor
from kinetostat.studies.optimisation.terms import PoseTerm

AT_BOUND = 1e-6
"""Gene within which a variable is at its bound."""
DIFFERENCE = 1e-4
"""Gene over which exact derivatives are differenced: the error of second ones is its square."""
STATIONARY = 1e-3
"""Relative derivative of the objective, by a gene, up to which a design counts as a best one."""
FLAT = 1e-4
"""Second derivative, likewise, below which a direction is flat: over the whole range, 0.005 % of the objective."""
STEP = 0.02
"""Genes from one point of a ridge to the next."""
LONGEST = 150
"""Points of a ridge to each side."""
SAME = 1e-6
"""Relative change of the objective that is none."""
SHARE = 0.02
"""Of a ridge's direction, below which a variable takes no part in it."""


@dataclass(frozen=True)
class Ridge:
    """A way along which the objective stays the same.

    Attributes:
        names: of the variables that change along it.
        start, end: their values at its ends, SI [variables].
        change: greatest relative change of the objective along it.
    """

    names: tuple[str, ...]
    start: tuple[float, ...]
    end: tuple[float, ...]
    change: float


def at_bounds(problem: Problem, genes: Array) -> list[str]:
    """Of each searched variable, "lower" or "upper" if it is at that bound, else nothing."""
    sides = []
    for gene, count in zip(genes, problem.space.catalogue, strict=True):
        at = "lower" if gene <= AT_BOUND else "upper" if gene >= 1.0 - AT_BOUND else ""
        sides.append("" if count else at)
    return sides


def find_ridges(problem: Problem, survey: Surveyor, genes: Array) -> tuple[list[Ridge], str]:
    """The ridges through a best design, and why none could be looked for.

    Args:
        problem: with one objective.
        survey: its derivatives.
        genes: the design [variables].
    """
    term = problem.objectives[0].term
    if isinstance(term, PoseTerm) and problem.poses.count > 1 and not term.aggregate.smooth:
        return [], "The objective has kinks where the order of poses changes; ridges are not looked for."
    if problem.constraints or problem.robust is not None:
        return [], "Ridges are looked for only without constraints and for the nominal machine."
    bounds = at_bounds(problem, genes)
    free = np.array([k for k, number in enumerate(survey.free) if not bounds[number]], dtype=int)
    if not free.size:
        return [], "No variable is free to move: all are at bounds or are choices."
    ground = _Ground(problem, survey, genes, free)
    at = genes[survey.free][free]
    slope = ground.slope(at)
    if np.abs(slope).max() > STATIONARY:
        return [], "The search has not come to rest, so that no ridge can be seen; refine it with method = hybrid."
    at = ground.settled(at)
    values, vectors = np.linalg.eigh(ground.curvature(at))
    flat = vectors[:, np.abs(values) < FLAT]
    return [ridge for way in _aligned(flat).T if (ridge := ground.ridge(at, way)) is not None], ""


def _aligned(flat: Array) -> Array:
    """The same directions, turned so that each has as few variables as possible: reduced by columns."""
    directions = flat.copy()
    for k in range(directions.shape[1]):
        pivot = int(np.argmax(np.abs(directions[:, k:]).max(axis=1) * (np.abs(directions[:, :k]).sum(axis=1) < 1e-12)))
        column = k + int(np.argmax(np.abs(directions[pivot, k:])))
        directions[:, [k, column]] = directions[:, [column, k]]
        directions[:, k] /= directions[pivot, k]
        for other in range(directions.shape[1]):
            if other != k:
                directions[:, other] -= directions[pivot, other] * directions[:, k]
    return directions / np.linalg.norm(directions, axis=0)


@dataclass(frozen=True)
class _Ground:
    """The objective over the variables that are free to move, in units of its size at the best design."""

    problem: Problem
    survey: Surveyor
    genes: Array
    free: Array

    def _local(self, at: Array) -> tuple[float, Array]:
        whole = self.genes.copy()
        whole[self.survey.free[self.free]] = at
        here = self.survey(whole)
        if not here.sound:
            return np.nan, np.full(len(at), np.nan)
        value, slope = here.term(self.problem.objectives[0].term, True)
        return value, slope[self.free]

    def value(self, at: Array) -> float:
        """The objective, SI."""
        return self._local(at)[0]

    def slope(self, at: Array) -> Array:
        """Relative derivatives."""
        value, slope = self._local(at)
        return slope / (abs(value) or 1.0)

    def curvature(self, at: Array) -> Array:
        """Relative second derivatives."""
        rows = []
        for k in range(len(at)):
            step = np.zeros(len(at))
            step[k] = DIFFERENCE
            rows.append((self.slope(at + step) - self.slope(at - step)) / (2.0 * DIFFERENCE))
        matrix = np.array(rows)
        return np.nan_to_num(0.5 * (matrix + matrix.T))

    def settled(self, at: Array) -> Array:
        """The nearest lowest point across the ridge: Newton's method in directions that are not flat."""
        for _ in range(3):
            values, vectors = np.linalg.eigh(self.curvature(at))
            steep = np.abs(values) >= FLAT
            along = vectors[:, steep]
            at = at - along @ ((along.T @ np.nan_to_num(self.slope(at))) / values[steep])
        return np.clip(at, 0.0, 1.0)

    def ridge(self, at: Array, way: Array) -> Ridge | None:
        """Follow a ridge both ways; None where it is only a point."""
        level = self.value(at)
        first_end, first = self._followed(at, -way, level)
        second_end, second = self._followed(at, way, level)
        moved = np.abs(second_end - first_end)
        if moved.max() <= STEP / 10.0:
            return None
        taking_part = np.flatnonzero(moved > SHARE * moved.max())
        numbers = self.survey.free[self.free]
        ends = []
        for point in (first_end, second_end):
            whole = self.genes.copy()
            whole[numbers] = point
            ends.append(self.problem.space.values(whole)[numbers][taking_part])
        names = tuple(self.problem.space.searched[numbers[k]].name for k in taking_part)
        return Ridge(names, tuple(ends[0].tolist()), tuple(ends[1].tolist()), float(max(first, second)))

    def _followed(self, at: Array, way: Array, level: float) -> tuple[Array, float]:
        """The last point of the ridge to one side, and the greatest relative change up to there."""
        greatest = 0.0
        for _ in range(LONGEST):
            step = STEP * _room(at, way)
            following = self.settled(at + step * way)
            change = abs(self.value(following) / level - 1.0)
            if not change <= SAME:
                break
            moved = following - at
            at, greatest = following, max(greatest, change)
            if step < STEP or np.linalg.norm(moved) < 0.1 * STEP:
                break
            way = moved / np.linalg.norm(moved)
        return at, greatest


def _room(at: Array, way: Array) -> float:
    """Which share of a step stays within the bounds."""
    with np.errstate(divide="ignore", invalid="ignore"):
        limits = np.where(way > 0.0, (1.0 - at) / way, np.where(way < 0.0, -at / way, np.inf)) / STEP
    return float(np.clip(limits.min(initial=1.0), 0.0, 1.0))


def ridge_sentences(ridges: Sequence[Ridge], problem: Problem) -> list[str]:
    """Describe ridges in sentences."""
    by_name, display = {variable.name: variable for variable in problem.space.searched}, problem.machine.display
    sentences = []
    for ridge in ridges:
        ways = [
            f"{name} from {by_name[name].shown(start, display)} to {by_name[name].shown(end, display)}"
            for name, start, end in zip(ridge.names, ridge.start, ridge.end, strict=True)
        ]
        how = f", together with {', '.join(ways[1:])}" if ways[1:] else ""
        sentences.append(
            f"Ridge: {ways[0]}{how} leaves the objective as it is (to {ridge.change:.0e}); choose freely there."
        )
    return sentences
