"""A scene as GLB, read by trimesh and by hand: names, places, volumes and looks are the scene's."""

import io
import json
import struct

import numpy as np
import pytest
import trimesh

from kinetostat.algebra.vector import IDENTITY, Displacement, Vector
from kinetostat.exchange.solids import glb
from kinetostat.machine.loading import load
from kinetostat.views.scene import shapes
from kinetostat.views.scene.machine_scene import scene_of
from kinetostat.views.scene.mesh import placed_mesh
from kinetostat.views.scene.solids import LOOKS, Scene, Solid
from machines import every_machine


def read(data):
    return trimesh.load(io.BytesIO(data), file_type="glb", process=False)


def parts_of(data):
    """The JSON of a GLB and its buffer."""
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    rest, kind = struct.unpack_from("<I4s", data, 20 + size)
    assert (kind, 28 + size + rest) == (b"BIN\0", len(data))
    return json.loads(data[20 : 20 + size]), data[28 + size :]


@every_machine
def test_every_body_stands_where_the_scene_has_it(case):
    """Another program finds the same corners and volumes, in metres with y up."""
    scene = scene_of(case.machine)
    shown = {solid.name: placed_mesh(solid) for solid in scene.solids if solid.layer != "frames"}
    found = read(glb(scene))
    nodes = set(found.graph.nodes_geometry)
    assert nodes == set(shown)
    for name in nodes:
        place, geometry = found.graph[name]
        body = found.geometry[geometry].copy().apply_transform(place)
        points = shown[name].points
        expected = np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)
        assert body.vertices == pytest.approx(expected, abs=1e-6)
        assert body.volume == pytest.approx(shown[name].volume, rel=1e-4)


def test_equal_shapes_share_their_triangles():
    """A hexapod's six legs need the data of one."""
    scene = scene_of(load("hexapod"))
    document, buffer = parts_of(glb(scene))
    shown = [solid for solid in scene.solids if solid.layer != "frames"]
    shapes_shown = {solid.shape for solid in shown}
    assert len(document["meshes"]) == len({(solid.shape, solid.material) for solid in shown}) < len(shown)
    assert len(document["accessors"]) == 3 * len(shapes_shown)
    assert len(buffer) == document["buffers"][0]["byteLength"]
    assert all(view["byteOffset"] % 4 == 0 for view in document["bufferViews"])


def test_materials_have_the_looks():
    solids = [Solid(name, shapes.ball(0.1), name) for name in ("steel", "removed")]
    document, _ = parts_of(glb(Scene(tuple(solids), (), Vector(0.0, 0.0, 0.0), 1.0, 0.0)))
    steel, removed = document["materials"]
    assert (steel["alphaMode"], removed["alphaMode"]) == ("OPAQUE", "BLEND")
    surface = steel["pbrMetallicRoughness"]
    assert (surface["metallicFactor"], surface["roughnessFactor"]) == (LOOKS["steel"].metalness, 0.24)
    assert surface["baseColorFactor"] == pytest.approx([0.651, 0.687, 0.730, 1.0], abs=1e-3)  # of sRGB d3 d8 de
    assert removed["pbrMetallicRoughness"]["baseColorFactor"][3] == LOOKS["removed"].opacity


def test_a_solid_keeps_its_scale_and_hidden_layers_stay_out():
    place = Displacement(IDENTITY, Vector(1.0, 2.0, 3.0))
    ellipsoid = Solid("ellipsoid", shapes.ball(1.0), "translation", place, (0.1, 0.2, 0.3), "ellipsoids")
    bolt = Solid("bolt", shapes.pin(0.1, 1.0), "steel")
    scene = Scene((ellipsoid, bolt), (), Vector(0.0, 0.0, 0.0), 1.0, 0.0)
    (node,) = [node for node in parts_of(glb(scene))[0]["nodes"] if node["name"] == "ellipsoid"]
    assert node["matrix"] == [0.1, 0, 0, 0, 0, 0.2, 0, 0, 0, 0, 0.3, 0, 1.0, 2.0, 3.0, 1.0]
    assert {n["name"] for n in parts_of(glb(scene, ("ellipsoids",)))[0]["nodes"]} == {"machine", "bolt"}


def test_the_same_scene_gives_the_same_bytes():
    assert glb(scene_of(load("delta"))) == glb(scene_of(load("delta")))
