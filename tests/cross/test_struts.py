"""Struts written leg by leg: the stiffness of a rod is EA/L at the pose, as in a family and as written by hand."""

import math

import numpy as np
import pytest

from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import as_toml, build
from kinetostat.machine.loads import moving_mass
from kinetostat.machine.parameters import with_values
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import analyze
from kinetostat.studies.sensitivity import sensitivity
from kinetostat.tolerances import AGREED
from kinetostat.validation.comparison import validate
from machines import load_without_limits

AREA = math.pi * 0.02**2 / 4.0
STRUTS = """
schema = 1
name   = "Six struts"
family = "legs"
[platform]
point = [0, 0, "500 mm"]
[pose]
x = "20 mm"
y = "-30 mm"
z = "520 mm"
roll  = "5 deg"
pitch = "-4 deg"
yaw   = "10 deg"
[sections.rod]
shape    = "round"
diameter = "20 mm"
material = "steel"
[[legs]]
name = "leg"
copies = 6
mirrored = true
joints = [
  { name = "cardan", type = "universal", joins = ["base", "cylinder"], point = ["300 mm", "40 mm", 0], axis = "ball" },
  { name = "drive", type = "prismatic", joins = ["cylinder", "rod"], point = ["250 mm", "50 mm", "125 mm"], axis = "ball", actuated = true, stiffness = "100 N/um", section = "rod" },
  { name = "ball", type = "spherical", joins = ["rod", "platform"], point = ["100 mm", "80 mm", "500 mm"] },
]
"""  # noqa: E501
COLUMN = """
schema = 1
name   = "Column"
family = "legs"
[platform]
point = [0, 0, "400 mm"]
[pose]
z = "400 mm"
yaw = 0
[[legs]]
name = "leg"
joints = [
  { name = "drive", type = "prismatic", joins = ["base", "nut"], point = [0, 0, "100 mm"], axis = [0, 0, 1], actuated = true, stiffness = ["nut 200 N/um", "bearing 300 N/um"], axial_rigidity = "3e7 N" },
  { name = "swivel", type = "revolute", joins = ["nut", "platform"], point = [0, 0, "350 mm"], axis = [0, 0, 1], stiffness = "rigid" },
]
"""  # noqa: E501


@pytest.mark.parametrize("z", [0.4, 0.9])
def test_a_screw_from_the_base_grows_with_the_travel_of_its_nut(z):
    machine = build(COLUMN, "column", [f"pose.z={z}"])
    by_hand = 1.0 / 200e6 + 1.0 / 300e6 + (z - 0.4 + 0.25) / 3e7
    assert analyze(machine).C[5, 5] == pytest.approx(by_hand, rel=1e-12)


def test_struts_are_the_legs_of_a_family_at_every_pose():
    family = load_without_limits("hexapod", ["stiffness.leg_axial=2e7 N"])
    document = document_of(family)
    for leg in document["legs"]:
        drive = next(joint for joint in leg["joints"] if joint.get("actuated"))
        drive["stiffness"], drive["axial_rigidity"] = drive["stiffness"][0].removeprefix("actuator "), "2e7 N"
    rng = np.random.default_rng(3)
    poses = {f"pose.{name}": float(rng.uniform(-0.01, 0.01)) for name in ("x", "y", "roll", "pitch", "yaw")}
    for height in (0.12, 0.2):
        there = poses | {"pose.z": height}
        legs, theirs = (with_values(machine, there) for machine in (build(document, "legs"), family))
        assert pytest.approx(analyze(theirs).C, rel=1e-9, abs=1e-20) == analyze(legs).C


def test_a_rod_has_the_stiffness_of_its_cross_section_at_its_length_and_a_share_of_its_own():
    response = respond(build(STRUTS, "struts"))
    for leg in response.configuration.legs:
        rod = next(spring for spring in leg.springs if spring.kind == "drive rod")
        length = math.dist(*(map(float, joint.point.components()) for joint in (leg.passive[0], leg.passive[-1])))
        assert float(rod.stiffness) == pytest.approx(210e9 * AREA / length, rel=1e-12)


def test_both_bodies_of_a_strut_have_the_mass_of_its_cross_section():
    machine = build(STRUTS, "struts")
    length = math.dist((0.3, 0.04, 0.0), (0.25, 0.05, 0.125)) + math.dist((0.25, 0.05, 0.125), (0.1, 0.08, 0.5))
    assert moving_mass(machine, machine.configure([0.0] * machine.chains().size)) == pytest.approx(
        6 * 7850.0 * AREA * length, rel=1e-12
    )


def test_batches_and_derivatives_know_that_the_length_depends_on_the_pose():
    machine = build(STRUTS, "struts")
    heights = np.array([0.45, 0.5, 0.55])
    batch = evaluate(machine, PointTable({"pose.z": heights}), ["compliance_z"]).values["compliance_z"]
    alone = [analyze(with_values(machine, {"pose.z": float(z)})).C[5, 5] for z in heights]
    assert batch == pytest.approx(alone, rel=1e-10)
    exact = {row.path: row.derivatives[0] for row in sensitivity(machine, ["compliance_z"]).parameters}
    for path, value in (("sections.rod.diameter", 0.02), ("pose.z", 0.52), ("legs.leg.ball.point.2", 0.5)):
        ends = [analyze(with_values(machine, {path: value + step})).C[5, 5] for step in (-1e-6, 1e-6)]
        assert exact[path] == pytest.approx((ends[1] - ends[0]) / 2e-6, rel=1e-6)


def test_a_saved_machine_has_its_rods_back():
    machine = with_values(build(STRUTS, "struts"), {"sections.rod.diameter": 0.03})
    again = build(as_toml(machine), "again")
    assert pytest.approx(analyze(machine).C, rel=1e-12) == analyze(again).C


@pytest.mark.parametrize("z", ["450 mm", "600 mm"])
def test_an_independent_engine_agrees_at_two_lengths(z):
    pytest.importorskip("Pynite")
    assert validate(build(STRUTS, "struts", [f'pose.z="{z}"'])).difference < AGREED


SLIDE = 'prismatic", joins = ["cylinder", "rod"], point = ["250 mm", "50 mm", "125 mm"], axis = "ball", '
REFUSED = [
    (
        f"{SLIDE}actuated = true",
        f"{SLIDE.replace('prismatic', 'cylindrical')}actuated = 'translation'",
        "only an actuated prismatic joint is a strut",
    ),
    (", actuated = true", "", "not actuated"),
    ('section = "rod" }', 'section = "rods" }', 'did you mean "rod"'),
    ('section = "rod" }', 'section = "rod", axial_rigidity = "2e7 N" }', "leave one out"),
    ('section = "rod" }', 'axial_rigidity = "0 N" }', "axial_rigidity"),
    ('section = "rod" }', 'axial_rigidity = "20 N/um" }', "axial rigidity"),
    ('{ name = "cardan", type = "universal"', '{ name = "cardan", type = "prismatic"', "where its rod begins"),
]


@pytest.mark.parametrize(("old", "new", "words"), REFUSED)
def test_what_is_not_a_strut_is_refused_with_leg_and_joint(old, new, words):
    text = STRUTS.replace(old, new)
    if new.startswith('{ name = "cardan"'):
        text = text.replace('point = ["300 mm", "40 mm", 0], axis = "ball"', "point = [0, 0, 0], axis = [1, 0, 0]")
    with pytest.raises(InputError, match=words) as refusal:
        build(text, "struts")
    assert "drive" in str(refusal.value)
    assert "leg" in str(refusal.value)
