"""Labelled datasets of quantities, at poses of a list and over grids of any parameters; and the usual ranges of grids.

Labels are attributes as the CF conventions have them: units, long names, and the meanings of flags. Where nobody gives
the ranges of a map, `usual_ranges` takes coordinates of the pose, as far about it as the machine follows.
"""

import math
from collections.abc import Collection, Sequence
from functools import cache, lru_cache
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr

from kinetostat.arrays import Array
from kinetostat.engine import batch
from kinetostat.engine.batch import Evaluation, Progress, silent
from kinetostat.engine.chunks import Compute, in_chunks, in_this_process
from kinetostat.engine.kernel import Identical
from kinetostat.engine.points import Grid, PointTable
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.limits import limits_set
from kinetostat.machine.loading import as_toml
from kinetostat.machine.machine import Machine, frame_of, pose_of
from kinetostat.machine.parameters import POSE, Parameter, dimension, parameters, values
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import Range, parse_range
from kinetostat.studies.evaluation import MACHINES_KEPT, MATRICES, PoseAnswers, answers_at
from kinetostat.studies.poses import chosen_axes, given_poses, grid_of
from kinetostat.studies.quantities import cable_count, refuse_absent, resolve_quantities, uncounted_loads
from kinetostat.units import KINDS

# With its first dataset, xarray imports the other array libraries that it finds (pint 0.2 s, dask 0.5 s). This belongs
# to the import of this module: then the first answer takes as long as the others.
xr.Dataset(coords={"pose": [0]})

IN_MEMORY = 5_000_000
"""Points of a grid that is answered in memory: a dozen quantities of them fit in half a gigabyte."""
POSES_KEPT = 10_000
"""Most poses of which the labels of an answer are kept; the labels of more take little of their time."""
LOADS_LEFT_OUT = "loads_left_out"
"""Attribute with the sentence on loads of the file that do not count; missing where all do."""
ABOUT_STATUS = {
    "flag_values": [int(status) for status in Status],
    "flag_meanings": " ".join(status.word for status in Status),
}
"""Attributes of the variable of statuses."""
ABOUT_POSES = {"units": "", "kind": "", "log": 0, "field": "pose.number of the pose"}
"""Attributes of the coordinate that numbers the poses of a list. It has no field; axes of figures are labelled by what
follows "pose." in "field"."""

MOST_RANGES_OF_MAPS = 2
"""Greatest number of ranges of the maps of a report: a map has two axes."""
PROBE_STEPS = 48
"""Number of poses to each side that are tried along a coordinate: its range is then known to two percent."""
LARGEST_REACH = {"length": 0.3, "angle": math.radians(15.0)}
"""Greatest distance of an end of a range from the pose, by kind of coordinate: a share of the characteristic length, or
rad. Machines commonly work within about as much."""
LARGEST_REACH_IN_LIMITS = {"length": 1.0, "angle": math.radians(90.0)}
"""The same for a machine whose file has limits, which then end its ranges."""
LEAST_MARGIN_SHARE = 0.1
"""Least singularity margin in a range, as a share of that of the pose: near a singularity a map shows nothing else."""
ROUND_UNIT = {"length": 1.0, "angle": math.radians(1.0)}
"""Unit in which ends of ranges are round numbers, by kind of coordinate: m, or a degree."""
ROUND_SLACK = 1e-6
"""Share of the step of round numbers within which an end counts as round already: far above round-off."""


def about_quantity(name: str) -> dict[str, str]:
    """Attributes of the variable of a quantity."""
    quantity = QUANTITIES[name]
    return {"units": quantity.unit, "symbol": quantity.symbol}


def about_field(field: Parameter) -> dict[str, Any]:
    """Attributes of the coordinate of a field."""
    kind = KINDS[field.quantity.kind]
    return {"units": kind.unit, "long_name": field.quantity.meaning, "kind": kind.name}


def origin_of(machine: Machine, varied: Collection[str] = (), uncounted: str = "") -> dict[str, str]:
    """Attributes of a dataset: its machine with all numbers, how it is shown, and where the results hold.

    Args:
        machine: gives all that does not vary.
        varied: leaf paths of the parameters that do.
        uncounted: the loads of its file that do not count, in a sentence; empty if all do.
    """
    return {
        "machine": machine.name,
        "machine_file": _file_of(Identical(machine)),
        "display": machine.display.units,
        "kinetostat": _program_version(),
        "frame": frame_of(machine),
        "pose": _pose_of(Identical(machine), tuple(varied)),
        **({LOADS_LEFT_OUT: uncounted} if uncounted else {}),
    }


@lru_cache(MACHINES_KEPT)
def _file_of(machine: Identical) -> str:
    """The file of a machine, which one that is asked about many times needs once."""
    return as_toml(machine.value)


@lru_cache(MACHINES_KEPT)
def _pose_of(machine: Identical, varied: tuple[str, ...]) -> str:
    """The coordinates of its pose that do not vary, as `pose_of` writes them."""
    return pose_of(machine.value, varied)


@cache
def _program_version() -> str:
    """The version of kinetostat: reading it from the installation takes longer than evaluating a pose."""
    return version("kinetostat")


@checked
def evaluate(
    machine: Machine,
    poses: Any,
    quantities: Sequence[str] = ("free_stiffness",),
    progress: Progress = silent,
) -> xr.Dataset:
    """Evaluate quantities at poses of your own, all of them at once: a thousand take some hundredths of a second.

    Args:
        machine: gives all fields that the poses do not name.
        poses: a DataFrame or a dictionary with a column for each field that changes (numbers in SI, or texts with a
            unit; a single value holds for all poses); an array [poses x coordinates of the pose], SI; an xarray
            Dataset, whose dimensions together make the poses; or the path of a CSV file.
        quantities: names of quantities or groups; "K" and "C" give the whole matrices.
        progress: receives how far the work is.

    Returns:
        Over the dimension `pose`: `status`, a variable for each quantity, K and C as (pose, row, column), and each
        given field as a coordinate, SI; units in `attrs`. Where the status is not ok (0), results are NaN.

    Raises:
        InputError: names the argument and what is wrong with it: poses that are not a table, an unknown field or
            quantity, a value that is not finite or not allowed.
    """
    return as_dataset(answers_at(machine, given_poses(machine, poses), quantities, progress))


def as_dataset(answers: PoseAnswers) -> xr.Dataset:
    """Label answers: dimensions pose, and row and column of K and C."""
    poses = answers.poses
    fields = {field.dimension: column for field, column in zip(poses.fields, poses.values, strict=True)}
    arrays = {"status": answers.status, **{name: answers.values[name] for name in answers.names}, **fields}
    arrays |= {matrix: answers.matrix(matrix) for matrix in answers.matrices}
    layout = _layout if poses.count <= POSES_KEPT else _layout.__wrapped__  # the function without its cache
    empty = layout(
        Identical(answers.machine),
        tuple(Identical(field) for field in poses.fields),
        answers.names,
        answers.matrices,
        poses.count,
        answers.loads_left_out,
    )
    dataset = empty.copy(data=arrays).set_coords(list(fields))
    labels = {name: ("pose", label) for name, label in poses.labels.items()}
    return dataset.assign_coords(labels) if labels else dataset


@lru_cache(MACHINES_KEPT)
def _layout(
    machine: Identical,
    fields: tuple[Identical, ...],
    names: tuple[str, ...],
    matrices: tuple[str, ...],
    count: int,
    uncounted: str,
) -> xr.Dataset:
    """Return a dataset without values, whose copies take them: xarray makes a copy in a third of the time.

    Fields are variables in it, because copies take the values of variables alone.
    """
    zeros, components = np.broadcast_to(0.0, count), machine.value.family.component_names
    coordinates: dict[str, Any] = {"pose": ("pose", np.arange(count), ABOUT_POSES)}
    for field in (each.value for each in fields):
        coordinates[field.dimension] = ("pose", zeros, {**about_field(field), "path": field.path})
    variables: dict[str, Any] = {name: ("pose", zeros, about_quantity(name)) for name in names}
    if matrices:
        coordinates |= {"row": list(components), "column": list(components)}
    for matrix in matrices:
        units = "SI: N·m/rad, N/rad, N/m" if matrix == "K" else "SI: rad/(N·m), rad/N, m/N"
        about = {"long_name": f"{MATRICES[matrix]} matrix", "units": units}
        entries = np.broadcast_to(0.0, (count, len(components), len(components)))
        variables[matrix] = (("pose", "row", "column"), entries, about)
    leaves = [leaf for field in fields for leaf in field.value.leaves]
    return xr.Dataset(
        {"status": ("pose", zeros, ABOUT_STATUS), **variables},
        coordinates,
        origin_of(machine.value, leaves, uncounted),
    ).reset_coords([field.value.dimension for field in fields])


@dataclass(frozen=True)
class GridQuestion:
    """A question: the quantities of a machine over a grid.

    Attributes:
        machine: gives all parameters that do not vary.
        grid: the points, with one axis for each range.
        fields: path of the field of each axis.
        names: names of quantities.
        labels: coordinates and attributes of the answer, without any variable.
    """

    machine: Machine
    grid: Grid
    fields: tuple[str, ...]
    names: tuple[str, ...]
    labels: xr.Dataset

    @property
    def dims(self) -> tuple[str, ...]:
        """The dimensions of the answer, one for each field."""
        return tuple(map(dimension, self.fields))

    @property
    def fits_memory(self) -> bool:
        """Whether the answer is small enough to be computed and shown at once."""
        return self.grid.size <= IN_MEMORY


def grid_question(machine: Machine | MachineState, ranges: Sequence[str], quantities: Sequence[str]) -> GridQuestion:
    """Read a question about a grid from texts; see `evaluate_grid`. The machine may be given as its state.

    Raises:
        InputError: an unknown field or quantity, one that the machine cannot have, a bad range, a field twice, or more
            than six dimensions.
    """
    state = state_of(machine)
    machine = state.machine
    pairs = chosen_axes(machine, ranges)
    chosen = [parameter for _, parameter in pairs]
    leaves = [leaf for parameter in chosen for leaf in parameter.leaves]
    grid = grid_of(pairs)
    names = resolve_quantities(quantities, machine.family.component_names, cable_count(machine))
    refuse_absent(state, names, chosen)
    varied = [(parameter, axis.values) for parameter, axis in zip(chosen, grid.axes, strict=True)]
    about = origin_of(machine, leaves, uncounted_loads(state, names, varied))
    labels = xr.Dataset({}, _coordinates(grid, pairs), about)
    fields = tuple(parameter.path for parameter in chosen)
    return GridQuestion(machine=machine, grid=grid, fields=fields, names=tuple(names), labels=labels)


def _coordinates(grid: Grid, pairs: Sequence[tuple[Range, Parameter]]) -> dict[str, Any]:
    coordinates: dict[str, Any] = {}
    for axis, (span, parameter) in zip(grid.axes, pairs, strict=True):
        about = {**about_field(parameter), "field": parameter.path, "log": int(span.logarithmic)}
        coordinates[parameter.dimension] = (parameter.dimension, axis.values, about)
    return coordinates


@checked
def evaluate_grid(
    machine: Machine | MachineState,
    ranges: Sequence[str],
    quantities: Sequence[str] = ("compliance",),
    progress: Progress = silent,
) -> xr.Dataset:
    """Evaluate quantities over all combinations of some ranges.

    Args:
        machine: gives all parameters that do not vary; or its state, as `state_of` returns it.
        ranges: one axis each, "FIELD=from:to:count[:log]"; a field with several entries varies them together.
        quantities: names of quantities or groups.
        progress: receives how far the work is.

    Returns:
        One variable per quantity and `status`, over dimensions named by the fields: `x` for
        pose.x, `geometry_base_radius` for geometry.base_radius; units in `attrs`.
        Quantities are NaN where the status is not ok (0).

    Raises:
        InputError: an unknown field or quantity, a bad range, a field twice, too many dimensions or points.
    """
    return answer(grid_question(machine, ranges, quantities), progress)


def answer(question: GridQuestion, progress: Progress = silent, compute: Compute = in_this_process) -> xr.Dataset:
    """Answer a question about a grid in memory; see `evaluate_grid`.

    Args:
        question: a question of at most `IN_MEMORY` points.
        progress: receives how far the work is.
        compute: computes chunks, here or in other processes; results are the same bit for bit.

    Raises:
        InputError: too many points.
    """
    if not question.fits_memory:
        raise InputError(
            f"the grid has {question.grid.size:,} points, more than the {IN_MEMORY:,} that are kept in memory: "
            "give -o FOLDER, into which results are written while they are computed, or lower the counts."
        )
    evaluation = _evaluate_all(question, progress, compute)
    shape = question.grid.shape
    content = {
        name: (question.dims, evaluation.values[name].reshape(shape), about_quantity(name)) for name in question.names
    }
    return question.labels.assign(content).assign(
        status=(question.dims, evaluation.status.reshape(shape), ABOUT_STATUS)
    )


def _evaluate_all(question: GridQuestion, progress: Progress, compute: Compute) -> Evaluation:
    """Evaluate all points; results are in their order, wherever they are computed."""
    if compute is in_this_process:
        return batch.evaluate(question.machine, question.grid, question.names, progress)
    work = in_chunks(question.machine, question.grid, question.names)
    chunks, points_done = {}, 0
    for number, chunk in compute(work, range(work.count)):
        chunks[number] = chunk
        points_done += len(chunk.status)
        progress(points_done, question.grid.size)
    in_order = [chunks[number] for number in range(work.count)]
    columns = {name: np.concatenate([chunk.values[name] for chunk in in_order]) for name in question.names}
    return Evaluation(columns, np.concatenate([chunk.status for chunk in in_order]))


def field_of(coordinate: xr.DataArray) -> str:
    """Return the path of the field that varies along a coordinate, e.g. "pose.x" of `x`."""
    return str(coordinate.attrs.get("field", coordinate.name))


def failures(dataset: xr.Dataset) -> dict[Status, int]:
    """Count the points of each status other than OK."""
    codes, counts = np.unique(dataset["status"].values, return_counts=True)
    return {Status(int(code)): int(n) for code, n in zip(codes, counts, strict=True) if code != Status.OK}


def usual_ranges(machine: Machine, count: int) -> list[str]:
    """Two ranges "pose.x=from:to:count" about the pose, translations first; fewer where fewer coordinates can change.

    Each coordinate goes as far as the machine can follow while the others stay: within its limits if the file has some,
    else not far from the pose, and never near a singularity.

    Args:
        machine: a machine whose pose has an answer.
        count: number of points of each range.
    """
    reaches = LARGEST_REACH_IN_LIMITS if limits_set(machine.tables["limits"]) else LARGEST_REACH
    coordinates = [p for p in parameters(machine.family) if p.path.startswith(POSE) and len(p.leaves) == 1]
    translations_first = sorted(coordinates, key=lambda p: p.quantity.kind != "length")
    length, ranges = float(state_of(machine).configuration.length), []
    for parameter in translations_first:
        reach = reaches[parameter.quantity.kind] * (length if parameter.quantity.kind == "length" else 1.0)
        low, high = _extent(machine, parameter, reach)
        if high > low:
            ranges.append(f"{parameter.path}={low:.9g}:{high:.9g}:{count}")
        if len(ranges) == MOST_RANGES_OF_MAPS:
            break
    return ranges


def coarser_ranges(ranges: Sequence[str], most: int) -> list[str]:
    """The same ranges "FIELD=from:to:count[:log]" with at most `most` points each.

    Raises:
        InputError: a text that is not of that form.
    """
    spans = [parse_range(text) for text in ranges]
    return [
        f"{span.field}={span.start}:{span.end}:{min(span.count, most)}{':log' if span.logarithmic else ''}"
        for span in spans
    ]


def _extent(machine: Machine, parameter: Parameter, reach: float) -> tuple[float, float]:
    """Both ends of the range of a coordinate, SI: the farthest poses between which and the pose all others are good.

    A pose is good if it has an answer and its singularity margin is not far below that of the pose.
    """
    (path,), value = parameter.leaves, float(values(machine)[parameter.path])
    steps = np.linspace(-reach, reach, 2 * PROBE_STEPS + 1)
    probe = batch.evaluate(machine, PointTable({path: value + steps}), ["singularity_margin"])
    singularity_margin = np.nan_to_num(probe.values["singularity_margin"])
    good = (probe.status == Status.OK) & (singularity_margin >= LEAST_MARGIN_SHARE * singularity_margin[PROBE_STEPS])
    bad = np.flatnonzero(~good)
    lowest = bad[bad < PROBE_STEPS].max(initial=-1) + 1
    highest = bad[bad > PROBE_STEPS].min(initial=len(steps)) - 1
    return _rounded_inwards(value + steps[[lowest, highest]], ROUND_UNIT[parameter.quantity.kind])


def _rounded_inwards(ends: Array, unit: float) -> tuple[float, float]:
    """Move both ends inwards to multiples of a power of ten of the unit, by a tenth of the range at most."""
    low, high = (float(end) for end in ends)
    if high == low:
        return low, high
    step = 10.0 ** math.floor(math.log10((high - low) / unit / 10.0)) * unit
    return math.ceil(low / step - ROUND_SLACK) * step, math.floor(high / step + ROUND_SLACK) * step
