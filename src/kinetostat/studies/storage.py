"""Writes all files of the program: whole or not at all, and never over anything but a plain file.

A file is written in a temporary folder beside its place, `.kinetostat-...`, and then moved there. The process holds a
lock on that folder. If the process is killed, the lock is released, and the next writer removes the folder. What a
command has written into a folder is listed there.

The list, `kinetostat.sha256`, has a line for each file with its SHA-256, as `sha256sum --check` reads it, and begins
with the SHA-256 of these lines: whatever becomes of a file, or of the list itself, is seen. A file that is about to be
written again leaves the list first (`replacing`), so that a command that is killed leaves no wrong line behind.
"""

import errno
import hashlib
import json
import os
import shutil
import stat
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING, BinaryIO

from kinetostat.spec.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

PREFIX = ".kinetostat-"
"""Beginning of the names of temporary folders."""
ABANDONED_AFTER = 24 * 3600.0
"""Age, s, after which a temporary folder counts as abandoned on systems without locks on folders: no file takes
a day to write."""
UNLOCKED = -1
"""Takes the place of a handle on systems without locks on folders."""
KEPT_SENTENCE = "what was written before is kept, and the same command continues from there"
"""Says what remains after a failure to write into the file of a long study."""
REASONS = {
    errno.ENOSPC: "the disk is full; make room, or choose another place",
    errno.EDQUOT: "your quota of the disk is used up; make room, or choose another place",
    errno.EFBIG: "it would exceed the largest size of a file that is allowed here; raise that limit (ulimit -f)",
    errno.EEXIST: "a file is in the place of a folder; choose another place",
    errno.ENOTDIR: "a part of its path is a file, not a folder; choose another place",
    errno.EROFS: "the disk can only be read; choose another place",
    errno.ELOOP: "it is a link that leads back to itself; choose another place",
    errno.ENAMETOOLONG: "its name is too long; choose a shorter one",
}
"""The trouble and the way out, for errors of the system that people can do something about."""
LIST = "kinetostat.sha256"
"""Name of the list in its folder."""
LIST_HEAD = "# written by kinetostat; SHA-256 of the lines below: "
"""Beginning of the first line of the list, a comment for `sha256sum`."""

Digests = dict[str, str]
"""SHA-256 of the files of a folder by their names."""


@contextmanager
def writing(path: Path, remains: str = "nothing of it was written") -> Iterator[None]:
    """Turn a failure of the system to write into one sentence.

    Args:
        path: the path that the sentence names.
        remains: says what remains after the failure.

    Raises:
        InputError: the disk is full or failing, or may not be written.
    """
    try:
        yield
    except OSError as error:
        reason = REASONS.get(error.errno or 0, f"{error.strerror or error}; choose another place")
        raise InputError(f'"{path}" cannot be written: {reason}; {remains}.') from None


def place_of(path: Path) -> Path:
    """Return where a file is written: the path itself, or the file that it links to.

    Raises:
        InputError: a folder, a device or another special file is there, or a file that may only be read.
    """
    if "\0" in str(path):
        raise InputError(f'"{path}" cannot be the name of a file: it has a null character; choose another name.')
    with writing(path):
        place = Path(os.path.realpath(path))  # unlike resolve(), it also returns for a link that leads to itself
        mode = os.stat(path).st_mode if os.path.lexists(place) else stat.S_IFREG | stat.S_IWUSR
    if stat.S_ISDIR(mode):
        raise InputError(f'"{path}" is a folder, and a file is to be written; give the file a name of its own.')
    if not stat.S_ISREG(mode):
        raise InputError(f'"{path}" is a device or another special file, which is never replaced; name a plain file.')
    if not mode & 0o222 or (os.path.exists(place) and not os.access(place, os.W_OK)):
        raise InputError(f'"{path}" may only be read; choose another name, or make it writable (chmod u+w).')
    return place


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Provide a temporary path of the same name, which takes the place of `path` if the block ends without error.

    If `path` is a link, it stays, and the file that it leads to is replaced. Folders that were made are removed after a
    failure.

    Raises:
        InputError: `path` may not be replaced (see `place_of`), or the disk is full or may not be written.
    """
    place = place_of(path)
    with _made_folders(place.parent, path), writing(path), scratch(place.parent) as folder:
        temporary = folder / place.name
        yield temporary
        temporary.chmod(stat.S_IMODE(place.stat().st_mode) if place.exists() else 0o644)
        with temporary.open("rb") as stream:
            os.fsync(stream.fileno())
        if path.name != LIST:
            _unlist(path)
        temporary.replace(place)


def list_files(folder: Path, paths: Iterable[Path]) -> None:
    """Add files to the list of their folder, as they are now.

    Args:
        folder: the folder into which commands have written files.
        paths: paths of files; those in other folders, or not there, are left out.

    Raises:
        InputError: the list cannot be written.
    """
    digests = {name: digest for name, digest in (read_list(folder) or {}).items() if (folder / name).is_file()}
    digests |= _digests_of(folder, [path.name for path in paths if path.parent == folder])
    if digests:
        write_bytes(folder / LIST, _text_of_list(digests))


def _unlist(path: Path) -> None:
    """Take a file out of the list of its folder, because it is about to change."""
    digests = read_list(path.parent)
    if digests is not None and digests.pop(path.name, ""):
        write_bytes(path.parent / LIST, _text_of_list(digests))


def read_list(folder: Path) -> Digests | None:
    """Return what a folder's list says; None where there is none or it is damaged (see `is_damaged`)."""
    try:
        head, _, lines = (folder / LIST).read_bytes().partition(b"\n")
        if head != _list_head(lines):
            return None
        rows = (line.partition("  ") for line in lines.decode().splitlines())
    except (OSError, UnicodeDecodeError):
        return None
    return {name: digest for digest, _, name in rows}


def is_damaged(folder: Path) -> bool:
    """Tell whether a folder has a list that is not as it was written."""
    return (folder / LIST).exists() and read_list(folder) is None


def _text_of_list(digests: Mapping[str, str]) -> bytes:
    """Return a list as its file says it."""
    lines = "".join(f"{digest}  {name}\n" for name, digest in sorted(digests.items())).encode()
    return _list_head(lines) + b"\n" + lines


def _digests_of(folder: Path, names: Iterable[str]) -> Digests:
    """Return the SHA-256 of files in a folder, without those that are not there."""
    return {name: _digest_of_file(folder / name) for name in names if (folder / name).is_file()}


def differing(folder: Path) -> list[str]:
    """Return the names of the listed files that are missing, or are not as they were written, in order."""
    listed = read_list(folder) or {}
    present = _digests_of(folder, listed)
    return sorted(name for name in listed if present.get(name) != listed[name])


def _list_head(lines: bytes) -> bytes:
    return f"{LIST_HEAD}{hashlib.sha256(lines).hexdigest()}".encode()


def _digest_of_file(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


@contextmanager
def _made_folders(folder: Path, path: Path) -> Iterator[None]:
    """Make a folder and the missing folders above it; if the block fails, remove those that were made.

    Args:
        folder: the folder.
        path: the path that messages name.

    Raises:
        InputError: a folder cannot be made.
    """
    with writing(path):
        missing = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        with writing(path):
            folder.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for place in missing:
            with suppress(OSError):
                place.rmdir()
        raise


@contextmanager
def scratch(parent: Path) -> Iterator[Path]:
    """Provide a temporary folder in `parent`, and remove it and those of killed processes."""
    for abandoned in parent.glob(f"{PREFIX}*"):
        _remove_abandoned(abandoned)
    while True:
        folder = Path(mkdtemp(dir=parent, prefix=PREFIX))
        handle = _lock_folder(folder)
        if handle is not None:
            break
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if handle != UNLOCKED:
            os.close(handle)


def _remove_abandoned(folder: Path) -> None:
    """Remove a temporary folder if nobody has its lock; without locks, if it is older than `ABANDONED_AFTER`."""
    handle = _lock_folder(folder)
    if handle == UNLOCKED:
        with suppress(OSError):
            if time.time() - folder.stat().st_mtime > ABANDONED_AFTER:
                shutil.rmtree(folder, ignore_errors=True)
    elif handle is not None:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(handle)


def _lock_folder(folder: Path) -> int | None:
    """Take the lock of a temporary folder: a handle, `UNLOCKED`, or None if it is taken or gone."""
    if sys.platform == "win32":
        return UNLOCKED
    import fcntl

    try:
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.path.samestat(os.fstat(handle), os.stat(folder)):
            return handle
    except BlockingIOError:
        pass
    except OSError as error:
        if error.errno in (errno.ENOLCK, errno.EOPNOTSUPP, errno.EBADF):  # some network disks
            os.close(handle)
            return UNLOCKED
    os.close(handle)
    return None


def settle(stream: BinaryIO) -> None:
    """Write what the system still buffers to the disk."""
    stream.flush()
    os.fsync(stream.fileno())


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file of bytes.

    Raises:
        InputError: it cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file.

    Raises:
        InputError: it cannot be written.
    """
    write_bytes(path, text.encode())


def write_json(path: Path, data: object) -> None:
    """Write plain data as a JSON file.

    Raises:
        InputError: it cannot be written.
    """
    write_text(path, f"{json.dumps(data, ensure_ascii=False, allow_nan=False, indent=1)}\n")


def write_dataset(path: Path, dataset: "xr.Dataset") -> None:
    """Write a labelled dataset as NetCDF-4.

    The bytes are made in memory, because the HDF5 library ends the process where it meets a full disk.

    Raises:
        InputError: it cannot be written.
    """
    write_bytes(path, bytes(dataset.to_netcdf(engine="h5netcdf")))
