"""Tables of sweeps, maps and workspaces on a terminal, with units.

They live apart from `tables`, because datasets take long to import.
"""

from collections.abc import Iterator, Mapping, Sequence

import xarray as xr
from rich.console import Console

from kinetostat.display import Display, number
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, group_of, spoken
from kinetostat.machine.limits import Limits, unlimited
from kinetostat.machine.parameters import dimension, shown
from kinetostat.studies.grid import failures, field_of
from kinetostat.studies.stored_grid import Extremes, StoredGrid
from kinetostat.studies.workspace import FEWEST_CELLS, LEFT_OUT, Workspace
from kinetostat.studies.workspace_verdicts import INSIDE, phrase
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY
from kinetostat.views.tables import numeric_table

LONGEST = 60
"""Rows of a sweep that are printed one by one; of longer ones and of maps, the extremes."""


def print_dataset(console: Console, dataset: xr.Dataset, names: Sequence[str]) -> None:
    """A one-dimensional dataset as a table; of a larger one, the extremes of each quantity."""
    if len(dataset["status"].dims) == 1 and dataset["status"].size <= LONGEST:
        _print_curve(console, dataset, names)
    else:
        extremes = {name: _extremes(dataset[name]) for name in names}
        sizes = {shown(field_of(dataset[d])): n for d, n in dataset.sizes.items()}
        _print_extremes(console, dataset.attrs["machine"], sizes, extremes, display_of(dataset))
    print_failures(console, dataset)


def print_grid(console: Console, dataset: xr.Dataset) -> None:
    """Print a dataset with all its quantities, see `print_dataset`."""
    print_dataset(console, dataset, quantities_of(dataset))


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


ERRORS = 2
"""Standard errors that are printed: the truth lies within them 95 times of 100."""


def print_workspace(console: Console, workspace: Workspace) -> None:
    """Volume, why the rest is outside, how far the inside extends, and what it asks of the machine."""
    display = display_of(workspace.dataset)
    for line in _summary(workspace):
        console.print(line, highlight=False)
    total = workspace.dataset["verdict"].size
    table = numeric_table(f"Nodes of the grid ({total:,})", "", ["nodes", "share"])
    for label, count in sorted(workspace.nodes.items(), key=lambda item: (item[0] != INSIDE, -item[1])):
        if count:
            table.add_row(phrase(label), f"{count:,}", f"{100.0 * count / total:.3g} %")
    console.print(table)
    if workspace.extents:
        _print_extents(console, workspace)
    if workspace.demands:
        table = numeric_table("Demands on the machine within the workspace", "", ["from", "to", ""])
        for demand in workspace.demands:
            cells = (display.number(value, demand.unit) for value in (demand.least, demand.greatest))
            table.add_row(demand.title, *cells, display.scale(demand.unit).unit)
        console.print(table)


def _summary(workspace: Workspace) -> Iterator[str]:
    volume = workspace.volume
    name = "Area" if len(workspace.dataset["verdict"].dims) == 2 else "Volume"
    yield workspace.dataset.attrs["machine"]
    if volume.cells < FEWEST_CELLS:
        cells = "1 cell" if volume.cells == 1 else f"{volume.cells:,} cells"
        yield (
            f"{name}: about {volume.value:.2g} {volume.unit} ({100.0 * volume.share:.3g} % of the box). The grid is "
            f"too coarse to say how far that may be wrong: it has {cells}; give the axes more points, for "
            f"{FEWEST_CELLS} cells or more."
        )
    else:
        yield (
            f"{name}: {volume.value:.5g} ± {ERRORS * volume.standard_error:.2g} {volume.unit} "
            f"({100.0 * volume.share:.4g} % of the box; two random points in each of {volume.cells:,} cells, ± two "
            "standard errors)."
        )
    if volume.unknown_cells:
        yield (
            f"It may be larger by up to {volume.unknown:.2g} {volume.unit}: in {volume.unknown_cells:,} of the cells a "
            "point did not converge or is undecided. Whether it belongs to the workspace is not known; it counts as "
            "outside."
        )
    if "assembly_mode" in workspace.dataset.attrs:
        yield "The machine keeps to the assembly mode of its home pose, the one in which its legs are written down."
    if not workspace.limits:
        yield unlimited(Limits())
    if LEFT_OUT in workspace.dataset.attrs:
        yield str(workspace.dataset.attrs[LEFT_OUT])
    if not workspace.exists:
        yield "No pose of the box is in the workspace; the table shows why."
    elif workspace.connected is None:
        yield "The pose of the file is outside the workspace, so it is unknown which part can be reached from it."
    elif workspace.connected < 1.0:
        yield f"Only {100.0 * workspace.connected:.3g} % of the workspace is connected with the pose of the file."
    if not workspace.singularities_divide:
        yield (
            "Singularities are not borders here: they do not divide the poses of this machine, or the pose of the file "
            "is singular."
        )


def _print_extents(console: Console, workspace: Workspace) -> None:
    display = display_of(workspace.dataset)
    table = numeric_table("Extent of the workspace", "", ["from", "to", ""])
    for field, ends in workspace.extents.items():
        unit = workspace.dataset[dimension(field)].attrs["units"]
        low, high = (display.number(float(end), unit) for end in ends)
        table.add_row(shown(field), low, high, display.scale(unit).unit)
    console.print(table)
