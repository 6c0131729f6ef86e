"""Small displacements over scalars: how far points move keeps all digits, however far away they are."""

from fractions import Fraction
from math import atan, sin

import numpy as np
import pytest

from kinetostat.numerics.motions import along, exponential, of_scalars

AXIS = [Fraction(2, 3), Fraction(-1, 3), Fraction(2, 3)]
CENTRE, POINT = [Fraction(3, 4), Fraction(5, 8), Fraction(-1, 2)], [Fraction(7, 8), Fraction(-9, 4), Fraction(1, 16)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


@pytest.mark.parametrize("tangent", [Fraction(1, 10**7), Fraction(1, 300), Fraction(-1, 3)], ids=float)
def test_the_shift_of_a_point_is_that_of_exact_fractions(tangent):
    """A turn about a skew line, of which the tangent of half the angle is rational, and so all else."""
    sine, rest = 2 * tangent / (1 + tangent**2), 2 * tangent**2 / (1 + tangent**2)
    arm = [p - c for p, c in zip(POINT, CENTRE, strict=True)]
    once, twice = cross(AXIS, arm), cross(AXIS, cross(AXIS, arm))
    exact = [float(sine * a + rest * b) for a, b in zip(once, twice, strict=True)]
    screw = np.array([[*map(float, AXIS), *map(float, cross(CENTRE, AXIS))]])
    moved = along(screw, of_scalars([2.0 * atan(tangent)])[0])
    point = np.array([[*map(float, POINT)]])
    assert moved.shift(point)[0].astype(float) == pytest.approx(exact, rel=1e-14)
    # Two such turns in a row, of which the second one leads back.
    back = along(screw, of_scalars([-2.0 * atan(tangent)])[0])
    assert np.abs((back @ moved).shift(point)).max() < 2e-15 * abs(float(sine))


@pytest.mark.parametrize("angle", [1e-3, 0.03, 0.0499, 0.0501])
def test_a_screw_across_its_axis_moves_to_all_digits_where_the_series_ends(angle):
    """A turn about x with a motion along y leads (1 - cos t)/t to the side, which is 2 sin^2(t/2)/t."""
    motion = exponential(np.array([[angle, 0.0, 0.0, 0.0, 1.0, 0.0]]))
    expected = [0.0, sin(angle) / angle, 2.0 * sin(0.5 * angle) ** 2 / angle]
    assert motion.translation[0].tolist() == pytest.approx(expected, rel=1e-15, abs=0.0)
