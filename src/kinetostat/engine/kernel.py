"""A machine as a program for slabs of points: its formulas traced, compiled and kept. Holds no formula.

Fixed parameters that are exactly 0 or infinite become part of the code, so that what they multiply is not computed at
all, what cancels by form is not computed either, and where all springs are ordinary the code for rigid and free ones is
left out. A new machine of the same form,
with other numbers, uses the same program.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from kinetostat.algebra.scalar import where
from kinetostat.engine.form import Form, Kind, angles, form_of, number, reduced, traced
from kinetostat.engine.native import Program
from kinetostat.engine.trace import Array, Body, Codes, Runnable, Traced
from kinetostat.kinematics.closed_form import closed_joints
from kinetostat.kinematics.closure import Joints, solve_joints
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values

KEPT = 64
"""Programs kept in memory, of some 20 kB each."""


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
        iterated: whether joint coordinates are found slab by slab, by Newton's method, and are columns of the program.
    """

    program: Runnable
    fixed: Array
    varying: tuple[str, ...]
    angles: frozenset[str]
    machine: Machine
    quantities: tuple[str, ...]
    iterated: bool

    def run(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Evaluate a slab of points; other threads run meanwhile.

        Args:
            columns: values of the varying parameters by leaf path, SI [points].
            results: where the quantities go, a row each [quantities x points]: NaN where the status is not OK. Rows
                may lie apart, the points of a row may not.
            status: where the `Status` codes go [points].
        """
        served = [np.ascontiguousarray(columns[path], dtype=float) for path in self.varying]
        given = [reduced(c) if p in self.angles else c for p, c in zip(self.varying, served, strict=True)]
        if self.iterated:
            joints = solve_joints(with_values(self.machine, columns))
            found = (*joints.coordinates, joints.status)
            given += [np.ascontiguousarray(np.broadcast_to(c, status.shape), dtype=float) for c in found]
        self.program.run(self.fixed, given, results, status)
        if not self.iterated and self.machine.family.chains is not None:
            self._iterate(columns, results, status)

    def _iterate(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Find by Newton's method the joints at those points where closed forms do not close the legs."""
        left = np.flatnonzero(status == Status.NOT_CONVERGED)
        if left.size:
            found, codes = np.empty((len(results), left.size)), np.empty(left.size, dtype=status.dtype)
            kernel = slab_kernel(self.machine, self.varying, self.quantities, True)
            kernel.run({path: column[left] for path, column in columns.items()}, found, codes)
            results[:, left], status[left] = found, codes


def slab_kernel(
    machine: Machine, varying: Sequence[str], quantities: Sequence[str], iterated: bool | None = None
) -> Kernel:
    """The program for slabs of points of a machine; about 0.1 s unless one of the same form has been compiled.

    Args:
        machine: its family, and all parameters that do not vary.
        varying: leaf paths of the parameters that vary.
        quantities: names from `QUANTITIES`.
        iterated: see `Kernel`; None to decide.
    """
    if iterated is None:
        iterated = needs_iteration(machine)
    form, numbers = form_of(machine, varying)
    names = tuple(quantities)
    program = _program(Kind(machine), form, names, iterated)
    return Kernel(program, numbers, form.varying, angles(machine), machine, names, iterated)


def needs_iteration(machine: Machine) -> bool:
    """Whether Newton's method has to find the joints of a machine, judged at its pose."""
    if machine.family.chains is None:
        return False
    closed = closed_joints(machine.chains())
    return closed is None or closed[1] == Status.NOT_CONVERGED or solve_joints(machine).status == Status.SINGULAR


@lru_cache(KEPT)
def _program(kind: Kind, form: Form, quantities: tuple[str, ...], iterated: bool) -> Runnable:
    given = traced(kind, form)
    joints = [given.graph.input() for _ in range(kind.machine.chains().size + 1)] if iterated else []
    response = respond(given.machine, _joints(given.machine, joints))
    accepted = response.status < Status.OK + 0.5
    results = [where(accepted, QUANTITIES[name].value(response), math.nan) for name in quantities]
    numbers = [number(result) for result in results]
    body = Body(given.fixed, [*given.columns.values(), *joints], numbers, number(response.status))
    return Program(body)


def _joints(machine: Machine, columns: Sequence[Traced]) -> Joints | None:
    """Joint coordinates and status: columns if they are found elsewhere, else in closed form."""
    if columns:
        return Joints(tuple(columns[:-1]), columns[-1])
    closed = closed_joints(machine.chains()) if machine.family.chains else None
    return Joints(tuple(closed[0]), closed[1]) if closed else None
