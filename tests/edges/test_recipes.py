"""The recipes of docs/extending.md, followed to the letter in a copy of the package: what they promise comes true.

A recipe is a section with these blocks, read in order:

    ```python src/kinetostat/...    a new file of that name; or, if it exists, lines for it: the first or the last line
    ```toml src/kinetostat/...      of the block stands in the file exactly once, and the others go below or above it
    ```md docs/...
    ```sh recipe                    commands that must succeed afterwards, in an empty folder
    ```text recipe                  what the last of them says, as elsewhere in the documentation
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pages import ROOT, Block, blocks, commands, missing

PAGE = ROOT / "docs" / "extending.md"
TITLES = (
    "Add a machine family",
    "Add a joint type",
    "Add hardware",
    "Add a limit",
    "Add an index",
    "Add an export format",
    "Add a damper or a mass",
    "Add a question",
)


def recipe(title: str) -> list[Block]:
    """The blocks of a recipe, in order."""
    starts = [(m.start(), m[1]) for m in re.finditer(r"^## (.+)$", PAGE.read_text("utf-8"), re.MULTILINE)]
    lines = {PAGE.read_text("utf-8").count("\n", 0, start) + 1: name for start, name in starts}
    inside = {block: max(line for line in lines if line < block.line) for block in blocks(PAGE)}
    return [block for block, line in inside.items() if lines[line].startswith(title) and block.words]


def follow(block: Block, tree: Path) -> None:
    """Do in a tree what a block of source says; nothing where somebody has followed it already."""
    path, added = tree / block.words[0], block.text.rstrip("\n").split("\n")
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(block.text, "utf-8")
        return
    lines = path.read_text("utf-8").split("\n")
    anchored = ((added[0], added[1:]), (added[-1], added[:-1]))
    if any(stand_in(lines, [anchor]) and stand_in(lines, new) for anchor, new in anchored):
        return
    for anchor, _ in anchored:
        places = [i for i, line in enumerate(lines) if line.strip() == anchor.strip()]
        if len(places) == 1:
            (place,) = places
            indent, shift = (len(line) - len(line.lstrip()) for line in (lines[place], anchor))
            lines[place : place + 1] = [" " * indent + line[shift:] if line.strip() else "" for line in added]
            path.write_text("\n".join(lines), "utf-8")
            return
    raise AssertionError(f"{block.words[0]} has neither {added[0].strip()!r} nor {added[-1].strip()!r} just once")


def stand_in(lines: list[str], part: list[str]) -> bool:
    """Whether some lines follow each other among others, however they are indented."""
    there, wanted = ("\n" + "\n".join(line.strip() for line in text) + "\n" for text in (lines, part))
    return wanted in there


@pytest.mark.parametrize(
    ("added", "after"),
    [
        ("    1: 2,\n    3: 4,\n", "x = {\n    1: 2,\n    3: 4,\n}\n"),
        ("a = 0\nx = {\n", "a = 0\nx = {\n    1: 2,\n}\n"),
    ],
)
def test_lines_go_below_or_above_the_line_that_is_quoted(added, after, tmp_path):
    (tmp_path / "a.py").write_text("x = {\n    1: 2,\n}\n", "utf-8")
    for _ in range(2):  # the second time there is nothing left to do
        follow(Block("python", ("a.py",), added, 1), tmp_path)
        assert (tmp_path / "a.py").read_text("utf-8") == after


def copy_of_the_project(tree: Path) -> Path:
    """A new folder with what the recipes change: the package, its tests and the overview."""
    beside = shutil.ignore_patterns("*.pyc.*")  # what other processes are writing; what they have compiled comes along
    shutil.copytree(ROOT / "src", tree / "src", ignore=beside)
    shutil.copytree(ROOT / "tests", tree / "tests", ignore=shutil.ignore_patterns("*.pyc*"))
    (tree / "docs").mkdir()
    shutil.copy(ROOT / "docs" / "overview.md", tree / "docs")
    return tree


def test_linters_find_nothing_after_all_recipes(tmp_path):
    tree = copy_of_the_project(tmp_path / "tree")
    for block in (block for title in TITLES for block in recipe(title) if block.words != ("recipe",)):
        follow(block, tree)
    shutil.copy(ROOT / "pyproject.toml", tree)
    for words in (["check"], ["format", "--check"]):
        ruff = [sys.executable, "-m", "ruff", *words, "--no-cache"]
        done = subprocess.run(ruff, cwd=tree, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("title", TITLES)
def test_a_recipe_followed_word_by_word_works(title, tmp_path):
    tree, there, said = copy_of_the_project(tmp_path / "tree"), tmp_path / "there", ""
    there.mkdir()
    steps = recipe(title)
    assert any(block.words == ("recipe",) for block in steps), "a recipe ends with a command that shows its result"
    for block in steps:
        if block.words != ("recipe",):
            follow(block, tree)
        elif block.kind == "text":
            absent = missing(block.text, said)
            assert absent is None, f"not said: {absent}\nsaid:\n{said}"
        else:
            for words in commands(block.text):
                done = subprocess.run(
                    [sys.executable, "-m", *words],
                    cwd=there,
                    env={**os.environ, "PYTHONPATH": str(tree / "src"), "COLUMNS": "100"},
                    capture_output=True,
                    text=True,
                    check=False,
                )
                said = done.stdout + done.stderr
                assert done.returncode == 0, f"{' '.join(words)}\n{said}"
