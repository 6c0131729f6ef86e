"""Screws: transport to another point and to other axes, and the power that no transport may change."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry import displacements, rotations, unit_vectors, vectors
from kinetostat.algebra.screw import (
    COMPONENTS,
    Twist,
    Wrench,
    force_along,
    pure_moment,
    rotation_about,
    translation_along,
)
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.machine.leg import Joint
from numeric import U, matrix, screw, twist_transport, vector, wrench_transport

FAR = 2.0
FEW = 64 * U * FAR**2
"""A few dozen roundings of products of coordinates up to 2."""

twists = st.builds(Twist, vectors(), vectors())
wrenches = st.builds(Wrench, vectors(), vectors())


def near(a, b):
    return np.all(abs(screw(a) - screw(b)) <= FEW)


def test_components_are_named_rotation_first():
    assert COMPONENTS == ("rx", "ry", "rz", "x", "y", "z")
    twist = Twist(Vector(1.0, 2.0, 3.0), Vector(4.0, 5.0, 6.0))
    assert twist.components() == (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)


@given(wrenches, twists, vectors(FAR), rotations())
def test_power_does_not_depend_on_point_or_axes(wrench, twist, offset, turn):
    power = wrench.work(twist)
    assert power == pytest.approx(screw(wrench) @ screw(twist), abs=FEW)
    assert wrench.at_offset(offset).work(twist.at_offset(offset)) == pytest.approx(power, abs=FEW)
    assert wrench.turned_by(turn).work(twist.turned_by(turn)) == pytest.approx(power, abs=FEW)


@pytest.mark.parametrize("kind", [Twist, Wrench])
@given(parts=st.tuples(vectors(), vectors()), first=vectors(FAR), second=vectors(FAR), turn=rotations())
def test_transport_is_a_group_action(kind, parts, first, second, turn):
    one = kind(*parts)
    assert near(one.at_offset(first).at_offset(second), one.at_offset(first + second))
    assert near(one.at_offset(first).at_offset(-first), one)
    assert near(one.at_offset(ZERO), one)
    assert near(one.at_offset(first).turned_by(turn), one.turned_by(turn).at_offset(turn.apply(first)))


@given(twists, wrenches, vectors(FAR), rotations())
def test_transport_is_the_adjoint_matrix(twist, wrench, offset, turn):
    q, d = matrix(turn), vector(offset)
    assert np.allclose(screw(twist.turned_by(turn).at_offset(offset)), twist_transport(q, d) @ screw(twist), atol=FEW)
    assert np.allclose(
        screw(wrench.turned_by(turn).at_offset(offset)), wrench_transport(q, d) @ screw(wrench), atol=FEW
    )
    assert np.allclose(wrench_transport(q, d).T @ twist_transport(q, d), np.eye(6), atol=FEW)


@given(twists, twists, st.floats(-10, 10))
def test_screws_are_a_vector_space(a, b, factor):
    assert np.array_equal(screw(a + b), screw(a) + screw(b))
    assert np.array_equal(screw(a - b), screw(a) - screw(b))
    assert np.array_equal(screw(a * factor), screw(a) * factor)
    assert type(a + b) is Twist


@given(unit_vectors(), vectors(), vectors(FAR))
def test_a_point_on_its_axis_does_not_move(axis, arm, along):
    assert near(rotation_about(axis, axis * along.x), Twist(axis, ZERO))
    assert near(rotation_about(axis, arm).at_offset(along), rotation_about(axis, arm + along))
    assert near(translation_along(axis).at_offset(arm), translation_along(axis))


@given(unit_vectors(), vectors(), vectors(FAR))
def test_a_force_has_its_line(axis, arm, along):
    assert near(force_along(axis, arm + axis * along.x), force_along(axis, arm))
    assert near(force_along(axis, arm).at_offset(along), force_along(axis, arm - along))
    assert near(pure_moment(axis).at_offset(arm), pure_moment(axis))


@given(unit_vectors(), unit_vectors(), vectors(), st.floats(-2, 2))
def test_a_force_that_meets_an_axis_does_no_work_on_it(axis, direction, arm, where):
    """Twist at P of a joint at -arm; force through a point of the joint's axis."""
    twist = rotation_about(axis, arm)
    assert force_along(direction, axis * where - arm).work(twist) == pytest.approx(0.0, abs=FEW)


@given(unit_vectors(), vectors(), vectors(), displacements(FAR))
def test_a_displaced_joint_has_the_displaced_twist(axis, point, reference, motion):
    """Moving joint and reference point together turns the twist and nothing else."""
    for joint in (Joint(axis, point), Joint(axis)):
        moved = joint.displaced(motion).twist(motion.apply(reference))
        assert near(moved, joint.twist(reference).turned_by(motion.rotation))
