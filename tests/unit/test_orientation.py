"""Orientations by quaternion, rotation matrix, or tilt and torsion: two routes to one pose, and what is refused."""

import math
import tomllib

import jsonschema
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kinetostat import analyze, build, bundled, changed, evaluate
from kinetostat.machine.file_schema import machine_schema
from kinetostat.machine.saving import as_file
from machines import load_without_limits
from refusals import refused

ANGLES = ("roll", "pitch", "yaw")
TURNS = [
    Rotation.from_rotvec(v) for v in ([0.1, -0.2, 0.3], [0.0, 0.0, 0.0], [0.0, 0.5 * math.pi, 0.0], [1.2, 0.4, 2.5])
]
FILE = """schema = 1
name = "turned"
family = "hexapod"
[geometry]
base_radius = "20 cm"
base_angles = ["10 deg", "110 deg", "130 deg", "230 deg", "250 deg", "350 deg"]
platform_radius = "10 cm"
platform_angles = ["50 deg", "70 deg", "170 deg", "190 deg", "290 deg", "310 deg"]
[stiffness]
actuator = "20 N/um"
[pose]
x = 0
y = 0
z = "15 cm"
tilt = { azimuth = "30 deg", angle = "10 deg" }  # towards the door
"""


def forms(turn):
    x, y, z, w = turn.as_quat()
    return {"quaternion": [w, x, y, z], "rotation": turn.as_matrix().tolist()}


def matrix_of(machine):
    """Through SciPy: its own composition of the three angles."""
    pose = machine.tables["pose"]
    return Rotation.from_euler("xyz", [pose.roll, pose.pitch, pose.yaw]).as_matrix()


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("name", ["hexapod", "hexapod-hardware"])
def test_forms_are_the_rotation_that_scipy_makes_of_them(name, turn):
    machine = load_without_limits(name)
    for form, value in forms(turn).items():
        for there in (machine.with_values({form: value}), changed(machine, {f"pose.{form}": value})):
            assert matrix_of(there) == pytest.approx(turn.as_matrix(), abs=1e-14)


def test_tilt_and_torsion_are_three_turns_of_which_the_first_is_taken_back():
    azimuth, angle, torsion = 0.7, 0.4, -0.2
    there = load_without_limits("hexapod").with_values(tilt={"azimuth": azimuth, "angle": angle, "torsion": torsion})
    tilting = Rotation.from_rotvec(angle * np.array([-math.sin(azimuth), math.cos(azimuth), 0.0]))
    expected = tilting * Rotation.from_rotvec([0.0, 0.0, torsion])
    assert matrix_of(there) == pytest.approx(expected.as_matrix(), abs=1e-15)


def test_rounded_digits_are_taken_for_the_nearest_rotation():
    machine = load_without_limits("hexapod").with_values(rotation=np.round(TURNS[0].as_matrix(), 4))
    assert matrix_of(machine) == pytest.approx(TURNS[0].as_matrix(), abs=1e-4)


def test_files_and_overrides_replace_each_other():
    tilted = build(FILE)
    upright = build(FILE, "file", ["quaternion=[1, 0, 0, 0]"])
    assert [getattr(upright.tables["pose"], name) for name in ANGLES] == [0.0] * 3
    turned = build(FILE, "file", ["yaw=5 deg"])
    assert turned.tables["pose"].roll == tilted.tables["pose"].roll
    assert turned.tables["pose"].yaw == pytest.approx(math.radians(5))
    assert build(FILE, "file", ["tilt.angle=0"]).tables["pose"].pitch == pytest.approx(0.0, abs=1e-16)


def test_saved_files_keep_the_form_until_the_pose_changes():
    tilted = build(FILE)
    assert "towards the door" in as_file(tilted)
    for other in (changed(tilted, {"pose.yaw": 0.1}), build(FILE, "file", ["quaternion=[1, 0, 0, 0]"])):
        assert build(as_file(other)) == other


def test_poses_of_evaluate_may_be_quaternions_and_matrices():
    machine = load_without_limits("hexapod")
    small = [Rotation.from_rotvec([0.02 * i, -0.01 * i, 0.03]) for i in range(4)]
    angles = np.array([turn.as_euler("xyz") for turn in small])
    expected = evaluate(machine, dict(zip(ANGLES, angles.T, strict=True)), ["C"]).C.values
    by_quaternion = evaluate(machine, {"quaternion": [forms(turn)["quaternion"] for turn in small]}, ["C"]).C.values
    by_matrix = evaluate(machine, {"rotation": [turn.as_matrix() for turn in small]}, ["C"]).C.values
    scale = np.abs(expected).max()
    assert by_quaternion == pytest.approx(expected, abs=1e-12 * scale)
    assert by_matrix == pytest.approx(expected, abs=1e-12 * scale)
    by_tilt = evaluate(machine, {"tilt": {"azimuth": 0.0, "angle": ["0 deg", "2 deg"]}}, ["C"])
    assert by_tilt.C.values[1] == pytest.approx(np.array(analyze(machine.with_values(pitch="2 deg")).compliance))


def test_columns_of_a_table_hold_the_parts_of_a_form(tmp_path):
    machine = load_without_limits("hexapod")
    turns = [Rotation.from_rotvec([0.02 * i, -0.01 * i, 0.03]) for i in range(4)]
    rows = {
        "quaternion": [("w", "x", "y", "z"), [forms(turn)["quaternion"] for turn in turns]],
        "rotation": [[f"{r}.{c}" for r in "123" for c in "123"], [turn.as_matrix().ravel() for turn in turns]],
    }
    file = tmp_path / "turns.csv"
    for form, (parts, numbers) in rows.items():
        lines = [", ".join(f"{form}.{part}" for part in parts), *(", ".join(map(repr, map(float, n))) for n in numbers)]
        file.write_text("\n".join(lines))
        read = evaluate(machine, file)
        for name, angle in zip(ANGLES, np.array([turn.as_euler("xyz") for turn in turns]).T, strict=True):
            assert read[name].values == pytest.approx(angle, abs=1e-12)
    file.write_text("tilt.azimuth [deg]; tilt_angle\n90; 2 deg\n0; 0,01")
    read = evaluate(machine, str(file))
    assert read["roll"].values == pytest.approx([-math.radians(2), 0.0], abs=1e-15)
    assert read["pitch"].values == pytest.approx([0.0, 0.01], abs=1e-15)


COLUMNS_REFUSED = {
    "no quaternion.z; give a column for each of quaternion.w": {
        "quaternion.w": 1,
        "quaternion.x": 0,
        "quaternion.y": 0,
    },
    r"poses\['quaternion.x'\]\[0\] is \"a\": it must be a number": {"quaternion.w": 1, "quaternion.x": "a"},
    "quaternion.w is given by two columns": {"quaternion.w": 1, "pose.quaternion.w": 1},
    "tilt and roll both say": {"tilt.azimuth": 0, "tilt.angle": 0, "roll": 0},
    r"several lengths \(1, 2, 3\)": {"tilt": {"azimuth": 0, "angle": [0, 0], "torsion": [0, 0, 0]}},
}


@pytest.mark.parametrize("reason", COLUMNS_REFUSED)
def test_columns_that_are_no_orientation_are_refused(reason):
    with refused(reason):
        evaluate(load_without_limits("hexapod"), COLUMNS_REFUSED[reason])


REFUSED = {
    "length 1.41421": {"quaternion": [1, 0, 0, 1]},
    "mirror image": {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]},
    "not a rotation": {"rotation": [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]},
    "give three rows": {"rotation": [1, 2]},
    r"give \[w, x, y, z\]": {"quaternion": ["a", 0, 0, 1]},
    r"give \[w": {"quaternion": [math.nan, 0, 0, 1]},
    "give one orientation": {"quaternion": [[1, 0, 0, 0], [1, 0, 0, 0]]},
    "torsion may be left out": {"tilt": {"azimuth": 0}},
    "not a unit of angle": {"tilt": {"azimuth": "1 mm", "angle": 0}},
    "both say how": {"quaternion": [1, 0, 0, 0], "pose.roll": 0.1},
    "tilt both say": {"quaternion": [1, 0, 0, 0], "tilt": {}},
}


@pytest.mark.parametrize("reason", REFUSED)
def test_what_is_no_orientation_is_refused_with_the_way_to_write_it(reason):
    with refused(reason):
        load_without_limits("hexapod").with_values(REFUSED[reason])


def test_a_pose_of_other_coordinates_names_them():
    for name, coordinates in (("tricept", "theta1, theta2, length"), ("planar-3rpr", "x, y, angle")):
        with refused(coordinates):
            load_without_limits(name).with_values(quaternion=[1, 0, 0, 0])
    with refused("leave one of them out"):
        build(FILE + "roll = 0.1\n")


def test_the_schema_knows_the_forms():
    for document in (FILE, FILE.replace('{ azimuth = "30 deg", angle = "10 deg" }', "5")):
        valid = jsonschema.Draft202012Validator(machine_schema()).is_valid(tomllib.loads(document))
        assert valid == (document == FILE)
    legs = tomllib.loads(bundled()["hexapod-hardware"])
    for quaternion in ([1, 0, 0, 0], [1, 0, 0]):
        legs["pose"] = {"x": 0, "quaternion": quaternion}
        assert jsonschema.Draft202012Validator(machine_schema()).is_valid(legs) == (len(quaternion) == 4)
