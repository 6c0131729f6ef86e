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
    result_of,
    traced_joints,
    traced_machine,
)
from kinetostat.engine.kernel import program_columns, program_of, program_of_quantities, recipe_of
from kinetostat.engine.trace import Runnable
from kinetostat.equilibrium.reduced import reduced_machine
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.written.family import at_home
from kinetostat.numerics.iteration import SHRINKING
from kinetostat.tolerances import LAST_STEP, ONE_STEP_AWAY

MOST_NEWTON_STEPS = 8
"""Most steps of Newton's method per point, whatever other points need: they converge quadratically, so that three or
four do, and a point that needs more than eight is one for the solver for any machine."""
MOST_CHORD_STEPS = 6
"""Most steps of the chord method per point: each leaves less than a tenth (`SHRINKING`) of the one before it, so that
six lead from 1e-6 to `LAST_STEP`. Newton's method goes on where that was not enough."""
NUMBERS_PER_STEP = 2**17
"""Most numbers in the result of one step. Points are evaluated in groups of this size: a megabyte of numbers stays in
the second cache level until the next step reads it, and the cost of calling a program is small beside a group."""


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


@dataclass(frozen=True)
class StepResults:
    """The results of a step at some points, as programs write them.

    Attributes:
        rows: the quantities, coordinates of the states after the step, and squares of its sizes [rows x points].
        count: number of the quantities; 0 of programs that only take steps.
    """

    rows: Array
    count: int = 0

    @property
    def quantities(self) -> Array:
        """The quantities [count x points]."""
        return self.rows[: self.count]

    @property
    def step(self) -> Array:
        """The part that a program of steps alone writes: coordinates and squares [coordinates + 1 x points]."""
        return self.rows[self.count :]

    @property
    def states(self) -> Array:
        """The coordinates of the states after the step [coordinates x points]."""
        return self.rows[self.count : -1]

    @property
    def squares(self) -> Array:
        """The squares of the sizes of the step [points]."""
        return self.rows[-1]

    def first(self, points: int) -> "StepResults":
        """Those of the first points."""
        return StepResults(self.rows[:, :points], self.count)


class StepMemory:
    """Memory for two steps of some points: a program cannot write what it reads.

    Attributes:
        read: results of the last step, from which the next one starts.
        written: room for the results of the next step.
    """

    def __init__(self, rows: int, count: int, points: int) -> None:
        """Take memory for so many rows, of which `count` are quantities."""
        self.read, self.written = (StepResults(np.empty((rows, points)), count) for _ in range(2))

    def swap(self) -> None:
        """Let the next step read what was written."""
        self.read, self.written = self.written, self.read


class RestFill:
    """The fill of quantities at rest of machines whose loops are cut at rods alone.

    Small programs find the states, and one gives the quantities.
    """

    def __init__(self, machine: Machine, paths: Sequence[str], quantities: Sequence[str], closed: bool) -> None:
        """Trace the programs; arguments are those of `program_fill`."""
        self._machine, self._closed = machine, closed
        self._form, self._fixed = form_of(machine, paths)
        self._states = StatePrograms(machine, self._form, closed, native=True)
        self._program = program_of_quantities(machine, self._form, quantities, TraceOptions(closed=closed))

    def __call__(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Evaluate a slab, see `Fill`."""
        program_inputs = program_columns(self._machine, self._form, columns, len(status), self._closed)
        program_inputs += self._states.rest_coordinates(self._fixed, program_inputs, len(status))
        self._program.run(self._fixed, program_inputs, results, status)


class LegwiseRestFill:
    """The fill of quantities at rest of machines whose legs close loops.

    A step of Newton's method takes as long as the quantities, so that one program does both. Steps of the chord method,
    each a quarter of it, lead so near to the state that this program has to be repeated at few points.

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
        options = TraceOptions(closed=closed, stepping=True)
        self._program = program_of_quantities(machine, self.form, quantities, options)
        self.size = self._program.rows - self._count - 1  # the last row is the square of the step's size

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
        group = max(1, min(count, NUMBERS_PER_STEP // self._program.rows))
        memory = StepMemory(self._program.rows, self._count, group)
        for start in range(0, count, group):
            part = slice(start, start + group)
            some_states = None if states is None else states[:, part]
            self._fill([column[part] for column in program_inputs], results[:, part], status[part], some_states, memory)

    def _fill(
        self, program_inputs: list[Array], results: Array, status: Codes, states: Array | None, memory: StepMemory
    ) -> None:
        """Evaluate some points, see `solve`."""
        count = len(status)
        self._first.run(self.fixed, program_inputs, memory.read.first(count).step, np.empty(count, dtype=np.int8))
        self._approach(program_inputs, memory, count)
        coordinates, points = memory.read.first(count).states, np.arange(count)
        for _ in range(MOST_NEWTON_STEPS):
            stepped, codes = memory.written.first(len(points)), np.empty(len(points), dtype=np.int8)
            self._program.run(self.fixed, [*program_inputs, coordinates], stepped.rows, codes)
            places = slice(None) if len(points) == count else points  # a slice is copied much faster
            results[:, places], status[places] = stepped.quantities, codes
            if states is not None:
                states[:, places] = stepped.states
            moving = stepped.squares > LAST_STEP**2
            if not moving.any():
                break
            coordinates = stepped.states
            if not moving.all():
                points, program_inputs = points[moving], [column[moving] for column in program_inputs]
                coordinates = coordinates.compress(moving, axis=1)
            memory.swap()

    def _approach(self, program_inputs: list[Array], memory: StepMemory, count: int) -> None:
        """Take steps of the chord method towards the states of rest, as long as they shrink fast.

        Args:
            program_inputs: columns of the programs before those of the states.
            memory: the states are read from it, and their last ones are what it reads afterwards.
            count: number of points.
        """
        points = np.arange(count)
        for _ in range(MOST_CHORD_STEPS):
            before = memory.read.first(count)
            is_all = len(points) == count
            last = before if is_all else StepResults(before.step.take(points, axis=1))
            columns = program_inputs if is_all else [column[points] for column in program_inputs]
            stepped, codes = memory.written.first(len(points)), np.empty(len(points), dtype=np.int8)
            self._chord.run(self.fixed, [*columns, last.states], stepped.step, codes)
            square_before, square = last.squares, stepped.squares
            shrinking = square < SHRINKING**2 * square_before
            # The next step will be shorter by the same ratio: size * (size / size before).
            unfinished = shrinking & (square * square > LAST_STEP**2 * square_before)
            stalled = ~shrinking & (square_before >= 0.0)  # not where the size is NaN: there is no state to be lost
            if is_all and not stalled.any():
                memory.swap()
            else:
                before.step[:, points[shrinking]] = stepped.step.compress(shrinking, axis=1)
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
        self._first = self._program_of("first")

    def _program_of(self, step: RestStep) -> Runnable:
        with self._making:  # threads that need a program at the same time wait until it is there
            recipe = recipe_of(step_of, self._kind, self._form, closed=self._closed, step=step)
            return program_of(recipe, self._native)

    def rest_coordinates(self, fixed: Array, program_inputs: Sequence[Array], count: int) -> list[Array]:
        """Find the states of rest: a row of points for each coordinate.

        Where steps do not settle, coordinates mean nothing, or are NaN: the program of the quantities judges them. The
        codes of the steps themselves say nothing and are dropped.

        Args:
            fixed: values of the parameters that are the same at all points.
            program_inputs: columns of the others, and of joints if they are not closed inside the programs.
            count: number of points.
        """
        reached, codes = StepResults(np.empty((self._first.rows, count))), np.empty(count, dtype=np.int8)
        self._first.run(fixed, program_inputs, reached.rows, codes)
        for _ in range(MOST_NEWTON_STEPS):
            moving = reached.squares > ONE_STEP_AWAY**2
            points = np.flatnonzero(moving)
            if not len(points):
                break
            columns = [*program_inputs, *reached.states]
            # Picking out more than half of the points would take longer than computing the others as well.
            computes_all = 2 * len(points) > count
            if not computes_all:
                columns = [column[points] for column in columns]
            stepped = np.empty((self._first.rows, len(columns[0])))
            self._program_of("newton").run(fixed, columns, stepped, codes[: len(columns[0])])
            if computes_all:
                np.copyto(reached.rows, stepped, where=moving)
            else:
                reached.rows[:, points] = stepped
        return [*reached.states]
