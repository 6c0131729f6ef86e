"""Columns of poses, whatever they came from, to SI numbers by field; every value is checked. Nothing is evaluated."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.machine.machine import Machine
from kinetostat.machine.orientation import ANGLE, ANGLES, PURE, angles_of, from_parts, numbers_for, part_of
from kinetostat.machine.parameters import Parameter, find
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity, quantities
from kinetostat.units import UnitError, parse

MOST_POSES = 5_000_000
"""Poses whose answers fit in memory: a dozen quantities of them take half a gigabyte."""


@dataclass(frozen=True)
class Column:
    """A column as it was given.

    Attributes:
        name: of the field, as written.
        entries: numbers, or texts with a unit.
        unit: of numbers; SI where it is empty.
    """

    name: str
    entries: Any
    unit: str = ""


@dataclass(frozen=True)
class PoseColumns:
    """Poses, all values in SI.

    Attributes:
        fields: that were given, in order.
        values: of each of these fields [poses].
        labels: further columns that belong to the poses, as a time; by name.
    """

    fields: tuple[Parameter, ...]
    values: tuple[Array, ...]
    labels: Mapping[str, Any]

    @property
    def leaves(self) -> dict[str, Array]:
        """Values by leaf path: a field that stands for several entries gives all of them its value."""
        pairs = zip(self.fields, self.values, strict=True)
        return {leaf: values for field, values in pairs for leaf in field.leaves}

    @property
    def count(self) -> int:
        """How many poses there are."""
        return len(self.values[0])


Where = Callable[[str, int], str]
"""From the name of a column and the number of a pose, from 0, to the words for that place."""


def read_columns(
    machine: Machine, columns: Sequence[Column], where: Where, labels: Mapping[str, Any] | None = None
) -> PoseColumns:
    """Read columns: find their fields, convert and check every value.

    Args:
        machine: whose fields they are.
        columns: all of one length, or of length one. Orientations may be columns of a quaternion, a rotation matrix or
            a tilt, as `quaternion.w`; they become roll, pitch and yaw.
        where: says in messages where a value stands.
        labels: further columns of the poses.

    Raises:
        InputError: no column, an unknown field or one twice, columns of several lengths, no pose, or a value that is
            not finite, of another kind or not allowed.
    """
    if not columns:
        raise InputError("poses has no columns; name the field that each column holds, e.g. x.")
    columns = _with_angles(machine, columns, where)
    fields = [_field(machine, column.name) for column in columns]
    given = [leaf for field in fields for leaf in field.leaves]
    for leaf in given:
        if given.count(leaf) > 1:
            raise InputError(f"{leaf} is given by two columns of the poses; remove one of them.")
    pairs = list(zip(columns, fields, strict=True))
    values = [_values(column, field.quantity, where) for column, field in pairs]
    lengths = dict.fromkeys(len(array) for array in values)
    count = max(lengths)
    if set(lengths) - {1, count}:
        shown = ", ".join(f"{column.name} {len(array)}" for column, array in zip(columns, values, strict=True))
        raise InputError(f"the columns of the poses have several lengths ({shown}); give each one value for each pose.")
    if min(lengths) == 0:
        raise InputError("poses has no rows; give at least one pose.")
    if count > MOST_POSES:
        raise InputError(
            f"there are {count:,} poses, and at most {MOST_POSES:,} are evaluated at once; evaluate them in parts."
        )
    return PoseColumns(tuple(fields), tuple(np.broadcast_to(array, count) for array in values), labels or {})


def _with_angles(machine: Machine, columns: Sequence[Column], where: Where) -> Sequence[Column]:
    """Return the columns with roll, pitch and yaw in the place of those of a quaternion, a matrix or a tilt."""
    parts: dict[str, dict[str, Array]] = {}
    others = []
    for column in columns:
        form, part = part_of(column.name)
        if not form:
            others.append(column)
            continue
        if part in parts.setdefault(form, {}):
            raise InputError(f"{form}.{part} is given by two columns of the poses; remove one of them.")
        parts[form][part] = _values(column, ANGLE if form == "tilt" else PURE, where)
    if not parts:
        return columns
    given = {column.name: column for column in others} | {form: from_parts(form, parts[form]) for form in parts}
    named = numbers_for(quantities(machine.family.tables["pose"]), given, angles_of)
    return [*others, *(Column(name, named[name]) for name in ANGLES)]


def _field(machine: Machine, name: object) -> Parameter:
    if not isinstance(name, str):
        raise InputError(f"a column of the poses is called {shorten(name)}; name a field of the machine, e.g. x.")
    try:
        return find(machine.family, name)
    except InputError as error:
        raise InputError(f"in the columns of the poses, {error}") from None


def _values(column: Column, quantity: Quantity, where: Where) -> Array:
    """Return the values of a column in SI."""
    values = _numbers(column, quantity)
    if values is None:
        entries = _entries(column).tolist()
        values = np.array([_entry(column, entry, quantity, where(column.name, i)) for i, entry in enumerate(entries)])
    # Allowed values form an interval, so that the extremes and whatever is not finite decide for all.
    suspects = [*np.flatnonzero(~np.isfinite(values))[:1], *([values.argmin(), values.argmax()] if values.size else [])]
    for i in suspects:
        _check(float(values[i]), quantity, where(column.name, int(i)))
    return values


def _numbers(column: Column, quantity: Quantity) -> Array | None:
    """Return the values of a column of plain numbers, SI; None where there is anything else in it."""
    entries = _entries(column)
    if entries.dtype.kind not in "iufUS":
        return None
    try:
        return entries.astype(float) * (parse(f"1 {column.unit}", quantity.kind) if column.unit else 1.0)
    except ValueError:  # text with a unit, or no number
        return None


def _entries(column: Column) -> Any:
    try:
        entries = np.atleast_1d(np.asarray(column.entries))
    except ValueError:  # rows of several lengths
        entries = np.empty((0, 0))
    if entries.ndim > 1:
        raise InputError(f"column {column.name} of the poses has several columns; give one value for each pose.")
    return entries


def _entry(column: Column, entry: Any, quantity: Quantity, place: str) -> float:
    """Return one value in SI: a number in the column's unit, or text with a unit of its own."""
    text = entry.strip() if isinstance(entry, str) else entry
    if isinstance(text, str) and column.unit and text and text[-1].isdecimal():
        text = f"{text} {column.unit}"
    try:
        return parse(text, quantity.kind)
    except UnitError as error:
        raise InputError(f"{place} is {shorten(entry)}: {error}.") from None


def _check(value: float, quantity: Quantity, place: str) -> None:
    if not np.isfinite(value):
        raise InputError(f"{place} is {value:g}, which is not a finite number; give a number, or remove the pose.")
    try:
        quantity.check(value)
    except UnitError as error:
        raise InputError(f"{place} is {quantity.show(value)}: {error}.") from None
