"""Where the actuators of a loaded machine must stand so that its tool is where the pose says, at one pose or at many.

The equations are in `equilibrium.commanding`; the command is `command`.
"""

import csv
import io
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.kinematics.closing import pose_of
from kinetostat.machine.loading import changed
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import Immutable
from kinetostat.studies.analysis import analyze
from kinetostat.studies.driven import Driven, driven
from kinetostat.studies.identification.record import FitRecord, read_fit
from kinetostat.studies.plain_data import as_answer, no_formula
from kinetostat.studies.poses import PoseColumns, given_poses


@dataclass(frozen=True, eq=False)
class Command(Immutable):
    """Coordinates of the actuators that put the loaded tool where an unloaded machine would have it.

    Attributes:
        machine: with its loads.
        poses: at which they hold; None for the pose of the machine alone.
        actuators: their names.
        units: of each coordinate, "m" or "rad".
        coordinates: what to command [poses x actuators], SI; NaN where there is no state of rest.
        unloaded: where the actuators stand without loads [poses x actuators], SI.
        before: how far the tool point is off without a correction [poses], m.
        left: how far it is off with it, m: what no actuator of the machine can change [poses].
        turned: how far the platform stays turned, rad [poses].
        settled: whether the machine comes to rest [poses].
        message: what is the case, in a sentence.
    """

    machine: Machine
    poses: PoseColumns | None
    actuators: tuple[str, ...]
    units: tuple[str, ...]
    coordinates: Array
    unloaded: Array
    before: Array
    left: Array
    turned: Array
    settled: Mask
    message: str

    @property
    def corrections(self) -> Array:
        """By how much the coordinates differ from those without loads, m or rad [poses x actuators]."""
        return self.coordinates - self.unloaded

    def __repr__(self) -> str:
        return f"<Command of {self.machine.name!r}: {len(self.coordinates)} poses>"


@checked
def command(machine: Machine, poses: Any = None, fit: str | Path | None = None) -> Command:
    """Find where the actuators of a loaded machine must stand so that its tool is where it should be.

    A machine bends under its loads, so that actuators that stand where an ideal machine would have them leave the tool
    beside its pose. These coordinates bring it back. A machine with fewer than six freedoms is brought as near as its
    actuators can.

    Args:
        machine: with its loads; its pose is the one that is wanted, if no poses are given.
        poses: that are wanted: a DataFrame, a dictionary of columns, an array, a dataset or the path of a CSV file, as
            for `evaluate`.
        fit: folder or fit.json of `identify`, where the machine is the one as built that the fit has written: zeros
            and gains of its actuators are not in its file, and coordinates are then those that its controller counts.

    Raises:
        InputError: there is gravity but no mass, no actuator, tensions are to be chosen, the poses cannot be read, or
            the fit is that of another machine.
    """
    refuse_tensions(machine)
    record = None if fit is None else read_fit(fit)
    if record is not None:
        record.check(machine, drawn=False)
        _refuse_drawn(machine, record)
    columns = None if poses is None else given_poses(machine, poses)
    leaves, count = ({}, 1) if columns is None else (columns.leaves, columns.count)
    answer = answer_of(machine, columns, driven(machine, leaves, count))
    if record is None:
        return answer
    home = home_coordinates(machine)
    return replace(
        answer,
        coordinates=record.counted(answer.actuators, answer.coordinates, home),
        unloaded=record.counted(answer.actuators, answer.unloaded, home),
        message=f"{answer.message} Zeros and gains of the fit are counted in.",
    )


def home_coordinates(machine: Machine) -> dict[str, float]:
    """Where the actuators of a machine leg by leg stand at its home pose, by name, m or rad."""
    home = pose_of(machine.chains().home) if machine.family.chains else {}
    there = changed(machine, {f"{POSE}{name}": float(home[name]) for name in machine.chains().pose} if home else {})
    return {actuator.name: actuator.coordinate for actuator in analyze(there).actuators}


def _refuse_drawn(machine: Machine, record: FitRecord) -> None:
    """Refuse a machine as drawn, whose geometry is not the one that was found."""
    if record.family == machine.family.name and machine.family.chains is None:
        raise InputError(
            f'{machine.name} is the machine as drawn, and the fit "{record.path}" is about the one as built; give the '
            "machine.toml that lies beside it."
        )


def refuse_tensions(machine: Machine) -> None:
    """Refuse a machine whose tensions are to be chosen: its actuators are driven by forces.

    Raises:
        InputError: it is such a machine.
    """
    if not all(math.isinf(bound) for bound in (machine.tables["load"].min_tension, machine.tables["load"].max_tension)):
        raise InputError(
            f"{machine.name}: commands are coordinates of actuators, but load.min_tension and load.max_tension choose "
            "forces, which winches are driven by instead; leave the bounds out, or read the tensions from "
            "`analyze --loaded`."
        )


def answer_of(machine: Machine, poses: PoseColumns | None, answer: Driven) -> Command:
    """What is solved at some poses as the answer to people.

    Args:
        machine: with its loads.
        poses: that it is solved at; None for the pose of the machine alone.
        answer: of them.
    """
    return Command(
        machine,
        poses,
        tuple(actuator.name for actuator in answer.actuators),
        tuple(actuator.unit for actuator in answer.actuators),
        answer.coordinates,
        answer.unloaded,
        answer.before,
        answer.left,
        answer.turned,
        answer.settled,
        _message(machine, answer.settled, answer.before, answer.left),
    )


def _message(machine: Machine, settled: Mask, before: Array, left: Array) -> str:
    known, show = int(settled.sum()), machine.display.show_deflection
    if not known:
        return "The machine comes to rest at none of these poses; reduce the load, or preload what only pulls."
    without = "" if settled.all() else f" {len(settled) - known} of {len(settled)} poses have no state of rest."
    return (
        f"Commanded so, the tool point is off by at most {show(float(np.nanmax(left)), 'm')}; without a correction by "
        f"{show(float(np.nanmax(before)), 'm')}.{without}"
    )


def as_csv(answer: Command, corrections: bool = False) -> str:
    """Write the commands as CSV in SI: a row with the number of each pose (from 1), its fields, and its commands.

    Args:
        answer: the commands.
        corrections: whether to add by how much they differ from the coordinates without loads.
    """
    columns: dict[str, Any] = {"pose": range(1, len(answer.coordinates) + 1)}
    if answer.poses is not None:
        for field, values in zip(answer.poses.fields, answer.poses.values, strict=True):
            columns[f"{field.shown} [{field.unit}]"] = values.tolist()
    tables = {"": answer.coordinates, " correction": answer.corrections if corrections else answer.coordinates[:, :0]}
    for what, table in tables.items():
        for name, unit, values in zip(answer.actuators, answer.units, table.T, strict=False):
            pairs = zip(values.tolist(), answer.settled, strict=True)
            columns[no_formula(f"{name}{what} [{unit}]")] = [value if known else "" for value, known in pairs]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()


def as_json(answer: Command) -> dict[str, Any]:
    """Return the commands as plain data, SI; null at poses without a state of rest."""
    return as_answer(
        {
            "name": answer.machine.name,
            "message": answer.message,
            "actuators": answer.actuators,
            "units": answer.units,
            "coordinates": answer.coordinates,
            "unloaded": answer.unloaded,
            "error_before": answer.before,
            "error_left": answer.left,
            "rotation_left": answer.turned,
        }
    )
