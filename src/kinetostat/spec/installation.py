"""The installation at hand: how `kinetostat` is typed in it, and the commands that install what is missing.

No package index has kinetostat, so a hint must not say `pip install kinetostat`. There are three cases: a clone whose
environment uv keeps (`uv sync` installs into it), any other environment with pip, and one made by uv without pip. What
is asked of installed packages is imported where it is asked: most messages need none of it.
"""

import os
import re
import shlex
import shutil
import sys
import sysconfig
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

PACKAGE = "kinetostat"
QUOTED = re.compile(rf"(?m)(`|^ +){PACKAGE} (?=[a-z-])")
"""The command where a message quotes it, or where an example stands in a line of its own."""


def command() -> str:
    """Return what a user types in the shell for `kinetostat`: this word, or the path of the script."""
    script = Path(sysconfig.get_path("scripts"), PACKAGE)
    command = shutil.which(PACKAGE, path=_path_of_shell())
    if command and Path(command).resolve() == script.resolve():
        return PACKAGE
    return _short_path(script) if shutil.which(script) else f"{_python()} -m {PACKAGE}"


def as_typed(text: str) -> str:
    """Return a message or a help text in which every quoted command is written as it is typed in this installation."""
    name = command()
    return text if name == PACKAGE else QUOTED.sub(lambda quoted: f"{quoted[1]}{name} ", text)


def extra_command(extra: str) -> str:
    """Return the command that installs what an extra needs, for example "studio"."""
    clone = _clone_of_uv()
    return f"{clone} --extra {extra}" if clone else install_command(_requirements_of(extra))


def start_command(extra: str, words: str) -> str:
    """Return one command that starts `kinetostat` with these words, after installing an extra if that is missing."""
    if all(_is_installed(requirement) for requirement in _requirements_of(extra)):
        return f"{command()} {words}"
    clone = _clone_of_uv()
    if clone:
        return f"{clone.replace('sync --inexact', 'run')} --extra {extra} {PACKAGE} {words}"
    return f"{install_command(_requirements_of(extra))} && {command()} {words}"


def install_command(packages: Iterable[str], again: bool = False) -> str:
    """Return the command that installs packages; with `again`, it also replaces those that are installed but broken."""
    clone = _clone_of_uv()
    if clone:
        return clone + "".join(f" --reinstall-package {re.split('[<>=]', package)[0]}" for package in packages if again)
    names = " ".join(shlex.quote(_source_of_package() if package == PACKAGE else package) for package in packages)
    if find_spec("pip") is None:
        return f"{_uv() or 'uv'} pip install --python {_python()} {'--reinstall ' if again else ''}{names}"
    managed = sys.prefix == sys.base_prefix and Path(sysconfig.get_path("stdlib"), "EXTERNALLY-MANAGED").exists()
    options = ("--break-system-packages " if managed else "") + ("--force-reinstall " if again else "")
    return f"{_python()} -m pip install {options}{names}"


def source_tree() -> Path | None:
    """Return the clone from which this package runs; None if the package was copied into an environment."""
    root = Path(__file__).parents[3]
    return root if (root / "pyproject.toml").exists() else None


def _clone_of_uv() -> str:
    """Return the beginning of `uv sync` if this is the environment of a clone that uv keeps, else an empty text."""
    root, uv = source_tree(), _uv()
    if root is None or not uv or Path(sys.prefix).resolve() != (root / ".venv").resolve():
        return ""
    project = "" if Path.cwd().is_relative_to(root) else f" --project {shlex.quote(str(root))}"
    return f"{uv} sync --inexact{project} --no-dev"


def _uv() -> str | None:
    root = source_tree()
    clone_uv = root / ".uv" / "bin" / "uv" if root else None
    path = str(clone_uv) if clone_uv and clone_uv.exists() else os.environ.get("UV") or shutil.which("uv")
    return _short_path(Path(path)) if path and shutil.which(path) else None


def _requirements_of(extra: str) -> list[str]:
    """Return the requirements of an extra, such as "nicegui>=3.18"; without metadata, kinetostat with its extra."""
    from importlib.metadata import PackageNotFoundError, requires

    try:
        texts = requires(PACKAGE) or []
    except PackageNotFoundError:
        return [f"{_source_of_package()}[{extra}]"]
    marked = re.compile(rf"""extra\s*==\s*["']{extra}["']""")
    return [text.partition(";")[0].strip() for text in texts if marked.search(text)]


def _is_installed(requirement: str) -> bool:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return bool(version(re.split(r"[<>=!~ \[]", requirement)[0]))
    except PackageNotFoundError:
        return False


def _source_of_package() -> str:
    """Return the path from which kinetostat was installed; the name of its wheel if that is unknown or gone."""
    import json
    from importlib.metadata import PackageNotFoundError, distribution

    root = source_tree()
    if root is not None:
        return str(root)
    try:
        installed = distribution(PACKAGE)
    except PackageNotFoundError:
        return f"{PACKAGE}.whl"
    origin = json.loads(installed.read_text("direct_url.json") or "{}").get("url", "")
    path = Path(origin.removeprefix("file://"))
    is_folder_or_file = origin.startswith("file://") and path.exists()
    return str(path) if is_folder_or_file else f"{PACKAGE}-{installed.version}-py3-none-any.whl"


def _python() -> str:
    python = shutil.which("python", path=_path_of_shell())
    return (
        "python" if python and Path(python).parent == Path(sys.executable).parent else _short_path(Path(sys.executable))
    )


def _path_of_shell() -> str:
    """Return PATH as the user's shell has it: `uv run` puts the folder of scripts in front of it."""
    folders = os.environ.get("PATH", os.defpath).split(os.pathsep)
    scripts = sysconfig.get_path("scripts")
    if "UV_RUN_RECURSION_DEPTH" in os.environ and scripts in folders:
        folders.remove(scripts)
    return os.pathsep.join(folders)


def _short_path(path: Path) -> str:
    """Return a path relative to the present folder if it lies below it, else the whole path, quoted for a shell."""
    folder = Path.cwd()
    return shlex.quote(str(path.relative_to(folder) if path.is_relative_to(folder) else path))
