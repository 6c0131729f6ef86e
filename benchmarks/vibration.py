"""Time of natural frequencies over that of the diagonals of C and K, on the same poses and cores in one run.

Both take turns, so that a busy machine slows both; each counts by its best turn, in processor time of all cores. It
prints Markdown.

    python benchmarks/vibration.py > docs/measured/vibration.md
"""

import time
from collections.abc import Sequence

import numpy as np

from cases import CASES, TWELVE, Array
from conditions import conditions
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import values

SIX = tuple(f"frequency_{number}" for number in range(1, 7))
BODY = ("tool.mass=0.5 kg", "tool.inertia=[0.003, 0.003, 0.005, 0, 0, 0]")
ROTORS = ("drives.rotor_inertia=2e-5", "drives.lead=10 mm", "drives.ratio=20")
POSES, TURNS = 100_000, 5
WHOLE, ALONE = "platform, links and rotors", "platform"
RUNS = (
    ("4-dof", ALONE, ()),
    ("hexapod", ALONE, ()),
    ("hexapod", WHOLE, ("linear_density.legs=2 kg/m", *ROTORS)),
    ("tripteron", WHOLE, ROTORS),
    ("delta", WHOLE, ("linear_density.arms=2 kg/m", "linear_density.bars=1 kg/m", *ROTORS[:1], *ROTORS[2:])),
    ("hexapod-rus", WHOLE, ("linear_density.cranks=2 kg/m", "linear_density.rods=1 kg/m", *ROTORS[:1], *ROTORS[2:])),
)
"""Machine, what is massive, and how that is set; the links of the Tripteron weigh as its file says."""
TITLES = {"delta": "A Delta", "hexapod-rus": "A hexapod with cranks, 6-RUS"}
"""Machines without hand-written kernels, which are no `Case`."""
AROUND = 0.05
"""Half of the range of their poses about that of the file, m and rad."""


def main() -> None:
    """Print the table."""
    print(f"{conditions()} {POSES:,} random poses, processor time of a pose.\n")
    print("| machine | massive | C and K | six frequencies | ratio | the lowest frequency | ratio | first call |")
    print("|---|---|---|---|---|---|---|---|")
    for name, massive, settings in RUNS:
        print(row(name, massive, settings), flush=True)


def row(name: str, massive: str, settings: Sequence[str]) -> str:
    """Time a machine at random poses."""
    case = CASES.get(name)
    machine = load(case.machine if case else name, [*BODY, *settings])
    points = PointTable(case.poses(POSES) if case else poses_near(machine))
    first = seconds(machine, points, SIX)
    best = np.full(3, np.inf)
    for _ in range(TURNS):
        best = np.minimum(best, [seconds(machine, points, quantities) for quantities in (TWELVE, SIX, SIX[:1])])
    plain, six, lowest = best / POSES * 1e6
    return (
        f"| {case.title if case else TITLES[name]} | {massive} | {plain:.3f} µs | {six:.2f} µs | {six / plain:.0f} "
        f"| {lowest:.2f} µs | {lowest / plain:.0f} | {first:.1f} s |"
    )


def poses_near(machine: Machine) -> dict[str, Array]:
    """Random poses about that of the file."""
    random = np.random.default_rng(2002)
    paths = {path: value for path, value in values(machine).items() if path.startswith("pose.")}
    return {path: value + random.uniform(-AROUND, AROUND, POSES) for path, value in paths.items()}


def seconds(machine: Machine, points: PointTable, quantities: Sequence[str]) -> float:
    """Processor time of all cores."""
    started = time.process_time()
    evaluate(machine, points, quantities)
    return time.process_time() - started


if __name__ == "__main__":
    main()
