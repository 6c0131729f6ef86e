"""Few poses beside many, and what a program costs: made, taken from the disk, remembered. It prints Markdown.

Times are those of the processor, so that a busy machine changes them little; each is the best of some turns.

    python benchmarks/sizes.py > docs/measured/sizes.md
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from conditions import conditions
from kinetostat.engine.batch import evaluate, function_of
from kinetostat.engine.kernel import program_of
from kinetostat.engine.points import PointTable
from kinetostat.engine.program_files import VARIABLE
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import values
from kinetostat.studies.evaluation import compile as function_from

MACHINES = ("zhang-gosselin-4dof", "hexapod", "tripteron", "hexapod-hardware")
QUANTITIES = tuple(f"stiffness_{name}" for name in ("rx", "ry", "rz", "x", "y", "z"))
SIZES = (1, 100, 10_000, 30_000)
TURNS, REACH = 7, 1e-3
NEW_PROCESS = """
import sys, time
import numpy as np
from kinetostat.machine.loading import load
from kinetostat.studies.evaluation import compile as function_from
machine = load(sys.argv[1])
x, z = (np.full(10_000, getattr(machine.tables["pose"], name)) for name in "xz")
started = time.process_time()
function_from(machine, ["x", "z"], {quantities!r})(x, z)
print(time.process_time() - started)
"""


def main() -> None:
    """Print both tables."""
    print(f"{conditions()} Six quantities each; times of the processor.\n")
    with TemporaryDirectory() as folder:
        os.environ[VARIABLE] = f"{folder}/programs"
        programs = [program_row(name) for name in MACHINES]
        print("| program | made | from the disk | of making | remembered | new process: function and 10,000 poses |")
        print("|---|---|---|---|---|---|", *programs, sep="\n", flush=True)
        head = " | ".join(f"`evaluate`, {count:,}" for count in SIZES)
        print(f"\n| poses | on buffers, 1 | function, 1 | {head} |\n|---|---|---|{'---|' * len(SIZES)}")
        for name in MACHINES:
            print(poses_row(name), flush=True)


def program_row(name: str) -> str:
    """Make a program, take it from the disk, remember it."""
    machine = load(name)
    paths = ("pose.x", "pose.z")

    def forget() -> None:
        program_of.cache_clear()
        function_of(load(name), paths, QUANTITIES)

    function_of(machine, paths, QUANTITIES)  # LLVM is loaded
    os.environ[VARIABLE], folder = "off", os.environ[VARIABLE]
    made = seconds(forget, 3)
    os.environ[VARIABLE] = folder
    stored, without = seconds(forget), seconds(lambda: function_of(load(name), paths, QUANTITIES))
    remembered = seconds(lambda: function_of(machine, paths, QUANTITIES), 1000)
    code = NEW_PROCESS.format(quantities=QUANTITIES)
    fresh = min(float(subprocess.check_output([sys.executable, "-c", code, name], text=True)) for _ in range(TURNS))
    made, stored = made - without, stored - without
    return (
        f"| {machine.name} | {1e3 * made:.0f} ms | {1e3 * stored:.2f} ms | 1/{made / stored:.0f} "
        f"| {1e6 * remembered:.1f} us | {1e3 * fresh:.0f} ms |"
    )


def poses_row(name: str) -> str:
    """Evaluate few poses and many."""
    machine = load(name)
    function = function_from(machine, ["x", "z"], QUANTITIES)
    here = [values(machine)[path] for path in ("pose.x", "pose.z")]
    times = [seconds(function.buffers(1), 2000), seconds(lambda: function(*here), 200)]
    for count in SIZES:
        points = points_around(machine, count)
        times.append(seconds(lambda points=points: evaluate(machine, points, QUANTITIES), max(1, 1000 // count)))
    return f"| {machine.name} | {' | '.join(map(shown, times))} |"


def points_around(machine: Machine, count: int) -> PointTable:
    """Random poses near the machine's own."""
    source = np.random.default_rng(0)
    known = values(machine)
    return PointTable({path: known[path] + REACH * source.uniform(-1, 1, count) for path in ("pose.x", "pose.z")})


def seconds(task: Callable[[], Any], times: int = 10) -> float:
    """The least time of one run, over several turns of some runs each."""
    turns: Sequence[float] = []
    for _ in range(TURNS):
        started = time.process_time()
        for _ in range(times):
            task()
        turns = [*turns, (time.process_time() - started) / times]
    return min(turns)


def shown(time_taken: float) -> str:
    """A time as people read it."""
    return f"{1e6 * time_taken:.3g} us" if time_taken < 1e-3 else f"{1e3 * time_taken:.3g} ms"


if __name__ == "__main__":
    main()
