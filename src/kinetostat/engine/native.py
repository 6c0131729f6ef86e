"""A machine's formulas as machine code: traced once, compiled by LLVM, run over a slab of points. Holds no formula.

The whole pose is one loop body of SIMD vectors. What depends on fixed parameters alone is computed before the loop, and
fixed parameters that are exactly 0 or infinite are part of the code: what they multiply is not computed at all.
Measured: on this body LLVM's optimisation passes gain nothing over its code generator alone, and tracing order
beats an order by depth.
"""

import ctypes
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from threading import Lock
from typing import Any

import llvmlite.binding as llvm  # type: ignore[import-untyped]
import numpy as np
import numpy.typing as npt

from kinetostat.algebra.scalar import where
from kinetostat.engine.points import Array
from kinetostat.engine.trace import LARGEST_ANGLE, Graph, Node, Traced, needed
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values

ORDINARY = (1e-100, 1e100)
"""Sizes between which a number and its reciprocal are neither zero nor infinite, by a wide margin."""
KEPT = 64
"""Compiled programs kept in memory; each is some 20 kB."""

Codes = npt.NDArray[np.int8]


@dataclass(frozen=True)
class Kernel:
    """The program for slabs of points of one machine, with its fixed parameters filled in.

    Attributes:
        program: the compiled code.
        fixed: values of its fixed inputs, SI.
        varying: leaf paths of its columns, in order.
        angles: those of them that are angles.
    """

    program: "Program"
    fixed: Array
    varying: tuple[str, ...]
    angles: frozenset[str]

    def run(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Evaluate a slab of points; other threads run meanwhile.

        Args:
            columns: values of the varying parameters by leaf path, SI [points].
            results: where the quantities go, a row each [quantities x points]: NaN where the status is not OK. Rows
                may lie apart, the points of a row may not.
            status: where the status codes go [points].
        """
        served = [_within_reduction(columns[p]) if p in self.angles else columns[p] for p in self.varying]
        self.program.run(self.fixed, [np.ascontiguousarray(column, dtype=float) for column in served], results, status)


def slab_kernel(machine: Machine, varying: Sequence[str], quantities: Sequence[str]) -> Kernel:
    """The program for slabs of points of a machine, compiled (about 0.1 s) unless one of the same form has been.

    Args:
        machine: its family and all parameters that do not vary.
        varying: leaf paths of the parameters that vary.
        quantities: names from `QUANTITIES`.
    """
    angles = frozenset(p.path for p in parameters(machine.family) if p.quantity.kind == "angle")
    fixed = {path: value for path, value in values(machine).items() if path not in varying}
    fixed.update({path: float(_within_reduction(np.array(fixed[path]))) for path in angles & fixed.keys()})
    constant = {path: value for path, value in fixed.items() if value == 0.0 or math.isinf(value)}
    inputs = {path: value for path, value in fixed.items() if path not in constant}
    ordinary = frozenset(path for path, value in inputs.items() if ORDINARY[0] < abs(value) < ORDINARY[1])
    form = (tuple(constant.items()), tuple(inputs), ordinary, tuple(varying), tuple(quantities))
    program = _program(_Family(machine), *form)
    return Kernel(program, np.array(list(inputs.values()), dtype=float), tuple(varying), angles)


def _within_reduction(angle: Array) -> Array:
    """The angles (rad), turned back to -pi to pi if any is beyond what traced cosines take."""
    if angle.max() <= LARGEST_ANGLE and angle.min() >= -LARGEST_ANGLE:
        return angle
    return np.arctan2(np.sin(angle), np.cos(angle))


@dataclass(frozen=True)
class _Family:
    """A machine that stands for its family: equal to any other of it."""

    machine: Machine

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Family) and self.machine.family == other.machine.family

    def __hash__(self) -> int:
        return hash(self.machine.family)


@lru_cache(KEPT)
def _program(
    family: _Family,
    constant: tuple[tuple[str, float], ...],
    inputs: tuple[str, ...],
    ordinary: frozenset[str],
    varying: tuple[str, ...],
    quantities: tuple[str, ...],
) -> "Program":
    graph = Graph()
    fixed = {path: graph.input(fixed=True, ordinary=path in ordinary) for path in inputs}
    columns = {path: graph.input() for path in varying}
    with np.errstate(all="ignore"):
        response = respond(with_values(family.machine, {**dict(constant), **fixed, **columns}))
        accepted = abs(response.status - float(Status.OK)) < 0.5
        results = [where(accepted, QUANTITIES[name].value(response), math.nan) for name in quantities]
    return Program(Body(tuple(fixed.values()), tuple(columns.values()), tuple(results), response.status))


@dataclass(frozen=True)
class Body:
    """What is computed at each point.

    Attributes:
        fixed: inputs that are the same at all points.
        columns: inputs that vary.
        results: nodes, or numbers where a result depends on nothing.
        status: node or number that gives the status code.
    """

    fixed: tuple[Traced, ...]
    columns: tuple[Traced, ...]
    results: tuple[Any, ...]
    status: Any


class Program:
    """Machine code for a body; keeps the memory it lives in."""

    def __init__(self, body: Body) -> None:
        target = _target()
        self.lanes = _lanes()
        with _COMPILING:
            module = llvm.parse_assembly(source(body, self.lanes))
            module.verify()
            self._engine = llvm.create_mcjit_compiler(module, target())
            self._engine.finalize_object()
        address = self._engine.get_function_address(NAME)
        signature = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 4, ctypes.c_int64)
        self._call = signature(address)  # a foreign function call lets other threads run

    def run(self, fixed: Array, columns: Sequence[Array], results: Array, status: Codes) -> None:
        """Evaluate all points of the columns, each contiguous; see `Kernel.run`."""
        count = len(status)
        if count < self.lanes:
            self._run_few(fixed, columns, results, status)
            return
        if results.strides[-1] != results.itemsize or status.strides[0] != status.itemsize:
            raise ValueError("the points of a row of results must be contiguous")
        starts = np.array([column.ctypes.data for column in columns], dtype=np.uintp)
        ends = np.uintp(results.ctypes.data) + np.arange(len(results), dtype=np.uintp) * np.uintp(results.strides[0])
        self._call(fixed.ctypes.data, starts.ctypes.data, ends.ctypes.data, status.ctypes.data, count)

    def _run_few(self, fixed: Array, columns: Sequence[Array], results: Array, status: Codes) -> None:
        """Fewer points than lanes: repeat the last one."""
        count = len(status)
        if count == 0:
            return
        longer = [np.pad(column, (0, self.lanes - count), mode="edge") for column in columns]
        found, codes = np.empty((len(results), self.lanes)), np.empty(self.lanes, dtype=np.int8)
        self.run(fixed, longer, found, codes)
        results[:], status[:] = found[:, :count], codes[:count]


NAME = "kernel"
_COMPILING = Lock()


@cache
def _target() -> Callable[[], Any]:
    """A maker of target machines for the processor at hand."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features = llvm.get_host_cpu_features().flatten()
    host = llvm.Target.from_default_triple()
    return lambda: host.create_target_machine(cpu=llvm.get_host_cpu_name(), features=features, opt=3)


def _lanes() -> int:
    """How many float64 fit one register of the processor at hand."""
    features = llvm.get_host_cpu_features()
    if features.get("avx512f"):
        return 8
    return 4 if features.get("avx") else 2


def source(body: Body, lanes: int) -> str:
    """A body as LLVM assembly: void kernel(fixed values, columns, rows, status codes, number of points >= lanes)."""
    before, inside = _Block(1), _Block(lanes)
    for k, node in enumerate(body.fixed):
        before.add(
            f"%fixed{k} = getelementptr double, ptr %fixed, i64 {k}", f"%v{node.number} = load double, ptr %fixed{k}"
        )
    for k, node in enumerate(body.columns):
        before.add(*_pointer("column", k))
        inside.add(f"%at.column{k} = getelementptr double, ptr %column{k}, i64 %i")
        inside.add(f"%v{node.number} = load {inside.number}, ptr %at.column{k}, align 8")
    spread: set[Node] = set()
    for node in sorted(needed([*body.results, body.status]), key=lambda node: node.number):
        if node.fixed:
            ...
    raise NotImplementedError
