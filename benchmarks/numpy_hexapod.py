"""The published hexapod in batched NumPy, as an engineer writes it: arrays of matrices, K = J^T k J, batched inverse.

Shares no code with kinetostat.
"""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

ACTUATOR = 20e6
SHORTEST, LONGEST, STEEPEST = 0.07, 0.125, np.radians(75)
"""Limits: of the length of legs, m, and of their angles to the z axes of base and platform."""
LENGTH, LEAST_MARGIN = 0.1025, 1e-6
"""Through which rotations and translations compare, m, and the singularity margin below which nothing has a result."""


def ring(radius: float, height: float, angles: list[float]) -> Array:
    """Joint centres on a circle [6 x 3]; angles in degrees."""
    at = np.radians(angles)
    return np.stack([radius * np.cos(at), radius * np.sin(at), np.full(6, height)], axis=1)


BASE = ring(0.115, 0.015, [-10, 10, 110, 130, 230, 250])
PLATFORM = ring(0.090, -0.060, [-50, 50, 70, 170, 190, -70])


def diagonals(x: Array, y: Array, z: Array, roll: Array, pitch: Array, yaw: Array) -> Array:
    """Diagonals of C and K at n poses [12 x n], SI; Q = Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sp, sy) = (f(np.stack([roll, pitch, yaw])) for f in (np.cos, np.sin))
    turn = np.empty((x.size, 3, 3))
    turn[:, 0] = np.stack([cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], axis=1)
    turn[:, 1] = np.stack([sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], axis=1)
    turn[:, 2] = np.stack([-sp, cp * sr, cp * cr], axis=1)
    arms = PLATFORM @ turn.transpose(0, 2, 1)
    legs = arms - BASE + np.stack([x, y, z], axis=1)[:, None]
    units = legs / np.sqrt(np.einsum("nki,nki->nk", legs, legs))[:, :, None]
    wrenches = np.concatenate([np.cross(arms, units), units], axis=2)  # [n x 6 x 6], a wrench in each row
    stiffness = ACTUATOR * (wrenches.transpose(0, 2, 1) @ wrenches)
    compliance = np.linalg.inv(stiffness)
    return np.concatenate([np.einsum("nii->in", compliance), np.einsum("nii->in", stiffness)])
