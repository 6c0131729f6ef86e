"""Where actuators must stand so that the tool of a loaded machine is where an unloaded one would have it.

Newton's method on the amounts by which the actuators are driven; the machine is at rest in every step, and the rates
come from its equations of equilibrium.

Source: theory (41). Units are those of `mechanism`.
"""

from dataclasses import dataclass, replace

import numpy as np

from kinetostat.arrays import Array
from kinetostat.equilibrium.balance import free_state
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.equilibrium.solving import Solution, at_rest, solve
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

    solution: Solution
    off: Array
    before: Array
    rates: Array


def commanded(mechanism: Mechanism) -> Commanded:
    """Find the amounts of least norm; a pose that actuators cannot reach exactly is reached as nearly as they can."""
    state, ways = free_state(mechanism), mechanism.ways
    solution = at_rest(mechanism, state)
    before = logarithm(solution.balance.state.platform)
    for _ in range(MOST_CORRECTIONS):
        equations = solution.balance
        off = logarithm(equations.state.platform) @ ways
        rates = solve(equations, -equations.by_actuators())[:, : ways.shape[1]]
        change = -np.einsum("nac,nc->na", np.linalg.pinv(rates, rcond=UNRESISTED), off)
        change = np.where(solution.settled[:, None], change, 0.0)
        solution = at_rest(mechanism, replace(equations.state, amounts=equations.state.amounts + change))
        if np.abs(change).max(initial=0.0) < COMMANDED:
            break
    return Commanded(solution, logarithm(solution.balance.state.platform), before, ways @ rates)
