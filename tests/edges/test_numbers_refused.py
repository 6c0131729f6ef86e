"""Numbers that are none, or that no machine has, are refused alike at every entrance."""

import math

import pytest

from kinetostat import analyze, build, bundled, changed, evaluate_grid, load, load_problem
from kinetostat.cli import main
from kinetostat.machine.parameters import shown
from kinetostat.spec.document import parse
from refusals import refused

BAD = {"nan": math.nan, "-inf": -math.inf, "1e-300": 1e-300}
STUDY = "zhang-gosselin-2002"


def from_file(number):
    build(bundled()["hexapod"].replace('actuator = "20 N/um"', f"actuator = {number}"))


def from_tables(number):
    document = parse(bundled()["hexapod"], "hexapod")
    build({**document, "stiffness": {"actuator": BAD[number]}})


def from_setting(number):
    load("hexapod", f"stiffness.actuator={number}")


def from_python(number):
    changed(load("hexapod"), {"stiffness.actuator": BAD[number]})


def from_range(number):
    evaluate_grid(load("hexapod"), f"stiffness.actuator={number}:1e7:3")


def from_study(number):
    load_problem(STUDY, [f"variables.0.from={number}"])


@pytest.mark.parametrize("number", BAD)
@pytest.mark.parametrize("enter", [from_file, from_tables, from_setting, from_python, from_range, from_study])
def test_no_entrance_takes_what_is_no_number(enter, number):
    with refused() as refusal:
        enter(number)
    assert number.lower() in str(refusal.value).lower()


@pytest.mark.parametrize("path", ["pose.z", "load.force.0", "tool.offset.0", "geometry.base_radius"])
@pytest.mark.parametrize("number", [math.nan, math.inf, True, None, 1j, "1e400 m"])
def test_a_length_or_a_force_is_finite(path, number):
    with refused(rf"^(values\['{path}'\]|{shown(path)}) is "):
        changed(load("delta"), {path: number})


@pytest.mark.parametrize("path", ["stiffness.actuator", "stiffness.bar_axial"])
def test_infinity_in_python_is_rigid_and_no_limit(path):
    assert analyze(changed(load("delta"), {path: math.inf})).rigid
    loaded = {"load.force.2": -900.0}
    assert analyze(changed(load("delta"), loaded)).status.word == "joint_limit"
    assert analyze(changed(load("delta"), loaded | {"limits.actuator_moment": math.inf})).status.word == "ok"


def test_stiffnesses_too_far_apart_to_be_told_from_rigid_are_refused():
    settings = ["stiffness.actuator=1e-9", "stiffness.bar_axial=1e20"]
    with refused(r"stiffness\.actuator.* 1e-09 .* stiffness\.bar_axial 1e\+20 .*factor of 1e\+22"):
        load("delta", settings)
    with refused(r"factor of 1e\+22"):
        changed(load("delta", settings[:1]), {"stiffness.bar_axial": 1e20})
    softest = analyze(load("delta", ["stiffness.actuator=1e-9", "stiffness.bar_axial=1e12"]))
    assert softest.stiffness is not None
    assert softest.compliance is not None
    assert min(softest.compliance_diagonal) > 0.0


@pytest.mark.parametrize(
    "direction", [(math.inf, 0, 1), (math.nan, 0, 1), (1, 2), "123", None, (1e200, 0, 0), 3, (0, 0, 0)]
)
def test_a_direction_is_three_finite_numbers(direction):
    with refused(r"^(The )?direction"):
        analyze(load("delta")).along(direction)


def test_the_command_line_refuses_a_direction_without_end(capsys):
    assert main(["analyze", "delta", "--along", "inf,0,1"]) == 2
    assert "give three finite numbers" in capsys.readouterr().err


def test_a_lead_is_none_or_at_least_the_size_of_an_atom():
    with refused(r"drives\.lead is 1e-13.* at least 1e-12 m"):
        load("hexapod", "drives.lead=1e-13")
    assert load("hexapod", "drives.lead=0").tables["drives"].lead == 0.0
