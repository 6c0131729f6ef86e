"""Terms, of which objectives and constraints are made: numbers of a design, from quantities at its poses.

A term says which quantities it needs, what they make together, and how that changes with each of them. The catalogue
says by name what people may ask for, in which unit, and which way is better.
"""

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from itertools import combinations_with_replacement
from typing import Any, Literal, NamedTuple, Protocol, TypeAlias

import numpy as np

from kinetostat.arrays import AnyArray, Array, Mask
from kinetostat.equilibrium.state import state_of
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.spec.renamed import current_name
from kinetostat.spec.study import TermTable
from kinetostat.studies.directions import three_numbers
from kinetostat.studies.optimisation.space import PoseSet
from kinetostat.studies.quantities import refuse_absent

_PERCENTILE = re.compile(r"percentile\s+(\d{1,2}(?:\.\d+)?|100)")
"""Words of an aggregate that is a percentile, "percentile 95" for instance."""
WORST, MEAN = "worst", "mean"
"""Words of the other aggregates: the worst of all values, and their mean."""
SUMS = {"compliance_sum": "compliance", "stiffness_sum": "stiffness"}
"""Weighted sums of the diagonal of C (eq. 40) and of K (eq. 39)."""


class _DirectionalTerm(NamedTuple):
    """A term along a direction (under a force) or about it (under a moment), with all other motions free.

    Attributes:
        letter: letter before an axis in the names of the components of C: r for rotations, else none.
        inverse: whether the reciprocal of the compliance is meant.
        unit: its SI unit.
    """

    letter: str
    inverse: bool
    unit: str


ALONG = {
    "compliance_along": _DirectionalTerm("", inverse=False, unit="m/N"),
    "stiffness_along": _DirectionalTerm("", inverse=True, unit="N/m"),
    "compliance_about": _DirectionalTerm("r", inverse=False, unit="rad/(N·m)"),
    "stiffness_about": _DirectionalTerm("r", inverse=True, unit="N·m/rad"),
}
"""Terms that need a direction, by their names."""
STROKE, VOLUME = "leg_stroke", "workspace_volume"
"""Terms of all poses together: of the lengths of legs, and of the poses that are reached."""
AXES = "xyz"
"""Axes of the base, in the order of a direction's three numbers."""

Goal: TypeAlias = Literal["minimize", "maximize"]


@dataclass(frozen=True)
class Aggregate:
    """The way in which many values become one number.

    Attributes:
        text: the words of the study file.
        share: share of the values that are at least as good as the number; 1 for the worst, None for the mean.
    """

    text: str
    share: float | None

    @property
    def smooth(self) -> bool:
        """Whether it has derivatives everywhere."""
        return self.share is None

    def over(self, values: Array, counted: Mask, high_is_bad: bool) -> Array:
        """Take one number of the values along the last axis.

        Args:
            values: rows of values [... x n].
            counted: flags of the values that count [... x n].
            high_is_bad: whether great values are the bad ones.

        Returns:
            One number for each row of values [...]; NaN where none counts.
        """
        count = counted.sum(axis=-1)
        if self.share is None:
            total = np.where(counted, values, 0.0).sum(axis=-1)
            return np.divide(total, count, out=np.full(count.shape, np.nan), where=count > 0)
        sign = 1.0 if high_is_bad else -1.0
        badness = np.where(counted, sign * values, -np.inf)
        if self.share == 1.0:
            return np.where(count > 0, sign * badness.max(axis=-1), np.nan)
        ordered = np.sort(badness, axis=-1)
        rank = self._rank(count, values.shape[-1])
        lower, upper = (np.take_along_axis(ordered, place[..., None], -1)[..., 0] for place in (rank.below, rank.above))
        with np.errstate(invalid="ignore"):  # of two infinite neighbours no difference is needed
            percentile = np.where(rank.part > 0.0, lower + rank.part * (upper - lower), lower)
        return np.where(count > 0, sign * percentile, np.nan)

    def weights(self, values: Array, counted: Mask, high_is_bad: bool) -> Array:
        """The weights of values in the number taken of them [n]; of equally bad ones, the first has all weight."""
        count = np.array(counted.sum())
        if self.share is None:
            return counted / max(int(count), 1)
        weights = np.zeros(len(values))
        order = np.argsort(np.where(counted, values if high_is_bad else -values, -np.inf), kind="stable")
        rank = self._rank(count, len(values))
        weights[order[rank.below]] += 1.0 - float(rank.part)
        weights[order[rank.above]] += float(rank.part)
        return weights

    def _rank(self, count: AnyArray, size: int) -> "_Rank":
        """The place of the percentile among values in increasing order of badness.

        Args:
            count: number of values that count; all others come first in that order.
            size: number of all values.
        """
        place = np.minimum((size - count) + (self.share or 0.0) * np.maximum(count - 1, 0), size - 1)
        below = np.floor(place).astype(int)
        return _Rank(below, np.minimum(below + 1, size - 1), place - below)


class _Rank(NamedTuple):
    """A place between two values of an ordered row: their numbers, and the share of the way from the first on."""

    below: Any
    above: Any
    part: Any


def parse_aggregate(text: str, where: str) -> Aggregate:
    """Read an aggregate from "worst", "mean" or "percentile P".

    Args:
        text: the words of the study file.
        where: the field, for messages.

    Raises:
        InputError: it is none of these.
    """
    words = text.strip().lower()
    if words in (WORST, MEAN):
        return Aggregate(words, 1.0 if words == WORST else None)
    match = _PERCENTILE.fullmatch(words)
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
        """Its SI unit."""

    @property
    def names(self) -> tuple[str, ...]:
        """The quantities it is made of."""

    @property
    def differentiable(self) -> bool:
        """Whether a search can follow `slopes`: not where a term changes in steps."""

    def values(self, quantities: dict[str, Array], reached: Mask) -> Array:
        """The numbers of some designs [designs], by their quantities at the poses that they reach [designs x poses]."""

    def slopes(self, quantities: dict[str, Array], reached: Mask) -> dict[str, Array]:
        """Derivatives of the number of one design by each quantity at each pose [poses], by name.

        Args:
            quantities, reached: the quantities of one design, and flags of the poses that it reaches [poses].
        """


@dataclass(frozen=True)
class PoseTerm:
    """A weighted sum of quantities of a pose, or its reciprocal, taken over the poses.

    Attributes:
        label: its name for tables, see `Term`.
        unit: its SI unit.
        weights: weights of the quantities by name, without zeros.
        inverse: whether the reciprocal of the sum is meant.
        aggregate: the way in which the values at all poses become one number.
        high_is_bad: whether poses with great values are the bad ones.
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

    def values(self, quantities: dict[str, Array], reached: Mask) -> Array:
        """See `Term`."""
        return self.aggregate.over(self.at_poses(quantities), reached, self.high_is_bad)

    def slopes(self, quantities: dict[str, Array], reached: Mask) -> dict[str, Array]:
        """See `Term`."""
        values = self.at_poses(quantities)
        shares = self.aggregate.weights(values, reached, self.high_is_bad)
        outer = np.where(shares != 0.0, -shares * values * values if self.inverse else shares, 0.0)
        return {name: weight * outer for name, weight in self.weights}


@dataclass(frozen=True)
class StrokeTerm:
    """The extension that actuated legs, all made alike, need: from the shortest leg of all poses to the longest, m."""

    label: str = STROKE
    unit: str = "m"
    names: tuple[str, ...] = ("longest_leg", "shortest_leg")
    differentiable: bool = True

    def values(self, quantities: dict[str, Array], reached: Mask) -> Array:
        """See `Term`."""
        longest, shortest = (quantities[name] for name in self.names)
        stroke = np.where(reached, longest, -np.inf).max(-1) - np.where(reached, shortest, np.inf).min(-1)
        return np.where(reached.any(-1), stroke, np.nan)

    def slopes(self, quantities: dict[str, Array], reached: Mask) -> dict[str, Array]:
        """See `Term`."""
        rates = np.zeros((2, len(reached)))
        rates[0, np.argmax(np.where(reached, quantities["longest_leg"], -np.inf))] = 1.0
        rates[1, np.argmin(np.where(reached, quantities["shortest_leg"], np.inf))] = -1.0
        return dict(zip(self.names, rates, strict=True))


@dataclass(frozen=True)
class VolumeTerm:
    """Volume of the poses that a design reaches, in that aspect in which it reaches more of them.

    Attributes:
        box: volume of the grid of poses; each node stands for its share.
        unit: unit of that volume.
    """

    box: float
    unit: str
    label: str = VOLUME
    names: tuple[str, ...] = ("aspect",)
    differentiable: bool = False

    def values(self, quantities: dict[str, Array], reached: Mask) -> Array:
        """See `Term`."""
        aspects = np.where(reached, quantities["aspect"], np.nan)
        most = np.maximum((aspects > 0.0).sum(-1), (aspects < 0.0).sum(-1)) + (aspects == 0.0).sum(-1)
        return self.box * most / reached.shape[-1]

    def slopes(self, quantities: dict[str, Array], _reached: Mask) -> dict[str, Array]:
        """0: it changes in steps, and between them not at all."""
        return {name: np.zeros_like(quantities[name]) for name in self.names}


def known_terms(machine: Machine) -> list[str]:
    """Names of all terms of a machine of this kind."""
    components = machine.family.component_names
    of_poses = [
        name for name, q in QUANTITIES.items() if all(part in components for part in q.components) and name != "aspect"
    ]
    return [*SUMS, *ALONG, STROKE, VOLUME, *of_poses]


def usual_goal(name: str) -> Goal | None:
    """Return which way an objective is better unless a study says otherwise; None where neither way is.

    Args:
        name: name of a term of the catalogue.
    """
    if name == VOLUME or (name in {*SUMS, *ALONG} and name.startswith("stiffness")):
        return "maximize"
    if name not in QUANTITIES:
        return "minimize"
    goals: dict[str | None, Goal | None] = {"more": "maximize", "less": "minimize", None: None}
    return goals[QUANTITIES[name].better]


def read_term(machine: Machine, table: TermTable, poses: PoseSet, high_is_bad: bool, where: str) -> Term:
    """Read the term of an objective or a constraint.

    Args:
        machine: the machine, which must have the parts that the quantity is about.
        table: the table of the study file.
        poses: the poses at which designs are judged.
        high_is_bad: whether great values are the bad ones.
        where: the table's name, for messages.

    Raises:
        InputError: the quantity is not known, weights or a direction do not belong to it, or `over` cannot be read.
    """
    name = _known_name(machine, table.quantity, f"{where}.quantity")
    if table.weights is not None and name not in SUMS:
        raise InputError(f"{where}: {name} takes no weights; leave them out, or ask for {' or '.join(SUMS)}.")
    if table.direction is not None and name not in ALONG:
        raise InputError(f"{where}: {name} takes no direction; leave it out, or ask for {', '.join(ALONG)}.")
    if name == VOLUME:
        return _volume(poses, where)
    if name == STROKE:
        refuse_absent(state_of(machine), StrokeTerm.names)
        return StrokeTerm()
    aggregate = parse_aggregate(table.over, f"{where}.over")
    weights: Mapping[str, float] = {name: 1.0}
    inverse = False
    if name in SUMS:
        unit, weights = "SI", _sum_weights(machine, name, table.weights, where)
    elif name in ALONG:
        inverse, unit = ALONG[name].inverse, ALONG[name].unit
        weights = _direction_weights(machine, ALONG[name].letter, table.direction, where)
    else:
        refuse_absent(state_of(machine), [name])
        unit = QUANTITIES[name].unit
    return PoseTerm(
        label=name if poses.count == 1 else f"{name} ({aggregate.text})",
        unit=unit,
        weights=tuple(weights.items()),
        inverse=inverse,
        aggregate=aggregate,
        high_is_bad=high_is_bad,
    )


def _known_name(machine: Machine, name: str, where: str) -> str:
    """Return the name if it is in the catalogue; refuse others with what was meant, or with all but most entries of C.

    Raises:
        InputError: there is no such term.
    """
    known, name = known_terms(machine), current_name(name, "quantity")
    entries = [entry for entry in known if entry in QUANTITIES and QUANTITIES[entry].components]
    if name in known or difflib.get_close_matches(name, known, 1):
        return choice(name, known, where)
    return choice(name, [*(term for term in known if term not in entries), entries[0], entries[-1]], where)


def _volume(poses: PoseSet, where: str) -> Term:
    if poses.box is None:
        raise InputError(
            f"{where}: {VOLUME} needs a grid of poses; add over = [...] to [poses], ranges of coordinates."
        )
    return VolumeTerm(*poses.box)


def _sum_weights(machine: Machine, name: str, written: Sequence[float] | None, where: str) -> Mapping[str, float]:
    components = machine.family.component_names
    names = [entry for entry in GROUPS[SUMS[name]] if QUANTITIES[entry].components[0] in components]
    weights = [1.0] * len(names) if written is None else written
    if len(weights) != len(names) or not any(weights) or min(weights) < 0.0:
        raise InputError(
            f"{where}.weights must be {len(names)} numbers of at least 0, not all 0, for {' '.join(components)}."
        )
    return {entry: weight for entry, weight in zip(names, weights, strict=True) if weight}


def _direction_weights(
    machine: Machine, letter: str, direction: Sequence[float] | None, where: str
) -> Mapping[str, float]:
    """The weights of the entries of C in n^T C n, the compliance along or about a unit vector n."""
    size = math.hypot(*three_numbers(direction)) if direction else 0.0
    if not direction or size == 0.0:
        raise InputError(f"{where} needs a direction, e.g. direction = [0, 0, 1].")
    n = [component / size for component in direction]
    weights: dict[str, float] = {}
    for i, k in combinations_with_replacement(range(3), 2):
        weight = n[i] * n[k] * (1.0 if i == k else 2.0)  # C is symmetric: entries beside the diagonal count twice
        if weight == 0.0:
            continue
        components = dict.fromkeys([f"{letter}{AXES[i]}", f"{letter}{AXES[k]}"])
        for component in components:
            if component not in machine.family.component_names:
                raise InputError(f"{where}.direction leaves the plane of {machine.name}, which has no {component}.")
        weights["_".join(["compliance", *components])] = weight
    return weights
