"""Loads on the platform: the wrench of [load], those of the tables [load.NAME], and the weight of what it carries.

A machine whose file has named loads gets a family of its own, whose files have these tables. Weights of links are loads
on legs and have their place in `equilibrium`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from kinetostat.algebra.scalar import Scalar, cos, is_zero, reciprocal, sin, where
from kinetostat.algebra.screw import Wrench
from kinetostat.algebra.vector import ZERO, Displacement, Vector, rotation_along
from kinetostat.machine.common_tables import Load
from kinetostat.machine.machine import Configuration, Family, Machine, springs
from kinetostat.machine.mass import PAYLOAD, PLATFORM, moving_masses
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import quantities

KEPT = 64
"""Families with named loads that are kept, so that machines with the same names share tables and compiled programs."""
MOST_LOADS = 16
"""Named loads of a machine: more is a mistake."""


def family_with_loads(family: Family, document: Document, origin: str) -> Family:
    """The family whose machine files have a table for each named load of a document; itself without any.

    Raises:
        InputError: a name that cannot be one, or too many of them.
    """
    load = document.get("load")
    entries = load.items() if isinstance(load, dict) else ()
    tables = {key: value for key, value in entries if isinstance(value, dict) and key not in quantities(Load)}
    names = tuple(key for key, value in tables.items() if not all(entry.isdecimal() for entry in value))
    if len(names) > MOST_LOADS:
        raise InputError(f'"{origin}": [load] has {len(names)} named loads; at most {MOST_LOADS} are allowed.')
    for name in names:
        if not name.isidentifier() or len(name) > 40:
            raise InputError(
                f'"{origin}": [load.{shorten(name)}] cannot be the name of a load; take letters, digits and _, at most '
                "40 of them, e.g. [load.counterweight]."
            )
    return _with_loads(family, names) if names else family


@lru_cache(KEPT)
def _with_loads(family: Family, names: tuple[str, ...]) -> Family:
    return replace(family, loads=names, recipe=(_with_loads, (family, names)))


@dataclass(frozen=True)
class PlatformMass:
    """A mass that moves with the platform.

    Attributes:
        name: `PLATFORM` or `PAYLOAD`.
        centre: of it at the pose, base frame, m.
        mass: kg.
        inertia: about the centre, in the axes of the platform: xx, yy, zz, xy, xz, yz, kg·m².
    """

    name: str
    centre: Vector
    mass: Scalar
    inertia: Sequence[Scalar]


def platform_masses(machine: Machine, platform: Displacement) -> list[PlatformMass]:
    """Return the masses of the platform with its tool and of the payload; those that are zero are left out.

    Args:
        machine: with its table [tool].
        platform: where it is, base frame.
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
        machine: with its loads.
        platform: where it is.

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
    """Say which loads of a file an answer to first order does not count; empty if it counts all.

    Args:
        machine: with its loads.
        configuration: of it.
    """
    weights = [part.mass for part in moving_masses(machine, configuration) if part.name != PLATFORM and part.mass]
    parts = []
    if weights and any(gravity_of(machine.tables["load"]).components()):
        parts.append(f"the weight of the links ({machine.display.show(sum(weights), 'kg')})")
    if any(spring.preload for spring in springs(configuration)):
        parts.append("preloads")
    if "temperature_rise" in machine.tables and any(
        np.any(rise) for rise in vars(machine.tables["temperature_rise"]).values()
    ):
        parts.append("the growth of warm links")
    return f"Not counted here, but by analyze --loaded: {', '.join(parts)}." if parts else ""


def loads_platform(machine: Machine) -> bool:
    """Whether the file of a machine loads its platform: by a wrench that is not zero, or by its weight."""
    tool = machine.tables["tool"]
    wrenches = [machine.load, *(wrench for _, wrench in machine.named_loads)]
    weighs = any(gravity_of(machine.tables["load"]).components()) and any((tool.mass, tool.payload))
    return weighs or any(any(wrench.components()) for wrench in wrenches)
