"""LLVM assembly of loops in a program: operations on vectors of points, and loops that carry them. Knows no formula.

Straight code is written by `native`; here are the words of programs that go through rows of matrices.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from kinetostat.engine.trace import Traced
from kinetostat.late import LateModule

if TYPE_CHECKING:
    from kinetostat.engine import native
else:  # LLVM takes 0.1 s to load, and is not needed for a program that is on disk
    native = LateModule("kinetostat.engine.native")

Value = str
"""The name of a value in LLVM assembly, or a constant."""


class LoopCode:
    """Lines of LLVM assembly: operations on vectors, and loops that carry values.

    Attributes:
        lines: so far.
        block: label of the block that the next line belongs to.
    """

    def __init__(self, lanes: int) -> None:
        self.lines: list[str] = []
        self.block = "loop"
        self._lanes, self._names = lanes, 0
        self.numbers, self._integers = native.type_of(Traced, lanes), f"<{lanes} x i64>"

    def name(self) -> Value:
        """A new name."""
        self._names += 1
        return f"%t{self._names}"

    def do(self, text: str) -> Value:
        """Append an instruction that gives a value."""
        name = self.name()
        self.lines.append(f"{name} = {text}")
        return name

    def number(self, value: float) -> Value:
        """The vector of a number."""
        return native.name_of(value, self._lanes)

    def add(self, a: Value, b: Value) -> Value:
        return self.do(f"fadd contract {self.numbers} {a}, {b}")

    def sub(self, a: Value, b: Value) -> Value:
        """The difference a - b."""
        return self.do(f"fsub contract {self.numbers} {a}, {b}")

    def mul(self, a: Value, b: Value) -> Value:
        return self.do(f"fmul contract {self.numbers} {a}, {b}")

    def div(self, a: Value, b: Value) -> Value:
        return self.do(f"fdiv {self.numbers} {a}, {b}")

    def call(self, function: str, *given: Value) -> Value:
        """Call a function of vectors, such as sqrt."""
        listed = ", ".join(f"{self.numbers} {value}" for value in given)
        return self.do(f"call {self.numbers} @llvm.{function}.v{self._lanes}f64({listed})")

    def is_less(self, a: Value, b: Value) -> Value:
        """Whether a < b, in each lane."""
        return self.do(f"fcmp olt {self.numbers} {a}, {b}")

    def where(self, condition: Value, a: Value, b: Value) -> Value:
        return self.do(f"select <{self._lanes} x i1> {condition}, {self.numbers} {a}, {self.numbers} {b}")

    def bits(self, number: int) -> Value:
        """The vector of an integer."""
        return f"<{', '.join([f'i64 {number}'] * self._lanes)}>"

    def sign_after(self, signs: Value, value: Value) -> Value:
        """Move the sign of a number into a row of signs: bits, of which the last one came last."""
        moved = self.do(f"bitcast {self.numbers} {value} to {self._integers}")
        listed = f"{self._integers} {signs}, {self._integers} {moved}, {self._integers} {self.bits(1)}"
        return self.do(f"call {self._integers} @llvm.fshl.v{self._lanes}i64({listed})")

    def changes(self, signs: Value, count: int) -> Value:
        """The number of changes in a row of signs, from each of the last ones to the one before it."""
        before = self.do(f"lshr {self._integers} {signs}, {self.bits(1)}")
        differ = self.do(f"xor {self._integers} {signs}, {before}")
        shown = self.do(f"and {self._integers} {differ}, {self.bits((1 << count) - 1)}")
        number = self.do(f"call {self._integers} @llvm.ctpop.v{self._lanes}i64({self._integers} {shown})")
        return self.do(f"uitofp {self._integers} {number} to {self.numbers}")

    def index(self, operation: str, a: Value | int, b: Value | int) -> Value:
        """An integer: add, sub, mul or sdiv of two."""
        return self.do(f"{operation} i64 {a}, {b}")

    def place(self, start: int, index: Value | int) -> Value:
        """The address of an entry of the workspace."""
        at = self.index("add", start, index)
        return self.do(f"getelementptr {self.numbers}, ptr %fixed, i64 {at}")

    def load(self, start: int, index: Value | int) -> Value:
        return self.do(f"load {self.numbers}, ptr {self.place(start, index)}, align 64")

    def store(self, value: Value, start: int, index: Value | int) -> None:
        self.lines.append(f"store {self.numbers} {value}, ptr {self.place(start, index)}, align 64")

    def column(self, number: Value | int) -> Value:
        """The values of a column of the program at the points of the vector."""
        pointer = self.do(f"getelementptr ptr, ptr %columns, i64 {number}")
        column = self.do(f"load ptr, ptr {pointer}")
        at = self.do(f"getelementptr double, ptr {column}, i64 %i")
        return self.do(f"load {self.numbers}, ptr {at}, align 8")

    def give(self, value: Value, row: int) -> None:
        """Write a result at the points of the vector."""
        pointer = self.do(f"getelementptr ptr, ptr %rows, i64 {row}")
        result = self.do(f"load ptr, ptr {pointer}")
        at = self.do(f"getelementptr double, ptr {result}, i64 %i")
        self.lines.append(f"store {self.numbers} {value}, ptr {at}, align 8")

    def source(self) -> str:
        """The program of these lines."""
        texts = {"declarations": native.declarations(self._lanes), "before": "", "inside": "\n  ".join(self.lines)}
        return native.FUNCTION.format(name=native.NAME, lanes=self._lanes, ends=self.block, **texts)

    @contextmanager
    def loop(
        self, first: Value | int, end: Value | int, carried: Sequence[Value] = (), step: int = 1
    ) -> Iterator["Loop"]:
        """Repeat the lines of the body for integers from the first up to the end, which is left out.

        Args:
            first, end, step: integers.
            carried: vectors that the body replaces: its `values` are those before a turn, `after` those after it.
        """
        before, name = self.block, self.name()
        head, body, done = (f"{part}{name[1:]}" for part in ("head", "body", "done"))
        names = [f"{name}.v{k}" for k in range(len(carried))]
        loop = Loop(f"{name}.i", names, names)
        self.lines += [f"br label %{head}", f"{head}:"]
        at = len(self.lines)
        self.lines += ["", f"{name}.more = icmp slt i64 {name}.i, {end}"]
        self.lines += [f"br i1 {name}.more, label %{body}, label %{done}", f"{body}:"]
        self.block = body
        yield loop
        self.lines += [f"{name}.next = add i64 {name}.i, {step}", f"br label %{head}", f"{done}:"]
        phis = [f"{name}.i = phi i64 [{first}, %{before}], [{name}.next, %{self.block}]"]
        for value, start, after in zip(names, carried, loop.after, strict=True):
            phis.append(f"{value} = phi {self.numbers} [{start}, %{before}], [{after}, %{self.block}]")
        self.lines[at] = "\n  ".join(phis)
        self.block = done


class Loop:
    """A loop: its integer, the vectors that it carries at the head, which are its results behind it, and the next."""

    def __init__(self, index: Value, values: list[Value], after: list[Value]) -> None:
        self.index, self.values, self.after = index, values, after
