"""A machine with other numbers: checked as its file would be, and the same as `--set` makes it."""

import math

import pytest

from kinetostat.machine.loading import changed, is_checked_against_others, load, read_again
from kinetostat.machine.parameters import read_numbers, values
from refusals import refused

MACHINE = "zhang-gosselin-4dof"


def test_a_change_is_what_set_makes():
    machine = changed(
        load(MACHINE), {"pose.z": 0.7, "stiffness.actuator": 2000.0, "stiffness.passive_links.1": math.inf}
    )
    expected = load(MACHINE, ["pose.z=70 cm", "stiffness.actuator=2000", "stiffness.passive_links.1=rigid"])
    assert values(machine) == pytest.approx(values(expected))


@pytest.mark.parametrize(
    ("path", "text", "value"),
    [("pose.x", "2 cm", 0.02), ("pose.theta5", "-60 deg", -math.pi / 3), ("stiffness.actuator", "20 N/um", 2e7),
     ("stiffness.passive_links.0", "rigid", math.inf), ("limits.longest_leg", "none", math.inf)],
)  # fmt: skip
def test_values_are_read_with_any_unit(path, text, value):
    assert all(number == pytest.approx(value) for number in read_numbers(load(MACHINE).family, {path: text}).values())


@pytest.mark.parametrize(
    ("path", "text", "words"),
    [("pose.x", "2 deg", "length"), ("geometry.base_radius", "-2 cm", "greater than 0"),
     ("stiffness.actuator", "-1 N/m", "negative"), ("pose.w", "1", "not a field")],
)  # fmt: skip
def test_what_a_file_may_not_say_is_refused(path, text, words):
    with refused(words):
        read_numbers(load(MACHINE).family, {path: text})


@pytest.mark.parametrize("field", ["copies", "angles", "mirrored"])
def test_a_field_of_a_leg_needs_the_name_of_the_leg(field):
    with refused(f'--set "legs.{field}=3": the name after legs is "{field}"'):
        load("tripteron", [f"legs.{field}=3"])


def test_out_of_bounds_is_refused():
    with refused(r"base_radius is -0\.1 m: it must be greater"):
        changed(load(MACHINE), {"geometry.base_radius": -0.1})


def test_only_what_depends_on_other_numbers_is_checked_again():
    family, written = load(MACHINE), load("tripteron")
    assert not is_checked_against_others(family, "geometry.base_radius")
    assert is_checked_against_others(family, "limits.longest_leg")
    assert is_checked_against_others(written, "legs.z.elbow.axis.0")
    assert not is_checked_against_others(written, "legs.z.slide.stiffness")
    assert not is_checked_against_others(written, "pose.x")


def test_a_rebuilt_machine_is_the_same_or_refused():
    contradictory = {"limits.shortest_leg": 0.9, "limits.longest_leg": 0.5}
    with refused("nothing lies between them"):
        read_again(load(MACHINE).with_values(contradictory))
    with refused("nothing lies between them"):
        changed(load(MACHINE), contradictory)
    assert values(read_again(load("tripteron"))) == values(load("tripteron"))
