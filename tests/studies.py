"""Problems for tests: bundled studies with overrides, studies written as text, and waiting for a search at work."""

from watchfiles import watch

from kinetostat.spec import document as documents
from kinetostat.spec.study import read_study
from kinetostat.studies.optimisation.assessment import Assessor
from kinetostat.studies.optimisation.problem import build_problem, load_problem
from kinetostat.studies.optimisation.search import search

PAPER = "zhang-gosselin-2002"
BEST = 1.01788945
"""The least sum of compliances in the paper's box, from an implementation independent of this project."""
FEW = ("poses.over=['x=-2 cm:2 cm:5', 'theta5=-65 deg:-55 deg:5']",)

SMALL = """
schema = 1
name = "small"
machine = "zhang-gosselin-4dof"
[[variables]]
path = "platform_radius"
from = "10 cm"
to = "14 cm"
[[variables]]
path = "base_radius"
from = "20 cm"
to = "26 cm"
[[objectives]]
quantity = "compliance_sum"
"""


LOOK = 100
"""Milliseconds after which to look although nothing has changed: a process that is killed writes nothing."""


def waited_for(look, folder):
    """What a look at a search shows, once it shows anything; there is something new where its folder changes.

    A search gives way to every other process: a test that looked all the time would take the processor that it needs.
    """
    changes = watch(folder, yield_on_timeout=True, rust_timeout=LOOK)
    while not (seen := look()):
        next(changes)
    return seen


def problem(name=PAPER, *settings):
    return load_problem(name, settings)


def written(text, *settings):
    return build_problem(read_study(documents.parse(text, "test.toml"), "test.toml", settings))


def solved(name=PAPER, *settings):
    """The log of a search."""
    return search(Assessor(problem(name, *settings)))


def best(log):
    """Objective of the best design of a search with one."""
    return float(log.outcome(log.survivors[:1]).objectives[0, 0])
