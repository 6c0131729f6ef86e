"""Derivatives of what equations give: joint coordinates that follow, that are idle, and that cannot follow."""

import numpy as np
import pytest

from kinetostat.engine.derivatives import total_slopes


def test_a_point_on_a_circle_follows_its_radius():
    """q^2 + h^2 = r^2: dq/dr = r / q, dq/dh = -h / q; J = 3 q + h."""
    h, r = np.array([0.3, 0.6]), np.array([1.0, 1.1])
    q = np.sqrt(r * r - h * h)
    slopes = np.array([[[0.0, 1.0]]] * 2)
    joint_rates, rates = (2 * q)[:, None, None], np.stack([-2 * r, 2 * h], axis=1)[:, None]
    total = total_slopes(slopes, np.full((2, 1, 1), 3.0), joint_rates, rates)
    assert total[:, 0, 0] == pytest.approx(3 * r / q)
    assert total[:, 0, 1] == pytest.approx(1 - 3 * h / q)


def test_an_idle_coordinate_does_not_move():
    """q1 + q2 = p of least norm: half each; q3 is in no equation, and J = q3 does not change."""
    joint_rates, rates = np.array([[[1.0, 1.0, 0.0]]]), np.array([[[-1.0]]])
    total = total_slopes(np.zeros((1, 3, 1)), np.eye(3)[None], joint_rates, rates)
    assert total[0, :, 0] == pytest.approx([0.5, 0.5, 0.0])


def test_equations_said_twice_are_no_more_than_said_once():
    joint_rates, rates = np.array([[[2.0], [2.0], [1e-3]]]), np.array([[[-2.0], [-2.0], [-1e-3]]])
    assert total_slopes(np.zeros((1, 1, 1)), np.ones((1, 1, 1)), joint_rates, rates)[0, 0, 0] == pytest.approx(1.0)


def test_a_parameter_that_cannot_change_alone_has_no_derivative():
    """q = p0 and q = p1: neither may change without the other; a third parameter may."""
    joint_rates, rates = np.array([[[1.0], [1.0]]]), np.array([[[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]])
    total = total_slopes(np.full((1, 1, 3), 5.0), np.ones((1, 1, 1)), joint_rates, rates)
    assert np.isnan(total[0, 0, :2]).all()
    assert total[0, 0, 2] == 5.0


def test_poses_without_a_number_do_not_spoil_the_others():
    joint_rates = np.array([[[1.0]], [[np.nan]]])
    total = total_slopes(np.zeros((2, 1, 1)), np.ones((2, 1, 1)), joint_rates, np.array([[[-2.0]], [[1.0]]]))
    assert total[0, 0, 0] == pytest.approx(2.0)
    assert np.isnan(total[1, 0, 0])
    assert np.isnan(total_slopes(np.zeros((1, 1, 1)), np.ones((1, 1, 1)), joint_rates[1:], joint_rates[1:])).all()
