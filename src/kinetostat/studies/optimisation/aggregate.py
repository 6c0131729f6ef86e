"""One number from many: the worst, the mean or a percentile over poses, or over what manufacture makes of a design.

Each is a weighted sum whose weights depend on the order of the values, so that its derivatives are that sum of theirs.
"""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetostat.engine.points import Array
from kinetostat.spec.errors import InputError, shorten

Mask = npt.NDArray[np.bool_]

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
        found = np.zeros(len(values))
        order = np.argsort(np.where(there, values if high_is_bad else -values, -np.inf), kind="stable")
        low, high, part = self._between(count, len(values))
        found[order[low]] += 1.0 - float(part)
        found[order[high]] += float(part)
        return found

    def _between(self, count: npt.NDArray[Any], size: int) -> tuple[Any, Any, Any]:
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
