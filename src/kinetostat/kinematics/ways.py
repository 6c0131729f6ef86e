"""Ways of the platform from the home pose to a pose: straight, and detours that are tried where that is blocked.

A leg by itself goes its own way, because all that counts is where it arrives. Solving along a way is elsewhere
(`following`). Points are in the base frame, m.

Source: theory section 6.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from functools import reduce
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array, Mask
from kinetostat.kinematics.closing import ANGLES, POINT, placement_of
from kinetostat.kinematics.leg_gaps import Coordinates, Problems
from kinetostat.machine.column import column, plain
from kinetostat.machine.leg import Joint

Way = Callable[[Array], Coordinates]
"""From the share of the way that is done in each problem [problems] to coordinates of the platform there."""
Plan = Callable[[Problems, Coordinates], Way]
"""From problems and their goals to a way."""


def ways(problems: Problems, goal: Coordinates) -> Iterator[tuple[Plan, Mask]]:
    """Name the ways in the order in which they are tried, each a plan.

    With each comes in which of the problems it differs from the straight one: angles first or last where both angles
    and the point change, angles as they are given where one exceeds half a turn.
    """
    everywhere = np.ones(len(problems.poses), dtype=bool)
    yield straight, everywhere
    if not problems.free:
        yield around_the_base, everywhere
        yield about_the_first_axis, everywhere
    start = _start(problems, goal)
    moves, turns = (_any(goal[name] != start[name] for name in names) & everywhere for names in (POINT, ANGLES))
    yield turning_last, moves & turns
    yield turning_first, moves & turns
    yield the_long_way_round, _any(np.abs(goal[name]) > math.pi for name in ANGLES) & everywhere


def _any(conditions: Iterable[Any]) -> Mask:
    return np.asarray(reduce(np.logical_or, conditions))


def _start(problems: Problems, goal: Coordinates) -> Coordinates:
    """The home pose, in the form of a goal."""
    home = problems.at_home()
    return {
        name: home[name] if isinstance(value, float) else np.broadcast_to(home[name], value.shape)
        for name, value in goal.items()
    }


def _part_of_a_turn(angle: Scalar) -> Scalar:
    """The same angle within half a turn of 0; exactly itself where it is so already."""
    return angle - 2.0 * math.pi * np.round(angle / (2.0 * math.pi))


def _between(start: Coordinates, goal: Coordinates, moved: Array, turned: Array) -> Coordinates:
    """Coordinates from start to goal, at one share of the way for the point and another for the angles."""
    shares = {name: moved if name in POINT else turned for name in goal}
    return {
        name: value if isinstance(value, float) else start[name] + (value - start[name]) * shares[name]
        for name, value in goal.items()
    }


def the_long_way_round(problems: Problems, goal: Coordinates) -> Way:
    """All coordinates evenly, angles as they are given."""
    start = _start(problems, goal)
    return lambda share: _between(start, goal, share, share)


def straight(problems: Problems, goal: Coordinates) -> Way:
    """All coordinates evenly, angles the short way round."""
    return the_long_way_round(problems, _short(goal))


def _short(goal: Coordinates) -> Coordinates:
    return {name: _part_of_a_turn(value) if name in ANGLES else value for name, value in goal.items()}


def turning_last(problems: Problems, goal: Coordinates) -> Way:
    """The point first, then the angles."""
    start, short = _start(problems, goal), _short(goal)
    return lambda share: _between(start, short, np.minimum(2.0 * share, 1.0), np.maximum(2.0 * share - 1.0, 0.0))


def turning_first(problems: Problems, goal: Coordinates) -> Way:
    """The angles first, then the point."""
    start, short = _start(problems, goal), _short(goal)
    return lambda share: _between(start, short, np.maximum(2.0 * share - 1.0, 0.0), np.minimum(2.0 * share, 1.0))


def around_the_base(problems: Problems, goal: Coordinates) -> Way:
    """The leg's last joint on an arc around its first one, its distance evenly: what a leg reaches is often a shell."""
    frame = _LegEnds(problems, goal)
    near, far = frame.arms
    sizes = np.linalg.norm(near, axis=1), np.linalg.norm(far, axis=1)
    start, end = near / sizes[0][:, None], far / sizes[1][:, None]
    across = np.cross(start, end)
    angle = np.arctan2(np.linalg.norm(across, axis=1), (start * end).sum(axis=1))

    def way(share: Array) -> Coordinates:
        slender = np.where(np.sin(angle) > 1e-9, np.sin(angle), 1.0)
        first = np.where(np.sin(angle) > 1e-9, np.sin((1.0 - share) * angle) / slender, 1.0 - share)
        last = np.where(np.sin(angle) > 1e-9, np.sin(share * angle) / slender, share)
        size = sizes[0] + (sizes[1] - sizes[0]) * share
        return frame.at(share, (start * first[:, None] + end * last[:, None]) * size[:, None])

    return way


def about_the_first_axis(problems: Problems, goal: Coordinates) -> Way:
    """The leg's last joint about the axis of its first one: angle, radius and height evenly."""
    frame = _LegEnds(problems, goal)
    axis = frame.axis
    parts = []
    for arm in frame.arms:
        height = (arm * axis).sum(axis=1)
        parts.append((height, arm - axis * height[:, None]))
    (low, near), (high, far) = parts
    sizes = np.linalg.norm(near, axis=1), np.linalg.norm(far, axis=1)
    angle = np.arctan2((np.cross(near, far) * axis).sum(axis=1), (near * far).sum(axis=1))
    outward = near / sizes[0][:, None]
    sideways = np.cross(axis, outward)

    def way(share: Array) -> Coordinates:
        turn = (share * angle)[:, None]
        size = (sizes[0] + (sizes[1] - sizes[0]) * share)[:, None]
        height = (low + (high - low) * share)[:, None]
        return frame.at(share, axis * height + (outward * np.cos(turn) + sideways * np.sin(turn)) * size)

    return way


class _LegEnds:
    """The first and the last joint of a leg in each problem, for ways of the last one [problems x 3]."""

    def __init__(self, problems: Problems, goal: Coordinates) -> None:
        (part,) = problems.parts
        joints = [step.element.mover for step in part.build.steps(problems.poses, part.legs[:, 0])]
        pointed = [joint for joint in joints if joint.point is not None]
        count = len(problems.poses)
        self.start, self.goal = _start(problems, goal), _short(goal)
        home, there = (rows_of(placement_of(columns_of(c)).translation, count) for c in (self.start, self.goal))
        base, tip = (rows_of(pointed[k].point, count) if pointed else home for k in (0, -1))
        self.base, self.offset = base, tip - home
        end = placement_of(columns_of(self.goal)).rotation.apply(vector_of(self.offset))
        self.arms = tip - base, there + rows_of(end, count) - base
        self.axis = rows_of(_first_axis(pointed, joints), count)

    def at(self, share: Array, arm: Array) -> Coordinates:
        """The platform's coordinates where the last joint is at an arm from the first one."""
        turned = _between(self.start, self.goal, share, share)
        offset = rows_of(placement_of(columns_of(turned)).rotation.apply(vector_of(self.offset)), len(share))
        point = self.base + arm - offset
        given = {name: point[:, i] for i, name in enumerate(POINT) if not isinstance(self.goal[name], float)}
        return turned | given


def _first_axis(pointed: list[Joint], joints: list[Joint]) -> Vector:
    return (pointed or joints)[0].axis


def columns_of(coordinates: Coordinates) -> Coordinates:
    """Coordinates as scalars of formulas."""
    return {name: column(value) for name, value in coordinates.items()}


def vector_of(rows: Array) -> Vector:
    """Vectors from their components [n x 3]."""
    return Vector(*(column(component) for component in rows.T))


def rows_of(vector: Vector, count: int) -> Array:
    """The components of vectors [n x 3]."""
    return np.stack([np.broadcast_to(np.asarray(plain(c), dtype=float), (count,)) for c in vector.components()], axis=1)
