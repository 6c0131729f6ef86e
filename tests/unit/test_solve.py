"""Small solves against NumPy's LAPACK: random, sparse, ill-scaled and singular input."""

import itertools

import numpy as np
import pytest
import sympy
from hypothesis import assume, given
from hypothesis import strategies as st

from kinetostat.algebra.scalar import is_zero
from kinetostat.algebra.solve import complement, conjugate, dual_basis, elimination, least_energy, right_inverse
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
    dual, singularity_margin = dual_basis(basis)
    inverse = np.linalg.inv(np.array(basis).T)
    assert np.linalg.norm(np.array(dual) - inverse) <= STABLE * condition * np.linalg.norm(inverse)
    assert np.allclose(np.array(dual) @ np.array(basis).T, np.eye(len(basis)), rtol=0, atol=STABLE * condition)
    assert 0.0 < singularity_margin <= 1.0


@pytest.mark.parametrize("sparse", [False, True])
@given(data=st.data())
def test_singularity_margin_is_a_reciprocal_condition_number_in_any_order_of_the_vectors(sparse, data):
    basis = np.array(data.draw(matrices(sparse=sparse)))
    assume(np.linalg.cond(basis) < 1e6)
    sizes = np.linalg.norm(basis) * np.linalg.norm(np.linalg.inv(basis))
    for order in (basis, data.draw(st.permutations(basis.tolist()))):
        _, singularity_margin = dual_basis([*map(list, order)])
        assert singularity_margin == pytest.approx(len(basis) / sizes, rel=1e-8)


@given(matrices(st.just(6), columns=8))
def test_singularity_margin_of_fewer_or_more_vectors_is_that_of_their_pseudo_inverse(vectors):
    assume(np.linalg.cond(np.array(vectors)) < 1e6)
    few, wide = vectors[:4], np.array(vectors).T.tolist()
    for given_vectors, found in ((few, complement(few)[-1]), (wide, right_inverse(wide)[-1])):
        matrix = np.array(given_vectors)
        sizes = np.linalg.norm(matrix) * np.linalg.norm(np.linalg.pinv(matrix))
        assert found == pytest.approx(len(matrix) / sizes, rel=1e-8)


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
def test_dependent_vectors_have_no_singularity_margin(dependent):
    with np.errstate(all="ignore"):
        _, singularity_margin = dual_basis(dependent)
        _, batched = dual_basis([[np.array([c, c]) for c in row] for row in dependent])
    assert singularity_margin <= STABLE
    assert not np.any(batched > STABLE), "0, or NaN, which counts as singular"


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
@given(data=st.data())
def test_complement_is_orthonormal_and_orthogonal(sparse, count, data):
    given_vectors = np.array(data.draw(matrices(st.just(6), columns=count, sparse=sparse)))
    assume(np.linalg.svd(given_vectors, compute_uv=False)[-1] > 1e-3)
    found, singularity_margin = complement(given_vectors.tolist())
    rest = np.array(found)
    assert rest.shape == (6 - count, 6)
    assert np.allclose(rest @ rest.T, np.eye(6 - count), rtol=0, atol=STABLE)
    assert np.allclose(rest @ given_vectors.T, 0.0, rtol=0, atol=STABLE)
    assert 0.0 < singularity_margin <= 1.0


def test_complement_of_axes_is_made_of_axes_and_structural_zeros():
    found, singularity_margin = complement([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 2.0]])
    assert found == [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]
    assert all(is_zero(c) for row in found for c in row if c == 0.0)
    assert singularity_margin == pytest.approx(0.8), "2 / (|1 2| |1 1/2|)"


def test_complement_of_nothing_new_has_singularity_margin_zero():
    assert complement([[0.0, 0.0, 0.0]])[1] == 0.0
    assert complement([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0]])[1] <= STABLE


def conjugated(columns, weights):
    """A' [n x m], L [m x m] and d [m] as arrays."""
    found = conjugate(columns.T.tolist(), weights.tolist(), sizes_of(columns))
    factor = np.eye(len(found.pivots))
    for k, row in enumerate(found.shares):
        factor[k, :k] = row
    return np.array(found.columns).T, factor, np.array(found.pivots)


def sizes_of(columns):
    """Squares of the sizes that the components have here."""
    return np.maximum(np.square(columns).max(axis=1), 1e-60).tolist()


@given(matrices(), st.integers(0, 6), st.lists(st.floats(-2, 2), min_size=6, max_size=6))
def test_conjugate_finds_the_factors_and_the_rank(rows, deficit, exponents):
    """A = A' L^T and A'^T S A' = diag(d), to rounding of the terms; columns that S does not tell apart have d = 0.

    What is less than 1e-9 of the size of its row counts as round-off, so that columns differ by less than that here.
    """
    columns = np.array(rows) + 2.0 * np.eye(len(rows))
    rank = max(0, len(columns) - deficit)
    columns[:, rank:] = columns[:, :rank] @ np.ones((rank, len(columns) - rank))
    assume(rank == 0 or np.linalg.cond(columns[:, :rank]) < 1e4)
    weights = np.ones(len(columns))
    columns = columns * 10.0 ** np.array(exponents[: len(columns)])
    turned, factor, pivots = conjugated(columns, weights)
    assert np.all(pivots[:rank] > 0.0)
    assert np.array_equal(pivots[rank:], np.zeros(len(columns) - rank)), "a pivot that is rounding is exactly zero"
    assert np.all(abs(turned @ factor.T - columns) <= STABLE * (abs(turned) @ abs(factor).T))
    products, sizes = turned[:, :rank].T @ turned[:, :rank], np.linalg.norm(turned[:, :rank], axis=0)
    assert np.all(abs(products - np.diag(pivots[:rank])) <= 1e4 * STABLE * np.outer(sizes, sizes))


@given(matrices(), st.floats(0, 12))
def test_conjugate_loses_but_the_square_root_of_the_contrast(rows, decades):
    """The softest of the modes of A^T S A, against exact fractions, where the product itself would drown it."""
    columns = np.array(rows) + 2.0 * np.eye(len(rows))
    assume(np.linalg.cond(columns) < 1e3)
    weights = 10.0 ** -np.linspace(0.0, decades, len(columns))
    _, _, pivots = conjugated(columns, weights)
    exact = sympy.Matrix(len(columns), len(columns), [sympy.Rational(float(c)) for c in columns.ravel()])
    square = exact.T * sympy.diag(*[sympy.Rational(float(w)) for w in weights]) * exact
    minors = [1, *(square[:k, :k].det() for k in range(1, len(columns) + 1))]
    expected = [float(b / a) for a, b in itertools.pairwise(minors)]
    assert pivots == pytest.approx(expected, rel=1e4 * STABLE * 10.0 ** (decades / 2.0))


@given(matrices(), st.lists(st.floats(-3, 3), min_size=6, max_size=6))
def test_least_energy_leaves_nothing_to_gain(rows, exponents):
    """x^T S x is least: S x is at right angles to every internal column."""
    every = np.array(rows) + 2.0 * np.eye(len(rows))
    assume(len(every) > 1 and np.linalg.cond(every) < 1e4)
    weights = 10.0 ** np.array(exponents[: len(every)])
    left, _ = least_energy(every.T[:1].tolist(), every.T[1:].tolist(), weights.tolist(), sizes_of(every))
    found = np.array(left)[0]
    mix = np.linalg.lstsq(every[:, 1:], found - every[:, 0], rcond=None)[0]
    assert np.allclose(every[:, 1:] @ mix, found - every[:, 0], rtol=0, atol=1e-9 * np.linalg.norm(every))
    roots = np.sqrt(weights)
    best = np.linalg.lstsq(roots[:, None] * every[:, 1:], -roots * every[:, 0], rcond=None)[0]
    least = np.linalg.norm(roots * (every[:, 0] + every[:, 1:] @ best))
    assert np.linalg.norm(roots * found) <= least + 1e-9 * np.linalg.norm(roots[:, None] * every)


def test_structural_zeros_survive_among_sparse_columns():
    columns = [[2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [1.0, 0.0, 5.0]]
    found = conjugate(columns, [1.0, 1.0, 2.0], [4.0, 9.0, 25.0])
    assert found.columns == [[2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 5.0]]
    assert found.pivots == [4.0, 9.0, 50.0]
    assert found.shares == [[], [0.0], [0.5, 0.0]]
    assert is_zero(found.columns[1][0])
    assert is_zero(found.columns[0][1])
    assert found.doubt == 0.0


@pytest.mark.parametrize("size", [1, 2, 3])
def test_what_no_weight_sees_has_zero_pivots(size):
    """A rigid leg: G = 0."""
    columns = np.eye(size).tolist()
    found = conjugate(columns, [0.0] * size, [1.0] * size)
    assert found.columns == columns
    assert found.pivots == [0.0] * size
    assert not any(any(row) for row in found.shares)
    assert found.doubt == 0.0


def test_components_without_a_weight_are_carried_along():
    assert conjugate([[1.0, 10.0], [2.0, 50.0]], [3.0], [2.0]).columns == [[1.0, 10.0], [0.0, 30.0]]


@pytest.mark.parametrize("contrast", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize(("load", "pivot", "doubt"), [(1e-12, False, 0.0), (1e-8, True, 1.0), (1e-5, True, 0.0)])
def test_whether_a_weight_sees_a_column_is_a_question_of_geometry(load, pivot, doubt, contrast):
    """Round-off of a rigid load is unseen whatever the weights, also where no column came before it."""
    alone = conjugate([[load, 0.0]], [1.0, contrast], [1.0, 1.0])
    assert (alone.pivots[0] > 0.0, alone.doubt) == (pivot, doubt)
    after = conjugate([[1.0, 0.5], [2.0 + load, 1.0]], [1.0, contrast], [1.0, 1.0])
    assert (after.pivots[1] > 0.0, after.doubt) == (pivot, doubt)


@pytest.mark.parametrize("symmetric", [True, False])
def test_elimination_solves_and_its_pivots_tell_what_is_positive_definite(symmetric):
    drawn = np.random.default_rng(3).normal(size=(6, 6))
    matrix = drawn @ drawn.T + (np.zeros((6, 6)) if symmetric else 0.1 * (drawn - drawn.T))
    right = np.arange(1.0, 7.0)
    factors = elimination(matrix.tolist(), symmetric)
    assert factors.solve(right.tolist()) == pytest.approx(np.linalg.solve(matrix, right), rel=1e-9)
    assert min(factors.pivots) > 0.0
    signs = np.linalg.eigvalsh(drawn + drawn.T) > 0.0
    assert sum(pivot > 0.0 for pivot in elimination((drawn + drawn.T).tolist()).pivots) == signs.sum()
