"""Files written whole or not at all: into a temporary neighbour first, then renamed. Nothing is computed here."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import mkstemp
from typing import TYPE_CHECKING

from kinetostat.spec.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside `path`, with the same suffix, that becomes `path` when the block ends without error.

    Raises:
        InputError: the folder cannot be made or written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = mkstemp(dir=path.parent, prefix=f".{path.stem}-", suffix=path.suffix)
    except OSError as error:
        raise InputError(f'"{path}" cannot be written: {error.strerror}; choose another place with -o.') from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: Path, data: object) -> None:
    """Write plain data as a JSON file."""
    write_text(path, f"{json.dumps(data, ensure_ascii=False, allow_nan=False, indent=1)}\n")


def write_dataset(path: Path, dataset: "xr.Dataset") -> None:
    """Write a labelled dataset as NetCDF-4."""
    with replacing(path) as temporary:
        dataset.to_netcdf(temporary, engine="h5netcdf")
