"""The greatest eigenvalue by rotations, against LAPACK: also where eigenvalues are equal or many decades apart."""

import math

import numpy as np
import pytest

from kinetostat.algebra.symmetric import greatest_eigenvalue
from kinetostat.engine.gradient import InterpretedBody, gradient
from kinetostat.engine.trace import Body, Graph

COUNT = 5000
ROUNDINGS = 20 * np.finfo(float).eps


def matrices(values):
    """Random symmetric matrices with given eigenvalues [count x n]."""
    source = np.random.default_rng(0)
    turns = np.linalg.qr(source.normal(size=(*values.shape, values.shape[1])))[0]
    made = np.einsum("nij,nj,nkj->nik", turns, values, turns)
    return 0.5 * (made + made.swapaxes(1, 2))


def greatest(stack):
    size = stack.shape[1]
    return greatest_eigenvalue([[stack[:, i, j] for j in range(size)] for i in range(size)])


SPECTRA = {
    "any": lambda source, n: source.random((COUNT, n)),
    "many decades apart": lambda source, n: 10.0 ** source.uniform(-14, 0, (COUNT, n)),
    "nearly equal": lambda source, n: 1.0 + 1e-9 * source.random((COUNT, n)),
    "equal": lambda _, n: np.ones((COUNT, n)),
    "one": lambda source, n: np.eye(n)[source.integers(0, n, COUNT)],
}


@pytest.mark.parametrize("size", [1, 2, 3])
@pytest.mark.parametrize("spectrum", SPECTRA)
def test_it_is_that_of_lapack(spectrum, size):
    stack = matrices(SPECTRA[spectrum](np.random.default_rng(1), size))
    np.testing.assert_allclose(greatest(stack), np.linalg.eigvalsh(stack)[:, -1], rtol=ROUNDINGS)


def test_floats_and_zeros():
    assert greatest_eigenvalue([[1.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 2.0]]) == 3.0
    assert greatest_eigenvalue([[0.0, 0.0], [0.0, 0.0]]) == 0.0
    assert greatest_eigenvalue([[0.0, 2.0], [2.0, 0.0]]) == pytest.approx(2.0)
    assert math.isnan(greatest_eigenvalue([[1.0, math.inf], [math.inf, 1.0]]))


@pytest.mark.parametrize("diagonal", [False, True])
def test_its_derivatives_are_the_dyad_of_its_vector(diagonal):
    """d(lambda)/dA_ij = v_i v_j, twice that for the two entries off the diagonal that are one."""
    stack = matrices(np.array([[1.0, 2.0, 5.0], [0.1, 4.0, 4.5]]))
    if diagonal:
        stack = np.array([np.diag([1.0, 5.0, 2.0]), np.diag([3.0, 2.0, 1.0])])
    places = [(i, j) for i in range(3) for j in range(i, 3)]
    graph = Graph()
    inputs = {place: graph.input() for place in places}
    result = greatest_eigenvalue([[inputs[min(i, j), max(i, j)] for j in range(3)] for i in range(3)])
    assert gradient(result, list(inputs.values()))
    found, codes = np.empty((7, 2)), np.empty(2, dtype=np.int8)
    program = InterpretedBody(Body([], list(inputs.values()), [result], 0.0), list(inputs.values()))
    program.run(np.empty(0), [np.ascontiguousarray(stack[:, i, j]) for i, j in places], found, codes)
    vectors = np.linalg.eigh(stack)[1][:, :, -1]
    for row, (i, j) in zip(found[1:], places, strict=True):
        expected = vectors[:, i] * vectors[:, j] * (1.0 if i == j else 2.0)
        np.testing.assert_allclose(row, expected, atol=1e-12)


@pytest.mark.parametrize("size", [4, 6, 8])
def test_larger_matrices_converge_as_well(size):
    decades = 10.0 ** np.random.default_rng(size).uniform(-4.0, 4.0, (500, size))
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (500, size))
    stack = matrices(decades * signs)
    expected = np.linalg.eigvalsh(stack)[:, -1]
    largest = np.abs(decades).max(axis=1)
    assert (np.abs(greatest(stack) - expected) <= 1e-13 * largest).all()
