"""Tables of corrections: their error at poses of no grid, measured with the loaded machine, and their laws."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from kinetostat import command, correction_table, save
from kinetostat.cli import main
from kinetostat.equilibrium.balance import free_state
from kinetostat.equilibrium.solving import at_rest
from kinetostat.equilibrium.state import MachineState
from kinetostat.machine.actuators import senses_of
from kinetostat.machine.parameters import with_values
from kinetostat.views.answers import plain_of
from kinetostat.views.notebook import html_of
from machines import column, load_without_limits
from refusals import refused

WEIGHT = ["tool.mass=20 kg", "load.gravity=[0, 0, -9.81]"]


@pytest.mark.parametrize(("counts", "by_law"), [({"x": 13, "y": 13}, False), ({"x": 5, "y": 5, "z": 3}, True)])
def test_corrections_cut_the_error_over_the_workspace_by_a_thousand(counts, by_law):
    """At random poses, the loaded model is driven by what a controller would make of the table, or of its law."""
    machine = load_without_limits("delta", ["load.force=[0, 0, -30]"])
    spans = {"x": (-0.15, 0.15), "y": (-0.15, 0.15), "z": (-0.75, -0.65)}
    table = correction_table(machine, [f"{k}={spans[k][0]}:{spans[k][1]}:{count}" for k, count in counts.items()])
    rng = np.random.default_rng(7)
    poses = {k: rng.uniform(*spans[k], 40) for k in counts}
    values = list(poses.values())
    between = RegularGridInterpolator(table.axes, table.corrections)
    corrections = table.law.at(values) if by_law else between(np.stack(values, axis=1))
    placed = with_values(machine, {f"pose.{k}": values for k, values in poses.items()})
    mechanism = MachineState(placed, 40).mechanism
    off = []
    for amounts in (np.zeros((40, 3)), corrections * np.array(senses_of(machine.configure()), dtype=float)):
        moved = at_rest(mechanism, replace(free_state(mechanism), amounts=amounts)).balance.state.platform.translation
        off.append(np.linalg.norm(moved, axis=1) * mechanism.length)
    assert off[1].max() < 1e-3 * off[0].max()
    assert off[0].max() < table.error_uncorrected * (1.0 + 1e-9)
    stated = table.law_error if by_law else table.error
    assert off[1].max() < 1.2 * (stated + table.error_of_exact), "the stated error is that of the whole table"


def test_under_a_turning_gravity_the_law_is_a_cosine_and_a_sine():
    """What gravity does not turn, a force at the tool, is the constant."""
    forced = load_without_limits("hexapod", [*WEIGHT, "load.force=[30, 0, -40]"])
    table = correction_table(forced, "gravity_angle=0 deg:90 deg:4")
    assert table.exact
    assert table.law.terms == ((("power", 0),), (("cos", 1),), (("sin", 1),))
    for share, setting in enumerate(("load.gravity=[0, 0, 0]", "load.force=[0, 0, 0]")):
        alone = command(load_without_limits("hexapod", [*WEIGHT, "load.force=[30, 0, -40]", setting]))
        assert table.law.coefficients[share] == pytest.approx(alone.corrections[0], rel=1e-4)
    there = command(forced.with_values(gravity_angle="137 deg"))
    assert table.law.at([np.radians([137.0])])[0] == pytest.approx(there.corrections[0], abs=1e-14)
    bare = correction_table(load_without_limits("hexapod", WEIGHT), "gravity_angle=0 deg:90 deg:4")
    assert bare.law.terms == ((("cos", 1),), (("sin", 1),)), "nothing is constant"


def test_what_no_actuator_brings_back_adds_to_the_simple_law_the_square_of_the_load():
    errors = []
    for mass in (5.0, 10.0):
        machine = load_without_limits("delta", [f"tool.mass={mass}", "load.gravity=[0, 0, -9.81]"])
        table = correction_table(machine, "gravity_angle=0 deg:90 deg:4")
        assert not table.exact
        assert len(table.law.terms) == 3
        errors.append(table.law_error)
    assert errors[1] / errors[0] == pytest.approx(4.0, rel=0.05)


def test_the_law_is_as_short_as_its_tolerance_allows():
    machine = load_without_limits("hexapod", WEIGHT)
    over = ["x=-2 cm:2 cm:6", "gravity_angle=0 deg:90 deg:4"]
    terms, errors = [], []
    for tolerance in ("1 mm", "1 um", "10 nm", "0.1 nm"):
        table = correction_table(machine, over, tolerance)
        assert table.law_error <= table.tolerance
        terms.append(len(table.law.terms))
        errors.append(table.law_error)
    assert terms == sorted(terms)
    assert terms[0] < terms[-1]
    assert errors == sorted(errors, reverse=True)
    there = command(machine.with_values(x=0.0123, gravity_angle="50 deg"))
    values = [np.array([0.0123]), np.radians([50.0])]
    assert table.law.at(values)[0] == pytest.approx(there.corrections[0], abs=1e-9)


def test_halving_the_cells_quarters_the_stated_error():
    machine = load_without_limits("hexapod", WEIGHT)
    errors = [correction_table(machine, f"x=-2 cm:2 cm:{count}").error for count in (5, 9, 17)]
    assert np.divide(errors[:-1], errors[1:]) == pytest.approx([4.0, 4.0], rel=0.1)


def test_cells_without_a_state_of_rest_are_counted():
    table = correction_table(load_without_limits("delta", ["load.force=[0, 0, -30]"]), "x=0:5:3")
    assert table.unknown == 2
    assert "2 of 2 cells have a corner or a middle without a command (4 out of reach)." in table.message
    assert np.isfinite(table.corrections[0]).all()
    assert np.isnan(table.corrections[2]).all()


@pytest.mark.parametrize(
    ("over", "tolerance", "pattern"),
    [
        ("x=0:1 cm:3", "1 kg", 'tolerance is "1 kg".*not a unit of length'),
        ("x=0:1 cm:3", 0.0, "greater than 0"),
        ("x=0:1 cm:1000000", None, "at most 200,000"),
        (["x=0:1 cm:3", "x=0:1 cm:3"], None, "varied twice"),
        (
            "x=9:10:3",
            None,
            r"^Delta: 5 of 5 poses have no command \(5 out of reach\). Pose 1: The rod of leg 2",
        ),
    ],
)
def test_tables_that_cannot_be_made_are_refused(over, tolerance, pattern):
    with refused(pattern):
        correction_table(load_without_limits("delta", ["load.force=[0, 0, -30]"]), over, tolerance)


def test_a_table_of_a_machine_that_falls_is_refused():
    with refused(r"2 of 2 poses have no command \(2 no rest\). Pose 1: The machine comes to no rest under its loads"):
        correction_table(column(2600), "roll=0 deg:0.01 deg:2")


def test_the_command_writes_the_table_and_prints_its_law(tmp_path, capsys):
    path = tmp_path / "corrections.csv"
    settings = [word for setting in WEIGHT for word in ("--set", setting)]
    assert main(["command", "hexapod", *settings, "--over", "gravity_angle=0 deg:90 deg:4", "-o", str(path)]) == 0
    said = capsys.readouterr().out
    assert "exact to round-off" in said
    assert "cos(gravity_angle)" in said
    rows = list(csv.DictReader(path.read_text().splitlines()))
    table = correction_table(load_without_limits("hexapod", WEIGHT), "gravity_angle=0 deg:90 deg:4")
    column = [float(row["leg 3 actuator correction [m]"]) for row in rows]
    assert column == pytest.approx(table.corrections[:, 2], abs=1e-15)
    assert float(rows[1]["load.gravity_angle [rad]"]) == pytest.approx(np.radians(30.0))
    data = json.loads(save(table, tmp_path / "table.json").read_text())
    assert data["law"]["exact"]
    assert data["law"]["terms"] == [{"load.gravity_angle": ["cos", 1]}, {"load.gravity_angle": ["sin", 1]}]
    assert "sin(gravity_angle)" in html_of(table)


@pytest.mark.parametrize(
    ("words", "pattern"),
    [
        (["poses.csv", "--over", "x=0:1 cm:3"], "not from both"),
        (["--tolerance", "1 um"], "give its axes with --over"),
    ],
)
def test_words_that_contradict_each_other_are_refused(words, pattern, capsys):
    assert main(["command", "hexapod", *words]) == 2
    assert pattern in capsys.readouterr().err


def test_without_loads_there_is_nothing_to_correct(capsys):
    assert main(["command", "hexapod", "--over", "x=0:1 cm:3"]) == 0
    assert "No load moves the tool" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "poses", "words", "reason"),
    [
        (
            "delta",
            {"x": [0.0, 5.0]},
            ["ok", "out_of_reach"],
            "1 of 2 poses has no command (1 out of reach). Pose 2: The",
        ),
        ("hexapod", {"yaw": [np.pi / 2]}, ["singular"], "The pose is singular (actuation singularity). With all"),
        (
            "hexapod",
            {"x": [20.0, 0.0, 20.0]},
            ["no_rest", "ok", "no_rest"],
            "(2 no rest). Pose 1: The machine",
        ),
    ],
)
def test_poses_without_a_command_have_their_true_reason(name, poses, words, reason):
    answer = command(load_without_limits(name, ["load.force=[0, 0, -100]"]), poses)
    assert plain_of(answer)["status"] == words
    assert reason in answer.message
    assert answer.settled.tolist() == np.isfinite(answer.coordinates).all(axis=1).tolist()
