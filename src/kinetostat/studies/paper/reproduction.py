"""Reproduce the whole paper in one call: numbers, equations, statements, the optimisation and the data of the figures.

Each kind of result is computed in a file of its own beside this one; only the optimisation is judged here.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import xarray as xr

from kinetostat.engine.batch import Progress, silent
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine
from kinetostat.spec.arguments import checked
from kinetostat.spec.immutable import Immutable
from kinetostat.studies.grid.grid import evaluate_grid
from kinetostat.studies.optimisation.problem import load_problem
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.optimisation.ridges import ridge_sentences
from kinetostat.studies.optimisation.search import optimize
from kinetostat.studies.paper import printed
from kinetostat.studies.paper.claims import Claim, Finding, claims
from kinetostat.studies.paper.comparison import Comparison, Verdict, equations_33_38, section_4_3, table_3, table_4
from kinetostat.studies.paper.derivation import Check, derivation

SECTION = ("pose.x=-2 cm:2 cm:81", "geometry.passive_leg_offset=-2 cm:2 cm:81")
"""Fig. 5: x and y of the platform; y is not a motion of the machine but a shift of its passive leg."""
LINK_STIFFNESS = ("stiffness.passive_links=1e3 N*m/rad:1e10 N*m/rad:71:log",)
"""Fig. 4: 1 to 1e7 times the actuator stiffness."""

STAGES = 3
"""Steps of progress after the parts: the data of Fig. 4, that of Fig. 5, and the optimisation."""
STUDY = "zhang-gosselin-2002"
"""Name of the bundled study with the optimisation of section 4.3."""
AT_REST = 60
"""Generation by which, according to the paper, the population has converged."""
CONVERGED = 1e-4
"""Distance of the population's mean from the final optimum, relative to it, that cannot be seen in Fig. 6."""


@dataclass(frozen=True, eq=False)
class Reproduction(Immutable):
    """The statements of the paper, each compared with the result of this program.

    Attributes:
        machine: the paper's machine at its reference pose.
        comparisons: every printed number.
        checks: the equations of the derivation.
        claims: guidelines and further facts.
        curves, maps: the data of Fig. 4 and of Fig. 5.
        search: the optimisation of section 4.3, run again, with the data of Fig. 6.
        search_claims: statements of the paper about the optimisation, tested.
    """

    machine: Machine
    comparisons: tuple[Comparison, ...]
    checks: tuple[Check, ...]
    claims: tuple[Claim, ...]
    curves: xr.Dataset
    maps: xr.Dataset
    search: Result
    search_claims: tuple[Claim, ...]

    def __repr__(self) -> str:
        return f"<Reproduction: {len(self.comparisons)} numbers, {'explained' if self.explained else 'NOT explained'}>"

    @property
    def explained(self) -> bool:
        """Whether every difference from the paper has an explanation."""
        return (
            all(comparison.verdict is not Verdict.DIFFERS for comparison in self.comparisons)
            and all(check.holds for check in self.checks)
            and all(claim.finding is not Finding.FAILS for claim in (*self.claims, *self.search_claims))
        )

    def as_json(self) -> dict[str, Any]:
        """Numbers, equations and statements as plain data."""
        return {
            "paper": printed.CITATION,
            "explained": self.explained,
            "comparisons": [asdict(comparison) for comparison in self.comparisons],
            "equations": [asdict(check) | {"holds": check.holds} for check in self.checks],
            "statements": [asdict(claim) for claim in self.claims],
            "optimisation": [asdict(claim) for claim in self.search_claims],
            "typography": list(printed.TYPOGRAPHY),
        }


@checked
def reproduce(progress: Progress = silent) -> Reproduction:
    """Reproduce the whole paper; `progress` gets the number of steps done and of all steps, after each."""
    machine = load(printed.MACHINE)
    parts: dict[str, Callable[[], Iterable[Any]]] = {
        "table_3": table_3,
        "table_4": table_4,
        "equations": equations_33_38,
        "designs": section_4_3,
        "checks": derivation,
        "claims": claims,
    }
    results: dict[str, tuple[Any, ...]] = {}
    for name, part in parts.items():
        results[name] = tuple(part())
        progress(len(results), len(parts) + STAGES)
    curves = evaluate_grid(machine, LINK_STIFFNESS, ["stiffness"])
    progress(len(parts) + 1, len(parts) + STAGES)
    maps = evaluate_grid(machine, SECTION, ["compliance"])
    progress(len(parts) + 2, len(parts) + STAGES)
    search, search_claims = search_again()
    progress(len(parts) + 3, len(parts) + STAGES)
    numbers = results["table_3"] + results["table_4"] + results["equations"] + results["designs"]
    return Reproduction(machine, numbers, results["checks"], results["claims"], curves, maps, search, search_claims)


def search_again() -> tuple[Result, tuple[Claim, ...]]:
    """Repeat the optimisation of the paper by a genetic algorithm, and test what the paper states about it.

    A gradient search, which converges far more exactly, shows how close the genetic algorithm comes to the minimum.
    """
    genetic = optimize(load_problem(STUDY))
    gradient = optimize(load_problem(STUDY, ["optimizer.method=gradient"]))
    return genetic, (*_statements(genetic, gradient),)


def _statements(genetic: Result, gradient: Result) -> Iterator[Claim]:
    """Test the statements about the optimum and about convergence (Fig. 6)."""
    reached, reached_by_gradient = (float(search.outcome.objectives[0, 0]) for search in (genetic, gradient))
    target, study = float(printed.OPTIMISED_SUM), genetic.problem.study.optimizer
    ridges = " ".join(ridge_sentences(genetic.ridges, genetic.problem))
    agree = abs(reached / reached_by_gradient - 1.0) < 1e-6
    yield Claim(
        "Section 4.3, optimum",
        f"A genetic algorithm with {study.population} designs and {study.generations} generations lowers the sum of "
        f"compliances to {printed.OPTIMISED_SUM}.",
        f"Our genetic algorithm finds {reached:.9g} in {genetic.log.count:,} evaluations; a gradient search from "
        f"{study.starts} starts finds {reached_by_gradient:.9g} in {gradient.log.count:,}.",
        Finding.HOLDS if agree and reached <= target else Finding.FAILS,
        f"The printed design is {target / reached_by_gradient - 1.0:.0e} above the minimum. {ridges}",
    )
    best, mean = (np.array([step[key] for step in genetic.log.steps]) for key in ("best", "mean"))
    # Generations are counted from 1, and the last best design is the end to which all is compared.
    above = [float(values[AT_REST - 1] / best[-1] - 1.0) for values in (best, mean)]
    first = int(np.argmax(mean / best[-1] - 1.0 < CONVERGED)) + 1
    yield Claim(
        "Section 4.3, Fig. 6",
        f"After around {AT_REST} generations the best design and the mean of the population have converged.",
        f"At generation {AT_REST} the best is {above[0]:.0e} and the mean {above[1]:.0e} above the last best; the mean "
        f"comes within {CONVERGED:.0e} at generation {first}.",
        Finding.HOLDS if max(above) < CONVERGED else Finding.FAILS,
    )
