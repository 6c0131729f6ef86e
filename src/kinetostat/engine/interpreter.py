"""Evaluation of a traced graph node by node with NumPy, for a few points, where machine code would not pay.

The rules of derivatives are those of `gradient`.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from kinetostat.arrays import Array, Codes
from kinetostat.engine.gradient import TURN, active_nodes, parents, rule, share_of
from kinetostat.engine.trace import Body, Node, Operand, Traced, needed

FUNCTIONS: dict[str, Callable[..., Any]] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "abs": np.absolute,
    "sqrt": np.sqrt,
    "steady": np.positive,
    "lt": np.less,
    "le": np.less_equal,
    "and": np.logical_and,
    "where": np.where,
}
"""Every operation of a graph."""
UNBOUNDED = {"mul", "div", "sqrt", TURN}
"""Operations whose derivative may be infinite."""

Values = dict[int, Any]
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
        values: Values = {node.number: value for node, value in zip(body.fixed, fixed, strict=True)}
        values |= {node.number: column for node, column in zip(body.columns, columns, strict=True)}
        with np.errstate(all="ignore"):
            for node in self._lines:
                values[node.number] = FUNCTIONS[node.operation](*(_value(values, o) for o in node.operands))
            for row, result in zip(results[:count], body.results, strict=True):
                row[:] = _value(values, result)
            codes[:] = _value(values, body.code)
            self._backward(values, results[count:].reshape(count, len(self._inputs), len(codes)))

    def _backward(self, values: Values, gradients: Array) -> None:
        """Pass slopes of all results back to the inputs at once, into `gradients` [results x inputs x points]."""
        gradients[:] = 0.0
        slopes = self._seeds(len(gradients[0, 0]) if gradients.size else 0)
        rows = {node.number: k for k, node in enumerate(self._inputs)}
        members = {node.number for node in self._active}
        for node in reversed(self._active):
            slope = slopes.pop(node.number, None)
            if slope is None:
                continue
            if node.number in rows:
                gradients[:, rows[node.number]] = slope
            operation, operands = rule(node)
            given = [_value(values, operand) for operand in operands]
            for place, operand in parents(node):
                if operand.number in members:
                    share = share_of(operation, given, values[node.number], place, slope)
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


def _value(values: Values, operand: Operand) -> Any:
    return values[operand.number] if isinstance(operand, Node) else operand
