"""The axes of the figure of a Pareto front: the whole front is seen, whatever the other designs are."""

import numpy as np
import pytest

from kinetostat.views.optimisation_figures import front_limits

EVERY = np.linspace(0.0, 100.0, 1001)


@pytest.mark.parametrize(("low", "high"), [(0.0, 10.0), (45.0, 55.0), (90.0, 100.0), (100.0, 100.0)])
def test_the_whole_front_lies_between_the_limits(low, high):
    left, right = front_limits(np.array([low, high]), EVERY)
    assert left < low <= high < right
    assert right - left <= 3.2 * (high - low or high)


def test_designs_far_from_the_front_do_not_squeeze_it():
    left, right = front_limits(np.array([0.0, 1.0]), np.array([0.0, 1.0, 1e6]))
    assert right - left < 4.0
