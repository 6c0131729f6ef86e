"""Exact derivatives of what a design is worth by its continuous genes; choices are held. Nothing is searched here."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kinetostat.engine.points import Array
from kinetostat.engine.population import Population, differentiate
from kinetostat.kinematics.status import Status
from kinetostat.studies.optimisation.assessment import deviations
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.terms import Mask, PoseTerm, Term

Rows = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Local:
    """One design and its surroundings, over the machines that manufacture makes of it and their poses.

    Attributes:
        problem: to which it belongs.
        values: quantities by name [machines x poses].
        there: which poses are reached [machines x poses].
        slopes: derivatives of each quantity by each continuous gene, by name [genes x machines x poses].
    """

    problem: Problem
    values: dict[str, Array]
    there: Mask
    slopes: dict[str, Array]

    @property
    def sound(self) -> bool:
        """Whether enough poses are reached and everything there is finite."""
        share = self.there.mean() if self.there.size else 0.0
        whole = bool(share >= self.problem.poses.required - 1e-12 and self.there.any(axis=-1).all())
        arrays = [*self.values.values(), *self.slopes.values()]
        return whole and all(bool(np.isfinite(np.where(self.there, array, 0.0)).all()) for array in arrays)

    def term(self, term: Term, high_is_bad: bool) -> tuple[float, Array]:
        """The number of a term, and its derivatives by the genes: where it has a kink, of the part that decides."""
        numbers, slopes = [], []
        for k, there in enumerate(self.there):
            at_machine = {name: rows[k] for name, rows in self.values.items()}
            numbers.append(float(term.values({name: at_machine[name][None] for name in term.names}, there[None])[0]))
            parts = term.slopes(at_machine, there)
            slopes.append(sum(np.where(there, self.slopes[name][:, k], 0.0) @ outer for name, outer in parts.items()))
        made = np.array(numbers)
        if self.problem.robust is None or len(made) == 1:
            return made[0], np.asarray(slopes[0])
        every = np.ones(len(made), dtype=bool)
        shares = self.problem.robust.weights(made, every, high_is_bad)
        return float(shares @ made), shares @ np.array(slopes)

    def worst(self, term: PoseTerm, most: int) -> Rows:
        """Numbers of the worst machines and poses of a term, counted through all of them."""
        at_poses = term.at_poses(self.values)
        badness = np.where(self.there, at_poses if term.high_is_bad else -at_poses, -np.inf)
        return np.argsort(-badness, axis=None, kind="stable")[: min(most, int(self.there.sum()))]

    def pieces(self, term: PoseTerm, numbers: Rows) -> tuple[Array, Array]:
        """A term at some machines and poses, and its derivatives there by the genes [pieces], [pieces x genes]."""
        total = np.sum([weight * self.slopes[name] for name, weight in term.weights], axis=0)
        slopes = total.reshape(len(total), -1)[:, numbers].T
        chosen = term.at_poses(self.values).flat[numbers]
        return chosen, -slopes * (chosen * chosen)[:, None] if term.inverse else slopes


class Surveyor:
    """Finds derivatives for designs of one problem; its program is compiled once."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self._free = np.flatnonzero(problem.space.catalogue == 0)
        self._rates = self._chain()
        by = tuple(dict.fromkeys(path for rates in self._rates for path in rates))
        self._by = {path: k for k, path in enumerate(by)}
        robust = problem.robust is not None
        self._made = deviations(problem, problem.study.robustness.search_samples, 0) if robust else {}

    @property
    def free(self) -> Rows:
        """Numbers of the searched variables that are continuous."""
        return self._free

    def _chain(self) -> list[Mapping[str, float]]:
        """Of each continuous gene, how fast it moves which leaves."""
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
        """One design [variables], every machine that is made of it, and derivatives."""
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
