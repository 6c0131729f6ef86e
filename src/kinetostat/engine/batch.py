"""Many points at once: the engine chooses arithmetic, slab size and threads. Holds no formula.

Small batches run through NumPy, because that starts at once; large ones through compiled code. Both evaluate the very
same functions.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.scalar import Angle
from kinetostat.engine.points import Array, Points
from kinetostat.engine.threads import available_cores
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values

COMPILE_FROM = 100_000
"""Points from which importing and compiling (some seconds) pays: NumPy does about 0.4 million poses/s."""
NUMPY_SLAB = 4096
"""Points per NumPy call: intermediates stay in the second cache level."""

Progress = Callable[[int, int], None]
"""Told (points done, points in all) after each slab."""


def silent(_done: int, _total: int) -> None:
    """Progress that nobody watches."""


@dataclass(frozen=True)
class Evaluation:
    """Results at every point, in order.

    Attributes:
        values: one array per quantity; NaN where the status is not OK, infinity where rigid (K) or free (C).
        status: `Status` codes.
    """

    values: dict[str, Array]
    status: npt.NDArray[np.int8]


def evaluate(machine: Machine, points: Points, quantities: Sequence[str], progress: Progress = silent) -> Evaluation:
    """Quantities and status of a machine at many points.

    Args:
        machine: gives all parameters that do not vary.
        points: where; leaf paths of the machine's family and their values, SI.
        quantities: names from `kinetostatics.quantities.QUANTITIES`.
        progress: told how far the work is.
    """
    compiled = points.size >= COMPILE_FROM
    angles = {p.path for p in parameters(machine.family) if p.quantity.kind == "angle"}
    fixed = {path: value for path, value in values(machine).items() if path not in points.paths}
    work = _compiled_work if compiled else _numpy_work
    slab, call = work(machine, _with_angles(fixed, angles, compiled), tuple(quantities))
    results = np.empty((len(quantities), points.size))
    status = np.empty(points.size, dtype=np.int8)

    def fill(start: int) -> int:
        stop = min(start + slab, points.size)
        found, codes = call(_with_angles(points.columns(start, stop), angles, True), stop - start)
        status[start:stop] = codes
        for row, column in zip(results, found, strict=True):
            row[start:stop] = np.where(codes == Status.OK, column, np.nan)
        return stop - start

    done = 0
    for count in _in_threads(fill, range(0, points.size, slab), available_cores() if compiled else 1):
        done += count
        progress(done, points.size)
    return Evaluation(dict(zip(quantities, results, strict=True)), status)


def _with_angles(columns: Mapping[str, Any], angles: set[str], turned: bool) -> dict[str, Any]:
    """The columns with every angle (rad) replaced by its cosine and sine."""
    if not turned:
        return dict(columns)
    return {p: Angle(np.cos(c), np.sin(c)) if p in angles else c for p, c in columns.items()}


Work = tuple[int, Callable[[Mapping[str, Any], int], tuple[list[Any], Any]]]
"""Slab size, and a function of the varying parameters and their number that gives values and status codes."""


def _numpy_work(machine: Machine, fixed: Mapping[str, Any], quantities: tuple[str, ...]) -> Work:
    def call(varied: Mapping[str, Any], count: int) -> tuple[list[Any], Any]:
        with np.errstate(all="ignore"):
            response = respond(with_values(machine, {**fixed, **varied}))
            found = [QUANTITIES[name].value(response) for name in quantities]
        return [np.broadcast_to(value, count) for value in found], np.broadcast_to(response.status, count)

    return NUMPY_SLAB, call


def _compiled_work(machine: Machine, fixed: Mapping[str, Any], quantities: tuple[str, ...]) -> Work:
    from kinetostat.engine import compiled  # JAX takes seconds to import: only where it pays

    kernel = compiled.slab_kernel(machine, quantities)

    def call(varied: Mapping[str, Any], count: int) -> tuple[list[Any], Any]:
        padded = {path: _padded(column, compiled.SLAB) for path, column in varied.items()}
        found, codes = compiled.run(kernel, fixed, padded)
        return [value[:count] for value in found], codes[:count]

    return compiled.SLAB, call


def _padded(column: Any, size: int) -> Any:
    """The column lengthened to `size` by its last value."""
    if isinstance(column, Angle):
        return Angle(_padded(column.cos, size), _padded(column.sin, size))
    missing = size - len(column)
    return np.pad(column, (0, missing), mode="edge") if missing else column


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
