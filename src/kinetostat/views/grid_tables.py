"""Sweeps and maps as tables on a terminal, with units. Apart from `tables`, because datasets take long to import."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import xarray as xr
from rich.console import Console

from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.studies.grid.grid import failures
from kinetostat.studies.grid.stored_grid import Extremes, StoredGrid
from kinetostat.views.display import family_of_names, spoken
from kinetostat.views.tables import number, numeric_table

LONGEST = 60
"""Rows of a sweep that are printed one by one; of longer ones and of maps, the extremes."""


def print_dataset(console: Console, dataset: xr.Dataset, names: Sequence[str]) -> None:
    """A one-dimensional dataset as a table; of a larger one, the extremes of each quantity."""
    if len(dataset["status"].dims) == 1 and dataset["status"].size <= LONGEST:
        _print_curve(console, dataset, names)
    else:
        found = {name: _extremes(dataset[name]) for name in names}
        _print_extremes(console, dataset.attrs["machine"], {str(d): n for d, n in dataset.sizes.items()}, found)
    _print_failures(console, failures(dataset), dataset["status"].size)


def print_stored(console: Console, stored: StoredGrid) -> None:
    """A grid in a file: the extremes of each quantity, and what was there before."""
    question = stored.question
    sizes = dict(zip(question.dims, question.grid.shape, strict=True))
    _print_extremes(console, question.machine.name, sizes, stored.tally.extremes)
    failed: dict[Status, int] = {
        status: count for status, count in stored.tally.statuses.items() if status != Status.OK
    }
    _print_failures(console, failed, question.grid.size)
    if stored.computed < stored.chunks:
        console.print(f"{stored.chunks - stored.computed:,} of {stored.chunks:,} chunks had been computed before.")


def print_written(console: Console, paths: Iterable[Path]) -> None:
    """Which files were written."""
    for path in paths:
        console.print(f"wrote {path}", highlight=False)


def _print_failures(console: Console, counts: Mapping[Status, int], size: int) -> None:
    for status, count in counts.items():
        console.print(
            f"{count:,} of {size:,} points have no result ({status.word.replace('_', ' ')}). {status.sentence}"
        )


def _print_curve(console: Console, dataset: xr.Dataset, names: Sequence[str]) -> None:
    (across,) = dataset["status"].dims
    coordinate = dataset[across]
    group = family_of_names(names)
    title = f"{dataset.attrs['machine']}: {spoken(group)}".removesuffix(": ")
    heads = [f"{spoken(name.removeprefix(f'{group}_'))}\n{QUANTITIES[name].unit}" for name in names]
    table = numeric_table(title, f"{across}\n{coordinate.attrs['units']}", heads)
    for i, value in enumerate(coordinate.values):
        table.add_row(number(float(value)), *(number(float(dataset[name].values[i])) for name in names))
    console.print(table)


def _extremes(data: xr.DataArray) -> Extremes:
    return Extremes(float(data.min()), float(data.mean()), float(data.max()))


def _print_extremes(console: Console, machine: str, sizes: Mapping[str, int], extremes: Mapping[str, Extremes]) -> None:
    size = " × ".join(f"{dim} ({count})" for dim, count in sizes.items())
    table = numeric_table(f"{machine}: {size}", "quantity", ["unit", "least", "mean", "largest"])
    for name, found in extremes.items():
        statistics = (found.least, found.mean, found.largest)
        table.add_row(name, QUANTITIES[name].unit, *(number(value) for value in statistics))
    console.print(table)
