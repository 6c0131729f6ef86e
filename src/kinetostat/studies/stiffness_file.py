"""A measured stiffness from a CSV file: entries of K or C, or deflections under loads. Nothing is computed here.

A file of entries has the columns entry, value and sigma; one of deflections is a file of measurements.
"""

from collections.abc import Sequence
from enum import StrEnum
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError, shorten
from kinetostat.studies.csv_columns import GivenColumn, columns_of
from kinetostat.studies.identification.measurements import Measurements, Sigmas, read_measurements
from kinetostat.units import KINDS, UnitError, parse

COLUMNS = ("entry", "value", "sigma")
"""Columns of a file of entries; the last one may be missing."""
KIND_BY_UNIT = {kind.unit: kind.name for kind in KINDS.values() if kind.name.endswith((" stiffness", " compliance"))}
"""Kinds of the entries of K and C by their SI units."""
SIGMA_ADVICE = 'write a column sigma, such as 2 N/um or 3 %, or give --sigma "3 %"'
"""The end of messages about a number without a standard deviation."""


class MeasuredKind(StrEnum):
    """The kinds of measured numbers, by the beginnings of their names."""

    STIFFNESS = "stiffness"
    """An entry of K."""
    COMPLIANCE = "compliance"
    """An entry of C."""
    FREE_STIFFNESS = "free_stiffness"
    """The reciprocal of an entry of the diagonal of C, which a load along one component measures."""
    DEFLECTION = "deflection"
    """A component of the deflection under a load."""


class EntryPlace(NamedTuple):
    """The place of a measured number: its kind, and its row and column in COMPONENTS, which are equal if it has one."""

    kind: MeasuredKind
    row: int
    column: int


@dataclass(frozen=True)
class MeasuredEntry:
    """A measured number of a machine's stiffness.

    Attributes:
        name: "stiffness_z", "compliance_rx_y", "free_stiffness_x", or "deflection_z" under a load.
        unit: its SI unit.
        value, sigma: the number and its standard deviation, which is more than 0, SI.
        line: its line in the file.
        pose: the number of the pose; 0 for an entry of a matrix.
    """

    name: str
    unit: str
    value: float
    sigma: float
    line: int
    pose: int = 0

    @property
    def place(self) -> EntryPlace:
        """The place of the number, which its name says."""
        kind = next(kind for kind in MeasuredKind if self.name.startswith(f"{kind}_"))
        components = self.name.removeprefix(f"{kind}_").split("_")
        return EntryPlace(kind, COMPONENTS.index(components[0]), COMPONENTS.index(components[-1]))


@dataclass(frozen=True)
class MeasuredStiffness:
    """All that a file says.

    Attributes:
        path: path of the file.
        entries: the measured numbers in the order of the file.
        deflections: poses and loads where deflections were measured; None of a file of entries.
    """

    path: str
    entries: tuple[MeasuredEntry, ...]
    deflections: Measurements | None = None


def read_stiffness(machine: Machine, path: Path, sigma: str = "", sigma_angle: str = "") -> MeasuredStiffness:
    """Read a measured stiffness.

    Args:
        machine: the measured machine.
        path: path of the file.
        sigma: standard deviation of what has none in the file: a share ("3 %"), or of deflections a length.
        sigma_angle: the same of deflections that are angles.

    Raises:
        InputError: the file cannot be read, an entry is not one of K or C of this machine, a value is of the wrong
            kind, or nothing says how sure it is; the message names file and line.
    """
    columns, lines = columns_of(path)
    if any(column.name == "entry" for column in columns):
        return MeasuredStiffness(str(path), tuple(_entries(machine, path, columns, lines, sigma)))
    return _deflections(machine, path, sigma, sigma_angle)


def _entries(
    machine: Machine, path: Path, columns: Sequence[GivenColumn], lines: Sequence[int], usual_sigma: str
) -> list[MeasuredEntry]:
    """The entries of a file; those without a standard deviation have the usual one, which may be empty."""
    by_name = {column.name: column for column in columns}
    missing = [name for name in COLUMNS[:2] if name not in by_name]
    unknown = [name for name in by_name if name not in COLUMNS]
    for name in missing + unknown:
        raise InputError(
            f'"{path}": there is no column {name}; a file of entries has the columns {", ".join(COLUMNS)}.'
        )
    texts = [by_name[name].entries if name in by_name else [""] * len(lines) for name in COLUMNS]
    result: dict[str, MeasuredEntry] = {}
    for line, *cells in zip(lines, *texts, strict=True):
        name, value, sigma = (str(cell).strip() for cell in cells)
        try:
            entry = _entry(machine, name, value, sigma or usual_sigma, line)
            if entry.name in result:
                raise InputError(f"{entry.name} stands in the file twice; keep one of them, or their mean.")
        except InputError as error:
            raise InputError(f'"{path}", line {line}: {error}') from None
        result[entry.name] = entry
    return [*result.values()]


def _entry(machine: Machine, name: str, value: str, sigma: str, line: int) -> MeasuredEntry:
    """Read a line: the name of an entry in either order of its components, and texts with units.

    Raises:
        InputError: there is no such entry, or a text is not a quantity of its kind.
    """
    names = _entry_names(machine)
    if name not in names:
        raise InputError(
            f"{shorten(name)} is not an entry of K or C of {machine.name}; write for example {names[-1]}, and choose "
            f"its components from {', '.join(machine.family.component_names)}."
        )
    name = name if name in QUANTITIES else _transposed_name(name)
    unit = QUANTITIES[name].unit
    size = _number(value, KIND_BY_UNIT[unit], f"the value of {name}")
    if not sigma:
        raise InputError(f"nothing says how sure {name} is; {SIGMA_ADVICE}.")
    is_share = sigma.endswith("%")
    deviation = _number(sigma, "share" if is_share else KIND_BY_UNIT[unit], f"the sigma of {name}")
    deviation = deviation * abs(size) if is_share else deviation
    if not deviation > 0.0:
        raise InputError(f"the sigma of {name} is {sigma}; it must be more than 0.")
    if len(QUANTITIES[name].components) == 1 and not size > 0.0:
        raise InputError(f"the value of {name} is {value}; what stands on the diagonal of K and C is more than 0.")
    return MeasuredEntry(name=name, unit=unit, value=size, sigma=deviation, line=line)


def _entry_names(machine: Machine) -> list[str]:
    """The names of all entries, in either order of their components."""
    components = machine.family.component_names
    pairs = [name if name == other else f"{name}_{other}" for name, other in product(components, repeat=2)]
    return [
        *(f"{kind}_{pair}" for kind in (MeasuredKind.STIFFNESS, MeasuredKind.COMPLIANCE) for pair in pairs),
        *(f"{MeasuredKind.FREE_STIFFNESS}_{name}" for name in components),
    ]


def _transposed_name(name: str) -> str:
    """The name of the entry on the other side of the diagonal, which is equal: K and C are symmetric."""
    matrix, first, second = name.rsplit("_", 2)
    return f"{matrix}_{second}_{first}"


def _number(text: str, kind: str, subject: str) -> float:
    """The finite number that a text means, SI; `subject` says in messages of what it is."""
    try:
        value = parse(text, kind)
    except UnitError as error:
        raise InputError(f"{subject} is {shorten(text)}: {error}.") from None
    if not np.isfinite(value):
        raise InputError(f"{subject} is {shorten(text)}; give a finite number.")
    return value


def _deflections(machine: Machine, path: Path, sigma: str, sigma_angle: str) -> MeasuredStiffness:
    """The deflections of a file of measurements as entries, one for each measured value."""
    sigmas = Sigmas(
        _usual_deviation(sigma, "length", "--sigma"), _usual_deviation(sigma_angle, "angle", "--sigma-angle")
    )
    data = read_measurements(machine, path, sigmas)
    names = [name for name in data.values if name.startswith("deflection.")]
    if not names:
        raise InputError(
            f'"{path}": no column holds a stiffness; write the columns entry, value and sigma, or deflections under '
            "loads (deflection.z [um], force.z [N])."
        )
    entries = []
    for pose in range(len(data)):
        for name in names:
            value, deviation = float(data.values[name][pose]), float(data.sigma[name][pose])
            if not np.isfinite(value):  # an empty cell: this component was not measured at this pose
                continue
            if not np.isfinite(deviation):
                raise data.refusal(pose, f"nothing says how sure {name} is; add a column sigma.{name} [um] or --sigma.")
            component = name.removeprefix("deflection.")
            unit = "rad" if component.startswith("r") else "m"
            entries.append(
                MeasuredEntry(
                    name=f"{MeasuredKind.DEFLECTION}_{component}",
                    unit=unit,
                    value=value,
                    sigma=deviation,
                    line=data.lines[pose],
                    pose=pose,
                )
            )
    return MeasuredStiffness(str(path), tuple(entries), data)


def _usual_deviation(text: str, kind: str, option: str) -> float:
    """A standard deviation for what has none in the file, SI; infinity if it is not given."""
    size = _number(text, kind, option) if text else np.inf
    if not size > 0.0:
        raise InputError(f"{option} is {text}; it must be more than 0.")
    return size
