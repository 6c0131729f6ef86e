"""Ways to the same numbers, to be timed in turns: kinetostat, batched NumPy, hand-written C++, PyNite pose by pose."""

import ctypes
import importlib.util
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cases import SUM, TWELVE, Case
from kinetostat.engine.batch import available_cores, evaluate, function_of
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.points import PointTable
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import with_values

Array = npt.NDArray[np.float64]

NUMPY_CHUNKS = (256, 512, 1024, 2048, 4096, 16384)
NUMPY_SHARE = 20
"""NumPy is timed over this fraction of the poses."""
SLAB = 16384
FLAGS = ("-O3", "-fno-math-errno", "-fno-trapping-math", "-shared", "-fPIC")
VALUES_ALONE = "kinetostat, values alone"
"""The route of a function that computes no status, see `kinetostat.compile`."""
TWELVE_OUTPUTS, DIAGONAL_OF_C = "diagonals of C and K", "diagonal of C"
SUM_OF_C, WITH_GRADIENT = "sum of C", "sum of C and gradient by 7"


@dataclass
class Route:
    """One way to the same numbers.

    Attributes:
        name: for the table.
        task: what it computes.
        count: number of poses it is timed over.
        run: does it; returns one array per output [count].
        prepared: what it took to get ready (imports, compilation), s of the processor.
        best: its best turn, s of the processor.
    """

    name: str
    task: str
    count: int
    run: Callable[[], Sequence[Array]]
    prepared: float = 0.0
    best: float = float("inf")

    def turn(self) -> float:
        """Do it once; returns s of the processor, of all its threads."""
        started = time.process_time()
        self.run()
        taken = time.process_time() - started
        self.best = min(self.best, taken)
        return taken

    @property
    def rate(self) -> float:
        """Poses per second of one core in its best turn."""
        return self.count / self.best


def routes_of(case: Case, poses: dict[str, Array], folder: Path) -> list[Route]:
    """All ways to the numbers of a case that this machine offers."""
    return [
        *our_routes(case, poses),
        numpy_route(case, poses),
        *cpp_routes(case, poses, folder),
        *pynite_route(case, poses),
    ]


def our_routes(case: Case, poses: dict[str, Array], without: str = "") -> list[Route]:
    """evaluate() and evaluate_gradient(), without one of their tasks, and a compiled function of values alone."""
    machine, points = load(case.machine), PointTable(poses)
    tasks: dict[str, Callable[[], Sequence[Array]]] = {
        TWELVE_OUTPUTS: lambda: [*evaluate(machine, points, TWELVE).values.values()],
        SUM_OF_C: lambda: [*evaluate_gradient(machine, points, SUM, (), repeated=True).values],
        WITH_GRADIENT: lambda: [*evaluate_gradient(machine, points, SUM, case.design, repeated=True).values],
    }
    routes = [_prepared(Route("kinetostat", task, points.size, run)) for task, run in tasks.items() if task != without]

    def alone() -> Sequence[Array]:
        results, _ = function_of(machine, points.paths, TWELVE, judged=False).at(points)
        return [*results]

    return [*routes, _prepared(Route(VALUES_ALONE, TWELVE_OUTPUTS, points.size, alone))]


def _prepared(route: Route) -> Route:
    """What its first call takes above the others: import, trace, compile."""
    first = route.turn()
    route.best = float("inf")
    route.prepared = max(0.0, first - min(route.turn() for _ in range(2)))
    return route


def numpy_route(case: Case, poses: dict[str, Array]) -> Route:
    """Arrays of matrices, in the best of several chunk sizes, on all cores."""
    count = len(next(iter(poses.values()))) // NUMPY_SHARE
    results = np.empty((12, count))

    def run(chunk: int) -> Array:
        def task(start: int, stop: int) -> None:
            results[:, start:stop] = case.diagonals(*(column[start:stop] for column in poses.values()))

        in_chunks(task, count, chunk)
        return results

    trials = [(Route("", "", count, lambda c=chunk: run(c)).turn(), chunk) for chunk in NUMPY_CHUNKS]
    chunk = min(trials)[1]
    return Route(f"batched NumPy, chunks of {chunk}", TWELVE_OUTPUTS, count, lambda: run(chunk))


def in_chunks(task: Callable[[int, int], None], count: int, chunk: int) -> None:
    """The task over [start, stop) of every chunk, by all cores."""
    with ThreadPoolExecutor(available_cores()) as pool:
        list(pool.map(lambda start: task(start, min(start + chunk, count)), range(0, count, chunk)))


def _processor_time_of_children() -> float:
    times = os.times()
    return times.children_user + times.children_system


def cpp_routes(case: Case, poses: dict[str, Array], folder: Path, processor: str = "native") -> list[Route]:
    """The kernels of kernels.cpp for a processor, where there is a compiler; their status is reach and rank alone."""
    compiler = next(filter(None, map(shutil.which, ("c++", "g++", "clang++"))), None)
    if compiler is None:
        return []
    started = _processor_time_of_children()
    library = folder / f"{case.machine}.so"
    source, flags = str(Path(__file__).with_name("kernels.cpp")), [*FLAGS, f"-march={processor}"]
    subprocess.run([compiler, *flags, "-o", str(library), source], check=True)
    prepared = _processor_time_of_children() - started
    code = ctypes.CDLL(str(library)).kernel
    count = len(next(iter(poses.values())))

    def run(kind: int, everything: bool) -> Array:
        results, status = np.empty((12 if everything else 1, count)), np.empty(count, dtype=np.int8)

        def task(start: int, stop: int) -> None:
            columns = np.array([column[start:stop].ctypes.data for column in poses.values()], dtype=np.uintp)
            rows = np.array([row[start:stop].ctypes.data for row in results], dtype=np.uintp)
            pointers = [ctypes.c_void_p(a.ctypes.data) for a in (case.numbers, columns, rows, status[start:stop])]
            code(ctypes.c_int(kind), *pointers, ctypes.c_int64(stop - start), ctypes.c_int(everything))

        in_chunks(task, count, SLAB)
        return results

    return [
        Route(f"C++, {name}", task, count, lambda k=kind, a=everything: run(k, a), prepared)
        for task, everything in ((TWELVE_OUTPUTS, True), (SUM_OF_C, False))
        for name, kind in case.kernels.items()
    ]


def pynite_route(case: Case, poses: dict[str, Array]) -> list[Route]:
    """The validation's frame of straight members at the first pose, where PyNite is installed: C alone.

    What is rigid gets ten stiffnesses in turn, from which the limit is extrapolated: ten frames per pose.
    """
    if importlib.util.find_spec("Pynite") is None:
        return []
    from kinetostat.validation.pynite_machine import solve

    pose = {path: float(column[0]) for path, column in poses.items()}
    response = respond(with_values(load(case.machine), pose))

    def run() -> list[Array]:
        found = np.diag(solve(response.configuration, response.reference).compliance)
        return [np.array([entry]) for entry in found]

    return [Route("PyNite, ten frames per pose", DIAGONAL_OF_C, 1, run)]
