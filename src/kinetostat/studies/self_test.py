"""Numbers that are known, computed again in a few seconds: by print, by another route, and through a file.

Nothing here is computed in a way of its own. Each check returns a sentence on what is sound, or raises `UnsoundError`.
"""

import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import xarray as xr

from kinetostat.engine.batch import Evaluation, available_cores, evaluate, responses
from kinetostat.engine.points import PointTable
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.loading import load
from kinetostat.studies import printed_numbers
from kinetostat.studies.analysis import analyze
from kinetostat.studies.datasets import evaluate_grid
from kinetostat.studies.diagnosis import InstallationCheck, UnsoundError, check_of, reinstall
from kinetostat.studies.optimisation.assessment import Assessor
from kinetostat.studies.optimisation.log import best_feasible
from kinetostat.studies.optimisation.problem import load_problem
from kinetostat.studies.optimisation.search import search
from kinetostat.studies.printed_numbers import PrintVerdict, table_3, table_4
from kinetostat.studies.storage import write_dataset
from kinetostat.tolerances import EQUAL_ROUTES

DIAGONALS = (*GROUPS["stiffness"], *GROUPS["compliance"])
"""Quantities that are compared: the diagonals of K and C."""
COMPARED_POSES = 500
"""Poses at which routes are compared: many, and yet so few that NumPy computes them at once."""
TIMED_POSES = 200_000
"""Poses whose time is taken: enough to keep some cores busy for a tenth of a second."""
SPREAD = {"pose.x": (-0.02, 0.02), "pose.z": (0.66, 0.70)}
"""Ranges of the poses, m: the middle of the workspace of the paper's machine, where every pose has an answer."""
SEED = 1
"""Seed of the poses: the same ones each time, so that a difference can be looked into."""


def checks() -> Iterator[InstallationCheck]:
    """The paper's numbers, the routes of the engine beside each other, a search, a file."""
    yield check_of("self-test", "paper", paper_numbers, reinstall("kinetostat"))
    yield check_of("self-test", "machine code", routes_agree, reinstall("llvmlite numpy"))
    yield check_of("self-test", "throughput", throughput, reinstall("llvmlite numpy"))
    yield check_of("self-test", "search", short_search, reinstall("pymoo scipy"))
    yield check_of("self-test", "files", results_file, reinstall("h5netcdf h5py xarray"))


def paper_numbers() -> str:
    """Tables III and IV of the paper, as far as they are printed."""
    numbers = [*table_3(), *table_4()]
    wrong = [number for number in numbers if number.verdict is PrintVerdict.DIFFERS]
    if wrong:
        first = wrong[0]
        raise UnsoundError(
            f"{len(wrong)} of {len(numbers)} numbers differ from print; {first.place}, {first.component}: "
            f"{first.computed:.9g} for {first.printed}"
        )
    misprints = sum(number.verdict is PrintVerdict.MISPRINT for number in numbers)
    equal = len(numbers) - misprints
    return f"{equal} of {len(numbers)} numbers of Tables III and IV as printed, {misprints} known misprints"


def routes_agree() -> str:
    """K and C of the paper's machine by machine code, by NumPy and pose by pose."""
    machine, poses = load(printed_numbers.MACHINE), _poses(COMPARED_POSES)
    compiled, plain = evaluate(machine, poses, DIAGONALS), responses(machine, poses)
    x, z = (float(poses.values[path][0]) for path in poses.paths)
    single = analyze(load(printed_numbers.MACHINE, [f"pose.x={x!r}", f"pose.z={z!r}"]))
    first = np.array([compiled.values[name][0] for name in DIAGONALS])
    alone = np.array([*single.stiffness_diagonal, *single.compliance_diagonal])
    difference = max(_greatest_difference(compiled, plain), float(np.abs(first / alone - 1.0).max()))
    if not difference <= EQUAL_ROUTES or (compiled.status != Status.OK).any():
        raise UnsoundError(
            f"it differs from NumPy or from a single pose by {difference:.1e}; {EQUAL_ROUTES:g} is allowed"
        )
    return f"K and C at {COMPARED_POSES} poses as by NumPy and pose by pose, to {difference:.0e}"


def throughput() -> str:
    """Poses a second, with twelve numbers each."""
    machine, poses = load(printed_numbers.MACHINE), _poses(TIMED_POSES)
    evaluate(machine, _poses(COMPARED_POSES), DIAGONALS)
    start = time.perf_counter()
    evaluate(machine, poses, DIAGONALS)
    rate = TIMED_POSES / (time.perf_counter() - start)
    return f"{rate / 1e6:.2g} million poses/s, {len(DIAGONALS)} numbers each, on {available_cores()} cores"


def short_search() -> str:
    """A short search that ends at or below the sum of compliances that the paper prints."""
    settings = ["optimizer.method=hybrid", "optimizer.generations=10"]
    log = search(Assessor(load_problem("zhang-gosselin-2002", settings)))
    reached = float(log.outcome(best_feasible(log)).objectives[:, 0].min(initial=np.inf))
    if not reached <= float(printed_numbers.OPTIMISED_SUM):
        raise UnsoundError(
            f"it ends at {reached:.9g} instead of below {printed_numbers.OPTIMISED_SUM}, the paper's optimum"
        )
    return f"the paper's optimum, {reached:.9g} (printed {printed_numbers.OPTIMISED_SUM}), in {log.count} evaluations"


def results_file() -> str:
    """A sweep written as NetCDF and read again, bit by bit."""
    grid = evaluate_grid(load(printed_numbers.MACHINE), ["z=66 cm:70 cm:5"], ["compliance"])
    with TemporaryDirectory() as folder:
        path = Path(folder) / "sweep.nc"
        write_dataset(path, grid)
        with xr.open_dataset(path, engine="h5netcdf") as again:
            if not again.equals(grid):
                raise UnsoundError("a sweep that was written as NetCDF differs when it is read again")
    return "a sweep written as NetCDF and read again, the same"


def _poses(count: int) -> PointTable:
    """Poses spread over the middle of the machine's workspace."""
    rng = np.random.default_rng(SEED)
    return PointTable({path: rng.uniform(*ends, count) for path, ends in SPREAD.items()})


def _greatest_difference(compiled: Evaluation, response: Response) -> float:
    """Greatest relative difference of numbers by machine code from those by NumPy."""
    by_numpy = {name: QUANTITIES[name].value(response) for name in DIAGONALS}
    return max(float(np.abs(compiled.values[name] / by_numpy[name] - 1.0).max()) for name in DIAGONALS)
