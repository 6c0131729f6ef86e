"""Up to which share of its loads a mechanism stands: the last stable state of rest while they grow from nothing.

Preloads are there from the beginning. The state is followed in steps, each from the one before. It is lost where no
other one is nearby, where it is not stable, or where the next one is a leap away: the mechanism has snapped over.
"""

from dataclasses import dataclass, replace

import numpy as np

from kinetostat.equilibrium.balance import Balance, free_state
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.equilibrium.motion import Array, logarithm
from kinetostat.equilibrium.solving import newton, with_share
from kinetostat.equilibrium.tangent import Stability, stabilities, stability
from kinetostat.tolerances import AT_REST

RATIO, CANDIDATES, FEW = 2.0, 14, 4
"""Steps of the loads that are tried together: all that is left of them, and each time by this ratio less; few of them
where the machine may stand under all."""
MOST_STEPS = 14
"""Of the loads: a machine that moves very far before it is lost is not followed to the end, which takes seconds."""
FINE = 1e-3
"""Share of what it stands by which the last step is allowed to be wrong."""
MOST_ITERATIONS = 8
"""Of Newton's method in a step: where it needs more, the step is too long."""
BENT = 0.5
"""Share of its motion by which a step may miss what the tangent foresees: where it misses more, the state has snapped
over, or the step is too long."""
LONGEST = 0.3
"""Motion of the platform in a step, rad or in units of the machine's length."""


@dataclass(frozen=True)
class Limit:
    """The last stable state.

    Attributes:
        share: of the loads there.
        balance: the equations there.
        judged: how it gives way.
        least: whether the machine was not followed to its end: it stands by this share or more.
    """

    share: float
    balance: Balance
    judged: Stability
    least: bool = False


def limit_of(mechanism: Mechanism) -> Limit | None:
    """Follow a mechanism at one pose under growing loads.

    Args:
        mechanism: with all of its loads.

    Returns:
        Where it stands last, share 1 if it stands under all of them; None if it stands under no share.
    """
    last = _standing(mechanism, np.zeros(1), None)
    if last is None:
        return None
    whole = _standing(mechanism, _shares(0.0, FEW), last)  # as nearly every machine stands
    if whole is not None and whole.share == 1.0:
        return whole
    for _ in range(MOST_STEPS):
        if last.share == 1.0:
            return last
        there = _standing(mechanism, _shares(last.share, CANDIDATES), last)
        if there is None:
            return last
        nearly = there.share - last.share < FINE * there.share
        last = there
        if nearly:
            return last
    return replace(last, least=True)


def _shares(last: float, count: int) -> Array:
    """So many shares of the loads beyond the last one, up to all of them."""
    left = RATIO ** -np.arange(count - 1.0, 0.0, -1.0)
    return np.append(last + (1.0 - last) * left, 1.0)


def _standing(mechanism: Mechanism, shares: Array, last: Limit | None) -> Limit | None:
    """The state under the greatest of some shares up to which all are stable and near the last one.

    Args:
        mechanism: with all of its loads.
        shares: of the loads, from the least to the greatest.
        last: the state from which each of them is sought; the free state if None.
    """
    rows = np.zeros(len(shares), dtype=np.int64)
    start = (free_state(mechanism) if last is None else last.balance.state).taken(rows)
    loaded = with_share(mechanism.taken(rows), shares, preload=1.0)
    first, solution = (newton(loaded, start, iterations) for iterations in (1, MOST_ITERATIONS))
    foreseen, moved = (logarithm(s.balance.state.platform @ start.platform.inverse()) for s in (first, solution))
    size, wrong = np.abs(moved).max(axis=1), np.abs(moved - foreseen).max(axis=1)
    near = (size <= LONGEST) & (wrong <= BENT * size + AT_REST) | (last is None)
    stands = solution.settled & near & stabilities(solution.balance).stable
    count = int(np.cumprod(stands).sum())
    if not count:
        return None
    equations = solution.at(np.array([count - 1]))
    return Limit(float(shares[count - 1]), equations, stability(equations))
