"""Compiles a traced graph to machine code: one loop of SIMD vectors over points, by LLVM in memory. Knows no machine.

Values that depend on fixed inputs alone are computed before the loop. No optimisation passes are run: the graph has no
repetitions, and on the 4-dof machine (1300 operations) passes gained nothing over the code generator alone, which takes
50 ms. Operations that free registers come first: compared with the order of tracing, fewer values wait in memory.
"""

import struct
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache
from heapq import heapify, heappop, heappush
from typing import Any

import llvmlite.binding as llvm  # type: ignore[import-untyped]

from kinetostat.engine.trace import Body, Condition, Node, Operand, Traced, needed_nodes


def object_file_of(assembly: str) -> bytes:
    """Compile LLVM assembly for this processor; that of a body takes 0.05 to 0.5 s."""
    module = llvm.parse_assembly(assembly)
    module.verify()
    return _target_maker()().emit_object(module)


def load_object(object_file: bytes) -> tuple[int, Any]:
    """Load an object file; gives the address of its function, and what keeps it in memory."""
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_maker()())
    engine.add_object_file(llvm.ObjectFileRef.from_data(object_file))
    engine.finalize_object()
    return engine.get_function_address(NAME), engine


@cache
def _target_maker() -> Callable[[], Any]:
    """Return a function that makes target machines for this processor."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_default_triple()
    cpu, features = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
    return lambda: target.create_target_machine(cpu=cpu, features=features, opt=3, reloc="pic", codemodel="small")


@cache
def host_lanes() -> int:
    """Return how many float64 fit into one register of this processor."""
    features = llvm.get_host_cpu_features()
    if features.get("avx512f"):
        return 8
    return 4 if features.get("avx") else 2


def host_description() -> str:
    """Return what this processor is called and can do, as LLVM says it."""
    return f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"


VECTOR_SETS = ("sse2", "avx", "avx2", "fma", "avx512f", "neon", "sve")
"""Instruction sets that decide how fast the code is, as LLVM calls them."""


def host_features() -> tuple[str, ...]:
    """Return which of `VECTOR_SETS` this processor has."""
    features = llvm.get_host_cpu_features()
    return tuple(name for name in VECTOR_SETS if features.get(name))


NAME = "kernel"
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
"""Lines inside begin in the block `loop` and end in the block `ends`. The last vector of points is moved back to end
with the last point, and so may repeat some: %count >= lanes."""


def source(body: Body, lanes: int) -> str:
    """Write a body as LLVM assembly; lanes are the points of a vector."""
    numbers = type_of(Traced, lanes)
    before, inside = [], []
    for k, given in enumerate(body.fixed):
        before.append(f"%fixed{k} = getelementptr double, ptr %fixed, i64 {k}")
        before.append(f"%v{given.number} = load double, ptr %fixed{k}")
    for k, given in enumerate(body.columns):
        before += _pointer("column", k)
        inside.append(f"%at.column{k} = getelementptr double, ptr %column{k}, i64 %i")
        inside.append(f"%v{given.number} = load {numbers}, ptr %at.column{k}, align 8")
    used = freeing_first(needed_nodes([*body.results, body.code]))
    for node in used:
        if node.fixed and node.operation != "input":
            before.append(line(node, [name_of(operand, 1) for operand in node.operands], 1))
        elif node.operation != "input":
            inside.append(line(node, [_vector(operand, lanes) for operand in node.operands], lanes))
    before += [text for node in used if node.fixed for text in _spread(node, lanes)]
    for k, result in enumerate(body.results):
        before += _pointer("row", k)
        inside.append(f"%at.row{k} = getelementptr double, ptr %row{k}, i64 %i")
        inside.append(f"store {numbers} {_vector(result, lanes)}, ptr %at.row{k}, align 8")
    inside.append(f"%code = fptosi {numbers} {_vector(body.code, lanes)} to <{lanes} x i8>")
    inside.append("%at.code = getelementptr i8, ptr %codes, i64 %i")
    inside.append(f"store <{lanes} x i8> %code, ptr %at.code, align 1")
    texts = {"before": "\n  ".join(before), "inside": "\n  ".join(inside)}
    return FUNCTION.format(declarations=declarations(lanes), name=NAME, lanes=lanes, ends="loop", **texts)


def freeing_first(nodes: Sequence[Node]) -> list[Node]:
    """Order nodes so that few values wait for their use: of those that can be next, what uses up most values.

    Among equals the order of tracing decides. Values that are computed before the loop count for nothing.

    Args:
        nodes: all that are needed, operands before what uses them.
    """
    inside = [node for node in nodes if not node.fixed and node.operation != "input"]
    operands = {node: {o for o in node.operands if isinstance(o, Node) and not o.fixed} for node in inside}
    users: dict[Node, list[Node]] = {node: [] for node in nodes}
    for node in inside:
        for operand in operands[node]:
            users[operand].append(node)
    uses = {node: len(users[node]) for node in nodes}
    missing = {node: sum(o.operation != "input" for o in operands[node]) for node in inside}
    done: set[Node] = set()
    waiting = [(-_used_up(operands[node], uses), node.number, node) for node in inside if not missing[node]]
    heapify(waiting)
    order = [node for node in nodes if node.fixed or node.operation == "input"]
    while waiting:
        _, _, node = heappop(waiting)
        if node in done:  # it has come to use up more since it was entered, and was entered again
            continue
        done.add(node)
        order.append(node)
        for user in users[node]:
            missing[user] -= 1
            if not missing[user]:
                heappush(waiting, (-_used_up(operands[user], uses), user.number, user))
        for operand in operands[node]:
            uses[operand] -= 1
            if uses[operand] == 1:
                last = next(user for user in users[operand] if user not in done)
                if not missing[last]:
                    heappush(waiting, (-_used_up(operands[last], uses), last.number, last))
    return order


def _used_up(operands: Collection[Node], uses: Mapping[Node, int]) -> int:
    """Count the operands that have no further use."""
    return sum(uses[operand] == 1 for operand in operands)


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
FUSIBLE = "contract"
"""LLVM may fuse a product and a sum into one operation with one rounding; nothing else is relaxed (no fast-math)."""
FUNCTIONS = {"abs": "fabs", "sqrt": "sqrt"}


def line(node: Node, names: Sequence[str], lanes: int) -> str:
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


def declarations(lanes: int) -> str:
    """Declare the functions that the instructions call."""
    widths = [(operation, width) for operation in FUNCTIONS for width in sorted({1, lanes})]
    return "\n".join(
        f"declare {type_of(Traced, width)} {_intrinsic(operation, width)}({type_of(Traced, width)})"
        for operation, width in widths
    )
