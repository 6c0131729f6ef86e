"""Loaded states of slabs of points: Newton's steps as a program that is repeated, then one for the quantities.

No formula lives here. The coordinates of the states are columns of both programs. Points at which this does not end
surely in a stable state of rest, and machines whose equations cannot be reduced, are left to the solver for any
machine.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum
from functools import lru_cache, partial
from threading import Lock

import numpy as np

from kinetostat.engine.form import Form, Kind, angles, form_of, joint_columns, objectives_of, step_of
from kinetostat.engine.interpreter import Interpreted
from kinetostat.engine.kernel import Fill, closes_inside, falling_back, program_columns
from kinetostat.engine.trace import Array, Body, Codes, Runnable
from kinetostat.equilibrium.numbers import check_loads, loaded_numbers
from kinetostat.equilibrium.reduced import cut_machine
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values

KEPT = 32
"""Programs kept in memory."""
MOST_STEPS = 8
"""Of Newton's method after the first two; each point takes as many as it needs, whatever its neighbours need."""
NEARLY = 1e-7
"""Size of a step, rad or in units of the machine's length, after which another one is exact to round-off."""


class Way(Enum):
    """How loaded states are found, and how many points a slab has.

    Equations of any machine fill the third cache level with some hundred poses. Programs by NumPy do five to ten
    thousand poses/s after half a second of tracing, in machine code some hundred thousand after two seconds.
    """

    ANY_MACHINE = 256
    NUMPY = 1024
    NATIVE = 32768

    @property
    def slab(self) -> int:
        """Points that are evaluated together."""
        return self.value


NUMPY_FROM, NATIVE_FROM = 200, 10_000
"""Points from which programs pay, by NumPy and in machine code."""


def way_of(machine: Machine, paths: Sequence[str], count: int, repeated: bool) -> Way:
    """Choose how to find the loaded states of a machine.

    Args:
        machine: with its loads; gives all parameters that do not vary.
        paths: leaf paths of those that vary.
        count: of points.
        repeated: whether the same will be asked many times, so that compiling pays for few points too.
    """
    if (count < NUMPY_FROM and not repeated) or _cut(machine, tuple(paths)) is None:
        return Way.ANY_MACHINE
    return Way.NATIVE if repeated or count >= NATIVE_FROM else Way.NUMPY


def loaded_fill(machine: Machine, paths: Sequence[str], quantities: Sequence[str], way: Way) -> Fill:
    """Return the fill of quantities of which some are about the machine under load.

    Args:
        machine: with its loads; gives all parameters that do not vary.
        paths: leaf paths of those that vary.
        quantities: names from `QUANTITIES`.
        way: how to find the states.
    """
    solved = partial(_solve_in_parts, machine, tuple(quantities))
    cut = None if way is Way.ANY_MACHINE else _cut(machine, tuple(paths))
    if cut is None:
        return solved
    form, fixed = form_of(machine, paths)
    closed, native = closes_inside(machine), way is Way.NATIVE
    states, turning = States(machine, form, closed, native), angles(machine)
    program = _program(Kind(machine), form, tuple(quantities), closed, native)

    def directly(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        given = program_columns(columns, form.varying, turning)
        if machine.family.chains is not None and not closed:
            given += joint_columns(machine, columns, len(status))
        program.run(fixed, [*given, *states.settled(fixed, given, len(status))], results, status)

    every = falling_back(directly, lambda: solved)

    def fill(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        check_loads(with_values(machine, columns), len(status), cut.mechanism.weighs)
        every(columns, results, status)

    return fill


def _solve_in_parts(
    machine: Machine, quantities: Sequence[str], columns: Mapping[str, Array], results: Array, status: Codes
) -> None:
    """Fill by the solver for any machine, some hundred points at a time."""
    for start in range(0, len(status), Way.ANY_MACHINE.slab):
        part = slice(start, start + Way.ANY_MACHINE.slab)
        here = {path: values[part] for path, values in columns.items()}
        with np.errstate(all="ignore"):
            loaded, status[part] = loaded_numbers(machine, here, len(status[part]))
            response = respond(with_values(machine, here))
            response = replace(response, loaded={name: values.T for name, values in loaded.items()})
            for row, name in zip(results[:, part], quantities, strict=True):
                row[:] = QUANTITIES[name].value(response)
    results[:, status != Status.OK] = np.nan


class States:
    """Programs that find states of rest of machines of one kind and form."""

    def __init__(self, machine: Machine, form: Form, closed: bool, native: bool) -> None:
        """Trace the first steps.

        Args:
            machine: whose loops can be cut.
            form: how its parameters enter.
            closed: whether joints are closed inside the programs.
            native: whether to compile.
        """
        self._key, self._making = (Kind(machine), form, closed, native), Lock()
        self._first, self._size = self._step(first=True)

    def _step(self, first: bool) -> tuple[Runnable, int]:
        with self._making:  # threads that need a program at the same time wait until it is there
            return _step(*self._key, first)

    def settled(self, fixed: Array, given: Sequence[Array], count: int) -> Array:
        """Coordinates of the states of rest [coordinates x points], NaN where there is none nearby.

        Args:
            fixed: values of the parameters that are the same at all points.
            given: columns of the others, and of joints if they are not closed inside the programs.
            count: of points.
        """
        result, codes = np.empty((self._size + 1, count)), np.empty(count, dtype=np.int8)
        self._first.run(fixed, given, result, codes)
        for _ in range(MOST_STEPS):
            moving = result[-1] > NEARLY**2
            rows = np.flatnonzero(moving)
            if not len(rows):
                break
            step, _ = self._step(first=False)
            most = 2 * len(rows) > count  # then picking them out would take longer than computing the others as well
            at = [*given, *result[:-1]] if most else [part[rows] for part in (*given, *result[:-1])]
            stepped = np.empty((self._size + 1, len(at[0])))
            step.run(fixed, at, stepped, codes[: len(at[0])])
            if most:
                np.copyto(result, stepped, where=moving)
            else:
                result[:, rows] = stepped
        return result[:-1]


_cut = lru_cache(KEPT)(cut_machine)


@lru_cache(KEPT)
def _program(kind: Kind, form: Form, quantities: tuple[str, ...], closed: bool, native: bool) -> Runnable:
    return _runnable(objectives_of(kind, form, [((name, 1.0),) for name in quantities], closed=closed).body, native)


@lru_cache(KEPT)
def _step(kind: Kind, form: Form, closed: bool, native: bool, first: bool) -> tuple[Runnable, int]:
    """The program of a step, or of the first ones, and how many coordinates it has."""
    body = step_of(kind, form, closed, first)
    return _runnable(body, native), len(body.results) - 1


def _runnable(body: Body, native: bool) -> Runnable:
    if not native:
        return Interpreted(body, ())
    from kinetostat.engine.native import Program  # LLVM takes 0.1 s to load: only where it pays

    return Program(body)
