"""A machine as a program for slabs of points: its formulas traced, compiled and kept. Holds no formula.

Fixed parameters that are exactly 0 or infinite become part of the code, so that what they multiply is not computed at
all, what cancels by form is not computed either, and where all springs are ordinary the code for rigid and free ones is
left out. A new machine of the same form, with other numbers, uses the same program.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache, lru_cache
from importlib.util import find_spec
from typing import Any

import numpy as np

from kinetostat.arrays import Array, Codes
from kinetostat.engine.form import (
    Form,
    Specimen,
    TracedFormula,
    TraceOptions,
    each_alone,
    form_of,
    objectives_of,
    plan_for,
    reduced_angles,
)
from kinetostat.engine.gradient import InterpretedBody, with_gradients
from kinetostat.engine.machine_code import MachineCode, Program, machine_code_of, unpack
from kinetostat.engine.program_files import read_program, write_program
from kinetostat.engine.trace import Runnable
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closure import solve_joints, solver_of, task_of
from kinetostat.kinematics.status import Status
from kinetostat.machine.catalogue import family_text
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values
from kinetostat.machine.written.family import at_home

PROGRAMS_KEPT = 128
"""Programs kept in memory, of some 20 kB each: a few megabytes together."""

Fill = Callable[[Mapping[str, Array], Array, Codes], None]
"""From the varying parameters of a slab [points] to its results [quantities x points] and status codes, in place."""


def fill_some(chosen: Any, fill: Fill, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
    """Evaluate some points of a slab by a fill of their own.

    Args:
        chosen: an index of the points: numbers or a mask.
        fill: evaluates them.
        columns: values of the varying parameters of all points by leaf path, SI [points].
        results, status: results and status codes of all points; only those of the chosen ones are written.
    """
    part, codes = np.ascontiguousarray(results[:, chosen]), status[chosen]
    fill({path: column[chosen] for path, column in columns.items()}, part, codes)
    results[:, chosen], status[chosen] = part, codes


@dataclass(frozen=True)
class FallingBack:
    """Two fills: the other takes the points at which the first finds no joints (NOT_CONVERGED).

    Closed forms inside a program and the equations outside it are so composed; the other fill is made when the first
    point needs it, because it costs a compilation.
    """

    first: Fill
    other: Callable[[], Fill]

    def __call__(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Evaluate a slab, see `Fill`."""
        self.first(columns, results, status)
        unsolved = np.flatnonzero(status == Status.NOT_CONVERGED)
        if unsolved.size:
            fill_some(unsolved, self.other(), columns, results, status)


class Identical:
    """A key of caches that equals another only if both hold the very same object: neither has to be gone through."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Identical) and other.value is self.value

    def __hash__(self) -> int:
        return id(self.value)


@dataclass(frozen=True)
class Recipe:
    """All that decides what a program is, before anything is traced: programs of equal recipes are the same.

    Attributes:
        trace: the function that traces it, such as `objectives_of`.
        kind: the kind of machine.
        form: how its parameters enter.
        arguments: names and values of the further arguments of the function, by name.
    """

    trace: Callable[..., TracedFormula]
    kind: Specimen
    form: Form
    arguments: tuple[tuple[str, Any], ...]

    @property
    def text(self) -> str | None:
        """The recipe as a text that is the same in every process; None for families that programs have registered."""
        machine = self.kind.machine
        family = family_text(machine.family)
        return family and repr((self.trace.__name__, family, machine.loaded, self.form, self.arguments))

    def formula(self) -> TracedFormula:
        """Trace it."""
        return self.trace(self.kind, self.form, **dict(self.arguments))


def recipe_of(trace: Callable[..., TracedFormula], kind: Specimen, form: Form, **arguments: Any) -> Recipe:
    """Return the recipe of the program that `trace(kind, form, **arguments)` traces."""
    return Recipe(trace, kind, form, tuple(sorted(arguments.items())))


@lru_cache(PROGRAMS_KEPT)
def program_of(recipe: Recipe, native: bool = True) -> Runnable:
    """Return the program of a recipe, compiled or run node by node in NumPy; derivatives come after all results."""
    if native:
        with suppress(ModuleNotFoundError):  # without LLVM all runs in NumPy, fifty times as long
            return Program(_machine_code(recipe))
    formula = recipe.formula()
    return InterpretedBody(formula.body, formula.inputs)


def machine_program_of(recipe: Recipe) -> Program:
    """Return the program of a recipe as machine code; without LLVM there is none, as a ModuleNotFoundError says."""
    program = program_of(recipe)
    if not isinstance(program, Program):
        raise ModuleNotFoundError("machine code needs llvmlite")
    return program


def _machine_code(recipe: Recipe) -> MachineCode:
    """Return the machine code of a recipe, from the disk or compiled."""

    def compile_recipe() -> MachineCode:
        formula = recipe.formula()
        return machine_code_of(with_gradients(formula.body, formula.inputs))

    return stored_code(recipe.text, compile_recipe)


def stored_code(text: str | None, compile_program: Callable[[], MachineCode]) -> MachineCode:
    """Return machine code as an earlier process has left it on disk, or compile it and leave it there.

    Args:
        text: all that the program is made of; None for one that stays off the disk.
        compile_program: compiles it.
    """
    kept = read_program(text) if text else None
    if kept:
        return unpack(kept)
    code = compile_program()
    if text:
        write_program(text, code.pack())
    return code


@dataclass(frozen=True)
class ProgramFill:
    """The fill by a single program.

    Attributes:
        machine: its family, and all parameters that do not vary.
        form: form of its programs.
        fixed: values of the program's fixed inputs.
        program: the program.
        closed: whether the program computes joint coordinates itself, in closed form. Otherwise they are found slab by
            slab and are further columns, unless the family places the joints.
    """

    machine: Machine
    form: Form
    fixed: Array
    program: Runnable
    closed: bool

    @property
    def alone(self) -> bool:
        """Whether the program needs no columns beside the parameters that vary."""
        return self.closed or self.machine.family.chains is None

    def __call__(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Evaluate a slab, see `Fill`."""
        program_inputs = program_columns(self.machine, self.form, columns, len(status), self.closed)
        self.program.run(self.fixed, program_inputs, results, status)


def slab_fill(machine: Machine, varying: Sequence[str], quantities: Sequence[str], judged: bool = True) -> Fill:
    """Return the fill of quantities of unloaded machines; 0.1 s unless such a program is there already.

    Args:
        machine: its family, and all parameters that do not vary.
        varying: leaf paths of the parameters that vary.
        quantities: names from `QUANTITIES`.
        judged: whether points are judged, see `TraceOptions`.
    """
    if not closes_inside(machine):
        return program_fill(machine, varying, quantities, False, judged)
    inside = program_fill(machine, varying, quantities, True, judged)
    return FallingBack(inside, lambda: program_fill(machine, varying, quantities, False, judged))


def program_fill(
    machine: Machine, varying: Sequence[str], quantities: Sequence[str], closed: bool, judged: bool = True
) -> ProgramFill:
    """Return the fill of quantities by a single program, see `ProgramFill`.

    Args:
        machine, varying, quantities, judged: as for `slab_fill`.
        closed: see `ProgramFill`.
    """
    form, fixed = form_of(machine, varying)
    program = program_of_quantities(machine, form, quantities, TraceOptions(closed=closed, judged=judged))
    return ProgramFill(machine, form, fixed, program, closed)


def program_of_quantities(machine: Machine, form: Form, quantities: Sequence[str], options: TraceOptions) -> Runnable:
    """Return the program of quantities.

    Args:
        machine: its family, and all parameters that do not vary.
        form: how its parameters enter.
        quantities: names from `QUANTITIES`.
        options: how they are traced; the motions that there are (`plan`) are found here.
    """
    kind = Specimen(at_home(machine, form.varying) if options.closed else machine)
    options = replace(options, plan=plan_for(machine, quantities, form.varying))
    objectives = tuple(each_alone(quantities))
    return program_of(recipe_of(objectives_of, kind, form, objectives=objectives, options=options))


def program_columns(
    machine: Machine, form: Form, columns: Mapping[str, Array], count: int, closed: bool = False
) -> list[Array]:
    """Return the columns of a program: varying parameters, and joints that it does not compute itself.

    They are contiguous, and angles are within what traced cosines take.

    Args:
        machine: gives all parameters that do not vary.
        form: form of its programs.
        columns: values of the varying parameters by leaf path, SI [points].
        count: number of points.
        closed: whether the program closes the legs itself.
    """
    values = [np.ascontiguousarray(columns[path], dtype=float) for path in form.varying]
    result = [
        reduced_angles(column) if path in form.turning else column
        for path, column in zip(form.varying, values, strict=True)
    ]
    if machine.family.chains is None or closed:
        return result
    joints = solve_joints(with_values(machine, columns))
    by_joint = (np.array(np.broadcast_to(c, (count,)), dtype=float) for c in (*joints.coordinates, joints.status))
    return [*result, *by_joint]


@cache
def compiles() -> bool:
    """Tell whether programs can be compiled here, so that none has to run in NumPy."""
    return find_spec("llvmlite") is not None


def closes_inside(machine: Machine) -> bool:
    """Tell whether a program for a machine can compute its joint coordinates itself."""
    return machine.family.chains is not None and solver_of(task_of(machine), traced=True).traceable
