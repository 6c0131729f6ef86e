"""Work in processes of their own, whose time and memory are limited: turns of the tabs, and the reading of sent files.

A file that a browser has sent is read first by `python -m kinetostat.studio.processes KIND NAME`, with the file on its
standard input. What it can read within its limits, the page then reads itself; any other file is refused, and no other
page has noticed it. A tab that asks for more than its turn is refused, so that no queue grows.
"""

import asyncio
import os
import sys
from collections.abc import AsyncIterator, Hashable
from contextlib import asynccontextmanager, suppress

from kinetostat.machine.loading import build
from kinetostat.spec.document import parse, text_of
from kinetostat.spec.errors import InputError
from kinetostat.spec.study import read_study

NICENESS = 10
"""Added to `nice` of such a process, so that the pages get their time first."""
READING_PROGRAM = "kinetostat.studio.processes"
"""The module that a reading process runs: this one, by its name."""
SECONDS_TO_READ = 10
"""Processor time of the process, s; a usual machine takes one second, nearly all of it to start."""
SECONDS_TO_WAIT = 60.0
"""Time, s, after which the process is stopped, on a server with much other work as well."""
MEMORY_TO_READ = 2 << 30
"""Address space of the process, bytes; its libraries take half a gigabyte."""
REFUSED = 3
"""Exit code after a refusal, whose sentence is on standard output."""


class Turns:
    """A queue in which each tab has at most one piece of work, and only some pieces are done at a time."""

    def __init__(self, at_a_time: int, refusal: str) -> None:
        """Create an empty queue.

        Args:
            at_a_time: the most pieces of work of all tabs that are done at a time.
            refusal: the sentence for a tab that has one already.
        """
        self._places, self._refusal = asyncio.Semaphore(at_a_time), refusal
        self._tabs: set[Hashable] = set()

    @asynccontextmanager
    async def turn(self, tab: Hashable) -> AsyncIterator[None]:
        """Wait for a place; those who came first are served first.

        Args:
            tab: the key of the tab.

        Raises:
            InputError: this tab works or waits already.
        """
        if tab in self._tabs:
            raise InputError(self._refusal)
        self._tabs.add(tab)
        try:
            async with self._places:
                yield
        finally:
            self._tabs.discard(tab)


def make_modest(process: int) -> None:
    """Let a process, by its number, give way to the pages, where the system can."""
    if sys.platform != "win32":
        with suppress(ProcessLookupError):  # it has ended already
            os.setpriority(os.PRIO_PROCESS, process, NICENESS)


READING = Turns(1, "The file that this tab has sent before is still being read; wait for it, then send the next one.")
"""One file of all tabs is read at a time, so that a core is left to the pages."""


async def check_upload(kind: str, data: bytes, name: str, tab: Hashable) -> None:
    """Check that a file can be read, in a bounded time and a bounded memory.

    Args:
        kind: "machine" or "study".
        data: content of the file.
        name: the name of the file, for messages.
        tab: the key of the tab that has sent it.

    Raises:
        InputError: it cannot be read, or not within the limits, or the tab's file before is still being read.
    """
    async with READING.turn(tab):
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", READING_PROGRAM, kind, name.replace("\0", "?"),
            stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL,
        )  # fmt: skip
        make_modest(process.pid)
        try:
            refusal, _ = await asyncio.wait_for(process.communicate(data), SECONDS_TO_WAIT)
        except TimeoutError:
            refusal = b""
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()
    if process.returncode == REFUSED:
        raise InputError(refusal.decode())
    if process.returncode != 0:
        raise InputError(
            f'"{name}" takes more than {SECONDS_TO_READ} s or {MEMORY_TO_READ >> 30} GiB to read, or stops the '
            f"program that reads it; a {kind} file is a short TOML text: check what is in it."
        )


def read(kind: str, data: bytes, name: str) -> None:
    """Read a file as a page would.

    Args:
        kind: "machine" or "study".
        data: content of the file.
        name: the name of the file, for messages.

    Raises:
        InputError: it cannot be read.
    """
    text = text_of(data, name)
    if kind == "study":
        read_study(parse(text, name), name)
    else:
        build(text, name)


def limit_process(seconds: int, memory: int) -> None:
    """Limit the processor time (s) and the memory (bytes) of this process, where the system can."""
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))


if __name__ == "__main__":
    limit_process(SECONDS_TO_READ, MEMORY_TO_READ)
    try:
        read(sys.argv[1], sys.stdin.buffer.read(), sys.argv[2])
    except InputError as refusal:
        sys.stdout.buffer.write(str(refusal).encode())
        sys.exit(REFUSED)
