"""What moves and how heavy it is: links with a cross-section and a density, and the platform with its tool.

A mass is a plain sum, over any scalar: how it is distributed, and what it does to dynamics, is not asked here.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from kinetostat.algebra.scalar import Scalar, is_zero, total
from kinetostat.algebra.vector import Vector
from kinetostat.machine.leg import Turn
from kinetostat.machine.links import LINK_TABLES, growth_of
from kinetostat.machine.machine import Configuration, Machine, Member

PLATFORM, PAYLOAD = "platform and tool", "payload"


@dataclass(frozen=True)
class Mass:
    """What one part weighs at a pose.

    Attributes:
        name: of the link, or `PLATFORM`.
        mass: kg; None where nothing says it.
        leg: that it belongs to; empty for the platform and for a link that is not counted to a leg.
    """

    name: str
    mass: Scalar | None
    leg: str = ""


def moving_masses(machine: Machine, configuration: Configuration) -> list[Mass]:
    """Every link that can move, and the platform with its tool.

    A link counts from joint to joint with its whole length: a telescopic leg as a bar as long as the pose makes it.

    Args:
        machine: says which links there are, their densities, and the mass of the platform.
        configuration: of it, at its pose.
    """
    platform = machine.tables["tool"].mass
    links = [Mass(link.name, _weighed(link), link.leg) for link in _members(machine, configuration)]
    return [*links, Mass(PLATFORM, None if is_zero(platform) else platform)]


def moving_mass(machine: Machine, configuration: Configuration) -> Scalar:
    """What all those weigh together of which a mass is known, kg; arguments as for `moving_masses`."""
    return total([mass.mass for mass in moving_masses(machine, configuration) if mass.mass is not None])


def located_members(
    machine: Machine, configuration: Configuration, joints: Sequence[Scalar | Turn] | None
) -> list[Member]:
    """The links, with both ends of each at the pose.

    Args:
        machine, configuration: see `moving_masses`.
        joints: coordinates at the pose, of a machine written leg by leg.
    """
    if machine.family.members is None:
        links = _members(machine, configuration)
    else:
        links = machine.family.members(joints=joints, **machine.family_tables)
    return [link for link in links if link.ends is not None]


def turned_tensor(turn: Callable[[Vector], Vector], tensor: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """Turn an inertia tensor: xx, yy, zz, xy, xz, yz in the axes of a body to those of the base, R I R^T.

    Args:
        turn: turns (or mirrors) a vector with the body.
        tensor: its six entries, kg·m².
    """
    if all(is_zero(entry) for entry in tensor):
        return (0.0,) * 6
    xx, yy, zz, xy, xz, yz = tensor
    columns = [Vector(xx, xy, xz), Vector(xy, yy, yz), Vector(xz, yz, zz)]
    half = [turn(column).components() for column in columns]  # R I, by columns
    rows = [turn(Vector(*row)).components() for row in zip(*half, strict=True)]
    return tuple(rows[i][j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))


def _weighed(link: Member) -> Scalar | None:
    return None if is_zero(link.mass) else link.mass


def _members(machine: Machine, configuration: Configuration) -> list[Member]:
    family = machine.family
    if family.members is not None:
        return family.members(**machine.family_tables)
    members = []
    for kind in family.links:
        given = [getattr(machine.tables[table], kind.name) for table in LINK_TABLES]
        placed = kind.lengths(configuration.legs, configuration.platform.translation, machine.tables["geometry"])
        for i, (leg, name, length, ends) in enumerate(placed):
            density, bending, expansion, rise = given if kind.count is None else (entries[i] for entries in given)
            beside = sum(other == leg for other, *_ in placed) if leg else 1  # pairs of bars lengthen their leg once
            growth = growth_of(expansion, rise, kind.name) * length * (1.0 / beside)
            members.append(Member(leg, name, length, density * length, bending, growth, ends))
    return members
