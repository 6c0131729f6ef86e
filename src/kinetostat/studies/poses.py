"""Poses from outside: tables of Python programs, CSV files and ranges, as SI numbers by field. Nothing is evaluated.

Whatever they come from, they become columns, of which every value is checked in one place (`read_columns`). Tables of
pandas, polars and xarray are read by what they can do, so that none of these libraries need be there.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.points import Axis, Grid
from kinetostat.equilibrium.state import MachineState
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.machine.orientation import ANGLE, ANGLES, COMPONENT, angles_of, from_parts, numbers_for, part_of
from kinetostat.machine.parameters import POSE, Parameter, find, parameters
from kinetostat.spec.arguments import as_list
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity, Range, parse_range, quantities
from kinetostat.studies.csv_columns import MOST_GIVEN_POSES, GivenColumn, columns_of
from kinetostat.units import UnitError, parse

MOST_DIMENSIONS = 6
"""Axes of one grid: a pose has six coordinates."""
POSE_FORMS = (
    "give a DataFrame or a dictionary with a column for each field that changes, an array with a column for each "
    "coordinate of the pose, an xarray Dataset, or the path of a CSV file"
)
"""The end of messages about poses in no form that is read."""
MOST_MACHINE_LENGTHS = 50.0
"""Characteristic lengths of a machine beyond which no coordinate of its pose is: a mm is a thousandth of a m."""
ANSWERS = {"pose", "status", *QUANTITIES}
"""Columns that `kinetostat path` writes beside the poses: its own files are read again without them."""


@dataclass(frozen=True)
class PoseColumns:
    """Poses, all values in SI.

    Attributes:
        fields: the given fields, in order.
        values: values of each of the fields [poses].
        labels: further columns that belong to the poses, such as a time, by name.
        unit_doubt: a sentence where numbers of a file that have no unit seem to be mm or deg, which answers give where
            the poses have none; empty if nothing is doubtful.
    """

    fields: tuple[Parameter, ...]
    values: tuple[Array, ...]
    labels: Mapping[str, Any]
    unit_doubt: str = ""

    @property
    def leaves(self) -> dict[str, Array]:
        """Values by leaf path: a field that stands for several entries gives all of them its value."""
        pairs = zip(self.fields, self.values, strict=True)
        return {leaf: values for field, values in pairs for leaf in field.leaves}

    @property
    def count(self) -> int:
        """Number of poses."""
        return len(self.values[0])


Where = Callable[[str, int], str]
"""From the name of a column and the number of a pose, from 0, to the words for that place."""


def read_columns(
    machine: Machine, columns: Sequence[GivenColumn], where: Where, labels: Mapping[str, Any] | None = None
) -> PoseColumns:
    """Read columns: find their fields, convert and check every value.

    Args:
        machine: the machine whose fields they are.
        columns: the columns, all of one length, or of length one. Orientations may be columns of a quaternion, a
            rotation matrix or a tilt, as `quaternion.w`; they become roll, pitch and yaw.
        where: a function that says in messages where a value stands.
        labels: further columns of the poses.

    Raises:
        InputError: no column, an unknown field or one twice, columns of several lengths, no pose, or a value that is
            not finite, of another kind or not allowed.
    """
    if not columns:
        raise InputError("poses has no columns; name the field that each column holds, e.g. x.")
    columns = _with_angles(machine, columns, where)
    fields = [_field_of_column(machine, column.name) for column in columns]
    if leaf := repeated_leaf(fields):
        raise InputError(f"{leaf} is given by two columns of the poses; remove one of them.")
    pairs = list(zip(columns, fields, strict=True))
    values = [column_values(column, field.quantity, where) for column, field in pairs]
    lengths = dict.fromkeys(len(array) for array in values)
    count = max(lengths)
    if set(lengths) - {1, count}:
        shown = ", ".join(f"{column.name} {len(array)}" for column, array in zip(columns, values, strict=True))
        raise InputError(f"the columns of the poses have several lengths ({shown}); give each one value for each pose.")
    if min(lengths) == 0:
        raise InputError("poses has no rows; give at least one pose.")
    if count > MOST_GIVEN_POSES:
        raise InputError(
            f"there are {count:,} poses, and at most {MOST_GIVEN_POSES:,} are evaluated at once; evaluate them in "
            "parts."
        )
    return PoseColumns(tuple(fields), tuple(np.broadcast_to(array, count) for array in values), labels or {})


def _with_angles(machine: Machine, columns: Sequence[GivenColumn], where: Where) -> Sequence[GivenColumn]:
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
        parts[form][part] = column_values(column, ANGLE if form == "tilt" else COMPONENT, where)
    if not parts:
        return columns
    entries = {column.name: column for column in others} | {form: from_parts(form, parts[form]) for form in parts}
    named = numbers_for(quantities(machine.family.tables["pose"]), entries, angles_of)
    return [*others, *(GivenColumn(name, named[name]) for name in ANGLES)]


def _field_of_column(machine: Machine, name: object) -> Parameter:
    if not isinstance(name, str):
        raise InputError(f"a column of the poses is called {shorten(name)}; name a field of the machine, e.g. x.")
    try:
        return find(machine.family, name)
    except InputError as error:
        raise InputError(
            f"in the columns of the poses, {error} An orientation may also stand in columns such as quaternion.w, "
            "rotation.1.1 and tilt.angle, see docs/poses.md."
        ) from None


def column_values(column: GivenColumn, quantity: Quantity, where: Where) -> Array:
    """Return the values of a column in SI.

    Raises:
        InputError: a value is not finite, of another kind or not allowed.
    """
    values = _plain_numbers(column, quantity)
    if values is None:
        entries = _entries_of(column).tolist()
        values = np.array(
            [_value_of_entry(column, entry, quantity, where(column.name, i)) for i, entry in enumerate(entries)]
        )
    # Allowed values form an interval, so that the extremes and whatever is not finite decide for all.
    extremes = [values.argmin(), values.argmax()] if values.size else []
    for i in [*np.flatnonzero(~np.isfinite(values))[:1], *extremes]:
        _check_value(float(values[i]), quantity, where(column.name, int(i)))
    return values


def _plain_numbers(column: GivenColumn, quantity: Quantity) -> Array | None:
    """Return the values of a column of plain numbers, SI; None where there is anything else in it."""
    entries = _entries_of(column)
    if entries.dtype.kind not in "iufUS":
        return None
    try:
        return entries.astype(float) * (parse(f"1 {column.unit}", quantity.kind) if column.unit else 1.0)
    except ValueError:  # text with a unit, or no number
        return None


def _entries_of(column: GivenColumn) -> Any:
    """The entries of a column as an array of one dimension; a single value is a column of length one."""
    try:
        entries = np.atleast_1d(np.asarray(column.entries))
    except ValueError:  # rows of several lengths
        entries = np.empty((0, 0))
    if entries.ndim > 1:
        raise InputError(f"column {column.name} of the poses has several columns; give one value for each pose.")
    return entries


def _value_of_entry(column: GivenColumn, entry: Any, quantity: Quantity, place: str) -> float:
    """Return one value in SI: a number in the column's unit, or text with a unit of its own."""
    text = entry.strip() if isinstance(entry, str) else entry
    if isinstance(text, str) and column.unit and text and text[-1].isdecimal():
        text = f"{text} {column.unit}"
    try:
        return parse(text, quantity.kind)
    except UnitError as error:
        raise InputError(f"{place} is {shorten(entry)}: {error}.") from None


def _check_value(value: float, quantity: Quantity, place: str) -> None:
    if not np.isfinite(value):
        raise InputError(f"{place} is {value:g}, which is not a finite number; give a number, or remove the pose.")
    try:
        quantity.check(value)
    except UnitError as error:
        raise InputError(f"{place} is {quantity.show(value)}: {error}.") from None


def given_poses(machine: Machine, poses: Any) -> PoseColumns:
    """Read poses that a Python program gives; see `evaluate`.

    Raises:
        InputError: they are nothing of the kind, name an unknown field, or hold a value that the field does not allow.
    """
    if isinstance(poses, str | Path):
        return read_poses(machine, Path(poses))
    labels: dict[str, Any] = {}
    if hasattr(poses, "data_vars"):
        columns, labels = _columns_of_dataset(poses)
    elif isinstance(poses, Mapping):
        named = numbers_for(quantities(machine.family.tables["pose"]), poses, angles_of)
        columns = [GivenColumn(name, entries) for name, entries in named.items()]
    elif hasattr(poses, "columns"):
        columns = [GivenColumn(name, poses[name]) for name in poses.columns]
        labels = {"pose": np.asarray(poses.index)} if hasattr(poses, "index") else {}
    else:
        columns = _columns_of_array(machine, poses)
    return read_columns(machine, columns, lambda name, i: f"poses[{name!r}][{i}]", labels)


def _columns_of_dataset(dataset: Any) -> tuple[list[GivenColumn], dict[str, Any]]:
    """Return the variables of a dataset, or its coordinates if it has none, over all its dimensions together."""
    names = list(dataset.data_vars) or list(dataset.coords)
    flat = [np.ravel(array) for array in np.broadcast_arrays(*_spread_variables(dataset, names))]
    others = [name for name in dataset.coords if name not in names and dataset[name].dims == tuple(dataset.dims)]
    labels = {str(name): dataset[name].values for name in others}
    fields = [str(dataset[name].attrs.get("field", name)) for name in names]
    return [GivenColumn(field, values) for field, values in zip(fields, flat, strict=True)], labels


def _spread_variables(dataset: Any, names: Sequence[Any]) -> list[Any]:
    """Return variables with a length of one along dimensions that they do not have."""
    return [
        np.expand_dims(
            dataset[name].values, tuple(i for i, dim in enumerate(dataset.dims) if dim not in dataset[name].dims)
        )
        for name in names
    ]


def _columns_of_array(machine: Machine, poses: Any) -> list[GivenColumn]:
    coordinates = [p.shown for p in parameters(machine.family) if p.path.startswith(POSE)]
    try:
        array = np.asarray(poses, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"poses is {shorten(poses)}; {POSE_FORMS}.") from None
    if array.ndim != 2 or array.shape[1] != len(coordinates):
        shape = " x ".join(str(size) for size in array.shape) or "a single number"
        raise InputError(
            f"poses is an array of {shape}; {machine.name} needs a row for each pose with {len(coordinates)} columns: "
            f"{', '.join(coordinates)}. To give some of them by name, use a dictionary or a DataFrame."
        )
    return [GivenColumn(name, values) for name, values in zip(coordinates, array.T, strict=True)]


def read_poses(machine: Machine, path: Path) -> PoseColumns:
    """Read poses from a CSV file.

    The first line names a field in each column, with the unit in brackets if it is not SI: `x [mm], angle [deg]`.
    Fields that no column names stay as the machine has them. Comma, semicolon or tab separate; lines that begin with #
    are comments. Columns of answers that `kinetostat path` wrote are left out.

    Args:
        machine: the machine whose fields the columns are.
        path: path of the file.

    Raises:
        InputError: the file cannot be read or holds no poses, a column is not a field of the machine, a line is too
            short or too long, or a value is not a number of the right kind.
    """
    columns, numbers = columns_of(path)
    columns = [column for column in columns if column.name not in ANSWERS]
    try:
        poses = read_columns(machine, columns, lambda name, i: f"line {numbers[i]}, column {name}")
    except InputError as error:
        raise InputError(f'"{path}": {error}') from None
    return replace(poses, unit_doubt=unit_doubt(machine, columns))


def unit_doubt(machine: Machine, columns: Sequence[GivenColumn]) -> str:
    """Return a sentence on columns of a file without a unit whose numbers seem to be mm or deg; empty without any."""
    kinds = {p.shown: p.quantity.kind for p in parameters(machine.family) if p.path.startswith(POSE)}
    sentences = []
    for kind, meant, unit in (("length", "mm", "m"), ("angle", "deg", "rad")):
        bare = [c for c in columns if not c.unit and kinds.get(c.name.removeprefix(POSE)) == kind]
        numbers = [plain for column in bare if (plain := _plain_numbers(column, COMPONENT)) is not None]
        greatest = max((float(np.abs(plain).max()) for plain in numbers), default=0.0)
        if greatest > _greatest_plausible(machine, kind, greatest):
            heads = ", ".join(f"{column.name} [{meant}]" for column in bare)
            sentences.append(
                f"Numbers without a unit in the head of their column are taken as {unit}, so that the file reaches "
                f"{greatest:g} {unit}; if they are {meant}, write {heads} in its first line."
            )
    return " ".join(sentences)


def _greatest_plausible(machine: Machine, kind: str, greatest: float) -> float:
    """The greatest length (m) or angle (rad) that a coordinate may have without doubt.

    The machine is placed only where the greatest of a file is more than 1 m: one of less is small enough for its size
    not to be asked for.
    """
    if kind == "angle":
        return 2.0 * math.pi
    return MOST_MACHINE_LENGTHS * float(MachineState(machine).configuration.length) if greatest > 1.0 else math.inf


def repeated_leaf(fields: Iterable[Parameter]) -> str:
    """Return the path of the first number of a machine that several fields set; empty if each has one of its own."""
    counts = Counter(leaf for field in fields for leaf in field.leaves)
    return next((leaf for leaf, count in counts.items() if count > 1), "")


def listed_fields(machine: Machine, names: Iterable[str], where: str) -> dict[str, Parameter]:
    """Find the fields that a pose of a list gives, by their names; `where` says in messages which pose it is.

    Raises:
        InputError: there is no such field, or two of them set one number.
    """
    fields = {name: find(machine.family, name) for name in names}
    if leaf := repeated_leaf(fields.values()):
        raise InputError(f"{where} gives {leaf} twice; remove one of them.")
    return fields


def chosen_axes(machine: Machine, ranges: Sequence[str]) -> list[tuple[Range, Parameter]]:
    """Read the axes of a grid: ranges as written, and the parameters that they are about.

    Raises:
        InputError: an unknown field, a bad range, a field twice, or more than six dimensions.
    """
    ranges = as_list(ranges)
    if len(ranges) > MOST_DIMENSIONS:
        raise InputError(
            f"the grid has {len(ranges)} dimensions; at most {MOST_DIMENSIONS} are allowed: "
            "give the others one value each with --set."
        )
    spans = [parse_range(text) for text in ranges]
    chosen = [find(machine.family, span.field) for span in spans]
    if leaf := repeated_leaf(chosen):
        raise InputError(f"{leaf} is varied twice; give each field one range.")
    return list(zip(spans, chosen, strict=True))


def grid_of(axes: Sequence[tuple[Range, Parameter]]) -> Grid:
    """The points of a grid with these axes."""
    return Grid([Axis(parameter.leaves, span.values(parameter.quantity)) for span, parameter in axes])
