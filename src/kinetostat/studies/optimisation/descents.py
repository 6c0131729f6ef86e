"""A search by descents with exact derivatives, each from one design downhill to where it ends.

Sequential quadratic programming keeps within bounds and constraints. What is the worst over poses has kinks where two
poses are equally bad; there the worst poses each become a condition f(pose) <= t, and t is minimised (the epigraph).
Other aggregates over several poses change smoothly except where the order of poses does; their derivatives are those of
the order at hand.

Source: Kraft, A software package for sequential quadratic programming, DFVLR-FB 88-28 (1988), as in scipy.
"""

import dataclasses
from collections.abc import Callable
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from kinetostat.arrays import Array, Integers
from kinetostat.frozen import dataclass
from kinetostat.late import LateModule
from kinetostat.studies.optimisation.assessment import Assessor, RandomPurpose, random_numbers
from kinetostat.studies.optimisation.log import Log, Step
from kinetostat.studies.optimisation.problem import Constraint, Problem
from kinetostat.studies.optimisation.slopes import SurveyedDesign, Surveyor
from kinetostat.studies.optimisation.terms import PoseTerm, Term

if TYPE_CHECKING:
    from scipy import optimize
else:  # a genetic search does not descend
    optimize = LateModule("scipy.optimize")

MOST_ITERATIONS = 100
"""Greatest number of iterations of one descent."""
PRECISION = 1e-13
"""Relative change of the objective at which a descent ends: near round-off, so that ridges are found from there."""
PRECISION_WITH_KINKS = 1e-9
"""The same with kinks: along the bottom of a curved one a descent would creep for thousands of steps."""
WORST_POSES = 24
"""Conditions that stand for the worst of all poses; more than a design has variables at nearly all kinks."""
MOST_ROUNDS = 5
"""Greatest number of descents with newly chosen worst poses."""
LEAST_GAIN = 1e-7
"""Least relative gain of a round of descents after which another round is tried."""
BLOCKED = 1e6
"""Value that counts as the objective, in units of its size at the start, where a design cannot be judged: no step ends
there."""


@dataclass(frozen=True)
class Gradient:
    """Descents from the machine as it is and from designs spread over the space.

    Attributes:
        assess: judges designs.
    """

    assess: Assessor

    @property
    def problem(self) -> Problem:
        return self.assess.problem

    @property
    def steps(self) -> int:
        """Descents."""
        return self.problem.study.optimizer.starts

    @cached_property
    def _survey(self) -> Surveyor:
        return Surveyor(self.problem, searching=True)

    def step(self, number: int, log: Log) -> Step:
        """One descent."""
        return self.descend(self._start(number), log)

    def _start(self, number: int) -> Array:
        """The machine as it is, if that is allowed, then designs spread evenly along every variable."""
        space, settings = self.problem.space, self.problem.study.optimizer
        if number == 0 and space.holds(space.initial):
            return space.initial
        rng = random_numbers(self.problem, RandomPurpose.DESCENTS)
        # The same numbers for every start: each is a row of one Latin hypercube.
        cells = np.stack([rng.permutation(settings.starts) for _ in range(space.size)], axis=1)
        genes = (cells + rng.random(cells.shape))[number] / settings.starts
        return np.where(space.catalogue > 0, np.floor(genes * np.maximum(space.catalogue, 1)), genes)

    def descend(self, start: Array, log: Log) -> Step:
        """Descend from a design [variables]; every design that was tried is judged and logged."""
        descent = _Descent(self.problem, self._survey, start)
        descent.run()
        genes = np.unique(np.array(descent.tried), axis=0)
        outcome = self.assess(genes)
        signed = self.problem.objectives[0].sign * outcome.objectives[:, 0]
        best = int(np.lexsort([signed, outcome.violation])[0])
        kept = [log.count + best]
        if log.steps:
            best_before = log.outcome(log.survivors[:1])
            signed_before = self.problem.objectives[0].sign * best_before.objectives[0, 0]
            is_better = (outcome.violation[best], signed[best]) < (best_before.violation[0], signed_before)
            kept = [*kept, int(log.survivors[0])] if is_better else [int(log.survivors[0]), *kept]
        return Step(genes, outcome, np.array(kept), {"method": "gradient"})


@dataclasses.dataclass
class _Descent:
    """One descent by the continuous variables, with all choices held.

    Attributes:
        problem: the problem, of which the first objective counts.
        survey: computes its derivatives.
        start: genes from which to descend [variables].
        tried: genes of all designs that were evaluated, the start first.
    """

    problem: Problem
    survey: Surveyor
    start: Array
    tried: list[Array] = field(default_factory=list)
    _last: tuple[bytes, SurveyedDesign] | None = None

    def run(self) -> None:
        """Descend; new rounds where the worst poses have to be chosen again."""
        self.tried.append(self.start)
        genes = self.start[self.survey.free]
        first = self._at(genes)
        if not first.sound:
            return
        scale = abs(self._objective(first)[0]) or 1.0
        kinked = self._kinked_term if first.reached.size > 1 else None
        if kinked is None:
            self._at(self._minimise(genes, scale))  # so that the design where the descent ends is among those tried
            return
        value = np.inf
        for _ in range(MOST_ROUNDS):
            genes = self._minimise_worst(kinked, genes, scale)
            design = self._at(genes)
            new_value = self._objective(design)[0] / scale if design.sound else np.inf
            if not value - new_value > LEAST_GAIN:
                break
            value = new_value

    @property
    def _term(self) -> Term:
        return self.problem.objectives[0].term

    @property
    def _kinked_term(self) -> PoseTerm | None:
        """The term of the objective, if it is the worst over poses and machines; else None."""
        term, robust = self._term, self.problem.robust
        if not isinstance(term, PoseTerm) or term.aggregate.share != 1.0:
            return None
        return term if robust is None or robust.share == 1.0 else None

    def _at(self, genes: Array) -> SurveyedDesign:
        """Values and derivatives at a design; the last are kept, because the solver asks for both apart."""
        clipped = np.clip(genes, 0.0, 1.0)
        key = clipped.tobytes()
        if self._last is None or self._last[0] != key:
            whole = self.start.copy()
            whole[self.survey.free] = clipped
            self.tried.append(whole)
            self._last = key, self.survey(whole)
        return self._last[1]

    def _objective(self, design: SurveyedDesign) -> tuple[float, Array]:
        """The objective with its sign, so that less is better, and its derivatives, SI."""
        sign = self.problem.objectives[0].sign
        value, slope = design.term(self._term, sign > 0)
        return sign * value, sign * slope

    def _minimise(self, genes: Array, scale: float) -> Array:
        """Minimise the objective from some genes, in units of `scale`."""
        bounds = [(0.0, 1.0)] * len(genes)
        return self._solution(lambda x: self._scaled_objective(x, scale), genes, bounds, [], PRECISION)

    def _minimise_worst(self, term: PoseTerm, genes: Array, scale: float) -> Array:
        """Minimise the worst value of a term from some genes by its epigraph, in units of `scale`.

        It is the least t that no value at the worst poses passes: t is one more unknown, and what is minimised.
        """
        start = self._at(genes)
        worst = start.worst(term, WORST_POSES)
        unknowns = np.append(genes, self._objective(start)[0] / scale)
        bounds = [*[(0.0, 1.0)] * len(genes), (-BLOCKED, BLOCKED)]
        epigraph = _inequality(lambda x: self._below_bound(term, x, worst, scale))
        return self._solution(_last_unknown, unknowns, bounds, [epigraph], PRECISION_WITH_KINKS)

    def _solution(
        self,
        function: Callable[[Array], tuple[float, Array]],
        unknowns: Array,
        bounds: list[tuple[float, float]],
        conditions: list[dict[str, Any]],
        precision: float,
    ) -> Array:
        """The genes of the least value that the solver (sequential quadratic programming) comes to.

        Args:
            function: the value that is minimised, and its derivatives.
            unknowns: start of the unknowns, of which the genes come first.
            bounds: least and greatest value of each unknown.
            conditions: conditions beside the constraints of the problem, as `_inequality` makes them.
            precision: relative change of the value at which the descent ends.
        """
        solution = optimize.minimize(
            function,
            unknowns,
            jac=True,
            bounds=bounds,
            constraints=[*map(self._condition, self.problem.constraints), *conditions],
            method="SLSQP",
            options={"maxiter": MOST_ITERATIONS, "ftol": precision},
        )
        return np.clip(solution.x[: len(self.survey.free)], 0.0, 1.0)

    def _scaled_objective(self, genes: Array, scale: float) -> tuple[float, Array]:
        """The objective and its derivatives, in units of its size at the start."""
        design = self._at(genes)
        if not design.sound:
            return BLOCKED, np.zeros(len(genes))
        value, slope = self._objective(design)
        return value / scale, slope / scale

    def _below_bound(self, term: PoseTerm, unknowns: Array, worst: Integers, scale: float) -> tuple[Array, Array]:
        """By how much a term at the worst poses is below the bound t, the last unknown, and the derivatives."""
        genes, bound, sign = unknowns[:-1], unknowns[-1], self.problem.objectives[0].sign
        design, jacobian = self._at(genes), np.zeros((len(worst), len(unknowns)))
        jacobian[:, -1] = 1.0
        if not design.sound:
            return np.full(len(worst), bound - BLOCKED), jacobian
        values, slopes = design.pieces(term, worst)
        jacobian[:, :-1] = -sign * slopes / scale
        return bound - sign * values / scale, jacobian

    def _condition(self, constraint: Constraint) -> dict[str, Any]:
        """A constraint as the solver takes it: a function that must not be negative, and its derivatives."""
        count, sign = len(self.survey.free), constraint.sign

        def room(unknowns: Array) -> tuple[float, Array]:
            design, slope = self._at(unknowns[:count]), np.zeros(len(unknowns))
            if not design.sound:
                return -1.0, slope  # a design that cannot be judged breaks every constraint, by all of its size
            value, slope[:count] = design.term(constraint.term, sign > 0)
            return sign * (constraint.bound - value) / constraint.scale, -sign * slope / constraint.scale

        return _inequality(room)


def _inequality(room: Callable[[Array], tuple[Any, Array]]) -> dict[str, Any]:
    """A condition as the solver takes it: `room`, whose values must not be negative, returns them with derivatives."""
    return {"type": "ineq", "fun": lambda x: room(x)[0], "jac": lambda x: room(x)[1]}


def _last_unknown(x: Array) -> tuple[float, Array]:
    """The last unknown and its derivatives by all of them, as the solver takes what it minimises."""
    slope = np.zeros(len(x))
    slope[-1] = 1.0
    return float(x[-1]), slope
