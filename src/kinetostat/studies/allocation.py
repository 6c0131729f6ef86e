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
        by: how errors add up, "rss" or "worst".
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


def reach_of(inputs: RandomInputs, measures: Measures, measure: str) -> dict[str, Array]:
    """Motion of the tool by the limits of each part alone [n x parts]: its square, m², for "rss"; m for "worst".

    A joint that a load presses to one side counts with its whole clearance, twice the limit to one side.
    """
    rows = measures.linear(inputs.columns)[:, measures.row_numbers(measure)]
    squares = (rows**2).sum(axis=1) * np.where(inputs.pressed[:, inputs.owner], 4.0, 1.0)
    parts = np.zeros((len(rows), len(inputs.parts)))
    np.add.at(parts.T, inputs.owner, squares.T)
    farthest = np.zeros_like(parts)
    for number, pressed in enumerate(inputs.pressed.T):
        block = rows[:, :, inputs.owner == number] * np.where(pressed, 2.0, 1.0)[:, None, None]
        farthest[:, number] = np.linalg.norm(block, ord=2, axis=(1, 2))
    return {"rss": parts, "worst": farthest}


def allocation_for(
    parts: Sequence[TolerancedPart], reach: Sequence[Mapping[str, Array]], wanted: float, by: str, measure: str
) -> Allocation:
    """Find the factors of all lines that keep an error at least cost, theory (54).

    Args:
        parts: the parts that have a tolerance.
        reach: the results of `reach_of` for all poses.
        wanted: the error that is not to be exceeded, m.
        by: "rss", the root of the sum of squares, or "worst", the sum of all.
        measure: the error that is limited, "position" or "along".
    """
    lines = list(dict.fromkeys(part.line for part in parts))
    owner = np.array([lines.index(part.line) for part in parts])
    reaches = np.concatenate([table[by] for table in reach])
    power = 2 if by == "rss" else 1
    weights = np.zeros((len(reaches), len(lines)))
    np.add.at(weights.T, owner, reaches.T)
    weights = weights / wanted**power
    costs = np.bincount(owner, [part.cost for part in parts], len(lines)).astype(float)
    has_effect = weights.max(axis=0) > 0.0
    present = float(weights.sum(axis=1).max())
    factors = np.full(len(lines), np.inf)
    if has_effect.any():
        factors[has_effect] = _least_cost(weights[:, has_effect], costs[has_effect], power)
    even_factor = present ** (-1.0 / power) if present else np.inf
    return Allocation(
        measure=measure,
        by=by,
        wanted=wanted,
        present=wanted * present ** (1.0 / power),
        lines=tuple(lines),
        factors=factors,
        costs=costs,
        cost=float((costs / factors).sum()),
        before=float(costs.sum()),
        evenly=float(costs.sum() / even_factor),
    )


def _least_cost(weights: Array, costs: Array, power: int) -> Array:
    """The factors f with the least sum of costs / f, and sum of weights f^power at most 1 at each pose [lines].

    A pose is added when it exceeds the wanted error, because most poses decide nothing.
    """
    chosen = [int(weights.sum(axis=1).argmax())]
    for _ in range(MOST_DECIDING_POSES):
        factors = _closed_form(weights[chosen[0]], costs, power)
        if len(chosen) > 1 or not np.isfinite(factors).all():
            factors = _search(weights[chosen], costs, power)
        errors = weights @ factors**power
        farthest = int(errors.argmax())
        if errors[farthest] <= 1.0 + ALLOWED_EXCESS or farthest in chosen:
            break
        chosen.append(farthest)
    return np.asarray(factors * min(1.0, float(errors.max()) ** (-1.0 / power)))


def _closed_form(weights: Array, costs: Array, power: int) -> Array:
    """The factors that suit a single pose, by a Lagrange multiplier; infinite for a line that has no effect there."""
    has_effect = weights > 0.0
    with np.errstate(divide="ignore"):
        ratios = np.where(has_effect, (costs / weights) ** (1.0 / (power + 1.0)), np.inf)
    return np.asarray(ratios * float((weights[has_effect] * ratios[has_effect] ** power).sum()) ** (-1.0 / power))


def _search(weights: Array, costs: Array, power: int) -> Array:
    """The factors that suit several poses: a convex problem in their logarithms."""

    def cost(logarithms: Array) -> tuple[float, Array]:
        parts = costs * np.exp(-logarithms)
        return float(parts.sum() / costs.sum()), -parts / costs.sum()

    def spare_error(logarithms: Array) -> Array:
        return np.asarray(-np.log(weights @ np.exp(power * logarithms)))

    def rates_of_spare_error(logarithms: Array) -> Array:
        amounts = weights * np.exp(power * logarithms)
        return np.asarray(-power * amounts / amounts.sum(axis=1, keepdims=True))

    start = np.full(len(costs), -np.log(weights.sum(axis=1).max()) / power)
    limits = {"type": "ineq", "fun": spare_error, "jac": rates_of_spare_error}
    solved = minimize(cost, start, jac=True, method="SLSQP", constraints=limits, options=SEARCH_OPTIONS)
    return np.asarray(np.exp(solved.x))
