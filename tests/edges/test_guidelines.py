"""`kinetostat guidelines`: what it says of the paper's machine, over grids, and what it prints, writes and refuses."""

import json

import numpy as np
import pytest

from kinetostat.cli import main
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import values, with_values
from kinetostat.studies.analysis import analyze
from kinetostat.studies.guideline_sentences import statements
from kinetostat.studies.guidelines import guidelines
from kinetostat.views.data_forms import json_of
from kinetostat.views.guidelines import GUIDELINES

MACHINE = "zhang-gosselin-4dof"
GRID = ["x=-2 cm:2 cm:5", "z=66 cm:70 cm:5"]


@pytest.fixture(scope="module")
def paper():
    return guidelines(load(MACHINE), GRID)


@pytest.fixture(scope="module")
def data(paper):
    return json_of(GUIDELINES, paper)


def element(data, name):
    return next(one for one in data["elements"] if one["name"] == name)


def test_it_says_what_the_paper_says(data):
    """Guidelines (ii) to (v) of section 4.2: what depends on what, and equations 33-38."""
    actuators, link = element(data, "actuator ×4"), element(data, "passive link 1")
    assert [n for n, p in actuators["compliance_share"].items() if p == 0.0] == ["rz", "y"]
    assert link["compliance_share"]["rz"] == pytest.approx(0.5)
    assert data["stiffness_equations"]["actuator ×4"]["x"] == pytest.approx(0.0704587, rel=1e-6)
    assert data["stiffness_equations"]["passive link 1"] == pytest.approx(
        {"rx": 0, "ry": 0, "rz": 0.592593, "x": 0, "y": 0.961169, "z": 0}, rel=1e-6
    )


def test_the_limit_is_where_the_compliance_is_one_percent_above_the_rigid_one(data):
    """Put to the test on whole machines, files and all, not on the algebra it comes from."""
    limit = element(data, "links together")["rigid_from"]
    rigid = analyze(load(MACHINE, ["stiffness.passive_links=rigid"])).compliance_diagonal
    for i, name in ((0, "rx"), (1, "ry"), (3, "x"), (5, "z")):
        here = analyze(load(MACHINE, [f"stiffness.passive_links={limit[name]!r}"])).compliance_diagonal
        assert here[i] / rigid[i] == pytest.approx(1.01, rel=1e-9)
    assert limit["rz"] is None
    assert limit["y"] is None
    ratio = element(data, "links together")["rigid_from_per_actuator"]
    assert ratio["rx"] == pytest.approx(limit["rx"] / 1000.0)


def test_twice_as_stiff_gains_what_it_says(data):
    gain = element(data, "actuator ×4")["doubling_lowers_compliance"]
    before, after = (analyze(load(MACHINE, [f"stiffness.actuator={k}"])).compliance_diagonal for k in (1000, 2000))
    assert list(gain.values()) == pytest.approx(1.0 - np.array(after) / np.array(before), abs=1e-9)


def test_a_percent_more_stiffens_by_the_percentage(data):
    machine, path = load(MACHINE), "geometry.base_radius"
    told = next(one for one in data["parameters"] if one["path"] == path)["stiffer_percent_per_percent"]
    more, less = (
        np.array(analyze(with_values(machine, {path: values(machine)[path] * f})).compliance_diagonal)
        for f in (1.0001, 0.9999)
    )
    assert list(told.values()) == pytest.approx(100 * (less - more) / (less + more) / 0.01, rel=1e-4, abs=1e-6)


def test_statements_hold_at_the_poses_that_they_say(paper):
    """Pose by pose, by machines of their own."""
    assert any(s.text.startswith("Increasing ") and "\N{NO-BREAK SPACE}%" in s.text for s in statements(paper))
    about_z = next(s for s in statements(paper) if s.topic == "compliance" and s.text.startswith("About z "))
    own = [guidelines(load(MACHINE, [f"pose.x={x}", f"pose.z={z}"])) for x in (-0.02, -0.01, 0, 0.01, 0.02)
           for z in (0.66, 0.67, 0.68, 0.69, 0.70)]  # fmt: skip
    masks = [found.roles.shares[:3, 2, 0] >= 0.01 for found in own]
    here = paper.roles.shares[:3, 2, 0] >= 0.01
    assert 0.0 < about_z.holds < 1.0
    assert about_z.holds == pytest.approx(np.mean([(mask == here).all() for mask in masks]))
    base = next(move for move in paper.parameters if move.path == "geometry.base_radius")
    stiffer = [next(m for m in found.parameters if m.path == base.path).percents[0] > 1e-3 for found in own]
    assert base.stiffer[0] == pytest.approx(np.mean(stiffer))


def test_the_worst_pose_decides_the_limit_over_the_grid(paper, data):
    k = [one.name for one in paper.elements].index("links together")
    corners = [guidelines(load(MACHINE, [f"pose.x={x}", f"pose.z={z}"])) for x in (-0.02, 0.02) for z in (0.66, 0.70)]
    worst = element(data, "links together")["over_grid"]["rigid_from_factor"]["rx"]
    assert worst >= max(found.roles.rigid[k, 0, 0] for found in corners) * (1 - 1e-12)
    assert worst >= paper.roles.rigid[k, 0, 0]


@pytest.mark.parametrize("name", ["hexapod", "tripteron", "delta", "planar-3rpr", "passive-leg-4dof-driven"])
def test_every_kind_of_machine_has_guidelines(name, capsys):
    assert main(["guidelines", name, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["statements"]
    assert found["parameters"]
    shares = [row["compliance_share"] for row in found["elements"] if row["name"] != "links together"]
    for direction in found["components"]:
        assert sum(row[direction] for row in shares) == pytest.approx(1.0, abs=1e-9)


def test_what_it_prints_and_writes(tmp_path, capsys):
    over = [word for text in GRID for word in ("--over", text)]
    assert main(["guidelines", MACHINE, *over, "--full", "-o", str(tmp_path), "--formats", "png,svg"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "passive link 2 (80 %), not from the actuators" in said
    assert "never about z and along y, where nothing else is compliant" in said
    assert "[everywhere]" in said
    assert "K_x 0.0704587 k(actuator ×4)" in said
    names = {path.name for path in tmp_path.iterdir()}
    assert {"guidelines.json", "guidelines-design.png", "guidelines-rigid.svg"} <= names
    assert json.loads((tmp_path / "guidelines.json").read_text("utf-8"))["grid"]["answered"] == 25


def test_rigid_directions_are_said_to_be_rigid(capsys):
    assert main(["guidelines", MACHINE, "--set", "stiffness.passive_links=rigid"]) == 0
    said = capsys.readouterr().out
    assert "The platform is rigid about z and along y." in said
    assert "13035 N·m/rad" in said


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--over", "geometry.base_radius=20 cm:30 cm:3"], 2, "is not a coordinate of the pose"),
        (["--over", "x=0:1 cm:20000"], 2, "at most 10,000"),
        (["--over", "x=0:1 cm"], 2, "not a range"),
        (["--set", "pose.z=3 m"], 1, "have to span 3000 mm"),
    ],
)
def test_what_it_refuses(arguments, code, said, capsys):
    assert main(["guidelines", MACHINE, *arguments]) == code
    assert said in capsys.readouterr().err
