"""The whole paper in one call: numbers, equations, statements and the data of figures 4 and 5."""

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from typing import Any

import xarray as xr

from kinetostat.engine.batch import Progress, silent
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine
from kinetostat.studies.grid import evaluate_grid
from kinetostat.studies.paper import printed
from kinetostat.studies.paper.claims import Claim, Finding, claims
from kinetostat.studies.paper.comparison import Comparison, Verdict
from kinetostat.studies.paper.derivation import Check, derivation
from kinetostat.studies.paper.tables import equations_33_38, section_4_3, table_3, table_4

SECTION = ("pose.x=-2 cm:2 cm:81", "geometry.passive_leg_offset=-2 cm:2 cm:81")
"""Fig. 5: x and y of the platform; y is no motion of the machine but a shift of its passive leg."""
LINK_STIFFNESS = ("stiffness.passive_links=1e3 N*m/rad:1e10 N*m/rad:71:log",)
"""Fig. 4: 1 to 1e7 times the actuator stiffness."""


@dataclass(frozen=True)
class Reproduction:
    """Everything the paper says, beside what this program finds.

    Attributes:
        machine: the paper's machine at its reference pose.
        comparisons: every printed number.
        checks: the equations of the derivation.
        claims: guidelines and further facts.
        curves, maps: the data of Fig. 4 and of Fig. 5.
    """

    machine: Machine
    comparisons: tuple[Comparison, ...]
    checks: tuple[Check, ...]
    claims: tuple[Claim, ...]
    curves: xr.Dataset
    maps: xr.Dataset

    @property
    def explained(self) -> bool:
        """Whether nothing differs without an explanation."""
        return (
            all(one.verdict is not Verdict.DIFFERS for one in self.comparisons)
            and all(check.holds for check in self.checks)
            and all(claim.finding is not Finding.FAILS for claim in self.claims)
        )

    def as_json(self) -> dict[str, Any]:
        """Numbers, equations and statements as plain data."""
        return {
            "paper": "Zhang and Gosselin, Parallel kinematic machine design with kinetostatic model, 2002",
            "explained": self.explained,
            "comparisons": [asdict(one) for one in self.comparisons],
            "equations": [asdict(check) | {"holds": check.holds} for check in self.checks],
            "statements": [asdict(claim) for claim in self.claims],
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
        progress(len(found), len(parts) + 2)
    curves = evaluate_grid(machine, LINK_STIFFNESS, ["stiffness"])
    progress(len(parts) + 1, len(parts) + 2)
    maps = evaluate_grid(machine, SECTION, ["compliance"])
    progress(len(parts) + 2, len(parts) + 2)
    numbers = found["table_3"] + found["table_4"] + found["equations"] + found["designs"]
    return Reproduction(machine, numbers, found["checks"], found["claims"], curves, maps)
