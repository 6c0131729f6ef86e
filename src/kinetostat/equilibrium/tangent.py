"""Further loads at a state of rest: compliance, stiffness, and whether the state holds. No state is found here.

At a state of rest the second derivative of the potential depends on no choice of coordinates: it is the tangent
stiffness. Its elastic part is that of the springs at this place; the geometric part is what wrenches and weights do
when their lines of action turn. The moment of the load keeps its axis, which no potential does, and only the symmetric
part of what it adds is taken.

Source: theory (39) and (40). M. Zefran and V. Kumar, "A geometrical approach to the study of the Cartesian stiffness
matrix", J. Mechanical Design 124(1), 2002. Units, axes and origin are those of `mechanism`.
"""

from itertools import pairwise

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.equilibrium.admissible import (
    admissible,
    finite_solution,
    holds_all,
    solve_over_admissible,
    spring_factor,
    starts_of,
    tangent_matrices,
    within,
)
from kinetostat.equilibrium.balance import Balance, balance
from kinetostat.frozen import dataclass
from kinetostat.numerics.motions import skew_of
from kinetostat.tolerances import ROUND_OFF_OF_COMPLIANCE, STIFFEST_LEG, UNRESISTED


def solve(equations: Balance, right: Array, loaded: bool = True) -> Array:
    """Solve the linear equations at a state for right sides [n x unknowns x k].

    Each leg is eliminated by itself, so that it is a stiffness to the platform. A leg made only of rigid parts has
    no finite stiffness, and a very stiff leg drowns the digits of a soft one. Poses with such legs are solved over the
    motions that keep all legs closed.

    Args:
        equations: the equations at the state.
        right: right sides.
        loaded: whether to count what loads and wrenches do by turning.
    """
    size = equations.mechanism.ways.shape[1]
    legs = _eliminated_legs(equations, right, loaded)
    if legs is None:
        return solve_over_admissible(equations, right, loaded)
    whole, load = equations.platform_rates(loaded), right[:, :size]
    stiffest = np.zeros(len(right))
    for leg in legs:
        stiffness = leg[:, -size:, -size:]
        stiffest = np.maximum(stiffest, np.abs(stiffness).max(axis=(1, 2)))
        whole, load = whole + stiffness, load - leg[:, -size:, :-size]
    twist = finite_solution(whole, load)
    result = np.concatenate([twist, *(leg[:, :, :-size] + leg[:, :, -size:] @ twist for leg in legs)], axis=1)
    sound = np.flatnonzero(np.isfinite(whole).all(axis=(1, 2)))
    softest = np.linalg.svd(whole[sound], compute_uv=False)[:, -1]
    rows = sound[stiffest[sound] > STIFFEST_LEG * softest]
    if len(rows):
        of_rows = balance(equations.mechanism.at(rows), equations.state.at(rows))
        result[rows] = solve_over_admissible(of_rows, right[rows], loaded)
    return result


def _eliminated_legs(equations: Balance, right: Array, loaded: bool) -> list[Array] | None:
    """The unknowns of each leg by the right sides and by the platform's twist; None where a leg is rigid, or nearly so.

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
    right = np.zeros((len(equations.left), equations.left.shape[1], size))
    right[:, :size] = np.eye(size)
    moved = ways @ solve(equations, right)[:, :size] @ ways.T
    shift = _shift(-skew_of(equations.state.platform.translation))
    moved = shift @ moved @ np.swapaxes(shift, 1, 2)
    moved = 0.5 * (moved + np.swapaxes(moved, 1, 2))
    sizes = np.abs(np.diagonal(moved, axis1=1, axis2=2))
    # In these units a typical spring has the compliance 1.
    moves = sizes > ROUND_OFF_OF_COMPLIANCE * np.maximum(sizes.sum(axis=1, keepdims=True), 1.0)
    return np.where(moves[:, :, None] & moves[:, None] | np.isnan(moved), moved, 0.0)


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
    return _with_held(np.where(finite, np.linalg.inv(usable) / products, np.inf), fixed)


def _with_held(stiffness: Array, fixed: Mask) -> Array:
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
    total = np.zeros((len(equations.left), size, size))
    rigid = np.zeros(len(total), dtype=bool)
    for number, leg in enumerate(equations.mechanism.legs):
        block = equations.leg_rates(number, loaded=False)
        rigid |= np.linalg.cond(block) >= 1.0 / UNRESISTED
        # Wrenches that no joint feels make the block singular: the pseudo-inverse leaves out what rigid parts hold.
        total += np.linalg.pinv(block)[:, leg.size :, leg.size :]
    from_tool = _shift(skew_of(equations.state.platform.translation))
    stiffness = np.swapaxes(from_tool, 1, 2) @ ways @ total @ ways.T @ from_tool
    stiffness = 0.5 * (stiffness + np.swapaxes(stiffness, 1, 2))
    exists = np.abs(ways).max(axis=1) > 0.0
    fixed = (np.diagonal(compliances, axis1=1, axis2=2) == 0.0) & exists
    apart = np.isfinite(inverse(compliances[:, exists][:, :, exists])).any(axis=(1, 2))
    result = np.where((rigid & ~apart)[:, None, None], np.inf, stiffness)
    return _with_held(result, fixed & rigid[:, None])


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
    """Stability of n states of rest: arrays with the poses first."""

    stable: Mask
    factor: Array
    mode: Array
    legs: Array


def stability(equations: Balance) -> Stability:
    """Judge the state of rest at a single pose."""
    every = stabilities(equations)
    return Stability(bool(every.stable[0]), float(every.factor[0]), every.mode[0], every.legs[0])


def stabilities(equations: Balance) -> Stabilities:
    """Judge n states of rest; what is not finite is not stable."""
    ways, starts = equations.mechanism.ways, starts_of(equations)
    elastic, geometric, conditions = tangent_matrices(equations)
    count, size = len(elastic), ways.shape[1]
    sound = np.isfinite(elastic + geometric).all(axis=(1, 2)) & np.isfinite(conditions).all(axis=(1, 2))
    stable: Mask = np.array(sound)
    factors, modes = np.where(sound, np.inf, np.nan), np.zeros((count, starts[-1]))
    for part in admissible(equations, conditions, np.flatnonzero(sound)):
        here, allowed = part.rows, part.motions
        if not allowed.size:  # nothing can move at all
            continue
        stiff, turning = (within(matrix[here], allowed) for matrix in (elastic, geometric))
        springs = spring_factor(equations, part)
        holds = holds_all(springs)
        whitening = np.linalg.inv(np.where(holds[:, None, None], springs, np.eye(springs.shape[1])))
        # K_e + factor K_g is singular at factor = 1/share, so that the largest share decides.
        shares, vectors = np.linalg.eigh(-np.swapaxes(whitening, 1, 2) @ turning @ whitening)
        # Where springs hold every motion, those much softer than others would be lost in the sum of both matrices.
        stable[here] = np.where(holds, shares[:, -1] < 1.0, np.linalg.eigvalsh(stiff + turning)[:, 0] > 0.0)
        grows = holds & (shares[:, -1] > UNRESISTED)
        factors[here] = np.where(grows, 1.0 / np.where(grows, shares[:, -1], 1.0), np.where(holds, np.inf, np.nan))
        moved = (allowed @ whitening @ vectors[:, :, -1:])[:, :, 0]
        modes[here] = np.where(grows[:, None], moved / np.abs(moved).max(axis=1, keepdims=True), 0.0)
    legs = [np.abs(modes[:, a:b]).max(axis=1, initial=0.0) for a, b in pairwise(starts)]
    return Stabilities(
        stable, factors, modes[:, :size] @ ways.T, np.stack(legs, axis=1) if legs else np.zeros((count, 0))
    )
