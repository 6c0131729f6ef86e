"""The numbers of the tool's error that a budget is about: components, lengths, a direction, parasitic motions.

Source: theory (53).
"""

from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.studies.budget.spread import Measures
from kinetostat.tolerances import NO_FREEDOM

PARASITIC = "parasitic "
"""Prefix of the measures of what no actuator corrects."""


def measures_of(
    drives: Array, components: Sequence[str], along: Array | None, length: float
) -> tuple[Measures, int, tuple[str, ...]]:
    """List what is measured of the twist of the tool.

    Args:
        drives: twist of the tool per unit of each actuator, SI [n x 6 x actuators].
        components: of the twist that the machine has.
        along: unit vector, base axes; None if no direction is asked for.
        length: by which rotations count beside displacements, m.

    Returns:
        The measures, how many freedoms the actuators move, and the components that none of them moves.
    """
    rows: dict[str, Array] = {name: np.eye(6)[COMPONENTS.index(name)] for name in components}
    if along is not None:
        rows["along"] = np.concatenate([np.zeros(3), along])
    left, freedoms, parasitic = _uncorrected(drives, components, length)
    lengths = _lengths(components, "")
    if freedoms < len(components):
        rows |= {f"{PARASITIC}{name}": left[:, COMPONENTS.index(name)] for name in components}
        lengths |= _lengths(components, PARASITIC)
    units = {name: "rad" if _turns(name) else "m" for name in (*rows, *lengths)}
    return Measures(rows, lengths, units), freedoms, parasitic


def _turns(name: str) -> bool:
    return name.removeprefix(PARASITIC) in ("rx", "ry", "rz", "rotation")


def _lengths(components: Sequence[str], prefix: str) -> dict[str, tuple[str, ...]]:
    """The angle and the distance, where they have more than one component."""
    parts = {
        "rotation": tuple(f"{prefix}{name}" for name in components if _turns(name)),
        "position": tuple(f"{prefix}{name}" for name in components if not _turns(name)),
    }
    return {f"{prefix}{name}": members for name, members in parts.items() if len(members) > 1}


def _uncorrected(drives: Array, components: Sequence[str], length: float) -> tuple[Array, int, tuple[str, ...]]:
    """The map from an error to what is left of it after small corrections of the actuators [n x 6 x 6], theory (53).

    Corrections take as much away as they can, rotations times the length counting like displacements.
    """
    scale = np.array([length] * 3 + [1.0] * 3)
    moved = drives * scale[:, None]
    basis, sizes, _ = np.linalg.svd(moved, full_matrices=False)
    counted = sizes > NO_FREEDOM * sizes.max(axis=1, initial=1e-300)[:, None]
    basis = basis * counted[:, None]
    left = np.eye(6) - basis @ np.swapaxes(basis, 1, 2)
    # Without round-off, so that what is moved by no actuator is all left, and what is moved by them is not.
    left = np.where(np.abs(left) < NO_FREEDOM, 0.0, left)
    most = np.abs(moved).max(initial=0.0)
    still = [name for name in components if (np.abs(moved[:, COMPONENTS.index(name)]) <= NO_FREEDOM * most).all()]
    return left * scale / scale[:, None], int(counted.sum(axis=1).min()), tuple(still)
