"""Modes over springs at many points: a program computes the matrices of all points, another one their eigenvalues.

Where the modes themselves are wanted, LAPACK finds them. The formulas are in `vibration.springwise`; here they are
traced and run.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from kinetostat.algebra.scalar import where
from kinetostat.arrays import Array, Mask
from kinetostat.engine.eigenvalues import Pencil, pencil_source
from kinetostat.engine.form import (
    Form,
    Specimen,
    TracedFormula,
    TracedMachine,
    formula_of,
    new_inputs,
    result_of,
    traced_joints,
    traced_machine,
)
from kinetostat.engine.kernel import machine_program_of, program_of, recipe_of, stored_code
from kinetostat.engine.machine_code import Program, compile_source, host_lanes
from kinetostat.engine.trace import Traced, rows_of
from kinetostat.equilibrium.reduced import reduced_machine
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.written.family import at_home
from kinetostat.tolerances import UNRESISTED
from kinetostat.vibration.modes import hertz
from kinetostat.vibration.springwise import Modal, ModeCounts, SpringMotions, motions_without_loads, sizes_over_springs


def modes_at_rest(
    machine: Machine, form: Form, fixed: Array, program_inputs: Sequence[Array], counts: ModeCounts, closed: bool
) -> list[Array]:
    """Find the modes of states of rest.

    Args:
        machine: a machine whose legs close loops.
        form: how its parameters enter the program.
        fixed: values of the parameters that are the same at all points.
        program_inputs: columns of the other parameters, of joints if they are not `closed`, and of the states of rest.
        counts: how many modes are wanted.
        closed: whether programs compute the joints that close the legs by themselves, in closed form.

    Returns:
        The modes as further columns of programs of quantities: an array [points] for each of their numbers.
    """
    program = program_of(recipe_of(spring_parts_of, Specimen(machine), form, closed=closed, at_rest=True), native=False)
    points, sizes = len(program_inputs[0]), sizes_over_springs(machine)
    parts = np.empty((program.rows, points))
    program.run(fixed, program_inputs, parts, np.empty(points, dtype=np.int8))
    modes = [sizes.modes(parts, counts.loaded), sizes.modes(parts, counts.factor, massive=False)]
    return [*np.ascontiguousarray(np.concatenate(modes, axis=1).reshape(points, -1).T)]


def spring_parts_of(kind: Specimen, form: Form, closed: bool, at_rest: bool) -> TracedFormula:
    """Trace the matrices of which modes over springs are found, see `SpringMotions.parts`.

    Args:
        kind, form, closed: as for `step_of`, of a machine whose legs close loops.
        at_rest: whether the machine is at rest under its loads, whose coordinates are then the last columns; otherwise
            its springs are relaxed.
    """
    traced, columns, coordinates, motions = _traced_motions(kind, form, closed, at_rest)
    return formula_of(traced, columns, [result_of(part) for part in motions.parts()], 0.0, coordinates=coordinates)


def pencil_of(kind: Specimen, form: Form, closed: bool, what: Modal) -> TracedFormula:
    """Trace the matrices of which eigenvalues are found; the code says whether they are sure.

    Args:
        kind, form, closed: as for `spring_parts_of`.
        what: see `SpringMotions.pencil`.
    """
    traced, columns, coordinates, motions = _traced_motions(kind, form, closed, at_rest=what != "free")
    results = [result_of(part) for part in motions.pencil(what)]
    code = result_of(where(motions.sure, int(Status.OK), int(Status.NOT_CONVERGED)))
    return formula_of(traced, columns, results, code, coordinates=coordinates)


def _traced_motions(
    kind: Specimen, form: Form, closed: bool, at_rest: bool
) -> tuple[TracedMachine, tuple[Traced, ...], tuple[Traced, ...], SpringMotions]:
    """A traced machine, columns of its joints and of its state of rest, and its motions; arguments as above."""
    traced = traced_machine(kind, form)
    joints, columns = traced_joints(traced, closed)
    response = respond(traced.machine, joints)
    if not at_rest:
        return traced, columns, (), motions_without_loads(traced.machine, response, joints)
    equations = reduced_machine(traced.machine, response, joints)
    coordinates = new_inputs(traced.graph, equations.size)
    return traced, columns, coordinates, SpringMotions(equations.cut, [*coordinates])


ALIGNED = 8
"""Numbers from one place in memory at which a vector may begin to the next: as many as the widest vector holds."""
POINTS_TOGETHER = 64
"""Points whose matrices are found and solved together, so that they stay in the second cache level in between."""


def rows_of_modes(names: Sequence[str]) -> dict[Modal, dict[str, int]]:
    """Sort quantities that follow from modes by what they are about, with the number of the mode of each, from 1."""
    result: dict[Modal, dict[str, int]] = {}
    for name in names:
        quantity = QUANTITIES[name]
        what: Modal = "factor" if quantity.loaded == "factor" else "loaded" if quantity.loaded else "free"
        result.setdefault(what, {})[name] = 1 if what == "factor" else int(name.rpartition("_")[2])
    return result


@lru_cache
def eigenvalue_program(pencil: Pencil) -> Program:
    """Return the program of a pencil, as an earlier process has left it on disk, or compiled.

    In the place of fixed inputs it takes a workspace, which is filled with zeros and begins where a vector may.
    """
    return Program(stored_code(repr(pencil), lambda: compile_source(pencil_source(pencil, host_lanes()), pencil.count)))


class ModalNumbers:
    """Natural frequencies or load factors of machines of a kind and form whose legs close loops, by machine code.

    Attributes:
        at_rest: whether they are those of states of rest.
    """

    def __init__(self, machine: Machine, form: Form, closed: bool, what: Modal, count: int) -> None:
        """Trace and compile the programs.

        Args:
            machine: the machine with its masses.
            form: how its parameters enter.
            closed: whether joints are closed inside the programs.
            what: the numbers.
            count: how many of them, the most critical first.
        """
        self.at_rest, self._what = what != "free", what
        kind = Specimen(at_home(machine, form.varying) if closed else machine)
        self._pencil = Pencil(sizes_over_springs(machine), count, what == "loaded")
        with np.errstate(all="ignore"):  # traced values in arrays have no flags of their own; NumPy shows old ones
            self._matrices = machine_program_of(recipe_of(pencil_of, kind, form, closed=closed, what=what))
        self._eigenvalues = eigenvalue_program(self._pencil)

    def at(self, fixed: Array, program_inputs: Sequence[Array]) -> tuple[Array, Mask]:
        """Find the numbers at some points.

        Args:
            fixed: values of the parameters that are the same at all points.
            program_inputs: columns of the other parameters, of joints if they are not closed inside, and of states of
                rest.

        Returns:
            The numbers [count x points], frequencies in Hz: infinite where there are fewer, NaN where springs and loads
            do not hold the machine; and whether the programs are sure of them [points].
        """
        squares, sure = self._eigenvalues_at(fixed, np.array(rows_of(program_inputs)))
        with np.errstate(all="ignore"):
            if self._what == "factor":
                return np.where(squares > UNRESISTED, 1.0 / squares, np.where(np.isnan(squares), np.nan, np.inf)), sure
            return hertz(squares.T).T, sure

    def _eigenvalues_at(self, fixed: Array, columns: Array) -> tuple[Array, Mask]:
        """Eigenvalues [count x points], and whether they are sure [points], a block of points at a time.

        The last block is moved back to end with the last point; where there are fewer points than lanes, the last one
        is repeated.
        """
        points = columns.shape[1]
        size, lanes = min(points, POINTS_TOGETHER), self._eigenvalues.lanes
        eigenvalues, codes = np.empty((self._pencil.count, points)), np.empty(points, dtype=np.int8)
        block, matrices, roots = (
            _memory_of_vectors(rows, max(size, lanes))
            for rows in (len(columns), self._matrices.rows, self._pencil.count)
        )
        statuses = np.empty(block.shape[1], dtype=np.int8)
        workspace = _memory_of_vectors(self._pencil.layout.size, lanes)
        workspace[:] = 0.0
        calls = (
            self._matrices.call_on(fixed, [block], matrices, statuses),
            self._eigenvalues.call_on(workspace, [matrices], roots, np.empty_like(statuses)),
        )
        for first in range(0, points, max(size, 1)):
            start = min(first, points - size)
            part = slice(start, start + size)
            block[:, :size], block[:, size:] = columns[:, part], columns[:, part][:, -1:]
            for call in calls:
                call()
            eigenvalues[:, part], codes[part] = roots[:, :size], statuses[:size]
        return eigenvalues, codes == int(Status.OK)


def _memory_of_vectors(rows: int, length: int) -> Array:
    """An array of which each row begins where a vector may, if its length is a multiple of one."""
    memory = np.empty(rows * length + ALIGNED)
    first = -memory.ctypes.data // memory.itemsize % ALIGNED
    return memory[first : first + rows * length].reshape(rows, length)
