"""Triangles of the three shapes: closed, facing outwards, with the volume of the solid, their normals fit."""

import math

import numpy as np
import pytest

from kinetostat.algebra.vector import Displacement, Vector, rotation_along
from kinetostat.kinetostatics.response import respond
from kinetostat.views.scene import shapes
from kinetostat.views.scene.anatomy import proportions_of
from kinetostat.views.scene.machine_scene import machine_scene, rounded_hull
from kinetostat.views.scene.mesh import (
    CHAMFER_STEPS,
    REVOLVED_SIDES,
    WIRE_SIDES,
    cut_in_triangles,
    inset_outline,
    mesh_of,
    placed_mesh,
)
from kinetostat.views.scene.solids import Extruded, Solid, Swept, Turned, unit
from machines import every_machine

ROUND = REVOLVED_SIDES / math.tau * math.sin(math.tau / REVOLVED_SIDES)
"""Area of a regular polygon as a share of its circumscribed circle's."""
WIRE_ROUND = WIRE_SIDES / math.tau * math.sin(math.tau / WIRE_SIDES)
EXACT = 1e-9
BENT = 0.6
"""Least cosine between a face and the normals at its corners: half the corner of a bent wire, and its facets."""
FORK = Extruded(shapes.fork(0.05, 0.012, 0.055, 0.015), 0.036, 0.003)
PLATE = Extruded(rounded_hull([(0.0, 0.0), (0.2, 0.0), (0.1, 0.3)], 0.04), 0.02, 0.004)
CIRCLE = Swept(
    tuple((0.1 * math.cos(a), 0.1 * math.sin(a), 0.0) for a in np.linspace(0.0, math.tau, 48, False)), 0.004, True
)
RING = Turned(((0.02, -0.005), (0.03, -0.005), (0.03, 0.005), (0.02, 0.005), (0.02, -0.005)))
CLOSED = {
    "shaft": shapes.shaft(0.02, 0.4, 0.003, start=0.1),
    "ball": shapes.ball(0.05),
    "ring": RING,
    "socket": shapes.socket(0.03),
    "arrow": shapes.arrow(0.2, 0.005),
    "waist": shapes.waist(0.02, 0.005, 0.1),
    "block": shapes.block(0.1, 0.2, 0.3, 0.01),
    "sharp block": shapes.block(0.1, 0.2, 0.3),
    "plate": PLATE,
    "fork": FORK,
    "coil": shapes.helix(0.03, 0.1, 4.0, 0.003),
    "circle": CIRCLE,
    "spiral": shapes.spiral(0.01, 0.05, 2.5, 0.002),
}
every_shape = pytest.mark.parametrize("shape", CLOSED.values(), ids=CLOSED.keys())


def edges_of(mesh):
    """How often each edge is run through in each direction, its ends known by their place."""
    places = {}
    names = [places.setdefault(tuple(point), len(places)) for point in mesh.points]
    counted = {}
    for triangle in mesh.triangles:
        for start, end in zip(triangle, np.roll(triangle, -1), strict=True):
            pair = names[start], names[end]
            counted[pair] = counted.get(pair, 0) + 1
    return counted


def face_normals(mesh):
    a, b, c = (mesh.points[mesh.triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


@every_shape
def test_every_edge_has_a_face_on_either_side(shape):
    edges = edges_of(mesh_of(shape))
    assert all(edges.get((end, start)) == count == 1 for (start, end), count in edges.items())


@every_shape
def test_normals_have_length_1_and_point_out_of_their_faces(shape):
    mesh = mesh_of(shape)
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0)
    faces = face_normals(mesh)
    sizes = np.linalg.norm(faces, axis=1)
    real = sizes > 1e-9 * sizes.max()
    directions = faces[real] / sizes[real, None]
    for corner in range(3):
        across = np.einsum("ij,ij->i", directions, mesh.normals[mesh.triangles[real, corner]])
        assert across.min() > BENT


@every_machine
def test_every_body_of_every_machine_encloses_a_volume(case):
    configuration = respond(case.machine).configuration
    scene = machine_scene(case.machine, configuration, proportions_of(case.machine, configuration))
    for solid in scene.solids:
        mesh = placed_mesh(solid)
        assert np.isfinite(mesh.points).all()
        assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0)
        assert mesh.volume > 0.0


@pytest.mark.parametrize(
    ("shape", "volume"),
    [
        (shapes.shaft(0.02, 0.4), ROUND * math.pi * 0.02**2 * 0.4),
        (shapes.cone(0.03, 0.01, 0.2), ROUND * math.pi * 0.2 / 3.0 * (0.03**2 + 0.03 * 0.01 + 0.01**2)),
        (RING, ROUND * math.pi * (0.03**2 - 0.02**2) * 0.01),
        (shapes.block(0.1, 0.2, 0.3), 0.1 * 0.2 * 0.3),
        (Swept(((0.1, 0.0, 0.0), (0.4, 0.4, 0.0)), 0.01), WIRE_ROUND * math.pi * 0.01**2 * 0.5),
    ],
    ids=["cylinder", "frustum", "ring", "box", "straight wire"],
)
def test_the_volume_is_that_of_the_solid_with_polygons_for_circles(shape, volume):
    assert mesh_of(shape).volume == pytest.approx(volume, rel=EXACT)


def test_the_volume_of_round_bodies_comes_near_theirs():
    assert mesh_of(shapes.ball(0.05)).volume == pytest.approx(4.0 / 3.0 * math.pi * 0.05**3, rel=0.01)
    torus = 2.0 * math.pi**2 * 0.1 * 0.004**2
    assert mesh_of(CIRCLE).volume == pytest.approx(torus, rel=0.06)


def test_a_broken_edge_takes_away_what_lies_outside_its_steps():
    """Of a long edge of length l: area between the corner and the chord polygon of a quarter circle."""
    chamfer, side, height = 0.001, 10.0, 0.1
    step = 0.5 * math.pi / CHAMFER_STEPS
    removed = chamfer**2 * (1.0 - 0.5 * CHAMFER_STEPS * math.sin(step))
    whole = side**2 * height
    broken = mesh_of(shapes.block(side, side, height, chamfer)).volume
    assert whole - broken == pytest.approx(8 * side * removed, rel=1e-3)


def test_sharp_edges_stay_sharp_and_round_ones_are_smooth():
    box = mesh_of(shapes.block(0.1, 0.2, 0.3))
    assert {tuple(np.abs(n).round(9)) for n in box.normals} == {(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)}
    ball = mesh_of(shapes.ball(0.05))
    outward = ball.points / np.linalg.norm(ball.points, axis=1, keepdims=True)
    inner = np.abs(ball.points[:, 2]) < 0.0499
    assert np.einsum("ij,ij->i", ball.normals, outward)[inner].min() > 0.9999


def test_a_wire_keeps_its_radius_along_a_curve():
    shape = shapes.helix(0.03, 0.1, 4.0, 0.003)
    mesh, path = mesh_of(shape), np.array(shape.path)
    away = np.linalg.norm(mesh.points[:, None] - path, axis=2).min(axis=1)
    assert away == pytest.approx(0.003)


def test_equal_shapes_share_one_mesh_that_cannot_be_changed():
    mesh = mesh_of(Turned(((0.0, 0.0), (0.1, 0.0), (0.1, 0.2), (0.0, 0.2))))
    assert mesh_of(shapes.shaft(0.1, 0.2)) is not mesh
    assert mesh_of(Turned(((0.0, 0.0), (0.1, 0.0), (0.1, 0.2), (0.0, 0.2)))) is mesh
    with pytest.raises(ValueError, match="read-only"):
        mesh.points[0] = 0.0


def test_a_solid_stands_in_the_base_frame_with_normals_of_the_scaled_body():
    axis, angle = unit(Vector(1.0, 2.0, -0.5)), 0.8
    place = Displacement(rotation_along(axis, math.cos(angle), math.sin(angle)), Vector(0.3, -0.2, 0.1))
    scale = (1.0, 2.0, 0.5)
    ball = placed_mesh(Solid("ellipsoid", shapes.ball(1.0), "steel", place, scale))
    own = np.array([place.inverse().apply(Vector(*p)).components() for p in ball.points])
    assert np.sum((own / scale) ** 2, axis=1) == pytest.approx(1.0)
    assert ball.volume == pytest.approx(mesh_of(shapes.ball(1.0)).volume)
    gradient = own / np.square(scale)
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    turned = np.array([place.rotation.inverse().apply(Vector(*n)).components() for n in ball.normals])
    assert np.einsum("ij,ij->i", turned, gradient).min() > 0.99


def test_an_outline_with_hollows_is_cut_without_overlap():
    outline = np.array(shapes.fork(0.05, 0.012, 0.055, 0.015))
    x, y = outline.T
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    corners = outline[np.array(cut_in_triangles(outline))]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = 0.5 * (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    assert len(areas) == len(outline) - 2
    assert areas.min() > 0.0
    assert areas.sum() == pytest.approx(area)


def test_a_narrowed_square_has_its_edges_moved_in():
    square = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)])
    assert inset_outline(square, 0.25) == pytest.approx(np.clip(square, 0.25, 1.75))
