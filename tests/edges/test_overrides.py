"""`--set path=value`: the forms that are taken, and the words for those that are not. Also the good forms of files."""

import copy
import math

import pytest
from machine_files import GOOD, HUGE_NUMBER, NAME, refusal

from kinetostat.machine.loading import build, bundled, load
from kinetostat.machine.parameters import values
from kinetostat.spec import document
from refusals import refused

TAKEN = [
    (["geometry.base_radius=26 cm"], {"geometry.base_radius": 0.26}),
    (['geometry.base_radius="26 cm"'], {"geometry.base_radius": 0.26}),
    (["geometry.base_radius=0.26"], {"geometry.base_radius": 0.26}),
    (["geometry.base_radius = 0.26 "], {"geometry.base_radius": 0.26}),
    (["geometry.base_radius=1", "geometry.base_radius=2"], {"geometry.base_radius": 2.0}),
    (["pose.x=-1e-2"], {"pose.x": -0.01}),
    (["pose.theta5=-0.5 rad"], {"pose.theta5": -0.5}),
    (["stiffness.passive_links=rigid"], {f"stiffness.passive_links.{i}": math.inf for i in range(2)}),
    (["stiffness.passive_links.0=1e5 N*m/rad"], {"stiffness.passive_links.0": 1e5}),
    (
        ['stiffness.passive_links=["rigid", 7]'],
        {"stiffness.passive_links.0": math.inf, "stiffness.passive_links.1": 7.0},
    ),
    (["stiffness.actuator.2=7"], {"stiffness.actuator.2": 7.0}),
    (["stiffness.actuator.0=0"], {"stiffness.actuator.0": 0.0}),
    (["stiffness.actuator=5 N/m"], {f"stiffness.actuator.{i}": 5.0 for i in range(4)}),
    (["stiffness.actuator=[1, 2, 3, '4 N/m']"], {f"stiffness.actuator.{i}": i + 1.0 for i in range(4)}),
    (
        ["stiffness.actuator=5", "stiffness.actuator.3=6"],
        {f"stiffness.actuator.{i}": [5.0, 6.0][i == 3] for i in range(4)},
    ),
    (["geometry.passive_links.1=70 cm"], {"geometry.passive_links.1": 0.7}),
    (["geometry.passive_leg_offset=1 cm"], {"geometry.passive_leg_offset": 0.01}),
    (["name=another = one"], {}),
]


@pytest.mark.parametrize(("settings", "changes"), TAKEN, ids=lambda part: str(part)[:60])
def test_an_override_changes_what_it_names_and_nothing_else(settings, changes):
    expected = values(load(NAME)) | changes
    assert values(load(NAME, settings)) == pytest.approx(expected, rel=1e-15)


def test_an_entry_of_a_list_that_the_file_leaves_out_is_set_beside_the_others():
    tables = document.parse(bundled()["delta"], "delta")
    before = copy.deepcopy(tables)
    machine = build(tables, "delta", ["load.gravity.2=-9.81", "tool.offset.1=5 mm", "load.drag.force.0=3 N"])
    assert machine.tables["load"].gravity == (0.0, 0.0, -9.81)
    assert machine.tables["tool"].offset == (0.0, 0.005, 0.0)
    assert machine.tables["load.drag"].force == (3.0, 0.0, 0.0)
    assert tables == before
    with refused("load.gravty is not known; did you mean gravity"):
        build(tables, "delta", ["load.gravty.2=1"])


@pytest.mark.parametrize(
    ("by_axis", "by_number"),
    [("load.force.z", "load.force.2"), ("force.y", "load.force.1"), ("tool.inertia.xy", "tool.inertia.3")],
)
def test_components_are_named_by_their_axes(by_axis, by_number):
    inertia = "tool.inertia=[1, 1, 1, 0, 0, 0]"
    machine = load("hexapod", [inertia, f"{by_number}=0.25"])
    assert load("hexapod", [inertia, f"{by_axis}=0.25"]) == machine
    assert load("hexapod", [inertia]).with_values({by_axis: 0.25}) == machine


def test_an_axis_that_a_vector_does_not_have_is_refused_as_it_was_written():
    with refused("force.w"):
        load("hexapod").with_values({"force.w": 1.0})


def test_text_may_hold_an_equals_sign():
    assert load(NAME, ["name=one = two"]).name == "one = two"


REFUSED = [
    ("geometry.base_radius", ['"geometry.base_radius"', "path=value", '--set geometry.base_radius="26 cm"']),
    ("", ["path=value"]),
    ("=3", ["path=value"]),
    ("  = 3", ["path=value"]),
    ("geometry.base_radius=", ["geometry.base_radius", "it must be a length"]),
    ("geometry.base_radius=12 kg", ["geometry.base_radius", '"12 kg"', "not a unit of length"]),
    ("geometry.base_radius=nan", ["geometry.base_radius", "not a finite number"]),
    ("geometry.base_radios=1", ["geometry.base_radios is not known", "did you mean base_radius"]),
    ("geometri.base_radius=1", ['"geometri.base_radius" is not a field', "did you mean geometry.base_radius?"]),
    ("bass_radius=1", ['"bass_radius" is not a field', "did you mean base_radius?"]),
    ("geometry.base_radius.x=1", ["geometry.base_radius.x", '"22 cm"', "shorter path"]),
    ("geometry.base_radius.x.y=1", ["geometry.base_radius.x.y", '"22 cm"', "shorter path"]),
    ("geometry=3", ["geometry is 3", "must be a table"]),
    ("stiffness.actuator.4=1", ["stiffness.actuator.4", "is not an entry", "entries 0 to 3"]),
    ("stiffness.actuator.-1=1", ["stiffness.actuator.-1", "shorter path"]),
    ("geometry.passive_links.-1=1", ["geometry.passive_links.-1", "is not an entry", "0 to 1"]),
    ("geometry.passive_links.x=1", ["geometry.passive_links.x", "is not an entry", "0 to 1"]),
    ("geometry.passive_links.2=1", ["is not an entry", "0 to 1"]),
    ("geometry.passive_links.0000000005=1", ["is not an entry", "0 to 1"]),
    (f"geometry.passive_links.{HUGE_NUMBER}=1", ["is not an entry", "0 to 1"]),
    ("geometry.passive_links.²=1", ["is not an entry"]),
    ("geometry..base_radius=1", ["not known"]),
    ("geometry.=1", ["not known"]),
    (".=1", ['"." is not a field']),
    ("schema=2", ["schema is 2", "schema = 1"]),
    ("family=other", ['family is "other"', "passive-leg-4dof"]),
    ("name=", ['name is ""']),
    ("pose=[]", ["pose is []", "must be a table"]),
    ("load.force=-500 N", ['load.force is "-500 N"', "a list of 3", '"500 N"']),
    ("load.moment=3", ["load.moment is 3", "a list of 3"]),
    ("tool.offset=80 mm", ['tool.offset is "80 mm"', "a list of 3"]),
    ("tool.offset=[1, 2]", ["it has 2 entries; give 3."]),
    (f"geometry.base_radius={HUGE_NUMBER}", ["geometry.base_radius"]),
    (f"geometry.base_radius=0x{'f' * 5000}", ["geometry.base_radius"]),
    (f"geometry.base_radius={'[' * 5000}", ["geometry.base_radius", "…"]),
    ("geometry.base_radius=1\nbase_angle=2", ["geometry.base_radius"]),
    ("geometry." + "a." * 6 + "b=1", ["not known"]),
    ("a." * 7 + "b=1", ["is not a field of family"]),
    ("a." * 3000 + "b=1", ["is not a field of family", "…"]),
    ("geometry." + "a." * 3000 + "b=1", ["more than 8 parts"]),
]


@pytest.mark.parametrize(("setting", "words"), REFUSED, ids=lambda part: str(part)[:40])
def test_a_bad_override_is_refused_with_the_way_out(setting, words):
    message = refusal(NAME, setting)
    for word in words:
        assert word in message


FORMS = [
    ('"22 cm"', "0.22"),
    ('"22 cm"', '"0.22"'),
    ('"22 cm"', '"220mm"'),
    ("schema = 1\n", ""),
    ('["68 cm", "68 cm"]', '"68 cm"'),
    ('["68 cm", "68 cm"]', "0.68"),
    ('["68 cm", "68 cm"]', '[0.68, "680 mm"]'),
    ('"1000 N/m"', "1000"),
    ('"1000 N/m"', "[1000, 1e3, '1 kN/m', \"1 N/mm\"]"),
    ('"rigid"', '"Rigid"'),
    ('["rigid", "1e7 N*m/rad"]', '["rigid", 1e7]'),
    ('theta6 = "120 deg"', 'theta6 = "120 deg" # a comment'),
    ("[pose]", "\r\n[pose]\r\n"),
]


@pytest.mark.parametrize(("old", "new"), FORMS)
def test_one_machine_can_be_written_in_many_ways(old, new):
    plain = values(build(document.parse(GOOD, "x"), "x"))
    assert old in GOOD
    assert values(build(document.parse(GOOD.replace(old, new, 1), "x"), "x")) == pytest.approx(plain, rel=1e-15)


def test_the_good_file_is_read_in_si():
    found = values(build(document.parse(GOOD, "x"), "x"))
    assert found["geometry.base_radius"] == pytest.approx(0.22)
    assert found["geometry.passive_leg_offset"] == 0.0
    assert found["pose.theta6"] == pytest.approx(2 * math.pi / 3)
    assert [found[f"stiffness.actuator.{i}"] for i in range(4)] == [1000.0] * 4
    assert (found["stiffness.passive_links.0"], found["stiffness.passive_links.1"]) == (math.inf, 1e7)


@pytest.mark.parametrize(
    ("name", "short", "whole"),
    [
        ("hexapod", "x=5 mm", "pose.x=5 mm"),
        ("hexapod", "base_radius=12 cm", "geometry.base_radius=12 cm"),
        ("hexapod", "base_angles.1=0.5", "geometry.base_angles.1=0.5"),
        ("hexapod", "geometry_base_angles_1=0.5", "geometry.base_angles.1=0.5"),
        ("tripteron", "x=5 mm", "pose.x=5 mm"),
        ("hexapod", "gravity=[0, 0, -9.81]", "load.gravity=[0, 0, -9.81]"),
        ("tripteron", "gravity=[0, 0, -9.81]", "load.gravity=[0, 0, -9.81]"),
    ],
)
def test_a_field_has_the_same_names_everywhere(name, short, whole):
    machine = load(name, [short])
    assert machine == load(name, [whole])
    assert machine.written.settings == (whole,), "a saved file keeps its comments"


def test_a_name_that_no_field_has_is_refused_as_it_was_written():
    with refused('"wrong" is not a field of family hexapod'):
        load("hexapod", ["wrong=1"])
    with refused(r'"force.w" is not a field of family hexapod; did you mean force\.[xyz]\?'):
        load("hexapod", ["force.w=1"])


@pytest.mark.parametrize("name", ["hexapod", "tripteron", "cogiro"])
def test_an_entry_of_a_common_vector_has_short_names_in_every_file(name):
    whole = load(name, ["load.force.0=3 N", "tool.payload_centre.2=1 mm"])
    for axis in ("0", "x"):
        assert load(name, [f"force.{axis}=3 N", "payload_centre.z=1 mm"]) == whole
        assert load(name).with_values({f"force.{axis}": "3 N", "payload_centre.z": "1 mm"}) == whole
