"""Centres of stiffness, compliance and elasticity: fixed in the machine, wherever P is and however it is turned."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from elastic import (
    PLANE,
    compliance_at,
    cross,
    offsets,
    spring_matrix,
    stiffness_at,
    stiffnesses,
    turns,
    wrench_moved,
)
from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.algebra.vector import Vector
from kinetostat.kinetostatics.eigenscrews import (
    centre_of_compliance,
    centre_of_elasticity,
    centre_of_stiffness,
)

STABLE = 1e-7
"""Rounding times the condition of K, 1e6 at most, times a factor for that of a block; m, for machines below 1 m."""


def centres(stiffness, compliance):
    """All by both routes, the first four in the order in which they must stay."""
    return [
        centre_of_stiffness(stiffness),
        centre_of_compliance(compliance),
        centre_of_elasticity(stiffness, None),
        centre_of_elasticity(None, compliance),
    ]


@given(stiffnesses)
def test_the_coupling_is_symmetric_at_its_centre(stiffness):
    compliance = np.linalg.inv(stiffness)
    there = stiffness_at(stiffness, centre_of_stiffness(stiffness))
    assert np.allclose(there[:3, 3:], there[3:, :3].T)
    assert np.allclose(there[:3, 3:], there[:3, 3:].T, rtol=0, atol=STABLE * np.abs(stiffness[3:]).max())
    there = compliance_at(compliance, centre_of_compliance(compliance))
    assert np.allclose(there[:3, 3:], there[:3, 3:].T, rtol=0, atol=STABLE * np.abs(compliance[:3]).max())


@given(stiffnesses, turns, offsets)
def test_centres_move_with_the_machine_and_not_with_the_reference_point(stiffness, rotation, offset):
    moved = wrench_moved(rotation, offset)
    turned = moved @ stiffness @ moved.T
    before = centres(stiffness, np.linalg.inv(stiffness))
    after = centres(turned, np.linalg.inv(turned))
    for a, b in zip(before, after, strict=True):
        assert np.allclose(rotation @ a - offset, b, rtol=0, atol=STABLE * max(1.0, *np.abs(a)))


def balance(axes):
    """Sum of the perpendiculars from P onto lines, each given by a line vector and its moment about P."""
    return sum(np.cross(line, moment) / (line @ line) for line, moment in axes)


@given(stiffnesses)
def test_perpendiculars_onto_the_compliant_axes_balance_at_the_centre_of_elasticity(stiffness):
    """Patterson and Lipkin's definition itself: both triples of lines, from their eigenvectors."""
    compliance = np.linalg.inv(stiffness)
    centre = centre_of_elasticity(stiffness, compliance)
    assert np.allclose(centre_of_elasticity(None, compliance), centre, rtol=0, atol=STABLE)
    there, soft = stiffness_at(stiffness, centre), compliance_at(compliance, centre)
    translations, rotations = np.linalg.eigh(there[3:, 3:])[1].T, np.linalg.eigh(soft[:3, :3])[1].T
    forces = [(there[3:, 3:] @ n, there[:3, 3:] @ n) for n in translations]
    turnings = [(soft[:3, :3] @ n, soft[3:, :3] @ n) for n in rotations]
    assert np.allclose(balance(forces), 0.0, atol=STABLE)
    assert np.allclose(balance(turnings), 0.0, atol=STABLE)


@given(stiffnesses, offsets)
def test_referring_agrees_with_twists_and_wrenches(stiffness, offset):
    twist = Twist(Vector(1.0, -2.0, 0.5), Vector(0.3, 0.1, -0.7))
    load = Wrench(*(Vector(*part.tolist()) for part in np.split(stiffness @ twist.components(), 2)))
    arm = Vector(*offset.tolist())
    there = np.array(load.at_offset(arm).components())
    found = stiffness_at(stiffness, offset)
    assert np.allclose(found @ twist.at_offset(arm).components(), there, rtol=0, atol=1e-12 * np.abs(found).max())
    assert np.allclose(stiffness_at(found, -offset), stiffness, rtol=0, atol=1e-12 * np.abs(found).max())
    assert np.allclose(compliance_at(np.linalg.inv(stiffness), offset) @ found, np.eye(6), atol=1e-6)


@given(offsets)
def test_an_isotropic_machine_has_all_centres_in_one_point(offset):
    """Equal eigenvalues are no degeneracy of the centre."""
    stiffness = stiffness_at(np.diag([5.0, 5.0, 5.0, 2.0, 2.0, 2.0]), -offset)
    for found in centres(stiffness, np.linalg.inv(stiffness)):
        assert np.allclose(found, offset, atol=1e-12)


def test_springs_along_one_direction_have_no_centre():
    forces = [np.array([*np.cross(r, [0, 0, 1]), 0, 0, 1.0]) for r in ([1, 0, 0], [0, 1, 0], [-1, -1, 0])]
    stiffness = sum(np.outer(w, w) for w in forces)
    assert centre_of_stiffness(stiffness) is None
    assert centre_of_elasticity(stiffness, None) is None
    across = stiffness + np.diag([0, 0, 0, 0.0, 1.0, 0.0])
    assert np.allclose(centre_of_stiffness(across), stiffness_centre_of(across))
    assert centre_of_elasticity(across, None) is None


def stiffness_centre_of(stiffness):
    """By least squares on the nine entries of the skew part."""
    columns = [(cross(e) @ stiffness[3:, 3:] + stiffness[3:, 3:] @ cross(e)).ravel() for e in np.eye(3)]
    right = (stiffness[:3, 3:] - stiffness[:3, 3:].T).ravel()
    return np.linalg.lstsq(np.array(columns).T, right, rcond=None)[0]


@given(turns, offsets)
def test_rigid_machines_have_a_centre_of_compliance(rotation, offset):
    """A rigid body on a Hooke joint with springs: C has rank 2, K is infinite, and the centre is the joint's."""
    moved = np.linalg.inv(wrench_moved(rotation, offset)).T
    compliance = moved @ np.diag([1e-3, 4e-3, 0.0, 0.0, 0.0, 0.0]) @ moved.T
    assert np.allclose(centre_of_compliance(compliance), -offset, atol=1e-12)
    for endless in (None, np.full((6, 6), math.inf)):
        assert centre_of_stiffness(endless) is None
        assert centre_of_elasticity(endless, compliance) is None
    hinge = moved @ np.diag([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0]) @ moved.T
    assert centre_of_compliance(hinge) is None
    assert centre_of_compliance(np.zeros((6, 6))) is None


@given(st.integers(0, 1000))
def test_in_the_plane_a_force_through_the_one_centre_causes_no_rotation(seed):
    stiffness = spring_matrix(seed, 8)[np.ix_(PLANE, PLANE)]
    compliance = np.linalg.inv(stiffness)
    found = [
        centre_of_stiffness(stiffness, PLANE),
        centre_of_compliance(compliance, PLANE),
        centre_of_elasticity(stiffness, None, PLANE),
        centre_of_elasticity(None, compliance, PLANE),
    ]
    for centre in found:
        assert centre[2] == 0.0
        assert np.allclose(centre, found[0], rtol=0, atol=STABLE * max(1.0, *np.abs(centre)))
    x, y, _ = found[0]
    for force in ([1.0, 0.0], [0.0, 1.0]):
        rotation = (compliance @ [x * force[1] - y * force[0], *force])[0]
        assert abs(rotation) <= 1e-9 * compliance[0, 0] * max(1.0, abs(x), abs(y))


def test_a_planar_machine_with_one_free_translation_has_no_centre_of_stiffness():
    assert centre_of_stiffness(np.diag([1.0, 1.0, 0.0]), PLANE) is None
    assert centre_of_elasticity(np.diag([1.0, 1.0, 0.0]), None, PLANE) is None
    assert centre_of_compliance(np.diag([0.0, 1.0, 1.0]), PLANE) is None


def test_what_has_no_centre_is_refused():
    with pytest.raises(ValueError, match="space or in the plane"):
        centre_of_stiffness(np.eye(3), (0, 1, 2))
    with pytest.raises(ValueError, match="6 components"):
        centre_of_compliance(np.eye(3))
