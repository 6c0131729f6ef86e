"""Exact derivatives of the terms of a design by its continuous genes, with all choices held. Nothing is searched here.

A gene is a variable scaled to the range 0 to 1; a term is an objective or a constraint (`problem`, `terms`).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.engine.derivatives import differentiate
from kinetostat.engine.points import Population
from kinetostat.kinematics.status import Status
from kinetostat.studies.optimisation.assessment import deviations
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.terms import PoseTerm, Term


@dataclass(frozen=True)
class Local:
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
        enough = bool(share >= self.problem.poses.required - 1e-12 and self.reached.any(axis=-1).all())
        arrays = [*self.values.values(), *self.slopes.values()]
        return enough and all(bool(np.isfinite(np.where(self.reached, array, 0.0)).all()) for array in arrays)

    def term(self, term: Term, high_is_bad: bool) -> tuple[float, Array]:
        """Compute a term and its derivatives by the genes; at a kink, those of the pose or machine that decides."""
        numbers, slopes = [], []
        for k, reached in enumerate(self.reached):
            at_machine = {name: rows[k] for name, rows in self.values.items()}
            numbers.append(float(term.values({name: at_machine[name][None] for name in term.names}, reached[None])[0]))
            parts = term.slopes(at_machine, reached)
            slopes.append(sum(np.where(reached, self.slopes[name][:, k], 0.0) @ outer for name, outer in parts.items()))
        at_machines = np.array(numbers)
        if self.problem.robust is None or len(at_machines) == 1:
            return at_machines[0], np.asarray(slopes[0])
        every = np.ones(len(at_machines), dtype=bool)
        shares = self.problem.robust.weights(at_machines, every, high_is_bad)
        return float(shares @ at_machines), shares @ np.array(slopes)

    def worst(self, term: PoseTerm, most: int) -> Integers:
        """Return where a term is worst, the worst first: at most `most` indices into the flattened machines x poses."""
        at_poses = term.at_poses(self.values)
        badness = np.where(self.reached, at_poses if term.high_is_bad else -at_poses, -np.inf)
        return np.argsort(-badness, axis=None, kind="stable")[: min(most, int(self.reached.sum()))]

    def pieces(self, term: PoseTerm, indices: Integers) -> tuple[Array, Array]:
        """Return a term at indices of `worst` [pieces], and its derivatives by the genes there [pieces x genes]."""
        total = np.sum([weight * self.slopes[name] for name, weight in term.weights], axis=0)
        slopes = total.reshape(len(total), -1)[:, indices].T
        chosen = term.at_poses(self.values).flat[indices]
        return chosen, -slopes * (chosen * chosen)[:, None] if term.inverse else slopes


class Surveyor:
    """Computes derivatives for designs of one problem; its program is compiled once."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self._free = np.flatnonzero(problem.space.catalogue == 0)
        self._rates = self._chain()
        by = tuple(dict.fromkeys(path for rates in self._rates for path in rates))
        self._by = {path: k for k, path in enumerate(by)}
        robust = problem.robust is not None
        self._made = deviations(problem, problem.study.robustness.search_samples, 0) if robust else {}

    @property
    def free(self) -> Integers:
        """Indices of the continuous variables among those searched."""
        return self._free

    def _chain(self) -> list[Mapping[str, float]]:
        """Return for each continuous gene the scalars of the machine that it changes, each with its rate per gene."""
        searched = self.problem.space.searched
        return [
            {
                leaf: ratio * (searched[k].high - searched[k].low)
                for field, ratio in zip(searched[k].fields, searched[k].ratios, strict=True)
                for leaf in field.leaves
            }
            for k in self._free
        ]

    def __call__(self, genes: Array) -> Local:
        """Evaluate one design, given by its genes [variables], with derivatives, at every machine made of it."""
        problem = self.problem
        machines = len(next(iter(self._made.values()), (0.0,)))
        columns = problem.space.columns(np.repeat(genes[None], machines, axis=0), self._made)
        population = Population(columns, problem.poses.columns)
        answers = differentiate(problem.machine, population, problem.names, [*self._by])
        slopes = {}
        with np.errstate(invalid="ignore"):
            for name, by_leaf in zip(problem.names, answers.slopes if answers.slopes is not None else (), strict=True):
                parts = [sum(rate * by_leaf[self._by[leaf]] for leaf, rate in rates.items()) for rates in self._rates]
                slopes[name] = np.array(parts)
        return Local(problem, answers.values, answers.status == Status.OK, slopes)
