"""The folder of a long study: its question, which chunks of its answer are done, and who is at work. Computes nothing.

`study.json` holds the question, `study-copy.json` the same once more, because all the rest is lost without it, and
`history.jsonl` one line for each chunk that is done, in the order of time. The lock on the history belongs to the
process and ends with it, however it ends. The question and every line carry a checksum, and a line also that of the
numbers it is about: what is damaged is known, and computed again.
"""

import json
import sys
import time
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from kinetostat.spec.errors import InputError
from kinetostat.studies.storage import KEPT_SENTENCE, LIST, settle, write_text, writing

QUESTION, COPY, HISTORY = "study.json", "study-copy.json", "history.jsonl"
"""Names of the files of a folder."""
ATTEMPTS = 20
"""Attempts to take a lock before it counts as taken. A process that asks whether a folder is in use holds it for some
microseconds, so that a second attempt is mostly enough; twenty are for slow disks."""
PAUSE = 0.01
"""Seconds from one attempt to the next: all of them take a fifth of a second."""
CHECK = "check"
"""Key of the checksum of a record, its last."""
DATA = "data"
"""Key of the checksum of the numbers that a record is about."""
VERSION = "kinetostat"
"""Key of the version that began a folder; later ones go on with it."""
CHECKED = "checksums"
"""Key of a question whose folder has checksums."""

Record = dict[str, Any]
"""The note about a chunk; "chunk" is its number."""


def holds_study(folder: Path) -> bool:
    """Whether a folder is that of a long study."""
    return any((folder / name).exists() for name in (QUESTION, COPY))


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


def read_history(folder: Path, start: int = 0) -> tuple[list[Record], int]:
    """Read what was noted from a place in the history on, in whole lines, and the place after it, without waiting.

    Args:
        folder: the folder of a study, in which another process may be at work.
        start: byte of the history where a line begins.
    """
    try:
        with (folder / HISTORY).open("rb") as stream:
            stream.seek(start)
            text = stream.read()
    except FileNotFoundError:
        return [], start
    lines = _whole_lines(text)
    records = map(_checked_note, lines.splitlines())
    return [record for record in records if record is not None], start + len(lines)


def _whole_lines(text: bytes) -> bytes:
    """The text without a last line that was cut short."""
    return text[: text.rfind(b"\n") + 1]


def read_question(folder: Path) -> Record:
    """Return the question that a folder answers, from its copy where it is damaged itself.

    Raises:
        InputError: neither can be read, or both are damaged.
    """
    path, trouble = folder / QUESTION, "is damaged and cannot be read; choose another folder, or remove this one"
    for name in (QUESTION, COPY):
        try:
            question = _checked_record((folder / name).read_bytes())
        except OSError as error:
            if name == QUESTION:
                trouble = f"cannot be read: {error.strerror}; choose another folder"
        else:
            if question is not None:
                return question
    raise InputError(f'"{path}" {trouble}.')


def damaged_questions(folder: Path) -> list[str]:
    """Return the names of the files of a question that are damaged or lost; a folder of an earlier version has one."""
    texts = {name: (folder / name).read_bytes() for name in (QUESTION, COPY) if (folder / name).exists()}
    damaged = [name for name, text in texts.items() if _checked_record(text) is None]
    return damaged if QUESTION in texts else [QUESTION, *damaged]


def has_checksums(question: Record) -> bool:
    """Tell whether the folder of a question was written with checksums; those of earlier versions were not."""
    return bool(question.get(CHECKED))


def checksum(data: bytes | memoryview, before: str = "0") -> str:
    """Return the CRC-32 of some bytes, or of more bytes after those of another checksum.

    Any damage within 32 bits in a row changes it; other damage does so but for one case in four thousand million.
    """
    return f"{zlib.crc32(data, int(before, 16)):08x}"


def _with_checksum(record: Record) -> Record:
    """Return a record with its checksum."""
    return {**record, CHECK: checksum(json.dumps(record).encode())}


def _as_line(note: Record) -> bytes:
    """A note with its checksum as a line of the history."""
    return json.dumps(_with_checksum(note)).encode() + b"\n"


def _checked_note(line: bytes) -> Record | None:
    """Return the note in a line of the history, without its checksum; None if it is damaged or names no chunk."""
    note = _checked_record(line)
    number = None if note is None else note.get("chunk")
    return note if isinstance(number, int) and number >= 0 else None


def _checked_record(text: bytes) -> Record | None:
    """Return the record in a JSON text, without its checksum; None if it is damaged."""
    try:
        record = json.loads(text)
    except ValueError:
        return None
    if not isinstance(record, dict):
        return None
    check = record.pop(CHECK, None)
    if check is None:  # of an earlier version, unless the key itself is damaged
        return None if {DATA, CHECKED} & record.keys() else record
    return record if check == checksum(json.dumps(record).encode()) and text.strip() in _written_forms(record) else None


def _written_forms(record: Record) -> Iterator[bytes]:
    """The forms in which a record may stand in a file: one line of a history, or the lines of a question."""
    yield json.dumps(_with_checksum(record)).encode()
    yield json.dumps(_with_checksum(record), ensure_ascii=False, indent=1).encode()


class StudyFolder:
    """A folder in which this process alone is at work.

    Attributes:
        path: path of the folder.
        damaged: lines of its history that were damaged when it was last read.
    """

    def __init__(self, path: Path, history: BinaryIO) -> None:
        """Take over a folder; the process has the lock of its history, which is open to be read and written."""
        self.path, self.damaged, self._history = path, 0, history

    def checked_question(self, wanted: Record, restated: Callable[[Record], Record]) -> Record | None:
        """Return the question that this folder answers, or None where it has none yet; check that it is the wanted one.

        A file of the question that is damaged or missing is written again.

        Args:
            wanted: the question that is asked.
            restated: writes a stored question as this version would: earlier ones left out what is said today.

        Raises:
            InputError: it is another one, or cannot be read.
        """
        stored = read_question(self.path) if holds_study(self.path) else None
        if stored is None:
            return None
        known = restated(stored)
        different = [key for key in wanted if key != VERSION and wanted[key] != known.get(key)]
        if different:
            raise InputError(
                f'"{self.path}" holds another study (different: {", ".join(different)}); choose another folder with '
                "-o, or remove that one."
            )
        if has_checksums(stored) and (damaged_questions(self.path) or not (self.path / COPY).exists()):
            self.write_question(stored)
        return stored

    def begin(self, question: Record) -> None:
        """Note a new question, to which nothing is known yet."""
        self._forget_digests()
        self._history.truncate(0)
        self.write_question(question)

    def write_question(self, question: Record) -> None:
        """Write the question of this folder, and its copy."""
        text = json.dumps(_with_checksum({**question, CHECKED: "CRC-32"}), ensure_ascii=False, indent=1)
        for name in (QUESTION, COPY):
            write_text(self.path / name, f"{text}\n")

    def records(self) -> dict[int, Record]:
        """Return the notes about the chunks that are done, by their number; a line cut short or damaged is dropped."""
        self._history.seek(0)
        text = self._history.read()
        whole_lines = _whole_lines(text)
        if len(whole_lines) < len(text):
            self._history.truncate(len(whole_lines))
        lines = [_checked_note(line) for line in whole_lines.splitlines()]
        records = [record for record in lines if record is not None]
        self.damaged = len(lines) - len(records)
        return {record["chunk"]: record for record in records}

    def keep(self, records: Iterable[Record]) -> None:
        """Forget all that was noted but these records, where others are damaged."""
        text = b"".join(map(_as_line, records))
        self._forget_digests()
        with writing(self.path / HISTORY, KEPT_SENTENCE):
            self._history.truncate(0)
            self._history.write(text)
            settle(self._history)

    def note(self, record: Record) -> None:
        """Add a chunk that is done; when this returns it is on the disk."""
        self._forget_digests()
        with writing(self.path / HISTORY, KEPT_SENTENCE):
            self._history.write(_as_line(record))
            settle(self._history)

    def _forget_digests(self) -> None:
        """Remove the list of checksums of finished files: one of them is about to change."""
        (self.path / LIST).unlink(missing_ok=True)


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
