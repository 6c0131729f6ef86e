"""Hints name what works in the installation at hand: a clone with uv, an environment with pip, one without it."""

import sys
import sysconfig
from pathlib import Path

import pytest

from kinetostat.spec import installation
from kinetostat.spec.installation import as_typed, command, extra_command, install_command, start_command

NICEGUI = "'nicegui>=3.18'"


@pytest.fixture
def place(tmp_path, monkeypatch):
    """An environment in a folder, with its scripts, none of which is on the path of the shell."""
    scripts = tmp_path / ".venv" / "bin"
    scripts.mkdir(parents=True)
    for name in ("python", "kinetostat"):
        (scripts / name).touch(mode=0o755)
    paths = {"scripts": str(scripts), "stdlib": str(tmp_path)}
    monkeypatch.setattr(sysconfig, "get_path", paths.__getitem__)
    monkeypatch.setattr(sys, "prefix", str(scripts.parent))
    monkeypatch.setattr(sys, "executable", str(scripts / "python"))
    monkeypatch.setattr(installation, "source_tree", lambda: None)
    monkeypatch.setattr(installation, "find_spec", lambda _: None)
    monkeypatch.setattr(installation, "_is_installed", lambda _: False)
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.delenv("UV", raising=False)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def clone(place, monkeypatch):
    """A clone as the first command of the README leaves it."""
    (place / ".uv" / "bin").mkdir(parents=True)
    (place / ".uv" / "bin" / "uv").touch(mode=0o755)
    monkeypatch.setattr(installation, "source_tree", lambda: place)
    return place


def test_in_a_clone_uv_adds(clone):
    assert extra_command("studio") == ".uv/bin/uv sync --inexact --no-dev --extra studio"
    assert start_command("studio", "studio delta") == ".uv/bin/uv run --no-dev --extra studio kinetostat studio delta"
    assert install_command(["numpy>=2.1"], again=True) == ".uv/bin/uv sync --inexact --no-dev --reinstall-package numpy"


def test_from_another_folder_the_clone_is_named(clone, monkeypatch):
    (clone / "elsewhere").mkdir()
    assert " --project " not in extra_command("cad")
    monkeypatch.chdir("/")
    assert extra_command("cad").startswith(f"{str(clone)[1:]}/.uv/bin/uv sync --inexact --project {clone} ")


def test_with_pip_the_packages_themselves_are_named(place, monkeypatch):
    """No index has kinetostat, and the wheel may be gone."""
    monkeypatch.setattr(installation, "find_spec", lambda name: name == "pip")
    assert extra_command("studio") == f".venv/bin/python -m pip install {NICEGUI}"
    assert (
        start_command("studio", "studio") == f".venv/bin/python -m pip install {NICEGUI} && .venv/bin/kinetostat studio"
    )
    (place / "EXTERNALLY-MANAGED").touch()
    monkeypatch.setattr(sys, "base_prefix", sys.prefix)
    assert extra_command("studio") == f".venv/bin/python -m pip install --break-system-packages {NICEGUI}"


def test_without_pip_uv_installs(place):
    assert extra_command("studio") == f"uv pip install --python .venv/bin/python {NICEGUI}"


def test_the_command_is_the_word_or_its_path(place, monkeypatch):
    scripts = str(place / ".venv" / "bin")
    assert command() == ".venv/bin/kinetostat"
    monkeypatch.setenv("PATH", scripts)
    assert command() == "kinetostat"
    monkeypatch.setenv("UV_RUN_RECURSION_DEPTH", "1")
    assert command() == ".venv/bin/kinetostat", "uv run extends the path for this one command only"
    (Path(scripts) / "kinetostat").unlink()
    assert command() == ".venv/bin/python -m kinetostat"


def test_quoted_commands_are_written_as_they_are_typed(place):
    assert as_typed("see `kinetostat list`.") == "see `.venv/bin/kinetostat list`."
    assert as_typed("examples:\n  kinetostat doctor") == "examples:\n  .venv/bin/kinetostat doctor"
    assert as_typed("kinetostat computes") == "kinetostat computes"


def test_what_is_installed_is_only_started(place, monkeypatch):
    monkeypatch.setattr(installation, "_is_installed", lambda _: True)
    assert start_command("studio", "studio") == ".venv/bin/kinetostat studio"
