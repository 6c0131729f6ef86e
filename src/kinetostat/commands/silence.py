"""Words on a terminal while a command has printed nothing for a moment, whatever it is doing. No command is known here.

Reading a machine, compiling, computing and writing files may each take seconds. A watch hears all that is written to
standard output and standard error, so that none of them has to say that it is busy, and two never say it at once.
"""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

SILENT_SECONDS = 0.3
"""Time for which nothing may be printed without a word: below it nobody wonders whether the program works."""
HEAD_START_SECONDS = 0.1
"""Time that a progress bar has for its next picture where one computation has held up all threads."""
CLEAR_LINE = "\r\x1b[K"
"""Makes a terminal empty the line that it is in."""


class SilenceWatch:
    """Says on a terminal what a command is doing while nothing is printed, until its result is.

    Attributes:
        ends_with_any_output: whether a word on standard error ends it as well: a server prints only there, then waits.
    """

    ends_with_any_output = False

    def __init__(self, terminal: Any, words: str) -> None:
        self._words = words
        self._terminal = terminal
        self._lock = threading.RLock()
        self._last_heard = time.monotonic()
        self._is_shown = False  # whether the words stand on the terminal
        self._over = threading.Event()
        threading.Thread(target=self._watch, daemon=True).start()

    def say(self, words: str) -> None:
        """Say from now on that the command is doing this."""
        with self._lock:
            self._words = words
            if self._is_shown:
                self._write(f"{CLEAR_LINE}{words} ...")

    def hear(self) -> None:
        """Note that something is about to be printed; the words make room for it."""
        if self.ends_with_any_output:
            self._over.set()
        with self._lock:
            if self._is_shown:
                self._write(CLEAR_LINE)
            self._is_shown = False
            self._last_heard = time.monotonic()

    def end(self) -> None:
        """Say no more: the result is being printed."""
        self._over.set()
        self.hear()

    def _watch(self) -> None:
        while not self._over.wait(max(self._last_heard + SILENT_SECONDS - time.monotonic(), HEAD_START_SECONDS)):
            if self._is_silent() and not self._over.wait(HEAD_START_SECONDS) and self._is_silent():
                with self._lock:
                    if self._is_silent() and not self._over.is_set():
                        self._write(f"{self._words} ...")
                        self._is_shown = True

    def _write(self, text: str) -> None:
        self._terminal.write(text)
        self._terminal.flush()

    def _is_silent(self) -> bool:
        return not self._is_shown and time.monotonic() >= self._last_heard + SILENT_SECONDS


class HeardStream:
    """A stream that says that it is written to before it is; in all else it is the stream."""

    def __init__(self, stream: Any, hear: Callable[[], None]) -> None:
        self._stream = stream
        self._hear = hear

    def write(self, text: str) -> int:
        """Write a text."""
        self._hear()
        return int(self._stream.write(text))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def spoken_silence(words: str) -> Iterator[SilenceWatch | None]:
    """Say on a terminal what is being done while nothing is printed; the first word on standard output ends it.

    Its value is the watch, or None where standard error is not a terminal.
    """
    if not sys.stderr.isatty():
        yield None
        return
    output, terminal = sys.stdout, sys.stderr
    watch = SilenceWatch(terminal, words)
    heard = HeardStream(output, watch.end), HeardStream(terminal, watch.hear)
    sys.stdout, sys.stderr = heard
    try:
        yield watch
    finally:
        watch.end()
        if (sys.stdout, sys.stderr) == heard:
            sys.stdout, sys.stderr = output, terminal
