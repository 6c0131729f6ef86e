"""What objectives and constraints are about: numbers of a design, from quantities at its poses. One catalogue for both.

A term says which quantities it needs, what they make together, and how that changes with each of them.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from kinetostat.engine.points import Array
from kinetostat.studies.optimisation.aggregate import Aggregate, Mask


class Term(Protocol):
    """A number that a design has."""

    @property
    def label(self) -> str:
        """For people, e.g. "compliance_sum (worst)"."""

    @property
    def unit(self) -> str:
        """SI."""

    @property
    def names(self) -> tuple[str, ...]:
        """The quantities it is made of."""

    @property
    def differentiable(self) -> bool:
        """Whether `slopes` shows a search the way: not where a term changes in steps."""

    def values(self, found: dict[str, Array], there: Mask) -> Array:
        """The numbers of some designs [designs], from their quantities and which poses count [designs x poses]."""

    def slopes(self, found: dict[str, Array], there: Mask) -> dict[str, Array]:
        """How the number of one design changes with each quantity at each pose [poses], by name.

        Args:
            found, there: of one design [poses].
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

    def at_poses(self, found: dict[str, Array]) -> Array:
        """The sum, or its reciprocal, at every pose."""
        with np.errstate(all="ignore"):
            total = sum(weight * found[name] for name, weight in self.weights)
            return np.asarray(1.0 / total if self.inverse else total)

    def values(self, found: dict[str, Array], there: Mask) -> Array:
        """See `Term`."""
        return self.aggregate.over(self.at_poses(found), there, self.high_is_bad)

    def slopes(self, found: dict[str, Array], there: Mask) -> dict[str, Array]:
        """See `Term`."""
        values = self.at_poses(found)
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

    def values(self, found: dict[str, Array], there: Mask) -> Array:
        """See `Term`."""
        longest, shortest = (found[name] for name in self.names)
        reach = np.where(there, longest, -np.inf).max(-1) - np.where(there, shortest, np.inf).min(-1)
        return np.where(there.any(-1), reach, np.nan)

    def slopes(self, found: dict[str, Array], there: Mask) -> dict[str, Array]:
        """See `Term`."""
        at = np.zeros((2, len(there)))
        at[0, np.argmax(np.where(there, found["longest_leg"], -np.inf))] = 1.0
        at[1, np.argmin(np.where(there, found["shortest_leg"], np.inf))] = -1.0
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

    def values(self, found: dict[str, Array], there: Mask) -> Array:
        """See `Term`."""
        aspects = np.where(there, found["aspect"], np.nan)
        most = np.maximum((aspects > 0.0).sum(-1), (aspects < 0.0).sum(-1)) + (aspects == 0.0).sum(-1)
        return self.box * most / there.shape[-1]

    def slopes(self, found: dict[str, Array], _there: Mask) -> dict[str, Array]:
        """0: it changes in steps, and between them not at all."""
        return {name: np.zeros_like(found[name]) for name in self.names}
