"""`kinetostat sensitivity`: what it prints, writes and refuses, and what its percentages mean."""

import json
import math

import numpy as np
import pytest

from kinetostat.cli import main
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import values, with_leg, with_values
from kinetostat.studies.analysis import analyze
from kinetostat.studies.guideline_sentences import statements
from kinetostat.studies.guidelines import guidelines
from kinetostat.studies.sensitivity import notes, sensitivity
from kinetostat.views.data_forms import json_of
from kinetostat.views.sensitivity import SENSITIVITY

MACHINE = "zhang-gosselin-4dof"


def upu_leg(name, turn):
    """A leg U-P-U at `turn` degrees, its outer axes along one tangent and its inner ones parallel."""
    s, c = math.sin(math.radians(turn)), math.cos(math.radians(turn))
    size = math.hypot(0.15, 0.5)
    along, across = [-0.15 * c / size, -0.15 * s / size, 0.5 / size], [-0.5 * c / size, -0.5 * s / size, -0.15 / size]
    low, top = [0.3 * c, 0.3 * s, 0.0], [0.15 * c, 0.15 * s, 0.5]
    return f"""
[[legs]]
name = "{name}"
joints = [
  {{ name = "low", type = "universal", joins = ["base", "tube"], point = {low}, first_axis = {[-s, c, 0.0]}, second_axis = {across} }},
  {{ name = "ram", type = "prismatic", joins = ["tube", "rod"], point = {low}, axis = {along}, actuated = true, stiffness = "30 N/um" }},
  {{ name = "top", type = "universal", joins = ["rod", "platform"], point = {top}, first_axis = {across}, second_axis = {[-s, c, 0.0]} }},
]
"""  # noqa: E501


THREE_UPU = """schema = 1
name = "3-UPU"
family = "legs"
platform.point = [0, 0, 0.5]
pose = { x = 0.02, y = 0.01, z = 0.52 }
""" + "".join(upu_leg(name, turn) for name, turn in (("a", 90), ("b", 210), ("c", 330)))


def rows(machine=MACHINE, *settings):
    return {row["path"]: row for row in json_of(SENSITIVITY, sensitivity(load(machine, settings)))["parameters"]}


def test_a_percent_more_changes_the_index_by_the_percentage():
    machine, path = load(MACHINE), "geometry.base_radius"
    told = rows()[path]["percent_per_percent"]["compliance_z"]
    more, less = (
        analyze(with_values(machine, {path: values(machine)[path] * factor})).compliance_diagonal[5]
        for factor in (1.0001, 0.9999)
    )
    assert 100 * (more - less) / (more + less) == pytest.approx(0.01 * told, rel=1e-5)


def test_what_is_zero_is_compared_with_a_measure():
    found = rows(MACHINE, "geometry.base_angle=0 deg")
    length = analyze(load(MACHINE)).characteristic_length
    assert found["pose.x"]["one_percent_of"] == {"measure": "length", "value": pytest.approx(length)}
    assert found["geometry.base_angle"]["one_percent_of"] == {"measure": "radian", "value": 1.0}
    assert found["geometry.platform_angle"]["one_percent_of"] == {"measure": "radian", "value": 1.0}
    assert found["geometry.base_radius"]["one_percent_of"] == {"measure": "itself", "value": 0.22}
    one = found["pose.x"]
    index = analyze(load(MACHINE, ["geometry.base_angle=0 deg"])).compliance_diagonal[5]
    expected = one["derivatives"]["compliance_z"] * one["one_percent_of"]["value"] / index
    assert one["percent_per_percent"]["compliance_z"] == pytest.approx(expected)


def test_an_angle_counts_alike_however_it_is_written():
    """One machine, one K: 252 deg and -108 deg."""
    one, other = (load("hexapod-cubic", [f"geometry.base_angles.5={turn}"]) for turn in ("252 deg", "-108 deg"))
    moves = [{m.path: m.percents for m in guidelines(machine).parameters} for machine in (one, other)]
    influences = [{i.path: i.percents for i in sensitivity(machine).parameters} for machine in (one, other)]
    for here, there in (moves, influences):
        assert here.keys() == there.keys()
        for path, percents in here.items():
            assert there[path] == pytest.approx(percents, abs=1e-9)
    said = [{s.text for s in statements(guidelines(m)) if "base_angles" in s.text} for m in (one, other)]
    assert said[0] == said[1]
    assert all(text.startswith("Turning geometry.base_angles") for text in said[0])
    assert len(said[0]) > 0


def test_the_greatest_comes_first():
    ranked = [max(abs(p) for p in row["percent_per_percent"].values()) for row in rows().values()]
    assert ranked == sorted(ranked, reverse=True)


def test_rigid_and_free_parts_are_left_out_with_a_note():
    answer = sensitivity(load(MACHINE, ["stiffness.passive_links.0=rigid"]))
    skipped = dict(answer.without_derivative)
    assert "rigid" in skipped["stiffness.passive_links.0"]
    assert "free" in skipped["stiffness.passive_actuator"]
    assert any("stiffness.passive_links.0" in note for note in notes(answer))
    assert not {path for path in rows() if path.startswith(("load.", "limits."))}


def test_an_index_that_is_zero_has_derivatives_but_no_percentage():
    rigid = load(MACHINE, ["stiffness.passive_links=rigid"])
    for one in sensitivity(rigid, ["compliance_y", "compliance_z"]).parameters:
        assert np.isnan(one.percents[0])
        assert one.derivatives[0] == 0.0
        assert np.isfinite(one.percents[1])


def test_rounding_of_a_rigid_direction_is_no_index(tmp_path, capsys):
    """Three U-P-U legs, rigid but for their rams, hold every rotation: C_rr is 0, and what is computed is rounding."""
    path = tmp_path / "upu.toml"
    path.write_text(THREE_UPU, "utf-8")
    found = json_of(SENSITIVITY, sensitivity(load(path)))
    for name in ("rx", "ry", "rz"):
        assert found["indices"][f"compliance_{name}"]["value"] == 0.0
        assert {row["percent_per_percent"][f"compliance_{name}"] for row in found["parameters"]} == {None}
    compliance = analyze(load(path)).compliance_diagonal[3]
    assert found["indices"]["compliance_x"]["value"] == pytest.approx(compliance, rel=1e-12)
    assert max(abs(row["percent_per_percent"]["compliance_z"]) for row in found["parameters"]) < 100.0
    coupled = sensitivity(load("hexapod-cubic"), ["compliance_rx_y", "stiffness_x_y", "compliance_x"])
    assert coupled.indices[:2].tolist() == [0.0, 0.0]
    assert coupled.indices[2] > 0.0
    assert main(["sensitivity", str(path), "--quantity", "compliance", "--quantity", "stiffness"]) == 0
    printed = capsys.readouterr().out
    assert "…" not in printed
    assert all(row["path"] in printed for row in found["parameters"][:20])


def test_what_the_legs_of_a_machine_forbid_has_no_derivative():
    """Away from the home pose, three parallel axes close only if all three stay parallel."""
    found = dict(sensitivity(load("tripteron", ["pose.x=0.4"])).without_derivative)
    assert "close" in found["legs.z.elbow.axis.0"]
    assert "legs.z.elbow.point.0" not in found


def test_angles_are_in_degrees_as_everywhere_on_a_terminal(capsys):
    assert main(["sensitivity", MACHINE]) == 0
    printed = capsys.readouterr().out
    assert " 120 deg " in printed
    assert "2.0944" not in printed


def test_it_prints_a_table_with_notes(capsys):
    assert main(["sensitivity", MACHINE, "--quantity", "compliance_z"]) == 0
    printed = capsys.readouterr().out
    assert "percent per percent" in printed
    assert "geometry.base_radius" in printed
    assert "Omitted because rigid" in printed


def test_json_is_all_of_stdout(capsys):
    assert main(["sensitivity", MACHINE, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["status"] == "ok"
    assert [*found["indices"]] == [f"compliance_{name}" for name in ("rx", "ry", "rz", "x", "y", "z")]
    assert found["parameters"][0].keys() >= {"path", "value", "units", "derivatives", "percent_per_percent"}


def test_a_folder_gets_figure_and_data(tmp_path, capsys):
    folder = tmp_path / "new"
    assert main(["sensitivity", "planar-3rpr", "-o", str(folder), "--formats", "svg,png"]) == 0
    names = sorted(path.name for path in folder.iterdir())
    assert names == ["kinetostat.sha256", *(f"sensitivity.{suffix}" for suffix in ("json", "png", "svg"))]
    written = json.loads((folder / "sensitivity.json").read_text("utf-8"))
    assert [*written["indices"]] == ["compliance_rz", "compliance_x", "compliance_y"]
    assert "geometry.base_radius" in (folder / "sensitivity.svg").read_text("utf-8")
    assert "sensitivity.png" in capsys.readouterr().out


def test_out_of_reach_there_is_no_answer(capsys):
    assert main(["sensitivity", MACHINE, "--set", "pose.z=5 m"]) == 1
    assert "span 5000 mm" in capsys.readouterr().err
    assert main(["sensitivity", MACHINE, "--set", "pose.z=5 m", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["parameters"] == []


def test_an_unknown_quantity_is_refused(capsys):
    assert main(["sensitivity", MACHINE, "--quantity", "weight"]) == 2
    assert '"weight" is not a quantity' in capsys.readouterr().err


def test_people_are_told_which_leg_an_entry_is_of(capsys):
    """Entries count from 0, as --set takes them; JSON has the bare path."""
    assert main(["sensitivity", "hexapod"]) == 0
    printed = capsys.readouterr().out
    assert "geometry.base_angles.5 (leg 6)" in printed
    assert "stiffness.actuator.0 (leg 1)" in printed
    assert "tool.offset.2 " in printed
    assert with_leg(load("orthoglide"), "stiffness.actuator.1") == "stiffness.actuator.1 (leg y)"
    assert with_leg(load(MACHINE), "stiffness.passive_links.0") == "stiffness.passive_links.0"
    assert "geometry.base_angles.5" in rows("hexapod")
