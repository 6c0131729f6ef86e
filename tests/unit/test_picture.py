"""Pictures of machines: what is where, what hides what, where shadow falls, and the triangles behind them."""

import io
import math

import numpy as np
import pytest
from PIL import Image

from kinetostat.algebra.vector import Displacement, Vector, rotation_x
from kinetostat.machine.loading import load
from kinetostat.views.picture import machine_picture, picture
from kinetostat.views.rendering.camera import VIEWPOINTS, camera_on
from kinetostat.views.rendering.light import light_on
from kinetostat.views.rendering.visibility import Triangles, hits_of, nearest_triangles, normals_at
from kinetostat.views.scene import shapes
from kinetostat.views.scene.machine_scene import scene_of
from kinetostat.views.scene.mesh import mesh_of
from kinetostat.views.scene.solids import Label, Scene, Solid
from refusals import refused

SIZE = (120, 90)


def pixels(data, mode="RGB"):
    image = Image.open(io.BytesIO(data))
    assert image.format == "PNG"
    return np.asarray(image.convert(mode)).astype(int)


def scene(*solids, labels=()):
    return Scene(tuple(solids), tuple(labels), Vector(0.0, 0.0, 0.5), 2.0, 0.0)


def block_at(x, y, material, name="block"):
    place = Displacement(rotation_x(1.0, 0.0), Vector(x, y, 0.0))
    return Solid(name, shapes.block(0.4, 0.4, 1.0), material, place)


def share_of(image, material):
    """Share of pixels of the material's hue: the channel that is strongest in its colour."""
    red, green, blue = image[..., 0], image[..., 1], image[..., 2]
    coloured = {"actuated": (blue > red + 40), "passive": (red > blue + 40) & (red > green + 20)}[material]
    return coloured.mean()


def test_a_picture_has_its_size_and_is_the_same_each_time():
    first = machine_picture(load("planar-3rpr"), SIZE)
    assert pixels(first).shape == (90, 120, 3)
    assert machine_picture(load("planar-3rpr"), SIZE) == first


def test_what_is_nearer_hides_what_is_behind():
    """Of two equal blocks one behind the other only the one in front is seen, from either side."""
    two = scene(block_at(0.0, -1.0, "actuated"), block_at(0.0, 1.0, "passive", "other"))
    front, back = pixels(picture(two, SIZE, (0.0, -1.0, 0.0))), pixels(picture(two, SIZE, (0.0, 1.0, 0.0)))
    assert share_of(front, "actuated") > 0.1 > 10 * share_of(front, "passive")
    assert share_of(back, "passive") > 0.1 > 10 * share_of(back, "actuated")


def test_one_sees_through_what_is_translucent():
    two = scene(block_at(0.0, -1.0, "removed"), block_at(0.0, 1.0, "passive", "other"))
    assert share_of(pixels(picture(two, SIZE, (0.0, -1.0, 0.0))), "passive") > 0.05


def test_hidden_layers_are_left_out():
    machine = load("zhang-gosselin-4dof")
    with_springs = pixels(machine_picture(machine, SIZE))
    without = pixels(machine_picture(machine, SIZE, hidden=("springs", "frames", "labels")))
    green = [((i[..., 1] > i[..., 0] + 30) & (i[..., 1] > i[..., 2] + 10)).sum() for i in (with_springs, without)]
    assert green[0] > 0 == green[1]


@pytest.mark.parametrize(("theme", "corner"), [("light", 255), ("dark", 24)])
def test_the_paper_suits_the_page(theme, corner):
    assert pixels(machine_picture(load("planar-3rpr"), SIZE, "front", theme=theme))[0, 0, 0] == corner


def test_a_transparent_picture_on_white_is_the_white_one():
    machine = load("planar-3rpr")
    clear = pixels(machine_picture(machine, SIZE, transparent=True), "RGBA")
    white = pixels(machine_picture(machine, SIZE))
    alpha = clear[..., 3:] / 255.0
    assert clear[0, 0, 3] == 0
    assert np.abs(clear[..., :3] * alpha + 255.0 * (1.0 - alpha) - white).max() <= 3.0


def test_labels_are_written_where_they_stand():
    marked = scene(block_at(0.0, 0.0, "steel"), labels=[Label("7", Vector(0.0, 0.0, 0.5))])
    with_label, without = (pixels(picture(marked, (300, 300), "front", hidden=hidden)) for hidden in ((), ("labels",)))
    y, x = np.nonzero((with_label != without).any(axis=2))
    assert (x.mean(), y.mean()) == pytest.approx((150, 150), abs=12)


@pytest.mark.parametrize("view", [*VIEWPOINTS, (1.0, 2.0, 3.0)])
@pytest.mark.parametrize("size", [(400, 300), (300, 400)])
def test_a_camera_fills_its_picture_and_no_more(view, size):
    points = mesh_of(shapes.block(0.3, 1.2, 0.7)).points + np.array([3.0, -1.0, 2.0])
    places, nearness = camera_on(points, VIEWPOINTS[view] if isinstance(view, str) else view, *size).project(points)
    low, high = places.min(axis=0), places.max(axis=0)
    assert low.min() > 0.0
    assert (high < size).all()
    assert ((high - low) / size).max() == pytest.approx(0.86, abs=0.02)
    assert nearness.min() > 0.0


def test_rays_go_through_what_is_projected():
    points = np.array([(0.1, 0.2, 0.3), (-0.4, 0.5, 0.9), (1.0, 0.0, 0.0)])
    camera = camera_on(points, (1.0, -1.0, 0.5), 200, 100)
    places, nearness = camera.project(points)
    assert camera.eye + camera.rays(*places.T) / nearness[:, None] == pytest.approx(points)


def test_triangles_cover_every_pixel_between_them_once():
    """A fan around the middle of a square: no gap and no pixel outside; nearness is linear on each triangle."""
    side = 41
    corners = [(3.3, 2.7), (3.3, 36.2), (37.9, 36.2), (37.9, 2.7)]
    points = np.array([*corners, (17.21, 23.43)])
    triangles = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
    nearness = 5.0 + 0.1 * points[:, 0] - 0.05 * points[:, 1]
    near, number = nearest_triangles(points, nearness, triangles, side, side)
    x, y = np.meshgrid(np.arange(side) + 0.5, np.arange(side) + 0.5)
    inside = ((x > 3.3) & (x < 37.9) & (y > 2.7) & (y < 36.2)).ravel()
    assert ((number >= 0) == inside).all()
    plane = (5.0 + 0.1 * x - 0.05 * y).ravel()
    assert near[inside] == pytest.approx(plane[inside], rel=1e-6)


def test_rays_meet_a_floor_where_it_is_however_steeply_it_runs_away():
    place = Displacement(rotation_x(1.0, 0.0), Vector(0.0, 0.0, -0.1))
    slab = Triangles([Solid("slab", shapes.block(20.0, 60.0, 0.1), "steel", place)])
    seen = hits_of(slab, camera_on(slab.points, (0.0, -1.0, 0.3), 200, 150), 1)
    top = seen.normals[:, 2] > 0.99
    assert top.sum() > 100
    assert seen.points[top, 2] == pytest.approx(0.0, abs=1e-4)
    assert np.ptp(seen.points[top, 1]) > 50.0


def test_normals_are_those_of_the_corners_and_in_between_by_area():
    body = Triangles([])
    body.points, body.triangles = np.array([(0.0, 0.0, 0.0), (0.0, 4.0, 0.0), (4.0, 0.0, 0.0)]), np.array([(0, 1, 2)])
    body.normals = np.eye(3)
    normals = normals_at(body, np.array([0, 0]), np.array([(0.0, 4.0, 0.0), (1.0, 1.0, 0.0)]))
    assert normals[0] == pytest.approx((0.0, 1.0, 0.0))
    assert normals[1] == pytest.approx(np.array((0.5, 0.25, 0.25)) / math.sqrt(0.375))


def test_triangles_that_face_away_are_not_seen():
    points = np.array([(1.0, 1.0), (1.0, 9.0), (9.0, 9.0)])
    _, number = nearest_triangles(points, np.ones(3), np.array([(2, 1, 0)]), 10, 10)
    assert (number == -1).all()


def test_light_falls_on_what_is_open_and_not_below_a_roof():
    """Over open ground all of sun and sky, under a wide plate nothing, away from a lamp's side neither."""
    place = Displacement(rotation_x(1.0, 0.0), Vector(0.0, 0.0, 0.2))
    casters = Triangles([Solid("roof", shapes.block(2.0, 2.0, 0.1), "steel", place)])
    points = np.array([(0.0, 0.0, 0.0), (50.0, 0.0, 0.0), (50.0, 0.0, 0.0)])
    normals = np.array([(0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
    light = light_on(points, normals, casters, 400)
    assert light.sun[0] == 0.0
    assert light.openness[0] < 0.1
    height = 1.5 / math.sqrt(0.55**2 + 0.75**2 + 1.5**2)
    assert light.sun[1] == pytest.approx(height, rel=0.01)
    assert light.openness[1] == 1.0
    assert (light.sun[2], light.sky[2]) == (0.0, 0.0)


def test_the_ground_is_darker_in_the_shadow():
    image = pixels(picture(scene(block_at(0.0, 0.0, "steel")), (200, 200), (0.0, -1.0, 2.0)))
    brightness = image.sum(axis=2)[:, 150:]  # the sun stands to the left, so the shadow lies to the right
    assert brightness.max() > 740
    assert brightness.min() < 560


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ({"view": "back"}, "view"),
        ({"view": (0.0, 0.0, 0.0)}, "not all 0"),
        ({"view": (1.0, math.nan, 0.0)}, "three numbers"),
        ({"theme": "sepia"}, "theme"),
        ({"size": (5, 100)}, "16 to 4096"),
        ({"size": (100, 100_000)}, "16 to 4096"),
        ({"hidden": ("spring",)}, 'did you mean "springs"'),
    ],
)
def test_what_cannot_be_had_is_said(arguments, problem):
    with refused(problem):
        machine_picture(load("planar-3rpr"), **{"size": SIZE, **arguments})


def test_signs_alone_are_drawn_without_shadow_and_nothing_is_refused():
    arrow = Solid("load/force", shapes.arrow(0.5, 0.02), "load", layer="load")
    assert share_of(pixels(picture(scene(arrow), SIZE)), "passive") > 0.005
    sign = Solid("frame O/x", shapes.arrow(0.5, 0.02), "x axis", layer="frames")
    assert share_of(pixels(picture(scene(sign), SIZE, hidden=())), "passive") > 0.005
    with refused("nothing to draw"):
        picture(scene(sign), SIZE)


def test_a_pose_out_of_reach_cannot_be_drawn():
    with refused("cannot be drawn at this pose"):
        scene_of(load("delta", ["pose.z=-30 m"]))
