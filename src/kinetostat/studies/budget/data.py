"""An error budget as data: JSON, CSV of its contributions or of its poses, and a labelled dataset. SI throughout."""

import csv
import io
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from kinetostat.kinematics.status import Status
from kinetostat.studies.budget.budget import Budget
from kinetostat.studies.datasets import ABOUT_STATUS, origin_of
from kinetostat.studies.plain_data import as_answer, no_formula
from kinetostat.units import KINDS

STATISTICS = {
    "mean": "of the average machine",
    "rms": "root mean square",
    "rss": "root sum square",
    "usual": "95 %",
    "worst": "worst case",
}
"""The statistics of a measure, and what people call them."""


def as_json(budget: Budget) -> dict[str, Any]:
    """Return a budget as plain data, SI; null at poses without a result."""
    spread = budget.spread
    return as_answer(
        {
            "name": budget.machine.name,
            "message": budget.message,
            "tolerances": {line.about: line.text for line in budget.tolerances},
            "measures": dict(zip(budget.measures, budget.units, strict=True)),
            "leading_measure": budget.leading,
            "status": [Status(code).word for code in budget.status.tolist()],
            "poses": {path: values for path, (values, _) in _fields(budget).items()},
            "errors": {name: _by_measure(budget, getattr(spread, name)) for name in STATISTICS},
            "usual_everywhere": dict(zip(budget.measures, spread.everywhere.tolist(), strict=True)),
            "machines": budget.samples,
            "contributions": [
                {
                    "path": part.path,
                    "meaning": part.words,
                    "leg": part.leg,
                    "group": part.group,
                    "line": part.line,
                    "tolerance": part.limit,
                    "unit": KINDS[part.kind].unit,
                    "distribution": "normal" if part.normal else "uniform",
                    "shares": dict(zip(budget.measures, row, strict=True)),
                }
                for part, row in zip(budget.parts, budget.shares.T.tolist(), strict=True)
            ],
            "shares_by_line": budget.shares_by("line"),
            "shares_by_leg": budget.shares_by("leg"),
            "pressed_joints": budget.pressed,
            "sometimes_pressed_joints": budget.sometimes,
            "freedoms": budget.freedoms,
            "parasitic": budget.parasitic,
            "exact": _exact(budget),
            "allocation": budget.allocation,
        }
    )


def _by_measure(budget: Budget, table: Any) -> dict[str, Any]:
    """A statistic [poses x measures] by measure: a number at a single pose, else a list."""
    columns = dict(zip(budget.measures, table.T, strict=True))
    return {name: float(column[0]) if len(column) == 1 else column for name, column in columns.items()}


def _exact(budget: Budget) -> dict[str, Any] | None:
    exact = budget.exact
    if exact is None:
        return None
    tables = {name: getattr(exact, name) for name in ("rms", "usual", "difference", "unexplained")}
    by_measure = {name: dict(zip(budget.measures, table.tolist(), strict=True)) for name, table in tables.items()}
    return {"machines": exact.machines, "failed": exact.failed, **by_measure}


def _fields(budget: Budget) -> dict[str, tuple[Any, str]]:
    """The coordinates that vary over the poses, by path: values at each pose, and their unit."""
    if budget.question is not None:
        columns, labels = budget.question.grid.columns(0, budget.question.grid.size), budget.question.labels
        paths = zip(budget.question.fields, budget.question.grid.axes, labels.coords, strict=True)
        return {path: (columns[axis.paths[0]], labels[name].attrs["units"]) for path, axis, name in paths}
    if budget.poses is None:
        return {}
    pairs = zip(budget.poses.fields, budget.poses.values, strict=True)
    return {field.path: (values, field.unit) for field, values in pairs}


def contributions_csv(budget: Budget) -> str:
    """Write the share of each tolerance in the variance of each measure as CSV, the most important first."""
    order = budget.ranking
    rows = [
        [
            *map(no_formula, (part.path, part.words, part.leg, part.group, part.line)),
            part.limit,
            KINDS[part.kind].unit,
            *row,
        ]
        for part, row in ((budget.parts[i], budget.shares[:, i].tolist()) for i in order)
    ]
    heads = ["path", "meaning", "leg", "group", "line", "tolerance", "unit", *(f"share {n}" for n in budget.measures)]
    return _csv(heads, rows)


def poses_csv(budget: Budget) -> str:
    """Write the error at each pose as CSV: its number from 1, its fields, its status, and each measure."""
    columns: dict[str, Any] = {"pose": range(1, len(budget.status) + 1)}
    columns |= {f"{path.removeprefix('pose.')} [{unit}]": values for path, (values, unit) in _fields(budget).items()}
    columns["status"] = [Status(code).word for code in budget.status.tolist()]
    for statistic in STATISTICS:
        for measure, unit in zip(budget.measures, budget.units, strict=True):
            sizes = budget.size(statistic, measure)
            columns[f"{statistic} {measure} [{unit}]"] = ["" if np.isnan(size) else size for size in sizes.tolist()]
    return _csv(list(columns), zip(*columns.values(), strict=True))


def _csv(heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(rows)
    return text.getvalue()


def as_dataset(budget: Budget) -> xr.Dataset:
    """Label the errors at all poses: over the grid, or over the dimension `pose` of a list.

    Variables are named by statistic and measure, "usual_position"; units are in `attrs`, and NaN stands where the
    status is not ok (0).
    """
    labels = _labels(budget) if budget.question is None else budget.question.labels
    dims = tuple(map(str, labels.dims))
    shape = tuple(labels.sizes[dim] for dim in dims)
    variables: dict[str, Any] = {"status": (dims, budget.status.reshape(shape), ABOUT_STATUS)}
    for statistic, title in STATISTICS.items():
        for measure, unit in zip(budget.measures, budget.units, strict=True):
            about = {"units": unit, "symbol": f"{measure}, {title}", "long_name": f"{measure} error"}
            sizes = budget.size(statistic, measure).reshape(shape)
            variables[f"{statistic}_{measure.replace(' ', '_')}"] = (dims, sizes, about)
    return labels.assign(variables)


def _labels(budget: Budget) -> xr.Dataset:
    """Coordinates and attributes of a list of poses."""
    about = {"units": "", "kind": "", "log": 0, "field": "pose.number of the pose"}
    coordinates: dict[str, Any] = {"pose": ("pose", np.arange(1, len(budget.status) + 1), about)}
    taken: list[str] = []
    if budget.poses is not None:
        taken = list(budget.poses.leaves)
        for field, values in zip(budget.poses.fields, budget.poses.values, strict=True):
            coordinates[field.dimension] = ("pose", values, {"units": field.unit, "field": field.path})
    return xr.Dataset({}, coordinates, origin_of(budget.machine, taken))
