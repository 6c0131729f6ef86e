"""Sums of weighted dyads with infinite weights: what becomes infinite, and what is but rounding."""

import math

import numpy as np
import pytest

from kinetostat.algebra.screw import Twist
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.kinetostatics.assembly import weighted_sum
from numeric import array

PLAIN = Twist(Vector(1.0, 2.0, 0.0), Vector(0.0, 3.0, 0.5))


def test_finite_weights_give_the_weighted_sum():
    other = Twist(Vector(0.0, 1.0, 1.0), ZERO)
    expected = 2.0 * outer(PLAIN) + 7.0 * outer(other)
    assert np.array_equal(array(weighted_sum([(PLAIN, 2.0), (other, 7.0)], 1.0)), expected)


def outer(screw):
    return np.outer(screw.components(), screw.components())


def test_an_infinite_weight_reaches_what_its_screw_has():
    found = array(weighted_sum([(Twist(Vector(1.0, 0.0, -1.0), ZERO), math.inf), (PLAIN, 2.0)], 1.0))
    reached = np.zeros((6, 6), dtype=bool)
    reached[np.ix_([0, 2], [0, 2])] = True
    assert np.array_equal(np.isinf(found), reached)
    assert np.array_equal(found[~reached], (2.0 * outer(PLAIN))[~reached])


@pytest.mark.parametrize("length", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(
    ("share", "infinite"), [(1e-4, True), (1e-8, True), (1e-10, False), (1e-15, False), (0.0, False)]
)
def test_a_small_component_counts_and_rounding_does_not(share, infinite, length):
    """Compared through the length, so that the unit of it does not matter."""
    screws = [Twist(Vector(1.0, share, 0.0), ZERO), Twist(ZERO, Vector(1.0 / length, share / length, 0.0))]
    for component, screw in zip((1, 4), screws, strict=True):
        assert math.isinf(weighted_sum([(screw, math.inf)], length).entry(component, component)) == infinite


def test_infinite_weights_of_several_springs_add_up():
    screws = [Twist(Vector(1.0, 0.0, 0.0), ZERO), Twist(ZERO, Vector(0.0, 0.0, 2.0))]
    found = weighted_sum([(screw, math.inf) for screw in screws], 1.0).diagonal()
    assert [math.isinf(entry) for entry in found] == [True, False, False, False, False, True]
