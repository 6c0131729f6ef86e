"""The Tripteron in batched NumPy, written by hand: closed-form elbows, beam springs, small batched inverses.

The honest best that a careful engineer writes without a compiler: the wrenches of each leg are constant here (two
moments across its slide, a force along it), so that a leg is a 3 x 3 matrix G per pose and no 6 x 6 is formed before
the sum.
"""

import math

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

LINK, DIAMETER, YOUNG, SHEAR, ACTUATOR = 0.75, 0.15, 70e9, 25.5e9, 1e6
AREA, SECOND = math.pi * DIAMETER**2 / 4, math.pi * DIAMETER**4 / 64
FRAMES = [
    (np.zeros(3), np.eye(3)),
    (np.array([0.0, 0.0, 1.0]), np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])),
    (np.array([0.0, 1.0, 0.0]), np.array([[0.0, 0, 1], [0, -1, 0], [1, 0, 0]])),
]
"""Start and axes (rows x, y, z) of the legs along z, y and x."""


def diagonals(*pose: Array) -> Array:
    """Diagonals of C and K at n platform points x, y, z [12 x n], SI."""
    points = np.stack(pose, axis=1)
    stiffness = np.zeros((len(points), 6, 6))
    for start, axes in FRAMES:
        u, v, _ = axes @ (points - start).T
        x, y, z = axes
        wrenches = np.zeros((6, 3))
        wrenches[:3, 0], wrenches[:3, 1], wrenches[3:, 2] = x, y, z
        stiffness += wrenches @ np.linalg.inv(leg_compliance(u, v)) @ wrenches.T
    compliance = np.linalg.inv(stiffness)
    return np.concatenate([np.einsum("nii->in", compliance), np.einsum("nii->in", stiffness)])


def leg_compliance(u: Array, v: Array) -> Array:
    """G [n x 3 x 3] of a leg for moments about its x and y and a force along its z; P at (u, v), elbow on the right."""
    square = u * u + v * v
    along, across = 0.5, np.sqrt(LINK**2 / square - 0.25)
    elbow = np.stack([along * u + across * v, along * v - across * u])
    tip = np.stack([u, v])
    result = np.zeros((len(u), 3, 3))
    result[:, 2, 2] = 1.0 / ACTUATOR
    for near, far in ((np.zeros_like(tip), elbow), (elbow, tip)):
        direction = (far - near) / LINK
        normal = np.stack([-direction[1], direction[0]])
        arm = tip - 0.5 * (near + far)
        # a force along z at P is, at the middle of a link, a moment arm x z = (arm_y, -arm_x) beside the force
        lever = np.stack([arm[1], -arm[0]])
        for axis, soft in ((direction, LINK / (SHEAR * 2 * SECOND)), (normal, LINK / (YOUNG * SECOND))):
            load = np.stack([axis[0], axis[1], axis[0] * lever[0] + axis[1] * lever[1]], axis=1)
            result += soft * load[:, :, None] * load[:, None, :]
        result[:, 2, 2] += LINK**3 / (12 * YOUNG * SECOND)
    return result
