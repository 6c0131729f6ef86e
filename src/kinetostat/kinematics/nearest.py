"""The admissible pose nearest to one that the legs cannot take: what a refusal offers instead. One pose."""

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from kinetostat.kinematics.closure import Gaps, gaps_at, pose_of, solve_joints
from kinetostat.machine.machine import Machine

Array = npt.NDArray[np.float64]

CLOSING = 1e4
"""How much more a gap in a leg counts than one in the pose, so that the legs close to a ten-thousandth of the rest."""
SHOWN = 1e-9
"""Coordinates below this, in m or rad, are shown as zero."""


def nearest_pose(machine: Machine) -> dict[str, float]:
    """All coordinates of an admissible pose near the machine's, m and rad.

    Distance is that of the pose coordinates given, angles times the machine's characteristic length. It is found by
    descent from where the joints came to, on the branch of the home pose.
    """
    assert machine.family.chains is not None
    chains = machine.family.chains(**machine.own_sections)
    goal = np.array([list(chains.pose.values())], dtype=float)

    def gaps(joints: Array) -> Gaps:
        return gaps_at(chains, joints[None, :], goal)

    def left(joints: Array) -> Array:
        found = gaps(joints)
        return np.concatenate([CLOSING * found.closure[0], found.pose[0]])

    def slopes(joints: Array) -> Array:
        found = gaps(joints)
        return -np.concatenate([CLOSING * found.closure_rates[0], found.pose_rates[0]])

    start = np.array(solve_joints(machine).coordinates, dtype=float)
    best = least_squares(left, start, slopes, xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=2000)
    coordinates = pose_of(gaps(best.x).platform)
    return {name: _without_rounding(float(value[0])) for name, value in coordinates.items()}


def _without_rounding(value: float) -> float:
    """The value, or zero where nothing but rounding is left of it."""
    return 0.0 if abs(value) < SHOWN else value
