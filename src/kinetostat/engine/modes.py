"""Modes over springs of slabs of points: programs give their matrices, LAPACK the modes.

No formula lives here; see `vibration.springwise`.
"""

from collections.abc import Sequence

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.form import (
    Form,
    Specimen,
    TracedFormula,
    formula_of,
    new_inputs,
    result_of,
    traced_joints,
    traced_machine,
)
from kinetostat.engine.kernel import Recipe, program_of
from kinetostat.engine.trace import Traced
from kinetostat.equilibrium.reduced import reduced_machine
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.vibration.springwise import ModeCounts, SpringMotions, motions_without_loads, sizes_over_springs


def modes_at_rest(
    machine: Machine, form: Form, fixed: Array, given: Sequence[Array], counts: ModeCounts, closed: bool
) -> list[Array]:
    """Find the modes of states of rest, as columns that programs of quantities take: a row of points for each number.

    Args:
        machine: a machine whose legs close loops.
        form: how its parameters enter.
        fixed: values of the parameters that are the same at all points.
        given: columns of the others, of joints if they are not `closed` inside the programs, and of states of rest.
        counts: how many modes.
        closed: whether joints are closed inside the programs.
    """
    program = program_of(Recipe(spring_parts_of, Specimen(machine), form, (closed, True)), native=False)
    count, sizes = len(given[0]), sizes_over_springs(machine)
    parts = np.empty((program.rows, count))
    program.run(fixed, given, parts, np.empty(count, dtype=np.int8))
    modes = [sizes.modes(parts, counts.loaded), sizes.modes(parts, counts.factor, massive=False)]
    return [*np.ascontiguousarray(np.concatenate(modes, axis=1).reshape(count, -1).T)]


def spring_parts_of(kind: Specimen, form: Form, closed: bool, at_rest: bool) -> TracedFormula:
    """Trace what loops need to find modes over springs, see `SpringMotions.parts`.

    Args:
        kind, form, closed: as for `step_of`, of a machine whose legs close loops.
        at_rest: whether the machine is at rest under its loads, of which the last columns are the coordinates; else it
            has relaxed springs.
    """
    given = traced_machine(kind, form)
    joints, columns = traced_joints(given, closed)
    response = respond(given.machine, joints)
    coordinates: tuple[Traced, ...] = ()
    if at_rest:
        equations = reduced_machine(given.machine, response, joints)
        coordinates = new_inputs(given.graph, equations.size)
        motions = SpringMotions(equations.cut, [*coordinates])
    else:
        motions = motions_without_loads(given.machine, response, joints)
    return formula_of(given, columns, [result_of(part) for part in motions.parts()], 0.0, coordinates=coordinates)
