"""Nothing that is printed or written depends on the order in which Python's sets give what they hold.

That order changes from process to process, so each test asks several processes, each with another seed of the hash.
"""

import os
import subprocess
import sys

SEEDS = ("0", "1")

ANSWERS = """
import hashlib, sys
from pathlib import Path
from kinetostat.cli import main
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.loading import as_toml
print([hashlib.sha256(as_toml(machine).encode()).hexdigest() for machine in map(load, bundled())])
for command in {commands}:
    assert main(command) == 0
print([hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(Path().iterdir())])
"""
COMMANDS = [
    ["analyze", "tripteron"],
    ["guidelines", "tripteron"],
    ["export", "tripteron", "--to", "netcdf", "-o", "tripteron.nc"],
    ["export", "tripteron", "--to", "urdf", "-o", "tripteron.urdf"],
]
QUICK = ("optimizer.population=8", "optimizer.generations=1")


def processes(code, folder, *arguments):
    """What the same program prints in one process for each seed, each in a folder of its own."""
    for seed in SEEDS:
        (folder / seed).mkdir(exist_ok=True)
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        run = [sys.executable, "-c", code, *arguments]
        yield subprocess.run(run, cwd=folder / seed, env=environment, capture_output=True, text=True, check=True).stdout


def test_answers_and_files_are_the_same_in_every_process(tmp_path):
    code = ANSWERS.format(commands=COMMANDS)
    first, *others = processes(code, tmp_path)
    assert first.count("\n") > 50
    assert others == [first] * len(others)


def test_a_search_of_a_machine_written_leg_by_leg_goes_on_in_another_process(tmp_path):
    code = "import sys; from kinetostat.cli import main; sys.exit(main(sys.argv[1:]))"
    settings = [part for setting in QUICK for part in ("--set", setting)]
    command = ["optimize", "tripteron-weight", *settings, "-o", str(tmp_path / "search"), "--json"]
    first, *others = processes(code, tmp_path, *command)
    assert others == [first] * len(others)
