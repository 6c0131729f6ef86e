"""Traced scalars: a formula that runs once on them leaves its arithmetic behind as a graph. Nothing is compiled here.

Equal expressions are one node, constants are folded, and signs move outward, so that what is left is what has to be
computed. Rewritings are exact in IEEE arithmetic, infinities and NaN included, up to the sign of a zero, with one
exception: a factor that is 0 by form makes a product 0, even where the other factor is infinite or NaN, so that what is
not there adds nothing.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NoReturn, Protocol, TypeAlias

from kinetostat.arrays import Array, Codes
from kinetostat.engine.trigonometry import cos_and_sin
from kinetostat.frozen import dataclass

Operand: TypeAlias = "Node | float"
Bounds: TypeAlias = tuple[float, float]

COMMUTATIVE = {"add", "mul", "and"}
TRUSTED_BOUNDS = (1e-280, 1e280)
"""Bounds beyond which nothing is known of a number. They lie so far inside float64 that rounding and a few more
operations neither overflow nor underflow."""
ORDINARY_BOUNDS = (1e-25, 1e25)
"""Bounds of ordinary numbers: what a handful of them make is neither zero nor infinite by a wide margin."""


class Node:
    """One value of a graph: an operation and its operands. Two equal values of one graph are the same object.

    A formula may say more of a value than its arithmetic shows (`Namespace.finite`, `Namespace.ordinary`). This holds
    for all formulas of the graph, because the value is the same, but what has been traced before is not simplified
    again: formulas say it before they use the value.

    Attributes:
        operation: "input" or one of `gradient.NUMPY_FUNCTIONS`.
        operands: nodes and floats; empty for an input.
        number: position in the graph; operands have smaller ones.
        fixed: whether it depends on inputs alone that are the same at all points.
        bounds: positive numbers between which it is known to lie; None if it may be anything.
        finite: whether a formula has said that it is finite, whatever its arithmetic shows.
    """

    __slots__ = ("bounds", "finite", "fixed", "graph", "number", "operands", "operation")

    def __init__(
        self, graph: "Graph", operation: str, operands: tuple[Operand, ...], fixed: bool, bounds: Bounds | None
    ) -> None:
        self.graph = graph
        self.operation = operation
        self.operands = operands
        self.number = len(graph.nodes)
        self.fixed = fixed
        self.bounds = bounds
        self.finite = False
        graph.nodes.append(self)

    def __array_namespace__(self) -> "Namespace":
        return NAMESPACE

    def __bool__(self) -> NoReturn:
        raise TypeError("a traced value has no truth value; choose with kinetostat.algebra.scalar.where")


class Condition(Node):
    """A traced truth value."""

    __slots__ = ()

    def __and__(self, other: "Condition | bool") -> "Condition | bool":
        if isinstance(other, Condition):
            return self if other is self else self.graph.condition("and", self, other)
        return self if other else False

    __rand__ = __and__


class Traced(Node):
    """A traced number: takes part in arithmetic like a float."""

    __slots__ = ()

    def __add__(self, other: Operand) -> Operand:
        return _add(self, other)

    def __radd__(self, other: Operand) -> Operand:
        return _add(other, self)

    def __sub__(self, other: Operand) -> Operand:
        return _sub(self, other)

    def __rsub__(self, other: Operand) -> Operand:
        return _sub(other, self)

    def __mul__(self, other: Operand) -> Operand:
        return _mul(self, other)

    def __rmul__(self, other: Operand) -> Operand:
        return _mul(other, self)

    def __truediv__(self, other: Operand) -> Operand:
        return _div(self, other)

    def __rtruediv__(self, other: Operand) -> Operand:
        return _div(other, self)

    def __neg__(self) -> "Traced":
        inner = _negated_operand(self)
        return self.graph.number("neg", self) if inner is None else inner

    def __abs__(self) -> "Traced":
        negated = _negated_operand(self)
        inner = self if negated is None else negated
        return inner if inner.operation in {"abs", "sqrt"} or inner.bounds else self.graph.number("abs", inner)

    def __lt__(self, other: Operand) -> Condition | bool:
        return _compare("lt", self, other)

    def __le__(self, other: Operand) -> Condition | bool:
        return _compare("le", self, other)

    def __gt__(self, other: Operand) -> Condition | bool:
        return _compare("lt", other, self)

    def __ge__(self, other: Operand) -> Condition | bool:
        return _compare("le", other, self)


class Namespace:
    """The functions that `__array_namespace__` of a traced value offers."""

    @staticmethod
    def sqrt(a: Traced) -> Traced:
        """Square root, NaN for a negative argument."""
        return a.graph.number("sqrt", a)

    @staticmethod
    def steady(a: Traced) -> Traced:
        """The number itself, which derivatives take for a constant."""
        return a.graph.number("steady", a)

    @staticmethod
    def finite(a: Traced) -> Traced:
        """The number itself, which comparisons that are traced after this take for finite."""
        a.finite = True
        return a

    @staticmethod
    def ordinary(a: Traced) -> Traced:
        """The number itself, which what is traced after this takes for positive, and far from both ends of float64."""
        a.bounds = a.bounds or ORDINARY_BOUNDS
        return a

    @staticmethod
    def bounded(a: Traced) -> bool:
        """Tell whether its bounds are known."""
        return a.bounds is not None

    @staticmethod
    def atan2(y: Operand, x: Operand) -> Traced:
        """Angle in rad of the point (x, y)."""
        return _binary("atan2", _operand(y), _operand(x))

    @staticmethod
    def where(condition: Condition, a: Operand, b: Operand) -> Operand:
        """`a` where the condition holds, `b` elsewhere."""
        a, b = _operand(a), _operand(b)
        if a is b or (isinstance(a, float) and isinstance(b, float) and a == b):
            return a
        return condition.graph.number("where", condition, a, b)

    @staticmethod
    def cos(a: Traced) -> Operand:
        """Cosine of an angle in rad, see `cos_and_sin`."""
        return _turn(a)[0]

    @staticmethod
    def sin(a: Traced) -> Operand:
        """Sine of an angle in rad, see `cos_and_sin`."""
        return _turn(a)[1]


def _turn(angle: Traced) -> tuple[Traced, Traced]:
    """Cosine and sine of an angle, entered in the graph's table of them."""
    cosine, sine = cos_and_sin(angle)
    angle.graph.turns[cosine] = angle, -sine
    angle.graph.turns[sine] = angle, cosine
    return cosine, sine


NAMESPACE = Namespace()


class Graph:
    """The arithmetic of a formula.

    Attributes:
        nodes: all values, operands before what uses them.
        turns: of each node that is a cosine or sine, the angle and the derivative by it; the operations that compute it
            say less.
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.turns: dict[Node, tuple[Traced, Operand]] = {}
        self._known: dict[tuple[Any, ...], Any] = {}

    def input(self, fixed: bool = False, bounds: Bounds | None = None) -> Traced:
        """A new input: the same at all points if `fixed`; bounds as of a node."""
        return Traced(self, "input", (), fixed, bounds)

    def number(self, operation: str, *operands: Operand) -> Traced:
        """The number that an operation gives."""
        return self._node(Traced, operation, operands)

    def condition(self, operation: str, *operands: Operand) -> Condition:
        """The condition that an operation gives."""
        return self._node(Condition, operation, operands)

    def of_two(self, operation: str, a: Traced, b: Traced) -> Any:
        """The number that an operation gives of two traced ones. Most are such: this is `number` in half the time."""
        if operation in COMMUTATIVE and b.number < a.number:
            a, b = b, a
        key = operation, a, b
        node = self._known.get(key)
        if node is None:
            bounds = bounds_of(operation, (a, b)) if a.bounds and b.bounds else None
            node = self._known[key] = Traced(self, operation, (a, b), a.fixed and b.fixed, bounds)
        return node

    def known_node(self, operation: str, *operands: Operand) -> Any:
        """The node of an operation if it has been traced already, else None."""
        return self._known.get(_key(operation, operands))

    def _node(self, kind: Callable[..., Any], operation: str, operands: tuple[Operand, ...]) -> Any:
        key = _key(operation, operands)
        node = self._known.get(key)
        if node is None:
            fixed = True
            for operand in operands:  # a loop: this line runs for every node, and a generator takes thrice as long
                fixed = fixed and (isinstance(operand, float) or operand.fixed)
            node = self._known[key] = kind(self, operation, operands, fixed, bounds_of(operation, operands))
        return node


@dataclass(frozen=True)
class Body:
    """The arithmetic of each point.

    Attributes:
        fixed: inputs that are the same at all points.
        columns: inputs that vary.
        results: nodes, or numbers where a result depends on nothing.
        code: a small integer beside the results: a node or a number.
    """

    fixed: Sequence[Traced]
    columns: Sequence[Traced]
    results: Sequence[Operand]
    code: Operand


class Runnable(Protocol):
    """A body that can be evaluated."""

    @property
    def rows(self) -> int:
        """Number of results, derivatives included."""

    def run(self, fixed: Array, columns: Sequence[Array], results: Array, codes: Codes) -> None:
        """Evaluate points.

        Args:
            fixed: values of the fixed inputs.
            columns: values of the others [points], or of several of them [k x points]; those of a row are contiguous.
            results: array for the results [results x points]; rows may lie apart, the points of a row may not.
            codes: array for the codes [points].
        """


def rows_of(columns: Iterable[Array]) -> list[Array]:
    """Return the columns of a program one by one, see `Runnable.run`."""
    return [row for column in columns for row in (column if column.ndim > 1 else (column,))]


def needed_nodes(results: Iterable[Operand]) -> list[Node]:
    """The nodes on which some results depend, in the order in which they were traced: operands first."""
    needed: set[Node] = set()
    waiting = list(results)
    while waiting:
        operand = waiting.pop()
        if isinstance(operand, Node) and operand not in needed:
            needed.add(operand)
            waiting.extend(operand.operands)
    return sorted(needed, key=lambda node: node.number)


def _key(operation: str, operands: tuple[Operand, ...]) -> tuple[Any, ...]:
    """The key that tells an expression from others: nodes as they are, floats by value, zeros by their sign too."""
    if operation in COMMUTATIVE:
        a, b = operands
        if isinstance(a, float) or (isinstance(b, Node) and b.number < a.number):
            a, b = b, a
        return operation, a, b if isinstance(b, Node) else b or repr(b)
    return operation, *[o if isinstance(o, Node) else o or repr(o) for o in operands]


def bounds_of(operation: str, operands: tuple[Operand, ...]) -> Bounds | None:
    """Positive numbers between which the result of an operation lies; None if none are known within `TRUSTED_BOUNDS`.

    What is known to be ordinary needs no code for what is rigid (infinite) or free (zero).
    """
    known = []
    for operand in operands:
        if not isinstance(operand, Condition):
            between = _bounds(operand)
            if between is None:
                return None
            known.append(between)
    match operation, known:
        case "add", [(low, high), (least, most)]:
            bounds = low + least, high + most
        case "mul", [(low, high), (least, most)]:
            bounds = low * least, high * most
        case "div", [(low, high), (least, most)]:
            bounds = low / most, high / least
        case "where", [(low, high), (least, most)]:
            bounds = min(low, least), max(high, most)
        case "sqrt", [(low, high)]:
            bounds = math.sqrt(low), math.sqrt(high)
        case _:
            return None
    return bounds if TRUSTED_BOUNDS[0] < bounds[0] and bounds[1] < TRUSTED_BOUNDS[1] else None


def _bounds(operand: Operand) -> Bounds | None:
    if isinstance(operand, Node):
        return operand.bounds
    return (operand, operand) if 0.0 < operand < math.inf else None


def _operand(a: Any) -> Any:
    """A number as an operand: any Python or NumPy number is a float."""
    return a if isinstance(a, Node) else float(a)


def _negated_operand(a: Operand) -> Any:
    """b where `a` is -b by its form, else None."""
    return a.operands[0] if isinstance(a, Node) and a.operation == "neg" else None


def _binary(operation: str, a: Operand, b: Operand) -> Traced:
    return (a if isinstance(a, Node) else b).graph.number(operation, a, b)  # type: ignore[union-attr]


# The operands of most operations are two traced numbers without a sign. Each function begins with this case, to which
# its other tests do not apply: without that, the stiffness of a hexapod takes 1.36 times as long to trace. A function
# for the condition would cost 5 %, so that each has it.


def _add(a: Any, b: Any) -> Any:
    if a.__class__ is b.__class__ is Traced and a.operation != "neg" != b.operation:
        return a.graph.of_two("add", a, b)
    a, b = _operand(a), _operand(b)
    if a == 0.0:
        return b
    if b == 0.0:
        return a
    if (minus := _negated_operand(b)) is not None:
        return _sub(a, minus)
    if (minus := _negated_operand(a)) is not None:
        return _sub(b, minus)
    return _binary("add", a, b)


def _sub(a: Any, b: Any) -> Any:
    if a.__class__ is b.__class__ is Traced and a.operation != "neg" != b.operation:
        if a is b and a.bounds:
            return 0.0
        opposite = a.graph._known.get(("sub", b, a))  # `known_node`, less the making of a key: 4 % of the whole time
        if opposite is not None:
            return -opposite
        return a.graph.of_two("sub", a, b)
    a, b = _operand(a), _operand(b)
    if b == 0.0:
        return a
    if a == 0.0:
        return -b
    if a is b and a.bounds:
        return 0.0
    if (minus := _negated_operand(b)) is not None:
        return _add(a, minus)
    if (minus := _negated_operand(a)) is not None:
        return -_add(minus, b)
    graph = (a if isinstance(a, Node) else b).graph
    opposite = graph.known_node("sub", b, a)
    return _binary("sub", a, b) if opposite is None else -opposite


def _mul(a: Any, b: Any) -> Any:
    if a.__class__ is b.__class__ is Traced and a.operation != "neg" != b.operation:
        return a.graph.of_two("mul", a, b)
    a, b = _operand(a), _operand(b)
    if isinstance(a, float):
        a, b = b, a
    if b == 1.0:
        return a
    if b == 0.0:  # zero by form, at every point: it drops out even where `a` is infinite
        return 0.0
    if isinstance(b, float) and math.copysign(1.0, b) < 0.0:
        return -_mul(a, -b)
    if (minus := _negated_operand(a)) is not None:
        return -_mul(minus, b)
    if (minus := _negated_operand(b)) is not None:
        return -_mul(a, minus)
    return _binary("mul", a, b)


def _div(a: Any, b: Any) -> Any:
    if a.__class__ is b.__class__ is Traced and a.operation != "neg" != b.operation:
        if a is b and a.bounds:
            return 1.0
        return a.graph.of_two("div", a, b)
    a, b = _operand(a), _operand(b)
    if b == 1.0:
        return a
    if a is b and a.bounds:
        return 1.0
    if (minus := _negated_operand(a)) is not None:
        return -_div(minus, b)
    if (minus := _negated_operand(b)) is not None:
        return -_div(a, minus)
    return _binary("div", a, b)


def _compare(operation: str, a: Any, b: Any) -> Condition | bool:
    a, b = _operand(a), _operand(b)
    if isinstance(a, Node) and a.finite and b == math.inf:
        return True
    if isinstance(a, Node) and a.bounds and isinstance(b, float) and (b <= 0.0 or b == math.inf):
        return b > 0.0
    if isinstance(b, Node) and b.bounds and isinstance(a, float) and (a <= 0.0 or a == math.inf):
        return a <= 0.0
    return (a if isinstance(a, Node) else b).graph.condition(operation, a, b)
