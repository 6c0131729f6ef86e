"""Writes programs as LLVM assembly: the straight code of a traced graph, and loops that go through rows of matrices.

Nothing is compiled here, and no machine is known. Values that depend on fixed inputs alone are computed before the
loop over points. Operations that free registers come first: compared with the order of tracing, fewer values wait in
memory.
"""

import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from heapq import heappop, heappush

from kinetostat.engine.trace import Body, Condition, Node, Operand, Traced, needed_nodes

NAME = "kernel"
"""Name of the function that a program is."""
FUNCTION = """
{declarations}
define void @{name}(ptr noalias %fixed, ptr noalias %columns, ptr noalias %rows, ptr noalias %codes, i64 %count) {{
entry:
  {before}
  %last = sub i64 %count, {lanes}
  br label %loop
loop:
  %k = phi i64 [0, %entry], [%next, %{ends}]
  %beyond = icmp sgt i64 %k, %last
  %i = select i1 %beyond, i64 %last, i64 %k
  {inside}
  %next = add i64 %k, {lanes}
  %more = icmp slt i64 %next, %count
  br i1 %more, label %loop, label %exit
exit:
  ret void
}}
"""
"""A program: a loop over vectors of points. Lines inside begin in the block `loop` and end in the block `ends`. The
last vector of points is moved back to end with the last point, and may repeat some: there are at least `lanes`."""


def _function(before: Sequence[str], inside: Sequence[str], lanes: int, last_block: str) -> str:
    """Write a function of its lines before the loop over points and inside of it, which end in the last block."""
    lines_before, lines_inside = ("\n  ".join(lines) for lines in (before, inside))
    return FUNCTION.format(
        declarations=_declarations(lanes),
        name=NAME,
        before=lines_before,
        inside=lines_inside,
        lanes=lanes,
        ends=last_block,
    )


def source(body: Body, lanes: int) -> str:
    """Write a body as LLVM assembly; lanes are the points of a vector."""
    numbers = type_of(Traced, lanes)
    before, inside = [], []
    for k, argument in enumerate(body.fixed):
        before.append(f"%fixed{k} = getelementptr double, ptr %fixed, i64 {k}")
        before.append(f"%v{argument.number} = load double, ptr %fixed{k}")
    for k, argument in enumerate(body.columns):
        before += _pointer("column", k)
        inside.append(f"%at.column{k} = getelementptr double, ptr %column{k}, i64 %i")
        inside.append(f"%v{argument.number} = load {numbers}, ptr %at.column{k}, align 8")
    nodes = needed_nodes([*body.results, body.code])
    for node in freeing_first(nodes):
        if node.fixed and node.operation != "input":
            before.append(_instruction(node, [name_of(operand, 1) for operand in node.operands], 1))
        elif node.operation != "input":
            inside.append(_instruction(node, [_vector(operand, lanes) for operand in node.operands], lanes))
    before += [line for node in nodes if node.fixed for line in _spread(node, lanes)]
    for k, result in enumerate(body.results):
        before += _pointer("row", k)
        inside.append(f"%at.row{k} = getelementptr double, ptr %row{k}, i64 %i")
        inside.append(f"store {numbers} {_vector(result, lanes)}, ptr %at.row{k}, align 8")
    inside.append(f"%code = fptosi {numbers} {_vector(body.code, lanes)} to <{lanes} x i8>")
    inside.append("%at.code = getelementptr i8, ptr %codes, i64 %i")
    inside.append(f"store <{lanes} x i8> %code, ptr %at.code, align 1")
    return _function(before, inside, lanes, "loop")


def freeing_first(nodes: Sequence[Node]) -> list[Node]:
    """Order nodes so that few values wait for their use: of those that can be next, what uses up most values.

    Among equals the order of tracing decides. Values that are computed before the loop count for nothing.

    Args:
        nodes: all that are needed, operands before what uses them.
    """
    before = [node for node in nodes if node.fixed or node.operation == "input"]
    return before + _Schedule([node for node in nodes if not node.fixed and node.operation != "input"]).order()


class _Schedule:
    """Operations inside the loop over points, which wait until their operands are there."""

    def __init__(self, operations: Sequence[Node]) -> None:
        self._operands = {
            node: {o for o in node.operands if isinstance(o, Node) and not o.fixed} for node in operations
        }
        self._users: dict[Node, list[Node]] = {}
        for node, operands in self._operands.items():
            for operand in operands:
                self._users.setdefault(operand, []).append(node)
        self._uses_left = {node: len(users) for node, users in self._users.items()}
        self._missing = {n: sum(o.operation != "input" for o in operands) for n, operands in self._operands.items()}
        self._ready: list[tuple[int, int, Node]] = []
        self._done: set[Node] = set()

    def order(self) -> list[Node]:
        """Return the operations in the order in which they are to be done."""
        for node, missing in self._missing.items():
            if not missing:
                self._enter(node)
        order = []
        while self._ready:
            _, _, node = heappop(self._ready)
            if node not in self._done:  # a node is entered again when it has come to use up more
                order.append(node)
                self._finish(node)
        return order

    def _enter(self, node: Node) -> None:
        """Let a node wait among those that can be next: first what uses up most values, then what was traced first."""
        used_up = sum(self._uses_left[operand] == 1 for operand in self._operands[node])
        heappush(self._ready, (-used_up, node.number, node))

    def _finish(self, node: Node) -> None:
        """Enter what can be next because of a node, and again what uses up more because of it."""
        self._done.add(node)
        for user in self._users.get(node, ()):
            self._missing[user] -= 1
            if not self._missing[user]:
                self._enter(user)
        for operand in self._operands[node]:
            self._uses_left[operand] -= 1
            if self._uses_left[operand] == 1:
                last = next(user for user in self._users[operand] if user not in self._done)
                if not self._missing[last]:
                    self._enter(last)


def _vector(operand: Operand, lanes: int) -> str:
    """Return the name of the vector that has a value in each lane."""
    return f"%s{operand.number}" if isinstance(operand, Node) and operand.fixed else name_of(operand, lanes)


def _spread(node: Node, lanes: int) -> list[str]:
    """Copy a fixed value to all lanes of a vector; LLVM drops the code for those that no vector needs."""
    number, many, name = type_of(type(node), 1), type_of(type(node), lanes), f"%s{node.number}"
    return [
        f"{name}.first = insertelement {many} poison, {number} %v{node.number}, i64 0",
        f"{name} = shufflevector {many} {name}.first, {many} poison, <{lanes} x i32> zeroinitializer",
    ]


def _pointer(name: str, k: int) -> list[str]:
    return [f"%at.{name}s{k} = getelementptr ptr, ptr %{name}s, i64 {k}", f"%{name}{k} = load ptr, ptr %at.{name}s{k}"]


ARITHMETIC = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
"""Operations that are instructions of LLVM on two numbers, and its names of them."""
FUSIBLE = "contract"
"""LLVM may fuse a product and a sum into one operation with one rounding; nothing else is relaxed (no fast-math)."""
FUNCTIONS = {"abs": "fabs", "sqrt": "sqrt"}
"""Operations that are functions of LLVM, and its names of them."""


def _instruction(node: Node, names: Sequence[str], lanes: int) -> str:
    """Write the instruction of a node on its operands (names or constants) for a vector of `lanes` points."""
    numbers, conditions = type_of(Traced, lanes), type_of(Condition, lanes)
    match node.operation:
        case "add" | "sub" | "mul" | "div":
            return f"%v{node.number} = {ARITHMETIC[node.operation]}{_fusing_flag(node)} {numbers} {', '.join(names)}"
        case "neg":
            return f"%v{node.number} = fneg {numbers} {names[0]}"
        case "steady":
            return f"%v{node.number} = bitcast {numbers} {names[0]} to {numbers}"
        case "abs" | "sqrt":
            return f"%v{node.number} = call {numbers} {_intrinsic(node.operation, lanes)}({numbers} {names[0]})"
        case "lt" | "le":
            return f"%v{node.number} = fcmp o{node.operation} {numbers} {', '.join(names)}"
        case "and":
            return f"%v{node.number} = and {conditions} {', '.join(names)}"
        case "where":
            choice = f"{conditions} {names[0]}, {numbers} {names[1]}, {numbers} {names[2]}"
            return f"%v{node.number} = select {choice}"
    raise ValueError(f"no instruction for {node.operation}")


def _fusing_flag(node: Node) -> str:
    """Return the flag that lets LLVM fuse an operation, except for a difference of two products.

    This difference must be exactly zero where the products are equal, so both must be rounded in the same way.
    """
    products = [isinstance(operand, Node) and operand.operation == "mul" for operand in node.operands]
    return "" if node.operation == "sub" and all(products) else f" {FUSIBLE}"


def name_of(operand: Operand, lanes: int) -> str:
    """Return the name of a node's value, or a constant for a vector of `lanes` points."""
    if isinstance(operand, Node):
        return f"%v{operand.number}"
    bits = f"0x{struct.unpack('<Q', struct.pack('<d', operand))[0]:016X}"
    return bits if lanes == 1 else f"<{', '.join([f'double {bits}'] * lanes)}>"


def type_of(kind: type[Node], lanes: int) -> str:
    """Return the type of a value for a vector of `lanes` points."""
    number = "i1" if issubclass(kind, Condition) else "double"
    return number if lanes == 1 else f"<{lanes} x {number}>"


def _intrinsic(operation: str, lanes: int) -> str:
    return f"@llvm.{FUNCTIONS[operation]}.{'f64' if lanes == 1 else f'v{lanes}f64'}"


def _declarations(lanes: int) -> str:
    """Declare the functions that the instructions call."""
    widths = [(operation, width) for operation in FUNCTIONS for width in sorted({1, lanes})]
    return "\n".join(
        f"declare {type_of(Traced, width)} {_intrinsic(operation, width)}({type_of(Traced, width)})"
        for operation, width in widths
    )


Value = str
"""The name of a value in LLVM assembly, or a constant."""


class LoopCode:
    """Lines of LLVM assembly that are written one by one: operations on vectors of points, and loops that carry values.

    Entries of the workspace are vectors as well; it lies where other programs have their fixed inputs.
    """

    def __init__(self, lanes: int) -> None:
        self._lines: list[str] = []
        self._block = "loop"  # label of the block that the next line belongs to
        self._lanes, self._names = lanes, 0
        self._numbers, self._integers = type_of(Traced, lanes), f"<{lanes} x i64>"

    def _new_name(self) -> Value:
        self._names += 1
        return f"%t{self._names}"

    def _assign(self, instruction: str) -> Value:
        """Append an instruction that gives a value, and return the name of the value."""
        name = self._new_name()
        self._lines.append(f"{name} = {instruction}")
        return name

    def number(self, value: float) -> Value:
        """The vector of a number."""
        return name_of(value, self._lanes)

    def add(self, a: Value, b: Value) -> Value:
        return self._assign(f"fadd {FUSIBLE} {self._numbers} {a}, {b}")

    def sub(self, a: Value, b: Value) -> Value:
        """The difference a - b."""
        return self._assign(f"fsub {FUSIBLE} {self._numbers} {a}, {b}")

    def mul(self, a: Value, b: Value) -> Value:
        return self._assign(f"fmul {FUSIBLE} {self._numbers} {a}, {b}")

    def div(self, a: Value, b: Value) -> Value:
        return self._assign(f"fdiv {self._numbers} {a}, {b}")

    def call(self, function: str, argument: Value) -> Value:
        """Call one of `FUNCTIONS`."""
        return self._assign(f"call {self._numbers} {_intrinsic(function, self._lanes)}({self._numbers} {argument})")

    def is_less(self, a: Value, b: Value) -> Value:
        """Whether a < b, in each lane; not where one of them is NaN."""
        return self._assign(f"fcmp olt {self._numbers} {a}, {b}")

    def where(self, condition: Value, a: Value, b: Value) -> Value:
        numbers = self._numbers
        return self._assign(f"select <{self._lanes} x i1> {condition}, {numbers} {a}, {numbers} {b}")

    def integer(self, number: int) -> Value:
        """The vector of an integer."""
        return f"<{', '.join([f'i64 {number}'] * self._lanes)}>"

    def append_sign(self, signs: Value, value: Value) -> Value:
        """Append the sign of a number to a row of signs: bits, of which the last one came last."""
        bits = self._assign(f"bitcast {self._numbers} {value} to {self._integers}")
        arguments = ", ".join(f"{self._integers} {argument}" for argument in (signs, bits, self.integer(1)))
        return self._assign(f"call {self._integers} @llvm.fshl.v{self._lanes}i64({arguments})")

    def count_sign_changes(self, signs: Value, count: int) -> Value:
        """Count the changes in a row of signs, from each of the last `count` ones to the one before it."""
        integers = self._integers
        earlier = self._assign(f"lshr {integers} {signs}, {self.integer(1)}")
        differ = self._assign(f"xor {integers} {signs}, {earlier}")
        last_ones = self._assign(f"and {integers} {differ}, {self.integer((1 << count) - 1)}")
        number = self._assign(f"call {integers} @llvm.ctpop.v{self._lanes}i64({integers} {last_ones})")
        return self._assign(f"uitofp {integers} {number} to {self._numbers}")

    def index(self, operation: str, a: Value | int, b: Value | int) -> Value:
        """An integer: "add", "sub", "mul" or "sdiv" of two."""
        return self._assign(f"{operation} i64 {a}, {b}")

    def _address(self, start: int, indices: Sequence[Value | int]) -> Value:
        """The address of an entry of the workspace."""
        entry = indices[0]
        for index in (*indices[1:], start):
            entry = self.index("add", entry, index)
        return self._assign(f"getelementptr {self._numbers}, ptr %fixed, i64 {entry}")

    def load(self, start: int, *indices: Value | int) -> Value:
        """The entry of the workspace at a start to which one index or several are added."""
        return self._assign(f"load {self._numbers}, ptr {self._address(start, indices)}, align 64")

    def store(self, value: Value, start: int, *indices: Value | int) -> None:
        """Write an entry of the workspace, see `load`."""
        self._lines.append(f"store {self._numbers} {value}, ptr {self._address(start, indices)}, align 64")

    def load_column(self, number: Value | int) -> Value:
        """The values of a column of the program at the points of the vector."""
        return self._assign(f"load {self._numbers}, ptr {self._row_address('columns', number)}, align 8")

    def store_result(self, value: Value, number: int) -> None:
        """Write a row of the results at the points of the vector."""
        self._lines.append(f"store {self._numbers} {value}, ptr {self._row_address('rows', number)}, align 8")

    def _row_address(self, rows: str, number: Value | int) -> Value:
        """The address of the points of the vector in a row of an argument of the program."""
        row = self._assign(f"load ptr, ptr {self._assign(f'getelementptr ptr, ptr %{rows}, i64 {number}')}")
        return self._assign(f"getelementptr double, ptr {row}, i64 %i")

    def source(self) -> str:
        """The program of these lines."""
        return _function((), self._lines, self._lanes, self._block)

    @contextmanager
    def loop(
        self, first: Value | int, end: Value | int, carried: Sequence[Value] = (), step: int = 1
    ) -> Iterator["Loop"]:
        """Repeat the lines of the body for integers from the first up to the end, which is left out.

        Args:
            first, end, step: integers.
            carried: vectors with which the first turn begins, see `Loop`.
        """
        before, name = self._block, self._new_name()
        head, body, done = (f"{part}{name[1:]}" for part in ("head", "body", "done"))
        names = [f"{name}.v{k}" for k in range(len(carried))]
        loop = Loop(f"{name}.i", names, names)
        self._lines += [f"br label %{head}", f"{head}:"]
        place_of_phis = len(self._lines)
        self._lines += ["", f"{name}.more = icmp slt i64 {name}.i, {end}"]
        self._lines += [f"br i1 {name}.more, label %{body}, label %{done}", f"{body}:"]
        self._block = body
        yield loop
        self._lines += [f"{name}.next = add i64 {name}.i, {step}", f"br label %{head}", f"{done}:"]
        phis = [f"{name}.i = phi i64 [{first}, %{before}], [{name}.next, %{self._block}]"]
        for value, start, after in zip(names, carried, loop.after, strict=True):
            phis.append(f"{value} = phi {self._numbers} [{start}, %{before}], [{after}, %{self._block}]")
        self._lines[place_of_phis] = "\n  ".join(phis)
        self._block = done


@dataclass
class Loop:
    """The names of a loop.

    Attributes:
        index: its integer.
        values: the vectors that it carries: inside, those before the turn; behind the loop, its results.
        after: the vectors after a turn, which the body sets; those before it if it does not.
    """

    index: Value
    values: list[Value]
    after: list[Value]
