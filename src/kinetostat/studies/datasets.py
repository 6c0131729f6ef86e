"""Datasets of quantities at poses, which Python programs get from `evaluate`, and the labels of all datasets.

Labels are attributes as the CF conventions have them: units, long names, and the meanings of flags.
"""

from collections.abc import Collection, Sequence
from functools import cache, lru_cache
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr

from kinetostat.engine.batch import Progress, silent
from kinetostat.engine.kernel import Identical
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.loading import as_toml
from kinetostat.machine.machine import Machine, frame_of, pose_of
from kinetostat.machine.parameters import Parameter
from kinetostat.spec.arguments import checked
from kinetostat.studies.evaluation import MACHINES_KEPT, MATRICES, PoseAnswers, answers_at
from kinetostat.studies.poses import given_poses
from kinetostat.units import KINDS

# With its first dataset, xarray imports the other array libraries that it finds (pint 0.2 s, dask 0.5 s). This belongs
# to the import of this module: then the first answer takes as long as the others.
xr.Dataset(coords={"pose": [0]})

POSES_KEPT = 10_000
"""Most poses of which the labels of an answer are kept; the labels of more take little of their time."""
LOADS_LEFT_OUT = "loads_left_out"
"""Attribute with the sentence on loads of the file that do not count; missing where all do."""
ABOUT_STATUS = {
    "flag_values": [int(status) for status in Status],
    "flag_meanings": " ".join(status.word for status in Status),
}
"""Attributes of the variable of statuses."""


ABOUT_POSES = {"units": "", "kind": "", "log": 0, "field": "pose.number of the pose"}
"""Attributes of the coordinate that numbers the poses of a list."""


def about_quantity(name: str) -> dict[str, str]:
    """Attributes of the variable of a quantity."""
    quantity = QUANTITIES[name]
    return {"units": quantity.unit, "symbol": quantity.symbol}


def about_field(field: Parameter) -> dict[str, Any]:
    """Attributes of the coordinate of a field."""
    kind = KINDS[field.quantity.kind]
    return {"units": kind.unit, "long_name": field.quantity.meaning, "kind": kind.name}


def origin_of(machine: Machine, varied: Collection[str] = (), uncounted: str = "") -> dict[str, str]:
    """Attributes of a dataset: its machine with all numbers, how it is shown, and where the results hold.

    Args:
        machine: gives all that does not vary.
        varied: leaf paths of the parameters that do.
        uncounted: the loads of its file that do not count, in a sentence; empty if all do.
    """
    return {
        "machine": machine.name,
        "machine_file": _file_of(Identical(machine)),
        "display": machine.display.units,
        "kinetostat": _program_version(),
        "frame": frame_of(machine),
        "pose": _pose_of(Identical(machine), tuple(varied)),
        **({LOADS_LEFT_OUT: uncounted} if uncounted else {}),
    }


@lru_cache(MACHINES_KEPT)
def _file_of(machine: Identical) -> str:
    """The file of a machine, which one that is asked about many times needs once."""
    return as_toml(machine.value)


@lru_cache(MACHINES_KEPT)
def _pose_of(machine: Identical, varied: tuple[str, ...]) -> str:
    """The coordinates of its pose that do not vary, as `pose_of` writes them."""
    return pose_of(machine.value, varied)


@cache
def _program_version() -> str:
    """The version of kinetostat: reading it from the installation takes longer than evaluating a pose."""
    return version("kinetostat")


@checked
def evaluate(
    machine: Machine,
    poses: Any,
    quantities: Sequence[str] = ("free_stiffness",),
    progress: Progress = silent,
) -> xr.Dataset:
    """Evaluate quantities at poses of your own, all of them at once: a thousand take some hundredths of a second.

    Args:
        machine: gives all fields that the poses do not name.
        poses: a DataFrame or a dictionary with a column for each field that changes (numbers in SI, or texts with a
            unit; a single value holds for all poses); an array [poses x coordinates of the pose], SI; an xarray
            Dataset, whose dimensions together make the poses; or the path of a CSV file.
        quantities: names of quantities or groups; "K" and "C" give the whole matrices.
        progress: receives how far the work is.

    Returns:
        Over the dimension `pose`: `status`, a variable for each quantity, K and C as (pose, row, column), and each
        given field as a coordinate, SI; units in `attrs`. Where the status is not ok (0), results are NaN.

    Raises:
        InputError: names the argument and what is wrong with it: poses that are not a table, an unknown field or
            quantity, a value that is not finite or not allowed.
    """
    return as_dataset(answers_at(machine, given_poses(machine, poses), quantities, progress))


def as_dataset(answers: PoseAnswers) -> xr.Dataset:
    """Label answers: dimensions pose, and row and column of K and C."""
    poses = answers.poses
    fields = {field.dimension: values for field, values in zip(poses.fields, poses.values, strict=True)}
    values = {"status": answers.status, **{name: answers.values[name] for name in answers.names}, **fields}
    values |= {matrix: answers.matrix(matrix) for matrix in answers.matrices}
    layout = _layout if poses.count <= POSES_KEPT else _layout.__wrapped__
    empty = layout(
        Identical(answers.machine),
        tuple(Identical(field) for field in poses.fields),
        answers.names,
        answers.matrices,
        poses.count,
        answers.loads_left_out,
    )
    dataset = empty.copy(data=values).set_coords(list(fields))
    labels = {name: ("pose", label) for name, label in poses.labels.items()}
    return dataset.assign_coords(labels) if labels else dataset


@lru_cache(MACHINES_KEPT)
def _layout(
    machine: Identical,
    fields: tuple[Identical, ...],
    names: tuple[str, ...],
    matrices: tuple[str, ...],
    count: int,
    uncounted: str,
) -> xr.Dataset:
    """Return a dataset without values, whose copies take them: xarray makes a copy in a third of the time.

    Fields are variables in it, because copies take the values of variables alone.
    """
    nothing, parts = np.broadcast_to(0.0, count), machine.value.family.component_names
    coordinates: dict[str, Any] = {"pose": ("pose", np.arange(count), ABOUT_POSES)}
    for field in (each.value for each in fields):
        coordinates[field.dimension] = ("pose", nothing, {**about_field(field), "path": field.path})
    variables: dict[str, Any] = {name: ("pose", nothing, about_quantity(name)) for name in names}
    if matrices:
        coordinates |= {"row": list(parts), "column": list(parts)}
    for matrix in matrices:
        units = "SI: N·m/rad, N/rad, N/m" if matrix == "K" else "SI: rad/(N·m), rad/N, m/N"
        described = {"long_name": f"{MATRICES[matrix]} matrix", "units": units}
        entries = np.broadcast_to(0.0, (count, len(parts), len(parts)))
        variables[matrix] = (("pose", "row", "column"), entries, described)
    leaves = [leaf for field in fields for leaf in field.value.leaves]
    return xr.Dataset(
        {"status": ("pose", nothing, ABOUT_STATUS), **variables},
        coordinates,
        origin_of(machine.value, leaves, uncounted),
    ).reset_coords([field.value.dimension for field in fields])
