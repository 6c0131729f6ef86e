"""Symmetric 6x6 matrices held as 21 scalars."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from geometry import vectors
from kinetostat.algebra.screw import Twist
from kinetostat.algebra.symmetric import POSITIONS, Symmetric6
from numeric import array, screw

twists = st.builds(Twist, vectors(), vectors())
NUMBERED = Symmetric6(tuple(float(k) for k in range(21)))


def test_the_upper_triangle_is_stored_row_by_row():
    assert POSITIONS[:7] == [(0, 0), (0, 1), (0, 2), (0, 3), (0, 4), (0, 5), (1, 1)]
    full = np.array(NUMBERED.rows())
    assert np.array_equal(full[np.triu_indices(6)], np.arange(21.0))
    assert np.array_equal(full, full.T)


def test_entries_are_the_same_from_both_sides():
    full = NUMBERED.rows()
    assert all(NUMBERED.entry(i, j) == NUMBERED.entry(j, i) == full[i][j] for i in range(6) for j in range(6))
    assert NUMBERED.diagonal() == tuple(full[i][i] for i in range(6))


@given(twists, twists)
def test_a_dyad_is_the_symmetric_outer_product(a, b):
    outer = np.outer(screw(a), screw(b))
    assert np.array_equal(array(Symmetric6.dyad(a, b)), 0.5 * (outer + outer.T))
    assert np.array_equal(array(Symmetric6.dyad(a, a)), np.outer(screw(a), screw(a)))


@given(twists, twists, st.floats(-10, 10))
def test_sums_and_multiples_go_entry_by_entry(a, b, factor):
    p, q = Symmetric6.dyad(a, a), Symmetric6.dyad(b, b)
    assert np.array_equal(array(Symmetric6.sum_of([p, q])), array(p) + array(q))
    assert np.array_equal(array(p * factor), array(p) * factor)
    assert np.array_equal(array(Symmetric6.sum_of([])), np.zeros((6, 6)))
