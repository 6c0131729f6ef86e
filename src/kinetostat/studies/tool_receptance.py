"""The receptance of a tool with its holder, from a CSV file.

The first line names the columns: "frequency [Hz]", and for each entry a real and an imaginary part, such as
"tip.x/tip.x real [um/N]", "tip.x/flange.ry imaginary". Before the slash stands what moves, behind it what is pushed.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TypeAlias

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array, Complex
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity
from kinetostat.studies.poses import GivenColumn, column_values, columns_of
from kinetostat.vibration.receptance import FreeTool

_HEAD = re.compile(r"(tip|flange)\.(r?[xyz])\s*/\s*(tip|flange)\.(r?[xyz])\s+(real|imaginary)")
"""The head of a column: what moves, what is pushed, and the part of the number."""
FREQUENCY = "frequency"
"""Name of the column of frequencies."""
KINDS = {(False, False): "linear compliance", (True, True): "torsional compliance"}
"""Kind of an entry by whether a rotation is moved and a moment pushes; all others are rad/N, the same as m/(N·m)."""

Key: TypeAlias = tuple[str, int, str, int]
"""Place and component that move, then place and component of the force."""


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
    parts: dict[tuple[Key, str], Array] = {}
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
        moved, pushed = COMPONENTS.index(match[2]), COMPONENTS.index(match[4])
        kind = KINDS.get((moved < 3, pushed < 3), "coupling compliance")
        parts[(match[1], moved, match[3], pushed), match[5]] = _values(column, Quantity(kind, ""), numbers)
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


def _entries(parts: Mapping[tuple[Key, str], Array]) -> dict[Key, Complex]:
    """Real and imaginary parts together, each entry also with what moves and what is pushed exchanged."""
    entries: dict[Key, Complex] = {}
    for key in dict.fromkeys(key for key, _ in parts):
        text = f"{key[0]}.{COMPONENTS[key[1]]}/{key[2]}.{COMPONENTS[key[3]]}"
        real, imaginary = (parts.get((key, part)) for part in ("real", "imaginary"))
        if real is None or imaginary is None:
            missing = "real" if real is None else "imaginary"
            raise InputError(f"{text} has no column {missing}; add it, with zeros where it is nothing.")
        entries[key] = real + 1.0j * imaginary
        if key[:2] == key[2:] and np.median(imaginary) > 0.0:
            raise InputError(
                f"the imaginary parts of {text} are positive, as of a tool that gains energy; receptances are of "
                "motions exp(+i omega t): change the sign of all imaginary parts."
            )
    return {(*key[2:], *key[:2]): value for key, value in entries.items()} | entries


def _free_tool(frequencies: Array, entries: Mapping[Key, Complex]) -> FreeTool:
    places = {place: sorted({key[1] for key in entries if key[0] == place}) for place in ("tip", "flange")}
    for place, components in places.items():
        for component in components:
            name = f"{place}.{COMPONENTS[component]}"
            if (place, component, place, component) not in entries:
                raise InputError(f"{name}/{name} is missing; a tool that moves there must say how it does.")
            if place == "tip" and not any((place, component, "flange", part) in entries for part in places["flange"]):
                raise InputError(
                    f"nothing says how {name} moves if the flange is pushed; add {name}/flange.{name[4:]}."
                )
    if not places["tip"]:
        raise InputError("no column is about the tip; add tip.x/tip.x real and imaginary, say.")

    def matrix(moved: str, pushed: str) -> Complex:
        zeros = np.zeros(len(frequencies), dtype=complex)
        rows = [[entries.get((moved, i, pushed, k), zeros) for k in places[pushed]] for i in places[moved]]
        return np.moveaxis(np.array(rows), 2, 0)

    return FreeTool(
        frequencies=frequencies,
        tip=tuple(places["tip"]),
        flange=tuple(places["flange"]),
        tip_tip=matrix("tip", "tip"),
        tip_flange=matrix("tip", "flange"),
        flange_flange=matrix("flange", "flange"),
    )
