"""Whole processes, counted in instructions and as multiples of `import numpy`: what commands cost. It prints Markdown.

Counts are valgrind's (cachegrind), which differ by some 0.1 % from run to run, however busy the machine is. Bytecode
is there, and programs are compiled in the process: those of the cache may be for another processor than valgrind's.

    python benchmarks/start_up.py
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from tempfile import TemporaryDirectory

from kinetostat.engine.program_files import OFF, VARIABLE

VALGRIND = ("valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null")
MAP = ("map", "hexapod", "--over", "x=-2 cm:2 cm:11", "--over", "y=-2 cm:2 cm:11")
COMMANDS = (
    ("--help",),
    ("list",),
    ("analyze", "hexapod"),
    MAP,
    (*MAP, "-o", "map"),
    ("optimize", "zhang-gosselin-2002"),
)
REFERENCE = ("-c", "import numpy")


def instructions(words: Sequence[str]) -> int:
    """Instructions of a process of Python, after one that has written the bytecode of what it imports."""
    surroundings = {**os.environ, VARIABLE: OFF, "OPENBLAS_NUM_THREADS": "1"}
    surroundings.pop("PYTHONDONTWRITEBYTECODE", None)
    for start in ((), VALGRIND):
        with TemporaryDirectory() as folder:
            command = [*start, sys.executable, *words]
            done = subprocess.run(command, cwd=folder, env=surroundings, capture_output=True, text=True, check=True)
    counted = re.search(r"I +refs: +([\d,]+)", done.stderr)
    if counted is None:
        raise SystemExit("valgrind has counted nothing")
    return int(counted[1].replace(",", ""))


def main() -> None:
    """Print a row for each command."""
    if shutil.which(VALGRIND[0]) is None:
        raise SystemExit("This benchmark counts instructions with valgrind, which is not installed here.")
    reference = instructions(REFERENCE)
    print(f"`import numpy` takes {reference / 1e6:.0f} million instructions.\n")
    print("| command | million instructions | of `import numpy` |\n|---|---|---|")
    for words in COMMANDS:
        count = instructions(("-m", "kinetostat", *words))
        print(f"| `kinetostat {' '.join(words)}` | {count / 1e6:.0f} | {count / reference:.1f} |", flush=True)


if __name__ == "__main__":
    main()
