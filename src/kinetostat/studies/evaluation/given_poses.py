"""Poses as a Python program gives them: a table, a dictionary, an array, a dataset or the path of a file.

Tables of pandas, polars and xarray are read by what they can do, so that none of these libraries need be there.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kinetostat.machine.machine import Machine
from kinetostat.machine.orientation import angles_of, numbers_for
from kinetostat.machine.parameters import POSE, parameters
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import quantities
from kinetostat.studies.evaluation.columns import Column, PoseColumns, read_columns
from kinetostat.studies.evaluation.pose_file import read_poses

HOW = (
    "give a DataFrame or a dictionary with a column for each field that changes, an array with a column for each "
    "coordinate of the pose, an xarray Dataset, or the path of a CSV file"
)


def given_poses(machine: Machine, poses: Any) -> PoseColumns:
    """Read poses that a Python program gives; see `evaluate`.

    Raises:
        InputError: they are nothing of the kind, name an unknown field, or hold a value that the field does not allow.
    """
    if isinstance(poses, str | Path):
        return read_poses(machine, Path(poses))
    labels: dict[str, Any] = {}
    if hasattr(poses, "data_vars"):
        columns, labels = _of_dataset(poses)
    elif isinstance(poses, Mapping):
        named = numbers_for(quantities(machine.family.tables["pose"]), poses, angles_of)
        columns = [Column(name, entries) for name, entries in named.items()]
    elif hasattr(poses, "columns"):
        columns = [Column(name, poses[name]) for name in poses.columns]
        labels = {"pose": np.asarray(poses.index)} if hasattr(poses, "index") else {}
    else:
        columns = _of_array(machine, poses)
    return read_columns(machine, columns, lambda name, i: f"poses[{name!r}][{i}]", labels)


def _of_dataset(dataset: Any) -> tuple[list[Column], dict[str, Any]]:
    """Return the variables of a dataset, or its coordinates if it has none, over all its dimensions together."""
    names = list(dataset.data_vars) or list(dataset.coords)
    flat = [np.ravel(array) for array in np.broadcast_arrays(*_like(dataset, names))]
    others = [name for name in dataset.coords if name not in names and dataset[name].dims == tuple(dataset.dims)]
    labels = {str(name): dataset[name].values for name in others}
    fields = [str(dataset[name].attrs.get("field", name)) for name in names]
    return [Column(field, values) for field, values in zip(fields, flat, strict=True)], labels


def _like(dataset: Any, names: Sequence[Any]) -> list[Any]:
    """Return variables with a length of one along dimensions that they do not have."""
    return [
        np.expand_dims(
            dataset[name].values, tuple(i for i, dim in enumerate(dataset.dims) if dim not in dataset[name].dims)
        )
        for name in names
    ]


def _of_array(machine: Machine, poses: Any) -> list[Column]:
    coordinates = [p.shown for p in parameters(machine.family) if p.path.startswith(POSE)]
    try:
        array = np.asarray(poses, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"poses is {shorten(poses)}; {HOW}.") from None
    if array.ndim != 2 or array.shape[1] != len(coordinates):
        shape = " x ".join(str(size) for size in array.shape) or "a single number"
        raise InputError(
            f"poses is an array of {shape}; {machine.name} needs a row for each pose with {len(coordinates)} columns: "
            f"{', '.join(coordinates)}. To give some of them by name, use a dictionary or a DataFrame."
        )
    return [Column(name, values) for name, values in zip(coordinates, array.T, strict=True)]
