"""Results for other programs: CSV, NetCDF and MATLAB say what the analysis says, with units."""

import csv
from importlib.metadata import version

import numpy as np
import pytest
import xarray as xr
from scipy.io import loadmat

from kinetostat.exchange.formats import FORMATS, format_for
from kinetostat.machine.loading import as_toml, load
from kinetostat.studies.analysis import analyze
from refusals import refused

WITH_TOOL = ('tool.offset=["10 mm", "0 mm", "-80 mm"]',)


def written(name, to, tmp_path, *settings):
    found = analyze(load(name, settings))
    (path,) = format_for(to, None).write(found, tmp_path / f"{name}.{to}")
    return found, path


@pytest.mark.parametrize("name", ["zhang-gosselin-4dof", "planar-3rpr"])
def test_netcdf_holds_k_and_c_by_the_names_of_their_rows(name, tmp_path):
    found, path = written(name, "netcdf", tmp_path, *WITH_TOOL)
    with xr.open_dataset(path, engine="h5netcdf") as dataset:
        assert dataset["stiffness"].dims == ("row", "column")
        assert list(dataset["row"].values) == list(found.components)
        assert dataset["stiffness"].values.tolist() == found.stiffness.tolist()
        assert (
            dataset["compliance"].sel(row="x", column="rz")
            == found.compliance[-2 if name[0] == "p" else 3][list(found.components).index("rz")]
        )
        assert dataset["compliance_share"].sel(spring=found.attribution[0].spring).values.tolist() == pytest.approx(
            list(found.attribution[0].compliance_share)
        )
        assert all("units" in variable.attrs for variable in dataset.data_vars.values())
        assert dataset["pose_x"].attrs["units"] == "m"


def test_the_tool_point_is_where_the_tool_is(tmp_path):
    found, path = written("zhang-gosselin-4dof", "netcdf", tmp_path, *WITH_TOOL)
    position, rotation = found.platform
    with xr.open_dataset(path, engine="h5netcdf") as dataset:
        away = dataset["tool_point"].values - np.array(position)
    assert np.array(rotation).T @ away == pytest.approx([0.01, 0.0, -0.08])


def test_the_tool_point_of_a_planar_machine_lies_in_its_plane(tmp_path):
    """K and C refer to it there, wherever the tool ends."""
    _, path = written("planar-3rpr", "netcdf", tmp_path, "tool.offset=[0.01, 0.02, 0.3]")
    with xr.open_dataset(path, engine="h5netcdf") as dataset:
        assert dataset["tool_point"].values[2] == dataset["platform_position"].values[2]


@pytest.mark.parametrize("name", ["zhang-gosselin-4dof", "planar-3rpr"])
def test_csv_has_a_number_a_line_with_its_unit(name, tmp_path):
    found, path = written(name, "csv", tmp_path)
    rows = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
    told = {(row["quantity"], row["row"], row["column"]): (row["value"], row["unit"]) for row in rows}
    size = len(found.components)
    for i, row in enumerate(found.components):
        for j, column in enumerate(found.components):
            assert float(told["compliance", row, column][0]) == found.compliance[i][j]
    assert sum(row["quantity"] == "stiffness" for row in rows) == size**2
    assert told["stiffness", "rz", "rz"][1] == "N·m/rad"
    assert told["stiffness", "rz", "x"][1] == told["stiffness", "x", "rz"][1] == "N/rad"
    assert told["compliance", "x", "y"][1] == "m/N"
    drive = next(one for one in found.attribution if "actuator" in one.spring)
    assert told["spring_stiffness", drive.spring, ""] == (repr(drive.stiffness), "N/m")


def test_results_say_of_what_and_where_they_hold(tmp_path):
    found = analyze(load("hexapod", ["tool.offset=[0, 0, 0.08]"]), axes="platform")
    (table,) = format_for("csv", tmp_path / "found.csv").write(found, tmp_path / "found.csv")
    with table.open(encoding="utf-8", newline="") as file:
        about = {row["row"]: row["column"] for row in csv.DictReader(file) if row["quantity"] == "about"}
    assert about["machine"] == found.machine.name
    assert about["frame"] == "platform axes at the tool point T"
    assert about["kinetostat"] == version("kinetostat")
    (file,) = format_for("netcdf", tmp_path / "found.nc").write(found, tmp_path / "found.nc")
    with xr.open_dataset(file) as told:
        assert told.attrs["machine_file"] == as_toml(found.machine)
        assert told.attrs["frame"] == about["frame"]
        assert told.attrs["kinetostat"] == about["kinetostat"]


def test_what_is_not_finite_is_left_out(tmp_path):
    _, path = written("zhang-gosselin-4dof", "csv", tmp_path, "stiffness.passive_links=rigid")
    text = path.read_text(encoding="utf-8")
    assert "\nstiffness," not in text
    assert "\ncompliance,rz,rz,0.0," in text
    assert "\nspring_stiffness,passive link 1,,inf," in text


def test_matlab_reads_matrices_pose_and_units(tmp_path):
    found, path = written("zhang-gosselin-4dof", "mat", tmp_path, *WITH_TOOL)
    data = loadmat(path, squeeze_me=True)
    assert data["K"].tolist() == found.stiffness.tolist()
    assert data["C"].tolist() == found.compliance.tolist()
    assert data["order"].tolist() == ["rx", "ry", "rz", "x", "y", "z"]
    assert data["reference_point"].shape == (3,)
    assert float(data["pose"]["z"]) == 0.68
    assert str(data["units"]["K"]) == "N·m/rad, N/rad, N/m"
    assert set(data["pose"].dtype.names) == {"x", "z", "theta5", "theta6"}


def test_matlab_has_no_matrix_where_there_is_none(tmp_path):
    _, path = written("zhang-gosselin-4dof", "mat", tmp_path, "stiffness.passive_links=rigid")
    data = loadmat(path)
    assert data["K"].size == 0
    assert data["C"].shape == (6, 6)


@pytest.mark.parametrize("one", FORMATS, ids=lambda one: one.name)
def test_a_format_is_found_by_name_and_by_suffix(one, tmp_path):
    assert format_for(one.name, None) is one
    first = next(other for other in FORMATS if other.suffix == one.suffix)
    assert format_for(None, tmp_path / f"machine{one.suffix}") is first


def test_an_unknown_format_is_refused(tmp_path):
    with refused('"mjfc"; did you mean "mjcf"'):
        format_for("mjfc", None)
    with refused(r"one of these suffixes: .*mjcf \(\.xml\)"):
        format_for(None, tmp_path / "machine.sldprt")


@pytest.mark.parametrize("name", ['=HYPERLINK("x")', "+sum", "-cmd", "@sum"])
def test_no_name_becomes_a_formula_of_a_spreadsheet(name, tmp_path):
    _, path = written("delta", "csv", tmp_path, f"name={name}")
    row = next(csv.reader(line for line in path.read_text().splitlines() if line.startswith("about,machine")))
    assert row[2] == f"'{name}"
