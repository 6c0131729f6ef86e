"""What an installation weighs: the core by package, then what every extra adds. The figures of docs/install.md.

Run `python benchmarks/installed_sizes.py`; it prints Markdown. Each measure installs the wheel into an environment of
its own by uv, with the versions that pyproject.toml pins, and adds up the files that packages say are theirs.
"""

import json
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
SHOWN = 5.0
"""MB from which a package of the core has a row of its own."""
MEASURE = """
import json, os
from importlib.metadata import distributions
sizes = {}
for one in distributions():
    paths = (str(one.locate_file(file)) for file in one.files or () if file.suffix != ".pyc")
    sizes[one.name] = sum(os.path.getsize(path) for path in paths if os.path.exists(path)) / 1e6
print(json.dumps(sizes))
"""


def sizes(wheel: Path, extra: str, folder: Path) -> dict[str, float]:
    """MB of every package, by name, where the wheel is installed with an extra, or with none."""
    place = folder / (extra or "core")
    python = place / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    wanted = f"{wheel}[{extra}]" if extra else str(wheel)
    _uv("venv", "-q", "--no-project", "--python", sys.executable, str(place))
    _uv("pip", "install", "-q", "--python", str(place), wanted)
    found = subprocess.run([str(python), "-c", MEASURE], check=True, capture_output=True, text=True)
    return json.loads(found.stdout)


def _uv(*arguments: str) -> None:
    local = ROOT / ".uv" / "bin" / "uv"
    subprocess.run([str(local) if local.exists() else "uv", *arguments], cwd=ROOT, check=True)


def main() -> None:
    """Build the wheel, install it again and again, and print the tables."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _uv("build", "-q", "--wheel", "--out-dir", str(folder / "dist"))
        (wheel,) = (folder / "dist").glob("*.whl")
        core = sizes(wheel, "", folder)
        print("| package | MB |\n|---|---|")
        for package, size in sorted(core.items(), key=lambda item: -item[1]):
            if size >= SHOWN or package == "kinetostat":
                print(f"| {package} | {size:.0f} |")
        print(f"| all {len(core)} | {sum(core.values()):.0f} |\n\n| extra | adds packages | adds MB |\n|---|---|---|")
        for extra in sorted(extras):
            more = {package: size for package, size in sizes(wheel, extra, folder).items() if package not in core}
            print(f"| `{extra}` | {len(more)} | {sum(more.values()):.0f} |")


if __name__ == "__main__":
    main()
