"""Legs whose axes turn about two points: the force that they carry, and their margin, against linear algebra."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.algebra.screw import rotation_about
from kinetostat.algebra.vector import Vector
from kinetostat.engine.kernel import program_fill
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.leg_screws import comparable, reciprocal_wrenches, two_centres
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import values, with_values
from kinetostat.machine.written.family import at_home

LENGTH = 0.7
AXES_IN_ALL = 5


def drawn(source, count):
    vectors = source.normal(size=(count, 3))
    return [Vector(*vector.tolist()) for vector in vectors / np.linalg.norm(vectors, axis=1)[:, None]]


def twists_about(points, axes, reference):
    return [rotation_about(axis, reference - point) for point, row in zip(points, axes, strict=True) for axis in row]


@given(st.integers(0, 10**6), st.booleans(), st.booleans())
def test_margin_and_line_are_those_of_the_twists(seed, ball_last, square):
    source = np.random.default_rng(seed)
    points = [Vector(*source.normal(size=3).tolist()) for _ in range(2)]
    reference = Vector(*source.normal(size=3).tolist())
    pair, ball = drawn(source, 2), drawn(source, 3)
    if square:
        normal = ball[0].cross(ball[2])
        ball[1] = normal * (1.0 / normal.norm())
    axes = [pair, ball] if ball_last else [ball, pair]
    centres = two_centres(points, axes)
    twists = twists_about(points, axes, reference)
    matrix = np.array([comparable(twist, 1.0 / LENGTH) for twist in twists])
    expected = AXES_IN_ALL / (np.linalg.norm(matrix) * np.linalg.norm(np.linalg.pinv(matrix)))
    assert centres.singularity_margin(reference, LENGTH) == pytest.approx(expected, rel=1e-9)
    (wrench,), _ = reciprocal_wrenches(twists, LENGTH)
    line, carried = (np.array(w.components()) for w in (centres.wrench(reference), wrench))
    size = np.sqrt(centres.square(reference, LENGTH)) * np.sign(line @ carried)
    np.testing.assert_allclose(line / size, carried, atol=1e-9 * np.abs(carried).max() / min(1.0, expected))


def test_axes_that_lock_up_have_no_margin():
    x, y, z = (Vector(*row) for row in np.eye(3).tolist())
    base, top = Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 1.0)
    locked = [two_centres([base, top], axes) for axes in ([[x, z], [x, y, z]], [[x, y], [x, y, x]])]
    with np.errstate(all="ignore"):
        arrays = [replace(centres, distance=np.array([1.0])) for centres in locked[:1]]
        margins = [centres.singularity_margin(Vector(0.1, 0.2, 1.3), LENGTH) for centres in (*arrays, locked[1])]
    assert all(float(np.squeeze(margin)) == 0.0 for margin in margins)


@pytest.mark.parametrize("name", ["hexapod-hardware", "cogiro"])
def test_a_program_that_knows_the_home_pose_gives_the_numbers_of_the_analysis(name):
    """Right angles and slides along legs that a program takes as given are round-off in the numbers of the file."""
    machine = load(name)
    pose = {path: value for path, value in values(machine).items() if path.startswith("pose.")}
    moved = {path: value + 0.01 for path, value in pose.items()}
    quantities = ("stiffness_rx", "stiffness_y", "stiffness_rx_x", "singularity_margin")
    fill = program_fill(machine, tuple(moved), quantities, closed=machine.family.chains is not None)
    results, status = np.empty((len(quantities), 1)), np.empty(1, dtype=np.int8)
    fill({path: np.array([value]) for path, value in moved.items()}, results, status)
    response = respond(with_values(machine, moved))
    expected = [*(response.stiffness.entry(i, j) for i, j in ((0, 0), (4, 4), (0, 3))), response.singularity_margin]
    assert status[0] == response.status
    np.testing.assert_allclose(results[:, 0], expected, rtol=1e-11, atol=1e-12 * expected[0])


def test_home_angles_are_seen_and_others_are_not_taken_for_granted():
    inverses = [leg.inverse for leg in at_home(load("hexapod-hardware"), ["pose.x"]).family.recipe[1][0].legs]
    assert all(inverse.upright and inverse.aligned == 1.0 for inverse in inverses)
    machine, path = load("hexapod-hardware"), "legs.leg.drive.axis.0"
    for slant in (-0.3, values(machine)[path] + 1e-14):  # an angle of the file, however small, is more than round-off
        shifted = at_home(with_values(machine, {path: slant}), [])
        assert not any(leg.inverse.aligned for leg in shifted.family.recipe[1][0].legs)
