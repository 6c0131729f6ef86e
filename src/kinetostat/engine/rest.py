"""States of rest of slabs of points: Newton's steps as a program that is repeated, and the quantities at their end.

No formula lives here. The coordinates of the states are columns of the programs. Points at which this does not end
surely in a stable state of rest are NOT_CONVERGED, and left to the solver for any machine.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from threading import Lock

import numpy as np

from kinetostat.arrays import Array, Codes
from kinetostat.engine.form import Form, Specimen, form_of, objectives_of, plan_for, step_of
from kinetostat.engine.kernel import program_columns, program_of, recipe_of
from kinetostat.engine.trace import Runnable
from kinetostat.machine.machine import Machine
from kinetostat.machine.written.family import at_home
from kinetostat.numerics.iteration import SHRINKING

MOST_NEWTON_STEPS = 8
"""Of Newton's method after the first ones; each point takes as many as it needs, whatever its neighbours need."""
MOST_CHORD_STEPS = 6
"""Of the chord method before these: at a tenth of a step each, as many lead from the longest one to `LAST_STEP`."""
ONE_STEP_AWAY = 1e-7
"""Size of a step, rad or in units of the machine's length, after which another one is exact to round-off."""
LAST_STEP = 1e-12
"""Size of a step, in the same units, by which what resists at its two ends does not differ: the stiffness of slender
machines changes by a thousand times as much."""


NUMBERS_TOGETHER = 2**17
"""Numbers that a step gives for points that are evaluated together: they stay in the second cache level until the next
step takes them, and there are enough points for the call of a program to cost nothing beside them."""


class RestFill:
    """The fill of quantities at rest.

    Where loops are cut at rods, small programs find the state, and one gives the quantities. Where legs close loops, a
    step of Newton's method takes as long as the quantities, so that one program does both: steps of the chord method,
    each a quarter of it, lead so near to the state that this program has to be repeated at few points.

    Attributes:
        form: how parameters enter the programs.
        fixed: values of those that are the same at all points.
    """

    def __init__(
        self, machine: Machine, paths: Sequence[str], quantities: Sequence[str], closed: bool, legs: bool
    ) -> None:
        """Trace the programs.

        Args:
            machine, paths, quantities, closed: as for `program_fill`, of a machine whose loops can be cut.
            legs: whether legs close loops.
        """
        self._machine, self._closed, self._count = machine, closed, len(quantities)
        self.form, self.fixed = form_of(machine, paths)
        kind = Specimen(at_home(machine, paths))
        objectives = tuple(((name, 1.0),) for name in quantities)
        self._states = None if legs else StatePrograms(machine, self.form, closed, native=True)
        step = partial(recipe_of, step_of, kind, self.form, closed=closed)
        self._first = program_of(step(first=True))
        self._chord = program_of(step(chord=True)) if legs else None
        plan = plan_for(machine, quantities, paths)
        self._step = program_of(
            recipe_of(objectives_of, kind, self.form, objectives=objectives, closed=closed, plan=plan, stepping=legs)
        )

    @property
    def size(self) -> int:
        """Number of coordinates of a state of rest, where legs close loops."""
        return self._step.rows - self._count - 1

    def __call__(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Evaluate a slab, see `Fill`."""
        given = program_columns(self._machine, self.form, columns, len(status), self._closed)
        if self._states is None:
            self.solve(given, results, status)
            return
        given += self._states.rest_coordinates(self.fixed, given, len(status))
        self._step.run(self.fixed, given, results, status)

    def solve(self, given: list[Array], results: Array, status: Codes, states: Array | None = None) -> None:
        """Evaluate a slab of a machine whose legs close loops.

        Args:
            given: columns of the programs before those of the states.
            results, status: see `Fill`.
            states: where the coordinates of the states of rest go [size x points], if they are wanted.
        """
        count = len(status)
        together = min(count, NUMBERS_TOGETHER // self._step.rows)
        memory = [np.empty((self._step.rows, together)) for _ in range(2)]
        for start in range(0, count, max(together, 1)):
            part = slice(start, start + together)
            reached = None if states is None else states[:, part]
            self._fill([column[part] for column in given], results[:, part], status[part], reached, memory)

    def _fill(
        self, given: list[Array], results: Array, status: Codes, reached: Array | None, memory: list[Array]
    ) -> None:
        """Evaluate some points, with memory for what two steps give."""
        rows = np.arange(len(status))
        self._first.run(self.fixed, given, memory[0][self._count :, : len(rows)], np.empty_like(status))
        self._approach(given, memory, len(rows))
        states = memory[0][self._count :, : len(rows)]
        for _ in range(MOST_NEWTON_STEPS):
            stepped, codes = memory[1][:, : len(rows)], np.empty(len(rows), dtype=status.dtype)
            self._step.run(self.fixed, [*given, states[:-1]], stepped, codes)
            if len(rows) == len(status):
                results[:], status[:] = stepped[: self._count], codes
            else:
                results[:, rows], status[rows] = stepped[: self._count], codes
            if reached is not None:
                reached[:, rows] = stepped[self._count : -1]
            moving = stepped[-1] > LAST_STEP**2
            if not moving.any():
                break
            if moving.all():
                states = stepped[self._count :]
            else:
                rows, given = rows[moving], [part[moving] for part in given]
                states = np.compress(moving, stepped[self._count :], axis=1)
            memory.reverse()

    def _approach(self, given: list[Array], memory: list[Array], count: int) -> None:
        """Take steps of the chord method towards the states of rest, as long as they shrink fast.

        Args:
            given: columns of the programs before those of the states.
            memory: the first part holds the states, and in its last row the squares of the sizes of their last steps.
            count: number of points.
        """
        if self._chord is None:
            return
        rows = np.arange(count)
        for _ in range(MOST_CHORD_STEPS):
            states, after = (part[self._count :, :count] for part in memory)
            every = len(rows) == count
            at, here = (states, given) if every else (states.take(rows, axis=1), [part[rows] for part in given])
            stepped, codes = after[:, : len(rows)], np.empty(len(rows), dtype=np.int8)
            self._chord.run(self.fixed, [*here, at[:-1]], stepped, codes)
            before, size = at[-1], stepped[-1]
            shrinking = size < SHRINKING**2 * before
            # The next step is shorter by the same ratio.
            further = rows[shrinking & (size * size > LAST_STEP**2 * before)]
            if every and not (~shrinking & (before >= 0.0)).any():  # where there is no state, nothing is lost
                memory.reverse()
            else:
                states[:, rows[shrinking]] = stepped.compress(shrinking, axis=1)
            rows = further
            if not len(rows):
                break


class StatePrograms:
    """Programs that find states of rest of machines of one kind and form."""

    def __init__(self, machine: Machine, form: Form, closed: bool, native: bool) -> None:
        """Trace the first steps.

        Args:
            machine: whose loops can be cut.
            form: how its parameters enter.
            closed: whether joints are closed inside the programs.
            native: whether to compile.
        """
        self._kind = Specimen(at_home(machine, form.varying) if native else machine)
        self._form, self._closed, self._native = form, closed, native
        self._making = Lock()
        self._first = self._step(first=True)
        self._size = self._first.rows - 1  # the last result is how long the step is

    def _step(self, first: bool) -> Runnable:
        with self._making:  # threads that need a program at the same time wait until it is there
            recipe = recipe_of(step_of, self._kind, self._form, closed=self._closed, first=first)
            return program_of(recipe, self._native)

    def rest_coordinates(self, fixed: Array, given: Sequence[Array], count: int) -> list[Array]:
        """Find the states of rest: a row of points for each coordinate; NaN where there is none nearby.

        Args:
            fixed: values of the parameters that are the same at all points.
            given: columns of the others, and of joints if they are not closed inside the programs.
            count: of points.
        """
        result, codes = np.empty((self._size + 1, count)), np.empty(count, dtype=np.int8)
        self._first.run(fixed, given, result, codes)
        for _ in range(MOST_NEWTON_STEPS):
            moving = result[-1] > ONE_STEP_AWAY**2
            rows = np.flatnonzero(moving)
            if not len(rows):
                break
            step = self._step(first=False)
            most = 2 * len(rows) > count  # then picking them out would take longer than computing the others as well
            at = [*given, *result[:-1]] if most else [part[rows] for part in (*given, *result[:-1])]
            stepped = np.empty((self._size + 1, len(at[0])))
            step.run(fixed, at, stepped, codes[: len(at[0])])
            if most:
                np.copyto(result, stepped, where=moving)
            else:
                result[:, rows] = stepped
        return [*result[:-1]]
