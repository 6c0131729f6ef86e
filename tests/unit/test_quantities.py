"""Quantities know which way is better; an objective of which neither way is must say so itself."""

import pytest

from kinetostat.machine.loading import load
from kinetostat.spec.study import ObjectiveTable
from kinetostat.studies.optimisation import problem
from kinetostat.studies.optimisation.terms import usual_goal
from refusals import refused


@pytest.mark.parametrize(
    ("name", "goal"),
    [
        ("compliance_z", "minimize"),
        ("stiffness_z", "maximize"),
        ("free_stiffness_z", "maximize"),
        ("singularity_margin", "maximize"),
        ("frobenius_condition", "minimize"),
        ("workspace_volume", "maximize"),
        ("stiffness_along", "maximize"),
        ("stiffness_x_z", None),
        ("shortest_leg", None),
    ],
)
def test_the_usual_goal_is_what_is_better_for_a_design(name, goal):
    assert usual_goal(name) == goal


def test_an_objective_that_is_better_neither_way_needs_a_goal():
    with refused(r"objectives\.0: neither a larger nor a smaller stiffness_x_z .*add goal"):
        problem._objective(load("delta"), ObjectiveTable(quantity="stiffness_x_z"), None, "objectives.0")
