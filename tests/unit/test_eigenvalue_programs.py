"""Largest eigenvalues by machine code against LAPACK, of matrices with conditions."""

from itertools import pairwise

import numpy as np
import pytest

from kinetostat.engine.eigenvalues import Pencil
from kinetostat.engine.modes import eigenvalue_program
from kinetostat.vibration.springwise import SpringSizes


def eigenvalues(pencil, *parts):
    """The program's answer to T, H, A, D and, of pencils under load, F and E [points first]."""
    flat = []
    for number, part in enumerate(parts):
        ends = np.cumsum([pencil.sizes.springs - sum(pencil.sizes.legs), *pencil.sizes.legs])
        legs = [part[:, first:last, first:last] for first, last in pairwise(ends)] if number in (3, 5) else []
        flat += [leg[:, *np.triu_indices(leg.shape[1])] for leg in legs] or [part.reshape(len(part), -1)]
    columns = np.ascontiguousarray(np.concatenate(flat, axis=1).T)
    program, points = eigenvalue_program(pencil), columns.shape[1]
    memory = np.zeros(pencil.layout.size * program.lanes + 8)
    first = -memory.ctypes.data // 8 % 8
    results, codes = np.empty((pencil.count, points)), np.empty(points, dtype=np.int8)
    program.run(memory[first:], [columns], results, codes)
    return results.T


def whole(twists, mixed, beside):
    product = np.swapaxes(twists, 1, 2) @ mixed
    return product + np.swapaxes(product, 1, 2) + beside


def by_lapack(count, twists, mixed_mass, conditions, mass, mixed_stiffness=None, stiffness=None):
    result = np.zeros((len(twists), count))
    for point in range(len(twists)):
        at = slice(point, point + 1)
        axes = np.linalg.qr(conditions[point].T, mode="complete")[0][:, conditions.shape[1] :]
        matrix = axes.T @ whole(twists[at], mixed_mass[at], mass[at])[0] @ axes
        if stiffness is not None:
            stiff = axes.T @ (np.eye(len(axes)) + whole(twists[at], mixed_stiffness[at], stiffness[at])[0]) @ axes
            factor = np.linalg.inv(np.linalg.cholesky(stiff))
            matrix = factor @ matrix @ factor.T
        sizes = np.linalg.eigvalsh(matrix)[::-1][:count]
        result[point, : len(sizes)] = np.maximum(sizes, 0.0)
    return result


@pytest.mark.parametrize("points", [1, 3, 29])
@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize(
    ("ways", "legs", "conditions", "count"),
    [
        *((6, [4] * 6, 0, 6), (6, [13] * 3, 3, 6), (3, [3] * 3, 1, 2), (2, [4], 3, 6), (1, [1], 0, 1)),
        *((6, [5, 0, 13, 7], 9, 1), (3, [8], 0, 9), (6, [1] * 9, 1, 3)),
    ],
)
def test_they_are_those_of_lapack(ways, legs, conditions, count, loaded, points):
    """Legs have springs of any number; two rods come before them."""
    springs = 2 + sum(legs)
    random, places = np.random.default_rng(springs), np.repeat(np.arange(len(legs) + 2), [1, 1, *legs])
    apart = places[:, None] != places
    apart[:2] = True
    twists, mixed, other = random.normal(size=(3, points, ways, springs))
    conditions = random.normal(size=(points, conditions, springs))
    roots = random.normal(size=(points, springs, springs)) * 10.0 ** random.uniform(-3.0, 3.0, springs)
    mass, stiffness = (np.swapaxes(root, 1, 2) @ root for root in (roots, 0.1 * random.normal(size=roots.shape)))
    mass[:, apart], stiffness[:, apart] = 0.0, 0.0
    sizes = SpringSizes(ways, springs, conditions.shape[1], tuple(legs))
    parts = [twists, mixed, conditions, mass, *([0.1 * other / springs, stiffness] if loaded else [])]
    answer = eigenvalues(Pencil(sizes, count, loaded), *parts)
    expected = by_lapack(count, *parts)
    np.testing.assert_allclose(answer, expected, rtol=0.0, atol=1e-14 * springs * expected.max())


def test_equal_and_separate_and_no_eigenvalues():
    """Matrices that are diagonal already, whose numbers are equal, halves of each other, negative, or zero."""
    springs, points = 12, 9
    sizes = np.zeros((points, springs))
    sizes[1], sizes[2, ::3], sizes[3] = 7.0, 2.0, 2.0 ** -np.arange(springs)
    sizes[4], sizes[5, 3], sizes[6], sizes[7] = -1.0, 1e-200, 1e200 * np.arange(springs), np.nan
    sizes[8, :3] = 1.0, 0.5, 0.25
    twists = np.zeros((points, 2, springs))
    pencil = Pencil(SpringSizes(2, springs, 0, (springs,)), 4, loaded=False)
    answer = eigenvalues(pencil, twists, twists, np.zeros((points, 0, springs)), sizes[:, :, None] * np.eye(springs))
    expected = np.maximum(-np.sort(-sizes, axis=1)[:, :4], 0.0)
    expected[7] = np.nan
    np.testing.assert_allclose(answer, expected, rtol=1e-14, atol=1e-300)


def test_what_is_not_held_has_no_eigenvalues():
    """A point at which the other matrix is not positive definite leaves its neighbours as they are."""
    random = np.random.default_rng(1)
    springs, points = 5, 16
    twists, mixed, other = random.normal(size=(3, points, 2, springs))
    mass = np.broadcast_to(np.eye(springs), (points, springs, springs)).copy()
    stiffness = np.zeros_like(mass)
    stiffness[4, 2, 2] = -10.0
    parts = [twists, mixed, np.zeros((points, 0, springs)), mass, 0.01 * other, stiffness]
    answer = eigenvalues(Pencil(SpringSizes(2, springs, 0, (springs,)), 3, loaded=True), *parts)
    assert np.isnan(answer).any(axis=1).tolist() == [point == 4 for point in range(points)]
    rest = np.arange(points) != 4
    np.testing.assert_allclose(answer[rest], by_lapack(3, *(part[rest] for part in parts)), rtol=1e-13)
