"""Tables of sweeps and maps on a terminal, with units.

They live apart from `tables`, because datasets take long to import.
"""

from collections.abc import Iterator, Mapping, Sequence

import xarray as xr
from rich.console import Console

from kinetostat.display import Display, number
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, group_of, spoken
from kinetostat.machine.parameters import shown
from kinetostat.studies.datasets import LOADS_LEFT_OUT
from kinetostat.studies.grid import failures, field_of
from kinetostat.studies.stored_grid import Extremes, StoredGrid
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY
from kinetostat.views.tables import numeric_table

MOST_ROWS_OF_A_SWEEP = 60
"""Rows of a sweep that are printed one by one; of longer ones and of maps, the extremes."""


def print_dataset(console: Console, dataset: xr.Dataset, names: Sequence[str]) -> None:
    """A one-dimensional dataset as a table; of a larger one, the extremes of each quantity."""
    print_uncounted(console, dataset)
    if len(dataset["status"].dims) == 1 and dataset["status"].size <= MOST_ROWS_OF_A_SWEEP:
        _print_curve(console, dataset, names)
    else:
        extremes = {name: _extremes(dataset[name]) for name in names}
        sizes = {shown(field_of(dataset[d])): n for d, n in dataset.sizes.items()}
        _print_extremes(console, dataset.attrs["machine"], sizes, extremes, display_of(dataset))
    print_failures(console, dataset)


def print_grid(console: Console, dataset: xr.Dataset) -> None:
    """Print a dataset with all its quantities, see `print_dataset`."""
    print_dataset(console, dataset, quantities_of(dataset))


def print_uncounted(console: Console, dataset: xr.Dataset) -> None:
    """Print which loads of the file do not count, if there are any."""
    if LOADS_LEFT_OUT in dataset.attrs:
        console.print(dataset.attrs[LOADS_LEFT_OUT], highlight=False)


def quantities_of(dataset: xr.Dataset) -> list[str]:
    """Return the names of the quantities of a dataset."""
    return [str(name) for name in dataset.data_vars if name in QUANTITIES]


def print_failures(console: Console, dataset: xr.Dataset) -> None:
    """Print how many points of a grid have no result, and why."""
    _print_failures(console, failures(dataset), dataset["status"].size)


def display_of(dataset: xr.Dataset) -> Display:
    """Return the units in which a dataset of this version wants to be read."""
    return Display(dataset.attrs.get("display", ""))


def print_stored(console: Console, stored: StoredGrid) -> None:
    """A grid in a file: the extremes of each quantity, and what was there before."""
    question = stored.question
    print_uncounted(console, question.labels)
    sizes = dict(zip(map(shown, question.fields), question.grid.shape, strict=True))
    _print_extremes(console, question.machine.name, sizes, stored.tally.extremes, question.machine.display)
    failed: dict[Status, int] = {
        status: count for status, count in stored.tally.statuses.items() if status != Status.OK
    }
    _print_failures(console, failed, question.grid.size)
    if stored.computed < stored.chunks:
        console.print(f"{stored.chunks - stored.computed:,} of {stored.chunks:,} chunks had been computed before.")


def _print_failures(console: Console, counts: Mapping[Status, int], size: int) -> None:
    for status, count in counts.items():
        console.print(
            f"{count:,} of {size:,} points have no result ({status.word.replace('_', ' ')}). {status.sentence}"
        )


def _print_curve(console: Console, dataset: xr.Dataset, names: Sequence[str]) -> None:
    (across,) = dataset["status"].dims
    coordinate, display = dataset[across], display_of(dataset)
    group = group_of(names)
    title = f"{dataset.attrs['machine']}: {spoken(group)}".removesuffix(": ")
    scales = {name: display.fitting(QUANTITIES[name].unit, _of_unit(dataset, name, names)) for name in names}
    heads = [f"{spoken(name.removeprefix(f'{group}_'))}\n{scales[name].head}" for name in names]
    unit = coordinate.attrs["units"]
    table = numeric_table(title, f"{shown(field_of(coordinate))}\n{display.scale(unit).head}", heads)
    for i, value in enumerate(coordinate.values):
        cells = (number(float(dataset[name].values[i]) * scales[name].factor) for name in names)
        table.add_row(display.number(float(value), unit), *cells)
    console.print(table)


def _of_unit(dataset: xr.Dataset, name: str, names: Sequence[str]) -> Iterator[float]:
    """All values of the quantities that have the unit of one of them."""
    unit = QUANTITIES[name].unit
    return (float(v) for other in names if QUANTITIES[other].unit == unit for v in dataset[other].values.flat)


def _extremes(data: xr.DataArray) -> Extremes:
    return Extremes(float(data.min()), float(data.mean()), float(data.max()))


def _print_extremes(
    console: Console, machine: str, sizes: Mapping[str, int], extremes: Mapping[str, Extremes], display: Display
) -> None:
    size = " × ".join(f"{dim} ({count})" for dim, count in sizes.items())
    table = numeric_table(f"{machine}: {size}", "quantity", ["unit", "least", "mean", "largest"])
    for name, extreme in extremes.items():
        greatest = max(abs(extreme.least), abs(extreme.largest))
        mean = 0.0 if abs(extreme.mean) < ROUND_OFF_OF_ENTRY * greatest else extreme.mean
        statistics = (extreme.least, mean, extreme.largest)
        scale = display.fitting(QUANTITIES[name].unit, statistics)
        table.add_row(name, scale.head, *(number(value * scale.factor) for value in statistics))
    console.print(table)
