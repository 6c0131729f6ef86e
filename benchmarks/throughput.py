"""Poses per second of three machines: kinetostat beside batched NumPy, hand-written C++ and PyNite, in one run.

It prints Markdown, the tables of `docs/performance.md`. Times are those of the processor, summed over its threads, so
that a busy machine changes them little; the routes take turns, and each counts by its best one. How cost grows with the
number of poses is what `sizes.py` measures.

    python benchmarks/throughput.py > docs/measured/throughput.md
"""

import argparse
import os
import platform
import tempfile
from collections.abc import Sequence
from datetime import date
from pathlib import Path

import numpy as np

from cases import CASES, Case
from kinetostat.engine.batch import available_cores
from kinetostat.engine.program_files import OFF, VARIABLE
from kinetostat.studies.diagnosis import processor
from routes import DIAGONAL_OF_C, TWELVE_OUTPUTS, Array, Route, routes_of


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
    print("| route | computes | poses/s of a core | times NumPy | of the fastest C++ | ready after | difference |")
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
    """Largest relative difference from evaluate(), where both give the same numbers; other routes know no status."""
    found = route.run()
    if route.name == "kinetostat" and route.task == TWELVE_OUTPUTS:
        return ""
    expected = {TWELVE_OUTPUTS: twelve, DIAGONAL_OF_C: twelve[:6]}.get(route.task, [np.sum(twelve[:6], axis=0)])
    pairs = [(a, b[: len(a)]) for a, b in zip(found, expected, strict=True)]
    return f"{max(float(np.abs(a / b - 1.0)[np.isfinite(b)].max()) for a, b in pairs):.0e}"


def _rate(rate: float) -> str:
    return f"{rate / 1e6:.3g} million" if rate >= 1e4 else f"{rate:.2g}"


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", nargs="+", choices=CASES, default=[*CASES], help="which machines")
    parser.add_argument("--poses", type=int, default=1_000_000, help="number of random poses")
    parser.add_argument("--turns", type=int, default=8, help="turns of every route")
    options = parser.parse_args()
    os.environ[VARIABLE] = OFF  # what a program costs is what it costs where none is at hand
    print(f"Measured on {date.today()}: {processor()}, {available_cores()} of {os.cpu_count()} cores; ", end="")
    print(f"Python {platform.python_version()}, NumPy {np.__version__}. Times of the processor.")
    with tempfile.TemporaryDirectory() as folder:
        for name in options.machines:
            print_routes(CASES[name], options.poses, options.turns, Path(folder))


if __name__ == "__main__":
    main()
