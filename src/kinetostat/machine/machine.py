"""The machine: a family, its parameters as plain frozen data, and what the family makes of them at a pose.

Parameters may be floats or traced scalars; nothing here validates (that is `spec`) and nothing here solves.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import Displacement
from kinetostat.machine.leg import Leg, Spring


@dataclass(frozen=True)
class Closure:
    """A condition for a leg to close: two joints must be neither too far apart for its links nor too near.

    Attributes:
        leg: name of the leg.
        span: distance of the two joints at this pose, m.
        shortest, longest: what its links can bridge, m.
    """

    leg: str
    span: Scalar
    shortest: Scalar
    longest: Scalar


@dataclass(frozen=True)
class Configuration:
    """A machine at a pose.

    Attributes:
        platform: placement of the platform in the base frame; its translation is the reference point P.
        legs: every leg, placed.
        closures: the conditions under which this placement exists.
        length: a characteristic length of the machine, m; scales rows in solves, no result depends on it.
    """

    platform: Displacement
    legs: tuple[Leg, ...]
    closures: tuple[Closure, ...]
    length: Scalar


@dataclass(frozen=True)
class Family:
    """A kind of machine: what people must write about one, and its closed-form kinematics.

    Attributes:
        name: as written in machine files.
        summary: one line for lists.
        geometry, stiffness, pose: dataclasses whose annotated fields are the sections of a machine file.
        configure: (geometry, stiffness, pose) to the machine at that pose.
    """

    name: str
    summary: str
    geometry: type
    stiffness: type
    pose: type
    configure: Callable[[Any, Any, Any], Configuration]


@dataclass(frozen=True)
class Machine:
    """A machine of some family with its reference pose; never modified, only replaced.

    Attributes:
        name: for people.
        family: its kind.
        geometry, stiffness, pose: instances of the family's dataclasses, SI.
    """

    name: str
    family: Family
    geometry: Any
    stiffness: Any
    pose: Any

    def configure(self) -> Configuration:
        """The machine at its pose."""
        return self.family.configure(self.geometry, self.stiffness, self.pose)


def springs(configuration: Configuration) -> list[Spring]:
    """All springs of the machine, leg by leg: the order of every per-spring result."""
    return [spring for leg in configuration.legs for spring in leg.springs]
