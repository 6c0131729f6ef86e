"""`kinetostat optimize` and `pareto`: what they print and write, searches killed and resumed, impossible designs."""

import json
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, DONE, NO_ANSWER
from kinetostat.machine.loading import load
from kinetostat.studies.analysis import analyze
from kinetostat.studies.optimisation.assessment import Assessor, DesignVerdict
from kinetostat.studies.optimisation.log import front_of
from kinetostat.studies.optimisation.search import optimize, search, search_into
from kinetostat.studies.study_folder import study_folder
from refusals import refused
from studies import PAPER, SMALL, best, problem, written

QUICK = ["--set", "optimizer.population=12", "--set", "optimizer.generations=8"]


def run(capsys, *words):
    code = main([*words, "--json"])
    return code, json.loads(capsys.readouterr().out)


def test_json_is_all_of_stdout_and_says_what_was_found(capsys):
    code, found = run(capsys, "optimize", PAPER, "--set", "optimizer.seed=3")
    assert code == DONE
    assert found["objective"] <= 1.0178895
    assert found["status"] == "ok"
    assert found["evaluations"] == 8000
    assert found["initial"]["objectives"]["compliance_sum"] == pytest.approx(2.840848, abs=5e-7)
    assert found["variables"]["geometry.base_radius"] == pytest.approx(0.26)
    assert found["at_bounds"]["pose.z"] == "lower"
    assert found["convergence"]["best"][-1] == found["objective"]
    assert found["convergence"]["mean"][59] == pytest.approx(1.0179, abs=1e-4), "converged after around 60 generations"
    assert found["ridges"][0]["variables"] == ["geometry.passive_links.0", "geometry.passive_links.1"]


def test_a_seed_gives_the_same_run_and_another_seed_another():
    one, again, other = (search(Assessor(problem(PAPER, f"optimizer.seed={s}", *QUICK[1::2]))) for s in (4, 4, 5))
    np.testing.assert_array_equal(one.rows, again.rows)
    assert (one.rows != other.rows).any()


def test_a_folder_gets_everything_a_designer_needs(tmp_path, capsys):
    folder = tmp_path / "new"
    tolerance = ["--set", 'variables.0.tolerance="0.1 mm"']
    assert main(["optimize", PAPER, *QUICK, *tolerance, "-o", str(folder)]) == DONE
    printed = capsys.readouterr().out
    assert "geometry.platform_radius" in printed
    assert "times stiffer" in printed
    assert "Under the tolerances" in printed
    figures = {f"{name}.{kind}" for name in ("comparison", "convergence", "tolerances") for kind in ("png",)}
    written_files = {path.name for path in folder.iterdir()}
    assert written_files == figures | {
        "best.toml", "result.json", "designs.nc", "designs.bin", "study.json", "study-copy.json", "history.jsonl",
        "kinetostat.sha256",
    }  # fmt: skip
    told = json.loads((folder / "result.json").read_text("utf-8"))
    better = analyze(load(folder / "best.toml"))
    assert sum(better.compliance_diagonal) == pytest.approx(told["objective"])
    scatter = told["robustness"]["objectives"]["compliance_sum"]
    assert scatter["nominal"] == pytest.approx(told["objective"])
    assert scatter["percentile_95"] <= scatter["worst"]
    with xr.open_dataset(folder / "designs.nc") as table:
        assert table.sizes["design"] == 96
        assert table["geometry.base_radius"].attrs["units"] == "m"
        assert float(table["objective_0"].min()) == told["objective"]
        assert (table["verdict"] == DesignVerdict.FEASIBLE).all()


def test_two_objectives_give_a_front_with_its_knee(tmp_path, capsys):
    words = ["pareto", "zhang-gosselin-front", *QUICK, "-o", str(tmp_path)]
    code, found = run(capsys, *words)
    assert code == DONE
    assert sum(design["knee"] for design in found["front"]) == 1
    values = np.array([list(design["objectives"].values()) for design in found["front"]])
    assert (np.diff(values[:, 0]) > 0).all()
    assert (np.diff(values[:, 1]) < 0).all(), "who wins in one loses in the other"
    assert (tmp_path / "front.png").exists()
    code, again = run(capsys, "pareto", str(tmp_path))
    assert again == found, "a folder can be asked again"
    assert main(["pareto", PAPER]) == BAD_INPUT
    assert "two objectives" in capsys.readouterr().err


KILLED = """
import os, signal, sys
from pathlib import Path
from kinetostat.studies.optimisation.assessment import Assessor
from kinetostat.studies.optimisation.problem import load_problem
from kinetostat.studies.optimisation.log import RowFile, front_of
from kinetostat.studies.optimisation.search import search_into
from kinetostat.studies.study_folder import StudyFolder

left = [{done}]
write, note = RowFile.write, StudyFolder.note

def die():
    os.kill(os.getpid(), signal.SIGKILL)

def dying_write(self, start, rows):
    if "{where}" == "in the rows" and not left[0]:
        write(self, start, rows[: len(rows) // 2])
        die()
    return write(self, start, rows)

def dying_note(self, record):
    if not left[0]:
        if "{where}" == "in the note":
            self._history.write(b'{{"chunk": 3, "ke')
            self._history.flush()
        die()
    left[0] -= 1
    note(self, record)

RowFile.write, StudyFolder.note = dying_write, dying_note
search_into(Assessor(load_problem("{study}", {settings})), Path(sys.argv[1]))
"""
STUDIES = {PAPER: ["optimizer.method=hybrid", *QUICK[1::2]], "zhang-gosselin-front": QUICK[1::2]}


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
@pytest.mark.parametrize(
    ("study", "where", "done"),
    [
        (PAPER, "in the rows", 0),
        ("zhang-gosselin-front", "before the note", 3),
        (PAPER, "in the rows", 8),
        ("zhang-gosselin-front", "in the note", 4),
    ],
)
def test_after_kill_9_it_ends_as_if_nothing_had_happened(study, where, done, tmp_path):
    code = KILLED.format(done=done, where=where, study=study, settings=STUDIES[study])
    killed = subprocess.run([sys.executable, "-c", code, str(tmp_path / "killed")], capture_output=True)
    assert killed.returncode == -9, killed.stderr
    steps = []
    log = search_into(
        Assessor(problem(study, *STUDIES[study])),
        tmp_path / "killed",
        lambda number, *_: steps.append(number),
        resume=True,
    )
    assert steps[0] == done + 1, "it goes on from the last whole step"
    whole = search_into(Assessor(problem(study, *STUDIES[study])), tmp_path / "whole")
    np.testing.assert_array_equal(log.rows, whole.rows)
    assert log.steps == whole.steps
    for name in ("designs.bin", "study.json", "history.jsonl"):
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_two_processes_are_not_at_work_in_one_folder(tmp_path, capsys):
    with study_folder(tmp_path):
        assert main(["optimize", PAPER, *QUICK, "-o", str(tmp_path)]) == BAD_INPUT
    assert "another kinetostat is at work" in capsys.readouterr().err


def test_a_folder_holds_one_study(tmp_path, capsys):
    assert main(["optimize", PAPER, *QUICK, "-o", str(tmp_path), "--resume"]) == BAD_INPUT
    assert "does not hold a study that could be resumed" in capsys.readouterr().err
    assert main(["optimize", PAPER, *QUICK, "-o", str(tmp_path)]) == DONE
    capsys.readouterr()
    assert main(["optimize", PAPER, *QUICK, "--set", "optimizer.seed=2", "-o", str(tmp_path)]) == BAD_INPUT
    assert "another study" in capsys.readouterr().err
    assert main(["optimize", str(tmp_path), "--json"]) == DONE
    assert main(["optimize", str(tmp_path), "--set", "optimizer.seed=2"]) == BAD_INPUT
    (tmp_path / "designs.bin").write_bytes(b"")
    capsys.readouterr()
    assert main(["optimize", str(tmp_path)]) == DONE
    assert "had been damaged; computed again: 8 of 8 steps" in capsys.readouterr().err


MOSTLY_IMPOSSIBLE = (
    'variables.2.from="10 cm"',
    'variables.2.to="60 cm"',
    'variables.3.from="10 cm"',
    'variables.3.to="60 cm"',
    'constraints=[{quantity="singularity_margin", at_least=0.2}]',
)


@pytest.mark.parametrize("method", ["genetic", "gradient", "hybrid"])
def test_designs_that_cannot_be_never_win_and_are_counted(method, capsys):
    """The links are mostly too short to reach the pose: what is left must win, whatever the method."""
    settings = [word for text in (*MOSTLY_IMPOSSIBLE, f"optimizer.method={method}") for word in ("--set", text)]
    code, found = run(capsys, "optimize", PAPER, *settings)
    assert code == DONE
    assert found["infeasible"]["out_of_reach"] > 0
    assert found["verdict"] == "feasible"
    assert sum(found["infeasible"].values()) < found["evaluations"]
    lengths = found["variables"]["geometry.passive_links.0"] + found["variables"]["geometry.passive_links.1"]
    assert lengths >= 0.66, "they reach the platform"
    assert found["constraints"]["singularity_margin >= 0.2"] >= 0.2 - 1e-6


def test_where_nothing_is_possible_there_is_no_answer(capsys):
    links = [f'variables.{k}.{end}="{value} cm"' for k in (2, 3) for end, value in (("from", 10), ("to", 20))]
    settings = [word for text in (*links, *QUICK[1::2]) for word in ("--set", text)]
    code, found = run(capsys, "optimize", PAPER, *settings)
    assert code == NO_ANSWER
    assert found["status"] == "infeasible"
    assert found["objective"] is None
    assert found["infeasible"] == {"out_of_reach": 96}
    assert main(["optimize", PAPER, *settings]) == NO_ANSWER
    assert "No feasible design was found: 96 x out of reach" in capsys.readouterr().err


def test_an_infinite_objective_is_not_feasible(capsys):
    """With a rigid link K is infinite in the direction it holds, for every design."""
    settings = ["--set", "objectives.0.quantity=stiffness_sum", "--set", 'set.stiffness.passive_links="rigid"']
    code, found = run(capsys, "optimize", PAPER, *QUICK, *settings)
    assert code == NO_ANSWER
    assert found["infeasible"] == {"not_finite": 96}


def test_tied_and_fixed_variables():
    tied = SMALL.replace(
        'path = "platform_radius"', 'paths = ["geometry.passive_links.0", "geometry.passive_links.1"]\nratios = [1, 2]'
    )
    settings = ('variables.0.from="30 cm"', 'variables.0.to="40 cm"', "variables.1.fixed=true")
    study = written(tied, *settings)
    log = search(Assessor(study))
    columns = study.space.columns(log.genes(log.survivors[:1]))
    assert columns["geometry.passive_links.1"] == pytest.approx(2.0 * columns["geometry.passive_links.0"])
    assert columns["geometry.base_radius"] == 0.22
    assert study.space.size == 1


def test_a_workspace_that_designs_must_reach():
    """The volume that a longer leg reaches is larger; poses that are not reached do not make a design infeasible."""
    text = SMALL.replace("compliance_sum", "workspace_volume") + (
        '[poses]\nover = ["x=-40 cm:40 cm:21", "z=40 cm:120 cm:21"]\nrequired = 0.05\n'
        '[[constraints]]\nquantity = "leg_stroke"\nat_most = "2 m"\n[optimizer]\npopulation = 10\ngenerations = 4\n'
    )
    study = written(text, 'set.limits.longest_leg="90 cm"')
    log = search(Assessor(study))
    assert study.objectives[0].goal == "maximise"
    assert study.objectives[0].term.unit == "m²"
    assert 0.0 < best(log) < 0.64, "of a box of 0.8 m x 0.8 m"
    assert best(log) == log.outcome().objectives[log.outcome().violation == 0.0, 0].max()


def test_poses_of_the_workspace_alone():
    text = SMALL + '[poses]\nover = ["x=-40 cm:40 cm:9", "z=40 cm:120 cm:9"]\nwithin = "workspace"\n'
    study = written(text, 'set.limits.longest_leg="90 cm"')
    assert 0 < study.poses.count < 81
    assert (Assessor(study)(study.space.initial[None]).verdict == DesignVerdict.FEASIBLE).all()


def test_robust_objectives_are_worse_than_nominal_ones():
    settings = ('variables.0.tolerance="1 mm"', *QUICK[1::2])
    plain, robust = (Assessor(problem(PAPER, *settings, f"robustness.objective={o}")) for o in ("nominal", "worst"))
    genes = np.random.default_rng(0).random((20, 7))
    assert (robust(genes).objectives > plain(genes).objectives).all()
    np.testing.assert_array_equal(robust.nominal(genes).objectives, plain(genes).objectives)


def test_stiffness_is_bought_with_mass():
    """Every diameter of a bar is the best for some weight; weight is 2700 kg/m^3 times the volume of the bars."""
    log = search(Assessor(problem("tripteron-weight", "optimizer.population=32", "optimizer.generations=16")))
    front = front_of(log)
    genes, objectives = log.genes(front), log.outcome(front).objectives
    assert (genes[:, 1] == 1.0).all(), "the stiffer drive always"
    diameter = log.problem.space.values(genes)[:, 0]
    np.testing.assert_allclose(objectives[:, 0] / diameter**2, objectives[0, 0] / diameter[0] ** 2, rtol=1e-9)
    with refused("is not known"):
        written(SMALL, "objectives.0.quantity=mass")


def test_a_search_without_a_folder_stops_after_the_step_when_it_is_told_to():
    study = written(SMALL + "[optimizer]\npopulation = 10\ngenerations = 4\n")
    steps = []
    optimize(study, watch=lambda done, *_: steps.append(done), stop=lambda: len(steps) == 2)
    assert steps == [1, 2]
