"""Scalars: structural zeros and ones, and one set of functions over floats and arrays."""

import math

import jax
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.algebra.scalar import (
    cos,
    is_one,
    is_zero,
    minus,
    plus,
    reciprocal,
    sin,
    smaller,
    sqrt,
    times,
    total,
    where,
)
from kinetostat.algebra.vector import Vector

A = np.array([1.5, -2.0, 0.0])


def test_only_the_python_floats_are_structural():
    assert is_zero(0.0)
    assert is_one(1.0)
    for impostor in (np.float64(0.0), np.zeros(2), 0, False):
        assert not is_zero(impostor)
    for impostor in (np.float64(1.0), np.ones(2), 1, True):
        assert not is_one(impostor)


def test_a_structural_zero_drops_out():
    assert is_zero(times(0.0, A))
    assert is_zero(times(A, 0.0))
    assert plus(0.0, A) is A
    assert plus(A, 0.0) is A
    assert minus(A, 0.0) is A
    assert np.array_equal(minus(0.0, A), -A)
    assert times(1.0, A) is A
    assert times(A, 1.0) is A
    assert is_zero(total([]))
    assert total([0.0, A, 0.0]) is A


def test_a_structural_zero_leaves_no_operation_in_a_traced_formula():
    def sparse(a):
        return a * 2.0, Vector(a, 0.0, 0.0).dot(Vector(0.0, a, a)), Vector(a, 0.0, 0.0).cross(Vector(a, 0.0, 0.0)).x

    traced = jax.make_jaxpr(sparse)(1.0)
    assert len(traced.eqns) == 1, "only the product that is asked for may remain"


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_structural_operators_are_the_plain_ones(a, b):
    assert times(a, b) == a * b
    assert plus(a, b) == a + b
    assert minus(a, b) == a - b
    assert smaller(a, b) == min(a, b)


def test_square_root_of_a_negative_number_is_nan():
    assert sqrt(9.0) == 3.0
    assert math.isnan(sqrt(-1.0))
    with np.errstate(invalid="ignore"):
        assert np.array_equal(sqrt(np.array([4.0, -1.0])), [2.0, np.nan], equal_nan=True)


@pytest.mark.parametrize("dtype", [np.float64, np.longdouble])
def test_trigonometry_keeps_the_precision_of_its_argument(dtype):
    angles = np.linspace(-3, 3, 7, dtype=dtype)
    assert sin(angles).dtype == dtype
    tolerance = 4 * np.finfo(dtype).eps
    assert np.all(abs(sin(angles) ** 2 + cos(angles) ** 2 - 1) <= tolerance)
    assert [sin(float(a)) for a in angles] == pytest.approx(sin(angles).astype(float), rel=1e-15)


def test_where_over_floats_and_arrays():
    assert where(True, 1.0, 2.0) == 1.0
    assert where(False, 1.0, 2.0) == 2.0
    assert np.array_equal(where(A > 0.0, A, -A), [1.5, 2.0, -0.0])
    assert np.array_equal(smaller(A, 0.5), [0.5, -2.0, 0.0])


def test_the_ends_of_the_stiffness_scale_are_exchanged_exactly():
    assert reciprocal(0.0) == math.inf
    assert reciprocal(math.inf) == 0.0
    assert reciprocal(4.0) == 0.25
    with np.errstate(divide="ignore"):
        assert np.array_equal(reciprocal(np.array([0.0, np.inf, 4.0])), [np.inf, 0.0, 0.25])
