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


def stability(equations: Balance, pose: int = 0) -> Stability:
    """Judge the state of rest at one of the poses."""
    mechanism, ways = equations.mechanism, equations.mechanism.ways
    size, sizes = ways.shape[1], [leg.size for leg in mechanism.legs]
    starts = np.concatenate([[size], size + np.cumsum(sizes)]).astype(int)
    elastic, geometric = np.zeros((2, starts[-1], starts[-1]))
    conditions = np.zeros((size * len(sizes), starts[-1]))
    geometric[:size, :size] = -ways.T @ equations.load_change[pose] @ ways
    for k, (leg, terms) in enumerate(zip(mechanism.legs, equations.legs, strict=True)):
        moving, rows = slice(starts[k], starts[k + 1]), slice(size * k, size * (k + 1))
        elastic[moving, moving] = np.diag(terms.carrying[pose]) + leg.idle[pose] @ leg.idle[pose].T
        geometric[moving, moving] = terms.geometric[pose]
        conditions[rows, moving] = ways.T @ terms.rates[pose]
        conditions[rows, :size] = -np.eye(size)
    _, values, rows_of_all = np.linalg.svd(conditions)
    rank = int((values > UNRESISTED * values[0]).sum()) if len(values) else 0
    allowed = rows_of_all[rank:].T
    if not allowed.size:
        return Stability(True, np.inf, np.zeros(6), np.zeros(len(sizes)))  # nothing can move at all
    stiff, turning = (allowed.T @ (m + m.T) @ allowed * 0.5 for m in (elastic, geometric))
    stable = bool(np.linalg.eigvalsh(stiff + turning)[0] > 0.0)
    least, ways_of_springs = np.linalg.eigh(stiff)
    if least[0] <= UNRESISTED * least[-1]:
        return Stability(stable, np.nan, np.zeros(6), np.zeros(len(sizes)))
    half = ways_of_springs / np.sqrt(least)
    shares, modes = np.linalg.eigh(-half.T @ turning @ half)
    if shares[-1] <= 0.0:
        return Stability(stable, np.inf, np.zeros(6), np.zeros(len(sizes)))
    mode = allowed @ half @ modes[:, -1]
    mode = mode / np.abs(mode).max()
    legs = [np.abs(mode[a:b]).max(initial=0.0) for a, b in pairwise(starts)]
    return Stability(stable, float(1.0 / shares[-1]), ways @ mode[:size], np.array(legs))
