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
        near, at: b and a.
        moment: a x b.
        length: length of the rod, |a - b|.
        tension: the tension with which it pulls.
        density: force density c, which is the tension over the length: the rod pulls a with c (b - a).
        stretching, elastic: (k - c) and k over the square of the length, with the stiffness k of the rod: the weights
            of the dyad of its line in the tangent stiffness, and in the elastic part of it.
        slack: 1 where the rod carries nothing, else 0.
    """

    near: Vector
    at: Vector
    moment: Vector
    length: Scalar
    tension: Scalar
    density: Scalar
    stretching: Scalar
    elastic: Scalar
    slack: Scalar

    @property
    def line(self) -> tuple[Scalar, ...]:
        """The gradient of half the square of its length by a twist of the platform."""
        return (*(-self.moment).components(), *(self.at - self.near).components())


def pull_of(rod: ElasticRod, platform: Motions | None) -> RodPull:
    """Compute the pull of a rod at a place of the platform, or in the free state if `platform` is None."""
    near, far = Vector(*rod.near[0]), Vector(*rod.far[0])
    moved = ZERO if platform is None else Vector(*platform.shift(rod.far)[0])
    at, rest = far + moved, far - near
    span = at - near
    square, longer = span.dot(span), 0.0
    length = sqrt(square)
    if platform is not None:  # the difference of both lengths as a quotient, which does not cancel
        longer = moved.dot(span + rest) * (1.0 / (length + rest.norm()))
    stiffness = 1.0 / rod.softness
    tension, slack = (longer + rod.given) * stiffness, 0.0
    if rod.sign:
        carries = rod.sign * tension >= 0.0
        tension, stiffness, slack = (where(carries, *both) for both in ((tension, 0.0), (stiffness, 0.0), (0.0, 1.0)))
    density, shrink = tension * (1.0 / length), 1.0 / square
    stretching, elastic = (stiffness - density) * shrink, stiffness * shrink
    return RodPull(
        near=near,
        at=at,
        moment=at.cross(near),
        length=length,
        tension=tension,
        density=density,
        stretching=stretching,
        elastic=elastic,
        slack=slack,
    )


def wrench_of_rods(pulls: Sequence[RodPull], weights: Row) -> tuple[Array, Array]:
    """The wrench of all rods at the origin [1 x 6], and its decrease by a twist [1 x 6 x 6].

    Args:
        pulls: the pulls of the rods.
        weights: weight of the dyad of each line in the decrease: `stretching` of each pull for the tangent stiffness.
    """
    weighted_ends = [pull.at * pull.density for pull in pulls]
    ends = _sum(weighted_ends)
    starts = _sum([pull.near * pull.density for pull in pulls])
    # The sum of c a b^T: its antisymmetric part is the moment, and the whole says how the moment turns.
    outer = [
        [total([getattr(a, i) * getattr(p.near, j) for a, p in zip(weighted_ends, pulls, strict=True)]) for j in "xyz"]
        for i in "xyz"
    ]
    moment = [outer[i][j] - outer[j][i] for i, j in ((1, 2), (2, 0), (0, 1))]
    trace, density = outer[0][0] + outer[1][1] + outer[2][2], total([pull.density for pull in pulls])
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
        stretched = pull.tension + pull.elastic * pull.length * along
        loads += [(spring, stretched * force) for spring in rod.driven]
    return loads
