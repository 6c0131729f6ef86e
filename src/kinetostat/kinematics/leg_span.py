"""What the links of a leg can bridge at most and at least: a bound that shows at once that a pose is out of its reach.

It holds for legs of revolutes. Between two of them the distance is that of their link; the second one moves on a circle
about the first. Points are in the base frame, m.

Source: theory section 6.
"""

from itertools import pairwise

import numpy as np

from kinetostat.algebra.scalar import is_zero
from kinetostat.kinematics.closing import Array, placement_of
from kinetostat.kinematics.leg_gaps import Coordinates, Mask, Problems
from kinetostat.kinematics.ways import columns_of, rows_of, vector_of
from kinetostat.tolerances import SURELY_APART


def too_far_or_near(problems: Problems, goal: Coordinates) -> Mask:
    """Tell at which goals the leg of a problem cannot close, whatever its joints do; False where this shows nothing.

    The end of the leg is compared with the circle on which its second joint moves: the links beyond that joint have
    to bridge at least the least distance from the circle, and at most the greatest.
    """
    count = len(problems.poses)
    (part,) = problems.parts
    joints = [step.element.mover for step in part.build.steps(problems.poses, part.legs[:, 0])]
    if len(joints) < 2 or any(joint.point is None or not is_zero(joint.pitch) for joint in joints):
        return np.zeros(count, dtype=bool)
    points = [rows_of(joint.point, count) for joint in joints if joint.point is not None]
    axis = rows_of(joints[0].axis, count)
    home = rows_of(placement_of(columns_of(problems.at_home())).translation, count)
    end = rows_of(placement_of(columns_of(goal)).apply(vector_of(points[-1] - home)), count)
    radius, height = _about(axis, points[1] - points[0])
    end_radius, end_height = _about(axis, end - points[0])
    near = np.hypot(end_radius - radius, end_height - height)
    far = np.hypot(end_radius + radius, end_height - height)
    links = np.stack([np.linalg.norm(b - a, axis=1) for a, b in pairwise(points[1:])] or [0.0 * near])
    longest = links.sum(axis=0)
    shortest = np.maximum(2.0 * links.max(axis=0) - longest, 0.0)
    margin = SURELY_APART * problems.lengths
    return np.asarray((near > longest + margin) | (far < shortest - margin))


def _about(axis: Array, arms: Array) -> tuple[Array, Array]:
    """Radius and height of points about an axis, from their arms to a point of it."""
    height = (arms * axis).sum(axis=1)
    return np.linalg.norm(arms - axis * height[:, None], axis=1), height
