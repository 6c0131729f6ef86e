"""Poses per second of the 4-dof machine: evaluate() beside batched NumPy and hand-written C++, in one run.

Run `python benchmarks/throughput.py`. Every route uses all cores, and the routes take turns, so that a busy machine
slows all of them; each counts by its best turn.
"""

import argparse
import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import radians
from pathlib import Path

import numpy as np
import numpy.typing as npt

from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import Table
from kinetostat.engine.threads import available_cores
from kinetostat.kinetostatics.quantities import GROUPS
from kinetostat.machine.loading import load
from numpy_4dof import ACTUATOR, BASE, BENDING, FIRST_LINK, PLATFORM, SECOND_LINK, diagonals

Array = npt.NDArray[np.float64]

RANGES = {
    "pose.x": (-0.02, 0.02),
    "pose.z": (0.66, 0.70),
    "pose.theta5": (radians(-70), radians(-50)),
    "pose.theta6": (radians(110), radians(130)),
}
TWELVE = (*GROUPS["compliance"], *GROUPS["stiffness"])
NUMPY_CHUNKS = (256, 512, 1024, 2048, 4096, 16384)
NUMPY_SHARE = 10
"""NumPy is timed over this fraction of the poses."""
SLAB = 16384
FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-shared", "-fPIC")
FIRST_RESULT = """
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import Table
from kinetostat.machine.loading import load
import numpy as np
evaluate(load("zhang-gosselin-4dof"), Table({{"pose.x": np.linspace(-0.02, 0.02, {count})}}), {names})
"""


@dataclass
class Route:
    """One way to the same numbers.

    Attributes:
        name: for the table.
        reference: which result it is compared with: "twelve", "trace" or "".
        count: number of poses it is timed over.
        run: does it; returns one array per output [count].
        prepared: what it took to get ready (imports, compilation), s.
        best: its best turn, s.
    """

    name: str
    reference: str
    count: int
    run: Callable[[], Sequence[Array]]
    prepared: float = 0.0
    best: float = float("inf")


def in_chunks(task: Callable[[int, int], None], count: int, chunk: int) -> None:
    """The task over [start, stop) of every chunk, by all cores."""
    with ThreadPoolExecutor(available_cores()) as pool:
        list(pool.map(lambda start: task(start, min(start + chunk, count)), range(0, count, chunk)))


def kinetostat_route(poses: dict[str, Array], names: Sequence[str], name: str, reference: str) -> Route:
    """evaluate(); prepared is what its first call takes above the others: import, trace, compile."""
    machine, points = load("zhang-gosselin-4dof"), Table(poses)
    route = Route(name, reference, points.size, lambda: list(evaluate(machine, points, names).values.values()))
    first = turn(route)
    route.best = float("inf")
    route.prepared = max(0.0, first - min(turn(route) for _ in range(3)))
    return route


def numpy_route(poses: dict[str, Array]) -> Route:
    """Arrays of matrices, in the best of several chunk sizes."""
    count = len(poses["pose.x"]) // NUMPY_SHARE
    results = np.empty((12, count))

    def run(chunk: int) -> Array:
        def task(start: int, stop: int) -> None:
            results[:, start:stop] = diagonals(*(column[start:stop] for column in poses.values()))

        in_chunks(task, count, chunk)
        return results

    trials = [(turn(Route("", "", count, lambda c=chunk: run(c))), chunk) for chunk in NUMPY_CHUNKS]
    chunk = min(trials)[1]
    return Route(f"NumPy, arrays of matrices (chunks of {chunk})", "twelve", count, lambda: run(chunk))


def cpp_routes(poses: dict[str, Array], folder: Path) -> list[Route]:
    """The kernels of kernel_4dof.cpp, where there is a compiler."""
    compiler = next(filter(None, map(shutil.which, ("c++", "g++", "clang++"))), None)
    if compiler is None:
        return []
    started = time.perf_counter()
    library = folder / "kernel.so"
    command = [compiler, *FLAGS, "-o", str(library), str(Path(__file__).with_name("kernel_4dof.cpp"))]
    subprocess.run(command, check=True)
    prepared = time.perf_counter() - started
    code = ctypes.CDLL(str(library)).kernel
    links = [FIRST_LINK, SECOND_LINK]
    machine = np.concatenate([*BASE.T[:2], *PLATFORM.T[:2], links, [ACTUATOR] * 4, BENDING])
    count = len(poses["pose.x"])

    def run(reduced: bool, everything: bool) -> Array:
        results, status = np.empty((12 if everything else 1, count)), np.empty(count, dtype=np.int8)

        def task(start: int, stop: int) -> None:
            columns = np.array([column[start:stop].ctypes.data for column in poses.values()], dtype=np.uintp)
            rows = np.array([row[start:stop].ctypes.data for row in results], dtype=np.uintp)
            pointers = [ctypes.c_void_p(a.ctypes.data) for a in (machine, columns, rows, status[start:stop])]
            code(*pointers, ctypes.c_int64(stop - start), ctypes.c_int(reduced), ctypes.c_int(everything))

        in_chunks(task, count, SLAB)
        return results

    return [
        Route("C++, 6x6 Cholesky (eq. 32)", "twelve", count, lambda: run(False, True), prepared),
        Route("C++, reduced by hand to 4x4", "twelve", count, lambda: run(True, True), prepared),
        Route("C++, 6x6 Cholesky, sum of the C diagonal", "trace", count, lambda: run(False, False), prepared),
        Route("C++, reduced by hand, sum of the C diagonal", "trace", count, lambda: run(True, False), prepared),
    ]


def turn(route: Route) -> float:
    """One turn of a route, s."""
    started = time.perf_counter()
    route.run()
    taken = time.perf_counter() - started
    route.best = min(route.best, taken)
    return taken


def difference(route: Route, twelve: Sequence[Array]) -> float:
    """Largest relative difference from evaluate(); NaN where the route gives something else."""
    expected = {"twelve": twelve, "trace": [np.sum(twelve[:6], axis=0)], "": []}[route.reference]
    pairs = zip(route.run(), expected, strict=bool(expected))
    return max((float(np.abs(a / b[: route.count] - 1.0).max()) for a, b in pairs), default=np.nan)


def first_result(count: int) -> float:
    """From the start of a Python process to its end after one evaluate(), s."""
    started = time.perf_counter()
    subprocess.run([sys.executable, "-c", FIRST_RESULT.format(count=count, names=TWELVE)], check=True)
    return time.perf_counter() - started


def main() -> None:
    """Time the routes in turns and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=1_000_000, help="number of random poses")
    parser.add_argument("--turns", type=int, default=12, help="turns of every route")
    options = parser.parse_args()
    random = np.random.default_rng(2002)
    poses = {path: random.uniform(low, high, options.poses) for path, (low, high) in RANGES.items()}
    routes = [
        kinetostat_route(poses, TWELVE, "kinetostat evaluate()", "twelve"),
        kinetostat_route(poses, ("compliance_x",), "kinetostat evaluate(), one output", ""),
        numpy_route(poses),
    ]
    with tempfile.TemporaryDirectory() as folder:
        routes += cpp_routes(poses, Path(folder))
        for _ in range(options.turns):
            for route in routes:
                turn(route)
        rate = {route.name: route.count / route.best / 1e6 for route in routes}
        twelve = routes[0].run()
        print(f"\n{options.poses:,} random poses, {available_cores()} of {os.cpu_count()} cores")
        print(f"{'route':<52}{'million poses/s':>16}{'ratio':>8}{'ready after':>13}{'difference':>12}")
        for route in routes:
            ratio = rate[route.name] / rate[routes[0].name]
            text = f"{route.name:<52}{rate[route.name]:>16.2f}{ratio:>8.3f}{route.prepared:>11.2f} s"
            print(f"{text}{difference(route, twelve):>12.1e}")
    print(f"\nC++: {' '.join(FLAGS)}. NumPy: timed over 1/{NUMPY_SHARE} of the poses.")
    for count in (1, options.poses):
        print(f"process start to end, twelve outputs at {count:,} poses: {first_result(count):.2f} s")


if __name__ == "__main__":
    main()
