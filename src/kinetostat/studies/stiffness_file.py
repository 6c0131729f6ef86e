"""A measured stiffness from a CSV file: entries of K or C, or deflections under loads. Nothing is computed here.

A file of entries has the columns entry, value and sigma; one of deflections is a file of measurements.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError, shorten
from kinetostat.studies.identification.measurements import Measurements, Sigmas, read_measurements
from kinetostat.studies.poses import GivenColumn, columns_of
from kinetostat.units import KINDS, UnitError, parse

MEASURED_MATRICES = ("stiffness", "compliance", "free_stiffness")
"""Matrices to which an entry may belong: K, C, or 1 / C of its diagonal, which a load along one component measures."""
COLUMNS = ("entry", "value", "sigma")
KIND_OF = {kind.unit: kind.name for kind in KINDS.values() if kind.name.endswith((" stiffness", " compliance"))}
SIGMA_ADVICE = 'write a column sigma, such as 2 N/um or 3 %, or give --sigma "3 %"'


@dataclass(frozen=True)
class MeasuredEntry:
    """A measured number of a machine's stiffness.

    Attributes:
        name: "stiffness_z", "compliance_rx_y", "free_stiffness_x", or "deflection_z" under a load.
        unit: its SI unit.
        value, sigma: the number and its standard deviation, which is more than 0, SI.
        line: its line in the file.
        row: the number of the pose; 0 for an entry of a matrix.
    """

    name: str
    unit: str
    value: float
    sigma: float
    line: int
    row: int = 0

    @property
    def parts(self) -> tuple[str, int, int]:
        """The matrix that it belongs to, and its row and column in COMPONENTS."""
        matrix = next(m for m in (*MEASURED_MATRICES, "deflection") if self.name.startswith(f"{m}_"))
        names = self.name.removeprefix(f"{matrix}_").split("_")
        return matrix, COMPONENTS.index(names[0]), COMPONENTS.index(names[-1])


@dataclass(frozen=True)
class MeasuredStiffness:
    """All that a file says.

    Attributes:
        path: of the file.
        entries: the measured numbers in the order of the file.
        deflections: poses and loads where deflections were measured; None of a file of entries.
    """

    path: str
    entries: tuple[MeasuredEntry, ...]
    deflections: Measurements | None = None


def read_stiffness(machine: Machine, path: Path, sigma: str = "", sigma_angle: str = "") -> MeasuredStiffness:
    """Read a measured stiffness.

    Args:
        machine: that was measured.
        path: of the file.
        sigma: standard deviation of what has none in the file: a share ("3 %"), or of deflections a length.
        sigma_angle: the same of deflections that are angles.

    Raises:
        InputError: the file cannot be read, an entry is not one of K or C of this machine, a value is of the wrong
            kind, or nothing says how sure it is; the message names file and line.
    """
    columns, lines = columns_of(path)
    if not any(column.name == "entry" for column in columns):
        return _deflections(machine, path, sigma, sigma_angle)
    try:
        return MeasuredStiffness(str(path), tuple(_entries(machine, columns, lines, sigma)))
    except InputError as error:
        raise InputError(f'"{path}"{"" if str(error).startswith(",") else ":"}{error}') from None


def _entries(machine: Machine, columns: Sequence[GivenColumn], lines: Sequence[int], sigma: str) -> list[MeasuredEntry]:
    by_name = {column.name: column for column in columns}
    for name in COLUMNS[:2]:
        if name not in by_name:
            raise InputError(f" there is no column {name}; a file of entries has the columns {', '.join(COLUMNS)}.")
    for name in by_name:
        if name not in COLUMNS:
            raise InputError(f" there is no column {name}; a file of entries has the columns {', '.join(COLUMNS)}.")
    texts = [by_name[name].entries if name in by_name else [""] * len(lines) for name in COLUMNS]
    result: list[MeasuredEntry] = []
    for line, entry, value, sure in zip(lines, *texts, strict=True):
        read = _entry(machine, str(entry).strip(), str(value).strip(), str(sure).strip() or sigma, line)
        if any(read.name == other.name for other in result):
            raise InputError(f", line {line}: {read.name} stands in the file twice; keep one of them, or their mean.")
        result.append(read)
    return result


def _entry(machine: Machine, name: str, value: str, sure: str, line: int) -> MeasuredEntry:
    def refusal(what: str) -> InputError:
        return InputError(f", line {line}: {what}")

    known = _entry_names(machine)
    if name not in known:
        raise refusal(
            f"{shorten(name)} is not an entry of K or C of {machine.name}; write for example {known[-1]}, and choose "
            f"its components from {', '.join(machine.family.component_names)}."
        )
    name = name if name in QUANTITIES else _transposed_name(name)
    unit = QUANTITIES[name].unit
    size = _number(value, KIND_OF[unit], lambda text: refusal(f"the value of {name} is {text}"))
    if not sure:
        raise refusal(f"nothing says how sure {name} is; {SIGMA_ADVICE}.")
    share = sure.endswith("%")
    sigma = _number(sure, "share" if share else KIND_OF[unit], lambda text: refusal(f"the sigma of {name} is {text}"))
    sigma = sigma * abs(size) if share else sigma
    if not sigma > 0.0:
        raise refusal(f"the sigma of {name} is {sure}; it must be more than 0.")
    if len(QUANTITIES[name].components) == 1 and not size > 0.0:
        raise refusal(f"the value of {name} is {value}; what stands on the diagonal of K and C is more than 0.")
    return MeasuredEntry(name, unit, size, sigma, line)


def _entry_names(machine: Machine) -> list[str]:
    """The names of all entries, in either order of their components."""
    names, components = [], machine.family.component_names
    for matrix in MEASURED_MATRICES:
        pairs = [(a, b) for a in components for b in components if a == b or matrix != "free_stiffness"]
        names += [f"{matrix}_{a}" if a == b else f"{matrix}_{a}_{b}" for a, b in pairs]
    return names


def _transposed_name(name: str) -> str:
    matrix, first, second = name.rsplit("_", 2)
    return f"{matrix}_{second}_{first}"


def _number(text: str, kind: str, refusal: Callable[[str], InputError]) -> float:
    try:
        value = parse(text, kind)
    except UnitError as error:
        raise InputError(f"{refusal(shorten(text))}: {error}.") from None
    if not np.isfinite(value):
        raise InputError(f"{refusal(shorten(text))}; give a finite number.")
    return value


def _deflections(machine: Machine, path: Path, sigma: str, sigma_angle: str) -> MeasuredStiffness:
    length, angle = (
        _default(text, kind, option)
        for text, kind, option in ((sigma, "length", "--sigma"), (sigma_angle, "angle", "--sigma-angle"))
    )
    data = read_measurements(machine, path, Sigmas(length, angle))
    names = [name for name in data.values if name.startswith("deflection.")]
    if not names:
        raise InputError(
            f'"{path}": no column holds a stiffness; write the columns entry, value and sigma, or deflections under '
            "loads (deflection.z [um], force.z [N])."
        )
    entries = []
    for row in range(len(data)):
        for name in names:
            value, sure = float(data.values[name][row]), float(data.sigma[name][row])
            if not np.isfinite(value):
                continue
            if not np.isfinite(sure):
                raise data.refusal(row, f"nothing says how sure {name} is; add a column sigma.{name} [um] or --sigma.")
            component = name.removeprefix("deflection.")
            unit = "rad" if component.startswith("r") else "m"
            entries.append(MeasuredEntry(f"deflection_{component}", unit, value, sure, data.lines[row], row))
    return MeasuredStiffness(str(path), tuple(entries), data)


def _default(text: str, kind: str, option: str) -> float:
    """A standard deviation for what has none in the file, SI; infinity if it is not given."""
    size = _number(text, kind, lambda given: InputError(f"{option} is {given}")) if text else np.inf
    if not size > 0.0:
        raise InputError(f"{option} is {text}; it must be more than 0.")
    return size
