"""C of a placed machine by dense matrices: null spaces by singular values, one linear system for all legs at once."""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag, null_space

from kinetostat.algebra.screw import Screw
from kinetostat.arrays import Array
from kinetostat.kinetostatics.response import Response


def compliance(response: Response) -> Array:
    """C at the tool point, base axes [6 x 6], from joints and springs alone: theory, section 2, equation (4).

    Rows that a planar machine does not have are 0. Lengths are in units of the machine's while the system is solved.
    """
    configuration, length = response.configuration, float(response.configuration.length)
    plane = configuration.plane
    absent = () if plane is None else plane.missing_freedoms
    missing = columns([joint.twist(response.reference) for joint in absent], length)
    exist = null_space(missing.T) if absent else np.eye(6)
    bases, yielding = [], []
    for leg in configuration.legs:
        held = [spring for spring in leg.springs if float(spring.stiffness) > 0.0]
        free = [spring.joint for spring in leg.springs if spring not in held]
        passive = columns([joint.twist(response.reference) for joint in (*leg.passive, *free)], length)
        springs = columns([spring.joint.twist(response.reference) for spring in held], length)
        yields = np.diag([1.0 / float(spring.stiffness) for spring in held])
        carried = null_space(np.column_stack([passive, missing]).T)
        bases.append(exist.T @ carried)
        yielding.append(carried.T @ springs @ yields @ springs.T @ carried)
    wrenches, flexibility = np.column_stack(bases), block_diag(*yielding)
    size = len(wrenches)
    system = np.block([[np.zeros((size, size)), wrenches], [wrenches.T, -flexibility]])
    right = np.vstack([np.eye(size), np.zeros((len(flexibility), size))])
    scale = np.abs(flexibility).max() ** 0.5 or 1.0
    balance = np.diag(np.repeat([scale, 1.0 / scale], [size, len(flexibility)]))
    solved = balance @ np.linalg.lstsq(balance @ system @ balance, balance @ right, rcond=None)[0]
    unit = np.diag(np.repeat([1.0 / length, 1.0], 3))
    return np.asarray(unit @ exist @ solved[:size] @ exist.T @ unit)


def columns(screws: Sequence[Screw], length: float) -> Array:
    """Twists as columns [6 x n], angles times the length (m)."""
    rows = np.array([screw.components() for screw in screws], dtype=float).reshape(-1, 6)
    return rows.T * np.repeat([length, 1.0], 3)[:, None]
