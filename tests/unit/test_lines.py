"""The apex of a triangle, the end of a crank, the place of a slide: lengths, side and the ends of their existence."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from geometry import displacements, vectors
from kinetostat.algebra.lines import apex, crank_end, crank_range, slide_travel
from kinetostat.algebra.vector import Y_AXIS, Z_AXIS, ZERO, Vector
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


@given(st.floats(-math.pi, math.pi), bends, sides, sides)
def test_a_crank_and_a_rod_in_one_plane_make_a_triangle(direction, bend, first, second):
    start, middle, end = elbow_chain(direction, bend, first, second, 0.4)
    found = crank_end(start, end, Y_AXIS, first, second)
    assert (found - middle).norm() <= rounding(bend, first, second, (end - start).norm())


@given(displacements(), bends, sides, vectors(), sides)
def test_the_end_of_a_crank_is_found_again(motion, angle, crank, way, rod):
    """About z with the rod in any direction, then all of it displaced; on the left of the way from start to end."""
    assume(way.norm() > 0.1)
    elbow = Vector(math.cos(angle), math.sin(angle), 0.0) * crank
    end = elbow + way * (rod / way.norm())
    lever = elbow.x * end.y - elbow.y * end.x
    assume(abs(lever) > 0.02 * crank * rod)
    axis, ends = motion.rotation.apply(Z_AXIS * math.copysign(1.0, -lever)), [motion.apply(p) for p in (ZERO, end)]
    assert (crank_end(*ends, axis, crank, rod) - motion.apply(elbow)).norm() <= 1e6 * U
    near, far = crank_range(*ends, axis, crank)
    assert near <= rod * (1 + 16 * U)
    assert far >= rod * (1 - 16 * U)


@pytest.mark.parametrize("rod", [0.5, 4.0])
def test_a_rod_beyond_the_crank_s_range_does_not_meet_it(rod):
    end = Vector(2.0, 0.0, 1.0)
    near, far = crank_range(ZERO, end, Z_AXIS, 1.0)
    assert (near, far) == pytest.approx((math.sqrt(2.0), math.sqrt(10.0)))
    assert not near <= rod <= far
    assert math.isnan(crank_end(ZERO, end, Z_AXIS, 1.0, rod).norm())


@given(displacements(), st.floats(-1.0, 1.0), st.floats(0.0, 0.95), sides)
def test_a_slide_is_found_again_behind_its_rod(motion, travel, share, rod):
    along = Vector(share, 0.0, math.sqrt(1.0 - share * share))
    end = Z_AXIS * travel + along * rod
    start, end = motion.apply(ZERO), motion.apply(end)
    found, aside = slide_travel(start, end, motion.rotation.apply(Z_AXIS), rod)
    assert found == pytest.approx(travel, abs=1e3 * U)
    assert aside == pytest.approx(share * rod, abs=1e3 * U)


def test_a_rod_that_is_too_short_meets_no_slide():
    travel, aside = slide_travel(ZERO, Vector(1.0, 0.0, 3.0), Z_AXIS, 0.9)
    assert math.isnan(travel)
    assert aside == 1.0
