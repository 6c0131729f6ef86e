"""Conditions on quantities: read with their units, refused with the way out."""

import math

import numpy as np
import pytest

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.studies.quantities import parse_condition
from refusals import refused

READ = [
    ("stiffness_z > 20 N/um", "stiffness_z", ">", 2e7),
    ("stiffness_z>=20N/um", "stiffness_z", ">=", 2e7),
    ("  compliance_z <1e-8 m/N ", "compliance_z", "<", 1e-8),
    ("compliance_rx <= 1e-3 mrad/(N*m)", "compliance_rx", "<=", 1e-6),
    ("free_stiffness_z > 50 N/um", "free_stiffness_z", ">", 5e7),
    ("free_stiffness_rz > 1e4 N*m/rad", "free_stiffness_rz", ">", 1e4),
    ("compliance_rx < 1 deg/(kN·m)", "compliance_rx", "<", math.radians(1) / 1e3),
    ("compliance_rx_z < 2e-6 rad/N", "compliance_rx_z", "<", 2e-6),
    ("stiffness_rz > 1e4 N*m/rad", "stiffness_rz", ">", 1e4),
    ("stiffness_rz_x > 5 kN/rad", "stiffness_rz_x", ">", 5e3),
    ("stiffness_x > 3e6", "stiffness_x", ">", 3e6),
    ("singularity_margin > 0.05", "singularity_margin", ">", 0.05),
]


@pytest.mark.parametrize(("text", "quantity", "comparison", "value"), READ)
def test_conditions_are_read_in_their_units(text, quantity, comparison, value):
    found = parse_condition(text, COMPONENTS)
    assert (found.quantity, found.comparison) == (quantity, comparison)
    assert found.value == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("quantity", [q for q in QUANTITIES.values() if q.unit != "1"], ids=lambda q: q.name)
def test_every_quantity_is_compared_in_its_unit(quantity):
    assert parse_condition(f"{quantity.name} > 3 {quantity.unit}", COMPONENTS).value == pytest.approx(3.0)


REFUSED = [
    ("stiffness_z", ["is not a condition", "free_stiffness_z > 20 N/um"]),
    ("stiffness_z = 3 N/m", ["is not a condition"]),
    ("1 < singularity_margin < 2", ["is not a condition"]),
    ("3 N/m < stiffness_z", ["is not a condition"]),
    ("stiffness > 3 N/m", ["stands for several", "stiffness_rx"]),
    ("free_stiffness > 3 N/m", ["stands for several", "free_stiffness_rx"]),
    ("stiffnes_z > 3 N/m", ['"stiffnes_z" is not a quantity']),
    ("stiffness_z > 3 m", ["stiffness_z", '"m" is not a unit of linear stiffness', "20 N/um"]),
    ("stiffness_z > rigid", ["stiffness_z", "large value"]),
    ("compliance_x < 3 N", ["compliance_x", "1e-8 m/N"]),
    ("singularity_margin > 3 m", ["singularity_margin", "a plain number"]),
    ("stiffness_z > " + "9" * 300, ["is not a condition"]),
    ("stiffness_z > \x1b[31m", ["stiffness_z"]),
    ("", ["is not a condition"]),
]


@pytest.mark.parametrize(("text", "words"), REFUSED)
def test_what_is_no_condition_is_refused_with_the_way_out(text, words):
    with refused() as caught:
        parse_condition(text, COMPONENTS)
    message = str(caught.value)
    assert message.isprintable()
    for word in words:
        assert word in message


def test_a_planar_machine_has_no_other_components():
    with refused("is not a quantity"):
        parse_condition("stiffness_z > 1 N/m", ("rz", "x", "y"))


def test_what_has_no_value_meets_nothing():
    values = np.array([1.0, 3.0, math.inf, math.nan])
    assert parse_condition("singularity_margin > 2", COMPONENTS).holds(values).tolist() == [False, True, True, False]
    assert parse_condition("singularity_margin <= 3", COMPONENTS).holds(values).tolist() == [True, True, False, False]
