"""Time of loaded poses over that of unloaded ones, on the same poses and cores in one run. It prints Markdown.

Both take turns, so that a busy machine slows both; each counts by its best turn, in processor time of all cores.
Unloaded: diagonals of C and K. Loaded: at rest under gravity, displacement of the tool and tangent stiffness with all
other motions free, twelve numbers as well.

    python benchmarks/loaded.py > docs/measured/loaded.md
"""

import os
import platform
import time
from datetime import date

import numpy as np

from cases import CASES, TWELVE, Array
from kinetostat.algebra.screw import COMPONENTS
from kinetostat.engine.batch import available_cores, evaluate
from kinetostat.engine.points import PointTable
from kinetostat.machine.loading import load
from kinetostat.studies.diagnosis import processor

LOADED = (*(f"displacement_{c}" for c in COMPONENTS), *(f"tangent_free_stiffness_{c}" for c in COMPONENTS))
POSES, TURNS = 100_000, 6
RUNS = (
    *(("4-dof", mass) for mass in ("1 g", "5 g", "20 g")),
    *(("hexapod", mass) for mass in ("5 kg", "50 kg")),
    *(("tripteron", mass) for mass in ("5 kg", "50 kg")),
    *(("delta", mass) for mass in ("1 kg", "10 kg")),
)
"""Machines, and the mass of the tool; the links of the Tripteron weigh as its file says."""
DELTA = {"pose.x": (-0.1, 0.1), "pose.y": (-0.1, 0.1), "pose.z": (-0.8, -0.7)}
"""Ranges of the Delta's poses, m: it has no hand-written kernels, and is no `Case`."""


def main() -> None:
    """Print the table."""
    print(f"Measured on {date.today()}: {processor()}, {available_cores()} of {os.cpu_count()} cores; ", end="")
    print(f"Python {platform.python_version()}, NumPy {np.__version__}. {POSES:,} random poses, processor time.\n")
    print("| machine | mass | greatest sag | unloaded | loaded | ratio | first call | displacement alone |")
    print("|---|---|---|---|---|---|---|---|")
    for name, mass in RUNS:
        print(row(name, mass), flush=True)


def timed(name: str) -> tuple[str, str, dict[str, Array]]:
    """Title, bundled machine and random poses of a run."""
    if name in CASES:
        return CASES[name].title, CASES[name].machine, CASES[name].poses(POSES)
    random = np.random.default_rng(2002)
    return "A Delta", name, {path: random.uniform(low, high, POSES) for path, (low, high) in DELTA.items()}


def row(name: str, mass: str) -> str:
    """Time a machine under the weight of its platform."""
    title, machine_name, poses = timed(name)
    settings = [f"tool.mass={mass}", "load.gravity=[0, 0, -9.81]"]
    machine, points = load(machine_name, settings), PointTable(poses)
    best: dict[tuple[str, ...], float] = {}
    started = time.process_time()
    values = evaluate(machine, points, LOADED).values
    first = time.process_time() - started
    for turn in range(TURNS):
        for quantities in (TWELVE, LOADED, LOADED[:6]):
            started = time.process_time()
            evaluate(machine, points, quantities)
            taken = time.process_time() - started
            best[quantities] = min(taken, best.get(quantities, np.inf)) if turn else np.inf
    unloaded, loaded, moved = (best[quantities] for quantities in (TWELVE, LOADED, LOADED[:6]))
    sag = max(float(np.nanmax(np.abs(values[f"displacement_{c}"]))) for c in "xyz")
    return (
        f"| {title} | {mass} | {sag * 1e3:.2g} mm | {unloaded * 1e3:.3g} ms | {loaded * 1e3:.3g} ms "
        f"| {loaded / unloaded:.1f} | {first:.1f} s | {moved / unloaded:.1f} |"
    )


if __name__ == "__main__":
    main()
