"""What is left of many points when only counts and extremes are kept, chunk by chunk and over all chunks."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinetostat.engine.batch import Evaluation
from kinetostat.kinematics.status import Status


@dataclass(frozen=True)
class Extremes:
    """Of one quantity, SI, over the points where it has a value; NaN where there is none."""

    least: float
    mean: float
    largest: float


@dataclass(frozen=True)
class Tally:
    """Over all points of a grid.

    Attributes:
        statuses: how many points have each status.
        extremes: of each quantity.
    """

    statuses: dict[Status, int]
    extremes: dict[str, Extremes]

    @property
    def answered(self) -> bool:
        """Whether any point has results."""
        return self.statuses.get(Status.OK, 0) > 0


def tally(found: Evaluation) -> dict[str, Any]:
    """Counts and extremes of one chunk as plain data."""
    codes, counts = np.unique(found.status, return_counts=True)
    quantities = {}
    for name, values in found.values.items():
        known = values[~np.isnan(values)]
        least, largest = (float(known.min()), float(known.max())) if len(known) else (np.nan, np.nan)
        quantities[name] = {"count": len(known), "least": least, "sum": float(known.sum()), "largest": largest}
    return {
        "status": {Status(int(code)).word: int(n) for code, n in zip(codes, counts, strict=True)},
        "quantities": quantities,
    }


def combined(parts: Iterable[Mapping[str, Any]], names: Sequence[str]) -> Tally:
    """Counts and extremes over several chunks."""
    kept = list(parts)
    words: Counter[str] = Counter()
    for part in kept:
        words.update(part["status"])
    statuses = {status: words[status.word] for status in Status if words[status.word]}
    return Tally(statuses, {name: _extremes([part["quantities"][name] for part in kept]) for name in names})


def _extremes(parts: Sequence[Mapping[str, float]]) -> Extremes:
    held = [part for part in parts if part["count"]]
    if not held:
        return Extremes(np.nan, np.nan, np.nan)
    mean = sum(part["sum"] for part in held) / sum(part["count"] for part in held)
    return Extremes(min(part["least"] for part in held), mean, max(part["largest"] for part in held))
