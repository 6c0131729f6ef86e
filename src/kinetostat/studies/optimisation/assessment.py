"""How good designs are: all poses, and all that manufacture makes of each, in one call of the engine.

Designs that cannot be judged are not errors: their verdict says why, and their violation how far they are from it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from kinetostat.engine.points import Array
from kinetostat.engine.population import Evaluator, Population
from kinetostat.kinematics.status import Status
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.tolerance import deviations

AT_ONCE = 1 << 20
"""Points that are evaluated before they are summed up: a few quantities of them fit in a hundred megabytes."""

MET = 1e-9
"""Relative excess up to which a constraint counts as met: whoever ends at its bound is not refused by rounding."""

Codes = npt.NDArray[np.int8]


class Verdict(IntEnum):
    """What became of a design; up to `NOT_CONVERGED` as the `Status` of the poses that it lacks."""

    FEASIBLE = 0
    OUT_OF_REACH = 1
    JOINT_LIMIT = 2
    SINGULAR = 3
    NOT_CONVERGED = 4
    CONSTRAINT = 5
    NOT_FINITE = 6

    @property
    def phrase(self) -> str:
        """For people."""
        return {5: "a constraint is violated", 6: "an objective is infinite"}.get(
            self.value, self.name.lower().replace("_", " ")
        )


@dataclass(frozen=True)
class Outcome:
    """What designs are worth.

    Attributes:
        objectives: SI, as people count them [designs x objectives]; NaN where a design cannot be judged.
        constraints: values of their terms, SI [designs x constraints].
        violation: 0 for a feasible design; below the number of constraints where some are violated, more beyond
            [designs].
        verdict: `Verdict` codes [designs].
    """

    objectives: Array
    constraints: Array
    violation: Array
    verdict: Codes

    def chosen(self, numbers: npt.NDArray[np.int64]) -> "Outcome":
        """Of some designs."""
        return Outcome(*(getattr(self, name)[numbers] for name in vars(self)))


class Assessor:
    """Judges designs of one problem; its program is compiled once."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self._evaluate = Evaluator(problem.machine, problem.paths, problem.names)
        robust = problem.robust is not None
        self._deviations = deviations(problem, problem.study.robustness.search_samples, 0) if robust else {}

    def __call__(self, genes: Array) -> Outcome:
        """Judge designs [designs x variables], each as made by manufacture if the study says so."""
        return self._in_blocks(genes, self._deviations)

    def nominal(self, genes: Array) -> Outcome:
        """Judge designs just as they are."""
        return self._in_blocks(genes, {})

    def made(self, genes: Array, added: Mapping[str, Array]) -> Outcome:
        """Judge every one that manufacture makes of one design [variables]: deviations, SI, by variable."""
        count = len(next(iter(added.values())))
        step = max(1, AT_ONCE // self.problem.poses.count)
        parts = []
        for start in range(0, count, step):
            part = {name: values[start : start + step] for name, values in added.items()}
            repeated = np.repeat(genes[None, :], len(next(iter(part.values()))), axis=0)
            parts.append(self._judged(self.problem.space.columns(repeated, part), 1))
        return joined(parts)

    def _in_blocks(self, genes: Array, added: Mapping[str, Array]) -> Outcome:
        each = len(next(iter(added.values()), (0.0,)))
        step = max(1, AT_ONCE // (each * self.problem.poses.count))
        return joined([self._block(genes[start : start + step], added, each) for start in range(0, len(genes), step)])

    def _block(self, genes: Array, added: Mapping[str, Array], each: int) -> Outcome:
        repeated = np.repeat(genes, each, axis=0)
        tiled = {name: np.tile(values, len(genes)) for name, values in added.items()}
        return self._judged(self.problem.space.columns(repeated, tiled), each)

    def _judged(self, columns: Mapping[str, Array], each: int) -> Outcome:
        """Designs, each of which is `each` machines in a row."""
        problem = self.problem
        answers = self._evaluate(Population(columns, problem.poses.columns))
        there = answers.status == Status.OK
        pairs = [(o.term, o.sign) for o in problem.objectives] + [(c.term, c.sign) for c in problem.constraints]
        numbers = [self._over_made(term.values(answers.values, there), each, sign > 0) for term, sign in pairs]
        status = answers.status.reshape(-1, each * answers.status.shape[1])
        found, count = np.array(numbers).T.reshape(len(status), len(pairs)), len(problem.objectives)
        return _verdicts(problem, found[:, :count], found[:, count:], status)

    def _over_made(self, values: Array, each: int, high_is_bad: bool) -> Array:
        if each == 1 or self.problem.robust is None:
            return values
        made = values.reshape(-1, each)
        return self.problem.robust.over(made, np.ones(made.shape, dtype=bool), high_is_bad)


def _verdicts(problem: Problem, objectives: Array, constraints: Array, status: Codes) -> Outcome:
    """From numbers and the status of all poses [designs x poses] to outcomes."""
    most = len(problem.constraints)
    excess = np.zeros(constraints.shape)
    for k, one in enumerate(problem.constraints):
        over = one.sign * (constraints[:, k] - one.bound) / one.scale
        over = np.where(over <= MET, 0.0, over)
        with np.errstate(invalid="ignore"):
            excess[:, k] = np.where(np.isfinite(over), over / (1.0 + over), 1.0)
    violation = excess.sum(axis=1)
    verdict = np.where(violation > 0.0, Verdict.CONSTRAINT, Verdict.FEASIBLE)
    endless = ~np.isfinite(objectives).all(axis=1)
    verdict[endless], violation[endless] = Verdict.NOT_FINITE, most + 1.0
    counts = np.stack([(status == code).sum(axis=1) for code in Status])
    missing = problem.poses.required - counts[0] / status.shape[1]
    lacking = (missing > 1e-12) | (counts[0] == 0)
    verdict[lacking] = counts[1:, lacking].argmax(axis=0) + 1
    violation[lacking] = most + 2.0 + missing[lacking]
    known = np.where(lacking[:, None], np.nan, objectives)
    return Outcome(known, constraints, violation, verdict.astype(np.int8))


def joined(parts: Sequence[Outcome]) -> Outcome:
    """Outcomes one after the other."""
    if len(parts) == 1:
        return parts[0]
    return Outcome(*(np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])))
