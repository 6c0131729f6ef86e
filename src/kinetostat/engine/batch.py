"""Evaluate a machine at any number of points: its function, slab by slab, in threads. No formula lives here.

A `Function` gives the numbers of a machine as functions of some of its parameters. It is machine code for any number of
points, so that one pose has the same digits alone and among many. The last functions are kept by the identity of the
machine, so that asking for one again does not compare the machine's numbers.
"""

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from kinetostat.arrays import Array, Codes, Integers
from kinetostat.engine.kernel import FallingBack, Fill, Identical, ProgramFill, fill_some, slab_fill
from kinetostat.engine.points import ConsecutivePoints, Points, Population
from kinetostat.frozen import dataclass
from kinetostat.kinematics.limits import Check, load_checks
from kinetostat.kinetostatics.quantities import needs_state, rest_numbers
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.late import LateModule
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, with_values

if TYPE_CHECKING:
    from kinetostat.engine import loaded
    from kinetostat.equilibrium import numbers
    from kinetostat.equilibrium import state as machine_state
else:
    loaded, numbers = LateModule("kinetostat.engine.loaded"), LateModule("kinetostat.equilibrium.numbers")
    machine_state = LateModule("kinetostat.equilibrium.state")

NUMPY_SLAB = 4096
"""Points per NumPy call, so that intermediate arrays stay in the second level of the cache."""
FUNCTIONS_KEPT = 64
"""Number of functions kept in memory with their machines: more than a session asks about, some megabytes."""
NATIVE_SLAB = 32768
"""Points per call of machine code: 2 ms of work, so that calls cost little and an interrupt takes effect soon."""

Progress = Callable[[int, int], None]
"""Called with (points done, points in all) after each slab."""


def silent(_done: int, _total: int) -> None:
    """Report no progress."""


@dataclass(frozen=True)
class Evaluation:
    """Results at every point, in order.

    Attributes:
        values: one array per quantity; NaN where the status is not OK, infinity where rigid (K) or free (C).
        status: `Status` codes.
    """

    values: dict[str, Array]
    status: Codes


def evaluate(
    machine: Machine,
    points: Points,
    quantities: Sequence[str],
    progress: Progress = silent,
    *,
    part: range | None = None,
    threads: int | None = None,
    repeated: bool = False,
) -> Evaluation:
    """Compute quantities and status of a machine at many points.

    Args:
        machine: gives all parameters that do not vary.
        points: values of the varying parameters by leaf path of the machine's family, SI.
        quantities: names from `kinetostatics.quantities.QUANTITIES`.
        progress: called after each slab.
        part: evaluates only these points. If it starts at a multiple of `NATIVE_SLAB`, its results are those of the
            whole batch bit for bit, because the size of the whole decides the arithmetic, and the slabs are the same.
        threads: number of slabs computed at the same time; by default the number of processors.
        repeated: whether the same quantities will be needed many times at other numbers, as behind a slider. Then it
            pays to compile states of rest and vibrations for few points as well.
    """
    function = function_of(machine, points.paths, quantities, math.inf if repeated else points.size)
    evaluated = points if part is None else ConsecutivePoints(points, part.start, part.stop)
    results, status = function.at(evaluated, progress, threads)
    return Evaluation(dict(zip(quantities, results, strict=True)), status)


@dataclass(frozen=True)
class Function:
    """Numbers of a machine as functions of some of its parameters. Threads may share it.

    Attributes:
        fill: function that evaluates a slab.
        paths: leaf paths of the parameters.
        rows: number of results at each point.
        slab: number of points of a slab; None for the number that suits machine code.
    """

    fill: Fill
    paths: tuple[str, ...]
    rows: int
    slab: int | None = None

    def at(self, points: Points, progress: Progress = silent, threads: int | None = None) -> tuple[Array, Codes]:
        """Compute numbers [rows x points] and status codes.

        Args:
            points: values of the parameters.
            progress: called after each slab.
            threads: number of slabs computed at the same time; by default the number of processors.
        """
        cores = available_cores()
        return in_slabs(points, self.fill, self.rows, self.slab or NATIVE_SLAB, min(threads or cores, cores), progress)

    @property
    def direct(self) -> ProgramFill | None:
        """The program that evaluates the function alone at nearly all points; None if it needs results of others."""
        fill = self.fill.first if isinstance(self.fill, FallingBack) else self.fill
        return fill if isinstance(fill, ProgramFill) and fill.alone else None


def function_of(
    machine: Machine, paths: Sequence[str], quantities: Sequence[str], count: float = math.inf, judged: bool = True
) -> Function:
    """Return quantities of a machine as a function of some of its parameters, compiled.

    Args:
        machine: gives all parameters that do not vary.
        paths: leaf paths of the parameters that vary.
        quantities: names from `kinetostatics.quantities.QUANTITIES`.
        count: number of points at which it will be evaluated. For few points, states of rest and vibrations are not
            found by machine code, which takes seconds to compile.
        judged: whether points are judged, see `form.TraceOptions`; states of rest and vibrations always are, because
            only that says whether they are some.
    """
    key, paths, quantities = Identical(machine), tuple(paths), tuple(quantities)
    if not _needs_state(key, quantities):
        return _function(key, paths, quantities, judged=judged)
    return _function(key, paths, quantities, loaded.way_of(machine, paths, quantities, count))


@lru_cache(FUNCTIONS_KEPT)
def _needs_state(machine: Identical, quantities: tuple[str, ...]) -> bool:
    return needs_state(machine.value, quantities)


@lru_cache(FUNCTIONS_KEPT)
def _function(
    machine: Identical,
    paths: tuple[str, ...],
    quantities: tuple[str, ...],
    way: "loaded.Way | None" = None,
    judged: bool = True,
) -> Function:
    """Return the function of `function_of`, kept by the identity of the machine; no way for machines that are free."""
    method = partial(slab_fill, judged=judged) if way is None else partial(loaded.loaded_fill, way=way)
    fill = by_free_springs(machine.value, paths, quantities, method)
    return Function(fill, paths, len(quantities), way.slab if way else None)


Method = Callable[[Machine, Sequence[str], Sequence[str]], Fill]
"""Makes the function that evaluates slabs, from a machine, its varying paths and names of quantities."""


def in_slabs(
    points: Points, fill: Fill, rows: int, slab: int, threads: int, progress: Progress = silent
) -> tuple[Array, Codes]:
    """Compute results [rows x points] and status codes, slab by slab.

    Args:
        points: the points.
        fill: evaluates a slab.
        rows: number of rows of the results.
        slab: points of each slab.
        threads: number of slabs computed at the same time.
        progress: called after each slab.
    """
    results, status = np.empty((rows, points.size)), np.empty(points.size, dtype=np.int8)

    def work(start: int) -> int:
        stop = min(start + slab, points.size)
        fill(points.columns(start, stop), results[:, start:stop], status[start:stop])
        return stop - start

    done = 0
    for count in _in_threads(work, range(0, points.size, slab), threads):
        done += count
        progress(done, points.size)
    return results, status


def by_free_springs(machine: Machine, paths: Sequence[str], quantities: Sequence[str], method: Method) -> Fill:
    """Return a fill that evaluates separately the points at which a varying stiffness is exactly 0.

    There the spring is a free joint, which changes the wrenches of its leg and so the formulas that are traced.
    """
    stiff = {p.path for p in parameters(machine.family) if p.quantity.stiff}
    watched = [path for path in paths if path in stiff]
    ordinary = method(machine, paths, quantities)
    if not watched:
        return ordinary

    def fill(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        free = np.stack([columns[path] == 0.0 for path in watched])
        if not free.any():
            ordinary(columns, results, status)
            return
        # One fill for each pattern of springs that are free together: a handful, because few stiffnesses vary.
        for pattern in np.unique(free, axis=1).T:
            chosen = (free == pattern[:, None]).all(axis=0)
            fixed = {path: 0.0 for path, zero in zip(watched, pattern, strict=True) if zero}
            others = {path: values for path, values in columns.items() if path not in fixed}
            part = method(with_values(machine, fixed), [*others], quantities) if fixed else ordinary
            fill_some(chosen, part, others, results, status)

    return fill


def _in_threads(task: Callable[[int], int], starts: Sequence[int], threads: int) -> Iterator[int]:
    """Run the task for all starts, in order. Few tasks wait at a time, so that an interrupt takes effect soon."""
    if threads == 1 or len(starts) == 1:
        yield from map(task, starts)
        return
    waiting = iter(starts)
    with ThreadPoolExecutor(threads) as pool:
        running = [pool.submit(task, start) for start in islice(waiting, 2 * threads)]
        while running:
            yield running.pop(0).result()
            running.extend(pool.submit(task, start) for start in islice(waiting, 1))


def available_cores() -> int:
    """Count the processors that the system lets this process run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(frozen=True)
class PopulationResults:
    """Quantities of every design at every pose.

    Attributes:
        values: results by name [designs x poses]; NaN where the status is not OK.
        status: `Status` codes [designs x poses].
        slopes: derivatives of each quantity by each path [quantities x paths x designs x poses]; None if they were not
            computed.
    """

    values: dict[str, Array]
    status: Codes
    slopes: Array | None = None

    @classmethod
    def of(
        cls, population: Population, names: Sequence[str], results: Array, status: Codes, slopes: Array | None = None
    ) -> "PopulationResults":
        """Arrange results [quantities x points] by design and pose."""
        values = {name: row.reshape(population.shape) for name, row in zip(names, results, strict=True)}
        return cls(values, status.reshape(population.shape), slopes)


def evaluate_designs(machine: Machine, population: Population, quantities: Sequence[str]) -> PopulationResults:
    """Compute quantities of every design at every pose.

    Args:
        machine: gives all parameters that do not vary.
        population: designs and poses.
        quantities: names from `kinetostatics.quantities.QUANTITIES`.
    """
    function = function_of(machine, population.paths, quantities)
    return PopulationResults.of(population, quantities, *function.at(population))


def responses(machine: Machine, points: Points) -> Response:
    """Compute whole responses at all points: every scalar is an array [points], or one number if it does not vary.

    This is for studies that need more than a few numbers at each of some thousand points. Results are meaningless where
    the status is not OK.

    Args:
        machine: gives all parameters that do not vary.
        points: values of the varying parameters by leaf path of the machine's family, SI.
    """
    with np.errstate(all="ignore"):
        return respond(with_values(machine, points.columns(0, points.size)))


def first_limit_passed(machine: Machine, columns: Mapping[str, Array], fields: Sequence[str]) -> Integers:
    """Find the first limit, in the order of the checks, that each point passes: its index in `fields`, or -1.

    Args:
        machine: the machine with its limits.
        columns: values of the varying parameters by leaf path, SI [points].
        fields: names of the limits that are set.
    """
    size = len(next(iter(columns.values())))
    first = np.full(size, -1)
    for part, checks in _limit_checks(machine, columns):
        for check in checks:
            beyond = ~np.broadcast_to(check.kept, first[part].shape) & (first[part] < 0)
            first[part][beyond] = fields.index(check.limit.name)
    return first


def limits_used(machine: Machine, columns: Mapping[str, Array]) -> dict[str, tuple[float, float]]:
    """Return the least and greatest measure of each limit over some points and all parts, by the limit's name.

    Args:
        machine: a machine with every limit of interest set.
        columns: values of the varying parameters by leaf path, SI [points]; all points must be within reach.
    """
    ranges: dict[str, tuple[float, float]] = {}
    for _, checks in _limit_checks(machine, columns):
        for check in checks:
            least, most = ranges.get(check.limit.name, (np.inf, -np.inf))
            ranges[check.limit.name] = min(least, float(np.min(check.measure))), max(most, float(np.max(check.measure)))
    return ranges


def _limit_checks(machine: Machine, columns: Mapping[str, Array]) -> Iterator[tuple[slice, tuple[Check, ...]]]:
    """Give the comparisons of points with their limits, slab by slab, with the part of the points that each slab is."""
    size, judged_at_rest = len(next(iter(columns.values()))), "actuators" in rest_numbers(machine, ())
    slab = loaded.Way.ANY_MACHINE.slab if judged_at_rest else NUMPY_SLAB
    for start in range(0, size, slab):
        part = slice(start, min(start + slab, size))
        with np.errstate(all="ignore"):
            part_columns = {path: column[part] for path, column in columns.items()}
            state = machine_state.states_at(machine, part_columns, part.stop - start)
            loads = numbers.states_of_rest(state).loads if judged_at_rest else ()
            yield part, (*state.free.checks, *load_checks(state.machine, state.configuration, loads))
