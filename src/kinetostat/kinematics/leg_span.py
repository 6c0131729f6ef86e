"""What the links of a leg can bridge at most and at least: a bound that shows at once that a pose is out of its reach.

It holds for legs of revolutes and parallelograms, which may begin with a slide. From one joint to the next, and from
the near to the far side of a parallelogram, the distance stays; the second joint moves on a circle about the first one,
or along the slide. Points are in the base frame, m.

Source: theory section 6.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from kinetostat.algebra.scalar import is_zero
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array, Mask
from kinetostat.kinematics.closing import POINT, placement_of
from kinetostat.kinematics.leg_gaps import Coordinates, Problems
from kinetostat.kinematics.ways import columns_of, rows_of, vector_of
from kinetostat.machine.leg import Joint
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Step
from kinetostat.tolerances import SURELY_APART


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
    near, far = _apart(first.mover, points[0], end)
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


def _apart(joint: Joint, point: Array, end: Array) -> tuple[Array, Array]:
    """The least and the greatest distance of ends from where a joint can take a point."""
    axis = rows_of(joint.axis, len(end))
    if joint.point is None:
        return _about(axis, end - point)[0], np.full(len(end), np.inf)
    centre = rows_of(joint.point, len(end))
    radius, height = _about(axis, point - centre)
    end_radius, end_height = _about(axis, end - centre)
    return np.hypot(end_radius - radius, end_height - height), np.hypot(end_radius + radius, end_height - height)


def _about(axis: Array, arms: Array) -> tuple[Array, Array]:
    """Radius and height of points about an axis, from their arms to a point of it."""
    height = (arms * axis).sum(axis=1)
    return np.linalg.norm(arms - axis * height[:, None], axis=1), height
