"""`kinetostat doctor`: what it finds in a sound installation, and what it says where something is broken."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from kinetostat.cli import main
from kinetostat.commands.common import DONE, NO_ANSWER
from kinetostat.commands.doctor import _program_folder, print_checks
from kinetostat.engine import program_files
from kinetostat.spec.installation import extra_command, install_command
from kinetostat.studies import diagnosis, printed_numbers, self_test
from kinetostat.studies.diagnosis import InstallationCheck, Soundness, UnsoundError
from kinetostat.studies.printed_numbers import table_3


def test_a_sound_installation(capsys, monkeypatch):
    monkeypatch.setenv(program_files.VARIABLE, program_files.OFF)
    assert main(["doctor", "--json"]) == DONE
    found = json.loads(capsys.readouterr().out)
    assert found["healthy"] is True
    assert found["software"]["numpy"]["detail"] == np.__version__
    assert set(found["extras"]) >= {"studio", "validate", "cluster"}
    assert found["machine"]["vectors"]["detail"][0] in "248"
    assert "49 of 55" in found["self-test"]["paper"]["detail"]
    assert "1.017889" in found["self-test"]["search"]["detail"]
    assert {check["state"] for check in found["self-test"].values()} == {"sound"}
    assert {"machine code", "throughput", "files", "pictures"} < set(found["self-test"])
    assert "none" in found["places"]["cache"]["detail"]


def shown(*checks: InstallationCheck) -> str:
    console = Console(width=80, file=StringIO())
    print_checks(console, checks)
    return console.file.getvalue()


def test_on_a_terminal():
    absent = InstallationCheck(
        "extras", "studio", Soundness.ABSENT, "not installed (nicegui)", "pip install 'kinetostat[studio]'"
    )
    text = shown(InstallationCheck("software", "numpy", Soundness.SOUND, "2.4.6"), absent)
    assert "Software\n✓  numpy           2.4.6" in text
    assert "\nExtras\n–  studio          not installed (nicegui)" in text
    assert "→ pip install 'kinetostat[studio]'" in text
    assert text.rstrip().splitlines()[-1].startswith("Sound.")


def test_a_failure_on_a_terminal():
    text = shown(
        InstallationCheck("software", "numpy", Soundness.FAILED, "is not installed", "pip install 'numpy>=2.1'")
    )
    assert "✗  numpy           is not installed" in text
    assert "→ pip install 'numpy>=2.1'" in text
    assert text.rstrip().endswith("To repair: numpy.")


def installed_but(**changed):
    def versions(name):
        found = changed.get(name, version(name) if name not in changed else None)
        if found is None:
            raise PackageNotFoundError(name)
        return found

    return versions


def test_a_package_that_is_missing(monkeypatch, capsys):
    monkeypatch.setattr(self_test, "checks", lambda: iter(()))
    monkeypatch.setattr(diagnosis, "version", installed_but(scipy=None))
    assert main(["doctor"]) == NO_ANSWER
    text = capsys.readouterr().out
    assert "✗  scipy           is not installed" in text
    assert f"→ {install_command(['scipy>=1.15'])}" in " ".join(text.split())
    assert "To repair: scipy." in text


def test_a_package_that_is_too_old(monkeypatch):
    monkeypatch.setattr(diagnosis, "version", installed_but(numpy="1.26.4"))
    numpy = next(check for check in diagnosis.software_checks() if check.name == "numpy")
    assert (numpy.state, numpy.fix) == (Soundness.FAILED, install_command(["numpy>=2.1"]))
    assert numpy.detail == "1.26.4 is installed, but >=2.1 is needed"


def test_every_package_of_the_core_is_loaded():
    assert set(diagnosis.LOADED_MODULES) == {requirement.name for requirement in diagnosis.requirements()}


def test_an_extra_that_is_missing_is_no_failure(monkeypatch):
    monkeypatch.setattr(diagnosis, "version", installed_but(nicegui=None))
    found = list(diagnosis.software_checks())
    studio = next(check for check in found if check.name == "studio")
    assert (studio.state, studio.fix) == (Soundness.ABSENT, extra_command("studio"))
    assert diagnosis.healthy(found)


def test_not_installed_at_all(monkeypatch):
    monkeypatch.setattr(diagnosis, "version", installed_but(kinetostat=None))
    (only,) = diagnosis.software_checks()
    assert only.state is Soundness.FAILED
    assert only.fix == install_command(["kinetostat"])


def one_digit_off():
    first, *others = table_3()
    return [replace(first, verdict=self_test.PrintVerdict.DIFFERS, computed=0.5), *others]


def slightly_wrong(evaluate):
    def found(*given, **options):
        answer = evaluate(*given, **options)
        answer.values["stiffness_z"] *= 1.0 + 1e-6
        return answer

    return found


def test_wrong_numbers_are_found(monkeypatch):
    monkeypatch.setattr(self_test, "table_3", one_digit_off)
    monkeypatch.setattr(self_test, "evaluate", slightly_wrong(self_test.evaluate))
    monkeypatch.setattr(printed_numbers, "OPTIMISED_SUM", "1.0178")
    monkeypatch.setattr(self_test, "write_dataset", lambda path, grid: (2.0 * grid).to_netcdf(path, engine="h5netcdf"))
    found = {check.name: check for check in self_test.checks()}
    assert "Table III, row 1, rx: 0.5 for 0.52371" in found["paper"].detail
    assert "1.0e-06" in found["machine code"].detail
    assert "1.0178894" in found["search"].detail
    assert "differs when it is read again" in found["files"].detail
    failed = {name for name, check in found.items() if check.state is Soundness.FAILED and check.fix}
    assert failed == {"paper", "machine code", "search", "files"}


def test_the_folder_of_programs_is_shown_and_one_that_others_may_use_is_a_fault(tmp_path, monkeypatch):
    folder = tmp_path / "programs"
    monkeypatch.setenv(program_files.VARIABLE, str(folder))
    assert _program_folder() == f"{folder}: compiled programs (none yet)"
    program_files.write_program("a recipe", bytes(200_000))
    assert _program_folder() == f"{folder}: 0.2 MB of compiled programs"
    folder.chmod(0o755)
    with pytest.raises(UnsoundError, match="chmod 700"):
        _program_folder()


def test_a_broken_library_hides_nothing_else(tmp_path):
    """NumPy that cannot be imported: everything is still said, in words, and nothing is a traceback."""
    (tmp_path / "numpy.py").write_text('raise ImportError("wrong processor")\n')
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from kinetostat.cli import main; exit(main(['doctor']))"
    unkept = {**os.environ, program_files.VARIABLE: program_files.OFF}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=unkept)
    assert (done.returncode, done.stderr) == (NO_ANSWER, "")
    said = " ".join(done.stdout.split())
    assert "✗ numpy" in said
    assert f"{version('numpy')} is installed, but does not load: wrong processor" in said
    assert "✓ packaging" in said
    assert "✗  vectors         ImportError: wrong processor" in done.stdout
    assert "✗  self-test       cannot be looked at, ImportError: wrong processor" in done.stdout
    assert install_command(["kinetostat"], again=True) in said
    assert "none: compiled programs" in done.stdout
