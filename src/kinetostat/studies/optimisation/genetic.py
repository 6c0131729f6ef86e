"""Genetic searches: generations of designs, real-coded, for one objective or, as NSGA-II, for several.

A generation is a function of the one before it and of the seed. Operators are pymoo's, with its defaults: simulated
binary crossover, polynomial mutation, non-dominated sorting and crowding. Choices of a catalogue have no order: they
are exchanged between parents and drawn again.

Sources: Deb and Agrawal, Simulated binary crossover for continuous search space, Complex Systems 9 (1995); Deb, An
efficient constraint handling method for genetic algorithms, Comput. Methods Appl. Mech. Eng. 186 (2000); Deb et al., A
fast and elitist multiobjective genetic algorithm: NSGA-II, IEEE Trans. Evolutionary Computation 6 (2002).
"""

from typing import TYPE_CHECKING

import numpy as np
from pymoo.operators.crossover.sbx import cross_sbx
from pymoo.operators.mutation.pm import mut_pm

from kinetostat.arrays import Array, Integers
from kinetostat.frozen import dataclass
from kinetostat.late import LateModule
from kinetostat.studies.optimisation.assessment import Assessor, Outcome, join_outcomes
from kinetostat.studies.optimisation.log import Log, Step
from kinetostat.studies.optimisation.problem import Problem

if TYPE_CHECKING:
    from pymoo.operators.survival.rank_and_crowding import metrics
    from pymoo.util.nds import non_dominated_sorting as sorting
else:  # several objectives need them; they import much of SciPy
    metrics = LateModule("pymoo.operators.survival.rank_and_crowding.metrics")
    sorting = LateModule("pymoo.util.nds.non_dominated_sorting")

CROSSED = 0.9
"""Share of the couples whose children are not copies of them."""
GENE_CROSSED = 0.5
"""Share of the genes of a couple that are crossed."""
CROSSOVER_INDEX = 15.0
"""Of simulated binary crossover: the larger, the nearer children are to their parents."""
MUTATION_INDEX = 20.0
"""Of polynomial mutation: the larger, the nearer a mutated design is to its parent."""
ATTEMPTS = 20
"""Times that couples are mated to replace children that exist already."""


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
        """The problem that is searched."""
        return self.assess.problem

    @property
    def steps(self) -> int:
        """Generations."""
        return self.problem.study.optimizer.generations

    def step(self, number: int, log: Log) -> Step:
        """One generation: the first is random, around the machine as it is; the others are children of the kept."""
        source = np.random.default_rng([self.problem.study.optimizer.seed, 1, number])
        if number == 0:
            genes, parents = self._random(source), np.empty(0, dtype=np.int64)
        else:
            parents = log.kept
            genes = self._children(log.genes(parents), self._order(log.outcome(parents))[0], source)
        outcome = self.assess(genes)
        family = np.concatenate([parents, log.count + np.arange(len(genes))])
        order, _ = self._order(join_outcomes([log.outcome(parents), outcome]) if number else outcome)
        best = np.argsort(order, kind="stable")[: self.problem.study.optimizer.population]
        return Step(genes, outcome, family[best])

    def _random(self, source: np.random.Generator) -> Array:
        """The first generation: the machine as it is, if that is allowed, and random designs."""
        space, count = self.problem.space, self.problem.study.optimizer.population
        genes = source.random((count, space.size))
        picked = space.catalogue > 0
        genes[:, picked] = np.floor(genes[:, picked] * space.catalogue[picked])
        if space.holds(space.initial):
            genes[0] = space.initial
        return genes

    def _order(self, outcome: Outcome) -> tuple[Integers, Integers]:
        """Place of each design among all, the best first, and the front that it is on."""
        signs = np.array([objective.sign for objective in self.problem.objectives])
        wanted = signs * outcome.objectives
        front = np.zeros(len(wanted), dtype=np.int64)
        if not self.crowded:
            order = np.lexsort([wanted[:, 0], outcome.violation])
        else:
            feasible = np.flatnonzero(outcome.violation == 0.0)
            front[:], lonely = len(wanted), np.zeros(len(wanted))
            crowding = metrics.get_crowding_function("cd")
            for rank, members in enumerate(sorting.NonDominatedSorting().do(wanted[feasible]) if feasible.size else []):
                front[feasible[members]] = rank
                lonely[feasible[members]] = crowding.do(wanted[feasible[members]], n_remove=0)
            order = np.lexsort([-lonely, front, outcome.violation])
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order))
        return place, front

    def _children(self, parents: Array, place: Integers, source: np.random.Generator) -> Array:
        """As many new designs as there are parents, none of them twice or one of the parents, as far as possible."""
        children = np.empty((0, parents.shape[1]))
        for _ in range(ATTEMPTS):
            fresh = self._mate(parents, place, source)
            children = np.concatenate([children, fresh[_new(fresh, np.concatenate([parents, children]))]])
            if len(children) >= len(parents):
                break
        return children[: len(parents)] if len(children) else self._mate(parents, place, source)

    def _mate(self, parents: Array, place: Integers, source: np.random.Generator) -> Array:
        count, size = parents.shape
        couples = (count + 1) // 2
        rounds = [source.permutation(count) for _ in range(-(-4 * couples // count))]
        pairs = np.concatenate(rounds)[: 4 * couples].reshape(-1, 2)
        winners = np.where(place[pairs[:, 0]] < place[pairs[:, 1]], pairs[:, 0], pairs[:, 1])
        both = parents[winners.reshape(2, couples)]
        children = self._cross(both, source)
        copied = source.random(couples) >= CROSSED
        children[:, copied] = both[:, copied]
        return self._mutate(children.reshape(-1, size)[:count], source)

    def _cross(self, both: Array, source: np.random.Generator) -> Array:
        """Children of couples [2 x couples x variables]."""
        couples, size = both.shape[1:]
        index, swap = np.full((couples, 1), CROSSOVER_INDEX), np.full((couples, 1), 0.5)
        picked = self.problem.space.catalogue > 0
        upper = np.where(picked, 0.0, 1.0)  # equal bounds: the operator leaves choices alone
        children = cross_sbx(both, np.zeros(size), upper, index, GENE_CROSSED, swap, random_state=source)
        exchanged = (source.random((couples, size)) < 0.5) & picked
        children[:, :, picked] = both[:, :, picked]
        children[:, exchanged] = both[::-1, exchanged]
        return children

    def _mutate(self, genes: Array, source: np.random.Generator) -> Array:
        count, size = genes.shape
        catalogue = self.problem.space.catalogue
        picked = catalogue > 0
        upper = np.where(picked, 0.0, 1.0)
        index, share = np.full(count, MUTATION_INDEX), np.full(count, 1.0 / size)
        mutated = mut_pm(genes, np.zeros(size), upper, index, share, False, random_state=source)
        drawn = np.floor(source.random((count, size)) * np.maximum(catalogue, 1))
        redrawn = (source.random((count, size)) < 1.0 / size) & picked
        mutated[:, picked] = genes[:, picked]
        return np.where(redrawn, drawn, mutated)


def _new(fresh: Array, known: Array) -> Integers:
    """Flags of the designs that are neither known nor earlier in the list."""
    seen = {row.tobytes() for row in known}
    numbers = []
    for number, row in enumerate(fresh):
        key = row.tobytes()
        if key not in seen:
            seen.add(key)
            numbers.append(number)
    return np.array(numbers, dtype=np.int64)
