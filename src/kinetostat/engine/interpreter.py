"""A traced graph evaluated node by node with NumPy: for one point or a few, where machine code would not pay."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from kinetostat.engine.gradient import TURN, active_nodes, parents, rule, share_of
from kinetostat.engine.trace import Array, Body, Codes, Node, Operand, Traced, needed

FUNCTIONS: dict[str, Callable[..., Any]] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "abs": np.absolute,
    "sqrt": np.sqrt,
    "lt": np.less,
    "le": np.less_equal,
    "and": np.logical_and,
    "where": np.where,
}
"""Every operation of a graph."""
UNBOUNDED = {"mul", "div", "sqrt", TURN}
"""Operations whose derivative may be infinite."""

Held = dict[int, Any]
"""Values by numbers of nodes."""


class Interpreted:
    """A body with its derivatives as NumPy calls: its results, and of each in turn its derivative by each input."""

    def __init__(self, body: Body, inputs: Sequence[Traced]) -> None:
        self._body, self._inputs = body, inputs
        self._active = active_nodes((result for result in body.results if isinstance(result, Node)), inputs)
        rates = [operand for node in self._active for operand in rule(node)[1]]
        self._lines = [node for node in needed([*body.results, body.code, *rates]) if node.operation != "input"]

    def run(self, fixed: Array, columns: Sequence[Array], results: Array, codes: Codes) -> None:
        """Evaluate points, see `body.Runnable`."""
        body, count = self._body, len(self._body.results)
        held: Held = {node.number: value for node, value in zip(body.fixed, fixed, strict=True)}
        held |= {node.number: column for node, column in zip(body.columns, columns, strict=True)}
        with np.errstate(all="ignore"):
            for node in self._lines:
                held[node.number] = FUNCTIONS[node.operation](*(_value(held, o) for o in node.operands))
            for row, result in zip(results[:count], body.results, strict=True):
                row[:] = _value(held, result)
            codes[:] = _value(held, body.code)
            self._backward(held, results[count:].reshape(count, len(self._inputs), len(codes)))

    def _backward(self, held: Held, found: Array) -> None:
        """Slopes of all results at once, into `found` [results x inputs x points]."""
        found[:] = 0.0
        slopes = self._seeds(len(found[0, 0]) if found.size else 0)
        rows = {node.number: k for k, node in enumerate(self._inputs)}
        members = {node.number for node in self._active}
        for node in reversed(self._active):
            slope = slopes.pop(node.number, None)
            if slope is None:
                continue
            if node.number in rows:
                found[:, rows[node.number]] = slope
            operation, operands = rule(node)
            given = [_value(held, operand) for operand in operands]
            for place, operand in parents(node):
                if operand.number in members:
                    share = share_of(operation, given, held[node.number], place, slope)
                    if operation in UNBOUNDED:
                        share = np.where(slope == 0.0, 0.0, share)
                    slopes[operand.number] = slopes[operand.number] + share if operand.number in slopes else share

    def _seeds(self, points: int) -> dict[int, Array]:
        """The slope of each result by itself: 1 [results x points]."""
        seeds: dict[int, Array] = {}
        for k, result in enumerate(self._body.results):
            if isinstance(result, Node):
                seeds.setdefault(result.number, np.zeros((len(self._body.results), points)))[k] = 1.0
        return seeds


def _value(held: Held, operand: Operand) -> Any:
    return held[operand.number] if isinstance(operand, Node) else operand
