"""How a program takes a machine's parameters: as constants, fixed inputs or columns. Nothing is evaluated here."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from kinetostat.engine.body import Array
from kinetostat.engine.trace import Graph, Traced
from kinetostat.engine.trigonometry import LARGEST_ANGLE
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values

ORDINARY = (1e-100, 1e100)
"""Sizes between which a number and its reciprocal are by a wide margin neither zero nor infinite."""


@dataclass(frozen=True)
class Form:
    """What a program makes of the parameters of a machine, by leaf path.

    Attributes:
        constant: values that are part of the code: exactly 0 or infinite.
        inputs: those that are the same at all points.
        ordinary: of these, the ones that are far from 0 and from infinity.
        varying: the columns, in order.
    """

    constant: tuple[tuple[str, float], ...]
    inputs: tuple[str, ...]
    ordinary: frozenset[str]
    varying: tuple[str, ...]


def form_of(machine: Machine, varying: Sequence[str], kept: Collection[str] = ()) -> tuple[Form, Array]:
    """The form of a machine's programs and the values of their fixed inputs, SI.

    Args:
        machine: its family, and all parameters that do not vary.
        varying: leaf paths of the parameters that vary.
        kept: leaf paths of those that are inputs even if they are 0.
    """
    fixed = {path: float(value) for path, value in values(machine).items() if path not in varying}
    turns = [path for path in angles(machine) & fixed.keys() if math.isfinite(fixed[path])]
    fixed |= {path: float(reduced(np.array(fixed[path]))) for path in turns}
    constant = {path: v for path, v in fixed.items() if math.isinf(v) or (v == 0.0 and path not in kept)}
    inputs = {path: value for path, value in fixed.items() if path not in constant}
    ordinary = frozenset(path for path, value in inputs.items() if ORDINARY[0] < abs(value) < ORDINARY[1])
    form = Form(tuple(constant.items()), tuple(inputs), ordinary, tuple(varying))
    return form, np.array([*inputs.values()], dtype=float)


def angles(machine: Machine) -> frozenset[str]:
    """Leaf paths of all angles."""
    return frozenset(p.path for p in parameters(machine.family) if p.quantity.kind == "angle")


def reduced(angle: Array) -> Array:
    """The angles (rad), turned back to between -pi and pi if any is beyond what traced cosines take."""
    if angle.size == 0 or max(angle.max(), -angle.min()) <= LARGEST_ANGLE:
        return angle
    with np.errstate(invalid="ignore"):
        return np.arctan2(np.sin(angle), np.cos(angle))


@dataclass(frozen=True, eq=False)
class Kind:
    """A machine as a specimen of its family: equal to every other one of it."""

    machine: Machine

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Kind) and self.machine.family == other.machine.family

    def __hash__(self) -> int:
        return hash(self.machine.family)


@dataclass(frozen=True)
class Inputs:
    """A machine whose parameters are traced.

    Attributes:
        graph: in which they are.
        fixed, columns: its inputs, by leaf path.
        machine: with them.
        form: that says which parameters they are.
    """

    graph: Graph
    fixed: dict[str, Traced]
    columns: dict[str, Traced]
    machine: Machine
    form: Form


def traced(kind: Kind, form: Form) -> Inputs:
    """A machine of this kind with the inputs of a form, in a new graph."""
    graph = Graph()
    fixed = {path: graph.input(fixed=True, ordinary=path in form.ordinary) for path in form.inputs}
    columns = {path: graph.input() for path in form.varying}
    machine = with_values(kind.machine, {**dict(form.constant), **fixed, **columns})
    return Inputs(graph, fixed, columns, machine, form)
