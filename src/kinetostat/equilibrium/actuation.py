"""Actuators of a loaded machine: coordinates that bring its tool to its pose, and preloads that hold it there.

Commands are found by Newton's method on the amounts by which the actuators are driven; the machine is at rest in every
step, and the rates come from its equations of equilibrium. Preloads are the internal loads of least norm within bounds:
a cable machine has more cables than it needs, so that all of them can pull, and which tensions hold its load is a
choice. The free lengths of all springs follow: with them, the loaded machine is at its pose.

Source: theory (41) and (42). Units, axes and origin are those of `mechanism`.
"""

from dataclasses import replace

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.equilibrium.balance import Balance, balance, free_state
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.equilibrium.solving import Equilibria, at_rest
from kinetostat.equilibrium.tangent import solve
from kinetostat.frozen import dataclass
from kinetostat.numerics.iteration import Steps, largest, newton
from kinetostat.numerics.motions import logarithm
from kinetostat.tolerances import BALANCED, COMMANDED, UNRESISTED

MOST_CORRECTIONS = 12


@dataclass(frozen=True)
class CommandedState:
    """The machine with the amounts that bring its loaded tool to its pose.

    Attributes:
        solution: the machine at rest with these amounts; they are in its state.
        off: twist from the wanted to the reached pose, at the origin [n x 6]: what no actuator can change.
        before: the same twist without a correction [n x 6].
        rates: twist of the platform per unit of each amount, at the origin [n x 6 x actuators].
    """

    solution: Equilibria
    off: Array
    before: Array
    rates: Array


def commanded_state(mechanism: Mechanism) -> CommandedState:
    """Find the amounts of least norm; a pose that actuators cannot reach exactly is reached as nearly as they can."""
    ways, count = mechanism.ways, len(mechanism.length)
    state, settled = free_state(mechanism), np.zeros(count, dtype=bool)
    rates, before = np.zeros((count, ways.shape[1], len(mechanism.driven))), np.full((count, 6), np.nan)

    def equations(amounts: Array, rows: Integers) -> tuple[Array, Steps]:
        nonlocal state
        rest = at_rest(mechanism.at(rows), replace(state.at(rows), amounts=amounts))
        state, settled[rows] = state.with_part(rows, rest.state), rest.settled
        off = logarithm(rest.state.platform)
        before[rows] = np.where(np.isnan(before[rows]), off, before[rows])
        rates[rows] = solve(rest.balance, -rest.balance.by_actuators())[:, : ways.shape[1]]
        change = -np.einsum("nac,nc->na", np.linalg.pinv(rates[rows], rcond=UNRESISTED), off @ ways)
        return np.where(rest.settled, largest(off), np.nan), lambda going: change[going]

    newton(equations, state.amounts, count, most_steps=MOST_CORRECTIONS, settled=COMMANDED)
    return CommandedState(
        Equilibria(mechanism, state, settled, settled), logarithm(state.platform), before, ways @ rates
    )


def with_tensions(mechanism: Mechanism, least: Array, most: Array) -> tuple[Mechanism, Mask]:
    """Choose the preloads of all springs so that the machine is at rest at its pose.

    Args:
        mechanism: the mechanism with its loads; its own preloads are left out, but for flexure hinges, which carry what
            they do.
        least, most: bounds of what its one-sided springs pull (or push), in its units of force [n].

    Returns:
        The mechanism with these preloads, and where there are any within the bounds [n]; elsewhere they are zero.
    """
    bare = replace(mechanism, legs=tuple(replace(leg, preload=leg.preload * leg.hinged) for leg in mechanism.legs))
    equations = balance(bare, free_state(bare))
    chosen = [_tensions_at(equations, i, float(least[i]), float(most[i])) for i in range(len(least))]
    known = np.array([loads is not None for loads in chosen])
    size = sum(leg.size for leg in mechanism.legs)
    table = np.array([np.zeros(size) if loads is None else loads for loads in chosen])
    ends = np.cumsum([leg.size for leg in mechanism.legs])[:-1]
    parts = zip(bare.legs, np.split(table, ends, axis=1), strict=True)
    legs = [replace(leg, preload=leg.preload + part) for leg, part in parts]
    return replace(bare, legs=tuple(legs)), known


def _tensions_at(equations: Balance, pose: int, least: float, most: float) -> Array | None:
    """Loads of all coordinates at one pose, 0 of passive ones; None where none within the bounds balance."""
    ways, legs = equations.mechanism.ways, equations.mechanism.legs
    size = ways.shape[1]
    # Unknown are the wrenches of the legs; passive joints and the platform are in balance.
    conditions, given = [np.tile(np.eye(size), len(legs))], [ways.T @ equations.load[pose]]
    felt, weight, signs = [], [], []
    for number, (leg, terms) in enumerate(zip(legs, equations.legs, strict=True)):
        rows = np.zeros((leg.size, size * len(legs)))
        rows[:, size * number : size * (number + 1)] = (ways.T @ terms.rates[pose]).T
        passive = np.array([spring is None for spring in leg.springs], dtype=bool) | leg.hinged
        conditions.append(rows[passive])
        given.append(terms.left[pose][passive])
        felt.append(np.where(passive[:, None], 0.0, rows))
        weight.append(np.where(passive, 0.0, terms.left[pose]))
        signs.append(leg.sign)
    matrix, right = np.concatenate(conditions), np.concatenate(given)
    if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
        return None
    start = np.linalg.lstsq(matrix, right, rcond=UNRESISTED)[0]
    if np.abs(matrix @ start - right).max() > BALANCED * max(np.abs(right).max(), least):
        return None
    _, values, rows = np.linalg.svd(matrix)
    free = rows[int((values > UNRESISTED * values[0]).sum()) :].T
    every, sign = np.concatenate(felt), np.concatenate(signs)
    base, turn = every @ start - np.concatenate(weight), every @ free
    pulls = sign != 0.0
    inner = _least_norm(sign[pulls] * base[pulls], sign[pulls, None] * turn[pulls], least, most)
    return None if inner is None else base + turn @ inner


def _within(loads: Array, least: float, most: float, slack: float) -> bool:
    return bool(((loads >= least - slack) & (loads <= most + slack)).all())


def _least_norm(base: Array, turn: Array, least: float, most: float) -> Array | None:
    """The z of least norm of base + turn z within bounds; None where there is none.

    In the coordinates in which the norm is that of a vector, it is the point of a polyhedron that is nearest to the
    origin, which one problem of least squares with non-negative unknowns gives.

    Source: C. Lawson and R. Hanson, Solving Least Squares Problems (1974), chapter 23, algorithm LDP.
    """
    from scipy.optimize import nnls  # half a second to import: only for machines that need it

    scale = max(np.abs(base).max(initial=0.0), least, UNRESISTED)
    if not turn.shape[1]:
        return np.zeros(0) if _within(base, least, most, BALANCED * scale) else None
    across, sizes, along = np.linalg.svd(turn, full_matrices=False)
    kept = sizes > UNRESISTED * max(sizes.max(initial=0.0), UNRESISTED)
    across, back = across[:, kept], along[kept].T / sizes[kept]
    # base + turn z = fixed + across y with y = across^T (base + turn z), and fixed is at right angles to it.
    fixed = base - across @ (across.T @ base)
    sides, ends = across, (least - fixed) / scale
    if np.isfinite(most):
        sides, ends = np.concatenate([across, -across]), np.concatenate([ends, (fixed - most) / scale])
    matrix, wanted = np.vstack([sides.T, ends]), np.append(np.zeros(sides.shape[1]), 1.0)
    amounts, missed = nnls(matrix, wanted)
    if missed <= BALANCED:
        return None
    left = matrix @ amounts - wanted
    nearest = -scale * left[:-1] / left[-1]
    return np.asarray(back @ (nearest - across.T @ base))
