"""Forces within bounds: compared with linear programmes and with the conditions of Karush, Kuhn and Tucker."""

import numpy as np
import pytest
from scipy.optimize import linprog, nnls

from kinetostat.numerics.distribution import Rule, balancing_of_any_rank, distribution, nearest_to_origin

LEAST, MOST = 0.1, 2.0
SHAPES = [(3, 4), (3, 7), (6, 7), (6, 8), (6, 12)]


def problems(conditions, size, count, seed=0):
    draw = np.random.default_rng(seed)
    matrix = draw.normal(size=(count, conditions, size))
    matrix /= np.linalg.norm(matrix, axis=1, keepdims=True)
    return matrix, np.einsum("ndm,nm->nd", matrix, draw.uniform(-0.3, 2.4, size=(count, size)))


def chosen(matrix, load, level=0.0, exponent=2.0, most=MOST):
    count = len(load)
    bounds = np.full(count, LEAST), np.full(count, most)
    return distribution(matrix, load, *bounds, Rule(np.full(count, level), np.full(count, exponent)))


@pytest.mark.parametrize(("conditions", "size"), SHAPES)
@pytest.mark.parametrize("most", [MOST, np.inf])
def test_forces_exist_exactly_where_a_linear_programme_finds_some(conditions, size, most):
    matrix, load = problems(conditions, size, 60)
    forces, exist = chosen(matrix, load, most=most)
    for row in range(len(load)):
        found = linprog(np.zeros(size), A_eq=matrix[row], b_eq=load[row], bounds=(LEAST, most))
        assert exist[row] == (found.status == 0)
    assert np.isnan(forces[~exist]).all()
    assert 0 < exist.sum() < len(load) or most == np.inf


@pytest.mark.parametrize(("conditions", "size"), SHAPES)
@pytest.mark.parametrize(("level", "exponent"), [(0.0, 2.0), (1.3, 2.0), (1.0, 4.0), (0.7, 11.0)])
def test_forces_are_within_bounds_and_no_others_cost_less(conditions, size, level, exponent):
    """The gradient of the cost is a sum of conditions, and of bounds that hold exactly, which only push inwards."""
    matrix, load = problems(conditions, size, 60, seed=1)
    forces, exist = chosen(matrix, load, level, exponent)
    assert np.abs(np.einsum("ndm,nm->nd", matrix, forces) - load)[exist].max() < 1e-12
    assert forces[exist].min() > LEAST - 1e-12
    assert forces[exist].max() < MOST + 1e-12
    for row in np.flatnonzero(exist):
        apart = forces[row] - level
        slope = np.sign(apart) * np.abs(apart / np.abs(apart).max()) ** (exponent - 1.0)
        low, high = forces[row] < LEAST + 1e-11, forces[row] > MOST - 1e-11
        unit = np.eye(size)
        columns = np.column_stack([matrix[row].T, -matrix[row].T, unit[:, low], -unit[:, high]])
        assert nnls(columns, slope)[1] < 1e-8


def test_rows_of_lower_rank_have_forces_where_the_load_allows_it():
    matrix = np.zeros((2, 3, 4))
    matrix[:, :2] = problems(2, 4, 1)[0]
    load = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    load[:, :2] = matrix[:, :2].sum(axis=2)
    forces, exist = chosen(matrix, load)
    assert exist.tolist() == [True, False]
    assert np.allclose(matrix[0] @ forces[0], load[0], atol=1e-12)
    assert not balancing_of_any_rank(matrix[1], load[1], 0.0).sure[0]


def test_the_nearest_point_of_a_polyhedron_is_that_of_a_triangle_worked_out_by_hand():
    """x >= 1 and x + y >= 3: nearest is (1.5, 1.5); with y <= 1 as well, (2, 1); with x <= 1 and y <= 1, none."""
    sides = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, -1.0], [-1.0, 0.0]])
    never = -np.inf
    ends = np.array([[1.0, 3.0, never, never], [1.0, 3.0, -1.0, never], [1.0, 3.0, -1.0, -1.0]])
    points, exist = nearest_to_origin(np.broadcast_to(sides, (3, 4, 2)), ends)
    assert exist.tolist() == [True, True, False]
    assert np.allclose(points[:2], [[1.5, 1.5], [2.0, 1.0]], atol=1e-14)
