"""How a mechanism resists further load at a state of rest: compliance, stiffness, and how far the load may grow.

At a state of rest the second derivative of the potential depends on no choice of coordinates: it is the tangent
stiffness. Its elastic part is that of the springs at this place; the geometric part is what wrenches and weights do
when their lines of action turn. The moment of the load keeps its axis, which no potential does, and only the symmetric
part of what it adds is taken.

Source: theory (39) and (40). M. Zefran and V. Kumar, "A geometrical approach to the study of the Cartesian stiffness
matrix", J. Mechanical Design 124(1), 2002. Units are those of `mechanism`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from kinetostat.equilibrium.balance import Balance
from kinetostat.equilibrium.motion import Array, skew_of
from kinetostat.equilibrium.solving import solve
from kinetostat.tolerances import UNRESISTED


def compliance(equations: Balance) -> Array:
    """The twist of the platform per unit of a further wrench, at the loaded tool point [n x 6 x 6].

    Entries that are round-off beside the compliance of a typical spring are 0: something rigid holds there.
    """
    ways = equations.mechanism.ways
    size = ways.shape[1]
    right = np.zeros((len(equations.left), equations.left.shape[1], size))
    right[:, :size] = np.eye(size)
    moved = ways @ solve(equations, right)[:, :size] @ ways.T
    shift = np.broadcast_to(np.eye(6), moved.shape).copy()
    shift[:, 3:, :3] = -skew_of(equations.state.platform.translation)
    moved = shift @ moved @ np.swapaxes(shift, 1, 2)
    moved = 0.5 * (moved + np.swapaxes(moved, 1, 2))
    return np.where(np.abs(moved) < UNRESISTED, 0.0, moved)


def inverse(compliances: Array) -> Array:
    """The stiffness of each compliance [n x m x m]; infinite where a direction is rigid."""
    sizes = np.sqrt(np.abs(np.diagonal(compliances, axis1=1, axis2=2)))
    products = sizes[:, :, None] * sizes[:, None]
    products = np.where(products > 0.0, products, 1.0)
    scaled = compliances / products
    finite = ((sizes > 0.0).all(axis=1) & (np.linalg.cond(scaled) < 1.0 / UNRESISTED))[:, None, None]
    usable = np.where(finite, scaled, np.eye(compliances.shape[1]))
    return np.where(finite, np.linalg.inv(usable) / products, np.inf)


def elastic_stiffness(equations: Balance) -> Array:
    """The stiffness of the springs where they are, leg by leg, at the loaded tool point [n x 6 x 6].

    Infinite or undefined where a leg has rigid parts only: entries are then not finite.
    """
    ways = equations.mechanism.ways
    size = ways.shape[1]
    total = np.zeros((len(equations.left), size, size))
    for number, leg in enumerate(equations.mechanism.legs):
        block = equations.leg_rates(number, loaded=False)
        sound = np.linalg.cond(block)[:, None, None] < 1.0 / UNRESISTED
        total += np.where(sound, np.linalg.pinv(block)[:, leg.size :, leg.size :], np.nan)
    back = np.broadcast_to(np.eye(6), (len(total), 6, 6)).copy()
    back[:, 3:, :3] = skew_of(equations.state.platform.translation)
    whole = np.swapaxes(back, 1, 2) @ ways @ total @ ways.T @ back
    return np.asarray(0.5 * (whole + np.swapaxes(whole, 1, 2)))


@dataclass(frozen=True)
class Stability:
    """Whether a state of rest holds, and how much more of its load it could hold.

    Attributes:
        stable: whether every small disturbance comes back.
        factor: by which the load may grow until one does not, if wrenches grow in proportion; infinite if none does,
            NaN where springs alone hold nothing.
        mode: twist of the platform in that disturbance, at the origin; its largest component is 1 [6].
        legs: the largest motion of each leg's coordinates in it, of the same scale.
    """

    stable: bool
    factor: float
    mode: Array
    legs: Array


@dataclass(frozen=True)
class Stabilities:
    """The same of n states of rest: arrays with the poses first."""

    stable: npt.NDArray[np.bool_]
    factor: Array
    mode: Array
    legs: Array


def stability(equations: Balance) -> Stability:
    """Judge the state of rest at a single pose."""
    every = stabilities(equations)
    return Stability(bool(every.stable[0]), float(every.factor[0]), every.mode[0], every.legs[0])


def stabilities(equations: Balance) -> Stabilities:
    """Judge states of rest; what is not finite is not stable."""
    ways, starts = equations.mechanism.ways, starts_of(equations)
    elastic, geometric, conditions = motions_of(equations)
    count, size = len(elastic), ways.shape[1]
    sound = np.isfinite(elastic + geometric).all(axis=(1, 2)) & np.isfinite(conditions).all(axis=(1, 2))
    stable: npt.NDArray[np.bool_] = np.array(sound)
    factors, modes = np.where(sound, np.inf, np.nan), np.zeros((count, starts[-1]))
    for here, allowed in allowed_motions(conditions, np.flatnonzero(sound)):
        stiff, turning = (within(part[here], allowed) for part in (elastic, geometric))
        stable[here] = np.linalg.eigvalsh(stiff + turning)[:, 0] > 0.0
        least, springs = np.linalg.eigh(stiff)
        holds = least[:, 0] > UNRESISTED * least[:, -1]
        half = springs / np.sqrt(np.where(holds[:, None], least, 1.0))[:, None]
        shares, turns = np.linalg.eigh(-np.swapaxes(half, 1, 2) @ turning @ half)
        grows = holds & (shares[:, -1] > 0.0)
        factors[here] = np.where(grows, 1.0 / np.where(grows, shares[:, -1], 1.0), np.where(holds, np.inf, np.nan))
        moved = (allowed @ half @ turns[:, :, -1:])[:, :, 0]
        modes[here] = np.where(grows[:, None], moved / np.abs(moved).max(axis=1, keepdims=True), 0.0)
    legs = [np.abs(modes[:, a:b]).max(axis=1, initial=0.0) for a, b in pairwise(starts)]
    return Stabilities(
        stable, factors, modes[:, :size] @ ways.T, np.stack(legs, axis=1) if legs else np.zeros((count, 0))
    )


def allowed_motions(conditions: Array, rows: npt.NDArray[np.int64]) -> Iterator[tuple[npt.NDArray[np.int64], Array]]:
    """Poses with as many motions that obey the conditions, and an orthonormal basis of these, as columns.

    Poses at which nothing can move at all are left out.

    Args:
        conditions: that motions must make 0 [n x conditions x coordinates].
        rows: of the poses at which they are finite.
    """
    _, values, bases = np.linalg.svd(conditions[rows])
    ranks = (values > UNRESISTED * values[:, :1]).sum(axis=1)
    for rank in np.unique(ranks):
        here = ranks == rank
        allowed = np.swapaxes(bases[here, rank:], 1, 2)
        if allowed.size:
            yield rows[here], allowed


def starts_of(equations: Balance) -> npt.NDArray[np.int64]:
    """Where the coordinates of each leg begin after the ways of the platform, and where the last ones end."""
    sizes = [leg.size for leg in equations.mechanism.legs]
    return equations.mechanism.ways.shape[1] + np.cumsum([0, *sizes])


def motions_of(equations: Balance) -> tuple[Array, Array, Array]:
    """Springs, and what loads and wrenches add, over the twist of the platform and all coordinates; what these obey."""
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


def within(matrix: Array, allowed: Array) -> Array:
    """The symmetric part of a matrix over the motions that are allowed, the columns [n x k x k]."""
    return np.asarray(0.5 * np.swapaxes(allowed, 1, 2) @ (matrix + np.swapaxes(matrix, 1, 2)) @ allowed)
