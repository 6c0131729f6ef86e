"""Legs as screws: what each leg type carries, and that moving a leg moves its screws."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from geometry import displacements, rotations, vectors
from kinetostat.algebra.screw import force_along
from kinetostat.algebra.vector import X_AXIS, Y_AXIS, Z_AXIS, ZERO, Vector
from kinetostat.kinetostatics.leg import leg_compliance, loads
from kinetostat.machine.leg import Joint, SerialLeg, Spring, TwoForceLeg, reciprocal_wrenches, revolutes
from numeric import U, screw

AXES = (X_AXIS, Y_AXIS, Z_AXIS)
FEW = 1e3 * U
"""Rounding of unit-size screws after a Householder elimination of well-conditioned twists."""
FAR = 2.0


@st.composite
def two_force_legs(draw):
    base, platform = draw(vectors()), draw(vectors())
    assume((platform - base).norm() > 0.2)
    return TwoForceLeg("leg", base, platform, draw(st.floats(1e2, 1e6)))


def spelled_out(leg):
    """The same leg joint by joint: Hooke, actuated slide, spherical; Hooke axes square to the leg."""
    (spring,) = leg.springs
    along = spring.joint.axis
    aside = min((axis.cross(along) for axis in AXES), key=lambda v: -v.norm())
    aside = aside * (1.0 / aside.norm())
    hooke = revolutes(leg.base_joint, (aside, along.cross(aside)))
    return SerialLeg("leg", (*hooke, *revolutes(leg.platform_joint, AXES)), (spring,))


@given(two_force_legs(), vectors())
def test_a_two_force_leg_carries_a_force_along_its_line(leg, reference):
    screws = leg.screws(reference, 1.0)
    (wrench,) = screws.wrenches
    assert wrench.translational.norm() == pytest.approx(1.0, rel=FEW)
    for joint in (leg.base_joint, leg.platform_joint):
        assert np.allclose(screw(wrench), screw(force_along(wrench.translational, joint - reference)), atol=FEW)
    assert max(abs(wrench.work(twist)) for twist in screws.passive) <= FEW
    assert wrench.work(screws.elastic[0]) == pytest.approx(1.0, rel=FEW)
    assert screws.compliance == (1.0 / leg.stiffness,)


@given(two_force_legs(), vectors(), st.floats(0.1, 10.0))
def test_the_general_chain_finds_the_same_wrench(leg, reference, length):
    """Closed form against the general form: the reciprocal space of five joints, whatever the length that scales it."""
    chain = spelled_out(leg).screws(reference, length)
    (found,), (known,) = chain.wrenches, leg.screws(reference, length).wrenches
    assume(chain.regularity > 0.01)
    factor = found.work(chain.elastic[0])
    assert np.allclose(screw(found * (1.0 / factor)), screw(known), rtol=0, atol=100 * FEW)


@given(two_force_legs(), vectors(), displacements(FAR))
def test_a_moved_leg_has_moved_screws(leg, reference, motion):
    moved = leg.displaced(motion).screws(motion.apply(reference), 1.0)
    for after, before in zip(moved.wrenches, leg.screws(reference, 1.0).wrenches, strict=True):
        assert np.allclose(screw(after), screw(before.rotated(motion.rotation)), atol=100 * FEW)


@given(st.integers(1, 5), st.data())
def test_reciprocal_wrenches_do_no_work_and_miss_nothing(count, data):
    joints = [
        Joint(turn.z, None if data.draw(st.booleans()) and i > 2 else data.draw(vectors()))
        for i, turn in enumerate(data.draw(rotations()) for _ in range(count))
    ]
    twists = [joint.twist(ZERO) for joint in joints]
    assume(np.linalg.svd(np.array([screw(t) for t in twists]), compute_uv=False)[-1] > 1e-2)
    wrenches, regularity = reciprocal_wrenches(twists, 1.0)
    assert len(wrenches) == 6 - count
    assert max(abs(w.work(t)) for w in wrenches for t in twists) <= FEW
    assert np.linalg.matrix_rank(np.array([screw(w) for w in wrenches])) == 6 - count
    assert 0.0 < regularity <= 1.0


def test_joints_that_coincide_lock_up():
    twice = revolutes(ZERO, (X_AXIS, X_AXIS))
    _, regularity = reciprocal_wrenches([joint.twist(Vector(0.0, 1.0, 0.0)) for joint in twice], 1.0)
    assert regularity <= FEW


def two_spring_leg(stiffness):
    """A vertical post of 2 m with a Hooke joint at its end: bending springs at its foot, in two planes."""
    joints = (*revolutes(ZERO, AXES), Joint(Z_AXIS))
    foot = Vector(0.0, 0.0, -2.0)
    springs = tuple(Spring(f"bend {i}", Joint(axis, foot), stiffness[i]) for i, axis in enumerate((X_AXIS, Y_AXIS)))
    return SerialLeg("post", joints, springs).screws(ZERO, 1.0)


def test_a_post_yields_by_its_arm_squared():
    """G of a cantilever: arm^2 / k for each sideways force."""
    screws = two_spring_leg((100.0, 400.0))
    forces = np.array([screw(w)[3:5] for w in screws.wrenches])
    expected = forces @ np.diag([4.0 / 400.0, 4.0 / 100.0]) @ forces.T
    assert np.allclose(leg_compliance(screws), expected, rtol=0, atol=FEW)
    assert np.allclose(abs(np.array(loads(screws)) @ np.linalg.inv(forces).T), [[0.0, 2.0], [2.0, 0.0]], atol=FEW)


def test_a_rigid_post_does_not_yield():
    assert np.array_equal(leg_compliance(two_spring_leg((float("inf"), float("inf")))), np.zeros((2, 2)))
