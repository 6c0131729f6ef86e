"""Loaded states of slabs of points: Newton's steps as a program that is repeated, and the quantities at their end.

No formula lives here. The coordinates of the states are columns of the programs. Points at which this does not end
surely in a stable state of rest, and machines whose equations cannot be reduced, are left to the solver for any
machine.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum
from functools import lru_cache, partial
from threading import Lock

import numpy as np

from kinetostat.arrays import Array, Codes
from kinetostat.engine.form import Form, Specimen, form_of, objectives_of, plan_for, step_of
from kinetostat.engine.kernel import (
    PROGRAMS_KEPT,
    FallingBack,
    Fill,
    closes_inside,
    program_columns,
    program_fill,
    program_of,
    recipe_of,
)
from kinetostat.engine.trace import Runnable
from kinetostat.equilibrium.cables import cable_numbers
from kinetostat.equilibrium.cut import cut_machine
from kinetostat.equilibrium.limit import snap_flags
from kinetostat.equilibrium.numbers import RestNumber, loaded_numbers, status_with_rest
from kinetostat.equilibrium.state import check_loads, states_at
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, rest_numbers
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.limits import limits_set
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values
from kinetostat.machine.written.family import at_home
from kinetostat.motion.response import response_in_motion
from kinetostat.numerics.iteration import SHRINKING
from kinetostat.vibration.modes import frequencies
from kinetostat.vibration.receptance import cut_receptances
from kinetostat.vibration.reduced import leaves_plane, platform_alone, pose_frequencies, reducible

MOST_NEWTON_STEPS = 8
"""Of Newton's method after the first ones; each point takes as many as it needs, whatever its neighbours need."""
MOST_CHORD_STEPS = 6
"""Of the chord method before these: at a tenth of a step each, as many lead from the longest one to `LAST_STEP`."""
ONE_STEP_AWAY = 1e-7
"""Size of a step, rad or in units of the machine's length, after which another one is exact to round-off."""
LAST_STEP = 1e-12
"""Size of a step, in the same units, by which what resists at its two ends does not differ: the stiffness of slender
machines changes by a thousand times as much."""


class Way(Enum):
    """A route to loaded states and vibrations, and the number of points in a slab of it.

    Equations of any machine fill the third cache level with some hundred poses, of which they do a thousand per second;
    its modes take as long by LAPACK as the formulas by Python, which more poses share. Where the platform alone is
    massive and nothing is loaded, columns of numbers do thirty thousand at once. Machine code does some hundred
    thousand, after a quarter of a second to two seconds for which it is compiled; so do columns for the tensions of
    straight cables, which follow from where the platform is.
    """

    ANY_MACHINE = 512
    MODES = 768
    COLUMNS = 4096
    CABLES = 2048
    NATIVE = 32768

    @property
    def slab(self) -> int:
        """Points that are evaluated together."""
        return self.value


NATIVE_FROM = 200
"""Points from which machine code pays, which is compiled once for a form of machines and then kept on disk."""
NATIVE_FROM_WITH_LEGS = 3000
"""The same at rest where legs close loops: programs of some ten thousand operations take seconds, the solver for any
machine some thousandths of a second for each point."""
COLUMNS_TO = 10_000
"""Points up to which columns do for the vibrations of a platform alone: they take as long as compiling."""


def way_of(machine: Machine, paths: Sequence[str], quantities: Sequence[str], count: float) -> Way:
    """Choose how to find the loaded states of a machine, and its natural vibrations.

    Args:
        machine: with its loads; gives all parameters that do not vary.
        paths: leaf paths of those that vary.
        quantities: names from `QUANTITIES`.
        count: of points; infinity if the same will be asked many times, so that compiling pays for few points too.
    """
    if all(QUANTITIES[name].cables for name in quantities) and not limits_set(machine.tables["limits"]):
        return Way.CABLES
    loaded = bool(rest_numbers(machine, quantities)) or any(QUANTITIES[name].cut for name in quantities)
    if not loaded and count < COLUMNS_TO and platform_alone(machine, paths):
        return Way.COLUMNS
    native = count >= NATIVE_FROM and have_programs(machine, tuple(paths), quantities)
    if native and count < NATIVE_FROM_WITH_LEGS and rest_numbers(machine, quantities):
        machine_cut = _cut(machine, tuple(paths))
        native = machine_cut is not None and not machine_cut.legs
    return Way.NATIVE if native else Way.ANY_MACHINE if loaded else Way.MODES


def loaded_fill(machine: Machine, paths: Sequence[str], quantities: Sequence[str], way: Way) -> Fill:
    """Return the fill of quantities of which some are about the machine under load, or about its vibrations.

    Args:
        machine: with its loads; gives all parameters that do not vary.
        paths: leaf paths of those that vary.
        quantities: names from `QUANTITIES`.
        way: how to find the states.
    """
    fill = _fill_with_unknowns(machine, paths, quantities, way)
    modal = [place for place, name in enumerate(quantities) if QUANTITIES[name].modal]

    def with_status(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        fill(columns, results, status)
        # Springs more than 1e12 times as stiff as others leave no digit of the softest motion.
        hidden = np.isnan(results[modal]).any(axis=0) & (status == Status.OK)
        status[hidden] = Status.SINGULAR
        results[:, hidden] = np.nan

    return with_status


def _fill_with_unknowns(machine: Machine, paths: Sequence[str], quantities: Sequence[str], way: Way) -> Fill:
    """Return the fill of such quantities, which may leave vibrations unknown at poses that are said to be OK."""
    if way is Way.CABLES:
        return partial(_fill_of_cables, machine, tuple(quantities))
    plain = way in (Way.ANY_MACHINE, Way.MODES, Way.COLUMNS)
    solved = partial(_solve_in_parts, machine, tuple(quantities), (way if plain else Way.ANY_MACHINE).slab)
    if plain or not have_programs(machine, tuple(paths), quantities):
        return solved
    closed = closes_inside(machine)
    cut = _cut(machine, tuple(paths)) if rest_numbers(machine, quantities) else None
    directly: Fill = (
        RestFill(machine, paths, quantities, closed, bool(cut.legs))
        if cut
        else program_fill(machine, paths, quantities, closed)
    )
    every = FallingBack(directly, lambda: solved)

    def fill(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        if cut:
            check_loads(with_values(machine, columns), len(status), cut.mechanism.weighs)
        every(columns, results, status)

    return fill


def _fill_of_cables(
    machine: Machine, quantities: Sequence[str], columns: Mapping[str, Array], results: Array, status: Codes
) -> None:
    """Fill with numbers of cables alone, for which no leg has to be placed."""
    with np.errstate(all="ignore"):
        numbers, status[:] = cable_numbers(with_values(machine, columns), quantities, len(status))
    for row, name in zip(results, quantities, strict=True):
        row[:] = numbers[name]
    results[:, status != Status.OK] = np.nan


def _solve_in_parts(
    machine: Machine, quantities: Sequence[str], slab: int, columns: Mapping[str, Array], results: Array, status: Codes
) -> None:
    """Fill by the solver for any machine, a slab of points at a time."""
    for start in range(0, len(status), slab):
        part = slice(start, start + slab)
        here = {path: values[part] for path, values in columns.items()}
        with np.errstate(all="ignore"):
            response = _response_with_states(machine, quantities, here, len(status[part]))
            status[part] = response.status
            for row, name in zip(results[:, part], quantities, strict=True):
                row[:] = QUANTITIES[name].value(response)
    results[:, status != Status.OK] = np.nan


FURTHER: dict[str, RestNumber] = {"frequency": frequencies, "snapped": snap_flags}
"""Numbers at rest that are computed only where they are asked for."""


def _response_with_states(
    machine: Machine, quantities: Sequence[str], columns: Mapping[str, Array], count: int
) -> Response:
    """The response at some points, with what quantities need of states of rest and of vibrations."""
    wanted = [QUANTITIES[name] for name in quantities]
    state = states_at(machine, columns, count)
    response = state.free
    if any(quantity.modal and not quantity.loaded and not quantity.cut for quantity in wanted):
        response = replace(response, frequencies=list(pose_frequencies(state).T))
    if any(quantity.cut for quantity in wanted):
        pressure = state.machine.tables["cutting"].pressure
        response = replace(response, softest=cut_receptances(state), cutting_pressure=pressure)
    of_cables = [quantity.name for quantity in wanted if quantity.cables]
    if of_cables:
        numbers, cable_status = cable_numbers(state.machine, of_cables, count)
        free = np.broadcast_to(response.status, (count,))
        status = np.where(
            (free == Status.OK) | (free == Status.SINGULAR) & (cable_status == Status.NO_REST), cable_status, free
        )
        response = replace(response, cables=numbers, status=status)
    plan = plan_for(machine, quantities, columns)
    response = response_in_motion(state.machine, response, state.joints, plan, quantities)
    if at_rest := rest_numbers(machine, quantities):
        further = {name: compute for name, compute in FURTHER.items() if name in at_rest}
        loaded, at_rest_status = loaded_numbers(state, further)
        status = np.where(np.equal(response.status, Status.NO_REST), Status.NO_REST, at_rest_status)
        status = status_with_rest(machine, quantities, response.status, status)
        response = replace(response, loaded={name: values.T for name, values in loaded.items()}, status=status)
    return response


NUMBERS_TOGETHER = 2**17
"""Numbers that a step gives for points that are evaluated together: they stay in the second cache level until the next
step takes them, and there are enough points for the call of a program to cost nothing beside them."""


class RestFill:
    """The fill of quantities at rest.

    Where loops are cut at rods, small programs find the state, and one gives the quantities. Where legs close loops, a
    step of Newton's method takes as long as the quantities, so that one program does both: steps of the chord method,
    each a quarter of it, lead so near to the state that this program has to be repeated at few points.
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
        self._form, self._fixed = form_of(machine, paths)
        kind = Specimen(at_home(machine, paths))
        objectives = tuple(((name, 1.0),) for name in quantities)
        self._states = None if legs else StatePrograms(machine, self._form, closed, native=True)
        step = partial(recipe_of, step_of, kind, self._form, closed=closed)
        self._first = program_of(step(first=True))
        self._chord = program_of(step(chord=True)) if legs else None
        plan = plan_for(machine, quantities, paths)
        self._step = program_of(
            recipe_of(objectives_of, kind, self._form, objectives=objectives, closed=closed, plan=plan, stepping=legs)
        )

    def __call__(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Evaluate a slab, see `Fill`."""
        count = len(status)
        given = program_columns(self._machine, self._form, columns, count, self._closed)
        if self._states is not None:
            given += self._states.rest_coordinates(self._fixed, given, count)
            self._step.run(self._fixed, given, results, status)
            return
        together = min(count, NUMBERS_TOGETHER // self._step.rows)
        memory = [np.empty((self._step.rows, together)) for _ in range(2)]
        for start in range(0, count, max(together, 1)):
            part = slice(start, start + together)
            self._fill([column[part] for column in given], results[:, part], status[part], memory)

    def _fill(self, given: list[Array], results: Array, status: Codes, memory: list[Array]) -> None:
        """Evaluate some points, with memory for what two steps give."""
        rows = np.arange(len(status))
        self._first.run(self._fixed, given, memory[0][self._count :, : len(rows)], np.empty_like(status))
        self._approach(given, memory, len(rows))
        states = memory[0][self._count :, : len(rows)]
        for _ in range(MOST_NEWTON_STEPS):
            stepped, codes = memory[1][:, : len(rows)], np.empty(len(rows), dtype=status.dtype)
            self._step.run(self._fixed, [*given, states[:-1]], stepped, codes)
            if len(rows) == len(status):
                results[:], status[:] = stepped[: self._count], codes
            else:
                results[:, rows], status[rows] = stepped[: self._count], codes
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
            self._chord.run(self._fixed, [*here, at[:-1]], stepped, codes)
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


_cut = lru_cache(PROGRAMS_KEPT)(cut_machine)
_reducible = lru_cache(PROGRAMS_KEPT)(reducible)


def have_programs(machine: Machine, paths: tuple[str, ...], quantities: Sequence[str]) -> bool:
    """Whether programs can compute all that these quantities need, wherever parameters at these leaf paths are."""
    wanted, needed = [QUANTITIES[name] for name in quantities], rest_numbers(machine, quantities)
    if "snapped" in needed or any(quantity.cut or quantity.cables for quantity in wanted):
        return False
    machine_cut = _cut(machine, paths) if needed else None
    at_rest = not needed or machine_cut is not None
    if machine_cut is not None and machine_cut.legs:
        at_rest = "factor" not in needed and ("frequency" not in needed or platform_alone(machine, paths))
    elif machine_cut is not None and "frequency" in needed:
        at_rest = not leaves_plane(machine, machine_cut)
    rings = not any(q.modal and not q.loaded for q in wanted) or _reducible(machine, paths)
    return at_rest and rings
