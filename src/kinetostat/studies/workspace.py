"""The workspace of a machine: what it reaches of pose space without a singularity, within limits and conditions.

Nodes of a grid are judged (`workspace_verdicts`); the volume comes from random points between them. What is drawn or
printed of it is in `views`.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr

from kinetostat.arrays import Codes, Float32s, Integers, Mask
from kinetostat.engine.batch import Progress, evaluate, silent
from kinetostat.engine.points import PER_CELL, Cells
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import rest_numbers
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, values
from kinetostat.spec.arguments import as_list, checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names
from kinetostat.studies.datasets import IN_MEMORY, LOADS_LEFT_OUT, GridQuestion, answer, grid_question
from kinetostat.studies.poses import MOST_DIMENSIONS
from kinetostat.studies.quantities import PoseCondition, parse_condition
from kinetostat.studies.workspace_verdicts import INSIDE, Demand, Judge, Poses, borders, demands

COLOURING_QUANTITY = "least_translational_stiffness"
"""Quantity by which a workspace is coloured where no condition names another."""
SHOWN = ("singularity_margin", COLOURING_QUANTITY)
"""Quantities of the free machine that a workspace has at its nodes, whatever judges these."""
BORDER_VARIABLES = "border_"
"""Beginning of the names of the variables of borders, one for each axis."""
BORDER_MEANING = "share of the step to the next node at which the verdict changes, along"
"""Long name of these variables, before the name of the axis."""
HOME_MODE = "that of the home pose"
"""The assembly mode in which machines written leg by leg are evaluated; families state theirs by their formulas."""
HALF_STEP = 0.5001
"""Distance from a node, in steps of the grid, within which a pose belongs to it, with some room for round-off."""
MOST_DEMANDS = 200_000
"""Inside nodes at which lengths, angles and loads are computed; of more nodes, evenly chosen ones, whose extremes are
those of all but for a step of the grid."""
UNIT_POWERS = {1: "", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶"}
"""Signs of the powers of a unit in the unit of a volume."""
VOLUME_METHOD = "stratified sampling, two random points in each cell of the grid; error from their differences"
"""The way in which volumes are estimated, for files."""
FEWEST_CELLS = 30
"""Fewest cells from which a standard error is estimated. With fewer, both points of every cell often agree by chance,
and the error would come out as 0."""


@dataclass(frozen=True)
class Volume:
    """The volume of a region of pose space; over two coordinates, its area.

    Attributes:
        value: the volume, in the product of the SI units of the coordinates.
        standard_error: standard error of the value, in the same unit; NaN where there are too few cells for one.
        unit: the unit of both, e.g. "m³" or "m²·rad".
        box: volume of all cells together.
        cells: number of cells.
        divided: number of cells in which one point is inside and the other outside.
        unknown_cells: number of cells with a point of which it is unknown whether it is inside; such a point counts as
            outside.
    """

    value: float
    standard_error: float
    unit: str
    box: float
    cells: int
    divided: int
    unknown_cells: int

    @property
    def unknown(self) -> float:
        """By how much the region may be larger: the volume of the unknown cells, in the same unit."""
        return self.box * self.unknown_cells / self.cells

    @property
    def share(self) -> float:
        """The volume as a share of the box."""
        return self.value / self.box


def estimate_volume(inside: Mask, unknown: Mask, sizes: Sequence[float], units: Sequence[str]) -> Volume:
    """Estimate the volume of a region from two independent, uniform random points in each cell of a grid.

    The mean over both points is unbiased for any region. Cells are independent, and the variance of the mean of two
    points is the expectation of a quarter of their squared difference. So the standard error is the volume of a cell
    times half the square root of the number of divided cells. It falls with the number of cells to the power
    -(d + 1)/(2 d) in d dimensions.

    Args:
        inside: whether each point lies in the region; the two points of a cell follow one another [2 x cells].
        unknown: whether it is unknown if a point lies in it; such points are not inside [2 x cells].
        sizes: size of the box along each axis, SI.
        units: units of the axes.

    Source: W. G. Cochran, Sampling Techniques (1977), section 5.3, for the variance of a stratified mean.
    """
    pairs = inside.reshape(-1, PER_CELL)
    box = math.prod(sizes)
    cell = box / len(pairs)
    divided = int((pairs[:, 0] != pairs[:, 1]).sum())
    value = cell * float(inside.sum()) / PER_CELL
    error = 0.5 * cell * math.sqrt(divided) if len(pairs) >= FEWEST_CELLS else math.nan
    unknown_cells = int(unknown.reshape(-1, PER_CELL).any(axis=1).sum())
    return Volume(
        value=value,
        standard_error=error,
        unit=unit_product(units),
        box=box,
        cells=len(pairs),
        divided=divided,
        unknown_cells=unknown_cells,
    )


def unit_product(units: Sequence[str]) -> str:
    """Write the product of some units, e.g. "m²·rad"."""
    return "·".join(f"{unit}{UNIT_POWERS[count]}" for unit, count in Counter(units).items())


@former_names(found="exists", counts="nodes", joined="connected", divided="singularities_divide")
@dataclass(frozen=True, eq=False)
class Workspace(ImmutableAnswer):
    """The workspace of a machine over a grid of poses.

    Attributes:
        machine: the machine with its limits.
        dataset: the nodes of the grid with `status` (`Status` codes), `verdict` (place in `verdicts`), `connected`
            (whether inside and joined to the file's pose), `singularity_margin`, the least translational stiffness, the
            quantities of the conditions, and for each axis the share of the step to the next node at which the verdict
            ends.
        verdicts: the verdicts that a node may have, "inside" first.
        nodes: number of nodes with each verdict.
        volume: volume of the inside, whether joined to the file's pose or not.
        connected: share of the inside nodes that hang together with the file's pose; None if that is not inside.
        extents: least and greatest value of each coordinate over the inside nodes, SI; empty where there are none.
        demands: ranges of lengths, angles and loads of legs, joints and actuators over the inside nodes.
        conditions: conditions that poses had to meet.
        singularities_divide: whether they divide pose space and the file's pose has an aspect to stay in.
        limits: names of the limits that the machine's file sets.
        loads_left_out: a sentence on the loads of the file that do not count; empty where all do.
    """

    machine: Machine
    dataset: xr.Dataset
    verdicts: tuple[str, ...]
    nodes: dict[str, int]
    volume: Volume
    connected: float | None
    extents: dict[str, tuple[float, float]]
    demands: tuple[Demand, ...]
    conditions: tuple[PoseCondition, ...]
    singularities_divide: bool
    limits: tuple[str, ...]
    loads_left_out: str = ""

    def __repr__(self) -> str:
        total = sum(self.nodes.values())
        return f"<Workspace of {self.machine.name!r}: {self.nodes[INSIDE]:,} of {total:,} nodes inside>"

    @property
    def inside(self) -> Mask:
        """Flags of the nodes that are inside, over the axes of the grid."""
        return np.asarray(self.dataset["verdict"].values == self.verdicts.index(INSIDE))

    @property
    def exists(self) -> bool:
        """Whether any pose is inside."""
        return self.volume.value > 0.0 or self.nodes[INSIDE] > 0


@checked
def workspace(
    machine: Machine | MachineState,
    ranges: Sequence[str],
    conditions: Sequence[str] = (),
    progress: Progress = silent,
    seed: int = 0,
) -> Workspace:
    """Determine the region of pose space where a machine can work.

    A pose is inside if it can be reached within the limits of the file, is not singular, lies on the same side of the
    singularities as the file's pose, and meets the conditions. Where the machine is meant under its loads
    (`machine.loaded`), or a condition is about these, it must also come to rest there.

    Args:
        machine: the machine with its limits, or its state, as `state_of` returns it; its pose gives the coordinates
            that do not vary.
        ranges: "FIELD=from:to:count", two to six coordinates of the pose.
        conditions: "QUANTITY > VALUE".
        progress: receives how far the work is.
        seed: seed of the random points for the volume; a whole number from 0.

    Raises:
        InputError: a field that is not a coordinate of the pose, a bad range or condition, too many points.
    """
    if seed < 0:
        raise InputError(f"seed is {seed}; give a whole number from 0.")
    state = state_of(machine)
    machine = state.machine
    judge = Judge(state, tuple(parse_condition(text, machine.family.component_names) for text in as_list(conditions)))
    question = grid_question(state, ranges, judge.quantities)
    _check_axes(question)
    total = question.grid.size + Cells(question.grid.axes).size
    nodes = _quantities_at_nodes(question, lambda done, _: progress(done, total))
    quantities = {name: nodes[name].values for name in judge.quantities}
    verdict = judge.verdicts(nodes["status"].values, quantities, partial(_poses_of_nodes, question))
    inside = verdict == judge.labels.index(INSIDE)
    volume = _volume(judge, question, seed, lambda done, _: progress(question.grid.size + done, total))
    border_shares = borders(judge, question, verdict, _nearest_node(question))
    home = _home_node(question)
    connected = connected_to(inside, home) if home is not None else np.zeros_like(inside)
    demanding_nodes = np.flatnonzero(inside)[:: 1 + int(inside.sum()) // MOST_DEMANDS]
    return Workspace(
        machine=machine,
        dataset=_dataset(nodes, verdict, connected, judge, volume, border_shares),
        verdicts=judge.labels,
        nodes={label: int((verdict == code).sum()) for code, label in enumerate(judge.labels)},
        volume=volume,
        connected=float(connected.sum() / inside.sum()) if connected.any() else None,
        extents=_extents(question, inside),
        demands=demands(machine, _poses_of_nodes(question, demanding_nodes)),
        conditions=judge.conditions,
        singularities_divide=judge.aspect != 0.0,
        limits=tuple(judge.limits),
        loads_left_out=nodes.attrs.get(LOADS_LEFT_OUT, ""),
    )


def _quantities_at_nodes(question: GridQuestion, progress: Progress) -> xr.Dataset:
    """The quantities that judge the nodes, with `SHOWN`: these are NaN at a node that is not inside.

    Where nodes are judged at rest, `SHOWN` is asked for apart: a machine may rest where K is singular.
    """
    if not rest_numbers(question.machine, question.names):
        return answer(replace(question, names=tuple(dict.fromkeys([*SHOWN, *question.names]))), progress)
    nodes, shown = answer(question, progress), answer(replace(question, names=SHOWN))
    return nodes.assign({name: shown[name].where(nodes["status"] == Status.OK) for name in SHOWN})


def _check_axes(question: GridQuestion) -> None:
    """Refuse axes that are not coordinates of the pose, evenly spaced and upwards, and too many nodes."""
    poses = [path for path in values(question.machine) if path.startswith(POSE)]
    for dim, field in zip(question.dims, question.fields, strict=True):
        if field not in poses:
            raise InputError(
                f"{field} is not a coordinate of the pose; a workspace extends over {', '.join(poses)}. For other "
                "fields use `kinetostat map`."
            )
        if question.labels[dim].attrs["log"]:
            raise InputError(f"{field}: a workspace needs even spacing; leave out :log.")
    if not 2 <= len(question.dims) <= MOST_DIMENSIONS:
        raise InputError("a workspace needs two to six --over ranges, each of a coordinate of the pose.")
    for field, axis in zip(question.fields, question.grid.axes, strict=True):
        if axis.values[0] >= axis.values[-1]:
            raise InputError(f"{field}: the range must run upwards; exchange its ends.")
    if not question.fits_memory:
        raise InputError(
            f"the grid has {question.grid.size:,} nodes; a workspace is kept in memory, at most {IN_MEMORY:,}: lower "
            "the counts."
        )


def _poses_of_nodes(question: GridQuestion, numbers: Integers) -> Poses:
    """Coordinates of some nodes by their number."""
    places = np.unravel_index(numbers, question.grid.shape)
    return {
        path: axis.values[place] for axis, place in zip(question.grid.axes, places, strict=True) for path in axis.paths
    }


def _volume(judge: Judge, question: GridQuestion, seed: int, progress: Progress) -> Volume:
    """The volume of the inside, from random points in the cells of the grid."""
    axes = question.grid.axes
    evaluation = evaluate(judge.machine, Cells(axes, seed), judge.quantities, progress)
    sizes = [float(axis.values[-1] - axis.values[0]) for axis in axes]
    units = [str(question.labels[dim].attrs["units"]) for dim in question.dims]
    unknown = np.isin(evaluation.status, (Status.NOT_CONVERGED, Status.UNDECIDED))
    return estimate_volume(judge.inside(evaluation.status, evaluation.values), unknown, sizes, units)


def _nearest_node(question: GridQuestion) -> list[int]:
    """The node nearest to the file's pose, however far that is."""
    pose_of_file = values(question.machine)
    return [int(np.abs(axis.values - float(pose_of_file[axis.paths[0]])).argmin()) for axis in question.grid.axes]


def _home_node(question: GridQuestion) -> tuple[int, ...] | None:
    """The node nearest to the file's pose; None where that is off the grid by more than half a step."""
    pose_of_file, node = values(question.machine), _nearest_node(question)
    for axis, place in zip(question.grid.axes, node, strict=True):
        distance = abs(axis.values[place] - float(pose_of_file[axis.paths[0]]))
        if distance > HALF_STEP * float(axis.values[1] - axis.values[0]):
            return None
    return tuple(node)


def connected_to(region: Mask, seed: tuple[int, ...]) -> Mask:
    """Return the nodes of a region that are joined to one node by steps along the axes within the region.

    Args:
        region: nodes of a grid of any number of dimensions.
        seed: index of the node; outside the region, nothing is joined to it.
    """
    from scipy import ndimage  # a third of a second to import, which maps need not wait for

    labels, _ = ndimage.label(region)
    return np.asarray((labels == labels[seed]) & region[seed])


def _extents(question: GridQuestion, inside: Mask) -> dict[str, tuple[float, float]]:
    """Least and greatest value of each coordinate over the inside nodes, SI."""
    extents = {}
    for k, (field, axis) in enumerate(zip(question.fields, question.grid.axes, strict=True)):
        others = tuple(other for other in range(inside.ndim) if other != k)
        reached = axis.values[inside.any(axis=others)]
        if reached.size:
            extents[field] = float(reached[0]), float(reached[-1])
    return extents


def _dataset(
    nodes: xr.Dataset, verdict: Codes, connected: Mask, judge: Judge, volume: Volume, border_shares: Sequence[Float32s]
) -> xr.Dataset:
    """The dataset of the nodes with verdicts, borders and volume."""
    dims = nodes["status"].dims
    words = " ".join("_".join(label.split()) for label in judge.labels)
    about_verdict = {"flag_values": list(range(len(judge.labels))), "flag_meanings": words}
    about_connected = {
        "long_name": "inside and joined to the file's pose",
        "flag_values": [0, 1],
        "flag_meanings": "no yes",
    }
    about_volume = {
        "volume": volume.value,
        "volume_standard_error": volume.standard_error,
        "volume_unknown": volume.unknown,
        "volume_units": volume.unit,
    }
    dataset = nodes.drop_vars("aspect").assign(
        verdict=(dims, verdict, about_verdict), connected=(dims, connected.astype(np.int8), about_connected)
    )
    for dim, shares in zip(dims, border_shares, strict=False):  # borders are located along the first three axes
        dataset[f"{BORDER_VARIABLES}{dim}"] = (dims, shares, {"long_name": f"{BORDER_MEANING} {dim}", "units": "1"})
    pose = {path: float(value) for path, value in values(judge.machine).items() if path.startswith(POSE)}
    mode = {} if judge.machine.family.chains is None else {"assembly_mode": HOME_MODE}
    return dataset.assign_attrs({**about_volume, "volume_method": VOLUME_METHOD, **mode, **pose})
