"""The commands as a new user types them: exit codes, messages, output."""

import importlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import threading

import pytest

from kinetostat.cli import main
from kinetostat.commands import silence
from kinetostat.commands.common import BAD_INPUT, DONE, NO_ANSWER, STOPPED
from kinetostat.commands.silence import CLEAR_LINE
from kinetostat.engine.program_files import OFF, VARIABLE
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.machine.loading import bundled, load
from kinetostat.studies.bundled import bundled_studies, study_of
from kinetostat.views import analysis
from kinetostat.views.questions import QUESTIONS

MACHINE = "zhang-gosselin-4dof"

ANSWERED = [
    (["list"], ["zhang-gosselin-4dof", "passive-leg-4dof"]),
    (["new", "passive-leg-4dof"], ["[geometry]", 'base_radius        = "22 cm"']),
    (["schema", "machine"], ["json-schema.org", "platform_radius"]),
    (["check", MACHINE], ["The file has no mistake.", "geometry.base_radius", "220 mm", "-60 deg"]),
    (["check", "hexapod-cubic", "--set", "stiffness.actuator=45 N/um"], [" 6 x 45 N/µm ", "0 mm "]),
    (["check", "zhang-gosselin-2002"], ["Objective: minimise compliance sum", "geometry.base_radius", "260 mm"]),
    (["analyze", MACHINE], ["3628 ", "along x 1.058, y 1730, z 86.98 N/m", "leg 3 actuator", "rad/(N·m)"]),
    (["analyze", MACHINE, "--set", "stiffness.passive_links=rigid"], ["Rigid: passive link 1", "0.5164", "rigid"]),
    (["analyze", MACHINE, "--set", "stiffness.actuator.0=0"], ["Free: leg 1 actuator", "free"]),
    (["sweep", MACHINE, "--vary", "stiffness.passive_links=1e3:1e10:8:log"], ["7.407e6", "744"]),
    (["sweep", MACHINE, "--vary", "z=60 cm:200 cm:5"], ["2 of 5 points have no result (out of reach)"]),
    (
        ["map", MACHINE, "--over", "x=-2 cm:2 cm:3", "--over", "z=66 cm:70 cm:3"],
        ["compliance_rx", "x (3) × z (3)"],
    ),
    (["--version"], ["kinetostat 0."]),
    ([], ["commands:", "examples:"]),
]

REFUSED = [
    (["analyze"], ["MACHINE", "--help"]),
    (["analyse"], ["invalid choice: 'analyse'", "analyze"]),
    (["analyze", "nope"], ['"nope"', "zhang-gosselin-4dof"]),
    (["sweep", "hexapod", "--vary", "q=0:1:3"], ['"q" is not a field', "roll, pitch, yaw, and `kinetostat check`"]),
    (["sweep", MACHINE, "--vary", "x=0:1:3", "--quantity", "stifness_z"], ["did you mean stiffness_z?"]),
    (
        ["compare", "hexapod", "tripteron", "--over", "roll=0:1:3"],
        ['tripteron: "roll" is not a field', "its pose are x, y, z"],
    ),
    (["analyze", "zhang-gosselin-2002"], ['"zhang-gosselin-2002" is a study', "`kinetostat check`", "machine = ..."]),
    (["validate", "zhang-gosselin-2002"], ["is a study"]),
    (["optimize", "hexapod"], ['"hexapod" is a machine', "`kinetostat new study`"]),
    (["analyze", "zhang-gosselin-4dfo"], ['did you mean "zhang-gosselin-4dof"?']),
    (["analyze", MACHINE, "--set", "pose.x=2 kg"], ["pose.x", '"2 kg"', "length", '"12 cm"']),
    (["new", "hexapd"], ['"hexapd"', 'did you mean "hexapod"?']),
    (["sweep", MACHINE, "--vary", "passive_links=1:2:3"], ["geometry.passive_links or stiffness.passive_links"]),
    (["sweep", MACHINE, "--vary", "q=1:2:3"], ['"q" is not a field', "x, z, theta5"]),
    (["sweep", MACHINE, "--vary", "z=1:3"], ['"z=1:3" is not a range', "from:to:count"]),
    (["sweep", MACHINE, "--vary", "z=1:3:1"], ['count is "1"', "2 to"]),
    (["sweep", MACHINE, "--vary", "z=1:3:000000041999999999"], ['count is "000000041999999999"', "2 to"]),
    (["sweep", MACHINE, "--vary", "z=-1:3:5:log"], ["z", "above 0", "-1.0 m"]),
    (["sweep", MACHINE, "--vary", "z=1 kg:2 kg:3"], ["z", '"1 kg"', "length"]),
    (["sweep", MACHINE, "--vary", "geometry.base_radius=-1:2:3"], ["base_radius", "greater than 0"]),
    (["sweep", MACHINE, "--vary", "stiffness.actuator=1:rigid:3"], ["stiffness.actuator", "rigid"]),
    (["sweep", MACHINE, "--vary", "x=0:1:3", "--vary", "z=0:1:3"], ["one parameter", "map"]),
    (["map", MACHINE, "--over", "x=0:1:3"], ["two --over", "sweep"]),
    (["map", MACHINE, "--over", "x=0:1:3", "--over", "x=0:1:3"], ["pose.x is varied twice"]),
    (["map", MACHINE, "--over", "x=0:1:3000", "--over", "z=0:1:3000"], ["9,000,000", "lower the counts"]),
    (
        ["map", MACHINE, "--over", "x=0:1:3", "--over", "z=0:1:3", "--quantity", "q"],
        [
            '"q" is not a quantity; choose a group (compliance, stiffness,',
            "compliance_rx_z, or one of ",
        ],
    ),
    (["sweep", MACHINE, "--vary", "x=0:1:3", "--quantity", "compliance_x_ry"], ["did you mean compliance_ry_x?"]),
    (["sweep", MACHINE, "--vary", "x=0:1:3", "-o", "out/a.png"], ["a.png is the name of a file", '"-o out/a"']),
    (["drives", MACHINE, "-o", "first", "-o", "second"], ["given twice, as first and as second", "one folder"]),
]


@pytest.mark.parametrize(("arguments", "expected"), ANSWERED, ids=lambda part: " ".join(part)[:50])
def test_answers(arguments, expected, capsys):
    assert main(arguments) == DONE
    output = capsys.readouterr()
    assert output.err == ""
    for words in expected:
        assert words in output.out


@pytest.mark.parametrize("command", ["check", "analyze", "sweep", "map", "sensitivity", "guidelines", "compare"])
@pytest.mark.parametrize("name", ["Bad [/foo] name", "A [red]b[/red] [load] :smile:"])
def test_names_are_shown_as_they_are_written(command, name, tmp_path, capsys):
    file = tmp_path / "own.toml"
    file.write_text(bundled()["tripteron"].replace('name = "x"', 'name = "[x]"'))
    more = {
        "sweep": ["--vary", "pose.x=50:51 cm:2"],
        "map": ["--over", "pose.x=50:51 cm:2", "--over", "pose.y=50:51 cm:2"],
        "compare": [str(file)],
    }
    assert main([command, str(file), *more.get(command, []), "--set", f"name={name}"]) == DONE
    shown = " ".join(capsys.readouterr().out.split())
    assert name in shown
    assert "[x]" in shown or command in ("sweep", "map", "compare")


def test_the_wrong_kind_of_file_is_told_in_one_sentence(tmp_path, capsys):
    study, machine = tmp_path / "study.toml", tmp_path / "machine.toml"
    main(["new", "study"])
    study.write_text(capsys.readouterr().out)
    machine.write_text(bundled()["hexapod"])
    for command, file, kind in (("analyze", study, "is a study"), ("optimize", machine, "is a machine")):
        assert main([command, str(file)]) == BAD_INPUT
        message = capsys.readouterr().err
        assert f'"{file}" {kind}, but this command ' in message
        assert "missing" not in message
    assert main(["check", str(study), "--set", "variables.0.to=9 m"]) == DONE
    assert " 9000 mm " in capsys.readouterr().out
    assert main(["check", str(study), "--set", "objectives.0.quantity=stiff"]) == BAD_INPUT


def test_ctrl_c_is_an_exit_code_of_its_own(monkeypatch, capsys):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(analysis, "analyze", interrupt)
    assert main(["analyze", MACHINE]) == STOPPED == 128 + signal.SIGINT
    assert "stopped" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["--help"])
    assert f"{STOPPED} stopped by Ctrl-C" in " ".join(capsys.readouterr().out.split())


def test_help_lists_every_command_once_below_a_heading(capsys):
    main([])
    head, *groups = re.split(r"^ (\S.*):$", capsys.readouterr().out.partition("\ncommands:")[2], flags=re.MULTILINE)
    listed = [
        word
        for group in groups[1::2]
        for word in re.findall(r"^  (\w+)", group.partition("examples:")[0], re.MULTILINE)
    ]
    assert not head.strip()
    assert "other" not in groups
    assert len(listed) == len(set(listed))
    with pytest.raises(SystemExit):
        main(["no-command"])
    known = re.findall(r"'?([\w-]+)'?(?:, |\))", capsys.readouterr().err.partition("choose from ")[2])
    assert {*QUESTIONS, "doctor"} <= set(known) == set(listed)
    assert "drives" in groups[groups.index("under load and in motion") + 1]


@pytest.mark.parametrize("command", ["sweep", "map", "sensitivity"])
def test_help_names_every_quantity(command, capsys):
    with pytest.raises(SystemExit):
        main([command, "--help"])
    shown = " ".join(capsys.readouterr().out.split())
    grouped = {name for members in GROUPS.values() for name in members}
    single = {name for name, quantity in QUANTITIES.items() if not quantity.components} - grouped
    assert all(re.search(rf"\b{name}\b", shown) for name in {*GROUPS, *single})
    assert "repeatable" in shown


def test_our_own_brackets_are_shown(capsys):
    assert main(["check", MACHINE]) == DONE
    assert "[load]" in capsys.readouterr().out


@pytest.mark.parametrize(("arguments", "expected"), REFUSED, ids=lambda part: " ".join(part)[:50])
def test_bad_input_is_one_clear_paragraph(arguments, expected, capsys):
    try:
        code = main(arguments)
    except SystemExit as stop:
        code = stop.code
    output = capsys.readouterr()
    assert code == BAD_INPUT
    assert output.out == ""
    assert "Traceback" not in output.err
    assert output.err.count("\n") == 1
    for words in expected:
        assert words in output.err


@pytest.mark.parametrize(
    ("setting", "words"), [("pose.z=2 m", "at most 1360 mm"), ("pose.z=1.36 m", "passive leg lock up")]
)
def test_a_pose_without_answer_exits_1_and_says_why(setting, words, capsys):
    for command in ("analyze", "check"):
        assert main([command, MACHINE, "--set", setting]) == NO_ANSWER
        assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("settings", "status", "missing"),
    [
        ([], "ok", None),
        (["stiffness.passive_links=rigid"], "ok", "stiffness"),
        (["stiffness.actuator=0"], "ok", "compliance"),
        (["pose.z=2 m"], "out_of_reach", "compliance"),
    ],
)
def test_json_is_all_that_stdout_holds(settings, status, missing, capsys):
    overrides = [word for setting in settings for word in ("--set", setting)]
    main(["analyze", MACHINE, "--json", *overrides])
    output = capsys.readouterr()
    found = json.loads(output.out)
    assert output.err == ""
    assert found["status"] == status
    assert found["components"] == ["rx", "ry", "rz", "x", "y", "z"]
    if missing:
        assert found[missing] is None
    else:
        assert found["stiffness"][5][5] == pytest.approx(3628.31866241, rel=1e-11)
        assert found["rank"] == 6


def test_json_of_a_sweep_has_null_and_a_status_where_there_is_no_answer(capsys):
    assert main(["sweep", MACHINE, "--vary", "z=60 cm:200 cm:5", "--json"]) == DONE
    found = json.loads(capsys.readouterr().out)
    assert found["status"][-1] == "out_of_reach"
    assert found["variables"]["stiffness_z"]["values"][-1] is None
    assert found["coordinates"]["pose.z"]["units"] == "m"
    assert found["coordinates"]["pose.z"]["values"] == pytest.approx([0.6, 0.95, 1.3, 1.65, 2.0])


def test_a_sweep_without_any_answer_exits_1(capsys):
    assert main(["sweep", MACHINE, "--vary", "z=2 m:3 m:3"]) == NO_ANSWER
    assert "3 of 3 points have no result (out of reach)" in capsys.readouterr().out


def test_the_template_is_the_machine_it_was_made_from(tmp_path, capsys):
    main(["new", "passive-leg-4dof"])
    file = tmp_path / "mine.toml"
    file.write_text(capsys.readouterr().out)
    assert load(file) == load(MACHINE)


@pytest.mark.parametrize(("output", "words"), [("/proc/nowhere", "cannot be written"), ("file", "cannot be written")])
def test_an_unwritable_folder_is_bad_input(output, words, tmp_path, capsys):
    (tmp_path / "file").touch()
    folder = output if output.startswith("/") else str(tmp_path / output / "folder")
    assert main(["sweep", MACHINE, "--vary", "x=0:1 cm:3", "-o", folder]) == BAD_INPUT
    assert words in capsys.readouterr().err


def test_help_imports_no_heavy_library():
    script = (
        "import sys, kinetostat.cli\n"
        "try: kinetostat.cli.main(['--help'])\n"
        "except SystemExit: pass\n"
        "print('LOADED', sorted({name.split('.')[0] for name in sys.modules}))\n"
    )
    unkept = {**os.environ, VARIABLE: OFF}  # a program that is on disk needs no compiler
    output = subprocess.check_output([sys.executable, "-c", script], text=True, env=unkept)
    loaded = output.split("LOADED")[1]
    for heavy in ("jax", "numpy", "pint", "pydantic", "matplotlib", "rich", "xarray"):
        assert f"'{heavy}'" not in loaded


def test_the_list_says_what_the_files_say(capsys):
    """It reads no more than the top of each file, and takes nothing for granted of the rest."""
    main(["list"])
    printed = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    machines = {name: load(name) for name in bundled()}
    for name, machine in machines.items():
        assert f"{name} {machine.name} {machine.family.name}" in printed
    for name in bundled_studies():
        study = study_of(name)
        assert f"{name} {study.name} {study.machine}" in printed


def test_the_list_reads_no_file_as_a_whole():
    script = "import sys, kinetostat.cli\nkinetostat.cli.main(['list'])\nprint('LOADED', *sys.modules)\n"
    output = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert not {"pydantic", "kinetostat.spec.study", "kinetostat.kinematics"} & {*output.split("LOADED")[1].split()}


def test_an_old_name_is_told_in_a_sentence():
    words = ["sweep", "tripteron", "--vary", "x=50:51 cm:2", "--quantity", "regularity"]
    done = subprocess.run([sys.executable, "-m", "kinetostat", *words], capture_output=True, text=True, check=True)
    new = 'The quantity "regularity" is now called "singularity_margin". The old name will go in the next version.'
    assert done.stderr == f"kinetostat: {new}\n"


def test_the_package_runs_as_the_command(capsys):
    main(["--version"])
    ran = subprocess.run([sys.executable, "-m", "kinetostat", "--version"], capture_output=True, text=True, check=True)
    assert ran.stdout == capsys.readouterr().out


@pytest.mark.parametrize("command", ["analyze", "guidelines"])
def test_one_pose_needs_no_compiler_and_no_datasets(command):
    script = (
        "import sys, kinetostat.cli\n"
        f"kinetostat.cli.main(['{command}', '{MACHINE}'])\n"
        "print('LOADED', sorted({name.split('.')[0] for name in sys.modules}))\n"
    )
    unkept = {**os.environ, VARIABLE: OFF}  # a program that is on disk needs no compiler
    output = subprocess.check_output([sys.executable, "-c", script], text=True, env=unkept)
    loaded = output.split("LOADED")[1]
    for heavy in ("jax", "matplotlib", "xarray", "llvmlite", "pydantic"):
        assert f"'{heavy}'" not in loaded


def test_a_map_imports_no_array_library_that_xarray_finds():
    """Dask and pint take longer to import than the map to compute; with a rare unit, pint is there all the same."""
    map_of = [sys.executable, "-X", "importtime", "-m", "kinetostat", "map", "hexapod", "--over"]
    ranges = {"x=-2 cm:2 cm:3": set(), "x=-0.02 yard:0.02 yard:3": {"pint"}}
    for text, wanted in ranges.items():
        done = subprocess.run([*map_of, text, "--over", "y=-2 cm:2 cm:3"], capture_output=True, text=True, check=True)
        imported = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
        assert "xarray" in imported
        assert imported & {"dask", "dask.array", "pint"} == wanted


class Terminal(io.StringIO):
    """A terminal that tells when something has been written."""

    def __init__(self):
        super().__init__()
        self.written = threading.Event()

    def isatty(self):
        return True

    def write(self, text):
        size = super().write(text)
        self.written.set()
        return size


def terminals_of(monkeypatch):
    """Standard output and standard error, both terminals, and no patience for silence.

    No fixture: pytest takes both streams back between the fixtures and the test.
    """
    monkeypatch.setattr(silence, "SILENT_SECONDS", 0.0)
    monkeypatch.setattr(silence, "HEAD_START_SECONDS", 0.001)
    streams = Terminal(), Terminal()
    monkeypatch.setattr("sys.stdout", streams[0])
    monkeypatch.setattr("sys.stderr", streams[1])
    return streams


def test_silence_on_a_terminal_has_words_until_something_is_printed(monkeypatch):
    output, errors = terminals = terminals_of(monkeypatch)
    with silence.spoken_silence("looking") as watch:
        assert errors.written.wait(60)
        watch.say("fitting")
        errors.written.clear()
        print("kinetostat: a note", file=sys.stderr)
        while not errors.getvalue().endswith("fitting ..."):
            assert errors.written.wait(60)
            errors.written.clear()
        print("the result")
    assert (sys.stdout, sys.stderr) == terminals
    assert errors.getvalue() == (
        f"looking ...{CLEAR_LINE}fitting ...{CLEAR_LINE}kinetostat: a note\nfitting ...{CLEAR_LINE}"
    )
    assert output.getvalue() == "the result\n"


def test_a_command_says_what_it_does_and_clears_it_before_its_answer(monkeypatch):
    output, errors = terminals_of(monkeypatch)
    analyze = importlib.import_module("kinetostat.studies.analysis").analyze

    def slow(*arguments, **options):
        assert errors.written.wait(60)
        return analyze(*arguments, **options)

    monkeypatch.setattr("kinetostat.studies.analysis.analyze", slow)
    assert main(["check", "hexapod"]) == 0
    assert "computing; if the pose is out of reach" in errors.getvalue()
    assert errors.getvalue().endswith(CLEAR_LINE)
    assert "The file has no mistake" in output.getvalue()


def test_a_pipe_hears_no_words(monkeypatch, capsys):
    monkeypatch.setattr(silence, "SILENT_SECONDS", 0.0)
    with silence.spoken_silence("looking") as watch:
        assert watch is None
    assert capsys.readouterr().err == ""
