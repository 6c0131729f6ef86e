"""Who is to blame: the exact share of each spring in every entry of K and C. Sums of the shares are K and C.

Source: theory (10) and (11). At the reference point and in the axes of the statics they are made of.
"""

from kinetostat.algebra.scalar import reciprocal
from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.kinetostatics.assembly import Statics, weighted_sum


def compliance_shares(statics: Statics) -> list[Symmetric6]:
    """Per spring s_e xi_e xi_e^T: what C would lose if this spring became rigid (theory section 2)."""
    pairs = zip(statics.flexibility, statics.compliance, strict=True)
    return [weighted_sum([pair], reciprocal(statics.length)) for pair in pairs]


def stiffness_shares(statics: Statics) -> list[Symmetric6]:
    """Per spring k_e b_e b_e^T: its share of the energy of any motion; eqs. 33-38 are its diagonal.

    In a leg with as many springs as wrenches it is also what K would lose if this spring became free. Where something
    is rigid whatever the springs, K is infinite and the shares do not add up to it.
    """
    return [weighted_sum([pair], statics.length) for pair in zip(statics.resistance, statics.stiffness, strict=True)]


def stiffness_coefficients(statics: Statics) -> list[Symmetric6]:
    """Per spring b_e b_e^T, with K = sum_e k_e b_e b_e^T: the numbers printed in eqs. 33-38, all entries."""
    return [Symmetric6.dyad(wrench, wrench) for wrench in statics.resistance]
