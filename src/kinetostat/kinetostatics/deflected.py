"""The deflected shape: where every joint and link of a loaded machine moves, to first order. One pose.

Source: theory (31) and (32).
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import isinf

import numpy as np

from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.loading import deflection, spring_loads
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Element, Joint, Leg, Spring


@dataclass(frozen=True)
class DeflectedLink:
    """A link of a leg with the small motions of its ends.

    Attributes:
        leg: its name.
        start, end: before the load, base frame, m.
        start_motion, end_motion: rotation (rad) and displacement (m) of each end, at that end, base axes.
    """

    leg: str
    start: Vector
    end: Vector
    start_motion: Twist
    end_motion: Twist

    def point(self, share: float, factor: float) -> Vector:
        """The point at a share of the link once it has bent, displacements times `factor`; base frame, m.

        Cubic between its ends, as a beam without load between them bends.
        """
        span, s = self.end - self.start, share
        turned = [motion.rotational.cross(span) for motion in (self.start_motion, self.end_motion)]
        shift = (
            self.start_motion.translational * (2 * s**3 - 3 * s**2 + 1)
            + turned[0] * (s**3 - 2 * s**2 + s)
            + self.end_motion.translational * (3 * s**2 - 2 * s**3)
            + turned[1] * (s**3 - s**2)
        )
        return self.start + span * s + shift * factor


@dataclass(frozen=True)
class Deflection:
    """Small motions of a loaded machine.

    Attributes:
        load: at the tool point, base axes, N·m and N.
        motion: of the tool point, rad and m.
        links: deflected links of the legs.
    """

    load: Wrench
    motion: Twist
    links: tuple[DeflectedLink, ...]


def deflected_links(response: Response, load: Wrench) -> list[DeflectedLink]:
    """All links of a machine under a wrench at its tool point (N·m; N, base axes).

    Springs give as they are loaded; passive joints and free springs move so that each leg's end follows the platform
    (least squares of J_p q = t - J_e d, which has a solution because the statics hold).
    """
    platform = deflection(response.statics, load)
    loads = iter(spring_loads(response, load))
    links: list[DeflectedLink] = []
    for leg, screws in zip(response.configuration.legs, response.legs, strict=True):
        pairs = [(twist, soft, next(loads)) for twist, soft in zip(screws.elastic, screws.compliance, strict=True)]
        elastic = [None if isinf(soft) else twist * (load * soft) for twist, soft, load in pairs]
        free = [twist for twist, soft, _ in pairs if isinf(soft)]
        passive = [joint.twist(response.reference) for joint in leg.passive]
        left = platform - _sum([twist for twist in elastic if twist is not None])
        turned = _following([*passive, *free], left, float(response.configuration.length))
        freed = iter(turned[len(passive) :])
        given = [next(freed) if twist is None else twist for twist in elastic]
        bodies = _bodies(leg, iter(turned[: len(passive)]), iter(given))
        links += leg_links(leg, partial(_twist_at, bodies, response.reference))
    return links


def leg_links(leg: Leg, moved: Callable[[int, Vector], Twist]) -> Iterator[DeflectedLink]:
    """The links between the points of a chain.

    Args:
        leg: at the pose.
        moved: the motion, in base axes (rad, m), of a point of the body after so many elements.
    """
    at: Vector | None = None
    leaving = 0
    for number, element in enumerate(leg.chain):
        points = _points(element)
        for n, point in enumerate(points):
            body = number + (n > 0)
            if at is not None and (point - at).norm() > 0.0:
                yield DeflectedLink(leg.name, at, point, moved(leaving, at), moved(body, point))
            at, leaving = point, body
        if len(points) == 1:
            leaving = number + 1


def _following(passive: Sequence[Twist], left: Twist, length: float) -> list[Twist]:
    """Motions of the passive joints that add up to `left`, by least squares; `length` (m) makes rows comparable."""
    if not passive:
        return []
    scale = np.repeat([length, 1.0], 3)
    columns = np.array([twist.components() for twist in passive], dtype=float).T * scale[:, None]
    amounts = np.linalg.lstsq(columns, np.array(left.components(), dtype=float) * scale, rcond=1e-9)[0]
    return [twist * float(amount) for twist, amount in zip(passive, amounts, strict=True)]


def _bodies(leg: Leg, turned: Iterator[Twist], given: Iterator[Twist]) -> list[Twist]:
    """Motions of the bodies before, between and after the elements of a chain, added up from the base."""
    motions = [Twist(ZERO, ZERO)]
    for element in leg.chain:
        moves = [next(turned) for _ in element.freedoms] + [next(given) for _ in element.springs]
        motions.append(motions[-1] + _sum(moves))
    return motions


def _twist_at(bodies: Sequence[Twist], reference: Vector, body: int, point: Vector) -> Twist:
    return bodies[body].moved(point - reference)


def _points(element: Element) -> tuple[Vector, ...]:
    """The points of the chain at which an element lies: none for a slide."""
    if isinstance(element, Joint | Spring):
        point = element.mover.point
        return () if point is None else (point,)
    return element.path


def _sum(twists: Sequence[Twist]) -> Twist:
    result = Twist(ZERO, ZERO)
    for twist in twists:
        result = result + twist
    return result
