"""Rows of numbers in a file that grows: float64, little-endian, row after row. What they mean is elsewhere."""

from pathlib import Path
from types import TracebackType

import numpy as np

from kinetostat.engine.points import Array
from kinetostat.spec.errors import InputError
from kinetostat.studies.result_file import settle, writing

KIND = np.dtype("<f8")


class RowFile:
    """An open file of rows of one width."""

    def __init__(self, path: Path, width: int) -> None:
        self._path, self._width = path, width
        with writing(path):
            path.touch()
            self._stream = path.open("r+b")

    def __enter__(self) -> "RowFile":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stream.close()

    def read(self, start: int, count: int) -> Array:
        """Some rows [count x width], from number `start` on.

        Raises:
            InputError: they are not there.
        """
        size = self._width * KIND.itemsize
        self._stream.seek(start * size)
        data = self._stream.read(count * size)
        if len(data) < count * size:
            raise InputError(f'"{self._path}" has lost rows; remove its folder to begin again.')
        return np.frombuffer(data, dtype=KIND).reshape(count, self._width).astype(float)

    def write(self, start: int, rows: Array) -> None:
        """Put rows at number `start`; when this returns they are on the disk.

        Raises:
            InputError: the disk is full or failing.
        """
        with writing(self._path):
            self._stream.seek(start * self._width * KIND.itemsize)
            self._stream.write(np.ascontiguousarray(rows, dtype=KIND).data)
            settle(self._stream)
