"""A leg as (W, G): how it yields when it carries a wrench. One leg at a time; the platform is `assembly`'s."""

from collections.abc import Sequence

from kinetostat.algebra.scalar import Scalar, times, total
from kinetostat.machine.leg import LegScrews


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
