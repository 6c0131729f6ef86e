"""One formula over Python floats, NumPy arrays of two precisions and JAX under vmap: the same numbers."""

import re

import jax
import numpy as np
import pytest

from kinetostat.algebra.lines import apex
from kinetostat.algebra.solve import complement, conjugate, dual_basis
from kinetostat.algebra.vector import Vector, rotation_x, rotation_y
from kinetostat.machine.column import column
from numeric import U

BATCH = 7
SPARSE = np.array(
    [
        [1, 0, 0, 0, 1, 1],
        [0, 1, 0, 1, 0, 1],
        [1, 1, 0, 0, 0, 1],
        [0, 0, 1, 1, 1, 0],
        [1, 1, 1, 1, 1, 1],
        [0, 0, 0, 1, 0, 0],
    ]
)
"""Where the sparse basis has its non-zeros; elsewhere it holds structural zeros."""


def sparse_dual(*filled):
    numbers = iter(filled)
    rows, singularity_margin = dual_basis([[next(numbers) if used else 0.0 for used in row] for row in SPARSE])
    return [*(c for row in rows for c in row), singularity_margin]


def dense_dual(*numbers):
    rows, singularity_margin = dual_basis([numbers[i : i + 4] for i in range(0, 16, 4)])
    return [*(c for row in rows for c in row), singularity_margin]


def sparse_complement(a, b, c, d):
    rows, singularity_margin = complement([[0.0, a, b, 0.0, 0.0], [c, 0.0, d, 0.0, a]])
    return [*(c for row in rows for c in row), singularity_margin]


def conjugate_columns(a, b, c):
    found = conjugate([[a, 1.0, 0.0], [b, 0.0, c], [0.0, 1.0, c]], [2.0, a * a, 1.0], [5.0, 1.0, 2.0 + a])
    return [*(entry for row in (*found.columns, *found.shares) for entry in row), *found.pivots, found.doubt]


def triangle(x, z, first, second):
    point, sine = apex(Vector(0.0, 0.0, 0.0), Vector(x, 0.0, z), 2.0 + first, 2.0 + second)
    return [*point.components(), sine]


def turning(c, s, x, y):
    turned = (rotation_y(c, s) @ rotation_x(s, c)).apply(Vector(x, y, 0.0))
    return [*turned.components(), turned.norm()]


FORMULAS = {
    "sparse dual basis": (sparse_dual, int(SPARSE.sum())),
    "dense dual basis": (dense_dual, 16),
    "complement": (sparse_complement, 4),
    "conjugate columns": (conjugate_columns, 3),
    "triangle": (triangle, 4),
    "rotation": (turning, 4),
}
every_formula = pytest.mark.parametrize(("formula", "count"), FORMULAS.values(), ids=FORMULAS)
AMPLIFIED = 1e4 * U
"""A few dozen roundings, times a condition number of a few hundred."""


HEAVY = {"while", "scan", "cond", "dot_general", "cholesky", "qr", "lu", "triangular_solve", "gather", "custom_call"}


def inputs(count):
    return np.random.default_rng(4).uniform(0.2, 1.0, (count, BATCH))


def one_by_one(formula, batch):
    return np.array([formula(*map(float, column)) for column in batch.T]).T


def together(results):
    return np.array([np.broadcast_to(np.asarray(result), (BATCH,)) for result in results])


@every_formula
def test_numpy_arrays_give_the_same_bits_as_floats(formula, count):
    batch = inputs(count)
    assert np.array_equal(together(formula(*map(column, batch))), one_by_one(formula, batch))


@every_formula
def test_longer_floats_give_the_same_numbers_with_more_digits(formula, count):
    batch = inputs(count)
    longer = together(formula(*map(column, batch.astype(np.longdouble))))
    assert longer.dtype == np.longdouble
    assert np.allclose(longer.astype(float), one_by_one(formula, batch), rtol=AMPLIFIED, atol=AMPLIFIED)
    assert not np.array_equal(longer, longer.astype(float).astype(np.longdouble)), "digits beyond float64 were lost"


@every_formula
def test_jax_under_vmap_gives_the_same_numbers(formula, count):
    batch = inputs(count)
    with jax.enable_x64(True):
        mapped = jax.jit(jax.vmap(formula))(*batch)
        results = together(mapped)
    assert np.allclose(results, one_by_one(formula, batch), rtol=AMPLIFIED, atol=AMPLIFIED)


@every_formula
def test_jax_leaves_no_loop_and_no_lapack_call(formula, count):
    """Only element-wise operations fuse into one SIMD loop (DESIGN section 4)."""
    with jax.enable_x64(True):
        traced = jax.make_jaxpr(jax.vmap(formula))(*inputs(count))
    used = set(re.findall(r" = (\w+)", str(traced)))
    assert "mul" in used
    assert not used & HEAVY
