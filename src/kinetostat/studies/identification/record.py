"""The record of a fit, which `kinetostat identify -o FOLDER` has written, read again for reports and other questions.

Nothing is fitted here, and nothing of the file is trusted before its form has been checked.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError

RECORD = "fit.json"
"""Name of the file of a record, in the folder that `kinetostat identify -o` writes."""
FIT_PICTURES = ("residuals", "correlations", "poses")
"""Names of the pictures beside a record, without their suffix."""
PNG = b"\x89PNG\r\n\x1a\n"
"""The bytes with which a PNG file begins."""
LARGEST_RECORD = 1 << 28
"""Bytes that are read of a record or a picture: a covariance of a thousand unknowns takes a tenth of them."""
FIT_ADVICE = f"give the folder, or the {RECORD} in it, that `kinetostat identify -o FOLDER` has written."
"""End of the messages about something that is not a record."""


@dataclass(frozen=True)
class FittedNumber:
    """An unknown of a fit.

    Attributes:
        path, group: its path and the group of errors to which it belongs.
        words: its meaning.
        unit: its SI unit.
        value, half: its value and half of the 95 % interval, infinite where nothing sees it, SI.
    """

    path: str
    group: str
    words: str
    unit: str
    value: float
    half: float


class Outlier(NamedTuple):
    """A measured value that a fit sets aside: its line in the file, its name, its residual in standard deviations."""

    line: int
    name: str
    sigmas: float


class RecordedUnseen(NamedTuple):
    """A combination that a fit does not see: a sentence; the motion of the tool, in all and inside the machine, m."""

    words: str
    tool: float
    inside: float


@dataclass(frozen=True)
class FitRecord:
    """The record of a fit, read from its file.

    Attributes:
        path: path of the record.
        machine, family: name and family of the drawn machine; the family is empty in records of earlier versions.
        data: path of the measurements.
        poses, values: numbers of measured poses and of measured values.
        unknowns: the numbers that were fitted.
        covariance: covariance of the unknowns, SI [unknowns x unknowns].
        rank: number of combinations of unknowns that the measurements see.
        scatter: standard deviation of the residuals over the expected one.
        known: whether the standard deviations of the measurements were known.
        residuals: root mean squares of lengths (m) and angles (rad): as drawn, as identified, and of poses left out.
        outliers: values that were set aside.
        unseen: combinations of unknowns that are not seen.
        pictures: PNG files by name, as far as they lie beside the record.
        home: where actuators stand at the home pose of the machine as built, by name, counted as in the drawn machine,
            m or rad; none in a record without a machine file.
        senses: by name, 1 where that count grows with the count of the machine as built, else -1.
        numbers: those of the machine's own file as identified, by path, SI; None where that file cannot say all.
    """

    path: str
    machine: str
    family: str
    data: str
    poses: int
    values: int
    unknowns: tuple[FittedNumber, ...]
    covariance: Array
    rank: int
    scatter: float
    known: bool
    residuals: tuple[Mapping[str, float], ...]
    outliers: tuple[Outlier, ...]
    unseen: tuple[RecordedUnseen, ...]
    pictures: Mapping[str, bytes]
    home: Mapping[str, float]
    senses: Mapping[str, float]
    numbers: Mapping[str, float] | None

    def controller_counts(self, actuators: Sequence[str], coordinates: Array, home: Mapping[str, float]) -> Array:
        """Coordinates of actuators as their controller counts them, with the zeros and gains that were found.

        An actuator that is commanded to c stands at c + zero + gain c, theory (45) and what follows it.

        Args:
            actuators: names of the actuators, "leg 1 actuator".
            coordinates: coordinates that they shall have in the machine as built, m or rad [poses x actuators].
            home: their coordinates at the home pose of that machine; cranks and slides are counted from elsewhere
                there than in the drawn one.

        Raises:
            InputError: the fit is about an actuator that is not among them.
        """
        from_home = np.asarray(coordinates, dtype=float) - [home[name] for name in actuators]
        counts = from_home * [self.senses.get(name, 1.0) for name in actuators]
        counts += [self.home.get(name, home[name]) for name in actuators]
        zeros, gains = self._by_actuator("zeros", actuators), self._by_actuator("gains", actuators)
        return np.asarray((counts - zeros) / (1.0 + gains))

    def _by_actuator(self, group: str, actuators: Sequence[str]) -> Array:
        """The values of a group of unknowns, "zeros" or "gains", by actuator; 0 for those that were not fitted."""
        values = np.zeros(len(actuators))
        for unknown in self.unknowns:
            if unknown.group == group:
                name = unknown.path.removeprefix("legs.").rpartition(".")[0].replace(".", " ")
                if name not in actuators:
                    raise InputError(
                        f'"{self.path}" is about an actuator {name}, which this machine does not have; give the '
                        "machine.toml that the same fit has written."
                    )
                values[list(actuators).index(name)] = unknown.value
        return values

    def check(self, machine: Machine) -> None:
        """Refuse a machine that was not fitted; the drawn one passes, and the one that the fit has written.

        Raises:
            InputError: the machine has another name.
        """
        if self.machine != machine.name:
            raise InputError(f'"{self.path}" is the fit of {self.machine}, not of {machine.name}; give that machine.')

    def check_drawn(self, machine: Machine) -> None:
        """Refuse a machine that is not the drawn one that was fitted.

        Raises:
            InputError: the machine has another name or is of another family.
        """
        self.check(machine)
        if self.family not in ("", machine.family.name):
            raise InputError(
                f'"{self.path}" is the fit of a machine of the family {self.family}, and {machine.name} is of '
                f"{machine.family.name}; give the machine as drawn, not the file that the fit has written."
            )


@dataclass(frozen=True)
class RecordedFit:
    """The record of a fit beside the machine that was fitted, as drawn."""

    machine: Machine
    record: FitRecord


def read_fit(path: str | Path) -> FitRecord:
    """Read the record of a fit and the pictures beside it.

    Args:
        path: path of the record, or of the folder in which it lies.

    Raises:
        InputError: it cannot be read, or is not the record of a fit.
    """
    file = Path(path)
    try:
        file = file / RECORD if file.is_dir() else file
        record = json.loads(_bytes(file))
        pictures = {name: file.with_name(f"{name}.png") for name in FIT_PICTURES}
        return record_of(str(file), record, {n: _bytes(p) for n, p in pictures.items() if p.is_file()})
    except OSError as error:
        raise InputError(f'"{file}" cannot be read: {error.strerror}; {FIT_ADVICE}') from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, OverflowError):
        raise InputError(f'"{file}" is not the record of a fit; {FIT_ADVICE}') from None


def _bytes(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(LARGEST_RECORD)


def record_of(path: str, record: Any, pictures: Mapping[str, bytes]) -> FitRecord:
    """Read the record of a fit from plain data.

    Args:
        path: path of the record, for messages.
        record: plain data of an identification.
        pictures: contents of files by name; those that are no PNG are left out.

    Raises:
        ValueError, KeyError, TypeError, AttributeError: the data are not such a record.
    """
    unknowns = tuple(
        FittedNumber(
            path=str(u["path"]),
            group=str(u["group"]),
            words=str(u.get("words", "")),
            unit=str(u.get("unit", "1")),
            value=float(u["value"]),
            half=float("inf") if u.get("half_interval_95") is None else float(u["half_interval_95"]),
        )
        for u in record["unknowns"]
    )
    covariance = np.array(record["covariance"], dtype=float)
    if not unknowns or covariance.shape != (len(unknowns), len(unknowns)) or not np.isfinite(covariance).all():
        raise ValueError("no covariance of the unknowns")
    if not np.isfinite([unknown.value for unknown in unknowns]).all():
        raise ValueError("a value that is not finite")
    outliers, unseen = record.get("outliers", []), record.get("unseen", [])
    return FitRecord(
        path=path,
        machine=str(record["machine"]),
        family=str(record.get("family", "")),
        data=str(record.get("data", "")),
        poses=int(record.get("poses", 0)),
        values=int(record.get("values", 0)),
        unknowns=unknowns,
        covariance=covariance,
        rank=int(record.get("rank", len(unknowns))),
        scatter=float(record.get("scatter", 1.0)),
        known=bool(record.get("sigma_known", True)),
        residuals=tuple(
            {str(kind): float(size) for kind, size in record.get(name, {}).items()}
            for name in ("before", "after", "left_out")
        ),
        outliers=tuple(Outlier(int(o["line"]), str(o["value"]), float(o["sigmas"])) for o in outliers),
        unseen=tuple(RecordedUnseen(str(u["words"]), float(u["tool"]), float(u["inside"])) for u in unseen),
        pictures={name: data for name, data in pictures.items() if data.startswith(PNG)},
        home=_numbers(record.get("home", {}).get("actuators", {})),
        senses=_numbers(record.get("home", {}).get("senses", {})),
        numbers=None if record.get("numbers") is None else _numbers(record["numbers"]),
    )


def _numbers(data: Any) -> dict[str, float]:
    return {str(name): float(value) for name, value in data.items()}
