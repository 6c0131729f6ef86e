"""A leg as (W, G): how it yields when it carries a wrench. One leg at a time; the platform is `assembly`'s."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from kinetostat.algebra.scalar import Scalar, is_one, is_zero, reciprocal, smaller, sqrt, times, total, where
from kinetostat.algebra.screw import Screw, Wrench
from kinetostat.algebra.solve import complement, diagonalise, dual_basis
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.machine.leg import LegScrews

AnyScrew = TypeVar("AnyScrew", bound=Screw)

UNSEEN = 1e-12
"""Sine of the angle between the loads of a leg's springs below which they are dependent, up to rounding."""

INFINITE = float("inf")

NOTHING = Wrench(ZERO, ZERO)

Action = tuple[Wrench, Scalar]
"""A wrench b (N·m, N per N or N·m of load) and a stiffness k (N/m or N·m/rad): the share k b b^T of a leg in K."""


def leg_compliance(leg: LegScrews) -> list[list[Scalar]]:
    """G = W^T J_e S J_e^T W [m x m], symmetric and >= 0: W^T t = G lambda.

    Source: theory section 2. Zero for a rigid leg; infinite where a free spring is loaded.
    """
    size, springs = range(len(leg.wrenches)), list(zip(leg.compliance, leg.loads, strict=True))
    return [[total([times(s, times(row[a], row[b])) for s, row in springs]) for b in size] for a in size]


def relaxed(leg: LegScrews) -> LegScrews:
    """The leg with its free springs turned into passive joints: it carries only what loads none of them.

    Only springs that are free by form, of stiffness 0.0 itself, are meant; the others are kept.
    """
    free = [row for s, row in zip(leg.compliance, leg.loads, strict=True) if type(s) is float and s == INFINITE]
    if not free:
        return leg
    felt = _independent(free)
    basis: list[list[Scalar]] = []
    regularity = leg.regularity
    if len(felt) < len(leg.wrenches):
        basis, apart = complement([_unit(row) for row in felt]) if felt else ([*_identity(len(leg.wrenches))], 1.0)
        regularity = smaller(regularity, apart)
    weights = [0.0 if type(s) is float and s == INFINITE else s for s in leg.compliance]
    rows = [
        tuple(
            0.0 if row in free else total([times(c, b) for c, b in zip(row, column, strict=True)]) for column in basis
        )
        for row in leg.loads
    ]
    wrenches = tuple(combine(leg.wrenches, column) for column in basis)
    return replace(leg, compliance=tuple(weights), wrenches=wrenches, loads=tuple(rows), regularity=regularity)


def _independent(rows: Sequence[Sequence[Scalar]]) -> list[Sequence[Scalar]]:
    """The rows that do not repeat others, where they are numbers; all others."""
    kept: list[Sequence[Scalar]] = []
    for row in rows:
        numbers = all(isinstance(c, float) for one in (row, *kept) for c in one)
        if not numbers or _rank([*kept, row]) > len(kept):
            kept.append(row)
    return kept


def _rank(rows: Sequence[Sequence[float]]) -> int:
    """How many rows of numbers are independent, each taken at unit size."""
    sizes = [math.hypot(*row) for row in rows]
    left = [[c / size for c in row] for row, size in zip(rows, sizes, strict=True) if size > 0.0]
    found = 0
    while left:
        axis = max(left, key=lambda row: math.hypot(*row))
        size = math.hypot(*axis)
        if size <= UNSEEN:
            break
        found += 1
        parts = [sum(c * d for c, d in zip(row, axis, strict=True)) / size**2 for row in left]
        left = [[c - part * d for c, d in zip(row, axis, strict=True)] for row, part in zip(left, parts, strict=True)]
    return found


def _unit(row: Sequence[Scalar]) -> list[Scalar]:
    size = reciprocal(sqrt(total([times(c, c) for c in row])))
    return [times(c, size) for c in row]


def _identity(size: int) -> list[list[Scalar]]:
    return [[1.0 if i == j else 0.0 for j in range(size)] for i in range(size)]


def leg_modes(leg: LegScrews) -> list[Action]:
    """The leg's stiffness W G^-1 W^T as m shares: wrenches for which G is diagonal, infinite where G vanishes.

    Source: theory section 2, eq. 32.
    """
    rows, pivots = diagonalise(leg_compliance(leg))
    return [(combine(leg.wrenches, row), reciprocal(pivot)) for row, pivot in zip(rows, pivots, strict=True)]


def leg_resistance(leg: LegScrews) -> tuple[list[Action], list[Action]]:
    """The leg's stiffness spring by spring: one share for each, and what is rigid whatever the springs.

    With as many springs as wrenches, the share of spring e is k_e b_e b_e^T, where b_e loads e alone by one unit: exact
    for any k_e from free to rigid. With more (springs in series) or fewer, and where a load is felt by no spring, it is
    s_e c_e c_e^T, where c_e = W G^-1 W^T J_e is the load in e per unit twist; modes of G that vanish are rigid.

    Source: theory section 2.
    """
    if len(leg.loads) != len(leg.wrenches):
        leg = relaxed(leg)
    if not leg.wrenches:
        return [(NOTHING, 0.0)] * len(leg.loads), []
    stiffness = [reciprocal(s) for s in leg.compliance]
    if len(leg.loads) == len(leg.wrenches) == 1 and is_one(leg.loads[0][0]):
        return [(leg.wrenches[0], stiffness[0])], []
    load, modes = leg.loads, leg_modes(leg)
    rows, pivots = diagonalise(leg_compliance(leg))
    held = [(wrench, where(pivot > 0.0, 0.0, INFINITE)) for (wrench, _), pivot in zip(modes, pivots, strict=True)]
    yielding = [reciprocal(where(pivot > 0.0, pivot, INFINITE)) for pivot in pivots]
    felt = [[total([times(r, c) for r, c in zip(row, one, strict=True)]) for row in rows] for one in load]
    in_modes = [
        (combine([w for w, _ in modes], [times(f, y) for f, y in zip(feels, yielding, strict=True)]), s)
        for feels, s in zip(felt, leg.compliance, strict=True)
    ]
    if len(load) != len(leg.wrenches):
        return in_modes, _effective(held)
    sizes = [reciprocal(sqrt(total([times(c, c) for c in row]))) for row in load]
    unload, sine = dual_basis([_unit(row) for row in load])
    apart = sine > UNSEEN
    springwise = [combine(leg.wrenches, row) * size for row, size in zip(unload, sizes, strict=True)]
    shares = [
        (_either(apart, b, c), where(apart, k, s)) for b, k, (c, s) in zip(springwise, stiffness, in_modes, strict=True)
    ]
    return shares, _effective([(_either(apart, NOTHING, wrench), where(apart, 0.0, k)) for wrench, k in held])


def _effective(actions: list[Action]) -> list[Action]:
    """The actions without those that are known to do nothing."""
    return [(wrench, k) for wrench, k in actions if not is_zero(k)]


def combine(screws: Sequence[AnyScrew], weights: Sequence[Scalar]) -> AnyScrew:
    """Linear combination of screws of one kind."""
    result = screws[0] * weights[0]
    for screw, weight in zip(screws[1:], weights[1:], strict=True):
        result = result + screw * weight
    return result


def _either(condition: Scalar, a: Wrench, b: Wrench) -> Wrench:
    chosen = [where(condition, p, q) for p, q in zip(a.components(), b.components(), strict=True)]
    return Wrench(Vector(*chosen[:3]), Vector(*chosen[3:]))
