"""Poses per second of three machines: kinetostat beside batched NumPy, hand-written C++ and PyNite, in one run.

It prints Markdown, the tables of `docs/performance.md`. Every route but PyNite's uses all cores, and the routes take
turns, so that a busy machine slows all of them; each counts by its best turn.

    python benchmarks/throughput.py > docs/measured/throughput.md
"""

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from datetime import date
from pathlib import Path

import numpy as np

from cases import CASES, TWELVE, Case
from kinetostat.engine.batch import available_cores, evaluate
from kinetostat.engine.points import PointTable
from kinetostat.machine.loading import load
from kinetostat.studies.diagnosis import processor
from routes import DIAGONAL_OF_C, TWELVE_OUTPUTS, Array, Route, routes_of

SIZES = (1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000)


def print_routes(case: Case, count: int, turns: int, folder: Path) -> None:
    """Time the routes of a case in turns and print the table."""
    routes = routes_of(case, case.poses(count), folder)
    for turn in range(turns):
        for route in routes:
            if turn == 0 or route.count > 1:
                route.turn()
    ours = routes[0].run()
    numpy_rate = next(route.rate for route in routes if "NumPy" in route.name)
    print(f"\n## {case.title}\n")
    print(f"{count:,} random poses, a status for each.\n")
    print("| route | computes | poses/s | times NumPy | of the fastest C++ | ready after | difference |")
    print("|---|---|---|---|---|---|---|")
    for route in routes:
        rivals = [other.rate for other in routes if other.name.startswith("C++") and other.task == route.task]
        share = f"{route.rate / max(rivals):.2f}" if rivals else ""
        prepared = f"{route.prepared:.2f} s" if route.prepared else ""
        print(
            f"| {route.name} | {route.task} | {_rate(route.rate)} | {route.rate / numpy_rate:.3g} | {share} "
            f"| {prepared} | {difference(route, ours)} |"
        )


def difference(route: Route, twelve: Sequence[Array]) -> str:
    """Largest relative difference from evaluate(), where the route gives the same numbers."""
    found = route.run()
    if route.name == "kinetostat" and route.task == TWELVE_OUTPUTS:
        return ""
    expected = {TWELVE_OUTPUTS: twelve, DIAGONAL_OF_C: twelve[:6]}.get(route.task, [np.sum(twelve[:6], axis=0)])
    pairs = zip(found, expected, strict=True)
    return f"{max(float(np.abs(a / b[: len(a)] - 1.0).max()) for a, b in pairs):.0e}"


def print_sizes(name: str, sizes: Sequence[int]) -> None:
    """Cost against batch size, each in a process of its own, so that its peak of memory is its own."""
    print("\nAgainst the size of the batch, twelve outputs; each size in a process of its own:\n")
    print("| poses | first call | later calls | per pose | peak memory of the process |")
    print("|---|---|---|---|---|")
    for size in sizes:
        command = [sys.executable, __file__, "--one", name, str(size)]
        told = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        print(
            f"| {size:,} | {_time(told['first'])} | {_time(told['later'])} | {_time(told['later'] / size)} "
            f"| {told['peak'] / 1e6:,.0f} MB |"
        )


def _rate(rate: float) -> str:
    return f"{rate / 1e6:.3g} million" if rate >= 1e4 else f"{rate:.2g}"


def _time(seconds: float) -> str:
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def one(name: str, size: int) -> None:
    """Evaluate one batch a few times and print what it took: the child of `print_sizes`."""
    case = CASES[name]
    machine, points = load(case.machine), PointTable(case.poses(size))
    taken = []
    for _ in range(4 if size <= 1_000_000 else 2):
        started = time.perf_counter()
        evaluate(machine, points, TWELVE)
        taken.append(time.perf_counter() - started)
    print(json.dumps({"first": taken[0], "later": min(taken[1:]), "peak": peak_memory()}))


def peak_memory() -> int:
    """The most memory that this process has held, bytes; on Linux not what `getrusage` says, which is the parent's."""
    status = Path("/proc/self/status")
    if status.exists():
        return next(int(line.split()[1]) for line in status.read_text().splitlines() if line.startswith("VmHWM")) * 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", nargs="+", choices=CASES, default=[*CASES], help="which machines")
    parser.add_argument("--poses", type=int, default=1_000_000, help="number of random poses")
    parser.add_argument("--turns", type=int, default=8, help="turns of every route")
    parser.add_argument("--sizes", nargs="*", type=int, default=SIZES, help="batch sizes of the second table")
    parser.add_argument("--one", nargs=2, metavar=("MACHINE", "POSES"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        one(options.one[0], int(options.one[1]))
        return
    print(f"Measured on {date.today()}: {processor()}, {available_cores()} of {os.cpu_count()} cores; ", end="")
    print(f"Python {platform.python_version()}, NumPy {np.__version__}.")
    with tempfile.TemporaryDirectory() as folder:
        for name in options.machines:
            print_routes(CASES[name], options.poses, options.turns, Path(folder))
            if options.sizes:
                print_sizes(name, options.sizes)


if __name__ == "__main__":
    main()
