"""Legs to the platform: K and C from what the legs carry and how they yield (theory section 2).

One form serves rigid and flexible machines: springs enter by compliance, and a rigid or free one is exact.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from kinetostat.algebra.scalar import Scalar, minus, reciprocal, times, total, where
from kinetostat.algebra.screw import Screw, Twist, Wrench
from kinetostat.algebra.solve import dual_basis, right_inverse, solve_semidefinite
from kinetostat.algebra.symmetric import POSITIONS, SIZE, Symmetric6
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.kinetostatics.leg import INFINITE, combine, leg_compliance, leg_modes, leg_resistance, relaxed
from kinetostat.machine.leg import LegScrews

ROUNDING = 1e-26
"""Square of 1e-13: below this share of the largest, what a rigid or free spring does to a component is rounding."""


NO_MOTION = Twist(ZERO, ZERO)


@dataclass(frozen=True)
class Statics:
    """How the springs of a machine share any load, and resist any motion.

    Attributes:
        sharing: per leg, and per wrench that it carries, its amount per unit platform wrench, as a twist.
        flexibility: per spring, the load in it per unit platform wrench (xi_e); in a machine without redundancy also
            the platform twist per unit deformation of it alone.
        compliance: per spring, s_e.
        resistance: per spring, and per load that nothing yields to, a platform wrench (b_e or c_e).
        stiffness: per entry of `resistance`, its weight in K (k_e or s_e, or 0 or infinity).
        length: characteristic length, m; rotations and translations compare through it where rounding is judged.
        regularity: 0 where the wrenches do not span all six dimensions: the platform is free with locked actuators.
    """

    sharing: tuple[tuple[Twist, ...], ...]
    flexibility: tuple[Twist, ...]
    compliance: tuple[Scalar, ...]
    resistance: tuple[Wrench, ...]
    stiffness: tuple[Scalar, ...]
    length: Scalar
    regularity: Scalar


def solve_statics(legs: Sequence[LegScrews], length: Scalar, guide: Sequence[Wrench] = ()) -> Statics:
    """Solve the statics of the whole machine, redundant or not, rigid or flexible.

    Args:
        legs: at the reference point, base axes; together they carry six wrenches or more.
        length: characteristic length, m; scales rows, the result does not depend on it.
        guide: of a planar machine, the wrenches against twists that do not exist there.

    Source: theory section 2; eqs. 21 and 32.
    """
    balanced = list(legs)
    if sum(len(leg.wrenches) for leg in legs) + len(guide) > SIZE:
        balanced = [relaxed(leg) for leg in legs]
    wrenches = [wrench for leg in balanced for wrench in leg.wrenches] + list(guide)
    if len(wrenches) == SIZE:
        twists, regularity = dual_twists(wrenches, length)
    else:
        twists, regularity = least_energy_twists(balanced, wrenches, length)
    sharing: list[tuple[Twist, ...]] = []
    flexibility: list[Twist] = []
    for leg in balanced:
        taken = sum(len(own) for own in sharing)
        sharing.append(tuple(twists[taken : taken + len(leg.wrenches)]))
        flexibility += [combine(sharing[-1], row) if row else NO_MOTION for row in leg.loads]
    parts = [leg_resistance(leg) for leg in legs]
    actions = [action for shares, _ in parts for action in shares] + [action for _, held in parts for action in held]
    compliance = tuple(s for leg in legs for s in leg.compliance)
    resistance, stiffness = tuple(b for b, _ in actions), tuple(k for _, k in actions)
    return Statics(tuple(sharing), tuple(flexibility), compliance, resistance, stiffness, length, regularity)


def compliance_matrix(statics: Statics) -> Symmetric6:
    """C = sum_e s_e xi_e xi_e^T, t_small = C w (rad, m per N·m, N); infinite where a free spring moves the platform.

    Source: eq. 21, extended to flexible links.
    """
    return weighted_sum(statics.compliance, statics.flexibility, reciprocal(statics.length))


def stiffness_matrix(statics: Statics) -> Symmetric6:
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


def least_energy_twists(
    legs: Sequence[LegScrews], wrenches: Sequence[Wrench], length: Scalar
) -> tuple[list[Twist], Scalar]:
    """How legs that carry more than six wrenches share a load: of all balances, the one of least elastic energy.

    lambda = W+ w + N z with W N = 0, and (N^T G N) z = -N^T G W+ w (force method). Where rigid parts leave z undecided,
    no displacement depends on it: the undecided internal load is taken as zero.

    Args:
        legs: at P, base axes; their G may be singular.
        wrenches: of all legs in order, columns of W.
        length: m, scales rows.

    Returns:
        lambda per unit platform wrench, a twist for each leg wrench, and the regularity of W.
    """
    shrink = reciprocal(length)
    columns = [Wrench(wrench.rotational * shrink, wrench.translational).components() for wrench in wrenches]
    if len(wrenches) < SIZE:
        return [NO_MOTION] * len(wrenches), 0.0
    balance, internal, regularity = right_inverse([list(row) for row in zip(*columns, strict=True)])
    yielding = [_yield(legs, mode) for mode in internal]
    energy = [[_product(mode, other) for other in yielding] for mode in internal]
    work = [[_product(other, [row[c] for row in balance]) for c in range(SIZE)] for other in yielding]
    shift = solve_semidefinite(energy, work)
    every = range(len(wrenches))
    shifts = [[_product([mode[a] for mode in internal], [z[c] for z in shift]) for c in range(SIZE)] for a in every]
    rows = [[minus(p, q) for p, q in zip(row, other, strict=True)] for row, other in zip(balance, shifts, strict=True)]
    return [Twist(Vector(*row[:3]) * shrink, Vector(*row[3:])) for row in rows], regularity


def _yield(legs: Sequence[LegScrews], amounts: Sequence[Scalar]) -> list[Scalar]:
    """G lambda, leg by leg."""
    result: list[Scalar] = []
    for leg in legs:
        own = amounts[len(result) : len(result) + len(leg.wrenches)]
        result += [_product(row, own) for row in leg_compliance(leg)]
    return result + [0.0] * (len(amounts) - len(result))  # a plane's guide does not yield


def _product(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    return total([times(p, q) for p, q in zip(a, b, strict=True)])


def weighted_sum(weights: Sequence[Scalar], screws: Sequence[Screw], length: Scalar) -> Symmetric6:
    """sum_e w_e a_e a_e^T, where an infinite weight makes infinite just what its screw reaches beyond rounding.

    Args:
        weights: >= 0, infinity included.
        screws: as many.
        length: what to multiply translational components by, to compare them with rotational ones.
    """
    dyads = [Symmetric6.dyad(screw, screw) for screw in screws]
    finite = Symmetric6.total([d * where(w < INFINITE, w, 0.0) for w, d in zip(weights, dyads, strict=True)])
    reached = [_endless(w, screw, length) for w, screw in zip(weights, screws, strict=True)]
    entries = []
    for k, (i, j) in enumerate(POSITIONS):
        together = total([times(flags[i], flags[j]) for flags in reached])
        entries.append(where(together > 0.5, INFINITE, finite.upper[k]))
    return Symmetric6(tuple(entries))


def _endless(weight: Scalar, screw: Screw, length: Scalar) -> list[Scalar]:
    """1 for each component of the screw that an infinite weight reaches beyond rounding, else 0."""
    sizes = [times(c, c) * scale for c, scale in zip(screw.components(), _squares(length), strict=True)]
    limit = ROUNDING * total(sizes)
    return [where(weight < INFINITE, 0.0, where(size > limit, 1.0, 0.0)) for size in sizes]


def _squares(length: Scalar) -> list[Scalar]:
    return [1.0] * 3 + [length * length] * 3
