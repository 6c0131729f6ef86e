"""Actuators of a loaded machine: coordinates that bring its tool to its pose, and preloads that hold it there.

Commands are found by Newton's method on the amounts by which the actuators are driven; the machine is at rest in every
step, and the rates come from its equations of equilibrium. Preloads are the internal loads of least norm within bounds:
a cable machine has more cables than it needs, so that all of them can pull, and which tensions hold its load is a
choice. The free lengths of all springs follow: with them, the loaded machine is at its pose.

Source: theory (41) and (42). Units, axes and origin are those of `mechanism`.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.equilibrium.balance import Balance, balance, free_state, platform_load
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.equilibrium.solving import Equilibria, at_rest
from kinetostat.equilibrium.tangent import solve_at_rest
from kinetostat.frozen import dataclass
from kinetostat.numerics.distribution import Balancing, Rule, distribution, within_bounds
from kinetostat.numerics.iteration import Steps, largest, newton
from kinetostat.numerics.motions import logarithm
from kinetostat.tolerances import BALANCED, COMMANDED, UNRESISTED

MOST_CORRECTIONS = 12
"""Greatest number of Newton's steps towards a command: three or four reach a pose that actuators can reach, and more
than twelve show that they cannot."""


@dataclass(frozen=True)
class CommandedState:
    """The machine with the amounts that bring its loaded tool to its pose.

    Attributes:
        solution: the machine at rest with these amounts; they are in its state.
        error: twist from the wanted to the reached pose, at the origin [n x 6]: what no actuator can change.
        first_error: the same twist without a correction [n x 6].
        rates: twist of the platform per unit of each amount, at the origin [n x 6 x actuators].
    """

    solution: Equilibria
    error: Array
    first_error: Array
    rates: Array


def commanded_state(mechanism: Mechanism) -> CommandedState:
    """Find the amounts of least norm; a pose that actuators cannot reach exactly is reached as nearly as they can."""
    ways, count = mechanism.ways, len(mechanism.length)
    state, settled = free_state(mechanism), np.zeros(count, dtype=bool)
    rates, first_error = np.zeros((count, ways.shape[1], len(mechanism.driven))), np.full((count, 6), np.nan)

    def equations(amounts: Array, rows: Integers) -> tuple[Array, Steps]:
        nonlocal state
        rest = at_rest(mechanism.at(rows), replace(state.at(rows), amounts=amounts))
        state, settled[rows] = state.with_part(rows, rest.state), rest.settled
        error = logarithm(rest.state.platform)
        first_error[rows] = np.where(np.isnan(first_error[rows]), error, first_error[rows])
        rates[rows] = solve_at_rest(rest.balance, -rest.balance.by_actuators())[:, mechanism.unknown_places.platform]
        change = -np.einsum("nac,nc->na", np.linalg.pinv(rates[rows], rcond=UNRESISTED), error @ ways)
        return np.where(rest.settled, largest(error), np.nan), lambda unsolved: change[unsolved]

    newton(equations, state.amounts, count, most_steps=MOST_CORRECTIONS, step_goal=COMMANDED)
    return CommandedState(
        solution=Equilibria(mechanism, state, settled, settled),
        error=logarithm(state.platform),
        first_error=first_error,
        rates=ways @ rates,
    )


def with_tensions(mechanism: Mechanism, least: Array, most: Array, rule: Rule) -> tuple[Mechanism, Mask]:
    """Choose the preloads of all springs so that the machine is at rest at its pose.

    Args:
        mechanism: the mechanism with its loads; its own preloads are left out, but for flexure hinges, which carry what
            they do.
        least, most: bounds of what its one-sided springs pull (or push), in its units of force [n].
        rule: the choice among the loads within them, in the same units.

    Returns:
        The mechanism with these preloads, and where there are any within the bounds [n]; elsewhere they are zero.
    """
    bare = replace(mechanism, legs=tuple(replace(leg, preload=leg.preload * leg.hinged) for leg in mechanism.legs))
    table, exist = (_tensions_of_cables if _only_cables(bare) else _tensions)(bare, least, most, rule)
    ends = np.cumsum([leg.size for leg in mechanism.legs])[:-1]
    parts = zip(bare.legs, np.split(table, ends, axis=1), strict=True)
    legs = [replace(leg, preload=leg.preload + part) for leg, part in parts]
    return replace(bare, legs=tuple(legs)), exist


def _only_cables(mechanism: Mechanism) -> bool:
    """Whether each leg carries a single wrench, by a spring that only pulls or only pushes, and weighs nothing."""
    return all(
        leg.size == mechanism.ways.shape[1]
        and sum(spring is not None for spring in leg.springs) == 1
        and leg.sign.any()
        and not (leg.hinged.any() or leg.masses.mass.any())
        for leg in mechanism.legs
    )


def _tensions_of_cables(mechanism: Mechanism, least: Array, most: Array, rule: Rule) -> tuple[Array, Mask]:
    """Loads of all coordinates of cables at n poses [n x coordinates], and where there are any within bounds [n]."""
    wrenches = []
    for leg in mechanism.legs:  # that which does no work on its passive motions, and as much as it pulls on its own
        motions = mechanism.ways.T @ leg.chain.twists.mT @ leg.chain.follows
        wrenches.append(_solution_or_nan(motions.mT, leg.sign))
    load = platform_load(mechanism, free_state(mechanism).platform)[0] @ mechanism.ways
    tensions, exist = distribution(np.stack(wrenches, axis=2), load, least, most, rule)
    parts = [tensions[:, [place]] * leg.sign for place, leg in enumerate(mechanism.legs)]
    return np.where(exist[:, None], np.concatenate(parts, axis=1), 0.0), exist


def _solution_or_nan(matrices: Array, right: Array) -> Array:
    """Solutions of n equations with one right side [n x size]; NaN where matrices are singular or not finite."""
    finite: Mask = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    solvable = np.where(finite[:, None, None], matrices, np.eye(len(right)))
    regular = finite & (np.abs(np.linalg.det(solvable)) > UNRESISTED)
    solvable = np.where(regular[:, None, None], solvable, np.eye(len(right)))
    solved = np.linalg.solve(solvable, np.broadcast_to(right[:, None], (len(solvable), len(right), 1)))[:, :, 0]
    return np.where(regular[:, None], solved, np.nan)


def _tensions(mechanism: Mechanism, least: Array, most: Array, rule: Rule) -> tuple[Array, Mask]:
    """Loads of all coordinates of any machine, and where there are any within the bounds, pose by pose."""
    equations, count = balance(mechanism, free_state(mechanism)), len(least)
    chosen = [_tensions_at(equations, i, float(least[i]), float(most[i]), rule.at(np.array([i]))) for i in range(count)]
    nothing = np.zeros(sum(leg.size for leg in mechanism.legs))
    table = np.array([nothing if loads is None else loads for loads in chosen])
    return table, np.array([loads is not None for loads in chosen])


def _tensions_at(equations: Balance, pose: int, least: float, most: float, rule: Rule) -> Array | None:
    """Loads of all coordinates at one pose, 0 of passive ones; None where none within the bounds balance.

    Unknown are the wrenches of the legs. Passive joints and the platform are in balance, which leaves some mixes of
    wrenches open; of these the rule chooses by the loads of the springs that only pull or push.
    """
    conditions, right, loads_per_wrench, weight = _balance_of_wrenches(equations, pose)
    if not (np.isfinite(conditions).all() and np.isfinite(right).all()):
        return None
    least_wrenches = np.linalg.lstsq(conditions, right, rcond=UNRESISTED)[0]
    if np.abs(conditions @ least_wrenches - right).max() > BALANCED * max(np.abs(right).max(), least):
        return None
    _, sizes, rows = np.linalg.svd(conditions)
    internal_wrenches = rows[int((sizes > UNRESISTED * sizes[0]).sum()) :].T
    base, change = loads_per_wrench @ least_wrenches - weight, loads_per_wrench @ internal_wrenches
    sign = np.concatenate([leg.sign for leg in equations.mechanism.legs])
    bounded = sign != 0.0
    amounts = _internal_amounts(sign[bounded] * base[bounded], sign[bounded, None] * change[bounded], least, most, rule)
    return None if amounts is None else base + change @ amounts


class _WrenchBalance(NamedTuple):
    """The equations for the wrenches of all legs at one pose, and what the springs carry by them.

    Attributes:
        conditions: matrix of the balance of platform and passive joints [conditions x wrenches].
        right: right side of this balance [conditions].
        loads_per_wrench: loads of the springs per unit of each wrench, 0 of passive coordinates [coordinates x
            wrenches].
        weight: the part of these loads that weight takes [coordinates].
    """

    conditions: Array
    right: Array
    loads_per_wrench: Array
    weight: Array


def _balance_of_wrenches(equations: Balance, pose: int) -> _WrenchBalance:
    """Write the balance of platform and passive joints at one pose; flexure hinges count as passive."""
    ways, legs = equations.mechanism.ways, equations.mechanism.legs
    size = ways.shape[1]
    conditions, right = [np.tile(np.eye(size), len(legs))], [ways.T @ equations.load[pose]]
    loads, weight = [], []
    for number, (leg, terms) in enumerate(zip(legs, equations.legs, strict=True)):
        rows = np.zeros((leg.size, size * len(legs)))
        rows[:, size * number : size * (number + 1)] = (ways.T @ terms.rates[pose]).T
        passive = np.array([spring is None for spring in leg.springs], dtype=bool) | leg.hinged
        conditions.append(rows[passive])
        right.append(terms.residual[pose][passive])
        loads.append(np.where(passive[:, None], 0.0, rows))
        weight.append(np.where(passive, 0.0, terms.residual[pose]))
    return _WrenchBalance(*(np.concatenate(parts) for parts in (conditions, right, loads, weight)))


def _internal_amounts(base: Array, change: Array, least: float, most: float, rule: Rule) -> Array | None:
    """The z for which base + change z is within bounds and as the rule says; None where there is none."""
    across, sizes, along = np.linalg.svd(change, full_matrices=False)
    kept = sizes > UNRESISTED * max(sizes.max(initial=0.0), UNRESISTED)
    across, inverse = across[:, kept], along[kept].T / sizes[kept]
    # base + change z = rest + across y with y = across^T (base + change z), and the rest is at right angles to it.
    balances = Balancing((base - across @ (across.T @ base))[None], across[None], np.array([True]))
    loads, exist = within_bounds(balances, np.array([least]), np.array([most]), rule)
    return np.asarray(inverse @ (across.T @ (loads[0] - base))) if exist[0] else None
