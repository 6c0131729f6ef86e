"""Methods of search, each a row of steps: generations of designs, and descents with exact derivatives.

A generation is a function of the one before it and of the seed, real-coded, for one objective or, as NSGA-II, for
several. Operators are pymoo's, with its defaults: simulated binary crossover, polynomial mutation, non-dominated
sorting and crowding. Choices of a catalogue have no order: they are exchanged between parents and drawn again.

A descent goes from one design downhill to where it ends. Sequential quadratic programming keeps within bounds and
constraints. What is the worst over poses has kinks where two poses are equally bad; there the worst poses each become a
condition f(pose) <= t, and t is minimised (the epigraph). Other aggregates over several poses change smoothly except
where the order of poses does; their derivatives are those of the order at hand.

Sources: Deb and Agrawal, Simulated binary crossover for continuous search space, Complex Systems 9 (1995); Deb, An
efficient constraint handling method for genetic algorithms, Comput. Methods Appl. Mech. Eng. 186 (2000); Deb et al., A
fast and elitist multiobjective genetic algorithm: NSGA-II, IEEE Trans. Evolutionary Computation 6 (2002); Kraft, A
software package for sequential quadratic programming, DFVLR-FB 88-28 (1988), as in scipy.
"""

import dataclasses
from collections.abc import Callable
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from pymoo.operators.crossover.sbx import cross_sbx
from pymoo.operators.mutation.pm import mut_pm

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.late import LateModule
from kinetostat.studies.optimisation.assessment import Assessor, Outcome, join_outcomes
from kinetostat.studies.optimisation.log import Log, Step
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.slopes import Local, Surveyor
from kinetostat.studies.optimisation.terms import PoseTerm

if TYPE_CHECKING:
    from pymoo.operators.survival.rank_and_crowding import metrics
    from pymoo.util.nds import non_dominated_sorting as sorting
    from scipy import optimize
else:  # a genetic search does not descend, and with one objective sorts nothing
    metrics = LateModule("pymoo.operators.survival.rank_and_crowding.metrics")
    sorting = LateModule("pymoo.util.nds.non_dominated_sorting")
    optimize = LateModule("scipy.optimize")

CROSSED_SHARE = 0.9
"""Share of the couples whose children are not copies of them; the default of pymoo, as the next three are."""
CROSSED_GENES = 0.5
"""Share of the genes of a couple that are crossed."""
CROSSOVER_INDEX = 15.0
"""Index of simulated binary crossover: the larger, the nearer children are to their parents."""
MUTATION_INDEX = 20.0
"""Index of polynomial mutation: the larger, the nearer a mutated design is to its parent."""
MOST_MATINGS = 20
"""Greatest number of times that couples are mated to replace children that exist already: a space of few choices may
have no other designs left."""


@dataclass(frozen=True)
class Genetic:
    """A genetic search.

    Attributes:
        assess: judges designs.
        crowded: whether it keeps designs apart along a front (NSGA-II), for several objectives.
    """

    assess: Assessor
    crowded: bool = False

    @property
    def problem(self) -> Problem:
        return self.assess.problem

    @property
    def steps(self) -> int:
        """Generations."""
        return self.problem.study.optimizer.generations

    def step(self, number: int, log: Log) -> Step:
        """One generation: the first is random, around the machine as it is; the others are children of the kept."""
        rng = np.random.default_rng([self.problem.study.optimizer.seed, 1, number])
        if number == 0:
            genes, parents = self._first_designs(rng), np.empty(0, dtype=np.int64)
        else:
            parents = log.survivors
            genes = self._children(log.genes(parents), self._ranks(log.outcome(parents)), rng)
        outcome = self.assess(genes)
        family = np.concatenate([parents, log.count + np.arange(len(genes))])
        ranks = self._ranks(join_outcomes([log.outcome(parents), outcome]) if number else outcome)
        best = np.argsort(ranks, kind="stable")[: self.problem.study.optimizer.population]
        return Step(genes, outcome, family[best])

    def _first_designs(self, rng: np.random.Generator) -> Array:
        """The first generation: the machine as it is, if that is allowed, and random designs."""
        space, count = self.problem.space, self.problem.study.optimizer.population
        genes = rng.random((count, space.size))
        genes[:, self._choices] = np.floor(genes[:, self._choices] * space.catalogue[self._choices])
        if space.holds(space.initial):
            genes[0] = space.initial
        return genes

    @property
    def _choices(self) -> Mask:
        """Flags of the variables that are choices of a catalogue [variables]."""
        return np.asarray(self.problem.space.catalogue > 0)

    def _ranks(self, outcome: Outcome) -> Integers:
        """The rank of each design among all, 0 for the best [designs].

        Feasible designs come first. Of several objectives, the front decides on which a design is, then its distance
        from others there.
        """
        signed = np.array([objective.sign for objective in self.problem.objectives]) * outcome.objectives
        if self.crowded:
            feasible = np.flatnonzero(outcome.violation == 0.0)
            front, distance = np.full(len(signed), len(signed)), np.zeros(len(signed))
            crowding = metrics.get_crowding_function("cd")
            for number, members in enumerate(
                sorting.NonDominatedSorting().do(signed[feasible]) if feasible.size else []
            ):
                front[feasible[members]] = number
                distance[feasible[members]] = crowding.do(signed[feasible[members]], n_remove=0)
            order = np.lexsort([-distance, front, outcome.violation])
        else:
            order = np.lexsort([signed[:, 0], outcome.violation])
        ranks = np.empty(len(order), dtype=np.int64)
        ranks[order] = np.arange(len(order))
        return ranks

    def _children(self, parents: Array, ranks: Integers, rng: np.random.Generator) -> Array:
        """As many new designs as there are parents, none of them twice or one of the parents, as far as possible."""
        children = np.empty((0, parents.shape[1]))
        for _ in range(MOST_MATINGS):
            drawn = self._mate(parents, ranks, rng)
            children = np.concatenate([children, drawn[_new_rows(drawn, np.concatenate([parents, children]))]])
            if len(children) >= len(parents):
                break
        return children[: len(parents)] if len(children) else self._mate(parents, ranks, rng)

    def _mate(self, parents: Array, ranks: Integers, rng: np.random.Generator) -> Array:
        """Children of the better parents of random pairs, as many as there are parents [parents x variables]."""
        count, size = parents.shape
        couples = (count + 1) // 2
        rounds = [rng.permutation(count) for _ in range(-(-4 * couples // count))]
        pairs = np.concatenate(rounds)[: 4 * couples].reshape(-1, 2)
        winners = np.where(ranks[pairs[:, 0]] < ranks[pairs[:, 1]], pairs[:, 0], pairs[:, 1])
        both = parents[winners.reshape(2, couples)]
        children = self._cross(both, rng)
        copied = rng.random(couples) >= CROSSED_SHARE
        children[:, copied] = both[:, copied]
        return self._mutate(children.reshape(-1, size)[:count], rng)

    def _cross(self, both: Array, rng: np.random.Generator) -> Array:
        """Children of couples [2 x couples x variables]; of choices, each comes from either parent."""
        couples, size = both.shape[1:]
        index, swap = np.full((couples, 1), CROSSOVER_INDEX), np.full((couples, 1), 0.5)
        upper = np.where(self._choices, 0.0, 1.0)  # equal bounds: the operator leaves choices alone
        children = cross_sbx(both, np.zeros(size), upper, index, CROSSED_GENES, swap, random_state=rng)
        exchanged = (rng.random((couples, size)) < 0.5) & self._choices
        children[:, :, self._choices] = both[:, :, self._choices]
        children[:, exchanged] = both[::-1, exchanged]
        return children

    def _mutate(self, genes: Array, rng: np.random.Generator) -> Array:
        """Change one gene of a design on average, a little; a choice is drawn again [designs x variables]."""
        count, size = genes.shape
        catalogue = self.problem.space.catalogue
        upper = np.where(self._choices, 0.0, 1.0)
        index, share = np.full(count, MUTATION_INDEX), np.full(count, 1.0 / size)
        mutated = mut_pm(genes, np.zeros(size), upper, index, share, False, random_state=rng)
        drawn = np.floor(rng.random((count, size)) * np.maximum(catalogue, 1))
        redrawn = (rng.random((count, size)) < 1.0 / size) & self._choices
        mutated[:, self._choices] = genes[:, self._choices]
        return np.where(redrawn, drawn, mutated)


def _new_rows(designs: Array, known: Array) -> Integers:
    """Numbers of the designs that are neither among the known ones nor earlier in their list."""
    keys = {row.tobytes() for row in known}
    numbers = []
    for number, row in enumerate(designs):
        key = row.tobytes()
        if key not in keys:
            keys.add(key)
            numbers.append(number)
    return np.array(numbers, dtype=np.int64)


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
"""Relative gain of a round from which on another one is tried."""
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
        rng = np.random.default_rng([settings.seed, 2])
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
            kept.insert(1 if is_better else 0, int(log.survivors[0]))
        return Step(genes, outcome, np.array(kept), {"method": "gradient"})


@dataclasses.dataclass
class _Descent:
    """One descent by the continuous variables, with all choices held.

    Attributes:
        problem: the problem, of which the first objective counts.
        survey: computes its derivatives.
        start: genes from which to descend [variables].
        tried: genes of all designs that were evaluated.
    """

    problem: Problem
    survey: Surveyor
    start: Array
    tried: list[Array] = field(default_factory=list)
    _last: tuple[bytes, Local] | None = None

    def run(self) -> None:
        """Descend; new rounds where the worst poses have to be chosen again."""
        self.tried.append(self.start)
        first = self._at(self.start[self.survey.free])
        if not first.sound:
            return
        takes_worst = isinstance(self._term, PoseTerm) and self._term.aggregate.share == 1.0
        takes_worst = takes_worst and (self.problem.robust is None or self.problem.robust.share == 1.0)
        kinked = takes_worst and first.reached.size > 1
        scale = abs(self._objective(first)[0]) or 1.0
        genes, value = self.start[self.survey.free], np.inf
        for _ in range(MOST_ROUNDS if kinked else 1):
            genes = self._minimise(genes, scale, kinked)
            local = self._at(genes)
            new_value = self._objective(local)[0] / scale if local.sound else np.inf
            if not value - new_value > LEAST_GAIN:
                break
            value = new_value

    @property
    def _term(self) -> Any:
        return self.problem.objectives[0].term

    def _at(self, genes: Array) -> Local:
        """Values and derivatives at a design; the last are kept, because the solver asks for both apart."""
        clipped = np.clip(genes, 0.0, 1.0)
        key = clipped.tobytes()
        if self._last is None or self._last[0] != key:
            whole = self.start.copy()
            whole[self.survey.free] = clipped
            self.tried.append(whole)
            self._last = key, self.survey(whole)
        return self._last[1]

    def _objective(self, local: Local) -> tuple[float, Array]:
        """The objective with its sign, so that less is better, and its derivatives, SI."""
        sign = self.problem.objectives[0].sign
        value, slope = local.term(self._term, sign > 0)
        return sign * value, sign * slope

    def _minimise(self, genes: Array, scale: float, kinked: bool) -> Array:
        """Minimise the objective from some genes, in units of `scale`; by its epigraph where it has kinks."""
        bounds = [(0.0, 1.0)] * len(genes)
        conditions = [self._condition(c.term, c.sign, c.bound, c.scale) for c in self.problem.constraints]
        if not kinked:
            return self._solution(lambda x: self._scaled_objective(x, scale), genes, bounds, conditions, PRECISION)
        # The least t that no value at the worst poses passes: t is one more unknown, and what is minimised.
        worst = self._at(genes).worst(self._term, WORST_POSES)
        unknowns = np.append(genes, self._objective(self._at(genes))[0] / scale)
        conditions.append(_inequality(lambda x: self._below_bound(x, worst, scale)))
        bounds = [*bounds, (-BLOCKED, BLOCKED)]
        return self._solution(_last_unknown, unknowns, bounds, conditions, PRECISION_WITH_KINKS)

    def _solution(
        self,
        function: Callable[[Array], tuple[float, Array]],
        unknowns: Array,
        bounds: list[tuple[float, float]],
        conditions: list[dict[str, Any]],
        precision: float,
    ) -> Array:
        """The genes of the least value that the solver (sequential quadratic programming) comes to."""
        solution = optimize.minimize(
            function,
            unknowns,
            jac=True,
            bounds=bounds,
            constraints=conditions,
            method="SLSQP",
            options={"maxiter": MOST_ITERATIONS, "ftol": precision},
        )
        return np.clip(solution.x[: len(self.survey.free)], 0.0, 1.0)

    def _scaled_objective(self, genes: Array, scale: float) -> tuple[float, Array]:
        """The objective and its derivatives, in units of its size at the start."""
        local = self._at(genes)
        if not local.sound:
            return BLOCKED, np.zeros(len(genes))
        value, slope = self._objective(local)
        return value / scale, slope / scale

    def _below_bound(self, unknowns: Array, worst: Integers, scale: float) -> tuple[Array, Array]:
        """By how much the values at the worst poses are below the bound t, the last unknown, and the derivatives."""
        count, sign = len(unknowns) - 1, self.problem.objectives[0].sign
        local, rows = self._at(unknowns[:count]), np.zeros((len(worst), count + 1))
        rows[:, count] = 1.0
        if not local.sound:
            return np.full(len(worst), unknowns[count] - BLOCKED), rows
        values, slopes = local.pieces(self._term, worst)
        rows[:, :count] = -sign * slopes / scale
        return unknowns[count] - sign * values / scale, rows

    def _condition(self, term: Any, sign: float, bound: float, scale: float) -> dict[str, Any]:
        """A constraint as the solver takes it: a function that must not be negative, and its derivatives."""
        size = len(self.survey.free)

        def room(x: Array) -> tuple[float, Array]:
            local = self._at(x[:size])
            slope = np.zeros(len(x))
            if not local.sound:
                return -1.0, slope
            value, slope[:size] = local.term(term, sign > 0)
            return sign * (bound - value) / scale, -sign * slope / scale

        return _inequality(room)


def _inequality(room: Callable[[Array], tuple[Any, Array]]) -> dict[str, Any]:
    """A condition as the solver takes it: `room`, whose values must not be negative, returns them with derivatives."""
    return {"type": "ineq", "fun": lambda x: room(x)[0], "jac": lambda x: room(x)[1]}


def _last_unknown(x: Array) -> tuple[float, Array]:
    slope = np.zeros(len(x))
    slope[-1] = 1.0
    return float(x[-1]), slope
