"""Folders of long studies in which something was damaged: it is seen, said, and computed again to the same bits."""

import json
import shutil

import pytest

from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, DONE, NO_ANSWER
from kinetostat.engine import chunks
from kinetostat.engine.batch import NATIVE_SLAB
from kinetostat.spec.errors import InputError
from kinetostat.studies import datasets
from kinetostat.studies.storage import LIST
from kinetostat.studies.study_folder import read_history, read_question, study_folder
from refusals import refused
from studies import SMALL

GRID = [
    "map",
    "delta",
    "--over",
    "x=-1 cm:1 cm:200",
    "--over",
    "y=-1 cm:1 cm:200",
    "--quantity",
    "compliance_x",
    "--json",
    "-o",
]
"""Two chunks."""
FILES = {"grid": ("map.nc", "history.jsonl", "study.json"), "search": ("designs.bin", "history.jsonl", "study.json")}


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK_NUMBERS", NATIVE_SLAB)
    monkeypatch.setattr(datasets, "IN_MEMORY", 1000)
    monkeypatch.setattr("kinetostat.views.optimisation_figures.pictures", lambda *_: {})


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """A grid of two chunks and a search of six steps."""
    folder = tmp_path_factory.mktemp("undisturbed")
    (folder / "study.toml").write_text(f"{SMALL}\n[optimizer]\npopulation = 8\ngenerations = 5\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chunks, "CHUNK_NUMBERS", NATIVE_SLAB)
        patch.setattr(datasets, "IN_MEMORY", 1000)
        assert main([*GRID, str(folder / "grid")]) == DONE
        patch.setattr("kinetostat.views.optimisation_figures.pictures", lambda *_: {})
        assert main(["optimize", str(folder / "study.toml"), "-o", str(folder / "search")]) == DONE
    return folder


def again(kind, folder):
    return main([*GRID, str(folder)] if kind == "grid" else ["optimize", str(folder)])


def flipped(path, place):
    """Flip a bit in the middle, or at another share of a file."""
    data = bytearray(path.read_bytes())
    data[int(place * len(data))] ^= 1
    path.write_bytes(data)


def cut(path, place):
    path.write_bytes(path.read_bytes()[: int(place * path.stat().st_size)])


def lengthened(path, place):
    """Add a line that says nothing, at a share of the lines."""
    lines = path.read_bytes().splitlines(keepends=True)
    lines.insert(int(place * len(lines)), b"nothing\n")
    path.write_bytes(b"".join(lines))


DAMAGES = [
    ("grid", "map.nc", flipped, 0.0001),
    ("grid", "map.nc", flipped, 0.2),
    ("grid", "map.nc", flipped, 0.6),
    ("grid", "map.nc", flipped, 0.99),
    ("grid", "map.nc", cut, 0.6),
    ("grid", "map.nc", cut, 0.01),
    ("grid", "history.jsonl", flipped, 0.3),
    ("grid", "history.jsonl", flipped, 0.98),
    ("grid", "history.jsonl", lengthened, 1.0),
    ("search", "history.jsonl", lengthened, 0.4),
    ("search", "history.jsonl", lengthened, 1.0),
    ("search", "designs.bin", flipped, 0.1),
    ("search", "designs.bin", flipped, 0.5),
    ("search", "designs.bin", cut, 0.7),
    ("search", "history.jsonl", flipped, 0.02),
    ("search", "history.jsonl", flipped, 0.5),
    ("search", "history.jsonl", flipped, 0.99),
]


@pytest.mark.parametrize(("kind", "file", "damage", "place"), DAMAGES)
def test_damage_is_seen_said_and_computed_again(kind, file, damage, place, undisturbed, tmp_path, capsys):
    folder = shutil.copytree(undisturbed / kind, tmp_path / kind)
    damage(folder / file, place)
    assert main(["check", str(folder)]) == NO_ANSWER
    assert "damaged" in capsys.readouterr().err
    assert again(kind, folder) == DONE
    assert "computed again: " in capsys.readouterr().err
    for name in FILES[kind]:
        mine, whole = ((place / kind / name).read_bytes() for place in (tmp_path, undisturbed))
        assert sorted(mine.splitlines()) == sorted(whole.splitlines()) if name.endswith("l") else mine == whole, name
    assert main(["check", str(folder)]) == DONE
    assert again(kind, folder) == DONE
    assert capsys.readouterr().err == ""
    assert not list(folder.glob("*damaged*"))


@pytest.mark.parametrize("kind", FILES)
def test_what_is_whole_passes(kind, undisturbed, capsys):
    assert main(["check", str(undisturbed / kind)]) == DONE
    assert "all of them are as they were written" in capsys.readouterr().out


@pytest.mark.parametrize("kind", FILES)
@pytest.mark.parametrize("name", ["study.json", "study-copy.json"])
@pytest.mark.parametrize("damage", [flipped, cut, lambda path, _: path.unlink()], ids=["flipped", "cut", "removed"])
def test_a_damaged_question_costs_nothing(kind, name, damage, undisturbed, tmp_path, capsys, monkeypatch):
    """It is there twice: nothing is computed again, and both files are as they were."""
    folder = shutil.copytree(undisturbed / kind, tmp_path / kind)
    damage(folder / name, 0.5)
    assert main(["check", str(folder)]) == NO_ANSWER
    assert name in capsys.readouterr().err
    monkeypatch.setattr(chunks, "in_this_process", None)
    monkeypatch.setattr("kinetostat.studies.optimisation.search._take", None)
    assert again(kind, folder) == DONE
    assert name in capsys.readouterr().err
    for other in ("study.json", "study-copy.json"):
        assert (folder / other).read_bytes() == (undisturbed / kind / "study.json").read_bytes()
    assert main(["check", str(folder)]) == DONE


@pytest.mark.parametrize("kind", FILES)
@pytest.mark.parametrize("place", [0.1, 0.5, 0.95])
def test_a_question_damaged_twice_is_one_sentence(kind, place, undisturbed, tmp_path, capsys):
    folder = shutil.copytree(undisturbed / kind, tmp_path / kind)
    for name in ("study.json", "study-copy.json"):
        flipped(folder / name, place)
    for command in (lambda: again(kind, folder), lambda: main(["check", str(folder)])):
        assert command() == BAD_INPUT
        error = capsys.readouterr().err
        assert "is damaged and cannot be read; choose another folder, or remove this one" in error
        assert error.count("\n") == 1


@pytest.mark.parametrize("kind", FILES)
def test_a_folder_from_before_checksums_is_read_and_said(kind, undisturbed, tmp_path, capsys):
    folder = shutil.copytree(undisturbed / kind, tmp_path / kind)
    (folder / "study-copy.json").unlink()
    for name in ("study.json", "history.jsonl"):
        text = (folder / name).read_text()
        records = [json.loads(line) for line in ([text] if name == "study.json" else text.splitlines())]
        old = [{k: v for k, v in r.items() if k not in ("check", "checksums", "data", "layout")} for r in records]
        (folder / name).write_text("".join(f"{json.dumps(record)}\n" for record in old))
    (folder / LIST).unlink()
    assert main(["check", str(folder)]) == DONE
    assert "without checksums" in capsys.readouterr().out
    assert again(kind, folder) == DONE
    assert "without checksums" in capsys.readouterr().err


SMALL_COMMANDS = {
    "search": None,
    "grid": None,
    "map": ["map", "delta", "--over", "x=-1 cm:1 cm:5", "--over", "y=-1 cm:1 cm:5", "--json", "-o"],
    "workspace": ["workspace", "planar-3rpr", "--over", "x=-5 cm:5 cm:5", "--over", "y=-5 cm:5 cm:5", "--json", "-o"],
}
"""Commands that fill a folder; those of the first two are in `undisturbed`."""


@pytest.fixture(scope="module")
def finished(undisturbed):
    """A folder of each command."""
    for kind, command in SMALL_COMMANDS.items():
        if command:
            assert main([*command, str(undisturbed / kind)]) in (DONE, NO_ANSWER)
    return undisturbed


def once_more(kind, folder):
    return main([*SMALL_COMMANDS[kind], str(folder)]) if SMALL_COMMANDS[kind] else again(kind, folder)


@pytest.mark.parametrize("kind", SMALL_COMMANDS)
@pytest.mark.parametrize("damage", ["flipped", "cut", "removed"])
def test_no_file_of_a_finished_folder_is_damaged_unseen(kind, damage, finished, tmp_path, capsys):
    """Each file in turn; the same command then writes what it had written."""
    names = sorted(path.name for path in (finished / kind).iterdir())
    assert LIST in names
    for name in names:
        folder = shutil.copytree(finished / kind, tmp_path / name / kind)
        if damage == "removed":
            (folder / name).unlink()
        else:
            (flipped if damage == "flipped" else cut)(folder / name, 0.5)
        capsys.readouterr()
        code = main(["check", str(folder)])
        said = capsys.readouterr()
        if damage == "removed" and name == LIST:  # no other file knows of it
            assert (code, "cannot be seen" in said.out) == (DONE, True) if kind in FILES else code == BAD_INPUT
            continue
        assert code == NO_ANSWER, (name, said)
        assert name in said.err
        if (kind, name, damage) == ("grid", "map.nc", "removed"):
            assert "no longer there" in said.err
            assert "damaged or lost" not in said.err
            assert "Remove the folder" in said.err
            continue
        once_more(kind, folder)
        assert main(["check", str(folder)]) == DONE, name
        for other in names:
            if not other.endswith(("l", LIST)):
                assert (folder / other).read_bytes() == (finished / kind / other).read_bytes(), (name, other)


@pytest.mark.parametrize("kind", FILES)
@pytest.mark.parametrize("listed", [True, False])
def test_a_finished_history_that_lost_its_end_is_seen_wherever_it_ends(kind, listed, undisturbed, tmp_path, capsys):
    """Also in a folder without a list of its files: its result shows that it was finished."""
    folder = shutil.copytree(undisturbed / kind, tmp_path / kind)
    history = (folder / "history.jsonl").read_bytes()
    if not listed:
        (folder / LIST).unlink()
    ends = [i for i, byte in enumerate(history) if byte == ord("\n")]
    places = {0, 1, len(history) // 2, *(i + d for i in ends for d in (0, 1))} - {len(history)}
    for place in sorted(places):
        (folder / "history.jsonl").write_bytes(history[:place])
        if place or listed or kind == "grid":
            assert main(["check", str(folder)]) == NO_ANSWER, place
            assert "damaged or lost" in capsys.readouterr().err or not place
    assert again(kind, folder) == DONE
    assert main(["check", str(folder)]) == DONE


@pytest.mark.parametrize("kind", FILES)
def test_no_bit_of_a_line_of_the_history_is_flipped_unseen(kind, undisturbed, tmp_path):
    history = (undisturbed / kind / "history.jsonl").read_bytes()
    first, rest = history[: history.index(b"\n") + 1], history[history.index(b"\n") + 1 :]
    whole = read_history(undisturbed / kind)[0]
    for bit in range(8 * len(first)):
        line = bytearray(first)
        line[bit // 8] ^= 1 << bit % 8
        (tmp_path / "history.jsonl").write_bytes(bytes(line) + rest)
        records = read_history(tmp_path)[0]
        assert all(record in whole for record in records)
        assert len(records) < len(whole), bit


@pytest.mark.parametrize("kind", FILES)
def test_no_bit_of_the_question_is_flipped_unseen(kind, undisturbed, tmp_path):
    question = (undisturbed / kind / "study.json").read_bytes()
    for bit in range(0, 8 * len(question), 37):
        text = bytearray(question)
        text[bit // 8] ^= 1 << bit % 8
        (tmp_path / "study.json").write_bytes(text)
        with refused():
            read_question(tmp_path)


def test_a_report_in_a_finished_folder_is_listed_too(finished, tmp_path, capsys):
    folder = shutil.copytree(finished / "map", tmp_path / "map")
    report = folder / "report.html"
    omitted = [word for part in ("maps", "guidelines", "sensitivity", "validation") for word in ("--without", part)]
    assert main(["report", "planar-3rpr", *omitted, "-o", str(report)]) == DONE
    assert main(["check", str(folder)]) == DONE
    flipped(report, 0.7)
    assert main(["check", str(folder)]) == NO_ANSWER
    assert "report.html" in capsys.readouterr().err


def test_a_disk_that_fails_while_a_history_is_cleaned_loses_no_sound_note(tmp_path, monkeypatch):
    """All that is kept is written at once: notes that followed one by one would be lost with the process."""

    def failing(_):
        raise OSError

    notes = [{"chunk": number} for number in range(100)]
    with study_folder(tmp_path) as study:
        study.note({"chunk": 100})
        monkeypatch.setattr("kinetostat.studies.study_folder.settle", failing)
        with pytest.raises(InputError, match="is kept"):
            study.keep(notes)
    assert read_history(tmp_path)[0] == notes
