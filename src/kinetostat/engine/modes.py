"""Modes over springs at many points: a program computes the matrices of all points, LAPACK the modes of each.

The formulas are in `vibration.springwise`; here they are traced and run.
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
from kinetostat.engine.kernel import program_of, recipe_of
from kinetostat.engine.trace import Traced
from kinetostat.equilibrium.reduced import reduced_machine
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.vibration.springwise import ModeCounts, SpringMotions, motions_without_loads, sizes_over_springs


def modes_at_rest(
    machine: Machine, form: Form, fixed: Array, given: Sequence[Array], counts: ModeCounts, closed: bool
) -> list[Array]:
    """Find the modes of states of rest.

    Args:
        machine: a machine whose legs close loops.
        form: how its parameters enter the program.
        fixed: values of the parameters that are the same at all points.
        given: columns of the other parameters, of joints if they are not `closed`, and of the states of rest.
        counts: how many modes are wanted.
        closed: whether programs compute the joints that close the legs by themselves, in closed form.

    Returns:
        The modes as further columns of programs of quantities: an array [points] for each of their numbers.
    """
    program = program_of(recipe_of(spring_parts_of, Specimen(machine), form, closed=closed, at_rest=True), native=False)
    points, sizes = len(given[0]), sizes_over_springs(machine)
    parts = np.empty((program.rows, points))
    program.run(fixed, given, parts, np.empty(points, dtype=np.int8))
    modes = [sizes.modes(parts, counts.loaded), sizes.modes(parts, counts.factor, massive=False)]
    return [*np.ascontiguousarray(np.concatenate(modes, axis=1).reshape(points, -1).T)]


def spring_parts_of(kind: Specimen, form: Form, closed: bool, at_rest: bool) -> TracedFormula:
    """Trace the matrices of which modes over springs are found, see `SpringMotions.parts`.

    Args:
        kind, form, closed: as for `step_of`, of a machine whose legs close loops.
        at_rest: whether the machine is at rest under its loads, whose coordinates are then the last columns; otherwise
            its springs are relaxed.
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
