"""A genetic search: generations of designs, for one objective or, as NSGA-II, for several.

A generation is a function of the one before it and of the seed, real-coded. Operators are pymoo's, with its defaults:
simulated binary crossover, polynomial mutation, non-dominated sorting and crowding. Choices of a catalogue have no
order: they are exchanged between parents and drawn again.

Sources: Deb and Agrawal, Simulated binary crossover for continuous search space, Complex Systems 9 (1995); Deb, An
efficient constraint handling method for genetic algorithms, Comput. Methods Appl. Mech. Eng. 186 (2000); Deb et al., A
fast and elitist multiobjective genetic algorithm: NSGA-II, IEEE Trans. Evolutionary Computation 6 (2002).
"""

from typing import TYPE_CHECKING

import numpy as np
from pymoo.operators.crossover.sbx import cross_sbx
from pymoo.operators.mutation.pm import mut_pm

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.late import LateModule
from kinetostat.studies.optimisation.assessment import (
    Assessor,
    Outcome,
    RandomPurpose,
    join_outcomes,
    random_numbers,
)
from kinetostat.studies.optimisation.log import Log, Step
from kinetostat.studies.optimisation.problem import Problem

if TYPE_CHECKING:
    from pymoo.operators.survival.rank_and_crowding import metrics
    from pymoo.util.nds import non_dominated_sorting as sorting
else:  # a search with one objective sorts nothing
    metrics = LateModule("pymoo.operators.survival.rank_and_crowding.metrics")
    sorting = LateModule("pymoo.util.nds.non_dominated_sorting")

CROSSED_SHARE = 0.9
"""Share of the couples whose children are not copies of them; a default of pymoo."""
CROSSED_GENES = 0.5
"""Share of the genes of a couple that are crossed; a default of pymoo."""
SWAPPED_GENES = 0.5
"""Share of the genes that two children exchange, so that neither is like one parent; a default of pymoo for crossed
genes, and even odds for choices."""
CROSSOVER_INDEX = 15.0
"""Index of simulated binary crossover: the larger, the nearer children are to their parents; a default of pymoo."""
MUTATION_INDEX = 20.0
"""Index of polynomial mutation: the larger, the nearer a mutated design is to its parent; a default of pymoo."""
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
        rng = random_numbers(self.problem, RandomPurpose.GENERATIONS, number)
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

    @property
    def _upper_bounds(self) -> Array:
        """Upper bounds of genes for pymoo's operators, which leave genes with equal bounds alone, as choices are."""
        return np.where(self._choices, 0.0, 1.0)

    def _ranks(self, outcome: Outcome) -> Integers:
        """The rank of each design among all, 0 for the best [designs].

        Feasible designs come first. Of several objectives, the front decides on which a design is, then its distance
        from others there.
        """
        signed = np.array([objective.sign for objective in self.problem.objectives]) * outcome.objectives
        if not self.crowded:
            order = np.lexsort([signed[:, 0], outcome.violation])
        else:
            feasible = np.flatnonzero(outcome.violation == 0.0)
            fronts = sorting.NonDominatedSorting().do(signed[feasible]) if feasible.size else []
            front_number, distance = np.full(len(signed), len(signed)), np.zeros(len(signed))
            crowding = metrics.get_crowding_function("cd")
            for number, members in enumerate(fronts):
                front_number[feasible[members]] = number
                distance[feasible[members]] = crowding.do(signed[feasible[members]], n_remove=0)
            order = np.lexsort([-distance, front_number, outcome.violation])  # the last key counts first
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
        contestants = 4 * couples  # two in a contest for each of both places of a couple
        contests = -(-contestants // count)  # permutations of all parents that have so many, the last one in part
        drawn = np.concatenate([rng.permutation(count) for _ in range(contests)])[:contestants].reshape(-1, 2)
        winners = np.where(ranks[drawn[:, 0]] < ranks[drawn[:, 1]], drawn[:, 0], drawn[:, 1])
        both = parents[winners.reshape(2, couples)]
        children = self._cross(both, rng)
        copied = rng.random(couples) >= CROSSED_SHARE
        children[:, copied] = both[:, copied]
        return self._mutate(children.reshape(-1, size)[:count], rng)

    def _cross(self, both: Array, rng: np.random.Generator) -> Array:
        """Children of couples [2 x couples x variables]; of choices, each comes from either parent."""
        couples, size = both.shape[1:]
        index, swap = np.full((couples, 1), CROSSOVER_INDEX), np.full((couples, 1), SWAPPED_GENES)
        children = cross_sbx(both, np.zeros(size), self._upper_bounds, index, CROSSED_GENES, swap, random_state=rng)
        exchanged = (rng.random((couples, size)) < SWAPPED_GENES) & self._choices
        children[:, :, self._choices] = both[:, :, self._choices]
        children[:, exchanged] = both[::-1, exchanged]
        return children

    def _mutate(self, genes: Array, rng: np.random.Generator) -> Array:
        """Change one gene of a design on average, a little; a choice is drawn again [designs x variables]."""
        count, size = genes.shape
        catalogue = self.problem.space.catalogue
        index, share = np.full(count, MUTATION_INDEX), np.full(count, 1.0 / size)
        mutated = mut_pm(genes, np.zeros(size), self._upper_bounds, index, share, False, random_state=rng)
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
