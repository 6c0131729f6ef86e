"""Poses from a CSV file, and answers into one: a line of names, then a line for each pose. No value is checked here."""

import csv
import re
from pathlib import Path

from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError, shorten
from kinetostat.studies.evaluation.columns import Column, PoseColumns, read_columns

LARGEST = 1 << 30
"""Bytes of a file of poses."""
SEPARATORS = (";", "\t", ",")
"""Looked for in this order: where a semicolon separates, a comma is the decimal sign."""
ANSWERS = {"pose", "status", *QUANTITIES}
"""Columns that `kinetostat path` writes beside the poses: its own files are read again without them."""
_HEAD = re.compile(r"(.+?)\s*(?:\[(.*)\]|\((.*)\))?")


def read_poses(machine: Machine, path: Path) -> PoseColumns:
    """Read poses from a CSV file.

    The first line names a field in each column, with the unit in brackets if it is not SI: `x [mm], angle [deg]`.
    Fields that no column names stay as the machine has them. Comma, semicolon or tab separate; lines that begin with #
    are comments. Columns of answers that `kinetostat path` wrote are left out.

    Args:
        machine: whose fields they are.
        path: of the file.

    Raises:
        InputError: the file cannot be read or holds no poses, a column is not a field of the machine, a line is too
            short or too long, or a value is not a number of the right kind.
    """
    lines = _lines(path)
    if len(lines) < 2:
        what = "is empty" if not lines else "names columns, but has no poses below them"
        raise InputError(f'"{path}" {what}; write a line such as x [mm], y [mm], and below it a line for each pose.')
    separator = next((sign for sign in SEPARATORS if sign in lines[0][1]), ",")
    rows = [next(csv.reader([line], delimiter=separator, skipinitialspace=True)) for _, line in lines]
    numbers = [number for number, _ in lines]
    for number, cells in zip(numbers, rows, strict=True):
        if len(cells) != len(rows[0]):
            raise InputError(
                f'"{path}", line {number}: the number of values is {len(cells)}, not {len(rows[0])} as above.'
            )
    heads = [_head(text) for text in rows[0]]
    columns = [
        Column(name, [_decimal(cell, separator) for cell in cells], unit)
        for (name, unit), cells in zip(heads, zip(*rows[1:], strict=True), strict=True)
        if name not in ANSWERS
    ]
    try:
        return read_columns(machine, columns, lambda name, i: f"line {numbers[i + 1]}, column {name}")
    except InputError as error:
        raise InputError(f'"{path}": {error}') from None


def _decimal(cell: str, separator: str) -> str:
    return cell if separator == "," else cell.replace(",", ".")


def _lines(path: Path) -> list[tuple[int, str]]:
    """Return the lines that hold something, each with its number in the file."""
    try:
        with path.open("rb") as stream:
            data = stream.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise InputError(f'"{path}" is larger than 1 GiB; split it into parts.')
        text = data.decode("utf-8-sig")
    except OSError as error:
        raise InputError(f'"{path}" cannot be read: {error.strerror}; give a CSV file of poses.') from None
    except UnicodeDecodeError:
        raise InputError(f'"{path}" is not text; give a CSV file of poses, saved as UTF-8.') from None
    lines = enumerate(text.splitlines(), 1)
    return [(number, line) for number, line in lines if line.strip() and not line.lstrip().startswith("#")]


def _head(text: str) -> tuple[str, str]:
    """Return the name and the unit in a heading, "x [mm]" or "x (mm)"."""
    match = _HEAD.fullmatch(text.strip())
    if match is None:
        raise InputError(f"a column of the poses is called {shorten(text)}; name a field of the machine, e.g. x [mm].")
    return match[1], match[2] or match[3] or ""
