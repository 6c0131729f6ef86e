"""`kinetostat compare`: designs side by side, gains, machines of different kinds, and what it refuses."""

import json

import numpy as np
import pytest

from kinetostat.cli import main
from kinetostat.machine.loading import as_toml, load
from kinetostat.studies.analysis import analyze
from kinetostat.studies.comparison import compare, read_design
from kinetostat.studies.grid import evaluate_grid
from kinetostat.views.comparison import COMPARISON
from kinetostat.views.comparison_figure import comparison_figure
from kinetostat.views.data_forms import json_of

PAPER = "zhang-gosselin-4dof"
BEST = (
    f"{PAPER}:geometry.platform_radius=14 cm;geometry.base_radius=26 cm;geometry.base_angle=35 deg;"
    'geometry.platform_angle=55 deg;geometry.passive_links=["70 cm", "55 cm"];pose.z=66 cm'
)
STIFF = ["stiffness.passive_links=1e10 N*m/rad"]


def rows(*designs, settings=(), ranges=()):
    found = json_of(COMPARISON, compare([read_design(text, settings) for text in designs], ranges))
    return found, {row["name"]: row for row in found["rows"]}


def test_the_papers_designs_side_by_side():
    """Section 4.3: the numbers it prints, and every gain against the initial design."""
    found, by_name = rows(PAPER, BEST, settings=STIFF)
    assert by_name["C_rx"]["values"] == pytest.approx([0.5164, 0.120091], rel=1e-4)
    assert by_name["C_x"]["percent"] == pytest.approx([0.0, 100 * (0.316506 / 0.908722 - 1)], rel=1e-4)
    assert by_name["C_x"]["best"] == [1]
    assert by_name["C_rz"]["best"] == [0]
    assert by_name["K_x"]["better"] == "more"
    assert set(found["differences"]) == {
        "geometry.base_radius", "geometry.platform_radius", "geometry.base_angle", "geometry.platform_angle",
        "geometry.passive_links", "pose.z",
    }  # fmt: skip
    assert found["differences"]["pose.z"] == [[0.68], [0.66]]


def test_machines_with_other_freedoms_have_gaps():
    found, by_name = rows("hexapod", "planar-3rpr", "tripteron")
    assert by_name["C_rx"]["values"][1] is None
    assert by_name["C_rx"]["percent"][1] is None
    assert by_name["C_rz"]["values"][1] == pytest.approx(analyze(load("planar-3rpr")).compliance_diagonal[0])
    assert by_name["moving mass"]["values"][:2] == [None, None]
    assert [one["components"][0] for one in found["designs"]] == ["rx", "rz", "rx"]
    differences = found["differences"]
    assert {"pose.x", "pose.y"} <= set(differences)
    assert differences["stiffness.actuator"][2] is None, "the tripteron's are in its legs"
    assert len(differences["stiffness.actuator"][0]) == 6
    assert not any(path.startswith("legs.") for path in differences), "what only one of them has"


def test_a_machine_of_another_kind_hides_no_difference_of_the_others(capsys):
    """B is A with another radius; C, written leg by leg, has no radius."""
    assert main(["compare", "hexapod", "hexapod:geometry.base_radius=13 cm", "tripteron"]) == 0
    said = capsys.readouterr().out
    row = next(line for line in said.splitlines() if line.startswith(" geometry.base_radius"))
    assert row.split()[-5:] == ["115", "mm", "130", "mm", "–"]
    assert "Fields that only one design has are omitted." in said


def test_the_softest_direction_and_who_is_to_blame():
    found, _ = rows("delta", "tripteron")
    softest = {one["direction"]: one["shares"] for one in found["designs"][0]["softest"]}
    diagonal = analyze(load("delta")).compliance_diagonal
    assert set(softest) == {"ry", "y"}
    assert max(diagonal[3:]) == diagonal[4]
    assert sum(softest["y"].values()) == pytest.approx(1.0)
    assert next(iter(softest["y"])) == "actuator ×3"


def test_fields_of_one_name_keep_their_own_units(capsys):
    """An actuator is N·m/rad in the one and N/m in the other; the number of entries may differ as well."""
    assert main(["compare", "delta", "orthoglide"]) == 0
    row = next(line for line in capsys.readouterr().out.splitlines() if "stiffness.actuator" in line)
    assert "3 x 0.02 N·m/µrad" in row
    assert "3 x 50 N/µm" in row
    found, _ = rows("hexapod", "tricept")
    assert [len(own) for own in found["differences"]["stiffness.actuator"]] == [6, 3]


def test_a_rigid_direction_is_no_number():
    found, by_name = rows(PAPER, f"{PAPER}:stiffness.passive_links=rigid")
    assert by_name["K_y"]["values"][1] is None
    assert by_name["K_y"]["best"] == [1]
    assert found["designs"][1]["softest"][1]["direction"] == "x"


def test_over_a_grid():
    ranges = ["x=-2 cm:2 cm:5", "z=64 cm:70 cm:4"]
    found, _ = rows(PAPER, BEST, ranges=ranges)
    by_name = {(row["group"], row["name"]): row["values"] for row in found["grid"]["rows"]}
    data = evaluate_grid(load(PAPER), ranges, ["compliance_x", "singularity_margin"])
    here = data["compliance_x"].values
    assert by_name["C_x", "worst"][0] == pytest.approx(float(here.max()))
    assert by_name["C_x", "95 %"][0] == pytest.approx(float(np.percentile(here, 95)))
    assert by_name["C_x", "mean"][0] == pytest.approx(float(here.mean()))
    assert by_name["singularity margin", "worst"][0] == pytest.approx(float(data["singularity_margin"].min()))
    assert by_name["singularity margin", "95 %"][0] == pytest.approx(
        float(np.percentile(data["singularity_margin"].values, 5))
    )
    assert found["grid"]["designs"] == [{"answered": 20, "poses": 20}] * 2


def test_files_are_designs_too(tmp_path, capsys):
    file = tmp_path / "mine.toml"
    file.write_text(as_toml(load("hexapod", ["geometry.base_radius=13 cm"])), "utf-8")
    arguments = ["compare", "hexapod", str(file), f"{file}:stiffness.actuator=40 N/um", "-o", str(tmp_path / "out")]
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert "geometry.base_radius" in said
    assert "Largest contributions" in said
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"compare.json", "compare.png", "kinetostat.sha256"}
    told = json.loads((tmp_path / "out" / "compare.json").read_text("utf-8"))
    soft, stiff = told["rows"][0]["values"][1:]
    assert stiff == pytest.approx(soft / 2)


def test_a_design_without_an_answer_is_shown_and_told(capsys):
    assert main(["compare", PAPER, f"{PAPER}:pose.z=3 m", "--over", "z=66 cm:3 m:3"]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "would have to span 3 m" in said
    assert "A 1 of 3, B 1 of 3" in said


def test_settings_are_for_all(capsys):
    assert main(["compare", PAPER, BEST, "--set", STIFF[0], "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert "stiffness.passive_links" not in told["differences"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["hexapod"], "2 to 12 designs"),
        (["hexapod", "hexapodd"], "did you mean"),
        (["hexapod", "hexapod:geometry.base=1"], "geometry.base"),
        (["hexapod", "planar-3rpr", "--over", "z=10 cm:20 cm:3"], "not a field of family planar-3rpr"),
    ],
)
def test_what_it_refuses(arguments, said, capsys):
    assert main(["compare", *arguments]) == 2
    assert said in capsys.readouterr().err


def test_bars_start_at_zero_and_what_is_not_known_is_said():
    """A logarithmic axis has no 0 for bars to stand on: it has marks."""
    figure = comparison_figure(compare(["hexapod", "hexapod:tool.mass=12 kg", "tripteron"]))
    panels = {panel.get_ylabel().split(" (")[0]: panel for panel in figure.axes}
    assert panels["compliance along axes"].get_yscale() == "log"
    assert not panels["compliance along axes"].patches
    assert len(panels["compliance along axes"].lines) > 0
    for name in ("compliance about axes", "singularity margin", "moving mass"):
        assert panels[name].get_ylim()[0] == 0.0
    assert [text.get_text() for text in panels["moving mass"].texts] == ["not known"]
    assert figure.legends[0].get_title().get_text() == "compliance in base axes at the platform point P"
