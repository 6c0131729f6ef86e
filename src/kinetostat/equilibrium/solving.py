"""States of rest of a mechanism: how they are found, by Newton's method or a descent, and whether they are stable.

Source: theory section 12; theory (40) for stability. Units, axes and origin are those of `mechanism`.
"""

from dataclasses import replace
from enum import IntEnum
from functools import cached_property, partial

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.equilibrium.balance import Balance, State, balance, free_state, motion_of, state_after
from kinetostat.equilibrium.descent import descent_from
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.equilibrium.tangent import (
    admissible,
    finite_poses,
    holds_all,
    over_motions,
    solve_at_rest,
    spring_factor,
    tangent_matrices,
)
from kinetostat.frozen import dataclass
from kinetostat.numerics.iteration import Steps, largest, newton
from kinetostat.numerics.motions import logarithm
from kinetostat.tolerances import AT_REST, ROUND_OFF_AT_REST, UNRESISTED, ZERO_PIVOT

MOST_STEPS_OF_LOAD = 25
"""Number of Newton's steps for one step of the load."""
LONGEST_STEP = 0.2
"""Motion in one iteration, rad or in units of the machine's length: beyond it, the linear equations mean little."""
FEW_STEPS = 8
"""Number of Newton's steps that lead to a state nearby; where more are needed, or one is shortened, they wander, and
round-off decides which state they meet."""
FIRST_LOAD_STEP = 0.125
"""The first step, as a share of all loads, by which these grow where Newton's steps wander."""
LEAST_LOAD_STEP = 1e-5
"""Step of the loads, as a share of all of them, below which the state counts as lost."""
MOST_LOAD_STEPS = 60
"""Number of tries with which a state is followed: a machine that moves very far before it is lost takes seconds."""
MISSED_BY_TANGENTS = 0.5
"""Share of its motion by which a step may miss what the tangents at its ends foresee: where it misses more, the state
has snapped over, or the step is too long."""
LONGEST_PLATFORM_STEP = 0.3
"""Motion of the platform in a step of the loads, rad or in units of the machine's length."""


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
        state: the states that were reached.
        settled: whether each of them is at rest [n].
        sure: whether it is, and no other state could have been reached but for a large change of what is given [n].
    """

    mechanism: Mechanism
    state: State
    settled: Mask
    sure: Mask

    @cached_property
    def balance(self) -> Balance:
        """The equations at the states."""
        return balance(self.mechanism, self.state)

    def at(self, rows: Integers) -> Balance:
        """The equations at some of the poses [rows]."""
        return balance(self.mechanism.at(rows), self.state.at(rows))

    def with_part(self, rows: Integers, part: "Equilibria") -> "Equilibria":
        """The states with those of some of the poses [rows] in their places."""
        settled, sure = self.settled.copy(), self.sure.copy()
        settled[rows], sure[rows] = part.settled, part.sure
        return Equilibria(self.mechanism, self.state.with_part(rows, part.state), settled, sure)

    def some(self, rows: Integers) -> "Equilibria":
        """The states at some of the poses [rows]."""
        return Equilibria(self.mechanism.at(rows), self.state.at(rows), self.settled[rows], self.sure[rows])


def at_rest(mechanism: Mechanism, start: State | None = None) -> Equilibria:
    """Find the states of rest under the full load.

    Newton's steps come first. Where they wander, it would be round-off that chooses among the states that they may
    meet, stable or not: then the state is followed while all loads grow from nothing, and where it is lost, the
    potential is descended from there, which leads to where the machine snaps over. Springs that carry loads of one sign
    only change the stiffness when they go slack, so that Newton's steps often wander; then the potential is descended
    from the beginning.

    Args:
        mechanism: the mechanism with its load.
        start: a state nearby; the free state if None.
    """
    state = start or free_state(mechanism)
    reached = states_near(mechanism, state)
    if any(leg.sign.any() for leg in mechanism.legs):
        return _by_descent(mechanism, state, reached)
    rows = np.flatnonzero(~reached.sure)
    if not len(rows):
        return reached
    part = mechanism.at(rows)
    followed = _follow_loads(part, replace(free_state(part), amounts=state.amounts[rows]))
    lost = np.flatnonzero(~followed.settled)
    if len(lost):
        fallen = states_near(part.at(lost), descent_from(part.at(lost), followed.state.at(lost)))
        followed = followed.with_part(lost, replace(fallen, settled=fallen.sure))
    return reached.with_part(rows, followed)


def _follow_loads(mechanism: Mechanism, state: State) -> Equilibria:
    """Follow states while all loads grow from nothing: to rest under all of them, or as far as they go."""
    count = len(mechanism.length)
    share, step, rows = np.zeros(count), np.full(count, FIRST_LOAD_STEP), np.arange(count)
    for _ in range(MOST_LOAD_STEPS):
        part, start = mechanism.at(rows), state.at(rows)
        next_share = np.minimum(share[rows] + step[rows], 1.0)
        before, after = with_share(part, share[rows]), with_share(part, next_share)
        solution = states_near(after, start, FEW_STEPS)
        sure = np.flatnonzero(solution.sure)
        nearby = solution.sure.copy()
        nearby[sure] = are_near(before.at(sure), start.at(sure), after.at(sure), solution.state.at(sure))
        accepted = np.flatnonzero(nearby)
        state = state.with_part(rows[accepted], solution.state.at(accepted))
        share[rows] = np.where(nearby, next_share, share[rows])
        step[rows] *= np.where(nearby, 2.0, 0.25)
        rows = rows[(share[rows] < 1.0) & (step[rows] > LEAST_LOAD_STEP)]
        if not len(rows):
            break
    stands: Mask = np.asarray(share == 1.0)
    return Equilibria(mechanism, state, stands, stands)


def are_near(before: Mechanism, start: State, after: Mechanism, end: State) -> Mask:
    """Return which states have moved as the tangents at the start and at the end predict, or in between [n].

    Where a cable goes slack on the way, the one holds up to there and the other one from there.

    Args:
        before, after: the mechanism with the loads of the start and of the end.
        start, end: the states.
    """
    ahead, behind = (states_near(loads, state, 1).state for loads, state in ((after, start), (before, end)))
    pairs = ((ahead, start), (end, behind), (end, start))
    by_start, by_end, motion = (logarithm(a.platform @ b.platform.inverse()) for a, b in pairs)
    difference = by_end - by_start
    squares = np.maximum((difference * difference).sum(axis=1), ZERO_PIVOT)
    share = ((motion - by_start) * difference).sum(axis=1) / squares
    foreseen = by_start + np.clip(share, 0.0, 1.0)[:, None] * difference
    size, error = np.abs(motion).max(axis=1), np.abs(motion - foreseen).max(axis=1)
    return np.asarray((size <= LONGEST_PLATFORM_STEP) & (error <= MISSED_BY_TANGENTS * size + AT_REST))


def _by_descent(mechanism: Mechanism, start: State, reached: Equilibria) -> Equilibria:
    """The states to which a descent leads where those that were reached are not surely at rest, or not stable."""
    rows = np.flatnonzero(~(reached.sure & stabilities(reached.balance).stable))
    if not len(rows):
        return reached
    part = mechanism.at(rows)
    solution = states_near(part, descent_from(part, start.at(rows)))
    better = solution.settled & (~reached.settled[rows] | stabilities(solution.balance).stable)
    chosen = np.flatnonzero(better)
    return reached.with_part(rows[chosen], solution.some(chosen)) if len(chosen) else reached


def with_share(mechanism: Mechanism, share: float | Array, preload: float | None = None) -> Mechanism:
    """The mechanism with a share of its loads, or with one at each pose [n], and with one of its preloads.

    Args:
        mechanism: the mechanism with all of its loads.
        share: the share of its loads.
        preload: share of its preloads; that of the loads if None.
    """

    def scale(values: Array, factor: float | Array) -> Array:
        return np.asarray((values.T * factor).T)

    of_preload = share if preload is None else preload
    return replace(
        mechanism,
        legs=tuple(replace(leg, preload=scale(leg.preload, of_preload)) for leg in mechanism.legs),
        wrench=scale(mechanism.wrench, share),
        forces=scale(mechanism.forces, share),
        gravity=scale(mechanism.gravity, share),
        growth=scale(mechanism.growth, share),
    )


def newton_step(equations: Balance, loaded: bool = True) -> Array:
    """Return the step of Newton's method from a state, as a step of the unknowns [n x unknowns]; `loaded` as there."""
    return solve_at_rest(equations, -equations.residual[:, :, None], loaded)[:, :, 0]


def states_near(mechanism: Mechanism, start: State, most_steps: int = MOST_STEPS_OF_LOAD) -> Equilibria:
    """Find the states of rest near given ones by Newton's method, without steps of the load.

    Args:
        mechanism: the mechanism with its load.
        start: states to begin with.
        most_steps: number of steps that are taken at most.
    """
    count = len(mechanism.length)

    def equations(state: State, rows: Integers) -> tuple[Array, Steps]:
        evaluated = balance(mechanism if len(rows) == count else mechanism.at(rows), state)
        return largest(evaluated.residual), lambda unsolved: newton_step(evaluated)[unsolved]

    # The first step may only find what the legs carry and move nothing, so that one step alone shows nothing.
    end = newton(
        equations,
        start,
        count,
        move=partial(state_after, mechanism),
        most_steps=most_steps,
        step_goal=AT_REST,
        round_off=ROUND_OFF_AT_REST,
        longest_step=LONGEST_STEP,
        size=partial(motion_of, mechanism),
    )
    sure = end.converged & (end.steps <= FEW_STEPS) & (end.longest_step <= LONGEST_STEP)
    return Equilibria(mechanism, end.value, end.converged, sure)


@dataclass(frozen=True)
class Stability:
    """Whether a state of rest holds, and how much more of its load it could hold.

    Attributes:
        stable: whether every small disturbance comes back.
        factor: the factor by which the load may grow until one does not, if wrenches grow in proportion; infinite if
            none does, NaN where springs alone hold nothing.
        mode: twist of the platform in that disturbance, at the origin; its largest component is 1 [6].
        legs: the largest motion of each leg's coordinates in it, of the same scale [legs].
    """

    stable: bool
    factor: float
    mode: Array
    legs: Array


@dataclass(frozen=True)
class Stabilities:
    """Stability of n states of rest: the fields of `Stability` as arrays with the poses first."""

    stable: Mask
    factor: Array
    mode: Array
    legs: Array

    def at(self, pose: int) -> Stability:
        """Return the stability of one of the states."""
        return Stability(bool(self.stable[pose]), float(self.factor[pose]), self.mode[pose], self.legs[pose])


def stability(equations: Balance) -> Stability:
    """Judge the state of rest at a single pose."""
    return stabilities(equations).at(0)


def stabilities(equations: Balance) -> Stabilities:
    """Judge n states of rest; what is not finite is not stable."""
    ways, places = equations.mechanism.ways, equations.mechanism.motion_places
    elastic, geometric, closing = tangent_matrices(equations)
    sound = finite_poses(elastic + geometric) & finite_poses(closing)
    stable: Mask = np.array(sound)
    factors, modes = np.where(sound, np.inf, np.nan), np.zeros((len(sound), places.count))
    for part in admissible(equations, closing, np.flatnonzero(sound)):
        rows, allowed = part.rows, part.motions
        if not allowed.size:  # nothing can move at all
            continue
        stiff, turning = (over_motions(matrix[rows], allowed) for matrix in (elastic, geometric))
        springs = spring_factor(equations, part)
        holds = holds_all(springs)
        whitening = np.linalg.inv(np.where(holds[:, None, None], springs, np.eye(springs.shape[1])))
        # K_e + factor K_g is singular at factor = 1/share, so that the largest share decides.
        shares, vectors = np.linalg.eigh(-whitening.mT @ turning @ whitening)
        # Where springs hold every motion, those much softer than others would be lost in the sum of both matrices.
        stable[rows] = np.where(holds, shares[:, -1] < 1.0, np.linalg.eigvalsh(stiff + turning)[:, 0] > 0.0)
        grows = holds & (shares[:, -1] > UNRESISTED)
        factors[rows] = np.where(grows, 1.0 / np.where(grows, shares[:, -1], 1.0), np.where(holds, np.inf, np.nan))
        motions = (allowed @ whitening @ vectors[:, :, -1:])[:, :, 0]
        modes[rows] = np.where(grows[:, None], motions / np.abs(motions).max(axis=1, keepdims=True), 0.0)
    legs = [np.abs(modes[:, moving]).max(axis=1, initial=0.0) for moving in places.coordinates]
    return Stabilities(
        stable=stable,
        factor=factors,
        mode=modes[:, places.platform] @ ways.T,
        legs=np.stack(legs, axis=1) if legs else np.zeros((len(sound), 0)),
    )
