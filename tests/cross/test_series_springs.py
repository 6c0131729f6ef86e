"""The 5-dof machine, whose passive leg carries one wrench with two springs in series, against plain NumPy."""

import math

import numpy as np
import pytest

from kinetostat.kinetostatics.assembly import compliance_shares, stiffness_shares
from kinetostat.kinetostatics.response import respond
from machines import load_without_limits

NAME = "passive-leg-5dof"
POSES = [(), ("pose.x=-5 cm", "pose.y=8 cm", "pose.theta6=25 deg"), ("pose.theta5=-30 deg", "pose.z=55 cm")]


def by_numpy(legs):
    """K and C leg by leg: W as the null space of J_p^T by SVD, G, then the sum of W G^-1 W^T and its inverse."""
    stiffness = np.zeros((6, 6))
    for leg in legs:
        passive = np.array([twist.components() for twist in leg.passive], dtype=float)
        _, sizes, rows = np.linalg.svd(passive)
        wrenches = rows[np.count_nonzero(sizes > 1e-9) :].T
        elastic = np.array([twist.components() for twist in leg.elastic], dtype=float).T
        yielding = wrenches.T @ elastic @ np.diag(np.array(leg.compliance, dtype=float)) @ elastic.T @ wrenches
        stiffness += wrenches @ np.linalg.inv(yielding) @ wrenches.T
    return stiffness, np.linalg.inv(stiffness)


@pytest.mark.parametrize("pose", POSES)
def test_k_and_c_equal_the_sum_over_legs(pose):
    response = respond(load_without_limits(NAME, pose))
    stiffness, compliance = by_numpy(response.legs)
    assert response.status == 0
    np.testing.assert_allclose(np.array(response.stiffness.rows()), stiffness, rtol=1e-9, atol=1e-9 * stiffness.max())
    np.testing.assert_allclose(np.array(response.compliance.rows()), compliance, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("pose", POSES)
def test_shares_add_up_to_k_and_c(pose):
    response = respond(load_without_limits(NAME, pose))
    for shares, whole in (
        (stiffness_shares(response.statics), response.stiffness),
        (compliance_shares(response.statics), response.compliance),
    ):
        total = sum(np.array(share.rows()) for share in shares)
        np.testing.assert_allclose(total, np.array(whole.rows()), rtol=1e-9, atol=1e-12 * np.abs(total).max())


def test_one_rigid_spring_leaves_the_other_to_yield():
    one = respond(load_without_limits(NAME, ["stiffness.passive_links.0=rigid"]))
    near = respond(load_without_limits(NAME, ["stiffness.passive_links.0=1e18"]))
    assert np.isfinite(np.array(one.stiffness.rows())).all()
    np.testing.assert_allclose(np.array(one.stiffness.rows()), np.array(near.stiffness.rows()), rtol=1e-9, atol=1e-6)


def test_two_rigid_springs_hold_and_one_free_spring_lets_go():
    rigid = respond(load_without_limits(NAME, ["stiffness.passive_links=rigid"]))
    assert math.isinf(rigid.stiffness.entry(2, 2))
    assert rigid.stiffness.entry(3, 3) == pytest.approx(70.61695587, rel=1e-8)
    near = respond(load_without_limits(NAME, ["stiffness.passive_links=1e14"]))
    np.testing.assert_allclose(rigid.compliance.diagonal(), near.compliance.diagonal(), rtol=1e-9)
    free = respond(load_without_limits(NAME, ["stiffness.passive_links.1=0"]))
    assert all(math.isinf(entry) for entry in free.compliance.diagonal())
    assert np.isfinite(np.array(free.stiffness.rows())).all()
    assert np.linalg.matrix_rank(np.array(free.stiffness.rows()), 1e-6) == 5


def test_in_its_own_plane_the_leg_is_that_of_the_4dof_machine():
    """With y = 0 the plane is not tilted: elbow, pitch and reach are those of the paper's passive leg."""
    settings = ["pose.x=0", "pose.z=68 cm", "pose.theta5=-60 deg", "pose.theta6=120 deg"]
    five = load_without_limits(NAME, ["pose.y=0", *settings]).configure()
    four = load_without_limits("zhang-gosselin-4dof", settings).configure()
    ends = zip(five.legs[0].path, four.legs[0].path, strict=True)
    for ours, theirs in ends:
        assert ours.components() == pytest.approx(theirs.components(), abs=1e-15)
    for axis in ("x", "y", "z"):
        ours, theirs = getattr(five.platform.rotation, axis), getattr(four.platform.rotation, axis)
        assert ours.components() == pytest.approx(theirs.components(), abs=1e-15)
