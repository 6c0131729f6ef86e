"""A machine as a scene: every part of every machine has its place, its kind and its material."""

import json
import math

import pytest

from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.kinetostatics.indices import PrincipalCompliances
from kinetostat.kinetostatics.loading import deflected_links, deflection
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import changed, load
from kinetostat.views.scene.anatomy import anatomy, proportions_of
from kinetostat.views.scene.machine_scene import convex_hull, machine_scene, rounded_hull
from kinetostat.views.scene.overlays import Deflection, compliance_overlays, deflection_overlays, exaggeration_of
from kinetostat.views.scene.shapes import shaft
from kinetostat.views.scene.solids import LAYERS, LOOKS, Extruded, Turned, as_data
from machines import every_machine


def scene_of(machine):
    configuration = respond(machine).configuration
    return machine_scene(machine, configuration, proportions_of(machine, configuration))


def legs_of(name):
    return {leg.name: anatomy(leg) for leg in respond(load(name)).configuration.legs}


def numbers_in(data):
    if isinstance(data, dict):
        data = list(data.values())
    if isinstance(data, list):
        for part in data:
            yield from numbers_in(part)
    elif isinstance(data, float):
        yield data


@every_machine
def test_every_machine_can_be_drawn(case):
    scene = scene_of(case.machine)
    names = [solid.name for solid in scene.solids]
    assert len(set(names)) == len(names)
    assert {solid.material for solid in scene.solids} <= set(LOOKS)
    assert {solid.layer for solid in scene.solids} | {label.layer for label in scene.labels} <= set(LAYERS)
    data = as_data(scene)
    assert all(math.isfinite(number) for number in numbers_in(data))
    assert json.loads(json.dumps(data)) == data
    assert all(scene.floor <= point.z for leg in respond(case.machine).configuration.legs for point in leg.path)


@every_machine
def test_every_leg_is_drawn_from_foot_to_head(case):
    """Links and rails connect the points of the chain without a gap."""
    for leg in respond(case.machine).configuration.legs:
        parts = anatomy(leg)
        at = parts.foot
        for link in parts.links:
            assert link.start.components() == pytest.approx(at.components(), abs=1e-9)
            at = link.end
        assert parts.head.components() == pytest.approx(at.components(), abs=1e-9)


@every_machine
def test_a_part_keeps_its_name_while_the_machine_moves(case):
    path = next(control for control in case.ranges if control.startswith("pose."))
    low, high = case.ranges[path]
    moved = changed(case.machine, {path: 0.9 * low + 0.1 * high})
    configuration = respond(moved).configuration
    sizes = proportions_of(case.machine, respond(case.machine).configuration)
    there = machine_scene(moved, configuration, sizes)
    assert {s.name for s in there.solids} == {s.name for s in scene_of(case.machine).solids}


@pytest.mark.parametrize(
    ("machine", "leg", "joints", "links", "rails"),
    [
        ("zhang-gosselin-4dof", "leg 1", ["universal", "spherical"], ["telescope"], 0),
        ("zhang-gosselin-4dof", "passive leg", ["revolute", "revolute", "universal"], ["bar", "bar"], 0),
        ("passive-leg-5dof", "passive leg", ["universal", "revolute", "universal"], ["bar", "bar"], 0),
        ("hexapod-rus", "leg 1", ["motor", "universal", "spherical"], ["bar", "bar"], 0),
        ("delta", "leg 1", ["motor"], ["bar", "bars"], 0),
        ("orthoglide", "leg x", [], ["bar", "bars"], 1),
        ("planar-3rpr", "leg 1", ["revolute", "revolute"], ["telescope"], 0),
        ("tricept", "tube", ["universal"], ["telescope"], 0),
        ("tripteron", "z", ["revolute", "revolute", "revolute"], ["bar", "bar"], 1),
    ],
)
def test_joints_and_links_are_seen_by_their_kind(machine, leg, joints, links, rails):
    parts = legs_of(machine)[leg]
    assert [joint.kind for joint in parts.joints] == joints
    assert [link.kind for link in parts.links] == links
    assert len(parts.rails) == rails


def test_a_leg_whose_actuator_has_no_stiffness_is_drawn_as_removed():
    assert legs_of("passive-leg-4dof-driven")["leg 1"].removed
    materials = {s.material for s in scene_of(load("passive-leg-4dof-driven")).solids if s.name.startswith("leg 1 act")}
    assert "removed" in materials
    assert "actuated" not in materials


def test_virtual_springs_are_drawn_unless_they_are_rigid():
    flexible = scene_of(load("zhang-gosselin-4dof"))
    rigid = scene_of(load("zhang-gosselin-4dof", ["stiffness.passive_links=rigid"]))
    assert [s.name for s in flexible.solids if s.layer == "springs"] == [
        "passive link 1/spring",
        "passive link 2/spring",
    ]
    assert not [s for s in rigid.solids if s.layer == "springs"]


def test_the_cylinder_keeps_its_length_while_the_rod_comes_out():
    machine = load("zhang-gosselin-4dof")
    sizes = proportions_of(machine, respond(machine).configuration)

    def length(moved, part):
        scene = machine_scene(moved, respond(moved).configuration, sizes)
        (solid,) = [s for s in scene.solids if s.name == f"leg 1 actuator/{part}"]
        return solid.shape.profile[-1][1]

    higher = changed(machine, {"pose.z": 0.75})
    assert length(higher, "cylinder") == length(machine, "cylinder")
    assert length(higher, "rod") > length(machine, "rod") + 0.03


def test_beams_have_their_section_and_rails_stay():
    machine = load("tripteron", ["sections.bar.diameter=12 cm"])
    scene = scene_of(machine)
    (bar,) = [s for s in scene.solids if s.name == "z proximal/bar"]
    assert isinstance(bar.shape, Turned)
    assert max(radius for radius, _ in bar.shape.profile) == pytest.approx(0.06)
    sizes = proportions_of(machine, respond(machine).configuration)
    moved = changed(machine, {"pose.z": 0.55})
    after = {s.name: s for s in machine_scene(moved, respond(moved).configuration, sizes).solids}
    before = {s.name: s for s in scene.solids}
    assert after["z slide actuator/rail"].place == before["z slide actuator/rail"].place
    lift = after["z slide actuator/carriage"].place.translation - before["z slide actuator/carriage"].place.translation
    assert lift.components() == pytest.approx((0.0, 0.0, 0.05))


def test_the_plates_lie_behind_the_joints():
    """The base plate below its joints, the platform above the legs, both clear of them."""
    solids = {s.name: s for s in scene_of(load("hexapod")).solids}
    assert solids["base/plate"].place.translation.z < 0.015
    assert solids["platform/plate"].place.translation.z > 0.075
    assert solids["base/plate"].shape.height > 0.0


def test_a_delta_hangs_below_its_base():
    solids = {s.name: s for s in scene_of(load("delta")).solids}
    assert solids["base/plate"].place.translation.z > 0.0
    assert solids["platform/plate"].place.translation.z < -0.75


def test_ellipsoids_have_the_axes_of_the_compliances():
    machine = load("hexapod")
    configuration = respond(machine).configuration
    sizes = proportions_of(machine, configuration)
    axes = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]
    found = compliance_overlays(
        machine, configuration, sizes, {"translation": PrincipalCompliances([1e-9, 2e-9, 4e-9], axes)}
    )
    (body,) = [s for s in found if s.name == "ellipsoid of translation"]
    assert body.scale[0] / body.scale[2] == pytest.approx(0.25)
    assert body.scale[1] / body.scale[2] == pytest.approx(0.5)
    assert body.place.translation == configuration.platform.translation
    assert abs(body.place.rotation.z.x) == 1.0
    (arrow,) = [s for s in found if s.name == "softest translation"]
    assert abs(arrow.place.rotation.z.x) == pytest.approx(1.0)


def test_the_ghost_is_exaggerated_by_a_round_factor_and_moves_with_the_tool():
    machine = load("hexapod")
    response = respond(machine)
    sizes = proportions_of(machine, response.configuration)
    wrench = Wrench(ZERO, Vector(0.0, 0.0, -500.0))
    motion = deflection(response.statics, wrench)
    moved = Deflection(wrench, motion, tuple(deflected_links(response, wrench)))
    solids, factor = deflection_overlays(machine, response.configuration, sizes, moved)
    assert f"{factor:.0e}"[0] in "125"
    ghost = {s.name: s for s in solids}["ghost/platform/plate"]
    plate = {s.name: s for s in scene_of(machine).solids}["platform/plate"]
    drop = ghost.place.translation.z - plate.place.translation.z
    assert drop == pytest.approx(factor * motion.translational.z, rel=1e-6)
    assert 0.02 < abs(drop) / sizes.diagonal < 0.2
    again, chosen = deflection_overlays(machine, response.configuration, sizes, moved, 7.0)
    assert chosen == 7.0
    assert {s.name for s in again} == {s.name for s in solids}


COPIED = """schema = 1
name = "Planar 3-RRR"
family = "legs"
space = "planar"
platform = { point = [0, 0, 0] }
pose = { x = 0, y = 0, yaw = 0 }
sections = { bar = { shape = "rectangle", width = "60 mm", height = "40 mm", material = "aluminium" } }
[[legs]]
name = "leg"
copies = 3
joints = [
  { name = "drive", type = "revolute", joins = ["base", "crank"], point = [0.2, 0, 0], axis = [0, 0, 1], \
actuated = true, stiffness = 1e4 },
  { name = "elbow", type = "revolute", joins = ["crank", "rod"], point = [0.14, 0.1, 0], axis = [0, 0, 1] },
  { name = "wrist", type = "revolute", joins = ["rod", "platform"], point = [0.05, 0, 0], axis = [0, 0, 1] },
]
links = { crank = { model = "beam", section = "bar", up = [0, 0, 1] } }
"""


def test_links_of_copied_legs_have_the_section_of_the_leg_that_is_written(tmp_path):
    (tmp_path / "copied.toml").write_text(COPIED)
    solids = {s.name: s for s in scene_of(load(tmp_path / "copied.toml")).solids}
    for number in (1, 2, 3):
        assert isinstance(solids[f"leg {number} crank/bar"].shape, Extruded)
        assert isinstance(solids[f"leg {number} link 2/bar"].shape, Turned)


@pytest.mark.parametrize("name", ["hexapod", "tricept"])
def test_the_scene_and_the_figures_exaggerate_alike(name):
    """The passive leg of a tricept ends its path far from the platform, which reaches only to its joints."""
    machine = load(name)
    response = respond(machine)
    wrench = Wrench(Vector(0.0, 50.0, 0.0), ZERO)
    motion = deflection(response.statics, wrench)
    moved = Deflection(wrench, motion, tuple(deflected_links(response, wrench)))
    sizes = proportions_of(machine, response.configuration)
    _, factor = deflection_overlays(machine, response.configuration, sizes, moved)
    assert factor == exaggeration_of(machine, response.configuration, moved, sizes.diagonal)


def test_an_endless_deflection_has_no_ghost():
    machine = load("hexapod")
    response = respond(machine)
    endless = Deflection(Wrench(ZERO, Vector(1.0, 0.0, 0.0)), Twist(ZERO, Vector(math.inf, 0.0, 0.0)), ())
    sizes = proportions_of(machine, response.configuration)
    solids, _ = deflection_overlays(machine, response.configuration, sizes, endless)
    assert [s.name for s in solids] == ["load/force"]


def test_a_plate_of_one_point_is_a_disc_and_of_two_a_capsule():
    disc = rounded_hull([(1.0, 2.0)], 0.5)
    assert all(math.hypot(x - 1.0, y - 2.0) == pytest.approx(0.5) for x, y in disc)
    capsule = rounded_hull([(0.0, 0.0), (2.0, 0.0)], 0.5)
    assert max(x for x, _ in capsule) == pytest.approx(2.5)
    assert max(y for _, y in capsule) == pytest.approx(0.5)


def test_hull_leaves_out_inner_points():
    assert convex_hull([(0, 0), (2, 0), (1, 1), (2, 2), (0, 2), (1, 0)]) == [(0, 0), (2, 0), (2, 2), (0, 2)]


def test_a_shaft_reaches_from_its_start_over_its_length():
    profile = shaft(0.1, 0.5, 0.01, start=0.2).profile
    assert profile[0] == (0.0, 0.2)
    assert profile[-1] == (0.0, pytest.approx(0.7))
    assert max(radius for radius, _ in profile) == 0.1
