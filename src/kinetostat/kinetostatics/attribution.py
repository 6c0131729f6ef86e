"""Who is to blame: the exact share of each spring in every entry of K and C. Sums of the shares are K and C."""

from kinetostat.algebra.scalar import reciprocal
from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.kinetostatics.assembly import Isostatic, weighted_sum


def compliance_shares(statics: Isostatic) -> list[Symmetric6]:
    """Per spring s_e xi_e xi_e^T: what C would lose if this spring became rigid (theory section 2)."""
    pairs = zip(statics.compliance, statics.flexibility, strict=True)
    return [weighted_sum([s], [twist], reciprocal(statics.length)) for s, twist in pairs]


def stiffness_shares(statics: Isostatic) -> list[Symmetric6]:
    """Per spring k_e b_e b_e^T: what K would lose if this spring became free; eqs. 33-38 are its diagonal."""
    pairs = zip(statics.stiffness, statics.resistance, strict=True)
    return [weighted_sum([k], [wrench], statics.length) for k, wrench in pairs]


def stiffness_coefficients(statics: Isostatic) -> list[Symmetric6]:
    """Per spring b_e b_e^T, with K = sum_e k_e b_e b_e^T: the numbers printed in eqs. 33-38, all entries."""
    return [Symmetric6.dyad(wrench, wrench) for wrench in statics.resistance]
