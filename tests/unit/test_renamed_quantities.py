"""Former names of quantities still work, and warn."""

import warnings

import numpy as np
import pytest

from kinetostat import load
from kinetostat.kinetostatics.response import respond
from kinetostat.studies.optimisation.result import ComplianceChange, Result
from kinetostat.studies.quantities import parse_condition, resolve_quantities

COMPONENTS = ("rx", "ry", "rz", "x", "y", "z")


@pytest.mark.parametrize(("old", "new"), [("regularity", "singularity_margin"), ("side", "aspect")])
def test_a_former_name_of_a_quantity_still_works_and_warns(old, new):
    with pytest.warns(DeprecationWarning, match=new):
        assert resolve_quantities([old]) == [new]
    with pytest.warns(DeprecationWarning, match=new):
        assert parse_condition(f"{old} > 0.5", COMPONENTS).quantity == new


def test_the_warning_of_a_former_name_points_to_the_line_that_uses_it():
    with pytest.warns(DeprecationWarning, match="singularity_margin") as of_a_list:
        resolve_quantities(["regularity"])
    with pytest.warns(DeprecationWarning, match="aspect") as of_a_condition:
        parse_condition("side > 0.5", COMPONENTS)
    assert [warning.filename for warning in (*of_a_list, *of_a_condition)] == [__file__, __file__]


def test_the_former_attribute_of_a_response_still_works_and_warns():
    response = respond(load("hexapod"))
    with pytest.warns(DeprecationWarning, match="singularity_margin"):
        assert response.regularity == response.singularity_margin


def test_the_former_attribute_of_a_search_s_result_still_works_and_warns():
    change = ComplianceChange("compliance_x", "m/N", 2.0, 1.0)
    result = Result(None, None, None, np.array([0]), 0, compliance_changes=(change,))
    with pytest.warns(DeprecationWarning, match="compliance_changes"):
        assert result.directions == (change,)


def test_todays_names_do_not_warn():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert resolve_quantities(["singularity_margin", "aspect"]) == ["singularity_margin", "aspect"]
