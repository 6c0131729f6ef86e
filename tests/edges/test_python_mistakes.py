"""Mistakes of Python users: each is told as what it is, not as what it led to; one text may stand for a list of it."""

import pytest

from kinetostat import (
    analyze,
    changed,
    compare,
    evaluate_grid,
    guidelines,
    load,
    sensitivity,
    validate,
    workspace,
)
from kinetostat.studies.analysis import Analysis
from refusals import refused

HEXAPOD = load("hexapod")


def test_one_setting_is_a_list_of_one():
    assert load("hexapod", "pose.z=0.14") == load("hexapod", ["pose.z=0.14"])


def test_one_range_and_one_quantity_are_lists_of_one():
    one = evaluate_grid(HEXAPOD, "x=-1 cm:1 cm:3", "stiffness_z")
    assert one.identical(evaluate_grid(HEXAPOD, ["x=-1 cm:1 cm:3"], ["stiffness_z"]))
    assert guidelines(HEXAPOD, "x=-1 cm:1 cm:3").ranges == ("x=-1 cm:1 cm:3",)
    assert compare([HEXAPOD, HEXAPOD], "x=-1 cm:1 cm:3").ranges == ("x=-1 cm:1 cm:3",)
    assert sensitivity(HEXAPOD, "stiffness_z").quantities == ("stiffness_z",)
    assert workspace(HEXAPOD, ["x=-1 cm:1 cm:3", "y=-1 cm:1 cm:3"], "stiffness_z > 1 N/um").exists


@pytest.mark.parametrize(
    "ask",
    [
        analyze,
        sensitivity,
        guidelines,
        validate,
        lambda given: evaluate_grid(given, ["x=-1 cm:1 cm:3"]),
        lambda given: workspace(given, ["x=-1 cm:1 cm:3", "y=-1 cm:1 cm:3"]),
        lambda given: changed(given, {"pose.z": 1.0}),
    ],
)
def test_a_name_is_no_machine(ask):
    with refused(r'machine is "hexapod"; give a machine, as load\(\.\.\.\)'):
        ask("hexapod")


def test_one_design_is_nothing_to_compare():
    with refused(r"takes 2 to .* designs, not 1"):
        compare("hexapod")


def test_a_list_is_no_value_of_one_field():
    with refused(r"^z is \[1, 2\]; give one value"):
        changed(HEXAPOD, {"pose.z": [1, 2]})


def test_a_pose_without_an_answer_has_no_stiffness_along_anything():
    found = analyze(load("delta", ["pose.z=-30 m"]))
    assert isinstance(found, Analysis)
    with refused(r"no stiffness along any direction here. .*at most"):
        found.along([0, 0, 1])
