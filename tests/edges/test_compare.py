"""`kinetostat compare`: designs side by side, gains, machines of different kinds, and what it refuses."""

import json

import numpy as np
import pytest

from kinetostat import budget, evaluate, modes, requirements
from kinetostat.cli import main
from kinetostat.machine.loading import as_toml, load
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import analyze
from kinetostat.studies.comparison import compare, read_design
from kinetostat.studies.datasets import evaluate_grid
from kinetostat.studio.design.texts import comparison_text
from kinetostat.views.comparison import COMPARISON, comparison_figure
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


TOOL = [
    "tool.mass=12 kg", 'load.force=["100 N", "0 N", "-500 N"]', "cutting.direction=[1, 0, 0]",
    "cutting.pressure=2000 N/mm**2", "tolerances.joints=0.05 mm",
]  # fmt: skip
STIFFER = "hexapod:stiffness.actuator=40 N/um"


def test_vibrations_displacement_and_error_stand_beside_the_stiffness():
    _, by_name = rows("hexapod", STIFFER, "tripteron", settings=TOOL[:1])
    assert by_name["first natural frequency"]["values"][0] == pytest.approx(
        modes(load("hexapod", TOOL[:1])).modes[0].frequency
    )
    assert "stable width of cut" not in by_name, "no file says anything of a cut"
    _, by_name = rows("hexapod", STIFFER, settings=TOOL)
    machine = load("hexapod", TOOL)
    names = ["displacement_x", "displacement_y", "displacement_z", "stable_width"]
    alone = evaluate(machine, {"x": [0.0]}, names)
    moved = by_name["displacement under load"]
    assert moved["values"][0] == pytest.approx(np.linalg.norm([float(alone[name][0]) for name in names[:3]]))
    assert (moved["best"], moved["better"]) == ([1], "less")
    assert by_name["stable width of cut"]["values"][0] == float(alone["stable_width"][0])
    assert by_name["error as built, 95 %"]["values"][0] == float(budget(machine).size("usual", "position")[0])
    assert by_name["error as built, 95 %"]["best"] == [], "tolerances of joints do not ask for the stiffness"


def test_any_quantity_over_poses_of_a_file(tmp_path):
    """Forces are columns as poses are; a quantity without a better side shows what is greatest in size."""
    file = tmp_path / "path.csv"
    file.write_text("x [mm],load.force.0 [N]\n0,100\n10,-300\n20,50\n", "utf-8")
    designs = {"A": load("hexapod", TOOL), "B": load("hexapod", [*TOOL, "stiffness.actuator=40 N/um"])}
    answer = compare(designs, quantities=["displacement", "frequency_1"], poses=file)
    by_name = {(row.group, row.name): row for row in answer.over}
    alone = evaluate(designs["B"], str(file), ["displacement_x", "displacement_y", "displacement_z", "frequency_1"])
    size = np.linalg.norm([alone[f"displacement_{axis}"].values for axis in "xyz"], axis=0)
    assert by_name["displacement", "worst"].values[1] == pytest.approx(size.max())
    assert by_name["frequency 1", "worst"].values[1] == alone["frequency_1"].values.min()
    along = alone["displacement_x"].values
    assert by_name["displacement x", "greatest in size"].values[1] == along[np.abs(along).argmax()] < 0.0
    assert by_name["displacement x", "greatest in size"].best == ()
    assert ("C_x", "worst") not in by_name
    assert answer.poses == ((3, 3), (3, 3))
    assert [panel.get_ylabel().split(" (")[0] for panel in comparison_figure(answer).axes] == [
        "displacement", "displacement about axes", "displacement along axes", "frequency 1", "moving mass",
    ]  # fmt: skip


def test_the_error_as_built_over_a_region():
    machine = load("hexapod", TOOL)
    answer = compare(
        [machine, machine.with_values({"geometry.base_radius": 0.13})], ["x=-1 cm:1 cm:3"], quantities="built_error"
    )
    errors = budget(machine, ranges=["x=-1 cm:1 cm:3"]).size("usual", "position")
    worst, _, mean = answer.over
    assert worst.values[0] == pytest.approx(errors.max())
    assert mean.values[0] == pytest.approx(errors.mean())
    assert worst.values[1] < worst.values[0]


def test_requirements_of_one_file_are_judged_for_all(capsys):
    required = ['requirements.stiff=["free_stiffness_x > 30 N/um", "free_stiffness_z > 1 N/um"]']
    designs = [load("hexapod", required), load("hexapod", ["stiffness.actuator=40 N/um"]), load("planar-3rpr")]
    answer = compare(designs)
    x, z = answer.verdicts
    assert [verdict and verdict.met for verdict in x] == [False, True, None]
    assert [verdict and verdict.met for verdict in z] == [True, True, None]
    assert x[0].worst == requirements(designs[0])[0].worst
    found = json_of(COMPARISON, answer)["requirements"][0]
    assert (found["name"], found["designs"][2]) == ("stiff", None)
    assert found["designs"][1]["margin"] == pytest.approx(x[1].worst / 30e6 - 1)
    assert main(["compare", "hexapod", STIFFER, "--set", required[0]]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "A misses stiff. Required B meets every requirement." in said
    assert "missed: 21.05 N/µm (-29.8 %)" in said


def test_a_quantity_of_none_of_them_is_refused():
    with pytest.raises(InputError, match="tolerances"):
        compare(["hexapod", STIFFER], quantities=["built_error"])
    with pytest.raises(InputError, match="did you mean frequency"):
        compare(["hexapod", STIFFER], quantities=["frequncy"])
    with pytest.raises(InputError, match="not from both"):
        compare(["hexapod", STIFFER], ["x=0:1 cm:2"], poses={"x": [0.0]})
    with pytest.raises(InputError, match="not from both"):  # before any design is read
        compare(["hexapod", "no-such-machine"], ["x=0:1 cm:2"], poses={"x": [0.0]})
    only = compare(["hexapod", "planar-3rpr"], quantities=["compliance_z"]).rows[-1]
    assert (only.name, only.values[1]) == ("compliance_z", None)


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
    assert "would have to span 3000 mm" in said
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
    designs = ["hexapod:tool.mass=12 kg", "hexapod:tool.mass=14 kg"]
    lone = comparison_figure(compare(designs, quantities=["frequency_1", "compliance_x", "compliance_y"]))
    labels = {panel.get_ylabel().split(" (")[0]: [t.get_text() for t in panel.get_xticklabels()] for panel in lone.axes}
    assert labels["frequency 1"] == ["A", "B"]
    assert labels["compliance along axes"] == ["x", "y"]
    figure = comparison_figure(compare(["hexapod", "hexapod:tool.mass=12 kg", "tripteron"]))
    panels = {panel.get_ylabel().split(" (")[0]: panel for panel in figure.axes}
    assert panels["compliance along axes"].get_yscale() == "log"
    assert not panels["compliance along axes"].patches
    assert len(panels["compliance along axes"].lines) > 0
    for name in ("compliance about axes", "singularity margin", "moving mass"):
        assert panels[name].get_ylim()[0] == 0.0
    assert [text.get_text() for text in panels["moving mass"].texts] == ["not known"]
    assert figure.legends[0].get_title().get_text() == "in base axes at the platform point P"


def test_each_table_of_the_studio_has_its_own_caption():
    """A screen reader calls a table by its caption: values over poses are not those at the pose of each design."""
    shown = comparison_text(compare(["hexapod", STIFFER], ["z=13 cm:14 cm:2"]))
    assert shown.count("<caption>At the pose of each design</caption>") == 1
    assert "<caption>Over z=13 cm:14 cm:2</caption>" in shown
