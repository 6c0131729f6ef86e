"""Newton's method and damped least squares over many problems: what converges, what does not, each by itself."""

import numpy as np
import pytest

from kinetostat.numerics.iteration import Ending, least_squares, newton

SQUARES = np.array([2.0, 9.0, 1e-6, -1.0])
"""Numbers whose roots are sought; the last one has none."""


def roots(values, rows):
    """x² = s: the residual, and Newton's steps."""
    left = SQUARES[rows] - values[:, 0] ** 2
    return np.abs(left), lambda going: (left[going] / (2.0 * values[going, 0]))[:, None]


CRITERIA = {
    "by the residual": {"residual_goal": 1e-12, "contraction": 1.0},
    "by the steps": {"step_goal": 1e-8},
    "by the step that is foreseen": {"step_goal": 1e-8, "round_off": 1e-14},
    "by short steps": {"step_goal": 1e-8, "longest_step": 0.5},
}


@pytest.mark.parametrize("criteria", CRITERIA.values(), ids=CRITERIA)
def test_roots_are_found_and_what_has_none_is_told_apart(criteria):
    start = np.full((4, 1), 5.1)
    answer = newton(roots, start, 4, most_steps=60, **criteria)
    assert (start == 5.1).all()
    assert answer.converged.tolist() == [True, True, True, False]
    assert answer.outcome[3] == (Ending.DIVERGED if "contraction" in criteria else Ending.OUT_OF_STEPS)
    assert answer.value[:3, 0] == pytest.approx(np.sqrt(SQUARES[:3]), rel=1e-8)
    assert "round-off" in repr(answer)


@pytest.mark.parametrize("criteria", CRITERIA.values(), ids=CRITERIA)
def test_a_problem_does_not_depend_on_the_others(criteria):
    every = newton(roots, np.full((4, 1), 5.1), 4, most_steps=60, **criteria)
    for k in range(4):
        alone = newton(
            lambda values, _, k=k: roots(values, np.array([k])), np.full((1, 1), 5.1), 1, most_steps=60, **criteria
        )
        assert alone.value[0, 0] == every.value[k, 0]
        assert alone.steps[0] == every.steps[k]


def test_numbers_that_are_not_finite_diverge():
    answer = newton(
        lambda _, rows: (np.where(rows == 1, np.nan, 1.0), lambda going: np.zeros((len(going), 1))),
        np.zeros((2, 1)),
        2,
        most_steps=5,
        step_goal=1e-3,
    )
    assert answer.outcome.tolist() == [Ending.CONVERGED, Ending.DIVERGED]


def valley(values, rows):
    """Rosenbrock's valley as two equations, and two that contradict each other in the second problem."""
    x, y = values.T
    one = np.ones_like(x)
    left = -np.stack([10.0 * (y - x * x), 1.0 - x], axis=1)
    rates = np.stack([np.stack([-20.0 * x, 10.0 * one], axis=1), np.stack([-one, 0.0 * one], axis=1)], axis=1)
    second = np.stack([1.0 - x, -1.0 - x], axis=1)
    slopes = np.broadcast_to([[1.0, 0.0], [1.0, 0.0]], rates.shape)
    apart = (rows == 1)[:, None]
    return np.where(apart, second, left), np.where(apart[:, :, None], slopes, rates)


def test_damped_steps_go_down_a_valley_and_tell_what_has_no_solution():
    answer = least_squares(
        valley, np.array([[-1.2, 1.0], [3.0, 0.0]]), most_steps=100, residual_goal=1e-12, acceptable_residual=1e-9
    )
    assert answer.value[0] == pytest.approx([1.0, 1.0], abs=1e-9)
    assert answer.outcome.tolist() == [Ending.CONVERGED, Ending.DIVERGED]
    assert answer.residual[1] == pytest.approx(1.0)
    assert answer.value[1, 0] == pytest.approx(0.0, abs=1e-6)
