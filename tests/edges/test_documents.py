"""What the documentation says, done: every command runs, every file is read, every answer is the printed one."""

import configparser
import io
import os
import re
import subprocess
import tomllib
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from xml.etree import ElementTree

import pytest
from jobs import TRUTHS
from report_pages import no_layout, small_pictures

from cad import starts
from kinetostat.cli import main
from kinetostat.machine.loading import build, bundled, load
from kinetostat.studies.optimisation.problem import load_problem
from kinetostat.studio import serving
from kinetostat.validation.comparison import validate
from kinetostat.views import figures
from kinetostat.views.report import writing
from pages import KINDS, ROOT, blocks, commands, corrected, dialogues, missing, pages

NOT_RUN = {
    "python3 -m pip install": "sets an environment up; .ci/run does it",
    "pip install": "changes the environment; .ci/run installs the wheel in one of its own",
    ".uv/bin/uv": "an environment of its own, set up by .ci/run, which also runs tests and linters in it",
    "bash .ci/run": "runs these tests",
    "docker": "needs an engine for containers; test_packaging.py gives the Dockerfile's command to our parser",
}
"""What no test runs, by the words it starts with, and why."""

MOST_SECONDS = 20.0
"""Of processor time for each command of a job whose truth is known."""

PAGES = [page.relative_to(ROOT) for page in pages()]


class DrawnOnce(dict):
    """All formats of figures, the first of which is enough where every one would be written."""

    def __iter__(self):
        yield next(super().__iter__())


class Reader:
    """Somebody who does what a page says, in a folder of their own."""

    def __init__(self, folder: Path, rewriting: bool = False) -> None:
        self.folder = folder
        self.rewriting = rewriting
        self.corrections: list[tuple[str, str]] = []
        self.said = ""
        self.spent: list[float] = []
        self.names: dict[str, object] = {"__name__": "__main__"}

    def do(self, block):
        if block.words and (block.words == ("recipe",) or block.words[0].startswith(("src/", "tests/", "docs/"))):
            return None  # a step of a recipe: test_recipes.py follows it
        return getattr(self, f"do_{block.kind or 'quotation'}")(block)

    def do_quotation(self, block):
        assert not block.words

    def do_toml(self, block):
        name, *path = block.words
        if path:
            document = tomllib.loads((self.folder / name).read_text("utf-8"))
            build(placed(document, path[0], tomllib.loads(block.text)), name)
            return
        (self.folder / name).write_text(block.text, "utf-8")
        read = load_problem if "objectives" in tomllib.loads(block.text) else load
        read(name)

    def do_csv(self, block):
        (self.folder / block.words[0]).write_text(block.text, "utf-8")

    def do_sh(self, block):
        self.said = ""
        for words in commands(block.text):
            assert self.run(words) == 0, f"{' '.join(words)}\n{self.said}"

    def do_console(self, block):
        for words, expected in dialogues(block.text):
            self.said = ""
            self.run(words)
            self.compare(expected)

    def do_python(self, block):
        with redirect_stdout(io.StringIO()) as said:
            exec(compile(block.text, f"line {block.line}", "exec"), self.names)
        self.said = said.getvalue()

    def do_c(self, block):
        """A C program, with the sources that the page has written beside it."""
        source = self.folder / "program.txt"
        source.write_text(block.text, "utf-8")
        beside = [str(path) for path in sorted(self.folder.glob("*.c")) if not path.stem.endswith("_test")]
        compiled = ["cc", "-x", "c", str(source), *beside, "-I", str(self.folder), "-o", "program", "-lm"]
        subprocess.run(compiled, cwd=self.folder, check=True)
        self.said = subprocess.run(["./program"], cwd=self.folder, check=True, capture_output=True, text=True).stdout

    def do_matlab(self, block):
        """Calls of a MEX function that the page has written: its sources are there, and have the functions."""
        for name in re.findall(r"^mex (.+)", block.text, re.MULTILINE)[0].split():
            assert (self.folder / name).is_file()
        adapter = next(self.folder.glob("*_mex.c"))
        for function, task in re.findall(r"(\w+)\('(\w+)'", block.text):
            assert function == adapter.stem
            assert f'{{"{task}", ' in adapter.read_text("utf-8")

    def do_ini(self, block):
        settings = configparser.ConfigParser()
        settings.read_string(block.text)
        assert settings.sections()

    def do_xml(self, block):
        ElementTree.fromstring(f"<robot>{block.text}</robot>")

    def do_text(self, block):
        self.compare(block.text)

    def compare(self, expected):
        absent = missing(expected, self.said)
        if absent is not None and self.rewriting:
            self.corrections.append((expected, corrected(expected, self.said)))
            return
        assert absent is None, f"not said: {absent}\nsaid:\n{self.said}"

    def run(self, words):
        """Run one command; its exit code. What it says is added to what was said."""
        if words[0] == "make":
            subprocess.run(words, cwd=self.folder, check=True)
            return 0
        if words[0] != "kinetostat":
            command = " ".join(words)
            assert command.startswith(tuple(NOT_RUN)), f"{command}: run it, or say in NOT_RUN why not"
            assert all((ROOT / word).exists() for word in words if word.endswith(".py"))
            return 0
        if words[-1].endswith(".step") and not starts():
            return 0
        *words, target = words if words[-2] == ">" else (*words, None)
        told, warned, before = io.StringIO(), io.StringIO(), os.times()
        with redirect_stdout(told), redirect_stderr(warned):
            try:
                code = main([word for word in words[1:] if word != ">"])
            except SystemExit as stop:
                code = stop.code
        self.spent.append(sum(os.times()[:4]) - sum(before[:4]))
        if target:
            (self.folder / target).write_text(told.getvalue(), "utf-8")
        self.said += told.getvalue() + warned.getvalue()
        return code


def placed(document, path, table):
    """A document with a table in the place of what stands at a path; at `.` it is added, as if written at the end."""
    if path == ".":
        lists = {key: [*document[key], *value] for key, value in table.items() if isinstance(document.get(key), list)}
        return document | table | lists
    *way, last = [int(key) if key.isdecimal() else key for key in path.split(".")]
    at = document
    for key in way:
        at = at[key]
    at[last] = table
    return document


@pytest.fixture
def reader(tmp_path, monkeypatch, request):
    """A reader in an empty folder. Figures are drawn once, a studio does not listen; reports have small pictures.

    Parts of figures stay where they are first put, as no page quotes them: `test_every_answer` lays all of them out.
    Reports are validated by PyNite: Exudyn takes more than a minute for the hexapod of README. `test_validation` asks
    both engines about that machine.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(figures, "FORMATS", DrawnOnce(figures.FORMATS))
    monkeypatch.setattr(serving, "serve", lambda *_: None)
    small_pictures(monkeypatch)
    no_layout(monkeypatch)
    monkeypatch.setattr(writing, "validate", lambda machine, engine: validate(machine, engine or "pynite"))
    return Reader(tmp_path, request.config.getoption("--rewrite-pages"))


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_what_a_page_says_is_so(page, reader):
    for block in blocks(ROOT / page):
        try:
            reader.do(block)
        except BaseException as error:
            error.add_note(f"{page}, line {block.line}")
            raise
    text = (ROOT / page).read_text("utf-8")
    for old, new in reader.corrections:
        assert old in text, "a block that is indented is corrected by hand"
        text = text.replace(old, new)
    if reader.corrections:
        (ROOT / page).write_text(text, "utf-8")
    if page.stem in TRUTHS:
        assert max(reader.spent) < MOST_SECONDS
        TRUTHS[page.stem](reader.folder)


def test_a_quotation_is_corrected_by_what_resembles_it_most():
    answer = "Title\n C rx 0.516404\n ry 1.404595\n z 0.011139\nThe end.\n"
    assert corrected("...\nry 1.30\nz 0.0111\n...\n", answer) == "...\n ry 1.404595\n z 0.011139\n...\n"


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_every_block_says_what_it_is(page):
    assert {block.kind for block in blocks(ROOT / page)} <= set(KINDS)


@pytest.mark.parametrize("words", NOT_RUN)
def test_nothing_is_excused_that_is_not_there(words):
    assert any(re.search(rf"^{re.escape(words)}", page.read_text("utf-8"), re.MULTILINE) for page in pages())


def test_a_false_answer_is_found_out():
    said = "  C  rx  0.516404\n     ry  1.404595\n     z   0.011139\n"
    assert missing("C rx 0.516404\nry 1.404595\n z 0.011139", said) is None
    assert missing("C rx 0.516405\n...", said) == "C rx 0.516405"
    assert missing("...\nry 1.404595\nrx 0.516404\n...", said) == "ry 1.404595\nrx 0.516404"


@pytest.mark.parametrize(
    ("shown", "marked"),
    [
        ("C rx 0.516404\nz 0.011139", "C rx 0.516404\n...\nz 0.011139"),
        ("C rx 0.516404\nry 1.404595", "C rx 0.516404\nry 1.404595\n..."),
        ("ry 1.404595\nz 0.011139", "...\nry 1.404595\nz 0.011139"),
        ("C rx\nry 1.404595\nz 0.011139", "C rx ...\nry 1.404595\nz 0.011139"),
    ],
)
def test_what_is_left_out_is_marked(shown, marked):
    said = "  C  rx  0.516404\n     ry  1.404595\n     z   0.011139\n"
    assert missing(shown, said) is not None
    assert missing(marked, said) is None


def test_a_number_that_is_cut_off_is_found_out():
    assert missing("ry 1.40\n...", "ry 1.404595\n0 of 3\n") is not None
    assert missing("...\ny 1.404595", "ry 1.404595\n") is not None


def test_the_overview_lists_all_bundled_machines():
    rows = [line for line in (ROOT / "docs/overview.md").read_text().splitlines() if line.startswith("| `")]
    names = re.findall(r"`(?:\.\.\.-)?([\w-]+)`", " ".join(row.split("|")[1] for row in rows))
    assert [name for name in bundled() if not name.endswith(tuple(names))] == []


def test_equations_are_numbered_in_order_and_those_that_are_named_exist():
    theory = (ROOT / "docs/theory.md").read_text("utf-8")
    numbers = [int(number) for number in re.findall(r"\\tag\{(\d+)\}", theory)]
    assert numbers == list(range(1, 1 + theory.count("\n$$\n") // 2))
    named = {int(number) for page in pages() for number in re.findall(r"equation \((\d+)\)", page.read_text("utf-8"))}
    assert named
    assert named <= set(numbers)


@pytest.mark.parametrize("job", ["cable-robot", "delta-printer", "machine-tool", "telescope"])
def test_a_job_takes_ten_commands_at_most_and_ends_in_a_file(job):
    """The page itself is the script of the job: the test above runs it from its first word to its last file."""
    read = [*blocks(ROOT / "docs" / "tutorials" / f"{job}.md")]
    lines = [words for block in read if block.kind == "console" for words, _ in dialogues(block.text)]
    lines += [words for block in read if block.kind == "sh" for words in commands(block.text)]
    assert 0 < len(lines) <= 10
    assert any("-o" in words or ">" in words for words in lines)
