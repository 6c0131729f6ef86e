"""`state = "loaded"` in [load]: what commands show where no quantity is named, and that files keep it."""

import json
import pickle

import numpy as np
import pytest

from kinetostat import analyze, build, evaluate, guidelines, load, save, sensitivity
from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, NO_ANSWER
from kinetostat.kinematics.status import Status
from kinetostat.machine.file_schema import machine_schema
from kinetostat.machine.loading import as_toml
from kinetostat.machine.saving import as_file
from machines import cable, written
from refusals import refused

PUSHED = ["--set", 'load.force=[0, 0, "-400 N"]']
LOADED = ["--set", "load.state=loaded"]
LOAD = """[load]
state = "loaded"    # the comment stays
force = [0, -500, 0]
min_tension = 50
"""
ENDS = {"a": (-1, 1), "b": (1, 1), "c": (-1, -1), "d": (1, -1)}
CABLES = (
    written("four upright cables", (0, 0, 0), {"x": 0, "y": 0, "yaw": 0})
    + LOAD
    + "".join(cable(name, (x, 2 * up, 0), (x, 0.2 * up, 0)) for name, (x, up) in ENDS.items())
)


def answer(capsys, *words):
    code = main([*words, "--json"])
    return code, json.loads(capsys.readouterr().out)


def test_a_file_wants_what_the_option_wants(capsys):
    wanted = answer(capsys, "analyze", "hexapod", *PUSHED, *LOADED)
    assert wanted == answer(capsys, "analyze", "hexapod", *PUSHED, "--loaded")
    assert wanted[1]["rest"] == "ok"
    free = answer(capsys, "analyze", "hexapod", *PUSHED, "--set", "load.state=free")
    assert free == answer(capsys, "analyze", "hexapod", *PUSHED)


@pytest.mark.parametrize(
    "command", [["sweep", "--vary", "x=0:1 cm:2"], ["map", "--over", "x=0:1 cm:2", "--over", "y=0:1 cm:2"]]
)
def test_without_a_quantity_a_loaded_machine_shows_how_far_it_moves(capsys, command):
    name, *ranges = command
    words = [name, "hexapod", *PUSHED, *ranges]
    assert answer(capsys, *words, "--loaded")[1]["variables"] == answer(capsys, *words, *LOADED)[1]["variables"]
    assert set(answer(capsys, *words, *LOADED)[1]["variables"]) == {
        f"displacement_{c}" for c in ["rx", "ry", "rz", "x", "y", "z"]
    }
    chosen = ["--quantity", "stiffness_z"]
    assert answer(capsys, *words, *LOADED, *chosen)[1]["variables"] == answer(capsys, *words, *chosen)[1]["variables"]


@pytest.mark.numbers
def test_the_workspace_of_a_loaded_machine_is_where_it_comes_to_rest(capsys, tmp_path):
    """Beside x = 0, all upright cables pull back to it, so that no tensions hold the machine there."""
    path = tmp_path / "cables.toml"
    path.write_text(CABLES)
    words = ["workspace", str(path), "--over", "x=-1:1:5", "--over", "y=-1:1:3"]
    nodes = answer(capsys, *words)[1]["nodes"]
    assert (nodes["inside"], nodes["no rest under load"]) == (3, 12)
    assert answer(capsys, *words, "--set", "load.state=free")[1]["nodes"]["no rest under load"] == 0
    assert answer(capsys, *words, "--set", "load.state=free", "--loaded")[1]["nodes"] == nodes


@pytest.mark.parametrize("count", [3, 600])  # few, and enough for several slabs and for programs
@pytest.mark.parametrize("limits", ["", "[limits]\nactuator_force = 1e6\n"])
@pytest.mark.numbers
def test_what_follows_from_wrenches_has_one_number_whatever_is_asked_beside_it(count, limits):
    """At x = 0 tension alone holds upright cables: the machine rests there, and K, C and the margin have no number."""
    machine = build(CABLES.replace("min_tension = 50\n", limits))
    poses = {"x": np.linspace(0.0, 0.4, count)}
    at_rest = evaluate(machine, poses, ["displacement_x", "actuator_force"])
    assert not at_rest.status.any()
    of_wrenches = ["singularity_margin", "stiffness_x", "compliance_y"]
    beside = evaluate(machine, poses, ["displacement_x", *of_wrenches])
    assert beside.status.values.tolist() == [Status.SINGULAR] + [Status.OK] * (count - 1)
    np.testing.assert_allclose(beside["displacement_x"][1:], at_rest["displacement_x"][1:], rtol=1e-9, atol=1e-12)
    for name in of_wrenches:
        alone = evaluate(machine, poses, [name])
        assert (alone.status == beside.status).all(), name
        np.testing.assert_allclose(alone[name], beside[name], rtol=1e-9, err_msg=name)
    known = analyze(machine.with_values(x=0.0))
    assert (known.status, known.singularity_margin < 1e-12) == (Status.SINGULAR, True)


def test_a_pose_whose_limits_are_judged_at_rest_has_one_status_where_there_is_none():
    """Loads of actuators are limited and nobody knows them: maps had said no_rest, and `analyze` and others ok."""
    machine = build(CABLES + "[limits]\nactuator_force = 1e6\n")
    beside = machine.with_values(x=0.2)
    assert evaluate(machine, {"x": [0.2]}, ["stiffness_x"]).status.values.tolist() == [Status.NO_REST]
    for question in (analyze, sensitivity, guidelines):
        answer = question(beside)
        assert answer.status is Status.NO_REST, question.__name__
        assert "comes to no rest" in answer.message


def test_requirements_are_judged_and_decide_the_exit_code(capsys, tmp_path):
    path = tmp_path / "stiff.toml"
    path.write_text(
        as_toml(
            load(
                "hexapod", ["requirements.sag=displacement_z > -1 um", "load.force=[0, 0, -4000]", "load.state=loaded"]
            )
        )
    )
    assert main(["analyze", str(path)]) == NO_ANSWER
    assert "sag" in capsys.readouterr().out
    code, data = answer(capsys, "analyze", str(path))
    assert code == NO_ANSWER
    assert [r["met"] for r in data["requirements"]] == [False]


def test_files_keep_the_state(tmp_path):
    machine = build(CABLES)
    assert machine.loaded
    assert build(as_toml(machine)).loaded
    assert pickle.loads(pickle.dumps(machine)).loaded
    assert as_file(machine) == CABLES
    assert machine.with_values(x=0.1).loaded
    wanted = load("hexapod", ["load.state=loaded"])
    assert load(save(wanted, tmp_path / "hexapod.toml")).loaded
    assert not load(save(load("hexapod"), tmp_path / "free.toml")).loaded


def test_other_words_are_refused(capsys):
    with refused('load.state is "lodaed"; did you mean "loaded"'):
        load("hexapod", ["load.state=lodaed"])
    with refused("load.state is 1; choose from free, loaded"):
        load("hexapod", ["load.state=1"])
    assert main(["analyze", "hexapod", *LOADED, "--axes", "platform"]) == BAD_INPUT
    assert 'state = "loaded" in [load] gives results in base axes only' in capsys.readouterr().err


def test_the_schema_knows_the_states():
    tables = machine_schema()["$defs"].values()
    states = [table["properties"]["state"]["enum"] for table in tables if "gravity" in table.get("properties", {})]
    assert states
    assert all(words == ["free", "loaded"] for words in states)
