"""Sweeps and maps as tables on a terminal, with units. Apart from `tables`, because datasets take long to import."""

from collections.abc import Sequence

import xarray as xr
from rich.console import Console

from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.studies.grid import failures
from kinetostat.views.tables import number, numeric_table

LONGEST = 60
"""Rows of a sweep that are printed one by one; of longer ones and of maps, the extremes."""


def print_dataset(console: Console, dataset: xr.Dataset, names: Sequence[str]) -> None:
    """A one-dimensional dataset as a table; of a larger one, the extremes of each quantity."""
    if len(dataset["status"].dims) == 1 and dataset["status"].size <= LONGEST:
        _print_curve(console, dataset, names)
    else:
        _print_extremes(console, dataset, names)
    for status, count in failures(dataset).items():
        console.print(f"{count:,} of {dataset['status'].size:,} points: {status.word}. {status.sentence}")


def _print_curve(console: Console, dataset: xr.Dataset, names: Sequence[str]) -> None:
    (across,) = dataset["status"].dims
    coordinate = dataset[across]
    title = f"{dataset.attrs['machine']}: {', '.join(dict.fromkeys(name.split('_')[0] for name in names))}"
    heads = [f"{name.split('_', 1)[-1]}\n{QUANTITIES[name].unit}" for name in names]
    table = numeric_table(title, f"{across}\n{coordinate.attrs['units']}", heads)
    for i, value in enumerate(coordinate.values):
        table.add_row(number(float(value)), *(number(float(dataset[name].values[i])) for name in names))
    console.print(table)


def _print_extremes(console: Console, dataset: xr.Dataset, names: Sequence[str]) -> None:
    size = " x ".join(f"{dataset.sizes[dim]} {dim}" for dim in dataset["status"].dims)
    table = numeric_table(f"{dataset.attrs['machine']}: {size}", "quantity", ["unit", "least", "mean", "largest"])
    for name in names:
        data = dataset[name]
        statistics = (float(data.min()), float(data.mean()), float(data.max()))
        table.add_row(name, data.attrs["units"], *(number(value) for value in statistics))
    console.print(table)
