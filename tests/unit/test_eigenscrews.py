"""Eigenscrews: twist and wrench on one screw, K and C as sums over them, the same screws from everywhere."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from elastic import LENGTH, offsets, spring_matrix, stiffnesses, turns, wrench_moved
from kinetostat.kinetostatics.eigenscrews import compliance_eigenscrews, eigenscrews

UNITS = np.repeat([1.0 / LENGTH, 1.0], 3)
"""Makes a wrench homogeneous; twists by its inverse."""
STABLE = 1e-9
"""Rounding of sums and, times the condition of K, 1e6 at most, of eigenvalues."""


def halves(screw):
    """Direction and moment about P of an eigenscrew of finite or infinite pitch."""
    n = np.array(screw.direction)
    return (np.zeros(3), n) if screw.point is None else (n, screw.pitch * n + np.cross(screw.point, n))


def wrench(screw):
    return np.hstack(halves(screw)[::-1])


def twist(screw):
    return np.hstack(halves(screw))


def close(a, b, scale):
    """Two matrices, compared in homogeneous units."""
    size = np.abs(a * np.outer(scale, scale)).max()
    return np.allclose((a - b) * np.outer(scale, scale), 0.0, rtol=0, atol=STABLE * size)


@given(stiffnesses)
def test_a_twist_on_an_eigenscrew_causes_a_wrench_on_it(stiffness):
    found = eigenscrews(stiffness)
    size = np.linalg.norm(stiffness * np.outer(UNITS, UNITS), 2)
    for screw in found:
        error = UNITS * (stiffness @ twist(screw) - screw.eigenvalue * wrench(screw))
        assert np.linalg.norm(error) <= 1e-8 * size * np.linalg.norm(twist(screw) / UNITS)
        assert np.linalg.norm(screw.direction) == pytest.approx(1.0)
        assert max(screw.direction, key=abs) > 0.0
        assert np.dot(screw.direction, screw.point) == pytest.approx(0.0, abs=1e-9 * (1 + np.linalg.norm(screw.point)))
        assert 2.0 * screw.pitch * screw.weight == pytest.approx(screw.eigenvalue)
    assert [math.copysign(1.0, screw.pitch) for screw in found] == [-1.0] * 3 + [1.0] * 3
    assert [screw.eigenvalue for screw in found] == sorted(screw.eigenvalue for screw in found)


@given(stiffnesses)
def test_eigenvalues_add_to_twice_the_trace_of_the_coupling(stiffness):
    """The trace of K Delta, an invariant of the machine."""
    values = [screw.eigenvalue for screw in eigenscrews(stiffness)]
    assert sum(values) == pytest.approx(2.0 * np.trace(stiffness[:3, 3:]), abs=STABLE * max(map(abs, values)))
    assert values == pytest.approx(sorted(np.linalg.eigvals(stiffness @ np.eye(6)[[3, 4, 5, 0, 1, 2]]).real), rel=1e-5)


@given(st.integers(0, 1000), st.integers(1, 8))
def test_springs_on_the_eigenscrews_are_the_stiffness(seed, count):
    """Also of a machine with freedoms, whose K has a lower rank."""
    stiffness = spring_matrix(seed, count, contrast=1.0)
    found = eigenscrews(stiffness)
    assert len(found) == min(count, 6)
    assert all(screw.weight > 0.0 for screw in found)
    total = sum(screw.weight * np.outer(wrench(screw), wrench(screw)) for screw in found)
    assert close(stiffness, total, UNITS)


@given(st.integers(0, 1000), st.integers(1, 8))
def test_hinges_on_the_eigenscrews_are_the_compliance(seed, count):
    """Also of a machine with rigid directions: any sum of dyads of twists is some C."""
    compliance = 1e-10 * np.roll(spring_matrix(seed, count, contrast=1.0), (3, 3), (0, 1))
    found = compliance_eigenscrews(compliance)
    assert len(found) == min(count, 6)
    total = sum(screw.weight * np.outer(twist(screw), twist(screw)) for screw in found)
    assert close(compliance, total, np.repeat([LENGTH, 1.0], 3))


def separate(found):
    """Whether no two eigenvalues are so near each other that their screws mix."""
    values = np.array([screw.eigenvalue for screw in found])
    return np.abs(np.diff(values)).min() > 1e-3 * np.abs(values).max()


@given(stiffnesses)
def test_k_and_c_have_the_same_eigenscrews(stiffness):
    found = eigenscrews(stiffness)
    assume(separate(found))
    for a, b in zip(found, compliance_eigenscrews(np.linalg.inv(stiffness)), strict=True):
        assert b.eigenvalue == pytest.approx(a.eigenvalue, rel=1e-6)
        assert b.pitch == pytest.approx(a.pitch, rel=1e-5)
        assert abs(np.dot(a.direction, b.direction)) == pytest.approx(1.0)
        assert b.point == pytest.approx(a.point, abs=1e-5)
        assert b.weight * a.weight == pytest.approx(0.25 / a.pitch**2, rel=1e-5)


@given(stiffnesses, turns, offsets)
def test_eigenscrews_move_with_the_machine(stiffness, rotation, offset):
    before = eigenscrews(stiffness)
    assume(separate(before))
    moved = wrench_moved(rotation, offset)
    for a, b in zip(before, eigenscrews(moved @ stiffness @ moved.T), strict=True):
        assert b.eigenvalue == pytest.approx(a.eigenvalue, rel=1e-6)
        assert b.pitch == pytest.approx(a.pitch, rel=1e-6)
        assert b.weight == pytest.approx(a.weight, rel=1e-6)
        assert abs(rotation @ a.direction @ b.direction) == pytest.approx(1.0)
        gap = rotation @ a.point - offset - b.point
        assert np.linalg.norm(np.cross(gap, b.direction)) <= 1e-5


def test_a_diagonal_stiffness_has_two_screws_along_each_axis():
    """By hand: K = diag(k_r, k_t) gives pitches +-sqrt(k_r / k_t), eigenvalues +-sqrt(k_r k_t), half of k_t each."""
    found = eigenscrews(np.diag([1.0, 4.0, 9.0, 100.0, 100.0, 100.0]))
    assert [screw.eigenvalue for screw in found] == pytest.approx([-30.0, -20.0, -10.0, 10.0, 20.0, 30.0])
    assert [screw.pitch for screw in found] == pytest.approx([-0.3, -0.2, -0.1, 0.1, 0.2, 0.3])
    assert [screw.weight for screw in found] == pytest.approx([50.0] * 6)
    assert np.allclose([screw.direction for screw in found], np.eye(3)[[2, 1, 0, 0, 1, 2]])
    assert np.allclose([screw.point for screw in found], 0.0)


def test_an_isotropic_machine_has_any_directions_but_one_pitch():
    found = eigenscrews(np.diag([4.0] * 3 + [100.0] * 3))
    assert [screw.pitch for screw in found] == pytest.approx([-0.2] * 3 + [0.2] * 3)
    total = sum(screw.weight * np.outer(wrench(screw), wrench(screw)) for screw in found)
    assert np.allclose(total, np.diag([4.0] * 3 + [100.0] * 3))


def test_a_spring_on_a_line_and_one_against_rotation():
    line = np.array([0.0, 0.0, -0.5, 1.0, 0.0, 0.0])
    (found,) = eigenscrews(1e4 * np.outer(line, line))
    assert (found.eigenvalue, found.pitch) == (0.0, 0.0)
    assert found.weight == pytest.approx(1e4)
    assert found.point == pytest.approx([0.0, 0.5, 0.0])
    (found,) = eigenscrews(np.diag([0.0, 0.0, 7.0, 0.0, 0.0, 0.0]))
    assert (found.eigenvalue, found.pitch, found.point) == (0.0, math.inf, None)
    assert found.weight == pytest.approx(7.0)
    assert found.direction == pytest.approx([0.0, 0.0, 1.0])


@given(turns, offsets)
def test_pure_screws_stay_pure_however_the_machine_is_turned(rotation, offset):
    """Zero and infinity are exact: two lines that meet and a couple about their normal, and the same as motions."""
    moved = wrench_moved(rotation, offset)
    stiffness = moved @ np.diag([0.0, 0.0, 7.0, 300.0, 100.0, 0.0]) @ moved.T
    assert [screw.eigenvalue for screw in eigenscrews(stiffness)] == [0.0] * 3
    moved = np.linalg.inv(moved).T
    compliance = moved @ np.diag([3e-3, 1e-3, 0.0, 0.0, 0.0, 1e-6]) @ moved.T
    assert [screw.eigenvalue for screw in compliance_eigenscrews(compliance)] == [math.inf] * 3


@given(turns, offsets)
def test_a_slide_across_a_hinge_has_infinite_pitch(rotation, offset):
    """A hinge mixes with the slide along it into two screws; the other two slides remain, without its rounding."""
    moved = np.linalg.inv(wrench_moved(rotation, offset)).T
    found = compliance_eigenscrews(moved @ np.diag([1e-3, 0.0, 0.0, 1e-5, 2e-6, 3e-6]) @ moved.T)
    assert [screw.pitch for screw in found] == pytest.approx([-0.1, 0.1, math.inf, math.inf])
    assert [screw.eigenvalue for screw in found] == pytest.approx([-1e4, 1e4, math.inf, math.inf])
    assert [screw.point is None for screw in found] == [False, False, True, True]


def test_a_machine_may_be_of_any_size():
    """Pitches scale with it: no length of ours decides which part of K is rounding."""
    unit = np.diag([1.0, 4.0, 9.0, 100.0, 100.0, 100.0])
    for size in (1e-7, 1e7):
        scale = np.repeat([size, 1.0], 3)
        found = eigenscrews(unit * np.outer(scale, scale))
        assert [screw.pitch / size for screw in found] == pytest.approx([-0.3, -0.2, -0.1, 0.1, 0.2, 0.3])


def test_a_hinge_and_a_slide_on_a_rigid_machine():
    hinge = np.array([0.0, 0.0, 1.0, 0.0, -0.5, 0.0])
    (found,) = compliance_eigenscrews(1e-4 * np.outer(hinge, hinge))
    assert (found.eigenvalue, found.pitch) == (math.inf, 0.0)
    assert found.weight == pytest.approx(1e-4)
    assert found.point == pytest.approx([0.5, 0.0, 0.0])
    (found,) = compliance_eigenscrews(np.diag([0.0, 0.0, 0.0, 1e-6, 0.0, 0.0]))
    assert (found.eigenvalue, found.pitch, found.point) == (math.inf, math.inf, None)
    assert found.weight == pytest.approx(1e-6)
    assert compliance_eigenscrews(np.zeros((6, 6))) == []


def test_an_infinite_matrix_is_refused():
    for call in (eigenscrews, compliance_eigenscrews):
        with pytest.raises(ValueError, match="finite"):
            call(np.full((6, 6), math.inf))
