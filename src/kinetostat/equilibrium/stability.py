"""Whether a state of rest holds, and how far its load may grow until it does not. No state is found here.

Source: theory (40). Units, axes and origin are those of `mechanism`.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.equilibrium.admissible import (
    admissible,
    holds_all,
    spring_factor,
    starts_of,
    tangent_matrices,
    within,
)
from kinetostat.equilibrium.balance import Balance
from kinetostat.tolerances import UNRESISTED


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

    stable: Mask
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
    stable: Mask = np.array(sound)
    factors, modes = np.where(sound, np.inf, np.nan), np.zeros((count, starts[-1]))
    for part in admissible(equations, conditions, np.flatnonzero(sound)):
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
