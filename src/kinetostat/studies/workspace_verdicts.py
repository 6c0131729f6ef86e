"""Verdicts on poses: whether each belongs to the workspace and why not, how far its borders are, what poses demand.

Verdicts follow from status, aspect and conditions on quantities; demands follow from the measures of the limits. A
border between two nodes may come from reach, a limit, a singularity or a condition. In every case the judge can say on
which side a pose lies, so that halving the step between the nodes again and again finds the border without a formula
for it; pictures then show the true outline and surface.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from kinetostat.arrays import AnyArray, Array, Codes, Float32s, Integers, Mask
from kinetostat.engine.batch import evaluate, first_limit_passed, limits_used
from kinetostat.engine.loaded import NATIVE_FROM
from kinetostat.engine.points import Axis, PointTable
from kinetostat.equilibrium.state import MachineState
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import REGULAR, Status
from kinetostat.kinetostatics.extremes import aspect
from kinetostat.machine.limits import LIMITS, Limit, Limits, limits_set
from kinetostat.machine.machine import Machine
from kinetostat.studies.datasets import GridQuestion
from kinetostat.studies.quantities import PoseCondition
from kinetostat.units import as_read

Poses = dict[str, Array]
"""Coordinates of poses by leaf path, SI."""

INSIDE, BEYOND = "inside", "beyond a singularity"
"""Verdicts of a pose within the workspace, and of one on the other side of a singularity."""
STATUS_VERDICTS = {
    Status.OK: INSIDE,
    Status.OUT_OF_REACH: "out of reach",
    Status.SINGULAR: "singular",
    Status.NOT_CONVERGED: "not converged",
    Status.NO_REST: "no rest under load",
    Status.UNDECIDED: "undecided",
}
"""Verdicts of statuses; for a limit that is passed, the verdict names the limit."""
LIMIT_VERDICT, CONDITION_VERDICT = "limits.", "fails "
"""The words with which verdicts of limits and of conditions begin."""
HALVINGS = 7
"""Number of halvings of a step: seven give the border to a 128th of it, finer than a printed line."""
DRAWN_COORDINATES = 3
"""Number of coordinates over which a workspace is drawn; the others keep the values of the pose in the file."""
LEAST_DEPTH = 1e-3
"""Least distance of a node from a border, in steps: at a distance of 0 it would lie neither inside nor outside, and a
thousandth of a step is not seen in a picture."""
DEPTH_UNSEARCHED = 0.5
"""Distance of a node from a border that was not searched, in steps: it is taken to lie half-way."""


def phrase(label: str) -> str:
    """Write a verdict in a few words."""
    return next((limit.phrase for limit in LIMITS.values() if label == f"{LIMIT_VERDICT}{limit.name}"), label)


@dataclass(frozen=True)
class Judge:
    """The rule by which a pose belongs to the workspace.

    Attributes:
        state: the state of the machine with its limits, at the file's pose.
        conditions: conditions that the pose has to meet.
    """

    state: MachineState
    conditions: tuple[PoseCondition, ...]

    @property
    def machine(self) -> Machine:
        """The machine with its limits."""
        return self.state.machine

    @cached_property
    def aspect(self) -> float:
        """Aspect of the file's pose; 0 if no singular surface divides poses, or this pose has no answer."""
        response = self.state.free
        return float(aspect(response)) if int(response.status) in REGULAR else 0.0

    @property
    def limits(self) -> list[str]:
        """Names of the limits that are set."""
        return [limit.name for limit in limits_set(self.machine.tables["limits"])]

    @property
    def labels(self) -> tuple[str, ...]:
        """All verdicts; the place of a verdict is its code."""
        return (
            *STATUS_VERDICTS.values(),
            BEYOND,
            *(f"{LIMIT_VERDICT}{name}" for name in self.limits),
            *(f"{CONDITION_VERDICT}{c.text}" for c in self.conditions),
        )

    @property
    def quantities(self) -> list[str]:
        """Quantities that decide beside the status of a pose, which is that under load if one is about the load."""
        of_load = ["load_factor"] if self.machine.loaded else []  # asked only for the status, which is then at rest
        return list(dict.fromkeys(["aspect", *of_load, *(condition.quantity for condition in self.conditions)]))

    def inside(self, status: Codes, values: Mapping[str, Any]) -> Mask:
        """Tell which poses are inside, from their status and quantities."""
        inside = np.asarray(status == Status.OK) & ~self._beyond_singularity(values)
        for condition in self.conditions:
            inside &= condition.holds(np.asarray(values[condition.quantity]))
        return inside

    def verdicts(self, status: Codes, values: Mapping[str, Any], poses: Callable[[Integers], Poses]) -> Codes:
        """Judge poses; a verdict is a place in `labels`.

        Args:
            status, values: status and values of the poses, of any shape.
            poses: a function from numbers of some of the poses to their coordinates.
        """
        labels = self.labels
        codes = np.full(status.shape, labels.index(INSIDE), dtype=np.int8)
        for code, verdict in STATUS_VERDICTS.items():
            codes[status == code] = labels.index(verdict)
        codes[(status == Status.OK) & self._beyond_singularity(values)] = labels.index(BEYOND)
        limited = np.flatnonzero(status == Status.JOINT_LIMIT)
        if limited.size:
            limit_codes = np.array([labels.index(f"{LIMIT_VERDICT}{name}") for name in self.limits])
            passed = first_limit_passed(self.machine, poses(limited), self.limits)
            # A pose exactly at a limit may pass none when it is computed again: it is then named after the first.
            codes.flat[limited] = limit_codes[np.maximum(passed, 0)]
        for condition in self.conditions:
            fails = ~condition.holds(np.asarray(values[condition.quantity]))
            codes[(codes == labels.index(INSIDE)) & fails] = labels.index(f"{CONDITION_VERDICT}{condition.text}")
        return codes

    def _beyond_singularity(self, values: Mapping[str, Any]) -> Mask:
        """Whether each pose is of the other aspect than the file's pose; none is where that has no aspect."""
        return np.asarray((np.asarray(values["aspect"]) * self.aspect) < 0.0)


@dataclass(frozen=True)
class Demand:
    """The range of what a limit is about.

    Attributes:
        name: name of the limit.
        title: title of the measure.
        least, greatest: extreme values over all poses and parts, in the unit.
        unit: m, deg, N or N·m.
    """

    name: str
    title: str
    least: float
    greatest: float
    unit: str


def demands(machine: Machine, poses: Mapping[str, Array]) -> tuple[Demand, ...]:
    """Compute the ranges of lengths, angles and loads over poses that can be reached; empty where there are none.

    Args:
        machine: the machine with its load.
        poses: coordinates by leaf path, SI [poses].
    """
    if not next(iter(poses.values())).size:
        return ()
    # A limit is compared with the poses only where it is set; how high it is set does not change what it is about.
    watched = replace(machine, tables={**machine.tables, "limits": Limits(**dict.fromkeys(LIMITS, 1.0))})
    ranges = limits_used(watched, poses)
    last = {limit.title: limit for limit in LIMITS.values()}  # the least and the greatest length share one range
    return tuple(_demand(limit, ranges[limit.name]) for limit in last.values() if limit.name in ranges)


def _demand(limit: Limit, ends: tuple[float, float]) -> Demand:
    """The range of what a limit is about, from its ends in SI, as people read it."""
    (least, unit), (greatest, _) = (as_read(number, limit.unit) for number in sorted(map(limit.shown, ends)))
    return Demand(name=limit.name, title=limit.title, least=least, greatest=greatest, unit=unit)


def borders(judge: Judge, question: GridQuestion, verdict: Codes, home: Sequence[int]) -> list[Float32s]:
    """Locate where the verdict changes between neighbouring nodes of the grid.

    Args:
        judge: gives the verdict on a pose.
        question: the grid.
        verdict: the verdict on each node of the grid.
        home: the node nearest to the pose in the file. Only the nodes that differ from it in the first three
            coordinates alone are searched, because only these are drawn.

    Returns:
        An array over the nodes for each of the first three axes. Where the next node along the axis has another
        verdict, the entry is the share of the step to it at which the verdict changes; elsewhere it is NaN.
    """
    axes, nodes_by_axis = question.grid.axes, []  # for each drawn axis, nodes whose next neighbour differs
    drawn = tuple(slice(None) if k < DRAWN_COORDINATES else slice(home[k], home[k] + 1) for k in range(verdict.ndim))
    for k in range(min(DRAWN_COORDINATES, verdict.ndim)):
        changes = np.zeros(verdict.shape, dtype=bool)
        lower, upper = _neighbours(verdict, k)
        changes[_along_axis(k, slice(None, -1))] = lower != upper
        searched = np.zeros_like(changes)
        searched[drawn] = True
        nodes_by_axis.append(np.argwhere(changes & searched))
    nodes = np.concatenate(nodes_by_axis)
    axis_of_node = np.repeat(np.arange(len(nodes_by_axis)), [len(places) for places in nodes_by_axis])
    shares = _border_shares(judge, axes, nodes, axis_of_node, verdict) if len(nodes) else np.zeros(0)
    shares_by_axis = []
    for k, places in enumerate(nodes_by_axis):
        over_nodes = np.full(verdict.shape, np.nan, dtype=np.float32)
        over_nodes[tuple(places.T)] = shares[axis_of_node == k]
        shares_by_axis.append(over_nodes)
    return shares_by_axis


def _border_shares(
    judge: Judge, axes: Sequence[Axis], nodes: Integers, axis_of_node: Integers, verdict: Codes
) -> Array:
    """Halve the step from each node along its axis, and return the share of the step at which the verdict changes.

    Args:
        judge: gives the verdict on a pose.
        axes: axes of the grid.
        nodes: indices of the nodes [n x axes].
        axis_of_node: number of the axis along which each of them has a neighbour with another verdict [n].
        verdict: the verdict on each node of the grid.
    """
    start, step = Poses(), Poses()
    for k, axis in enumerate(axes):
        values = axis.values[nodes[:, k]]
        following = axis.values[np.minimum(nodes[:, k] + 1, len(axis.values) - 1)]
        start |= dict.fromkeys(axis.paths, values)
        step |= dict.fromkeys(axis.paths, np.where(axis_of_node == k, following - values, 0.0))
    verdict_at_node = verdict[tuple(nodes.T)]
    low, high = np.zeros(len(nodes)), np.ones(len(nodes))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        poses = {path: start[path] + middle * step[path] for path in start}
        answer = evaluate(
            judge.machine, PointTable(poses), judge.quantities, repeated=HALVINGS * len(nodes) >= NATIVE_FROM
        )
        is_same = judge.verdicts(answer.status, answer.values, partial(_poses_at, poses)) == verdict_at_node
        low, high = np.where(is_same, middle, low), np.where(is_same, high, middle)
    return 0.5 * (low + high)


def _poses_at(poses: Poses, numbers: Integers) -> Poses:
    return {path: column[numbers] for path, column in poses.items()}


def depth(region: Mask, shares: Sequence[Float32s]) -> Array:
    """Return how far inside a region each node lies, in steps: positive inside, negative outside, at most 1.

    Interpolated linearly between the nodes, the depth is zero on the borders. Where a straight border cuts two lines
    of the grid at the distances a and b from a node, its own distance d follows from 1/d^2 = 1/a^2 + 1/b^2.

    Args:
        region: whether each node belongs to the region, over the axes of the shares.
        shares: the result of `borders`, one array for each axis.
    """
    inverse_square = np.zeros(region.shape)
    for k, share in enumerate(shares):
        nearest = np.full(region.shape, np.inf)
        lower, upper = _neighbours(region, k)
        before_border, behind_border = _along_axis(k, slice(None, -1)), _along_axis(k, slice(1, None))
        has_border = lower != upper
        nearest[before_border] = np.where(has_border, share[before_border], np.inf)
        from_second = np.where(has_border, 1.0 - share[before_border], np.inf)
        nearest[behind_border] = np.minimum(nearest[behind_border], from_second)
        known = np.nan_to_num(nearest, nan=DEPTH_UNSEARCHED, posinf=np.inf)
        inverse_square += np.maximum(known, LEAST_DEPTH) ** -2.0
    distance = np.minimum(np.where(inverse_square > 0.0, inverse_square, 1.0) ** -0.5, 1.0)
    return np.where(region, distance, -distance)


def _neighbours(nodes: AnyArray, k: int) -> tuple[AnyArray, AnyArray]:
    """Return all nodes but the last along an axis, and all but the first: each node beside its next neighbour."""
    return nodes[_along_axis(k, slice(None, -1))], nodes[_along_axis(k, slice(1, None))]


def _along_axis(k: int, chosen: slice) -> tuple[slice, ...]:
    """The index that chooses nodes along axis k, and all nodes along the others."""
    return (*[slice(None)] * k, chosen)
