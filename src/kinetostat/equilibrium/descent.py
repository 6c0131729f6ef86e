"""Descend to a state of rest where Newton's steps do not end: a trust region on the potential, with all legs closed.

A cable that goes slack changes the stiffness at once, and Newton's steps then go back and forth, or out of reach. The
potential itself has a continuous slope, because a slack spring has the energy 0 with the slope 0. A model of it knows
which springs go slack or become taut within a step. A step is taken only if it lowers the potential by a good share of
the fall that the model foresees; else the next step is shorter. Such steps end where the slope is zero, from wherever
they begin, unless the potential falls without end.

Source: theory section 12. Units, axes and origin are those of `mechanism`.
"""

from functools import partial

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.equilibrium.balance import Balance, State, balance, potential, state_after
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.equilibrium.tangent import (
    Admissible,
    TangentMatrices,
    admissible,
    gaps_of,
    over_motions,
    tangent_matrices,
)
from kinetostat.frozen import dataclass
from kinetostat.numerics.iteration import Steps, newton
from kinetostat.tolerances import CLOSED, NEARLY_AT_REST, ZERO_PIVOT

MOST_DESCENT_STEPS = 200
"""Greatest number of steps: nine descents in ten need at most 30, and a machine that falls has fallen by 40 lengths."""
LARGEST_RADIUS = 0.2
"""Greatest radius of the trust region, rad and in units of the machine's length."""
MOST_CLOSINGS = 6
"""Greatest number of corrections that close the legs after a step; a step that needs more is too long."""
BISECTIONS = 50
"""Number of halvings in the search for the shift of the stiffness with which a step is as long as the radius: its
bounds are then 2^-50 of their first distance apart, which is nearly round-off."""
MOST_SWITCHES = 8
"""Greatest number of times that one-sided springs switch between carrying and slack within a step; what switches on
after that is left to the next step."""
WIDENING = 2.0
"""Radius in lengths of the last step, after one that fell as foreseen; usual for trust regions, as the next three."""
NARROWING = 0.25
"""Radius in lengths of the last step, after one that is not taken."""
LEAST_SHARE = 0.1
"""Share of the foreseen fall of the potential from which a step is taken."""
GOOD_SHARE = 0.75
"""Share of the foreseen fall from which the radius may grow."""


def descent_from(mechanism: Mechanism, start: State) -> State:
    """Descend to where the slope of the potential is nearly zero, or as far as the steps go.

    Args:
        mechanism: the mechanism with its load.
        start: the state to begin with; its legs need not be closed.

    Returns:
        The states that were reached; Newton's method, started there, decides whether they are states of rest.
    """
    state, closed = _closed_state(mechanism, start)
    radius = np.full(len(mechanism.length), LARGEST_RADIUS)
    rows = np.flatnonzero(closed)
    for _ in range(MOST_DESCENT_STEPS):
        if not len(rows):
            break
        part = mechanism.at(rows)
        step = _step_within(part, state.at(rows), radius[rows])
        before = step.equations.state
        after, closed = _closed_state(part, state_after(part, before, step.unknowns))
        fall = potential(part, before, before.platform) - potential(part, after, before.platform)
        share = np.where(closed, fall, -1.0) / np.maximum(step.fall, ZERO_PIVOT)
        is_taken = share > LEAST_SHARE
        wider = np.where(share > GOOD_SHARE, np.maximum(radius[rows], WIDENING * step.size), radius[rows])
        radius[rows] = np.where(is_taken, np.minimum(wider, LARGEST_RADIUS), NARROWING * step.size)
        state = state.with_part(rows, before).with_part(rows[is_taken], after.at(np.flatnonzero(is_taken)))
        rows = rows[step.size > NEARLY_AT_REST]
    return state


def _closed_state(mechanism: Mechanism, start: State) -> tuple[State, Mask]:
    """The state with its legs closed by small motions, and whether they were closed [n]."""
    count = len(mechanism.length)

    def equations(state: State, rows: Integers) -> tuple[Array, Steps]:
        evaluated = balance(mechanism if len(rows) == count else mechanism.at(rows), state)
        return gaps_of(evaluated), lambda unsolved: _closing_steps(evaluated)[unsolved]

    end = newton(
        equations, start, count, move=partial(state_after, mechanism), most_steps=MOST_CLOSINGS, residual_goal=CLOSED
    )
    return end.value, end.converged


def _closing_steps(equations: Balance) -> Array:
    """The least motions that close the legs to first order, as steps of the unknowns [n x unknowns]."""
    unknowns, places = np.zeros_like(equations.residual), equations.mechanism.unknown_places
    moving, carried = places.motions, places.all_wrenches
    for part in admissible(equations, tangent_matrices(equations).closing):
        motion = part.closing_inverse @ equations.residual[part.rows][:, carried, None]
        unknowns[part.rows[:, None], moving] = -motion[:, :, 0]
    return unknowns


@dataclass(frozen=True)
class _Step:
    """A step from states with closed legs to a low point of the model of the potential.

    Attributes:
        equations: the equations at these states, with wrenches that balance everything but the admissible motions.
        unknowns: the step of the unknowns [n x unknowns].
        size: size of the admissible motion; NaN where it is not known [n].
        fall: fall of the potential that the model foresees [n].
    """

    equations: Balance
    unknowns: Array
    size: Array
    fall: Array


def _step_within(mechanism: Mechanism, state: State, radius: Array) -> _Step:
    """The step within a radius [n] to the lowest point that the model has there."""
    equations, places = balance(mechanism, state), mechanism.unknown_places
    moving, carried = places.motions, places.all_wrenches
    parts = list(admissible(equations, tangent_matrices(equations).closing))
    balancing = np.zeros_like(equations.residual)
    for part in parts:
        residual = equations.residual[part.rows][:, moving, None]
        balancing[part.rows[:, None], carried] = (part.closing_inverse.mT @ residual)[:, :, 0]
    equations = balance(mechanism, state_after(mechanism, state, balancing))
    matrices = tangent_matrices(equations)
    unknowns = np.zeros_like(balancing)
    size, fall = np.full((2, len(radius)), np.nan)
    for part in parts:
        model = _model(equations, matrices, part)
        step, fall[part.rows] = model.lowest_point(radius[part.rows])
        # A step without a fall counts as long as the radius, which then becomes smaller.
        size[part.rows] = np.where(fall[part.rows] > 0.0, np.linalg.norm(step, axis=1), radius[part.rows])
        unknowns[part.rows[:, None], moving] = (part.motions @ step[:, :, None])[:, :, 0]
    return _Step(equations, unknowns, size, fall)


@dataclass(frozen=True)
class _Model:
    """The potential near closed states over the admissible motions y: -f y + y K y / 2, and one-sided springs.

    A one-sided spring adds the square of its load over twice its stiffness while its load is positive, else nothing.

    Attributes:
        stiffness: K without one-sided springs [n x m x m].
        force: f without one-sided springs [n x m].
        lines: elongation of each one-sided spring per unit of each motion [n x springs x m].
        loads: the load of each, as if it carried both ways; it carries where that is positive [n x springs].
        springs: the stiffness of each [n x springs].
    """

    stiffness: Array
    force: Array
    lines: Array
    loads: Array
    springs: Array

    def change(self, step: Array) -> Array:
        """Change of the potential by a step [n x m], negative if it falls [n]."""
        smooth = -(self.force * step).sum(axis=1) + 0.5 * np.einsum("ni,nij,nj->n", step, self.stiffness, step)
        before, after = (np.maximum(loads, 0.0) for loads in (self.loads, self.loads_after(step)))
        return np.asarray(smooth + (0.5 * (after - before) * (after + before) / self.springs).sum(axis=1))

    def loads_after(self, step: Array) -> Array:
        """`loads` after a step [n x m]."""
        return np.asarray(self.loads + self.springs * np.einsum("nsm,nm->ns", self.lines, step))

    def lowest_point(self, radius: Array) -> tuple[Array, Array]:
        """The lowest point found within a radius [n]: the step to it [n x m], and the fall of the potential [n].

        Each point tried is the lowest one if the springs carry that carried at the point before.
        """
        carries = self.loads >= 0.0
        best, fall = np.zeros_like(self.force), np.zeros(len(radius))
        for _ in range(MOST_SWITCHES):
            springs = np.where(carries, self.springs, 0.0)
            stiffness = self.stiffness + np.einsum("nsi,ns,nsj->nij", self.lines, springs, self.lines)
            force = self.force - np.einsum("ns,nsi->ni", np.where(carries, self.loads, 0.0), self.lines)
            step = least_within(stiffness, force, radius)
            fall_of_step = -self.change(step)
            best, fall = np.where((fall_of_step > fall)[:, None], step, best), np.maximum(fall_of_step, fall)
            last, carries = carries, self.loads_after(step) >= 0.0
            if (last == carries).all():
                break
        return best, fall


def _model(equations: Balance, matrices: TangentMatrices, part: Admissible) -> _Model:
    """The model of the potential at those poses whose admissible motions these are."""
    mechanism = equations.mechanism
    elastic, geometric = matrices.elastic[part.rows], matrices.geometric[part.rows]
    residual = equations.residual[part.rows][:, mechanism.unknown_places.motions]
    lines, loads, springs = [], [], []
    moving_places = mechanism.motion_places.coordinates
    for leg, coordinates, moving in zip(mechanism.legs, equations.state.coordinates, moving_places, strict=True):
        for i in np.flatnonzero(leg.sign):
            place = moving.start + i
            loads.append((leg.sign[i] * (leg.stiffness[:, i] * coordinates[:, i] + leg.preload[:, i]))[part.rows])
            springs.append(leg.stiffness[part.rows, i])
            lines.append(leg.sign[i] * part.motions[:, place])
            elastic[:, place, place] = 0.0
            residual[:, place] -= leg.sign[i] * np.maximum(loads[-1], 0.0)
    force = -(part.motions.mT @ residual[:, :, None])[:, :, 0]
    columns = [np.stack(column, axis=1) for column in (lines, loads, springs) if column]
    nothing = np.zeros((len(part.rows), 0))
    no_springs = (np.zeros((len(part.rows), 0, part.motions.shape[2])), nothing, nothing)
    return _Model(over_motions(elastic + geometric, part.motions), force, *(columns or no_springs))


def least_within(stiffness: Array, force: Array, radius: Array) -> Array:
    """Find the y within a radius at which -f y + y K y / 2 is least [n x m].

    It solves (K + s) y = f with the least shift s >= 0 that leaves no negative eigenvalue and no y beyond the radius.
    If the potential falls to both sides of a direction in which there is no force, y goes to neither side.

    Args:
        stiffness: K, symmetric, with eigenvalues of any sign [n x m x m].
        force: f [n x m].
        radius: greatest size of y [n].

    Source: J. Moré and D. Sorensen, "Computing a trust region step", SIAM J. Sci. Stat. Comput. 4, 1983.
    """
    values, vectors = np.linalg.eigh(stiffness)
    parts = np.einsum("nij,ni->nj", vectors, force)
    least_shift = np.maximum(0.0, -values[:, 0])
    largest_shift = least_shift + np.linalg.norm(parts, axis=1) / radius

    def solution(shift: Array) -> Array:
        return parts / np.maximum(values + shift[:, None], ZERO_PIVOT)

    is_inside = np.linalg.norm(solution(least_shift), axis=1) <= radius
    largest_shift = np.where(is_inside, least_shift, largest_shift)
    for _ in range(BISECTIONS):
        middle = 0.5 * (least_shift + largest_shift)
        is_short = np.linalg.norm(solution(middle), axis=1) <= radius
        least_shift, largest_shift = np.where(is_short, least_shift, middle), np.where(is_short, middle, largest_shift)
    return np.einsum("nij,nj->ni", vectors, solution(largest_shift))
