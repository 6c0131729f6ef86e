"""Time of loaded poses over that of unloaded ones, on the same poses and cores in one run. It prints Markdown.

Both take turns, so that a busy machine slows both; each counts by its best turn. Unloaded: diagonals of C and K.
Loaded: at rest under gravity, displacement of the tool and tangent stiffness with all other motions free, twelve
numbers as well.

    python benchmarks/loaded.py > docs/measured/loaded.md
"""

import os
import platform
import time
from datetime import date

import numpy as np

from cases import CASES, TWELVE
from kinetostat.algebra.screw import COMPONENTS
from kinetostat.engine.batch import available_cores, evaluate
from kinetostat.engine.points import PointTable
from kinetostat.machine.loading import load
from kinetostat.studies.diagnosis import processor

LOADED = (*(f"displacement_{c}" for c in COMPONENTS), *(f"tangent_free_stiffness_{c}" for c in COMPONENTS))
POSES, TURNS = 100_000, 16
RUNS = (("4-dof", "1 g"), ("4-dof", "5 g"), ("4-dof", "20 g"), ("hexapod", "5 kg"), ("hexapod", "500 kg"))


def main() -> None:
    """Print the table."""
    print(f"Measured on {date.today()}: {processor()}, {available_cores()} of {os.cpu_count()} cores; ", end="")
    print(f"Python {platform.python_version()}, NumPy {np.__version__}. {POSES:,} random poses.\n")
    print("| machine | mass | greatest sag | unloaded | loaded | ratio | first call | displacement alone |")
    print("|---|---|---|---|---|---|---|---|")
    for name, mass in RUNS:
        print(row(name, mass), flush=True)


def row(name: str, mass: str) -> str:
    """Time a machine under the weight of its platform."""
    case = CASES[name]
    settings = [f"tool.mass={mass}", "load.gravity=[0, 0, -9.81]"]
    machine, points = load(case.machine, settings), PointTable(case.poses(POSES))
    best: dict[tuple[str, ...], float] = {}
    started = time.perf_counter()
    values = evaluate(machine, points, LOADED).values
    first = time.perf_counter() - started
    for turn in range(TURNS):
        for quantities in (TWELVE, LOADED, LOADED[:6]):
            started = time.perf_counter()
            evaluate(machine, points, quantities)
            taken = time.perf_counter() - started
            best[quantities] = min(taken, best.get(quantities, np.inf)) if turn else np.inf
    unloaded, loaded, moved = (best[quantities] for quantities in (TWELVE, LOADED, LOADED[:6]))
    sag = max(float(np.nanmax(np.abs(values[f"displacement_{c}"]))) for c in "xyz")
    return (
        f"| {case.title} | {mass} | {sag * 1e3:.2g} mm | {unloaded * 1e3:.3g} ms | {loaded * 1e3:.3g} ms "
        f"| {loaded / unloaded:.1f} | {first:.1f} s | {moved / unloaded:.1f} |"
    )


if __name__ == "__main__":
    main()
