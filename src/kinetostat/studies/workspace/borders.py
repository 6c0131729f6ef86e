"""Where the verdict changes between neighbouring nodes of a workspace, so that its pictures have the true outlines.

Whatever bounds a workspace (reach, a limit, a singularity, a condition), the judge can tell on which side a pose lies.
Halving the step between two nodes again and again therefore finds the border, without a formula for it.
"""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetostat.engine.batch import NATIVE_FROM, evaluate
from kinetostat.engine.points import Array, Axis, Table
from kinetostat.studies.grid.grid import GridQuestion
from kinetostat.studies.workspace.verdicts import Codes, Judge, Mask, Numbers, Poses

HALVINGS = 7
"""After them the border is known to a 128th of a step, finer than a printed line."""
SHOWN = 3
"""Coordinates over which a workspace is drawn; all others stay at the values of the pose in the file."""
NEAR = 1e-3
"""Least distance of a node from a border, in steps: a border at a node itself would leave no side to it."""

Shares = npt.NDArray[np.float32]


def borders(judge: Judge, question: GridQuestion, verdict: Codes, home: Sequence[int]) -> list[Shares]:
    """Find the borders along the grid's lines.

    Args:
        judge: tells the verdict on a pose.
        question: the grid.
        verdict: of its nodes.
        home: the node nearest to the pose in the file: borders are sought over the first three coordinates through it.

    Returns:
        Of each of these axes, an array over the nodes: the share of the step to the next node along the axis at which
        the verdict of the node ends; NaN where the next node has the same verdict.
    """
    axes, ends = question.grid.axes, []
    apart = tuple(slice(None) if k < SHOWN else slice(home[k], home[k] + 1) for k in range(verdict.ndim))
    for k in range(min(SHOWN, verdict.ndim)):
        changes = np.zeros(verdict.shape, dtype=bool)
        lower, upper = _neighbours(verdict, k)
        changes[_all_but(k, slice(None, -1))] = lower != upper
        seen = np.zeros_like(changes)
        seen[apart] = True
        ends.append(np.argwhere(changes & seen))
    nodes = np.concatenate(ends)
    axis = np.repeat(np.arange(len(ends)), [len(places) for places in ends])
    shares = _halved(judge, axes, nodes, axis, verdict) if len(nodes) else np.zeros(0)
    results = []
    for k in range(len(ends)):
        result = np.full(verdict.shape, np.nan, dtype=np.float32)
        result[tuple(ends[k].T)] = shares[axis == k]
        results.append(result)
    return results


def _halved(judge: Judge, axes: Sequence[Axis], nodes: Numbers, axis: Numbers, verdict: Codes) -> Array:
    """Halve the step from each node along its axis until the end of its verdict is known."""
    start = {path: a.values[nodes[:, k]] for k, a in enumerate(axes) for path in a.paths}
    step = {
        path: np.where(axis == k, a.values[np.minimum(nodes[:, k] + 1, len(a.values) - 1)] - a.values[nodes[:, k]], 0.0)
        for k, a in enumerate(axes)
        for path in a.paths
    }
    before = verdict[tuple(nodes.T)]
    low, high = np.zeros(len(nodes)), np.ones(len(nodes))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        poses = {path: start[path] + middle * step[path] for path in start}
        answer = evaluate(judge.machine, Table(poses), judge.quantities, repeated=HALVINGS * len(nodes) >= NATIVE_FROM)
        same = judge.verdicts(answer.status, answer.values, partial(_chosen, poses)) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return 0.5 * (low + high)


def _chosen(poses: Poses, numbers: Numbers) -> Poses:
    return {path: column[numbers] for path, column in poses.items()}


def depth(region: Mask, shares: Sequence[Shares]) -> Array:
    """Return how far inside a region each node lies, in steps: positive inside, negative outside, at most 1.

    Linear interpolation of it vanishes at the borders. Two distances along lines of the grid give that from a straight
    border between them: 1/d^2 = 1/a^2 + 1/b^2.

    Args:
        region: which nodes belong to it, over the axes of the shares.
        shares: of `borders`.
    """
    inverse_square = np.zeros(region.shape)
    for k, share in enumerate(shares):
        nearest = np.full(region.shape, np.inf)
        lower, upper = _neighbours(region, k)
        first, second = _all_but(k, slice(None, -1)), _all_but(k, slice(1, None))
        parted = lower != upper
        along = np.where(parted, share[first], np.inf)
        nearest[first] = along
        back = np.where(parted, 1.0 - share[first], np.inf)
        nearest[second] = np.minimum(nearest[second], back)
        inverse_square += np.maximum(np.nan_to_num(nearest, nan=0.5, posinf=np.inf), NEAR) ** -2.0
    distance = np.minimum(np.where(inverse_square > 0.0, inverse_square, 1.0) ** -0.5, 1.0)
    return np.where(region, distance, -distance)


def _neighbours(nodes: npt.NDArray[Any], k: int) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Return the nodes that have a next one along an axis, and these next ones."""
    return nodes[_all_but(k, slice(None, -1))], nodes[_all_but(k, slice(1, None))]


def _all_but(k: int, chosen: slice) -> tuple[slice, ...]:
    return (*[slice(None)] * k, chosen)
