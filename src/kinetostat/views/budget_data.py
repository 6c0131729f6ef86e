"""The numbers of an error budget as tables: contributions and poses as CSV, and a labelled dataset. SI throughout."""

from typing import Any

import numpy as np
import xarray as xr

from kinetostat.kinematics.status import Status
from kinetostat.studies.budget import STATISTICS, Budget
from kinetostat.studies.datasets import ABOUT_POSES, ABOUT_STATUS, origin_of
from kinetostat.units import KINDS
from kinetostat.views.data_forms import columns_csv


def varied_fields(answer: Budget) -> dict[str, tuple[Any, str]]:
    """Return the coordinates that vary over the poses, by path: values at each pose, and their unit."""
    if answer.question is not None:
        columns, labels = answer.question.grid.columns(0, answer.question.grid.size), answer.question.labels
        paths = zip(answer.question.fields, answer.question.grid.axes, labels.coords, strict=True)
        return {path: (columns[axis.paths[0]], labels[name].attrs["units"]) for path, axis, name in paths}
    if answer.poses is None:
        return {}
    return {f.path: (values, f.unit) for f, values in zip(answer.poses.fields, answer.poses.values, strict=True)}


def contributions_csv(answer: Budget) -> str:
    """Write the share of each tolerance in the variance of each measure as CSV, the most important first."""
    order = answer.ranking
    parts = [answer.parts[place] for place in order]
    columns: dict[str, Any] = {"path": [part.path for part in parts], "meaning": [part.words for part in parts]}
    columns |= {name: [getattr(part, name) for part in parts] for name in ("leg", "group", "line")}
    columns |= {"tolerance": [part.limit for part in parts], "unit": [KINDS[part.kind].unit for part in parts]}
    rows = zip(answer.measures, answer.shares[:, order].tolist(), strict=True)
    return columns_csv(columns | {f"share {name}": shares for name, shares in rows})


def poses_csv(answer: Budget) -> str | None:
    """Write the error at each pose as CSV: its number from 1, its fields, its status, each measure.

    Returns:
        The text; None if there is a single pose.
    """
    if len(answer.status) == 1:
        return None
    columns: dict[str, Any] = {"pose": range(1, len(answer.status) + 1)}
    columns |= {
        f"{path.removeprefix('pose.')} [{unit}]": values for path, (values, unit) in varied_fields(answer).items()
    }
    columns["status"] = [Status(code).word for code in answer.status.tolist()]
    for statistic in STATISTICS:
        for measure, unit in zip(answer.measures, answer.units, strict=True):
            columns[f"{statistic} {measure} [{unit}]"] = answer.size(statistic, measure)
    return columns_csv(columns)


def budget_dataset(answer: Budget) -> xr.Dataset:
    """Label the errors at all poses: over the grid, or over the dimension `pose` of a list.

    Variables are named by statistic and measure, "usual_position"; units are in `attrs`, and NaN stands where the
    status is not ok (0).
    """
    labels = _labels(answer) if answer.question is None else answer.question.labels
    dims = tuple(map(str, labels.dims))
    shape = tuple(labels.sizes[dim] for dim in dims)
    variables: dict[str, Any] = {"status": (dims, answer.status.reshape(shape), ABOUT_STATUS)}
    for statistic, title in STATISTICS.items():
        for measure, unit in zip(answer.measures, answer.units, strict=True):
            attributes = {"units": unit, "symbol": f"{measure}, {title}", "long_name": f"{measure} error"}
            sizes = answer.size(statistic, measure).reshape(shape)
            variables[f"{statistic}_{measure.replace(' ', '_')}"] = (dims, sizes, attributes)
    return labels.assign(variables)


def _labels(answer: Budget) -> xr.Dataset:
    """Return the coordinates and attributes of a list of poses."""
    coordinates: dict[str, Any] = {"pose": ("pose", np.arange(1, len(answer.status) + 1), ABOUT_POSES)}
    varied = [] if answer.poses is None else list(answer.poses.leaves)
    pairs = [] if answer.poses is None else zip(answer.poses.fields, answer.poses.values, strict=True)
    for field, values in pairs:
        coordinates[field.dimension] = ("pose", values, {"units": field.unit, "field": field.path})
    return xr.Dataset({}, coordinates, origin_of(answer.machine, varied, answer.loads_left_out))
