"""Stiffness by direction: the extremes bound every direction, K and C say the same, rigid and free are exact."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from elastic import PLANE, cross, directions, spring_matrix, stiffnesses, turns, wrench_moved
from kinetostat import analyze, load
from kinetostat.algebra.symmetric import POSITIONS, Symmetric6
from kinetostat.kinetostatics.indices import (
    finite,
    free_stiffness_along,
    free_stiffnesses,
    guided_stiffness_along,
    guided_stiffnesses,
    principal_compliances,
)
from kinetostat.machine.parameters import with_values

BLOCKS = (("rotation", slice(0, 3)), ("translation", slice(3, 6)))
SENSES = (free_stiffnesses, guided_stiffnesses)
ALONG = ((free_stiffness_along, free_stiffnesses), (guided_stiffness_along, guided_stiffnesses))
both = pytest.mark.parametrize(("along", "principal"), ALONG)
block_names = st.sampled_from(["rotation", "translation"])
STABLE = 1e-9
"""Rounding times the condition number of K, which `stiffnesses` holds below 1e6."""


@given(stiffnesses, directions)
def test_principal_compliances_are_the_extremes_of_all_directions(stiffness, n):
    compliance = np.linalg.inv(stiffness)
    for name, rows in BLOCKS:
        block, found = compliance[rows, rows], principal_compliances(compliance)[name]
        size = found.compliances[-1]
        assert found.compliances.tolist() == sorted(found.compliances)
        assert found.compliances[0] - STABLE * size <= n @ block @ n <= size * (1 + STABLE)
        for value, direction in zip(found.compliances, found.directions, strict=True):
            assert np.allclose(block @ direction, value * np.array(direction), rtol=0, atol=STABLE * size)


def test_a_symmetric_matrix_serves_as_rows_do():
    stiffness = spring_matrix(1, 8)
    packed = Symmetric6(tuple(float(stiffness[i, j]) for i, j in POSITIONS))
    assert np.array_equal(finite(packed), finite(stiffness.tolist()))
    assert guided_stiffnesses(packed, None) == guided_stiffnesses(stiffness, None)


@pytest.mark.parametrize("principal", SENSES)
@given(stiffnesses)
def test_stiffness_and_compliance_give_the_same_ellipsoids(principal, stiffness):
    compliance = np.linalg.inv(stiffness)
    from_k, from_c = principal(stiffness, None), principal(None, compliance)
    for name, _ in BLOCKS:
        assert from_k[name].stiffnesses.tolist() == sorted(from_k[name].stiffnesses)
        assert from_k[name].stiffnesses == pytest.approx(from_c[name].stiffnesses, rel=STABLE)
        size = from_k[name].stiffnesses[-1]
        assert np.allclose(form(from_k[name]), form(from_c[name]), rtol=0, atol=STABLE * size)


def form(principal):
    """The matrix that the principal stiffnesses and directions make [3 x 3]."""
    return sum(k * np.outer(n, n) for k, n in zip(principal.stiffnesses, principal.directions, strict=True))


@given(stiffnesses)
def test_free_is_one_over_the_compliance_and_guided_the_block_of_k(stiffness):
    compliance = np.linalg.inv(stiffness)
    soft, held = free_stiffnesses(stiffness, compliance), guided_stiffnesses(stiffness, compliance)
    for name, rows in BLOCKS:
        assert [1.0 / c for c in principal_compliances(compliance)[name].compliances] == pytest.approx(
            soft[name].stiffnesses[::-1], rel=STABLE
        )
        assert held[name].stiffnesses == pytest.approx(np.linalg.eigvalsh(stiffness[rows, rows]), rel=STABLE)
        assert all(f <= g * (1 + STABLE) for f, g in zip(soft[name].stiffnesses, held[name].stiffnesses, strict=True))


@both
@given(stiffnesses, directions, block_names)
def test_the_principal_stiffnesses_bound_every_direction(along, principal, stiffness, n, block):
    compliance = np.linalg.inv(stiffness)
    found = principal(stiffness, compliance)[block]
    value = along(n, block, stiffness, compliance)
    assert found.stiffnesses[0] * (1 - STABLE) <= value <= found.stiffnesses[-1] * (1 + STABLE)
    for stiff, direction in zip(found.stiffnesses, found.directions, strict=True):
        assert along(direction, block, stiffness, compliance) == pytest.approx(stiff, rel=STABLE)


@given(stiffnesses, directions, st.floats(0.1, 10.0), block_names)
def test_stiffness_along_a_direction_is_the_quadratic_form(stiffness, n, size, block):
    compliance, rows = np.linalg.inv(stiffness), dict(BLOCKS)[block]
    free, held = 1.0 / (n @ compliance[rows, rows] @ n), n @ stiffness[rows, rows] @ n
    for given_k, given_c in ((stiffness, None), (None, compliance), (stiffness, compliance)):
        assert free_stiffness_along(n * size, block, given_k, given_c) == pytest.approx(free, rel=1e-8)
        assert guided_stiffness_along(n * size, block, given_k, given_c) == pytest.approx(held, rel=1e-8)
    assert free <= held * (1 + STABLE)


@both
@given(stiffnesses, directions, turns, block_names)
def test_the_machine_turned_is_as_stiff_along_the_direction_turned(along, principal, stiffness, n, rotation, block):
    moved = wrench_moved(rotation, np.zeros(3))
    turned = moved @ stiffness @ moved.T
    assert along(rotation @ n, block, turned, None) == pytest.approx(along(n, block, stiffness, None), rel=1e-8)


@given(turns)
def test_rigid_directions_are_infinitely_stiff(rotation):
    """C of a platform on a slide along a (turned) x with a hinge about z: all else is rigid."""
    moved = wrench_moved(rotation, np.zeros(3))
    compliance = moved @ np.diag([0.0, 0.0, 1e-3, 1e-6, 0.0, 0.0]) @ moved.T
    endless = np.full((6, 6), math.inf)
    for missing in (None, endless):
        for principal in SENSES:
            found = principal(missing, compliance)
            assert found["rotation"].stiffnesses == pytest.approx([1e3, math.inf, math.inf])
            assert found["translation"].stiffnesses == pytest.approx([1e6, math.inf, math.inf])
            assert abs(found["translation"].directions[0] @ rotation[:, 0]) == pytest.approx(1.0)
        oblique = rotation @ [0.6, 0.8, 0.0]
        assert free_stiffness_along(oblique, "translation", missing, compliance) == pytest.approx(1e6 / 0.36)
        assert guided_stiffness_along(oblique, "translation", missing, compliance) == math.inf
        for along, _ in ALONG:
            assert along(rotation[:, 0], "translation", missing, compliance) == pytest.approx(1e6)
            assert along(rotation[:, 1], "translation", missing, compliance) == math.inf
            assert along(rotation[:, 2], "rotation", missing, compliance) == pytest.approx(1e3)


def test_a_rigid_coupling_is_infinite_only_when_guided():
    """Only a hinge about z at (0.5, 0, 0) yields: P moves along y with it, and not at all if it may not turn."""
    twist = np.array([0.0, 0.0, 1.0, 0.0, -0.5, 0.0])
    compliance = 1e-4 * np.outer(twist, twist)
    assert free_stiffnesses(None, compliance)["translation"].stiffnesses == pytest.approx([4e4, math.inf, math.inf])
    assert guided_stiffnesses(None, compliance)["translation"].stiffnesses.tolist() == [math.inf] * 3
    assert guided_stiffnesses(None, compliance)["rotation"].stiffnesses.tolist() == [math.inf] * 3


def test_free_directions_have_no_stiffness():
    """One spring along x that passes P at y = 0.5: free to turn, P feels nothing; held, all of it."""
    wrench = np.array([0.0, 0.0, -0.5, 1.0, 0.0, 0.0])
    stiffness = 1e4 * np.outer(wrench, wrench)
    assert free_stiffnesses(stiffness, None)["translation"].stiffnesses.tolist() == [0.0, 0.0, 0.0]
    assert guided_stiffnesses(stiffness, None)["translation"].stiffnesses == pytest.approx([0.0, 0.0, 1e4])
    assert free_stiffness_along([1, 0, 0], "translation", stiffness, None) == 0.0
    assert guided_stiffness_along([0.6, 0.8, 0], "translation", stiffness, None) == pytest.approx(3600.0)
    assert guided_stiffness_along([0, 1, 0], "translation", stiffness, None) == 0.0


def test_all_rigid_is_all_infinite():
    for principal in SENSES:
        assert principal(None, np.zeros((6, 6)))["rotation"].stiffnesses.tolist() == [math.inf] * 3


@both
def test_there_is_no_answer_where_both_are_infinite(along, principal):
    endless = np.full((6, 6), math.inf)
    for pair in ((None, None), (endless, None), (endless, endless)):
        assert principal(*pair) is None
        assert along([1, 0, 0], "translation", *pair) is None


@given(st.integers(0, 1000), st.floats(0.0, 2 * math.pi))
def test_a_planar_machine_has_one_rotation_and_two_translations(seed, angle):
    stiffness = spring_matrix(seed, 8)[np.ix_(PLANE, PLANE)]
    compliance, n = np.linalg.inv(stiffness), np.array([math.cos(angle), math.sin(angle)])
    soft, found = principal_compliances(compliance, PLANE), free_stiffnesses(stiffness, compliance, PLANE)
    assert soft["rotation"].directions.tolist() in ([[0.0, 0.0, 1.0]], [[0.0, 0.0, -1.0]])
    assert soft["rotation"].compliances == pytest.approx([compliance[0, 0]])
    assert np.shape(soft["translation"].directions) == (2, 3)
    assert np.array(found["translation"].directions)[:, 2].tolist() == [0.0, 0.0]
    expected = 1.0 / (n @ compliance[1:, 1:] @ n)
    for pair in ((stiffness, None), (None, compliance)):
        assert free_stiffness_along([*n, 0.0], "translation", *pair, PLANE) == pytest.approx(expected, rel=1e-8)
        held = guided_stiffness_along([0, 0, 2.0], "rotation", *pair, PLANE)
        assert held == pytest.approx(stiffness[0, 0], rel=1e-8)


def test_a_block_that_does_not_exist_is_left_out():
    slides = guided_stiffnesses(np.diag([1.0, 2.0]), None, (3, 4))
    assert list(slides) == ["translation"]
    assert free_stiffnesses(np.diag([1.0, 2.0]), None, (3, 4)) == slides
    assert list(principal_compliances(np.diag([1.0, 2.0, 3.0]), (0, 1, 2))) == ["rotation"]


@both
def test_a_direction_must_lie_in_the_space_of_the_machine(along, principal):
    with pytest.raises(ValueError, match="zero"):
        along([0, 0, 0], "translation", np.eye(6), None)
    with pytest.raises(ValueError, match="translation"):
        along([0, 0.6, 0.8], "translation", np.eye(3), None, PLANE)
    with pytest.raises(ValueError, match="rotation"):
        along([0, 0, 1], "rotation", np.eye(3), None, (3, 4, 5))


def test_a_matrix_of_another_shape_is_refused():
    for call in (finite, principal_compliances, lambda matrix: free_stiffnesses(matrix, None)):
        with pytest.raises(ValueError, match="6 components"):
            call(np.eye(3))
    with pytest.raises(ValueError, match="finite C"):
        principal_compliances(np.full((6, 6), math.inf))


def test_cross_is_the_vector_product():
    assert np.allclose(cross([1, 2, 3]) @ [4, 5, 6], np.cross([1, 2, 3], [4, 5, 6]))


def test_a_free_direction_is_free_where_springs_are_seven_decades_apart():
    """A ram that twists freely lets the tool beside it go sideways: round-off of stiff springs is no stiffness."""
    springs = {f"stiffness.actuator.{i}": 10.0 for i in range(3)} | {"stiffness.ram_actuator": 0.0}
    springs |= {"stiffness.ram.0": 1e8, "stiffness.ram.1": 100.0, "stiffness.ram.2": 0.0}
    springs |= {"stiffness.leg_axial": 10.0, "stiffness.ram_bending": 1e6, "stiffness.ram_torsion": 10.0}
    places = {"geometry.base_radius": 0.21875, "geometry.platform_radius": 0.125}
    places |= {f"geometry.base_angles.{i}": angle for i, angle in enumerate((0.4375, 2.625, 4.75))}
    places |= {f"geometry.platform_angles.{i}": angle for i, angle in enumerate((0.5, 2.625, 4.75))}
    pose = {"pose.z": 0.6171875, "pose.theta1": 0.25, "pose.theta2": 0.0, "tool.offset.0": 0.0625}
    machine = with_values(load("passive-leg-3dof-pu-driven"), springs | places | pose)
    for softest in analyze(machine).softest.values():
        assert (softest.stiffness, softest.shares) == (0.0, ())
