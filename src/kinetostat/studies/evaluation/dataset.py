"""Quantities at poses as a labelled dataset: what Python programs get from `evaluate`."""

from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr

from kinetostat.engine.batch import Progress, silent
from kinetostat.machine.loading import as_toml
from kinetostat.machine.machine import Machine
from kinetostat.spec.arguments import checked
from kinetostat.studies.evaluation.evaluation import MATRICES, PoseAnswers, answers_at
from kinetostat.studies.evaluation.given_poses import given_poses
from kinetostat.studies.grid.grid import ABOUT_STATUS, about
from kinetostat.studies.setting import frame_of, pose_of
from kinetostat.units import KINDS

# With its first dataset, xarray imports the other array libraries that it finds (pint 0.2 s, dask 0.5 s). This belongs
# to the import of this module: then the first answer takes as long as the others.
xr.Dataset(coords={"pose": [0]})


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
    machine, poses = answers.machine, answers.poses
    taken = [leaf for field in poses.fields for leaf in field.leaves]
    attributes = {
        "machine": machine.name,
        "machine_file": as_toml(machine),
        "kinetostat": version("kinetostat"),
        "frame": frame_of(machine),
        "pose": pose_of(machine, taken),
    }
    coordinates: dict[str, Any] = {"pose": np.arange(poses.count)}
    coordinates |= {name: ("pose", values) for name, values in poses.labels.items()}
    for field, values in zip(poses.fields, poses.values, strict=True):
        kind = KINDS[field.quantity.kind]
        described = {"units": kind.unit, "long_name": field.quantity.meaning, "kind": kind.name, "path": field.path}
        coordinates[field.dimension] = ("pose", values, described)
    variables: dict[str, Any] = {name: ("pose", answers.values[name], about(name)) for name in answers.names}
    if answers.matrices:
        names = list(machine.family.component_names)
        coordinates |= {"row": names, "column": names}
    for matrix in answers.matrices:
        units = "SI: N·m/rad, N/rad, N/m" if matrix == "K" else "SI: rad/(N·m), rad/N, m/N"
        described = {"long_name": f"{MATRICES[matrix]} matrix", "units": units}
        variables[matrix] = (("pose", "row", "column"), answers.matrix(matrix), described)
    return xr.Dataset({"status": ("pose", answers.status, ABOUT_STATUS), **variables}, coordinates, attributes)
