"""Maps of what drives can do, in poses per second of the processor, beside linear programmes of single directions.

A programme (HiGHS, by SciPy) finds how far a wrench may grow along one direction at one pose, from the joints of the
legs alone; a quantity answers for all directions. Both take turns; each counts by its best turn. It prints Markdown.

    python benchmarks/capability.py > docs/measured/capability.md
"""

import os
import platform
import sys
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path

import numpy as np
import scipy

ROOT = Path(__file__).parent.parent
sys.path.append(str(ROOT / "tests"))
import kinetostat  # noqa: E402
from driven_sets import MACHINES, greatest_wrench, massive, poses  # noqa: E402  (of the tests)
from kinetostat.studies.diagnosis import processor  # noqa: E402

POSES, PROGRAMMES, TURNS, REACH = 200_000, 20, 3, 0.01
QUANTITIES = ("least_wrench_force", "least_twist_speed", "least_acceleration")


def map_seconds(function: Callable[..., object], columns: list[np.ndarray]) -> float:
    """Seconds of the processor for all poses; the least of some turns, of which the first compiles."""
    best = np.inf
    for _ in range(TURNS + 1):
        begin = time.process_time()
        function(*columns)
        best = min(best, time.process_time() - begin)
    return best


def programme_seconds(machine: kinetostat.Machine) -> float:
    """Seconds of the processor for a linear programme; the mean over some poses."""
    responses, rng = list(poses(machine, PROGRAMMES)), np.random.default_rng(0)
    direction = np.zeros(6)
    direction[3:5] = rng.normal(size=2)
    begin = time.process_time()
    for response in responses:
        greatest_wrench(response, direction)
    return (time.process_time() - begin) / PROGRAMMES


def main() -> None:
    """Print the table."""
    print(f"Measured on {date.today()}: {processor()}, one of {os.cpu_count()} cores; ", end="")
    print(f"Python {platform.python_version()}, SciPy {scipy.__version__}; processor time.\n")
    heads = [f"`{name}`, poses/s" for name in QUANTITIES]
    print(f"| machine | drives | {' | '.join(heads)} | linear programmes/s |")
    print("|---|---|" + "---|" * (len(heads) + 1))
    for name, make in MACHINES.items():
        machine = massive(make())
        table, rng = machine.tables["pose"], np.random.default_rng(1)
        known = {field: getattr(table, field) for field in vars(table) if isinstance(getattr(table, field), float)}
        columns = [here + REACH * rng.uniform(-1.0, 1.0, POSES) for here in known.values()]
        rates = [POSES / map_seconds(kinetostat.compile(machine, [*known], q), columns) for q in QUANTITIES]
        drives = len(next(poses(machine, 1)).drives)
        shown = " | ".join(f"{rate:,.0f}" for rate in rates)
        print(f"| {name} | {drives} | {shown} | {1.0 / programme_seconds(machine):,.0f} |", flush=True)


if __name__ == "__main__":
    main()
