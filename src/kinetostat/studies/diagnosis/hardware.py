"""What programs can run on here: system, processor and its vectors, memory."""

import os
import platform
from collections.abc import Iterator
from pathlib import Path

from kinetostat.studies.diagnosis.diagnosis import Check, State, reinstall, tried

GROUP = "machine"


def checks() -> Iterator[Check]:
    """System, processor, vectors and memory."""
    yield Check(GROUP, "system", State.SOUND, f"{platform.system()} {platform.release()}, {platform.machine()}")
    yield tried(GROUP, "processor", cores, reinstall("numpy"))
    yield tried(GROUP, "vectors", vectors, reinstall("llvmlite"))
    memory = memory_size()
    if memory is not None:
        yield Check(GROUP, "memory", State.SOUND, f"{memory / 2**30:.1f} GiB")


def processor() -> str:
    """The name of the processor at hand."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def cores() -> str:
    """The processor, and how many of its cores this process may use."""
    from kinetostat.engine.batch import available_cores

    return f"{processor()}, {available_cores()} cores for this process"


def vectors() -> str:
    """How many numbers one instruction of the machine code takes."""
    from kinetostat.engine.native import host_features, host_lanes

    return f"{host_lanes()} numbers of 64 bits at once ({', '.join(host_features()) or 'the plainest'})"


def memory_size() -> int | None:
    """Bytes of memory; None where the system does not say."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return None
