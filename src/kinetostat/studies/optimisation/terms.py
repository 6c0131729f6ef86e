"""What objectives and constraints are about: numbers of a design, from quantities at its poses. One catalogue for both.

A term says which quantities it needs, what they make together, and how that changes with each of them.
"""

import re
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from kinetostat.arrays import AnyArray, Array, Mask
from kinetostat.spec.errors import InputError, shorten

_FORM = re.compile(r"percentile\s+(\d{1,2}(?:\.\d+)?|100)")
WORST, MEAN = "worst", "mean"


@dataclass(frozen=True)
class Aggregate:
    """How values become one number.

    Attributes:
        text: as written.
        share: of the values that are at least as good; 1 for the worst, None for the mean.
    """

    text: str
    share: float | None

    @property
    def smooth(self) -> bool:
        """Whether it has derivatives everywhere."""
        return self.share is None

    def over(self, values: Array, there: Mask, high_is_bad: bool) -> Array:
        """Aggregates along the last axis.

        Args:
            values: [... x n].
            there: which of them count [... x n].
            high_is_bad: whether great values are the bad ones.

        Returns:
            [...]; NaN where none counts.
        """
        count = there.sum(axis=-1)
        if self.share is None:
            total = np.where(there, values, 0.0).sum(axis=-1)
            return np.divide(total, count, out=np.full(count.shape, np.nan), where=count > 0)
        sign = 1.0 if high_is_bad else -1.0
        badness = np.where(there, sign * values, -np.inf)
        if self.share == 1.0:
            return np.where(count > 0, sign * badness.max(axis=-1), np.nan)
        ordered = np.sort(badness, axis=-1)
        low, high, part = self._between(count, values.shape[-1])
        lower, upper = (np.take_along_axis(ordered, place[..., None], -1)[..., 0] for place in (low, high))
        with np.errstate(invalid="ignore"):
            between = np.where(part > 0.0, lower + part * (upper - lower), lower)
        return np.where(count > 0, sign * between, np.nan)

    def weights(self, values: Array, there: Mask, high_is_bad: bool) -> Array:
        """The weights of one set of values in its aggregate [n]; of several worst ones, the first has it all."""
        count = np.array(there.sum())
        if self.share is None:
            return there / max(int(count), 1)
        weights = np.zeros(len(values))
        order = np.argsort(np.where(there, values if high_is_bad else -values, -np.inf), kind="stable")
        low, high, part = self._between(count, len(values))
        weights[order[low]] += 1.0 - float(part)
        weights[order[high]] += float(part)
        return weights

    def _between(self, count: AnyArray, size: int) -> tuple[Any, Any, Any]:
        """Places of the two neighbours in increasing order, those that do not count first, and the way between."""
        rank = np.minimum((size - count) + (self.share or 0.0) * np.maximum(count - 1, 0), size - 1)
        low = np.floor(rank).astype(int)
        return low, np.minimum(low + 1, size - 1), rank - low


def parse_aggregate(text: str, where: str) -> Aggregate:
    """An aggregate from "worst", "mean" or "percentile P".

    Raises:
        InputError: none of them.
    """
    words = text.strip().lower()
    if words in (WORST, MEAN):
        return Aggregate(words, 1.0 if words == WORST else None)
    match = _FORM.fullmatch(words)
    if match is None:
        raise InputError(
            f'{where} is {shorten(text)}; write "worst", "mean", or "percentile 95" (that share is better).'
        )
    return Aggregate(words, float(match[1]) / 100.0)


class Term(Protocol):
    """A number that a design has."""

    @property
    def label(self) -> str:
        """Name for tables, e.g. "compliance_sum (worst)"."""

    @property
    def unit(self) -> str:
        """SI."""

    @property
    def names(self) -> tuple[str, ...]:
        """The quantities it is made of."""

    @property
    def differentiable(self) -> bool:
        """Whether `slopes` shows a search the way: not where a term changes in steps."""

    def values(self, quantities: dict[str, Array], there: Mask) -> Array:
        """The numbers of some designs [designs], from their quantities and which poses count [designs x poses]."""

    def slopes(self, quantities: dict[str, Array], there: Mask) -> dict[str, Array]:
        """How the number of one design changes with each quantity at each pose [poses], by name.

        Args:
            quantities, there: of one design [poses].
        """


@dataclass(frozen=True)
class PoseTerm:
    """A weighted sum of quantities of a pose, or its reciprocal, taken over the poses.

    Attributes:
        label: see `Term`.
        unit: SI.
        weights: of the quantities by name; without zeros.
        inverse: whether the reciprocal of the sum is meant.
        aggregate: over the poses.
        high_is_bad: which poses are the bad ones.
    """

    label: str
    unit: str
    weights: tuple[tuple[str, float], ...]
    inverse: bool
    aggregate: Aggregate
    high_is_bad: bool

    @property
    def names(self) -> tuple[str, ...]:
        """The quantities in the sum."""
        return tuple(name for name, _ in self.weights)

    @property
    def differentiable(self) -> bool:
        """At one pose it is smooth; over several, it has derivatives wherever their order does not change."""
        return True

    def at_poses(self, quantities: dict[str, Array]) -> Array:
        """The sum, or its reciprocal, at every pose."""
        with np.errstate(all="ignore"):
            total = sum(weight * quantities[name] for name, weight in self.weights)
            return np.asarray(1.0 / total if self.inverse else total)

    def values(self, quantities: dict[str, Array], there: Mask) -> Array:
        """See `Term`."""
        return self.aggregate.over(self.at_poses(quantities), there, self.high_is_bad)

    def slopes(self, quantities: dict[str, Array], there: Mask) -> dict[str, Array]:
        """See `Term`."""
        values = self.at_poses(quantities)
        shares = self.aggregate.weights(values, there, self.high_is_bad)
        outer = np.where(shares != 0.0, -shares * values * values if self.inverse else shares, 0.0)
        return {name: weight * outer for name, weight in self.weights}


@dataclass(frozen=True)
class StrokeTerm:
    """How far actuated legs, all made alike, must extend: from the shortest leg of all poses to the longest, m."""

    label: str = "leg_stroke"
    unit: str = "m"
    names: tuple[str, ...] = ("longest_leg", "shortest_leg")
    differentiable: bool = True

    def values(self, quantities: dict[str, Array], there: Mask) -> Array:
        """See `Term`."""
        longest, shortest = (quantities[name] for name in self.names)
        reach = np.where(there, longest, -np.inf).max(-1) - np.where(there, shortest, np.inf).min(-1)
        return np.where(there.any(-1), reach, np.nan)

    def slopes(self, quantities: dict[str, Array], there: Mask) -> dict[str, Array]:
        """See `Term`."""
        at = np.zeros((2, len(there)))
        at[0, np.argmax(np.where(there, quantities["longest_leg"], -np.inf))] = 1.0
        at[1, np.argmin(np.where(there, quantities["shortest_leg"], np.inf))] = -1.0
        return dict(zip(self.names, at, strict=True))


@dataclass(frozen=True)
class VolumeTerm:
    """Volume of the poses that a design reaches, in that aspect in which it reaches more of them.

    Attributes:
        box: volume of the grid of poses; each node stands for its share.
        unit: of it.
    """

    box: float
    unit: str
    label: str = "workspace_volume"
    names: tuple[str, ...] = ("aspect",)
    differentiable: bool = False

    def values(self, quantities: dict[str, Array], there: Mask) -> Array:
        """See `Term`."""
        aspects = np.where(there, quantities["aspect"], np.nan)
        most = np.maximum((aspects > 0.0).sum(-1), (aspects < 0.0).sum(-1)) + (aspects == 0.0).sum(-1)
        return self.box * most / there.shape[-1]

    def slopes(self, quantities: dict[str, Array], _there: Mask) -> dict[str, Array]:
        """0: it changes in steps, and between them not at all."""
        return {name: np.zeros_like(quantities[name]) for name in self.names}
