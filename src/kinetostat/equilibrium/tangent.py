"""Small motions about a state: which keep all legs closed, how further loads move it, and whether it holds.

Rigid parts of several legs often hold the same motion, so that closing conditions repeat each other. Geometry alone
decides here which ones do: in equations with stiffnesses, soft springs could not be distinguished from round-off. The
motions that remain are the *admissible* ones.

At a state of rest the second derivative of the potential depends on no choice of coordinates: it is the tangent
stiffness. Its elastic part is that of the springs at this place; the geometric part is what wrenches and weights do
when their lines of action turn. The moment of the load keeps its axis, which no potential does, and only the symmetric
part of what it adds is taken. No state is found here.

Source: theory (38), (39) and (40). M. Zefran and V. Kumar, "A geometrical approach to the study of the Cartesian
stiffness matrix", J. Mechanical Design 124(1), 2002. Units, axes and origin are those of `mechanism`.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.equilibrium.balance import Balance, balance
from kinetostat.frozen import dataclass
from kinetostat.numerics.motions import skew_of
from kinetostat.tolerances import (
    CLOSING_ROUND_OFF,
    DEPENDENT,
    OPEN_BY_STEP,
    ROUND_OFF_OF_COMPLIANCE,
    STIFFEST_LEG,
    UNRESISTED,
)


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
    count, size, end = len(equations.residual), ways.shape[1], int(starts[-1])
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
    ends = [equations.residual[:, end - ways : end] for end in equations.mechanism.starts[1:]]
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


def over_motions(matrix: Array, allowed: Array) -> Array:
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


def solve(equations: Balance, right: Array, loaded: bool = True) -> Array:
    """Solve the linear equations at a state for right sides [n x unknowns x k].

    Each leg is eliminated by itself, so that it is a stiffness to the platform. A leg made only of rigid parts has
    no finite stiffness: where one has none at any of the poses, all of them are solved over the motions that keep all
    legs closed. A very stiff leg drowns the digits of a soft one; poses with such a leg are solved so one by one.

    Args:
        equations: the equations at the state.
        right: right sides.
        loaded: whether to count what loads and wrenches do by turning.
    """
    size = equations.mechanism.ways.shape[1]
    legs = _eliminated_legs(equations, right, loaded)
    if legs is None:
        return solve_over_admissible(equations, right, loaded)
    platform_stiffness, load = equations.platform_rates(loaded), right[:, :size]
    stiffest = np.zeros(len(right))
    for leg in legs:
        stiffness = leg[:, -size:, -size:]
        stiffest = np.maximum(stiffest, np.abs(stiffness).max(axis=(1, 2)))
        platform_stiffness, load = platform_stiffness + stiffness, load - leg[:, -size:, :-size]
    twist = finite_solution(platform_stiffness, load)
    result = np.concatenate([twist, *(leg[:, :, :-size] + leg[:, :, -size:] @ twist for leg in legs)], axis=1)
    sound = np.flatnonzero(np.isfinite(platform_stiffness).all(axis=(1, 2)))
    softest = np.linalg.svd(platform_stiffness[sound], compute_uv=False)[:, -1]
    rows = sound[stiffest[sound] > STIFFEST_LEG * softest]
    if len(rows):
        equations_of_rows = balance(equations.mechanism.at(rows), equations.state.at(rows))
        result[rows] = solve_over_admissible(equations_of_rows, right[rows], loaded)
    return result


def _eliminated_legs(equations: Balance, right: Array, loaded: bool) -> list[Array] | None:
    """The unknowns of each leg by the right sides and by the platform's twist; None if a leg is rigid, or nearly so.

    Returns:
        For each leg, a column for each right side and then one for each way of the platform [n x unknowns of the leg x
        (k + ways)]. The last rows are the wrench of the leg, so that the last block is its stiffness to the platform.
    """
    size, legs = equations.mechanism.ways.shape[1], []
    for number, (start, end) in enumerate(pairwise(equations.mechanism.starts)):
        by_platform = np.zeros((len(right), end - start, size))
        by_platform[:, -size:] = np.eye(size)
        try:
            leg = np.linalg.solve(
                equations.leg_rates(number, loaded), np.concatenate([right[:, start:end], by_platform], axis=2)
            )
        except np.linalg.LinAlgError:
            return None
        if not (np.abs(leg[:, -size:, -size:]) < STIFFEST_LEG).all():
            return None
        legs.append(leg)
    return legs


def compliance(equations: Balance) -> Array:
    """The twist of the platform per unit of a further wrench, at the loaded tool point [n x 6 x 6].

    Rows and columns of components that rigid parts hold are exactly 0, as in `assembly.without_round_off`.
    """
    ways = equations.mechanism.ways
    size = ways.shape[1]
    right = np.zeros((len(equations.residual), equations.residual.shape[1], size))
    right[:, :size] = np.eye(size)
    twists = ways @ solve(equations, right)[:, :size] @ ways.T
    shift = _shift(-skew_of(equations.state.platform.translation))
    twists = shift @ twists @ np.swapaxes(shift, 1, 2)
    twists = 0.5 * (twists + np.swapaxes(twists, 1, 2))
    sizes = np.abs(np.diagonal(twists, axis1=1, axis2=2))
    # In these units a typical spring has the compliance 1.
    moves = sizes > ROUND_OFF_OF_COMPLIANCE * np.maximum(sizes.sum(axis=1, keepdims=True), 1.0)
    return np.where(moves[:, :, None] & moves[:, None] | np.isnan(twists), twists, 0.0)


def _shift(lever: Array) -> Array:
    """The matrices [n x 6 x 6] that take twists to another reference point: `lever` times the rotation is added."""
    result = np.broadcast_to(np.eye(6), (len(lever), 6, 6)).copy()
    result[:, 3:, :3] = lever
    return result


def inverse(compliances: Array) -> Array:
    """The stiffness of each compliance [n x m x m].

    Rigid parts that hold single components leave the others a stiffness of their own: the diagonal entry of a fixed
    component is infinite, its coupling entries are 0. All of it is infinite where other directions are rigid.
    """
    sizes = np.sqrt(np.abs(np.diagonal(compliances, axis1=1, axis2=2)))
    fixed = sizes == 0.0
    products = sizes[:, :, None] * sizes[:, None]
    products = np.where(products > 0.0, products, 1.0)
    scaled = compliances / products + fixed[:, :, None] * np.eye(fixed.shape[1])
    finite = (~fixed.all(axis=1) & (np.linalg.cond(scaled) < 1.0 / UNRESISTED))[:, None, None]
    usable = np.where(finite, scaled, np.eye(fixed.shape[1]))
    return _with_fixed_components(np.where(finite, np.linalg.inv(usable) / products, np.inf), fixed)


def _with_fixed_components(stiffness: Array, fixed: Mask) -> Array:
    """A stiffness with infinite entries between components that are fixed, and 0 between these and the others."""
    either, both = fixed[:, :, None] | fixed[:, None], fixed[:, :, None] & fixed[:, None]
    return np.where(both, np.inf, np.where(either & np.isfinite(stiffness), 0.0, stiffness))


def elastic_stiffness(equations: Balance, compliances: Array) -> Array:
    """The stiffness of the springs where they are, leg by leg, at the loaded tool point [n x 6 x 6].

    A leg with rigid parts only lets the platform move in some ways and takes no part in them. Where these are single
    components, the entries of the others are infinite; else all of them are.

    Args:
        equations: the equations at a state of rest.
        compliances: the compliances of the platform there, to tell what is fixed [n x 6 x 6].
    """
    ways = equations.mechanism.ways
    size = ways.shape[1]
    total = np.zeros((len(equations.residual), size, size))
    rigid = np.zeros(len(total), dtype=bool)
    for number, leg in enumerate(equations.mechanism.legs):
        leg_equations = equations.leg_rates(number, loaded=False)
        rigid |= np.linalg.cond(leg_equations) >= 1.0 / UNRESISTED
        # Wrenches that no joint feels make these singular: the pseudo-inverse leaves out what rigid parts hold.
        total += np.linalg.pinv(leg_equations)[:, leg.size :, leg.size :]
    from_tool = _shift(skew_of(equations.state.platform.translation))
    stiffness = np.swapaxes(from_tool, 1, 2) @ ways @ total @ ways.T @ from_tool
    stiffness = 0.5 * (stiffness + np.swapaxes(stiffness, 1, 2))
    exists = np.abs(ways).max(axis=1) > 0.0
    fixed = (np.diagonal(compliances, axis1=1, axis2=2) == 0.0) & exists
    separable = np.isfinite(inverse(compliances[:, exists][:, :, exists])).any(axis=(1, 2))
    result = np.where((rigid & ~separable)[:, None, None], np.inf, stiffness)
    return _with_fixed_components(result, fixed & rigid[:, None])


@dataclass(frozen=True)
class Stability:
    """Whether a state of rest holds, and how much more of its load it could hold.

    Attributes:
        stable: whether every small disturbance comes back.
        factor: the factor by which the load may grow until one does not, if wrenches grow in proportion; infinite if
            none does, NaN where springs alone hold nothing.
        mode: twist of the platform in that disturbance, at the origin; its largest component is 1 [6].
        legs: the largest motion of each leg's coordinates in it, of the same scale.
    """

    stable: bool
    factor: float
    mode: Array
    legs: Array


@dataclass(frozen=True)
class Stabilities:
    """Stability of n states of rest: the fields of `Stability` as arrays with the poses first."""

    stable: Mask
    factor: Array
    mode: Array
    legs: Array


def stability(equations: Balance) -> Stability:
    """Judge the state of rest at a single pose."""
    judged = stabilities(equations)
    return Stability(bool(judged.stable[0]), float(judged.factor[0]), judged.mode[0], judged.legs[0])


def stabilities(equations: Balance) -> Stabilities:
    """Judge n states of rest; what is not finite is not stable."""
    ways, starts = equations.mechanism.ways, starts_of(equations)
    elastic, geometric, conditions = tangent_matrices(equations)
    count, size = len(elastic), ways.shape[1]
    sound = np.isfinite(elastic + geometric).all(axis=(1, 2)) & np.isfinite(conditions).all(axis=(1, 2))
    stable: Mask = np.array(sound)
    factors, modes = np.where(sound, np.inf, np.nan), np.zeros((count, starts[-1]))
    for part in admissible(equations, conditions, np.flatnonzero(sound)):
        rows, allowed = part.rows, part.motions
        if not allowed.size:  # nothing can move at all
            continue
        stiff, turning = (over_motions(matrix[rows], allowed) for matrix in (elastic, geometric))
        springs = spring_factor(equations, part)
        holds = holds_all(springs)
        whitening = np.linalg.inv(np.where(holds[:, None, None], springs, np.eye(springs.shape[1])))
        # K_e + factor K_g is singular at factor = 1/share, so that the largest share decides.
        shares, vectors = np.linalg.eigh(-np.swapaxes(whitening, 1, 2) @ turning @ whitening)
        # Where springs hold every motion, those much softer than others would be lost in the sum of both matrices.
        stable[rows] = np.where(holds, shares[:, -1] < 1.0, np.linalg.eigvalsh(stiff + turning)[:, 0] > 0.0)
        grows = holds & (shares[:, -1] > UNRESISTED)
        factors[rows] = np.where(grows, 1.0 / np.where(grows, shares[:, -1], 1.0), np.where(holds, np.inf, np.nan))
        motions = (allowed @ whitening @ vectors[:, :, -1:])[:, :, 0]
        modes[rows] = np.where(grows[:, None], motions / np.abs(motions).max(axis=1, keepdims=True), 0.0)
    legs = [np.abs(modes[:, a:b]).max(axis=1, initial=0.0) for a, b in pairwise(starts)]
    return Stabilities(
        stable=stable,
        factor=factors,
        mode=modes[:, :size] @ ways.T,
        legs=np.stack(legs, axis=1) if legs else np.zeros((count, 0)),
    )
