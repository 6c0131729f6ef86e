"""What manufacture within the tolerances makes of a best design: how the objectives scatter, and the worst case."""

from dataclasses import dataclass

import numpy as np

from kinetostat.arrays import Array
from kinetostat.studies.optimisation.assessment import Assessor, Outcome, corners, deviations

STREAM = 1
"""Of random numbers: not the machines of the search."""


@dataclass(frozen=True)
class Scatter:
    """One objective over many machines of one design, SI.

    Attributes:
        label, unit: of the objective.
        nominal: of the design itself.
        mean, deviation: over all machines that can be judged.
        usual: what 95 percent of them keep within.
        worst: of all machines, those with every tolerance at an end included.
        samples: of the random machines; NaN where one cannot be judged.
    """

    label: str
    unit: str
    nominal: float
    mean: float
    deviation: float
    usual: float
    worst: float
    samples: Array


@dataclass(frozen=True)
class Robustness:
    """How a design bears its tolerances.

    Attributes:
        scatters: one for each objective.
        machines: how many random ones.
        corners: how many combinations of ends of tolerances were tried; 0 if there are too many of them.
        failing: share of the random machines that are not feasible.
    """

    scatters: tuple[Scatter, ...]
    machines: int
    corners: int
    failing: float


def robustness_of(assess: Assessor, genes: Array) -> Robustness | None:
    """How a design [variables] bears the tolerances of its study; None where there are none."""
    problem = assess.problem
    if not any(variable.tolerance for variable in problem.space.variables):
        return None
    made = assess.made(genes, deviations(problem, problem.study.robustness.samples, STREAM))
    ends = corners(problem)
    extreme = assess.made(genes, ends) if ends else made.chosen(np.empty(0, dtype=np.int64))
    scatters = tuple(_scatter(assess, k, made, extreme) for k in range(len(problem.objectives)))
    return Robustness(scatters, len(made.violation), len(extreme.violation), float((made.violation > 0.0).mean()))


def _scatter(assess: Assessor, number: int, made: Outcome, extreme: Outcome) -> Scatter:
    objective = assess.problem.objectives[number]
    samples = made.objectives[:, number]
    known = objective.sign * samples[np.isfinite(samples)]
    ends = objective.sign * extreme.objectives[:, number]
    every = np.concatenate([known, ends[np.isfinite(ends)]])
    if not known.size:
        known = every = np.array([np.nan])
    return Scatter(
        objective.term.label,
        objective.term.unit,
        float(samples[0]),
        float(objective.sign * known.mean()),
        float(known.std()),
        float(objective.sign * np.quantile(known, 0.95)),
        float(objective.sign * every.max()),
        samples,
    )
