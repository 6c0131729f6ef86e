"""The 4-dof machine in batched NumPy, as an engineer writes it from eq. 32: arrays of matrices, einsum and inv.

Shares no code with kinetostat.
"""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

BASE_RADIUS, PLATFORM_RADIUS = 0.22, 0.12
BASE_ANGLE, PLATFORM_ANGLE = np.pi / 6, np.pi / 3
FIRST_LINK, SECOND_LINK = 0.68, 0.68
ACTUATOR, BENDING = 1000.0, np.array([1000.0, 1000.0])


def joints(radius: float, angle: float) -> Array:
    """Joint centres on a circle [4 x 3]."""
    angles = np.array([angle, np.pi / 2 + angle, -np.pi / 2 - angle, -angle])
    return radius * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)


BASE, PLATFORM = joints(BASE_RADIUS, BASE_ANGLE), joints(PLATFORM_RADIUS, PLATFORM_ANGLE)


def diagonals(x: Array, z: Array, theta5: Array, theta6: Array) -> Array:
    """Diagonals of C and K at n poses [12 x n], SI."""
    count = x.size
    square = x * x + z * z
    along = 0.5 * (1.0 + (FIRST_LINK**2 - SECOND_LINK**2) / square)
    across = np.sqrt(FIRST_LINK**2 / square - along * along)
    elbow_x, elbow_z = x * along + z * across, z * along - x * across
    upper_x, upper_z = (x - elbow_x) / SECOND_LINK, (z - elbow_z) / SECOND_LINK
    c5, s5, c6, s6 = np.cos(theta5), np.sin(theta5), np.cos(theta6), np.sin(theta6)
    c, s = upper_z * c5 + upper_x * s5, upper_x * c5 - upper_z * s5
    turn = np.zeros((count, 3, 3))
    turn[:, 0] = np.stack([c, s * s6, s * c6], axis=1)
    turn[:, 1, 1], turn[:, 1, 2] = c6, -s6
    turn[:, 2] = np.stack([-s, c * s6, c * c6], axis=1)
    arms = PLATFORM @ turn.transpose(0, 2, 1)
    legs = arms - BASE
    legs[:, :, 0] += x[:, None]
    legs[:, :, 2] += z[:, None]
    units = legs / np.sqrt(np.einsum("nki,nki->nk", legs, legs))[:, :, None]
    wrenches = np.concatenate([np.cross(arms, units), units], axis=2)  # [n x 4 x 6]

    jacobian = np.zeros((count, 6, 6))
    # Revolutes 51, 53, 55 along y; 56 along the pitched x; virtual joints 52 and 54 across their links.
    for k, (arm_x, arm_z) in enumerate([(x, z), (x - elbow_x, z - elbow_z), (0.0, 0.0)]):
        jacobian[:, 1, k] = 1.0
        jacobian[:, 3, k], jacobian[:, 5, k] = arm_z, -arm_x
    jacobian[:, 0, 3], jacobian[:, 2, 3] = c, -s
    lower_x, lower_z = elbow_x / FIRST_LINK, elbow_z / FIRST_LINK
    virtual = [(lower_x, lower_z, x, z), (upper_x, upper_z, x - elbow_x, z - elbow_z)]
    for k, (link_x, link_z, arm_x, arm_z) in enumerate(virtual, 4):
        jacobian[:, 0, k], jacobian[:, 2, k] = -link_z, link_x
        jacobian[:, 4, k] = link_x * arm_x + link_z * arm_z
    springs = np.linalg.inv(jacobian)[:, 4:]  # [n x 2 x 6]

    stiffness = ACTUATOR * (wrenches.transpose(0, 2, 1) @ wrenches)
    stiffness += (springs.transpose(0, 2, 1) * BENDING) @ springs
    compliance = np.linalg.inv(stiffness)
    return np.concatenate([np.einsum("nii->in", compliance), np.einsum("nii->in", stiffness)])
