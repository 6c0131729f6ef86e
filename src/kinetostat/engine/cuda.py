"""A traced graph as a program for an NVIDIA GPU: one thread per point, PTX by LLVM, run by the CUDA driver.

What depends on fixed inputs alone is computed here, once for all threads. Nothing but the driver is needed.
"""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any, Protocol

import llvmlite.binding as llvm  # type: ignore[import-untyped]
import numpy as np
import numpy.typing as npt

from kinetostat.engine.body import Array, Body, Codes
from kinetostat.engine.interpreter import Interpreted
from kinetostat.engine.llvm_text import declarations, line, name_of
from kinetostat.engine.trace import Condition, Node, needed

NAME = "kernel"
TARGET, FEATURES = "sm_70", "+ptx70"
"""The oldest processor with full support here; the driver compiles PTX for the one at hand, whatever is newer."""
BLOCK = 128
"""Threads per block: with hundreds of values in flight per thread, more would not fit the registers."""
KERNEL = """
target triple = "nvptx64-nvidia-cuda"
declare i32 @llvm.nvvm.read.ptx.sreg.tid.x()
declare i32 @llvm.nvvm.read.ptx.sreg.ctaid.x()
declare i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
{declarations}
define ptx_kernel void @{name}(ptr noalias %fixed, ptr noalias %columns, ptr noalias %rows, ptr noalias %codes,
                               i64 %count) {{
entry:
  %thread = call i32 @llvm.nvvm.read.ptx.sreg.tid.x()
  %block = call i32 @llvm.nvvm.read.ptx.sreg.ctaid.x()
  %threads = call i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
  %thread.wide = zext i32 %thread to i64
  %block.wide = zext i32 %block to i64
  %threads.wide = zext i32 %threads to i64
  %first = mul i64 %block.wide, %threads.wide
  %i = add i64 %first, %thread.wide
  %within = icmp slt i64 %i, %count
  br i1 %within, label %point, label %exit
point:
  {inside}
  br label %exit
exit:
  ret void
}}
"""


class Device(Protocol):
    """A GPU with memory of its own; `cuda_driver.Gpu` is one."""

    def load(self, ptx: str, name: str) -> Any:
        """A kernel, ready to be launched."""

    def put(self, arrays: Sequence[npt.NDArray[Any]]) -> Any:
        """Copy contiguous arrays to the device, one behind the other; where they lie."""

    def room(self, size: int) -> Any:
        """Room for so many bytes on the device."""

    def launch(self, kernel: Any, block: int, pointers: Sequence[Any], count: int) -> None:
        """Run a kernel over so many points and wait for its end."""

    def take(self, place: Any, arrays: Sequence[npt.NDArray[Any]]) -> None:
        """Copy what lies at a place back into contiguous arrays."""

    def free(self, places: Sequence[Any]) -> None:
        """Give rooms back."""


class GpuProgram:
    """A body compiled for a device."""

    def __init__(self, body: Body, device: Device) -> None:
        self._device = device
        self._shared = shared_nodes(body)
        self._host = Interpreted(Body(body.fixed, [], self._shared, 0.0), ())
        self._kernel = device.load(ptx(source(body)), NAME)

    def run(self, fixed: Array, columns: Sequence[Array], results: Array, codes: Codes) -> None:
        """Evaluate points, see `body.Runnable`."""
        if not len(codes):
            return
        with self._placed(fixed, columns, len(results), len(codes)) as places:
            self._device.launch(self._kernel, BLOCK, places, len(codes))
            self._device.take(places[2], list(results))
            self._device.take(places[3], [codes])

    def seconds(self, fixed: Array, columns: Sequence[Array], rows: int, turns: int) -> float:
        """The shortest of some launches over points that lie on the device, results staying there, s."""
        count, taken = len(columns[0]), []
        with self._placed(fixed, columns, rows, count) as places:
            for _ in range(turns):
                started = time.perf_counter()
                self._device.launch(self._kernel, BLOCK, places, count)
                taken.append(time.perf_counter() - started)
        return min(taken)

    @contextmanager
    def _placed(self, fixed: Array, columns: Sequence[Array], rows: int, count: int) -> Iterator[list[Any]]:
        """Places on the device: shared numbers, columns, room for results and for codes."""
        shared = np.empty((len(self._shared), 1))
        self._host.run(fixed, [], shared, np.empty(1, dtype=np.int8))
        places: list[Any] = []
        try:
            places += [self._device.put([shared])]
            places += [self._device.put(columns)]
            places += [self._device.room(8 * rows * count)]
            places += [self._device.room(count)]
            yield places
        finally:
            self._device.free(places)


def shared_nodes(body: Body) -> list[Node]:
    """Fixed nodes that threads need: operands of what varies, and fixed results."""
    used = needed([*body.results, body.code])
    wanted = [operand for node in used if not node.fixed for operand in node.operands] + [*body.results, body.code]
    return sorted({one for one in wanted if isinstance(one, Node) and one.fixed}, key=lambda node: node.number)


def source(body: Body) -> str:
    """A body as LLVM assembly; columns, and rows of results, lie one behind the other."""
    inside = []
    for k, node in enumerate(shared_nodes(body)):
        name, at = (f"v{node.number}", f"fixed{k}")
        inside.append(f"%{at} = getelementptr double, ptr %fixed, i64 {k}")
        if isinstance(node, Condition):
            inside += [f"%{name}.number = load double, ptr %{at}", f"%{name} = fcmp une double %{name}.number, 0.0"]
        else:
            inside.append(f"%{name} = load double, ptr %{at}")
    for k, given in enumerate(body.columns):
        inside += _place("column", k)
        inside.append(f"%v{given.number} = load double, ptr %at.column{k}")
    for node in needed([*body.results, body.code]):
        if not node.fixed and node.operation != "input":
            inside.append(line(node, [name_of(operand, 1) for operand in node.operands], 1))
    for k, result in enumerate(body.results):
        inside += _place("row", k)
        inside.append(f"store double {name_of(result, 1)}, ptr %at.row{k}")
    inside.append(f"%code = fptosi double {name_of(body.code, 1)} to i8")
    inside.append("%at.code = getelementptr i8, ptr %codes, i64 %i")
    inside.append("store i8 %code, ptr %at.code")
    return KERNEL.format(declarations=declarations(1), name=NAME, inside="\n  ".join(inside))


def _place(name: str, k: int) -> list[str]:
    return [
        f"%{name}{k}.first = mul i64 %count, {k}",
        f"%{name}{k} = add i64 %{name}{k}.first, %i",
        f"%at.{name}{k} = getelementptr double, ptr %{name}s, i64 %{name}{k}",
    ]


def ptx(text: str) -> str:
    """LLVM assembly as PTX."""
    module = llvm.parse_assembly(text)
    module.verify()
    return _target().create_target_machine(cpu=TARGET, features=FEATURES, opt=3).emit_assembly(module)


@cache
def _target() -> Any:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    return llvm.Target.from_triple("nvptx64-nvidia-cuda")
