"""kinetostat: how stiff a parallel kinematic machine is, where it is weak, why, and how to make it better.

    from kinetostat import analyze, load
    analysis = analyze(load("zhang-gosselin-4dof", ["pose.x=5 mm"]))

Names load their modules when first used, so that importing the package costs nothing; their types in `__init__.pyi`.
"""

import sys
from importlib import import_module
from time import time

STARTED = time()
"""The time at which the package was first imported: sources that were changed later are not those that run."""

_HOMES = {
    "load": "kinetostat.machine.loading",
    "build": "kinetostat.machine.loading",
    "bundled": "kinetostat.machine.loading",
    "changed": "kinetostat.machine.loading",
    "analyze": "kinetostat.studies.analysis",
    "forward": "kinetostat.studies.assembly_modes",
    "under_load": "kinetostat.studies.under_load",
    "capability": "kinetostat.studies.capability",
    "modes": "kinetostat.studies.vibration",
    "drives": "kinetostat.studies.drives",
    "dynamics": "kinetostat.studies.dynamics",
    "servo": "kinetostat.studies.control",
    "motors": "kinetostat.studies.motors",
    "elevation": "kinetostat.studies.elevation",
    "lobes": "kinetostat.studies.lobes",
    "state_of": "kinetostat.equilibrium.state",
    "state_space": "kinetostat.studies.control",
    "carrying_legs": "kinetostat.studies.tensions",
    "command": "kinetostat.studies.commanding",
    "correction_table": "kinetostat.studies.corrections",
    "compile": "kinetostat.studies.evaluation",
    "evaluate": "kinetostat.studies.datasets",
    "evaluate_grid": "kinetostat.studies.datasets",
    "workspace": "kinetostat.studies.workspace",
    "sensitivity": "kinetostat.studies.sensitivity",
    "guidelines": "kinetostat.studies.guidelines",
    "budget": "kinetostat.studies.budget",
    "identify": "kinetostat.studies.identification.identification",
    "compare": "kinetostat.studies.comparison",
    "load_problem": "kinetostat.studies.optimisation.problem",
    "optimize": "kinetostat.studies.optimisation.search",
    "validate": "kinetostat.validation.comparison",
    "validate_measured": "kinetostat.studies.measured_stiffness",
    "reproduce": "kinetostat.studies.reproduction",
    "machine_picture": "kinetostat.views.picture",
    "plot": "kinetostat.views.answers",
    "save": "kinetostat.views.answers",
    "register": "kinetostat.machine.catalogue",
    "requirements": "kinetostat.studies.requirements",
    "report": "kinetostat.views.report.writing",
    "export": "kinetostat.exchange.formats",
    "Machine": "kinetostat.machine.machine",
    "Status": "kinetostat.kinematics.status",
    "InputError": "kinetostat.spec.errors",
}
__all__ = [
    "InputError", "Machine", "Status", "analyze", "budget", "build", "bundled", "capability", "carrying_legs",
    "changed", "command", "compare", "compile", "correction_table", "drives", "dynamics", "elevation", "evaluate",
    "evaluate_grid", "export", "forward", "guidelines", "identify", "load", "load_problem", "lobes",
    "machine_picture", "modes", "motors", "optimize", "plot", "register", "report", "reproduce", "requirements",
    "save", "sensitivity", "servo", "state_of", "state_space", "tensions", "under_load", "validate",
    "validate_measured", "workspace",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    questions = import_module("kinetostat.views.questions").QUESTIONS
    if name in questions:
        return import_module("kinetostat.views.question").late(questions[name][1]).answer
    raise AttributeError(f"kinetostat has no {name!r}; it has {', '.join(__all__)}")


def __dir__() -> list[str]:
    return __all__


def load_ipython_extension(shell: object) -> None:
    """Let IPython show machines, answers and figures as tables and pictures; in a notebook, importing does it."""
    formatters = shell.display_formatter.formatters
    described = import_module("kinetostat.views.questions").ANSWERS
    for place in ("machine.machine.Machine", *described):
        # IPython gets names only, so that nothing is imported.
        module, _, name = f"kinetostat.{place}".rpartition(".")
        formatters["text/html"].for_type_by_name(module, name, lambda answer: _notebook().html_of(answer))
    formatters["image/png"].for_type_by_name("matplotlib.figure", "Figure", lambda figure: _notebook().png_of(figure))


def _notebook() -> object:
    return import_module("kinetostat.views.notebook")


if "IPython" in sys.modules and (_shell := sys.modules["IPython"].get_ipython()) is not None:
    load_ipython_extension(_shell)
