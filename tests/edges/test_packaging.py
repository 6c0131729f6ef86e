"""What strangers get: the wheel, the source archive and the container image, as far as they can be seen without one."""

import json
import re
import shlex
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email.parser import Parser
from fnmatch import fnmatch
from pathlib import Path, PurePosixPath

import pytest

from kinetostat.cli import main
from kinetostat.commands.common import DONE

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
SOURCES = {str(p.relative_to(ROOT / "src")) for p in (ROOT / "src/kinetostat").rglob("*") if p.is_file()}
SOURCES = {name for name in SOURCES if "__pycache__" not in name}


def built(source, folder, kind):
    """The one file of a kind that the build backend makes of a folder."""
    call = [sys.executable, "-m", "hatchling", "build", "--target", kind, "--directory", str(folder)]
    subprocess.run(call, cwd=source, check=True, capture_output=True)
    (found,) = folder.iterdir()
    return found


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    with zipfile.ZipFile(built(ROOT, tmp_path_factory.mktemp("wheel"), "wheel")) as archive:
        yield archive


@pytest.fixture(scope="module")
def archived(tmp_path_factory):
    """Files of the source archive, without the folder that all of them lie in."""
    with tarfile.open(built(ROOT, tmp_path_factory.mktemp("sdist"), "sdist")) as archive:
        return {str(PurePosixPath(*PurePosixPath(name).parts[1:])) for name in archive.getnames()}


def of_the_wheel(wheel, ending):
    (name,) = (name for name in wheel.namelist() if name.endswith(ending))
    return wheel.read(name).decode()


def test_the_wheel_holds_the_package_and_nothing_else(wheel):
    names = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert names == SOURCES
    endings = {name.rpartition(".")[2] for name in names}
    assert endings >= {"py", "toml", "js", "css", "typed"}


def test_the_wheel_says_what_it_is(wheel):
    said = Parser().parsestr(of_the_wheel(wheel, ".dist-info/METADATA"))
    assert (said["License-Expression"], said["Requires-Python"]) == ("MIT", ">=3.11")
    assert set(said.get_all("Provides-Extra")) == set(PROJECT["optional-dependencies"])
    assert said["Description-Content-Type"] == "text/markdown"
    assert "MIT License" in of_the_wheel(wheel, "licenses/LICENSE")
    assert "kinetostat = kinetostat.__main__:main" in of_the_wheel(wheel, "entry_points.txt")


def test_the_source_archive_builds_and_tests(archived):
    tests = {str(path.relative_to(ROOT)) for path in (ROOT / "tests").rglob("*.py")}
    assert archived >= tests | {f"src/{name}" for name in SOURCES}
    assert archived >= {"pyproject.toml", "README.md", "LICENSE", "CHANGELOG.md", "PKG-INFO", "docs/install.md"}


def test_the_source_archive_holds_nothing_that_was_made_here(archived):
    junk = ("*__pycache__*", ".*_cache*", ".git/*", ".uv/*", ".venv/*", ".ci/*", "uv.lock", "dist/*", "reproduce/*")
    assert not {name for name in archived for pattern in junk if fnmatch(name, pattern)}


def instructions():
    """Instruction and arguments of every line of the Dockerfile; lines that go on are joined."""
    text = re.sub(r"\\\n", " ", (ROOT / "Dockerfile").read_text("utf-8"))
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    return [tuple(line.split(maxsplit=1)) for line in lines]


def arguments(name):
    return [rest for instruction, rest in instructions() if instruction == name]


def stages():
    """Instructions of each stage."""
    found = []
    for instruction, rest in instructions():
        if instruction == "FROM":
            found.append([])
        found[-1].append((instruction, rest))
    return found


def test_the_image_rests_on_a_pinned_slim_python():
    bases = {rest.split(maxsplit=1)[0] for rest in arguments("FROM")}
    (base,) = bases
    minor = re.fullmatch(r"python:3\.(\d+)-slim-[a-z]+", base)
    assert minor, base
    assert f"Programming Language :: Python :: 3.{minor[1]}" in PROJECT["classifiers"]


@pytest.mark.parametrize(("file", "extras"), [("pins.txt", ["studio"]), ("pins-all.txt", EXTRAS)])
def test_what_is_installed_is_pinned_by_hash(file, extras):
    """The hashes are those of the versions pinned for everybody; what core and extras ask for is among them."""
    text = (ROOT / file).read_text("utf-8")
    entries = re.split(r"\n(?=\w)", re.sub(r"^#.*\n", "", text, flags=re.MULTILINE))
    pinned = {re.match(r"([\w.-]+)==([^ ;]+)", entry).groups() for entry in entries}
    constraints = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["uv"]["constraint-dependencies"]
    assert pinned <= {tuple(line.partition(";")[0].strip().split("==")) for line in constraints}
    assert all(re.search(r"--hash=sha256:[0-9a-f]{64}", entry) for entry in entries)
    assert "://" not in text
    direct = [*PROJECT["dependencies"], *(line for extra in extras for line in EXTRAS[extra])]
    assert {re.match(r"[\w-]+", line)[0].lower() for line in direct} <= {name for name, _ in pinned}
    assert "--require-hashes --requirement /wheels/pins.txt" in arguments("RUN")[1]


def test_the_image_runs_without_rights():
    order = [instruction for instruction, _ in stages()[-1]]
    (user,) = arguments("USER")
    assert user not in {"root", "0"}
    assert f" {user} " in f"{' '.join(arguments('RUN'))} "
    assert order.index("USER") < order.index("ENTRYPOINT")
    assert not {"RUN", "ADD", "COPY"} & set(order[order.index("USER") :])


def test_the_image_serves_the_studio(monkeypatch):
    """Its command is a call that our own parser takes, and port, health and folder are the same everywhere."""
    from kinetostat.studio import serving

    calls = []
    monkeypatch.setattr(serving, "serve", lambda *given: calls.append(given))
    assert [*map(json.loads, arguments("ENTRYPOINT"))] == [["kinetostat"]]
    assert main(json.loads(arguments("CMD")[-1])) == DONE
    ((_, _, host, port, browser, state),) = calls
    assert (host, browser) == ("0.0.0.0", False)
    assert arguments("EXPOSE") == [str(port)]
    assert f"http://127.0.0.1:{port}/" in arguments("HEALTHCHECK")[0]
    assert arguments("VOLUME") == [str(state)] == arguments("WORKDIR")[-1:]
    assert f"127.0.0.1:{port}:{port}" in (ROOT / "docs/install.md").read_text("utf-8")


def test_what_the_image_is_built_from_is_enough(wheel, tmp_path):
    """The files that it copies make the same wheel, and the list of what is kept from it keeps none of them."""
    kept = [line for line in (ROOT / ".dockerignore").read_text("utf-8").splitlines() if line and line[0] != "#"]
    assert kept[0] == "*"
    copied = [name for rest in arguments("COPY") for name in shlex.split(rest)[:-1]]
    assert {f"!{name}" for name in copied} <= set(kept)
    for name in copied:
        (tmp_path / "source" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "source" / name).symlink_to(ROOT / name)
    (tmp_path / "wheels").mkdir()
    with zipfile.ZipFile(built(tmp_path / "source", tmp_path / "wheels", "wheel")) as again:
        assert again.namelist() == wheel.namelist()
