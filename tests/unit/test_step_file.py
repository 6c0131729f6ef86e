"""A scene as STEP, read back by Open CASCADE: bodies, names, places, colours and units are the scene's."""

import numpy as np
import pytest

from kinetostat.algebra.vector import IDENTITY, Displacement, Vector
from kinetostat.machine.loading import load
from kinetostat.views.scene import shapes
from kinetostat.views.scene.machine_scene import scene_of
from kinetostat.views.scene.mesh import placed_mesh
from kinetostat.views.scene.solids import BASE, LOOKS, Scene, Solid, linear_rgb
from machines import one_of_each

pytest.importorskip("OCP.STEPCAFControl", reason="Open CASCADE does not start", exc_type=ImportError)

from OCP.Interface import Interface_Static

from kinetostat.exchange.step_file import step_bytes
from step_files import bodies_of, box, centre, is_valid, volume

ROUNDER = 0.011
"""By how much of its volume a solid exceeds its mesh at most: a ball, whose facets are flat both ways."""


@pytest.fixture
def read(tmp_path):
    """What a reader finds of a scene."""

    def bodies(scene, name="machine"):
        path = tmp_path / "machine.step"
        path.write_bytes(step_bytes(scene, name))
        return bodies_of(path)

    return bodies


def scene_with(*solids):
    return Scene(solids, (), Vector(0.0, 0.0, 0.0), 1.0, 0.0)


def shown(scene):
    return {solid.name: placed_mesh(solid) for solid in scene.solids if solid.layer == "machine"}


def centre_of(mesh):
    """Of what the triangles enclose, mm."""
    a, b, c = (mesh.points[mesh.triangles[:, i]] for i in range(3))
    parts = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    return 1e3 * (parts @ (a + b + c)) / 4.0 / mesh.volume


@one_of_each
def test_every_body_is_where_the_scene_has_it(case, read):
    """Valid solids under the scene's names, a little larger than their meshes, about the same centres, in mm."""
    scene = scene_of(case.machine)
    meshes = shown(scene)
    found = {one.path[-1]: one for one in read(scene, case.machine.name)}
    assert found.keys() == meshes.keys()
    sound = {}
    for name, mesh in meshes.items():
        body = found[name]
        if body.part not in sound:
            sound[body.part] = is_valid(body.shape) and 1.0 < volume(body.shape) / mesh.volume < 1.0 + ROUNDER
        size = 1e3 * np.ptp(mesh.points, axis=0).max()
        assert sound[body.part], name
        assert centre(body.shape) == pytest.approx(centre_of(mesh), abs=ROUNDER * size), name


def test_the_whole_fills_the_box_of_its_mesh_in_millimetres(read):
    """It turns the same way, too: facets lie inside of what is round, by less than a percent of a body."""
    scene = scene_of(load("orthoglide"))
    meshes = shown(scene)
    lows, highs = np.split(np.array([box(one.shape) for one in read(scene)]), 2, axis=1)
    points = 1e3 * np.concatenate([mesh.points for mesh in meshes.values()])
    slack = 1e3 * ROUNDER * max(np.ptp(mesh.points, axis=0).max() for mesh in meshes.values())
    assert np.all((lows.min(axis=0) < points.min(axis=0) + 1e-4) & (highs.max(axis=0) > points.max(axis=0) - 1e-4))
    assert lows.min(axis=0) == pytest.approx(points.min(axis=0), abs=slack)
    assert highs.max(axis=0) == pytest.approx(points.max(axis=0), abs=slack)
    assert b"SI_UNIT(.MILLI.,.METRE.)" in step_bytes(scene, "machine")


def test_a_tree_has_the_legs_and_equal_bodies_are_one_part(read):
    """Base, platform and legs hold the bodies; the legs of a cube are all alike."""
    scene = scene_of(load("hexapod-cubic"))
    found = read(scene, "cubic hexapod")
    assert {one.path[0] for one in found} == {"cubic hexapod"}
    assert [*dict.fromkeys(one.path[1] for one in found)] == ["base", "platform", *(f"leg {n}" for n in range(1, 7))]
    assert all(one.path[2].startswith(one.path[1]) for one in found)
    assert len({frozenset(one.part for one in found if one.path[1] == f"leg {n}") for n in range(1, 7)}) == 1
    assert len({one.part for one in found}) == 14
    assert step_bytes(scene, "m").count(b"MANIFOLD_SOLID_BREP") == 14


def test_looks_are_kept(read):
    """A part of another colour is another part."""
    names = ("steel", "actuated", "removed")
    found = read(scene_with(*(Solid(f"base/{name}", shapes.ball(0.1), name) for name in names)))
    assert [one.part for one in found] == ["steel", "actuated", "removed"]
    for one in found:
        assert one.color == pytest.approx(linear_rgb(LOOKS[one.part].color), abs=1e-6)
        assert one.opacity == pytest.approx(LOOKS[one.part].opacity)


def test_places_scales_and_layers_are_those_of_the_scene(read):
    place = Displacement(IDENTITY, Vector(1.0, 2.0, 3.0))
    bolts = [Solid(f"leg/bolt {n}", shapes.pin(0.1, 1.0), "steel", at) for n, at in enumerate((BASE, place), 1)]
    egg = Solid("base/egg", shapes.ball(1.0), "steel", place, (0.1, 0.2, 0.3))
    spring = Solid("leg/spring", shapes.helix(0.1, 0.5, 3.0, 0.01), "spring", layer="springs")
    found = read(scene_with(*bolts, egg, spring))
    assert [(one.path[1:], one.part) for one in found] == [
        (("leg", "leg/bolt 1"), "bolt"), (("leg", "leg/bolt 2"), "bolt"), (("base", "base/egg"), "egg")
    ]  # fmt: skip
    assert centre(found[1].shape) == pytest.approx([1000.0, 2000.0, 3000.0])
    assert box(found[2].shape) == pytest.approx([900.0, 1800.0, 2700.0, 1100.0, 2200.0, 3300.0], rel=1e-6)


def test_parts_of_one_kind_are_told_apart(read):
    bars = [shapes.shaft(0.01, length) for length in (0.1, 0.2, 0.1)]
    found = read(scene_with(*(Solid(f"leg {n}/bar", bar, "steel") for n, bar in enumerate(bars))))
    assert [one.part for one in found] == ["bar", "bar 2", "bar"]


@pytest.mark.parametrize("name", ["Größe α 😀", 'it\'s "quoted" #1 = (;)', "ä'" * 40], ids=["letters", "signs", "long"])
def test_a_name_stays_a_name(name, read):
    """In ASCII, and in the way of STEP for all that is not."""
    scene = scene_with(Solid("base/ball", shapes.ball(0.1), "steel"))
    assert {one.path[0] for one in read(scene, name)} == {name}
    assert step_bytes(scene, name).isascii()


def test_the_same_scene_gives_the_same_bytes():
    """Wherever in memory its parts lie, and however many files were written before."""
    scene = scene_of(load("delta"))
    assert len({step_bytes(scene, "delta") for _ in range(4)}) == 1


def test_the_settings_of_others_are_left_as_they_were():
    scene, setting = scene_with(Solid("base/ball", shapes.ball(0.1), "steel")), "write.surfacecurve.mode"
    written = step_bytes(scene, "ball")
    Interface_Static.SetCVal_s(setting, "On")
    assert step_bytes(scene, "ball") == written
    assert Interface_Static.CVal_s(setting) == "On"
