"""What is typed into a field of the studio: units, arithmetic, and what is refused."""

import math

import pytest

from kinetostat.studio.wording import typed_value
from kinetostat.units import UnitError


@pytest.mark.parametrize(
    ("typed", "value"),
    [
        ("20", 0.02),
        ("20 cm", 0.2),
        ("10+5 mm", 0.015),
        ("10+5 cm", 0.15),
        ("1 m + 5", 1.005),
        ("12 cm - 2*5 mm", 0.11),
        ("2*(3+4)", 0.014),
        ("(10+5) cm", 0.15),
        ("1/2 m", 0.5),
        ("10 mm/4", 0.0025),
        ("-(2 - 5)", 0.003),
        (" -1e1 ", -0.01),
    ],
)
def test_numbers_are_in_the_unit_shown_unless_they_have_their_own(typed, value):
    assert typed_value(typed, "length", "mm") == pytest.approx(value, rel=1e-15)


def test_units_of_several_names_are_not_taken_for_arithmetic():
    assert typed_value("2*20 N/um", "linear stiffness", "") == 4e7
    assert typed_value("1e7 N*m/rad/2", "torsional stiffness", "") == 5e6
    assert typed_value("rigid", "linear stiffness", "N/m") == math.inf


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        ("10 mm * 5 mm", "gives no length"),
        ("5/0", "divides by zero"),
        ("10+", "bare number in mm"),
        ("10 + 5 parsnips", '"parsnips" is unknown'),
        ("2 mm mm", '"mm mm" is not a unit'),
        ("(((((", "it must be a length"),
        ("__import__('os')", "it must be a length"),
        ("9*" * 40 + "9", "it must be a length"),
        ("1e400", "it must be a length"),
        ("", "it must be a length"),
    ],
)
def test_what_is_not_arithmetic_with_lengths_is_refused(typed, message):
    with pytest.raises(UnitError, match=message.replace("(", r"\(")):
        typed_value(typed, "length", "mm")


def test_where_no_unit_is_shown_one_must_be_written():
    with pytest.raises(UnitError, match="the field shows none"):
        typed_value("20", "linear stiffness", "")
    assert typed_value("0", "linear stiffness", "") == 0.0
