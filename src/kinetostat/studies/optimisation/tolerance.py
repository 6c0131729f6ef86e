"""What manufacture makes of a design: deviations of its variables within their tolerances. Nothing is judged here."""

from itertools import product

import numpy as np

from kinetostat.engine.points import Array
from kinetostat.studies.optimisation.problem import Problem

MOST_CORNERS = 12
"""Tolerances of which all combinations of ends are tried: 4096 machines."""
SIGMAS = 3.0
"""Standard deviations of a normal distribution within the tolerance; what lies beyond is drawn at its end."""


def deviations(problem: Problem, samples: int, stream: int) -> dict[str, Array]:
    """Deviations of as many machines as there are samples, SI, by variable [samples]; the first one has none.

    Args:
        problem: with tolerances and the seed.
        samples: how many machines, the nominal one included.
        stream: of random numbers; streams are independent.
    """
    source = np.random.default_rng([problem.study.optimizer.seed, 0, 1 + stream])
    tolerated = [variable for variable in problem.space.variables if variable.tolerance]
    if problem.study.robustness.distribution == "normal":
        drawn = np.clip(source.standard_normal((samples, len(tolerated))) / SIGMAS, -1.0, 1.0)
    else:
        drawn = source.uniform(-1.0, 1.0, (samples, len(tolerated)))
    drawn[0] = 0.0
    return {variable.name: variable.tolerance * row for variable, row in zip(tolerated, drawn.T, strict=True)}


def corners(problem: Problem) -> dict[str, Array]:
    """All combinations of the ends of the tolerances, likewise; empty where there are too many."""
    tolerated = [variable for variable in problem.space.variables if variable.tolerance]
    if not 0 < len(tolerated) <= MOST_CORNERS:
        return {}
    ends = np.array(list(product((-1.0, 1.0), repeat=len(tolerated))))
    return {variable.name: variable.tolerance * row for variable, row in zip(tolerated, ends.T, strict=True)}
