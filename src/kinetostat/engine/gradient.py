"""Derivatives of traced results by their inputs, in reverse mode: as further nodes, or as numbers. No machine is known.

Every operation passes on to its operands how a result depends on them, from the result back to the inputs. The rules
hold over any scalar: over nodes, derivatives are further nodes of the same graph, shared where equal (`gradient`); over
arrays they are numbers, beside those of the results themselves (`InterpretedBody`).

At a kink a derivative is that of the branch that is taken, of |0| that of the positive side. What a branch not taken
makes infinite must be kept out of it, as by where(d > 0, 1 / where(d > 0, d, 1), 0).

Source: Griewank and Walther 2008, Evaluating Derivatives, section 3.2.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero, where
from kinetostat.arrays import Array, Codes
from kinetostat.engine.trace import Body, Condition, Node, Operand, Traced, needed_nodes, rows_of

TURN_OPERATION = "turn"
"""Operation of a cosine or sine as derivatives see it; its operands are the angle and the derivative by it. A graph
has no such operation: it computes cosines and sines by arithmetic, see `Graph.turns`."""


def with_gradients(body: Body, inputs: Sequence[Traced]) -> Body:
    """Return a body with further results: of each result in turn, its derivative by each input."""
    if not inputs:
        return body
    slopes = [slope for result in body.results for slope in gradient(result, inputs)]
    return Body(body.fixed, body.columns, [*body.results, *slopes], body.code)


def gradient(result: Operand, inputs: Sequence[Traced]) -> list[Operand]:
    """Return the derivative of a result by each of some inputs.

    Args:
        result: a node, or a float that depends on nothing.
        inputs: nodes of the same graph: its inputs, or any others.

    Returns:
        A node of the same graph for each input, or a float where the derivative is the same everywhere.
    """
    if not isinstance(result, Node) or not inputs:  # without inputs, no graph has to be gone through
        return [0.0] * len(inputs)
    slopes: dict[Node, Operand] = {result: 1.0}
    active = active_nodes([result], inputs)
    members = set(active)
    for node in reversed(active):
        slope = slopes.get(node, 0.0)
        if is_zero(slope):
            continue
        operation, operands = rule(node)
        for place, operand in parents(node):
            if operand in members:
                share = share_of(operation, operands, node, place, slope)
                slopes[operand] = slopes.get(operand, 0.0) + share
    return [slopes.get(given, 0.0) for given in inputs]


def active_nodes(results: Iterable[Node], inputs: Iterable[Traced]) -> list[Node]:
    """The nodes on which a result depends smoothly and which so depend on an input, both included, operands first."""
    reached, input_nodes = set(results), set(inputs)
    waiting = list(reached)
    while waiting:
        fresh = {operand for _, operand in parents(waiting.pop())} - reached
        reached |= fresh
        waiting.extend(fresh)
    active: dict[Node, None] = {}
    for node in sorted(reached, key=lambda node: node.number):
        if node in input_nodes or any(operand in active for _, operand in parents(node)):
            active[node] = None
    return list(active)


def rule(node: Node) -> tuple[str, tuple[Operand, ...]]:
    """Return the operation of a node and its operands, as derivatives see them."""
    turn = node.graph.turns.get(node)
    return (node.operation, node.operands) if turn is None else (TURN_OPERATION, turn)


def parents(node: Node) -> list[tuple[int, Traced]]:
    """Place and node of the operands on which a node depends smoothly."""
    turn = node.graph.turns.get(node)
    if turn is not None:
        return [(0, turn[0])]
    if isinstance(node, Condition) or node.operation == "steady":  # "steady" passes a value on without its derivative
        return []
    return [(place, operand) for place, operand in enumerate(node.operands) if isinstance(operand, Traced)]


def share_of(operation: str, operands: Sequence[Any], value: Scalar, place: int, slope: Scalar) -> Scalar:
    """The slope of a result by the operand at a place, through one node: the node's slope times their derivative.

    Args:
        operation, operands: as `rule` gives them; operands over any scalar.
        value: value of the node.
        place: place of the operand.
        slope: slope of the result by the node.
    """
    match operation:
        case "add" | "sub" | "neg":
            return -slope if operation == "neg" or (operation == "sub" and place) else slope
        case "mul":
            return slope * operands[1 - place]
        case "div":
            share = slope * (1.0 / operands[1])  # the graph makes this reciprocal once, for both operands
            return share if place == 0 else -(share * value)
        case "sqrt":
            return slope * (0.5 * (1.0 / value))
        case "atan2":
            y, x = operands
            return slope * ((x if place == 0 else -y) * (1.0 / (x * x + y * y)))
        case "abs":
            return where(operands[0] < 0.0, -slope, slope)
        case "where":
            return where(operands[0], slope, 0.0) if place == 1 else where(operands[0], 0.0, slope)
        case _ if operation == TURN_OPERATION:
            return slope * operands[1]
    raise ValueError(f"no derivative of {operation}")


NUMPY_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "abs": np.absolute,
    "sqrt": np.sqrt,
    "atan2": np.arctan2,
    "steady": np.positive,
    "lt": np.less,
    "le": np.less_equal,
    "and": np.logical_and,
    "where": np.where,
}
"""Every operation of a graph."""
UNBOUNDED = {"mul", "div", "sqrt", "atan2", TURN_OPERATION}
"""Operations whose derivative may be infinite."""

Values = dict[int, Any]
"""Values by numbers of nodes."""


class InterpretedBody:
    """A body evaluated node by node with NumPy, for a few points, where machine code would not pay.

    Its results are those of the body, and then of each in turn its derivative by each input.

    Attributes:
        rows: number of rows of results.
    """

    def __init__(self, body: Body, inputs: Sequence[Traced]) -> None:
        self._body, self._inputs = body, inputs
        self.rows = len(body.results) * (1 + len(inputs))
        self._active = active_nodes((result for result in body.results if isinstance(result, Node)), inputs)
        rates = [operand for node in self._active for operand in rule(node)[1]]
        needed = needed_nodes([*body.results, body.code, *rates])
        self._evaluated_nodes = [node for node in needed if node.operation != "input"]

    def run(self, fixed: Array, columns: Sequence[Array], results: Array, codes: Codes) -> None:
        """Evaluate points, see `trace.Runnable`."""
        body, count = self._body, len(self._body.results)
        values: Values = {node.number: value for node, value in zip(body.fixed, fixed, strict=True)}
        values |= {node.number: column for node, column in zip(body.columns, rows_of(columns), strict=True)}
        with np.errstate(all="ignore"):
            for node in self._evaluated_nodes:
                values[node.number] = NUMPY_FUNCTIONS[node.operation](*(_value(values, o) for o in node.operands))
            for row, result in zip(results[:count], body.results, strict=True):
                row[:] = _value(values, result)
            codes[:] = _value(values, body.code)
            self._backward(values, results[count:].reshape(count, len(self._inputs), len(codes)))

    def _backward(self, values: Values, gradients: Array) -> None:
        """Pass slopes of all results back to the inputs at once, into `gradients` [results x inputs x points]."""
        gradients[:] = 0.0
        slopes = self._seeds(len(gradients[0, 0]) if gradients.size else 0)
        rows: defaultdict[int, list[int]] = defaultdict(list)
        for row, traced_input in enumerate(self._inputs):
            rows[traced_input.number].append(row)
        members = {node.number for node in self._active}
        for node in reversed(self._active):
            slope = slopes.pop(node.number, None)
            if slope is None:
                continue
            if node.number in rows:
                gradients[:, rows[node.number]] = slope[:, None]
            operation, operands = rule(node)
            operand_values = [_value(values, operand) for operand in operands]
            for place, operand in parents(node):
                if operand.number in members:
                    share = share_of(operation, operand_values, values[node.number], place, slope)
                    if operation in UNBOUNDED:  # 0 times an infinite derivative is 0 here, not NaN
                        share = np.where(slope == 0.0, 0.0, share)
                    slopes[operand.number] = slopes[operand.number] + share if operand.number in slopes else share

    def _seeds(self, points: int) -> dict[int, Array]:
        """Return the slope of each result by itself: 1 [results x points]."""
        seeds: dict[int, Array] = {}
        for k, result in enumerate(self._body.results):
            if isinstance(result, Node):
                seeds.setdefault(result.number, np.zeros((len(self._body.results), points)))[k] = 1.0
        return seeds


def _value(values: Values, operand: Operand) -> Any:
    return values[operand.number] if isinstance(operand, Node) else operand
