"""Time of loaded poses over that of unloaded ones, on the same poses and cores in one run. It prints Markdown.

Both take turns, so that a busy machine slows both; each counts by its best turn, in processor time of all cores.
Unloaded: diagonals of C and K. Loaded: at rest under gravity, displacement of the tool and tangent stiffness with all
other motions free, twelve numbers as well. Instructions are counted by valgrind for the first mass of each machine.

    python benchmarks/loaded.py > docs/measured/loaded.md
"""

import sys
import time
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from cases import CASES, TWELVE, Array
from conditions import conditions
from instructions import compile_for_valgrind, count, per_pose
from kinetostat.algebra.screw import COMPONENTS
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine

LOADED = (*(f"displacement_{c}" for c in COMPONENTS), *(f"tangent_free_stiffness_{c}" for c in COMPONENTS))
POSES, TURNS = 100_000, 6
FEW, MORE = 3072, 6144
"""Poses at which instructions are counted."""
RUNS = (
    *(("4-dof", mass) for mass in ("1 g", "5 g", "20 g")),
    *(("hexapod", mass) for mass in ("5 kg", "50 kg")),
    *(("tripteron", mass) for mass in ("5 kg", "50 kg")),
    *(("delta", mass) for mass in ("1 kg", "10 kg")),
)
"""Machines, and the mass of the tool; the links of the Tripteron weigh as its file says."""
FIRST_RUNS = [run for number, run in enumerate(RUNS) if run[0] not in dict(RUNS[:number])]
COUNT = "--count"
DELTA = {"pose.x": (-0.1, 0.1), "pose.y": (-0.1, 0.1), "pose.z": (-0.8, -0.7)}
"""Ranges of the Delta's poses, m: it has no hand-written kernels, and is no `Case`."""


def main() -> None:
    """Print the table, or do once what is counted."""
    if COUNT in sys.argv:
        compile_for_valgrind()
        count(counted_tasks())
        return
    counts = per_pose([__file__, COUNT], FEW, MORE)
    print(f"{conditions()} {POSES:,} random poses, processor time.\n")
    print("| machine | mass | greatest sag | unloaded | loaded | ratio | first call | displacement alone ", end="")
    print("| instructions per pose: unloaded, loaded | ratio |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name, mass in RUNS:
        here = [counts.get(_label(name, mass, quantities)) for quantities in (TWELVE, LOADED)]
        counted_here = f"{here[0]:.0f}, {here[1]:.0f} | {here[1] / here[0]:.1f}" if here[0] and here[1] else " | "
        print(f"{row(name, mass)} {counted_here} |", flush=True)


def timed(name: str) -> tuple[str, str, dict[str, Array]]:
    """Title, bundled machine and random poses of a run."""
    if name in CASES:
        return CASES[name].title, CASES[name].machine, CASES[name].poses(POSES)
    random = np.random.default_rng(2002)
    return "A Delta", name, {path: random.uniform(low, high, POSES) for path, (low, high) in DELTA.items()}


def counted_tasks() -> dict[str, Callable[[], object]]:
    """Unloaded and loaded poses of the first run of each machine, for few poses and for more."""
    tasks: dict[str, Callable[[], object]] = {}
    for name, mass in FIRST_RUNS:
        machine, poses = hanging(name, mass)
        for number in (FEW, MORE):
            points = PointTable({path: column[:number] for path, column in poses.items()})
            for quantities in (TWELVE, LOADED):
                tasks[f"{_label(name, mass, quantities)}: {number}"] = partial(evaluate, machine, points, quantities)
    return tasks


def hanging(name: str, mass: str) -> tuple[Machine, dict[str, Array]]:
    """The machine of a run under gravity, with its poses."""
    _, machine, poses = timed(name)
    return load(machine, [f"tool.mass={mass}", "load.gravity=[0, 0, -9.81]"]), poses


def _label(name: str, mass: str, quantities: Sequence[str]) -> str:
    return f"{name}, {mass}, {quantities[0]}"


def row(name: str, mass: str) -> str:
    """Time a machine under the weight of its platform."""
    title, _, _ = timed(name)
    machine, poses = hanging(name, mass)
    points = PointTable(poses)
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
