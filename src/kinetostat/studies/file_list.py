"""The list of the files that commands have written into a folder, each with its SHA-256. Writes nothing.

`kinetostat.sha256` has a line for each file, as `sha256sum --check` reads it, and begins with the SHA-256 of these
lines: whatever becomes of a file, or of the list itself, is seen. A file that is about to be written again leaves the
list first (`storage.replacing`), so that a command that is killed leaves no wrong line behind.
"""

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path

LIST = "kinetostat.sha256"
"""Name of the list in its folder."""
HEAD = "# written by kinetostat; SHA-256 of the lines below: "

Sums = dict[str, str]
"""SHA-256 of the files of a folder by their names."""


def listed(folder: Path) -> Sums | None:
    """Return what a folder's list says; None where there is none or it is damaged (see `is_damaged`)."""
    try:
        head, _, lines = (folder / LIST).read_bytes().partition(b"\n")
        if head != _head(lines):
            return None
        rows = (line.partition("  ") for line in lines.decode().splitlines())
    except (OSError, UnicodeDecodeError):
        return None
    return {name: digest for digest, _, name in rows}


def is_damaged(folder: Path) -> bool:
    """Tell whether a folder has a list that is not as it was written."""
    return (folder / LIST).exists() and listed(folder) is None


def text_of(sums: Mapping[str, str]) -> bytes:
    """Return a list as its file says it."""
    lines = "".join(f"{digest}  {name}\n" for name, digest in sorted(sums.items())).encode()
    return _head(lines) + b"\n" + lines


def sums_of(folder: Path, names: Iterable[str]) -> Sums:
    """Return the SHA-256 of files in a folder, without those that are not there."""
    return {name: _sum(folder / name) for name in names if (folder / name).is_file()}


def differing(folder: Path) -> list[str]:
    """Return the names of the listed files that are missing, or are not as they were written, in order."""
    wanted = listed(folder) or {}
    there = sums_of(folder, wanted)
    return sorted(name for name in wanted if there.get(name) != wanted[name])


def _head(lines: bytes) -> bytes:
    return f"{HEAD}{hashlib.sha256(lines).hexdigest()}".encode()


def _sum(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
