"""Grids larger than memory: killed anywhere and resumed, one process at a time, one study for each folder, no room."""

import json
import shutil
import subprocess
import sys
from collections import namedtuple

import numpy as np
import pytest
import xarray as xr

from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, DONE, STOPPED
from kinetostat.engine import chunks
from kinetostat.engine.batch import NATIVE_SLAB
from kinetostat.machine.loading import load
from kinetostat.studies import datasets, result_file, stored_grid
from kinetostat.studies.datasets import grid_question
from kinetostat.studies.storage import LIST
from kinetostat.studies.stored_grid import answer_into
from refusals import refused

MACHINE = "zhang-gosselin-4dof"
RANGES = ["x=-40 cm:40 cm:50", "z=40 cm:140 cm:50", "theta5=-70 deg:-50 deg:50"]
NAMES = ["compliance_x", "compliance_z"]
WORDS = ["map", MACHINE, *(word for text in RANGES for word in ("--over", text)), "--quantity", "compliance_x"]
CHUNKS = 4
IN_THIS_PROCESS = chunks.in_this_process
"""In 125 000 points, where a chunk is one slab."""


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK_NUMBERS", NATIVE_SLAB)
    monkeypatch.setattr(datasets, "IN_MEMORY", 1000)


@pytest.fixture(scope="module")
def question():
    return grid_question(load(MACHINE), RANGES, NAMES)


@pytest.fixture(scope="module")
def undisturbed(question, tmp_path_factory):
    """The folder of a study that nothing interrupted."""
    folder = tmp_path_factory.mktemp("undisturbed")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chunks, "CHUNK_NUMBERS", NATIVE_SLAB)
        found = answer_into(question, folder, "map")
    assert (found.chunks, found.computed) == (CHUNKS, CHUNKS)
    return folder


class Counted:
    """Computes in this process, and remembers what."""

    def __init__(self):
        self.numbers = []

    def __call__(self, work, numbers):
        for number, found in chunks.in_this_process(work, numbers):
            self.numbers.append(number)
            yield number, found


def history(folder):
    return [json.loads(line)["chunk"] for line in (folder / "history.jsonl").read_bytes().splitlines()]


def test_the_file_is_that_of_a_small_grid(question, undisturbed, monkeypatch):
    monkeypatch.setattr(datasets, "IN_MEMORY", 10**6)
    expected = datasets.answer(question)
    with xr.open_dataset(undisturbed / "map.nc") as found:
        xr.testing.assert_identical(found.drop_vars("status"), expected.drop_vars("status"))
        np.testing.assert_array_equal(found["status"], expected["status"])
        assert found["status"].attrs["flag_meanings"].split()[:2] == ["not_computed", "ok"]
        assert list(found["status"].attrs["flag_values"])[:2] == [-1, 0]


def test_counts_and_extremes_are_those_of_the_file(question, undisturbed):
    found = answer_into(question, undisturbed, "map").tally
    with xr.open_dataset(undisturbed / "map.nc") as dataset:
        assert found.statuses == dict(zip(*np.unique(dataset["status"], return_counts=True), strict=True))
        assert len(found.statuses) > 1
        for name in NAMES:
            assert found.extremes[name].least == dataset[name].min()
            assert found.extremes[name].largest == dataset[name].max()
            assert found.extremes[name].mean == pytest.approx(float(dataset[name].mean()), rel=1e-12)


KILLED = """
import os, signal, sys
from pathlib import Path
from kinetostat.engine import chunks
from kinetostat.machine.loading import load
from kinetostat.studies.datasets import grid_question
from kinetostat.studies.result_file import ResultFile
from kinetostat.studies.stored_grid import answer_into
from kinetostat.studies.study_folder import StudyFolder

chunks.CHUNK_NUMBERS = {slab}
left = [{done}]
write, note = ResultFile.write, StudyFolder.note

def die():
    os.kill(os.getpid(), signal.SIGKILL)

def dying_write(self, start, values, status):
    if "{where}" == "in the data" and not left[0]:
        half = len(status) // 2
        write(self, start, {{name: data[:half] for name, data in values.items()}}, status[:half])
        die()
    return write(self, start, values, status)

def dying_note(self, record):
    if not left[0]:
        if "{where}" == "in the note":
            self._history.write(b'{{"chunk": 3, "sta')
            self._history.flush()
        die()
    left[0] -= 1
    note(self, record)

ResultFile.write, StudyFolder.note = dying_write, dying_note
answer_into(grid_question(load("{machine}"), {ranges}, {names}), Path(sys.argv[1]), "map")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
@pytest.mark.parametrize("where", ["in the data", "before the note", "in the note"])
@pytest.mark.parametrize("done", [0, 2])
def test_after_kill_9_only_what_is_missing_is_computed(where, done, question, undisturbed, tmp_path, monkeypatch):
    code = KILLED.format(slab=NATIVE_SLAB, done=done, where=where, machine=MACHINE, ranges=RANGES, names=NAMES)
    killed = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True)
    assert killed.returncode == -9, killed.stderr
    assert not (tmp_path / "map.nc").exists()
    with xr.open_dataset(tmp_path / "map.partial.nc") as partial:
        known = partial["status"].values.ravel() != -1
    assert known[: done * NATIVE_SLAB].all()
    assert not known[(done + 1) * NATIVE_SLAB :].any()

    monkeypatch.setattr(chunks, "CHUNK_NUMBERS", 4 * NATIVE_SLAB)  # a study keeps the chunks it began with
    counted = Counted()
    found = answer_into(question, tmp_path, "map", compute=counted, resume=True)
    assert counted.numbers == list(range(done, CHUNKS))
    assert found.computed == CHUNKS - done
    assert history(tmp_path) == list(range(CHUNKS))
    assert_same_study(tmp_path, undisturbed)


def assert_same_study(folder, other):
    for name in ("map.nc", "study.json", "study-copy.json", "history.jsonl"):
        assert (folder / name).read_bytes() == (other / name).read_bytes(), name
    mine, others = ({path.name for path in place.iterdir()} - {LIST} for place in (folder, other))
    assert mine == others


def test_a_study_killed_while_its_file_is_made_begins_again(question, undisturbed, tmp_path):
    (tmp_path / "map.partial.nc").write_bytes(b"\x89HDF half a fi")
    (tmp_path / "history.jsonl").write_bytes(b"")
    answer_into(question, tmp_path, "map")
    assert_same_study(tmp_path, undisturbed)


def interrupted(work, numbers):
    """Ctrl-C while the third chunk is computed."""
    yield from IN_THIS_PROCESS(work, numbers[:2])
    raise KeyboardInterrupt


def test_ctrl_c_keeps_what_was_computed_and_the_same_command_goes_on(tmp_path, monkeypatch, capsys):
    command = [*WORDS, "-o", str(tmp_path / "study")]
    with monkeypatch.context() as patch:
        patch.setattr(chunks, "in_this_process", interrupted)
        assert main(command) == STOPPED
    assert "same command continues" in capsys.readouterr().err
    assert history(tmp_path / "study") == [0, 1]
    assert main(command) == DONE
    out = capsys.readouterr().out
    assert "2 of 4 chunks had been computed before" in out
    assert "out of reach" in out
    assert main([*command, "--resume", "--json"]) == DONE
    summary = json.loads(capsys.readouterr().out)
    assert summary["points"] == 125_000 == sum(summary["status"].values())
    assert summary["variables"]["compliance_x"]["least"] > 0
    assert history(tmp_path / "study") == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        (["--set", "geometry.base_radius=26 cm"], "machine"),
        (["--quantity", "compliance_y"], "quantities"),
        (["--over", "theta6=110 deg:130 deg:2"], "axes"),
    ],
)
def test_a_folder_with_another_study_is_refused(changed, named, undisturbed, tmp_path, capsys):
    folder = shutil.copytree(undisturbed, tmp_path / "study")
    command = [*WORDS, "--quantity", "compliance_z", "-o", str(folder)]
    assert main(command) == DONE
    capsys.readouterr()
    assert main([*command, *changed]) == BAD_INPUT
    error = capsys.readouterr().err
    assert f"another study (different: {named})" in error
    assert "choose another folder" in error
    assert_same_study(folder, undisturbed)


def test_a_small_grid_does_not_take_the_place_of_a_large_one(undisturbed, monkeypatch, capsys):
    monkeypatch.setattr(datasets, "IN_MEMORY", 10**6)
    assert main([*WORDS, "-o", str(undisturbed)]) == BAD_INPUT
    assert "study of a larger grid" in capsys.readouterr().err


def test_a_large_grid_does_not_take_the_place_of_a_small_one(question, tmp_path):
    (tmp_path / "map.nc").write_text("precious")
    with refused(r"map\.nc\" exists already"):
        answer_into(question, tmp_path, "map")
    assert (tmp_path / "map.nc").read_text() == "precious"


HOLDING = """
import sys
from pathlib import Path
from kinetostat.studies.study_folder import study_folder
with study_folder(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_two_processes_do_not_share_a_folder_and_a_dead_one_leaves_no_lock(question, undisturbed, tmp_path):
    command = [sys.executable, "-c", HOLDING, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout.readline() == "held\n"
        with refused("another kinetostat is at work"):
            answer_into(question, tmp_path, "map")
        other.kill()
    answer_into(question, tmp_path, "map")
    assert_same_study(tmp_path, undisturbed)


def test_nothing_to_resume_is_said(tmp_path, monkeypatch, capsys):
    assert main([*WORDS, "-o", str(tmp_path / "typo"), "--resume"]) == BAD_INPUT
    assert "does not hold a study that could be resumed" in capsys.readouterr().err
    assert not (tmp_path / "typo").exists()
    monkeypatch.setattr(datasets, "IN_MEMORY", 10**6)
    assert main([*WORDS, "-o", str(tmp_path), "--resume"]) == BAD_INPUT
    assert "cannot be resumed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("lost", "message"),
    [(["map.nc"], "was removed from its study"), (["study.json", "study-copy.json"], "exists already")],
)
def test_a_folder_that_lost_a_file_is_refused(lost, message, question, undisturbed, tmp_path):
    folder = shutil.copytree(undisturbed, tmp_path / "study")
    for name in lost:
        (folder / name).unlink()
    with refused(message):
        answer_into(question, folder, "map")


def test_a_study_that_cannot_be_read_is_refused(question, undisturbed, tmp_path):
    folder = shutil.copytree(undisturbed, tmp_path / "study")
    for name in ("study.json", "study-copy.json"):
        (folder / name).write_text("{")
    with refused(r"study\.json. is damaged and cannot be read"):
        answer_into(question, folder, "map")


Usage = namedtuple("Usage", "total used free")


def test_a_full_disk_is_seen_before_anything_is_made(question, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _place: Usage(10**12, 10**12, 10**6))
    with refused(r"room for 0\.0 GB, but 125,000 points of 2 quantities"):
        answer_into(question, tmp_path / "a" / "b", "map")
    assert not (tmp_path / "a").exists()


def test_a_disk_that_fills_up_is_said_and_nothing_is_lost(question, undisturbed, tmp_path, monkeypatch):
    settle, calls = result_file.settle, iter(range(100))

    def failing(stream):
        if next(calls) == 2:
            raise OSError(28, "No space left on device")
        settle(stream)

    monkeypatch.setattr(result_file, "settle", failing)
    with refused(r"the disk is full; .*; what was written"):
        answer_into(question, tmp_path, "map")
    monkeypatch.setattr(result_file, "settle", settle)
    assert history(tmp_path) == [0]
    answer_into(question, tmp_path, "map")
    assert_same_study(tmp_path, undisturbed)


def test_the_size_of_a_grid_is_bounded(question, tmp_path, monkeypatch):
    monkeypatch.setattr(stored_grid, "MOST_NUMBERS", 249_999)
    with refused("250,000 numbers; at most 249,999"):
        answer_into(question, tmp_path, "map")


def test_a_large_grid_wants_a_folder(capsys):
    assert main(WORDS) == BAD_INPUT
    assert "give -o FOLDER" in capsys.readouterr().err


def test_a_large_map_of_two_dimensions_is_drawn_thinned(tmp_path, capsys):
    command = ["map", MACHINE, "--over", "x=0:1 cm:900", "--over", "z=66 cm:70 cm:3", "--quantity", "compliance_x"]
    assert main([*command, "-o", str(tmp_path), "--formats", "png,svg"]) == DONE
    assert "map.png" in capsys.readouterr().out
    assert "thinned" in (tmp_path / "map.svg").read_text("utf-8")
    with xr.open_dataset(tmp_path / "map.nc") as whole:
        shown = result_file.thinned_dataset(tmp_path / "map.nc")
        assert dict(shown.sizes) == {"x": 300, "z": 3}
        xr.testing.assert_identical(shown, whole.isel({"x": slice(None, None, 3)}).load())


def test_six_dimensions_are_answered_and_seven_refused(capsys):
    axes = ["x=0:1 cm:2", "z=66 cm:70 cm:2", "theta5=-60 deg:-50 deg:2", "theta6=110 deg:120 deg:2",
            "base_radius=20 cm:22 cm:2", "platform_radius=10 cm:12 cm:2", "base_angle=20 deg:30 deg:2"]  # fmt: skip
    words = [[word for text in axes[:n] for word in ("--over", text)] for n in (6, 7)]
    assert main(["map", MACHINE, *words[0], "--json"]) == DONE
    assert len(json.loads(capsys.readouterr().out)["coordinates"]) == 6
    assert main(["map", MACHINE, *words[1], "--json"]) == BAD_INPUT
    assert "7 dimensions; at most 6" in capsys.readouterr().err
