"""A machine as a program for slabs of points: its formulas traced, compiled and kept. Holds no formula.

Fixed parameters that are exactly 0 or infinite become part of the code, so that what they multiply is not computed at
all, what cancels by form is not computed either, and where all springs are ordinary the code for rigid and free ones is
left out. A new machine of the same form, with other numbers, uses the same program.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from kinetostat.arrays import Array, Codes
from kinetostat.engine.form import Form, Kind, angles, form_of, joint_columns, objectives_of, reduced
from kinetostat.engine.trace import Runnable
from kinetostat.kinematics.closure import solver_of, task_of
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine

KEPT = 64
"""Programs kept in memory, of some 20 kB each."""

Fill = Callable[[Mapping[str, Array], Array, Codes], None]
"""From the varying parameters of a slab [points] to its results [quantities x points] and status codes, in place."""


def fill_some(chosen: Any, fill: Fill, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
    """Evaluate some points of a slab by a fill of their own.

    Args:
        chosen: an index of the points: numbers or a mask.
        fill: evaluates them.
        columns: values of the varying parameters of all points by leaf path, SI [points].
        results, status: of all points; only those of the chosen ones are written.
    """
    part, codes = np.ascontiguousarray(results[:, chosen]), status[chosen]
    fill({path: column[chosen] for path, column in columns.items()}, part, codes)
    results[:, chosen], status[chosen] = part, codes


def falling_back(first: Fill, other: Callable[[], Fill]) -> Fill:
    """Compose two fills: the other takes the points at which the first finds no joints (NOT_CONVERGED).

    Closed forms inside a program and the equations outside it are so composed; the other fill is made when the first
    point needs it, because it costs a compilation.
    """

    def fill(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        first(columns, results, status)
        left = np.flatnonzero(status == Status.NOT_CONVERGED)
        if left.size:
            fill_some(left, other(), columns, results, status)

    return fill


@dataclass(frozen=True)
class Kernel:
    """A program with its fixed parameters filled in.

    Attributes:
        program: the compiled code.
        fixed: values of its fixed inputs, SI.
        varying: leaf paths of its columns, in order.
        angles: leaf paths of all angles.
        machine: of which this is the program.
        quantities: names of its results.
        closed: whether it computes joint coordinates itself, in closed form. Otherwise they are found slab by slab and
            are further columns, unless the family places the joints.
    """

    program: Runnable
    fixed: Array
    varying: tuple[str, ...]
    angles: frozenset[str]
    machine: Machine
    quantities: tuple[str, ...]
    closed: bool

    def run(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Evaluate a slab of points; other threads run meanwhile.

        Args:
            columns: values of the varying parameters by leaf path, SI [points].
            results: where the quantities go, a row each [quantities x points]: NaN where the status is not OK. Rows
                may lie apart, the points of a row may not.
            status: where the `Status` codes go [points].
        """
        fill = falling_back(self._fill, self._outside) if self.closed else self._fill
        fill(columns, results, status)

    def _fill(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        given = program_columns(columns, self.varying, self.angles)
        if self.machine.family.chains is not None and not self.closed:
            given += joint_columns(self.machine, columns, len(status))
        self.program.run(self.fixed, given, results, status)

    def _outside(self) -> Fill:
        """The program of the same quantities with joints as columns."""
        return _kernel(self.machine, self.varying, self.quantities, closed=False).run


def program_columns(columns: Mapping[str, Array], varying: Sequence[str], turning: frozenset[str]) -> list[Array]:
    """Return the varying parameters as a program takes them: contiguous, angles within what traced cosines take.

    Args:
        columns: values by leaf path, SI [points].
        varying: leaf paths, in the order of the program's columns.
        turning: leaf paths of all angles.
    """
    served = [np.ascontiguousarray(columns[path], dtype=float) for path in varying]
    return [reduced(column) if path in turning else column for path, column in zip(varying, served, strict=True)]


def slab_kernel(machine: Machine, varying: Sequence[str], quantities: Sequence[str]) -> Kernel:
    """Return the program for slabs of points of a machine; 0.1 s unless one of its form has been compiled.

    Args:
        machine: its family, and all parameters that do not vary.
        varying: leaf paths of the parameters that vary.
        quantities: names from `QUANTITIES`.
    """
    return _kernel(machine, varying, quantities, closes_inside(machine))


def closes_inside(machine: Machine) -> bool:
    """Tell whether a program for a machine can compute its joint coordinates itself."""
    return machine.family.chains is not None and solver_of(task_of(machine), traced=True).traceable


def _kernel(machine: Machine, varying: Sequence[str], quantities: Sequence[str], closed: bool) -> Kernel:
    form, numbers = form_of(machine, varying)
    names = tuple(quantities)
    return Kernel(
        _program(Kind(machine), form, names, closed), numbers, form.varying, angles(machine), machine, names, closed
    )


@lru_cache(KEPT)
def _program(kind: Kind, form: Form, quantities: tuple[str, ...], closed: bool) -> Runnable:
    from kinetostat.engine.native import Program  # LLVM takes 0.1 s to load: only where it pays

    return Program(objectives_of(kind, form, [((name, 1.0),) for name in quantities], closed=closed).body)
