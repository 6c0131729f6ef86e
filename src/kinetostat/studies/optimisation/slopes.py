"""Exact derivatives of the terms of a design by its continuous genes, with all choices held, and ridges found by them.

A gene is a variable scaled to the range 0 to 1; a term is an objective or a constraint (`problem`, `terms`). A ridge is
a path through the design space along which the objective keeps its best value, so that other reasons decide. At a best
design the first derivatives by all variables that are free to move are zero; along a ridge the second derivatives are
zero as well. A ridge is followed step by step, with a correction across it after each step, until it meets a bound or
the objective changes.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.engine.derivatives import SMALL_SLAB, differentiate
from kinetostat.engine.points import Population
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.studies.optimisation.assessment import SEARCH_STREAM, deviations, machine_count
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.terms import PoseTerm, Term
from kinetostat.tolerances import ROUND_OFF_OF_SHARE

BOUND_DISTANCE = 1e-6
"""A variable is at its bound if its gene is within this distance of it."""
DIFFERENCE_STEP = 1e-4
"""Step of a gene over which first derivatives are differenced; the error of the second ones falls with its square."""
MOST_STATIONARY_SLOPE = 1e-3
"""Greatest derivative of the objective by a gene, relative to the objective, at which a design counts as a best one."""
FLAT_CURVATURE = 1e-4
"""Relative second derivative below which a direction is flat: 0.005 % of the objective over the range of a gene."""
RIDGE_STEP = 0.02
"""Length of a step along a ridge, in genes."""
MOST_RIDGE_STEPS = 150
"""Greatest number of steps along a ridge in each direction: three times the range of a gene."""
LARGEST_RIDGE_CHANGE = 1e-6
"""Greatest relative change at which the objective counts as the same: far below what manufacture changes."""
SETTLING_STEPS = 3
"""Newton's steps across a ridge after each step along it: from so near, each doubles the digits."""
LEAST_RIDGE = 0.1
"""Length, in steps along a ridge, below which the ridge is a point, and below which a step gets no further."""
LEAST_MOVE_SHARE = 0.02
"""A variable belongs to a ridge if it moves by more than this share of the variable that moves most."""
COMPILE_FROM = 60
"""Evaluations, each of at most `SMALL_SLAB` points, after which derivatives are compiled. For the paper's machine that
takes as long as 62 of them by NumPy, for others it took as long as 20 to 50; a ridge takes some 50."""


@dataclass(frozen=True)
class SurveyedDesign:
    """The values and derivatives of one design at every machine that manufacture may make of it, and at every pose.

    Attributes:
        problem: the problem to which the design belongs.
        values: quantities by name [machines x poses].
        reached: which poses are reached [machines x poses].
        slopes: derivatives of each quantity by each continuous gene, by name [genes x machines x poses].
    """

    problem: Problem
    values: dict[str, Array]
    reached: Mask
    slopes: dict[str, Array]

    @property
    def sound(self) -> bool:
        """Whether enough poses are reached, and all numbers at them are finite."""
        share = self.reached.mean() if self.reached.size else 0.0
        enough = bool(share >= self.problem.poses.required - ROUND_OFF_OF_SHARE and self.reached.any(axis=-1).all())
        arrays = [*self.values.values(), *self.slopes.values()]
        return enough and all(bool(np.isfinite(np.where(self.reached, array, 0.0)).all()) for array in arrays)

    def term(self, term: Term, high_is_bad: bool) -> tuple[float, Array]:
        """Compute a term and its derivatives by the genes; at a kink, those of the pose or machine that decides."""
        pairs = [self._term_of_machine(term, machine) for machine in range(len(self.reached))]
        numbers, slopes = (np.array(column) for column in zip(*pairs, strict=True))
        if self.problem.robust is None or len(numbers) == 1:
            return numbers[0], slopes[0]
        shares = self.problem.robust.weights(numbers, np.ones(len(numbers), dtype=bool), high_is_bad)
        return float(shares @ numbers), shares @ slopes

    def _term_of_machine(self, term: Term, machine: int) -> tuple[float, Array]:
        """A term of one machine over its poses, and its derivatives by the genes: the chain rule over quantities."""
        reached, values = self.reached[machine], {name: rows[machine] for name, rows in self.values.items()}
        number = float(term.values({name: values[name][None] for name in term.names}, reached[None])[0])
        rates = term.slopes(values, reached)
        slopes = (np.where(reached, self.slopes[name][:, machine], 0.0) @ rate for name, rate in rates.items())
        return number, np.asarray(sum(slopes))

    def worst(self, term: PoseTerm, most: int) -> Integers:
        """Return where a term is worst: at most `most` indices into flattened [machines x poses], the worst first."""
        at_poses = term.at_poses(self.values)
        badness = np.where(self.reached, at_poses if term.high_is_bad else -at_poses, -np.inf)
        return np.argsort(-badness, axis=None, kind="stable")[: min(most, int(self.reached.sum()))]

    def pieces(self, term: PoseTerm, indices: Integers) -> tuple[Array, Array]:
        """Return a term at indices of `worst` [pieces], and its derivatives by the genes there [pieces x genes]."""
        sum_slopes = np.sum([weight * self.slopes[name] for name, weight in term.weights], axis=0)
        slopes = sum_slopes.reshape(len(sum_slopes), -1)[:, indices].T
        values = term.at_poses(self.values).flat[indices]
        return values, -slopes * (values * values)[:, None] if term.inverse else slopes


class Surveyor:
    """Computes derivatives for designs of one problem, compiled where that pays.

    A search by derivatives evaluates hundreds of designs, and compiles at once. To explain a design a single evaluation
    may do, or ridges may take hundreds: NumPy takes the first ones.
    """

    def __init__(self, problem: Problem, searching: bool) -> None:
        """Prepare derivatives.

        Args:
            problem: the problem.
            searching: whether many designs will be evaluated for certain.
        """
        self.problem = problem
        self._evaluations = COMPILE_FROM if searching else 0  # counted as if so many had been made by NumPy
        self._free = np.flatnonzero(problem.space.catalogue == 0)
        self._leaf_rates = self._rates_of_leaves()
        self._leaves = list(dict.fromkeys(leaf for rates in self._leaf_rates for leaf in rates))
        samples = problem.study.robustness.search_samples
        self._deviations = {} if problem.robust is None else deviations(problem, samples, SEARCH_STREAM)

    @property
    def free(self) -> Integers:
        """Indices of the continuous variables among those searched."""
        return self._free

    def _rates_of_leaves(self) -> list[Mapping[str, float]]:
        """Return for each continuous gene the scalars of the machine that it changes, each with its rate per gene."""
        searched = self.problem.space.searched_variables
        return [
            {
                leaf: ratio * (searched[k].high - searched[k].low)
                for field, ratio in zip(searched[k].fields, searched[k].ratios, strict=True)
                for leaf in field.leaves
            }
            for k in self._free
        ]

    def __call__(self, genes: Array) -> SurveyedDesign:
        """Evaluate one design, given by its genes [variables], with derivatives, at every machine made of it."""
        return self.designs(genes[None])[0]

    def designs(self, genes: Array) -> list[SurveyedDesign]:
        """Evaluate designs as `__call__` does one, all of them together; given by genes [designs x variables]."""
        problem, count = self.problem, len(genes)
        machines = machine_count(self._deviations)
        added = {name: np.tile(sizes, count) for name, sizes in self._deviations.items()}
        columns = problem.space.columns(np.repeat(genes, machines, axis=0), added)
        population = Population(columns, problem.poses.columns)
        self._evaluations += -(-population.size // SMALL_SLAB)
        repeated = self._evaluations > COMPILE_FROM
        answers = differentiate(problem.machine, population, problem.names, self._leaves, repeated)
        slopes = {}
        with np.errstate(invalid="ignore"):
            for name, rows in zip(problem.names, answers.slopes if answers.slopes is not None else (), strict=True):
                by_leaf = dict(zip(self._leaves, rows, strict=True))
                slopes[name] = np.array(
                    [sum(rate * by_leaf[leaf] for leaf, rate in rates.items()) for rates in self._leaf_rates]
                )
        reached = answers.status == Status.OK
        return [
            SurveyedDesign(
                problem=problem,
                values={name: values[rows] for name, values in answers.values.items()},
                reached=reached[rows],
                slopes={name: slope[:, rows] for name, slope in slopes.items()},
            )
            for rows in (slice(k * machines, (k + 1) * machines) for k in range(count))
        ]


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
        at = "lower" if gene <= BOUND_DISTANCE else "upper" if gene >= 1.0 - BOUND_DISTANCE else ""
        bounds.append("" if count else at)
    return bounds


class Ridges(NamedTuple):
    """The ridges through a design, and a sentence on why none were sought; empty if they were."""

    ridges: tuple[Ridge, ...] = ()
    why_none: str = ""

    @classmethod
    def none_because(cls, reason: str) -> "Ridges":
        """No ridges, for a reason."""
        return cls(why_none=f"No ridges are sought, because {reason}.")


def find_ridges(problem: Problem, survey: Surveyor | None, genes: Array) -> Ridges:
    """Find the ridges through a best design.

    Args:
        problem: a problem with one objective.
        survey: computes the derivatives of the problem; None where it has none, or too many.
        genes: genes of the best design [variables].
    """
    if survey is None:
        return Ridges.none_because("the objective has no derivatives, or too many poses for them")
    term = problem.objectives[0].term
    if isinstance(term, PoseTerm) and problem.poses.count > 1 and not term.aggregate.smooth:
        return Ridges.none_because("the objective has kinks where another pose becomes the worst")
    if problem.constraints or problem.robust is not None:
        return Ridges.none_because("the study has constraints or tolerances")
    bounds = at_bounds(problem, genes)
    free = np.array([k for k, number in enumerate(survey.free) if not bounds[number]], dtype=int)
    if not free.size:
        return Ridges.none_because("every variable is a choice or is at a bound")
    objective = _FreeObjective(problem, survey, genes, free)
    point = genes[survey.free][free]
    if np.abs(objective.rates(point)[0]).max() > MOST_STATIONARY_SLOPE:
        return Ridges.none_because("the search has not converged; refine it with method = hybrid")
    point = objective.settle_across(point)
    curvatures, directions = np.linalg.eigh(objective.rates(point)[1])
    flat = directions[:, np.abs(curvatures) < FLAT_CURVATURE]
    ridges = [objective.ridge(point, direction) for direction in _aligned_basis(flat).T]
    return Ridges(tuple(ridge for ridge in ridges if ridge is not None))


def _aligned_basis(flat: Array) -> Array:
    """Return a basis of the same directions in which each changes few variables, by reduction of columns."""
    directions = flat.copy()
    for k in range(directions.shape[1]):
        unused = np.abs(directions[:, :k]).sum(axis=1) < ROUND_OFF_OF_SHARE
        pivot = int(np.argmax(np.abs(directions[:, k:]).max(axis=1) * unused))
        column = k + int(np.argmax(np.abs(directions[pivot, k:])))
        directions[:, [k, column]] = directions[:, [column, k]]
        directions[:, k] /= directions[pivot, k]
        for other in range(directions.shape[1]):
            if other != k:
                directions[:, other] -= directions[pivot, other] * directions[:, k]
    return directions / np.linalg.norm(directions, axis=0)


@dataclass(frozen=True)
class _FreeObjective:
    """The objective over the variables that are free to move, with relative derivatives.

    Attributes:
        problem: a problem with one objective.
        survey: computes its derivatives.
        genes: genes of the best design [variables].
        free: places of the variables that are at no bound, among the continuous ones.
    """

    problem: Problem
    survey: Surveyor
    genes: Array
    free: Array

    def _around(self, points: Array) -> tuple[Array, Array]:
        """The objective, SI [points], and its derivatives by the genes, relative to it [points x free]."""
        designs = np.tile(self.genes, (len(points), 1))
        designs[:, self.survey.free[self.free]] = points
        values, slopes = np.full(len(points), np.nan), np.full(points.shape, np.nan)
        for k, design in enumerate(self.survey.designs(designs)):
            if design.sound:
                values[k], slope = design.term(self.problem.objectives[0].term, high_is_bad=True)
                slopes[k] = slope[self.free] / (abs(values[k]) or 1.0)
        return values, slopes

    def value(self, point: Array) -> float:
        """The objective, SI."""
        return float(self._around(point[None])[0][0])

    def rates(self, point: Array) -> tuple[Array, Array]:
        """First and second derivatives by the genes, relative to the objective."""
        steps = DIFFERENCE_STEP * np.eye(len(point))
        slopes = self._around(np.concatenate([point[None], point + steps, point - steps]))[1]
        ahead, behind = np.split(slopes[1:], 2)
        matrix = (ahead - behind) / (2.0 * DIFFERENCE_STEP)
        return slopes[0], np.nan_to_num(0.5 * (matrix + matrix.T))

    def settle_across(self, point: Array) -> Array:
        """Return to the best point across the ridge, by Newton's method in the directions that are not flat."""
        for _ in range(SETTLING_STEPS):
            slope, second_derivatives = self.rates(point)
            curvatures, directions = np.linalg.eigh(second_derivatives)
            steep = np.abs(curvatures) >= FLAT_CURVATURE
            across = directions[:, steep]
            point = point - across @ ((across.T @ np.nan_to_num(slope)) / curvatures[steep])
        return np.clip(point, 0.0, 1.0)

    def ridge(self, point: Array, direction: Array) -> Ridge | None:
        """Follow a ridge in both directions; None if it is only a point."""
        level = self.value(point)
        first_end, first_change = self._follow(point, -direction, level)
        second_end, second_change = self._follow(point, direction, level)
        travel = np.abs(second_end - first_end)
        if travel.max() <= LEAST_RIDGE * RIDGE_STEP:
            return None
        numbers = self.survey.free[self.free]
        moving = numbers[travel > LEAST_MOVE_SHARE * travel.max()]
        designs = np.tile(self.genes, (2, 1))
        designs[:, numbers] = first_end, second_end
        start, end = self.problem.space.values(designs)[:, moving].tolist()
        names = tuple(self.problem.space.searched_variables[number].name for number in moving)
        return Ridge(names, tuple(start), tuple(end), float(max(first_change, second_change)))

    def _follow(self, point: Array, direction: Array, level: float) -> tuple[Array, float]:
        """Return the last point of a ridge in one direction, and the greatest relative change up to there.

        Args:
            point: a point of the ridge [free].
            direction: direction of the first step, of length 1; each later step goes on as the one before it went.
            level: the objective on the ridge, SI.
        """
        greatest = 0.0
        for _ in range(MOST_RIDGE_STEPS):
            step = RIDGE_STEP * _room(point, direction)
            following = self.settle_across(point + step * direction)
            change = abs(self.value(following) / level - 1.0)
            if not change <= LARGEST_RIDGE_CHANGE:
                break
            motion = following - point
            point, greatest = following, max(greatest, change)
            if step < RIDGE_STEP or np.linalg.norm(motion) < LEAST_RIDGE * RIDGE_STEP:
                break
            direction = motion / np.linalg.norm(motion)
        return point, greatest


def _room(point: Array, direction: Array) -> float:
    """Return the share of a step along a ridge that stays within the bounds of all genes."""
    ahead = np.where(direction > 0.0, 1.0, 0.0)  # the bound towards which each gene moves
    with np.errstate(divide="ignore", invalid="ignore"):
        distances = np.where(direction == 0.0, np.inf, (ahead - point) / direction)
    return float(np.clip((distances / RIDGE_STEP).min(initial=1.0), 0.0, 1.0))


def ridge_sentences(ridges: Sequence[Ridge], problem: Problem) -> list[str]:
    """Describe ridges in sentences."""
    by_name = {variable.name: variable for variable in problem.space.searched_variables}
    display, sentences = problem.machine.display, []
    for ridge in ridges:
        ways = [
            f"{name} from {by_name[name].in_words(start, display)} to {by_name[name].in_words(end, display)}"
            for name, start, end in zip(ridge.names, ridge.start, ridge.end, strict=True)
        ]
        others = f", together with {', '.join(ways[1:])}" if ways[1:] else ""
        sentences.append(
            f"Ridge: {ways[0]}{others} changes the objective by no more than {ridge.change:.0e} of its value; choose "
            "by other reasons."
        )
    return sentences
