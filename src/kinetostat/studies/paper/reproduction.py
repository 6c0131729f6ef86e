"""The whole paper in one call: numbers, equations, statements, its optimisation and the data of its figures."""

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from typing import Any

import xarray as xr

from kinetostat.engine.batch import Progress, silent
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine
from kinetostat.studies.grid.grid import evaluate_grid
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.paper import printed
from kinetostat.studies.paper.claims import Claim, Finding, claims
from kinetostat.studies.paper.comparison import Comparison, Verdict
from kinetostat.studies.paper.derivation import Check, derivation
from kinetostat.studies.paper.optimisation import search_again
from kinetostat.studies.paper.tables import equations_33_38, section_4_3, table_3, table_4

SECTION = ("pose.x=-2 cm:2 cm:81", "geometry.passive_leg_offset=-2 cm:2 cm:81")
"""Fig. 5: x and y of the platform; y is no motion of the machine but a shift of its passive leg."""
LINK_STIFFNESS = ("stiffness.passive_links=1e3 N*m/rad:1e10 N*m/rad:71:log",)
"""Fig. 4: 1 to 1e7 times the actuator stiffness."""

STAGES = 3
"""Figures and search, beside the parts."""


@dataclass(frozen=True)
class Reproduction:
    """Everything the paper says, beside what this program finds.

    Attributes:
        machine: the paper's machine at its reference pose.
        comparisons: every printed number.
        checks: the equations of the derivation.
        claims: guidelines and further facts.
        curves, maps: the data of Fig. 4 and of Fig. 5.
        search: the optimisation of section 4.3, run again, with the data of Fig. 6.
        search_claims: what the paper says of it.
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
        """Whether nothing differs without an explanation."""
        return (
            all(one.verdict is not Verdict.DIFFERS for one in self.comparisons)
            and all(check.holds for check in self.checks)
            and all(claim.finding is not Finding.FAILS for claim in (*self.claims, *self.search_claims))
        )

    def as_json(self) -> dict[str, Any]:
        """Numbers, equations and statements as plain data."""
        return {
            "paper": printed.CITATION,
            "explained": self.explained,
            "comparisons": [asdict(one) for one in self.comparisons],
            "equations": [asdict(check) | {"holds": check.holds} for check in self.checks],
            "statements": [asdict(claim) for claim in self.claims],
            "optimisation": [asdict(claim) for claim in self.search_claims],
            "typography": list(printed.TYPOGRAPHY),
        }


def reproduce(progress: Progress = silent) -> Reproduction:
    """Compute everything; `progress` is told after each part."""
    machine = load(printed.MACHINE)
    parts: dict[str, Callable[[], Iterable[Any]]] = {
        "table_3": table_3,
        "table_4": table_4,
        "equations": equations_33_38,
        "designs": section_4_3,
        "checks": derivation,
        "claims": claims,
    }
    found: dict[str, tuple[Any, ...]] = {}
    for name, part in parts.items():
        found[name] = tuple(part())
        progress(len(found), len(parts) + STAGES)
    curves = evaluate_grid(machine, LINK_STIFFNESS, ["stiffness"])
    progress(len(parts) + 1, len(parts) + STAGES)
    maps = evaluate_grid(machine, SECTION, ["compliance"])
    progress(len(parts) + 2, len(parts) + STAGES)
    search, search_claims = search_again()
    progress(len(parts) + 3, len(parts) + STAGES)
    numbers = found["table_3"] + found["table_4"] + found["equations"] + found["designs"]
    return Reproduction(machine, numbers, found["checks"], found["claims"], curves, maps, search, search_claims)
