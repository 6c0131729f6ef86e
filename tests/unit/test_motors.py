"""Actuators on one freedom of a joint with several, and planar joints: the same machines joint by joint."""
# ruff: noqa: E501 - machine files have long lines

import pytest

from kinetostat import analyze, build, forward, validate
from kinetostat.exchange.formats import export
from kinetostat.kinematics.forward import stand
from kinetostat.machine.loading import as_toml
from refusals import refused

HEAD = """schema = 1
name = "motors"
family = "legs"
[platform]
point = [0, 0, "100 mm"]
[pose]
"""
MOTORS = {
    "cylindrical rotation": (
        'type = "cylindrical", axis = [0, 0, 1], actuated = "rotation", stiffness = "1e4 N*m/rad"',
        'type = "revolute", axis = [0, 0, 1], actuated = true, stiffness = "1e4 N*m/rad"|'
        'type = "prismatic", axis = [0, 0, 1]',
    ),
    "cylindrical translation": (
        'type = "cylindrical", axis = [0, 0, 1], actuated = "translation", stiffness = ["screw 40 N/um", "nut 90 N/um"]',
        'type = "revolute", axis = [0, 0, 1]|'
        'type = "prismatic", axis = [0, 0, 1], actuated = true, stiffness = ["screw 40 N/um", "nut 90 N/um"]',
    ),
    "universal": (
        'type = "universal", first_axis = [1, 0, 0], second_axis = [0, 1, 0], actuated = "second_axis", stiffness = 2e4',
        'type = "revolute", axis = [1, 0, 0]|'
        'type = "revolute", axis = [0, 1, 0], actuated = true, stiffness = "2e4 N*m/rad"',
    ),
    "spherical": (
        'type = "spherical", first_axis = [1, 2, 2], second_axis = [2, 1, -2], actuated = "first_axis", stiffness = 3e4',
        'type = "revolute", axis = [1, 2, 2], actuated = true, stiffness = "3e4 N*m/rad"|'
        'type = "universal", first_axis = [2, 1, -2], second_axis = [-6, 6, -3]',
    ),
    "planar": (
        'type = "planar", first_axis = [1, 0, 0], second_axis = [0, 0, 1], actuated = "first_axis", stiffness = 5e6',
        'type = "prismatic", axis = [1, 0, 0], actuated = true, stiffness = "5 N/um"|'
        'type = "prismatic", axis = [0, 0, 1]|type = "revolute", axis = [0, -1, 0]',
    ),
}
POSES = {
    "cylindrical rotation": 'yaw = "5 deg"\nz = "110 mm"',
    "cylindrical translation": 'yaw = "5 deg"\nz = "110 mm"',
    "universal": 'roll = "5 deg"\npitch = "-3 deg"',
    "spherical": 'roll = "5 deg"\npitch = "-3 deg"\nyaw = "2 deg"',
    "planar": 'x = "3 mm"\nz = "90 mm"\npitch = "4 deg"',
}


def machine_of(pose, joints):
    """A base, the joints of one leg, and actuated joints after them for the directions that they leave."""
    lines, body = [], "base"
    for i, joint in enumerate(joints, 1):
        end = "platform" if i == len(joints) else f"body {i}"
        lines.append(f'{{ name = "j{i}", joins = ["{body}", "{end}"], point = ["20 mm", "10 mm", 0], {joint} }}')
        body = end
    legs = ",\n".join(lines)
    return build(f'{HEAD}{pose}\n[[legs]]\nname = "leg"\njoints = [\n{legs}\n]\n')


def pair(name):
    return [machine_of(POSES[name], text.split("|")) for text in MOTORS[name]]


@pytest.mark.parametrize("name", MOTORS)
def test_a_motor_on_one_freedom_is_that_freedom_as_a_joint_of_its_own(name):
    """Two routes to the compliance that the motor gives, and to where it stands."""
    machine, apart = pair(name)
    springs = [
        [(s.joint.axis, s.stiffness) for s in m.configure((0.0,) * m.chains().size).legs[0].springs]
        for m in (machine, apart)
    ]
    for (axis, stiffness), (other, same) in zip(*springs, strict=True):
        assert stiffness == same
        assert axis.components() == pytest.approx(other.components(), abs=1e-15)
    assert {analyze(each).status.word for each in (machine, apart)} == {"singular"}  # nothing holds what is passive
    assert [a.meaning for a in stand(machine)] == [a.meaning for a in stand(apart)]
    assert [float(a.coordinate) for a in stand(machine)] == pytest.approx(
        [float(a.coordinate) for a in stand(apart)], abs=1e-9
    )


THREE_FEET = """schema = 1
name = "three feet"
family = "legs"
[platform]
point = [0, 0, "100 mm"]
[pose]
z = "102 mm"
roll = "2 deg"
pitch = "1 deg"
[[legs]]
name = "fixed"
joints = [
  { name = "drive", type = "prismatic", joins = ["base", "foot"], point = ["-100 mm", 0, 0], axis = [0, 0, 1], actuated = true, stiffness = "50 N/um" },
  { name = "ball", type = "spherical", joins = ["foot", "platform"], point = ["-100 mm", 0, "100 mm"] },
]
[[legs]]
name = "sliding"
joints = [
  { name = "drive", type = "prismatic", joins = ["base", "foot"], point = ["100 mm", 0, 0], axis = [0, 0, 1], actuated = true, stiffness = "50 N/um" },
  { name = "slide", type = "prismatic", joins = ["foot", "shoe"], point = ["100 mm", 0, "50 mm"], axis = [1, 0, 0] },
  { name = "ball", type = "spherical", joins = ["shoe", "platform"], point = ["100 mm", 0, "100 mm"] },
]
[[legs]]
name = "flat"
joints = [
  { name = "drive", type = "cylindrical", joins = ["base", "foot"], point = [0, "150 mm", 0], axis = [0, 0, 1], actuated = "translation", stiffness = "50 N/um" },
  { name = "table", type = "planar", joins = ["foot", "shoe"], point = [0, "150 mm", "50 mm"], first_axis = [1, 0, 0], second_axis = [0, 1, 0] },
  { name = "ball", type = "spherical", joins = ["shoe", "platform"], point = [0, "150 mm", "100 mm"] },
]
"""
PLAIN = THREE_FEET.replace(
    'type = "cylindrical", joins = ["base", "foot"], point = [0, "150 mm", 0], axis = [0, 0, 1], actuated = "translation"',
    'type = "prismatic", joins = ["base", "foot"], point = [0, "150 mm", 0], axis = [0, 0, 1], actuated = true',
)


def test_a_whole_machine_has_the_stiffness_of_plain_joints_and_of_an_engine(tmp_path):
    machine, plain = build(THREE_FEET), build(PLAIN)
    assert pytest.approx(analyze(plain).C, abs=1e-12 * abs(analyze(plain).C).max()) == analyze(machine).C
    assert validate(machine, "exudyn").difference < 1e-6
    assert build(as_toml(machine)) == machine
    for suffix in ("xml", "urdf", "glb"):
        assert export(machine, tmp_path / f"feet.{suffix}")


def test_forward_kinematics_moves_the_motor():
    machine = build(THREE_FEET)
    answer = forward(machine, {"flat": "3 mm"}, starts=0)
    assert answer.present.residual < 1e-12


REFUSED = {
    'write "rotation" or "translation"': ('actuated = "translation"', 'actuated = "spin"'),
    "One of its freedoms may be actuated": ('actuated = "translation"', "actuated = true"),
    "write true or false": ("actuated = true", 'actuated = "first_axis"'),
    "add stiffness": ('actuated = "translation", stiffness = "50 N/um"', 'actuated = "translation"'),
    "not a unit of torsional stiffness": ('actuated = "translation"', 'actuated = "rotation"'),
}


@pytest.mark.parametrize("reason", REFUSED)
def test_what_cannot_be_actuated_is_refused_with_what_can(reason):
    with refused(reason):
        build(THREE_FEET.replace(*REFUSED[reason]))
