"""The receptance of a tool with its holder, from a CSV file.

The first line names the columns: "frequency [Hz]", and for each entry a real and an imaginary part, such as
"tip.x/tip.x real [um/N]", "tip.x/flange.ry imaginary". Before the slash stands what moves, behind it what is pushed.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array, Complex
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity
from kinetostat.studies.csv_columns import GivenColumn, columns_of
from kinetostat.studies.poses import column_values
from kinetostat.vibration.receptance import FreeTool

_HEAD = re.compile(r"(tip|flange)\.(r?[xyz])\s*/\s*(tip|flange)\.(r?[xyz])\s+(real|imaginary)")
"""The head of a column: what moves, what is pushed, and the part of the number."""
FREQUENCY = "frequency"
"""Name of the column of frequencies."""
KINDS = {(False, False): "linear compliance", (True, True): "torsional compliance"}
"""Kind of an entry by whether a rotation is moved and a moment pushes; all others are rad/N, the same as m/(N·m)."""


class _Side(NamedTuple):
    """A side of an entry, of what moves or of what is pushed: "tip" or "flange", and the number of the component."""

    place: str
    component: int

    def __str__(self) -> str:
        return f"{self.place}.{COMPONENTS[self.component]}"


class _Entry(NamedTuple):
    """An entry of the receptance, as the head of its columns names it."""

    moved: _Side
    pushed: _Side

    def __str__(self) -> str:
        return f"{self.moved}/{self.pushed}"


def read_tool(path: str | Path) -> FreeTool:
    """Read the receptance of a free tool with its holder.

    Entries are symmetric, so that one of each pair is enough; those between components that no column names are zero.

    Args:
        path: path of a CSV file with rising frequencies.

    Raises:
        InputError: the file cannot be read, a column or a frequency is wrong, a part or the flange is missing, or the
            imaginary parts have the sign of a tool that gains energy.
    """
    path = Path(path)
    columns, numbers = columns_of(path)
    try:
        return _tool_of(columns, numbers)
    except InputError as error:
        raise InputError(f'"{path}": {error}') from None


def _tool_of(columns: list[GivenColumn], numbers: list[int]) -> FreeTool:
    """The tool of some columns; `numbers` are those of their lines in the file."""
    parts: dict[tuple[_Entry, str], Array] = {}
    frequencies: Array | None = None
    for column in columns:
        if column.name == FREQUENCY:
            frequencies = _values(column, Quantity("frequency", ""), numbers)
            continue
        match = _HEAD.fullmatch(column.name)
        if match is None:
            raise InputError(
                f"{shorten(column.name)} is not a column of a receptance; write frequency [Hz], or such as "
                f"tip.x/flange.ry real: tip or flange, and one of {', '.join(COMPONENTS)}, on both sides."
            )
        moved, pushed = (_Side(match[k], COMPONENTS.index(match[k + 1])) for k in (1, 3))
        kind = KINDS.get((moved.component < 3, pushed.component < 3), "coupling compliance")
        key = _Entry(moved, pushed), match[5]
        if key in parts:  # the same head with other blanks
            raise InputError(f"{key[0]} has two columns {key[1]}; keep one of them.")
        parts[key] = _values(column, Quantity(kind, ""), numbers)
    if frequencies is None or len(frequencies) < 2:
        raise InputError("it needs a column frequency [Hz] with at least two lines.")
    falling = np.flatnonzero(np.diff(frequencies) <= 0.0)
    if falling.size or frequencies[0] <= 0.0:
        place = int(falling[0]) + 1 if falling.size else 0
        raise InputError(f"line {numbers[place]}: frequencies must rise from line to line, and be above 0; sort them.")
    return _free_tool(frequencies, _entries(parts))


def _values(column: GivenColumn, quantity: Quantity, numbers: list[int]) -> Array:
    """The values of a column, SI; messages name the line of a value by the numbers of the lines."""
    return column_values(column, quantity, lambda name, i: f"line {numbers[i]}, {name}")


def _entries(parts: Mapping[tuple[_Entry, str], Array]) -> dict[_Entry, Complex]:
    """Real and imaginary parts together, each entry also with what moves and what is pushed exchanged.

    Where a file has both of such a pair, each keeps its own numbers.
    """
    entries: dict[_Entry, Complex] = {}
    for entry in dict.fromkeys(entry for entry, _ in parts):
        real, imaginary = (parts.get((entry, part)) for part in ("real", "imaginary"))
        if real is None or imaginary is None:
            missing = "real" if real is None else "imaginary"
            raise InputError(f"{entry} has no column {missing}; add it, with zeros where it is nothing.")
        entries[entry] = real + 1.0j * imaginary
        if entry.moved == entry.pushed and np.median(imaginary) > 0.0:
            raise InputError(
                f"the imaginary parts of {entry} are positive, as of a tool that gains energy; receptances are of "
                "motions exp(+i omega t): change the sign of all imaginary parts."
            )
    return {_Entry(entry.pushed, entry.moved): value for entry, value in entries.items()} | entries


def _free_tool(frequencies: Array, entries: Mapping[_Entry, Complex]) -> FreeTool:
    """The tool with these entries, of which none may lack what couples it to the machine.

    Raises:
        InputError: a component that moves has no entry of its own or, at the tip, none with the flange.
    """
    sides = sorted({entry.moved for entry in entries})
    tip, flange = ([side for side in sides if side.place == place] for place in ("tip", "flange"))
    for side in (*tip, *flange):
        if _Entry(side, side) not in entries:
            raise InputError(f"{side}/{side} is missing; a tool that moves there must say how it does.")
        if side in tip and not any(_Entry(side, pushed) in entries for pushed in flange):
            component = COMPONENTS[side.component]
            raise InputError(f"nothing says how {side} moves if the flange is pushed; add {side}/flange.{component}.")
    if not tip:
        raise InputError("no column is about the tip; add tip.x/tip.x real and imaginary, say.")

    def matrix(moved: list[_Side], pushed: list[_Side]) -> Complex:
        """Entries between components [frequencies x moved x pushed]; 0 where the file names none."""
        zeros = np.zeros(len(frequencies), dtype=complex)
        rows = [[entries.get(_Entry(row, column), zeros) for column in pushed] for row in moved]
        return np.moveaxis(np.array(rows), 2, 0)

    return FreeTool(
        frequencies=frequencies,
        tip=tuple(side.component for side in tip),
        flange=tuple(side.component for side in flange),
        tip_tip=matrix(tip, tip),
        tip_flange=matrix(tip, flange),
        flange_flange=matrix(flange, flange),
    )
