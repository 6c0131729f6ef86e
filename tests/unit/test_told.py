"""Sentences about numbers that may be one or many, less or more than one."""

import pytest

from kinetostat.views.optimisation import times_stiffer
from kinetostat.views.paper import in_number


@pytest.mark.parametrize(
    ("gain", "said"),
    [(2.0, "2 times stiffer"), (0.25, "4 times softer"), (1.0, "1 times stiffer"), (float("nan"), "–")],
)
def test_a_softer_direction_is_called_that(gain, said):
    assert times_stiffer(gain) == said


@pytest.mark.parametrize(
    ("finding", "count", "said"),
    [("holds", 1, "holds"), ("holds", 7, "hold"), ("holds with limits", 5, "hold with limits"), ("fails", 2, "fail")],
)
def test_one_statement_holds_and_many_hold(finding, count, said):
    assert in_number(finding, count) == said
