"""What derivatives are asked of: a machine's objectives and closing equations, traced. None is computed here."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from kinetostat.algebra.scalar import Scalar, plus, times, where
from kinetostat.engine.form import Form, Inputs, Kind, number, traced
from kinetostat.engine.trace import Body, Operand, Traced
from kinetostat.kinematics.closed_form import closed_joints
from kinetostat.kinematics.closing import closing_equations
from kinetostat.kinematics.closure import Joints
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import Response, respond

Weights: TypeAlias = tuple[tuple[str, float], ...]
"""A weighted sum of quantities: their names and weights."""


@dataclass(frozen=True)
class Question:
    """A body and what to differentiate its results by: its parameters by path, then joint coordinates."""

    body: Body
    inputs: tuple[Traced, ...]


def objectives_of(
    kind: Kind, form: Form, objectives: Sequence[Weights], paths: Sequence[str], closed: bool = False
) -> Question:
    """Objectives as functions of parameters and joint coordinates; NaN where the status is not OK.

    Columns are the varying parameters and, where joints are found elsewhere, their coordinates and a status. With
    `closed`, joints are functions of the parameters in closed form.
    """
    given = traced(kind, form)
    joints, placed = ((), ()) if closed else _joints(given)
    known = closed_joints(given.machine.chains()) if closed else None
    if known is not None:
        response = respond(given.machine, Joints(tuple(known[0]), known[1]))
    else:
        response = respond(given.machine, Joints(joints, placed[0]) if placed else None)
    accepted = response.status < Status.OK + 0.5
    results = [number(where(accepted, _weighted(response, weights), math.nan)) for weights in objectives]
    return _question(given, (*joints, *placed), results, number(response.status), (*_inputs(given, paths), *joints))


def equations_of(kind: Kind, form: Form, paths: Sequence[str]) -> Question:
    """What vanishes where the legs of a machine written leg by leg close at its pose; columns likewise."""
    given = traced(kind, form)
    joints, placed = _joints(given)
    results = [number(gap) for gap in closing_equations(given.machine.chains(), joints)]
    return _question(given, (*joints, *placed), results, 0.0, (*_inputs(given, paths), *joints))


def _question(
    given: Inputs, joints: Sequence[Traced], results: Sequence[Operand], code: Operand, inputs: tuple[Traced, ...]
) -> Question:
    return Question(Body(given.fixed, [*given.columns.values(), *joints], results, code), inputs)


def _inputs(given: Inputs, paths: Sequence[str]) -> list[Traced]:
    return [given.parameters[path] for path in paths]


def _joints(given: Inputs) -> tuple[tuple[Traced, ...], tuple[Traced, ...]]:
    """Columns for the joint coordinates and their status; none where the family places the joints."""
    if given.machine.family.chains is None:
        return (), ()
    coordinates = tuple(given.graph.input() for _ in range(given.machine.chains().size))
    return coordinates, (given.graph.input(),)


def _weighted(response: Response, weights: Weights) -> Operand:
    value: Scalar = 0.0
    for name, weight in weights:
        value = plus(value, times(float(weight), QUANTITIES[name].value(response)))
    return number(value)
