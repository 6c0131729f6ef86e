"""Kill long commands at random moments, damage what they left, and go on: the end must be what it would have been.

Each try runs in processes of its own, with other hash seeds, and compares all files of the folder byte for byte with
those of one that nothing disturbed.
"""

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from random import Random

from tables import MACHINE, POSE, good_table

MEASURED = "measured.csv"
POSES = "poses.csv"
"""Both are written beside the folder of a command."""
SEARCH = ["--set", "optimizer.population=8", "--set", "optimizer.generations=6"]
COMMANDS = {
    "search of a family": ["optimize", "zhang-gosselin-2002", *SEARCH, "-o", "."],
    "search leg by leg": ["optimize", "tripteron-weight", *SEARCH, "-o", "."],
    "front": ["pareto", "zhang-gosselin-front", *SEARCH, "-o", "."],
    "map": ["map", "zhang-gosselin-4dof", "--over", "x=-40 cm:40 cm:300", "--over", "z=40 cm:140 cm:300",
            "--over", "theta5=-70 deg:-50 deg:60", "--quantity", "compliance_x", "-o", "."],
    "map leg by leg": ["map", "tripteron", "--over", "x=20 cm:30 cm:180", "--over", "y=20 cm:30 cm:180",
                       "--over", "z=20 cm:30 cm:160", "--quantity", "compliance_x", "-o", "."],
    "workspace": ["workspace", "hexapod", "--set", "limits.longest_leg=20 cm", "--over", "x=-8 cm:8 cm:41",
                  "--over", "y=-8 cm:8 cm:41", "--over", "z=10 cm:25 cm:41", "-o", "."],
    "report": ["report", MACHINE, "--without", "validation", "-o", "report.html"],
    "path": ["path", MACHINE, f"../{POSES}", "-o", "path.csv", "-o", "path.nc", "-o", "path.svg"],
    "budget": ["budget", "hexapod", "--tolerance", "joints=0.05 mm", "--samples", "500000", "-o", "."],
    "identification": ["identify", MACHINE, f"../{MEASURED}", "--fit", "zeros", "--fit", "gains", "-o", "."],
}  # fmt: skip
"""Long commands; each runs in the folder that is compared, with what it measures beside it."""
TIMED = re.compile(rb'"(started|finished|seconds|duration|elapsed)[^"]*": [^,}\n]+')
"""What a file says of the time that its work took."""


def run(command: list[str], folder: Path, seed: int, wait: float | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command into a folder; kill it -9 after `wait` seconds where that is given."""
    line = [sys.executable, "-c", "import sys; from kinetostat.cli import main; sys.exit(main())"]
    folder.mkdir(exist_ok=True)
    measured = good_table()
    (folder.parent / MEASURED).write_text(measured)
    poses = [",".join(row.split(",")[: len(POSE)]) for row in measured.splitlines()]
    (folder.parent / POSES).write_text("\n".join(poses))
    environment = {**os.environ, "PYTHONHASHSEED": str(seed), "MPLBACKEND": "agg"}
    with subprocess.Popen(
        [*line, *command],
        env=environment, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    ) as process:  # fmt: skip
        if wait is not None:
            try:
                process.wait(wait)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
        out, errors = process.communicate()
    return subprocess.CompletedProcess(command, process.returncode, out, errors)


def undisturbed(name: str, folder: Path) -> tuple[Path, float]:
    """The folder of a command that nothing stopped, and how long it took, s."""
    start = time.monotonic()
    done = run(COMMANDS[name], folder / "whole", 0)
    if done.returncode != 0:
        raise RuntimeError(f"{name}: exit {done.returncode}: {done.stderr}")
    return folder / "whole", time.monotonic() - start


def contents(folder: Path) -> dict[str, list[bytes]]:
    """All files of a folder; a chunk that was damaged and computed again has its line at the end of the history."""
    files = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    files = {name: TIMED.sub(b"", data) for name, data in files.items() if not name.endswith(".lock")}
    return {name: sorted(data.split(b"\n")) if name == "history.jsonl" else [data] for name, data in files.items()}


def kill_and_resume(rng: Random, name: str, whole: Path, seconds: float) -> str | None:
    """Kill a command some times, damage a file perhaps, let it end, and compare; what is wrong, or None."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "killed"
        for _ in range(rng.choice((1, 1, 2, 4))):
            run(COMMANDS[name], folder, rng.randrange(9), rng.uniform(0.0, 1.1 * seconds))
        damage = harm(rng, folder) if rng.random() < 0.5 else "nothing"
        end = run(COMMANDS[name], folder, rng.randrange(9))
        if "Traceback" in end.stderr or end.returncode not in (0, 2):
            return f"{name}, damaged: {damage}: exit {end.returncode}: {end.stderr[-600:]}"
        if end.returncode == 2:
            clear = damage != "nothing" and end.stderr.count("\n") == 1
            return None if clear else f"{name}, damaged: {damage}: {end.stderr}"
        left = [path.name for path in folder.iterdir() if path.name.startswith(".") and path.suffix != ".lock"]
        if left:
            return f"{name}: litter is left: {left}"
        ours, theirs = contents(folder), contents(whole)
        other = sorted(file for file in ours.keys() | theirs.keys() if ours.get(file) != theirs.get(file))
        return f"{name}, damaged: {damage}: another result in {', '.join(other)}" if other else None


def harm(rng: Random, folder: Path) -> str:
    """Flip a bit of a file of a folder, cut it, empty it, or take it away; what was done."""
    files = [path for path in sorted(folder.iterdir()) if path.is_file()] if folder.exists() else []
    if not files:
        return "nothing"
    path, action = rng.choice(files), rng.choice(("flipped", "cut", "emptied", "removed"))
    data = bytearray(path.read_bytes())
    if action == "removed":
        path.unlink()
    elif action == "emptied" or not data:
        path.write_bytes(b"")
    elif action == "cut":
        path.write_bytes(data[: rng.randrange(len(data))])
    else:
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        path.write_bytes(data)
    return f"{path.name} {action}"
