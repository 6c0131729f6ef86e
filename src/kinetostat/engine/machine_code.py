"""Machine code: compiled by LLVM, linked so that it runs wherever it lies, mapped into memory, and called.

LLVM compiles in memory. No optimisation passes are run: a traced graph has no repetitions, and on the 4-dof machine
(1300 operations) passes gained nothing over the code generator alone, which takes 50 ms. It leaves an object file. On
Linux with an x86-64 processor the few sections of this file are put behind one another here, and the distances between
them filled in, after which the bytes need neither LLVM nor a linker: mapped into memory they run. Elsewhere the object
file itself is kept, and LLVM loads it.

A page of memory is written first and made executable then; it is never both. Bytes are not checked here, only run.

Source: System V ABI, AMD64 supplement, chapter 4.
"""

import ctypes
import mmap
import platform
import struct
import sys
from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinetostat.arrays import AnyArray, Array, Codes
from kinetostat.engine.trace import Body, rows_of
from kinetostat.frozen import dataclass
from kinetostat.late import LateModule

if TYPE_CHECKING:
    import llvmlite.binding as llvm  # type: ignore[import-untyped]

    from kinetostat.engine import llvm_source
else:  # LLVM takes 0.1 s to load, and is not needed for a program that is on disk
    llvm, llvm_source = LateModule("llvmlite.binding"), LateModule("kinetostat.engine.llvm_source")

SELF_LINKED = sys.platform == "linux" and platform.machine() == "x86_64"
"""Whether objects are linked here; elsewhere LLVM loads them."""


HEAD = struct.Struct("<qqq")
"""The numbers `entry`, `lanes` and `rows` of a packed `MachineCode`, which stand before its bytes."""


@dataclass(frozen=True)
class MachineCode:
    """A compiled program.

    Attributes:
        image: its bytes: linked, or an object file.
        entry: place in linked bytes at which the function begins; -1 of an object file.
        lanes: points of a vector.
        rows: number of results.
    """

    image: bytes
    entry: int
    lanes: int
    rows: int

    def pack(self) -> bytes:
        """Return all of it in a row."""
        return HEAD.pack(self.entry, self.lanes, self.rows) + self.image


def unpack(data: bytes) -> MachineCode:
    """Take apart what `MachineCode.pack` put in a row."""
    entry, lanes, rows = HEAD.unpack_from(data)
    return MachineCode(data[HEAD.size :], entry, lanes, rows)


def machine_code_of(body: Body) -> MachineCode:
    """Compile a body for this processor."""
    return compile_source(llvm_source.source(body, host_lanes()), len(body.results))


def compile_source(assembly: str, rows: int) -> MachineCode:
    """Compile LLVM assembly for this processor, and link it where that is done here.

    Args:
        assembly: text of a function for `host_lanes` points at a time.
        rows: number of its results.
    """
    file = object_file_of(assembly)
    image, entry = _linked_image(file) if SELF_LINKED else (file, -1)
    return MachineCode(image, entry, host_lanes(), rows)


def object_file_of(assembly: str) -> bytes:
    """Compile LLVM assembly for this processor; that of a body takes 0.05 to 0.5 s."""
    module = llvm.parse_assembly(assembly)
    module.verify()
    return _target_maker()().emit_object(module)


def _load_object(object_file: bytes) -> tuple[int, Any]:
    """Let LLVM load an object file; return the address of its function, and what keeps it in memory."""
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_maker()())
    engine.add_object_file(llvm.ObjectFileRef.from_data(object_file))
    engine.finalize_object()
    return engine.get_function_address(llvm_source.NAME), engine


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


SECTION_TABLE, SECTION_SIZE_AND_COUNT = 40, 58
"""Places in the header of an object file: where its table of sections begins, and how many there are of which size."""
SECTION, SYMBOL, RELOCATION = struct.Struct("<4xIQ8xQQ4xIQ8x"), struct.Struct("<4xBxHQ8x"), struct.Struct("<QIIq")
"""Fields of sections, symbols and relocations that are read here, those of the three classes below."""
PROGBITS, SYMBOL_TABLE, RELOCATIONS = 1, 2, 4
"""Kinds of sections: contents, symbols, and places to be filled in with what has to be added."""
ALLOCATED = 2
"""Flag of sections that lie in memory when the program runs."""
RELATIVE = (2, 4)
"""Kinds of relocations that say how far away something is, in 32 bits: R_X86_64_PC32 and R_X86_64_PLT32."""
GLOBAL_FUNCTION = 0x12
"""Binding and kind of a symbol that is a function seen from outside, in one byte (ELF: STB_GLOBAL and STT_FUNC)."""


class ObjectSection(NamedTuple):
    """A section of an object file, with its alignment; of relocations, `target` is the section that they fill in."""

    kind: int
    flags: int
    offset: int
    size: int
    target: int
    alignment: int

    def content(self, file: bytes) -> bytes:
        """Its bytes."""
        return file[self.offset : self.offset + self.size]


class ObjectSymbol(NamedTuple):
    """A symbol: its value is its place in a section, given by number."""

    binding_and_kind: int
    section: int
    value: int


class ObjectRelocation(NamedTuple):
    """A place to be filled in with the distance to a symbol, given by number, to which something is added."""

    place: int
    kind: int
    symbol: int
    added: int


def _linked_image(file: bytes) -> tuple[bytes, int]:
    """Put the sections of an object file that are needed at run time behind one another, and find the function."""
    (first,), (size, count) = (
        struct.unpack_from(form, file, place)
        for form, place in (("<Q", SECTION_TABLE), ("<HH", SECTION_SIZE_AND_COUNT))
    )
    sections = [ObjectSection(*SECTION.unpack_from(file, first + size * number)) for number in range(count)]
    image, places = bytearray(), dict[int, int]()
    for number, section in enumerate(sections):
        if section.kind == PROGBITS and section.flags & ALLOCATED:
            image += bytes(-len(image) % section.alignment)
            places[number] = len(image)
            image += section.content(file)
    table = next(section for section in sections if section.kind == SYMBOL_TABLE)
    symbols = [ObjectSymbol(*fields) for fields in SYMBOL.iter_unpack(table.content(file))]
    for section in sections:
        if section.kind == RELOCATIONS and section.target in places:
            for relocation in (ObjectRelocation(*fields) for fields in RELOCATION.iter_unpack(section.content(file))):
                symbol = symbols[relocation.symbol]
                if relocation.kind not in RELATIVE or symbol.section not in places:
                    raise ValueError("an object file refers to something that is not in it")
                address = places[section.target] + relocation.place
                distance = places[symbol.section] + symbol.value + relocation.added - address
                struct.pack_into("<i", image, address, distance)
    (entry,) = (
        places[symbol.section] + symbol.value for symbol in symbols if symbol.binding_and_kind == GLOBAL_FUNCTION
    )
    return bytes(image), entry


class Program:
    """Machine code, with the memory that holds it."""

    def __init__(self, code: MachineCode) -> None:
        self.rows, self.lanes = code.rows, code.lanes
        if code.entry >= 0:
            address, self._memory = _map(code)
        else:
            address, self._memory = _load_object(code.image)
        self._call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 4, ctypes.c_int64)(address)

    def run(self, fixed: Array, columns: Sequence[Array], results: Array, codes: Codes) -> None:
        """Evaluate points, see `trace.Runnable`; the interpreter is released, so that other threads can run."""
        count = len(codes)
        if count < self.lanes:
            self._run_few(fixed, columns, results, codes)
            return
        self.call_on(fixed, columns, results, codes)()

    def call_on(self, fixed: Array, columns: Sequence[Array], results: Array, codes: Codes) -> Callable[[], None]:
        """Return a function without arguments that evaluates what lies in these arrays; `run` says what they are.

        There are at least as many points as lanes.
        """
        count = len(codes)
        arrays: list[AnyArray] = [*columns, results, codes]
        if any(array.strides[-1] != array.itemsize or array.shape[-1] != count for array in arrays):
            raise ValueError("columns, rows of results and codes must be contiguous and of one length")
        starts = np.array([row for column in columns for row in _addresses(column)], dtype=np.uintp)
        rows = np.array(_addresses(results), dtype=np.uintp)
        addresses = [ctypes.c_void_p(_address(array)) for array in (fixed, starts, rows, codes)]
        call, arguments = self._call, (*addresses, ctypes.c_int64(count))

        # The default argument keeps alive what lies at the addresses.
        def evaluate(_kept: Any = (self, fixed, arrays, starts, rows)) -> None:
            call(*arguments)

        return evaluate

    def _run_few(self, fixed: Array, columns: Sequence[Array], results: Array, codes: Codes) -> None:
        """Evaluate fewer points than there are lanes, by repeating the last of them."""
        count = len(codes)
        if count:
            rows = rows_of(columns)
            padded_rows = np.empty((len(rows), self.lanes))
            for padded_row, column in zip(padded_rows, rows, strict=True):
                padded_row[:count], padded_row[count:] = column, column[-1]
            padded, all_codes = np.empty((len(results), self.lanes)), np.empty(self.lanes, dtype=np.int8)
            self.run(fixed, list(padded_rows), padded, all_codes)
            results[:], codes[:] = padded[:, :count], all_codes[:count]


def _address(array: AnyArray) -> int:
    return array.__array_interface__["data"][0]


def _addresses(rows: Array) -> Sequence[int]:
    """Return where each row of an array begins, of which a column is the only one."""
    first, distance = _address(rows), rows.strides[0]
    return [first + distance * number for number in range(len(rows))] if rows.ndim > 1 else [first]


def _map(code: MachineCode) -> tuple[int, Any]:
    """Copy linked code into memory, make it executable, and return the address of the function and the memory."""
    memory = mmap.mmap(-1, len(code.image), prot=mmap.PROT_READ | mmap.PROT_WRITE)
    memory[: len(code.image)] = code.image
    start = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    if _protect()(start, len(code.image), mmap.PROT_READ | mmap.PROT_EXEC):
        raise OSError(ctypes.get_errno(), "the system does not let this process run code that it has compiled")
    return start + code.entry, memory


@cache
def _protect() -> Any:
    """Return the function of the system that changes what memory may be used for."""
    protect = ctypes.CDLL(None, use_errno=True).mprotect
    protect.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)
    return protect
