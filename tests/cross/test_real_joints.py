"""Joints with bearings, series of parts and copies of legs, each against a second way of writing the same machine."""

import json
import math

import numpy as np
import pytest

from kinetostat.algebra.vector import Vector
from kinetostat.cli import main
from kinetostat.exchange.leg_by_leg import legs_of
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.link import seat_springs
from kinetostat.machine.loading import as_toml, build, bundled, load
from kinetostat.spec import document
from kinetostat.studies.analysis import analyze
from kinetostat.studies.datasets import evaluate_grid

NAME = "hexapod-hardware"
POSES = [(), ("pose.x=20 mm", "pose.z=310 mm", "pose.pitch=8 deg", "pose.yaw=-5 deg")]
BALL = 'stiffness_axial = "120 N/um", stiffness_radial = "80 N/um"'


def compliance(machine):
    return np.array(respond(machine).compliance.rows(), dtype=float)


def test_bearings_deflect_along_the_axis_across_it_and_tilt_about_the_cross_directions():
    axis, point = np.array([1.0, 2.0, -2.0]) / 3.0, Vector(0.1, -0.2, 0.3)
    stiffness = {"radial": 2e8, "axial": 5e7, "tilt": 3e5, "torsion": 1e5}
    total = np.zeros((6, 6))
    for spring in seat_springs("seat", Vector(*(7.0 * axis)), point, stiffness):
        twist = np.array(spring.joint.twist(point).components())
        total += np.outer(twist, twist) / spring.stiffness
    along = np.outer(axis, axis)
    across = np.eye(3) - along
    np.testing.assert_allclose(total[3:, 3:], along / 5e7 + across / 2e8, atol=1e-20)
    np.testing.assert_allclose(total[:3, :3], along / 1e5 + across / 3e5, atol=1e-18)
    np.testing.assert_allclose(total[3:, :3], 0.0, atol=1e-18)


@pytest.mark.parametrize("pose", POSES)
def test_bearings_are_the_compliance_matrix_of_the_same_seat(pose):
    along = np.array([-145.0, 59.0, 260.0]) / math.dist((245, 52, 0), (100, 111, 260))
    block = np.outer(along, along) / 120e6 + (np.eye(3) - np.outer(along, along)) / 80e6
    rows = np.zeros((6, 6))
    rows[3:, 3:] = block
    text = bundled()[NAME].replace(f'axis = "cardan", {BALL}', f"compliance = {rows.tolist()}")
    assert text != bundled()[NAME]
    np.testing.assert_allclose(compliance(build(text, "it", pose)), compliance(load(NAME, pose)), rtol=1e-9, atol=1e-19)


def test_bearings_of_a_carriage_travel_with_it():
    """A force across the platform of a gantry tilts its carriage, whose bearings have then travelled 0.3 m."""
    text = """
        name = "gantry"
        family = "legs"
        [platform]
        point = [0, 0, 1]
        [pose]
        z = 1.3
        [[legs]]
        name = "only"
        joints = [
          { name = "rail", type = "prismatic", joins = ["base", "platform"], point = [0, 0, 0.6], axis = [0, 0, 1],
            actuated = true, stiffness = "50 N/um", stiffness_tilt = "1e6 N*m/rad", stiffness_torsion = "2e6 N*m/rad",
            stiffness_radial = "80 N/um" },
        ]
    """
    flat = np.diag(compliance(build(text.replace("\n            ", " "), "gantry")))
    lever = 0.4**2 / 1e6 + 1 / 80e6
    np.testing.assert_allclose(flat, [1e-6, 1e-6, 0.5e-6, lever, lever, 1 / 50e6], rtol=1e-12)


GANTRY = """
name = "gantry"
family = "legs"
[platform]
point = [0, 0, 1]
[pose]
z = 1.3
[[legs]]
name = "only"
joints = [
  { name = "rail", type = "TYPE", joins = ["base", "car"], point = [0, 0, 0.6], AXIS, MATRIX },
  { name = "flange", type = "fixed", joins = ["car", "platform"], point = [0, 0, 0.6], BEHIND },
]
"""
SLIDES = {
    "prismatic": 'axis = [0, 0, 1], actuated = true, stiffness = "rigid"',
    "helical": 'axis = [0, 0, 1], pitch = "10 mm", actuated = true, stiffness = "rigid"',
}


@pytest.mark.parametrize("kind", SLIDES)
@pytest.mark.parametrize(("at", "travel"), [("MATRIX", 0.3), ("BEHIND", 0.0)])
def test_the_matrix_of_a_slide_stays_at_its_seat_and_that_of_a_flange_behind_it_travels(
    kind, at, travel, tmp_path, capsys
):
    """C at r from an elastic seat is X C_seat X^T with X = [[1, 0], [-[r]x, 1]]; r grows as the slide travels."""
    rng = np.random.default_rng(5)
    root = rng.normal(size=(6, 6)) * np.repeat([1e-4, 1e-5], 3)[:, None]
    seat = root @ root.T
    text = GANTRY.replace("TYPE", kind).replace("AXIS", SLIDES[kind]).replace(at, f"compliance = {seat.tolist()}")
    file = tmp_path / "gantry.toml"
    file.write_text(text.replace(", MATRIX", "").replace(", BEHIND", ""))
    turn = 0.3 / 0.01 if kind == "helical" else 0.0
    r = np.array([0.0, 0.0, 0.4 + travel])
    shift = np.eye(6)
    shift[3:, :3] = -np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    spin = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    turned = np.kron(np.eye(2), spin if at == "BEHIND" else np.eye(3))
    assert main(["analyze", str(file), "--json"]) == 0
    answer = np.array(json.loads(capsys.readouterr().out)["compliance"])
    np.testing.assert_allclose(answer, shift @ turned @ seat @ turned.T @ shift.T, rtol=1e-9)


@pytest.mark.parametrize("pose", POSES)
def test_a_series_is_one_spring_of_its_total_and_shares_go_by_compliance(pose):
    parts = {"screw": 139e6, "nut": 200e6, "bearing": 375e6}
    single = 1.0 / sum(1.0 / k for k in parts.values())
    whole = load(NAME, [f"legs.leg.drive.stiffness={single!r}", *pose])
    np.testing.assert_allclose(compliance(load(NAME, pose)), compliance(whole), rtol=1e-11, atol=1e-20)
    share = {c.part: c.compliance_share[5] for c in analyze(load(NAME, pose)).attribution}
    together = sum(share[f"leg 3 drive {part}"] for part in parts)
    for part, stiffness in parts.items():
        assert share[f"leg 3 drive {part}"] == pytest.approx(together * single / stiffness, rel=1e-12)


@pytest.mark.parametrize("pose", POSES)
def test_copies_are_the_same_legs_written_out(pose):
    """Each leg with its own numbers, turned and mirrored here: exactly the same K and C."""
    written = document.parse(as_toml(load(NAME)), "it")
    leg = written["legs"].pop("leg")
    third = math.sqrt(0.75)
    turns = [(1.0, 0.0), (-0.5, math.sin(2.0 * math.pi / 3.0)), (-0.5, math.sin(4.0 * math.pi / 3.0))]
    assert turns[1][1] == pytest.approx(third, rel=1e-15)
    for i in range(6):
        (cosine, sine), mirror = turns[i // 2], -1.0 if i % 2 else 1.0
        written["legs"][f"leg {i + 1}"] = {
            name: {key: turned(value, cosine, sine, mirror) for key, value in joint.items()}
            for name, joint in leg.items()
            if isinstance(joint, dict)
        }
    machine = build(written, "written out", pose)
    assert [leg.name for leg in machine.family.configure.args[0].legs] == [f"leg {i}" for i in range(1, 7)]
    first, second = respond(machine), respond(load(NAME, pose))
    assert first.stiffness == second.stiffness
    assert first.compliance == second.compliance


def turned(value, cosine, sine, mirror):
    if not isinstance(value, list) or len(value) != 3:
        return value
    x, y, z = (float(str(entry).removesuffix(" m")) for entry in value)
    return [x * cosine - mirror * y * sine, x * sine + mirror * y * cosine, z]


def test_a_copied_matrix_turns_with_its_leg():
    """A mirrored and turned 6x6 with coupling, against the same springs written as bearings in their own axes."""
    matrix = np.zeros((6, 6))
    axis, point = np.array([0.6, 0.0, 0.8]), np.array([0.1, 0.11, 0.26])
    screw = np.concatenate([axis, np.cross(point - np.array([0.1, 0.111, 0.26]), axis)])
    matrix += 1e-7 * np.outer(screw, screw) + 1e-9 * np.diag([0, 0, 0, 1, 1, 1])
    text = bundled()[NAME].replace(f'axis = "cardan", {BALL}', f"compliance = {matrix.tolist()}")
    response = respond(build(text, "it"))
    rows = np.array(response.compliance.rows(), dtype=float)
    third = np.array([[-0.5, -math.sqrt(0.75), 0], [math.sqrt(0.75), -0.5, 0], [0, 0, 1]])
    for turn, sign in ((third, 1.0), (np.diag([1.0, -1.0, 1.0]), -1.0)):  # the machine looks alike from all legs
        both = np.kron(np.diag([sign, 1.0]), turn)
        np.testing.assert_allclose(both @ rows @ both.T, rows, rtol=1e-9, atol=1e-12 * np.abs(rows).max())


@pytest.mark.parametrize("name", ["hexapod", "delta", "passive-leg-4dof-driven"])
def test_in_a_family_a_series_is_one_spring_of_its_total(name):
    """Also where one number is for all legs, in a grid, and once it is written back."""
    field = "passive_actuator" if name == "passive-leg-4dof-driven" else "actuator"
    whole = load(name)
    given = getattr(whole.tables["stiffness"], field)
    single = given if isinstance(given, float) else given[0]
    unit = "N/m" if name == "hexapod" else "N*m/rad"
    machine = load(name, [f'stiffness.{field}=["gear {3.0 * single!r} {unit}", "long belt {1.5 * single!r} {unit}"]'])
    np.testing.assert_allclose(compliance(machine), compliance(whole), rtol=1e-12, atol=1e-20)
    assert build(as_toml(machine), "it").tables == machine.tables
    parts = {c.part: c.compliance_share for c in analyze(machine).attribution}
    leg = "passive leg actuator" if field == "passive_actuator" else "leg 1"
    belt, gear = (np.array(parts[f"{leg} {part}"], dtype=float) for part in ("long belt", "gear"))
    np.testing.assert_allclose(belt, 2.0 * gear, rtol=1e-12)
    path = f"stiffness.{field}.gear"
    swept = evaluate_grid(machine, [f"{path}={single!r}:{3.0 * single!r}:2"], ["compliance"])
    for i, stiffness in enumerate((single, 3.0 * single)):
        alone = np.diag(compliance(build(as_toml(machine), "it", [f"{path}={stiffness!r}"])))
        values = [float(swept[f"compliance_{c}"][i]) for c in ("rx", "ry", "rz", "x", "y", "z")]
        np.testing.assert_allclose(values, alone, rtol=1e-11, atol=1e-20)


@pytest.mark.parametrize("name", [name for name in bundled() if "passive-leg" not in name])
def test_a_machine_written_out_leg_by_leg_is_the_same(name):
    """At its pose, and where its actuators have moved: K and C of the family, from the joints of the new file."""
    machine = build(legs_of(name), "it")
    np.testing.assert_allclose(
        compliance(machine), compliance(load(name)), rtol=1e-8, atol=1e-12 * np.abs(compliance(load(name))).max()
    )
    assert set(vars(machine.tables["pose"])) <= set("xyz") | {"roll", "pitch", "yaw"}


def test_a_file_leg_by_leg_follows_its_family_to_other_poses():
    moved = ["pose.x=12 cm", "pose.z=-70 cm"]
    np.testing.assert_allclose(
        compliance(build(legs_of("delta"), "it", moved)), compliance(load("delta", moved)), rtol=1e-8, atol=1e-18
    )


def test_a_change_of_the_written_leg_changes_every_copy():
    softer = load(NAME, ["legs.leg.drive.stiffness.nut=100 N/um"])
    stiffness = [s.stiffness for leg in softer.configure([0.0] * 36).legs for s in leg.springs if s.kind == "drive nut"]
    assert stiffness == [1e8] * 6
