"""Poses per second of natural frequencies beside the diagonals of C and K, on the same poses and cores in one run.

All take turns, so that a busy machine slows all of them; each counts by its best turn. It prints Markdown.

    python benchmarks/vibration.py > docs/measured/vibration.md
"""

import time
from collections.abc import Sequence

import numpy as np

from cases import CASES, TWELVE
from conditions import conditions
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine

SIX = tuple(f"frequency_{number}" for number in range(1, 7))
BODY = ("tool.mass=0.5 kg", "tool.inertia=[0.003, 0.003, 0.005, 0, 0, 0]")
ROTORS = ("drives.rotor_inertia=2e-5", "drives.lead=10 mm", "drives.ratio=20")
COMPILED, TURNS = 200_000, 4
RUNS = (
    ("4-dof", (), COMPILED),
    ("hexapod", (), COMPILED),
    ("hexapod", ("linear_density.legs=2 kg/m", *ROTORS), COMPILED),
    ("tripteron", ROTORS, 2_000),
)
"""Case, what weighs something besides the platform, and how many poses."""


def main() -> None:
    """Print the table."""
    print(f"{conditions()}\n")
    print("| machine | massive | poses | frequencies, poses/s | of the rate of C and K | per second of one core |")
    print("|---|---|---|---|---|---|")
    for name, settings, count in RUNS:
        print(row(name, settings, count), flush=True)


def row(name: str, settings: Sequence[str], count: int) -> str:
    """Time a machine at random poses."""
    case = CASES[name]
    machine, points = load(case.machine, [*BODY, *settings]), PointTable(case.poses(count))
    plain, ringing = (timed(machine, points, quantities) for quantities in (TWELVE, SIX))
    for _ in range(TURNS):
        plain = np.minimum(plain, timed(machine, points, TWELVE))
        ringing = np.minimum(ringing, timed(machine, points, SIX))
    what = "platform, links and rotors" if settings else "platform"
    return (
        f"| {case.title} | {what} | {count:,} | {_rate(count / ringing[0])} | {plain[0] / ringing[0]:.3f} "
        f"| {_rate(count / ringing[1])} |"
    )


def timed(machine: Machine, points: PointTable, quantities: Sequence[str]) -> np.ndarray:
    """Seconds on the clock and of all cores."""
    started = time.perf_counter(), time.process_time()
    evaluate(machine, points, quantities)
    return np.array([time.perf_counter() - started[0], time.process_time() - started[1]])


def _rate(rate: float) -> str:
    return f"{rate / 1e6:.3g} million" if rate >= 1e5 else f"{rate:,.0f}"


if __name__ == "__main__":
    main()
