"""Tables on terminals of 80, 100 and 120 columns: every digit is there, every name can be copied, no line is too long.

A command runs once; what it has printed is then printed again at each width.
"""

import contextlib
import io
import os
import struct
import subprocess
import sys

import pytest
from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.cli import main
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.parameters import parameters
from kinetostat.views import tables

WIDTHS = (80, 100, 120)
QUICK = ("tripteron", "planar-3rpr")
"""A machine with long names of fields, and one with three components."""
LOAD = 'load.force=["10 N", "0 N", "-50 N"]'
DEMANDS = {
    "stiff along x at the pose": "free_stiffness_x > 12.3456 N/um",
    "margin": "singularity_margin > 0.123456",
}
STUDY = [
    "zhang-gosselin-2002",
    *("--set=optimizer.population=8", "--set=optimizer.generations=3", "--set=optimizer.method=genetic"),
]
FRONT = [
    "zhang-gosselin-front",
    *("--set=optimizer.population=8", "--set=optimizer.generations=3"),
]


class Recorder(Console):
    """A console that remembers what it was asked to print."""

    def __init__(self):
        super().__init__(file=io.StringIO(), width=80, markup=False, emoji=False)
        self.calls = []

    def print(self, *objects, **options):
        self.calls.append((objects, options))


def printed(monkeypatch, *arguments):
    """What a command prints, as calls of `print`."""
    recorder = Recorder()
    monkeypatch.setattr(tables, "terminal", lambda: recorder)
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        main(list(arguments))
    assert recorder.calls, arguments
    return recorder.calls


def at_width(calls, width):
    """The text of a terminal."""
    console = Console(file=io.StringIO(), width=width, markup=False, emoji=False)
    for objects, options in calls:
        console.print(*objects, **options)
    return console.file.getvalue()


def cells(calls):
    """All cells of all tables: whether each may be broken between its words, and its text."""
    for objects, _ in calls:
        for table in (item for item in objects if isinstance(item, Table)):
            for column in table.columns:
                for cell in (column.header, *column.cells):
                    yield column.no_wrap, cell.plain if isinstance(cell, Text) else str(cell)


def check(calls):
    wanted = list(cells(calls))
    for width in WIDTHS:
        text = at_width(calls, width)
        assert "…" not in text
        lines = text.split("\n")
        assert max(map(len, lines)) <= width
        words, spaced = set(text.split()), f" {' '.join(text.split())} "
        for whole, cell in wanted:
            for line in cell.split("\n"):
                if whole:
                    assert f" {' '.join(line.split())} " in spaced or not line.split(), (width, line)
                assert words.issuperset(line.split()), (width, line)


def pose_ranges(name, count=3):
    """Small ranges about the pose of a machine, for two of its coordinates."""
    machine = load(name)
    here = [p for p in parameters(machine.family) if p.path.startswith("pose.")][:2]
    found = []
    for parameter in here:
        field = parameter.path.split(".")[1]
        value = float(getattr(machine.tables["pose"], field))
        found.append(f"{parameter.path}={value - 0.01!r}:{value + 0.01!r}:{count}")
    return found


def commands_of(name, folder):
    across, up = pose_ranges(name)
    poses = folder / "poses.csv"
    field, _, ends = across.partition("=")
    poses.write_text("\n".join([field, *ends.split(":")[:2]]))
    yield "check", name
    yield "analyze", name, "--full", "--set", LOAD, "--along", "1,1,0"
    yield "analyze", name, "--units", "si"
    yield "sensitivity", name
    yield "sweep", name, "--vary", across
    yield "sweep", name, "--vary", across, "--quantity", "stiffness", "--units", "si"
    yield "map", name, "--over", across, "--over", up
    yield "guidelines", name, "--full"
    yield "workspace", name, "--over", across, "--over", up
    yield "analyze", name, *(f"--set=requirements.{key}={demand}" for key, demand in DEMANDS.items())
    yield "forward", name, "--starts", "5"
    yield "path", name, str(poses), "--quantity", "stiffness", "--quantity", "singularity_margin"
    yield "compare", name, f"{name}:{across.split('=')[0]}={across.split('=')[1].split(':')[0]}"


@pytest.mark.parametrize("name", QUICK)
def test_every_digit_is_printed_for_some_machines(name, monkeypatch, tmp_path):
    for arguments in commands_of(name, tmp_path):
        check(printed(monkeypatch, *arguments))


@pytest.mark.documents
@pytest.mark.parametrize("name", [name for name in bundled() if name not in QUICK])
def test_every_digit_is_printed_for_all_other_machines(name, monkeypatch, tmp_path):
    for arguments in commands_of(name, tmp_path):
        check(printed(monkeypatch, *arguments))


@pytest.mark.documents
def test_every_digit_of_the_paper_is_printed(monkeypatch, tmp_path):
    check(printed(monkeypatch, "reproduce", "--full", "-o", str(tmp_path)))


@pytest.mark.documents
@pytest.mark.parametrize("name", ["tripteron", "planar-3rpr"])
def test_every_digit_of_a_validation_is_printed(name, monkeypatch):
    check(printed(monkeypatch, "validate", name))


@pytest.mark.parametrize(
    "arguments",
    [
        ("list",),
        ("check", "zhang-gosselin-2002"),
        ("compare", "hexapod", "tricept", "tripteron", "delta", "orthoglide"),
        pytest.param(("optimize", *STUDY), marks=pytest.mark.documents),
        pytest.param(("pareto", *FRONT), marks=pytest.mark.documents),
    ],
    ids=["list", "check", "compare", "optimize", "pareto"],
)
def test_lists_studies_and_their_results_keep_every_name_and_digit(arguments, monkeypatch):
    check(printed(monkeypatch, *arguments))


def test_names_to_type_are_whole_in_the_list(monkeypatch):
    text = at_width(printed(monkeypatch, "list"), 80)
    assert set(bundled()) <= set(text.split())


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are of POSIX")
def test_a_pipe_is_written_for_the_terminal_beside_it():
    """`kinetostat analyze x | less` in a window of 60 columns: sentences end there, and tables are whole."""
    import fcntl
    import pty
    import termios

    outer, inner = pty.openpty()
    fcntl.ioctl(inner, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 60, 0, 0))
    code = f"import sys; from kinetostat.cli import main; sys.exit(main(['analyze', {QUICK[1]!r}]))"
    try:
        done = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=inner, text=True, check=True)
    finally:
        os.close(inner)
        os.close(outer)
    sentences = done.stdout.partition("Attribution")[0].splitlines()
    assert 50 < max(map(len, sentences)) <= 60
    assert "…" not in done.stdout


HELP = [(), *((name,) for name in ("new", "schema", "check", "analyze", "sweep", "map", "workspace", "sensitivity"))]
HELP += [(name,) for name in ("guidelines", "compare", "validate", "optimize", "pareto", "report", "export")]
HELP += [("reproduce",), ("studio",), ("doctor",), ("path",), ("forward",), ("list",)]


@pytest.mark.parametrize("command", HELP, ids=lambda command: " ".join(command) or "kinetostat")
def test_help_never_breaks_a_word(command, monkeypatch, capsys):
    words = []
    for width in (500, *WIDTHS):
        monkeypatch.setenv("COLUMNS", str(width))
        with pytest.raises(SystemExit):
            main([*command, "--help"])
        text = capsys.readouterr().out
        assert max(map(len, text.split("\n"))) <= width
        words.append([word for word in text.split() if word != "\\"])
    assert all(sorted(other) == sorted(words[0]) for other in words[1:])
