"""Every answer to first order says in its first lines which loads of the file do not count in it, on all surfaces.

The machine is a platform of 28.6 kg on eight cables with a preload of 100 N each: its weight counts to first order, the
preloads do not.
"""

import json
import re
from pathlib import Path

import pytest
import xarray as xr
from report_pages import no_drawing, no_pictures

from kinetostat.cli import main
from kinetostat.machine.loading import load
from kinetostat.studies.datasets import evaluate, evaluate_grid
from kinetostat.views.grid_figures import setting_lines
from kinetostat.views.report import writing

CABLES = str(Path(__file__).parent.parent / "cases" / "cables-at-rest.toml")
SAID = "Not counted here, but by analyze --loaded: preloads."
AXES = ("x=58.9 mm:60 mm:2", "z=1132.6 mm:1133 mm:2")
GRID = ("--over", AXES[0], "--over", AXES[1])
FREE = {
    "analyze": (),
    "sensitivity": ("--quantity", "compliance_z"),
    "guidelines": (),
    "budget": ("--tolerance", "joints=0.05 mm", "--samples", "64"),
    "path": ("{folder}/poses.csv",),
    "sweep": ("--vary", AXES[0]),
    "map": GRID,
    "workspace": GRID,
    "compare": (CABLES,),
}
"""Commands whose answers are about the free machine, with what they need besides it."""
FIRST_LINES = 12


@pytest.fixture(autouse=True)
def blank_figures(monkeypatch):
    no_drawing(monkeypatch)


def said_by(capsys, tmp_path, command, *more):
    (tmp_path / "poses.csv").write_text("x [mm]\n58.9\n60\n")
    main([command, CABLES, *(word.format(folder=tmp_path) for word in FREE[command]), *more])
    return capsys.readouterr().out


@pytest.mark.parametrize("command", FREE)
def test_the_terminal_says_it_first(capsys, tmp_path, command):
    first = said_by(capsys, tmp_path, command).splitlines()[:FIRST_LINES]
    assert SAID in " ".join(" ".join(first).split())


@pytest.mark.parametrize("command", FREE)
def test_json_says_it(capsys, tmp_path, command):
    answer = json.loads(said_by(capsys, tmp_path, command, "--json"))
    answer = answer["designs"][0] if command == "compare" else answer
    assert SAID in (answer["message"] if command in ("analyze", "budget") else answer["loads_left_out"])


@pytest.mark.parametrize("command", ["path", "sweep", "map", "workspace"])
def test_under_all_loads_nothing_is_left_out(capsys, tmp_path, command):
    more = ("--loaded", "--json", *(() if command == "workspace" else ("--quantity", "load_factor")))
    assert json.loads(said_by(capsys, tmp_path, command, *more))["loads_left_out"] == ""


@pytest.mark.parametrize("command", ["sweep", "map", "workspace"])
def test_a_folder_of_results_says_it(capsys, tmp_path, command):
    said_by(capsys, tmp_path, command, "-o", str(tmp_path / "out"))
    with xr.open_dataset(tmp_path / "out" / f"{command}.nc") as dataset:
        assert dataset.attrs["loads_left_out"] == SAID
        assert SAID in setting_lines(dataset)


@pytest.mark.reports
def test_every_section_of_a_report_that_is_about_the_free_machine_says_it(tmp_path, monkeypatch):
    page = tmp_path / "report.html"
    no_pictures(monkeypatch)
    monkeypatch.setattr(writing, "moving_sections", lambda _: [])  # a page of its own, which takes as long as the rest
    main(["report", CABLES, "--without", "validation", "-o", str(page)])
    text = " ".join(re.sub("<[^>]*>", " ", re.sub("</?span[^>]*>", "", page.read_text())).split())
    assert text.count("by analyze --loaded: preloads") >= 3


def test_a_machine_without_loads_leaves_none_out():
    assert "loads_left_out" not in evaluate_grid(load("hexapod"), ["x=0:1e-3:2"], ["compliance_z"]).attrs


def test_only_quantities_at_rest_count_all_loads():
    machine = load(CABLES)
    assert evaluate(machine, {"x": [0.0589]}, ["compliance_z"]).attrs["loads_left_out"] == SAID
    assert "loads_left_out" not in evaluate(machine, {"x": [0.0589]}, ["load_factor"]).attrs


def test_a_pose_without_a_place_has_no_weight_of_its_links(capsys):
    heavy = ["--set", "load.gravity=[0, 0, -9.81]", "--set", "linear_density.legs=5 kg/m", "--set", "pose.z=9 m"]
    main(["guidelines", "hexapod", *heavy])
    assert "nan" not in capsys.readouterr().out


@pytest.mark.parametrize("given", [{"load.gravity.2": [0.0, -9.81]}, {"temperature_rise.legs": [0.0, 20.0]}])
def test_a_load_that_only_a_swept_axis_brings_in_is_left_out_by_name(given):
    machine = load("hexapod", ["linear_density.legs=5 kg/m", "expansion.legs=1e-5"])
    (field,), (ends,) = given, given.values()
    said = "the weight of the links" if "gravity" in field else "the growth of warm links"
    grid = evaluate_grid(machine, [f"{field}={ends[0]}:{ends[1]}:2"], ["compliance_z"])
    assert said in grid.attrs["loads_left_out"]
    assert said in evaluate(machine, given, ["compliance_z"]).attrs["loads_left_out"]
    assert "loads_left_out" not in evaluate_grid(machine, ["x=0:1e-3:2"], ["compliance_z"]).attrs


def test_warmer_links_that_do_not_grow_are_no_load():
    assert (
        "loads_left_out" not in evaluate_grid(load("hexapod"), ["temperature_rise.legs=0:20:2"], ["compliance_z"]).attrs
    )
