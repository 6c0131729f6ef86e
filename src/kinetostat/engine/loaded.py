"""Loaded states and vibrations of slabs of points: which way leads to them, and what is left to the next one.

No formula lives here. Points at which programs do not end surely in a stable state of rest, and machines whose
equations cannot be reduced, are left to the solver for any machine.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from kinetostat.arrays import Array, Codes
from kinetostat.engine.form import plan_for
from kinetostat.engine.kernel import (
    PROGRAMS_KEPT,
    FallingBack,
    Fill,
    ProgramFill,
    closes_inside,
    compiles,
    program_columns,
    program_fill,
)
from kinetostat.engine.modes import ModalNumbers, rows_of_modes
from kinetostat.engine.rest import LegwiseRestFill, RestFill
from kinetostat.equilibrium.cables import cable_numbers
from kinetostat.equilibrium.cut import cut_machine
from kinetostat.equilibrium.limit import snap_flags
from kinetostat.equilibrium.numbers import RestNumber, loaded_numbers, status_with_rest
from kinetostat.equilibrium.state import MachineState, check_loads, states_at
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, rest_numbers
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.limits import limits_set
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values
from kinetostat.motion.response import response_in_motion
from kinetostat.vibration.cutting import cut_receptances
from kinetostat.vibration.modes import frequencies
from kinetostat.vibration.scalar_frequencies import leaves_plane, numpy_frequencies, platform_alone, reducible
from kinetostat.vibration.springwise import ModeCounts, mode_counts_of


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
"""The same for each kind of program of machines whose legs close loops, for states of rest and for modes over springs:
these have some ten thousand operations and take seconds, the solver for any machine half a thousandth of a second to
some thousandths for each point."""
COLUMNS_TO = 10_000
"""Points up to which columns do for the vibrations of a platform alone: they take as long as compiling."""


def way_of(machine: Machine, paths: Sequence[str], quantities: Sequence[str], count: float) -> Way:
    """Choose how to find the loaded states of a machine, and its natural vibrations.

    Args:
        machine: the machine with its loads; gives all parameters that do not vary.
        paths: leaf paths of those that vary.
        quantities: names from `QUANTITIES`.
        count: number of points; infinity if the same will be asked many times, so that compiling pays for few as well.
    """
    if all(QUANTITIES[name].cables for name in quantities) and not limits_set(machine.tables["limits"]):
        return Way.CABLES
    loaded = bool(rest_numbers(machine, quantities)) or any(QUANTITIES[name].cut for name in quantities)
    if not loaded and count < COLUMNS_TO and platform_alone(machine, paths):
        return Way.COLUMNS
    native = count >= NATIVE_FROM and have_programs(machine, tuple(paths), quantities)
    if native and count >= NATIVE_FROM_WITH_LEGS * _programs_with_legs(machine, tuple(paths), quantities):
        return Way.NATIVE
    return Way.ANY_MACHINE if loaded else Way.MODES


def _programs_with_legs(machine: Machine, paths: tuple[str, ...], quantities: Sequence[str]) -> int:
    """Count the kinds of programs that quantities need because legs of the machine close loops."""
    machine_cut = _cut(machine, paths) if rest_numbers(machine, quantities) else None
    counts = _mode_counts(machine, paths, tuple(quantities))
    needing = [name for name in quantities if counts and counts.needed_by(QUANTITIES[name])]
    return int(machine_cut is not None and bool(machine_cut.legs)) + len(rows_of_modes(needing))


def loaded_fill(machine: Machine, paths: Sequence[str], quantities: Sequence[str], way: Way) -> Fill:
    """Return the fill of quantities of which some are about the machine under load, or about its vibrations.

    Args:
        machine: the machine with its loads; gives all parameters that do not vary.
        paths: leaf paths of those that vary.
        quantities: names from `QUANTITIES`.
        way: how to find the states.
    """
    fill = _fill_with_unknowns(machine, paths, quantities, way)
    modal = [place for place, name in enumerate(quantities) if QUANTITIES[name].modal]

    def with_status(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Evaluate a slab, see `Fill`; poses whose vibrations remain unknown are SINGULAR."""
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
    by_solver = way in (Way.ANY_MACHINE, Way.MODES, Way.COLUMNS)
    solver_fill = partial(_solve_in_parts, machine, tuple(quantities), (way if by_solver else Way.ANY_MACHINE).slab)
    if by_solver or not have_programs(machine, tuple(paths), quantities):
        return solver_fill
    cut = _cut(machine, tuple(paths)) if rest_numbers(machine, quantities) else None
    counts = _mode_counts(machine, tuple(paths), tuple(quantities))
    by_programs = ModalFill(machine, paths, quantities, counts) if counts else _direct_fill(machine, paths, quantities)
    composed = FallingBack(by_programs, lambda: solver_fill)

    def fill(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        if cut:
            check_loads(with_values(machine, columns), len(status), cut.mechanism.weighs)
        composed(columns, results, status)

    return fill


def _direct_fill(machine: Machine, paths: Sequence[str], quantities: Sequence[str]) -> Fill:
    """The fill of quantities for which no modes are needed beside their program."""
    machine_cut = _cut(machine, tuple(paths)) if rest_numbers(machine, quantities) else None
    if machine_cut and not machine_cut.legs:
        return RestFill(machine, paths, quantities, closes_inside(machine))
    return _fill_of_legs(machine, paths, quantities)


def _fill_of_legs(machine: Machine, paths: Sequence[str], quantities: Sequence[str]) -> ProgramFill | LegwiseRestFill:
    """The same of machines whose legs close loops, and of all that need no state of rest."""
    make = LegwiseRestFill if rest_numbers(machine, quantities) else program_fill
    return make(machine, paths, quantities, closes_inside(machine))


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
        part_columns = {path: values[part] for path, values in columns.items()}
        with np.errstate(all="ignore"):
            response = _response_with_states(machine, quantities, part_columns, len(status[part]))
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
        response = replace(response, frequencies=list(numpy_frequencies(state).T))
    if any(quantity.cut for quantity in wanted):
        pressure = state.machine.tables["cutting"].pressure
        response = replace(response, softest=cut_receptances(state), cutting_pressure=pressure)
    response = _response_with_cables(state, response, [quantity.name for quantity in wanted if quantity.cables])
    plan = plan_for(machine, quantities, columns)
    response = response_in_motion(state.machine, response, state.joints, plan, quantities)
    if at_rest := rest_numbers(machine, quantities):
        further = {name: compute for name, compute in FURTHER.items() if name in at_rest}
        loaded, at_rest_status = loaded_numbers(state, further)
        status = np.where(np.equal(response.status, Status.NO_REST), Status.NO_REST, at_rest_status)
        status = status_with_rest(machine, quantities, response.status, status)
        response = replace(response, loaded={name: values.T for name, values in loaded.items()}, status=status)
    return response


def _response_with_cables(state: MachineState, response: Response, names: Sequence[str]) -> Response:
    """Return the response with these quantities of cables, and with their status where the pose itself has an answer.

    A singular pose, at which the free machine has none, is NO_REST if its cables are.
    """
    if not names:
        return response
    numbers, of_cables = cable_numbers(state.machine, names, state.count)
    of_pose = np.broadcast_to(response.status, (state.count,))
    cables_decide = (of_pose == Status.OK) | (of_pose == Status.SINGULAR) & (of_cables == Status.NO_REST)
    return replace(response, cables=numbers, status=np.where(cables_decide, of_cables, of_pose))


class _ModalRows(NamedTuple):
    """Numbers that follow from modes, and the rows of a slab's results that they become.

    Attributes:
        numbers: the numbers.
        result_rows: rows of the results.
        value_rows: for each of these rows, that of the numbers.
    """

    numbers: ModalNumbers
    result_rows: list[int]
    value_rows: list[int]


class ModalFill:
    """The fill of quantities of which some follow from modes over springs, as legs with masses that close loops have.

    The others have their own programs, which say the status too.
    """

    def __init__(self, machine: Machine, paths: Sequence[str], quantities: Sequence[str], counts: ModeCounts) -> None:
        """Trace and compile the programs.

        Args:
            machine, paths, quantities: as for `program_fill`.
            counts: numbers of modes that the quantities need.
        """
        needing = [name for name in quantities if counts.needed_by(QUANTITIES[name])]
        others = [name for name in quantities if name not in needing]
        if not others or (counts.at_rest and not rest_numbers(machine, others)):
            others.append("displacement_x" if counts.at_rest else "singularity_margin")  # any that gives the status
        self._machine, self._count, self._closed = machine, len(others), closes_inside(machine)
        self._others = _fill_of_legs(machine, paths, others)
        without_modes = [name for name in quantities if name not in needing]
        self._result_rows = [quantities.index(name) for name in without_modes]
        self._rows_of_others = [others.index(name) for name in without_modes]
        self._modal: list[_ModalRows] = []
        for what, mode_numbers in rows_of_modes(needing).items():
            count = max(mode_numbers.values())
            numbers = ModalNumbers(machine, self._others.form, self._closed, what, count)
            result_rows = [quantities.index(name) for name in mode_numbers]
            self._modal.append(_ModalRows(numbers, result_rows, [number - 1 for number in mode_numbers.values()]))

    def __call__(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Evaluate a slab, see `Fill`."""
        others, fixed = np.empty((self._count, len(status))), self._others.fixed
        program_inputs = program_columns(self._machine, self._others.form, columns, len(status), self._closed)
        states: list[Array] = []
        if isinstance(self._others, LegwiseRestFill):
            states = [np.empty((self._others.size, len(status)))]
            self._others.solve(program_inputs, others, status, *states)
        else:
            self._others.program.run(fixed, program_inputs, others, status)
        results[self._result_rows] = others[self._rows_of_others]
        for numbers, result_rows, value_rows in self._modal:
            values, sure = numbers.at(fixed, [*program_inputs, *states] if numbers.at_rest else program_inputs)
            results[result_rows] = values[value_rows]
            status[~sure & (status == Status.OK)] = Status.NOT_CONVERGED
        results[:, status != Status.OK] = np.nan


_cut = lru_cache(PROGRAMS_KEPT)(cut_machine)
_reducible = lru_cache(PROGRAMS_KEPT)(reducible)


@lru_cache(PROGRAMS_KEPT)
def _mode_counts(machine: Machine, paths: tuple[str, ...], quantities: tuple[str, ...]) -> ModeCounts | None:
    """The modes over springs that quantities need; None if they need none, or nothing can compile their programs."""
    return mode_counts_of(machine, quantities, paths) if compiles() else None


def have_programs(machine: Machine, paths: tuple[str, ...], quantities: Sequence[str]) -> bool:
    """Whether programs can compute all that these quantities need, wherever parameters at these leaf paths are."""
    wanted, needed = [QUANTITIES[name] for name in quantities], rest_numbers(machine, quantities)
    if "snapped" in needed or any(quantity.cut or quantity.cables for quantity in wanted):
        return False
    machine_cut = _cut(machine, paths) if needed else None
    at_rest = not needed or machine_cut is not None
    if machine_cut is not None and machine_cut.legs:
        alone = "factor" not in needed and ("frequency" not in needed or platform_alone(machine, paths))
        at_rest = alone or _mode_counts(machine, paths, tuple(quantities)) is not None
    elif machine_cut is not None and "frequency" in needed:
        at_rest = not leaves_plane(machine, machine_cut)
    free_modes = not any(q.modal and not q.loaded for q in wanted) or _reducible(machine, paths)
    return at_rest and (free_modes or _mode_counts(machine, paths, tuple(quantities)) is not None)
