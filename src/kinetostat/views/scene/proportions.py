"""Proportions: how thick the parts of a machine are drawn.

Cross-sections and limits of the file decide; without them the parts are drawn in proportion to the machine.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.limits import is_set
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.views.scene.anatomy import anatomy

LEG_RADIUS = 0.0125
"""Radius of a leg as a share of the machine's diagonal, where the file does not say how thick it is."""


@dataclass(frozen=True)
class Profile:
    """Outer size of a cross-section, m: `width` along y, and the `depth` of a rectangle; None for a round one."""

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
    """Return the diagonal of the box around P and all joints that the pose places, m."""
    points = [p for leg in configuration.legs for p in leg.path] + [configuration.platform.translation]
    placed = [p for p in points if all(math.isfinite(c) for c in p.components())]
    low, high = bounds(placed) if placed else (ZERO, ZERO)
    return math.hypot(*(high - low).components()) or float(configuration.length)


def leg_radius(machine: Machine, size: float) -> float:
    """Return the radius of the legs, m: half their diameter in [limits], if it is there."""
    given = machine.tables["limits"].leg_diameter
    return 0.5 * given if is_set(given) else LEG_RADIUS * size


def cross_sections_of(machine: Machine) -> dict[str, Profile]:
    """Return the cross-sections of a machine written leg by leg, by the name of the link."""
    profiles = {}
    for table, entries in machine.family.literals.items():
        parts = table.split(".", 2)
        section = entries.get("section")
        if parts[0] == "legs" and section:
            shape = machine.family.literals[f"sections.{section}"]["shape"]
            profiles[f"{parts[1]} {parts[2]}"] = _profile(str(shape), machine.tables[f"sections.{section}"])
    return profiles


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
    """Return the lowest and the highest corner of the box around some points."""
    columns = list(zip(*(p.components() for p in points), strict=True))
    return Vector(*(min(c) for c in columns)), Vector(*(max(c) for c in columns))


def proportions_of(machine: Machine, configuration: Configuration) -> Proportions:
    """Return the sizes to draw a machine with, from its pose when it is loaded; they stay while it moves."""
    legs = [anatomy(leg) for leg in configuration.legs]
    size = diagonal(configuration)
    return Proportions(
        leg_radius(machine, size),
        cross_sections_of(machine),
        {link.name: link.span.norm() for leg in legs for link in leg.links},
        {rail.name: rail.point for leg in legs for rail in leg.rails},
        size,
    )
