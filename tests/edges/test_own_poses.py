"""Poses of the user's own, by `evaluate` and `kinetostat path`: equal to one by one, and mistakes in one sentence."""

import csv
import json
import os
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from kinetostat import Status, analyze, changed, evaluate, load
from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, DONE, NO_ANSWER
from kinetostat.engine.machine_code import SELF_LINKED
from kinetostat.engine.program_files import VARIABLE
from refusals import refused

HEXAPOD = load("hexapod", ["limits.longest_leg=30 cm"])
COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")


def around(count):
    """Poses around that of the file."""
    here = [getattr(HEXAPOD.tables["pose"], name) for name in COORDINATES]
    return np.array(here) + np.random.default_rng(3).uniform(-0.01, 0.01, (count, 6))


@pytest.mark.parametrize("name", ["hexapod", "planar-3rpr", "tripteron"])
def test_matrices_are_those_of_one_pose_after_the_other(name):
    machine = load(name)
    offsets = [0.0, 1e-3, -2e-3]
    first = next(iter(vars(machine.tables["pose"])))
    here = getattr(machine.tables["pose"], first)
    batch = evaluate(machine, {first: [here + offset for offset in offsets]}, ["K", "C"])
    assert batch["K"].dims == batch["C"].dims == ("pose", "row", "column")
    assert tuple(batch["row"].values) == machine.family.component_names
    for i, offset in enumerate(offsets):
        single = analyze(changed(machine, {first: here + offset}))
        scale = np.abs(single.compliance).max()
        np.testing.assert_allclose(batch["C"][i], single.compliance, rtol=1e-9, atol=1e-12 * scale)
        np.testing.assert_allclose(
            batch["K"][i], single.stiffness, rtol=1e-9, atol=1e-9 * np.abs(single.stiffness).max()
        )


def test_all_ways_to_give_poses_give_the_same():
    array = around(5)
    columns = dict(zip(COORDINATES, array.T, strict=True))
    by_array = evaluate(HEXAPOD, array, "C")
    assert list(by_array.coords) >= ["pose"]
    frame = pd.DataFrame({f"pose.{name}": values for name, values in columns.items()}, index=list("abcde"))
    by_frame = evaluate(HEXAPOD, frame, "C")
    assert list(by_frame["pose"].values) == list("abcde")
    dataset = xr.Dataset({name: ("time", values) for name, values in columns.items()}, {"time": np.arange(5) * 0.1})
    by_dataset = evaluate(HEXAPOD, dataset, "C")
    assert by_dataset["time"].dims == ("pose",)
    for other in (by_frame, by_dataset, evaluate(HEXAPOD, columns, "C")):
        assert (other["C"].values == by_array["C"].values).all()
        assert (other.x.values == array[:, 0]).all()


def test_dimensions_of_a_dataset_together_make_the_poses():
    dataset = xr.Dataset({"x": ("a", [0.0, 0.01]), "z": ("b", [0.15, 0.16, 0.17])})
    poses = evaluate(HEXAPOD, dataset)
    assert poses.x.values.tolist() == [0.0] * 3 + [0.01] * 3
    assert poses.z.values.tolist() == [0.15, 0.16, 0.17] * 2


def test_names_without_dots_come_back_in():
    first = evaluate(HEXAPOD, {"geometry.base_radius": ["12 cm", 0.13], "base_angles.1": 1.2, "z": "15 cm"})
    assert {"geometry_base_radius", "geometry_base_angles_1", "z"} <= set(first.coords)
    assert not any("." in str(name) for name in first.variables)
    again = evaluate(HEXAPOD, {name: first[name].values for name in ("geometry_base_radius", "geometry_base_angles_1")})
    assert again.geometry_base_radius.attrs["path"] == "geometry.base_radius"


def test_a_pose_without_a_result_has_a_status():
    poses = evaluate(HEXAPOD, {"z": [0.15, 9.0]}, ["K", "free_stiffness_z"])
    assert poses.status.values.tolist() == [Status.OK, Status.JOINT_LIMIT]
    assert poses.status.attrs["flag_meanings"].split()[Status.JOINT_LIMIT] == "joint_limit"
    assert np.isnan(poses.K[1]).all()
    assert np.isfinite(poses.K[0]).all()


@pytest.mark.parametrize(
    ("poses", "message"),
    [
        (3, r"poses is an array of a single number; .* 6 columns: x, y, z, roll, pitch, yaw"),
        ([[1, 2]], r"poses is an array of 1 x 2"),
        (None, "poses is an array of a single number"),
        ({}, "poses has no columns"),
        ({"x": []}, "poses has no rows"),
        ({"zz": [1]}, r'in the columns of the poses, "zz" is not a field'),
        ({"x": [1, 2], "y": [1, 2, 3]}, r"several lengths \(x 2, y 3\)"),
        ({"x": [0, "1 kg"]}, r"poses\['x'\]\[1\] is \"1 kg\": \"kg\" is not a unit of length"),
        ({"x": [0, float("nan")]}, r"poses\['x'\]\[1\] is nan, which is not a finite number"),
        ({"x": [0, None]}, r"poses\['x'\]\[1\] is None: it must be a length"),
        ({"x": [[1, 2], [3]]}, "column x of the poses has several columns"),
        ({"x": 1, "pose.x": 2}, "pose.x is given by two columns"),
        ({1: 2}, "a column of the poses is called 1"),
        ({"base_radius": [0.1, -1]}, r"poses\['base_radius'\]\[1\] is -1.0 m: it must be greater than 0"),
        ("no such file.csv", r'"no such file.csv" cannot be read'),
    ],
)
def test_a_mistake_in_poses_is_one_sentence(poses, message):
    with refused(message):
        evaluate(HEXAPOD, poses)


def test_a_name_is_neither_a_machine_nor_a_quantity():
    with refused('machine is "hexapod"'):
        evaluate("hexapod", {"x": 0})
    with refused('"stiffnes_z" is not a quantity'):
        evaluate(HEXAPOD, {"x": 0}, "stiffnes_z")


def written(tmp_path, text):
    path = tmp_path / "poses.csv"
    path.write_bytes(text.encode())
    return str(path)


def test_a_path_has_a_table_a_file_and_a_picture(tmp_path, capsys):
    poses = written(tmp_path, "# a comment\nx [mm], z [mm], roll [deg]\n0,150,0\n\n5,9000,1\n5 cm,155,1\n")
    out, drawn, data = (tmp_path / name for name in ("out.csv", "out.png", "out.json"))
    arguments = ["path", "hexapod", poses, "--set", "limits.longest_leg=30 cm"]
    assert main([*arguments, "-o", str(out), "-o", str(drawn), "-o", str(data)]) == DONE
    printed = capsys.readouterr().out
    assert "2 of 3 poses have a result" in printed
    assert "joint limit: pose 2." in printed
    rows = list(csv.DictReader(out.read_text("utf-8").splitlines()))
    assert [row["status"] for row in rows] == ["ok", "joint_limit", "ok"]
    assert [row["x [m]"] for row in rows] == ["0.0", "0.005", "0.05"]
    assert rows[1]["free_stiffness_z [N/m]"] == ""
    expected = evaluate(HEXAPOD, {"x": [0, 0.05], "z": [0.15, 0.155], "roll": ["0 deg", "1 deg"]})
    assert [float(rows[i]["free_stiffness_z [N/m]"]) for i in (0, 2)] == expected.free_stiffness_z.values.tolist()
    assert drawn.read_bytes().startswith(b"\x89PNG")
    assert json.loads(data.read_text("utf-8"))["status"] == ["ok", "joint_limit", "ok"]
    assert main([*arguments[:2], str(out), *arguments[3:], "-o", str(tmp_path / "again.csv")]) == DONE
    assert (tmp_path / "again.csv").read_bytes() == out.read_bytes()


def test_a_semicolon_separates_decimal_commas(tmp_path):
    poses = written(tmp_path, "x [mm];z [mm]\n1,5;150\n")
    assert evaluate(HEXAPOD, poses).x.values.tolist() == [1.5e-3]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; write a line such as"),
        ("x [mm]\n", "names columns, but has no poses below them"),
        ("x [mm],zz\n1,2\n", '"zz" is not a field of family hexapod; did you mean z?'),
        ("x,z\n0,0.15\n0,abc\n", 'line 3, column z is "abc": it must be a length'),
        ("x,z\n0,NaN\n", "line 2, column z is nan, which is not a finite number"),
        ("x,z\n0,\n", 'line 2, column z is ""'),
        ("x,z\n0\n", "line 2: the number of values is 1, not 2"),
        ("x [kg]\n0\n", '"kg" is not a unit of length'),
    ],
)
def test_a_bad_file_is_answered_in_one_sentence(tmp_path, capsys, text, message):
    assert main(["path", "hexapod", written(tmp_path, text), "-o", str(tmp_path / "out.csv")]) == BAD_INPUT
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out.csv").exists()


def test_a_path_out_of_reach_has_no_answer(tmp_path, capsys):
    poses = written(tmp_path, "z\n50\n60\n")
    assert main(["path", "hexapod", poses, "--set", "limits.longest_leg=30 cm"]) == NO_ANSWER
    assert "joint limit: 2 poses, the first is 1" in capsys.readouterr().out


def test_a_suffix_that_nothing_writes_is_refused_before_anything_is_computed(tmp_path, capsys):
    assert main(["path", "hexapod", written(tmp_path, "z\n0.15\n"), "-o", "out.doc"]) == BAD_INPUT
    assert "choose from .csv" in capsys.readouterr().err


@pytest.mark.skipif(not SELF_LINKED, reason="elsewhere LLVM loads compiled programs")
def test_a_path_without_a_picture_loads_no_library_of_tables_or_figures(tmp_path):
    """Nor the compiler, once the program is there."""
    poses = written(tmp_path, "z\n0.15\n")
    code = (
        "import sys; from kinetostat.cli import main; "
        f"main(['path', 'hexapod', {poses!r}, '-o', {str(tmp_path / 'out.csv')!r}]); "
        "print([m for m in ('xarray', 'matplotlib', 'llvmlite') if m in sys.modules])"
    )
    environment = {**os.environ, VARIABLE: str(tmp_path / "programs")}
    said = [subprocess.check_output([sys.executable, "-c", code], env=environment, text=True) for _ in range(2)]
    assert [text.splitlines()[-1] for text in said] == ["['llvmlite']", "[]"]


@pytest.mark.parametrize("character", ["\0", "\x1f", "\x85", "\u2028"])
def test_a_control_character_in_a_file_is_refused_with_its_line(tmp_path, capsys, character):
    """Without this, the number before it would be read as another one."""
    path = tmp_path / "poses.csv"
    path.write_text(f"x [mm],y [mm]\n1,2\n1{character}5,2\n", "utf-8")
    assert main(["path", "hexapod", str(path)]) == BAD_INPUT
    assert "line 3 has the control character" in capsys.readouterr().err


def test_a_quantity_that_has_no_number_at_any_pose_is_a_row_of_dashes(tmp_path, capsys):
    """A Delta does not turn, so that drives give it no angular acceleration; other quantities have numbers."""
    (tmp_path / "poses.csv").write_text("x [mm]\n0\n5\n", "utf-8")
    asked = ["--quantity", "least_angular_acceleration", "--quantity", "mass"]
    assert main(["path", "delta", str(tmp_path / "poses.csv"), "--set", "tool.mass=1 kg", *asked]) == 0
    rows = {line.split()[0]: line.split() for line in capsys.readouterr().out.splitlines() if line.strip()}
    assert rows["least_angular_acceleration"][2:] == ["–"] * 4
    assert rows["mass"][:3] == ["mass", "kg", "1"]


BARE = "Numbers without a unit in the head of their column are taken as"
IN_MM = f"{BARE} m, so that the file reaches 145 m; if they are mm, write x [mm], y [mm], z [mm] in its first line."
IN_DEG = f"{BARE} rad, so that the file reaches 90 rad; if they are deg, write yaw [deg] in its first line."
WEIGHT = ("--set", "tool.mass=5 kg", "--set", "load.gravity=[0, 0, -9.81]")


@pytest.mark.parametrize(
    ("machine", "words", "lines", "expected"),
    [
        ("hexapod", ("path",), ("x,y,z", "10,0,135", "0,0,145"), IN_MM),
        ("hexapod", ("path",), ("yaw", "0", "90"), IN_DEG),
        ("hexapod", ("path",), ("x [mm],y [mm],z [mm]", "10,0,135", "90,0,145"), ""),
        ("hexapod", ("path",), ("x,y,z", "0.01,0,0.135", "2,0,0.145"), ""),  # far, and not mm
        ("hexapod", ("command", *WEIGHT), ("x,y,z", "10,0,135", "0,0,145"), IN_MM),
        ("delta", ("command", *WEIGHT), ("x,y,z", "10,0,135", "0,0,145"), IN_MM),
        ("hexapod", ("drives", *WEIGHT), ("time,x,y,z", "0,10,0,135", "1,0,0,145"), IN_MM),
        ("delta", ("drives", *WEIGHT), ("time,x,y,z", "0,10,0,135", "1,0,0,145"), IN_MM),
    ],
)
def test_numbers_without_a_unit_that_look_like_mm_or_deg_are_named(tmp_path, capsys, machine, words, lines, expected):
    """Only where poses have no answer, or pass a limit: a file in metres is never doubted."""
    path, (command, *settings) = tmp_path / "poses.csv", words
    path.write_text("\n".join(lines))
    main([command, machine, str(path), *settings])
    shown = " ".join("".join(capsys.readouterr()).split())
    assert expected in shown
    assert expected or BARE not in shown
