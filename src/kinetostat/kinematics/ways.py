"""Ways of the platform from the home pose to a pose, and a quick test that shows that a leg is too short or too long.

The straight way is tried first, then detours, in case that it is blocked. A leg that is followed by itself has detours
of its own, because all that counts is where it arrives. Joints are solved along a way in `following`.

The quick test is for legs of revolutes and parallelograms, which may begin with a slide. The distance from one joint to
the next, and from the near to the far side of a parallelogram, never changes; the second joint moves on a circle about
the first one, or along the slide. Points are in the base frame, m.

Source: theory section 6.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import reduce
from itertools import pairwise
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array, Mask
from kinetostat.kinematics.closing import ANGLES, POINT, placement_of
from kinetostat.kinematics.leg_gaps import Coordinates, Problems
from kinetostat.machine.column import column, plain
from kinetostat.machine.leg import Joint
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Step
from kinetostat.tolerances import SAME_RAY, SURELY_APART

Way = Callable[[Array], Coordinates]
"""From the share of the way that is done in each problem [problems] to coordinates of the platform there."""
Plan = Callable[[Problems, Coordinates], Way]
"""From problems and their goals to a way."""


def ways(problems: Problems, goal: Coordinates) -> Iterator[tuple[Plan, Mask]]:
    """Generate the plans in the order in which they are tried, each with the problems in which it makes a difference.

    Turning first or last differs from the straight way where both the angles and the point change, and the long way
    round where an angle exceeds half a turn.
    """
    everywhere = np.ones(len(problems.poses), dtype=bool)
    yield straight, everywhere
    if not problems.free:
        yield around_the_base, everywhere
        yield about_the_first_axis, everywhere
    start = _start(problems, goal)
    moves, turns = (_where_any(goal[name] != start[name] for name in names) & everywhere for names in (POINT, ANGLES))
    yield turning_last, moves & turns
    yield turning_first, moves & turns
    yield the_long_way_round, _where_any(np.abs(goal[name]) > math.pi for name in ANGLES) & everywhere


def _where_any(conditions: Iterable[Any]) -> Mask:
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


def _on_the_way(start: Coordinates, goal: Coordinates, point_share: Array, angle_share: Array) -> Coordinates:
    """Coordinates from start to goal, at one share of the way for the point and another for the angles."""
    shares = {name: point_share if name in POINT else angle_share for name in goal}
    return {
        name: value if isinstance(value, float) else start[name] + (value - start[name]) * shares[name]
        for name, value in goal.items()
    }


def the_long_way_round(problems: Problems, goal: Coordinates) -> Way:
    """All coordinates evenly, angles as they are given."""
    start = _start(problems, goal)
    return lambda share: _on_the_way(start, goal, share, share)


def straight(problems: Problems, goal: Coordinates) -> Way:
    """All coordinates evenly, angles the short way round."""
    return the_long_way_round(problems, _short_way(goal))


def _short_way(goal: Coordinates) -> Coordinates:
    """A goal whose angles are within half a turn of 0."""
    return {name: _part_of_a_turn(value) if name in ANGLES else value for name, value in goal.items()}


def turning_last(problems: Problems, goal: Coordinates) -> Way:
    """The point first, then the angles."""
    start, short = _start(problems, goal), _short_way(goal)
    return lambda share: _on_the_way(start, short, np.minimum(2.0 * share, 1.0), np.maximum(2.0 * share - 1.0, 0.0))


def turning_first(problems: Problems, goal: Coordinates) -> Way:
    """The angles first, then the point."""
    start, short = _start(problems, goal), _short_way(goal)
    return lambda share: _on_the_way(start, short, np.maximum(2.0 * share - 1.0, 0.0), np.minimum(2.0 * share, 1.0))


def around_the_base(problems: Problems, goal: Coordinates) -> Way:
    """The leg's last joint on an arc around its first one, its distance evenly: what a leg reaches is often a shell."""
    frame = _LegEnds(problems, goal)
    near, far = frame.arms
    near_size, far_size = np.linalg.norm(near, axis=1), np.linalg.norm(far, axis=1)
    start, end = near / near_size[:, None], far / far_size[:, None]
    across = np.cross(start, end)
    angle = np.arctan2(np.linalg.norm(across, axis=1), (start * end).sum(axis=1))

    def way(share: Array) -> Coordinates:
        is_curved = np.sin(angle) > SAME_RAY
        sine = np.where(is_curved, np.sin(angle), 1.0)
        first = np.where(is_curved, np.sin((1.0 - share) * angle) / sine, 1.0 - share)
        last = np.where(is_curved, np.sin(share * angle) / sine, share)
        size = near_size + (far_size - near_size) * share
        return frame.at(share, (start * first[:, None] + end * last[:, None]) * size[:, None])

    return way


def about_the_first_axis(problems: Problems, goal: Coordinates) -> Way:
    """The leg's last joint about the axis of its first one: angle, radius and height evenly."""
    frame = _LegEnds(problems, goal)
    axis = frame.axis
    low, high = ((arm * axis).sum(axis=1) for arm in frame.arms)
    near, far = (arm - axis * height[:, None] for arm, height in zip(frame.arms, (low, high), strict=True))
    near_radius, far_radius = np.linalg.norm(near, axis=1), np.linalg.norm(far, axis=1)
    angle = np.arctan2((np.cross(near, far) * axis).sum(axis=1), (near * far).sum(axis=1))
    outward = near / near_radius[:, None]
    sideways = np.cross(axis, outward)

    def way(share: Array) -> Coordinates:
        turn = (share * angle)[:, None]
        radius = (near_radius + (far_radius - near_radius) * share)[:, None]
        height = (low + (high - low) * share)[:, None]
        return frame.at(share, axis * height + (outward * np.cos(turn) + sideways * np.sin(turn)) * radius)

    return way


class _LegEnds:
    """The first and the last joint of a leg in each problem, for ways of the last one.

    Attributes:
        start, goal: coordinates of the platform at the home pose and at the goal, angles the short way round.
        base: the first joint [problems x 3].
        offset: from the platform point to the last joint, in the axes of the platform [problems x 3].
        arms: from the first joint to the last one, at the home pose and at the goal [problems x 3].
        axis: the axis of the first joint [problems x 3].
    """

    def __init__(self, problems: Problems, goal: Coordinates) -> None:
        (part,) = problems.parts
        joints = [step.element.mover for step in part.build.steps(problems.poses, part.legs[:, 0])]
        pointed = [joint for joint in joints if joint.point is not None]
        count = len(problems.poses)
        self.start, self.goal = _start(problems, goal), _short_way(goal)
        home_point, goal_point = (
            rows_of(placement_of(columns_of(c)).translation, count) for c in (self.start, self.goal)
        )
        base, tip = (rows_of(pointed[k].point, count) if pointed else home_point for k in (0, -1))
        self.base, self.offset = base, tip - home_point
        end = placement_of(columns_of(self.goal)).rotation.apply(vector_of(self.offset))
        self.arms = tip - base, goal_point + rows_of(end, count) - base
        self.axis = rows_of(_first_axis(pointed, joints), count)

    def at(self, share: Array, arm: Array) -> Coordinates:
        """The platform's coordinates where the last joint is at an arm from the first one."""
        pose = _on_the_way(self.start, self.goal, share, share)
        offset = rows_of(placement_of(columns_of(pose)).rotation.apply(vector_of(self.offset)), len(share))
        position = self.base + arm - offset
        point_of_pose = {name: position[:, i] for i, name in enumerate(POINT) if not isinstance(self.goal[name], float)}
        return pose | point_of_pose


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


def too_far_or_near(problems: Problems, goal: Coordinates) -> Mask:
    """Tell at which goals a leg of a problem cannot close, whatever its joints do; False where this shows nothing.

    The end of the leg is compared with the circle or line on which its second joint moves: the links beyond that joint
    have to bridge at least the least distance from it, and at most the greatest. Where the goal leaves angles open,
    the end is the platform point, and the platform is one more link; where it leaves the point open, nothing is shown.
    """
    beyond = np.zeros(len(problems.poses), dtype=bool)
    if not set(POINT) & set(problems.free):
        for part in problems.parts:
            for legs in part.legs.T:
                beyond |= _leg_beyond(problems, part.build.steps(problems.poses, legs), goal)
    return beyond


def _leg_beyond(problems: Problems, steps: Sequence[Step], goal: Coordinates) -> Mask:
    count = len(problems.poses)
    first, centres = steps[0].element, [_centres(step) for step in steps[1:]]
    if isinstance(first, Parallelogram) or not is_zero(first.mover.pitch) or not centres or not all(centres):
        return np.zeros(count, dtype=bool)
    points = [rows_of(point, count) for row in centres for point in row]
    home = rows_of(placement_of(columns_of(problems.at_home())).translation, count)
    points += [home] if problems.free else []
    end = rows_of(placement_of(columns_of(goal)).apply(vector_of(points[-1] - home)), count)
    near, far = _distances_to_path(first.mover, points[0], end)
    links = np.stack([np.linalg.norm(b - a, axis=1) for a, b in pairwise(points)] or [0.0 * near])
    longest = links.sum(axis=0)
    shortest = np.maximum(2.0 * links.max(axis=0) - longest, 0.0)
    margin = SURELY_APART * problems.lengths
    return np.asarray((near > longest + margin) | (far < shortest - margin))


def _centres(step: Step) -> tuple[Vector, ...]:
    """The points of an element whose distance from those before it stays; none of slides and screws."""
    if isinstance(step.element, Parallelogram):
        return step.element.near, step.element.far
    joint: Joint = step.element.mover
    return (joint.point,) if joint.point is not None and is_zero(joint.pitch) else ()


def _distances_to_path(joint: Joint, point: Array, end: Array) -> tuple[Array, Array]:
    """The least and the greatest distance of ends from where a joint can take a point."""
    axis = rows_of(joint.axis, len(end))
    if joint.point is None:
        return _radius_and_height(axis, end - point)[0], np.full(len(end), np.inf)
    centre = rows_of(joint.point, len(end))
    radius, height = _radius_and_height(axis, point - centre)
    end_radius, end_height = _radius_and_height(axis, end - centre)
    return np.hypot(end_radius - radius, end_height - height), np.hypot(end_radius + radius, end_height - height)


def _radius_and_height(axis: Array, arms: Array) -> tuple[Array, Array]:
    """Radius and height of points about an axis, from their arms to a point of it."""
    height = (arms * axis).sum(axis=1)
    return np.linalg.norm(arms - axis * height[:, None], axis=1), height
