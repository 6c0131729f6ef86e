"""Saving keeps what was written, and the saved file gives exactly the same machine."""

import difflib
import math
from dataclasses import replace

import pytest

from kinetostat.machine.loading import as_toml, build, bundled, changed, load, read_again
from kinetostat.machine.parameters import parameters, values, with_values
from kinetostat.machine.saving import as_file
from kinetostat.spec.errors import InputError
from kinetostat.units import KINDS, parse, written_value

OWN = """\
# what the designer wrote
schema = 1
name = "Mine"      # still without a better one
family = "passive-leg-4dof"
pose = { z = "680 mm", x = 0, theta6 = "120 deg", theta5 = "-60 deg" }

[stiffness]   # before the geometry
actuator = "1 N/mm"            # one for all
passive_links = [ # base, then platform
    "rigid",
    "1e7 N*m/rad", # bending of the upper one
]

[geometry]
base_radius = 0.22
platform_radius = '12 cm'
base_angle = "30 deg"
platform_angle = "60 deg"
passive_links = ["68 cm", "680 mm"]
"""


def same(first, second):
    alike = (first.name, first.family.name, first.family.literals) == (
        second.name,
        second.family.name,
        second.family.literals,
    )
    return alike and values(first) == values(second)


def difference(before: str, after: str) -> list[str]:
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), lineterm="", n=0)
    return [line for line in lines if line[0] in "+-" and line[:3] not in ("+++", "---")]


@pytest.mark.parametrize("name", bundled())
def test_what_is_not_changed_is_saved_as_it_was_written(name):
    assert as_file(load(name)) == bundled()[name]


@pytest.mark.parametrize("name", ["hexapod", "tripteron", "zhang-gosselin-4dof", "delta"])
@pytest.mark.numbers
def test_one_changed_number_changes_one_place(name):
    """Every parameter in turn; the file reads back as exactly the machine that was saved."""
    machine, tried = load(name), 0
    for parameter in parameters(machine.family):
        number = float(values(machine)[parameter.leaves[-1]])
        new = number * 1.1 if number and math.isfinite(number) else 0.0123456789012345
        other = with_values(machine, {parameter.leaves[-1]: new})
        try:
            build(as_toml(other))
        except InputError:
            continue
        text, tried = as_file(other), tried + 1
        assert same(build(text), other), parameter.path
        assert len(difference(bundled()[name], text)) <= 3, "a line, or a table of one line at the end"
    assert tried > 15


def test_units_comments_and_order_stay():
    machine = changed(
        build(OWN),
        {
            "geometry.base_radius": 0.25,
            "geometry.platform_radius": 0.1,
            "pose.theta5": math.radians(-45.0),
            "stiffness.actuator": 2e3,
            "stiffness.passive_links.1": math.inf,
        },
    )
    text = as_file(replace(machine, name="Ours"))
    assert 'name = "Ours"      # still' in text
    assert 'theta6 = "120 deg", theta5 = "-45 deg" }' in text
    assert 'actuator = "2 N/mm"            # one for all' in text
    assert "base_radius = 0.25\n" in text
    assert 'platform_radius = "10 cm"\n' in text
    assert '    "rigid",\n    "rigid", # bending of the upper one\n' in text
    assert text.index("# what the designer wrote") < text.index("[stiffness]   # before") < text.index("[geometry]")


def test_comments_stay_in_their_column():
    text = as_file(changed(load("hexapod"), {"geometry.base_height": 0.1125}))
    assert 'base_height     = "112.5 mm"  # of the base joints' in text


def test_overrides_are_saved_as_they_were_typed():
    machine = load(
        "hexapod", ["geometry.base_radius=13 cm", "geometry.base_angles.1=0.125 rad", 'load.force=[0, 0, "-1 kN"]']
    )
    text = as_file(machine)
    assert 'base_radius     = "13 cm"' in text
    assert 'base_angles     = ["-10 deg", "0.125 rad", "110 deg"' in text
    assert 'force = [0, 0, "-1 kN"]' in text
    assert same(build(text), machine)


def test_a_single_value_for_all_legs_is_written_out_where_one_leg_differs():
    text = as_file(load("hexapod", ["stiffness.actuator.2=25 N/um"]))
    assert 'actuator = ["20 N/um", "20 N/um", "25 N/um", "20 N/um", "20 N/um", "20 N/um"]' in text


def test_a_cross_section_that_becomes_a_number_keeps_its_mass():
    text = bundled()["hexapod"].replace(
        '# leg_axial = "3e7 N" ',
        'leg_axial = { shape = "tube", outer_diameter = "40 mm", inner_diameter = "30 mm", material = "steel" } #',
    )
    machine = changed(build(text), {"stiffness.leg_axial": 3e7})
    saved = as_file(machine)
    assert 'leg_axial = "3e7 N"' in saved
    assert values(machine)["linear_density.legs"] > 1.0
    assert same(build(saved), machine)


def test_legs_joints_and_links_are_met_by_name():
    machine = load("tripteron", ["legs.y.slide.stiffness=3e6 N/m", "sections.bar.diameter=12 cm"])
    text = as_file(machine)
    assert len(difference(bundled()["tripteron"], text)) == 4
    assert 'actuated = true, stiffness = "3e6 N/m" },' in text
    assert same(build(text), machine)


def test_springs_in_series_keep_their_names_and_units():
    machine = with_values(load("hexapod-hardware"), {"legs.leg.drive.stiffness.nut": 250e6})
    text = as_file(machine)
    assert len(difference(bundled()["hexapod-hardware"], text)) == 2
    assert 'stiffness = ["screw 139 N/um", "nut 250 N/um", "bearing 375 N/um"]' in text
    assert same(build(text), machine)


def test_a_machine_without_a_file_is_written_in_readable_units():
    text = as_file(replace(load("hexapod"), written=None))
    assert 'base_angles = ["-10 deg", "10 deg", "110 deg", "130 deg", "230 deg", "250 deg"]' in text
    assert 'base_radius = "115 mm"' in text
    assert 'actuator = "20 N/um"' in text
    assert "\\u" not in text
    assert same(build(text), load("hexapod"))


def test_an_exact_check_of_all_numbers_keeps_the_file():
    machine = read_again(changed(load("tripteron"), {"legs.y.slide.stiffness": 2e6}))
    assert as_file(machine).startswith("# Tripteron: three legs P-R-R-R")


@pytest.mark.parametrize("kind", KINDS)
def test_a_written_number_is_read_as_exactly_that_number(kind):
    """In whatever unit stood there before; where no decimal number of that unit is read so, in another."""
    for exponent in range(-9, 10):
        for mantissa in (1.0, 0.1 + 0.2, math.pi, 17.4532925199432957, 9.999999999999998):
            value = mantissa * 10.0**exponent
            for like in (None, KINDS[kind].example, "5 cm", 7.0, "rigid", [1]):
                assert parse(written_value(value, kind, like), kind) == value


@pytest.mark.parametrize(
    ("value", "kind", "like", "text"),
    [
        (math.radians(-10.0), "angle", None, "-10 deg"),
        (math.radians(-10.0), "angle", "0.2 rad", "-0.17453292519943295 rad"),
        (0.2634, "length", "22 cm", "26.34 cm"),
        (1e7, "torsional stiffness", None, "1e7 N*m/rad"),
        (math.inf, "linear stiffness", "20 N/um", "rigid"),
        (2.5, "force", 1, 2.5),
        (0.5, "direction", None, 0.5),
        (2e-9, "linear compliance", None, "2e-9 m/N"),
    ],
)
def test_numbers_as_people_write_them(value, kind, like, text):
    assert written_value(value, kind, like) == text
