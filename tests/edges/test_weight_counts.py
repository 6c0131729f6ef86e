"""The weight of the platform counts in every answer, and as much as the same force does.

The machine is a telescope's hexapod that carries its mirror of 3 t. Its weight is written as a mass with gravity, or as
the force and the moment that this weight has at the platform's point; both must be judged alike by every command.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from kinetostat import load, sensitivity
from kinetostat.cli import main
from kinetostat.commands.common import DONE, NO_ANSWER
from kinetostat.engine.batch import evaluate, in_slabs
from kinetostat.engine.loaded import Way, loaded_fill
from kinetostat.engine.points import PointTable
from kinetostat.kinematics.status import Status
from kinetostat.machine.parameters import values, with_values
from kinetostat.studies.under_load import under_load

TELESCOPE = str(Path(__file__).parent.parent / "cases" / "telescope-weight.toml")
WEIGHT = 3000 * 9.81
WRITTEN = {
    "mass": [],
    "force": ["--set", f"load.force=[0, 0, {-WEIGHT}]", "--set", "load.gravity=[0, 0, 0]"],
}
STATES = {state: ["--set", f"load.state={state}"] for state in ("free", "loaded")}
LIMIT = ["--set", 'limits.actuator_force="5 kN"']
ROW = ["--over", "x=-1 mm:1 mm:3", "--over", "y=0 mm:1 mm:3"]


def answer(capsys, command, *words):
    code = main([command, TELESCOPE, *words, "--json"])
    return code, json.loads(capsys.readouterr().out)


def both(capsys, command, *words):
    """The answers where the weight is a mass and where it is a force."""
    return [answer(capsys, command, *words, *form) for form in WRITTEN.values()]


@pytest.mark.parametrize("state", STATES)
def test_an_actuator_that_the_weight_overloads_is_refused(capsys, state):
    for form in WRITTEN.values():
        code = main(["analyze", TELESCOPE, *LIMIT, *STATES[state], *form])
        said = "".join(capsys.readouterr()).replace("\n           ", " ").replace("  ", " ")
        assert code == NO_ANSWER
        assert "but limits.actuator_force asks for at most 5000 N" in " ".join(said.split())
    assert main(["analyze", TELESCOPE, *STATES[state]]) == DONE


@pytest.mark.parametrize("state", STATES)
@pytest.mark.numbers
def test_no_pose_of_a_path_or_a_workspace_bears_it(capsys, tmp_path, state):
    poses = tmp_path / "poses.csv"
    poses.write_text("x,y,z\n0 mm,0 mm,-450 mm\n1 mm,0 mm,-450 mm\n")
    for _, workspace in both(capsys, "workspace", *ROW, *LIMIT, *STATES[state]):
        assert workspace["nodes"]["limits.actuator_force"] == 9
    for _, path in both(capsys, "path", str(poses), *LIMIT, *STATES[state]):
        assert path["status"] == ["joint_limit", "joint_limit"]


@pytest.mark.parametrize(("state", "agree"), [("free", 1e-12), ("loaded", 1e-6)])
def test_its_actuators_carry_the_same(capsys, state, agree):
    """Under load, the weight acts at the mirror's centre, 0.3 m below the point at which the force does."""
    maps = [data["variables"]["actuator_force"]["values"] for _, data in both(
        capsys, "map", *ROW, "--quantity", "actuator_force", *STATES[state]
    )]  # fmt: skip
    np.testing.assert_allclose(maps[0], maps[1], rtol=agree)
    assert np.min(maps) > 8800


@pytest.mark.parametrize("state", STATES)
def test_a_requirement_and_a_comparison_see_it(capsys, tmp_path, state):
    required = ["--set", "requirements.drives=actuator_force < 8 kN", *STATES[state]]
    for code, analysis in both(capsys, "analyze", *required):
        assert code == NO_ANSWER
        (verdict,) = analysis["requirements"]
        assert not verdict["met"]
        assert verdict["worst"] == pytest.approx(8822.9, abs=1.2)


def test_the_load_case_of_an_analysis_holds_it(capsys):
    masses, forces = (data["load"] for _, data in both(capsys, "analyze", *STATES["free"]))
    np.testing.assert_allclose(masses["wrench"], forces["wrench"], atol=1e-9 * WEIGHT)
    np.testing.assert_allclose(masses["deflection"], forces["deflection"], rtol=1e-9, atol=1e-15)
    loads = [[spring["load"] for spring in case["springs"]] for case in (masses, forces)]
    np.testing.assert_allclose(*loads, atol=1e-9 * WEIGHT)


def test_an_error_budget_counts_the_joints_that_it_presses(capsys):
    for _, budget in both(capsys, "budget"):
        assert len(budget["pressed_joints"]) == 12


@pytest.mark.parametrize("name", ["hexapod", "tricept", "planar-3rpr"])
def test_loads_at_rest_are_the_same_in_all_arithmetics(name):
    """One pose by statics, a grid by the equations of any machine, by a program of NumPy and in machine code."""
    weight = "[0, -9.81, 0]" if name.startswith("planar") else "[0, 0, -9.81]"
    settings = ['load.state="loaded"', "tool.mass=3 kg", f"load.gravity={weight}"]
    machine = load(name, settings)
    draw = np.random.default_rng(7)
    poses = {path: here + draw.uniform(-0.01, 0.01, 40) for path, here in values(machine).items() if "pose." in path}
    rows = {}
    for way in (Way.ANY_MACHINE, Way.NATIVE):
        fill = loaded_fill(machine, list(poses), ["actuator_force"], way)
        (rows[way],), status = in_slabs(PointTable(poses), fill, 1, way.slab, 1)
        assert not status.any()
    for row in rows.values():
        np.testing.assert_allclose(row, rows[Way.ANY_MACHINE], rtol=1e-12)
    first = under_load(with_values(machine, {path: column[0] for path, column in poses.items()}))
    carried = max(abs(spring.load) for spring in first.springs if spring.actuated)
    assert rows[Way.NATIVE][0] == pytest.approx(carried, rel=1e-12)
    bound = float(np.median(rows[Way.NATIVE]))
    limited = load(name, [*settings, f"limits.actuator_force={bound} N"])
    for way in rows:
        _, status = in_slabs(PointTable(poses), loaded_fill(limited, list(poses), ["aspect"], way), 1, way.slab, 1)
        assert ((status == Status.JOINT_LIMIT) == (rows[Way.ANY_MACHINE] > bound)).all()


@pytest.mark.parametrize("state", STATES)
@pytest.mark.numbers
def test_the_slope_of_the_greatest_load_is_that_of_differences(state):
    machine = load("hexapod", [f"load.state={state}", "tool.mass=20 kg", "load.gravity=[0, 0, -9.81]", "pose.x=3 mm"])
    slopes = {row.path: row.derivatives[0] for row in sensitivity(machine, ["actuator_force"]).parameters}

    def greatest(path, value):
        (force,) = evaluate(machine, PointTable({path: np.array([value])}), ["actuator_force"]).values["actuator_force"]
        return force

    for path, step in {"tool.mass": 1e-2, "load.gravity.2": 1e-3, "pose.x": 1e-6}.items():
        here = values(machine)[path]
        slope = (greatest(path, here + step) - greatest(path, here - step)) / (2 * step)
        assert slopes[path] == pytest.approx(slope, rel=1e-6)


def test_sensitivities_of_a_limited_machine_do_not_need_its_rest():
    """Limits judge the pose; its compliance needs no derivatives at rest, which such legs do not have."""
    machine = load(TELESCOPE)
    assert sensitivity(machine, ["compliance_z"]).parameters
    overloaded = sensitivity(load(TELESCOPE, ["limits.actuator_force=5 kN"]), ["compliance_z"])
    assert overloaded.status is Status.JOINT_LIMIT
    assert "limits.actuator_force" in overloaded.message


def test_what_an_answer_to_first_order_leaves_out_is_said(capsys):
    heavy = ["hexapod", "--set", "load.gravity=[0, 0, -9.81]", "--set", "linear_density.legs=5 kg/m"]
    main(["analyze", *heavy])
    said = " ".join(capsys.readouterr().out.split())
    assert "Not counted here, but by analyze --loaded: the weight of the links (" in said
    main(["analyze", *heavy, "--loaded"])
    assert "Not counted" not in capsys.readouterr().out
    main(["workspace", *heavy, "--set", "limits.actuator_force=5 kN", *ROW])
    assert "the weight of the links (" in " ".join(capsys.readouterr().out.split())
