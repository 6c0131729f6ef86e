"""What is but rounding beside the rest of a result is 0, in tables as in data; what is small but true stays."""

import pytest

from kinetostat.algebra.screw import Wrench
from kinetostat.algebra.vector import Vector
from kinetostat.machine.loading import bundled, load
from kinetostat.studies.analysis import analyze
from kinetostat.studies.cleaning import clean_matrix, clean_screw
from kinetostat.validation.comparison import validate
from kinetostat.views.answers import plain_of
from machines import load_without_limits

TRUE = 1e-10
"""Share below which no number of these machines is anything but rounding."""


def numbers(data):
    """All numbers of nested lists."""
    return [c for part in data for c in numbers(part)] if isinstance(data, list | tuple) else [data]


def noise(data):
    """Numbers that are but rounding beside the largest."""
    found = [abs(c) for c in numbers(data) if c is not None]
    return [c for c in found if 0.0 < c < TRUE * max(found)]


@pytest.mark.parametrize("name", bundled())
@pytest.mark.parametrize("axes", ["base", "platform"])
def test_no_rounding_is_left_in_what_a_load_does(name, axes):
    told = plain_of(analyze(load_without_limits(name, ["load.force=[0, 0, -500]"]), axes))
    for matrix in (told["stiffness"], told["compliance"]):
        assert not noise(matrix or [])
    assert not noise(told["load"]["wrench"])
    assert not noise(told["load"]["deflection"])
    assert not noise([reaction["wrench"] for reaction in told["load"]["reactions"]])


def test_both_compliances_of_a_validation_are_without_rounding():
    found = validate(load("hexapod"), "pynite")
    assert not noise(found.ours.tolist())
    assert not noise(found.theirs.tolist())
    assert (found.ours != 0.0).sum() == 18 - 8


def test_what_is_small_stays():
    assert clean_matrix([[1.0, 1e-11], [1e-11, 1.0]]) == [[1.0, 1e-11], [1e-11, 1.0]]
    assert clean_matrix([[1e-18, 1e-18], [1e-18, 1.0]]) == [[1e-18, 1e-18], [1e-18, 1.0]]
    assert clean_matrix([[1.0, 1e-13], [1e-13, 1.0]]) == [[1.0, 0.0], [0.0, 1.0]]


def test_lengths_make_moments_and_forces_comparable():
    wrench = Wrench(Vector(1e-11, 1.0, 0.0), Vector(1e-11, 0.0, 0.0))
    assert clean_screw(wrench, 1.0) == wrench
    assert clean_screw(wrench, 1e-3).translational == Vector(0.0, 0.0, 0.0)
    assert clean_screw(wrench, 1.0, 100.0).components() == (0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
