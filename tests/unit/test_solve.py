"""Small solves against NumPy's LAPACK: random, sparse, ill-scaled and singular input."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kinetostat.algebra.scalar import is_zero
from kinetostat.algebra.solve import complement, diagonalise, dual_basis
from numeric import U

STABLE = 50 * U
"""Householder and Gauss on at most 6 x 6 lose a few dozen rounding units, times the condition number."""


SIZES = st.integers(1, 6)


@st.composite
def matrices(draw, sizes=SIZES, columns=None, sparse=False):
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
def test_dependent_vectors_have_no_regularity(dependent):
    with np.errstate(all="ignore"):
        _, regularity = dual_basis(dependent)
        _, batched = dual_basis([[np.array([c, c]) for c in row] for row in dependent])
    assert regularity <= STABLE
    assert not np.any(batched > STABLE), "0, or NaN, which counts as singular"


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


def semidefinite(rows, rank, exponents):
    """A matrix A A^T of this rank whose leading blocks are regular up to it, and its ill-scaled relative D A A^T D."""
    square = np.array(rows)
    root = (square + 2.0 * np.eye(len(square)))[:, :rank]
    scale = 10.0 ** np.array(exponents[: len(square)])
    return root @ root.T, scale


@given(matrices(), st.integers(0, 6), st.lists(st.floats(-8, 8), min_size=6, max_size=6))
def test_diagonalise_finds_the_factors_and_the_rank(rows, deficit, exponents):
    """T H T^T = diag(d), measured where rows have comparable size: elimination does not care for their scale."""
    size = len(rows)
    rank = max(0, size - deficit)
    plain, scale = semidefinite(rows, rank, exponents)
    assume(rank == 0 or np.linalg.cond(plain[:rank, :rank]) < 1e4)
    turned, pivots = map(np.array, diagonalise((plain * np.outer(scale, scale)).tolist()))
    assert np.array_equal(np.tril(turned), turned)
    assert np.array_equal(np.diag(turned), np.ones(size))
    assert np.all(pivots[:rank] > 0.0)
    assert np.array_equal(pivots[rank:], np.zeros(size - rank)), "a pivot that is rounding is exactly zero"
    turned, pivots = turned * scale / scale[:, None], pivots / scale**2
    residual = turned @ plain @ turned.T - np.diag(pivots)
    size_of_terms = abs(turned) @ abs(plain) @ abs(turned).T
    assert np.all(abs(residual) <= STABLE * (size_of_terms + np.diag(size_of_terms)[:, None]))


@given(matrices(), st.lists(st.floats(-8, 8), min_size=6, max_size=6))
def test_diagonalise_gives_the_inverse_of_a_regular_matrix(rows, exponents):
    """H^-1 = T^T diag(1 / d) T against LAPACK."""
    plain, scale = semidefinite(rows, len(rows), exponents)
    condition = np.linalg.cond(plain)
    assume(condition < 1e6)
    turned, pivots = map(np.array, diagonalise((plain * np.outer(scale, scale)).tolist()))
    inverse = (turned.T / pivots @ turned) * np.outer(scale, scale)
    expected = np.linalg.inv(plain)
    assert np.linalg.norm(inverse - expected) <= 10 * STABLE * condition * np.linalg.norm(expected)


def test_structural_zeros_survive_the_elimination_of_a_sparse_matrix():
    turned, pivots = diagonalise([[4.0, 0.0, 2.0], [0.0, 5.0, 0.0], [2.0, 0.0, 2.0]])
    assert np.allclose(turned, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.5, 0.0, 1.0]], atol=STABLE)
    assert pivots == pytest.approx([4.0, 5.0, 1.0])
    assert is_zero(turned[1][0])
    assert is_zero(turned[2][1])


@pytest.mark.parametrize("size", [1, 2, 3])
def test_a_zero_matrix_has_zero_pivots(size):
    """A rigid leg: G = 0."""
    turned, pivots = diagonalise([[0.0] * size] * size)
    assert np.array_equal(turned, np.eye(size))
    assert pivots == [0.0] * size
