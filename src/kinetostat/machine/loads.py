"""Masses and loads of a machine at a pose: what moves, what it weighs, and the wrench on the platform.

Loads on the platform are those of [load], those of each [load.NAME], and the weights of the platform with its tool and
of the payload. A machine whose file has named loads gets a family of its own, whose files have these tables. Weights of
links are loads on legs and have their place in `equilibrium`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar, cos, is_zero, reciprocal, sin, total, where
from kinetostat.algebra.screw import Wrench
from kinetostat.algebra.vector import ZERO, Displacement, Vector, rotation_along
from kinetostat.frozen import dataclass
from kinetostat.machine.common_tables import Load
from kinetostat.machine.leg import Turn
from kinetostat.machine.links import LINK_TABLES, LinkKind, growth_of
from kinetostat.machine.machine import Configuration, Family, Machine, Member, springs
from kinetostat.machine.parameters import KEPT_FAMILIES, LONGEST_NAME
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import quantities

PLATFORM, PAYLOAD = "platform and tool", "payload"
"""Names of the masses that move with the platform."""
MOST_LOADS = 16
"""Named loads that a machine may have: far more than anybody writes by hand, so that more of them are a mistake."""


@dataclass(frozen=True)
class Mass:
    """The mass of one part at a pose.

    Attributes:
        name: the name of the link, or `PLATFORM`.
        mass: kg; None where nothing says it.
        leg: the leg that it belongs to; empty for the platform and for a link that is not counted to a leg.
    """

    name: str
    mass: Scalar | None
    leg: str = ""


def moving_masses(machine: Machine, configuration: Configuration) -> list[Mass]:
    """Every link that can move, and the platform with its tool.

    A link counts from joint to joint with its whole length: a telescopic leg as a bar as long as the pose makes it.

    Args:
        machine: says which links there are, their densities, and the mass of the platform.
        configuration: the configuration of the machine at its pose.
    """
    platform = machine.tables["tool"].mass
    links = [Mass(link.name, _known_mass(link), link.leg) for link in _members(machine, configuration)]
    return [*links, Mass(PLATFORM, None if is_zero(platform) else platform)]


def moving_mass(machine: Machine, configuration: Configuration) -> Scalar:
    """The sum of all masses that are known, kg; arguments as for `moving_masses`."""
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
    turned_columns = [turn(column).components() for column in columns]  # of R I
    rows = [turn(Vector(*row)).components() for row in zip(*turned_columns, strict=True)]
    return tuple(rows[i][j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))


def _known_mass(link: Member) -> Scalar | None:
    return None if is_zero(link.mass) else link.mass


def _members(machine: Machine, configuration: Configuration) -> list[Member]:
    """The links of a machine; those of one that is written leg by leg without their places."""
    if machine.family.members is not None:
        return machine.family.members(**machine.family_tables)
    return [member for kind in machine.family.links for member in _members_of_kind(kind, machine, configuration)]


def _members_of_kind(kind: LinkKind, machine: Machine, configuration: Configuration) -> Iterator[Member]:
    """The links of one kind of a family in closed form."""
    columns = [getattr(machine.tables[table], kind.name) for table in LINK_TABLES]  # densities, E I, expansions, rises
    placed = kind.placed_links(configuration.legs, configuration.platform.translation, machine.tables["geometry"])
    for i, link in enumerate(placed):
        density, bending, expansion, rise = (entry if kind.count is None else entry[i] for entry in columns)
        # Bars beside each other lengthen their leg as one of them does: each counts as its share of that.
        parallel = sum(other.leg == link.leg for other in placed) if link.leg else 1
        growth = growth_of(expansion, rise, kind.name) * link.length * (1.0 / parallel)
        yield Member(**link._asdict(), mass=density * link.length, bending=bending, growth=growth)


def family_with_loads(family: Family, document: Document, origin: str) -> Family:
    """The family whose machine files have a table for each named load of a document; itself without any.

    Raises:
        InputError: a name that cannot be one, or too many of them.
    """
    load = document.get("load")
    entries = load.items() if isinstance(load, dict) else ()
    tables = {key: value for key, value in entries if isinstance(value, dict) and key not in quantities(Load)}
    names = tuple(key for key, value in tables.items() if not _is_misspelt_vector(value))
    if len(names) > MOST_LOADS:
        raise InputError(f'"{origin}": [load] has {len(names)} named loads; at most {MOST_LOADS} are allowed.')
    for name in names:
        if not name.isidentifier() or len(name) > LONGEST_NAME:
            raise InputError(
                f'"{origin}": [load.{shorten(name)}] cannot be the name of a load; take letters, digits and _, at most '
                f"{LONGEST_NAME} of them, e.g. [load.counterweight]."
            )
    return _with_loads(family, names) if names else family


def _is_misspelt_vector(table: Mapping[str, Any]) -> bool:
    """Whether a table is what `--set load.forse.0=1` makes of a field of [load] that there is not: keys are numbers."""
    return all(key.isdecimal() for key in table)


@lru_cache(KEPT_FAMILIES)
def _with_loads(family: Family, names: tuple[str, ...]) -> Family:
    return replace(family, loads=names, recipe=(_with_loads, (family, names)))


@dataclass(frozen=True)
class PlatformMass:
    """A mass that moves with the platform.

    Attributes:
        name: `PLATFORM` or `PAYLOAD`.
        centre: its centre of mass at the pose, base frame, m.
        mass: kg.
        inertia: the inertia about the centre, in the axes of the platform: xx, yy, zz, xy, xz, yz, kg·m².
    """

    name: str
    centre: Vector
    mass: Scalar
    inertia: Sequence[Scalar]


def platform_masses(machine: Machine, platform: Displacement) -> list[PlatformMass]:
    """Return the masses of the platform with its tool and of the payload; those that are zero are left out.

    Args:
        machine: the machine with its table [tool].
        platform: the placement of the platform, base frame.
    """
    tool = machine.tables["tool"]
    payload = machine.tool_point(platform) + platform.rotation.apply(Vector(*tool.payload_centre))
    masses = (
        PlatformMass(PLATFORM, platform.apply(Vector(*tool.centre_of_mass)), tool.mass, tool.inertia),
        PlatformMass(PAYLOAD, payload, tool.payload, tool.payload_inertia),
    )
    return [part for part in masses if not (is_zero(part.mass) and all(is_zero(entry) for entry in part.inertia))]


def gravity_of(load: Load) -> Vector:
    """Return the acceleration by gravity, turned as the machine is tilted, base axes, m/s²; over any scalars."""
    upright, axis = Vector(*load.gravity), Vector(*load.gravity_axis)
    if is_zero(load.gravity_angle) or all(is_zero(part) for part in load.gravity):
        return upright
    size = axis.norm()
    axis = axis * reciprocal(where(size > 0.0, size, 1.0))
    return rotation_along(axis, cos(load.gravity_angle), sin(load.gravity_angle)).apply(upright)


def load_on_platform(machine: Machine, platform: Displacement) -> Wrench:
    """Add up all loads on the platform, its weight and that of the payload among them.

    Args:
        machine: the machine with its loads.
        platform: the placement of the platform.

    Returns:
        The wrench at the tool point, base axes (N·m, N).
    """
    tool, gravity = machine.tool_point(platform), gravity_of(machine.tables["load"])
    load = machine.load
    forces = [(platform.apply(point), wrench) for point, wrench in machine.named_loads]
    if not all(is_zero(part) for part in gravity.components()):
        masses = platform_masses(machine, platform)
        forces += [(part.centre, Wrench(ZERO, gravity * part.mass)) for part in masses]
    for point, wrench in forces:
        moment = load.rotational + wrench.rotational + (point - tool).cross(wrench.translational)
        load = Wrench(moment, load.translational + wrench.translational)
    return load


def loads_left_out(machine: Machine, configuration: Configuration) -> str:
    """Say which loads of a file an analysis of the free machine does not count; empty if it counts all.

    Args:
        machine: the machine with its loads.
        configuration: the configuration of the machine.
    """
    weights = [part.mass for part in moving_masses(machine, configuration) if part.name != PLATFORM and part.mass]
    rises = vars(machine.tables["temperature_rise"]).values() if "temperature_rise" in machine.tables else ()
    left_out = []
    if weights and any(gravity_of(machine.tables["load"]).components()):
        left_out.append(f"the weight of the links ({machine.display.show(sum(weights), 'kg')})")
    if any(spring.preload for spring in springs(configuration)):
        left_out.append("preloads")
    if any(np.any(rise) for rise in rises):
        left_out.append("the growth of warm links")
    return f"Not counted here, but by analyze --loaded: {', '.join(left_out)}." if left_out else ""


def platform_is_loaded(machine: Machine) -> bool:
    """Whether the file of a machine loads its platform: by a wrench that is not zero, or by its weight."""
    tool = machine.tables["tool"]
    wrenches = [machine.load, *(wrench for _, wrench in machine.named_loads)]
    weighs = any(gravity_of(machine.tables["load"]).components()) and any((tool.mass, tool.payload))
    return weighs or any(any(wrench.components()) for wrench in wrenches)
