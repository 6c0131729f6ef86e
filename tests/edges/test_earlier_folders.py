"""Folders of long studies that earlier versions have begun: each of them is read, checked and continued.

`tests/folders` has one of each form that a landed version wrote, by its day in November 2026. They are of one search
and of one grid, with a machine file each, and were written by these versions themselves.
"""

import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from kinetostat.cli import main
from kinetostat.commands.common import DONE
from kinetostat.machine.loading import load
from kinetostat.studies import datasets

FOLDERS = Path(__file__).parents[1] / "folders"
SEARCHES = sorted(path.name for path in FOLDERS.glob("search-*"))
GRIDS = sorted(path.name for path in FOLDERS.glob("grid-*"))
CUT = {"as it was": None, "stopped after a step": 1}


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(datasets, "IN_MEMORY", 50)
    monkeypatch.setattr("kinetostat.views.optimisation_figures.pictures", lambda *_: {})


def copied(name, folder, lines):
    """A copy of a folder whose history ends after so many lines."""
    copy = shutil.copytree(FOLDERS / name, folder / name)
    text = (copy / "history.jsonl").read_text().splitlines(keepends=True)
    (copy / "history.jsonl").write_text("".join(text[:lines]))
    return copy


def test_every_form_is_here():
    assert SEARCHES == ["search-11-21", "search-11-22-evening", "search-11-22-morning", "search-11-22-noon"]
    assert GRIDS == ["grid-11-21", "grid-11-22-noon", "grid-11-23"]


@pytest.mark.parametrize("lines", CUT.values(), ids=CUT)
@pytest.mark.parametrize("by", ["folder", "study"])
@pytest.mark.parametrize("name", SEARCHES)
def test_a_search_of_an_earlier_version_goes_on_to_the_same_designs(name, by, lines, tmp_path, capsys):
    folder = copied(name, tmp_path, lines)
    command = [str(folder)] if by == "folder" else [str(FOLDERS / "study.toml"), "-o", str(folder)]
    assert main(["optimize", *command]) == DONE
    assert ("without checksums" in capsys.readouterr().err) == (name in ("search-11-21", "search-11-22-morning"))
    mine, theirs = (np.fromfile(place / "designs.bin") for place in (folder, FOLDERS / name))
    np.testing.assert_allclose(mine, theirs, rtol=1e-9)
    assert main(["check", str(folder)]) == DONE
    assert "3 steps are there" in capsys.readouterr().out


@pytest.mark.parametrize("lines", CUT.values(), ids=CUT)
@pytest.mark.parametrize("name", GRIDS)
def test_a_grid_of_an_earlier_version_goes_on_to_the_same_numbers(name, lines, tmp_path, capsys):
    folder = copied(name, tmp_path, lines)
    over = [word for axis in "xy" for word in ("--over", f"{axis}=-1 cm:1 cm:9")]
    command = ["map", str(FOLDERS / "delta.toml"), *over, "--quantity", "compliance_x", "--json", "-o", str(folder)]
    assert main(command) == DONE
    assert ("without checksums" in capsys.readouterr().err) == (name == "grid-11-21")
    with xr.open_dataset(folder / "map.nc") as mine, xr.open_dataset(FOLDERS / name / "map.nc") as theirs:
        np.testing.assert_allclose(mine["compliance_x"], theirs["compliance_x"], rtol=1e-9)
        assert (mine["status"] == 0).all()
    assert main(["check", str(folder)]) == DONE
    assert "3 chunks are there" in capsys.readouterr().out


def test_the_structure_of_an_earlier_file_is_made_again_where_it_is_damaged(tmp_path, capsys):
    """Texts in the file have changed since, so that its numbers stand elsewhere in the new one."""
    folder = copied("grid-11-22-noon", tmp_path, None)
    data = bytearray((folder / "map.nc").read_bytes())
    data[100] ^= 1
    (folder / "map.nc").write_bytes(data)
    over = [word for axis in "xy" for word in ("--over", f"{axis}=-1 cm:1 cm:9")]
    command = ["map", str(FOLDERS / "delta.toml"), *over, "--quantity", "compliance_x", "--json", "-o", str(folder)]
    assert main(command) == DONE
    assert "computed again: the structure of its file" in capsys.readouterr().err
    assert main(["check", str(folder)]) == DONE
    with xr.open_dataset(folder / "map.nc") as mine, xr.open_dataset(FOLDERS / "grid-11-22-noon/map.nc") as theirs:
        np.testing.assert_allclose(mine["compliance_x"], theirs["compliance_x"], rtol=1e-9)


def test_units_of_display_do_not_part_a_study_from_its_folder(tmp_path):
    """The machine is read again with other [display]; numbers of the search do not depend on it."""
    for file in ("study.toml", "machine.toml"):
        shutil.copy(FOLDERS / file, tmp_path / file)
    folder = copied(SEARCHES[-1], tmp_path, None)
    with (tmp_path / "machine.toml").open("a") as stream:
        stream.write('\n[display]\nunits = "si"\n')
    assert load(str(tmp_path / "machine.toml")).display != load(str(FOLDERS / "machine.toml")).display
    assert main(["optimize", str(tmp_path / "study.toml"), "-o", str(folder)]) == DONE
