"""Condition numbers: from 1 to infinity, the same from K and C, and of no unit once the length is given."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from elastic import LENGTH, PLANE, spring_matrix, stiffnesses, turns, wrench_moved
from kinetostat.kinetostatics.indices import stiffness_condition, twist_condition

lengths = st.floats(0.05, 5.0)


@given(stiffnesses, lengths)
def test_k_and_c_have_one_condition(stiffness, length):
    compliance = np.linalg.inv(stiffness)
    found = stiffness_condition(stiffness, compliance, length)
    assert found >= 1.0
    assert stiffness_condition(None, compliance, length) == pytest.approx(found, rel=1e-6)


@given(stiffnesses, lengths, turns)
def test_it_depends_neither_on_axes_nor_on_the_unit_of_length(stiffness, length, rotation):
    found = stiffness_condition(stiffness, None, length)
    moved = wrench_moved(rotation, np.zeros(3))
    assert stiffness_condition(moved @ stiffness @ moved.T, None, length) == pytest.approx(found, rel=1e-6)
    millimetres = np.repeat([1000.0, 1.0], 3)
    converted = stiffness * np.outer(millimetres, millimetres)
    assert stiffness_condition(converted, None, 1000.0 * length) == pytest.approx(found, rel=1e-6)


def test_an_isotropic_machine_has_condition_one_at_its_own_length():
    stiffness = np.diag([4.0, 4.0, 4.0, 1.0, 1.0, 1.0])
    assert stiffness_condition(stiffness, None, 2.0) == pytest.approx(1.0)
    assert stiffness_condition(stiffness, None, 1.0) == pytest.approx(4.0)
    assert stiffness_condition(None, np.linalg.inv(stiffness), 1.0) == pytest.approx(4.0)
    assert stiffness_condition(stiffness[np.ix_(PLANE, PLANE)], None, 2.0, PLANE) == pytest.approx(1.0)


def test_rigid_and_free_directions_have_infinite_condition():
    endless = np.full((6, 6), math.inf)
    assert stiffness_condition(endless, np.diag([1.0, 0, 0, 1, 1, 1]), LENGTH) == math.inf
    assert stiffness_condition(np.diag([1.0, 0, 0, 1, 1, 1]), None, LENGTH) == math.inf
    assert stiffness_condition(spring_matrix(0, 5), None, LENGTH) == math.inf
    assert stiffness_condition(None, None, LENGTH) == stiffness_condition(endless, endless, LENGTH) == math.inf


@given(stiffnesses, turns)
def test_rounding_is_no_stiffness(stiffness, rotation):
    """A free direction stays free when the machine is turned, though its stiffness becomes some 1e-17 of the others."""
    moved = wrench_moved(rotation, np.zeros(3))
    values, vectors = np.linalg.eigh(stiffness)
    free = moved @ (vectors[:, 1:] * values[1:] @ vectors[:, 1:].T) @ moved.T
    assert stiffness_condition(free, None, 1.0) == math.inf


@given(st.integers(0, 1000), lengths)
def test_wrenches_and_twists_that_are_dual_have_one_condition(seed, length):
    wrenches = np.random.default_rng(seed).normal(size=(6, 6))
    found = twist_condition(wrenches, 1.0 / length)
    assert found >= 1.0
    assert twist_condition(np.linalg.inv(wrenches).T, length) == pytest.approx(found, rel=1e-6)


@given(st.integers(0, 1000), lengths)
def test_unit_springs_have_the_square_of_the_condition_of_their_wrenches(seed, length):
    wrenches = np.random.default_rng(seed).normal(size=(6, 8))
    found = twist_condition(wrenches, 1.0 / length)
    assert stiffness_condition(wrenches @ wrenches.T, None, length) == pytest.approx(found**2, rel=1e-6)


def test_fewer_screws_than_components_and_dependent_ones():
    pair = np.array([[0, 0], [0, 0], [1, 0], [0, 1], [0, 0], [0, 0]], dtype=float)
    assert twist_condition(pair, 0.25) == pytest.approx(4.0)
    assert twist_condition(pair, 4.0) == pytest.approx(4.0)
    assert twist_condition(np.hstack([pair, pair]), 1.0) == math.inf
    assert twist_condition(pair[2:5], 0.25, PLANE) == pytest.approx(4.0)


def test_a_length_is_positive_and_screws_are_columns():
    for length in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="length"):
            stiffness_condition(np.eye(6), None, length)
        with pytest.raises(ValueError, match="length"):
            twist_condition(np.eye(6), length)
    for screws in (np.eye(3), np.ones(6), np.full((6, 1), math.nan), np.zeros((6, 0))):
        with pytest.raises(ValueError, match="6 rows"):
            twist_condition(screws, 1.0)
