"""Lines and arcs found in points: what is round becomes an arc, what has corners stays."""

import math
from itertools import pairwise

import pytest

from kinetostat.views.scene import shapes
from kinetostat.views.scene.machine_scene import rounded_hull

pytest.importorskip("OCP.STEPCAFControl", reason="Open CASCADE does not start", exc_type=ImportError)

from kinetostat.exchange.step_file import outline_pieces


def on_circle(radius, angles, centre=(0.0, 0.0)):
    return [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in angles]


def steps(first, last, count):
    return [first + (last - first) * k / count for k in range(count + 1)]


def ring(points):
    return [*points, points[0]]


def test_a_half_circle_is_one_arc_through_its_middle():
    (arc,) = outline_pieces(shapes.ball(0.02).profile)
    start, middle, end = arc
    assert start == pytest.approx((0.0, -0.02), abs=1e-15)
    assert middle == pytest.approx((0.02, 0.0), abs=1e-15)
    assert end == pytest.approx((0.0, 0.02), abs=1e-15)


def test_a_circle_is_two_arcs():
    found = list(outline_pieces(ring(on_circle(0.3, steps(0.0, math.tau, 40)[:-1], (5.0, -2.0)))))
    assert [len(piece) for piece in found] == [3, 3]
    assert all(math.dist(point, (5.0, -2.0)) == pytest.approx(0.3, rel=1e-9) for piece in found for point in piece)


def test_arcs_stand_between_the_lines_of_a_rounded_outline():
    outline = rounded_hull([(0.0, 0.0), (0.4, 0.0), (0.1, 0.3)], 0.05)
    found = list(outline_pieces(ring(outline)))
    assert [len(piece) for piece in found] == [3, 2, 3, 2, 3, 2]
    assert all(piece[-1] == following[0] for piece, following in zip(found, [*found[1:], found[0]], strict=True))


@pytest.mark.parametrize(
    ("points", "why"),
    [
        (ring(shapes.block(0.2, 0.2, 1.0).outline), "corners of a square lie on a circle"),
        (ring(on_circle(0.1, steps(0.0, math.tau, 6)[:-1])), "and those of a hexagon"),
        (shapes.shaft(0.02, 0.02, 0.004).profile, "a chamfer is no arc"),
        (shapes.waist(0.02, 0.005, 0.06).profile, "nor is a parabola"),
        ([(0.1 * k, 0.0) for k in range(6)], "nor a straight line"),
        (on_circle(0.1, steps(0.0, 0.2, 2)), "two chords say too little"),
        (on_circle(0.1, [0.0, 0.1, 0.2, 0.301]), "uneven chords are meant"),
    ],
)
def test_what_is_not_round_stays(points, why):
    assert list(outline_pieces(points)) == list(pairwise(points)), why


def test_an_arc_ends_where_the_radius_or_the_sense_changes():
    crest = on_circle(1.0, steps(math.pi, 0.0, 12))
    trough = on_circle(1.0, steps(math.pi, math.tau, 12), (2.0, 0.0))
    wider = on_circle(2.0, steps(0.0, -1.0, 12), (-1.0, 0.0))
    for following in (trough, wider):
        first, second = outline_pieces([*crest, *following[1:]])
        assert first[-1] == second[0] == crest[-1]
