"""Requirements of a file: judged where they hold, with margin and worst pose, in every answer; mistakes."""

import json
from dataclasses import replace

import numpy as np
import pytest

from kinetostat import analyze, build, bundled, evaluate, load_problem, requirements
from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, DONE, NO_ANSWER
from kinetostat.machine.loading import as_toml
from kinetostat.machine.saving import as_file
from kinetostat.spec.document import parse
from kinetostat.spec.study import read_study, study_toml
from kinetostat.studies.bundled import bundled_studies
from refusals import refused

BOX = '["x=-2 cm:2 cm:5", "z=12 cm:16 cm:5"]'
TABLE = f"""
[requirements]
here = "free_stiffness_z > 40 N/um"
box = {{ demand = ["free_stiffness_x > 20 N/um", "singularity_margin > 0.05"], over = {BOX} }}
list = {{ demand = "free_stiffness_z < 55 N/um", poses = [{{ x = "2 cm", "pose.z" = 0.16 }}, {{ z = "14 cm" }}] }}
"""
WITHOUT_LIMITS = bundled()["hexapod"].partition("[limits]")[0]
MACHINE = build(WITHOUT_LIMITS + TABLE)


def test_each_condition_is_judged_at_all_its_poses():
    here, box, margin, listed = requirements(MACHINE)
    assert (here.met, here.poses, here.place) == (True, 1, "")
    assert here.worst == pytest.approx(1 / analyze(MACHINE).compliance[5][5])
    assert here.margin == pytest.approx(here.worst / 40e6 - 1)
    grid = [[x, z] for x in np.linspace(-0.02, 0.02, 5) for z in np.linspace(0.12, 0.16, 5)]
    answers = evaluate(
        MACHINE, dict(zip("xz", np.transpose(grid), strict=True)), ["free_stiffness_x", "singularity_margin"]
    )
    assert (box.met, box.poses, margin.met) == (False, 25, True)
    assert box.worst == answers.free_stiffness_x.min()
    assert box.failed == int((answers.free_stiffness_x <= 20e6).sum())
    assert margin.worst == answers.singularity_margin.min()
    assert 1 / analyze(MACHINE.with_values(box.worst_pose)).compliance[3][3] == pytest.approx(box.worst)
    assert (listed.met, listed.worst_pose) == (False, {"pose.x": 0.02, "pose.z": 0.16})
    assert listed.margin == pytest.approx(1 - listed.worst / 55e6)


def test_a_pose_without_a_result_fails_and_is_the_worst():
    required = 'far = { demand = "free_stiffness_z > 1 N/um", poses = [{ z = "14 cm" }, { z = "9 m" }] }'
    machine = build(bundled()["hexapod"] + f"[requirements]\n{required}", settings=["limits.longest_leg=30 cm"])
    (far,) = requirements(machine)
    assert (far.met, far.worst, far.margin, far.status) == (False, None, None, "joint_limit")
    assert far.worst_pose == {"pose.z": 9.0}
    assert "there is no result at z 9 m (joint limit)" in far.sentence(machine.display).replace("9000 mm", "9 m")


def test_requirements_are_kept_changed_and_carried_along(tmp_path):
    assert build(as_toml(MACHINE)).requirements == MACHINE.requirements
    assert MACHINE.with_values(x="1 mm").requirements == MACHINE.requirements
    stricter = build(bundled()["hexapod"] + TABLE, settings=["requirements.here=free_stiffness_z > 50 N/um"])
    assert stricter.requirements["here"].demand == ["free_stiffness_z > 50 N/um"]
    demanding = replace(build(bundled()["hexapod"]), requirements=MACHINE.requirements)
    saved = as_file(demanding)
    assert "# the platform point P" in saved
    assert build(saved).requirements == MACHINE.requirements
    text = bundled_studies()["zhang-gosselin-2002"] + '\n[requirements]\nstiff = "free_stiffness_z > 1 N/m"\n'
    (tmp_path / "study.toml").write_text(text, "utf-8")
    problem = load_problem(tmp_path / "study.toml")
    assert [verdict.name for verdict in requirements(problem.machine)] == ["stiff"]
    assert read_study(parse(study_toml(problem.study), "again"), "again") == problem.study


def test_commands_say_it_and_end_with_1(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    path.write_text(WITHOUT_LIMITS + TABLE, "utf-8")
    assert main(["analyze", str(path)]) == NO_ANSWER
    printed = " ".join(capsys.readouterr().out.split())
    assert "2 of 4 requirements are not met." in printed
    assert printed.index("not met list:") < printed.index("met here:"), "what is wrong comes first"
    assert main(["analyze", str(path), "--json"]) == NO_ANSWER
    judged = json.loads(capsys.readouterr().out)["requirements"]
    assert [verdict["met"] for verdict in judged] == [True, False, True, False]
    assert judged[1]["worst_pose"].keys() == {"pose.x", "pose.z"}
    changes = ["--set", "requirements.box=free_stiffness_x > 20 N/um", "--set", "requirements.list=mass < 1 kg"]
    assert main(["check", str(path), *changes[:2], "--set", "requirements.list=singularity_margin > 0.1"]) == DONE
    assert "All requirements are met." in capsys.readouterr().out
    assert main(["check", str(path), *changes]) == BAD_INPUT
    assert 'requirements.list: "mass" is not known' in capsys.readouterr().err


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("a = 3", "requirements.a is wrong in 3; write NAME ="),
        ('a = { over = ["x=0:1:2"] }', r"requirements\.a\.demand is wrong in .*; write NAME ="),
        ('a = "free_stiffness_z"', r'requirements\.a: "free_stiffness_z" is not a condition'),
        ('a = "free_stiffness_q > 3"', "did you mean free_stiffness"),
        ('a = "free_stiffness_z > 3 kg"', '"kg" is not a unit of linear stiffness'),
        ('a = { demand = "free_stiffness_z > 3", over = ["q=1:2:3"] }', r'requirements\.a: "q" is not a field'),
        ('a = { demand = "free_stiffness_z > 3", poses = [{ x = "1 kg" }] }', r"poses\.0\.x is .*not a unit of length"),
        ('a = { demand = "free_stiffness_z > 3", poses = [{ x = 0, "pose.x" = 1 }] }', r"poses\.0 gives pose\.x twice"),
        ('a = { demand = "free_stiffness_z > 3", over = ["x=0:1:2"], poses = [{ x = 0 }] }', "both over and poses"),
    ],
)
def test_a_mistake_names_the_requirement(table, message):
    with refused(message):
        requirements(build(f"{bundled()['hexapod']}[requirements]\n{table}"))


def test_a_name_has_no_requirements():
    with refused('machine is "hexapod"'):
        requirements("hexapod")
