"""Sweeps and maps: the questions, and the descriptions of their answers, a dataset or a file."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from kinetostat.arrays import Array
from kinetostat.display import Display, number
from kinetostat.engine.batch import Progress
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, group_of, plain_name
from kinetostat.late import LateModule
from kinetostat.machine.loading import build
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import named_entry, shown
from kinetostat.spec.errors import InputError
from kinetostat.studies.datasets import LOADS_LEFT_OUT as LEFT_OUT_ATTRIBUTE
from kinetostat.studies.datasets import GridQuestion, answer, failures, field_of, grid_question
from kinetostat.studies.quantities import usual_quantities
from kinetostat.studies.stored_grid import Extremes, StoredGrid
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY
from kinetostat.views.question import (
    DISPLACED,
    VARIED,
    Description,
    Field,
    Lines,
    Option,
    Question,
    quantities_option,
    ranges_option,
)
from kinetostat.views.tables import FittedTable, numeric_table

if TYPE_CHECKING:
    from kinetostat.studies import tensions
else:  # it needs states of rest, which most maps do not
    tensions = LateModule("kinetostat.studies.tensions")

MOST_ROWS_OF_A_SWEEP = 60
"""Rows of a sweep that are printed one by one, on two screens; of longer ones and of maps, the extremes."""
MOST_NAMED_SETS = 11
"""Sets of legs that have a row and a colour each; all rarer ones share one more, since twelve colours can be told
apart."""
USUAL_OF_A_SWEEP, USUAL_OF_A_MAP = "stiffness", "compliance"
"""Quantities that are computed where nobody names one."""
ONE_RANGE_OF_A_SWEEP = "sweep varies one parameter; for two or more use `kinetostat map --over ... --over ...`."
CARRYING_ALONE = (
    "--carrying shows which legs carry, not a quantity, and computes in this process; leave out --quantity, --workers, "
    "--cluster and --resume."
)
TWO_RANGES_OF_A_MAP = "map needs two --over ranges or more; for one parameter use `kinetostat sweep --vary ...`."


def display_of(dataset: xr.Dataset) -> Display:
    """Return the units in which a dataset of this version wants to be read."""
    return Display(dataset.attrs.get("display", ""))


def axis_values(dataset: xr.Dataset, name: str) -> tuple[Array, str]:
    """Return the values of a coordinate as an axis shows them, and its label with the unit."""
    coordinate = dataset[name]
    scale = display_of(dataset).scale(coordinate.attrs["units"])
    return coordinate.values * scale.factor, scale.label(_plain(field_of(coordinate)))


def _plain(path: str) -> str:
    """Return a path as an axis label: "pose.x" to "x", "stiffness.passive_links" to "stiffness: passive links"."""
    table, _, field = named_entry(path).partition(".")
    words = field.replace(".", " ").replace("_", " ")
    return words if table == "pose" else f"{table}: {words}"


def machine_of(dataset: xr.Dataset) -> Machine:
    """Build the machine of a dataset from the file that is written in it, in the units in which it wants to be read."""
    return build(dataset.attrs["machine_file"]).in_units(dataset.attrs.get("display", ""))


def quantities_of(dataset: xr.Dataset) -> list[str]:
    """Return the names of the quantities of a dataset."""
    return [str(name) for name in dataset.data_vars if name in QUANTITIES]


def grid_fields(dataset_of: Callable[[Any], xr.Dataset]) -> tuple[Field, ...]:
    """Return the fields of an answer over a grid.

    Args:
        dataset_of: gives its dataset, with a status at each point.
    """

    def words(answer: Any) -> Any:
        return np.array([status.word for status in Status])[dataset_of(answer)["status"].values]

    return (
        Field("name", lambda answer: dataset_of(answer).attrs["machine"]),
        Field("loads_left_out", lambda answer: dataset_of(answer).attrs.get(LEFT_OUT_ATTRIBUTE, "")),
        Field("coordinates", lambda answer: _coordinates(dataset_of(answer))),
        Field("variables", lambda answer: _variables(dataset_of(answer))),
        Field("status", words),
    )


def _coordinates(dataset: xr.Dataset) -> dict[str, Any]:
    coordinates = [dataset[dim] for dim in dataset["status"].dims]
    return {field_of(c): {"units": c.attrs["units"], "values": c.values} for c in coordinates}


def _variables(dataset: xr.Dataset) -> dict[str, Any]:
    variables = {str(name): data for name, data in dataset.data_vars.items() if name != "status"}
    return {name: {"units": data.attrs["units"], "values": data.values} for name, data in variables.items()}


def answered_points(dataset: xr.Dataset) -> bool:
    """Return whether any point of a grid has a result."""
    return bool((dataset["status"] == int(Status.OK)).any())


def lines_of_points(failed: Mapping[Status, int], size: int) -> Lines:
    """Say how many points of a grid have a result, and why the others have none.

    Args:
        failed: number of points of each status other than OK.
        size: number of all points.
    """
    yield "Points", f"{size - sum(failed.values()):,} of {size:,} points have a result."
    for status, count in failed.items():
        word = status.phrase
        yield "No result", f"{count:,} of {size:,} points have no result ({word}). {status.sentence}"


def _tables(dataset: xr.Dataset, full: bool) -> Iterator[FittedTable]:
    """Give a one-dimensional dataset row by row; of a larger one, the extremes of each quantity."""
    names, rows = quantities_of(dataset), dataset["status"].size
    if len(dataset["status"].dims) == 1 and (full or rows <= MOST_ROWS_OF_A_SWEEP):
        yield _curve_table(dataset, names)
    else:
        of_names = ((name, dataset[name]) for name in names)
        extremes = {name: Extremes(float(v.min()), float(v.mean()), float(v.max())) for name, v in of_names}
        yield _extremes_table(size_of(dataset), extremes, display_of(dataset))


def size_of(dataset: xr.Dataset) -> str:
    """Return the fields of a grid with the numbers of their points, such as "x (5) × y (5)"."""
    return _size({shown(field_of(dataset[dim])): count for dim, count in dataset.sizes.items()})


def _size(sizes: Mapping[str, int]) -> str:
    return " × ".join(f"{name} ({count})" for name, count in sizes.items())


def _curve_table(dataset: xr.Dataset, names: Sequence[str]) -> FittedTable:
    (across,) = dataset["status"].dims
    coordinate, display = dataset[across], display_of(dataset)
    group = group_of(names)
    scales = {name: display.fitting(QUANTITIES[name].unit, _of_unit(dataset, name, names)) for name in names}
    heads = [f"{plain_name(name.removeprefix(f'{group}_'))}\n{scales[name].head}" for name in names]
    unit, field = coordinate.attrs["units"], shown(field_of(coordinate))
    table = numeric_table(plain_name(group) or f"Along {field}", f"{field}\n{display.scale(unit).head}", heads)
    for i, value in enumerate(coordinate.values):
        cells = (number(float(dataset[name].values[i]) * scales[name].factor) for name in names)
        table.add_row(display.number(float(value), unit), *cells)
    return table


def _of_unit(dataset: xr.Dataset, name: str, names: Sequence[str]) -> Iterator[float]:
    """Return all values of the quantities that have the unit of one of them."""
    unit = QUANTITIES[name].unit
    return (float(v) for other in names if QUANTITIES[other].unit == unit for v in dataset[other].values.flat)


def _extremes_table(size: str, extremes: Mapping[str, Extremes], display: Display) -> FittedTable:
    table = numeric_table(size, "quantity", ["unit", "least", "mean", "largest"])
    for name, extreme in extremes.items():
        greatest = max(abs(extreme.least), abs(extreme.largest))
        mean = 0.0 if abs(extreme.mean) < ROUND_OFF_OF_ENTRY * greatest else extreme.mean
        statistics = (extreme.least, mean, extreme.largest)
        scale = display.fitting(QUANTITIES[name].unit, statistics)
        table.add_row(name, scale.head, *(number(value * scale.factor) for value in statistics))
    return table


GRID = Description(
    title="Over the grid",
    fields=grid_fields(lambda dataset: dataset),
    lines=lambda dataset: lines_of_points(failures(dataset), dataset["status"].size),
    tables=_tables,
    figures="views.grid_figures.grid_figures",
    makers={"nc": lambda dataset: dataset},
    state=lambda _dataset: "",
    answered=answered_points,
    machine=machine_of,
    files={
        "sweep.nc": lambda dataset: dataset if dataset["status"].ndim == 1 else None,
        "map.nc": lambda dataset: dataset if dataset["status"].ndim > 1 else None,
    },
)


def _stored_coordinates(stored: StoredGrid) -> dict[str, Any]:
    question = stored.question
    return {
        field: {
            "units": question.labels[dim].attrs["units"],
            "from": axis.values[0],
            "to": axis.values[-1],
            "count": len(axis.values),
        }
        for dim, field, axis in zip(question.dims, question.fields, question.grid.axes, strict=True)
    }


def _stored_variables(stored: StoredGrid) -> dict[str, Any]:
    extremes = stored.tally.extremes.items()
    return {name: {"units": QUANTITIES[name].unit, **vars(extreme)} for name, extreme in extremes}


def _stored_lines(stored: StoredGrid) -> Lines:
    failed: dict[Status, int] = {
        status: count for status, count in stored.tally.statuses.items() if status != Status.OK
    }
    yield from lines_of_points(failed, stored.question.grid.size)
    yield "File", f"All points are in {stored.path}."
    if stored.computed < stored.chunks:
        before = stored.chunks - stored.computed
        yield "Resumed", f"{before:,} of {stored.chunks:,} chunks had been computed before."


def _stored_tables(stored: StoredGrid, _full: bool) -> Iterator[FittedTable]:
    question = stored.question
    size = _size(dict(zip(map(shown, question.fields), question.grid.shape, strict=True)))
    yield _extremes_table(size, stored.tally.extremes, question.machine.display)


def frequent_sets(carrying: "tensions.Carrying") -> Iterator[tuple[str, int]]:
    """Name each frequent set of legs that carry, and how many points it has; all others together."""
    for legs, count in list(zip(carrying.sets, carrying.points, strict=True))[:MOST_NAMED_SETS]:
        yield "all" if legs == carrying.legs else ", ".join(legs) or "none", count
    if rare := carrying.points[MOST_NAMED_SETS:]:
        yield f"{len(rare):,} other sets", sum(rare)


def _set_tables(carrying: "tensions.Carrying", _full: bool) -> Iterator[FittedTable]:
    table = numeric_table(size_of(carrying.dataset), "legs that carry", ["points", "share"])
    for name, count in frequent_sets(carrying):
        table.add_row(name, f"{count:,}", f"{100.0 * count / carrying.dataset['status'].size:.3g} %")
    yield table


def _sets(carrying: "tensions.Carrying") -> list[dict[str, Any]]:
    return [{"legs": legs, "points": count} for legs, count in zip(carrying.sets, carrying.points, strict=True)]


CARRYING = Description(
    title="Legs that carry",
    fields=(*grid_fields(attrgetter("dataset")), Field("sets", _sets)),
    lines=lambda carrying: lines_of_points(failures(carrying.dataset), carrying.dataset["status"].size),
    tables=_set_tables,
    figures="views.grid_figures.carrying_figures",
    makers={"nc": attrgetter("dataset")},
    state=lambda _carrying: "",
    answered=lambda carrying: bool(carrying.sets),
    files={"carrying.nc": "nc"},
)


STORED_GRID = Description(
    title="Over the grid",
    fields=(
        Field("name", "question.machine.name"),
        Field("loads_left_out", lambda stored: stored.question.labels.attrs.get(LEFT_OUT_ATTRIBUTE, "")),
        Field("file", lambda stored: str(stored.path)),
        Field("points", "question.grid.size"),
        Field("coordinates", _stored_coordinates),
        Field("variables", _stored_variables),
        Field("status", lambda stored: {status.word: count for status, count in stored.tally.statuses.items()}),
    ),
    lines=_stored_lines,
    tables=_stored_tables,
    figures="views.grid_figures.stored_figures",
    state=lambda _stored: "",
    answered=lambda stored: stored.tally.answered,
    machine="question.machine",
)


def sweep_question(machine: Machine, ranges: Sequence[str], quantities: Sequence[str] = ()) -> GridQuestion:
    """Read a question about quantities along a single range; the usual ones if none is named.

    Raises:
        InputError: more than one range, or what `grid_question` refuses.
    """
    if len(ranges) > 1:
        raise InputError(ONE_RANGE_OF_A_SWEEP)
    return grid_question(machine, ranges, quantities or usual_quantities(machine, USUAL_OF_A_SWEEP))


def map_question(machine: Machine, ranges: Sequence[str], quantities: Sequence[str] = ()) -> GridQuestion:
    """Read a question about quantities over several ranges; the usual ones if none is named.

    Raises:
        InputError: a single range, or what `grid_question` refuses.
    """
    if len(ranges) < 2:
        raise InputError(TWO_RANGES_OF_A_MAP)
    return grid_question(machine, ranges, quantities or usual_quantities(machine, USUAL_OF_A_MAP))


def sweep(machine: Machine, ranges: Sequence[str], progress: Progress, quantities: Sequence[str] = ()) -> xr.Dataset:
    """Evaluate quantities along one parameter; arguments and errors as for `sweep_question`."""
    return answer(sweep_question(machine, ranges, quantities), progress)


def map_or_carrying_legs(
    machine: Machine,
    ranges: Sequence[str],
    progress: Progress,
    quantities: Sequence[str] = (),
    carrying: bool = False,
) -> "xr.Dataset | tensions.Carrying":
    """Evaluate quantities over two parameters or more, or find which legs carry there.

    Raises:
        InputError: a single range, quantities of legs that carry, or what `map_question` or `carrying_legs` refuses.
    """
    if not carrying:
        return answer(map_question(machine, ranges, quantities), progress)
    if len(ranges) < 2:
        raise InputError(TWO_RANGES_OF_A_MAP)
    if quantities:
        raise InputError(CARRYING_ALONE)
    return tensions.carrying_legs(machine, ranges, progress)


SWEEP_QUESTION = Question(
    example='kinetostat sweep zhang-gosselin-4dof --vary "stiffness.passive_links=1e3:1e10:8:log" '
    "--quantity compliance",
    answer=sweep,
    options=(
        ranges_option("parameter to vary", required=True, metavar=VARIED, word="--vary"),
        quantities_option(USUAL_OF_A_SWEEP),
    ),
    loaded=DISPLACED,
    output="NetCDF and figures",
    reports_progress=True,
    full="print every row of a long sweep",
)
MAP_QUESTION = Question(
    example='kinetostat map zhang-gosselin-4dof --over "x=-2 cm:2 cm:41" --over "z=66 cm:70 cm:41" -o maps',
    answer=map_or_carrying_legs,
    options=(
        ranges_option("an axis of the map", required=True, metavar=VARIED),
        quantities_option(USUAL_OF_A_MAP),
        Option(
            "carrying",
            "flag",
            "instead of quantities: which legs carry under load and which are slack, as regions of the map",
        ),
    ),
    loaded=DISPLACED,
    output="NetCDF and figures",
    reports_progress=True,
)
