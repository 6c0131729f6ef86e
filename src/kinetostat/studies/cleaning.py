"""Set entries of a result that are only round-off beside its other entries to zero, and touch no other digit.

Screws and matrices are at one point, in one set of axes, in the order rx ry rz x y z.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.symmetric import SIZE
from kinetostat.algebra.vector import Vector
from kinetostat.kinetostatics.assembly import Statics
from kinetostat.kinetostatics.leg import AnyScrew
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY


def clean_screw(screw: AnyScrew, length: float, least: float = 0.0) -> AnyScrew:
    """Set components of a screw that are only round-off to zero.

    Args:
        screw: a screw of floats.
        length: factor of its last three components that makes them comparable with the first three: in m for a wrench,
            in 1/m for a twist.
        least: size of the whole wrench or twist if the screw is a share of one, in the unit of the first three
            components: what is round-off of the whole is zero, too.
    """
    sizes = [abs(c) * scale for c, scale in zip(screw.components(), [1.0] * 3 + [length] * 3, strict=True)]
    limit = ROUND_OFF_OF_ENTRY * max(least, *sizes)
    components = [float(c) if size > limit else 0.0 for c, size in zip(screw.components(), sizes, strict=True)]
    return type(screw)(Vector(*components[:3]), Vector(*components[3:]))


def clean_matrix(rows: Sequence[Sequence[float]], share: float = ROUND_OFF_OF_ENTRY) -> list[list[float]]:
    """Set entries of K or C [n x n] to zero that are below a share of the geometric mean of both diagonal entries."""
    sizes = [abs(row[i]) for i, row in enumerate(rows)]
    return [
        [0.0 if abs(c) < share * math.sqrt(size * other) else c for c, other in zip(row, sizes, strict=True)]
        for row, size in zip(rows, sizes, strict=True)
    ]


def clean_statics(statics: Statics) -> Statics:
    """The same statics with exact zeros where a component of a screw is only round-off.

    What K and C are summed of is cleaned together: a component that is small beside the others of a soft direction may
    be all that couples it with a stiff one.
    """
    length = statics.length
    return replace(
        statics,
        flexibility=tuple(clean_screw(twist, 1.0 / length) for twist in statics.flexibility),
        resistance=tuple(clean_screw(wrench, length) for wrench in statics.resistance),
        motions=_clean_sum(statics.motions, 1.0 / length),
        actions=_clean_sum(statics.actions, length),
    )


def _clean_sum(shares: Sequence[tuple[AnyScrew, Scalar]], length: float) -> tuple[tuple[AnyScrew, Scalar], ...]:
    """Screws with their weights, with zeros in components that are round-off in every screw of the sum.

    Where the weight is infinite, of a free or a rigid spring, a component that is round-off would become infinite: it
    is zero there whatever the other screws are.
    """
    cleaned = [clean_screw(screw, length).components() for screw, weight in shares if weight > 0.0]
    is_reached = [any(components) for components in zip(*cleaned, strict=True)] or [False] * SIZE
    result = []
    for screw, weight in shares:
        if math.isinf(weight):
            result.append((clean_screw(screw, length), weight))
            continue
        numbers = [float(c) if reached else 0.0 for c, reached in zip(screw.components(), is_reached, strict=True)]
        result.append((type(screw)(Vector(*numbers[:3]), Vector(*numbers[3:])), weight))
    return tuple(result)
