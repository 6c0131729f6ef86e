"""The pull of each rod at a place of the platform, and how all rods resist the platform's motion.

Everything is computed over scalars, so that the same lines serve numbers, arrays and traced programs. States of rest
are found elsewhere.

Source: theory (44). Units, axes and origin are those of `mechanism`.
"""

from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.scalar import Scalar, sqrt, total, where
from kinetostat.algebra.solve import Row
from kinetostat.algebra.symmetric import POSITIONS
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.arrays import Array
from kinetostat.equilibrium.cut import ElasticRod
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Spring
from kinetostat.numerics.motions import Motions, of_scalars, skew_of


@dataclass(frozen=True)
class RodPull:
    """Pull of a rod from a point b of the base to a point a of the platform.

    Attributes:
        base_point, platform_point: b and a.
        moment: a x b.
        length: length of the rod, |a - b|.
        tension: the tension with which it pulls.
        force_density: c, the tension over the length: the rod pulls a with c (b - a).
        tangent_weight, elastic_weight: weights of the dyad of the rod's line in the tangent stiffness, and in the
            elastic part of it: (k - c) and k over the square of the length, with the stiffness k of the rod.
        slack: 1 where the rod carries nothing, else 0.
    """

    base_point: Vector
    platform_point: Vector
    moment: Vector
    length: Scalar
    tension: Scalar
    force_density: Scalar
    tangent_weight: Scalar
    elastic_weight: Scalar
    slack: Scalar

    @property
    def line(self) -> tuple[Scalar, ...]:
        """The gradient of half the square of its length by a twist of the platform."""
        return (*(-self.moment).components(), *(self.platform_point - self.base_point).components())


def pull_of(rod: ElasticRod, platform: Motions | None) -> RodPull:
    """Compute the pull of a rod at a place of the platform, or in the free state if `platform` is None."""
    base_point, free_point = Vector(*rod.ends.near[0]), Vector(*rod.ends.far[0])
    shift = ZERO if platform is None else Vector(*platform.shift(rod.ends.far)[0])
    platform_point, free_span = free_point + shift, free_point - base_point
    span = platform_point - base_point
    square = span.dot(span)
    length = sqrt(square)
    # The difference of both lengths is written as a quotient, which does not cancel.
    elongation = 0.0 if platform is None else shift.dot(span + free_span) * (1.0 / (length + free_span.norm()))
    stiffness, slack = 1.0 / rod.softness, 0.0
    tension = (elongation + rod.natural_elongation) * stiffness
    if rod.sign:
        carries = rod.sign * tension >= 0.0
        tension, stiffness = where(carries, tension, 0.0), where(carries, stiffness, 0.0)
        slack = where(carries, 0.0, 1.0)
    force_density, inverse_square = tension * (1.0 / length), 1.0 / square
    return RodPull(
        base_point=base_point,
        platform_point=platform_point,
        moment=platform_point.cross(base_point),
        length=length,
        tension=tension,
        force_density=force_density,
        tangent_weight=(stiffness - force_density) * inverse_square,
        elastic_weight=stiffness * inverse_square,
        slack=slack,
    )


def wrench_of_rods(pulls: Sequence[RodPull], weights: Row) -> tuple[Array, Array]:
    """The wrench of all rods at the origin [1 x 6], and the negative of its derivative by a twist [1 x 6 x 6].

    Args:
        pulls: the pulls of the rods.
        weights: weight of the dyad of each line in the derivative: `tangent_weight` of each pull for the tangent
            stiffness.
    """
    weighted_ends = [pull.platform_point * pull.force_density for pull in pulls]
    ends = _sum(weighted_ends)
    starts = _sum([pull.base_point * pull.force_density for pull in pulls])
    # S, the sum of c a b^T: its antisymmetric part is the moment, and the whole says how the moment turns.
    outer = [
        [
            total([getattr(a, i) * getattr(p.base_point, j) for a, p in zip(weighted_ends, pulls, strict=True)])
            for j in "xyz"
        ]
        for i in "xyz"
    ]
    moment = [outer[i][j] - outer[j][i] for i, j in ((1, 2), (2, 0), (0, 1))]
    trace, density = outer[0][0] + outer[1][1] + outer[2][2], total([pull.force_density for pull in pulls])
    # The weighted dyads, and the geometric part [tr(S) 1 - S, [sum c b]x; -[sum c a]x, (sum c) 1].
    decrease = sum_of_dyads(pulls, weights)[None]
    for i in range(3):
        for j in range(3):
            decrease[0, i, j] = decrease[0, i, j] + (trace if i == j else 0.0) - outer[i][j]
        decrease[0, 3 + i, 3 + i] = decrease[0, 3 + i, 3 + i] + density
    decrease[:, :3, 3:] = decrease[:, :3, 3:] + skew_of(of_scalars(starts.components()))
    decrease[:, 3:, :3] = decrease[:, 3:, :3] - skew_of(of_scalars(ends.components()))
    return of_scalars([*moment, *(starts - ends).components()]), decrease


def _sum(vectors: Sequence[Vector]) -> Vector:
    if not vectors:
        return ZERO
    return Vector(*(total(list(parts)) for parts in zip(*(v.components() for v in vectors), strict=True)))


def sum_of_dyads(pulls: Sequence[RodPull], weights: Row) -> Array:
    """The weighted sum of the dyads of all lines [6 x 6]."""
    result = np.zeros((6, 6), dtype=object)
    for i, j in POSITIONS:
        pairs = zip(pulls, weights, strict=True)
        result[i, j] = result[j, i] = total([pull.line[i] * pull.line[j] * weight for pull, weight in pairs])
    return result


def loads_of_rods(
    rods: Sequence[ElasticRod], pulls: Sequence[RodPull], twist: Row, force: Scalar
) -> list[tuple[Spring, Scalar]]:
    """The actuators of rods with their tensions after a step of the platform, to first order, N.

    Args:
        rods, pulls: the rods, and their pulls before the step.
        twist: the step of the platform.
        force: unit of force of the mechanism, N.
    """
    loads = []
    for rod, pull in zip(rods, pulls, strict=True):
        along = total([a * b for a, b in zip(pull.line, twist, strict=True)])
        tension = pull.tension + pull.elastic_weight * pull.length * along
        loads += [(spring, tension * force) for spring in rod.driven]
    return loads
