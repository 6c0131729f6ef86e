"""Shapes as exact solids: valid, with surfaces of the right kind and the volumes that are known in closed form."""

import math

import pytest

from kinetostat.views.scene import shapes
from kinetostat.views.scene.machine_scene import rounded_hull
from kinetostat.views.scene.mesh import mesh_of
from kinetostat.views.scene.solids import Extruded, Swept, Turned

pytest.importorskip("OCP.STEPCAFControl", reason="Open CASCADE does not start", exc_type=ImportError)

from kinetostat.exchange.step_file import solid_of
from step_files import box, is_valid, surfaces, volume

EXACT = 1e-9
"""What integration leaves."""
SPLINE = 2e-3
"""How far the length of a smooth curve through points may be from that of the curve they were taken from."""

CIRCLE = tuple((math.cos(a), math.sin(a), 0.0) for a in (math.tau * k / 60 for k in range(60)))


def frustum(one, other, height):
    return math.pi * height * (one**2 + one * other + other**2) / 3.0


def rounded_away(radius):
    """What a rounded edge takes off: area per length, and volume per corner of an outline that is moved inwards."""
    return radius**2 * (1.0 - math.pi / 4.0), radius**3 * (5.0 / 3.0 - math.pi / 2.0)


def rounded_block(width, depth, height, radius):
    area, corner = rounded_away(radius)
    return width * depth * height - 2.0 * (2.0 * (width + depth) * area - 4.0 * corner)


def rounded_disc(outer, height, radius):
    area, corner = rounded_away(radius)
    return math.pi * (outer**2 * height - 2.0 * (2.0 * outer * area - corner))


@pytest.mark.parametrize(
    ("shape", "expected", "kinds"),
    [
        (shapes.ball(0.02), 4.0 / 3.0 * math.pi * 0.02**3, ["Sphere"]),
        (shapes.shaft(0.02, 0.3), math.pi * 0.02**2 * 0.3, ["Cylinder", "Plane", "Plane"]),
        (
            shapes.shaft(0.02, 0.3, 0.004),
            2.0 * frustum(0.016, 0.02, 0.004) + math.pi * 0.02**2 * 0.292,
            ["Cone", "Cone", "Cylinder", "Plane", "Plane"],
        ),
        (shapes.cone(0.03, 0.0, 0.1), frustum(0.03, 0.0, 0.1), ["Cone", "Plane"]),
        (shapes.block(0.2, 0.1, 0.3), 0.2 * 0.1 * 0.3, ["Plane"] * 6),
        (shapes.block(0.2, 0.1, 0.3, 0.01), rounded_block(0.2, 0.1, 0.3, 0.01), ["Cylinder"] * 8 + ["Plane"] * 6),
        (
            Extruded(rounded_hull([(0.3, 0.1)], 0.05), 0.02, 0.004),
            rounded_disc(0.05, 0.02, 0.004),
            ["Cylinder"] * 2 + ["Plane"] * 2 + ["Torus"] * 4,
        ),
        (
            Turned(((0.04, -0.01), (0.05, 0.0), (0.04, 0.01), (0.03, 0.0), (0.04, -0.01))),
            math.tau * 0.04 * 0.0002,
            ["Cone"] * 4,
        ),
    ],
    ids=["ball", "shaft", "chamfered", "cone", "block", "rounded", "disc", "ring"],
)
def test_a_solid_is_what_its_shape_stands_for(shape, expected, kinds):
    solid = solid_of(shape)
    assert is_valid(solid)
    assert volume(solid) == pytest.approx(expected, rel=EXACT)
    assert surfaces(solid) == kinds


def test_a_socket_is_a_sphere_outside():
    """A zone of a sphere, hollowed by a cone from its rim down."""
    outer, inner, rim = 1.22 * 0.02, 1.02 * 0.02, math.radians(20.0)
    low, high = outer * math.sin(math.radians(-60.0)), outer * math.sin(rim)
    zone = math.pi * (outer**2 * (high - low) - (high**3 - low**3) / 3.0)
    hollow = frustum(outer * math.cos(rim), inner * math.cos(rim), high - inner * math.sin(rim))
    solid = solid_of(shapes.socket(0.02))
    assert volume(solid) == pytest.approx(zone - hollow, rel=EXACT)
    assert surfaces(solid) == ["Cone", "Plane", "Plane", "Sphere"]


@pytest.mark.parametrize(
    ("shape", "length"),
    [
        (shapes.arc(0.1, 4.0, 0.004), 0.4),
        (shapes.helix(0.0075, 0.05, 6.0, 0.0016), math.hypot(math.tau * 6.0 * 0.0075, 0.05)),
        (Swept(CIRCLE, 0.05, closed=True), math.tau),
    ],
    ids=["arc", "thread", "closed"],
)
def test_a_wire_is_round_along_a_smooth_curve(shape, length):
    solid = solid_of(shape)
    assert is_valid(solid)
    assert volume(solid) == pytest.approx(math.pi * shape.radius**2 * length, rel=SPLINE)


def test_edges_stay_sharp_where_there_is_no_room_to_round_them():
    solid = solid_of(Extruded(shapes.block(0.2, 0.1, 0.0).outline, 0.01, 0.006))
    assert is_valid(solid)
    assert volume(solid) == pytest.approx(0.2 * 0.1 * 0.01, rel=EXACT)


def test_a_scaled_ball_is_an_ellipsoid():
    solid = solid_of(shapes.ball(1.0), (0.1, 0.2, 0.3))
    assert is_valid(solid)
    assert box(solid) == pytest.approx([-100.0, -200.0, -300.0, 100.0, 200.0, 300.0], rel=1e-6)
    assert volume(solid) == pytest.approx(4.0 / 3.0 * math.pi * 0.1 * 0.2 * 0.3, rel=1e-3)  # integrated over splines


@pytest.mark.parametrize(
    "shape",
    [
        Extruded(shapes.fork(0.02, 0.005, 0.022, 0.006), 0.014, 0.001),
        Extruded(rounded_hull([(0.0, 0.0), (0.4, 0.0), (0.1, 0.3)], 0.05), 0.02, 0.0044),
        shapes.waist(0.02, 0.005, 0.06),
        shapes.double_arrow(0.3, 0.01),
    ],
    ids=["fork", "plate", "flexure", "arrow"],
)
def test_a_solid_is_a_little_larger_than_its_mesh(shape):
    """Facets lie inside of what is round: 0.4 % about an axis of forty sides, less where there are flats."""
    solid = solid_of(shape)
    assert is_valid(solid)
    assert 1.0 < volume(solid) / mesh_of(shape).volume < 1.005
