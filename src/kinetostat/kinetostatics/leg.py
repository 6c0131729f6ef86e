"""A leg as (W, G): how it yields when it carries a wrench. One leg at a time; the platform is `assembly`'s."""

from collections.abc import Sequence
from typing import TypeVar

from kinetostat.algebra.scalar import Scalar, reciprocal, sqrt, times, total, where
from kinetostat.algebra.screw import Screw, Wrench
from kinetostat.algebra.solve import diagonalise, dual_basis
from kinetostat.algebra.vector import Vector
from kinetostat.machine.leg import LegScrews

AnyScrew = TypeVar("AnyScrew", bound=Screw)

UNSEEN = 1e-12
"""Sine of the angle between the loads of a leg's springs below which they are dependent, up to rounding."""

Action = tuple[Wrench, Scalar]
"""A wrench b (N·m, N per N or N·m of load) and a stiffness k (N/m or N·m/rad): the share k b b^T of a leg in K."""


def loads(leg: LegScrews) -> Sequence[Sequence[Scalar]]:
    """J_e^T W [b x m]: the load in each spring per unit of each wrench the leg carries (principle of virtual work)."""
    if leg.loads is not None:
        return leg.loads
    return [[wrench.work(twist) for wrench in leg.wrenches] for twist in leg.elastic]


def leg_compliance(leg: LegScrews) -> list[list[Scalar]]:
    """G = W^T J_e S J_e^T W [m x m], symmetric and >= 0: W^T t = G lambda.

    Source: theory section 2. Zero for a rigid leg; infinite where a free spring is loaded.
    """
    load = loads(leg)
    size = range(len(leg.wrenches))
    return [
        [total([times(s, times(row[a], row[b])) for s, row in zip(leg.compliance, load, strict=True)]) for b in size]
        for a in size
    ]


def leg_modes(leg: LegScrews) -> list[Action]:
    """The leg's stiffness W G^-1 W^T as m shares: wrenches for which G is diagonal, infinite where G vanishes.

    Source: theory section 2, eq. 32.
    """
    rows, pivots = diagonalise(leg_compliance(leg))
    return [(combine(leg.wrenches, row), reciprocal(pivot)) for row, pivot in zip(rows, pivots, strict=True)]


def leg_resistance(leg: LegScrews) -> list[Action]:
    """The leg's stiffness spring by spring, for as many springs as wrenches: b_e loads spring e alone, by one unit.

    Where some load of the leg is felt by no spring the b_e do not exist; the leg is rigid under that load, and the
    shares are those of `leg_modes`.
    """
    stiffness = [reciprocal(s) for s in leg.compliance]
    if leg.loads is not None:
        return list(zip(leg.wrenches, stiffness, strict=True))
    load = loads(leg)
    sizes = [reciprocal(sqrt(total([times(c, c) for c in row]))) for row in load]
    unload, sine = dual_basis([[times(c, size) for c in row] for row, size in zip(load, sizes, strict=True)])
    apart = sine > UNSEEN
    springwise = [combine(leg.wrenches, row) * size for row, size in zip(unload, sizes, strict=True)]
    pairs = zip(springwise, stiffness, leg_modes(leg), strict=True)
    return [(_either(apart, b, mode), where(apart, k, rigidity)) for b, k, (mode, rigidity) in pairs]


def combine(screws: Sequence[AnyScrew], weights: Sequence[Scalar]) -> AnyScrew:
    """Linear combination of screws of one kind."""
    result = screws[0] * weights[0]
    for screw, weight in zip(screws[1:], weights[1:], strict=True):
        result = result + screw * weight
    return result


def _either(condition: Scalar, a: Wrench, b: Wrench) -> Wrench:
    chosen = [where(condition, p, q) for p, q in zip(a.components(), b.components(), strict=True)]
    return Wrench(Vector(*chosen[:3]), Vector(*chosen[3:]))
