"""Small solves against NumPy's LAPACK: random, sparse, ill-scaled and singular input."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numeric import U

from kinetostat.algebra.scalar import is_zero
from kinetostat.algebra.solve import cholesky, complement, dual_basis, inverse_positive

STABLE = 50 * U
"""Householder and Cholesky on at most 6 x 6 lose a few dozen rounding units, times the condition number."""


@st.composite
def matrices(draw, sizes=st.integers(1, 6), columns=None, sparse=False):
    """Rows of random numbers; where sparse, about half of them structural zeros."""
    size = draw(sizes)
    seed = draw(st.integers(0, 2**32 - 1))
    random = np.random.default_rng(seed)
    matrix = random.uniform(-1, 1, (columns or size, size))
    if sparse:
        matrix *= random.random(matrix.shape) < 0.5
    return matrix.tolist()


@pytest.mark.parametrize("sparse", [False, True])
@given(data=st.data())
def test_dual_basis_is_the_inverse(sparse, data):
    basis = data.draw(matrices(sparse=sparse))
    condition = np.linalg.cond(np.array(basis))
    assume(condition < 1e6)
    dual, regularity = dual_basis(basis)
    inverse = np.linalg.inv(np.array(basis).T)
    assert np.linalg.norm(np.array(dual) - inverse) <= STABLE * condition * np.linalg.norm(inverse)
    assert np.allclose(np.array(dual) @ np.array(basis).T, np.eye(len(basis)), rtol=0, atol=STABLE * condition)
    assert 0.0 < regularity <= 1.0


@given(matrices())
def test_regularity_is_the_least_distance_from_the_span_of_the_others_before(basis):
    """Dense vectors are taken in the order given, so that R of NumPy's QR holds the same distances."""
    _, regularity = dual_basis(basis)
    distances = abs(np.diag(np.linalg.qr(np.array(basis).T).R))
    assert regularity == pytest.approx(min(1.0, *distances), rel=1e-6, abs=STABLE)


@given(matrices(st.integers(2, 6)), st.lists(st.floats(-8, 8), min_size=6, max_size=6))
def test_dual_basis_does_not_care_for_the_sizes_of_its_vectors(basis, exponents):
    """Columns of W scaled by anything: the dual vectors scale inversely, each to full accuracy."""
    condition = np.linalg.cond(np.array(basis))
    assume(condition < 1e4)
    scale = 10.0 ** np.array(exponents[: len(basis)])
    dual, _ = dual_basis((np.array(basis) * scale[:, None]).tolist())
    plain, _ = dual_basis(basis)
    error = np.linalg.norm(np.array(dual) * scale[:, None] - np.array(plain), axis=1)
    assert np.all(error <= STABLE * condition * np.linalg.norm(np.array(plain), axis=1))


@pytest.mark.parametrize(
    "dependent",
    [
        [[1.0, 2.0], [2.0, 4.0]],
        [[0.0, 0.0], [1.0, 1.0]],
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [3.0, -2.0, 0.0]],
        [[0.3, 0.4, 0.5], [0.1, 0.7, 0.2], [0.4, 1.1, 0.7]],
    ],
)
def test_dependent_vectors_have_regularity_zero(dependent):
    with np.errstate(all="ignore"):
        _, regularity = dual_basis(dependent)
        _, batched = dual_basis([[np.array([c, c]) for c in row] for row in dependent])
    assert regularity <= STABLE
    assert np.all(batched <= STABLE)


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
@given(data=st.data())
def test_complement_is_orthonormal_and_orthogonal(sparse, count, data):
    given_vectors = np.array(data.draw(matrices(st.just(6), columns=count, sparse=sparse)))
    assume(np.linalg.svd(given_vectors, compute_uv=False)[-1] > 1e-3)
    found, regularity = complement(given_vectors.tolist())
    rest = np.array(found)
    assert rest.shape == (6 - count, 6)
    assert np.allclose(rest @ rest.T, np.eye(6 - count), rtol=0, atol=STABLE)
    assert np.allclose(rest @ given_vectors.T, 0.0, rtol=0, atol=STABLE)
    assert 0.0 < regularity <= 1.0


def test_complement_of_axes_is_made_of_axes_and_structural_zeros():
    found, regularity = complement([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 2.0]])
    assert found == [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]
    assert all(is_zero(c) for row in found for c in row if c == 0.0)
    assert regularity == 1.0


def test_complement_of_nothing_new_has_regularity_zero():
    assert complement([[0.0, 0.0, 0.0]])[1] == 0.0
    assert complement([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0]])[1] <= STABLE


def positive(rows, exponents):
    """A well-conditioned positive definite matrix, and its ill-scaled relative D A D."""
    square = np.array(rows)
    plain = square @ square.T + np.eye(len(square))
    scale = 10.0 ** np.array(exponents[: len(square)])
    return plain, plain * np.outer(scale, scale), scale


@given(matrices(), st.lists(st.floats(-8, 8), min_size=6, max_size=6))
def test_cholesky_and_inverse_of_positive_definite_matrices(rows, exponents):
    """Errors are measured where the rows have comparable size, because Cholesky does not care for row scaling."""
    plain, matrix, scale = positive(rows, exponents)
    factor = np.zeros_like(matrix)
    for i, row in enumerate(cholesky(matrix.tolist())):
        factor[i, : len(row)] = row
    assert np.allclose(factor / scale[:, None], np.linalg.cholesky(plain), rtol=0, atol=10 * STABLE)
    inverse = np.array(inverse_positive(matrix.tolist())) * np.outer(scale, scale)
    assert np.allclose(inverse, np.linalg.inv(plain), rtol=0, atol=10 * STABLE)
    assert np.array_equal(inverse, inverse.T)


def test_structural_zeros_survive_the_inverse_of_a_block_diagonal_matrix():
    inverse = inverse_positive([[4.0, 0.0, 2.0], [0.0, 5.0, 0.0], [2.0, 0.0, 2.0]])
    assert np.allclose(inverse, [[0.5, 0.0, -0.5], [0.0, 0.2, 0.0], [-0.5, 0.0, 1.0]], atol=STABLE)
    assert is_zero(inverse[0][1])
    assert is_zero(inverse[1][2])


@pytest.mark.parametrize("matrix", [[[-1.0]], [[1.0, 2.0], [2.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]]])
def test_a_matrix_that_is_not_positive_definite_gives_nan(matrix):
    assert any(math.isnan(entry) for row in cholesky(matrix) for entry in row)
