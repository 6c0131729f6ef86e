"""The assembly mode of a leg as a sign: that of the determinant of its joints' twists, which vanishes where two meet.

It guards the solutions that `following` comes to: one whose sign differs from that of the home pose belongs to another
mode. Nothing is solved here.

Source: theory section 6.
"""

import numpy as np

from kinetostat.kinematics.closing import Array
from kinetostat.kinematics.leg_gaps import Coordinates, Mask, Problems, stays_in_plane
from kinetostat.kinematics.ways import rows_of
from kinetostat.machine.leg import rows_about_one_point
from kinetostat.tolerances import DEPENDENT

AXES = 3
"""Of a ball joint."""


def same_mode(problems: Problems, unknowns: Array, goal: Coordinates) -> Mask:
    """Tell which solutions may be in the assembly mode of the home pose: all those whose sign does not differ.

    Args:
        problems: that have been solved.
        unknowns: their solutions [problems x unknowns].
        goal: coordinates of the platform in each of them.
    """
    if problems.free:
        return np.ones(len(unknowns), dtype=bool)
    here, home = signs(problems, unknowns, goal), signs(problems, 0.0 * unknowns, problems.at_home())
    return np.asarray(here * home >= 0.0)


def signs(problems: Problems, unknowns: Array, goal: Coordinates) -> Array:
    """Return the sign of each leg: 1 or -1, or 0 where it has none or is singular.

    A leg has one if there are as many coordinates as motions of its end, six or, in a plane, three. Nothing
    happens to a leg where the three axes of a ball joint come to lie in a plane: their own sign is left out.

    Args:
        problems: each of one leg.
        unknowns: its coordinates [problems x coordinates].
        goal: coordinates of the platform, which only say how many problems there are.
    """
    rates = problems.gaps(unknowns, goal)[1]
    rows = [2, 3, 4] if stays_in_plane(problems.chains) else [0, 1, 2, 3, 4, 5]
    if len(rows) != rates.shape[2]:
        return np.zeros(len(rates))
    result = np.linalg.det(rates[:, rows])
    result = np.where(np.abs(result) > DEPENDENT, result, 0.0)
    for ball in _balls(problems):
        result = result * np.linalg.det(rates[:, :3, ball])
    return np.asarray(np.sign(result))


def _balls(problems: Problems) -> list[list[int]]:
    """The numbers of three coordinates each that are the revolutes of a ball joint."""
    (part,) = problems.parts
    first = np.zeros(1, dtype=int)
    joints = [step.element.mover for step in part.build.steps(first, first)]
    centres = [None if joint.point is None else rows_of(joint.point, 1)[0] for joint in joints]
    return [list(row) for row in rows_about_one_point(centres) if len(row) == AXES]
