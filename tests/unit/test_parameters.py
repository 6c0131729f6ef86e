"""The scalars of a machine by path: listed, found and replaced."""

from dataclasses import FrozenInstanceError

import pytest

from kinetostat.machine.loading import load
from kinetostat.machine.parameters import find, parameters, values, with_values
from machines import every_machine
from refusals import refused

MACHINE = load("zhang-gosselin-4dof")


@every_machine
def test_every_scalar_is_listed_once_and_replaced_alone(case):
    machine = load(case.name)
    before = values(machine)
    leaves = [p.path for p in parameters(machine.family) if p.leaves == (p.path,)]
    assert sorted(leaves) == sorted(before)
    for path in before:
        after = values(with_values(machine, {path: 0.125}))
        assert after.pop(path) == 0.125
        assert after == {other: value for other, value in before.items() if other != path}
    assert values(machine) == before


@pytest.mark.parametrize("text", ["tool.offset", "offset", "load.force"])
def test_components_are_not_varied_as_one(text):
    with refused(r"holds 3 numbers; name one of them: \w+\.\w+\.0"):
        find(MACHINE.family, text)


@every_machine
def test_a_field_stands_for_all_of_its_entries(case):
    for parameter in parameters(load(case.name).family):
        count = parameter.quantity.count
        if count is not None and parameter.leaves != (parameter.path,):
            assert parameter.leaves == tuple(f"{parameter.path}.{i}" for i in range(count))


def test_a_machine_is_never_modified():
    with pytest.raises(FrozenInstanceError):
        MACHINE.tables["geometry"].base_radius = 1.0


@pytest.mark.parametrize(
    ("text", "path"),
    [
        ("geometry.base_radius", "geometry.base_radius"),
        ("base_radius", "geometry.base_radius"),
        ("actuator", "stiffness.actuator"),
        ("actuator.2", "stiffness.actuator.2"),
        ("z", "pose.z"),
        ("stiffness.passive_links", "stiffness.passive_links"),
    ],
)
def test_a_parameter_is_found_by_its_path_or_the_end_of_it(text, path):
    assert find(MACHINE.family, text).path == path


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("base_radios", ["base_radios", "did you mean", "base_radius"]),
        ("geometry.base_radios", ["did you mean geometry.base_radius"]),
        ("passive_links", ["geometry.passive_links", " or ", "stiffness.passive_links"]),
        ("actuator.4", ["actuator.4", "did you mean"]),
        ("q", ['"q" is not a field', "are x, z, theta5, theta6"]),
        ("", ["is not a field"]),
        ("adius", ["is not a field"]),
    ],
)
def test_what_is_not_a_parameter_gets_a_way_out(text, words):
    with refused() as caught:
        find(MACHINE.family, text)
    assert all(word in str(caught.value) for word in words)


@pytest.mark.parametrize(
    ("name", "link"), [("tricept", "tube"), ("passive-leg-3dof-pu", "ram"), ("zhang-gosselin-4dof", "legs")]
)
def test_meanings_of_links_fit_one_and_several(name, link):
    said = [
        find(load(name).family, f"{table}.{link}").quantity.meaning
        for table in ("temperature_rise", "bending_rigidity")
    ]
    assert said == [
        f"rise of the temperature of the {link} since the machine was built",
        f"least E I of the {link}, from which the buckling load follows; 0: not known",
    ]
