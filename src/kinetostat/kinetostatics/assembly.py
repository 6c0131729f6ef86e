"""Legs to the platform: K and C from what the legs carry and how they yield (theory section 2).

One form serves rigid and flexible machines: springs enter by compliance, and a rigid or free one is exact.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from kinetostat.algebra.scalar import Scalar, reciprocal, where
from kinetostat.algebra.screw import Screw, Twist, Wrench
from kinetostat.algebra.solve import dual_basis, inverse_positive
from kinetostat.algebra.symmetric import POSITIONS, Symmetric6
from kinetostat.algebra.vector import Vector
from kinetostat.kinetostatics.leg import leg_compliance, loads
from kinetostat.machine.leg import LegScrews

AnyScrew = TypeVar("AnyScrew", bound=Screw)
INFINITE = float("inf")
ROUNDING = 1e-26
"""Square of 1e-13: below this share of the largest, what a rigid or free spring does to a component is rounding."""


@dataclass(frozen=True)
class Isostatic:
    """A machine whose legs carry six independent wrenches with six springs: every load has one answer.

    Attributes:
        flexibility: per spring, the platform twist per unit deformation of it alone (xi_e).
        resistance: per spring, the platform wrench per unit load in it alone (b_e), dual to the xi_e.
        compliance: per spring, s_e.
        regularity: 0 where the six wrenches become dependent and the platform is free with locked actuators.
    """

    flexibility: tuple[Twist, ...]
    resistance: tuple[Wrench, ...]
    compliance: tuple[Scalar, ...]
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
    resistance: list[Wrench] = []
    for leg in legs:
        own = twists[len(flexibility) : len(flexibility) + len(leg.wrenches)]
        load = loads(leg)
        unload, _ = dual_basis(load)
        flexibility += [combine(own, row) for row in load]
        resistance += [combine(leg.wrenches, row) for row in unload]
    springs = tuple(s for leg in legs for s in leg.compliance)
    return Isostatic(tuple(flexibility), tuple(resistance), springs, regularity)


def compliance_matrix(statics: Isostatic) -> Symmetric6:
    """C = sum_e s_e xi_e xi_e^T, t_small = C w (rad, m per N·m, N); infinite where a free spring moves the platform.

    Source: eq. 21, extended to flexible links.
    """
    return weighted_sum(statics.compliance, statics.flexibility)


def stiffness_matrix(statics: Isostatic) -> Symmetric6:
    """K = sum_e k_e b_e b_e^T, w = K t_small (N·m, N per rad, m); infinite where a rigid spring holds the platform.

    Source: eq. 32.
    """
    return weighted_sum([reciprocal(s) for s in statics.compliance], statics.resistance)


def flexible_stiffness(legs: Sequence[LegScrews]) -> Symmetric6:
    """K = sum_i W_i G_i^-1 W_i^T for legs that all yield (G_i > 0), however many; NaN if one does not.

    Source: theory section 2, eq. 32. A second route to `stiffness_matrix`, and the only one for redundant legs.
    """
    terms = []
    for leg in legs:
        inverse = inverse_positive(leg_compliance(leg))
        for a, first in enumerate(leg.wrenches):
            terms += [Symmetric6.dyad(first, second) * inverse[a][b] for b, second in enumerate(leg.wrenches)]
    return Symmetric6.total(terms)


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


def combine(screws: Sequence[AnyScrew], weights: Sequence[Scalar]) -> AnyScrew:
    """Linear combination of screws of one kind."""
    result = screws[0] * weights[0]
    for screw, weight in zip(screws[1:], weights[1:], strict=True):
        result = result + screw * weight
    return result


def weighted_sum(weights: Sequence[Scalar], screws: Sequence[Screw]) -> Symmetric6:
    """sum_e w_e a_e a_e^T, where an infinite weight makes infinite just what its screw reaches beyond rounding."""
    dyads = [Symmetric6.dyad(screw, screw) for screw in screws]
    finite = Symmetric6.total([d * where(w < INFINITE, w, 0.0) for w, d in zip(weights, dyads, strict=True)])
    endless = Symmetric6.total([d * where(w < INFINITE, 0.0, 1.0) for w, d in zip(weights, dyads, strict=True)])
    diagonal = endless.diagonal()
    limit = ROUNDING * sum(diagonal)
    entries = []
    for k, (i, j) in enumerate(POSITIONS):
        reached = (diagonal[i] > limit) & (diagonal[j] > limit)
        entries.append(where(reached, INFINITE, finite.upper[k]))
    return Symmetric6(tuple(entries))
