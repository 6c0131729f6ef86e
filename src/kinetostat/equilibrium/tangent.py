"""How a mechanism resists further load at a state of rest: compliance, stiffness, and how far the load may grow.

At a state of rest the second derivative of the potential depends on no choice of coordinates: it is the tangent
stiffness. Its elastic part is that of the springs at this place; the geometric part is what wrenches and weights do
when their lines of action turn. The moment of the load keeps its axis, which no potential does, and only the symmetric
part of what it adds is taken.

Source: theory (39) and (40). M. Zefran and V. Kumar, "A geometrical approach to the study of the Cartesian stiffness
matrix", J. Mechanical Design 124(1), 2002. Units are those of `mechanism`.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from kinetostat.equilibrium.admissible import (
    admissible,
    gaps_of,
    holds_all,
    spring_factor,
    starts_of,
    tangent_matrices,
    within,
)
from kinetostat.equilibrium.balance import Balance
from kinetostat.equilibrium.motion import Array, skew_of
from kinetostat.equilibrium.solving import solve
from kinetostat.tolerances import ROUND_OFF_OF_COMPLIANCE, UNRESISTED


def compliance(equations: Balance) -> Array:
    """The twist of the platform per unit of a further wrench, at the loaded tool point [n x 6 x 6].

    Rows and columns of components that rigid parts hold are exactly 0, as in `assembly.without_round_off`.
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
    sizes = np.abs(np.diagonal(moved, axis1=1, axis2=2))
    # In these units a typical spring has the compliance 1.
    moves = sizes > ROUND_OFF_OF_COMPLIANCE * np.maximum(sizes.sum(axis=1, keepdims=True), 1.0)
    return np.where(moves[:, :, None] & moves[:, None] | np.isnan(moved), moved, 0.0)


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
    elastic, geometric, conditions = tangent_matrices(equations)
    count, size = len(elastic), ways.shape[1]
    sound = np.isfinite(elastic + geometric).all(axis=(1, 2)) & np.isfinite(conditions).all(axis=(1, 2))
    stable: npt.NDArray[np.bool_] = np.array(sound)
    factors, modes = np.where(sound, np.inf, np.nan), np.zeros((count, starts[-1]))
    for part in admissible(conditions, np.flatnonzero(sound), gaps_of(equations)):
        here, allowed = part.rows, part.motions
        if not allowed.size:  # nothing can move at all
            continue
        stiff, turning = (within(matrix[here], allowed) for matrix in (elastic, geometric))
        springs = spring_factor(equations, part)
        holds = holds_all(springs)
        half = np.linalg.inv(np.where(holds[:, None, None], springs, np.eye(springs.shape[1])))
        shares, turns = np.linalg.eigh(-np.swapaxes(half, 1, 2) @ turning @ half)
        # Where springs hold every motion, those much softer than others would be lost in the sum of both matrices.
        stable[here] = np.where(holds, shares[:, -1] < 1.0, np.linalg.eigvalsh(stiff + turning)[:, 0] > 0.0)
        grows = holds & (shares[:, -1] > UNRESISTED)
        factors[here] = np.where(grows, 1.0 / np.where(grows, shares[:, -1], 1.0), np.where(holds, np.inf, np.nan))
        moved = (allowed @ half @ turns[:, :, -1:])[:, :, 0]
        modes[here] = np.where(grows[:, None], moved / np.abs(moved).max(axis=1, keepdims=True), 0.0)
    legs = [np.abs(modes[:, a:b]).max(axis=1, initial=0.0) for a, b in pairwise(starts)]
    return Stabilities(
        stable, factors, modes[:, :size] @ ways.T, np.stack(legs, axis=1) if legs else np.zeros((count, 0))
    )
