"""Compiled programs on disk, so that a new process need not trace and compile what an earlier one has compiled.

Machine code cannot be judged by looking at it: anybody who could write such a file, or change a byte of it, would
decide what the next process does. So nothing is run that this user has not written himself. The folder belongs to the
user alone (0700). It is opened once; owner and rights are judged of what has been opened, and every name is looked up
in it. Where others may write or read it, it is not used. Each file carries a keyed hash of its content and of its name,
by a secret that never leaves the folder: a damaged file, a copied one, or one of another program is made again.

A file is written under another name and then moved to its own, so that a process that is killed, or two at once, leave
whole files. If the system refuses something (no room, no right to write), programs are compiled again, and nothing
else is lost.

What a program is made of is said by its maker in a text (`kernel`); what else decides about its bytes is added here:
the sources of kinetostat, LLVM, Python and the processor.
"""

import hashlib
import hmac
import os
import sys
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from importlib.util import find_spec
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.late import LateModule

if TYPE_CHECKING:
    from kinetostat.engine import machine_code
else:  # it needs NumPy, which `doctor` must not
    machine_code = LateModule("kinetostat.engine.machine_code")

VARIABLE = "KINETOSTAT_CACHE"
"""Variable of the environment with another folder for them, or "off"."""
OFF = "off"
"""Value of the variable with which no programs are kept on disk."""
MOST_BYTES = 64 << 20
"""Bytes of all files together; programs have some 10 to 300 kB, so that hundreds stay."""
KEPT_SHARE = 0.75
"""Share of these bytes that stay when there are more, so that not each new program asks for room: the files used
last."""
DAY, HOUR = 86400.0, 3600.0
"""Seconds: times of use are noted once a day, and files of killed processes are removed after an hour."""
SECRET = "secret"
"""Name of the file of the folder's secret."""
SECRET_SIZE, HASH_SIZE = 32, 32
"""Bytes of the secret and of a hash: 256 bits, which nobody can guess."""
RIGHTS_OF_OTHERS = 0o077
"""Bits of the rights of group and others: a folder with programs is not used where one of them is set."""


def read_program(text: str) -> bytes | None:
    """Return what has been stored of a program, as it was given to `write_program`; None where there is nothing sound.

    Args:
        text: all that the program is made of.
    """
    name = _name(text)
    if name is None:
        return None
    with _if_possible(), _folder() as folder:
        secret = _secret(folder)
        data = _read(folder, name)
        if hmac.compare_digest(data[:HASH_SIZE], _hash(secret, name, data[HASH_SIZE:])):
            _remember_use(folder, name)
            return data[HASH_SIZE:]
        os.unlink(name, dir_fd=folder)
    return None


def write_program(text: str, content: bytes) -> None:
    """Store a program, where that is possible.

    Args:
        text: all that the program is made of.
        content: its bytes.
    """
    name = _name(text)
    if name is None:
        return
    with _if_possible(), _folder(make=True) as folder:
        secret = _secret(folder, make=True)
        with _new_file(folder, _hash(secret, name, content) + content) as new:
            os.rename(new, name, src_dir_fd=folder, dst_dir_fd=folder)
        _drop_oldest(folder)


def disk_usage() -> int:
    """Return how many bytes all programs have on disk.

    Raises:
        SharedFolderError: the folder is not used, because others may use it.
        OSError: it is not there.
    """
    with _folder() as folder, os.scandir(folder) as entries:
        return sum(entry.stat(follow_symlinks=False).st_size for entry in entries if entry.name != SECRET)


def usual_folder() -> Path | None:
    """Return the folder of the programs; None where they are not to be kept on disk, or the system has no owners."""
    chosen = os.environ.get(VARIABLE, "").strip()
    if chosen.lower() == OFF or not hasattr(os, "geteuid"):
        return None
    if chosen:
        return Path(chosen).absolute()
    home = Path(os.path.expanduser("~"))
    if not home.is_absolute():
        return None
    system = home / "Library" / "Caches" if sys.platform == "darwin" else home / ".cache"
    wished = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(wished) if os.path.isabs(wished) else system) / "kinetostat" / "programs"


class SharedFolderError(PermissionError):
    """The folder is not the user's alone; its message says what to do."""


@contextmanager
def _if_possible() -> Iterator[None]:
    """Go on without the disk where the system refuses something; where others may use the folder, a warning says so."""
    try:
        yield
    except SharedFolderError as error:
        warnings.warn(str(error), stacklevel=4)  # at the caller of read_program or write_program
    except OSError:
        pass


@contextmanager
def _folder(make: bool = False) -> Iterator[int]:
    """Open the folder and give its descriptor.

    Raises:
        SharedFolderError: others may write or read it.
        OSError: it is not there and cannot be made.
    """
    path = usual_folder()
    if path is None:
        raise OSError("programs are not kept on disk")
    if make:
        path.parent.mkdir(parents=True, exist_ok=True)
        with suppress(FileExistsError):
            path.mkdir(mode=0o700)
    folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        if not _is_private(folder):
            raise SharedFolderError(
                f'compiled programs are not kept in "{path}", because it belongs to others or they may use it; '
                f"`chmod 700` it if it is yours, or choose another folder with {VARIABLE}."
            )
        yield folder
    finally:
        os.close(folder)


def _is_private(descriptor: int) -> bool:
    """Return whether what has been opened belongs to this user, and nobody else may use it."""
    status = os.fstat(descriptor)
    return status.st_uid == os.geteuid() and not status.st_mode & RIGHTS_OF_OTHERS


def _read(folder: int, name: str) -> bytes:
    """Read a file of this user in the folder.

    Raises:
        OSError: it is not there, or not the user's own.
    """
    descriptor = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC, dir_fd=folder)
    with open(descriptor, "rb") as file:
        if not _is_private(descriptor):
            raise PermissionError("a file is not the user's own")
        return file.read(MOST_BYTES)


@contextmanager
def _new_file(folder: int, content: bytes) -> Iterator[str]:
    """Write a file under a name of no program; it is removed unless it has been moved away."""
    name = f".{os.getpid()}-{os.urandom(8).hex()}"
    descriptor = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600, dir_fd=folder)
    try:
        with open(descriptor, "wb") as file:
            file.write(content)
        yield name
    finally:
        with suppress(FileNotFoundError):
            os.unlink(name, dir_fd=folder)


def _secret(folder: int, make: bool = False) -> bytes:
    """Read the secret of the folder; the first process makes it, and where two begin at once, one of them.

    Raises:
        OSError: there is none, or none that can be used.
    """
    with suppress(FileExistsError):
        if make and not _exists(folder, SECRET):
            with _new_file(folder, os.urandom(SECRET_SIZE)) as new:
                os.link(new, SECRET, src_dir_fd=folder, dst_dir_fd=folder)
    secret = _read(folder, SECRET)
    if len(secret) != SECRET_SIZE:
        os.unlink(SECRET, dir_fd=folder)
        raise OSError("the secret is damaged; the next process makes another")
    return secret


def _exists(folder: int, name: str) -> bool:
    """Tell whether the folder has a file of this name."""
    try:
        os.stat(name, dir_fd=folder, follow_symlinks=False)
    except FileNotFoundError:
        return False
    return True


def _hash(secret: bytes, name: str, content: bytes) -> bytes:
    return hashlib.blake2b(name.encode() + content, key=secret, digest_size=HASH_SIZE).digest()


def _remember_use(folder: int, name: str) -> None:
    """Note in the time of a file that it has been used today."""
    with suppress(OSError):
        if time.time() - os.stat(name, dir_fd=folder).st_mtime > DAY:
            os.utime(name, dir_fd=folder)


def _drop_oldest(folder: int) -> None:
    """Remove the files that have not been used for longest, if all are too large, and what killed processes left."""
    with os.scandir(folder) as entries:
        files = sorted(
            ((entry.stat(follow_symlinks=False), entry.name) for entry in entries), key=lambda f: f[0].st_mtime
        )
    total, now = sum(status.st_size for status, _ in files), time.time()
    room = MOST_BYTES if total <= MOST_BYTES else KEPT_SHARE * MOST_BYTES
    for status, name in files:
        is_abandoned = name.startswith(".") and now - status.st_mtime > HOUR
        if is_abandoned or (total > room and name != SECRET and not name.startswith(".")):
            with suppress(FileNotFoundError):
                os.unlink(name, dir_fd=folder)
            total -= status.st_size


def _name(text: str) -> str | None:
    """Return the name of a program's file: a digest of all that decides about its bytes; None if that is not known."""
    surroundings = _surroundings()
    if surroundings is None:
        return None
    return hashlib.blake2b(f"{surroundings}\n{text}".encode(), digest_size=20).hexdigest()


ROOMS = (
    *("spec", "algebra", "machine", "numerics", "kinematics", "kinetostatics", "equilibrium", "vibration", "motion"),
    "engine",
)
"""Folders of kinetostat on which programs depend, beside the files above them."""


@cache
def _surroundings() -> str | None:
    """Return all that decides about a program's bytes beside what it is made of.

    None where that is not known: sources have been changed since this process began, and so may not be those that run.
    """
    package = Path(__file__).parents[1]
    try:
        sources = [source for room in ("", *ROOMS) for source in _sources(str(package / room), deep=bool(room))]
        compiler = find_spec("llvmlite")
        version = os.stat(compiler.origin) if compiler and compiler.origin else None
        processor = _processor()
    except OSError:
        return None
    # Read of the package as it was imported: it notes when this process began, s.
    if not sources or max(changed for _, _, changed in sources) > sys.modules[package.name].STARTED * 1e9:
        return None
    llvm = (compiler.origin, version.st_size, version.st_mtime_ns) if compiler and version else ()
    return repr((str(package), sources, sys.version, llvm, processor))


def _sources(folder: str, deep: bool) -> list[tuple[str, int, int]]:
    """Name, size and time of the last change (ns) of each Python file of a folder, with those below if `deep`."""
    sources, below = [], []
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith(".py"):
                status = entry.stat()
                sources.append((entry.path, status.st_size, status.st_mtime_ns))
            elif deep and entry.is_dir():
                below.append(entry.path)
    return sorted(sources) + [source for path in sorted(below) for source in _sources(path, deep)]


FEATURES = (
    *("vendor_id", "cpu family", "model", "model name", "stepping", "flags"),
    *("Features", "CPU implementer", "CPU architecture", "CPU variant", "CPU part", "CPU revision"),
)
"""Lines on a processor that say what code it can run: of Intel's kind, and of ARM's."""


def _processor() -> str:
    """Return the processor that code is made for, on Linux as the system says it, because LLVM takes long to load."""
    if sys.platform != "linux":
        return machine_code.host_description()  # LLVM has to load the code there in any case
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        first = [line.partition(":") for line in takewhile(str.strip, file)]  # until an empty line
    features = [(name.strip(), text.strip()) for name, _, text in first if name.strip() in FEATURES]
    if not features:
        raise OSError("the system does not say what its processor can do")
    return repr(features)
