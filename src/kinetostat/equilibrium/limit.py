"""Up to which share of its loads a mechanism stands: the last stable state of rest while they grow from nothing.

Preloads are there from the beginning. The state is followed in steps, each from the one before. It is lost where no
other one is nearby, where it is not stable, or where the next one is a leap away: the mechanism has snapped over.
"""

from dataclasses import dataclass

import numpy as np

from kinetostat.equilibrium.balance import Balance, State, free_state
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.equilibrium.motion import logarithm
from kinetostat.equilibrium.solving import newton, with_share
from kinetostat.equilibrium.tangent import Stability, stability

STEPS, HALVINGS = 24, 14
"""Of the loads, and of the step in which the state is lost: the share is known to 3e-6."""
LEAP = 0.1
"""Motion of the platform between two steps, rad or in units of the machine's length, that counts as a leap."""


@dataclass(frozen=True)
class Limit:
    """The last stable state.

    Attributes:
        share: of the loads there.
        balance: the equations there.
        judged: how it gives way.
    """

    share: float
    balance: Balance
    judged: Stability


def limit_of(mechanism: Mechanism) -> Limit | None:
    """Follow a mechanism at one pose under growing loads.

    Args:
        mechanism: with all of its loads.

    Returns:
        Where it stands last, share 1 if it stands under all of them; None if it stands under no share.
    """
    last: Limit | None = None
    for number in range(STEPS + 1):
        there = _stands(mechanism, number / STEPS, last)
        if there is None and last is not None:
            return _halved(mechanism, last, number / STEPS)
        last = there
    return last


def _halved(mechanism: Mechanism, last: Limit, lost: float) -> Limit:
    for _ in range(HALVINGS):
        share = 0.5 * (last.share + lost)
        there = _stands(mechanism, share, last)
        last, lost = (last, share) if there is None else (there, lost)
    return last


def _stands(mechanism: Mechanism, share: float, last: Limit | None) -> Limit | None:
    """The state at a share of the loads, near the last one; None if there is none that is stable."""
    start: State = free_state(mechanism) if last is None else last.balance.state
    solution = newton(with_share(mechanism, share, preload=1.0), start)
    if not solution.settled[0]:
        return None
    moved = logarithm(solution.balance.state.platform @ start.platform.inverse())
    judged = stability(solution.balance)
    leapt = last is not None and float(np.abs(moved).max()) > LEAP
    return None if leapt or not judged.stable else Limit(share, solution.balance, judged)
