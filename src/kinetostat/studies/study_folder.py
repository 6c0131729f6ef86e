"""The folder of a long study: its question, which chunks of its answer are done, and who is at work. Computes nothing.

`study.json` holds the question, `history.jsonl` one line for each chunk that is done, in the order of time. The lock on
the history belongs to the process and ends with it, however it ends.
"""

import json
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from kinetostat.spec.errors import InputError
from kinetostat.studies.storage import KEPT, settle, write_text, writing

QUESTION, HISTORY = "study.json", "history.jsonl"

ATTEMPTS, PAUSE = 20, 0.01
"""How often a lock is tried before it counts as taken, and seconds between: to ask takes it for some microseconds."""

Record = dict[str, Any]
"""What is noted about a chunk; "chunk" is its number."""


def holds_study(folder: Path) -> bool:
    """Whether a folder is that of a long study."""
    return (folder / QUESTION).exists()


def in_use(folder: Path) -> bool:
    """Whether a process is at work in the folder of a study."""
    try:
        with (folder / HISTORY).open("r+b") as stream:
            _lock(stream)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return False


def noted(folder: Path, start: int = 0) -> tuple[list[Record], int]:
    """Read what was noted from a place in the history on, in whole lines, and the place after it, without waiting.

    Args:
        folder: of a study, in which another process may be at work.
        start: byte of the history where a line begins.
    """
    try:
        with (folder / HISTORY).open("rb") as stream:
            stream.seek(start)
            text = stream.read()
    except FileNotFoundError:
        return [], start
    whole = text[: text.rfind(b"\n") + 1]
    return [json.loads(line) for line in whole.splitlines()], start + len(whole)


class StudyFolder:
    """A folder in which this process alone is at work."""

    def __init__(self, path: Path, history: BinaryIO) -> None:
        self.path = path
        self._history = history

    def question(self, wanted: Record) -> Record | None:
        """Return the question that this folder answers, or None where it has none yet; check that it is the wanted one.

        Raises:
            InputError: it is another one, or cannot be read.
        """
        path = self.path / QUESTION
        try:
            stored: Record | None = json.loads(path.read_text("utf-8")) if path.exists() else None
        except (OSError, ValueError):
            raise InputError(f'"{path}" cannot be read; choose another folder, or remove this one.') from None
        different = [key for key in wanted if stored is not None and wanted[key] != stored.get(key)]
        if different:
            raise InputError(
                f'"{self.path}" holds another study (different: {", ".join(different)}); choose another folder with '
                "-o, or remove that one."
            )
        return stored

    def begin(self, question: Record) -> None:
        """Note a new question, to which nothing is known yet."""
        self._history.truncate(0)
        write_text(self.path / QUESTION, json.dumps(question, ensure_ascii=False, indent=1) + "\n")

    def records(self) -> dict[int, Record]:
        """What was noted about the chunks that are done, by their number; a line cut short is dropped."""
        self._history.seek(0)
        text = self._history.read()
        whole = text[: text.rfind(b"\n") + 1]
        if len(whole) < len(text):
            self._history.truncate(len(whole))
        records = [json.loads(line) for line in whole.splitlines()]
        return {record["chunk"]: record for record in records}

    def note(self, record: Record) -> None:
        """Add a chunk that is done; when this returns it is on the disk."""
        with writing(self.path / HISTORY, KEPT):
            self._history.write(json.dumps(record).encode() + b"\n")
            settle(self._history)


@contextmanager
def study_folder(path: Path) -> Iterator[StudyFolder]:
    """A folder, made if need be, in which no other process may work meanwhile.

    Raises:
        InputError: another process is at work in it, or it cannot be written.
    """
    with writing(path):
        path.mkdir(parents=True, exist_ok=True)
        stream = (path / HISTORY).open("a+b")
    with stream:
        try:
            _lock_soon(stream)
        except OSError:
            raise InputError(
                f'another kinetostat is at work in "{path}"; wait for it, or choose another folder with -o.'
            ) from None
        yield StudyFolder(path, stream)


def _lock_soon(stream: BinaryIO) -> None:
    """Take the lock of a file, also where another process just checks whether it is `in_use`; or fail."""
    for _ in range(ATTEMPTS):
        try:
            _lock(stream)
        except OSError:
            time.sleep(PAUSE)
        else:
            return
    _lock(stream)


def _lock(stream: BinaryIO) -> None:
    """Take the lock of a file, or fail at once; the system gives it back when the process ends."""
    if sys.platform == "win32":
        import msvcrt

        stream.seek(1 << 40)  # a byte far behind the text, because Windows refuses others to read what is locked
        msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
