"""A machine as a program for slabs of points: its formulas traced, compiled and kept. Holds no formula.

Fixed parameters that are exactly 0 or infinite become part of the code, so that what they multiply is not computed at
all, and where all springs are ordinary the code for rigid and free ones is left out. A new machine of the same form,
with other numbers, uses the same program.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from kinetostat.algebra.scalar import Scalar, where
from kinetostat.engine.native import Array, Body, Codes, Program
from kinetostat.engine.trace import Graph, Operand, Traced
from kinetostat.engine.trigonometry import LARGEST_ANGLE
from kinetostat.kinematics.closed_form import closed_joints
from kinetostat.kinematics.closure import Joints, solve_joints
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values

ORDINARY = (1e-100, 1e100)
"""Sizes between which a number and its reciprocal are by a wide margin neither zero nor infinite."""
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

    program: Program
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
        reduced = [_reduced(c) if p in self.angles else c for p, c in zip(self.varying, served, strict=True)]
        if self.iterated:
            joints = solve_joints(with_values(self.machine, columns))
            found = (*joints.coordinates, joints.status)
            reduced += [np.ascontiguousarray(np.broadcast_to(c, status.shape), dtype=float) for c in found]
        self.program.run(self.fixed, reduced, results, status)
        if not self.iterated and self.machine.family.chains is not None:
            self._iterate(columns, results, status)

    def _iterate(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Find by Newton's method the joints at those points where closed forms do not close the legs."""
        left = np.flatnonzero(status == Status.NOT_CONVERGED)
        if left.size:
            found, codes = np.empty((len(results), left.size)), np.empty(left.size, dtype=status.dtype)
            kernel = slab_kernel(self.machine, self.varying, self.quantities, iterated=True)
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
    angles = frozenset(p.path for p in parameters(machine.family) if p.quantity.kind == "angle")
    fixed = {path: float(value) for path, value in values(machine).items() if path not in varying}
    fixed |= {path: float(_reduced(np.array(fixed[path]))) for path in angles & fixed.keys()}
    constant = tuple((path, value) for path, value in fixed.items() if value == 0.0 or math.isinf(value))
    inputs = {path: value for path, value in fixed.items() if path not in dict(constant)}
    ordinary = frozenset(path for path, value in inputs.items() if ORDINARY[0] < abs(value) < ORDINARY[1])
    form = _Form(constant, tuple(inputs), ordinary, tuple(varying), tuple(quantities), iterated)
    numbers = np.array([*inputs.values()], dtype=float)
    return Kernel(_program(_Kind(machine), form), numbers, form.varying, angles, machine, form.quantities, iterated)


def needs_iteration(machine: Machine) -> bool:
    """Whether Newton's method has to find the joints of a machine, judged at its pose."""
    if machine.family.chains is None:
        return False
    closed = closed_joints(machine.chains())
    return closed is None or closed[1] == Status.NOT_CONVERGED or solve_joints(machine).status == Status.SINGULAR


def _reduced(angle: Array) -> Array:
    """The angles (rad), turned back to between -pi and pi if any is beyond what traced cosines take."""
    if angle.size == 0 or max(angle.max(), -angle.min()) <= LARGEST_ANGLE:
        return angle
    with np.errstate(invalid="ignore"):
        return np.arctan2(np.sin(angle), np.cos(angle))


@dataclass(frozen=True)
class _Form:
    """All that a program depends on beside the family: what is constant, fixed, ordinary, varying, wanted, iterated."""

    constant: tuple[tuple[str, float], ...]
    inputs: tuple[str, ...]
    ordinary: frozenset[str]
    varying: tuple[str, ...]
    quantities: tuple[str, ...]
    iterated: bool


@dataclass(frozen=True, eq=False)
class _Kind:
    """A machine as a specimen of its family: equal to every other one of it."""

    machine: Machine

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Kind) and self.machine.family == other.machine.family

    def __hash__(self) -> int:
        return hash(self.machine.family)


@lru_cache(KEPT)
def _program(kind: _Kind, form: _Form) -> Program:
    graph = Graph()
    fixed = {path: graph.input(fixed=True, ordinary=path in form.ordinary) for path in form.inputs}
    columns = {path: graph.input() for path in form.varying}
    machine = with_values(kind.machine, {**dict(form.constant), **fixed, **columns})
    joints = [graph.input() for _ in range(kind.machine.chains().size + 1)] if form.iterated else []
    response = respond(machine, _joints(machine, joints))
    accepted = response.status < Status.OK + 0.5
    results = [where(accepted, QUANTITIES[name].value(response), math.nan) for name in form.quantities]
    numbers = [_number(result) for result in results]
    return Program(Body([*fixed.values()], [*columns.values(), *joints], numbers, _number(response.status)))


def _joints(machine: Machine, columns: Sequence[Traced]) -> Joints | None:
    """Joint coordinates and status: columns if they are found elsewhere, else in closed form."""
    if columns:
        return Joints(tuple(columns[:-1]), columns[-1])
    closed = closed_joints(machine.chains()) if machine.family.chains else None
    return Joints(tuple(closed[0]), closed[1]) if closed else None


def _number(value: Scalar) -> Operand:
    """A result as a program takes it: a node, or a float where it depends on nothing."""
    return float(value) if isinstance(value, int | float) else value
