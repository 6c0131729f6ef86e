"""The answer to a question about a grid as plain data, for `--json`. Nothing is computed here."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.studies.grid.stored_grid import StoredGrid
from kinetostat.studies.grid.tally import Extremes


def as_plain_data(dataset: xr.Dataset) -> dict[str, Any]:
    """A dataset as plain data for `--json`: coordinates, nested lists; null where there is no finite value."""
    coordinates = {
        str(dim): {"units": dataset[dim].attrs["units"], "values": dataset[dim].values.tolist()}
        for dim in dataset["status"].dims
    }
    variables = {
        str(name): {"units": data.attrs["units"], "values": _finite_lists(data.values)}
        for name, data in dataset.data_vars.items()
        if name != "status"
    }
    words = np.array([status.word for status in Status])[dataset["status"].values]
    return {
        "name": dataset.attrs["machine"],
        "coordinates": coordinates,
        "variables": variables,
        "status": words.tolist(),
    }


def _finite_lists(values: npt.NDArray[np.float64]) -> Any:
    written: npt.NDArray[Any] = values.astype(object)
    written[~np.isfinite(values)] = None
    return written.tolist()


def as_summary(stored: StoredGrid) -> dict[str, Any]:
    """What is worth knowing of a grid in a file: where it is, its axes, counts and extremes."""
    question = stored.question
    axes = zip(question.dims, question.grid.axes, strict=True)
    coordinates = {
        dim: {
            "units": question.labels[dim].attrs["units"],
            "from": float(axis.values[0]),
            "to": float(axis.values[-1]),
            "count": len(axis.values),
        }
        for dim, axis in axes
    }
    return {
        "name": question.machine.name,
        "file": str(stored.path),
        "points": question.grid.size,
        "coordinates": coordinates,
        "variables": {name: _as_plain(name, one) for name, one in stored.tally.extremes.items()},
        "status": {status.word: count for status, count in stored.tally.statuses.items()},
    }


def _as_plain(name: str, one: Extremes) -> dict[str, Any]:
    numbers = {"least": one.least, "mean": one.mean, "largest": one.largest}
    return {"units": QUANTITIES[name].unit} | {k: v if math.isfinite(v) else None for k, v in numbers.items()}
