"""The compliance that an independent engine returns, and the difference of two compliances. Knows no engine."""

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.tolerances import RIGID_BLOCK_OF_ENGINE

ROTATIONS, TRANSLATIONS = slice(0, 3), slice(3, 6)


@dataclass(frozen=True)
class Trial:
    """One of the results from which an engine's final one follows.

    Attributes:
        scale: the quantity that was varied, see `Answer.varied`.
        compliance: C at the reference point, base axes, rx ry rz x y z [6 x 6].
    """

    scale: float
    compliance: Array


@dataclass(frozen=True)
class Answer:
    """An engine's compliance of a machine.

    Attributes:
        compliance: C at the reference point, base axes, rx ry rz x y z [6 x 6]; rows that a planar machine does not
            have are 0.
        second_best: C by the engine's next best way, if there is one; their difference is the uncertainty.
        varied: the quantity that the trials vary, in words.
        trials: in the order of their scale.
    """

    compliance: Array
    second_best: Array | None
    varied: str
    trials: tuple[Trial, ...]


def block_differences(
    actual: Array, expected: Array, length: float, vanishing: float = RIGID_BLOCK_OF_ENGINE, scale: Array | None = None
) -> dict[str, float]:
    """Return the relative difference of two compliances in their blocks: rotation, coupling, translation.

    A block of `expected`, or of `scale` if given, is measured by its Frobenius norm, the coupling by the geometric mean
    of the two diagonal blocks: for a positive semi-definite matrix it is at most that, and no unit is mixed. Where the
    machine is rigid in one diagonal block (it is below the share `vanishing` of the other), there is nothing to compare
    with; then the other block is the measure, converted by `length` (m).
    """
    measure = expected if scale is None else scale
    turning, moving = (float(np.linalg.norm(measure[b, b])) for b in (ROTATIONS, TRANSLATIONS))
    if turning * length**2 < vanishing * moving:
        turning = moving / length**2
    elif moving < vanishing * turning * length**2:
        moving = turning * length**2
    sizes = {
        "rotation": (ROTATIONS, ROTATIONS, turning),
        "coupling": (ROTATIONS, TRANSLATIONS, float(np.sqrt(turning * moving))),
        "translation": (TRANSLATIONS, TRANSLATIONS, moving),
    }
    error = actual - expected
    errors = {
        name: max(float(np.linalg.norm(error[rows, columns])), float(np.linalg.norm(error[columns, rows])))
        for name, (rows, columns, _) in sizes.items()
    }
    return {name: errors[name] / size if size > 0.0 else errors[name] for name, (_, _, size) in sizes.items()}


def difference(actual: Array, expected: Array, length: float, vanishing: float = RIGID_BLOCK_OF_ENGINE) -> float:
    """Return the largest of the relative differences of the blocks."""
    return max(block_differences(actual, expected, length, vanishing).values())
