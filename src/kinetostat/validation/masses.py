"""Masses as another program can build them: those of platform and payload, and links with the bodies that carry them.

Knows no engine, and no mass matrix: it reads masses, centres, inertias and ends of links.
"""

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.machine.drives import numbers_of_drive, values_of_drives
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import Configuration, Machine, Member
from kinetostat.validation.pieces import array, bodies_before, columns


@dataclass(frozen=True)
class Heavy:
    """A rigid mass on a body.

    Attributes:
        mass: kg.
        centre: of it, base frame, m [3].
        inertia: about that centre, base axes, kg·m² [3 x 3].
    """

    mass: float
    centre: Array
    inertia: Array


@dataclass(frozen=True)
class HeavyLink:
    """A link that has a mass.

    Attributes:
        name: of the link.
        mass: kg.
        leg: number of its leg, from 0.
        bodies: which bodies of the leg carry its ends, or its centre of mass; counted from the base, which is 0.
        points: those ends or that centre, base frame, m.
        inertia: about that centre, base axes, kg·m² [3 x 3]; zero of a uniform rod between its ends.
    """

    name: str
    mass: float
    leg: int
    bodies: tuple[int, ...]
    points: tuple[Array, ...]
    inertia: Array


def on_platform(machine: Machine, place: Displacement) -> Iterator[Heavy]:
    """Give the platform with its tool, and the payload, as far as they have a mass.

    Args:
        machine: with the table [tool].
        place: of the platform at its pose.
    """
    tool = machine.tables["tool"]
    axes = columns(place.rotation)
    centre = place.apply(Vector(*tool.centre_of_mass))
    payload = place.apply(Vector(*tool.offset)) + place.rotation.apply(Vector(*tool.payload_centre))
    parts = (tool.mass, centre, tool.inertia), (tool.payload, payload, tool.payload_inertia)
    for mass, point, entries in parts:
        inertia = axes @ matrix_of(entries) @ axes.T
        if mass or np.any(inertia):
            yield Heavy(float(mass), array(point), inertia)


def links(members: Iterable[Member], configuration: Configuration, struts: bool = True) -> Iterator[HeavyLink]:
    """Give the links that have a mass; without the leg in its name, a link is in the leg that has no actuator.

    Args:
        members: the links, with both ends of each.
        configuration: the legs in which they are.
        struts: whether struts are single pieces of their legs, see `pieces`.

    Raises:
        InputError: if a link has its mass within a part that another program cannot cut.
    """
    for link in members:
        if not link.mass:
            continue
        number, leg = next(
            (i, leg)
            for i, leg in enumerate(configuration.legs)
            if (leg.name == link.leg if link.leg else leg.number is None)
        )
        stations = _stations(link)
        bodies = tuple(bodies_before(leg, station, configuration.plane, struts) for station in stations)
        points = tuple(array(point) for _, point in stations)
        inertia = np.zeros((3, 3)) if link.inertia is None else matrix_of(link.inertia())
        yield HeavyLink(link.name, float(link.mass), number, bodies, points, inertia)


def matrix_of(tensor: Sequence[Scalar]) -> Array:
    """Return an inertia tensor, xx, yy, zz, xy, xz, yz, as a matrix [3 x 3]."""
    xx, yy, zz, xy, xz, yz = (float(entry) for entry in tensor)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def thin_rod(mass: float, start: Array, end: Array) -> Heavy:
    """Return a straight uniform rod (kg) between two points (m), without inertia about its own axis."""
    span = end - start
    return Heavy(mass, 0.5 * (start + end), mass / 12.0 * ((span @ span) * np.eye(3) - np.outer(span, span)))


def one_body(parts: Sequence[Heavy]) -> Heavy:
    """Return parts of a rigid body as one."""
    mass = sum(part.mass for part in parts)
    centre = sum((part.mass * part.centre for part in parts), np.zeros(3)) / mass
    arms = [part.centre - centre for part in parts]
    inertia = sum(
        (p.inertia + p.mass * (a @ a * np.eye(3) - np.outer(a, a)) for p, a in zip(parts, arms, strict=True)),
        np.zeros((3, 3)),
    )
    return Heavy(mass, centre, inertia)


def has_rotors(machine: Machine) -> bool:
    """Whether rotors of actuators have an inertia."""
    return any(values_of_drives(machine, "drives.rotor_inertia"))


def rotor_inertia(machine: Machine, spring: Spring) -> float:
    """Return the inertia of a rotor as its actuator feels it, kg where that slides and kg·m² where it turns.

    A screw turns the rotor once per lead, a gear as often as its ratio says.
    """
    drives = numbers_of_drive(machine, "drives", spring)
    turns = 2.0 * math.pi / drives.lead if spring.joint.point is None else drives.ratio
    return float(drives.rotor_inertia) * turns**2


def _stations(link: Member) -> tuple[tuple[int, Vector], ...]:
    if link.centre is not None:
        return (link.centre(),)
    return () if link.ends is None else link.ends()
