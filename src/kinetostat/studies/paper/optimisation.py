"""Section 4.3 of the paper run again: its genetic algorithm, Fig. 6, and a gradient search that knows nothing of it."""

from collections.abc import Iterator

import numpy as np

from kinetostat.studies.optimisation.problem import load_problem
from kinetostat.studies.optimisation.result import Result, optimize
from kinetostat.studies.optimisation.ridges import told
from kinetostat.studies.paper import printed
from kinetostat.studies.paper.claims import Claim, Finding

STUDY = "zhang-gosselin-2002"
AT_REST = 60
"""Generation by which the paper's population has converged."""
CONVERGED = 1e-4
"""Relative distance of its mean from the end that no eye tells apart in Fig. 6."""


def search_again() -> tuple[Result, tuple[Claim, ...]]:
    """The paper's search with our means, and what becomes of its statements."""
    genetic = optimize(load_problem(STUDY))
    gradient = optimize(load_problem(STUDY, ["optimizer.method=gradient"]))
    return genetic, (*_statements(genetic, gradient),)


def _statements(genetic: Result, gradient: Result) -> Iterator[Claim]:
    found, smooth = (float(one.outcome.objectives[0, 0]) for one in (genetic, gradient))
    target, study = float(printed.OPTIMISED_SUM), genetic.problem.study.optimizer
    ridges = " ".join(told(genetic.ridges, genetic.problem))
    agree = abs(found / smooth - 1.0) < 1e-6
    yield Claim(
        "Section 4.3, optimum",
        f"A genetic algorithm with {study.population} designs and {study.generations} generations lowers the sum of "
        f"compliances to {printed.OPTIMISED_SUM}.",
        f"Ours finds {found:.9g} in {genetic.log.count:,} evaluations, a gradient search from {study.starts} starts "
        f"{smooth:.9g} in {gradient.log.count:,}.",
        Finding.HOLDS if agree and found <= target else Finding.FAILS,
        f"The printed design is {target / smooth - 1.0:.0e} above the minimum. {ridges}",
    )
    best, mean = (np.array([step[key] for step in genetic.log.steps]) for key in ("best", "mean"))
    away = [float(values[AT_REST - 1] / best[-1] - 1.0) for values in (best, mean)]
    first = int(np.argmax(mean / best[-1] - 1.0 < CONVERGED)) + 1
    yield Claim(
        "Section 4.3, Fig. 6",
        f"After around {AT_REST} generations the best design and the mean of the population have converged.",
        f"At generation {AT_REST} the best is {away[0]:.0e} and the mean {away[1]:.0e} above the last best; the mean "
        f"comes within {CONVERGED:.0e} at generation {first}.",
        Finding.HOLDS if max(away) < CONVERGED else Finding.FAILS,
    )
