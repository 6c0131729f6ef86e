"""Links of a machine at rest under load: motions of their ends, and struts that bend away. Nothing is solved here.

A strut is what carries forces along one line: the straight part of a leg between its only two passive joints, or a bar
of a parallelogram. Both its ends are free to turn, so that it bends like a column between two hinges, at Euler's load;
the load factor knows springs only. A telescopic leg counts as if its weakest part were as long as the whole leg, which
is on the safe side.

Source: theory (35) and (43).
"""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from kinetostat.algebra.screw import Twist
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.equilibrium.balance import Balance
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.loading import DeflectedLink, leg_links
from kinetostat.machine.leg import Leg, Line
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Member
from kinetostat.machine.rods import rods
from kinetostat.numerics.motions import Motions


def loaded_links(equations: Balance, legs: tuple[Leg, ...], origin: Vector) -> tuple[DeflectedLink, ...]:
    """All links of a machine at one pose, with the exact motions of their ends.

    Args:
        equations: the equations at the state of rest of one pose.
        legs: the legs of the machine without loads.
        origin: its tool point there, m.
    """
    mechanism, state = equations.mechanism, equations.state
    length = float(mechanism.length[0])
    links: list[DeflectedLink] = []
    given = np.concatenate([state.amounts, mechanism.growth], axis=1)
    for leg, elastic, coordinates in zip(legs, mechanism.legs, state.coordinates, strict=True):
        placed = elastic.chain.place(coordinates, given).before
        bodies = [placed[number] for number in elastic.motion_counts]
        links += leg_links(leg, partial(_point_motion, bodies, origin, length))
    return tuple(links)


def _point_motion(bodies: Sequence[Motions], origin: Vector, length: float, body: int, point: Vector) -> Twist:
    """Motion of a point (m) of one of the bodies, rad and m."""
    at = np.array([(point - origin).components()], dtype=float) / length
    turned = Vector(*bodies[body].amounts()[0, :3].tolist())
    return Twist(turned, Vector(*(length * (bodies[body].point(at) - at))[0].tolist()))


@dataclass(frozen=True)
class Strut:
    """A strut with its compression and the load at which it bends away.

    Attributes:
        name: the name of the link.
        leg: name of the leg that it belongs to.
        length: distance of its hinges, m.
        compression: force that presses it, N; negative where it is pulled.
        euler_load: the compression at which it bends away, N.
    """

    name: str
    leg: str
    length: float
    compression: float
    euler_load: float

    @property
    def factor(self) -> float:
        """Factor by which its compression may grow until it bends away; infinite where it is pulled."""
        return self.euler_load / self.compression if self.compression > 0.0 else math.inf

    @property
    def bends_away(self) -> bool:
        """Whether it is pressed with more than Euler's load."""
        return self.factor < 1.0


def struts(legs: Sequence[Leg], members: Sequence[Member], reference: Vector, equations: Balance) -> list[Strut]:
    """Find the struts whose E I is known, and what presses them at a state of rest.

    Args:
        legs: the legs of the machine at its pose, base frame.
        members: its links.
        reference: the tool point, base frame, m.
        equations: the equations at the state of rest of one pose.
    """
    result = []
    force, length = float(equations.mechanism.force[0]), float(equations.mechanism.length[0])
    units = np.array([force * length] * 3 + [force] * 3)
    for leg, wrench in zip(legs, equations.state.wrenches, strict=True):
        links = [link for link in members if link.leg == leg.name and float(link.bending) > 0.0]
        lines = _lines(leg, equations.mechanism.ways.shape[1])
        if not (links and lines):
            continue
        pulls = _pulls(lines, wrench[0] * units, reference)
        if len(lines) == 1:
            size = float(rods([leg])[0].length)
            weakest = min(float(link.bending) for link in links)
            result.append(Strut(leg.name, leg.name, size, -pulls[0], _euler(weakest, size)))
            continue
        bars = [link for link in links if _across_parallelogram(leg, link)]
        for bar, pull in zip(bars, pulls, strict=False):
            size = float(bar.length)
            result.append(Strut(bar.name, leg.name, size, -pull, _euler(float(bar.bending), size)))
    return result


def _lines(leg: Leg, ways: int) -> list[Line]:
    """The lines along which a leg carries forces and nothing else, each from base to platform; none of other legs.

    Args:
        leg: the leg at its pose.
        ways: how many freedoms a body has in the machine: 6, or 3 in a plane.
    """
    if len(leg.lines) > 1:
        return list(leg.lines)
    alone = len(leg.lines) == 1 or len(leg.passive) - len(leg.idle) == ways - 1
    return [Line(rod.end, rod.span * (1.0 / rod.length)) for rod in rods([leg]) if alone]


def _across_parallelogram(leg: Leg, link: Member) -> bool:
    """Tell whether a link is a bar of a leg's parallelogram: its ends are on both sides of it."""
    if link.ends is None:
        return False
    (first, _), (last, _) = link.ends()
    return any(isinstance(element, Parallelogram) for element in leg.chain[first:last])


def _pulls(lines: Sequence[Line], wrench: Array, reference: Vector) -> list[float]:
    """The pulls of lines that together come nearest to a wrench of the platform on their leg, N."""
    columns = np.array([line.wrench(reference).components() for line in lines], dtype=float).T
    return [float(pull) for pull in np.linalg.lstsq(columns, wrench, rcond=None)[0]]


def _euler(bending: float, length: float) -> float:
    return math.pi**2 * bending / length**2
