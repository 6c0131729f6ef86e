"""Tolerances of least cost for a wanted error: which lines of [tolerances] to tighten, and which to loosen.

The cost of a toleranced number is inversely proportional to its tolerance: half of the tolerance costs twice as much.
All numbers of a line change together, by one factor.

Source: theory (54).
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import minimize

from kinetostat.accuracy.toleranced_parts import RandomInputs, TolerancedPart
from kinetostat.accuracy.tool_error import Measures
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.spec.immutable import ImmutableAnswer

ALLOCATION_RULES = {"rss": 2, "worst": 1}
"""Rules by which errors of parts add up, each with the power in which they do: the root of the sum of squares, and the
sum of sizes."""
MOST_DECIDING_POSES = 40
"""Greatest number of poses that decide an allocation together: each is added because it exceeds the wanted error."""
ALLOWED_EXCESS = 1e-9
"""Share of the wanted error by which a pose may exceed it by round-off of the search."""
SEARCH_OPTIONS = {"maxiter": 500, "ftol": 1e-14}
"""The search ends where the cost changes by round-off alone, or after many times the steps that it needs."""


@dataclass(frozen=True, eq=False)
class Allocation(ImmutableAnswer):
    """Tolerances of least cost.

    Attributes:
        measure: the error that is limited, "position" or "along".
        by: rule by which errors add up, a key of `ALLOCATION_RULES`.
        wanted: the error that is not exceeded, m.
        present: the error with the present tolerances, m, at the pose where it is largest.
        lines: the subject of each line.
        factors: factors of the tolerances of each line; infinite if they have no effect.
        costs: present cost of each line; with a factor f it is costs / f.
        cost, before: sum of the costs with the new and with the present tolerances.
        evenly: cost of the same error if all tolerances change by one factor.
    """

    measure: str
    by: str
    wanted: float
    present: float
    lines: tuple[str, ...]
    factors: Array
    costs: Array
    cost: float
    before: float
    evenly: float


def effects_of_limits(inputs: RandomInputs, measures: Measures, measure: str) -> dict[str, Array]:
    """Return what the limits of each part alone do to a measure, by rule [n x parts].

    Both are what the rule adds up: the square of the motion of the tool, m², for "rss", its size, m, for "worst". A
    joint that a load presses to one side counts with its whole clearance, twice the limit to one side.
    """
    rows = measures.linear(inputs.columns)[:, measures.row_numbers(measure)]
    squares = (rows**2).sum(axis=1) * np.where(inputs.pressed[:, inputs.owner], 4.0, 1.0)
    squares_of_parts = np.zeros((len(rows), len(inputs.parts)))
    np.add.at(squares_of_parts.T, inputs.owner, squares.T)
    sizes_of_parts = np.zeros_like(squares_of_parts)
    for number, pressed in enumerate(inputs.pressed.T):
        block = rows[:, :, inputs.owner == number] * np.where(pressed, 2.0, 1.0)[:, None, None]
        sizes_of_parts[:, number] = np.linalg.norm(block, ord=2, axis=(1, 2))
    return {"rss": squares_of_parts, "worst": sizes_of_parts}


def allocation_for(
    parts: Sequence[TolerancedPart], effects: Sequence[Mapping[str, Array]], wanted: float, by: str, measure: str
) -> Allocation:
    """Find the factors of all lines that keep an error at least cost, theory (54).

    Args:
        parts: the parts that have a tolerance.
        effects: the results of `effects_of_limits` for all poses, some poses each.
        wanted: the error that is not to be exceeded, m.
        by: rule by which errors add up, a key of `ALLOCATION_RULES`.
        measure: the error that is limited, "position" or "along", for which the effects are.
    """
    power = ALLOCATION_RULES[by]
    lines = list(dict.fromkeys(part.line for part in parts))
    line_of_part = np.array([lines.index(part.line) for part in parts])
    effects_of_parts = np.concatenate([by_rule[by] for by_rule in effects])
    # The share of each line in the wanted error at each pose: a pose keeps it where the shares add up to 1 at most.
    weights = np.zeros((len(effects_of_parts), len(lines)))
    np.add.at(weights.T, line_of_part, effects_of_parts.T)
    weights = weights / wanted**power
    costs = np.bincount(line_of_part, [part.cost for part in parts], len(lines)).astype(float)
    has_effect = weights.max(axis=0) > 0.0
    factors = np.full(len(lines), np.inf)
    if has_effect.any():
        factors[has_effect] = _least_cost(weights[:, has_effect], costs[has_effect], power)
    largest_ratio = float(weights.sum(axis=1).max()) ** (1.0 / power)  # of the present error to the wanted one
    even_factor = 1.0 / largest_ratio if largest_ratio else np.inf
    return Allocation(
        measure=measure,
        by=by,
        wanted=wanted,
        present=wanted * largest_ratio,
        lines=tuple(lines),
        factors=factors,
        costs=costs,
        cost=float((costs / factors).sum()),
        before=float(costs.sum()),
        evenly=float(costs.sum() / even_factor),
    )


def _least_cost(weights: Array, costs: Array, power: int) -> Array:
    """The factors f with the least sum of costs / f, and sum of weights f^power at most 1 at each pose [lines].

    A pose is added when it exceeds the wanted error, because most poses decide nothing. What a search has not reached
    is made up for by one factor on all: a search that ends early costs more, and no pose exceeds the wanted error.
    """
    deciding_poses = [int(weights.sum(axis=1).argmax())]
    for _ in range(MOST_DECIDING_POSES):
        factors = _closed_form(weights[deciding_poses[0]], costs, power)
        if len(deciding_poses) > 1 or not np.isfinite(factors).all():
            factors = _search(weights[deciding_poses], costs, power)
        sums = weights @ factors**power
        worst_pose = int(sums.argmax())
        if sums[worst_pose] <= 1.0 + ALLOWED_EXCESS or worst_pose in deciding_poses:
            break
        deciding_poses.append(worst_pose)
    return np.asarray(factors * min(1.0, float(sums.max()) ** (-1.0 / power)))


def _closed_form(weights: Array, costs: Array, power: int) -> Array:
    """The factors that suit a single pose, by a Lagrange multiplier; infinite for a line that has no effect there."""
    has_effect = weights > 0.0
    with np.errstate(divide="ignore"):
        ratios = np.where(has_effect, (costs / weights) ** (1.0 / (power + 1.0)), np.inf)
    return np.asarray(ratios * float((weights[has_effect] * ratios[has_effect] ** power).sum()) ** (-1.0 / power))


def _search(weights: Array, costs: Array, power: int) -> Array:
    """The factors that suit several poses: a convex problem in their logarithms."""

    def cost_and_slope(logarithms: Array) -> tuple[float, Array]:
        shares = costs * np.exp(-logarithms) / costs.sum()
        return float(shares.sum()), -shares

    def spare_error(logarithms: Array) -> Array:
        return np.asarray(-np.log(weights @ np.exp(power * logarithms)))

    def rates_of_spare_error(logarithms: Array) -> Array:
        summands = weights * np.exp(power * logarithms)
        return np.asarray(-power * summands / summands.sum(axis=1, keepdims=True))

    start = np.full(len(costs), -np.log(weights.sum(axis=1).max()) / power)
    limits = {"type": "ineq", "fun": spare_error, "jac": rates_of_spare_error}
    solved = minimize(cost_and_slope, start, jac=True, method="SLSQP", constraints=limits, options=SEARCH_OPTIONS)
    return np.asarray(np.exp(solved.x))
