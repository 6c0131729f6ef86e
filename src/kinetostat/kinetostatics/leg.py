"""A leg as (W, G): how it deflects when it carries a wrench. One leg at a time; the platform is in `assembly`.

Source: theory (3), (7), (8) and (11). Screws are at one reference point, in base axes.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from kinetostat.algebra.scalar import (
    Scalar,
    finite,
    is_bounded,
    is_infinite,
    is_one,
    reciprocal,
    smaller,
    sqrt,
    total,
    weighted,
    where,
)
from kinetostat.algebra.screw import NO_WRENCH, Screw, Wrench
from kinetostat.algebra.solve import complement, conjugate, dual_basis
from kinetostat.frozen import dataclass
from kinetostat.machine.leg_screws import LegScrews
from kinetostat.tolerances import CLOSING_ROUND_OFF, DEPENDENT_LOADS

AnyScrew = TypeVar("AnyScrew", bound=Screw)

INFINITE = float("inf")
"""Compliance of what is free, and stiffness of what is rigid."""

Action = tuple[Wrench, Scalar]
"""A wrench b (N·m, N per N or N·m of load) and a stiffness k (N/m or N·m/rad): the share k b b^T of a leg in K."""


def free_springs_as_joints(leg: LegScrews) -> LegScrews:
    """Turn the free springs of a leg into passive joints: it then carries only wrenches that load none of them.

    Only springs that are free by form, of stiffness 0.0 itself, are meant; the others are kept.
    """
    free = [row for s, row in zip(leg.compliance, leg.loads, strict=True) if is_infinite(s)]
    if not free:
        return leg
    basis, margin = _mixes_without_load(_independent_rows(free), len(leg.wrenches))
    compliance = [0.0 if is_infinite(s) else s for s in leg.compliance]
    rows = [
        tuple(
            0.0 if _repeats(row, free) else total([c * b for c, b in zip(row, column, strict=True)]) for column in basis
        )
        for row in leg.loads
    ]
    wrenches = tuple(combine(leg.wrenches, column) for column in basis)
    return replace(
        leg,
        compliance=tuple(compliance),
        wrenches=wrenches,
        loads=tuple(rows),
        singularity_margin=smaller(leg.singularity_margin, margin) if basis else leg.singularity_margin,
    )


def _mixes_without_load(rows: Sequence[Sequence[Scalar]], size: int) -> tuple[list[list[Scalar]], Scalar]:
    """Return mixes of the wrenches of a leg that load none of some springs, and how surely these loads are independent.

    Args:
        rows: loads of the springs per unit of each wrench, as independent rows.
        size: number of the wrenches. As many rows leave no mix, and no row leaves every wrench as it is.
    """
    if len(rows) >= size:
        return [], 1.0
    if not rows:
        return [[1.0 if i == j else 0.0 for j in range(size)] for i in range(size)], 1.0
    return complement([_unit(row) for row in rows])


def _independent_rows(rows: Sequence[Sequence[Scalar]]) -> list[Sequence[Scalar]]:
    """Leave out rows that depend on those before them.

    Only plain numbers can be judged. Traced rows are all kept: if they are dependent, their complement has no margin.
    """
    kept: list[Sequence[Scalar]] = []
    for row in rows:
        numbers = all(isinstance(c, float) for loads in (row, *kept) for c in loads)
        if not numbers or _rank([*kept, row]) > len(kept):
            kept.append(row)
    return kept


def _repeats(row: Sequence[Scalar], others: Sequence[Sequence[Scalar]]) -> bool:
    """Whether a row is one of the others by form: entry by entry the same scalar, or the same float."""
    alike = [
        [c is d or (isinstance(c, float) and isinstance(d, float) and c == d) for c, d in zip(row, other, strict=True)]
        for other in others
    ]
    return any(map(all, alike))


def _rank(rows: Sequence[Sequence[float]]) -> int:
    """The number of independent rows, each scaled to unit size.

    Gram and Schmidt's method with the largest row first; what is left of a row is dependent if it is below
    `DEPENDENT_LOADS`. It counts on lists, because such rows are few and short.
    """
    sizes = [math.hypot(*row) for row in rows]
    rests = [[c / size for c in row] for row, size in zip(rows, sizes, strict=True) if size > 0.0]
    rank = 0
    while rests:
        axis = max(rests, key=lambda row: math.hypot(*row))
        size = math.hypot(*axis)
        if size <= DEPENDENT_LOADS:
            break
        rank += 1
        parts = [sum(c * d for c, d in zip(row, axis, strict=True)) / size**2 for row in rests]
        rests = [[c - part * d for c, d in zip(row, axis, strict=True)] for row, part in zip(rests, parts, strict=True)]
    return rank


def _unit(row: Sequence[Scalar]) -> list[Scalar]:
    size = reciprocal(sqrt(total([c * c for c in row])))
    return [weighted(size, c) for c in row]


@dataclass(frozen=True)
class Modes:
    """The flexibility G of a leg made diagonal: G = L diag(d) L^T.

    Against the wrenches W', with W = W' L^T, the leg is a set of independent springs of compliances d, one for each.

    Attributes:
        wrenches: W'.
        loads: load in each spring of the leg per unit of each of them.
        compliance: d.
        mixing: rows of L, unit lower triangular, below the diagonal.
        inverses: 1/d, and 0 where d is 0.
        doubt: 1 where nobody can say whether the leg deflects under one of them at all, else 0.
    """

    wrenches: tuple[Wrench, ...]
    loads: tuple[tuple[Scalar, ...], ...]
    compliance: tuple[Scalar, ...]
    mixing: tuple[tuple[Scalar, ...], ...]
    inverses: tuple[Scalar, ...] = ()
    doubt: Scalar = 0.0

    @property
    def actions(self) -> list[Action]:
        """Each wrench with the stiffness against it, infinite where the leg does not deflect."""
        stiffness = [
            where(d > 0.0, inverse, INFINITE) for d, inverse in zip(self.compliance, self.inverses, strict=True)
        ]
        return list(zip(self.wrenches, stiffness, strict=True))

    def mode_amounts(self, wrench_amounts: Sequence[Scalar]) -> list[Scalar]:
        """Return the amounts of the modes in a load given by amounts of the leg's wrenches: L^T times these."""
        size = range(len(wrench_amounts))
        return [wrench_amounts[k] + total([self.mixing[j][k] * wrench_amounts[j] for j in size if j > k]) for k in size]

    def amount_squares(self) -> list[Scalar]:
        """For each mode, the square of its greatest amount in any load that is of unit size in the leg's wrenches."""
        size = range(len(self.wrenches))
        return [1.0 + total([self.mixing[j][k] * self.mixing[j][k] for j in size if j > k]) for k in size]


def modes_of(leg: LegScrews) -> Modes:
    """The modes of a leg; each is one of its wrenches less a mix of those before."""
    springs = len(leg.loads)
    # A column for each wrench: its loads in the springs, then its own components, which are carried along.
    columns = [(*(row[k] for row in leg.loads), *wrench.components()) for k, wrench in enumerate(leg.wrenches)]
    modes = conjugate(columns, leg.compliance, leg.load_squares)
    combined, pivots = modes.columns, modes.pivots
    if all(map(is_bounded, leg.compliance)):
        pivots = [finite(pivot) for pivot in pivots]
    return Modes(
        wrenches=tuple(Wrench.of(column[springs:]) for column in combined),
        loads=tuple(tuple(column[e] for column in combined) for e in range(springs)),
        compliance=tuple(pivots),
        mixing=tuple(tuple(row) for row in modes.shares),
        inverses=tuple(modes.inverses),
        doubt=modes.doubt,
    )


def leg_modes(leg: LegScrews) -> list[Action]:
    """Split the leg's stiffness W G^-1 W^T into m shares: wrenches for which G is diagonal, infinite where G vanishes.

    Source: theory (8), eq. 32.
    """
    return modes_of(leg).actions


@dataclass(frozen=True)
class Resistance:
    """The resistance of a leg to motions of the platform.

    Attributes:
        shares: one for each spring: its share in W G^-1 W^T.
        modes: the fewest shares that add up to it, with what is rigid whatever the springs.
    """

    shares: list[Action]
    modes: list[Action]


def leg_resistance(leg: LegScrews) -> Resistance:
    """Split the leg's stiffness spring by spring.

    With as many springs as wrenches, the share of spring e is k_e b_e b_e^T, where b_e loads e alone by one unit: exact
    for any k_e from free to rigid. With more (springs in series) or fewer, and where a load is felt by no spring, it is
    s_e c_e c_e^T, where c_e = W G^-1 W^T J_e is the load in e per unit twist; modes of G that vanish are rigid.

    Source: theory (10) and (11).
    """
    springwise = len(leg.loads) == len(leg.wrenches)
    if not springwise:
        leg = free_springs_as_joints(leg)
    if not leg.wrenches:
        return Resistance([(NO_WRENCH, 0.0)] * len(leg.loads), [])
    if springwise and len(leg.loads) == 1 and is_one(leg.loads[0][0]):
        action = [(leg.wrenches[0], reciprocal(leg.compliance[0]))]
        return Resistance(action, action)
    modes = modes_of(leg)
    return _by_springs(leg, modes) if springwise else Resistance(_shares_by_modes(leg, modes), modes.actions)


def _shares_by_modes(leg: LegScrews, modes: Modes) -> list[Action]:
    """The share s_e c_e c_e^T of each spring of a leg, whatever springs it has."""
    return [
        (combine(modes.wrenches, [load * k for load, k in zip(row, modes.inverses, strict=True)]), compliance)
        for row, compliance in zip(modes.loads, leg.compliance, strict=True)
    ]


def _by_springs(leg: LegScrews, modes: Modes) -> Resistance:
    """The resistance of a leg with as many springs as wrenches: a share k_e b_e b_e^T for each.

    Where the loads of the springs are independent, b_e is exact even for rigid and free springs. A dependent set, or
    one with a load that is round-off, falls back on the modes, pose by pose, by a choice instead of a branch.
    """
    squares = [total([c * c for c in row]) for row in leg.loads]
    sizes = [reciprocal(sqrt(square)) for square in squares]
    unload, sine = dual_basis([_unit(row) for row in leg.loads])
    for square, possible in zip(squares, leg.load_squares, strict=True):
        sine = where(square > CLOSING_ROUND_OFF * CLOSING_ROUND_OFF * possible, sine, 0.0)
    independent = sine > DEPENDENT_LOADS
    alone = [combine(leg.wrenches, row) * size for row, size in zip(unload, sizes, strict=True)]
    shares = [
        (_either(independent, wrench, action[0]), where(independent, reciprocal(compliance), action[1]))
        for wrench, compliance, action in zip(alone, leg.compliance, _shares_by_modes(leg, modes), strict=True)
    ]
    rigid = [
        (_either(independent, NO_WRENCH, wrench), where(independent, 0.0, where(compliance > 0.0, 0.0, INFINITE)))
        for wrench, compliance in zip(modes.wrenches, modes.compliance, strict=True)
    ]
    return Resistance(shares, shares + rigid)


def combine(screws: Sequence[AnyScrew], weights: Sequence[Scalar]) -> AnyScrew:
    """Linear combination of screws of one kind."""
    result = screws[0] * weights[0]
    for screw, weight in zip(screws[1:], weights[1:], strict=True):
        result = result + screw * weight
    return result


def _either(condition: Scalar, a: Wrench, b: Wrench) -> Wrench:
    chosen = [where(condition, p, q) for p, q in zip(a.components(), b.components(), strict=True)]
    return Wrench.of(chosen)
