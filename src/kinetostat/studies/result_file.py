"""A NetCDF file larger than memory, filled run by run. Which runs are done is known elsewhere.

Every variable is one contiguous block, reserved when the file is made; later only numbers are written into it. An
interruption therefore breaks no structure, no second copy has to be assembled, and the file does not depend on the runs
that wrote it, nor on their order. The status of a point is written last, so that a point that has one is complete.
"""

import os
import shutil
import sys
from collections.abc import Iterable, Mapping, Sequence
from math import prod
from pathlib import Path
from typing import Any, BinaryIO, TypedDict

import h5netcdf
import h5py
import numpy as np
import xarray as xr

from kinetostat.arrays import AnyArray
from kinetostat.spec.errors import InputError
from kinetostat.studies.storage import KEPT_SENTENCE, settle, writing
from kinetostat.studies.study_folder import checksum

SPARE_BYTES = 1 << 30
"""Bytes that are left free on a disk, 1 GiB: other programs fail on one that is full to the last byte."""
BYTES_AT_A_TIME = 1 << 24
"""Bytes that are filled at a time, 16 MiB: little memory, and so many that the time of a call does not count."""
VALUES_OF_A_FIGURE = 400
"""Values of an axis that a figure can show: one for every two or three of its pixels."""
STATUS = "status"
"""Name of the variable that says of each point whether and how it is answered, int8; all others are float64."""
FLOAT_BYTES = 8
"""Bytes of a value of every variable but the status."""
UNKNOWN = -1
"""Status of points that are not computed yet."""


class Layout(TypedDict):
    """The places of the numbers in a file, as plain data that a folder keeps.

    Attributes:
        points: number of points.
        size: size of the file, bytes.
        offsets: start of the block of each variable by its name, bytes, in the order in which the variables are written
            and their checksums are taken: quantities, then the status.
        frame: checksum of all that is in no block.
    """

    points: int
    size: int
    offsets: dict[str, int]
    frame: str


def check_space(folder: Path, points: int, quantities: int) -> None:
    """Check that a file of so many points and quantities fits on the disk.

    Raises:
        InputError: it does not.
    """
    place = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.exists())
    needed = points * (FLOAT_BYTES * quantities + _width(STATUS))
    free = shutil.disk_usage(place).free
    if needed + SPARE_BYTES > free:
        raise InputError(
            f'"{folder}" has room for {free / 1e9:,.1f} GB, but {points:,} points of {quantities} quantities and a '
            f"status take {needed / 1e9:,.1f} GB; lower the counts, name fewer quantities, or choose another disk."
        )


def create(
    path: Path,
    labels: xr.Dataset,
    dims: Sequence[str],
    quantities: Mapping[str, Mapping[str, Any]],
    about_status: Mapping[str, Any],
) -> Layout:
    """Make a file in which no point is computed yet, and return its layout.

    Args:
        path: path of the file; one that is there is replaced.
        labels: coordinates and attributes.
        dims: dimensions of all variables.
        quantities: attributes of each quantity by name.
        about_status: attributes of the status.

    Raises:
        InputError: the folder cannot be written, or the disk is full.
    """
    points = prod(labels.sizes[dim] for dim in dims)
    variables = {**quantities, STATUS: about_status}
    with writing(path):
        _try_space(path, points * sum(map(_width, variables)) + labels.nbytes + BYTES_AT_A_TIME)
        labels.to_netcdf(path, engine="h5netcdf")
        with h5netcdf.File(path, "a") as file:
            for name, attributes in variables.items():
                variable = file.create_variable(
                    name, tuple(dims), "i1" if name == STATUS else "f8", dcpl=_reserved_block()
                )
                for key, value in attributes.items():
                    variable.attrs[key] = value
        with path.open("r+b") as stream:
            if sys.platform == "linux":
                os.posix_fallocate(stream.fileno(), 0, path.stat().st_size)
            offsets = _offsets(path, variables)
            _fill_status(stream, offsets[STATUS], points)
            settle(stream)
            size = path.stat().st_size
            frame = _frame_checksum(stream, points, size, offsets)
            return Layout(points=points, size=size, offsets=offsets, frame=frame)


def _try_space(path: Path, size: int) -> None:
    """Fail where no file of this size can be made, because the HDF5 library would end the process there.

    Only on Linux the space is really taken: elsewhere the system makes a file with holes, and the check is in vain.
    """
    with path.open("wb") as stream:
        if sys.platform == "linux":
            os.posix_fallocate(stream.fileno(), 0, size)
        stream.truncate(size)


def _reserved_block() -> Any:
    """Storage in one block that exists from the start, and that HDF5 itself leaves alone."""
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_layout(h5py.h5d.CONTIGUOUS)
    properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    properties.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    return properties


def _fill_status(stream: BinaryIO, offset: int, points: int) -> None:
    stream.seek(offset)
    stream.writelines(
        np.full(min(BYTES_AT_A_TIME, points - start), UNKNOWN, dtype=np.int8).data
        for start in range(0, points, BYTES_AT_A_TIME)
    )


def _offsets(path: Path, names: Iterable[str]) -> dict[str, int]:
    """Start of the block of each variable, bytes."""
    with h5py.File(path) as file:
        return {name: file[name].id.get_offset() for name in names}


def frame_is_whole(path: Path, layout: Layout) -> bool:
    """Tell whether all of a file but its numbers is as it was made: its size, names, attributes and coordinates."""
    try:
        with path.open("rb") as stream:
            parts = layout["points"], layout["size"], layout["offsets"]
            return path.stat().st_size == layout["size"] and _frame_checksum(stream, *parts) == layout["frame"]
    except OSError:
        return False


def _frame_checksum(stream: BinaryIO, points: int, size: int, offsets: Mapping[str, int]) -> str:
    """Return the checksum of all bytes before, between and behind the blocks; arguments as in `Layout`."""
    blocks = sorted((offset, offset + points * _width(name)) for name, offset in offsets.items())
    result, place = "0", 0
    for start, end in [*blocks, (size, size)]:
        stream.seek(place)
        result, place = checksum(stream.read(start - place), result), end
    return result


def run_checksum(stream: BinaryIO, layout: Layout, run: range) -> str:
    """Return the checksum of a run of points in a file: of each variable in the order of the layout."""
    result = "0"
    for name, offset in layout["offsets"].items():
        stream.seek(offset + run.start * _width(name))
        result = checksum(stream.read(len(run) * _width(name)), result)
    return result


def copy_run(source: BinaryIO, layout: Layout, target: BinaryIO, target_layout: Layout, run: range) -> None:
    """Copy a run of points from a file to another one, each with its layout."""
    for name, offset in layout["offsets"].items():
        source.seek(offset + run.start * _width(name))
        target.seek(target_layout["offsets"][name] + run.start * _width(name))
        target.write(source.read(len(run) * _width(name)))


def _width(name: str) -> int:
    """Bytes of a value of a variable."""
    return 1 if name == STATUS else FLOAT_BYTES


class ResultFile:
    """An open file, to be filled."""

    def __init__(self, path: Path, names: Iterable[str]) -> None:
        """Open a file that `create` has made, with the quantities of these names in the order of its layout."""
        self._offsets = _offsets(path, (*names, STATUS))  # in the order of the layout, so that checksums agree
        self._path = path
        self._stream = path.open("r+b")

    def write(self, start: int, values: Mapping[str, AnyArray], status: AnyArray) -> str:
        """Write a run of points; when this returns it is on the disk.

        Args:
            start: number of its first point.
            values: values of each quantity [points].
            status: `Status` codes [points].

        Returns:
            The checksum of what was written, as `run_checksum` computes it.

        Raises:
            InputError: the disk is full or failing.
        """
        written = "0"
        with writing(self._path, KEPT_SENTENCE):
            for name, offset in self._offsets.items():
                given, dtype = (status, np.int8) if name == STATUS else (values[name], np.float64)
                data = np.ascontiguousarray(given, dtype=dtype)
                self._stream.seek(offset + start * _width(name))
                self._stream.write(data.data)
                written = checksum(data.data.cast("B"), written)
            settle(self._stream)
        return written

    def close(self) -> None:
        """Close the file."""
        self._stream.close()


def thinned_dataset(path: Path) -> xr.Dataset:
    """Read as many values of a file along each dimension as a figure can show."""
    with xr.open_dataset(path, engine="h5netcdf") as dataset:
        steps = {dim: slice(None, None, -(-size // VALUES_OF_A_FIGURE)) for dim, size in dataset.sizes.items()}
        return dataset.isel(steps).load()
