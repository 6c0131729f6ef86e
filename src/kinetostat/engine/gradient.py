"""Derivatives of traced results by their inputs, in reverse mode. Machines are not known here.

Every operation passes on to its operands how a result depends on them, from the result back to the inputs. The rules
hold over any scalar: over nodes, derivatives are further nodes of the same graph, shared where equal; over arrays
they are numbers (`interpreter`).

At a kink a derivative is that of the branch that is taken, of |0| that of the positive side. What a branch not taken
makes infinite must be kept out of it, as by where(d > 0, 1 / where(d > 0, d, 1), 0).

Source: Griewank and Walther 2008, Evaluating Derivatives, section 3.2.
"""

from collections.abc import Iterable, Sequence
from typing import Any

from kinetostat.algebra.scalar import Scalar, is_zero, where
from kinetostat.engine.trace import Body, Condition, Node, Operand, Traced

TURN = "turn"
"""Operation of a cosine or sine as derivatives see it; its operands are the angle and the derivative by it."""


def with_gradients(body: Body, inputs: Sequence[Traced]) -> Body:
    """Return a body with further results: of each result in turn, its derivative by each input."""
    slopes = [slope for result in body.results for slope in gradient(result, inputs)]
    return Body(body.fixed, body.columns, [*body.results, *slopes], body.code)


def gradient(result: Operand, inputs: Sequence[Traced]) -> list[Operand]:
    """The derivative of a result by each of some inputs.

    Args:
        result: a node, or a float that depends on nothing.
        inputs: nodes of the same graph: its inputs, or any others.

    Returns:
        A node of the same graph for each input, or a float where the derivative is the same everywhere.
    """
    if not isinstance(result, Node):
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
    reached, given = set(results), set(inputs)
    waiting = list(reached)
    while waiting:
        fresh = {operand for _, operand in parents(waiting.pop())} - reached
        reached |= fresh
        waiting.extend(fresh)
    active: dict[Node, None] = {}
    for node in sorted(reached, key=lambda node: node.number):
        if node in given or any(operand in active for _, operand in parents(node)):
            active[node] = None
    return list(active)


def rule(node: Node) -> tuple[str, tuple[Operand, ...]]:
    """The operation of a node and its operands, as derivatives see them."""
    turn = node.graph.turns.get(node)
    return (node.operation, node.operands) if turn is None else (TURN, turn)


def parents(node: Node) -> list[tuple[int, Traced]]:
    """Place and node of the operands on which a node depends smoothly."""
    turn = node.graph.turns.get(node)
    if turn is not None:
        return [(0, turn[0])]
    if isinstance(node, Condition) or node.operation == "steady":
        return []
    return [(place, operand) for place, operand in enumerate(node.operands) if isinstance(operand, Traced)]


def share_of(operation: str, operands: Sequence[Any], value: Scalar, place: int, slope: Scalar) -> Scalar:
    """The slope of a result by the operand at a place, through one node: the node's slope times their derivative.

    Args:
        operation, operands: as `rule` gives them; operands over any scalar.
        value: of the node.
        place: of the operand.
        slope: of the result by the node.
    """
    match operation:
        case "add":
            return slope
        case "sub":
            return slope if place == 0 else -slope
        case "neg":
            return -slope
        case "mul":
            return slope * operands[1 - place]
        case "div":
            share = slope * (1.0 / operands[1])
            return share if place == 0 else -(share * value)
        case "sqrt":
            return slope * (0.5 * (1.0 / value))
        case "abs":
            return where(operands[0] < 0.0, -slope, slope)
        case "where":
            return where(operands[0], slope, 0.0) if place == 1 else where(operands[0], 0.0, slope)
        case "turn":
            return slope * operands[1]
    raise ValueError(f"no derivative of {operation}")
