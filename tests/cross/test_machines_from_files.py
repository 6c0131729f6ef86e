"""Engines rebuild a machine from its file: whatever kinetostat's own chain gets wrong, `validate` disagrees.

Each defect here is put into kinetostat's chain on purpose. The file stays right, and so does the engine's machine.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kinetostat.algebra.vector import Vector
from kinetostat.cli import DONE, main
from kinetostat.commands.common import NO_ANSWER
from kinetostat.exchange.leg_by_leg import legs_of
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinetostatics.response import respond
from kinetostat.machine import rings
from kinetostat.machine.leg import Spring
from kinetostat.machine.loading import build, bundled, load
from kinetostat.machine.loads import located_members
from kinetostat.machine.parameters import values
from kinetostat.machine.written import family, joints
from kinetostat.machine.written.joints import JOINT_TYPES
from kinetostat.validation import exudyn_machine
from kinetostat.validation.machine_from_file import machine_from_file
from kinetostat.validation.pieces import array

pytest.importorskip("exudyn")
CASES = Path(__file__).parents[1] / "cases"
BEHIND = str(CASES / "link-behind-parallelogram.toml")
ARM = str(CASES / "held-arm.toml")
HEAVY = ["--set", "tool.mass=5 kg"]
REFUSED = ("shared-carriage", "wrist-body")
"""Cases of files that are refused."""
SAME = 1e-9
"""m, and relative difference of masses and stiffnesses: closing equations are solved to 1e-10."""


def validated(capsys, *words):
    """Exit code and largest difference of `validate`."""
    code = main(["validate", *words, "--json"])
    said = capsys.readouterr()
    return code, json.loads(said.out)[0] if said.out else said.err


def test_a_link_behind_a_parallelogram_ends_where_the_file_says(capsys, monkeypatch):
    """The link had begun at `point`, where C_z is 7.32e-6 m/N; L³/3EI is 5.17e-6 m/N."""
    code, right = validated(capsys, BEHIND, *HEAVY)
    assert code == DONE
    assert right["theirs"][5][5] == pytest.approx(5.1738e-6, rel=1e-4)
    monkeypatch.setattr(family, "departure", lambda data: Vector(*data.point))
    code, wrong = validated(capsys, BEHIND, *HEAVY)
    assert code == NO_ANSWER
    assert wrong["ours"][5][5] == pytest.approx(7.3186e-6, rel=1e-4)
    assert wrong["theirs"] == right["theirs"]
    assert wrong["difference"] > 0.1


def test_a_link_that_weighs_another_mass_is_noticed(capsys, monkeypatch):
    """Stiffness agrees, frequencies do not."""
    member = family._member
    monkeypatch.setattr(family, "_member", lambda *words: replace(link := member(*words), mass=1.1 * link.mass))
    code, wrong = validated(capsys, BEHIND, *HEAVY)
    assert code == NO_ANSWER
    assert max(wrong["differences"].values()) < 1e-9
    assert max(pair["difference"] for pair in wrong["frequencies"]) > 1e-3


def shifted(name, data):
    """A revolute a millimetre beside its point."""
    return (joints.Joint(joints.unit(data.axis), Vector(*data.point) + Vector(1e-3, 0.0, 0.0), name),)


def test_a_joint_at_another_place_is_noticed(capsys, monkeypatch):
    assert validated(capsys, "tripteron")[0] == DONE
    monkeypatch.setitem(JOINT_TYPES, "revolute", replace(JOINT_TYPES["revolute"], elements=shifted))
    family.family_of.cache_clear()
    code, wrong = validated(capsys, "tripteron", "--set", "pose.x=0.45 m")
    family.family_of.cache_clear()
    assert code != DONE
    assert isinstance(wrong, str) or wrong["difference"] > 1e-4


@pytest.mark.parametrize(
    ("part", "defect"),
    [
        ("_seat", lambda made: tuple(replace(spring, stiffness=2.0 * spring.stiffness) for spring in made)),
        ("_link_elements", lambda made: made[1:]),
        ("_moving", lambda made: made[:1]),
    ],
)
def test_bearings_links_and_drives_are_read_from_the_file(capsys, monkeypatch, part, defect):
    """Bearings twice as stiff, a link without its first spring, a drive that has lost all but its first part."""
    code, right = validated(capsys, ARM, *HEAVY)
    assert code == DONE, right
    assert right["frequencies"]
    make = getattr(family, part)
    monkeypatch.setattr(family, part, lambda *words: defect(made) if len(made := make(*words)) else made)
    code, wrong = validated(capsys, ARM, *HEAVY)
    assert code == NO_ANSWER
    assert wrong["theirs"] == right["theirs"]
    assert wrong["difference"] > 1e-3


def machines():
    """Machines leg by leg: of the tests' cases, of which one has everything, and each bundled machine written out."""
    files = [path.read_text("utf-8") for path in sorted(CASES.glob("*.toml")) if path.stem not in REFUSED]
    return [*(text for text in files if "[[legs]]" in text), *(legs_of(name) for name in bundled())]


def agree(machine):
    """The machine of the file is that of the chain, part by part, with what carries the ends and centres of links."""
    coordinates = solve_joints(machine) if machine.family.chains else None
    response = respond(machine, coordinates)
    drawn = machine_from_file(machine, response, coordinates)
    assert array(drawn.reference) == pytest.approx(array(response.reference), abs=SAME)
    for leg, expected in zip(drawn.configuration.legs, response.configuration.legs, strict=True):
        for part, other in zip(leg.chain, expected.chain, strict=True):
            assert type(part) is type(other)
            assert places(part) == pytest.approx(places(other), abs=SAME)
            if isinstance(part, Spring) and "mode" not in part.name:
                assert float(part.stiffness) == pytest.approx(float(other.stiffness), rel=SAME)
                assert part.actuated == other.actuated
    links = located_members(machine, response.configuration, coordinates and coordinates.coordinates)
    for link, expected in zip(drawn.members, links, strict=True):
        assert (link.leg, link.name) == (expected.leg, expected.name)
        assert link.mass == pytest.approx(float(expected.mass), rel=SAME)
        for (count, point), (other, place) in zip(link.ends(), expected.ends(), strict=True):
            assert count == other
            assert array(point) == pytest.approx(array(place), abs=SAME)
        assert (link.centre is None) == (expected.centre is None)
        assert link.inertia is None or link.inertia() == pytest.approx(expected.inertia(), abs=1e-12)


@pytest.mark.parametrize("text", machines())
def test_the_machine_of_the_file_is_the_machine_of_the_chain(text):
    agree(build(text))


@pytest.mark.parametrize("name", bundled())
def test_the_legs_of_a_family_are_where_its_tables_say(name):
    """With rods and cranks that deflect, links that weigh something, and a tool."""
    machine = load(name, ["tool.offset=[0.01, 0.02, 0]"])
    fields = {path.rpartition(".")[2] for path in values(machine)}
    elastic = {"leg_axial": "1e6 N", "crank_bending": "1e4 N*m**2"}
    settings = [f"stiffness.{field}={value}" for field, value in elastic.items() if field in fields]
    heavy = [f"linear_density.{kind.name}=0.5" for kind in machine.family.links if kind.count is None]
    agree(load(name, ["tool.offset=[0.01, 0.02, 0]", *settings, *heavy]))


@pytest.mark.parametrize("name", ["hexapod", "tricept-rus", "planar-3rpr"])
def test_a_ring_of_another_size_is_noticed(capsys, monkeypatch, name):
    """Joints of the base and of the platform a tenth of a percent too far out."""
    assert validated(capsys, name)[0] == DONE
    ring = rings.ring
    monkeypatch.setattr(rings, "ring", lambda radius, *words: ring(1.001 * radius, *words))
    code, wrong = validated(capsys, name)
    assert code == NO_ANSWER
    assert wrong["difference"] > 1e-4


def places(part):
    """Points and lines of a part; of a principal axis, which has no sign, nothing."""
    joint = getattr(part, "joint", part)
    if "mode" in part.name:
        return np.zeros(0)
    names = ("axis", "point", "start", "end", "near", "far", "side")
    return np.concatenate([array(v) for name in names if (v := getattr(joint, name, None)) is not None])


def test_the_engine_prints_nothing_into_the_answer(capfd):
    """It has advice for systems of more than 1000 coordinates, which had stood before the JSON of a large machine."""
    machine = build((CASES / "every-joint-and-link.toml").read_text("utf-8"))
    found = solve_joints(machine)
    drawn = machine_from_file(machine, respond(machine, found), found)
    model, _ = exudyn_machine.build(drawn.configuration, drawn.reference)
    model.system.Assemble()
    model.system.ComputeLinearizedSystem(exudyn_machine.settings_of(model))
    assert capfd.readouterr() == ("", "")
