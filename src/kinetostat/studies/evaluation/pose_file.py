"""Poses from a CSV file, and answers into one: a line of names, then a line for each pose. No value is checked here."""

import csv
import re
from collections import Counter
from pathlib import Path

from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError, shorten
from kinetostat.studies.evaluation.columns import MOST_POSES, Column, PoseColumns, read_columns

LARGEST = 1 << 30
"""Bytes of a file of poses."""
MOST_COLUMNS = 1000
SEPARATORS = (";", "\t", ",")
"""Looked for in this order: where a semicolon separates, a comma is the decimal sign."""
ANSWERS = {"pose", "status", *QUANTITIES}
"""Columns that `kinetostat path` writes beside the poses: its own files are read again without them."""
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\x85\u2028\u2029]")
"""Control characters. Python drops some of them from a number, and takes others for the end of a line."""
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
    columns, numbers = columns_of(path)
    columns = [column for column in columns if column.name not in ANSWERS]
    try:
        return read_columns(machine, columns, lambda name, i: f"line {numbers[i]}, column {name}")
    except InputError as error:
        raise InputError(f'"{path}": {error}') from None


def columns_of(path: Path, most: int = MOST_POSES) -> tuple[list[Column], list[int]]:
    """Read the columns of a CSV file as texts with the units of their heads, and the number of each line below these.

    Args:
        path: of the file.
        most: lines below the heads that it may have.

    Raises:
        InputError: the file cannot be read or holds no lines below its heads, it has too many lines or columns, or a
            line is too short or too long.
    """
    lines = _lines(path)
    if len(lines) < 2:
        what = "is empty" if not lines else "names columns, but has no poses below them"
        raise InputError(f'"{path}" {what}; write a line such as x [mm], y [mm], and below it a line for each pose.')
    separator = next((sign for sign in SEPARATORS if sign in lines[0][1]), ",")
    wide = lines[0][1].count(separator) + 1
    for count, bound, what in ((len(lines) - 1, most, "poses"), (wide, MOST_COLUMNS, "columns")):
        if count > bound:
            raise InputError(f'"{path}" has {count:,} {what}, and may have at most {bound:,}; leave some out.')
    rows = [_cells(path, number, line, separator) for number, line in lines]
    numbers = [number for number, _ in lines]
    for number, cells in zip(numbers, rows, strict=True):
        if len(cells) != len(rows[0]):
            raise InputError(
                f'"{path}", line {number}: the number of values is {len(cells)}, not {len(rows[0])} as above.'
            )
    heads = [_head(path, text) for text in rows[0]]
    twice = next((name for name, times in Counter(name for name, _ in heads).items() if times > 1), None)
    if twice is not None:
        raise InputError(f'"{path}": several columns are called {shorten(twice)}; keep one of them.')
    columns = [
        Column(name, [_decimal(cell, separator) for cell in cells], unit)
        for (name, unit), cells in zip(heads, zip(*rows[1:], strict=True), strict=True)
    ]
    return columns, numbers[1:]


def _cells(path: Path, number: int, line: str, separator: str) -> list[str]:
    """The cells of a line."""
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error as error:
        raise InputError(f'"{path}", line {number} cannot be read: {error}; correct it, or remove it.') from None


def _decimal(cell: str, separator: str) -> str:
    return cell if separator == "," else cell.replace(",", ".")


def _lines(path: Path) -> list[tuple[int, str]]:
    """Return the lines that hold something, each with its number in the file."""
    try:
        with path.open("rb") as stream:
            data = stream.read(LARGEST + 1)
    except OSError as error:
        raise InputError(f'"{path}" cannot be read: {error.strerror}; give a CSV file of poses.') from None
    except ValueError:
        raise InputError(f'"{path}" cannot be read: it has a null character; give a CSV file of poses.') from None
    if len(data) > LARGEST:
        raise InputError(f'"{path}" is larger than 1 GiB; split it into parts.')
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f'"{path}" is not text; give a CSV file of poses, saved as UTF-8.') from None
    control = _CONTROL.search(text)
    if control is not None:
        line = text.count("\n", 0, control.start()) + 1
        raise InputError(
            f'"{path}", line {line} has the control character {control[0]!r}, which no number and no name has; remove '
            "it, or save the file as CSV again."
        )
    lines = enumerate(text.splitlines(), 1)
    return [(number, line) for number, line in lines if line.strip() and not line.lstrip().startswith("#")]


def _head(path: Path, text: str) -> tuple[str, str]:
    """Return the name and the unit in a heading, "x [mm]" or "x (mm)"."""
    match = _HEAD.fullmatch(text.strip())
    if match is None:
        raise InputError(f'"{path}": a column is called {shorten(text)}; write its name, with a unit, e.g. x [mm].')
    return match[1], match[2] or match[3] or ""
