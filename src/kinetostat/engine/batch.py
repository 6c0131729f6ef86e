"""Many points at once: the engine chooses arithmetic, slab size and threads. Holds no formula.

Small batches run through NumPy, because that starts at once; large ones through machine code. Both evaluate the very
same functions.
"""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice

import numpy as np
import numpy.typing as npt

from kinetostat.engine.kernel import Fill, fill_some, slab_kernel
from kinetostat.engine.points import Array, Part, Points
from kinetostat.kinematics.limits import Check
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, with_values

NATIVE_FROM = 20_000
"""Points from which loading LLVM and compiling (0.1 to 0.3 s) pays: NumPy does 30 to 200 thousand poses/s."""
NUMPY_SLAB = 4096
"""Points per NumPy call: intermediates stay in the second cache level."""
NATIVE_SLAB = 32768
"""Points per call of machine code: 2 ms of work, so that calls cost little and an interrupt is soon heard."""

Progress = Callable[[int, int], None]
"""Called with (points done, points in all) after each slab."""

Codes = npt.NDArray[np.int8]


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
        points: where; leaf paths of the machine's family and their values, SI.
        quantities: names from `kinetostatics.quantities.QUANTITIES`.
        progress: called after each slab.
        part: only these points; where it starts at a multiple of `NATIVE_SLAB`, results are those of the whole batch
            bit for bit, because the size of the whole decides the arithmetic, and slabs are the same.
        threads: slabs under way at once; all processors unless given.
        repeated: whether the same quantities will be wanted again and again at other numbers, as by a slider: then
            compiling once pays for few points as well; a thousand poses take a millisecond from then on.
    """
    method: Method
    if repeated or points.size >= NATIVE_FROM:
        slab, most, method = NATIVE_SLAB, threads or available_cores(), _program_fill
    else:
        slab, most, method = NUMPY_SLAB, 1, _numpy_fill
    fill = by_free_springs(machine, points.paths, quantities, method)
    served = points if part is None else Part(points, part.start, part.stop)
    results, status = in_slabs(served, fill, len(quantities), slab, most, progress)
    return Evaluation(dict(zip(quantities, results, strict=True)), status)


Method = Callable[[Machine, Sequence[str], Sequence[str]], Fill]
"""A way to evaluate slabs: from a machine, its varying paths and names of quantities."""


def in_slabs(
    points: Points, fill: Fill, rows: int, slab: int, threads: int, progress: Progress = silent
) -> tuple[Array, Codes]:
    """Compute results [rows x points] and status codes, slab by slab.

    Args:
        points: where.
        fill: evaluates a slab.
        rows: of results.
        slab: points of each slab.
        threads: how many slabs are under way at once.
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
    """Evaluate points at which a varying stiffness is exactly 0 apart from the others: it is a free joint there."""
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


def _numpy_fill(machine: Machine, _paths: Sequence[str], quantities: Sequence[str]) -> Fill:
    def fill(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        with np.errstate(all="ignore"):
            response = respond(with_values(machine, columns))
            status[:] = response.status
            for row, name in zip(results, quantities, strict=True):
                row[:] = QUANTITIES[name].value(response)
        results[:, status != Status.OK] = np.nan

    return fill


def _program_fill(machine: Machine, paths: Sequence[str], quantities: Sequence[str]) -> Fill:
    return slab_kernel(machine, paths, quantities).run


def _in_threads(task: Callable[[int], int], starts: Sequence[int], threads: int) -> Iterator[int]:
    """Results of the task over all starts, a few at a time, so that an interrupt stops soon."""
    if threads == 1:
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


def responses(machine: Machine, points: Points) -> Response:
    """Compute whole responses at all points: every scalar is an array [points] or the same at all of them.

    For studies that need more than a few numbers of each of some thousand points. Results are meaningless where the
    status is not OK.

    Args:
        machine: gives all parameters that do not vary.
        points: where; leaf paths of the machine's family and their values, SI.
    """
    with np.errstate(all="ignore"):
        return respond(with_values(machine, points.columns(0, points.size)))


def first_limit_passed(machine: Machine, columns: Mapping[str, Array], fields: Sequence[str]) -> npt.NDArray[np.int64]:
    """Find the first limit, in the order of the checks, that each point passes: its place in `fields`, or -1.

    Args:
        machine: with its limits.
        columns: values of the varying parameters by leaf path, SI [points].
        fields: names of the limits that are set.
    """
    size = len(next(iter(columns.values())))
    first = np.full(size, -1)
    for part, checks in _checked(machine, columns):
        for check in checks:
            beyond = ~np.broadcast_to(check.kept, first[part].shape) & (first[part] < 0)
            first[part][beyond] = fields.index(check.limit.name)
    return first


def limits_used(machine: Machine, columns: Mapping[str, Array]) -> dict[str, tuple[float, float]]:
    """Return the least and greatest measure of each limit over some points and all parts, by the limit's name.

    Args:
        machine: all of whose limits that are of interest are set.
        columns: values of the varying parameters by leaf path, SI [points]; of points that can be reached.
    """
    ranges: dict[str, tuple[float, float]] = {}
    for _, checks in _checked(machine, columns):
        for check in checks:
            least, most = ranges.get(check.limit.name, (np.inf, -np.inf))
            ranges[check.limit.name] = min(least, float(np.min(check.measure))), max(most, float(np.max(check.measure)))
    return ranges


def _checked(machine: Machine, columns: Mapping[str, Array]) -> Iterator[tuple[slice, tuple[Check, ...]]]:
    size = len(next(iter(columns.values())))
    for start in range(0, size, NUMPY_SLAB):
        part = slice(start, start + NUMPY_SLAB)
        with np.errstate(all="ignore"):
            yield part, respond(with_values(machine, {path: column[part] for path, column in columns.items()})).checks
