"""Compiled programs on disk: right numbers whatever happens to files, and no byte run that the user did not write."""

import ast
import os
import re
import signal
import stat
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kinetostat
from kinetostat import load
from kinetostat.engine import kernel, program_files
from kinetostat.engine.batch import function_of
from kinetostat.engine.form import Specimen, form_of, objectives_of
from kinetostat.engine.kernel import Recipe, program_of, recipe_of
from kinetostat.engine.llvm_source import source
from kinetostat.engine.machine_code import (
    SELF_LINKED,
    MachineCode,
    Program,
    host_lanes,
    machine_code_of,
    object_file_of,
)
from kinetostat.engine.program_files import HASH_SIZE, SECRET, read_program, write_program
from kinetostat.machine.catalogue import family_text, register

TEXT, CONTENT = "a recipe", bytes(range(256)) * 3
RUN = """
import sys
from kinetostat import compile, load
{before}
names = {names!r}
for name in names:
    machine = load(name)
    function = compile(machine, ["x", "z"], ["stiffness_x", "compliance_z"])
    at = [[float(v)] * 5 for v in (machine.tables["pose"].x, machine.tables["pose"].z)]
    print(name, function(*at).tobytes().hex())
print("compiled" if "llvmlite" in sys.modules else "loaded")
"""
linux = pytest.mark.skipif(not SELF_LINKED, reason="elsewhere LLVM loads the code, and is imported for it")


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """A folder of programs that is not there yet."""
    path = tmp_path / "programs"
    monkeypatch.setenv(program_files.VARIABLE, str(path))
    return path


def programs(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.name != SECRET)


def put(path: Path, data: bytes) -> None:
    """Write a file with the rights that those of programs have."""
    path.write_bytes(data)
    path.chmod(0o600)


def process(before: str = "", names: tuple[str, ...] = ("hexapod",), **environment: str) -> subprocess.Popen[str]:
    code = RUN.format(before=before, names=names)
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-c", code],
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def answer(before: str = "", names: tuple[str, ...] = ("hexapod",), **environment: str) -> list[str]:
    """What a process prints that begins so; it says nothing else."""
    running = process(before, names, **environment)
    out, err = running.communicate()
    assert (running.returncode, err) == (0, "")
    return out.splitlines()


@pytest.fixture(scope="module")
def expected() -> list[str]:
    return answer(**{program_files.VARIABLE: "off"})[:-1]


@linux
def test_a_new_process_runs_what_an_earlier_one_has_compiled(folder):
    names = ("hexapod", "tripteron", "hexapod-hardware")
    first, second = answer(names=names, PYTHONHASHSEED="1"), answer(names=names, PYTHONHASHSEED="2")
    assert (first[-1], second[-1]) == ("compiled", "loaded")
    assert first[:-1] == second[:-1]
    assert len(programs(folder)) == len(names)


def test_the_folder_and_its_files_are_the_users_own(folder):
    write_program(TEXT, CONTENT)
    assert read_program(TEXT) == CONTENT
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert {stat.S_IMODE(path.stat().st_mode) for path in folder.iterdir()} == {0o600}


def test_no_flipped_byte_is_run(folder):
    """Wherever it is: in the hash, in the head or in the code. The file is made again."""
    write_program(TEXT, CONTENT)
    (path,) = programs(folder)
    sound = path.read_bytes()
    assert len(sound) == HASH_SIZE + len(CONTENT)
    for place in range(len(sound)):
        put(path, sound[:place] + bytes([sound[place] ^ 1]) + sound[place + 1 :])
        assert read_program(TEXT) is None
        assert not path.exists()
    for length in (0, 10, HASH_SIZE, len(sound) - 1):
        put(path, sound[:length])
        assert read_program(TEXT) is None
    write_program(TEXT, CONTENT)
    assert read_program(TEXT) == CONTENT


def test_a_file_of_another_program_or_of_another_folder_is_not_run(folder, tmp_path, monkeypatch):
    write_program(TEXT, CONTENT)
    (path,) = programs(folder)
    write_program("another recipe", b"other code")
    (other,) = (file for file in programs(folder) if file != path)
    other.write_bytes(path.read_bytes())
    assert read_program("another recipe") is None
    monkeypatch.setenv(program_files.VARIABLE, str(tmp_path / "copy"))
    write_program("another recipe", b"other code")
    put(tmp_path / "copy" / path.name, path.read_bytes())
    assert read_program(TEXT) is None


def test_a_flipped_byte_costs_a_compilation(folder, expected):
    answer()
    (path,) = programs(folder)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0x40
    path.write_bytes(data)
    assert answer() == [*expected, "compiled"]
    assert answer()[:-1] == expected


@pytest.mark.parametrize("mode", [0o770, 0o707, 0o750, 0o704, 0o701])
def test_a_folder_that_others_may_use_is_refused_in_one_sentence(folder, mode):
    write_program(TEXT, CONTENT)
    folder.chmod(mode)
    with pytest.warns(UserWarning, match=re.escape(f'"{folder}"')) as said:
        assert read_program(TEXT) is None
    assert len(said) == 1
    before = len(programs(folder))
    with pytest.warns(UserWarning, match="chmod 700"):
        write_program("another recipe", CONTENT)
    assert len(programs(folder)) == before
    folder.chmod(0o700)
    assert read_program(TEXT) == CONTENT


def test_a_folder_of_another_user_is_refused(folder, monkeypatch):
    write_program(TEXT, CONTENT)
    us = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: us + 1)
    with pytest.warns(UserWarning, match="belongs to others"):
        assert read_program(TEXT) is None


def test_files_that_others_may_use_and_links_are_not_read(folder, tmp_path, monkeypatch):
    write_program(TEXT, CONTENT)
    (path,) = programs(folder)
    path.chmod(0o620)
    assert read_program(TEXT) is None
    path.chmod(0o600)
    elsewhere = path.rename(tmp_path / "elsewhere")
    path.symlink_to(elsewhere)
    assert read_program(TEXT) is None
    monkeypatch.setenv(program_files.VARIABLE, str(tmp_path / "link"))
    (tmp_path / "link").symlink_to(folder)
    assert read_program(TEXT) is None


def test_a_damaged_secret_is_made_again(folder):
    write_program(TEXT, CONTENT)
    (folder / SECRET).write_bytes(b"short")
    assert read_program(TEXT) is None
    write_program(TEXT, CONTENT)
    assert read_program(TEXT) == CONTENT


KILLED_BEFORE_THE_MOVE = """
import os
os.rename = lambda *_, **__: os.kill(os.getpid(), 9)
"""
KILLED_IN_THE_WRITE = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
"""


@pytest.mark.parametrize(
    ("before", "number"), [(KILLED_BEFORE_THE_MOVE, signal.SIGKILL), (KILLED_IN_THE_WRITE, signal.SIGXFSZ)]
)
def test_a_process_that_is_killed_while_it_writes_leaves_right_numbers(folder, expected, before, number):
    running = process(before)
    running.communicate()
    assert running.returncode == -number
    (left,) = programs(folder)
    assert left.name.startswith(".")
    assert answer() == [*expected, "compiled"]
    assert answer()[:-1] == expected
    os.utime(left, (0, 0))
    write_program(TEXT, CONTENT)
    assert not left.exists()


NO_ROOM = """
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
"""


def test_a_full_disk_costs_time_alone(folder, expected):
    """The system refuses to write more than some bytes of a file."""
    for _ in range(2):
        assert answer(NO_ROOM) == [*expected, "compiled"]
    assert programs(folder) == []


@pytest.mark.parametrize("place", ["/proc/kinetostat", "/dev/null/programs"])
def test_a_folder_that_cannot_be_made_costs_time_alone(expected, place):
    assert answer(**{program_files.VARIABLE: place}) == [*expected, "compiled"]


def test_what_may_not_be_written_is_still_read(folder, monkeypatch):
    write_program(TEXT, CONTENT)
    opened = os.open

    def refuse(path, flags, *rest, **named):
        if flags & os.O_CREAT:
            raise PermissionError(30, "Read-only file system")
        return opened(path, flags, *rest, **named)

    monkeypatch.setattr(os, "open", refuse)
    write_program("another recipe", CONTENT)
    assert read_program(TEXT) == CONTENT
    assert len(programs(folder)) == 1


def test_processes_that_begin_at_once_have_one_secret_and_one_file(folder, expected):
    running = [process() for _ in range(4)]
    for each in running:
        out, err = each.communicate()
        assert (each.returncode, err, out.splitlines()[:-1]) == (0, "", expected)
    assert len(programs(folder)) == 1
    assert answer()[:-1] == expected


def test_a_secret_that_another_process_has_made_meanwhile_stays(folder, monkeypatch):
    write_program(TEXT, CONTENT)
    monkeypatch.setattr(program_files, "_exists", lambda *_: False)  # as it was when this process looked
    write_program("another recipe", CONTENT)
    assert read_program(TEXT) == CONTENT


def test_nothing_is_kept_where_it_is_switched_off(tmp_path, expected, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert answer(**{program_files.VARIABLE: "off"}) == [*expected, "compiled"]
    assert list(tmp_path.iterdir()) == []
    answer(**{program_files.VARIABLE: ""})
    assert len(programs(tmp_path / "kinetostat" / "programs")) == 1


def test_all_files_together_are_bounded_and_those_used_last_stay(folder, monkeypatch):
    monkeypatch.setattr(program_files, "MOST_BYTES", 5000)
    for number in range(20):
        write_program(str(number), bytes(1000 - HASH_SIZE))
        assert sum(path.stat().st_size for path in folder.iterdir()) <= 5000
        for age, path in enumerate(sorted(programs(folder), key=lambda path: -path.stat().st_mtime_ns)):
            os.utime(path, (1e9 - 1e6 * age, 1e9 - 1e6 * age))
        assert read_program("0") is not None or number > 4  # a use makes it young again
    assert read_program("19") is not None
    assert read_program("0") is not None


@pytest.mark.parametrize(
    "change",
    [
        lambda patch: patch.setattr(program_files, "_processor", lambda: "another"),
        lambda patch: patch.setattr(sys, "version", "another"),
        lambda patch: patch.setattr(program_files, "_sources", lambda folder, **_: [(folder, 1, 2)]),
        lambda patch: patch.setattr(program_files, "find_spec", lambda _: None),
    ],
    ids=["processor", "Python", "sources", "LLVM"],
)
def test_another_version_or_processor_has_programs_of_its_own(folder, monkeypatch, change):
    write_program(TEXT, CONTENT)
    with monkeypatch.context() as patch:
        change(patch)
        program_files._surroundings.cache_clear()
        assert read_program(TEXT) is None
        write_program(TEXT, b"of another")
    program_files._surroundings.cache_clear()
    assert read_program(TEXT) == CONTENT


def test_every_source_that_formulas_are_made_of_counts():
    folder = str(Path(kinetostat.__file__).parent)
    names = {
        Path(path).relative_to(folder).as_posix()
        for room in ("", *program_files.ROOMS)
        for path, _, _ in program_files._sources(str(Path(folder) / room), deep=bool(room))
    }
    assert {"tolerances.py", "algebra/solve.py", "machine/written/family.py", "machine/catalogue/hexapod.py"} <= names
    trees = [ast.parse(path.read_text("utf-8")) for path in Path(kernel.__file__).parent.glob("*.py")]
    imported = {str(node.module) for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    rooms = {name.split(".")[1] for name in imported if name.startswith("kinetostat.")}
    assert rooms <= {*program_files.ROOMS, *(name.removesuffix(".py") for name in names)}


def test_sources_that_changed_since_the_start_keep_the_process_from_storing(folder, monkeypatch):
    program_files._surroundings.cache_clear()
    monkeypatch.setattr(kinetostat, "STARTED", 0.0)
    write_program(TEXT, CONTENT)
    assert not folder.exists()
    program_files._surroundings.cache_clear()


def test_a_system_that_does_not_say_its_processor_keeps_nothing(folder, monkeypatch):
    def refuse():
        raise PermissionError(13, "no /proc here")

    program_files._surroundings.cache_clear()
    monkeypatch.setattr(program_files, "_processor", refuse)
    write_program(TEXT, CONTENT)
    assert read_program(TEXT) is None
    assert not folder.exists()
    program_files._surroundings.cache_clear()


def recipe(machine) -> Recipe:
    form, _ = form_of(machine, ["pose.z"])
    return recipe_of(objectives_of, Specimen(machine), form, objectives=((("stiffness_x", 1.0),),))


def test_families_that_a_program_registers_stay_off_the_disk(folder):
    """Their code may change from one process to the next without a change of kinetostat."""
    hexapod = load("hexapod")
    assert recipe(hexapod).text
    own = register(replace(hexapod.family, name="of-a-notebook"))
    for family in (own, replace(hexapod.family)):
        assert family_text(family) is None
        machine = replace(hexapod, family=family)
        assert recipe(machine).text is None
        program_of.__wrapped__(recipe(machine))
    assert not folder.exists()


def test_recipes_of_different_programs_have_different_texts():
    hexapod = load("hexapod")
    machines = [hexapod, load("hexapod", ["load.force=[1,2,3]"]), load("tripteron"), load("hexapod-hardware")]
    machines.append(load("hexapod", ["load.state=loaded"]))
    texts = [recipe(machine).text for machine in machines]
    first = recipe(hexapod)
    texts += [replace(first, arguments=(((("stiffness_y", 1.0),),), None, False)).text]
    texts += [replace(first, form=form_of(hexapod, ["pose.x"])[0]).text]
    assert len(set(texts)) == len(texts)
    assert not any("0x" in str(text) for text in texts)


@linux
def test_linked_code_is_what_llvm_loads():
    """The same object file, once linked here and once loaded by LLVM."""
    machine = load("hexapod")
    body = recipe(machine).formula().body
    _, fixed = form_of(machine, ["pose.z"])
    z, results, codes = np.linspace(0.1, 0.2, 33), np.empty((2, 1, 33)), np.empty((2, 33), dtype=np.int8)
    codes_of = [machine_code_of(body), MachineCode(object_file_of(source(body, host_lanes())), -1, host_lanes(), 1)]
    for code, row, status in zip(codes_of, results, codes, strict=True):
        Program(code).run(fixed, [z], row, status)
    assert results[0].tobytes() == results[1].tobytes()
    assert codes[0].tobytes() == codes[1].tobytes()
    assert np.isfinite(results).any()


def test_without_llvm_all_runs_in_numpy(monkeypatch):
    machine = load("hexapod")
    monkeypatch.setenv(program_files.VARIABLE, program_files.OFF)
    monkeypatch.setitem(sys.modules, "llvmlite.binding", None)
    program_of.cache_clear()
    try:
        fill = function_of(machine, ["pose.z"], ["stiffness_x"]).fill
        assert not isinstance(fill.program, Program)
        results, status = np.empty((1, 3)), np.empty(3, dtype=np.int8)
        fill({"pose.z": np.array([0.14, 0.15, 0.16])}, results, status)
    finally:
        program_of.cache_clear()
    monkeypatch.undo()
    compiled = function_of(load("hexapod"), ["pose.z"], ["stiffness_x"]).fill
    other = np.empty((1, 3))
    compiled({"pose.z": np.array([0.14, 0.15, 0.16])}, other, status)
    np.testing.assert_allclose(results, other, rtol=1e-11)
