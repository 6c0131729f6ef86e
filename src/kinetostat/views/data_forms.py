"""Answers as plain data, CSV and NetCDF, made of the fields of their description. Nothing is computed, all is SI."""

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinetostat.algebra.screw import Screw
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import AnyArray, Codes
from kinetostat.kinematics.status import Status
from kinetostat.late import LateModule
from kinetostat.spec.renamed import RENAMED, with_former_keys
from kinetostat.views.question import Axis, Description, Field, Records

if TYPE_CHECKING:
    import h5netcdf
    import h5py
else:  # both take long to load
    h5netcdf = LateModule("h5netcdf")
    h5py = LateModule("h5py")


class NetcdfVariable(NamedTuple):
    """A variable of NetCDF: the name of its axis or the names of its axes, its values, and its attributes."""

    axes: str | Sequence[str]
    values: Any
    attributes: Mapping[str, str]


class NumberColumn(NamedTuple):
    """A column of numbers: the unit of its values, SI, and the values."""

    unit: str
    values: Any


def as_answer(data: dict[str, Any]) -> dict[str, Any]:
    """Turn an answer into plain data, in which the keys of the version before stand beside those of today."""
    return {key: plain(value) for key, value in with_former_keys(data, RENAMED["JSON key"]).items()}


def plain(value: Any) -> Any:
    """Turn a value into plain data.

    Numbers that are infinite or not a number become null, arrays and tuples become lists, vectors lists of three
    numbers, and dataclasses dictionaries of their fields; the keys of dictionaries become texts.

    Args:
        value: dictionaries, sequences, arrays, dataclasses and scalars, nested to any depth.
    """
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, np.ndarray):
        return _nested_lists(value)
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, Vector | Screw):
        return plain(value.components())
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    return value


def _nested_lists(values: AnyArray) -> Any:
    """Return an array as nested lists, null where it is not finite; at once, since grids have millions of numbers."""
    if values.dtype.kind != "f":
        return values.tolist()
    entries = values.astype(object)
    entries[~np.isfinite(values)] = None
    return entries.tolist()


def finite_or_none(value: float) -> float | None:
    """Return a number for files, in which None stands for what has no end or is not known."""
    return value if math.isfinite(value) else None


def status_words(codes: Codes) -> list[str]:
    """Return the statuses of poses in words."""
    return [Status(code).word for code in codes.tolist()]


def column_head(name: str, unit: str) -> str:
    """Return the head of a column of numbers in a CSV file, "x [m]"; a number without a unit has its name alone."""
    return f"{name} [{unit}]" if unit not in ("", "1") else name


def with_heads(columns: Mapping[str, NumberColumn]) -> dict[str, Any]:
    """Return the values of columns by their heads in a CSV file."""
    return {column_head(name, unit): values for name, (unit, values) in columns.items()}


def stiffness_of_spring(stiffness: float | None) -> float | str | None:
    """Return a spring's stiffness as machine files write it: infinity is "rigid"."""
    return "rigid" if stiffness is not None and math.isinf(stiffness) else stiffness


def no_formula(text: str) -> str:
    """Return a name with an apostrophe before it where a spreadsheet would take it for a formula and compute it."""
    return f"'{text}" if text.lstrip()[:1] in ("=", "+", "-", "@") else text


def columns_csv(columns: Mapping[str, Iterable[Any]]) -> str:
    """Write columns of equal length as CSV, heads first; a cell is empty where a number is not known (NaN).

    Texts that a spreadsheet would take for a formula have an apostrophe before them.
    """
    heads = [no_formula(head) for head in columns]
    return csv_text(heads, (map(_cell, row) for row in zip(*columns.values(), strict=True)))


def csv_text(heads: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    """Write rows of cells as CSV below a row of heads."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(rows)
    return text.getvalue()


def _cell(value: Any) -> Any:
    if isinstance(value, str):
        return no_formula(value)
    if isinstance(value, float | np.floating):
        return "" if math.isnan(value) else float(value)
    return value


def json_of(description: Description, answer: Any) -> dict[str, Any]:
    """Return an answer as plain data: a key for each field, a list of objects for records."""
    return as_answer(_object(description.fields, answer))


def _object(fields: Sequence[Field | Records], item: Any) -> dict[str, Any]:
    """Return the keys and values of the fields that JSON has."""
    result: dict[str, Any] = {}
    for part in fields:
        if "json" not in part.forms:
            continue
        if isinstance(part, Records):
            result[part.key] = [_object(part.fields, record) for record in part.of(item)]
        elif (value := part.of(item)) is not None or not part.optional:
            result[part.key] = value
    return result


def csv_of(description: Description, answer: Any) -> str:
    """Return the first records of an answer as CSV: a row for each, numbered from 1.

    Names that a spreadsheet would take for a formula have an apostrophe before them, and a cell is empty where a number
    is not known (NaN), as in `columns_csv`.
    """
    records = next(part for part in description.fields if isinstance(part, Records) and "csv" in part.forms)
    shown, items = [part for part in records.fields if "csv" in part.forms], records.of(answer)
    entries = {part.key: _entries(part, items) for part in shown}
    heads = [head for part in shown for head in _heads(part, entries[part.key])]
    rows = (
        [number, *(cell for part in shown for cell in _cells(part, item, entries[part.key]))]
        for number, item in enumerate(items, 1)
    )
    return csv_text([records.axis, *heads], rows)


def _entries(part: Field, items: Sequence[Any]) -> list[str] | None:
    """Return the names of the entries of a mapping, of all records together; None for a field that is not one."""
    values = [part.of(item) for item in items]
    mappings = [value for value in values if isinstance(value, Mapping)]
    return list(dict.fromkeys(str(name) for value in mappings for name in value)) if mappings else None


def _heads(part: Field, entries: Sequence[str] | None) -> list[str]:
    if entries is None:
        return [part.name]
    return list(entries) if part.column == "*" else [f"{part.name}_{name}" for name in entries]


def _cells(part: Field, item: Any, entries: Sequence[str] | None) -> list[Any]:
    value = part.of(item)
    cells = [value] if entries is None else [value.get(name) for name in entries]
    return [_cell(cell) for cell in cells]


def netcdf_of(description: Description, answer: Any) -> bytes:
    """Return an answer as NetCDF-4: arrays over their axes, and the records, one along an axis of their own.

    Axes are those of the description, and of records their numbers from 1 and the names of mappings. The file is as
    xarray would write it, which takes three times as long to import as to write.
    """
    coordinates: dict[str, NetcdfVariable] = {
        axis.name: NetcdfVariable(axis.name, np.asarray(Field(axis.name, axis.take).of(answer)), _attributes_of(axis))
        for axis in description.axes
    }
    variables: dict[str, NetcdfVariable] = {}
    for part in description.fields:
        if "nc" not in part.forms:
            continue
        if isinstance(part, Records):
            _add_records(part, part.of(answer), variables, coordinates)
        elif part.axes:
            variables[part.name] = NetcdfVariable(part.axes, part.of(answer), _attributes_of(part))
    memory = io.BytesIO()
    with h5netcdf.File(memory, "w") as file:
        file.attrs.update(machine=answer.machine.name, reference=answer.machine.reference)
        for name, variable in (variables | coordinates).items():
            _write_variable(file, name, variable)
    return memory.getvalue()


def _write_variable(file: Any, name: str, variable: NetcdfVariable) -> None:
    """Write a variable as xarray would: texts of any length, flags as bytes that say so, NaN for missing numbers."""
    axes, values = variable.axes, np.asarray(variable.values)
    axes = (axes,) if isinstance(axes, str) else tuple(axes)
    for axis, size in zip(axes, values.shape, strict=True):
        if axis not in file.dimensions:
            file.dimensions[axis] = size
    kind = values.dtype.kind
    dtype = {"U": h5py.string_dtype(), "b": np.dtype("i1")}.get(kind, values.dtype)
    written = file.create_variable(name, axes, dtype, fillvalue=np.nan if kind == "f" else None)
    written[...] = values.astype(object) if kind == "U" else values.astype(dtype)
    written.attrs.update({**variable.attributes, **({"dtype": "bool"} if kind == "b" else {})})


def _add_records(
    records: Records, items: Sequence[Any], variables: dict[str, NetcdfVariable], coordinates: dict[str, NetcdfVariable]
) -> None:
    """Add a variable for each field of records, and the axes that they need."""
    coordinates[records.axis] = NetcdfVariable(records.axis, np.arange(1, len(items) + 1), {})
    for part in records.fields:
        if "nc" not in part.forms:
            continue
        values = [part.of(item) for item in items]
        names = _entries(part, items)
        if names is None:
            numbers = np.asarray([_scalar(value) for value in values])
            variables[part.name] = NetcdfVariable(records.axis, numbers, _attributes_of(part))
        else:
            (axis,) = part.axes
            coordinates[axis] = NetcdfVariable(axis, names, {})
            rows = [[value.get(name, 0.0) for name in names] for value in values]
            variables[part.name] = NetcdfVariable(
                (records.axis, axis), np.asarray(rows, dtype=float), _attributes_of(part)
            )


def _scalar(value: Any) -> Any:
    """Return a number as it is, a missing one as NaN, anything else as text."""
    return value if isinstance(value, bool | Real) else np.nan if value is None else str(value)


def _attributes_of(part: Field | Axis) -> dict[str, str]:
    """Return unit and meaning as attributes of NetCDF, those that there are."""
    return {name: text for name, text in (("units", part.unit), ("long_name", part.long_name)) if text}
