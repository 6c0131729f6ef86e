"""Ridges: paths through the design space along which the objective keeps its best value, so that other reasons decide.

At a best design the first derivatives by all variables that are free to move are zero; along a ridge the second
derivatives are zero as well. A ridge is followed step by step, with a correction across it after each step, until it
meets a bound or the objective changes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinetostat.arrays import Array
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.slopes import Surveyor
from kinetostat.studies.optimisation.terms import PoseTerm

AT_BOUND = 1e-6
"""A variable is at its bound if its gene is within this distance of it."""
DIFFERENCE = 1e-4
"""Step of a gene over which first derivatives are differenced; the error of the second ones falls with its square."""
STATIONARY = 1e-3
"""Greatest derivative of the objective by a gene, relative to the objective, at which a design counts as a best one."""
FLAT = 1e-4
"""Relative second derivative below which a direction is flat: 0.005 % of the objective over the range of a gene."""
STEP = 0.02
"""Length of a step along a ridge, in genes."""
LONGEST = 150
"""Greatest number of steps along a ridge in each direction."""
SAME = 1e-6
"""Greatest relative change at which the objective counts as the same."""
SHARE = 0.02
"""A variable belongs to a ridge if it moves by more than this share of the variable that moves most."""


@dataclass(frozen=True)
class Ridge:
    """A path along which the objective stays the same.

    Attributes:
        names: names of the variables that change along the ridge.
        start, end: values of these variables at the two ends, SI [variables].
        change: greatest relative change of the objective along the ridge.
    """

    names: tuple[str, ...]
    start: tuple[float, ...]
    end: tuple[float, ...]
    change: float


def at_bounds(problem: Problem, genes: Array) -> list[str]:
    """Return "lower" or "upper" for each searched variable that is at this bound, and "" for every other."""
    bounds = []
    for gene, count in zip(genes, problem.space.catalogue, strict=True):
        at = "lower" if gene <= AT_BOUND else "upper" if gene >= 1.0 - AT_BOUND else ""
        bounds.append("" if count else at)
    return bounds


def find_ridges(problem: Problem, survey: Surveyor, genes: Array) -> tuple[list[Ridge], str]:
    """Find the ridges through a best design.

    Args:
        problem: a problem with one objective.
        survey: computes the derivatives of the problem.
        genes: genes of the best design [variables].

    Returns:
        The ridges, and a sentence that says why none could be sought, or "".
    """
    term = problem.objectives[0].term
    if isinstance(term, PoseTerm) and problem.poses.count > 1 and not term.aggregate.smooth:
        return [], "No ridges are sought, because the objective has kinks where another pose becomes the worst."
    if problem.constraints or problem.robust is not None:
        return [], "No ridges are sought, because the study has constraints or tolerances."
    bounds = at_bounds(problem, genes)
    free = np.array([k for k, number in enumerate(survey.free) if not bounds[number]], dtype=int)
    if not free.size:
        return [], "No ridges are sought, because every variable is a choice or is at a bound."
    ground = _Ground(problem, survey, genes, free)
    at = genes[survey.free][free]
    slope = ground.slope(at)
    if np.abs(slope).max() > STATIONARY:
        return [], "No ridges are sought, because the search has not converged; refine it with method = hybrid."
    at = ground.settled(at)
    values, vectors = np.linalg.eigh(ground.curvature(at))
    flat = vectors[:, np.abs(values) < FLAT]
    return [ridge for way in _aligned(flat).T if (ridge := ground.ridge(at, way)) is not None], ""


def _aligned(flat: Array) -> Array:
    """Return a basis of the same directions in which each changes few variables, by reduction of columns."""
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
    """The objective over the variables that are free to move, with relative derivatives."""

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
        """Derivatives by the genes, relative to the objective."""
        value, slope = self._local(at)
        return slope / (abs(value) or 1.0)

    def curvature(self, at: Array) -> Array:
        """Second derivatives by the genes, relative to the objective."""
        rows = []
        for k in range(len(at)):
            step = np.zeros(len(at))
            step[k] = DIFFERENCE
            rows.append((self.slope(at + step) - self.slope(at - step)) / (2.0 * DIFFERENCE))
        matrix = np.array(rows)
        return np.nan_to_num(0.5 * (matrix + matrix.T))

    def settled(self, at: Array) -> Array:
        """Return to the best point across the ridge, by Newton's method in the directions that are not flat."""
        for _ in range(3):
            values, vectors = np.linalg.eigh(self.curvature(at))
            steep = np.abs(values) >= FLAT
            along = vectors[:, steep]
            at = at - along @ ((along.T @ np.nan_to_num(self.slope(at))) / values[steep])
        return np.clip(at, 0.0, 1.0)

    def ridge(self, at: Array, way: Array) -> Ridge | None:
        """Follow a ridge in both directions; None if it is only a point."""
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
        """Return the last point of the ridge in one direction, and the greatest relative change up to there."""
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
    """Return the share of a step that stays within the bounds."""
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
            f"Ridge: {ways[0]}{how} changes the objective by no more than {ridge.change:.0e} of its value; choose by "
            "other reasons."
        )
    return sentences
