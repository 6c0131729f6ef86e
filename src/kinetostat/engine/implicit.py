"""Derivatives of joint coordinates that only equations give: linear systems pose by pose. Knows no machine.

Source: theory (34).
"""

import numpy as np

from kinetostat.engine.trace import Array

IDLE = 1e-9
"""Relative size of a singular value below which a combination of coordinates does not change the equations."""
OPEN = 1e-8
"""Share of the largest rate of an equation beyond which it can no longer be satisfied when a parameter changes."""


def total_slopes(slopes: Array, by_joints: Array, joint_rates: Array, rates: Array) -> Array:
    """Derivatives with the joints following: J_p + J_q dq/dp, where F_q dq/dp = -F_p, of least norm.

    Joint coordinates q(p) satisfy F(p, q) = 0; there may be more equations than coordinates, and coordinates that no
    equation needs.

    Args:
        slopes: J_p, by parameters [n x results x parameters].
        by_joints: J_q, by joint coordinates [n x results x coordinates].
        joint_rates: F_q, of the equations by joint coordinates [n x equations x coordinates].
        rates: F_p, by parameters [n x equations x parameters].

    Returns:
        [n x results x parameters]; NaN for a parameter that cannot change alone without breaking an equation, and
        where anything is not finite.
    """
    result = np.full(slopes.shape, np.nan)
    sound = np.isfinite(joint_rates).all(axis=(1, 2)) & np.isfinite(by_joints).all(axis=(1, 2))
    if not sound.any():
        return result
    left, sizes, right = np.linalg.svd(joint_rates[sound], full_matrices=False)
    kept = sizes > IDLE * sizes[:, :1]
    inverse = np.divide(1.0, sizes, where=kept, out=np.zeros_like(sizes))
    work = np.swapaxes(left, 1, 2) @ rates[sound]
    motion = -np.swapaxes(right, 1, 2) @ (inverse[:, :, None] * work)
    remaining = np.abs(rates[sound] + joint_rates[sound] @ motion).max(axis=1, initial=0.0)
    largest = np.abs(rates[sound]).max(axis=(1, 2), initial=0.0)
    follows = remaining <= OPEN * largest[:, None]
    total = slopes[sound] + by_joints[sound] @ motion
    result[sound] = np.where(follows[:, None, :], total, np.nan)
    return result
