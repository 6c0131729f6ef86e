"""Measured poses, distances and deflections of a machine from a CSV file: every value is checked, nothing is fitted.

The file has a line of names and then a line for each pose. Columns named after coordinates of the pose or after
actuators have commanded values; columns such as `measured.x` have measured positions and angles, `deflection.x`
measured deflections under a wrench, and `sigma.x` or `sigma.deflection.x` standard deviations.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinematics.forward import poses_at, system_of
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity, quantities
from kinetostat.studies.assembly_modes import actuator_numbers
from kinetostat.studies.csv_columns import GivenColumn, columns_of
from kinetostat.studies.poses import Where, read_columns
from kinetostat.units import UnitError

POSITION, ROTATION, EULER = ("x", "y", "z"), ("rx", "ry", "rz"), ("roll", "pitch", "yaw")
"""Names of coordinates: of positions, of rotation vectors, and of orientations by roll, pitch and yaw."""
MEASURED = {
    **dict.fromkeys((*POSITION, "distance"), "length"),
    **dict.fromkeys((*ROTATION, *EULER), "angle"),
}
"""Quantities that can be measured of a pose, with their kinds: position of the target, its rotation vector or its
roll, pitch and yaw, and its distance from a fixed point."""
DEFLECTED = {**dict.fromkeys(POSITION, "length"), **dict.fromkeys(ROTATION, "angle")}
"""Quantities that can be measured of a deflection, with their kinds."""
WRENCH_COLUMNS = {f"moment.{name}": "moment" for name in POSITION} | {f"force.{name}": "force" for name in POSITION}
"""Columns of the wrench on the tool, in the order of its components, with their kinds."""
COLUMN_GROUPS: dict[str, Mapping[str, str]] = {
    "measured": MEASURED,
    "deflection": DEFLECTED,
    "from": dict.fromkeys(POSITION, "length"),
    "sigma": {**MEASURED, **{f"deflection.{name}": kind for name, kind in DEFLECTED.items()}},
}
"""Columns by the word before their first dot, with the kinds of their quantities."""
HALF_TURN = np.pi * (1.0 + 1e-9)
"""Largest angle that an orientation has, with some room for round-off, rad."""
MOST_MEASURED_POSES = 10_000
"""Greatest number of poses in a file: far more than anybody measures, and their rates fit in memory."""
FARTHEST_POSITION = 0.5
"""Share of the machine's length by which most measured positions may differ from the commanded ones in a known frame.
No machine is so wrong, but millimetres taken for metres, or another frame, are farther away."""


@dataclass(frozen=True)
class Sigmas:
    """Standard deviations of measured values for which the file gives none.

    Attributes:
        length: that of lengths, m.
        angle: that of angles, rad.
        known: whether somebody has stated them; if not, only their ratio counts.
    """

    length: float
    angle: float
    known: bool = True


@dataclass(frozen=True)
class Measurements:
    """Commanded poses and measured values, n of them; NaN where a cell is empty.

    Attributes:
        path: path of the file.
        lines: number of the line of each pose [n].
        pose: commanded coordinates by leaf path, SI [n].
        values: measured values by name, "x", "distance", "deflection.x", SI [n].
        sigma: standard deviations of the measured values by the same names, SI [n].
        wrenches: wrenches on the tool, base axes, N·m and N [n x 6].
        origins: points from which distances are measured, m [n x 3].
        known: whether the standard deviations are known, not only their ratios.
    """

    path: str
    lines: tuple[int, ...]
    pose: Mapping[str, Array]
    values: Mapping[str, Array]
    sigma: Mapping[str, Array]
    wrenches: Array
    origins: Array
    known: bool = True

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def count(self) -> int:
        """Number of measured values."""
        return int(sum(np.isfinite(values).sum() for values in self.values.values()))

    def refusal(self, pose: int, mistake: str) -> InputError:
        """The message about a mistake at a pose, with file and line."""
        return InputError(f'"{self.path}", line {self.lines[pose]}: {mistake}')


def read_measurements(machine: Machine, path: Path, sigmas: Sigmas) -> Measurements:
    """Read measurements from a CSV file.

    Args:
        machine: the machine that was measured.
        path: path of the file.
        sigmas: standard deviations of values for which the file gives none.

    Raises:
        InputError: the file cannot be read, a column is unknown or missing, or a value is of the wrong kind or out of
            its range; the message names file, line and column.
    """
    columns, lines = columns_of(path, MOST_MEASURED_POSES)

    def where(name: str, row: int) -> str:
        return f"line {lines[row]}, column {name}"

    try:
        groups = _by_group(columns)
        pose = _commanded_pose(machine, groups.pop("", []), groups.pop("actuator", []), where)
        numbers = {
            group: {
                (name := _name_in_group(column)): _numbers(column, COLUMN_GROUPS[group][name], where)
                for column in entries
            }
            for group, entries in groups.items()
            if group in COLUMN_GROUPS
        }
        loads = groups.get("wrench", [])
        wrench = {column.name: _numbers(column, WRENCH_COLUMNS[column.name], where) for column in loads}
        return _measurements(str(path), lines, pose, numbers, wrench, sigmas)
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith('"') else f'"{path}": {text}') from None


def _commanded_pose(
    machine: Machine, commanded: Sequence[GivenColumn], driven: Sequence[GivenColumn], where: Where
) -> dict[str, Array]:
    """The commanded coordinates of the pose by leaf path, SI [n].

    Args:
        machine: the machine that was measured.
        commanded: columns of coordinates of the pose.
        driven: columns of coordinates of actuators, which give the pose by forward kinematics.
        where: returns the line and column of an entry, for messages.

    Raises:
        InputError: both or none are commanded, or a column is not about the pose.
    """
    pose = dict(read_columns(machine, commanded, where).leaves) if commanded else {}
    others = [leaf for leaf in pose if not leaf.startswith(POSE)]
    if others:
        raise InputError(f"{others[0]} is not a coordinate of the pose; a machine that was measured has one geometry.")
    if driven and pose:
        raise InputError("both poses and actuators are commanded; leave the columns of the ones or others out.")
    if driven:
        return _from_actuators(machine, driven, where)
    if not pose:
        names = ", ".join(name.removeprefix(POSE) for name in _pose_names(machine))
        raise InputError(f"no column says what was commanded; add columns of the pose ({names}) or actuator.NAME.")
    return pose


def _by_group(columns: Sequence[GivenColumn]) -> dict[str, list[GivenColumn]]:
    """The columns by their group: a key of `COLUMN_GROUPS`, "actuator", "wrench", or "" for coordinates of the pose."""
    groups: dict[str, list[GivenColumn]] = {}
    for column in columns:
        word, _, name = column.name.partition(".")
        if name and word in (*COLUMN_GROUPS, "actuator"):
            group = word
        else:
            group = "wrench" if column.name in WRENCH_COLUMNS else ""
        if group in COLUMN_GROUPS and name not in COLUMN_GROUPS[group]:
            allowed = ", ".join(f"{group}.{name}" for name in COLUMN_GROUPS[group])
            raise InputError(f"there is no column {column.name}; choose from {allowed}.")
        groups.setdefault(group, []).append(column)
    return groups


def _name_in_group(column: GivenColumn) -> str:
    """The name of a column after its first dot."""
    return column.name.partition(".")[2]


def _pose_names(machine: Machine) -> list[str]:
    return list(quantities(machine.family.tables["pose"]))


def _numbers(column: GivenColumn, kind: str, where: Where) -> Array:
    """The values of a column, which are of one kind, SI; NaN where a cell is empty [n].

    An angle of a platform is at most half a turn; an actuator may turn farther.
    """
    numbers = np.full(len(column.entries), np.nan)
    of_platform = kind == "angle" and not column.name.startswith(("sigma", "actuator."))
    quantity = Quantity(kind, "", positive=column.name.startswith("sigma"))
    for row, entry in enumerate(column.entries):
        text = str(entry).strip()
        if not text:
            continue
        try:
            without_unit = (column.unit and text[-1].isdecimal()) or text.endswith(".")
            numbers[row] = quantity.number(f"{text} {column.unit}" if without_unit else text)
        except UnitError as error:
            raise InputError(f"{where(column.name, row)} is {shorten(text)}: {error}.") from None
        if of_platform and abs(numbers[row]) > HALF_TURN:
            raise InputError(
                f"{where(column.name, row)} is {np.degrees(numbers[row]):.6g} deg, more than half a turn, which no "
                "orientation has; check the unit in the head of the column."
            )
    return numbers


def _measurements(
    path: str,
    lines: Sequence[int],
    pose: Mapping[str, Array],
    numbers: Mapping[str, Mapping[str, Array]],
    wrench: Mapping[str, Array],
    sigmas: Sigmas,
) -> Measurements:
    """The measurements by the numbers of each group of columns, checked against each other."""
    count, stated_sigmas = len(lines), numbers.get("sigma", {})
    values = dict(numbers.get("measured", {}))
    values |= {f"deflection.{name}": entries for name, entries in numbers.get("deflection", {}).items()}
    if not values:
        raise InputError(
            "no column says what was measured; add columns such as measured.x [mm], measured.rx [deg], "
            "measured.distance [mm] or deflection.z [um]."
        )
    if set(ROTATION) & values.keys() and set(EULER) & values.keys():
        raise InputError(
            "orientations are given both as rx, ry, rz and as roll, pitch, yaw; keep the ones or the others."
        )
    origins = np.stack([numbers.get("from", {}).get(name, np.full(count, np.nan)) for name in POSITION], axis=1)
    wrenches = np.stack([np.nan_to_num(wrench.get(name, np.zeros(count))) for name in WRENCH_COLUMNS], axis=1)
    result = Measurements(
        path=path,
        lines=tuple(lines),
        pose=pose,
        values=values,
        sigma=_sigma(values, stated_sigmas, sigmas),
        wrenches=wrenches,
        origins=origins,
        known=sigmas.known or _have_sigmas(values, stated_sigmas),
    )
    _check_origins_and_loads(result)
    return result


def _check_origins_and_loads(data: Measurements) -> None:
    """Refuse distances from nowhere, and deflections under no load."""
    has_origin, has_load = np.isfinite(data.origins).all(axis=1), data.wrenches.any(axis=1)
    for name, entries in data.values.items():
        is_measured = np.isfinite(entries)
        if name == "distance" and (is_measured & ~has_origin).any():
            pose = int(np.argmax(is_measured & ~has_origin))
            raise data.refusal(pose, "a distance is measured, but not from where; add from.x, from.y and from.z [mm].")
        if name.startswith("deflection") and (is_measured & ~has_load).any():
            pose = int(np.argmax(is_measured & ~has_load))
            raise data.refusal(pose, "a deflection is measured without a load; add columns such as force.z [N].")


def _have_sigmas(values: Mapping[str, Array], stated: Mapping[str, Array]) -> bool:
    """Whether the file states a standard deviation for every measured value."""
    return all(
        name in stated and np.isfinite(stated[name][np.isfinite(entries)]).all() for name, entries in values.items()
    )


def _sigma(values: Mapping[str, Array], stated: Mapping[str, Array], sigmas: Sigmas) -> dict[str, Array]:
    """Standard deviations of all measured values, from the file or from the defaults."""
    result = {}
    for name, entries in values.items():
        kind = COLUMN_GROUPS["sigma"][name]
        usual = np.full(len(entries), sigmas.length if kind == "length" else sigmas.angle)
        of_file = stated.get(name, usual)
        result[name] = np.where(np.isnan(of_file), usual, of_file)
    return result


def _from_actuators(machine: Machine, columns: Sequence[GivenColumn], where: Where) -> dict[str, Array]:
    """The poses of the drawn machine where its actuators are commanded, by leaf path, SI [n]."""
    system = system_of(machine)
    goals = np.tile([float(actuator.coordinate) for actuator in system.actuators], (len(columns[0].entries), 1))
    number_by_name = actuator_numbers(system)
    column_of_actuator: dict[int, str] = {}
    for column in columns:
        name = _name_in_group(column)
        if name not in number_by_name:
            first_names = {number: known for known, number in reversed(number_by_name.items())}
            choices = ", ".join(f"actuator.{first_names[number]}" for number in sorted(first_names))
            raise InputError(f"there is no column {column.name}; choose from {choices}.")
        number = number_by_name[name]
        if number in column_of_actuator:
            raise InputError(f"{column.name} and {column_of_actuator[number]} are one actuator; leave one of them out.")
        column_of_actuator[number] = column.name
        goals[:, number] = _numbers(column, system.actuators[number].kind, where)
    poses, placed = poses_at(system, goals)
    if not placed.all():
        row = int(np.argmin(placed))
        raise InputError(f"{where('actuator', row)}: the drawn machine has no pose with these coordinates nearby.")
    return {f"{POSE}{name}": values for name, values in poses.items()}
