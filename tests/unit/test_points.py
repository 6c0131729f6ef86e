"""Points of a grid, served run by run, against indices from NumPy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.engine.points import Axis, ConsecutivePoints, Grid, PointTable

SHAPES = st.lists(st.integers(2, 7), min_size=1, max_size=6)


def grid_of(shape):
    return Grid([Axis((f"a{i}",), 10.0 * i + np.arange(n)) for i, n in enumerate(shape)])


@given(SHAPES, st.data())
def test_a_run_of_a_grid_is_what_its_indices_say(shape, data):
    grid = grid_of(shape)
    start = data.draw(st.integers(0, grid.size - 1))
    stop = data.draw(st.integers(start + 1, grid.size))
    found = grid.columns(start, stop)
    for i, index in enumerate(np.unravel_index(np.arange(start, stop), grid.shape)):
        np.testing.assert_array_equal(found[f"a{i}"], grid.axes[i].values[index])


def test_a_short_run_of_a_huge_grid_takes_little_memory():
    grid = grid_of([3, 10**6, 10**6, 10**6])
    start = 2 * 10**18 - 2
    assert grid.columns(start, start + 4)["a0"].tolist() == [1.0, 1.0, 2.0, 2.0]


def test_all_paths_of_an_axis_take_its_values_together():
    grid = Grid([Axis(("p", "q"), np.array([1.0, 2.0]))])
    assert {name: column.tolist() for name, column in grid.columns(0, 2).items()} == {"p": [1.0, 2.0], "q": [1.0, 2.0]}


@pytest.mark.parametrize("whole", [grid_of([3, 4]), PointTable({"a": np.arange(12.0)})])
def test_a_part_is_numbered_from_its_start(whole):
    part = ConsecutivePoints(whole, 5, 9)
    assert part.size == 4
    assert part.paths == whole.paths
    for path, column in part.columns(1, 3).items():
        np.testing.assert_array_equal(column, whole.columns(6, 8)[path])
