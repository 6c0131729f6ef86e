"""A traced graph as lines of LLVM assembly, for one point or a vector of points. Compiles nothing."""

import struct
from collections.abc import Sequence

from kinetostat.engine.trace import Condition, Node, Operand, Traced

ARITHMETIC = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
FUSIBLE = "contract"
"""LLVM may fuse a product and a sum into one operation with one rounding; nothing else is relaxed (no fast-math)."""
FUNCTIONS = {"abs": "fabs", "sqrt": "sqrt"}


def line(node: Node, names: Sequence[str], lanes: int) -> str:
    """The instruction of a node on its operands, by their names or constants, as vectors of so many points."""
    numbers, conditions = type_of(Traced, lanes), type_of(Condition, lanes)
    match node.operation:
        case "add" | "sub" | "mul" | "div":
            return f"%v{node.number} = {ARITHMETIC[node.operation]}{_relaxed(node)} {numbers} {', '.join(names)}"
        case "neg":
            return f"%v{node.number} = fneg {numbers} {names[0]}"
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


def _relaxed(node: Node) -> str:
    """Nothing for a difference of two products, which would not vanish where both are equal if one were not rounded."""
    products = [isinstance(operand, Node) and operand.operation == "mul" for operand in node.operands]
    return "" if node.operation == "sub" and all(products) else f" {FUSIBLE}"


def name_of(operand: Operand, lanes: int) -> str:
    """The name of a node's value, or a constant as a vector of so many points."""
    if isinstance(operand, Node):
        return f"%v{operand.number}"
    bits = f"0x{struct.unpack('<Q', struct.pack('<d', operand))[0]:016X}"
    return bits if lanes == 1 else f"<{', '.join([f'double {bits}'] * lanes)}>"


def type_of(kind: type[Node], lanes: int) -> str:
    """The type of a value as a vector of so many points."""
    one = "i1" if issubclass(kind, Condition) else "double"
    return one if lanes == 1 else f"<{lanes} x {one}>"


def _intrinsic(operation: str, lanes: int) -> str:
    return f"@llvm.{FUNCTIONS[operation]}.{'f64' if lanes == 1 else f'v{lanes}f64'}"


def declarations(lanes: int) -> str:
    """What the instructions call."""
    widths = [(operation, width) for operation in FUNCTIONS for width in sorted({1, lanes})]
    return "\n".join(
        f"declare {type_of(Traced, width)} {_intrinsic(operation, width)}({type_of(Traced, width)})"
        for operation, width in widths
    )
