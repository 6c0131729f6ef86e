"""How a program takes a machine's parameters: as constants, fixed inputs or columns. Nothing is evaluated here."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from kinetostat.algebra.scalar import Scalar
from kinetostat.engine.trace import Array, Graph, Operand, Traced
from kinetostat.engine.trigonometry import LARGEST_ANGLE
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values

ORDINARY = (1e-25, 1e25)
"""Bounds of ordinary parameters: what a handful of them make is neither zero nor infinite by a wide margin."""


@dataclass(frozen=True)
class Form:
    """What a program makes of the parameters of a machine, by leaf path.

    Attributes:
        constant: values that are part of the code: exactly 0 or infinite, and 1 or -1 in directions.
        inputs: the numbers that are the same at all points, and whether each is ordinary: positive, far from 0 and from
            infinity.
        uses: which parameters take which of these numbers, and whether with the other sign.
        varying: the columns, in order.
    """

    constant: tuple[tuple[str, float], ...]
    inputs: tuple[bool, ...]
    uses: tuple[tuple[str, int, bool], ...]
    varying: tuple[str, ...]


def form_of(machine: Machine, varying: Sequence[str], kept: Collection[str] = ()) -> tuple[Form, Array]:
    """The form of a machine's programs and the values of their fixed inputs, SI.

    Parameters of one size share an input: what cancels by form, like heights of joints in one plane, is then not
    computed at all.

    Args:
        machine: its family, and all parameters that do not vary.
        varying: leaf paths of the parameters that vary.
        kept: leaf paths of those that are inputs of their own, even if they are 0.
    """
    fixed = {path: float(value) for path, value in values(machine).items() if path not in varying}
    turns = [path for path in angles(machine) & fixed.keys() if math.isfinite(fixed[path])]
    fixed |= {path: float(reduced(np.array(fixed[path]))) for path in turns}
    axes = directions(machine)
    simple = {path: (0.0, 1.0) if path in axes else (0.0,) for path in fixed if path not in kept}
    constant = {path: v for path, v in fixed.items() if math.isinf(v) or abs(v) in simple.get(path, ())}
    numbers: list[float] = []
    known: dict[float, int] = {}
    uses = []
    for path, value in fixed.items():
        if path in constant:
            continue
        alone = path in kept
        place = len(numbers) if alone else known.setdefault(abs(value), len(numbers))
        if place == len(numbers):
            numbers.append(value if alone else abs(value))
        uses.append((path, place, value < 0.0 and not alone))
    ordinary = tuple(ORDINARY[0] < number < ORDINARY[1] for number in numbers)
    return Form(tuple(constant.items()), ordinary, tuple(uses), tuple(varying)), np.array(numbers)


def angles(machine: Machine) -> frozenset[str]:
    """Leaf paths of all angles."""
    return frozenset(p.path for p in parameters(machine.family) if p.quantity.kind == "angle")


def directions(machine: Machine) -> frozenset[str]:
    """Leaf paths of all components of axes."""
    return frozenset(leaf for p in parameters(machine.family) if p.quantity.kind == "direction" for leaf in p.leaves)


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
        fixed: inputs that are the same at all points.
        columns: those that vary, by leaf path.
        parameters: all that are not constant, by leaf path: inputs, some with the other sign.
        machine: with them.
    """

    graph: Graph
    fixed: tuple[Traced, ...]
    columns: dict[str, Traced]
    parameters: dict[str, Traced]
    machine: Machine


def traced(kind: Kind, form: Form) -> Inputs:
    """A machine of this kind with the inputs of a form, in a new graph."""
    graph = Graph()
    fixed = tuple(graph.input(True, ORDINARY if ordinary else None) for ordinary in form.inputs)
    columns = {path: graph.input() for path in form.varying}
    used = {path: -fixed[place] if negative else fixed[place] for path, place, negative in form.uses}
    machine = with_values(kind.machine, {**dict(form.constant), **used, **columns})
    return Inputs(graph, fixed, columns, {**used, **columns}, machine)


def number(value: Scalar) -> Operand:
    """A result as a program takes it: a node, or a float where it depends on nothing."""
    return float(value) if isinstance(value, int | float) else value
