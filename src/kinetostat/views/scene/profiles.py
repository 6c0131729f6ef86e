"""How thick the parts of a machine are drawn: from its cross-sections and limits, else in proportion to its size."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.machine.limits import is_set
from kinetostat.machine.machine import Configuration, Machine

SLENDER = 0.0125
"""Radius of a leg as a share of the machine's diagonal, where nothing says how thick it is."""


@dataclass(frozen=True)
class Profile:
    """A cross-section as one sees it: `depth` is that of a rectangle, `width` along y; None for a round one, m."""

    width: float
    depth: float | None = None


@dataclass(frozen=True)
class Proportions:
    """Sizes from which all parts are drawn.

    Attributes:
        leg: radius of a leg, m.
        cross_sections: cross-section of each link that has one, by the link's name.
        spans: length of each telescope where the machine was loaded, m, by name: its cylinder does not grow.
        carriages: where each rail's carriage was then, by name, base frame, m: the rail stays.
        diagonal: of the machine, m.
    """

    leg: float
    cross_sections: Mapping[str, Profile]
    spans: Mapping[str, float]
    carriages: Mapping[str, Vector]
    diagonal: float


def diagonal(configuration: Configuration) -> float:
    """Diagonal of the box around P and all joints that the pose places, m."""
    points = [p for leg in configuration.legs for p in leg.path] + [configuration.platform.translation]
    placed = [p for p in points if all(math.isfinite(c) for c in p.components())]
    low, high = bounds(placed) if placed else (ZERO, ZERO)
    return math.hypot(*(high - low).components()) or float(configuration.length)


def leg_radius(machine: Machine, size: float) -> float:
    """Radius of the legs, m."""
    given = machine.tables["limits"].leg_diameter
    return 0.5 * given if is_set(given) else SLENDER * size


def cross_sections_of(machine: Machine) -> dict[str, Profile]:
    """The cross-sections of a machine written leg by leg, by the name of the link."""
    found = {}
    for table, said in machine.family.literals.items():
        parts = table.split(".", 2)
        section = said.get("section")
        if parts[0] == "legs" and section:
            shape = machine.family.literals[f"sections.{section}"]["shape"]
            found[f"{parts[1]} {parts[2]}"] = _profile(str(shape), machine.tables[f"sections.{section}"])
    return found


def _profile(shape: str, data: Any) -> Profile:
    match shape:
        case "round":
            return Profile(data.diameter)
        case "tube":
            return Profile(data.outer_diameter)
        case "rectangle":
            return Profile(data.width, data.height)
    return Profile(2.0 * math.sqrt(data.area / math.pi))


def bounds(points: Sequence[Vector]) -> tuple[Vector, Vector]:
    """The lowest and highest corner of the box around some points."""
    columns = list(zip(*(p.components() for p in points), strict=True))
    return Vector(*(min(c) for c in columns)), Vector(*(max(c) for c in columns))
