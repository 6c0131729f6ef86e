"""Legs as screws: what each leg type carries, and that moving a leg moves its screws."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from elastic import leg_compliance
from geometry import displacements, rotations, vectors
from kinetostat.algebra.screw import force_along
from kinetostat.algebra.vector import AXES, X_AXIS, Y_AXIS, Z_AXIS, ZERO, Vector
from kinetostat.kinetostatics.leg import free_springs_as_joints
from kinetostat.machine.leg import Joint, Leg, Spring, revolutes
from kinetostat.machine.leg_screws import reciprocal_wrenches
from kinetostat.machine.link import Beam, Parallelogram, Rigidity
from kinetostat.machine.parts import two_force_leg
from numeric import U, screw

FEW = 1e3 * U
"""Rounding of unit-size screws after a Householder elimination of well-conditioned twists."""
FAR = 2.0


@st.composite
def ends(draw):
    """The joint centres of a leg, not too near to each other."""
    base, platform = draw(vectors()), draw(vectors())
    assume((platform - base).norm() > 0.2)
    return base, platform


@st.composite
def two_force_legs(draw):
    return two_force_leg("leg", *draw(ends()), draw(st.floats(1e2, 1e6)))


def centres(leg):
    """Of its base and of its platform joint."""
    return leg.path[0], leg.path[-1]


def spelled_out(leg):
    """The same leg joint by joint: Hooke, actuated slide, spherical; Hooke axes square to the leg."""
    (spring,) = leg.springs
    base, platform = centres(leg)
    along = spring.joint.axis
    aside = min((axis.cross(along) for axis in AXES), key=lambda v: -v.norm())
    aside = aside * (1.0 / aside.norm())
    hooke = revolutes(base, (aside, along.cross(aside)), "foot")
    return Leg("leg", (*hooke, spring, *revolutes(platform, AXES, "head")))


@given(two_force_legs(), vectors())
def test_a_two_force_leg_carries_a_force_along_its_line(leg, reference):
    screws = leg.screws(reference, 1.0)
    (wrench,) = screws.wrenches
    assert wrench.translational.norm() == pytest.approx(1.0, rel=FEW)
    for joint in centres(leg):
        assert np.allclose(screw(wrench), screw(force_along(wrench.translational, joint - reference)), atol=FEW)
    assert max(abs(wrench.work(twist)) for twist in screws.passive) <= FEW
    assert wrench.work(screws.elastic[0]) == pytest.approx(1.0, rel=FEW)
    assert screws.loads == ((1.0,),)
    assert screws.compliance == (1.0 / leg.springs[0].stiffness,)
    assert leg.actuated


@given(ends(), st.floats(1e2, 1e6), st.floats(1e2, 1e6))
def test_its_rod_yields_over_its_whole_length(points, stiffness, axial):
    """1 / Ka + length / EA, in a row."""
    leg = two_force_leg("leg", *points, stiffness, axial)
    assert [spring.actuated for spring in leg.springs] == [True, False]
    assert len({spring.name for spring in leg.springs}) == 2
    length = (points[1] - points[0]).norm()
    expected = 1.0 / stiffness + length / axial
    assert leg_compliance(leg.screws(ZERO, 1.0)) == [[pytest.approx(expected, rel=FEW)]]


def test_a_rigid_rod_leaves_no_spring():
    assert len(two_force_leg("leg", ZERO, X_AXIS, 1e3, math.inf).springs) == 1


@given(two_force_legs(), vectors(), st.floats(0.1, 10.0))
def test_the_general_chain_finds_the_same_wrench(leg, reference, length):
    """Closed form against the general form: the reciprocal space of five joints, whatever the length that scales it."""
    chain = spelled_out(leg).screws(reference, length)
    (found,), (known,) = chain.wrenches, leg.screws(reference, length).wrenches
    assume(chain.singularity_margin > 0.01)
    factor = found.work(chain.elastic[0])
    assert chain.loads == ((pytest.approx(factor),),)
    assert np.allclose(screw(found * (1.0 / factor)), screw(known), rtol=0, atol=100 * FEW)


def any_leg(base, platform):
    """One element of every kind."""
    middle = (base + platform) * 0.5 + Z_AXIS * 0.3
    chain = (
        Joint(X_AXIS, base, "foot"),
        Spring("bending", Joint(Y_AXIS, base), 1e3),
        Beam("beam", base, middle, Vector(0.2, 0.9, 0.1), Rigidity(1e6, 1e3, 1e3, 2e3)),
        Joint(Y_AXIS, middle, "screw", pitch=0.02),
        Parallelogram("bars", middle, platform, Vector(0.6, 0.0, 0.8), 0.1, 1e6),
        Joint(Y_AXIS, None, "slide"),
    )
    return Leg("leg", chain)


@given(ends(), vectors(), displacements(FAR))
def test_a_moved_chain_has_moved_screws(points, reference, motion):
    """Passive and elastic twists, stiffnesses and path of every kind of element go with the machine."""
    leg = any_leg(*points)
    moved, still = leg.displaced(motion), leg
    assert moved.name == still.name
    assert [s.name for s in moved.springs] == [s.name for s in still.springs]
    before = [
        j.twist(reference).turned_by(motion.rotation) for j in (*still.passive, *(s.joint for s in still.springs))
    ]
    after = [j.twist(motion.apply(reference)) for j in (*moved.passive, *(s.joint for s in moved.springs))]
    for ours, theirs in zip(after, before, strict=True):
        assert np.allclose(screw(ours), screw(theirs), rtol=0, atol=100 * FEW)
    stiffness = [s.stiffness for s in still.springs]
    assert [s.stiffness for s in moved.springs] == pytest.approx(stiffness, rel=1e-9)
    assert len(moved.path) == len(still.path)
    for here, there in zip(moved.path, still.path, strict=True):
        assert here.components() == pytest.approx(motion.apply(there).components(), abs=100 * FEW)


@given(st.floats(-0.1, 0.1), vectors())
def test_a_screw_joint_advances_as_it_turns(pitch, reference):
    twist = Joint(Z_AXIS, X_AXIS, pitch=pitch).twist(reference)
    turning = Joint(Z_AXIS, X_AXIS).twist(reference)
    assert screw(twist) == pytest.approx(screw(turning) + np.array([0, 0, 0, 0, 0, pitch]), abs=FEW)


@given(two_force_legs(), vectors(), displacements(FAR))
def test_a_moved_leg_has_moved_screws(leg, reference, motion):
    moved = leg.displaced(motion).screws(motion.apply(reference), 1.0)
    for after, before in zip(moved.wrenches, leg.screws(reference, 1.0).wrenches, strict=True):
        assert np.allclose(screw(after), screw(before.turned_by(motion.rotation)), atol=100 * FEW)


@given(st.integers(1, 5), st.data())
def test_reciprocal_wrenches_do_no_work_and_miss_nothing(count, data):
    joints = [
        Joint(turn.z, None if data.draw(st.booleans()) and i > 2 else data.draw(vectors()))
        for i, turn in enumerate(data.draw(rotations()) for _ in range(count))
    ]
    twists = [joint.twist(ZERO) for joint in joints]
    assume(np.linalg.svd(np.array([screw(t) for t in twists]), compute_uv=False)[-1] > 1e-2)
    wrenches, singularity_margin = reciprocal_wrenches(twists, 1.0)
    assert len(wrenches) == 6 - count
    assert max(abs(w.work(t)) for w in wrenches for t in twists) <= FEW
    assert np.linalg.matrix_rank(np.array([screw(w) for w in wrenches])) == 6 - count
    assert 0.0 < singularity_margin <= 1.0


def test_joints_that_coincide_lock_up():
    twice = revolutes(ZERO, (X_AXIS, X_AXIS))
    _, singularity_margin = reciprocal_wrenches([joint.twist(Vector(0.0, 1.0, 0.0)) for joint in twice], 1.0)
    assert singularity_margin <= FEW


def post(stiffness):
    """A vertical post of 2 m with a Hooke joint at its end: bending springs at its foot, in two planes."""
    foot = Vector(0.0, 0.0, -2.0)
    springs = tuple(Spring(f"bend {i}", Joint(axis, foot), stiffness[i]) for i, axis in enumerate((X_AXIS, Y_AXIS)))
    return Leg("post", (*springs, *revolutes(ZERO, AXES), Joint(Z_AXIS))).screws(ZERO, 1.0)


def test_a_post_yields_by_its_arm_squared():
    """G of a cantilever: arm^2 / k for each sideways force."""
    screws = post((100.0, 400.0))
    forces = np.array([screw(w)[3:5] for w in screws.wrenches])
    expected = forces @ np.diag([4.0 / 400.0, 4.0 / 100.0]) @ forces.T
    assert np.allclose(leg_compliance(screws), expected, rtol=0, atol=FEW)
    assert np.allclose(abs(np.array(screws.loads) @ np.linalg.inv(forces).T), [[0.0, 2.0], [2.0, 0.0]], atol=FEW)


def test_a_rigid_post_does_not_yield():
    assert np.array_equal(leg_compliance(post((math.inf, math.inf))), np.zeros((2, 2)))


def test_a_planar_leg_carries_nothing_out_of_its_plane():
    """R-P-R in the x-y plane: five twists with those that are absent, and one force along the leg."""
    leg = Leg("leg", (Joint(Z_AXIS, ZERO), Spring("a", Joint(X_AXIS), 1e3), Joint(Z_AXIS, X_AXIS)))
    absent = (Joint(X_AXIS, ZERO), Joint(Y_AXIS, ZERO), Joint(Z_AXIS))
    screws = leg.screws(Y_AXIS, 1.0, absent)
    (wrench,) = screws.wrenches
    assert len(screws.passive) == 5
    assert screw(wrench) / screw(wrench)[3] == pytest.approx([0, 0, 1, 1, 0, 0], abs=FEW)


def span(wrenches):
    """Projector onto what the wrenches span [6 x 6]."""
    basis = np.linalg.qr(np.array([screw(w) for w in wrenches]).T)[0] if wrenches else np.zeros((6, 1))
    return basis @ basis.T


class TestRelaxed:
    """A free spring is a passive joint: the same leg written so carries the same, and yields the same."""

    CHAIN = (
        Joint(X_AXIS, ZERO, "foot"),
        Spring("bend y", Joint(Y_AXIS, ZERO), 2e3),
        Spring("twist", Joint(Z_AXIS, ZERO), 3e3),
        Spring("stretch", Joint(Vector(0.6, 0.0, 0.8)), 4e5),
        Spring("bend z", Joint(Vector(0.8, 0.0, -0.6), Vector(0.6, 0.0, 0.8)), 5e3),
    )

    @pytest.mark.parametrize("freed", [(1,), (3,), (1, 4), (1, 2, 3, 4)])
    def test_it_is_the_leg_with_a_joint_instead(self, freed):
        free = [Spring(e.name, e.joint, 0.0) if i in freed else e for i, e in enumerate(self.CHAIN)]
        jointed = [e.joint if i in freed else e for i, e in enumerate(self.CHAIN)]
        tip = Vector(0.1, 0.2, 0.5)
        found = free_springs_as_joints(Leg("leg", tuple(free)).screws(tip, 1.0))
        known = Leg("leg", tuple(jointed)).screws(tip, 1.0)
        assert len(found.wrenches) == len(known.wrenches) == 5 - len(freed)
        assert np.allclose(span(found.wrenches), span(known.wrenches), rtol=0, atol=FEW)
        yielding = [np.array(leg_compliance(leg)) for leg in (found, known)]
        carried = [np.array([screw(w) for w in leg.wrenches]) for leg in (found, known)]
        across = carried[0] @ np.linalg.pinv(carried[1])
        assert yielding[0] == pytest.approx(across @ yielding[1] @ across.T, rel=1e-9, abs=1e-15)
        assert found.singularity_margin > 0.01

    def test_its_free_springs_feel_nothing(self):
        free = [Spring(e.name, e.joint, 0.0) if i == 3 else e for i, e in enumerate(self.CHAIN)]
        found = free_springs_as_joints(Leg("leg", tuple(free)).screws(ZERO, 1.0))
        assert set(found.loads[2]) == {0.0}
        assert found.compliance[2] == 0.0
        assert len(found.loads) == len(found.compliance) == 4

    def test_a_leg_without_free_springs_is_itself(self):
        screws = Leg("leg", self.CHAIN).screws(ZERO, 1.0)
        assert free_springs_as_joints(screws) is screws

    def test_a_spring_that_is_nearly_free_is_kept(self):
        soft = [Spring(e.name, e.joint, 1e-300) if i == 3 else e for i, e in enumerate(self.CHAIN)]
        screws = Leg("leg", tuple(soft)).screws(ZERO, 1.0)
        assert free_springs_as_joints(screws) is screws

    def test_a_free_spring_that_feels_no_load_frees_nothing(self):
        idle = (*self.CHAIN, Spring("idle", Joint(X_AXIS, ZERO), 0.0))
        found = free_springs_as_joints(Leg("leg", idle).screws(Vector(0.1, 0.2, 0.5), 1.0))
        assert len(found.wrenches) == 5

    def test_two_free_springs_about_one_axis_free_it_once(self):
        twice = (*self.CHAIN[:2], Spring("one", Joint(Z_AXIS, ZERO), 0.0), Spring("two", Joint(Z_AXIS, ZERO), 0.0))
        found = free_springs_as_joints(Leg("leg", (*twice, *self.CHAIN[3:])).screws(Vector(0.1, 0.2, 0.5), 1.0))
        assert len(found.wrenches) == 4
        assert found.singularity_margin > 0.01

    def test_a_limp_leg_carries_nothing(self):
        limp = [self.CHAIN[0], *(Spring(f"s{i}", Joint(axis, ZERO), 0.0) for i, axis in enumerate(AXES))]
        limp += [Spring(f"t{i}", Joint(axis), 0.0) for i, axis in enumerate(AXES)]
        found = free_springs_as_joints(Leg("leg", tuple(limp)).screws(ZERO, 1.0))
        assert found.wrenches == ()
        assert len(found.loads) == 6
