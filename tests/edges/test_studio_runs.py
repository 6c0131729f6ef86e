"""Searches of the studio apart from any page: started, followed, stopped, resumed, kept; and favourites."""

import json
import shutil
import subprocess
import sys
from dataclasses import replace

import pytest

from kinetostat.cli import main
from kinetostat.commands.common import DONE
from kinetostat.machine.loading import as_toml, load
from kinetostat.machine.parameters import values
from kinetostat.machine.saving import as_file
from kinetostat.studies.study_folder import COPY, HISTORY, QUESTION, study_folder
from kinetostat.studio.controls import controls
from kinetostat.studio.design.draft import Draft, bundled_draft, sent_draft, usual_bounds
from kinetostat.studio.design.progress import Follower, SearchState, failure
from kinetostat.studio.design.run_panel import convergence
from kinetostat.studio.design.runs import MOST_RUNNING, UNREADABLE, Run, Runs, Stage
from kinetostat.studio.design.state_folder import Favourites
from kinetostat.studio.design.texts import result_text
from refusals import refused
from studies import PAPER, SMALL, problem, waited_for, written

QUICK = ("optimizer.population=8", "optimizer.generations=4")
LONG = ("optimizer.population=8", "optimizer.generations=100000")
MACHINE = "zhang-gosselin-4dof"


@pytest.fixture
def runs(tmp_path):
    found = Runs(tmp_path)
    yield found
    found.close()
    for run in found.entries():
        found.wait(run.number)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A state folder with one search that is done."""
    state = tmp_path_factory.mktemp("state")
    there = Runs(state)
    there.start(written(SMALL, *QUICK))
    there.wait(1)
    there.close()
    return state


@pytest.fixture
def kept(finished, tmp_path):
    """The same, to be changed: its searches, and the first of them."""
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    there = Runs(tmp_path)
    yield there, there.entry(1)
    there.close()


def test_plots_and_tables_of_a_search_have_the_units_of_the_machine(tmp_path):
    text = (
        SMALL.replace(MACHINE, "hexapod").replace("sum", "z")
        + '[[constraints]]\nquantity = "compliance_x"\nat_most = 1e-6\n'
    )
    study = written(text)
    run = Run(1, tmp_path, "small", Stage.DONE)
    progress = SearchState(run, study, 2, 2, 16, [None, 2e-8], [3e-8, 2.5e-8], [[2e-8]])
    curve = convergence(progress)
    assert curve["label"]["y"] == "compliance z (µm/N)"
    assert curve["lines"][0]["values"] == [None, pytest.approx(0.02)]
    assert "0.02 µm/N" in result_text(progress)
    worth = {"objectives": {"compliance_z": 2e-8}, "constraints": {"compliance_x <= 1e-06 m/N": 5e-7}}
    result = {
        "status": "ok", "message": "", "objective": 2e-8, "variables": {}, "at_bounds": {}, "sensitivity": {},
        "directions": [], "poses": {"count": 1}, "robustness": None, "front": None, "ridges_text": [],
        "initial": worth, **worth,
    }  # fmt: skip
    shown = result_text(replace(progress, result=result))
    assert "compliance z (µm/N)" in shown
    assert "compliance x &lt;= 1 µm/N" in shown
    assert "0.5 µm/N" in shown


def followed(runs, number):
    run = runs.entry(number)
    return Follower(run).progress(run)


def until_begun(runs, number):
    """Until a search has made a step, which takes as long as its process needs to start."""
    run = runs.entry(number)
    follower = Follower(run)
    waited_for(lambda: follower.progress(run).steps, run.folder)


def test_a_search_ends_as_the_command_does(runs, capsys, tmp_path):
    file = tmp_path / "small.toml"
    file.write_text(SMALL)
    run = runs.start(problem(str(file), *QUICK))
    assert run.stage is Stage.RUNNING
    runs.wait(run.number)
    found = followed(runs, run.number)
    assert found.run.stage is Stage.DONE
    assert (found.steps, found.total, found.designs) == (4, 4, 32)
    words = [word for setting in QUICK for word in ("--set", setting)]
    assert main(["optimize", str(file), "--json", *words]) == DONE
    told = json.loads(capsys.readouterr().out)
    assert found.result == told
    assert found.best == told["convergence"]["best"]
    assert found.mean == told["convergence"]["mean"]
    assert found.objectives == [[told["objective"]]]
    assert as_file(found.design(0)) == (run.folder / "best.toml").read_text("utf-8")


@pytest.mark.parametrize("damage", ["history", "question", "folder"])
def test_a_damaged_search_does_not_hide_the_others(kept, tmp_path, damage):
    there, sound = kept
    folder = tmp_path / "runs" / "0002-damaged"
    shutil.copytree(sound.folder, folder)
    if damage == "history":
        (folder / HISTORY).write_bytes(b'{"step": 1\n\xff}\n')
    elif damage == "question":
        for name in (QUESTION, COPY):
            (folder / name).write_text('["neither", "machine", "nor", "study"]')
    else:
        (folder / HISTORY).unlink()
        (folder / HISTORY).mkdir()
    assert [run.number for run in there.entries()] == [2, 1]
    assert there.entries()[1].stage is Stage.DONE
    if damage == "history":
        assert followed(there, 2).best == [], "lines that cannot be read are left out"
    else:
        with pytest.raises(UNREADABLE):
            followed(there, 2)
    there.delete(2) if not there.entry(2).stage.active else shutil.rmtree(folder)
    assert [run.number for run in there.entries()] == [1]


def test_a_front_is_known_while_it_grows_and_ends_as_the_command_says(runs):
    run = runs.start(problem("zhang-gosselin-front", *QUICK))
    runs.wait(run.number)
    found = followed(runs, run.number)
    front = found.result["front"]
    assert found.objectives == [list(row["objectives"].values()) for row in front]
    assert front[found.knee]["knee"]
    assert not found.best


def test_stopped_after_a_step_it_goes_on_to_the_same_end(runs, tmp_path):
    run = runs.start(written(SMALL, *LONG))
    until_begun(runs, run.number)
    runs.stop(run.number)
    assert runs.entry(run.number).stage in (Stage.STOPPING, Stage.STOPPED)
    runs.wait(run.number)
    found = followed(runs, run.number)
    assert found.run.stage is Stage.STOPPED
    assert found.result["objective"] == found.best[-1]
    again = Runs(tmp_path)
    again.resume(run.number)
    assert again.entry(run.number).stage is Stage.RUNNING
    with refused("only a search that was stopped can be resumed"):
        again.resume(run.number)
    follower = Follower(run)
    waited_for(lambda: follower.progress(run).steps > found.steps, run.folder)
    again.close()
    again.wait(run.number)
    assert followed(again, run.number).best[: found.steps] == found.best


def test_when_the_server_is_killed_the_search_stops_and_is_kept(tmp_path):
    code = (
        "import sys; from pathlib import Path; from kinetostat.studio.design.runs import Runs\n"
        "from kinetostat.studies.optimisation.problem import load_problem\n"
        f"Runs(Path(sys.argv[1])).start(load_problem({PAPER!r}, {LONG!r}))\n"
        "print('started', flush=True); sys.stdin.read()"
    )
    server = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert server.stdout.readline().strip() == b"started"
    runs = Runs(tmp_path)
    until_begun(runs, 1)
    assert runs.entry(1).stage is Stage.RUNNING
    with refused("started by another studio"):
        runs.stop(1)
    server.kill()
    server.communicate()
    waited_for(lambda: not runs.entry(1).stage.active, tmp_path)
    (run,) = runs.entries()
    assert (run.stage, run.name) == (Stage.STOPPED, "Zhang & Gosselin, section 4.3")
    assert followed(runs, 1).steps


def test_only_so_many_at_a_time(runs):
    for _ in range(MOST_RUNNING):
        runs.start(written(SMALL, *LONG))
    with refused(r"searches 2 .* and 1 .* are running; wait"):
        runs.start(written(SMALL, *QUICK))
    with refused("stop it before"):
        runs.delete(1)


def test_a_tab_has_one_search_at_a_time_and_leaves_the_other_place_to_others(runs):
    runs.start(written(SMALL, *LONG), "tab")
    with refused(r"search 1 .* of this tab is running; a tab has one search at a time"):
        runs.start(written(SMALL, *QUICK), "tab")
    assert runs.start(written(SMALL, *QUICK), "another tab").number == 2


def test_a_search_that_is_deleted_is_gone(kept):
    runs, run = kept
    runs.delete(run.number)
    assert not runs.entries()
    assert not run.folder.exists()
    with refused("has been deleted"):
        runs.entry(run.number)


def test_a_search_in_the_folder_of_a_deleted_one_has_its_own_name(kept):
    runs, former = kept
    runs.delete(former.number)
    run = runs.start(written(SMALL.replace(f'"{former.name}"', f'"{former.name.upper()}!"'), *QUICK))
    runs.wait(run.number)
    assert (run.folder, run.name) == (former.folder, f"{former.name.upper()}!")


def test_a_search_that_fails_says_why(kept):
    runs, run = kept
    for name in (QUESTION, COPY):
        question = run.folder / name
        question.write_text(question.read_text("utf-8").replace('"compliance_sum"', '"nonsense"'), "utf-8")
    (run.folder / "result.json").unlink()
    runs.resume(run.number)
    runs.wait(run.number)
    found = runs.entry(run.number)
    assert found.stage is Stage.FAILED
    assert "is damaged and cannot be read" in failure(found)


def test_a_search_of_another_process_is_seen_to_run(kept):
    runs, run = kept
    assert run.stage is Stage.DONE
    with study_folder(run.folder):
        assert runs.entry(run.number).stage is Stage.RUNNING


def test_a_draft_is_read_as_a_study_file_is():
    machine = load(MACHINE)
    draft = Draft("mine")
    with refused("no variable yet"):
        draft.problem(machine)
    control = {one.path: one for one in controls(machine, 0.2)}["geometry.base_radius"]
    low, high = usual_bounds(control, 0.22)
    assert (low, high) == ("176 mm", "264 mm")
    draft.variables.append({"path": control.path, "from": low, "to": high})
    draft.optimizer["population"] = "many"
    with refused(r"optimizer.population is \"many\""):
        draft.problem(machine)
    draft.optimizer["population"] = 8
    assert draft.problem(machine).space.searched_variables[0].high == pytest.approx(0.264)


def test_a_saved_study_solves_the_same_problem(tmp_path):
    draft = bundled_draft(PAPER)
    name, content = draft.as_file(load("hexapod"))
    assert name == "zhang-gosselin-section-4-3.toml"
    file = tmp_path / name
    file.write_bytes(content)
    there, here = problem(str(file)), problem(PAPER)
    assert as_toml(there.machine) == as_toml(here.machine)
    assert there.space == here.space


def test_a_study_about_a_machine_of_ones_own_says_how_to_save_it(tmp_path):
    machine = load(MACHINE)
    own = load(MACHINE, ["name=Mine"])
    draft = Draft("d", variables=[{"path": "geometry.base_radius", "from": 0.2, "to": 0.3}])
    name, content = draft.as_file(own)
    assert b"# Save the machine beside this file, as mine.toml." in content
    (tmp_path / name).write_bytes(content)
    (tmp_path / "mine.toml").write_text(as_toml(own))
    assert problem(str(tmp_path / name)).machine == own
    assert machine != own


def test_a_sent_study_never_reads_files_of_the_server(tmp_path):
    """Its machine is a bundled one or the one at hand, whatever path it names."""
    secret = tmp_path / "secret.toml"
    secret.write_text("schema = ")
    text = f'schema = 1\nname = "x"\nmachine = "{secret.as_posix()}"\n[set]\npose.z = "70 cm"\n'
    text += '[[variables]]\npath = "base_radius"\nfrom = "20 cm"\nto = "26 cm"\n[[objectives]]\nquantity = "mass"\n'
    with refused("weighs"):
        sent_draft(text.encode(), "x.toml", load(MACHINE))
    found = sent_draft(text.replace("mass", "frobenius_condition").encode(), "x.toml", load(MACHINE))
    assert found.machine.tables["pose"].z == pytest.approx(0.7)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"x" * ((1 << 20) + 1), "larger than 1 MiB"),
        (b"\xff", "not text"),
        (b"name = ", "not valid TOML"),
        (b"schema = 1", "variables is missing"),
    ],
)
def test_bad_studies_are_refused(content, words):
    with refused(words):
        sent_draft(content, "x.toml", load(MACHINE))


def test_favourites_are_machine_files_with_a_note(tmp_path):
    kept = Favourites(tmp_path)
    assert not kept.entries()
    machine = load("tripteron")
    one = kept.keep(machine, 'stiff "one"', "first\nnote")
    kept.keep(machine, "another")
    assert [(one.name, one.note) for one in Favourites(tmp_path).entries()] == [
        ("another", ""),
        ('stiff "one"', "first note"),
    ]
    again = one.machine()
    assert again.name == 'stiff "one"'
    assert values(again) == values(machine)
    kept.delete(one.number)
    assert [f.name for f in kept.entries()] == ["another"]
    with refused("1 to 80"):
        kept.keep(machine, " ")
