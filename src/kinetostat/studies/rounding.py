"""Round-off: entries of a result that are only round-off beside its other entries are set to zero.

No other digit is touched. Screws and matrices are at one point, in one set of axes, in the order rx ry rz x y z.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from kinetostat.algebra.vector import Vector
from kinetostat.kinetostatics.assembly import Statics
from kinetostat.kinetostatics.leg import AnyScrew

ROUNDING = 1e-12
"""Share of what a number is compared with below which it is rounding."""


def clean_screw(screw: AnyScrew, length: float, least: float = 0.0) -> AnyScrew:
    """The screw without components that rounding alone explains.

    Args:
        screw: of floats.
        length: by which its last three components are multiplied to compare with the first three: m for a wrench,
            1/m for a twist.
        least: size of what it is a part of, measured as its first three components.
    """
    sizes = [abs(c) * scale for c, scale in zip(screw.components(), [1.0] * 3 + [length] * 3, strict=True)]
    limit = ROUNDING * max(least, *sizes)
    kept = [float(c) if size > limit else 0.0 for c, size in zip(screw.components(), sizes, strict=True)]
    return type(screw)(Vector(*kept[:3]), Vector(*kept[3:]))


def clean_matrix(rows: Sequence[Sequence[float]], share: float = ROUNDING) -> list[list[float]]:
    """K or C [n x n] without entries that are less than a `share` of the geometric mean of their diagonal ones."""
    sizes = [abs(row[i]) for i, row in enumerate(rows)]
    return [
        [0.0 if abs(c) < share * math.sqrt(size * other) else c for c, other in zip(row, sizes, strict=True)]
        for row, size in zip(rows, sizes, strict=True)
    ]


def clean_statics(statics: Statics) -> Statics:
    """The same statics with exact zeros where a component of a screw is only round-off."""
    length = statics.length
    return replace(
        statics,
        flexibility=tuple(clean_screw(twist, 1.0 / length) for twist in statics.flexibility),
        resistance=tuple(clean_screw(wrench, length) for wrench in statics.resistance),
        motions=tuple((clean_screw(twist, 1.0 / length), s) for twist, s in statics.motions),
        actions=tuple((clean_screw(wrench, length), k) for wrench, k in statics.actions),
    )
