"""A machine that has snapped over is said to have, by the same word in an analysis, in a grid and in requirements."""

from pathlib import Path

import pytest

from kinetostat import analyze, evaluate, evaluate_grid, load, requirements, under_load
from kinetostat.views.answers import description_of
from kinetostat.views.data_forms import json_of

SNAPS = Path(__file__).parents[1] / "cases" / "snaps-over.toml"


def scaled(share):
    machine = load(SNAPS)
    given = {name: getattr(machine.tables["load"], name) for name in ("force", "moment")}
    loads = {f"load.{name}.{i}": share * vector[i] for name, vector in given.items() for i in range(3)}
    return machine.with_values(loads)


@pytest.mark.numbers
def test_a_grid_says_what_an_analysis_says():
    """The machine stands up to 0.528 times its load: below it has not snapped, above it has."""
    for share, expected in ((0.4, False), (1.0, True)):
        machine = scaled(share)
        state = under_load(machine)
        assert (state.rest.word, state.snapped) == ("ok", expected)
        assert ("snapped over" in state.message) is expected
        assert json_of(description_of(state), state)["snapped"] is expected
        y = machine.tables["pose"].y
        table = evaluate(machine, {"y": [y, y]}, ["snapped", "displacement"])
        assert table["snapped"].values.tolist() == [float(expected)] * 2
        assert (table["status"].values == 0).all()


def test_a_requirement_excludes_it(tmp_path):
    (tmp_path / "own.toml").write_text(SNAPS.read_text("utf-8") + '\n[requirements]\nstays = "snapped < 1"\n', "utf-8")
    machine = load(tmp_path / "own.toml")
    assert [verdict.met for verdict in requirements(machine)] == [False]


def test_hexapods_do_not_snap():
    machine = load("hexapod", ["load.force=[0, 0, -400]"])
    grid = evaluate_grid(machine, ["x=-5 mm:5 mm:3", "y=-5 mm:5 mm:2"], ["snapped"])
    assert grid["snapped"].values == pytest.approx(0.0)
    assert not under_load(machine).snapped
    assert analyze(machine).status.word == "ok"
