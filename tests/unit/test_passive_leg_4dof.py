"""Kinematics of the paper's 4-dof machine: its closed form against moving the pose a little."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry import about_x, about_y
from kinetostat.algebra.vector import Y_AXIS
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import values, with_values
from machines import CASES, machines
from numeric import matrix, screw, vector

CASE = next(case for case in CASES if case.name == "zhang-gosselin-4dof")
TASK = ("pose.x", "pose.z", "pose.theta5", "pose.theta6")
STEP = 1e-5
DIFFERENCED = 1e-8
"""Central differences: STEP^2 of truncation and the rounding unit over STEP, both about 1e-10, times a margin."""
designs = machines(CASE).map(lambda machine: with_values(machine, {"stiffness.passive_actuator": 0.0}))


def actuated(machine):
    return [leg for leg in machine.configure().legs if leg.name != "passive leg"]


def passive(machine):
    (leg,) = [leg for leg in machine.configure().legs if leg.name == "passive leg"]
    return leg


def joints(leg):
    """Centres of the joints of an actuated leg, at base and platform."""
    base, platform = leg.path
    return base, platform


def length(leg):
    base, platform = joints(leg)
    return (platform - base).norm()


def neighbours(machine, path):
    at = values(machine)[path]
    return with_values(machine, {path: at - STEP}), with_values(machine, {path: at + STEP})


def twist(machine, path):
    """Platform twist per unit of one task coordinate, by moving it."""
    before, after = (m.configure().platform for m in neighbours(machine, path))
    spin = (matrix(after.rotation) - matrix(before.rotation)) @ matrix(machine.configure().platform.rotation).T
    spin /= 2 * STEP
    velocity = vector(after.translation - before.translation) / (2 * STEP)
    return np.array([spin[2, 1], spin[0, 2], spin[1, 0], *velocity])


def test_the_reference_pose_has_the_published_leg_lengths():
    """REFERENCE.md; with both links 68 cm, P straight above O and theta5 = -60 deg, el2 is 150 deg and the pitch 0."""
    machine = load(CASE.name)
    assert [length(leg) for leg in actuated(machine)] == pytest.approx(
        [0.797602, 0.764484, 0.665658, 0.625594], abs=5e-7
    )
    assert np.allclose(matrix(machine.configure().platform.rotation), matrix(about_x(math.radians(120))), atol=1e-15)
    elbow = passive(machine).passive[1].point
    assert elbow.components() == pytest.approx((0.68 * math.cos(math.pi / 6), 0.0, 0.34))


@given(designs)
def test_the_links_have_their_lengths_and_the_joints_their_places(machine):
    foot, elbow, tip, last = passive(machine).passive
    links = machine.tables["geometry"].passive_links
    assert ((elbow.point - foot.point).norm(), (tip.point - elbow.point).norm()) == pytest.approx(links, rel=1e-12)
    assert elbow.point.y == foot.point.y == tip.point.y == machine.tables["geometry"].passive_leg_offset
    assert tip.point == last.point == machine.configure().platform.translation
    assert foot.axis == elbow.axis == tip.axis == Y_AXIS
    assert (tip.point - elbow.point).cross(elbow.point - foot.point).y > 0.0, "the elbow has changed sides"


@given(designs)
def test_the_orientation_is_pitch_then_roll(machine):
    """Q = Ry(90 deg - el2 - theta5) Rx(theta6), with el2 measured on the placed leg."""
    _, elbow, tip, last = passive(machine).passive
    link = tip.point - elbow.point
    pitch = math.pi / 2 - math.atan2(link.z, link.x) - machine.tables["pose"].theta5
    expected = about_y(pitch) @ about_x(machine.tables["pose"].theta6)
    assert np.allclose(matrix(machine.configure().platform.rotation), matrix(expected), atol=1e-13)
    assert np.allclose(vector(last.axis), vector(about_y(pitch).x), atol=1e-13)


@given(designs, st.sampled_from(TASK))
def test_the_platform_moves_only_as_the_passive_leg_allows(machine, path):
    screws = passive(machine).screws(machine.configure().platform.translation, 1.0)
    moved = twist(machine, path)
    work = [screw(wrench) @ moved for wrench in screws.wrenches]
    assert np.all(np.abs(work) <= DIFFERENCED * (1 + np.linalg.norm(moved)))


@given(designs, st.sampled_from(TASK))
def test_leg_lengths_change_as_their_wrenches_say(machine, path):
    """d(length)/dq = w . t: the rows of A over rho (paper eqs. 1-4)."""
    reference = machine.configure().platform.translation
    moved = twist(machine, path)
    before, after = (actuated(m) for m in neighbours(machine, path))
    for leg, short, long in zip(actuated(machine), before, after, strict=True):
        rate = (length(long) - length(short)) / (2 * STEP)
        (wrench,) = leg.screws(reference, 1.0).wrenches
        assert rate == pytest.approx(screw(wrench) @ moved, abs=DIFFERENCED * (1 + np.linalg.norm(moved)))


@given(designs)
def test_virtual_joints_bend_their_links_out_of_plane(machine):
    """Springs at the lower ends, in the x-z plane and square to their links."""
    leg = passive(machine)
    ends = [joint.point for joint in leg.passive[:3]]
    for spring, low, high in zip(leg.springs, ends, ends[1:], strict=False):
        assert spring.joint.point == low
        assert spring.joint.axis.y == 0.0
        assert spring.joint.axis.norm() == pytest.approx(1.0, rel=1e-12)
        assert spring.joint.axis.dot(high - low) == pytest.approx(0.0, abs=1e-12)


def test_joints_lie_at_the_angles_of_the_paper():
    machine = load(CASE.name)
    angles = [math.degrees(math.atan2(joints(leg)[0].y, joints(leg)[0].x)) for leg in actuated(machine)]
    assert angles == pytest.approx([30, 120, -120, -30])
    turn, tip = machine.configure().platform.rotation, machine.configure().platform.translation
    local = [turn.inverse().apply(joints(leg)[1] - tip) for leg in actuated(machine)]
    assert [math.degrees(math.atan2(p.y, p.x)) for p in local] == pytest.approx([60, 150, -150, -60])
    assert [p.norm() for p in local] == pytest.approx([0.12] * 4)
