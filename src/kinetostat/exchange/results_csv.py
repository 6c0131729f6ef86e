"""The results of an analysis as CSV: one number a line, with the names of its row and column and its unit."""

import csv
import io
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import xarray as xr

from kinetostat.exchange.results import UNITS, as_dataset, unit_of
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_text

HEADER = ("quantity", "row", "column", "value", "unit")

ABOUT = ("machine", "family", "frame", "kinetostat")
"""Attributes that are told first, in the columns of names: a line each, "about", with no value."""

Line = tuple[str, str, str, float, str]


def lines_of(dataset: xr.Dataset) -> Iterator[Line]:
    """Every number of a dataset: quantity, label of its row, label of its column, value, unit."""
    for name, variable in dataset.data_vars.items():
        sizes = variable.sizes
        for place in product(*(range(size) for size in sizes.values())):
            labels = [_label(dataset, str(dim), i) for dim, i in zip(sizes, place, strict=True)]
            row, column = (*labels, "", "")[:2]
            yield str(name), row, column, float(variable.values[place]), _unit(dataset, str(name), row, column)


def _label(dataset: xr.Dataset, dim: str, i: int) -> str:
    """What a place along a dimension is called: its label, or its number."""
    return str(dataset[dim].values[i]) if dim in dataset.coords else str(i + 1)


def _unit(dataset: xr.Dataset, name: str, row: str, column: str) -> str:
    if name in UNITS:
        return unit_of(name, row, column)
    if name == "spring_stiffness":
        return str(dataset["spring_unit"].sel(spring=row).values)
    return str(dataset[name].attrs["units"])


def write(analysis: Analysis, path: Path) -> list[Path]:
    """Write the results as CSV; numbers with all their digits, empty where there is none."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    dataset = as_dataset(analysis)
    for key in ABOUT:
        writer.writerow(("about", key, dataset.attrs[key], "", ""))
    for quantity, row, column, value, unit in lines_of(dataset):
        writer.writerow((quantity, row, column, "" if value != value else repr(value), unit))
    write_text(path, text.getvalue())
    return [path]
