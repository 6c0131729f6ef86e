"""Assemble K and C of the platform, and the contribution of each spring, from the legs (theory section 2).

One form serves rigid and flexible machines: springs enter by their compliance, and a rigid or free one is exact. How a
leg deflects is in `leg`.

Source: theory (4)-(6) and (8)-(11). All screws, K and C are at one reference point, in the axes of the legs' screws.
"""

from collections.abc import Sequence
from itertools import islice
from typing import NamedTuple

from kinetostat.algebra.scalar import Scalar, is_infinite, larger, reciprocal, total, where
from kinetostat.algebra.screw import NO_MOTION, Screw, Twist, Wrench
from kinetostat.algebra.solve import dual_basis, least_energy, right_inverse
from kinetostat.algebra.symmetric import POSITIONS, SIZE, Symmetric6
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.leg import (
    INFINITE,
    Action,
    Modes,
    combine,
    free_springs_as_joints,
    leg_modes,
    leg_resistance,
    modes_of,
)
from kinetostat.machine.leg_screws import LegScrews
from kinetostat.tolerances import ROUND_OFF_OF_COMPLIANCE, UNFELT, UNREACHED_COMPONENT

Motion = tuple[Twist, Scalar]
"""A twist xi (per unit of a load) and a compliance s (of that load): the share s xi xi^T of C."""


@dataclass(frozen=True)
class Statics:
    """The statics of a machine: shares of its springs in any load, and in the resistance to any motion.

    Attributes:
        wrenches: for each leg, a basis of what it carries.
        sharing: for each leg, a twist for each wrench of its basis: its work with a platform wrench is the amount that
            the leg carries of this basis wrench.
        flexibility: for each spring, the load in it per unit platform wrench (xi_e); in a machine without redundancy
            also the platform twist per unit deformation of it alone.
        compliance: for each spring, s_e.
        resistance: for each spring, a platform wrench (b_e or c_e).
        stiffness: for each spring, its weight in K (k_e or s_e).
        motions: the fewest shares that add up to C: one per spring, or per wrench of a leg that has more springs.
        actions: the fewest shares that add up to K; infinite against what is rigid.
        length: characteristic length, m; rotations and translations compare through it where rounding is judged.
        singularity_margin: 0 where the wrenches do not span all six dimensions: the platform is free with
            locked actuators.
        doubt: 1 where redundant legs are so nearly rigid against each other that nobody can say whether they are, and C
            depends on it; else 0.
        round_off: the largest diagonal entry of C for rotations that round-off can make, rad/(N·m); for translations it
            is that times the square of the length, m/N.
    """

    wrenches: tuple[tuple[Wrench, ...], ...]
    sharing: tuple[tuple[Twist, ...], ...]
    flexibility: tuple[Twist, ...]
    compliance: tuple[Scalar, ...]
    resistance: tuple[Wrench, ...]
    stiffness: tuple[Scalar, ...]
    motions: tuple[Motion, ...]
    actions: tuple[Action, ...]
    length: Scalar
    singularity_margin: Scalar
    doubt: Scalar = 0.0
    round_off: Scalar = 0.0


def solve_statics(legs: Sequence[LegScrews], length: Scalar, guide: Sequence[Wrench] = ()) -> Statics:
    """Solve the statics of the whole machine, redundant or not, rigid or flexible.

    Args:
        legs: screws of the legs at the reference point, base axes; together they carry six wrenches or more.
        length: characteristic length, m; scales rows, the result does not depend on it.
        guide: wrenches of a planar machine against twists that do not exist there.

    Source: theory (4), (8) and (9), eqs. 21 and 32.
    """
    shared = _sharing(legs, length, guide)
    resistances = [leg_resistance(leg) for leg in legs]
    shares_of_k = [share for resistance in resistances for share in resistance.shares]
    return Statics(
        wrenches=tuple(mode.wrenches for mode in shared.modes),
        sharing=tuple(shared.sharing),
        flexibility=tuple(shared.flexibility),
        compliance=tuple(s for leg in legs for s in leg.compliance),
        resistance=tuple(b for b, _ in shares_of_k),
        stiffness=tuple(k for _, k in shares_of_k),
        motions=tuple(shared.motions),
        actions=tuple(mode for resistance in resistances for mode in resistance.modes),
        length=length,
        singularity_margin=shared.singularity_margin,
        doubt=shared.doubt,
        round_off=shared.round_off,
    )


def compliance_of(legs: Sequence[LegScrews], length: Scalar, guide: Sequence[Wrench] = ()) -> Symmetric6:
    """C alone (rad, m per N·m, N), as `compliance_matrix(solve_statics(...))` has it, without what only K needs.

    Args:
        legs, guide: as for `solve_statics`.
        length: characteristic length, m.
    """
    shared = _sharing(legs, length, guide)
    return without_round_off(weighted_sum(shared.motions, reciprocal(length)), length, shared.round_off)


@dataclass(frozen=True)
class _Sharing:
    """The part of `Statics` that C needs, under the same names, and the modes of the legs."""

    modes: Sequence[Modes]
    sharing: Sequence[tuple[Twist, ...]]
    flexibility: Sequence[Twist]
    motions: Sequence[Motion]
    singularity_margin: Scalar
    doubt: Scalar
    round_off: Scalar


def _sharing(legs: Sequence[LegScrews], length: Scalar, guide: Sequence[Wrench]) -> _Sharing:
    """The shares of the legs in any load: by statics alone for six wrenches, by least energy for more."""
    redundant = sum(len(leg.wrenches) for leg in legs) + len(guide) > SIZE
    balanced = [free_springs_as_joints(leg.with_unit_wrenches) for leg in legs] if redundant else legs
    modes = [modes_of(leg) if redundant or _in_series(leg) else _wrenches_as_modes(leg) for leg in balanced]
    amounts = _amounts_of_modes(balanced, modes, length, guide)
    sharing: list[tuple[Twist, ...]] = []
    flexibility: list[Twist] = []
    motions: list[Motion] = []
    load_squares: list[Scalar] = []
    remaining_rows = iter(amounts.rows)
    for leg, mode in zip(balanced, modes, strict=True):
        shares = tuple(map(Twist.of, islice(remaining_rows, len(mode.wrenches))))
        spring_twists = [combine(shares, row) if row else NO_MOTION for row in mode.loads]
        sharing.append(shares)
        flexibility += spring_twists
        # Springs in series: the fewest shares of C are those of the leg's modes; otherwise one per spring.
        if _in_series(leg):
            motions += zip(shares, mode.compliance, strict=True)
            load_squares += mode.amount_squares()
        else:
            motions += zip(spring_twists, leg.compliance, strict=True)
            load_squares += leg.load_squares
    loads = [(s, square) for (_, s), square in zip(motions, load_squares, strict=True)]
    margin = amounts.singularity_margin
    return _Sharing(
        modes=modes,
        sharing=sharing,
        flexibility=flexibility,
        motions=motions,
        singularity_margin=margin,
        doubt=amounts.doubt,
        round_off=_round_off(loads, len(amounts.rows), margin, length) if redundant else 0.0,
    )


class ModeAmounts(NamedTuple):
    """Amounts of the modes of all legs, and then of the wrenches of a guide, that balance a load on the platform.

    Attributes:
        rows: amounts per unit platform wrench [wrenches x 6].
        doubt: as in `Statics`.
        singularity_margin: that of W.
    """

    rows: Sequence[tuple[Scalar, ...]]
    doubt: Scalar
    singularity_margin: Scalar


def _amounts_of_modes(
    legs: Sequence[LegScrews], modes: Sequence[Modes], length: Scalar, guide: Sequence[Wrench]
) -> ModeAmounts:
    """Balance a load by statics alone if all legs carry six wrenches, else by least energy."""
    wrenches = [wrench for leg in legs for wrench in leg.wrenches] + list(guide)
    if len(wrenches) != SIZE:
        return least_energy_amounts(modes, wrenches, length)
    squares = [square for leg in legs for square in leg.wrench_squares or [None] * len(leg.wrenches)]
    twists, singularity_margin = dual_twists(wrenches, length, [*squares, *[None] * len(guide)])
    return ModeAmounts(in_modes(modes, [twist.components() for twist in twists]), 0.0, singularity_margin)


def _round_off(
    loads: Sequence[tuple[Scalar, Scalar]], wrenches: int, singularity_margin: Scalar, length: Scalar
) -> Scalar:
    """The largest diagonal entry of C for rotations that round-off in the loads of springs can make, rad/(N·m).

    Where rigid parts take a load, what is left of it in a soft spring beside them is round-off, and C must be 0. What a
    spring adds to C is its compliance times the square of its load, and a share `UNFELT` of what the wrenches of the
    legs could load it by is round-off, in the amounts that a unit moment needs. The squares of these amounts add
    up to |W+|^2, which follows from the margin m = 6 / (|W| |W+|): of n unit wrenches, |W|^2 is n, so that |W+|^2 is
    36 / (n m^2), divided by the square of the length for a moment.

    Args:
        loads: compliance of each spring or mode, and the square of its load by a unit of a leg's wrenches.
        wrenches: number of wrenches that the legs carry.
        singularity_margin: their singularity margin, which tells how much of each a unit load may need.
        length: characteristic length, m.
    """
    scaled_margin = singularity_margin * length
    squared_amounts = float(SIZE * SIZE) / float(max(wrenches, 1)) * reciprocal(scaled_margin * scaled_margin)
    return UNFELT * UNFELT * squared_amounts * total([where(s < INFINITE, s, 0.0) * square for s, square in loads])


def _in_series(leg: LegScrews) -> bool:
    """Whether the leg has more springs than wrenches, none of them free by form."""
    return len(leg.loads) > len(leg.wrenches) and not any(map(is_infinite, leg.compliance))


def _wrenches_as_modes(leg: LegScrews) -> Modes:
    """The wrenches of a leg as modes without compliances: with six wrenches in all, nothing else is needed."""
    return Modes(leg.wrenches, leg.loads, (), ())


def in_modes(modes: Sequence[Modes], rows: Sequence[Sequence[Scalar]]) -> list[tuple[Scalar, ...]]:
    """Convert amounts of the legs' wrenches to amounts of their modes, a row each; rows of a guide stay as they are."""
    amounts: list[tuple[Scalar, ...]] = []
    for leg in modes:
        leg_rows = rows[len(amounts) : len(amounts) + len(leg.wrenches)]
        columns = [leg.mode_amounts(column) if leg.mixing else list(column) for column in zip(*leg_rows, strict=True)]
        amounts += zip(*columns, strict=True)
    return amounts + [tuple(row) for row in rows[len(amounts) :]]


def compliance_matrix(statics: Statics) -> Symmetric6:
    """C = sum_e s_e xi_e xi_e^T, t_small = C w (rad, m per N·m, N); infinite where a free spring moves the platform.

    Source: theory (6) and (10), eq. 21 extended to flexible links.
    """
    whole = weighted_sum(statics.motions, reciprocal(statics.length))
    return without_round_off(whole, statics.length, statics.round_off)


def without_round_off(compliance: Symmetric6, length: Scalar, round_off: Scalar) -> Symmetric6:
    """C with exact zeros in the rows and columns of components that rigid parts hold.

    A component that nothing can move comes out as the square of round-off, and no inverse must be taken of that.

    Args:
        compliance: C at any point (rad, m per N·m, N).
        length: characteristic length, m, through which rotations and translations compare.
        round_off: what round-off in the loads of its springs makes, as in `Statics`.
    """
    area = length * length
    rotational, translational = (total([compliance.entry(i, i) for i in rows]) for rows in (range(3), range(3, SIZE)))
    sizes = [rotational + reciprocal(area) * translational, translational + area * rotational]
    limits = [where(size < INFINITE, ROUND_OFF_OF_COMPLIANCE * size, 0.0) for size in sizes]
    limits = [larger(limit, least) for limit, least in zip(limits, (round_off, area * round_off), strict=True)]
    moves = [compliance.entry(i, i) > limits[i // 3] for i in range(SIZE)]
    entries = []
    for entry, (i, j) in zip(compliance.upper, POSITIONS, strict=True):
        entries.append(where(moves[i], where(moves[j], entry, 0.0), 0.0))
    return Symmetric6(tuple(entries))


def stiffness_matrix(statics: Statics) -> Symmetric6:
    """K = sum_e k_e b_e b_e^T, w = K t_small (N·m, N per rad, m); infinite where a rigid spring holds the platform.

    Source: theory (8) and (10), eq. 32.
    """
    return weighted_sum(statics.actions, statics.length)


def flexible_stiffness(legs: Sequence[LegScrews]) -> Symmetric6:
    """K = sum_i W_i G_i^-1 W_i^T for legs that all deflect (G_i > 0), however many; infinite if one does not.

    Source: theory (5), eq. 32. A second route, by which `stiffness_matrix` is checked.
    """
    shares = [Symmetric6.dyad(b, b) * k for leg in legs for b, k in leg_modes(leg)]
    return Symmetric6.sum_of(shares)


def dual_twists(
    wrenches: Sequence[Wrench], length: Scalar, squares: Sequence[Scalar | None] | None = None
) -> tuple[list[Twist], Scalar]:
    """Return six twists, each worked on by only one of six wrenches: the rows of W^-1.

    Args:
        wrenches: columns of W, at P in base axes.
        length: characteristic length, m, through which moments are compared with forces.
        squares: as for `solve.dual_basis`.

    Returns:
        The twists at P in base axes, and the singularity margin as in `solve.dual_basis`.
    """
    shrink = reciprocal(length)
    scaled = [wrench.in_newtons(shrink) for wrench in wrenches]
    rows, singularity_margin = dual_basis(scaled, squares)
    return [Twist(Vector(*row[:3]) * shrink, Vector(*row[3:])) for row in rows], singularity_margin


def least_energy_amounts(modes: Sequence[Modes], wrenches: Sequence[Wrench], length: Scalar) -> ModeAmounts:
    """Share a load among legs that carry more than six wrenches: of all balances, that of least elastic energy.

    lambda = W+ w + N z with W N = 0 and lambda^T G lambda least (force method). Where rigid parts leave z undecided, no
    displacement depends on it: the undecided internal load is left out.

    Args:
        modes: modes of the legs.
        wrenches: wrenches of all legs in order, and of a guide, which does not deflect: columns of W, at P in base
            axes.
        length: characteristic length, m, which scales rows.
    """
    shrink = reciprocal(length)
    columns = [wrench.in_newtons(shrink) for wrench in wrenches]
    if len(wrenches) < SIZE:
        return ModeAmounts([NO_MOTION.components()] * len(wrenches), doubt=0.0, singularity_margin=0.0)
    balances = right_inverse([list(row) for row in zip(*columns, strict=True)])
    compliance = [d for leg in modes for d in leg.compliance]
    balanced, null = (in_modes(modes, rows) for rows in (balances.solution, [*zip(*balances.null, strict=True)]))
    guides = len(wrenches) - len(compliance)
    weights = compliance + [0.0] * guides
    squares = [square for leg in modes for square in leg.amount_squares()] + [1.0] * guides
    shared, doubt = least_energy([*zip(*balanced, strict=True)], [*zip(*null, strict=True)], weights, squares)
    for leg in modes:
        doubt = larger(doubt, leg.doubt)
    rows = [(*(c * shrink for c in row[:3]), *row[3:]) for row in zip(*shared, strict=True)]
    return ModeAmounts(rows, doubt, balances.margin)


def weighted_sum(shares: Sequence[tuple[Screw, Scalar]], length: Scalar) -> Symmetric6:
    """Sum w a a^T; an infinite weight makes infinite only those entries that its screw reaches beyond round-off.

    Args:
        shares: screws a and weights w >= 0, infinity included.
        length: what to multiply translational components by, to compare them with rotational ones, m or 1/m.
    """
    finite_weights = [where(w < INFINITE, w, 0.0) for _, w in shares]
    finite = Symmetric6.sum_of([Symmetric6.dyad(a, a) * w for (a, _), w in zip(shares, finite_weights, strict=True)])
    reached = [_beyond_round_off(screw, length) for screw, _ in shares]
    endless = [
        [where(w < INFINITE, 0.0, where(flag, 1.0, 0.0)) for flag in flags]
        for flags, (_, w) in zip(reached, shares, strict=True)
    ]
    entries = []
    for k, (i, j) in enumerate(POSITIONS):
        if i == j:  # a sum of squares stays infinite by itself, which takes half of the arithmetic
            weights = [
                where(flags[i], w, finite_weight)
                for flags, (_, w), finite_weight in zip(reached, shares, finite_weights, strict=True)
            ]
            squares = [a.components()[i] * a.components()[i] for a, _ in shares]
            entries.append(total([square * w for square, w in zip(squares, weights, strict=True)]))
        else:
            endless_shares = total([flags[i] * flags[j] for flags in endless])  # a whole number over any scalar
            entries.append(where(endless_shares > 0.5, INFINITE, finite.upper[k]))
    return Symmetric6(tuple(entries))


def _beyond_round_off(screw: Screw, length: Scalar) -> list[Scalar]:
    """For each component of the screw, whether it is more than round-off, so that an infinite weight reaches it."""
    units = [1.0] * 3 + [length * length] * 3
    squares = [c * c * unit for c, unit in zip(screw.components(), units, strict=True)]
    limit = UNREACHED_COMPONENT * total(squares)
    return [square > limit for square in squares]


def compliance_shares(statics: Statics) -> list[Symmetric6]:
    """Share of each spring in C, s_e xi_e xi_e^T: what C would lose if this spring became rigid (theory section 2)."""
    pairs = zip(statics.flexibility, statics.compliance, strict=True)
    return [weighted_sum([pair], reciprocal(statics.length)) for pair in pairs]


def stiffness_shares(statics: Statics) -> list[Symmetric6]:
    """Share of each spring in K, k_e b_e b_e^T: its share of the energy of any motion; eqs. 33-38 are its diagonal.

    In a leg with as many springs as wrenches it is also what K would lose if this spring became free. Where something
    is rigid whatever the springs, K is infinite and the shares do not add up to it.
    """
    return [weighted_sum([pair], statics.length) for pair in zip(statics.resistance, statics.stiffness, strict=True)]


def stiffness_coefficients(statics: Statics) -> list[Symmetric6]:
    """Coefficient b_e b_e^T of each spring, K = sum_e k_e b_e b_e^T: the numbers of eqs. 33-38, all entries."""
    return [Symmetric6.dyad(wrench, wrench) for wrench in statics.resistance]
