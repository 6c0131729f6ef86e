"""Writes a traced graph for other programs: as straight-line C, or packed into a text.

`print_graph` writes C without a loop and without a call but those of the table. `pack_graph` writes a short text that
fits into an address: data, no code, which the reader checks and makes functions of.

Each operation is a row of `NOTATION`. An operation that is used once stands inside of the expression that uses it, as
long as a line stays short; everything else has a line and a name of its own. Nothing is rounded: numbers are printed
with all digits, and operations stay those of the graph, so that the code gives what machine code and NumPy give.
"""

import math
import re
from collections import Counter
from collections.abc import Sequence

from kinetostat.engine.trace import Condition, Node, Operand, Traced, needed_nodes
from kinetostat.frozen import dataclass

LONGEST_EXPRESSION = 92
"""Characters up to which an expression takes in another one: with its name and indentation a line stays below 120."""

NOTATION: dict[str, str] = {
    "add": "{0} + {1}",
    "sub": "{0} - {1}",
    "mul": "{0} * {1}",
    "div": "{0} / {1}",
    "neg": "-{0}",
    "lt": "{0} < {1}",
    "le": "{0} <= {1}",
    "and": "{0} && {1}",
    "where": "{0} ? {1} : {2}",
    "steady": "{0}",
    "abs": "fabs({0})",
    "sqrt": "sqrt({0})",
    "atan2": "atan2({0}, {1})",
}
"""Every operation of a graph in the notation of C; packed programs count them in this order."""
ATOM = re.compile(r"(\w+(\[\d+\])?|\d+(\.\d+)?(e[+-]?\d+)?)$")
"""A name, an element or a positive number."""
CALL = re.compile(r"[\w.]+\(")


@dataclass(frozen=True)
class Printed:
    """Source code of a graph.

    Attributes:
        first: declarations of constants that the condition and the code need, in order.
        condition: condition without which all results but the code are NaN; empty if there is none.
        code: expression of the code.
        then: declarations of what else the results need.
        results: expressions of the results, in order, where the condition holds.
        operations: number of operations.
    """

    first: tuple[str, ...]
    condition: str
    code: str
    then: tuple[str, ...]
    results: tuple[str, ...]
    operations: int


def print_graph(inputs: Sequence[Traced], names: Sequence[str], results: Sequence[Operand], code: Operand) -> Printed:
    """Print what some results and a code need, in C.

    Args:
        inputs: all inputs of the graph.
        names: how they are written.
        results: nodes of the graph, or numbers.
        code: the same.

    Raises:
        ValueError: a result needs another input.
    """
    written = {node.number: name for node, name in zip(inputs, names, strict=True)}
    condition, values = _condition_of(results)
    decided = [code] if condition is None else [condition, code]
    before = dict.fromkeys(needed_nodes(decided))
    used = [*before, *(node for node in needed_nodes([*values, *decided]) if node not in before)]
    uses = _use_counts(used, [*values, *decided])
    lines: list[str] = []
    first = 0
    for place, node in enumerate(used, 1):
        if node.number not in written:
            if node.operation == "input":
                raise ValueError("a result depends on an input that has no name")
            text = _expression(node, written)
            if uses[node.number] > 1 or len(text) > LONGEST_EXPRESSION:
                name = f"v{len(lines)}"
                kind = "const int" if isinstance(node, Condition) else "const double"
                lines.append(f"{kind} {name} = {text};")
                text = name
            written[node.number] = text
        if place == len(before):
            first = len(lines)
    return Printed(
        first=tuple(lines[:first]),
        condition="" if condition is None else _operand(condition, written),
        code=_operand(code, written),
        then=tuple(lines[first:]),
        results=tuple(_operand(value, written) for value in values),
        operations=sum(node.operation != "input" for node in used),
    )


def _use_counts(nodes: Sequence[Node], results: Sequence[Operand]) -> Counter[int]:
    """Count how often each node is used, by other nodes and as a result."""
    uses = Counter(operand.number for node in nodes for operand in node.operands if isinstance(operand, Node))
    uses.update(result.number for result in results if isinstance(result, Node))
    return uses


def _condition_of(results: Sequence[Operand]) -> tuple[Condition | None, list[Operand]]:
    """Find the condition without which all results are NaN, and return it with their values where it holds."""
    values: list[Operand] = []
    conditions: set[Condition] = set()
    for result in results:
        if isinstance(result, Node) and result.operation == "where":
            condition, value, otherwise = result.operands
            if isinstance(condition, Condition) and isinstance(otherwise, float) and math.isnan(otherwise):
                conditions.add(condition)
                values.append(value)
    if len(values) < len(results) or len(conditions) != 1:
        return None, [*results]
    return conditions.pop(), values


def _expression(node: Node, written: dict[int, str]) -> str:
    """Write the operation of a node on its operands, of which all have been written, by their numbers."""
    form = NOTATION[node.operation]
    operands = [_operand(operand, written) for operand in node.operands]
    if not CALL.match(form):
        operands = [operand if _is_plain(operand) else f"({operand})" for operand in operands]
    return form.format(*operands)


def _is_plain(text: str) -> bool:
    """Return whether an operand is a name, a positive number, an element or a call, which needs no brackets."""
    call = CALL.match(text)
    return bool(ATOM.match(text)) or (call is not None and _closes_at_end(text, call.end()))


def _closes_at_end(text: str, start: int) -> bool:
    """Return whether the bracket before a place of a text is closed by its last character."""
    depth = 1
    for place in range(start, len(text)):
        depth += (text[place] == "(") - (text[place] == ")")
        if depth == 0:
            return place == len(text) - 1
    return False


def _operand(operand: Operand, written: dict[int, str]) -> str:
    return written[operand.number] if isinstance(operand, Node) else literal(operand)


def literal(number: float) -> str:
    """Write a number in C with all its digits."""
    if math.isnan(number):
        return "NAN"
    if math.isinf(number):
        return "INFINITY" if number > 0.0 else "-INFINITY"
    return repr(float(number))


LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"
"""Digits of packed counts, five bits each; those of the second half say that another digit follows."""
NUMBER, EARLIER = "#", "@"
"""Letters of a packed program for a number of its table, and for a value that was kept."""


def pack_graph(inputs: Sequence[Traced], results: Sequence[Operand]) -> dict[str, object]:
    """Write what some results need as a program for a stack: short, and data rather than code.

    Each letter of `code` does one thing. `#` lays a number on the stack, and `@` a value that was kept; which one, the
    next count of `references` says. Kept are the inputs and, in capitals, what operations give that is used again;
    the value that was kept or used last is counted 0, so that counts are small. A letter from a on is an operation of
    `NOTATION` that takes its operands from the stack and lays its value there. At the end the results lie there.

    Args:
        inputs: all inputs of the graph, of which the first one is counted 0 at the start.
        results: nodes of the graph, or numbers.

    Returns:
        Texts `code` and `references`, and the list `numbers`, where words stand for what JSON cannot write.

    Raises:
        ValueError: a result needs another input.
    """
    used = needed_nodes(results)
    uses = _use_counts(used, results)
    letters = {operation: chr(ord("a") + place) for place, operation in enumerate(NOTATION)}
    kept = [node.number for node in inputs]
    all_kept = set(kept)  # to ask the list itself would read all of it for each operation
    numbers: dict[str, int] = {}  # by their digits, so that 0 is not -0
    code: list[str] = []
    counts: list[int] = []
    waiting: list[tuple[Operand, bool]] = [(result, False) for result in reversed(results)]
    while waiting:
        operand, ready = waiting.pop()
        if not isinstance(operand, Node):
            code.append(NUMBER)
            counts.append(numbers.setdefault(repr(float(operand)), len(numbers)))
        elif ready:
            again = uses[operand.number] > 1
            code.append(letters[operand.operation].upper() if again else letters[operand.operation])
            if again:
                kept.insert(0, operand.number)
                all_kept.add(operand.number)
        elif operand.number in all_kept:
            counts.append(kept.index(operand.number))
            kept.insert(0, kept.pop(counts[-1]))
            code.append(EARLIER)
        elif operand.operation == "input":
            raise ValueError("a result depends on an input that is not given")
        else:
            waiting.append((operand, True))
            waiting += [(earlier, False) for earlier in reversed(operand.operands)]
    table = [float(digits) if math.isfinite(float(digits)) else digits for digits in numbers]
    return {"code": "".join(code), "references": "".join(map(_digits, counts)), "numbers": table}


def _digits(count: int) -> str:
    """Write a count in digits of `LETTERS`, the least first."""
    text = ""
    while count >= 32:
        text += LETTERS[32 + count % 32]
        count //= 32
    return text + LETTERS[count]
