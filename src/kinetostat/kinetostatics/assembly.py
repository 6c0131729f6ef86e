"""Legs to the platform: K and C from what the legs carry and how they yield (theory section 2).

One form serves rigid and flexible machines: springs enter by compliance, and a rigid or free one is exact.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from kinetostat.algebra.scalar import Scalar, reciprocal, where
from kinetostat.algebra.screw import Screw, Twist, Wrench
from kinetostat.algebra.solve import dual_basis
from kinetostat.algebra.symmetric import POSITIONS, Symmetric6
from kinetostat.algebra.vector import Vector
from kinetostat.kinetostatics.leg import combine, leg_modes, leg_resistance, loads
from kinetostat.machine.leg import LegScrews

INFINITE = float("inf")
ROUNDING = 1e-26
"""Square of 1e-13: below this share of the largest, what a rigid or free spring does to a component is rounding."""


@dataclass(frozen=True)
class Isostatic:
    """A machine whose legs carry six independent wrenches with six springs: every load has one answer.

    Attributes:
        flexibility: per spring, the platform twist per unit deformation of it alone (xi_e).
        compliance: per spring, s_e.
        resistance: per spring, the platform wrench per unit load in it alone (b_e), dual to the xi_e.
        stiffness: per spring, k_e = 1 / s_e; infinite also where a leg carries a load that none of its springs feels.
        length: characteristic length, m; rotations and translations compare through it where rounding is judged.
        regularity: 0 where the six wrenches become dependent and the platform is free with locked actuators.
    """

    flexibility: tuple[Twist, ...]
    compliance: tuple[Scalar, ...]
    resistance: tuple[Wrench, ...]
    stiffness: tuple[Scalar, ...]
    length: Scalar
    regularity: Scalar


def isostatic(legs: Sequence[LegScrews], length: Scalar) -> Isostatic:
    """Solve the statics of the whole machine: W^-1, leg by leg.

    Args:
        legs: at P, base axes; together they carry six wrenches, and each has as many springs as wrenches.
        length: characteristic length, m; scales rows, the result does not depend on it.

    Source: theory section 2, C = W^-T G W^-1 with G = S in the basis dual to the springs; eqs. 21 and 32.
    """
    twists, regularity = dual_twists([wrench for leg in legs for wrench in leg.wrenches], length)
    flexibility: list[Twist] = []
    for leg in legs:
        own = twists[len(flexibility) : len(flexibility) + len(leg.wrenches)]
        flexibility += [combine(own, row) for row in loads(leg)]
    actions = [action for leg in legs for action in leg_resistance(leg)]
    compliance = tuple(s for leg in legs for s in leg.compliance)
    resistance, stiffness = tuple(b for b, _ in actions), tuple(k for _, k in actions)
    return Isostatic(tuple(flexibility), compliance, resistance, stiffness, length, regularity)


def compliance_matrix(statics: Isostatic) -> Symmetric6:
    """C = sum_e s_e xi_e xi_e^T, t_small = C w (rad, m per N·m, N); infinite where a free spring moves the platform.

    Source: eq. 21, extended to flexible links.
    """
    return weighted_sum(statics.compliance, statics.flexibility, reciprocal(statics.length))


def stiffness_matrix(statics: Isostatic) -> Symmetric6:
    """K = sum_e k_e b_e b_e^T, w = K t_small (N·m, N per rad, m); infinite where a rigid spring holds the platform.

    Source: eq. 32.
    """
    return weighted_sum(statics.stiffness, statics.resistance, statics.length)


def flexible_stiffness(legs: Sequence[LegScrews]) -> Symmetric6:
    """K = sum_i W_i G_i^-1 W_i^T for legs that all yield (G_i > 0), however many; infinite if one does not.

    Source: theory section 2, eq. 32. A second route to `stiffness_matrix`, and the only one for redundant legs.
    """
    shares = [Symmetric6.dyad(b, b) * k for leg in legs for b, k in leg_modes(leg)]
    return Symmetric6.total(shares)


def dual_twists(wrenches: Sequence[Wrench], length: Scalar) -> tuple[list[Twist], Scalar]:
    """Six twists, each worked on by one of six wrenches alone: rows of W^-1.

    Args:
        wrenches: columns of W, at P in base axes.
        length: m; moments are compared with forces through it.

    Returns:
        The twists at P in base axes, and the regularity as in `solve.dual_basis`.
    """
    shrink = reciprocal(length)
    scaled = [Wrench(wrench.rotational * shrink, wrench.translational).components() for wrench in wrenches]
    rows, regularity = dual_basis(scaled)
    return [Twist(Vector(*row[:3]) * shrink, Vector(*row[3:])) for row in rows], regularity


def weighted_sum(weights: Sequence[Scalar], screws: Sequence[Screw], length: Scalar) -> Symmetric6:
    """sum_e w_e a_e a_e^T, where an infinite weight makes infinite just what its screw reaches beyond rounding.

    Args:
        weights: >= 0, infinity included.
        screws: as many.
        length: what to multiply translational components by, to compare them with rotational ones.
    """
    dyads = [Symmetric6.dyad(screw, screw) for screw in screws]
    finite = Symmetric6.total([d * where(w < INFINITE, w, 0.0) for w, d in zip(weights, dyads, strict=True)])
    endless = Symmetric6.total([d * where(w < INFINITE, 0.0, 1.0) for w, d in zip(weights, dyads, strict=True)])
    reached = [a * scale for a, scale in zip(endless.diagonal(), [1.0] * 3 + [length * length] * 3, strict=True)]
    limit = ROUNDING * sum(reached)
    entries = []
    for k, (i, j) in enumerate(POSITIONS):
        beyond = (reached[i] > limit) & (reached[j] > limit)
        entries.append(where(beyond, INFINITE, finite.upper[k]))
    return Symmetric6(tuple(entries))
