"""The limits of a machine at many points: which is passed first, and how far each is used. Holds no formula."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from kinetostat.engine.batch import NUMPY_SLAB
from kinetostat.engine.points import Array
from kinetostat.kinematics.limits import Check
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values


def first_passed(machine: Machine, columns: Mapping[str, Array], fields: Sequence[str]) -> npt.NDArray[np.int64]:
    """Which limit is the first, in the order of the checks, that each point passes: its place in `fields`, or -1.

    Args:
        machine: with its limits.
        columns: values of the varying parameters by leaf path, SI [points].
        fields: names of the limits that are set.
    """
    size = len(next(iter(columns.values())))
    found = np.full(size, -1)
    for part, checks in _checked(machine, columns):
        for check in checks:
            beyond = ~np.broadcast_to(check.kept, found[part].shape) & (found[part] < 0)
            found[part][beyond] = fields.index(check.limit.name)
    return found


def used(machine: Machine, columns: Mapping[str, Array]) -> dict[str, tuple[float, float]]:
    """Least and greatest measure of each limit over some points and all parts, by the limit's name.

    Args:
        machine: all of whose limits that are of interest are set.
        columns: as above; of points that can be reached.
    """
    found: dict[str, tuple[float, float]] = {}
    for _, checks in _checked(machine, columns):
        for check in checks:
            least, most = found.get(check.limit.name, (np.inf, -np.inf))
            found[check.limit.name] = min(least, float(np.min(check.measure))), max(most, float(np.max(check.measure)))
    return found


def _checked(machine: Machine, columns: Mapping[str, Array]) -> Iterator[tuple[slice, tuple[Check, ...]]]:
    size = len(next(iter(columns.values())))
    for start in range(0, size, NUMPY_SLAB):
        part = slice(start, start + NUMPY_SLAB)
        with np.errstate(all="ignore"):
            yield part, respond(with_values(machine, {path: column[part] for path, column in columns.items()})).checks
