"""The admissible pose nearest to one that the legs cannot take: what a refusal offers instead. One pose.

Source: theory section 6.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from kinetostat.kinematics.closure import Gaps, gaps_at, joints_on_the_way, pose_of, units_of
from kinetostat.machine.machine import Machine

Array = npt.NDArray[np.float64]

CLOSING = 1e4
"""How much more a gap in a leg counts than one in the pose, so that the legs close to a ten-thousandth of the rest."""
MOST_DESCENTS = 400
SMALLEST_DAMPING, LARGEST_DAMPING = 1e-15, 1e6
SHOWN = 1e-9
"""Coordinates below this, in m or rad, are shown as zero."""


def nearest_pose(machine: Machine) -> dict[str, float]:
    """All coordinates of an admissible pose near the machine's, m and rad.

    Distance is that of the pose coordinates given, angles times the machine's characteristic length. It is found by
    descent from where the joints came to, on the branch of the home pose.
    """
    chains = machine.chains()
    goal = np.array([list(chains.pose.values())], dtype=float)

    units = units_of(chains, np.array([float(chains.length)]))[0]

    def gaps(joints: Array) -> Gaps:
        return gaps_at(chains, joints[None, :] * units, goal)

    def left(joints: Array) -> Array:
        found = gaps(joints)
        return np.concatenate([CLOSING * found.closure[0], found.pose[0]])

    def slopes(joints: Array) -> Array:
        found = gaps(joints)
        return -np.concatenate([CLOSING * found.closure_rates[0], found.pose_rates[0]])

    best = _descend(left, slopes, joints_on_the_way(chains, goal)[0] / units)
    coordinates = pose_of(gaps(best).platform)
    return {name: _without_rounding(float(value[0])) for name, value in coordinates.items()}


def _descend(left: Callable[[Array], Array], slopes: Callable[[Array], Array], at: Array) -> Array:
    """A least-squares minimum by the method of Levenberg and Marquardt.

    Args:
        left: what is to become small, from the unknowns [rows].
        slopes: its derivatives [rows x unknowns].
        at: where to start [unknowns].
    """
    damping, error = 1e-3, left(at)
    for _ in range(MOST_DESCENTS):
        matrix = slopes(at)
        square, work = matrix.T @ matrix, matrix.T @ error
        step = -np.linalg.solve(square + damping * np.trace(square) / len(at) * np.eye(len(at)), work)
        tried = left(at + step)
        if not tried @ tried < error @ error:
            damping *= 4.0
            if damping > LARGEST_DAMPING:
                break
            continue
        at, error, damping = at + step, tried, max(damping / 10.0, SMALLEST_DAMPING)
    return at


def _without_rounding(value: float) -> float:
    """The value, or zero where nothing but rounding is left of it."""
    return 0.0 if abs(value) < SHOWN else value
