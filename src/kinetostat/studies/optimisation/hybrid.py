"""Hybrid search: a genetic one, whose best design then descends along the gradient."""

from dataclasses import dataclass

from kinetostat.studies.optimisation.genetic import Genetic
from kinetostat.studies.optimisation.gradient import Gradient
from kinetostat.studies.optimisation.log import Log, Step


@dataclass(frozen=True)
class Hybrid:
    """A genetic search, then one descent.

    Attributes:
        first: the genetic search.
        then: the descent.
    """

    first: Genetic
    then: Gradient

    @property
    def steps(self) -> int:
        """Generations, and one more."""
        return self.first.steps + 1

    def step(self, number: int, log: Log) -> Step:
        """A generation, or the descent from the best of the last one."""
        if number < self.first.steps:
            return self.first.step(number, log)
        return self.then.descend(log.genes(log.kept[:1])[0], log)
