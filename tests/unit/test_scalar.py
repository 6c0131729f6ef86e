"""Scalars: structural zeros and ones, and one set of functions over floats and arrays."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.algebra.scalar import (
    cos,
    is_one,
    is_zero,
    reciprocal,
    sin,
    smaller,
    sqrt,
    total,
    weighted,
    where,
)
from kinetostat.algebra.vector import Vector
from kinetostat.engine.trace import Graph
from kinetostat.machine.column import Column, column

A = column(np.array([1.5, -2.0, 0.0]))


def test_only_the_python_floats_are_structural():
    assert is_zero(0.0)
    assert is_one(1.0)
    for impostor in (np.float64(0.0), np.zeros(2), 0, False):
        assert not is_zero(impostor)
    for impostor in (np.float64(1.0), np.ones(2), 1, True):
        assert not is_one(impostor)


def test_a_structural_zero_drops_out_of_a_column():
    assert is_zero(0.0 * A)
    assert is_zero(A * 0.0)
    assert 0.0 + A is A
    assert A + 0.0 is A
    assert A - 0.0 is A
    assert np.array_equal(0.0 - A, -A)
    assert 1.0 * A is A
    assert A * 1.0 is A
    assert is_zero(total([]))
    assert total([0.0, A, 0.0]) is A


def test_what_is_computed_from_columns_is_a_column():
    results = (A + A, A * 2.0, 2.0 - A, abs(A), A / 3.0, sqrt(A * A), sin(A), where(A > 0.0, A, 1.0), smaller(A, 0.5))
    assert all(type(result) is Column for result in results)
    assert type(column(np.ones(2))) is Column
    assert column(2.5) == 2.5


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_columns_and_floats_follow_the_same_arithmetic(a, b):
    many = column(np.full(2, a))
    for result, expected in ((many * b, a * b), (many + b, a + b), (many - b, a - b), (b - many, b - a)):
        assert np.array_equal(np.broadcast_to(result, 2), [expected, expected])
    assert smaller(a, b) == min(a, b)


def test_a_structural_zero_leaves_no_operation_in_a_traced_formula():
    graph = Graph()
    a = graph.input()
    assert is_zero(Vector(a, 0.0, 0.0).dot(Vector(0.0, a, a)))
    assert is_zero(Vector(a, 0.0, 0.0).cross(Vector(a, 0.0, 0.0)).x)
    assert len(graph.nodes) == 1, "nothing but the input may be there"
    assert len({id(a * 2.0), id(graph.nodes[-1])}) == 1, "a product that is asked for remains"


def test_an_infinite_weight_counts_only_where_it_is_felt():
    assert weighted(math.inf, 0.0) == 0.0
    assert weighted(0.0, math.inf) == 0.0
    assert weighted(math.inf, 2.0) == math.inf
    assert weighted(3.0, 2.0) == 6.0
    assert is_zero(weighted(column(np.array([math.inf, 1.0])), 0.0))


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
