"""Where actuators must stand so that the tool of a loaded machine is where an unloaded one would have it.

Newton's method on the amounts by which the actuators are driven; the machine is at rest in every step, and the rates
come from its equations of equilibrium.

Source: theory (41). Units are those of `mechanism`.
"""

from dataclasses import dataclass, replace

import numpy as np

from kinetostat.arrays import Array, Integers
from kinetostat.equilibrium.balance import free_state
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.equilibrium.solving import Equilibria, at_rest, solve
from kinetostat.numerics.iteration import Steps, largest, newton
from kinetostat.numerics.motions import logarithm
from kinetostat.tolerances import COMMANDED, UNRESISTED

MOST_CORRECTIONS = 12


@dataclass(frozen=True)
class Commanded:
    """Amounts that bring the loaded tool to its pose.

    Attributes:
        solution: the machine at rest with these amounts; they are in its state.
        off: twist from the wanted to the reached pose, at the origin [n x 6]: what no actuator can change.
        before: the same without a correction [n x 6].
        rates: twist of the platform per unit of each amount, at the origin [n x 6 x actuators].
    """

    solution: Equilibria
    off: Array
    before: Array
    rates: Array


def commanded(mechanism: Mechanism) -> Commanded:
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
    return Commanded(Equilibria(mechanism, state, settled), logarithm(state.platform), before, ways @ rates)
