"""Iterations over many problems at once: Newton's method, and damped least squares. The equations are stated elsewhere.

Each problem of a batch goes its own way and ends by itself, so that its result does not depend on the others. Problems
that have ended cost no more time. `least_norm` gives a single step where linear equations have many solutions.

Source: Newton's method and its criteria: P. Deuflhard, Newton Methods for Nonlinear Problems (2011), sections 1.4 and
2.1; E. Hairer and G. Wanner, Solving Ordinary Differential Equations II (1996), section IV.8. Damped least squares:
D. Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", J. SIAM 11, 1963. Least norm:
G. Golub and C. Van Loan, Matrix Computations (2013), sections 5.5 and 6.1.4.
"""

from collections.abc import Callable
from enum import IntEnum
from operator import add
from typing import Any, Generic, Protocol, Self, TypeVar

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.tolerances import LEAST_DIVISOR, LEAST_NORM_DAMPING

SHRINKING = 0.1
"""Ratio of a step to the one before it below which steps shrink fast, as those of Newton's method near a solution."""
FIRST_DAMPING = 1e-3
"""Damping of the first step of least squares as a share of the mean square of the rates: it is hardly any, so that this
step is Newton's near a solution."""
LEAST_DAMPING = 1e-14
"""Share to which damping may fall: round-off beside the rates, but enough for unknowns that change nothing."""
MOST_DAMPING = 1e6
"""Share at which a problem is given up: steps are then a millionth of the gradient, and still lead no nearer."""
DAMPING_CHANGE = 10.0
"""Factor by which damping becomes less after a step that has led nearer, and more after another one."""


class Ending(IntEnum):
    """End of an iteration."""

    CONVERGED = 0
    DIVERGED = 1
    OUT_OF_STEPS = 2

    @property
    def sentence(self) -> str:
        """A sentence for people."""
        return _SENTENCES[self]


_SENTENCES = {
    Ending.CONVERGED: "The equations are solved, or further steps change nothing but round-off.",
    Ending.DIVERGED: "A step has not led nearer to a solution, or its numbers are not finite.",
    Ending.OUT_OF_STEPS: "The last step that was allowed still changed something.",
}
"""Sentences on the ends of an iteration, for people."""


class Batch(Protocol):
    """Values of the unknowns of n problems that are more than one array."""

    def at(self, rows: Integers) -> Self:
        """Return the values of some of the problems."""

    def with_part(self, rows: Integers, part: Self) -> Self:
        """Return the values with those of some of the problems in their places."""


Value = TypeVar("Value", bound=Array | Batch)
"""An array with the problems first, or a `Batch`."""
Steps = Callable[[Integers], Array]
"""From the numbers of some problems to Newton's steps of their unknowns [problems x unknowns]."""


@dataclass(frozen=True)
class Solution(Generic[Value]):
    """Results of an iteration for n problems.

    Attributes:
        value: the unknowns that were reached; where a problem has diverged, those before the step that did not lead
            nearer.
        outcome: `Ending` codes [n].
        residual: the largest residual of each problem where it was evaluated last [n].
        steps: number of steps that were taken [n].
        longest_step: size of the longest step, before it was shortened [n]; 0 where sizes of steps are not measured.
    """

    value: Value
    outcome: Integers
    residual: Array
    steps: Integers
    longest_step: Array

    @property
    def converged(self) -> Mask:
        """Whether each problem has converged [n]."""
        return np.asarray(self.outcome == Ending.CONVERGED)

    def __repr__(self) -> str:
        counts = [f"{int((self.outcome == end).sum())}: {end.sentence}" for end in Ending if end in self.outcome]
        return (
            f"<Solution of {len(self.outcome)} problems in up to {self.steps.max(initial=0)} steps. {' '.join(counts)}>"
        )


def largest(numbers: Array) -> Array:
    """Return the largest size of a number in each row [n x m]; infinity where one is not finite."""
    result = np.abs(numbers).max(axis=1, initial=0.0)
    return np.where(np.isfinite(result), result, np.inf)


def with_rows(values: Array, rows: Integers, part: Array) -> Array:
    """Return an array with other values in some of its rows."""
    result = values.copy()
    result[rows] = part
    return result


def newton(
    equations: Callable[[Value, Integers], tuple[Array, Steps]],
    start: Value,
    count: int,
    *,
    most_steps: int,
    move: Callable[[Value, Array], Value] = add,
    residual_goal: float | Array = 0.0,
    contraction: float = np.inf,
    step_goal: float = 0.0,
    round_off: float | None = None,
    longest_step: float = np.inf,
    size: Callable[[Array], Array] = largest,
) -> Solution[Value]:
    """Solve n problems by Newton's method.

    A problem has converged by its residual or by its steps. It has diverged where a residual has not become less as it
    should, or where numbers are not finite. The step by which it is seen to have converged is taken as well.

    Args:
        equations: function from the unknowns of some problems, and their numbers, to their largest residuals and a
            function that makes Newton's steps for some of these.
        start: unknowns to begin with.
        count: number of problems, n.
        most_steps: number of steps that are taken at most.
        move: function from unknowns and a step to the unknowns after it.
        residual_goal: residual at which a problem has converged, one for all or each its own [n].
        contraction: share of the residual before it that a step may leave.
        step_goal: size of a step below which a problem has converged.
        round_off: if given, steps that still shrink fast are continued until the next one, which is foreseen from the
            last two as their quadratic convergence has it, would be as small as that.
        longest_step: size to which a longer step is shortened.
        size: function that measures steps [n x unknowns]; the largest number if not given.
    """
    # `rows` are the numbers of the problems that are open, and `trial` are their unknowns that are tried next. What
    # follows from these (`trial_residual`, `step`, `length`) has a row for each open problem, all else for each of n.
    trial, rows = start, np.arange(count)
    value, residual, residual_goals = start, np.full(count, np.inf), np.broadcast_to(residual_goal, (count,))
    outcome, steps = np.full(count, int(Ending.OUT_OF_STEPS)), np.zeros(count, dtype=np.int64)
    last_length, longest = np.full(count, np.inf), np.zeros(count)
    for number in range(1, most_steps + 1):
        trial_residual, steps_of = equations(trial, rows)
        solved = trial_residual <= residual_goals[rows]
        nearer = solved | (trial_residual < contraction * residual[rows])
        outcome[rows[solved]], outcome[rows[~nearer]] = Ending.CONVERGED, Ending.DIVERGED
        value, residual[rows[nearer]] = _with_part(value, rows, trial, nearer), trial_residual[nearer]
        unsolved = np.flatnonzero(nearer & ~solved)
        trial, rows = _at(trial, unsolved, len(rows)), rows[unsolved]
        if not rows.size:
            break
        step = steps_of(unsolved)
        length = size(step)
        finite = np.isfinite(length)
        arrived = length < step_goal
        if round_off is not None:
            arrived = _foreseen_end(length, last_length[rows], arrived, round_off) & (number > 1)
        outcome[rows[arrived]], outcome[rows[~finite]] = Ending.CONVERGED, Ending.DIVERGED
        last_length[rows], steps[rows], longest[rows] = length, number, np.maximum(longest[rows], length)
        if (length > longest_step).any():
            step = step * np.minimum(1.0, longest_step / np.maximum(length, LEAST_DIVISOR))[:, None]
        trial = move(trial, step)
        value = _with_part(value, rows, trial, arrived)
        still_open = np.flatnonzero(finite & ~arrived)
        trial, rows = _at(trial, still_open, len(rows)), rows[still_open]
        if not rows.size:
            break
    # Problems that are open after the last step keep what it has led to.
    value = _with_part(value, rows, trial, np.ones(len(rows), dtype=bool))
    return Solution(value=value, outcome=outcome, residual=residual, steps=steps, longest_step=longest)


def _foreseen_end(length: Array, last_length: Array, arrived: Mask, round_off: float) -> Mask:
    """Whether the next step would be round-off, as quadratic convergence foresees it from this one and the last [n].

    Where steps do not shrink fast, nothing is foreseen, and `arrived` decides.
    """
    ratio = length / np.maximum(last_length, LEAST_DIVISOR)
    return np.where(ratio < SHRINKING, length * ratio * ratio <= round_off, arrived)


def _at(value: Value, places: Integers, count: int) -> Value:
    """The values of some of `count` problems, by ascending places; the value itself where that is all of them."""
    if len(places) == count:
        return value
    part: Any = value[places] if isinstance(value, np.ndarray) else value.at(places)
    return part


def _with_part(value: Value, rows: Integers, part: Any, chosen: Mask) -> Value:
    """Put the chosen ones among the unknowns of some problems, whose numbers are `rows`, into their places."""
    places = np.flatnonzero(chosen)
    if not len(places):
        return value
    if not isinstance(value, np.ndarray):
        return value.with_part(rows[places], part.at(places))
    changed: Any = with_rows(value, rows[places], part[places])
    return changed


def least_squares(
    equations: Callable[[Array, Integers], tuple[Array, Array]],
    start: Array,
    *,
    most_steps: int,
    residual_goal: float,
    acceptable_residual: float,
) -> Solution[Array]:
    """Solve n problems by damped least squares, whose steps are Newton's near a solution and go downhill far from one.

    A step is taken where it makes the sum of squares less. Damping follows: it becomes less after such a step, and more
    after another one.

    Args:
        equations: function from the unknowns of some problems [k x unknowns], and their numbers, to the residuals of
            the equations [k x m] and the rates at which the unknowns reduce them [k x m x unknowns].
        start: unknowns to begin with [n x unknowns].
        most_steps: number of steps that are tried at most.
        residual_goal: residual at which a problem has converged.
        acceptable_residual: residual below which it has converged as well if a step leads no nearer: round-off is left.
    """
    value, count = start.copy(), len(start)
    residuals, rates = equations(value, np.arange(count))
    damping, steps = np.full(count, FIRST_DAMPING), np.zeros(count, dtype=np.int64)
    is_open = np.asarray(np.isfinite(residuals).all(axis=1) & np.isfinite(rates).all(axis=(1, 2)))
    outcome = np.where(is_open, int(Ending.OUT_OF_STEPS), int(Ending.DIVERGED))
    for _ in range(most_steps if value.shape[1] else 0):
        rows = np.flatnonzero(is_open)
        if not rows.size:
            break
        trial = value[rows] + damped_steps(residuals[rows], rates[rows], damping[rows])
        trial_residuals, trial_rates = equations(trial, rows)
        nearer = (trial_residuals**2).sum(axis=1) < (residuals[rows] ** 2).sum(axis=1)
        nearer &= np.isfinite(trial_rates).all(axis=(1, 2))
        better = rows[nearer]
        value[better], residuals[better], rates[better] = trial[nearer], trial_residuals[nearer], trial_rates[nearer]
        steps[rows] += 1
        change = np.where(nearer, 1.0 / DAMPING_CHANGE, DAMPING_CHANGE)
        damping[rows] = np.clip(damping[rows] * change, LEAST_DAMPING, MOST_DAMPING)
        residual = largest(residuals[rows])
        solved = (residual <= residual_goal) | (~nearer & (residual < acceptable_residual))
        stuck = ~solved & ~(damping[rows] < MOST_DAMPING)
        outcome[rows[solved]], outcome[rows[stuck]] = Ending.CONVERGED, Ending.DIVERGED
        is_open[rows] = ~solved & ~stuck
    return Solution(
        value=value, outcome=outcome, residual=largest(residuals), steps=steps, longest_step=np.zeros(count)
    )


def damped_steps(residuals: Array, rates: Array, damping: Array) -> Array:
    """Return steps of damped least squares [n x unknowns].

    Args:
        residuals: residuals of the equations [n x m].
        rates: rates at which the unknowns reduce them [n x m x unknowns].
        damping: share of the mean square of the rates that is added to their squares [n].
    """
    back = np.swapaxes(rates, 1, 2)
    square = back @ rates
    mean = np.trace(square, axis1=1, axis2=2) / square.shape[1] + LEAST_DIVISOR
    square = square + (damping * mean)[:, None, None] * np.eye(square.shape[1])
    return np.asarray(np.linalg.solve(square, back @ residuals[:, :, None])[:, :, 0])


def least_norm(rates: Array, gaps: Array) -> Array:
    """Least-squares solutions x of rates x = gaps, of least norm where equations leave x open; NaN where not finite.

    They come from a damping so small that it changes only what the equations leave open. This takes a fraction of the
    time of singular values, which give the same solutions.

    Args:
        rates: [problems x rows x unknowns].
        gaps: [problems x rows].

    Returns:
        The solutions [problems x unknowns].
    """
    finite = np.isfinite(rates).all(axis=(1, 2)) & np.isfinite(gaps).all(axis=1)
    if not finite.all():  # one problem with NaN would spoil the linear algebra of all
        solutions = np.full((len(rates), rates.shape[2]), np.nan)
        if finite.any():
            solutions[finite] = least_norm(rates[finite], gaps[finite])
        return solutions
    transposed = np.swapaxes(rates, 1, 2)
    if rates.shape[2] >= rates.shape[1]:
        multipliers = np.linalg.solve(with_damping(rates @ transposed), gaps[:, :, None])
        return np.asarray((transposed @ multipliers)[:, :, 0])
    return np.asarray(np.linalg.solve(with_damping(transposed @ rates), transposed @ gaps[:, :, None])[:, :, 0])


def with_damping(squares: Array) -> Array:
    """Add `LEAST_NORM_DAMPING` times their trace to the diagonals of squared rates, so that these can be inverted.

    Args:
        squares: a product J^T J or J J^T of rates J for each problem [problems x n x n].
    """
    trace = np.trace(squares, axis1=1, axis2=2)[:, None, None]
    return np.asarray(squares + LEAST_NORM_DAMPING * (trace + LEAST_DIVISOR) * np.eye(squares.shape[1]))
