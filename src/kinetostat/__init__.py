"""kinetostat: how stiff a parallel kinematic machine is, where it is weak, why, and how to make it better.

    from kinetostat import analyze, load
    found = analyze(load("zhang-gosselin-4dof", ["pose.x=5 mm"]))

Names load their modules when first used, so that importing the package costs nothing.
"""

from importlib import import_module
from typing import Any

_HOMES = {
    "load": "kinetostat.machine.loading",
    "bundled": "kinetostat.machine.loading",
    "analyze": "kinetostat.studies.analysis",
    "evaluate_grid": "kinetostat.studies.grid.grid",
    "load_problem": "kinetostat.studies.optimisation.problem",
    "optimize": "kinetostat.studies.optimisation.result",
    "reproduce": "kinetostat.studies.paper.reproduction",
    "InputError": "kinetostat.spec.errors",
}

__all__ = ["InputError", "analyze", "bundled", "evaluate_grid", "load", "load_problem", "optimize", "reproduce"]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"kinetostat has no {name!r}; it has {', '.join(__all__)}")


def __dir__() -> list[str]:
    return __all__
