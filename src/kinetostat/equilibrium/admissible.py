"""Admissible motions: small motions of platform and coordinates that keep all legs closed, and statics over them.

Rigid parts of several legs often hold the same motion, so that closing conditions repeat each other. Geometry alone
decides here which ones do: in equations with stiffnesses, soft springs could not be distinguished from round-off.

Source: theory (38) and (39). Units, axes and origin are those of `mechanism`; arrays have the poses first.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.equilibrium.balance import Balance
from kinetostat.frozen import dataclass
from kinetostat.tolerances import CLOSING_ROUND_OFF, DEPENDENT, OPEN_BY_STEP, UNRESISTED


def starts_of(equations: Balance) -> Integers:
    """Place of each leg's first coordinate among twist and coordinates, without wrenches, and the number of all."""
    sizes = [leg.size for leg in equations.mechanism.legs]
    return equations.mechanism.ways.shape[1] + np.cumsum([0, *sizes])


def tangent_matrices(equations: Balance) -> tuple[Array, Array, Array]:
    """The matrices of springs, of loads and wrenches that turn, and of closing conditions, for small motions.

    All are over the twist of the platform and all coordinates, N numbers: the first two are [n x N x N], and the third
    [n x conditions x N], whose product with a small motion is zero if the legs stay closed.
    """
    mechanism, ways, starts = equations.mechanism, equations.mechanism.ways, starts_of(equations)
    count, size, end = len(equations.left), ways.shape[1], int(starts[-1])
    elastic, geometric = np.zeros((2, count, end, end))
    conditions = np.zeros((count, size * len(mechanism.legs), end))
    geometric[:, :size, :size] = -ways.T @ equations.load_change @ ways
    for k, (leg, terms) in enumerate(zip(mechanism.legs, equations.legs, strict=True)):
        moving, rows = slice(starts[k], starts[k + 1]), slice(size * k, size * (k + 1))
        springs = terms.carrying[:, :, None] * np.eye(leg.size)
        elastic[:, moving, moving] = springs + leg.idle @ np.swapaxes(leg.idle, 1, 2)
        geometric[:, moving, moving] = terms.geometric
        conditions[:, rows, moving] = ways.T @ terms.rates
        conditions[:, rows, :size] = -np.eye(size)
    return elastic, geometric, conditions


def gaps_of(equations: Balance) -> Array:
    """The largest gap of each leg's closing equations, rad or in units of the length [n]."""
    ways = equations.mechanism.ways.shape[1]
    ends = [equations.left[:, end - ways : end] for end in equations.mechanism.starts[1:]]
    return np.asarray(np.abs(np.concatenate(ends, axis=1)).max(axis=1, initial=0.0))


@dataclass(frozen=True)
class Admissible:
    """The admissible motions at poses at which the same number of closing conditions A x = 0 are independent.

    Attributes:
        rows: numbers of the poses [k].
        motions: a basis of the admissible motions, as columns [k x coordinates x m].
        inverse: A+, the inverse of the independent conditions [k x coordinates x conditions]: A A+ b = b for all gaps b
            that can be closed.
    """

    rows: Integers
    motions: Array
    inverse: Array


def admissible(equations: Balance, conditions: Array, rows: Integers | None = None) -> Iterator[Admissible]:
    """Find the admissible motions, in groups of poses with the same number of independent conditions.

    If the coordinates of each leg follow from its end, the motions of the platform are a basis, which takes a hundredth
    of the time. Elsewhere A = U diag(s) V^T gives an orthonormal basis.

    Args:
        equations: the equations at the states.
        conditions: their closing conditions A [n x conditions x coordinates].
        rows: numbers of the poses; those at which the conditions are finite if None.
    """
    rows = np.flatnonzero(np.isfinite(conditions).all(axis=(1, 2))) if rows is None else rows
    by_platform = _motions_of_platform(equations, conditions[rows], rows)
    if by_platform is not None:
        yield by_platform
        rows = np.setdiff1d(rows, by_platform.rows)
    if not len(rows):
        return
    left, values, right = np.linalg.svd(conditions[rows])
    least = np.maximum(CLOSING_ROUND_OFF, OPEN_BY_STEP * gaps_of(equations)[rows])
    ranks = (values > least[:, None] * values[:, :1]).sum(axis=1)
    for rank in np.unique(ranks):
        of_rank = ranks == rank
        shrink = 1.0 / values[of_rank, None, :rank]
        inverse = np.swapaxes(right[of_rank, :rank], 1, 2) * shrink @ np.swapaxes(left[of_rank, :, :rank], 1, 2)
        yield Admissible(rows[of_rank], np.swapaxes(right[of_rank, rank:], 1, 2), inverse)


def _motions_of_platform(equations: Balance, conditions: Array, rows: Integers) -> Admissible | None:
    """The motions of the platform with those of the legs that follow; only poses at which legs surely follow it."""
    size, starts = equations.mechanism.ways.shape[1], starts_of(equations)
    if any(leg.size != size for leg in equations.mechanism.legs):
        return None
    inverse = np.zeros((len(rows), int(starts[-1]), conditions.shape[1]))
    for number, (first, last) in enumerate(pairwise(starts)):
        row = slice(size * number, size * (number + 1))
        try:
            inverse[:, first:last, row] = np.linalg.inv(conditions[:, row, first:last])
        except np.linalg.LinAlgError:
            return None
    motions = -inverse @ conditions[:, :, :size]
    motions[:, :size] = np.eye(size)
    sure = np.abs(inverse).max(axis=(1, 2), initial=0.0) * DEPENDENT < 1.0
    return Admissible(rows[sure], motions[sure], inverse[sure])


def within(matrix: Array, allowed: Array) -> Array:
    """The symmetric part of Z^T M Z, which is the matrix M over the motions in the columns of Z [n x k x k]."""
    return np.asarray(0.5 * np.swapaxes(allowed, 1, 2) @ (matrix + np.swapaxes(matrix, 1, 2)) @ allowed)


def solve_over_admissible(equations: Balance, right: Array, loaded: bool) -> Array:
    """Solve the linear equations at a state over the admissible motions, for right sides [n x unknowns x k].

    Twist and coordinates are x = A+ b + Z y, where Z^T H Z y balances the remaining forces. Springs enter by the
    triangular factor of diag(sqrt k) Z, the stiffest first, and not by Z^T H Z, so that contrasts of stiffness cost
    half as many digits. If wrenches of legs are not determined, those of least norm are taken. The result is NaN where
    the equations are not finite.

    Args:
        equations: the equations at the state.
        right: right sides, in the order of the unknowns.
        loaded: whether loads and wrenches that turn count.
    """
    elastic, geometric, conditions = tangent_matrices(equations)
    geometric = geometric if loaded else np.zeros_like(geometric)
    moving, carried = places_of(equations)
    force, gap = right[:, moving], right[:, carried]
    sound = [np.isfinite(part).all(axis=(1, 2)) for part in (elastic, geometric, conditions, right)]
    result = np.full_like(right, np.nan)
    for part in admissible(equations, conditions, np.flatnonzero(np.all(sound, axis=0))):
        tangent = elastic[part.rows] + geometric[part.rows]
        motion = part.inverse @ gap[part.rows]
        transposed = np.swapaxes(part.motions, 1, 2)
        if part.motions.shape[2]:
            remaining = transposed @ (force[part.rows] - tangent @ motion)
            turning = transposed @ geometric[part.rows] @ part.motions
            motion = motion + part.motions @ _balanced_motion(spring_factor(equations, part), turning, remaining)
        wrenches = np.swapaxes(part.inverse, 1, 2) @ (tangent @ motion - force[part.rows])
        result[part.rows[:, None], moving], result[part.rows[:, None], carried] = motion, wrenches
    return result


def places_of(equations: Balance) -> tuple[Integers, Integers]:
    """The places of the twist and all coordinates among the unknowns, and those of the wrenches of the legs."""
    ways, starts = equations.mechanism.ways.shape[1], equations.mechanism.starts
    places = np.arange(starts[-1])
    carried = np.concatenate([places[end - ways : end] for end in starts[1:]])
    return np.setdiff1d(places, carried), carried


def spring_factor(equations: Balance, part: Admissible) -> Array:
    """Upper triangular R, for which R^T R is the stiffness of the springs over the admissible motions [k x m x m]."""
    size = equations.mechanism.ways.shape[1]
    stiff = [terms.carrying[part.rows] for terms in equations.legs]
    roots = np.sqrt(np.concatenate(stiff, axis=1)) if stiff else np.zeros((len(part.rows), 0))
    stretched = roots[:, :, None] * part.motions[:, size:]
    # Householder's reflections keep the digits of small rows below large ones, and lose them above.
    order = np.argsort(-roots, axis=1, kind="stable")
    rows = [np.take_along_axis(stretched, order[:, :, None], axis=1)]
    for leg, (first, last) in zip(equations.mechanism.legs, pairwise(starts_of(equations)), strict=True):
        rows.append(np.swapaxes(leg.idle[part.rows], 1, 2) @ part.motions[:, first:last])
    missing = part.motions.shape[2] - sum(row.shape[1] for row in rows)
    rows.append(np.zeros((len(part.rows), max(missing, 0), part.motions.shape[2])))
    return np.asarray(np.linalg.qr(np.concatenate(rows, axis=1), mode="r"))


def holds_all(springs: Array) -> Mask:
    """Whether springs, given by their triangular factor R [k x m x m], hold every admissible motion [k]."""
    sizes = np.abs(np.diagonal(springs, axis1=1, axis2=2))
    return np.asarray(sizes.min(axis=1) > UNRESISTED * sizes.max(axis=1))


def _balanced_motion(springs: Array, turning: Array, force: Array) -> Array:
    """The motions y with (R^T R + G) y = f: by R if springs hold every motion, else by the sum as one matrix."""
    holds = holds_all(springs)
    result = np.zeros_like(force)
    if holds.any():
        inverse = np.linalg.inv(springs[holds])
        transposed = np.swapaxes(inverse, 1, 2)
        scaled = np.eye(springs.shape[1]) + transposed @ turning[holds] @ inverse
        result[holds] = inverse @ finite_solution(scaled, transposed @ force[holds])
    if not holds.all():
        tangent = np.swapaxes(springs[~holds], 1, 2) @ springs[~holds] + turning[~holds]
        result[~holds] = finite_solution(tangent, force[~holds])
    return result


def finite_solution(rates: Array, right: Array) -> Array:
    """Solutions of linear equations; NaN where these are not finite, as at poses at which legs cannot be placed."""
    sound = np.isfinite(rates).all(axis=(1, 2)) & np.isfinite(right).all(axis=(1, 2))
    result = np.full((*rates.shape[:2], right.shape[2]), np.nan)
    try:
        result[sound] = np.linalg.solve(rates[sound], right[sound])
    except np.linalg.LinAlgError:
        for row in np.flatnonzero(sound):
            result[row] = np.linalg.lstsq(rates[row], right[row], rcond=None)[0]
    return result
