"""States of rest of slabs of points: Newton's steps as a program that is repeated, and the quantities at their end.

No formula lives here. The coordinates of the states are columns of the programs. Points at which this does not end
surely in a stable state of rest are NOT_CONVERGED, and left to the solver for any machine.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from threading import Lock
from typing import Literal

import numpy as np

from kinetostat.arrays import Array, Codes
from kinetostat.engine.form import (
    Form,
    Specimen,
    TracedFormula,
    TraceOptions,
    form_of,
    formula_of,
    new_inputs,
    objectives_of,
    plan_for,
    result_of,
    traced_joints,
    traced_machine,
)
from kinetostat.engine.kernel import program_columns, program_of, recipe_of
from kinetostat.engine.trace import Runnable
from kinetostat.equilibrium.reduced import reduced_machine
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.written.family import at_home
from kinetostat.numerics.iteration import SHRINKING
from kinetostat.tolerances import LAST_STEP, ONE_STEP_AWAY

MOST_NEWTON_STEPS = 8
"""Most steps of Newton's method per point after the program of the first step, whatever other points need."""
MOST_CHORD_STEPS = 6
"""Most steps of the chord method per point: each leaves less than a tenth (`SHRINKING`) of the one before it, so that
six lead from 1e-6 to `LAST_STEP`. Newton's method goes on where that was not enough."""
NUMBERS_TOGETHER = 2**17
"""Numbers that a step gives for points that are evaluated together: they stay in the second cache level until the next
step takes them, and there are enough points for the call of a program to cost nothing beside them."""


RestStep = Literal["first", "newton", "chord"]
"""Steps towards a state of rest: from the free state, by Newton's method, and by the chord method."""


def step_of(kind: Specimen, form: Form, closed: bool, step: RestStep = "newton") -> TracedFormula:
    """Trace a step towards rest: from coordinates of the state, which are the last columns, to them.

    The last result is the square of the step's size. The first step begins at the free state, without columns of
    coordinates; steps of the chord method are those of `Reduced.chord_step`.

    Args:
        kind: kind of a machine whose equations can be reduced.
        form: how its parameters enter.
        closed: as in `TraceOptions`.
        step: which step it is.
    """
    traced = traced_machine(kind, form)
    joints, columns = traced_joints(traced, closed)
    equations = reduced_machine(traced.machine, respond(traced.machine, joints), joints)
    coordinates = () if step == "first" else new_inputs(traced.graph, equations.size)
    match step:
        case "first":
            after, square = equations.start()
        case "newton":
            after, square = equations.step([*coordinates])
        case "chord":
            after, square = equations.chord_step([*coordinates])
    results = [result_of(value) for value in (*after, square)]
    return formula_of(traced, columns, results, 0.0, coordinates=coordinates)


class StepMemory:
    """Memory for two steps of some points, which change places after each step: a program cannot write what it reads.

    Attributes:
        last: results of the last step [rows x points].
        next: room for those of the next one [rows x points].
    """

    def __init__(self, rows: int, points: int) -> None:
        self.last, self.next = np.empty((rows, points)), np.empty((rows, points))

    def swap(self) -> None:
        """Take what was the next step for the last one."""
        self.last, self.next = self.next, self.last


class RestFill:
    """The fill of quantities at rest of machines whose loops are cut at rods alone.

    Small programs find the states, and one gives the quantities.
    """

    def __init__(self, machine: Machine, paths: Sequence[str], quantities: Sequence[str], closed: bool) -> None:
        """Trace the programs; arguments are those of `program_fill`."""
        self._machine, self._closed = machine, closed
        self._form, self._fixed = form_of(machine, paths)
        self._states = StatePrograms(machine, self._form, closed, native=True)
        self._program = _program_at_rest(machine, self._form, quantities, closed, stepping=False)

    def __call__(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Evaluate a slab, see `Fill`."""
        program_inputs = program_columns(self._machine, self._form, columns, len(status), self._closed)
        program_inputs += self._states.rest_coordinates(self._fixed, program_inputs, len(status))
        self._program.run(self._fixed, program_inputs, results, status)


def _program_at_rest(machine: Machine, form: Form, quantities: Sequence[str], closed: bool, stepping: bool) -> Runnable:
    """The program of quantities at states whose coordinates are its last columns; options as in `TraceOptions`."""
    objectives = tuple(((name, 1.0),) for name in quantities)
    plan = plan_for(machine, quantities, form.varying)
    options = TraceOptions(closed=closed, plan=plan, stepping=stepping)
    kind = Specimen(at_home(machine, form.varying))
    return program_of(recipe_of(objectives_of, kind, form, objectives=objectives, options=options))


class LegwiseRestFill:
    """The fill of quantities at rest of machines whose legs close loops.

    A step of Newton's method takes as long as the quantities, so that one program does both. Steps of the chord method,
    each a quarter of it, lead so near to the state that this program has to be repeated at few points. It gives the
    quantities, then the coordinates of the states, and in its last row the squares of the sizes of its steps.

    Attributes:
        form: how parameters enter the programs.
        fixed: values of those that are the same at all points.
        size: number of coordinates of a state of rest.
    """

    def __init__(self, machine: Machine, paths: Sequence[str], quantities: Sequence[str], closed: bool) -> None:
        """Trace the programs; arguments are those of `program_fill`."""
        self._machine, self._closed, self._count = machine, closed, len(quantities)
        self.form, self.fixed = form_of(machine, paths)
        step = partial(recipe_of, step_of, Specimen(at_home(machine, paths)), self.form, closed=closed)
        self._first, self._chord = program_of(step(step="first")), program_of(step(step="chord"))
        self._step = _program_at_rest(machine, self.form, quantities, closed, stepping=True)
        self.size = self._step.rows - self._count - 1

    def __call__(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Evaluate a slab, see `Fill`."""
        self.solve(program_columns(self._machine, self.form, columns, len(status), self._closed), results, status)

    def solve(self, program_inputs: list[Array], results: Array, status: Codes, states: Array | None = None) -> None:
        """Evaluate a slab.

        Args:
            program_inputs: columns of the programs before those of the states.
            results, status: see `Fill`.
            states: array for the coordinates of the states of rest [size x points], if they are wanted.
        """
        count = len(status)
        together = max(1, min(count, NUMBERS_TOGETHER // self._step.rows))
        memory = StepMemory(self._step.rows, together)
        for start in range(0, count, together):
            part = slice(start, start + together)
            some_states = None if states is None else states[:, part]
            self._fill([column[part] for column in program_inputs], results[:, part], status[part], some_states, memory)

    def _fill(
        self, program_inputs: list[Array], results: Array, status: Codes, states: Array | None, memory: StepMemory
    ) -> None:
        """Evaluate some points, see `solve`."""
        count = len(status)
        self._first.run(self.fixed, program_inputs, memory.last[self._count :, :count], np.empty(count, dtype=np.int8))
        self._approach(program_inputs, memory, count)
        starts, points = memory.last[self._count :, :count], np.arange(count)
        for _ in range(MOST_NEWTON_STEPS):
            stepped, codes = memory.next[:, : len(points)], np.empty(len(points), dtype=np.int8)
            self._step.run(self.fixed, [*program_inputs, starts[:-1]], stepped, codes)
            places = slice(None) if len(points) == count else points  # a slice is copied much faster
            results[:, places], status[places] = stepped[: self._count], codes
            if states is not None:
                states[:, places] = stepped[self._count : -1]
            moving = stepped[-1] > LAST_STEP**2
            if not moving.any():
                break
            starts = stepped[self._count :]
            if not moving.all():
                points, program_inputs = points[moving], [column[moving] for column in program_inputs]
                starts = starts.compress(moving, axis=1)
            memory.swap()

    def _approach(self, program_inputs: list[Array], memory: StepMemory, count: int) -> None:
        """Take steps of the chord method towards the states of rest, as long as they shrink fast.

        Args:
            program_inputs: columns of the programs before those of the states.
            memory: its last step has the states, before and after.
            count: number of points.
        """
        points = np.arange(count)
        for _ in range(MOST_CHORD_STEPS):
            states = memory.last[self._count :, :count]
            is_all = len(points) == count
            starts = states if is_all else states.take(points, axis=1)
            columns = program_inputs if is_all else [column[points] for column in program_inputs]
            stepped, codes = memory.next[self._count :, : len(points)], np.empty(len(points), dtype=np.int8)
            self._chord.run(self.fixed, [*columns, starts[:-1]], stepped, codes)
            square_before, square = starts[-1], stepped[-1]
            shrinking = square < SHRINKING**2 * square_before
            # The next step will be shorter by the same ratio: size * (size / size before).
            unfinished = shrinking & (square * square > LAST_STEP**2 * square_before)
            stalled = ~shrinking & (square_before >= 0.0)  # not where the size is NaN: there is no state to be lost
            if is_all and not stalled.any():
                memory.swap()
            else:
                states[:, points[shrinking]] = stepped.compress(shrinking, axis=1)
            points = points[unfinished]
            if not len(points):
                break


class StatePrograms:
    """Programs that find states of rest of machines of one kind and form."""

    def __init__(self, machine: Machine, form: Form, closed: bool, native: bool) -> None:
        """Trace the first steps.

        Args:
            machine: a machine whose loops can be cut.
            form: how its parameters enter.
            closed: whether joints are closed inside the programs.
            native: whether to compile.
        """
        self._kind = Specimen(at_home(machine, form.varying) if native else machine)
        self._form, self._closed, self._native = form, closed, native
        self._making = Lock()
        self._first = self._step("first")
        self._size = self._first.rows - 1  # the last result is the square of the size of the step

    def _step(self, step: RestStep) -> Runnable:
        with self._making:  # threads that need a program at the same time wait until it is there
            recipe = recipe_of(step_of, self._kind, self._form, closed=self._closed, step=step)
            return program_of(recipe, self._native)

    def rest_coordinates(self, fixed: Array, program_inputs: Sequence[Array], count: int) -> list[Array]:
        """Find the states of rest: a row of points for each coordinate.

        A point without one nearby has NaN, or the coordinates of the last step where its steps do not settle.

        Args:
            fixed: values of the parameters that are the same at all points.
            program_inputs: columns of the others, and of joints if they are not closed inside the programs.
            count: number of points.
        """
        result, codes = np.empty((self._size + 1, count)), np.empty(count, dtype=np.int8)
        self._first.run(fixed, program_inputs, result, codes)
        for _ in range(MOST_NEWTON_STEPS):
            moving = result[-1] > ONE_STEP_AWAY**2
            points = np.flatnonzero(moving)
            if not len(points):
                break
            step, columns = self._step("newton"), [*program_inputs, *result[:-1]]
            # Picking out more than half of the points would take longer than computing the others as well.
            computes_all = 2 * len(points) > count
            if not computes_all:
                columns = [column[points] for column in columns]
            stepped = np.empty((self._size + 1, len(columns[0])))
            step.run(fixed, columns, stepped, codes[: len(columns[0])])
            if computes_all:
                np.copyto(result, stepped, where=moving)
            else:
                result[:, points] = stepped
        return [*result[:-1]]
