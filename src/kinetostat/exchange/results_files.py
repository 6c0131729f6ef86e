"""Result files: the dataset of an analysis as NetCDF, as CSV and as a MATLAB file. Nothing is computed here."""

import csv
import io
import re
from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.io import savemat

from kinetostat.exchange.results import UNITS, as_dataset, pose_of, reference_point, unit_of
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.plain_data import no_formula
from kinetostat.studies.storage import replacing, write_dataset, write_text

CSV_HEADER = ("quantity", "row", "column", "value", "unit")
ABOUT = ("machine", "family", "frame", "kinetostat")
"""Attributes at the top of a CSV file: a line "about" each, their values in the columns of names."""

Line = tuple[str, str, str, float]
Unit = Callable[[str, str, str], str]


def write_netcdf(analysis: Analysis, path: Path) -> list[Path]:
    """Write the results as NetCDF-4."""
    write_dataset(path, as_dataset(analysis))
    return [path]


def write_csv(analysis: Analysis, path: Path) -> list[Path]:
    """Write the results as CSV, one number a line."""
    dataset = as_dataset(analysis)
    write_lines(path, dataset, partial(_unit, dataset))
    return [path]


def write_lines(path: Path, dataset: xr.Dataset, unit: Unit) -> None:
    """Write a dataset as CSV, one number a line: its names, all its digits and its unit; NaN is left empty.

    Args:
        path: of the file.
        dataset: with the attributes of `ABOUT`.
        unit: of a number by its variable, row and column.

    Raises:
        InputError: the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(CSV_HEADER)
    for key in ABOUT:
        writer.writerow(("about", key, no_formula(str(dataset.attrs[key])), "", ""))
    for quantity, row, column, value in _lines(dataset):
        shown = "" if value != value else repr(value)
        writer.writerow((quantity, no_formula(row), no_formula(column), shown, unit(quantity, row, column)))
    write_text(path, text.getvalue())


def _lines(dataset: xr.Dataset) -> Iterator[Line]:
    """Every number of a dataset: quantity, label of its row, label of its column, value."""
    for name, variable in dataset.data_vars.items():
        sizes = variable.sizes
        for place in product(*(range(size) for size in sizes.values())):
            labels = [_label(dataset, str(dim), i) for dim, i in zip(sizes, place, strict=True)]
            row, column = (*labels, "", "")[:2]
            yield str(name), row, column, float(variable.values[place])


def _label(dataset: xr.Dataset, dim: str, i: int) -> str:
    """The label of a place along a dimension, or its number."""
    return str(dataset[dim].values[i]) if dim in dataset.coords else str(i + 1)


def _unit(dataset: xr.Dataset, name: str, row: str, column: str) -> str:
    if name in UNITS:
        return unit_of(name, row, column)
    if name == "spring_stiffness":
        return str(dataset["spring_unit"].sel(spring=row).values)
    return str(dataset[name].attrs["units"])


def write_mat(analysis: Analysis, path: Path) -> list[Path]:
    """Write K, C, pose and reference point as a MATLAB file (level 5)."""
    with replacing(path) as temporary:
        savemat(temporary, matlab_variables(analysis), appendmat=False, long_field_names=True, oned_as="column")
    return [path]


def matlab_variables(analysis: Analysis) -> dict[str, Any]:
    """Return the variables of a MATLAB file and their `units`; K and C are [] where they are not finite."""
    if analysis.platform is None:
        raise ValueError("an analysis without a result cannot be exported")
    position, rotation = analysis.platform
    pose = {_matlab_name(name.removeprefix("pose_")): variable for name, variable in pose_of(analysis).items()}
    return {
        "name": analysis.machine.name,
        "K": _matrix(analysis.stiffness),
        "C": _matrix(analysis.compliance),
        "order": np.array(analysis.components, dtype=object),
        "axes": analysis.axes,
        "reference_point": np.array([reference_point(analysis)]).T,
        "platform_position": np.array([position]).T,
        "platform_rotation": np.array(rotation),
        "pose": {name: float(value) for name, (_, value, _) in pose.items()},
        "units": {
            "K": ", ".join(UNITS["stiffness"]),
            "C": ", ".join(UNITS["compliance"]),
            "reference_point": "m, base frame",
            "platform_position": "m, base frame",
            "pose": {name: attributes["units"] for name, (_, _, attributes) in pose.items()},
        },
    }


def _matrix(rows: list[list[float]] | None) -> Any:
    return np.zeros((0, 0)) if rows is None else np.array(rows)


def _matlab_name(text: str) -> str:
    """A name that MATLAB takes for a field: letters, digits and underscores, a letter first, at most 63."""
    return re.sub(r"\W", "_", text if text[:1].isalpha() else f"x{text}", flags=re.ASCII)[:63]
