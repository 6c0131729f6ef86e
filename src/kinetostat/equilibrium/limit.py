"""Limits of the loads of a mechanism: the last state of rest while these grow, and struts that bend away.

Preloads act from the beginning. The loads grow in steps, and the state of rest under each share of them is sought from
the one before. The search ends where there is no state of rest nearby, where it is not stable, or where it is a leap
away because the mechanism has snapped over.

This search knows springs only. A strut is what carries forces along one line: the straight part of a leg between its
only two passive joints, or a bar of a parallelogram. Both its ends are free to turn, so that it bends like a column
between two hinges, at Euler's load. A telescopic leg counts as if its weakest part were as long as the whole leg, which
is on the safe side.

Source: theory (43).
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.equilibrium.balance import Balance, free_state
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.equilibrium.solving import (
    FEW_STEPS,
    Stability,
    are_near,
    at_rest,
    stabilities,
    stability,
    states_near,
    with_share,
)
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Leg, Line
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.links import rods
from kinetostat.machine.machine import Member
from kinetostat.tolerances import ACCURACY_OF_SHARE

STEP_RATIO = 2.0
"""Ratio of two steps that are tried together, one after the other in size: the largest leads to all of the loads. With
twice the ratio, half as many states would be solved for, and twice as much could be missed between two of them."""
CANDIDATES = 14
"""Number of steps that are tried together: the smallest is 2^-13 of the largest, below `ACCURACY_OF_SHARE`."""
FEW_CANDIDATES = 4
"""The same at first, because nearly every machine stands under all of its loads, which a few steps show."""
MOST_LOAD_STEPS = 14
"""Greatest number of steps: a machine that moves very far before it gives way is not followed to its end, which would
take seconds."""


@dataclass(frozen=True)
class LoadLimit:
    """The last stable state of rest while the loads grow.

    Attributes:
        share: share of the loads under which it is at rest.
        balance: the equations of that state.
        stability: its stability, with the motion by which it gives way.
        is_lower_bound: whether the search has ended early, so that the machine may stand under a greater share.
    """

    share: float
    balance: Balance
    stability: Stability
    is_lower_bound: bool = False

    @property
    def is_passed(self) -> bool:
        """Whether a machine that is stable under all of its loads has snapped over on the way to them."""
        return self.share < 1.0 and not self.is_lower_bound


def snap_flags(balance: Balance) -> Array:
    """Return 1 for each state of rest that is reached only by snapping over while the loads grow, else 0.

    Each mechanism is followed by itself, which takes some hundredths of a second where it snaps over.

    Args:
        balance: the equations of states of rest under all loads, at n poses.

    Returns:
        Floats, as quantities are [n].
    """
    limits = (load_limit(balance.mechanism.at(np.array([row]))) for row in range(len(balance.residual)))
    return np.array([float(limit is not None and limit.is_passed) for limit in limits])


def load_limit(mechanism: Mechanism) -> LoadLimit | None:
    """Follow a mechanism at one pose under growing loads.

    Args:
        mechanism: the mechanism with all of its loads.

    Returns:
        The last stable state, share 1 if the mechanism stands under all of its loads; None if no share was found under
        which it stands.
    """
    last = _last_stable(mechanism, np.zeros(1), None)
    reached = None if last is None else _limit_from(mechanism, last)
    if reached is not None and reached.share > 0.0:
        return reached
    # Springs that only pull may hold nothing until a load tensions them: then the mechanism stands from some share on.
    if not any(leg.sign.any() for leg in mechanism.legs):
        return reached
    shares = _shares(0.0, FEW_CANDIDATES)
    solution = at_rest(with_share(mechanism.at(np.zeros(FEW_CANDIDATES, dtype=np.int64)), shares, preload=1.0))
    stands = np.flatnonzero(solution.settled & stabilities(solution.balance).stable)
    if not len(stands):
        return reached
    equations = solution.at(stands[:1])
    return _limit_from(mechanism, LoadLimit(float(shares[stands[0]]), equations, stability(equations)))


def _limit_from(mechanism: Mechanism, last: LoadLimit) -> LoadLimit:
    """The last stable state while the loads grow from one under which the mechanism stands."""
    last = _last_stable(mechanism, _shares(last.share, FEW_CANDIDATES), last) or last
    for _ in range(MOST_LOAD_STEPS):
        if last.share == 1.0:
            return last
        next_state = _last_stable(mechanism, _shares(last.share, CANDIDATES), last)
        if next_state is None:
            return last
        accurate = next_state.share - last.share < ACCURACY_OF_SHARE * next_state.share
        last = next_state
        if accurate:
            return last
    return replace(last, is_lower_bound=True)


def _shares(last: float, count: int) -> Array:
    """Return `count` shares of the loads beyond the last one, closer together near it; the greatest of them is 1."""
    steps = STEP_RATIO ** -np.arange(count - 1.0, 0.0, -1.0)
    return np.append(last + (1.0 - last) * steps, 1.0)


def _last_stable(mechanism: Mechanism, shares: Array, last: LoadLimit | None) -> LoadLimit | None:
    """The state under the greatest of some shares up to which all are stable and near the last one.

    Args:
        mechanism: the mechanism with all of its loads.
        shares: the shares of the loads, from the least to the greatest.
        last: the state from which each of them is sought; the free state if None.
    """
    rows = np.zeros(len(shares), dtype=np.int64)
    repeated, start = mechanism.at(rows), (free_state(mechanism) if last is None else last.balance.state).at(rows)
    loaded = with_share(repeated, shares, preload=1.0)
    solution = states_near(loaded, start, FEW_STEPS)
    stands = solution.settled & stabilities(solution.balance).stable
    if last is not None:
        stands &= are_near(with_share(repeated, last.share, preload=1.0), start, loaded, solution.state)
    count = int(np.cumprod(stands).sum())
    if not count:
        return None
    equations = solution.at(np.array([count - 1]))
    return LoadLimit(float(shares[count - 1]), equations, stability(equations))


@dataclass(frozen=True)
class Strut:
    """A strut with its compression and the load at which it bends away.

    Attributes:
        name: the name of the link.
        leg: name of the leg that it belongs to.
        length: distance of its hinges, m.
        compression: force that presses it, N; negative where it is pulled.
        euler_load: the compression at which it bends away, N.
    """

    name: str
    leg: str
    length: float
    compression: float
    euler_load: float

    @property
    def factor(self) -> float:
        """Factor by which its compression may grow until it bends away; infinite where it is pulled."""
        return self.euler_load / self.compression if self.compression > 0.0 else math.inf

    @property
    def bends_away(self) -> bool:
        """Whether it is pressed with more than Euler's load."""
        return self.factor < 1.0


def struts(legs: Sequence[Leg], members: Sequence[Member], reference: Vector, equations: Balance) -> list[Strut]:
    """Find the struts whose E I is known, and what presses them at a state of rest.

    Args:
        legs: the legs of the machine at its pose, base frame.
        members: its links.
        reference: the tool point, base frame, m.
        equations: the equations at the state of rest of one pose.
    """
    result = []
    force, length = float(equations.mechanism.force[0]), float(equations.mechanism.length[0])
    units = np.array([force * length] * 3 + [force] * 3)
    for leg, wrench in zip(legs, equations.state.wrenches, strict=True):
        links = [link for link in members if link.leg == leg.name and float(link.bending) > 0.0]
        lines = _lines(leg, equations.mechanism.ways.shape[1])
        if not (links and lines):
            continue
        pulls = _pulls(lines, wrench[0] * units, reference)
        if len(lines) == 1:
            size = float(rods([leg])[0].length)
            weakest = min(float(link.bending) for link in links)
            result.append(Strut(leg.name, leg.name, size, -pulls[0], _euler(weakest, size)))
            continue
        bars = [link for link in links if _across_parallelogram(leg, link)]
        for bar, pull in zip(bars, pulls, strict=False):
            size = float(bar.length)
            result.append(Strut(bar.name, leg.name, size, -pull, _euler(float(bar.bending), size)))
    return result


def _lines(leg: Leg, ways: int) -> list[Line]:
    """The lines along which a leg carries forces and nothing else, each from base to platform; none of other legs.

    Args:
        leg: the leg at its pose.
        ways: how many freedoms a body has in the machine: 6, or 3 in a plane.
    """
    if len(leg.lines) > 1:
        return list(leg.lines)
    alone = len(leg.lines) == 1 or len(leg.passive) - len(leg.idle) == ways - 1
    return [Line(rod.end, rod.span * (1.0 / rod.length)) for rod in rods([leg]) if alone]


def _across_parallelogram(leg: Leg, link: Member) -> bool:
    """Tell whether a link is a bar of a leg's parallelogram: its ends are on both sides of it."""
    if link.ends is None:
        return False
    (first, _), (last, _) = link.ends()
    return any(isinstance(element, Parallelogram) for element in leg.chain[first:last])


def _pulls(lines: Sequence[Line], wrench: Array, reference: Vector) -> list[float]:
    """The pulls of lines that together come nearest to a wrench of the platform on their leg, N."""
    columns = np.array([line.wrench(reference).components() for line in lines], dtype=float).T
    return [float(pull) for pull in np.linalg.lstsq(columns, wrench, rcond=None)[0]]


def _euler(bending: float, length: float) -> float:
    """Return Euler's load of a strut between two hinges, N, from its E I in N·m² and its length in m."""
    return math.pi**2 * bending / length**2
