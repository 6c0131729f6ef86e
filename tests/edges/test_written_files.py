"""Files are written whole or not at all: on a full disk, over what is not a plain file, and after kill -9."""

import contextlib
import os
import signal
import subprocess
import sys

import pytest

from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, DONE
from kinetostat.commands.documents import REPORT_PARTS
from kinetostat.exchange.formats import FORMATS, export
from kinetostat.machine.loading import load
from kinetostat.studies import storage
from kinetostat.studies.storage import PREFIX, scratch, write_text
from refusals import refused
from studies import SMALL

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no limits, links and devices of this kind")
MACHINE = "delta"
HEAVY = ["--set", "tool.mass=2 kg", "--set", "tool.inertia=[0.01, 0.01, 0.02, 0, 0, 0]"]

PROGRAMS = {form.suffix for form in FORMATS if form.options == ("inputs", "outputs")}
"""Suffixes of formats that hold programs: these are long, and take long, for all but small machines."""


@contextlib.contextmanager
def files_of_at_most(size):
    """Writing behind byte `size` of any file fails, as on a full disk.

    Python keeps what it compiles meanwhile to itself: a file of it that is cut would be read by the next process.
    """
    import resource

    before, compiled = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    sys.dont_write_bytecode = True
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        sys.dont_write_bytecode = compiled


def tree(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


@pytest.mark.parametrize("suffix", [form.suffix for form in FORMATS if form.name != "step"])
def test_an_export_to_a_full_disk_is_one_sentence_and_leaves_nothing(suffix, tmp_path):
    machine = "planar-3rpr" if suffix in PROGRAMS else MACHINE
    with files_of_at_most(500), refused("cannot be written: it would exceed"):
        export(load(machine, [*HEAVY[1::2], "load.gravity=[0, 0, -9.81]"]), tmp_path / "new" / f"file{suffix}")
    assert tree(tmp_path) == []


WRITING = {
    "sweep": [MACHINE, "--vary", "x=-1 cm:1 cm:5"],
    "map": [MACHINE, "--over", "x=-1 cm:1 cm:2", "--over", "y=-1 cm:1 cm:2"],
    "workspace": [MACHINE, "--over", "x=-1 cm:1 cm:3", "--over", "y=-1 cm:1 cm:3"],
    "optimize": ["study.toml"],
    "report": [MACHINE, *(word for part in REPORT_PARTS for word in ("--without", part))],
    "analyze": [MACHINE, *HEAVY, "--loaded"],
    "command": [MACHINE, "poses.csv", *HEAVY],
    "path": [MACHINE, "poses.csv"],
    "modes": [MACHINE, *HEAVY],
    "budget": [MACHINE, "--tolerance", "joints=0.05 mm", "--samples", "64"],
    "identify": [MACHINE, "measured.csv", "--fit", "zeros"],
    "export": [MACHINE, *HEAVY, "--to", "state-space"],
    "compare": [MACHINE, MACHINE],
}
"""Commands that write, with what they need besides -o; `given` has the files."""
SINGLE = {"report": "out.html", "command": "out.csv", "path": "out.nc", "export": "out.mat"}
"""What is written by those that write a file, not a folder."""


@pytest.fixture
def given(tmp_path, monkeypatch):
    """A current folder with a study, poses and measurements."""
    monkeypatch.chdir(tmp_path)
    home = load(MACHINE).tables["pose"].z * 1e3
    poses = [(x, y, home + z) for x in (-9, 4) for y in (-5, 8) for z in (-7, 6)]
    rows = [f"{x},{y},{z},{x + 0.01},{y},{z - 0.02}" for x, y, z in poses]
    (tmp_path / "study.toml").write_text(SMALL)
    (tmp_path / "poses.csv").write_text("\n".join(["x [mm],y [mm],z [mm]", *(f"{x},{y},{z}" for x, y, z in poses)]))
    heads = "x [mm],y [mm],z [mm],measured.x [mm],measured.y [mm],measured.z [mm]"
    (tmp_path / "measured.csv").write_text("\n".join([heads, *rows]))
    return tmp_path


@pytest.mark.parametrize("command", WRITING)
def test_a_command_on_a_full_disk_is_one_sentence(command, given, capsys):
    with files_of_at_most(300):
        assert main([command, *WRITING[command], "-o", str(given / SINGLE.get(command, "out"))]) == BAD_INPUT
    captured = capsys.readouterr()
    assert captured.err.count("cannot be written: it would exceed the largest size") == 1
    assert not [name for name in tree(given) if PREFIX in name]


def test_a_large_grid_on_a_full_disk_is_one_sentence(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("kinetostat.studies.datasets.IN_MEMORY", 2)
    words = ["map", MACHINE, "--over", "x=-1 cm:1 cm:2", "--over", "y=-1 cm:1 cm:2", "-o", str(tmp_path / "out")]
    with files_of_at_most(100_000):
        assert main(words) == BAD_INPUT
    assert "cannot be written: it would exceed" in capsys.readouterr().err
    assert main(words) == DONE


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")
@pytest.mark.parametrize("words", [["analyze", "delta"], ["schema", "machine"]])
def test_a_full_standard_output_is_one_sentence(words):
    with open("/dev/full", "wb") as full:
        done = subprocess.run(
            [sys.executable, "-m", "kinetostat", *words], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == BAD_INPUT
    assert done.stderr.startswith("kinetostat: standard output cannot be written")
    assert done.stderr.count("\n") == 1


def occupied(folder, kind, name="file.csv"):
    """A path at which something stands that is not to be replaced."""
    path = folder / name
    match kind:
        case "folder":
            path.mkdir()
        case "fifo":
            os.mkfifo(path)
        case "link to a device":
            path.symlink_to("/dev/null")
        case "link to a folder":
            path.symlink_to(folder)
        case "link to itself":
            path.symlink_to(path)
        case "read-only":
            path.write_text("mine")
            path.chmod(0o444)
    return path


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("folder", "is a folder"),
        ("fifo", "another special file"),
        ("link to a device", "another special file"),
        ("link to a folder", "is a folder"),
        ("link to itself", "leads back to itself"),
        ("read-only", "may only be read"),
    ],
)
def test_only_plain_files_are_replaced(kind, words, tmp_path, capsys):
    path = occupied(tmp_path, kind)
    before = path.lstat()
    assert main(["export", MACHINE, "-o", str(path)]) == BAD_INPUT
    assert words in capsys.readouterr().err
    assert (path.lstat().st_ino, path.lstat().st_mode) == (before.st_ino, before.st_mode)
    assert tree(tmp_path) == ["file.csv"]


@pytest.mark.parametrize("kind", ["fifo", "link to a device", "link to itself"])
@pytest.mark.parametrize("command", WRITING)
def test_a_command_writes_into_folders_and_plain_files_only(command, kind, given, capsys):
    # With a suffix, a command that writes a folder would refuse the name before it looks at the place.
    path = occupied(given, kind, "file.csv" if command in SINGLE else "file")
    before = path.lstat()
    assert main([command, *WRITING[command], "-o", str(path)]) == BAD_INPUT
    assert capsys.readouterr().err.count("\n") == 1
    assert (path.lstat().st_ino, path.lstat().st_mode) == (before.st_ino, before.st_mode)


@pytest.mark.parametrize("there", [True, False])
def test_a_link_stays_and_its_file_is_replaced(there, tmp_path):
    link, file = tmp_path / "link.txt", tmp_path / "deep" / "file.txt"
    link.symlink_to(file)
    if there:
        file.parent.mkdir()
        file.write_text("old")
        file.chmod(0o600)
    write_text(link, "new")
    assert link.is_symlink()
    assert file.read_text() == "new"
    assert file.stat().st_mode & 0o777 == (0o600 if there else 0o644)
    assert tree(tmp_path) == ["deep", "deep/file.txt", "link.txt"]


def test_two_files_that_belong_together_are_both_written_or_none(tmp_path):
    (tmp_path / "machine.yaml").mkdir()
    with refused(r"machine\.yaml\" is a folder"):
        export(load(MACHINE), tmp_path / "machine.urdf")
    assert tree(tmp_path) == ["machine.yaml"]


KILLED = """
import os, signal, sys
from pathlib import Path
from kinetostat.studies.storage import replacing
with replacing(Path(sys.argv[1])) as temporary:
    temporary.write_text("half")
    if sys.argv[2] == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    print("at work", flush=True)
    sys.stdin.read()
"""


def test_what_kill_9_leaves_is_removed_by_the_next_run_and_a_living_process_is_left_alone(tmp_path):
    words = [sys.executable, "-c", KILLED, str(tmp_path / "file.txt")]
    assert subprocess.run([*words, "killed"]).returncode == -signal.SIGKILL
    (litter,) = tmp_path.iterdir()
    assert litter.name.startswith(PREFIX)
    with subprocess.Popen([*words, "alive"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout.readline() == "at work\n"
        assert not litter.exists()
        write_text(tmp_path / "file.txt", "mine")
        assert len(list(tmp_path.glob(f"{PREFIX}*"))) == 1
        other.communicate()
    assert (tmp_path / "file.txt").read_text() == "half"
    assert tree(tmp_path) == ["file.txt"]


def test_on_disks_without_locks_folders_count_as_abandoned_after_a_day(tmp_path, monkeypatch):
    monkeypatch.setattr(storage, "_lock_folder", lambda _: storage.UNLOCKED)
    old, new = (tmp_path / f"{PREFIX}{name}" for name in ("old", "new"))
    for folder in (old, new):
        folder.mkdir()
    os.utime(old, (0.0, 0.0))
    write_text(tmp_path / "file", "text")
    assert (old.exists(), new.exists()) == (False, True)


def test_scratch_folders_of_one_process_do_not_disturb_each_other(tmp_path):
    with scratch(tmp_path) as first, scratch(tmp_path) as second:
        write_text(tmp_path / "file", "text")
        assert first.is_dir()
        assert second.is_dir()
    assert tree(tmp_path) == ["file"]
