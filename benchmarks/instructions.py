"""Instructions of parts of a program, counted by valgrind however busy the machine is: repeatable to some 0.1 %.

The program runs in a process of its own under callgrind, which counts nothing until everything has been done once.
Requests to valgrind are a row of instructions without an effect elsewhere, which is put into memory here. Programs are
compiled for a processor that valgrind knows (AVX2, four numbers in a register), by the same process without valgrind,
which leaves them in a folder.
"""

import ctypes
import os
import platform
import re
import shutil
import struct
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from kinetostat.engine.machine_code import MachineCode, Program
from kinetostat.engine.program_files import VARIABLE

PROCESSOR, LANES = "haswell", 4
"""What programs are compiled for, and how many numbers its registers hold."""
COUNTING = "COUNTING_INSTRUCTIONS"
"""Variable of the environment by which a process knows that it runs under valgrind."""
CALLGRIND = ("valgrind", "--tool=callgrind", "--instr-atstart=no", "--callgrind-out-file=counts")
REQUEST = bytes.fromhex("4889f8 31d2 48c1c703 48c1c70d 48c1c73d 48c1c733 4887db 4889d0 c3")
"""A function of the address of six numbers: a request and its arguments (valgrind.h, x86-64)."""
ZERO, DUMP, START = (0x43540000 + number for number in (1, 3, 4))
"""Requests to callgrind (callgrind.h)."""


def can_count() -> bool:
    """Whether valgrind is here, and the processor is one that the request is written for."""
    return shutil.which(CALLGRIND[0]) is not None and platform.machine() == "x86_64" and sys.platform == "linux"


def compile_for_valgrind() -> None:
    """Let all programs of this process be compiled for `PROCESSOR`."""
    import llvmlite.binding as llvm

    from kinetostat.engine import machine_code

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_default_triple()
    machine_code.host_lanes = lambda: LANES
    machine_code._target_maker = lambda: (
        lambda: target.create_target_machine(cpu=PROCESSOR, features="", opt=3, reloc="pic", codemodel="small")
    )


def count(tasks: Mapping[str, Callable[[], Any]]) -> None:
    """Do all tasks, and then each once more; their instructions are counted if this process runs under valgrind.

    Args:
        tasks: by their labels.
    """
    for task in tasks.values():
        task()
    if not os.environ.get(COUNTING):
        return
    request = _requests()
    request(START)
    for label, task in tasks.items():
        text = ctypes.create_string_buffer(label.encode())
        request(ZERO)
        task()
        request(DUMP, ctypes.addressof(text))


def _requests() -> Callable[..., None]:
    program = Program(MachineCode(REQUEST, 0, 1, 1))  # maps the code
    call = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(ctypes.cast(program._call, ctypes.c_void_p).value or 0)

    def request(*numbers: int, _kept: Program = program) -> None:
        call(ctypes.create_string_buffer(struct.pack("<6Q", *numbers, *[0] * (6 - len(numbers)))))

    return request


def counts_of(words: Sequence[str]) -> dict[str, int]:
    """Instructions of each part that a script of Python counts, by its label.

    Args:
        words: the script and its arguments.
    """
    with TemporaryDirectory() as folder:
        surroundings = {**os.environ, VARIABLE: f"{folder}/programs", "OPENBLAS_NUM_THREADS": "1"}
        subprocess.run([sys.executable, *words], cwd=folder, env=surroundings, check=True, capture_output=True)
        surroundings[COUNTING] = "1"
        command = [*CALLGRIND, sys.executable, *words]
        subprocess.run(command, cwd=folder, env=surroundings, check=True, capture_output=True)
        found = {}
        for file in Path(folder).glob("counts*"):
            text = file.read_text("utf-8")
            label = re.search(r"^desc: Trigger: Client Request: (.*)$", text, re.MULTILINE)
            total = re.search(r"^totals: (\d+)", text, re.MULTILINE)
            if label and total:
                found[label[1]] = int(total[1])
        return found


def per_pose(words: Sequence[str], few: int, more: int) -> dict[str, float]:
    """Instructions of a pose: the difference between more poses and few, so that what a call costs does not count.

    Args:
        words: a script and its arguments, that counts each part for both; labels end with ": " and the number of poses.
        few, more: the numbers of poses.

    Returns:
        By the label without the number; nothing where instructions cannot be counted.
    """
    found = counts_of(words) if can_count() else {}
    names = {label.rpartition(": ")[0] for label in found}
    return {name: (found[f"{name}: {more}"] - found[f"{name}: {few}"]) / (more - few) for name in names}
