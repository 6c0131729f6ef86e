"""Solve for the state in which a mechanism is at rest: Newton's method, a descent or steps of the load where it fails.

Source: theory section 12. Units, axes and origin are those of `mechanism`.
"""

from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property, partial
from typing import Any

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.equilibrium.balance import Balance, State, balance, free_state, motion_of, state_after
from kinetostat.equilibrium.descent import descent_from
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.equilibrium.tangent import solve, stabilities
from kinetostat.numerics.iteration import Steps, largest, newton
from kinetostat.tolerances import AT_REST

MOST_STEPS_OF_LOAD = 25
"""Number of Newton's steps for one step of the load."""
LONGEST_STEP = 0.2
"""Motion in one iteration, rad or in units of the machine's length: beyond it, the linear equations mean little."""
LOAD_STEPS = (1, 8, 64)
"""Numbers of steps of the load: one, and more where that does not converge and no spring goes slack."""


class Rest(IntEnum):
    """Whether a machine comes to rest under its loads, and within its limits."""

    OK = 0
    NO_REST = 1
    UNSTABLE = 2
    UNDECIDED = 3
    JOINT_LIMIT = 4

    @property
    def word(self) -> str:
        """In a word, as JSON and tables have it."""
        return self.name.lower().replace("_", " ")


@dataclass(frozen=True)
class Equilibria:
    """States that were reached at n poses.

    Attributes:
        mechanism: the mechanism with its load.
        state: those that were reached.
        settled: where these are at rest [n].
    """

    mechanism: Mechanism
    state: State
    settled: Mask

    @cached_property
    def balance(self) -> Balance:
        """The equations at the states."""
        return balance(self.mechanism, self.state)

    def at(self, rows: Integers) -> Balance:
        """The equations at some of the poses [rows]."""
        return balance(self.mechanism.at(rows), self.state.at(rows))

    def with_part(self, rows: Integers, part: "Equilibria") -> "Equilibria":
        """The states with those of some of the poses [rows] in their places."""
        settled = self.settled.copy()
        settled[rows] = part.settled
        return Equilibria(self.mechanism, self.state.with_part(rows, part.state), settled)


def at_rest(mechanism: Mechanism, start: State | None = None) -> Equilibria:
    """Find the states of rest under the full load.

    Newton's steps come first. Springs that carry loads of one sign only change the stiffness when they go slack, so
    that these steps often end nowhere, or where the machine does not stay; then the potential is descended. Without
    such springs, the load is applied in steps.

    Args:
        mechanism: the mechanism with its load.
        start: a state nearby; the free state if None.
    """
    state = start or free_state(mechanism)
    reached = states_near(mechanism, state)
    if any(leg.sign.any() for leg in mechanism.legs):
        return _by_descent(mechanism, state, reached)
    for steps in LOAD_STEPS[1:]:
        rows = np.flatnonzero(~reached.settled)
        if not len(rows):
            break
        part = mechanism.at(rows)
        state_of_part = replace(free_state(part), amounts=state.amounts[rows])
        for number in range(1, steps + 1):
            solution = states_near(with_share(part, number / steps), state_of_part)
            state_of_part = solution.state
            if not solution.settled.any():
                break
        reached = reached.with_part(rows, replace(solution, mechanism=part))
    return reached


def _by_descent(mechanism: Mechanism, start: State, reached: Equilibria) -> Equilibria:
    """The states to which a descent leads where those that were reached are not at rest or not stable."""
    rows = np.flatnonzero(~(reached.settled & stabilities(reached.balance).stable))
    if not len(rows):
        return reached
    part = mechanism.at(rows)
    solution = states_near(part, descent_from(part, start.at(rows)))
    better = solution.settled & (~reached.settled[rows] | stabilities(solution.balance).stable)
    chosen = np.flatnonzero(better)
    settled = Equilibria(part.at(chosen), solution.state.at(chosen), solution.settled[chosen])
    return reached.with_part(rows[chosen], settled) if len(chosen) else reached


def with_share(mechanism: Mechanism, share: float | Array, preload: float | None = None) -> Mechanism:
    """The mechanism with a share of its loads, or with one at each pose [n], and with one of its preloads.

    Args:
        mechanism: the mechanism with all of its loads.
        share: the share of its loads.
        preload: share of its preloads; that of the loads if None.
    """

    def part(values: Array, of: float | Array) -> Array:
        return np.asarray((values.T * of).T)

    tension = share if preload is None else preload
    legs = tuple(replace(leg, preload=part(leg.preload, tension)) for leg in mechanism.legs)
    loads: dict[str, Any] = {
        name: part(getattr(mechanism, name), share) for name in ("wrench", "forces", "gravity", "growth")
    }
    return replace(mechanism, legs=legs, **loads)


def states_near(mechanism: Mechanism, start: State, most_steps: int = MOST_STEPS_OF_LOAD) -> Equilibria:
    """Find the states of rest near given ones by Newton's method, without steps of the load.

    Args:
        mechanism: the mechanism with its load.
        start: states to begin with.
        most_steps: number of steps that are taken at most.
    """
    count = len(mechanism.length)

    def equations(state: State, rows: Integers) -> tuple[Array, Steps]:
        there = balance(mechanism if len(rows) == count else mechanism.at(rows), state)
        return largest(there.left), lambda going: solve(there, -there.left[:, :, None])[going, :, 0]

    # The first step may only find what the legs carry and move nothing, so that one step alone shows nothing.
    end = newton(
        equations,
        start,
        count,
        move=partial(state_after, mechanism),
        most_steps=most_steps,
        settled=AT_REST,
        round_off=1e-3 * AT_REST,
        longest=LONGEST_STEP,
        size=partial(motion_of, mechanism),
    )
    return Equilibria(mechanism, end.value, end.converged)
