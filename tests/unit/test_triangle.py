"""The apex of a triangle: lengths, side, angle and the ends of its existence."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.algebra.triangle import apex
from kinetostat.algebra.vector import Vector
from numeric import U

sides = st.floats(0.1, 2.0)
bends = st.floats(0.01, math.pi - 0.01)
"""Angle between the two sides, away from flat, where the apex is but the square root of a rounding error."""


def rounding(bend, *lengths):
    """What rounding does to the apex (m) and to its sine: it grows as 1 / sine, and as the sides differ, squared.

    From the closed form: an error u of the squares of the sides becomes u (longest / shortest)^2 / sine in the height.
    """
    return 16 * U * max(1.0, *lengths) * (max(lengths) / min(lengths)) ** 2 / math.sin(bend)


def elbow_chain(direction, bend, first, second, offset):
    """Start, apex and end of two links, the second turned by `bend` to the left, seen from -y with x to the right."""
    start = Vector(0.3, offset, -0.2)
    middle = start + Vector(math.cos(direction), 0.0, math.sin(direction)) * first
    end = middle + Vector(math.cos(direction + bend), 0.0, math.sin(direction + bend)) * second
    return start, middle, end


@given(st.floats(-math.pi, math.pi), bends, sides, sides, st.sampled_from([0.0, -0.4, 0.7]))
def test_the_apex_of_two_links_is_found_again(direction, bend, first, second, offset):
    """For a left turn the apex lies on the right of start-end, whatever the direction."""
    start, middle, end = elbow_chain(direction, bend, first, second, offset)
    tolerance = rounding(bend, first, second, (end - start).norm())
    found, sine = apex(start, end, first, second)
    assert (found - middle).norm() <= tolerance
    assert sine == pytest.approx(math.sin(bend), abs=tolerance)
    assert found.y == offset


def test_an_end_above_has_its_apex_on_the_positive_x_side():
    found, sine = apex(Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 1.0), 1.0, 1.0)
    assert found.components() == pytest.approx((math.sqrt(3) / 2, 0.0, 0.5))
    assert sine == pytest.approx(math.sqrt(3) / 2)


@pytest.mark.parametrize(("first", "second", "middle"), [(0.25, 0.75, 0.25), (1.5, 0.5, 1.5)])
def test_a_flat_triangle_has_sine_zero(first, second, middle):
    """Numbers that are exact in binary: the flat case itself, not a neighbour."""
    found, sine = apex(Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 1.0), first, second)
    assert sine == 0.0
    assert found.components() == (0.0, 0.0, middle)


@pytest.mark.parametrize(("first", "second"), [(0.25, 0.5), (2.0, 0.5), (0.5, 2.0)])
def test_a_triangle_that_cannot_close_is_not_a_number(first, second):
    found, sine = apex(Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 1.0), first, second)
    assert math.isnan(sine)
    assert math.isnan(found.x)
