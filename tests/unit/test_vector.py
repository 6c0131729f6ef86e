"""Vectors, rotations and displacements: the axioms of their groups, also very near the identity."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry import ANGLES, TINY, about_x, about_y, displacements, rotations, vectors
from kinetostat.algebra.vector import (
    IDENTITY,
    X_AXIS,
    Y_AXIS,
    Z_AXIS,
    ZERO,
    Displacement,
    Rotation,
    polar,
)
from numeric import U, matrix, vector

FEW = 16 * U
"""A dozen roundings of numbers of size 1."""
STILL = Displacement(IDENTITY, ZERO)
FAR = 10.0
"""Size of the translations drawn here, m."""


def near(a, b, size=1.0):
    return np.all(abs(vector(a) - vector(b)) <= FEW * size)


def same(p: Displacement, q: Displacement):
    return rotations_near(p.rotation, q.rotation) and near(p.translation, q.translation, 4 * FAR)


def rotations_near(p: Rotation, q: Rotation):
    return np.all(abs(matrix(p) - matrix(q)) <= FEW)


@given(vectors(), vectors(), vectors())
def test_vector_algebra_is_that_of_numpy(a, b, c):
    p, q = vector(a), vector(b)
    assert np.array_equal(vector(a + b), p + q)
    assert np.array_equal(vector(a - b), p - q)
    assert np.array_equal(vector(-a), -p)
    assert np.array_equal(vector(a * 3.0), 3.0 * p)
    assert np.allclose(vector(a.cross(b)), np.cross(p, q), rtol=0, atol=FEW)
    assert a.dot(b) == pytest.approx(p @ q, abs=FEW)
    assert a.norm() == pytest.approx(np.linalg.norm(p), rel=FEW)
    assert a.dot(b.cross(c)) == pytest.approx(b.dot(c.cross(a)), abs=FEW)


def test_the_axes_are_right_handed():
    assert X_AXIS.cross(Y_AXIS) == Z_AXIS
    assert Y_AXIS.cross(Z_AXIS) == X_AXIS
    assert Z_AXIS.cross(X_AXIS) == Y_AXIS


@given(rotations(), rotations(), rotations(), vectors())
def test_rotations_form_a_group_that_acts_on_vectors(p, q, r, v):
    assert rotations_near((p @ q) @ r, p @ (q @ r))
    assert rotations_near(p @ IDENTITY, p)
    assert rotations_near(IDENTITY @ p, p)
    assert rotations_near(p @ p.inverse(), IDENTITY)
    assert rotations_near(p.inverse() @ p, IDENTITY)
    assert near((p @ q).apply(v), p.apply(q.apply(v)), 2.0)


@given(rotations(), vectors(), vectors())
def test_rotations_keep_lengths_angles_and_handedness(q, a, b):
    assert np.allclose(matrix(q).T @ matrix(q), np.eye(3), rtol=0, atol=FEW)
    assert np.linalg.det(matrix(q)) == pytest.approx(1.0, abs=FEW)
    assert np.allclose(matrix(q) @ vector(a), vector(q.apply(a)), rtol=0, atol=FEW)
    assert q.apply(a).dot(q.apply(b)) == pytest.approx(a.dot(b), abs=2 * FEW)
    assert near(q.apply(a).cross(q.apply(b)), q.apply(a.cross(b)), 4.0)


@given(TINY, TINY, vectors())
def test_near_the_identity_a_rotation_is_a_cross_product(alpha, beta, v):
    """R v = v + omega x v + O(omega^2): a lost or wrong first-order term would show at once."""
    for turned, omega in ((about_x(alpha), X_AXIS * alpha), (about_y(beta), Y_AXIS * beta)):
        angle = max(abs(alpha), abs(beta))
        assert np.all(abs(vector(turned.apply(v) - v - omega.cross(v))) <= angle**2 + FEW)


@pytest.mark.parametrize("build", [about_x, about_y])
@given(first=ANGLES, second=ANGLES)
def test_rotations_about_one_axis_add_their_angles(build, first, second):
    assert rotations_near(build(first) @ build(second), build(first + second))


@given(displacements(FAR), displacements(FAR), displacements(FAR), vectors())
def test_displacements_form_a_group_that_acts_on_points(p, q, r, point):
    assert same((p @ q) @ r, p @ (q @ r))
    assert same(p @ STILL, p)
    assert same(STILL @ p, p)
    assert same(p @ p.inverse(), STILL)
    assert same(p.inverse() @ p, STILL)
    assert near((p @ q).apply(point), p.apply(q.apply(point)), 4 * FAR)


@given(displacements(FAR), vectors(), vectors())
def test_displacements_keep_distances(motion, a, b):
    moved = motion.apply(a) - motion.apply(b)
    assert moved.norm() == pytest.approx((a - b).norm(), abs=4 * FAR * FEW)


@given(st.floats(0.01, 10.0), ANGLES)
def test_polar_lies_at_its_radius_and_angle(radius, angle):
    point = polar(radius, angle)
    assert point.z == 0.0
    assert point.norm() == pytest.approx(radius, rel=FEW)
    assert math.hypot(point.x - radius * math.cos(angle), point.y - radius * math.sin(angle)) <= FEW * radius
