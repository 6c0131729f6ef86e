"""Poses per second of three machines: kinetostat beside batched NumPy, hand-written C++ and PyNite, in one run.

It prints Markdown, the tables of `docs/performance.md`. Times are those of the processor, summed over its threads, so
that a busy machine changes them little; the routes take turns, and each counts by its best one. Instructions are
counted by valgrind in a process of its own, for AVX2 and with two numbers of poses, whose difference counts. How cost
grows with the number of poses is what `sizes.py` measures.

    python benchmarks/throughput.py > docs/measured/throughput.md
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from cases import CASES, HEXAPOD, TWELVE, Case
from conditions import conditions
from instructions import PROCESSOR, compile_for_valgrind, count, per_pose
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.engine.program_files import OFF, VARIABLE
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.machine.loading import build, load
from kinetostat.machine.machine import Machine
from routes import DIAGONAL_OF_C, TWELVE_OUTPUTS, WITH_GRADIENT, Array, Route, cpp_routes, our_routes, routes_of

FEW, MORE = 2048, 6144
"""Poses at which instructions are counted."""
BESIDE_ITS_FAMILY = "of its family"
Counts = Mapping[str, float]
"""Instructions of a pose, by `_label`."""


def _label(machine: str, route: str, task: str) -> str:
    return f"{machine}: {route}: {task}"


def count_instructions(machines: Sequence[str], folder: Path) -> None:
    """Count the instructions of what is timed, for few poses and for more."""
    compile_for_valgrind()
    tasks: dict[str, Callable[[], object]] = {}
    for poses in (FEW, MORE):
        for name in machines:
            case, columns = CASES[name], CASES[name].poses(poses)
            routes = [*our_routes(case, columns, without=WITH_GRADIENT), *cpp_routes(case, columns, folder, PROCESSOR)]
            tasks |= {f"{_label(name, route.name, route.task)}: {poses}": route.run for route in routes}
        for title, task in leg_by_leg(poses).items():
            tasks[f"{_label(title, BESIDE_ITS_FAMILY, TWELVE_OUTPUTS)}: {poses}"] = task
    count(tasks)


def leg_by_leg(count: int) -> dict[str, Callable[[], object]]:
    """A hexapod as a family, the same written leg by leg, and the first machine of the README: poses of each."""
    family = load(HEXAPOD.machine)
    near, (x, y, z) = np.random.default_rng(2002).uniform(-1e-2, 1e-2, (3, count)), ("pose.x", "pose.y", "pose.z")

    def task(machine: Machine) -> Callable[[], object]:
        pose = machine.tables["pose"]
        points = PointTable({x: pose.x + near[0], y: pose.y + near[1], z: pose.z + near[2]})
        return lambda: evaluate(machine, points, TWELVE)

    written = build(document_of(family))
    return {
        "hexapod, a family": task(family),
        "hexapod, written leg by leg": task(written),
        "hexapod-hardware": task(load("hexapod-hardware")),
    }


def print_leg_by_leg(count: int, turns: int, counts: Counts) -> None:
    """Time machines that are written leg by leg beside a family, and print the table."""
    print(f"\n## Written leg by leg\n\n{count:,} poses about that of the file; diagonals of C and K with a status.\n")
    print("| machine | a pose | of the family | instructions per pose | of the family |\n|---|---|---|---|---|")
    tasks = leg_by_leg(count)
    routes = {title: Route(title, TWELVE_OUTPUTS, count, task) for title, task in tasks.items()}  # type: ignore[arg-type]
    for route in routes.values():
        route.run()
    for _ in range(turns):
        for route in routes.values():
            route.turn()
    first, *_ = routes.values()
    base = counts.get(_label(first.name, BESIDE_ITS_FAMILY, TWELVE_OUTPUTS))
    for route in routes.values():
        here = counts.get(_label(route.name, BESIDE_ITS_FAMILY, TWELVE_OUTPUTS))
        counts_of_row = f"{here:.0f} | {here / base:.2f}" if here and base else " | "
        print(f"| {route.name} | {1e6 / route.rate:.3f} us | {first.rate / route.rate:.2f} | {counts_of_row} |")


def print_routes(name: str, case: Case, count: int, turns: int, folder: Path, counts: Counts) -> None:
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
    print("| route | computes | poses/s of a core | times NumPy | of the fastest C++ ", end="")
    print("| instructions per pose | of the fewest of C++ | ready after | difference |")
    print("|---|---|---|---|---|---|---|---|---|")
    for route in routes:
        alike = [other for other in routes if other.name.startswith("C++") and other.task == route.task]
        share = f"{route.rate / max(other.rate for other in alike):.2f}" if alike else ""
        here = counts.get(_label(name, route.name, route.task))
        least = min((counts.get(_label(name, other.name, other.task), np.inf) for other in alike), default=np.inf)
        counts_of_row = f"{here:.0f} | {f'{here / least:.2f}' if least < np.inf else ''}" if here else " | "
        prepared = f"{route.prepared:.2f} s" if route.prepared else ""
        print(
            f"| {route.name} | {route.task} | {_rate(route.rate)} | {route.rate / numpy_rate:.3g} | {share} "
            f"| {counts_of_row} | {prepared} | {difference(route, ours)} |"
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
    parser.add_argument("--count", action="store_true", help="do once what is timed, as a process that is counted")
    options = parser.parse_args()
    if options.count:
        with tempfile.TemporaryDirectory() as folder:
            count_instructions(options.machines, Path(folder))
        sys.exit()
    counts = per_pose([__file__, "--count", "--machines", *options.machines], FEW, MORE)
    os.environ[VARIABLE] = OFF  # what a program costs is what it costs where none is at hand
    print(f"{conditions()} Times of the processor.")
    with tempfile.TemporaryDirectory() as folder:
        for name in options.machines:
            print_routes(name, CASES[name], options.poses, options.turns, Path(folder), counts)
    print_leg_by_leg(options.poses // 4, options.turns, counts)


if __name__ == "__main__":
    main()
