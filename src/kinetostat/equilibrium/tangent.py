"""Small motions about a state: those that keep all legs closed, and those that further loads cause.

Rigid parts of several legs often hold the same motion, so that closing conditions repeat each other. Geometry alone
decides here which ones do: in equations with stiffnesses, soft springs could not be distinguished from round-off. The
motions that remain are the *admissible* ones.

At a state of rest the second derivative of the potential depends on no choice of coordinates: it is the tangent
stiffness. Its elastic part is that of the springs at this place; the geometric part is what wrenches and weights do
when their lines of action turn. The moment of the load keeps its axis, which no potential does, and only the symmetric
part of what it adds is taken. No state is found here.

Source: theory (38) and (39). M. Zefran and V. Kumar, "A geometrical approach to the study of the Cartesian
stiffness matrix", J. Mechanical Design 124(1), 2002. Units, axes and origin are those of `mechanism`.
"""

from collections.abc import Iterator
from typing import NamedTuple

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


class TangentMatrices(NamedTuple):
    """Matrices over small motions: the platform's twist and all coordinates, in `Mechanism.motion_places`, N of them.

    Attributes:
        elastic: stiffness of the springs [n x N x N].
        geometric: stiffness by loads and wrenches that turn [n x N x N].
        closing: A, whose product with a small motion is zero if the legs stay closed [n x conditions x N].
    """

    elastic: Array
    geometric: Array
    closing: Array


def tangent_matrices(equations: Balance) -> TangentMatrices:
    """Return the matrices of springs, of loads and wrenches that turn, and of closing conditions."""
    mechanism, ways, places = equations.mechanism, equations.mechanism.ways, equations.mechanism.motion_places
    poses, size = len(equations.residual), ways.shape[1]
    elastic, geometric = np.zeros((2, poses, places.count, places.count))
    closing = np.zeros((poses, size * len(mechanism.legs), places.count))
    geometric[:, places.platform, places.platform] = -ways.T @ equations.load_change @ ways
    for number, (leg, terms, moving) in enumerate(zip(mechanism.legs, equations.legs, places.coordinates, strict=True)):
        springs = terms.carrying[:, :, None] * np.eye(leg.size)
        elastic[:, moving, moving] = springs + leg.idle @ leg.idle.mT
        geometric[:, moving, moving] = terms.geometric
        conditions = conditions_of_leg(number, size)
        closing[:, conditions, moving] = ways.T @ terms.rates
        closing[:, conditions, places.platform] = -np.eye(size)
    return TangentMatrices(elastic, geometric, closing)


def conditions_of_leg(number: int, ways: int) -> slice:
    """Return the places of a leg's conditions among the closing conditions: one for each way of the platform."""
    return slice(ways * number, ways * (number + 1))


def gaps_of(equations: Balance) -> Array:
    """Return the largest gap of each leg's closing equations, rad or in units of the length [n].

    Residuals have the gap of a leg at the places of its wrench.
    """
    gaps = equations.residual[:, equations.mechanism.unknown_places.all_wrenches]
    return np.asarray(np.abs(gaps).max(axis=1, initial=0.0))


@dataclass(frozen=True)
class Admissible:
    """The admissible motions at poses at which the same number of closing conditions A x = 0 are independent.

    Attributes:
        rows: numbers of the poses [k].
        motions: a basis of the admissible motions, as columns [k x N x m].
        closing_inverse: A+, the inverse of the independent conditions [k x N x conditions]: A A+ b = b for all gaps b
            that can be closed.
    """

    rows: Integers
    motions: Array
    closing_inverse: Array


def admissible(equations: Balance, closing: Array, rows: Integers | None = None) -> Iterator[Admissible]:
    """Find the admissible motions, in groups of poses with the same number of independent conditions.

    If the coordinates of each leg follow from its end, the motions of the platform are a basis, which takes a hundredth
    of the time. Elsewhere A = U diag(s) V^T gives an orthonormal basis.

    Args:
        equations: the equations at the states.
        closing: their closing conditions A [n x conditions x N].
        rows: numbers of the poses; those at which the conditions are finite if None.
    """
    rows = np.flatnonzero(finite_poses(closing)) if rows is None else rows
    by_platform = _motions_of_platform(equations, closing[rows], rows)
    if by_platform is not None:
        yield by_platform
        rows = np.setdiff1d(rows, by_platform.rows)
    if not len(rows):
        return
    left, sizes, right = np.linalg.svd(closing[rows])
    least = np.maximum(CLOSING_ROUND_OFF, OPEN_BY_STEP * gaps_of(equations)[rows])
    ranks = (sizes > least[:, None] * sizes[:, :1]).sum(axis=1)
    for rank in np.unique(ranks):
        of_rank = ranks == rank
        shrink = 1.0 / sizes[of_rank, None, :rank]
        inverse = right[of_rank, :rank].mT * shrink @ left[of_rank, :, :rank].mT
        yield Admissible(rows[of_rank], right[of_rank, rank:].mT, inverse)


def _motions_of_platform(equations: Balance, closing: Array, rows: Integers) -> Admissible | None:
    """Return the motions of the platform with those of the legs that follow, at poses at which legs surely follow it.

    None if a leg has fewer or more coordinates than the platform has ways, or does not follow it at one of the poses:
    all of them are then left to singular values.
    """
    size, places = equations.mechanism.ways.shape[1], equations.mechanism.motion_places
    if any(leg.size != size for leg in equations.mechanism.legs):
        return None
    inverse = np.zeros((len(rows), places.count, closing.shape[1]))
    for number, moving in enumerate(places.coordinates):
        conditions = conditions_of_leg(number, size)
        try:
            inverse[:, moving, conditions] = np.linalg.inv(closing[:, conditions, moving])
        except np.linalg.LinAlgError:
            return None
    motions = -inverse @ closing[:, :, places.platform]
    motions[:, places.platform] = np.eye(size)
    sure = np.abs(inverse).max(axis=(1, 2), initial=0.0) * DEPENDENT < 1.0
    return Admissible(rows[sure], motions[sure], inverse[sure])


def over_motions(matrix: Array, allowed: Array) -> Array:
    """Return the symmetric part of Z^T M Z, the matrix M over the motions in the columns of Z [n x k x k]."""
    return np.asarray(0.5 * allowed.mT @ (matrix + matrix.mT) @ allowed)


def solve_at_rest(equations: Balance, right: Array, loaded: bool = True) -> Array:
    """Solve the linear equations at a state for right sides [n x unknowns x k].

    Each leg is eliminated by itself, so that it is a stiffness to the platform. A leg of rigid parts alone has no
    finite stiffness, and a very stiff one drowns the digits of a soft one. Poses with such a leg, and no others, are
    solved over the motions that keep all legs closed.

    Args:
        equations: the equations at the state.
        right: right sides.
        loaded: whether to count what loads and wrenches do by turning.

    Returns:
        The unknowns [n x unknowns x k]; NaN where the equations are not finite.
    """
    legs, rigid = _eliminated_legs(equations, right, loaded)
    if rigid.all():
        return solve_over_admissible(equations, right, loaded)
    platform_stiffness, load = equations.platform_rates(loaded), right[:, equations.mechanism.unknown_places.platform]
    stiffest = np.zeros(len(right))
    for leg in legs:
        stiffest = np.maximum(stiffest, np.abs(leg.stiffness).max(axis=(1, 2)))
        platform_stiffness, load = platform_stiffness + leg.stiffness, load - leg.wrench
    twist = finite_solution(platform_stiffness, load)
    result = np.concatenate([twist, *(leg.by_right + leg.by_twist @ twist for leg in legs)], axis=1)
    sound = np.flatnonzero(finite_poses(platform_stiffness))
    softest = np.linalg.svd(platform_stiffness[sound], compute_uv=False)[:, -1]
    rigid[sound] |= stiffest[sound] > STIFFEST_LEG * softest
    rows = np.flatnonzero(rigid)
    if len(rows):
        equations_of_rows = balance(equations.mechanism.at(rows), equations.state.at(rows))
        result[rows] = solve_over_admissible(equations_of_rows, right[rows], loaded)
    return result


class EliminatedLeg(NamedTuple):
    """The unknowns of a leg, its coordinates and then its wrench, by the right sides and by the platform's twist.

    Attributes:
        by_right: the unknowns that the right sides cause while the platform stands still [n x unknowns x k].
        by_twist: the unknowns per unit of the platform's twist [n x unknowns x ways].
    """

    by_right: Array
    by_twist: Array

    @property
    def wrench(self) -> Array:
        """The wrench that the right sides cause while the platform stands still [n x ways x k]."""
        return self.by_right[:, -self.by_twist.shape[2] :]

    @property
    def stiffness(self) -> Array:
        """Its stiffness to the platform, the wrench per unit of the twist [n x ways x ways]."""
        return self.by_twist[:, -self.by_twist.shape[2] :]


def _eliminated_legs(equations: Balance, right: Array, loaded: bool) -> tuple[list[EliminatedLeg], Mask]:
    """Eliminate all legs, and tell at which poses one of them is rigid, or nearly so [n]: there they mean nothing.

    Where all poses have a rigid leg, the legs after it are left out.
    """
    size, places = equations.mechanism.ways.shape[1], equations.mechanism.unknown_places
    legs: list[EliminatedLeg] = []
    rigid = np.zeros(len(right), dtype=bool)
    for number, (coordinates, wrench) in enumerate(zip(places.coordinates, places.wrenches, strict=True)):
        by_platform = np.zeros((len(right), wrench.stop - coordinates.start, size))
        by_platform[:, -size:] = np.eye(size)
        sides = np.concatenate([right[:, coordinates.start : wrench.stop], by_platform], axis=2)
        unknowns, is_regular = _solutions_where_regular(equations.leg_rates(number, loaded), sides)
        legs.append(EliminatedLeg(unknowns[:, :, :-size], unknowns[:, :, -size:]))
        rigid |= ~is_regular | (np.abs(legs[-1].stiffness) >= STIFFEST_LEG).any(axis=(1, 2))
        if rigid.all():
            break
    return legs, rigid


def _solutions_where_regular(matrices: Array, right: Array) -> tuple[Array, Mask]:
    """Solve linear equations for n poses, NaN where a matrix is singular, and tell where it is not [n].

    LAPACK refuses a whole stack of which one matrix has a pivot of exactly zero; a determinant has the same pivots.
    """
    is_regular: Mask = np.ones(len(matrices), dtype=bool)
    try:
        return np.asarray(np.linalg.solve(matrices, right)), is_regular
    except np.linalg.LinAlgError:
        is_regular = np.asarray(np.linalg.slogdet(matrices).sign != 0.0)
        result = np.full(right.shape, np.nan)
        result[is_regular] = np.linalg.solve(matrices[is_regular], right[is_regular])
        return result, is_regular


def finite_solution(matrices: Array, right: Array) -> Array:
    """Solve linear equations for n poses [n x size x k]; NaN where they are not finite.

    Equations that are singular are solved by least squares, which gives the solution of least norm.
    """
    sound = finite_poses(matrices) & finite_poses(right)
    result = np.full((*matrices.shape[:2], right.shape[2]), np.nan)
    result[sound], is_regular = _solutions_where_regular(matrices[sound], right[sound])
    for row in np.flatnonzero(sound)[~is_regular]:
        result[row] = np.linalg.lstsq(matrices[row], right[row], rcond=None)[0]
    return result


def finite_poses(matrices: Array) -> Mask:
    """Tell at which of n poses a matrix has finite entries alone; it has none where legs cannot be placed."""
    return np.asarray(np.isfinite(matrices).all(axis=(1, 2)))


def solve_over_admissible(equations: Balance, right: Array, loaded: bool) -> Array:
    """Solve the linear equations at a state over the admissible motions; arguments and result as of `solve_at_rest`.

    Twist and coordinates are x = A+ b + Z y, where Z^T H Z y balances the remaining forces. Springs enter by the
    triangular factor of diag(sqrt k) Z, the stiffest first, and not by Z^T H Z, so that contrasts of stiffness cost
    half as many digits. If wrenches of legs are not determined, those of least norm are taken.
    """
    elastic, geometric, closing = tangent_matrices(equations)
    geometric = geometric if loaded else np.zeros_like(geometric)
    places = equations.mechanism.unknown_places
    moving, carried = places.motions, places.all_wrenches
    force, gap = right[:, moving], right[:, carried]
    sound = np.flatnonzero(np.all([finite_poses(part) for part in (elastic, geometric, closing, right)], axis=0))
    result = np.full_like(right, np.nan)
    for part in admissible(equations, closing, sound):
        tangent = elastic[part.rows] + geometric[part.rows]
        motion = part.closing_inverse @ gap[part.rows]
        if part.motions.shape[2]:
            remaining = part.motions.mT @ (force[part.rows] - tangent @ motion)
            turning = part.motions.mT @ geometric[part.rows] @ part.motions
            motion = motion + part.motions @ _balanced_motion(spring_factor(equations, part), turning, remaining)
        wrenches = part.closing_inverse.mT @ (tangent @ motion - force[part.rows])
        result[part.rows[:, None], moving], result[part.rows[:, None], carried] = motion, wrenches
    return result


def spring_factor(equations: Balance, part: Admissible) -> Array:
    """Return the upper triangular R [k x m x m]: R^T R is the stiffness of the springs over the admissible motions.

    Idle motions of legs count as springs, as in `TangentMatrices.elastic`.
    """
    places = equations.mechanism.motion_places
    stiffnesses = [terms.carrying[part.rows] for terms in equations.legs]
    roots = np.sqrt(np.concatenate(stiffnesses, axis=1)) if stiffnesses else np.zeros((len(part.rows), 0))
    stretched = roots[:, :, None] * part.motions[:, places.platform.stop :]
    # Householder's reflections keep the digits of small rows below large ones, and lose them above.
    order = np.argsort(-roots, axis=1, kind="stable")
    blocks = [np.take_along_axis(stretched, order[:, :, None], axis=1)]
    for leg, moving in zip(equations.mechanism.legs, places.coordinates, strict=True):
        blocks.append(leg.idle[part.rows].mT @ part.motions[:, moving])
    missing = part.motions.shape[2] - sum(block.shape[1] for block in blocks)
    blocks.append(np.zeros((len(part.rows), max(missing, 0), part.motions.shape[2])))
    return np.asarray(np.linalg.qr(np.concatenate(blocks, axis=1), mode="r"))


def holds_all(springs: Array) -> Mask:
    """Tell whether springs, given by their triangular factor R [k x m x m], hold every admissible motion [k]."""
    sizes = np.abs(np.diagonal(springs, axis1=1, axis2=2))
    return np.asarray(sizes.min(axis=1) > UNRESISTED * sizes.max(axis=1))


def _balanced_motion(springs: Array, turning: Array, force: Array) -> Array:
    """Return the motions y with (R^T R + G) y = f: by R if springs hold every motion, else by the sum as one matrix."""
    holds = holds_all(springs)
    result = np.zeros_like(force)
    if holds.any():
        inverse = np.linalg.inv(springs[holds])
        scaled = np.eye(springs.shape[1]) + inverse.mT @ turning[holds] @ inverse
        result[holds] = inverse @ finite_solution(scaled, inverse.mT @ force[holds])
    if not holds.all():
        tangent = springs[~holds].mT @ springs[~holds] + turning[~holds]
        result[~holds] = finite_solution(tangent, force[~holds])
    return result


def platform_compliance(equations: Balance) -> Array:
    """Return the twist of the platform per unit of a further wrench, at the loaded tool point [n x 6 x 6].

    Rows and columns of components that rigid parts hold are exactly 0, as in `assembly.without_round_off`.
    """
    ways = equations.mechanism.ways
    size = ways.shape[1]
    right = np.zeros((len(equations.residual), equations.residual.shape[1], size))
    right[:, :size] = np.eye(size)
    twists = ways @ solve_at_rest(equations, right)[:, :size] @ ways.T
    shift = _shift(-skew_of(equations.state.platform.translation))
    twists = shift @ twists @ shift.mT
    twists = 0.5 * (twists + twists.mT)
    sizes = np.abs(np.diagonal(twists, axis1=1, axis2=2))
    # In these units a typical spring has the compliance 1.
    moves = sizes > ROUND_OFF_OF_COMPLIANCE * np.maximum(sizes.sum(axis=1, keepdims=True), 1.0)
    return np.where(moves[:, :, None] & moves[:, None] | np.isnan(twists), twists, 0.0)


def _shift(lever: Array) -> Array:
    """Return matrices [n x 6 x 6] that take twists to another reference point: `lever` times the rotation is added."""
    result = np.broadcast_to(np.eye(6), (len(lever), 6, 6)).copy()
    result[:, 3:, :3] = lever
    return result


def stiffness_of(compliances: Array) -> Array:
    """Return the stiffness of each compliance [n x m x m].

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
    """Return a stiffness with infinite entries between fixed components, and 0 between these and the others."""
    either, both = fixed[:, :, None] | fixed[:, None], fixed[:, :, None] & fixed[:, None]
    return np.where(both, np.inf, np.where(either & np.isfinite(stiffness), 0.0, stiffness))


def elastic_stiffness(equations: Balance, compliances: Array) -> Array:
    """Return the stiffness of the springs where they are, leg by leg, at the loaded tool point [n x 6 x 6].

    A leg with rigid parts only lets the platform move in some ways and takes no part in them. Where these are single
    components, the entries of the others are infinite; else all of them are.

    Args:
        equations: the equations at a state of rest.
        compliances: the compliances of the platform there, to tell what is fixed [n x 6 x 6].
    """
    ways = equations.mechanism.ways
    size = ways.shape[1]
    sum_of_legs = np.zeros((len(equations.residual), size, size))
    rigid = np.zeros(len(sum_of_legs), dtype=bool)
    for number, leg in enumerate(equations.mechanism.legs):
        rates = equations.leg_rates(number, loaded=False)
        rigid |= np.linalg.cond(rates) >= 1.0 / UNRESISTED
        # Wrenches that no joint feels make these singular: the pseudo-inverse leaves out what rigid parts hold.
        sum_of_legs += np.linalg.pinv(rates)[:, leg.size :, leg.size :]
    from_tool = _shift(skew_of(equations.state.platform.translation))
    stiffness = from_tool.mT @ ways @ sum_of_legs @ ways.T @ from_tool
    stiffness = 0.5 * (stiffness + stiffness.mT)
    exists = np.abs(ways).max(axis=1) > 0.0
    fixed = (np.diagonal(compliances, axis1=1, axis2=2) == 0.0) & exists
    separable = np.isfinite(stiffness_of(compliances[:, exists][:, :, exists])).any(axis=(1, 2))
    result = np.where((rigid & ~separable)[:, None, None], np.inf, stiffness)
    return _with_fixed_components(result, fixed & rigid[:, None])
