"""Columns of tables as they were given, and CSV files as columns of texts. No machine is known here.

Comma, semicolon or tab separate the columns of a file; lines that begin with # are comments.
"""

import csv
import re
from collections import Counter
from pathlib import Path
from typing import Any

from kinetostat.frozen import dataclass
from kinetostat.spec.errors import InputError, shorten

MOST_GIVEN_POSES = 5_000_000
"""Poses whose answers fit in memory: a dozen quantities of them take half a gigabyte."""
LARGEST_POSE_FILE = 1 << 30
"""Bytes of a file of poses, 1 GiB: the text is kept in memory, in several copies."""
MOST_POSE_COLUMNS = 1000
"""Columns of a file of poses, several times the fields of a machine."""
SEPARATORS = (";", "\t", ",")
"""Signs between columns, in the order in which they are looked for: beside a semicolon, a comma is the decimal sign."""
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\x85\u2028\u2029]")
"""Control characters. Python drops some of them from a number, and takes others for the end of a line."""
_HEAD = re.compile(r"(.+?)\s*(?:\[(.*)\]|\((.*)\))?")
"""The head of a column: its name, and a unit in brackets of either kind."""


@dataclass(frozen=True)
class GivenColumn:
    """A column as it was given.

    Attributes:
        name: name of the field, as written.
        entries: numbers, or texts with a unit.
        unit: unit of the numbers; SI where it is empty.
    """

    name: str
    entries: Any
    unit: str = ""


def columns_of(
    path: Path, most: int = MOST_GIVEN_POSES, text: str | None = None
) -> tuple[list[GivenColumn], list[int]]:
    """Read a CSV file: its columns as texts with the units of their heads, and the numbers of the lines below these.

    Args:
        path: path of the file.
        most: lines below the heads that it may have.
        text: text of the file, where it is known; the path then only names it in messages.

    Raises:
        InputError: the file cannot be read or holds no lines below its heads, it has too many lines or columns, or a
            line is too short or too long.
    """
    lines = _lines_with_text(path, _text_of_file(path) if text is None else text)
    if len(lines) < 2:
        what = "is empty" if not lines else "names columns, but has no poses below them"
        raise InputError(f'"{path}" {what}; write a line such as x [mm], y [mm], and below it a line for each pose.')
    separator = next((sign for sign in SEPARATORS if sign in lines[0][1]), ",")
    width = lines[0][1].count(separator) + 1
    for count, bound, what in ((len(lines) - 1, most, "poses"), (width, MOST_POSE_COLUMNS, "columns")):
        if count > bound:
            raise InputError(f'"{path}" has {count:,} {what}, and may have at most {bound:,}; leave some out.')
    cells_of_head, *cells_of_lines = (_cells(path, number, line, separator) for number, line in lines)
    numbers = [number for number, _ in lines[1:]]
    for number, cells in zip(numbers, cells_of_lines, strict=True):
        if len(cells) != len(cells_of_head):
            raise InputError(
                f'"{path}", line {number}: the number of values is {len(cells)}, not {len(cells_of_head)} as above.'
            )
    heads = [_name_and_unit(path, cell) for cell in cells_of_head]
    repeated = next((name for name, times in Counter(name for name, _ in heads).items() if times > 1), None)
    if repeated is not None:
        raise InputError(f'"{path}": several columns are called {shorten(repeated)}; keep one of them.')
    columns = [
        GivenColumn(name, [_decimal(cell, separator) for cell in cells], unit)
        for (name, unit), cells in zip(heads, zip(*cells_of_lines, strict=True), strict=True)
    ]
    return columns, numbers


def _cells(path: Path, number: int, line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error as error:
        raise InputError(f'"{path}", line {number} cannot be read: {error}; correct it, or remove it.') from None


def _decimal(cell: str, separator: str) -> str:
    """A cell with a point as its decimal sign: a comma is one where it does not separate columns."""
    return cell if separator == "," else cell.replace(",", ".")


def _text_of_file(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            data = stream.read(LARGEST_POSE_FILE + 1)
    except OSError as error:
        raise InputError(f'"{path}" cannot be read: {error.strerror}; give a CSV file of poses.') from None
    except ValueError:
        raise InputError(f'"{path}" cannot be read: it has a null character; give a CSV file of poses.') from None
    if len(data) > LARGEST_POSE_FILE:
        raise InputError(f'"{path}" is larger than 1 GiB; split it into parts.')
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f'"{path}" is not text; give a CSV file of poses, saved as UTF-8.') from None


def _lines_with_text(path: Path, text: str) -> list[tuple[int, str]]:
    """Return the lines that hold something, each with its number in the file."""
    control = _CONTROL.search(text)
    if control is not None:
        line = text.count("\n", 0, control.start()) + 1
        raise InputError(
            f'"{path}", line {line} has the control character {control[0]!r}, which no number and no name has; remove '
            "it, or save the file as CSV again."
        )
    lines = enumerate(text.splitlines(), 1)
    return [(number, line) for number, line in lines if line.strip() and not line.lstrip().startswith("#")]


def _name_and_unit(path: Path, text: str) -> tuple[str, str]:
    """Return the name and the unit in a heading, "x [mm]" or "x (mm)"."""
    match = _HEAD.fullmatch(text.strip())
    if match is None:
        raise InputError(f'"{path}": a column is called {shorten(text)}; write its name, with a unit, e.g. x [mm].')
    return match[1], match[2] or match[3] or ""
