"""Poses at random to which a machine may be moved for measuring: within its limits, and joined to those it has been at.

Rays go out from a measured pose until a limit or a singularity ends them, first along each coordinate, which says how
far each one goes, then in random directions. What is measured there is decided elsewhere (`next_poses`).
"""

from collections.abc import Mapping

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.kinematics.status import Status
from kinetostat.machine.limits import limits_set
from kinetostat.machine.machine import Machine

FARTHEST, STEPS = 1.5, 48
"""End of a ray, in lengths of the machine or rad, then in reaches of all coordinates; and how many places of a ray are
looked at."""
SINGULAR_SHARE = 0.1
"""Share of the singularity margin at the start that must be left all along a ray, so that no step passes over a
singularity."""

Poses = Mapping[str, Array]


def within_limits(
    machine: Machine, measured: Poses, units: Mapping[str, float], count: int, rng: np.random.Generator
) -> Poses | None:
    """Draw poses within the limits of a machine's file, those coordinates alone that measurements vary.

    Args:
        machine: with its limits.
        measured: poses at which it has been, by leaf path, SI.
        units: of each of their coordinates: the machine's length, m, or 1 rad.
        count: how many poses are wanted.
        rng: draws them.

    Returns:
        Coordinates by leaf path, SI [count]; None if the file sets no limits or no measured pose keeps them.
    """
    if not limits_set(machine.tables["limits"]):
        return None
    paths, scale = list(measured), np.array([units[path] for path in measured])
    places = np.stack([measured[path] for path in paths], axis=1)
    margins = _margins(machine, paths, places)
    if not (margins > 0.0).any():
        return None
    off = np.abs((places - places.mean(axis=0)) / scale).max(axis=1)
    middle = int(np.argmin(np.where(margins > 0.0, off, np.inf)))
    start, least = places[middle], SINGULAR_SHARE * float(margins[middle])
    axes = np.concatenate([np.diag(scale), -np.diag(scale)])
    reach = _reach(machine, paths, start, axes, least).reshape(2, -1).max(axis=0) * scale
    ways = rng.normal(size=(count, len(paths)))
    ways = ways / np.linalg.norm(ways, axis=1)[:, None] * reach
    share = _reach(machine, paths, start, ways, least) * rng.random(count) ** (1.0 / len(paths))
    return dict(zip(paths, (start + share[:, None] * ways).T, strict=True))


def _reach(machine: Machine, paths: list[str], start: Array, ways: Array, least: float) -> Array:
    """How far rays [rays x coordinates] go from a pose before they end: factors of their length [rays]."""
    steps = np.linspace(0.0, FARTHEST, STEPS + 1)[1:]
    places = start + steps[:, None, None] * ways
    kept = _margins(machine, paths, places.reshape(-1, len(paths))).reshape(STEPS, -1) > least
    ended = np.where(kept.all(axis=0), STEPS, np.argmin(kept, axis=0))
    return np.asarray(np.concatenate([[0.0], steps])[ended])


def _margins(machine: Machine, paths: list[str], places: Array) -> Array:
    """The singularity margin at poses [poses x coordinates]; 0 where one is out of reach or passes a limit."""
    columns = {path: np.ascontiguousarray(column) for path, column in zip(paths, places.T, strict=True)}
    answer = evaluate(machine, PointTable(columns), ["singularity_margin"])
    inside: Mask = np.asarray(answer.status == Status.OK)
    return np.where(inside, answer.values["singularity_margin"], 0.0)
