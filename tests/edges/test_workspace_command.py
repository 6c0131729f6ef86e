"""`kinetostat workspace` as people type it: what it prints and writes, and what it refuses."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, DONE, NO_ANSWER
from kinetostat.engine.batch import evaluate
from kinetostat.kinematics.status import Status

PLANE = ["workspace", "planar-3rpr", "--over", "x=-30 cm:30 cm:13", "--over", "y=-30 cm:30 cm:11"]
SPACE = ["workspace", "hexapod", "--over", "x=-8 cm:8 cm:9", "--over", "y=-8 cm:8 cm:7", "--over", "z=6 cm:25 cm:8"]
LIMITS = ["--set", "limits.longest_leg=20 cm", "--where", "stiffness_z > 50 N/um"]


def test_it_says_how_much_and_why_not_more(capsys):
    assert main([*SPACE, *LIMITS]) == DONE
    text = capsys.readouterr().out
    told = ["Volume ", "m³", "± two", "a leg is too long", "fails stiffness_z > 50 N/um"]
    told += ["Extent of the workspace", "mm", "length of the legs", "angle at the base joints"]
    for word in told:
        assert word in text


def test_an_area_is_called_so(capsys):
    assert main(PLANE) == DONE
    assert "Area " in capsys.readouterr().out


def test_json_is_all_that_is_printed(capsys):
    assert main([*SPACE, *LIMITS, "--json"]) == DONE
    found = json.loads(capsys.readouterr().out)
    assert found["coordinates"]["pose.z"]["count"] == 8
    assert found["volume"]["units"] == "m³"
    assert 0.0 < found["volume"]["standard_error"] < found["volume"]["value"]
    assert sum(found["nodes"].values()) == 9 * 7 * 8
    assert found["nodes"]["limits.longest_leg"] > 0
    assert found["singularities_divide"] is True
    assert {"name", "title", "least", "greatest", "unit"} == set(found["demands"][0])


@pytest.mark.parametrize(
    ("arguments", "pictures"),
    [(PLANE, [""]), ([*SPACE, *LIMITS], ["-sections", "-solid"]),
     ([*SPACE, "--over", "yaw=-20 deg:20 deg:3"], ["-sections", "-solid"])],
    ids=["plane", "space", "four coordinates"],
)  # fmt: skip
def test_it_writes_data_and_pictures(arguments, pictures, tmp_path, capsys):
    assert main([*arguments, "-o", str(tmp_path / "out"), "--formats", "png,svg"]) == DONE
    names = {f"workspace{name}.{suffix}" for name in pictures for suffix in ("png", "svg")}
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"workspace.nc", "kinetostat.sha256", *names}
    text = capsys.readouterr().out.replace("\n", "")
    assert all(name in text for name in names)


def test_pictures_name_their_axes_and_colours(tmp_path, capsys):
    assert main([*SPACE, *LIMITS, "-o", str(tmp_path), "--formats", "svg"]) == DONE
    sections = (tmp_path / "workspace-sections.svg").read_text("utf-8")
    for word in ("x (mm)", "y (mm)", "inside", "a leg is too long", "stiffness_z = 50 N/um"):
        assert word in sections
    assert "z = " in sections
    solid = (tmp_path / "workspace-solid.svg").read_text("utf-8")
    assert all(f"{axis} (mm)" in solid for axis in "xyz")


def test_the_file_says_what_its_numbers_mean(tmp_path, capsys):
    assert main([*PLANE, "--where", "singularity_margin > 0.3", "-o", str(tmp_path)]) == DONE
    with xr.open_dataset(tmp_path / "workspace.nc", engine="h5netcdf") as found:
        assert found["verdict"].dims == ("x", "y")
        meanings = found["verdict"].attrs["flag_meanings"].split()
        assert meanings[0] == "inside"
        assert meanings[-1] == "fails_singularity_margin_>_0.3"
        assert found["x"].attrs["units"] == "m"
        assert found.attrs["volume_units"] == "m²"
        assert "two random points" in found.attrs["volume_method"]
        joined = found["connected"].values == 1
        assert joined.any()
        assert np.all(found["verdict"].values[joined] == 0)
        assert np.all(found["singularity_margin"].values[joined] > 0.3)


def test_nothing_inside_is_no_answer(capsys):
    assert main([*PLANE, "--where", "singularity_margin > 2"]) == NO_ANSWER
    assert "No pose of the box is in the workspace" in capsys.readouterr().out


def test_nothing_inside_can_be_drawn(tmp_path, capsys):
    assert main([*SPACE, "--where", "singularity_margin > 2", "-o", str(tmp_path)]) == NO_ANSWER
    assert (tmp_path / "workspace-solid.png").stat().st_size > 10_000


REFUSED = [
    (["workspace", "hexapod"], ["--over"]),
    ([*PLANE, "--where", "stiffness_z > 3 N/m"], ['"stiffness_z" is not a quantity', "stiffness_rz"]),
    ([*PLANE, "--where", "singularity_margin"], ["is not a condition", "stiffness_z > 20 N/um"]),
    ([*PLANE, "--over", "geometry.base_radius=1:2:3"], ["is not a coordinate of the pose"]),
    ([*PLANE, "--seed", "x"], ["x is not a number"]),
    ([*PLANE, "--set", "limits.longest=1"], ["limits.longest is not known", "longest_leg"]),
]


@pytest.mark.parametrize(("arguments", "words"), REFUSED)
def test_mistakes_are_refused_with_the_way_out(arguments, words, capsys):
    try:
        code = main(arguments)
    except SystemExit as stop:
        code = stop.code
    assert code == BAD_INPUT
    text = capsys.readouterr().err
    for word in words:
        assert word in text


def test_points_that_do_not_converge_count_in_the_error_and_the_assembly_mode_is_named(monkeypatch, capsys):
    def without_answer(*arguments):
        result = evaluate(*arguments)
        status = result.status.copy()
        status[[0, 1, 6]] = Status.NOT_CONVERGED  # two points of the first cell, one of the fourth
        return replace(result, status=status)

    question = ["workspace", "tripteron", "--over", "x=20 cm:80 cm:4", "--over", "y=20 cm:80 cm:4"]
    assert main([*question, "--json"]) == DONE
    assert json.loads(capsys.readouterr().out)["volume"]["unknown"] == 0.0
    monkeypatch.setattr("kinetostat.studies.workspace.evaluate", without_answer)
    assert main(question) == DONE
    text = " ".join(capsys.readouterr().out.split())
    assert "larger by up to 0.08 m²: in 2 of the cells a point did not converge" in text
    assert "keeps to the assembly mode of its home pose" in text
    assert main(PLANE) == DONE
    assert "assembly mode" not in capsys.readouterr().out, "a family states its mode by its formulas"


def test_too_few_cells_have_no_error(capsys):
    """Two points in one cell agree by chance: "± 0" would be wrong."""
    axes = ["--over", "x=0:1 mm:2", "--over", "y=0:1 mm:2"]
    assert main(["workspace", "hexapod", *axes]) == DONE
    said = " ".join(capsys.readouterr().out.split())
    assert "The grid is too coarse to say how far that may be wrong: it has 1 cell;" in said
    assert "±" not in said
    assert main(["workspace", "hexapod", *axes, "--json"]) == DONE
    assert json.loads(capsys.readouterr().out)["volume"]["standard_error"] is None
